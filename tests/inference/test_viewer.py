import contextlib
import re
import socket
import sys
import time
import urllib.request
from dataclasses import replace
from math import comb
from types import SimpleNamespace

import numpy as np
import pytest
import torch
import trimesh
from PIL import Image
from scipy.spatial.distance import cdist

from ffd_lightning.app.commands import view
from ffd_lightning.app.commands.view import open_studio
from ffd_lightning.app.main import run as run_command
from ffd_lightning.app.settings import read_settings
from ffd_lightning.data.preparation.part_labels import part_colors
from ffd_lightning.errors import ConfigError
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.inference.pieces import pieces
from ffd_lightning.inference.viewer.page import Page
from ffd_lightning.inference.viewer.panel_text import caption, part_legend, weight_bars
from ffd_lightning.inference.viewer.session import Session, display_bank
from ffd_lightning.inference.viewer.studio import Studio, start


@pytest.fixture(scope="module")
def studio(tiny_run, checkpoint):
    return open_studio(view.Settings(run=str(tiny_run.path), checkpoint=str(checkpoint)))


@pytest.fixture
def session(studio):
    return studio.open_shape(studio.shape_ids[0])


# --- what is shown -------------------------------------------------------------------------------


def triple_sum(point, low, high, control):
    """The paper's deformation of one point: control points weighted by Bernstein polynomials."""
    s = (point - low) / (high - low)
    basis = [[comb(3, i) * x**i * (1 - x) ** (3 - i) for i in range(4)] for x in s]
    grid = control.reshape(4, 4, 4, 3).astype(float)
    return sum(
        basis[0][i] * basis[1][j] * basis[2][k] * grid[i, j, k]
        for i in range(4)
        for j in range(4)
        for k in range(4)
    )


@pytest.mark.parametrize("amount", [0.0, 0.4, 1.0, 1.5])
def test_amount_and_edits_move_mesh_and_cloud_as_the_papers_sum_says(session, amount):
    t, found = session.template, session.reconstruction
    edit = np.random.default_rng(0).normal(0, 0.1, (64, 3)).astype(np.float32)
    session.edits[t], session.amount = edit, amount
    corners = found.bank.meshes[t].vertices[np.unique(found.bank.meshes[t].faces)]
    low, high = corners.min(axis=0), corners.max(axis=0)
    grid = np.stack(np.meshgrid(*np.linspace(low, high, 4).T, indexing="ij"), -1).reshape(-1, 3)
    control = grid + amount * found.offsets[t] + edit
    np.testing.assert_allclose(session.control_points, control, atol=1e-5)
    resting, surface = session.template_surface().vertices, session.surface().vertices
    for v in np.linspace(0, len(resting) - 1, 9).astype(int):
        np.testing.assert_allclose(
            surface[v], triple_sum(resting[v], low, high, control), atol=1e-5
        )
    for n in (0, 17, 200):
        point = found.bank.points[t, n].numpy()
        np.testing.assert_allclose(
            session.points()[n], triple_sum(point, low, high, control), atol=1e-5
        )


def test_the_undeformed_end_is_the_template(session):
    session.amount = 0.0
    resting = session.template_surface()
    np.testing.assert_allclose(session.surface().vertices, resting.vertices, atol=1e-6)
    edges = resting.vertices[resting.faces] - np.roll(resting.vertices[resting.faces], 1, axis=1)
    assert np.linalg.norm(edges, axis=2).max() <= 0.05 + 1e-9


@pytest.mark.parametrize("amount", [0.0, 0.7, 1.5])
def test_a_control_point_goes_where_it_is_put_and_takes_no_other_along(session, amount):
    session.amount = amount
    before, shape = session.control_points.copy(), session.surface().vertices
    place = np.array([0.3, -0.2, 0.5])
    session.move(21, place)
    np.testing.assert_allclose(session.control_points[21], place, atol=1e-6)
    others = np.delete(np.arange(64), 21)
    np.testing.assert_array_equal(session.control_points[others], before[others])
    assert np.flatnonzero(session.edited).tolist() == [21]
    # The shape follows by a share of the way, between 0 and 1, the same along every axis.
    moved = session.surface().vertices - shape
    share = moved @ (place - before[21]) / ((place - before[21]) ** 2).sum()
    np.testing.assert_allclose(moved, share[:, None] * (place - before[21]), atol=1e-5)
    assert 0.02 < share.max() < 1
    assert share.min() > -1e-5


