"""All patterns on the built-in head, on real faces that stand still and that move; and presets.

what              checked against
heights           at the vertices of the original mesh: window, depth and formula at their coordinates
places            landmarks: a dimple beside the mouth, a pouch and its crease under the eye, frown lines above the nose
displacement      the points of the same motion without layers, moved along their normals
recorded motion   a number, a function of time and measured compression as strengths, beside each other
"""

import warnings

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.layers.compression import StrainField
from facewrinkle.layers.patterns_on_skin import presets
from facewrinkle.layers.patterns_on_skin.presets import names
from facewrinkle.layers.patterns_on_skin.region import RegionCompression


def laid_out(layer, face, strength, seconds):
    """Heights that a layer should add at the vertices of the original mesh."""
    laid, (kind,) = layer.laid(face), layer.patterns
    window, out = laid.base_window, np.zeros(len(laid.chart))
    inside = window > 0.0
    x, y = kind.plane(laid.chart[inside], laid.aspect)
    out[inside] = layer.depth * window[inside] * kind.relief(x, y, strength, kind.time(seconds), laid.aspect)
    return out


def check(face, layers, strength):
    sim = fw.Simulation(face, layers=layers, motion=fw.Still(face, 0.01))
    *_, frame = sim.run(4)
    n, total = len(face.points), 0.0
    for layer in layers:
        ours, expected = frame[f"pattern_{layer.name}"], laid_out(layer, face, strength, sim.time)
        assert np.abs(ours).max() > 0.2 * strength * abs(layer.depth)  # refined: between the given vertices as well
        np.testing.assert_allclose(ours[:n], expected, rtol=0, atol=1e-9)
        total = total + ours
    np.testing.assert_allclose(frame["W"], total, atol=1e-12)
    moved = np.asarray(frame.points, float)[:n] * face.unit
    expected = face.points_mm + frame["W"][:n, None] * fw.geometry.vertex_normals(face.points, face.triangles)
    np.testing.assert_allclose(moved, expected, atol=2e-5 * face.unit * np.abs(face.points).max())
    return frame


@pytest.mark.parametrize(
    ("any_face", "strength"),
    [
        (None, 1.0),
        ("makehuman_head_male", 0.4),
        pytest.param("ict_face_narrow", 0.4, marks=pytest.mark.slow),
    ],
    indirect=["any_face"],
)
def test_all_presets_on_heads(any_face, strength):
    face = any_face
    frame = check(face, [fw.PatternLayer.preset(name, face, strength=strength) for name in names()], strength)
    size, axes, mm = face.frame.pupil_distance, face.frame.axes, face.unit
    for side, outward in (("l", 1.0), ("r", -1.0)):

        def where(name, pick, outward=outward, side=side):  # from a landmark, in distances between the pupils
            pattern, landmark = name
            at = frame["rest"][int(pick(frame[f"pattern_{pattern}_{side}"]))]
            return (at - face.landmarks[landmark.format(side)]) @ axes.T / size * [outward, 1.0, 1.0]

        right, up, _ = where(("dimple", "mouth_{}"), np.argmin)
        assert 0.15 < right < 0.35
        assert abs(up) < 0.15
        top, bottom = (where(("eye_pouch", "eye_{}_centre"), pick) for pick in (np.argmax, np.argmin))
        assert -0.45 < bottom[1] < top[1] < -0.2
        assert np.abs([top[0], bottom[0]]).max() < 0.25
        deepest = where(("eye_corner", "eye_{}_outer"), np.argmin)
        assert 0.02 < deepest[0] < 0.45
        assert abs(deepest[1]) < 0.25
    frown = (frame["rest"][int(np.argmin(frame["pattern_frown"]))] - face.landmarks["glabella"]) @ axes.T / size
    assert 0.05 < abs(frown[0]) < 0.2
    assert abs(frown[1]) < 0.25
    dimple = fw.PatternLayer.preset("dimple_l", face)
    assert frame["pattern_dimple_l"].min() == pytest.approx(-strength * dimple.depth, rel=0.08)
    assert dimple.depth == pytest.approx(1.7 * size * mm / 63.0)


