"""Places where a surface runs through itself are told, and smoothed away where that is asked for."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from analysis.corpus import flaws, flaws_in_motion
from facewrinkle.errors import FaceWrinkleWarning
from facewrinkle.geometry.normals import vertex_normals
from facewrinkle.geometry.self_intersections import intersection_sites, self_intersections
from facewrinkle.mesh import prepare
from facewrinkle.mesh.repair.self_intersections import resolved, self_intersection_report
from facewrinkle.mesh.repair.topology_repair import RepairedMesh


def ball(resolution=80):
    sphere = pv.Sphere(radius=1.0, theta_resolution=resolution, phi_resolution=resolution)
    return np.asarray(sphere.points, dtype=np.float64), np.asarray(sphere.regular_faces, dtype=np.int64)


def hooked(points, normals, at, width, random):
    """Bumps on the skin, drawn out and bent over until they come through it beside themselves."""
    points = points.copy()
    for place, normal in zip(points[at], normals[at], strict=True):
        along = np.cross(normal, random.normal(size=3))
        along *= 4.0 * width / np.linalg.norm(along)
        near = np.exp(-((points - place) ** 2).sum(axis=1) / width**2)[:, None]
        points += near * 3.0 * width * normal + near**2 * (along - 5.0 * width * normal)
    return points


def hooked_ball(seed=3, count=3):
    points, triangles = ball()
    random = np.random.default_rng(seed)
    return hooked(points, points, random.choice(len(points), count, replace=False), 0.055, random), triangles


def test_a_smooth_surface_stays_as_it_is():
    points, triangles = ball()
    mesh = RepairedMesh.of(points, triangles)
    assert self_intersection_report(points, triangles) == ""
    assert resolved(mesh) is mesh


@pytest.mark.parametrize("seed", range(6))
def test_small_places_are_smoothed_and_nothing_else_is_touched(seed):
    points, triangles = hooked_ball(seed)
    crossing = intersection_sites(self_intersections(points, triangles), triangles)
    assert crossing
    mesh = resolved(RepairedMesh.of(points, triangles))
    assert not len(self_intersections(mesh.points, triangles))
    moved = (mesh.points != points).any(axis=1)
    near = np.linalg.norm(points[:, None] - points[np.unique(triangles[np.concatenate(crossing)])], axis=2).min(axis=1)
    assert moved.any()
    assert near[moved].max() < 0.25  # two or three edges beyond
    assert np.linalg.norm(mesh.points, axis=1).min() > 0.9  # the ball is still one
    assert f"{moved.sum()} points" in mesh.report[0]
    assert "that stay: 0" in mesh.report[0]


def test_large_places_stay():
    """Lips that press on each other are no fault."""
    points, triangles = ball()
    pressed = np.where(points[:, 2:] > 0.5, points * [1.0, 1.0, -1.6], points)  # the pole comes out below
    mesh = RepairedMesh.of(pressed, triangles)
    assert len(self_intersections(pressed, triangles)) > 20
    assert resolved(mesh) is mesh


def test_it_is_told_where():
    points, triangles = hooked_ball()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FaceWrinkleWarning)
        clean = prepare(pv.PolyData.from_regular_faces(points, triangles))
    places = intersection_sites(self_intersections(clean.points, clean.triangles), clean.triangles)
    where = clean.points[clean.triangles[places[0]]].mean(axis=(0, 1))
    assert clean.report[-1] == (
        f"The surface runs through itself at {len(places)} places, with {sum(map(len, places))} of {len(triangles)} "
        f"triangles; the largest, of {len(places[0])}, is about ({', '.join(f'{x:.4g}' for x in where)})."
    )
    assert self_intersection_report(*ball()) == ""


def test_a_face_that_runs_through_itself_is_fitted_wrinkled_and_cried_on(face):
    random, mesh = np.random.default_rng(11), face.mesh.copy()
    normals = vertex_normals(face.points, face.triangles)
    above = np.flatnonzero(face.points[:, 1] > face.landmarks["nose_tip"][1])  # not at the lips, which do cross
    mesh.points = before = hooked(face.points, normals, random.choice(above, 12, replace=False), 6.0, random)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FaceWrinkleWarning)
        tangled = fw.fit_face(mesh, face.landmarks)
        smooth = fw.fit_face(mesh, face.landmarks, resolve_self_intersections=True)
    counts = [len(np.unique(self_intersections(one.points, one.triangles))) for one in (face, tangled, smooth)]
    assert counts[1] > counts[0] + 50
    assert counts[2] <= counts[0]
    assert "runs through itself" in tangled.report[-1]
    assert any(sentence.startswith("Smoothed the surface") for sentence in smooth.report)
    np.testing.assert_array_equal(mesh.points, before)
    for one in (tangled, smooth):
        assert flaws(one) + flaws_in_motion(one) == []
        tear = fw.SheddingTear(one, start="l").surface(1.0)
        assert tear.n_cells > 100
        assert np.isfinite(tear.points).all()
