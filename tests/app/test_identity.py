"""Which runs are the same, and what their folders are called."""

import re
from pathlib import Path

import pytest
import yaml
from commands import composed_job

from ffd_lightning import components
from ffd_lightning.analysis.naming import GROUP
from ffd_lightning.analysis.results import Results
from ffd_lightning.app.identity import check_folder, identity, run_folder
from ffd_lightning.errors import ConfigError
from ffd_lightning.run_folder import RunFolder

NO_OTHER_RUN = [
    "trainer.devices=2",
    "trainer.checkpoint_every=7",
    "trainer.residency=disk",
    "preparation.workers=1",
    "logger.every=3",
    "callbacks.figure_examples=1",
    "protocol=modern",
    "evaluation.seed=4",
    "paths.data=elsewhere",
    "name=other",
]
ANOTHER_RUN = [
    "trainer.precision=bf16-mixed",
    "trainer.accumulate_grad_batches=2",
    "seed=1",
    "regime=e",
    "+regime.terms.more.term=chamfer",
    "templates=t4",
    "template_strategy=random",
    "data.render.azimuths=[40]",
    "schedule.steps=9",
    "encoder.weights=embedded",
]


def written(cfg, folder):
    """A run's folder, as its training began it."""
    folder.mkdir(parents=True, exist_ok=True)
    run = RunFolder(folder)
    check_folder(cfg, run)
    return run


def groups_of(*runs):
    """What tables call the settings of runs: equal for those that are seeds of each other."""
    found = Results.of(runs, folder=Path("/")).runs.set_index("run")[GROUP]
    return [tuple(found.loc[str(run.path.relative_to("/"))]) for run in runs]


def test_where_and_how_fast_makes_no_other_run(tiny_config, tmp_path):
    usual = identity(tiny_config())
    run = written(tiny_config(), tmp_path)
    for override in NO_OTHER_RUN:
        changed = tiny_config(override)
        assert identity(changed) == usual, override
        other = written(tiny_config(override, "seed=1"), tmp_path / override)
        assert len(set(groups_of(run, other))) == 1, override
        check_folder(changed, run)


def test_what_changes_the_result_is_refused_in_the_folder(tiny_config, tmp_path):
    run = written(tiny_config(), tmp_path)
    before = run.config.read_text()
    for override in ANOTHER_RUN:
        changed = tiny_config(override)
        other = written(changed, tmp_path / override.replace("/", "-"))
        assert len(set(groups_of(run, other))) == 1 + (override != "seed=1"), override
        with pytest.raises(ConfigError, match=r"holds a run with other settings: .* was .*, now "):
            check_folder(changed, run)
    assert run.config.read_text() == before
    with pytest.raises(ConfigError) as caught:
        check_folder(tiny_config("seed=3", "regime.terms.offset_penalty.weight=2"), run)
    listed = "regime.terms.offset_penalty.weight was 0.0, now 2.0; seed was 0, now 3."
    assert listed in str(caught.value), "all that differs"
    check_folder(tiny_config("seed=3", "restart=true"), run)
    assert yaml.safe_load(run.config.read_text())["seed"] == 3


def test_files_of_a_run_of_the_same_seed_follow_from_the_seed(tiny_config, tmp_path):
    ranked = [
        tiny_config(
            f"seed={seed}",
            "template_strategy=ranking",
            f"template_strategy.file=/runs/a/seed{other}_steps-9/template_ranking.csv",
        )
        for seed, other in ((0, 0), (1, 1), (2, 1))
    ]
    runs = [written(cfg, tmp_path / str(cfg.seed)) for cfg in ranked]
    first, second, third = groups_of(*runs)
    assert first == second != third
    assert third[-1].startswith("template_strategy.file=")


@pytest.mark.parametrize("text", ["{{", "data: {residency: auto}"])
def test_a_damaged_or_earlier_file_is_said(tiny_config, tmp_path, text):
    run = written(tiny_config(), tmp_path)
    run.config.write_text(text)
    with pytest.raises(ConfigError, match=r"config\.yaml is of another version.*restart"):
        check_folder(tiny_config(), run)


def test_callbacks_make_another_run_unless_they_only_watch(tiny_config, monkeypatch):
    monkeypatch.setattr(components, "_registered", dict(components._registered))

    class Watch:
        only_watches = True

    components.component("callback", "watch")(Watch)
    components.component("callback", "change")(type("Change", (), {}))
    usual = identity(tiny_config())
    assert identity(tiny_config("callback=[watch]")) == usual
    assert folder("callback=[watch,change]") == folder("callback=[change]") != folder()
    assert identity(tiny_config("callback=[change]")) != usual


def folder(*overrides):
    """A run's folder below its experiment's, as Hydra asks for it."""
    with composed_job(*overrides) as composed:
        return run_folder(composed)


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        (["category=sofa", "regime=e", "templates=t4", "seed=3"], "sofa/e/t4/seed3"),
        (["schedule.steps=50"], "chair/b/t16/seed0_schedule.steps-50"),
        (
            ["schedule=paper", "schedule.steps=50", "encoder.weights=none"],
            "chair/b/t16/seed0_schedule-paper_encoder.weights-none_schedule.steps-50",
        ),
        (["regime/term=[uniform_penalty]"], "chair/b/t16/seed0_regime.term-uniform_penalty"),
        # defaults that are said
        (["lr_schedule=one_cycle", "schedule.steps=600"], "chair/b/t16/seed0"),
        # where, how fast, how measured
        (["trainer=cpu", "trainer.devices=2", "logger=none"], "chair/b/t16/seed0"),
        (["category=custom", "category.name=mug"], "mug/b/t16/seed0"),
        # of a study
        (["schedule=paper", 'base=["schedule=paper"]'], "chair/b/t16/seed0"),
        (
            ["schedule=quick", "data.limit=9", 'base=["schedule=paper","data.limit=9"]'],
            "chair/b/t16/seed0_schedule-quick",
        ),
    ],
)
def test_names_say_what_differs(overrides, expected):
    assert folder(*overrides) == expected


DISTINCT = [
    [],
    ["data=folder", "data.root=/data/meshes"],
    ["data=folder", "data.root=/data/other"],
    ["data=folder", "data.root=/data/meshes", "data.yaw=90"],
    ["data.render.azimuths=[0,90,180,270]"],
    ["data.render.azimuths=[0,90,180,271]"],
    ["encoder.width=0.5", "network.hidden=64", "network.bottleneck=32", "schedule.batch_size=16"],
    ["encoder.width=0.5", "network.hidden=64", "network.bottleneck=32", "schedule.batch_size=17"],
    ["network.degrees=[3,3]"],  # cannot be typed
    ["network.degrees=[3]"],
]


def test_names_are_distinct_short_and_can_be_written():
    names = [folder(*overrides).removeprefix("chair/b/t16/") for overrides in DISTINCT]
    assert len(set(names)) == len(names)
    for name in names:
        assert len(name) < 80
        assert "/" not in name
        assert set(name) <= set("abcdefghijklmnopqrstuvwxyz0123456789_.-")
    assert names[-1] == folder(*DISTINCT[-1]).removeprefix("chair/b/t16/"), "always the same"
    assert re.fullmatch(r"seed0_invalid-\w{6}", names[-1])
