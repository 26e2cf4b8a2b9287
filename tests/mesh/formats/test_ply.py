"""PLY files: text and binary, whole and damaged."""

import numpy as np
import pytest
from small_meshes import same_triangles

from facewrinkle.errors import MeshError
from facewrinkle.mesh.formats.ply import read_ply

HEADER = """ply
format {order} 1.0
comment a quad between two triangles
element camera 1
property list uchar short places
property double angle
element vertex 5
property float x
property double y
property float z
property uchar red
property uchar green
property uchar blue
property float s
property float t
element face 3
property uchar flags
property list uchar int vertex_indices
end_header
"""
POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 2, 0.25]])
COLORS = np.arange(15).reshape(5, 3) * 10
TEXTURE = POINTS[:, :2] / 2
FACES = [[0, 1, 2], [0, 2, 3, 4], [4, 3, 2]]
TRIANGLES = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [4, 3, 2]]
"""The quad is split along its shorter diagonal."""


def written(order: str) -> bytes:
    """The file of the header, number by number."""
    mark = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}[order]
    rows: list[list[tuple[str, float]]] = [[("u1", 2), ("i2", 7), ("i2", -7), ("f8", 0.5)]]
    for point, color, st in zip(POINTS, COLORS, TEXTURE, strict=True):
        numbers = zip(("f4", "f8", "f4", "u1", "u1", "u1", "f4", "f4"), (*point, *color, *st), strict=True)
        rows.append(list(numbers))
    rows += [[("u1", 1), ("u1", len(face)), *(("i4", number) for number in face)] for face in FACES]
    header = HEADER.format(order=order).encode()
    if mark is None:
        return header + "".join(" ".join(f"{value:g}" for _, value in row) + "\n" for row in rows).encode()
    return header + b"".join(np.array(value).astype(mark + kind).tobytes() for row in rows for kind, value in row)


@pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_everything_is_read_in_any_order_of_bytes(tmp_path, order):
    path = tmp_path / "mesh.ply"
    path.write_bytes(written(order))
    found = read_ply(path)
    np.testing.assert_array_equal(found.points, POINTS)
    assert same_triangles(found.triangles, TRIANGLES)
    np.testing.assert_array_equal(found.texture, TEXTURE[found.triangles])
    np.testing.assert_array_equal(found.point_data["Colors"], COLORS)
    assert found.point_data["Colors"].dtype == np.uint8


@pytest.mark.parametrize("ends", [b"\r\n", b"\r"])
def test_text_with_other_ends_of_lines(tmp_path, ends):
    path = tmp_path / "mesh.ply"
    path.write_bytes(written("ascii").replace(b"\n", ends))
    assert same_triangles(read_ply(path).triangles, TRIANGLES)


@pytest.mark.parametrize("order", ["ascii", "binary_little_endian"])
def test_files_that_are_cut_off(tmp_path, order):
    whole = written(order).rstrip(b"\n")
    path = tmp_path / "mesh.ply"
    for length in range(1, len(whole) - (1 if order == "ascii" else 0), 3):  # every number of the text has one digit
        path.write_bytes(whole[:length])
        with pytest.raises(MeshError, match="mesh.ply cannot be read"):
            read_ply(path)


BAD = {
    "count": ("element vertex 5", "element vertex five", "its header says 'element vertex five'"),
    "negative": ("element face 3", "element face -3", "announces.*-3 x face"),
    "kind": ("property float z", "property real z", "its header says"),
    "order": ("format ascii", "format middle_endian", "its header says"),
    "format": ("format ascii 1.0\n", "", "names no format"),
    "axis": ("property float z", "property float w", "no x, y and z"),
    "twice": ("property float z", "property float x", "do not hold them"),
    "short": ("1 3 4 3 2", "1 2 4 3", "face 3 has 2 points"),
    "range": ("1 3 4 3 2", "1 3 4 3 5", "face 3 uses vertices.*has 5 vertices"),
    "nan index": ("1 3 4 3 2", "1 3 4 3 nan", "face 3 uses vertices"),
    "nan length": ("1 3 4 3 2", "1 nan 4 3 2", "do not hold them"),
    "fraction": ("1 3 4 3 2", "1 2.5 4 3 2", "do not hold them"),
    "word": ("1 3 4 3 2", "1 3 4 three 2", "do not hold them"),
}


@pytest.mark.parametrize(("old", "new", "message"), BAD.values(), ids=BAD)
def test_text_that_makes_no_sense(tmp_path, old, new, message):
    text = written("ascii").decode()
    assert old in text
    path = tmp_path / "mesh.ply"
    path.write_text(text.replace(old, new))
    with pytest.raises(MeshError, match=message):
        read_ply(path)
