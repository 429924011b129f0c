"""Shapes that trained the weights a run starts from are not tested on unnoticed."""

import hashlib
import re

import pytest

from ffd_lightning import shapes
from ffd_lightning.app import training_run
from ffd_lightning.app.build import build_part, build_source
from ffd_lightning.app.first_weights import leak_warning
from ffd_lightning.checkpoint import read_checkpoint
from ffd_lightning.data.splits import SplitInput, make_split
from ffd_lightning.pretrained import pretrained_model
from ffd_lightning.run_folder import RunFolder

EMBEDDED = "encoder.weights=embedded"
FEWER = ("category=table", "split.train_fraction=0.6")


@pytest.fixture(scope="module")
def warned(tiny_config):
    """Return a function from overrides to the warning and the ids that are tested on."""

    def make(*overrides):
        cfg = tiny_config("data.num_models=500", EMBEDDED, *overrides)
        ids = tuple(build_source(cfg).shape_ids(cfg.category.name))
        subsets = build_part("split", cfg.split)(SplitInput(cfg.category.name, ids, (), {}))
        tested = make_split(ids, subsets, cfg.split.val_fraction).test
        return leak_warning(cfg, tested), tested

    return make


@pytest.mark.parametrize("category", shapes.categories())
def test_by_default_nothing_leaks(warned, category):
    for number in (100, 500, 2000):
        assert warned(f"category={category}", f"data.num_models={number}")[0] == ""


def test_shapes_that_trained_the_first_weights_are_counted(warned):
    text, tested = warned(*FEWER)
    model = read_checkpoint(pretrained_model())["model"]
    templates = {shape_id.partition("/")[2] for shape_id in model["templates"]["ids"]}

    def position(text):
        return int(hashlib.sha256(text.encode()).hexdigest(), 16) / 2**256

    trained = [i for i in tested if position(i) < 0.8 and i not in templates]
    validated = [i for i in trained if position(f"val/{i}") < 0.1]
    counts = len(tested), len(trained) - len(validated), len(validated)
    assert [int(n) for n in re.findall(r"(?:of|on) (\d+) ?", text)] == list(counts)
    assert min(counts) > 0
    assert "split=auto split.train_fraction=0.8" in text
    assert "encoder.weights=none" in text


@pytest.mark.parametrize(
    "other", ["encoder.weights=none", "data.seed=1", "split.train_fraction=0.9"]
)
def test_nothing_leaks_where_the_shapes_or_the_weights_are_others(warned, other):
    assert warned(*FEWER, other)[0] == ""


def test_categories_trained_together(tiny_config):
    members = ("category=joint", "category.members=[sofa,table]")
    cfg = tiny_config(EMBEDDED, *members)
    assert "of 2 shapes" in leak_warning(cfg, ["table/table-000000", "sofa/sofa-000000"])
    assert leak_warning(cfg, ["table-000000", "table/sofa-000000"]) == ""


def test_a_run_says_so_before_it_trains(tiny_config, tmp_path, caplog, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(training_run, "_trainer", stop)
    with pytest.raises(KeyboardInterrupt):
        training_run.train(tiny_config(EMBEDDED, *FEWER), RunFolder(tmp_path))
    assert "were trained on" in caplog.text
    assert "what is measured on fewer than 10 shapes says little" in caplog.text
