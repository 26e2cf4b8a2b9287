"""Surfaces in pieces become one: balls whose triangles were pulled apart, and landmarks of another mesh."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import pyvista as pv

from facewrinkle.errors import MeshError, MissingPackageError
from facewrinkle.geometry import topology
from facewrinkle.mesh import prepare
from facewrinkle.mesh.repair.reconstruction import closed_up, reconstructed
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
    with pytest.raises(MissingPackageError, match=r"in 8 pieces.*facewrinkle\[remesh\]"):
        prepare(source, near=points[::30][:8])


def test_landmarks_of_another_mesh_are_reported():
    pytest.importorskip("pymeshlab")
    parts = [pv.Sphere(radius=0.5, center=(3.0 * k, 0, 0), theta_resolution=8, phi_resolution=8) for k in range(5)]
    source = parts[0].append_polydata(*parts[1:])
    near = np.array([[3.0 * k, 0.0, 0.5] for k in range(5)])
    with pytest.raises(MeshError, match="in 5 pieces; when it is reconstructed.*landmarks are those of this mesh"):
        prepare(source, near=near)
