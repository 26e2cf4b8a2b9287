"""Values carried to a refined mesh.

what                checked against
carried             the sparse product of the forest's weights
barycentric         the weights that points were made of; beside a triangle, weights of a point in it
nearest_values     the value of the heaviest corner, one by one
height_above       each triangle against each line, one by one
split_vertices      every corner keeps its vertex and its value; no two copies of a vertex have one value
refined_values      values that are linear in the plane on each side of a seam: their closed form

Closest points.

what                 checked against
closest_point        BoxTree
BoxTree              VTK's locator, one place after the other, on small and large triangles in any order
degenerate triangle  the segment or point that it is
"""

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given, settings
from hypothesis import strategies as st
from small_meshes import square

from facewrinkle.geometry import (
    BoxTree,
    RedGreenForest,
    barycentric,
    closest_point,
    height_above,
    interpolated,
    nearest_values,
    refined_values,
    split_vertices,
    surface_samples,
)


@pytest.fixture(scope="module")
def refined_ball():
    ball = pv.Icosphere(nsub=1).clean()
    forest = RedGreenForest(ball.regular_faces)
    rng = np.random.default_rng(6)
    for _ in range(4):
        forest.split(rng.random(len(forest.triangles)) < 0.3)
    return np.asarray(ball.points, dtype=np.float64), forest


def test_carried_is_the_product_with_the_weights(refined_ball):
    points, forest = refined_ball
    values = np.random.default_rng(1).normal(size=(len(points), 5))
    assert len(forest.corners) > 2 * len(points)
    np.testing.assert_allclose(
        interpolated(values, forest.corners, forest.barycentric), forest.weights @ values, atol=1e-14
    )


def test_base_vertices_keep_their_values_to_the_last_bit(refined_ball):
    points, forest = refined_ball
    values = (
        np.random.default_rng(1).normal(size=(len(points), 2)) * 10.0 ** np.arange(-6, 6, 12 / len(points))[:, None]
    )
    assert np.array_equal(interpolated(values, forest.corners, forest.barycentric)[: len(points)], values)


def test_labels_come_from_the_heaviest_corner(refined_ball):
    points, forest = refined_ball
    labels = np.arange(len(points)) * 3
    out = nearest_values(labels, forest.corners, forest.barycentric)
    assert out.dtype == labels.dtype
    for value, corners, weights in zip(out, forest.corners, forest.barycentric, strict=True):
        share = {}
        for corner, weight in zip(corners, weights, strict=True):
            share[corner] = share.get(corner, 0.0) + weight
        assert share[value // 3] == max(share.values())
    names = np.array([f"v{i}" for i in range(len(points))])
    assert nearest_values(names, forest.corners, forest.barycentric)[: len(points)].tolist() == names.tolist()


def test_barycentric_finds_the_weights_that_points_were_made_of():
    rng = np.random.default_rng(3)
    corners, weights = rng.normal(size=(200, 3, 3)), rng.dirichlet((1.0, 1.0, 1.0), 200)
    points = (weights[..., None] * corners).sum(axis=1)
    np.testing.assert_allclose(barycentric(points, corners), weights, atol=1e-9)
    beside = barycentric(points + rng.normal(size=(200, 3)), corners)
    assert (beside >= 0.0).all()
    np.testing.assert_allclose(beside.sum(axis=1), 1.0)


def test_heights_above_are_those_of_the_highest_triangle():
    """Two wavy sheets, one over a part of the other, below lines in a slanted direction; both may be out of reach."""
    rng, deep = np.random.default_rng(4), 0.6
    sheet = pv.Plane(i_size=4.0, j_size=3.0, i_resolution=9, j_resolution=7).triangulate()
    low, high = (np.array(sheet.points, dtype=np.float64) for _ in range(2))
    low[:, 2] = 0.2 * np.sin(3.0 * low[:, 0] + low[:, 1])
    high = high * [0.5, 0.5, 0.0] + [0.3, 0.2, 0.5]
    points = np.vstack([low, high])
    triangles = np.vstack([sheet.regular_faces, sheet.regular_faces + len(low)])
    ahead = np.array([0.2, -0.3, 1.0]) / np.linalg.norm([0.2, -0.3, 1.0])
    below = rng.uniform([-2.2, -1.7, -0.7], [2.2, 1.7, 0.3], (80, 3))
    expected = np.full(len(below), -np.inf)
    for i, place in enumerate(below):
        for a, b, c in points[triangles]:
            if np.cross(b - a, c - a) @ ahead > 0.0:
                v, w, rise = np.linalg.solve(np.stack([b - a, c - a, -ahead], axis=1), place - a)
                if min(v, w, 1.0 - v - w) >= -0.02 and abs(rise) < deep:
                    expected[i] = max(expected[i], rise)
    found = height_above(below, np.tile(ahead, (len(below), 1)), (points, triangles), deep)
    assert 20 < np.isfinite(expected).sum() < 75
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_samples_are_spread_by_area():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 5], [3, 0, 5], [0, 3, 5]])
    triangles = np.array([[0, 1, 2], [3, 4, 5]])
    cloud = surface_samples(points, triangles, 5000)
    on_large = cloud[:, 2] > 2.5
    assert on_large.mean() == pytest.approx(0.9, abs=1e-3)
    np.testing.assert_allclose(cloud[on_large].mean(axis=0), [1, 1, 5], atol=0.01)
    assert (cloud[on_large][:, :2].sum(axis=1) <= 3.0 + 1e-12).all()
    assert np.array_equal(cloud, surface_samples(points, triangles, 5000))


