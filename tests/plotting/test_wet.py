"""Wet pictures: what is seen through a tear is the skin behind it, bent; highlights; nothing changes beside it."""

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.plotting import Style, TearScene, View

CLOSE = Style((160, 160), View((0.3, 0.05, 1.0), "malar_l", (-0.25, -0.2, 0.0), 0.5))


@pytest.fixture(scope="module")
def tear(face):
    return fw.SheddingTear(face, start="l").surface(1.3)


def difference(first, second):
    return np.abs(first.astype(int) - second.astype(int)).sum(axis=2)


@pytest.fixture(scope="module")
def pictures(face, tear):
    with TearScene(face, CLOSE) as scene:
        dry, wet, again = scene.picture(face.mesh), scene.picture(face.mesh, [tear]), scene.picture(face.mesh)
    return dry, wet, again


def test_only_the_tear_changes_the_picture_and_it_goes_again(pictures):
    dry, wet, again = pictures
    changed = difference(dry, wet) > 6
    assert 0.005 < changed.mean() < 0.15
    assert not changed[:, :20].any()
    assert np.array_equal(dry, again)


def test_it_is_seen_through_and_has_highlights(pictures):
    dry, wet, _ = pictures
    changed = difference(dry, wet) > 6
    assert wet[changed].max(axis=1).max() > 250  # the lamp in the bead
    assert dry[changed].max() < 240
    assert np.median(difference(dry, wet)[changed]) < 120  # most of it is still the color of skin


def test_a_trail_has_glints_and_is_else_darker(pictures):
    """Evenly brighter, it would read as a scar."""
    dry, wet, _ = (picture.astype(float) for picture in pictures)
    trail = difference(dry, wet) > 6
    trail[100:] = False  # the head
    gain = (wet - dry).mean(axis=2)[trail]
    assert np.median(gain) < -3.0
    assert np.percentile(gain, 95) > 25.0


def test_a_drop_bends_what_is_behind_it(face):
    drop = fw.DrippingTear(face, "l", size=5.0)
    mesh = drop.surface(drop.begin + drop.hang)
    style = Style((160, 160), View((0.3, 0.05, 1.0), "eye_l_centre", (0.0, -0.2, 0.0), 0.5))
    with TearScene(face, style) as scene:
        dry, wet = scene.picture(face.mesh), scene.picture(face.mesh, [mesh])
    assert 0.01 < (difference(dry, wet) > 12).mean() < 0.2
    assert wet.max() > 250
