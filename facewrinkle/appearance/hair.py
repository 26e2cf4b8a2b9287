"""Hairs that are drawn beside the skin: brows and lashes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.spatial import cKDTree

from ..anatomy.brow_hairs import BrowHairs
from ..anatomy.eyeball import Eyeball
from ..anatomy.face import Face
from ..geometry.interpolation import height_above
from ..geometry.normals import vertex_normals
from ..geometry.smoothstep import smoothstep

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]

NEAREST = 5
"""So many triangles about a hair may be the one under it."""

DROOP = [-0.5, -0.05, 0.0]
"""How much lower the lashes of a shut upper lid are than they stand on an open one, by the share of their length: a
polynomial, relative to it.
"""


class HairCards:
    """BrowHairs as ribbons that are drawn at least a pixel wide, the thinner the more transparent.

    Parameters
    ----------
    half : ndarray, shape (count, knots)
        Half the width of the hairs at their points, in the unit of the mesh.
    tint : ndarray, shape (count, 3)
    pixel : float
        Width of a pixel, in the unit of the mesh.
    """

    def __init__(self, half: Array, tint: Array, pixel: float) -> None:
        count, knots = half.shape
        self.half = np.maximum(half, 0.5 * pixel)[..., None]
        paint = np.empty((count, knots, 2, 4))
        paint[..., :3] = tint[:, None, None]
        paint[..., 3] = 255.0 * (half / self.half[..., 0])[..., None]
        self._paint = np.rint(np.clip(paint, 0.0, 255.0)).astype(np.uint8).reshape(-1, 4)
        corner = 2 * knots * np.arange(count)[:, None] + 2 * np.arange(knots - 1)
        self._quads = np.stack([corner, corner + 1, corner + 3, corner + 2], axis=-1).reshape(-1, 4)

    def along(self, lines: Array, side: Array, normals: Array) -> pv.PolyData:
        """The ribbons, with `paint` (rgba), along lines (count, knots, 3); unit `side` lies across, in the ribbon."""
        ribbons = np.stack([lines - self.half * side, lines + self.half * side], axis=2)
        mesh = pv.PolyData.from_regular_faces(ribbons.reshape(-1, 3), self._quads)
        mesh.point_data["Normals"] = np.broadcast_to(normals[:, :, None], ribbons.shape).reshape(-1, 3)
        mesh.point_data["paint"] = self._paint
        return mesh


class Brows:
    """The eyebrows' hairs, which follow the skin, but not around bends: the pad of fat below a brow holds it together.

    Parameters
    ----------
    hairs : BrowHairs
    face : Face
    pixel : float
        Width of a pixel, in the unit of the mesh.
    """

    STRANDS = 3
    """Drawn per hair, shifted and shortened at random: the brow is dense and its hairs are thin."""

    STIFF, FINE = 0.5, 0.05
    """Bends on less than the one share of a brow's length are straightened, by what is left of them over the other."""

    def __init__(self, hairs: BrowHairs, face: Face, pixel: float) -> None:
        self.hairs = hairs
        self._rest = hairs.polylines(face.points, face.triangles, vertex_normals(face.points, face.triangles))
        left = (self._rest[:, 0] - face.frame.origin) @ face.frame.axes[0] > 0.0
        self._sides = [_Stiffness(self._rest, np.flatnonzero(side), self.STIFF, self.FINE) for side in (left, ~left)]
        self._deep = 0.08 * face.frame.pupil_distance
        width = 0.0017 * face.frame.pupil_distance
        k, p = hairs.triangles.shape
        random = np.random.default_rng(7)
        share = np.linspace(0.0, 1.0, p)[:, None]
        shape = (k, self.STRANDS, 1, 1)
        self._length = random.uniform(0.55, 1.05, shape)
        self._aside = width * (
            random.uniform(-8.0, 8.0, shape) * (1.0 - 0.5 * share) + random.normal(0.0, 3.5, shape) * share**2
        )
        half = np.broadcast_to(0.5 * width * (1.0 - 0.85 * share[:, 0] ** 2), (k * self.STRANDS, p))
        tint = np.array([78.0, 56.0, 47.0]) * random.uniform(0.65, 1.35, (k * self.STRANDS, 1))
        self._ribbons = HairCards(half, tint, pixel)

    def at(
        self, points: Array, triangles: IntArray, normals: Array, surface: tuple[Array, IntArray] | None = None
    ) -> pv.PolyData:
        """The hairs, with `paint` (rgba), on the skin as it is now: its points and vertex normals (n, 3), and the
        points and triangles that it is refined to.
        """
        lines = self.hairs.polylines(points, triangles, normals)
        up = np.einsum("kpc,kpci->kpi", self.hairs.weights, normals[triangles[self.hairs.triangles]])
        moved = lines - self._rest
        for part in self._sides:
            slide = part.straightened(moved)
            lines[part.hairs] += slide - (slide * up[part.hairs]).sum(axis=2, keepdims=True) * up[part.hairs]
        side = _unit(np.cross(np.gradient(lines, axis=1), up))
        strands = lines[:, None, :1] + self._length * (lines - lines[:, :1])[:, None] + self._aside * side[:, None]
        shape = (-1, *lines.shape[1:])
        up, side = (np.broadcast_to(a[:, None], strands.shape).reshape(shape) for a in (up, side))
        strands = strands.reshape(shape)
        if surface is not None:
            strands += self._rise(strands, up, *surface)[..., None] * up
        return self._ribbons.along(strands, side, up)

    def _rise(self, lines: Array, up: Array, points: Array, triangles: IntArray) -> Array:
        """How far (k, p) hairs have to rise that are under a surface: in folds of it, or as they slid."""
        low, high = lines.min(axis=(0, 1)), lines.max(axis=(0, 1))
        middle = points[triangles].mean(axis=1)
        near = np.flatnonzero(((middle > low) & (middle < high)).all(axis=1))
        if len(near) < NEAREST:
            return np.zeros(lines.shape[:2])
        around = near[cKDTree(middle[near]).query(lines.reshape(-1, 3), k=NEAREST)[1]]
        height = height_above(lines.reshape(-1, 3), up.reshape(-1, 3), (points, triangles), around, self._deep)
        return np.asarray(np.maximum(height.reshape(lines.shape[:2]) + self.hairs.heights, 0.0))


