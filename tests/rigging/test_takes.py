"""Takes: what is read from tables and JSON, when, and what is refused.

what                checked against
time codes          seconds that were written as codes
JSON                the same take as a table
turns of the head   rotation matrices
shapes of muscles   the simulation of the same action units
what is modeled     the rig's shapes
the head            rotations about one point
"""

import dataclasses
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from facewrinkle.appearance.seen import companion_meshes
from facewrinkle.errors import FaceWrinkleWarning, MeshError, ParameterError, UnknownNameError
from facewrinkle.rigging.modeled import Movements
from facewrinkle.rigging.shapes import ARKIT

HEAD = ["HeadYaw", "HeadPitch", "HeadRoll"]
PHONE = [name[0].upper() + name[1:] for name in ARKIT] + HEAD + [f"{s}Eye{t}" for s in ("Left", "Right") for t in
         ("Yaw", "Pitch", "Roll")]  # fmt: skip


def code(time, rate, hour=10):
    """A time after 10:59:58 as hours, minutes, seconds and frames."""
    seconds, frames = divmod(time * rate + 1e-6, rate)
    total = int(seconds) + 58
    return f"{hour + (59 * 60 + total) // 3600:02d}:{(59 + total // 60) % 60:02d}:{total % 60:02d}:{frames:06.3f}"


def written(path, text):
    path.write_text(text)
    return path


@pytest.fixture
def phone(tmp_path):
    """A take as Live Link Face writes it, of 3 s at 60 Hz, with a frame without a face; its times and its weights."""
    times = np.arange(180) / 60.0
    values = np.random.default_rng(0).uniform(size=(180, len(PHONE))).round(4)
    rows = [f"{code(t, 60)},{len(PHONE)}," + ",".join(map(str, row)) for t, row in zip(times, values, strict=True)]
    rows[7] = f"{code(times[7], 60)},0"
    text = "\n".join([f"Timecode,BlendShapeCount,{','.join(PHONE)}", *rows])
    return written(tmp_path / "take.csv", text), np.delete(times, 7), np.delete(values, 7, axis=0)


def test_the_table_of_a_phone(phone):
    path, times, values = phone
    with pytest.warns(FaceWrinkleWarning, match=r"1 of 180 frames lack values"):
        take = fw.read_take(path)
    assert take.names == tuple(ARKIT)
    np.testing.assert_allclose(take.times, times, atol=1e-4)
    np.testing.assert_array_equal(take.weights, values[:, : len(ARKIT)])
    np.testing.assert_allclose(take.head, values[:, len(ARKIT) : len(ARKIT) + 3])


