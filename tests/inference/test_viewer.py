import asyncio
import base64
import contextlib
import io
import re
import socket
import sys
import time
import urllib.request
from dataclasses import replace
from math import comb
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch
import trimesh
from PIL import Image
from scipy.spatial.distance import cdist

from ffd_lightning.app.viewed_runs import open_studio
from ffd_lightning.errors import ConfigError
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging import cutting
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.imaging.rendering import render
from ffd_lightning.inference.pieces import pieces
from ffd_lightning.inference.viewer.page import Page
from ffd_lightning.inference.viewer.panel_text import (
    in_page,
    input_block,
    part_legend,
    score_table,
    template_pictures,
)
from ffd_lightning.inference.viewer.photo import File, Photo
from ffd_lightning.inference.viewer.scene import layout
from ffd_lightning.inference.viewer.session import NetworkTitle, Session, display_bank
from ffd_lightning.inference.viewer.studio import Studio, start
from ffd_lightning.inference.viewer.thumbnails import Thumbnails
from ffd_lightning.palette import REGIME_COLORS, part_colors


@pytest.fixture(scope="module")
def studio(tiny_run, checkpoint):
    return open_studio([tiny_run.path], checkpoint)


@pytest.fixture(scope="module")
def pair(tiny_run, second_run):
    return open_studio([tiny_run.path, second_run.path])


@pytest.fixture
def session(studio):
    (session,) = studio.open_shape(studio.shape_ids[0])
    return session


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


def test_templates_are_listed_by_weight_with_their_pictures(session):
    session.template = int(session.reconstruction.ranking[1])
    listed = template_pictures(session, lambda t: f"picture-{t}", 2)
    cells = re.findall(
        r'title="([^:]*): .*?data-rank="(\d+)".*?solid (#?\w+)"><img src="picture-(\d+)".*?'
        r"width:([\d.]+)%;background:(#\w+)",
        listed,
    )
    ids, ranks, frames, pictures, widths, colors = zip(*cells, strict=True)
    found = session.reconstruction
    order = sorted(range(len(found.weights)), key=lambda t: -found.weights[t])
    assert list(map(int, pictures)) == order
    assert list(ids) == [found.bank.ids[t] for t in order]
    assert list(ranks) == ["1", "2", "3", "4"], "buttons of these names are clicked"
    share = 100 * found.weights[order] / found.weights[order[0]]
    np.testing.assert_allclose(np.array(widths, float), np.maximum(share, 3), atol=0.06)
    assert set(colors) == {session.title.color}
    assert list(frames) == ["transparent", session.title.color, *["transparent"] * 2]


def test_thumbnails_show_the_templates(studio, session):
    bank = session.reconstruction.bank
    pictures = Thumbnails(bank, studio.camera)
    for t in range(len(bank)):
        content = base64.b64decode(pictures[t].removeprefix("data:image/png;base64,"))
        picture = np.asarray(Image.open(io.BytesIO(content)))
        expected = render(bank.meshes[t], studio.camera, height=72, width=96, samples=2)
        np.testing.assert_array_equal(picture, expected)
    assert pictures[0] != pictures[1]


def test_scores_are_shown_times_a_thousand_under_their_one_name():
    titles = [NetworkTitle("b, base"), NetworkTitle("r, regularized")]
    table = score_table(titles, [{"shown": 0.00112}, {"shown": 0.0025}])
    assert "| box Chamfer x 1000 | b, base | r, regularized |" in table
    assert "| shown | 1.12 | 2.50 |" in table
    assert "| box Chamfer | x 1000 |" in score_table(titles[:1], [{"shown": 0.001}])
    assert "box Chamfer" not in score_table(titles, [{}, {}])


@pytest.mark.parametrize("networks", [1, 2])
@pytest.mark.parametrize("truth", [True, False])
def test_shapes_that_stand_side_by_side_do_not_touch(networks, truth):
    spots = layout(networks, truth, beside=True)
    places = np.array([*spots.templates, *spots.shown, *spots.truths])
    assert len(places) == 2 * networks + truth
    apart = cdist(places, places)[np.triu_indices(len(places), 1)]
    assert apart.min() >= 1, "a shape has a diagonal of 1"
    np.testing.assert_allclose(np.array(spots.shown)[:, 1], spots.shown[0][1])
    over = layout(networks, truth, beside=False)
    assert over.templates == over.shown
    assert over.truths == (over.shown if truth else ())


