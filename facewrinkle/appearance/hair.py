"""Brows and lashes: hairs that follow the skin, drawn as ribbons."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyvista as pv

from ..anatomy import BoundHairs, Eyeball, Face, frame_of, load_head
from ..anatomy.landmarks import fitted_map
from ..array_types import Array, IntArray
from ..geometry import BoxTree, height_above, ring_quads, smoothstep, unit
from ..mesh.arrays import reshaped


@dataclass(frozen=True, eq=False)
class HairLines:
    """Hairs as lines on a face.

    Attributes
    ----------
    points : ndarray, shape (count, knots, 3)
    side, up : ndarray, shape (count, knots, 3)
        Unit vectors across the hairs, on the skin, and away from the skin.
    """

    points: Array
    side: Array
    up: Array

    def lift(self, some: IntArray, surface: tuple[Array, IntArray], deep: float, clear: Array) -> None:
        """Raise some hairs where they lie less than `deep` under a surface, until it is `clear` (knots,) below them."""
        place, up = (part[some].reshape(-1, 3) for part in (self.points, self.up))
        height = height_above(place, up, surface, deep).reshape(len(some), -1)
        self.points[some] += np.maximum(height + clear, 0.0)[..., None] * self.up[some]

    def every(self, step: int) -> HairLines:
        """Return one hair of so many."""
        return HairLines(self.points[::step], self.side[::step], self.up[::step])


class HairCards:
    """Ribbons along hairs, at least a pixel wide; where hairs are thinner than that, the ribbons are transparent.

    Parameters
    ----------
    half : ndarray, shape (count, knots)
        Half the width of the hairs at their points, in the unit of the mesh.
    tint : ndarray, shape (count, 3)
        Colors from 0 to 255.
    pixel : float
        Width of a pixel, in the unit of the mesh.
    """

    def __init__(self, half: Array, tint: Array, pixel: float) -> None:
        count, knots = half.shape
        self.half = np.maximum(np.ascontiguousarray(half), 0.5 * pixel)
        paint = np.empty((count, knots, 2, 4), np.uint8)
        paint[..., :3] = np.rint(np.clip(tint, 0.0, 255.0))[:, None, None]
        paint[..., 3] = np.rint(255.0 * half / self.half)[..., None]
        first = 2 * knots * np.arange(count)[:, None, None]
        quads = (first + ring_quads(2, knots, closed=False)).reshape(-1, 4)
        self._blank = pv.PolyData.from_regular_faces(np.zeros((2 * count * knots, 3)), quads)
        self._blank.point_data["paint"] = paint.reshape(-1, 4)

    def along(self, lines: HairLines) -> pv.PolyData:
        """Return the ribbons, with `paint` (rgba), along lines."""
        aside = self.half[..., None] * lines.side
        places = np.stack([lines.points - aside, lines.points + aside], axis=2)
        normals = np.repeat(lines.up[:, :, None], 2, axis=2)
        return reshaped(self._blank, places.reshape(-1, 3), normals.reshape(-1, 3))


def fitted_brows(face: Face) -> BoundHairs:
    """Return the eyebrows of the built-in head on another face, by the landmarks of both.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> fitted_brows(face).triangles.shape == face.bound_hair["brows"].triangles.shape
    True
    """
    head = load_head()
    places = head.brows.polylines(head.points, head.triangles, np.zeros_like(head.points))
    base = frame_of(head.landmarks)
    onto_face = fitted_map(head.landmarks, face.landmarks, base, face.frame)
    cells, weights, _ = BoxTree(face.points, face.triangles).closest(onto_face(places.reshape(-1, 3)))
    scale = face.frame.pupil_distance / base.pupil_distance
    return BoundHairs(cells.reshape(places.shape[:2]), weights.reshape(places.shape), scale * head.brows.heights)


class Hairs:
    """Hairs with a width and a color.

    Attributes
    ----------
    half : ndarray, shape (count, knots)
        Half the width of the hairs at their points, in the unit of the mesh.
    tint : ndarray, shape (count, 3)
        Colors from 0 to 255.
    """

    half: Array
    tint: Array

    def cards(self, pixel: float, every: int = 1) -> HairCards:
        """Return the ribbons of a picture whose pixels are so wide, in the unit of the mesh.

        With `every`, only one hair of so many, each the wider, but thinner than all of them side by side: they overlap.
        """
        return HairCards(every**0.75 * self.half[::every], self.tint[::every], pixel)


class Brows(Hairs):
    """The hairs of both eyebrows.

    They follow the skin, but bend less sharply: the pad of fat below a brow holds it together.

    Parameters
    ----------
    hairs : BoundHairs
    face : Face

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> brows = Brows(face.bound_hair["brows"], face)
    >>> lines = brows.lines(face.points, face.triangles, face.tissue.normals)
    >>> brows.cards(pixel=0.1).along(lines).point_data["paint"].shape[1]
    4
    """

    STRANDS = 3
    """Hairs drawn for each given one, shifted and with random lengths: brows are dense, and their hairs thin."""

    ENDS = 0.3
    """Share of a brow's length over which its hairs get finer towards either end."""

    STIFF, FINE = 0.5, 0.05
    """Shares of a brow's length: bends shorter than the first and longer than the second are straightened."""

    def __init__(self, hairs: BoundHairs, face: Face) -> None:
        self.hairs = hairs
        self._rest = hairs.polylines(face.points, face.triangles, face.normals)
        left = (self._rest[:, 0] - face.frame.origin) @ face.frame.axes[0] > 0.0
        self._sides = [_Stiffness(self._rest, np.flatnonzero(side), self.STIFF, self.FINE) for side in (left, ~left)]
        self._deepest = 0.08 * face.frame.pupil_distance
        width = 0.0017 * face.frame.pupil_distance
        k, p = hairs.triangles.shape
        random = np.random.default_rng(7)
        share = np.linspace(0.0, 1.0, p)
        shape = (k, self.STRANDS, 1)
        self._length = random.uniform(0.55, 1.05, shape[:2])
        aside, bend = random.normal(0.0, 7.0, shape), random.normal(0.0, 3.5, shape)
        self._aside = width * (aside * (1.0 - 0.5 * share) + bend * share**2)
        fine = np.empty(k)
        for brow in self._sides:
            fine[brow.hairs] = 0.25 + 0.75 * smoothstep(np.minimum(brow.place, 1.0 - brow.place) / self.ENDS)
        self.half = 0.5 * width * np.repeat(fine, self.STRANDS)[:, None] * (1.0 - 0.85 * share**2)
        self.tint = hairs.color * random.uniform(0.35, 1.65, (k * self.STRANDS, 1))

    def lines(
        self, points: Array, triangles: IntArray, normals: Array, surface: tuple[Array, IntArray] | None = None
    ) -> HairLines:
        """Return the hairs on skin with vertices at `points` (n, 3), and its vertex normals.

        Hairs are lifted out of the folds of the `surface`, the points and triangles of the refined skin.
        """
        lines, up = self.hairs.on_skin(points, triangles, normals)
        moved = lines[:, 0] - self._rest[:, 0]
        for brow in self._sides:
            slide, away = brow.correction(moved), up[brow.hairs]
            lines[brow.hairs] += slide - (slide * away).sum(axis=-1, keepdims=True) * away
        side, root = _across(lines, up), lines[:, None, :1]
        beside = root + self._length[..., None, None] * (lines[:, None] - root) + self._aside[..., None] * side[:, None]
        each = (np.repeat(part, self.STRANDS, axis=0) for part in (side, up))
        strands = HairLines(beside.reshape(-1, *lines.shape[1:]), *each)
        if surface is not None:
            for brow in self._sides:
                own = (self.STRANDS * brow.hairs[:, None] + np.arange(self.STRANDS)).ravel()
                strands.lift(own, surface, self._deepest, self.hairs.heights)
        return strands


