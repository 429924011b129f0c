import copy
import io
import itertools
import json
import resource
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
from torch import nn

from ffd_lightning.app.build import build_data, build_network
from ffd_lightning.app.commands import export as command
from ffd_lightning.app.main import run as run_command
from ffd_lightning.app.settings import read_settings
from ffd_lightning.checkpoint import TrainedModel, load_model, model_entry
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.errors import ConfigError, DataError, UserError
from ffd_lightning.inference.export import write
from ffd_lightning.inference.export.comparison import compare
from ffd_lightning.inference.export.graph import DTYPES, OUTPUTS, build_graph
from ffd_lightning.inference.export.templates import pack_templates
from ffd_lightning.inference.export.write import export
from ffd_lightning.nn.encoders.mobilenet import ImageEncoder
from ffd_lightning.nn.network import TemplateFfdNetwork

# What float32 may be off after MobileNet's 28 layers, whose batch norm magnifies what is rounded
# before it: ten times what was found, and a tenth of what an image makes a difference.
ROUNDING = 2e-4
EXAMPLE = "\n".join(
    line.removeprefix("    ")
    for line in command.__doc__.split("onnxruntime alone:\n")[1].split("Before")[0].splitlines()
)


@pytest.fixture(scope="module", autouse=True)
def _without_shape_checks():
    """Torch traces batches of no certain size; the checks would tie them to one."""
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)


@pytest.fixture(scope="module")
def parts(prepared, tiny_config):
    """Templates, fill, cameras, categories and record of a run of two templates."""
    return (
        TemplateBank.of(prepared, prepared.ids[:2]),
        0.8,
        tiny_config().data.render,
        ("table",),
        {"run": "default/table/b/t2/seed0"},
    )


def ffd_export(*arguments):
    return command.main(read_settings(command.Settings, arguments, command.MAIN))


class OneLayer(ImageEncoder):
    def __init__(self):
        super().__init__()
        self.layer = nn.Conv2d(3, 4, 8, stride=8)
        self.out_channels = 4

    def output_size(self, image_size):
        return image_size[0] // 8, image_size[1] // 8

    def forward(self, images):
        return self.layer(images).relu()


@pytest.fixture(scope="module")
def small(parts):
    """A network of one layer that shrinks its images, exported quickly."""
    torch.manual_seed(0)
    network = TemplateFfdNetwork(OneLayer(), (48, 64), 2, 64, 8, 32, offset_std=0.02, shrink=2)
    nn.init.normal_(network.heads.offsets.bias, std=0.05)  # of zeros nothing would be exported
    return TrainedModel(network.eval(), *parts, step=8)


@pytest.fixture(scope="module")
def graphs(small):
    """The small shape's graph for each dtype."""
    return {dtype: build_graph(small, dtype) for dtype in DTYPES}


@pytest.fixture
def ready(graphs, monkeypatch):
    """Let `export` take the small shape's graph without making it again."""
    monkeypatch.setattr(write, "build_graph", lambda _, dtype, *__: graphs[dtype])


@pytest.fixture(scope="module")
def run(parts, prepared, tiny_config, tmp_path_factory):
    """A run folder with the checkpoint of a MobileNet that has seen one batch."""
    torch.manual_seed(0)
    momentum, ids = "network.batch_norm_momentum=1", tmp_path_factory.mktemp("ids") / "ids.txt"
    ids.write_text("\n".join(prepared.ids[:2]))
    listed = ["template_strategy=listed", f"template_strategy.file={ids}"]
    cfg = tiny_config("network.offset_std=0.02", momentum, *listed)
    data, network = build_data(cfg), build_network(cfg).train()
    data.setup()
    images = np.stack([prepared.image(k)[..., :3].transpose(2, 0, 1) for k in range(8)])
    with torch.no_grad():
        network(torch.from_numpy(images))  # moves batch norm's statistics, as training does
    state = {f"network.{name}": value for name, value in network.state_dict().items()}
    path = tmp_path_factory.mktemp("run") / "checkpoints" / "last.ckpt"
    path.parent.mkdir()
    entry = model_entry(network, data, parts[-1])
    torch.save({"state_dict": state, "global_step": 3, **entry}, path)
    return path.parents[1]


@pytest.fixture(scope="module")
def exported(run, tmp_path_factory):
    """The folder of what the command wrote, and what it said."""
    folder = tmp_path_factory.mktemp("exported")
    stdout, sys.stdout = sys.stdout, io.StringIO()
    try:
        assert ffd_export(f"run={run}", f"out={folder}/new/model.onnx") == 0
        return folder / "new", sys.stdout.getvalue()
    finally:
        sys.stdout = stdout


