"""Forms of takes: what trackers, phones, programs and spreadsheets write.

what            checked against
forms           the weights and times that were written
names           ARKit's shapes that the documentation of each program names for the same movement
angles          rotation matrices in the axes of the camera
cases           what the README of the forms that people asked about, made up for it, says that each holds
"""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from facewrinkle.errors import FaceWrinkleWarning, ParameterError
from facewrinkle.rigging.tables import shapes_of_column

JAW, SMILE = [0.0, 0.5, 0.25], [0.75, 0.0, 1.0]
"""The weights that all forms say, at these times:"""
TIMES = [0.0, 0.1, 0.2]
ROWS = list(zip(TIMES, JAW, SMILE, strict=True))
FRAMES = [{"jawOpen": jaw, "mouthSmileLeft": smile} for _, jaw, smile in ROWS]
PAIRS = [[{"name": name, "value": weight} for name, weight in frame.items()] for frame in FRAMES]


def category(name, score):
    return {"index": 1, "score": score, "display_name": "", "category_name": name}


FORMS = {
    "semicolons.csv": "time;jawOpen;mouthSmileLeft\n"
    + "\n".join(f"{t};{a};{b}".replace(".", ",") for t, a, b in ROWS),
    "excel.csv": "sep=;\ntime;jawOpen;mouthSmileLeft\n" + "\n".join(f"{t};{a};{b}" for t, a, b in ROWS),
    "comments.csv": "# by me\n# fps=10\njawOpen,mouthSmileLeft\n" + "\n".join(f"{a},{b}" for _, a, b in ROWS),
    "bars.txt": "time|jawOpen|mouthSmileLeft\n" + "\n".join(f"{t}|{a}|{b}" for t, a, b in ROWS),
    "study.txt": "#Study : mine\n\nRow\tTimestamp\tJaw_Open\tMouth_Smile_L\n"
    + "\n".join(f"1\t{1000 * t:g}\t{a}\t{b}" for t, a, b in ROWS),
    "milliseconds.csv": "timeMs,jawOpen,mouthSmileLeft\n" + "\n".join(f"{1000 * t:g},{a},{b}" for t, a, b in ROWS),
    "clock.csv": "time,jawOpen,mouthSmileLeft\n" + "\n".join(f"0:00:{t:06.3f},{a},{b}" for t, a, b in ROWS),
    "codes.csv": "Timecode,JawOpen,MouthSmileLeft\n"
    + "\n".join(f"00:00:{59 + int(t * 10) // 30:02d}:{3 * k:02d},{a},{b}" for k, (t, a, b) in enumerate(ROWS)),
    "face_cap.txt": "info,x\nbs,jawOpen,mouthSmileLeft\n"
    + "\n".join(f"k,{1000 * t:g},0,0,0,1,2,3,0,0,0,0,{a},{b}" for t, a, b in ROWS),
    "list.json": [{"time": t, **frame} for t, frame in zip(TIMES, FRAMES, strict=True)],
    "nested.json": {"fps": 10, "frames": [{"blendshapes": frame} for frame in FRAMES]},
    "groups.json": [{"t": t, "mouth": {"jawOpen": a}, "cheeks": {"mouthSmileLeft": b}} for t, a, b in ROWS],
    "pairs.json": {"frameRate": 10, "takes": {"frames": [{"weights": pairs} for pairs in PAIRS]}},
    "numbers.json": {"meta": {"fps": 10}, "frames": {str(k): frame for k, frame in enumerate(FRAMES)}},
    "by_time.json": {str(float(t)): frame for t, frame in zip(TIMES, FRAMES, strict=True)},
    "by_shape.json": {"time": TIMES, "jawOpen": JAW, "mouthSmileLeft": SMILE},
    "rows.json": {"exportFps": 10.0, "facsNames": ["jawOpen", "mouthSmileLeft"], "joints": ["jaw"],
                  "weightMat": [[a, b] for _, a, b in ROWS]},
    "rows_in_frames.json": {"names": ["jawOpen", "mouthSmileLeft"],
                            "frames": [{"time": t, "weights": [a, b]} for t, a, b in ROWS]},
    "times_beside.json": {"names": ["jawOpen", "mouthSmileLeft"], "times": TIMES,
                          "weights": [[a, b] for _, a, b in ROWS]},
    "python.json": [{"timestamp_ms": 1000 * t, "face_landmarks": [[{"x": 0.1, "y": 0.2}]],
                     "face_blendshapes": [[category("_neutral", 1e-6), category("jawOpen", a),
                                           category("mouthSmileLeft", b)]]} for t, a, b in ROWS],
    "lines.json": "\n".join(json.dumps({"time": t, **frame}) for t, frame in zip(TIMES, FRAMES, strict=True)),
}  # fmt: skip


