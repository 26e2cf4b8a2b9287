"""Meshes as they are drawn: the same triangles, those in front first, and nothing sent twice."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from drawing import SMALL, held

from facewrinkle.plotting import Scene, Style
from facewrinkle.plotting.drawn import FrontFirst, Joined, same


def faces_of(mesh):
    return {tuple(triangle) for triangle in mesh.regular_faces.tolist()}


def test_triangles_in_front_come_first_and_none_is_lost():
    ball, viewpoint = pv.Sphere(), np.array([3.0, -2.0, 1.0])
    drawn = FrontFirst().applied(ball, viewpoint)
    assert faces_of(drawn) == faces_of(ball)
    corners = np.asarray(drawn.points, float)[drawn.regular_faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    front = (normals * (viewpoint - corners[:, 0])).sum(axis=1) > 0.0
    assert 0.2 < front.mean() < 0.5
    assert front[: front.sum()].all()


def test_the_order_is_kept_while_the_triangles_are():
    """The very same object, which VTK then does not send again."""
    order, ball = FrontFirst(), pv.Sphere()
    first = order.applied(ball, np.array([0.0, 0.0, 3.0])).GetPolys()
    moved = ball.copy()
    moved.points += 0.1
    assert order.applied(moved, np.array([0.0, 0.0, 3.0])).GetPolys() is first
    assert order.applied(pv.Sphere(theta_resolution=12), np.array([0.0, 0.0, 3.0])).GetPolys() is not first


def test_same_meshes_look_the_same():
    ball = pv.Sphere()
    ball["paint"] = np.zeros((ball.n_points, 3), np.uint8)
    assert same(ball, ball.copy())
    for change in (lambda m: m.points.__iadd__(1e-3), lambda m: m["paint"].__iadd__(1), lambda m: m.clear_data()):
        other = ball.copy()
        change(other)
        assert not same(ball, other)
    other = ball.copy()
    other.rename_array("paint", "colour")
    assert not same(ball, other)
    assert not same(ball, pv.Sphere(theta_resolution=12))


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
