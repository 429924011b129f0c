"""Which templates each setting selects: bars with their pictures, and all settings in one order."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from ffd_lightning.analysis.report.elements import data_uri
from ffd_lightning.analysis.report.opened import Opened
from ffd_lightning.analysis.report.standing import setting_title
from ffd_lightning.analysis.report.sweep import Sweep
from ffd_lightning.metrics.selection import effective_templates
from ffd_lightning.palette import REGIME_COLORS
from ffd_lightning.run_folder import RunFolder

OTHERS = "others"
"""The column of what is not shown."""

_BARS = 8  # of a setting, the most selected
_COLUMNS = 24  # of the heat map


class Share(NamedTuple):
    """How often a setting selects a template.

    Attributes:
        template: its id, or `OTHERS`.
        value: share of the test samples, mean over seeds; None where there is no such template.
        text: in percent; the texts of a row add up to 100.
    """

    template: str
    value: float | None
    text: str


class Setting(NamedTuple):
    """How a setting selects.

    Attributes:
        title: of the setting; `color` of its regime, "" where it has none.
        effective: number of effective templates, of how many.
        bars: the most selected templates, by their shares.
        heat: shares in the order that all settings have in common.
    """

    title: str
    color: str
    effective: str
    bars: Sequence[Share]
    heat: Sequence[Share]


class Heat(NamedTuple):
    """The settings of a category, and the templates in their common order."""

    category: str
    templates: Sequence[str]
    settings: Sequence[Setting]


def heat_maps(sweep: Sweep) -> list[Heat]:
    """Return how the settings select, a map per category."""
    samples = sweep.samples.merge(sweep.scored[["run", "setup"]], on="run")
    available = {str(run.path): _available(run) for run in sweep.runs}
    found = []
    for category, part in samples.groupby("category", sort=False):
        name = str(category)
        # Trained together with other categories, a template is called <category>/<id>.
        part = part.assign(template=part["template"].str.removeprefix(f"{name}/"))
        own = {run: {i.removeprefix(f"{name}/") for i in ids} for run, ids in available.items()}
        found.append(_heat(sweep, name, part, own))
    return found


def pictures(sweep: Sweep, opened: Opened) -> dict[str, tuple[str, str]]:
    """Return pictures of the templates that are selected: by id their name in the page, and data.

    Templates of joint runs are known by their ids with and without the category.
    """
    wanted = set(sweep.samples.get("template", pd.Series(dtype=str)).astype(str))
    drawn = {
        name: (f"template-{k}", data_uri(picture, "image/png"))
        for k, (name, picture) in enumerate(opened.pictures(wanted).items())
    }
    return {name.rpartition("/")[2]: picture for name, picture in drawn.items()} | drawn


def _available(run: RunFolder) -> set[str]:
    """Return the ids of a run's templates, none where they cannot be read."""
    try:
        return set(pd.read_csv(run.templates, dtype=str)["id"])
    except (OSError, ValueError, KeyError):
        return set()


def _heat(
    sweep: Sweep, category: str, samples: pd.DataFrame, available: Mapping[str, set[str]]
) -> Heat:
    """Return how the settings of one category select."""
    keys = [key for key in sweep.keys if key != "category"]
    counts = samples.groupby(["run", "template"]).size().unstack(fill_value=0)
    shares = counts.div(counts.sum(axis=1), axis=0)
    firsts = samples.drop_duplicates("run").set_index("run")
    means = {
        values: shares.loc[part.index].mean() for values, part in firsts.groupby(keys, sort=False)
    }
    runs = {values: list(part.index) for values, part in firsts.groupby(keys, sort=False)}
    # The most selected first, over settings alike; of equals by id.
    total = sum(means.values()).sort_index()
    order = [str(name) for name in total.sort_values(ascending=False, kind="stable").index]
    never = set().union(*(available.get(str(run), set()) for run in firsts.index)) - set(order)
    order += sorted(never)
    shown = order[:_COLUMNS]
    settings = []
    for values, mean in means.items():
        row = dict(zip(keys, values, strict=True))
        has = set().union(*(available.get(str(run), set()) for run in runs[values]))
        full = {name: float(mean.get(name, 0.0)) for name in order}
        effective = np.mean(
            [effective_templates(c[c > 0]) for c in counts.loc[runs[values]].to_numpy()]
        )
        settings.append(
            Setting(
                setting_title(row, sweep.told_apart_by) or setting_title(row, ["regime"]),
                REGIME_COLORS.get(str(row["regime"]), ""),
                f"{effective:.1f} of {row['templates']}",
                _bars(full),
                _row(full, shown, has, len(order) > len(shown)),
            )
        )
    return Heat(category, [*shown, *([OTHERS] if len(order) > len(shown) else [])], settings)


def _bars(shares: Mapping[str, float]) -> list[Share]:
    """Return the most selected templates, and the others together."""
    names = sorted((n for n in shares if shares[n]), key=lambda n: -shares[n])
    shown, rest = names[:_BARS], sum(shares[n] for n in names[_BARS:])
    values = {n: shares[n] for n in shown} | ({OTHERS: rest} if rest else {})
    return [Share(n, values[n], t) for n, t in zip(values, percents(values.values()), strict=True)]


def _row(
    shares: Mapping[str, float], shown: Sequence[str], has: set[str], cut: bool
) -> list[Share]:
    """Return the shares of templates in a given order; None where a setting has no such one."""
    values = {name: shares[name] for name in shown}
    if cut:
        values[OTHERS] = max(0.0, sum(shares.values()) - sum(values.values()))
    row = []
    for (name, value), text in zip(values.items(), percents(values.values()), strict=True):
        absent = bool(has) and name not in has and name != OTHERS and not value
        row.append(Share(name, None if absent else value, "" if absent or not value else text))
    return row


def percents(shares: Iterable[float]) -> list[str]:
    """Return shares in whole percent that add up to 100, by largest remainders.

    >>> percents([1 / 3, 1 / 3, 1 / 3])
    ['34', '33', '33']
    """
    exact = 100 * np.array(list(shares), float)
    whole = np.floor(exact + 1e-9).astype(int)
    missing = round(float(exact.sum())) - int(whole.sum())
    whole[np.argsort(whole - exact, kind="stable")[:missing]] += 1
    return [str(n) for n in whole]
