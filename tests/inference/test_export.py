import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import jaxtyping
import numpy as np
import onnx
import onnxruntime
import pytest
import torch
import trimesh
from commands import call, run_command

from ffd_lightning.app.commands import export as command
from ffd_lightning.checkpoint import load_model
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.inference import export as module
from ffd_lightning.inference.export import OUTPUTS, export_onnx
from ffd_lightning.inference.predictor import Predictor
from ffd_lightning.nn.network import FfdPrediction

# What float32 may be off after MobileNet's 28 layers, whose batch norm magnifies what is rounded
# before it: ten times what was found, and a tenth of what an image makes a difference.
ROUNDING = 2e-4
PAGE = (Path(__file__).parents[2] / "docs" / "inference.md").read_text(encoding="utf-8")
EXAMPLE = PAGE.split("```python\n")[1].split("```")[0]


@pytest.fixture(scope="module", autouse=True)
def _without_shape_checks():
    """Torch traces batches of no certain size; the checks would tie them to one."""
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)


def compared(folder, network, images):
    """What the file gives, held against torch in float64: of one image, of two, of all."""
    session = onnxruntime.InferenceSession(folder / "model.onnx")
    assert [output.name for output in session.get_outputs()] == list(OUTPUTS)
    for size in (1, 2, len(images)):
        outputs = session.run(None, {"images": images[:size]})
        with torch.no_grad():
            expected = network(torch.from_numpy(images[:size]).double())
        for name, output in zip(OUTPUTS, outputs, strict=True):
            np.testing.assert_allclose(output, getattr(expected, name), atol=ROUNDING)
    np.testing.assert_array_equal(outputs[0].argmax(1), expected.template_index)
    return outputs


@pytest.fixture(scope="module")
def exported(joint_checkpoint, tmp_path_factory):
    """The folder of what the command wrote, in place of an earlier file, and what it printed."""
    folder = tmp_path_factory.mktemp("exported")
    (folder / "model.onnx").write_text("an earlier one")
    done = run_command("export", f"run={joint_checkpoint}", f"out={folder}/model.onnx")
    assert done.returncode == 0, done.stderr
    return folder, done.stdout


def test_the_exported_file_gives_what_torch_gives(exported, joint_checkpoint, prepared):
    folder, printed = exported
    images = np.stack([prepared.image(k)[..., :3].transpose(2, 0, 1) for k in range(5)])
    outputs = compared(folder, load_model(joint_checkpoint).network.double(), images)
    assert outputs[2].shape == (5, 4, 64, 3)
    assert np.ptp(outputs[2], axis=0).max() > 10 * ROUNDING, "all images gave the same"
    assert "images (batch, 3, 48, 64) uint8, 4 templates" in printed


def test_the_example_deforms_the_selected_template_without_torch(
    exported, joint_checkpoint, prepared
):
    folder, _ = exported
    image = prepared.image(3)[..., :3]
    np.save(folder / "framed.npy", image)
    script = "import sys\nsys.modules['torch'] = sys.modules['ffd_lightning'] = None\n"
    script += EXAMPLE + "\nnp.savez('result.npz', vertices=vertices, faces=faces)\n"
    subprocess.run([sys.executable, "-c", script], cwd=folder, check=True, timeout=600)
    model = load_model(joint_checkpoint)
    with torch.no_grad():
        prediction = model.network(torch.from_numpy(image.copy()).permute(2, 0, 1)[None])
    index = int(prediction.template_index)
    expected = model.bank.deformed_mesh(index, prediction.offsets[0, index])
    result = np.load(folder / "result.npz")
    np.testing.assert_allclose(result["vertices"], expected.vertices, atol=ROUNDING)
    np.testing.assert_array_equal(result["faces"], expected.faces)
    assert np.abs(expected.vertices - model.bank.subdivided(index)[0].vertices).max() > 1e-2
    templates = np.load(folder / "model.templates.npz")
    np.testing.assert_array_equal(templates[f"parts_{index}"], expected.face_parts)
    np.testing.assert_array_equal(templates[f"colors_{index}"], expected.face_colors)
    assert tuple(templates["part_names"]) == model.bank.part_names


