"""The lines of a face, those of all its families, and their waves at given points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np

from ...anatomy import Face, per_face
from ...array_types import Array, IntArray
from ...errors import ParameterError
from ...geometry import interpolated, side_lengths
from ..base import SurfacePoints
from ..compression import StrainField, along, tangents_of
from ..entries import Entries, sorted_by_vertex
from .families import FoldShapes, tensors_of
from .stripes import KEPT, Ground, Stripes, Style, carried, found_stripes, zone_of
from .tissue import anatomical, firmness, grain, old_depths, scale_of, wavelengths


@dataclass(frozen=True, eq=False)
class Waves(Entries):
    """The waves at n vertices: for each family that has lines there an entry, p in all.

    Attributes
    ----------
    family : ndarray of int32, shape (p,)
    theta : ndarray, shape (p,)
        Phase: 0 on a bulge, pi in a furrow. Its sign means nothing.
    strength, window : ndarray, shape (p,)
        Share of the depth, and of the compression, in [0, 1] (times what was asked for here).
    length : ndarray, shape (p,)
        Wavelength, mm.
    old : ndarray, shape (p,)
        Depth of the lines at rest, mm.
    wave : ndarray, shape (p, 3)
        Wave vector, 1/mm.
    tangents : ndarray, shape (p, 6)
        The directions across and along the lines, each of unit length in the rest metric.
    """

    family: IntArray
    theta: Array
    strength: Array
    window: Array
    length: Array
    old: Array
    wave: Array
    tangents: Array

    @classmethod
    def none(cls, n: int) -> Self:
        """Return no waves at n vertices.

        Examples
        --------
        >>> Waves.none(2).starts.tolist()
        [0, 0, 0]
        """
        e = np.empty(0)
        starts, family = np.zeros(n + 1, np.int32), np.empty(0, np.int32)
        return cls(starts, family, e, e, e, e, e, np.empty((0, 3)), np.empty((0, 6)))


class Now(NamedTuple):
    """What the waves do in a frame, entry by entry, each an array of the shape (p,).

    Attributes
    ----------
    epsilon, excess, left : ndarray
        Compression across the lines; beyond the onset; what crossing families leave of that.
    deep, alpha, height : ndarray
        Depth, mm, before all families of a vertex share the length of the skin; shape exponent; height, mm.
    """

    epsilon: Array
    excess: Array
    left: Array
    deep: Array
    alpha: Array
    height: Array


def directed(wave: Array, vertices: SurfacePoints, near: np.ndarray, metric: Array) -> Array:
    """Return the tangents (p, 6) across and along waves (p, 3) at the vertices `near`.

    They are of unit length in the rest metric (n0, 6).
    """
    normals, tensors = vertices.normals[near], interpolated(metric, vertices.corners[near], vertices.barycentric[near])
    first = tangents_of(wave, normals)
    both = first, np.cross(normals, first)
    return np.hstack([each / np.sqrt(np.maximum(along(tensors, each), 1e-6))[:, None] for each in both])


def lines_of(face: Face, shapes: FoldShapes, density: float, style: Style) -> dict[str, Stripes]:
    """Return the lines of a face by family, of those that compress the skin somewhere; they are found once.

    Raises
    ------
    ParameterError
        For shapes with lines of another face, and for shapes of a face with other triangles if one has no landmarks.
    """
    home, key = shapes.face or face, (shapes, density, style)
    lines = per_face(home, "lines", key, lambda: _lines_of(home, shapes, density, style))
    if np.array_equal(home.triangles, face.triangles):
        return lines
    if not (home.landmarks and face.landmarks):
        raise ParameterError(
            f"the shapes that wave folds were given are of a face of {len(home.triangles)} triangles, and "
            f"this one has {len(face.triangles)}, or others. Give a new WaveFolds() to the simulation of each face."
        )
    return per_face(face, "lines", key, lambda: carried(lines, home, face, wavelengths(face) / density))


def _lines_of(face: Face, shapes: FoldShapes, density: float, style: Style) -> dict[str, Stripes]:
    arrays = shapes.lines
    if arrays is None or (density, style) != (1.0, Style()):
        arrays = found_lines(face, shapes, density, style)
    lines = {}
    for k, name in enumerate(arrays["names"].tolist()):
        own = {column: arrays[f"{column} {k}"].astype(np.float64) for column in KEPT}
        fits = len(own["compression"]) == len(face.points)
        if fits:
            lines[name] = Stripes(Ground(face, zone_of(face, own["compression"]), int(arrays[f"level {k}"])), **own)
        if not fits or len(own["phase"]) != len(lines[name].ground.points):
            raise ParameterError(
                f"the lines that wave folds were given are not of this face, which has {len(face.points)} vertices and "
                f"{len(face.triangles)} triangles. Give FoldShapes without lines, and they are found."
            )
    return lines


def found_lines(face: Face, shapes: FoldShapes, density: float, style: Style) -> dict[str, np.ndarray]:
    """Find the lines of a face; return the arrays that they are stored as, with seven digits."""
    length, under = wavelengths(face) / density, (grain(face), anatomical(face))
    tensors = tensors_of(face, shapes)
    arrays: dict[str, np.ndarray] = {"names": np.array(list(tensors), dtype=np.str_)}
    for k, (name, tensor) in enumerate(tensors.items()):
        stripes = found_stripes(face, name, tensor, length, style, under)
        arrays |= {f"{column} {k}": getattr(stripes, column).astype(kind) for column, kind in KEPT.items()}
        arrays[f"level {k}"] = np.array(stripes.ground.level)
    return arrays


class WaveField:
    """The waves of all lines at points of a face.

    Parameters
    ----------
    face : Face
    shapes : FoldShapes
    density : float
    style : Style
        See :func:`lines_of`.
    amounts : ndarray, shape (n0,), optional
        Factors of the strength at the base vertices.
    age : float
        In [0, 1]: 0 has no lines at rest.

    Attributes
    ----------
    lines : dict of str to Stripes
        Found on this face or one of the same triangles, or carried over from one of others.

    Raises
    ------
    ParameterError
        See :func:`lines_of`.
    """

    def __init__(
        self,
        face: Face,
        shapes: FoldShapes,
        density: float = 1.0,
        style: Style | None = None,
        amounts: Array | None = None,
        age: float = 0.0,
    ) -> None:
        home = shapes.face or face
        self.lines, self._turn = lines_of(face, shapes, density, style or Style()), None
        if home is not face and np.array_equal(home.triangles, face.triangles):  # its waves, in the face's own axes
            self._turn = home.frame.axes.T @ face.frame.axes * (scale_of(home) / scale_of(face))
        self._face, self._unit, self._amounts, self._age = face, face.unit, amounts, age
        self._length = wavelengths(face) / density

    @cached_property
    def _of_families(self) -> list[Array]:
        """Window, firmness, wavelength and depth at rest (n0, 4) of each family, at the base vertices."""
        folding = np.unique(np.concatenate([own.ground.used for own in self.lines.values()]))
        firm = np.ones(len(self._length)) if self._amounts is None else self._amounts.copy()
        firm[folding] *= firmness(self._face, folding)
        old = old_depths(self._face, self._age)
        return [
            np.stack([own.window, firm, self._length, own.window * old * np.sqrt(own.compression)], axis=1)
            for own in self.lines.values()
        ]

    def level_needed(self, face: Face) -> int:
        """Return the level at which nine in ten triangles with lines have five edges a wavelength; 4 at most."""
        zones = [own.zone for own in self.lines.values()]
        inside = face.triangles[np.any(zones, axis=0)] if zones else face.triangles[:0]
        if not len(inside):
            return 0
        edges = side_lengths(face.points[inside] * self._unit).mean(axis=1)
        levels = np.log2(edges / (0.2 * self._length[inside].mean(axis=1)))
        return int(np.clip(np.ceil(np.quantile(levels, 0.9)), 1, 4))

    def at(self, vertices: SurfacePoints) -> Waves:
        """Return the waves at points of the surface."""
        parts = []
        for number, own in enumerate(self.lines.values()):
            near = np.flatnonzero(own.zone[vertices.host])
            if not len(near):
                continue
            values = interpolated(self._of_families[number], vertices.corners[near], vertices.barycentric[near])
            folding = (values[:, 0] > 0.0) & (values[:, 1] > 0.0)
            near, values = near[folding], values[folding]
            theta, strength, wave = own.at(vertices, near)
            wave = wave if self._turn is None else wave @ self._turn
            size = np.sqrt((wave * wave).sum(axis=1))
            gone, whole = 0.12, 0.67  # strengths of the sum below which there is no line, and from which it is whole
            some = np.flatnonzero((strength > gone) & (size > 1e-6))
            if not len(some):
                continue
            window, firm, length, old = values[some].T
            near, theta, strength, wave, size = near[some], theta[some], strength[some], wave[some], size[some]
            strength = firm * np.clip((strength - gone) / (whole - gone), 0.0, 1.0)
            # Where directions turn, the sum of waves has too small a wave vector.
            longest = np.minimum(2.0 * np.pi / size, 1.7 * length)
            family = np.full(len(near), number, np.int32)
            tangents = directed(wave, vertices, near, StrainField.of(self._face).metric)
            window, old = np.ascontiguousarray(window), old * strength**2
            parts.append((near, family, theta, strength, window, longest, old, wave, tangents))
        n = len(vertices.points)
        if not parts:
            return Waves.none(n)
        return Waves(*sorted_by_vertex(*map(np.concatenate, zip(*parts, strict=True)), n=n))