def read(tmp_path, name, content, **options):
    path = tmp_path / name
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return fw.read_take(path, **options)


@pytest.mark.filterwarnings("ignore:.*columns are not shapes:facewrinkle.FaceWrinkleWarning")
@pytest.mark.parametrize("name", FORMS)
def test_all_forms_say_the_same(tmp_path, name):
    options = {"fps": 30.0} if name == "codes.csv" else {}
    take = read(tmp_path, name, FORMS[name], **options)
    assert take.names == ("jawOpen", "mouthSmileLeft")
    np.testing.assert_allclose(take.weights, np.transpose([JAW, SMILE]))
    np.testing.assert_allclose(take.times, TIMES, atol=1e-9)


def test_utf_16_of_spreadsheets(tmp_path):
    (tmp_path / "a.txt").write_text("time\tjawOpen\n0\t0,25\n", encoding="utf-16")
    assert fw.read_take(tmp_path / "a.txt").at(0.0) == {"jawOpen": 0.25}


@pytest.mark.parametrize(
    ("column", "shapes"),
    [
        ("head__eyeBlink_L", ["eyeBlinkLeft"]),
        ("c_JawOpen", ["jawOpen"]),
        ("jawOpen.001", ["jawOpen"]),
        ("blendShape.mouthSmileLeft", ["mouthSmileLeft"]),
        ("CTRL_expressions_mouthCornerPullL", ["mouthSmileLeft"]),
        ("CTRL_expressions_eyeLookLeftR", ["eyeLookInRight"]),
        ("CTRL_expressions_browRaiseInL", ["browInnerUpLeft"]),
        ("CTRL_expressions_mouthFunnelUL", ["mouthFunnel"]),
        ("Brow_Raise_Inner_R", ["browInnerUpRight"]),
        ("Eye_L_Look_R", ["eyeLookInLeft"]),
        ("Cheek_Raise_L", ["cheekSquintLeft"]),
        ("Mouth_L", ["mouthLeft"]),
        ("V_Dental_Lip", ["viseme_FF"]),
        ("EyeClosedLeft", ["eyeBlinkLeft"]),
        ("LipFunnelUpperRight", ["mouthFunnel"]),
        ("BrowLowererLeft", ["browDownLeft"]),
        ("Upper_Lip_Raiser_L", ["mouthUpperUpLeft"]),
        ("Eyes_Look_Right_L", ["eyeLookInLeft"]),
        ("Jaw_Sideways_Left", ["jawLeft"]),
        ("oh", ["viseme_O"]),
        ("happy", ["happiness"]),
        ("AU12", ["AU12"]),
        ("AU12_L", ["AU12L"]),
        ("AU12_R", ["AU12R"]),
        ("AU12_r", ["AU12"]),
        ("au_12_intensities", ["AU12"]),
        ("AU12 Evidence", ["AU12"]),
        ("jaw", []),
        ("anger", []),
        ("hair_left", []),
        ("eyes", []),
    ],
)
def test_names_of_programs(column, shapes):
    assert list(shapes_of_column(column)) == shapes


