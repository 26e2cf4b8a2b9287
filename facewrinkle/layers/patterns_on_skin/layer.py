"""Patterns as a layer: wrinkles, dimples and pouches on a region of any surface, driven by time or by the skin."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from typing import Any

import numpy as np
import numpy.typing as npt

from ...anatomy.face import Face
from ...errors import ParameterError, check_range
from ...geometry.normals import vertex_areas, vertex_normals
from ...geometry.refinement import Change
from ..base import Array, Displacement, SurfacePoints, SurfaceState
from ..compression import StrainField, compression_along, principal_compression
from ..patterns import Function
from . import presets
from .base import Heights, Pattern
from .kinds import pattern_of
from .region import LaidRegion, Region
from .strength import Compression

Driver = Callable[[float], float]

FAINT = 0.05
"""Where window times strength is below this, a pattern asks for no triangles."""
SAMPLES = 0.35
"""A mesh carries a pattern if its edges are at most this share of half a wavelength."""


class PatternLayer:
    """A pattern on a region of a surface; stacks with other layers, and rides on any motion.

    Parameters
    ----------
    pattern : str, Pattern, callable f(x, y, t), or sequence of these
        "forehead", "eye_corner", "cheek", "frown", "dimple" or "eye_pouch" with words (see
        :mod:`facewrinkle.layers.patterns_on_skin.kinds`), or several, which add up: the paper's primary function.
    centre, up, size :
        See :class:`facewrinkle.layers.patterns_on_skin.region.Region`, which may be given in their place as `region`.
    depth : float
        From bulge to furrow, mm; of a dimple its depth, of a pouch its height. Negative: upside down.
    strength : float, callable or Compression
        In [0, 1]: a number, a function of the time in seconds, or as the skin is compressed.
    t : float or callable, optional
        The paper's time where it moves the pattern on: a number or a function of the time in seconds. Default: the
        kind's own. Eye corners and dimples have theirs from `strength`.
    begin : float
        Time of the first step, seconds.
    region : Region, optional
    name : str, optional
        For messages; default: that of the pattern.
    **words
        Of the pattern, such as ``number=4, style="m", sharpness=1.0``; further ones of :class:`Region`, such as
        ``border``, ``outline``, ``select`` and ``valid``. `seed` is that of both.

    Raises
    ------
    UnknownNameError
        For an unknown pattern or word.
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
        pattern: str | Pattern | Function | Sequence[str | Pattern | Function],
        centre: npt.ArrayLike | None = None,
        up: npt.ArrayLike = (0.0, 1.0, 0.0),
        size: float | tuple[float, float] | None = None,
        *,
        depth: float = 1.0,
        strength: float | Driver | Compression = 1.0,
        t: float | Driver | None = None,
        begin: float = 0.0,
        region: Region | None = None,
        name: str | None = None,
        **words: Any,
    ) -> None:
        parts: list[Any] = list(pattern) if isinstance(pattern, list | tuple) else [pattern]
        if not parts:
            raise ParameterError("a layer needs a pattern, received none.")
        where = {word: words.pop(word) for word in list(words) if word in Region.__dataclass_fields__}
        self.patterns = tuple(pattern_of(part, words, where.get("seed")) for part in parts)
        self.name = name or " + ".join(part if isinstance(part, str) else type(part).__name__ for part in parts)
        if region is not None and (where or centre is not None or size is not None):
            raise ParameterError("a region is given, so centre, size and the words of a region have to be left out.")
        if not isinstance(region, Region | None):
            raise ParameterError(f"region must be a Region, received {region!r}. Or give centre, up and size.")
        self.region = region or Region(centre, up, size, **where)
        self.depth = check_range("depth", depth, -1e6, 1e6)
        if isinstance(strength, str):
            raise ParameterError(
                f"strength must be a number, a function of the time or a Compression, received {strength!r}; only a "
                'preset knows by itself what "skin" means.'
            )
        self.strength = strength if callable(strength) else check_range("strength", strength, 0.0, 1.0)
        if t is not None and not any(kind.timed for kind in self.patterns):
            raise ParameterError(
                f"the t of {self.name} follows from its strength, received t={t!r}. Leave t out, and give a strength: "
                "a number in [0, 1] or a function of the time."
            )
        self.t = t if t is None or callable(t) else check_range("t", t, -1e6, 1e6)
        self.begin = check_range("begin", begin, -1e9, 1e9)
        self._on: tuple[Face, Region, LaidRegion] | None = None

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
        """The region on a face; it is laid once, and then remembered."""
        if self._on is None or self._on[0] is not face or self._on[1] is not self.region:
            self._on = face, self.region, self.region.laid(face)
        return self._on[2]

    # --- the layer protocol ----------------------------------------------------------------------

    def attach(self, face: Face) -> None:
        """See :class:`facewrinkle.layers.base.Layer`."""
        self._laid = self.laid(face)
        self._kinds = tuple(kind.sized(2.0 * self._laid.half * face.unit) for kind in self.patterns)
        sides = face.points[self._laid.corners] - np.roll(face.points[self._laid.corners], 1, axis=0)
        self._tiny = float(np.linalg.norm(sides, axis=1).max()) > self._laid.half.min()
        if isinstance(self.strength, Compression):
            self._gauge = _Gauge(face, self._laid, self.strength)
        self._n = 0
        self._uv, self._slopes, self._weight = np.empty((0, 2)), np.empty((0, 3, 2)), np.empty(0)
        self._where = np.empty(0, np.int64)
        self._height = np.empty(0)
        self._wave_t = np.nan
        self._need: dict[float, tuple[Array, Array, npt.NDArray[np.bool_]]] = {}

    def follow(self, change: Change, created: SurfacePoints) -> None:
        """See :class:`facewrinkle.layers.base.Layer`."""
        if not isinstance(change.kept, slice):
            renumber = np.full(self._n, -1)
            renumber[change.kept] = np.arange(len(change.kept))
            lives = renumber[self._where] >= 0
            self._where = renumber[self._where][lives]
            self._uv, self._slopes, self._weight = self._uv[lives], self._slopes[lives], self._weight[lives]
            self._n = len(change.kept)
        new, uv, slopes, weight = self._laid.at(created)
        self._where = np.concatenate([self._where, new + self._n])
        self._uv = np.concatenate([self._uv, uv])
        self._slopes = np.concatenate([self._slopes, slopes])
        self._weight = np.concatenate([self._weight, weight])
        self._n += len(created.points)
        self._heights = self._prepared()
        self._wave_t = np.nan

    def displacement(self, state: SurfaceState) -> Displacement:
        """See :class:`facewrinkle.layers.base.Layer`."""
        strength = self.strength_at(state)
        height = np.zeros(self._n)
        if strength > 0.0:
            for pattern, heights in zip(self._kinds, self._heights, strict=True):
                heights(strength, self.t_at(pattern, state.time + self.begin), height)
        self._height = height
        return Displacement(height, *self._needs(strength, state))

    def fields(self) -> dict[str, np.ndarray]:
        """The height of this layer, by its name."""
        return {f"pattern_{self.name}": self._height.copy()}

    # --- time and strength -----------------------------------------------------------------------

    def strength_at(self, state: SurfaceState) -> float:
        """The strength of the pattern in a state of the surface, in [0, 1]."""
        if isinstance(self.strength, Compression):
            return self.strength(self._gauge.compression(state.base))
        seconds = state.time + self.begin
        value = self.strength(seconds) if callable(self.strength) else self.strength
        return check_range(f"the strength of {self.name} at {seconds:g} s", value, 0.0, 1.0)

    def t_at(self, pattern: Pattern, seconds: float) -> float:
        """The t of a pattern at a time in seconds."""
        if self.t is None:
            return pattern.time(seconds)
        value = self.t(seconds) if callable(self.t) else self.t
        return check_range(f"the t of {self.name} at {seconds:g} s", value, -1e6, 1e6)

    # --- vertices --------------------------------------------------------------------------------

    def _planes(self) -> list[tuple[Pattern, Array, Array]]:
        return [(pattern, *pattern.plane(self._uv, self._laid.aspect)) for pattern in self._kinds]

    def _prepared(self) -> list[Heights]:
        aspect, weight = self._laid.aspect, self.depth * self._weight
        return [pattern.prepared(x, y, aspect, self._where, weight) for pattern, x, y in self._planes()]

    def _needs(self, strength: float, state: SurfaceState) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
        """Half the finest wavelength at each vertex, across which direction, and where the pattern is.

        They are those of before as long as strength and t are about the same, and no vertices have come or gone.
        """
        seconds = state.time + self.begin
        t = self.t_at(self._kinds[0], seconds)
        at = float(np.floor(2.0 * t)) if any(pattern.moving for pattern in self._kinds) else 0.0
        if at != self._wave_t:
            self._wave_t, self._waves, self._need = at, self._wavelengths(seconds), {}
        step = float(np.ceil(4.0 * strength)) / 4.0
        if step not in self._need:
            self._need[step] = self._needed(step, state.vertices.points)
        return self._need[step]

    def _needed(self, strength: float, points: Array) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
        spacing, across, active = np.full(self._n, np.inf), np.zeros((self._n, 3)), np.zeros(self._n, bool)
        if strength == 0.0:
            return spacing, across, active
        if self._tiny:
            self._seed(points, spacing, across, active)
        half, direction = self._waves
        finer = (strength * self._weight > FAINT) & (half < spacing[self._where])
        spacing[self._where[finer]], across[self._where[finer]] = half[finer], direction[finer]
        active[self._where] = True
        return spacing, across, active

    def _seed(self, points: Array, spacing: Array, across: Array, active: npt.NDArray[np.bool_]) -> None:
        """Ask for triangles about a region that may lie between the vertices: the closer to it the finer."""
        laid = self._laid
        towards = laid.centre.point - points
        away = np.linalg.norm(towards, axis=1)
        near = away <= 1.001 * away[laid.corners].max()
        spacing[near] = np.maximum(3.0 * away[near], 2.0 * laid.half.min())
        across[near] = towards[near] / np.maximum(away[near, None], 1e-300)
        active[near] = True

    def _wavelengths(self, seconds: float) -> tuple[Array, Array]:
        """Half the wavelength on the surface, in the unit of the face, and the unit direction across."""
        half, direction = np.full(len(self._where), np.inf), np.zeros((len(self._where), 3))
        du = np.eye(2)
        for pattern, x, y in self._planes():
            wx, wy = pattern.waves(x, y, self.t_at(pattern, seconds), self._laid.aspect)
            # The planes are affine maps of (u, v): differences of places are exact.
            along = [np.subtract(pattern.plane(np.array([step]), self._laid.aspect),
                                 pattern.plane(np.zeros((1, 2)), self._laid.aspect))[:, 0] for step in du]  # fmt: skip
            u, v = (wx * step[0] + wy * step[1] for step in along)
            gradient = u[:, None] * self._slopes[:, :, 0] + v[:, None] * self._slopes[:, :, 1]
            steep = np.linalg.norm(gradient, axis=1)
            finer = steep > np.pi / half
            half[finer] = np.pi / steep[finer]
            direction[finer] = gradient[finer] / steep[finer, None]
        return half, direction

    def level_needed(self, face: Face) -> int:
        """How often the triangles of a face have to be split to carry the pattern.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> import pyvista as pv
        >>> ball = fw.surface(pv.Icosphere(radius=40.0, nsub=3))
        >>> [PatternLayer("dimple", (0, 0, 40), size=size).level_needed(ball) for size in (40.0, 10.0)]
        [1, 2]
        """
        self.laid(face)
        twin = copy(self)
        twin.strength = 1.0
        twin.attach(face)
        points, triangles = face.points, face.triangles
        corners = triangles[self._zone(twin._laid, triangles)]
        middle = np.tile(np.full(3, 1.0 / 3.0), (len(corners), 1))
        centroids = points[corners].mean(axis=1)
        host = np.zeros(len(corners), np.int32)
        twin.follow(Change(slice(None), len(corners)), SurfacePoints(centroids, centroids, corners, middle, host))
        if len(twin._where) == 0:
            edge = np.linalg.norm(points[twin._laid.corners[0]] - points[twin._laid.corners[1]])
            return int(np.clip(np.ceil(np.log2(edge / (SAMPLES * twin._laid.half.min()))), 1, 12))
        half, _ = twin._wavelengths(self.begin)
        strong = twin._weight > 0.5 * twin._weight.max()
        sides = points[corners] - np.roll(points[corners], 1, axis=1)
        edges = np.median(np.linalg.norm(sides, axis=2), axis=1)[twin._where]
        ratio = edges[strong] / (SAMPLES * half[strong])
        return int(np.clip(np.ceil(np.log2(np.quantile(ratio, 0.75))), 0, 12))

    @staticmethod
    def _zone(laid: LaidRegion, triangles: npt.NDArray[np.int32]) -> npt.NDArray[np.bool_]:
        return np.asarray(laid.known[triangles].all(axis=1))


class _Gauge:
    """How much the skin under a region is compressed, whatever triangles it has."""

    def __init__(self, face: Face, laid: LaidRegion, driver: Compression) -> None:
        inside = laid.base_window
        if not inside.any():
            inside[laid.corners] = 1.0
        near = (inside > 0.0)[face.triangles].any(axis=1)
        points = face.points * face.unit
        self._field = StrainField(points, face.triangles[near])
        self._at = np.flatnonzero(inside)
        share = inside * vertex_areas(points, face.triangles)
        self._share = share[self._at] / share.sum()
        self._normals = vertex_normals(points, face.triangles)[self._at]
        self._along = None if driver.along is None else np.asarray(driver.along, dtype=np.float64)

    def compression(self, base: Array) -> float:
        strain, metric = self._field.strain(base)[self._at], self._field.metric[self._at]
        if self._along is None:
            epsilon, _ = principal_compression(strain, metric, self._normals)
        else:
            epsilon = compression_along(strain, metric, self._normals, self._along)
        return float(self._share @ epsilon)
