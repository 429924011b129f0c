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
from ffd_lightning.losses.terms import (
    Chamfer,
    MeanChamfer,
    NegativeEntropy,
    OffsetPenalty,
    StepInput,
)


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


def naive_chamfer(case):
    """All distances of each template deformed for each query, (Q, T)."""
    prediction, target, (matrix, control, _) = case
    offsets = prediction.offsets.detach()
    found = torch.zeros(Q, T, dtype=torch.float64)
    for q in range(Q):
        for t in range(T):
            points = matrix[t] @ (control[t] + offsets[q, t])
            d = ((points[:, None] - target[q][None]) ** 2).sum(-1)
            found[q, t] = d.min(1).values.sum() + d.min(0).values.sum()
    return found


def paper_objective(function="identity", entropy_weight=0.0, offset_weight=0.0, annealing_steps=5):
    fade = "exponential", annealing_steps
    terms = {
        "weighted_chamfer": WeightedTerm(Chamfer()),
        "negative_entropy": WeightedTerm(NegativeEntropy(), entropy_weight, *fade),
        "offset_penalty": WeightedTerm(OffsetPenalty(), offset_weight, *fade),
    }
    return Objective(terms, WeightedCosts(function))


@pytest.mark.parametrize(
    ("function", "f"), [("identity", lambda g: g), ("log", lambda g: -math.log(1 - g))]
)
@pytest.mark.parametrize(("weights", "step"), [((0, 0), 0), ((100, 0), 7), ((3, 2), 7)])
def test_total_is_the_papers_sum(case, function, f, weights, step):
    total, terms = paper_objective(function, *weights)(*case, step)
    gamma, offsets = (x.detach() for x in case[0][:2])
    distance = naive_chamfer(case)
    parts = dict.fromkeys(("weighted_chamfer", "negative_entropy", "offset_penalty"), 0.0)
    for t in range(T):
        mean = float(gamma[:, t].mean())
        parts["negative_entropy"] += mean * math.log(mean)
        for q in range(Q):
            parts["weighted_chamfer"] += f(float(gamma[q, t])) * float(distance[q, t])
            parts["offset_penalty"] += float(gamma[q, t] * (offsets[q, t] ** 2).sum())
    factors = (1, *(math.exp(-step / 5) * weight for weight in weights))
    expected = sum(k * part for k, part in zip(factors, parts.values(), strict=True))
    assert float(total.detach()) == pytest.approx(expected, rel=1e-9)
    best = gamma.argmax(1)
    parts["chamfer"] = float(distance[torch.arange(Q), best].mean()) / N
    assert {name: float(term) for name, term in terms.items()} == pytest.approx(parts, rel=1e-9)


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


def test_a_regime_may_be_changed(case):
    plain, _ = regime("b")(*case, 0)
    changed, terms = regime("b", "terms.offset_penalty.weight=2")(*case, 0)
    torch.testing.assert_close(changed, plain + 2 * terms["offset_penalty"])


# --- terms and selections of one's own -----------------------------------------------------------


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


def test_terms_and_selection_of_ones_own_against_loops(case):
    terms = {
        "distance": WeightedTerm(Chamfer(), 0.5),
        "squares": WeightedTerm(squares, 3.0, "linear", 5),
        "mean": WeightedTerm(mean_offset, 7.0),
    }
    total, shown = Objective(terms, cross_entropy)(*case, 4)
    weights, offsets, logits = (x.detach() for x in case[0])
    distance = naive_chamfer(case)
    expected = dict.fromkeys(("distance", "squares", "selection"), 0.0)
    expected["mean"] = 5 * float(offsets.mean())
    for q in range(Q):
        cost = [
            0.5 * float(distance[q, t]) + 3 * 0.2 * float((offsets[q, t] ** 2).sum())
            for t in range(T)
        ]
        exponentials = [math.exp(logit) for logit in logits[q].tolist()]
        cheapest = exponentials[cost.index(min(cost))]
        expected["selection"] -= math.log(cheapest / sum(exponentials)) / Q
        for t in range(T):
            expected["distance"] += float(weights[q, t] ** 2 * distance[q, t])
            expected["squares"] += float(weights[q, t] ** 2 * (offsets[q, t] ** 2).sum())
    best = distance[torch.arange(Q), weights.argmax(1)]
    expected["chamfer"] = float(best.mean()) / N
    assert {name: float(value) for name, value in shown.items()} == pytest.approx(expected)
    parts = (0.5 * expected["distance"], 3 * 0.2 * expected["squares"], 7 * expected["mean"])
    assert float(total.detach()) == pytest.approx(sum(parts) + expected["selection"])
    assert not any(value.requires_grad for value in shown.values())


def test_a_selection_sees_weighted_costs_and_where_none_has_a_weight_plain_ones(case):
    seen = []

    def watch(inputs, costs):
        seen.append(costs)
        return Teaching(inputs.prediction.template_weights)

    for weight in (0.25, 0):
        Objective({"distance": WeightedTerm(Chamfer(), weight)}, watch)(*case, 0)
    torch.testing.assert_close(seen[0], naive_chamfer(case) / 4)
    torch.testing.assert_close(seen[1], naive_chamfer(case))


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


def test_gradients_reach_weights_and_offsets(case):
    prediction, target, templates = case
    objective = paper_objective("log", 2.0, 0.5, 10)

    def f(weights, offsets):
        own = Prediction(weights, offsets, prediction.template_logits)
        return objective(own, target, templates, 3)[0]

    assert torch.autograd.gradcheck(f, tuple(prediction[:2]))


def refused(*terms, selection=WeightedCosts()):  # noqa: B008
    objective = Objective({f"t{k}": WeightedTerm(term) for k, term in enumerate(terms)}, selection)
    with pytest.raises(ConfigError) as caught:
        objective(*make_case(torch.float64), 0)
    return str(caught.value)


def test_terms_and_selections_that_give_something_else_are_refused():
    assert "the term t0 gives (3,)" in refused(lambda _: torch.zeros(Q))
    assert "the term t0 gives NoneType" in refused(lambda _: None)
    for select, words in (
        (lambda _, costs: costs, "gives a Tensor, not a Teaching"),
        (lambda _, costs: Teaching(costs.mean(0)), "gives (2,) for cost_weights"),
        (lambda _, costs: Teaching(costs, costs.mean(1)), "gives (3,) for its loss"),
        (lambda _, costs: Teaching(costs, 0.5), "gives float for its loss"),
    ):
        assert words in refused(Chamfer(), selection=select)


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
        value, shown = objective(alone, targets[q : q + 1], sample, 0)
        expected += value - shown["selection"]
        costs = MeanChamfer()(StepInput(alone, targets[q : q + 1], sample, 0, weights, Q))
        posterior = (-costs / 2).softmax(1)[0]
        expected -= (posterior * logits[q].log_softmax(0)[mine]).sum()
    torch.testing.assert_close(total, expected)
    total.backward()
    others = offsets.grad[0, [1, 3]].abs().sum() + offsets.grad[1:, [0, 2]].abs().sum()
    assert others == 0, "templates of other categories do not learn from an image"
    assert (logits.grad != 0).all(), "the logits of other categories do"
    assert float(terms["chamfer"]) > 0
