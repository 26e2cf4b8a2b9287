"""Meshes with one image and with several, in the formats that name them.

what               checked against
one of several     the pixel of a triangle's own image under each of its corners, in the image of all
what has none      its own color
tiles              the same coordinates in another tile of the plane; a repeated image is told of
USD                materials of meshes and of subsets of faces, in files and in packages
parts              the photo of each part of a head from an OBJ file
"""

import dataclasses
import warnings
import zipfile

import numpy as np
import pytest
import pyvista as pv
from PIL import Image

import facewrinkle as fw
from facewrinkle.mesh import Surface, corner_texture, merged_texture, surface_in
from facewrinkle.mesh.formats.textures import BORDER

RNG = np.random.default_rng(8)
RED, BLUE = (RNG.integers(0, 256, (6, 9, 3), dtype=np.uint8), RNG.integers(0, 256, (12, 5, 3), dtype=np.uint8))

QUADS = """mtllib a.mtl
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0
vt 0.1 0.1\nvt 0.9 0.1\nvt 0.9 0.9\nvt 0.1 0.9
usemtl red\nf 1/1 2/2 3/3 4/4
usemtl blue\nf 2/1 5/2 6/3 3/4
"""
MATERIALS = "newmtl red\nmap_Kd red.png\nnewmtl blue\nmap_Kd blue.png\n"


@pytest.fixture
def folder(tmp_path):
    for name, pixels in (("red", RED), ("blue", BLUE)):
        Image.fromarray(pixels).save(tmp_path / f"{name}.png")
    (tmp_path / "a.mtl").write_text(MATERIALS)
    (tmp_path / "a.obj").write_text(QUADS)
    return tmp_path


def seen(image, uv):
    """The pixel (..., 3) under texture coordinates."""
    h, w = image.shape[:2]
    columns = np.clip((uv[..., 0] * w).astype(int), 0, w - 1)
    return image[np.clip(((1.0 - uv[..., 1]) * h).astype(int), 0, h - 1), columns]


def test_several_images_become_one(folder):
    mesh = surface_in(folder / "a.obj")
    names, number = mesh.images
    names = [name.rsplit("/", 1)[1] for name in names]
    assert sorted(names) == ["blue.png", "red.png"]
    assert np.bincount(number).tolist() == [2, 2]
    laid, image = merged_texture(mesh)
    for triangle, which in enumerate(number):
        expected = seen({"red.png": RED, "blue.png": BLUE}[names[which]], mesh.texture[triangle])
        np.testing.assert_array_equal(seen(image, laid.texture[triangle]), expected)
    assert laid.mesh.n_points == 6  # still one surface, with a seam between the images
    face = fw.surface(folder / "a.obj")
    np.testing.assert_array_equal(face.texture, image)
    np.testing.assert_allclose(corner_texture(face.mesh), laid.texture)


def test_images_that_are_too_large_together_are_made_smaller(folder, monkeypatch):
    mesh = surface_in(folder / "a.obj")
    monkeypatch.setattr("facewrinkle.mesh.formats.textures.LARGEST_SIDE", 100)
    for name, color in (("red", (200, 0, 0)), ("blue", (0, 0, 200))):
        Image.fromarray(np.full((60, 100, 3), color, np.uint8)).save(folder / f"{name}.png")
    names, number = mesh.images
    names = [name.rsplit("/", 1)[1] for name in names]
    laid, image = merged_texture(mesh)
    assert image.shape[1] <= 100 + 4 * BORDER
    assert image.shape[0] < 40
    for triangle, which in enumerate(number):
        color = {"red.png": (200, 0, 0), "blue.png": (0, 0, 200)}[names[which]]
        np.testing.assert_array_equal(seen(image, laid.texture[triangle]), np.tile(color, (3, 1)))


def test_an_image_that_its_package_does_not_hold_is_told_of(folder):
    mesh = surface_in(folder / "a.obj")
    inside = [piece._replace(image=piece.image.replace("/red.png", "/b.usdz[red.png]")) for piece in mesh.pieces]
    with zipfile.ZipFile(folder / "b.usdz", "w") as package:
        package.writestr("other.png", b"")
    with pytest.warns(fw.FaceWrinkleWarning, match="b.usdz does not hold the image 'red.png'"):
        _, image = merged_texture(dataclasses.replace(mesh, pieces=tuple(inside)))
    assert {tuple(pixel) for pixel in BLUE.reshape(-1, 3)} <= {tuple(pixel) for pixel in image.reshape(-1, 3)}


def test_one_image_is_laid_as_it_is(folder):
    (folder / "a.mtl").write_text(MATERIALS.replace("red.png", "blue.png"))
    mesh = surface_in(folder / "a.obj")
    laid, image = merged_texture(mesh)
    np.testing.assert_array_equal(image, BLUE)
    np.testing.assert_array_equal(laid.texture, mesh.texture)
    assert merged_texture(Surface.of(pv.Plane().triangulate()))[1] is None


def test_what_has_no_image_keeps_its_color(folder):
    (folder / "a.mtl").write_text("newmtl red\nmap_Kd red.png\n")
    mesh = surface_in(folder / "a.obj")
    bare = mesh.images[1] < 0
    assert bare.sum() == 2
    colors = np.tile(np.array([10, 200, 30], np.uint8), (len(mesh.points), 1))
    laid, image = merged_texture(dataclasses.replace(mesh, point_data={"Colors": colors}))
    np.testing.assert_array_equal(seen(image, laid.texture[bare]), np.full((2, 3, 3), [10, 200, 30]))