def test_an_r_beside_an_l_is_a_side(tmp_path):
    assert read(tmp_path, "a.csv", "AU12_l,AU12_r\n0.5,1\n").at(0.0) == {"AU12L": 0.5, "AU12R": 1.0}


@pytest.mark.parametrize(
    ("text", "options", "told", "weights"),
    [
        ("AU12_r,AU12_c\n2.5,1\n5,0\n", {}, None, [0.5, 1.0]),
        ("AU12_r\n0.5\n1\n", {}, "no intensity exceeds 1.*say that 5 is full", [0.5, 1.0]),
        ("AU12_r\n0.5\n1\n", {"full": 5}, None, [0.1, 0.2]),
        ("AU12\n2.5\n5\n", {}, "go up to 5 and are read as 0 to 5", [0.5, 1.0]),
        ("jawOpen,mouthPucker\n40,0\n80,100\n", {}, "go up to 100 and are read as 0 to 100", [0.4, 0.8]),
        ("jawOpen\n40\n80\n", {"full": 200}, None, [0.2, 0.4]),
        ("AU12 Evidence\n0\n1\n", {}, "logarithm of odds", [0.5, 10.0 / 11.0]),
        ("jawOpen\n40%\n80%\n", {}, "read as 0 to 100", [0.4, 0.8]),
    ],
)
def test_ranges(tmp_path, text, options, told, weights):
    if told:
        with pytest.warns(FaceWrinkleWarning, match=told):
            take = read(tmp_path, "a.csv", text, **options)
    else:
        take = read(tmp_path, "a.csv", text, **options)
    np.testing.assert_allclose(take.weights[:, 0], weights)


def test_frames_without_a_face_are_filled(tmp_path):
    text = "timestamp,success,confidence,AU12_r\n0,1,.9,1\n1,0,.02,0\n2,1,.9,3\n"
    with pytest.warns(FaceWrinkleWarning, match=r"1 of 3 frames lack values or a face"):
        take = read(tmp_path, "a.csv", text)
    assert take.at(1.0) == {"AU12": pytest.approx(0.4)}


def test_missing_cells_are_filled_column_by_column(tmp_path):
    with pytest.warns(FaceWrinkleWarning, match=r"2 of 3 frames lack values"):
        take = read(tmp_path, "a.csv", "time,jawOpen,mouthPucker\n0,0,null\n1,NaN,0.5\n2,1,0.5\n")
    np.testing.assert_allclose(take.weights, [[0.0, 0.5], [0.5, 0.5], [1.0, 0.5]])


def test_several_people(tmp_path):
    text = "frame,face_id,AU12_r\n1,0,5\n1,1,1\n2,0,4\n2,1,2\n"
    with pytest.raises(ParameterError, match="shows 2 people: give person, one of 0, 1"):
        read(tmp_path, "a.csv", text)
    with pytest.raises(ParameterError, match="person must be one of 0, 1 in a.csv, received 7"):
        read(tmp_path, "a.csv", text, person=7)
    np.testing.assert_allclose(read(tmp_path, "a.csv", text, person=1).weights[:, 0], [0.2, 0.4])
    faces = [{"faceBlendshapes": [{"categories": [category("jawOpen", score)]} for score in (0.25, 0.5)]}]
    with pytest.raises(ParameterError, match="shows 2 people"):
        read(tmp_path, "a.json", faces)
    assert read(tmp_path, "a.json", faces, person=1).at(0.0) == {"jawOpen": 0.5}


def test_shapes_are_preferred_to_units_of_the_same_face(tmp_path):
    with pytest.warns(FaceWrinkleWarning, match="both 1 shapes and 2 action units: the shapes are used"):
        take = read(tmp_path, "a.csv", "AU12,AU6,jawOpen\n1,1,0.5\n")
    assert take.at(0.0) == {"jawOpen": 0.5}


