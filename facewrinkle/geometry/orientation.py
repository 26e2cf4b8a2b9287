"""Heights over a surface, limited so that no triangle turns over."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from . import _orientation_kernels as kernels
from ._mesh_kernels import around

LEAST = 0.05
"""The smallest share of a triangle's area that a displacement may leave, seen along its normal."""

ROUNDS = 16
"""Rounds in which heights become lower; what is still turned over then is not displaced at all."""


def unfolded_shares(points: Array, heights: Array, directions: Array, triangles: npt.NDArray[np.int32]) -> Array | None:
    """Shares (n,) of the heights that leave every triangle on the side it faces; None if all of them do.

    Heights along one direction never turn a triangle over. Where directions converge (over hollows, and where a
    triangle is small and leans) they do, as soon as the heights exceed what its size and the convergence allow.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        The bare surface.
    heights : ndarray, shape (n,)
    directions : ndarray, shape (n, 3)
        Unit normals along which heights displace it.
    triangles : ndarray of int32, shape (m, 3)

    Returns
    -------
    ndarray, shape (n,), or None
        1 except at corners of triangles that would keep less than `LEAST` of their area, seen along their normals.

    Examples
    --------
    In a trough with a radius of 1, normals meet at the height 1:

    >>> trough = np.array([[-0.6, 0.2, 0.0], [0.6, 0.2, 0.0], [0.0, 0.0, 2.0]])
    >>> inwards = np.array([[0.6, 0.8, 0.0], [-0.6, 0.8, 0.0], [0.0, 1.0, 0.0]])
    >>> triangle = np.array([[1, 0, 2]], np.int32)
    >>> unfolded_shares(trough, np.full(3, 0.8), inwards, triangle) is None
    True
    >>> unfolded_shares(trough, np.full(3, 1.9), inwards, triangle).round(3)
    array([0.5, 0.5, 0.5])
    """
    heights = np.array(heights, np.float64)
    shares, factors = np.ones(len(heights)), np.ones(len(heights))
    for k in range(ROUNDS):
        # What lowers one triangle tilts the next: each round aims at the full share, and demands less of it.
        demanded = LEAST * (1.0 - k / ROUNDS)
        if not kernels.limit(points, heights, directions, triangles, demanded, LEAST, factors):
            return shares if k else None
        shares *= factors
        heights *= factors
        factors[:] = 1.0
    while kernels.limit(points, heights, directions, triangles, 0.0, LEAST, factors):
        heights[factors < 1.0] = shares[factors < 1.0] = 0.0
        factors[:] = 1.0
    return shares


def unfolded_slides(points: Array, lifted: Array, slides: Array, triangles: npt.NDArray[np.int32]) -> Array:
    """Return slides (n, 3) of a lifted surface, shorter where they would turn a triangle over.

    Parameters
    ----------
    points, lifted : ndarray, shape (n, 3)
        The bare surface, and the surface with heights that turn none of its triangles over.
    slides : ndarray, shape (n, 3)
        Further displacement, along the surface.
    triangles : ndarray of int32, shape (m, 3)

    Examples
    --------
    A corner that would slide beyond the opposite side keeps a twentieth of its distance:

    >>> flat, slides = np.array([[0.0, 0, 0], [2, 0, 0], [0, 1, 0]]), np.array([[0.0, 0, 0], [0, 0, 0], [0, -2, 0]])
    >>> unfolded_slides(flat, flat, slides, np.array([[0, 1, 2]], np.int32))[2].round(9).tolist()
    [0.0, -0.95, 0.0]
    """
    slides, factors, near = np.array(slides, np.float64), np.ones(len(slides)), triangles
    for k in range(ROUNDS):
        demanded = LEAST * (1.0 - k / ROUNDS)
        if not kernels.limit_slides(points, lifted, slides, near, demanded, LEAST, factors):
            return slides
        slides *= factors[:, None]
        near = around(triangles, (factors < 1.0).astype(np.uint8))  # no others changed
        factors[:] = 1.0
    while kernels.limit_slides(points, lifted, slides, near, 0.0, LEAST, factors):
        slides[factors < 1.0] = 0.0
        near = around(triangles, (factors < 1.0).astype(np.uint8))
        factors[:] = 1.0
    return slides
