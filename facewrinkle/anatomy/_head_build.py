"""From the typed cage to the arrays of the built-in head."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from facewrinkle.anatomy._head_paint import Skin, brow_hairs
from facewrinkle.anatomy.cage import subdivided
from facewrinkle.anatomy.cage_mesh import FIXED, FREE, ON_LINE, Chart, ChartMesh, mean_value_chart
from facewrinkle.geometry.topology import boundary_loops

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

LEVELS = 4
TRIANGLES = 4517
MIRROR = np.array([-1.0, 1.0, 1.0])
SEAT = 0.25  # mm between eyeball and lid margin: more than the sag of a margin edge
LID_STRIPS = {("eye_ring2", "eye_ring3")}
LIP_STRIPS = {(f"mouth_ring{k}", f"mouth_ring{k + 1}") for k in (1, 2, 3)}
FROZEN_STRIPS = LID_STRIPS | LIP_STRIPS | {("eye_ring1", "eye_ring2")}


@dataclass
class HalfCage:
    """The left half of the limit surface: fine points, fine vertices over each cage quad, and the names."""

    names: list[str]
    quads: Ints
    points: Floats
    grids: Ints

    def of(self, name: str) -> int:
        """The fine vertex over a cage vertex."""
        row, corner = np.argwhere(self.quads == self.names.index(name))[0]
        i, j = ((0, 0), (-1, 0), (-1, -1), (0, -1))[corner]
        return int(self.grids[row, i, j])

    def strip(self, pairs: set[tuple[str, str]]) -> Ints:
        """Rows of the quads between rings, given as pairs of name stems."""
        stems = [{self.names[v].split(".")[0] for v in quad} for quad in self.quads]
        return np.array([q for q, stem in enumerate(stems) if any(stem == set(pair) for pair in pairs)], dtype=np.int64)

    def fine_triangles(self) -> Ints:
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
    fine = whole.limit @ np.vstack([points, points[~on_middle] * MIRROR])
    grids = whole.grids[: len(quads)]
    used, flat = np.unique(grids, return_inverse=True)
    half = HalfCage(names, quads, fine[used], flat.reshape(grids.shape))
    half.points[np.abs(half.points[:, 0]) < 1e-9, 0] = 0.0
    _seat_lids(half, np.array(data["eye"]["centre"]), data["eye"]["radius"])
    return half


def ring_share(half: HalfCage, pairs: set[tuple[str, str]]) -> Floats:
    """Over the quads between rings, 0 on the first of the pair to 1 on the second; 0 elsewhere (n,)."""
    share = np.zeros(len(half.points))
    i, j = np.meshgrid(*(np.linspace(0, 1, half.grids.shape[1]),) * 2, indexing="ij")
    blend = np.stack([(1 - i) * (1 - j), i * (1 - j), i * j, (1 - i) * j])
    second = {pair[1] for pair in pairs}
    for q in half.strip(pairs):
        inner = [half.names[v].split(".")[0] in second for v in half.quads[q]]
        share[half.grids[q]] = blend[inner].sum(axis=0)
    return share


def between(half: HalfCage, first: str, second: str, last: int) -> tuple[Bools, Floats]:
    """Whether a fine point lies between two rings, up to their point `last`, and how far from the first (n,)."""
    rows = half.strip({(first, second)})
    numbers = np.array([[int(half.names[v].split(".")[1]) for v in quad] for quad in half.quads[rows]])
    inside = np.zeros(len(half.points), dtype=bool)
    inside[half.grids[rows[(numbers <= last).all(axis=1)]]] = True
    return inside, ring_share(half, {(first, second)})


def _seat_lids(half: HalfCage, centre: Floats, radius: float) -> None:
    """Bring the lids' inner margin onto the eyeball, and keep everything else outside it."""
    depth = ring_share(half, LID_STRIPS)
    away = half.points - centre
    distance = np.linalg.norm(away, axis=1)
    seated = radius + SEAT
    wanted = np.maximum(distance + depth**2 * (seated - distance), seated)
    half.points[:] = centre + away * (wanted / distance)[:, None]


# ---------------------------------------------------------------------------------------------- the chart
def _eye_and_rim(triangles: Ints) -> list[list[int]]:
    """The two boundary loops of the half, the shorter one first."""
    return sorted((loop.tolist() for loop in boundary_loops(triangles)), key=len)


