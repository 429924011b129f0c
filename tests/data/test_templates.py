import itertools
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial import cKDTree

from ffd_lightning.data.categories import PAPER_CATEGORIES, paper_templates
from ffd_lightning.data.preparation.packing import pack_mesh, pack_points
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.templates import coverage, strategies
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.data.templates.strategies import (
    ListedStrategy,
    RandomStrategy,
    RankingStrategy,
    auto_choice,
    choose_templates,
    diverse_templates,
    medoid_templates,
    paper_choice,
)
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.rendering import render

MAX_EDGE = 0.08


def clouds(prepared):
    return np.stack([prepared.cloud(row) for row in range(len(prepared))])


@pytest.fixture(scope="module")
def distances(prepared):
    """Chamfer distances between the clouds that the choice looks at, by trees, (n, n)."""
    trees = [cKDTree(cloud.astype(np.float64)) for cloud in clouds(prepared)]
    table = np.zeros((len(trees), len(trees)))
    for i, j in itertools.permutations(range(len(trees)), 2):
        table[i, j] += (trees[j].query(trees[i].data)[0] ** 2).mean()
        table[j, i] += (trees[j].query(trees[i].data)[0] ** 2).mean()
    return table


@pytest.fixture(scope="module")
def bank(prepared):
    ids = choose_templates(RandomStrategy(4), prepared, 3)
    return TemplateBank.of(prepared, ids, max_edge=MAX_EDGE)


def choose_from(prepared, path, text, count=2, strategy=ListedStrategy):
    path.write_bytes(text.encode())
    return choose_templates(strategy(path), prepared, count)


# --- choosing -----------------------------------------------------------------------------------


def test_diverse_starts_at_the_centre_and_goes_to_the_farthest(prepared, distances, monkeypatch):
    monkeypatch.setattr(strategies, "_SPREAD", len(prepared))  # the centre of all of them
    rows = [int(distances.sum(0).argmin())]
    while len(rows) < 6:
        rows.append(max(range(len(prepared)), key=lambda i: distances[i, rows].min()))
    chosen = choose_templates(diverse_templates, prepared, 6)
    assert chosen == tuple(prepared.ids[r] for r in rows)


@pytest.mark.parametrize("strategy", [medoid_templates, diverse_templates, RandomStrategy()])
def test_as_many_templates_as_shapes(prepared, strategy):
    chosen = choose_templates(strategy, prepared, len(prepared))
    assert sorted(chosen) == list(prepared.ids)


@pytest.mark.parametrize("strategy", [medoid_templates, diverse_templates])
def test_few_candidates_still_give_distinct_templates(prepared, monkeypatch, strategy):
    for module in (strategies, coverage):
        monkeypatch.setattr(module, "CANDIDATES", 4)
    assert len(set(choose_templates(strategy, prepared, 8))) == 8


def test_random_is_a_function_of_the_seed(prepared):
    draws = [choose_templates(RandomStrategy(s), prepared, 4) for s in (0, 0, 1, 2, 3)]
    assert draws[0] == draws[1]
    assert len(set(draws)) == 4
    assert all(len(set(draw)) == 4 and set(draw) <= set(prepared.ids) for draw in draws)


def test_more_templates_than_shapes(prepared):
    for exclude, count in ((), 25), (prepared.ids[:4], 21):
        with pytest.raises(DataError, match=rf"{count} .* only {count - 1} shapes to choose from"):
            choose_templates(diverse_templates, prepared, count, exclude)


def test_what_a_strategy_of_ones_own_chooses_is_checked(prepared):
    a, b, c = prepared.ids[:3]
    assert choose_templates(lambda *_: [c, a], prepared, 2) == (c, a)
    for ids in ([a], [a, a], [a, a, b], [a, b, c]):
        words = f"choose 2 shapes .*: it gives {len(ids)} ids, {len(set(ids))} different ones"
        with pytest.raises(ConfigError, match=words):
            choose_templates(lambda *_, ids=ids: ids, prepared, 2)
    with pytest.raises(ConfigError, match="'unicorn' is not in"):
        choose_templates(lambda *_: [a, "unicorn"], prepared, 2)


# --- files --------------------------------------------------------------------------------------


def test_listed_keeps_the_order_of_the_file(prepared, tmp_path):
    a, b, c = prepared.ids[7], prepared.ids[2], prepared.ids[5]
    text = f"\ufeff# chosen by hand\r\n\n  {a}  # the first\n{a}\r\n\n{b}\n{c}\n"
    assert choose_from(prepared, tmp_path / "ids", text) == (a, b)
    assert choose_from(prepared, tmp_path / "ids", text, 3) == (a, b, c)


