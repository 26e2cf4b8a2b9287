"""The edge: files and foreign meshes in, PolyData out.

`read_surface` is checked against a naive parser of OBJ lines and against the meshes that the files were
written from, `prepare` against meshes that were spoiled on purpose: what comes back must be the mesh before
the damage."""

from __future__ import annotations

import json
import os
import re
import warnings
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given, settings
from hypothesis import strategies as st

from facewrinkle.errors import FaceWrinkleWarning, MeshError, ParameterError
from facewrinkle.geometry import topology
from facewrinkle.mesh import ARRAYS, prepare, read_surface, refine, to_polydata

FACES = Path(__file__).parents[3] / "shared" / "faces"
REAL = ("ict_face_narrow", "mediapipe_canonical_face_model", "makehuman_head_male")
needs_faces = pytest.mark.skipif(not FACES.is_dir(), reason="the faces of other projects are not here")


def fingerprint(mesh: pv.PolyData) -> tuple:
    """All that a function could change in its input."""
    data = [(name, mesh[name].tobytes(), mesh[name].dtype) for name in mesh.point_data]
    return mesh.points.tobytes(), mesh.points.dtype, mesh.faces.tobytes(), data, mesh.active_scalars_name


def mesh_of(points: np.ndarray, triangles: np.ndarray, **point_data: np.ndarray) -> pv.PolyData:
    mesh = pv.PolyData.from_regular_faces(np.array(points, dtype=float), np.asarray(triangles))
    for name, values in point_data.items():
        mesh.point_data[name] = values
    return mesh


def cap(resolution: int = 12) -> pv.PolyData:
    """A round mask that bulges along +z, with an identity for every point."""
    u, v = np.meshgrid(np.linspace(-1, 1, resolution), np.linspace(-1, 1, resolution))
    points = np.column_stack([u.ravel(), v.ravel(), 1.0 - 0.4 * (u**2 + v**2).ravel()])
    corner = np.arange(resolution * resolution).reshape(resolution, resolution)
    low, high = corner[:-1], corner[1:]
    a, b, c, d = (part.ravel() for part in (low[:, :-1], low[:, 1:], high[:, 1:], high[:, :-1]))
    triangles = np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return mesh_of(points, triangles, identity=np.arange(len(points)), colour=np.abs(points))


def sphere(centre: tuple[float, float, float], radius: float, resolution: int = 8) -> pv.PolyData:
    ball = pv.Sphere(radius=radius, center=centre, theta_resolution=resolution, phi_resolution=resolution)
    return mesh_of(ball.points, ball.regular_faces)


def joined(*meshes: pv.PolyData) -> pv.PolyData:
    """The meshes side by side, points and triangles in this order."""
    shifts = np.cumsum([0] + [mesh.n_points for mesh in meshes[:-1]])
    return mesh_of(
        np.vstack([mesh.points for mesh in meshes]),
        np.vstack([mesh.regular_faces + shift for mesh, shift in zip(meshes, shifts, strict=True)]),
    )


def same_triangles(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether the triangles are the same with the same orientation, in whatever order and from whatever "
    "corner."""

    def turned(triangles: np.ndarray) -> set[tuple[int, ...]]:
        return {tuple(np.roll(t, -int(np.argmin(t))).tolist()) for t in np.asarray(triangles)}

    return len(one) == len(other) and turned(one) == turned(other)


# --- files --------------------------------------------------------------------------------------


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
    np.testing.assert_array_equal(mesh.active_texture_coordinates, first)
    # Where there are seams, every triangle lies in the texture as its polygon does.
    assert ("Texture Corners" in mesh.cell_data) == any(len(set(uvs)) > 1 for uvs in texture.values())
    if "Texture Corners" in mesh.cell_data:
        numbered = {vertex: iter(uvs) for vertex, uvs in texture.items()}
        of_polygons = [{vertex: next(numbered[vertex]) for vertex in face} for face in faces]
        triangles = iter(zip(mesh.regular_faces, mesh.cell_data["Texture Corners"].reshape(-1, 3, 2), strict=True))
        for own in of_polygons:
            for triangle, corners in [next(triangles) for _ in range(len(own) - 2)]:
                assert [own[vertex] for vertex in triangle] == [tuple(uv) for uv in corners]


@needs_faces
@pytest.mark.parametrize("name", REAL)
def test_landmark_files_refer_to_the_numbers_of_the_points(name):
    landmarks = json.loads((FACES / f"{name}.landmarks.json").read_text())["landmarks"].values()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FaceWrinkleWarning)
        points = read_surface(FACES / f"{name}.obj").points
    numbered = [mark for mark in landmarks if mark.get("vertex") is not None]
    assert numbered
    for mark in numbered:
        distances = np.linalg.norm(points - mark["xyz"], axis=1)
        assert distances[mark["vertex"]] == distances.min()
        assert "nearest" in mark["how"] or distances.min() < 1e-4


