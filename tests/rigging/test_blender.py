"""Rigs and animations in Blender, where FACEWRINKLE_BLENDER names a Python that has bpy (it is too large to install for
every run of the tests).

what            checked against
shape keys      the arrays of the rig
animations      the way of the skin in the frames
"""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.export.animation import AnimationWriter

BLENDER = os.environ.get("FACEWRINKLE_BLENDER", "")
pytestmark = pytest.mark.skipif(not BLENDER, reason="FACEWRINKLE_BLENDER names no Python with bpy")


def judged(path, names, points, deltas):
    arrays = path.with_suffix(".npz")
    np.savez(arrays, names=list(names), points=points, deltas=deltas)
    command = [BLENDER, Path(__file__).parent / "judges" / "blender.py", path, arrays]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)
    found = [line for line in done.stdout.splitlines() if line.startswith("found ")]
    assert found, done.stderr
    return json.loads(found[0].removeprefix("found "))


def test_shape_keys_are_those_of_the_rig(face, tmp_path):
    rig = fw.rig(face, "jawOpen+browInnerUp+mouthFunnel+mouthPucker", wrinkles="separate", level=1, correctives=1)
    path = fw.write_rig(rig, tmp_path / "head.glb")
    found = judged(path, rig.names, rig.parts["face"].points, rig.deltas)
    assert all(names == list(rig.names) for names in found["names"].values())
    assert set(found["names"]) == set(rig.parts)
    size = np.ptp(rig.parts["face"].points)
    assert found["points"] < 1e-6 * size
    assert found["deltas"] < 1e-6 * size
    assert {name: tuple(each) for name, each in found["drivers"].items()} == rig.drivers


def test_an_animation_plays(face, tmp_path):
    sim = fw.Simulation(face, fw.Refinement(max_level=0), layers=[])
    sim.express("surprise")
    writer, frames = AnimationWriter(face, tmp_path / "surprise.glb", 0.1), list(sim.run(9))
    for frame in frames:
        writer.add(frame)
    (path,) = writer.write(0.04 * np.arange(9), sim.forest)
    ours = np.linalg.norm(frames[4].points - frames[0].points, axis=1).max()
    nothing = np.zeros((1, 3))
    assert judged(path, [], nothing, nothing)["plays"] == pytest.approx(ours, abs=0.2)
