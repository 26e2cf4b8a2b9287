"""Identities: parameters do what they say, faces stay whole, and expressions work on everybody."""

import dataclasses
from functools import cache

import cv2
import numpy as np
import pytest
from expressions import after
from small_meshes import area_vectors, smallest_angles

import facewrinkle as fw
from facewrinkle.anatomy.face import Face
from facewrinkle.anatomy.head import MIRROR, Head, load_head
from facewrinkle.anatomy.identity import CHILDS_FOLDS, TONES, YOUNG_FOLDS, Identity, childlike, fold_depth
from facewrinkle.anatomy.identity import head_of as made_head
from facewrinkle.anatomy.landmarks import frame_of
from facewrinkle.appearance.eye import IRIS, PaintedEye
from facewrinkle.errors import FaceWrinkleError, ParameterError
from facewrinkle.mesh import to_polydata
from tools.self_intersections import self_intersections

head_of = cache(made_head)
"""Most tests look at the same heads, and change none."""

NAMES = [field.name for field in dataclasses.fields(Identity)]
PAINTED = ("skin", "hair", "hair_density", "iris", "hair_length", "beard", "hair_combed")
"""What leaves the shape of the head as it is."""

SINGLES = [Identity(**{name: value}) for name in NAMES if name not in PAINTED for value in (-1.0, 1.0)]
CROWD = [Identity.random(seed, 0.7) for seed in range(6)]
EXTREMES = [Identity(*np.random.default_rng(seed).choice([-1.0, 1.0], len(NAMES)).tolist()) for seed in range(6)]
BABY = fw.Identity(width=0.4, length=-1.0, jaw=-1.0, chin=-1.0, nose_length=-1.0, brow=-1.0, cheeks=1.0, age=-1.0)


def gap(head: Head, first: str, second: str, axis: int) -> float:
    return float(abs(head.landmarks[first][axis] - head.landmarks[second][axis]))


def test_zero_is_the_stored_head() -> None:
    assert head_of(Identity()) is load_head()
    assert head_of(Identity.of(None)) is head_of(Identity.of({"jaw": 0.0}))
    nearly = head_of(Identity(jaw=1e-9))
    np.testing.assert_allclose(nearly.points, load_head().points, atol=1e-7)
    for name, place in nearly.landmarks.items():
        np.testing.assert_allclose(place, load_head().landmarks[name], atol=1e-5)


@pytest.mark.parametrize("value", [-1.0, 1.0])
def test_colors_and_hair_leave_the_shape_of_the_head(face: Face, value: float) -> None:
    """All of them at once."""
    painted = fw.default_face(Identity(**dict.fromkeys(PAINTED, value)))
    np.testing.assert_array_equal(painted.points, face.points)
    np.testing.assert_array_equal(painted.triangles, face.triangles)
    assert eye_of(painted, painted.points) == eye_of(face, face.points)


@pytest.mark.parametrize("identity", [*SINGLES, *CROWD], ids=str)
def test_heads_stay_whole_and_symmetric(identity: Identity) -> None:
    mean, head = load_head(), head_of(identity)
    assert (head.triangles == mean.triangles).all()
    assert (head.uv == mean.uv).all()
    # No triangle turns over, nor gets much more slender than it was.
    before, now = (area_vectors(each.points, each.triangles) for each in (mean, head))
    assert (before * now).sum(axis=1).min() > 0.0
    angles = smallest_angles(head.points, head.triangles)
    assert angles.min() > 7.0
    assert np.percentile(angles, 1) > 20.0
    table = set(map(tuple, (head.points + 0.0).round(9).tolist()))
    assert table == set(map(tuple, (head.points * MIRROR + 0.0).round(9).tolist()))


@pytest.mark.parametrize(
    "identity",
    [Identity(), *CROWD, *EXTREMES, *(pytest.param(single, marks=pytest.mark.slow) for single in SINGLES)],
    ids=str,
)
def test_no_head_crosses_itself(identity: Identity) -> None:
    assert len(self_intersections(head_of(identity).points, load_head().triangles)) == 0


