"""Results of runs: what every table, plot, page, notebook and finding starts from."""

from __future__ import annotations

import io
import json
import re
import shlex
import zipfile
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from os.path import commonpath, relpath
from pathlib import Path, PurePath
from typing import Any

import numpy as np
import pandas as pd

from ffd_lightning.analysis.naming import GROUP, SETTING, setting_text, sorted_runs, variants
from ffd_lightning.analysis.status import run_status
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.protocols import ProtocolDescription
from ffd_lightning.files import read_json
from ffd_lightning.metrics.selection import effective_templates
from ffd_lightning.run_folder import RunFolder, decides, find_runs

_KEYS = {
    "category": "category.name",
    "regime": "regime.name",
    "templates": "templates.count",
    "seed": "seed",
}  # columns of tables, and the settings that they hold
_HOW = ("format", "protocol", "all_views", "seed")  # in `summary.json`: decide scores, with weights
CURVE = ["run", "step", "box_chamfer", "effective_templates"]
"""Columns of curves of validation."""

Families = Mapping[str, Mapping[str, str]]
"""Of each run, `<category>/<structural family>` of templates it could select (kept: selects)."""


@dataclass(frozen=True)
class Results:
    """Results of runs under one protocol.

    Attributes:
        samples: a row per test image and finished run: `run`, `regime`, `templates`, `variant`,
            `seed`, and the columns of `samples.csv`: `id`, `category` (the shape's), `family`,
            `view`, `template`, `weight` and every measure of every shape.
        runs: a row per run, sorted: `run` (its path below `folder`), `category`, `regime`,
            `templates`, `seed`, `variant` (what else tells its setting from others), `state` (as
            in `status.run_status`, or damaged), `reason` (of having no scores, else "") and
            `seconds_per_step`. Runs that share `naming.GROUP` are seeds of each other.
        settings: of runs that are not damaged (index `run`), by their names on the command line.
        protocol: that the scores are of.
        families: of runs where they are known.
        curves: of validation, in kept results alone: `run`, `step`, `box_chamfer` (x 1000) and
            `effective_templates`.
        about: what was written with kept results, such as machine and commands; one for each file.
        folder: that the runs are in, unless they are kept results.
    """

    samples: pd.DataFrame
    runs: pd.DataFrame
    settings: pd.DataFrame
    protocol: ProtocolDescription
    families: Families
    curves: pd.DataFrame
    about: Sequence[Mapping[str, Any]] = ()
    folder: Path = Path()

    @classmethod
    def read(cls, folder: str | Path, protocol: str | None = None) -> Results:
        """Read all runs at any depth below a folder, or kept results (docs/findings/data/*.zip).

        Args:
            folder: or the file.
            protocol: the name of the results; by default that which most trainings ended with.

        Raises:
            DataError: no run, no such file, or none was evaluated under the protocol that is named.
        """
        folder = Path(folder)
        if folder.suffix == ".zip":
            return _read_kept(folder)
        results = cls.of(find_runs(folder), protocol, folder)
        if protocol is not None:
            results.check_scored()
        return results

    @classmethod
    def of(
        cls, runs: Sequence[RunFolder], protocol: str | None = None, folder: Path | None = None
    ) -> Results:
        """Read some runs as `read` does, named as seen from `folder`, by default what all are in.

        `protocol` may be `paper/val`, where a search ends with the validation shapes.
        """
        folder = folder or Path(commonpath([run.path for run in runs]) if runs else ".")
        known, settings, damaged = _read_settings(runs, folder)
        table = settings[list(_KEYS.values())].set_axis(list(_KEYS), axis=1).reset_index()
        statuses = pd.DataFrame([run_status(run) for run in known.values()])
        table[["state", "reason"]] = statuses[["state", "reason"]]
        # Settings that could not be run would make others of all the rest.
        begun = table[table["state"] != "failed"]
        table["variant"] = variants(begun, deciding_settings(settings.loc[begun["run"]]))
        table = table.fillna({"variant": ""})
        summaries = [run.status.get("summary") or {} for run in known.values()]
        table["seconds_per_step"] = [x.get("seconds_per_step", np.nan) for x in summaries]
        table = sorted_runs(table).reset_index(drop=True)
        protocol = protocol or Counter(map(own_protocol, known.values())).most_common(1)[0][0]
        described = {name: described_protocol(run, protocol) for name, run in known.items()}
        usual = Counter(filter(None, described.values())).most_common(1)
        chosen = usual[0][0] if usual else ProtocolDescription(protocol)
        scores: dict[str, pd.DataFrame] = {}
        for place, (run, state) in enumerate(zip(table["run"], table["state"], strict=True)):
            try:
                _check_scores(known[run], state, described[run], chosen)
                scores[run] = read_samples(known[run], chosen)
            except DataError as error:
                if state != "failed":
                    table.loc[place, "reason"] = str(error)
        nothing = pd.DataFrame(columns=["id", "category", "family", "view", "template"])
        samples = pd.concat(scores or {"": nothing}, names=["run"])
        # Copied: in one block each kind of column, of which pandas would warn otherwise.
        samples = table[["run", *SETTING, "seed"]].merge(samples, on="run").copy()
        other = _of_other_data(samples, settings, known)
        for part in (samples, table):
            part["category"] += part["run"].map(other).fillna("")
        families = {
            name: found
            for name, run in known.items()
            if (found := _families(run, other.get(name, "")))
        }
        table = pd.concat([table, pd.DataFrame(damaged)], ignore_index=True)
        curves = pd.DataFrame(columns=CURVE)
        return cls(samples, table, settings, chosen, families, curves, folder=folder)

    @cached_property
    def scored(self) -> pd.DataFrame:
        """The runs that have scores, with means over test images, `num_samples` of them.

        And `effective_templates`.
        """
        groups = self.samples.groupby("run", sort=False)
        means = groups.mean(numeric_only=True).drop(
            columns=["templates", "seed", "twin"], errors="ignore"
        )
        if "twin" in self.samples:
            others = self.samples[self.samples["twin"].ne(True)].groupby("run", sort=False)
            names = [metric.name for metric in self.protocol.metrics]
            means = means.join(others[names].mean().add_prefix("without_twins_"))
        means["effective_templates"] = [
            effective_templates(part["template"].value_counts()) for _, part in groups
        ]
        means["num_samples"] = groups.size()
        return self.runs.merge(means, on="run").astype({"seed": int, "templates": int})

    @cached_property
    def deciding(self) -> pd.DataFrame:
        """What decides the runs, see `deciding_settings`."""
        return deciding_settings(self.settings)

    @property
    def unscored(self) -> pd.DataFrame:
        """The other runs."""
        return self.runs[~self.runs["run"].isin(self.samples["run"])]

    def check_scored(self) -> None:
        """Raise a DataError that says why, if no run has scores."""
        if self.samples.empty:
            run, why = self.runs[["run", "reason"]].iloc[0]
            raise DataError(f"no run has results under protocol {self.protocol.name}: {run}: {why}")

    def run_folder(self, run: str) -> RunFolder:
        """Return the folder of a run, by its name."""
        return RunFolder(self.folder / run)

    def where(self, **columns: Any) -> Results:
        """Return the part in which columns of the samples have one of these values.

        Runs without such samples are left out; a DataError where nothing is left.
        """
        samples = self.samples
        for column, wanted in columns.items():
            values = [wanted] if isinstance(wanted, (str, int)) else list(wanted)
            samples = samples[samples[column].isin(values)]
        if samples.empty:
            raise DataError(f"there are no results with {columns}")
        runs = self.runs[self.runs["run"].isin(samples["run"])]
        return replace(
            self, samples=samples, runs=runs, settings=self.settings.loc[list(runs["run"])]
        )


