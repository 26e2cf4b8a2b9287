"""Red-green refinement.

what                                   checked against
closure and coarsening                 a naive forest of dictionaries with exact coordinates, in order and
conforming, boundary, topology         the M0 edge or triangle that every edge of the result lies in
weights                                positions averaged parent by parent; affine fields
angles                                 the M0 triangles and their single bisections
coarsening everything                  M0, bit for bit
"""

import tracemalloc
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_meshes import delaunay, smallest_angles, square

from facewrinkle.errors import MeshError, ParameterError
from facewrinkle.geometry import RedGreenForest, unique_edges

# --- meshes and markings --------------------------------------------------------------------------


def cloud(size, rng):
    """Delaunay triangles of random points, some taken out: holes, islands, loops that touch in a vertex."""
    points = rng.random((size, 2))
    triangles = delaunay(points)
    kept = rng.random(len(triangles)) > rng.choice([0.0, 0.2, 0.5])
    kept[0] = True
    return np.c_[points, 0.3 * np.sin(5 * points[:, 0])], triangles[kept]


def torus(size, rng):
    rows, columns = 3 + size % 3, 3 + size % 5
    i, j = (a.ravel() for a in np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"))
    quads = np.stack([(i + di) % rows * columns + (j + dj) % columns for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1))], 1)
    s, t = 2 * np.pi * i / rows, 2 * np.pi * j / columns
    points = np.stack([(2 + np.cos(s)) * np.cos(t), (2 + np.cos(s)) * np.sin(t), np.sin(s)], 1)
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def ball(size, rng):
    """An octahedron or its uniform refinement, pushed out to a sphere."""
    points = np.concatenate([np.eye(3), -np.eye(3)])
    triangles = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
    if size % 2:
        forest = RedGreenForest(triangles)
        forest.split(np.ones(8, bool))
        points, triangles = forest.weights @ points, forest.triangles
    return points / np.linalg.norm(points, axis=1, keepdims=True), triangles


def book(size, rng):
    """Up to seven pages on one spine, some of them glued to further pages: non-manifold edges."""
    pages = 3 + size % 5
    outer = np.arange(2, 2 + pages)
    triangles = np.stack([np.zeros(pages, int), np.ones(pages, int), outer], 1)
    more = np.stack([np.ones(pages, int), np.roll(outer, 1), outer], 1)[: size % 4]
    return rng.normal(size=(2 + pages, 3)), np.concatenate([triangles, more])


