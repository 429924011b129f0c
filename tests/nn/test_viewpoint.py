import numpy as np
import torch

from ffd_lightning.imaging.camera import Camera
from ffd_lightning.nn.viewpoint import ViewpointHead, likely_views, viewpoint_loss, viewpoints


def seen(cameras):
    """What a trunk might say of cameras, (q, 2) degrees."""
    azimuths = torch.deg2rad(cameras[:, :1])
    return torch.cat([azimuths.sin(), azimuths.cos(), cameras[:, 1:] / 60], dim=1)


def apart(a, b):
    return np.abs((np.asarray(a) - b + 180) % 360 - 180)


def test_a_head_learns_azimuth_and_elevation_and_leaves_its_input_alone():
    torch.manual_seed(0)
    head = ViewpointHead(3)
    optimizer = torch.optim.Adam(head.parameters(), lr=1e-2)
    for _ in range(300):
        cameras = torch.rand(64, 2) * torch.tensor([360.0, 60.0])
        hidden = seen(cameras).requires_grad_()
        loss = viewpoint_loss(head(hidden), cameras)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        assert hidden.grad is None
    cameras = torch.tensor([[0.0, 10], [359, 50], [92, 0], [177, 30], [263, 60]])
    found = [viewpoints(row)[0] for row in head(seen(cameras)).detach()]
    assert apart([v.azimuth for v in found], cameras[:, 0].numpy()).max() < 8
    assert np.abs(np.array([v.elevation for v in found]) - cameras[:, 1].numpy()).max() < 6
    assert min(v.confidence for v in found) > 0.5


def test_of_two_sides_both_are_said_and_their_confidences_are_probabilities():
    logits = torch.full((37,), -9.0)
    logits[[0, 35]] = 2.0  # between 350 and 0 degrees
    logits[18] = 2.0
    logits[36] = 0.5
    first, second = viewpoints(logits)
    assert apart(first.azimuth, 355) < 1
    assert apart(second.azimuth, 180) < 1
    np.testing.assert_allclose([first.confidence, second.confidence], [2 / 3, 1 / 3], atol=0.01)
    assert first.elevation == second.elevation == 15


def test_likely_views_are_cameras_that_frame_a_shape():
    found = torch.randn(2, 37)
    probs, matrices = likely_views(found)
    bins = found[:, :36].softmax(1)
    torch.testing.assert_close(probs[:, 0], bins[:, [35, 0, 1]].sum(1))
    torch.testing.assert_close(probs[:, 11], bins[:, 32:35].sum(1))
    for row in range(2):
        for k in (0, 5, 11):
            camera = Camera(30.0 * k, 30 * float(found[row, 36]))
            np.testing.assert_allclose(matrices[row, k].numpy(), camera.projection, atol=2e-3)