def test_edits_belong_to_their_template_and_reset_takes_them_back(session):
    first = session.template
    predicted = session.control_points.copy()
    session.move(3, np.zeros(3))
    session.template = int(session.reconstruction.ranking[1])
    other = session.control_points.copy()
    assert not session.edited.any()
    np.testing.assert_allclose(
        other,
        session.rest + session.reconstruction.offsets[session.template],
        atol=1e-6,
    )
    session.reset()
    session.template = first
    assert session.edited.any(), "another template's reset"
    session.amount = 0.2
    session.reset()
    assert session.amount == 1
    np.testing.assert_array_equal(session.control_points, predicted)


def test_scores_are_chamfer_distances_of_what_is_shown(studio, session):
    found, t = session.reconstruction, session.template
    row = studio._shapes.prepared.index(session.truth.shape_id)
    truth = studio._shapes.prepared.cloud(row)[:1024]
    session.amount = 0.5
    session.move(0, np.array([-1.0, -1, -1]))

    def distance(points):
        table = cdist(points[:1024], truth) ** 2
        return table.min(axis=1).mean() + table.min(axis=0).mean()

    full = replace(found, bank=found.bank)
    matrix = full.bank.deformation_matrix[t].numpy()
    rest = full.bank.control_points[t].numpy()
    expected = {
        "shown": distance(matrix @ session.control_points),
        "predicted": distance(matrix @ (rest + found.offsets[t])),
        "undeformed": distance(full.bank.points[t].numpy()),
    }
    assert session.scores() == pytest.approx(expected, rel=1e-4)
    assert len(set(expected.values())) == 3
    assert Session(found, session.display).scores() == {}


def test_what_is_saved_is_what_is_shown_at_full_resolution(session):
    session.template = int(session.reconstruction.ranking[2])
    session.amount = 0.3
    session.move(40, np.array([0.5, 0.5, 0.5]))
    before = session.reconstruction.offsets.copy()
    saved = session.shown()
    assert saved.template_id == session.reconstruction.bank.ids[session.template]
    bank = session.reconstruction.bank
    expected = bank.deformed_mesh(session.template, torch.from_numpy(session.offsets))
    np.testing.assert_array_equal(saved.surface.vertices, expected.vertices)
    assert len(saved.surface.faces) > len(session.surface().faces)
    np.testing.assert_array_equal(session.reconstruction.offsets, before)


def test_what_is_drawn_is_the_same_templates_with_fewer_points(studio, session):
    bank, light = session.reconstruction.bank, display_bank(session.reconstruction.bank)
    torch.testing.assert_close(light.control_points, bank.control_points)
    torch.testing.assert_close(light.points, bank.points[:, :4096])
    assert light.ids == bank.ids


# --- how it is drawn -----------------------------------------------------------------------------


def colored(rgba, parts=None):
    rng = np.random.default_rng(0)
    return Mesh(
        rng.normal(size=(50, 3)),
        rng.integers(50, size=(len(rgba), 3)),
        np.asarray(rgba, np.uint8),
        parts,
        () if parts is None else ("top", "leg"),
    )


def faces_of(mesh, piece):
    return {tuple(map(tuple, mesh.vertices[piece.vertices[face]])) for face in piece.faces}


def test_pieces_are_the_faces_of_each_colour():
    rgba = np.array([(10, 20, 30, 255), (200, 0, 0, 255), (200, 0, 0, 90)])[
        np.random.default_rng(1).integers(3, size=80)
    ]
    mesh = colored(rgba)
    found = {piece.rgba: faces_of(mesh, piece) for piece in pieces(mesh, "material", 16)}
    assert set(found) == set(map(tuple, rgba.tolist()))
    for color, faces in found.items():
        mine = (rgba == color).all(axis=1)
        assert faces == {tuple(map(tuple, mesh.vertices[face])) for face in mesh.faces[mine]}


