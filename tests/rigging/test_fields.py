"""What shapes change, and what bends their ways.

what            checked against
half ways       the simulation at weights in between, with and without them; the oracle; the lips' distance at rest
in USD          the rig at half the weight
fading          ways along a strip
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from analysis.oracle import DEEPEST, Oracle
from facewrinkle.rigging.fields import faded

CURVED = ("eyeBlinkLeft", "eyeBlinkRight", "jawOpen", "mouthClose")
BETWEEN = (0.25, 0.5, 0.75)


@pytest.fixture(scope="module")
def bent(face):
    return fw.rig(face, "+".join((*CURVED, "cheekPuff")), "none", 0, halfway=True)


def test_shapes_with_a_curved_way_get_a_target_for_the_half_way(bent):
    assert bent.drivers == {f"{name}_half": (name, f"1-{name}") for name in CURVED}
    assert bent.driven({"jawOpen": 0.25}) == {"jawOpen": 0.25, "jawOpen_half": 0.1875}
    assert bent.driven({"jawOpen": 1.0}) == {"jawOpen": 1.0}
    assert not any(name.endswith("_half") for mixture in bent.mixtures for name in mixture)


@pytest.mark.parametrize(
    "names", [CURVED[:2], CURVED[2:3], CURVED[2:]], ids=["a blink", "the jaw", "lips over an open jaw"]
)
def test_they_bend_the_way_to_that_of_the_simulation(bent, names):
    linear = replace(bent, drivers={})
    for weight in BETWEEN:
        ours, without = (rig.error(dict.fromkeys(names, weight)) for rig in (bent, linear))
        assert ours.mean < 0.1 * ours.motion
        assert ours.mean < 0.45 * without.mean
    middle = bent.error(dict.fromkeys(names, 0.5))
    assert middle.mean < 0.02 * middle.motion
    assert middle.largest < 0.3


def test_bent_ways_clear_the_balls_and_keep_lips_closed(face, bent):
    oracle, rest, count = Oracle(face), bent.mesh.points, len(face.points)
    upper, lower = bent.posing._movements._pairs
    for weight in BETWEEN:
        shut = bent.at(bent.driven(dict.fromkeys(CURVED[:2], weight))).points
        found = oracle.findings(np.asarray(shut[:count]) * face.unit, 0.0)
        assert max(found.eyes, found.lids) < DEEPEST
        assert found.inverted == 0
        closed = bent.at(bent.driven(dict.fromkeys(CURVED[2:], weight))).points
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
    expected = bent.at(bent.driven({"eyeBlinkLeft": 0.5})).points - bent.mesh.points
    np.testing.assert_allclose(moved, expected, atol=1e-4)
    assert not stage.GetPrimAtPath("/Face/face/eyeBlinkLeft_half")
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
