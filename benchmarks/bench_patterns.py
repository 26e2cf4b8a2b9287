"""Patterns of a moment against plain numpy: all presets, in motion, on a real face of 50 thousand triangles.

The reference evaluates the formulas in the regions from the same local coordinates and windows, with whole arrays; the
wrinkles are the paper's even ones, since what makes them differ is computed once, by both. Goal: three times faster.
"""

from __future__ import annotations

import dataclasses
import warnings
from pathlib import Path

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.layers.base import SurfaceState
from facewrinkle.layers.patterns_on_skin import presets

FACES = Path(__file__).parents[2] / "shared" / "faces"
TRIANGLES = 50_000
STRENGTH = 0.8


def even(kind):
    """What a kind has beyond the paper's formula, turned off."""
    known = {field.name for field in dataclasses.fields(kind)}
    return {name: 0.0 for name in ("variation", "splay", "crease") if name in known}


@pytest.fixture(scope="module")
def scene():
    """The layers of a simulation of the face, refined, and its moment."""
    stem = FACES / "ict_face_narrow.obj"
    if stem.exists():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", fw.FaceWrinkleWarning)
            face = fw.fit_face(stem, stem.with_suffix(".landmarks.json"))
    else:
        face = fw.default_face()
    layers = [fw.PatternLayer.preset(name, face, strength=STRENGTH) for name in presets.names()]
    for layer in layers:
        layer.patterns = tuple(dataclasses.replace(kind, **even(kind)) for kind in layer.patterns)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fw.FaceWrinkleWarning)  # the finest wrinkles would have more
        sim = fw.Simulation(face, fw.Refinement(max_level=2), layers, motion=fw.Still(face))
    for _ in range(8):
        frame = sim.step()
    rng = np.random.default_rng(0)
    while frame.n_cells < TRIANGLES:  # more triangles, spread over the face
        sim._follow(sim.forest.split(rng.random(frame.n_cells) < 0.01))
        frame = sim._frame(*sim._shape(face.points * face.unit))
    bare = sim.vertices.points * face.unit
    state = SurfaceState(np.empty(0), sim.vertices, sim.forest.triangles, bare[: len(face.points)], bare, 0.0)
    return sim.layers, state, frame.n_cells


@pytest.mark.parametrize("what", ["strength", "strength and t"])
def test_patterns_of_a_frame(versus, scene, notes, what):
    """Patterns that rise and fall, and such that run on as well."""
    layers, state, cells = scene
    planes = [layer._planes() for layer in layers]
    seconds = iter(np.arange(100_000) * 0.02)

    def at(time):
        strength = 0.55 + 0.45 * np.sin(time)
        return strength, time if what == "strength and t" else None

    def kernels(time):
        for layer in layers:
            layer.strength, layer.t = at(time)
        now = dataclasses.replace(state, time=time)
        return sum(layer.displacement(now).height for layer in layers)

    def numpy(time):
        strength, running = at(time)
        total = np.zeros(len(state.bare))
        for layer, plane in zip(layers, planes, strict=True):
            for pattern, x, y in plane:
                t = pattern.time(time) if running is None else running
                total[layer._where] += (
                    layer.depth * layer._weight * pattern.relief(x, y, strength, t, layer._laid.aspect)
                )
        return total

    for time in (0.3, 0.3, 1.7):
        np.testing.assert_allclose(kernels(time + 2.0), numpy(time + 2.0), atol=1e-12)
    assert cells >= TRIANGLES
    goal = 3.0 if what == "strength" else None  # the usual case: a smile comes and goes
    ours, plain = (lambda: kernels(2.0 + next(seconds))), (lambda: numpy(2.0 + next(seconds)))
    versus(f"all patterns of a frame, {what} change: kernels, numpy", ours, plain, goal, 60)
    notes["patterns"] = f"{cells} triangles, {sum(len(layer._where) for layer in layers)} vertices in the regions"
