"""What comes with a face, through files and back: eyes with colors, hair with a photo that is partly transparent."""

import dataclasses
import warnings

import numpy as np
import pytest
import pyvista as pv
from glb_files import GltfFile, read_glb

import facewrinkle as fw
from facewrinkle.anatomy.landmarks import write_landmarks
from facewrinkle.anatomy.parts import follower
from facewrinkle.cli import main
from facewrinkle.mesh import corner_texture, to_polydata
from facewrinkle.plotting import Scene, Style, picture

pytestmark = pytest.mark.filterwarnings("ignore:.*bad X server")

PHOTO = np.random.default_rng(4).integers(0, 256, (9, 7, 4), dtype=np.uint8)
RED, WHITE = [200, 20, 20], [212, 204, 199]
NAMES = ["eye_l", "eye_r", "hair"]
PAINTED = ["brows", "lashes_l", "lashes_r"]


def card(face):
    """A sheet over the head with more triangles than the skin, and its texture coordinates."""
    plane = pv.Plane(i_resolution=56, j_resolution=50).triangulate()
    size, axes = face.frame.pupil_distance, face.frame.axes
    local = np.asarray(plane.points, float) * [2.2, 1.6, 0.0] + [0.0, 1.5, 0.6]
    mesh = to_polydata(local * size @ axes + face.frame.origin, plane.regular_faces)
    mesh.point_data["Texture Coordinates"] = np.asarray(plane.points, float)[:, :2] + 0.5
    mesh.point_data.active_texture_coordinates_name = "Texture Coordinates"
    return mesh


@pytest.fixture(scope="module")
def dressed(face):
    """The built-in head with eyes of its own, red all over the iris, and a card of hair."""
    parts = {"hair": follower("hair", card(face), PHOTO)}
    for eye in face.eyes:
        ball = pv.Sphere(radius=eye.radius, center=eye.centre, theta_resolution=40, phi_resolution=40)
        mesh = to_polydata(ball.points, ball.regular_faces)
        ahead = (np.asarray(mesh.points) - eye.centre) @ eye.gaze > 0.87 * eye.radius
        mesh.point_data["Colors"] = np.where(ahead[:, None], RED, WHITE).astype(np.uint8)
        parts[f"eye_{eye.side}"] = follower(f"eye_{eye.side}", mesh, sheet=np.zeros(mesh.n_cells, np.int64))
    return dataclasses.replace(face, parts={name: parts[name] for name in NAMES})


def fitted(source, face):
    with warnings.catch_warnings(action="ignore", category=fw.FaceWrinkleWarning):
        scale = 1.0 if isinstance(source, pv.PolyData) else 1e-3
        return fw.fit_face(source, {name: scale * p for name, p in face.landmarks.items()}, units=1.0 / scale)


@pytest.fixture(scope="module")
def written(dressed, tmp_path_factory):
    return fw.write_mesh(dressed.mesh, tmp_path_factory.mktemp("parts") / "dressed.glb", dressed, parts=True)


def test_what_is_written_is_read_again(dressed, written):
    again = fitted(written, dressed)
    assert list(again.parts) == ["eye_l", "eye_r", "fuzz", "hair", "lashes_l", "lashes_r"]
    assert again.mesh.n_cells == dressed.mesh.n_cells
    np.testing.assert_array_equal(again.texture, dressed.texture)  # that of the skin, though the hair has more faces
    np.testing.assert_array_equal(again.parts["hair"].texture, PHOTO)
    for name in NAMES:
        old, new = dressed.parts[name], again.parts[name]
        assert new.follows == old.follows
        np.testing.assert_allclose(1e3 * new.mesh.points, old.mesh.points, atol=1e-4)
    np.testing.assert_allclose(
        corner_texture(again.parts["hair"].mesh), corner_texture(dressed.parts["hair"].mesh), atol=1e-6
    )
    eye = again.parts["eye_l"]
    np.testing.assert_array_equal(eye.mesh["Colors"], dressed.parts["eye_l"].mesh["Colors"])
    assert eye.texture is None
    assert "Colors" not in again.parts["hair"].mesh.point_data
    assert "Colors" not in again.mesh.point_data  # the white that stands for none


