"""The report on performance: all measurements are there. No test checks how fast it was."""

from __future__ import annotations

import numpy as np
import pytest

from analysis import performance
from analysis.performance import PAPER, Cost, exponents, measure


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
