"""What varied training images keep, and how far they go."""

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


def test_white_stays_white_where_no_background_is_left():
    vary = {name: value for name, value in OWN.items() if name not in BACKGROUND}
    result = varied(coloured(), **vary)
    beyond = result[:, 3] == 0
    assert beyond.float().mean() > 0.5
    assert result[:, :3].permute(1, 0, 2, 3)[:, beyond].min() >= 254
    nothing_there = torch.full((8, 4, HEIGHT, WIDTH), 255, dtype=torch.uint8)
    nothing_there[:, 3] = 0
    assert torch.equal(varied(nothing_there, **vary), nothing_there)


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