def charted(half: HalfCage, outline: list[tuple[str, list[float]]]) -> Floats:
    """A one-to-one chart of the half; its middle is the line x = 0, its rim the typed convex outline."""
    triangles = half.fine_triangles()
    n = len(half.points)
    middle_vertices = np.flatnonzero(half.points[:, 0] == 0.0)
    eye, outer = _eye_and_rim(triangles)
    top, bottom = half.of(outline[0][0]), half.of(outline[-1][0])
    outer = outer[outer.index(top) :] + outer[: outer.index(top)]
    if outer[1] in set(middle_vertices.tolist()):
        outer = [outer[0], *outer[:0:-1]]
    rim = outer[: outer.index(bottom) + 1]
    lower, upper = half.of("mouth_ring3.8"), half.of("mouth_ring3.0")
    mouth = outer[outer.index(lower) : outer.index(upper) + 1]
    plane = _on_outline(half, rim, outline)
    points = np.vstack([half.points, half.points[eye].mean(axis=0), half.points[mouth].mean(axis=0) * [0, 1, 1]])
    fill = [[n, b, a] for a, b in zip(eye, eye[1:] + eye[:1], strict=True)]
    fill += [[n + 1, b, a] for a, b in pairwise(mouth)]
    middle = np.setdiff1d(np.append(middle_vertices, n + 1), rim)
    fixed = [np.concatenate([rim, middle]), np.array(rim)]
    values = [np.concatenate([plane[:, 0], np.zeros(len(middle))]), plane[:, 1]]
    return mean_value_chart(points, np.vstack([triangles, fill]), fixed, values)[:n]


def _on_outline(half: HalfCage, rim: list[int], outline: list[tuple[str, list[float]]]) -> Floats:
    """Chart places (r, 2) of the rim: the outline's corners, and by arc length in between."""
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(half.points[rim], axis=0), axis=1)))
    stops = [along[rim.index(half.of(name))] for name, _ in outline]
    corners = np.array([place for _, place in outline])
    return np.stack([np.interp(along, stops, corners[:, c]) for c in range(2)], axis=1)


# ----------------------------------------------------------------------------------------------- the mesh
def wished_size(points: Floats, data: dict[str, Any], eye: Floats, mouth: Floats) -> Floats:
    """Wished edge length (n,) in mm; `eye` and `mouth` are points along the margins."""
    sizes = data["sizes"]
    grow = sizes["growth"]
    size = np.full(len(points), float(sizes["largest"]))
    for margin, (edge, reach) in ((eye, sizes["eye"]), (mouth, sizes["mouth"])):
        away = cKDTree(margin).query(points)[0]
        size = np.minimum(size, edge + grow * np.maximum(0.0, away - reach))
    for low, high, edge in sizes["boxes"]:
        away = np.linalg.norm(np.maximum(0.0, np.maximum(low - points, points - high)), axis=1)
        size = np.minimum(size, edge + grow * away)
    return size


def strip_counts(half: HalfCage, size: Floats) -> Ints:
    """How often to sample each side of each cage quad (m, 4): powers of two, equal along a strip of quads."""
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
    wished = np.stack([size[k].mean(axis=1) for k in lines], axis=1)
    strip = label[index]
    ratio = np.bincount(strip.ravel(), (length / wished).ravel()) / np.maximum(np.bincount(strip.ravel()), 1)
    counts = 2 ** np.clip(np.floor(np.log2(np.maximum(ratio / 0.85, 1.0))), 0, LEVELS).astype(np.int64)
    return counts[strip]


def sampled(half: HalfCage, counts: Ints) -> Ints:
    """Triangles (fine vertex numbers) of the coarse mesh to start from; the shorter diagonal of each cell."""
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


def _corner_cut(triangles: Ints, corner: int) -> Ints:
    """Flip the diagonal, if need be, so that the corner lies in a single triangle."""
    rows = np.flatnonzero((triangles == corner).any(axis=1))
    if len(rows) == 1:
        return triangles
    (_, x, y), (_, u, v) = (np.roll(t, -int(np.argmax(t == corner))) for t in triangles[rows])
    if x == v:
        x, y, v = u, v, y
    triangles = triangles.copy()
    triangles[rows] = [[corner, x, v], [x, y, v]]
    return triangles


def half_mesh(half: HalfCage, data: dict[str, Any], plane: Floats) -> tuple[ChartMesh, Ints]:
    """The coarse mesh of the left half to start from, and its triangle at the middle of the neck rim."""
    fine = half.fine_triangles()
    eye, outer = _eye_and_rim(fine)
    mouth = [v for v in outer if v in set(half.grids[half.strip(LIP_STRIPS)].ravel().tolist())]
    size = wished_size(half.points, data, half.points[eye], half.points[mouth])
    corner = half.of("neck.mid")
    start = _corner_cut(sampled(half, strip_counts(half, size)), corner)
    used, flat = np.unique(start, return_inverse=True)
    triangles = flat.reshape(-1, 3)
    kind, line = _kinds(half.points[used], plane[used], data["outline"])
    frozen = half.grids[half.strip(FROZEN_STRIPS)]
    kind[np.isin(used, frozen)] = FIXED
    end = triangles[(start == corner).any(axis=1)][0]
    kept = {(int(min(a, b)), int(max(a, b))) for a in end for b in end if a != b}
    chart = Chart(plane, fine, np.column_stack([half.points, size]))
    return ChartMesh(chart, plane[used], triangles, kind, line, kept), end


