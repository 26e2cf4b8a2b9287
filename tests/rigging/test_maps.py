"""Maps of wrinkles.

what           checked against
normals        normals of the refined geometry, and a naive search of the triangles below
heights        the field W of the refined skin, at its vertices
flush          its factors at vertices
tangents       a plane that is turned and mirrored
"""

import json

import numpy as np
import pytest
from expressions import settled
from PIL import Image
from scipy.ndimage import distance_transform_edt

import facewrinkle as fw
from facewrinkle.appearance.flush import flush
from facewrinkle.export.model import Model, skin_model
from facewrinkle.mesh import corner_texture, to_polydata
from facewrinkle.rigging.maps import Texels, around_head, tangents_of, visible_first

SIZE = 2048
"""Texels that find the bottoms of the forehead's sharpest furrows, which 1024 across miss by a fifth."""


@pytest.fixture(scope="module")
def small(face):
    """Maps of raised brows that are quickly made."""
    return fw.bake_maps(face, "AU1", size=512)


@pytest.fixture(scope="module")
def raised(face):
    """Maps of raised brows, and the refined skin."""
    lines = [fw.fold_layers(face, "wave", depth=4.2) for _ in range(2)]
    return fw.bake_maps(face, "AU1", size=SIZE, layers=lines[0]), settled(fw.Simulation(face, layers=lines[1]), "AU1")


def barycentric(corners, place):
    """Naive barycentric coordinates (m, 3) of a place in triangles (m, 3, 2)."""
    system = np.concatenate([corners.transpose(0, 2, 1), np.ones((len(corners), 1, 3))], axis=1)
    solvable = np.abs(np.linalg.det(system)) > 1e-12
    out = np.full((len(corners), 3), np.nan)
    out[solvable] = np.linalg.solve(system[solvable], np.array([[*place, 1.0]]).T)[..., 0]
    return out


@pytest.mark.slow
def test_the_normal_map_on_the_smooth_mesh_shows_the_refined_skin(raised):
    maps, fine = raised
    chart, triangles = corner_texture(fine), np.asarray(fine.regular_faces)
    model = skin_model(maps.smooth, None)
    base, coarse = model.triangles, model.uv
    tangent, sign = tangents_of(model)
    folded = np.flatnonzero((np.abs(fine["W"][triangles]) > 0.2).all(axis=1))
    geometric = fw.geometry.vertex_normals(np.asarray(fine.points, float), triangles)
    off, flat = [], []
    for k in np.random.default_rng(0).choice(folded, 150, replace=False):
        place = chart[k].mean(axis=0)
        true = fw.geometry.unit(geometric[triangles[k]].mean(axis=0))
        shares = barycentric(coarse[base], place)
        (host, *_) = np.flatnonzero((shares > -1e-9).all(axis=1))
        t, n = (shares[host] @ values[base[host]] for values in (tangent, model.normals))
        column, row = (place * SIZE).astype(int)
        x, y, z = maps.normal[SIZE - 1 - row, column] / 127.5 - 1.0
        shown = x * t + y * sign[base[host, 0]] * np.cross(n, t) + z * n
        angles = [np.degrees(np.arccos(np.clip(m / np.linalg.norm(m) @ true, -1, 1))) for m in (shown, n)]
        off.append(angles[0])
        flat.append(angles[1])
    assert np.mean(off) < 5.0
    assert np.mean(flat) > 2.0 * np.mean(off)  # what the smooth mesh alone shows


@pytest.mark.slow
def test_heights_are_those_of_the_skin(raised):
    maps, fine = raised
    column, row = np.minimum(np.asarray(fine.active_texture_coordinates) * SIZE, SIZE - 1).astype(int).T
    shown = (maps.height[SIZE - 1 - row, column] / 65535.0 * 2.0 - 1.0) * maps.most
    folded = np.abs(fine["W"]) > 0.1
    assert np.corrcoef(shown[folded], fine["W"][folded])[0, 1] > 0.98
    depths = np.abs(fine["W"])
    assert maps.most <= depths.max()
    assert np.mean(depths > maps.most) < 1e-3, "only the bottoms of the sharpest furrows lie between texels"


def test_where_nothing_folds_the_map_is_flat(face):
    """The edge of lips is rolled so tightly that its normals change with refinement alone."""
    maps = fw.bake_maps(face, "happiness", size=512)
    folded = np.abs(maps.height / 32768.0 - 1.0) * maps.most > 0.01
    normal = maps.normal[maps.covered & (distance_transform_edt(~folded) > 8)] / 127.5 - 1.0  # 4 mm
    assert len(normal) > 10_000
    assert np.degrees(np.arccos(np.clip(normal[:, 2], -1.0, 1.0))).max() < 2.0


def test_tangents_follow_the_texture():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    up, one = np.tile([0.0, 0.0, 1.0], (3, 1)), np.array([[0, 1, 2]])
    for uv, along, sign in (
        (points[:, [1, 0]] * [1, -1] + [0, 1], [0, 1, 0], 1.0),
        (points[:, :2] * [-1, 1] + [1, 0], [-1, 0, 0], -1.0),
    ):
        tangent, found = tangents_of(Model(points, up, one, np.arange(3), uv, None, None))
        np.testing.assert_allclose(tangent, np.tile(along, (3, 1)), atol=1e-12)
        np.testing.assert_array_equal(found, sign)


