"""Points spread over triangles.

what              checked against
surface_samples   shares of area; centroids; itself, drawn again
triangle_samples  shares of smaller triangles, also in stretches of the sequence
"""

from __future__ import annotations

import numpy as np
import pytest

from facewrinkle.geometry.sampling import surface_samples, triangle_samples


def test_samples_are_spread_by_area():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 5], [3, 0, 5], [0, 3, 5]])
    triangles = np.array([[0, 1, 2], [3, 4, 5]])
    cloud = surface_samples(points, triangles, 5000)
    on_large = cloud[:, 2] > 2.5
    assert on_large.mean() == pytest.approx(0.9, abs=1e-3)
    np.testing.assert_allclose(cloud[on_large].mean(axis=0), [1, 1, 5], atol=0.01)
    assert (cloud[on_large][:, :2].sum(axis=1) <= 3.0 + 1e-12).all()
    assert np.array_equal(cloud, surface_samples(points, triangles, 5000))


@pytest.mark.parametrize("stretch", [slice(None), slice(0, 400), slice(300, 700)])
def test_each_quarter_of_a_triangle_has_a_quarter_of_the_samples(stretch):
    u, v = (share[stretch] for share in triangle_samples(4000))
    assert np.mean(u > 0.5) == pytest.approx(0.25, abs=0.02)
    assert np.mean(v > 0.5) == pytest.approx(0.25, abs=0.02)
    assert np.mean(u + v < 0.5) == pytest.approx(0.25, abs=0.02)
