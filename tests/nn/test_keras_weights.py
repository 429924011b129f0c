import os
import shutil
import sys

import h5py
import numpy as np
import pytest
import torch

from ffd_lightning.errors import ConfigError
from ffd_lightning.nn.encoders.keras_weights import load_keras_weights
from ffd_lightning.nn.encoders.mobilenet import MobileNetV1

os.environ.setdefault("KERAS_BACKEND", "torch")
keras = pytest.importorskip("keras")


def mobilenet(shape=(64, 64, 3), **options):
    """Keras' model with random weights and random moving statistics."""
    model = keras.applications.MobileNet(
        input_shape=shape, alpha=0.25, weights=None, **{"include_top": False, **options}
    )
    rng = np.random.default_rng(0)
    for layer in model.layers:
        values = layer.get_weights()
        if isinstance(layer, keras.layers.BatchNormalization):
            gamma, beta, mean, variance = values
            values = [
                rng.uniform(0.5, 2.0, gamma.shape),
                rng.normal(0.5, 0.5, beta.shape),
                rng.normal(0.0, 0.3, mean.shape),
                rng.uniform(0.2, 1.0, variance.shape),
            ]
        layer.set_weights(values)
    return model


def write_keras2(model, group, *, numbered=False):
    """Write the layout of the published files, by its description, with h5py."""
    group.attrs["layer_names"] = [layer.name.encode() for layer in model.layers]
    for layer in model.layers:
        layer_group = group.create_group(layer.name)
        scope = f"{layer.name}_7" if numbered else layer.name
        names = []
        for variable, value in zip(layer.weights, layer.get_weights(), strict=True):
            depthwise = layer.name.startswith("conv_dw") and variable.name == "kernel"
            names.append(f"{scope}/{'depthwise_' if depthwise else ''}{variable.name}:0")
            layer_group.create_dataset(names[-1], data=value)
        layer_group.attrs["weight_names"] = [name.encode() for name in names]


def write(model, path, layout):
    if layout == "keras3":
        model.save_weights(path)
    elif layout == "keras3-unnamed":
        model.save_weights(path)
        with h5py.File(path, "r+") as file:
            for container in file["layers"].values():
                container["vars"].attrs.pop("name", None)
    elif layout == "keras3-model":
        model.save(path)
    else:
        with h5py.File(path, "w") as file:
            if layout == "keras2-model":
                write_keras2(model, file.create_group("model_weights"))
                # An optimizer's moments bear the names of the weights.
                slot = "optimizer_weights/m/conv1/kernel:0"
                file.create_dataset(slot, data=np.zeros((3, 3, 3, 8), np.float32))
            else:
                write_keras2(model, file, numbered=layout == "keras2-numbered")


def assert_same_features(model, encoder, size):
    images = torch.randn(2, 3, *size, generator=torch.Generator().manual_seed(1))
    expected = model(images.permute(0, 2, 3, 1).numpy(), training=False)
    expected = torch.as_tensor(keras.ops.convert_to_numpy(expected)).permute(0, 3, 1, 2)
    assert expected.std() > 0.1  # else the comparison could not fail
    with torch.no_grad():
        features = encoder.eval()(images)
    torch.testing.assert_close(features, expected, rtol=0, atol=1e-4 * float(expected.abs().max()))


@pytest.fixture(scope="module")
def model():
    return mobilenet()


@pytest.fixture(scope="module")
def weight_file(model, tmp_path_factory):
    path = tmp_path_factory.mktemp("keras") / "mobilenet_2_5_192_tf_no_top.h5"
    write(model, path, "keras2")
    return path


@pytest.mark.parametrize(
    ("layout", "name"),
    [
        ("keras2", "x.h5"),
        ("keras2-numbered", "x.h5"),
        ("keras2-model", "x.h5"),
        ("keras3", "x.weights.h5"),
        ("keras3-unnamed", "x.weights.h5"),
        ("keras3-model", "x.h5"),
    ],
)
def test_features_agree_with_keras_in_every_layout(model, tmp_path, layout, name):
    write(model, tmp_path / name, layout)
    encoder = MobileNetV1(0.25)
    load_keras_weights(encoder, tmp_path / name)
    assert_same_features(model, encoder, (64, 64))


@pytest.mark.parametrize("size", [(192, 192), (192, 256), (97, 130), (101, 99)])
def test_features_agree_with_keras_at_every_size(model, weight_file, size):
    other = keras.applications.MobileNet(
        input_shape=(*size, 3), alpha=0.25, include_top=False, weights=None
    )
    other.set_weights(model.get_weights())
    encoder = MobileNetV1(0.25)
    load_keras_weights(encoder, weight_file)
    assert_same_features(other, encoder, size)


def test_a_top_is_ignored(tmp_path):
    with_top = mobilenet(include_top=True, classes=5)
    with_top.save_weights(tmp_path / "top.weights.h5")
    encoder = MobileNetV1(0.25)
    load_keras_weights(encoder, tmp_path / "top.weights.h5")
    last = with_top.get_layer("conv_pw_13").get_weights()[0][0, 0].T
    loaded = encoder.layers.get_submodule("conv_pw_13").weight[:, :, 0, 0]
    np.testing.assert_array_equal(loaded.detach().numpy(), last)


def test_another_width_names_layer_shapes_and_way_out(weight_file):
    encoder = MobileNetV1(0.5)
    before = encoder.layers.get_submodule("conv1_bn").bias.clone()
    with pytest.raises(ConfigError) as caught:
        load_keras_weights(encoder, weight_file)
    message = str(caught.value)
    for part in ("layer conv1 ", "(3, 3, 3, 8)", "(3, 3, 3, 16)", "0.25", "encoder.width"):
        assert part in message
    assert torch.equal(encoder.layers.get_submodule("conv1_bn").bias, before)


def test_a_missing_layer_is_named_and_nothing_is_loaded(weight_file, tmp_path):
    path = shutil.copy(weight_file, tmp_path / "damaged.h5")
    with h5py.File(path, "r+") as file:
        del file["conv_pw_5"]
    encoder = MobileNetV1(0.25)
    before = encoder.layers.get_submodule("conv1").weight.clone()
    with pytest.raises(ConfigError, match=r"lacks conv_pw_5/kernel$"):
        load_keras_weights(encoder, path)
    assert torch.equal(encoder.layers.get_submodule("conv1").weight, before)


def test_other_files_say_what_they_are(model, tmp_path):
    encoder = MobileNetV1(0.25)
    with pytest.raises(ConfigError, match="there is no file"):
        load_keras_weights(encoder, tmp_path / "none.h5")
    (tmp_path / "text.h5").write_text("not weights")
    with pytest.raises(ConfigError, match=r"not a readable HDF5 file$"):
        load_keras_weights(encoder, tmp_path / "text.h5")
    model.save(tmp_path / "whole.keras")
    with pytest.raises(ConfigError, match=r"take model.weights.h5"):
        load_keras_weights(encoder, tmp_path / "whole.keras")
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["block1_conv1/kernel:0"] = np.zeros((3, 3, 3, 64))
    with pytest.raises(ConfigError, match="no layer of a MobileNet"):
        load_keras_weights(encoder, tmp_path / "other.h5")


def test_without_h5py_the_error_says_what_to_install(weight_file, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(ConfigError, match=r"pip install 'ffd_lightning\[keras\]'"):
        load_keras_weights(MobileNetV1(0.25), weight_file)
