"""Training regimes by name, for scripts of your own."""

from __future__ import annotations

from ffd_lightning.app.config import TrainConfig
from ffd_lightning.losses.objective import Objective


def regime(name: str, *overrides: str, annealing_steps: float = 10_000) -> Objective:
    """Return the objective of a regime of `conf/regime`.

    Args:
        name: b, w, e, r, ...
        overrides: as on the command line, without the group: `terms.offset_penalty.weight=2`,
            `+terms.my_term.weight=0.1`, `selection=my_selection`.
        annealing_steps: b_0, over which annealed weights fade by a factor of e.

    Raises:
        HydraException: no such regime.
        ConfigError: overrides that do not fit.
    """
    from ffd_lightning.app.build import build_objective
    from ffd_lightning.app.hydra_app import compose_config
    from ffd_lightning.app.schema import typed_config

    own = [f"regime={name}", *(_in_regime(override) for override in overrides)]
    cfg = typed_config(compose_config("train", TrainConfig, own), TrainConfig)
    return build_objective(cfg.regime, annealing_steps)


def _in_regime(override: str) -> str:
    """Put the group before an override, behind the signs that it begins with.

    >>> _in_regime("+terms.smoothness.weight=1"), _in_regime("selection=taught")
    ('+regime.terms.smoothness.weight=1', 'regime/selection=taught')
    """
    rest = override.lstrip("+~")
    signs = override.removesuffix(rest)
    return f"{signs}regime{'/' if rest.startswith('selection=') else '.'}{rest}"
