"""The skin against itself: what the lips meet, their flesh, and the pressure with which a muscle closes them.

what                                   checked against
partners along a line                  where the line meets the planes of all triangles; dense samples beside it
forces                                 their sum and moment: they move nothing as a whole; towards each other
pairs of vertices and triangles        each lies behind the other at rest, by dot products
a lining drawn through the skin        it is pushed back, towards where it was
lips that are rolled in                the oracle: not in each other
violent mixtures on the built-in head  the oracle: lips in each other, triangles turned over
a mouth that is half sewn              the vertices of its rim: they stay together
"""

import numpy as np
import pytest
from skins import held, settled
from synthetic_faces import half_sewn

import facewrinkle as fw
from facewrinkle.anatomy.face import Face
from facewrinkle.appearance.mouth import Mouth
from facewrinkle.mesh import to_polydata
from facewrinkle.motion._contact_kernels import gaps_of
from facewrinkle.motion.self_contact import CLOSE_BY, THINNEST, around_mouth, behind_lips, closing_forces, squeezed
from facewrinkle.motion.solids import met_solids
from tools.trials.oracle import DEEPEST, Oracle
from tools.trials.sequences import sequence


def reached(triangles, place, direction):
    """The triangle that is the nearest on a line through a place or beside it, the place there, and how far beside."""
    flat = squeezed(triangles.reshape(-1, 3), direction)
    return fw.geometry.closest(flat, np.arange(len(flat)).reshape(-1, 3), squeezed(place[None], direction)[0])


def hits(triangles, place, direction):
    """Where a line meets triangles: their numbers, and how far along it."""
    found = {}
    for number, (a, b, c) in enumerate(triangles):
        weights = np.linalg.solve(np.array([b - a, c - a, -direction]).T, place - a)
        if min(weights[0], weights[1], 1.0 - weights[0] - weights[1]) >= 0.0:
            found[number] = abs(weights[2])
    return found


def test_the_nearest_triangle_on_a_line_is_found_among_large_and_small_ones():
    rng = np.random.default_rng(11)
    small = rng.uniform(-1.0, 1.0, (60, 1, 3)) + rng.uniform(-0.05, 0.05, (60, 3, 3))
    triangles = 3.0 * np.concatenate([rng.uniform(-1.0, 1.0, (12, 3, 3)), small])
    reaching = 0
    for place in rng.uniform(-3.0, 3.0, (80, 3)):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        number, weights, beside = reached(triangles, place, direction)
        foot = weights @ triangles[number] - place
        assert weights.sum() == pytest.approx(1.0)
        found = hits(triangles, place, direction)
        if found:
            reaching += 1
            assert beside < CLOSE_BY
            assert number == min(found, key=found.get)
            np.testing.assert_allclose(foot, (foot @ direction) * direction, atol=1e-4)
    assert 20 < reaching < 75


def test_the_nearest_triangle_beside_a_line_is_that_of_densely_sampled_sides():
    rng = np.random.default_rng(4)
    triangles, share = rng.normal(size=(4, 3, 3)), np.linspace(0.0, 1.0, 2001)[:, None]
    for place in rng.normal([8.0, 0.0, 0.0], size=(30, 3)):
        number, _, beside = reached(triangles, place, np.array([0.0, 1.0, 0.0]))
        sides = [np.concatenate([t[k] + share * (t[k - 1] - t[k]) for k in range(3)]) for t in triangles]
        away = [np.linalg.norm((side - place)[:, [0, 2]], axis=1).min() for side in sides]
        assert number == np.argmin(away)
        assert beside == pytest.approx(min(away), abs=1e-3)


def test_nothing_is_reached_where_there_is_nothing():
    assert reached(np.empty((0, 3, 3)), np.zeros(3), np.array([0.0, 1.0, 0.0]))[2] == np.inf


@pytest.mark.parametrize("any_face", [None, "ict_face_narrow", "makehuman_head_male"], indirect=True)
def test_lips_are_pressed_on_each_other_along_the_height(any_face):
    up, points = any_face.frame.axes[1], any_face.points_mm
    forces = closing_forces(any_face, np.ones(len(points)))
    along = forces @ up
    np.testing.assert_allclose(forces, along[:, None] * up, atol=1e-9)
    assert (along < -0.5).sum() > 20
    assert (along > 0.5).sum() > 20
    assert not along[~around_mouth(any_face)].any()
    middle = 0.5 * (any_face.landmarks["upper_lip_mid"] + any_face.landmarks["lower_lip_mid"]) @ up * any_face.unit
    assert (points[along < -0.5] @ up).mean() > middle > (points[along > 0.5] @ up).mean() - 2.0


def test_the_pressure_of_the_lips_on_each_other_moves_nothing_as_a_whole(face):
    area = np.random.default_rng(0).uniform(0.5, 2.0, len(face.points))
    forces = closing_forces(face, area)
    size = np.abs(forces).sum()
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-9)
    assert np.abs(np.cross(face.points, forces).sum(axis=0)).max() < CLOSE_BY * size
    # Twice the area, twice the force.
    np.testing.assert_allclose(closing_forces(face, 2.0 * area), 2.0 * forces, rtol=1e-12)


