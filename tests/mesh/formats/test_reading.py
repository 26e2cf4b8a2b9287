"""Files and meshes of other libraries, against a naive parser of OBJ and the meshes that files were written from."""

import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import pyvista as pv
from PIL import Image
from real_faces import FACES, needs_faces
from small_meshes import cap, same_triangles, sphere

from facewrinkle.errors import FaceWrinkleWarning, MeshError
from facewrinkle.geometry import topology
from facewrinkle.mesh import prepare, read_surface, read_texture, surface_in
from facewrinkle.mesh.surface import PIECES

REAL = ("ict_face_narrow", "mediapipe_canonical_face_model", "makehuman_head_male")


def parsed_naively(path: Path) -> tuple[np.ndarray, list[list[int]], dict[int, list[tuple[float, ...]]]]:
    """Points, faces and all texture coordinates of every point, from lines split at blanks and slashes."""
    points, coordinates, faces = [], [], []
    texture: dict[int, list[tuple[float, ...]]] = {}
    for line in path.read_text().splitlines():
        if line.startswith("v "):
            points.append([float(x) for x in line.split()[1:4]])
        elif line.startswith("vt "):
            coordinates.append(tuple(float(x) for x in line.split()[1:3]))
        elif line.startswith("f "):
            corners = [word.split("/") for word in line.split()[1:]]
            faces.append([int(corner[0]) - 1 for corner in corners])
            for corner in corners:
                texture.setdefault(int(corner[0]) - 1, []).append(coordinates[int(corner[1]) - 1])
    return np.array(points), faces, texture


@needs_faces
@pytest.mark.parametrize("name", REAL)
def test_real_obj_files_keep_the_numbers_of_the_file(name):
    path = FACES / f"{name}.obj"
    points, faces, texture = parsed_naively(path)
    mesh = read_surface(path)
    np.testing.assert_array_equal(mesh.points, points)
    assert mesh.points.dtype == np.float64
    # Every polygon is covered by triangles on its own vertices, in order.
    assert mesh.n_cells == sum(len(face) - 2 for face in faces)
    sides = {frozenset((a, b)) for f in faces for a, b in zip(f, f[1:] + f[:1], strict=True)}
    edges, _ = topology.unique_edges(mesh.regular_faces)
    assert sides <= {frozenset(edge) for edge in edges.tolist()}
    first = np.array([texture[number][0] if number in texture else (0, 0) for number in range(len(points))])
    np.testing.assert_array_equal(mesh.active_texture_coordinates, first.astype(np.float32))
    # Where there are seams, every triangle lies in the texture as its polygon does.
    assert ("Texture Corners" in mesh.cell_data) == any(len(set(uvs)) > 1 for uvs in texture.values())
    if "Texture Corners" in mesh.cell_data:
        numbered = {vertex: iter(uvs) for vertex, uvs in texture.items()}
        of_polygons = [{vertex: next(numbered[vertex]) for vertex in face} for face in faces]
        triangles = iter(zip(mesh.regular_faces, mesh.cell_data["Texture Corners"].reshape(-1, 3, 2), strict=True))
        for own in of_polygons:
            for triangle, corners in [next(triangles) for _ in range(len(own) - 2)]:
                assert [own[vertex] for vertex in triangle] == [tuple(uv) for uv in corners]


OBJ = """# a pyramid with a quad, colors, negative numbers and a continued line
o thing
v 0 0 0 1 0 0
v 1 0 0 1 0 0
v 1 1 0 1 0 0
v 0 1 0 1 0 0.5
v 0.5 0.5 1 1 0 0
vt 0 0
vt 1 0
vt 1 1
vn 0 0 1
usemtl skin
f 4/1/1 3/2/1 2/3/1 1/1/1
f 1/3 2/2 -1/1
f 2//1 3//1 5//1
f 3 4 \\
  5
f 4 1 5
l 1 2
"""


