import io
import json
import pickle

import pytest
from hydra.core.utils import JobReturn, JobStatus
from omegaconf import OmegaConf
from rich.console import Console

from ffd_lightning.analysis.runs import (
    described_protocols,
    find_protocol,
    find_runs,
    load_runs,
    load_samples,
    load_settings,
    own_protocol,
)
from ffd_lightning.analysis.status import status_table
from ffd_lightning.analysis.tables import summary_tables
from ffd_lightning.app.commands import status
from ffd_lightning.app.sweep_end import SweepEnd
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.protocols import Measure, ProtocolDescription
from ffd_lightning.run_folder import RunFolder

PAPER = ProtocolDescription(
    "paper",
    "1,024 points",
    (Measure("chamfer", "squared"), Measure("emd", "exact"), Measure("iou", "32^3", True)),
)
OWN = ProtocolDescription("own", "no unit", (Measure("warmth", "degrees", True, 1.0),))
SUMMARY = {
    "chamfer": 0.0321,
    "emd": 0.552,
    "iou": 0.323,
    "undeformed_chamfer": 0.189,
    "best_undeformed_chamfer": 0.0058,
    "effective_templates": 2.5,
    "entropy": 0.9,
    "num_samples": 93.0,
}


def write_summary(run, protocol, numbers):
    run.evaluation(protocol.name).mkdir(parents=True)
    content = {**numbers, "settings": {"max_edge": 0.02}, "protocol": protocol.to_json()}
    (run.evaluation(protocol.name) / "summary.json").write_text(json.dumps(content))


@pytest.fixture
def runs(tmp_path):
    result = []
    for regime in "be":
        run = RunFolder(tmp_path / regime)
        run.path.mkdir()
        run.config.write_text(
            f"category: {{name: table}}\nregime: {{name: {regime}}}\n"
            "templates: {count: 4}\nseed: 0\n"
        )
        result.append(run)
    result[0].set_status("finished", summary={"chamfer": 9.9, "seconds_per_step": 0.5})
    write_summary(result[0], PAPER, SUMMARY)
    result[1].set_status("failed", reason="the disk is full")
    return result


def text(tables):
    buffer = io.StringIO()
    for table in tables:
        Console(file=buffer, width=140).print(table)
    return buffer.getvalue()


def test_runs_are_found_and_read(runs, tmp_path):
    table = load_runs(find_runs(tmp_path))
    assert table["regime"].tolist() == ["b", "e"]
    assert table["state"].tolist() == ["finished", "failed"]
    assert table.loc[0, "chamfer"] == SUMMARY["chamfer"]
    assert table.loc[0, "seconds_per_step"] == 0.5
    assert "settings" not in table


def test_runs_are_read_under_the_protocol_that_is_asked_for(runs):
    write_summary(runs[0], OWN, {"warmth": 0.5})
    table = load_runs(runs, "own")
    assert table.loc[0, "warmth"] == 0.5
    assert table["protocol"].tolist() == ["own"] * 2
    runs[0].set_status("finished", evaluation={"protocol": "own", "references": True})
    assert load_runs(runs)["protocol"].tolist() == ["own", "paper"]


def test_protocols_are_known_from_the_runs_alone(runs):
    """That of another package, say, which is not here."""
    assert find_protocol(runs) == PAPER
    write_summary(runs[0], OWN, {"warmth": 0.5})
    assert find_protocol(runs, "own") == OWN
    assert list(described_protocols(runs[0])) == ["paper", "own"], "that of its training first"
    with pytest.raises(ConfigError, match=r"under protocol 'mine': choose one of paper, own, or"):
        find_protocol(runs, "mine")
    with pytest.raises(
        DataError, match=r"no run was evaluated.*ffd evaluate run=\S*e protocol=own"
    ):
        find_protocol(runs[1:], "own")
    write_summary(runs[1], OWN, {"warmth": 0.7})
    assert find_protocol(runs) == OWN, "that of most runs"
    runs[1].config.write_text(runs[1].config.read_text() + "protocol: {name: own, points: 3}\n")
    assert own_protocol(runs[1]) == "own"
    runs[1].set_status("finished")
    shown = text(summary_tables(runs[1:]))
    assert "protocol own" in shown
    assert "warmth ↑" in shown
    assert "0.7" in shown


