"""The inside of a mouth: it shows between parted lips, dark; its lower teeth go with the jaw; its tongue comes out."""

from itertools import pairwise

import numpy as np
import pytest
from drawing import held, on_screen
from expressions import settled
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
from small_meshes import signed_distances

import facewrinkle as fw
from facewrinkle.anatomy.teeth import CROWN_RINGS, CROWN_SIDES, CROWN_WIDTHS
from facewrinkle.appearance.mouth import Mouth
from facewrinkle.appearance.seen import Appearance
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
    white = [(np.ptp(image, axis=2) < 50) & (image.min(axis=2) > 40) for image in images]
    assert white[0][rows - 1, columns].mean() > 0.7  # their own pixels are half of what is below
    assert not white[1][rows, columns].any()


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_lips_that_meet_in_the_middle_are_parted_where_they_are_apart(face, sign):
    beside, lowered = np.maximum(sign * face.points[:, :1] - 4.0, 0.0), face.points.copy()
    lowered -= np.minimum(0.3 * beside, 3.0) * face.mandible_share[:, None] * face.frame.axes[1]
    assert Mouth(face).parted(lowered)
    assert not Mouth(face).parted(face.points + 3.0 * face.frame.axes[1])


def test_gum_and_pocket_stay_behind_a_chin_that_is_pushed_back(face):
    """Teeth have one size: these would come out through receding chins. Teeth between the lips stay where they are."""
    mouth, ahead = Mouth(face), face.frame.axes[2]
    near = np.linalg.norm(face.points - 0.5 * (face.landmarks["pogonion"] + face.landmarks["lower_lip_mid"]), axis=1)
    pushed = face.points - 18.0 * np.exp(-0.5 * (near / 14.0) ** 2)[:, None] * ahead
    skin = fw.mesh.to_polydata(pushed, face.triangles)

    def out(places):
        hits = [skin.ray_trace(p + 60.0 * ahead, p - 15.0 * ahead)[0] for p in places]
        return sum(bool(len(hit)) and ((hit - p) @ ahead).max() < -0.1 for hit, p in zip(hits, places, strict=True))

    low = (face.landmarks["lower_lip_mid"] - mouth.teeth[1].points)[:, 1] > 4.0
    assert out(mouth.teeth[1].points[low]) > 5  # or this would test nothing
    drawn = np.asarray(mouth.inside(pushed, 0.0)["lower_teeth"].points, float)
    assert out(drawn[low]) == 0
    rings = slice(len(mouth.loop), None)
    assert out(np.asarray(mouth.pocket(face.points).points[rings], float)) > 5
    assert out(np.asarray(mouth.pocket(pushed).points[rings], float)) == 0
    high = (face.landmarks["lower_lip_mid"] - mouth.teeth[1].points)[:, 1] < 0.0
    np.testing.assert_allclose(drawn[high], mouth.teeth[1].points[high], atol=1e-4)


@pytest.mark.parametrize("seed", [18, 25, 33])
def test_the_pocket_of_one_who_laughs_stays_behind_the_hollow_above_the_chin(seed):
    face = fw.default_face(fw.Identity.random(seed))
    frame, ahead = settled(fw.Simulation(face), "laughter"), face.frame.axes[2]
    pocket, lip = Appearance.of(face).at(frame).pocket, face.landmarks["lower_lip_mid"]
    depths = []
    for below in np.arange(6.0, 16.0):
        p = lip - below * face.frame.axes[1]
        skin, dark = (mesh.ray_trace(p + 60.0 * ahead, p - 40.0 * ahead)[0] @ ahead for mesh in (frame, pocket))
        depths.append(skin.max() - dark.max())
    assert min(depths) > 0.5


def test_the_pocket_moves_no_farther_than_the_lips(face):
    """However lips that touch each other cross by a little: morph targets add up what it does."""
    mouth, random = Mouth(face), np.random.default_rng(3)
    rest = np.asarray(mouth.pocket(face.points).points)
    rim = face.points[mouth.loop]
    np.testing.assert_allclose(rest[: len(rim)], rim, atol=1e-4)
    moved = face.points + random.uniform(-0.5, 0.5, face.points.shape)
    assert np.abs(np.asarray(mouth.pocket(moved).points) - rest).max() < 1.0
    behind = (rest[len(rim) : 2 * len(rim)] - rim) @ face.frame.axes.T
    upper = face.mandible_share[mouth.loop] < 0.5
    assert (behind[:, 2] < 0.0).all()
    assert behind[upper, 1].mean() > 3.0 > -3.0 > behind[~upper, 1].mean()


