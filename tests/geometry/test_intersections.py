"""Against exact arithmetic on small integer coordinates, and shapes that are known."""

import itertools
from fractions import Fraction

import numpy as np
import pytest
import torch
import trimesh

from ffd_lightning.geometry.intersections import merge_equal, self_intersecting_faces

# The oracle: the points where an edge of either face meets the other one (as closed sets) span
# their intersection, and its middle lies inside both faces exactly if their interiors meet.


def minus(a, b):
    return tuple(x - y for x, y in zip(a, b, strict=True))


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def normal(t):
    return cross(minus(t[1], t[0]), minus(t[2], t[0]))


def barycentric(p, t):
    n = normal(t)
    if dot(n, minus(p, t[0])) != 0:
        return None
    corners = (dot(n, cross(minus(t[k - 1], t[k - 2]), minus(p, t[k - 2]))) for k in range(3))
    return [Fraction(c) / dot(n, n) for c in corners]


def meeting_points(start, end, t):
    n, along = normal(t), minus(end, start)
    from_start, from_end = (dot(n, minus(x, t[0])) for x in (start, end))
    candidates = []
    if from_start == from_end == 0:
        candidates = [start, end]
        for p, q in itertools.combinations(t, 2):
            other = cross(along, minus(q, p))
            if other != (0, 0, 0):
                at = Fraction(dot(cross(minus(p, start), minus(q, p)), other)) / dot(other, other)
                candidates.append(tuple(s + at * a for s, a in zip(start, along, strict=True)))
            else:
                candidates += [p, q]
        inside = [dot(minus(c, start), along) for c in candidates]
        on_line = [cross(minus(c, start), along) == (0, 0, 0) for c in candidates]
        candidates = [
            c
            for c, x, on in zip(candidates, inside, on_line, strict=True)
            if on and 0 <= x <= dot(along, along)
        ]
    elif from_start * from_end <= 0:
        at = Fraction(from_start) / (from_start - from_end)
        candidates = [tuple(s + at * a for s, a in zip(start, along, strict=True))]
    weights = [barycentric(c, t) for c in candidates]
    return [c for c, w in zip(candidates, weights, strict=True) if w and min(w) >= 0]


def interiors_meet(a, b):
    points = []
    for one, other in ((a, b), (b, a)):
        for k in range(3):
            points += meeting_points(one[k], one[k - 1], other)
    if not points:
        return False
    middle = tuple(sum(map(Fraction, x)) / len(points) for x in zip(*points, strict=True))
    inside = [barycentric(middle, t) for t in (a, b)]
    return all(w is not None and min(w) > 0 for w in inside)


def expected_faces(vertices, faces, coplanar):
    triangles = [[tuple(map(int, vertices[i])) for i in face] for face in faces]
    result = np.zeros(len(faces), bool)
    for i, j in itertools.combinations(range(len(faces)), 2):
        a, b = triangles[i], triangles[j]
        if (0, 0, 0) in (normal(a), normal(b)) or set(a) & set(b):
            continue
        if not coplanar and cross(normal(a), normal(b)) == (0, 0, 0):
            continue
        if interiors_meet(a, b):
            result[i] = result[j] = True
    return result


@pytest.mark.parametrize("coplanar", [True, False])
@pytest.mark.parametrize("size", [2, 3, 6, 30])
def test_agrees_with_exact_arithmetic(size, coplanar):
    rng = np.random.default_rng(size)
    hits = misses = 0
    for _ in range(40):
        vertices = rng.integers(0, size + 1, (16, 3))
        if rng.random() < 0.3:
            vertices[:, rng.integers(3)] = 1  # all in one plane
        faces = rng.integers(0, 16, (7, 3))
        expected = expected_faces(vertices, faces, coplanar)
        got = self_intersecting_faces(vertices, faces, 1e-9, coplanar)
        np.testing.assert_array_equal(got, expected, err_msg=f"{vertices.tolist()} {faces}")
        hits, misses = hits + expected.sum(), misses + (~expected).sum()
    assert hits > 20
    assert misses > 20


def joined(*meshes):
    whole = trimesh.util.concatenate(meshes)
    return np.asarray(whole.vertices), np.asarray(whole.faces)


def test_a_bar_through_a_box_marks_its_sides_and_the_pierced_walls():
    box = trimesh.creation.box((2, 2, 2))
    bar = trimesh.creation.box((0.2, 0.1, 6))
    bar.apply_translation((0.5, 0.3, 0.1))  # inside one triangle of each wall
    vertices, faces = joined(box, bar)
    found = self_intersecting_faces(vertices, faces)
    assert found[:12].sum() == 2
    assert found[12:].sum() == 8
    ends = np.abs(vertices[faces][12:].mean(axis=1)[:, 2] - 0.1) > 2.9
    assert not found[12:][ends].any()