def _read_kept(file: Path) -> Results:
    """Read what docs/tools/findings.py kept."""
    try:
        with zipfile.ZipFile(file) as archive:
            text = {name: archive.read(name).decode("utf-8") for name in archive.namelist()}
        about = json.loads(text["about.json"])
        words = ("category", "id", "family", "template", "template_family", "variant")
        samples = pd.read_csv(io.StringIO(text["samples.csv"]), dtype=dict.fromkeys(words, str))
        samples = samples.fillna({"family": "", "template_family": "", "variant": ""})
        settings = pd.read_csv(io.StringIO(text["settings.csv"])).set_index("run")
        shared = pd.DataFrame([about["settings"]] * len(settings), settings.index)
        settings = pd.concat([settings, shared], axis=1)
        runs = samples[["run", *GROUP, "seed"]].drop_duplicates("run").reset_index(drop=True)
        several = runs["run"].map(samples.groupby("run")["category"].nunique() > 1)
        joint = runs["run"].map(settings["category.name"])  # a sample has its shape's own
        runs["category"] = runs["category"].mask(several, joint)
        seconds = runs["run"].map(about.pop("seconds_per_step", {}))
        families = samples[samples["template_family"] != ""].groupby("run", sort=False)
        return Results(
            samples,
            runs.assign(state="finished", reason="", seconds_per_step=seconds),
            settings,
            ProtocolDescription.from_json(about.pop("protocol")),
            {
                str(run): dict(zip(part["template"], part["template_family"], strict=True))
                for run, part in families
            },
            pd.read_csv(io.StringIO(text["curves.csv"])),
            [about],
        )
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise DataError(f"{file} holds no kept results: {error}") from None


