"""Tears that drip: a drop that grows at the lid, pinches off, and falls while its shape changes (Section 4.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy import Face, millimeters
from ..array_types import Array, IntArray
from ..checks import vector
from ..errors import ParameterError, check_range, check_ranges, check_whole
from ..geometry import heights_above, overlapping, ring_triangles, smoothstep, vertex_normals
from ..mesh import MeshLike, to_polydata
from .support_surface import SupportSurface, directions, support_surface

SHARPEST = 0.3228764
"""The t at which the pointed end is slimmest: its half angle's tangent is 2 / (ratio t sin(2 pi t))."""

NODES, NODE_WEIGHTS = np.polynomial.legendre.leggauss(48)
"""Nodes in [-1, 1], and weights, of the quadrature over the drop: finding them takes a millisecond."""


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
        check_ranges(self, ratio=(1.0, 100.0), stretch=(0.0, 2.0))
        if not isinstance(self.t, Sequence) or len(self.t) != 2:
            raise ParameterError(f"t must be two numbers, those at birth and at the end, received {self.t!r}.")
        for t in self.t:
            check_range("each t of the shape", t, 0.05, 0.49)


@dataclass(frozen=True)
class Fall:
    """The fall of a tear that drips.

    Attributes
    ----------
    depth : float
        Depth to which the tear is followed, mm.
    speed : float, optional
        Constant speed in place of free fall, mm / s: the paper's lambda.

    Examples
    --------
    A drop that hangs for 0.8 s, and then falls 50 mm within half a second:

    >>> import facewrinkle as fw
    >>> tear = fw.DrippingTear(fall=Fall(depth=50.0, speed=100.0))
    >>> tear.hang, tear.end
    (0.8, 1.3)
    """

    depth: float = 300.0
    speed: float | None = None

    def __post_init__(self) -> None:
        check_range("depth", self.depth, 1e-6, 1e9)
        if self.speed is not None:
            check_range("speed", self.speed, 1e-3, 1e9)


@dataclass(frozen=True, eq=False)
class Sampled:
    """A tear at f times, in the unit of its surface: for animated files. Before and after, it is a point.

    Attributes
    ----------
    points, normals : ndarray, shape (f, n, 3)
    triangles : ndarray of int32, shape (m, 3)

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face, times = fw.default_face(), [0.5, 1.0, 1.5]
    >>> tear = fw.SheddingTear(face, start="l")
    >>> sampled = tear.sampled(times, [face.mesh] * 3)
    >>> sampled.points.shape == (3, *sampled.normals.shape[1:]), int(sampled.triangles.max()) < sampled.points.shape[1]
    (True, True)
    """

    points: Array
    normals: Array
    triangles: IntArray

    @classmethod
    def of(cls, tear: Any, times: Sequence[float] | Array, frames: Sequence[pv.PolyData]) -> Sampled | None:
        """Return a tear at times on frames of its surface; None if it is there at none of the times."""
        found = {
            k: tear.surface(t, on)
            for k, (t, on) in enumerate(zip(times, frames, strict=True))
            if tear.begin <= t <= tear.end
        }
        if not found:
            return None
        first, last = min(found), max(found)
        points, normals = [], []
        for k in range(len(times)):
            mesh = found.get(k, found[first if k < first else last])
            places = np.asarray(mesh.points, np.float64)
            points.append(places if k in found else np.broadcast_to(places.mean(axis=0), places.shape))
            normals.append(np.asarray(mesh.point_data["Normals"], np.float64))
        return cls(np.stack(points), np.stack(normals), np.asarray(found[first].regular_faces, np.int32))


