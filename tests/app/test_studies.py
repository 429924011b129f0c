import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from commands import composed_job, train_config
from omegaconf import OmegaConf
from shapenet_tree import good_models, write_folder

from ffd_lightning.app.commands import sweep as command
from ffd_lightning.app.commands.sweep import run_study
from ffd_lightning.app.configuration import config_folder, jobs
from ffd_lightning.app.identity import run_folder
from ffd_lightning.app.search import run_search
from ffd_lightning.app.studies import Bounds, Search, check_study, load_study, sweeps
from ffd_lightning.errors import ConfigError
from ffd_lightning.run_folder import RunFolder

STUDIES = sorted((Path(__file__).parents[2] / "sweeps").glob("*.yaml"))
OF_STUDIES = ("base=", "template_strategy")
SHORT = ("beyond", "categories", "minutes", "photographs", "search")  # under schedule=quick


def stages(name, *overrides, quick=False):
    return sweeps(load_study(config_folder("sweeps") / f"{name}.yaml"), "x", quick, overrides)


@pytest.fixture
def trained(monkeypatch):
    """Records what would be trained."""
    calls, codes = [], iter([0, 1, 0])

    def train(overrides):
        calls.append(list(overrides))
        return next(codes)

    monkeypatch.setattr(command, "train", train)
    return calls


def run_quickly(tmp_path, *arguments):
    return run_study([*arguments, "--quick", f"paths.runs={tmp_path}"])


# --- what a study is ------------------------------------------------------------------------------


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("name", [file.stem for file in STUDIES])
def test_the_studies_can_run_on_the_embedded_data(name, quick):
    answer = [] if quick or name in SHORT else ["encoder.weights=none"]
    first, problems = check_study(stages(name, *answer, quick=quick))
    assert problems == ""
    assert first.schedule.name == ("quick" if quick or name in SHORT else "paper")
    assert first.name == "x"


def folders(sweep):
    """The folders of a sweep's first job: its own, and that of the ranking it reads."""
    own = [x for x in sweep if x.startswith(OF_STUDIES)]
    given = [*jobs([x for x in sweep if x not in own])[0], *own]
    with composed_job(*given) as composed:
        file = OmegaConf.select(composed, "template_strategy.file", default=None)
        return f"{composed.paths.runs}/{composed.name}/{run_folder(composed)}", file


@pytest.mark.parametrize(
    ("name", "quick", "own"),
    [
        ("template_counts", True, ["seed=1", "data.limit=7", "split.val_fraction=0.2"]),
        ("joint", False, []),
        ("joint_views", True, ["schedule.steps=7"]),
    ],
)
def test_a_later_stage_reads_what_the_first_wrote_whatever_the_user_adds(name, quick, own):
    (written, _), *others = [folders(sweep) for sweep in stages(name, *own, quick=quick)]
    category = "sofa" if quick else "plane"
    for place, read in others:
        assert place != written
        assert read.replace("{category}", category) == f"{written}/template_ranking.csv"


def test_the_joint_network_is_trained_as_the_authors_train_theirs():
    ranks, joint = stages("joint", "encoder.weights=none")
    alone = [[x for x in jobs(s)[0] if not x.startswith(OF_STUDIES)] for s in (ranks, joint)]
    first, last = (train_config(*own) for own in alone)
    assert first.template_ranking.subset == "train"
    assert first.template_ranking.all_views
    # Their view k is at these azimuths; 5 is that of all other networks, and is tested on.
    theirs = [270, 225, 180, 135, 90, 45, 0, 315]
    for cfg in (first, last):
        assert cfg.regime.name == "e"
        assert cfg.regime.terms["negative_entropy"].weight == 100
        assert cfg.data.render.azimuths[0] == theirs[5]
        assert sorted(cfg.data.render.azimuths) == sorted(theirs)
    assert last.templates.count == 2 * len(last.category.members)
    assert last.templates.hold_out == first.templates.count * len(last.category.members)


