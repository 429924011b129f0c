"""A tiny configuration, and a tiny prepared set shared by the tests that need one."""

import os

# Before torch is loaded, as train.py does it: waiting threads must not take the others' cores.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

import jaxtyping
import pytest
import torch

from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.hydra_app import compose_config
from ffd_lightning.app.schema import typed_config
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.imaging.render_settings import RenderSettings

TINY = (
    "category=table",
    "templates=t2",
    "data.num_models=24",
    "data.num_points=256",
    "data.render.height=48",
    "data.render.width=64",
    "data.render.samples=1",
    "network.hidden=32",
    "network.bottleneck=8",
    "schedule.steps=8",
    "schedule.batch_size=4",
    "schedule.num_points=64",
    "schedule.val_every=4",
    "schedule.checkpoint_every=2",
    "preparation.workers=2",
    "trainer=cpu",
    "trainer.progress_bar=false",
    "callbacks.figure_examples=2",
    "callbacks.report=false",
    "evaluation.references=false",
)


@pytest.fixture(autouse=True)
def _few_threads():
    """Two threads at most: the suite runs in parallel."""
    torch.set_num_threads(min(2, torch.get_num_threads()))


@pytest.fixture
def unchecked():
    """Switch the checks of shapes off, to see what users see, who run without them."""
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)


@pytest.fixture(scope="session")
def data_root(tmp_path_factory):
    """Prepared data that all tests of a process share."""
    return tmp_path_factory.mktemp("data")


@pytest.fixture(scope="session")
def tiny_config(data_root):
    """Return a function from overrides to a typed, tiny configuration."""

    def make(*overrides):
        given = [*TINY, f"paths.data={data_root}", *overrides]
        return typed_config(compose_config("train", TrainConfig, given), TrainConfig)

    return make


@pytest.fixture(scope="session")
def prepared(data_root):
    """The prepared set of the tiny configuration."""
    render = RenderSettings(height=48, width=64, samples=1)
    return Preparation(
        ProceduralSource(24), "table", 256, render, data_root, workers=2, progress=False
    ).run()


@pytest.fixture(scope="session")
def tiny_run(tiny_config, tmp_path_factory):
    """A run of a few steps, whose network tells images apart: its folder.

    After so few steps moving averages would be of the first weights and features vanish.
    """
    from ffd_lightning.app.training_run import train
    from ffd_lightning.run_folder import RunFolder

    run = RunFolder(tmp_path_factory.mktemp("runs") / "run")
    train(tiny_config("regime=r", "templates=t4", "network.batch_norm_momentum=1"), run)
    return run


@pytest.fixture(scope="session")
def checkpoint(tiny_run, tmp_path_factory):
    """The run's checkpoint, alone in a folder, with deformations large enough to be seen."""
    content = torch.load(tiny_run.checkpoint, weights_only=True)
    bias = content["state_dict"]["network.heads.offsets.bias"]
    bias.copy_(0.05 * torch.randn(bias.shape, generator=torch.Generator().manual_seed(0)))
    path = tmp_path_factory.mktemp("given") / "model.ckpt"
    torch.save(content, path)
    return path
