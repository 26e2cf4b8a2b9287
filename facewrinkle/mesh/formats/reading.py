"""Files and foreign meshes become triangles as PolyData."""

from __future__ import annotations

import logging
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from stat import S_ISDIR, S_ISREG
from typing import Any

import numpy as np
import pyvista as pv
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkDataObject

from ...errors import MeshError
from ..arrays import COLORS, IMAGE, MOVED, TEXTURE, blended, images_of, name_images, numbers, to_polydata, with_data
from ..seams import add_seams, corner_texture
from .gltf import read_gltf_file
from .materials import sibling_file
from .obj_off import Polygons, Primitive, polygon_triangles, read_obj, read_off
from .ply import read_ply
from .usd import read_usd_file

OF_VTK = (".stl", ".vtk", ".vtp", ".vtu", ".vtm", ".vtkhdf", ".hdf")
GLTF = (".glb", ".gltf", ".vrm")
USD = (".usd", ".usda", ".usdc", ".usdz")
READABLE = "OBJ, OFF, PLY, STL, glTF, VTK (.vtk, .vtp, .vtu, .vtm, .vtkhdf), USD"


def read_surface(source: object) -> pv.PolyData:
    """The triangles of a file or of a foreign mesh, with the points numbered as they are there.

    Polygons are split into triangles (along the shorter diagonal of a quad). Where the texture has seams, points keep
    the first of their texture coordinates, and the cell data "Texture Corners" holds those of all corners. Point data
    and field data come along; lines and loose points are passed over.

    Parameters
    ----------
    source : path, PyVista or VTK data set, or trimesh-like object
        OBJ, OFF, PLY, STL, glTF, USD or a VTK format; a data set of faces, or a multi-block of several; an object
        with `vertices` (n, 3) and `faces` (m, 3).

    Returns
    -------
    pyvista.PolyData
        Triangles only, float64 points; a new object.

    Raises
    ------
    MeshError
        If there is no such file, if it cannot be read, or if no single surface is in it.

    Examples
    --------
    >>> import pyvista as pv
    >>> read_surface(pv.Plane(i_resolution=2, j_resolution=3)).n_cells
    12
    """
    if isinstance(source, str | Path):
        return _read_file(Path(os.path.expanduser(source)))  # Path.expanduser fails for unknown users
    if isinstance(source, vtkDataObject):
        return _from_dataset(source if isinstance(source, pv.DataObject) else pv.wrap(source), "the mesh")
    if hasattr(source, "vertices") and hasattr(source, "faces"):
        return _from_trimesh(source)
    raise MeshError(
        "a mesh must be a path, a PyVista or VTK data set, or an object with vertices and faces such as a "
        "trimesh.Trimesh, "
        f"received {type(source).__name__}."
    )


def _read_file(path: Path) -> pv.PolyData:
    check_file(path)
    try:
        return _read_by_ending(path)
    except MeshError as problem:
        kind = _looks_like(path)
        if kind is None or path.suffix.lower() in kind[1]:
            raise
        raise MeshError(f"{problem} It begins like {kind[0]}: if it is, name it {path.stem}{kind[1][0]}.") from None


SIGNS: tuple[tuple[bytes, str, tuple[str, ...]], ...] = (
    (b"ply", "PLY", (".ply",)),
    (b"glTF", "binary glTF", (".glb", ".vrm")),
    (b"solid", "STL", (".stl",)),
    (b"OFF", "OFF", (".off",)),
    (b"# vtk DataFile", "a legacy VTK file", (".vtk",)),
    (b"<?xml", "an XML file of VTK", (".vtp", ".vtu", ".vtm")),
    (b"<VTKFile", "an XML file of VTK", (".vtp", ".vtu", ".vtm")),
    (b"\x89HDF", "VTKHDF", (".vtkhdf", ".hdf")),
    (b"PXR-USDC", "USD", (".usdc", ".usd")),
    (b"#usda", "USD", (".usda", ".usd")),
    (b"Kaydara FBX", "FBX, which is not read; export the mesh as OBJ", (".fbx",)),
    (b"\x89PNG", "a PNG picture", (".png",)),
    (b"\xff\xd8\xff", "a JPEG picture", (".jpg",)),
    (b"PK\x03\x04", "a zip archive", (".zip", ".usdz", ".face")),
)
"""What files begin with, and the endings that they should have."""


