"""Meshes for other programs: what PyVista (VTK) and trimesh read back must be what was written, corner by corner."""

import base64
import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import pyvista as pv
from expressions import after
from glb_files import read_glb
from real_faces import built_in

import facewrinkle as fw
from facewrinkle.errors import MeshError, OutputError, ParameterError
from facewrinkle.mesh import corner_texture, split_at_seams, to_polydata

trimesh = pytest.importorskip("trimesh")

ENDINGS = (".glb", ".gltf", ".obj", ".ply")
PHOTO = np.random.default_rng(8).integers(0, 256, (12, 20, 3), dtype=np.uint8)


@pytest.fixture(scope="module")
def moment():
    """A face with a seam from brow to chin and a photo, in another unit, a wrinkled frame of it, and its tears."""
    head = built_in()
    mesh = to_polydata(0.1 * head.points, head.triangles)
    uv = np.asarray(head.mesh.active_texture_coordinates, dtype=float)
    left = (head.points[head.triangles][:, :, 0].mean(axis=1) > 0.0)[:, None, None]
    corners = np.where(left, 0.5 * uv[head.triangles] + [0.5, 0.25], uv[head.triangles])
    mesh.point_data["uv"] = uv
    mesh.point_data.active_texture_coordinates_name = "uv"
    mesh.cell_data["Texture Corners"] = corners.reshape(-1, 6)
    mesh.point_data["Colors"] = head.mesh["Colors"]
    landmarks = {name: 0.1 * point for name, point in head.landmarks.items()}
    face = fw.fit_face(mesh, landmarks, units="cm", texture=PHOTO)
    frame = after(fw.Simulation(face), "frowning", 15)
    assert frame.n_cells > mesh.n_cells + 500
    assert split_at_seams(frame).n_points > frame.n_points + 50
    tears = [fw.SheddingTear(face, start=side).surface(1.0, frame) for side in "lr"]
    return SimpleNamespace(face=face, frame=frame, tears=tears)


def leaves(mesh):
    for block in mesh if isinstance(mesh, pv.MultiBlock) else [mesh]:
        yield from leaves(block) if isinstance(block, pv.MultiBlock) else [block]


def read_by_pyvista(path):
    """Positions, normals and texture coordinates (v upwards) of the corners; the mesh."""
    (mesh,) = leaves(pv.read(path))
    triangles = mesh.regular_faces
    uv = mesh.active_texture_coordinates
    if uv is not None and path.suffix in (".glb", ".gltf"):
        uv = uv * [1.0, -1.0] + [0.0, 1.0]
    normals = mesh["NORMAL"] if "NORMAL" in mesh.point_data else mesh["Normals"]
    return mesh.points[triangles], normals[triangles], None if uv is None else uv[triangles], mesh


def read_by_trimesh(path):
    (mesh,) = trimesh.load_scene(path, process=False).dump()  # as the nodes place it
    uv = getattr(mesh.visual, "uv", None)
    return mesh.vertices[mesh.faces], None, None if uv is None else uv[mesh.faces], mesh


@pytest.mark.parametrize("read", [read_by_pyvista, read_by_trimesh])
@pytest.mark.parametrize("ending", ENDINGS)
def test_round_trip(moment, tmp_path, fingerprint, ending, read):
    frame, before = moment.frame, fingerprint(moment.frame)
    path = fw.write_mesh(frame, tmp_path / f"a frown{ending}", moment.face)
    assert fingerprint(frame) == before
    scale = 0.01 if ending in (".glb", ".gltf") else 1.0  # centimeters, in meters
    points, normals, uv, _ = read(path)
    rounded = 3 * 2.0**-24  # to single precision: the point, the scale, and their product
    wanted = scale * np.asarray(frame.points)[frame.regular_faces]
    np.testing.assert_allclose(points, wanted, rtol=rounded, atol=1e-12)
    np.testing.assert_allclose(uv, corner_texture(frame), rtol=0, atol=1e-7)
    if normals is not None:
        np.testing.assert_allclose(normals, frame["Normals"][frame.regular_faces], atol=2e-6)