def test_strengths_of_every_sort_on_a_captured_animation(clip):
    """Dimples at one place, with the strength as a number, a function of time, and set by the skin."""
    face, recorded = clip

    def pulse(seconds):
        return 0.5 - 0.5 * np.cos(np.pi * seconds)

    plain, timed = (
        fw.PatternLayer.preset("dimple_l", face, name="plain"),
        fw.PatternLayer.preset("dimple_l", face, name="timed", strength=pulse),
    )
    (skin, _) = fw.PatternLayer.presets("dimple", face, strength="skin")
    driver, compression = skin.strength, RegionCompression(face, skin.laid(face), skin.strength.along)
    field = StrainField.of(face)
    wrinkles = fw.PatternLayer.preset("eye_corner_l", face)
    layers, level = [plain, timed, skin, wrinkles], fw.Refinement(max_level=0)
    with warnings.catch_warnings(action="ignore", category=fw.FaceWrinkleWarning):  # without refinement it is coarse
        sim = fw.Simulation(face, level, layers=layers, time_step=0.1, motion=recorded)
    bare = fw.Simulation(face, level, layers=[], time_step=0.1, motion=recorded)
    first, smile, by_skin = None, [], []
    for _ in range(40):
        frame, skeleton = sim.step(), bare.step()
        ours = {name: np.array(frame[f"pattern_{name}"]) for name in ("plain", "timed", "dimple_l", "eye_corner_l")}
        first = ours if first is None else first
        for name in ("plain", "eye_corner_l"):  # it rides on the motion, unchanged
            np.testing.assert_array_equal(ours[name], first[name])
        np.testing.assert_allclose(ours["timed"], laid_out(timed, face, pulse(sim.time), 0.0), atol=1e-9)
        epsilon = compression.at(field.strain(np.asarray(skeleton.points, float) * face.unit))
        np.testing.assert_allclose(ours["dimple_l"], laid_out(skin, face, driver(epsilon), 0.0), atol=1e-4)
        points, moved = np.asarray(skeleton.points, float), np.asarray(frame.points, float)
        normals = fw.geometry.vertex_normals(points, face.triangles)
        height = sum(ours.values())
        np.testing.assert_allclose(frame["W"], height, atol=1e-12)
        np.testing.assert_allclose(moved * face.unit, points * face.unit + height[:, None] * normals, atol=1e-4)
        smile.append(recorded.weights(sim.time)["mouthSmile_L"])
        by_skin.append(-ours["dimple_l"].min())
    smile, by_skin = np.array(smile), np.array(by_skin)
    assert by_skin.max() > 0.8 * -first["plain"].min()
    assert (by_skin[smile > 0.8 * smile.max()] > 0.7 * by_skin.max()).all()
    assert by_skin[-1] == 0.0


# --- presets ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("any_face", [None, "ict_face_narrow", "makehuman_head_male"], indirect=True)
def test_all_presets_on_all_faces(any_face):
    face = any_face
    size, axes = face.frame.pupil_distance, face.frame.axes
    for name in presets.names():
        layer = fw.PatternLayer.preset(name, face)
        laid = layer.laid(face)
        at = (laid.center.point - face.frame.origin) @ axes.T / size
        assert laid.center.distance < 0.2 * size
        window = laid.base_window
        assert 5 < (window > 0).sum() < 0.2 * len(window)
        side = ((face.points - face.frame.origin) @ axes[0])[window > 0.3]
        if name.endswith("_l"):
            assert at[0] > 0.2
            assert (side > 0).all()
        elif name.endswith("_r"):
            assert at[0] < -0.2
            assert (side < 0).all()
        else:
            assert abs(at[0]) < 0.05
        assert laid.chart[window > 0][:, 1] @ ((face.points - laid.center.point) @ axes[1])[window > 0] > 0  # upright
        assert 0 <= layer.level_needed(face) <= 5


@pytest.mark.filterwarnings("ignore:the mesh is too coarse to carry the pattern")
def test_left_and_right_are_mirror_images(face):
    level = fw.Refinement(max_level=0)
    layers = fw.PatternLayer.presets("eye_corner", face, sharpness=0.0, variation=0.0)
    frame = fw.Simulation(face, level, layers=layers, motion=fw.Still(face)).step()
    left, right = frame["pattern_eye_corner_l"], frame["pattern_eye_corner_r"]
    assert np.abs(left).max() > 0.1
    np.testing.assert_allclose(np.sort(left), np.sort(right), atol=2e-3)


def test_a_preset_takes_changes(face):
    layer = fw.PatternLayer.preset("forehead", face, depth=2.5, number=6, size=(1.0, 0.4), border=0.3)
    assert layer.depth == 2.5
    assert layer.patterns[0].number == 6
    assert layer.region.border == 0.3
    np.testing.assert_allclose(layer.region.size, np.array([1.0, 0.4]) * face.frame.pupil_distance)
    assert fw.PatternLayer.preset("frown", face).name == "frown"
