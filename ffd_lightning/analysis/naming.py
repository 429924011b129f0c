"""How settings and runs are named, and which colours they have, in tables, plots and pages."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import PurePath
from typing import Any

import matplotlib
import numpy as np
import pandas as pd

from ffd_lightning.palette import COLORS, REGIME_COLORS, regime_title

SETTING = ["regime", "templates", "variant"]
"""Columns that make a setting of training: a run is one on a category, with a seed."""

GROUP = ["category", *SETTING]
"""Columns that runs have in common which are seeds of each other."""

_WORDS: dict[str, Callable[[Any], str]]
_WORDS = {"templates": "T = {}".format, "seed": "seed {}".format}


def differing(table: pd.DataFrame, columns: Sequence[str] = tuple(SETTING)) -> list[str]:
    """Return those columns that do not have one value in all rows."""
    return [name for name in columns if name in table and table[name].nunique() > 1]


def own_names(names: pd.Series, category: str) -> pd.Series:
    """Return ids of shapes or templates without the category that joint runs put before them.

    A category of other data is called `<category> (<settings>)`.
    """
    return names.str.removeprefix(f"{category.partition(' (')[0]}/")


def name_of(row: Mapping[Any, Any], columns: Sequence[str], long: bool = True) -> str:
    """Return the name that values of columns make; regimes have their long names.

    >>> name_of({"regime": "w", "templates": 16, "variant": ""}, SETTING)
    'w, log-weighted, T = 16'
    """
    words = _WORDS | ({"regime": regime_title} if long else {})
    return ", ".join(words.get(name, str)(row[name]) for name in columns if str(row[name]))


def setting_text(value: Any) -> str:
    """Return a setting's value as it is compared and read: numbers alike, whatever their type.

    >>> setting_text(10000.0), setting_text(1e-4), setting_text([45.0]), setting_text(None)
    ('10000', '0.0001', '[45]', 'null')
    """
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(setting_text, value))}]"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {setting_text(each)}' for key, each in value.items())}}}"
    if isinstance(value, (str, bool, np.bool_)):
        return value if isinstance(value, str) else str(bool(value)).lower()
    return "null" if value is None or pd.isna(value) else f"{value:.10g}"


def variants(runs: pd.DataFrame, settings: pd.DataFrame) -> pd.Series:
    """Return for each run what else tells its setting apart: "schedule.steps=300", say.

    Values that most settings of the same regime and number of templates have, or else most of all,
    are left out: "common settings" where that leaves none. "" where regime and templates tell it;
    the run's name where runs have all in common.

    Args:
        runs: `run`, `category`, `regime`, `templates` and `seed`.
        settings: of each run (index) what decides it but for these, as text.
    """
    found, common = pd.Series("", runs.index), _usual(settings)
    for _, part in runs.groupby(["regime", "templates"], dropna=False):
        values, chosen = settings.loc[part["run"]], list[str]()
        usual = common | _usual(values)
        # With the usual setting among them: a run is told from it, too, by what is its own.
        rows = pd.concat([values, pd.DataFrame([usual])])
        keys = [key for key in values if values[key].nunique() > 1]
        # Another component says more than the settings that come with it.
        for key in sorted(keys, key=lambda k: (-values[k].nunique(), not k.endswith(".name"))):
            before = len(rows[chosen].drop_duplicates()) if chosen else 1
            if len(rows[[*chosen, key]].drop_duplicates()) > before:
                chosen.append(key)
        if chosen:
            told = (_told(values[key], usual.get(key)) for key in chosen)
            words = (", ".join(filter(None, row)) for row in zip(*told, strict=True))
            found[part.index] = [row or "common settings" for row in words]
    same = runs.assign(variant=found)
    twice = same.duplicated([*GROUP, "seed"])
    if twice.any():
        alike = same.set_index(GROUP).index.isin(same[twice].set_index(GROUP).index)
        found[alike] = found[alike].map(lambda x: f"{x}, " if x else "") + runs["run"]
    return found


def _usual(settings: pd.DataFrame) -> dict[str, str]:
    """Return the values that more than half of the settings have, by key."""
    distinct = settings.drop_duplicates()
    counts = {key: distinct[key].value_counts() for key in distinct}
    return {key: str(n.index[0]) for key, n in counts.items() if 2 * n.max() > len(distinct)}


def _told(values: pd.Series, usual: str | None) -> list[str]:
    """Return "key=value" of each run, "" for the usual value.

    Files are told without their folders, where that does not make them equal.
    """
    names = values.map(lambda value: PurePath(value).name if value.startswith("/") else value)
    words = f"{values.name}=" + (names if names.nunique() == values.nunique() else values)
    return list(words.mask(values == usual, ""))


def place(value: Any) -> tuple[int, float, str]:
    """Put regimes in the paper's order, numbers by size, anything else by name."""
    if value in REGIME_COLORS:
        return 0, list(REGIME_COLORS).index(value), ""
    number = isinstance(value, (int, float, np.number))
    return (1, float(value), "") if number else (2, 0.0, str(value))