class CroppedHair(Hairs):
    """The cropped hair of a head.

    Parameters
    ----------
    hairs : BoundHairs
    face : Face

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> crop = CroppedHair(face.bound_hair["cropped_hair"], face)
    >>> crop.lines(face.points, face.triangles, face.normals).points.shape == (*crop.half.shape, 3)
    True
    """

    HALF = 0.0028
    """Half the width of the longest at their roots, in distances between the pupils: each stands for some thin ones."""

    BRIGHTER = 1.25
    """Color of hairs relative to that of the scalp, which light reaches from more sides."""

    def __init__(self, hairs: BoundHairs, face: Face) -> None:
        self.hairs = hairs
        shape, random = hairs.triangles.shape, np.random.default_rng(5)
        along = np.linspace(0.0, 1.0, shape[1])
        tall = hairs.heights.max(axis=1, keepdims=True)
        thick = self.HALF * np.minimum(tall / np.median(tall), 1.0) * random.uniform(0.5, 1.2, (shape[0], 1))
        self.half = face.frame.pupil_distance * thick * (1.0 - 0.85 * along**2)
        self.tint = self.BRIGHTER * hairs.color * np.exp(0.18 * random.normal(size=(shape[0], 1)))
        turn = random.normal(0.0, 0.6, (shape[0], 1, 1))
        self._turned = np.cos(turn), np.sin(turn)

    def lines(
        self, points: Array, triangles: IntArray, normals: Array, surface: tuple[Array, IntArray] | None = None
    ) -> HairLines:
        """Return the hairs on skin with vertices at `points` (n, 3), and its vertex normals.

        No `surface` lifts them: they are longer than the folds of the scalp are deep.
        """
        lines, up = self.hairs.on_skin(points, triangles, normals)
        side = _across(lines, up)
        away = unit(np.cross(side, np.gradient(lines, axis=-2)))
        return HairLines(
            lines, self._turned[0] * side + self._turned[1] * away, self._turned[0] * away - self._turned[1] * side
        )


