"""What varied training images keep, and how far they go."""

import math
from dataclasses import fields

import pytest
import torch

from ffd_lightning.imaging.augmentation import PhotoAugmentation

HEIGHT, WIDTH = 48, 64
OWN = {f.name: f.default for f in fields(PhotoAugmentation)}
NOTHING = dict.fromkeys(OWN, 0.0)
COLOURS = ("brightness", "contrast", "gamma", "light", "saturation", "hue", "tint")
BACKGROUND = ("background", "patch", "border")


def bars(count=64, colour=0.0):
    """Upright bars off the centre, a third of a pixel of coverage at their left edge."""
    coverage = torch.zeros(count, 1, HEIGHT, WIDTH)
    coverage[..., 12:36, 26:34] = 1
    coverage[..., 12:36, 25] = 1 / 3
    rgb = (coverage * colour + 1 - coverage).expand(-1, 3, -1, -1)
    return (255 * torch.cat([rgb, coverage], dim=1)).round().to(torch.uint8)


def coloured(count=64):
    """Bars with a pattern of random colours."""
    images = bars(count)
    pattern = torch.rand(count, 3, HEIGHT, WIDTH, generator=torch.Generator().manual_seed(1))
    coverage = images[:, 3:].float() / 255
    images[:, :3] = (255 * (pattern * coverage + 1 - coverage)).round().to(torch.uint8)
    return images


def varied(images, seed=0, **settings):
    """Return images varied by so much, and by nothing else."""
    torch.manual_seed(seed)
    return PhotoAugmentation(**NOTHING | settings)(images)


def moments(coverage):
    """Return centres (q, 2) in pixels, x first, and the inertia (q, 2, 2) about them."""
    weight = coverage.double() / coverage.double().sum((1, 2), keepdim=True)
    y, x = torch.meshgrid(torch.arange(HEIGHT), torch.arange(WIDTH), indexing="ij")
    places = torch.stack([x, y], dim=-1).double()
    centre = torch.einsum("qhw,hwc->qc", weight, places)
    off = places - centre[:, None, None]
    return centre, torch.einsum("qhw,qhwc,qhwd->qcd", weight, off, off)


def test_no_variation_changes_nothing():
    images = coloured()
    before = images.clone()
    result = varied(images)
    assert (result.shape, result.dtype) == (images.shape, torch.uint8)
    assert (result.int() - images.int()).abs().max() <= 1
    PhotoAugmentation()(images)
    assert torch.equal(images, before), "given images stay as they are"


def test_what_is_drawn_follows_from_torchs_seed():
    images, augmentation = coloured(8), PhotoAugmentation()
    results = []
    for seed in (3, 3, 4):
        torch.manual_seed(seed)
        results.append(augmentation(images))
    assert torch.equal(results[0], results[1])
    assert not torch.equal(results[0], results[2])
    assert len({image.numpy().tobytes() for image in varied(bars(8), scale=0.3)}) == 8


def test_white_stays_white_where_no_background_is_left():
    vary = {name: value for name, value in OWN.items() if name not in BACKGROUND}
    result = varied(coloured(), **vary)
    beyond = result[:, 3] == 0
    assert beyond.float().mean() > 0.5
    assert result[:, :3].permute(1, 0, 2, 3)[:, beyond].min() >= 254
    nothing_there = torch.full((8, 4, HEIGHT, WIDTH), 255, dtype=torch.uint8)
    nothing_there[:, 3] = 0
    assert torch.equal(varied(nothing_there, **vary), nothing_there)


def test_coverage_goes_with_the_object():
    """Of a black object over white, the distance from white is the coverage."""
    result = varied(bars(), scale=0.3, shift=0.2, roll=20, blur=1, erasing=0.5).int()
    assert ((255 - result[:, :3]) - result[:, 3:]).abs().max() <= 1
    centres, _ = moments(result[:, 3])
    assert centres.std(dim=0).min() > 1, "it moved"


def test_shift_is_in_heights():
    (before, _), (after, _) = (moments(i[:, 3]) for i in (bars(500), varied(bars(500), shift=0.1)))
    moved = (after - before).abs().amax(dim=0)
    assert moved.max() <= 0.1 * HEIGHT + 1e-2
    assert moved.min() > 0.09 * HEIGHT


