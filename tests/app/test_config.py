"""What is composed from `conf/`, and what is said of mistakes in it."""

import os
import subprocess
import sys
from dataclasses import fields, is_dataclass
from pathlib import Path

import pytest
import torch
from commands import run_command
from omegaconf import OmegaConf

from ffd_lightning import registry
from ffd_lightning.app.build import build_module, build_network, build_objective
from ffd_lightning.app.checks import validate
from ffd_lightning.app.config import (
    Annealing,
    EvaluateConfig,
    LearningRateDecay,
    PrepareConfig,
    TrainConfig,
)
from ffd_lightning.app.hydra_app import compose_config
from ffd_lightning.app.messages import SHOWN, explain
from ffd_lightning.app.parts.objective import Weighting
from ffd_lightning.app.schema import typed_config
from ffd_lightning.data.categories import SYNSETS
from ffd_lightning.errors import ConfigError
from ffd_lightning.registry import range_problems

ROOT = Path(__file__).parents[2]


def composed(*overrides):
    return compose_config("train", TrainConfig, overrides)


def typed(*overrides):
    return typed_config(composed(*overrides), TrainConfig)


def train(*arguments):
    return subprocess.run(
        [sys.executable, "train.py", *arguments], cwd=ROOT, capture_output=True, text=True
    )


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
    r = typed(f"regime={regime}").regime
    entropy, offsets = r.terms["negative_entropy"], r.terms["offset_penalty"]
    assert (r.min_weight, r.selection.function, entropy.weight, offsets.weight) == row
    chamfer = r.terms["weighted_chamfer"]
    assert (chamfer.term, chamfer.weight, chamfer.annealing) == ("chamfer", 1, Annealing.constant)
    assert entropy.annealing is offsets.annealing is Annealing.exponential
    assert list(r.terms) == ["weighted_chamfer", "negative_entropy", "offset_penalty"]


def test_the_paper_schedule_is_the_papers():
    cfg = typed("schedule=paper", "templates=t30")
    s = cfg.schedule
    assert (s.steps, s.annealing_steps, s.batch_size, s.num_points) == (100_000, 10_000, 32, 1024)
    assert (s.learning_rate, s.learning_rate_decay) == (1e-3, LearningRateDecay.none)
    assert (cfg.templates.count, cfg.templates.max_edge, cfg.data.num_points) == (30, 0.02, 16384)
    assert (cfg.network.bottleneck, cfg.network.hidden, cfg.network.degrees) == (64, 512, (3, 3, 3))
    assert (cfg.data.render.height, cfg.data.render.width, cfg.encoder.width) == (192, 256, 0.25)


def test_the_paper_schedule_brings_the_papers_momentum():
    assert typed("schedule=paper").network.batch_norm_momentum == 0.01
    assert typed().network.batch_norm_momentum == 0.1
    assert typed("schedule=paper", "network.batch_norm_momentum=0.2").network.hidden == 512
    given = typed("network.batch_norm_momentum=0.2", "schedule=paper")
    assert given.network.batch_norm_momentum == 0.2, "what is given counts, wherever it stands"


@pytest.mark.parametrize("decay", LearningRateDecay)
def test_the_learning_rate_can_be_had_for_any_number_of_steps(decay):
    cfg = typed(f"schedule.learning_rate_decay={decay.name}", "schedule.learning_rate=0.5")
    make = build_module(cfg, build_network(cfg), {}).make_scheduler
    assert (make is None) == (decay is LearningRateDecay.none)
    for steps in range(1, 40) if make else ():
        optimizer = torch.optim.SGD([torch.zeros(1, requires_grad=True)], lr=0.5)
        schedule, rates = make(optimizer, steps), []
        for _ in range(steps):
            rates += schedule.get_last_lr()
            optimizer.step()
            schedule.step()
        assert 0 < min(rates) <= max(rates) <= 0.5
        fall = rates[rates.index(max(rates)) :]
        assert fall == sorted(fall, reverse=True)


