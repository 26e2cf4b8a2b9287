"""Openings between lids, and the margins of these."""

from __future__ import annotations

import numpy as np
import pytest
from eyelids_of_faces import filled, margins_of
from synthetic_faces import BACK_EDGE, head_with, ring

import facewrinkle as fw
from facewrinkle.anatomy.eyelid_opening import EYE_WIDTH, LINING_DEPTH
from facewrinkle.geometry.topology import unique_edges
from facewrinkle.mesh import to_polydata


def assert_margins_keep_to_one_edge(face):
    """Between their ends they go from neighbour to neighbour, and turn little."""
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


@pytest.mark.parametrize("rings", [((0.8, 3.0), (0.4, 5.0)), ((0.9, -1.0), (0.5, -3.0)), ((0.7, 6.5), (0.3, 7.5))])
def test_eyes_that_are_one_piece_with_the_skin_have_no_lids(face, rings):
    """Hollow ones such as statues have, and bulging ones: nothing opens, and nothing is drawn together to a spike."""
    with pytest.warns(fw.FaceWrinkleWarning, match="no opening before both eyes") as said:
        statue = fw.fit_face(to_polydata(*filled(face, *rings)), face.landmarks, units="mm")
    assert len(said) == 1
    assert not statue.eyelid_openings
    assert set(statue.joint_weights) == {"jaw"}
    skin = fw.Skin(statue)
    closing = [name for name in statue.muscles if name.startswith("orbicularis_oculi_") and len(name) == 19]
    assert len(closing) == 2
    skin.contract(dict.fromkeys(closing, 1.0))
    for _ in range(20):
        skin.step()
    edges, _ = unique_edges(statue.triangles)
    near = np.zeros(len(statue.points), bool)
    for eye in statue.eyes:
        near |= np.linalg.norm(statue.points - eye.centre, axis=1) < 1.2 * eye.radius
    edges = edges[near[edges].all(axis=1)]
    moved = statue.points + skin.displacement
    before, after = (np.linalg.norm(p[edges[:, 0]] - p[edges[:, 1]], axis=1) for p in (statue.points, moved))
    assert (after / before).min() > 0.8
    assert (after / before).max() < 1.25
