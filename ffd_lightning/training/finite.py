"""Ends a training whose loss or weights are no longer finite, before a checkpoint holds them."""

from collections.abc import Mapping, Sequence
from typing import Any

import torch
from lightning import LightningModule, Trainer
from torch import Tensor

from ffd_lightning.errors import ConfigError

_UNREAD = 50  # losses that are left on the device: a GPU's host waits when it reads one
_WAY_OUT = (
    "Look for divisions by 0 and for roots of 0, whose gradients are infinite; a lower learning "
    "rate or weight of a term may help. No checkpoint is written of it: one that is there is of an "
    "earlier step and finite, and training goes on from it once the cause is mended"
)


class FiniteLosses:
    """Reads losses every 50 batches and when asked to; the first not finite ends a training."""

    def __init__(self) -> None:
        self._unread: list[tuple[int, dict[str, Tensor]]] = []

    def add(self, step: int, parts: dict[str, Tensor], trainer: Trainer) -> None:
        """Take what a loss is made of, see `Objective.parts`."""
        self._unread.append((step, parts))
        if len(self._unread) == _UNREAD:
            self.read(trainer)

    def read(self, trainer: Trainer) -> None:
        """Read all losses since the last time; all devices do so at the same steps."""
        unread, self._unread = self._unread, []
        first = _first_non_finite([list(parts.values())[-1] for _, parts in unread], trainer)
        if first is not None:
            step, parts = unread[first]
            cause = list(parts)[_first_non_finite(list(parts.values()), trainer) or 0]
            raise ConfigError(
                f"the loss of step {step + 1} is not finite, because of {cause}. {_WAY_OUT}"
            )

    def read_with_weights(self, module: LightningModule, state: Mapping[str, Any]) -> None:
        """Read all losses, and a module's weights in a state of it.

        Of buffers only nan counts: some are meant to be infinite.
        """
        self.read(module.trainer)
        weights = {name for name, _ in module.named_parameters()}
        for name, value in state.items():
            if isinstance(value, Tensor):
                finite = value.isfinite() if name in weights else ~value.isnan()
                if not finite.all():
                    raise ConfigError(
                        f"{name} is not finite after step {module.global_step}, because of a "
                        f"gradient. {_WAY_OUT}"
                    )


def _first_non_finite(values: Sequence[Tensor], trainer: Trainer) -> int | None:
    """Return the place of the first number that is not finite, on any device."""
    if not values:
        return None
    broken = torch.stack([~value.isfinite() for value in values]).int()
    places = torch.as_tensor(trainer.strategy.reduce(broken, reduce_op="sum")).nonzero()
    return int(places[0]) if len(places) else None
