"""Shapes that do not add up, and how all end.

what           checked against
the choice     the sum of two poses, and the pose of both, simulated here
correctives    the simulation of the mixture, with and without them; the products that drive them
fading         a ramp
"""

import json
from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.rigging.fields import faded
from facewrinkle.rigging.linear_rig import Rig, RigError, facts_text
from facewrinkle.rigging.shapes import ARKIT

SHAPES = (
    "mouthFunnel",
    "mouthPucker",
    "eyeBlinkLeft",
    "eyeBlinkRight",
    "eyeSquintLeft",
    "eyeSquintRight",
    "browInnerUp",
)


@pytest.fixture(scope="module")
def corrected(face):
    return fw.rig(face, "+".join(SHAPES), wrinkles="none", level=0, correctives=2)


def test_the_worst_pairs_are_corrected(corrected):
    assert corrected.drivers == {
        "mouthFunnel_mouthPucker": ("mouthFunnel", "mouthPucker"),
        "eyeBlinkLeft_eyeSquintLeft": ("eyeBlinkLeft", "eyeSquintLeft"),
        "eyeBlinkRight_eyeSquintRight": ("eyeBlinkRight", "eyeSquintRight"),
    }
    assert set(corrected.names) == {*SHAPES, *corrected.drivers}
    for morphs in corrected.morphs.values():
        assert morphs.drivers == corrected.drivers


def test_they_are_what_a_pair_lacks(face, corrected):
    posing = corrected.posing
    alone = [posing.at({"a": (ARKIT[name], 1.0)}).base for name in SHAPES[:2]]
    both = posing.at({name: (ARKIT[name], 1.0) for name in SHAPES[:2]}).base
    lack = (both - alone[0] - alone[1] + posing.rest) / face.unit
    ours = corrected.deltas[corrected.names.index("mouthFunnel_mouthPucker"), : len(lack)]
    large = np.linalg.norm(lack, axis=1) * face.unit > 1.0  # small ones fade
    assert large.sum() > 50
    np.testing.assert_allclose(ours[large], lack[large], atol=1e-3)


@pytest.mark.parametrize(
    "mixture", [SHAPES[:2], ("eyeBlinkLeft", "eyeSquintLeft", "eyeBlinkRight", "eyeSquintRight")], ids=["lips", "lids"]
)
def test_mixtures_are_closer_to_the_simulation(corrected, mixture):
    plain = replace(corrected, drivers={})
    for weight in (0.5, 1.0):
        weights = dict.fromkeys(mixture, weight)
        ours, without = corrected.error(weights), plain.error(weights)
        assert ours.mean < (0.75 if weight < 1.0 else 0.15) * without.mean
    assert "mouthFunnel, mouthPucker" in [", ".join(each) for each in corrected.mixtures]


def corrected_pairs(monkeypatch, *pairs):
    """A rig of ARKit's shapes that corrects pairs, without meshes; nothing is off."""
    monkeypatch.setattr(Rig, "error", lambda self, weights: RigError(0.0, 0.0, 0.0))
    drivers = {"_".join(pair): pair for pair in pairs}
    return Rig(None, (*ARKIT, *drivers), {}, {}, {}, drivers, "none", ARKIT, None, None, None)


def test_each_mixture_is_told_once(monkeypatch):
    """Two pairs of brows that rise, of the left and of the right, are one mixture."""
    rig = corrected_pairs(monkeypatch, *(("browInnerUp", f"browOuterUp{side}") for side in ("Left", "Right")))
    told = [error["weights"] for error in json.loads(facts_text(rig, errors=True))["errors"]]
    for weight in (0.5, 1.0):
        assert told.count(dict.fromkeys(("browInnerUp", "browOuterUpLeft", "browOuterUpRight"), weight)) == 1
    assert len({frozenset(weights.items()) for weights in told}) == len(told)


def test_movements_to_the_left_and_to_the_right_are_no_pair(monkeypatch):
    rig = corrected_pairs(monkeypatch, ("jawLeft", "mouthFunnel"), ("jawRight", "mouthFunnel"))
    told = [set(weights) for weights in rig.mixtures]
    assert {"jawLeft", "mouthFunnel"} in told
    assert {"jawRight", "mouthFunnel"} in told
    assert not any({"jawLeft", "jawRight"} <= names for names in told)


def test_they_follow_the_product_of_the_weights(corrected):
    weights = corrected.driven({"mouthFunnel": 0.5, "mouthPucker": 0.8})
    assert weights == {"mouthFunnel": 0.5, "mouthPucker": 0.8, "mouthFunnel_mouthPucker": pytest.approx(0.4)}
    assert corrected.driven({"mouthFunnel": 1.0}) == {"mouthFunnel": 1.0}
    told = json.loads(facts_text(corrected))
    assert told["drivers"]["mouthFunnel_mouthPucker"] == ["mouthFunnel", "mouthPucker"]


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
