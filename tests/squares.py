"""Unit squares of triangles, for charts and meshes in them; and sheets that are pressed together."""

from __future__ import annotations

import numpy as np

import facewrinkle as fw


def grid(n: int) -> np.ndarray:
    """Quads of an n x n grid of cells, vertex (i, j) at i (n + 1) + j."""
    i, j = np.divmod(np.arange(n * n), n)
    first = i * (n + 1) + j
    return np.stack([first, first + n + 1, first + n + 2, first + 1], axis=1)


def square(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit square of n x n cells: points (k, 2) and triangles."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    quads = grid(n)
    return np.stack([x.ravel(), y.ravel()], axis=1), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def signed_areas(plane: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = np.moveaxis(plane[triangles], 1, 0)
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def pressed(sheet: fw.Face, shares: list[tuple[float, float]]) -> fw.Recorded:
    """A recording of a sheet that is pressed together by shares of its width and height, every 0.02 s by the next."""
    return fw.Recorded.of_positions([sheet.points * [1.0 - x, 1.0 - y, 1.0] for x, y in [(0.0, 0.0), *shares]], fps=50)
