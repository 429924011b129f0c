"""Evaluate a run: see `python evaluate.py --help`."""

from ffd_lightning.app.main import run

if __name__ == "__main__":
    run("evaluate")
