import math
from typing import NamedTuple

import pytest
import torch

from ffd_lightning.app.build import regime
from ffd_lightning.errors import ConfigError
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.ffd import TemplateSample, deform
from ffd_lightning.losses.objective import Objective, WeightedTerm
from ffd_lightning.losses.selection import PosteriorTaught, Teaching, WeightedCosts
from ffd_lightning.losses.terms import Chamfer, MeanChamfer, StepInput


class Prediction(NamedTuple):
    template_weights: torch.Tensor
    offsets: torch.Tensor
    template_logits: torch.Tensor


Q, T, N, M = 3, 2, 6, 8


def make_case(dtype, templates=T):
    g = torch.Generator().manual_seed(0)

    def rand(*shape):
        return torch.rand(*shape, generator=g, dtype=dtype)

    prediction = Prediction(
        rand(Q, templates).softmax(1).requires_grad_(),
        (rand(Q, templates, M, 3) - 0.5).requires_grad_(),
        rand(Q, templates).requires_grad_(),
    )
    matrix = rand(templates, N, M).softmax(-1)
    return prediction, rand(Q, N, 3), TemplateSample(matrix, rand(templates, M, 3), (1, 1, 1))


@pytest.fixture
def case():
    return make_case(torch.float64)


KAPPA = {"b": (0, 0), "w": (0, 0), "e": (100, 0), "r": (0, 1)}
"""The paper's Table 2: kappa_e0 and kappa_r0."""


def by_the_paper(name, case, step, annealing_steps):
    """The paper's loss, written down as it stands there."""
    (gamma, offsets, _), target, (matrix, control, _) = case
    points = deform(matrix, control, offsets)
    weights = -torch.log1p(-gamma) if name == "w" else gamma
    total = (weights * chamfer_distance(points, target[:, None])).sum()
    kappa_e, kappa_r = KAPPA[name]
    fade = math.exp(-step / annealing_steps)
    if kappa_e:
        mean = gamma.mean(0)
        total = total + kappa_e * fade * torch.xlogy(mean, mean).sum()
    if kappa_r:
        total = total + kappa_r * fade * (gamma * offsets.square().sum((-1, -2))).sum()
    return total


@pytest.mark.parametrize("name", KAPPA)
@pytest.mark.parametrize("step", [0, 1234])
def test_the_regimes_of_the_paper_are_its_formula_bit_for_bit(name, step):
    results = []
    for loss in (
        lambda case: regime(name, annealing_steps=5000)(*case, step)[0],
        lambda case: by_the_paper(name, case, step, 5000),
    ):
        case = make_case(torch.float32)
        total = loss(case)
        total.backward()
        results.append((total, case[0].template_weights.grad, case[0].offsets.grad))
    ours, theirs = results
    assert all(torch.equal(a, b) for a, b in zip(ours, theirs, strict=True))


def squares(inputs):
    """A cost of every template."""
    return inputs.prediction.offsets.square().sum((-1, -2))


def mean_offset(inputs):
    """A number for the batch, which depends on the step."""
    return inputs.prediction.offsets.mean() * (1 + inputs.step)


def cross_entropy(inputs, costs):
    """Teaches the cheapest template, and counts costs by powers of the weights, by the step."""
    assert not costs.requires_grad, "gradients go through the teaching alone"
    loss = torch.nn.functional.cross_entropy(inputs.prediction.template_logits, costs.argmin(1))
    return Teaching(inputs.prediction.template_weights ** (inputs.step / 2), loss)


def test_terms_and_selection_of_ones_own(case):
    terms = {
        "distance": WeightedTerm(Chamfer(), 0.5),
        "squares": WeightedTerm(squares, 3.0, "linear", 5),
        "mean": WeightedTerm(mean_offset, 7.0),
    }
    total, logged = Objective(terms, cross_entropy)(*case, 4)
    weights, offsets, logits = (x.detach() for x in case[0])
    _, target, (matrix, control, _) = case
    distance = chamfer_distance(deform(matrix, control, offsets), target[:, None])
    squared = (offsets**2).sum((-1, -2))
    cheapest = (0.5 * distance + 3 * 0.2 * squared).argmin(1, keepdim=True)
    expected = {
        "distance": (weights**2 * distance).sum(),
        "squares": (weights**2 * squared).sum(),
        "mean": 5 * offsets.mean(),
        "selection": -logits.softmax(1).gather(1, cheapest).log().mean(),
        "chamfer": distance.gather(1, weights.argmax(1, keepdim=True)).mean() / N,
    }
    torch.testing.assert_close(logged, expected)
    parts = (0.5 * expected["distance"], 3 * 0.2 * expected["squares"], 7 * expected["mean"])
    torch.testing.assert_close(total.detach(), sum(parts) + expected["selection"])
    assert not any(value.requires_grad for value in logged.values())


