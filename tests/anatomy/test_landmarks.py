"""Landmarks.

what                            checked against
names                           pairs under mirroring
the frame                       itself on turned, scaled, moved landmarks; axes by hand
mirroring                       the reflection in the known plane of a symmetric face
estimation                      the template itself where the others are the template's, whatever its pose
maps by landmarks               SciPy's interpolation by radial functions
swapped, missing, unreadable    the messages
reading, writing                both JSON forms; each other
"""

import json

import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator
from scipy.spatial.transform import Rotation

from facewrinkle.anatomy.landmarks import (
    NAMES,
    REQUIRED,
    complete,
    fitted_map,
    frame_of,
    mirrored,
    mirrored_name,
    read_landmarks,
    write_landmarks,
)
from facewrinkle.errors import FaceWrinkleWarning, LandmarkError

TURN, SHIFT = Rotation.from_rotvec([0.3, 2.0, -0.5]).as_matrix(), np.array([300.0, -50.0, 8.0])


@pytest.fixture
def marks(face):
    return {name: point.copy() for name, point in face.landmarks.items()}


def moved(marks, scale=1.0):
    return {name: scale * (TURN @ point + SHIFT) for name, point in marks.items()}


# --- names --------------------------------------------------------------------------------------


# --- frame --------------------------------------------------------------------------------------


