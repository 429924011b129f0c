"""An evaluation of a few tables, by a network whose outputs follow from images and a seed."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
import torch
from torch import nn

from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.evaluation import references
from ffd_lightning.evaluation.evaluator import EvaluatedNetwork, EvaluationOptions, evaluate
from ffd_lightning.evaluation.protocols import PaperProtocol
from ffd_lightning.evaluation.samples import Subset
from ffd_lightning.nn.network import FfdPrediction


class Network(nn.Module):
    """Outputs and features that follow from the image's colours and a seed."""

    def __init__(self, bank, seed):
        super().__init__()
        shape = (3, len(bank), *bank.control_points.shape[1:])
        drawn = torch.Generator().manual_seed(seed)
        self.offsets = nn.Parameter(0.3 * torch.randn(shape, generator=drawn))
        self.logits = nn.Parameter(40 * torch.randn(shape[:2], generator=drawn))
        self.mixing = nn.Parameter(torch.randn(3, 8, generator=drawn))

    def features(self, images):
        colours = 1 - images.float().mean((2, 3)) / 255
        return torch.cat([colours, colours @ self.mixing], 1)

    def predict(self, features, mask=None):
        colours = features[:, :3]
        weights = (colours @ self.logits).softmax(1)
        offsets = torch.einsum("bc,ctmx->btmx", colours, self.offsets)
        return FfdPrediction(weights, weights, offsets, weights.log())


@dataclass(frozen=True)
class Case:
    """An evaluation of some shapes of a set: templates, training and test shapes by their rows."""

    prepared: Any
    seed: int = 0  # of the network
    templates: tuple = (0, 1)
    trained_on: tuple = (2, 3, 4, 5)
    tested_on: tuple = (6, 7, 8)
    bank: dict = field(default_factory=dict)
    protocol: Any = field(default_factory=lambda: PaperProtocol(points=24))
    options: dict = field(default_factory=dict)

    @property
    def evaluated(self):
        """What is evaluated."""
        ids = [self.prepared.ids[row] for row in self.templates]
        bank = TemplateBank.of(self.prepared, ids, **{"max_edge": 0.2, **self.bank})
        rows = (np.array(x, np.int64) for x in (self.trained_on, self.tested_on))
        subsets = [Subset(self.prepared, x) for x in rows]
        return EvaluatedNetwork(Network(bank, self.seed), bank, *subsets, step=0)

    def run(self, folder, shared=None, **more):
        """Evaluate into a folder, and return the text of `samples.csv`."""
        settings = {"progress": False, "shared": shared, **self.options, **more}
        evaluate(self.evaluated, self.protocol, folder, EvaluationOptions(**settings))
        return (folder / "samples.csv").read_text()


@pytest.fixture
def case(prepared):
    """Return a function from what is otherwise to an evaluation."""
    return lambda **settings: Case(settings.pop("prepared", prepared), **settings)


@pytest.fixture
def fits(monkeypatch):
    """What was fitted, a list that grows; fits are quick and bad, of the same arguments."""
    made = []

    def fit(bank, cloud, seed):
        made.append(seed)
        generator = torch.Generator().manual_seed(seed)
        offsets = cloud.std() * torch.randn(bank.control_points.shape[1:], generator=generator)
        return 1, (0.1 * offsets).numpy()

    monkeypatch.setattr(references, "fitted_template", fit)
    return made


@pytest.fixture(scope="session")
def bank(prepared):
    """Two templates of the tiny set."""
    return TemplateBank.of(prepared, prepared.ids[:2])