def sorted_runs(runs: pd.DataFrame) -> pd.DataFrame:
    """Return runs by category, regime (as in the paper), templates and seed."""
    order = ["category", "regime", "templates", "seed"]
    return runs.sort_values(order, key=lambda column: column.map(place), kind="stable")


def run_labels(table: pd.DataFrame) -> dict[str, str]:
    """Return a label for each run of a table, of what differs."""
    runs = _runs(table)
    columns = differing(runs, [*GROUP, "seed"]) or ["regime", "templates"]
    return {str(run): name_of(row, columns) for run, row in runs.to_dict("index").items()}


def setting_labels(table: pd.DataFrame) -> tuple[pd.DataFrame, dict[str, str]]:
    """Return a row per run (index) with `category` and `label`, and the colour of each label.

    A regime has its own colour where each is there once; other settings have colours in order.
    """
    runs = _runs(table)
    columns = differing(runs)
    runs["label"] = [name_of(row, columns or ["regime"]) for row in runs.to_dict("records")]
    firsts = runs.drop_duplicates("label")
    if columns == ["templates"]:
        firsts = firsts.sort_values("templates", kind="stable")
    if firsts["regime"].is_unique:
        of_regime = colors_of(list(firsts["regime"]))
        return runs, dict(zip(firsts["label"], of_regime.values(), strict=True))
    return runs, _scale(list(firsts["label"]))


def _runs(table: pd.DataFrame) -> pd.DataFrame:
    """Return a row per run (index), in order; trained on several, `category` says how many."""
    groups = table.groupby("run", sort=False)
    runs = groups[[name for name in (*SETTING, "seed") if name in table]].first()
    names = groups["category"].unique()
    runs["category"] = [x[0] if len(x) == 1 else f"{len(x)} categories" for x in names]
    return sorted_runs(runs)


def colors_of(names: Sequence[str]) -> dict[str, str]:
    """Return a colour for each name: a regime's own, the others' in order.

    >>> colors_of(["mine", "e"]) == {"mine": "#E69F00", "e": REGIME_COLORS["e"]}
    True
    """
    if len(names) > len(COLORS):
        return _scale(names)
    own = {name: REGIME_COLORS[name] for name in names if name in REGIME_COLORS}
    # Beside regimes those colours first that no regime has.
    order = (*COLORS[len(REGIME_COLORS) :], *COLORS) if own else COLORS
    free = iter(dict.fromkeys(color for color in order if color not in own.values()))
    return {name: own.get(name) or next(free) for name in names}


def _scale(names: Sequence[str]) -> dict[str, str]:
    """Return colours from dark to light; the lightest of viridis would be lost on white."""
    places = np.linspace(0, 0.85, len(names))
    colors = matplotlib.colormaps["viridis"](places)
    return {n: matplotlib.colors.to_hex(c) for n, c in zip(names, colors, strict=True)}
