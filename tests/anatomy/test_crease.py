"""Creases: folds along a curve.

coordinates        a straight and a bowed path in closed form; distances to a finely sampled parabola
amplitude          a furrow and a broad crest on one side; their volume; both borders and both ends
direction          the gradient of q by differences
on faces           where the skin of captured faces creases; beside the corner of a mouth, wherever it moves
"""

import numpy as np
import pytest
from expressions import after
from real_faces import FACES
from scipy.integrate import trapezoid
from scipy.spatial import cKDTree

import facewrinkle as fw

STYLE = fw.Wrinkles(depth=2.0, alpha=1.3)
BOWED = [(0.0, 40.0, 0.0), (6.0, 18.0, 0.0), (0.0, 0.0, 0.0)]


def bowed(**changes):
    return fw.Crease(BOWED, (1, 0, 0), 12.0, wrinkles=STYLE).replaced(**changes)


def curve(n=20001):
    """The parabola through the three points, as a function of y: x = h y (40 - y)."""
    y = np.linspace(0.0, 40.0, n)
    return np.stack([6.0 / (18.0 * 22.0) * y * (40.0 - y), y, 0.0 * y], axis=1)


def test_the_furrow_runs_through_the_three_points():
    along, across = bowed().coordinates(BOWED)
    np.testing.assert_allclose(along, [0.0, 0.55, 1.0], atol=1e-15)
    np.testing.assert_allclose(across, 0.0, atol=1e-15)
    x = np.linspace(-3.0, 9.0, 24_001)
    for foot in curve(7)[1:-1]:
        tangent = np.array([6.0 / (18.0 * 22.0) * (40.0 - 2.0 * foot[1]), 1.0, 0.0])
        across = np.cross(tangent / np.linalg.norm(tangent), (0.0, 0.0, 1.0))
        assert x[np.argmin(bowed().height(foot + x[:, None] * across))] == pytest.approx(0.0, abs=1e-3)


def test_q_is_the_distance_from_the_furrow():
    """To the third order of the distance from a parabola this flat; exactly so from a straight furrow."""
    rng = np.random.default_rng(0)
    feet = curve()[4000:16000:400]
    tangent = np.gradient(curve(), axis=0)[4000:16000:400]
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1) / np.linalg.norm(tangent, axis=1)[:, None]
    away = rng.uniform(-2.0, 2.0, len(feet))
    points = feet + np.c_[np.sign(normal[:, :1]) * normal * away[:, None], 0.0 * away]
    distance = cKDTree(curve()).query(points)[0] * np.sign(away)
    np.testing.assert_allclose(12.0 * bowed().coordinates(points)[1], distance, atol=0.02)
    straight = fw.Crease([(0, 40, 0), (0, 13, 0), (0, 0, 0)], (1, 0, 0), 12.0)
    x = rng.uniform(-20.0, 20.0, (50, 3))
    np.testing.assert_allclose(12.0 * straight.coordinates(x)[1], x[:, 0], atol=1e-13)


STRAIGHT = fw.Crease([(0, 40, 0), (0, 13, 0), (0, 0, 0)], (1, 0, 0), 12.0, wrinkles=STYLE)
ACROSS = np.linspace(-8.0, 14.0, 220_001)
SECTION = np.c_[ACROSS, np.full_like(ACROSS, 20.0), 0.0 * ACROSS]


