"""glTF files with animations, written here byte by byte.

what                        checked against
points, shapes, weights     the arrays that went into the file, also sparse ones
interpolation               linear, step; scipy's Hermite spline
nodes                       products of scipy's rotations, scales and shifts, at rest and while they move
bones                       an arm of two bones in closed form
meshes beside               what each does on its own
seams                       a sheet whose halves meet at a seam; lips that touch and part
which mesh, which animation the choice among several
what cannot be read         the errors that name it
"""

import numpy as np
import pytest
from glb_files import GltfFile
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, Slerp
from small_meshes import square

import facewrinkle as fw
from facewrinkle.errors import FaceWrinkleWarning, MeshError, ParameterError, UnknownNameError


def sheet(n=4, seed=3):
    """A bumpy n x n sheet and two shapes, all exactly representable as float32."""
    rng = np.random.default_rng(seed)
    plane, triangles = square(n - 1)
    points = np.c_[np.rint((n - 1) * plane), rng.integers(-8, 8, n * n) / 32.0]
    return points, triangles, rng.integers(-64, 64, (2, n * n, 3)) / 128.0


POINTS, TRIANGLES, SHAPES = sheet()
ASIDE = np.array([9.0, 0.0, 0.0])
TIMES = np.array([0.0, 0.5, 2.0])
WEIGHTS = np.array([[0.0, 0.25], [1.0, 0.5], [0.5, 0.0]])


def moved(recorded, mesh, time):
    return recorded.positions_at(recorded.recorded_time(time), np.asarray(mesh.points))


def summed(weights, points=POINTS, shapes=SHAPES):
    return points + np.einsum("k,knd->nd", weights, shapes)


def talking(points=POINTS, triangles=TRIANGLES, shapes=SHAPES, names=None, **more):
    """A file with a mesh whose shapes move."""
    file = GltfFile()
    file.node(mesh=file.mesh(points, triangles, shapes, names, **more), name="head")
    file.animate((0, "weights", TIMES, WEIGHTS), name="speech")
    return file


@pytest.fixture
def simple():
    return talking(names=["smile", "jawOpen"])


# --- what a file holds --------------------------------------------------------------------------


def test_shapes_and_weights(simple, tmp_path):
    mesh, recorded = fw.read_animation(str(simple.glb(tmp_path / "a.glb")))
    assert np.array_equal(mesh.points, POINTS)
    assert np.array_equal(mesh.regular_faces, TRIANGLES)
    assert recorded.names == ("smile", "jawOpen")
    assert (recorded.duration, recorded.pose) == (2.0, None)
    for time, weights in zip(TIMES, WEIGHTS, strict=True):
        np.testing.assert_allclose(moved(recorded, mesh, time), summed(weights), atol=1e-14)
    np.testing.assert_allclose(moved(recorded, mesh, 1.25), summed(0.5 * (WEIGHTS[1] + WEIGHTS[2])), atol=1e-14)
    sim = fw.Simulation(mesh, motion=recorded, time_step=0.5)
    np.testing.assert_allclose(sim.step().points, summed(WEIGHTS[1]), atol=1e-14)


def test_sparse_shapes(tmp_path):
    file, thin = talking(), np.zeros_like(SHAPES)
    thin[:, [2, 7]] = SHAPES[:, [2, 7]]
    for target, shape in zip(file.content["meshes"][0]["primitives"][0]["targets"], SHAPES, strict=True):
        indices = {"bufferView": file.view(np.array([2, 7], "<u2").tobytes()), "componentType": 5123}
        values = {"bufferView": file.view(shape[[2, 7]].astype("<f4").tobytes())}
        sparse = {"count": 2, "indices": indices, "values": values}
        target["POSITION"] = file.array(POINTS, view=False, sparse=sparse)
    surface, recorded = fw.read_animation(file.glb(tmp_path / "a.glb"))
    np.testing.assert_allclose(moved(recorded, surface, 0.5), summed(WEIGHTS[1], shapes=thin), atol=1e-14)
    assert recorded.names == ("shape_0", "shape_1")


