"""Commands, scripts and links in the documents are held against the code."""

import contextlib
import importlib
import io
import re
import shlex
import shutil
import sys

import pytest
import trimesh
from commands import ROOT, python
from conftest import photo_in
from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf import OmegaConf

from ffd_lightning.app.commands.evaluate import read_config
from ffd_lightning.app.commands.sweep import read_request
from ffd_lightning.app.config import PrepareCommandConfig, TrainConfig
from ffd_lightning.app.configuration import compose_config, typed_config
from ffd_lightning.app.settings import read_settings
from ffd_lightning.app.studies import load_study
from ffd_lightning.app.training_run import train
from ffd_lightning.run_folder import RunFolder

sys.path.insert(0, str(ROOT / "docs" / "tools"))
from links import checkout, dead, markdown

FOLDERS = ("", "docs", "docs/notebooks", "docs/findings", "benchmarks", "ffd_lightning/pretrained")
PAGES = sorted(page for folder in FOLDERS for page in (ROOT / folder).glob("*.md"))
_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def name(path):
    return str(path.relative_to(ROOT))


def blocks(path, language):
    """Return the fenced blocks of a language."""
    return [code for word, code in _BLOCK.findall(path.read_text("utf-8")) if word == language]


def commands(path):
    """Return (subcommand, arguments) of each line that calls this project."""
    found = []
    for block in blocks(path, ""):
        for line in block.replace("\\\n", " ").splitlines():
            called = re.match(r"(?:python (\w+)\.py|ffd (\w+))( .*|$)", line)
            if called:
                words = shlex.split(called[3], comments=True)
                found.append((called[1] or called[2], words))
    return [(command, rest) for command, rest in found if not {"...", "->"} & set(rest)]


HYDRA = {"train": ("train", TrainConfig), "prepare": ("prepare", PrepareCommandConfig)}
# What only the reader has: parts of a package of theirs.
THEIRS = ("plugins=", "regime/term=", "encoder=mine", "encoder=patches", "data=boxes")
WRITTEN = [(name(page), *found) for page in PAGES for found in commands(page)]
assert len(WRITTEN) > 40


def first_values(overrides):
    """Return overrides without Hydra's own, each sweep replaced by its first value."""
    kept = [each for each in overrides if not each.startswith(("hydra", "-"))]
    result = []
    for override, each in zip(OverridesParser.create().parse_overrides(kept), kept, strict=True):
        value = override.value()
        if override.is_sweep_override():
            value = value.list[0] if hasattr(value, "list") else value.start
            each = f"{override.key_or_group}={value}"
        result.append(each)
    return result


@pytest.mark.parametrize(("page", "command", "arguments"), WRITTEN)
def test_a_written_command_is_understood(page, command, arguments):
    if any(word.startswith(THEIRS) for word in arguments) or "--help" in arguments:
        pytest.skip("needs a package of the reader's own, or only asks for help")
    if command == "sweep":
        _, study, arguments = read_request(arguments)
        load_study(ROOT / "sweeps" / f"{study}.yaml")
        command = "train"
    if command == "evaluate":
        read_config(arguments)
        return
    if command in HYDRA:
        config, schema = HYDRA[command]
        typed_config(compose_config(config, schema, first_values(arguments)), schema)
        return
    module = importlib.import_module(f"ffd_lightning.app.commands.{command}")
    read_settings(module.Settings, arguments, getattr(module, "MAIN", ""))


def test_links_lead_somewhere_and_every_picture_is_linked():
    assert [*dead(checkout())] == []
    links = {page: markdown(page.read_text("utf-8"))[0] for page in PAGES}
    linked = {(page.parent / link).resolve() for page in PAGES for link in links[page]}
    pictures = {
        path for path in (ROOT / "docs").rglob("*") if path.suffix in (".png", ".jpg", ".gif")
    }
    assert sorted(map(name, pictures - linked)) == []
    assert [name(x) for x in pictures if x.stat().st_size > 3e5] == [], "they are small"


def run_here(script, folder):
    photo_in(folder)
    with contextlib.chdir(folder), contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(compile(script, "script.py", "exec"), {"__name__": "__main__"})
    return printed.getvalue()


def run_alone(script, folder):
    """Run a script whose worker processes load it again, in a process of its own."""
    photo_in(folder)
    (folder / "script.py").write_text(script)
    done = python("script.py", folder=folder, path=f"{ROOT}:{folder}")
    assert done.returncode == 0, done.stderr
    return done.stdout


PYTHON = blocks(ROOT / "docs" / "python.md", "python")


def block_with(words):
    (found,) = [block for block in PYTHON if words in block]
    return found


def test_the_script_with_a_trainer_runs(tmp_path):
    script = block_with("Trainer(")
    small = {
        "num_models=200": "num_models=12",
        "num_templates=8": "num_templates=2",
        "max_steps=300": "max_steps=2, accelerator='cpu'",
        "PaperProtocol()": "PaperProtocol(points=64)",
    }
    for words, fewer in small.items():
        assert words in script
        script = script.replace(words, fewer)
    assert "test/box_chamfer" in run_alone(script, tmp_path)
    assert (tmp_path / "mesh.glb").stat().st_size > 1000
    assert (tmp_path / "evaluation" / "samples.csv").is_file()


def test_the_script_that_predicts_runs(tmp_path, joint_checkpoint):
    script = block_with("of_category").replace("load()", f"load({str(joint_checkpoint)!r})")
    script = script.replace("200_000", "100")
    run_here(script, tmp_path)
    assert (tmp_path / "mesh.glb").is_file()
    assert (tmp_path / "sofa.glb").is_file()


def test_the_script_with_own_templates_runs(tmp_path, conditioned_checkpoint):
    (tmp_path / "my_meshes").mkdir()
    for file in ("mine.glb", "my_meshes/a.off"):
        trimesh.creation.box((1, 2, 3)).export(tmp_path / file)
    script = block_with("trimesh.creation").replace("runs/RUN", str(conditioned_checkpoint))
    run_alone(script, tmp_path)
    assert (tmp_path / "mesh.glb").is_file()


def test_scripts_without_data_run(tmp_path):
    run_here(block_with("deformation_matrix") + block_with("earth_movers"), tmp_path)


def test_the_script_on_results_runs(tiny_config, tmp_path):
    for regime in ("b", "r"):
        run = RunFolder(tmp_path / "runs" / "demo" / "table" / regime / "t2" / "seed0")
        train(tiny_config(f"regime={regime}", "protocol.points=1024"), run)  # the paper's
    assert "Chamfer" in run_here(block_with("beside_paper"), tmp_path)


def test_the_part_in_five_steps_works(tmp_path):
    part = blocks(ROOT / "docs" / "extending.md", "python")[0]
    module = tmp_path / "my_module.py"
    module.write_text(part)
    text = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
    command = re.search(r"`python train.py ([^`]*my_module[^`]*)`", text)[1]
    shutil.copy(ROOT / "train.py", tmp_path)
    words = (*command.split(), "--cfg", "job")
    done = python("train.py", *words, folder=tmp_path, path=f"{ROOT}:{tmp_path}")
    chosen = OmegaConf.create(done.stdout).encoder
    assert (chosen.name, chosen.size) == ("patches", 8)
