"""Wrinkles that muscles fold into faces, on PyVista meshes.

Names are loaded when they are first used, so that importing the package costs little. They are listed in
``__init__.pyi``, which is read by type checkers, editors and, here, by lazy_loader.
"""

from __future__ import annotations

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
