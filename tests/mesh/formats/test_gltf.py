"""glTF and USD files by their structure, written here byte by byte; damaged ones are refused, never believed."""

import base64
import hashlib
import resource

import numpy as np
import pytest
import pyvista as pv
from glb_files import GltfFile, write_glb

from facewrinkle.errors import FaceWrinkleWarning, MeshError
from facewrinkle.mesh import read_surface
from facewrinkle.mesh.formats.polygons import polygon_triangles

POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1]], dtype=np.float32)
TRIANGLES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], dtype=np.uint16)


def document(points=POINTS, triangles=TRIANGLES):
    """A file with one mesh."""
    made = GltfFile()
    made.node(mesh=made.mesh(points, triangles))
    return made, made.content


def test_a_mesh_comes_as_it_is_from_all_three_containers(tmp_path):
    made, _ = document()
    paths = [
        made.glb(tmp_path / "a.glb"),
        made.gltf(tmp_path / "b.gltf", "data%20file.bin"),
        made.gltf(tmp_path / "c.gltf", "data:;base64," + base64.b64encode(made.blob).decode()),
    ]
    (tmp_path / "data file.bin").write_bytes(made.blob)
    before = [hashlib.sha256(path.read_bytes()).hexdigest() for path in paths]
    for path in paths:
        mesh = read_surface(path)
        np.testing.assert_array_equal(mesh.points, POINTS)
        np.testing.assert_array_equal(mesh.regular_faces, TRIANGLES)
    assert [hashlib.sha256(path.read_bytes()).hexdigest() for path in paths] == before
    (tmp_path / "data file.bin").unlink()
    with pytest.raises(MeshError, match=r"needs the file 'data%20file.bin' beside it, which is not there"):
        read_surface(paths[1])


def test_nodes_place_their_meshes(tmp_path):
    made, file = document()
    turn = [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]  # a quarter about z
    file["nodes"] = [
        {"children": [1, 2], "translation": [10.0, 0.0, 0.0]},
        {"mesh": 0, "rotation": turn, "scale": [2.0, 2.0, 2.0]},
        {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 5, 0, 1]},
    ]
    mesh = read_surface(made.glb(tmp_path / "a.glb"))
    x, y, z = POINTS.astype(float).T
    np.testing.assert_allclose(mesh.points[:5], np.column_stack([10 - 2 * y, 2 * x, 2 * z]), atol=1e-6)
    np.testing.assert_allclose(mesh.points[5:], np.column_stack([10 - x, y + 5, z]), atol=1e-6)
    np.testing.assert_array_equal(mesh.regular_faces[4:], TRIANGLES[:, ::-1] + 5)  # mirrored: turned round


