"""Machine code that finds triangles that are turned over against the skin around them, and turns them back."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numpy as np

from ._mesh_kernels import area_vector
from .compilation import compiled

LEANING = 0.5
"""Square of the cosine of the angle by which a triangle, or the surface around it, turns before it is looked at."""


@compiled
def _cross(points, triangle, out):
    """Write the area vector (3,) of a triangle, twice its area long."""
    out[0], out[1], out[2] = area_vector(points, triangle[0], triangle[1], triangle[2])


@compiled
def crosses(points, triangles, out):
    """Write the area vectors (m, 3) of triangles, twice their areas long."""
    for t in range(triangles.shape[0]):
        _cross(points, triangles[t], out[t])


@compiled
def _near(a, b):
    """Return True if two directions are less apart than the angle of `LEANING`."""
    dot, one, two = 0.0, 0.0, 0.0
    for k in range(3):
        dot += a[k] * b[k]
        one += a[k] * a[k]
        two += b[k] * b[k]
    return dot > 0.0 and dot * dot > LEANING * one * two


@compiled
def turned(points, triangles, rest, least, marked):
    """Mark (n,) the corners of triangles that have turned far from their area vectors (m, 3) at rest, or shrunk to
    about a share of their area; return their number.
    """
    count, now = 0, np.empty(3)
    for t in range(triangles.shape[0]):
        _cross(points, triangles[t], now)
        dot, one, two = 0.0, 0.0, 0.0
        for k in range(3):
            dot += now[k] * rest[t, k]
            one += now[k] * now[k]
            two += rest[t, k] * rest[t, k]
        # Leaning by less, and larger than this, a triangle has more than the share left, seen along where it faced.
        if (dot <= 0.0 or dot * dot <= LEANING * one * two or LEANING * one < least * least * two) and two > 0.0:
            marked[triangles[t, 0]] = marked[triangles[t, 1]] = marked[triangles[t, 2]] = True
            count += 1
    return count


@compiled
def touching(triangles, marked):
    """Return the numbers of triangles with a marked corner."""
    count = 0
    for t in range(triangles.shape[0]):
        if marked[triangles[t, 0]] or marked[triangles[t, 1]] or marked[triangles[t, 2]]:
            count += 1
    out, count = np.empty(count, np.int64), 0
    for t in range(triangles.shape[0]):
        if marked[triangles[t, 0]] or marked[triangles[t, 1]] or marked[triangles[t, 2]]:
            out[count] = t
            count += 1
    return out


@compiled
def doubtful(points, triangles, rest, least, marked, chosen):
    """Return those of the chosen triangles, all that have a marked corner, that face elsewhere than the surface around
    their marked corners, now or at rest, or that have shrunk to about a share of their area.

    Each triangle around weighs as its area at rest: those that were drawn across others are large now.
    """
    around, around_rest = np.zeros((len(marked), 3)), np.zeros((len(marked), 3))
    now, mean, mean_rest = np.empty(3), np.empty(3), np.empty(3)
    for t in chosen:
        _cross(points, triangles[t], now)
        square = (now * now).sum()
        if square > 0.0:
            now *= np.sqrt((rest[t] * rest[t]).sum() / square)
        for c in range(3):
            for k in range(3):
                around[triangles[t, c], k] += now[k]
                around_rest[triangles[t, c], k] += rest[t, k]
    out, count = np.empty(len(chosen), np.int64), 0
    for t in chosen:
        mean[:], mean_rest[:] = 0.0, 0.0
        for c in range(3):
            if marked[triangles[t, c]]:
                mean += around[triangles[t, c]]
                mean_rest += around_rest[triangles[t, c]]
        _cross(points, triangles[t], now)
        small = LEANING * (now * now).sum() < least * least * (rest[t] * rest[t]).sum()
        if (small or not (_near(mean, now) and _near(mean_rest, rest[t]))) and rest[t].any():
            out[count] = t
            count += 1
    return out[:count]


@compiled
def correlations(points, at_rest, triangles, chosen, offsets, ring, out):
    """Write the products (k, 3, 3) of offsets at rest and now, summed up over two rings around chosen triangles.

    Each offset, from a corner to a vertex, counts once, and weighs as the inverse square of its length at rest.
    """
    out[:] = 0.0
    counted = np.full(len(points), -1)  # by which corner each vertex was counted last
    for i in range(len(chosen)):
        for c in range(3):
            v, corner = triangles[chosen[i], c], 3 * i + c
            counted[v] = corner
            for e in range(offsets[v], offsets[v + 1]):
                _add_offset(points, at_rest, v, ring[e], corner, counted, out[i])
                for f in range(offsets[ring[e]], offsets[ring[e] + 1]):
                    _add_offset(points, at_rest, v, ring[f], corner, counted, out[i])


@compiled
def _add_offset(points, at_rest, v, w, corner, counted, out):
    """Add the product of the offsets from v to w at rest and now, over its square at rest, unless it was counted."""
    if counted[w] == corner:
        return
    counted[w] = corner
    square = 0.0
    for k in range(3):
        square += (at_rest[w, k] - at_rest[v, k]) ** 2
    if square > 0.0:
        for k in range(3):
            for j in range(3):
                out[k, j] += (at_rest[w, k] - at_rest[v, k]) * (points[w, j] - points[v, j]) / square


@compiled
def shares(points, triangles, chosen, facing, double_area, out):
    """Write the areas (k,) of chosen triangles along directions (k, 3), relative to rest."""
    now = np.empty(3)
    for i in range(len(chosen)):
        _cross(points, triangles[chosen[i]], now)
        out[i] = (now[0] * facing[i, 0] + now[1] * facing[i, 1] + now[2] * facing[i, 2]) / double_area[i]


@compiled
def turn_back(points, triangles, chosen, facing, double_area, free, least, sweeps):
    """Move free vertices (n,) until no chosen triangle has less than a share of its area along its direction (k, 3).

    Each triangle in turn gets what it lacks by the shortest move of its corners. Returns the number of sweeps.
    """
    now, slopes = np.empty(3), np.empty((3, 3))
    for sweep in range(sweeps):
        moved = False
        for i in range(len(chosen)):
            triangle, n = triangles[chosen[i]], facing[i]
            _cross(points, triangle, now)
            lacking = least * double_area[i] - (now[0] * n[0] + now[1] * n[1] + now[2] * n[2])
            if lacking <= 0.0:
                continue
            square = 0.0
            for c in range(3):
                a, b = triangle[(c + 1) % 3], triangle[(c + 2) % 3]
                for k in range(3):
                    p, q = (k + 1) % 3, (k + 2) % 3
                    slopes[c, k] = n[p] * (points[b, q] - points[a, q]) - n[q] * (points[b, p] - points[a, p])
                    if free[triangle[c]]:
                        square += slopes[c, k] ** 2
            if square == 0.0:
                continue
            moved = True
            for c in range(3):
                if free[triangle[c]]:
                    for k in range(3):
                        points[triangle[c], k] += lacking / square * slopes[c, k]
        if not moved:
            return sweep
    return sweeps
