"""Cropped hair: where it grows, how long, and what becomes of it in a person."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.anatomy.identity import hair_cover


def hairs_of(face):
    """Points of the hairs of a face at rest."""
    return face.bound_hair["cropped_hair"].polylines(face.points, face.triangles, face.normals)


def reach(hairs):
    return np.linalg.norm(hairs[:, -1] - hairs[:, 0], axis=1)


def test_it_grows_inside_the_hairline_alone(face):
    roots = hairs_of(face)[:, 0]
    inside = hair_cover(roots, face.landmarks, face.frame)
    assert len(roots) > 4000
    assert inside.min() > -8.0
    assert (inside > 0.0).mean() > 0.97


def test_its_tips_stand_off_the_skin(face):
    tips = hairs_of(face)[:, -1]
    away = np.asarray(pv.PolyData(tips).compute_implicit_distance(face.mesh).point_data["implicit_distance"])
    assert (away > 0.3).mean() > 0.97
    assert away.max() < 10.0


def test_it_points_away_from_the_crown(face):
    """Forward over the forehead, down at the nape."""
    hairs = hairs_of(face)
    roots, way = hairs[:, 0], hairs[:, -1] - hairs[:, 0]
    front, nape = roots[:, 2] > 60.0, roots[:, 1] < 20.0
    assert way[front, 2].mean() > 2.0
    assert way[nape, 1].mean() < -1.0


def test_it_is_shorter_where_it_is_thin(face):
    """Along its border."""
    hairs = hairs_of(face)
    inside = hair_cover(hairs[:, 0], face.landmarks, face.frame)
    assert np.median(reach(hairs[inside < 6.0])) < 0.7 * np.median(reach(hairs[inside > 20.0]))


def test_people_have_their_own_length_color_and_hairline(face):
    others = {"hair_length": -1.0}, {"hair": -1.0}, {"age": 1.0, "sex": 1.0}, {"sex": -1.0}
    short, fair, old, woman = map(fw.default_face, others)
    assert np.median(reach(hairs_of(short))) == pytest.approx(7.0 / 16.0 * np.median(reach(hairs_of(face))), rel=0.02)
    assert np.median(reach(hairs_of(woman))) > 1.8 * np.median(reach(hairs_of(face)))
    colors = [head.bound_hair["cropped_hair"].color.mean() for head in (fair, face)]
    assert colors[0] > 1.5 * colors[1]
    assert hairs_of(old)[:, 0, 2].max() < hairs_of(face)[:, 0, 2].max() - 3.0
    assert fw.default_face({"hair_density": -1.0}).bound_hair.keys() == {"brows"}
    assert fw.default_face({"hair_length": 0.5}).bound_hair.keys() == {"brows"}
