"""Examples in docstrings, lines that begin with >>>, as the blocks of code that Markdown shows."""

import re
import textwrap
from typing import Any

import griffe

_EXAMPLE = re.compile(r"^( *)>>> .*(?:\n\1\S.*|\n\1 .*)*", re.MULTILINE)


class Docstrings(griffe.Extension):
    """Puts the examples of all objects into blocks of code."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Rewrite the docstring of one object."""
        if obj.docstring is not None:
            obj.docstring.value = _EXAMPLE.sub(_fenced, obj.docstring.value)


def _fenced(found: re.Match[str]) -> str:
    return textwrap.indent(f"```pycon\n{textwrap.dedent(found[0])}\n```", found[1])