def test_parts_of_a_mesh_are_joined(tmp_path):
    file = talking()
    file.mesh(POINTS + ASIDE, TRIANGLES, -SHAPES)
    file.content["meshes"][0]["primitives"] += file.content["meshes"].pop()["primitives"]
    surface, recorded = fw.read_animation(file.glb(tmp_path / "a.glb"))
    both = np.vstack([summed(WEIGHTS[1]), POINTS + ASIDE + summed(WEIGHTS[1], 0.0, -SHAPES)])
    assert surface.n_cells == 2 * len(TRIANGLES)
    np.testing.assert_allclose(moved(recorded, surface, 0.5), both, atol=1e-14)


def test_steps_and_cubics(simple, tmp_path):
    slopes = np.array([[0.5, -1.0], [2.0, 0.25], [0.0, 1.0]])
    cubic = np.stack([slopes, WEIGHTS, slopes], axis=1)
    spline = CubicHermiteSpline(TIMES, WEIGHTS, slopes)
    simple.animate((0, "weights", TIMES, WEIGHTS, "STEP"), name="step")
    simple.animate((0, "weights", TIMES, cubic, "CUBICSPLINE"), name="cubic")
    path = simple.glb(tmp_path / "a.glb")
    for time in (0.0, 0.3, 0.5, 1.1, 1.9, 2.0):
        _, recorded = fw.read_animation(path, animation="step")
        latest = np.searchsorted(TIMES, time, side="right") - 1
        assert np.array_equal(list(recorded.weights(time).values()), WEIGHTS[latest])
        _, recorded = fw.read_animation(path, animation="cubic")
        np.testing.assert_allclose(list(recorded.weights(time).values()), spline(time), atol=1e-12)


# --- nodes --------------------------------------------------------------------------------------


def test_a_mesh_stands_where_its_nodes_put_it(tmp_path):
    file, turn, other = GltfFile(), Rotation.from_rotvec([0.2, -0.7, 1.1]), Rotation.from_rotvec([1.0, 0.1, 0.0])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = other.as_matrix() @ np.diag([2.0, 0.5, 1.5]), [1.0, -2.0, 3.0]
    file.node(children=[1], translation=[5.0, 0.0, 1.0], rotation=turn.as_quat().tolist(), scale=[2.0, 2.0, 3.0])
    file.node(children=[2], matrix=matrix.T.ravel().tolist())
    file.node(mesh=file.mesh(POINTS, TRIANGLES, SHAPES))
    file.animate((2, "weights", TIMES, WEIGHTS))
    mesh, recorded = fw.read_animation(file.glb(tmp_path / "a.glb"))

    def placed(points):
        inner = points @ matrix[:3, :3].T + matrix[:3, 3]
        return np.add(turn.apply(inner * [2.0, 2.0, 3.0]), [5.0, 0.0, 1.0])

    np.testing.assert_allclose(mesh.points, placed(POINTS), atol=1e-12)
    np.testing.assert_allclose(moved(recorded, mesh, 0.5), placed(summed(WEIGHTS[1])), atol=1e-12)


def test_mirroring_nodes_keep_the_outside_out(simple, tmp_path):
    simple.content["nodes"][0]["scale"] = [-1.0, 1.0, 1.0]
    mesh, _ = fw.read_animation(simple.glb(tmp_path / "a.glb"))
    assert np.array_equal(mesh.regular_faces, TRIANGLES[:, ::-1])
    assert mesh.compute_normals(cell_normals=True).cell_data["Normals"][:, 2].min() > 0.0


def test_a_head_that_turns_while_it_speaks(tmp_path):
    file = GltfFile()
    turns = Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.0, 1.2, 0.3], [0.5, 0.0, 0.0]])
    file.node(children=[1], translation=[0.0, 1.0, 0.0])
    file.node(mesh=file.mesh(POINTS, TRIANGLES, SHAPES), scale=[2.0, 2.0, 2.0])
    when = np.array([0.0, 1.0, 3.0])
    shifts = np.array([[0.0, 1.0, 0.0], [0.0, 3.0, 0.0], [4.0, 1.0, 0.0]])
    quaternions = turns.as_quat() * [[1.0], [-1.0], [1.0]]  # the other quaternion of the same turn
    file.animate((1, "weights", TIMES, WEIGHTS), (1, "rotation", when, quaternions), (0, "translation", when, shifts))
    mesh, recorded = fw.read_animation(file.glb(tmp_path / "a.glb"))
    assert recorded.duration == 3.0
    slerp = Slerp(when, turns)
    for time in (0.0, 0.4, 1.0, 1.5, 2.5, 3.0):
        weights = [np.interp(time, TIMES, column) for column in WEIGHTS.T]
        shift = [np.interp(time, when, column) for column in shifts.T]
        expected = slerp(time).apply(2.0 * summed(weights)) + shift
        np.testing.assert_allclose(moved(recorded, mesh, time), expected, atol=2e-6)  # quaternions are float32


