"""Images that files name or hold, in files written here."""

import base64
import shutil
import warnings
from copy import deepcopy

import numpy as np
import pytest
import pyvista as pv
from glb_files import GltfFile
from PIL import Image

import facewrinkle as fw
from facewrinkle.cli import main
from facewrinkle.errors import FaceWrinkleWarning, MeshError, ParameterError
from facewrinkle.mesh import as_texture, read_texture

RNG = np.random.default_rng(4)
PHOTO, OTHER = (RNG.integers(0, 256, (6, 9, 3), dtype=np.uint8) for _ in range(2))


def png(pixels):
    from io import BytesIO

    stream = BytesIO()
    Image.fromarray(pixels).save(stream, format="PNG")
    return stream.getvalue()


QUAD = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"


def obj(folder, materials, body="usemtl skin\nf 1/1 2/2 3/3 4/4\n", head="mtllib my materials.mtl\n"):
    (folder / "my materials.mtl").write_text(materials)
    (folder / "face.obj").write_text(head + QUAD + body)
    return folder / "face.obj"


# --- OBJ and PLY --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "line",
    [
        "map_Kd my photo.png",
        "\tmap_Kd my photo.png ",
        "map_Kd -s 1 1 1 -o 0.5 0 -bm 2.0 -clamp on my photo.png",
        "map_Kd -mm 0 1 my photo.png",
        "map_Kd C:\\work\\textures\\my photo.png",
        "map_Kd textures/My Photo.PNG",
        "map_Kd\tmy photo.png",
        "map_kd my photo.png",
        'map_Kd "my photo.png"',
    ],
)
def test_an_obj_names_its_image(tmp_path, line):
    (tmp_path / "my photo.png").write_bytes(png(PHOTO))
    np.testing.assert_array_equal(read_texture(obj(tmp_path, f"newmtl skin\nKd 1 1 1\n{line}\n")), PHOTO)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_names_are_those_that_people_give(tmp_path, encoding):
    """Letters of other alphabets, blanks and number signs; photos by such names are laid on the mesh, too."""
    folder = tmp_path / "Köpfe [1]"
    folder.mkdir()
    (folder / "Größe #1.png").write_bytes(png(PHOTO))
    (folder / "Häute.mtl").write_text("newmtl Haut  von#2 # alt\nmap_Kd Größe #1.png\n", encoding)
    (folder / "ä.obj").write_text(f"mtllib Häute.mtl\n{QUAD}usemtl Haut von#2\nf 1/1 2/2 3/3 4/4\n", encoding)
    np.testing.assert_array_equal(read_texture(folder / "ä.obj"), PHOTO)
    np.testing.assert_array_equal(fw.surface(folder / "ä.obj").texture, PHOTO)
    np.testing.assert_array_equal(fw.surface(gltf().glb(folder / "ä.glb")).texture, PHOTO)


def test_an_obj_may_name_several_libraries(tmp_path):
    (tmp_path / "photo.png").write_bytes(png(PHOTO))
    (tmp_path / "other.mtl").write_text("newmtl eye\n")
    path = obj(tmp_path, "", head="mtllib other.mtl skin.mtl\n")
    (tmp_path / "skin.mtl").write_text("newmtl skin\nmap_Kd photo.png\n")
    np.testing.assert_array_equal(read_texture(path), PHOTO)


def test_of_several_materials_the_one_on_most_faces_is_taken(tmp_path):
    for name, pixels in (("skin", PHOTO), ("eye", OTHER)):
        (tmp_path / f"{name}.png").write_bytes(png(pixels))
    materials = "newmtl eye\nmap_Kd eye.png\nnewmtl plain\nKd 1 0 0\nnewmtl skin\nmap_Kd skin.png\n"
    body = "usemtl eye\nf 1/1 2/2 3/3\nusemtl skin\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\nusemtl plain\n" + 3 * "f 1 2 3\n"
    with pytest.warns(FaceWrinkleWarning, match="several textures; took 'skin.png'.*not 'eye.png'"):
        image = read_texture(obj(tmp_path, materials, body))
    np.testing.assert_array_equal(image, PHOTO)


