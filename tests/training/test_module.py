from functools import partial

import pytest
import torch
from lightning import Trainer

from ffd_lightning.app.build import build_data, build_network, regime
from ffd_lightning.losses.objective import Objective, WeightedTerm
from ffd_lightning.losses.terms import Chamfer
from ffd_lightning.nn.encoders.mobilenet import MobileNetV1
from ffd_lightning.nn.network import TemplateFfdNetwork
from ffd_lightning.training.module import FfdModule


def test_weights_of_the_offset_layer_have_a_rate_of_their_own():
    network = TemplateFfdNetwork(MobileNetV1(0.05), (32, 32), 3, 8)
    module = FfdModule(
        network,
        Objective({"chamfer": WeightedTerm(Chamfer())}),
        optimizer=partial(torch.optim.SGD, lr=0.5),
        offset_rate=0.25,
    )
    before = {name: weights.detach().clone() for name, weights in network.named_parameters()}
    optimizer = module.configure_optimizers()["optimizer"]
    sum(weights.sum() for weights in network.parameters()).backward()
    optimizer.step()
    for name, weights in network.named_parameters():
        step = 0.125 if name == "heads.offsets.weight" else 0.5
        torch.testing.assert_close(before[name] - weights.detach(), torch.full_like(weights, step))


def train(devices, cfg):
    """Train a few steps and return the weights."""
    torch.manual_seed(0)
    objective = regime("e", "terms.offset_penalty.weight=1", annealing_steps=3)
    module = FfdModule(build_network(cfg), objective)
    Trainer(
        accelerator="cpu",
        devices=devices,
        strategy="auto" if devices == 1 else "ddp_spawn",
        precision="64-true",  # Adam makes of a gradient's rounding a whole step
        max_steps=3,
        limit_val_batches=0,
        logger=False,
        enable_checkpointing=False,
        enable_progress_bar=False,
        enable_model_summary=False,
    ).fit(module, datamodule=build_data(cfg))
    return {name: value.double() for name, value in module.state_dict().items()}


@pytest.mark.filterwarnings("ignore")
def test_two_devices_train_what_one_does(prepared, tiny_config):
    """Batch norm, the entropy of the batch and augmentation included."""
    cfg = tiny_config("schedule.batch_size=8", "augmentation=photo")
    one, two = train(1, cfg), train(2, cfg)
    for name, value in one.items():
        # Lightning brings the weights of the other process back in float32.
        assert (value - two[name]).abs().max() <= 2e-7 * value.abs().max(), name
