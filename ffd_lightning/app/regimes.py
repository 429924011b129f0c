"""Training regimes by name, for scripts of your own."""

from __future__ import annotations

from ffd_lightning.app.config import TrainConfig
from ffd_lightning.losses.objective import Objective


def regime(name: str, *overrides: str, annealing_steps: float = 10_000) -> Objective:
    """Return the objective of a regime of `conf/regime`.

    Args:
        name: b, w, e, r, ...
        overrides: as on the command line, without the group: `terms.offset_penalty.weight=2`.
        annealing_steps: b_0, over which annealed weights fade by a factor of e.

    Raises:
        HydraException: no such regime.
        ConfigError: overrides that do not fit.
    """
    from ffd_lightning.app.build import build_objective
    from ffd_lightning.app.hydra_app import compose_config
    from ffd_lightning.app.schema import typed_config

    own = [f"regime={name}", *(f"regime.{override}" for override in overrides)]
    cfg = typed_config(compose_config("train", TrainConfig, own), TrainConfig)
    return build_objective(cfg.regime, annealing_steps)