def test_scale_and_roll_keep_the_aspect():
    images = bars(200)
    centre = torch.tensor([(WIDTH - 1) / 2, (HEIGHT - 1) / 2], dtype=torch.double)
    before, own = moments(images[:, 3])
    sizes = torch.linalg.eigvalsh(own)
    after, inertia = moments(varied(images, roll=30)[:, 3])
    torch.testing.assert_close(torch.linalg.eigvalsh(inertia), sizes, rtol=0.1, atol=0.2)
    distances = [(c - centre).norm(dim=1) for c in (before, after)]
    torch.testing.assert_close(*distances, rtol=0, atol=0.1)
    angles = torch.atan2(2 * inertia[:, 0, 1], inertia[:, 1, 1] - inertia[:, 0, 0]) / 2
    assert 25 < angles.abs().max().rad2deg() < 31
    _, inertia = moments(varied(images, scale=0.25)[:, 3])
    factors = (torch.linalg.eigvalsh(inertia) / sizes).sqrt()[:, 1]  # of the length
    assert 0.78 < factors.min() < 0.83
    assert 1.2 < factors.max() < 1.27


@pytest.mark.parametrize("name", COLOURS)
def test_each_change_of_colour_leaves_the_outline(name):
    images = coloured()
    result = varied(images, **{name: 0.4})
    assert (result[:, 3].int() - images[:, 3].int()).abs().max() <= 1
    inside = images[:, 3] == 255
    changes = (result[:, :3].float() - images[:, :3].float()).abs().mean(1)
    assert changes[inside].mean() > 3
    assert changes[images[:, 3] == 0].max() == 0


def test_grey_images():
    result, mean = varied(coloured(), grey=1)[:, :3].float(), coloured()[:, :3].float().mean(1)
    for channel in range(3):
        torch.testing.assert_close(result[:, channel], mean, rtol=0, atol=1.01)


def test_gamma_of_one_goes_to_the_square():
    level = torch.tensor(0.5)
    inside = varied(bars(500, level), gamma=1)[:, 0, 20, 30].float() / 255
    assert level.square() - 0.01 < inside.min() < 0.27
    assert 0.73 < inside.max() < 1 - (1 - level).square() + 0.01


def test_backgrounds():
    images = bars(200)
    whole = varied(images, background=1)
    assert whole[:, :3, 0, 0].max() < 255
    assert torch.equal(whole[:, 3], images[:, 3]), "the background is none of the object"
    share = (varied(images, background=0.25)[:, :3, 0, 0].amin(1) < 255).float().mean()
    assert 0.15 < share < 0.35
    border, patch = (
        (varied(images, **{name: 1})[:, :3].amin(1) < 255).float().mean()
        for name in ("border", "patch")
    )
    assert border < 2 * (images[:, 3] > 0).float().mean() < 2 * patch < 2


def test_cut_outs_too_wide_and_too_narrow():
    images = bars(200)
    result = varied(images, border=1)
    ink, own = ((255 - i[:, :3].float()).sum((1, 2, 3)) for i in (result, images))
    assert (ink / own).min() < 0.9
    assert (ink / own).max() > 1.1
    assert (result[:, 3] <= images[:, 3]).all()


def test_blur_spreads_and_keeps_the_sum():
    images = bars()
    result = varied(images, blur=1)[:, 3].float()
    torch.testing.assert_close(
        result.sum((1, 2)), images[:, 3].float().sum((1, 2)), rtol=0.02, atol=0
    )
    assert (result > 0).float().mean() > 1.1 * (images[:, 3] > 0).float().mean()


def test_erasing_and_noise():
    images = bars(200, 0.5)
    left = varied(images, erasing=1)[:, 3].float().sum((1, 2)) / images[:, 3].float().sum((1, 2))
    assert left.min() > 0.2
    assert (left < 0.99).float().mean() > 0.3
    noisy = varied(images, noise=0.1)[:, :3, 14:34, 27:33].float()
    assert 0.07 < noisy.std((1, 2, 3)).max() / 255 < 0.11


def test_settings_that_cannot_work():
    for name, value in (("grey", 1.1), ("roll", 60), ("shift", -0.1), ("scale", math.inf)):
        with pytest.raises(ValueError, match=rf"{name}={value} must lie in \[0, "):
            PhotoAugmentation(**{name: value})
