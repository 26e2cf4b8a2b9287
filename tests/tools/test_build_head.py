"""What makes the built-in head.

what                            checked against
Catmull-Clark subdivision       planes, bicubic B-splines, itself at other levels
meshes in charts                their count and topology; Delaunay triangulations of flat ones; rings that are kept
sky that is left open           a ball, which hides none of it, and the bottom of a cylinder, in closed form
averages over neighbors         constants, which stay, and a sum of squares, which falls
noise                           its variance, grains and seeds
"""

from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv
from scipy.spatial import Delaunay
from small_meshes import grid, signed_areas, square

from facewrinkle.anatomy.head import cage_data, load_head
from facewrinkle.geometry.normals import vertex_normals
from facewrinkle.geometry.topology import euler_characteristic, is_oriented
from tools.build_head.build import refuse_crossings
from tools.build_head.cage import subdivided
from tools.build_head.chart import Chart, mean_value_chart
from tools.build_head.chart_mesh import FIXED, FREE, ON_LINE, ChartMesh
from tools.build_head.half_cage import half_surface, lining_places, opposite_on_lips
from tools.build_head.paint import averaged, noise, openness, shaded

CUBE = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6]]
)  # open: the side 3, 0, 4, 7 is missing


@pytest.mark.parametrize("quads", [CUBE, grid(3)])
def test_weights_sum_to_one(quads: np.ndarray) -> None:
    fine = subdivided(quads, 3)
    np.testing.assert_allclose(fine.limit.sum(axis=1), 1.0, atol=1e-12)
    assert len(fine.quads) == len(quads) * 64


@pytest.mark.parametrize("quads", [CUBE, grid(4)])
def test_limit_points_do_not_depend_on_the_level(quads: np.ndarray) -> None:
    points = np.random.default_rng(0).normal(size=(quads.max() + 1, 3))
    coarse, fine = subdivided(quads, 1), subdivided(quads, 3)
    np.testing.assert_allclose(
        (coarse.limit @ points)[coarse.grids], (fine.limit @ points)[fine.grids[:, ::4, ::4]], atol=1e-12
    )


def test_regular_patch_is_the_bicubic_b_spline_and_the_boundary_a_cubic_one() -> None:
    """The boundary is that of its own points alone."""
    n, levels = 5, 3
    points = np.random.default_rng(1).normal(size=(n + 1, n + 1))
    fine = subdivided(grid(n), levels)
    limit = (fine.limit @ points.ravel())[fine.grids]
    t = np.linspace(0.0, 1.0, 2**levels + 1)
    basis = np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3]) / 6.0
    i, j = 2, 2
    exact = basis.T @ points[i - 1 : i + 3, j - 1 : j + 3] @ basis
    np.testing.assert_allclose(limit[i * n + j], exact, atol=1e-12)
    np.testing.assert_allclose(limit[1, 0], basis.T @ points[0, 0:4], atol=1e-12)


def test_grids_meet_along_shared_edges() -> None:
    fine = subdivided(grid(2), 2)
    assert (fine.grids[0, :, -1] == fine.grids[1, :, 0]).all()
    assert (fine.grids[0, -1, :] == fine.grids[2, 0, :]).all()
    assert (np.unique(fine.grids) == np.arange(fine.limit.shape[0])).all()


# --- linings of the lips --------------------------------------------------------------------------


def test_places_on_the_linings_run_from_lip_to_lip_and_inwards():
    half = half_surface(cage_data())
    places = lining_places(half)
    for ring, depth in ((3, 0.0), (4, 1.0)):
        for number in range(9):
            np.testing.assert_allclose(places[half.of(f"mouth_ring{ring}.{number}")], [number, depth], atol=1e-12)
    assert np.isnan(places[half.of("mouth_ring2.0")]).all()


def test_opposite_places_are_found_between_coarser_ones():
    upper = [[0.0, 0.0], [2.5, 0.0], [3.5, 0.0], [0.0, 1.0]]
    lower = [[4.0, 0.0], [5.0, 0.0], [5.5, 0.0], [8.0, 0.0], [8.0, 1.0]]
    rows = opposite_on_lips(np.array([*upper, *lower, [np.nan, np.nan]]))
    assert rows.tolist() == [[3, 3, 8, 8], [0, 3, 7, 7], [1, 1, 6, 6], [2, 2, 4, 5]]


def test_a_head_whose_lips_are_not_parted_is_refused():
    head = load_head()
    touching = replace(head.mold, lips=head.mold.lips[:0])
    eye = head.eyes[0]
    points = touching(np.array(list(cage_data()["points"].values())), eye.centre, eye.radius)
    with pytest.raises(ValueError, match="the head crosses itself: 114 triangles run through each other, around"):
        refuse_crossings(points, head.triangles)
    refuse_crossings(head.points, head.triangles)


# --- meshes in charts ------------------------------------------------------------------------------


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