def test_the_users_overrides_win_over_quick_over_the_stages_over_the_studys(tmp_path):
    file = tmp_path / "s.yaml"
    file.write_text(
        "question: Why?\noverrides: [seed=0, regime=b, templates=t1]\nquick: [templates=t2]\n"
        "stages: [{overrides: [regime=e], quick: [schedule=quick]}, {}]\n"
    )
    study = load_study(file)
    first, second = sweeps(study, "n", True, ["seed=1,2"])
    assert first == [
        "name=n",
        "seed=1,2",
        "regime=e",
        "templates=t2",
        "schedule=quick",
        'base=["seed=0","regime=e","templates=t2","schedule=quick"]',
    ]
    assert second[:-1] == ["name=n", "seed=1,2", "regime=b", "templates=t2"]
    plain = sweeps(study, "n", False, [])[0]
    assert plain[:-1] == ["name=n", "seed=0", "regime=e", "templates=t1"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("stages: [{}]", "question"),
        ("question: Why?", "either stages or a search"),
        (
            "question: Why?\nsearch: {parameters: {min_weight: {low: 0, high: 1, log: true}}}",
            r"search\.parameters\.min_weight\.low=0 must be above 0 and below high=1",
        ),
        ("question: Why?\nstages: [{overrides: [regime=b,e]}]", "e is not key=value"),
        ("[a]", "it must hold settings by name"),
    ],
)
def test_what_is_no_study(tmp_path, text, message):
    file = tmp_path / "s.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=message):
        load_study(file)
    with pytest.raises(ConfigError, match=r"no study .*t.yaml; beside it: s$"):
        load_study(tmp_path / "t.yaml")


# --- what is refused before anything runs ---------------------------------------------------------


@pytest.mark.parametrize("name", ["paper_table", "search"])
def test_a_study_for_the_paper_asks_for_its_weights(name, trained, tmp_path, capsys):
    given = [name, f"paths.runs={tmp_path}"]
    assert run_study([*given, "--dry-run", "--config-dir=conf"]) == 0
    printed = capsys.readouterr()
    assert "python train.py -m --config-dir conf" in printed.out
    assert ("mobilenet_2_5_192_tf_no_top.h5 (https://" in printed.err) == (name not in SHORT)
    with pytest.raises(ConfigError, match=r"encoder.weights=/no/such.h5 is not a file"):
        run_study([*given, "encoder.weights=/no/such.h5"])
    assert not trained
    assert not list(tmp_path.iterdir())


def test_what_only_some_jobs_would_fail_by_is_found_too(trained, tmp_path):
    for own, message in (
        ("schedule=quick,paper", "schedule=paper starts from ImageNet weights"),
        ("encoder.weights=none,no.h5", r"no\.h5 is not a file"),
        ("data.render.samples=0", r"data\.render\.samples=0 must"),
        ("data.num_points=few", "few"),
    ):
        with pytest.raises(ConfigError, match=message):
            run_quickly(tmp_path, "regimes", own)
    with pytest.raises(ConfigError, match="stages of this study differ in templates"):
        run_quickly(tmp_path, "template_counts", "templates=t1,t2")
    assert not trained


@pytest.fixture
def shapenet(tmp_path):
    files = {}
    for synset in ("03001627", "04379243", "04090263"):  # chair, table, rifle
        files |= good_models("v2", synset)
    return ["data=shapenet", f"data.root={write_folder(tmp_path / 'shapenet', files)}"]


@pytest.mark.parametrize("name", ["paper_table", "joint"])
def test_a_study_of_categories_that_are_not_there_is_refused(name, shapenet, trained, tmp_path):
    given = [name, *shapenet, f"paths.runs={tmp_path}/runs", "encoder.weights=none"]
    with pytest.raises(ConfigError) as caught:
        run_study(given)
    assert "has chair, rifle, table, and lacks 11 of the study's 13 categories" in str(caught.value)
    assert not (tmp_path / "runs").exists()


def test_a_stage_that_fails_does_not_stop_the_next(trained, tmp_path):
    given = ("template_counts", "category=chair", "--config-dir=conf", 'name="so, ä"')
    assert run_quickly(tmp_path, *given) == 1
    assert len(trained) == 3
    assert all("category=chair" in call and f"paths.runs={tmp_path}" in call for call in trained)
    note = yaml.safe_load((tmp_path / "so, ä" / "study.yaml").read_text())
    assert note["study"] == "template_counts"
    assert note["question"].startswith("How many")
    assert "category=chair --config-dir=conf" in note["command"]


