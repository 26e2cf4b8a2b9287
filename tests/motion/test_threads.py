"""One thread at a time: what others get, and that copies are free."""

from __future__ import annotations

import copy
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.errors import ParameterError


def elsewhere(work):
    """The result of work in another thread, or its error."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(work).result()


@pytest.mark.parametrize("name", ["step", "reset", "settle", "run", "use_layers", "take_triangles"])
def test_a_simulation_at_work_refuses_other_threads(face, name):
    other = fw.Simulation(face, layers=[])
    works = {
        "step": lambda: sim.step(),
        "reset": lambda: sim.reset(),
        "settle": lambda: sim.settle(),
        "run": lambda: next(sim.run(3)),
        "use_layers": lambda: sim.use_layers([]),
        "take_triangles": lambda: other.take_triangles(sim),
    }

    class Asking(fw.Still):
        asks = False

        def step(self):
            if self.asks:
                with pytest.raises(
                    ParameterError, match=r"another thread\. Give each thread its own: fw\.Simulation\("
                ):
                    elsewhere(works[name])
                asked.append(name)
            return super().step()

    asked, motion = [], Asking(face)
    sim = fw.Simulation(face, layers=[], motion=motion)
    motion.asks = True
    frame = sim.step()
    assert asked == [name]
    assert sim.time == motion.time_step
    assert np.array_equal(frame.points, face.points)
    motion.asks = False
    elsewhere(works[name])  # nobody is inside any more


def test_a_run_that_waits_leaves_the_simulation_to_others(face):
    sim = fw.Simulation(face, layers=[])
    frames = sim.run(3)
    next(frames)
    elsewhere(sim.step)
    assert sim.time == pytest.approx(0.04)
    elsewhere(lambda: next(frames))
    assert sim.time == pytest.approx(0.06)


def test_after_an_error_the_simulation_is_free(face):
    class Failing(fw.Still):
        def step(self):
            raise KeyError("its own")

    sim = fw.Simulation(face, layers=[], motion=Failing(face))
    for _ in range(2):
        with pytest.raises(KeyError, match="its own"):
            elsewhere(sim.step)
    sim.reset()


def test_a_skin_at_work_refuses_other_threads(face):
    skin = fw.Skin(face)
    with skin._alone:
        for work in (skin.step, skin.reset, lambda: skin.cleared(np.zeros_like(skin.points))):
            with pytest.raises(ParameterError, match=r"this skin is at work in another thread\. .* fw\.Skin\(face\)\."):
                elsewhere(work)
        skin.step()  # the same thread may
    elsewhere(skin.step)


def test_copies_of_a_simulation_at_work_are_free(face, fingerprint):
    sim = fw.Simulation(face, fw.Refinement(max_level=0))
    sim.express("surprise")
    sim.step()
    with sim._alone:
        copies = copy.deepcopy(sim), pickle.loads(pickle.dumps(sim))
        moved = [fingerprint(elsewhere(one.step)) for one in copies]
    assert moved == [fingerprint(sim.step())] * 2