@pytest.mark.parametrize("ending", ENDINGS)
def test_the_photo_comes_along_pixel_by_pixel(moment, tmp_path, ending):
    path = fw.write_mesh(moment.frame, tmp_path / f"a frown{ending}", moment.face)
    material = read_by_trimesh(path)[3].visual.material
    image = getattr(material, "baseColorTexture", None) or material.image
    np.testing.assert_array_equal(np.asarray(image.convert("RGB")), PHOTO)
    np.testing.assert_array_equal(fw.read_texture(path), PHOTO)
    # Alone in a folder: nothing in it leads elsewhere.
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    for file in tmp_path.glob("a frown*"):
        file.rename(folder / file.name)
    np.testing.assert_array_equal(fw.read_texture(folder / path.name), PHOTO)


@pytest.mark.parametrize("ending", ENDINGS)
def test_what_was_written_is_a_face_again(moment, tmp_path, ending):
    """The file is read with its seams stitched, where it says which points are one."""
    frame, face = moment.frame, moment.face
    again = fw.read_surface(fw.write_mesh(frame, tmp_path / f"a{ending}", face))
    assert again.n_cells == frame.n_cells
    np.testing.assert_allclose(corner_texture(again), corner_texture(frame), atol=1e-7)
    if ending != ".ply":  # whose vertices have one place in the texture
        assert (again.n_points, again.n_open_edges) == (frame.n_points, frame.n_open_edges)


@pytest.mark.parametrize("ending", ENDINGS)
def test_colors_where_there_is_no_photo(moment, tmp_path, ending):
    path = fw.write_mesh(moment.frame, tmp_path / f"a{ending}", replace(moment.face, texture=None))
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    assert fw.read_texture(path) is None
    wanted = moment.frame["Colors"][moment.frame.regular_faces]
    again = fw.read_surface(path)
    found = np.asarray(again["Colors"])[again.regular_faces]
    found = found if found.dtype == np.uint8 else 255.0 * found
    np.testing.assert_allclose(found, wanted, atol=0.51 if ending == ".obj" else 0.0)  # text of four digits
    if ending == ".glb":  # as the format wants them: in linear light
        (mesh,) = leaves(pv.read(path))
        light = np.where(wanted <= 10.31475, wanted / 255 / 12.92, ((wanted / 255 + 0.055) / 1.055) ** 2.4)
        np.testing.assert_allclose(np.asarray(mesh["COLOR_0"])[mesh.regular_faces][..., :3], light, atol=1e-5)


@pytest.mark.parametrize("ending", ENDINGS)
def test_any_mesh_without_texture_or_colors(tmp_path, ending):
    ball = pv.Icosphere(radius=2.0, nsub=2)
    ball["Normals"] = np.tile([1.0, 0.0, 0.0], (ball.n_points, 1))  # stale
    points, normals, uv, _ = read_by_pyvista(fw.write_mesh(ball, tmp_path / f"ball{ending}"))
    scale = 0.001 if ending in (".glb", ".gltf") else 1.0
    np.testing.assert_allclose(points, scale * ball.points[ball.regular_faces], atol=1e-6 * scale)
    np.testing.assert_allclose(normals, ball.points[ball.regular_faces] / 2.0, atol=0.02)
    assert uv is None


def test_a_glb_is_as_the_format_asks(moment, tmp_path):
    content, data = read_glb(fw.write_mesh(moment.frame, tmp_path / "a.glb", moment.face))
    for view in content["bufferViews"]:
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] + view["byteLength"] <= len(data)
    (primitive,) = content["meshes"][0]["primitives"]
    position = content["accessors"][primitive["attributes"]["POSITION"]]
    apart = split_at_seams(moment.frame).points.astype(np.float32)
    np.testing.assert_array_equal([position["min"], position["max"]], [apart.min(axis=0), apart.max(axis=0)])
    assert "COLOR_0" not in primitive["attributes"]  # it would multiply the photo
    assert content["nodes"][0]["scale"] == [0.01] * 3
    assert read_by_pyvista(fw.write_mesh(moment.frame, tmp_path / "b.glb"))[3].length == pytest.approx(
        0.01 * moment.frame.length, rel=1e-6
    )  # a frame knows its unit


@pytest.mark.parametrize("tears", [{"a": 1}, range(3), (1 for _ in "a"), pv.MultiBlock([None])], ids=type)
def test_tears_are_surfaces(moment, tmp_path, tears):
    with pytest.raises(ParameterError, match="tears must be surfaces"):
        fw.write_mesh(moment.frame, tmp_path / "a.obj", moment.face, tears=tears)
    assert not list(tmp_path.iterdir())