def test_a_quaternion_of_zeros_does_not_turn(tmp_path):
    file = GltfFile()
    file.node(mesh=file.mesh(POINTS, TRIANGLES), rotation=[0.0, 0.0, 0.0, 0.0])
    turn = Rotation.from_rotvec([0.0, 0.8, 0.0])
    file.animate((0, "rotation", [0.0, 1.0], np.stack([np.zeros(4), turn.as_quat()])))
    mesh, recorded = fw.read_animation(file.glb(tmp_path / "a.glb"))
    np.testing.assert_array_equal(mesh.points, POINTS)
    assert recorded.names == ()
    half = Rotation.from_rotvec([0.0, 0.4, 0.0]).apply(POINTS)
    np.testing.assert_allclose(moved(recorded, mesh, 0.5), half, atol=2e-6)  # quaternions are float32


def test_weights_at_rest_stand_in_where_only_the_node_moves(tmp_path):
    file = GltfFile()
    file.node(mesh=file.mesh(POINTS, TRIANGLES, SHAPES), weights=[0.5, 0.25])
    file.animate((0, "translation", [0.0, 1.0], np.zeros((2, 3))))
    surface, recorded = fw.read_animation(file.glb(tmp_path / "a.glb"))
    np.testing.assert_allclose(moved(recorded, surface, 0.5), summed([0.5, 0.25]), atol=1e-14)


@pytest.mark.parametrize("kind", ["LINEAR", "STEP", "CUBICSPLINE"])
def test_weights_are_held_while_the_node_moves_on(tmp_path, kind):
    file = GltfFile()
    file.node(mesh=file.mesh(POINTS, TRIANGLES, SHAPES))
    values = WEIGHTS[:2] if kind != "CUBICSPLINE" else np.stack([np.ones((2, 2)), WEIGHTS[:2], np.ones((2, 2))], axis=1)
    file.animate(
        (0, "weights", [1.0, 2.0], values, kind), (0, "translation", [0.0, 3.0], [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]])
    )
    mesh, recorded = fw.read_animation(file.glb(tmp_path / "a.glb"))
    for time, weights in (
        (0.0, WEIGHTS[0]),
        (0.6, WEIGHTS[0]),
        (1.0, WEIGHTS[0]),
        (2.0, WEIGHTS[1]),
        (2.7, WEIGHTS[1]),
    ):
        np.testing.assert_allclose(moved(recorded, mesh, time), np.add(summed(weights), [time, 0.0, 0.0]), atol=1e-12)


# --- seams --------------------------------------------------------------------------------------


def test_points_of_a_seam_become_one(tmp_path):
    # Two halves of the sheet that meet in the column x = 2, which each has for itself, with other texture coordinates.
    n = len(POINTS)
    column = np.flatnonzero(POINTS[:, 0] == 2.0)
    right = (POINTS[TRIANGLES][:, :, 0].mean(axis=1) > 2.0)[:, None]
    twin = np.arange(n)
    twin[column] = n + np.arange(len(column))
    split = np.where(right, twin[TRIANGLES], TRIANGLES)
    points, shapes = np.vstack([POINTS, POINTS[column]]), np.concatenate([SHAPES, SHAPES[:, column]], axis=1)
    texture = np.vstack([POINTS[:, :2] / 4.0, POINTS[column][:, :2] / 4.0 + [0.25, 0.0]])
    path = talking(points, split, shapes, texture=texture).glb(tmp_path / "a.glb")
    mesh, recorded = fw.read_animation(path)
    assert np.array_equal(mesh.points, POINTS)
    assert np.array_equal(mesh.regular_faces, TRIANGLES)
    assert mesh.n_open_edges == 12
    np.testing.assert_allclose(mesh.active_texture_coordinates, texture[:n] * [1.0, -1.0] + [0.0, 1.0])
    np.testing.assert_allclose(moved(recorded, mesh, 0.5), summed(WEIGHTS[1]), atol=1e-14)
    # The mesh alone, read by VTK, is the same.
    alone = fw.read_surface(path)
    upwards = texture[split] * [1.0, -1.0] + [0.0, 1.0]
    for whole in (mesh, alone):
        np.testing.assert_allclose(whole.cell_data["Texture Corners"].reshape(-1, 3, 2), upwards, atol=1e-7)
    np.testing.assert_allclose(alone.points, POINTS, atol=1e-7)
    assert alone.n_open_edges == 12
    np.testing.assert_allclose(alone.active_texture_coordinates, mesh.active_texture_coordinates, atol=1e-7)
    assert [name for name in alone.point_data if "target" in name] == []
    # The frames of a simulation on it show no gap.
    assert fw.Simulation(mesh, motion=recorded, time_step=0.5).step().n_open_edges == 12