# --- run folders ---------------------------------------------------------------------------------


def deciding_settings(settings: pd.DataFrame) -> pd.DataFrame:
    """Return what decides runs but their category and seed, as text; null is the same as nothing.

    `category` is that of runs on several, "single" of all others. Files in the folder of a run of
    the same category and seed are the same for all.
    """
    categories, seeds, members = (
        settings.get(key, pd.Series("", settings.index))
        for key in ("category.name", "seed", "category.members")
    )
    joint = members.map(lambda names: isinstance(names, list) and len(names) > 1)
    texts = members.map(setting_text)
    unclear = texts.groupby(categories).transform("nunique") > 1
    columns = {"category": categories.mask(unclear, texts).where(joint, "single")}
    places = [
        re.compile(rf"(?<=/){re.escape(str(category))}(?=/)|(?<=/)seed{seed}(?=[/_])")
        for category, seed in zip(categories, seeds, strict=True)
    ]
    for key in settings:
        if decides(key) and key != "seed" and not key.startswith("category."):
            values = settings[key].map(setting_text)
            columns[key] = [p.sub("*", value) for p, value in zip(places, values, strict=True)]
    return pd.DataFrame(columns, settings.index)


def _of_other_data(
    samples: pd.DataFrame, settings: pd.DataFrame, known: Mapping[str, RunFolder]
) -> dict[str, str]:
    """Return " (data.seed=1)", say, of runs on other data than most runs of a category.

    Their shapes are others, also where these have the same ids. Folders of one name hold the same
    data, wherever they are, unless their files are known to be others.
    """
    values = settings.reindex(columns=["data.name", "data.seed", "data.root"]).map(setting_text)
    firsts: dict[tuple[str, ...], tuple[str, Any]] = {}
    for run, root in values["data.root"].items():
        name, sources = PurePath(root).name, known[str(run)].data.get("sources", {})
        first = firsts.setdefault((name, *sources), (root, sources))
        values.loc[run, "data.root"] = name if root == first[0] or sources == first[1] else root
    found: dict[str, str] = {}
    for _, part in samples.groupby("category", sort=False):
        runs = values.loc[part["run"].unique()]
        ((usual, _),) = Counter(runs.itertuples(index=False, name=None)).most_common(1)
        for run, row in runs.iterrows():
            told = [f"{k}={x}" for k, x, most in zip(runs, row, usual, strict=True) if x != most]
            if told:
                found[str(run)] = f" ({', '.join(told)})"
    return found


def own_protocol(run: RunFolder) -> str:
    """Return the name of the results that a run's training ended with, or will."""
    ended, chosen = run.status.get("evaluation") or {}, run.settings.get("protocol") or {}
    return str(ended.get("name") or chosen.get("name", "paper"))


def described_protocol(run: RunFolder, name: str) -> ProtocolDescription | None:
    """Return the protocol of a run's results of this name, None where there are none whole.

    It is as their `summary.json` describes it, so that it need not be installed.
    """
    content = read_json(run.evaluation(name) / "summary.json")
    try:
        found = ProtocolDescription.from_json(content["protocol"])
    except (ValueError, KeyError, TypeError):
        return None
    how = {key: value for key, value in content.get("settings", {}).items() if key in _HOW}
    return replace(found, name=name, settings=json.dumps(how, sort_keys=True) if how else "")