def test_sparse_and_quantized_numbers_are_read(tmp_path):
    made, file = document()
    values = made.array(np.array([[7.0, 8.0, 9.0]], np.float32), "f4")
    where = made.array(np.array([4], np.uint16), "u2")
    views = [file["accessors"].pop()["bufferView"] for _ in (where, values)]
    file["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": views[0], "componentType": 5123},
        "values": {"bufferView": views[1]},
    }
    mesh = read_surface(made.glb(tmp_path / "sparse.glb"))
    np.testing.assert_array_equal(mesh.points, np.vstack([POINTS[:4], [[7, 8, 9]]]))
    made, file = document()
    file["extensionsRequired"] = ["KHR_mesh_quantization"]
    number = made.array(np.rint(POINTS * 32767).astype(np.int16)[:, [0, 1, 2, 2]], "i2")
    file["bufferViews"][-1]["byteStride"] = 8
    file["accessors"][number] |= {"normalized": True, "type": "VEC3"}
    file["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = number
    np.testing.assert_allclose(read_surface(made.glb(tmp_path / "q.glb")).points, POINTS, atol=1e-4)


def test_colors_and_texture_come_along_and_a_missing_picture_does_not_matter(tmp_path):
    made, file = document()
    texture = made.array(POINTS[:, :2].copy(), "f4")
    color = made.array(np.tile(np.array([[1.0, 0.0, 0.5]], np.float32), (5, 1)), "f4")
    file["meshes"][0]["primitives"][0]["attributes"] |= {"TEXCOORD_0": texture, "COLOR_0": color}
    file["meshes"][0]["primitives"][0]["material"] = 0
    file["images"], file["textures"] = [{"uri": "nowhere.png"}], [{"source": 0}]
    file["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    mesh = read_surface(made.glb(tmp_path / "a.glb"))
    np.testing.assert_allclose(mesh.active_texture_coordinates, POINTS[:, :2] * [1, -1] + [0, 1])
    np.testing.assert_array_equal(mesh["Colors"], np.tile([255, 0, 188], (5, 1)))  # light of 0.5 is seen as 0.735


@pytest.mark.parametrize(
    "material",
    [
        {"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.1]}},
        {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.9}}},
    ],
    ids=["cornea", "glass"],
)
def test_what_one_sees_through_does_not_hide_what_is_behind(tmp_path, material):
    """A cornea is no eye; but where all is so, that is the mesh."""
    made, file = document()
    attributes = file["meshes"][0]["primitives"][0]["attributes"]
    half = made.array(np.array([0, 1, 4], np.uint16), "u2")
    file["meshes"][0]["primitives"].append({"attributes": attributes, "indices": half, "material": 0})
    file["materials"] = [material]
    assert read_surface(made.glb(tmp_path / "a.glb")).n_cells == 4
    file["meshes"][0]["primitives"][0]["material"] = 0
    assert read_surface(made.glb(tmp_path / "b.glb")).n_cells == 5
    file["meshes"][0]["primitives"][0].pop("material")
    file["materials"] = [{**material, "alphaMode": "MASK", "extensions": {}}]  # which is drawn, or not at all
    assert read_surface(made.glb(tmp_path / "c.glb")).n_cells == 5


def test_textures_lie_by_their_own_coordinates_and_transforms(tmp_path):
    made, file = document()
    quantized = np.rint(POINTS[:, :2] * 4095).astype(np.uint16)  # as packers write them, with a scale in the material
    texture = made.array(quantized, "u2")
    primitive = file["meshes"][0]["primitives"][0]
    primitive["attributes"] |= {"TEXCOORD_0": 0, "TEXCOORD_1": texture}
    primitive["material"] = 0
    file["images"], file["textures"] = [{"uri": "nowhere.png"}], [{"source": 0}]
    half = {"scale": [0.5 / 4095, 1.0 / 4095], "offset": [0.25, 0.5]}
    laid = {"index": 0, "texCoord": 1, "extensions": {"KHR_texture_transform": half}}
    file["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": laid}}]
    mesh = read_surface(made.glb(tmp_path / "a.glb"))
    expected = POINTS[:, :2] * [0.5, -1.0] + [0.25, 0.5]
    np.testing.assert_allclose(mesh.active_texture_coordinates, expected, atol=2e-4)
    half["rotation"] = np.pi / 2  # of the coordinates, against the clock where v goes up
    mesh = read_surface(made.glb(tmp_path / "b.glb"))
    x, y = POINTS[:, :2].T
    np.testing.assert_allclose(mesh.active_texture_coordinates, np.stack([y + 0.25, 0.5 * x + 0.5], axis=1), atol=2e-4)


DAMAGE = {
    "count of points": lambda file: file["accessors"][0].update(count=10**9),
    "count of indices": lambda file: file["accessors"][1].update(count=10**12),
    "no data": lambda file: file["accessors"][0].pop("bufferView"),
    "view": lambda file: file["accessors"][0].update(bufferView=7),
    "mesh": lambda file: file["nodes"][0].update(mesh=9),
    "node": lambda file: file["scenes"][0].update(nodes=[5]),
    "loop": lambda file: file["nodes"][0].update(children=[0]),
    "offset": lambda file: file["bufferViews"][1].update(byteOffset=10**8),
    "negative offset": lambda file: file["bufferViews"][1].update(byteOffset=-40),
    "kind": lambda file: file["accessors"][0].update(componentType=99),
    "width": lambda file: file["accessors"][0].update(type="VEC2"),
    "index": lambda file: file["accessors"][0].update(count=3),
    "buffers": lambda file: file.update(bufferViews=[]),
    "structure": lambda file: file.update(meshes=[[]]),
    "names": lambda file: file["meshes"][0]["primitives"][0].update(attributes=3),
    "matrix": lambda file: file["nodes"][0].update(matrix=[1, 2]),
}


