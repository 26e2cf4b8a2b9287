"""Takes in the forms that people asked about, made up for it: each is read as what its maker meant.

They lie beside the repository; what each of them holds is in their README.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import facewrinkle as fw

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
