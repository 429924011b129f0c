import shutil
from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh
from conftest import SOFAS, TABLES
from PIL import Image

from ffd_lightning.app.open_run import open_run
from ffd_lightning.checkpoint import load_model
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.samples import Sample, predict
from ffd_lightning.inference.predictor import Predictor, checkpoint_of

# What one network may differ by from itself: added up in another order, by other numbers of
# threads or images at a time, float32 was found to be off by 2e-5 after MobileNet's 28 layers.
ROUNDING = 2e-4


@pytest.fixture(scope="module")
def predictor(checkpoint):
    return Predictor.load(checkpoint)


@pytest.fixture(scope="module")
def image(tiny_run):
    data = open_run(tiny_run).data
    return data.prepared.image(int(data.rows(data.split.test)[0]))


@pytest.fixture(scope="module")
def reconstruction(predictor, image):
    return predictor.predict(image)


def test_a_checkpoint_alone_predicts_what_the_run_predicts(tiny_run, tmp_path, monkeypatch):
    run = open_run(tiny_run)
    row = int(run.data.rows(run.data.split.test)[0])
    expected = predict(run.network, run.data.prepared, [Sample(row)])
    shutil.copy(tiny_run.checkpoint, tmp_path / "given.ckpt")
    Image.fromarray(run.data.prepared.image(row)).save(tmp_path / "photo.png")

    def no_data(*_):
        raise AssertionError("the data set is not to be opened")

    monkeypatch.setattr(PreparedSet, "open", no_data)
    found = Predictor.load(tmp_path / "given.ckpt").predict(tmp_path / "photo.png")
    assert found.bank.ids == run.data.bank.ids
    np.testing.assert_allclose(found.weights, expected.weights[0], atol=ROUNDING)
    np.testing.assert_allclose(found.offsets, expected.offsets[0], atol=ROUNDING)


def test_meshes_are_subdivided_and_the_callers_own(reconstruction):
    mesh, template = reconstruction.mesh, reconstruction.template
    assert template.edges_unique_length.max() <= reconstruction.bank.max_edge + 1e-9
    kept = template.vertices.copy()
    template.vertices *= 2
    mesh.faces[:] = 0
    np.testing.assert_array_equal(reconstruction.template.vertices, kept)
    assert reconstruction.mesh.faces.any()


def test_points_lie_on_the_mesh_and_carry_its_labels(reconstruction):
    points, faces = reconstruction.sample(500, seed=3)
    corners = reconstruction.mesh.vertices[reconstruction.mesh.faces[faces]]
    shares = trimesh.triangles.points_to_barycentric(corners, points)
    assert shares.min() > -1e-3
    rebuilt = (shares[:, :, None] * corners).sum(axis=1)
    np.testing.assert_allclose(rebuilt, points, atol=1e-5)
    np.testing.assert_array_equal(reconstruction.cloud(500, seed=3), points)
    assert not np.array_equal(reconstruction.cloud(500), points)
    template, _ = reconstruction.bank.subdivided(reconstruction.index)
    np.testing.assert_array_equal(reconstruction.labels, template.face_parts)
    seen = {reconstruction.part_names[k] for k in reconstruction.labels[faces]}
    assert seen >= {"top", "leg"}


def test_outputs_that_are_not_finite_are_named(checkpoint, image):
    predictor = Predictor.load(checkpoint)
    with torch.no_grad():
        predictor.model.network.heads.logits.bias.fill_(float("nan"))
    with pytest.raises(DataError, match="not finite"):
        predictor.predict(image)


# --- what can be wrong ----------------------------------------------------------------------------


def test_sources_that_are_no_run_are_named(tiny_run, tmp_path):
    assert checkpoint_of(tiny_run.path) == tiny_run.checkpoint
    with pytest.raises(ConfigError, match="there is no run"):
        checkpoint_of(tmp_path / "none")
    with pytest.raises(ConfigError, match=r"no config.yaml: is .* meant\?"):
        checkpoint_of(tiny_run.path.parent)
    (tmp_path / "config.yaml").touch()
    with pytest.raises(ConfigError, match="no checkpoint yet"):
        checkpoint_of(tmp_path)
    with pytest.raises(ConfigError, match="device=tpu7 cannot be used"):
        Predictor.load(tiny_run.path, device="tpu7")


class Evil:
    def __reduce__(self):
        return exec, ("raise SystemExit('ran')",)


@pytest.mark.parametrize("kind", ["truncated", "text", "evil"])
def test_damaged_checkpoints_are_named_and_nothing_in_them_runs(checkpoint, tmp_path, kind):
    path = tmp_path / "bad.ckpt"
    if kind == "evil":
        torch.save({"state_dict": {}, "global_step": 1, "model": Evil()}, path)
    else:
        path.write_bytes(checkpoint.read_bytes()[:90_000] if kind == "truncated" else b"hello")
    with pytest.raises(DataError, match=r"bad.ckpt is damaged or no checkpoint"):
        load_model(path)


def test_checkpoints_of_other_versions_and_networks_are_named(checkpoint, tmp_path):
    content = torch.load(checkpoint, weights_only=True)

    def loaded(change):
        changed = {**content, "model": dict(content["model"]), "state_dict": {}}
        changed["state_dict"].update(content["state_dict"])
        change(changed)
        torch.save(changed, tmp_path / "other.ckpt")
        return load_model(tmp_path / "other.ckpt")

    for change, message in (
        (lambda c: c.pop("model"), r"holds no templates.*restart=true"),
        (lambda c: c["model"].update(render={"hight": 3}), "of another version"),
        (lambda c: c["model"].pop("object_fill"), "of another version"),
        (lambda c: c["model"].update(encoder=None), r"is no component.*put @component"),
        (lambda c: c["state_dict"].popitem(), "of another network"),
    ):
        with pytest.raises(ConfigError, match=message):
            loaded(change)
    kept = loaded(lambda c: None)
    assert kept.step == content["global_step"]
    assert kept.object_fill > 0.4


