"""A tiny configuration, and a tiny prepared set shared by the tests that need one."""

import os

# Before torch is loaded, as train.py does it: waiting threads must not take the others' cores.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
# Two threads at most, since the suite runs in parallel; and as many in the processes that tests
# start, whose trainings are compared with those of this process to the last digit.
os.environ.setdefault("OMP_NUM_THREADS", str(min(2, os.cpu_count() or 1)))
os.environ.setdefault("MKL_DYNAMIC", "FALSE")  # MKL would take fewer where two share a core

import hypothesis
import jaxtyping
import numpy as np
import pytest
import torch
from commands import train_config
from PIL import Image

from ffd_lightning import pretrained
from ffd_lightning.app.build import build_data, build_network
from ffd_lightning.app.training_run import train
from ffd_lightning.checkpoint import load_model, model_entry
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.run_folder import RunFolder

hypothesis.settings.register_profile("any machine", deadline=None, derandomize=True, database=None)
hypothesis.settings.load_profile("any machine")

TINY = (
    "category=table",
    "templates=t2",
    "data.num_models=24",
    "data.num_points=256",
    "data.render.height=48",
    "data.render.width=64",
    "data.render.samples=1",
    "encoder.weights=none",
    "network.hidden=32",
    "network.bottleneck=8",
    "schedule.steps=8",
    "schedule.batch_size=4",
    "schedule.num_points=64",
    "trainer.val_every=4",
    "trainer.checkpoint_every=2",
    "preparation.workers=2",
    "trainer=cpu",
    "trainer.progress_bar=false",
    "callbacks.figure_examples=2",
    "callbacks.report=false",
    "evaluation.references=false",
    "protocol.points=64",
)
FEW = "paper-points-64"
"""The name of the results of runs of this configuration."""


def photo_in(folder):
    """Write `photo.png`: something brown on white."""
    picture = np.full((60, 80, 3), 255, np.uint8)
    picture[20:45, 25:60] = (120, 60, 30)
    Image.fromarray(picture).save(folder / "photo.png")


@pytest.fixture(autouse=True)
def _few_threads():
    """A test that changes the number of threads does not change that of the next ones."""
    threads = torch.get_num_threads()
    yield
    torch.set_num_threads(threads)


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
        return train_config(*TINY, f"paths.data={data_root}", *overrides)

    return make


@pytest.fixture(scope="session")
def prepared(data_root):
    """The prepared set of the tiny configuration."""
    given = ("table", 256, RenderSettings(height=48, width=64, samples=1), data_root)
    return Preparation(ProceduralSource(24), *given, workers=2, progress=False).run()


# The templates of the tiny run, of different families: one has a texture, one one colour, one
# glass and wood, one of two colours.
TRESTLE, PLAIN, GLASS, PEBBLE = ("table-000009", "table-000004", "table-000021", "table-000006")


@pytest.fixture(scope="session")
def tiny_run(tiny_config, tmp_path_factory):
    """A run of a few steps, whose network tells images apart: its folder.

    After so few steps moving averages would be of the first weights and features vanish.
    """
    folder = tmp_path_factory.mktemp("runs")
    chosen = folder / "templates.txt"
    chosen.write_text("\n".join((TRESTLE, PLAIN, GLASS, PEBBLE)))
    overrides = ("templates=t4", "template_strategy=listed", f"template_strategy.file={chosen}")
    run = RunFolder(folder / "run")
    train(tiny_config("regime=r", "network.batch_norm_momentum=1", *overrides), run)
    return run


def select(state, template):
    """Let a network select this template for every image, and still tell images apart by weights.

    What training so few steps selects depends on the processor. Hidden values lie in [0, 6], so
    what the images say moves no logit by more than 1.
    """
    weight, bias = (state[f"network.heads.logits.{name}"] for name in ("weight", "bias"))
    weight.div_(6 * weight.abs().sum(dim=1).max())
    bias.zero_()
    bias[template] = 2.2  # more than 1 - -1, and little enough to leave weight to the others


