"""The paths of a stream: from its source down the surface, and where some of it spills over a fold."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..array_types import Array
from ..errors import ParameterError
from . import _kernels as kernels
from . import path as paths
from .shape import rough_film, waves
from .support_surface import SupportSurface

HOLLOW = 0.25
"""Depth, in widths of the stream, of the deepest hollow that it fills and leaves again."""

MEANDERS = ((2.7, 3.0), (9.0, 6.0))
"""Distances by which rough skin turns a stream aside at most, and lengths over which it does, in half widths."""

WOBBLE = 0.3
"""Share of its width by which the trail narrows and widens."""


@dataclass(frozen=True, eq=False)
class StreamPath:
    """The path of a stream, or of one of its branches, with the irregularities of the water on it.

    Attributes
    ----------
    points : ndarray, shape (k, 3)
        At rest.
    begin, scale : float
        Length of the main path up to where this one begins, and its size as a share of the main one's.
    noise, spacing : ndarray and float
        Bumps over a grid of (s, w), see :func:`facewrinkle.tears.shape.rough_film`.
    wobble : ndarray
        Change of the trail's width along the grid, as a share.

    Examples
    --------
    Down a line 16 mm long, with a tenth more width everywhere and no bumps; s and w are known every 0.25 mm:

    >>> line = np.array([[0.0, 8, 0], [0, -8, 0]])
    >>> path = StreamPath(line, 0.0, 1.0, np.zeros((65, 9)), 0.25, np.full(65, 0.1))
    >>> wobble, noise = path.fields(np.array([4.0]), np.array([0.5]))
    >>> path.lengths, wobble, noise
    (array([ 0., 16.]), array([0.1]), array([0.]))
    """

    points: Array
    begin: float
    scale: float
    noise: Array
    spacing: float
    wobble: Array

    @cached_property
    def lengths(self) -> Array:
        """Length (k,) up to each point."""
        return paths.lengths(self.points)

    def fields(self, s: Array, w: Array) -> Array:
        """Return wobble and noise (2, n) at positions (n,) along the path and distances (n,) to its side."""
        out = np.empty((2, len(s)))
        kernels.look_up(s / self.spacing, w / self.spacing, self.wobble, self.noise, *out)
        return out


def irregular_path(
    points: Array, begin: float, scale: float, half: float, roughness: float, degree: int, random: np.random.Generator
) -> StreamPath:
    """Return a path with random irregularities, for a stream of half width `half`.

    The roughness, and the degree of the least squares, are as of :func:`facewrinkle.tears.shape.rough_film`.
    """
    noise, spacing = rough_film(float(paths.lengths(points)[-1]), half, roughness, degree, random)
    short, long = (waves(random, len(noise), waviness * half / spacing) for waviness in (1.5, 6.0))
    return StreamPath(points, begin, scale, noise, spacing, 0.5 * WOBBLE * (short + long))


@dataclass(frozen=True, eq=False)
class PathFinder:
    """Finds the path of a stream and those of its branches.

    Attributes
    ----------
    support, moved : SupportSurface
        The surface at rest, on which paths are given and returned, and in the frame down whose folds the water runs.
    rest : ndarray, shape (n, 3)
        Vertices of `moved` at rest.
    width, step, longest : float
        Of the stream; of a step of the descent; and the most that the stream runs.
    """

    support: SupportSurface
    moved: SupportSurface
    rest: Array
    width: float
    step: float
    longest: float

    def path(self, through: Any, start: Any, weight: Any) -> Array:
        """Return a path through points, along painted weights, or down from a start, whichever is given."""
        if through is not None:
            return paths.through(self.support, through, self.width)
        if weight is not None:
            return paths.painted(self.support, self._weights(weight), self.width)
        return self._descent(start)

    def _weights(self, weight: Any) -> Any:
        """Return painted weights; a name stands for point data of the face."""
        if not isinstance(weight, str):
            return weight
        face = self.support.face
        if face is None or weight not in face.mesh.point_data:
            raise ParameterError(f"there are no painted weights {weight!r} on the face. Pass the array itself.")
        return face.mesh.point_data[weight]

    def _descent(self, start: Any) -> Array:
        """Return the path down from a start, or from just below it where it is level or slopes inwards, as some lids.

        The start itself is always the first point.
        """
        support, moved = self.support, self.moved
        first = support.start(start, max(2.0 * self.width, 0.02 * support.size))
        lowered = 0.35 * self.width * np.arange(6.0)[:, None] * support.down
        for below in support.nearest(first + lowered)[1]:
            at = support.bound(np.array([first, below])).at(moved.points)
            path = paths.descent(moved, at[1], self.step, self.longest)
            if paths.lengths(path)[-1] > 1.5 * self.width:
                path = self._overflowed(path, lowered[1:])
                return moved.bound(np.concatenate([at[:1], path])).at(self.rest)
        raise ParameterError(
            f"no water runs from {first.round(2)}: the surface is level there, or ends. Start elsewhere, or give a "
            "path."
        )

    def _overflowed(self, path: Array, lowered: Array) -> Array:
        """Return the path, continued below hollows that the stream fills, such as creases of the lids."""
        moved = self.moved
        for below in moved.nearest(path[-1] + lowered)[1]:
            across = np.linspace(path[-1], below, 9)
            if np.linalg.norm(moved.nearest(across)[1] - across, axis=1).max() > HOLLOW * self.width:
                continue
            more = paths.descent(moved, below, self.step, max(self.longest - paths.lengths(path)[-1], self.step))
            if paths.lengths(more)[-1] > 1.5 * self.width and (below - path[-1]) @ moved.down > 0.0:
                return self._overflowed(np.concatenate([path, more]), lowered)
        return path

    def cut(self, path: Array) -> Array:
        """Return a path in equal steps, cut off at the most that the stream runs."""
        path = paths.resampled(path, self.step)
        path = path[paths.lengths(path) <= self.longest]
        if len(path) < 3 or not paths.lengths(path)[-1] > 0.0:
            raise ParameterError("the path has no length: its points coincide, or length is too small.")
        return path

    def meandered(self, path: Array, roughness: float, random: np.random.Generator) -> Array:
        """Return a path with the small turns that rough skin makes; its start stays."""
        half, along = 0.5 * self.width, np.gradient(path, axis=0)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        aside = np.cross(along, self.support.bound(path).at(self.support.normals))
        grown = np.minimum(paths.lengths(path) / (4.0 * half), 1.0)
        turns = sum(most * waves(random, len(path), over * half / self.step) for most, over in MEANDERS)
        return path + (roughness * half * grown * turns)[:, None] * aside

    def branches(self, path: Array, n: int) -> list[tuple[Array, float]]:
        """Return up to n paths that leave a path at folds, each with the length of the path up to there."""
        found: list[tuple[Array, float]] = []
        if not n:
            return found
        main = path
        if self.moved is not self.support:
            main = replace(self.moved, points=self.rest).bound(path).at(self.moved.points)
        for _ in range(n):
            spilled = paths.branch(self.moved, main, self.step, self.width)
            if spilled is None:
                break
            spilled = self.moved.bound(spilled).at(self.rest)
            for _ in range(4):  # little by little: it must stay on top of the fold
                spilled = paths.smoothed(self.support, spilled, 0.2 * self.width, 3)
            k = int(np.argmin(np.linalg.norm(path - spilled[0], axis=1)))
            found.append((spilled, float(paths.lengths(path)[k])))
            main = main[: max(k - 4, 0)]
        return found
