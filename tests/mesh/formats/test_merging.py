"""Several meshes in one file: they stay apart where their borders touch, and a mesh stays whole where it is split.

what            checked against
formats         two sheets that share a border, written by pxr, VTK, our writer of glTF, and by hand as OBJ
repair          the numbers of points and of border edges that went in
"""

import numpy as np
import pytest
import pyvista as pv

from facewrinkle.errors import FaceWrinkleWarning
from facewrinkle.export.gltf import gltf
from facewrinkle.export.model import Model
from facewrinkle.export.usd import write_usd
from facewrinkle.mesh import prepare, read_surface, surface_in

SIDE = 4


def sheets():
    """Points and triangles of two sheets, the second along the upper border of the first, and bent back from it."""
    plane = pv.Plane(i_resolution=SIDE, j_resolution=SIDE).triangulate()
    points, triangles = np.asarray(plane.points, np.float64), np.asarray(plane.regular_faces, np.int64)
    upper = points[:, 1].max()
    back = np.column_stack([points[:, 0], np.full(len(points), upper), 0.8 * (points[:, 1] - upper)])
    return [(points, triangles), (back, triangles[:, ::-1])]


def models():
    up = [np.tile([0.0, 0.0, 1.0], (len(points), 1)) for points, _ in sheets()]
    plain = [Model(p, n, t, np.arange(len(p)), None, None, None) for (p, t), n in zip(sheets(), up, strict=True)]
    return dict(zip(("lips", "lining"), plain, strict=True))


def obj(path, heading, shared=False):
    lines, start = [], 1
    for number, (points, triangles) in enumerate(sheets()):
        lines += [f"v {x} {y} {z}" for x, y, z in points]
        lines += [f"{heading} part_{number}"]
        faces = triangles + start
        if shared and number:  # its border has the points of the first
            (first, _), (second, _) = sheets()
            for k, place in enumerate(second):
                if (same := np.flatnonzero((first == place).all(axis=1))).size:
                    faces = np.where(faces == k + start, same[0] + 1, faces)
        lines += [f"f {a} {b} {c}" for a, b, c in faces]
        start += len(points)
    path.write_text("\n".join(lines))


def test_meshes_keep_the_names_of_their_objects_when_they_are_put_together(tmp_path):
    obj(tmp_path / "a.obj", "o")
    sheet = pv.Plane(i_resolution=9, j_resolution=9, center=(9.0, 0.0, 0.0))
    with pytest.warns(FaceWrinkleWarning, match="separate parts"):
        surface = prepare(pv.MultiBlock([sheet, read_surface(tmp_path / "a.obj"), sheet.translate((9.0, 0.0, 0.0))]))
    others = surface.others
    first = np.unique(others.sheet, return_index=True)[1]
    assert [others.pieces[number].name for number in others.piece[first]] == ["part_0", "part_1", ""]
    np.testing.assert_array_equal(np.bincount(others.sheet), [32, 32, 162])


def save(kind, path):
    match kind:
        case "glb":
            path.write_bytes(gltf(models(), 1000.0, binary=True))
        case "usdc":
            pytest.importorskip("pxr")
            write_usd(path, models(), 1000.0, None)
        case "vtm":
            blocks = [pv.PolyData.from_regular_faces(*each) for each in sheets()]
            pv.MultiBlock(dict(zip(("lips", "lining"), blocks, strict=True))).save(path)
        case "o.obj" | "g.obj":
            obj(path, kind[0])


@pytest.mark.parametrize("kind", ["glb", "usdc", "vtm", "o.obj", "g.obj"])
def test_meshes_that_share_a_border_stay_apart(tmp_path, kind):
    save(kind, path := tmp_path / f"two.{kind}")
    (points, triangles), _ = sheets()
    surface = read_surface(path)
    assert surface.n_points == 2 * len(points)
    for source in (surface, path):  # the same for a mesh that was read before
        with pytest.warns(FaceWrinkleWarning, match="Kept one of 2 separate parts"):
            clean = prepare(source)
        np.testing.assert_allclose(clean.points, points, atol=1e-6)  # the larger one
        np.testing.assert_array_equal(clean.source_points, np.arange(len(points)))
        assert clean.others is not None
        assert len(clean.others.triangles) == len(triangles)


def test_landmarks_on_both_make_them_one(tmp_path):
    """A face may be several meshes of its file."""
    save("glb", path := tmp_path / "two.glb")
    (first, _), (second, _) = sheets()
    inner = second[second[:, 2] < -0.1]
    with pytest.warns(FaceWrinkleWarning, match=f"Joined points .* split along seams: {SIDE + 1} of"):
        clean = prepare(path, near=np.concatenate([first, inner[:4]]))
    assert clean.others is None
    assert len(clean.points) == 2 * (SIDE + 1) ** 2 - (SIDE + 1)
    for few in (first, np.concatenate([first, inner[:3]])):  # those on the border lie on the first
        with pytest.warns(FaceWrinkleWarning, match="Kept one of 2 separate parts"):
            assert len(prepare(path, near=few).points) == len(first)


def test_groups_that_share_points_are_one_mesh(tmp_path):
    obj(path := tmp_path / "one.obj", "g", shared=True)
    assert not surface_in(path).meshes.any()
    assert prepare(path).others is None


def test_a_mesh_is_joined_where_its_file_splits_it():
    """As two primitives of a mesh of a glTF file, and as one surface whose points are doubled."""
    both = sheets()
    points = np.concatenate([points for points, _ in both])
    triangles = np.concatenate([both[0][1], both[1][1] + len(both[0][0])])
    with pytest.warns(FaceWrinkleWarning, match="Joined points"):
        clean = prepare(pv.PolyData.from_regular_faces(points, triangles))
    assert clean.others is None