@pytest.mark.parametrize(
    ("profile", "hits", "hits_across"),
    [
        ([(0, 0), (4, 0), (4, 3), (1, -3)], 4, 4),  # the third strip passes through the first
        ([(0, 0), (4, 0), (4, 3), (1, 1)], 0, 0),
        ([(0, 0), (9, 0), (9, 1), (8, 1), (8, 0), (2, 0)], 4, 0),  # back onto itself
    ],
)
def test_a_folded_sheet(profile, hits, hits_across):
    vertices = np.array([(x, y, z) for x, z in profile for y in (0, 5)], float)
    faces = [
        f
        for k in range(0, len(vertices) - 2, 2)
        for f in ((k, k + 1, k + 2), (k + 3, k + 2, k + 1))
    ]
    assert self_intersecting_faces(vertices, faces).sum() == hits
    assert self_intersecting_faces(vertices, faces, coplanar=False).sum() == hits_across
    np.testing.assert_array_equal(
        self_intersecting_faces(vertices, faces, 1e-9), expected_faces(vertices, faces, True)
    )


def tube(path, radius, sides=24):
    """A closed tube around a closed path in the plane z = 0, (P, 2)."""
    ahead = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    outward = np.c_[ahead[:, 1], -ahead[:, 0], np.zeros(len(path))]
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    circle = np.cos(angles)[:, None] * outward[:, None] + np.sin(angles)[:, None] * [0, 0, 1]
    vertices = np.c_[path, np.zeros(len(path))][:, None] + radius * circle
    index = np.arange(len(path) * sides).reshape(len(path), sides)
    right, up = np.roll(index, -1, axis=0), np.roll(index, -1, axis=1)
    both = np.roll(right, -1, axis=1)
    faces = np.concatenate([np.stack([index, right, both], -1), np.stack([index, both, up], -1)])
    return vertices.reshape(-1, 3), faces.reshape(-1, 3)


def test_a_torus_is_clean_until_it_is_bent_through_itself():
    t = np.linspace(0, 2 * np.pi, 200, endpoint=False) + 0.01
    vertices, faces = tube(np.c_[np.cos(t), np.sin(t)], 0.1)
    assert not self_intersecting_faces(vertices, faces).any()
    vertices, faces = tube(np.c_[np.sin(t), np.sin(2 * t)], 0.1)  # an eight
    found = self_intersecting_faces(vertices, faces)
    # Two tubes of radius r that cross at an angle a meet no further off than r / sin(a / 2).
    reach = np.linalg.norm(vertices[faces].mean(axis=1)[found], axis=1)
    half = np.arctan(0.5)
    assert 0.8 * 0.1 / np.sin(half) < reach.max() < 1.2 * 0.1 / np.sin(half)
    assert 0.01 < found.mean() < 0.05


def test_a_sphere_is_clean_also_as_single_triangles():
    sphere = trimesh.creation.icosphere(3)
    assert not self_intersecting_faces(sphere.vertices, sphere.faces).any()
    soup = np.asarray(sphere.triangles).reshape(-1, 3)
    assert not self_intersecting_faces(soup, np.arange(len(soup)).reshape(-1, 3)).any()


def test_parts_that_touch_do_not_intersect():
    seat = trimesh.creation.box((2, 2, 0.2))
    leg = trimesh.creation.box((0.3, 0.2, 1))
    leg.apply_translation((0.6, 0.3, -0.6))  # its top lies in the seat's bottom
    vertices, faces = joined(seat, leg)
    assert not self_intersecting_faces(vertices, faces, coplanar=False).any()
    found = self_intersecting_faces(vertices, faces)
    assert found[12:].sum() == 2  # the leg's top
    np.testing.assert_allclose(vertices[faces[found]][:, :, 2], -0.1, atol=1e-12)


@pytest.mark.parametrize(("depth", "hit"), [(0.5, False), (2.0, True)])
def test_shallower_than_the_tolerance_is_no_intersection(depth, hit):
    flat = [[0, 0, 0], [40, 0, 0], [0, 30, 0]]  # diagonal of the whole: 50 and little
    low = -depth * 1e-3 * 50
    blade = [[5, 5, low], [9, 5, low], [7, 7, 0.1]]
    faces = [[0, 1, 2], [3, 4, 5]]
    assert self_intersecting_faces(flat + blade, faces, tolerance=1e-3).all() == hit
    assert self_intersecting_faces(flat + blade, faces).all()