@pytest.mark.parametrize("what", DAMAGE)
def test_damaged_structure(tmp_path, what):
    made, file = document()
    DAMAGE[what](file)
    with pytest.raises(MeshError, match=r"a\.glb cannot be read: .*export it again"):
        read_surface(made.glb(tmp_path / "a.glb"))


def ball():
    """A mesh of some size, and its texture coordinates."""
    mesh = pv.Icosphere(nsub=3)
    return (
        np.asarray(mesh.points, np.float32),
        np.asarray(mesh.regular_faces),
        np.asarray(mesh.points[:, :2], np.float64),
    )


def draco(points, triangles, texture):
    """The ball as exporters write it: accessors without data, and all of it in one compressed part."""
    library = pytest.importorskip("DracoPy")
    data = library.encode(points, triangles, quantization_bits=24, preserve_order=True, tex_coord=texture)
    unique = {len(a["data"][0]): a["unique_id"] for a in library.decode(data).attributes}
    _, file = document(points, triangles)
    for accessor in file["accessors"]:
        del accessor["bufferView"]
    file["accessors"].append({"componentType": 5126, "count": len(points), "type": "VEC2"})
    (part,) = file["meshes"][0]["primitives"]
    part["attributes"]["TEXCOORD_0"] = 2
    how = {"bufferView": 0, "attributes": {"POSITION": unique[3], "TEXCOORD_0": unique[2]}}
    part["extensions"] = {"KHR_draco_mesh_compression": how}
    file["bufferViews"] = [{"buffer": 0, "byteOffset": 0, "byteLength": len(data)}]
    file["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    return file, data


def meshopt(points, triangles, _):
    """The ball as gltfpack writes it: views whose data are compressed elsewhere."""
    library = pytest.importorskip("meshoptimizer")
    indices = np.ascontiguousarray(triangles.ravel(), np.uint32)
    parts = [
        (library.encode_vertex_buffer(points, len(points), 12), "ATTRIBUTES", 12, len(points)),
        (library.encode_index_buffer(indices, len(indices), len(points)), "TRIANGLES", 2, len(indices)),
    ]
    made, file = document(points, triangles)
    blob = b""
    for view, (data, mode, stride, count) in zip(file["bufferViews"], parts, strict=True):
        how = {"buffer": 0, "byteOffset": len(blob), "byteLength": len(data)}
        view["extensions"] = {"EXT_meshopt_compression": {**how, "mode": mode, "byteStride": stride, "count": count}}
        view["buffer"], blob = 1, blob + bytes(data)
    placeholder = {"byteLength": len(made.blob)}  # without data
    file |= {"extensionsRequired": ["EXT_meshopt_compression"], "buffers": [{"byteLength": len(blob)}, placeholder]}
    return file, blob


@pytest.mark.parametrize("compress", [draco, meshopt])
def test_compressed_meshes_come_as_they_were(tmp_path, compress):
    points, triangles, texture = ball()
    found = read_surface(write_glb(tmp_path / "a.glb", *compress(points, triangles, texture)))
    corners = [np.asarray(mesh[0])[mesh[1]] for mesh in ((points, triangles), (found.points, found.regular_faces))]
    order = [np.lexsort(np.round(each.mean(axis=1), 4).T) for each in corners]
    np.testing.assert_allclose(corners[0][order[0]].mean(axis=1), corners[1][order[1]].mean(axis=1), rtol=0, atol=2e-6)
    assert found.n_points == len(points)


@pytest.mark.parametrize("compress", [draco, meshopt])
def test_damaged_compressed_meshes_are_refused(tmp_path, compress):
    """Whatever byte is wrong, the file is read or refused in a sentence."""
    file, blob = compress(*ball())
    rng, refused = np.random.default_rng(5), 0
    for _ in range(200):
        data = bytearray(blob)
        for at in rng.integers(len(data), size=3):
            data[at] = rng.integers(256)
        try:
            read_surface(write_glb(tmp_path / "a.glb", file, data))
        except MeshError as error:
            refused += "a.glb" in str(error)
    assert refused > 5


def test_plain_numbers_beside_compressed_ones_are_read(tmp_path):
    made, file = document()
    part = file["meshes"][0]["primitives"][0]
    part["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    np.testing.assert_array_equal(read_surface(made.glb(tmp_path / "a.glb")).points, POINTS)


def test_other_versions_and_files_without_triangles(tmp_path):
    made, file = document()
    file["asset"]["version"] = "1.0"
    with pytest.raises(MeshError, match=r"is glTF 1\.0; 2\.0 is needed"):
        read_surface(made.glb(tmp_path / "a.glb"))
    for points_and_lines in (0, 1, 3):
        made, file = document()
        file["meshes"][0]["primitives"][0]["mode"] = points_and_lines
        with pytest.raises(MeshError, match="holds no triangles"):
            read_surface(made.glb(tmp_path / "a.glb"))


def many_shapes(file):
    file["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": 0}] * 10**4


def many_copies(file):
    file["meshes"][0]["primitives"] *= 10**4


def many_rows(file):
    file["accessors"][0] |= {"count": 10**8, "sparse": {"count": 1, "indices": {}, "values": {}}}
    del file["accessors"][0]["bufferView"]


@pytest.mark.parametrize("ask", [many_shapes, many_copies, many_rows])
def test_small_files_do_not_take_much_memory(tmp_path, monkeypatch, ask):
    monkeypatch.setattr("facewrinkle.mesh.formats.gltf.AT_ONCE", 2**26)  # the eighth of what is allowed is quicker
    made, file = document(np.tile(POINTS, (2000, 1)))
    ask(file)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(MeshError, match="would take more memory than files of its size do"):
        read_surface(made.glb(tmp_path / "a.glb"))
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 2 * 2**20  # kB


def test_what_a_file_needs_and_nobody_knows_is_told(tmp_path):
    made, file = document()
    file["extensionsRequired"] = ["KHR_materials_unlit", "KHR_texture_transform", "EXT_ghosts"]
    with pytest.warns(FaceWrinkleWarning, match="it needs EXT_ghosts, which is not known here") as told:
        read_surface(made.glb(tmp_path / "a.glb"))
    assert len(told) == 1


@pytest.mark.parametrize(
    ("mode", "order", "triangles"),
    [
        (5, [0, 1, 2, 3, 3, 4, 4, 0, 1], [[0, 1, 2], [1, 3, 2], [4, 0, 1]]),  # two, joined by triangles without area
        (6, [4, 0, 1, 2, 3], [[0, 1, 4], [1, 2, 4], [2, 3, 4]]),
    ],
)
def test_strips_and_fans_are_triangles(tmp_path, mode, order, triangles):
    made, file = document(triangles=order)
    file["meshes"][0]["primitives"][0]["mode"] = mode
    np.testing.assert_array_equal(read_surface(made.glb(tmp_path / "a.glb")).regular_faces, triangles)
    file["accessors"][1]["count"] = 2
    with pytest.raises(MeshError, match="no faces"):
        read_surface(made.glb(tmp_path / "b.glb"))


def seen(light):
    """What light from 0 to 1 looks like (sRGB, IEC 61966-2-1), as bytes."""
    light = np.asarray(light)
    return np.rint(255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055))


