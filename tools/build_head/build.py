"""From the typed cage to the arrays of the built-in head."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from io import BytesIO
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from facewrinkle.anatomy.head import MIRROR, Head, Mold, cage_data, unpacked
from facewrinkle.geometry.topology import boundary_loops
from tools.self_intersections import self_intersections

from .chart import Chart, mean_value_chart
from .chart_mesh import FIXED, FREE, ON_LINE, ChartMesh
from .half_cage import (
    FROZEN_STRIPS,
    LEVELS,
    LID_STRIPS,
    LIP_STRIPS,
    HalfCage,
    between,
    half_surface,
    lining_places,
    opposite_on_lips,
    ring_share,
)
from .paint import HeadPainter, brow_hairs

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

TRIANGLES = 4517
"""Triangles of the head."""

RADIUS = 100.0
"""Radius of the chart, mm: about that of a head."""


# --- the chart ------------------------------------------------------------------------------------------
def _eye_and_rim(triangles: IntArray) -> list[list[int]]:
    """The two boundary loops of the half, the shorter one first."""
    return sorted((loop.tolist() for loop in boundary_loops(triangles)), key=len)


def charted(half: HalfCage, chart: dict[str, Any], size: Array) -> Array:
    """Return a one-to-one chart (n, 2) in the half disc: the middle is the line x = 0, the neck's rim the half circle.

    The neck's rim is short and far from the face, which would become tiny. So places with a small target length `size`
    (n,) of edges get more room, and then the disc is spread about a place in the face.
    """
    triangles = half.fine_triangles()
    n = len(half.points)
    middle_vertices = np.flatnonzero(half.points[:, 0] == 0.0)
    eye, outer = _eye_and_rim(triangles)
    bottom, top = (half.of(name) for name in chart["rim"])
    outer = outer[outer.index(top) :] + outer[: outer.index(top)]
    if outer[1] in set(middle_vertices.tolist()):
        outer = [outer[0], *outer[:0:-1]]
    rim = outer[: outer.index(bottom) + 1]
    lower, upper = half.of("mouth_ring3.8"), half.of("mouth_ring3.0")
    mouth = outer[outer.index(lower) : outer.index(upper) + 1]
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(half.points[rim], axis=0), axis=1)))
    turn = np.pi * along / along[-1]
    points = np.vstack([half.points, half.points[eye].mean(axis=0), half.points[mouth].mean(axis=0) * [0, 1, 1]])
    fill = [[n, b, a] for a, b in zip(eye, eye[1:] + eye[:1], strict=True)]
    fill += [[n + 1, b, a] for a, b in pairwise(mouth)]
    middle = np.setdiff1d(np.append(middle_vertices, n + 1), rim)
    fixed = [np.concatenate([rim, middle]), np.array(rim)]
    values = [np.concatenate([np.sin(turn), np.zeros(len(middle))]), np.cos(turn)]
    values[0][[0, len(rim) - 1]] = 0.0
    pull = np.sqrt(np.concatenate([size, [size[eye].mean(), size[mouth].mean()]]))
    plane = mean_value_chart(points, np.vstack([triangles, fill]), fixed, values, pull)[:n]
    centre = plane[middle_vertices[np.linalg.norm(half.points[middle_vertices] - chart["centre"], axis=1).argmin()]]
    return _spread(plane, centre, chart["spread"])


def _spread(plane: Array, centre: Array, least: float) -> Array:
    """Spread points (n, 2) of the unit disc about a centre, (1 + least) / least times wider there; radius RADIUS."""
    off = plane - centre
    distance = np.linalg.norm(off, axis=1)
    way = off / np.maximum(distance, 1e-12)[:, None]
    to_rim = np.sqrt((way @ centre) ** 2 + 1.0 - centre @ centre) - way @ centre
    return RADIUS * (centre + off * ((1.0 + least) / (distance / to_rim + least))[:, None])


# --- the mesh -------------------------------------------------------------------------------------------
def target_size(half: HalfCage, data: dict[str, Any]) -> Array:
    """Return the target length (n,) of edges at the fine points, mm: small around eye and mouth and in typed boxes."""
    sizes, points = data["sizes"], half.points
    loop, outer = _eye_and_rim(half.fine_triangles())
    lips = set(half.grids[half.strip(LIP_STRIPS)].ravel().tolist())
    eye, mouth = points[loop], points[[v for v in outer if v in lips]]
    grow = sizes["growth"]
    size = np.full(len(points), float(sizes["largest"]))
    for margin, (edge, reach) in ((eye, sizes["eye"]), (mouth, sizes["mouth"])):
        away = cKDTree(margin).query(points)[0]
        size = np.minimum(size, edge + grow * np.maximum(0.0, away - reach))
    for low, high, edge, slope in sizes["boxes"]:
        away = np.linalg.norm(np.maximum(0.0, np.maximum(low - points, points - high)), axis=1)
        size = np.minimum(size, edge + slope * away)
    return size


def strip_counts(half: HalfCage, size: Array) -> IntArray:
    """Return the number of edges on each side of each cage quad (m, 4): powers of two, equal along a strip of quads.

    Lids and lips decide for the strips that run through them, since their sampling is kept.
    """
    q = half.quads
    sides = np.sort(np.stack([q, np.roll(q, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    index = np.unique(sides, axis=0, return_inverse=True)[1].reshape(-1, 4)
    label = np.arange(index.max() + 1)
    while True:
        old = label.copy()
        for a, b in ((0, 2), (1, 3)):
            least = np.minimum(label[index[:, a]], label[index[:, b]])
            np.minimum.at(label, index[:, a], least)
            np.minimum.at(label, index[:, b], least)
        if (old == label).all():
            break
    g = half.grids
    lines = [g[:, :, 0], g[:, -1, :], g[:, :, -1], g[:, 0, :]]
    length = np.stack([np.linalg.norm(np.diff(half.points[k], axis=1), axis=2).sum(axis=1) for k in lines], axis=1)
    target = np.stack([size[k].mean(axis=1) for k in lines], axis=1)
    strip = label[index]
    weight = np.full(strip.shape, 1e-6)
    weight[half.strip(FROZEN_STRIPS)] = 1.0
    total = np.maximum(np.bincount(strip.ravel(), weight.ravel()), 1e-12)
    ratio = np.bincount(strip.ravel(), (weight * length / target).ravel()) / total
    counts = 2 ** np.clip(np.floor(np.log2(np.maximum(ratio / 0.85, 1.0))), 0, LEVELS).astype(np.int64)
    return counts[strip]


def sampled(half: HalfCage, counts: IntArray) -> IntArray:
    """Return the triangles, in fine vertices, of the coarse mesh to start from; the shorter diagonal cuts each cell."""
    triangles = []
    for grid, count in zip(half.grids, counts, strict=True):
        step = (len(grid) - 1) // count[:2]
        g = grid[:: step[0], :: step[1]]
        a, b, c, d = (v.ravel() for v in (g[:-1, :-1], g[1:, :-1], g[1:, 1:], g[:-1, 1:]))
        p = half.points
        first = np.linalg.norm(p[a] - p[c], axis=1) <= np.linalg.norm(p[b] - p[d], axis=1)
        triangles.append(np.where(first[:, None], np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1)))
        triangles.append(np.where(first[:, None], np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1)))
    return np.concatenate(triangles)


def _corner_cut(triangles: IntArray, corner: int) -> IntArray:
    """Flip a diagonal, if need be, so that the corner lies in a single triangle."""
    rows = np.flatnonzero((triangles == corner).any(axis=1))
    if len(rows) == 1:
        return triangles
    (_, x, y), (_, u, v) = (np.roll(t, -int(np.argmax(t == corner))) for t in triangles[rows])
    if x == v:
        x, y, v = u, v, y
    triangles = triangles.copy()
    triangles[rows] = [[corner, x, v], [x, y, v]]
    return triangles


def half_mesh(half: HalfCage, data: dict[str, Any], plane: Array, size: Array) -> tuple[ChartMesh, IntArray]:
    """Return the coarse mesh of the left half to start from, and its triangle at the middle of the neck's rim."""
    fine = half.fine_triangles()
    corner = half.of(data["chart"]["rim"][0])
    start = _corner_cut(sampled(half, strip_counts(half, size)), corner)
    used, flat = np.unique(start, return_inverse=True)
    triangles = flat.reshape(-1, 3)
    kind = np.where(half.points[used, 0] == 0.0, ON_LINE, FREE)  # the middle glides along itself
    rim = [v for v in _eye_and_rim(fine)[1] if abs(np.linalg.norm(plane[v]) - RADIUS) < 1e-9]
    number = {int(v): k for k, v in enumerate(used)}
    creases: list[int] = []
    merged: dict[int, int] = {}
    for chain in data["creases"]:
        for first, second in pairwise(chain):
            *between, last = half.side(first, second).tolist()
            creases += [half.of(first), last]
            merged |= {number[v]: number[last] for v in between if v in number}
    kind[np.isin(used, np.concatenate([half.grids[half.strip(FROZEN_STRIPS)].ravel(), rim, creases]))] = FIXED
    line = np.tile([0.0, 1.0], (len(used), 1))
    end = triangles[(start == corner).any(axis=1)][0]
    kept = {(int(min(a, b)), int(max(a, b))) for a in end for b in end if a != b}
    chart = Chart(plane, fine, np.column_stack([half.points, size]))
    return ChartMesh(chart, plane[used], triangles, kind, line, kept, merged), end


