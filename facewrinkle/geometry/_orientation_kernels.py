"""Machine code for heights that turn no triangle over."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numpy as np

from ._mesh_kernels import area_vector
from .compilation import compiled


@compiled(inline="always")
def growth(nx, ny, nz, ax, ay, az, bx, by, bz, ux, uy, uz, vx, vy, vz):
    """Linear and quadratic part, along n, of the area vector of sides a and b that become a + t u and b + t v."""
    linear = nx * (ay * vz - az * vy + uy * bz - uz * by) + ny * (az * vx - ax * vz + uz * bx - ux * bz)
    linear += nz * (ax * vy - ay * vx + ux * by - uy * bx)
    return linear, nx * (uy * vz - uz * vy) + ny * (uz * vx - ux * vz) + nz * (ux * vy - uy * vx)


@compiled(inline="always")
def root(square, linear, spare):
    """Return the place between 0 and 1 at which a parabola that is `spare` at 0 becomes negative.

    It is 0 if the parabola begins so, and 1 if only rounding, far from the surface, makes it so.
    """
    factor = 0.0
    if spare > 0.0:  # from positive to negative it has one root
        divisor = np.sqrt(linear * linear - 4.0 * square * spare) - linear
        factor = min(2.0 * spare / divisor, 1.0) if divisor > 0.0 else 1.0
    return factor


@compiled
def limit(points, heights, directions, triangles, demanded, aim, factors):
    """Lower `factors` of the heights at the corners of triangles of which less than the share `demanded` would be left.

    The area vector of a triangle is a quadratic function of a factor of all its heights; `factors` get the one for
    which its component along the bare triangle's normal is the share `aim`, at least `demanded`, of the bare area.
    Returns the number of triangles that are lowered.
    """
    found = 0
    for f in range(len(triangles)):
        i, j, k = np.uint32(triangles[f, 0]), np.uint32(triangles[f, 1]), np.uint32(triangles[f, 2])
        hi, hj, hk = heights[i], heights[j], heights[k]
        if hi == 0.0 and hj == 0.0 and hk == 0.0:
            continue
        ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        bx, by, bz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        dx, dy, dz = hi * directions[i, 0], hi * directions[i, 1], hi * directions[i, 2]
        ux, uy, uz = hj * directions[j, 0] - dx, hj * directions[j, 1] - dy, hj * directions[j, 2] - dz
        vx, vy, vz = hk * directions[k, 0] - dx, hk * directions[k, 1] - dy, hk * directions[k, 2] - dz
        linear, square = growth(nx, ny, nz, ax, ay, az, bx, by, bz, ux, uy, uz, vx, vy, vz)
        area = nx * nx + ny * ny + nz * nz
        if (1.0 - demanded) * area + linear + square >= 0.0:
            continue
        factor = root(square, linear, (1.0 - aim) * area)
        found += factor < 1.0
        for v in (i, j, k):
            factors[v] = min(factors[v], factor)
    return found


@compiled
def limit_slides(points, lifted, slides, triangles, demanded, aim, factors):
    """Lower `factors` of the slides (n, 3) of a lifted surface, as :func:`limit` does those of heights over the bare
    one: each triangle keeps the share `demanded` of its bare area, seen along its bare normal.
    """
    found, moves = 0, np.zeros(len(slides), np.bool_)
    for n in range(len(slides)):
        moves[n] = slides[n, 0] != 0.0 or slides[n, 1] != 0.0 or slides[n, 2] != 0.0
    for f in range(len(triangles)):
        i, j, k = np.uint32(triangles[f, 0]), np.uint32(triangles[f, 1]), np.uint32(triangles[f, 2])
        if not (moves[i] or moves[j] or moves[k]):
            continue
        nx, ny, nz = area_vector(points, i, j, k)
        area = nx * nx + ny * ny + nz * nz
        ux, uy, uz = slides[j, 0] - slides[i, 0], slides[j, 1] - slides[i, 1], slides[j, 2] - slides[i, 2]
        vx, vy, vz = slides[k, 0] - slides[i, 0], slides[k, 1] - slides[i, 1], slides[k, 2] - slides[i, 2]
        ax, ay, az = lifted[j, 0] - lifted[i, 0], lifted[j, 1] - lifted[i, 1], lifted[j, 2] - lifted[i, 2]
        bx, by, bz = lifted[k, 0] - lifted[i, 0], lifted[k, 1] - lifted[i, 1], lifted[k, 2] - lifted[i, 2]
        before = nx * (ay * bz - az * by) + ny * (az * bx - ax * bz) + nz * (ax * by - ay * bx)
        linear, square = growth(nx, ny, nz, ax, ay, az, bx, by, bz, ux, uy, uz, vx, vy, vz)
        if before + linear + square >= demanded * area:
            continue
        factor = root(square, linear, before - aim * area)
        found += factor < 1.0
        for v in (i, j, k):
            factors[v] = min(factors[v], factor)
    return found