# --- the flesh of the lips -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def skin(face):
    return fw.Skin(face)


def test_vertices_lie_behind_the_skin_that_they_are_kept_behind(face):
    flesh = behind_lips(face, np.ones(len(face.points)))
    a, b, c = (face.points[flesh.partners[:, k]] for k in range(3))
    inwards = np.cross(b - a, c - a)
    place = face.points[flesh.corners[:, 0]]
    height = ((place - a) * inwards).sum(axis=1) / np.linalg.norm(inwards, axis=1)
    assert (height > flesh.allowed).all()
    assert (flesh.allowed <= THINNEST * height + 1e-12).all()
    share = np.linalg.norm(place - (a + b + c) / 3.0, axis=1)
    assert (height > 0.49 * share).all(), "straight through the flesh"


def test_vertices_of_the_red_have_a_partner_straight_across(face):
    flesh = behind_lips(face, np.ones(len(face.points)))
    vertices, count = np.unique(flesh.corners[:, 0], return_counts=True)
    assert count.max() == 2
    assert (count == 2).mean() > 0.5
    height = gaps_of(face.points, flesh, met_solids(face, np.ones(len(face.points)))[0])
    for vertex in vertices[count == 2]:
        first, second = np.flatnonzero(flesh.corners[:, 0] == vertex)
        middles = face.points[flesh.partners[[first, second]]].mean(axis=1)
        far = np.linalg.norm(middles - face.points[vertex], axis=1)
        assert far[0] <= far[1] + 1e-9
        assert flesh.allowed[second] <= 0.1 * height[second] + 1e-12


def test_lips_that_are_rolled_in_stay_out_of_each_other(face, skin):
    skin.reset()
    moved = skin.points + held(skin, face.atlas.contractions("AU28", 1.0), 40)
    found = Oracle(face).findings(moved)
    assert np.linalg.norm(moved - face.points, axis=1).max() > 5.0
    assert found.lips < 0.01
    assert not found.inverted


def test_lining_in_front_of_the_skin_is_pushed_back(face, skin):
    contacts, samples, u = skin.contacts, skin.contacts.samples, np.zeros_like(face.points)
    flesh = contacts.kinds == "flesh"
    lining = np.unique(samples.corners[flesh & face.lining.vertices[samples.corners[:, 0]], 0])
    assert len(lining) > 20
    u[lining] += 12.0 * face.frame.axes[2]
    centres = [[eye.centre] for eye in face.eyes]
    gaps = gaps_of(np.concatenate([face.points + u, *centres]), samples, contacts.solids)
    deep = flesh & (gaps < samples.allowed)
    assert deep.sum() > 20
    a, b, c = (face.points[samples.partners[deep, k]] for k in range(3))
    out = -np.cross(b - a, c - a) @ face.frame.axes[2]
    gradient = np.zeros_like(u)
    assert contacts.energy(u, gradient) > 0.0
    pushed = samples.corners[deep, 0][out > 0.0]
    assert np.median(gradient[pushed] @ face.frame.axes[2]) > 0.0, "the force points backwards"


@pytest.mark.parametrize(("index", "frames"), [(2, 32), pytest.param(5, 34, marks=pytest.mark.slow)])
def test_mixtures_turn_no_lip_inside_out(face, skin, index, frames):
    """All muscles about the mouth at once, in jumps: lips came .6 mm through each other, and triangles turned over."""
    oracle = Oracle(face)
    skin.reset()
    for rates in sequence(face, 0, "head-0", index).rates[:frames]:
        skin.set_rates(rates)
        found = oracle.findings(skin.step())
        assert found.lips < DEEPEST
        assert not found.inverted
    skin.reset()


def test_a_mouth_with_a_strand_of_skin_across_stays_closed(face):
    """As scanners leave them between closed lips: it would hold both."""
    loop = Mouth(face).loop
    left = (face.points[loop] - face.frame.origin) @ face.frame.axes[0] > 0.5
    crossing = np.flatnonzero(left != np.roll(left, -1))  # once on each lip
    (a, b), (c, d) = (loop[[k, (k + 1) % len(loop)]] for k in crossing)
    strand = np.array([[b, a, d], [b, d, c]], np.int32)
    torn = Face.from_landmarks(to_polydata(face.points, np.vstack([face.triangles, strand])), face.landmarks, 1.0)
    assert len(torn.boundary_loops) == len(face.boundary_loops) + 1
    assert (torn.mouth_opens, torn.mouth_half_open) == (False, True)


def test_a_mouth_that_is_open_on_one_side_only_stays_closed(face):
    """As the other side would hold: the jaw stays, and what draws a lip down takes the other one along."""
    torn, upper, lower = half_sewn()
    assert (face.mouth_opens, face.mouth_half_open) == (True, False)
    assert (torn.mouth_opens, torn.mouth_half_open) == (False, True)
    apart = np.linalg.norm(face.points[upper] - face.points[lower], axis=1)
    for what in ("AU26", "AU16"):
        opened = []
        for mouth in (face, torn):
            now = mouth.points + settled(mouth, what) @ mouth.frame.axes
            opened.append((np.linalg.norm(now[upper] - now[lower], axis=1) - apart).max())
        assert opened[0] > 2.0
        assert opened[1] < 0.1
