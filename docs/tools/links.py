"""Looks for links that lead nowhere: in the files of a checkout, and in the built site.

    python docs/tools/links.py            # *.md, as a code host or an editor shows them
    python docs/tools/links.py site       # the pages that `make docs` has built

Pages of the project are followed, with their anchors; addresses on the web are not.
"""

import re
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

ROOT = Path(__file__).parents[2]
FOLDERS = ("docs", "benchmarks", "examples", "ffd_lightning")
TEMPLATES = ROOT / "docs" / "tools"  # of pages: their links are as from there

_CODE = re.compile(r"^(```|~~~).*?^\1[^\n]*$|`[^`\n]*`", re.DOTALL | re.MULTILINE)
_LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
_HEADING = re.compile(r"^#{1,6} +(.+?) *$", re.MULTILINE)


class _Page(HTMLParser):
    """What an HTML page links to, and the anchors that it has."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note links, pictures and anchors."""
        for name, value in attrs:
            if name in ("href", "src") and value:
                self.links.append(value)
            elif name in ("id", "name") and value:
                self.anchors.add(value)


def markdown(text: str) -> tuple[list[str], set[str]]:
    """Return the links and the anchors of a page; anchors are made as GitHub makes them."""
    html = _Page(_CODE.sub("", text))
    anchors = set(html.anchors)
    without_blocks = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    for heading in _HEADING.findall(without_blocks):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()
        slug = re.sub(r"[^\w\- ]", "", words).strip().replace(" ", "-")
        count = 0
        while (name := f"{slug}-{count}" if count else slug) in anchors:
            count += 1
        anchors.add(name)
    return _LINK.findall(_CODE.sub("", text)) + html.links, anchors


def html(text: str) -> tuple[list[str], set[str]]:
    """Return the links and the anchors of a page."""
    page = _Page(text)
    return page.links, page.anchors


def checkout() -> list[Path]:
    """Return the pages that a checkout has."""
    found = [page for folder in FOLDERS for page in (ROOT / folder).rglob("*.md")]
    return [*ROOT.glob("*.md"), *(page for page in found if TEMPLATES not in page.parents)]


def dead(pages: Iterable[Path]) -> Iterator[tuple[Path, str]]:
    """Yield (page, link) of links to what is not there; pages are .md or .html."""

    @cache
    def known(file: Path) -> tuple[list[str], set[str]]:
        read = markdown if file.suffix == ".md" else html
        return read(file.read_text(encoding="utf-8"))

    for page in sorted(pages):
        for link in known(page)[0]:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc or parts.path.startswith("/"):
                continue
            target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            anchored = target.suffix in (".md", ".html") and parts.fragment
            if not target.exists() or (
                anchored and unquote(parts.fragment) not in known(target)[1]
            ):
                yield page, link


def main() -> None:
    """Print the dead links of the checkout or, where a folder is named, of the site in it."""
    found = [*dead(Path(sys.argv[1]).rglob("*.html") if sys.argv[1:] else checkout())]
    for page, link in found:
        print(f"{page}: {link}")
    sys.exit(f"{len(found)} links lead nowhere" if found else 0)


if __name__ == "__main__":
    main()