def test_texels_are_in_one_triangle_each():
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    texels = Texels(square[triangles], 33)
    assert texels.covered.all()
    middles = (np.arange(33) + 0.5) / 33
    np.testing.assert_allclose(texels.of(triangles, square)[..., 0], np.tile(middles, (33, 1)), atol=1e-12)
    np.testing.assert_allclose(texels.of(triangles, square)[..., 1], np.tile(middles[::-1, None], (1, 33)), atol=1e-12)
    assert texels.shared == pytest.approx(1 / 33)  # the diagonal
    assert Texels(np.concatenate([square[triangles]] * 2), 33).shared == 1.0


def test_the_flush_map_has_the_factors_of_the_vertices(face, small):
    corners, triangles = corner_texture(small.smooth), np.asarray(small.smooth.regular_faces)
    factors = flush(face, np.asarray(small.smooth.points, float))
    for name in ("forehead_mid", "malar_l", "menton"):
        vertex = face.mesh.find_closest_point(face.landmarks[name])
        u, v = corners[triangles == vertex][0]
        texel = small.flush[int((1.0 - v) * 512), int(u * 512)]
        np.testing.assert_allclose(texel / 255.0, factors[vertex], atol=0.01)
    assert small.flush[small.covered][:, 1].min() < 250


def test_files_of_maps(small, tmp_path):
    files = {path.name: path for path in fw.write_maps(small, tmp_path / "brows")}
    assert set(files) == {
        f"brows_{name}" for name in ("normal.png", "height.png", "flush.png", "maps.obj", "maps.json")
    }
    with Image.open(files["brows_height.png"]) as picture:
        np.testing.assert_array_equal(np.asarray(picture, np.uint16), small.height)
    assert json.loads(files["brows_maps.json"].read_text())["height"]["mm_at_65535"] == small.most
    mesh = fw.read_surface(files["brows_maps.obj"])
    np.testing.assert_allclose(mesh.points, small.rest.points, rtol=1e-6)
    np.testing.assert_allclose(mesh.active_texture_coordinates, small.rest.active_texture_coordinates, atol=1e-6)


def test_a_face_without_texture_coordinates_gets_a_chart():
    face = fw.default_face()
    face.mesh.GetPointData().SetTCoords(None)
    for name in set(face.mesh.point_data) | set(face.mesh.cell_data):
        if "Texture" in name:
            (face.mesh.point_data if name in face.mesh.point_data else face.mesh.cell_data).remove(name)
    assert corner_texture(face.mesh) is None
    maps = fw.bake_maps(face, "AU1", size=512)
    chart = around_head(face, face.points)
    np.testing.assert_allclose(maps.rest.active_texture_coordinates, chart, atol=1e-6)
    # The middle of the projection keeps areas: seen from the head's centre, a part of the chart is as large as a share
    # of the sphere, so that the half in front fills half of the disc.
    local = face.frame.local(face.points) - [0.0, -0.5, -1.0]
    front = local[:, 2] > 0.0
    away = np.linalg.norm(chart - 0.5, axis=1)
    assert away[front].max() < 0.5 * np.sqrt(0.5) < away[~front].min() + 1e-3
    # The front half of the disc shows the front half of the head, not the triangles at its back that lie all around it.
    mesh = to_polydata(face.points, face.triangles, {"rest": face.points})
    mesh.active_texture_coordinates = chart
    mesh = visible_first(mesh, face)
    owners = np.asarray(mesh.regular_faces)[Texels(chart[np.asarray(mesh.regular_faces)], 128).triangle]
    across, down = np.meshgrid(*2 * [(np.arange(128) + 0.5) / 128.0 - 0.5])
    ahead = local[owners].mean(axis=2)[np.hypot(across, down) < 0.33, 2] > 0.0
    assert ahead.mean() > 0.99  # all but what is seen between the lids
    row, column = np.unravel_index(np.argmin(maps.height), maps.height.shape)
    assert row < 230  # the forehead is above the middle of the chart
    assert abs(column - 256) < 60


def test_what_cannot_be_baked_is_refused():
    face = fw.default_face()
    with pytest.raises(fw.errors.ParameterError, match="power of two"):
        fw.bake_maps(face, "AU1", size=1000)
    face.mesh.active_texture_coordinates = 2.0 * around_head(face, face.points)
    with pytest.raises(fw.errors.ParameterError, match=r"coordinates in \[0, 1\], received some from .* to [12]"):
        fw.bake_maps(face, "AU1", size=64)
    face.mesh.active_texture_coordinates = np.abs(around_head(face, face.points) - [0.5, 0.0])
    with pytest.warns(fw.FaceWrinkleWarning, match="several triangles lie on each other"):
        fw.bake_maps(face, "AU1", size=64)
