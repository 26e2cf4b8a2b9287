"""The amplitudes of a frame (compression, W = H A At, displacement) against the same formulas in numpy and scipy.

The reference does what a good numpy user would do: whatever does not depend on the deformed surface is computed once
(the weights of Eq. 9 are one sparse matrix, m^T T m one inner product), so that a frame is gathers, sparse products
and a sine. Both are checked against each other before they are timed. The 8 thousand triangles are those of the
surprised built-in head; the million are the head with every triangle refined four times, and ("dense") the same as a
mesh of its own, which has its strain at every vertex. Every muscle contracts.

The same formulas in plain C, in floats and on one thread, are the second reference (amplitudes.c); without a compiler
that comparison is skipped.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tracemalloc
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csr_array

import facewrinkle as fw
from facewrinkle.anatomy.face import Face
from facewrinkle.anatomy.muscles import Crease
from facewrinkle.geometry.interpolation import displaced, interpolated
from facewrinkle.geometry.normals import vertex_normals
from facewrinkle.geometry.refinement import Change, RedGreenForest
from facewrinkle.layers.base import SurfacePoints, SurfaceState
from facewrinkle.layers.compression import StrainField
from facewrinkle.layers.muscle_wrinkles import Folds
from facewrinkle.mesh import to_polydata

ROUNDS = {"8k": 100, "1M": 10, "1M dense": 10}
MEGABYTE = 2.0**20


@lru_cache(maxsize=1)
def scene(size):
    """A face, a layer on a refined mesh of it, and a state of that surface, as a simulation hands it to its layers."""
    face = fw.default_face()
    points, triangles = face.points, face.triangles
    if size == "8k":
        sim = fw.Simulation(face)
        sim.express("paper_surprise")
        for _ in sim.run(70):
            pass
        forest = sim.forest
    else:
        forest = refined(triangles)
    if size == "1M dense":
        points, triangles = interpolated(points, forest.corners, forest.barycentric), forest.triangles
        forest = RedGreenForest(triangles, 0, len(points))
    vertices = SurfacePoints.of_forest(forest, points, vertex_normals(points, triangles))
    layer = fw.MuscleWrinkles()
    bare_face = Face.without_anatomy(to_polydata(points, triangles), face.unit)  # all of its skin is seen
    face = replace(bare_face, muscles=face.muscles)
    strain = StrainField.of(face)
    layer.attach(face)
    layer.follow(Change(slice(None), len(vertices.points)), vertices)
    base = squeezed(points)
    bare = interpolated(base, vertices.corners, vertices.barycentric)
    smooth = interpolated(vertex_normals(base, triangles), vertices.corners, vertices.barycentric)
    rates = np.linspace(0.3, 1.0, len(face.muscles))
    state = SurfaceState(rates, vertices, forest.triangles, base, bare, strain_field=lambda: strain)
    return face, layer, state, smooth


def refined(triangles, levels=4):
    forest = RedGreenForest(triangles, levels)
    for _ in range(levels):
        forest.split(np.ones(len(forest.triangles), bool))
    return forest


def squeezed(points):
    """Compressed along every axis, here more and there less, and stretched in places."""
    return points * [0.85, 0.8, 0.9] + 1.5 * np.sin(points[:, [1, 2, 0]] / 9.0)


def ours(layer, state, smooth):
    """Displaced points as a simulation computes them."""
    return displaced(state.bare, layer.displacement(state).height, smooth)


class Reference:
    """The same in numpy and scipy, from the folds of the muscles at each vertex."""

    def __init__(self, face, state):
        muscles, n = [muscle.fold_pattern for muscle in face.muscles.values()], len(state.bare)
        metric = StrainField(face.points_mm, face.triangles).metric
        self.folds = folds = Folds.at(state.vertices, muscles, face.zones, metric, face.unit)
        self.owner = np.repeat(np.arange(n), np.diff(folds.starts))
        entries = np.arange(len(self.owner))
        drawn = np.array([not isinstance(muscle, Crease) for muscle in muscles])  # creases are a layer of their own
        depth = drawn * np.array([muscle.wrinkles.depth for muscle in muscles]) * state.rates
        heights = depth[folds.muscle] * folds.height
        self.heights = csr_array((heights, (self.owner, entries)), shape=(n, len(entries)))
        self.steep = csr_array((depth[folds.muscle] * folds.steep, (self.owner, entries)), shape=(n, len(entries)))
        folding = np.isin(face.triangles, face.triangles[face.zones.any(axis=0)]).any(axis=1)
        self._share_strain(folds, state.vertices, face.points_mm, face.triangles[folding])

    def _share_strain(self, folds, vertices, points, triangles):
        """The metric of a triangle is linear in the products of its sides, and so is m^T T m in that of the entry."""
        t, n0 = triangles, len(points)
        a, b = points[t[:, 1]] - points[t[:, 0]], points[t[:, 2]] - points[t[:, 0]]
        self.sides, self.products = t, np.stack([(a * a).sum(1), (b * b).sum(1), (a * b).sum(1)], axis=1)
        inverse = np.linalg.pinv(np.stack([a, b], axis=2))
        u, v = inverse[:, 0], inverse[:, 1]
        self.tensors = np.stack([pairs(u, u), pairs(v, v), 2.0 * mixed(u, v)], axis=1)
        area = np.linalg.norm(np.cross(a, b), axis=1)
        corner, triangle = t.ravel(), np.repeat(np.arange(len(t)), 3)
        total = np.bincount(corner, area[triangle], minlength=n0)
        self.share = csr_array((area[triangle] / total[corner], (corner, triangle)), shape=(n0, len(t)))
        columns = vertices.corners[self.owner].ravel()
        rows = np.repeat(np.arange(len(self.owner)), 3)
        shape = len(self.owner), n0
        self.between = csr_array((vertices.barycentric[self.owner].ravel(), (rows, columns)), shape=shape)
        self.squares = folds.products

    def epsilon(self, state):
        x = state.base[self.sides]
        a, b = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
        now = np.stack([np.einsum("mk,mk->m", *ab) for ab in ((a, a), (b, b), (a, b))], axis=1)
        strain = self.share @ np.einsum("mj,mjk->mk", now - self.products, self.tensors)
        change = np.einsum("pk,pk->p", self.squares, self.between @ strain)
        return 1.0 - np.sqrt(np.maximum(1.0 + change, 0.0))

    def displaced(self, state, smooth):
        epsilon = np.clip(self.epsilon(state), 0.0, 1.0)
        share = np.sin(0.5 * np.pi * epsilon)
        asked = self.steep @ np.divide(share, np.sqrt(epsilon), out=np.zeros_like(share), where=epsilon > 0.0)
        return state.bare + (self.heights @ share / np.maximum(asked, 1.0))[:, None] * smooth


class PlainC:
    """The same in C, from the arrays of the reference in single precision."""

    def __init__(self, library, face, state, folds, reference):
        shares = reference.share.tocsr()
        points, n = len(state.bare), len(shares.indptr) - 1
        self.strain = np.empty((len(reference.sides), 6), np.float32)
        self.metric, self.out = np.empty((n, 6), np.float32), np.empty((points, 3), np.float32)
        self.fixed = [
            len(reference.sides), reference.sides, reference.products, reference.tensors,
            n, shares.indptr, shares.indices, shares.data,
            points, state.vertices.corners, state.vertices.barycentric,
            folds.starts, folds.products, reference.heights.data, reference.steep.data,
        ]  # fmt: skip
        self.fixed = [array if isinstance(array, int) else self.plain(array) for array in self.fixed]
        self.function = ctypes.CDLL(str(library)).displace
        self.function.restype = None

    @staticmethod
    def plain(array):
        array = np.asarray(array)
        return np.ascontiguousarray(array, np.int32 if array.dtype.kind in "iu" else np.float32)

    def moving(self, base, bare, smooth):
        """What a frame brings, in floats: not part of what is timed."""
        return [self.plain(array) for array in (base, bare, smooth)]

    def displaced(self, moving):
        arrays = [*self.fixed, *moving, self.strain, self.metric, self.out]
        self.function(*(a if isinstance(a, int) else a.ctypes.data_as(ctypes.c_void_p) for a in arrays))
        return self.out


def pairs(u, v):
    """Products (xx, yy, zz, yz, xz, xy) of two vectors."""
    return u[:, [0, 1, 2, 1, 0, 0]] * v[:, [0, 1, 2, 2, 2, 1]]


def mixed(u, v):
    return 0.5 * (pairs(u, v) + pairs(v, u))


@pytest.mark.parametrize("size", ROUNDS)
def test_amplitude(versus, size):
    face, layer, state, smooth = scene(size)
    reference = Reference(face, state)
    expected = reference.displaced(state, smooth)
    moved = np.abs(expected - state.bare).max()
    assert moved > 0.5, "the wrinkles must show"
    np.testing.assert_allclose(ours(layer, state, smooth), expected, rtol=0.0, atol=1e-10)
    versus(
        f"amplitudes, {size} triangles",
        lambda: ours(layer, state, smooth),
        lambda: reference.displaced(state, smooth),
        4.0,
        ROUNDS[size],
        2,
    )


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """The shared library of amplitudes.c."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    out, source = tmp_path_factory.mktemp("c") / "amplitudes.so", Path(__file__).with_name("amplitudes.c")
    flags = ["-O3", "-march=native", "-fPIC", "-shared"]
    subprocess.run([compiler, *flags, str(source), "-lm", "-o", str(out)], check=True)
    return out


