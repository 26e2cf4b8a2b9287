"""Where tears begin, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.errors import ParameterError, UnknownNameError
from facewrinkle.tears import lid_point


def test_a_side_that_is_none(face):
    with pytest.raises(UnknownNameError, match="unknown side 'middle'"):
        lid_point(face, "middle")


def test_a_surface_has_no_lids(face):
    with pytest.raises(ParameterError, match="has no eyes"):
        lid_point(fw.surface(face.mesh), "l")


def test_paint_of_one_height_leads_nowhere():
    flat = pv.Plane(direction=(0, 1, 0), i_size=100, j_size=100, i_resolution=4, j_resolution=4).triangulate()
    with pytest.raises(ParameterError, match="one height; a path leads downwards"):
        fw.SheddingTear(flat, weight=np.ones(flat.n_points), down=(0, -1, 0))
