import itertools
import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from PIL import Image
from scipy.spatial import cKDTree

from ffd_lightning.analysis.figures import examples as figure_examples
from ffd_lightning.analysis.figures import figure as paper_figures
from ffd_lightning.analysis.figures import sheets as paper_figures_sheets
from ffd_lightning.analysis.figures.drawing import (
    View,
    draw_row,
    fitting_scale,
    legend,
    painted,
    rgba,
    voxel_mesh,
    with_bars,
    with_rims,
)
from ffd_lightning.analysis.figures.examples import Choice, collect, pick_images
from ffd_lightning.analysis.figures.sheets import (
    AGREEMENT,
    DEFORMED,
    TRUTH,
    voxel_agreement,
)
from ffd_lightning.app.commands import figures
from ffd_lightning.app.open_run import open_run
from ffd_lightning.app.settings import read_settings
from ffd_lightning.app.training_run import train
from ffd_lightning.errors import DataError, UserError
from ffd_lightning.evaluation.protocols import Measure, PaperProtocol
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.imaging.rendering import render
from ffd_lightning.palette import part_colors
from ffd_lightning.run_folder import RunFolder

GREY, ORANGE, BLUE = AGREEMENT.values()
FRONT = View(Camera(0, 0), height=96, width=128)


@pytest.fixture(scope="module")
def run(tiny_config, tmp_path_factory):
    """A tiny run of 2 steps, evaluated with fewer points."""
    run = RunFolder(tmp_path_factory.mktemp("sweep") / "run")
    train(tiny_config("regime=e", "schedule.steps=2", "protocol.points=64"), run)
    return run


@pytest.fixture(scope="module")
def examples(run):
    """Two images, with deformations that can be seen."""
    (found,) = collect([run], Choice(number=2), open_run)
    rng = np.random.default_rng(0)
    return [
        replace(e, offsets=e.offsets + rng.normal(0, 0.1, e.offsets.shape).astype(np.float32))
        for e in found
    ]


@pytest.fixture
def drawn(monkeypatch):
    """Draw nothing; keep the meshes of each row, and the labels."""
    rows, texts = [], []

    def keep_row(meshes, view, azimuths=None):
        rows.append(meshes)
        return [np.zeros((view.height, view.width, 3), np.uint8)] * len(meshes)

    sheet = paper_figures_sheets.lay_out

    def keep_labels(images, columns, labels, **options):
        texts.extend(labels)
        return sheet(images, columns, labels, **options)

    monkeypatch.setattr(paper_figures_sheets, "draw_row", keep_row)
    monkeypatch.setattr(paper_figures_sheets, "lay_out", keep_labels)
    return rows, texts


def samples_of(run):
    return pd.read_csv(run.evaluation("paper-points-64") / "samples.csv").set_index("id")


# --- voxels --------------------------------------------------------------------------------------


def test_the_iou_of_the_voxels_is_that_of_the_evaluation(run, drawn):
    table = samples_of(run)
    (found,) = collect([run], Choice(number=3), open_run)
    paper_figures_sheets.voxels(found, 64)
    rows, texts = drawn
    assert len(rows) == 3
    for k, example in enumerate(found):
        iou = table.loc[example.name, "iou"]
        assert texts[5 * k + 3] == f"IoU x 1000: {1000 * iou:.1f}"


def test_agreement_tells_the_four_cases_apart():
    rng = np.random.default_rng(0)
    predicted, true = rng.random((2, 6, 6, 6)) < 0.4
    kinds, iou = voxel_agreement(predicted, true)
    for place in np.ndindex(kinds.shape):
        expected = {(0, 0): 0, (1, 1): 1, (0, 1): 2, (1, 0): 3}
        assert kinds[place] == expected[int(predicted[place]), int(true[place])]
    both, missed, added = ((kinds == k).sum() for k in (1, 2, 3))
    assert iou == both / (both + missed + added)


