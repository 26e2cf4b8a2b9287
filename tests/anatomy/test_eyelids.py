"""Openings between lids, the margins of these, and lids that close, and follow the eye."""

import dataclasses

import numpy as np
import pytest
from eyelids_of_faces import filled, margins_of
from skins import held, settled
from synthetic_faces import BACK_EDGE, BALL, head_with, head_with_balls, ring

import facewrinkle as fw
from facewrinkle.anatomy.eyelid_opening import EYE_DEPTH, EYE_WIDTH, LINING_DEPTH, eyelid_opening, place_eyeballs
from facewrinkle.anatomy.eyelids import OVERLAP, lid_weights
from facewrinkle.layers.wave_folds.tissue import GAP, ROLLING, firmness
from facewrinkle.rigging.shapes import shapes_of
from tests.synthetic_faces import skin_with

# --- the opening, and the margins of the lids -------------------------------------------------------------------------


def assert_margins_keep_to_one_edge(face):
    """Between their ends they go from neighbor to neighbor, and turn little."""
    sides = {tuple(sorted(edge)) for t in face.triangles.tolist() for edge in zip(t, t[1:] + t[:1], strict=True)}
    for eye in face.eyes:
        for chain in margins_of(face, eye.side):
            place = along(face, eye.side, face.points[chain])
            middle = chain[(place > 0.22) & (place < 0.95)]
            steps = zip(middle[:-1].tolist(), middle[1:].tolist(), strict=True)
            assert len(middle) > 5
            assert {tuple(sorted(step)) for step in steps} <= sides
            ahead = np.diff(face.points[middle], axis=0)
            ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
            assert (ahead[1:] * ahead[:-1]).sum(axis=1).min() > np.cos(np.radians(40.0))


def along(face, side, points):
    """Places of points between the inner (0) and the outer canthus (1)."""
    inner, outer = (face.landmarks[f"eye_{side}_{end}"] for end in ("inner", "outer"))
    return (points - inner) @ (outer - inner) / ((outer - inner) @ (outer - inner))


@pytest.mark.parametrize("name", ["makehuman_head_male", "ict_face_narrow"])
def test_the_margins_of_thick_lids_keep_to_one_edge(real_face, name):
    assert_margins_keep_to_one_edge(real_face(name))


@pytest.mark.parametrize("lids", ["thick", "sockets"])
def test_the_margins_of_thick_lids_are_their_front_edges(lids):
    face, front = head_with(lids), ring(lids, 0)
    assert_margins_keep_to_one_edge(face)
    for side, opening in face.eyelid_openings.items():
        assert opening.thick
        for chain in (opening.upper, opening.lower):
            place = along(face, side, face.points[chain])
            assert set(chain[(place > 0.22) & (place < 0.95)]) <= set(front)
    assert set(face.eyelid_openings) == {"l", "r"}


def test_the_edge_of_lids_without_thickness_is_the_rim_of_the_hole(face):
    for side, opening in face.eyelid_openings.items():
        assert not opening.thick
        assert set(opening.upper) | set(opening.lower) == set(face.lid_rims[side])


@pytest.mark.parametrize("lids", ["thick", "sockets"])
def test_the_back_edges_of_thick_lids_lie_behind_the_front_ones(lids):
    face = head_with(lids)
    for side, opening in face.eyelid_openings.items():
        found = opening.back_edges(face.points, face.triangles)
        place = along(face, side, found)
        found = found[(place > 0.25) & (place < 0.75)]
        assert len(found) > 20
        front, back = (away_from(found, face.points[ring(lids, number)]) for number in (0, 1))
        assert back.max() < 0.4
        assert front.min() > 0.5 * BACK_EDGE[1]


def away_from(places, edges):
    """Distances of places from the polygons through the vertices of rings of both eyes, in their order."""
    loops = np.split(edges, 2)
    fine = [np.linspace(a, b, 20) for loop in loops for a, b in zip(loop, np.roll(loop, -1, axis=0), strict=True)]
    return np.linalg.norm(places[:, None] - np.concatenate(fine), axis=2).min(axis=1)


