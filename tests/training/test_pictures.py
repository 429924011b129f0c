import torch

from ffd_lightning.training.pictures import distance_colors


def test_colors_tell_the_distance_to_the_other_cloud():
    a = torch.tensor([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    b = torch.tensor([[0.0, 0, 0], [1, 0.025, 0], [2, 0.3, 0], [2, 0.6, 0]])
    first, second = distance_colors(a, b)
    assert first.shape == (3, 3)
    assert (first[0] == second[0]).all()  # together
    assert (first[1] == second[1]).all()  # halfway
    assert (first[2] == second[3]).all()  # far and farther
    assert first[0].argmax() == 2, "blue"
    assert first[2].argmax() == 0, "orange"
    brightness = first.astype(float) @ [0.299, 0.587, 0.114]
    assert brightness[0] + 40 < brightness[1] < brightness[2] - 40, "also without colours"
