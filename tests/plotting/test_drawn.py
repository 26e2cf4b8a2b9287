"""Meshes as they are drawn: nothing is sent twice."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from drawing import SMALL, held

from facewrinkle.plotting import Scene, Style
from facewrinkle.plotting.drawn import Joined


def test_joined_meshes_are_those_side_by_side_and_only_what_changed_is_sent():
    ball = pv.Sphere().compute_normals(split_vertices=False)
    ball["paint"] = np.arange(3 * ball.n_points).reshape(-1, 3).astype(np.uint8)
    moved, joined = ball.copy(), Joined()
    moved.points += 1.0
    joined.show([ball, moved])
    both = pv.merge([ball, moved], merge_points=False)
    np.testing.assert_array_equal(joined.mesh.points, both.points)
    np.testing.assert_array_equal(joined.mesh.regular_faces, both.regular_faces)
    np.testing.assert_array_equal(joined.mesh["paint"], both["paint"])

    def sent():
        mesh = joined.mesh
        return mesh.GetPoints(), mesh.GetPolys(), *(mesh.GetPointData().GetArray(name) for name in Joined.ARRAYS)

    before = sent()
    painted = moved.copy()
    painted["paint"] = 255 - moved["paint"]
    joined.show([ball.copy(), painted])
    assert [one is other for one, other in zip(sent(), before, strict=True)] == [True, True, True, False]
    np.testing.assert_array_equal(joined.mesh["paint"][ball.n_points :], painted["paint"])
    joined.show([ball])
    np.testing.assert_array_equal(joined.mesh.regular_faces, ball.regular_faces)


@pytest.mark.parametrize("quick", [True, False])
def test_a_camera_that_moves_shows_the_frame_from_there(face, quick):
    """Nothing of the frame is sent again, and the picture is that of a new scene."""
    frame = held("surprise")
    with Scene(face, Style(SMALL, quick=quick)) as scene, Scene(face, Style(SMALL, quick=quick)) as other:
        before = scene.picture(frame)
        times = [actor.mapper.dataset.GetMTime() for actor in scene.plotter.actors.values()]
        for plotter in (scene.plotter, other.plotter):
            plotter.camera.azimuth += 20.0
        after = scene.picture(frame)
        assert [actor.mapper.dataset.GetMTime() for actor in scene.plotter.actors.values()] == times
        assert (after != before).any(axis=2).mean() > 0.2
        np.testing.assert_array_equal(after, other.picture(frame))
