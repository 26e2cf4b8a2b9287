"""Lines on spheres for the tests of tears."""

from __future__ import annotations

import numpy as np

from facewrinkle.geometry.topology import boundary_loops, euler_characteristic, is_oriented


def meridian(azimuth: float, radius: float = 50.0) -> np.ndarray:
    """Points down a sphere about the origin, from near its top to near its bottom."""
    polar = np.linspace(0.3, 2.8, 30)
    x, y = np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth)
    return radius * np.stack([x, np.cos(polar), y], axis=1)


def assert_ball(mesh):
    """It is closed, of genus 0, turned outwards, and has no vertices to spare."""
    triangles = np.asarray(mesh.regular_faces)
    assert not boundary_loops(triangles)
    assert euler_characteristic(triangles) == 2
    assert is_oriented(triangles)
    assert len(np.unique(triangles)) == mesh.n_points
    assert mesh.volume > 0.0
