"""What is minimised: named terms under weights and schedules. A training regime is such a list."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import torch
from jaxtyping import Float, Int
from torch import Tensor, nn

from ffd_lightning.components import check_ranges, typed
from ffd_lightning.errors import ConfigError
from ffd_lightning.geometry.ffd import TemplateSample
from ffd_lightning.losses.selection import Selection, Teaching, WeightedCosts
from ffd_lightning.losses.terms import Prediction, StepInput, Term

Annealing = Literal["constant", "exponential", "linear"]
"""How a term's weight fades."""


@dataclass(frozen=True)
class WeightedTerm:
    r"""One term of the objective, and how its weight fades over the steps b of a training.

    Attributes:
        term: from a step to costs of templates, (q, T), or to a number, ().
        weight: of the term; at 0 it is computed to be looked at, and not minimised.
        annealing: the factor of the weight: `constant`; `exponential`, $e^{-b / b_0}$ (the
            paper's equation 13); or `linear`, $\max(1 - b / b_0, 0)$ (the authors' released
            code; the paper does not use it).
        annealing_steps: b_0.
    """

    term: Term
    weight: float = 1.0
    annealing: Annealing = "constant"
    annealing_steps: float = math.inf

    def __post_init__(self) -> None:
        typed(Annealing, self.annealing, "annealing")
        check_ranges(vars(self), annealing_steps="(0, inf]")

    def weight_at(self, step: int) -> float:
        """Return the weight at a step, counted from 0.

        >>> from ffd_lightning.losses.terms import Chamfer
        >>> fading = WeightedTerm(Chamfer(), 10, "linear", annealing_steps=100)
        >>> [fading.weight_at(step) for step in (0, 25, 100, 101)]
        [10.0, 7.5, 0.0, 0.0]
        """
        if self.annealing == "exponential":
            return self.weight * math.exp(-step / self.annealing_steps)
        if self.annealing == "linear":
            return self.weight * max(1 - step / self.annealing_steps, 0.0)
        return self.weight


