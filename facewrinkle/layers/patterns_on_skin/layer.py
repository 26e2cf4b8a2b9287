"""The layer of a pattern: wrinkles, dimples or pouches on a region of any surface, driven by time or by the skin."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ...anatomy import Face, per_face
from ...array_types import Array, BoolArray
from ...errors import ParameterError, check_range, warn
from ...geometry import Change, side_lengths
from ..base import FINEST, Displacement, Layer, SurfacePoints, SurfaceState
from ..entries import Entries, sorted_by_vertex
from ..patterns import PatternFunction
from . import presets
from .kinds import pattern_of
from .region import Compression, LaidRegion, Region, RegionCompression
from .wrinkles import Pattern

TimeFunction = Callable[[float], float]
"""A function of the time in seconds."""


@dataclass(frozen=True, eq=False)
class Places(Entries):
    """Places in a region, one for each vertex that lies in it.

    Attributes
    ----------
    uv : ndarray, shape (k, 2)
    slopes : ndarray, shape (k, 3, 2)
        Gradients of u and v.
    weight : ndarray, shape (k,)
        See :meth:`facewrinkle.layers.patterns_on_skin.region.LaidRegion.at`.
    """

    uv: Array
    slopes: Array
    weight: Array


class PatternLayer(Layer):
    """A pattern on a region of a surface; stacks with other layers, and rides on any motion.

    Parameters
    ----------
    pattern : str, Pattern, callable f(x, y, t), or sequence of these
        "forehead", "eye_corner", "cheek", "frown", "dimple" or "eye_pouch" (see
        :mod:`facewrinkle.layers.patterns_on_skin.kinds`), a pattern or function of one's own, or several of these,
        which add up: the paper's primary function.
    center, up, size :
        See :class:`facewrinkle.Region`, which may be given in their place as `region`.
    depth : float, optional
        From bulge to furrow, mm; of a dimple its depth, of a pouch its height. Negative: upside down. Default: in
        proportion to the shorter side of the region, as the preset of this pattern is on a face; a fortieth for others.
    strength : float, callable or Compression
        A number in [0, 1], a function of the time in seconds, or set by the compression of the skin.
    t : float or callable, optional
        The paper's time where it moves the pattern on: a number or a function of the time in seconds. Default: the
        kind's own. Eye corners and dimples take theirs from `strength`.
    begin : float
        Time of the first step, seconds.
    region : Region, optional
    name : str, optional
        Name for messages and point data; default: that of the pattern.
    **parameters
        Parameters of the pattern, such as ``number=4, style="m", sharpness=1.0``, and of :class:`facewrinkle.Region`,
        such as ``border``, ``outline``, ``select`` and ``valid_share``. `seed` goes to both.

    Raises
    ------
    UnknownNameError
        For an unknown pattern or parameter.
    ParameterError
        For values out of range.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> layer = PatternLayer("forehead", face.landmarks["forehead_mid"], size=(90, 40), depth=1.0, number=3)
    >>> sim = fw.Simulation(face, layers=[layer])
    >>> for _ in range(4):
    ...     frame = sim.step()
    >>> bool(frame["W"].min() < -0.4 and frame.n_cells > face.mesh.n_cells)
    True
    """

    def __init__(
        self,
        pattern: str | Pattern | PatternFunction | Sequence[str | Pattern | PatternFunction],
        center: npt.ArrayLike | str | None = None,
        *,
        up: npt.ArrayLike = (0.0, 1.0, 0.0),
        size: float | tuple[float, float] | None = None,
        depth: float | None = None,
        strength: float | TimeFunction | Compression = 1.0,
        t: float | TimeFunction | None = None,
        begin: float = 0.0,
        region: Region | None = None,
        name: str | None = None,
        **parameters: Any,
    ) -> None:
        parts: list[Any] = list(pattern) if isinstance(pattern, list | tuple) else [pattern]
        if not parts:
            raise ParameterError("a layer needs a pattern, received none.")
        where = {key: parameters.pop(key) for key in list(parameters) if key in Region.__dataclass_fields__}
        self.patterns = tuple(pattern_of(part, parameters, where.get("seed")) for part in parts)
        self.name = name or " + ".join(part if isinstance(part, str) else type(part).__name__ for part in parts)
        if region is not None and (where or center is not None or size is not None):
            raise ParameterError("a region is given, so center, size and the parameters of a region must be left out.")
        if not isinstance(region, Region | None):
            raise ParameterError(f"region must be a Region, received {region!r}. Or give center, up and size.")
        self.region = region or Region(center, up, size, **where)
        self.depth = None if depth is None else check_range("depth", depth, -1e6, 1e6)
        self._proportion = presets.proportion(parts[0])
        if isinstance(strength, str):
            raise ParameterError(
                f"strength must be a number, a function of the time or a Compression, received {strength!r}; only a "
                'preset knows by itself what "skin" means.'
            )
        self.strength = strength if callable(strength) else check_range("strength", strength, 0.0, 1.0)
        if t is not None and not any(part.timed for part in self.patterns):
            raise ParameterError(
                f"the t of {self.name} follows from its strength, received t={t!r}. Leave t out, and give a strength: "
                "a number in [0, 1] or a function of the time."
            )
        self.t = t if t is None or callable(t) else check_range("t", t, -1e6, 1e6)
        self.begin = check_range("begin", begin, -1e9, 1e9)

    @classmethod
    def preset(cls, name: str, face: Face, /, **changes: Any) -> PatternLayer:
        """Lay a pattern where it belongs on a face, by its landmarks.

        Parameters
        ----------
        name : str
            One of :func:`facewrinkle.layers.patterns_on_skin.presets.names`.
        face : Face
        **changes
            See :func:`facewrinkle.layers.patterns_on_skin.presets.placed`.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> PatternLayer.preset("frown", fw.default_face(), depth=2.0).depth
        2.0
        """
        return cls(**presets.placed(name, face, **changes))

    @classmethod
    def presets(cls, name: str, face: Face, /, **changes: Any) -> list[PatternLayer]:
        """Lay a preset on both sides of a face where `name` leaves the side out.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> [layer.name for layer in PatternLayer.presets("dimple", fw.default_face())]
        ['dimple_l', 'dimple_r']
        """
        return [cls.preset(side, face, **changes) for side in presets.sides_of(name)]

    def laid(self, face: Face) -> LaidRegion:
        """Return the region on a face; it is laid once, and remembered with the face."""
        return per_face(face, "regions", self.region, lambda: self.region.laid(face))

    # --- the layer protocol ----------------------------------------------------------------------

    def attach(self, face: Face) -> None:
        """See :class:`facewrinkle.Layer`."""
        self._laid = self.laid(face)
        usual = 2.0 * self._proportion * float(self._laid.half.min()) * face.unit
        self._depth = usual if self.depth is None else self.depth
        self._sized = tuple(pattern.sized(2.0 * self._laid.half * face.unit) for pattern in self.patterns)
        self._tiny = side_lengths(face.points[self._laid.corners][None]).max() > self._laid.half.min()
        if isinstance(self.strength, Compression):
            self._compression = RegionCompression(face, self._laid, self.strength.along)
        self._places = Places(np.zeros(1, np.int32), np.empty((0, 2)), np.empty((0, 3, 2)), np.empty(0))

    def follow(self, change: Change, created: SurfacePoints) -> None:
        """See :class:`facewrinkle.Layer`."""
        new = Places(*sorted_by_vertex(*self._laid.at(created), n=len(created.points)))
        self._places = self._places.followed(change.kept, new)
        self._where, self._height = self._places.vertices, np.zeros(len(self._places.starts) - 1)
        self._planes = [(pattern, *pattern.plane(self._places.uv, self._laid.aspect)) for pattern in self._sized]
        self._steps = (np.nan, np.nan)

    def displacement(self, state: SurfaceState) -> Displacement:
        """See :class:`facewrinkle.Layer`."""
        strength = self.strength_at(state)
        height = np.zeros_like(self._height)
        if strength > 0.0:
            seconds = state.time + self.begin
            relief = sum(
                pattern.relief(x, y, strength, self.t_at(pattern, seconds), self._laid.aspect)
                for pattern, x, y in self._planes
            )
            height[self._where] = self._depth * self._places.weight * relief
        self._height = height
        return Displacement(height, *self._spacing(strength, state))

    def fields(self) -> dict[str, np.ndarray]:
        """Return the height of this layer, by its name."""
        return {f"pattern_{self.name}": self._height.copy()}

    # --- time and strength -----------------------------------------------------------------------

    def strength_at(self, state: SurfaceState) -> float:
        """Return the strength of the pattern in a state of the surface, in [0, 1]."""
        if isinstance(self.strength, Compression):
            return self.strength(self._compression.at(state.strain))
        seconds = state.time + self.begin
        value = self.strength(seconds) if callable(self.strength) else self.strength
        return check_range(f"the strength of {self.name} at {seconds:g} s", value, 0.0, 1.0)

    def t_at(self, pattern: Pattern, seconds: float) -> float:
        """Return the t of a pattern at a time in seconds."""
        if self.t is None:
            return pattern.time(seconds)
        value = self.t(seconds) if callable(self.t) else self.t
        return check_range(f"the t of {self.name} at {seconds:g} s", value, -1e6, 1e6)

    # --- vertices --------------------------------------------------------------------------------

    def _spacing(self, strength: float, state: SurfaceState) -> tuple[Array, Array, BoolArray]:
        """Return `spacing`, `across` and `active` of :class:`Displacement`.

        They are computed anew only if strength or t has changed noticeably, or vertices have come or gone.
        """
        seconds = state.time + self.begin
        t = self.t_at(self._sized[0], seconds)
        moves = any(pattern.moving for pattern in self._sized)
        steps = np.floor(2.0 * t) if moves else 0.0, np.ceil(4.0 * strength) / 4.0
        if steps != self._steps:
            points, n = state.vertices.points, len(state.vertices.points)
            spacing, across, active = np.full(n, np.inf), np.zeros((n, 3)), np.zeros(n, bool)
            self._steps, self._found = steps, (spacing, across, active)
            if strength > 0.0:
                if self._tiny:
                    self._ask(points, spacing, across, active)
                half, direction = self._wavelengths(seconds)
                # Where a pattern is fainter than a twentieth it asks for none.
                finer = (steps[1] * self._places.weight > 0.05) & (half < spacing[self._where])
                spacing[self._where[finer]], across[self._where[finer]] = half[finer], direction[finer]
                active[self._where] = True
        return self._found

    def _ask(self, points: Array, spacing: Array, across: Array, active: BoolArray) -> None:
        """Ask for triangles around a region that may lie between the vertices: the closer to it, the finer."""
        laid = self._laid
        towards = laid.center.point - points
        away = np.linalg.norm(towards, axis=1)
        near = away <= 1.001 * away[laid.corners].max()
        spacing[near] = np.maximum(3.0 * away[near], 2.0 * laid.half.min())
        across[near] = towards[near] / np.maximum(away[near, None], 1e-300)
        active[near] = True

    def _wavelengths(self, seconds: float) -> tuple[Array, Array]:
        """Half the wavelength on the surface (k,), in the unit of the face, and the unit direction along it (k, 3)."""
        half, direction = np.full(len(self._where), np.inf), np.zeros((len(self._where), 3))
        du = np.eye(2)
        for pattern, x, y in self._planes:
            wx, wy = pattern.wave_vector(x, y, self.t_at(pattern, seconds), self._laid.aspect)
            # The planes are affine maps of (u, v): differences are exact.
            along = [np.subtract(pattern.plane(np.array([step]), self._laid.aspect),
                                 pattern.plane(np.zeros((1, 2)), self._laid.aspect))[:, 0] for step in du]  # fmt: skip
            u, v = (wx * step[0] + wy * step[1] for step in along)
            gradient = u[:, None] * self._places.slopes[:, :, 0] + v[:, None] * self._places.slopes[:, :, 1]
            steep = np.linalg.norm(gradient, axis=1)
            finer = steep > np.pi / half
            half[finer] = np.pi / steep[finer]
            direction[finer] = gradient[finer] / steep[finer, None]
        return half, direction

    def level_needed(self, face: Face) -> int:
        """Return the number of times that the triangles of a face must be split to carry the pattern.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> import pyvista as pv
        >>> ball = fw.surface(pv.Icosphere(radius=40.0, nsub=3))
        >>> [PatternLayer("dimple", (0, 0, 40), size=size).level_needed(ball) for size in (40.0, 10.0)]
        [1, 2]
        """
        twin = copy(self)
        twin.strength = 1.0
        twin.attach(face)
        points, triangles = face.points, face.triangles
        corners = triangles[twin._laid.known[triangles].all(axis=1)]
        middle = np.tile(np.full(3, 1.0 / 3.0), (len(corners), 1))
        centroids = points[corners].mean(axis=1)
        host = np.zeros(len(corners), np.int32)
        twin.follow(Change(slice(None), len(corners)), SurfacePoints(centroids, centroids, corners, middle, host))
        longest = 0.35  # edges of a mesh that carries a pattern, as a share of half a wavelength
        if len(twin._where) == 0:
            edge = np.linalg.norm(points[twin._laid.corners[0]] - points[twin._laid.corners[1]])
            return int(np.clip(np.ceil(np.log2(edge / (longest * twin._laid.half.min()))), 1, 12))
        if not twin._places.weight.any():
            raise ParameterError(
                f"the pattern {self.name} lies on no vertex of the mesh: its region and valid_share leave none of the "
                f"{len(twin._where)} around it. Ask for a larger share or region, or begin with a finer mesh."
            )
        half, _ = twin._wavelengths(self.begin)
        strong = twin._places.weight > 0.5 * twin._places.weight.max()
        edges = np.median(side_lengths(points[corners]), axis=1)[twin._where]
        if not np.isfinite(half[strong]).any():
            raise ParameterError(
                f"the wave vectors of the pattern {self.name} are 0 everywhere: it has no wavelength that a mesh could "
                "carry. wave_vector() must return the gradient of the phase, in radians per unit of x and y."
            )
        ratio = np.quantile(edges[strong] / (longest * half[strong]), 0.75)
        return int(np.clip(np.ceil(np.log2(max(ratio, 1e-9))), 0, 12))

    def check_level(self, needed: int, level: int) -> None:
        """Warn if a mesh that is split so often cannot carry the pattern well.

        A pattern that needs at least two levels more raises a ParameterError, unless refinement is off (level 0).
        """
        if needed <= level:
            return
        ask = f"max_level={needed}, for " if needed <= FINEST else ""
        remedy = f"Ask for {ask}fewer wrinkles, for a larger region, or begin with a finer mesh."
        if 0 < level < needed - 1:
            raise ParameterError(
                f"the mesh is too coarse to carry the pattern {self.name}: its triangles would have to be split "
                f"{needed} times, and max_level={level} is allowed. {remedy}"
            )
        warn(
            f"the mesh is too coarse to carry the pattern {self.name} well: its triangles should be split "
            f"{needed} {'time' if needed == 1 else 'times'}, and max_level={level} is allowed. {remedy}"
        )
