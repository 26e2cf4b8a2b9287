"""Natural variation of wrinkles.

what           checked against
amount 0       exactly nothing
amount 1       every phase still rises from furrow to furrow: no two wrinkles meet, none is lost
differences    depth, length, distance and bend of wrinkles that were even, measured on furrows; more with the amount
seeds          the same again; others for others; the same on any mesh
continuity     across the borders between wrinkles
"""

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given, settings
from hypothesis import strategies as st

import facewrinkle as fw
from facewrinkle.layers.patterns_on_skin.wrinkles import Cheek, EyeCorner, Forehead, Frown, natural_variation

ALL = (Forehead, EyeCorner, Cheek, Frown)


def furrows(kind, v):
    """Across a region at the height v: where the furrows of cheek wrinkles are, and how deep."""
    u = np.linspace(-1.0, 1.0, 8001)
    x, y = kind.plane(np.stack([u, np.full_like(u, v)], axis=1), 1.0)
    w = kind.relief(x, y, 1.0, 0.0, 1.0)
    at = np.flatnonzero((w[1:-1] < w[:-2]) & (w[1:-1] <= w[2:])) + 1
    return u[at], -w[at]


@settings(max_examples=60)
@given(seed=st.integers(0, 2**40), along=st.floats(-1.0, 1.0), start=st.floats(-50.0, 50.0))
def test_wrinkles_never_meet(seed, along, start):
    phase = start + np.linspace(0.0, 12.0 * np.pi, 3001)
    shift, share = natural_variation(phase, np.full_like(phase, along), 1.0, seed)
    assert (np.diff(phase + shift) > 0.0).all()
    assert 0.0 <= share.min() <= share.max() <= 1.0


@settings(max_examples=30)
@given(seed=st.integers(0, 2**40), along=st.floats(-1.0, 1.0), number=st.integers(-40, 40))
def test_it_is_continuous_between_wrinkles(seed, along, number):
    """At a furrow, where one pair of wrinkles gives way to the next, values and slopes agree."""
    phase = 2.0 * np.pi * (number - 0.25) + np.array([-2e-5, -1e-5, 1e-5, 2e-5])
    for values in natural_variation(phase, np.full(4, along), 0.8, seed):
        assert np.ptp(values) < 1e-8  # level there


def test_nothing_at_amount_0_and_more_the_larger_it_is():
    rng = np.random.default_rng(0)
    phase, along = rng.uniform(-60, 60, 500), rng.uniform(-1, 1, 500)
    shift, share = natural_variation(phase, along, 0.0, 4)
    assert not shift.any()
    assert (share == 1.0).all()
    half, full = natural_variation(phase, along, 0.5, 4), natural_variation(phase, along, 1.0, 4)
    np.testing.assert_allclose(half[0], 0.5 * full[0], atol=1e-14)
    assert (full[1] <= half[1] + 1e-12).all()
    assert full[1].mean() < half[1].mean() < 1.0


def test_wrinkles_differ_in_depth_length_distance_and_bend():
    even, varied = (Cheek(number=6, radius=20.0, variation=amount, seed=2) for amount in (0.0, 0.8))
    at, deep = furrows(even, 0.0)
    assert len(at) == 6
    assert np.ptp(np.diff(at)) < 1e-3
    assert np.ptp(deep) < 1e-3
    ours, depth = furrows(varied, 0.0)
    assert len(ours) == 6  # as many as asked for
    assert np.ptp(np.diff(ours)) > 0.15 * np.diff(at).mean()
    assert np.ptp(depth) > 0.2 * deep.mean()
    assert depth.max() <= deep.max() + 1e-9
    ends = [furrows(varied, v) for v in (-0.9, -0.45, 0.45, 0.9)]
    assert all(len(where) == 6 for where, _ in ends)
    lower, upper = ends[1][1] / depth, ends[2][1] / depth
    assert np.ptp(lower) > 0.15  # some reach further down than others,
    assert np.ptp(upper) > 0.15  # and further up
    bend = ends[2][0] + ends[1][0] - 2.0 * ours
    assert np.ptp(ends[2][0] - ends[1][0]) > 0.03
    assert np.ptp(bend) > 0.01


@pytest.mark.parametrize("kind", ALL)
def test_seeds(kind):
    uv = np.random.default_rng(1).uniform(-1, 1, (300, 2))

    def heights(seed):
        own = kind(variation=0.7, seed=seed)
        return own.relief(*own.plane(uv, 0.7), 1.0, own.time(0.0), 0.7)

    np.testing.assert_array_equal(heights(3), heights(3))
    assert np.abs(heights(3) - heights(4)).max() > 0.1
    even = kind()
    x, y = even.plane(uv, 0.7)
    assert np.abs(heights(3) - even.relief(x, y, 1.0, even.time(0.0), 0.7)).max() > 0.1


def test_the_same_wrinkles_on_another_mesh():
    """They belong to the region, not to its vertices: at common places of two meshes they are equally high."""
    frames = []
    for n in (20, 40):
        face = fw.surface(pv.Plane(i_size=100, j_size=100, i_resolution=n, j_resolution=n))
        layer = fw.PatternLayer("cheek", (0, 0, 0), size=60.0, number=3, variation=0.8, seed=7)
        *_, frame = fw.Simulation(face, layers=[layer]).run(6)
        frames.append(
            {tuple(p): w for p, w in zip(np.round(frame["rest"][:, :2], 6).tolist(), frame["W"], strict=True)}
        )
    common = sorted(set(frames[0]) & set(frames[1]))
    assert len(common) > 400
    np.testing.assert_allclose(
        [frames[0][p] for p in common], [frames[1][p] for p in common], atol=1e-6
    )  # float32 points


def test_both_sides_of_a_face_differ(face):
    left, right = fw.PatternLayer.presets("eye_corner", face, seed=5)
    assert (left.patterns[0].seed, right.patterns[0].seed) == (5, 6)
    assert fw.PatternLayer.preset("forehead", face).patterns[0].seed == 0
    assert left.patterns[0].variation > 0.0
    assert fw.PatternLayer.preset("eye_corner_l", face, variation=0.0).patterns[0].variation == 0.0