def test_many_colours_become_few_like_ones_and_glass_stays_glass():
    rng = np.random.default_rng(2)
    shades = np.array([(120, 70, 30), (30, 60, 200)])[rng.integers(2, size=400)]
    rgb = np.clip(shades + rng.integers(-12, 13, (400, 3)), 0, 255)
    alpha = np.where(np.arange(400) < 40, 100, 255)
    mesh = colored(np.column_stack([rgb, alpha]))
    found = pieces(mesh, "material", 16)
    assert len({piece.rgba[:3] for piece in found}) <= 16
    assert sum(len(p.faces) for p in found if p.rgba[3] < 255) == 40
    assert sum(len(p.faces) for p in found) == 400
    lookup = {face: piece.rgba for piece in found for face in faces_of(mesh, piece)}
    drawn = np.array([lookup[tuple(map(tuple, mesh.vertices[f]))][:3] for f in mesh.faces])
    assert np.abs(drawn - rgb).max() < 40


def test_pieces_by_part():
    parts = np.array([0, 1, 1, 255], np.uint8)
    mesh = colored(np.full((4, 4), 255), parts)
    found = {piece.rgba: len(piece.faces) for piece in pieces(mesh, "parts", 16)}
    colors = [tuple(c) for c in part_colors(np.array([0, 1, 255], np.uint8)).tolist()]
    assert found == dict(zip(colors, (1, 2, 1), strict=True))


def test_bars_are_the_weights_best_first_and_the_one_shown_stands_out(session):
    session.template = int(session.reconstruction.ranking[1])
    bars = re.findall(r'title="([^"]*)".*?height:([\d.]+)%;background:(#\w+)', weight_bars(session))
    weights = np.sort(session.reconstruction.weights)[::-1]
    heights = np.array([float(height) for _, height, _ in bars])
    np.testing.assert_allclose(heights, np.maximum(100 * weights / weights[0], 2), atol=0.06)
    colors = [color for _, _, color in bars]
    assert colors[1] != colors[0] == colors[2]
    assert [title.split(":")[0] for title, _, _ in bars] == [
        session.reconstruction.bank.ids[t] for t in session.reconstruction.ranking
    ]


def test_the_legend_names_the_parts_of_the_template_that_is_shown(session):
    parts = np.unique(session.template_surface().face_parts)
    colors = part_colors(parts)[:, :3].tolist()
    entries = re.findall(r"rgb\((\d+),(\d+),(\d+)\)[^/]*/span> (\w+)", part_legend(session))
    names = [session.reconstruction.part_names[part] for part in parts]
    assert [(list(map(int, rgb)), name) for *rgb, name in entries] == list(
        zip(colors, names, strict=True)
    )


# --- the page ------------------------------------------------------------------------------------


class Visitor:
    """A browser's place in viser, played by the server itself: what is sent can be looked at."""

    def __init__(self, server):
        self.gui, self.scene = server.gui, server.scene
        self.camera = SimpleNamespace(aspect=1.6, on_update=lambda callback: callback)
        self.atomic = contextlib.nullcontext
        self.said, self.files = [], {}

    def add_notification(self, title, body, **_):
        self.said.append(body)

    def send_file_download(self, name, content, **_):
        self.files[name] = content


@pytest.fixture(scope="module")
def server(studio):
    pytest.importorskip("viser")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    server = start(studio, port)
    yield server
    server.stop()


@pytest.fixture
def page(server, studio):
    server.gui.reset()
    server.scene.reset()
    page = Page(Visitor(server), studio)
    wait_for(lambda: page._session is not None and page._scores.content)
    yield page
    page.close()


def wait_for(condition):
    end = time.monotonic() + 120  # only ends a test that would hang
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.01)


def upload(page, name, content):
    page._on_upload(SimpleNamespace(target=SimpleNamespace(value=SimpleNamespace(
        name=name, content=content))))  # fmt: skip


def drawn_vertices(page):
    (first, *rest) = page._stage._moving
    return np.concatenate([node.vertices for node, _ in (first, *rest)])


