"""Learning free-form deformations for 3D object reconstruction from a single image.

Everything that a script needs is here, loaded when it is first used; `__init__.pyi` lists it.
"""

import lazy_loader

__version__ = "0.2.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
