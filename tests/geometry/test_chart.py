"""Charts: flat coordinates on curved surfaces.

what                   checked against
geodesic_chart         the plane, exactly; cylinder and sphere in closed form, their convergence; rigid motions; reach
smoothed               linear functions, exactly; noise
gradients              affine functions
smoothly_interpolated  quadratic functions, exactly
"""

import numpy as np
import pytest
import pyvista as pv
from small_meshes import arrays

from facewrinkle.geometry import RedGreenForest, closest_point, interpolated
from facewrinkle.geometry.chart import (
    geodesic_chart,
    gradients,
    smoothed,
    smoothly_interpolated,
    tangents,
)


def sheet(n, jitter=0.25, seed=0, size=10.0):
    """An uneven triangulation of a square in the plane z = 0."""
    points, triangles = arrays(pv.Plane(i_size=size, j_size=size, i_resolution=n, j_resolution=n).triangulate())
    points[:, :2] += np.random.default_rng(seed).uniform(-jitter, jitter, (len(points), 2)) * size / n
    return points, triangles


def ball(level, radius=10.0):
    points, triangles = arrays(pv.Icosphere(radius=radius, nsub=level))
    return points * (radius / np.linalg.norm(points, axis=1, keepdims=True)), triangles


@pytest.mark.parametrize("centre", [(0.3, 0.2), (-3.1, 2.2), (0.0, 0.0)])
def test_a_plane_is_laid_out_exactly(centre):
    points, triangles = sheet(14)
    start = closest_point(points, triangles, [*centre, 1.0])
    chart = geodesic_chart(points, triangles, start, [0.0, 2.0, 0.7], 20.0)
    np.testing.assert_allclose(chart, points[:, :2] - start.point[:2], atol=1e-11)


@pytest.mark.parametrize("vertex", [44, 0, 99])
def test_at_a_vertex_as_well(vertex):
    points, triangles = sheet(9)
    chart = geodesic_chart(points, triangles, closest_point(points, triangles, points[vertex]), [0, 1, 0], 20.0)
    np.testing.assert_allclose(chart, (points - points[vertex])[:, :2], atol=1e-7)


def test_a_cylinder_is_unrolled():
    centre, errors = np.array([4 * np.sin(0.3 / 4), 0.2, 4 * np.cos(0.3 / 4)]), []
    for n in (30, 60):
        flat, triangles = sheet(n)
        points = np.stack([4 * np.sin(flat[:, 0] / 4), flat[:, 1], 4 * np.cos(flat[:, 0] / 4)], axis=1)
        chart = geodesic_chart(points, triangles, closest_point(points, triangles, centre), [0, 1, 0], 20.0)
        errors.append(np.abs(chart - (flat[:, :2] - [0.3, 0.2])))
    assert errors[0].max() < 0.004 * 7.0  # chords are shorter than arcs
    assert errors[1].mean() < 0.4 * errors[0].mean()  # and with half the edges they converge quadratically


def logarithm(points, direction, up, radius=10.0):
    """The logarithmic map of a sphere, in closed form."""
    right, upward = tangents(direction, up)
    arc = np.arccos(np.clip(points @ direction / radius, -1, 1))
    along = points - (points @ direction)[:, None] * direction
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    return radius * arc[:, None] * np.stack([along @ right, along @ upward], axis=1)


def test_a_sphere_in_closed_form():
    direction = np.array([0.3, 0.2, 0.9]) / np.linalg.norm([0.3, 0.2, 0.9])
    means = []
    for level in (2, 3, 4, 5):
        points, triangles = ball(level)
        chart = geodesic_chart(points, triangles, closest_point(points, triangles, 10 * direction), [0, 1, 0], 12.0)
        expected = logarithm(points, direction, [0, 1, 0])
        error = np.linalg.norm(chart - expected, axis=1)[np.linalg.norm(expected, axis=1) < 10.0]
        assert error.max() < 0.06 * 10.0
        means.append(error.mean())
    assert means[-1] < 0.002 * 10.0
    assert (np.diff(np.log2(means)) < 0.2).all()
    assert means[-1] < 0.12 * means[0]


def test_what_is_out_of_reach_is_nan():
    points, triangles = sheet(12)
    chart = geodesic_chart(points, triangles, closest_point(points, triangles, [0, 0, 0]), [0, 1, 0], 2.0)
    known = np.isfinite(chart).all(axis=1)
    assert known[np.linalg.norm(points, axis=1) <= 2.0].all()
    assert not known[np.linalg.norm(points, axis=1) > 2.0].any()
    apart = np.concatenate([triangles, triangles + len(points)])
    twice = np.concatenate([points, np.add(points, [0.0, 0.0, 0.1])])
    chart = geodesic_chart(twice, apart, closest_point(twice, apart, [0, 0, -1]), [0, 1, 0], 99.0)
    assert np.isnan(chart[len(points) :]).all()


def test_smoothing_keeps_linear_functions_and_takes_noise_away():
    points, triangles = sheet(20)
    linear = points[:, :2] @ [[2.0, -1.0], [0.5, 3.0]] + 4.0
    for length in (0.1, 1.0, 5.0):
        np.testing.assert_allclose(smoothed(points, triangles, linear, length), linear, atol=1e-7)
    noise = np.random.default_rng(0).normal(size=linear.shape) * 0.1
    calm = smoothed(points, triangles, linear + noise, 1.5) - linear
    assert calm.std() < 0.25 * noise.std()
    holes = linear.copy()
    holes[points[:, 0] > 3.0] = np.nan
    out = smoothed(points, triangles, holes, 2.0)
    assert (np.isnan(out) == np.isnan(holes)).all()
    np.testing.assert_allclose(out[~np.isnan(out)], linear[~np.isnan(out)], atol=1e-9)


def test_gradients_of_affine_functions():
    points, triangles = sheet(8)
    matrix = np.array([[2.0, -1.0], [0.5, 3.0], [0.0, 0.0]])
    np.testing.assert_allclose(
        gradients(points, triangles, points @ matrix), np.tile(matrix, (len(points), 1, 1)), atol=1e-12
    )


def test_quadratic_functions_are_interpolated_exactly():
    points, triangles = sheet(5)
    forest = RedGreenForest(triangles, n_points=len(points))
    for _ in range(3):
        forest.split(np.ones(len(forest.triangles), bool))
    places = interpolated(points, forest.corners, forest.barycentric)

    def value(x):
        return np.stack([x[:, 0] ** 2 - 3 * x[:, 0] * x[:, 1], 2 * x[:, 1] ** 2 + x[:, 0]], axis=1)

    def slope(x):
        zero = np.zeros(len(x))
        first = np.stack([2 * x[:, 0] - 3 * x[:, 1], -3 * x[:, 0], zero], axis=1)
        return np.stack([first, np.stack([zero + 1.0, 4 * x[:, 1], zero], axis=1)], axis=2)

    out = smoothly_interpolated(points, value(points), slope(points), places, forest.corners, forest.barycentric)
    np.testing.assert_allclose(out, value(places), atol=1e-11)
    linear = interpolated(value(points), forest.corners, forest.barycentric)
    assert np.abs(linear - value(places)).max() > 0.5


@pytest.mark.parametrize("up", [(0, 0, 1), (0, 0, -3)])
def test_no_direction_is_left_of_one_that_points_out(up):
    right, upward = tangents(np.array([0.0, 0.0, 1.0]), up)
    assert not right.any()
    assert not upward.any()
