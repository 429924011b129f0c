"""`ffd` and what its commands say of themselves."""

import contextlib
import subprocess
import sys

import pytest
from commands import run_command

from ffd_lightning import __version__, components
from ffd_lightning.app import main as entry
from ffd_lightning.app.config import GROUPS
from ffd_lightning.app.configuration import all_settings
from ffd_lightning.app.help import each_setting
from ffd_lightning.app.main import COMMANDS, main
from ffd_lightning.components import Setting
from ffd_lightning.imaging.render_settings import RenderSettings


def printed(capsys, *arguments):
    with contextlib.suppress(SystemExit):  # of some commands
        main(arguments)
    return capsys.readouterr().out


def test_ffd_lists_its_commands(capsys):
    text = printed(capsys)
    for name, summary in COMMANDS.items():
        assert f"  ffd {name:<10}{summary}" in text
    assert printed(capsys, "--help") == printed(capsys, "help") == text
    assert printed(capsys, "--version").strip() == __version__
    with pytest.raises(SystemExit, match=r"^error: no command 'trian'. Did you mean train\?"):
        main(["trian"])


@pytest.mark.parametrize("command", ["train", "sweep"])
def test_help_may_be_cut_off(command):
    words = [sys.executable, "-m", "ffd_lightning", command, "--help"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()  # before anything is written
        assert process.stderr.read() == b""


def test_a_process_of_another_device_knows_its_command(monkeypatch):
    """Lightning starts it with the command's arguments alone."""
    given = []
    monkeypatch.setattr(entry, "run", lambda name, arguments: given.append((name, arguments)))
    monkeypatch.setenv("LOCAL_RANK", "1")
    monkeypatch.setenv("FFD_LIGHTNING_COMMAND", "train")
    main(["regime=e"])
    assert given == [("train", ["regime=e"])]


def test_help_of_train_is_one_screen_and_help_all_lists_every_setting(capsys):
    text = printed(capsys, "train", "--help")
    assert len(text.splitlines()) < 50
    for words in ("regime=b ", "data=procedural ", "schedule.learning_rate=", "--help all"):
        assert words in text, words
    words = printed(capsys, "train", "--help", "all").split()
    for place, kind in GROUPS.items():
        for name in components.names(kind):
            assert f"{place.replace('.', '/')}={name}" in words, name
            for setting in all_settings(kind, name):
                known = [w for w in words if w.startswith(f"{place}.{setting}")]
                assert known or setting == "render", f"{place}.{setting}"
    assert "regime.terms.LABEL.directions=8" in words
    assert "network.hidden=512" in words, "of the class that has it"


def test_help_lists_the_settings_of_a_dataclass_one_by_one():
    given = {"seen": Setting(RenderSettings, RenderSettings(height=48)), "depth": Setting(int, 2)}
    found = dict(each_setting("encoder", given))
    assert found["encoder.seen.height"].default == 48
    assert found["encoder.seen.height"].help
    assert "encoder.depth" in found
    assert "encoder.seen" not in found


def test_help_does_not_load_torch():
    code = (
        "import sys; from ffd_lightning.app.main import run; run('train', ['--help']); "
        "sys.exit('torch' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], stdout=subprocess.DEVNULL).returncode == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["report", "runs=x", "galery=3"], "no setting 'galery'. Did you mean gallery?"),
        (["report", "runs=x", "runs=y"], "runs= is given twice"),
        (["figures", "figure=voxels", "runs=[a", "number=3"], "runs=[a must be a list"),
    ],
)
def test_mistakes_in_settings_are_one_message(arguments, message, capsys):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 1
    found = capsys.readouterr().err
    assert found.startswith("error: ")
    assert message in found
    assert len(found.strip().splitlines()) == 1


@pytest.mark.parametrize(
    "arguments",
    [
        ["status", "runs=~/nowhere"],
        ["prepare", "category=chair", "data=folder", "data.root=~/nowhere"],
    ],
)
def test_a_tilde_is_the_home_folder(arguments, monkeypatch, tmp_path):
    """Of every setting: a shell replaces it at the start of a word alone."""
    monkeypatch.setenv("HOME", str(tmp_path))
    done = run_command(*arguments, cwd=tmp_path)
    assert done.returncode == 1
    assert f"{tmp_path}/nowhere" in done.stderr
