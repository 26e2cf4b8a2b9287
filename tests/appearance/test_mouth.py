"""The inside of a mouth: it shows between parted lips, dark, and its lower teeth go with the jaw."""

from __future__ import annotations

import numpy as np
from drawing import held, on_screen
from scipy.spatial.transform import Rotation

from facewrinkle.appearance.mouth import Mouth
from facewrinkle.mesh import to_polydata
from facewrinkle.plotting import Scene, Style


def test_parted_lips_show_the_dark_of_the_mouth(face):
    """Not what is behind the head: the picture between the lips is darker than the background and reddish."""
    parted = face.mesh.copy()
    lower = (np.asarray(parted.points) - face.landmarks["lower_lip_mid"]) / 12.0
    parted.points[:, 1] -= 8.0 * np.exp(-(lower**2).sum(axis=1))
    with Scene(face, Style((200, 200), "mouth")) as scene:
        image = scene.picture(parted)
        gap = 0.5 * (face.landmarks["upper_lip_mid"] + face.landmarks["lower_lip_mid"]) - [0, 2, 0]
        row, column = on_screen(scene, gap[None])[0].astype(int)
    red, _, blue = image[row - 8 : row + 9, column].astype(int).T
    assert (red >= blue).all()


def test_teeth_show_behind_an_open_mouth_and_go_with_the_jaw(face):
    opened = held("AU27")
    mouth = Mouth(face)
    base = np.asarray(opened.points)[: face.mesh.n_points]
    assert not mouth.parted(face.points)
    assert mouth.parted(base)
    jaw, guide = face.muscles["jaw"], face.joint_weights["jaw"]
    turned = face.points.copy()
    turned[guide.vertices] += guide.turned(face.points, 0.7)
    expected = Rotation.from_rotvec(0.7 * jaw.angle * jaw.axis)
    upper, lower = (mouth.inside(turned)[name].points for name in ("upper_teeth", "lower_teeth"))
    np.testing.assert_allclose(upper, mouth.teeth[0].points, atol=1e-4)
    np.testing.assert_allclose(lower, expected.apply(mouth.teeth[1].points - jaw.hinge) + jaw.hinge, atol=0.1)
    parts = mouth.inside(base, float(opened.field_data["jaw_angle"][0]))
    with Scene(face, Style((240, 240), "mouth")) as scene:
        images = [scene.picture(frame).astype(int) for frame in (opened, face.mesh)]
        # The edges of the upper incisors, which the lip does not hide.
        tips = parts["upper_teeth"].points
        tips = tips[(np.abs(tips[:, 0]) < 6.0) & (tips[:, 2] > tips[:, 2].max() - 8.0)]
        rows, columns = on_screen(scene, tips[tips[:, 1] < tips[:, 1].min() + 2.0]).astype(int).T
        assert not scene.plotter.actors["in mouth"].visibility
    white = [(np.ptp(image, axis=2) < 50) & (image.min(axis=2) > 90) for image in images]
    assert white[0][rows, columns].mean() > 0.25
    assert not white[1][rows, columns].any()


def test_the_lower_gum_stays_behind_a_chin_that_is_pushed_back(face):
    """Teeth have one size: gum would come out through receding chins. Teeth between the lips stay where they are."""
    mouth, ahead = Mouth(face), face.frame.axes[2]
    near = np.linalg.norm(face.points - 0.5 * (face.landmarks["pogonion"] + face.landmarks["lower_lip_mid"]), axis=1)
    pushed = face.points - 18.0 * np.exp(-0.5 * (near / 14.0) ** 2)[:, None] * ahead
    skin = to_polydata(pushed, face.triangles)

    def out(places):
        hits = [skin.ray_trace(p + 60.0 * ahead, p - 15.0 * ahead)[0] for p in places]
        return sum(bool(len(hit)) and ((hit - p) @ ahead).max() < -0.1 for hit, p in zip(hits, places, strict=True))

    low = (face.landmarks["lower_lip_mid"] - mouth.teeth[1].points)[:, 1] > 4.0
    assert out(mouth.teeth[1].points[low]) > 5  # or this would test nothing
    drawn = np.asarray(mouth.inside(pushed, 0.0)["lower_teeth"].points, float)
    assert out(drawn[low]) == 0
    high = (face.landmarks["lower_lip_mid"] - mouth.teeth[1].points)[:, 1] < 0.0
    np.testing.assert_allclose(drawn[high], mouth.teeth[1].points[high], atol=1e-4)


def test_the_pocket_moves_no_farther_than_the_lips(face):
    """However lips that touch each other cross by a little: morph targets add up what it does."""
    mouth, random = Mouth(face), np.random.default_rng(3)
    rest = np.asarray(mouth.pocket(face.points).points)
    rim = face.points[mouth.loop]
    np.testing.assert_allclose(rest[: len(rim)], rim, atol=1e-4)
    moved = face.points + random.uniform(-0.5, 0.5, face.points.shape)
    assert np.abs(np.asarray(mouth.pocket(moved).points) - rest).max() < 1.0
    behind = (rest[len(rim) :] - rim.mean(axis=0)) @ face.frame.axes.T
    upper = rim[:, 1] > np.median(rim[:, 1])
    assert (behind[: len(rim), 2] < 0.0).all()
    assert behind[: len(rim), 1][upper].mean() > 3.0 > -3.0 > behind[: len(rim), 1][~upper].mean()