@pytest.mark.parametrize(
    ("width", "words"),
    [
        (
            0.25,
            "encoder.weights=mobilenet_2_5_192_tf_no_top.h5 (https://github.com/fchollet/"
            "deep-learning-models/releases/download/v0.6/mobilenet_2_5_192_tf_no_top.h5), or",
        ),
        (1, "encoder.weights=mobilenet_1_0_192_tf_no_top.h5 (https://"),
        (0.3, "Keras publishes none of width 0.3: encoder.weights=FILE takes yours, or"),
    ],
)
def test_the_paper_schedule_asks_for_the_papers_weights(width, words):
    with pytest.raises(ConfigError, match=r"encoder\.weights=none") as caught:
        validate(typed("schedule=paper", f"encoder.width={width}"))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "overrides",
    [
        ["schedule=paper", "encoder.weights=none"],
        ["schedule=paper", "encoder.weights=README.md"],
        ["schedule=paper", "encoder=timm", "encoder.model=resnet18"],
        ["schedule=quick"],
        ["schedule=quick", "encoder.weights=none"],
    ],
)
def test_the_paper_schedule_takes_an_answer_and_others_do_not_ask(overrides):
    validate(typed(*overrides))


@pytest.mark.parametrize(
    ("overrides", "shrink"),
    [
        (["schedule=quick"], 2),
        (["schedule=paper"], 1),
        (["schedule=quick", "network.seen_height=null"], 1),
        (["schedule=quick", "data.render.height=96", "data.render.width=128"], 1),
        (["schedule=quick", "data.render.height=400", "data.render.width=400"], 4),
        (["schedule=quick", "data.render.height=48"], 1),
    ],
)
def test_images_are_shrunk_by_the_largest_whole_factor(overrides, shrink):
    cfg = typed(*overrides, "encoder.weights=none")
    network = build_network(cfg)
    assert network.image_size == (cfg.data.render.height, cfg.data.render.width)
    assert network.shrink == shrink


def test_weights_that_cannot_be_read_are_refused_at_once(monkeypatch):
    monkeypatch.setattr("ffd_lightning.app.parts.encoders.find_spec", lambda name: None)
    with pytest.raises(ConfigError, match=r"need h5py: pip install 'ffd_lightning\[keras\]'"):
        validate(typed("encoder.weights=README.md"))


def test_regimes_combine():
    cfg = typed("regime=e", "regime.terms.offset_penalty.weight=1")
    assert cfg.regime.terms["negative_entropy"].weight == 100
    assert cfg.regime.terms["offset_penalty"].weight == 1
    weights = build_objective(cfg.regime, 10).weights(0)
    assert weights == {"weighted_chamfer": 1, "negative_entropy": 100, "offset_penalty": 1}


def test_a_term_may_have_any_label():
    cfg = typed("+regime.terms.again.term=chamfer", "+regime.terms.again.weight=0.5")
    assert list(cfg.regime.terms)[-1] == "again"
    assert build_objective(cfg.regime, 10).weights(3)["again"] == 0.5


@pytest.mark.parametrize("category", sorted(SYNSETS))
def test_every_category_is_an_option(category):
    assert typed(f"category={category}").category.name == category


NEEDED = {
    "custom": ["category.name=mug"],
    "folder": ["data.root=."],
    "modelnet": ["data.root=."],
    "pix3d": ["data.root=."],
    "shapenet": ["data.root=."],
    "timm": ["encoder.model=resnet18"],
    ("split", "listed"): ["split.file=README.md"],
    ("template_strategy", "listed"): ["template_strategy.file=README.md"],
    "ranking": ["template_strategy.file=README.md"],
}


def needed(group, name):
    return NEEDED.get(name, NEEDED.get((group, name), []))


@pytest.mark.parametrize(
    "group", ["category", "regime", "templates", "schedule", "trainer", "logger"]
)
def test_every_option_of_every_group_composes(group):
    for file in (ROOT / "conf" / group).glob("*.yaml"):
        typed(f"{group}={file.stem}", *needed(group, file.stem))


