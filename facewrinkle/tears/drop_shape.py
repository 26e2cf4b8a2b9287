"""The shape of a tear that drips, as formulas: a surface of revolution, its volume and its mesh (Section 4.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from ..errors import ParameterError, check_range
from ..geometry.rings import ring_triangles

SHARPEST = 0.3228764
"""The t at which the pointed end is slimmest: its half angle's tangent is 2 / (ratio t sin(2 pi t))."""

NODES, NODE_WEIGHTS = np.polynomial.legendre.leggauss(48)
"""Nodes in [-1, 1], and weights, of the quadrature over the drop."""


@dataclass(frozen=True)
class DropShape:
    """The shape of a tear that drips.

    Attributes
    ----------
    ratio : float
        beta / alpha of the formula, see :func:`profile`: from 10 on the drop is slim.
    t : tuple of float
        The formula's t at birth and at the end of the fall; the drop pinches off at 0.3229, where its tip is sharpest.
    stretch : float
        Share by which the drop is drawn out while it pinches off; it swings back as it falls.

    Examples
    --------
    A slim drop that is drawn out to twice its ratio while it pinches off:

    >>> import facewrinkle as fw
    >>> tear = fw.DrippingTear(shape=DropShape(ratio=12.0, stretch=1.0))
    >>> _, alpha, beta = tear.sizes(tear.begin + tear.hang)
    >>> round(beta / alpha, 9)
    24.0
    """

    ratio: float = 7.0
    t: Sequence[float] = (0.22, 0.4)
    stretch: float = 0.25

    def __post_init__(self) -> None:
        check_range("ratio", self.ratio, 1.0, 100.0)
        check_range("stretch", self.stretch, 0.0, 2.0)
        if not isinstance(self.t, Sequence) or len(self.t) != 2:
            raise ParameterError(f"t must be two numbers, those at birth and at the end, received {self.t!r}.")
        for t in self.t:
            check_range("each t of the shape", t, 0.05, 0.49)


def profile(u: npt.ArrayLike, t: float, alpha: float, beta: float) -> tuple[Array, Array]:
    """Radius and position along the axis, which points down, of the drop: a surface of revolution.

    ``alpha sin(u)/cos(t u)`` and ``beta cos(t u)``; the paper's term ``lambda t``, the fall, has a clock of its own
    here. The round end, at u = 0, leads.

    Parameters
    ----------
    u : array_like
        In [0, pi].
    t : float
        In (0, 1/2): a flat disc near 0, singular at 1/2; 0.1 to 0.45 are drops.
    alpha, beta : float
        Sizes across and along.

    Raises
    ------
    ParameterError
        For t outside (0, 1/2).

    Examples
    --------
    >>> radius, axis = profile([0.0, np.pi], 0.3, 1.0, 5.0)
    >>> radius.round(12).tolist(), axis.round(3).tolist()
    ([0.0, 0.0], [5.0, 2.939])
    """
    t, angle = check_range("t", t, 1e-3, 0.499, "0.1 to 0.45 are drops."), np.asarray(u, dtype=np.float64)
    return np.asarray(alpha * np.sin(angle) / np.cos(t * angle)), np.asarray(beta * np.cos(t * angle))


def moments(t: float, alpha: float, beta: float) -> tuple[float, float]:
    """Volume of the drop, and the position of its centre of mass along the axis.

    For the drop the volume is ``pi alpha^2 beta t`` times the integral of ``sin(u)^2 sin(t u)/cos(t u)^2``.

    Examples
    --------
    >>> round(moments(0.2, 1.0, 5.0)[0], 4), round(moments(0.4, 1.0, 5.0)[0], 4)
    (1.7496, 11.3555)
    """
    u = 0.5 * np.pi * (NODES + 1.0)
    radius, axis = profile(u, t, alpha, beta)
    share = 0.5 * np.pi * NODE_WEIGHTS * np.pi * radius**2 * beta * t * np.sin(t * u)
    return float(share.sum()), float(share @ axis / share.sum())


class DropLattice:
    """Rings of points on the surface of a drop, and the triangles between them.

    Parameters
    ----------
    n : int
        Points of a ring.

    Attributes
    ----------
    triangles : ndarray of int32, shape (m, 3)
        Of a closed surface.

    Examples
    --------
    Its facets are chords, so that the mesh has a little less volume than the drop of the formula, 11.36:

    >>> lattice = DropLattice(40)
    >>> round(lattice.volume(0.4, 5.0), 2), lattice.points(0.4, 1.0, 5.0).shape
    (11.25, (842, 3))
    """

    def __init__(self, n: int) -> None:
        rings = n // 2 + 1
        self._u = np.pi * np.linspace(0.0, 1.0, rings + 2)
        angle = 2.0 * np.pi * np.arange(n) / n
        self._circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        self.triangles = ring_triangles(n, rings, start=1, first=0, last=1 + n * rings, diagonal="ac")

    def volume(self, t: float, ratio: float) -> float:
        """Volume of the mesh of a drop with alpha = 1: frusta of regular polygons."""
        radius, axis = profile(self._u, t, 1.0, ratio)
        n = len(self._circle)
        between = (radius[1:] ** 2 + radius[1:] * radius[:-1] + radius[:-1] ** 2) / 3.0
        return float(0.5 * n * np.sin(2.0 * np.pi / n) * (between @ (axis[:-1] - axis[1:])))

    def points(self, t: float, alpha: float, beta: float) -> Array:
        """Points (n, 3) of a drop, with the axis along the third coordinate."""
        radius, axis = profile(self._u, t, alpha, beta)
        n = len(self._circle)
        out = np.zeros((n * (len(axis) - 2) + 2, 3))
        out[1:-1, :2] = (radius[1:-1, None, None] * self._circle).reshape(-1, 2)
        out[:, 2] = np.concatenate([axis[:1], np.repeat(axis[1:-1], n), axis[-1:]])
        return out
