"""Discs and bars: what is like what is known by construction."""

import numpy as np
import pytest
import torch

from ffd_lightning.imaging.appearance import TrainingAppearance, silhouette
from ffd_lightning.imaging.camera import Camera


def drawn(covered, ink=0):
    rgb = np.where(covered, ink, 255).astype(np.uint8)
    return np.dstack([rgb, rgb, rgb, 255 * covered.astype(np.uint8)])


def ellipse(high, wide, y=24, x=32, ink=0):
    rows, columns = np.mgrid[:48, :64]
    return drawn(((rows - y) / high) ** 2 + ((columns - x) / wide) ** 2 < 1, ink)


def ellipses(count):
    return [ellipse(14 + k % 6, 12 + k // 6) for k in range(count)]


def bar(high, wide):
    covered = np.zeros((48, 64), bool)
    covered[24 - high : 24 + high, 32 - wide : 32 + wide] = True
    return drawn(covered)


def test_silhouettes_do_not_depend_on_place_size_or_colour():
    expected = silhouette(ellipse(20, 10)).astype(int)
    assert expected.sum() / 255 == pytest.approx(np.pi / 8 * (16 / 1.06) ** 2, rel=0.05)
    for same in (ellipse(20, 10, x=45), ellipse(10, 5, y=12), ellipse(20, 10, ink=250)):
        assert np.abs(silhouette(same) - expected).mean() < 6
    assert np.abs(silhouette(ellipse(10, 20)) - expected).mean() > 40
    assert not silhouette(drawn(np.zeros((48, 64), bool))).any()


def test_images_of_other_outlines_are_told_from_those_of_training():
    appearance = TrainingAppearance.of(ellipses(48), [Camera(45, 30)] * 48)
    assert appearance.strangeness(ellipse(16, 14)) == 0
    assert appearance.strangeness(ellipse(13, 11, x=20)) < 0.5
    for other in (bar(3, 28), bar(20, 2), np.zeros((48, 64, 4), np.uint8)):
        assert appearance.strangeness(other) > 1
    few = TrainingAppearance.of(ellipses(4))
    assert few.strangeness(bar(3, 28)) == 0


def test_how_large_objects_are_is_their_median():
    sizes = [TrainingAppearance.of([ellipse(h, 5) for h in hs]).fill for hs in ([12], [6, 12, 18])]
    assert sizes == pytest.approx([23 / 48, 23 / 48], abs=0.05)


def test_it_comes_back_from_a_checkpoint(tmp_path):
    appearance = TrainingAppearance.of(ellipses(48), [Camera(45, 30)] * 48)
    torch.save(appearance.state(), tmp_path / "a.pt")
    again = TrainingAppearance.from_state(torch.load(tmp_path / "a.pt", weights_only=True))
    np.testing.assert_array_equal(again.silhouettes, appearance.silhouettes)
    assert (again.fill, again.usual, again.viewpoints) == (
        appearance.fill, appearance.usual, appearance.viewpoints,
    )  # fmt: skip
    assert again.strangeness(bar(3, 28)) == appearance.strangeness(bar(3, 28)) > 1


def test_that_of_older_checkpoints_has_their_size_and_warns_of_nothing():
    state = {"silhouettes": torch.zeros((9, 192), dtype=torch.uint8), "fill": 0.7, "usual": 300.0}
    old = TrainingAppearance.from_state(state)
    assert (old.fill, old.viewpoints) == (0.7, None)
    assert old.strangeness(bar(3, 28)) == 0