def test_ranking_reads_the_column_by_its_name(prepared, tmp_path):
    a, b = prepared.ids[9], prepared.ids[4]
    text = f"rank,id,family\n1,{a},x\n\n2,{a},x\n3, {b},x\n4\n"
    assert choose_from(prepared, tmp_path / "r.csv", text, strategy=RankingStrategy) == (a, b)


@pytest.mark.parametrize(
    ("strategy", "text", "message"),
    [
        (RankingStrategy, "", "no column `id`"),
        (RankingStrategy, "name\nx\ny\n", "no column `id`"),
        (RankingStrategy, "rank,id\n1,{0}\n2\n3,\n", "lists 1 ids, 2 are needed"),
        (ListedStrategy, "{0}\n{0}\n", "lists 1 ids, 2 are needed"),
    ],
)
def test_files_with_too_few_ids(prepared, tmp_path, strategy, text, message):
    with pytest.raises(ConfigError, match=message):
        choose_from(prepared, tmp_path / "f", text.format(*prepared.ids), strategy=strategy)


def test_unknown_ids_are_named_where_they_are_needed(prepared, tmp_path):
    text = f"{prepared.ids[0]}\nunicorn\n"
    with pytest.raises(ConfigError, match=r"names 1 shapes .* 'unicorn'"):
        choose_from(prepared, tmp_path / "ids", text)
    assert choose_from(prepared, tmp_path / "ids", text, 1) == (prepared.ids[0],)


@pytest.mark.parametrize("make", [lambda path: None, Path.mkdir, lambda p: p.write_bytes(b"\xff")])
def test_unreadable_file(prepared, tmp_path, make):
    make(tmp_path / "ids")
    with pytest.raises(ConfigError, match=r"template_strategy\.file=.*ids cannot be read"):
        choose_templates(ListedStrategy(tmp_path / "ids"), prepared, 2)


def test_a_list_may_name_any_shape(prepared, tmp_path):
    (tmp_path / "ids").write_text("\n".join(prepared.ids[:2]))
    strategy = ListedStrategy(tmp_path / "ids")
    assert choose_templates(strategy, prepared, 2, prepared.ids[1:9]) == prepared.ids[:2]


def test_the_file_may_name_the_category(prepared, tmp_path):
    (tmp_path / "table.txt").write_text(prepared.ids[5])
    strategy = ListedStrategy(str(tmp_path / "{category}.txt"))
    assert choose_templates(strategy, prepared, 1) == (prepared.ids[5],)


# --- the bank -----------------------------------------------------------------------------------


def test_the_bank_holds_the_prepared_models(prepared, bank):
    rows = [prepared.index(i) for i in bank.ids]
    assert len(bank) == 3
    np.testing.assert_array_equal(bank.points, clouds(prepared)[rows])
    np.testing.assert_array_equal(bank.point_parts, [prepared.point_parts(r) for r in rows])
    assert bank.families == tuple(prepared.families[r] for r in rows)
    np.testing.assert_array_equal(bank.meshes[1].faces, prepared.mesh(rows[1]).faces)


def test_decomposition_reproduces_the_clouds(bank):
    torch.testing.assert_close(
        bank.deformation_matrix @ bank.control_points, bank.points, atol=1e-5, rtol=0
    )
    assert bank.deformation_matrix.dtype == bank.control_points.dtype == torch.float32


def test_the_lattice_is_the_box_of_the_mesh_and_not_of_the_cloud(bank):
    for mesh, control in zip(bank.meshes, bank.control_points.numpy(), strict=True):
        corners = mesh.vertices[mesh.faces].reshape(-1, 3)
        np.testing.assert_allclose(control.min(0), corners.min(0), atol=1e-6)
        np.testing.assert_allclose(control.max(0), corners.max(0), atol=1e-6)


@pytest.mark.parametrize("index", range(3))
def test_subdivided_mesh_keeps_shape_parts_colors_and_textures(bank, index):
    coarse, (fine, matrix) = bank.meshes[index], bank.subdivided(index)
    corners = fine.vertices[fine.faces]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
    assert edges.max() <= MAX_EDGE < np.ptp(coarse.vertices, axis=0).max()
    for part in np.unique(coarse.face_parts):
        areas = [area(m, m.face_parts == part) for m in (coarse, fine)]
        assert areas[0] == pytest.approx(areas[1], rel=1e-9)
    textures = [
        np.full(len(m.faces), -1) if m.face_textures is None else m.face_textures
        for m in (coarse, fine)
    ]
    for texture in np.unique(textures[0]):
        areas = [area(m, t == texture) for m, t in zip((coarse, fine), textures, strict=True)]
        assert areas[0] == pytest.approx(areas[1], rel=1e-9)
    plain = [t < 0 for t in textures]
    for color in np.unique(coarse.face_colors[plain[0]], axis=0):
        areas = [
            area(m, (m.face_colors == color).all(1) & own)
            for m, own in zip((coarse, fine), plain, strict=True)
        ]
        assert areas[0] == pytest.approx(areas[1], rel=1e-9)
    reproduced = (matrix @ bank.control_points[index]).numpy()
    np.testing.assert_allclose(reproduced, fine.vertices, atol=1e-5)


