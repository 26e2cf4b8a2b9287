"""Activation of muscles by measured compression: in place of contraction rates where a recording moves the skin."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from ..anatomy.face import Face
from ..anatomy.muscles import Muscle
from ..array_types import Array, BoolArray
from ..geometry.interpolation import interpolated
from ..geometry.normals import vertex_normals
from ..geometry.smoothstep import smoothstep
from . import _kernels as kernels
from .compression import StrainField, orthonormal_tangents, per_length, principal, tangents_of

Entries = tuple[npt.NDArray[np.int64], Array, Array, Array]

SLACK, TAUT = 0.015, 0.05
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
    step from 0 at `SLACK` to 1 at `TAUT`. Where the skin is compressed far more in another direction, it folds in that
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
    >>> activation = Activation(face, folds, face.zones, StrainField(face.points, face.triangles))
    >>> rates = dict(zip(face.muscles, activation.of(face.points * [1.0, 0.9, 1.0]).round(2), strict=True))
    >>> float(rates["frontalis_inner_l"]), float(rates["corrugator_l"])
    (1.0, 0.0)
    """

    def __init__(self, face: Face, muscles: list[Muscle], zones: BoolArray, field: StrainField) -> None:
        self._field = field
        hosts = np.flatnonzero(zones.any(axis=0))
        corners = np.repeat(face.triangles[hosts], 4, axis=0)
        weights = np.tile(QUARTERS, (len(hosts), 1))
        upright = vertex_normals(face.points, face.triangles)
        where, normals, metric = (
            interpolated(values, corners, weights) for values in (face.points, upright, field.metric)
        )
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        a, b, c = (face.points[face.triangles[hosts, k]] for k in range(3))
        area = np.repeat(np.linalg.norm(np.cross(b - a, c - a), axis=1), 4)
        entries = [
            _entries(muscle, np.flatnonzero(np.repeat(zone[hosts], 4)), where, normals, metric, area)
            for muscle, zone in zip(muscles, zones, strict=True)
        ]
        doubled = _doubled(entries, [muscle.wrinkles.depth for muscle in muscles])
        self._count = len(muscles)
        acting = [(k, *entries[k][:3]) for k in np.flatnonzero(~doubled)]
        owner = np.concatenate([e[1] for e in acting] or [np.empty(0, int)])
        order = np.argsort(owner, kind="stable")
        self._muscle = np.concatenate([np.full(len(e[1]), e[0]) for e in acting] or [np.empty(0, int)])[order]
        self._share = np.concatenate([e[2] for e in acting] or [np.empty(0)])[order]
        self._products = np.concatenate([e[3] for e in acting] or [np.empty((0, 6))])[order]
        self._starts = np.searchsorted(owner[order], np.arange(len(where) + 1)).astype(np.int32)
        self._corners, self._weights = corners, weights
        places = np.repeat(np.arange(len(where)), np.diff(self._starts))
        at, here = corners[places], self._share[:, None] * weights[places]
        self._vertices, column = np.unique(at, return_inverse=True)
        self._basis = orthonormal_tangents(field.metric[self._vertices], upright[self._vertices])
        self._regions = csr_array(
            (here.ravel(), (np.repeat(self._muscle, 3), column.ravel())), shape=(self._count, len(self._vertices))
        )

    def of(self, deformed: Array) -> Array:
        """Return the activation (k,) of the muscles in the deformed base mesh (n0, 3), mm."""
        return self.at(self._field.strain(deformed))

    def at(self, strain: Array) -> Array:
        """Return the activation (k,) of the muscles at a strain (n0, 6) of the base mesh."""
        epsilon = np.empty(len(self._share))
        kernels.strain_epsilon(self._starts, self._corners, self._weights, strain, self._products, epsilon)
        shorter = np.maximum(epsilon, 0.0)
        mean = np.bincount(self._muscle, self._share * shorter, self._count)
        ours = np.bincount(self._muscle, self._share * _lost(epsilon), self._count)
        values, *_ = principal(strain[self._vertices], *self._basis)
        largest = self._regions @ np.clip(-values[:, 0], 0.0, 1.0)
        aligned = np.divide(ours, largest, out=np.zeros(self._count), where=largest > 0.0)
        return smoothstep((mean - SLACK) / (TAUT - SLACK)) * smoothstep((aligned - ASLANT) / (ACROSS - ASLANT))


def _lost(compression: Array) -> Array:
    """The share by which the square of a length shrinks; at an angle to the compression, cos^2 times as much."""
    shorter = np.maximum(compression, 0.0)
    return np.asarray(shorter * (2.0 - shorter))


def _entries(
    muscle: Muscle, near: npt.NDArray[np.int64], where: Array, normals: Array, metric: Array, area: Array
) -> Entries:
    """Points in a muscle's region: their numbers, their shares in its mean, the products of the direction across the
    folds over its squared length in the rest metric, and that direction.
    """
    envelope = muscle.envelope(where[near])
    inside, envelope = near[envelope > 0.0], envelope[envelope > 0.0]
    share = envelope * area[inside]
    direction = tangents_of(muscle.fold_direction(where[inside]), normals[inside])
    return inside, share / max(share.sum(), 1e-300), per_length(metric[inside], direction), direction


def _doubled(entries: list[Entries], depths: list[float]) -> BoolArray:
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