LIPS = np.vstack([POINTS, POINTS * [1.0, -1.0, 1.0]])
"""They share the row y = 0."""
OF_LIPS = np.vstack([TRIANGLES, TRIANGLES[:, ::-1] + len(POINTS)])


def test_lips_that_touch_and_part_stay_two(tmp_path):
    opening = np.zeros((1, len(LIPS), 3))
    opening[0, len(POINTS) :, 1] = -1.0
    for shapes, n in ((opening, 2 * len(POINTS)), (0.0 * opening, 2 * len(POINTS) - 4)):
        file = GltfFile()
        file.node(mesh=file.mesh(LIPS, OF_LIPS, shapes))
        file.animate((0, "weights", [0.0, 1.0], [[0.0], [1.0]]))
        mesh, recorded = fw.read_animation(file.glb(tmp_path / "a.glb"))
        assert mesh.n_points == recorded.n_points == n


# --- which mesh, which animation ----------------------------------------------------------------


def test_among_several_meshes_the_largest_that_moves_is_taken(tmp_path):
    file = GltfFile()
    big, triangles, _ = sheet(6)
    file.node(children=[1, 2, 3])
    file.node(mesh=file.mesh(big, triangles), name="hat")
    file.node(mesh=file.mesh(POINTS, TRIANGLES, SHAPES), name="head")
    file.node(mesh=file.mesh(*sheet(3)[:2], sheet(3)[2]), name="teeth")
    file.animate((2, "weights", TIMES, WEIGHTS), (3, "weights", TIMES, WEIGHTS))
    path = file.glb(tmp_path / "a.glb")
    with pytest.warns(FaceWrinkleWarning, match="2 meshes.*mesh1, mesh2.*Name another mesh"):
        mesh, recorded = fw.read_animation(path)
    assert recorded.n_points == len(POINTS)
    np.testing.assert_array_equal(mesh.points, np.vstack([POINTS, big, sheet(3)[0]]))  # the others come after it
    for name, n in (("teeth", 9), ("mesh2", 9), ("mesh1", 16)):
        mesh, recorded = fw.read_animation(path, mesh=name)
        assert recorded.n_points == n
        assert mesh.n_points == 9 + 16 + 36
        np.testing.assert_array_equal(mesh.points[:n], recorded.rest)
    with pytest.raises(UnknownNameError, match="'tooth'.*mesh"):
        fw.read_animation(path, mesh="tooth")
    with pytest.raises(MeshError, match="no animation.*mesh0"):
        fw.read_animation(path, mesh="hat")


def test_animations_are_chosen_by_name(simple, tmp_path):
    simple.animate((0, "weights", [0.0, 7.0], WEIGHTS[:2]), name="song")
    path = simple.glb(tmp_path / "a.glb")
    assert fw.read_animation(path)[1].duration == 2.0
    assert fw.read_animation(path, animation="song")[1].duration == 7.0
    with pytest.raises(UnknownNameError, match="'sing'.*'song'"):
        fw.read_animation(path, animation="sing")


# --- bones --------------------------------------------------------------------------------------


