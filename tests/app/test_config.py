import subprocess
import sys
from pathlib import Path

import pytest
from commands import run_command
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from ffd_lightning.app.checks import validate
from ffd_lightning.app.cli import register, run_suffix
from ffd_lightning.app.config import (
    LearningRateDecay,
    TrainConfig,
    Weighting,
    typed_config,
)
from ffd_lightning.data.categories import SYNSETS
from ffd_lightning.errors import ConfigError

ROOT = Path(__file__).parents[2]


def composed(*overrides):
    register()
    with initialize_config_dir(str(ROOT / "conf"), version_base="1.3"):
        return compose("train", list(overrides))


@pytest.mark.parametrize(
    ("regime", "row"),
    [
        ("b", (0.1, Weighting.identity, 0, 0)),
        ("w", (0.001, Weighting.log, 0, 0)),
        ("e", (0.1, Weighting.identity, 100, 0)),
        ("r", (0.1, Weighting.identity, 0, 1)),
    ],
)
def test_regimes_are_the_papers_second_table(regime, row):
    r = typed_config(composed(f"regime={regime}"), TrainConfig).regime
    assert (r.min_weight, r.weighting, r.entropy_weight, r.offset_weight) == row


def test_the_paper_schedule_is_the_papers():
    cfg = typed_config(composed("schedule=paper", "templates=t30"), TrainConfig)
    s = cfg.schedule
    assert (s.steps, s.annealing_steps, s.batch_size, s.num_points) == (100_000, 10_000, 32, 1024)
    assert (s.learning_rate, s.learning_rate_decay) == (1e-3, LearningRateDecay.none)
    assert (cfg.templates.count, cfg.templates.max_edge, cfg.data.num_points) == (30, 0.02, 16384)
    assert (cfg.network.bottleneck, cfg.network.hidden, cfg.network.degrees) == (64, 512, (3, 3, 3))
    assert (cfg.data.render.height, cfg.data.render.width, cfg.encoder.width) == (192, 256, 0.25)


def test_regimes_combine():
    cfg = typed_config(composed("regime=e", "regime.offset_weight=1"), TrainConfig)
    assert (cfg.regime.entropy_weight, cfg.regime.offset_weight) == (100, 1)


@pytest.mark.parametrize("category", sorted(SYNSETS))
def test_every_category_has_its_synset(category):
    assert (
        typed_config(composed(f"category={category}"), TrainConfig).category.synset
        == SYNSETS[category]
    )


@pytest.mark.parametrize(
    "group", ["category", "regime", "templates", "schedule", "trainer", "data"]
)
def test_every_option_of_every_group_composes(group):
    needed = {"category": "category.name=mug", "data": "data.root=."}
    for file in (ROOT / "conf" / group).glob("*.yaml"):
        extra = [needed[group]] if file.stem in ("custom", "folder") else []
        typed_config(composed(f"{group}={file.stem}", *extra), TrainConfig)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["regime=x"], ["no regime 'x'", "b, e, r, w"]),
        (["category=tabel"], ["no category 'tabel'", "Did you mean category=table", "watercraft"]),
        (["regime.offst_weight=1"], ["Did you mean regime.offset_weight", "min_weight"]),
        (["schdule=quick"], ["Did you mean schedule"]),
        (["schedule.steps=abc"], ["schedule.steps", "abc", "Integer"]),
        (["regime.weighting=cubic"], ["cubic", "identity, log"]),
        (["templates=30"], ["t30"]),
        (["category=custom"], ["category.name=..."]),
        (["-m", "regime=b,ww", "category=table"], ["no regime 'ww'", "b, e, r, w"]),
        (["+surprise=1"], ["surprise"]),
        (["data=folder"], ["data.root"]),
        (["data=folder", "data.root=/no/such/place"], ["/no/such/place"]),
        (["regime"], ["group=option"]),
        (["regime=b,e"], ["regime=b,e", "commas", "-m"]),
    ],
)
def test_mistakes_on_the_command_line_get_one_message(arguments, words, tmp_path):
    paths = (f"paths.runs={tmp_path}/runs", f"paths.data={tmp_path}/data")
    result = run_command("train", *arguments, *paths)
    assert result.returncode != 0
    message = result.stderr.strip().splitlines()
    assert "Traceback" not in result.stdout + result.stderr
    assert len(message) == 1, message
    for word in words:
        assert word in message[0]
    assert not (tmp_path / "data").exists()


@pytest.mark.parametrize(
    ("overrides", "word"),
    [
        (["templates.strategy=listed"], "templates.file"),
        (["templates=t1", "regime=w"], "single template"),
        (["schedule.num_points=20000"], "data.num_points"),
        (["schedule.batch_size=1"], "batch_size"),
        (["schedule.steps=0"], "schedule.steps"),
        (["schedule.learning_rate=-1"], "schedule.learning_rate"),
        (["network.degrees=[3,0,3]"], "degrees"),
        (["encoder.weights=/no/such.h5"], "encoder.weights"),
        (["data.train_fraction=1.0"], "train_fraction"),
        (["category.synset='123'"], "8 digits"),
        (["seed=-1"], "seed"),
        (["category=custom", "category.name=../mug"], "not a path"),
        (["data.split=listed"], r"data.split_file=FILE"),
        (["data.split=listed", "data.split_file=/no/such"], "/no/such"),
        (["data.split_file=README.md"], "needs data.split=listed"),
        (["data.parts_root=."], "goes with data=shapenet"),
        (["data.images=r2n2"], "goes with data=shapenet"),
        (["preparation.timeout=0"], "preparation.timeout"),
        (["preparation.shard=1/2"], "goes with prepare.py"),
    ],
)
def test_values_that_cannot_work_are_named(overrides, word):
    with pytest.raises(ConfigError, match=word):
        validate(typed_config(composed(*overrides), TrainConfig))


def test_a_sound_configuration_passes():
    validate(typed_config(composed(), TrainConfig))


def test_help_names_choices_and_examples():
    command = [sys.executable, "train.py", "--help"]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0
    for word in ("regime: b, e, r, w", "-m regime=b,w,e,r", "templates: t1"):
        assert word in result.stdout


def test_cfg_job_prints_everything():
    result = run_command("train", "--cfg", "job", "category=sofa")
    assert result.returncode == 0
    assert set(OmegaConf.create(result.stdout)) == set(OmegaConf.structured(TrainConfig))


def test_run_suffix_tells_overrides_apart_and_stays_short():
    assert run_suffix("") == ""
    assert run_suffix("schedule.steps=50") == "_schedule.steps-50"
    assert run_suffix("a.b=1,c=x y") == "_a.b-1+c-x-y"
    long = [run_suffix(f"a.b={'x' * 300}{i}") for i in range(2)]
    assert long[0] != long[1]
    assert max(map(len, long)) < 150
    assert "/" not in run_suffix("templates.file=/a/b.csv")