@pytest.mark.parametrize("identity", [Identity(), *SINGLES, *CROWD], ids=str)
def test_lids_rest_on_the_eyeballs(identity: Identity) -> None:
    head = head_of(identity)
    for eye in head.eyes:
        away = np.linalg.norm(head.points - eye.centre, axis=1) - eye.radius
        assert away.min() > 0.0
        near = (away[head.triangles] < 8.0).any(axis=1)
        i, j = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9))
        weights = np.stack([i, j, 1 - i - j], axis=-1)[i + j <= 1.0]
        samples = np.einsum("wc,mci->mwi", weights, head.points[head.triangles[near]])
        assert np.linalg.norm(samples - eye.centre, axis=2).min() > eye.radius
        # The margins, where the lids end, keep to the ball as on the mean head.
        margin = np.linalg.norm(load_head().points - load_head().eyes[0].centre, axis=1) - eye.radius < 0.3
        assert margin.sum() > 20
        if eye.side == "l":
            assert away[margin].max() < 0.6


def eye_of(face: Face, points: np.ndarray) -> tuple[float, float, float]:
    """Of the left eye, upright through its middle: opening, white below the iris, iris under the upper lid, mm."""
    eye, opening = face.eyes[0], face.eyelid_openings["l"]
    upper, lower = (height_at(eye.centre[0], points[margin]) for margin in (opening.upper, opening.lower))
    painted = PaintedEye(eye, face)
    ahead = (painted.at(face.points).points - eye.centre) @ eye.gaze / eye.radius
    away = np.degrees(np.arccos(np.clip(ahead, -1.0, 1.0)))
    angles, first = np.unique(painted.angles, return_index=True)
    iris = eye.radius * np.sin(np.radians(np.interp(IRIS + 0.9, angles, away[first])))  # where it is half white
    return upper - lower, eye.centre[1] - iris - lower, eye.centre[1] + iris - upper


def height_at(x: float, margin: np.ndarray) -> float:
    order = np.argsort(margin[:, 0])
    return float(np.interp(x, margin[order, 0], margin[order, 1]))


@pytest.mark.parametrize("identity", [Identity(), *SINGLES, *CROWD], ids=str)
def test_eyes_at_rest_do_not_stare(identity: Identity) -> None:
    """No white below the iris, of which the upper lid covers a little; people's eyes open by some 9 to 10.5 mm."""
    head = head_of(identity)
    face = Face.from_landmarks(to_polydata(head.points, head.triangles), head.landmarks, 1.0)
    opening, white, covered = eye_of(face, face.points)
    assert white < 0.0
    assert 0.5 < covered < 3.0
    assert 9.0 < opening < 10.5


def test_no_basic_emotion_bares_the_white_below_the_iris(face: Face) -> None:
    rest, openings = eye_of(face, face.points)[0], {}
    for name in ("happiness", "sadness", "anger", "disgust", "surprise", "fear"):
        frame = after(fw.Simulation(face, refinement=fw.Refinement(max_level=0)), name, 20)
        openings[name], white, _ = eye_of(face, np.asarray(frame.points)[: face.mesh.n_points])
        assert white < 0.0, name
    assert max(openings[name] for name in ("happiness", "anger", "disgust")) < rest - 1.0
    assert openings["surprise"] > rest + 1.0


@pytest.mark.parametrize(
    "name, first, second, axis",
    [
        ("width", "zygion_l", "zygion_r", 0),
        ("length", "sellion", "menton", 1),
        ("jaw", "gonion_l", "gonion_r", 0),
        ("chin", "pogonion", "subnasale", 2),
        ("nose_length", "nose_tip", "sellion", 2),
        ("nose_width", "ala_l", "ala_r", 0),
        ("brow", "brow_l_mid", "eye_l_outer", 2),
        ("eye_spacing", "eye_l_inner", "eye_r_inner", 0),
        ("lips", "upper_lip_mid", "lower_lip_mid", 1),
        ("cheeks", "malar_l", "eye_l_centre", 2),
        ("nose_bridge", "sellion", "menton", 2),
        ("nose_tip", "nose_tip", "sellion", 1),
        ("cheekbones", "zygion_l", "zygion_r", 0),
        ("philtrum", "subnasale", "upper_lip_mid", 1),
        ("eye_slant", "eye_l_outer", "subnasale", 1),
        ("brow_arch", "brow_l_mid", "brow_l_inner", 1),
        ("mouth_corners", "mouth_l", "menton", 1),
        ("nose_wings", "ala_l", "sellion", 1),
    ],
)
def test_parameters_do_what_they_say(name: str, first: str, second: str, axis: int) -> None:
    less, more = (gap(head_of(Identity(**{name: value})), first, second, axis) for value in (-1.0, 1.0))
    if name == "chin":  # it lies behind the base of the nose
        less, more = -less, -more
    middle = gap(load_head(), first, second, axis) * (-1.0 if name == "chin" else 1.0)
    assert less < middle - 0.4
    assert middle + 0.4 < more


