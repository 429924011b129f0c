"""Run a study, from its sweeps to its report: see `python sweep.py --help`."""

from ffd_lightning.app.studies.run import main

if __name__ == "__main__":
    main()
