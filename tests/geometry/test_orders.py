"""Morton's curve on blocks of cells."""

from __future__ import annotations

import numpy as np
import pytest

from facewrinkle.geometry.orders import morton_order


@pytest.mark.parametrize("axes", [2, 3])
def test_cells_of_a_block_follow_each_other(axes):
    cells = np.stack(np.meshgrid(*[np.arange(8)] * axes, indexing="ij"), axis=-1).reshape(-1, axes)
    cells = np.random.default_rng(0).permutation(cells)
    order = morton_order(cells, bits=3)
    assert np.array_equal(np.sort(order), np.arange(len(cells)))
    for size in (2, 4):
        blocks = (cells[order] // size).reshape(-1, size**axes, axes)
        assert (blocks == blocks[:, :1]).all()


def test_equal_cells_keep_their_order():
    assert morton_order(np.zeros((5, 2), np.int64), bits=4).tolist() == [0, 1, 2, 3, 4]