def test_eyes_of_ones_own_are_written_in_place_of_painted_ones(dressed, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    simulation = fw.Simulation(dressed, layers=[])
    simulation.look(yaw=25.0)
    *_, frame = simulation.run(3)
    scene = trimesh.load_scene(fw.write_mesh(frame, tmp_path / "a.glb", dressed, parts=True), process=False)
    assert set(scene.geometry) == {"face", *NAMES, *PAINTED}
    wanted = dressed.parts_at(frame)
    for name in NAMES:
        geometry = scene.geometry[name]
        assert len(geometry.faces) == wanted[name].n_cells
        np.testing.assert_allclose(geometry.vertices, wanted[name].points, atol=1e-3)
    assert np.abs(wanted["eye_l"].points - dressed.parts["eye_l"].mesh.points).max() > 3.0
    material = scene.geometry["hair"].visual.material
    np.testing.assert_array_equal(np.asarray(material.baseColorTexture), PHOTO)
    assert material.alphaMode == "MASK"


def test_photos_of_parts_are_in_the_picture(dressed):
    green = np.zeros((4, 4, 4), np.uint8)
    green[..., 1], green[..., 3] = 255, 255
    style = Style((96, 96), view="front", brows=False)
    shown = {}
    for alpha in (255, 0):
        green[..., 3] = alpha
        part = dataclasses.replace(dressed.parts["hair"], texture=green.copy())
        shown[alpha] = picture(dressed.mesh, dataclasses.replace(dressed, parts={"hair": part}), style).astype(int)
    is_green = shown[255][..., 1] > 1.5 * shown[255][..., [0, 2]].max(axis=2)
    assert 0.05 < is_green.mean() < 0.5
    assert is_green[:48].sum() > 10 * is_green[48:].sum()  # over the brow
    assert not (shown[0][..., 1] > 1.5 * shown[0][..., [0, 2]].max(axis=2)).any()


def test_parts_stay_with_a_head_that_turns(dressed, face):
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = [[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]], [4.0, 7.0, -3.0]
    frame = fw.Simulation(face, layers=[]).step()
    moved = frame.copy()
    moved.points = np.asarray(frame.points) @ turn[:3, :3].T + turn[:3, 3]
    moved.point_data["Normals"] = np.asarray(frame["Normals"]) @ turn[:3, :3].T
    moved.field_data["pose"] = turn
    style = Style((96, 96), follow=True)
    still, followed = (picture(f, dressed, style).astype(int) for f in (frame, moved))
    assert np.abs(still - followed).mean() < 0.1
    with Scene(dressed, Style((64, 64))) as scene:
        scene.show(moved)
        np.testing.assert_array_equal(scene.plotter.actors["own hair"].user_matrix, np.eye(4))
        where = dressed.parts["hair"].mesh.points @ turn[:3, :3].T + turn[:3, 3]
        np.testing.assert_allclose(scene.plotter.actors["own hair"].mapper.dataset.points, where, atol=1e-9 * 1e3)


@pytest.fixture(scope="module")
def animated(written, played, tmp_path_factory):
    """The same file without what was painted, and with a shape on the skin that comes within half a second."""
    file = GltfFile()
    file.content, file.blob = read_glb(written)
    (scene,), nodes = file.content["scenes"], file.content["nodes"]
    scene["nodes"] = [k for k in scene["nodes"] if nodes[k]["name"] not in PAINTED]
    face = next(mesh for mesh in file.content["meshes"] if mesh["name"] == "face")
    skin = file.content["accessors"][face["primitives"][0]["attributes"]["POSITION"]]
    shape = np.asarray(played("paper_surprise").held.displacement)
    assert skin["count"] == len(shape)  # the built-in head has no seams
    face["primitives"][0]["targets"] = [{"POSITION": file.array(shape)}]
    node = next(i for i, node in enumerate(file.content["nodes"]) if node["name"] == "face")
    file.animate((node, "weights", [0.0, 0.5], [[0.0], [1.0]]))
    return file.glb(tmp_path_factory.mktemp("animated") / "clip.glb")


def test_the_other_meshes_of_an_animation_come_along(dressed, animated, tmp_path):
    rest, recorded = fw.read_animation(animated)
    assert recorded.n_points == dressed.mesh.n_points
    assert rest.n_cells == dressed.mesh.n_cells + sum(part.mesh.n_cells for part in dressed.parts.values())
    rest.points = 1e3 * np.asarray(rest.points)
    recorded = dataclasses.replace(recorded, deltas=1e3 * recorded.deltas, rest=1e3 * recorded.rest)
    face = fitted(rest, dressed)
    assert list(face.parts) == NAMES
    np.testing.assert_array_equal(face.parts["hair"].texture, PHOTO)
    np.testing.assert_array_equal(face.texture, dressed.texture)
    levels = [0, 1, 1, 1, 1]  # the first shows the triangles of the face itself
    sims = [fw.Simulation(face, fw.Refinement(max_level=k), motion=recorded, time_step=0.1) for k in (0, 1)]
    frames = [pair[level] for level, pair in zip(levels, zip(*(sim.run(5) for sim in sims), strict=True), strict=True)]
    np.testing.assert_allclose(frames[-1].points[: len(face.points)], rest.points[: len(face.points)], atol=30.0)
    # As a series, which is an animation again, with the parts as they are at rest.
    path = fw.export.write_series(map(face.with_parts, frames), 0.1 * np.arange(1, 6), tmp_path / "clip.vtkhdf")
    once_more, positions = fw.read_animation(path)
    assert positions.n_points == face.mesh.n_points
    again = fitted(once_more, dressed)
    assert list(again.parts) == NAMES
    for name, part in face.parts.items():
        np.testing.assert_allclose(again.parts[name].mesh.points, part.mesh.points, atol=1e-6)
    np.testing.assert_array_equal(again.parts["eye_l"].mesh["Colors"], face.parts["eye_l"].mesh["Colors"])


@pytest.fixture(scope="module")
def lively(face, tmp_path_factory):
    """A clip of the head, in mm, whose right eye turns, whose lashes have the blink of the skin, and whose hair nods.

    The left eye and the teeth keep still in it; the head turns as a whole.
    """
    blink = np.zeros_like(face.points)
    lids = np.linalg.norm(face.points - face.landmarks["eye_l_centre"], axis=1) < 0.35 * face.frame.pupil_distance
    blink[lids, 1] = -2.0
    eyes = {eye.side: pv.Sphere(radius=eye.radius, center=[0.0] * 3).triangulate() for eye in face.eyes}
    centres = {eye.side: eye.centre for eye in face.eyes}
    lash = pv.Plane(i_size=22.0, j_size=5.0, i_resolution=12, j_resolution=3).triangulate()
    rim = np.asarray(lash.points) + centres["l"] + [0.0, 4.0, face.eyes[0].radius + 4.0]
    fall = np.tile([0.0, -7.0, 0.0], (lash.n_points, 1))
    cap = np.asarray(card(face).points)
    file = GltfFile()

    def node(name, points, triangles, *shapes, **place):
        return file.node(mesh=file.mesh(points, triangles, shapes, ["eyeBlinkLeft"][: len(shapes)], name=name), **place)

    skin = node("face", face.points, face.triangles, blink)
    balls = {
        side: node(f"eye {side}", ball.points, ball.regular_faces, translation=centres[side].tolist())
        for side, ball in eyes.items()
    }
    lashes, hair = node("lashes", rim, lash.regular_faces, fall), node("hair", cap, card(face).regular_faces)
    head = file.node(children=[skin, *balls.values(), lashes, hair])
    file.content["scenes"] = [{"nodes": [head]}]
    times, turns = [0.0, 1.0], [[0.0, 0.0, 0.0, 1.0], [0.0, np.sin(0.1), 0.0, np.cos(0.1)]]
    file.animate(
        (skin, "weights", times, [[0.0], [1.0]]),
        (head, "rotation", times, turns),
        (balls["r"], "rotation", times, turns),
        (hair, "translation", times, [[0.0] * 3, [0.0, 3.0, 0.0]]),
    )
    return file.glb(tmp_path_factory.mktemp("lively") / "clip.glb")


def test_parts_that_the_file_moves_go_where_it_says(lively, face, tmp_path):
    rest, recorded = fw.read_animation(lively)
    with warnings.catch_warnings(action="ignore", category=fw.FaceWrinkleWarning):
        whole = fw.fit_face(rest, face.landmarks, units="mm")
    assert list(whole.parts) == ["eye_l", "eye_r", "hair", "lashes_l"]
    frames = list(fw.Simulation(whole, fw.Refinement(max_level=0), layers=[], motion=recorded, time_step=0.5).run(2))
    frame = frames[-1]
    assert {name for name in frame.field_data if name.startswith("part_")} == {
        "part_eye_r",
        "part_hair",
        "part_lashes_l",
    }
    turn = np.array([[np.cos(0.2), 0.0, np.sin(0.2)], [0.0, 1.0, 0.0], [-np.sin(0.2), 0.0, np.cos(0.2)]])
    np.testing.assert_allclose(frame.field_data["pose"][:3, :3], turn, atol=1e-6)
    now, before = whole.parts_at(frame), {name: np.asarray(part.mesh.points) for name, part in whole.parts.items()}
    (centre,) = (eye.centre for eye in face.eyes if eye.side == "r")
    expected = {
        "eye_l": before["eye_l"] @ turn.T,  # carried: it keeps still on the head
        "eye_r": ((before["eye_r"] - centre) @ turn.T + centre) @ turn.T,
        "hair": (before["hair"] + [0.0, 3.0, 0.0]) @ turn.T,
        "lashes_l": (before["lashes_l"] + [0.0, -7.0, 0.0]) @ turn.T,  # by the weight of the face's shape of that name
    }
    for name, points in expected.items():
        np.testing.assert_allclose(now[name].points, points, atol=2e-4)
    gaze = {eye.side: eye.gaze for eye in whole.eyes}
    np.testing.assert_allclose(np.ravel(frame.field_data["gaze_r"]), turn @ gaze["r"], atol=1e-5)
    assert "gaze_l" not in frame.field_data
    # The face may come from a file of its own: points are known by their places.
    kept = fw.read_face(fw.write_face(whole, tmp_path / "a.face"))
    *_, same = fw.Simulation(kept, fw.Refinement(max_level=0), layers=[], motion=recorded, time_step=0.5).run(2)
    for name, part in kept.parts_at(same).items():
        np.testing.assert_allclose(part.points, expected[name], atol=2e-4)
    # And once more, from the series that is written of it.
    path = fw.export.write_series(map(whole.with_parts, frames), [0.5, 1.0], tmp_path / "clip.vtkhdf")
    again, positions = fw.read_animation(path)
    assert not [name for name in pv.read(path).field_data if name.startswith("part_")]
    with warnings.catch_warnings(action="ignore", category=fw.FaceWrinkleWarning):
        replayed = fw.fit_face(again, face.landmarks, units="mm")
    *_, last = fw.Simulation(replayed, fw.Refinement(max_level=0), layers=[], motion=positions, time_step=0.5).run(1)
    for name, part in replayed.parts_at(last).items():
        np.testing.assert_allclose(part.points, expected[name], atol=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize("command", ["tear", "play"])
def test_series_of_the_commands_hold_the_parts(dressed, animated, tmp_path, command):
    if command == "tear":
        fw.write_face(dressed, tmp_path / "a.face")
        given = ["shedding", "--face", str(tmp_path / "a.face"), "--seconds", "0.5", "--fps", "8", "--clay"]
    else:
        write_landmarks({name: 1e-3 * p for name, p in dressed.landmarks.items()}, tmp_path / "a.json")
        given = [str(animated), "--landmarks", str(tmp_path / "a.json"), "--fps", "8", "--max-level", "1"]
    out = tmp_path / "out"
    assert main([command, *given, "--size", "48", "--no-movie", "--series", "--quiet", "--out", str(out)]) == 0
    (path,) = (p for p in out.glob("*.vtkhdf") if "_tears" not in p.name)
    frame = pv.read(path)
    listed = list(frame.field_data["parts"])
    assert listed == ["skin", *NAMES]
    hair = np.asarray(frame.points)[frame["part"] == listed.index("hair")]
    rest = (1.0 if command == "tear" else 1e-3) * np.asarray(dressed.parts["hair"].mesh.points)
    size = np.linalg.norm(rest[0] - rest[-1])
    assert np.linalg.norm(hair[0] - hair[-1]) == pytest.approx(size, rel=1e-5)  # it goes bodily
    np.testing.assert_allclose(hair, rest, atol=1e-3 * size)


def test_lashes_are_drawn_where_a_face_has_eyes_and_no_lashes(dressed):
    with Scene(dressed, Style((48, 48))) as scene:
        scene.show(dressed.mesh)
        assert {"lashes_l", "lashes_r"} <= scene.drawn_parts["hair"]
        assert "own eye_l" in scene.plotter.actors
        assert not scene.drawn_parts["eyes"]
