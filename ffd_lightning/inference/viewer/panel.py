"""The inputs and texts of one visitor's page."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, cast, get_args

from ffd_lightning.inference.pieces import MeshColors
from ffd_lightning.inference.viewer.exhibit import DrawingOptions
from ffd_lightning.inference.viewer.library import Library
from ffd_lightning.inference.viewer.panel_text import heading
from ffd_lightning.inference.viewer.photo import Photo
from ffd_lightning.inference.viewer.template_list import TemplateList

_BOXES = {
    "template": ("Template", True),
    "mesh": ("Deformed mesh", True),
    "cloud": ("Deformed cloud", False),
    "truth": ("Ground truth", True),
    "truth_cloud": ("Ground truth cloud", False),
    "cage": ("Control lattice", True),
    "first_cage": ("Lattice before", False),
    "handles": ("Control points", True),
}


class Panel:
    """Everything beside the scene; what it does is told by whoever listens to it.

    Args:
        gui: viser's, of one client.
        library: the networks and the test shapes.
        changed: called when something is to be drawn anew; it must return at once.
    """

    def __init__(self, gui: Any, library: Library, changed: Callable[[], None]) -> None:
        several = len(library.titles) > 1
        gui.add_html(heading(library.titles, library.heading, library.note))
        with gui.add_folder("Input"):
            self._add_input(gui, library)
        self.lists = [
            TemplateList(
                gui,
                f"Templates: {title.text}" if several else "Templates",
                partial(library.thumbnail, k),
                2 if several else 4,
                changed,
            )
            for k, title in enumerate(library.titles)
        ]
        with gui.add_folder("Deformation", visible=False) as deformation:
            self.amount = gui.add_slider(
                "Amount", 0.0, 1.5, 0.01, 1.0, hint="0 the template, 1 the network's deformation"
            )
            self.scores = gui.add_markdown("")
            gui.add_markdown(
                "Drag a control point to pull at the shape; click it for arrows along the axes."
            )
            self.reset = gui.add_button("Reset", icon="rotate", hint="amount 1, no point pulled")
        with gui.add_folder("Show", visible=False) as show:
            self._add_show(gui, changed)
        label = "Save meshes (GLB)" if several else "Save mesh (GLB)"
        self.save = gui.add_button(label, icon="download", visible=False)
        self._parts = (deformation, show, self.save)
        self.amount.on_update(lambda _: changed())

    def _add_input(self, gui: Any, library: Library) -> None:
        self.shape: Any = None
        if ids := library.shape_ids:
            self.shape = gui.add_dropdown("Test shape", ids, hint="type to search")
            self.step = gui.add_button_group("", ("previous", "next", "random"))
            self.view = gui.add_slider(
                "View", 1, max(2, library.views), 1, 1, visible=library.views > 1
            )
            self.back = gui.add_button("Back to the test shape", icon="arrow-left", visible=False)
        self.photo = gui.add_upload_button("Open a photo", icon="photo-up", mime_type="image/*")
        self._masking = gui.add_folder(None, visible=False)  # viser hides no upload button alone
        with self._masking:
            self.mask = gui.add_upload_button(
                "Open a mask",
                icon="mask",
                mime_type="image/*",
                hint="bright where its object is, of the photo's size",
            )
            self.unmask = gui.add_button("Without the mask", icon="mask-off", visible=False)
        self.input = gui.add_html("")

    def _add_show(self, gui: Any, changed: Callable[[], None]) -> None:
        self.layout = gui.add_dropdown("Arrange", ("side by side", "overlaid"))
        self.colors = gui.add_dropdown("Colours", list(get_args(MeshColors)))
        self.legend = gui.add_html("", visible=False)
        self.boxes = {key: gui.add_checkbox(label, on) for key, (label, on) in _BOXES.items()}
        self.camera = gui.add_button("Camera as at first", icon="camera")
        for handle in (self.layout, self.colors, *self.boxes.values()):
            handle.on_update(lambda _: changed())

    def show_all(self, truth: bool, parts: bool) -> None:
        """Show what there is only once something is reconstructed.

        Args:
            truth: whether the ground truth is known.
            parts: whether parts are.
        """
        for part in self._parts:
            part.visible = True
        for key in ("truth", "truth_cloud"):
            self.boxes[key].visible = truth
        self.colors.visible = parts

    def show_photo(self, photo: Photo | None) -> None:
        """Show what can be done with the photograph that was opened last, None for none."""
        self._masking.visible = photo is not None
        if photo is not None:
            self.mask.label = f"Open a mask for {photo.name}"
            self.unmask.visible = photo.mask is not None
        if self.shape is not None:
            self.back.visible = photo is not None

    def drawing_options(self) -> DrawingOptions:
        """Return what is to be drawn, and how."""
        boxes = {key: bool(box.value) for key, box in self.boxes.items()}
        return DrawingOptions(self.mesh_colors(), self.layout.value == "side by side", **boxes)

    def mesh_colors(self) -> MeshColors:
        """Return what the colours of meshes are to say."""
        return cast(MeshColors, self.colors.value)
