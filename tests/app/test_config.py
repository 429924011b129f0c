"""What is composed from `conf/`, and what is said of mistakes in it."""

import subprocess
import sys
from pathlib import Path

import pytest
import torch

from ffd_lightning import components
from ffd_lightning.app.build import build_module, build_network, build_objective
from ffd_lightning.app.checks import validate
from ffd_lightning.app.config import GROUPS, TrainConfig
from ffd_lightning.app.configuration import compose_config, typed_config
from ffd_lightning.app.messages import SHOWN, explain

ROOT = Path(__file__).parents[2]


def composed(*overrides):
    return compose_config("train", TrainConfig, overrides)


def typed(*overrides):
    return typed_config(composed(*overrides), TrainConfig)


def train(*arguments):
    return subprocess.run(
        [sys.executable, "train.py", *arguments], cwd=ROOT, capture_output=True, text=True
    )


def test_the_paper_schedule_is_the_papers():
    cfg = typed("schedule=paper", "templates=t30")
    s = cfg.schedule
    assert (s.steps, s.annealing_steps, s.batch_size, s.num_points) == (100_000, 10_000, 32, 1024)
    assert (s.learning_rate, cfg.lr_schedule.name, cfg.optimizer.name) == (1e-3, "none", "adam")
    assert (cfg.templates.count, cfg.templates.max_edge, cfg.data.num_points) == (30, 0.02, 16384)
    assert (cfg.network.bottleneck, cfg.network.hidden, cfg.network.degrees) == (64, 512, (3, 3, 3))
    assert (cfg.data.render.height, cfg.data.render.width) == (192, 256)
    assert cfg.encoder.settings == {"width": 0.25}
    assert cfg.network.batch_norm_momentum == 0.01
    given = typed("network.batch_norm_momentum=0.2", "lr_schedule=cosine", "schedule=paper")
    assert given.network.batch_norm_momentum == 0.2, "what is given counts, wherever it stands"
    assert given.lr_schedule.name == "cosine"


@pytest.mark.parametrize("name", components.names("lr_schedule"))
def test_the_learning_rate_can_be_had_for_any_number_of_steps(name):
    cfg = typed(f"lr_schedule={name}", "schedule.learning_rate=0.5")
    make = build_module(cfg, build_network(cfg), {}).make_scheduler
    assert (make is None) == (name == "none")
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


def test_the_optimizer_is_chosen_with_its_own_settings_at_the_schedules_rate():
    cfg = typed("optimizer=sgd", "optimizer.momentum=0.9", "schedule.learning_rate=0.5")
    weights = [torch.nn.Parameter(torch.zeros(1))]
    (group,) = build_module(cfg, build_network(cfg), {}).make_optimizer(weights).param_groups
    assert (group["lr"], group["momentum"]) == (0.5, 0.9)


def test_regimes_combine_and_terms_are_a_group():
    cfg = typed("regime=e", "regime.terms.offset_penalty.weight=1")
    weights = build_objective(cfg.regime, 10).weights(0)
    assert weights == {"weighted_chamfer": 1, "negative_entropy": 100, "offset_penalty": 1}
    cfg = typed("regime/term=[sliced_wasserstein]", "regime.terms.sliced_wasserstein.points=9")
    assert list(cfg.regime.terms)[-1] == "sliced_wasserstein"
    assert cfg.regime.terms["sliced_wasserstein"].build().points == 9
    cfg = typed("+regime.terms.again.term=chamfer", "+regime.terms.again.weight=0.5")
    assert build_objective(cfg.regime, 10).weights(3)["again"] == 0.5


NEEDED = {
    "custom": ["category.name=mug"],
    "folder": ["data.root=."],
    "modelnet": ["data.root=."],
    "pix3d": ["data.root=."],
    "shapenet": ["data.root=."],
    ("split", "listed"): ["split.file=README.md"],
    ("template_strategy", "listed"): ["template_strategy.file=README.md"],
    "ranking": ["template_strategy.file=README.md"],
}


def test_every_option_of_every_group_composes_and_can_be_built():
    for group in ("category", "regime", "templates", "schedule", "trainer", "logger"):
        for file in (ROOT / "conf" / group).glob("*.yaml"):
            typed(f"{group}={file.stem}", *NEEDED.get(file.stem, []))
    for place, kind in GROUPS.items():
        for name in set(components.names(kind)) - {"timm"}:  # it may not be installed
            needed = NEEDED.get(name, NEEDED.get((place, name), []))
            validate(typed(f"{place.replace('.', '/')}={name}", *needed, "encoder.weights=none"))


# --- mistakes ------------------------------------------------------------------------------------

MISTAKES = [
    # groups and options
    (["category=tabel"], ["no category 'tabel'. Did you mean category=table?", "watercraft"]),
    (["+regime.terms.mine.term=chamfre"], ["no term 'chamfre'. Did you mean chamfer?"]),
    # settings
    (["schdule=quick"], ["no setting 'schdule'. Did you mean schedule?"]),
    (["data.parts_root=."], ["no setting 'data.parts_root'", "num_models"]),  # of another option
    (["data=folder"], ["must be given: data.root=..."]),
    (["data.residency=disk"], ["data.residency", "is trainer.residency now"]),  # of 0.2
    # values
    (["schedule.steps=abc"], ["schedule.steps=abc must be a whole number"]),
    (["encoder.width=0"], ["encoder.width=0 leaves no channels"]),
    (["data.render.azimuths=[]"], ["data.render.azimuths=[] needs an angle"]),
    (["encoder.weights=/no/such.h5"], ["encoder.weights=/no/such.h5 is not a file"]),
    # what does not go together
    (["templates=t1", "regime=w"], ["single template: use another regime"]),
    (
        ["data=shapenet", "data.root=.", "data.images=r2n2", "data.render.azimuths=[0]"],
        ["azimuths means nothing here, as data=shapenet has images", "azimuths=[45.0]"],
    ),
    (["schedule=paper"], ["encoder.weights=mobilenet_2_5_192_tf_no_top.h5 (https://", "=none"]),
    # spelling of the command line
    (["split.file={category}.json"], ["split.file={category}.json", "quoted twice"]),
]


@pytest.mark.parametrize(("overrides", "words"), MISTAKES, ids=lambda x: x[0] if x else "")
def test_a_mistake_is_explained_in_one_line(overrides, words):
    with pytest.raises(SHOWN) as caught:
        validate(typed(*overrides))
    message = explain(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["data=folder", "data.root=/no/such/place"], ["data.root=/no/such/place does not exist"]),
        (["-m", "regime=b,ww", "category=table"], ["no regime 'ww'", "b, e, posterior, r, w"]),
        (["-m", "network.degrees=[3,3],[3,3,3]"], ["network.degrees=[3,3] must be 3 values"]),
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


def test_a_folder_of_ones_own_brings_options(tmp_path):
    (tmp_path / "schedule").mkdir()
    text = (ROOT / "conf" / "schedule" / "quick.yaml").read_text()
    (tmp_path / "schedule" / "blink.yaml").write_text(text.replace("steps: 600", "steps: 3"))
    cfg = compose_config("train", TrainConfig, ["schedule=blink"], str(tmp_path))
    assert typed_config(cfg, TrainConfig).schedule.steps == 3
    assert "blink" in train("--config-dir", str(tmp_path), "--help").stdout
    done = train("--config-dir", str(tmp_path), "schedule=blink", "--cfg", "job")
    assert "steps: 3" in done.stdout, done.stderr
