"""What a sweep refuses as it begins, and how one without jobs ends; test_train.py has the rest."""

import pytest
from omegaconf import OmegaConf

from ffd_lightning.app.sweep_end import SweepEnd


def test_a_sweep_for_a_gpu_that_is_not_there_is_refused_at_once(tmp_path, monkeypatch):
    monkeypatch.setattr("torch.cuda.is_available", lambda: False)
    sweep = {"sweep": {"dir": str(tmp_path / "a")}}
    here, cluster = (
        OmegaConf.create(
            {
                "callbacks": {"report": False},
                "hydra": {"launcher": {"_target_": f"hydra.{launcher}"}, **sweep},
                "trainer": {"accelerator": "gpu"},
            }
        )
        for launcher in ("BasicLauncher", "SubmititLauncher")
    )
    with pytest.raises(SystemExit, match="there is no GPU: use trainer=auto"):
        SweepEnd().on_multirun_start(here)
    assert not (tmp_path / "a").exists()
    callback = SweepEnd()
    callback.on_multirun_start(cluster)
    with pytest.raises(SystemExit, match="no job"):
        callback.on_multirun_end(cluster)