def test_skin_behind_thick_lids_is_deep():
    """At the front edges the depth is none; the lining of a socket is in the shadow of the lids, and a cheek is not."""
    face = head_with("sockets")
    nowhere = np.zeros(face.mesh.n_points, bool)
    for eye in face.eyes:
        opening = face.eyelid_openings[eye.side]
        place = np.abs(along(face, eye.side, face.points) - 0.5)
        rim, back = (one[place[one] < 0.25] for one in (ring("sockets", 0), ring("sockets", 1)))
        lining = ring("sockets", 3)
        lining = lining[place[lining] < 0.5 * EYE_WIDTH]
        inside = nowhere.copy()
        inside[lining] = True
        depth = opening.behind(face.points, inside)
        assert depth[rim].max() < 0.1
        assert np.median(depth[back]) > 0.15
        assert len(lining) > 10
        np.testing.assert_array_equal(depth[lining], LINING_DEPTH)
        assert depth[face.mesh.find_closest_point(face.landmarks[f"malar_{eye.side}"])] == 0.0


def test_a_high_side_of_the_nose_that_faces_the_eye_is_no_lining_of_its_socket():
    face = head_with("sockets")
    beside = np.linalg.norm(face.points - face.landmarks["sellion"], axis=1) < 10.0
    toward = np.where(beside[:, None], -face.normals, face.normals)
    for eye in face.eyes:
        opening = face.eyelid_openings[eye.side]
        assert (((face.points - eye.centre) * toward).sum(axis=1)[beside] < 0.0).sum() > 10
        lining = opening.lining(face.points, face.edges, toward)
        assert not lining[beside].any()
        inside = ring("sockets", 3)
        own = np.linalg.norm(face.points[inside] - eye.centre, axis=1) < EYE_DEPTH * eye.radius
        assert own.sum() > 10
        assert lining[inside[own]].all()


@pytest.mark.parametrize("rings", [((0.8, 3.0), (0.4, 5.0)), ((0.9, -1.0), (0.5, -3.0)), ((0.7, 6.5), (0.3, 7.5))])
def test_eyes_that_are_one_piece_with_the_skin_have_no_lids(face, rings):
    """Hollow ones such as statues have, and bulging ones: nothing opens, and nothing is drawn together to a spike."""
    with pytest.warns(fw.FaceWrinkleWarning, match="no opening in front of both eyes") as said:
        statue = fw.fit_face(fw.mesh.to_polydata(*filled(face, *rings)), face.landmarks, units="mm")
    assert len(said) == 1
    assert not statue.eyelid_openings
    assert set(statue.joint_weights) == {"jaw"}
    closing = [name for name in statue.muscles if name.startswith("orbicularis_oculi_") and len(name) == 19]
    assert len(closing) == 2
    moved = statue.points + held(fw.Skin(statue), dict.fromkeys(closing, 1.0), 20)
    edges, _ = fw.geometry.unique_edges(statue.triangles)
    near = np.zeros(len(statue.points), bool)
    for eye in statue.eyes:
        near |= np.linalg.norm(statue.points - eye.centre, axis=1) < 1.2 * eye.radius
    edges = edges[near[edges].all(axis=1)]
    before, after = (np.linalg.norm(p[edges[:, 0]] - p[edges[:, 1]], axis=1) for p in (statue.points, moved))
    np.testing.assert_array_less(np.abs(np.log(after / before)), np.log(1.25))


# --- lids that close, and follow the eye ------------------------------------------------------------------------------


def test_lids_follow_the_gaze_and_closing_takes_its_place(face):
    weights = face.joint_weights
    close, up, down = (weights[f"{m}_l"] for m in ("orbicularis_oculi", "rectus_superior", "rectus_inferior"))
    upper = close.angles > np.radians(20.0)
    lower = close.angles < np.radians(-3.0)
    angle = face.muscles["rectus_inferior_l"].angle
    assert 0.6 * angle < down.angles[upper].max() <= 0.9 * angle + 1e-12
    assert 0.1 * angle < down.angles[lower].max() < 0.5 * down.angles[upper].max()
    assert -0.5 * angle < up.angles[upper].min() < -0.25 * angle
    skin = fw.Skin(face, time_step=0.1)
    states = []
    for rates in ({"orbicularis_oculi_l": 1.0}, {"orbicularis_oculi_l": 1.0, "rectus_inferior_l": 1.0}):
        skin.reset()
        states.append(held(skin, rates, 100))  # lids that meet come to rest slowly
    np.testing.assert_allclose(*states, atol=1e-5)


