"""`ffd` and what its commands say of themselves."""

import contextlib
import subprocess
import sys
from dataclasses import fields
from importlib import import_module
from pathlib import Path

import pytest

from ffd_lightning import __version__, registry
from ffd_lightning.app import main as entry
from ffd_lightning.app.main import COMMANDS, main, run

ROOT = Path(__file__).parents[2]


def said(capsys, *arguments):
    main(arguments)
    return capsys.readouterr().out


def test_ffd_lists_its_commands(capsys):
    text = said(capsys)
    for name, command in COMMANDS.items():
        assert f"  ffd {name:<10}{command.summary}" in text
    assert said(capsys, "--help") == said(capsys, "-h") == said(capsys, "help") == text
    assert said(capsys, "--version").strip() == __version__


def test_a_command_that_does_not_exist():
    with pytest.raises(SystemExit) as ended:
        main(["trian"])
    assert str(ended.value.code).startswith("error: no command 'trian'. Commands: train, evaluate")


def test_the_scripts_at_the_root_are_commands():
    for name in ("train", "evaluate", "predict", "prepare", "sweep"):
        assert f'run("{name}")' in (ROOT / f"{name}.py").read_text()


def test_a_process_of_another_device_knows_its_command(monkeypatch):
    """Lightning starts it with the command's arguments alone."""
    told = []
    monkeypatch.setattr(entry, "run", lambda name, arguments: told.append((name, arguments)))
    monkeypatch.setenv("LOCAL_RANK", "1")
    monkeypatch.setenv("FFD_LIGHTNING_COMMAND", "train")
    main(["regime=e"])
    assert told == [("train", ["regime=e"])]


# --- help ----------------------------------------------------------------------------------------


def help_of(name, capsys):
    with contextlib.suppress(SystemExit):  # of some commands
        run(name, ["--help"])
    return capsys.readouterr().out


PARTS = {
    "train": tuple(registry.KINDS),
    "prepare": ("source",),
    "evaluate": ("protocol",),
    "predict": (),
}


@pytest.mark.parametrize("name", PARTS)
def test_help_lists_parts_and_what_each_can_be_told(name, capsys):
    text = help_of(name, capsys)
    words = text.split()
    for kind in registry.KINDS:
        listed = f"    {registry.KINDS[kind]}\n" in text
        assert listed == (kind in PARTS[name]), kind
        for part in registry.entries(kind) if listed else ():
            assert f"\n  {part.name} " in text, part.name
            for f in fields(part.settings):
                assert any(word.startswith(f"{f.name}=") for word in words), f.name


def test_help_spells_settings_as_the_command_line_does(capsys):
    text = help_of("train", capsys)
    for words in (
        "regime=e regime.terms.offset_penalty.weight=1   regimes combine",
        "function=identity|log",
        "root=... images=render|r2n2 images_root=null",
        "\ndata=procedural    where shapes come from\n",
        "degrees=[3,3,3]",
        "references=true subset=test|val",
    ):
        assert words in text, words
    for words in ("category=null", "image=...", "background=auto", "colors=material"):
        assert words in help_of("predict", capsys)


@pytest.mark.parametrize("name", ["status", "report", "figures", "predict", "view", "export"])
def test_help_of_a_plain_command_lists_its_settings(name, capsys):
    text = help_of(name, capsys)
    schema = import_module(f"ffd_lightning.app.commands.{name}").Settings
    for f in fields(schema):
        (line,) = [x for x in text.splitlines() if x.startswith(f"  {f.name}=")]
        following = text.splitlines()[text.splitlines().index(line) + 1 :]
        shown = line[22:] if len(line) > 22 else (following or [""])[0].strip()
        assert shown, f"nothing is said of {f.name}"


def test_help_of_sweeps_lists_the_studies(capsys):
    text = help_of("sweep", capsys)
    for file in (ROOT / "sweeps").glob("*.yaml"):
        assert f"\n  {file.stem} " in text


def test_help_shows_the_parts_of_a_module_of_ones_own(tmp_path):
    (tmp_path / "own_encoders.py").write_text(
        "from dataclasses import dataclass\n"
        "from ffd_lightning.registry import register\n"
        "@dataclass\n"
        "class Tiny:\n"
        '    """A small one."""\n'
        "    layers: int = 7\n"
        "@register('encoder', 'tiny', Tiny)\n"
        "def tiny(settings, image_size, batch_norm_momentum=0.1):\n"
        "    raise NotImplementedError\n"
    )
    command = [sys.executable, "-m", "ffd_lightning", "train", "plugins=[own_encoders]"]
    done = subprocess.run([*command, "--help"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "  tiny                A small one. (module own_encoders)" in done.stdout
    assert "layers=7" in done.stdout
    overrides = ["encoder=tiny", "encoder.layres=1"]
    done = subprocess.run([*command, *overrides], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1
    assert "no setting 'encoder.layres'. Did you mean encoder.layers?" in done.stderr


def test_help_does_not_load_torch():
    code = (
        "import sys\n"
        "from ffd_lightning.app.main import main\n"
        "main(['train', '--help'])\n"
        "assert 'torch' not in sys.modules and 'lightning' not in sys.modules\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_a_command_that_needs_no_setting_runs_without(monkeypatch, capsys):
    """The viewer shows the package's own model; what needs a run shows its help."""
    asked = []
    monkeypatch.setattr("ffd_lightning.app.commands.view.main", lambda s: asked.append(s.run))
    with pytest.raises(SystemExit):
        run("view", [])
    assert (asked, capsys.readouterr().out) == ([None], "")
    run("export", [])
    assert "Settings:" in capsys.readouterr().out


# --- settings of plain commands ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["report", "runs=x", "galery=3"], "no setting 'galery'. Did you mean gallery?"),
        (["report", "runs=x", "gallery=many"], "gallery=many cannot be used"),
        (["report", "gallery=3"], "these settings must be given: runs=..."),
        (["report", "runs="], "runs= is empty"),
        (["report", "runs=x", "runs=y"], "runs= is given twice"),
        (["report", "x", "y"], "'y' is no setting: write runs=y, say"),
        (["figures", "figure=voxels", "runs=[a", "number=3"], "runs=[a cannot be used"),
        (["status", "/no/such"], "no run in /no/such"),
        (["report", "x", "gallery=-1"], "gallery=-1 must be 0 or more"),
        (["figures", "figure=overview", "runs=x", "size=1"], "size=1 must lie in [64, 2048]"),
        (["figures", "figure=ovrview", "x"], "figure=ovrview: choose one of method, overview"),
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
