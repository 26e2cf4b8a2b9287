"""The meshes to try things on."""

from __future__ import annotations

import facewrinkle as fw


def test_the_pig_is_closed_and_turned_outwards():
    pig = fw.examples.load_pig()
    assert (pig.n_cells, pig.n_points - pig.n_cells // 2, pig.n_open_edges) == (16_000, 2, 0)  # Euler: a sphere
    assert pig.volume > 0


def test_each_call_makes_a_mesh_of_its_own():
    pig = fw.examples.load_pig()
    pig.points[:] = 0
    assert fw.examples.load_pig().length > 300
