"""The same work in threads, processes and pools: the same bytes everywhere; and what goes between processes.

what                  checked against
frames                digests of all points and triangles of a run in this thread
pickles               the same face and frame, to the last bit
"""

import hashlib
import multiprocessing
import pickle
import sys
import warnings
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest
from expressions import after

import facewrinkle as fw

EXPRESSIONS = ("surprise", "AU12")


def digest(expression: str) -> str:
    """Digest of the frames of an expression that comes up."""
    import facewrinkle as fw

    sim = fw.Simulation(fw.default_face())
    sim.express(expression)
    found = hashlib.sha256()
    for frame in sim.run(4):
        found.update(np.asarray(frame.points).tobytes() + np.asarray(frame.regular_faces).tobytes())
    return found.hexdigest()


@pytest.fixture(scope="module")
def here() -> list[str]:
    return [digest(expression) for expression in EXPRESSIONS]


def in_processes(method: str) -> Executor:
    return ProcessPoolExecutor(2, mp_context=multiprocessing.get_context(method))


@pytest.mark.parametrize(
    "kind", ["threads", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("spawn", "fork"))]
)
def test_the_same_bytes_in_threads_and_processes(here, kind):
    if kind == "fork" and sys.platform != "linux":
        pytest.skip("fork is safe on Linux only")
    with (
        warnings.catch_warnings(action="ignore", category=DeprecationWarning),  # Python warns of fork beside threads
        ThreadPoolExecutor(2) if kind == "threads" else in_processes(kind) as pool,
    ):
        assert list(pool.map(digest, EXPRESSIONS)) == here


def test_faces_and_frames_are_pickled():
    face = fw.default_face()
    frame = after(fw.Simulation(face), "surprise", 3)
    again, moved = pickle.loads(pickle.dumps((face, frame)))
    np.testing.assert_array_equal(moved.points, frame.points)
    assert set(moved.point_data) == set(frame.point_data)
    np.testing.assert_array_equal(after(fw.Simulation(again), "surprise", 3).points, frame.points)