@pytest.mark.parametrize("seconds", [2.0, 60.3, 3600.0])  # the last two end where the clock shows the first second
@pytest.mark.parametrize("rate", [24, 25, 30, 60])
def test_time_codes_count_frames(tmp_path, rate, seconds):
    times = np.arange(seconds * rate) / rate if seconds < 3600.0 else np.array([*np.arange(rate), 3600 * rate]) / rate
    path = written(tmp_path / "a.csv", "Timecode,jawOpen\n" + "\n".join(f"{code(t, rate)},0.5" for t in times))
    np.testing.assert_allclose(fw.read_take(path).times, times, atol=1e-4)
    np.testing.assert_allclose(fw.read_take(path, fps=2 * rate).times, times // 1 + times % 1 / 2, atol=1e-4)


@pytest.mark.parametrize(
    ("text", "names", "weights", "duration"),
    [
        ("time;Jaw_Open;eyeBlink_L\n0;0,25;0\n0,5;1;0,5\n", ("jawOpen", "eyeBlinkLeft"), [[0.25, 0], [1, 0.5]], 0.5),
        ("jawOpen\t_neutral\n0.1\t0.9\n0.2\t0.9\n0.3\t1\n", ("jawOpen",), [[0.1], [0.2], [0.3]], 2 / 30),
        (" timestamp, AU01_r, AU12_r\n0.0, 2.5, 0\n0.1, 5, 1\n", ("AU1", "AU12"), [[0.5, 0], [1, 0.2]], 0.1),
        ("timestampMs,viseme_aa\n100,0\n133,1\n", ("viseme_aa",), [[0.0], [1.0]], 0.033),
        (",time,jawOpen,\n0,0.0,0.5,\n1,0.2,1,\n", ("jawOpen",), [[0.5], [1.0]], 0.2),
    ],
)  # fmt: skip
def test_tables_of_others(tmp_path, text, names, weights, duration):
    take = fw.read_take(written(tmp_path / "take.txt", text))
    assert take.names == names
    np.testing.assert_allclose(take.weights, weights)
    assert take.duration == pytest.approx(duration)


def test_all_ways_to_write_json_say_the_same(tmp_path):
    weights = {"jawOpen": [0.0, 0.5], "mouthSmileLeft": [1.0, 0.25]}
    frames = [dict(zip(weights, row, strict=True)) for row in zip(*weights.values(), strict=True)]
    turn = Rotation.from_euler("YXZ", [0.3, -0.2, 0.1])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn.as_matrix(), [1.0, 2.0, -40.0]

    def categories(frame):
        named = [{"categoryName": name, "score": x, "index": 3} for name, x in frame.items()]
        return [{"categoryName": "_neutral", "score": 1e-6}, *named]

    browser = [
        {
            "timestamp": 40.0 * k,
            "faceBlendshapes": [{"categories": categories(frame), "headName": ""}],
            "facialTransformationMatrixes": [{"rows": 4, "columns": 4, "data": matrix.T.ravel().tolist()}],
        }
        for k, frame in enumerate(frames)
    ]
    for number, content in enumerate([frames, {"frames": frames}, browser, {"results": browser}]):
        take = fw.read_take(written(tmp_path / f"{number}.json", json.dumps(content)))
        assert take.names == tuple(weights)
        np.testing.assert_array_equal(take.weights, np.array(list(weights.values())).T)
        if content is browser:
            assert take.duration == pytest.approx(0.04)
            np.testing.assert_allclose(take.turn(0.02), turn.as_matrix(), atol=1e-12)
        elif number < 2:
            np.testing.assert_array_equal(take.turn(0.0), np.eye(3))


def test_the_head_turns_to_where_it_is_said_to():
    for angles, seen in (((0.5, 0, 0), [1, 0, 0]), ((0, 0.5, 0), [0, 1, 0])):
        take = fw.Take(("jawOpen",), [0.0], [[0.0]], np.array([angles], float))
        assert take.turn(0.0)[:, 2] @ seen == pytest.approx(np.sin(0.5))  # where the nose points: left, or up
    rolled = fw.Take(("jawOpen",), [0.0], [[0.0]], np.array([[0.0, 0.0, 0.5]])).turn(0.0)
    assert rolled[:, 1] @ [1, 0, 0] == pytest.approx(-np.sin(0.5))  # the crown goes to the subject's right


def test_weights_are_clamped_once(tmp_path):
    path = written(tmp_path / "a.csv", "jawOpen,mouthPucker\n-0.1,0\n1.5,0.5\n")
    with pytest.warns(FaceWrinkleWarning, match=r"clamped, in 2 frames: jawOpen\.") as told:
        take = fw.read_take(path)
    assert len(told) == 1
    np.testing.assert_array_equal(take.weights, [[0.0, 0.0], [1.0, 0.5]])
    with pytest.raises(UnknownNameError, match="shape 'smile'"):
        take.gained({"smile": 2.0})


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.csv", "Timecode,jawOpen\n", "has no frames"),
        ("a.csv", "\n", "is empty"),
        ("a.csv", "hair,nose\n1,2\n", "no column of a shape.*received hair, nose"),
        ("a.csv", "time,jawOpen,mouthPucker\n0,1,1\n1,1,1,4\n", "row 3 has more columns than the row of their names"),
        ("a.csv", "time,jawOpen\n0,wide\n", "column jawOpen must hold numbers, received 'wide'"),
        ("a.csv", "time,jawOpen\n0.2,1\n0.1,1\n", "row 3 comes before the one above"),
        ("a.csv", "time,jawOpen\nnoon,1\n", "time codes such as .*received 'noon'"),
        ("a.csv", "time,jawOpen\n0,1\n1e309,1\n", "times must be seconds.*received '1e309'"),
        ("a.csv", "time,jawOpen\n-1e308,1\n1e308,1\n", "times must be seconds"),
        ("a.csv", f"Timecode,jawOpen\n{'9' * 400}:00:00:00,1\n{'9' * 400}:00:00:01,1\n", "times must be seconds"),
        ("a.csv", "jawOpen,mouthPucker\n,1\n,1\n", "no frame with a weight of jawOpen"),
        ("a.json", "{", "not valid JSON"),
        ("a.json", "3", "has no frames"),
        ("a.bvh", "HIERARCHY", "takes are read from .csv"),
    ],
)
def test_what_is_no_take_is_refused(tmp_path, name, text, message):
    with pytest.raises(ParameterError, match=message):
        fw.read_take(written(tmp_path / name, text))


def test_damaged_files_are_refused(tmp_path):
    with pytest.raises(MeshError, match="no file"):
        fw.read_take(tmp_path / "lost.csv")
    frames = '[{"faceBlendshapes": [{"categories": [{"categoryName": "jawOpen", "score": "x"}]}]}]'
    with pytest.raises(ParameterError, match="column jawOpen must hold numbers, received 'x'"):
        fw.read_take(written(tmp_path / "a.json", frames))
    path = written(tmp_path / "a.csv", "jawOpen,hair\n1,long\n")
    with pytest.warns(FaceWrinkleWarning, match="1 columns are not shapes and are ignored: hair"):
        assert fw.read_take(path).names == ("jawOpen",)


