"""Charts are one-to-one and reproduce planes; values are interpolated linearly in them."""

from __future__ import annotations

import numpy as np
from squares import signed_areas, square

from tools.build_head.chart import Chart, mean_value_chart


def test_mean_value_chart_reproduces_a_plane() -> None:
    plane, triangles = square(8)
    rim = np.flatnonzero(((plane == 0.0) | (plane == 1.0)).any(axis=1))
    points = np.column_stack([plane, 2.0 * plane[:, 0] - plane[:, 1]])
    skew = points @ [[1.0, 0.0], [0.3, 1.0], [0.0, 0.0]]
    chart = mean_value_chart(points @ np.eye(3), triangles, [rim, rim], [plane[rim, 0], plane[rim, 1]])
    np.testing.assert_allclose(chart, plane, atol=1e-12)
    assert skew.shape == chart.shape


def test_mean_value_chart_is_one_to_one_on_a_folded_surface() -> None:
    plane, triangles = square(24)
    rim = np.flatnonzero(((plane == 0.0) | (plane == 1.0)).any(axis=1))
    bump = np.exp(-40.0 * ((plane - 0.5) ** 2).sum(axis=1))
    points = np.column_stack([plane[:, 0] + 0.8 * bump, plane[:, 1], 2.0 * bump])
    chart = mean_value_chart(points, triangles, [rim, rim], [plane[rim, 0], plane[rim, 1]])
    assert signed_areas(plane=chart, triangles=triangles).min() > 0.0


def test_chart_interpolates_linear_functions_exactly() -> None:
    plane, triangles = square(10)
    chart = Chart(plane, triangles, plane @ [[1.0, 2.0], [3.0, -1.0]])
    at = np.random.default_rng(0).random((500, 2))
    np.testing.assert_allclose(chart(at), at @ [[1.0, 2.0], [3.0, -1.0]], atol=1e-12)


def test_what_pulls_more_gets_less_room() -> None:
    plane, triangles = square(16)
    rim = np.flatnonzero(((plane == 0.0) | (plane == 1.0)).any(axis=1))
    points = np.column_stack([plane, np.zeros(len(plane))])
    pull = np.where(plane[:, 0] < 0.5, 1.0, 9.0)
    chart = mean_value_chart(points, triangles, [rim, rim], [plane[rim, 0], plane[rim, 1]], pull)
    assert signed_areas(chart, triangles).min() > 0.0
    inside = (plane[:, 0] == 0.5) & (np.abs(plane[:, 1] - 0.5) < 0.2)
    assert (chart[inside, 0] > 0.55).all()
