"""Decimation of triangle meshes to wanted lengths of edges; what remains is a subset of the vertices."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from heapq import heappop, heappush

import numpy as np
import numpy.typing as npt

from ..array_types import Array, IntArray
from .compilation import compiled
from .normals import area_vector, vertex_normals
from .topology import as_triangles, connected, unique_edges

FREE, ON_LINE, FIXED = 0, 1, 2
"""Kinds of vertices: free, on a line that it may only leave along the line, and never removed."""

FACING = 0.35
"""Smallest cosine between the normal of a new triangle and the normals of the given mesh at its corners."""

LEAST_OF_LINE = 8
"""Every line and every boundary loop keeps at least this many vertices, or all that it has."""


def decimated(
    points: Array,
    triangles: IntArray,
    size: Array,
    lines: npt.NDArray[np.integer] | None = None,
) -> tuple[npt.NDArray[np.int64], IntArray]:
    """Merge vertices into neighbors (half-edge collapses) until the edges of a mesh are about as long as wanted.

    The topology stays: components, boundary loops, and the Euler characteristic. Boundaries and other `lines` stay
    lines of vertices of their own. No triangle turns over, and none becomes much worse shaped than it was.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    size : ndarray, shape (n,)
        Wanted length of the edges at each vertex.
    lines : ndarray of int, shape (k, 2), optional
        Edges of the mesh that are lines to be kept, besides its boundaries. Vertices where more or fewer than two of
        these edges meet are not removed.

    Returns
    -------
    vertices : ndarray of int, shape (k,)
        The vertices that remain, ascending.
    triangles : ndarray of int32, shape (l, 3)
        The triangles between them, by their new numbers.

    Examples
    --------
    >>> import pyvista as pv
    >>> ball = pv.Icosphere(radius=50.0, nsub=4)
    >>> vertices, triangles = decimated(ball.points.astype(float), ball.regular_faces, np.full(ball.n_points, 12.0))
    >>> ball.n_points, 200 < len(vertices) < 400, len(triangles) == 2 * len(vertices) - 4
    (2562, True, True)
    """
    faces = as_triangles(triangles, len(points)).copy()
    positions = np.ascontiguousarray(points, dtype=np.float64)
    kind, neighbors, loop, left = _lines(faces, len(positions), lines)
    normals, wanted = vertex_normals(positions, faces), np.ascontiguousarray(size, dtype=np.float64)
    alive = _decimate(positions, normals, wanted, faces, kind, neighbors, loop, left)
    vertices, renumbered = np.unique(faces[alive], return_inverse=True)
    return vertices.astype(np.int64), renumbered.reshape(-1, 3).astype(np.int32)


def _lines(
    triangles: IntArray, n: int, lines: npt.NDArray[np.integer] | None
) -> tuple[npt.NDArray[np.int8], npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Kinds (n,) of vertices, neighbors (n, 2) of those on lines, their line (n,), and the vertices of each line."""
    edges, sides = unique_edges(triangles)
    shared = np.bincount(sides.ravel(), minlength=len(edges))
    chosen = edges[shared == 1]
    if lines is not None and len(lines):
        chosen = np.unique(np.sort(np.concatenate([chosen, lines]), axis=1), axis=0)
    degree = np.bincount(chosen.ravel(), minlength=n)
    kind = np.full(n, FIXED, np.int8)
    kind[degree == 0] = FREE
    kind[degree == 2] = ON_LINE
    kind[edges[shared > 2]] = FIXED
    both = np.concatenate([chosen, chosen[:, ::-1]])
    both = both[np.lexsort((both[:, 1], both[:, 0]))]
    neighbors = np.full((n, 2), -1, np.int64)
    pair = both[degree[both[:, 0]] == 2].reshape(-1, 2, 2)
    neighbors[pair[:, 0, 0]] = pair[:, :, 1]
    loop = connected(chosen, n).astype(np.int64)
    return kind, neighbors, loop, np.bincount(loop)


@compiled
def _neighbors(v, triangles, alive, head, following, out):
    """Write the neighbors of a vertex to `out`, and return the count; more than fit count as one too many."""
    count, corner = 0, head[v]
    while corner >= 0:
        t = corner // 3
        corner = following[corner]
        for k in range(3):
            w = triangles[t, k]
            if not alive[t] or w == v or w in out[:count]:
                continue
            if count == len(out):
                return count + 1
            out[count] = w
            count += 1
    return count