def lid_rows(half: HalfCage, plane: Array, mesh: ChartMesh) -> Iterator[Array]:
    """Yield the places (k, 2) in the chart of the vertices along the crease and the front edge of the upper lid."""
    for ring in ("eye_ring1", "eye_ring2"):
        sides = [half.side(f"{ring}.{k}", f"{ring}.{k + 1}") for k in range(5)]
        places = plane[np.append(half.of(f"{ring}.0"), np.concatenate(sides))]
        yield places[cKDTree(mesh.plane).query(places)[0] < 1e-9]


def ear_rings(half: HalfCage, plane: Array, rings: list[list[int]]) -> list[tuple[Array, Array]]:
    """Return the places (k, 2) in the chart, and the shares of the way around, of typed points of the ear's rings."""
    places = [plane[[half.of(f"ear_ring{k}.{n}") for n in ring]] for k, ring in enumerate(rings, 1)]
    return [(place, np.array(ring) / len(rings[0])) for place, ring in zip(places, rings, strict=True)]


def whole_mesh(mesh: ChartMesh, end: IntArray) -> tuple[IntArray, NDArray[np.int32], IntArray, Array]:
    """Return the left half's vertices that stay, those with twins, and triangles and chart of the mirrored mesh.

    The two triangles at the middle of the neck's rim become one.
    """
    plane = mesh.plane
    middle = plane[:, 0] == 0.0
    corner, *others = sorted(end.tolist(), key=lambda v: (not middle[v], plane[v, 1]))
    top, side = others
    keep = np.setdiff1d(np.arange(len(plane)), corner)
    number = np.full(len(plane), -1)
    number[keep] = np.arange(len(keep))
    twins = keep[~middle[keep]]
    twin = np.where(middle, number, -1)
    twin[twins] = len(keep) + np.arange(len(twins))
    rest = mesh.triangles[~(mesh.triangles == corner).any(axis=1)]
    bridge = np.array([[number[top], twin[side], number[side]]])
    triangles = np.vstack([number[rest], twin[rest][:, ::-1], bridge])
    return keep, number[twins].astype(np.int32), triangles, np.vstack([plane[keep], plane[twins] * [-1.0, 1.0]])