def test_descriptions_that_are_damaged_are_none(runs):
    file = runs[0].evaluation("paper") / "summary.json"
    content = json.loads(file.read_text())
    for damaged in (
        "{",
        "[]",
        json.dumps({k: v for k, v in content.items() if k != "protocol"}),
        json.dumps(content | {"protocol": {"name": "paper", "note": "", "measures": []}}),
        json.dumps(content | {"protocol": {"name": "paper", "note": "", "measures": [{}]}}),
        json.dumps(content | {"protocol": "paper"}),
    ):
        file.write_text(damaged)
        assert described_protocols(runs[0]) == {}, damaged


def test_settings_that_are_damaged_are_said(runs, tmp_path):
    for damaged in ("seed: [", "seed", "", "\x00"):
        runs[0].config.write_text(damaged)
        with pytest.raises(ConfigError, match=r"b/config\.yaml is damaged"):
            load_runs(runs)
    with pytest.raises(ConfigError, match="is not a run folder"):
        load_settings([RunFolder(tmp_path / "no")])


def test_the_table_shows_numbers_and_failures(runs, tmp_path):
    shown = text(summary_tables(runs))
    assert "protocol paper: table, T = 4, seed 0, 93 test shapes" in " ".join(shown.split())
    for word in ("32.1", "552.0", "189.0", "5.8", "2.5", "failed", "the disk is full", "EMD ↓"):
        assert word in shown
    assert "x 1000" in shown


def test_scores_and_references_are_in_tables_of_their_own(runs):
    results, references = (text([table]) for table in summary_tables(runs[:1]))
    assert "552.0" in results
    assert "5.8" not in results.split()
    assert "5.8" in references.split()
    assert "552.0" not in references


@pytest.mark.parametrize("width", [50, 80, 120, None])
def test_no_table_is_wider_than_the_terminal_or_cuts_a_number(runs, width):
    buffer = io.StringIO()
    for table in summary_tables(runs, width):
        Console(file=buffer, width=width or 10_000).print(table)
    shown = buffer.getvalue()
    assert width is None or max(map(len, shown.splitlines())) <= width
    assert {"32.1", "552.0", "189.0", "5.8", "2.50", "0.5"} <= set(shown.split())


def test_a_damaged_status_is_unknown_not_fatal(runs):
    (runs[0].path / "status.json").write_text("{")
    assert load_runs(runs)["state"].tolist() == ["unknown", "failed"]


def hydra_config(folder, output="", number=0, jobs=2, launcher="BasicLauncher", accelerator="auto"):
    return OmegaConf.create(
        {
            "callbacks": {"report": False},
            "hydra": {
                "runtime": {"output_dir": str(output)},
                "sweep": {"dir": str(folder)},
                "job": {"num": number},
                "launcher": {"_target_": f"hydra.{launcher}"},
                "sweeper": {"_target_": "hydra.BasicSweeper"},
                "overrides": {"task": [f"seed=range({jobs})"]},
            },
            "restart": False,
            "trainer": {"accelerator": accelerator},
        }
    )


def ended(callback, folder, runs, values):
    callback.on_multirun_start(hydra_config(folder))
    for number, (run, value) in enumerate(zip(runs, values, strict=True)):
        job = JobReturn()
        job.status, job.return_value = JobStatus.COMPLETED, value
        # As a launcher with processes of its own does it.
        copy = pickle.loads(pickle.dumps(callback))
        copy.on_job_end(hydra_config(folder, run.path, number), job)


def test_a_sweep_with_a_failure_exits_with_1_after_its_table(runs, tmp_path, capsys):
    callback = SweepEnd()
    ended(callback, tmp_path, runs, [SUMMARY, None])
    with pytest.raises(SystemExit, match="1 of 2 runs failed") as error:
        callback.on_multirun_end(hydra_config(tmp_path))
    assert str(runs[1].path) in str(error.value)
    assert "32.1" in capsys.readouterr().out
    assert sorted(p.name for p in tmp_path.iterdir()) == ["b", "e"], "nothing is left behind"


