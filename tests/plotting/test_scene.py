"""Pictures: what must differ differs where it must, and nothing else; no absolute pixel values."""

from __future__ import annotations

import dataclasses
import gc

import matplotlib.pyplot as plt
import numpy as np
import pytest
import pyvista as pv
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from facewrinkle.anatomy.fitting import fitted_brows
from facewrinkle.anatomy.landmarks import lips_middle
from facewrinkle.appearance.eye import PaintedEye
from facewrinkle.appearance.hair import Brows, Lashes
from facewrinkle.appearance.mouth import Mouth
from facewrinkle.errors import MeshError, OutputError, ParameterError, UnknownNameError
from facewrinkle.mesh import ARRAYS
from facewrinkle.plotting import (
    CLOSE,
    VIEWS,
    Scene,
    Style,
    View,
    closeup,
    figure,
    picture,
    pictures,
    save_picture,
    side_by_side,
    stacked,
)
from facewrinkle.plotting.shaders import cavity_shading

SMALL = (160, 200)


def margins_of(face, side):
    """The vertices of the upper and the lower margin."""
    opening = face.eyelid_openings[side]
    return opening.upper, opening.lower


def held(face: fw.Face, expression: str, **options: object) -> pv.PolyData:
    simulation = fw.Simulation(face, **options)
    simulation.express(expression)
    *_, frame = simulation.run(15)
    return frame


@pytest.fixture(scope="module")
def face() -> fw.Face:
    return fw.default_face()


@pytest.fixture(scope="module")
def wrinkled(face):
    return held(face, "surprise")


@pytest.fixture(scope="module")
def bare(face):
    return held(face, "surprise", layers=[])


