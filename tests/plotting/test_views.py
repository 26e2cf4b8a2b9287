"""Views: they look at the place of their name, from the side of their name, and show what they have to."""

import dataclasses

import numpy as np
import pytest
from drawing import SMALL, difference, held, on_screen

import facewrinkle as fw
from facewrinkle.errors import ParameterError, UnknownNameError
from facewrinkle.plotting import CLOSE, VIEWS, Scene, Style, View, closeup, picture


@pytest.mark.parametrize("name", [name for name in VIEWS if name.startswith("left")])
def test_views_of_the_two_sides_mirror_each_other(face, name):
    """With a light at the camera; the head is symmetric, the pores of its skin, hairs and irises are not."""
    half = face.texture[:, : face.texture.shape[1] // 2]
    even = dataclasses.replace(face, texture=np.concatenate([half, half[:, ::-1]], axis=1))
    left, right = (
        picture(face.mesh, even, Style(SMALL, view, quick=True, brows=False, eyes=False))
        for view in (name, name.replace("left", "right"))
    )
    assert (difference(left, right[:, ::-1]) > 20).mean() < 0.01
    assert (difference(left, right) > 20).mean() > 0.1
    assert VIEWS[name].mirrored().mirrored() == VIEWS[name]


def test_views_look_at_skin(face):
    with Scene(face, Style((80, 80))) as scene:
        empty = np.array(scene.plotter.screenshot(None, return_img=True).reshape(160, 160, 3)[72:88, 72:88])
        for name in CLOSE:
            scene.look(VIEWS[name])
            assert difference(empty[::2, ::2], scene.picture(face.mesh)[36:44, 36:44]).min() > 10, name


@pytest.mark.parametrize("size", [(100, 200), (200, 100)])
def test_upright_and_wide_pictures_hold_the_whole_head_and_cut_the_neck(face, size):
    points = np.asarray(face.mesh.points)
    head = points[points[:, 1] > face.landmarks["menton"][1]]
    with Scene(face, Style(size)) as scene:
        for view in ("front", "left_three_quarter", "left_profile"):
            scene.look(VIEWS[view])
            scene.draw(face.mesh)
            places = on_screen(scene, head)
            assert places.min() > 0, view
            assert (places < size[::-1]).all(), view


@pytest.mark.parametrize(
    "expression, expected",
    [
        ("paper_surprise", "forehead"),
        ("frowning", "glabella"),
        ("AU12L", "left_mouth"),
        ("AU43R", "right_eye"),
        *(
            pytest.param(*each, marks=pytest.mark.slow)
            for each in (("closing_eye", "left_eye"), ("stretching_mouth", "right_mouth"))
        ),
    ],
)
def test_closeup_is_where_the_wrinkles_are(face, expression, expected):
    assert closeup(held(expression), face) == expected


def test_closeup_without_wrinkles(face):
    *_, frame = fw.Simulation(face).run(1)
    assert closeup(frame, face) == "front"


def test_any_view(face):
    from_behind = picture(face.mesh, face, Style((60, 60), View((0.0, 0.0, -1.0))))
    assert difference(from_behind, picture(face.mesh, face, Style((60, 60)))).max() > 30


SIZES = (8, 100), (100, 10**5), (100.5, 100), (100,), 100, (np.nan, 100), ("a", "b")


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (lambda face: View((0.0, 0.0, 0.0)), ParameterError, "straight up"),
        (lambda face: View((0.0, 1.0, 0.0)), ParameterError, "straight up"),
        (lambda face: View((np.nan, 0.0, 1.0)), ParameterError, "straight up"),
        (lambda face: View((0.0, 0.0, 1.0), height=0.0), ParameterError, "height must lie in"),
        (lambda face: View((0.0, 0.0, 1.0), "nose"), UnknownNameError, "'nose'. Did you mean 'nose_tip'"),
        (lambda face: closeup(face.mesh, face), UnknownNameError, "unknown field 'W'"),
        (lambda face: Style(view="forhead"), UnknownNameError, "unknown view 'forhead'. Did you mean 'forehead'"),
        *((lambda face, size=size: Style(size=size), ParameterError, "width and height in pixels") for size in SIZES),
    ],
)
def test_views_and_sizes_that_cannot_be_drawn(face, call, error, says):
    with pytest.raises(error, match=says):
        call(face)
