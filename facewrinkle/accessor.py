"""``mesh.facewrinkle``: what can be laid on any PolyData, beside PyVista's own filters.

PyVista finds this module through the entry point group ``pyvista.accessors`` and imports it when ``mesh.facewrinkle`` is
first used; importing it by hand does the same.
"""

from __future__ import annotations

import pyvista as pv


@pv.register_dataset_accessor("facewrinkle", pv.PolyData)
class FaceWrinkleAccessor:
    """The namespace ``mesh.facewrinkle``. Each method returns a new mesh and leaves `mesh` as it is.

    Parameters
    ----------
    mesh : PolyData
    """

    def __init__(self, mesh: pv.PolyData) -> None:
        self._mesh = mesh