def _looks_like(path: Path) -> tuple[str, tuple[str, ...]] | None:
    """What a file is by its first bytes, and the endings of such files."""
    with path.open("rb") as file:
        begin = file.read(20)
    return next(((kind, endings) for sign, kind, endings in SIGNS if begin.startswith(sign)), None)


def _read_by_ending(path: Path) -> pv.PolyData:
    match path.suffix.lower():
        case ".obj":
            return from_polygons(read_obj(path), path.name, path.parent)
        case ".off":
            return from_polygons(read_off(path), path.name)
        case ".ply":
            return from_polygons(read_ply(path), path.name)
        case ending if ending in GLTF:
            return from_primitives(read_gltf_file(path), path)
        case ending if ending in USD:
            return from_primitives(read_usd_file(path), path)
        case ending if ending in OF_VTK:
            return _from_dataset(_read_with_vtk(path), path.name)
    if path.suffix == ".face":
        raise MeshError(f"{path.name} holds a face that has been fitted: facewrinkle.read_face(path), or --face PATH.")
    ending = f"for {path.suffix!r}" if path.suffix else "for a file without an ending"
    raise MeshError(f"{path.name}: there is no reader {ending}. Export the mesh as one of: {READABLE}.")


def check_file(path: Path) -> None:
    """Raise a MeshError if a file is not there, cannot be opened, or is empty."""
    try:
        status = path.stat()
        if S_ISREG(status.st_mode):  # to open a pipe would wait for ever
            with path.open("rb"):
                pass
    except (FileNotFoundError, NotADirectoryError, ValueError):  # a null byte is a ValueError
        raise MeshError(
            f"there is no file {str(path)!r}. Check the path; it is relative to {str(Path.cwd())!r}."
        ) from None
    except OSError as problem:
        raise MeshError(f"{str(path)!r} cannot be opened: {problem.strerror}.") from None
    if not S_ISREG(status.st_mode):
        what = "a folder" if S_ISDIR(status.st_mode) else "no ordinary file"
        raise MeshError(f"{str(path)!r} is {what}, and a mesh file is needed.")
    if status.st_size == 0:
        raise MeshError(f"{path.name} is empty (0 bytes). Export it again.")


@contextmanager
def _complaints() -> Iterator[list[str]]:
    """Collects what VTK's readers complain of; they would print it several times over."""
    heard: list[str] = []

    def collect(record: logging.LogRecord) -> bool:
        heard.append(record.getMessage().splitlines()[0])
        return False

    root = logging.getLogger()
    root.addFilter(collect)
    try:
        with warnings.catch_warnings(), pv.vtk_verbosity("off"), pv.VtkErrorCatcher():
            warnings.simplefilter("ignore")
            yield heard
    finally:
        root.removeFilter(collect)


def _read_with_vtk(path: Path) -> Any:
    data = None
    with _complaints() as heard:
        try:
            data = pv.get_reader(str(path)).read()
        except Exception as problem:  # every format fails in its own way
            heard.append(str(problem).splitlines()[-1])
    if data is None or _is_empty(data):
        telling = [line for line in heard if not line.startswith("Algorithm")]
        reason = telling[0] if telling else "nothing is in it that VTK understands"
        raise MeshError(
            f"{path.name} cannot be read: {reason.rstrip('.')}. The file is damaged or of another format: "
            "export it again, or as OBJ or PLY."
        )
    return data


def from_primitives(primitives: list[Primitive], path: Path) -> pv.PolyData:
    """All meshes of a scene as one surface, without the seams at which their points are split."""
    return united(primitives, path)[0]


