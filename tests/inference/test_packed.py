import shutil

import numpy as np
import pytest
import torch

from ffd_lightning.checkpoint import load_model
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.inference import export
from ffd_lightning.inference.export import write_packed
from ffd_lightning.inference.predictor import Predictor

POINTS = 100


@pytest.fixture(scope="module")
def written(joint_checkpoint, tmp_path_factory):
    """The joint checkpoint packed, with fewer points than it has."""
    out = tmp_path_factory.mktemp("packed") / "model.ckpt"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(export, "NUM_POINTS", POINTS)
        write_packed(joint_checkpoint, out)
    return out


def test_predictions_are_those_of_weights_rounded_to_float16(written, joint_checkpoint, prepared):
    """Nothing but the rounding moves them, and it moves them little."""
    image = prepared.image(0)
    whole, small = Predictor.load(joint_checkpoint), Predictor.load(written)
    before, after = whole.predict(image), small.predict(image)
    np.testing.assert_allclose(after.weights, before.weights, atol=2e-3)
    moved = np.linalg.norm(after.offsets - before.offsets) / np.linalg.norm(before.offsets)
    assert 0 < moved < 0.1, "one batch has hardly settled batch norm, which magnifies"
    with torch.no_grad():
        for weights in whole.model.network.parameters():
            if weights.ndim > 1:
                weights.copy_(torch.from_numpy(weights.numpy().astype(np.float16)))
    rounded = whole.predict(image)
    np.testing.assert_array_equal(after.weights, rounded.weights)
    np.testing.assert_array_equal(after.offsets, rounded.offsets)


def test_what_only_training_needs_is_left_out_and_templates_stay_whole_but_for_points(
    written, joint_checkpoint
):
    content = torch.load(written, weights_only=True)
    assert "optimizer_states" in torch.load(joint_checkpoint, weights_only=True)
    assert set(content) == {"global_step", "state_dict", "model"}
    vectors = {v.dtype for v in content["state_dict"].values() if v.ndim == 1}
    matrices = {v.dtype for v in content["state_dict"].values() if v.ndim > 1}
    assert (vectors, matrices) == ({torch.float32}, {torch.float16})
    before, after = load_model(joint_checkpoint), load_model(written)
    assert after.bank.ids == before.bank.ids
    assert (after.categories, after.record) == (before.categories, before.record)
    for one, other in zip(before.bank.meshes, after.bank.meshes, strict=True):
        np.testing.assert_array_equal(one.vertices, other.vertices)
        np.testing.assert_array_equal(one.faces, other.faces)
        np.testing.assert_array_equal(one.face_parts, other.face_parts)
    torch.testing.assert_close(after.bank.points, before.bank.points[:, :POINTS])
    np.testing.assert_array_equal(after.bank.point_parts, before.bank.point_parts[:, :POINTS])


def test_a_checkpoint_is_not_written_over_itself(joint_checkpoint, tmp_path):
    path = shutil.copy(joint_checkpoint, tmp_path / "last.ckpt")
    before = path.read_bytes()
    with pytest.raises(ConfigError, match="is the checkpoint itself"):
        write_packed(path, tmp_path / "." / "last.ckpt")
    assert path.read_bytes() == before


def test_weights_beyond_float16_are_named_and_nothing_is_written(joint_checkpoint, tmp_path):
    content = torch.load(joint_checkpoint, weights_only=True)
    content["state_dict"]["network.heads.shared.1.weight"][0, 0] = 1e6
    torch.save(content, tmp_path / "large.ckpt")
    with pytest.raises(DataError, match=r"heads.shared.1.weight has values that float16 cannot"):
        write_packed(tmp_path / "large.ckpt", tmp_path / "out.ckpt")
    assert not (tmp_path / "out.ckpt").exists()