def test_lids_before_a_socket_are_those_before_a_hole(face):
    points, triangles = filled(face, (1.6, 2.0), (1.8, 8.0), (0.9, 16.0))
    loops = fw.geometry.boundary_loops(triangles)
    eyes = place_eyeballs(face.landmarks, face.frame, points, triangles, loops)
    for eye, other in zip(face.eyes, eyes, strict=True):
        assert other.radius == pytest.approx(eye.radius, rel=0.03)
        first = lid_weights(face.eyelid_openings[eye.side], face.points, face.triangles)
        second = lid_weights(eyelid_opening(other, points, triangles, loops, face.landmarks), points, triangles)
        turns = np.zeros((2, len(points)))
        for angles, lids in zip(turns, (first, second), strict=True):
            angles[lids.close.vertices] = lids.close.angles
        margins = margins_of(face, eye.side)
        upper, lower = (chain[3:-3] for chain in margins)  # it is not seen where margins before a socket end
        turns[0, upper] -= OVERLAP  # which only skin that ends at the margin needs
        np.testing.assert_allclose(*turns[:, np.append(upper, lower)], atol=np.radians(2.0))


@pytest.mark.parametrize("stem", [None, "makehuman_head_male"])
def test_deep_sockets_have_lids(real_face, stem):
    """The eyes lie where the lids are, and closing lids meet."""
    face = head_with("sockets", "bag") if stem is None else real_face(stem)
    skin = fw.Skin(face, time_step=0.1)
    now = (skin.points + held(skin, {"orbicularis_oculi_l": 1.0, "orbicularis_oculi_r": 1.0}, 15)) / face.unit
    for eye in face.eyes:
        upper, lower = margins_of(face, eye.side)
        along = face.points[np.concatenate([upper, lower])] @ face.frame.axes[0]
        middle = np.quantile(along, [0.35, 0.65])
        heights = []
        for points in (face.points, now):
            chains = [points[chain][:, :3] @ face.frame.axes.T * face.unit for chain in (upper, lower)]
            place = np.linspace(*(middle * face.unit), 9)
            high, low = (np.interp(place, *chain[np.argsort(chain[:, 0])][:, :2].T) for chain in chains)
            heights.append(high - low)
        assert heights[0].min() > 4.0
        assert heights[1].max() < 1.0


def test_a_brow_that_is_near_stays_as_the_eye_closes(face):
    """As over the large eyes of drawn figures, where a share of the eye's own size would reach beyond the brow."""
    opening = face.eyelid_openings["l"]
    usual = lid_weights(opening, face.points, face.triangles).close
    brow = opening.brow.copy()
    brow[1] = opening.lines(brow[0])[0] + np.radians(8.0)
    near = lid_weights(dataclasses.replace(opening, brow=brow), face.points, face.triangles).close
    along, elevation, _ = opening.polar(face.points)
    above = elevation - opening.lines(along)[0]
    for weights, moves in ((usual, True), (near, False)):
        turns = np.zeros(len(face.points))
        turns[weights.vertices] = weights.angles
        at_brow = (above > np.radians(6.0)) & (above < np.radians(18.0)) & (np.abs(along - 0.5) < 0.4)
        assert at_brow.any()
        assert (turns[at_brow] > 0.02).any() == moves
        assert turns[opening.upper].max() == pytest.approx(usual.angles.max(), rel=1e-6)


# --- balls before a shallow lining ----------------------------------------------------------------


SHALLOW = pytest.mark.parametrize("lining", ["funnels", "shallow", "less shallow"])