def test_images_that_are_missing_are_told_of_and_the_others_are_there(folder):
    (folder / "blue.png").unlink()
    with pytest.warns(fw.FaceWrinkleWarning, match=r"left out: the image 'blue\.png' is not there"):
        image = fw.surface(folder / "a.obj").texture
    assert image is not None
    (folder / "red.png").write_bytes(b"nothing")
    (folder / "blue.png").write_bytes(b"nothing")
    with pytest.warns(fw.FaceWrinkleWarning, match=r"the image (red|blue)\.png cannot be read") as told:
        assert fw.surface(folder / "a.obj").texture is None
    assert len(told) == 2


def laid_out(path):
    """The image of all, and texture coordinates on it."""
    laid, image = merged_texture(surface_in(path))
    return image, laid.texture


def test_each_image_may_have_a_tile_of_its_own_but_not_repeat(folder):
    def moved(by):
        coordinates = "vt 0.1 0.1\nvt 0.9 0.1\nvt 0.9 0.9\nvt 0.1 0.9\n"
        for before in ("0.1 0.1", "0.9 0.1", "0.9 0.9", "0.1 0.9"):
            u, v = map(float, before.split())
            coordinates += f"vt {by(u):g} {v + 2:g}\n"
        text = QUADS.replace("vt 0.1 0.1\nvt 0.9 0.1\nvt 0.9 0.9\nvt 0.1 0.9\n", coordinates)
        (folder / "b.obj").write_text(text.replace("f 2/1 5/2 6/3 3/4", "f 2/5 5/6 6/7 3/8"))
        return laid_out(folder / "b.obj")

    for found, expected in zip(moved(lambda u: u + 1.0), laid_out(folder / "a.obj"), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-12)
    with pytest.warns(fw.FaceWrinkleWarning, match=r"repeated on the mesh, blue\.png, are cut off"):
        moved(lambda u: 3.0 * u)


def test_transparency_stays_where_one_of_them_has_it(folder):
    Image.fromarray(np.dstack([BLUE, np.full(BLUE.shape[:2], 7, np.uint8)])).save(folder / "blue.png")
    mesh = surface_in(folder / "a.obj")
    names, number = mesh.images
    laid, image = merged_texture(mesh)
    assert image.shape[2] == 4
    alphas = seen(image, laid.texture.mean(axis=1))[:, 3]
    blue = [name.endswith("blue.png") for name in names].index(True)
    np.testing.assert_array_equal(alphas, np.where(number == blue, 7, 255))
    assert laid.images[0] == []  # to lay them once more would spoil it


# --- USD ----------------------------------------------------------------------------------------


MATERIAL = """
    def Material "{0}"
    {{
        token outputs:surface.connect = </looks/{0}/surface.outputs:surface>
        def Shader "surface"
        {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </looks/{0}/photo.outputs:rgb>
            token outputs:surface
        }}
        def Shader "photo"
        {{
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @{0}.png@
            float3 outputs:rgb
        }}
    }}
"""
STAGE = f"""#usda 1.0
def Mesh "skin" (
    prepend apiSchemas = ["MaterialBindingAPI"]
)
{{
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 2, 3, 1, 4, 5, 2]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0)]
    texCoord2f[] primvars:st = [
        (0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9), (0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9)
    ] (
        interpolation = "faceVarying"
    )
    rel material:binding = </looks/red>
    uniform token subsetFamily:materialBind:familyType = "nonOverlapping"
    def GeomSubset "ears" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {{
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [1]
        rel material:binding = </looks/blue>
    }}
}}
def "looks"
{{{MATERIAL.format("red")}{MATERIAL.format("blue")}}}
"""


@pytest.mark.parametrize("packed", [False, True])
def test_materials_of_usd(folder, packed):
    pytest.importorskip("pxr")
    from pxr import UsdUtils

    path = folder / "a.usda"
    path.write_text(STAGE)
    if packed:
        assert UsdUtils.CreateNewUsdzPackage(str(path), str(folder / "a.usdz"))
        path = folder / "a.usdz"
        for name in ("red", "blue"):
            (folder / f"{name}.png").unlink()
    surface = surface_in(path)
    right = surface.points[surface.triangles][..., 0].max(axis=1) > 1.0
    laid, image = merged_texture(surface)
    for triangle, ear in enumerate(right):
        expected = seen(BLUE if ear else RED, surface.texture[triangle])
        np.testing.assert_array_equal(seen(image, laid.texture[triangle]), expected)
    assert len(surface.points) == 6


# --- parts --------------------------------------------------------------------------------------


def test_each_part_of_an_obj_has_its_own_photo(face, folder):
    lines, start = ["mtllib a.mtl"], 1
    meshes = {"red": face.mesh} | {
        f"blue {eye.side}": pv.Sphere(radius=eye.radius, center=eye.centre).triangulate() for eye in face.eyes
    }
    for name, mesh in meshes.items():
        uv = 0.5 + 0.002 * np.asarray(mesh.points)[:, :2]
        lines += [f"v {x} {y} {z}" for x, y, z in np.asarray(mesh.points).tolist()]
        lines += [f"vt {u} {v}" for u, v in uv.tolist()]
        lines += [f"usemtl {name.split()[0]}"]
        lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in (mesh.regular_faces + start).tolist()]
        start += mesh.n_points
    (folder / "head.obj").write_text("\n".join(lines))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Kept one of 3")
        whole = fw.fit_face(folder / "head.obj", face.landmarks, units="mm")
    np.testing.assert_array_equal(whole.texture, RED)
    assert list(whole.parts) == ["eye_l", "eye_r"]
    for part in whole.parts.values():
        np.testing.assert_array_equal(part.texture, BLUE)
        expected = 0.5 + 0.002 * np.asarray(part.mesh.points)[:, :2]
        np.testing.assert_allclose(part.mesh.active_texture_coordinates, expected, atol=1e-9)