@pytest.mark.parametrize("count", [101, *(pytest.param(count, marks=pytest.mark.slow) for count in (100, 256, 257))])
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


def test_a_ring_is_filled_with_rings_and_all_else_stays() -> None:
    plane, triangles = square(6)
    chart = Chart(plane, triangles, np.column_stack([plane, np.zeros(len(plane)), np.full(len(plane), 0.1)]))
    mesh = ChartMesh(chart, plane.copy(), triangles, *kinds_and_lines(plane), set())
    off = plane - 0.5
    rim = np.flatnonzero(np.isclose(np.abs(off).max(axis=1), 1.0 / 3.0))
    inside = np.flatnonzero(np.abs(off).max(axis=1) < 0.3)
    share = (0.25 - np.arctan2(off[rim, 1], off[rim, 0]) / (2.0 * np.pi)) % 1.0  # clockwise from the top
    rim, share = rim[np.argsort(share)], np.sort(share)
    rings = [(plane[rim], share)]
    for count, radius in ((6, 0.2), (3, 0.08)):
        turn = np.arange(count) / count
        around = np.column_stack([np.sin(2.0 * np.pi * turn), np.cos(2.0 * np.pi * turn)])
        rings.append((0.5 + radius * around, turn))
    mesh.refill(rings)
    stay = np.setdiff1d(np.arange(len(plane)), inside)
    assert (mesh.plane[stay] == plane[stay]).all()
    np.testing.assert_array_equal(mesh.plane[inside], np.vstack([places for places, _ in rings[1:]]))
    assert mesh.triangles.shape == triangles.shape
    assert is_oriented(mesh.triangles)
    areas = signed_areas(mesh.plane, mesh.triangles)
    assert areas.min() > 0.0
    assert areas.sum() == pytest.approx(1.0, abs=1e-12)
    edges = {frozenset(edge) for t in mesh.triangles.tolist() for edge in zip(t, t[1:] + t[:1], strict=True)}
    for ring in (rim, inside[:6], inside[6:]):
        assert {frozenset(edge) for edge in zip(ring.tolist(), np.roll(ring, -1).tolist(), strict=True)} <= edges
    with pytest.raises(ValueError, match="the rings must hold 9 vertices, not 6"):
        mesh.refill(rings[:2])


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


# --- the painter -----------------------------------------------------------------------------------


def test_a_ball_sees_the_whole_sky():
    ball = pv.Icosphere(radius=60.0, nsub=5)
    points, triangles = np.asarray(ball.points, dtype=np.float64), ball.regular_faces
    assert openness(points, vertex_normals(points, triangles), points).min() > 0.99


@pytest.mark.parametrize("height", [30.0, 60.0])
def test_the_bottom_of_a_cylinder_sees_the_sky_through_its_top(height):
    """Weighted by slope, a share of sin^2 of the angle between the axis and the edge of the top is open."""
    radius = 30.0
    turn, up = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 200), np.linspace(0.0, height, 50))
    wall = np.stack([radius * np.cos(turn.ravel()), radius * np.sin(turn.ravel()), up.ravel()], axis=1)
    sky = openness(np.zeros((1, 3)), np.array([[0.0, 0, 1]]), wall)[0]
    assert sky == pytest.approx(radius**2 / (radius**2 + height**2), abs=0.1)


def test_averages_keep_constants_and_smooth():
    ball = pv.Icosphere(radius=1.0, nsub=3)
    triangles, values = ball.regular_faces, np.random.default_rng(0).normal(size=ball.n_points)
    np.testing.assert_allclose(averaged(np.ones(ball.n_points), triangles, 3), 1.0, atol=1e-12)
    once, twice = averaged(values, triangles, 1), averaged(values, triangles, 2)
    assert (values**2).sum() > 2.0 * (once**2).sum() > 2.0 * (twice**2).sum()
    np.testing.assert_allclose(averaged(once, triangles, 1), twice, atol=1e-12)


def test_noise_has_grains_of_its_size():
    places = np.random.default_rng(1).uniform(-100.0, 100.0, (4000, 3))
    values = noise(places, 5.0, 1)
    assert values.std() == pytest.approx(1.0, abs=0.25)
    assert np.array_equal(values, noise(places, 5.0, 1))
    assert abs(np.corrcoef(values, noise(places, 5.0, 2))[0, 1]) < 0.1
    near, far = (np.corrcoef(values, noise(places + np.array([d, 0.0, 0.0]), 5.0, 1))[0, 1] for d in (1.0, 20.0))
    assert near > 0.9
    assert abs(far) < 0.1


def test_light_that_is_kept_out_leaves_red():
    skin = np.tile([200.0, 150.0, 130.0], (3, 1))
    lit, half, dark = shaded(skin, np.array([1.0, 0.5, 0.0]))
    assert np.array_equal(lit, skin[0])
    assert (dark < half).all()
    assert dark[0] / dark[2] > lit[0] / lit[2]
