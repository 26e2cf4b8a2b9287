"""Patterns of one frame against plain numpy: all presets, in motion, on a real face of 50 thousand triangles.

The reference evaluates the formulas in the regions from the same local coordinates and windows, with whole arrays; the
wrinkles are the paper's even ones, since both would compute the variation once. Goal: three times faster.
"""

from __future__ import annotations

import dataclasses
import warnings
from pathlib import Path

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.geometry.normals import vertex_normals
from facewrinkle.geometry.refinement import Change
from facewrinkle.layers.base import SurfacePoints, SurfaceState
from facewrinkle.layers.patterns_on_skin import presets

FACES = Path(__file__).parents[2] / "shared" / "faces"
TRIANGLES = 50_000
STRENGTH = 0.8


def even(kind):
    """Parameters that turn off all that a kind has beyond the paper's formula."""
    known = {field.name for field in dataclasses.fields(kind)}
    return {name: 0.0 for name in ("variation", "splay", "crease") if name in known}


@pytest.fixture(scope="module")
def scene():
    """The face, the layers on its refined mesh, and the state of that surface."""
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
        sim.step()
    rng, forest = np.random.default_rng(0), sim.forest
    while len(forest.triangles) < TRIANGLES:  # more triangles, spread over the face
        forest.split(rng.random(len(forest.triangles)) < 0.01)
    vertices = SurfacePoints.of_forest(forest, face.points, vertex_normals(face.points, face.triangles))
    for layer in layers:
        layer.attach(face)
        layer.follow(Change(slice(None), len(vertices.points)), vertices)
    bare = vertices.points * face.unit
    return face, layers, SurfaceState(np.empty(0), vertices, forest.triangles, bare[: len(face.points)], bare)


def in_plane(layer, face, state):
    """The vertices of a layer, its depth at them, and the pattern with its coordinates there."""
    laid, (pattern,) = layer.laid(face), layer.patterns
    where, uv, _, weight = laid.at(state.vertices)
    return where, layer.depth * weight, pattern, *pattern.plane(uv, laid.aspect), laid.aspect


@pytest.mark.parametrize("what", ["strength", "strength and t"])
def test_patterns_of_a_frame(versus, scene, notes, what):
    """Patterns whose strength changes alone, or together with their t."""
    face, layers, state = scene
    planes = [in_plane(layer, face, state) for layer in layers]
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
        for where, depth, pattern, x, y, aspect in planes:
            t = pattern.time(time) if running is None else running
            total[where] += depth * pattern.relief(x, y, strength, t, aspect)
        return total

    for time in (0.3, 0.3, 1.7):
        np.testing.assert_allclose(kernels(time + 2.0), numpy(time + 2.0), atol=1e-12)
    goal = 3.0 if what == "strength" else None  # the usual case: a smile comes and goes
    ours, plain = (lambda: kernels(2.0 + next(seconds))), (lambda: numpy(2.0 + next(seconds)))
    versus(f"all patterns of a frame, {what} change: kernels, numpy", ours, plain, goal, 60)
    inside = sum(len(where) for where, *_ in planes)
    notes["patterns"] = f"{len(state.triangles)} triangles, {inside} vertices in the regions"
