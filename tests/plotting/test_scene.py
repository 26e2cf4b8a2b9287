"""Pictures of frames: what must differ differs where it must, and nothing else; no absolute pixel values."""

import gc

import numpy as np
import pytest
import pyvista as pv
from drawing import SMALL, difference, held, on_screen

from facewrinkle.errors import MeshError, ParameterError, UnknownNameError
from facewrinkle.mesh import ARRAYS
from facewrinkle.plotting import Scene, Style, picture, pictures
from facewrinkle.plotting.scene import BACKGROUND


@pytest.fixture(scope="module")
def wrinkled():
    return held("paper_surprise")


@pytest.fixture(scope="module")
def bare():
    return held("paper_surprise", wrinkles=False)


def test_wrinkles_show_on_the_forehead_and_nowhere_else(face, wrinkled, bare):
    with Scene(face, Style(SMALL)) as scene:
        images = [scene.picture(frame) for frame in (wrinkled, bare)]
        rows, columns = on_screen(scene, np.asarray(wrinkled.points)[np.abs(wrinkled["W"]) > 0.2]).T
    changed = difference(*images) > 8
    assert images[0].shape == (SMALL[1], SMALL[0], 3)
    assert images[0].dtype == np.uint8
    region = np.zeros(changed.shape, bool)
    region[int(rows.min()) - 3 : int(rows.max()) + 4, int(columns.min()) - 3 : int(columns.max()) + 4] = True
    assert changed[region].mean() > 0.05
    assert changed[~region].mean() < 0.002
    assert rows.max() < SMALL[1] / 2


def test_scene_shows_the_last_frame_and_forgets_the_others(face, wrinkled, bare):
    style = Style(SMALL, "forehead")
    alone = [picture(frame, face, style) for frame in (bare, wrinkled, face.mesh)]
    for expected, image in zip(alone, pictures([bare, wrinkled, face.mesh], face, style), strict=True):
        np.testing.assert_array_equal(image, expected)
    assert difference(alone[0], alone[1]).max() > 30
    assert difference(alone[0], alone[2]).max() > 30


def test_a_picture_is_its_cut_out_over_the_background(face, wrinkled):
    with Scene(face, Style(SMALL)) as scene:
        over = scene.picture(wrinkled).astype(float)
        cut = scene.cut_out(lambda: scene.picture(wrinkled)).astype(float)
        again = scene.picture(wrinkled)
    np.testing.assert_array_equal(over, again)
    opacity, up = cut[..., 3:] / 255.0, 1.0 - (np.arange(SMALL[1]) + 0.5)[:, None, None] / SMALL[1]
    low, high = (np.array(pv.Color(each).int_rgb) for each in BACKGROUND)
    assert np.abs(opacity * cut[..., :3] + (1.0 - opacity) * (low + up * (high - low)) - over).max() < 2.0
    assert 0.2 < (opacity == 1.0).mean() < 0.8
    assert not opacity[0].any()
    assert np.unique(opacity).size > 100  # edges, and the end of the bust


def test_clay_has_one_color_and_shows_the_same_form(face, wrinkled):
    """Hues differ less than those of skin, by the lamps alone; furrows show."""
    image = picture(wrinkled, face, Style(SMALL, clay=True)).astype(float)
    skin = image[image.sum(axis=2) > 250.0]
    hue = skin / skin.sum(axis=1, keepdims=True)
    colored = picture(wrinkled, face, Style(SMALL)).astype(float)
    many = colored[colored.sum(axis=2) > 250.0]
    assert hue.std(axis=0).max() < 0.6 * (many / many.sum(axis=1, keepdims=True)).std(axis=0).max()
    assert difference(image, picture(face.mesh, face, Style(SMALL, clay=True))).max() > 30


def test_stale_normals_are_not_trusted(face):
    moved = face.mesh.copy()
    moved.points[:, 2] += 6.0 * np.sin(moved.points[:, 1] / 4.0)
    stale = moved.copy()
    stale.point_data["Normals"] = face.mesh.compute_normals(split_vertices=False, consistent_normals=False).point_data[
        "Normals"
    ]
    style = Style(SMALL, brows=False)
    np.testing.assert_array_equal(picture(stale, face, style), picture(moved, face, style))
    assert difference(picture(moved, face, style), picture(face.mesh, face, style)).max() > 60


def test_wireframe_shows_more_edges_where_triangles_are_smaller(face, wrinkled):
    with Scene(face, Style((300, 300), "forehead", brows=False)) as scene:
        plain = scene.picture(wrinkled)
    with Scene(face, Style((300, 300), "forehead", wireframe=True, brows=False)) as scene:
        wired = scene.picture(wrinkled)
        fine = np.asarray(wrinkled.points)[np.asarray(wrinkled["level"]) == np.max(wrinkled["level"])]
        rows = on_screen(scene, fine)[:, 0]
    darker = difference(plain, wired) > 20
    inside = darker[int(max(rows.min(), 0)) : int(rows.max())]
    below = darker[int(rows.max()) + 20 :]
    assert inside.mean() > 1.3 * below.mean() > 0.0


