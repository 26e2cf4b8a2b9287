"""A tear of a frame against the cheapest drawing of the same frame.

The drawing: 800 x 800 off screen, one headlight, one plain color, no anti-aliasing, the frame's own normals, nothing
read back. Goal: a tear takes less than a quarter of it, over a clip in which the face moves and the mesh is refined.
"""

from __future__ import annotations

import statistics

import numpy as np
import pytest

import facewrinkle as fw

FRAMES = 60


@pytest.fixture(scope="module")
def clip():
    """Frames of a face that becomes sad."""
    sim = fw.Simulation(fw.default_face())
    sim.express("sadness")
    return list(sim.run(FRAMES))


@pytest.mark.parametrize("kind", ["shed", "dripping"])
def test_frame(versus, clip, draw, notes, kind):
    """A tear from its first moment to its last."""
    face = fw.default_face()
    tear = fw.SheddingTear(face, start="l") if kind == "shed" else fw.DrippingTear(face, "l")
    moments = [*zip(np.linspace(tear.begin, tear.end, FRAMES), clip, strict=True)]
    meshes = [tear.surface(t, frame) for t, frame in moments[:: FRAMES // 6]]
    todo, drawn = iter(moments * 2), iter(clip * 2)
    versus(
        f"{kind} tear: frame, drawing",
        lambda: tear.surface(*next(todo)),
        lambda: draw(next(drawn)),
        4.0,
        FRAMES,
        2,
        statistics.fmean,
    )
    assert all(mesh.n_open_edges == 0 for mesh in meshes)
    notes[f"{kind} tear"] = f"{min(m.n_cells for m in meshes)} to {max(m.n_cells for m in meshes)} triangles"
