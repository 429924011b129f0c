import pytest

from ffd_lightning.analysis.status import status_table
from ffd_lightning.app.commands import status
from ffd_lightning.errors import DataError
from ffd_lightning.run_folder import RunFolder, find_runs


def test_runs_behind_links_are_found_once(tmp_path):
    real, elsewhere = tmp_path / "runs" / "chair", tmp_path / "disk" / "table"
    for folder in (real, elsewhere):
        folder.mkdir(parents=True)
        (folder / "config.yaml").touch()
    for name, target in (("latest", real), ("table", elsewhere), ("loop", tmp_path / "runs")):
        (tmp_path / "runs" / name).symlink_to(target)
    found = [run.path.name for run in find_runs(tmp_path / "runs")]
    assert found == ["chair", "table"]


def test_the_status_of_runs(tmp_path, capsys):
    runs = [RunFolder(tmp_path / name) for name in "befg"]
    for run in runs:
        run.path.mkdir()
        run.config.write_text("seed: 0\n")
        run.set_status("running")
    first, second, third, fourth = runs
    first.set_status("finished")
    second.set_status("failed", reason="the disk [/data] is full")
    third.set_progress("training", 3, 10, 4000.0)
    fourth.set_progress("evaluating", 0, 8, None)
    journal = fourth.evaluation("paper") / "samples.partial"
    journal.parent.mkdir(parents=True)
    journal.write_text("{}\n" * 3)
    with third.lock():
        table = status_table(tmp_path).set_index("run")
        assert status.main(status.Settings(str(tmp_path))) == 1
    shown = capsys.readouterr().out
    words = ("30% training", "67 min", "25% evaluating", "disk [/data] is full", "1 interrupted")
    assert all(word in shown for word in words)
    expected = ["finished", "failed", "running", "interrupted"]
    assert [table.loc[str(run.path), "state"] for run in runs] == expected
    assert status_table(tmp_path)["state"].tolist()[2] == "interrupted", "its process is gone"
    with pytest.raises(DataError, match="no run in"):
        status_table(tmp_path / "b" / "no")
