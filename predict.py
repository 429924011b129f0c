"""Reconstruct what photographs show: see `python predict.py --help`."""

from ffd_lightning.app.main import run

if __name__ == "__main__":
    run("predict")
