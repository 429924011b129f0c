import zipfile

import numpy as np
import pytest
from commands import run_command
from PIL import Image
from shapenet_tree import BAD, CHAIR, bad_models, good_models, write_folder, write_zips

from ffd_lightning.app.commands import doctor
from ffd_lightning.app.commands.prepare import prepare
from ffd_lightning.data.categories import paper_templates
from ffd_lightning.data.splits import HashSplit, SplitInput
from ffd_lightning.data.templates.coverage import ShapeDistances
from ffd_lightning.errors import ConfigError, DataError

SMALL = [
    "data.num_points=64",
    "data.render.height=32",
    "data.render.width=32",
    "preparation.workers=1",
]


@pytest.fixture
def examine(tmp_path, capsys):
    """Return a function from overrides to exit code and lines."""

    def run(*overrides):
        code = doctor.main([*SMALL, f"paths.data={tmp_path}/data", *overrides])
        return code, capsys.readouterr().out.splitlines()

    return run


def test_what_is_said_of_shapenet(examine, tmp_path):
    templates = paper_templates("chair")
    files = good_models("v1") | bad_models("v1")
    renamed = {path.replace("/plain/", f"/{templates[4]}/"): data for path, data in files.items()}
    root = write_folder(tmp_path / "shapenet", renamed)
    write_zips(root, good_models("v1", "04379243"))
    (root / "02691156.zip").write_bytes(b"PK\3\4 cut off")
    code, lines = examine("data=shapenet", f"data.root={root}")
    text = "\n".join(lines)
    assert code == 1, "something cannot be used"
    chair = next(line.split() for line in lines if line.strip().startswith("chair "))
    assert chair[1:] == [str(4 + len(BAD)), "2", "1", "of", "30", "no"]
    table = next(line.split() for line in lines if line.strip().startswith("table "))
    assert table[1:] == ["4", "0", "0", "of", "30", "no"]
    assert "chair: 1 shapes: it has no model.obj (absent)" in lines
    assert "chair: 1 shapes: its model.obj is empty (empty)" in lines
    absent = next(line for line in lines if "templates are absent" in line)
    assert absent.startswith("chair: 29 of the paper's templates are absent or cannot be used")
    assert "`medoids` ones" in absent
    assert sorted(absent.partition("places: ")[2].split(", ")) == sorted(
        set(templates) - {templates[4]}
    )
    assert "chair: 3 of 7 tried are rejected" in text
    assert "plane: the archive" in text
    assert "02691156.zip is damaged or incomplete" in text
    assert "are not: bench (02828884)" in text
    assert "chair (03001627)" not in text
    left = [path for path in (tmp_path / "data").glob("**/*") if path.is_file()]
    sheets = [tmp_path / "data" / "sheets" / f"shapenet-{name}.png" for name in ("chair", "table")]
    assert sorted(left) == sheets, "a doctor leaves nothing behind but pictures"
    for sheet in sheets:
        assert f"{sheet.stem.removeprefix('shapenet-')}: contact sheet: " in text
        assert Image.open(sheet).width > 1000
    assert "chair: warnings of those tried: " in text


def test_one_category_and_a_set_that_is_prepared(examine, tmp_path):
    root = write_zips(tmp_path / "shapenet", good_models("v2"))
    overrides = ["data=shapenet", f"data.root={root}", "category=chair"]
    code, lines = examine(*overrides)
    assert code == 0
    chair = next(line.split() for line in lines if line.strip().startswith("chair "))
    assert (chair[1], chair[-1]) == ("4", "no")
    done = run_command("prepare", *SMALL, f"paths.data={tmp_path}/data", *overrides)
    assert done.returncode == 0, done.stderr
    assert "prepared 4 shapes" in done.stderr
    code, lines = examine(*overrides)
    chair = next(line.split() for line in lines if line.strip().startswith("chair "))
    assert (chair[1], chair[-1]) == ("4", "yes")
    assert any(line.startswith(f"chair: {tmp_path}/data/prepared/chair-") for line in lines)


def test_renderings_and_parts_are_counted(examine, tmp_path):
    root = write_folder(tmp_path / "shapenet", good_models("v1"))
    for view in range(24):
        file = root / "ShapeNetRendering" / CHAIR / "plain" / "rendering" / f"{view:02d}.png"
        file.parent.mkdir(parents=True, exist_ok=True)
        Image.new("RGBA", (8, 8)).save(file)
    parts = tmp_path / "shapenetcore_partanno_segmentation_benchmark_v0_normal" / CHAIR
    write_folder(parts, {f"{i}.txt": b"0 0 0 0 1 0 12\n" for i in ("plain", "of_no_shape_here")})
    _, lines = examine(
        "data=shapenet", f"data.root={root}", "data.images=r2n2", f"data.parts_root={tmp_path}"
    )
    assert "chair: 3 shapes: it has no rendering (nomtl, textured, windows)" in lines
    assert "chair: parts of 1 shapes are annotated" in lines


