"""What a visitor's page asks for."""

from __future__ import annotations

from typing import Protocol

from ffd_lightning.imaging.camera import Camera
from ffd_lightning.inference.viewer.photo import Photo
from ffd_lightning.inference.viewer.session import NetworkTitle, Session


class Library(Protocol):
    """What all visitors share: one network, or two, and their test shapes.

    Attributes:
        titles: of the networks.
        heading: what is looked at.
        note: what visitors should know.
        shape_ids: the test shapes.
        views: images of each.
        camera: that the page begins with.
        photo: that visitors see first, None for the first test shape.
    """

    titles: tuple[NetworkTitle, ...]
    heading: str
    note: str
    shape_ids: tuple[str, ...]
    views: int
    camera: Camera
    photo: Photo | None

    def thumbnail(self, network: int, template: int) -> str:
        """Return the address of a picture of a network's template."""
        ...

    def open_shape(self, shape_id: str, view: int) -> tuple[Session, ...]:
        """Reconstruct a test shape from one of its images, by each network."""
        ...

    def open_photo(self, photo: Photo) -> tuple[Session, ...]:
        """Reconstruct what a photograph shows, by each network."""
        ...
