"""What `make docs` adds to the pages in this folder: see https://www.mkdocs.org/dev-guide/plugins.

Pages that lie elsewhere in the project (ARCHITECTURE.md and others) or that are made of the code
(settings, commands); and equations as MathML, which browsers draw without a script.
"""

import os
import re
import sys
from html import unescape
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

sys.path.insert(0, str(Path(__file__).parent))
from reference import ELSEWHERE, MADE

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
_PAGES = {ROOT / source: DOCS / page for page, source in ELSEWHERE.items()}
_LINK = re.compile(r"(?<!!)\[([^\[\]]*)\]\(([^)\s]+)\)")
_MATH = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are not in this folder."""
    for page, source in ELSEWHERE.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        files.append(File.generated(config, page, content=_relinked(text)))
    for page, make in MADE.items():
        files.append(File.generated(config, page, content=make()))
    return files


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """Lead links out of this folder to the site's own pages; those to other files lose them."""
    folder = (DOCS / page.file.src_uri).parent

    def relinked(match: re.Match[str]) -> str:
        path, sharp, anchor = match[2].partition("#")
        target = (folder / path).resolve()
        if ":" in path or not path or DOCS in target.parents or ROOT not in target.parents:
            return match[0]
        if target not in _PAGES:
            return match[1]
        return f"[{match[1]}]({os.path.relpath(_PAGES[target], folder)}{sharp}{anchor})"

    return _LINK.sub(relinked, markdown)


def on_page_content(html: str, **_: Any) -> str:
    """Write equations as MathML."""
    return _MATH.sub(
        lambda m: convert(unescape(m[3]), display="block" if m[2] == "[" else "inline"), html
    )


def _relinked(text: str) -> str:
    """Return a page with links into docs/ as they are from there; other links lose their target."""
    text = re.sub(r"\]\((?:\.\./)*docs/", "](", text)
    pages = {Path(source).name: page for page, source in ELSEWHERE.items() if "/" not in source}
    for name, page in pages.items():
        text = text.replace(f"]({name})", f"]({page})")
    return text
