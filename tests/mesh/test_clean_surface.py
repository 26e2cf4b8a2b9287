"""Repair of meshes that were spoiled on purpose: the result must be the mesh before the damage."""

import re
import warnings

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given, settings
from hypothesis import strategies as st
from real_faces import FACES, needs_faces
from small_meshes import cap, mesh_of, same_triangles, side_by_side, sphere

from facewrinkle.errors import FaceWrinkleWarning, MeshError, ParameterError
from facewrinkle.mesh import prepare, read_surface, to_polydata

REAL = ("ict_face_narrow", "mediapipe_canonical_face_model", "makehuman_head_male")


@needs_faces
@pytest.mark.parametrize(
    ("name", "forward"), [(REAL[0], (0.0, 0.0, 1.0)), (REAL[1], (0.0, 0.4, 2.0)), *((name, None) for name in REAL[1:])]
)
def test_real_faces_are_turned_outward(name, forward):
    with warnings.catch_warnings(action="ignore", category=FaceWrinkleWarning):
        mesh = read_surface(FACES / f"{name}.obj")
    clean = prepare(mesh, forward=forward)
    assert clean.report == ()  # lips and lids may touch; nothing is changed
    assert same_triangles(clean.triangles, mesh.regular_faces)
    with pytest.warns(FaceWrinkleWarning, match="inward"):
        turned = prepare(to_polydata(mesh.points, mesh.regular_faces[:, ::-1]), forward=forward)
    assert same_triangles(turned.triangles, mesh.regular_faces)


def test_input_is_copied_and_unchanged(fingerprint):
    mesh = cap()
    before = fingerprint(mesh)
    read = read_surface(mesh)
    read.points[:] = 0.0
    read["identity"][:] = 0
    surface = prepare(mesh)
    surface.points[:] = 0.0
    surface.mesh.points[:] = 0.0
    surface.mesh["identity"][:] = 0
    assert fingerprint(mesh) == before


def test_a_clean_surface_stays_as_it_is():
    mesh = cap()
    surface = prepare(mesh)
    np.testing.assert_array_equal(surface.triangles, mesh.regular_faces)
    np.testing.assert_array_equal(surface.points, mesh.points)
    np.testing.assert_array_equal(surface.source_points, np.arange(mesh.n_points))
    assert (surface.triangles.dtype, surface.points.dtype, surface.report) == (np.int32, np.float64, ())


def test_stale_normals_stay_behind():
    mesh = cap().compute_normals(cell_normals=False)
    assert "Normals" in mesh.point_data
    assert prepare(mesh).mesh.array_names == ["identity", "color"]


def test_degenerate_and_duplicate_triangles_are_dropped():
    mesh = cap()
    spoiled = mesh_of(
        np.vstack([mesh.points, mesh.points[[0, 1]].mean(axis=0)]),
        np.vstack(
            [
                [[0, 1, 144]],
                [[5, 5, 6]],
                mesh.regular_faces,
                mesh.regular_faces[3:5, [1, 2, 0]],
                mesh.regular_faces[9:10, ::-1],
            ]
        ),
    )
    with pytest.warns(FaceWrinkleWarning) as caught:
        surface = prepare(spoiled)
    assert [str(w.message) for w in caught] == list(surface.report)
    assert re.search(r"duplicate triangles: 3 of 247", surface.report[0])
    assert re.search(r"degenerate triangles .*: 2 of 244", surface.report[1])
    np.testing.assert_array_equal(surface.triangles, mesh.regular_faces)
    np.testing.assert_array_equal(surface.points, mesh.points)


def test_thin_triangles_are_kept():
    thin = mesh_of([[0, 0, 0], [1, 0, 0], [0.5, 1e-6, 0], [0.5, -1, 0]], [[0, 1, 2], [1, 0, 3]])
    assert len(prepare(thin).triangles) == 2


def test_a_fin_is_cut_off():
    mesh = cap()
    fin = mesh_of(np.vstack([mesh.points, [[0, 0, 5]]]), np.vstack([mesh.regular_faces, [[14, 13, 144]]]))
    with pytest.warns(FaceWrinkleWarning, match="three or more triangles: 1 of|set apart parts of 1 tri"):
        surface = prepare(fin)
    assert len(surface.report) == 2
    np.testing.assert_array_equal(surface.triangles, mesh.regular_faces)
    np.testing.assert_array_equal(surface.source_points, np.arange(144))
    np.testing.assert_array_equal(surface.others.points, fin.points[[13, 14, 144]])


def test_the_largest_part_is_chosen():
    speck, face, eye = sphere((5, 0, 0), 0.1, 16), cap(), sphere((0, 0, -1), 0.2)
    assert speck.n_cells > face.n_cells  # by area, not by count
    with pytest.warns(FaceWrinkleWarning) as caught:
        surface = prepare(side_by_side(speck, face, eye))
    assert len(caught) == 1
    others = f"{speck.n_cells}, {eye.n_cells}"
    chosen = f"one of 3 .*, the one with the largest area, with 242 .*parts of {others} triangles"
    assert re.search(chosen, surface.report[0])
    np.testing.assert_array_equal(surface.triangles, face.regular_faces)
    np.testing.assert_array_equal(surface.source_points, speck.n_points + np.arange(face.n_points))


def test_landmarks_choose_the_part():
    hair, face = sphere((0, 0, 0), 9.0), cap()
    near = np.vstack([face.points[[3, 30, 60]] + 0.01, [[0, 0, 9.1]]])
    with pytest.warns(FaceWrinkleWarning, match="nearest to 3 of 4 landmarks"):
        surface = prepare(side_by_side(hair, face), near=near)
    np.testing.assert_array_equal(surface.points, face.points)


