import itertools
import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from commands import call
from conftest import FEW
from PIL import Image

from ffd_lightning.analysis.figures import examples as figure_examples
from ffd_lightning.analysis.figures import sheets
from ffd_lightning.analysis.figures.drawing import voxel_mesh
from ffd_lightning.analysis.figures.examples import collect, in_order, picked
from ffd_lightning.analysis.figures.sheets import FIGURES, paper_figure
from ffd_lightning.app.commands import figures
from ffd_lightning.app.open_run import open_run
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.protocols import Metric
from ffd_lightning.palette import part_colors
from ffd_lightning.run_folder import RunFolder

COLORS = [(170, 170, 170), (230, 120, 0), (0, 114, 178)]


@pytest.fixture(scope="module")
def example(tiny_run):
    """An image with a deformation that can be seen, and weights that are told apart."""
    ((found, *_),) = collect([tiny_run], open_run, number=1)
    rng = np.random.default_rng(0)
    offsets = found.offsets + rng.normal(0, 0.1, found.offsets.shape).astype(np.float32)
    weights = np.array([0.1, 0.6, 0.25, 0.05], np.float32)[: len(found.weights)]
    return replace(found, offsets=offsets, weights=weights)


def cells(name, example, count=1):
    """What a figure draws beside an image, by its heading."""
    return {c.heading: c for c in FIGURES[name](example, example.view(64), count)}


def samples_of(run):
    return pd.read_csv(run.evaluation(FEW) / "samples.csv").set_index("id")


def test_a_voxel_mesh_has_the_faces_that_touch_no_other_voxel():
    kinds = np.random.default_rng(1).integers(0, 4, (5, 5, 5))
    mesh = voxel_mesh(kinds, COLORS)
    filled = {tuple(place) for place in np.argwhere(kinds > 0)}
    open_faces = dict.fromkeys((1, 2, 3), 0)
    steps = [s for s in itertools.product((-1, 0, 1), repeat=3) if np.abs(s).sum() == 1]
    for place in filled:
        free = sum(tuple(np.add(place, step)) not in filled for step in steps)
        open_faces[int(kinds[place])] += free
    for kind, color in zip((1, 2, 3), COLORS, strict=True):
        assert (mesh.face_colors == (*color, 255)).all(1).sum() == 2 * open_faces[kind]
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    np.testing.assert_allclose(area, 1 / 25)
    assert (mesh.vertices >= -0.5).all()
    assert (mesh.vertices <= 0.5).all()


def test_the_lattice_of_the_method_is_moved_by_the_offsets(example, monkeypatch):
    drawn = []
    monkeypatch.setattr(sheets, "with_lattice", lambda mesh, lattice, *_: drawn.append(lattice))
    found = cells("method", example)
    first, second = drawn
    bank, index = example.run.data.bank, example.ranked()
    points = bank.control_points[index].numpy()
    for lattice, expected in ((first, points), (second, points + example.offsets[index])):
        dots = lattice.vertices[: 6 * len(points)].reshape(-1, 6, 3).mean(1)
        np.testing.assert_allclose(dots, expected, atol=1e-6)
    ends = first.vertices[-6 * len(points) :].reshape(-1, 2, 3, 3).mean(2)
    np.testing.assert_allclose(ends[:, 1] - ends[:, 0], example.offsets[index], atol=1e-6)
    deformed = found["deformed mesh"].content
    np.testing.assert_array_equal(deformed.vertices, example.deformed().mesh()[0])


def test_the_iou_of_the_voxels_is_that_of_the_evaluation(tiny_run):
    table = samples_of(tiny_run)
    (found,) = collect([tiny_run], open_run, number=2)
    for example in found:
        expected = f"IoU x 1000: {1000 * table.loc[example.name, 'iou']:.1f}"
        assert cells("voxels", example)["voxels"].label == expected


