"""What is written in the project's documents: blocks of code, commands, links."""

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = sorted(
    [
        *ROOT.glob("*.md"),
        *ROOT.glob("docs/*.md"),
        *ROOT.glob("docs/notebooks/*.md"),
        *ROOT.glob("docs/findings/*.md"),
    ]
    + [ROOT / "benchmarks/README.md", ROOT / "ffd_lightning/pretrained/README.md"]
)
_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def name(path):
    return str(path.relative_to(ROOT))


def blocks(path, language):
    """Return the fenced blocks of a language."""
    return [code for word, code in _BLOCK.findall(path.read_text("utf-8")) if word == language]


def commands(path):
    """Return (subcommand, arguments) of each line that calls this project."""
    found = []
    for block in blocks(path, ""):
        for line in block.replace("\\\n", " ").splitlines():
            called = re.match(r"(?:python (\w+)\.py|ffd (\w+))( .*|$)", line)
            if called:
                words = shlex.split(called[3], comments=True)
                found.append((called[1] or called[2], words))
    return [(command, rest) for command, rest in found if not {"...", "->"} & set(rest)]