class DrippingTear:
    """A tear that drips: it grows at the lid, pinches off, and falls freely past the chin.

    Parameters
    ----------
    surface : Face, or any mesh that `read_surface` takes, optional
        The surface at which the tear is born, and which it must not enter. Default: none.
    start : array_like, shape (3,), or {"l", "r"}
        A point of the surface, or the eye of a Face, from whose lower lid the tear drips.
    size : float
        Diameter of the ball of the same volume, mm.
    begin, hang : float
        Seconds at which it appears, and for which it grows until it falls.
    shape : DropShape, optional
        The shape of the drop, and its change over time.
    fall : Fall, optional
        Depth of the fall, and its speed.
    resolution : int
        Points around the drop.
    down : array_like, shape (3,), optional
        Default: down the face; -y on other surfaces.
    units : {"um", "mm", "cm", "dm", "m", "in"} or float
        Unit of a surface that is no Face, or millimeters per unit.

    Attributes
    ----------
    begin, end : float
        Seconds between which there is a tear.
    diameter, volume : float
        Volume of the falling drop and diameter of a ball of this volume, in the unit of the surface.

    Raises
    ------
    ParameterError
        For a number out of its range, a start off the surface, or a drop too large for the surface.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> tear = DrippingTear(fw.default_face(), "l")
    >>> mesh = tear.surface(0.5 * (tear.begin + tear.end))
    >>> mesh.n_open_edges, bool(mesh.volume > 0.0)
    (0, True)
    """

    def __init__(
        self,
        surface: Face | MeshLike | None = None,
        start: npt.ArrayLike | str = (0.0, 0.0, 0.0),
        *,
        size: float = 3.0,
        begin: float = 0.0,
        hang: float = 0.8,
        shape: DropShape | None = None,
        fall: Fall | None = None,
        resolution: int = 40,
        down: npt.ArrayLike | None = None,
        units: str | float = "mm",
    ) -> None:
        self.shape, self.fall = shape or DropShape(), fall or Fall()
        self.begin, self.hang = check_range("begin", begin, 0.0, 1e9), check_range("hang", hang, 1e-3, 1e9)
        self._support = support = None if surface is None else support_surface(surface, down, units)
        self.down, self.forward = directions(down) if support is None else (support.down, support.forward)
        self._side = np.cross(self.down, self.forward)
        unit = millimeters(units) if support is None else support.unit
        self.diameter = check_range("size", size, 1e-6, 1e9) / unit
        self.volume = np.pi / 6.0 * self.diameter**3
        self._depth = self.fall.depth / unit
        self._rate = (self.fall.speed or 9810.0) / unit  # gravity, mm / s^2
        seconds = self._depth / self._rate if self.fall.speed else (2.0 * self._depth / self._rate) ** 0.5
        self.end = self.begin + self.hang + seconds
        if support is None:
            self._start, self._bound = vector("start", start), None
        else:
            support.check_size(self.diameter)
            self._start = support.start(start, max(self.diameter, 0.02 * support.size))
            self._bound = support.bound(self._start[None])
        self._lattice = DropLattice(check_whole("resolution", resolution, 6, 512))

    # --- clocks --------------------------------------------------------------------------------

    def fallen(self, t: float) -> float:
        """Return the depth that the centre has fallen at t since the drop pinched off, in the unit of the surface."""
        seconds = max(t - self.begin - self.hang, 0.0)
        return self._rate * seconds if self.fall.speed else 0.5 * self._rate * seconds**2

    def sizes(self, t: float) -> tuple[float, float, float]:
        """Return the formula's t, alpha and beta at time t: a drop of the volume that it has then."""
        grown, s, shape = self._grown(t), self._parameter(t), self.shape
        seconds = max(t - self.begin - self.hang, 0.0)
        # After it has pinched off, it swings in 0.06 s; a 3 mm drop of water rings faster, at some 60 Hz.
        swing = float(np.exp(-seconds / 0.05) * np.cos(2.0 * np.pi * seconds / 0.06))
        ratio = shape.ratio * (1.0 + shape.stretch * grown**4 * swing)
        at_birth = 0.03
        volume = self.volume * (at_birth + (1.0 - at_birth) * float(smoothstep(grown)))
        alpha = float((volume / self._lattice.volume(s, ratio)) ** (1.0 / 3.0))
        return s, alpha, ratio * alpha

    def _parameter(self, t: float) -> float:
        """Return the t of the formula at time t."""
        grown, low, high = self._grown(t), *self.shape.t
        pinch = float(np.clip(SHARPEST, min(low, high), max(low, high)))
        if grown < 1.0:
            return low + (pinch - low) * grown
        return pinch + (high - pinch) * float(smoothstep(self.fallen(t) / self._depth))

    def _grown(self, t: float) -> float:
        """Return how far the drop has grown at time t, from 0 to 1."""
        return min((t - self.begin) / self.hang, 1.0)

    # --- the mesh ------------------------------------------------------------------------------

    def surface(self, t: float, on: pv.PolyData | None = None) -> pv.PolyData:
        """Return the drop at time t.

        Parameters
        ----------
        t : float
            Seconds, from `begin` to `end`.
        on : PolyData, optional
            The face at this time. The tear hangs at its lid, and falls from there.

        Returns
        -------
        PolyData
            Closed, of genus 0, oriented outwards; with "Normals", and for :class:`facewrinkle.plotting.TearScene`
            "thickness" and "under", the direction to the skin's outside.

        Raises
        ------
        ParameterError
            For t outside [begin, end].
        MeshError
            For a frame of another surface.
        """
        t = check_range("t", t, self.begin, self.end, "There is no drop at other times.")
        skin = None if self._support is None else self._support.in_frame(on)[0]
        local = self._lattice.points(*self.sizes(t))
        local[:, 2] += self._shift(t)
        anchor = self._start if skin is None or self._bound is None else self._bound.at(skin.points)[0]
        points = anchor + local @ np.array([self._side, self.forward, self.down])
        points += self._clearance(points, t, skin) * self.forward
        triangles, n = self._lattice.triangles, len(points)
        normals = vertex_normals(points, triangles)
        data = {"Normals": normals, "thickness": np.full(n, self.diameter), "under": np.tile(self.forward, (n, 1))}
        mesh = to_polydata(points, triangles, data)
        mesh.GetPointData().SetActiveNormals("Normals")
        return mesh

    def sampled(self, times: Sequence[float] | Array, frames: Sequence[pv.PolyData]) -> Sampled | None:
        """Return the tear at times, on the same triangles; before and after it has shrunk to a point.

        Parameters
        ----------
        times : array_like, shape (f,)
            Seconds, rising.
        frames : sequence of PolyData
            The surface at these times.

        Returns
        -------
        Sampled, or None if there is no tear at any of the times.
        """
        return Sampled.of(self, times, frames)

    def _shift(self, t: float) -> float:
        """Return the shift of the formula's drop along the axis: its tip hangs at the lid until its centre falls."""
        hanging = min(t, self.begin + self.hang)
        s, alpha, beta = self.sizes(hanging)
        tip = float(profile(np.pi, s, alpha, beta)[1])
        if t == hanging:
            return -tip
        centre = moments(s, alpha, beta)[1] - tip
        return centre + self.fallen(t) - moments(*self.sizes(t))[1]

    def _clearance(self, points: Array, t: float, skin: SupportSurface | None) -> float:
        """Return how far forward the drop has to be to stay out of the skin on its whole way so far."""
        if skin is None:
            return 0.0
        axes, fallen = np.array([self.down, -self._side, self.forward]).T, self.fallen(t)
        drop, behind = points @ axes, skin.points @ axes
        drop = drop[np.argsort(drop[:, 0])]
        above, reach = drop - [fallen, 0.0, 0.0], np.array([0.0, 0.0, np.inf])
        near = overlapping(behind, skin.triangles, above.min(axis=0) - reach, drop.max(axis=0) + reach)
        corners = behind[skin.triangles[near]]
        corners = np.concatenate([corners, corners[:, ::-1]])  # whichever way they face
        forward, found = np.tile([0.0, 0.0, 1.0], (len(drop), 1)), np.full(len(drop), -np.inf)
        for way in np.linspace(0.0, fallen, 1 + int(min(2.0 * fallen / self.diameter, 40.0))):
            heights_above(drop - [way, 0.0, 0.0], forward, corners, np.inf, 0.0, found)
        return max(float(found.max()) + 0.02 * self.diameter, 0.0)  # a little off the skin


# --- the surface of a drop, by formulas ------------------------------------------------------------------


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