@pytest.mark.parametrize("expression", ["AU27", "laughter", "surprise"])
def test_the_pocket_lies_before_no_crown(face, expression):
    """It goes along with the jaws: who looks in between the lips sees front teeth down to the gum."""
    seen, ahead = Appearance.of(face).at(held(expression)), face.frame.axes[2]
    opening = np.asarray(seen.pocket.points[: len(Mouth(face).loop)], float).mean(axis=0)
    size = CROWN_SIDES * CROWN_RINGS + 1
    for jaw in ("upper_teeth", "lower_teeth"):
        crowns = np.asarray(seen.mouth_parts[jaw].points, float)[-2 * len(CROWN_WIDTHS["upper"]) * size :]
        for front in crowns.reshape(-1, size, 3)[:6, : 6 * CROWN_SIDES : CROWN_SIDES].reshape(-1, 3):
            crossed = seen.pocket.ray_trace(front, opening)[0]
            assert np.abs((crossed - front) @ ahead).max(initial=0.0) < 0.7


def upper_crowns(seen):
    """The points (14, m, 3) of the crowns of the upper teeth, from the middle backwards."""
    count, size = 2 * len(CROWN_WIDTHS["upper"]), CROWN_SIDES * CROWN_RINGS + 1
    return np.asarray(seen.mouth_parts["upper_teeth"].points, float)[-count * size :].reshape(count, size, 3)


def test_nothing_hides_the_premolars_of_a_smile(face):
    """Wide lips take the pocket along: between them some of each of the first ten upper teeth shows."""
    frame = held("happiness")
    seen, ahead = Appearance.of(face).at(frame), face.frame.axes[2]
    for crown in upper_crowns(seen)[:10]:
        outer = crown[crown[:, 2] > np.median(crown[:, 2])]
        free = [not len(frame.ray_trace(place, place + 60.0 * ahead)[0]) for place in outer]
        assert any(free)
        for place in outer[free]:
            assert not len(seen.pocket.ray_trace(place, place + 60.0 * ahead)[0])


def test_teeth_darken_gently_towards_the_corners_of_a_smile(face):
    """Each of the first ten keeps at least three quarters of the red of the one before it, and grows warmer."""
    seen = Appearance.of(face).at(held("happiness"))
    paint = np.asarray(seen.mouth_parts["upper_teeth"].point_data["paint"], float)
    crowns = paint[-upper_crowns(seen)[..., 0].size :].reshape(14, -1, 3)[:10:2]
    red, green, _ = crowns[:, 2 * CROWN_SIDES].T
    kept = red[1:] / red[:-1]
    assert (kept > 0.75).all()
    assert (kept < 1.0).all()
    assert (np.diff(green / red) < 0.0).all()


def test_cheeks_are_lighter_than_the_crease_behind_the_lips_and_the_throat(face):
    mouth = Mouth(face)
    red, green, _ = np.asarray(mouth.pocket(face.points).point_data["paint"], float).T
    crease, cheeks, _, throat = red[:-1].reshape(4, -1).mean(axis=1)
    assert cheeks > crease > throat
    assert (red > 2.0 * green).all()


def of_an_upper_tooth(face, frame, k):
    """The middle (m, 3) of the outer face of the k-th tooth from the middle, from its edge into the gum."""
    rings = upper_crowns(Appearance.of(face).at(frame))[k, :-1:CROWN_SIDES]
    return np.concatenate([np.linspace(*pair, 20, endpoint=False) for pair in pairwise(rings)])


def is_free(face, frame, place):
    """Whether no skin is in front of a place."""
    ahead = face.frame.axes[2]
    return not len(frame.ray_trace(place + 0.3 * ahead, place + 60.0 * ahead)[0])


@pytest.mark.parametrize("expression", ["happiness", "pain", "disgust"])
def test_lips_show_more_than_the_necks_of_incisors(face, expression):
    frame = held(expression)
    line = of_an_upper_tooth(face, frame, 0)
    free = [is_free(face, frame, place) for place in line[1:]]
    assert 5.5 <= np.diff(line[:, 1])[free].sum() <= 10.5, "more than half of 10.5 mm"


def test_a_full_lower_lip_smiles_without_the_gums():
    """The middle of such lips is low, and so are the teeth; a third of a millimeter is the edge of the lip."""
    someone = fw.default_face(fw.Identity.random(21))
    frame = settled(fw.Simulation(someone), "happiness")
    line = of_an_upper_tooth(someone, frame, 2)
    neck = line[line[:, 1].argmax()] + 0.5 * someone.frame.axes[2]
    assert not is_free(someone, frame, neck + 0.35 * someone.frame.axes[1])


# --- the tongue ---------------------------------------------------------------------------------


