"""Compression of the skin along its muscles (epsilon), from the deformation gradient.

It measures the deformed but unwrinkled surface; otherwise the wrinkles would feed back on themselves.
"""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from typing import Self

import numpy as np
import numpy.typing as npt

from ..anatomy import Face, Muscle, per_face
from ..array_types import Array, BoolArray
from ..geometry import compiled, double_areas, interpolated, smoothstep, tangent_axes, unit


class StrainField:
    """The strain of a moving mesh at its vertices: the more accurate alternative to Eq. 9.

    The change of the metric of the triangles around a vertex, averaged by area, gives the stretch ``|F m|`` along any
    tangent m, and so ``epsilon = 1 - |F m|``, whatever the shapes of the triangles.

    Parameters
    ----------
    points : array_like, shape (n, 3)
        At rest.
    triangles : array_like of int, shape (m, 3)

    Attributes
    ----------
    metric : ndarray, shape (n, 6)
        Rest metric (xx, yy, zz, yz, xz, xy).

    Examples
    --------
    >>> p = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> field = StrainField(p, [[0, 1, 2]])
    >>> stretch = field.strain(p * [0.8, 1.0, 1.0])
    >>> bool(np.isclose(1 - np.sqrt(1 + along(stretch, np.array([1.0, 0, 0]))[0]), 0.2))
    True
    """

    def __init__(self, points: npt.ArrayLike, triangles: npt.ArrayLike) -> None:
        p = np.ascontiguousarray(points, dtype=np.float64)
        self._triangles = t = np.ascontiguousarray(triangles, dtype=np.int32)
        a, b = p[t[:, 1]] - p[t[:, 0]], p[t[:, 2]] - p[t[:, 0]]
        aa, bb, ab = (a * a).sum(1), (b * b).sum(1), (a * b).sum(1)
        determinant = aa * bb - ab * ab
        self._products = np.stack([aa, bb, ab], axis=1)
        self._dual_a = (bb[:, None] * a - ab[:, None] * b) / determinant[:, None]
        self._dual_b = (aa[:, None] * b - ab[:, None] * a) / determinant[:, None]
        area = np.sqrt(determinant)
        total = np.bincount(t.ravel(), np.repeat(area, 3))
        self._share = np.ascontiguousarray(area[:, None] / total[t])
        self.metric = np.zeros((len(p), 6))
        change_of_metric(p, t, np.zeros_like(self._products), self._dual_a, self._dual_b, self._share, self.metric)

    @classmethod
    def of(cls, face: Face) -> Self:
        """Return the field of the base mesh of a face, in mm."""
        return per_face(face, "strain", None, lambda: cls(face.points_mm, face.triangles))

    def strain(self, deformed: Array) -> Array:
        """Return the change of the metric (n, 6) at the vertices of the deformed mesh (n, 3); exactly 0 at rest."""
        out = np.zeros_like(self.metric)
        change_of_metric(deformed, self._triangles, self._products, self._dual_a, self._dual_b, self._share, out)
        return out


def along(tensors: Array, directions: Array) -> Array:
    """Return ``m^T T m`` of symmetric tensors (n, 6) and directions (n, 3) or (3,).

    Examples
    --------
    >>> tensors = np.array([[0.8, 1.0, 0.0, 0.0, 0.0, 0.0]])
    >>> along(tensors, np.array([1.0, 0, 0])), along(tensors, np.array([0.6, 0.8, 0])).round(3)
    (array([0.8]), array([0.928]))
    """
    return mixed(tensors, directions, directions)


def dyads(directions: Array) -> Array:
    """Return the components (n, 6) of the symmetric tensors ``m m^T`` of directions m (n, 3).

    Examples
    --------
    >>> dyads(np.array([[0.6, 0.8, 0.0]])).round(9).tolist()
    [[0.36, 0.64, 0.0, 0.0, 0.0, 0.48]]
    """
    return products(directions, directions) * [1.0, 1.0, 1.0, 0.5, 0.5, 0.5]


def products(left: Array, right: Array) -> Array:
    """Return the factors (..., 6) of a symmetric tensor's components in ``l^T T r``, for directions (..., 3).

    Examples
    --------
    >>> products([0.6, 0.8, 0.0], [0.6, 0.8, 0.0]).round(9).tolist()
    [0.36, 0.64, 0.0, 0.0, 0.0, 0.96]
    """
    (x, y, z), (u, v, w) = (np.moveaxis(np.asarray(each, np.float64), -1, 0) for each in (left, right))
    return np.stack([x * u, y * v, z * w, y * w + z * v, x * w + z * u, x * v + y * u], axis=-1)


def tangents_of(directions: Array, normals: Array) -> Array:
    """Return unit tangents (n, 3) along the parts of directions (n, 3) or (3,) that lie in a surface with unit normals
    (n, 3); zero for directions that have no such part.

    Examples
    --------
    >>> tangents_of(np.array([[3.0, 4.0, 7.0]]), np.array([[0.0, 0.0, 1.0]])).round(9).tolist()
    [[0.6, 0.8, 0.0]]
    """
    flat = directions - (directions * normals).sum(axis=1, keepdims=True) * normals
    size, whole = (np.linalg.norm(each, axis=-1, keepdims=True) for each in (flat, directions))
    return np.divide(flat, size, out=np.zeros_like(flat), where=size > 1e-6 * whole)


