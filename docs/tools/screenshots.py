"""Screenshots of pages: the report, TensorBoard, the viewer. Needs playwright and a Chromium."""

from __future__ import annotations

import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Protocol

from playwright.sync_api import Page, sync_playwright

_BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
# WebGL without a graphics card.
_FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--ignore-gpu-blocklist"]
_FLAGS += ["--enable-unsafe-swiftshader"]
_PATIENCE = 300_000  # milliseconds


class Runs(Protocol):
    """Where runs are; see `pictures.Place`."""

    runs: Path

    def run(self, sweep: str, category: str, regime: str) -> Path:
        """Return the folder of a sweep's run."""
        ...


@contextmanager
def browser(width: int, height: int) -> Iterator[Page]:
    """Open a page of that size."""
    found = [path for name in _BROWSERS if (path := shutil.which(name))]
    if not found:
        sys.exit(f"no browser on the path: {', '.join(_BROWSERS)}")
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=found[0], args=_FLAGS)
        page = opened.new_page(viewport={"width": width, "height": height})
        page.set_default_timeout(_PATIENCE)
        yield page
        opened.close()


@contextmanager
def served(*command: str) -> Iterator[str]:
    """Run a server that takes `{port}`; yields its address once it answers."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    process = subprocess.Popen([part.format(port=port) for part in command])
    try:
        for _ in range(_PATIENCE // 1000):
            time.sleep(1)
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", port)) == 0:
                    break
        yield f"http://127.0.0.1:{port}"
    finally:
        process.terminate()
        process.wait()


def report(place: Runs, file: Path) -> None:
    """The first screens of the demo's report."""
    with browser(1400, 1700) as page:
        page.goto(f"file://{place.runs / 'demo' / 'report.html'}")
        page.wait_for_timeout(5000)
        page.screenshot(path=file)


def viewer(place: Runs, file: Path) -> None:
    """A test shape in the viewer."""
    run = place.run("demo", "table", "posterior")
    command = (sys.executable, "-m", "ffd_lightning", "view", f"run={run}", "port={port}")
    with served(*command) as address, browser(1400, 900) as page:
        page.goto(address, wait_until="commit")
        page.get_by_text("To the ground truth").first.wait_for()
        page.locator(".mantine-Notification-closeButton").first.click()  # of software rendering
        page.wait_for_timeout(60_000)  # lights and shapes fade in, slowly in software
        page.screenshot(path=file)


def _tensorboard(place: Runs, file: Path, tab: str, height: int, wait: int, tags: str = "") -> None:
    with TemporaryDirectory() as folder:
        for regime in ("b", "r", "posterior"):  # under their names, not their folders'
            (Path(folder) / regime).symlink_to(place.run("demo", "table", regime) / "tensorboard")
        command = ("tensorboard.main", "--logdir", folder, "--port", "{port}")
        with served(sys.executable, "-m", *command) as address, browser(1400, height) as page:
            page.wait_for_timeout(15_000)  # it reads the logs
            page.goto(f"{address}/#{tab}")
            page.reload()
            if tags:
                page.locator("input[placeholder^='Filter tags']").first.fill(tags)
                page.mouse.click(100, height - 50)  # closes the list of tags
            page.wait_for_timeout(wait)
            page.screenshot(path=file)


def tensorboard_scalars(place: Runs, file: Path) -> None:
    """Curves of selection and validation."""
    _tensorboard(place, file, "timeseries", 1500, 10_000)


def tensorboard_selection(place: Runs, file: Path) -> None:
    """How often each template is selected, with its picture."""
    _tensorboard(place, file, "timeseries", 1000, 10_000, "which_template/(bars|selected$)")


def tensorboard_clouds(place: Runs, file: Path) -> None:
    """Point clouds, coloured by their distance to the truth."""
    _tensorboard(place, file, "mesh", 900, 40_000)


def tensorboard_hparams(place: Runs, file: Path) -> None:
    """Settings and results of the runs."""
    _tensorboard(place, file, "hparams", 700, 10_000)