def test_a_voxel_mesh_has_the_faces_that_touch_no_other_voxel():
    kinds = np.random.default_rng(1).integers(0, 4, (5, 5, 5))
    mesh = voxel_mesh(kinds, [GREY, ORANGE, BLUE])
    filled = {tuple(place) for place in np.argwhere(kinds > 0)}
    open_faces = dict.fromkeys((1, 2, 3), 0)
    steps = [s for s in itertools.product((-1, 0, 1), repeat=3) if np.abs(s).sum() == 1]
    for place in filled:
        free = sum(tuple(np.add(place, step)) not in filled for step in steps)
        open_faces[int(kinds[place])] += free
    for kind, color in ((1, GREY), (2, ORANGE), (3, BLUE)):
        plain = (mesh.face_colors == (*color, 255)).all(1)
        assert plain.sum() == 2 * open_faces[kind]
    assert len(mesh.faces) == 10 * sum(open_faces.values())
    corners = mesh.vertices[mesh.faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), 2, 1
    )
    assert area.sum() / 2 == pytest.approx(sum(open_faces.values()) / 25)
    assert mesh.vertices.min() >= -0.5
    assert mesh.vertices.max() <= 0.5


def test_colours_of_voxels_show_as_often_as_they_can_be_seen():
    kinds = np.zeros((8, 8, 8), int)
    kinds[1:3, 3:5, 3] = 2  # seen from the front: two orange, one blue, none of the grey behind
    kinds[5, 3:5, 3] = 3
    kinds[5, 3:5, 4] = 1
    mesh = voxel_mesh(kinds, [GREY, ORANGE, BLUE])

    def shares(azimuth):
        (picture,) = draw_row([mesh], FRONT, [Camera(azimuth, 0)])
        red, green, blue = np.moveaxis(picture.astype(int), 2, 0)
        return np.array(
            [
                ((red > 1.5 * green) & (red > 2 * blue)).sum(),
                ((blue > 1.5 * green) & (blue > 2 * red)).sum(),
                ((abs(red - green) < 9) & (abs(green - blue) < 9) & (red < 150)).sum(),
            ]
        )

    orange, blue, grey = shares(0)
    assert orange > 100
    assert orange / blue == pytest.approx(2, rel=0.15)
    assert grey < 0.05 * orange  # corners, where pixels mix
    orange, blue, grey = shares(180)
    assert blue < 0.05 * orange
    assert grey > 0.35 * orange


# --- subdivision ---------------------------------------------------------------------------------


def areas(vertices, faces):
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def test_subdivision_shows_one_surface_and_one_deformation(examples, drawn):
    paper_figures_sheets.subdivision(examples, 64)
    rows, texts = drawn
    for k, (example, row) in enumerate(zip(examples, rows, strict=True)):
        bank = example.run.data.bank
        coarse = bank.meshes[example.ranked()]
        count, faces = len(coarse.vertices), coarse.faces
        before, after, fine, fine_after, truth = row
        np.testing.assert_array_equal(before.vertices[:count], coarse.vertices)
        assert areas(fine.vertices, fine.faces).sum() == pytest.approx(
            areas(coarse.vertices, faces).sum()
        )
        ends = fine.vertices[fine.faces]
        assert np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=2).max() <= bank.max_edge
        # Where the two have a vertex in common, the deformation takes it to the same place.
        distance, same = cKDTree(fine.vertices).query(coarse.vertices)
        assert distance.max() < 1e-9
        moved = after.vertices[:count] - coarse.vertices
        assert np.abs(moved).max() > 0.05
        np.testing.assert_allclose(after.vertices[:count], fine_after.vertices[same], atol=1e-5)
        assert f"{count:,} vertices\n{len(faces):,} faces" in texts[6 * k + 1]
        assert f"{len(fine.vertices):,} vertices\n{len(fine.faces):,} faces" in texts[6 * k + 3]
        assert (truth.face_colors == (*TRUTH, 255)).all()


def tetrahedron():
    vertices = np.array([[0, 0, 0], [0.4, 0, 0], [0, 0.4, 0], [0, 0, 0.4]])
    return painted((vertices, np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]])), DEFORMED)