@pytest.mark.parametrize(
    ("group", "kind"),
    [
        ("data", "source"),
        ("split", "split"),
        ("template_strategy", "template_strategy"),
        ("augmentation", "augmentation"),
        ("encoder", "encoder"),
        ("protocol", "protocol"),
    ],
)
def test_every_part_can_be_chosen_and_passes(group, kind):
    names = [entry.name for entry in registry.entries(kind)]
    assert len(names) > 1
    for name in names:
        cfg = typed(f"{group}={name}", *needed(group, name))
        assert getattr(cfg, group).name == name
        validate(cfg)


def test_a_setting_exists_under_its_own_option_only():
    assert not hasattr(typed("data=folder", "data.root=.").data, "num_models")
    assert typed("template_strategy=random", "template_strategy.seed=1").template_strategy.seed == 1


# --- mistakes ------------------------------------------------------------------------------------

MISTAKES = [
    # groups and options
    (["regime=x"], ["no regime 'x'. Choices: b, e, posterior, r, w"]),
    (["category=tabel"], ["no category 'tabel'. Did you mean category=table?", "watercraft"]),
    (["encoder=mobilnet"], ["Did you mean encoder=mobilenet? Choices: mobilenet, timm"]),
    (["regime.selection=weighted"], ["is a group: write regime/selection=weighted"]),
    (["+regime.terms.mine.term=chamfre"], ["no term 'chamfre'. Did you mean chamfer?"]),
    (["templates=30"], ["not a number: templates=t30"]),
    # settings
    (["schdule=quick"], ["no setting 'schdule'. Did you mean schedule?"]),
    (["data.render.heigth=64"], ["Did you mean data.render.height?", "azimuths, camera"]),
    (
        ["split.fil=a", "split=listed"],
        ["Did you mean split.file? Settings in split: drop_outliers"],
    ),
    (
        ["regime.terms.offset_penlty.weight=1"],
        ["no setting 'regime.terms.offset_penlty'. Did you mean regime.terms.offset_penalty?"],
    ),
    (["+schedule.step=1"], ["no setting 'schedule.step'. Did you mean schedule.steps?"]),
    (["data.parts_root=."], ["no setting 'data.parts_root'", "num_models"]),  # of another option
    (["data=folder"], ["must be given: data.root=..."]),
    # values
    (["schedule.steps=abc"], ["schedule.steps", "'abc'", "Integer"]),
    (["regime.selection.function=cubic"], ["'cubic'", "identity, log"]),
    (["network.degrees=[3,3]"], ["network.degrees=[3, 3] must be three numbers"]),
    # spelling of the command line
    (["regime"], ["group=option"]),
    (["regime=b,e"], ["regime=b,e", "commas", "-m"]),
    (["encoder=[a"], ["'[a'", "quoted for the shell"]),
    (["split.file={category}.json"], ["split.file={category}.json", "quoted twice"]),
]


@pytest.mark.parametrize(("overrides", "words"), MISTAKES, ids=lambda x: x[0] if x else "")
def test_a_mistake_is_explained_in_one_line(overrides, words):
    with pytest.raises((*SHOWN, ValueError)) as caught:
        validate(typed(*overrides))
    message = explain(caught.value, TrainConfig)
    assert "\n" not in message
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["schedule.stps=3"], ["Did you mean schedule.steps?"]),
        (["data=folder", "data.root=/no/such/place"], ["data.root=/no/such/place does not exist"]),
        (
            ["evaluation.workers=-1", "callbacks.figure_examples=-1"],
            ["evaluation.workers=-1 must be 0", "callbacks.figure_examples=-1 must be 0 or more"],
        ),
        (["plugins=[no_such_module]"], ["plugins=no_such_module: cannot be imported"]),
        (["-m", "regime=b,ww", "category=table"], ["no regime 'ww'", "b, e, posterior, r, w"]),
    ],
)
def test_the_command_shows_one_message(arguments, words, tmp_path, monkeypatch):
    (tmp_path / "tmp").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "tmp"))
    result = train(*arguments, f"paths.runs={tmp_path}/runs", f"paths.data={tmp_path}/data")
    assert result.returncode == 1
    assert not list((tmp_path / "tmp").glob("tmp*")), "nothing is left behind"
    message = result.stderr.strip().splitlines()
    assert "Traceback" not in result.stdout + result.stderr
    assert len(message) == 1, message
    assert message[0].startswith("error: ")
    for word in words:
        assert word in message[0]
    assert not (tmp_path / "data").exists()


