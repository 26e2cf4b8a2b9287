"""Pictures of frames, 800 x 800, against the cheapest drawing of the same frames; drawing as a movie does it.

The drawing: one headlight, one plain color, no anti-aliasing, the frame's own normals, nothing read back. A picture
has eyes, hair, texture and furrows, and is read back. Goals: a quick one takes at most twice as long, one as the README
shows it at most six times; a camera that turns about a frame that stands costs no more than rendering; the skin's
micro-relief costs less than a tenth of a close-up. What a graphics card does not do in software is far less than what
is measured here.
"""

from __future__ import annotations

import statistics

import pytest

import facewrinkle as fw
from facewrinkle.plotting import Scene, Style
from facewrinkle.plotting.images import rendered

FRAMES = 40
MODES = {"quick": (True, 1.0 / 2.0), "as shown": (False, 1.0 / 6.0)}


@pytest.fixture(scope="module")
def frames():
    """A surprise that comes: the mesh is refined, then keeps its triangles."""
    sim = fw.Simulation(fw.default_face())
    sim.express("paper_surprise")
    return list(sim.run(FRAMES))


@pytest.mark.parametrize("mode", MODES)
def test_picture(versus, frames, draw, mode):
    """Each picture is of another frame, so that nothing is kept from the one before."""
    quick, goal = MODES[mode]
    with Scene(fw.default_face(), Style(quick=quick)) as scene:
        shown, drawn = iter(frames * 2), iter(frames * 2)
        versus(
            f"picture {mode}, drawing",
            lambda: scene.picture(next(shown)),
            lambda: draw(next(drawn)),
            goal,
            FRAMES - 2,
            2,
            statistics.fmean,
        )


@pytest.mark.parametrize("mode", MODES)
def test_still(versus, frames, mode):
    """One frame from a camera that moves, against rendering alone."""
    with Scene(fw.default_face(), Style(quick=MODES[mode][0])) as scene:
        frame = frames[-1]
        scene.picture(frame)

        def turned():
            scene.plotter.camera.azimuth += 0.1
            return scene.picture(frame)

        def render():
            scene.plotter.camera.azimuth += 0.1
            return rendered(scene.plotter)

        versus(f"picture {mode}, only the camera moves: picture, rendering", turned, render, 1.0 / 1.1, 20, 2)


@pytest.mark.parametrize("view", ["cheeks", "left_eye"])
def test_microrelief(versus, frames, view):
    """Close-ups with pores and fine furrows, against those without."""
    face = fw.default_face()
    with Scene(face, Style(view=view)) as scene, Scene(face, Style(view=view, microrelief=False)) as plain:
        shown, drawn = iter(frames * 2), iter(frames * 2)
        what = f"{view} with micro-relief, without"
        versus(
            what, lambda: scene.picture(next(shown)), lambda: plain.picture(next(drawn)), 1.0 / 1.1, FRAMES - 2, 2
        )  # fmt: skip


def test_second_scene(versus, frames, notes):
    """A close-up beside the whole face: what the frame shows is worked out once."""
    face = fw.default_face()
    with Scene(face, Style(quick=True)) as first, Scene(face, Style(view="forehead", quick=True)) as second:
        shown = iter(frames * 2)
        todo = []

        def whole():
            todo[:] = [next(shown)]
            first.show(todo[0])

        def close():
            second.show(todo[0])

        whole()
        versus("a second scene of a frame: shown, first scene", close, whole, 3.0, FRAMES - 4, 2)
