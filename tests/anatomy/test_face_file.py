"""Faces in files: what was written comes back, and what was not written by us is refused."""

import dataclasses

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.errors import FaceWrinkleWarning, MeshError, OutputError


def assert_equal(ours, theirs):
    """Compare meshes, dataclasses, tables and arrays by all that they hold."""
    assert type(ours) is type(theirs)
    if isinstance(ours, pv.PolyData):
        np.testing.assert_array_equal(ours.points, theirs.points)
        np.testing.assert_array_equal(ours.faces, theirs.faces)
        for mine, other in ((ours.point_data, theirs.point_data), (ours.cell_data, theirs.cell_data)):
            assert_equal({k: np.asarray(mine[k]) for k in mine}, {k: np.asarray(other[k]) for k in other})
        assert ours.point_data.active_texture_coordinates_name == theirs.point_data.active_texture_coordinates_name
    elif dataclasses.is_dataclass(ours):
        for field in dataclasses.fields(ours):
            assert_equal(getattr(ours, field.name), getattr(theirs, field.name))
    elif isinstance(ours, dict):
        assert list(ours) == list(theirs)
        for name, value in ours.items():
            assert_equal(value, theirs[name])
    elif isinstance(ours, list | tuple):
        assert len(ours) == len(theirs)
        for mine, other in zip(ours, theirs, strict=True):
            assert_equal(mine, other)
    else:
        np.testing.assert_array_equal(ours, theirs)


@pytest.fixture
def every_field_set():
    """A face none of whose fields has its default."""
    face = fw.default_face({"jaw": 0.5, "age": 0.75, "iris": 0.5})
    rest = fw.Face.from_landmarks(face.mesh, face.landmarks, 2.5, None, ("trichion", "gonion_l"))
    ball = pv.Sphere(radius=90.0, center=(0, 120, 0))
    hat = fw.anatomy.Part(ball, "mandible", "l", face.texture[::4], np.arange(842)[::-1], np.zeros(ball.n_cells, int))
    return dataclasses.replace(
        rest,
        texture=face.texture,
        bound_hair=face.bound_hair,
        confidences={"nose_tip": 0.9, "trichion": 0.25},
        source_points=np.arange(len(face.points))[::-1],
        parts={"hat": hat},
        report=("Dropped specks: 1.",),
        likeness=0.87,
        age=face.age,
        iris=face.iris,
    )


def test_every_field_of_a_face_comes_back(every_field_set, tmp_path):
    for field in dataclasses.fields(fw.Face):
        if field.default is not dataclasses.MISSING:
            assert getattr(every_field_set, field.name) is not field.default, f"set {field.name} to another value"
        elif field.default_factory is not dataclasses.MISSING:
            assert getattr(every_field_set, field.name), f"set {field.name} to another value"
    for face in (every_field_set, fw.Face.from_landmarks(every_field_set.mesh, every_field_set.landmarks, 1.0)):
        assert_equal(fw.read_face(fw.write_face(face, tmp_path / "head.face")), face)


def test_a_surface_comes_back(face, tmp_path):
    scene = pv.MultiBlock([face.mesh, pv.Sphere(center=(0, 300, 0))])
    with pytest.warns(FaceWrinkleWarning, match="Kept one of"):
        surface = fw.surface(scene, units="cm", texture=face.texture)
    again = fw.read_face(fw.write_face(surface, tmp_path / "cloth.face"))
    assert_equal(again, surface)
    assert fw.Simulation(again).step().n_points == surface.mesh.n_points


@pytest.mark.parametrize(("follows", "numbered"), [("eye", True), ("skin", False)])
def test_a_part_of_ones_own_comes_back(face, tmp_path, follows, numbered):
    eye = face.eyes[0]
    shifted = eye.centre + np.array([0.0, 0.0, 1.0])
    ball = pv.Sphere(radius=1.2 * eye.radius, center=shifted)
    sheet = np.zeros(ball.n_cells, np.int32) if numbered else None
    own = dataclasses.replace(face, parts={f"eye_{eye.side}": fw.anatomy.Part(ball, follows, eye.side, sheet=sheet)})
    again = fw.read_face(fw.write_face(own, tmp_path / "own.face"))
    assert_equal(again.parts, own.parts)
    np.testing.assert_allclose(again.eyes[0].centre, shifted, atol=1e-3)
    assert again.eyes[0].radius == pytest.approx(1.2 * eye.radius, rel=1e-3)
    moved = face.mesh.copy()
    moved.points += [0.0, 7.0, 0.0]
    (there,) = again.parts_at(moved).values()
    np.testing.assert_allclose(there.points, ball.points + np.float32([0.0, 7.0, 0.0]), atol=1e-4)
    assert "parts" in again.with_parts(face.mesh).field_data


def test_changed_muscles_are_told(face, tmp_path):
    muscle = face.muscles["corrugator_l"]
    changed = face.with_muscles({"corrugator_l": dataclasses.replace(muscle, insertion=muscle.insertion + 1.0)})
    with pytest.warns(FaceWrinkleWarning, match="that were changed are not stored: corrugator_l. read_face"):
        fw.write_face(changed, tmp_path / "changed.face")
    without = dataclasses.replace(face, muscles={})
    with pytest.warns(FaceWrinkleWarning, match="corrugator_l, corrugator_r, "):
        fw.write_face(without, tmp_path / "changed.face")


