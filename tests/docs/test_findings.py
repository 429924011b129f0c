"""The pages of findings are what their studies say; verdicts follow their rules."""

import dataclasses
import re
import shutil
import sys
import zipfile

import numpy as np
import pytest
from analysis.folders import write_run
from analysis.made import results, run_samples
from commands import ROOT
from conftest import FEW as FEW_POINTS

from ffd_lightning.analysis.results import Results
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import PaperProtocol, ProtocolDescription

sys.path.insert(0, str(ROOT / "docs" / "tools"))
import findings
from claims import CLAIMS, FAILS, HOLDS, OPEN, differences, together


def study(scores, shapes=40, categories=("sofa", "table"), seeds=(0, 1, 2), noise=0.002):
    """Return made runs.

    Args:
        scores: of each regime, or (regime, T): Chamfer, undeformed Chamfer and how many templates
            it selects; a function of category and seed, or the same for all.
    """
    rng, parts = np.random.default_rng(0), []
    base = rng.uniform(0.9, 1.1, shapes)
    for key, given in scores.items():
        regime, count = key if isinstance(key, tuple) else (key, 16)
        for category in categories:
            for seed in seeds:
                of_run = given(category, seed) if callable(given) else given
                chamfer, undeformed, used = of_run
                parts.append(
                    run_samples(
                        shapes,
                        regime,
                        seed=seed,
                        category=category,
                        templates=count,
                        template=[f"t{i % used}" for i in range(shapes)],
                        chamfer=base * chamfer + rng.normal(0, noise, shapes),
                        undeformed_chamfer=base * undeformed + rng.normal(0, noise, shapes),
                        floor_chamfer=0.0,
                    )
                )
    protocol = ProtocolDescription("paper", "", PaperProtocol().metrics[:1])
    return results(*parts, protocol=protocol)


def word(claim, scores, **options):
    return CLAIMS[claim].judge(study(scores, **options)).word


def like_b(**scores):
    """The same of all regimes, or of those named as given: Chamfer, undeformed, templates."""
    return dict.fromkeys("bwer", (0.05, 0.2, 4)) | scores


def w(sofa, table):
    return lambda category, _: (0.05, 0.2, sofa if category == "sofa" else table)


FEW = {"b": (0.05, 0.2, 2), "e": (0.05, 0.2, 8)}


@pytest.mark.parametrize(
    ("claim", "scores", "expected"),
    [
        ("equal", like_b(w=(0.051, 0.2, 4), r=(0.052, 0.2, 4)), HOLDS),
        ("equal", like_b(r=(0.07, 0.2, 4)), FAILS),
        ("equal", like_b(r=(0.0551, 0.2, 4)), OPEN),  # the interval crosses the margin
        ("equal", like_b(r=lambda _, seed: (0.04 if seed == 2 else 0.09, 0.2, 4)), OPEN),
        ("undeformed", like_b(r=(0.05, 0.1, 4)), HOLDS),
        ("undeformed", like_b(e=(0.05, 0.1, 4)), FAILS),
        ("undeformed", like_b(), OPEN),
        ("spread", FEW | {"r": (0.05, 0.2, 8)}, HOLDS),
        ("spread", FEW | {"r": (0.05, 0.2, 1)}, FAILS),
        ("spread", FEW | {"r": lambda _, seed: (0.05, 0.2, 1 if seed else 9)}, OPEN),
        ("collapse", {"b": (0.05, 0.2, 3)}, HOLDS),
        ("collapse", {"b": (0.05, 0.2, 12)}, FAILS),
        ("collapse", {"b": (0.05, 0.2, 6)}, OPEN),
        ("opposite", like_b(w=w(2, 8)), HOLDS),
        ("opposite", like_b(w=w(8, 8)), FAILS),
        ("opposite", like_b(w=w(4, 8)), OPEN),
        ("one", {("e", 30): (0.05, 0.2, 16), ("b", 1): (0.051, 0.2, 1)}, HOLDS),
        ("one", {("e", 30): (0.05, 0.2, 16), ("b", 1): (0.08, 0.2, 1)}, FAILS),
        ("one", {("e", 30): (0.05, 0.2, 16), ("b", 1): (0.0551, 0.2, 1)}, OPEN),
    ],
)
def test_verdicts_follow_their_rules(claim, scores, expected):
    assert word(claim, scores) == expected


SEVEN = ("sofa", "table", "chair", "lamp", "bench", "car", "plane")