@needs_faces
@pytest.mark.parametrize("name", REAL)
@pytest.mark.parametrize("forward", [None, (0.0, 0.0, 1.0), (0.0, 0.4, 2.0)])
def test_real_faces_are_turned_outward(name, forward):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FaceWrinkleWarning)
        mesh = read_surface(FACES / f"{name}.obj")
    clean = prepare(mesh, forward=forward)
    assert all("runs through itself" in line for line in clean.report)  # lips and lids may touch; nothing is changed
    assert same_triangles(clean.triangles, mesh.regular_faces)
    with pytest.warns(FaceWrinkleWarning, match="inward"):
        turned = prepare(to_polydata(mesh.points, mesh.regular_faces[:, ::-1]), forward=forward)
    assert same_triangles(turned.triangles, mesh.regular_faces)


@needs_faces
def test_gltf_with_one_mesh_in_nested_blocks():
    mesh = read_surface(FACES / "ict_face_narrow_anim.glb")
    assert (mesh.n_points, mesh.n_cells) == (6706, 2 * 6560)
    assert not [name for name in mesh.point_data if name.startswith("target")]  # morph targets are read_animation's


OBJ = """# a pyramid with a quad, colours, negative numbers and a continued line
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


def test_colours_of_any_range(tmp_path):
    """Up to 1, to 255 or, in 16 bits, to 65535: the same colours."""
    grey = np.array([0, 51, 255])
    rows = [f"v {i} {i * i} 0 {g} {g} {g}" for i, g in enumerate(grey)]
    (tmp_path / "a.obj").write_text("\n".join([*rows, "f 1 2 3"]))
    np.testing.assert_array_equal(read_surface(tmp_path / "a.obj")["Colors"], np.dstack([grey] * 3)[0])
    for kind, values in (("float", grey / 255), ("float", grey), ("ushort", 257 * grey), ("uchar", grey)):
        head = ["ply", "format ascii 1.0", "element vertex 3", *(f"property float {axis}" for axis in "xyz")]
        head += [*(f"property {kind} {name}" for name in ("red", "green", "blue")), "element face 1"]
        rows = [f"{i} {i * i} 0 {g} {g} {g}" for i, g in enumerate(values)]
        head += ["property list uchar int vertex_indices", "end_header", *rows, "3 0 1 2"]
        (tmp_path / "a.ply").write_text("\n".join(head) + "\n")
        found = np.asarray(read_surface(tmp_path / "a.ply")["Colors"])
        shown = found if found.dtype == np.uint8 else np.rint(255 * found)
        np.testing.assert_array_equal(shown, np.dstack([grey] * 3)[0], kind)


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


def test_strips_of_a_ply_are_split(tmp_path):
    path = tmp_path / "strip.ply"
    path.write_text(STRIP_PLY)
    assert same_triangles(read_surface(path).regular_faces, [[0, 1, 2], [2, 1, 3]])
    path.write_text(STRIP_PLY.replace("4 0 1 2 3", "8 0 1 2 -1 1 3 2 2"))
    assert same_triangles(read_surface(path).regular_faces, [[0, 1, 2], [1, 3, 2]])


DRACO = """{"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_draco_mesh_compression"],
"extensionsUsed": ["KHR_draco_mesh_compression"], "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
"accessors": [{"componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]}]}"""
BAD_FILES = {
    "empty.ply": ("", "is empty.*Export it again"),
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
    "ply.obj": (STRIP_PLY, "no points.*It begins like PLY: if it is, name it ply.ply"),
    "fbx.obj": ("Kaydara FBX Binary  ", "FBX, which is not read; export the mesh as OBJ"),
    "solid.ply": ("solid thing", "no header.*begins like STL.*solid.stl"),
    "draco.gltf": (DRACO, "KHR_draco_mesh_compression.*without compression, or as OBJ"),
    "scene.fbx": ("noise", "no reader for '.fbx'.*OBJ, OFF, PLY"),
    "nothing": ("noise", "no reader for a file without an ending"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_files(tmp_path, name, capfd):
    content, message = BAD_FILES[name]
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(MeshError, match=f"(?s){message}") as caught:
        read_surface(path)
    assert name in str(caught.value)
    assert capfd.readouterr() == ("", "")  # VTK's own complaints are in the message, not on the terminal


def test_no_file_and_a_folder(tmp_path):
    for name in ("x" * 300 + ".obj", "~nobody-of-that-name/x.obj", "null\0.obj"):
        with pytest.raises(MeshError, match="no file|cannot be opened"):
            read_surface(name)
    os.mkfifo(tmp_path / "pipe.obj")
    with pytest.raises(MeshError, match="no ordinary file"):
        read_surface(tmp_path / "pipe.obj")
    with pytest.raises(MeshError, match="there is no file .*Check the path"):
        read_surface(tmp_path / "missing.obj")
    with pytest.raises(MeshError, match="is a folder"):
        read_surface(tmp_path)


def test_obj_with_texture_numbers_that_lead_nowhere(tmp_path):
    path = tmp_path / "texture.obj"
    path.write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.5 0.5\nf 1/{9**30} 2/-{9**30} 3/1\n")
    np.testing.assert_array_equal(read_surface(path).active_texture_coordinates, [[0, 0], [0, 0], [0.5, 0.5]])


@pytest.mark.parametrize(
    ("faces", "message"),
    [([2, 0, 1], "three points"), ([3, 0, 1, -4], "from 0 to 3"), ([4, 0, 1, 2, 10**6], "from 0 to 3")],
)
def test_faces_that_lead_out_of_the_points(faces, message):
    mesh = pv.PolyData()
    mesh.points = np.eye(4, 3)
    mesh.faces = np.array([3, 0, 1, 2, *faces])
    with pytest.raises(MeshError, match=message):
        read_surface(mesh)


# --- foreign meshes -----------------------------------------------------------------------------


def test_input_is_copied_and_unchanged():
    mesh = cap()
    before = fingerprint(mesh)
    read = read_surface(mesh)
    read.points[:] = 0.0
    read["identity"][:] = 0
    surface = prepare(mesh)
    surface.points[:] = 0.0
    surface.mesh.points[:] = 0.0
    surface.mesh["identity"][:] = 0
    assert fingerprint(mesh) == before


def test_polygons_lines_strips_and_float32():
    points = np.array([[0, 0, 0], [2, 0, 0], [3, 1, 0], [1, 1, 0], [2, 2, 0]], dtype=np.float32)
    mesh = pv.PolyData(points, faces=[4, 0, 1, 2, 3, 3, 3, 2, 4], lines=[2, 0, 4], verts=[1, 4])
    read = read_surface(mesh)
    assert read.points.dtype == np.float64
    assert same_triangles(read.regular_faces, [[0, 1, 3], [1, 2, 3], [3, 2, 4]])  # the shorter diagonal
    assert (read.n_lines, read.n_verts) == (0, 0)
    strips = pv.PolyData(points, strips=[4, 0, 1, 3, 2])
    assert same_triangles(read_surface(strips).regular_faces, [[0, 1, 3], [1, 2, 3]])


def test_unstructured_grid_keeps_the_numbers():
    original = cap()
    grid = pv.UnstructuredGrid(
        {pv.CellType.TRIANGLE: original.regular_faces + 1}, np.vstack([[[9.0, 9.0, 9.0]], original.points])
    )
    grid["identity"] = np.arange(grid.n_points)
    mesh = read_surface(grid)
    np.testing.assert_array_equal(mesh.points, grid.points)
    np.testing.assert_array_equal(mesh.regular_faces, original.regular_faces + 1)
    np.testing.assert_array_equal(prepare(grid).mesh["identity"], np.arange(1, grid.n_points))


def test_volume_cells_have_no_surface():
    with pytest.raises(MeshError, match=r"holds HEXAHEDRON.*extract_surface"):
        read_surface(pv.ImageData(dimensions=(3, 3, 3)).cast_to_structured_grid())


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
    assert both.array_names == []  # the eye has none
    with pytest.raises(MeshError, match="holds no surface"):
        read_surface(pv.MultiBlock())


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


def test_other_objects():
    with pytest.raises(MeshError, match="received dict"):
        read_surface({})
    with pytest.raises(MeshError, match=r"shape \(m, 3\), received \(1, 4\)"):
        read_surface(SimpleNamespace(vertices=np.eye(4)[:, :3], faces=[[0, 1, 2, 3]]))
    with pytest.raises(MeshError, match="is a Table"):
        read_surface(pv.Table(np.eye(3)))


# --- prepare ------------------------------------------------------------------------------------


def test_a_clean_surface_stays_as_it_is():
    mesh = cap()
    surface = prepare(mesh)
    np.testing.assert_array_equal(surface.triangles, mesh.regular_faces)
    np.testing.assert_array_equal(surface.points, mesh.points)
    np.testing.assert_array_equal(surface.source_points, np.arange(mesh.n_points))
    assert (surface.triangles.dtype, surface.points.dtype, surface.report) == (np.int32, np.float64, ())


def test_stale_normals_stay_behind():
    mesh = cap().compute_normals(cell_normals=False)
    assert "Normals" in mesh.point_data
    assert prepare(mesh).mesh.array_names == ["identity", "colour"]


def test_no_points_and_no_faces():
    with pytest.raises(MeshError, match="has no points"):
        prepare(pv.PolyData())
    with pytest.raises(MeshError, match="3 points and no faces.*reconstruct_surface"):
        prepare(pv.PolyData(np.eye(3)))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e60])
def test_points_that_are_not_finite(value):
    mesh = cap()
    mesh.points[[7, 20], 1] = value
    with pytest.raises(MeshError, match=r"2 of 144 points are NaN, infinite or beyond.*first is point 7.*Delete them"):
        prepare(mesh)


def test_degenerate_and_duplicate_triangles_are_dropped():
    mesh = cap()
    spoiled = mesh_of(
        np.vstack([mesh.points, mesh.points[[0, 1]].mean(axis=0)]),
        np.vstack(
            [
                [[0, 1, 144]],
                [[5, 5, 6]],
                mesh.regular_faces,
                mesh.regular_faces[3:5, [1, 2, 0]],
                mesh.regular_faces[9:10, ::-1],
            ]
        ),
    )
    with pytest.warns(FaceWrinkleWarning) as caught:
        surface = prepare(spoiled)
    assert [str(w.message) for w in caught] == list(surface.report)
    assert re.search(r"duplicate triangles: 3 of 247", surface.report[0])
    assert re.search(r"degenerate triangles .*: 2 of 244", surface.report[1])
    np.testing.assert_array_equal(surface.triangles, mesh.regular_faces)
    np.testing.assert_array_equal(surface.points, mesh.points)


def test_nothing_but_degenerate_triangles():
    with pytest.raises(MeshError, match="all triangles are degenerate"):
        prepare(mesh_of([[0, 0, 0], [1, 1, 1], [3, 3, 3]], [[0, 1, 2]]))


def test_thin_triangles_are_kept():
    thin = mesh_of([[0, 0, 0], [1, 0, 0], [0.5, 1e-6, 0], [0.5, -1, 0]], [[0, 1, 2], [1, 0, 3]])
    assert len(prepare(thin).triangles) == 2


def test_a_fin_is_cut_off():
    mesh = cap()
    fin = mesh_of(np.vstack([mesh.points, [[0, 0, 5]]]), np.vstack([mesh.regular_faces, [[14, 13, 144]]]))
    with pytest.warns(FaceWrinkleWarning, match="three or more triangles: 1 of|set apart parts of 1 tri"):
        surface = prepare(fin)
    assert len(surface.report) == 2
    np.testing.assert_array_equal(surface.triangles, mesh.regular_faces)
    np.testing.assert_array_equal(surface.source_points, np.arange(144))
    np.testing.assert_array_equal(surface.others.points, fin.points[[13, 14, 144]])


def test_the_largest_part_is_chosen():
    speck, face, eye = sphere((5, 0, 0), 0.1, 16), cap(), sphere((0, 0, -1), 0.2)
    assert speck.n_cells > face.n_cells  # by area, not by count
    with pytest.warns(FaceWrinkleWarning) as caught:
        surface = prepare(joined(speck, face, eye))
    assert len(caught) == 1
    others = f"{speck.n_cells}, {eye.n_cells}"
    assert re.search(f"one of 3 .*largest, with 242 .*parts of {others} triangles", surface.report[0])
    np.testing.assert_array_equal(surface.triangles, face.regular_faces)
    np.testing.assert_array_equal(surface.source_points, speck.n_points + np.arange(face.n_points))


def test_landmarks_choose_the_part():
    hair, face = sphere((0, 0, 0), 9.0), cap()
    near = np.vstack([face.points[[3, 30, 60]] + 0.01, [[0, 0, 9.1]]])
    with pytest.warns(FaceWrinkleWarning, match="nearest to 3 of 4 landmarks"):
        surface = prepare(joined(hair, face), near=near)
    np.testing.assert_array_equal(surface.points, face.points)


def test_many_specks_make_one_short_warning():
    parts = [sphere((3.0 * k, 0, 5), 0.1) for k in range(15)]
    with pytest.warns(FaceWrinkleWarning) as caught:
        prepare(joined(cap(), *parts))
    assert len(caught) == 1
    listed = ", ".join([str(parts[0].n_cells)] * 10)
    assert "one of 16 separate parts" in str(caught[0].message)
    assert f"set apart parts of {listed}, ... triangles." in str(caught[0].message)


def test_inconsistent_orientation_is_mended():
    mesh = cap()
    triangles = mesh.regular_faces.copy()
    triangles[[0, 7, 100]] = triangles[[0, 7, 100], ::-1]
    with pytest.warns(FaceWrinkleWarning, match=r"oriented against their neighbours: 3 of 242"):
        surface = prepare(mesh_of(mesh.points, triangles))
    assert same_triangles(surface.triangles, mesh.regular_faces)
    assert topology.is_oriented(surface.triangles)


@settings(max_examples=30, deadline=None)
@given(st.sets(st.integers(0, 241)), st.randoms(use_true_random=False))
def test_any_damage_to_the_orientation_is_mended(flipped, random):
    mesh = cap()
    triangles = mesh.regular_faces.copy()
    triangles[sorted(flipped)] = triangles[sorted(flipped), ::-1]
    order = list(range(len(triangles)))
    random.shuffle(order)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FaceWrinkleWarning)
        surface = prepare(mesh_of(mesh.points, triangles[order]))
    assert same_triangles(surface.triangles, mesh.regular_faces)


def test_a_moebius_strip_cannot_be_oriented():
    t = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    inner, outer = (
        np.column_stack([(2 + w * np.cos(t / 2)) * np.cos(t), (2 + w * np.cos(t / 2)) * np.sin(t), w * np.sin(t / 2)])
        for w in (-0.5, 0.5)
    )
    a = np.arange(20)
    b = np.roll(a, -1)
    low, high = a, a + 20
    low_next = np.where(b == 0, 20, b)  # the strip closes with a half turn
    high_next = np.where(b == 0, 0, b + 20)
    strip = np.vstack([np.column_stack([low, low_next, high]), np.column_stack([low_next, high_next, high])])
    with pytest.raises(MeshError, match="only one side"):
        prepare(mesh_of(np.vstack([inner, outer]), strip))


@pytest.mark.parametrize("forward", [None, (0, 0, 1), (0.5, 0.5, 2)])
@pytest.mark.parametrize("shape", ["mask", "closed"])
def test_surfaces_that_look_inward_are_turned(shape, forward):
    mesh = cap() if shape == "mask" else sphere((40, -30, 7), 2.0)
    with pytest.warns(FaceWrinkleWarning, match="inward"):
        surface = prepare(mesh_of(mesh.points, mesh.regular_faces[:, ::-1]), forward=forward)
    assert same_triangles(surface.triangles, mesh.regular_faces)
    assert prepare(mesh, forward=forward).report == ()


def test_forward_decides_for_a_hollow_and_for_a_plane():
    bowl = cap()
    bowl.points[:, 2] *= -1  # its triangles look up, into the hollow
    assert prepare(bowl, forward=(0, 0, 1)).report == ()
    with pytest.warns(FaceWrinkleWarning, match="inward"):
        assert same_triangles(prepare(bowl, forward=(0, 0, -1)).triangles, bowl.regular_faces[:, ::-1])
    plane = cap()
    plane.points[:, 2] = 0.0
    down = mesh_of(plane.points, plane.regular_faces[:, ::-1])
    assert prepare(plane).report == prepare(down).report == ()
    with pytest.warns(FaceWrinkleWarning, match="inward"):
        prepare(down, forward=(0, 0, 1))


def test_unused_points_go_and_data_stay_with_their_points():
    mesh = cap()
    half_of = np.r_[60:100, 181:221]  # both triangles of each square
    half = mesh_of(mesh.points, mesh.regular_faces[half_of], identity=mesh["identity"], colour=mesh["colour"])
    half["uv"] = mesh.points[:, :2]
    half.point_data.active_texture_coordinates_name = "uv"
    half.field_data["subject"] = ["someone"]
    surface = prepare(half)
    used = np.unique(half.regular_faces)
    np.testing.assert_array_equal(surface.source_points, used)
    np.testing.assert_array_equal(surface.mesh["identity"], used)
    np.testing.assert_array_equal(surface.mesh["colour"], mesh["colour"][used])
    np.testing.assert_array_equal(surface.mesh.active_texture_coordinates, mesh.points[used, :2])
    np.testing.assert_array_equal(used[surface.triangles], half.regular_faces)
    assert list(surface.mesh.field_data["subject"]) == ["someone"]
    np.testing.assert_array_equal(surface.mesh.points, surface.points)
    np.testing.assert_array_equal(surface.mesh.regular_faces, surface.triangles)


@pytest.mark.parametrize("near", [[[0, 0]], [[0, 0, np.nan]]])
def test_bad_landmarks(near):
    with pytest.raises(ParameterError, match="near must be finite vectors"):
        prepare(cap(), near=np.array(near))


@pytest.mark.parametrize("forward", [(0, 0, 0), (0, 1), (np.inf, 0, 0)])
def test_bad_direction(forward):
    with pytest.raises(ParameterError, match="forward must be"):
        prepare(cap(), forward=forward)


# --- out ----------------------------------------------------------------------------------------


def test_to_polydata_round_trip():
    mesh = cap()
    data = {name: np.linspace(0, 1, mesh.n_points) for name in ARRAYS}
    data["rest"] = mesh.points * 2
    data["muscle"] = np.arange(mesh.n_points) - 1
    out = to_polydata(mesh.points, mesh.regular_faces.astype(np.int32), data)
    np.testing.assert_array_equal(out.points, mesh.points)
    np.testing.assert_array_equal(out.regular_faces, mesh.regular_faces)
    assert out.array_names == list(ARRAYS)
    for name, values in data.items():
        np.testing.assert_array_equal(out[name], values)
        assert out[name].dtype == values.dtype
    again = prepare(out)
    np.testing.assert_array_equal(again.triangles, mesh.regular_faces)


def test_to_polydata_shares_no_memory():
    mesh = cap()
    points, triangles, values = mesh.points.copy(), mesh.regular_faces.copy(), np.ones(mesh.n_points)
    out = to_polydata(points, triangles, {"W": values})
    points[:], triangles[:], values[:] = 0, 0, 0
    np.testing.assert_array_equal(out.points, mesh.points)
    np.testing.assert_array_equal(out.regular_faces, mesh.regular_faces)
    np.testing.assert_array_equal(out["W"], 1.0)


@pytest.mark.parametrize(
    ("points", "triangles", "data", "message"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], {}, r"points must have the shape \(n, 3\), received \(3, 2\)"),
        (np.eye(3), [[0.0, 1.0, 2.0]], {}, "must be integers"),
        (np.eye(3), [[0, 1, 2, 0]], {}, r"received int64 of \(1, 4\)"),
        (np.eye(3), [[0, 1, 3]], {}, "from 0 to 2, received 0 to 3"),
        (np.eye(3), [[-1, 1, 2]], {}, "received -1 to 2"),
        (np.eye(3), [[0, 1, 2]], {"W": np.zeros(2)}, "'W' must have 3 rows.*received 2"),
    ],
)
def test_to_polydata_checks(points, triangles, data, message):
    with pytest.raises(MeshError, match=message):
        to_polydata(points, np.array(triangles), data)