def test_the_legend_names_the_parts_of_the_template_that_is_shown(session):
    parts = np.unique(session.template_surface().face_parts)
    colors = part_colors(parts)[:, :3].tolist()
    entries = re.findall(r"rgb\((\d+),(\d+),(\d+)\)[^/]*/span> (\w+)", part_legend([session]))
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
        return SimpleNamespace(remove=lambda: self.said.remove(body))

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
def open_page(server):
    """Return a function from what is shared to a visitor's page, that is up to date."""
    pages = []

    def make(library):
        server.gui.reset()
        server.scene.reset()
        pages.append(Page(Visitor(server), library))
        if library.shape_ids or library.photo:
            wait_for(lambda: pages[-1].panel.scores.content)
        return pages[-1]

    yield make
    for page in pages:
        page.close()


@pytest.fixture
def page(open_page, studio):
    return open_page(studio)


@pytest.fixture
def photo(studio, tmp_path):
    """A photograph's name and content: a test image, larger, on white."""
    image = studio.open_shape(studio.shape_ids[0])[0].reconstruction.photo.image[..., :3]
    Image.fromarray(image).resize((400, 300)).save(tmp_path / "a.png")
    return "../a.png", (tmp_path / "a.png").read_bytes()


def wait_for(condition):
    end = time.monotonic() + 120  # only ends a test that would hang
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.01)


def sent(name, content):
    return SimpleNamespace(
        target=SimpleNamespace(value=SimpleNamespace(name=name, content=content))
    )


def clicked(value):
    return SimpleNamespace(target=SimpleNamespace(value=value))


def drawn_vertices(page, network=0):
    (first, *rest) = page.stage.exhibits[network].moving
    return np.concatenate([node.vertices for node, _ in (first, *rest)])


def nodes_of(page):
    return page.stage.drawing.nodes


def test_the_slider_moves_what_is_drawn(page):
    (session,) = page.sessions
    before = drawn_vertices(page)
    page.panel.amount.value = 0.0
    wait_for(lambda: not np.allclose(drawn_vertices(page), before, atol=1e-3))
    resting = session.template_surface().vertices
    moving = page.stage.exhibits[0].moving
    expected = np.concatenate([resting[piece.vertices] for _, piece in moving])
    wait_for(lambda: np.allclose(drawn_vertices(page), expected, atol=1e-5))
    page._on_reset(None)
    wait_for(lambda: np.allclose(drawn_vertices(page), before))
    assert page.panel.amount.value == 1


def test_overlaid_shapes_stand_in_one_place_and_are_seen_through(page):
    def frames():
        return [nodes_of(page)[name] for name in ("template-0", "truth-0")]

    # To the right in images from azimuth 45 is where x and z alike become less.
    x, _, z = frames()[0].position - frames()[1].position
    assert x == pytest.approx(z)
    assert x > 1.4
    earlier = {frame.name for frame in frames()}
    page.panel.layout.value = "overlaid"
    wait_for(lambda: not earlier & set(page._client.scene._handle_from_node_name))
    np.testing.assert_array_equal([frame.position for frame in frames()], np.zeros((2, 3)))
    nodes = page._client.scene._handle_from_node_name
    (ghost,) = (node for name, node in nodes.items() if re.search("/truth-0/mesh/.*/0$", name))
    assert 0 < ghost.opacity < 1
    np.testing.assert_allclose(ghost.vertices, page.sessions[0].truth.mesh.vertices, atol=1e-6)


def test_a_pulled_point_bends_the_mesh_at_once(page):
    (session,) = page.sessions
    before = drawn_vertices(page)
    place = session.control_points[63] + 0.2
    page.stage.exhibits[0].pull(63, place)
    wait_for(lambda: session.edited[63])
    np.testing.assert_allclose(session.control_points[63], place, atol=1e-6)
    wait_for(lambda: not np.allclose(drawn_vertices(page), before, atol=1e-3))


