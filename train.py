"""Train one run, or a sweep with -m: see `python train.py --help`."""

from ffd_lightning.app.main import run

if __name__ == "__main__":
    run("train")
