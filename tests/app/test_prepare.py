import pytest
from commands import run_command
from PIL import Image
from shapenet_tree import BAD, bad_models, good_models, write_folder

from ffd_lightning.app.commands.prepare import prepare
from ffd_lightning.app.config import PrepareCommandConfig
from ffd_lightning.app.configuration import compose_config, typed_config
from ffd_lightning.data.categories import paper_templates


@pytest.fixture
def tried(tmp_path, capsys):
    """Return a function from settings to what `prepare trial=true` prints."""

    def run(*overrides):
        small = ("data.num_points=64", "data.render.height=32", "data.render.width=32")
        rest = ("preparation.workers=1", f"paths.data={tmp_path}/data", *overrides)
        composed = compose_config("prepare", PrepareCommandConfig, ["trial=true", *small, *rest])
        prepare(typed_config(composed, PrepareCommandConfig))
        return capsys.readouterr().out

    return run


def test_a_trial_says_what_there_is_and_leaves_a_picture(tried, tmp_path):
    templates = paper_templates("chair")
    files = good_models("v1") | bad_models("v1")
    renamed = {path.replace("/plain/", f"/{templates[4]}/"): data for path, data in files.items()}
    root = write_folder(tmp_path / "shapenet", renamed)
    said = tried("data=shapenet", f"data.root={root}")
    assert "categories chair" in said
    assert f"chair: {4 + len(BAD)} shapes, 2 cannot be used (absent: it has no model.obj; " in said
    assert "chair: 29 of the paper's 30 templates are absent or cannot be used" in said
    assert "chair: 7 tried, 3 rejected (" in said
    left = [path for path in (tmp_path / "data").rglob("*") if path.is_file()]
    assert [path.name for path in left] == ["shapenet-chair-trial.png"]
    assert Image.open(left[0]).width > 1000


def test_the_command(tmp_path):
    obj = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    root = write_folder(tmp_path / "meshes", {f"{k}/{j}.obj": obj for k in "ab" for j in range(9)})
    given = ("data=folder", f"data.root={root}", "category=custom", f"paths.data={tmp_path}/data")
    done = run_command("prepare", "-m", "trial=true", "category.name=a,b", *given, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "categories a, b" in done.stdout
    assert "a: 9 tried" in done.stdout
    assert "b: 9 tried" in done.stdout