def test_refine_splits_one_triangle_and_closes_around_it() -> None:
    plane = pv.Plane(i_resolution=2, j_resolution=2).triangulate()
    plane.point_data["affine"] = plane.points @ [1.0, 2.0, 3.0] + 0.5
    plane.point_data["label"] = np.arange(plane.n_points)
    before = plane.copy()
    fine = refine(plane, [0])
    corners = set(plane.regular_faces[0].tolist())
    inner = [s for s in range(3) if _is_inner(plane, plane.regular_faces[0][[s, (s + 1) % 3]])]
    assert fine.n_cells == plane.n_cells + 3 + len(inner)
    assert np.array_equal(fine.points[: plane.n_points], plane.points)
    assert fine.area == pytest.approx(plane.area, rel=1e-12)
    np.testing.assert_allclose(fine["affine"], fine.points @ [1.0, 2.0, 3.0] + 0.5, atol=1e-12)
    assert set(fine["label"][plane.n_points :].tolist()) <= corners
    assert plane == before


def _is_inner(surface: pv.PolyData, edge: np.ndarray) -> bool:
    return int(np.isin(surface.regular_faces, edge).sum(axis=1).tolist().count(2)) == 2


@pytest.mark.parametrize("vertices", [[["a", "b", "c"]], [[1, 2], [3]], np.eye(3) + 1j, None])
def test_vertices_that_are_no_numbers(vertices):
    with pytest.raises(MeshError, match="points must be an array of real numbers"):
        read_surface(SimpleNamespace(vertices=vertices, faces=[[0, 1, 2]]))
    with pytest.raises(MeshError, match="faces must be an array of real numbers"):
        read_surface(SimpleNamespace(vertices=np.eye(3), faces=vertices))


@pytest.mark.parametrize("copy", [True, False])
def test_polydata_share_memory_with_the_arrays_only_where_asked(copy):
    points, values = np.random.default_rng(0).random((2, 3, 3))
    mesh = to_polydata(points, np.array([[0, 1, 2]]), {"v": values}, copy=copy)
    assert np.shares_memory(mesh.points, points) is not copy
    assert np.shares_memory(mesh["v"], values) is not copy
    assert np.array_equal(mesh["v"], values)
    assert mesh.regular_faces.tolist() == [[0, 1, 2]]