def test_the_exported_file_gives_what_torch_gives(exported, run, prepared):
    folder, said = exported
    network = load_model(run / "checkpoints" / "last.ckpt").network.double()
    session = onnxruntime.InferenceSession(folder / "model.onnx")
    images = np.stack([prepared.image(k)[..., :3].transpose(2, 0, 1) for k in range(5)])
    for size in (1, 2, 5):
        outputs = session.run(None, {"images": images[:size]})
        with torch.no_grad():
            expected = network(torch.from_numpy(images[:size]).double())
        for name, output in zip(OUTPUTS, outputs, strict=True):
            np.testing.assert_allclose(output, getattr(expected, name), atol=ROUNDING)
    assert [output.name for output in session.get_outputs()] == list(OUTPUTS)
    assert outputs[2].shape == (5, 2, 64, 3)
    assert np.ptp(outputs[2], axis=0).max() > 10 * ROUNDING, "all images gave the same"
    assert "images (batch, 3, 48, 64) uint8, 2 templates" in said


def test_the_example_deforms_the_selected_template_without_torch(exported, run, prepared):
    folder, _ = exported
    image = prepared.image(3)[..., :3]
    np.save(folder / "framed.npy", image)
    script = "import sys\nsys.modules['torch'] = sys.modules['ffd_lightning'] = None\n"
    script += EXAMPLE + "\nnp.savez('result.npz', vertices=vertices, faces=faces)\n"
    subprocess.run([sys.executable, "-c", script], cwd=folder, check=True, timeout=600)
    model = load_model(run / "checkpoints" / "last.ckpt")
    with torch.no_grad():
        prediction = model.network(torch.from_numpy(image.copy()).permute(2, 0, 1)[None])
    index = int(prediction.template_index)
    expected = model.bank.deformed_mesh(index, prediction.offsets[0, index])
    result = np.load(folder / "result.npz")
    np.testing.assert_allclose(result["vertices"], expected.vertices, atol=ROUNDING)
    np.testing.assert_array_equal(result["faces"], expected.faces)
    assert np.abs(expected.vertices - model.bank.subdivided(index)[0].vertices).max() > 1e-2


def test_the_file_says_what_a_user_needs_and_nothing_of_its_machine(exported, prepared):
    content = (exported[0] / "model.onnx").read_bytes()
    graph = onnx.load_from_string(content)
    said = {entry.key: entry.value for entry in graph.metadata_props}
    assert json.loads(said["template_ids"]) == list(prepared.ids[:2])
    assert json.loads(said["image_size"]) == [48, 64]
    assert 0.4 < json.loads(said["fill"]) <= 1
    assert json.loads(said["degrees"]) == [3, 3, 3]
    assert said["run"] == "default/table/b/t2/seed0"
    assert said["step"] == "3"
    assert str(Path(write.__file__).parents[3]).encode() not in content
    assert "BatchNormalization" not in {node.op_type for node in graph.graph.node}


@pytest.mark.parametrize("dtype", DTYPES)
def test_both_dtypes_constant_images_and_any_scale_agree_with_torch(small, graphs, dtype, prepared):
    content = graphs[dtype].SerializeToString()
    real = np.stack([prepared.image(k)[..., :3].transpose(2, 0, 1) for k in range(8)])
    shown = {"real": torch.from_numpy(real), "black": torch.zeros(8, 3, 48, 64).byte()}
    if dtype == "float32":
        shown["unit scale"] = torch.from_numpy(real) / 255
    for images in (shown, None):
        differences = compare(small, content, dtype, images)
        assert 0 < max(differences.values()) < 2e-6, differences


def test_exporting_again_writes_the_same(small, graphs):
    again = build_graph(small)
    assert again.SerializeToString() == graphs["uint8"].SerializeToString()