def test_gltf_and_glb_hold_the_same(moment, tmp_path):
    written = [
        fw.write_mesh(moment.frame, tmp_path / name, moment.face, parts=True, tears=moment.tears)
        for name in ("a.glb", "a.gltf")
    ]
    content, data = read_glb(written[0])
    embedded = json.loads(written[1].read_text())
    (buffer,) = embedded.pop("buffers")
    head, _, body = buffer["uri"].partition(",")
    assert head == "data:application/octet-stream;base64"
    assert base64.b64decode(body) == data
    assert buffer["byteLength"] == len(data)
    assert embedded == content
    assert [material["name"] for material in content["materials"]] == [node["name"] for node in content["nodes"]]
    assert content["extensionsUsed"] == ["KHR_materials_ior"]


@pytest.mark.parametrize("tilt", [0.0, 20.0])
def test_a_glb_stands_upright_whatever_way_the_scan_lies(face, tmp_path, tilt):
    up, forward = np.array([0.0, 0.0, 1.0]), np.array([-1.0, 0.0, 0.0])
    turned = np.array([np.cross(up, forward), up, forward])  # rows: the face's left, up and forward in the scan
    angle = np.deg2rad(tilt)
    lean = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    scan = to_polydata(face.points @ lean.T @ turned, face.triangles)
    marks = {name: lean @ point @ turned for name, point in face.landmarks.items()}
    lying = fw.fit_face(scan, marks, units="mm")
    path = fw.write_mesh(lying.mesh, tmp_path / "scan.glb", lying)
    expected = face.points @ lean.T / 1000.0
    np.testing.assert_allclose(trimesh.load(path, process=False).to_mesh().vertices, expected, atol=1e-7)
    np.testing.assert_allclose(fw.read_surface(path).points[:, 1].max(), expected[:, 1].max(), rtol=1e-5)


def test_eyes_and_teeth_in_meshes_of_their_own(face, tmp_path):
    frame = after(fw.Simulation(face), "AU27", 20)
    scene = trimesh.load_scene(fw.write_mesh(frame, tmp_path / "a.glb", face, parts=True), process=False)
    outside = {"face", "eye_l", "eye_r", "brows", "lashes_l", "lashes_r"}
    assert set(scene.geometry) == outside | {"mouth", "upper_teeth", "lower_teeth", "tongue"}
    np.testing.assert_allclose(scene.geometry["face"].vertices[: frame.n_points], frame.points, rtol=1e-6, atol=1e-5)
    for eye in face.eyes:
        ball = scene.geometry[f"eye_{eye.side}"]
        np.testing.assert_allclose(np.linalg.norm(ball.vertices - eye.centre, axis=1), eye.radius, rtol=1e-5)
        ahead = (ball.vertices - eye.centre) @ frame.field_data[f"gaze_{eye.side}"][0]
        light = ball.visual.vertex_attributes["color"][:, :3] / 65535.0
        assert light[np.argmax(ahead)].max() < 0.01  # the pupil looks ahead
        assert light[np.argmin(ahead)].min() > 0.03
    low, high = (scene.geometry[f"{jaw}_teeth"].vertices[:, 1].mean() for jaw in ("lower", "upper"))
    assert low < face.landmarks["upper_lip_mid"][1] - 15.0 < high - 5.0  # these stay with the skull
    # At rest the lips hide the teeth; and what goes with a head that moves is where the head is.
    pose = np.eye(4)
    pose[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    pose[:3, 3] = [5.0, 0.0, -20.0]
    moved = fw.Simulation(face).step()
    moved.points = face.points @ pose[:3, :3].T + pose[:3, 3]
    moved.field_data["pose"] = pose
    turned = trimesh.load_scene(fw.write_mesh(moved, tmp_path / "b.glb", face, parts=True), process=False).geometry
    assert set(turned) == outside
    centre = face.eyes[0].centre @ pose[:3, :3].T + pose[:3, 3]
    eye = turned[f"eye_{face.eyes[0].side}"]
    np.testing.assert_allclose(np.linalg.norm(eye.vertices - centre, axis=1), face.eyes[0].radius, rtol=1e-5)


def test_a_photo_that_parts_share_is_in_the_file_once(moment, tmp_path):
    """The skin, eyes and teeth of many scans lie on one photo."""
    parts = {name: fw.anatomy.Part(pv.Sphere(radius=1.0), "skull", texture=PHOTO) for name in ("left", "right")}
    for part in parts.values():
        part.mesh.texture_map_to_sphere(inplace=True)
    path = fw.write_mesh(moment.frame, tmp_path / "a.gltf", replace(moment.face, parts=parts), parts=True)
    content = json.loads(path.read_text())
    textures = {
        material["name"]: material["pbrMetallicRoughness"].get("baseColorTexture") for material in content["materials"]
    }
    assert textures["face"] == textures["left"] == textures["right"] == {"index": 0}
    assert len(content["images"]) == len(content["textures"]) == 1


def test_what_cannot_be_written_says_so(moment, tmp_path):
    frame, face = moment.frame, moment.face
    for name in ("a.stl", "a", "a.usd"):
        with pytest.raises(OutputError, match=r"must end in .glb or .gltf or .obj or .ply"):
            fw.write_mesh(frame, tmp_path / name, face)
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="a file stands there"):
        fw.write_mesh(frame, tmp_path / "file" / "a.obj", face)
    (tmp_path / "a_texture.png").mkdir()  # where the photo would be
    with pytest.raises(OutputError, match="a_texture.png' is a folder, and a file is to be written"):
        fw.write_mesh(frame, tmp_path / "a.obj", face)
    bare = to_polydata(frame.points, frame.regular_faces)
    with pytest.raises(MeshError, match="no texture coordinates.*Is it a frame of this face"):
        fw.write_mesh(bare, tmp_path / "b.obj", face)
    for other in (pv.PolyData(), pv.PolyData(np.eye(3))):
        with pytest.raises(MeshError, match="has no points|no faces"):
            fw.write_mesh(other, tmp_path / "b.obj")
    assert not list(tmp_path.glob("b*"))


