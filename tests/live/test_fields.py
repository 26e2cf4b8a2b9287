"""All that is known at a vertex.

numbers of formulas | put in again, they add up to the heights of the layers, before these are leveled
who made it         | the muscle whose own W is the deepest there; the pattern that was placed
"""

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.layers.entries import Relief
from facewrinkle.live.fields import probe
from facewrinkle.mesh import values_at


@pytest.fixture(scope="module")
def happy(face):
    """A simulation of a smile with a dimple whose heights are not leveled, and its frame."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Relief, "leveled", lambda relief, areas: relief)
        dimple = fw.PatternLayer("dimple", [38.8, -30.8, 95.0], name="mine", size=12.0, depth=2.0)
        layers = [fw.Creases(), fw.WaveFolds(), dimple]
        sim = fw.Simulation(face, layers=layers)
        sim.express({"happiness": 1.0, "AU4": 0.5})
        yield sim, sim.settle()


def test_the_numbers_add_up_to_the_heights(happy):
    sim, frame = happy
    muscles, waves, _ = sim.layers
    folded = np.flatnonzero(np.abs(frame["W"]) > 0.1)[::40]
    assert len(folded) > 20
    for vertex in folded:
        told = waves.explained(int(vertex))
        others = muscles.fields()["W"][vertex] + frame["pattern_mine"][vertex]
        assert sum(each["W"] for each in told) + others == pytest.approx(frame["W"][vertex], abs=1e-6)
        for each in told:  # the formula of the docstring, by its numbers
            s, alpha = each["theta"] / np.pi, each["alpha"]
            bulge = (2.0 ** (alpha + 1.0) - 1.0) / (2.0 * (alpha + 1.0))
            assert each["W"] == pytest.approx(each["D"] * (bulge - abs(s) * (1 + s * s) ** alpha) / 2.0**alpha)
            deepest = min(0.75 * each["P"] * 2.0 / np.pi * each["L"] * np.sqrt(each["e"]), 0.22 * each["L"])
            assert each["D"] == pytest.approx(each["share"] * each["S"] * deepest)
        own = muscles.explained(int(vertex))
        assert sum(each["W"] for each in own) == pytest.approx(muscles.fields()["W"][vertex], abs=1e-9)
        for each in own:
            product = each["k0"] * each["rate"] * each["H At"] * each["A"] * each["share"]
            assert each["W"] == pytest.approx(product)


def at(vertex):
    """A corner of a triangle."""
    return np.array([vertex, 0, 1]), np.array([1.0, 0.0, 0.0])


def test_the_card_tells_what_pin_and_program_tell(happy, face):
    """At ten places between vertices: the same interpolation, in the triangle."""
    sim, frame = happy
    generator, triangles = np.random.default_rng(0), frame.regular_faces
    folded = triangles[(np.abs(frame["W"][triangles]) > 0.05).all(axis=1)]
    for corners in generator.choice(folded, 10):
        shares = generator.dirichlet([2.0, 2.0, 2.0])
        told = probe(frame, face, sim.layers, corners, shares)
        assert told["values"]["W"] == pytest.approx(shares @ frame["W"][corners], abs=1e-5)
        assert values_at(frame, "W", [told["rest"]])[0] == pytest.approx(told["values"]["W"], abs=1e-4)


def test_the_maker_is_the_deepest(happy, face):
    sim, frame = happy
    creases = sim.fields("zygomaticus_major_l")["W"]
    told = probe(frame, face, sim.layers, *at(np.argmin(creases)))
    assert told["made_by"] == "zygomaticus_major_l"
    assert told["added"]["zygomaticus_major_l"] == pytest.approx(creases.min(), abs=1e-3)
    assert "k0 (mm)" in told["numbers"]
    dimple = int(np.argmin(frame["pattern_mine"]))
    assert probe(frame, face, sim.layers, *at(dimple))["made_by"] == "the pattern 'mine'"