def test_the_slider_moves_what_is_drawn(page):
    before = drawn_vertices(page)
    page._amount.value = 0.0
    wait_for(lambda: not np.allclose(drawn_vertices(page), before, atol=1e-3))
    resting = page._session.template_surface().vertices
    expected = np.concatenate([resting[piece.vertices] for _, piece in page._stage._moving])
    wait_for(lambda: np.allclose(drawn_vertices(page), expected, atol=1e-5))
    page._on_reset(None)
    wait_for(lambda: np.allclose(drawn_vertices(page), before))
    assert page._amount.value == 1


def test_overlaid_shapes_stand_in_one_place_and_are_seen_through(page):
    def frames():
        return [page._stage._nodes[name] for name in ("template", "truth")]

    # To the right in images from azimuth 45 is where x and z alike become less.
    x, _, z = frames()[0].position - frames()[1].position
    assert x == pytest.approx(z)
    assert x > 1.4
    earlier = {frame.name for frame in frames()}
    page._layout.value = "overlaid"
    wait_for(lambda: not earlier & set(page._client.scene._handle_from_node_name))
    np.testing.assert_array_equal([frame.position for frame in frames()], np.zeros((2, 3)))
    nodes = page._client.scene._handle_from_node_name
    (ghost,) = (node for name, node in nodes.items() if re.search("/truth/mesh/.*/0$", name))
    assert 0 < ghost.opacity < 1
    np.testing.assert_allclose(ghost.vertices, page._session.truth.mesh.vertices, atol=1e-6)


def test_a_pulled_point_bends_the_mesh_at_once(page):
    before = drawn_vertices(page)
    place = page._session.control_points[63] + 0.2
    page._stage._picked = 63
    page._stage._pulls[63] = place
    page._wanted.set()
    wait_for(lambda: page._session.edited[63])
    np.testing.assert_allclose(page._session.control_points[63], place, atol=1e-6)
    wait_for(lambda: not np.allclose(drawn_vertices(page), before, atol=1e-3))


def test_templates_and_shapes_are_chosen_by_hand(page, studio):
    second = page._template.options[1]
    page._template.value = second
    bank = page._session.reconstruction.bank
    wait_for(lambda: bank.ids[page._session.template] in second)
    page._on_step(SimpleNamespace(target=SimpleNamespace(value="next")))
    wait_for(lambda: page._session.truth.shape_id == studio.shape_ids[1])
    wait_for(lambda: page._template.value.startswith("1. "))
    assert page._session.template == page._session.reconstruction.index


def test_a_photo_is_reconstructed_and_has_no_truth(page, studio, tmp_path):
    image = Image.fromarray(page._session.reconstruction.photo.image[..., :3]).resize((400, 300))
    image.save(tmp_path / "a.png")
    upload(page, "../a.png", (tmp_path / "a.png").read_bytes())
    wait_for(lambda: page._session.truth is None)
    wait_for(lambda: page._scores.content.startswith("Of a photo"))
    assert not page._boxes["truth"].visible
    assert not page._client.said
    page._on_step(SimpleNamespace(target=SimpleNamespace(value="next")))
    wait_for(lambda: page._session.truth is not None)
    wait_for(lambda: page._boxes["truth"].visible)


def test_a_bad_photo_is_said_and_nothing_breaks(page):
    shown = page._session
    upload(page, "letter.png", b"Dear Sir")
    wait_for(lambda: page._client.said)
    assert "letter.png" in page._client.said[0]
    assert "/tmp" not in page._client.said[0]
    assert page._session is shown
    page._amount.value = 0.25
    wait_for(lambda: page._session.amount == 0.25)


def test_the_mesh_that_is_shown_can_be_saved(page):
    page._amount.value = 0.5
    wait_for(lambda: page._session.amount == 0.5)
    page._on_save(None)
    (name,), (content,) = page._client.files, page._client.files.values()
    shown = page._session.shown()
    assert name == f"{shown.template_id}.glb"
    mesh = trimesh.load(trimesh.util.wrap_as_stream(content), file_type="glb")
    np.testing.assert_allclose(mesh.bounds, shown.mesh.bounds, atol=1e-5)


def test_the_caption_says_what_was_done_and_what_to_beware_of(session):
    photo = replace(session.reconstruction.photo, steps=("cut out", "scaled"), warnings=("odd",))
    assert "cut out; scaled" in caption(photo)
    assert "**Beware:** odd" in caption(photo)