def per_length(metric: Array, tangents: Array) -> Array:
    """Return the :func:`products` (n, 6) of tangents (n, 3) over their squared lengths in a rest metric (n, 6).

    Times a change of the metric, they give the relative change of the squared length along each tangent.

    Examples
    --------
    >>> per_length(np.array([[4.0, 1, 0, 0, 0, 0]]), np.array([[1.0, 0, 0]])).tolist()
    [[0.25, 0.0, 0.0, 0.0, 0.0, 0.0]]
    """
    return np.asarray(products(tangents, tangents) / np.maximum(along(metric, tangents), 1e-6)[:, None])


def shortening(change: Array) -> Array:
    """Return by which share a length is shortened whose square changes by a share: ``1 - |F m|``, below 0 if stretched.

    Examples
    --------
    >>> shortening(np.array([-0.75, 0.0, 0.44])).round(9).tolist()
    [0.5, 0.0, -0.2]
    """
    return np.asarray(1.0 - np.sqrt(np.maximum(1.0 + change, 0.0)))


def compression_along(strain: Array, metric: Array, normals: Array, directions: Array) -> Array:
    """Return the compression ``1 - |F m|`` along directions at some points.

    Parameters
    ----------
    strain, metric : ndarray, shape (n, 6)
        Change of the metric and rest metric, as a :class:`StrainField` gives them.
    normals : ndarray, shape (n, 3)
        Unit normals at rest.
    directions : ndarray, shape (n, 3) or (3,)
        Of any length; their parts along the normals do not count.

    Returns
    -------
    ndarray, shape (n,)
        Negative where the surface is stretched; 0 where a direction has no part in the surface.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> field = StrainField(square, [[0, 1, 2]])
    >>> up = np.tile([0.0, 0, 1], (3, 1))
    >>> strain = field.strain(square * [0.8, 1, 1])
    >>> compression_along(strain, field.metric, up, np.array([2.0, 0, 5])).round(12).tolist()
    [0.2, 0.2, 0.2]
    """
    return shortening((strain * per_length(metric, tangents_of(directions, normals))).sum(axis=1))


def principal_compression(strain: Array, metric: Array, normals: Array) -> tuple[Array, Array]:
    """Return the largest compression over all tangents, and the tangent that has it.

    The stretch ``|F m|`` is smallest where ``m^T S m / m^T G m`` is, with S the change of the metric and G the rest
    metric: the smaller eigenvalue of a pencil of 2 x 2 matrices in each tangent plane.

    Parameters
    ----------
    strain, metric : ndarray, shape (n, 6)
        As a :class:`StrainField` gives them.
    normals : ndarray, shape (n, 3)
        Unit normals at rest.

    Returns
    -------
    compression : ndarray, shape (n,)
        Negative where all tangents are stretched.
    tangents : ndarray, shape (n, 3)
        Unit vectors; arbitrary where all directions are compressed alike.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> field = StrainField(square, [[0, 1, 2]])
    >>> up = np.tile([0.0, 0, 1], (3, 1))
    >>> most, where = principal_compression(field.strain(square * [1.1, 0.7, 1]), field.metric, up)
    >>> most.round(12).tolist(), np.abs(where[0]).round(12).tolist()
    ([0.3, 0.3, 0.3], [0.0, 1.0, 0.0])
    """
    values, tangents, _ = principal(strain, *orthonormal_tangents(metric, normals))
    return shortening(values[:, 0]), unit(tangents)


def principal(tensors: Array, first: Array, second: Array) -> tuple[Array, Array, Array]:
    """Return the least and the largest value (n, 2) of ``m^T T m`` over all m that two tangents (n, 3) span as an
    orthonormal basis, and the m (n, 3) of either.

    Examples
    --------
    >>> tensor, first, second = np.array([[0.8, 0.9, 0, 0, 0, 0]]), np.array([[1.0, 0, 0]]), np.array([[0, 1.0, 0]])
    >>> values, least, most = principal(tensor, first, second)
    >>> values.round(9).tolist(), np.abs(least).round(9).tolist(), np.abs(most).round(9).tolist()
    ([[0.8, 0.9]], [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    """
    a, b, c = along(tensors, first), along(tensors, second), mixed(tensors, first, second)
    mean, spread, angle = 0.5 * (a + b), np.hypot(0.5 * (a - b), c), 0.5 * np.arctan2(2.0 * c, a - b)[:, None]
    most, least = (np.cos(turn) * first + np.sin(turn) * second for turn in (angle, angle + 0.5 * np.pi))
    return np.stack([mean - spread, mean + spread], axis=1), least, most