def test_tips_of_noses_upper_lips_and_ears_grow() -> None:
    places = load_head().points
    tip = (places[:, 2] > 124.0) & (places[:, 1] > -4.0) & (places[:, 1] < 8.0)
    ear = (places[:, 0] > 74.5) & (places[:, 2] > -22.0) & (places[:, 2] < 16.0) & (places[:, 1] > -10.0)
    for name, where in (("nose_bulb", tip), ("ears", ear)):
        sizes = [np.ptp(head_of(Identity(**{name: value})).points[where], axis=0) for value in (-1.0, 0.0, 1.0)]
        assert np.diff(sizes, axis=0)[:, :2].min() > 0.3, name
    shares = []
    for value in (-1.0, 0.0, 1.0):
        head = head_of(Identity(upper_lip=value))
        shares.append(gap(head, "upper_lip_mid", "mouth_l", 1) / gap(head, "upper_lip_mid", "lower_lip_mid", 1))
    assert np.diff(shares).min() > 0.05


def test_age_draws_the_face_down_and_sex_makes_the_head_larger() -> None:
    young, old = (head_of(Identity(age=value)).landmarks for value in (-1.0, 1.0))
    assert all(old[name][1] < young[name][1] - 2.0 for name in ("brow_l_outer", "brow_l_mid", "nose_tip"))
    her, him = (head_of(Identity(sex=value)) for value in (-1.0, 1.0))
    assert (np.ptp(him.points, axis=0) > 1.02 * np.ptp(her.points, axis=0)).all()


def brightness(head: Head, hair: bool) -> float:
    """Mean of the colors on the crown, or of cheeks, forehead and chin."""
    names = ("malar_l", "malar_r", "forehead_mid", "pogonion")
    mean = load_head()
    places = np.array([[0.0, 90.0, -60.0], [25.0, 85.0, -60.0]]) if hair else [mean.landmarks[n] for n in names]
    near = [np.linalg.norm(mean.points - place, axis=1).argmin() for place in places]
    return float(head.color[near].mean())


def test_skin_and_hair_get_darker_and_hair_turns_gray() -> None:
    for hair, name in ((False, "skin"), (True, "hair")):
        fair, middle, dark = (brightness(head_of(Identity(**{name: v})), hair) for v in (-1.0, 0.0, 1.0))
        assert dark < 0.75 * middle
        assert middle * 1.05 < fair
        other = brightness(load_head(), not hair)
        assert brightness(head_of(Identity(**{name: 1.0})), not hair) == pytest.approx(other, rel=0.02)
    old, young = (head_of(Identity(age=value)) for value in (1.0, 0.0))
    assert brightness(old, True) > 2.0 * brightness(young, True)
    assert brightness(old, False) == pytest.approx(brightness(young, False), rel=0.02)


def test_tones_of_skin_run_evenly_from_very_light_to_dark() -> None:
    """By the angle of Chardon et al. (1991): very light above 55 degrees, dark below -30."""
    mean = load_head()
    forehead = np.linalg.norm(mean.points - mean.landmarks["forehead_mid"], axis=1) < 15.0
    people = [Identity(skin=float(skin)) for skin in TONES[:, 0]]
    assert [person.monk for person in people] == list(range(1, 11))
    colors = np.float32([[head_of(person).color[forehead].mean(axis=0) / 255.0 for person in people]])
    lightness, redness, yellowness = cv2.cvtColor(colors, cv2.COLOR_RGB2LAB)[0].T
    angle = np.degrees(np.arctan2(lightness - 50.0, yellowness))
    assert angle[0] > 55.0
    assert angle[-1] < -30.0
    assert (np.diff(angle) < 0.0).all()
    for steps in (np.diff(lightness[:5]), np.diff(lightness[4:])):  # fairer and darker than the mean head
        assert steps.max() < 0.0
        np.testing.assert_allclose(steps, steps.mean(), rtol=0.12)
    assert redness.min() > 7.0  # blood shows through all of them
    assert (np.degrees(np.arctan2(redness, yellowness)) < 45.0).all()