def test_a_sweep_for_a_gpu_that_is_not_there_is_refused_at_once(tmp_path, monkeypatch):
    monkeypatch.setattr("torch.cuda.is_available", lambda: False)
    with pytest.raises(SystemExit, match="there is no GPU: use trainer=auto"):
        SweepEnd().on_multirun_start(hydra_config(tmp_path / "a", accelerator="gpu"))
    assert not (tmp_path / "a").exists()
    cluster = hydra_config(tmp_path, launcher="SubmititLauncher", accelerator="gpu")
    callback = SweepEnd()
    callback.on_multirun_start(cluster)
    with pytest.raises(SystemExit, match="no job"):
        callback.on_multirun_end(cluster)


def test_a_sweep_without_failure_ends_quietly(runs, tmp_path, capsys):
    callback = SweepEnd()
    ended(callback, tmp_path, runs[:1], [SUMMARY])
    callback.on_multirun_end(hydra_config(tmp_path))
    assert "Scores" in capsys.readouterr().out


def test_a_sweep_of_which_nothing_came_to_its_end(runs, tmp_path):
    callback = SweepEnd()
    ended(callback, tmp_path, [], [])
    with pytest.raises(SystemExit, match="no job has ended"):
        callback.on_multirun_end(hydra_config(tmp_path))


def test_samples_of_runs_are_joined(runs):
    for run, values in zip(runs, ((0.1, 0.3), (0.2, 0.4)), strict=True):
        run.evaluation("paper").mkdir(parents=True, exist_ok=True)
        lines = [f"00{k},chair,f,0,t,{value},1,1" for k, value in enumerate(values)]
        (run.evaluation("paper") / "samples.csv").write_text(
            "\n".join(["id,category,family,view,template,chamfer,emd,iou", *lines]) + "\n"
        )
    table = load_samples(runs)
    assert table["regime"].tolist() == ["b", "b", "e", "e"]
    assert table["id"].tolist() == ["000", "001"] * 2, "not numbers"
    assert table["category"].unique().tolist() == ["chair"], "the model's, not the run's"
    assert table["chamfer"].tolist() == [0.1, 0.3, 0.2, 0.4]
    with pytest.raises(DataError, match="protocol=modern"):
        load_samples(runs, "modern")


def test_settings_are_named_as_on_the_command_line(runs):
    settings = load_settings(runs)
    assert settings.loc[str(runs[1].path), "regime.name"] == "e"
    assert set(settings) == {"category.name", "regime.name", "templates.count", "seed"}


def test_the_status_of_runs(runs, tmp_path, capsys):
    third, fourth = RunFolder(tmp_path / "f"), RunFolder(tmp_path / "g")
    for run in (third, fourth):
        run.path.mkdir()
        run.config.write_text("seed: 0\n")
        run.set_status("running", steps=10)
    third.set_progress("training", 3, 10, 4000.0)
    fourth.set_progress("evaluating", 0, 8, None)
    journal = fourth.evaluation("paper") / "samples.partial"
    journal.parent.mkdir(parents=True)
    journal.write_text("{}\n" * 3)
    with third.lock():
        table = status_table(tmp_path).set_index("run")
        assert status.main(status.Settings(str(tmp_path))) == 1
    shown = capsys.readouterr().out
    for word in ("30% training", "67 min", "25% evaluating", "the disk is full", "1 interrupted"):
        assert word in shown
    expected = ["finished", "failed", "running", "interrupted"]
    assert [table.loc[str(r.path), "state"] for r in (*runs, third, fourth)] == expected
    assert status_table(tmp_path)["state"].tolist()[2] == "interrupted", "its process is gone"
    with pytest.raises(DataError, match="no run in"):
        status_table(tmp_path / "b" / "evaluation")