def test_the_built_in_face_looks_along_z_with_its_left_at_x(face):
    frame = frame_of(face.landmarks)
    assert np.diag(frame.axes).min() > 0.95
    np.testing.assert_allclose(frame.axes @ frame.axes.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(frame.axes) == pytest.approx(1.0)
    between = face.landmarks["eye_l_centre"] - face.landmarks["eye_r_centre"]
    assert frame.pupil_distance == pytest.approx(np.linalg.norm(between))
    assert abs(frame.origin[0]) < 1e-9


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_the_frame_moves_with_the_face(marks, scale):
    frame, other = frame_of(marks), frame_of(moved(marks, scale))
    np.testing.assert_allclose(other.axes, frame.axes @ TURN.T, atol=1e-12)
    np.testing.assert_allclose(other.origin, scale * (TURN @ frame.origin + SHIFT), rtol=1e-12)
    assert other.pupil_distance == pytest.approx(scale * frame.pupil_distance, rel=1e-12)


# --- mirroring and estimation -------------------------------------------------------------------


@pytest.mark.parametrize("pose", [lambda m: m, moved])
def test_missing_sides_are_mirrored(marks, pose):
    symmetric = {
        name: 0.5 * (point + marks[mirrored_name(name)] * [-1, 1, 1]) if name in marks else point
        for name, point in marks.items()
    }
    whole = pose(symmetric)
    given = {name: point for name, point in whole.items() if "_r" not in name or name == "eye_r_outer"}
    found = mirrored(given)
    assert set(found) == set(NAMES)
    for name in NAMES:
        np.testing.assert_allclose(found[name], whole[name], atol=1e-9)
    assert all(found[name] is given[name] for name in given)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("kept", [REQUIRED, (*REQUIRED, "pogonion", "ala_l", "brow_l_inner", "zygion_l")])
def test_estimates_from_the_template_itself_are_the_template(marks, kept, scale):
    face = moved(marks, scale)
    given = {name: face[name] for n in kept for name in {n, mirrored_name(n)}}
    found, estimated = complete(given, marks)
    assert set(found) == set(NAMES)
    assert set(estimated) == set(NAMES) - set(given)
    size = frame_of(face).pupil_distance
    for name in NAMES:
        # Where the size has to come from the corners of the eyes in place of their centres, it is a little different.
        assert np.linalg.norm(found[name] - face[name]) < (1e-9 if "eye_l_centre" in given else 0.05) * size
    for name in given:
        assert found[name] is given[name]


def test_maps_by_landmarks_are_radial_functions_of_their_distances(marks):
    rng = np.random.default_rng(3)
    other = moved({name: place + rng.normal(0.0, 3.0, 3) for name, place in marks.items()}, 0.1)
    base, frame = frame_of(marks), frame_of(other)
    source, target = (one.local(np.array([each[n] for n in marks])) for one, each in ((base, marks), (frame, other)))
    warp = RBFInterpolator(source, target - source, kernel="linear", degree=1)
    places = rng.uniform(-200.0, 200.0, (100, 3))
    local = base.local(places)
    onto = fitted_map(marks, other, base, frame)
    np.testing.assert_allclose(onto(places), frame.world(local + warp(local)), atol=1e-9)
    np.testing.assert_allclose(onto(np.array([*marks.values()])), [*other.values()], atol=1e-9)


@pytest.mark.parametrize("side", "lr")
def test_one_side_alone_cannot_be_mirrored(marks, side):
    other = "_l" if side == "r" else "_r"
    given = {name: point for name, point in marks.items() if other not in name}
    assert mirrored(given) == given
    with pytest.raises(LandmarkError, match=f"missing landmarks: eye{other}_inner"):
        complete(given, marks)


@pytest.mark.parametrize("name", REQUIRED)
def test_each_required_landmark_is_missed(marks, name):
    given = {n: p for n, p in marks.items() if n not in (name, mirrored_name(name))}
    with pytest.raises(LandmarkError, match=f"missing landmarks: .*{name}") as caught:
        complete(given, marks)
    assert mirrored_name(name) in str(caught.value)


# --- files --------------------------------------------------------------------------------------


def test_both_json_forms(tmp_path, marks):
    flat, nested = tmp_path / "flat.json", tmp_path / "nested.json"
    flat.write_text(json.dumps({name: point.tolist() for name, point in marks.items()}), encoding="utf-8-sig")
    entries = {name: {"xyz": point.tolist(), "vertex": 3} for name, point in marks.items()}
    nested.write_text(json.dumps({"units": "mm", "landmarks": entries}))
    for source in (flat, str(flat), nested, marks, {n: p.tolist() for n, p in marks.items()}):
        read = read_landmarks(source)
        assert list(read) == list(marks)
        assert all(np.array_equal(read[name], marks[name]) for name in marks)


def test_what_is_written_is_read_again_to_the_last_bit(tmp_path, marks):
    path = tmp_path / "marks.json"
    awkward = {name: point / 3.0 + 1e-17 for name, point in marks.items()}
    write_landmarks(awkward, path, ["trichion"], {"nasion": 0.25})
    assert all(np.array_equal(point, awkward[name]) for name, point in read_landmarks(path).items())
    content = json.loads(path.read_text())["landmarks"]
    assert [name for name, entry in content.items() if entry["estimated"]] == ["trichion"]
    assert {name: entry["confidence"] for name, entry in content.items() if "confidence" in entry} == {"nasion": 0.25}


def test_of_found_landmarks_only_those_that_were_edited_are_kept(tmp_path, marks):
    path = tmp_path / "marks.json"
    write_landmarks(marks, path, ["trichion"], dict.fromkeys(marks, 0.6) | {"glabella": 1.0})  # which was given
    assert set(read_landmarks(path)) == set(marks)  # as it was written
    content = json.loads(path.read_text())
    content["landmarks"]["nose_tip"]["xyz"] = [1.0, 2.0, 3.0]
    path.write_text(json.dumps(content))
    with pytest.warns(FaceWrinkleWarning, match=r"the edited landmarks are fixed: nose_tip"):
        read = read_landmarks(path)
    assert {name: place.tolist() for name, place in read.items()} == {
        "nose_tip": [1.0, 2.0, 3.0], "glabella": marks["glabella"].tolist(),
    }  # fmt: skip


def test_unknown_names_are_left_out_with_a_warning():
    with pytest.warns(FaceWrinkleWarning, match="Did you mean 'nose_tip'"):
        assert list(read_landmarks({"nose_tpi": [0, 0, 1], "nasion": [0, 1, 0]})) == ["nasion"]


NO_PLACES = [1, 2], [1, 2, 3, 4], "here", None, [1, 2, float("nan")], {"x": 1}, [1, "a", 2], 3.0
NO_TABLES = "none.json", ".", 5, [], b"x", None, np.zeros((5, 3))


@pytest.mark.parametrize(
    ("source", "message"),
    [
        *(({"nasion": value}, "'nasion' must be three finite numbers") for value in NO_PLACES),
        *((source, "must be a dictionary|cannot read") for source in NO_TABLES),
    ],
)
def test_what_is_no_dictionary_of_landmarks(source, message):
    with pytest.raises(LandmarkError, match=message):
        read_landmarks(source)


UNREADABLE = {
    "cut off": ("{", "not a JSON file"),
    "bytes": (b"\xff\xfe\x00\x80", "not a JSON file"),
    "nested": ("[" * 100_000, "not a JSON file"),
    "a list": ("[1, 2]", "must be a dictionary"),
    "long numbers": ('{"nose_tip": [' + "9" * 400 + ", 0, 0]}", "not a JSON file|three finite numbers"),
    "large numbers": ('{"nose_tip": [1e60, 0, 0]}', "three finite numbers"),
}


@pytest.mark.parametrize(("content", "message"), UNREADABLE.values(), ids=UNREADABLE)
def test_unreadable_files(tmp_path, content, message):
    path = tmp_path / "marks.json"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(LandmarkError, match=message):
        read_landmarks(path)


PAIRS = ("mouth_l", "mouth_r"), ("brow_l_mid", "brow_r_mid"), ("ala_l", "ala_r")
SWAPPED = "swapped left for right or coincide: {} and {}"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        *(
            (lambda marks, flat=flat: {name: point * flat for name, point in marks.items()}, "lie on a line or at one")
            for flat in ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
        ),
        *((lambda marks, l=l, r=r: {**marks, l: marks[r], r: marks[l]}, SWAPPED.format(l, r)) for l, r in PAIRS),
        *((lambda marks, l=l, r=r: {**marks, l: marks[r]}, SWAPPED.format(l, r)) for l, r in PAIRS),
        (lambda marks: {**marks, "eye_l_inner": marks["eye_l_outer"]}, "eye_l_inner must lie nearer to the nose"),
        (
            lambda marks: {**marks, "eye_l_centre": marks["eye_l_centre"] + [0.0, 0.0, 60.0]},
            "eye_l_centre must be the centre of the eyeball",
        ),
    ],
)
def test_landmarks_of_no_face_are_refused(marks, change, message):
    with pytest.raises(LandmarkError, match=message):
        complete(change(marks), marks)


def test_a_mirrored_face_is_refused(marks):
    renamed = {mirrored_name(name): point for name, point in marks.items()}
    for whole in (renamed, {name: point * [-1, 1, 1] for name, point in marks.items()}):
        with pytest.raises(LandmarkError, match="swapped left for right, or the face is mirrored"):
            frame_of(whole)
