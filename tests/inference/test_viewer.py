import asyncio
import contextlib
import io
import socket
import urllib.request
from types import SimpleNamespace

import numpy as np
import pytest
import torch
import trimesh
from commands import wait_for
from PIL import Image
from scipy.spatial.distance import cdist

from ffd_lightning.app.commands.view import Settings, open_shared
from ffd_lightning.geometry.ffd import Lattice, deformation_matrix
from ffd_lightning.imaging.grid import png
from ffd_lightning.inference.viewer.page import Page
from ffd_lightning.inference.viewer.server import start
from ffd_lightning.inference.viewer.shared import Photo, Shared
from ffd_lightning.inference.viewer.state import State


@pytest.fixture(scope="module")
def shared(tiny_run, checkpoint):
    return open_shared(Settings(run=str(tiny_run.path), checkpoint=str(checkpoint)))


@pytest.fixture
def state(shared):
    return shared.open_shape(shared.shape_ids[0])


@pytest.mark.parametrize("amount", [0.0, 1.5])
def test_amount_and_edits_move_the_control_points_and_the_mesh_follows(state, amount):
    t, found = state.template, state.reconstruction
    edit = np.random.default_rng(0).normal(0, 0.1, (64, 3)).astype(np.float32)
    state.edits[t], state.amount = edit, amount
    resting, surface = state.template_surface().vertices, state.surface().vertices
    mesh = found.bank.meshes[t]
    lattice = Lattice.bounding(torch.from_numpy(mesh.used_vertices()).double())
    control = lattice.control_points().numpy() + amount * found.offsets[t] + edit
    np.testing.assert_allclose(state.control_points, control, atol=1e-5)
    matrix = deformation_matrix(torch.from_numpy(resting).double(), lattice).numpy()
    np.testing.assert_allclose(surface, matrix @ control, atol=1e-5)


def test_a_control_point_goes_where_it_is_put_and_takes_no_other_along(state):
    state.amount = 0.7
    before, shape = state.control_points.copy(), state.surface().vertices
    place = np.array([0.3, -0.2, 0.5])
    state.move(21, place)
    np.testing.assert_allclose(state.control_points[21], place, atol=1e-6)
    others = np.delete(np.arange(64), 21)
    np.testing.assert_array_equal(state.control_points[others], before[others])
    assert np.flatnonzero(state.edited).tolist() == [21]
    assert np.abs(state.surface().vertices - shape).max() > 0.01


def test_edits_belong_to_their_template_and_reset_takes_them_back(state):
    first = state.template
    predicted = state.control_points.copy()
    state.move(3, np.zeros(3))
    state.template = int(state.reconstruction.ranking[1])
    assert not state.edited.any()
    state.reset()
    state.template = first
    assert state.edited.any(), "another template's reset"
    state.amount = 0.2
    state.reset()
    assert state.amount == 1
    np.testing.assert_array_equal(state.control_points, predicted)


def test_scores_are_chamfer_distances_of_what_is_shown(shared, state):
    found, t = state.reconstruction, state.template
    prepared = shared._shapes.prepared
    truth = prepared.cloud(prepared.index(state.name))[:1024]
    state.amount = 0.5
    state.move(0, np.array([-1.0, -1, -1]))

    def distance(points):
        table = cdist(points[:1024], truth) ** 2
        return table.min(axis=1).mean() + table.min(axis=0).mean()

    bank = found.bank
    matrix, rest = bank.deformation_matrix[t].numpy(), bank.control_points[t].numpy()
    expected = {
        "drawn": distance(matrix @ state.control_points),
        "predicted": distance(matrix @ (rest + found.offsets[t])),
        "undeformed": distance(bank.points[t].numpy()),
    }
    assert state.scores() == pytest.approx(expected, rel=1e-4)
    assert len(set(expected.values())) == 3
    assert State(found, state.display).scores() == {}


def test_the_result_is_what_is_drawn_at_full_resolution(state):
    state.template = int(state.reconstruction.ranking[2])
    state.amount = 0.3
    state.move(40, np.array([0.5, 0.5, 0.5]))
    before = state.reconstruction.offsets.copy()
    result = state.result()
    bank = state.reconstruction.bank
    assert result.template_id == bank.ids[state.template]
    expected = bank.deformed_mesh(state.template, torch.from_numpy(state.offsets))
    np.testing.assert_array_equal(result.surface.vertices, expected.vertices)
    assert len(result.surface.faces) > len(state.surface().faces)
    np.testing.assert_array_equal(state.reconstruction.offsets, before)


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
def server(shared):
    pytest.importorskip("viser")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    server = start(shared, port)
    yield server
    server.stop()