# --- search ---------------------------------------------------------------------------------------

SEARCH = Search({"schedule.learning_rate": Bounds(1e-4, 1e-1, True)}, measure="chamfer")


def test_both_ends_of_a_search_are_checked_before_its_first_trial(trained, tmp_path):
    file = tmp_path / "far.yaml"
    high = "{regime.min_weight: {low: 1e-3, high: 5}}"
    file.write_text(f"question: Why?\noverrides: [regime=r]\nsearch: {{parameters: {high}}}")
    with pytest.raises(ConfigError, match=r"min_weight=5\.0 must"):
        run_quickly(tmp_path, str(file))
    with pytest.raises(ConfigError, match=r"regime\.min_weight: the study searches it"):
        run_quickly(tmp_path, str(file), "regime.min_weight=0.3")
    assert not trained


class Trainer:
    """Finishes runs whose score is best at a learning rate of 0.01."""

    def __init__(self, folder, stop_at=None, fail_at=None):
        self.folder, self.stop_at, self.fail_at, self.tried = folder, stop_at, fail_at, []

    def __call__(self, overrides):
        rate = float(next(x for x in overrides if "learning_rate" in x).split("=")[1])
        subdir = next(x for x in overrides if "subdir" in x)
        place = re.search(r'"(.*trial-\d+)/', subdir).group(1)
        self.tried.append((place, rate))
        if len(self.tried) == self.stop_at:
            raise KeyboardInterrupt
        if len(self.tried) == self.fail_at:
            return 1
        for seed in (0, 1):
            run = RunFolder(self.folder / place / f"seed{seed}")
            run.path.mkdir(parents=True)
            run.config.write_text("seed: 0\n")
            score = abs(np.log10(rate) + 2) + 0.1 * seed
            run.set_status("finished", summary={"chamfer": float(score)})
        return 0


def test_a_search_finds_what_is_best_and_is_begun_anew_for_other_settings(tmp_path):
    trainer = Trainer(tmp_path)
    assert run_search(SEARCH, 20, tmp_path, ["a=1", "trainer=cpu"], trainer) == 0
    assert len(trainer.tried) == 20
    best = yaml.safe_load((tmp_path / "best.json").read_text())
    expected = min(abs(np.log10(rate) + 2) for _, rate in trainer.tried) + 0.05
    assert best["score"] == pytest.approx(expected, abs=1e-3), "the mean over seeds"
    assert len((tmp_path / "trials.csv").read_text().splitlines()) == 21
    for own, count in ((["a=2"], 20), (["a=1", "trainer=gpu"], 0)):
        again = Trainer(tmp_path)
        assert run_search(SEARCH, 20, tmp_path, own, again) == 0
        assert len(again.tried) == count
    assert yaml.safe_load((tmp_path / "best.json").read_text()) == best, "its own, not a=2's"
    with pytest.raises(ConfigError, match="looks at the validation shapes"):
        run_search(SEARCH, 20, tmp_path, ["evaluation.subset=test"], trainer)


def test_a_search_that_was_cut_off_resumes_as_if_it_had_not_been(tmp_path):
    for name in ("whole", "cut"):
        (tmp_path / name).mkdir()
    whole = Trainer(tmp_path / "whole")
    run_search(SEARCH, 14, tmp_path / "whole", [], whole)
    first, second = Trainer(tmp_path / "cut", stop_at=12), Trainer(tmp_path / "cut")
    with pytest.raises(KeyboardInterrupt):
        run_search(SEARCH, 14, tmp_path / "cut", [], first)
    run_search(SEARCH, 14, tmp_path / "cut", [], second)
    assert first.tried[:-1] + second.tried == whole.tried


def test_a_trial_that_failed_is_tried_again(tmp_path):
    first, second = Trainer(tmp_path, fail_at=2), Trainer(tmp_path)
    assert run_search(SEARCH, 3, tmp_path, [], first) == 1
    assert run_search(SEARCH, 3, tmp_path, [], second) == 0
    assert second.tried == [first.tried[1]]
