"""The report on refinement, and its measures against what they should be."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from analysis.performance import PAPER
from analysis.refinement import Gap, at_equal_count, blind_spots, gap, smallest_angles
from analysis.surfaces import EXPRESSIONS, rates_of, settled, wrinkled_surface, wrinkling


def test_smallest_angles_of_known_triangles():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, np.sqrt(0.75), 0]])
    assert smallest_angles(points, np.array([[0, 1, 2], [0, 1, 3]])) == pytest.approx([45.0, 60.0])


def test_a_mesh_is_not_off_itself(face):
    sim = settled(face, "frowning", 20)
    fine = wrinkled_surface(sim, wrinkling(face, rates_of(sim), 2))
    same = gap(fine, fine)
    assert same.distance < 1e-6
    assert same.angle < 0.1
    assert gap(wrinkled_surface(sim, wrinkling(face, rates_of(sim), 0)), fine).distance > 0.02


def test_equal_counts_are_read_off_straight_lines():
    uniform = [Gap(100, 1.0, 0.0, 0.0), Gap(400, 0.25, 0.0, 0.0), Gap(1600, 0.0625, 0.0, 0.0)]
    same, needed = at_equal_count({"uniform": uniform}, Gap(200, 0.125, 0.0, 0.0))
    assert same == pytest.approx(0.5)
    assert needed == pytest.approx(800.0)


def test_eq_19_is_blind_at_u_and_2_u():
    seen = blind_spots(np.array([0.5, 1.0, 2.0]), 1)[:, 0]
    assert seen[0] > 0.03
    assert seen[1:] == pytest.approx([0.0, 0.0], abs=1e-12)


def smallest_of_halves(points, triangles):
    """The smallest angle, in degrees, that is left where one side of any triangle is halved."""
    sides = [np.roll(triangles, k, axis=1) for k in range(3)]
    whole = np.concatenate([points[side] for side in sides])
    middle = whole[:, :2].mean(axis=1)
    halves = [np.stack([whole[:, k], middle, whole[:, 2]], axis=1) for k in range(2)]
    corners = np.concatenate(halves)
    return smallest_angles(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)).min()


@pytest.mark.slow
def test_refinement_pays(report, face):
    numbers = report("refinement").numbers
    least = smallest_of_halves(face.points, face.triangles)  # quarters have the angles of the whole
    paper = dict(zip(EXPRESSIONS, PAPER, strict=True))
    for name, count in numbers["triangles"].items():
        assert count == pytest.approx(paper[name].after, rel=0.15)
        assert numbers["released"][name] == 4517
        assert min(numbers["angles"][name]) >= least - 1e-9
    for pair in numbers["gaps"].values():
        adaptive, uniform = pair["adaptive"], pair["uniform"]
        for few, many in zip(adaptive[1:], uniform[1:], strict=True):
            assert few["triangles"] < 0.4 * many["triangles"]
            assert few["distance"] < 1.1 * many["distance"]
            assert few["angle"] < 1.05 * many["angle"]
        distances = [g["distance"] for g in uniform]
        assert all(finer < 0.6 * coarser for coarser, finer in pairwise(distances))
    for row in numbers["caught"].values():
        assert row["either"] >= max(row["Eq. 19"], row["wavelength"])
        missed = row["needed"] * (1.0 - row["either"] / 100.0)
        assert missed < max(0.15 * row["needed"], 4.5)  # a crease needs few edges; at most 8 of 59