@pytest.fixture
def open_page(server):
    """Return a function from what is shared to a visitor's page, that is up to date."""
    pages = []

    def make(shared):
        server.gui.reset()
        server.scene.reset()
        pages.append(Page(Visitor(server), shared))
        if shared.shape_ids or shared.photo:
            wait_for(lambda: pages[-1].scores.content)
        return pages[-1]

    yield make
    for page in pages:
        page.close()


@pytest.fixture
def page(open_page, shared):
    return open_page(shared)


@pytest.fixture
def photo(shared):
    """A photograph's name and content: a test image, larger, on white."""
    image = shared.open_shape(shared.shape_ids[0]).reconstruction.photo.image[..., :3]
    return "../a.png", png(Image.fromarray(image).resize((400, 300)))


def mask_of(content, size=None):
    """The mask of a photograph on white as PNG, with the left half of its object alone."""
    grey = np.asarray(Image.open(io.BytesIO(content)).convert("L"))
    mask = np.where(grey < 250, np.uint8(255), np.uint8(0))
    mask[:, mask.shape[1] // 2 :] = 0
    return png(Image.fromarray(mask).resize(size or mask.shape[::-1]))


def clicked(value):
    return SimpleNamespace(target=SimpleNamespace(value=value))


def sent(name, content):
    return clicked(SimpleNamespace(name=name, content=content))


def drawn_vertices(page):
    return np.concatenate([node.vertices for node, _ in page.scene.moving])


def test_the_slider_moves_what_is_drawn(page):
    before = drawn_vertices(page)
    page.amount.value = 0.0
    wait_for(lambda: not np.allclose(drawn_vertices(page), before, atol=1e-3))
    resting = page.state.template_surface().vertices
    expected = np.concatenate([resting[piece.vertices] for _, piece in page.scene.moving])
    wait_for(lambda: np.allclose(drawn_vertices(page), expected, atol=1e-5))
    page._on_reset(None)
    wait_for(lambda: np.allclose(drawn_vertices(page), before))
    assert page.amount.value == 1


def test_a_pulled_point_bends_the_mesh_and_lands_under_the_pointer(page, photo):
    """The pointer is in the scene's coordinates; a photo's reconstruction stands elsewhere."""
    page._on_photo(sent(*photo))
    wait_for(lambda: page.state.truth is None and page.scene.drawn[0] is page.state)
    state, before = page.state, drawn_vertices(page)
    offset = np.asarray(page.scene.nodes["reconstruction"].position)
    assert np.linalg.norm(offset) > 0.5
    place = state.control_points[63] + 0.2
    (drag,) = page.scene._lattice[1]._impl.drag_cb
    event = SimpleNamespace(instance_index=63, end_position=tuple(place + offset))
    asyncio.run(drag.callback(event))
    wait_for(lambda: state.edited[63])
    np.testing.assert_allclose(state.control_points[63], place, atol=1e-5)
    wait_for(lambda: not np.allclose(drawn_vertices(page), before, atol=1e-3))


def test_templates_and_shapes_are_chosen_by_hand(page, shared):
    found = page.state.reconstruction
    page.template.value = page.template.options[1]
    wait_for(lambda: page.state.template == found.ranking[1])
    picture = shared.picture(int(found.ranking[1]))
    wait_for(lambda: np.array_equal(page.picture.image, picture))
    page._on_step(clicked("next"))
    wait_for(lambda: page.state.name == shared.shape_ids[1])
    assert page.state.template == page.state.reconstruction.index
    page._on_step(clicked("random"))
    wait_for(lambda: page.state.name != shared.shape_ids[1])


def test_what_belonged_to_the_last_input_is_forgotten(page, photo):
    """Pulled points, the slider, the chosen template and scores."""
    page.template.value = page.template.options[2]
    page.amount.value = 0.4
    wait_for(lambda: page.scene.drawn[1] == page.state.reconstruction.ranking[2])
    page.scene.pull(5, np.zeros(3))
    wait_for(lambda: page.state.edited.any())
    page._on_photo(sent(*photo))
    wait_for(lambda: page.scores.content.startswith("A photo"))
    state = page.state
    assert (page.amount.value, state.amount) == (1, 1)
    assert state.template == state.reconstruction.index
    assert page.template.value == page.template.options[0]
    assert not state.edits.any()
    page.back.value = True
    wait_for(lambda: page.state.truth is not None)
    assert page.state.name == page.shape.value
    assert not page.back.visible


def test_a_mask_says_what_the_object_is(page, photo):
    assert not page.masking.visible, "a test shape needs none"
    page._on_photo(sent(*photo))
    wait_for(lambda: page.masking.visible and page.state.truth is None)
    whole = page.state.reconstruction.photo
    page._on_mask(sent("mask.png", mask_of(photo[1])))
    wait_for(lambda: "background: mask" in page.input.content)
    wait_for(lambda: page.state.reconstruction.photo is not whole)
    half = page.state.reconstruction.photo
    box = [np.ptp(np.flatnonzero((p.image[..., 3] > 127).any(axis=0))) for p in (whole, half)]
    assert box[1] < 0.8 * box[0]
    page._on_photo(sent("b.png", photo[1]))
    wait_for(lambda: page.state.name == "b")
    np.testing.assert_array_equal(page.state.reconstruction.photo.image, whole.image)


def test_a_box_says_what_the_object_is(page, photo):
    page._on_photo(sent(*photo))
    wait_for(lambda: page.masking.visible and page.state.truth is None)
    whole = page.state.reconstruction.photo
    page.box[0].value, page.box[1].value = (20, 50), (2, 98)
    wait_for(lambda: page.boxed.visible)
    red = (page.boxed.image == (213, 94, 0)).all(axis=2)
    assert np.flatnonzero(red.any(axis=0))[[0, -1]] == pytest.approx([64, 160], abs=2)
    page._ask_for(page._in_box())
    wait_for(lambda: page.state.reconstruction.photo is not whole)
    assert "GrabCut" in page.input.content


def test_what_cannot_be_used_is_said_and_another_mask_can_be_given(page, photo):
    shown = page.state
    page._on_photo(sent("letter.png", b"Dear Sir"))
    wait_for(lambda: any("letter.png is no picture" in said for said in page._client.said))
    page._on_photo(sent("white.png", png(Image.new("RGB", (40, 30), "white"))))
    wait_for(lambda: any(said.endswith("open a mask") for said in page._client.said))
    mask = np.zeros((30, 40), np.uint8)
    mask[10:20, 10:30] = 255
    for content, words in (
        (mask_of(photo[1], (80, 60)), "the mask has 80 x 60 pixels"),
        (page._photo.content, "the mask is the photograph itself, white.png"),
        (b"Dear Sir", "the mask is no picture"),
    ):
        page._on_mask(sent("mask.png", content))
        wait_for(lambda words=words: any(words in said for said in page._client.said))
        assert page.state is shown, "what was shown stays"
    page._on_mask(sent("mask.png", png(Image.fromarray(mask))))
    wait_for(lambda: page.state.name == "white")


def test_the_mesh_that_is_shown_can_be_saved_under_the_name_of_its_input(page, photo):
    page.amount.value = 0.5
    wait_for(lambda: page.state.amount == 0.5)
    page._on_save(None)
    (name,), (content,) = page._client.files, page._client.files.values()
    assert name == f"{page.state.name}.glb"
    mesh = trimesh.load(trimesh.util.wrap_as_stream(content), file_type="glb")
    np.testing.assert_allclose(mesh.bounds, page.state.result().mesh.bounds, atol=1e-5)
    page._on_photo(sent("../my chair (1).png", photo[1]))
    wait_for(lambda: page.state.truth is None)
    page._on_save(None)
    assert list(page._client.files)[1] == "my-chair-1-.glb"


def test_windows_have_a_state_each(open_page, page, shared):
    other = open_page(shared)
    other.amount.value = 0.2
    wait_for(lambda: other.state.amount == 0.2)
    assert page.state.amount == 1
    assert page.state is not other.state


# --- the server ----------------------------------------------------------------------------------


def test_the_server_answers_this_machine_alone(server):
    assert server.get_host() == "127.0.0.1"
    with urllib.request.urlopen(f"http://127.0.0.1:{server.get_port()}", timeout=120) as answer:
        assert b"<html" in answer.read().lower()


def test_a_page_can_begin_with_a_photo(open_page, shared, photo):
    first = Photo("a.png", photo[1], mask_of(photo[1]))
    page = open_page(Shared(shared._predictor, photo=first))
    assert page.state.name == "a"
    assert "background: mask" in page.input.content


def test_another_category_can_be_looked_at(open_page, joint_checkpoint, photo):
    page = open_page(open_shared(Settings(run=str(joint_checkpoint))))
    page._on_photo(sent(*photo))
    wait_for(lambda: page.scores.content)
    assert page.category.visible
    assert [line.split(" (")[0] for line in page.category.options] == ["table", "sofa"]
    page.category.value = page.category.options[1]
    wait_for(lambda: "sofa/" in page.template.value)
    assert not any("table/" in line for line in page.template.options)
    wait_for(lambda: page.state.result().template_id.startswith("sofa/"))
    page._on_photo(sent("b.png", photo[1]))
    wait_for(lambda: "table/" in page.template.value)