def test_brows_are_darker_than_any_skin() -> None:
    for skin in np.linspace(-1.0, 1.0, 9):
        person = head_of(Identity(skin=skin).plausible())
        assert person.brows.color.mean() < 0.8 * brightness(person, False)


@pytest.mark.parametrize(
    "identity",
    [
        Identity(age=1.0, sex=1.0),
        Identity(width=-1.0, sex=-1.0, lips=1.0),
        pytest.param(CROWD[3], marks=pytest.mark.slow),
    ],
)
def test_expressions_work_on_everybody(identity: Identity) -> None:
    face = fw.default_face(identity)
    n = face.mesh.n_points
    simulation = fw.Simulation(face, refinement=fw.Refinement(max_level=0))
    simulation.express("AU43")
    for _ in range(40):
        frame = simulation.step()
    opening = [np.ptp(points[near_margin(face)][:, 1]) for points in (face.points, np.asarray(frame.points)[:n])]
    assert opening[1] < 0.55 * opening[0]
    simulation.express("happiness")
    for _ in range(40):
        frame = simulation.step()
    moved = np.asarray(frame.points)[:n] - face.points
    corner = np.linalg.norm(face.points - face.landmarks["mouth_l"], axis=1).argmin()
    assert moved[corner, 1] > 4.0
    assert np.ptp(np.asarray(frame["W"])) > 0.3
    assert np.abs(moved[face.points[:, 2] < -40.0]).max() < 1.0


def near_margin(face: Face) -> np.ndarray:
    """Vertices in the middle of the margins of the left eye's lids."""
    eye = next(eye for eye in face.eyes if eye.side == "l")
    away = np.linalg.norm(face.points - eye.centre, axis=1) - eye.radius
    return (away < 0.045 * eye.radius) & (np.abs(face.points[:, 0] - eye.centre[0]) < 4.0)


def test_anatomy_follows_the_face(face: Face) -> None:
    wide, mean = fw.default_face({"width": 1.0, "eye_spacing": 1.0}), face
    assert wide.eyes[0].centre[0] > mean.eyes[0].centre[0] + 3.0
    assert wide.muscles["corrugator_l"].insertion[0] > mean.muscles["corrugator_l"].insertion[0] + 1.0
    assert np.abs(wide.skull.points).max(axis=0)[0] > np.abs(mean.skull.points).max(axis=0)[0] + 3.0
    for who in (wide, mean):
        skin = who.mesh
        for name, place in who.landmarks.items():
            if not name.endswith("centre"):
                closest = skin.find_closest_cell(place, return_closest_point=True)[1]
                assert np.linalg.norm(closest - place) < 1e-3


def test_random_identities_are_reproducible_and_within_their_spread() -> None:
    assert Identity.random(3, 0.4) == Identity.random(3, 0.4)
    values = np.array([dataclasses.astuple(Identity.random(seed, 0.4)) for seed in range(20)])
    assert np.abs(values).max() <= 0.4
    often = [field.name != "child" for field in dataclasses.fields(Identity)]
    assert values[:, often].std(axis=0).min() > 0.1


BAD = [({"jaw": value}, "jaw must") for value in (1.01, -2.0, np.nan, "wide", None)]
BAD += [({"nose_widht": 0.1}, "nose_width"), (0.5, "dictionary")]


@pytest.mark.parametrize(("identity", "message"), BAD)
def test_what_is_no_identity_is_refused(identity: object, message: str) -> None:
    with pytest.raises(FaceWrinkleError, match=message):
        fw.default_face(identity)  # type: ignore[arg-type]


@pytest.mark.parametrize("seed, spread", [("a", 0.9), (-1, 0.9), (1.5, 0.9), (1, 2.0)])
def test_seeds_are_whole_numbers_and_spreads_shares(seed, spread):
    with pytest.raises(ParameterError, match="seed must|spread"):
        Identity.random(seed, spread)


# --- children ---------------------------------------------------------------------------------------


def test_adults_of_all_proportions_are_no_children(face):
    assert childlike(face.landmarks, face.frame) == 0.0
    for identity in filter(lambda someone: someone.child == 0.0, map(Identity.random, range(1, 9))):
        marks = head_of(identity).landmarks
        assert childlike(marks, frame_of(marks)) < 0.1
    marks = head_of(BABY).landmarks
    assert childlike(marks, frame_of(marks)) > 0.7


