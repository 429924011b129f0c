import numpy as np
import pytest
import torch
from projection import pixels_of

from ffd_lightning.geometry.ffd import Lattice, TemplateSample, deformation_matrix
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.nn.consensus import consensus_logits
from ffd_lightning.nn.viewpoint import Views


def sample(*clouds):
    lattices = [Lattice.bounding(cloud, (1, 1, 1)) for cloud in clouds]
    matrix = torch.stack([deformation_matrix(c, x) for c, x in zip(clouds, lattices, strict=True)])
    return TemplateSample(matrix, torch.stack([x.control_points() for x in lattices]), (1, 1, 1))


@pytest.mark.parametrize(("strangers", "exponent"), [(False, 1.0), (True, 0.3)])
def test_a_lonely_shape_is_selected_less_than_one_of_many_alike(strangers, exponent):
    """Expected distances by hand: three points 0.1 away, and one 0.5 away from all of those."""
    torch.manual_seed(0)
    cloud = torch.rand(64, 3)
    bank = sample(cloud, cloud, cloud, cloud)
    offsets = torch.zeros(1, 4, 8, 3)
    offsets[0, 3, :, 1] = 10.0  # so far that every nearest neighbour is at about the same distance
    logits = torch.tensor([[0.0, 0.1, 0.2, 0.5]])
    found = consensus_logits(logits, offsets, bank, strangers=strangers)
    assert found.argmax() == 2
    probs = logits.softmax(1)[0]
    moved = cloud + torch.tensor([0, 10.0, 0])
    squared = torch.cdist(cloud, moved).square()
    apart = 1000 * (squared.amin(0).mean() + squared.amin(1).mean())
    votes = (exponent * logits).softmax(1)[0]
    expected = probs.log() - apart * torch.stack([*[votes[3]] * 3, votes[:3].sum()])
    torch.testing.assert_close(found[0], expected, rtol=1e-3, atol=0)


def test_unlikely_templates_stay_behind_and_one_alone_is_selected():
    cloud = torch.rand(16, 3)
    many = sample(*[cloud] * 40)
    logits = torch.linspace(3, 0, 40)[None]
    found = consensus_logits(logits, torch.randn(1, 40, 8, 3), many)
    assert found.argmax() < 24
    assert found[0, 24:].max() < found.max()
    alone = consensus_logits(torch.zeros(2, 1), torch.zeros(2, 1, 8, 3), sample(cloud))
    assert alone.shape == (2, 1)


def test_an_outline_tells_what_a_photograph_shows():
    """A tall box and a flat one, equally likely, before the pixels that a camera sees of each."""
    torch.manual_seed(0)
    boxes = [
        torch.rand(256, 3) * torch.tensor(size) - 0.25
        for size in ([0.2, 0.9, 0.2], [0.9, 0.1, 0.4])
    ]
    bank, camera = sample(*boxes), Camera()
    masks = torch.zeros(3, 96, 128, dtype=torch.uint8)
    for mask, box in zip(masks, boxes, strict=False):  # the third shows nothing
        columns, rows = pixels_of(camera, box.double().numpy(), 96, 128)[0].astype(int).T
        mask[np.clip(rows, 0, 95), np.clip(columns, 0, 127)] = 255
    given = torch.zeros(3, 2), torch.zeros(3, 2, 8, 3), bank
    # What cannot have taken them counts for nothing.
    matrices = torch.tensor(np.stack([camera.projection, Camera(45, 90).projection])).float()
    views = Views(torch.tensor([[1.0, 0.0]]).expand(3, 2), matrices.expand(3, 2, 3, 4))
    found = consensus_logits(*given, masks, views)
    assert found.argmax(1)[:2].tolist() == [0, 1]
    torch.testing.assert_close(found[2], consensus_logits(*given)[2])
    assert consensus_logits(*given, masks)[:2].std() < 1e-3, "no camera, no outline"
