"""One step of the skin against one semi-implicit step in plain numpy and scipy.

The reference is the usual one (Baraff and Witkin) with the stiffness at rest: forces by numpy, and one call of spsolve a
step for all 3 n coordinates, so that the matrix is factored in every step. The skin factors one matrix per coordinate
when it is made, keeps springs biphasic and triangles from folding, stays off bone and eyes, and iterates.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from scipy.sparse import block_array, csr_array, diags_array, eye_array, kron
from scipy.sparse.linalg import spsolve

import facewrinkle as fw
from facewrinkle.geometry.refinement import RedGreenForest
from facewrinkle.geometry.transfer import carried
from facewrinkle.mesh import to_polydata

SMILE = {"zygomaticus_major_l": 0.5, "zygomaticus_major_r": 0.5}
ROUNDS = {"built-in": 40, "25k vertices": 3}


@lru_cache(maxsize=1)
def skin_of(size):
    face = fw.default_face()
    if size == "built-in":
        return fw.Skin(face)
    forest = RedGreenForest(face.triangles, 2)
    forest.split(np.ones(len(face.triangles), bool))
    forest.split(np.arange(len(forest.triangles)) < 0.55 * len(forest.triangles))
    points = carried(face.points, forest.corners, forest.barycentric)
    return fw.Skin(fw.fit_face(to_polydata(points, forest.triangles), face.landmarks, face.unit))


class Reference:
    """u and v after one linearly implicit step: (M (1 + 2 d w h) / h^2 + K) (u1 - u0) = M v / h - K u0 + f."""

    def __init__(self, skin):
        n, m, h = len(skin.points), skin.material, skin.time_step
        i, j = skin._edges.T
        along = skin._rest / skin._length[:, None]
        outer = skin._stiffness[:, None, None] * along[:, :, None] * along[:, None, :]
        self.normals, self.outer = skin._normals, np.abs(outer)
        ties = (skin._across - skin._along)[:, None, None] * skin._normals[:, :, None] * skin._normals[:, None, :]
        ties += skin._along[:, None, None] * np.eye(3)
        v = np.arange(n)
        blocks = [[None] * 3 for _ in range(3)]
        rows, columns = np.concatenate([i, j, i, j, v]), np.concatenate([i, j, j, i, v])
        for a in range(3):
            for b in range(3):
                o = outer[:, a, b]
                values = np.concatenate([o, o, -o, -o, ties[:, a, b]])
                blocks[a][b] = csr_array((values, (rows, columns)), shape=(n, n))
        stiffness = block_array(blocks) + kron(eye_array(3), skin._bending)
        self.mass = np.tile(skin._mass, 3) / h
        inertia = self.mass * (1.0 + 2.0 * m.damping * m.rate * h) / h
        self.stiffness, self.h = csr_array(stiffness), h
        self.matrix = (stiffness + diags_array(inertia)).tocsc()

    def step(self, u, v, force):
        right = self.mass * v.T.ravel() - self.stiffness @ u.T.ravel() + force.T.ravel()
        change = spsolve(self.matrix, right).reshape(3, -1).T
        return u + change, change / self.h


@pytest.mark.parametrize("size", ROUNDS)
def test_step(versus, size):
    skin = skin_of(size)
    skin.reset()
    reference = Reference(skin)
    skin.contract(SMILE)
    skin.step()
    expected, _ = reference.step(np.zeros_like(skin.points), np.zeros_like(skin.points), skin._force)
    assert np.linalg.norm(skin.displacement - expected) < 0.2 * np.linalg.norm(expected), "both move the same way"
    moving = [np.zeros_like(skin.points), np.zeros_like(skin.points)]

    def step():
        moving[:] = reference.step(*moving, skin._force)

    versus(f"skin step, {size} ({len(skin.points)})", skin.step, step, rounds=ROUNDS[size])
