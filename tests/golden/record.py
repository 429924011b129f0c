"""Write the golden files anew, or all results of this machine to the last bit.

python tests/golden/record.py                 after results were meant to change
python tests/golden/record.py --exact FILE    before and after a change that must change nothing:
                                              on one machine both files are the same
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
sys.path.insert(0, str(Path(__file__).parents[2]))  # this checkout, whatever is installed

import digests
import subjects
import torch


def main() -> None:
    """Do what the command line says."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--exact", metavar="FILE", type=Path, help="write full digits to FILE")
    chosen = parser.parse_args().exact
    torch.set_num_threads(1)  # sums depend on how they are split
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if chosen is None:
            for kind, make in digests.KINDS.items():
                print(digests.write(kind, make(folder)))
        else:
            chosen.write_text(json.dumps(_exact(folder), indent=1) + "\n", encoding="utf-8")
            print(chosen)


def _exact(folder: Path) -> dict[str, object]:
    """Return every subject with all its digits."""
    known = digests.read("shapes")["digests"]
    found = {
        "shapes": {
            shape_id: subjects.shape(category, shape_id)
            for category, entry in known.items()
            for shape_id in entry["models"]
        },
        "prepared": subjects.prepared(folder),
        "training": {
            regime: subjects.training(regime, folder, double=False) for regime in subjects.REGIMES
        },
        "evaluation": subjects.evaluation(folder),
    }
    return {"versions": subjects.versions(), **digests.exactly(found)}


if __name__ == "__main__":
    main()