def pieces(size, rng):
    (p, t), (q, u) = cloud(4 + size // 2, rng), ball(0, rng)
    return np.concatenate([p, q + 5]), np.concatenate([t, u + len(p)])


@st.composite
def meshes(draw, kinds=(cloud, torus, ball, book, pieces)):
    kind, size, seed = draw(st.sampled_from(kinds)), draw(st.integers(4, 20)), draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    points, triangles = kind(size, rng)
    return points, triangles[rng.permutation(len(triangles))]


# One operation: split or coarsen, the marked fraction, and how they are chosen.
choice = st.tuples(st.sampled_from([0.05, 0.3, 0.7, 0.95, 1.0]), st.integers(0, 999))
operation = st.tuples(st.sampled_from(["split", "coarsen"]), choice).map(lambda pair: (pair[0], *pair[1]))
operations = st.tuples(choice, st.lists(operation, max_size=6)).map(lambda pair: [("split", *pair[0]), *pair[1]])
MOST = 800  # triangles; larger meshes are not split any further


def marks(forest, fraction, seed):
    """Random triangles, or the neighborhood of one of them (which makes deep and uneven forests)."""
    rng = np.random.default_rng(seed)
    m = len(forest.triangles)
    if seed % 2:
        return rng.random(m) < fraction
    chosen = np.isin(forest.triangles, forest.triangles[rng.integers(m)]).any(axis=1)
    return chosen if seed % 4 else ~chosen


def apply(forest, operation):
    name, fraction, seed = operation
    if name == "split" and len(forest.triangles) > MOST:
        return None
    return getattr(forest, name)(marks(forest, fraction, seed))


def after(forest, operations):
    """The forest, changed by all of the operations."""
    for each in operations:
        apply(forest, each)
    return forest


# --- invariants -----------------------------------------------------------------------------------


def areas(points, triangles):
    a, b, c = points[triangles].transpose(1, 0, 2)
    return np.cross(b - a, c - a) / 2


def angle_bound(points, triangles):
    """The smallest angle of the triangles and of their six bisections each."""
    p = points[triangles]
    halves = []
    for k in range(3):
        a, b, c = np.roll(p, -k, axis=1).transpose(1, 0, 2)
        halves += [np.stack([a, (a + b) / 2, c], 1), np.stack([(a + b) / 2, b, c], 1)]
    every = np.concatenate([p, *halves])
    return smallest_angles(every.reshape(-1, 3), np.arange(3 * len(every)).reshape(-1, 3)).min()


def supports(forest):
    """M0 vertices of non-zero weight, one frozenset per vertex."""
    return [frozenset(c[w > 0].tolist()) for c, w in zip(forest.corners, forest.barycentric, strict=True)]


def check_conforming(forest, base):
    """Every edge lies in an M0 edge and is shared as often, or inside an M0 triangle and is shared twice."""
    base_edges, base_sides = unique_edges(base)
    valence0 = dict(zip(map(frozenset, base_edges.tolist()), np.bincount(base_sides.ravel()).tolist(), strict=True))
    edges, sides = unique_edges(forest.triangles)
    support = supports(forest)
    for (a, b), valence in zip(edges.tolist(), np.bincount(sides.ravel()).tolist(), strict=True):
        assert valence == valence0.get(support[a] | support[b], 2)
    assert not {frozenset(e) for e in edges.tolist()} & {frozenset(p) for p in forest.parents.tolist() if p[0] >= 0}
    for row, root in zip(forest.triangles.tolist(), forest.root.tolist(), strict=True):
        assert frozenset().union(*(support[v] for v in row)) == frozenset(base[root].tolist())


def check_vertices(forest, base, n0):
    corners, weights, host = forest.corners, forest.barycentric, forest.host
    assert (corners[n0:] == base[host[n0:]]).all()
    used = np.unique(base)
    assert (base[host[used]] == used[:, None]).any(axis=1).all()
    assert (corners[:n0] == np.arange(n0)[:, None]).all()
    assert (weights[:n0] == [1, 0, 0]).all()
    assert (weights >= 0).all()
    assert (weights.sum(axis=1) == 1).all()
    scaled = weights * 2.0 ** forest.vertex_level[:, None]
    assert (scaled == np.round(scaled)).all()
    parents = forest.parents
    assert (parents[:n0] == -1).all()
    assert (parents[n0:] < np.arange(n0, len(parents))[:, None]).all()
    matrix = forest.weights
    assert matrix.has_canonical_format
    assert (matrix.sum(axis=1) == 1).all()
    assert matrix.shape == (forest.n_points, n0)


def check_geometry(forest, base, points0):
    points = forest.weights @ points0
    by_parents = points.copy()
    for v in range(len(points0), len(points)):
        by_parents[v] = by_parents[forest.parents[v]].mean(axis=0)
    scale = np.abs(points0).max()
    assert np.abs(points - by_parents).max() <= 1e-12 * scale
    affine, shift = np.array([1.5, -2.0, 0.7]), 3.0
    assert np.abs(forest.weights @ (points0 @ affine + shift) - (points @ affine + shift)).max() <= 1e-12 * (
        scale + shift
    )
    area, area0 = areas(points, forest.triangles), areas(points0, base)
    assert ((area * area0[forest.root]).sum(axis=1) > 0).all()
    per_root = np.bincount(forest.root, np.linalg.norm(area, axis=1), minlength=len(base))
    size0 = np.linalg.norm(area0, axis=1)
    # Slivers lose digits of their own area, never more than those of the mesh.
    assert np.abs(per_root - size0).max() <= 1e-12 * scale**2
    assert abs(per_root.sum() - size0.sum()) <= 1e-12 * size0.sum()
    assert smallest_angles(points, forest.triangles).min() >= angle_bound(points0, base) * (1 - 1e-6)


@settings(max_examples=150)
@given(meshes(), operations)
def test_invariants_hold_after_any_operations(mesh, steps):
    points0, base = mesh
    forest = RedGreenForest(base, n_points=len(points0))
    carried = points0
    for step in steps:
        m, n = len(forest.triangles), forest.n_points
        change = apply(forest, step)
        if change is None:
            continue
        assert bool(change) == (len(forest.triangles) != m) == (forest.n_points != n)
        new = (forest.weights @ points0)[forest.n_points - change.n_created :]
        carried = np.concatenate([carried[change.kept], new])
        assert (carried == forest.weights @ points0).all()
    check_conforming(forest, base)
    check_vertices(forest, base, len(points0))
    check_geometry(forest, base, points0)


# --- a naive forest as oracle ---------------------------------------------------------------------

ONE = 2**30


@lru_cache(2**16)
def between(a, b):
    """Midpoint of two exact vertices, each a sorted tuple of (M0 vertex, weight) pairs."""
    total = dict(a)
    for i, w in b:
        total[i] = total.get(i, 0) + w
    return tuple(sorted((i, w // 2) for i, w in total.items()))


def midpoints(t):
    return tuple(between(t[s], t[(s + 1) % 3]) for s in range(3))


class NaiveForest:
    """Red splits as a set of triangles with exact corners; closure by trying all leaves, over and over."""

    def __init__(self, base):
        self.roots = [(r, tuple(((int(v), ONE),) for v in t)) for r, t in enumerate(base)]
        self.split_nodes = set()

    def children(self, node):
        r, t = node
        m = midpoints(t)
        return [(r, (t[s], m[s], m[s - 1])) for s in range(3)] + [(r, m)]

    def leaves(self):
        stack = self.roots[::-1]
        while stack:
            node = stack.pop()
            if node in self.split_nodes:
                stack.extend(self.children(node)[::-1])
            else:
                yield node

    def hanging(self):
        return {m for _, t in self.split_nodes for m in midpoints(t)}

    def illegal(self, nodes):
        vertices, found = self.hanging(), set()
        for r, t in nodes:
            m = midpoints(t)
            quarters = {between(t[s], m[s]) for s in range(3)} | {between(m[s], t[(s + 1) % 3]) for s in range(3)}
            if sum(v in vertices for v in m) > 1 or quarters & vertices:
                found.add((r, t))
        return found

    def triangles(self):
        vertices = self.hanging()
        for node in self.leaves():
            _, t = node
            side = [s for s, m in enumerate(midpoints(t)) if m in vertices]
            if side:
                a, b, c = (t[(side[0] + k) % 3] for k in range(3))
                yield node, (a, between(a, b), c)
                yield node, (between(a, b), b, c)
            else:
                yield node, t

    def split(self, nodes):
        self.split_nodes |= nodes
        while illegal := self.illegal(self.leaves()):
            self.split_nodes |= illegal

    def coarsen(self, unmarked):
        leaves = set(self.leaves())
        taken = {node for node in self.split_nodes if set(self.children(node)) <= leaves - unmarked}
        self.split_nodes -= taken
        while back := self.illegal(taken):
            self.split_nodes |= back
            taken -= back


def exact(forest):
    """Every vertex of the forest as the naive one names it."""
    return [
        tuple(sorted((i, int(w * ONE)) for i, w in zip(c, b, strict=True) if w > 0))
        for c, b in zip(forest.corners.tolist(), forest.barycentric.tolist(), strict=True)
    ]


@settings(max_examples=40)
@given(meshes(), operations)
def test_same_triangles_as_the_naive_forest(mesh, steps):
    points0, base = mesh
    forest, naive = RedGreenForest(base, n_points=len(points0)), NaiveForest(base)
    for name, fraction, seed in steps:
        if name == "split" and len(forest.triangles) > MOST // 4:
            continue
        marked = marks(forest, fraction, seed)
        nodes = [node for node, _ in naive.triangles()]
        if name == "split":
            naive.split({node for node, mark in zip(nodes, marked, strict=True) if mark})
        else:
            naive.coarsen({node for node, mark in zip(nodes, marked, strict=True) if not mark})
        getattr(forest, name)(marked)
        keys = exact(forest)
        assert [tuple(keys[v] for v in t) for t in forest.triangles.tolist()] == [t for _, t in naive.triangles()]
        assert len(set(keys)) == len(keys)  # no vertex twice, none left over
        assert set(keys) == naive.hanging() | {((v, ONE),) for v in range(len(points0))}


@settings(max_examples=15)
@given(meshes(), operations, st.integers(0, 99))
def test_marks_of_nodes_lead_to_the_same_triangles_from_any_others(mesh, steps, seed):
    """The least legal forest in which every node is split that is wanted, as are all that it lies in."""
    points0, base = mesh

    def wanted(triangle):
        return hash((seed, *sorted(triangle))) % 100 < 60

    forest, fresh = (after(RedGreenForest(base, 3, len(points0)), made) for made in (steps, []))
    naive = NaiveForest(base)
    front = naive.roots
    for _ in range(3):
        front = [node for node in front if wanted(node[1])]
        naive.split(set(front))
        front = [child for node in front for child in naive.children(node)]
    for each in (forest, fresh):
        for _ in range(6):
            keys = exact(each)
            if not each.adapt(np.array([wanted(keys[v] for v in node) for node in each.nodes.tolist()])):
                break
        keys = exact(each)
        assert [tuple(keys[v] for v in t) for t in each.triangles.tolist()] == [t for _, t in naive.triangles()]
        each.sort()
    np.testing.assert_array_equal(forest.triangles, fresh.triangles)
    np.testing.assert_array_equal(forest.parents, fresh.parents)
    np.testing.assert_array_equal(forest.barycentric, fresh.barycentric)


# --- restoring, relabeling, repeating ------------------------------------------------------------


def take_back_all(forest):
    calls = 0
    while forest.coarsen(np.ones(len(forest.triangles), bool)):
        calls += 1
    return calls


@settings(max_examples=40)
@given(meshes(), operations)
def test_coarsening_everything_restores_m0_and_its_forest(mesh, steps):
    points0, base = mesh
    forest = after(RedGreenForest(base, n_points=len(points0)), steps)
    first, corners = forest.triangles, forest.corners
    deepest = forest.level.max()
    assert take_back_all(forest) == deepest
    assert (forest.triangles == base).all()
    assert forest.n_points == len(points0)
    assert (forest.weights.toarray() == np.eye(len(points0))).all()
    assert not forest.level.any()
    assert (forest.root == np.arange(len(base))).all()
    assert (after(forest, steps).triangles == first).all()
    assert (forest.corners == corners).all()


@settings(max_examples=30)
@given(meshes(), operations, operations)
def test_copies_are_equal_and_independent(mesh, before, later):
    _, base = mesh
    forest = after(RedGreenForest(base), before)
    kept = forest.triangles.copy(), forest.corners.copy(), forest.level
    repeated, twin = forest.copy(), after(forest.copy(), later)
    assert all((a == b).all() for a, b in zip(kept, (forest.triangles, forest.corners, forest.level), strict=True))
    assert (twin.triangles == after(repeated, later).triangles).all()
    assert (twin.barycentric == repeated.barycentric).all()


# --- particular cases -----------------------------------------------------------------------------


def test_one_red_triangle_in_a_fan():
    # Fig. 10 of Zhang, Sim and Tan: the split triangle falls into four, its two neighbors in the fan are
    # bisected.
    forest = RedGreenForest([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5], [0, 5, 6], [0, 6, 1]])
    assert forest.split([0]).n_created == 3
    assert forest.parents[7:].tolist() == [[0, 1], [1, 2], [2, 0]]
    assert forest.triangles.tolist() == [
        [0, 7, 9], [1, 8, 7], [2, 9, 8], [7, 8, 9],
        [0, 9, 3], [9, 2, 3], [0, 3, 4], [0, 4, 5], [0, 5, 6],
        [1, 7, 6], [7, 0, 6],
    ]  # fmt: skip
    assert forest.level.tolist() == [1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0]
    assert forest.root.tolist() == [0, 0, 0, 0, 1, 1, 2, 3, 4, 5, 5]


def test_angles_stay_at_thirty_degrees_at_any_depth():
    points0 = np.array([[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(0.75), 0], [1.5, np.sqrt(0.75), 0]])
    forest = RedGreenForest([[0, 1, 2], [2, 1, 3]])
    for _ in range(25):
        forest.split(np.flatnonzero((forest.triangles == 1).any(axis=1)))
    assert forest.level.max() == 25
    coarse = forest.triangles[forest.level < 20]  # the finest are too small for their angles to be computed
    assert smallest_angles(forest.weights @ points0, coarse).min() == pytest.approx(30, abs=1e-4)
    assert (forest.barycentric.sum(axis=1) == 1).all()


def test_the_deepest_level_is_where_weights_stop_being_exact():
    forest = RedGreenForest([[0, 1, 2]])
    for _ in range(60):
        forest.split(np.flatnonzero((forest.triangles == 0).any(axis=1)))
    assert forest.level.max() == forest.max_level == 52
    assert (forest.barycentric.sum(axis=1) == 1).all()
    assert forest.barycentric[forest.barycentric > 0].min() == 2.0**-52


@settings(max_examples=30)
@given(meshes(), operations, st.integers(0, 3))
def test_no_triangle_exceeds_the_cap(mesh, steps, cap):
    _, base = mesh
    forest = RedGreenForest(base, max_level=cap)
    for step in steps:
        apply(forest, step)
        assert forest.level.max() <= cap
    if cap == 0:
        assert (forest.triangles == base).all()


def test_only_the_capped_triangles_are_passed_over():
    forest = RedGreenForest([[0, 1, 2], [3, 4, 5]], max_level=1)
    forest.split([0])
    forest.split(np.ones(len(forest.triangles), bool))
    assert np.bincount(forest.root).tolist() == [4, 4]


def test_breathing_needs_no_more_memory():
    _, base = cloud(30, np.random.default_rng(3))
    forest = RedGreenForest(base)
    for _ in range(2):  # the second time around, freed rows leave more to spare
        forest.split(np.arange(5))
        refined_once = forest.triangles
        take_back_all(forest)
    held = nbytes(forest)
    for _ in range(50):
        forest.split(np.arange(5))
        assert (forest.triangles == refined_once).all()
        take_back_all(forest)
    assert nbytes(forest) == held


def nbytes(forest):
    """Bytes of all arrays that a forest holds, those of views only once."""
    arrays = {id(a if a.base is None else a.base): a for a in vars(forest).values() if isinstance(a, np.ndarray)}
    return sum((a if a.base is None else a.base).nbytes for a in arrays.values())


@pytest.mark.parametrize("levels", [0, 1, 3])
def test_a_triangle_takes_at_most_200_bytes(levels):
    """All that the allocator hands out and the forest keeps, spare rows included; it grows in proportion to m."""

    def grown():
        forest = RedGreenForest(base)
        for _ in range(levels):
            forest.split(np.ones(len(forest.triangles), bool))
        while len(forest.triangles) < 60_000:
            forest.split(np.arange(len(forest.triangles) // 10))
        return forest

    _, base = square(int(np.sqrt(25_000 / 4**levels)))
    grown()  # compiles
    tracemalloc.start()
    forest = grown()
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert 60_000 <= len(forest.triangles) < 90_000
    assert nbytes(forest) <= held <= 200 * len(forest.triangles)


def test_snapshots_survive_later_changes_and_cannot_be_written():
    forest = RedGreenForest([[0, 1, 2], [2, 1, 3]])
    forest.split([0, 1])
    arrays = [forest.triangles, forest.corners, forest.barycentric, forest.level, forest.host, forest.parents]
    copies = [a.copy() for a in arrays]
    forest.split([3])
    forest.coarsen(np.ones(len(forest.triangles), bool))
    forest.coarsen(np.ones(len(forest.triangles), bool))
    assert all((a == b).all() for a, b in zip(arrays, copies, strict=True))
    with pytest.raises(ValueError, match="read-only"):
        forest.triangles[0, 0] = 5
    with pytest.raises(ValueError, match="read-only"):
        forest.barycentric[0, 0] = 5


def test_bools_and_indices_mark_the_same():
    _, base = cloud(30, np.random.default_rng(3))
    index = np.array([7, 3, 3, 0])
    bools = np.zeros(len(base), bool)
    bools[index] = True
    by_index, by_bools, unmarked = (RedGreenForest(base) for _ in range(3))
    for forest, marks in ((by_index, index), (by_bools, bools), (unmarked, [])):
        forest.split(marks)
    assert (by_index.triangles == by_bools.triangles).all()
    assert (unmarked.triangles == base).all()


def test_vertices_without_triangles_are_kept():
    forest = RedGreenForest([[0, 1, 2]], n_points=5)
    forest.split([0])
    assert forest.weights.shape == (8, 5)
    assert forest.host.tolist() == [0, 0, 0, -1, -1, 0, 0, 0]
    assert forest.triangles.tolist() == [[0, 5, 7], [1, 6, 5], [2, 7, 6], [5, 6, 7]]


@pytest.mark.parametrize(
    ("triangles", "n_points", "reason"),
    [
        ([[0, 1]], None, "shape"),
        (np.empty((0, 3), int), None, "shape"),
        ([0, 1, 2], None, "shape"),
        ([[0.0, 1.0, 2.0]], None, "integers"),
        ([[0, 1, -2]], None, "received -2 to 1"),
        ([[0, 1, 2], [3, 4, 3]], None, "triangle 1"),
        ([[0, 1, 2**31]], None, "vertices 0 to"),
        ([[0, 1, 3]], 3, "vertices 0 to 2"),
    ],
)
def test_malformed_triangles(triangles, n_points, reason):
    with pytest.raises(MeshError, match=reason):
        RedGreenForest(triangles, n_points=n_points)


@pytest.mark.parametrize("level", [-1, 53, float("nan"), "deep"])
def test_levels_out_of_range(level):
    with pytest.raises(ParameterError, match="max_level"):
        RedGreenForest([[0, 1, 2]], max_level=level)


@pytest.mark.parametrize("marked", [[True], [True, False, True], [[0]], [0.0], [2], [-1], ["a"], np.zeros(0, bool)])
def test_malformed_marks(marked):
    forest = RedGreenForest([[0, 1, 2], [2, 1, 3]])
    for method in (forest.split, forest.coarsen):
        with pytest.raises(MeshError, match="mark"):
            method(marked)