class _Stiffness:
    """What straightens a brow: the difference of its hairs' motion smoothed over much and over little of its length."""

    def __init__(self, rest: Array, hairs: npt.NDArray[np.int64], stiff: float, fine: float) -> None:
        self.hairs = hairs
        roots = rest[hairs, 0]
        length = np.linalg.svd(roots - roots.mean(axis=0), full_matrices=False)[2][0]
        along, knots = rest[hairs] @ length, np.linspace(0.0, 1.0, 25)
        place = (along - along[:, 0].min()) / np.ptp(along[:, 0])
        self._smooth = _local_lines(place[:, 0], knots, stiff) - _local_lines(place[:, 0], knots, fine)
        at = np.clip(place, 0.0, 1.0) * (len(knots) - 1.0)
        self._below = np.minimum(at.astype(int), len(knots) - 2)
        self._share = (at - self._below)[..., None]

    def straightened(self, moved: Array) -> Array:
        """What is to be added to the motion of the hairs' points, which is (k, p, 3) for all hairs."""
        knots = self._smooth @ moved[self.hairs, 0]
        return knots[self._below] * (1.0 - self._share) + knots[self._below + 1] * self._share


def _local_lines(place: Array, knots: Array, reach: float) -> Array:
    """Weights (knots, k) of values at places in the lines that fit those near a knot best, at the knot."""
    apart = place - knots[:, None]
    near = np.exp(-0.5 * (apart / reach) ** 2)
    n, first, second = (near.sum(axis=1), (near * apart).sum(axis=1), (near * apart**2).sum(axis=1))
    return near * (second[:, None] - first[:, None] * apart) / (n * second - first**2)[:, None]