class Beard(CroppedHair):
    """The hairs of a beard, each of which stands for fewer."""

    HALF = 0.0014


KINDS: dict[str, type[Brows] | type[CroppedHair]] = {"brows": Brows, "cropped_hair": CroppedHair, "beard": Beard}
"""What draws the bound hair of a face, by name."""


class _Stiffness:
    """Straightens a brow: replaces its hairs' motion smoothed over little of its length by that smoothed over much."""

    def __init__(self, rest: Array, hairs: IntArray, stiff: float, fine: float) -> None:
        self.hairs = hairs
        roots = rest[hairs, 0]
        length = np.linalg.svd(roots - roots.mean(axis=0), full_matrices=False)[2][0]
        along, knots = rest[hairs] @ length, np.linspace(0.0, 1.0, 25)
        place = (along - along[:, 0].min()) / np.ptp(along[:, 0])
        self._smooth = _local_lines(place[:, 0], knots, stiff) - _local_lines(place[:, 0], knots, fine)
        self.place = place[:, 0]
        at = np.clip(place, 0.0, 1.0) * (len(knots) - 1.0)
        self._below = np.minimum(at.astype(int), len(knots) - 2)
        self._share = at - self._below

    def correction(self, moved: Array) -> Array:
        """Motion to add to the points of this brow's hairs, by the motion `moved` (k, 3) of the roots of all hairs."""
        knots, share = self._smooth @ moved[self.hairs], self._share[..., None]
        return np.asarray(knots[self._below] * (1.0 - share) + knots[self._below + 1] * share)


def _across(lines: Array, towards: Array) -> Array:
    """Unit vectors (..., p, 3) across lines and directions."""
    return unit(np.cross(unit(np.gradient(lines, axis=-2)), towards))


def _local_lines(place: Array, knots: Array, reach: float) -> Array:
    """Weights (knots, k) of values at places: they give, at each knot, the line that fits the values near it best."""
    apart = place - knots[:, None]
    near = np.exp(-0.5 * (apart / reach) ** 2)
    n, first, second = (near.sum(axis=1), (near * apart).sum(axis=1), (near * apart**2).sum(axis=1))
    return near * (second[:, None] - first[:, None] * apart) / (n * second - first**2)[:, None]


@dataclass(frozen=True)
class LashRow:
    """The lashes on one margin; lengths are in distances between the pupils.

    Attributes
    ----------
    count : int
    length : float
        Length of the longest lash.
    rise : tuple of float
        Upwards, relative to the length: factors of t and of t^2, where t is 0 at the root and 1 at the tip.
    droop : tuple of float
        Polynomial of t, added to the rise as the lids shut.
    root : float
        Height of the roots above the vertices of the margin.
    half : float
        Half the width at the root.
    color : tuple of float
    """

    count: int
    length: float
    rise: tuple[float, float]
    droop: tuple[float, ...]
    root: float
    half: float
    color: tuple[float, float, float]