def test_obj_with_everything(tmp_path):
    path = tmp_path / "pyramid.obj"
    path.write_text(OBJ)
    mesh = read_surface(path)
    np.testing.assert_array_equal(mesh.points, [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1]])
    assert mesh.n_cells == 6
    assert same_triangles(mesh.regular_faces[2:], [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    np.testing.assert_array_equal(mesh.active_texture_coordinates, [[0, 0], [1, 1], [1, 0], [0, 0], [0, 0]])
    np.testing.assert_array_equal(mesh.regular_faces[2], [0, 1, 4])  # where points 0 and 1 have others
    np.testing.assert_array_equal(mesh.cell_data["Texture Corners"][2], [1, 1, 1, 0, 0, 0])
    np.testing.assert_array_equal(mesh["Colors"], [[1, 0, 0]] * 3 + [[1, 0, 0.5]] + [[1, 0, 0]])
    assert mesh.volume == pytest.approx(1 / 3, rel=1e-12)  # base 1, height 1


def test_colors_of_any_range(tmp_path):
    """Up to 1, to 255 or, in 16 bits, to 65535: the same colors."""
    gray = np.array([0, 51, 255])
    rows = [f"v {i} {i * i} 0 {g} {g} {g}" for i, g in enumerate(gray)]
    (tmp_path / "a.obj").write_text("\n".join([*rows, "f 1 2 3"]))
    np.testing.assert_array_equal(read_surface(tmp_path / "a.obj")["Colors"], np.dstack([gray] * 3)[0])
    for kind, values in (("float", gray / 255), ("float", gray), ("ushort", 257 * gray), ("uchar", gray)):
        head = ["ply", "format ascii 1.0", "element vertex 3", *(f"property float {axis}" for axis in "xyz")]
        head += [*(f"property {kind} {name}" for name in ("red", "green", "blue")), "element face 1"]
        rows = [f"{i} {i * i} 0 {g} {g} {g}" for i, g in enumerate(values)]
        head += ["property list uchar int vertex_indices", "end_header", *rows, "3 0 1 2"]
        (tmp_path / "a.ply").write_text("\n".join(head) + "\n")
        found = np.asarray(read_surface(tmp_path / "a.ply")["Colors"])
        shown = found if found.dtype == np.uint8 else np.rint(255 * found)
        np.testing.assert_array_equal(shown, np.dstack([gray] * 3)[0], kind)


def test_polypaint_of_zbrush(tmp_path):
    """Comments with a mask and a color for each point, 64 a line; others are comments."""
    shades = np.random.default_rng(1).integers(0, 256, (70, 4), dtype=np.uint8)
    rows = [f"v {i} {i * i} {i**3}" for i in range(70)]
    digits = shades.tobytes().hex()
    painted = [f"#MRGB {digits[:512]}", f"#MRGB {digits[512:].upper()} "]
    faces = [f"f {i} {i + 1} {i + 2}" for i in range(1, 69)]
    path = tmp_path / "a.obj"
    path.write_text("\n".join(["#MRGB of each point follow", *rows, *painted, *faces]))
    np.testing.assert_array_equal(read_surface(path)["Colors"], shades[:, 1:])
    path.write_text("\n".join([*rows, painted[0], *faces]))
    assert "Colors" not in read_surface(path).point_data


OFF = """OFF
# comment
5 5 0
0 0 0
1 0 0
1 1 0
0 1 0
0.5 0.5 1
4 3 2 1 0
3 0 1 4 255 0 0
3 1 2 4
3 2 3 4
3 3 0 4
"""


@pytest.mark.parametrize("text", [OFF, OFF.replace("OFF\n# comment\n", "OFF "), OFF.replace("OFF", "COFF")])
def test_off(tmp_path, text):
    path = tmp_path / "pyramid.off"
    path.write_text(text)
    mesh = read_surface(str(path))
    assert mesh.n_cells == 6
    np.testing.assert_array_equal(mesh.points[4], [0.5, 0.5, 1])
    assert mesh.volume == pytest.approx(1 / 3, rel=1e-12)


@pytest.mark.parametrize("ending", [".ply", ".stl", ".vtk", ".vtp", ".vtkhdf"])
def test_formats_of_vtk(tmp_path, ending):
    original = cap()
    path = tmp_path / f"cap{ending}"
    original.save(path)
    mesh = read_surface(path)
    assert mesh.points.dtype == np.float64
    assert mesh.n_cells == original.n_cells
    assert mesh.area == pytest.approx(original.area, rel=1e-6)  # PLY and STL hold single precision
    if ending != ".stl":  # which has no numbers
        np.testing.assert_allclose(mesh.points, original.points, atol=1e-7)
        np.testing.assert_array_equal(mesh.regular_faces, original.regular_faces)
    if ending.startswith(".vt"):
        np.testing.assert_array_equal(mesh.points, original.points)
        np.testing.assert_array_equal(mesh["identity"], original["identity"])


def test_ply_keeps_its_numbers_at_texture_seams(tmp_path):
    path = tmp_path / "seam.ply"
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
        "z\nelement face 2\n"
        "property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2 6 0 0 1 0 0 1\n3 1 3 2 6 .5 0 1 1 0 1\n"
    )
    mesh = read_surface(path)
    np.testing.assert_array_equal(mesh.regular_faces, [[0, 1, 2], [1, 3, 2]])
    np.testing.assert_array_equal(mesh.active_texture_coordinates, [[0, 0], [1, 0], [0, 1], [1, 1]])
    np.testing.assert_array_equal(mesh.cell_data["Texture Corners"], [[0, 0, 1, 0, 0, 1], [0.5, 0, 1, 1, 0, 1]])


STRIP_PLY = (
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement "
    "tristrips 1\n"
    "property list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n4 0 1 2 3\n"
)


BAD_FILES = {
    "empty.ply": ("", "is empty.*Export it again"),
    "strip.ply": (STRIP_PLY, "4 points and no faces.*export polygons"),
    "empty.obj": ("", "is empty"),
    "comment.obj": ("# nothing\n", "has no points"),
    "points.obj": ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "3 points and no faces.*export polygons"),
    "words.obj": ("v 0 0 zero\n", "line 1: cannot make sense of 'v 0 0 zero'"),
    "zero.obj": ("v 0 0 0\nf 0 1 1\n", "line 2"),
    "short.obj": ("v 0 0 0\nv 1 0 0\nf 1 2\n", "line 3"),
    "range.obj": ("v 0 0 0\nv 1 0 0\nf 1 2 3\n", "face 1 uses vertices.*has 2 vertices"),
    "other.off": ("PLY\n", "must begin with OFF.*Save it as"),
    "binary.off": ("OFF BINARY\n", "hold text"),
    "cut.off": ("OFF\n3 1 0\n0 0 0\n", "announces 3 points and 1 faces, and holds 1 and 0"),
    "words.off": ("OFF\n1 0 0\n0 0 zero\n", "line 3"),
    "bare.off": ("OFF\n", "cannot make sense"),
    "noise.ply": ("noise", "cannot be read: it has no header.*export it again"),
    "noise.stl": ("noise", "cannot be read.*export it again"),
    "noise.vtk": ("noise", "cannot be read.*export it again"),
    "noise.vtp": ("noise", "cannot be read.*export it again"),
    "noise.vtkhdf": ("noise", "cannot be read.*export it again"),
    "noise.glb": ("noise", "cannot be read: it holds no glTF.*export it again"),
    "scene.fbx": ("noise", "no reader for '.fbx'.*OBJ, OFF, PLY"),
    "nothing": ("noise", "no reader for a file without an ending"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_files(tmp_path, name, capfd, caplog):
    content, message = BAD_FILES[name]
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(MeshError, match=f"(?s){message}") as caught:
        read_surface(path)
    assert name in str(caught.value)
    assert capfd.readouterr() == ("", "")  # VTK's own complaints are in the message, not on the terminal
    assert not caplog.records


@pytest.mark.parametrize("binary", [True, False])
def test_stl_is_read_as_vtk_reads_it(tmp_path, binary):
    """Corners become points in the order of the file; triangles without an area between them are dropped."""
    ball = pv.Icosphere(nsub=2)
    ball.points[:, 2] *= np.where(np.abs(ball.points[:, 2]) < 0.1, 0.0, 1.0)  # 0 and -0
    ball.faces = np.concatenate([ball.faces, [3, 5, 5, 7]])
    path = tmp_path / "ball.stl"
    ball.save(path, binary=binary)
    mesh, expected = read_surface(path), pv.read(path)
    np.testing.assert_array_equal(mesh.points, expected.points)
    np.testing.assert_array_equal(mesh.regular_faces, expected.regular_faces)


def test_stl_with_a_wrong_count_and_a_header_that_seems_text(tmp_path):
    ball = pv.Icosphere(nsub=1)
    path = tmp_path / "ball.stl"
    ball.save(path)
    data = path.read_bytes()
    path.write_bytes(b"solid of a scanner" + data[18:80] + b"\xff\xff\xff\x7f" + data[84:])
    assert read_surface(path).n_cells == ball.n_cells
    path.write_bytes(b"solid x\nfacet normal 0 0 1\nouter loop\nVERTEX 0 0 0\nvertex 1 0 0\n")
    with pytest.raises(MeshError, match="ball.stl cannot be read: it holds 2 corners of triangles"):
        read_surface(path)


def test_binary_stl_without_a_byte_of_binary_files(tmp_path):
    """Its first bytes are all those of ASCII, and the length says that it is none."""
    flat = np.zeros(4, np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")]))
    flat["corners"] = [[[0, 0, 0], [2, 0, 0], [0, 2, 8]], [[2, 0, 0], [2, 2, 0], [0, 2, 8]]] * 2
    flat["corners"][2:] += 32.0
    path = tmp_path / "flat.stl"
    path.write_bytes(b"solid".ljust(80) + np.uint32(len(flat)).tobytes() + flat.tobytes())
    assert max(path.read_bytes()[:256]) < 128
    mesh = read_surface(path)
    np.testing.assert_array_equal(mesh.points[mesh.regular_faces], flat["corners"])


def test_obj_with_texture_numbers_that_lead_nowhere(tmp_path):
    path = tmp_path / "texture.obj"
    path.write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.5 0.5\nf 1/{9**30} 2/-{9**30} 3/1\n")
    np.testing.assert_array_equal(read_surface(path).active_texture_coordinates, [[0, 0], [0, 0], [0.5, 0.5]])


# --- other libraries ----------------------------------------------------------------------------


def test_polygons_lines_strips_and_float32():
    points = np.array([[0, 0, 0], [2, 0, 0], [3, 1, 0], [1, 1, 0], [2, 2, 0]], dtype=np.float32)
    read = read_surface(pv.PolyData(points, faces=[4, 0, 1, 2, 3, 3, 3, 2, 4], lines=[2, 0, 4], verts=[1, 4]))
    assert read.points.dtype == np.float64
    assert same_triangles(read.regular_faces, [[0, 1, 3], [1, 2, 3], [3, 2, 4]])  # the shorter diagonal
    assert (read.n_lines, read.n_verts) == (0, 0)
    strips = pv.PolyData(points, strips=[4, 0, 1, 3, 2])
    assert same_triangles(read_surface(strips).regular_faces, [[0, 1, 3], [1, 2, 3]])


def test_multiblock():
    original = cap()
    blocks = pv.MultiBlock({"face": original, "marks": pv.PolyData(np.eye(3)), "none": None})
    assert read_surface(pv.MultiBlock({"head": blocks})).n_cells == original.n_cells
    blocks["eye"] = sphere((0, 0, 0), 0.2)
    both = read_surface(blocks)
    np.testing.assert_array_equal(both.points[: original.n_points], original.points)
    np.testing.assert_array_equal(both.regular_faces[: original.n_cells], original.regular_faces)
    np.testing.assert_array_equal(both.points[both.regular_faces[original.n_cells :]],
                                  blocks["eye"].points[blocks["eye"].regular_faces])  # fmt: skip
    assert both.point_data.keys() == []  # the eye has none
    meshes = np.repeat([0, 1], [original.n_cells, blocks["eye"].n_cells])
    for source in (both, blocks):
        np.testing.assert_array_equal(surface_in(source).meshes, meshes)
    with pytest.raises(MeshError, match="holds no surface"):
        read_surface(pv.MultiBlock())


KINDS = {"nan": [np.nan, np.nan], "text": ["skin", "eye"], "rows": [[0, 1], [1, 0]], "numbers": [0, 1]}


@pytest.mark.parametrize(("name", "kind"), [(name, kind) for name in ("mesh", PIECES) for kind in KINDS])
def test_arrays_of_others_change_nothing(name, kind):
    """Cell data of other programs may have any name; halves of a surface that lie apart are joined all the same."""
    halves = [pv.Plane(center=(x, 0.0, 0.0), i_resolution=4, j_resolution=4).triangulate() for x in (0.0, 1.0)]
    for half, value in zip(halves, np.array(KINDS[kind]), strict=True):
        half.cell_data[name] = np.stack([value] * half.n_cells)
    with pytest.warns(FaceWrinkleWarning, match="Joined points .* 5 of 50"):
        assert len(prepare(halves[0].append_polydata(halves[1])).triangles) == 64
    both = read_surface(pv.MultiBlock(halves))
    assert both.cell_data.keys() == [PIECES]
    np.testing.assert_array_equal(surface_in(both).meshes, np.repeat([0, 1], 32))


def test_trimesh():
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box()
    mesh = read_surface(box)
    np.testing.assert_array_equal(mesh.points, box.vertices)
    np.testing.assert_array_equal(mesh.regular_faces, box.faces)
    box.visual.vertex_colors = np.arange(32, dtype=np.uint8).reshape(8, 4)
    np.testing.assert_array_equal(read_surface(box)["Colors"], np.arange(32).reshape(8, 4))
    box.visual = trimesh.visual.TextureVisuals(uv=box.vertices[:, :2])
    np.testing.assert_array_equal(read_surface(box).active_texture_coordinates, box.vertices[:, :2])


def test_scenes_of_trimesh(tmp_path):
    """As trimesh.load gives for most files: all meshes, where the scene places them."""
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.icosphere().export(tmp_path / "ball.glb")
    scene = trimesh.load(tmp_path / "ball.glb")
    assert isinstance(scene, trimesh.Scene)
    both = read_surface(scene), read_surface(tmp_path / "ball.glb")
    assert both[0].volume == pytest.approx(both[1].volume, rel=1e-12)
    scene.add_geometry(trimesh.creation.box(), transform=trimesh.transformations.translation_matrix([5, 0, 0]))
    assert read_surface(scene).bounds[1] == 5.5
    with pytest.raises(MeshError, match="the scene has no mesh"):
        read_surface(trimesh.Scene())
    photo = np.arange(48, dtype=np.uint8).reshape(4, 4, 3)
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    sheet.visual = trimesh.visual.TextureVisuals(uv=sheet.vertices[:, :2], image=Image.fromarray(photo))
    np.testing.assert_array_equal(read_texture(trimesh.Scene(sheet)), photo)


def pipe(folder):
    os.mkfifo(folder / "pipe.obj")
    return folder / "pipe.obj"


def with_faces(*faces):
    """Four points, a triangle, and more faces as VTK lists them."""
    mesh = pv.PolyData()
    mesh.points = np.eye(4, 3)
    mesh.faces = np.array([3, 0, 1, 2, *faces])
    return mesh


def bare(vertices, faces):
    """What has vertices and faces as meshes of trimesh do."""
    return SimpleNamespace(vertices=vertices, faces=faces)


GRIDS = pv.ImageData(dimensions=(3, 3, 3)), pv.Plane().cast_to_unstructured_grid()
NO_NUMBERS = [["a", "b", "c"]], [[1, 2], [3]], np.eye(3) + 1j, None


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (lambda folder: "x" * 300 + ".obj", "no file|cannot be opened"),
        (lambda folder: "~nobody-of-that-name/x.obj", "no file|cannot be opened"),
        (lambda folder: "null\0.obj", "no file|cannot be opened"),
        (pipe, "not a regular file"),
        (lambda folder: folder / "missing.obj", "there is no file .*Check the path"),
        (lambda folder: folder, "is a folder"),
        (lambda _: with_faces(2, 0, 1), "three points"),
        (lambda _: with_faces(3, 0, 1, -4), "from 0 to 3"),
        (lambda _: with_faces(4, 0, 1, 2, 10**6), "from 0 to 3"),
        *((lambda _, grid=grid: grid, "must hold triangles, quads or polygons.*extract_surface") for grid in GRIDS),
        *(
            (
                lambda _, grid=grid: pv.MultiBlock([pv.Sphere(), grid]),
                "must hold triangles, quads or polygons.*extract_sur",
            )
            for grid in GRIDS
        ),
        (lambda _: {}, "received dict"),
        (lambda _: bare(np.eye(4)[:, :3], [[0, 1, 2, 3]]), r"shape \(m, 3\), received \(1, 4\)"),
        (lambda _: pv.Table(np.eye(3)), "is a Table.*Take its surface"),
        *((lambda _, v=v: bare(v, [[0, 1, 2]]), "points must be an array of real numbers") for v in NO_NUMBERS),
        *((lambda _, v=v: bare(np.eye(3), v), "faces must be an array of real numbers") for v in NO_NUMBERS),
    ],
)
def test_what_is_no_surface_is_refused(tmp_path, source, message):
    with pytest.raises(MeshError, match=message):
        read_surface(source(tmp_path))
