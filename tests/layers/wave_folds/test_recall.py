"""Waves that are remembered, against those found anew.

what                     checked against
waves at points          the field itself, bit for bit, in any order and company
points seen before       the field is not asked for them again
many points              forgotten, and never remembered where they are more than there is room for
"""

from __future__ import annotations

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.layers.wave_folds import recall
from facewrinkle.layers.wave_folds.recall import Recall


@pytest.fixture(scope="module")
def scene():
    """The field of the built-in head, and 3,000 of the points on it at which triangles may be split."""
    sim = fw.Simulation(fw.default_face())
    sim.express("surprise")
    sim.settle()
    inner = np.flatnonzero(sim.vertices.corners[:, 0] != sim.vertices.corners[:, 1])
    return sim.layers[-1]._field, sim.vertices.taken(inner[:3000])


class Counting:
    """The field, and how many points it was asked for."""

    def __init__(self, field):
        self.field, self.points = field, 0

    def at(self, points):
        self.points += len(points.points)
        return self.field.at(points)


def same(waves, others):
    return all(np.array_equal(column, vars(others)[name]) for name, column in vars(waves).items())


def test_waves_are_those_found_anew(scene):
    field, points = scene
    counting = Counting(field)
    known, rng, seen = Recall(counting), np.random.default_rng(1), set()
    for size in (200, 1, 800, 1500, 2000, 3000, 3000):
        some = rng.choice(len(points.points), size, replace=False)
        asked = points.taken(some)
        assert len(field.at(asked).theta) > 0 or size == 1
        assert same(known.at(asked), field.at(asked))
        seen |= set(some.tolist())
        assert counting.points == len(seen)


def test_only_so_many_points_are_remembered(scene, monkeypatch):
    field, points = scene
    counting = Counting(field)
    known, first, all_points = Recall(counting), points.taken(np.arange(600)), len(points.points)
    monkeypatch.setattr(recall, "MOST", 1000)
    known.at(first)
    known.at(points.taken(np.arange(600, 1200)))  # no room beside the first, which are forgotten
    assert counting.points == 1200
    assert same(known.at(first), field.at(first))
    assert counting.points == 1800
    assert same(known.at(points), field.at(points))
    assert counting.points == 1800 + all_points
    assert same(known.at(first), field.at(first))  # they were not forgotten for points that are too many
    assert counting.points == 1800 + all_points
