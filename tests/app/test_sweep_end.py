"""What a sweep prints at its end, and how it ends."""

import pickle

import pytest
from analysis.folders import write_run
from hydra.core.utils import JobReturn, JobStatus
from omegaconf import OmegaConf

from ffd_lightning.app.sweep_end import SweepEnd

SCORES = {"chamfer": [0.0321, 0.0321], "emd": 0.552, "iou": 0.323}


@pytest.fixture
def runs(tmp_path):
    failed = write_run(tmp_path / "e", "e", **SCORES)
    failed.set_status("failed", reason="the disk is full")
    return [write_run(tmp_path / "b", **SCORES), failed]


def hydra_config(folder, output="", number=0):
    return OmegaConf.create(
        {
            "callbacks": {"report": False},
            "hydra": {
                "runtime": {"output_dir": str(output)},
                "sweep": {"dir": str(folder)},
                "job": {"num": number},
            },
        }
    )


def ended(callback, folder, runs, values):
    callback.on_multirun_start(hydra_config(folder))
    for number, (run, value) in enumerate(zip(runs, values, strict=True)):
        job = JobReturn()
        job.status, job.return_value = JobStatus.COMPLETED, value
        # As a launcher with processes of its own does it.
        copy = pickle.loads(pickle.dumps(callback))
        copy.on_job_end(hydra_config(folder, run.path, number), job)


def test_a_sweep_with_a_failure_exits_with_1_after_its_table(runs, tmp_path, capsys):
    callback = SweepEnd()
    ended(callback, tmp_path, runs, [SCORES, None])
    with pytest.raises(SystemExit, match="1 of 2 runs failed") as error:
        callback.on_multirun_end(hydra_config(tmp_path))
    assert str(runs[1].path) in str(error.value)
    assert "32.1" in capsys.readouterr().out
    assert sorted(p.name for p in tmp_path.iterdir()) == ["b", "e"], "nothing is left behind"


def test_a_sweep_without_an_ended_job_fails(tmp_path):
    config, callback = hydra_config(tmp_path), SweepEnd()
    callback.on_multirun_start(config)
    with pytest.raises(SystemExit, match="no job"):
        callback.on_multirun_end(config)
