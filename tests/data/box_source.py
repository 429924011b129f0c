"""A source of boxes, one of them broken in a way of choice; imported by worker processes too."""

import os
import signal
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.source import Source, SourceShape
from ffd_lightning.errors import DataError, RejectedShapeError
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.shapes.kit.builder import Builder
from ffd_lightning.shapes.kit.materials import Material

RENDER = RenderSettings(height=24, width=32, azimuths=[0.0, 90.0], samples=1)


@dataclass(frozen=True)
class BoxSource(Source):
    """Boxes `b00`, `b01` and so on; every load is written to `log` as "id pid"."""

    count: int
    log: Path
    faults: dict[str, str] = field(default_factory=dict)
    gate: Path | None = None
    version: int = 0

    def categories(self):
        return ["box"]

    def shape_ids(self, category):
        return [f"b{i:02d}" for i in range(self.count)]

    def fingerprint(self, category):
        return {"version": self.version}

    def load(self, category, shape_id):
        with self.log.open("a") as file:
            file.write(f"{shape_id} {os.getpid()}\n")
        while self.gate is not None and shape_id > "b03" and not self.gate.exists():
            time.sleep(0.02)
        fault = self.faults.get(shape_id)
        if fault == "reject":
            raise RejectedShapeError("it is\nno box")
        if fault == "raise":
            raise ZeroDivisionError("bad box")
        if fault == "damaged":
            raise OSError("box.png is no picture")
        if fault == "unread":
            Path("/nowhere/box.png").read_bytes()
        if fault == "memory":
            raise MemoryError
        if fault == "no source":
            raise DataError("the archive is damaged")
        if fault == "sleep":
            time.sleep(60)
        if fault == "swallow":
            with suppress(BaseException):  # trimesh does so
                time.sleep(60)
        if fault == "hang":  # as a library would that never comes back to Python
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGALRM})
            time.sleep(60)
        if fault == "exit":
            os._exit(3)
        return SourceShape(box_mesh(int(shape_id[1:])), ("plain", "wooden")[int(shape_id[1:]) % 2])


def box_mesh(number):
    """Two stacked boxes; those of odd numbers are textured."""
    b = Builder()
    material = Material((0.2, 0.5, 0.1 + 0.05 * number), "wood" if number % 2 else "")
    b.box("lid", material, (0, 1, 0), (1, 0.5, 1))
    b.box("body", material, (0, 0, 0), (1 + number, 1.5, 1))
    return b.mesh()


def boxes_of(source, root, workers=2, num_points=32, render=RENDER, category="box", **settings):
    return Preparation(
        source, category, num_points, render, Path(root), workers=workers, **settings
    )


def box_module(preparation, **settings):
    """A data module of boxes, set up."""
    from ffd_lightning.data.datamodule import FfdDataModule  # workers import this, and no torch

    module = FfdDataModule(preparation, **({"num_points": 8} | settings))
    module.setup()
    return module


def prepare_boxes(source, root, **settings):
    return boxes_of(source, root, **settings).run()


def loads(log):
    """Return the ids in the order in which they were loaded, and the pids that did it."""
    if not log.exists():
        return [], set()
    lines = [line.split() for line in log.read_text().splitlines()]
    return [line[0] for line in lines], {int(line[1]) for line in lines}


def contents(folder):
    """Return the bytes of every file of a prepared set."""
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}