@pytest.mark.parametrize("count", [400, 4000])
def test_each_quarter_of_a_triangle_has_a_quarter_of_the_samples(count):
    u, v, _ = surface_samples(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]), count).T
    for part in (u > 0.5, v > 0.5, u + v < 0.5):
        assert part.mean() == pytest.approx(0.25, abs=0.02)


# --- values at the corners of triangles ------------------------------------------------------------


POINTS, TRIANGLES = 4.0 * square(4)[0], square(4)[1]


def grown(triangles, seed, passes=5):
    """A forest with triangles split here and there, some of them taken back."""
    forest, rng = RedGreenForest(triangles, 6), np.random.default_rng(seed)
    for _ in range(passes):
        forest.split(rng.random(len(forest.triangles)) < 0.2)
        forest.coarsen(rng.random(len(forest.triangles)) < 0.5)
    return forest


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4))
def test_split_vertices_have_one_value_each(seed, kinds):
    values = np.random.default_rng(seed).integers(0, kinds, (*TRIANGLES.shape, 2)) / 8.0
    before = TRIANGLES.copy()
    parts = split_vertices(TRIANGLES, values, len(POINTS))
    np.testing.assert_array_equal(TRIANGLES, before)
    np.testing.assert_array_equal(parts.origin[parts.triangles], TRIANGLES)
    np.testing.assert_array_equal(parts.values[parts.triangles], values)
    np.testing.assert_array_equal(parts.origin[: len(POINTS)], np.arange(len(POINTS)))
    several = {(int(v), *uv) for v, uv in zip(TRIANGLES.ravel(), values.reshape(-1, 2).tolist(), strict=True)}
    assert len(parts.origin) == len(several)
    assert set(range(len(parts.origin))) == set(parts.triangles.ravel().tolist())


