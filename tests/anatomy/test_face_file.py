"""Faces in files: what was written comes back, and what was not written by us is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.errors import MeshError, OutputError


def test_a_face_comes_back(face, tmp_path):
    marked = dataclasses.replace(
        face,
        estimated=("trichion", "gonion_l"),
        confidences={"nose_tip": 0.9, "trichion": 0.25},
        unit=2.5,
        likeness=0.87,
        report=("Dropped specks: 1.",),
    )
    again = fw.read_face(fw.write_face(marked, tmp_path / "head.face"))
    assert np.array_equal(again.points, face.points)
    assert np.array_equal(again.triangles, face.triangles)
    assert list(again.landmarks) == list(face.landmarks)
    for name, point in face.landmarks.items():
        assert np.array_equal(again.landmarks[name], point)
    assert (again.unit, again.estimated, again.confidences) == (2.5, marked.estimated, marked.confidences)
    assert (again.likeness, again.report) == (0.87, marked.report)
    assert fw.read_face(fw.write_face(face, tmp_path / "head.face")).likeness is None  # as in files of old
    assert np.array_equal(again.mesh["Colors"], face.mesh["Colors"])
    assert np.array_equal(again.mesh.active_texture_coordinates, face.mesh.active_texture_coordinates)
    assert list(again.muscles) == list(face.muscles)
    rest = fw.Face.from_landmarks(face.mesh, face.landmarks, 2.5)
    np.testing.assert_array_equal(again.tissue.depth, rest.tissue.depth)


def test_other_files_are_refused(face, tmp_path):
    path = tmp_path / "bad.face"
    with pytest.raises(MeshError, match="there is no file"):
        fw.read_face(path)
    path.write_bytes(b"")
    with pytest.raises(MeshError, match="is empty"):
        fw.read_face(path)
    for content in (b"not a zip", b"PK\x03\x04 broken"):
        path.write_bytes(content)
        with pytest.raises(MeshError, match=r"bad\.face is no face that facewrinkle wrote.*facewrinkle fit"):
            fw.read_face(path)
    np.savez(path.with_suffix(".npz"), points=np.eye(3))
    with pytest.raises(MeshError, match="is no face"):
        fw.read_face(path.with_suffix(".npz"))
    good = fw.write_face(face, tmp_path / "good.face")
    with np.load(good) as stored:
        arrays = {name: stored[name] for name in stored.files}
    for change, message in (
        ({"version": 99}, "later facewrinkle"),
        ({"triangles": np.array([[0, 1, 99999]])}, "must use"),
        ({"unit": np.nan}, "unit must be a finite number greater than 0"),
        ({"unit": -1.0}, "unit must be a finite number greater than 0"),
        ({"report": np.array([1.0, 2.0])}, "report must be text, received float64"),
        ({"landmarks": np.full_like(arrays["landmarks"], np.nan)}, "landmarks must be finite numbers"),
        ({"landmarks": arrays["landmarks"][:, :2]}, "is no face"),
        ({"confidences": arrays["confidences"][:3]}, "is no face"),
        ({"points": np.array(["x"])}, "points must be an array of real numbers"),
    ):
        with path.open("wb") as file:
            np.savez(file, **{**arrays, **change})
        with pytest.raises(MeshError, match=message):
            fw.read_face(path)
    with path.open("wb") as file:  # code could hide in objects
        np.savez(file, **{**arrays, "landmark_names": np.array([{}], dtype=object)})
    with pytest.raises(MeshError, match="is no face"):
        fw.read_face(path)
    with pytest.raises(OutputError, match="cannot be written"):
        fw.write_face(face, good / "a.face")


def test_what_is_not_ours_in_a_face_file_is_not_read(face, tmp_path, monkeypatch):
    good = fw.write_face(face, tmp_path / "good.face")
    with np.load(good) as stored:
        arrays = {name: stored[name] for name in stored.files}
    with (tmp_path / "large.face").open("wb") as file:
        np.savez_compressed(file, **arrays, unused=np.zeros(10_000_000))
    monkeypatch.setattr("facewrinkle.anatomy.face_file.LARGEST_FILE", 60_000_000)
    assert fw.read_face(tmp_path / "large.face").mesh.n_cells == face.mesh.n_cells
    with (tmp_path / "bomb.face").open("wb") as file:
        np.savez_compressed(file, **{**arrays, "point_data/x": np.zeros(10_000_000)})
    with pytest.raises(MeshError, match=r"would take .* GB of memory, and a face takes .* at most"):
        fw.read_face(tmp_path / "bomb.face")


@pytest.mark.parametrize("place", [0.02, 0.3, 0.5, 0.9, 0.999])
def test_flipped_bytes(face, tmp_path, place):
    good = bytearray(fw.write_face(face, tmp_path / "good.face").read_bytes())
    at = int(place * len(good))
    good[at : at + 12] = b"\xff" * 12
    (tmp_path / "bad.face").write_bytes(good)
    with pytest.raises(MeshError, match=r"bad\.face is no face that facewrinkle wrote"):
        fw.read_face(tmp_path / "bad.face")
