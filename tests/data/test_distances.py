"""Which shapes stand for a set, and which are like nothing else in it."""

import numpy as np
import pytest
import torch
from cloud_set import set_of

from ffd_lightning import shapes
from ffd_lightning.data.templates import distances
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.data.templates.choice import (
    MedoidTemplates,
    RandomTemplates,
    choose_templates,
)
from ffd_lightning.data.templates.distances import (
    POINTS,
    greedy_medoids,
    shape_distances,
    template_rows,
)
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.sampling import sample_surface

PLANES = 80
ODD = ("lamp0", "lamp1", "lamp2", "balloon", "wheel")


def cloud(category, index):
    mesh, _ = shapes.build(category, index)
    points, _ = sample_surface(mesh.vertices, mesh.faces, POINTS, np.random.default_rng(index))
    return points


def ball(squeezed):
    points = np.random.default_rng(7).normal(size=(POINTS, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True) * squeezed


@pytest.fixture(scope="module")
def planes():
    """Clouds of aeroplanes by id."""
    return {f"plane{k:02d}": cloud("plane", k) for k in range(PLANES)}


@pytest.fixture(scope="module")
def odd():
    """Clouds of what gets in among aeroplanes."""
    lamps = {name: cloud("lamp", k) for k, name in enumerate(ODD[:3])}
    return lamps | {"balloon": ball((1, 1.2, 1)), "wheel": ball((0.2, 1, 1))}


@pytest.fixture(scope="module")
def clean(planes):
    return set_of(planes.values(), planes)


@pytest.fixture(scope="module")
def mixed(planes, odd):
    return set_of((planes | odd).values(), planes | odd)


def test_the_table_holds_the_distance_of_each_pair(clean):
    table = shape_distances(clean).table
    assert table.shape == (PLANES, PLANES)
    for i, j in ((0, 1), (5, 70), (70, 5), (33, 33)):
        clouds = (torch.from_numpy(clean.cloud(row, POINTS)) for row in (i, j))
        alone = chamfer_distance(*clouds, "mean")
        assert table[i, j] == pytest.approx(float(alone), rel=1e-5)


def test_what_is_no_aeroplane_is_named_and_no_aeroplane_is(clean, mixed):
    assert not shape_distances(clean).outliers()[0].any()
    outlier, factor = shape_distances(mixed).outliers()
    assert {mixed.ids[k] for k in np.flatnonzero(outlier)} == set(ODD)
    assert factor[outlier].min() > factor[~outlier].max()
    assert np.median(factor) == pytest.approx(1)


def test_each_choice_lowers_the_sum_of_roots_the_most(clean):
    root = np.sqrt(shape_distances(clean).table.astype(float))
    chosen = []
    for _ in range(5):
        sums = {k: root[[*chosen, k]].min(axis=0).sum() for k in range(PLANES) if k not in chosen}
        chosen.append(min(sums, key=sums.get))
    assert greedy_medoids(shape_distances(clean), 5) == chosen


def test_the_first_of_many_are_the_choice_of_few_and_outliers_change_nothing(clean, mixed):
    many = MedoidTemplates()(mixed, 30)
    assert len(set(many)) == 30
    assert MedoidTemplates()(clean, 30) == many
    for count in (1, 2, 8, 16):
        assert MedoidTemplates()(mixed, count) == many[:count]


@pytest.mark.parametrize("candidates", [1000, 40])
@pytest.mark.parametrize("strategy", [MedoidTemplates(), RandomTemplates(3)])
def test_what_is_tested_on_changes_nothing(planes, odd, mixed, monkeypatch, strategy, candidates):
    """The choice is that of a set that does not have these shapes at all."""
    monkeypatch.setattr(distances, "CANDIDATES", candidates)
    tested = {*list(planes)[::3], "lamp1", "wheel"}
    rest = {i: points for i, points in (planes | odd).items() if i not in tested}
    alone = strategy(set_of(rest.values(), rest), 12)
    assert choose_templates(strategy, mixed, 12, tested) == alone
    assert choose_templates(strategy, mixed, 5, tested) == alone[:5]


def test_rows_say_what_each_template_covers(prepared):
    ids = [prepared.ids[k] for k in (7, 3, 11)]
    rows, coverage = template_rows(prepared, TemplateBank.of(prepared, ids))
    table = shape_distances(prepared).table[[7, 3, 11]]
    others = [k for k in range(len(prepared)) if k not in (7, 3, 11)]
    assert [(row["order"], row["id"]) for row in rows] == list(enumerate(ids, 1))
    assert [row["family"] for row in rows] == [prepared.families[k] for k in (7, 3, 11)]
    nearest = table.argmin(0)
    assert [row["share"] for row in rows] == pytest.approx(np.bincount(nearest, minlength=3) / 24)
    for t, row in enumerate(rows):
        own = [table[t, k] for k in others if nearest[k] == t]
        assert row["chamfer"] == pytest.approx(np.mean(own), rel=1e-5)
    assert coverage == pytest.approx(table[:, others].min(0).mean(), rel=1e-5)


def test_templates_of_a_large_set_count_whether_they_were_looked_at_or_not(prepared, monkeypatch):
    assert len(prepared) < distances.CANDIDATES
    monkeypatch.setattr(distances, "CANDIDATES", 4)
    rows, _ = template_rows(prepared, TemplateBank.of(prepared, [prepared.ids[1]]))
    assert rows[0]["share"] == 1
