import copy

import numpy as np
import pytest
import torch

from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.geometry.ffd import mirrored_offsets
from ffd_lightning.nn.encoders.mobilenet import MobileNetV1
from ffd_lightning.nn.network import TemplateFfdNetwork, compile_encoder, standardize

SIZE = (64, 96)


def build(num_templates=5, min_weight=0.1, **options):
    torch.manual_seed(0)
    return TemplateFfdNetwork(
        MobileNetV1(0.25), SIZE, num_templates, 8, hidden=32, min_weight=min_weight, **options
    )


def test_heads_give_offsets_of_each_template(monkeypatch):
    network = build()
    given = torch.zeros(2, 5), torch.zeros(2, 1, 8, 3)
    monkeypatch.setattr(type(network.heads), "forward", lambda *_: given)
    with pytest.raises(ConfigError, match=r"heads=per_template must .* \(2, 5\), \(2, 1, 8, 3\)"):
        network(random_images(2))


# What logits of about 2 may be off by when float32 is added up in another order: ten times what was
# found. Images differ by 0.6 and more.
ROUNDING = 6e-4


def random_images(count=3, seed=0):
    generator = torch.Generator().manual_seed(seed)
    return torch.randint(0, 256, (count, 3, *SIZE), dtype=torch.uint8, generator=generator)


@pytest.mark.parametrize("dtype", [torch.uint8, torch.float32, torch.float64])
def test_standardize_against_the_formula_in_numpy(dtype):
    images = random_images().to(dtype)
    images[0] = 7
    if dtype != torch.uint8:
        images[1] *= 1e-5  # so faint that the deviation is below the bound
    for image, result in zip(images.numpy(), standardize(images).numpy(), strict=True):
        values = image.astype(np.float64)
        expected = (values - values.mean()) / max(values.std(), 1 / np.sqrt(values.size))
        np.testing.assert_allclose(result, expected, atol=1e-5)


def test_standardize_adds_up_many_pixels_without_loss():
    """Rendered images are mostly of one value: as many equal squares are summed up."""
    images = torch.full((2, 3, 192, 256), 255, dtype=torch.uint8)
    images[:, :, 60:140, 80:170] = torch.randint(0, 200, (2, 3, 80, 90), dtype=torch.uint8)
    exact = standardize(images.double())
    torch.testing.assert_close(standardize(images).double(), exact, atol=1e-5, rtol=0)


@pytest.mark.parametrize(
    ("num_templates", "min_weight"), [(1, 0.1), (2, 0.0), (7, 0.001), (7, 0.1), (7, 1.0)]
)
def test_weights_sum_to_one_and_keep_the_floor(num_templates, min_weight):
    network = build(num_templates, min_weight)
    with torch.no_grad():
        network.heads.logits.weight.mul_(100)  # confident, so that the floor is reached
    prediction = network(random_images())
    probs, weights = prediction.template_probs, prediction.template_weights
    torch.testing.assert_close(weights.sum(1), torch.ones(3))
    assert weights.min() >= min_weight / num_templates * (1 - 1e-5)
    expected = probs * (1 - min_weight) + min_weight / num_templates
    torch.testing.assert_close(weights, expected)
    assert torch.equal(prediction.template_logits.softmax(1), probs)


def test_eval_mode_treats_images_one_by_one_and_changes_nothing():
    torch.manual_seed(0)
    encoder = MobileNetV1(0.25, batch_norm_momentum=1.0)
    network = TemplateFfdNetwork(encoder, SIZE, 5, 8, hidden=32, batch_norm_momentum=1.0)
    network(random_images(8))  # else the moving statistics are the first: all features vanish
    network.eval()
    before = copy.deepcopy(network.state_dict())
    images = random_images(3, seed=1)
    together = network(images)
    alone = torch.cat([network(image[None]).template_logits for image in images])
    torch.testing.assert_close(together.template_logits, alone, rtol=0, atol=ROUNDING)
    assert (alone[0] - alone[1:]).abs().amax(1).min() > 100 * ROUNDING
    assert torch.equal(network(images).offsets, together.offsets)
    assert all(torch.equal(before[name], v) for name, v in network.state_dict().items())
    own = network.train()(images).template_logits  # by the statistics of these images
    assert (own - alone).abs().amax(1).min() > 100 * ROUNDING
    described = network.description()
    size = tuple(described.pop("image_size"))
    other = TemplateFfdNetwork(MobileNetV1(0.25), size, **described).eval()
    other.load_state_dict(before)
    assert torch.equal(other(images).offsets, together.offsets), "built from its description"


def test_offsets_of_mirrored_networks_are_their_own_mirror_image():
    degrees = (1, 1, 1)
    free, mirrored = build().eval(), build(mirror_degrees=degrees).eval()
    with torch.no_grad():
        given, found = (net(random_images()).offsets for net in (free, mirrored))
    torch.testing.assert_close(found, mirrored_offsets(found, degrees))
    torch.testing.assert_close(found, (given + mirrored_offsets(given, degrees)) / 2)
    assert mirrored.description()["mirror_degrees"] == degrees


def test_lower_precision_keeps_float32_outputs():
    images = random_images()
    reference = build().eval()(images).template_logits.detach()
    with torch.autocast("cpu", torch.bfloat16):
        mixed = build().eval()(images)
    low = build().to(torch.bfloat16).eval()(images)
    for found, error in ((mixed, 0.1), (low, 0.2)):
        assert {value.dtype for value in found if value is not None} == {torch.float32}
        allowed = error * float(reference.abs().max())
        torch.testing.assert_close(found.template_logits, reference, rtol=0, atol=allowed)


def test_bad_input_and_settings_say_so():
    network = build()
    with pytest.raises(DataError, match="images are 96x64 pixels, the network takes 64x96"):
        network(random_images().mT.contiguous())
    with pytest.raises(ConfigError, match="batch of one image"):
        network(random_images(1))
    for name, value in (("min_weight", 1.5), ("num_templates", 0), ("shrink", 0)):
        with pytest.raises(ValueError, match=f"{name}={value} must"):
            build(**{name: value})


@pytest.mark.parametrize("works", [True, False])
def test_compilation_changes_nothing_and_may_fail(monkeypatch, works):
    used = []

    def compiler(graph, inputs, **_):
        used.append(graph)
        if not works:
            raise RuntimeError("no compiler here")
        return graph.forward

    class Pooled(torch.nn.Module):
        def forward(self, images):
            return torch.nn.functional.avg_pool2d(images, 8)

    monkeypatch.setattr("torch._inductor.compile_fx.compile_fx", compiler)
    torch.compiler.reset()
    network = build()
    network.encoder = Pooled()  # the compiler cannot see through MobileNet's checks of shapes
    names, images = list(network.state_dict()), torch.rand(2, 3, 8, 8)
    expected = network.encoder(images)
    compile_encoder(network)
    assert torch.equal(network.encoder(images), expected)
    assert list(network.state_dict()) == names
    assert used
