"""The shading of furrows."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from scipy.spatial.transform import Rotation

from facewrinkle.appearance.furrows import cavity_shading


def test_furrows_are_dark_and_dimples_are_not():
    """A furrow and a round pit, equally deep and wide, with as many vertices across as refinement gives them."""
    x, y = np.meshgrid(np.linspace(-8.0, 8.0, 21), np.linspace(-8.0, 8.0, 21))
    turn = Rotation.from_rotvec([0.4, 0.7, -0.2]).as_matrix()
    darkest = []
    for distance in (np.abs(x), np.hypot(x, y), np.hypot(x, y + 100.0)):
        plane = pv.StructuredGrid(x, y, 0.0 * x).extract_surface(algorithm=None).triangulate()
        plane.point_data["rest"] = plane.points @ turn.T
        plane.point_data["W"] = -np.exp(-((distance.T.ravel() / 2.0) ** 2))
        shade = cavity_shading(plane)
        assert shade.shape == (plane.n_points, 3)
        darkest.append(255 - int(shade[:, 1].min()))
        assert (shade[:, 0] >= shade[:, 1]).all()
        assert (shade[plane["W"] > -1e-3] == 255).all()
    assert darkest[0] > 80
    assert darkest[1] < 0.25 * darkest[0]
    assert darkest[2] == 0