@pytest.mark.parametrize("seed", range(4))
def test_values_on_either_side_of_a_seam_have_a_closed_form(seed):
    right = (POINTS[TRIANGLES][:, :, 0].mean(axis=1) > 2.0)[:, None, None]

    def closed_form(where, right):
        uv = where[..., :2] / 7.0
        return np.where(right, uv @ [[0.5, 1.0], [-1.0, 0.5]] + [3.0, 0.25], uv)

    forest = grown(TRIANGLES, seed)
    assert len(forest.triangles) > 3 * len(TRIANGLES)
    fine = interpolated(POINTS, forest.corners, forest.barycentric)
    values = refined_values(closed_form(POINTS[TRIANGLES], right), TRIANGLES, forest)
    sides = (fine[forest.triangles][:, :, 0].mean(axis=1) > 2.0)[:, None, None]
    np.testing.assert_allclose(values, closed_form(fine[forest.triangles], sides), atol=1e-15)
    # The sheet comes apart along x = 2 and nowhere else, each vertex on it in two.
    parts = split_vertices(forest.triangles, values, forest.n_points)
    assert sorted(parts.origin[forest.n_points :]) == np.flatnonzero(fine[:, 0] == 2.0).tolist()


@pytest.mark.parametrize("seed", range(4))
def test_without_a_seam_nothing_is_split_at_any_depth(seed):
    uv = np.random.default_rng(seed).random((len(POINTS), 2))  # not representable sums: roundings would tell
    forest = grown(TRIANGLES, seed, 9)
    assert forest.level.max() == 6
    values = refined_values(uv[TRIANGLES], TRIANGLES, forest)
    assert len(split_vertices(forest.triangles, values, forest.n_points).origin) == forest.n_points


@pytest.mark.parametrize("spread", [0.001, 0.05, 2.0])
def test_many_closest_points_are_those_of_another_library(spread):
    ball = pv.Icosphere(radius=3.0, nsub=4)
    points = np.asarray(ball.points, np.float64) ** 3  # large and small triangles, folded at the planes
    rng = np.random.default_rng(2)
    triangles = rng.permutation(ball.regular_faces)
    places = points[rng.integers(0, len(points), 500)] + rng.normal(0.0, 27.0 * spread, (500, 3))
    found, weights, distance = BoxTree(points, triangles).closest(places)
    mesh = pv.PolyData.from_regular_faces(points, triangles)
    others = np.array([mesh.find_closest_cell(place, return_closest_point=True)[1] for place in places])
    np.testing.assert_allclose(distance, np.linalg.norm(others - places, axis=1), atol=1e-12)
    on = np.einsum("nk,nki->ni", weights, points[triangles[found]])
    np.testing.assert_allclose(np.linalg.norm(on - places, axis=1), distance, atol=1e-12)
    assert weights.min() >= 0.0
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-14)
    for place, away in zip(places[:40], distance, strict=False):
        one = closest_point(points, triangles, place)
        assert one.barycentric.min() >= 0.0
        np.testing.assert_allclose(one.barycentric @ points[triangles[one.triangle]], one.point, atol=1e-12)
        assert (one.distance, np.linalg.norm(one.point - place)) == pytest.approx((away, away), abs=1e-12)


def test_without_triangles_nothing_is_close():
    assert BoxTree(np.eye(3), np.empty((0, 3), np.int32)).closest(np.zeros((2, 3)))[2].tolist() == [
        np.inf,
        np.inf,
    ]


@pytest.mark.parametrize(
    ("corners", "expected"),
    [
        ([[0.0, 0, 0], [4, 0, 0], [4, 0, 0]], [1.0, 0, 0]),
        ([[0.0, 0, 0], [0, 0, 0], [4, 0, 0]], [1.0, 0, 0]),
        ([[0.0, 0, 0], [4, 0, 0], [2, 0, 0]], [1.0, 0, 0]),
        ([[3.0, 0, 0], [3, 0, 0], [3, 0, 0]], [3.0, 0, 0]),
    ],
)
def test_degenerate_triangles_are_segments_or_points(corners, expected):
    found = closest_point(np.array(corners), np.array([[0, 1, 2]], np.int32), [1.0, 2.0, 0.0])
    np.testing.assert_allclose(found.point, expected, atol=1e-12)
    assert found.distance == pytest.approx(np.linalg.norm(np.array(expected) - [1.0, 2.0, 0.0]))
    assert not found.normal.any()
