"""Surfaces in pieces become one: balls whose triangles were pulled apart, and landmarks of another mesh."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.errors import FaceWrinkleWarning, MeshError, MissingPackageError, ParameterError
from facewrinkle.geometry import topology
from facewrinkle.layers.patterns_on_skin.region import selection_weights
from facewrinkle.mesh import prepare
from facewrinkle.mesh.repair import prepare as repair
from facewrinkle.mesh.repair.prepare import closed_up, reconstructed
from facewrinkle.mesh.repair.topology_repair import RepairedMesh


def ball(resolution=16):
    sphere = pv.Sphere(radius=1.0, theta_resolution=resolution, phi_resolution=resolution)
    return np.asarray(sphere.points, dtype=np.float64), np.asarray(sphere.regular_faces, dtype=np.int64)


def soup(points, triangles, gap):
    """Triangles that hang together nowhere, each smaller by a share."""
    corners = points[triangles]
    middle = corners.mean(axis=1, keepdims=True)
    return (middle + (1.0 - gap) * (corners - middle)).reshape(-1, 3), np.arange(triangles.size).reshape(-1, 3)


def test_small_gaps_are_closed():
    points, triangles = ball()
    mesh = closed_up(RepairedMesh.of(*soup(points, triangles, 0.002)))
    label = topology.sheets(mesh.triangles)
    assert np.bincount(label).max() > 0.95 * len(triangles)
    assert len(np.unique(mesh.triangles)) <= 1.02 * len(points)


@pytest.mark.slow
def test_a_soup_is_reconstructed():
    pytest.importorskip("pymeshlab")
    points, triangles = ball(24)
    random = np.random.default_rng(3)
    turned = triangles.copy()
    half = random.random(len(turned)) < 0.5
    turned[half] = turned[half][:, ::-1]
    mesh = reconstructed(RepairedMesh.of(*soup(points, turned, 0.2)), "A soup")
    label = topology.sheets(mesh.triangles)
    assert np.bincount(label).max() > 0.99 * len(label)
    used = np.unique(mesh.triangles)
    assert np.abs(np.linalg.norm(mesh.points[used], axis=1) - 1.0).max() < 0.05
    assert "reconstructed with pymeshlab" in mesh.report[-1]
    # Data come from the corner that is near.
    source = soup(points, turned, 0.2)[0]
    assert np.linalg.norm(source[mesh.origin[used]] - mesh.points[used], axis=1).max() < 0.3


def test_a_soup_needs_pymeshlab(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    points, triangles = ball()
    source = pv.PolyData.from_regular_faces(*soup(points, triangles, 0.3))
    with pytest.raises(MissingPackageError, match=r"in 8 pieces.*\.\[remesh\]"):
        prepare(source, near=points[::30][:8])


def test_landmarks_of_another_mesh_are_reported():
    pytest.importorskip("pymeshlab")
    parts = [pv.Sphere(radius=0.5, center=(3.0 * k, 0, 0), theta_resolution=8, phi_resolution=8) for k in range(5)]
    source = parts[0].append_polydata(*parts[1:])
    near = np.array([[3.0 * k, 0.0, 0.5] for k in range(5)])
    with pytest.raises(MeshError, match="in 5 pieces; when it is reconstructed.*landmarks are those of this mesh"):
        prepare(source, near=near)


def test_a_face_in_pieces_with_small_gaps_is_closed_and_not_reconstructed():
    points, triangles = ball()
    source = pv.PolyData.from_regular_faces(*soup(points, triangles, 0.002))
    with pytest.warns(FaceWrinkleWarning) as told:
        clean = prepare(source, near=points[::30][:8])
    assert "close to each other" in "".join(str(one.message) for one in told)
    assert "reconstructed" not in "".join(clean.report)
    assert clean.mesh.n_cells > 0.95 * len(triangles)
    assert np.isin(clean.mesh.points, source.points).all()  # nothing was moved


@pytest.mark.slow
def test_a_face_in_pieces_that_face_inward_is_reconstructed(monkeypatch):
    pytest.importorskip("pymeshlab")
    monkeypatch.setattr(repair, "SAMPLES", 6_000)  # many take long
    points, triangles = ball()
    source = pv.PolyData.from_regular_faces(*soup(points, triangles[:, ::-1], 0.2))
    source.point_data["height"] = source.points[:, 2].astype(float)
    with pytest.warns(FaceWrinkleWarning) as told:
        clean = prepare(source, near=points[::30][:8])
    assert any("in 8 pieces; it was reconstructed" in str(one.message) for one in told)
    assert not any("inward" in str(one.message) for one in told)
    assert topology.sheets(clean.triangles).max() == 0
    assert topology.is_oriented(clean.triangles)
    a, b, c = (clean.points[clean.triangles[:, corner]] for corner in range(3))
    assert ((np.cross(b - a, c - a) * a).sum(axis=1) > 0.0).mean() > 0.99
    away = np.linalg.norm(clean.points, axis=1)
    assert np.abs(away - 1.0).max() < 0.1
    assert (clean.source_points == -1).all()  # none of them is a point of the source
    rebuilt = fw.Face.without_anatomy(clean.mesh, 1.0, clean.source_points)
    with pytest.raises(MeshError, match="was reconstructed: it has other vertices than the one that was given"):
        selection_weights(np.arange(3), rebuilt, border=0.5)
    recording = fw.Recorded.of_positions(np.asarray(source.points)[None], fps=1)
    with pytest.raises(ParameterError, match="was not made on this face"):
        recording.points_of(rebuilt)
    np.testing.assert_allclose(clean.mesh.point_data["height"], clean.points[:, 2], atol=0.3)


def test_a_strip_with_one_side_is_a_fault():
    """Of Moebius; landmarks all around it."""
    turn = 2.0 * np.pi * np.arange(24) / 24
    along = np.stack([np.cos(turn), np.sin(turn), np.zeros(24)], axis=1)
    across = np.stack(
        [np.cos(0.5 * turn) * np.cos(turn), np.cos(0.5 * turn) * np.sin(turn), np.sin(0.5 * turn)], axis=1
    )
    points = np.concatenate([along - 0.3 * across, along + 0.3 * across])
    here, after = np.arange(24), (np.arange(24) + 1) % 24
    a, b, c, d = here, after, 24 + after, 24 + here
    b, c = np.where(after == 0, c, b), np.where(after == 0, b, c)  # the ends meet turned over
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    source = pv.PolyData.from_regular_faces(points, triangles)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "pymeshlab", None)
        with pytest.raises(MissingPackageError, match=r"under the landmarks has only one side.*\[remesh\]"):
            prepare(source, near=points[::6])


def test_what_pymeshlab_cannot_mend_is_refused(monkeypatch):
    pymeshlab = pytest.importorskip("pymeshlab")
    mesh = RepairedMesh.of(*soup(*ball(), 0.2))

    class Broken(pymeshlab.MeshSet):
        def generate_surface_reconstruction_screened_poisson(self, **options):
            raise pymeshlab.PyMeshLabException("out of order")

    class Empty(pymeshlab.MeshSet):
        def generate_surface_reconstruction_screened_poisson(self, **options):
            """It leaves the points."""

    for broken, reason in ((Broken, "pymeshlab cannot mend it: out of order"), (Empty, "nothing is left when it is")):
        monkeypatch.setattr(pymeshlab, "MeshSet", broken)
        with pytest.raises(MeshError, match=f"A soup, and {reason}"):
            reconstructed(mesh, "A soup")
