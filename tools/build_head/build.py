"""From the typed cage to the arrays of the built-in head."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from io import BytesIO
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from facewrinkle.anatomy.head import MIRROR, Head, Mould, both_sides, cage_data, seated, unpacked
from facewrinkle.geometry.topology import boundary_loops

from .cage import subdivided
from .chart import Chart, mean_value_chart
from .chart_mesh import FIXED, FREE, ON_LINE, ChartMesh
from .paint import HeadPainter, brow_hairs

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

LEVELS = 3
"""Subdivisions of the cage."""

TRIANGLES = 4517
"""Triangles of the head."""

RADIUS = 100.0
"""Radius of the chart, mm: about that of a head."""

LID_STRIPS = {("eye_ring2", "eye_ring3")}
LIP_STRIPS = {(f"mouth_ring{k}", f"mouth_ring{k + 1}") for k in (1, 2, 3)}
FROZEN_STRIPS = LID_STRIPS | LIP_STRIPS | {("eye_ring1", "eye_ring2")}
"""Pairs of rings of the cage between which the lids and the lips lie, and all pairs between which the sampling is kept.
"""


@dataclass
class HalfCage:
    """The left half of the limit surface.

    Attributes
    ----------
    names : list of str
        Names of the cage's vertices.
    quads : ndarray of int, shape (m, 4)
        Quads of the cage.
    points : ndarray, shape (n, 3)
        The fine points, with the lids seated on the eyeball.
    grids : ndarray of int, shape (m, 2^k + 1, 2^k + 1)
        Fine vertices over each quad of the cage.
    limit : sparse array, shape (n, c)
        Maps the c cage points, the left half's and then the mirrored ones, to the points before the lids are seated.
    """

    names: list[str]
    quads: IntArray
    points: Array
    grids: IntArray
    limit: sparse.csr_array

    def of(self, name: str) -> int:
        """Return the fine vertex over a cage vertex."""
        row, corner = np.argwhere(self.quads == self.names.index(name))[0]
        i, j = ((0, 0), (-1, 0), (-1, -1), (0, -1))[corner]
        return int(self.grids[row, i, j])

    def side(self, first: str, second: str) -> IntArray:
        """Return the fine vertices from one cage vertex to the next, without the first."""
        ends = [self.names.index(first), self.names.index(second)]
        row = int(np.flatnonzero(np.isin(self.quads, ends).sum(axis=1) == 2)[0])
        g = self.grids[row]
        lines = [
            line for line in (g[:, 0], g[-1], g[:, -1], g[0]) if {self.of(first), self.of(second)} <= set(line.tolist())
        ]
        return lines[0][1:] if lines[0][0] == self.of(first) else lines[0][-2::-1]

    def strip(self, pairs: set[tuple[str, str]]) -> IntArray:
        """Return the rows of the quads between rings, which are given as pairs of name stems."""
        stems = [{self.names[v].split(".")[0] for v in quad} for quad in self.quads]
        return np.array([q for q, stem in enumerate(stems) if any(stem == set(pair) for pair in pairs)], dtype=np.int64)

    def fine_triangles(self) -> IntArray:
        """Return the triangles of the fine mesh."""
        g = self.grids
        quads = np.stack([g[:, :-1, :-1], g[:, 1:, :-1], g[:, 1:, 1:], g[:, :-1, 1:]], axis=-1).reshape(-1, 4)
        return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def half_surface(data: dict[str, Any]) -> HalfCage:
    """Subdivide the mirrored cage, keep the half with x >= 0, and seat the lids on the eyeball."""
    names = list(data["points"])
    points = np.array([data["points"][name] for name in names])
    quads = np.array([[names.index(name) for name in quad] for quad in data["quads"]])
    on_middle = points[:, 0] == 0.0
    partner = np.arange(len(points))
    partner[~on_middle] = len(points) + np.arange(np.count_nonzero(~on_middle))
    whole = subdivided(np.vstack([quads, partner[quads][:, ::-1]]), LEVELS)
    grids = whole.grids[: len(quads)]
    used, flat = np.unique(grids, return_inverse=True)
    limit = whole.limit[used]
    half = HalfCage(names, quads, limit @ both_sides(points), flat.reshape(grids.shape), limit)
    half.points[np.abs(half.points[:, 0]) < 1e-9, 0] = 0.0
    eye = data["eye"]
    half.points[:] = seated(half.points, ring_share(half, LID_STRIPS), np.array(eye["centre"]), eye["radius"])
    return half


def ring_share(half: HalfCage, pairs: set[tuple[str, str]]) -> Array:
    """Return shares (n,) that rise from 0 on the first ring of a pair to 1 on the second; 0 elsewhere."""
    share = np.zeros(len(half.points))
    i, j = np.meshgrid(*(np.linspace(0, 1, half.grids.shape[1]),) * 2, indexing="ij")
    blend = np.stack([(1 - i) * (1 - j), i * (1 - j), i * j, (1 - i) * j])
    second = {pair[1] for pair in pairs}
    for q in half.strip(pairs):
        inner = [half.names[v].split(".")[0] in second for v in half.quads[q]]
        share[half.grids[q]] = blend[inner].sum(axis=0)
    return share


def between(half: HalfCage, first: str, second: str, last: int) -> tuple[BoolArray, Array]:
    """Return True for fine points (n,) between two rings, up to cage point `last`, and shares (n,) of the way."""
    rows = half.strip({(first, second)})
    numbers = np.array([[int(half.names[v].split(".")[1]) for v in quad] for quad in half.quads[rows]])
    inside = np.zeros(len(half.points), dtype=bool)
    inside[half.grids[rows[(numbers <= last).all(axis=1)]]] = True
    return inside, ring_share(half, {(first, second)})


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


def moulding(half: HalfCage, mesh: ChartMesh, keep: IntArray) -> tuple[sparse.csr_array, Array]:
    """Return the map (k, c) from cage points to the left half's vertices, and the `lids` (k,) of :class:`Mould`."""
    cells, weights = mesh.chart.locate(mesh.plane[keep])
    rows = np.repeat(np.arange(len(keep)), 3)
    corners = mesh.chart.triangles[cells].ravel()
    pick = sparse.csr_array((weights.ravel(), (rows, corners)), shape=(len(keep), len(half.points)))
    return sparse.csr_array(pick @ half.limit), pick @ ring_share(half, LID_STRIPS)