def test_templates_and_shapes_are_chosen_by_hand(page, studio):
    found = page.sessions[0].reconstruction
    page.panel.lists[0].choose(1)
    wait_for(lambda: page.sessions[0].template == found.ranking[1])
    wait_for(lambda: found.bank.ids[found.ranking[1]] in page.panel.lists[0].text.content)
    page._on_step(clicked("next"))
    wait_for(lambda: page.sessions[0].truth.shape_id == studio.shape_ids[1])
    wait_for(lambda: "Shown: 1 of 4" in page.panel.lists[0].text.content)
    assert page.sessions[0].template == page.sessions[0].reconstruction.index


def test_what_belonged_to_the_last_input_is_forgotten(page, photo):
    """Pulled points, the slider, the chosen template, what did not work, the mask and scores."""
    panel = page.panel
    panel.lists[0].choose(2)
    panel.amount.value = 0.4
    wait_for(lambda: "Shown: 3 of 4" in panel.lists[0].text.content)
    page.stage.exhibits[0].pull(5, np.zeros(3))
    page._on_photo(sent("letter.png", b"Dear Sir"))
    wait_for(lambda: page._client.said and page.sessions[0].edited.any())
    page._on_photo(sent(*photo))
    wait_for(lambda: "Shown: 1 of 4" in panel.lists[0].text.content and not page._client.said)
    (session,) = page.sessions
    assert (panel.amount.value, session.amount) == (1, 1)
    assert session.template == session.reconstruction.index
    assert not session.edits.any()
    assert page.stage.exhibits[0].picked is None
    assert "Dear" not in panel.input.content
    page._on_mask(sent("m.png", mask_of(photo[1])))
    wait_for(lambda: panel.unmask.visible)
    page._on_photo(sent("b.png", photo[1]))
    wait_for(lambda: not panel.unmask.visible)
    assert "background: mask" not in panel.input.content


