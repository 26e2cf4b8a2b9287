"""The reports on performance, in which all measurements are, and on refinement, with its measures as they should be.

No test checks how fast it was.
"""

from itertools import pairwise

import numpy as np
import pytest

from analysis import performance
from analysis.performance import PAPER, Cost, exponents, measure
from analysis.refinement import Gap, at_equal_count, blind_spots, gap, smallest_angles
from analysis.surfaces import EXPRESSIONS, rates_of, settled, wrinkled_surface, wrinkling


def test_exponents_are_those_of_the_stages_and_skip_what_was_not_measured():
    rows = [Cost(n, n**0.25, 2.0 * n**1.5 if n < 5000 else np.nan, n, n, n, n**0.5) for n in (1000, 4000, 16000)]
    found = exponents(rows)
    assert found["skin"] == pytest.approx(0.25)
    assert found["whole_skin"] == pytest.approx(1.5)
    assert found["loop"] == pytest.approx(1.0)
    assert found["drawing"] == pytest.approx(0.5)


@pytest.mark.slow
def test_everything_is_measured(report):
    numbers = report("performance").numbers
    assert [row["expression"] for row in numbers["table1"]] == [row.expression for row in PAPER]
    costs = numbers["costs"]
    assert [row["triangles"] for row in costs] == [4517, 4 * 4517]
    for row in costs:
        assert all(row[stage] > 0.0 for stage in ("refinement", "wrinkles", "frame", "drawing"))
    assert all(np.isfinite([row["skin"], row["whole_skin"]]).all() for row in costs)
    forests = numbers["forest"]
    assert [row["triangles"] for row in forests] == [4517, 4 * 4517]
    for row in forests:
        assert 0.0 < row["held"] < row["peak"]
        assert min(row["split"], row["coarsen"]) > 0.0
    assert numbers["forest exponents"]["held"] == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_table_1_times_frames_that_are_rendered(face, monkeypatch):
    """Off screen, PyVista renders nothing before the first picture is taken."""
    rendered = []

    class Counted(performance.Scene):
        def draw(self, frame):
            self.plotter.render_window.AddObserver("EndEvent", lambda *_: rendered.append(frame.n_cells))
            super().draw(frame)
            self.plotter.render_window.RemoveObservers("EndEvent")

    monkeypatch.setattr(performance, "Scene", Counted)
    row = next(measure(face, iterations=3, drawings=3))
    assert row.fps == pytest.approx(3 / (row.Te + row.Ta + row.Tw + row.Tr))
    assert min(row.Tp, row.Te, row.Ta, row.Tw, row.Tr) > 0.0
    assert len(rendered) >= 3


# --- refinement ------------------------------------------------------------------------------------


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
        assert all(finer < 0.6 * coarser for coarser, finer in pairwise([g["distance"] for g in uniform]))
    for row in numbers["caught"].values():
        assert row["either"] >= max(row["Eq. 19"], row["wavelength"])
        missed = row["needed"] * (1.0 - row["either"] / 100.0)
        assert missed < max(0.15 * row["needed"], 4.5)  # a crease needs few edges; at most 8 of 59
