"""Moving least squares: reproduction of polynomials, interpolation, the printed equations as oracle, degeneracy."""

import math
import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from facewrinkle.errors import FaceWrinkleWarning, FitWarning
from facewrinkle.geometry import closest_rotations, least_squares, rigid_motion
from facewrinkle.geometry.least_squares import monomials, moving_least_squares


def cloud(n, d, seed=0):
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (n, d))


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("degree", [0, 1, 2, 3])
@pytest.mark.parametrize("origin", [0.0, 1e3])
@pytest.mark.parametrize("epsilon", [0.0, 0.3])
def test_reproduces_polynomials_of_its_degree(d, degree, origin, epsilon):
    points, x = cloud(60, d), cloud(40, d, 1)
    coefficients = np.random.default_rng(2).normal(size=math.comb(d + degree, degree))
    values, truth = (monomials(a, degree) @ coefficients for a in (points, x))
    found = moving_least_squares(x + origin, points + origin, values, degree, epsilon)
    # Coordinates at 1000 are themselves only known to 1e-13.
    assert np.abs(found - truth).max() < 1e-10


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_interpolates_without_epsilon(degree):
    points = cloud(50, 2)
    values = np.sin(5.0 * points[:, 0]) + points[:, 1] ** 3
    assert np.array_equal(moving_least_squares(points, points, values, degree), values)
    for step in (1e-7, 1e-12):  # without a warning: warnings are errors here
        near = moving_least_squares(points + step, points, values, degree)
        assert np.abs(near - values).max() < 100.0 * step + 1e-9
    assert np.abs(moving_least_squares(points, points, values, degree, 0.5) - values).max() > 0.01


def test_equals_the_printed_equations_near_the_origin():
    points, x, values, epsilon = cloud(30, 2), cloud(20, 2, 1), cloud(30, 1, 2)[:, 0], 0.2
    b, at = monomials(points, 2), monomials(x, 2)
    weight = 1.0 / (((x[:, None] - points) ** 2).sum(axis=2) + epsilon**2)
    a = np.einsum("qn,ni,nj->qij", weight, b, b)
    c = np.linalg.solve(a, np.einsum("qn,ni,n->qi", weight, b, values)[..., None])[..., 0]
    assert moving_least_squares(x, points, values, 2, epsilon) == pytest.approx((at * c).sum(axis=1), abs=1e-11)


def test_degree_zero_stays_between_the_values_and_higher_degrees_do_not():
    points, x = cloud(30, 2), cloud(400, 2, 1) * 1.5
    values = (np.arange(30) % 5 == 0).astype(float)
    flat = moving_least_squares(x, points, values, 0)
    assert 0.0 <= flat.min() < flat.max() <= 1.0
    assert moving_least_squares(x, points, values, 1).min() < 0.0


def test_points_on_a_line_fall_back_to_a_lower_degree():
    t = np.linspace(0.0, 1.0, 9)
    points = np.stack([t, 2.0 * t], axis=1)
    with pytest.warns(FitWarning, match="at 2 of 2 places"):
        found = moving_least_squares([[0.3, 0.6], [0.5, 0.0]], points, np.full(9, 4.0), 2)
    assert found == pytest.approx([4.0, 4.0])
    assert issubclass(FitWarning, FaceWrinkleWarning)
    with pytest.warns(FitWarning):
        assert moving_least_squares([[0.3]], [[0.0], [1.0]], [1.0, 2.0], 5) == pytest.approx(1.3)  # linear is left
    with warnings.catch_warnings(action="error"):
        moving_least_squares([[0.3, 0.6]], points, np.full(9, 4.0), 0)


@pytest.mark.parametrize("degree", [2, 4])
def test_the_corners_of_a_square_determine_a_linear_function(degree):
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    x = cloud(7, 2) + 3.0
    with pytest.warns(FitWarning, match=f"degree {degree} at 7 of 7 places"):
        found = moving_least_squares(x, corners, corners @ [2.0, -3.0] + 5.0, degree)
    assert found == pytest.approx(x @ [2.0, -3.0] + 5.0, abs=1e-10)


@pytest.mark.parametrize("unit", [1e-6, 1e6])
@pytest.mark.parametrize("epsilon", [0.0, 0.3])
def test_the_unit_of_length_does_not_matter(unit, epsilon):
    points, x, values = cloud(40, 2), cloud(20, 2, 1), cloud(40, 1, 2)[:, 0]
    expected = moving_least_squares(x, points, values, 3, epsilon)
    found = moving_least_squares(unit * x, unit * points, values, 3, unit * epsilon)
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-8)


def test_every_place_is_fitted_by_itself(monkeypatch):
    points, values = cloud(30, 2), cloud(30, 1, 2)[:, 0]
    x = np.concatenate([cloud(12, 2, 1), points[:1] + 1e-13, points[1:2]])  # and next to a point, and on one
    together = moving_least_squares(x, points, values, 2)
    alone = [moving_least_squares(x[i : i + 1], points, values, 2)[0] for i in range(len(x))]
    assert together == pytest.approx(alone, rel=1e-10, abs=1e-10)
    for block in (1, 30 * 6 * 5):  # one at a time, and five
        monkeypatch.setattr(least_squares, "BLOCK", block)
        assert moving_least_squares(x, points, values, 2) == pytest.approx(alone, rel=1e-10, abs=1e-10)
        with pytest.warns(FitWarning, match="degree 2 at 13 of 14 places") as caught:  # on a point nothing is fitted
            moving_least_squares(x, points[:4], values[:4], 2)
        assert len(caught) == 1
        assert str(caught[0].message).endswith("or ask for a lower degree.")


# --- rotations and shifts between two sets of points ----------------------------------------------


def test_rotations_are_those_of_scipy():
    x, y = np.random.default_rng(0).normal(size=(2, 20, 3))
    assert np.allclose(closest_rotations(x.T @ y).T, Rotation.align_vectors(y, x)[0].as_matrix(), atol=1e-12)


def test_batches_are_as_one_at_a_time():
    covariances = np.random.default_rng(1).normal(size=(2, 5, 3, 3))
    turns = closest_rotations(covariances)
    assert turns.shape == (2, 5, 3, 3)
    assert np.allclose(np.linalg.det(turns), 1.0)
    assert np.allclose(turns[1, 2], closest_rotations(covariances[1, 2]), atol=1e-14)


def test_mirrored_points_are_not_mirrored_back():
    x = np.random.default_rng(2).normal(size=(20, 3))
    assert np.isclose(np.linalg.det(closest_rotations(x.T @ (x * [-1.0, 1.0, 1.0]))), 1.0)


def test_points_that_moved_otherwise_do_not_count():
    rng = np.random.default_rng(3)
    rest = rng.normal(size=(200, 3))
    turn, shift = Rotation.from_rotvec([0.1, 0.2, -0.3]).as_matrix(), np.array([5.0, -2.0, 1.0])
    now = rest @ turn.T + shift
    now[:30] += rng.normal(size=(30, 3))
    pose = rigid_motion(rest, now, 1e-3)
    assert np.allclose(pose[:3, :3], turn, atol=1e-4)
    assert np.allclose(pose[:3, 3], shift, atol=1e-4)