def test_parts_keep_their_colours(example):
    prepared, found = example.run.data.prepared, cells("labels", example)
    known = example.template().labelled_points()
    before, after = (found[f"{name} cloud"].content for name in ("template", "deformed"))
    centers = before.vertices.reshape(-1, 6, 3).mean(1)
    np.testing.assert_allclose(centers, known.points, atol=1e-7)
    np.testing.assert_array_equal(before.face_colors[::8], part_colors(known.labels))
    np.testing.assert_array_equal(before.face_colors, after.face_colors)
    fine, _ = example.run.data.bank.subdivided(example.ranked())
    colors = found["deformed mesh"].content.face_colors
    np.testing.assert_array_equal(colors, part_colors(fine.face_parts))
    truth = found["ground truth"].content.face_colors
    own = prepared.mesh(example.sample.row)
    np.testing.assert_array_equal(truth, part_colors(own.face_parts))
    named = {(*color, 255) for color in sheets.part_legend([example]).values()}
    assert {tuple(color) for color in truth.tolist()} <= named


def test_images_are_picked_by_their_scores():
    table = pd.DataFrame({"id": list("edcba"), "view": 0, "run": "r", "x": [1.0, 2, 3, 4, 4]})

    def chosen(pick, number, higher=False):
        order = in_order(table, Metric("x", "", higher)).index.tolist()
        return "".join(shape for shape, _ in picked(order, pick, number))

    assert chosen("best", 2) == "ed"
    assert chosen("best", 2, higher=True) == "ab"
    assert chosen("worst", 2) == "ba"
    assert chosen("median", 1) == chosen("spread", 1) == "c"
    assert chosen("median", 3) == "dca"
    assert chosen("spread", 3) == "ecb"
    assert chosen("spread", 9) == "edcab"


def test_runs_beside_each_other_show_the_same_images(tiny_run):
    first, second = collect([tiny_run, tiny_run], open_run, number=2, pick="worst")
    order = samples_of(tiny_run)["chamfer"].sort_values(ascending=False)
    assert [e.name for e in first] == [e.name for e in second] == list(order.index[:2])
    one = np.asarray(paper_figure("overview", [first[:1]], 64))
    both = np.asarray(paper_figure("overview", [first[:1], second[:1]], 64))
    assert both.shape[1] == 2 * (one.shape[1] + 8)
    np.testing.assert_array_equal(both[-4 - len(one) : -4, 4 : 4 + one.shape[1]], one)


def test_random_images_need_no_scores(tiny_run, tmp_path):
    shutil.copytree(tiny_run.path, tmp_path / "run")
    shutil.rmtree(tmp_path / "run" / "evaluation")
    bare = RunFolder(tmp_path / "run")
    names = [
        [e.name for e in collect([bare], open_run, number=2, pick="random", seed=seed)[0]]
        for seed in (0, 0, 1)
    ]
    assert names[0] == names[1] != names[2]
    with pytest.raises(DataError, match=r"not been evaluated.*ffd evaluate run="):
        collect([bare], open_run)


def test_scores_of_other_weights_are_refused(tiny_run, tmp_path):
    shutil.copytree(tiny_run.path, tmp_path / "run")
    other = RunFolder(tmp_path / "run")
    file = other.evaluation(FEW) / "samples.csv"
    pd.read_csv(file).assign(template="table-x").to_csv(file)
    with pytest.raises(DataError, match="evaluate the run again"):
        collect([other], open_run, number=1)


@pytest.mark.parametrize("figure", list(FIGURES))
def test_the_command_writes_a_picture(tiny_run, example, tmp_path, capsys, monkeypatch, figure):
    monkeypatch.setattr(figure_examples, "collect", lambda *_, **options: [[example]])
    file = tmp_path / "new" / "a.png"
    arguments = [str(tiny_run.path), "number=1", "size=64", f"out={file}"]
    arguments += ["top=1"] * (figure == "method")
    assert call(figures, f"figure={figure}", *arguments) == 0
    assert capsys.readouterr().out == f"{file}\n"
    picture = np.asarray(Image.open(file))
    assert picture.shape[1] >= 2 * 68
    assert (picture < 200).any()


@pytest.mark.parametrize("given", ["top=2", "seed=1", "models=[a] pick=best"])
def test_the_command_refuses_what_does_nothing(tiny_run, given):
    with pytest.raises(ConfigError, match="means nothing here"):
        call(figures, "figure=overview", str(tiny_run.path), *given.split())
