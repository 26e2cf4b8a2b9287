"""Meshes of files as plain arrays; OBJ, OFF and STL files, with the points numbered as in the file.

VTK's OBJ reader splits each point at which several texture coordinates meet, so that the mesh falls apart and landmark
files no longer fit; VTK has no OFF reader, and damaged files crash that of STL.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from io import StringIO
from pathlib import Path

import numpy as np
import pyvista as pv

from ...errors import MeshError, warn
from ...files import bytes_of, sibling_file, text_of
from ..arrays import COLORS
from ..surface import Piece, Surface


def polygon_triangles(corners: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Split polygons into triangles (m, 3), given as numbers of corners.

    Parameters
    ----------
    corners : ndarray, shape (c, 3)
        Positions of the corners of all polygons, one after the other.
    counts : ndarray of int, shape (p,)
        Number of corners of each polygon, three at least.

    Examples
    --------
    >>> arrow = np.array([[0.0, 0, 0], [2, -1, 0], [0.5, 0, 0], [2, 1, 0]])  # hollow at its third corner
    >>> polygon_triangles(arrow, np.array([4])).tolist()
    [[0, 1, 2], [0, 2, 3]]
    """
    if (counts == 3).all():
        return np.arange(3 * len(counts)).reshape(-1, 3)
    starts = np.cumsum(counts) - counts
    whole = pv.PolyData()
    whole.points = corners
    whole.faces = np.insert(np.arange(counts.sum()), starts, counts)
    whole.cell_data["polygon"] = np.arange(len(counts))
    split = whole.triangulate()
    triangles = np.asarray(split.regular_faces, dtype=np.int64).reshape(-1, 3)
    polygon = np.asarray(split.cell_data["polygon"], dtype=np.int64) if len(triangles) else np.zeros(0, np.int64)
    # VTK leaves out polygons that it cannot split, such as those that name a point twice: these become fans.
    left = np.setdiff1d(np.arange(len(counts)), polygon)
    if len(left):
        sides = counts[left] - 2
        begin = np.repeat(starts[left], sides)
        step = np.arange(sides.sum()) - np.repeat(np.cumsum(sides) - sides, sides)
        fans = np.stack([begin, begin + step + 1, begin + step + 2], axis=1)
        order = np.argsort(np.concatenate([polygon, np.repeat(left, sides)]), kind="stable")
        triangles = np.concatenate([triangles, fans])[order]
    return triangles


