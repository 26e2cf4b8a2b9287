"""Shapes on the vertices of the mesh that was given.

what                         checked against
vertices that are kept       the rig, by their places
merged, unused, dropped ones what lies at their place; the nearest skin
eyes of the mesh itself      Kabsch's rotation about their centre
"""

import numpy as np
import pytest
import pyvista as pv
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import facewrinkle as fw

SHAPES = "jawOpen+eyeLookInLeft+mouthSmileLeft"


def written_as_obj(path, points, faces):
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in points]
    lines += ["f " + " ".join(str(v + 1) for v in face) for face in faces]
    path.write_text("\n".join(lines))
    return path


@pytest.fixture(scope="module")
def given(face, tmp_path_factory):
    """The built-in head with its vertices shuffled, the middle split, eyeballs without colors, and a loose point."""
    random = np.random.default_rng(3)
    points, faces = face.points, np.asarray(face.triangles, np.int64)
    left = (points[faces].mean(axis=1) @ face.frame.axes[0]) > 0.0
    seam = np.intersect1d(faces[left], faces[~left])
    twin = np.arange(len(points))
    twin[seam] = len(points) + np.arange(len(seam))
    faces = np.concatenate([faces[~left], twin[faces[left]]])
    points = np.concatenate([points, points[seam]])
    groups = [np.arange(len(points))]
    for eye in face.eyes:
        ball = pv.Sphere(radius=eye.radius, center=eye.centre, theta_resolution=16, phi_resolution=16)
        groups.append(len(points) + np.arange(ball.n_points))
        faces = np.concatenate([faces, len(points) + ball.regular_faces])
        points = np.concatenate([points, ball.points])
    points = np.concatenate([points, [face.landmarks["nose_tip"] + 200.0]])
    order = random.permutation(len(points))
    number = np.argsort(order)
    path = written_as_obj(tmp_path_factory.mktemp("given") / "head.obj", points[order], number[faces])
    with pytest.warns(fw.FaceWrinkleWarning):
        fitted = fw.fit_face(path, face.landmarks, units="mm")
    return path, fitted, [number[group] for group in groups], number[-1]


@pytest.fixture(scope="module")
def rig(given):
    return fw.rig(given[1], SHAPES, wrinkles="none", level=0)


@pytest.fixture(scope="module")
def shapes(given, rig):
    return fw.on_source(rig, given[0])


def test_vertices_have_the_displacements_of_the_rig_at_their_places(given, rig, shapes):
    skin = given[2][0]
    away, nearest = cKDTree(rig.parts["face"].points).query(shapes.points[skin])
    assert away.max() < 1e-6  # merged twins at the split middle, too
    np.testing.assert_allclose(shapes.deltas[:, skin], rig.deltas[:, nearest], atol=1e-6)
    assert np.linalg.norm(shapes.deltas[0, skin], axis=1).max() > 15.0
    assert shapes.names == rig.names
    assert shapes.unit == 1.0


def test_eyes_of_the_mesh_turn_by_their_own_vertices(given, shapes):
    _, face, (_, *balls), _ = given
    look = shapes.names.index("eyeLookInLeft")
    for eye, rows in zip(face.eyes, balls, strict=True):
        before, moved = shapes.points[rows], shapes.deltas[look, rows]
        if eye.side == "r":
            assert not moved.any()
            continue
        turn, off = Rotation.align_vectors(before + moved - eye.centre, before - eye.centre)
        assert off < 1.0  # mm over all points: what hardly moves is left out
        assert 20.0 < np.degrees(turn.magnitude()) < 35.0
        assert turn.apply(eye.gaze) @ face.frame.axes[0] < -0.3  # at the nose


def test_what_nothing_is_near_is_said(given, shapes):
    assert np.flatnonzero(~shapes.reached).tolist() == [given[3]]


def test_another_mesh_is_refused(rig):
    with pytest.raises(fw.errors.ParameterError, match="made of another mesh .*fit the face to this mesh"):
        fw.on_source(rig, pv.Sphere())


def test_arrays_are_saved_by_their_names(shapes, tmp_path):
    with np.load(shapes.save(tmp_path / "head.npz")) as stored:
        assert set(stored) == {"names", "points", "deltas", "reached", "unit"}
        np.testing.assert_array_equal(stored["deltas"], shapes.deltas)
        assert stored["names"].tolist() == list(shapes.names)


def test_a_mesh_without_texture_gets_the_chart_of_its_maps(given, shapes):
    assert shapes.chart is None
    made = fw.rig(given[1], "browInnerUp", wrinkles="maps")
    chart = fw.on_source(made, given[0]).chart
    model = made.parts["face"]
    skin = given[2][0]
    np.testing.assert_allclose(chart[skin], model.uv[cKDTree(model.points).query(shapes.points[skin])[1]], atol=1e-9)