def test_settings_that_come_back_from_another_process_leave_the_schema_whole():
    joblib = pytest.importorskip("joblib")
    cfg = composed()
    joblib.Parallel(n_jobs=2)(joblib.delayed(lambda x: x)(cfg) for _ in range(2))
    assert typed().data.render.height == 192
    assert typed_config(OmegaConf.to_container(cfg), TrainConfig).data.render.height == 192


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "runs").write_text("")
    result = train("schedule=quick", f"paths.runs={tmp_path}/runs")
    assert result.returncode == 1
    assert result.stderr.startswith(f"error: {tmp_path}/runs/")
    assert len(result.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("overrides", "word"),
    [
        (["templates=t1", "regime=w"], "single template: use another regime"),
        (["schedule.num_points=20000"], "more than data.num_points=16384"),
        (["data.render.elevation=91"], r"elevation must lie in \[-90, 90\]"),
        (
            ["data=shapenet", "data.root=.", "data.images=r2n2", "data.render.camera=authors"],
            "camera means nothing with data.images=r2n2.*data.render.camera=framed",
        ),
        (
            ["data=pix3d", "data.root=.", "data.render.azimuths=[0]"],
            r"azimuths means nothing with data=pix3d.*azimuths=\[45.0\]",
        ),
        (["data.render.height=31"], "height and width must be 32 or more"),
        (["data.render.azimuths=[]"], "at least one angle"),
        (["encoder.weights=/no/such.h5"], "encoder.weights=/no/such.h5 is not a file"),
        (["split.train_fraction=1.0"], "split.train_fraction must lie between 0 and 1"),
        (
            ["augmentation=photo", "augmentation.roll=90"],
            r"augmentation.roll=90.0 must lie in \[0, 45",
        ),
        (["seed=4294967296"], r"seed=4294967296 must lie in \[0, 4294967295\]"),
        (["schedule.learning_rate=inf"], r"schedule.learning_rate=inf must lie in \(0, inf\)"),
        (["network.degrees=[3,0,3]"], r"network.degrees=\[3, 0, 3\] must be 1 or more"),
        (["category=custom", "category.name=../mug"], "not a path"),
        (["split=listed", "split.file=/no/such"], "split.file=/no/such does not exist"),
        (
            ["template_strategy=ranking", "template_strategy.file='/no/{category}.csv'"],
            "template_strategy.file=/no/chair.csv is not there",
        ),
        (["data=shapenet", "data.root=.", "data.mix_versions=true"], "without data.images=r2n2"),
        (["preparation.timeout=0"], "preparation.timeout=0.0 must be above 0"),
        (["regime.terms.offset_penalty.weight=-1"], "offset_penalty.weight=-1.0 must be 0 or"),
        (["regime.terms.weighted_chamfer.weight=0"], "regime b has no term of a weight above 0"),
    ],
)
def test_values_that_cannot_work_are_named(overrides, word):
    with pytest.raises(ConfigError, match=word):
        validate(typed(*overrides))


def ranged(settings, name=""):
    """Yield settings, field and name of every number that has a range."""
    if isinstance(settings, dict):
        for key, value in settings.items():
            yield from ranged(value, f"{name}{key}.")
    for f in fields(settings) if is_dataclass(settings) else ():
        yield from ranged(getattr(settings, f.name), f"{name}{f.name}.")
        if f.metadata.get("within"):
            yield settings, f, f"{name}{f.name}"


