"""Faces and clips that are opened, and what plays them.

a mesh with its landmarks | fit_face on the same file
a series of frames        | opened again, it moves as it was played
faces of a document       | refitted from the same landmarks
names                     | never taken twice
"""

import numpy as np
import pytest
from studio_pages import head_files

import facewrinkle as fw
from facewrinkle.errors import LandmarkError, MeshError, ParameterError, UnknownNameError
from facewrinkle.live.library import Library, Loaded, opened
from facewrinkle.session import Session, Subject
from facewrinkle.session.player import Player
from facewrinkle.session.session import START


def heard():
    told = []
    return told, lambda what, share: told.append((what, share))


def test_a_mesh_with_landmarks_is_fitted(tmp_path, face):
    told, tell = heard()
    head_files(face, tmp_path)
    name, loaded = opened(tmp_path, face, tell)
    own = fw.fit_face(tmp_path / "head.ply", tmp_path / "head.json")
    assert name == "head.ply"
    assert loaded.subject.clip is None
    assert np.array_equal(loaded.subject.face.points, own.points)
    assert told[0] == ("Reading head.ply", 0.0)


@pytest.mark.parametrize(
    ("names", "error", "message"),
    [
        (["a.ply"], MeshError, "a.ply"),
        (["a.png"], ParameterError, "drop one face file .* received a.png"),
        (["a.ply", "b.obj"], ParameterError, "drop one face file .* received a.ply, b.obj"),
    ],
)
def test_what_is_no_face_is_refused(tmp_path, face, names, error, message):
    for name in names:
        (tmp_path / name).write_bytes(b"ply nonsense")
    with pytest.raises(error, match=message):
        opened(tmp_path, face, heard()[1])


def test_a_written_series_is_a_clip(tmp_path, face):
    """The jaw opens by keys; what is read again has the same points at the same times."""
    key = {"unit": "AU26", "weight": 1.0, "onset": 0.0, "apex": 0.1, "offset": 0.2, "end": 0.24}
    player = Player(Session(timeline={"length": 0.24, "loop": False, "keys": {"k": key}}), Subject(face))
    assert np.allclose(player.times, 0.04 * np.arange(1, 7))
    frames = [fw.Simulation(face).step(), *(moment.frame for moment in player.moments())]
    head_files(face, tmp_path)
    (tmp_path / "head.ply").unlink()
    fw.write_series(frames, [0.0, *player.times], tmp_path / "jaw.vtkhdf")
    name, loaded = opened(tmp_path, face, heard()[1])
    assert name == "jaw.vtkhdf"
    assert loaded.subject.clip is not None
    assert loaded.subject.clip.duration == pytest.approx(0.24)
    chin = np.argmin(np.linalg.norm(face.points - face.landmarks["pogonion"], axis=1))
    own = np.argmin(np.linalg.norm(loaded.subject.face.points - face.points[chin], axis=1))
    again = Player(Session(timeline={"length": 0.24}), loaded.subject).moments()
    for moment, frame in zip(again, frames[1:], strict=True):
        assert np.linalg.norm(np.asarray(moment.frame.points)[own] - np.asarray(frame.points)[chin]) < 0.5
    assert np.linalg.norm(np.asarray(frames[4].points)[chin] - face.points[chin]) > 5.0


def test_landmarks_of_a_document_refit_the_face(face):
    library = Library(face)
    moved = (face.landmarks["mouth_l"] + [0.0, 4.0, 0.0]).tolist()
    again = library.subject_of(Session(landmarks={"mouth_l": moved})).face
    assert np.allclose(again.landmarks["mouth_l"], moved)
    assert again.texture is face.texture
    own = fw.Face.from_landmarks(face.mesh, again.landmarks, face.unit, face.atlas, face.estimated)
    for name, muscle in own.muscles.items():
        if hasattr(muscle, "insertion"):
            assert np.array_equal(again.muscles[name].insertion, muscle.insertion)
    assert again.muscles["zygomaticus_major_l"].insertion[1] > face.muscles["zygomaticus_major_l"].insertion[1] + 2.0
    assert library.subject_of(START).face is face
    with pytest.raises(LandmarkError, match="off the mesh.*mouth_l"):
        library.subject_of(Session(landmarks={"mouth_l": [0.0, 0.0, 400.0]}))
    with pytest.raises(UnknownNameError, match="chin_l"):
        library.subject_of(Session(landmarks={"chin_l": moved}))


def test_a_scan_grows_older_and_nothing_else(face):
    library = Library(face, "scan.obj")
    older = library.subject_of(Session(identity={"age": 0.5})).face
    np.testing.assert_array_equal(older.points, face.aged(0.5).points)
    assert library.accepted(Session(identity={"age": 0.5})).identity == {"age": 0.5}
    with pytest.raises(ParameterError, match="no 'jaw', only an age"):
        library.accepted(Session(identity={"jaw": 0.5}))
    recorded = Subject(face, fw.Recorded.of_positions(np.stack([face.points, face.points]), fps=25.0))
    with pytest.raises(ParameterError, match="as old as it was recorded"):
        recorded.aged({"age": 0.5})


def test_names_are_never_taken_twice(face):
    library = Library(face)
    names = [library.add("head.obj", Loaded(Subject(face))) for _ in range(9)]
    assert len({*names, ""}) == 10
    assert library.names == ("", *names)
    with pytest.raises(ParameterError, match=r"'one.obj' is not open"):
        library["one.obj"]