def test_colors_of_points_and_of_the_material_multiply(tmp_path):
    made, file = document()
    light = np.linspace(0.0, 1.0, 15).reshape(5, 3)
    primitive = file["meshes"][0]["primitives"][0]
    primitive["material"] = 0
    file["materials"] = [{"pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.5, 0.25, 1.0]}}]
    np.testing.assert_array_equal(read_surface(made.glb(tmp_path / "a.glb"))["Colors"], [seen([1.0, 0.5, 0.25])] * 5)
    primitive["attributes"]["COLOR_0"] = made.array(light, "f4")
    found = read_surface(made.glb(tmp_path / "b.glb"))["Colors"]
    np.testing.assert_array_equal(found, seen(light * [1.0, 0.5, 0.25]))


# --- USD ------------------------------------------------------------------------------------------------

USDA = """#usda 1.0
(
    upAxis = "Y"
)
def Xform "root"
{
    double3 xformOp:translate = (10, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Mesh "face"
    {
        int[] faceVertexCounts = [4, 3]
        int[] faceVertexIndices = [0, 1, 2, 3, 1, 4, 2]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0)]
        texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1), (5, 0), (6, 0), (5, 1)] (
            interpolation = "faceVarying"
        )
    }
    def Mesh "left"
    {
        uniform token orientation = "leftHanded"
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        point3f[] points = [(0, 0, 5), (1, 0, 5), (0, 1, 5)]
    }
    def Mesh "unseen"
    {
        token visibility = "invisible"
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    }
}
"""


def test_usd(tmp_path):
    pytest.importorskip("pxr")
    path = tmp_path / "a.usda"
    path.write_text(USDA)
    mesh = read_surface(path)
    assert mesh.n_points == 8
    assert mesh.bounds[0] == 10.0
    assert mesh.regular_faces.tolist()[2:] == [[1, 4, 2], [5, 7, 6]]
    assert pv.PolyData.from_regular_faces(mesh.points, mesh.regular_faces[:2]).area == pytest.approx(1.0)
    corners = mesh.cell_data["Texture Corners"].reshape(-1, 3, 2)
    np.testing.assert_array_equal(corners[2], [[5, 0], [6, 0], [5, 1]])
    np.testing.assert_array_equal(corners[:2], mesh.points[mesh.regular_faces[:2]][..., :2] - [10, 0])
    path.write_text(USDA.replace("1, 4, 2]", "1, 99, 2]"))
    fresh = path.rename(tmp_path / "b.usda")  # USD keeps open what it has read
    with pytest.raises(MeshError, match="faces of face use points that do not exist"):
        read_surface(fresh)
    (tmp_path / "c.usda").write_text("nothing")
    with pytest.raises(MeshError, match=r"c\.usda cannot be read"):
        read_surface(tmp_path / "c.usda")


def test_usd_by_other_names_and_in_color(tmp_path):
    """Maya calls texture coordinates map1; colors of points are light, as in glTF."""
    pytest.importorskip("pxr")
    path = tmp_path / "a.usda"
    color = "color3f[] primvars:displayColor = [(1, 0, 0), (0.214, 0, 0), (0, 0, 0), (1, 1, 1), (0, 0, 1)] ("
    text = USDA.replace("primvars:st", "primvars:map1")
    path.write_text(text.replace("texCoord2f", f'{color}interpolation = "vertex")\n        texCoord2f'))
    mesh = read_surface(path)
    np.testing.assert_array_equal(mesh.cell_data["Texture Corners"].reshape(-1, 3, 2)[2], [[5, 0], [6, 0], [5, 1]])
    expected = [[255, 0, 0], [127, 0, 0], [0, 0, 0], [255, 255, 255], [0, 0, 255]]
    np.testing.assert_array_equal(mesh["Colors"][:5], expected)
    np.testing.assert_array_equal(mesh["Colors"][5:], 255)  # of what has none


# --- polygons -------------------------------------------------------------------------------------------


def shoelace(corners):
    x, y = corners[:, 0], corners[:, 1]
    return abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) / 2


def test_hollow_polygons_are_covered_and_nothing_beside_them():
    points = np.array([[0.0, 0, 0], [2, -1, 0], [0.5, 0, 0], [2, 1, 0], [3, 0, 0], [4, 1, 0]])
    mesh = pv.PolyData()
    mesh.points, mesh.faces = points, [4, 1, 2, 3, 0, 5, 1, 4, 4, 5, 2]  # one names a point twice
    read = read_surface(mesh)
    first, second = read.regular_faces[:2], read.regular_faces[2:]
    for triangles, polygon in ((first, [1, 2, 3, 0]), (second, [1, 4, 5, 2])):
        assert set(triangles.ravel()) <= set(polygon)
        assert pv.PolyData.from_regular_faces(points, triangles).area == pytest.approx(shoelace(points[polygon]))


def test_polygons_without_area_are_split_all_the_same():
    line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]])
    assert polygon_triangles(line, np.array([4, 3])).tolist() == [[0, 1, 2], [0, 2, 3], [4, 5, 6]]
