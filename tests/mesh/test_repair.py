"""Repair: meshes are spoiled on purpose; what comes back is the mesh before the damage, or as whole as it was."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given, settings
from hypothesis import strategies as st
from small_meshes import arrays, sphere

from facewrinkle.errors import FaceWrinkleWarning
from facewrinkle.geometry import double_areas, topology
from facewrinkle.mesh import Surface, prepare
from facewrinkle.mesh.repair import (
    RepairedMesh,
    mended,
    turned_over,
    unfolded,
)


def ball(resolution=16):
    return arrays(sphere((0.0, 0.0, 0.0), 1.0, resolution))


def sheet(size=6):
    return arrays(pv.Plane(i_resolution=size, j_resolution=size).triangulate())


def rim(triangles):
    """Number of edges with one triangle."""
    _, sides = topology.unique_edges(triangles)
    return int((np.bincount(sides.ravel()) == 1).sum())


def is_sound(mesh):
    return (
        len(topology.non_manifold_edges(mesh.triangles)) == 0
        and (double_areas(mesh.points, mesh.triangles) > 0.0).all()
        and np.array_equal(mesh.points, mesh.points)
    )


@pytest.mark.parametrize("make", [ball, sheet])
def test_a_sound_mesh_stays_as_it_is(make):
    points, triangles = make()
    mesh = mended(RepairedMesh.of(points, triangles))
    assert mesh.report == ()
    np.testing.assert_array_equal(mesh.triangles, triangles)
    np.testing.assert_array_equal(mesh.points, points)


@settings(max_examples=40)
@given(st.sets(st.integers(0, 400), min_size=1, max_size=12), st.floats(0.2, 0.8))
def test_caps_are_flipped_and_nothing_tears(which, share):
    points, triangles = ball()
    chosen = np.array(sorted(n % len(triangles) for n in which))
    a, b, c = triangles[chosen].T
    middle = len(points) + np.arange(len(chosen))
    new = np.vstack([np.column_stack(t) for t in ((a, middle, c), (middle, b, c), (a, b, middle))])
    dirty = np.vstack([points, (1 - share) * points[a] + share * points[b]])
    mesh = mended(RepairedMesh.of(dirty, np.vstack([np.delete(triangles, chosen, axis=0), new])))
    assert is_sound(mesh)
    assert rim(mesh.triangles) == 0
    assert topology.euler_characteristic(mesh.triangles) == 2
    assert topology.is_oriented(mesh.triangles)
    assert double_areas(mesh.points, mesh.triangles).sum() == pytest.approx(double_areas(points, triangles).sum())


@settings(max_examples=40)
@given(st.sets(st.integers(0, 400), min_size=1, max_size=6))
def test_edges_without_length_collapse_and_nothing_tears(which):
    points, triangles = ball()
    for n in which:
        a, b = triangles[n % len(triangles)][:2]
        points[b] = points[a]
    mesh = mended(RepairedMesh.of(points, triangles))
    assert is_sound(mesh)
    assert rim(mesh.triangles) == 0
    assert len(mesh.report) >= 1


def test_a_triangle_that_is_there_twice_back_to_back_is_dropped():
    points, triangles = sheet()
    mesh = mended(
        RepairedMesh.of(np.vstack([points, points]), np.vstack([triangles, triangles[:, ::-1] + len(points)]))
    )
    np.testing.assert_array_equal(mesh.triangles, triangles)
    assert mesh.report == ("Dropped duplicate triangles: 72 of 144.",)


@pytest.mark.parametrize("rounding", [0.0, 1e-7])
@pytest.mark.parametrize("make", [ball, sheet])
def test_seams_are_stitched(make, rounding):
    points, triangles = make()
    over = points[triangles].mean(axis=1) @ [1.0, 0.3, 0.2] > 0.05
    split = np.where(over[:, None], triangles + len(points), triangles)
    other = points + np.random.default_rng(0).uniform(-rounding, rounding, points.shape)
    other[other == 0.0] = -0.0
    mesh = mended(RepairedMesh.of(np.vstack([points, other]), split))
    assert rim(mesh.triangles) == rim(triangles)
    assert len(np.unique(mesh.triangles)) == len(points)
    assert topology.sheets(mesh.triangles).max() == 0
    np.testing.assert_array_equal(mesh.corners, np.arange(triangles.size).reshape(-1, 3))
    assert "along seams" in mesh.report[0]


def test_texture_keeps_both_sides_of_a_seam_that_was_stitched():
    points, triangles = sheet()
    over = points[triangles].mean(axis=1)[:, 0] > 0.0
    split = np.where(over[:, None], triangles + len(points), triangles)
    source = pv.PolyData.from_regular_faces(np.vstack([points, points]), split)
    texture = np.vstack([points[:, :2], points[:, :2] + [5.0, 0.0]])
    source.active_texture_coordinates = texture
    with pytest.warns(FaceWrinkleWarning, match="along seams"):
        clean = prepare(source)
    np.testing.assert_allclose(clean.mesh.cell_data["Texture Corners"].reshape(-1, 3, 2), texture[split])


def test_corners_that_touch_are_not_stitched():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [-1, 0, 0], [0, -1, 0]])
    mesh = mended(RepairedMesh.of(points, np.array([[0, 1, 2], [3, 4, 5]])))
    assert mesh.report == ()
    assert topology.sheets(mesh.triangles).max() == 1


def test_fins_are_cut_off_whatever_their_direction():
    points, triangles = ball()
    random = np.random.default_rng(1)
    which = triangles[random.choice(len(triangles), 20, replace=False)]
    tips = points[which].mean(axis=1) + random.normal(0.0, 0.2, (20, 3))
    fins = np.column_stack([which[:, :2], len(points) + np.arange(20)])
    mesh = mended(RepairedMesh.of(np.vstack([points, tips]), np.vstack([triangles, fins])))
    label = topology.sheets(mesh.triangles)
    skin = mesh.triangles[label == np.argmax(np.bincount(label))]
    np.testing.assert_array_equal(skin, triangles)
    assert is_sound(mesh)


def test_two_bodies_that_share_an_edge_come_apart():
    first = pv.Cube(bounds=(0, 1, 0, 1, 0, 1)).triangulate().clean()
    both = first.append_polydata(pv.Cube(bounds=(1, 2, 1, 2, 0, 1)).triangulate().clean()).clean()
    assert len(topology.non_manifold_edges(both.regular_faces)) == 1
    mesh = mended(RepairedMesh.of(np.asarray(both.points, float), both.regular_faces))
    assert np.bincount(topology.sheets(mesh.triangles)).tolist() == [12, 12]
    assert rim(mesh.triangles) == 0


def test_a_fin_that_continues_a_sharp_ridge_is_dropped():
    """It is flatter with one side of the ridge than the two sides are with each other, but these go around together."""
    wedge = np.array(
        [[0.0, 0, 0], [0, 1, 0], [2, 0.5, 0.3], [2, 0.5, -0.3]]
    )  # thin, its ridge from the first to the second
    triangles = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    mesh = mended(RepairedMesh.of(np.vstack([wedge, [[-1.0, 0.5, 0.0]]]), np.vstack([triangles, [[0, 1, 4]]])))
    assert is_sound(mesh)
    np.testing.assert_array_equal(mesh.triangles, triangles)
    assert mesh.report == (
        "Cut edges that had three or more triangles: 1 of 8.",
        "Dropped triangles on edges that two others share: 1 of 5.",
    )


def test_triangles_that_would_shrink_to_nothing_are_not_laid_flat():
    """The mean of the neighbors of the point in the middle lies on the side between the first two."""
    around = np.array([[-1.0, 0, 0], [1, 0, 0], [2, 1, 1], [0, -2, -2], [-2, 1, 1]])
    triangles = np.array([[0, 1, 5], [1, 2, 5], [2, 3, 5], [3, 4, 5], [4, 0, 5]])
    spoiled = RepairedMesh.of(np.vstack([around, [-1.0, -1.0, -1.0]]), triangles)
    assert turned_over(spoiled.points, triangles).any()
    assert unfolded(spoiled) is spoiled


def test_a_point_that_was_pulled_through_the_skin_goes_back():
    points, triangles = sheet(8)
    inner = int(np.argmin((points**2).sum(axis=1)))
    spoiled = points.copy()
    spoiled[inner] = points[inner] + [0.35, 0.3, 0.0]
    assert turned_over(spoiled, triangles).any()
    mesh = unfolded(RepairedMesh.of(spoiled, triangles))
    assert not turned_over(mesh.points, triangles).any()
    assert "Laid triangles flat" in mesh.report[0]
    assert 0 < len(np.flatnonzero((mesh.points != spoiled).any(axis=1))) < 30
    assert np.abs(mesh.points[:, 2]).max() == 0.0


def scrap(points, triangles, tip):
    """The sheet with three triangles more on an edge of its rim: they hang on each other, back to back."""
    edges, sides = topology.unique_edges(triangles)
    a, b = edges[np.flatnonzero(np.bincount(sides.ravel()) == 1)[0]].astype(np.int64)
    n = len(points)
    more = np.vstack([points, points[[a, b]].mean(axis=0) + tip])
    return more, np.vstack([triangles, [[a, b, n], [b, n + 1, n], [a, n, n + 1]]])


@given(st.integers(0, 10_000))
@settings(max_examples=60)
def test_ragged_rims_with_scraps_are_repaired(seed):
    """A triangle whose points all lie on the rim can be turned over, and has no point that may move."""
    random = np.random.default_rng(seed)
    points, triangles = sheet(4)
    kept = random.random(len(triangles)) > 0.2
    ragged = scrap(points, triangles[kept], 0.1 * random.normal(size=(2, 3)) * [1.0, 1.0, seed % 2])
    with warnings.catch_warnings(action="ignore", category=FaceWrinkleWarning):
        whole = prepare(pv.PolyData.from_regular_faces(*ragged))
    assert is_sound(whole)


def test_a_triangle_that_is_turned_over_on_the_rim_stays():
    triangles = np.array([[0, 1, 2], [1, 0, 3], [2, 1, 4]])
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0.5, 0.01], [0.3, 0.3, 0.01]])
    assert turned_over(points, triangles).any()
    spoiled = RepairedMesh.of(points, triangles)
    assert unfolded(spoiled) is spoiled


def lips(gap):
    """Two sheets whose borders run along each other, and displacements that part them by `gap` in the middle."""
    points, triangles = sheet()
    both = np.vstack([points, points + np.array([0.0, np.ptp(points[:, 1]), 0.0])])
    moved = np.zeros_like(both)
    moved[len(points) :, 1] = gap * np.maximum(1.0 - (3.0 * both[len(points) :, 0]) ** 2, 0.0)
    return pv.PolyData.from_regular_faces(both, np.vstack([triangles, triangles + len(points)])), moved


def test_borders_that_part_as_the_mesh_moves_are_not_stitched():
    mesh, moved = lips(0.0)
    still = mesh.copy()
    for data in (None, moved):  # a seam, whether it is known how it moves or not
        if data is not None:
            mesh = replace(Surface.of(still), shapes=data[None]).to_polydata()
        with pytest.warns(FaceWrinkleWarning, match="Joined points"):
            whole = prepare(mesh)
        assert whole.points.shape[0] == still.n_points - 7
        assert whole.mesh.point_data.keys() == []
    mesh = replace(Surface.of(still), shapes=lips(0.1)[1][None]).to_polydata()
    with pytest.warns(FaceWrinkleWarning, match="Joined points at which the mesh was split along seams: 4 of"):
        opened = prepare(mesh)  # at the corners of the mouth, which stay together
    assert opened.points.shape[0] == still.n_points - 4
    assert rim(opened.triangles) == rim(whole.triangles) + 2 * 4
    np.testing.assert_array_equal(Surface.of(mesh).shapes, lips(0.1)[1][None])