def united(primitives: list[Primitive], path: Path) -> tuple[pv.PolyData, np.ndarray, np.ndarray]:
    """The same, and with it which points (p,) of all primitives it has, and what their shapes (k, p, 3) are."""
    if not primitives:
        raise MeshError(f"{path.name} holds no triangles. Export the face with its geometry, as a mesh.")
    starts = np.cumsum([0, *(len(part.points) for part in primitives)])
    count = max(0 if part.shapes is None else len(part.shapes) for part in primitives)
    shapes = np.zeros((count, starts[-1], 3))
    borne = np.zeros((starts[-1], 3))
    colors = np.full((starts[-1], 3), 255, np.uint8)
    for part, start, end in zip(primitives, starts[:-1], starts[1:], strict=True):
        if part.shapes is not None:
            shapes[: len(part.shapes), start:end] = part.shapes
        if part.weights is not None:
            borne[start:end] = part.weights @ np.cos(np.outer(np.arange(part.weights.shape[1]), [1.0, 1.4, 1.7]))
        if part.colors is not None:
            colors[start:end] = part.colors
    points = np.concatenate([part.points for part in primitives])
    triangles = np.concatenate([part.triangles + start for part, start in zip(primitives, starts[:-1], strict=True)])
    kept, number = welded(points, np.concatenate([shapes, borne[None]]), triangles)
    mesh = to_polydata(points[kept], number[triangles])
    shapes = shapes[:, kept]
    if count or borne.any():  # other bones lead elsewhere
        mesh.point_data[MOVED] = blended(shapes) + borne[kept] * np.ptp(points, axis=0).max()
    if any(part.colors is not None for part in primitives):
        mesh.point_data[COLORS] = colors[kept]
    if any(part.texture is not None for part in primitives):
        nothing = [np.zeros((len(part.triangles), 3, 2)) for part in primitives]
        at_corners = np.concatenate(
            [none if part.texture is None else part.texture for part, none in zip(primitives, nothing, strict=True)]
        )
        lay_texture(mesh, at_corners)
    images = ["" if part.texture is None else part.image for part in primitives]
    lengths = [len(part.triangles) for part in primitives]
    _name_images(mesh, np.concatenate([np.broadcast_to(i, m) for i, m in zip(images, lengths, strict=True)]))
    return mesh, kept, shapes


def _name_images(mesh: pv.PolyData, images: np.ndarray) -> None:
    """Say which image lies on each triangle (m,), "" for none."""
    known, number = np.unique(images, return_inverse=True)  # which puts "" first
    bare = int("" in known)
    if len(known) > bare:
        mesh.cell_data[IMAGE] = number.ravel() - bare
        name_images(mesh, known[bare:].tolist())


def lay_texture(mesh: pv.PolyData, at_corners: np.ndarray) -> None:
    """Give a mesh its texture coordinates (m, 3, 2): points the first that they have, corners where these differ."""
    triangles = np.asarray(mesh.regular_faces)
    texture = np.zeros((mesh.n_points, 2))
    texture[triangles.ravel()[::-1]] = at_corners.reshape(-1, 2)[::-1]  # the first is written last
    mesh.point_data[TEXTURE] = texture
    mesh.point_data.active_texture_coordinates_name = TEXTURE
    add_seams(mesh, at_corners)


