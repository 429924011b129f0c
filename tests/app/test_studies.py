import re
from pathlib import Path

import numpy as np
import optuna
import pytest
from hydra import compose, initialize_config_dir
from hydra.core.hydra_config import HydraConfig
from omegaconf import OmegaConf

from ffd_lightning.app import sweep_end
from ffd_lightning.app.checks import validate
from ffd_lightning.app.commands import sweep as command
from ffd_lightning.app.commands.sweep import Request, run_study
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.configuration import (
    compose_config,
    config_folder,
    prepare_hydra,
    typed_config,
)
from ffd_lightning.app.identity import run_folder
from ffd_lightning.app.search import run_search
from ffd_lightning.app.studies import Range, Search, jobs, load_study, merged, sweeps
from ffd_lightning.errors import ConfigError
from ffd_lightning.run_folder import RunFolder

STUDIES = sorted((Path(__file__).parents[2] / "sweeps").glob("*.yaml"))


def first_values(overrides):
    """The first job of a sweep."""
    result = []
    for override in overrides:
        key, value = override.split("=", 1)
        if not key.startswith(("hydra", "template_strategy", "base")):
            first = value if value.startswith("[") else value.split(",")[0]
            result.append(f"{key}={first}")
    return result


SHORT = (
    "beyond",
    "categories",
    "minutes",
    "photographs",
    "search",
)  # under schedule=quick


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("file", STUDIES, ids=lambda f: f.stem)
def test_the_studies_compose(file, quick):
    study = load_study(file)
    assert study.question
    answer = [] if quick else ["encoder.weights=none"]
    for sweep in sweeps(study, "x", quick, answer):
        cfg = typed_config(compose_config("train", TrainConfig, first_values(sweep)), TrainConfig)
        validate(cfg)
        assert cfg.schedule.name == ("quick" if quick or file.stem in SHORT else "paper")
        assert cfg.name == "x"


@pytest.mark.parametrize("file", STUDIES, ids=lambda f: f.stem)
def test_a_study_for_the_paper_asks_for_its_weights_before_it_starts(
    file, trained, tmp_path, capsys
):
    paper = file.stem not in SHORT
    given = [file.stem, f"paths.runs={tmp_path}"]
    assert run_study(Request.parse([*given, "--dry-run"])) == 0
    told = capsys.readouterr()
    assert "python train.py -m" in told.out
    assert ("mobilenet_2_5_192_tf_no_top.h5 (https://" in told.err) == paper
    if paper:
        with pytest.raises(ConfigError, match=r"mobilenet_2_5_192_tf_no_top\.h5 \(https://"):
            run_study(Request.parse(given))
        with pytest.raises(ConfigError, match=r"encoder.weights=/no/such.h5 is not a file"):
            run_study(Request.parse([*given, "encoder.weights=/no/such.h5"]))
    assert not trained
    assert not list(tmp_path.iterdir())


def test_a_study_asks_where_one_of_its_jobs_would(trained, tmp_path):
    given = ["regimes", "--quick", f"paths.runs={tmp_path}"]
    with pytest.raises(ConfigError, match="schedule=paper starts from ImageNet weights"):
        run_study(Request.parse([*given, "schedule=quick,paper"]))
    with pytest.raises(ConfigError, match=r"no\.h5 is not a file"):
        run_study(Request.parse([*given, "encoder.weights=none,no.h5"]))
    assert not trained


def test_jobs_of_a_sweep():
    given = ["a=range(2)", "hydra/launcher=joblib", "c.d=[1,2]", "e='x,y'", "f=glob(*)", "+g=1"]
    rest = ["c.d=[1,2]", "e='x,y'", "+g=1"]
    assert jobs(given) == [["a=0", *rest], ["a=1", *rest]]


def test_the_papers_table_ends_beside_the_papers(trained, tmp_path, monkeypatch, capsys):
    shown = []
    monkeypatch.setattr(sweep_end, "print_beside_paper", shown.append)
    for name in ("paper_table", "regimes"):
        run_study(request_of(tmp_path, name))
    assert shown == [tmp_path / "paper_table-quick"]
    assert OmegaConf.load(shown[0] / "study.yaml").beside_paper is True
    assert "beside_paper" not in OmegaConf.load(tmp_path / "regimes-quick" / "study.yaml")


