"""Docstrings as the pages need them: equations and examples in the form of Markdown."""

from __future__ import annotations

import re
import textwrap
from typing import Any

import griffe

_MATH = re.compile(r":math:`([^`]+)`")
_BLOCK = re.compile(r"^( *)\.\. math::((?: .*)?(?:\n(?:\1 +.*|[ ]*(?=\n\1 )))*)", re.MULTILINE)
_EXAMPLE = re.compile(r"^( *)>>> .*(?:\n\1\S.*|\n\1 .*)*", re.MULTILINE)


class Docstrings(griffe.Extension):
    """Turns :math: roles into $...$ and lines that begin with >>> into blocks of code."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Rewrite the docstring of one object."""
        if obj.docstring is not None:
            obj.docstring.value = markdown(obj.docstring.value)


def markdown(text: str) -> str:
    """Return a docstring with equations and examples that Markdown shows."""
    text = _BLOCK.sub(lambda m: f"{m[1]}$$ {' '.join(m[2].split())} $$", text)
    text = _MATH.sub(r"$\1$", text)
    return _EXAMPLE.sub(_fenced, text)


def _fenced(found: re.Match[str]) -> str:
    lines = textwrap.dedent(found[0])
    return textwrap.indent(f"```pycon\n{lines}\n```", found[1])
