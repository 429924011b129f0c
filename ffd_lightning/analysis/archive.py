"""What a study found in one small file: the scores of all its runs, without their folders."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from os.path import relpath
from pathlib import Path
from typing import Any

import pandas as pd

from ffd_lightning.analysis.runs import find_protocol, load_samples, load_settings
from ffd_lightning.analysis.selection import run_families
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import ProtocolDescription
from ffd_lightning.files import write_bytes_atomic
from ffd_lightning.run_folder import RunFolder

_DIGITS = "%.5g"  # of scores: more than any two runs agree in by chance
_CURVES = {"val/box_chamfer": "box_chamfer", "val/effective_templates": "effective_templates"}
_OLD = (1980, 1, 1, 0, 0, 0)  # the same file for the same study


@dataclass(frozen=True)
class Archive:
    """A study's results.

    Attributes:
        samples: as `load_samples` gives them; `run` is the run's path below the study's folder.
            `template_family` is `<category>/<family>` of the selected template, where it is known.
        curves: of validation: `run`, `step`, `box_chamfer` (x 1000) and `effective_templates`.
        settings: of each run (index `run`), as `load_settings` gives them, those that differ; of
            files only their names, as they may lie elsewhere on another machine.
        protocol: that the samples were measured under.
        about: what else is known: `settings` that all runs share, `seconds_per_step` of each run,
            and what was written with it (machine, commands).
    """

    samples: pd.DataFrame
    curves: pd.DataFrame
    settings: pd.DataFrame
    protocol: ProtocolDescription
    about: dict[str, Any]

    @property
    def families(self) -> dict[str, dict[str, str]]:
        """The family of each template that was selected, as `run_families` gives them."""
        known = self.samples[self.samples["template_family"] != ""]
        return {
            str(run): dict(zip(part["template"], part["template_family"], strict=True))
            for run, part in known.groupby("run", sort=False)
        }


def write_archive(
    runs: Sequence[RunFolder],
    root: Path,
    file: Path,
    about: dict[str, Any] | None = None,
    protocol: str | None = None,
) -> None:
    """Write the results of finished runs into one file, a zip of CSV and JSON.

    Args:
        runs: those that are not finished are left out.
        root: folder of the study: runs are named by their paths below it.
        file: ends in `.zip`.
        about: plain values that a reader should know, such as the machine.
        protocol: whose scores are kept, by default that of the training.

    Raises:
        DataError: no run is finished, or none was evaluated under this protocol.
    """
    finished = [run for run in runs if run.finished]
    if not finished:
        raise DataError(f"no run in {root} is finished: there is nothing to keep yet")
    names = {str(run.path): relpath(run.path, root) for run in finished}
    measured = find_protocol(finished, protocol)
    samples = load_samples(finished, measured.name)
    families = run_families(finished)
    samples["template_family"] = [
        families.get(run, {}).get(template, "")
        for run, template in zip(samples["run"], samples["template"], strict=True)
    ]
    settings = load_settings(finished).rename(index=names).map(_without_folder)
    settings = settings.drop(columns=[key for key in settings if key.startswith("paths.")])
    shared = [key for key in settings if settings[key].map(repr).nunique() == 1]
    seconds = {names[str(run.path)]: _seconds_per_step(run) for run in finished}
    known = {
        "protocol": measured.to_json(),
        "settings": json.loads(settings[shared].iloc[0].to_json()),
        "seconds_per_step": seconds,
        **(about or {}),
    }
    curves = pd.concat([_curves(run, names[str(run.path)]) for run in finished], ignore_index=True)
    content = {
        "samples.csv": _csv(samples.assign(run=samples["run"].map(names))),
        "curves.csv": _csv(curves),
        "settings.csv": _csv(settings.drop(columns=shared).reset_index()),
        "about.json": json.dumps(known, indent=1, sort_keys=True),
    }
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_LZMA) as archive:
        for name, text in content.items():
            archive.writestr(zipfile.ZipInfo(name, _OLD), text, zipfile.ZIP_LZMA)
    write_bytes_atomic(file, packed.getvalue())


def read_archive(file: Path) -> Archive:
    """Read what `write_archive` wrote.

    Raises:
        DataError: it is not there, or is something else.
    """
    try:
        with zipfile.ZipFile(file) as archive:
            text = {name: archive.read(name).decode("utf-8") for name in archive.namelist()}
        about = json.loads(text["about.json"])
        words = dict.fromkeys(("id", "family", "template", "template_family"), str)
        samples = pd.read_csv(io.StringIO(text["samples.csv"]), dtype=words)
        unknown = {"family": "", "template_family": ""}
        return Archive(
            samples.fillna(unknown),
            pd.read_csv(io.StringIO(text["curves.csv"])),
            pd.read_csv(io.StringIO(text["settings.csv"])).set_index("run"),
            ProtocolDescription.from_json(about.pop("protocol")),
            about,
        )
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise DataError(f"{file} is no archive of a study: {error}") from None


def _without_folder(value: Any) -> Any:
    absolute = isinstance(value, str) and Path(value).is_absolute()
    return Path(value).name if absolute else value


def _csv(table: pd.DataFrame) -> str:
    return table.to_csv(index=False, float_format=_DIGITS, lineterminator="\n")


def _seconds_per_step(run: RunFolder) -> float | None:
    return (run.status.get("summary") or {}).get("seconds_per_step")


def _curves(run: RunFolder, name: str) -> pd.DataFrame:
    """Read a run's validation scores from its TensorBoard log; no rows where there is none."""
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    table = pd.DataFrame(columns=list(_CURVES.values()), dtype=float)
    if (run.path / "tensorboard").is_dir():
        log = EventAccumulator(str(run.path / "tensorboard"), {"scalars": 0})
        log.Reload()
        for tag in _CURVES.keys() & set(log.Tags()["scalars"]):
            points = {event.step: event.value for event in log.Scalars(tag)}
            table = table.reindex(sorted({*table.index, *points}))
            table[_CURVES[tag]] = pd.Series(points)
    table = table.rename_axis("step").reset_index()
    table.insert(0, "run", name)
    return table