def test_results_are_printed_beside_the_papers(tiny_run, tmp_path, capsys):
    sweep_end.print_beside_paper(tiny_run.path)
    told = " ".join(capsys.readouterr().out.split())
    assert "Beside the paper's Table 3" in told
    assert "47/352/447" in told
    assert "; schedule.steps: 8 (paper: 100000); " in told
    assert "; network.batch_norm_momentum: 1 (paper: 0.01); " in told
    sweep_end.print_beside_paper(tmp_path)
    assert "nothing is set beside the paper's Table 3: no run in" in capsys.readouterr().err


def test_the_second_stage_reads_the_ranking_of_the_first():
    study = load_study(next(f for f in STUDIES if f.stem == "template_counts"))
    for quick, count in ((False, "t30"), (True, "t8")):
        first, *others = sweeps(study, "x", quick, [])
        assert f"templates={count}" in first
        for sweep in others:
            (file,) = (x for x in sweep if x.startswith("template_strategy.file="))
            assert file.endswith(
                f'/${{category.name}}/r/{count}/seed${{seed}}${{run_suffix:}}/template_ranking.csv"'
            )


def folders(sweep):
    """The folders of a sweep's first job: its own, and that of the ranking it reads."""
    prepare_hydra(TrainConfig, [])
    given = [*first_values(sweep), *(x for x in sweep if x.startswith("base="))]
    given += [x for x in sweep if x.startswith("template_strategy") and x not in given]
    with initialize_config_dir(str(config_folder()), version_base="1.3"):
        composed = compose("train", given, return_hydra_config=True)
        HydraConfig.instance().set_config(composed)
        file = OmegaConf.select(composed, "template_strategy.file", default=None)
        return f"{composed.paths.runs}/{composed.name}/{run_folder(composed)}", file


@pytest.mark.parametrize("further", [[], ["trainer.precision=bf16-mixed"], ["schedule.steps=7"]])
def test_a_later_stage_reads_the_folder_that_the_first_one_wrote(further):
    study = load_study(next(f for f in STUDIES if f.stem == "template_counts"))
    first, *others = sweeps(study, "x", True, [*further])
    written, read = folders(first)
    assert read is None
    name = f"_{further[0].replace('=', '-')}" if further else ""
    assert written == f"runs/x/sofa/r/t8/seed0{name}"
    for sweep in others:
        place, read = folders(sweep)
        assert read == f"{written}/template_ranking.csv"
        assert place.endswith(f"/seed0{name}"), "what the study sets itself is not in names"


@pytest.mark.parametrize("quick", [False, True])
def test_the_joint_study_is_the_authors(quick):
    """Their `create_mixed_params.py`: networks `e_<category>_v8`, ranked in mode train."""
    ranks, joint = sweeps(load_study(STUDIES[0].parent / "joint.yaml"), "x", quick, [])
    first, last = (
        typed_config(compose_config("train", TrainConfig, first_values(stage)), TrainConfig)
        for stage in (ranks, joint)
    )
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
    category = "sofa" if quick else "plane"
    written, _ = folders(ranks)
    _, read = folders(joint)
    assert read.replace("{category}", category) == f"{written}/template_ranking.csv"


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
    assert merged(["a=1", "b=2", "+a=3"]) == ["+a=3", "b=2"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("stages: [{}]", "question"),
        ("question: Why?", "either stages or a search"),
        ("question: Why?\nstages: [{overides: []}]", "overides"),
        ("question: Why?\nsearch: {parameters: {seed: {low: 1}}}", "low or high"),
        ("question: [", "is not a study"),
    ],
)
def test_what_is_no_study(tmp_path, text, message):
    file = tmp_path / "s.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=message):
        load_study(file)
    with pytest.raises(ConfigError, match=r"no study 't': .* has s"):
        load_study(tmp_path / "t.yaml")


@pytest.fixture
def trained(monkeypatch):
    """Records what would be trained."""
    calls, codes = [], iter([0, 1, 0])

    def train(overrides):
        calls.append(list(overrides))
        return next(codes)

    monkeypatch.setattr(command, "train", train)
    return calls


