"""How much the skin is compressed along the muscles (epsilon): Eqs. 8-9, and from the deformation gradient.

Both measure the deformed but unwrinkled surface, or the wrinkles would feed back on themselves.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

Array = npt.NDArray[np.float64]


def edge_compression(
    rest: npt.ArrayLike,
    deformed: npt.ArrayLike,
    rings: tuple[npt.NDArray[np.int32], npt.NDArray[np.int32]],
    directions: npt.ArrayLike,
) -> Array:
    """Compression along a direction from the shortening of the edges around each vertex (Eqs. 8-9).

    ``tau_ij = (L_ij - |x_i - x_j|) / L_ij``, ``epsilon_i = sum tau_ij |cos theta_ij| / sum |cos theta_ij|``. The absolute value
    is not printed in the paper but needed: with the signed cosine the denominator vanishes on every symmetric ring.

    Parameters
    ----------
    rest, deformed : array_like, shape (n, 3)
    rings : tuple of ndarray
        Neighbours of each vertex, as (indptr, indices); see :func:`facewrinkle.geometry.topology.vertex_rings`.
    directions : array_like, shape (n, 3)
        Unit directions at rest.

    Returns
    -------
    ndarray, shape (n,)
        1 where the skin vanished, negative where it is stretched. Exactly c under a uniform scaling by 1 - c; about 2c/3 under
        a uniaxial compression by c in an isotropic ring.

    Examples
    --------
    >>> from facewrinkle.geometry.topology import vertex_rings
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> rings = vertex_rings([[0, 1, 2]], 3)
    >>> edge_compression(square, 0.9 * square, rings, np.tile([1.0, 0, 0], (3, 1))).round(12).tolist()
    [0.1, 0.1, 0.1]
    """
    x0, x1 = np.ascontiguousarray(rest, dtype=np.float64), np.ascontiguousarray(deformed, dtype=np.float64)
    n = len(x0)
    entries = np.arange(n + 1, dtype=np.int32)
    out = np.empty(n)
    edge_epsilon(x0, x1, rings[0], rings[1], entries, np.ascontiguousarray(directions, dtype=np.float64), out)
    return out


@njit(cache=True)
def edge_epsilon(rest, deformed, indptr, ring, entries, directions, out):  # type: ignore[no-untyped-def]
    """Eq. 9 for the entries of each vertex: entry p of vertex i (entries[i] <= p < entries[i + 1]) has its own direction."""
    for i in range(rest.shape[0]):
        first, last = entries[i], entries[i + 1]
        if first == last:
            continue
        for p in range(first, last):
            weighted, total = 0.0, 0.0
            for q in range(indptr[i], indptr[i + 1]):
                j = ring[q]
                dx, dy, dz = rest[j, 0] - rest[i, 0], rest[j, 1] - rest[i, 1], rest[j, 2] - rest[i, 2]
                ex, ey, ez = (
                    deformed[j, 0] - deformed[i, 0],
                    deformed[j, 1] - deformed[i, 1],
                    deformed[j, 2] - deformed[i, 2],
                )
                length = np.sqrt(dx * dx + dy * dy + dz * dz)
                cosine = abs(dx * directions[p, 0] + dy * directions[p, 1] + dz * directions[p, 2]) / length
                total += cosine
                weighted += cosine * (1.0 - np.sqrt(ex * ex + ey * ey + ez * ez) / length)
            out[p] = weighted / total if total > 0.0 else 0.0


class StrainField:
    """The strain of a moving mesh at its vertices: the quality alternative to Eq. 9.

    The change of the metric of the triangles around a vertex, averaged by area, gives the stretch |F m| along any tangent m,
    and with it ``epsilon = 1 - |F m|``, whatever the triangles look like.

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
        total = np.bincount(t.ravel(), np.repeat(area, 3), minlength=len(p))
        self._share = np.ascontiguousarray(area[:, None] / total[t])
        self.metric = np.zeros((len(p), 6))
        _change_of_metric(p, t, np.zeros_like(self._products), self._dual_a, self._dual_b, self._share, self.metric)

    def strain(self, deformed: Array) -> Array:
        """Change of the metric (n, 6) at the vertices of the deformed mesh (n, 3); exactly 0 at rest."""
        out = np.zeros_like(self.metric)
        _change_of_metric(deformed, self._triangles, self._products, self._dual_a, self._dual_b, self._share, out)
        return out


def along(tensors: Array, directions: Array) -> Array:
    """``m^T T m`` of symmetric tensors (n, 6) and directions (n, 3) or (3,)."""
    x, y, z = np.moveaxis(np.asarray(directions, dtype=np.float64), -1, 0)
    products = np.stack(np.broadcast_arrays(x * x, y * y, z * z, 2 * y * z, 2 * x * z, 2 * x * y), axis=-1)
    return np.asarray((tensors * products).sum(axis=-1))


@njit(cache=True)
def _change_of_metric(points, triangles, products, dual_a, dual_b, share, out):  # type: ignore[no-untyped-def]
    for f in range(triangles.shape[0]):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
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
            s, n = share[f, c], triangles[f, c]
            out[n, 0] += s * xx
            out[n, 1] += s * yy
            out[n, 2] += s * zz
            out[n, 3] += s * yz
            out[n, 4] += s * xz
            out[n, 5] += s * xy


@njit(cache=True)
def strain_epsilon(strain, corners, barycentric, entries, directions, rest, out):  # type: ignore[no-untyped-def]
    """``1 - |F m|`` for the entries of each refined vertex, from the strain (n0, 6) at the vertices of the base mesh.

    `rest` (p,) is m^T (rest metric) m: 1 for a tangent of a flat surface.
    """
    t = np.empty(6)
    for i in range(corners.shape[0]):
        first, last = entries[i], entries[i + 1]
        if first == last:
            continue
        a, b, c = corners[i, 0], corners[i, 1], corners[i, 2]
        wa, wb, wc = barycentric[i, 0], barycentric[i, 1], barycentric[i, 2]
        for k in range(6):
            t[k] = wa * strain[a, k] + wb * strain[b, k] + wc * strain[c, k]
        for p in range(first, last):
            x, y, z = directions[p, 0], directions[p, 1], directions[p, 2]
            change = x * x * t[0] + y * y * t[1] + z * z * t[2] + 2.0 * (y * z * t[3] + x * z * t[4] + x * y * t[5])
            out[p] = 1.0 - np.sqrt(max(1.0 + change / rest[p], 0.0))
