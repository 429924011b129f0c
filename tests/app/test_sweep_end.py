import pytest
from omegaconf import OmegaConf

from ffd_lightning.app.sweep_end import SweepEnd


def test_a_sweep_without_an_ended_job_fails(tmp_path):
    config = OmegaConf.create({"hydra": {"sweep": {"dir": str(tmp_path)}}})
    config.callbacks = {"report": False}
    callback = SweepEnd()
    callback.on_multirun_start(config)
    with pytest.raises(SystemExit, match="no job"):
        callback.on_multirun_end(config)
