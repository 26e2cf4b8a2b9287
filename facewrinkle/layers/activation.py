"""Activation of muscles by measured compression: in place of contraction rates where a recording moves the skin."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..anatomy.face import Face
from ..anatomy.muscles import Muscle
from ..array_types import Array, BoolArray
from ..geometry.interpolation import interpolated, smoothstep
from ..geometry.normals import double_areas, vertex_normals
from .compression import StrainField, orthonormal_tangents, per_length, principal, shortening, tangents_of

SLACK, FULL = 0.015, 0.05
"""Mean compression of a muscle's region below which its wrinkles are absent, and from which they are as deep as the
local compression makes them.
"""

ASLANT, ACROSS = 0.45, 0.6
"""Share of the largest compression in a muscle's region below which skin does not fold along that muscle, because
it folds in another direction, and from which it does.
"""

PARALLEL, SAME = 0.98, 0.9
"""Cosine between directions, and share of both regions, from which on two muscles fold the same wrinkles."""

QUARTERS = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 2]]) / 6.0
"""Centroids of the four parts of a triangle."""


class Activation:
    """Compression of the skin over each muscle, along it, as a number in [0, 1] like a contraction rate.

    It is the mean of the compression (0 where the skin is stretched) over the muscle's wrinkling region, by a smooth
    step from 0 at `SLACK` to 1 at `FULL`. Where the skin is compressed far more in another direction, it folds in that
    one instead: a second smooth step falls to 0 from `ACROSS` to `ASLANT`. The compression is measured at fixed points
    of the base mesh, so that refinement does not change it. Where several muscles fold the same skin in the same
    direction, only the one with the deepest wrinkles acts.

    Parameters
    ----------
    face : Face
    muscles : list of Muscle
        Fold patterns of its muscles.
    zones : ndarray of bool, shape (k, m0)
        Triangles that each muscle may touch.
    field : StrainField
        Strain of the base mesh, at least in the zones.

    Examples
    --------
    A recording that compresses the face vertically activates the muscle that lifts the brows, not the one that frowns:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> folds = [muscle.fold_pattern for muscle in face.muscles.values()]
    >>> field = StrainField(face.points, face.triangles)
    >>> activation = Activation(face, folds, face.zones, field)
    >>> rates = activation.at(field.strain(face.points * [1.0, 0.9, 1.0])).round(2)
    >>> rates = dict(zip(face.muscles, rates, strict=True))
    >>> float(rates["frontalis_inner_l"]), float(rates["corrugator_l"])
    (1.0, 0.0)
    """

    def __init__(self, face: Face, muscles: list[Muscle], zones: BoolArray, field: StrainField) -> None:
        hosts = np.flatnonzero(zones.any(axis=0))
        self._used, local = np.unique(face.triangles[hosts], return_inverse=True)
        self._corners = np.repeat(local.reshape(-1, 3).astype(np.int32), 4, axis=0)
        self._weights = np.tile(QUARTERS, (len(hosts), 1))
        upright, rest = vertex_normals(face.points, face.triangles)[self._used], field.metric[self._used]
        self._basis = orthonormal_tangents(rest, upright)
        where, normals, metric = (
            interpolated(values, self._corners, self._weights) for values in (face.points[self._used], upright, rest)
        )
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        area = np.repeat(double_areas(face.points, face.triangles[hosts]), 4)
        entries = [
            _entries(muscle, np.flatnonzero(np.repeat(zone[hosts], 4)), where, normals, metric, area)
            for muscle, zone in zip(muscles, zones, strict=True)
        ]
        doubled = _doubled(entries, [muscle.wrinkles.depth for muscle in muscles])
        self._count, nothing = len(muscles), (np.empty(0, int), np.empty(0), np.empty((0, 6)))
        acting = [(np.full(len(entries[k][0]), k), *entries[k][:3]) for k in np.flatnonzero(~doubled)]
        self._muscle, self._point, self._share, self._products = (
            np.concatenate(column) for column in zip((nothing[0], *nothing), *acting, strict=True)
        )

    def at(self, strain: Array) -> Array:
        """Return the activation (k,) of the muscles at a strain (n0, 6) of the base mesh."""
        now = strain[self._used]
        change = interpolated(now, self._corners, self._weights)[self._point] * self._products
        epsilon, (values, *_) = shortening(change.sum(axis=1)), principal(now, *self._basis)
        most = interpolated(np.clip(-values[:, :1], 0.0, 1.0), self._corners, self._weights)[self._point, 0]
        mean, ours, largest = (
            np.bincount(self._muscle, self._share * each, self._count)
            for each in (np.maximum(epsilon, 0.0), _lost(epsilon), most)
        )
        aligned = np.divide(ours, largest, out=np.zeros(self._count), where=largest > 0.0)
        return smoothstep((mean - SLACK) / (FULL - SLACK)) * smoothstep((aligned - ASLANT) / (ACROSS - ASLANT))


def _lost(compression: Array) -> Array:
    """The share by which the square of a length shrinks; at an angle to the compression, cos^2 times as much."""
    shorter = np.maximum(compression, 0.0)
    return np.asarray(shorter * (2.0 - shorter))


def _entries(
    muscle: Muscle, near: npt.NDArray[np.int64], where: Array, normals: Array, metric: Array, area: Array
) -> tuple[npt.NDArray[np.int64], Array, Array, Array]:
    """Points in a muscle's region: their numbers, their shares in its mean, the products of the direction across the
    folds over its squared length in the rest metric, and that direction.
    """
    envelope = muscle.envelope(where[near])
    inside, envelope = near[envelope > 0.0], envelope[envelope > 0.0]
    share = envelope * area[inside]
    direction = tangents_of(muscle.fold_direction(where[inside]), normals[inside])
    return inside, share / max(share.sum(), 1e-300), per_length(metric[inside], direction), direction


def _doubled(entries: list[tuple[npt.NDArray[np.int64], Array, Array, Array]], depths: list[float]) -> BoolArray:
    """True (k,) for muscles whose folds are those of another with deeper wrinkles."""
    doubled = np.zeros(len(entries), bool)
    order = sorted(range(len(entries)), key=lambda k: -depths[k])
    for place, deep in enumerate(order):
        for shallow in () if doubled[deep] else order[place + 1 :]:
            (ours, share, _, across), (theirs, other, _, direction) = entries[deep], entries[shallow]
            _, p, q = np.intersect1d(ours, theirs, assume_unique=True, return_indices=True)
            alike = np.abs((across[p] * direction[q]).sum(axis=1)) > PARALLEL
            doubled[shallow] |= min(share[p[alike]].sum(), other[q[alike]].sum()) > SAME
    return doubled