def difference(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Per pixel, the largest difference of the channels."""
    return np.abs(first.astype(int) - second.astype(int)).max(axis=2)


def fingerprint(mesh: pv.PolyData) -> dict[str, bytes]:
    arrays = {**mesh.point_data, **mesh.cell_data, "points": mesh.points, "faces": mesh.faces}
    return {name: np.asarray(values).tobytes() for name, values in arrays.items()}


def on_screen(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Pixels [row, column] of points, as VTK's own camera projects them."""
    width, height = scene.style.size
    matrix = scene.plotter.camera.GetCompositeProjectionTransformMatrix(width / height, -1, 1)
    projection = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
    clip = np.column_stack([points, np.ones(len(points))]) @ projection.T
    x, y = (clip[:, :2] / clip[:, 3:]).T
    return np.column_stack([(1 - y) / 2 * height, (x + 1) / 2 * width])


def test_wrinkles_show_on_the_forehead_and_nowhere_else(face, wrinkled, bare):
    style = Style(SMALL)
    with Scene(face, style) as scene:
        images = [scene.picture(frame) for frame in (wrinkled, bare)]
        lifted = np.asarray(wrinkled.points)[np.abs(wrinkled["W"]) > 0.1]
        rows, columns = on_screen(scene, lifted).T
    changed = difference(*images) > 8
    assert images[0].shape == (SMALL[1], SMALL[0], 3)
    assert images[0].dtype == np.uint8
    region = np.zeros(changed.shape, bool)
    region[int(rows.min()) - 3 : int(rows.max()) + 4, int(columns.min()) - 3 : int(columns.max()) + 4] = True
    assert changed[region].mean() > 0.1
    assert changed[~region].mean() < 0.002
    assert rows.max() < SMALL[1] / 2


def test_scene_shows_the_last_frame_and_forgets_the_others(face, wrinkled, bare):
    style = Style(SMALL, "forehead")
    alone = [picture(frame, face, style) for frame in (bare, wrinkled, face.mesh)]
    one_scene = list(pictures([bare, wrinkled, face.mesh], face, style))
    for expected, image in zip(alone, one_scene, strict=True):
        np.testing.assert_array_equal(image, expected)
    assert difference(alone[0], alone[1]).max() > 30
    assert difference(alone[0], alone[2]).max() > 30


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


@pytest.mark.parametrize("name", CLOSE)
def test_views_look_at_skin(face, name):
    with Scene(face, Style((80, 80), name)) as scene:
        empty = np.array(scene.plotter.screenshot(None, return_img=True).reshape(160, 160, 3)[72:88, 72:88])
        centre = scene.picture(face.mesh)[36:44, 36:44]
    assert difference(empty[::2, ::2], centre).min() > 10


@pytest.mark.parametrize("view", ["front", "left_three_quarter", "left_profile"])
def test_upright_and_wide_pictures_hold_the_whole_head_and_cut_the_neck(face, view):
    points = np.asarray(face.mesh.points)
    head = points[:, 1] > face.landmarks["menton"][1]
    for size in ((100, 200), (200, 100)):
        with Scene(face, Style(size, view=view)) as scene:
            scene.draw(face.mesh)
            row, column = on_screen(scene, points).T
        assert row[head].min() > 0
        assert row[head].max() < size[1]
        assert column[head].min() > 0
        assert column[head].max() < size[0]


@pytest.mark.parametrize(
    "expression, expected",
    [
        ("surprise", "forehead"),
        ("frowning", "glabella"),
        ("closing_eye", "left_eye"),
        ("stretching_mouth", "right_mouth"),
        ("AU12L", "left_mouth"),
        ("AU43R", "right_eye"),
    ],
)
def test_closeup_is_where_the_wrinkles_are(face, expression, expected):
    assert closeup(held(face, expression), face) == expected


def test_closeup_without_wrinkles(face):
    *_, frame = fw.Simulation(face).run(1)
    assert closeup(frame, face) == "front"


def test_fields_have_colour(face, wrinkled):
    """Skin is lit the same; what differs from one field to the next is its colours."""
    images = {name: picture(wrinkled, face, Style(SMALL, scalars=name)) for name in ARRAYS if name != "rest"}
    for name, image in images.items():
        for other, another in images.items():
            assert name == other or (difference(image, another) > 10).mean() > 0.001
    colourful = np.ptp(images["W"].astype(int), axis=2)
    furrows = np.asarray(wrinkled["W"]) < -0.3
    assert furrows.any()
    assert colourful.max() > 60
    rest = picture(face.mesh, face, Style(SMALL, brows=False))
    assert difference(images["W"], rest).max() > 60


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


@pytest.mark.parametrize("scalars", [None, "W", "muscle", "level"])
def test_drawing_changes_neither_frame_nor_face(face, wrinkled, scalars):
    before = fingerprint(wrinkled), fingerprint(face.mesh), list(wrinkled.field_data)
    active = wrinkled.active_scalars_name
    picture(wrinkled, face, Style((40, 40), wireframe=True, scalars=scalars))
    if scalars is None:
        picture(face.mesh, face, Style((40, 40)))
    assert (fingerprint(wrinkled), fingerprint(face.mesh), list(wrinkled.field_data)) == before
    assert wrinkled.active_scalars_name == active


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


def test_unknown_views_fields_and_sizes(face, wrinkled):
    with pytest.raises(UnknownNameError, match="unknown view 'forhead'. Did you mean 'forehead'"):
        Style(view="forhead")
    with pytest.raises(UnknownNameError, match="unknown field 'epsilom'. Did you mean 'epsilon'"):
        picture(wrinkled, face, Style((40, 40), scalars="epsilom"))
    with pytest.raises(ParameterError, match="one number per vertex; 'rest' has 3"):
        picture(wrinkled, face, Style((40, 40), scalars="rest"))
    for size in ((8, 100), (100, 10**5), (100.5, 100), (100,), 100, (np.nan, 100), ("a", "b")):
        with pytest.raises(ParameterError, match="width and height in pixels"):
            Style(size=size)


def test_any_view(face):
    from_behind = picture(face.mesh, face, Style((60, 60), View((0.0, 0.0, -1.0))))
    assert difference(from_behind, picture(face.mesh, face, Style((60, 60)))).max() > 30


def test_furrows_are_dark_and_dimples_are_not():
    """A furrow and a round pit, equally deep and wide, with as many vertices across as refinement gives them."""
    x, y = np.meshgrid(np.linspace(-8.0, 8.0, 21), np.linspace(-8.0, 8.0, 21))
    turn = Rotation.from_rotvec([0.4, 0.7, -0.2]).as_matrix()
    darkest = []
    for distance in (np.abs(x), np.hypot(x, y), np.hypot(x, y + 100.0)):
        plane = pv.StructuredGrid(x, y, 0.0 * x).extract_surface(algorithm=None).triangulate()
        plane.point_data["rest"] = plane.points @ turn.T
        plane.point_data["W"] = -np.exp(-((distance.T.ravel() / 2.0) ** 2))
        shade = cavity_shading(plane)
        assert shade.shape == (plane.n_points, 3)
        darkest.append(255 - int(shade[:, 1].min()))
        assert (shade[:, 0] >= shade[:, 1]).all()
        assert (shade[plane["W"] > -1e-3] == 255).all()
    assert darkest[0] > 80
    assert darkest[1] < 0.25 * darkest[0]
    assert darkest[2] == 0


def test_parted_lips_show_the_dark_of_the_mouth(face):
    """Not what is behind the head: the picture between the lips is darker than the background and reddish."""
    parted = face.mesh.copy()
    lower = (np.asarray(parted.points) - face.landmarks["lower_lip_mid"]) / 12.0
    parted.points[:, 1] -= 8.0 * np.exp(-(lower**2).sum(axis=1))
    with Scene(face, Style((200, 200), "mouth")) as scene:
        image = scene.picture(parted)
        gap = lips_middle(face.landmarks) - [0, 2, 0]
        row, column = on_screen(scene, gap[None])[0].astype(int)
    red, _, blue = image[row - 8 : row + 9, column].astype(int).T
    assert (red >= blue).all()


def test_teeth_show_behind_an_open_mouth_and_go_with_the_jaw(face):
    opened = held(face, "AU27")
    mouth = Mouth(face)
    base = np.asarray(opened.points)[: face.mesh.n_points]
    assert not mouth.parted(face.points)
    assert mouth.parted(base)
    jaw, guide = face.muscles["jaw"], face.joint_weights["jaw"]
    turned = face.points.copy()
    turned[guide.vertices] += guide.turned(face.points, 0.7)
    expected = Rotation.from_rotvec(0.7 * jaw.angle * jaw.axis)
    upper, lower = (mouth.inside(turned)[name].points for name in ("upper_teeth", "lower_teeth"))
    np.testing.assert_allclose(upper, mouth.teeth[0].points, atol=1e-4)
    np.testing.assert_allclose(lower, expected.apply(mouth.teeth[1].points - jaw.hinge) + jaw.hinge, atol=0.1)
    parts = mouth.inside(base)
    with Scene(face, Style((240, 240), "mouth")) as scene:
        images = [scene.picture(frame).astype(int) for frame in (opened, face.mesh)]
        # The edges of the lower incisors, where the lip does not hide them.
        tips = parts["lower_teeth"].points
        tips = tips[(np.abs(tips[:, 0]) < 6.0) & (tips[:, 2] > tips[:, 2].max() - 8.0)]
        rows, columns = on_screen(scene, tips[tips[:, 1] > tips[:, 1].max() - 1.0]).astype(int).T
        assert not any(scene.plotter.actors[name].visibility for name in Mouth.INSIDE)
    white = [(np.ptp(image, axis=2) < 50) & (image.min(axis=2) > 90) for image in images]
    assert white[0][rows, columns].mean() > 0.25
    assert not white[1][rows, columns].any()


def blink(face: fw.Face) -> np.ndarray:
    """Base points with both eyes closed."""
    return np.asarray(held(face, "AU43").points)[: face.mesh.n_points]


def test_lashes_stay_on_the_margins_of_the_lids(face):
    """Within the thickness of a lid, open and closed; the upper ones come down with theirs."""
    open_eyes, closed = face.points, blink(face)
    for eye in face.eyes:
        lashes = Lashes(eye, face, 0.1)
        margins = margins_of(face, eye.side)
        heights = []
        for points in (open_eyes, closed):
            tips = lashes.at(points).points.reshape(-1, Lashes.KNOTS, 2, 3).mean(axis=2)
            counts = [len(weights) for _, weights in lashes.roots]
            for hairs, chain in zip(np.split(tips, counts[:1]), margins, strict=True):
                fine = np.concatenate(
                    [np.linspace(a, b, 30) for a, b in zip(points[chain][:-1], points[chain][1:], strict=True)]
                )
                gap = np.linalg.norm(hairs[:, 0, None] - fine, axis=2).min(axis=1)
                assert gap.max() < 2.0
                length = np.linalg.norm(np.diff(hairs, axis=1), axis=2).sum(axis=1)
                assert 0.5 < length.min() < length.max() < 10.0
                # Outside of the eyeball along all their length.
                assert np.linalg.norm(hairs - eye.centre, axis=2).min() > eye.radius
            heights.append(tips[: counts[0], 0, 1].mean())
        assert heights[0] - heights[1] > 4.0


def _moved_brow(face, by):
    """How far the roots of the left brow's hairs move, in the mean of each tenth of its length, with skin that does."""
    brows, normals, knots = Brows(face.brows, face, 0.01), face.tissue.normals, face.brows.triangles.shape[1]
    before, after = (
        brows.at(points, face.triangles, normals).points.reshape(-1, brows.STRANDS, knots, 2, 3)[:, 0, 0].mean(axis=1)
        for points in (face.points, face.points + by)
    )
    x, moved = before[:, 0], after - before
    left = np.sort(x[x > 0.0])
    tenth = np.digitize(x, np.linspace(left[0], left[-1], 11)[1:-1])
    return np.array([moved[(x > 0.0) & (tenth == k)].mean(axis=0) for k in range(10)])


def test_brows_go_with_skin_that_goes_as_a_whole(face):
    assert _moved_brow(face, [1.0, 3.0, 0.5]) == pytest.approx(np.tile([1.0, 3.0, 0.5], (10, 1)), abs=1e-4)


def test_brows_do_not_bend_as_sharply_as_skin(face):
    def bend(x):
        return 0.5 * np.maximum(40.0 - x, 0.0)

    brow = _moved_brow(face, bend(face.points[:, :1]) * [0.0, 1.0, 0.0])[:, 1]
    skin = np.diff(bend(np.linspace(10.0, 60.0, 11)), 2)
    assert 0.0 < np.diff(brow, 2).max() < 0.5 * skin.max()


def test_pupil_is_where_the_eye_looks(face):
    for eye in face.eyes:
        painted = PaintedEye(eye, face)
        for gaze in (eye.gaze, np.array([0.48, 0.0, np.sqrt(1.0 - 0.48**2)])):
            ball = painted.at(face.points, gaze)
            dark = np.asarray(ball["paint"]).max(axis=1) < 12
            dark &= (ball.points - eye.centre) @ gaze > 0.96 * eye.radius
            assert dark.sum() > 100
            middle = ball.points[dark].mean(axis=0) - eye.centre
            assert middle @ gaze / np.linalg.norm(middle) > np.cos(np.radians(1.0))
            np.testing.assert_allclose(np.linalg.norm(ball.points - eye.centre, axis=1), eye.radius, rtol=1e-5)


def test_eye_is_darker_under_the_upper_lid_wherever_it_is(face):
    eye = face.eyes[0]
    painted = PaintedEye(eye, face)
    first, second = (painted.at(points)["paint"].astype(int) for points in (face.points, blink(face)))
    assert second.mean() < 0.85 * first.mean()
    upper = margins_of(face, eye.side)[0]
    ball = painted.at(face.points)
    top = face.points[upper][:, 1].max()
    white = (ball.points[:, 0] - eye.centre[0] > 6.5) & (ball.points[:, 0] - eye.centre[0] < 8.5)
    height = ball.points[:, 1]
    near, far = white & (np.abs(height - top + 3.0) < 1.0), white & (np.abs(height - eye.centre[1]) < 1.0)
    assert near.any()
    assert first[near].mean() < 0.9 * first[far].mean()


def test_pictures_side_by_side_and_stacked():
    tall, wide = (np.full(shape, value, np.uint8) for shape, value in (((4, 2, 3), 10), ((4, 6, 3), 20)))
    row = side_by_side([tall, wide], gap=3)
    assert row.shape == (4, 11, 3)
    assert (row[:, :2] == 10).all()
    assert (row[:, 2:5] == 255).all()
    assert (row[:, 5:] == 20).all()
    column = stacked([tall, tall], gap=1)
    assert column.shape == (9, 2, 3)
    assert (column[4] == 255).all()


def test_saved_pictures_are_read_back(tmp_path):
    image = np.random.default_rng(3).integers(0, 256, (20, 30, 3)).astype(np.uint8)
    np.testing.assert_array_equal(pv.read_texture(save_picture(image, tmp_path / "a.png")).to_array(), image)
    few = save_picture(np.where(image > 127, 255, 0).astype(np.uint8), tmp_path / "b.png", colours=256)
    np.testing.assert_array_equal(pv.read_texture(few).to_array()[..., :3] > 127, image > 127)


def test_views_and_frames_that_cannot_be_drawn(face, tmp_path):
    for direction in ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (np.nan, 0.0, 1.0)):
        with pytest.raises(ParameterError, match="straight up"):
            View(direction)
    with pytest.raises(ParameterError, match="height must lie in"):
        View((0.0, 0.0, 1.0), height=0.0)
    with pytest.raises(UnknownNameError, match="'nose'. Did you mean 'nose_tip'"):
        View((0.0, 0.0, 1.0), "nose")
    with pytest.raises(MeshError, match="Is it one of another face"):
        picture(pv.Sphere(), face, Style((40, 40)))
    with pytest.raises(UnknownNameError, match="unknown field 'W'"):
        closeup(face.mesh, face)


