"""Photos on faces, and heads that move as a whole, in pictures."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import pyvista as pv
from expressions import after
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from facewrinkle.plotting import Scene, Style, picture
from facewrinkle.plotting.images import texels_per_pixel, texture

pytestmark = pytest.mark.filterwarnings("ignore:.*bad X server")
RED, BLUE, GREEN = (200, 40, 40), (40, 40, 200), (0, 255, 0)
SIZE = (240, 240)


@pytest.fixture(scope="module")
def seamed(face):
    """The built-in head with a photo whose left half lies at one end of it, and the right half at the other: red, then
    green, then blue.
    """
    mesh = face.mesh.copy()
    x, y = (face.points[face.triangles][:, :, axis] for axis in (0, 1))
    left = x.mean(axis=1, keepdims=True) > 0.0
    u = np.where(left, 0.05, 0.95) + 0.0005 * x
    corners = np.stack([u, 0.5 + 0.001 * y], axis=-1)
    uv = np.zeros((mesh.n_points, 2))
    uv[face.triangles.ravel()[::-1]] = corners.reshape(-1, 2)[::-1]
    mesh.point_data["uv"] = uv
    mesh.point_data.active_texture_coordinates_name = "uv"
    fw.mesh.add_seams(mesh, corners)
    photo = np.empty((8, 100, 3), np.uint8)
    photo[:, :30], photo[:, 30:70], photo[:, 70:] = RED, GREEN, BLUE
    return replace(face, mesh=mesh, texture=photo, bound_hair={})


def points_of(scene, name):
    """Points of an actor's mesh, before its matrix."""
    return np.array(scene.plotter.actors[name].mapper.dataset.points)


def hue(image, channel):
    """Pixels in which one channel outweighs the others."""
    others = [image[..., other].astype(int) for other in range(3) if other != channel]
    return image[..., channel].astype(int) > 1.15 * np.maximum(*others)


def test_a_photo_lies_on_the_mesh_at_rest_as_it_was_read(face, tmp_path):
    uv = face.mesh.active_texture_coordinates
    rows = ["v {} {} {}".format(*p) for p in face.points] + ["vt {} {}".format(*p) for p in uv]
    rows += ["f {0}/{0} {1}/{1} {2}/{2}".format(*f) for f in face.triangles + 1]
    (tmp_path / "scan.obj").write_text("\n".join(rows))
    photo = np.full((8, 8, 3), BLUE, np.uint8)
    scan = fw.fit_face(tmp_path / "scan.obj", face.landmarks, units="mm", texture=photo)
    style = Style(SIZE, eyes=False, brows=False)
    assert hue(picture(scan.mesh, scan, style), 2).sum() > 0.2 * SIZE[0] * SIZE[1]
    both = scan.mesh.copy()
    both.point_data.active_scalars_name = both.point_data.active_texture_coordinates_name
    np.testing.assert_array_equal(picture(both, scan, style), picture(scan.mesh, scan, style))


def test_a_photo_with_a_seam_is_not_smeared_across_it(seamed):
    frame = after(fw.Simulation(seamed), "paper_surprise", 20)
    assert frame.n_cells > seamed.mesh.n_cells + 500
    style = Style(SIZE, eyes=False, brows=False)
    for shown in (seamed.mesh, frame):
        image = picture(shown, seamed, style)
        assert hue(image, 0).sum() > 0.1 * image[..., 0].size  # red, to the left of the subject
        assert hue(image, 2).sum() > 0.1 * image[..., 0].size
        assert hue(image, 1).sum() == 0
        columns = np.arange(SIZE[0])
        assert columns[hue(image, 0).any(axis=0)].mean() > columns[hue(image, 2).any(axis=0)].mean()
    # The oracle sees what goes wrong: with the points' own coordinates alone, green shows along the seam.
    torn = seamed.mesh.copy()
    del torn.cell_data["Texture Corners"]
    assert hue(picture(torn, seamed, style), 1).sum() > 20


def test_wrinkles_show_in_a_photo(seamed):
    plain = replace(seamed, texture=np.full((4, 4, 3), 180, np.uint8))
    frame = after(fw.Simulation(plain, layers=fw.fold_layers(plain, "wave", depth=3.0)), "paper_surprise", 20)
    smooth = after(fw.Simulation(plain, layers=[]), "paper_surprise", 20)
    style = Style(SIZE, "forehead", eyes=False, brows=False, microrelief=False)
    middle = (slice(60, 180), slice(60, 180))  # away from the outline and the hair
    contrast = [np.diff(picture(f, plain, style)[middle].astype(float), axis=0).std() for f in (frame, smooth)]
    assert contrast[0] > 3.0 * contrast[1]


# --- heads that move as a whole -----------------------------------------------------------------

TURN = np.eye(4)
TURN[:3, :3] = Rotation.from_euler("yx", [30.0, -10.0], degrees=True).as_matrix()
TURN[:3, 3] = [15.0, -8.0, 4.0]


def turned_head(time):
    return TURN


@pytest.fixture(scope="module")
def surprised(face, played):
    """Plays a recorded surprise on the built-in head, which may have moved as a whole; returns its frames."""
    shape = played("paper_surprise").held.displacement

    @cache
    def surprised(pose=None):
        recorded = fw.Recorded.of_shapes([shape], [[0.0], [1.0]], times=[0.0, 0.1], pose=pose)
        return list(fw.Simulation(face, motion=recorded, time_step=0.02).run(7))

    return surprised