def area(mesh, faces):
    corners = mesh.vertices[mesh.faces[faces]]
    edges = corners[:, 1:] - corners[:, :1]
    return np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum() / 2


def test_templates_keep_their_textures_deformed_too(bank):
    """As an image, the deformed mesh has the texture's contrast, and so have its plain colours."""
    index = next(k for k, mesh in enumerate(bank.meshes) if mesh.textures)
    coarse, offsets = bank.meshes[index], torch.zeros_like(bank.control_points[index])
    deformed = bank.deformed_mesh(index, offsets)
    images = [render(m, height=96, width=128).astype(int) for m in (coarse, deformed)]
    assert np.abs(images[0] - images[1]).mean() < 0.1
    assert all(np.array_equal(*p) for p in zip(deformed.textures, coarse.textures, strict=True))
    textured = deformed.face_textures >= 0
    assert len(np.unique(deformed.face_colors[textured], axis=0)) > 3 * len(coarse.textures)


def test_deformed_mesh_moves_as_the_offsets_say(bank):
    rest = bank.subdivided(0)[0].vertices
    zero = torch.zeros_like(bank.control_points[0])
    np.testing.assert_allclose(bank.deformed_mesh(0, zero).vertices, rest, atol=1e-5)
    shift = torch.tensor([0.1, -0.2, 0.3])
    moved = bank.deformed_mesh(0, zero + shift)
    np.testing.assert_allclose(moved.vertices, rest + shift.numpy(), atol=1e-5)
    stretched = bank.deformed_mesh(0, 0.5 * bank.control_points[0])
    np.testing.assert_allclose(stretched.vertices, 1.5 * rest, atol=1e-5)


@pytest.mark.parametrize("parts", [True, False])
def test_a_bank_comes_back_from_its_state(prepared, tmp_path, parts):
    if not parts:
        prepared = replace(prepared, manifests=({**prepared.manifests[0], "part_names": []},))
    bank = TemplateBank.of(prepared, prepared.ids[:2], (2, 3, 4), MAX_EDGE)
    torch.save(bank.state(), tmp_path / "bank.pt")
    again = TemplateBank.from_state(torch.load(tmp_path / "bank.pt", weights_only=True))
    for name in ("ids", "families", "part_names", "degrees", "max_edge"):
        assert getattr(again, name) == getattr(bank, name)
    for name in ("points", "control_points", "deformation_matrix"):
        assert torch.equal(getattr(again, name), getattr(bank, name))
    np.testing.assert_array_equal(again.point_parts, bank.point_parts)
    for one, other in zip(again.meshes, bank.meshes, strict=True):
        np.testing.assert_array_equal(one.vertices, other.vertices)
        np.testing.assert_array_equal(one.faces, other.faces)
        np.testing.assert_array_equal(one.face_colors, other.face_colors)
        np.testing.assert_array_equal(one.face_parts, other.face_parts)
        assert one.part_names == other.part_names
        assert len(one.textures) == len(other.textures)
        for mine, theirs in zip(one.textures, other.textures, strict=True):
            assert np.abs(mine.astype(int) - theirs).mean() < 4  # packed twice
        if other.face_textures is not None:
            np.testing.assert_array_equal(one.face_textures, other.face_textures)
            np.testing.assert_array_equal(one.face_uvs, other.face_uvs)
    assert any(mesh.textures for mesh in again.meshes)
    offsets = torch.randn(bank.control_points[1].shape) / 10
    one, other = again.deformed_mesh(1, offsets), bank.deformed_mesh(1, offsets)
    np.testing.assert_array_equal(one.vertices, other.vertices)


def test_vertices_that_no_face_uses_do_not_widen_the_lattice():
    bank = TemplateBank.of(square_set(np.vstack([SQUARE, (9, 9, 9)])), ("square",))
    np.testing.assert_allclose(bank.control_points[0].amax(0), (0.5, 0, 0.5), atol=1e-6)


