"""Preparing a category: load, normalise, sample, render; in parallel, and safe against kills.

Each shape becomes one file of a working folder as soon as it is done; at the end the manifest is
written and the folder renamed into place. So a kill costs the shapes in work and no more, and no
process ever sees half a set.
"""

import hashlib
import json
import multiprocessing
import pickle
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from filelock import AcquireReturnProxy, FileLock, Timeout

from ffd_lightning.data.preparation.overview import describe, sheet_of, some_reasons, write_sheet
from ffd_lightning.data.preparation.prepared import (
    FORMAT_VERSION,
    MANIFEST,
    PreparedSet,
    digest_of,
    without_file,
)
from ffd_lightning.data.preparation.prepared_shape import Failure, ShapeMaker, shape_file
from ffd_lightning.data.preparation.variants import enough_variants, variant_ids
from ffd_lightning.data.preparation.workers import make_shapes
from ffd_lightning.data.source import Source
from ffd_lightning.errors import ConfigError, DataError, did_you_mean
from ffd_lightning.files import write_atomic
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.parallel import available_cores
from ffd_lightning.progress import CountProgress
from ffd_lightning.terminal import counted


@dataclass(frozen=True)
class Preparation:
    """What a prepared set is made of and where it goes.

    Worker processes are started afresh, so a script that uses this needs the usual
    `if __name__ == "__main__":`.

    Args:
        source: where shapes come from.
        category: its name.
        num_points: surface samples kept of each shape.
        render: the images.
        root: prepared sets are kept in `root/prepared`.
        limit: so many shapes at most, evenly spread over their sorted ids.
        variants: deformed variants that are made of each shape, to train on; "auto" brings fewer
            than 300 shapes to as many, with 15 of each at most.
        workers: processes, 0 for one per core.
        timeout: seconds after which a shape is given up: it is left out.
        progress: show on stderr how far it is, and what the set holds in a contact sheet.
        leave_out: ids of shapes that are not prepared; `<category>/<id>` for one category's alone.
    """

    source: Source
    category: str
    num_points: int = 16384
    render: RenderSettings = field(default_factory=RenderSettings)
    root: Path = Path("data")
    limit: int | None = None
    variants: int | Literal["auto"] = 0
    workers: int = 0
    timeout: float = 600.0
    progress: bool = True
    leave_out: Sequence[str] = ()

    def __post_init__(self) -> None:
        if self.limit is not None and self.limit < 1:
            raise ConfigError(f"limit={self.limit} must be 1 or more")
        if self.variants != "auto" and self.variants < 0:
            raise ConfigError(f"variants={self.variants} must be 0 or more")
        if self.variants and self.source.own_images:
            raise ConfigError(
                f"variants={self.variants} of shapes that come with images of their own would not "
                "look like these: leave data.variants out, or have the shapes rendered"
            )

    @property
    def shape_ids(self) -> list[str]:
        """The ids of the shapes to prepare, sorted."""
        ids = self.source.shape_ids(self.category)
        if len(set(ids)) != len(ids) or not all(isinstance(i, str) for i in ids):
            name = type(self.source).__name__
            raise ConfigError(f"shape_ids of {name} must give a list of strings, each of them once")
        left_out = set(self._left_out(ids))
        ids = [i for i in ids if i not in left_out]
        count = len(ids) if self.limit is None else min(self.limit, len(ids))
        return [ids[k * len(ids) // count] for k in range(count)]

    def _left_out(self, ids: Sequence[str]) -> list[str]:
        """Return which of a category's shapes are left out, sorted; an error for what is none."""
        there, own = set(ids), set()
        for name in self.leave_out:
            shape_id = name.removeprefix(f"{self.category}/")
            if shape_id in there:
                own.add(shape_id)
            elif shape_id != name or name.partition("/")[0] not in self.source.categories():
                raise ConfigError(
                    f"data.leave_out: there is no shape {name!r} of {self.category}."
                    f"{did_you_mean(shape_id, ids)}"
                )
        return sorted(own)

    @cached_property
    def num_variants(self) -> int:
        """How many variants are made of each shape."""
        return enough_variants(len(self.shape_ids)) if self.variants == "auto" else self.variants

    @cached_property
    def origins(self) -> dict[str, str]:
        """Which shape each variant is made of, by their ids."""
        return variant_ids(self.shape_ids, self.num_variants) if self.num_variants else {}

    @cached_property
    def settings(self) -> dict[str, object]:
        """What decides the set, JSON-able."""
        more: dict[str, object] = {} if self.limit is None else {"limit": self.limit}
        if left_out := self.leave_out and self._left_out(self.source.shape_ids(self.category)):
            more["leave_out"] = left_out
        if self.num_variants:
            more["variants"] = self.num_variants
        return {
            "format": FORMAT_VERSION,
            "source": {**self.source.fingerprint(self.category), **more},
            "category": self.category,
            "num_points": self.num_points,
            "render": asdict(self.render),
        }

    @property
    def target(self) -> Path:
        """The set's folder, named by what decides it; by the timeout too if shapes were given up.

        So another timeout does not take a set for complete from which the clock left shapes out.
        """
        incomplete = self._folder({**self.settings, "timeout": float(self.timeout)})
        return incomplete if incomplete.exists() and not self._whole.exists() else self._whole

    @cached_property
    def _whole(self) -> Path:
        """The folder of the set that lacks no shape for want of time or memory."""
        return self._folder(self.settings)

    def _folder(self, settings: dict[str, object]) -> Path:
        try:
            canonical = json.dumps(settings, sort_keys=True, separators=(",", ":"))
        except (TypeError, ValueError) as error:
            name = type(self.source).__name__
            raise ConfigError(f"the fingerprint of {name} must be JSON-able: {error}") from None
        key = hashlib.sha256(canonical.encode()).hexdigest()[:12]
        return Path(self.root) / "prepared" / f"{self.category}-{key}"

    def run(self) -> PreparedSet:
        """Return the prepared set, building what is missing of it.

        Raises:
            DataError: no usable shape, files that cannot be read or written, a damaged set.
        """
        if self._missing() == []:
            return PreparedSet.open(self.target)
        ids = self._ids()
        try:
            self.target.parent.mkdir(parents=True, exist_ok=True)
            with _locked(self._whole):
                missing = self._missing()
                if missing is None:
                    self._make_set(ids)
                elif failures := self._make(missing, self.target):
                    raise DataError(f"{self.target} cannot be mended: {_some(failures)}")
        except OSError as error:
            raise DataError(
                f"cannot prepare {self.target}: {error}. Mend that or choose another folder "
                "(paths.data=DIR; data_root=DIR of a command that has this setting); the same "
                "command resumes with the shapes that are left"
            ) from error
        prepared = PreparedSet.open(self.target)
        if missing is None and self.progress:
            _say(*describe(prepared), write_sheet(prepared, sheet_of(prepared.path)))
        return prepared

    def _missing(self) -> list[str] | None:
        """Return the shapes whose files somebody removed from the set, None if there is no set."""
        if not self.target.exists():
            return None
        try:
            return without_file(self.target, json.loads((self.target / MANIFEST).read_bytes()))
        except (OSError, ValueError, TypeError, KeyError):
            return []  # it is damaged, and opening it says so

    def _ids(self) -> list[str]:
        """Return the shapes to prepare, if workers can be given the source."""
        if getattr(multiprocessing.current_process(), "_inheriting", False):
            # A worker that is still importing the script would wait for the lock its parent holds.
            raise RuntimeError('data is prepared outside of `if __name__ == "__main__":`')
        try:
            pickle.dumps(self.source)
        except Exception as error:
            raise ConfigError(
                f"{type(self.source).__name__} cannot be sent to the processes that prepare its "
                "shapes: its class must be importable, and what it holds picklable "
                f"({type(error).__name__}: {error})"
            ) from None
        return self.shape_ids

    def _make(self, ids: Sequence[str], folder: Path) -> dict[str, Failure]:
        """Make the shapes that are not done yet, and return why others cannot be; under the lock.

        What failed in an earlier call is tried again: its cause may have been mended.
        """
        how = self.source, self.category, self.num_points, self.render
        maker = ShapeMaker(*how, folder, self.origins)
        todo = [i for i in ids if not maker.is_done(i)]
        done = len(ids) - len(todo)
        if self.progress:
            resumed = f" ({done} are done already)" if done else ""
            what = counted(len(ids), "variant" if self.origins.keys() >= set(ids) else "shape")
            _say(f"preparing {what} of {self.category} in {self.target}{resumed}")
        try:
            with CountProgress(self.category, len(ids), done, self.progress) as bar:
                workers = self.workers or available_cores()
                return make_shapes(maker, todo, workers, self.timeout, bar.advance)
        except KeyboardInterrupt:
            _say("preparation interrupted: the same command resumes with the shapes that are left")
            raise

    def _make_set(self, ids: list[str]) -> None:
        """Make all shapes in a working folder, then put it in its place."""
        folder = self._whole.with_name(f".{self._whole.name}.partial")
        folder.mkdir(exist_ok=True)
        failures = self._make(ids, folder)
        # What cannot be used is not tried again in other forms.
        variants = [i for i, origin in self.origins.items() if origin not in failures]
        if variants:
            if self.variants == "auto" and self.progress:
                _say(
                    f"few shapes of {self.category} ({len(ids)}): {self.num_variants} deformed "
                    "variants of each will be trained on, too (data.variants=0: none)"
                )
            failures |= self._make(variants, folder)
            ids = sorted([*ids, *variants])
        if unread := {i: f for i, f in failures.items() if f.kind == "unread"}:
            raise DataError(
                f"{len(unread)} of {counted(len(ids), 'shape')} of {self.category} could not be "
                f"read ({_some(unread)}). The others are done: the same command tries these "
                "again. A source of your own raises RejectedShapeError for what cannot be used"
            )
        wanted = {shape_file(folder, i).name for i in ids if i not in failures}
        if not wanted:
            found = f"all {len(ids)} are rejected ({_some(failures)})" if ids else "there are none"
            raise DataError(f"no usable shape of {self.category}: {found}")
        for path in folder.iterdir():  # what kills left behind
            if path.name not in wanted:
                path.unlink()
        settings = self.settings
        if any(failure.kind == "given up" for failure in failures.values()):
            settings = {**settings, "timeout": float(self.timeout)}
        reasons = {i: failures[i].reason for i in ids if i in failures}
        _write_manifest(folder, ids, reasons, settings, {i: self.origins[i] for i in variants})
        folder.rename(self._folder(settings))


def _locked(target: Path) -> AcquireReturnProxy:
    """Hold the kernel's lock of a set: it is freed when its holder ends, however it ends."""
    lock = FileLock(target.with_name(f".{target.name}.lock"))
    try:
        return lock.acquire(timeout=0)
    except Timeout:
        _say(f"another process is preparing {target}: waiting for it")
        return lock.acquire()


def _say(*lines: str) -> None:
    print(*lines, sep="\n", file=sys.stderr)


def _some(failures: Mapping[str, Failure]) -> str:
    return some_reasons({i: failure.reason for i, failure in sorted(failures.items())})


def _write_manifest(
    folder: Path,
    ids: Sequence[str],
    rejected: Mapping[str, str],
    settings: Mapping[str, Any],
    origins: Mapping[str, str],
) -> None:
    """Write what is known of all shapes together: those tried, and why some were rejected.

    `origins` names the variants among them, and the shape that each is of.
    """
    good = [i for i in ids if i not in rejected]
    families, warnings, image_shape = [], {}, None
    part_names: dict[str, None] = {}
    for shape_id in good:
        with np.load(shape_file(folder, shape_id), allow_pickle=False) as arrays:
            shape = arrays["image_shape"].tolist()
            image_shape = image_shape or shape
            if shape != image_shape:
                for done in folder.iterdir():  # all shapes are made anew once that is mended
                    done.unlink()
                raise DataError(
                    f"{shape_id} of {settings['category']} has images {shape}, others have "
                    f"{image_shape}: the source must give all shapes as many views"
                )
            families.append(str(arrays["family"]))
            part_names |= dict.fromkeys(arrays["part_names"].tolist())
            if lines := str(arrays["warning"]).splitlines():
                warnings[shape_id] = lines
    manifest = {
        "settings": settings,
        "sha256": digest_of([settings, good]),
        "image_shape": image_shape,
        "part_names": list(part_names),
        "ids": good,
        "families": families,
        "rejected": rejected,
        "warnings": warnings,
        **({"origins": origins} if origins else {}),
    }
    write_atomic(folder / MANIFEST, json.dumps(manifest, indent=1) + "\n")
