import pytest
import torch

from ffd_lightning.app import step_time
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.hydra_app import compose_config
from ffd_lightning.app.schema import typed_config
from ffd_lightning.app.step_time import seconds_per_step, training_times

SMALL = ["data.render.height=64", "data.render.width=64", "category=chair"]


def test_a_step_of_twice_the_work_takes_longer_and_draws_nothing():
    def measured(*overrides):
        composed = compose_config("train", TrainConfig, [*SMALL, "schedule=quick", *overrides])
        return seconds_per_step(typed_config(composed, TrainConfig), torch.device("cpu"))

    state = torch.random.get_rng_state()
    few = measured("templates=t1", "schedule.batch_size=2", "schedule.num_points=64")
    many = measured("templates=t8", "schedule.batch_size=16", "schedule.num_points=512")
    assert 0 < few < many
    assert torch.equal(torch.random.get_rng_state(), state), "training starts as without it"


@pytest.mark.parametrize(
    ("categories", "runs"), [(["chair"], 4), (["chair", "plane", "car"], 12), ([], 0)]
)
def test_runs_and_the_papers_table_are_reckoned_from_a_step(monkeypatch, categories, runs):
    seen = []

    def half_a_second(cfg, device):
        seen.append((cfg.schedule.name, cfg.templates.name, cfg.data.render.height))
        return 0.5

    monkeypatch.setattr(step_time, "seconds_per_step", half_a_second)
    head, paper, quick, *_ = training_times(SMALL, categories)
    assert seen == [("paper", "t30", 64), ("quick", "t16", 64)]
    assert "32 images of 64 x 64" in head
    assert "0.5 s a step, 100,000 steps take 13.9 h" in paper
    assert "600 steps take 5 min" in quick
    if runs:
        days = runs * 100_000 * 0.5 / 86400
        assert f"paper_table, {runs} such runs, {days:.1f} days" in paper
    else:
        assert "paper_table" not in paper


@pytest.mark.parametrize(("load", "told"), [(0.5, False), (1000.0, True)])
def test_a_busy_machine_is_told(monkeypatch, load, told):
    monkeypatch.setattr(step_time, "seconds_per_step", lambda cfg, device: 0.5)
    monkeypatch.setattr("torch.cuda.is_available", lambda: False)
    monkeypatch.setattr("os.getloadavg", lambda: (load, 0.0, 0.0))
    assert ("keeps the cores busy" in training_times(SMALL, [])[-1]) == told