def _lines(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the words of each line that has any, without comments, with continued lines put together."""
    painted = r"(?i)#MRGB (?:[\da-f]{8})+\s*$"  # a comment of ZBrush: mask and color of points, eight digits each
    words: list[str] = []
    for number, line in enumerate(StringIO(text_of(path), newline=None), start=1):
        content = line[1:] if line[0] == "#" and re.match(painted, line) else uncommented(line).rstrip()
        continued = content.endswith("\\")
        words += content.rstrip("\\").split()
        if words and not continued:
            yield number, words
            words = []
    if words:
        yield number, words


def _broken(path: Path, number: int, words: list[str]) -> MeshError:
    return MeshError(
        f"{path.name}, line {number}: cannot make sense of {' '.join(words)[:60]!r}. "
        "The file is damaged or of another format: export it again."
    )


def _array(rows: list[list[float]], columns: int) -> np.ndarray:
    return np.array(rows, dtype=np.float64).reshape(-1, columns)


def read_obj(path: Path) -> Surface:
    """Read the polygons of a Wavefront OBJ file, and the images of their materials; normals and lines are ignored.

    Raises
    ------
    MeshError
        For a line with something other than numbers, which it names, or a face whose vertex does not exist.
    """
    points: list[list[float]] = []
    colors: list[list[float]] = []
    painted = bytearray()  # mask and color of every point
    texture: list[list[float]] = []
    counts: list[int] = []
    vertices: list[int] = []
    corners: list[int] = []  # the texture coordinates of every corner, -1 for none
    libraries: list[str] = []
    pieces: dict[tuple[str, str, str], int] = {}  # the numbers of object, group and material
    piece_of_face: list[int] = []
    material, thing, group = "", "", ""
    for number, words in _lines(path):
        try:
            match words[0]:
                case "v":
                    points.append([float(words[1]), float(words[2]), float(words[3])])
                    if len(words) >= 7:
                        colors.append([float(words[4]), float(words[5]), float(words[6])])
                case "MRGB":
                    painted += bytes.fromhex(words[1])
                case "vt":
                    texture.append([float(words[1]), float(words[2]) if len(words) > 2 else 0.0])
                case "f":
                    face, numbers = _obj_face(words[1:], len(points), len(texture))
                    counts.append(len(face))
                    vertices += face
                    corners += numbers
                    piece_of_face.append(pieces.setdefault((thing, group, material), len(pieces)))
                case "usemtl":
                    material = " ".join(words[1:])
                case "o":
                    thing, group = " ".join(words[1:]), ""
                case "g":
                    group = " ".join(words[1:])
                case "mtllib":
                    libraries.append(" ".join(words[1:]))
        except (ValueError, IndexError):
            raise _broken(path, number, words) from None
    order = np.array(vertices, dtype=np.int64)
    triangles, of_triangle = split_polygons(path, _array(points, 3), np.array(counts, dtype=np.int64), order)
    of_corners = textured(order, np.array(corners, dtype=np.int64), _array(texture, 2), len(points))
    places: dict[str, str] = {}
    if of_corners is not None:
        known = images_of_materials(path.parent, libraries)
        if not any(name for *_, name in pieces):  # it uses no material, so the only image is meant
            known = _only_image(path, known)
        places = {name: image_place(path.parent, known.get(name, "")) for name in sorted({name for *_, name in pieces})}
    meshes = {pair: number for number, pair in enumerate(dict.fromkeys(names[:2] for names in pieces))}
    return Surface(
        _array(points, 3),
        order[triangles],
        None if of_corners is None else of_corners[triangles],
        _colors(colors, painted, len(points)),
        pieces=tuple(
            Piece(meshes[thing, group], f"{group}/{thing}/{material}".strip("/"), places.get(material, ""))
            for thing, group, material in pieces
        ),
        piece=np.array(piece_of_face, dtype=np.int64)[of_triangle],
    )


def _colors(colors: list[list[float]], painted: bytearray, count: int) -> dict[str, np.ndarray]:
    """Colors (n, 3) of the points of an OBJ file, beside their coordinates or painted in ZBrush."""
    if 0 < len(painted) == 4 * count:
        return {COLORS: np.frombuffer(painted, np.uint8).reshape(-1, 4)[:, 1:]}
    return {COLORS: _array(colors, 3)} if 0 < len(colors) == count else {}


def _only_image(path: Path, known: dict[str, str]) -> dict[str, str]:
    """The image on faces without a material, of those of the materials that a file has and does not use."""
    names = sorted(set(known.values()))
    if len(names) > 1:
        warn(
            f"{path.name} has the materials of {len(names)} images and uses none of them (it has no usemtl): the "
            f"texture is left out. Give one as texture: {', '.join(names[:8])}."
        )
    return {"": names[0]} if len(names) == 1 else {}


def _obj_face(words: list[str], n_points: int, n_texture: int) -> tuple[list[int], list[int]]:
    """Vertices of one face, and texture coordinates of its corners (-1 for none); negative numbers count back."""
    face, numbers = [], []
    for word in words:
        parts = word.split("/")
        vertex = int(parts[0])
        vertex += n_points if vertex < 0 else -1
        if vertex < 0:
            raise IndexError
        face.append(vertex)
        coordinate = int(parts[1]) if len(parts) > 1 and parts[1] else 0
        coordinate += n_texture if coordinate < 0 else -1
        numbers.append(coordinate if 0 <= coordinate < 2**31 else -1)
    if len(face) < 3:
        raise ValueError
    return face, numbers


def split_polygons(
    path: Path, points: np.ndarray, counts: np.ndarray, vertices: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return triangles (m, 3), as numbers of corners, and the polygon (m,) of each.

    `counts` (f,) are the numbers of corners of the polygons, and `vertices` (c,) the points of all corners.

    Raises
    ------
    MeshError
        If a polygon uses a vertex that does not exist.
    """
    n_points = len(points)
    wrong = (vertices < 0) | (vertices >= n_points)
    if wrong.any():
        ends = np.cumsum(counts)
        number = int(np.searchsorted(ends, np.argmax(wrong), side="right"))
        face = vertices[ends[number] - counts[number] : ends[number]].tolist()
        raise MeshError(
            f"{path.name}: face {number + 1} uses vertices {face} (counted from 0), and the file has {n_points} "
            "vertices. The file is damaged or incomplete: export it again."
        )
    triangles = polygon_triangles(points[vertices], counts)
    return triangles, np.repeat(np.arange(len(counts)), counts)[triangles[:, 0]]


def textured(vertices: np.ndarray, corners: np.ndarray, texture: np.ndarray, n_points: int) -> np.ndarray | None:
    """Return the texture coordinates (c, 2) of corners; those without have the first that their point has, or 0.

    `vertices` (c,) are the points of all corners, `corners` (c,) their numbers of texture coordinates, -1 for none;
    numbers too large, which some modelers write, are ignored. None if all are.
    """
    given = np.flatnonzero((corners >= 0) & (corners < len(texture)))
    if not len(given):
        return None
    known, first = np.unique(vertices[given], return_index=True)
    coordinates = np.zeros((n_points, 2))
    coordinates[known] = texture[corners[given[first]]]
    of_corners = coordinates[vertices]
    of_corners[given] = texture[corners[given]]
    return of_corners


def read_off(path: Path) -> Surface:
    """Read the polygons of an ASCII OFF file (also COFF, NOFF and so on); colors and normals are ignored.

    Raises
    ------
    MeshError
        For another header, a binary file, a line with something other than numbers, or fewer lines than announced.
    """
    lines = list(_lines(path))
    header = lines[0][1] if lines else ["nothing"]
    if not header[0].upper().endswith("OFF") or "BINARY" in (word.upper() for word in header):
        raise MeshError(
            f"{path.name} must begin with OFF and hold text, and begins with {' '.join(header)[:40]!r}. "
            "Save it as ASCII OFF, OBJ or PLY."
        )
    if len(header) > 1:  # the counts may follow on the same line
        lines[0] = (lines[0][0], header[1:])
    else:
        lines = lines[1:]
    points: list[list[float]] = []
    counts: list[int] = []
    vertices: list[int] = []
    number, words = lines[0] if lines else (1, header)
    try:
        n_points, n_faces = int(words[0]), int(words[1])
        for index, (number, words) in enumerate(lines[1 : 1 + n_points + n_faces]):  # noqa: B007
            if index < n_points:
                points.append([float(words[0]), float(words[1]), float(words[2])])
            else:
                face = [int(word) for word in words[1 : 1 + int(words[0])]]
                if len(face) < 3 or len(face) != int(words[0]):
                    raise ValueError
                counts.append(len(face))
                vertices += face
    except (ValueError, IndexError):
        raise _broken(path, number, words) from None
    if len(points) < n_points or len(counts) < n_faces:
        raise MeshError(
            f"{path.name} announces {n_points} points and {n_faces} faces, and holds {len(points)} and "
            f"{len(counts)}. The file is cut off: export it again."
        )
    order = np.array(vertices, dtype=np.int64)
    triangles, _ = split_polygons(path, _array(points, 3), np.array(counts, dtype=np.int64), order)
    return Surface(_array(points, 3), order[triangles])


def read_stl(path: Path) -> Surface:
    """Read the triangles of an STL file, text or binary; corners at the same place become one point.

    Raises
    ------
    MeshError
        If it holds no triangles, or numbers of corners that make none.
    """
    data = bytes_of(path)
    whole = len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little")  # of a binary file
    if not whole and data[:5].lower() == b"solid" and not any(byte > 127 for byte in data[:256]):
        words = re.findall(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", data, re.IGNORECASE)
        corners = np.array(words, dtype="S").astype(np.float32).reshape(-1, 3)
    else:  # the number of triangles in the header is often wrong
        record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
        corners = np.frombuffer(data, record, max(len(data) - 84, 0) // record.itemsize, 84)["corners"].reshape(-1, 3)
    if not len(corners) or len(corners) % 3:
        raise MeshError(
            f"{path.name} cannot be read: it holds {len(corners)} corners of triangles. The file is damaged or of "
            "another format: export it again, or as OBJ or PLY."
        )
    corners = np.ascontiguousarray(corners + np.float32(0.0))  # -0 is 0
    _, first, same = np.unique(corners.view("V12").ravel(), return_index=True, return_inverse=True)
    order = np.argsort(first)
    number = np.empty(len(order), np.int64)
    number[order] = np.arange(len(order))
    triangles = number[same.reshape(-1, 3)]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    return Surface(corners[first[order]].astype(np.float64), triangles)


# --- materials of OBJ files, and images beside files ----------------------------------------------------------


def uncommented(line: str) -> str:
    """Return a line without its comment; a number sign within a word is part of a name.

    Examples
    --------
    >>> uncommented("usemtl skin#2 # of the face")
    'usemtl skin#2 '
    """
    return re.sub(r"(?s)(?:^|(?<=\s))#.*", "", line) if "#" in line else line


def image_place(folder: Path, name: str) -> str:
    """The path of an image by the name that another file gives it, "" with a warning if it may not be read."""
    try:
        return name and str((sibling_file(folder, name) or folder / Path(name).name).absolute())
    except MeshError as problem:
        warn(f"the texture is left out: {problem}")
        return ""


def tinted(place: str, color: Sequence[float] | np.ndarray) -> str:
    """Return the place of an image whose light is multiplied by a color, as `a.glb#3*1,0.5,0.5`.

    Examples
    --------
    >>> tinted("skin.png", (1.0, 0.5, 0.25)), tinted("skin.png", (1.0, 1.0, 1.0))
    ('skin.png*1,0.5,0.25', 'skin.png')
    """
    plain = not place or all(share == 1.0 for share in color)
    return place if plain else f"{place}*{','.join(f'{share:g}' for share in color)}"


def _library_files(folder: Path, library: str) -> list[Path | None]:
    """Files of a line `mtllib`: a name with blanks, or several names; None for those that cannot be had."""
    try:
        whole = sibling_file(folder, library)
        names = dict.fromkeys(library.split()[:64])  # of one line, at most so many are looked for
        return [whole] if whole else [sibling_file(folder, name) for name in names]
    except MeshError as problem:
        warn(f"materials are left out: {problem}")
        return []


def images_of_materials(folder: Path, libraries: Iterable[str]) -> dict[str, str]:
    """Names of the images (`map_Kd`) of the materials in MTL files of a folder; missing files are ignored."""
    option = (
        r"-(?:(?:o|s|t)(?:\s+[-+.\deE]+){1,3}|mm(?:\s+\S+){2}|(?:blendu|blendv|cc|clamp|texres|imfchan|boost|bm)\s+\S+)"
        r"\s+"
    )
    images: dict[str, str] = {}
    for library in dict.fromkeys(libraries):
        for file in dict.fromkeys(_library_files(folder, library)):
            current = ""
            for line in () if file is None else StringIO(text_of(file), newline=None):
                word, *rest = line.strip().split(None, 1) or [""]
                if word == "newmtl":
                    current = " ".join(uncommented(*rest).split()) if rest else ""
                elif word.lower() == "map_kd" and rest and (name := re.sub(option, "", rest[0] + " ").strip(' "')):
                    images[current] = name
    return images
