"""Arrays of anybody's meshes whose names facewrinkle uses too.

what                                     checked against
arrays of the user, by every such name   the same face, frame, files and pictures without them; they are kept
a frame that becomes a face              the same face of its bare points and triangles
"""

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.mesh import arrays, surface, with_normals

NAMES = sorted(
    {*arrays.ARRAYS, "split_gamma", "paint", "relief"}
    | {value for name, value in (vars(arrays) | vars(surface)).items() if name.isupper() and isinstance(value, str)}
    | {arrays.GAZE + "l", arrays.OF_PART + "hat", "image", "images", "object name", "moved"}
)
"""All names of the module, and those that it once gave to what only it should read."""

OURS = [name for name in NAMES if name.startswith("facewrinkle: ")]
FRAME = {*arrays.ARRAYS, "Normals"}


def bare(mesh):
    """The points and triangles of a mesh."""
    return pv.PolyData.from_regular_faces(np.array(mesh.points), np.array(mesh.regular_faces))


def values_of(kind, n):
    flat = np.linspace(-40.0, 90.0, 3 * n)
    return {
        "numbers": flat[:n],
        "vectors": flat.reshape(n, 3),
        "whole numbers": np.arange(n) % 7,
        "bytes": (np.arange(n) % 200).astype(np.uint8),
    }[kind]


def told(frame):
    """Whatever a frame shows: positions, normals and all that a simulation with the folds of the paper writes."""
    names = sorted(FRAME - {"theta", "family"})
    return {"points": np.asarray(frame.points)} | {name: np.asarray(frame.point_data[name]) for name in names}


@pytest.fixture(scope="module")
def plain(face):
    fitted = fw.fit_face(bare(face.mesh), face.landmarks)
    return fitted, told(smiling(fitted)), plain_picture(fitted)


@pytest.mark.parametrize(  # with both that are left out in turn, the mesh would be a frame
    ("kind", "left_out"),
    [
        ("numbers", "unit"),
        pytest.param("vectors", "rest", marks=pytest.mark.slow),
        pytest.param("whole numbers", "rest", marks=pytest.mark.slow),
        pytest.param("bytes", "unit", marks=pytest.mark.slow),
    ],
)
def test_arrays_of_ones_own_are_kept_and_mean_nothing(face, plain, tmp_path, kind, left_out, fingerprint):
    mesh, names = bare(face.mesh), [name for name in NAMES if name not in OURS and name != left_out]
    for name in names:
        mesh.point_data.set_array(values_of(kind, mesh.n_points), name)
        mesh.cell_data.set_array(values_of(kind, mesh.n_cells), name)
        mesh.field_data[name] = ["a word", "another"]
    own, before = values_of(kind, mesh.n_points), fingerprint(mesh)
    fitted, (expected, shown, seen) = fw.fit_face(mesh, face.landmarks), plain
    assert fingerprint(mesh) == before

    again = fw.read_face(fw.write_face(fitted, tmp_path / "own.face"))
    for name in names:
        np.testing.assert_array_equal(fitted.mesh.point_data[name], own, err_msg=name)
        np.testing.assert_array_equal(again.mesh.point_data[name], own, err_msg=name)
        assert list(fitted.mesh.field_data[name]) == ["a word", "another"]
    np.testing.assert_array_equal(fitted.mesh.points, expected.mesh.points)
    marks = expected.landmarks_on(expected.mesh)
    np.testing.assert_array_equal([*fitted.landmarks_on(fitted.mesh).values()], [*marks.values()])
    state = fitted.state_of(fitted.mesh)
    assert (state.pose, state.gazes, state.parts, state.jaw_angle, state.mandible) == (None, {}, {}, None, None)
    np.testing.assert_array_equal(plain_picture(fitted), seen)

    frame = smiling(fitted)
    for name, values in told(frame).items():
        np.testing.assert_array_equal(values, shown[name], err_msg=name)
    for name in set(names) - shown.keys():
        np.testing.assert_array_equal(frame.point_data[name][: len(own)], own, err_msg=name)
    for shape in (fitted.mesh, frame):
        for ending in ("glb", "obj", "ply"):
            written = fw.read_surface(fw.write_mesh(shape, tmp_path / f"own.{ending}", fitted))
            assert written.n_cells == shape.n_cells
        fw.write_series([shape], [0.0], tmp_path / "own.vtkhdf")
        stored = pv.read(tmp_path / "own.vtkhdf")
        for name in set(names) - (shown.keys() if shape is frame else set()):
            np.testing.assert_array_equal(stored.point_data[name][: len(own)], own, err_msg=name)