def molding(half: HalfCage, mesh: ChartMesh, keep: IntArray, twins: NDArray[np.int32]) -> Mold:
    """Return the map from cage points to the head's vertices."""
    cells, weights = mesh.chart.locate(mesh.plane[keep])
    rows = np.repeat(np.arange(len(keep)), 3)
    corners = mesh.chart.triangles[cells]
    pick = sparse.csr_array((weights.ravel(), (rows, corners.ravel())), shape=(len(keep), len(half.points)))
    mold = sparse.csr_array(pick @ half.limit)
    mold.data[np.abs(mold.data) < 1e-12] = 0.0
    mold.eliminate_zeros()
    nearest = corners[np.arange(len(keep)), weights.argmax(axis=1)]
    at_fine_vertex = weights.max(axis=1) > 1.0 - 1e-6  # all vertices of the linings, where the sampling is kept
    lips = opposite_on_lips(np.where(at_fine_vertex[:, None], lining_places(half)[nearest], np.nan))
    return Mold(mold, pick @ ring_share(half, LID_STRIPS), lips, twins)


# --- landmarks and all arrays ---------------------------------------------------------------------------
def closest_point(query: Array, corners: Array) -> Array:
    """Return the point (3,) nearest to `query` on triangles (m, 3, 3).

    :func:`facewrinkle.geometry.interpolation.closest_point` rounds differently: the stored head would not come out bit
    for bit.
    """
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    size = np.einsum("mi,mi->m", normal, normal)
    size = np.where(size > 0.0, size, np.inf)
    p = query - normal * (np.einsum("mi,mi->m", query - a, normal) / size)[:, None]
    beyond = np.stack([np.einsum("mi,mi->m", np.cross(v - u, p - u), normal) for u, v in ((a, b), (b, c), (c, a))])
    inside = (beyond >= 0.0).all(axis=0) & np.isfinite(size)
    found = [p[inside]]
    for u, v in ((a, b), (b, c), (c, a)):
        along = v - u
        share = np.einsum("mi,mi->m", query - u, along) / np.maximum(np.einsum("mi,mi->m", along, along), 1e-30)
        found.append(u + np.clip(share, 0.0, 1.0)[:, None] * along)
    places = np.concatenate(found)
    nearest: Array = places[np.linalg.norm(places - query, axis=1).argmin()]
    return nearest


