"""Stripes: the lines of a family, found once on the surface at rest.

Each vertex of the skin that a family folds has a wave: direction across the lines, wavelength, phase and strength. The
phases lower the stripe energy of Knoeppel et al., "Stripe Patterns on Surfaces" (ACM Trans. Graph. 34, 2015). Lines
branch and end where the phases of neighbors cannot agree. They are drawn on the triangles of the base mesh, split
evenly.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array, diags_array

from ...anatomy import Face
from ...anatomy.landmarks import fitted_map
from ...array_types import Array, BoolArray
from ...geometry import BoxTree, RedGreenForest, interpolated, side_lengths, smoothstep, symmetric_factors, unit
from ..base import SurfacePoints
from ..compression import along, dyads, orthonormal_tangents, principal
from . import _kernels as kernels
from .families import strength_of, window_of
from .tissue import OTHERS, OWN, between_bellies

KEPT = {"compression": np.float64, "wave": np.float32, "phase": np.float32, "share": np.float32}
"""Arrays that stripes are stored as. Where compression begins decides which triangles have lines: it is kept whole."""

Smoother = Callable[[Array], Array]


def level_for(face: Face, zone: BoolArray, length: Array) -> int:
    """Return how often the triangles of a zone are to be split, for wavelengths (n0,), mm, at the base vertices.

    Half of their edges are then no longer than 0.45 wavelengths, on which a wave is known well enough, or as long as
    four splits leave them.
    """
    edges = side_lengths(face.points[face.triangles[zone]] * face.unit)
    needed = np.log2(edges / (0.45 * length[face.triangles[zone]]))
    return int(np.clip(np.ceil(np.median(needed)), 0, 4))


class Ground:
    """The triangles of a zone, each split `level` times in four.

    Parameters
    ----------
    face : Face
    zone : ndarray of bool, shape (m0,)
        Base triangles.
    level : int

    Attributes
    ----------
    level : int
    base, triangles : ndarray of int32, shape (m0, 3) and (m, 3)
        The base mesh, and the split triangles of the zone: those of a base triangle in a row, its four parts one after
        the other, each with its four parts, and so on.
    row : ndarray of int, shape (m0,)
        Number of each base triangle in the zone, -1 for those outside.
    used : ndarray of int, shape (k,)
        Base vertices of the zone: its vertices, if it is not split.
    points : ndarray, shape (n, 3)
        Places of the vertices, mm.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> ground = Ground(face, np.arange(len(face.triangles)) < 10, 2)
    >>> len(ground.triangles), ground.row[8:12].tolist()
    (160, [8, 9, -1, -1])
    """

    def __init__(self, face: Face, zone: BoolArray, level: int) -> None:
        self.level, self.base = level, face.triangles
        self.used, corners = np.unique(face.triangles[zone], return_inverse=True)
        forest = RedGreenForest(corners.reshape(-1, 3), level)
        for _ in range(level):
            forest.split(np.arange(len(forest.triangles)))
        self.triangles = forest.triangles
        self.row = np.where(zone, np.cumsum(zone) - 1, -1)
        self._at = self.used[forest.corners].astype(np.int32), forest.barycentric
        self.points = self.at(face.points_mm)

    def at(self, values: Array) -> Array:
        """Return values (n0,) or (n0, d) of the base vertices, interpolated at the vertices."""
        found = interpolated(values.reshape(len(values), -1), *self._at)
        return found.reshape(-1, *values.shape[1:])


class Smoothing:
    """Averages over the ground with the finite elements of its triangles.

    Parameters
    ----------
    ground : Ground

    Attributes
    ----------
    mass : ndarray, shape (n,)
        Area around each vertex, mm^2.
    """

    def __init__(self, ground: Ground) -> None:
        self._triangles = t = ground.triangles
        corners = ground.points[t]
        sides = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)  # each opposite a corner
        normals = np.cross(sides[:, 0], sides[:, 1])
        double = np.linalg.norm(normals, axis=1)
        normals /= np.maximum(double, 1e-300)[:, None]
        double = np.maximum(double, 1e-3 * (sides**2).sum(axis=2).max(axis=1))  # the least height over the longest side
        self._area, self._slopes = 0.5 * double, np.cross(normals[:, None], sides) / double[:, None, None]
        self.mass = np.bincount(t.ravel(), np.repeat(self._area / 3.0, 3))

    def over(self, spread: Array, turns: Array | None = None) -> Smoother:
        """Return what averages values (n,) or (n, d): one step of diffusion, ``(M + K)^-1 M``.

        Parameters
        ----------
        spread : ndarray, shape (m, 3, 3)
            Half the covariance of the weights in each triangle, mm^2.
        turns : ndarray, shape (m, 3, 2, 2), optional
            What brings the values of each corner, pairs of numbers (n, 2), to the middle of the triangle before they
            are compared.
        """
        energy = self._area[:, None, None] * (self._slopes @ spread @ np.swapaxes(self._slopes, 1, 2))
        index, mass = self._triangles[:, :, None], self.mass
        blocks = energy[:, :, None, :, None]
        if turns is not None:
            index, mass = 2 * index + np.arange(2), np.repeat(mass, 2)
            blocks = np.einsum("mab,maci,mbcj->maibj", energy, turns, turns)
        rows = np.broadcast_to(index[:, :, :, None, None], blocks.shape)
        columns = np.broadcast_to(index[:, None, None, :, :], blocks.shape)
        matrix = csc_array((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(len(mass),) * 2)
        factors = symmetric_factors(csc_array(matrix + diags_array(mass)))

        def smooth(values: Array) -> Array:
            flat = values.reshape(len(mass), -1)
            return np.asarray(factors.solve(mass[:, None] * flat).reshape(values.shape))

        return smooth


@dataclass(frozen=True)
class Style:
    """Choices that the lines of a face depend on.

    Attributes
    ----------
    seed : int
    irregularity : float
        0: lines as parallel and alike as the compression lets them; 1: as on faces.
    length : float
        Multiplies the distance along the lines within which they are as strong. Where they lie does not change.
    """

    seed: int = 0
    irregularity: float = 1.0
    length: float = 1.0


@dataclass(frozen=True, eq=False)
class Stripes:
    """The lines of one family on a face.

    Attributes
    ----------
    ground : Ground
        The triangles that the family folds, split.
    wave : ndarray, shape (n, 3)
        Wave vectors at its vertices, 1/mm: across the lines, ``2 pi / L`` long.
    phase, share : ndarray, shape (n,)
        Phase, radians: 0 on a bulge, pi in a furrow; and strength in [0, 1].
    compression : ndarray, shape (n0,)
        The compression of the family in full motion, at the base vertices.
    """

    ground: Ground
    wave: Array
    phase: Array
    share: Array
    compression: Array

    @cached_property
    def window(self) -> Array:
        """The window (n0,) of the family at the base vertices."""
        return window_of(self.compression)

    @property
    def zone(self) -> BoolArray:
        """Base triangles (m0,) on which the family has lines."""
        return self.ground.row >= 0

    def at(self, points: SurfacePoints, near: npt.NDArray[np.int64]) -> tuple[Array, Array, Array]:
        """Return phase (n,), strength (n,) and wave vector (n, 3) at some points, numbers (n,), that lie in the zone.

        Inside a triangle it is the sum of the plane waves at its corners.
        """
        theta, strength, wave = np.empty(len(near)), np.empty(len(near)), np.empty((len(near), 3))
        ground = self.ground
        kernels.waves_at(
            near, (points.host, points.corners, points.barycentric), (ground.base, ground.row, ground.level),
            (ground.triangles, ground.points, self.wave, self.phase, self.share), (theta, strength, wave),
        )  # fmt: skip
        return theta, strength, wave


def carried(lines: Mapping[str, Stripes], home: Face, face: Face, length: Array) -> dict[str, Stripes]:
    """Return the lines of one face on another of other triangles, where both have the same landmarks.

    Each point has the wave of the point that is the closest after the smooth map that takes landmarks to landmarks: as
    many lines, as far apart as the skin between the landmarks is large. Wave vectors are carried back by the slopes of
    the map, which are found about where the vertices of `home` lie on the other face, and interpolated.

    Parameters
    ----------
    lines : mapping of str to Stripes
        The lines of `home`, by family; of those that lie on the other face there is one each in the result.
    home, face : Face
    length : ndarray, shape (n0,)
        Wavelength at the base vertices of `face`, mm.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> from facewrinkle.simulation.fold_layers import fold_shapes
    >>> from facewrinkle.layers.wave_folds.field import lines_of
    >>> head = fw.default_face()
    >>> other = fw.fit_face(head.mesh.decimate(0.3), head.landmarks)
    >>> list(lines_of(other, fold_shapes(other, fw.Skin(other)), 1.0, Style()))
    ['forehead', 'brows', 'eyes', 'cheeks', 'chin']
    """
    onto = fitted_map(face.landmarks, home.landmarks, face.frame, home.frame)
    tree = BoxTree(home.points, home.triangles)
    near, out = _closest(home, tree, onto(face.points)), {}
    back, step = fitted_map(home.landmarks, face.landmarks, home.frame, face.frame)(home.points), 0.5 / face.unit  # mm
    slopes = np.hstack([(onto(back + step * axis) - onto(back)) / step for axis in np.eye(3)])
    for name, own in lines.items():
        compression = interpolated(own.compression[:, None], near.corners, near.barycentric)[:, 0]
        zone = zone_of(face, compression)
        if not zone.any():
            continue
        ground = Ground(face, zone, level_for(face, zone, length))
        there = _closest(home, tree, onto(ground.points / face.unit)) if ground.level else near.taken(ground.used)
        inside = np.flatnonzero(own.zone[there.host])
        wave, (phase, share) = np.zeros_like(ground.points), np.zeros((2, len(ground.points)))
        phase[inside], share[inside], waves = own.at(there, inside)
        turn = interpolated(slopes, there.corners[inside], there.barycentric[inside]).reshape(-1, 3, 3)
        wave[inside] = np.einsum("nak,nk->na", turn, waves) * (home.unit / face.unit)
        out[name] = Stripes(ground, wave, phase, share, compression)
    return out


def _closest(home: Face, tree: BoxTree, places: Array) -> SurfacePoints:
    """Return the points of a face that are the closest to places (n, 3), with the tree of its triangles."""
    host, weights, _ = tree.closest(places)
    corners = home.triangles[host]
    return SurfacePoints(
        interpolated(home.points, corners, weights), home.normals[corners[:, 0]], corners, weights, host
    )


def zone_of(face: Face, compression: Array) -> BoolArray:
    """Return the base triangles (m0,) that a family with a compression (n0,) in full motion has lines on."""
    return np.asarray((window_of(compression) > 0.0)[face.triangles].any(axis=1))


def found_stripes(
    face: Face, name: str, tensor: Array, length: Array, style: Style, under: tuple[Array, Array]
) -> Stripes:
    """Find the stripes of a family.

    Parameters
    ----------
    face : Face
    name : str
        Name of the family, on which its random numbers depend.
    tensor : ndarray, shape (n0, 6)
        See :func:`facewrinkle.layers.wave_folds.families.tensors_of`.
    length : ndarray, shape (n0,)
        Wavelength at the base vertices, mm.
    style : Style
    under : tuple of ndarray, shape (n0, 6)
        :func:`facewrinkle.layers.wave_folds.tissue.grain` and ``anatomical`` there.
    """
    compression = strength_of(tensor)
    zone = zone_of(face, compression)
    ground = Ground(face, zone, level_for(face, zone, length))
    rng, smoothing = np.random.default_rng([style.seed, zlib.crc32(name.encode())]), Smoothing(ground)
    normals, local = unit(ground.at(face.normals)), ground.at(length)
    sideways = np.outer(face.frame.axes[0], face.frame.axes[0])
    places = (ground.points - face.unit * face.frame.origin) @ face.frame.axes.T / np.median(local)
    area = local[ground.triangles].mean(axis=1)[:, None, None] ** 2

    def random(smooth: Smoother) -> Array:
        values = smooth(smooth(_noise(places, rng)))
        values = values - values.mean()
        return np.asarray(np.clip(values / max(float(values.std()), 1e-9), -2.0, 2.0))

    even = smoothing.over(0.25 * area * np.eye(3))  # all around, as far as a wavelength
    d, share = _directions(even, ground.at(tensor), normals)
    turn = 0.06 * style.irregularity * random(even)[:, None]  # radians, by which lines leave the direction
    d = np.cos(turn) * d + np.sin(turn) * np.cross(normals, d)
    share = share * _left(even(ground.at(under[0])), ground.at(under[1]), d)

    # Phases are aligned less far sideways between the bellies of the frontalis: the two sides of captured foreheads are
    # alike by .3 only. With all of it lines would end in knots there.
    gap = 0.85 * ground.at(between_bellies(face))[ground.triangles].mean(axis=1)
    apart = np.eye(3) - gap[:, None, None] * sideways

    # Phases are aligned so far across and along the lines, in wavelengths (a standard deviation), and random numbers
    # are averaged so far, that each line has its own.
    aligned, striated = (0.55, 1.3), (0.40, 2.6)

    def directed(across: float, along: float) -> Array:
        squares = (d[:, :, None] * d[:, None, :])[ground.triangles].mean(axis=1)
        return np.asarray(0.5 * area * (along**2 * np.eye(3) + (across**2 - along**2) * squares))

    uneven = random(smoothing.over(directed(*striated)))
    stretched = np.exp(style.irregularity * (0.12 + 0.38 * uneven))  # mean and standard deviation of the logarithm
    wave = 2.0 * np.pi * d / (local * stretched)[:, None]
    start = np.stack([_noise(places, rng), _noise(places, rng)], axis=1)
    psi = _aligned(smoothing.over(apart @ directed(*aligned) @ apart, _turns(ground, wave)), start)
    lines = random(smoothing.over(directed(striated[0], striated[1] * style.length)))
    share = share * np.hypot(*psi.T) * _strengths(lines, style)
    return Stripes(ground, wave, np.arctan2(psi[:, 1], psi[:, 0]), share, compression)


def _noise(places: Array, rng: np.random.Generator) -> Array:
    """Return random numbers (n,) at places (n, 3), in wavelengths: a field in space, so that other vertices on the same
    surface have the same.
    """
    count, shortest = 128, 0.9  # plane waves of which it is the sum, and their least length
    waves = unit(rng.normal(size=(count, 3))) * (2.0 * np.pi / shortest * np.cbrt(rng.random((count, 1))))
    out = np.zeros(len(places))
    for wave, phase in zip(waves, 2.0 * np.pi * rng.random(count), strict=True):
        out += np.cos(places @ wave + phase)
    return out


def _directions(even: Smoother, tensors: Array, normals: Array) -> tuple[Array, Array]:
    """Return the directions (n, 3) across the lines, and how strong (n,) these can be.

    Skin that is compressed in all directions has no lines: by the difference of the principal values over their sum, 0
    to 1. Neither has skin whose directions turn round within a wavelength: their order is 1 where all are parallel.
    """
    d, single = _principal(even(even(tensors)), normals)
    order = _principal(even(even(dyads(d))), normals)[1]
    undirected, directed, swirling, ordered = 0.05, 0.35, 0.45, 0.75  # from none to all
    share = smoothstep((single - undirected) / (directed - undirected))
    return d, share * smoothstep((order - swirling) / (ordered - swirling))


def _principal(tensors: Array, normals: Array) -> tuple[Array, Array]:
    """Return the tangents (n, 3) of the largest value of tensors (n, 6), and how far (n,) that exceeds the least one,
    over their sum.
    """
    flat = np.tile([1.0, 1.0, 1.0, 0.0, 0.0, 0.0], (len(normals), 1))
    values, _, tangents = principal(tensors, *orthonormal_tangents(flat, normals))
    # Not along an axis of a face: signs, on which phases depend, are no matter of rounding on the median plane.
    tangents *= np.where(tangents @ [0.3779, 0.8137, 0.4416] < 0.0, -1.0, 1.0)[:, None]
    return tangents, np.diff(values, axis=1)[:, 0] / np.maximum(values.sum(axis=1), 1e-30)


def _left(grain: Array, anatomical: Array, d: Array) -> Array:
    """Return the share (n,) of the lines that muscles under the skin let be, all of those across their fibers, and that
    anatomical folds leave, which are drawn once.
    """
    taken = OTHERS * anatomical[:, :3].sum(axis=1) + (OWN - OTHERS) * along(anatomical, d)
    return np.asarray((1.0 - grain[:, :3].sum(axis=1) + along(grain, d)) ** 2 * (1.0 - np.clip(taken, 0.0, 1.0)))


def _strengths(lines: Array, style: Style) -> Array:
    """Return the strength (n,) of each line, by random numbers (n,)."""
    rank = np.argsort(np.argsort(lines, kind="stable")) / max(len(lines) - 1, 1)
    # The weakest lines are 0.3 times as strong as the strongest.
    lowest, length = 1.0 - 0.7 * min(style.irregularity, 1.0), style.length
    lowest = lowest * (2.0 * length - 1.0) if length < 1.0 else 1.0 - (1.0 - lowest) / length
    return np.asarray(lowest + (1.0 - lowest) * rank**0.8)


# --- phases ------------------------------------------------------------------------------------------


def _aligned(smooth: Smoother, start: Array) -> Array:
    """Return waves (n, 2) of phases that agree along the lines and across them: their cosine and sine, shorter where
    neighbors cannot agree.

    Each of 20 steps lowers the stripe energy, and brings all to the length 1 again. They begin at the directions of
    `start`.
    """
    psi = unit(start)
    for _ in range(20):
        psi = unit(smooth(psi))
    return smooth(psi)


def _turns(ground: Ground, wave: Array) -> Array:
    """Return what brings waves from the corners of triangles to their middles: matrices (m, 3, 2, 2) that turn them,
    conjugated before where they run against that of the first corner.
    """
    own = wave[ground.triangles]
    sign = np.where((own * own[:, :1]).sum(axis=2) >= 0.0, 1.0, -1.0)
    corners = ground.points[ground.triangles]
    mean = (sign[:, :, None] * own).mean(axis=1)
    angle = np.einsum("mk,mck->mc", mean, corners.mean(axis=1)[:, None] - corners)
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -sign * s], axis=-1), np.stack([s, sign * c], axis=-1)], axis=-2)