@pytest.mark.parametrize("scalars", [None, "W"])
def test_drawing_changes_neither_frame_nor_face(face, wrinkled, fingerprint, scalars):
    before = fingerprint(wrinkled), fingerprint(face.mesh), list(wrinkled.field_data)
    active = wrinkled.active_scalars_name
    picture(wrinkled, face, Style((40, 40), wireframe=True, scalars=scalars))
    if scalars is None:
        picture(face.mesh, face, Style((40, 40)))
    assert (fingerprint(wrinkled), fingerprint(face.mesh), list(wrinkled.field_data)) == before
    assert wrinkled.active_scalars_name == active


@pytest.mark.slow
def test_plotters_are_closed(face, wrinkled):
    """Also after an error, and where the pictures of a movie are not all taken."""

    def count() -> int:
        gc.collect()
        return sum(not plotter._closed for plotter in pv.plotting.plotter._ALL_PLOTTERS.values())

    before = count()
    picture(wrinkled, face, Style((40, 40)))
    with pytest.raises(UnknownNameError):
        picture(face.mesh, face, Style((40, 40), scalars="W"))
    some = pictures([wrinkled, wrinkled], face, Style((40, 40)))
    next(some)
    some.close()
    assert count() == before


def test_frames_of_other_faces_are_refused(face):
    with pytest.raises(MeshError, match="Is it one of another face"):
        picture(pv.Sphere(), face, Style((40, 40)))


def test_a_picture_that_was_begun_is_that_of_its_frame_whatever_follows(face):
    with Scene(face, Style(SMALL)) as scene, Scene(face, Style(SMALL, "forehead")) as other:
        expected = [scene.picture(frame) for frame in (face.mesh, held("paper_surprise"))]
        first, beside = scene.begun(face.mesh), other.begun(face.mesh)
        np.testing.assert_array_equal(scene.begun(held("paper_surprise"))(), expected[1])
        np.testing.assert_array_equal(first(), expected[0])
        late = scene.begun(face.mesh)
        np.testing.assert_array_equal(beside(), other.picture(face.mesh))
    np.testing.assert_array_equal(late(), expected[0])


@pytest.mark.parametrize("quick", [True, False])
def test_a_camera_that_moves_shows_the_frame_from_there(face, quick):
    """Nothing of the frame is sent again but its eyes, and the picture is that of a new scene."""
    frame = held("paper_surprise")
    with Scene(face, Style(SMALL, quick=quick)) as scene, Scene(face, Style(SMALL, quick=quick)) as other:
        before = scene.picture(frame)
        shown = [actor for name, actor in scene.plotter.actors.items() if name != "eyes"]
        times = [actor.GetMapper().GetInput().GetMTime() for actor in shown]
        for plotter in (scene.plotter, other.plotter):
            plotter.camera.azimuth += 20.0
        after = scene.picture(frame)
        assert [actor.GetMapper().GetInput().GetMTime() for actor in shown] == times
        assert (after != before).any(axis=2).mean() > 0.2
        np.testing.assert_array_equal(after, other.picture(frame))


# --- fields in color -----------------------------------------------------------------------------


def test_fields_have_color(face):
    """Skin is lit the same; what differs from one field to the next is its colors. One scene can show them all."""
    wrinkled, images = held("paper_surprise"), {}
    with Scene(face, Style(SMALL, scalars="level")) as scene:
        for name in set(ARRAYS) - {"rest"}:
            scene.color_by(name)
            images[name] = scene.picture(wrinkled)
    for name, image in images.items():
        for other, another in images.items():
            assert name == other or (difference(image, another) > 10).mean() > 0.001
    for name in ("W", "muscle"):
        np.testing.assert_array_equal(picture(wrinkled, face, Style(SMALL, scalars=name)), images[name])
    colorful = np.ptp(images["W"].astype(int), axis=2)
    assert (np.asarray(wrinkled["W"]) < -0.3).any()
    assert colorful.max() > 60
    assert difference(images["W"], picture(face.mesh, face, Style(SMALL, brows=False))).max() > 60


def test_fields_that_cannot_be_drawn(face):
    wrinkled = held("paper_surprise")
    with pytest.raises(UnknownNameError, match="unknown field 'epsilom'. Did you mean 'epsilon'"):
        picture(wrinkled, face, Style((40, 40), scalars="epsilom"))
    with pytest.raises(ParameterError, match="one number per vertex; 'rest' has 3"):
        picture(wrinkled, face, Style((40, 40), scalars="rest"))
    with Scene(face, Style((40, 40))) as scene, pytest.raises(ParameterError, match="make it of a Style with scalars"):
        scene.color_by("W")