class Lashes(Hairs):
    """Eyelashes that go with the margins of both lids of an eye.

    Parameters
    ----------
    eye : Eyeball
    face : Face

    Attributes
    ----------
    roots : list of tuple
        For each row of lashes, vertices of the skin (n,), and their weights (k, n) in the roots of its k lashes; empty
        if the skin has no opening before the eye.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> [len(weights) for _, weights in Lashes(face.eyes[0], face).roots]
    [130, 70]
    """

    KNOTS = 5

    def __init__(self, eye: Eyeball, face: Face) -> None:
        self.eye = eye
        self.roots: list[tuple[IntArray, Array]] = []
        self._paths: list[Array] = []
        self._droops: list[Array] = []
        size, random = face.frame.pupil_distance, np.random.default_rng(11)
        t = np.linspace(0.0, 1.0, self.KNOTS)
        self._deepest = 0.012 * size
        half, tint = [], []
        opening = face.eyelid_openings.get(eye.side)
        upper = LashRow(130, 0.105, (-0.05, 0.62), (-0.5, -0.05, 0.0), 0.014, 0.00085, (30.0, 23.0, 20.0))
        lower = LashRow(70, 0.06, (-0.25, -0.1), (0.0,), 0.016, 0.0005, (62.0, 45.0, 38.0))
        margins = [] if opening is None else [(upper, opening.upper), (lower, opening.lower)]
        for row, margin in margins:
            chain = np.asarray(margin, np.int32)
            along = (np.arange(row.count) + random.uniform(0.1, 0.9, row.count)) / row.count
            along = 0.1 + 0.88 * along
            self.roots.append((chain, _between(face.points[chain], along)))
            reach = size * row.length * random.uniform(0.5, 1.0, row.count) * (0.55 + 0.45 * np.sin(np.pi * along**1.3))
            fan = -0.45 + 1.25 * along + random.normal(0.0, 0.12, row.count)
            rise, out = row.rise[0] * t + row.rise[1] * t**2, 0.8 * t - 0.25 * t**2
            path = np.stack(np.broadcast_arrays(fan[:, None] * t, rise, out), axis=2)
            self._paths.append(np.array([0.0, 0.0, row.root * size]) + reach[:, None, None] * path)
            self._droops.append(reach[:, None] * np.polyval(row.droop, t))
            half.append(np.broadcast_to(row.half * size * (1.0 - 0.9 * t**1.5), (row.count, self.KNOTS)))
            tint.append(np.tile(row.color, (row.count, 1)))
        if self.roots:
            self.half, self.tint = np.concatenate(half), np.concatenate(tint)
            self._open_gap = self._gap(self._rooted(face.points))

    def _rooted(self, points: Array) -> list[Array]:
        """Roots (k, 3) of the lashes of each row."""
        return [weights @ points[chain] for chain, weights in self.roots]

    def _gap(self, roots: list[Array]) -> float:
        """Height of the upper margin above the lower one, on average."""
        return float((roots[0].mean(axis=0) - roots[-1].mean(axis=0)) @ self.eye.up)

    def lines(self, points: Array, surface: tuple[Array, IntArray] | None = None) -> HairLines:
        """Return the lashes on the lids of a face with vertices at `points` (n, 3), and out of a surface over them."""
        roots = self._rooted(points)
        shut = float(smoothstep(1.0 - self._gap(roots) / self._open_gap))
        rows = [
            self._row(root, path + [0.0, 1.0, 0.0] * (shut * droop)[..., None])
            for root, path, droop in zip(roots, self._paths, self._droops, strict=True)
        ]
        lines, out = (np.concatenate(parts) for parts in zip(*rows, strict=True))
        hairs = HairLines(lines, _across(lines, self.eye.gaze), out)
        if surface is not None:
            hairs.lift(np.arange(len(lines)), surface, self._deepest, np.linspace(0.0, self._deepest, self.KNOTS) / 4.0)
        return hairs

    def _row(self, root: Array, path: Array) -> tuple[Array, Array]:
        """Return lashes (k, p, 3) along paths [aside, up, ahead] from roots (k, 3), and the directions ahead (k, p, 3).

        Ahead is away from the middle of the eye, aside is along the row, and up across both, on the eye's upper side.
        """
        along, ahead = unit(np.gradient(root, axis=0)), unit(root - self.eye.centre)
        up = unit(np.cross(along, ahead))
        up *= np.sign((up @ self.eye.up).sum())
        aside = along - (along * ahead).sum(axis=-1, keepdims=True) * ahead
        lines = root[:, None] + path @ np.stack([aside, up, ahead], axis=1)
        return lines, np.repeat(ahead[:, None], path.shape[1], axis=1)


def _between(points: Array, along: Array) -> Array:
    """Weights (k, n) of points in the places on a smooth curve through them, at shares `along` of its length."""
    from scipy.interpolate import make_interp_spline

    place = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    return np.asarray(make_interp_spline(place / place[-1], np.eye(len(points)), k=min(3, len(points) - 1))(along))
