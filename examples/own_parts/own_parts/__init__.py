"""Parts of one's own for ffd_lightning: importing this registers them."""

from own_parts import augmentation, boxes, encoder, extents, objective, templates

__all__ = ["augmentation", "boxes", "encoder", "extents", "objective", "templates"]