# --- the server and the command ------------------------------------------------------------------


def test_the_server_answers_this_machine_and_stops(studio):
    pytest.importorskip("viser")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    server = start(studio, port)
    try:
        assert server.get_host() == "127.0.0.1"
        address = f"http://127.0.0.1:{server.get_port()}"
        with urllib.request.urlopen(address, timeout=120) as answer:
            assert answer.status == 200
            assert b"<html" in answer.read().lower()
    finally:
        server.stop()
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(address, timeout=120)


def test_without_viser_one_sentence_says_how_to_get_it(studio, monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(ConfigError, match="needs viser: pip install"):
        start(studio)
    with pytest.raises(ConfigError, match="needs viser: pip install"):
        view.main(view.Settings(run="/no/such/run"))


def test_a_checkpoint_alone_takes_photos_only(checkpoint, tiny_run, tmp_path):
    alone = open_studio(view.Settings(run=str(checkpoint)))
    assert (alone.shape_ids, "photo" in alone.note) == ((), True)
    settings = view.Settings(run=str(tiny_run.path), data_root=str(tmp_path / "elsewhere"))
    moved = open_studio(settings)
    assert moved.shape_ids == ()
    assert "elsewhere" in moved.note
    assert "data_root=DIR" in moved.note
    assert not (tmp_path / "elsewhere").exists(), "nothing is prepared for looking"


def test_a_page_without_shapes_waits_for_a_photo(checkpoint, server, studio, tmp_path):
    server.gui.reset()
    alone = Studio(studio._predictor, "tables", RenderSettings(), note="photos only")
    page = Page(Visitor(server), alone)
    try:
        image = studio.open_shape(studio.shape_ids[0]).reconstruction.photo.image
        Image.fromarray(image).save(tmp_path / "a.png")
        assert not page._parts[0].visible
        upload(page, "a.png", (tmp_path / "a.png").read_bytes())
        wait_for(lambda: page._session is not None and page._parts[0].visible)
    finally:
        page.close()


def test_another_category_can_be_looked_at(joint_checkpoint, studio, server, tmp_path):
    photo = studio.open_shape(studio.shape_ids[0]).reconstruction.photo.image
    Image.fromarray(photo).save(tmp_path / "a.png")
    server.gui.reset()
    joint = open_studio(view.Settings(run=str(joint_checkpoint)))
    page = Page(Visitor(server), joint)
    try:
        upload(page, "a.png", (tmp_path / "a.png").read_bytes())
        wait_for(lambda: page._scores.content)
        assert page._category.visible
        assert [line.split(" (")[0] for line in page._category.options] == ["table", "sofa"]
        assert all("table/" in line for line in page._template.options)
        page._category.value = page._category.options[1]
        wait_for(lambda: "sofa/" in page._template.value)
        wait_for(lambda: "table/" not in page._bars.content)
        assert len(page._template.options) == 2
        assert page._session.shown().template_id.startswith("sofa/")
        page._on_save(None)
        assert all("/" not in name for name in page._client.files)
    finally:
        page.close()


@pytest.mark.usefixtures("shipped")
def test_without_a_run_the_model_that_comes_with_the_package_is_shown():
    alone = open_studio(view.Settings())
    assert (alone.shape_ids, "sofa, table" in alone.title) == ((), True)
    assert "photo" in alone.note


def test_settings_are_read_and_mistakes_are_named(capsys):
    settings = read_settings(view.Settings, ["runs/a", "port=9000"], view.MAIN)
    assert (settings.run, settings.port, settings.data_root) == ("runs/a", 9000, None)
    for arguments, words in (
        (["run=007"], "there is no run 007"),
        (["run=a", "port=0"], "between 1 and 65535"),
        (["run=a", "port=abc"], "port=abc cannot be used"),
        (["run=a", "prt=9000"], "Did you mean port?"),
        (["run=/no/such/run"], "there is no run"),
    ):
        with pytest.raises(ConfigError, match=re.escape(words)):
            view.main(read_settings(view.Settings, arguments, view.MAIN))
    run_command("view", ["--help"])
    assert "data_root=" in capsys.readouterr().out
