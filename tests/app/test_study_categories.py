import pytest
from shapenet_tree import good_models, write_folder

from ffd_lightning.app.commands.sweep import Request, run_study
from ffd_lightning.app.configuration import config_folder
from ffd_lightning.app.studies import absent_categories, check_categories, load_study
from ffd_lightning.app.studies import sweeps as stages
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.errors import ConfigError, DataError

V2 = ("03001627", "04379243", "04090263")  # chair, table, rifle


@pytest.fixture
def shapenet(tmp_path):
    files = {}
    for synset in V2:
        files |= good_models("v2", synset)
    root = write_folder(tmp_path / "shapenet", files)
    return ["data=shapenet", f"data.root={root}"]


def sweeps(name, *overrides, quick=False):
    study = load_study(config_folder("sweeps") / f"{name}.yaml")
    return stages(study, "x", quick, list(overrides))


def test_absent_categories_by_name_and_by_synset():
    source = ProceduralSource(3)
    assert absent_categories(source, ["chair", "rifle", "03001627", "mug", "rifle"]) == [
        "rifle",
        "mug",
    ]


@pytest.mark.parametrize("name", ["paper_table", "joint"])
def test_a_study_of_what_is_not_there_is_refused_with_the_way_out(shapenet, name):
    with pytest.raises(DataError) as caught:
        check_categories(sweeps(name, *shapenet))
    said = str(caught.value)
    assert "lacks 11 of the study's 13 categories" in said
    assert "cellphone (02992529)" in said
    assert "firearm (03948459)" in said
    assert "it has rifle instead" in said
    if name == "joint":  # category=chair,table would replace category=joint of its last stage
        assert "a copy of the study's file" in said
    else:
        assert said.endswith("category=chair,table")


@pytest.mark.parametrize("category", ["chair,table", "rifle", "03001627"])
def test_what_is_there_is_let_through(shapenet, category):
    own = f"category={category}"
    if category.isdigit():
        own = "category=custom"
        shapenet = [*shapenet, f"category.name={category}"]
    check_categories(sweeps("paper_table", *shapenet, own))


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("name", ["paper_table", "joint", "regimes", "template_counts", "search"])
def test_every_study_can_run_on_the_embedded_data(name, quick):
    check_categories(sweeps(name, quick=quick))


def test_a_pattern_of_categories_is_left_to_hydra(shapenet):
    check_categories(sweeps("paper_table", *shapenet, "category=glob(c*)"))


def test_of_nothing_that_is_there_the_data_itself_tells(shapenet, tmp_path):
    with pytest.raises(DataError, match="it has: chair"):
        check_categories(sweeps("paper_table", *shapenet, "category=plane,car"))
    (tmp_path / "empty").mkdir()
    with pytest.raises(DataError, match="is not ShapeNetCore"):
        check_categories(sweeps("paper_table", "data=shapenet", f"data.root={tmp_path}/empty"))
    with pytest.raises(ConfigError, match="does not exist"):
        check_categories(sweeps("paper_table", "data=shapenet", f"data.root={tmp_path}/none"))


def test_nothing_of_a_refused_study_runs(shapenet, tmp_path):
    request = Request.parse(
        ["paper_table", *shapenet, f"paths.runs={tmp_path}/runs", "encoder.weights=none"]
    )
    with pytest.raises(DataError, match="Nothing has run yet"):
        run_study(request)
    assert not (tmp_path / "runs").exists()
