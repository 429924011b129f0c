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


def mobilenet(shape=(64, 64, 3)):
    """Keras' model with random weights and random moving statistics."""
    model = keras.applications.MobileNet(
        input_shape=shape, alpha=0.25, weights=None, include_top=False
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


def write_published(model, path):
    """Write the layout of the published files, by its description, with h5py."""
    with h5py.File(path, "w") as file:
        file.attrs["layer_names"] = [layer.name.encode() for layer in model.layers]
        for layer in model.layers:
            group, names = file.create_group(layer.name), []
            for variable, value in zip(layer.weights, layer.get_weights(), strict=True):
                depthwise = layer.name.startswith("conv_dw") and variable.name == "kernel"
                name = f"{layer.name}/{'depthwise_' if depthwise else ''}{variable.name}:0"
                names.append(name)
                group.create_dataset(name, data=value)
            group.attrs["weight_names"] = [name.encode() for name in names]


def assert_same_features(model, path, size):
    encoder = MobileNetV1(0.25)
    load_keras_weights(encoder, path)
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
    write_published(model, path)
    return path


@pytest.mark.parametrize("name", ["x.weights.h5", "whole.h5", "whole.keras"])
def test_features_agree_with_keras_in_every_layout(model, tmp_path, name):
    path = tmp_path / name
    (model.save if name.startswith("whole") else model.save_weights)(path)
    assert_same_features(model, path, (64, 64))


@pytest.mark.parametrize("size", [(192, 256), (97, 130)])
def test_features_of_the_published_layout_agree_at_every_size(model, weight_file, size):
    other = mobilenet((*size, 3))
    other.set_weights(model.get_weights())
    assert_same_features(other, weight_file, size)


def test_other_files_are_refused_and_nothing_is_loaded(weight_file, tmp_path, monkeypatch):
    damaged = shutil.copy(weight_file, tmp_path / "damaged.h5")
    with h5py.File(damaged, "r+") as file:
        del file["conv_pw_5"]
    (tmp_path / "text.h5").write_text("not weights")
    for width, path, message in (
        (0.25, damaged, "damaged.h5 holds no MobileNet of width 0.25 without a top"),
        (0.25, tmp_path / "text.h5", "text.h5 holds no MobileNet"),
        (0.5, weight_file, "no MobileNet of width 0.5 .*encoder.width must be the file's"),
    ):
        encoder = MobileNetV1(width)
        before = encoder.layers.get_submodule("conv1").weight.clone()
        with pytest.raises(ConfigError, match=message):
            load_keras_weights(encoder, path)
        assert torch.equal(encoder.layers.get_submodule("conv1").weight, before)
    monkeypatch.setitem(sys.modules, "keras", None)
    with pytest.raises(ConfigError, match=r"pip install 'ffd_lightning\[keras\]'"):
        load_keras_weights(MobileNetV1(0.25), weight_file)