class Lashes:
    """Eyelashes on both margins of the lids, which go with them.

    Parameters
    ----------
    eye : Eyeball
    face : Face
    pixel : float
        Width of a pixel, in the unit of the mesh.
    """

    KNOTS = 5

    def __init__(self, eye: Eyeball, face: Face, pixel: float) -> None:
        self.eye = eye
        self.roots: list[tuple[IntArray, Array]] = []
        self._paths: list[Array] = []
        self._droops: list[Array] = []
        opening = face.eyelid_openings.get(eye.side)
        margins = None if opening is None else (opening.upper, opening.lower)
        size, random = face.frame.pupil_distance, np.random.default_rng(11)
        self._closed = margins is None
        slit = _slit(eye, face) if margins is None else None
        half, tint = [], []
        chains: Sequence[npt.NDArray[np.integer]] = margins or (() if slit is None else (slit[0],))
        for chain, count, length, sign in zip(chains, (130, 70), (0.105, 0.06), (1.0, -1.0), strict=False):
            along = (np.arange(count) + random.uniform(0.1, 0.9, count)) / count
            along = 0.1 + 0.88 * along
            if slit is None:
                weights = _between(face.points[chain], along)
            else:
                weights = _between(slit[1] @ face.points[chain], along) @ slit[1]
            self.roots.append((np.asarray(chain, np.int32), weights))
            t = np.linspace(0.0, 1.0, self.KNOTS)
            reach = size * length * random.uniform(0.5, 1.0, count) * (0.55 + 0.45 * np.sin(np.pi * along**1.3))
            fan = -0.45 + 1.25 * along + random.normal(0.0, 0.12, count)
            out = 0.8 * t - 0.25 * t**2
            rise = sign * ((-0.05 if sign > 0.0 else 0.25) * t + (0.62 if sign > 0.0 else 0.1) * t**2)
            if self._closed:  # the upper lid looks down, and its lashes with it
                rise = -0.55 * t + 0.12 * t**2
            path = np.stack([fan[:, None] * t, rise + 0.0 * fan[:, None], out + 0.0 * fan[:, None]], axis=2)
            root = np.array([0.0, 0.0, (0.014 if sign > 0.0 else 0.016) * size])
            self._paths.append(root + reach[:, None, None] * path)
            self._droops.append(reach[:, None] * (np.polyval(DROOP, t) if sign > 0.0 and not self._closed else 0.0 * t))
            thick = 0.00085 if sign > 0.0 else 0.0005
            half.append(np.broadcast_to(thick * size * (1.0 - 0.9 * t**1.5), (count, self.KNOTS)))
            tint.append(np.tile([30.0, 23.0, 20.0] if sign > 0.0 else [62.0, 45.0, 38.0], (count, 1)))
        if self.roots:
            self._ribbons = HairCards(np.concatenate(half), np.concatenate(tint), pixel)
            self._apart = self._gap(face.points)

    def _gap(self, points: Array) -> float:
        """How much higher the upper margin lies than the lower one, on average."""
        heights = [(weights @ points[chain]).mean(axis=0) @ self.eye.up for chain, weights in self.roots]
        return float(heights[0] - heights[-1])

    def at(self, points: Array) -> pv.PolyData:
        """The lashes, with `paint` (rgba), on lids whose vertices are where they are now (n, 3)."""
        lines, sides, outs = [], [], []
        shut = 0.0 if self._closed else float(smoothstep(1.0 - self._gap(points) / self._apart))
        for (chain, weights), path, droop in zip(self.roots, self._paths, self._droops, strict=True):
            root = weights @ points[chain]
            out = _unit(root - self.eye.centre)
            along = _unit(np.gradient(root, axis=0))
            up = _unit(np.cross(out, along) * np.sign((np.cross(out, along) @ self.eye.up).sum()))
            along -= (along * out).sum(axis=1, keepdims=True) * out
            bent = path + shut * droop[..., None] * [0.0, 1.0, 0.0]
            line = root[:, None] + np.einsum("kpc,kci->kpi", bent, np.stack([along, up, out], axis=1))
            side = _unit(np.cross(np.gradient(line, axis=1), self.eye.gaze))
            lines.append(line)
            sides.append(side)
            outs.append(np.broadcast_to(out[:, None], line.shape))
        return self._ribbons.along(*(np.concatenate(part) for part in (lines, sides, outs)))


def _slit(eye: Eyeball, face: Face) -> tuple[npt.NDArray[np.int64], Array] | None:
    """Where closed lids meet: vertices of the skin, and their weights (k, n) in places from inside outwards.

    None if there is no skin before the eye.
    """
    inner, outer = (face.landmarks[f"eye_{eye.side}_{end}"] for end in ("inner", "outer"))
    forward = 2.0 * np.linalg.norm(outer - inner) * eye.gaze
    corners, weights = [], []
    for place in eye.slit(inner, outer, np.linspace(0.0, 1.0, 25)):
        seen, cells = face.mesh.ray_trace(place + forward, place - forward)
        if not len(seen):
            continue
        front = int(np.argmax(seen @ eye.gaze))
        corner = face.triangles[cells[front]]
        a, b, c = face.points[corner]
        system = np.vstack([np.stack([a, b, c], axis=1), np.full(3, np.linalg.norm(forward))])
        weights.append(np.linalg.lstsq(system, np.append(seen[front], np.linalg.norm(forward)), rcond=None)[0])
        corners.append(corner)
    if len(corners) < 8:
        return None
    chain, of = np.unique(corners, return_inverse=True)
    dense = np.zeros((len(corners), len(chain)))
    np.put_along_axis(dense, of.reshape(-1, 3), np.array(weights), axis=1)
    return chain, dense


def _between(points: Array, along: Array) -> Array:
    """Weights (k, n) of points in order that give the places at shares of the length of a smooth curve through them."""
    from scipy.interpolate import make_interp_spline

    place = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    return np.asarray(make_interp_spline(place / place[-1], np.eye(len(points)), k=3)(along))


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))
