"""A PolyData refined in one step."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

from facewrinkle.mesh import refine


def test_refine_splits_one_triangle_and_closes_around_it() -> None:
    plane = pv.Plane(i_resolution=2, j_resolution=2).triangulate()
    plane.point_data["affine"] = plane.points @ [1.0, 2.0, 3.0] + 0.5
    plane.point_data["label"] = np.arange(plane.n_points)
    before = plane.copy()
    fine = refine(plane, [0])
    corners = set(plane.regular_faces[0].tolist())
    inner = [s for s in range(3) if _is_inner(plane, plane.regular_faces[0][[s, (s + 1) % 3]])]
    assert fine.n_cells == plane.n_cells + 3 + len(inner)
    assert np.array_equal(fine.points[: plane.n_points], plane.points)
    assert fine.area == pytest.approx(plane.area, rel=1e-12)
    np.testing.assert_allclose(fine["affine"], fine.points @ [1.0, 2.0, 3.0] + 0.5, atol=1e-12)
    assert set(fine["label"][plane.n_points :].tolist()) <= corners
    assert plane == before


def _is_inner(surface: pv.PolyData, edge: np.ndarray) -> bool:
    return int(np.isin(surface.regular_faces, edge).sum(axis=1).tolist().count(2)) == 2