def test_every_edge_has_one_bar_around_it():
    mesh = tetrahedron()
    barred = with_bars(mesh, 0.01, (0, 0, 0))
    assert len(barred.faces) == 4 + 6 * 6
    bars = barred.vertices[4:].reshape(6, 2, 3, 3)
    for bar, (a, b) in zip(bars, itertools.combinations(mesh.vertices, 2), strict=True):
        for ring, end in zip(bar, (a, b), strict=True):
            np.testing.assert_allclose(ring.mean(0), end, atol=1e-12)
            np.testing.assert_allclose(np.linalg.norm(ring - end, axis=1), 0.01)
            np.testing.assert_allclose((ring - end) @ (b - a), 0, atol=1e-12)
    point = painted((np.zeros((3, 3)), np.array([[0, 1, 2]])), DEFORMED)
    assert len(with_bars(point, 0.01, (0, 0, 0)).faces) == 1


def test_rims_are_dark_and_change_no_shape():
    mesh = tetrahedron()
    plain = render(mesh, Camera(200, 20))
    rimmed = render(with_rims(mesh, (0, 0, 0)), Camera(200, 20))
    np.testing.assert_array_equal(plain[..., 3], rimmed[..., 3])
    inside = plain[..., 3] == 255
    same = (plain == rimmed).all(2) & inside
    dark = (rimmed[..., :3].max(2) < 40) & inside
    assert same.sum() > 0.4 * inside.sum()
    assert 0.1 * inside.sum() < dark.sum() < 0.5 * inside.sum()


# --- labels --------------------------------------------------------------------------------------


def test_parts_keep_their_colours(examples, drawn):
    prepared = examples[0].run.data.prepared
    palette = part_colors(np.arange(256, dtype=np.uint8))
    picture = paper_figures_sheets.labels(examples, 64).draw()
    rows, texts = drawn
    for k, (example, row) in enumerate(zip(examples, rows, strict=True)):
        template_cloud, deformed_cloud, mesh, truth = row
        known = example.template().labelled_points()
        centers = template_cloud.vertices.reshape(-1, 6, 3).mean(1)
        np.testing.assert_allclose(centers, known.points, atol=1e-7)
        np.testing.assert_array_equal(template_cloud.face_colors[::8], palette[known.labels])
        np.testing.assert_array_equal(template_cloud.face_colors, deformed_cloud.face_colors)
        assert np.abs(template_cloud.vertices - deformed_cloud.vertices).max() > 0.05
        fine, _ = example.run.data.bank.subdivided(example.ranked())
        np.testing.assert_array_equal(mesh.face_colors, palette[fine.face_parts])
        own = prepared.mesh(example.sample.row)
        np.testing.assert_array_equal(truth.face_colors, palette[own.face_parts])
        assert texts[5 * k + 2].startswith("part IoU x 100: ")
        for color in np.unique(truth.face_colors[:, :3], axis=0):  # it is in the legend
            assert (picture[-40:] == color).all(2).sum() >= 81


def test_a_legend_breaks_into_lines():
    entries = [("one", (9, 0, 0)), ("two", (0, 9, 0)), ("three", (0, 0, 9))]
    wide, narrow = legend(entries, 400, 10), legend(entries, 60, 10)
    assert (wide.width, narrow.width) == (400, 60)
    assert narrow.height > 2 * wide.height
    for sheet in (wide, narrow):
        assert [line.text for line in sheet.lines] == [text for text, _ in entries]
        for _, color in entries:
            assert (sheet.draw() == color).all(2).sum() == 100


def test_data_without_parts_is_refused(examples, monkeypatch):
    prepared = examples[0].run.data.prepared
    manifests = tuple(manifest | {"part_names": []} for manifest in prepared.manifests)
    prepared = replace(prepared, manifests=manifests)
    monkeypatch.setattr(examples[0].run.data, "prepared", prepared)
    with pytest.raises(DataError, match="no part labels"):
        paper_figures_sheets.labels(examples, 64)


# --- the other figures ---------------------------------------------------------------------------


def test_candidates_are_ordered_and_scored_as_the_evaluation_does(run, drawn, monkeypatch):
    monkeypatch.setattr(paper_figures_sheets, "_PAPER", PaperProtocol(points=64))
    (found,) = collect([run], Choice(number=1), open_run)
    paper_figures_sheets.candidates(found, 64, count=5)
    (row,), texts = drawn
    weights = np.sort(found[0].weights)[::-1]
    bank, sample = found[0].run.data.bank, samples_of(run).loc[found[0].name]
    assert len(row) == 2 * len(bank) + 1 == 5
    assert [t.split("\n")[1] for t in texts[1:3]] == [f"weight {w:.2f}" for w in weights]
    assert texts[1].split("\n")[0] == sample["template"]
    chamfer, iou = 1000 * sample["chamfer"], 1000 * sample["iou"]
    assert texts[4] == f"Chamfer x 1000: {chamfer:.1f}\nIoU x 1000: {iou:.1f}"