def request_of(tmp_path, *arguments):
    return Request.parse([*arguments, "--quick", f"paths.runs={tmp_path}"])


def test_a_stage_that_fails_does_not_stop_the_next_but_is_told(trained, tmp_path):
    given = ("template_counts", "category=chair", "--config-dir=conf")
    assert run_study(request_of(tmp_path, *given)) == 1
    assert len(trained) == 3
    assert all("category=chair" in call and f"paths.runs={tmp_path}" in call for call in trained)
    note = OmegaConf.load(tmp_path / "template_counts-quick" / "study.yaml")
    assert note.study == "template_counts"
    assert note.question.startswith("How many")
    assert "--quick --config-dir conf category=chair" in note.command


def test_a_dry_run_only_prints(trained, tmp_path, capsys):
    assert run_study(request_of(tmp_path, "regimes", "--dry-run", "--config-dir=conf")) == 0
    assert not trained
    assert not list(tmp_path.iterdir())
    assert "python train.py -m --config-dir conf" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--quik"], "no option --quik: --quick, --dry-run, --config-dir"),
        (["regimes", "joint"], "two studies: regimes and joint"),
        (
            ["--quick"],
            "name a study: beyond, categories, joint, joint_views, minutes",
        ),
        (
            ["regime"],
            "no study 'regime': .* has beyond, categories, joint, joint_views, minutes",
        ),
    ],
)
def test_a_command_line_that_names_no_study(arguments, message):
    with pytest.raises(ConfigError, match=message):
        run_study(Request.parse(arguments))


def test_options_may_be_written_as_settings():
    found = Request.parse(["study=regimes", "quick=true", "dry_run=false", "seed=1"])
    assert found == Request("regimes", quick=True, dry_run=False, overrides=["seed=1"])
    assert Request.parse(["--config-dir", "x", "regimes"]).config_dir == "x"


def test_an_interrupt_stops_the_study(trained, tmp_path, monkeypatch):
    monkeypatch.setattr(command, "train", lambda overrides: 130)
    with pytest.raises(KeyboardInterrupt):
        run_study(request_of(tmp_path, "regimes"))


# --- search -------------------------------------------------------------------------------------

SEARCH = Search({"schedule.learning_rate": Range(1e-4, 1e-1, True)}, measure="chamfer")


class Trainer:
    """Finishes runs whose score is best at a learning rate of 0.01."""

    def __init__(self, folder, stop_at=None, fail_at=None):
        self.folder, self.stop_at, self.fail_at, self.tried = folder, stop_at, fail_at, []

    def __call__(self, overrides):
        rate = float(next(x for x in overrides if "learning_rate" in x).split("=")[1])
        place = re.search(r'"(trial-\d+)/', next(x for x in overrides if "subdir" in x)).group(1)
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


def test_a_search_finds_what_is_best(tmp_path):
    trainer = Trainer(tmp_path)
    assert run_search(SEARCH, 20, tmp_path, ["a=1"], trainer) == 0
    assert len(trainer.tried) == 20
    best = OmegaConf.load(tmp_path / "best.json")
    expected = min(abs(np.log10(rate) + 2) for _, rate in trainer.tried) + 0.05
    assert best.score == pytest.approx(expected, abs=1e-3), "the mean over seeds"
    assert len((tmp_path / "trials.csv").read_text().splitlines()) == 21
    again = Trainer(tmp_path)
    assert run_search(SEARCH, 20, tmp_path, ["a=1"], again) == 0
    assert not again.tried


def test_a_search_that_was_cut_off_goes_on_as_if_it_had_not_been(tmp_path):
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
    assert second.tried[0] == first.tried[1]
    done = optuna.load_study(study_name="search", storage=f"sqlite:///{tmp_path / 'search.db'}")
    assert len(done.get_trials(states=[optuna.trial.TrialState.COMPLETE])) == 3


def test_a_measure_that_the_protocol_does_not_have(tmp_path):
    with pytest.raises(ConfigError, match="protocol paper has no fscore_1: chamfer, emd, iou"):
        run_search(
            Search(SEARCH.parameters, measure="fscore_1"), 1, tmp_path, [], Trainer(tmp_path)
        )
