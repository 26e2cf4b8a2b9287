"""Triangles of the wrinkled surface and of the bare one below it face the same side, on random frames of the head."""

from __future__ import annotations

import numpy as np
import pytest
from small_meshes import area_vectors

import facewrinkle as fw
from facewrinkle.geometry.interpolation import interpolated
from facewrinkle.simulation import loop


def bare_surface(sim):
    """The refined surface (n, 3) as it is without wrinkles, mm."""
    base = sim.skin.points + sim.skin.displacement
    return interpolated(base, sim.vertices.corners, sim.vertices.barycentric)


def turned(sim, frame):
    """Triangles that face away from where they face without wrinkles."""
    points = np.asarray(frame.points) * sim.face.unit
    before, after = (area_vectors(x, sim.forest.triangles) for x in (bare_surface(sim), points))
    return np.flatnonzero((before * after).sum(axis=1) <= 0.0)


def mixtures(sim, seed, frames):
    """Play another 3 to 20 muscles at random rates, in a jump, every five frames."""
    rng = np.random.default_rng(seed)
    for i in range(frames):
        if i % 5 == 0:
            names = rng.choice(sim.muscles, rng.integers(3, 21), replace=False)
            rates = rng.random(len(names))
            sim.contract(dict(zip(names.tolist(), np.minimum(rates + 0.5 * (seed % 3 == 2), 1.0), strict=True)))
        yield sim.step()


@pytest.mark.parametrize("seed", [11, 50, 7])
def test_wrinkles_turn_no_triangle_over(face, seed):
    """Two of these mixtures have turned triangles over at the corners of the mouth."""
    sim, largest = fw.Simulation(face), 0.0
    for frame in mixtures(sim, seed, 14):
        assert len(turned(sim, frame)) == 0
        largest = max(largest, np.abs(frame["W"]).max())
    assert largest > 0.3


@pytest.fixture
def deep(face):
    """Wrinkles thirty times as deep, in the hollows beside the nose."""
    sim = fw.Simulation(face, layers=[fw.MuscleWrinkles(depth=30.0, inextensible=False)])
    sim.contract({f"{name}_{side}": 1.0 for name in ("nasalis", "levator_labii_superioris") for side in "lr"})
    return sim


def test_nor_do_wrinkles_of_any_depth(deep, monkeypatch):
    for frame in deep.run(12):
        assert len(turned(deep, frame)) == 0
    monkeypatch.setattr(loop, "unfolded_shares", lambda *_: None)
    assert len(turned(deep, deep.step())) > 0


def test_heights_are_lowered_with_those_that_shade(face, monkeypatch):
    """Where nothing is left of a wrinkle, no shade of it is left either."""
    monkeypatch.setattr(loop, "unfolded_shares", lambda points, *_: np.zeros(len(points)))
    frames = []
    for layers in (None, []):
        sim = fw.Simulation(face, layers=layers)
        sim.express("paper_surprise")
        frames.append([sim.step() for _ in range(2)][-1])
    lowered, bare = frames
    assert not lowered["W"].any()
    np.testing.assert_allclose(lowered["Normals"][: bare.n_points], bare["Normals"], atol=1e-12)