def test_where_images_came_with_the_data_no_side_is_known(checkpoint, tmp_path, image):
    state = torch.load(checkpoint, weights_only=True)
    assert Predictor.load(checkpoint).predict(image).viewpoint is not None
    state["model"]["own_images"] = True
    torch.save(state, tmp_path / "own.ckpt")
    predictor = Predictor.load(tmp_path / "own.ckpt")
    assert not predictor.knows_side
    assert predictor.predict(image).viewpoint is None


def test_a_checkpoint_names_no_folder_of_its_maker(checkpoint):
    model = load_model(checkpoint)
    settings = model.record["settings"]
    assert settings["templates.count"] == len(model.bank) == 4
    assert not [value for value in settings.values() if isinstance(value, str) and "/" in value]
    assert (model.record["run"], model.record["regime"]) == ("default/table/r/t4/seed0", "r")
    assert model.categories == ("table",)


# --- several categories ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def joint(joint_checkpoint):
    return Predictor.load(joint_checkpoint)


def test_the_category_that_weighs_most_together_or_is_named_is_selected_from(joint, image):
    guess, asked = joint.predict(image), joint.predict(image, category="sofa")
    assert guess.weights.argmax() in SOFAS, "the heaviest alone"
    sums = {"sofa": guess.weights[SOFAS].sum(), "table": guess.weights[TABLES].sum()}
    assert list(guess.category_weights) == ["table", "sofa"]
    assert guess.category_weights == pytest.approx(sums)
    assert sum(sums.values()) == pytest.approx(1)
    assert (guess.category, asked.category) == ("table", "sofa")
    assert guess.index == TABLES[guess.weights[TABLES].argmax()]
    assert guess.template_id.startswith("table/")
    assert asked.template_id.startswith("sofa/")
    assert asked.index == asked.weights.argmax()
    np.testing.assert_array_equal(asked.weights, guess.weights)
    assert asked.category_weights == guess.category_weights
    for found, own in ((guess, TABLES), (asked, SOFAS)):
        ranked = [found.candidate(rank).index for rank in range(2)]
        assert sorted(ranked) == list(own)
        assert found.weights[ranked[0]] > found.weights[ranked[1]]
        with pytest.raises(IndexError, match=f"2 templates of {found.category}"):
            found.candidate(2)
    assert guess.of_category("sofa").index == asked.index
    one, other = joint.predict_framed(
        [joint.frame(x) for x in (image, image[:, ::-1].copy())], category="sofa"
    )
    assert one.category == other.category == "sofa"


def test_a_category_that_the_network_does_not_see_is_doubted(joint, image):
    guess = joint.predict(image)
    table, sofa = guess.category_weights["table"], guess.category_weights["sofa"]
    assert 0.5 < table < 0.6
    assert guess.warnings == guess.photo.warnings == ()
    (told,) = joint.predict(image, category="sofa").warnings
    assert told.endswith(f"category sofa: it gives sofa {sofa:.2f}, table {table:.2f}")
    several = replace(
        guess, categories=("a", "a", "b", "c"), weights=np.float32([0.3, 0.1, 0.3, 0.3])
    )
    assert len(several.of_category("a").warnings) == 1, "guessed, and yet less than half"
    assert len(several.of_category("a").candidate(1).warnings) == 1


def test_a_category_that_the_model_does_not_know(joint, predictor, image):
    with pytest.raises(ConfigError, match="category=chair: the model was trained on sofa, table"):
        joint.predict(image, category="chair")
    with pytest.raises(ConfigError, match="category=sofa: the model was trained on table"):
        predictor.predict(image, category="sofa")
    assert predictor.predict(image, category="table").category == "table"


def test_without_a_source_it_is_the_model_that_comes_with_the_package(shipped, joint, image):
    found = Predictor.load().predict(image)
    np.testing.assert_allclose(found.weights, joint.predict(image).weights, atol=ROUNDING)
    shipped.unlink()
    with pytest.raises(ConfigError, match="no trained model: give yours with run=RUN"):
        Predictor.load()


def test_a_checkpoint_has_the_codes_of_its_templates(conditioned_checkpoint, prepared):
    network, bank = (getattr(load_model(conditioned_checkpoint), x) for x in ("network", "bank"))
    pictures = [prepared.image(prepared.index(name))[None] for name in bank.ids]
    codes = network.codes(bank.points, pictures)
    np.testing.assert_allclose(codes, network.template_codes, atol=ROUNDING)
    assert np.abs(np.diff(codes, axis=0)).max() > 100 * ROUNDING, "templates are told apart"


def test_several_photographs_of_one_object_are_one_reconstruction(predictor, image):
    turned = np.ascontiguousarray(image[:, ::-1])
    photos = [predictor.frame(x) for x in (image, turned)]
    one, other = predictor.predict_framed(photos)
    found = predictor.predict_together(photos)
    product = np.sqrt(one.weights * other.weights)
    np.testing.assert_allclose(found.weights, product / product.sum(), rtol=1e-4)
    np.testing.assert_allclose(found.offsets, (one.offsets + other.offsets) / 2, atol=1e-6)
    alone = predictor.predict_together(photos[:1])
    np.testing.assert_allclose(alone.weights, one.weights, rtol=1e-5)
    assert found.photo is photos[0]