def test_with_one_seed_categories_are_the_trainings():
    def of_some(category, _):
        return (0.06 if category in ("plane", "car") else 0.04, 0.2, 8)

    b = {"b": lambda *_: (0.045, 0.2, 4)}

    def table(posterior):
        made = study(b | {"posterior": posterior}, categories=SEVEN, seeds=(0,))
        return differences(made, [("posterior", "b")], ["chamfer"])

    assert table((0.04, 0.2, 8))["differs"].tolist() == [False] * 7 + [True]
    assert not table(of_some)["differs"].any()
    some = FEW | {"r": lambda category, _: (0.05, 0.2, 1 if category in SEVEN[:3] else 4)}
    assert word("spread", some, categories=SEVEN, seeds=(0,)) == OPEN


def test_pages_say_what_the_studies_say(tmp_path, monkeypatch):
    folder = findings.FOLDER
    monkeypatch.setattr(findings, "FOLDER", tmp_path)
    for name, text in findings.pages().items():
        assert (folder / name).read_text("utf-8") == text, "python docs/tools/findings.py"
    for page in findings.FILLED:
        text = page.read_text("utf-8")
        assert findings.filled(text) == text, "python docs/tools/findings.py"
    drawn = {path.name for path in tmp_path.iterdir()}
    assert drawn == {path.name for path in folder.glob("*.svg")}


@pytest.mark.parametrize(
    ("close", "expected"), [((0.8, 0.8), HOLDS), ((0.8, 0.5), OPEN), ((0.2, 0.2), FAILS)]
)
def test_labels_transfer_where_the_template_is_close(close, expected):
    made = study({"e": (0.05, 0.2, 2)}, categories=("sofa",), seeds=(0, 1))
    samples = made.samples.assign(family="corner")
    same = samples["template"] == "t0"  # of the two, it alone is a corner sofa
    score = np.where(same, samples["seed"].map(dict(enumerate(close))), 0.5)
    jitter = np.random.default_rng(0).normal(0, 0.01, len(samples))
    samples = samples.assign(part_iou=score + jitter, undeformed_part_iou=0.5)
    families = {run: {"t0": "sofa/corner", "t1": "sofa/plain"} for run in samples["run"]}
    labelled = dataclasses.replace(made, samples=samples, families=families)
    assert CLAIMS["labels"].judge(labelled).word == expected


@pytest.fixture(scope="module")
def small(tiny_run, tmp_path_factory):
    root = tmp_path_factory.mktemp("study")
    for seed in (0, 1):
        folder = root / "table" / "r" / f"seed{seed}"
        shutil.copytree(tiny_run.path, folder)
        config = folder / "config.yaml"
        config.write_text(config.read_text().replace("\nseed: 0", f"\nseed: {seed}"))
    return Results.read(root)


def test_scores_come_back(small, tmp_path):
    findings.save(small, tmp_path / "study.zip", {"machine": "a small one"})
    kept = Results.read(tmp_path / "study.zip")
    assert kept.scored["run"].tolist() == ["table/r/seed0", "table/r/seed1"]
    for name in ("run", "variant", "id", "family", "template"):
        assert kept.samples[name].tolist() == small.samples[name].tolist(), name
    numbers = small.samples.select_dtypes("number").columns
    np.testing.assert_allclose(kept.samples[numbers], small.samples[numbers], rtol=1e-4)
    for run, families in kept.families.items():
        assert families.items() <= small.families[run].items()
        assert families
    assert kept.protocol.name == FEW_POINTS
    assert kept.about[0]["machine"] == "a small one"
    assert kept.settings[["regime.name", "seed"]].to_numpy().tolist() == [["r", 0], ["r", 1]]
    assert (kept.curves.groupby("run")["step"].max() == 8).all()
    assert kept.curves["box_chamfer"].gt(0).all()
    assert len(together(kept, kept).samples) == 2 * len(kept.samples)
    assert {*findings.study("joint").runs["category"]} == {"joint"}


def test_the_same_study_gives_the_same_file_without_the_machines_folders(small, tmp_path):
    for name in ("a.zip", "b.zip"):
        findings.save(small, tmp_path / name, {})
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        text = "".join(archive.read(name).decode() for name in archive.namelist())
    assert str(tmp_path.parent) not in text
    assert not re.search(r'["\s,](/\w+)+', text)


def test_nothing_finished_and_nothing_there(tmp_path):
    run = write_run(tmp_path / "run")
    findings.save(Results.read(tmp_path), tmp_path / "kept.zip", {})
    assert Results.read(tmp_path / "kept.zip").curves.empty, "there is no log"
    run.set_status("failed")
    with pytest.raises(DataError, match="no run has results under protocol paper: run: "):
        findings.save(Results.read(tmp_path), tmp_path / "kept.zip", {})
    (tmp_path / "broken.zip").write_bytes(b"no zip")
    for name in ("broken.zip", "absent.zip"):
        with pytest.raises(DataError, match="no kept results"):
            Results.read(tmp_path / name)
