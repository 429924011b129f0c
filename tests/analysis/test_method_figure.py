from dataclasses import replace

import numpy as np
import pytest

from ffd_lightning.analysis.figures import method as method_figure
from ffd_lightning.analysis.figures.drawing import View, bars, draw, fitting_scale, joined, painted
from ffd_lightning.analysis.figures.examples import Choice, collect
from ffd_lightning.analysis.figures.figure import paper_figure
from ffd_lightning.analysis.figures.method import method, with_lattice
from ffd_lightning.analysis.figures.sheets import DEFORMED, TEMPLATE, TRUTH
from ffd_lightning.app.open_run import open_run
from ffd_lightning.imaging.camera import Camera

FRONT = View(Camera(0, 0), height=96, width=128)
CHOICE = Choice(number=1, pick="random")


@pytest.fixture(scope="module")
def example(tiny_run):
    """An image with a deformation that can be seen, and weights that are told apart."""
    ((found,),) = collect([tiny_run], CHOICE, open_run)
    rng = np.random.default_rng(0)
    offsets = found.offsets + rng.normal(0, 0.05, found.offsets.shape).astype(np.float32)
    weights = np.array([0.1, 0.6, 0.25, 0.05], np.float32)[: len(found.weights)]
    return replace(found, offsets=offsets, weights=weights)


@pytest.fixture
def drawn(monkeypatch):
    """Draw nothing; keep what is drawn in lattices, and alone."""
    in_lattices, alone = [], []

    def blank(view):
        return np.zeros((view.height, view.width, 3), np.uint8)

    monkeypatch.setattr(
        method_figure,
        "with_lattice",
        lambda mesh, lattice, view, scale: (in_lattices.append((mesh, lattice)), blank(view))[1],
    )
    monkeypatch.setattr(
        method_figure, "draw", lambda mesh, view, scale: (alone.append(mesh), blank(view))[1]
    )
    return in_lattices, alone


def test_joined_meshes_keep_their_triangles_and_colours():
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    parts = [painted((triangle + k, np.array([[0, 1, 2]])), (k, 0, 0)) for k in range(3)]
    whole = joined(parts)
    np.testing.assert_array_equal(
        whole.vertices[whole.faces], [triangle, triangle + 1, triangle + 2]
    )
    assert whole.face_colors[:, 0].tolist() == [0, 1, 2]


def wall(z):
    """A square before the camera, which looks along z from -z."""
    corners = np.array([[-0.2, -0.2, z], [0.2, -0.2, z], [0.2, 0.2, z], [-0.2, 0.2, z]])
    return painted((corners, np.array([[0, 1, 2], [0, 2, 3]])), TEMPLATE)


def test_a_lattice_is_seen_before_a_mesh_and_faintly_behind_it():
    line = bars(np.array([[[-0.3, 0.0, 0.0], [0.3, 0.0, 0.0]]]), 0.02, (0, 0, 0))
    plain = draw(wall(0.1), FRONT, 1)[..., :3].astype(int)
    full = draw(line, FRONT, 1)[..., 3] == 255
    on_wall = full & (plain < 255).all(2)
    assert on_wall.sum() > 50
    before = with_lattice(wall(0.1), line, FRONT, 1).astype(int)
    behind = with_lattice(wall(-0.1), line, FRONT, 1).astype(int)
    assert before[on_wall].max() <= 1
    near = draw(wall(-0.1), FRONT, 1).astype(int)
    hidden = full & (near[..., 3] == 255)
    assert hidden.sum() > 50
    np.testing.assert_allclose(behind[hidden] / near[hidden][:, :3], 0.7, atol=0.01)
    untouched = draw(line, FRONT, 1)[..., 3] == 0
    np.testing.assert_array_equal(before[untouched], plain[untouched])


def test_lattices_are_the_control_points_before_and_after(example, drawn):
    method([example], 96)
    (still, first), (moved, second) = drawn[0]
    bank, index = example.run.data.bank, example.ranked()
    points = bank.control_points[index].numpy()
    for lattice, expected in ((first, points), (second, points + example.offsets[index])):
        dots = lattice.vertices[: 6 * len(points)].reshape(-1, 6, 3).mean(1)
        np.testing.assert_allclose(dots, expected, atol=1e-6)
    offsets = (first.face_colors[:, :3] == method_figure.OFFSET).all(1)
    assert offsets.sum() == 6 * len(points)
    assert not (second.face_colors[:, :3] == method_figure.OFFSET).all(1).any()
    ends = first.vertices[-6 * len(points) :].reshape(-1, 2, 3, 3).mean(2)
    np.testing.assert_allclose(ends[:, 1] - ends[:, 0], example.offsets[index], atol=1e-6)
    np.testing.assert_array_equal(still.vertices, example.template().mesh()[0])
    np.testing.assert_array_equal(moved.vertices, example.deformed().mesh()[0])
    assert [tuple(mesh.face_colors[0, :3]) for mesh in drawn[1]] == [DEFORMED, TRUTH]


def test_lattices_that_reach_far_do_not_make_everything_small():
    mesh = wall(0)
    near, far, out = (painted((k * mesh.vertices, mesh.faces), TEMPLATE) for k in (1, 3, 99))
    assert method_figure._scales([mesh], [near], FRONT) == (1, 1)
    own, wide = method_figure._scales([mesh], [far], FRONT)
    assert (own, wide) == (1, fitting_scale(far.vertices, FRONT))
    assert method_figure._scales([mesh], [out], FRONT) == (1, method_figure._SMALLEST)


def test_runs_are_shown_below_each_other(example):
    one = paper_figure("method", [[example]], 64).draw()
    both = paper_figure("method", [[example], [example]], 64).draw()
    assert both.shape[1] == one.shape[1] + 8
    first, second = np.split(both, 2)
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(first[-4 - len(one) : -4, 4:-4], one)