STRANGE = r"bad\.face was not written by facewrinkle.*facewrinkle fit"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"not a zip", STRANGE),
        (b"PK\x03\x04 broken", STRANGE),
        ({"version": 99}, "later facewrinkle"),
        ({"triangles": np.array([[0, 1, 99999]])}, "its triangles must be whole numbers"),
        ({"landmarks": np.zeros((33, 2))}, "was not written by facewrinkle"),
        ({"confidences": np.zeros(3)}, "was not written by facewrinkle"),
        ({"points": np.array(["x"])}, "its points must be numbers of the shape"),
        ({"landmark_names": np.array([{}], dtype=object)}, "was not written by facewrinkle"),  # code could hide in it
    ],
)
def test_other_files_are_refused(arrays_of_all, tmp_path, content, message):
    path = tmp_path / "bad.face"
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        with path.open("wb") as file:
            np.savez(file, **{**arrays_of_all, **content})
    with pytest.raises(MeshError, match=message):
        fw.read_face(path)


def test_files_that_are_not_there_or_of_another_kind(face, tmp_path):
    np.savez(tmp_path / "a.npz", points=np.eye(3))
    for name, message in (("bad.face", "there is no file"), ("a.npz", "was not written by facewrinkle")):
        with pytest.raises(MeshError, match=message):
            fw.read_face(tmp_path / name)
    with pytest.raises(OutputError, match="cannot be written"):
        fw.write_face(face, tmp_path / "a.npz" / "a.face")


DAMAGE = {
    "unit": [0.0, np.nan, np.inf, -1.0, 1e300, 1e-12, "mm", [1.0, 2.0]],
    "age": [np.nan, 7.0],
    "points": [0.0, np.nan, 1e300, 1e45],
    "triangles": [-1, 0.5, 10**9],
    "landmarks": [np.nan, 1e60],
    "texture": [0.5, np.int64(7), np.zeros((0, 4, 3), np.uint8), np.zeros(4, np.uint8), np.zeros((4, 4, 2), np.uint8)],
    "brows/triangles": [10**6, -1, 0.5, np.zeros((3, 2), np.int64)],
    "brows/weights": [np.nan, 1e9, np.zeros((2, 2, 3))],
    "brows/heights": [np.nan, np.zeros(99)],
    "brows/color": [np.nan, 300.0, np.zeros(4)],
    "cropped_hair/triangles": [10**6, -1],
    "cropped_hair/weights": [np.nan, 1e9],
    "cropped_hair/heights": [np.nan, np.zeros(3)],
    "beard/triangles": [10**6, -1],
    "beard/weights": [np.nan, 1e9],
    "point_data/Texture Coordinates": [np.nan],
    "parts/eye_l/points": [np.nan],
    "parts/eye_l/triangles": [np.zeros((0, 3), np.int64), 10**6],
    "source_points": [-1, 0.5],
}


@pytest.fixture(scope="module")
def arrays_of_all(face, tmp_path_factory):
    """The arrays of a file of a face with all that may be in one."""
    whole = dataclasses.replace(
        face,
        parts={"eye_l": fw.anatomy.Part(pv.Sphere(radius=12.0, center=face.eyes[0].centre), "eye", "l")},
        source_points=np.arange(face.mesh.n_points),
        bound_hair=face.bound_hair | fw.default_face({"beard": 0.5}).bound_hair,
    )
    with np.load(fw.write_face(whole, tmp_path_factory.mktemp("face") / "a.face")) as stored:
        return dict(stored)


@pytest.mark.parametrize(("name", "value"), [(name, value) for name, values in DAMAGE.items() for value in values])
def test_damaged_numbers_are_refused_where_they_come_in(arrays_of_all, tmp_path, name, value):
    """One number that cannot be, or an array of another size or kind."""
    if np.ndim(value) or isinstance(value, str) or name == "unit":
        changed = np.asarray(value)
    else:
        kept = arrays_of_all[name]
        changed = kept.astype(np.result_type(kept, np.asarray(value).dtype))
        changed[...] = np.where(np.arange(kept.size).reshape(kept.shape) == 0, value, changed) if value else 0.0
    with (tmp_path / "a.face").open("wb") as file:
        np.savez(file, **{**arrays_of_all, name: changed})
    with pytest.raises(MeshError, match=r"a\.face (was not written by facewrinkle, or )?is damaged.*facewrinkle fit"):
        fw.read_face(tmp_path / "a.face")


def test_files_that_would_fill_the_memory_are_refused(arrays_of_all, tmp_path, monkeypatch):
    monkeypatch.setattr("facewrinkle.anatomy.face_file.LARGEST_FILE", 60_000_000)
    with (tmp_path / "bomb.face").open("wb") as file:
        np.savez_compressed(file, **{**arrays_of_all, "point_data/x": np.zeros(10_000_000)})
    with pytest.raises(MeshError, match=r"would take .* GB of memory, and a face takes .* at most"):
        fw.read_face(tmp_path / "bomb.face")
