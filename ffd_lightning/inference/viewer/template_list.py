"""The panel's list of a network's templates, to choose from."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ffd_lightning.inference.viewer.panel_text import (
    category_labels,
    shown_template,
    template_pictures,
)
from ffd_lightning.inference.viewer.session import Session


class TemplateList:
    """Pictures of templates by weight, a button for each rank, and a choice of categories.

    Args:
        gui: viser's, of one client.
        label: of the folder.
        thumbnail: returns the address of a template's picture.
        rows: of pictures that are seen without scrolling.
        changed: called when another one was chosen; it must return at once.
    """

    def __init__(
        self,
        gui: Any,
        label: str,
        thumbnail: Callable[[int], str],
        rows: int,
        changed: Callable[[], None],
    ) -> None:
        self._thumbnail, self._rows, self._changed = thumbnail, rows, changed
        self._rank = 0
        self.folder = gui.add_folder(label, visible=False)
        with self.folder:
            self.category = gui.add_dropdown("Category", ("-",), hint="name, weight")
            self.pictures = gui.add_html("")
            self.ranks = gui.add_button_group("Rank", ("1",), hint="or click a picture")
            self.text = gui.add_markdown("")
        self.category.on_update(lambda _: changed())
        self.ranks.on_click(lambda event: self.choose(int(event.target.value) - 1))

    def choose(self, rank: int) -> None:
        """Choose the template of a rank, the best being 0."""
        self._rank = rank
        self._changed()

    def open(self, session: Session) -> None:
        """List the templates of another input, of which the best is chosen."""
        labels = category_labels(session)
        self.category.options = labels
        self.category.value = labels[0]
        self.category.visible = len(labels) > 1
        self.folder.visible = True
        self._list(session)

    def apply(self, session: Session) -> None:
        """Let a session have what is chosen."""
        names = list(session.reconstruction.category_weights)
        asked = names[category_labels(session).index(self.category.value)]
        if asked != session.reconstruction.category:
            session.choose_category(asked)
            self._list(session)
        ranking = session.reconstruction.ranking
        # A button may have been clicked that another category had.
        session.template = int(ranking[min(self._rank, len(ranking) - 1)])

    def refresh(self, session: Session) -> None:
        """Say which one is shown."""
        self.pictures.content = template_pictures(session, self._thumbnail, self._rows)
        self.text.content = shown_template(session)

    def _list(self, session: Session) -> None:
        self._rank = 0
        count = len(session.reconstruction.ranking)
        self.ranks.options = tuple(str(rank + 1) for rank in range(count))
