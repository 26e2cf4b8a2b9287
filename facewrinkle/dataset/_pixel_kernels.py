"""Inner loops of the labels: where lines of sight meet triangles, and what is near."""

from __future__ import annotations

from ..geometry.compilation import compiled


@compiled(inline="always")
def volume(a, b, c):
    """Six times the volume that three vectors span."""
    x = a[0] * (b[1] * c[2] - b[2] * c[1])
    return x + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])


@compiled
def meet(points, corners, rays, weights, depth):
    """Barycentric weights (p, 3) and depths (p,) at which rays (p, 3) from the origin meet triangles (p, 3) of points.

    A ray meets the plane of a triangle where its volumes with two corners each tell the weights. A pixel at an edge may
    be given to the triangle beside the one that its ray meets: the place is moved to the edge.
    """
    for i in range(len(corners)):
        a, b, c = points[corners[i, 0]], points[corners[i, 1]], points[corners[i, 2]]
        ray = rays[i]
        u, v, w = volume(ray, b, c), volume(ray, c, a), volume(ray, a, b)
        total = u + v + w
        if abs(total) < 1e-300:
            u, v, w = 1.0, 1.0, 1.0
        elif total < 0.0:
            u, v, w = -u, -v, -w
        u, v, w = max(u, 0.0), max(v, 0.0), max(w, 0.0)
        total = u + v + w
        weights[i, 0], weights[i, 1], weights[i, 2] = u / total, v / total, w / total
        depth[i] = (u * a[2] + v * b[2] + w * c[2]) / total


@compiled
def nearest(places, points, numbers, far, out):
    """Write the number of the point (k, 3) that is nearest to each place (p, 3), if it is within a distance."""
    for i in range(len(places)):
        best = far * far
        for k in range(len(points)):
            square = 0.0
            for c in range(3):
                square += (places[i, c] - points[k, c]) ** 2
            if square < best:
                best = square
                out[i] = numbers[k]
