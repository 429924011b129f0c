"""A notebook, run, as a page with its pictures."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path


def write_page(notebook: Path, page: Path, sweep: Path, data: Path) -> None:
    """Run a notebook on the runs of a sweep, and write what it shows as Markdown."""
    environment = os.environ | {"SWEEP": str(sweep), "DATA": str(data)}
    pictures = page.with_name(f"{page.stem}_files")
    shutil.rmtree(pictures, ignore_errors=True)
    command = ["nbconvert", "--execute", "--no-input", "--to", "markdown", str(notebook)]
    command += [f"--output-dir={page.parent}", f"--output={page.stem}"]
    subprocess.run([sys.executable, "-m", *command], env=environment, check=True)
    text = tidy(page.read_text(encoding="utf-8"))
    page.write_text(text, encoding="utf-8")
    for file in pictures.glob("*"):
        if file.name not in text:  # Pillow's images come as JPEG, too
            file.unlink()


def tidy(text: str) -> str:
    """Return a page without what only other readers understand: style sheets, classes."""
    text = re.sub(r"<style.*?</style>\n?", "", text, flags=re.DOTALL)
    text = re.sub(r' (?:id|class|role|tabindex|aria-label)="[^"]*"', "", text)
    text = text.replace("![png](", "![What the cell draws](")
    return re.sub(r"\n\s*\n\s*\n+", "\n\n", text)