def depth_in(tongue, points):
    """How deep the deepest of some points (k, 3) lies in a tongue, by VTK's signed distance."""
    mesh = fw.mesh.to_polydata(np.asarray(tongue.points, np.float64), tongue.regular_faces)
    return max(-signed_distances(points, mesh).min(initial=0.0), 0.0)


def depth_in_teeth(tongue, inside):
    """How deep a tongue and the crowns of teeth are in each other at most; gums are the largest bodies."""
    deepest, points = 0.0, np.asarray(tongue.points, np.float64)
    for jaw in ("upper_teeth", "lower_teeth"):
        region = np.asarray(inside[jaw].connectivity("all").point_data["RegionId"])
        bodies = [np.asarray(inside[jaw].points, np.float64)[region == k] for k in range(15)]
        crowns = sorted(bodies, key=len)[:-1]
        deepest = max(deepest, depth_in(tongue, np.concatenate(crowns)))
        for crown in crowns:
            faces = ConvexHull(crown).equations
            deepest = max(deepest, -(points @ faces[:, :3].T + faces[:, 3]).max(axis=1).min())
    return deepest


def skin_near(face, frame, tongue):
    """Vertices of the skin beside a tongue, and the middles of its edges and triangles (k, 3)."""
    corners = face.state_of(frame).points[face.triangles]
    places = np.concatenate([*corners.transpose(1, 0, 2), corners.mean(axis=1)])
    places = np.concatenate([places, *(0.5 * (corners[:, k] + corners[:, k - 1]) for k in range(3))])
    margin = 0.2 * face.frame.pupil_distance  # there is skin in there at all times
    low, high = np.asarray(tongue.points).min(axis=0) - margin, np.asarray(tongue.points).max(axis=0) + margin
    return places[((places > low) & (places < high)).all(axis=1)]


def tip_before_incisors(face, frame, tongue):
    """How far the tip of a tongue is in front of the edges of the lower incisors, mm on a face of average size."""
    mouth, state = Appearance.of(face).mouth, face.state_of(frame)
    turn, shift = mouth.motion(state.points, state.jaw_angle)
    ahead = face.frame.axes[2]
    edge = turn @ mouth.teeth[1].edge + shift
    return ((np.asarray(tongue.points) - edge) @ ahead).max() / face.frame.scale


@pytest.mark.slow
@pytest.mark.parametrize("any_face", [None, "ict_face_narrow", "makehuman_head_male"], indirect=True)
def test_a_tongue_comes_out_over_the_lip_between_the_teeth(any_face):
    """Nothing passes through anything, on the whole way out and back; people reach 20 to 30 mm beyond their teeth
    without effort.
    """
    face, sim = any_face, fw.Simulation(any_face, layers=[])
    tips = {}
    for weight in (0.0, 0.6, 0.8, 0.9, 1.0):
        frame = settled(sim, {"AU19": weight})
        inside = Appearance.of(face).at(frame).mouth_parts
        tongue = inside["tongue"]
        tips[weight] = tip_before_incisors(face, frame, tongue)
        assert depth_in_teeth(tongue, inside) * face.unit < 0.3
        assert depth_in(tongue, skin_near(face, frame, tongue)) * face.unit < 0.5
    assert tips[0.0] < -5.0
    assert 15.0 < tips[1.0] < 25.0
    assert (np.diff(list(tips.values())) > -0.1).all()
    back = Appearance.of(face).at(settled(sim, {"AU19": 0.0})).mouth_parts["tongue"]
    np.testing.assert_array_equal(back.points, Appearance.of(face).mouth.inside(face.points, 0.0)["tongue"].points)


@pytest.mark.parametrize(
    "other",
    [
        "AU12",
        "AU18",
        "AU27",
        "AU28",
        *(pytest.param(unit, marks=pytest.mark.slow) for unit in ("AU16", "AU17", "AU24")),
    ],
)
def test_a_tongue_gives_way_to_lips_that_leave_it_no_room(face, other):
    frame = settled(fw.Simulation(face, layers=[]), {"AU19": 1.0, other: 1.0})
    inside = Appearance.of(face).at(frame).mouth_parts
    assert depth_in(inside["tongue"], skin_near(face, frame, inside["tongue"])) < 0.5
    assert depth_in_teeth(inside["tongue"], inside) < 0.3


def test_a_tongue_stays_behind_closed_teeth(face):
    still = settled(fw.Simulation(face, layers=[]), {"genioglossus": 1.0})
    np.testing.assert_allclose(still.points, face.points, atol=1e-9)
    inside = Appearance.of(face).at(still).mouth_parts
    assert tip_before_incisors(face, still, inside["tongue"]) < 0.0
    assert depth_in_teeth(inside["tongue"], inside) < 0.3
