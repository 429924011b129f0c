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
from typing import Any

from playwright.sync_api import Page, sync_playwright

_BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
# WebGL without a graphics card.
_FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--ignore-gpu-blocklist"]
_FLAGS += ["--enable-unsafe-swiftshader"]
_PATIENCE = 300_000  # milliseconds


# Of TensorBoard: page, height, milliseconds until all is drawn, and which tags.
_TENSORBOARD = {
    "scalars": ("timeseries", 1500, 10_000, ""),
    "selection": ("timeseries", 1000, 10_000, "which_template/(bars|selected$)"),
    "clouds": ("mesh", 900, 40_000, ""),
    "hparams": ("hparams", 700, 10_000, ""),
}


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


def take(place: Any, file: Path) -> None:
    """Write the screenshot that a file is named after: report, viewer or a page of TensorBoard.

    Args:
        place: where runs are, see `pictures.Place`.
        file: of the screenshot.
    """
    if file.stem == "report":
        _report(place.runs / "demo", file)
    elif file.stem == "viewer":
        _viewer(place.run("demo", "table", "posterior"), file)
    else:
        runs = {regime: place.run("demo", "table", regime) for regime in ("b", "r", "posterior")}
        _tensorboard(runs, file, *_TENSORBOARD[file.stem.removeprefix("tensorboard-")])


def _report(folder: Path, file: Path) -> None:
    """Show the first screens."""
    with browser(1400, 1700) as page:
        page.goto(f"file://{folder / 'report.html'}")
        page.wait_for_timeout(5000)
        page.screenshot(path=file)


def _viewer(run: Path, file: Path) -> None:
    """Show a test shape."""
    command = (sys.executable, "-m", "ffd_lightning", "view", f"run={run}", "port={port}")
    with served(*command) as address, browser(1400, 900) as page:
        page.goto(address, wait_until="commit")
        page.get_by_text("To the ground truth").first.wait_for()
        page.locator(".mantine-Notification-closeButton").first.click()  # of software rendering
        page.wait_for_timeout(60_000)  # lights and shapes fade in, slowly in software
        page.screenshot(path=file)


def _tensorboard(
    runs: dict[str, Path], file: Path, tab: str, height: int, wait: int, tags: str
) -> None:
    with TemporaryDirectory() as folder:
        for name, run in runs.items():  # under these names, not their folders'
            (Path(folder) / name).symlink_to(run / "tensorboard")
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
