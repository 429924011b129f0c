import numpy as np
import pytest
import torch

from ffd_lightning.config import TemplateStrategy
from ffd_lightning.data.templates import TemplateBank, choose_templates
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.geometry.deformation import deform
from ffd_lightning.losses.chamfer import chamfer_distance

DIVERSE, RANDOM = TemplateStrategy.diverse, TemplateStrategy.random
LISTED, RANKING = TemplateStrategy.listed, TemplateStrategy.ranking


@pytest.fixture(scope="module")
def bank(prepared):
    return TemplateBank(prepared, choose_templates(prepared, 3, DIVERSE), (3, 2, 1), max_edge=0.2)


def least_distance(prepared, ids):
    clouds = [torch.from_numpy(np.array(prepared.points[prepared.index(i)])) for i in ids]
    pairs = [(a, b) for k, a in enumerate(clouds) for b in clouds[:k]]
    return min(float(chamfer_distance(a, b, "mean")) for a, b in pairs)


def test_diverse_spreads_better_than_chance(prepared):
    diverse = choose_templates(prepared, 5, DIVERSE)
    assert len(set(diverse)) == 5
    assert choose_templates(prepared, 5, DIVERSE) == diverse
    chance = [
        least_distance(prepared, choose_templates(prepared, 5, RANDOM, seed=s)) for s in range(6)
    ]
    assert least_distance(prepared, diverse) > np.mean(chance)


def test_random_repeats_by_seed(prepared):
    first = choose_templates(prepared, 6, RANDOM, seed=1)
    assert len(set(first)) == 6
    assert choose_templates(prepared, 6, RANDOM, seed=1) == first
    assert choose_templates(prepared, 6, RANDOM, seed=2) != first


def test_all_models_can_be_templates_but_no_more(prepared):
    assert sorted(choose_templates(prepared, len(prepared), DIVERSE)) == list(prepared.ids)
    with pytest.raises(DataError, match="25 templates"):
        choose_templates(prepared, 25, DIVERSE)


def test_listed_ignores_comments_blank_lines_and_repeats(prepared, tmp_path):
    file = tmp_path / "ids.txt"
    a, b, c = prepared.ids[:3]
    file.write_bytes(f"# mine\r\n{b}\r\n\r\n{a}  # good\r\n{b}\r\n{c}\r\n".encode())
    assert choose_templates(prepared, 2, LISTED, file) == (b, a)
    assert choose_templates(prepared, 3, LISTED, file) == (b, a, c)


def test_ranking_takes_the_first(prepared, tmp_path):
    file = tmp_path / "template_ranking.csv"
    file.write_text("rank,id,count\n" + "\n".join(f"{k},{i},1" for k, i in enumerate(prepared.ids)))
    assert choose_templates(prepared, 4, RANKING, file) == prepared.ids[:4]


@pytest.mark.parametrize(
    ("strategy", "text", "match"),
    [
        (LISTED, None, "cannot be read"),
        (LISTED, "", "lists 0 ids, 2 are needed"),
        (LISTED, "nobody\nno-one\n", "not in"),
        (RANKING, "rank,name\n1,a\n", "no column `id`"),
    ],
)
def test_files_that_do_not_fit_are_named(prepared, tmp_path, strategy, text, match):
    file = tmp_path / "file"
    if text is not None:
        file.write_text(text)
    with pytest.raises(ConfigError, match=match) as error:
        choose_templates(prepared, 2, strategy, file)
    assert str(file) in str(error.value)


def test_the_bank_reproduces_its_clouds_and_meshes(bank):
    clouds = bank.deformation_matrix @ bank.control_points
    torch.testing.assert_close(clouds, bank.points, atol=1e-5, rtol=0)
    for t in range(len(bank)):
        mesh, matrix = bank.subdivided(t)
        rest = matrix @ bank.control_points[t]
        np.testing.assert_allclose(rest.numpy(), mesh.vertices, atol=1e-5)


def test_subdivision_keeps_edges_short_and_parts_in_place(bank):
    for t, coarse in enumerate(bank.meshes):
        mesh, _ = bank.subdivided(t)
        corners = mesh.vertices[mesh.faces]
        assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max() <= 0.2
        for part in np.unique(coarse.face_parts):
            assert area(mesh, part) == pytest.approx(area(coarse, part), rel=1e-5)


def area(mesh, part):
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces[mesh.face_parts == part]], 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def test_samples_are_fresh_rows_of_each_template(bank):
    rng = np.random.default_rng(0)
    first, second = bank.sample(50, rng), bank.sample(50, rng)
    assert first.deformation_matrix.shape == (3, 50, bank.control_points.shape[1])
    assert not torch.equal(first.deformation_matrix, second.deformation_matrix)
    for t in range(3):
        distance = torch.cdist(first.deformation_matrix[t], bank.deformation_matrix[t]).amin(1)
        assert distance.max() < 1e-3
        assert len(first.deformation_matrix[t].unique(dim=0)) == 50


def test_offsets_move_the_mesh_as_they_move_the_cloud(bank):
    offsets = torch.full((bank.control_points.shape[1], 3), 0.25)
    moved = bank.deformed_mesh(1, offsets)
    np.testing.assert_allclose(moved.vertices, bank.subdivided(1)[0].vertices + 0.25, atol=1e-5)
    cloud = deform(bank.deformation_matrix[1], bank.control_points[1], offsets)
    torch.testing.assert_close(cloud, bank.points[1] + 0.25, atol=1e-5, rtol=0)
