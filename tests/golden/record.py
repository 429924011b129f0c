"""Write the golden files anew, or compare all results of this machine to the last bit.

python tests/golden/record.py                 after results were meant to change
python tests/golden/record.py --exact         write all bits to exact.json, or to --file FILE
python tests/golden/record.py --compare       say which results have other bits than that file's

Bits depend on the processor and on torch: exact.json says which it was recorded with, and is
compared on such a machine alone. On any other, record a file before a change and compare with it
after the change.
"""

import argparse
import json
import os
import platform
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
sys.path.insert(0, str(Path(__file__).parents[2]))  # this checkout, whatever is installed

import digests
import numba
import numpy as np
import subjects
import torch

SHOWN = 40


def main() -> int:
    """Do what the command line says."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    action = parser.add_mutually_exclusive_group()
    action.add_argument("--exact", action="store_true", help="write full digits")
    action.add_argument("--compare", action="store_true", help="compare full digits")
    default = digests.FOLDER / "exact.json"
    parser.add_argument("--file", type=Path, default=default, help="of the full digits")
    given = parser.parse_args()
    torch.set_num_threads(1)  # sums depend on how they are split
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if given.exact:
            content = {"machine": _machine(), "digests": _exact(folder)}
            given.file.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
            print(given.file)
        elif given.compare:
            return _compare(given.file, folder)
        else:
            for kind, make in digests.KINDS.items():
                print(digests.write(kind, make(folder)))
    return 0


def _compare(file: Path, folder: Path) -> int:
    """Return 0 where all bits are those of a file, else 1, or 2 where they cannot be compared."""
    stored = json.loads(file.read_text(encoding="utf-8"))
    if stored["machine"] != _machine():
        print(f"{file} is of another machine: {stored['machine']}, here {_machine()}")
        return 2
    changed = list(digests.differences(stored["digests"], _exact(folder), exact=True))
    print(*changed[:SHOWN], f"{len(changed)} results have other bits", sep="\n")
    return bool(changed)


def _machine() -> dict[str, str]:
    """Return what the last bits depend on."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text(encoding="utf-8").splitlines() if cpuinfo.is_file() else []
    names = [line.split(": ")[1] for line in lines if line.startswith("model name")]
    return {
        "processor": names[0] if names else platform.processor(),
        "instructions": torch.backends.cpu.get_cpu_capability(),
        "torch": torch.__version__,
        "numpy": np.__version__,
        "numba": numba.__version__,
        "OPENBLAS_CORETYPE": os.environ.get("OPENBLAS_CORETYPE", ""),
    }


def _exact(folder: Path) -> dict[str, object]:
    """Return every subject with all its digits."""
    known = digests.read("shapes")["digests"]
    found = {
        "versions": subjects.versions(),
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
        "runs": {name: subjects.run(name, folder) for name in subjects.RUNS},
        "report": subjects.report(folder),
        "resumed": subjects.resumed(folder),
        "prediction": subjects.prediction(),
    }
    return digests.exactly(found)


if __name__ == "__main__":
    sys.exit(main())