def arm(file, shoulder, elbow, kind="f4"):
    """The sheet as an arm along x on two bones, of which one hangs on the other at x = 1.5; its weights (n, 2)."""
    n, blend = len(POINTS), np.clip(POINTS[:, 0] - 0.5, 0.0, 2.0) / 2.0
    weights = np.stack([1.0 - blend, blend], axis=1)
    mesh = file.mesh(POINTS, TRIANGLES, SHAPES)
    attributes = file.content["meshes"][mesh]["primitives"][0]["attributes"]
    rows = np.c_[weights, np.zeros((n, 2))] * {"f4": 1.0, "u1": 255, "u2": 65535}[kind]
    rows = rows if kind == "f4" else np.rint(rows)
    attributes["JOINTS_0"] = file.array(np.tile([0, 1, 0, 0], (n, 1)), "u1")
    attributes["WEIGHTS_0"] = file.array(rows, kind, **({} if kind == "f4" else {"normalized": True}))
    nodes = [
        file.node(mesh=mesh, skin=0, name="arm", translation=[50.0, 0.0, 0.0]),  # which does not count
        file.node(name="upper", children=[2], rotation=shoulder.as_quat().tolist()),
        file.node(name="lower", translation=[1.5, 0.0, 0.0], rotation=elbow.as_quat().tolist()),
    ]
    file.content["scenes"] = [{"nodes": nodes[:2]}]
    bind = np.tile(np.eye(4), (2, 1, 1))
    bind[1, 3, 0] = -1.5  # by columns
    file.content["skins"] = [{"joints": nodes[1:], "inverseBindMatrices": file.array(bind.reshape(2, 16))}]
    return weights


def bent(weights, shoulder, elbow, points=POINTS):
    """Where the two bones carry points: in closed form."""
    at_elbow = np.array([1.5, 0.0, 0.0])
    lower = shoulder.apply(elbow.apply(points - at_elbow) + at_elbow)
    return weights[:, :1] * shoulder.apply(points) + weights[:, 1:] * lower


STILL = Rotation.identity()


@pytest.mark.parametrize("kind", ["f4", "u1", "u2"])
def test_two_bones_bend_an_arm(tmp_path, kind):
    file = GltfFile()
    weights = arm(file, STILL, STILL, kind=kind)
    turns = Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.0, 0.0, 1.2]])
    swing = Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.0, -0.8, 0.0]])
    file.animate((1, "rotation", [0.0, 1.0], swing.as_quat()), (2, "rotation", [0.0, 2.0], turns.as_quat()))
    mesh, recorded = fw.read_animation(file.glb(tmp_path / "a.glb"))
    np.testing.assert_allclose(mesh.points, POINTS, atol=1e-6)
    assert (recorded.duration, recorded.pose) == (2.0, None)
    off = {"f4": 1e-6, "u1": 0.012, "u2": 5e-5}[kind]  # weights are so coarse
    for time in (0.0, 0.5, 1.0, 1.7, 2.0):
        shoulder = Rotation.from_rotvec([0.0, -0.8 * min(time, 1.0), 0.0])
        expected = bent(weights, shoulder, Rotation.from_rotvec([0.0, 0.0, 0.6 * time]))
        np.testing.assert_allclose(moved(recorded, mesh, time), expected, atol=off)
    few = np.array([5, 2, 9])
    part = recorded.positions_at(recorded.recorded_time(1.7), np.asarray(mesh.points)[few], few)
    np.testing.assert_allclose(part, moved(recorded, mesh, 1.7)[few], atol=1e-12)


def test_bones_that_are_bent_at_rest_and_shapes_under_them(tmp_path):
    file = GltfFile()
    shoulder, elbow = Rotation.from_rotvec([0.3, 0.0, 0.2]), Rotation.from_rotvec([0.0, 0.0, 0.5])
    weights = arm(file, shoulder, elbow)
    later = Rotation.from_rotvec([0.0, 0.7, -0.4])
    file.animate(
        (2, "rotation", [0.0, 1.0], np.stack([elbow.as_quat(), later.as_quat()])), (0, "weights", TIMES, WEIGHTS)
    )
    path = file.glb(tmp_path / "a.glb")
    mesh, recorded = fw.read_animation(path)
    for surface in (mesh, fw.read_surface(path)):
        np.testing.assert_allclose(surface.points, bent(weights, shoulder, elbow), atol=1e-6)
    np.testing.assert_allclose(
        moved(recorded, mesh, 0.0), bent(weights, shoulder, elbow, summed(WEIGHTS[0])), atol=2e-6
    )
    np.testing.assert_allclose(
        moved(recorded, mesh, 2.0), bent(weights, shoulder, later, summed(WEIGHTS[2])), atol=2e-6
    )


