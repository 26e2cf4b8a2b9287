"""Meshes in charts reach their count, keep their topology, and are Delaunay when flat."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay
from squares import signed_areas, square

from facewrinkle.geometry.topology import euler_characteristic, is_oriented
from tools.build_head.chart import Chart, mean_value_chart
from tools.build_head.chart_mesh import FIXED, FREE, ON_LINE, ChartMesh


def chart_mesh(height: float = 0.0, size: float = 0.1) -> ChartMesh:
    plane, triangles = square(32)
    z = height * np.sin(3.0 * plane[:, 0]) * np.cos(2.0 * plane[:, 1])
    chart = Chart(plane, triangles, np.column_stack([plane, z, np.full(len(plane), size)]))
    return ChartMesh(chart, *square(3), *kinds_and_lines(square(3)[0]), set())


def kinds_and_lines(plane: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices of a square: its corners are fixed, those of a side stay on it."""
    on_x, on_y = np.isin(plane, (0.0, 1.0)).T
    kind = np.where(on_x & on_y, FIXED, np.where(on_x | on_y, ON_LINE, FREE))
    return kind, np.where(on_x[:, None], (0.0, 1.0), (1.0, 0.0))


def rim_of(plane: np.ndarray) -> np.ndarray:
    return np.flatnonzero(np.isin(plane, (0.0, 1.0)).any(axis=1))


@pytest.mark.parametrize("count", [100, 101, 256, 257])
def test_refine_reaches_the_count_and_keeps_the_topology(count: int) -> None:
    mesh = chart_mesh(height=0.2)
    mesh.refine(count)
    assert len(mesh.triangles) == count
    assert is_oriented(mesh.triangles)
    assert euler_characteristic(mesh.triangles) == 1
    areas = signed_areas(mesh.plane, mesh.triangles)
    assert areas.min() > 0.0
    assert areas.sum() == pytest.approx(1.0, abs=1e-12)
    assert np.degrees(mesh.smallest_angles().min()) > 20.0


def test_coarsening_reaches_the_wished_size_and_keeps_shape_and_lines() -> None:
    plane, triangles = square(24)
    z = 0.2 * np.sin(3.0 * plane[:, 0])
    chart = Chart(plane, triangles, np.column_stack([plane, z, np.full(len(plane), 0.3)]))
    mesh = ChartMesh(chart, plane.copy(), triangles.copy(), *kinds_and_lines(plane), set(), {30: 31, 55: 56})
    mesh.coarsen()
    # An edge of 0.3 makes about 2 / (sqrt(3) / 2 * 0.3^2) = 26 triangles of the unit square; collapsing stops before.
    assert 26 <= len(mesh.triangles) < 120
    areas = signed_areas(mesh.plane, mesh.triangles)
    assert areas.min() > 0.0
    assert areas.sum() == pytest.approx(1.0, abs=1e-12)
    assert {(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)} <= set(map(tuple, mesh.plane.tolist()))
    assert (np.unique(mesh.triangles) == np.arange(len(mesh.plane))).all()
    assert mesh.renumbered[30] == mesh.renumbered[55] == -1


def test_flips_give_the_delaunay_triangulation_in_the_plane() -> None:
    mesh = chart_mesh()
    random = np.random.default_rng(3)
    inner = mesh.kind == FREE
    mesh.plane = mesh.plane + np.where(inner[:, None], random.uniform(-0.1, 0.1, mesh.plane.shape), 0.0)
    rim = mesh.kind == ON_LINE
    mesh.plane = mesh.plane + np.where(rim[:, None], mesh.line * random.uniform(-0.1, 0.1, (len(rim), 1)), 0.0)
    mesh.points = np.column_stack([mesh.plane, np.zeros(len(mesh.plane))])
    mesh.flip()
    ours = {tuple(sorted(t)) for t in mesh.triangles.tolist()}
    assert ours == {tuple(sorted(t)) for t in Delaunay(mesh.plane).simplices.tolist()}


def test_fixed_vertices_and_kept_edges_stay() -> None:
    mesh = chart_mesh(height=0.3)
    kept = tuple(sorted(mesh.triangles[0, :2].tolist()))
    mesh.kept = {kept}
    fixed = np.flatnonzero(mesh.kind == FIXED)
    before = mesh.plane[fixed].copy()
    mesh.refine(150)
    assert (mesh.plane[fixed] == before).all()
    assert any(set(kept) <= set(t) for t in mesh.triangles.tolist())
    on_line = mesh.plane[mesh.kind == ON_LINE]
    assert np.abs(on_line - np.round(on_line)).min(axis=1).max() < 1e-12


# --- charts ---------------------------------------------------------------------------------------


def test_mean_value_chart_reproduces_a_plane() -> None:
    plane, triangles = square(8)
    rim = rim_of(plane)
    points = np.column_stack([plane, 2.0 * plane[:, 0] - plane[:, 1]])
    chart = mean_value_chart(points, triangles, [rim, rim], [plane[rim, 0], plane[rim, 1]])
    np.testing.assert_allclose(chart, plane, atol=1e-12)


def test_mean_value_chart_is_one_to_one_on_a_folded_surface() -> None:
    plane, triangles = square(24)
    rim = rim_of(plane)
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
    rim = rim_of(plane)
    points = np.column_stack([plane, np.zeros(len(plane))])
    pull = np.where(plane[:, 0] < 0.5, 1.0, 9.0)
    chart = mean_value_chart(points, triangles, [rim, rim], [plane[rim, 0], plane[rim, 1]], pull)
    assert signed_areas(chart, triangles).min() > 0.0
    inside = (plane[:, 0] == 0.5) & (np.abs(plane[:, 1] - 0.5) < 0.2)
    assert (chart[inside, 0] > 0.55).all()
