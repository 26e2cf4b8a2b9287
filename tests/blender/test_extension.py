"""The extension for Blender, headless, where FACEWRINKLE_BLENDER names a Python that has bpy (too large to install for
every run of the tests).

what                                   checked against
keys on an artist's own mesh           the package's rig, at the same places
her mesh, keys, materials, modifiers   what they were before
tears in a pose                        the way of the nearest skin, by Blender's own search
what is refused                        one sentence, and nothing done
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from real_faces import FACES
from scipy.spatial import cKDTree

import facewrinkle as fw
from facewrinkle.anatomy.landmarks import REQUIRED
from facewrinkle.errors import FaceWrinkleWarning
from facewrinkle.live.saving import environment
from facewrinkle.rigging.shapes import SETS

BLENDER = os.environ.get("FACEWRINKLE_BLENDER", "")
in_blender = pytest.mark.skipif(not BLENDER, reason="FACEWRINKLE_BLENDER names no Python with bpy")

FAKE = """#!{python}
import shutil, sys, time
from pathlib import Path
if "wait" in sys.argv:
    print("Shapes 3/4", file=sys.stderr, flush=True)
    time.sleep(60)
elif "rig" in sys.argv and Path("{folder}/keys.npz").exists():
    shutil.copy("{folder}/keys.npz", Path(sys.argv[-1]) / "head.npz")
elif "rig" in sys.argv:
    print("facewrinkle: something must be done.", file=sys.stderr)
    sys.exit(1)
elif "tear" in sys.argv:
    sys.exit(2)
elif "take" in sys.argv:
    sys.path[:0] = {paths}
    from facewrinkle.cli import main
    sys.exit(main(sys.argv[sys.argv.index("take"):]))
else:
    import os
    os.kill(os.getpid(), 9)
