"""Triangles between rings of points.

what            checked against
ring_quads      its definition; the number of open sides, of strips and of tubes
ring_triangles  the Euler characteristic of tubes, cups and closed surfaces; the volume of a prism and of a double cone,
                whichever diagonal; orientation
"""

from __future__ import annotations

import numpy as np
import pytest

from facewrinkle.geometry import topology
from facewrinkle.geometry.topology import ring_quads, ring_triangles


def circles(n, radii, heights):
    """Regular polygons (rings * n, 3) about the z-axis, counter-clockwise seen from above."""
    turn = 2.0 * np.pi * np.arange(n) / n
    circle = np.stack([np.cos(turn), np.sin(turn), np.zeros(n)], axis=1)
    return np.concatenate([radius * circle + [0.0, 0.0, z] for radius, z in zip(radii, heights, strict=True)])


def volume(points, triangles):
    """Volume that a closed surface holds, negative where it faces in."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("start", [0, 5])
def test_quads_join_neighbours_of_two_rings(closed, start):
    n, rings = 7, 4
    quads = ring_quads(n, rings, closed=closed, start=start)
    assert len(quads) == (rings - 1) * (n if closed else n - 1)
    ring, place = np.divmod(quads - start, n)
    np.testing.assert_array_equal(ring - ring[:, :1], np.tile([0, 0, 1, 1], (len(quads), 1)))
    np.testing.assert_array_equal(place[:, 1], (place[:, 0] + 1) % n)
    np.testing.assert_array_equal(place[:, [3, 2]], place[:, [0, 1]])
    assert len(np.unique(quads, axis=0)) == len(quads)


def test_rings_without_points_have_no_quads_and_no_triangles():
    assert ring_quads(0, 5).shape == (0, 4)
    assert ring_triangles(0, 5).shape == (0, 3)


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
    assert topology.is_oriented(triangles)
    assert not len(topology.non_manifold_edges(triangles))
    assert len(topology.boundary_loops(triangles)) == loops
    assert topology.euler_characteristic(triangles) == characteristic


@pytest.mark.parametrize("diagonal", ["bd", "ac"])
def test_triangles_face_out(diagonal):
    n = 9
    area = 0.5 * n * np.sin(2.0 * np.pi / n)
    prism = np.vstack([circles(n, (1.0, 1.0), (0.0, 3.0)), [[0.0, 0.0, 0.0], [0.0, 0.0, 3.0]]])
    assert volume(prism, ring_triangles(n, 2, first=2 * n, last=2 * n + 1, diagonal=diagonal)) == pytest.approx(
        3.0 * area
    )
    # A double cone, whose tip comes before its rings.
    spindle = np.vstack([[[0.0, 0.0, -1.0]], circles(n, (1.0, 1.0), (0.0, 0.0)), [[0.0, 0.0, 2.0]]])
    triangles = ring_triangles(n, 2, start=1, first=0, last=2 * n + 1, diagonal=diagonal)
    assert volume(spindle, triangles) == pytest.approx(area)


def test_the_diagonal_runs_where_it_is_said():
    edges = {tuple(sorted(edge)) for edge in topology.unique_edges(ring_triangles(5, 2))[0].tolist()}
    others = {tuple(sorted(edge)) for edge in topology.unique_edges(ring_triangles(5, 2, diagonal="ac"))[0].tolist()}
    for a, b, c, d in ring_quads(5, 2).tolist():
        assert tuple(sorted((b, d))) in edges - others
        assert tuple(sorted((a, c))) in others - edges
