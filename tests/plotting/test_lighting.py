"""The key light casts shadows on every face, and on what is between its lids and lips."""

import numpy as np
import pytest
from drawing import SMALL, difference, on_screen
from scipy.spatial import cKDTree

import facewrinkle as fw
from facewrinkle.appearance.seen import Appearance
from facewrinkle.plotting import Scene, Style
from facewrinkle.plotting.lighting import light_at_rest


def brightness(face, style, names, lamp=None):
    """Mean brightness around landmarks, with a lamp from a direction [right, up, towards the camera] if given."""
    with Scene(face, style) as scene:
        if lamp is not None:
            key = scene.plotter.renderer.lights[0]
            key.position = np.asarray(key.focal_point) + 900.0 * np.asarray(lamp)
        image = scene.picture(face.mesh).astype(float).mean(axis=2)
        places = on_screen(scene, np.array([face.landmarks[name] for name in names])).round().astype(int)
    return [image[row - 1 : row + 2, column - 1 : column + 2].mean() for row, column in places]


@pytest.mark.parametrize("clay", [True, False])
def test_the_neck_lies_in_the_shadow_of_the_chin(face, clay):
    """Below the chin, beside it where the light goes past it: from the left, and from the right."""
    style = Style(SMALL, clay=clay)
    with Scene(face, style) as scene:
        image = scene.picture(face.mesh).astype(float).mean(axis=2)
        throat = face.landmarks["menton"] + np.array([[12.0, -22, -30], [-32.0, -34, -30]])
        (shaded, lit) = on_screen(scene, throat).round().astype(int)
    assert image[tuple(shaded)] < 0.8 * image[tuple(lit)]


def test_a_lamp_from_above_leaves_the_eyes_in_the_dark(face):
    frontal, above = (brightness(face, Style(SMALL), ["eye_l_centre"], lamp)[0] for lamp in ((0, 0.2, 1), (0, 1, 0.25)))
    assert above < 0.8 * frontal


@pytest.mark.slow
def test_long_hair_leaves_the_skin_below_it_in_the_dark():
    """Before the ear and at the jaw, not on the nose."""
    open_to_all = []
    for length in (0.0, 0.6):
        face = fw.default_face({"hair_length": length})
        marks = [face.landmarks[name] for name in ("gonion_r", "zygion_r", "nose_tip")]
        nearest = cKDTree(face.points).query(marks)[1]
        open_to_all.append(Appearance.of(face).at(face.mesh).smooth.openness[nearest])
    bare, under = open_to_all
    assert (under < [0.3, 0.3, 1.1] * bare).all()
    assert under[2] > 0.95 * bare[2]


def test_cropped_hair_shades_the_skin_beside_it():
    shaved, cropped = (fw.default_face({"hair_density": density}) for density in (-1.0, 0.0))
    at = cKDTree(shaved.points).query([shaved.landmarks[name] for name in ("trichion", "glabella")])[1]
    assert (light_at_rest(shaved, shaved.mesh)[at, 1] == 255).all()
    hairline, brow = light_at_rest(cropped, cropped.mesh)[at, 1]
    assert 140 < hairline < 240
    assert brow == 255
    clay = Style(SMALL, clay=True)  # which shows no hair
    (here,), (there,) = (brightness(face, clay, ["trichion"]) for face in (shaved, cropped))
    assert here == pytest.approx(there, abs=1.0)


def test_a_beard_shades_the_skin_under_it_and_no_more_than_the_border_of_the_lips():
    bearded = fw.default_face({"sex": 0.8, "beard": 0.1})
    names = "pogonion", "upper_lip_mid", "lower_lip_mid", "nose_tip", "malar_l"
    at = cKDTree(bearded.points).query([bearded.landmarks[name] for name in names])[1]
    chin, *borders, nose, cheek = light_at_rest(bearded, bearded.mesh)[at, 1]
    assert chin < 200
    assert min(borders) > 215
    assert nose == cheek == 255
    full = fw.default_face({"sex": 0.8, "beard": 0.8})
    assert light_at_rest(full, full.mesh)[at[0], 1] < 0.6 * chin


def test_drawing_in_clay_leaves_the_eyes_of_the_face_as_they_are(face):
    style = Style(SMALL)
    with Scene(face, style) as before:
        expected = before.picture(face.mesh)
    with Scene(face, Style(SMALL, clay=True)) as clay:
        clay.picture(face.mesh)
    with Scene(face, style) as after:
        assert difference(after.picture(face.mesh), expected).max() == 0
