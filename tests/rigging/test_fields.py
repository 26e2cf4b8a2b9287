"""What shapes change, and what bends their ways.

what            checked against
half ways       the simulation at weights in between, with and without them; the oracle; the lips' distance at rest
in USD          the half ways
fading          ways along a strip
"""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.rigging.fields import faded
from facewrinkle.rigging.modelled import Movements
from tools.trials.oracle import DEEPEST, Oracle

CURVED = ("eyeBlinkLeft", "eyeBlinkRight", "jawOpen", "mouthClose")
BETWEEN = (0.25, 0.5, 0.75)


@pytest.fixture(scope="module")
def bent(face):
    return fw.rig(face, "+".join((*CURVED, "cheekPuff")), wrinkles="none", level=0, halfway=True)


def bent_at(rig, names, weight):
    """Points of the skin as USD has them: straight from rest to the half way, and straight from there to the shape."""
    points, half = np.array(rig.mesh.points), 1.0 - abs(2.0 * weight - 1.0)
    for name in names:
        points += weight * rig.deltas[rig.names.index(name)] + half * rig.morphs["face"].bends[name][0]
    return points


def error_of(rig, names, weight, points):
    """Mean error and motion against the simulation, over what moves, in mm."""
    pose = rig.posing.at({name: (rig.shapes[name], weight) for name in names})
    truth = pose.base / rig.face.unit
    rest, points = rig.face.points, points[: len(truth)]
    way = np.linalg.norm(truth - rest, axis=1)
    moved = np.maximum(way, np.linalg.norm(points - rest, axis=1)) * rig.face.unit > 0.1
    off = np.linalg.norm(points - truth, axis=1)
    return off[moved].mean() * rig.face.unit, off[moved].max() * rig.face.unit, way[moved].mean() * rig.face.unit


def test_shapes_with_a_curved_way_have_a_half_way_and_no_target_for_it(bent):
    assert bent.names == (*CURVED, "cheekPuff")
    assert not bent.drivers
    for morphs in bent.morphs.values():
        assert set(morphs.bends) == set(CURVED)


@pytest.mark.parametrize(
    "names", [CURVED[:2], CURVED[2:3], CURVED[2:]], ids=["a blink", "the jaw", "lips over an open jaw"]
)
def test_they_bend_the_way_to_that_of_the_simulation(bent, names):
    for weight in BETWEEN:
        ours, _, motion = error_of(bent, names, weight, bent_at(bent, names, weight))
        without, _, _ = error_of(bent, names, weight, bent.at(dict.fromkeys(names, weight)).points)
        assert ours < 0.1 * motion
        assert ours < (0.1 if weight == 0.5 else 0.6) * without
    middle, largest, motion = error_of(bent, names, 0.5, bent_at(bent, names, 0.5))
    assert middle < 0.02 * motion
    assert largest < 0.3


def test_bent_ways_clear_the_balls_and_keep_lips_closed(face, bent):
    oracle, rest, count = Oracle(face), bent.mesh.points, len(face.points)
    upper, lower = Movements(face).pairs
    for weight in BETWEEN:
        shut = bent_at(bent, CURVED[:2], weight)
        found = oracle.findings(np.asarray(shut[:count]) * face.unit, 0.0)
        assert max(found.eyes, found.lids) < DEEPEST
        assert found.inverted == 0
        closed = bent_at(bent, CURVED[2:], weight)
        gaps = [np.linalg.norm(points[upper] - points[lower], axis=1) for points in (rest, closed)]
        assert np.abs(gaps[1] - gaps[0]).max() * face.unit < 0.3


def test_in_usd_they_are_in_betweens(bent, tmp_path):
    usd = pytest.importorskip("pxr.Usd")
    from pxr import UsdSkel

    stage = usd.Stage.Open(str(fw.write_rig(bent, tmp_path / "head.usdc")))
    shape = UsdSkel.BlendShape(stage.GetPrimAtPath("/Face/face/eyeBlinkLeft"))
    (between,) = shape.GetInbetweens()
    assert between.GetWeight() == 0.5
    moved = np.zeros_like(bent.deltas[0])
    moved[np.asarray(shape.GetPointIndicesAttr().Get())] = np.asarray(between.GetOffsets())
    np.testing.assert_allclose(moved, bent_at(bent, ["eyeBlinkLeft"], 0.5) - bent.mesh.points, atol=1e-4)
    assert not UsdSkel.BlendShape(stage.GetPrimAtPath("/Face/face/cheekPuff")).GetInbetweens()


def test_shapes_fade_before_they_end():
    points = np.stack(np.meshgrid(np.arange(60.0), np.arange(3.0), [0.0]), axis=-1).reshape(-1, 3)
    triangles = np.asarray(pv.PolyData(points).delaunay_2d().regular_faces)
    ways = 0.4 * points[:, 0] / 59.0
    deltas = np.zeros((1, len(points), 3), np.float32)
    deltas[0, :, 2] = ways
    ended, turned = faded(deltas.copy(), deltas.copy(), triangles, 0.1)
    slope = 0.4 / 59.0
    np.testing.assert_array_equal(ended, turned)
    np.testing.assert_allclose(ended[0, ways > 0.2, 2], ways[ways > 0.2], rtol=1e-6)
    assert not ended[0, ways < 0.1 - 2.5 * slope].any()
    row = ended[0, points[:, 1] == 1.0, 2]
    assert (np.diff(row) >= 0.0).all()
    assert np.diff(row).max() < 4.0 * slope