def gradients(objective):
    case = make_case(torch.float64)
    objective(*case, 0)[0].backward()
    return case[0].template_weights.grad, case[0].offsets.grad


def broken(inputs):
    """A number whose gradient is not finite."""
    return inputs.prediction.offsets.sum() * math.nan


@pytest.mark.parametrize("term", [squares, mean_offset, broken])
def test_a_term_of_weight_0_is_shown_and_changes_no_gradient(case, term):
    plain = {"distance": WeightedTerm(Chamfer())}
    watched = {**plain, "watched": WeightedTerm(term, 0)}
    pairs = zip(gradients(Objective(plain)), gradients(Objective(watched)), strict=True)
    assert all(torch.equal(a, b) for a, b in pairs)
    assert "watched" in Objective(watched)(*case, 0)[1]
    if term is not broken:
        counted = {**plain, "counted": WeightedTerm(term, 1e-3)}
        assert not torch.equal(gradients(Objective(plain))[1], gradients(Objective(counted))[1])


def test_terms_and_selections_that_give_something_else_are_refused(case):
    plain = WeightedCosts()
    for term, select, words in (
        (lambda _: torch.zeros(Q), plain, r"the term odd gives \(3,\).*\(3, 2\)"),
        (lambda _: None, plain, "the term odd gives NoneType"),
        (Chamfer(), lambda _, costs: costs, "gives a Tensor, not a Teaching"),
        (Chamfer(), lambda _, costs: Teaching(costs.mean(0)), r"gives \(2,\) for cost_weights"),
        (Chamfer(), lambda _, costs: Teaching(costs, costs.mean(1)), r"\(3,\) for its loss"),
        (Chamfer(), lambda _, costs: Teaching(costs, 0.5), "float for its loss"),
    ):
        with pytest.raises(ConfigError, match=words):
            Objective({"odd": WeightedTerm(term)}, select)(*case, 0)


@pytest.mark.parametrize("within", [True, False])
def test_images_deform_the_templates_of_their_own_category_alone(within):
    """Held against each category by itself, where only the logits are of all templates."""
    (weights, offsets, logits), targets, (matrix, control, degrees) = joint = make_case(
        torch.float64, 4
    )
    own = torch.tensor([[0, 2], [1, 3], [1, 3]])
    selection = PosteriorTaught(2.0, 0.5, within_category=within)
    objective = Objective({"mean_chamfer": WeightedTerm(MeanChamfer())}, selection)
    total, terms = objective(*joint, 0, own_templates=own)
    if not within:
        assert torch.equal(total, objective(*joint, 0)[0])
        return
    expected = torch.zeros((), dtype=torch.float64)
    for q, mine in enumerate(own):
        alone = Prediction(weights[q : q + 1, mine], offsets[q : q + 1, mine], logits[:1, mine] * 0)
        sample = TemplateSample(matrix[mine], control[mine], degrees)
        value, logged = objective(alone, targets[q : q + 1], sample, 0)
        expected += value - logged["selection"]
        costs = MeanChamfer()(StepInput(alone, targets[q : q + 1], sample, 0, weights, Q))
        posterior = (-costs / 2).softmax(1)[0]
        expected -= (posterior * logits[q].log_softmax(0)[mine]).sum()
    torch.testing.assert_close(total, expected)
    total.backward()
    others = offsets.grad[0, [1, 3]].abs().sum() + offsets.grad[1:, [0, 2]].abs().sum()
    assert others == 0, "templates of other categories do not learn from an image"
    assert (logits.grad != 0).all(), "the logits of other categories do"
    assert float(terms["chamfer"]) > 0
