"""Prepare data for training: see `python prepare.py --help`."""

from ffd_lightning.app.main import run

if __name__ == "__main__":
    run("prepare")
