"""Catmull-Clark subdivision reproduces planes, bicubic B-splines, and itself at other levels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from squares import grid

from facewrinkle.anatomy.head import cage_data, load_head
from tools.build_head.build import refuse_crossings
from tools.build_head.cage import subdivided
from tools.build_head.half_cage import half_surface, lining_places, opposite_on_lips

CUBE = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6]]
)  # open: the side 3, 0, 4, 7 is missing


@pytest.mark.parametrize("quads", [CUBE, grid(3)])
def test_weights_sum_to_one(quads: np.ndarray) -> None:
    fine = subdivided(quads, 3)
    np.testing.assert_allclose(fine.limit.sum(axis=1), 1.0, atol=1e-12)
    assert len(fine.quads) == len(quads) * 64


@pytest.mark.parametrize("quads", [CUBE, grid(4)])
def test_limit_points_do_not_depend_on_the_level(quads: np.ndarray) -> None:
    points = np.random.default_rng(0).normal(size=(quads.max() + 1, 3))
    coarse, fine = subdivided(quads, 1), subdivided(quads, 3)
    np.testing.assert_allclose(
        (coarse.limit @ points)[coarse.grids], (fine.limit @ points)[fine.grids[:, ::4, ::4]], atol=1e-12
    )


def test_regular_patch_is_the_bicubic_b_spline_and_the_boundary_a_cubic_one() -> None:
    """The boundary is that of its own points alone."""
    n, levels = 5, 3
    points = np.random.default_rng(1).normal(size=(n + 1, n + 1))
    fine = subdivided(grid(n), levels)
    limit = (fine.limit @ points.ravel())[fine.grids]
    t = np.linspace(0.0, 1.0, 2**levels + 1)
    basis = np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3]) / 6.0
    i, j = 2, 2
    exact = basis.T @ points[i - 1 : i + 3, j - 1 : j + 3] @ basis
    np.testing.assert_allclose(limit[i * n + j], exact, atol=1e-12)
    np.testing.assert_allclose(limit[1, 0], basis.T @ points[0, 0:4], atol=1e-12)


def test_grids_meet_along_shared_edges() -> None:
    fine = subdivided(grid(2), 2)
    assert (fine.grids[0, :, -1] == fine.grids[1, :, 0]).all()
    assert (fine.grids[0, -1, :] == fine.grids[2, 0, :]).all()
    assert (np.unique(fine.grids) == np.arange(fine.limit.shape[0])).all()


# --- linings of the lips --------------------------------------------------------------------------


def test_places_on_the_linings_run_from_lip_to_lip_and_inwards():
    half = half_surface(cage_data())
    places = lining_places(half)
    for ring, depth in ((3, 0.0), (4, 1.0)):
        for number in range(9):
            np.testing.assert_allclose(places[half.of(f"mouth_ring{ring}.{number}")], [number, depth], atol=1e-12)
    assert np.isnan(places[half.of("mouth_ring2.0")]).all()


def test_opposite_places_are_found_between_coarser_ones():
    upper = [[0.0, 0.0], [2.5, 0.0], [3.5, 0.0], [0.0, 1.0]]
    lower = [[4.0, 0.0], [5.0, 0.0], [5.5, 0.0], [8.0, 0.0], [8.0, 1.0]]
    rows = opposite_on_lips(np.array([*upper, *lower, [np.nan, np.nan]]))
    assert rows.tolist() == [[3, 3, 8, 8], [0, 3, 7, 7], [1, 1, 6, 6], [2, 2, 4, 5]]


def test_a_head_whose_lips_are_not_parted_is_refused():
    head = load_head()
    touching = replace(head.mold, lips=head.mold.lips[:0])
    eye = head.eyes[0]
    points = touching(np.array(list(cage_data()["points"].values())), eye.centre, eye.radius)
    with pytest.raises(ValueError, match="the head crosses itself: 114 triangles run through each other, around"):
        refuse_crossings(points, head.triangles)
    refuse_crossings(head.points, head.triangles)