def test_a_child_s_folds_are_faint(face):
    """At the corners of smiling eyes, and beside the nose, where full cheeks roll softly."""
    baby, heights = fw.default_face(BABY), {}
    assert baby.fold_depth < 1.2 * CHILDS_FOLDS * YOUNG_FOLDS + 0.1
    assert fold_depth(face.landmarks, face.frame, -0.5) == pytest.approx(0.5 * (1.0 + YOUNG_FOLDS))
    for name, who in (("adult", face), ("baby", baby)):
        frame = after(fw.Simulation(who), "happiness", 12)
        points, w = np.asarray(frame.point_data["rest"]), np.abs(frame["W"])
        marks, size = who.landmarks, who.frame.pupil_distance
        crows = np.linalg.norm(points - marks["eye_l_outer"] - 0.2 * size * who.frame.axes[0], axis=1) < 0.12 * size
        beside = np.linalg.norm(points - 0.5 * (marks["ala_l"] + marks["mouth_l"]), axis=1) < 0.25 * size
        heights[name] = w[crows].max(), w[beside].max()
    crows_feet, smile = np.divide(heights["baby"], heights["adult"])
    assert 0.0 < crows_feet < 0.5
    assert 0.1 < smile < 0.4


# --- people -----------------------------------------------------------------------------------------

SURVEY = {
    # mean and deviation, mm: men, women
    "interpupillary distance": ((64.5, 3.6), (61.9, 3.5)),
    "nose breadth": ((36.6, 4.1), (33.2, 3.9)),
    "lip length": ((51.1, 4.2), (48.0, 4.0)),
    "menton-sellion length": ((122.7, 7.0), (113.4, 6.1)),
    "bizygomatic breadth": ((143.5, 6.9), (135.1, 6.5)),
    "bigonial breadth": ((120.4, 10.4), (110.1, 8.9)),
    "nose protrusion": ((21.1, 2.7), (19.8, 2.7)),
}
"""Zhuang and Bradtmiller, "Head-and-face anthropometric survey of U.S. respirator users", Journal of Occupational and
Environmental Hygiene 2, 2005: 2,543 men and 1,454 women.
"""

BETWEEN = {
    "interpupillary distance": ("eye_l_centre", "eye_r_centre"),
    "lip length": ("mouth_l", "mouth_r"),
    "menton-sellion length": ("sellion", "menton"),
    "bizygomatic breadth": ("zygion_l", "zygion_r"),
    "bigonial breadth": ("gonion_l", "gonion_r"),
    "nose protrusion": ("nose_tip", "subnasale"),
}


def measured(identity: Identity) -> dict[str, float]:
    head, mean = head_of(identity), head_of(Identity()).points
    out = {k: float(np.linalg.norm(head.landmarks[a] - head.landmarks[b])) for k, (a, b) in BETWEEN.items()}
    wings = (mean[:, 2] > 104.0) & (mean[:, 1] < 8.0) & (mean[:, 1] > -13.0) & (np.abs(mean[:, 0]) < 19.5)
    return {**out, "nose breadth": float(np.ptp(head.points[wings, 0]))}


def test_women_and_men_differ_as_people_do() -> None:
    woman, man = measured(Identity(sex=-1.0)), measured(Identity(sex=1.0))
    for name, (men, women) in SURVEY.items():
        assert 0.4 < (man[name] - woman[name]) / (men[0] - women[0]) < 2.5, name


@pytest.mark.slow
def test_random_women_and_men_differ_and_spread_as_people_do() -> None:
    """Together, means within a deviation of the survey's, and 98 in 100 within its percentiles."""
    adults = [someone for someone in map(Identity.random, range(300)) if someone.child == 0.0]
    women, men = ([measured(someone) for someone in adults if sign * someone.sex > 0.0] for sign in (-1.0, 1.0))
    assert 0.4 < len(women) / len(adults) < 0.6
    for name, survey in SURVEY.items():
        (his_mean, his_deviation), (her_mean, her_deviation) = survey
        his, hers = (np.array([person[name] for person in group]) for group in (men, women))
        assert 0.7 < (his.mean() - hers.mean()) / (his_mean - her_mean) < 1.3, name
        for values, (_, deviation) in zip((his, hers), survey, strict=True):
            assert 0.5 < values.std() / deviation < 1.2, name
        everybody, apart = np.concatenate([his, hers]), his_mean - her_mean
        deviation = np.sqrt(0.5 * (his_deviation**2 + her_deviation**2) + 0.25 * apart**2)
        assert abs(everybody.mean() - 0.5 * (his_mean + her_mean)) < deviation, name
        assert 0.4 < everybody.std() / deviation < 1.6, name
        low, high = her_mean - 2.33 * her_deviation, his_mean + 2.33 * his_deviation
        assert ((everybody > low) & (everybody < high)).mean() > 0.98, name