def smiling(face):
    sim = fw.Simulation(face, fw.Refinement(max_level=1), folds="paper")
    sim.express({"AU12": 1.0, "AU27": 0.5})
    return [sim.step() for _ in range(4)][-1]


def plain_picture(face):
    return fw.picture(face.mesh, face, fw.plotting.Style((160, 160)))


@pytest.fixture(scope="module")
def frame(face):
    """With an open jaw, a gaze, a turned head, parts, and triangles that were split."""
    sim = fw.Simulation(face, fw.Refinement(max_level=1))
    sim.express({"AU27": 1.0, "AU19": 0.5, "AU12": 1.0})
    sim.look(yaw=20.0)
    return [sim.step() for _ in range(8)][-1]


def reopened(frame, way, folder):
    if way == "itself":
        return frame
    frame.save(folder / f"frame.{way}")
    return folder / f"frame.{way}"


@pytest.mark.parametrize("way", ["vtp", *(pytest.param(way, marks=pytest.mark.slow) for way in ("itself", "vtk"))])
def test_a_face_made_from_a_frame_is_that_of_its_shape(face, frame, tmp_path, way):
    assert frame.field_data["jaw_angle"][0] > 0.1
    frame.field_data["subject"] = ["someone"]
    frame.point_data["mine"] = np.arange(frame.n_points)
    source, marks = reopened(frame, way, tmp_path), face.landmarks_on(frame)
    expected, fitted = fw.fit_face(bare(frame), marks), fw.fit_face(source, marks)
    assert set(fitted.mesh.point_data) == {"mine", *face.mesh.point_data}
    assert list(fitted.mesh.field_data) == ["subject"]
    np.testing.assert_allclose(fitted.mesh.points, expected.mesh.points, atol=1e-4)
    now = fitted.landmarks_on(fitted.mesh)
    np.testing.assert_allclose([*now.values()], [*fitted.landmarks.values()], atol=1e-9)
    assert fitted.state_of(fitted.mesh).jaw_angle is None
    if way == "itself":
        np.testing.assert_array_equal(plain_picture(fitted), plain_picture(fw.fit_face(colored(frame), marks)))
    for own in (fitted, fw.surface(source)):
        for ending in ("glb", "obj", "ply"):
            written = fw.write_mesh(own.mesh, tmp_path / f"again.{ending}", own)
            assert fw.read_surface(written).n_cells == own.mesh.n_cells
        assert not {"rest", "W", "level", "split_gamma"} & set(own.mesh.point_data)
        assert set(fw.Simulation(own).step().field_data) >= {"unit"}


def test_tears_run_down_a_frame_as_down_its_shape(frame, face):
    start = face.landmarks_on(frame)["malar_l"]
    tear, expected = (fw.SheddingTear(mesh, start=start).surface(1.0, on=mesh) for mesh in (frame, bare(frame)))
    np.testing.assert_allclose(tear.bounds, expected.bounds, atol=0.5)
    assert tear.n_cells


def colored(frame):
    mesh = bare(frame)
    for name in ("Colors", "Texture Coordinates"):
        if name in frame.point_data:
            mesh.point_data[name] = np.array(frame.point_data[name])
    if frame.active_texture_coordinates is not None:
        mesh.active_texture_coordinates = np.array(frame.active_texture_coordinates)
    return mesh


def test_normals_are_those_of_frames_and_new_ones_of_all_else(face, frame):
    np.testing.assert_array_equal(with_normals(frame).point_data["Normals"], frame.point_data["Normals"])
    stale = face.mesh.copy()
    stale.point_data["Normals"], stale.point_data["split_gamma"] = (
        np.ones((stale.n_points, 3)),
        np.zeros(stale.n_points),
    )
    np.testing.assert_allclose(np.linalg.norm(with_normals(stale).point_data["Normals"], axis=1), 1.0)
    lost = frame.copy()
    del lost.point_data["Normals"]
    assert with_normals(lost).point_data["Normals"].shape == (frame.n_points, 3)