def test_templates_without_a_rendering_count_as_absent(examine, tmp_path):
    first, second = paper_templates("chair")[:2]
    files = good_models("v1")
    for model, template in (("plain", first), ("textured", second)):
        files = {path.replace(f"/{model}/", f"/{template}/"): data for path, data in files.items()}
    root = write_folder(tmp_path / "shapenet", files)
    for view in range(24):
        file = root / "ShapeNetRendering" / CHAIR / first / "rendering" / f"{view:02d}.png"
        file.parent.mkdir(parents=True, exist_ok=True)
        Image.new("RGBA", (8, 8)).save(file)
    for images, there in (("render", 2), ("r2n2", 1)):
        _, lines = examine(
            "data=shapenet", f"data.root={root}", f"data.images={images}", "sheets=null"
        )
        absent = next(line for line in lines if "templates are absent" in line)
        assert absent.startswith(f"chair: {30 - there} of the paper's templates")
        assert (second in absent) == (images == "r2n2")
        assert first not in absent
    assert not list((tmp_path / "data").glob("**/*.png"))


def test_categories_that_a_version_lacks(examine, tmp_path):
    files = good_models("v2") | good_models("v2", "04090263") | good_models("v2", "04401088")
    root = write_folder(tmp_path / "shapenet", files)
    _, lines = examine("data=shapenet", f"data.root={root}", "category=chair", "sheets=null")
    absent = next(line for line in lines if line.startswith("of the paper's 13 categories"))
    assert "cellphone (02992529)" in absent
    assert "firearm (03948459)" in absent
    assert "chair (" not in absent, "whichever one is looked at"
    assert "it has telephone and rifle instead" in absent
    assert absent.endswith("needs category=chair")


def test_outliers_and_small_subsets_are_told(
    examine, tiny_config, prepared, data_root, capsys, monkeypatch
):
    odd = np.array([shape_id == "table-000003" for shape_id in prepared.ids])
    monkeypatch.setattr(ShapeDistances, "outlying", lambda found: (odd, np.ones(len(odd))))
    note = "table: 1 of 24 shapes are like nothing else in their category: table-000003; split."
    prepare(tiny_config())
    assert note in capsys.readouterr().err
    settings = ("data.num_points=256", "data.render.height=48", "data.render.width=64")
    there = ("data.num_models=24", "data.render.samples=1", f"paths.data={data_root}")
    code, lines = examine("category=table", "sheets=null", *settings, *there)
    assert code == 0
    assert any(line.split()[:3] == ["table", "24", "0"] for line in lines)
    assert any(line.startswith(note) for line in lines)
    tested = [i for i in prepared.ids if HashSplit()(SplitInput("", (i,), (), {}))[i] == "test"]
    assert any(f"and {len(tested)} to test on: what is measured on fewer" in x for x in lines)


def test_what_is_not_there(examine, tmp_path):
    with pytest.raises(ConfigError, match=r"must be given: data\.root=\.\.\."):
        examine("data=shapenet")
    with pytest.raises(ConfigError, match="does not exist"):
        examine("data=shapenet", f"data.root={tmp_path}/absent")
    with pytest.raises(DataError, match="is not ShapeNetCore"):
        examine("data=shapenet", f"data.root={tmp_path}")


def test_a_root_one_level_too_deep_is_refused(examine, tmp_path):
    """Shapes in place of categories: none of them is prepared on trial, nor drawn."""
    obj = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    files = {f"plane/{k}/model.obj": obj for k in range(12)} | {"plane/11/lod.obj": obj}
    root = write_folder(tmp_path / "planes", files)
    with pytest.raises(ConfigError, match=rf"12 folders of one shape each\. Set data\.root={root}"):
        examine("data=folder", f"data.root={root}/plane")
    assert not (tmp_path / "data").exists()
    _, lines = examine("data=folder", f"data.root={root}", "sheets=null")
    assert any(line.split()[:3] == ["plane", "12", "0"] for line in lines)


def test_it_is_a_command(tmp_path):
    with zipfile.ZipFile(tmp_path / f"{CHAIR}.zip", "w") as archive:
        archive.writestr(f"{CHAIR}/a/model.obj", "v 0 0 0\n")

    for arguments, code, said in (
        (["--help"], 0, "data.root=DIR"),
        (["data=shapnet"], 1, "Did you mean data=shapenet?"),
        (["data=shapenet"], 1, "these settings must be given: data.root=..."),
        (["data=shapenet", f"data.root={tmp_path}"], 1, "all 1 are rejected (a: "),
    ):
        done = run_command("doctor", *arguments, cwd=tmp_path)
        assert done.returncode == code, done.stderr
        assert said in done.stdout + done.stderr
        assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == [f"{CHAIR}.zip"]