@compiled
def distance(points, a, b):
    """Distance between two of some points, given by their numbers."""
    x, y, z = points[a, 0] - points[b, 0], points[a, 1] - points[b, 1], points[a, 2] - points[b, 2]
    return np.sqrt(x * x + y * y + z * z)


@compiled
def _measured(points, a, b, c, normal):
    """Write the unit normal of a triangle to `normal`, and return its quality."""
    squares = 0.0
    for p, q in ((a, b), (b, c), (c, a)):
        for k in range(3):
            squares += (points[p, k] - points[q, k]) ** 2
    x, y, z = area_vector(points, a, b, c)
    double = np.sqrt(x * x + y * y + z * z)
    scale = 1.0 / double if double > 0.0 else 0.0
    normal[0], normal[1], normal[2] = x * scale, y * scale, z * scale
    return 2.0 * np.sqrt(3.0) * double / squares if squares > 0.0 else 0.0


@compiled
def _least_facing(normals, normal, a, b, c):
    least = 1.0
    for v in (a, b, c):
        least = min(least, normals[v, 0] * normal[0] + normals[v, 1] * normal[1] + normals[v, 2] * normal[2])
    return least


@compiled
def _shape_after(v, u, least, points, normals, size, triangles, alive, head, following, before, after):
    """Return the worst quality of the triangles around v once v is merged into u, 1 for equilateral ones, 0 without
    area; -1 if it is not above `least`, or a triangle would turn over, or become too long or too thin.
    """
    longest = 1.6  # relative to the edges that are wanted
    thinnest = 0.3  # of quality, unless the triangle was thinner
    bent = 0.5  # least cosine between the normals of a triangle before and after
    worst = 1.0
    corner = head[v]
    while corner >= 0:
        t = corner // 3
        corner = following[corner]
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if not alive[t] or a == u or b == u or c == u:
            continue
        i, j, k = (u if a == v else a), (u if b == v else b), (u if c == v else c)
        for w in (i, j, k):
            if w != u and distance(points, u, w) > longest * 0.5 * (size[u] + size[w]):
                return -1.0
        shape = _measured(points, i, j, k, after)
        worst = min(worst, shape)
        if worst <= least:
            return -1.0
        was = _measured(points, a, b, c, before)
        if shape < min(thinnest, was):
            return -1.0
        if before[0] * after[0] + before[1] * after[1] + before[2] * after[2] < bent and was > 0.0:
            return -1.0
        if _least_facing(normals, after, i, j, k) < min(FACING, _least_facing(normals, before, a, b, c)):
            return -1.0
    return worst


@compiled
def _sides(v, w, triangles, alive, head, following):
    """Number of triangles at the edge from v to w."""
    count, corner = 0, head[v]
    while corner >= 0:
        t = corner // 3
        corner = following[corner]
        count += alive[t] and (triangles[t, 0] == w or triangles[t, 1] == w or triangles[t, 2] == w)
    return count


@compiled
def _keeps_topology(v, u, count, ring, other, triangles, alive, head, following):
    """Link condition: v and u share no neighbors but those opposite to their edge, and what becomes one was not the
    border, or the whole of a piece.
    """
    apexes = _sides(v, u, triangles, alive, head, following)
    n_other = _neighbors(u, triangles, alive, head, following, other)
    if n_other > len(other) or n_other + count - apexes - 2 > len(other):
        return False
    shared = 0
    for w in ring[:count]:
        if w in other[:n_other]:
            shared += 1
            if (
                _sides(v, w, triangles, alive, head, following) == 1
                and _sides(u, w, triangles, alive, head, following) == 1
            ):
                return False
    # With three triangles around v, one may be there already: a tetrahedron would become a triangle with two sides.
    return shared == apexes and not (shared == 2 and count == 3)


@compiled
def _target(v, count, ring, other, points, normals, size, kind, lines, triangles, alive, head, following, spare):
    """Return the neighbor into which v is best merged, or -1; far ones only if none is near."""
    best, found = 0.0, -1
    near = np.inf  # up to three times as far as the nearest neighbor
    for i in range(count):
        near = min(near, 3.0 * distance(points, ring[i], v))
    for turn in range(2 * count):
        if turn == count and found >= 0:
            break
        u = ring[turn % count]
        if kind[v] == ON_LINE and u != lines[v, 0] and u != lines[v, 1]:
            continue
        if (distance(points, u, v) > near) == (turn < count):
            continue
        if kind[v] == ON_LINE:  # v is no further than a tenth of an edge from the straight line between its neighbors
            w, square, along, length = lines[v, 0] + lines[v, 1] - u, 0.0, 0.0, 0.0
            for k in range(3):
                a, b = points[v, k] - points[u, k], points[w, k] - points[u, k]
                square += a * a
                along += a * b
                length += b * b
            if square - (along * along / length if length > 0.0 else 0.0) > (0.1 * size[v]) ** 2:
                continue
        # Well-shaped triangles first, and short ways before long ones.
        away = 1.0 + distance(points, u, v) / size[v]
        shape = _shape_after(v, u, best * away, points, normals, size, triangles, alive, head, following, *spare) / away
        if shape > best and _keeps_topology(v, u, count, ring, other, triangles, alive, head, following):
            best, found = shape, u
    return found


