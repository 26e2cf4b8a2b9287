"""Shared by tests of pictures: held expressions, places on the screen, differences of pictures."""

from functools import cache

import numpy as np
import pyvista as pv
from expressions import after
from real_faces import built_in

import facewrinkle as fw

SMALL = (160, 200)


@cache
def held(expression: str, wrinkles: bool = True) -> pv.PolyData:
    """The built-in face with an expression, or action unit, held for 15 frames. Not to be changed. Its lines are twice
    as deep as those of the young, so that they are seen in small pictures.
    """
    face = built_in()
    return after(
        fw.Simulation(face, layers=fw.fold_layers(face, "wave", depth=2.0) if wrinkles else []), expression, 15
    )


def difference(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Per pixel, the largest difference of the channels."""
    return np.abs(first.astype(int) - second.astype(int)).max(axis=2)


def on_screen(scene: fw.plotting.Scene, points: np.ndarray) -> np.ndarray:
    """Pixels [row, column] of points, as VTK's own camera projects them."""
    width, height = scene.style.size
    matrix = scene.plotter.camera.GetCompositeProjectionTransformMatrix(width / height, -1, 1)
    projection = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
    clip = np.column_stack([points, np.ones(len(points))]) @ projection.T
    x, y = (clip[:, :2] / clip[:, 3:]).T
    return np.column_stack([(1 - y) / 2 * height, (x + 1) / 2 * width])