def test_meshes_without_an_image(tmp_path):
    assert read_texture(obj(tmp_path, "newmtl skin\nKd 1 1 1\n")) is None
    (tmp_path / "my materials.mtl").unlink()
    assert read_texture(tmp_path / "face.obj") is None
    pv.Sphere().save(tmp_path / "ball.ply")
    assert read_texture(tmp_path / "ball.ply") is None
    pv.Sphere().save(tmp_path / "ball.stl")
    assert read_texture(tmp_path / "ball.stl") is None
    assert read_texture(pv.Sphere()) is None


def test_an_image_that_is_missing_or_damaged_is_left_out_with_a_notice(tmp_path):
    path = obj(tmp_path, "newmtl skin\nmap_Kd photo.png\n")
    with pytest.warns(FaceWrinkleWarning, match="the image 'photo.png' is not there. Put it beside the mesh"):
        assert read_texture(path) is None
    (tmp_path / "photo.png").write_bytes(b"GIF")
    with pytest.warns(FaceWrinkleWarning, match=r"photo.png cannot be read: its format is not known. Save it"):
        assert read_texture(path) is None
    (tmp_path / "photo.png").write_bytes(png(PHOTO)[:40])
    with pytest.warns(FaceWrinkleWarning, match="the image photo.png cannot be read"):
        assert read_texture(path) is None
    with pytest.raises(MeshError, match="the image photo.png cannot be read.*PNG or JPEG"):
        as_texture(tmp_path / "photo.png")


def test_a_ply_names_its_image(tmp_path):
    properties = "".join(f"property float {name}\n" for name in "xyzst")
    (tmp_path / "ball.ply").write_text(
        f"ply\nformat ascii 1.0\ncomment TextureFile a b.png\nelement vertex 3\n{properties}element face 1\n"
        "property list uchar int vertex_indices\nend_header\n0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n"
    )
    (tmp_path / "a b.png").write_bytes(png(PHOTO))
    np.testing.assert_array_equal(read_texture(tmp_path / "ball.ply"), PHOTO)
    shutil.move(tmp_path / "a b.png", tmp_path / "A B.png")
    np.testing.assert_array_equal(read_texture(tmp_path / "ball.ply"), PHOTO)


# --- glTF ---------------------------------------------------------------------------------------


def gltf(images=(), nodes=(1,)):
    """A file of two meshes, of one and of two triangles, and the nodes that its scene shows; images 0 and 1 are theirs,
    and in the file unless others are given.
    """
    made, points = GltfFile(), np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    for number, triangles in enumerate(([0, 1, 2], [0, 1, 2, 0, 2, 3])):
        made.node(mesh=made.mesh(points, triangles, texture=points[:, :2], material=number))
    own = [{"bufferView": made.view(png(pixels)), "mimeType": "image/png"} for pixels in (OTHER, PHOTO)]
    made.content |= {
        "images": deepcopy(images) or own,
        "textures": [{"source": 1}, {"source": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 1 - number}}} for number in (0, 1)],
        "scenes": [{"nodes": nodes}],
    }
    return made


@pytest.mark.parametrize("kind", ["glb", "gltf", "beside", "data"])
def test_a_gltf_holds_or_names_its_images(tmp_path, kind):
    images = ()
    if kind == "beside":
        (tmp_path / "my photo.png").write_bytes(png(PHOTO))
        (tmp_path / "other.png").write_bytes(png(OTHER))
        images = [{"uri": "other.png"}, {"uri": "my%20photo.png"}]
    if kind == "data":
        images = [{"uri": f"data:image/png;base64,{base64.b64encode(png(p)).decode()}"} for p in (OTHER, PHOTO)]
    made = gltf(images, (0, 1))
    path = made.glb(tmp_path / "a.glb") if kind == "glb" else made.gltf(tmp_path / "a.gltf", "points.bin")
    (tmp_path / "points.bin").write_bytes(made.blob)
    with pytest.warns(FaceWrinkleWarning, match="several textures"):
        np.testing.assert_array_equal(read_texture(path), PHOTO)