def evaluate_command(run: RunFolder, name: str) -> str:
    """Return the command that makes a run's results of this name, if its training made them."""
    protocol = re.split("[-/]", name)[0]
    words = ["ffd", "evaluate", f"run={run.path}", f"protocol={protocol}"]
    if name == own_protocol(run) != protocol:
        own = {f"protocol.{k}": x for k, x in run.settings["protocol"].items() if k != "name"}
        names = ("subset", "all_views", "seed")
        how = {f"evaluation.{k}": run.settings["evaluation"][k] for k in names}
        words += [f"{key}={setting_text(value)}" for key, value in (own | how).items()]
    return shlex.join(words)


def read_samples(run: RunFolder, protocol: ProtocolDescription) -> pd.DataFrame:
    """Read a run's `samples.csv`; a DataError if it is damaged, or lacks what all have."""
    file = run.evaluation(protocol.name) / "samples.csv"
    measures = [measure.name for measure in protocol.metrics]
    try:
        words = ("category", "id", "family", "template")  # a synset is no number
        samples = pd.read_csv(file, dtype=dict.fromkeys(words, str))
        known = samples[["id", "category", "view", "template", *measures]]
        if known.empty or not np.isfinite(known[measures].to_numpy(float)).all():
            raise ValueError("no rows, or scores that are not finite")
        count = read_json(file.with_name("summary.json"))["num_samples"]
        if len(known) != count or known.duplicated(["id", "view"]).any():
            raise ValueError(f"{len(known)} rows, not one for each of {count:g} images")
        return samples
    except (OSError, ValueError, KeyError) as error:
        raise DataError(
            f"{file} is damaged ({' '.join(str(error).split())}): "
            f"{evaluate_command(run, protocol.name)} restart=true"
        ) from None


def _read_settings(
    runs: Sequence[RunFolder], folder: Path
) -> tuple[dict[str, RunFolder], pd.DataFrame, list[dict[str, str]]]:
    """Return runs by name, their settings (a row each), and rows of those that are damaged."""
    known: dict[str, RunFolder] = {}
    rows: dict[str, pd.DataFrame] = {}
    damaged: list[dict[str, str]] = []
    for run in runs:
        name = relpath(run.path, folder)
        try:
            rows[name] = pd.json_normalize(run.settings)
            known[name] = run
        except ConfigError as error:
            damaged.append({"run": name, "state": "damaged", "reason": str(error)})
    if not known:
        why = "".join(f" ({row['run']}: {row['reason']})" for row in damaged[:1])
        raise DataError(
            f"{folder} holds no run that can be read{why}: name the folder of a run, or of a "
            "sweep (runs/NAME)"
        )
    settings = pd.concat(rows.values(), ignore_index=True).set_axis(list(rows)).rename_axis("run")
    return known, settings, damaged


def _check_scores(
    run: RunFolder,
    state: object,
    described: ProtocolDescription | None,
    protocol: ProtocolDescription,
) -> None:
    """Raise a DataError that says why a run has no scores, if it has none."""
    if state != "finished":
        # Samples may be there from before: they would not be of the run as it is now.
        on = "it is at work" if state == "running" else "its command, given again, resumes it"
        raise DataError(f"it was begun and is not finished: {on}")
    if described != protocol:
        again = evaluate_command(run, protocol.name)
        if described is None:
            raise DataError(f"it has no results of protocol {protocol.name}: {again}")
        raise DataError(f"evaluated under another protocol of this name: {again} restart=true")


def _families(run: RunFolder, data: str) -> dict[str, str]:
    """Return `<category>/<family>` of the templates that a run could select, {} where unknown.

    `data` is what categories are called by beside their names.
    """
    try:
        ranking = pd.read_csv(run.path / "template_ranking.csv", dtype=str, keep_default_na=False)
        families = dict(zip(ranking["id"], ranking["family"], strict=True))
    except (OSError, ValueError, KeyError):
        return {}
    if not any(families.values()):
        return {}
    category = run.settings["category"]
    joint = len(category.get("members") or []) > 1
    name = {i: i.split("/")[0] if joint else category["name"] for i in families}
    return {i: family and f"{name[i]}{data}/{family}" for i, family in families.items()}
