"""Meshes to try things on. The built-in face is :func:`facewrinkle.default_face`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyvista as pv

__all__ = ["load_pig"]


def load_pig() -> pv.PolyData:
    """Return the head of a pig, without eyes and without anatomy, for patterns and tears.

    Returns
    -------
    PolyData
        A closed surface of 16,000 triangles, in mm, y up and looking along +z, subdivided from a cage of 4,000 (Loop).

    Examples
    --------
    >>> import facewrinkle as fw
    >>> pig = fw.examples.load_pig()
    >>> frown = pig.facewrinkle.pattern("frown", center=(0, 46, 68), up=(0, 1, -0.8), size=(60, 50), depth=8.0)
    >>> pig.n_cells < frown.n_cells
    True
    """
    with np.load(Path(__file__).parent / "data" / "pig_cage.npz") as cage:
        return pv.PolyData.from_regular_faces(cage["points"].astype(float), cage["triangles"]).subdivide(1, "loop")
