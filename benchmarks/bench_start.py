"""What a user waits for: the import, the first frame with and without what is kept on the disk, and a fine mesh.

Import and first frame: every round is a new interpreter.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time

import pytest
import pyvista as pv
from scipy.sparse.linalg import splu

import facewrinkle as fw

FIRST_FRAME = """
import facewrinkle as fw
sim = fw.Simulation(fw.default_face())
sim.express("surprise")
assert sim.step().n_cells >= 4517
"""

CACHES = ("NUMBA_CACHE_DIR",)

LIBRARIES = """
import numba, pyvista, scipy.sparse.csgraph, scipy.sparse.linalg, scipy.spatial
context = numba.core.registry.cpu_target.target_context
context.refresh()  # as the first function does that is compiled or read
"""


def run(code, environment):
    """Seconds of a new interpreter."""
    begin = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)
    return time.perf_counter() - begin


def processor(code, environment):
    """Seconds of the processor that a new interpreter takes."""
    before = os.times()
    run(code, environment)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def test_import(benchmark, results, installed):
    """`import facewrinkle` after `import pyvista` costs nothing that one would notice."""
    pyvista = []
    benchmark.group = "start"
    benchmark.pedantic(
        lambda: run("import pyvista, facewrinkle", installed),
        setup=lambda: pyvista.append(run("import pyvista", installed)),
        rounds=7,
        warmup_rounds=1,
    )
    if not benchmark.disabled:
        ours, reference = statistics.median(benchmark.stats.stats.data), statistics.median(pyvista[1:])
        more = ours - reference
        benchmark.extra_info.update(seconds_more=more, goal=0.3)
        results.record("import facewrinkle, pyvista", ours, reference, f"{1e3 * more:+.0f} ms", "< 300 ms", more < 0.3)


@pytest.mark.parametrize("cache, goal, rounds", [("cold", 5.0, 2), ("warm", 1.0, 5)])
def test_first_frame(benchmark, results, installed, tmp_path, cache, goal, rounds):
    """From nothing to the first frame of the built-in head; the cold rounds compile everything.

    In seconds of the processor, beside those of the libraries that every first frame needs.
    """
    folders = iter(tmp_path / str(k) for k in range(100)) if cache == "cold" else iter(lambda: tmp_path, None)
    seconds, libraries = [], []

    def libraries_first():
        libraries.append(processor(LIBRARIES, installed))
        return (next(folders),), {}

    benchmark.group = "start"
    benchmark.pedantic(
        lambda folder: seconds.append(processor(FIRST_FRAME, installed | dict.fromkeys(CACHES, str(folder)))),
        setup=libraries_first,
        rounds=rounds,
        warmup_rounds=int(cache == "warm"),
    )
    assert any(tmp_path.rglob("*.nbi")), "numba must have cached its code there"
    if not benchmark.disabled:
        ours, reference = statistics.median(seconds[-rounds:]), statistics.median(libraries[-rounds:])
        benchmark.extra_info.update(goal=goal, cpu_seconds=ours)
        value = f"{ours:.2f} s, {ours / reference:.1f}x libraries"
        results.record(f"first frame, {cache} cache (CPU)", ours, reference, value, f"< {goal:g} s", ours < goal)


def cpu(function):
    """Seconds of this process."""
    begin = time.process_time()
    function()
    return time.process_time() - begin


@pytest.mark.parametrize("splits, goal, rounds", [(2, 10.0, 3), (3, 40.0, 1)])
def test_fine_mesh(benchmark, results, splits, goal, rounds):
    """From 72 and 289 thousand triangles with landmarks to a simulation, beside three factors by SciPy's defaults.

    In seconds of the processor; the larger one takes some gigabytes.
    """
    head = fw.default_face()
    mesh = pv.PolyData.from_regular_faces(head.points, head.triangles).subdivide(splits, "loop")
    fw.Simulation(head).step()  # compiled
    made = []

    def start():
        made[:] = [fw.Simulation(fw.fit_face(mesh, head.landmarks))]

    seconds = []
    benchmark.group = "start"
    benchmark.pedantic(lambda: seconds.append(cpu(start)), rounds=rounds)
    assert made[0].step().n_cells >= mesh.n_cells
    if not benchmark.disabled:
        ours = min(seconds)
        benchmark.extra_info.update(goal=goal, cpu_seconds=ours)
        matrices = [m.tocsc() for m in made[0].skin._stiffness_matrices(made[0].skin._bending)] if splits == 2 else []
        reference = cpu(lambda: [splu(matrix) for matrix in matrices]) if matrices else None
        what = f"fit and start, {mesh.n_cells} triangles (CPU)"
        results.record(what, ours, reference, f"{ours:.2f} s", f"< {goal:g} s", ours < goal)