def test_more_than_four_bones_and_points_that_hang_on_none(tmp_path):
    file = GltfFile()
    arm(file, STILL, STILL)
    n, attributes = len(POINTS), file.content["meshes"][0]["primitives"][0]["attributes"]
    shares = np.zeros((n, 8))
    shares[:, [0, 4]] = 0.75, 0.5  # they need not add up to 1
    shares[3] = 0.0
    attributes["JOINTS_0"] = file.array(np.zeros((n, 4)), "u2")
    attributes["JOINTS_1"] = file.array(np.tile([1, 0, 0, 0], (n, 1)), "u1")
    attributes["WEIGHTS_0"], attributes["WEIGHTS_1"] = file.array(shares[:, :4]), file.array(shares[:, 4:])
    file.animate((2, "translation", [0.0, 1.0], [[1.5, 0.0, 0.0], [1.5, 5.0, 0.0]]))
    mesh, recorded = fw.read_animation(file.glb(tmp_path / "a.glb"))
    rise = np.where(np.arange(n) == 3, 0.0, 2.0)  # of five, by two fifths
    np.testing.assert_allclose(moved(recorded, mesh, 1.0) - POINTS, np.outer(rise, [0.0, 1.0, 0.0]), atol=1e-6)


def test_bones_that_carry_other_meshes_alone_do_not_move_this_one(tmp_path):
    file = GltfFile()
    arm(file, STILL, STILL)
    file.node(name="foot")
    file.animate((3, "rotation", [0.0, 1.0], [[0, 0, 0, 1], [0, 1, 0, 0]]))
    with pytest.raises(MeshError, match="no animation.*moves mesh0: neither its shapes nor its node nor bones"):
        fw.read_animation(file.glb(tmp_path / "a.glb"))
    file.content["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = file.array(np.full((16, 4), 2), "u1")
    with pytest.raises(MeshError, match="bones up to 2, and there are 2 bones"):
        fw.read_animation(file.glb(tmp_path / "a.glb"))


def test_lips_on_two_bones_stay_two(tmp_path):
    file, n = GltfFile(), len(POINTS)
    mesh = file.mesh(LIPS, OF_LIPS)
    attributes = file.content["meshes"][mesh]["primitives"][0]["attributes"]
    attributes["JOINTS_0"] = file.array(np.repeat([[0, 0, 0, 0], [1, 0, 0, 0]], n, axis=0), "u1")
    attributes["WEIGHTS_0"] = file.array(np.tile([1.0, 0.0, 0.0, 0.0], (2 * n, 1)))
    file.node(mesh=mesh, skin=0)
    file.content["skins"] = [{"joints": [file.node(name="head", children=[2]), file.node(name="jaw")]}]
    file.animate((2, "translation", [0.0, 1.0], [[0.0, 0.0, 0.0], [0.0, -3.0, 0.0]]))
    path = file.glb(tmp_path / "a.glb")
    surface, recorded = fw.read_animation(path)
    assert surface.n_points == fw.read_surface(path).n_points == 2 * n
    now = moved(recorded, surface, 1.0)
    np.testing.assert_allclose(now - LIPS, np.repeat([[0.0, 0.0, 0.0], [0.0, -3.0, 0.0]], n, axis=0), atol=1e-12)


# --- meshes beside ------------------------------------------------------------------------------


def test_other_meshes_have_recordings_of_their_own(tmp_path):
    file, (small, corners, lift) = GltfFile(), sheet(3, seed=5)
    file.node(children=[1, 2, 3, 4])
    file.node(mesh=file.mesh(POINTS, TRIANGLES, SHAPES, ["smile", "eyeBlinkLeft"]), name="head")
    file.node(mesh=file.mesh(small, corners), name="eye")
    file.node(mesh=file.mesh(small, corners, lift, ["eyeBlinkLeft", "long"]), name="lashes")
    file.node(mesh=file.mesh(small, corners), name="hat")
    turn = Rotation.from_rotvec([0.0, 1.0, 0.0])
    file.animate(
        (1, "weights", TIMES, WEIGHTS), (2, "rotation", [0.0, 2.0], np.stack([STILL.as_quat(), turn.as_quat()]))
    )
    mesh, recorded = fw.read_animation(file.glb(tmp_path / "a.glb"))
    n, k = len(POINTS), len(small)
    assert mesh.n_points == n + 3 * k
    assert set(recorded.companions) == {n, n + k}  # the hat keeps still
    eye, lashes = recorded.companions[n], recorded.companions[n + k]
    np.testing.assert_allclose(eye.positions_at(1.0, small), (turn**0.5).apply(small), atol=1e-6)
    for time, blink in ((0.5, 0.5), (2.0, 0.0), (0.0, 0.25)):  # as the head's shape of that name
        np.testing.assert_allclose(lashes.positions_at(time, small), small + blink * lift[0], atol=1e-12)


def with_lashes(file, name):
    small, corners, lift = sheet(3, seed=5)
    file.content["scenes"] = [{"nodes": [0, 1]}]
    file.node(mesh=file.mesh(small, corners, lift[:1], ["smile"]), name="lashes")
    file.animate((1, "weights", [0.0, 1.0], [[0.0], [1.0]]), name=name)


@pytest.mark.parametrize("name", ["speech", "1", None])
def test_animations_of_one_name_are_all_there(simple, tmp_path, name):
    """Exporters that write one for each object may call them all the same, or as one without a name is called."""
    simple.content["animations"][0]["name"] = name or "1"
    with_lashes(simple, name)
    path = simple.glb(tmp_path / "a.glb")
    with pytest.warns(FaceWrinkleWarning, match="2 meshes"):
        _, recorded = fw.read_animation(path)
    assert recorded.weights(0.5) == {"smile": 1.0, "jawOpen": 0.5}
    assert [other.weights(0.5) for other in recorded.companions.values()] == [{"smile": 0.5}]
    _, recorded = fw.read_animation(path, mesh="lashes", animation=f"{name or 1}.1")
    assert recorded.weights(0.5) == {"smile": 0.5}


def test_animations_of_other_objects_are_played_along(simple, tmp_path):
    with_lashes(simple, "of the lashes")
    simple.animate((1, "weights", [0.0, 1.0], [[0.0], [9.0]]), name="another take of them")
    path = simple.glb(tmp_path / "a.glb")
    with pytest.warns(FaceWrinkleWarning, match="2 meshes"):
        _, recorded = fw.read_animation(path)
    (lashes,) = recorded.companions.values()
    assert lashes.weights(0.5) == {"smile": 0.5}
    _, recorded = fw.read_animation(path, mesh="head", animation="speech")  # this one alone
    assert next(iter(recorded.companions.values())).weights(0.5) == {"smile": 1.0}


def test_a_head_is_taken_before_larger_meshes(tmp_path):
    file = GltfFile()
    big, triangles, shapes = sheet(6)
    file.node(children=[1, 2])
    file.node(mesh=file.mesh(big, triangles, shapes))
    file.node(mesh=file.mesh(POINTS, TRIANGLES, SHAPES))
    file.content["meshes"][0]["name"], file.content["meshes"][1]["name"] = "Wolf3D_Headwear", "Wolf3D_Head"
    file.animate((1, "weights", TIMES, WEIGHTS), (2, "weights", TIMES, WEIGHTS))
    with pytest.warns(FaceWrinkleWarning, match="2 meshes.*Wolf3D_Head, Wolf3D_Headwear"):
        _, recorded = fw.read_animation(file.glb(tmp_path / "a.glb"))
    assert recorded.n_points == len(POINTS)


def test_names_may_stand_with_the_primitives(simple, tmp_path):
    mesh = simple.content["meshes"][0]
    mesh["primitives"][0]["extras"] = mesh.pop("extras")
    path = simple.glb(tmp_path / "a.vrm")
    assert fw.read_animation(path)[1].names == ("smile", "jawOpen")
    assert fw.read_surface(path).n_points == len(POINTS)


def test_shapes_that_bend_normals_alone_displace_nothing(simple, tmp_path):
    simple.content["meshes"][0]["primitives"][0]["targets"][0] = {"NORMAL": 0}
    _, recorded = fw.read_animation(simple.glb(tmp_path / "a.glb"))
    np.testing.assert_allclose(recorded.deltas, [0.0 * SHAPES[0], SHAPES[1]])


# --- what cannot be read ------------------------------------------------------------------------


def backwards(file):
    start = file.content["bufferViews"][-2]["byteOffset"]
    file.blob[start : start + 12] = np.array([2.0, 1.0, 0.0], "<f4").tobytes()


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda file: file.content["accessors"][0].update(count=10_000), "damaged"),
        (lambda file: file.content["accessors"][0].update(bufferView=99), "number 99 of 6 bufferViews"),
        (lambda file: file.content["accessors"][0].update(count=3), "faces use points up to 15, and it has 3"),
        (lambda file: file.content["accessors"][-1].update(count=5), "3 times and 5 numbers for 2"),
        (lambda file: file.content.pop("animations"), "holds no animation.*fit_face"),
        (lambda file: file.content.update(nodes=[{}]), "holds no mesh"),
        (backwards, "increasing"),
    ],
)
def test_broken_files_are_refused(simple, tmp_path, change, message):
    change(simple)
    with pytest.raises(fw.FaceWrinkleError, match=message):
        fw.read_animation(simple.glb(tmp_path / "a.glb"))