def test_pictures_that_cannot_be_written(tmp_path):
    image = np.zeros((4, 4, 3), np.uint8)
    (tmp_path / "file").touch()
    for name in ("x" * 300 + ".png", "file/x.png", "null\0.png"):
        with pytest.raises(OutputError, match="cannot be written"):
            save_picture(image, tmp_path / name)
    with pytest.raises(ParameterError, match="colours must lie in"):
        save_picture(image, tmp_path / "x.png", colours=257)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_figure_shows_a_picture_pixel_by_pixel():
    image = np.random.default_rng(0).integers(0, 256, (37, 53, 3), np.uint8)
    shown = figure(image)
    try:
        shown.canvas.draw()
        assert np.array_equal(np.asarray(shown.canvas.buffer_rgba())[:, :, :3], image)
    finally:
        plt.close(shown)


@pytest.mark.parametrize("expression", ["anger", "surprise"])
def test_hairs_of_brows_lie_on_folds_between_coarse_vertices(real_face, expression):
    face = real_face("mediapipe_canonical_face_model")
    simulation = fw.Simulation(face)
    simulation.express(expression)
    *_, frame = simulation.run(14)
    n = face.mesh.n_points
    points, normals = np.asarray(frame.points)[:n], np.asarray(frame.point_data["Normals"])[:n]
    hairs = Brows(fitted_brows(face), face, 0.01)
    buried = []
    for refined in (None, (np.asarray(frame.points), frame.regular_faces)):
        ribbons = hairs.at(points, face.triangles, normals, refined)
        seen = ribbons.points + 0.5 * face.frame.pupil_distance * face.frame.axes[2]
        among = range(0, len(seen), 17)
        hidden = 0
        for k in among:
            hits, _ = frame.ray_trace(seen[k], ribbons.points[k])
            hidden += bool(len(hits)) and np.linalg.norm(hits - ribbons.points[k], axis=1).max() > 0.1 / face.unit
        buried.append(hidden / len(among))
    assert buried[1] < 0.01 < 0.03 < buried[0], buried