@SHALLOW
def test_a_ball_that_is_seen_before_the_skin_lies_between_open_lids(face, lining):
    """Whatever lies behind it, the margins are the front edges; without the ball, there is none to see."""
    balls, front = head_with_balls(lining), ring(lining, 0)
    assert set(balls.eyelid_openings) == {"l", "r"}
    assert_margins_keep_to_one_edge(balls)
    for eye, own in zip(balls.eyes, face.eyes, strict=True):
        np.testing.assert_allclose(eye.centre, own.centre, atol=0.01)
        assert eye.radius == pytest.approx(BALL * own.radius, rel=0.01)
        for chain, whole in zip(margins_of(balls, eye.side), margins_of(face, eye.side), strict=True):
            here, there = (along(face, eye.side, face.points[each]) for each in (chain, whole))
            assert set(chain[(here > 0.22) & (here < 0.9)]) == set(whole[(there > 0.22) & (there < 0.9)]) <= set(front)
    assert len(shapes_of("arkit", balls)[0]) == 52


def test_a_lining_without_a_ball_before_it_is_the_eye_of_a_statue():
    assert not head_with("shallow").eyelid_openings


@SHALLOW
def test_lids_meet_before_a_shallow_lining(lining):
    """To a chink of .2 mm in the middle, and the lining stays in the ball."""
    face = head_with_balls(lining)
    now = face.points + settled(face, "AU45") @ face.frame.axes
    for eye in face.eyes:
        upper, lower = margins_of(face, eye.side)
        inner, outer = (face.landmarks[f"eye_{eye.side}_{end}"] for end in ("inner", "outer"))
        ahead = (outer - inner) / np.linalg.norm(outer - inner)
        up = np.cross(np.cross(ahead, eye.up), ahead)
        place = np.linspace(0.3, 0.7, 17)
        high, low = (np.interp(place, along(face, eye.side, now[c]), now[c] @ up) for c in (upper, lower))
        assert np.abs(high - low).max() < 0.2
        lining_of_it = np.linalg.norm(face.points - eye.centre, axis=1) < 0.9 * eye.radius
        assert lining_of_it.sum() > 60
        assert np.linalg.norm(now[lining_of_it] - eye.centre, axis=1).max() < 0.95 * eye.radius


# --- eyes before which the skin has no opening ----------------------------------------------------


@pytest.fixture(scope="module")
def shut(face):
    shut = fw.Face.from_landmarks(fw.mesh.to_polydata(*skin_with("shut")), face.landmarks, 1.0)
    assert {eye.side for eye in shut.eyes} - set(shut.eyelid_openings) == {"l", "r"}
    return shut


@pytest.fixture(scope="module")
def skin(shut):
    return fw.Skin(shut)


def test_there_is_nothing_to_shut(skin):
    skin.reset()
    assert not held(skin, {"orbicularis_oculi_l": 1.0, "orbicularis_oculi_r": 1.0}, 5).any()


def test_lids_stay_where_brow_and_cheek_move(shut, skin):
    skin.reset()
    way = np.linalg.norm(held(skin, shut.atlas.contractions({"AU2": 1.0, "AU6": 1.0, "AU12": 1.0}), 20), axis=1)
    brow = np.linalg.norm(shut.points - shut.landmarks["brow_l_mid"], axis=1).argmin()
    assert way[brow] > 5.0
    assert way[shut.shut_lids > 0.9].max() < 0.02 * way[brow]


def test_lines_end_where_the_lids_begin(face, shut):
    lid = np.flatnonzero(shut.shut_lids > 0.99)
    assert len(lid)
    soft = firmness(shut)
    assert (soft[lid] <= (1.0 - ROLLING) * 1.01).all()
    assert not face.shut_lids.any()
    forehead = np.linalg.norm(shut.points - shut.landmarks["forehead_mid"], axis=1).argmin()
    assert soft[forehead] > 0.8 * (1.0 - GAP)


def test_lids_that_were_scanned_shut_do_not_part(face):
    """Although a slit is between them."""
    asleep = fw.Face.from_landmarks(
        fw.mesh.to_polydata(face.points + settled(face, "AU45") @ face.frame.axes, face.triangles), face.landmarks, 1.0
    )
    assert not asleep.eyelid_openings
    assert set(asleep.lid_rims) == {"l", "r"}
    for what in ("AU5", "AU1+AU2"):
        moved = settled(asleep, what)
        for chain in margins_of(face, "l"):
            assert np.linalg.norm(moved[chain], axis=1).max() < 0.1
