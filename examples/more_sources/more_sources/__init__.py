"""ModelNet and Pix3D as sources of shapes: importing this registers them."""

from more_sources import modelnet, pix3d

__all__ = ["modelnet", "pix3d"]
