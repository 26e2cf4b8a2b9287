"""Tears that drip: a drop that grows at the lid, pinches off, and falls while its shape changes (Section 4.1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy.face import Face
from ..errors import ParameterError, check_range, check_whole
from ..geometry.normals import vertex_normals
from ..geometry.rings import ring_triangles
from ..geometry.smoothstep import smoothstep
from ..mesh import to_polydata
from . import _kernels as kernels
from .support_surface import SupportSurface, directions, support_surface, vectors

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]

SHARPEST = 0.3228764
"""The t at which the pointed end is slimmest: its half angle's tangent is 2 / (ratio t sin(2 pi t))."""

GRAVITY = 9810.0
"""mm / s^2."""

BIRTH = 0.03
"""Share of its volume with which a drop appears."""

CLEAR = 0.02
"""Distance that a drop keeps from the skin, in diameters."""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(48)


def profile(u: npt.ArrayLike, t: float, alpha: float, beta: float, egg: bool = False) -> tuple[Array, Array]:
    """Radius and position along the axis, which points down, of the drop: a surface of revolution.

    ``alpha sin(u)/cos(t u)`` and ``beta cos(t u)``; the paper's term ``lambda t``, the fall, is left to a clock of its
    own. The round end, at u = 0, leads.

    Parameters
    ----------
    u : array_like
        In [0, pi].
    t : float
        In (0, 1/2): a flat disc near 0, singular at 1/2; 0.1 to 0.45 are drops.
    alpha, beta : float
        Sizes across and along.
    egg : bool
        The variant with ``beta t cos(u)`` along the axis, counted from its blunt end, which leads.

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
    axis = beta * t * np.cos(angle) if egg else beta * np.cos(t * angle)
    turned = np.pi - angle if egg else angle
    return np.asarray(alpha * np.sin(angle) / np.cos(t * turned)), np.asarray(axis)


def moments(t: float, alpha: float, beta: float, egg: bool = False) -> tuple[float, float]:
    """Volume of the drop, and the place of its centre of mass along the axis.

    For the drop the volume is ``pi alpha^2 beta t`` times the integral of ``sin(u)^2 sin(t u)/cos(t u)^2``.

    Examples
    --------
    >>> round(moments(0.2, 1.0, 5.0)[0], 4), round(moments(0.4, 1.0, 5.0)[0], 4)
    (1.7496, 11.3555)
    """
    u = 0.5 * np.pi * (NODES + 1.0)
    radius, axis = profile(u, t, alpha, beta, egg)
    slope = t * np.sin(u) if egg else t * np.sin(t * u)
    share = 0.5 * np.pi * WEIGHTS * np.pi * radius**2 * beta * slope
    return float(share.sum()), float(share @ axis / share.sum())


class DrippingTear:
    """A tear that drips: it grows at the lid, pinches off, and falls freely past the chin.

    Parameters
    ----------
    surface : Face or PolyData, optional
        Where the tear is born, and what it must not enter. Default: nothing.
    start : array_like, shape (3,), or {"l", "r"}
        A point of the surface, or the eye of a Face, from whose lower lid the tear drips.
    size : float
        Diameter of the ball of the same volume, mm.
    ratio : float
        beta / alpha: from 10 on the drop is slim.
    begin, hang : float
        Seconds at which it appears, and for which it grows until it falls.
    shape : tuple of float
        The formula's t at birth and at the end of the fall; it pinches off at 0.3229, where the tip is sharpest.
    egg : bool
        The variant of the formula.
    fall : float
        Depth to which the tear is followed, mm.
    gravity : float
        mm / s^2.
    speed : float, optional
        Falls at this speed (mm / s), the paper's lambda, in place of gravity.
    stretch : float
        How much longer it is drawn while it pinches off; it swings back as it falls.
    down : array_like, shape (3,), optional
    unit : float
        Millimetres per unit of a surface that is no Face.
    resolution : int
        Points around the drop.

    Attributes
    ----------
    begin, end : float
        When there is a tear, seconds.
    volume : float
        Of the falling drop, in the unit of the surface, cubed.

    Raises
    ------
    ParameterError
        For a number out of its range, a start off the surface, or a drop larger than the surface.

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
        surface: Face | pv.PolyData | None = None,
        start: npt.ArrayLike | str = (0.0, 0.0, 0.0),
        *,
        size: float = 3.0,
        ratio: float = 7.0,
        begin: float = 0.0,
        hang: float = 0.8,
        shape: Sequence[float] = (0.22, 0.4),
        egg: bool = False,
        fall: float = 300.0,
        gravity: float = GRAVITY,
        speed: float | None = None,
        stretch: float = 0.25,
        down: npt.ArrayLike | None = None,
        unit: float = 1.0,
        resolution: int = 40,
    ) -> None:
        self.ratio, self.egg = check_range("ratio", ratio, 1.0, 100.0), bool(egg)
        self.begin, self.hang = check_range("begin", begin, 0.0, 1e9), check_range("hang", hang, 1e-3, 1e9)
        self.shape = _shapes(shape)
        self.speed = None if speed is None else check_range("speed", speed, 1e-3, 1e9)
        self.gravity, self.stretch = (
            check_range("gravity", gravity, 1e-3, 1e9),
            check_range("stretch", stretch, 0.0, 2.0),
        )
        self._ground = None if surface is None else support_surface(surface, down, unit)
        self.down, self.forward = (
            directions(down) if self._ground is None else (self._ground.down, self._ground.forward)
        )
        self._side = np.cross(self.down, self.forward)
        unit = check_range("unit", unit, 1e-9, 1e9) if self._ground is None else self._ground.unit
        self.diameter = check_range("size", size, 1e-6, 1e9) / unit
        self.volume = np.pi / 6.0 * self.diameter**3
        self.depth = check_range("fall", fall, 1e-6, 1e9) / unit
        self._rate = (self.speed or self.gravity) / unit
        falling = self.depth / self._rate if self.speed else (2.0 * self.depth / self._rate) ** 0.5
        self.end = self.begin + self.hang + falling
        if self._ground is None:
            self._start, self._place = vectors("start", start)[0], None
        else:
            _check_size(self.diameter, self._ground)
            self._start = self._ground.start(start, max(self.diameter, 0.02 * self._ground.size))
            self._place = self._ground.bound(self._start[None])
        self._released: Array | None = None
        self._lattice(check_whole("resolution", resolution, 6, 512))

    def _lattice(self, n: int) -> None:
        """The unit circle, the u of the rings, and the triangles of the closed surface."""
        rings = n // 2 + 1
        self._u = np.pi * np.linspace(0.0, 1.0, rings + 2)
        turn = 2.0 * np.pi * np.arange(n) / n
        self._circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        self._triangles = ring_triangles(n, rings, start=1, first=0, last=1 + n * rings, diagonal="ac")

    # --- clocks --------------------------------------------------------------------------------

    def fallen(self, t: float) -> float:
        """How far the centre has fallen at t since the drop pinched off, in the unit of the surface."""
        seconds = max(t - self.begin - self.hang, 0.0)
        return self._rate * seconds if self.speed else 0.5 * self._rate * seconds**2

    def parameter(self, t: float) -> float:
        """The t of the formula at time t."""
        grown, low, high = self._grown(t), *self.shape
        pinch = float(np.clip(SHARPEST, min(low, high), max(low, high)))
        if grown < 1.0:
            return low + (pinch - low) * grown
        return pinch + (high - pinch) * float(smoothstep(self.fallen(t) / self.depth))

    def _grown(self, t: float) -> float:
        return min((t - self.begin) / self.hang, 1.0)

    def _sizes(self, t: float) -> tuple[float, float, float]:
        """The formula's t, alpha and beta at time t: they give the drop its volume."""
        grown, s = self._grown(t), self.parameter(t)
        seconds = max(t - self.begin - self.hang, 0.0)
        swing = np.exp(-seconds / 0.05) * np.cos(
            2.0 * np.pi * seconds / 0.06
        )  # a 3 mm drop of water rings at some 60 Hz
        ratio = self.ratio * (1.0 + self.stretch * grown**4 * swing)
        volume = self.volume * (BIRTH + (1.0 - BIRTH) * float(smoothstep(grown)))
        alpha = float((volume / self._meshed(s, ratio)) ** (1.0 / 3.0))
        return s, alpha, ratio * alpha

    def _meshed(self, s: float, ratio: float) -> float:
        """Volume of the mesh of the drop with alpha = 1: frusta of regular polygons."""
        radius, axis = profile(self._u, s, 1.0, ratio, self.egg)
        n = len(self._circle)
        between = (radius[1:] ** 2 + radius[1:] * radius[:-1] + radius[:-1] ** 2) / 3.0
        return float(0.5 * n * np.sin(2.0 * np.pi / n) * (between @ (axis[:-1] - axis[1:])))

    # --- the mesh ------------------------------------------------------------------------------

    def surface(self, t: float, on: pv.PolyData | None = None) -> pv.PolyData:
        """The drop at time t.

        Parameters
        ----------
        t : float
            Seconds, from `begin` to `end`.
        on : PolyData, optional
            The face of this moment. The tear hangs at its lid; once it has pinched off it falls where it was then, so
            that a clip must be played in order.

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
        skin = None if self._ground is None else self._skin(self._ground, on)
        s, alpha, beta = self._sizes(t)
        radius, axis = profile(self._u, s, alpha, beta, self.egg)
        n = len(self._circle)
        local = np.zeros((n * (len(axis) - 2) + 2, 3))
        local[1:-1, :2] = (radius[1:-1, None, None] * self._circle).reshape(-1, 2)
        local[:, 2] = np.concatenate([axis[:1], np.repeat(axis[1:-1], n), axis[-1:]]) + self._shift(t)
        points = self._anchor(t, skin) + local @ np.array([self._side, self.forward, self.down])
        points += self._kept_off(points, t, skin) * self.forward
        normals, n = vertex_normals(points, self._triangles), len(points)
        data = {"Normals": normals, "thickness": np.full(n, self.diameter), "under": np.tile(self.forward, (n, 1))}
        mesh = to_polydata(points, self._triangles, data)
        mesh.GetPointData().SetActiveNormals("Normals")
        return mesh

    def _shift(self, t: float) -> float:
        """From the formula's place along the axis to the tear's: its tip hangs at the lid until its centre falls."""
        hanging = min(t, self.begin + self.hang)
        s, alpha, beta = self._sizes(hanging)
        tip = float(profile(np.pi, s, alpha, beta, self.egg)[1])
        if t == hanging:
            return -tip
        centre = moments(s, alpha, beta, self.egg)[1] - tip
        return centre + self.fallen(t) - moments(*self._sizes(t), self.egg)[1]

    @staticmethod
    def _skin(ground: SupportSurface, on: pv.PolyData | None) -> tuple[Array, IntArray]:
        """Points and triangles of the moment."""
        return (ground.points, ground.triangles) if on is None else ground.frame(on)[:2]

    def _anchor(self, t: float, skin: tuple[Array, IntArray] | None) -> Array:
        """Where the tear hangs, or hung when it pinched off."""
        if t <= self.begin + self.hang:
            self._released = None
        if self._released is not None:
            return self._released
        anchor = self._start if skin is None or self._place is None else self._place.at(skin[0])[0]
        if t > self.begin + self.hang:
            self._released = anchor
        return anchor

    def _kept_off(self, points: Array, t: float, skin: tuple[Array, IntArray] | None) -> float:
        """How far the drop has to stand forward so that, on its way so far, it is never in the skin."""
        if skin is None:
            return 0.0
        axes = np.array([self._side, self.down, self.forward]).T
        drop, behind, fallen = points @ axes, skin[0] @ axes, self.fallen(t)
        steps = 1 + int(min(2.0 * fallen / self.diameter, 40.0))
        raised = (drop - [0.0, way, 0.0] for way in np.linspace(0.0, fallen, steps))
        margin = CLEAR * self.diameter
        return max(kernels.farthest_behind(at, behind, skin[1], margin) for at in raised)


def _shapes(shape: Sequence[float]) -> tuple[float, float]:
    if not isinstance(shape, Sequence) or len(shape) != 2:
        raise ParameterError(f"shape must be the formula's t at birth and at the end, received {shape!r}.")
    first, last = (check_range("each t in shape", t, 0.05, 0.49) for t in shape)
    return first, last


def _check_size(diameter: float, ground: SupportSurface) -> None:
    if diameter > 0.2 * ground.size:
        raise ParameterError(
            f"a tear must be smaller than a fifth of the surface, {0.2 * ground.size * ground.unit:.3g} mm, received "
            f"{diameter * ground.unit:.3g} mm. Is the unit of the surface right?"
        )