class Objective(nn.Module):
    r"""A training regime as a loss.

    $$ \sum_{q,t} w^{(qt)} \sum_k \kappa_k(b) c_k^{(qt)} + \sum_j \kappa_j(b) \lambda_j
              + \lambda_s $$

    Terms c give a cost of every template; the selection turns them into weights w, and may add a
    loss of its own. Terms lambda are one number. The paper's regimes have the Chamfer distance for
    c, f(gamma) for w, and negative entropy and offset penalty for lambda.

    Args:
        terms: by the name that they are logged under. Those that are an `nn.Module` belong to
            the objective, as `term_<name>`, and so does such a selection.
        selection: how template weights are taught.

    Attributes:
        parts: what the last total was made of, in the order of computation, as one number each,
            (): where the total is not finite, the first of these that is not is to blame.

    Source: the paper's equations 7, 12 and 15; weights of its regimes b, w, e, r (Table 2) are in
    `conf/regime`.
    """

    def __init__(
        self, terms: Mapping[str, WeightedTerm], selection: Selection | None = None
    ) -> None:
        super().__init__()
        self.terms = dict(terms)
        self.selection = WeightedCosts() if selection is None else selection
        self.parts: dict[str, Tensor] = {}
        for name, weighted in terms.items():
            if isinstance(weighted.term, nn.Module):
                self.add_module(f"term_{name}", weighted.term)

    def weights(self, step: int) -> dict[str, float]:
        """Return the weight of each term at a step, annealing included."""
        return {name: term.weight_at(step) for name, term in self.terms.items()}

    def forward(
        self,
        prediction: Prediction,
        target_points: Float[Tensor, "queries num_target 3"],
        templates: TemplateSample,
        step: int,
        batch_weights: Float[Tensor, "all_queries templates"] | None = None,
        own_templates: Int[Tensor, "queries own"] | None = None,
        num_queries: int | None = None,
    ) -> tuple[Float[Tensor, ""], dict[str, Tensor]]:
        """Return the total and its named, unweighted terms.

        Sums run over queries, templates and points, as the paper writes them.

        Args:
            prediction: weights (q, T) and offsets (q, T, M, 3).
            target_points: ground truth point clouds, (q, N', 3).
            templates: decomposed template points.
            step: index of the step, for annealing, terms and selection.
            batch_weights: template weights of the whole batch, (Q, T), where its queries are split
                over devices; the prediction's own by default.
            own_templates: the templates of each query's category, (q, K), for selections that
                are `within_category`: the others are not deformed, and cost infinitely much.
            num_queries: of the step, where it is made of several batches; Q by default.

        Returns:
            The total, and without gradients: each term, costs of templates summed under the
            selection's weights; `selection`, if it has a loss of its own; and `chamfer`, the
            distance of each query's selected template, mean over points and queries.

        Raises:
            ConfigError: a term that gives neither (q, T) nor one number, or a selection that gives
                no `Teaching` of the costs.
        """
        every = prediction.template_weights if batch_weights is None else batch_weights
        first, second, third = templates.degrees  # a DataLoader makes a list of them
        templates = templates._replace(degrees=(first, second, third))
        whole = StepInput(
            prediction, target_points, templates, step, every, num_queries or len(every)
        )
        own = own_templates if getattr(self.selection, "within_category", False) else None
        inputs = whole if own is None else _restricted(whole, own)
        values = {name: self._value(name, inputs) for name in self.terms}
        weights = self.weights(step)
        costs = {name: value for name, value in values.items() if value.ndim}
        counted = [weights[name] * costs[name] for name in costs if weights[name]]
        cost = torch.stack(counted).sum(0) if len(counted) > 1 else (counted or [inputs.chamfer])[0]
        teaching = self._teaching(whole, cost.detach(), own)
        total = (teaching.cost_weights * cost).sum() if counted else every.new_zeros(())
        for name, value in values.items():
            if name not in costs and weights[name]:
                total = total + weights[name] * value
        named = {
            name: (teaching.cost_weights * value).sum() if name in costs else value
            for name, value in values.items()
        }
        if teaching.loss is not None:
            total = total + teaching.loss
            named["selection"] = teaching.loss
        with torch.no_grad():
            index = inputs.prediction.template_weights.argmax(1, keepdim=True)
            named["chamfer"] = inputs.chamfer.gather(1, index).mean() / inputs.mean_count
            predicted = prediction.template_logits.sum() + prediction.offsets.sum()
            taught = [part.sum() for part in teaching if part is not None]
            self.parts = {
                "the network's prediction": predicted,
                **{f"the term {k}": weights[k] * v.sum() for k, v in values.items() if weights[k]},
                "the selection": torch.stack(taught).sum(),
                "the sum of all terms": total.detach(),
            }
        return total, {name: term.detach() for name, term in named.items()}

    def _value(self, name: str, inputs: StepInput) -> Tensor:
        value = self.terms[name].term(inputs)
        shape = tuple(inputs.prediction.template_weights.shape)
        if _shape(value) not in ((), shape):
            raise ConfigError(
                f"the term {name} gives {_shape(value)}: a term is a tensor, one number, (), or a "
                f"cost of every template for every query, {shape}"
            )
        return value

    def _teaching(self, inputs: StepInput, costs: Tensor, own: Tensor | None) -> Teaching:
        """Ask the selection, of all templates; return its answer for those that have a cost."""
        if own is not None:
            everywhere = torch.full_like(inputs.prediction.template_weights, torch.inf)
            costs = everywhere.scatter(1, own, costs)
        teaching = self.selection(inputs, costs)
        if not isinstance(teaching, Teaching):
            raise ConfigError(f"the selection gives a {type(teaching).__name__}, not a Teaching")
        weights, loss = _shape(teaching.cost_weights), teaching.loss
        if weights != tuple(costs.shape) or (loss is not None and _shape(loss) != ()):
            raise ConfigError(
                f"the selection gives {weights} for cost_weights and {_shape(loss)} for its loss: "
                f"they are tensors, {tuple(costs.shape)} and () (or None)"
            )
        return teaching if own is None else Teaching(teaching.cost_weights.gather(1, own), loss)


class _Restricted(NamedTuple):
    """A prediction for some templates of each query."""

    template_weights: Float[Tensor, "queries own"]
    template_logits: Float[Tensor, "queries own"]
    offsets: Float[Tensor, "queries own control_points 3"]


def _restricted(inputs: StepInput, own: Tensor) -> StepInput:
    """Return a step with some templates of each query alone."""
    queries = torch.arange(len(own), device=own.device)[:, None]
    found, (matrix, control_points, degrees) = inputs.prediction, inputs.templates
    parts = (found.template_weights, found.template_logits, found.offsets)
    return replace(
        inputs,
        prediction=_Restricted(*(part[queries, own] for part in parts)),
        templates=TemplateSample(matrix[own], control_points[own], degrees),
    )


def _shape(value: object) -> tuple[int, ...] | str:
    """Return the shape of a tensor, the kind of anything else."""
    return tuple(value.shape) if isinstance(value, Tensor) else type(value).__name__
