"""Color by place, symmetric and the same on a moved face; furrows lose light, and gathered skin reddens."""

import numpy as np
import pytest
import pyvista as pv
from drawing import held
from scipy.spatial.transform import Rotation
from synthetic_faces import head_with, ring

from facewrinkle.anatomy.cropped_hair import beard
from facewrinkle.anatomy.identity import hair_cover
from facewrinkle.anatomy.landmarks import frame_of, lips_middle
from facewrinkle.appearance.flush import ABSORBANCE, flush
from facewrinkle.appearance.skin_paint import (
    DEEP_FLESH,
    FLESH,
    LID,
    SkinPainter,
    cavity_shading,
    complexion,
    flesh,
    lips,
)
from facewrinkle.plotting import Style, picture

MIRROR = np.array([-1.0, 1.0, 1.0])


def test_hair_grows_above_the_hairline_and_nowhere_else(face):
    marks, frame = face.landmarks, face.frame
    skin = ["nose_tip", "glabella", "forehead_mid", "malar_l", "malar_r", "menton", "gonion_l", "brow_l_outer"]
    assert hair_cover(np.array([marks[name] for name in skin]), marks, frame).max() < 0.0
    crown = frame.origin + np.array([[0.0, 90.0, -70.0], [60.0, 60.0, -90.0], [0.0, 0.0, -170.0]])
    assert hair_cover(crown, marks, frame).min() > 20.0
    nape = frame.origin + np.array([[0.0, -95.0, -150.0], [50.0, -100.0, -110.0]])
    assert hair_cover(nape, marks, frame).max() < 0.0
    assert abs(hair_cover(marks["trichion"][None], marks, frame)[0]) < 1.0


def test_both_sides_have_the_same_color(face):
    places = pv.Icosphere(radius=90.0, center=face.frame.origin - [0.0, 0.0, 75.0], nsub=5).points
    for function in (complexion, hair_cover, lips):
        left, right = (function(p, face.landmarks, face.frame) for p in (places, places * MIRROR))
        np.testing.assert_allclose(left, right, atol=1e-6)


def test_colors_go_with_the_face(face):
    """Turned, scaled and moved, the same places have the same colors."""
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    moved = {name: 0.1 * turn @ point + [3.0, -2.0, 5.0] for name, point in face.landmarks.items()}
    places = np.asarray(face.mesh.points)
    there = 0.1 * places @ turn.T + [3.0, -2.0, 5.0]
    for function in (complexion, hair_cover, lips):
        np.testing.assert_allclose(
            function(there, moved, frame_of(moved)), function(places, face.landmarks, face.frame), atol=1e-6
        )


def test_cheeks_and_ears_are_red_and_the_jaw_is_gray(face):
    marks = face.landmarks
    places = np.array([marks[name] for name in ("forehead_mid", "malar_l", "nose_tip", "pogonion")])
    color, grown = complexion(places, marks, face.frame), beard(face.frame.local_mm(places), marks, face.frame)
    red = color[:, 0] / color[:, 1]
    assert red[1:3].min() > red[0]
    assert np.ptp(color[3]) < np.ptp(color[1])
    assert grown[:3].max() == 0.0 < 0.9 < grown[3]


def test_lips_are_where_their_landmarks_are(face):
    marks = face.landmarks
    middle = lips_middle(marks)
    cover = lips(np.array([middle, marks["nose_tip"], marks["pogonion"], marks["gonion_l"]]), marks, face.frame)
    assert cover[0] > 0.9
    assert cover[1:].max() == 0.0


def test_flesh_darkens_from_the_margins_to_the_ball():
    colors = flesh(np.linspace(0.0, 1.0, 11))
    np.testing.assert_allclose(colors[[0, 4, 10]], [LID, FLESH, DEEP_FLESH])
    assert (np.diff(colors.sum(axis=1)) < 0.0).all()


def test_thick_lids_are_flesh_behind_their_front_edges(face):
    """Before them the skin is as on lids without thickness; the lining of a socket is in their shadow."""
    head = head_with("sockets")
    painted, bare = SkinPainter(head)(head.points).astype(float), SkinPainter(face)(head.points).astype(float)
    for eye in face.eyes:
        inner, outer = (face.landmarks[f"eye_{eye.side}_{end}"] for end in ("inner", "outer"))
        place = (head.points - inner) @ (outer - inner) / ((outer - inner) @ (outer - inner))
        front, back, lining = (
            one[np.abs(place[one] - 0.5) < reach]
            for one, reach in ((ring("sockets", 0), 0.2), (ring("sockets", 1), 0.2), (ring("sockets", 4), 0.6))
        )
        assert min(map(len, (front, back, lining))) > 5
        assert np.quantile(np.abs(painted[front] - bare[front]).max(axis=1), 0.8) < 10.0  # some face the ball
        assert np.abs(painted[back] - bare[back]).max(axis=1).min() > 5.0
        np.testing.assert_allclose(painted[lining], np.tile(flesh(np.array([0.7])), (len(lining), 1)), atol=12.0)
    for name in ("malar_l", "glabella", "nose_tip", "pogonion"):
        vertex = head.mesh.find_closest_point(face.landmarks[name])
        np.testing.assert_array_equal(painted[vertex], bare[vertex])


