"""Run a study, from its sweeps to its report: see `python sweep.py --help`."""

from ffd_lightning.app.main import run

if __name__ == "__main__":
    run("sweep")