@settings(max_examples=30)
@given(st.sets(st.integers(0, 241)), st.randoms(use_true_random=False))
def test_any_damage_to_the_orientation_is_mended(flipped, random):
    mesh = cap()
    triangles = mesh.regular_faces.copy()
    triangles[sorted(flipped)] = triangles[sorted(flipped), ::-1]
    order = list(range(len(triangles)))
    random.shuffle(order)
    with warnings.catch_warnings(action="ignore", category=FaceWrinkleWarning):
        surface = prepare(mesh_of(mesh.points, triangles[order]))
    assert same_triangles(surface.triangles, mesh.regular_faces)


@pytest.mark.parametrize("forward", [None, (0, 0, 1), (0.5, 0.5, 2)])
@pytest.mark.parametrize("shape", ["mask", "closed"])
def test_surfaces_that_look_inward_are_turned(shape, forward):
    mesh = cap() if shape == "mask" else sphere((40, -30, 7), 2.0)
    with pytest.warns(FaceWrinkleWarning, match="inward"):
        surface = prepare(mesh_of(mesh.points, mesh.regular_faces[:, ::-1]), forward=forward)
    assert same_triangles(surface.triangles, mesh.regular_faces)
    assert prepare(mesh, forward=forward).report == ()


def test_forward_decides_for_a_hollow_and_for_a_plane():
    bowl = cap()
    bowl.points[:, 2] *= -1  # its triangles look up, into the hollow
    assert prepare(bowl, forward=(0, 0, 1)).report == ()
    with pytest.warns(FaceWrinkleWarning, match="inward"):
        assert same_triangles(prepare(bowl, forward=(0, 0, -1)).triangles, bowl.regular_faces[:, ::-1])
    plane = cap()
    plane.points[:, 2] = 0.0
    down = mesh_of(plane.points, plane.regular_faces[:, ::-1])
    assert prepare(plane).report == prepare(down).report == ()
    with pytest.warns(FaceWrinkleWarning, match="inward"):
        prepare(down, forward=(0, 0, 1))


def test_unused_points_go_and_data_stay_with_their_points():
    mesh = cap()
    half_of = np.r_[60:100, 181:221]  # both triangles of each square
    half = mesh_of(mesh.points, mesh.regular_faces[half_of], identity=mesh["identity"], color=mesh["color"])
    half["uv"] = mesh.points[:, :2]
    half.point_data.active_texture_coordinates_name = "uv"
    half.field_data["subject"] = ["someone"]
    surface = prepare(half)
    used = np.unique(half.regular_faces)
    np.testing.assert_array_equal(surface.source_points, used)
    np.testing.assert_array_equal(surface.mesh["identity"], used)
    np.testing.assert_array_equal(surface.mesh["color"], mesh["color"][used])
    np.testing.assert_array_equal(surface.mesh.active_texture_coordinates, mesh.points[used, :2].astype(np.float32))
    np.testing.assert_array_equal(used[surface.triangles], half.regular_faces)
    assert list(surface.mesh.field_data["subject"]) == ["someone"]
    np.testing.assert_array_equal(surface.mesh.points, surface.points)
    np.testing.assert_array_equal(surface.mesh.regular_faces, surface.triangles)


@pytest.mark.parametrize(("dtype", "one"), [(np.uint8, 255), (np.float64, 1.0)])
def test_skin_is_opaque_whatever_its_alpha(dtype, one):
    sheet = pv.Plane(i_resolution=3, j_resolution=3).triangulate()
    colors = np.tile(np.array([0.2, 0.4, 0.6, 0.996]) * one, (sheet.n_points, 1)).astype(dtype)
    colors[0, 0] = 0
    sheet.point_data["Colors"] = colors
    kept = prepare(sheet)
    np.testing.assert_array_equal(kept.mesh.point_data["Colors"], colors[kept.source_points, :3])
    assert sheet.point_data["Colors"].shape[1] == 4


def with_points_at(value):
    mesh = cap()
    mesh.points[[7, 20], 1] = value
    return mesh


BALLS = side_by_side(*(sphere((3.0 * k, 0, 0), 0.5, 8) for k in range(5)))
ON_BALLS = np.array([[3.0 * k, 0.0, 0.5] for k in range(5)])
NOT_FINITE = r"2 of 144 points are NaN, infinite or beyond.*first is point 7.*Delete them"


@pytest.mark.parametrize(
    ("source", "how", "error", "message"),
    [
        (pv.PolyData(), {}, MeshError, "has no points"),
        (pv.PolyData(np.eye(3)), {}, MeshError, "3 points and no faces.*reconstruct_surface"),
        *((with_points_at(value), {}, MeshError, NOT_FINITE) for value in (np.nan, np.inf, -np.inf, 1e60)),
        (mesh_of([[0, 0, 0], [1, 1, 1], [3, 3, 3]], [[0, 1, 2]]), {}, MeshError, "all triangles are degenerate"),
        (BALLS, {"near": ON_BALLS}, MeshError, "in 5 pieces.*landmarks are those of this mesh"),
        *(
            (cap(), {"near": np.array(near)}, ParameterError, "near must be rows of three finite numbers")
            for near in ([[0, 0]], [[0, 0, np.nan]])
        ),
        *(
            (cap(), {"forward": forward}, ParameterError, "forward must be")
            for forward in ((0, 0, 0), (0, 1), (np.inf, 0, 0))
        ),
    ],
)
def test_what_cannot_be_prepared_is_refused(source, how, error, message):
    with pytest.raises(error, match=message):
        prepare(source, **how)
