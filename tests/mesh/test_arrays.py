"""PolyData from plain arrays.

What a frame says of its face.

pose there and back          | the identity, to rounding
points of a turned head      | scipy's rotation
frames of a simulation       | what was asked of it
what a file tells            | the same after PyVista has turned the mesh, or taken some of its cells
"""

from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv
from expressions import after
from scipy.spatial.transform import Rotation
from small_meshes import cap

import facewrinkle as fw
from facewrinkle.mesh import (
    ARRAYS,
    GAZE,
    OF_PART,
    POSE,
    UNIT,
    FrameState,
    Piece,
    Surface,
    joined,
    prepare,
    refine,
    surface_in,
    to_polydata,
)
from facewrinkle.mesh.surface import PIECES


def test_to_polydata_round_trip():
    mesh = cap()
    data = {name: np.linspace(0, 1, mesh.n_points) for name in ARRAYS}
    data["rest"] = mesh.points * 2
    data["muscle"] = np.arange(mesh.n_points) - 1
    out = to_polydata(mesh.points, mesh.regular_faces.astype(np.int32), data)
    np.testing.assert_array_equal(out.points, mesh.points)
    np.testing.assert_array_equal(out.regular_faces, mesh.regular_faces)
    assert out.array_names == list(ARRAYS)
    for name, values in data.items():
        np.testing.assert_array_equal(out[name], values)
        assert out[name].dtype == values.dtype
    np.testing.assert_array_equal(prepare(out).triangles, mesh.regular_faces)


@pytest.mark.parametrize(
    ("points", "triangles", "data", "message"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], {}, r"points must have the shape \(n, 3\), received \(3, 2\)"),
        (np.eye(3), [[0.0, 1.0, 2.0]], {}, "must be integers"),
        (np.eye(3), [[0, 1, 2, 0]], {}, r"received int64 of \(1, 4\)"),
        (np.eye(3), [[0, 1, 3]], {}, "from 0 to 2, received 0 to 3"),
        (np.eye(3), [[-1, 1, 2]], {}, "received -1 to 2"),
        (np.eye(3), [[0, 1, 2]], {"W": np.zeros(2)}, "'W' must have 3 rows.*received 2"),
    ],
)
def test_to_polydata_checks(points, triangles, data, message):
    with pytest.raises(fw.errors.MeshError, match=message):
        to_polydata(points, np.array(triangles), data)


@pytest.mark.parametrize("copy", [True, False])
def test_polydata_share_memory_with_the_arrays_only_where_asked(copy):
    points, values = np.random.default_rng(0).random((2, 3, 3))
    mesh = to_polydata(points, np.array([[0, 1, 2]]), {"v": values}, copy=copy)
    assert np.shares_memory(mesh.points, points) is not copy
    assert np.shares_memory(mesh["v"], values) is not copy
    assert np.array_equal(mesh["v"], values)
    assert mesh.regular_faces.tolist() == [[0, 1, 2]]


# --- refined in one step --------------------------------------------------------------------------


def test_refine_splits_one_triangle_and_closes_around_it() -> None:
    plane = pv.Plane(i_resolution=2, j_resolution=2).triangulate()
    plane.point_data["affine"] = plane.points @ [1.0, 2.0, 3.0] + 0.5
    plane.point_data["label"] = np.arange(plane.n_points)
    before = plane.copy()
    fine = refine(plane, [0])
    corners = set(plane.regular_faces[0].tolist())
    sides = [plane.regular_faces[0][[s, (s + 1) % 3]] for s in range(3)]
    inner = [side for side in sides if (np.isin(plane.regular_faces, side).sum(axis=1) == 2).sum() == 2]
    assert fine.n_cells == plane.n_cells + 3 + len(inner)
    assert np.array_equal(fine.points[: plane.n_points], plane.points)
    assert fine.area == pytest.approx(plane.area, rel=1e-12)
    np.testing.assert_allclose(fine["affine"], fine.points @ [1.0, 2.0, 3.0] + 0.5, atol=1e-12)
    assert set(fine["label"][plane.n_points :].tolist()) <= corners
    assert plane == before


def colors_of(meshes):
    _, _, data = joined(
        [(mesh.points, mesh.regular_faces, mesh.point_data) for mesh in meshes], ["Colors"], {"Colors": 255}
    )
    return data["Colors"]


def test_colors_in_bytes_and_in_shares_are_the_same_side_by_side():
    shades = np.random.default_rng(2).integers(0, 256, (3, 3), dtype=np.uint8)
    sheets = [pv.Triangle() for _ in range(3)]
    sheets[0].point_data["Colors"] = shades / 255.0
    sheets[1].point_data["Colors"] = shades
    for order in ([0, 1, 2], [2, 1, 0]):
        found = colors_of([sheets[i] for i in order])
        expected = [shades if i < 2 else np.full((3, 3), 255) for i in order]
        np.testing.assert_array_equal(found, np.concatenate(expected))
        assert found.dtype == np.uint8
    np.testing.assert_array_equal(colors_of([sheets[2], sheets[0]]), np.concatenate([np.full((3, 3), 255), shades]))


POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 0]])


def frame() -> pv.PolyData:
    return pv.PolyData.from_regular_faces(POINTS, [[0, 1, 2]])


def test_a_frame_that_says_nothing_is_a_head_at_rest():
    state = FrameState.of(frame(), 3)
    np.testing.assert_array_equal(state.points, POINTS[:3])
    assert (state.pose, state.gazes, state.parts) == (None, {}, {})
    np.testing.assert_array_equal(state.head, np.eye(4))
    np.testing.assert_array_equal(state.to_rest(POINTS), POINTS)


def test_pose_gazes_and_parts_are_read():
    turn, shift = Rotation.from_rotvec([0.1, -0.4, 0.2]), np.array([3.0, -1.0, 2.0])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn.as_matrix(), shift
    mesh = frame()
    mesh.field_data[POSE] = pose
    mesh.field_data[f"{GAZE}r"] = ["a word of the user's"]
    assert FrameState.of(mesh, 3).pose is None  # of a mesh that is no frame, it means something else
    mesh.point_data["rest"], mesh.point_data["level"], mesh.field_data[UNIT] = POINTS, np.zeros(4), [1.0]
    del mesh.field_data[f"{GAZE}r"]
    mesh.field_data[f"{GAZE}l"] = [[0.6, 0.0, 0.8]]
    mesh.field_data[f"{OF_PART}hat"] = POINTS + 1.0
    state = FrameState.of(mesh, 3)
    np.testing.assert_allclose(state.from_rest(POINTS), turn.apply(POINTS) + shift, atol=1e-15)
    np.testing.assert_allclose(state.to_rest(state.from_rest(POINTS)), POINTS, atol=1e-15)
    assert list(state.gazes) == ["l"]
    np.testing.assert_array_equal(state.gazes["l"], [0.6, 0.0, 0.8])
    assert list(state.parts) == ["hat"]
    np.testing.assert_array_equal(state.parts["hat"], POINTS + 1.0)


def test_frames_of_a_simulation_say_where_the_eyes_look(face):
    sim = fw.Simulation(face)
    sim.look(yaw=25.0)
    last = after(sim, "paper_surprise", 4)
    state = face.state_of(last)
    np.testing.assert_array_equal(state.points, last.points[: len(face.points)])
    for eye in face.eyes:
        np.testing.assert_allclose(state.gazes[eye.side], eye.turned(*fw.anatomy.gaze_of(eye, yaw=25.0)), atol=1e-12)


def test_a_mesh_with_fewer_points_is_no_frame():
    with pytest.raises(fw.errors.MeshError, match="4 points or more, received 3"):
        FrameState.of(pv.PolyData(POINTS[:3]), 4)


# --- what of a surface goes along with a PolyData -------------------------------------------------


TOLD = (Piece(4, "nose/skin", "größe.png"), Piece(7, "lips"))


@pytest.fixture
def told():
    sheet = pv.Plane(i_resolution=4, j_resolution=2).triangulate()
    sheet.point_data["mine"], sheet.field_data["who"] = np.arange(sheet.n_points), ["me"]
    shapes = np.random.default_rng(5).normal(size=(1, sheet.n_points, 3))
    return replace(Surface.of(sheet), pieces=TOLD, piece=np.arange(16) // 3 % 2, shapes=shapes)


def test_what_a_file_tells_survives_filters(told):
    turned = surface_in(told.to_polydata().rotate_x(30.0, inplace=False))
    np.testing.assert_allclose(turned.points, told.mesh.rotate_x(30.0, inplace=False).points, atol=1e-12)
    for name in ("triangles", "texture", "piece", "shapes"):
        np.testing.assert_array_equal(getattr(turned, name), getattr(told, name))
    np.testing.assert_array_equal(turned.point_data["mine"], np.arange(len(told.points)))
    assert (turned.pieces, list(turned.field_data), turned.active[0]) == (TOLD, ["who"], "TextureCoordinates")
    some = surface_in(told.to_polydata().extract_cells([3, 9]).extract_surface(algorithm=None))
    assert [some.pieces[number] for number in some.piece] == [TOLD[1], TOLD[1]]
    np.testing.assert_array_equal(some.shapes, told.only([3, 9]).shapes)
    assert set(told.mesh.array_names) == {"mine", "TextureCoordinates", "who"}


@pytest.mark.parametrize("wrong", [np.full(16, 2), np.full(16, np.nan), np.zeros((16, 2), int), np.array(["a"] * 16)])
def test_numbers_that_make_no_sense_are_left_out(told, wrong):
    mesh = told.to_polydata()
    mesh.cell_data[PIECES] = wrong
    found = surface_in(mesh)
    assert (found.pieces, found.piece.tolist()) == ((Piece(),), [0] * 16)
