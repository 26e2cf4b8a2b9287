"""One refinement pass over a contiguous tenth of a mesh, against packages that do the same.

    pytest benchmarks/bench_refinement.py --benchmark-group-by=group

Each size is one group, with the references in the same run. `forest` splits a prepared forest (a fresh copy per
round), as a simulation does each frame; `forest_with_build` starts from the bare triangles each time. scikit-fem closes
red-green-blue; pymeshlab's midpoint subdivision halves the edges inside the selection but not those of its border, and
so does slightly less. Both give conforming meshes and start from their own mesh object, which is not timed.
trimesh.remesh.subdivide(face_index=...) is no reference: it leaves hanging midpoints on the neighbors of the
selection (396 edges with one triangle instead of the square's 192 at 4.6k), so its result has cracks.
"""

from __future__ import annotations

import numpy as np
import pytest

from facewrinkle.geometry.refinement import RedGreenForest

# Vertices along a side of the square: 4,608, 45,602 and 460,800 triangles.
SIDES = {"4.6k": 49, "46k": 152, "461k": 481}
ROUNDS = {"4.6k": 30, "46k": 10, "461k": 5}


@pytest.fixture(params=SIDES)
def square(request):
    """Points (n, 3), triangles (m, 3), and a mark on the tenth of them nearest to a point."""
    size = request.param
    n = SIDES[size]
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(n * n)], axis=1)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1, 1)
    triangles = np.concatenate([corner + np.array(offsets) for offsets in ([0, 1, n + 1], [0, n + 1, n])])
    distance = np.linalg.norm(points[triangles].mean(axis=1) - [0.6, 0.55, 0], axis=1)
    marked = np.zeros(len(triangles), bool)
    marked[np.argsort(distance, kind="stable")[: len(triangles) // 10]] = True
    return size, points, triangles, marked


def timed(benchmark, square, work, setup):
    """Time `work` on a fresh `setup()` each round; the first round, which compiles, is left out."""
    size, _, _, marked = square
    benchmark.group = f"a tenth of {size} triangles"
    return benchmark.pedantic(work, setup=lambda: ((setup(), marked), {}), rounds=ROUNDS[size], warmup_rounds=1)


def test_forest(benchmark, square):
    _, _, triangles, marked = square
    prepared = RedGreenForest(triangles)
    change = timed(benchmark, square, RedGreenForest.split, prepared.copy)
    assert change.n_created > marked.sum()


def test_forest_with_build(benchmark, square):
    change = timed(benchmark, square, lambda t, marked: RedGreenForest(t).split(marked), lambda: square[2])
    assert change.n_created > square[3].sum()


def test_scikit_fem(benchmark, square):
    skfem = pytest.importorskip("skfem")
    _, points, triangles, marked = square
    mesh = timed(
        benchmark,
        square,
        lambda mesh, marked: mesh.refined(np.flatnonzero(marked)),
        lambda: skfem.MeshTri(points[:, :2].T.copy(), triangles.T.copy()),
    )
    assert mesh.nelements > len(triangles) + 3 * marked.sum()


def test_pymeshlab(benchmark, square):
    pymeshlab = pytest.importorskip("pymeshlab")
    _, points, triangles, marked = square

    def selected():
        meshes = pymeshlab.MeshSet()
        meshes.add_mesh(pymeshlab.Mesh(points, triangles, f_scalar_array=marked.astype(float)))
        meshes.compute_selection_by_condition_per_face(condselect="fq > 0.5")
        return meshes

    def split(meshes, marked):
        meshes.meshing_surface_subdivision_midpoint(iterations=1, threshold=pymeshlab.PureValue(0.0), selected=True)
        return meshes.current_mesh().face_number()

    assert timed(benchmark, square, split, selected) > len(triangles) + 2.5 * marked.sum()