def test_a_gltf_whose_photo_lies_by_its_second_coordinates(tmp_path):
    made = gltf()
    (part,) = made.content["meshes"][1]["primitives"]
    part["attributes"]["TEXCOORD_1"] = part["attributes"].pop("TEXCOORD_0")
    made.content["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 1
    np.testing.assert_array_equal(read_texture(made.glb(tmp_path / "a.glb")), PHOTO)


@pytest.mark.parametrize("ending", ["obj", "gltf", "ply"])
def test_where_a_photo_outside_the_folder_comes_from_is_told(tmp_path, capsys, ending):
    """As in the wild: textures lie in a folder beside that of the meshes."""
    for name in ("meshes", "textures"):
        (tmp_path / name).mkdir()
    photo = tmp_path / "textures" / "skin.png"
    photo.write_bytes(png(PHOTO))
    path = tmp_path / "meshes" / f"face.{ending}"
    if ending == "obj":
        obj(tmp_path / "meshes", "newmtl skin\nmap_Kd ../textures/skin.png\n")
    elif ending == "ply":
        head = fw.default_face()
        fw.write_mesh(head.mesh, path, head)
        text = path.read_bytes()
        line = next(line for line in text.split(b"\n") if line.startswith(b"comment TextureFile"))
        path.write_bytes(text.replace(line, b"comment TextureFile ../textures/skin.png"))
    else:
        made = gltf([{"uri": "../textures/skin.png"}] * 2)
        made.gltf(path, "points.bin")
        (path.parent / "points.bin").write_bytes(made.blob)
    np.testing.assert_array_equal(read_texture(path), PHOTO)
    face = fw.surface(path)
    np.testing.assert_array_equal(face.texture, PHOTO)
    assert sum("outside the folder" in sentence and str(photo) in sentence for sentence in face.report) == 1
    assert not any("outside" in sentence for sentence in fw.surface(path, texture=PHOTO).report)
    assert main(["info", str(path)]) == 0
    assert "outside the folder" in capsys.readouterr().out
    assert main(["info", str(path), "--no-outside"]) == 0
    said = capsys.readouterr()
    assert "is outside its folder and is not read" in said.err
    assert "outside the folder" not in said.out


@pytest.mark.parametrize(
    "change",
    [
        lambda c: c["images"].pop(),
        lambda c: c["images"][1].pop("bufferView"),
        lambda c: c["bufferViews"].pop(),
        lambda c: c["bufferViews"][-1].update(byteLength=30),
        lambda c: c["textures"].clear(),
        lambda c: c["materials"].clear(),
        lambda c: c.update(images=[{"uri": "nowhere.png"}] * 2),
        lambda c: c.update(images=[{"uri": "data:image/png;base64,A"}] * 2),
    ],
)
def test_images_of_a_gltf_that_lead_nowhere_are_left_out_with_a_notice(tmp_path, change):
    made = gltf()
    change(made.content)
    with pytest.warns(FaceWrinkleWarning, match="the texture is left out"):
        assert read_texture(made.glb(tmp_path / "a.glb")) is None


def test_older_and_unlit_materials_of_a_gltf(tmp_path):
    """Shiny or not in place of metal or not; and a photo that shines on black."""
    made = gltf()
    content = made.content
    photo = content["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"]
    older = {"extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseTexture": photo}}}
    shining = {"emissiveTexture": photo, "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}}
    for material in (older, shining):
        content["materials"][1] = material
        np.testing.assert_array_equal(read_texture(made.glb(tmp_path / "a.glb")), PHOTO)
    content["materials"][1] = {"emissiveTexture": photo}  # lamps on something of a color
    assert read_texture(made.glb(tmp_path / "a.glb")) is None


@pytest.mark.parametrize("embedded", [True, False])
def test_the_color_of_a_material_multiplies_its_photo(tmp_path, embedded):
    """In light, of which bytes are the 2.2nd root, roughly; a black one is ignored, as nobody paints photos black."""
    made = gltf()
    content, tint = made.content, [1.0, 0.5, 0.1, 1.0]
    if not embedded:
        content["images"] = [{"uri": "photo.png"}] * 2
        (tmp_path / "photo.png").write_bytes(png(PHOTO))
    surface = content["materials"][1]["pbrMetallicRoughness"]
    surface["baseColorFactor"] = tint
    found = read_texture(made.glb(tmp_path / "a.glb"))
    share = PHOTO / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4) * tint[:3]
    expected = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    np.testing.assert_array_equal(found, np.rint(255 * expected))
    (tmp_path / "photo.png").unlink(missing_ok=True)
    surface["baseColorFactor"] = [0.0, 0.0, 0.0, 1.0]
    if embedded:
        np.testing.assert_array_equal(read_texture(made.glb(tmp_path / "b.glb")), PHOTO)
    else:
        with pytest.warns(FaceWrinkleWarning, match="the image 'photo.png' is not there"):
            assert read_texture(tmp_path / "a.glb") is None


