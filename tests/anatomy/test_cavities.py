"""Mouth and nostrils: their inside is known from the front, is dark, has teeth, and has no bone in front of it.

The built-in head's mouth is an opening; closed with a pocket of skin, as most heads of games are, it is a bag.
"""

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.anatomy.cavities import BACK_OF_MOUTH, INSIDE_DEPTH, Cavities
from facewrinkle.anatomy.head import HAIR_COLOR
from facewrinkle.appearance.mouth import Mouth
from facewrinkle.appearance.seen import companion_meshes
from facewrinkle.appearance.skin_paint import SHAVED, SkinPainter, complexion


@pytest.fixture(scope="module")
def bagged(face) -> fw.Face:
    """The built-in head with a pocket of skin behind its lips; its vertices come first, the pocket's after them."""
    loop, pocket = Mouth(face).loop, Mouth(face).pocket(face.points)
    number = np.concatenate([loop, face.mesh.n_points + np.arange(pocket.n_points - len(loop))])
    mesh = fw.mesh.to_polydata(
        np.concatenate([face.points, pocket.points[len(loop) :]]),
        np.concatenate([face.triangles, number[pocket.regular_faces]]),
    )
    return fw.Face.from_landmarks(mesh, face.landmarks, 1.0)


def pocket_of(bagged: fw.Face, face: fw.Face) -> np.ndarray:
    return np.arange(bagged.mesh.n_points) >= face.mesh.n_points


def test_depth_is_that_behind_the_lips(face):
    """Straight behind where the lips meet it grows as fast as the way, up to the other side of the head."""
    lips = 0.5 * (face.landmarks["mouth_l"] + face.landmarks["mouth_r"])
    way = np.linspace(10.0, 60.0, 6)
    depth = face.cavities.depth(lips * [0, 1, 1] - np.outer(way, face.frame.axes[2]))
    scale = 63.0 / face.frame.pupil_distance
    np.testing.assert_allclose(np.diff(depth), scale * np.diff(way), atol=1e-6)
    assert face.cavities.depth(lips[None] - 1.3 * BACK_OF_MOUTH * face.frame.axes[2])[0] == 0.0


def test_outer_skin_is_not_inside(face):
    names = [name for name in face.landmarks if not name.endswith("centre")]
    depth = face.cavities.depth(np.array([face.landmarks[name] for name in names]))
    assert depth.max() < INSIDE_DEPTH
    assert not depth[[names.index(n) for n in ("malar_l", "glabella", "zygion_r", "menton")]].any()


def test_skin_under_the_jaw_beside_the_mouth_is_not_inside(face):
    """Where the jaw rises steeply beside the chin it lies higher than that, behind what is seen from the front."""
    lower = face.landmarks | {"menton": face.landmarks["menton"] - 20.0 * face.frame.axes[1]}
    cavities = Cavities(face.points, face.triangles, lower, face.frame)
    below = cavities.depth(face.points) > face.cavities.depth(face.points) + INSIDE_DEPTH
    assert below.sum() > 4
    other = fw.Face.from_landmarks(face.mesh, lower, 1.0)
    np.testing.assert_array_equal(other.lining.vertices, face.lining.vertices)
    colors = SkinPainter(other)(face.points)[below]
    assert colors.min() > 70
    assert SkinPainter(other)(face.landmarks["lower_lip_mid"][None] - 30.0 * face.frame.axes[2]).max() < 70


def test_depth_goes_with_the_face(face):
    """Turned, scaled and moved, the same places are as deep."""
    turn = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    moved = {name: 0.1 * turn @ place + [3.0, -2, 5] for name, place in face.landmarks.items()}
    there = 0.1 * face.points @ turn.T + [3.0, -2, 5]
    other = Cavities(there, face.triangles, moved, fw.anatomy.landmarks.frame_of(moved))
    np.testing.assert_allclose(other.depth(there), face.cavities.depth(face.points), atol=1e-3)


def test_the_lining_is_the_pocket(bagged, face):
    inside, pocket = bagged.lining.vertices, pocket_of(bagged, face)
    assert inside[pocket].mean() > 0.95
    assert inside[~pocket].mean() < 0.05
    marks = [
        bagged.mesh.find_closest_point(bagged.landmarks[n]) for n in ("nose_tip", "pogonion", "malar_l", "glabella")
    ]
    assert not inside[marks].any()


def test_the_pocket_is_dark_and_the_face_is_not(bagged, face):
    paint, pocket = SkinPainter(bagged)(bagged.points).astype(float), pocket_of(bagged, face)
    deep = pocket & (bagged.cavities.depth(bagged.points) > 20.0)
    assert deep.sum() > 30
    assert paint[deep].max() < 60.0
    for name in ("malar_l", "pogonion", "glabella", "nose_tip", "mouth_l"):
        assert SkinPainter(bagged)(bagged.landmarks[name][None]).astype(float).mean() > 100.0


def test_whole_heads_alone_are_shaved(face):
    crown = face.frame.origin + np.array([[0.0, 90.0, -70.0]])
    bare = complexion(crown, face.landmarks, face.frame)
    np.testing.assert_allclose(SkinPainter(face)(crown), bare + SHAVED * (HAIR_COLOR - bare), atol=1.0)
    front = face.triangles[(face.points[:, 2] > face.landmarks["zygion_l"][2] - 20.0)[face.triangles].all(axis=1)]
    mask = fw.Face.from_landmarks(pv.PolyData.from_regular_faces(face.points, front).clean(), face.landmarks, 1.0)
    np.testing.assert_allclose(SkinPainter(mask)(crown), bare, atol=1.0)


def test_a_bag_has_teeth_when_the_lips_part(bagged):
    mouth = Mouth(bagged)
    assert mouth.bag
    assert not len(mouth.loop)
    assert not mouth.parted(bagged.points)
    weights, opened = bagged.joint_weights["jaw"], bagged.mesh.copy()
    opened.points[weights.vertices] += weights.turned(bagged.points, 0.7)
    assert mouth.parted(np.asarray(opened.points, dtype=np.float64))
    parts = companion_meshes(bagged, opened)
    assert {"upper_teeth", "lower_teeth", "tongue"} <= set(parts)
    assert "mouth" not in parts  # the bag is there already
