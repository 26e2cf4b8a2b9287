"""The wrinkles of Zhang, Sim and Tan as printed.

what                    checked against
heights                 Eqs. 3 to 18 and the loop of Section 4.3, written out for each vertex and muscle by itself
Eq. 9                   the weighted mean of the shortening of the edges, vertex by vertex
the atlas               the 23 muscles of Fig. 1, their kinds, and nothing that the paper does not have
Table 1                 the order of its expressions by triangles, each number within a fifth, by one gamma_c
directions              the normals of the undeformed surface
release                 heights stay, as printed; a new contraction adds to them
"""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from expressions import after

import facewrinkle as fw
from facewrinkle.anatomy.atlas import load_atlas, printed_atlas
from facewrinkle.errors import ParameterError
from facewrinkle.geometry.topology import vertex_rings

UNREFINED = fw.Refinement(max_level=0)

TABLE1 = {"surprise": 8245, "frowning": 5847, "closing_eye": 5395, "stretching_mouth": 6328, "fear": 7453}


@pytest.fixture(scope="module")
def printed(face):
    return face.with_atlas(printed_atlas())


def product(muscle, x):
    """H At at k0 = 1 of one point, and the direction of contraction, by the formulas of the paper; None outside."""
    style = muscle.wrinkles
    if isinstance(muscle, fw.LinearMuscle):
        a, to = np.asarray(muscle.attachment), np.asarray(muscle.insertion) - muscle.attachment
        phi = np.arccos(np.clip((x - a) @ to / np.linalg.norm(x - a) / np.linalg.norm(to), -1.0, 1.0))
        l, length = np.linalg.norm(x - a) * np.cos(phi), muscle.radius
        if phi > muscle.max_angle or not style.start <= l / length <= 1.0:
            return None
        w, u, start = l, (1.0 - style.start) * length / (2 * style.count), style.start * length  # Eqs. 5 and 6
        s, towards = (phi - style.core * muscle.max_angle) / ((1.0 - style.core) * muscle.max_angle), a - x
    elif isinstance(muscle, fw.SheetMuscle):
        a, i = np.asarray(muscle.attachment), np.asarray(muscle.insertion)
        fibre = (i.mean(0) - a.mean(0)) / np.linalg.norm(i.mean(0) - a.mean(0))
        line = a[1] - a[0] - ((a[1] - a[0]) @ fibre) * fibre
        l, h = (x - a.mean(0)) @ fibre, abs((x - a.mean(0)) @ line) / np.linalg.norm(line)
        if not style.start <= l / muscle.length <= 1.0 or h > 0.5 * muscle.width:  # Eq. 12
            return None
        w, u, start = l, (1.0 - style.start) * muscle.length / (2 * style.count), style.start * muscle.length
        s, towards = (h - style.core * 0.5 * muscle.width) / ((1.0 - style.core) * 0.5 * muscle.width), -fibre  # Eq. 13
    else:
        across, up = (x - muscle.centre) @ muscle.lateral, (x - muscle.centre) @ muscle.vertical
        r, psi = np.hypot(across / muscle.semi_major, up / muscle.semi_minor), np.arctan2(up, across)  # Eq. 14
        if not muscle.inner <= r <= 1.0 or not -muscle.beta1 <= psi <= muscle.beta2:
            return None
        w, u, start = psi, (muscle.beta1 + muscle.beta2) / (2 * style.count), -muscle.beta1  # Eq. 16
        band = 0.5 * (1.0 - style.core) * (1.0 - muscle.inner)
        s = max((muscle.inner + band - r) / band, (r - 1.0 + band) / band)  # Eqs. 17 and 18
        towards = across * np.asarray(muscle.vertical) - up * np.asarray(muscle.lateral)
    place = (w - start) % (2.0 * u)
    d = (2.0 ** (style.alpha + 1.0) - 1.0) / (2.0 * (style.alpha + 1.0))  # Eq. 7
    t = abs(place / u - 1.0)
    fade = 1.0 - 0.5 * (s + s**3) if s > 0.0 else 1.0  # Eqs. 11, 13, 17
    return (d - t * (1.0 + t * t) ** style.alpha) * fade, towards / np.linalg.norm(towards)  # Eq. 4