def test_numbers_of_frames(tmp_path):
    assert read(tmp_path, "a.csv", "frame,jawOpen\n7,0\n8,1\n").duration == pytest.approx(1 / 30)
    text = "frame,AU12\n0,0\n10,1\n30,0\n"
    with pytest.warns(FaceWrinkleWarning, match="numbers its frames.* 30 a second. Give fps"):
        np.testing.assert_allclose(read(tmp_path, "a.csv", text).times, [0, 1 / 3, 1])
    np.testing.assert_allclose(read(tmp_path, "a.csv", text, fps=10).times, [0, 1, 3])


def test_dropped_numbers_leave_no_gap(tmp_path):
    codes = ["00:00:59;28", "00:00:59;29", "00:01:00;02", "00:01:00;03", "00:10:00;00"]
    take = read(tmp_path, "a.csv", "Timecode,jawOpen\n" + "\n".join(f"{code},0" for code in codes))
    np.testing.assert_allclose(take.times * 30 / 1.001, [0, 1, 2, 3, 17982 - 1798])


def test_codes_of_a_take_of_whole_minutes(tmp_path):
    rows = [f"10:{k // 1800:02d}:{k // 30 % 60:02d}:{k % 30:02d}.000,0.5" for k in range(1811)]
    take = read(tmp_path, "a.csv", "Timecode,jawOpen\n" + "\n".join(rows))
    np.testing.assert_allclose(take.times, np.arange(1811) / 30.0, atol=1e-6)


def test_degrees_and_radians(tmp_path):
    text = "HeadYaw,HeadPitch,HeadRoll,jawOpen\n{},0,0,0\n0,0,0,0\n"
    with pytest.warns(FaceWrinkleWarning, match="read as degrees. If it is radians"):
        take = read(tmp_path, "a.csv", text.format(30))
    np.testing.assert_allclose(take.head[0], [np.pi / 6, 0, 0])
    np.testing.assert_allclose(read(tmp_path, "a.csv", text.format(1.5)).head[0], [1.5, 0, 0])
    np.testing.assert_allclose(read(tmp_path, "a.csv", text.format(1.5), degrees=True).head[0, 0], np.radians(1.5))


def test_the_turn_of_openface_is_that_of_the_camera(tmp_path):
    angles = np.array([0.2, -0.5, 0.3])
    take = read(tmp_path, "a.csv", "pose_Rx,pose_Ry,pose_Rz,AU12_r\n" + ",".join(map(str, angles)) + ",3\n")
    camera = Rotation.from_euler("XYZ", angles).as_matrix()  # of axes to the right of the picture, down, and away
    axes = np.diag([1.0, -1.0, -1.0])  # left, up and forward of a face that looks at the camera
    np.testing.assert_allclose(take.turn(0.0), axes @ camera @ axes, atol=1e-12)


def test_mouth_cues(tmp_path):
    cues = [(0.0, "X"), (0.2, "D"), (0.6, "B"), (1.2, "X")]
    table = read(tmp_path, "a.tsv", "\n".join(f"{start:.2f}\t{cue}" for start, cue in cues))
    ends = [start for start, _ in cues[1:]]
    parts = [{"start": a, "end": end, "value": cue} for (a, cue), end in zip(cues, ends, strict=False)]
    for take in (table, read(tmp_path, "a.json", {"metadata": {"duration": 1.2}, "mouthCues": parts})):
        assert take.names == ("viseme_SS", "viseme_aa")
        assert take.duration == pytest.approx(1.2)
        assert take.at(0.4) == {"viseme_SS": 0.0, "viseme_aa": 1.0}
        assert take.at(0.9) == {"viseme_SS": 1.0, "viseme_aa": 0.0}
        assert take.at(1.2) == {"viseme_SS": 0.0, "viseme_aa": 0.0}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"landmarks": [[1, 2], [3, 4]], "fps": 30}, "no frames with weights of shapes.*an object with landmarks, fps"),
        ([], "received nothing"),
        ([{"hair": 1}], "received a list of 1"),
    ],
)
def test_json_without_weights_is_told_what_it_has(tmp_path, content, message):
    with pytest.raises(ParameterError, match=message):
        read(tmp_path, "a.json", content)


