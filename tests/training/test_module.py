from functools import partial

import pytest
import torch

from ffd_lightning.losses.objective import Objective, WeightedTerm
from ffd_lightning.losses.terms import chamfer
from ffd_lightning.nn.encoders.mobilenet import MobileNetV1
from ffd_lightning.nn.network import TemplateFfdNetwork
from ffd_lightning.training.module import FfdModule


@pytest.mark.parametrize("rate", [1.0, 0.25])
def test_weights_of_the_offset_layer_have_a_rate_of_their_own(rate):
    network = TemplateFfdNetwork(MobileNetV1(0.05), (32, 32), 3, 8)
    module = FfdModule(
        network,
        Objective({"chamfer": WeightedTerm(chamfer)}),
        optimizer=partial(torch.optim.SGD, lr=0.5),
        offset_rate=rate,
    )
    before = {name: weights.detach().clone() for name, weights in network.named_parameters()}
    optimizer = module.configure_optimizers()["optimizer"]
    sum(weights.sum() for weights in network.parameters()).backward()
    optimizer.step()
    for name, weights in network.named_parameters():
        step = 0.5 * rate if name == "heads.offsets.weight" else 0.5
        torch.testing.assert_close(before[name] - weights.detach(), torch.full_like(weights, step))