@pytest.mark.parametrize("worn", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("alpha", [0.0, 1.0, 1.3, 3.0])
def test_a_crest_beside_a_furrow_without_net_volume(alpha, worn):
    crease, x = STRAIGHT.replaced(alpha=alpha, worn=worn), ACROSS
    height = crease.unit_amplitude(SECTION)
    inside = crease.wrinkling_region(SECTION)
    near = 3.0 * (1.0 - 0.3 * worn)
    assert x[inside][[0, -1]] == pytest.approx([-4.5, 3.0 * near], abs=1e-3)
    assert x[np.argmin(height)] == pytest.approx(0.0, abs=1e-3)
    assert x[np.argmax(height)] == pytest.approx(near, abs=1e-3)
    assert np.ptp(height) == pytest.approx(2.0**alpha, rel=1e-4)  # from bulge to furrow, as in all wrinkles
    assert (height[x < 0.0] <= 0.0).all()  # no crest on the other side
    assert abs(trapezoid(height, x)) < 1e-6 * trapezoid(np.abs(height), x)
    assert abs(height[inside][[0, -1]]).max() < 1e-3
    slope = np.gradient(height, x)
    outer, rising = slope[(x > near) & (x < 2.97 * near)], slope[(x > 0.0) & (x < near)]
    assert np.abs(outer).max() < 0.5 * rising.max()  # it declines to the cheek, more gently than to the furrow


@pytest.mark.parametrize("alpha", [0.6, 1.3])
def test_the_flesh_of_the_old_hangs_over(alpha):
    """Of the same depth a step is steeper, and bends more sharply, the older it is; beyond the line it stays gentle."""
    step, steps, rises, bends = 2500, [], [], []  # 0.25 mm
    for worn in (0.0, 0.5, 1.0):
        height = STRAIGHT.replaced(alpha=alpha, worn=worn).height(SECTION)[::step]
        slope = np.diff(height) / (step * (ACROSS[1] - ACROSS[0]))
        steps.append(slope.max())
        rises.append(-slope.min())
        bends.append(np.abs(np.diff(slope)).max())
    assert (np.diff(steps) > 0.0).all()
    assert steps[0] < 0.8 * steps[-1]
    assert (np.diff(bends) > 0.0).all()
    assert bends[0] < 0.8 * bends[-1]
    assert (np.diff(rises) < 0.0).all()
    assert (np.array(rises) < 0.8 * np.array(steps)).all()


def test_blunt_heights_are_means():
    crease, blunt, s = STRAIGHT.replaced(worn=1.0), 0.5, np.linspace(-2.0, 2.0, 400_001)
    near, far = 0.25 * 0.7 * 12.0, 0.375 * 12.0
    width = round(blunt / (s[1] - s[0]))
    sharp, inner = (1.0 - np.clip(np.abs(s), 0.0, 1.0)) ** (1.0 + 1.3), s[width:-width]
    total = np.concatenate([[0.0], np.cumsum(0.5 * (sharp[1:] + sharp[:-1]))])
    mean = (total[2 * width :] - total[: -2 * width]) / (2 * width)
    furrow = np.interp((1.0 + blunt) * ACROSS / np.where(ACROSS > 0.0, near, far), inner, mean / mean.max(), 0.0, 0.0)
    height = crease.height(SECTION, blunt)
    crest, t = height + furrow * -height.min(), ACROSS / (3.0 * near)
    np.testing.assert_allclose(
        crest, crest.max() * np.where((t > 0) & (t < 1), 6.75 * t * (1 - t) ** 2, 0.0), atol=1e-4
    )
    assert np.ptp(height) == pytest.approx(2.0**1.3, rel=1e-4)
    assert abs(trapezoid(height, ACROSS)) < 1e-4 * trapezoid(np.abs(height), ACROSS)


def test_it_takes_up_the_skin_at_its_furrow():
    cover = bowed().cover(curve(9))
    np.testing.assert_array_equal(cover, bowed().envelope(curve(9)))
    x = np.array([-1.8, -0.6, 0.0, 0.6, 5.4])
    cover = STRAIGHT.cover(np.c_[x, np.full(5, 20.0), np.zeros(5)])
    assert cover[[0, 2, 4]].tolist() == [0.0, 1.0, 0.0]
    assert 0.0 < cover[1] < cover[3] < 1.0


def test_taper_and_span_act_along_the_furrow():
    places = curve(41)
    share = bowed(taper=(0.5, 1.0)).envelope(places)
    at = places[::-1, 1] / 40.0
    expected = np.minimum(np.clip((1.0 - places[:, 1] / 40.0) / 0.25, 0, 1), np.clip(at[::-1] / 0.5, 0, 1))
    expected = expected**2 * (3.0 - 2.0 * expected)
    np.testing.assert_allclose(share, expected, atol=1e-12)
    worn = bowed(taper=(0.5, 1.0), worn=0.6).envelope(places)  # flesh hangs most where the taper is short
    np.testing.assert_allclose(worn, (1.0 - 0.21 * bowed().coordinates(places)[0]) * expected, atol=1e-12)
    part = bowed(span=(0.5, 1.0))
    assert part.wrinkling_region(places).tolist() == (places[:, 1] <= 20.0).tolist()
    whole = bowed().unit_amplitude(places)
    np.testing.assert_array_equal(part.unit_amplitude(places), np.where(places[:, 1] <= 20.0, whole, 0.0))


def test_points_at_coordinates():
    crease, rng = bowed(), np.random.default_rng(3)
    along, across = rng.uniform(0.0, 1.0, 50), rng.uniform(-0.375, 0.75, 50)
    np.testing.assert_allclose(crease.coordinates(crease.points_at(along, across)), (along, across), atol=1e-12)


def test_the_direction_is_the_gradient_of_q():
    crease = bowed()
    x = np.random.default_rng(1).uniform((-10, -5, -9), (20, 45, 9), (500, 3))
    h = 1e-6
    gradient = [crease.coordinates(x + h * e)[1] - crease.coordinates(x - h * e)[1] for e in np.eye(3)]
    gradient = np.stack(gradient, axis=1)
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    np.testing.assert_allclose(crease.fold_direction(x), gradient, atol=1e-6)


def test_fibers_that_slide_do_not_pull_the_loose_skin():
    crease = fw.Crease([(-20, 10, 0), (0, 10, 0), (20, 10, 0)], (0, 1, 0), 8.0)
    plain = fw.LinearMuscle((0, 30, 0), (0, 8, 0), 0.5, 30.0, folds=crease)
    y = np.linspace(0.0, 29.0, 200)
    x = np.c_[0.0 * y, y, 0.0 * y]
    for sliding in (0.4, 1.0):
        share = np.linalg.norm(plain.replaced(sliding=sliding).force(x), axis=1) / np.linalg.norm(
            plain.force(x), axis=1
        )
        s = np.clip((y - 8.2) / 2.4, 0.0, 1.0)  # from 1.8 below the furrow at 10 to 0.6 above it
        np.testing.assert_allclose(share, 1.0 - sliding * s**2 * (3.0 - 2.0 * s), atol=1e-12)
    np.testing.assert_array_equal(plain.replaced(folds=None, sliding=1.0).force(x), plain.force(x))


# --- the nasolabial fold on faces ------------------------------------------------------------------


on_faces = pytest.mark.parametrize(
    "any_face",
    [None, *(pytest.param(stem, marks=pytest.mark.slow) for stem in ("ict_face_narrow", "makehuman_head_male"))],
    indirect=True,
)


@on_faces
@pytest.mark.parametrize("what", ["AU12", "AU10", "happiness"])
def test_the_nasolabial_fold_ends_beside_the_moved_corner(any_face, what):
    """Its deepest line starts beside the wing, goes outwards and down, and stays outside of the corner all the way."""
    frame = after(fw.Simulation(any_face), what, 20)
    axes, unit = any_face.frame.axes, any_face.unit
    w, moved = np.asarray(frame["W"]), np.asarray(frame.points) @ axes.T * unit
    rest = np.asarray(frame["rest"])
    crease = any_face.muscles["zygomaticus_major_l"].fold_pattern
    lam, q = crease.coordinates(rest)
    outside = np.asarray(frame["Normals"]) @ axes[2] > 0.2  # not the lining of the mouth
    furrow = outside & crease.wrinkling_region(rest) & (np.abs(q * crease.width) < 0.04 * crease.width) & (w < -0.1)
    assert furrow.sum() > 8
    line = np.array([moved[furrow & (np.abs(lam - l) < 0.1)].mean(axis=0) for l in (0.3, 0.5, 0.7)])
    assert (np.diff(line[:, 1]) < 0.0).all()  # down
    assert line[2, 0] - line[0, 0] > 0.2 * (line[0, 1] - line[2, 1])  # and outwards: oblique, not upright
    assert line[2, 0] > line[:, 0].max() - 1.5  # it does not turn back
    corner = moved[np.linalg.norm(any_face.points - any_face.landmarks["mouth_l"], axis=1).argmin()]
    low = furrow & (moved[:, 1] < corner[1] + 6.0)
    assert low.any() or what == "AU10"
    assert (moved[low, 0] > corner[0] + 3.0).all()  # never over the corner
    assert moved[furrow, 1].min() > corner[1] - 12.0  # nor around it
    near = crease.wrinkling_region(rest) & (np.abs(q) < 0.25)  # beyond are other lines
    across = [w[near & (np.abs(lam - l) < 0.08)] for l in (0.0, 0.5, 1.0)]
    assert np.ptp(across[1]) > 1.5 * max(np.ptp(across[0]), np.ptp(across[2]))  # it fades at both ends


@on_faces
def test_the_fold_below_the_corner_leaves_the_lips_alone(any_face):
    """Lips that are lifted by the crest of a fold beside them run into each other."""
    pattern = any_face.muscles["depressor_anguli_oris_l"].fold_pattern
    names = "mouth_l", "lower_lip_mid", "upper_lip_mid"
    between = [0.5 * (any_face.landmarks["mouth_l"] + any_face.landmarks[name]) for name in names]
    assert not pattern.envelope(np.array(between)).any()
    assert pattern.envelope(any_face.points).max() > 0.9


@pytest.mark.skipif(not (FACES / "ict_face_expressions.npz").exists(), reason="the captured face is not there")
@pytest.mark.parametrize("shape", ["mouthSmile", "mouthUpperUp", "noseSneer"])
def test_the_nasolabial_fold_lies_where_captured_skin_creases(real_face, shape):
    """Where the mean curvature of the captured surface falls most, that is a hollow, is the same line in all shapes."""
    import pyvista as pv

    face = real_face("ict_face_narrow")
    with np.load(FACES / "ict_face_expressions.npz") as content:
        shapes = dict(zip(content["names"].tolist(), content["deltas"], strict=True))
    scale = np.linalg.norm(shapes["jawOpen"], axis=1).max() * 10.0  # mm: the shapes are in cm
    assert 20.0 < scale < 80.0
    moved = face.points_mm + 10.0 * shapes[f"{shape}_L"]
    surfaces = [pv.PolyData.from_regular_faces(p, face.triangles) for p in (face.points_mm, moved)]
    hollow = -np.subtract(*(np.asarray(s.curvature("mean")) for s in surfaces[::-1]))
    crease = face.muscles["zygomaticus_major_l"].fold_pattern
    lam, q = crease.coordinates(face.points)
    q = q * crease.width * face.unit
    near = (np.abs(q) < 8.0) & (face.tissue.normals @ face.frame.axes[2] > 0.0)
    places = []
    for l in np.arange(0.25, 0.7, 0.05):
        here = np.flatnonzero(near & (np.abs(lam - l) < 0.05))
        deepest = here[np.argsort(-hollow[here])[:3]]
        places.append(np.average(q[deepest], weights=np.maximum(hollow[deepest], 1e-9)))
    assert np.abs(np.median(places)) < 1.5
    assert np.mean(np.abs(places)) < 2.5