@pytest.fixture(scope="session")
def selecting(tiny_run, tmp_path_factory):
    """Return a function from a template of the tiny run to a checkpoint that selects it.

    The checkpoint is alone in a folder, and its deformations are large enough to be seen.
    """
    ids = load_model(tiny_run.checkpoint).bank.ids

    def make(template):
        content = torch.load(tiny_run.checkpoint, weights_only=True)
        select(content["state_dict"], ids.index(template))
        bias = content["state_dict"]["network.heads.offsets.bias"]
        bias.copy_(0.05 * torch.randn(bias.shape, generator=torch.Generator().manual_seed(0)))
        path = tmp_path_factory.mktemp("given") / "model.ckpt"
        torch.save(content, path)
        return path

    return make


@pytest.fixture(scope="session")
def checkpoint(selecting):
    """A checkpoint that selects a table of wood and glass: few colours, not all of them opaque."""
    return selecting(GLASS)


SOFAS, TABLES = range(2), range(2, 4)
"""The templates of the joint checkpoint."""


def begun(cfg):
    """Return the data of a configuration, and its network with the same weights each time."""
    torch.manual_seed(0)
    data, network = build_data(cfg), build_network(cfg).train()
    data.setup()
    return data, network


def written(path, data, network, step, name):
    """Write a network as the checkpoint of a run's step, with what an optimizer keeps."""
    entry = model_entry(network, data, {"run": name})
    state = {f"network.{name}": value for name, value in network.state_dict().items()}
    moments = {f"moment.{name}": torch.zeros_like(value) for name, value in state.items()}
    content = {"state_dict": state, "global_step": step, "optimizer_states": [moments], **entry}
    torch.save(content, path)
    return path


@pytest.fixture(scope="session")
def joint_checkpoint(tiny_config, tmp_path_factory):
    """A checkpoint of sofas and tables, two templates each, that has seen one batch.

    Its heaviest template is a sofa, and yet its tables are heavier together.
    """
    members = ("category=joint", "category.members=[sofa,table]", "templates=t4")
    settings = (*members, "network.offset_std=0.02", "network.batch_norm_momentum=1")
    data, network = begun(tiny_config(*settings))
    rows = (0, 1, len(data.prepared) - 2, len(data.prepared) - 1)
    images = [data.prepared.image(row)[..., :3] for row in rows]
    with torch.no_grad():
        network(torch.stack([torch.tensor(image).permute(2, 0, 1) for image in images]))
        logits = network.heads.logits
        logits.weight.mul_(0.01)
        logits.bias.copy_(torch.tensor([1.0, -2.0, 0.8, 0.7]))
    path = tmp_path_factory.mktemp("joint") / "joint.ckpt"
    return written(path, data, network, 3, "default/joint/b/t4/seed0")


@pytest.fixture(scope="session")
def conditioned_checkpoint(tiny_config, tmp_path_factory):
    """A checkpoint whose heads are told their templates, two tables, and that has seen a batch."""
    settings = ("heads=conditioned", "heads.draw=3", "templates=t2", "network.offset_std=0.02")
    data, network = begun(tiny_config(*settings, "network.batch_norm_momentum=1"))
    batch = data.store.batch(data.train_dataloader().loader.dataset[0])
    with torch.no_grad():
        network(batch.images, batch.drawn)
    path = tmp_path_factory.mktemp("conditioned") / "conditioned.ckpt"
    return written(path, data, network, 1, "default/table/b/t2/seed0")


@pytest.fixture
def shipped(joint_checkpoint, monkeypatch, tmp_path):
    """The joint checkpoint as the model that comes with the package: its place."""
    path = tmp_path / "shipped.ckpt"
    path.write_bytes(joint_checkpoint.read_bytes())
    monkeypatch.setattr(pretrained, "MODEL", path)
    return path