@pytest.mark.parametrize("expression", ["frowning", "surprise", "closing_eye"])
def test_heights_are_those_of_the_printed_loop(printed, expression):
    n, steps = 5, 8
    sim = fw.Simulation(printed, UNREFINED, layers=[fw.PrintedWrinkles(n)])
    sim.express(expression)
    rest, rings = printed.points, vertex_rings(printed.triangles, len(printed.points))
    expected = np.zeros(len(rest))
    for step in range(steps):
        frame = sim.step()
        moved = sim.skin.points + sim.skin.displacement
        for name, rate in zip(sim.muscles, sim.motion.rates, strict=True):
            muscle = printed.muscles[name]
            if rate == 0.0 or step >= n:
                continue
            for i in np.flatnonzero(muscle.wrinkling_region(rest) & np.isin(np.arange(len(rest)), printed.triangles)):
                height, towards = product(muscle, rest[i])
                near = rings[1][rings[0][i] : rings[0][i + 1]]
                length, now = (np.linalg.norm(x[near] - x[i], axis=1) for x in (rest, moved))
                weight = np.abs((rest[near] - rest[i]) @ towards) / length
                epsilon = (weight * (length - now) / length).sum() / weight.sum()  # Eqs. 8 and 9
                amplitude = np.cos(0.5 * pi * (1.0 - epsilon)) if epsilon >= 0.0 else 0.0  # Eq. 10
                expected[i] += muscle.wrinkles.depth * rate * height * amplitude / n  # Eq. 3
        np.testing.assert_allclose(frame["W"], expected, rtol=0, atol=1e-12)
    assert np.abs(expected).max() > 0.2


def test_wrinkles_go_along_the_normals_of_the_undeformed_surface(printed):
    sim = fw.Simulation(printed, UNREFINED, layers=[fw.PrintedWrinkles(20)])
    frame = after(sim, "surprise", 20)
    bare = sim.skin.points + sim.skin.displacement
    way = np.asarray(frame.points) - bare / printed.unit
    np.testing.assert_allclose(way, frame["W"][:, None] * sim.vertices.normals / printed.unit, rtol=0, atol=1e-6)
    assert np.abs(frame["W"]).max() > 0.2


def test_the_atlas_has_the_muscles_of_the_paper_and_nothing_else():
    atlas = printed_atlas()
    kinds = {name.removesuffix("_l"): entry["kind"] for name, entry in atlas.muscles.items() if name[-2:] != "_r"}
    assert kinds == {
        **dict.fromkeys(("frontalis_inner", "frontalis_major", "frontalis_outer"), "sheet"),
        **dict.fromkeys(("orbicularis_oculi", "orbicularis_oris"), "sphincter"),
        **dict.fromkeys(("corrugator", "nasalis", "zygomaticus_major", "zygomaticus_minor", "risorius"), "linear"),
        **dict.fromkeys(("depressor_anguli_oris", "mentalis"), "linear"),
    }
    assert len(atlas.muscles) == 23
    for entry in atlas.muscles.values():
        assert "folds" not in entry
        assert entry["wrinkles"]["ends"] == entry["wrinkles"]["falloff"] == "paper"
        assert not {"fronts", "taper", "waves"} & set(entry["wrinkles"])
    assert atlas.tissue == load_atlas().tissue


def test_one_switch_is_all(face):
    sim = fw.Simulation(face, folds="printed")
    assert len(sim.muscles) == 23
    assert [type(layer) for layer in sim.layers] == [fw.PrintedWrinkles]
    assert sim.refinement.samples == 0
    own = face.with_muscles({}).with_atlas(printed_atlas())
    assert fw.Simulation(own, folds="printed").face is own


@pytest.mark.slow
def test_triangles_of_table_1(face):
    """By Eq. 19 alone and one threshold: the paper's order, and each number within a fifth."""
    found = {}
    for expression in TABLE1:
        frame = after(fw.Simulation(face, folds="printed"), expression, 250)
        found[expression] = frame.n_cells
    assert sorted(found, key=found.get) == sorted(TABLE1, key=TABLE1.get)
    for expression, count in TABLE1.items():
        assert found[expression] == pytest.approx(count, rel=0.2), expression


def test_settling_takes_all_iterations(face):
    frames = []
    for way in ("settle", "run"):
        sim = fw.Simulation(face, UNREFINED, layers=[fw.PrintedWrinkles(30)])
        sim.express("surprise")
        frames.append(sim.settle() if way == "settle" else list(sim.run(30, ramp=1 / 3))[-1])
    np.testing.assert_array_equal(frames[0]["W"], frames[1]["W"])
    assert np.abs(frames[0]["W"]).max() > 0.1


def test_wrinkles_stay_after_release_and_a_new_contraction_adds(face):
    sim = fw.Simulation(face, UNREFINED, layers=[fw.PrintedWrinkles(2)])
    heights = []
    for _ in range(2):
        sim.express("surprise")
        heights.append([sim.step()["W"] for _ in range(4)][-1])
        sim.relax()
        released = [sim.step()["W"] for _ in range(3)][-1]
        np.testing.assert_array_equal(released, heights[-1])
    assert np.abs(heights[1]).max() > np.abs(heights[0]).max() > 0.05


@pytest.mark.parametrize("value", ["x", None, [1], -1, 0, 2.5, np.nan, np.inf])
def test_what_is_no_number_of_iterations_is_refused(value):
    with pytest.raises(ParameterError, match="iterations must"):
        fw.PrintedWrinkles(value)
