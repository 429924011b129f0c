"""Learning free-form deformations for 3D reconstruction from a single image."""

__version__ = "0.1.0"