def test_the_file_says_what_a_user_needs_and_nothing_of_its_machine(exported, joint_checkpoint):
    content = (exported[0] / "model.onnx").read_bytes()
    graph = onnx.load_from_string(content)
    onnx.checker.check_model(graph, full_check=True)
    said = {entry.key: entry.value for entry in graph.metadata_props}
    assert json.loads(said["template_ids"]) == list(load_model(joint_checkpoint).bank.ids)
    assert json.loads(said["image_size"]) == [48, 64]
    assert 0.4 < json.loads(said["fill"]) <= 1
    assert json.loads(said["degrees"]) == [3, 3, 3]
    assert said["step"] == "3"
    assert str(Path(module.__file__).parents[2]).encode() not in content
    assert "BatchNormalization" not in {node.op_type for node in graph.graph.node}


def test_a_graph_that_differs_is_not_written(exported, joint_checkpoint, tmp_path, monkeypatch):
    graph, model = onnx.load(exported[0] / "model.onnx"), load_model(joint_checkpoint)
    monkeypatch.setattr(module, "build_graph", lambda *_: graph)
    model.network.heads.offsets.bias.data[5] += 0.01
    with pytest.raises(DataError, match=r"offsets differ from torch's by 1\.0e-02"):
        export_onnx(model, tmp_path / "model.onnx")
    model.network.heads.offsets.bias.data[0] = torch.nan
    with pytest.raises(DataError, match="offsets differ from torch's by nan"):
        export_onnx(model, tmp_path / "model.onnx")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (lambda images: images if images.any() else -images, "torch cannot export this network"),
        (lambda images: images.reshape(len(images), -1), "batches of one size alone"),
    ],
)
def test_a_network_that_torch_cannot_export_is_named(code, message, joint_checkpoint, tmp_path):
    class Network(torch.nn.Module):
        image_size = (48, 64)

        def forward(self, images):
            return FfdPrediction(*[code(images)] * 3, None)

    model = replace(load_model(joint_checkpoint), network=Network())
    with pytest.raises(ConfigError, match=message):
        export_onnx(model, tmp_path / "model.onnx")
    assert not list(tmp_path.iterdir())


def test_files_hold_templates_that_a_network_is_told(conditioned_checkpoint, prepared, tmp_path):
    """They say what the network does that was told them, when the meshes are gone."""
    for name, size in {"low": (2, 1, 3), "tall": (1, 3, 1), "wide": (4, 1, 1)}.items():
        trimesh.creation.box(size).export(tmp_path / f"{name}.ply")
    meshes, root = f"{tmp_path}/*.ply", tmp_path / "data"
    settings = [f"run={conditioned_checkpoint}", f"templates={meshes}", "up=x", f"data_root={root}"]
    for file in ("model.ckpt", "model.onnx"):
        assert call(command, *settings, f"out={tmp_path}/{file}") == 0
    told = Predictor.load(conditioned_checkpoint).with_templates(meshes, up="x", root=root)
    for path in (*tmp_path.glob("*.ply"), *root.glob("codes/*"), *root.glob("prepared/*/*")):
        path.unlink()
    views = [prepared.image(k) for k in range(3)]
    images = np.stack([view[..., :3].transpose(2, 0, 1) for view in views])
    network = told.model.network.double()
    compared(tmp_path, network, images)
    with np.load(tmp_path / "model.templates.npz") as templates:
        np.testing.assert_allclose(templates["control_points"], told.model.bank.control_points)
    with torch.no_grad():
        for weights in network.float().parameters():
            if weights.ndim > 1:
                weights.copy_(weights.half())  # as they are in the file
    packed = Predictor.load(tmp_path / "model.ckpt")
    assert packed.model.bank.ids == told.model.bank.ids == ("low", "tall", "wide")
    before, after = told.predict(views[0]), packed.predict(views[0])
    np.testing.assert_allclose(after.weights, before.weights, atol=1e-5)
    np.testing.assert_allclose(after.offsets, before.offsets, atol=1e-5)