def scattered(count, rng):
    """Pairs of triangles, each pair in its own cell; every second pair passes through itself."""
    cells = np.stack(np.meshgrid(*[np.arange(25)] * 3), -1).reshape(-1, 3)
    cells = cells[rng.permutation(len(cells))[:count]]
    pair = np.array([[[1, 1, 5], [9, 1, 5], [5, 9, 5]], [[5, 4, 2], [5, 5, 8], [4, 4, 8]]]) / 10
    pairs = np.repeat(pair[None], count, axis=0)
    crossing = np.arange(count) % 2 == 0
    pairs[~crossing, 1, :, 2] = pairs[~crossing, 1, :, 2] / 10 + 0.6
    turn = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3]
    vertices = (pairs + cells[:, None, None]).reshape(-1, 3) @ turn.T
    return vertices, np.arange(len(vertices)).reshape(-1, 3), np.repeat(crossing, 2)


def test_finds_the_few_among_many_whatever_the_order_scale_and_threads():
    rng = np.random.default_rng(0)
    vertices, faces, expected = scattered(5000, rng)
    order = rng.permutation(len(faces))
    threads = torch.get_num_threads()
    try:
        for number, scale in ((1, 1.0), (3, 1e-3), (2, 1e6)):
            torch.set_num_threads(number)
            found = self_intersecting_faces(scale * vertices + 7 * scale, faces[order])
            np.testing.assert_array_equal(found, expected[order])
    finally:
        torch.set_num_threads(threads)


def test_one_huge_face_through_many_small_ones():
    vertices, faces, _ = scattered(2000, np.random.default_rng(1))
    clean = self_intersecting_faces(vertices, faces)
    huge = vertices.mean(axis=0) + np.array([[90, 0, 1], [-90, 80, 1], [-90, -80, 1.1]])
    found = self_intersecting_faces(
        np.vstack([vertices, huge]), np.vstack([faces, np.arange(3) + len(vertices)])
    )
    offset = vertices[faces] - huge[0]
    side = offset @ np.cross(huge[1] - huge[0], huge[2] - huge[0])
    pierced = (side.min(axis=1) < 0) & (side.max(axis=1) > 0)
    assert pierced.sum() > 20
    np.testing.assert_array_equal(found, np.append(clean | pierced, True))


def test_what_is_no_face_is_left_out():
    flat, blade = [[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[1, 1, -1], [1, 1, 1], [1, 1, 3]]
    assert not self_intersecting_faces(flat + blade, [[0, 1, 2], [3, 4, 5]]).any()  # a needle
    assert not self_intersecting_faces(flat, [[0, 0, 1], [0, 1, 2]]).any()
    assert not self_intersecting_faces(np.zeros((3, 3)), [[0, 1, 2]]).any()
    assert self_intersecting_faces(flat, np.empty((0, 3), int)).shape == (0,)
    assert self_intersecting_faces(np.empty((0, 3)), []).shape == (0,)


def test_a_face_twice_shares_its_corners():
    flat = [[0, 0, 0], [4, 0, 0], [0, 4, 0]]
    assert not self_intersecting_faces(flat + flat, [[0, 1, 2], [5, 4, 3]]).any()


@pytest.mark.parametrize(
    ("vertices", "faces", "tolerance", "message"),
    [
        (np.eye(3), [[0, 1, 3]], 1e-6, "index the 3 vertices"),
        (np.eye(3), [[0, 1, -1]], 1e-6, "index the 3 vertices"),
        (np.eye(3)[:, :2], [[0, 1, 2]], 1e-6, "vertices must be"),
        (np.eye(3), [[0, 1, 2, 0]], 1e-6, "faces must be"),
        (np.eye(3) * np.nan, [[0, 1, 2]], 1e-6, "finite"),
        (np.eye(3), [[0, 1, 2]], 0, "tolerance"),
    ],
)
def test_refuses_what_is_no_mesh(vertices, faces, tolerance, message):
    with pytest.raises(ValueError, match=message):
        self_intersecting_faces(vertices, faces, tolerance)


def test_faces_that_touch_by_chance_are_let_off_only_when_merged():
    vertices = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 0], [2, 2, -1], [2, 2, 1]]
    faces = [[0, 1, 2], [3, 4, 5]]
    assert not self_intersecting_faces(vertices, faces).any()
    assert self_intersecting_faces(vertices, faces, merge=False).all()


def test_vertices_that_no_face_uses_do_not_matter():
    vertices, faces, expected = scattered(10, np.random.default_rng(2))
    far = np.vstack([vertices, [[1e9, 0, 0], [np.nan, 0, 0]]])
    np.testing.assert_array_equal(self_intersecting_faces(far, faces), expected)


def test_merge_equal_is_what_a_loop_finds():
    points = np.random.default_rng(0).integers(0, 3, (60, 3)).astype(float)
    rows = points.tolist()
    np.testing.assert_array_equal(merge_equal(points), [rows.index(row) for row in rows])
