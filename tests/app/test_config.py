"""What is composed from `conf/`, and what is said of mistakes in it."""

from itertools import chain

import pytest
import torch
from commands import ROOT, train_config

from ffd_lightning import components
from ffd_lightning.app.build import build_module, build_network, build_objective
from ffd_lightning.app.checks import validate
from ffd_lightning.app.config import GROUPS
from ffd_lightning.app.messages import SHOWN, explain


def test_what_is_given_counts_wherever_it_stands():
    """Before and after an option that has another value; the option has the paper's otherwise."""
    cfg = train_config("network.batch_norm_momentum=0.2", "lr_schedule=cosine", "schedule=paper")
    assert (cfg.network.batch_norm_momentum, cfg.lr_schedule.name) == (0.2, "cosine")


@pytest.mark.parametrize("name", components.names("lr_schedule"))
def test_the_learning_rate_can_be_had_for_any_number_of_steps(name):
    cfg = train_config(f"lr_schedule={name}", "schedule.learning_rate=0.5")
    make = build_module(cfg, build_network(cfg), {}).make_scheduler
    assert (make is None) == (name == "none")
    for steps in range(1, 40) if make else ():
        optimizer = torch.optim.SGD([torch.zeros(1, requires_grad=True)], lr=0.5)
        schedule, rates = make(optimizer, steps), []
        for _ in range(steps):
            rates += schedule.get_last_lr()
            optimizer.step()
            schedule.step()
        assert 0 < min(rates) <= max(rates) <= 0.5
        fall = rates[rates.index(max(rates)) :]
        assert fall == sorted(fall, reverse=True)


def test_the_optimizer_is_chosen_with_its_own_settings_at_the_schedules_rate():
    cfg = train_config("optimizer=sgd", "optimizer.momentum=0.9", "schedule.learning_rate=0.5")
    weights = [torch.nn.Parameter(torch.zeros(1))]
    (group,) = build_module(cfg, build_network(cfg), {}).make_optimizer(weights).param_groups
    assert (group["lr"], group["momentum"]) == (0.5, 0.9)


def test_regimes_combine_and_terms_are_a_group():
    cfg = train_config("regime=e", "regime.terms.offset_penalty.weight=1")
    weights = build_objective(cfg.regime, 10).weights(0)
    assert weights == {"weighted_chamfer": 1, "negative_entropy": 100, "offset_penalty": 1}
    own = ("regime/term=[sliced_wasserstein]", "regime.terms.sliced_wasserstein.points=9")
    cfg = train_config(*own)
    assert list(cfg.regime.terms)[-1] == "sliced_wasserstein"
    assert cfg.regime.terms["sliced_wasserstein"].build().points == 9
    cfg = train_config("+regime.terms.again.term=chamfer", "+regime.terms.again.weight=0.5")
    assert build_objective(cfg.regime, 10).weights(3)["again"] == 0.5


NEEDED = {
    "custom": ["category.name=mug"],
    **{name: ["data.root=."] for name in ("folder", "modelnet", "pix3d", "shapenet")},
    ("split", "listed"): ["split.file=README.md"],
    ("template_strategy", "listed"): ["template_strategy.file=README.md"],
    "ranking": ["template_strategy.file=README.md"],
}


def together(options):
    """Choices of an option of each group, until each was chosen: composing takes long."""
    for number in range(max(map(len, options.values()))):
        yield {group: names[number % len(names)] for group, names in options.items()}


def test_every_option_of_every_group_composes_and_can_be_built():
    groups = ("category", "regime", "templates", "schedule", "trainer", "logger")
    files = {group: [file.stem for file in (ROOT / "conf" / group).iterdir()] for group in groups}
    for chosen in together(files):
        train_config(
            *(f"{group}={name}" for group, name in chosen.items()),
            *NEEDED.get(chosen["category"], []),
        )
    kinds = {place: sorted({*components.names(kind)} - {"timm"}) for place, kind in GROUPS.items()}
    for chosen in together(kinds):  # timm may not be installed
        own = [f"{place.replace('.', '/')}={name}" for place, name in chosen.items()]
        needed = [NEEDED.get(x, NEEDED.get(x[1], [])) for x in chosen.items()]
        validate(train_config(*own, *chain(*needed), "encoder.weights=none"))


MISTAKES = [
    # groups and options
    (["category=tabel"], ["no category 'tabel'. Did you mean category=table?", "watercraft"]),
    (["+regime.terms.mine.term=chamfre"], ["no term 'chamfre'. Did you mean chamfer?"]),
    (["regime/term=[chamfre]"], ["no regime/term 'chamfre'. Did you mean", "uniform_penalty"]),
    # settings
    (["schdule=quick"], ["no setting 'schdule'. Did you mean schedule?"]),
    (["data.parts_root=."], ["no setting 'data.parts_root'", "num_models"]),  # of another option
    (["data=folder"], ["must be given: data.root=..."]),
    (["data.residency=disk"], ["data.residency", "is trainer.residency now"]),  # of 0.2
    # values
    (["schedule.steps=abc"], ["schedule.steps=abc must be a whole number"]),
    (["encoder.width=0"], ["encoder.width=0 leaves no channels"]),
    (["data.render.azimuths=[]"], ["data.render.azimuths=[] needs an angle"]),
    (["category=[chair,table]"], ["-m category=chair,table", "category.members=[chair,table]"]),
    # what does not go together
    (["templates=t1", "regime=w"], ["single template: use another regime"]),
    (
        ["data=shapenet", "data.root=.", "data.images=r2n2", "data.render.azimuths=[0]"],
        ["azimuths means nothing here, as data=shapenet has images", "azimuths=[45.0]"],
    ),
    (["trainer=cpu", "trainer.devices=0"], ["trainer: ", "devices"]),
    (["trainer=cpu", "trainer.devices=3"], ["schedule.batch_size=32", "over 3 devices"]),
    (["trainer=cpu", "trainer.devices=2", "schedule.batch_size=2"], ["two images or more each"]),
    # spelling of the command line
    (["split.file={category}.json"], ["""'split.file="{category}.json"'"""]),
]


@pytest.mark.parametrize(("overrides", "words"), MISTAKES, ids=lambda x: x[0])
def test_a_mistake_is_explained_in_one_line(overrides, words):
    with pytest.raises(SHOWN) as caught:
        validate(train_config(*overrides))
    message = explain(caught.value)
    assert "\n" not in message
    assert [word for word in words if word not in message] == [], message