def test_women_have_higher_brows_fuller_lips_and_thinner_necks_for_their_faces() -> None:
    shares = []
    for sex in (-0.7, 0.7):
        head = head_of(Identity(sex=sex))
        neck = np.ptp(head.points[np.abs(load_head().points[:, 1] + 92.0) < 6.0, 0])
        height, width = gap(head, "sellion", "menton", 1), gap(head, "zygion_l", "zygion_r", 0)
        brow, lips = gap(head, "brow_l_mid", "eye_l_centre", 1), gap(head, "upper_lip_mid", "lower_lip_mid", 1)
        shares.append(np.array([brow / height, lips / height, width / neck]))
    her, him = shares
    assert (her > [1.1, 1.1, 1.02] * him).all()


def test_children_look_young_and_no_hair_or_iris_is_fairer_than_the_skin() -> None:
    people = [Identity.random(seed) for seed in range(300)]
    children = [someone for someone in people if someone.child > 0.0]
    assert 0.05 < len(children) / len(people) < 0.2
    assert all(child.age <= -child.child for child in children)
    assert all(min(someone.hair, someone.iris) >= someone.skin for someone in people)
    mean, child = (fw.default_face(Identity(child=value)) for value in (0.0, 1.0))
    assert childlike(child.landmarks, child.frame) > 0.6 > 0.0 == childlike(mean.landmarks, mean.frame)


def test_plausible_people_are_no_turnips_buttons_or_mushrooms() -> None:
    for someone in map(Identity.random, range(300)):
        assert someone.width - someone.length <= 1.0 + 1e-12
        assert someone.nose_width - someone.nose_length <= 1.0 + 1e-12
        assert abs(someone.sex) <= 1.0 - someone.child
        assert someone.plausible() == someone
    block = Identity(width=0.9, length=-0.5, nose_width=0.2).plausible()
    assert (block.width, block.length, block.nose_width) == pytest.approx((0.7, -0.3, 0.2))


def test_a_child_s_neck_is_thin_for_its_head() -> None:
    shares, height = [], load_head().points[:, 1]
    for child in (0.0, 1.0):
        head = head_of(Identity(child=child))
        mesh, x = to_polydata(head.points, head.triangles), head.points[:, 0]
        neck = np.ptp(mesh.contour([-92.0], scalars=height).points[:, 0])
        shares.append(neck / np.ptp(x[height > load_head().landmarks["brow_l_mid"][1]]))
    assert shares[1] < 0.85 * shares[0]


def test_hair_of_old_men_recedes_and_that_of_old_women_does_not() -> None:
    shares = {sex: head_of(Identity(age=1.0, sex=sex)).paint[1] for sex in (-0.8, 0.8)}
    mean = load_head().paint[1]
    for sex, paint in shares.items():
        bare = dataclasses.replace(paint, density=-1.0)
        grown = (paint.colors() != bare.colors()).any(axis=2)
        assert (grown[mean.share == 255]).mean() > 0.9
        assert (grown[(mean.share > 40) & (mean.share < 150)].mean() < 0.05) == (sex > 0.0)


def test_beards_are_men_s() -> None:
    people = [Identity.random(seed) for seed in range(300)]
    bearded = [someone for someone in people if someone.beard > 0.0]
    men = [someone for someone in people if someone.sex > 0.0 and someone.child == 0.0]
    assert 0.3 < len(bearded) / len(men) < 0.7
    assert all(someone.sex >= someone.beard and someone.child == 0.0 for someone in bearded)


def test_irises_go_from_blue_to_brown() -> None:
    blue, brown = (PaintedEye(face.eyes[0], face) for face in (fw.default_face({"iris": i}) for i in (-1.0, 1.0)))
    around = (blue.angles > 14.0) & (blue.angles < 22.0)
    assert blue.tints[around, 2].mean() > blue.tints[around, 0].mean() + 15.0
    assert brown.tints[around, 0].mean() > brown.tints[around, 2].mean() + 20.0
    assert brown.tints[around].mean() < 0.6 * blue.tints[around].mean()