@compiled
def _shortest(v, count, ring, points, size):
    """Length of the shortest edge of a vertex, relative to the edges that are wanted."""
    least = np.inf
    for i in range(min(count, len(ring))):
        least = min(least, 2.0 * distance(points, v, ring[i]) / (size[v] + size[ring[i]]))
    return least


@compiled
def _merge(v, u, triangles, alive, head, following):
    """Merge v into u."""
    corner = head[v]
    while corner >= 0:
        after, t = following[corner], corner // 3
        if alive[t]:
            if triangles[t, 0] == u or triangles[t, 1] == u or triangles[t, 2] == u:
                alive[t] = False
            else:
                triangles[t, corner % 3] = u
                following[corner] = head[u]
                head[u] = corner
        corner = after
    head[v] = -1


@compiled
def _enqueue(v, gap, heap, key, kind):
    """Put a vertex in the queue if it may be removed and is too close to a neighbor, but not twice by one key."""
    shortest = 0.67  # of the wanted length: the edges that stay are then about as long as wanted, on average
    if kind[v] != FIXED and gap < shortest and gap != key[v]:
        key[v] = gap
        heappush(heap, (gap, v))


@compiled
def _decimate(points, normals, size, triangles, kind, lines, loop, left):
    """Merge vertices into neighbors, the closest first, until none is too close to another.

    Changes `triangles`, whose removed ones are marked by False in the result, and `lines`, the two neighbors of
    vertices on lines. `left` counts the vertices of each line `loop`, of which at least `LEAST_OF_LINE` stay.
    """
    n, m = len(points), len(triangles)
    alive, head, following = np.ones(m, np.bool_), np.full(n, -1, np.int64), np.full(3 * m, -1, np.int64)
    for corner in range(3 * m - 1, -1, -1):
        v = triangles[corner // 3, corner % 3]
        following[corner] = head[v]
        head[v] = corner
    ring, other = np.empty((2, 64), np.int64)  # vertices with more neighbors are not removed, and no vertex gets more
    spare, key = (np.empty(3), np.empty(3)), np.full(n, np.inf)
    heap = [(0.0, 0)]
    heap.clear()
    for v in range(n):
        if head[v] >= 0:
            count = _neighbors(v, triangles, alive, head, following, ring)
            _enqueue(v, _shortest(v, count, ring, points, size), heap, key, kind)
    while len(heap):
        asked, v = heappop(heap)
        if head[v] < 0 or asked != key[v]:
            continue
        key[v] = np.inf
        count = _neighbors(v, triangles, alive, head, following, ring)
        if count > len(ring) or (kind[v] == ON_LINE and left[loop[v]] <= LEAST_OF_LINE):
            continue
        # A key is too small once the edge it stands for is gone.
        gap = _shortest(v, count, ring, points, size)
        if gap > (1.0 + 1e-9) * asked:
            _enqueue(v, gap, heap, key, kind)
            continue
        u = _target(v, count, ring, other, points, normals, size, kind, lines, triangles, alive, head, following, spare)
        if u < 0:
            continue
        if kind[v] == ON_LINE:  # its neighbors on the line become neighbors
            w = lines[v, 0] + lines[v, 1] - u
            for one, two in ((u, w), (w, u)):
                if lines[one, 0] == v:
                    lines[one, 0] = two
                elif lines[one, 1] == v:
                    lines[one, 1] = two
            left[loop[v]] -= 1
        _merge(v, u, triangles, alive, head, following)
        for i in range(count):  # those that could not be removed before may be now, with u or another neighbor
            w = ring[i]
            gap = key[w]
            if gap == np.inf:
                gap = _shortest(w, _neighbors(w, triangles, alive, head, following, other), other, points, size)
            elif w != u:
                gap = min(gap, 2.0 * distance(points, u, w) / (size[u] + size[w]))
            _enqueue(w, gap, heap, key, kind)
    return alive