def test_whatever_takes_name_is_performed_or_left_out(tmp_path, face):
    """All action units of OpenFace and Py-Feat, and numbers that no muscle does."""
    names = [f"AU{k:02d}_r" for k in range(1, 69)]
    take = read(tmp_path, "a.csv", f"{','.join(names)}\n{','.join(['3'] * len(names))}\n")
    with pytest.warns(FaceWrinkleWarning, match="shapes of the take are left out .no muscle does it.: AU3, AU8"):
        performer = fw.Performer(take, face)
    units = {name for name in face.atlas.action_units if name[-1].isdigit()}
    assert set(performer.left_out) == {f"AU{k}" for k in range(1, 69)} - units
    assert "AU25" in units
    *_, frame = fw.Simulation(face, motion=performer).run(5)
    assert np.ptp(frame["W"]) > 0.05


# --- cases -----------------------------------------------------------------------------------------


CASES = Path(__file__).parents[3] / "shared" / "cases"

READ = {  # shapes, frames, seconds, largest weight
    "audio2face_export.json": (52, 31, 1.25, 0.8),
    "aus_and_shapes_both.csv": (3, 11, 1 / 3, 1.0),
    "cc4_names.csv": (8, 11, 1.0, 1.0),
    "comment_lines.csv": (1, 2, 0.1, 0.5),
    "excel_sep_line.csv": (2, 2, 0.1, 0.5),
    "facecap_recording.txt": (52, 31, 0.99, 0.8),
    "fps_in_json.json": (1, 25, 1.0, 1.0),
    "frames_name_value_lists.json": (52, 6, 0.165, 0.7236),
    "frames_nested_weights.json": (52, 31, 1.0, 0.8),
    "grouped_weights.json": (3, 4, 0.1, 0.4),
    "ifacialmocap.txt": (52, 31, 0.5, 0.8),
    "imotions.txt": (3, 11, 0.33, 1.0 / (1.0 + 1e-3)),
    "livelink_degrees.csv": (52, 25, 0.4, 0.8),
    "livelink_dropframe.csv": (52, 24, 23 * 1.001 / 30, 0.7963),
    "livelink_german.csv": (52, 25, 0.398, 0.8),
    "mediapipe_python_dump.json": (52, 6, 0.166, 0.7236),
    "mp_shapes_without_categories.json": (2, 8, 0.2331, 0.7),
    "nan_words.csv": (2, 4, 0.3, 0.4),
    "openface_lost_frames.csv": (17, 27, 1.0, 0.7),
    "openface_min.csv": (6, 4, 0.1, 0.74),
    "openface_normalised.csv": (4, 4, 0.12, 0.93),
    "percent.csv": (52, 31, 1.0, 0.8),
    "pyfeat_every_tenth_frame.csv": (20, 31, 10.0, 0.9),
    "rhubarb.json": (2, 7, 1.2, 1.0),
    "rhubarb.tsv": (2, 7, 1.2, 1.0),
    "unity_curves.csv": (5, 11, 0.333, 0.8),
    "vrcft_unified.csv": (7, 11, 1.0, 1.0),
    "vrm_presets.csv": (11, 11, 0.333, 1.0),
}

TAKES = (".csv", ".tsv", ".txt", ".json")


@pytest.mark.skipif(not CASES.is_dir(), reason="the cases are not beside the repository")
def test_no_case_is_left_out():
    assert {path.name for path in CASES.iterdir() if path.suffix in TAKES} == set(READ)


@pytest.mark.filterwarnings("ignore::facewrinkle.FaceWrinkleWarning")
@pytest.mark.parametrize("name", READ)
def test_case(name):
    if not (CASES / name).exists():
        pytest.skip("the cases are not beside the repository")
    shapes, frames, seconds, largest = READ[name]
    take = fw.read_take(CASES / name)
    assert (len(take.names), len(take.times)) == (shapes, frames)
    np.testing.assert_allclose([take.duration, take.weights.max()], [seconds, largest], atol=2e-3)
