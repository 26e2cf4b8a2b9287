"""Flush: skin that a muscle gathers holds more blood under each of its pores, and reddens; stretched skin pales."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import SuperLU

from ..anatomy import Face, JawMuscle, per_face
from ..array_types import Array, BoolArray
from ..geometry import cotangent_laplacian, symmetric_factors, vertex_areas

ABSORBANCE = np.array([0.012, 0.22, 0.165])
"""Of the blood in skin at rest, for red, green and blue light: hemoglobin takes most of the green."""

LEAST, MOST = -0.06, 0.35
"""How much less and more blood than at rest, by its share, skin holds at most."""


def flush(face: Face, points: Array) -> Array:
    """Return factors (n0, 3) of the color of skin, at most 1, with the vertices of a face at `points` (n0, 3).

    Blood stays with the skin that it is in, but spreads over a few millimeters: where skin covers the share s of its
    area at rest, 1 / s of the blood absorbs light (Beer and Lambert). Lids unroll, and keep their color.

    Examples
    --------
    Skin that shrinks by a fifth of its area is redder; skin that grows is paler:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> for area in (0.8, 1.05):
    ...     print(np.median(flush(face, np.sqrt(area) * face.points), axis=0).round(2))
    [1.   0.95 0.96]
    [0.99 1.   1.  ]
    """
    factors = np.exp(-blood(face, points)[:, None] * ABSORBANCE)
    return np.asarray(factors / np.maximum(factors.max(axis=1, keepdims=True), 1.0))


def blood(face: Face, points: Array) -> Array:
    """Return how much more blood (n0,) than at rest skin holds, by its share; see :func:`flush`."""
    rest, still, spread = per_face(face, "flush", None, lambda: _at_rest(face))
    change = (vertex_areas(points, face.triangles) - rest) * ~still
    return np.clip(1.0 / np.maximum(1.0 + spread.solve(change), 0.1) - 1.0, LEAST, MOST)


def _at_rest(face: Face) -> tuple[Array, BoolArray, SuperLU]:
    """Areas (n0,) of the vertices, which of them go with a lid (n0,), and the factors of diffusion."""
    areas, still = vertex_areas(face.points, face.triangles), np.zeros(len(face.points), bool)
    for name, joint in face.joint_weights.items():
        if not isinstance(face.muscles[name], JawMuscle):
            still[joint.vertices] = True
    reach = 9.0 * face.frame.scale  # over which blood gets from gathered to stretched skin: 9 mm on an average face
    spread = diags_array(areas) + reach**2 * cotangent_laplacian(face.points, face.triangles)
    return areas, still, symmetric_factors(csc_array(spread))