"""


def played(scenario, folder, *arguments):
    command = [BLENDER, Path(__file__).parent / "scene.py", scenario, folder, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=900)
    found = [line for line in done.stdout.splitlines() if line.startswith("found ")]
    assert found, done.stderr
    return json.loads(found[0].removeprefix("found "))


def script(folder, text):
    path = folder / "python"
    path.write_text(text)
    path.chmod(0o755)


@pytest.fixture
def package(tmp_path):
    """A folder, with an umlaut and a space, whose `python` has this very package."""
    folder = tmp_path / "ä b"
    folder.mkdir()
    script(folder, f'#!/bin/sh\nPYTHONPATH="{environment()["PYTHONPATH"]}" exec {sys.executable} "$@"\n')
    return folder


@pytest.fixture
def fake(tmp_path):
    """A folder whose `python` has keys ready."""
    script(
        tmp_path,
        FAKE.format(python=sys.executable, folder=tmp_path, paths=environment()["PYTHONPATH"].split(os.pathsep)),
    )
    return tmp_path


def needed(name):
    if not (FACES / name).exists():
        pytest.skip(f"{name} is not beside the repository")
    return FACES / name


@in_blender
@pytest.mark.slow
@pytest.mark.parametrize("name", ["makehuman_head_male", "ict_face_narrow"])
def test_an_artists_head_gets_keys_and_wrinkles_and_is_else_as_it_was(package, name):
    found = played("everything", package, needed(f"{name}.obj"))
    steps = ("find", "add", "age", "expressions", "wrinkles again", "copy", "tears", "clear")
    assert [found[name] for name in steps] == [""] * len(steps)
    assert found["landmarks"] == 33
    assert found["kept"]
    assert found["packed"]
    assert found["images"] <= 16
    assert found["drivers"] > 30
    assert found["driven"] == pytest.approx(0.25)
    assert {"age", "AU12", "happiness", "doubt"} <= {*found["keys"]}
    assert found["groups"] == found["groups again"] == 2
    assert found["followed"] == pytest.approx(0.5)
    assert found["copy lies off"] < 1e-5
    off, moved = found["off the skin"]
    assert moved > 0.0
    assert off < 1e-3 * moved
    assert found["left open"]
    assert not [*found["changed beside"], *found["changed by opening"], *found["left"]]
    with pytest.warns(FaceWrinkleWarning, match="Joined points at which the mesh was split"):
        face = fw.fit_face(package / "sent.obj", package / "marks.json")
    rig, keys = fw.rig(face, "arkit", wrinkles="none", level=0), np.load(package / "keys.npz")
    assert tuple(keys["names"]) == rig.names
    given = np.asarray(fw.read_surface(package / "sent.obj").points, np.float64)
    own = rig.parts["face"].points[: len(face.points)]  # not their twins at seams, where shapes fade otherwise
    away, nearest = cKDTree(own).query(given)
    assert away.max() * face.unit < 1e-3
    assert np.abs(keys["deltas"] - rig.deltas[:, nearest]).max() * face.unit < 0.05


@in_blender
@pytest.mark.slow
def test_keys_of_her_own_drive_wrinkle_maps_and_stay(package):
    own = [*SETS["arkit"], *SETS["visemes"]]
    (package / "names.json").write_text(json.dumps(own))
    found = played("own_keys", package, needed("makehuman_head_male.obj"))
    assert "Move the islands of all tiles into one" in found["tiles"]
    assert [found[step] for step in ("add", "clear")] == ["", ""]
    assert found["keys"] == len(own) + 2 == 69
    assert found["drivers"] > 30
    assert found["driven"] == pytest.approx(0.25)
    assert not [*found["changed"], *found["lost"]]


@in_blender
def test_keys_are_added_undone_and_animated_and_errors_are_sentences(fake, face):
    mesh = fw.write_mesh(face.mesh, fake / "mesh.obj", face)
    deltas = np.zeros((2, len(face.points), 3), np.float32)
    deltas[0, :, 1] = 1.0
    np.savez(
        fake / "keys.npz", names=["jawOpen", "browInnerUp"], deltas=deltas, reached=np.ones(len(face.points), bool)
    )
    rows = "\n".join(f"01:00:00:{30 + 2.5 * k:.1f},61,{0.2 + 0.1 * k:.1f}" for k in range(3))  # 24 frames a second
    (fake / "take.csv").write_text(f"Timecode,BlendShapeCount,JawOpen\n{rows}\n")
    scores = [[{"categoryName": "jawOpen", "score": 0.4 + 0.1 * k}] for k in range(3)]
    frames = [{"timestamp": 1e3 * k / 24.0, "faceBlendshapes": [{"categories": each}]} for k, each in enumerate(scores)]
    (fake / "take.json").write_text(json.dumps(frames))
    found = played("prepared", fake, mesh)
    assert [found[name] for name in ("add", "foreign", "again", "take.csv", "take.json", "cleared")] == [""] * 6
    assert found["count"] == 4
    assert not found["after undo"]
    assert found["untouched"]
    assert found["places"]
    assert found["end"] == 3
    assert {"jawOpen", "mine"} <= {*found["left"]}
    assert "browInnerUp" not in found["left"]
    assert found["values"] == pytest.approx([0.2, 0.3, 0.4, 0.5], abs=1e-5)
    assert found["hers"]
    sentences = {
        "no take": "takes are read from .csv, .tsv, .txt, .json, .jsonl files, received python",
        "no result": "something must be done.",
        "killed": "facewrinkle ended early (code -9)",
        "old": "has another facewrinkle than this extension is for: update it",
        "none chosen": "Choose which shapes to add",
        "missing": "nobody cannot be run (No such file or directory). Set the Python that has facewrinkle",
        "without": "has no facewrinkle: install it there. Set the Python",
        "mirror": "Apply the Mirror modifier",
        "empty": "has no faces: select the mesh of the head",
    }
    for name, sentence in sentences.items():
        assert sentence in found[name]
        assert "\n" not in found[name]
        assert "Traceback" not in found[name]


@in_blender
def test_a_cancelled_run_leaves_nothing(fake):
    assert played("cancelled", fake) == {"seen": ["Shapes", 0.75, True], "running": False, "folder": False}


@in_blender
@pytest.mark.slow
def test_a_mesh_that_is_no_face_is_refused(package):
    found = played("no_face", package)
    assert "No face was found. Press Place Landmarks" in found["suzanne"]
    assert found["as before"]


@in_blender
@pytest.mark.slow
def test_landmarks_are_placed_to_be_dragged_where_no_face_is_found(package, face):
    found = played("placed", package, fw.write_mesh(face.mesh, package / "head.obj", face))
    assert [found[step] for step in ("placed", "found", "cleared")] == [""] * 3
    assert set(found["marks"]) == set(REQUIRED)
    for name, place in found["marks"].items():
        x, y, z = face.landmarks[name]
        assert np.linalg.norm(np.subtract(place, [x, -z, y])) < 0.2 * face.frame.pupil_distance
    assert found["all"] == len(face.landmarks)
    assert found["as before"]