def test_a_row_is_drawn_at_one_scale_and_nothing_is_cut_off():
    small = painted((tetrahedron().vertices / 8, tetrahedron().faces), DEFORMED)
    large = painted((tetrahedron().vertices * 5, tetrahedron().faces), DEFORMED)
    alone, beside = draw_row([small], FRONT), draw_row([small, large], FRONT)
    covered = [(picture < 255).any(2) for picture in (alone[0], *beside)]
    assert covered[1].sum() < 0.25 * covered[0].sum()
    assert covered[2].sum() > 500
    assert not covered[2][[0, -1]].any()
    assert not covered[2][:, [0, -1]].any()


@pytest.mark.parametrize("azimuth", [0, 45, 230])
@pytest.mark.parametrize("size", [(96, 128), (160, 100)])
@pytest.mark.parametrize("camera", [Camera(), *RenderSettings(camera="authors").cameras()])
def test_the_scale_is_the_largest_that_fits(azimuth, size, camera):
    rng = np.random.default_rng(azimuth)
    points = rng.normal(size=(9, 3)) + [0.3, -0.5, 0.2]
    view = View(replace(camera, azimuth=azimuth), *size)
    scale = fitting_scale(points, view)
    assert 0 < scale < 1

    def on_border(factor):
        mesh = painted((factor * points, np.arange(9).reshape(3, 3)), DEFORMED)
        alpha = render(mesh, view.camera, height=view.height, width=view.width, samples=5)[..., 3]
        return bool(alpha[[0, -1]].any() or alpha[:, [0, -1]].any())

    assert not on_border(scale)
    assert on_border(1.1 * scale)
    assert fitting_scale(0.1 * scale * points, view) == 1


def test_an_overview_has_the_image_and_the_shapes(examples, drawn):
    paper_figures_sheets.overview(examples, 64)
    rows, texts = drawn
    for k, (example, row) in enumerate(zip(examples, rows, strict=True)):
        _, cloud, cubes, mesh, truth = row
        np.testing.assert_array_equal(mesh.vertices, example.deformed().mesh()[0])
        np.testing.assert_array_equal(truth.vertices, example.truth.mesh()[0])
        assert texts[6 * k].startswith("table-")
        assert texts[6 * k + 4].startswith("Chamfer x 1000: ")
        for shown in (cloud, cubes):  # they lie where the mesh is
            gap = cKDTree(mesh.vertices).query(shown.vertices[::7])[0]
            assert np.median(gap) < 0.05
    np.testing.assert_array_equal(
        example.image(example.view(64)), example.run.data.prepared.image(*example.sample)[..., :3]
    )


# --- choosing ------------------------------------------------------------------------------------


def test_images_are_picked_by_their_scores():
    table = pd.DataFrame({"id": list("edcba"), "view": 0, "x": [1.0, 2, 3, 4, 4]})

    def picked(pick, number, higher=False):
        images = pick_images(table, Measure("x", "", higher), pick, number)
        return "".join(model for model, _ in images)

    assert picked("best", 2) == "ed"
    assert picked("best", 2, higher=True) == "ab"
    assert picked("worst", 2) == "ba"
    assert picked("median", 1) == picked("spread", 1) == "c"
    assert picked("median", 3) == "dca"
    assert picked("spread", 3) == "ecb"
    assert picked("spread", 9) == "edcab"


def test_runs_side_by_side_show_the_same_images(run, drawn):
    first, second = collect([run, run], Choice(number=2, pick="worst"), open_run)
    assert [e.name for e in first] == [e.name for e in second]
    order = samples_of(run)["chamfer"].sort_values(ascending=False)
    assert [e.name for e in first] == list(order.index[:2])
    one = paper_figures.paper_figure("subdivision", [first[:1]], 64).draw()
    both = paper_figures.paper_figure("subdivision", [first[:1], second[:1]], 64).draw()
    assert both.shape[1] == 2 * one.shape[1] + 12
    np.testing.assert_array_equal(both[-4 - len(one) : -4, 4 : 4 + one.shape[1]], one)