def test_a_gltf_without_images_and_one_without_anything(tmp_path):
    made = gltf()
    for part in made.content["meshes"]:
        del part["primitives"][0]["material"]
    assert read_texture(made.glb(tmp_path / "a.glb")) is None
    (tmp_path / "b.glb").write_bytes(b"glTF")
    with pytest.warns(FaceWrinkleWarning, match="b.glb"):
        assert read_texture(tmp_path / "b.glb") is None


@pytest.mark.parametrize("head", ["mtllib my materials.mtl\n", "mtllib my\\ materials.mtl\nmtllib my materials.mtl\n"])
def test_an_obj_that_uses_no_material_has_the_only_image_of_its_library(tmp_path, head):
    (tmp_path / "photo.png").write_bytes(png(PHOTO))
    materials = "newmtl skin\nmap_Kd photo.png\nnewmtl bare\nKd 1 1 1\n"
    path = obj(tmp_path, materials, "f 1/1 2/2 3/3 4/4\n", head)
    np.testing.assert_array_equal(read_texture(path), PHOTO)
    obj(tmp_path, materials + "newmtl eye\nmap_Kd eye.png\n", "f 1/1 2/2 3/3 4/4\n")
    with pytest.warns(FaceWrinkleWarning, match=r"2 images and uses none .* Give one as texture: eye\.png, photo\.png"):
        assert read_texture(path) is None
    assert read_texture(obj(tmp_path, materials, "f 1/1 2/2 3/3\nusemtl bare\nf 1/1 3/3 4/4\n")) is None


# --- images that users give ---------------------------------------------------------------------


def test_images_in_every_guise(tmp_path):
    Image.fromarray(PHOTO).save(tmp_path / "photo.png")
    with_alpha = np.dstack([PHOTO, np.full(PHOTO.shape[:2], 7, np.uint8)])
    for given in (
        tmp_path / "photo.png",
        str(tmp_path / "photo.png"),
        PHOTO,
        with_alpha,
        PHOTO / 255.0,
        pv.Texture(PHOTO),
        Image.fromarray(PHOTO),
        Image.fromarray(with_alpha),
    ):
        found = as_texture(given)
        np.testing.assert_array_equal(found, PHOTO)
        assert found.dtype == np.uint8
    np.testing.assert_array_equal(as_texture(PHOTO[:, :, 0]), np.dstack([PHOTO[:, :, 0]] * 3))
    found = as_texture(PHOTO)
    found[:] = 0
    assert PHOTO.any()