@pytest.mark.parametrize(
    ("overrides", "least"),
    [([], 38), (["regime=posterior", "template_strategy=random", "protocol=modern"], 45)],
)
def test_every_number_out_of_its_range_is_named(overrides, least):
    cfg = typed(*overrides)
    assert range_problems(cfg) == []
    found = list(ranged(cfg))
    for settings, f, name in found:
        within, good = f.metadata["within"], getattr(settings, f.name)
        bad = float(within[1:].split(",")[0]) - (within[0] == "[")
        setattr(settings, f.name, [bad] if isinstance(good, list | tuple) else bad)
        with pytest.raises(ConfigError, match=rf"{name}=\S+ must (be|lie)"):
            validate(cfg)
        setattr(settings, f.name, good)
    names = {name for _, _, name in found}
    assert len(names) >= least
    assert {"evaluation.seed", "trainer.num_workers", "schedule.steps", "data.num_models"} <= names


@pytest.mark.parametrize(
    ("command", "setting"),
    [("evaluate", "evaluation.workers"), ("predict", "seed"), ("prepare", "preparation.workers")],
)
def test_the_other_commands_name_them_too(command, setting, tmp_path):
    needed = {"evaluate": "run=x", "predict": "image=x", "prepare": f"paths.data={tmp_path}"}
    done = run_command(command, needed[command], f"{setting}=-1")
    assert done.returncode == 1
    assert done.stderr.strip() == f"error: {setting}=-1 must be 0 or more"
    assert not list(tmp_path.iterdir())


def test_random_views_alone_are_enough():
    validate(typed("data.render.azimuths=[]", "data.render.random_views=2"))


def test_all_that_is_wrong_is_said_at_once():
    with pytest.raises(ConfigError, match=r"schedule\.steps.*; .*seed.*; .*split\.train_fraction"):
        validate(typed("schedule.steps=0", "seed=-1", "split.train_fraction=2"))


def test_a_sound_configuration_passes():
    validate(typed())


def test_a_group_that_a_file_does_not_have_is_named():
    content = OmegaConf.to_container(composed())
    del content["data"]
    with pytest.raises(ConfigError, match=r"must be given: data=\.\.\."):
        typed_config(content, TrainConfig)


def test_a_damaged_value_of_a_file_is_named_with_its_place():
    content = OmegaConf.to_container(composed())
    content["regime"]["terms"]["offset_penalty"]["weight"] = "heavy"
    with pytest.raises(ConfigError, match=r"regime\.terms\.offset_penalty.*heavy.*Float"):
        typed_config(content, TrainConfig)
    content["regime"]["terms"]["offset_penalty"] = {"weight": 1, "wait": 2}
    with pytest.raises(ConfigError, match=r"no setting 'regime\.terms\.offset_penalty\.wait'"):
        typed_config(content, TrainConfig)
    content = OmegaConf.to_container(composed())
    content["data"]["render"]["heigth"] = 64
    with pytest.raises(ConfigError, match=r"Did you mean data\.render\.height\?"):
        typed_config(content, TrainConfig)


# --- what the commands say of themselves ---------------------------------------------------------


def test_cfg_job_prints_everything():
    result = train("--cfg", "job", "category=sofa")
    assert result.returncode == 0
    assert set(OmegaConf.create(result.stdout)) == set(OmegaConf.structured(TrainConfig))


@pytest.mark.parametrize(
    ("name", "schema"),
    [
        ("evaluate", EvaluateConfig),
        ("prepare", PrepareConfig),
    ],
)
def test_the_other_configurations_have_their_schema(name, schema):
    assert set(compose_config(name, schema, [])) == set(OmegaConf.structured(schema))


def test_a_folder_of_ones_own_brings_options(tmp_path):
    (tmp_path / "schedule").mkdir()
    text = (ROOT / "conf" / "schedule" / "quick.yaml").read_text()
    (tmp_path / "schedule" / "blink.yaml").write_text(text.replace("steps: 600", "steps: 3"))
    cfg = compose_config("train", TrainConfig, ["schedule=blink"], str(tmp_path))
    assert typed_config(cfg, TrainConfig).schedule.steps == 3
    done = subprocess.run(
        [sys.executable, "train.py", "--config-dir", str(tmp_path), "--help"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        env={**os.environ, "COLUMNS": "80"},
    )
    assert "  blink" in done.stdout