def mask_of(content, size=None):
    """A photograph on white's mask as PNG, with the left half of its object alone."""
    grey = np.asarray(Image.open(io.BytesIO(content)).convert("L"))
    mask = np.where(grey < 250, np.uint8(255), np.uint8(0))
    mask[:, mask.shape[1] // 2 :] = 0
    buffer = io.BytesIO()
    Image.fromarray(mask).resize(size or mask.shape[::-1]).save(buffer, "PNG")
    return buffer.getvalue()


def test_a_photo_is_reconstructed_and_has_no_truth(page, photo):
    panel, shown = page.panel, page.sessions[0].truth.shape_id
    page._on_photo(sent(*photo))
    wait_for(lambda: page.sessions[0].truth is None)
    wait_for(lambda: panel.scores.content.startswith("A photo"))
    assert not panel.boxes["truth"].visible
    assert panel.back.visible
    assert not page._client.said
    page._on_shape(None)
    wait_for(lambda: page.sessions[0].truth is not None)
    wait_for(lambda: panel.boxes["truth"].visible and not panel.back.visible)
    assert page.sessions[0].truth.shape_id == shown


def test_a_mask_says_what_the_object_is_and_can_be_taken_away(page, photo):
    panel = page.panel
    assert not panel._masking.visible, "a test shape needs none"
    page._on_photo(sent(*photo))
    wait_for(lambda: panel._masking.visible)
    wait_for(lambda: page.sessions[0].truth is None)
    whole = page.sessions[0].reconstruction.photo
    page._on_mask(sent("a.png", mask_of(photo[1])))
    wait_for(lambda: "background: mask" in panel.input.content)
    half = page.sessions[0].reconstruction.photo
    box = [np.ptp(np.flatnonzero((p.image[..., 3] > 127).any(axis=0))) for p in (whole, half)]
    assert box[1] < 0.8 * box[0]
    page._open_photo_with(None)
    wait_for(lambda: "background: mask" not in panel.input.content)
    np.testing.assert_array_equal(page.sessions[0].reconstruction.photo.image, whole.image)


def test_a_mask_that_cannot_be_used_is_said_and_another_can_be_given(page, photo):
    page._on_photo(sent(*photo))
    wait_for(lambda: page.sessions[0].truth is None)
    (shown,) = page.sessions
    black = io.BytesIO()
    Image.new("L", (400, 300)).save(black, "PNG")
    for content, words in (
        (mask_of(photo[1], (80, 60)), "the mask has 80 x 60 pixels, a.png 400 x 300"),
        (black.getvalue(), "the mask of a.png is empty"),
        (photo[1], "the mask is the photograph itself, a.png"),
        (b"Dear Sir", "m.png is no picture"),
    ):
        page._on_mask(sent("m.png", content))
        wait_for(lambda words=words: any(words in said for said in page._client.said))
        assert "/tmp" not in page._client.said[0]
        assert page.sessions == (shown,)
    page._on_mask(sent("m.png", mask_of(photo[1])))
    wait_for(lambda: page.sessions != (shown,))
    wait_for(lambda: not page._client.said)


def test_a_photo_without_an_object_waits_for_a_mask(page):
    buffer = io.BytesIO()
    Image.new("RGB", (40, 30), "white").save(buffer, "PNG")
    (shown,) = page.sessions
    page._on_photo(sent("white.png", buffer.getvalue()))
    wait_for(lambda: page._client.said)
    assert page._client.said[0].endswith("open a mask")
    assert page.sessions == (shown,)
    wait_for(lambda: page.panel._masking.visible)
    mask = np.zeros((30, 40), np.uint8)
    mask[10:20, 10:30] = 255
    buffer = io.BytesIO()
    Image.fromarray(mask).save(buffer, "PNG")
    page._on_mask(sent("m.png", buffer.getvalue()))
    wait_for(lambda: page.sessions[0].name == "white")


def test_a_bad_photo_is_said_and_nothing_breaks(page):
    shown = page.sessions
    page._on_photo(sent("letter.png", b"Dear Sir"))
    wait_for(lambda: page._client.said)
    assert "letter.png" in page._client.said[0]
    assert "/tmp" not in page._client.said[0]
    assert page.sessions is shown
    page.panel.amount.value = 0.25
    wait_for(lambda: page.sessions[0].amount == 0.25)
    assert page.sessions is shown


def test_the_mesh_that_is_shown_can_be_saved_under_the_name_of_its_input(page, photo):
    page.panel.amount.value = 0.5
    wait_for(lambda: page.sessions[0].amount == 0.5)
    page._on_save(None)
    (name,), (content,) = page._client.files, page._client.files.values()
    (session,) = page.sessions
    assert name == f"{session.truth.shape_id}.glb"
    mesh = trimesh.load(trimesh.util.wrap_as_stream(content), file_type="glb")
    np.testing.assert_allclose(mesh.bounds, session.shown().mesh.bounds, atol=1e-5)
    page._on_photo(sent("my chair (1).png", photo[1]))
    wait_for(lambda: page.sessions[0].truth is None)
    page._on_save(None)
    assert list(page._client.files)[1] == "my-chair-1-.glb"


def test_two_networks_stand_side_by_side_and_see_the_same(open_page, pair, photo):
    page = open_page(pair)
    one, other = page.sessions
    assert [session.title.text for session in page.sessions] == ["r, regularized", "b, base"]
    assert one.title.color == REGIME_COLORS["r"]
    assert other.title.color == REGIME_COLORS["b"]
    np.testing.assert_array_equal(one.reconstruction.photo.image, other.reconstruction.photo.image)
    assert one.template != other.template
    nodes = nodes_of(page)
    for k, session in enumerate(page.sessions):
        assert nodes[f"shown-{k}/label"].text == (
            f"{session.title.text} (box Chamfer x 1000: {1000 * session.scores()['shown']:.2f})"
        )
        assert nodes[f"template-{k}/label"].text == f"template of {session.title.text}"
    page._on_photo(sent(*photo))
    wait_for(lambda: page.sessions[0].truth is None)
    page._on_save(None)
    assert list(page._client.files) == ["a-r-regularized.glb", "a-b-base.glb"]


def test_what_is_done_to_one_of_two_networks_is_not_done_to_the_other(open_page, pair):
    page = open_page(pair)
    one, other = page.sessions
    before = one.template, drawn_vertices(page).copy()
    page.panel.lists[1].choose(1)
    wait_for(lambda: "Shown: 2 of 4" in page.panel.lists[1].text.content)
    page.stage.exhibits[1].pull(3, other.control_points[3] + 0.3)
    wait_for(lambda: other.edited[3])
    assert one.template == before[0]
    assert not one.edits.any()
    np.testing.assert_allclose(drawn_vertices(page), before[1], atol=1e-6)


def test_a_point_that_is_dragged_lands_under_the_pointer(open_page, pair):
    """The pointer is in the scene's coordinates, in which the second shape stands elsewhere."""
    page = open_page(pair)
    exhibit, session = page.stage.exhibits[1], page.sessions[1]
    offset = nodes_of(page)["shown-1"].position
    assert np.linalg.norm(offset) > 0.5
    place = session.control_points[7] + 0.1
    event = SimpleNamespace(instance_index=7, end_position=tuple(place + offset))
    asyncio.run(exhibit._on_drag(event))
    wait_for(lambda: session.edited[7])
    np.testing.assert_allclose(session.control_points[7], place, atol=1e-5)


def test_windows_have_a_state_each(open_page, page, studio):
    other = open_page(studio)
    other.panel.amount.value = 0.2
    wait_for(lambda: other.sessions[0].amount == 0.2)
    assert page.sessions[0].amount == 1
    assert page.sessions[0] is not other.sessions[0]


def test_the_page_says_what_was_done_and_what_to_beware_of(session):
    warnings = ("check the result, or give mask=...",)
    photo = replace(session.reconstruction.photo, steps=("cut <out>", "scaled"), warnings=warnings)
    assert "cut &lt;out&gt;; scaled" in input_block(photo)
    assert "<b>Beware:</b> check the result, or open a mask" in input_block(photo)


def test_no_message_asks_for_a_setting_that_the_page_has_not():
    """What imaging says of a photograph names `mask=...` only as `in_page` knows it."""
    folder = Path(cutting.__file__).parent
    asked = [line for f in folder.glob("*.py") for line in f.read_text().splitlines()]
    asked = [line for line in asked if re.search(r"give .{0,9}mask", line)]
    assert len(asked) > 5
    for line in asked:
        assert "mask=" not in in_page(line), line


# --- the server ----------------------------------------------------------------------------------


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


def test_a_page_without_shapes_waits_for_a_photo(open_page, studio, photo):
    alone = Studio(studio._predictors, studio.titles, RenderSettings(), note="photos only")
    page = open_page(alone)
    assert not page.panel.save.visible
    page._on_photo(sent(*photo))
    wait_for(lambda: page.sessions and page.panel.save.visible)


def test_a_page_can_begin_with_a_photo(open_page, studio, photo):
    first = Photo(File(*photo), File("m.png", mask_of(photo[1])))
    begun = Studio(studio._predictors, studio.titles, RenderSettings(), photo=first)
    page = open_page(begun)
    assert page.sessions[0].name == "a"
    assert "background: mask" in page.panel.input.content
    wait_for(lambda: page.panel.unmask.visible)


def test_another_category_can_be_looked_at(open_page, joint_checkpoint, photo):
    page = open_page(open_studio([joint_checkpoint]))
    (listed,) = page.panel.lists
    page._on_photo(sent(*photo))
    wait_for(lambda: page.panel.scores.content)
    assert listed.category.visible
    assert [line.split(" (")[0] for line in listed.category.options] == ["table", "sofa"]
    assert "table/" in listed.pictures.content
    listed.category.value = listed.category.options[1]
    wait_for(lambda: "sofa/" in listed.text.content)
    assert "table/" not in listed.pictures.content
    assert listed.ranks.options == ("1", "2")
    assert page.sessions[0].shown().template_id.startswith("sofa/")
    page._on_photo(sent("b.png", photo[1]))
    wait_for(lambda: "table/" in listed.text.content)
