"""Screenshots of pages, by Chromium without a window."""

import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
BOARDS = {
    "tensorboard-scalars": "?tagFilter=_chamfer%7Ceffective#timeseries",
    "tensorboard-selection": "?tagFilter=which_template%2F(bars%7Cselected)#timeseries",
    "tensorboard-hparams": "#hparams",
    "tensorboard-clouds": "#mesh",
}
"""Pages of TensorBoard, by the names of their pictures."""


def report(page: Path, file: Path) -> None:
    """Take the beginning of a report."""
    _take(page.as_uri(), file, (1400, 1700), seconds=3)


def tensorboard(logs: Path, file: Path) -> None:
    """Take the page of TensorBoard that the file's name says; pages show the folder as given."""
    *_, folder, sweep, category = logs.parts
    words = ("tensorboard.main", "--logdir", f"{folder}/{sweep}/{category}", "--port", "{port}")
    with _served(*words, cwd=logs.parents[2]) as address:
        _take(f"{address}/{BOARDS[file.stem]}", file, (1400, 1000), seconds=20)


def viewer(run: Path, file: Path) -> None:
    """Take the viewer of a run."""
    with _served("ffd_lightning", "view", f"run={run}", "port={port}") as address:
        _take(address, file, (1400, 900), seconds=30)


@contextmanager
def _served(*command: str, cwd: Path | None = None) -> Iterator[str]:
    """Run a Python module that serves pages on a port, and give their address."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    words = [word.format(port=port) for word in command]
    address = f"http://127.0.0.1:{port}"
    server = subprocess.Popen([sys.executable, "-m", *words], cwd=cwd)
    try:
        answered = False
        while not answered and server.poll() is None:
            time.sleep(1)
            with suppress(OSError):
                answered = urllib.request.urlopen(address).status == 200
        yield address
    finally:
        server.kill()


def _take(address: str, file: Path, size: tuple[int, int], seconds: int) -> None:
    """Take what a window of (width, height) pixels shows after some seconds."""
    from playwright.sync_api import sync_playwright

    programs = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    program = next(filter(None, map(shutil.which, programs)), None)
    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=program, args=_FLAGS)
        page = browser.new_page(viewport={"width": size[0], "height": size[1]})
        page.goto(address)
        page.wait_for_timeout(1000 * seconds)
        for note in page.locator("[class*=Notification-closeButton]").all():
            note.click()  # the viewer's about drawing without a GPU
        page.wait_for_timeout(1000)
        page.screenshot(path=file)
        browser.close()
