"""Connectivity of triangle meshes, checked against dictionaries, and on surfaces of known topology; rings; orders."""

from collections import Counter, defaultdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_meshes import delaunay, enclosed_volume

from facewrinkle.errors import MeshError
from facewrinkle.geometry.topology import (
    as_triangles,
    boundary_loops,
    components,
    euler_characteristic,
    incident_triangles,
    is_oriented,
    morton_order,
    non_manifold_edges,
    oriented,
    ring_quads,
    ring_triangles,
    unique_edges,
    vertex_rings,
)


def sheet(rows, columns, wrap_rows=False, wrap_columns=False, twist=False):
    """A grid of quads cut in two; wrapped once it is a band (twisted: of Moebius), wrapped twice a torus."""
    number = np.arange(rows * columns).reshape(rows, columns)
    if wrap_rows:
        number = np.concatenate([number, number[:1, ::-1] if twist else number[:1]])
    if wrap_columns:
        number = np.concatenate([number, number[:, :1]], axis=1)
    a, b, c, d = (
        number[:-1, :-1].ravel(),
        number[1:, :-1].ravel(),
        number[1:, 1:].ravel(),
        number[:-1, 1:].ravel(),
    )
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


OCTAHEDRON = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])


@st.composite
def clouds(draw, most=40):
    """Oriented Delaunay triangles of random points, shuffled, some taken out."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    triangles = delaunay(rng.random((draw(st.integers(4, most)), 2)))
    kept = rng.random(len(triangles)) >= draw(st.sampled_from([0.0, 0.2, 0.5]))
    kept[0] = True
    return rng.permutation(triangles[kept])


@st.composite
def soups(draw):
    """Random triangles with any number on an edge."""
    n = draw(st.integers(3, 9))
    return np.array(draw(st.lists(st.permutations(range(n)).map(lambda p: p[:3]), min_size=1, max_size=25)))


def half_edges(triangles):
    return [(int(t[s]), int(t[(s + 1) % 3])) for t in triangles for s in range(3)]


@settings(max_examples=150)
@given(st.one_of(clouds(), soups()))
def test_edges_sides_and_incidence(triangles):
    edges, sides = unique_edges(triangles)
    pairs = [frozenset(h) for h in half_edges(triangles)]
    assert list(map(frozenset, edges.tolist())) == list(dict.fromkeys(pairs))
    assert [frozenset(edges[e].tolist()) for e in sides.ravel()] == pairs
    first = {pair: i for i, pair in reversed(list(enumerate(pairs)))}
    assert [tuple(e) for e in edges.tolist()] == [half_edges(triangles)[first[frozenset(e)]] for e in edges.tolist()]
    offsets, on_edge = incident_triangles(sides)
    expected = defaultdict(list)
    for h, pair in enumerate(pairs):
        expected[pair].append(h // 3)
    for e, pair in enumerate(map(frozenset, edges.tolist())):
        assert on_edge[offsets[e] : offsets[e + 1]].tolist() == expected[pair]
    counts = Counter(pairs)
    assert set(map(frozenset, non_manifold_edges(triangles).tolist())) == {
        p for p, count in counts.items() if count > 2
    }
    assert is_oriented(triangles) == all(
        len({h for h in half_edges(triangles) if frozenset(h) == p}) == 2 for p, count in counts.items() if count == 2
    )


@settings(max_examples=100)
@given(st.one_of(clouds(12), soups()))
def test_rings_components_and_euler(triangles):
    n = int(triangles.max()) + 3  # two vertices without triangles
    offsets, neighbors = vertex_rings(triangles, n)
    expected = defaultdict(set)
    for a, b in half_edges(triangles):
        expected[a].add(b)
        expected[b].add(a)
    assert [neighbors[offsets[v] : offsets[v + 1]].tolist() for v in range(n)] == [
        sorted(expected.get(v, ())) for v in range(n)
    ]
    label = components(triangles)
    assert set(label.tolist()) == set(range(label.max() + 1))
    reached = {v: {v} for v in expected}
    for a, b in half_edges(triangles):
        union = reached[a] | reached[b]
        for v in union:
            reached[v] = union
    for t, mine in zip(triangles.tolist(), label, strict=True):
        for u, other in zip(triangles.tolist(), label, strict=True):
            assert (mine == other) == (u[0] in reached[t[0]])
    edges = {frozenset(h) for h in half_edges(triangles)}
    assert euler_characteristic(triangles) == len(expected) - len(edges) + len(triangles)


@settings(max_examples=150)
@given(clouds())
def test_loops_use_every_boundary_half_edge_once(triangles):
    directed = set(half_edges(triangles))
    border = sorted(h for h in directed if h[::-1] not in directed)
    loops = boundary_loops(triangles)
    assert sorted((int(a), int(b)) for loop in loops for a, b in zip(loop, np.roll(loop, -1), strict=True)) == border
    assert all(loop[0] == loop.min() for loop in loops)


@settings(max_examples=150)
@given(clouds(), st.integers(0, 2**32 - 1))
def test_flipped_triangles_are_mended(triangles, seed):
    rng = np.random.default_rng(seed)
    flipped = np.where(rng.random((len(triangles), 1)) < 0.4, triangles[:, ::-1], triangles)
    mended = oriented(flipped)
    assert is_oriented(mended)
    assert (np.sort(mended, axis=1) == np.sort(triangles, axis=1)).all()
    turned = (mended != flipped).any(axis=1)
    assert (oriented(mended) == mended).all()
    assert turned.sum() <= len(triangles) / 2
    assert (oriented(triangles) == triangles).all()


@pytest.mark.parametrize(
    ("triangles", "euler", "n_loops"),
    [
        (OCTAHEDRON, 2, 0),
        (sheet(4, 5), 1, 1),
        (sheet(4, 5, wrap_rows=True), 0, 2),
        (sheet(4, 5, wrap_rows=True, wrap_columns=True), 0, 0),
        (np.concatenate([OCTAHEDRON, OCTAHEDRON + 6]), 4, 0),
        (np.concatenate([OCTAHEDRON[1:], sheet(3, 3) + 6]), 2, 2),
    ],
    ids=["sphere", "disk", "annulus", "torus", "two spheres", "two disks"],
)
def test_surfaces_of_known_topology(triangles, euler, n_loops):
    assert is_oriented(triangles)
    assert euler_characteristic(triangles) == euler
    assert len(boundary_loops(triangles)) == n_loops
    assert len(non_manifold_edges(triangles)) == 0


def test_loops_that_touch_in_a_vertex_stay_apart():
    # Two triangles in one vertex form one component with two fans there: each fan closes its own loop.
    assert [loop.tolist() for loop in boundary_loops([[0, 1, 2], [0, 3, 4]])] == [[0, 1, 2], [0, 3, 4]]


def test_a_moebius_band_has_no_orientation():
    band = sheet(5, 2, wrap_rows=True, twist=True)
    assert euler_characteristic(band) == 0
    assert not is_oriented(band)
    with pytest.raises(MeshError, match="one side"):
        oriented(band)
    with pytest.raises(MeshError, match="oriented"):
        boundary_loops(band)


def test_loops_of_a_book_are_refused():
    with pytest.raises(MeshError, match=r"edge \[0, 1\] has more"):
        boundary_loops([[0, 1, 2], [1, 0, 3], [0, 1, 4]])


def test_a_hub_of_many_triangles_takes_linear_time():
    n = 200_000
    rim = np.arange(n)
    for hub, shift in ((0, 1), (n, 0)):  # with the lowest and with the highest number
        fan = np.stack([np.full(n, hub), rim + shift, np.roll(rim, -1) + shift], 1)
        edges, _ = unique_edges(fan)
        assert len(edges) == 2 * n
        assert euler_characteristic(fan) == 1


def test_triangles_are_converted_once():
    given_array = np.array([[0, 1, 2]], dtype=np.int32)
    assert as_triangles(given_array) is given_array
    assert as_triangles([[0, 1, 2]]).dtype == np.int32


# --- rings of points -------------------------------------------------------------------------------


def circles(n, radii, heights):
    """Regular polygons (rings * n, 3) about the z-axis, counter-clockwise seen from above."""
    turn = 2.0 * np.pi * np.arange(n) / n
    circle = np.stack([np.cos(turn), np.sin(turn), np.zeros(n)], axis=1)
    return np.concatenate([radius * circle + [0.0, 0.0, z] for radius, z in zip(radii, heights, strict=True)])


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("start", [0, 5])
def test_quads_join_neighbors_of_two_rings(closed, start):
    n, rings = 7, 4
    quads = ring_quads(n, rings, closed=closed, start=start)
    assert len(quads) == (rings - 1) * (n if closed else n - 1)
    ring, place = np.divmod(quads - start, n)
    np.testing.assert_array_equal(ring - ring[:, :1], np.tile([0, 0, 1, 1], (len(quads), 1)))
    np.testing.assert_array_equal(place[:, 1], (place[:, 0] + 1) % n)
    np.testing.assert_array_equal(place[:, [3, 2]], place[:, [0, 1]])
    assert len(np.unique(quads, axis=0)) == len(quads)


@pytest.mark.parametrize("diagonal", ["bd", "ac"])
@pytest.mark.parametrize(
    "options, loops, characteristic",
    [
        ({}, 2, 0),
        ({"closed": False}, 1, 1),
        ({"first": 28}, 1, 1),
        ({"last": 28}, 1, 1),
        ({"first": 28, "last": 29}, 0, 2),
    ],
)
def test_tubes_strips_cups_and_closed_surfaces(diagonal, options, loops, characteristic):
    triangles = ring_triangles(7, 4, diagonal=diagonal, **options)
    assert triangles.dtype == np.int32
    assert is_oriented(triangles)
    assert not len(non_manifold_edges(triangles))
    assert len(boundary_loops(triangles)) == loops
    assert euler_characteristic(triangles) == characteristic


@pytest.mark.parametrize("diagonal", ["bd", "ac"])
def test_triangles_face_out(diagonal):
    n = 9
    area = 0.5 * n * np.sin(2.0 * np.pi / n)
    prism = np.vstack([circles(n, (1.0, 1.0), (0.0, 3.0)), [[0.0, 0.0, 0.0], [0.0, 0.0, 3.0]]])
    assert enclosed_volume(
        prism, ring_triangles(n, 2, first=2 * n, last=2 * n + 1, diagonal=diagonal)
    ) == pytest.approx(3.0 * area)
    # A double cone, whose tip comes before its rings.
    spindle = np.vstack([[[0.0, 0.0, -1.0]], circles(n, (1.0, 1.0), (0.0, 0.0)), [[0.0, 0.0, 2.0]]])
    triangles = ring_triangles(n, 2, start=1, first=0, last=2 * n + 1, diagonal=diagonal)
    assert enclosed_volume(spindle, triangles) == pytest.approx(area)


def test_the_diagonal_runs_where_it_is_said():
    edges = {tuple(sorted(edge)) for edge in unique_edges(ring_triangles(5, 2))[0].tolist()}
    others = {tuple(sorted(edge)) for edge in unique_edges(ring_triangles(5, 2, diagonal="ac"))[0].tolist()}
    for a, b, c, d in ring_quads(5, 2).tolist():
        assert tuple(sorted((b, d))) in edges - others
        assert tuple(sorted((a, c))) in others - edges


# --- orders ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("axes", [2, 3])
def test_cells_of_a_block_follow_each_other(axes):
    cells = np.stack(np.meshgrid(*[np.arange(8)] * axes, indexing="ij"), axis=-1).reshape(-1, axes)
    cells = np.random.default_rng(0).permutation(cells)
    order = morton_order(cells, bits=3)
    assert np.array_equal(np.sort(order), np.arange(len(cells)))
    for size in (2, 4):
        blocks = (cells[order] // size).reshape(-1, size**axes, axes)
        assert (blocks == blocks[:, :1]).all()


def test_equal_cells_keep_their_order():
    assert morton_order(np.zeros((5, 2), np.int64), bits=4).tolist() == [0, 1, 2, 3, 4]