def landmarks(half: HalfCage, data: dict[str, Any], points: Array, triangles: IntArray) -> dict[str, Array]:
    """Return the landmarks on the mesh, from typed places or cage vertices; the left ones are mirrored to the right."""
    corners = points[triangles]
    left = corners[(corners[:, :, 0] >= 0.0).all(axis=1)]
    middle = np.stack([np.where(t[:, :1] == 0.0, t, np.nan) for t in corners])
    pairs = middle[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2, 3)
    ridge = pairs[np.isfinite(pairs).all(axis=(1, 2))][:, [0, 1, 1]]
    found: dict[str, Array] = {}
    for name, place in data["landmarks"].items():
        at = half.points[half.of(place)] if isinstance(place, str) else np.array(place, dtype=float)
        found[name] = closest_point(at, ridge if at[0] == 0.0 else left)
    found["eye_l_centre"] = np.array(data["eye"]["centre"])
    for name in [name for name in found if "_l_" in name or name.endswith("_l")]:
        twin = name.replace("_l_", "_r_") if "_l_" in name else name[:-1] + "r"
        found[twin] = found[name] * MIRROR
    return found


def refuse_crossings(points: Array, triangles: IntArray) -> None:
    """Raise a ValueError if triangles (m, 3) run through each other.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, -1], [0.5, 0.5, 1], [-1, -1, 1]])
    >>> refuse_crossings(points, np.array([[0, 1, 2], [3, 4, 5]]))
    Traceback (most recent call last):
    ...
    ValueError: the head crosses itself: 2 triangles run through each other, around [0.3, 0.3, 0.2].
    """
    met = np.unique(self_intersections(points, triangles))
    if len(met):
        place = points[triangles[met]].mean(axis=(0, 1)).round(1).tolist()
        raise ValueError(f"the head crosses itself: {len(met)} triangles run through each other, around {place}.")


def head_arrays(data: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """Return all arrays of the head, with the texture as an image."""
    laid_out = half_surface(data | {"points": data["points"] | data["laid_out"]})
    size = target_size(laid_out, data)
    plane = charted(laid_out, data["chart"], size)
    mesh, end = half_mesh(laid_out, data, plane, size)
    mesh.refine((TRIANGLES + 1) // 2)
    mesh.insert_row(*lid_rows(laid_out, plane, mesh))
    mesh.refill(ear_rings(laid_out, plane, data["ear"]))
    keep, twins, triangles, chart = whole_mesh(mesh, mesh.renumbered[end])
    half = half_surface(data)
    mold = molding(half, mesh, keep, twins)
    eye = data["eye"]
    cage = np.array(list(data["points"].values()))
    points = mold(cage, np.array(eye["centre"]), eye["radius"])
    refuse_crossings(points, triangles)
    named = landmarks(half, data, points, triangles)
    brow, weights = brow_hairs(data["brow"], points, triangles)
    half_count = len(triangles) // 2
    low, high = chart.min(axis=0), chart.max(axis=0)
    middle, span = 0.5 * (low + high), float((high - low).max())
    painter = HeadPainter(half.points, half.fine_triangles(), plane, partial(between, half), data, named)
    texture, hair = painter.texture(middle, span)
    color, vertex_hair = painter.colors(chart)
    return {
        "points": points,
        "triangles": triangles.astype(np.int32),
        "uv": 0.5 + (chart - middle) / span,
        "texture": texture,
        "hair": np.vstack(list(hair)),
        "color": color,
        "color_hair": vertex_hair,
        "landmark_names": np.array(list(named)),
        "landmarks": np.stack(list(named.values())),
        "eye_radius": np.array(eye["radius"]),
        "mold_weights": mold.weights.data,
        "mold_cage_points": mold.weights.indices.astype(np.int16),
        "mold_size": np.array(mold.weights.shape[1]),
        "mold_rows": mold.weights.indptr.astype(np.int32),
        "lid_share": mold.lids,
        "lips": mold.lips,
        "twins": twins,
        "brow_triangles": np.concatenate([brow, brow + half_count]),
        "brow_weights": np.concatenate([weights, weights[..., ::-1]]),
        "brow_heights": np.array(data["brow"]["heights"]),
    }


def build_head() -> Head:
    """Build the head from its cage, which takes about ten seconds."""
    return unpacked(stored(head_arrays(cage_data())))


def stored(arrays: dict[str, Any]) -> dict[str, Any]:
    """Return the arrays of the head as they are stored, with the images as JPEG."""
    return {**arrays, "texture": _encoded(arrays["texture"]), "hair": _encoded(arrays["hair"])}


def _encoded(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the bytes of an image as JPEG: without loss, the noise of pores would make it ten times larger."""
    from PIL import Image

    file = BytesIO()
    Image.fromarray(image).save(file, format="JPEG", quality=90, subsampling=0)
    return np.frombuffer(file.getvalue(), np.uint8)