def _kinds(points: Floats, plane: Floats, outline: list[tuple[str, list[float]]]) -> tuple[Ints, Floats]:
    """Which vertices may glide along which line: the middle, and the straight parts of the outline."""
    kind = np.full(len(plane), FREE)
    line = np.zeros((len(plane), 2))
    middle = points[:, 0] == 0.0
    kind[middle], line[middle] = ON_LINE, (0.0, 1.0)
    corners = np.array([place for _, place in outline])
    for a, b in pairwise(corners):
        along = (b - a) / np.linalg.norm(b - a)
        off = plane - a
        reach = off @ along
        inside = (reach > -1e-9) & (reach < np.linalg.norm(b - a) + 1e-9)
        on = inside & (np.abs(off[:, 0] * along[1] - off[:, 1] * along[0]) < 1e-9)
        kind[on], line[on] = ON_LINE, along
    ends = np.linalg.norm(plane[:, None] - corners, axis=2).min(axis=1) < 1e-9
    kind[ends] = FIXED
    return kind, line


def whole_mesh(mesh: ChartMesh, end: Ints) -> tuple[Floats, Ints, Floats]:
    """Points, triangles and chart of the mirrored mesh; the end triangles become one across the middle."""
    points, plane = mesh.points.copy(), mesh.plane.copy()
    middle = mesh.plane[:, 0] == 0.0
    points[middle, 0] = 0.0
    corner, *others = sorted(end.tolist(), key=lambda v: (points[v, 0] > 0, plane[v, 1]))
    top, side = others
    keep = np.setdiff1d(np.arange(len(points)), corner)
    number = np.full(len(points), -1)
    number[keep] = np.arange(len(keep))
    twins = keep[~middle[keep]]
    twin = number.copy()
    twin[twins] = len(keep) + np.arange(len(twins))
    rest = mesh.triangles[~(mesh.triangles == corner).any(axis=1)]
    bridge = np.array([[number[top], twin[side], number[side]]])
    triangles = np.vstack([number[rest], twin[rest][:, ::-1], bridge])
    return (
        np.vstack([points[keep], points[twins] * MIRROR]),
        triangles,
        np.vstack([plane[keep], plane[twins] * [-1.0, 1.0]]),
    )


# ---------------------------------------------------------------------------------- what lies on the mesh
def closest_point(query: Floats, corners: Floats) -> Floats:
    """The point (3,) nearest to `query` on triangles (m, 3, 3)."""
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
    nearest: Floats = places[np.linalg.norm(places - query, axis=1).argmin()]
    return nearest


def landmarks(half: HalfCage, data: dict[str, Any], points: Floats, triangles: Ints) -> dict[str, Floats]:
    """Landmarks on the mesh, from typed places or cage vertices; the left are mirrored to the right."""
    corners = points[triangles]
    left = corners[(corners[:, :, 0] >= 0.0).all(axis=1)]
    middle = np.stack([np.where(t[:, :1] == 0.0, t, np.nan) for t in corners])
    pairs = middle[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2, 3)
    ridge = pairs[np.isfinite(pairs).all(axis=(1, 2))][:, [0, 1, 1]]
    found: dict[str, Floats] = {}
    for name, place in data["landmarks"].items():
        at = half.points[half.of(place)] if isinstance(place, str) else np.array(place, dtype=float)
        found[name] = closest_point(at, ridge if at[0] == 0.0 else left)
    found["eye_l_centre"] = np.array(data["eye"]["centre"])
    for name in [name for name in found if "_l_" in name or name.endswith("_l")]:
        twin = name.replace("_l_", "_r_") if "_l_" in name else name[:-1] + "r"
        found[twin] = found[name] * MIRROR
    return found


def head_arrays(data: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """All arrays of the head, as they are stored."""
    half = half_surface(data)
    plane = charted(half, data["outline"])
    mesh, end = half_mesh(half, data, plane)
    mesh.refine((TRIANGLES + 1) // 2)
    points, triangles, chart = whole_mesh(mesh, end)
    named = landmarks(half, data, points, triangles)
    brow, weights = brow_hairs(data["brow"], points, triangles)
    twins = len(triangles) // 2
    low, high = chart.min(axis=0), chart.max(axis=0)
    middle, span = 0.5 * (low + high), float((high - low).max())
    skin = Skin(half.points, half.fine_triangles(), plane, partial(between, half), data)
    return {
        "points": points,
        "triangles": triangles.astype(np.int32),
        "uv": 0.5 + (chart - middle) / span,
        "texture": skin.texture(middle, span),
        "colour": skin.colours(chart),
        "landmark_names": np.array(list(named)),
        "landmarks": np.stack(list(named.values())),
        "eye_radius": np.array(data["eye"]["radius"]),
        "brow_triangles": np.concatenate([brow, brow + twins]),
        "brow_weights": np.concatenate([weights, weights[..., ::-1]]),
        "brow_heights": np.array(data["brow"]["heights"]),
    }