def test_a_graph_that_differs_is_not_written(small, graphs, tmp_path, monkeypatch):
    other = onnx.ModelProto()
    other.CopyFrom(graphs["uint8"])
    bias = next(
        tensor for tensor in other.graph.initializer if tensor.name.endswith("offsets.bias")
    )
    values = onnx.numpy_helper.to_array(bias).copy()
    values[5] += 0.01
    bias.CopyFrom(onnx.numpy_helper.from_array(values, bias.name))
    monkeypatch.setattr(write, "build_graph", lambda *_: other)
    with pytest.raises(DataError, match=r"offsets differ from torch's by 1\.0e-02"):
        export(small, tmp_path / "model.onnx")
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("ready")
def test_a_diverged_network_is_refused(small, tmp_path):
    network = copy.deepcopy(small.network)
    network.heads.offsets.bias.data[0] = torch.nan
    with pytest.raises(DataError, match="offsets are not finite"):
        export(replace(small, network=network), tmp_path / "model.onnx")


def test_packed_templates_rebuild_meshes_and_parts(small):
    arrays = pack_templates(small.bank)
    rng = np.random.default_rng(0)
    for k in range(2):
        mesh, _ = small.bank.subdivided(k)
        rows = rng.integers(len(mesh.vertices), size=50)
        points = naive_deformation(arrays[f"stu_{k}"][rows], arrays["control_points"][k])
        np.testing.assert_allclose(points, mesh.vertices[rows], atol=1e-6)
        offsets = rng.normal(0, 0.1, (64, 3)).astype(np.float32)
        moved = small.bank.deformed_mesh(k, torch.from_numpy(offsets)).vertices[rows]
        points = naive_deformation(arrays[f"stu_{k}"][rows], arrays["control_points"][k] + offsets)
        np.testing.assert_allclose(points, moved, atol=1e-6)
        np.testing.assert_array_equal(arrays[f"faces_{k}"], mesh.faces)
        np.testing.assert_array_equal(arrays[f"parts_{k}"], mesh.face_parts)
        np.testing.assert_array_equal(arrays[f"colors_{k}"], mesh.face_colors)
    assert tuple(arrays["part_names"]) == small.bank.part_names


def naive_deformation(stu, control_points):
    """The sum over all control points of a cubic lattice, one after the other."""
    curves = [
        [factor * c**i * (1 - c) ** (3 - i) for i, factor in enumerate((1, 3, 3, 1))]
        for c in stu.T.astype(float)
    ]
    points = np.zeros((len(stu), 3))
    for row, (i, j, k) in enumerate(itertools.product(range(4), repeat=3)):
        weight = curves[0][i] * curves[1][j] * curves[2][k]
        points += weight[:, None] * control_points[row]
    return points


@pytest.mark.usefixtures("ready")
def test_a_full_disk_leaves_nothing_behind(small, tmp_path):
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, before[1]))
    try:
        with pytest.raises(DataError, match=r"cannot write .*model\.templates\.npz"):
            export(small, tmp_path / "model.onnx")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("ready")
def test_templates_are_optional_and_files_are_replaced(small, tmp_path):
    out = tmp_path / "model.onnx"
    out.write_text("an earlier one")
    export(small, out, templates=False)
    onnx.checker.check_model(onnx.load(out))
    assert list(tmp_path.iterdir()) == [out]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("run={run}", "ouT=a.onnx"), r"no setting 'ouT'\. Did you mean out\?"),
        (("run={run}", "out=model.pt"), r"must be a file that ends in \.onnx"),
        (("run={run}", "dtype=float16"), "dtype=float16 must be uint8 or float32"),
        (("run={run}", "opset=9"), "opset=9 must be one of 18 to 25"),
        (("run={run}", "opset=new"), "opset=new cannot be used"),
        (("run={run}", "templates=perhaps"), "templates=perhaps cannot be used"),
        (("run=nowhere",), "there is no run nowhere"),
        (("run={run}", "checkpoint=none.ckpt"), r"none\.ckpt"),
        (("run={empty}",), "is not a run folder"),
        (("run={run}", "out={file}/model.onnx"), "cannot make the folder .*file: "),
    ],
)
def test_mistakes_are_named(arguments, message, run, tmp_path):
    (tmp_path / "file").touch()
    places = {"run": run, "empty": tmp_path, "file": tmp_path / "file"}
    with pytest.raises(UserError, match=message):
        ffd_export(*(argument.format(**places) for argument in arguments))


def test_a_missing_package_is_named_with_its_command(small, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnxscript", None)
    with pytest.raises(ConfigError, match=r"needs onnxscript.*pip install 'ffd_lightning\[onnx\]'"):
        export(small, tmp_path / "model.onnx")


def test_help_holds_the_example(capsys):
    run_command("export", ["--help"])
    said = capsys.readouterr().out
    assert "onnxruntime.InferenceSession" in said
    assert "opset=18" in said