@pytest.mark.parametrize("ending", ENDINGS)
def test_tears_are_in_the_file(moment, tmp_path, fingerprint, ending):
    before = [fingerprint(tear) for tear in moment.tears]
    path = fw.write_mesh(moment.frame, tmp_path / f"head{ending}", moment.face, tears=moment.tears)
    assert [fingerprint(tear) for tear in moment.tears] == before
    expected = np.vstack([tear.points[tear.regular_faces] for tear in moment.tears])
    if ending == ".ply":  # knows no groups
        bare = fw.write_mesh(moment.frame, tmp_path / "bare.ply", moment.face).read_bytes()
        assert bare == path.read_bytes().replace(b"head_texture", b"bare_texture")
        water = pv.read(tmp_path / "head_tears.ply")
    elif ending == ".obj":
        assert [line for line in path.read_text().splitlines() if line[:2] in ("g ", "us")] == [
            "g face",
            "usemtl skin",
            "g tears",
            "usemtl tears",
        ]
        assert "newmtl tears" in path.with_suffix(".mtl").read_text()
        water = pv.wrap(trimesh.load(path, process=False, group_material=True).geometry["tears"])
    else:
        scene = trimesh.load(path, process=False)
        assert set(scene.geometry) == {"face", "tears"}
        material = scene.geometry["tears"].visual.material
        assert material.alphaMode == "BLEND"
        assert material.baseColorFactor[3] < 128
        water = pv.wrap(scene.geometry["tears"])
    np.testing.assert_allclose(water.points[water.regular_faces], expected, atol=1e-6 * np.abs(expected).max())
    assert fw.read_surface(path).n_cells >= moment.frame.n_cells


@pytest.mark.parametrize("ending", ENDINGS)
def test_ply_and_obj_say_what_they_hold_of_a_frame(moment, tmp_path, capsys, ending):
    fw.write_mesh(moment.face.mesh, tmp_path / f"a{ending}", moment.face)
    assert not capsys.readouterr().err
    fw.write_mesh(moment.frame, tmp_path / f"a{ending}", moment.face)
    said = f"facewrinkle: a{ending} holds points, triangles, normals, texture and colors; VTK's formats (frame.save, "
    assert capsys.readouterr().err.startswith(said) == (ending in (".obj", ".ply"))