@pytest.mark.parametrize("size, goal", [("8k", 1.0), ("1M", 1.0 / 0.6)])
def test_amplitude_in_c(versus, library, size, goal):
    """Plain C in floats, one thread, gcc -O3 -march=native."""
    face, layer, state, smooth = scene(size)
    reference = Reference(face, state)
    plain = PlainC(library, face, state, reference.folds, reference)
    moving = plain.moving(state.base * face.unit, state.bare, smooth)
    np.testing.assert_allclose(plain.displaced(moving), reference.displaced(state, smooth), rtol=0.0, atol=2e-3)
    versus(
        f"amplitudes, {size} triangles: facewrinkle, C in floats",
        lambda: ours(layer, state, smooth),
        lambda: plain.displaced(moving),
        goal,
        ROUNDS[size],
        2,
    )


def test_memory(benchmark, notes):
    """Memory of a million triangles: the forest, the places of the vertices, the layer, and a frame's amplitudes."""
    triangles, points = fw.default_face().triangles, fw.default_face().points

    def held():
        tracemalloc.start()
        forest = refined(triangles)
        sizes = [tracemalloc.get_traced_memory()[0]]
        vertices = SurfacePoints.of_forest(forest, points, vertex_normals(points, triangles))
        sizes.append(tracemalloc.get_traced_memory()[0])
        face = fw.default_face()
        layer = fw.MuscleWrinkles()
        layer.attach(face)
        layer.follow(Change(slice(None), len(vertices.points)), vertices)
        sizes.append(tracemalloc.get_traced_memory()[0])
        base = squeezed(points)
        bare = interpolated(base, vertices.corners, vertices.barycentric)
        tracemalloc.reset_peak()
        rates, strain = np.ones(len(face.muscles)), StrainField.of(face)
        layer.displacement(SurfaceState(rates, vertices, forest.triangles, base, bare, strain_field=lambda: strain))
        sizes.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        return len(forest.triangles), np.diff(sizes, prepend=0) / MEGABYTE

    benchmark.group = "building the state of 1M triangles"
    m, (forest, places, layer, update) = benchmark.pedantic(held, rounds=1, warmup_rounds=0)
    notes[f"memory at {m} triangles"] = (
        f"forest {forest:.0f} MB, places {places:.0f} MB, layer {layer:.0f} MB; "
        f"{update:.0f} MB more at the peak of an amplitude update"
    )
    assert forest + places + layer > 0.0
