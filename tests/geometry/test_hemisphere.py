import itertools
from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import nnls

from ffd_lightning.geometry.hemisphere import bounding_hemisphere


def exact_hemisphere(vertices):
    """Oracle: centre and squared radius in rational numbers, by all singles, pairs and triples."""
    points = [[Fraction(float(c)) for c in p] for p in vertices]
    low = min(y for _, y, _ in points)
    points = [(x, z, (y - low) ** 2) for x, y, z in points]
    centers = [(x, z) for x, z, _ in points]
    for (x, z, h), (p, q, k) in itertools.combinations(points, 2):
        u, w = p - x, q - z
        if u or w:
            t = (1 + (k - h) / (u * u + w * w)) / 2
            centers.append((x + t * u, z + t * w))
    for (x, z, h), *others in itertools.combinations(points, 3):
        (a, b, e), (c, d, f) = [
            (p - x, q - z, ((p - x) ** 2 + (q - z) ** 2 + k - h) / 2) for p, q, k in others
        ]
        if det := a * d - b * c:
            centers.append((x + (e * d - b * f) / det, z + (a * f - e * c) / det))
    return min(
        (max((x - p) ** 2 + (z - q) ** 2 + h for x, z, h in points), p, q) for p, q in centers
    )


def small_sets():
    rng = np.random.default_rng(0)
    for i in range(30):
        count, noise = int(rng.integers(1, 8)), 10.0 ** rng.integers(-12, 0)
        points = rng.normal(size=(count, 3))
        yield points
        yield points[rng.integers(0, 2, count) % count]  # duplicates
        yield points[rng.integers(0, 2, count) % count] + noise * rng.normal(size=(count, 3))
        yield np.outer(rng.normal(size=count), points[0])  # collinear
        yield points * [1, noise, 1]  # nearly coplanar, in each direction
        yield points * [1, 1, noise]
        yield np.round(points * 2)  # ties
        angle = rng.random(count) * 2 * np.pi
        circle = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
        yield circle
        yield circle * 10.0 ** (3 * (i % 9) - 12) + 1e6 * (i % 2)


def test_equals_brute_force_in_rational_numbers():
    for vertices in small_sets():
        found = bounding_hemisphere(vertices)
        squared, *_ = exact_hemisphere(vertices)
        radius = float(squared) ** 0.5
        # What one rounding of a coordinate of the centre does to the radius.
        rounding = 4 * np.finfo(float).eps * (np.abs(vertices).max() + radius)
        assert abs(found.radius - radius) <= rounding
        assert found.center[1] == vertices[:, 1].min()


def surfaces():
    rng = np.random.default_rng(2)
    angle = rng.random(50_000) * 2 * np.pi
    ring = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    ball = rng.normal(size=(50_000, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    yield "normal", rng.normal(size=(50_000, 3)) * [1, 0.3, 2]
    yield "upper half of a ball", np.where([False, True, False], np.abs(ball), ball)
    yield "noisy circle", ring * (1 + 1e-9 * rng.normal(size=(50_000, 1)))
    yield "grid", np.stack(np.meshgrid(*[np.linspace(0, 1, 30)] * 3), axis=-1).reshape(-1, 3)


@pytest.mark.parametrize(("name", "vertices"), surfaces())
def test_optimality_conditions(name, vertices):
    """No direction leads away from all farthest vertices: 0 is a convex combination of them."""
    found = bounding_hemisphere(vertices)
    seen = (vertices - found.center) / found.radius
    power = np.square(seen).sum(axis=1)
    assert power.max() <= 1 + 1e-14
    tight, power = seen[power > 1 - 1e-13][:, [0, 2]], power[power > 1 - 1e-13]
    weights, _ = nnls(np.column_stack([tight, np.ones(len(tight))]).T, np.array([0.0, 0, 1]))
    weights /= weights.sum()
    # The dual value bounds the squared radius from below, whatever the weights.
    lower = weights @ power - np.square(weights @ tight).sum()
    assert lower == pytest.approx(1, abs=1e-12)
