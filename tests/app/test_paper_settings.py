"""What the paper trained with, held against the configuration."""

import pytest
import yaml

from ffd_lightning.analysis.paper_settings import compared_settings, paper_settings
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.configuration import compose_config, typed_config
from ffd_lightning.app.identity import identity, to_yaml
from ffd_lightning.data.categories import paper_templates

# Decide a run, and mean nothing for the comparison: names, seeds, places, what is written down for
# other runs; and what comes of the others is compared: the images' source, and the templates' ids.
NOT_COMPARED = {
    "seed",
    "category.name",
    "regime.name",
    "templates.name",
    "schedule.name",
    "data.root",
    "data.images_root",
    "data.parts_root",
    "data.images",
    "template_strategy.name",
    "template_ranking.subset",
    "template_ranking.all_views",
}
# Where our preset for the paper is not as the paper.
OURS = {
    "data.render.camera": "framed",
    "data.render.elevation": 30.0,
    "data.render.samples": 3,
    "split.name": "auto",
    "split.val_fraction": 0.1,
}


@pytest.fixture(scope="module", params="bwer")
def config(request):
    weights = paper_settings().settings["encoder.weights"]
    return typed_config(
        compose_config(
            "train",
            TrainConfig,
            [
                *("category=table", f"regime={request.param}", "schedule=paper", "templates=t30"),
                *("data=shapenet", "data.root=.", f"encoder.weights=/somewhere/{weights}"),
            ],
        ),
        TrainConfig,
    )


def flat(node, prefix=""):
    for key, value in node.items():
        if isinstance(value, dict) and value:
            yield from flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}"


def test_every_setting_is_compared_or_exempt_for_a_reason(config):
    paper, decides = paper_settings(), set(identity(config))
    regime = {key for key in decides if key.startswith("regime.") and key != "regime.name"}
    compared = decides - NOT_COMPARED - regime
    missing = compared ^ set(paper.settings)
    assert not missing, f"analysis/paper_settings.yaml: {missing}"
    assert not {key for key in compared | regime if paper.is_exempt(key)}
    others = set(flat(yaml.safe_load(to_yaml(config)))) - decides
    assert not {key for key in others | NOT_COMPARED if not paper.is_exempt(key)}


def test_nothing_is_exempt_that_there_is_not(config):
    settings = set(flat(yaml.safe_load(to_yaml(config))))
    for name in paper_settings().exempt:
        assert any(key.startswith(name) if name.endswith(".") else key == name for key in settings)


def test_the_packages_of_parts_are_no_settings(config):
    """Their keys hold blanks, and are below a name that is exempt."""
    settings = yaml.safe_load(to_yaml(config))
    assert settings["provided"] == {}
    with_package = settings | {"provided": {"encoder tiny": "own-parts 0.1"}}
    assert compared_settings(with_package) == compared_settings(settings)


def test_our_preset_is_the_papers_but_for_what_is_named_here(config):
    differences = {
        key: ours
        for key, (ours, paper) in compared_settings(yaml.safe_load(to_yaml(config))).items()
        if ours != paper
    }
    assert differences == {
        key: value if isinstance(value, str) else f"{value:g}" for key, value in OURS.items()
    }


def test_what_the_paper_and_its_code_say():
    """The paper's section 4 and Tables 1 and 2, and the authors' code."""
    paper = paper_settings()
    s = paper.settings
    assert (s["data.render.height"], s["data.render.width"]) == (192, 256)
    assert (s["network.bottleneck"], s["network.hidden"], s["encoder.width"]) == (64, 512, 0.25)
    assert (s["schedule.steps"], s["schedule.batch_size"]) == (100_000, 32)
    assert s["data.render.elevation"] == pytest.approx(30.9638, abs=0.005)  # atan(0.6)
    assert s["templates.count"] == len(paper_templates("table"))
    assert {r: v["min_weight"] for r, v in paper.regimes.items()} == {
        "b": 0.1,
        "w": 0.001,
        "e": 0.1,
        "r": 0.1,
    }
    assert paper.regimes["e"]["terms.negative_entropy.weight"] == 100
    assert paper.regimes["r"]["terms.offset_penalty.weight"] == 1