# --- landmarks and all arrays ---------------------------------------------------------------------------
def closest_point(query: Array, corners: Array) -> Array:
    """Return the point (3,) nearest to `query` on triangles (m, 3, 3).

    :func:`facewrinkle.geometry.closest_point.closest_point` rounds differently: the stored head would not come out bit
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


def head_arrays(data: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """Return all arrays of the head, with the texture as an image."""
    half = half_surface(data)
    size = target_size(half, data)
    plane = charted(half, data["chart"], size)
    mesh, end = half_mesh(half, data, plane, size)
    mesh.refine((TRIANGLES + 1) // 2)
    keep, twins, triangles, chart = whole_mesh(mesh, mesh.renumbered[end])
    mould, share = moulding(half, mesh, keep)
    mould.data[np.abs(mould.data) < 1e-12] = 0.0
    mould.eliminate_zeros()
    eye = data["eye"]
    cage = np.array(list(data["points"].values()))
    points = Mould(mould, share, twins.astype(np.int32))(cage, np.array(eye["centre"]), eye["radius"])
    named = landmarks(half, data, points, triangles)
    brow, weights = brow_hairs(data["brow"], points, triangles)
    half_count = len(triangles) // 2
    low, high = chart.min(axis=0), chart.max(axis=0)
    middle, span = 0.5 * (low + high), float((high - low).max())
    painter = HeadPainter(half.points, half.fine_triangles(), plane, partial(between, half), data, named)
    return {
        "points": points,
        "triangles": triangles.astype(np.int32),
        "uv": 0.5 + (chart - middle) / span,
        "texture": painter.texture(middle, span),
        "colour": painter.colours(chart),
        "landmark_names": np.array(list(named)),
        "landmarks": np.stack(list(named.values())),
        "eye_radius": np.array(eye["radius"]),
        "mould_weights": mould.data,
        "mould_cage_points": mould.indices.astype(np.int16),
        "mould_size": np.array(mould.shape[1]),
        "mould_rows": mould.indptr.astype(np.int32),
        "lid_share": share,
        "twins": twins,
        "brow_triangles": np.concatenate([brow, brow + half_count]),
        "brow_weights": np.concatenate([weights, weights[..., ::-1]]),
        "brow_heights": np.array(data["brow"]["heights"]),
    }


def build_head() -> Head:
    """Build the head from its cage, which takes about ten seconds."""
    return unpacked(stored(head_arrays(cage_data())))


def stored(arrays: dict[str, Any]) -> dict[str, Any]:
    """Return the arrays of the head as they are stored, with the texture as a JPEG."""
    return {**arrays, "texture": _encoded(arrays["texture"])}


def _encoded(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the bytes of an image as JPEG: without loss, the noise of pores would make it ten times larger."""
    from PIL import Image

    file = BytesIO()
    Image.fromarray(image).save(file, format="JPEG", quality=90, subsampling=0)
    return np.frombuffer(file.getvalue(), np.uint8)