def test_flat_template():
    """All control points lie in its plane, and moving them all moves it out of that plane."""
    bank = TemplateBank.of(square_set(SQUARE), ("square",))
    assert bank.point_parts is None
    points = bank.deformation_matrix @ bank.control_points
    torch.testing.assert_close(points, bank.points, atol=1e-6, rtol=0)
    lifted = bank.deformed_mesh(0, torch.tensor([0.0, 1, 0]).expand(64, 3))
    np.testing.assert_allclose(lifted.vertices[:, 1], 1, atol=1e-6)
    assert lifted.face_parts is None


SQUARE = np.array([(-0.5, 0, -0.5), (0.5, 0, -0.5), (0.5, 0, 0.5), (-0.5, 0, 0.5)])


def square_set(vertices):
    """One flat square without parts."""
    cloud = np.random.default_rng(0).uniform(-0.5, 0.5, (1, 20, 3)) * (1, 0, 1)
    mesh = Mesh(vertices, np.array([(0, 1, 2), (0, 2, 3)]), np.full((2, 4), 255, np.uint8))
    packed = np.frombuffer(pack_mesh(mesh, np.full(20, 255, np.uint8)), np.uint8)
    manifest = {"ids": ["square"], "families": [""], "part_names": []}
    arrays = {"points": pack_points(cloud)[0], "mesh": packed}
    return Held((Path("square"),), ({**manifest, "settings": {"category": "x"}},), arrays=arrays)


@dataclass(frozen=True)
class Held(PreparedSet):
    """One shape that is in no file."""

    arrays: dict | None = None

    def _read(self, row, name):
        return self.arrays[name]


# --- the paper's templates ----------------------------------------------------------------------


@dataclass(frozen=True)
class Renamed(PreparedSet):
    """A set under other ids."""

    of: PreparedSet | None = None

    def file(self, row):
        return self.of.file(row if self.taken is None else self.taken[row])


def as_shapenet(prepared, ids, category="table", source="shapenet"):
    """The prepared set under other ids, as if it came from ShapeNet."""
    names = sorted([*ids, *(f"other{k:02d}" for k in range(len(prepared) - len(ids)))])
    settings = {"category": category, "source": {"source": source}}
    manifest = {**prepared.manifests[0], "settings": settings, "ids": names}
    manifest["sha256"] = f"{category} {source} {names}"
    return Renamed(prepared.paths, (manifest,), of=prepared)


def test_every_category_of_the_paper_has_30_templates():
    for category in PAPER_CATEGORIES:
        assert len(set(paper_templates(category))) == 30
    assert paper_templates("rifle") == paper_templates("mug") == ()


def test_shapenet_takes_the_papers_templates_by_default(prepared):
    known = paper_templates("table")[:6]
    there = as_shapenet(prepared, known)
    assert choose_templates(auto_choice, there, 4) == known[:4]
    elsewhere = as_shapenet(prepared, known, source="folder")
    medoids = choose_templates(medoid_templates, elsewhere, 4)
    assert choose_templates(auto_choice, elsewhere, 4) == medoids
    assert choose_templates(paper_choice, elsewhere, 4) == known[:4]


def test_what_is_added_for_absent_templates_takes_their_places(prepared, distances, caplog):
    known = paper_templates("table")[:6]
    there = as_shapenet(prepared, (known[0], known[2], *known[4:]))
    chosen = choose_templates(paper_choice, there, 8)
    assert [chosen[k] for k in (0, 2, 4, 5)] == [known[k] for k in (0, 2, 4, 5)]
    assert len(set(chosen)) == 8
    rows = [there.index(i) for i in chosen]
    papers = [there.index(i) for i in known if i in there.ids]
    root = np.sqrt(distances)
    for place in (1, 3, 6, 7):
        free = set(range(len(there))) - {*rows[:place], *papers}
        sums = {i: root[[*rows[:place], i]].min(0).sum() for i in free}
        assert sums[rows[place]] == pytest.approx(min(sums.values()))  # two may be as good


def test_the_papers_templates_may_be_tested_on_and_what_is_added_may_not(prepared):
    known = paper_templates("table")[:3]
    there = as_shapenet(prepared, known[:2])
    tested = {known[0], *(i for k, i in enumerate(there.ids) if k % 2 and i not in known)}
    chosen = choose_templates(paper_choice, there, 8, tested)
    assert chosen[:2] == known[:2]
    assert not set(chosen[2:]) & tested


def test_the_papers_further_templates_are_taken_where_there_is_nothing_else(prepared):
    there = as_shapenet(prepared, paper_templates("table")[6:])
    assert set(there.ids) < set(paper_templates("table"))
    chosen = choose_templates(paper_choice, there, 3)
    assert len(set(chosen)) == 3