def test_points_that_are_not_finite_are_refused(tmp_path):
    shapes = SHAPES.copy()
    shapes[1, 3, 2] = np.nan
    with pytest.raises(fw.FaceWrinkleError, match=r"finite; entry \[1, 3, \d\] is nan"):
        fw.read_animation(talking(shapes=shapes).glb(tmp_path / "a.glb"))


@pytest.mark.parametrize("name", ["b.glb", "b.gltf"])
@pytest.mark.parametrize("data", [b"glTF" + b"\0" * 40, b"not a file of this kind", b"{"])
def test_damaged_files_are_refused(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(MeshError, match=f"{name} cannot be read.*damaged"):
        fw.read_animation(tmp_path / name)


def test_other_files_are_refused(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\n")
    (tmp_path / "c.glb").write_bytes(b"")
    for name, message in (("a.obj", "animations are read from"), ("c.glb", "empty"), ("none.glb", "no file")):
        with pytest.raises(MeshError, match=message):
            fw.read_animation(tmp_path / name)


AVATAR = ["jawOpen", "mouthSmile_L", "mouthSmileRight", "head.browInnerUp"]


def avatar(tmp_path):
    """A mesh with four shapes, teeth that have one of them, and no animation."""
    points, triangles, _ = sheet()
    deltas = np.random.default_rng(1).integers(-64, 64, (4, len(points), 3)) / 128.0
    file = GltfFile()
    file.content["scenes"] = [{"nodes": [0, 1]}]
    file.node(mesh=file.mesh(points, triangles, deltas, AVATAR))
    file.node(mesh=file.mesh(points[:4] - [0, 0, 9], [[0, 1, 2], [1, 3, 2]], deltas[:1, :4], AVATAR[:1]))
    return file.glb(tmp_path / "avatar.glb"), points, deltas


@pytest.mark.parametrize(
    ("asked", "weights"),
    [
        ({"mouthSmile": 0.75}, (0.0, 0.75, 0.75, 0.0)),
        ({"mouth_smile_left": 0.5, "jawOpen": 1.0}, (1.0, 0.5, 0.0, 0.0)),
        ({"browInnerUp": 0.25}, (0.0, 0.0, 0.0, 0.25)),
    ],
)
@pytest.mark.filterwarnings("ignore:.*meshes that may be meant")
def test_shapes_without_an_animation_are_taken_and_held(tmp_path, asked, weights):
    path, points, deltas = avatar(tmp_path)
    recorded = fw.read_animation(path, shapes=asked)[1]
    np.testing.assert_array_equal(recorded.positions_at(0.0, points), points)
    for time in (1.0, recorded.duration):
        there = points + np.tensordot(weights, deltas, 1)
        np.testing.assert_allclose(recorded.positions_at(time, points), there, atol=1e-12)
    if weights[0]:  # the jaw takes the teeth along
        (teeth,) = recorded.companions.values()
        assert teeth.weights(1.0) == {"jawOpen": 1.0}


@pytest.mark.filterwarnings("ignore:.*meshes that may be meant")
def test_shapes_that_are_not_there_are_refused(tmp_path):
    path, *_ = avatar(tmp_path)
    with pytest.raises(MeshError, match="no animation.* has 4 shapes .jawOpen, .*ask for some shapes"):
        fw.read_animation(path)
    with pytest.raises(UnknownNameError, match="'mouthSmil'.*mouthSmile_L"):
        fw.read_animation(path, shapes={"mouthSmil": 1.0})
    with pytest.raises(ParameterError, match="weight of the shape jawOpen must lie in"):
        fw.read_animation(path, shapes={"jawOpen": 3.0})
    (tmp_path / "head.usda").write_text("#usda 1.0")
    with pytest.raises(ParameterError, match="glb and .gltf"):
        fw.read_animation(tmp_path / "head.usda", shapes={"jawOpen": 1.0})