def welded(points: np.ndarray, shapes: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One point in place of all those that a seam of texture or shading splits it into.

    They lie on borders, at the same place, and move alike; those of lips or lids that touch move differently.

    Parameters
    ----------
    points : (n, 3) float
    shapes : (k, n, 3) float
        Displacements of the mesh's morph targets.
    triangles : (m, 3) int

    Returns
    -------
    kept : (p,) int
        Points that are kept, the first of each seam.
    number : (n,) int
        Which of the kept ones each point is.
    """
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    border = np.unique(edges[count == 1])
    first = np.arange(len(points))
    if len(border):
        rows = np.concatenate([points[None], shapes])[:, border].transpose(1, 0, 2).reshape(len(border), -1)
        _, one, same = np.unique(rows, axis=0, return_index=True, return_inverse=True)
        first[border] = border[one][same.ravel()]
    kept, number = np.unique(first, return_inverse=True)
    return kept, number.ravel()


def _is_empty(data: Any) -> bool:
    if isinstance(data, pv.MultiBlock):
        return all(_is_empty(block) for block in data)
    return data is None or (isinstance(data, pv.DataSet) and data.n_points == 0)


def from_polygons(polygons: Polygons, name: str, folder: Path | None = None) -> pv.PolyData:
    """The triangles of the polygons of a file, with its name for errors, and its folder where the images lie."""
    padded = [number for face in polygons.faces for number in (len(face), *face)]
    mesh = pv.PolyData()
    mesh.points = polygons.points
    mesh.faces = np.array(padded, dtype=np.int64)
    if polygons.texture is not None:
        mesh.point_data[TEXTURE] = polygons.texture
        mesh.point_data.active_texture_coordinates_name = TEXTURE
    if polygons.colors is not None:
        mesh.point_data[COLORS] = _colours(polygons.colors)
    surface = _from_dataset(mesh, name)
    if polygons.corners is not None:
        add_seams(surface, _at_triangles(polygons.corners, polygons.faces, mesh))
    if folder is not None and polygons.images and polygons.texture is not None:
        places = {
            name: str((sibling_file(folder, name) or folder / name).absolute()) for name in set(polygons.images) - {""}
        }
        images = np.array([places.get(name, "") for name in polygons.images])
        face = np.repeat(np.arange(len(images)), [len(face) for face in polygons.faces])[:, None]
        _name_images(surface, images[_at_triangles(face, polygons.faces, mesh)[:, 0, 0]])
    return surface


def _colours(values: np.ndarray) -> np.ndarray:
    """Colours as uint8 or from 0 to 1, of those that go to 1, to 255 or, in 16 bits, to 65535."""
    if values.dtype == np.uint8 or not values.size or not values.max() > 1:
        return values
    share = values / (255.0 if values.max() <= 255 else 65535.0)
    return np.asarray(np.rint(255.0 * np.clip(share, 0.0, 1.0)), dtype=np.uint8)


def _at_triangles(values: np.ndarray, faces: list[list[int]], mesh: pv.PolyData) -> np.ndarray:
    """Values (c, d) of the corners of polygons, at the corners (m, 3, d) of the triangles that they are split into."""
    vertices = np.array([vertex for face in faces for vertex in face], dtype=np.int64)
    counts = np.array([len(face) for face in faces], dtype=np.int64)
    if (counts == 3).all():
        return np.asarray(values.reshape(len(faces), 3, -1))
    return np.asarray(values[polygon_triangles(np.asarray(mesh.points, dtype=np.float64)[vertices], counts)])


def _from_trimesh(source: Any) -> pv.PolyData:
    faces = numbers("faces", source.faces)
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise MeshError(f"faces must have the shape (m, 3), received {faces.shape}. Triangulate the mesh first.")
    mesh = to_polydata(source.vertices, faces)
    visual = getattr(source, "visual", None)
    texture = getattr(visual, "uv", None)
    if texture is not None and len(texture) == mesh.n_points:
        mesh.point_data[TEXTURE] = np.array(texture, dtype=np.float64)
        mesh.point_data.active_texture_coordinates_name = TEXTURE
    if visual is not None and getattr(visual, "kind", None) == "vertex":
        mesh.point_data[COLORS] = np.array(visual.vertex_colors)
    return mesh


def _from_dataset(data: Any, name: str) -> pv.PolyData:
    """The triangles of any data set that holds one surface."""
    if isinstance(data, pv.MultiBlock):
        blocks = [(path, block) for path, block in _leaves(data) if _count_faces(block)]
        if not blocks:
            raise MeshError(f"{name} holds no surface: none of its {data.n_blocks} blocks has faces.")
        return joined([_from_dataset(block, f"{name}, block {path!r}") for path, block in blocks])
    if not isinstance(data, pv.DataSet):
        raise MeshError(f"{name} is a {type(data).__name__}, which holds no surface. Pass a PolyData.")
    if not isinstance(data, pv.PolyData):
        data = _faces_of_grid(data.cast_to_unstructured_grid(), name)
    if data.n_points == 0:
        raise MeshError(f"{name} has no points: it is no mesh, or empty. Export it again, or name another file.")
    if not _count_faces(data):
        raise MeshError(
            f"{name} has {data.n_points} points and no faces. A surface is needed: export polygons (not "
            "points or lines), or reconstruct one with mesh.reconstruct_surface()."
        )
    _check_cells(data, name)
    surface = with_data(data, _triangles(data), np.arange(data.n_points))
    if IMAGE in data.cell_data and data.is_all_triangles:  # what was read here once
        surface.cell_data[IMAGE] = data.cell_data[IMAGE]
    return surface


NOTHING = {COLORS: np.uint8(255), MOVED: 0.0}
"""What stands for colours and motion where a mesh has none beside others that have."""


def joined(surfaces: list[pv.PolyData]) -> pv.PolyData:
    """Surfaces side by side, with the point data that all of them have, and their texture where some have none."""
    if len(surfaces) == 1:
        return surfaces[0]
    starts = np.cumsum([0, *(surface.n_points for surface in surfaces[:-1])])
    data = {}
    for key in dict.fromkeys(key for surface in surfaces for key in surface.point_data):
        shape = next(surface.point_data[key].shape[1:] for surface in surfaces if key in surface.point_data)
        rows = [
            np.asarray(s.point_data[key]) if key in s.point_data else np.full((s.n_points, *shape), NOTHING[key])
            for s in surfaces
            if key in s.point_data or key in NOTHING
        ]
        if len(rows) == len(surfaces) and all(row.shape[1:] == shape for row in rows):
            data[key] = np.concatenate(rows)
    mesh = to_polydata(
        np.concatenate([surface.points for surface in surfaces]),
        np.concatenate([surface.regular_faces + start for surface, start in zip(surfaces, starts, strict=True)]),
        data,
    )
    corners = [corner_texture(surface) for surface in surfaces]
    if any(own is not None for own in corners):
        rows = [np.zeros((s.n_cells, 3, 2)) if c is None else c for s, c in zip(surfaces, corners, strict=True)]
        lay_texture(mesh, np.concatenate(rows))
    if any(IMAGE in surface.cell_data for surface in surfaces):
        names = [np.array([*images_of(s), ""]) for s in surfaces]
        numbered = [np.asarray(s.cell_data.get(IMAGE, np.full(s.n_cells, -1))) for s in surfaces]
        _name_images(mesh, np.concatenate([own[number] for own, number in zip(names, numbered, strict=True)]))
    return mesh


def _leaves(data: pv.MultiBlock, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """The blocks that are no multi-blocks, with their paths."""
    for number, (key, block) in enumerate(zip(data.keys(), data, strict=True)):
        path = f"{prefix}{key or number}"
        if isinstance(block, pv.MultiBlock):
            yield from _leaves(block, f"{path}/")
        else:
            yield path, block


def _count_faces(data: Any) -> int:
    if isinstance(data, pv.PolyData):
        return data.n_faces + data.n_strips
    return data.n_cells if isinstance(data, pv.DataSet) else 0


def _faces_of_grid(grid: pv.UnstructuredGrid, name: str) -> pv.PolyData:
    """The faces of an unstructured grid; unlike with `extract_surface`, its points keep their numbers."""
    faces = {pv.CellType.TRIANGLE, pv.CellType.POLYGON, pv.CellType.QUAD}
    passed_over = {pv.CellType.VERTEX, pv.CellType.POLY_VERTEX, pv.CellType.LINE, pv.CellType.POLY_LINE}
    others = {pv.CellType(kind) for kind in np.unique(grid.celltypes)} - faces - passed_over
    if others:
        raise MeshError(
            f"{name} must hold triangles, quads or polygons, and holds "
            f"{', '.join(sorted(kind.name for kind in others))}. "
            "Take its surface first: mesh.extract_surface()."
        )
    kept = np.isin(grid.celltypes, [int(kind) for kind in faces])
    mesh = pv.PolyData()
    mesh.points = grid.points
    mesh.faces = grid.cells[np.repeat(kept, np.diff(grid.cell_offsets) + 1)]
    mesh.point_data.update(grid.point_data)
    return mesh


def _check_cells(mesh: pv.PolyData, name: str) -> None:
    """Raise a MeshError for faces that would lead VTK out of its arrays, where it brings the interpreter down."""
    for cells in (mesh.GetPolys(), mesh.GetStrips()):
        ends, numbers = vtk_to_numpy(cells.GetOffsetsArray()), vtk_to_numpy(cells.GetConnectivityArray())
        if (np.diff(ends) < 3).any() or (len(ends) and (ends[0] != 0 or ends[-1] != len(numbers))):
            raise MeshError(
                f"each face of {name} must have three points or more. The data are damaged: export it again."
            )
        if len(numbers) and (numbers.min() < 0 or numbers.max() >= mesh.n_points):
            raise MeshError(
                f"the faces of {name} must use points from 0 to {mesh.n_points - 1}, received {numbers.min()} to "
                f"{numbers.max()}. The data are damaged: export it again."
            )


def _triangles(mesh: pv.PolyData) -> np.ndarray:
    """(m, 3) vertex numbers of the faces, polygons and strips split."""
    if mesh.n_strips:
        mesh = mesh.triangulate()
    if mesh.is_all_triangles:
        return np.array(mesh.regular_faces, dtype=np.int64)
    polys = mesh.GetPolys()
    ends, vertices = vtk_to_numpy(polys.GetOffsetsArray()), vtk_to_numpy(polys.GetConnectivityArray())
    split = polygon_triangles(np.asarray(mesh.points, dtype=np.float64)[vertices], np.diff(ends))
    return np.array(vertices[split], dtype=np.int64)