def test_gray_images_of_other_depths_are_as_bright_as_in_eight_bits(tmp_path):
    gray = PHOTO[:, :, 0]
    Image.fromarray(gray * np.uint16(257)).save(tmp_path / "16.png")
    Image.fromarray(gray.astype(np.int32) * 257).save(tmp_path / "32.tif")
    Image.fromarray((gray / 255.0).astype(np.float32)).save(tmp_path / "float.tif")
    for name in ("16.png", "32.tif", "float.tif"):
        with Image.open(tmp_path / name) as image:
            for given in (tmp_path / name, image):
                np.testing.assert_array_equal(as_texture(given), np.dstack([gray] * 3), name)


def test_images_with_too_many_pixels_are_not_read(tmp_path, monkeypatch):
    """Those that are too wide, and those that a few bytes blow up."""
    (tmp_path / "a.png").write_bytes(png(np.zeros((3, 40, 3), np.uint8)))
    monkeypatch.setattr("facewrinkle.mesh.formats.textures.LARGEST_SIDE", 39)
    with pytest.raises(MeshError, match="has 40 x 3 pixels. At most 39 are allowed along a side"):
        as_texture(tmp_path / "a.png")
    monkeypatch.undo()
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 100)
    with (
        warnings.catch_warnings(action="ignore"),  # of Pillow
        pytest.raises(MeshError, match="has 40 x 3 pixels. At most 16384 are allowed along a side, and 100 in all"),
    ):
        as_texture(tmp_path / "a.png")
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 10)
    with pytest.raises(MeshError, match=r"cannot be read: Image size \(120 pixels\) exceeds"):
        as_texture(tmp_path / "a.png")


@pytest.mark.parametrize("image", [np.zeros((4, 4, 2)), np.zeros((4, 4, 3), int), np.full((2, 2), 3.0), 5, np.zeros(0)])
def test_other_things_are_no_images(image):
    with pytest.raises(ParameterError, match="a texture must be"):
        as_texture(image)


def test_a_face_takes_the_image_of_its_file_or_the_one_that_is_given(face, tmp_path):
    (tmp_path / "photo.png").write_bytes(png(PHOTO))
    path = obj(tmp_path, "newmtl skin\nmap_Kd photo.png\n")
    np.testing.assert_array_equal(fw.surface(path).texture, PHOTO)
    np.testing.assert_array_equal(fw.surface(path, texture=OTHER).texture, OTHER)
    np.testing.assert_array_equal(fw.surface(fw.read_surface(path)).texture, PHOTO)
    with pytest.raises(MeshError, match="no texture coordinates"):
        fw.surface(face.skull, texture=OTHER)
    with warnings.catch_warnings(action="error"):  # an image for which there are no coordinates is not asked for
        (tmp_path / "photo.png").unlink()
        path.write_text(path.read_text().replace("1/1 2/2 3/3 4/4", "1 2 3 4"))
        assert fw.surface(path).texture is None


def test_fitted_faces_keep_their_seams_in_files(tmp_path, face):
    mesh = face.mesh.copy()
    corners = np.asarray(mesh.active_texture_coordinates, float)[mesh.regular_faces]
    corners[:40] += 0.25
    mesh.cell_data["Texture Corners"] = corners.reshape(-1, 6)
    again = fw.read_face(fw.write_face(fw.fit_face(mesh, face.landmarks, units="mm"), tmp_path / "b.face"))
    assert again.texture is None
    np.testing.assert_array_equal(again.mesh.cell_data["Texture Corners"], corners.reshape(-1, 6))


def test_a_trimesh_brings_its_image_along():
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box()
    material = trimesh.visual.material.SimpleMaterial(image=Image.fromarray(PHOTO))
    box.visual = trimesh.visual.TextureVisuals(uv=box.vertices[:, :2], material=material)
    np.testing.assert_array_equal(read_texture(box), PHOTO)
    box.visual.material = trimesh.visual.material.PBRMaterial(baseColorTexture=Image.fromarray(OTHER))
    np.testing.assert_array_equal(read_texture(box), OTHER)