def orthonormal_tangents(metric: Array, normals: Array) -> tuple[Array, Array]:
    """Return two tangents (n, 3) at each point that are orthonormal in the rest metric, by Gram-Schmidt.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0]])
    >>> metric = StrainField(points, [[0, 1, 2]]).metric
    >>> first, second = orthonormal_tangents(metric, np.tile([0.0, 0, 1], (3, 1)))
    >>> np.einsum("nk,nk->n", first, second).round(12).tolist()
    [0.0, 0.0, 0.0]
    """
    first, second = tangent_axes(normals)
    first = first / np.sqrt(along(metric, first))[:, None]
    second = second - mixed(metric, first, second)[:, None] * first
    second /= np.sqrt(along(metric, second))[:, None]
    return first, second


def mixed(tensors: Array, left: Array, right: Array) -> Array:
    """Return ``l^T T r`` of symmetric tensors (n, 6) and directions (n, 3).

    Examples
    --------
    In a sheet that is sheared by 0.3, a right angle closes by about as much:

    >>> sheared = np.array([[0.0, 0.09, 0.0, 0.0, 0.0, 0.3]])
    >>> mixed(sheared, np.array([[1.0, 0, 0]]), np.array([[0.0, 1, 0]]))
    array([0.3])
    """
    return np.asarray((tensors * products(left, right)).sum(axis=-1))


@compiled
def change_of_metric(points, triangles, products, dual_a, dual_b, share, out):
    """Add the change of the metric (n, 6) of each triangle to its vertices, by their shares in the area.

    The two sides a and b of a triangle had the `products` a.a, b.b and a.b at rest, and the dual vectors given.
    """
    for f in range(triangles.shape[0]):
        i, j, k = np.uint32(triangles[f, 0]), np.uint32(triangles[f, 1]), np.uint32(triangles[f, 2])
        ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        bx, by, bz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
        aa = ax * ax + ay * ay + az * az - products[f, 0]
        bb = bx * bx + by * by + bz * bz - products[f, 1]
        ab = ax * bx + ay * by + az * bz - products[f, 2]
        u, v = dual_a[f], dual_b[f]
        xx = aa * u[0] * u[0] + bb * v[0] * v[0] + 2.0 * ab * u[0] * v[0]
        yy = aa * u[1] * u[1] + bb * v[1] * v[1] + 2.0 * ab * u[1] * v[1]
        zz = aa * u[2] * u[2] + bb * v[2] * v[2] + 2.0 * ab * u[2] * v[2]
        yz = aa * u[1] * u[2] + bb * v[1] * v[2] + ab * (u[1] * v[2] + u[2] * v[1])
        xz = aa * u[0] * u[2] + bb * v[0] * v[2] + ab * (u[0] * v[2] + u[2] * v[0])
        xy = aa * u[0] * u[1] + bb * v[0] * v[1] + ab * (u[0] * v[1] + u[1] * v[0])
        for c in range(3):
            s, n = share[f, c], np.uint32(triangles[f, c])
            out[n, 0] += s * xx
            out[n, 1] += s * yy
            out[n, 2] += s * zz
            out[n, 3] += s * yz
            out[n, 4] += s * xz
            out[n, 5] += s * xy


# --- activation of muscles by measured compression, where a recording moves the skin -------------------------------


SLACK, FULL = 0.015, 0.05
"""Mean compression of a muscle's region below which its wrinkles are absent, and from which they are as deep as the
local compression makes them.
"""


class Activation:
    """Compression of the skin over each muscle, along it, as a number in [0, 1] like a contraction rate.

    It is the mean of the compression (0 where the skin is stretched) over the muscle's wrinkling region, by a smooth
    step from 0 at `SLACK` to 1 at `FULL`. Where the skin is compressed far more in another direction, it folds in that
    one instead: a second smooth step falls from 1 to 0. The compression is measured at fixed points of the base mesh,
    so that refinement does not change it. Where several muscles fold the same skin in the same direction, only the one
    with the deepest wrinkles acts.

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
        quarters = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 2]]) / 6.0  # centroids of parts of a triangle
        self._weights = np.tile(quarters, (len(hosts), 1))
        upright, rest = face.normals[self._used], field.metric[self._used]
        self._basis = orthonormal_tangents(rest, upright)
        where, normals, metric = (
            interpolated(values, self._corners, self._weights) for values in (face.points[self._used], upright, rest)
        )
        normals = unit(normals)
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
        shorter = np.maximum(epsilon, 0.0)
        # Of the squares of lengths: at an angle to the compression, cos^2 times as much.
        lost = shorter * (2.0 - shorter)
        mean, ours, largest = (
            np.bincount(self._muscle, self._share * each, self._count) for each in (shorter, lost, most)
        )
        aligned = np.divide(ours, largest, out=np.zeros(self._count), where=largest > 0.0)
        aslant, across = 0.45, 0.6  # of the largest compression: up to where skin does not fold along, and from where
        return smoothstep((mean - SLACK) / (FULL - SLACK)) * smoothstep((aligned - aslant) / (across - aslant))


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
            # The same wrinkles have the same direction (a cosine) in nearly all of both regions (a share).
            alike = np.abs((across[p] * direction[q]).sum(axis=1)) > 0.98
            doubled[shallow] |= min(share[p[alike]].sum(), other[q[alike]].sum()) > 0.9
    return doubled