def test_images_of_training_are_said_to_be(run):
    data = collect([run], Choice(number=1), open_run)[0][0].run.data
    models = (data.split.test[0], data.split.train[0], data.bank.ids[0])
    (found,) = collect([run], Choice(models=models), open_run)
    assert [e.name.partition("\n")[2] for e in found] == ["", "(trained on)", "(a template)"]
    assert [bool(e.score) for e in found] == [True, False, False]


def test_random_images_need_no_scores(run, tmp_path):
    shutil.copytree(run.path, tmp_path / "run")
    shutil.rmtree(tmp_path / "run" / "evaluation")
    bare = RunFolder(tmp_path / "run")
    names = [
        [e.name for e in collect([bare], Choice(number=2, pick="random", seed=s), open_run)[0]]
        for s in (0, 0, 1)
    ]
    assert names[0] == names[1] != names[2]
    with pytest.raises(DataError, match=r"not been evaluated.*ffd evaluate run="):
        collect([bare], Choice(), open_run)


def test_scores_of_other_weights_are_refused(run, tmp_path):
    shutil.copytree(run.path, tmp_path / "run")
    other = RunFolder(tmp_path / "run")
    file = other.evaluation("paper-points-64") / "samples.csv"
    table = pd.read_csv(file)
    table["template"] = "table-x"
    table.to_csv(file)
    with pytest.raises(DataError, match="evaluate the run again"):
        collect([other], Choice(number=1), open_run)


# --- the command ---------------------------------------------------------------------------------


def draw(*arguments):
    return figures.main(read_settings(figures.Settings, arguments, figures.MAIN))


@pytest.mark.parametrize("figure", list(paper_figures.FIGURES))
def test_the_command_writes_a_picture(run, examples, tmp_path, capsys, monkeypatch, figure):
    monkeypatch.setattr(figure_examples, "collect", lambda *_: [examples[:1]])  # opened before
    file = tmp_path / "new" / "a.png"
    assert (
        draw(f"figure={figure}", str(run.path), "number=1", "size=64", "top=1", f"out={file}") == 0
    )
    *_, said, path = capsys.readouterr().out.splitlines()
    assert path == str(file)
    assert "1 image of" in said
    picture = np.asarray(Image.open(file))
    assert picture.dtype == np.uint8
    assert picture.shape[2] == 3
    assert picture.shape[1] >= 2 * 68
    assert (picture < 200).any()
    assert [p.name for p in file.parent.iterdir()] == ["a.png"]


def test_a_picture_goes_into_the_run_s_folder(run, capsys):
    model = samples_of(run).index[1]
    draw("figure=overview", f"runs=[{run.path},{run.path}]", f"models={model}", "size=64")
    file = run.path / "overview.png"
    assert capsys.readouterr().out.splitlines()[-1] == str(file)
    file.unlink()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["{run}/.."], "is not a run folder, but holds 1"),
        (["{run}/nothing"], "is not a run folder: it has no config.yaml"),
        (["runs=[]"], "at least one run"),
        (["{run}", "figure=overvew"], "figure= is given twice"),
        (["{run}", "data_root={run}"], "the prepared data of .* is not there.*data_root=DIR"),
        (["{run}", "protocol=modern"], r"ffd evaluate run=.* protocol=modern"),
        (["{run}", "models=[table-00001]"], "there is no shape 'table-00001'.*table-0000"),
        (["{run}", "number=0"], "number=0"),
        (["{run}", "pick=good"], "pick=good: choose one of spread, best"),
        (["{run}", "size=9"], "size=9"),
        (["{run}", "top=0"], "top=0"),
        (["{run}", "out=a.jpg"], "written as .png"),
    ],
)
def test_mistakes_are_named(run, options, message):
    with pytest.raises(UserError, match=message):
        draw("figure=overview", *(option.format(run=run.path) for option in options))
    with pytest.raises(UserError, match="choose one of method, overview, subdivision"):
        draw("figure=overvew", str(run.path))


def test_colours_are_opaque():
    np.testing.assert_array_equal(rgba([(1, 2, 3)]), [[1, 2, 3, 255]])
    assert rgba([]).shape == (0, 4)