# --- faces that perform takes ---------------------------------------------------------------------


def held(face, weights, **options):
    """The face after a second of shapes at constant weights: a motion, and its positions."""
    motion = fw.Performer(fw.Take(tuple(weights), [0.0], [list(weights.values())]), face, time_step=0.1, **options)
    for _ in range(9):
        motion.step()
    return motion, motion.step().copy()


def test_shapes_of_muscles_are_those_of_a_simulation(face):
    motion, points = held(face, {"mouthSmileLeft": 0.6, "mouthFrownRight": 0.9, "browInnerUp": 1.0, "AU9": 0.0})
    skin = fw.Skin(face, 0.1)
    skin.contract(face.atlas.contractions({"AU12L": 0.6, "AU15R": 0.9, "AU1": 1.0}))
    for _ in range(10):
        expected = skin.step()
    np.testing.assert_array_equal(points, expected)
    np.testing.assert_array_equal(motion.rates, skin.rates)
    motion.reset()
    assert not motion.rates.any()


def test_what_no_muscle_does_is_added(face):
    motion, points = held(face, {"jawLeft": 1.0})
    np.testing.assert_allclose(points - face.points_mm, face.unit * Movements(face).of("jaw_left"), atol=0.3)
    frame = fw.Simulation(face, fw.Refinement(max_level=0), layers=[], motion=motion).step()
    now, rest = (companion_meshes(face, f, always=True) for f in (frame, face.mesh))
    left = face.frame.axes[0]
    assert ((now["lower_teeth"].points - rest["lower_teeth"].points) @ left).max() * face.unit > 3.0
    np.testing.assert_array_equal(now["upper_teeth"].points, rest["upper_teeth"].points)


@pytest.mark.parametrize("weight", [0.3, 1.0])
def test_mouth_close_seals_an_open_jaw(face, weight):
    upper, lower = Movements(face).pairs

    def gap(points):
        return np.linalg.norm(points[upper] - points[lower], axis=1)

    _, opened = held(face, {"jawOpen": weight})
    _, closed = held(face, {"jawOpen": weight, "mouthClose": weight})
    _, alone = held(face, {"mouthClose": weight})
    rest = gap(face.points_mm)
    assert np.median(gap(opened) - rest) > 10.0 * weight
    assert np.abs(gap(closed) - rest).max() < 0.3
    assert np.abs(gap(alone) - rest).max() < 0.3  # the corrective alone does nothing


def test_the_head_turns_about_its_neck(face):
    take = fw.Take(("jawOpen",), [0.0], [[0.0]], np.array([[0.4, 0.1, 0.0]]))
    motion = fw.Performer(take, face)
    turn = motion.pose[:3, :3]
    np.testing.assert_allclose(motion.step() / face.unit, face.points @ turn.T + motion.pose[:3, 3], atol=1e-9)
    nose = turn @ face.frame.axes[2]
    np.testing.assert_allclose(nose @ face.frame.axes.T, take.turn(0.0)[:, 2], atol=1e-12)
    assert fw.Performer(take, face, head=False).pose is None


def test_what_a_face_cannot_perform_is_told(face):
    blinking = fw.Take(("eyeBlinkLeft", "jawOpen"), [0.0], [[0.5, 0.5]])
    blind = dataclasses.replace(face, eyes=[])
    with pytest.warns(FaceWrinkleWarning, match=r"1 shapes of the take are left out \(the lids of this"):
        motion = fw.Performer(blinking, blind)
    assert motion.left_out == {"eyeBlinkLeft": "the lids of this mesh do not open"}
    with pytest.raises(ParameterError, match="performs a take"):
        fw.Simulation(blind, motion=motion).contract({"jaw": 1.0})
    with pytest.raises(ParameterError, match="can make none of the shapes"):
        fw.Performer(blinking, fw.surface(face.mesh, "mm"))


def test_a_tongue_comes_out_where_a_take_says_so(face):
    take = fw.Take(("tongueOut", "jawOpen"), [0.0, 0.5], [[0.0, 0.0], [1.0, 0.3]])
    *_, frame = fw.Simulation(face, fw.Refinement(max_level=0), layers=[], motion=fw.Performer(take, face)).run(40)
    tongue, at_rest = (companion_meshes(face, each, always=True)["tongue"].points for each in (frame, face.mesh))
    tips = (np.asarray(tongue) @ face.frame.axes[2]).max(), (np.asarray(at_rest) @ face.frame.axes[2]).max()
    assert (tips[0] - tips[1]) / face.frame.scale > 20.0
    assert frame.field_data["jaw_angle"][0] == pytest.approx(face.jaw_angle(face.atlas.contractions("AU19")))