def test_a_head_that_turns_has_the_same_wrinkles(surprised):
    for still, turned in zip(surprised(), surprised(turned_head), strict=True):
        np.testing.assert_array_equal(turned.regular_faces, still.regular_faces)
        np.testing.assert_allclose(turned.points, still.points @ TURN[:3, :3].T + TURN[:3, 3], atol=1e-6)
        np.testing.assert_allclose(turned["W"], still["W"], atol=1e-6)
        np.testing.assert_array_equal(turned.field_data["pose"], TURN)
        assert "pose" not in still.field_data
    assert np.ptp(still["W"]) > 0.3


def test_eyes_lashes_and_brows_go_with_a_head_that_turns(face, surprised):
    still, turned = surprised()[-1], surprised(turned_head)[-1]
    with Scene(face, Style(SIZE)) as scene:
        at_rest = scene.picture(still)
        parts = {name: points_of(scene, name) for name in scene.plotter.actors if name != "skin"}
        there = scene.picture(turned)
        assert set(parts) == {"eyes", "hair", "mouth"}
        for name, points in parts.items():
            np.testing.assert_array_equal(scene.plotter.actors[name].user_matrix, TURN)
            np.testing.assert_allclose(points_of(scene, name), points, atol=1e-3)
        assert np.abs(there.astype(int) - at_rest).mean() > 4.0
        np.testing.assert_array_equal(scene.picture(still), at_rest)
    # A camera that goes with the head sees what it sees of a head that keeps still.
    assert np.abs(picture(turned, face, Style(SIZE, follow=True)).astype(int) - at_rest).mean() < 0.05


def test_eyes_go_with_positions_that_hold_the_turn_of_the_head(face, played):
    """A vertex cache does not tell how the head moved: most of its points do."""
    shape = played("paper_surprise").held.displacement
    moments = [face.points, (face.points + shape) @ TURN[:3, :3].T + TURN[:3, 3]]
    recorded = fw.Recorded.of_positions(moments, times=[0.0, 0.02])
    frame = fw.Simulation(face, fw.Refinement(max_level=0), layers=[], motion=recorded).step()
    pose = frame.field_data["pose"]
    for eye in face.eyes:
        where, wanted = ((m[:3, :3] @ eye.centre + m[:3, 3]) for m in (pose, TURN))
        assert np.linalg.norm(where - wanted) < 0.5  # mm, of 58
    assert np.degrees(Rotation.from_matrix(pose[:3, :3] @ TURN[:3, :3].T).magnitude()) < 0.5  # of 32
    # The picture is that of a head whose turn is known.
    known = frame.copy()
    known.field_data["pose"] = TURN
    shown = [picture(moment, face, Style(SIZE)).astype(int) for moment in (frame, known)]
    lost = frame.copy()
    del lost.field_data["pose"]
    assert np.abs(shown[0] - shown[1]).mean() < 0.1 * np.abs(picture(lost, face, Style(SIZE)) - shown[1]).mean()


def test_a_recorded_turn_and_one_within_the_positions_add_up(face):
    half = np.eye(4)
    half[:3, :3], half[:3, 3] = Rotation.from_euler("y", 12.0, degrees=True).as_matrix(), [0.0, 5.0, 0.0]
    moved = face.points @ half[:3, :3].T + half[:3, 3]
    recorded = replace(fw.Recorded.of_positions([face.points, moved], times=[0.0, 0.02]), pose=turned_head)
    frame = fw.Simulation(face, fw.Refinement(max_level=0), layers=[], motion=recorded).step()
    np.testing.assert_allclose(frame.field_data["pose"], TURN @ half, atol=1e-6)


# --- textures reduced to what is seen -------------------------------------------------------------


@pytest.mark.parametrize(
    "texels, side", [(0.1, 256), (1.0, 256), (1.4, 256), (1.5, 128), (2.0, 128), (7.9, 32), (1e9, 1)]
)
def test_a_texel_becomes_about_as_wide_as_a_pixel(texels, side):
    assert texture(np.zeros((256, 256, 3), np.uint8), texels).dimensions == (side, side)


def test_texels_are_counted_on_most_of_the_surface():
    """A plane 2 by 1, the texture over it stretched by 2 on a narrow strip: the rest decides."""
    sheet = pv.Plane(i_size=2.0, j_size=1.0, i_resolution=20).triangulate()
    place = np.asarray(sheet.points)[:, :2] + [1.0, 0.5]
    place[:, 0] = np.where(place[:, 0] < 0.2, 2.0 * place[:, 0], place[:, 0] + 0.2) / 2.2
    found = texels_per_pixel(sheet, place[sheet.regular_faces], np.zeros((500, 1100, 3)), pixel=0.01)
    assert found == pytest.approx(5.0)  # 1100 texels over 2.2, 500 over 1


def test_a_surface_without_area_takes_any_texture():
    flat = pv.PolyData.from_regular_faces(np.zeros((3, 3)), [[0, 1, 2]])
    assert texels_per_pixel(flat, np.zeros((1, 3, 2)), np.zeros((8, 8, 3)), pixel=1.0) == 1.0