# --- the shading of furrows -----------------------------------------------------------------------


def shaded_plane(depth_at, step):
    """Largest loss of light, 0 to 1, on a turned plane with a depth, as far apart as refinement places its vertices."""
    x, y = np.meshgrid(np.arange(-8.0, 8.01, step), np.arange(-8.0, 8.01, step))
    turn = Rotation.from_rotvec([0.4, 0.7, -0.2]).as_matrix()
    plane = pv.StructuredGrid(x, y, 0.0 * x).extract_surface(algorithm=None).triangulate()
    plane.point_data["rest"] = plane.points @ turn.T
    plane.point_data["W"] = -depth_at(*plane.points[:, :2].T)
    shade = cavity_shading(plane)
    assert shade.shape == (plane.n_points, 3)
    assert (shade[:, 0] >= shade[:, 1]).all()
    assert (shade[plane["W"] > -1e-3] == 255).all()
    return 1.0 - shade[:, 1].min() / 255.0


@pytest.mark.parametrize(("width", "depth"), [(2.0, 1.0), (4.0, 1.0), (6.0, 1.5), (8.0, 0.5)])
def test_furrows_lose_the_light_that_their_walls_take(width, depth):
    """At the floor of a groove of width w and depth d the share 1 - w / sqrt(w^2 + 4 d^2) of the sky is lost."""
    lost = shaded_plane(lambda x, _: depth * np.exp(-((2.0 * x / width) ** 2)), width / 5.0)
    assert lost == pytest.approx(1.0 - width / np.hypot(width, 2.0 * depth), rel=0.25)


def test_dimples_are_not_dark():
    furrow, pit, far = (
        shaded_plane(lambda x, y, away=away: np.exp(-((away(x, y) / 2.0) ** 2)), 0.8)
        for away in (lambda x, y: x, np.hypot, lambda x, y: np.hypot(x, y + 100.0))
    )
    assert pit < 0.25 * furrow
    assert far == 0.0


# --- blood -----------------------------------------------------------------------------------------


def redness(face, points, name):
    """Red relative to green at a landmark, 1 at rest."""
    red, green, _ = flush(face, points)[face.mesh.find_closest_point(face.landmarks[name])]
    return red / green


@pytest.mark.parametrize("area", [0.8, 1.05])
def test_blood_absorbs_by_the_law_of_beer_and_lambert(face, area):
    """All skin alike: nothing spreads, and far from the lids the closed form holds."""
    factors = flush(face, np.sqrt(area) * face.points)
    expected = np.exp(-(1.0 / area - 1.0) * ABSORBANCE)
    far = face.mesh.find_closest_point(face.landmarks["menton"])
    np.testing.assert_allclose(factors[far], expected / max(expected.max(), 1.0), rtol=2e-3)


def test_skin_at_rest_has_its_own_color_and_no_color_is_brighter(face):
    np.testing.assert_array_equal(flush(face, face.points), 1.0)
    assert flush(face, np.asarray(held("happiness").points)[: len(face.points)]).max() <= 1.0


def test_laughter_reddens_the_cheeks_and_surprise_the_forehead_while_the_chin_pales(face):
    laughing, surprised, shut = (
        np.asarray(held(name).points)[: len(face.points)] for name in ("happiness", "surprise", "AU45")
    )
    assert redness(face, laughing, "malar_l") > 1.03
    assert redness(face, laughing, "pogonion") < 0.995
    assert redness(face, surprised, "forehead_mid") > 1.02
    lid = face.eyelid_openings["l"].upper
    assert np.abs(flush(face, shut)[lid] - 1.0).max() < 0.05  # it unrolls


def test_pictures_show_blood_and_clay_does_not(face):
    for clay in (False, True):
        style = Style((200, 240), "left_three_quarter", clay=clay)
        cheek = [
            picture(frame, face, style)[130:150, 90:120].mean(axis=(0, 1)) for frame in (held("happiness"), face.mesh)
        ]
        laughing, resting = (red / green for red, green, _ in cheek)
        assert (laughing > 1.01 * resting) != clay
