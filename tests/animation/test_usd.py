"""USD stages with time samples, written here with usd-core.

what                  checked against
points                the arrays that went into the stage, at and between its time codes
place                 products of scipy's rotations, scales and shifts; the pose leads from rest to there
faces                 polygons, left-handed and mirrored meshes
bones, blend shapes   closed forms
meshes beside         what each does on its own
which mesh            the choice among several
what cannot be read   the errors that name it
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from facewrinkle.errors import FaceWrinkleWarning, MeshError, UnknownNameError

pytest.importorskip("pxr")

from pxr import Gf, Usd, UsdGeom, Vt

POINTS = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0.5], [2, 1, 0]], float)
QUADS = [[0, 1, 4, 3], [1, 2, 5, 4]]
SPLIT = ([0, 1, 4], [0, 4, 3], [1, 2, 4], [2, 5, 4], [0, 1, 3], [1, 4, 3], [1, 2, 5], [1, 5, 4])
TRIANGLES = {frozenset(corners) for corners in SPLIT}
SHAPES = POINTS + np.random.default_rng(2).integers(-8, 8, (3, 6, 3)) / 32.0
CODES = [1.0, 13.0, 25.0]  # at 24 a second: 0 s is not the first


def face(stage, path="/head/skin", codes=CODES, shapes=SHAPES, faces=QUADS):
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreateFaceVertexCountsAttr([len(f) for f in faces])
    mesh.CreateFaceVertexIndicesAttr([v for f in faces for v in f])
    for code, shape in zip(codes, shapes, strict=True):
        mesh.CreatePointsAttr().Set(Vt.Vec3fArray.FromNumpy(shape.astype(np.float32)), code)
    return mesh


@pytest.fixture
def stage(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "face.usda"))
    stage.SetTimeCodesPerSecond(24.0)
    UsdGeom.Xform.Define(stage, "/head")
    return stage


def moved(mesh, recorded, time):
    return recorded.positions_at(recorded.recorded_time(time), np.asarray(mesh.points))


def read(stage, **which):
    stage.Save()
    return fw.read_animation(stage.GetRootLayer().realPath, **which)


def test_points_move_with_the_time_samples(stage):
    face(stage)
    mesh, recorded = read(stage)
    np.testing.assert_array_equal(mesh.points, SHAPES[0])
    assert mesh.n_cells == 4
    assert {frozenset(t) for t in mesh.regular_faces.tolist()} <= TRIANGLES
    assert (mesh.n_open_edges, recorded.duration, recorded.pose) == (6, 1.0, None)
    for time, expected in ((0.0, SHAPES[0]), (0.5, SHAPES[1]), (0.75, 0.5 * (SHAPES[1] + SHAPES[2])), (9.0, SHAPES[2])):
        np.testing.assert_allclose(moved(mesh, recorded, time), expected, atol=1e-12)
    frame = fw.Simulation(mesh, motion=recorded, time_step=0.5).step()
    np.testing.assert_allclose(frame.points, SHAPES[1], atol=1e-12)


def test_a_head_that_turns_while_it_speaks(stage):
    UsdGeom.Xformable(face(stage)).AddScaleOp().Set((2.0, 2.0, 2.0))
    head = UsdGeom.Xform.Get(stage, "/head")
    shift, turn = head.AddTranslateOp(), head.AddRotateYOp()
    for code, y, angle in ((1.0, 3.0, 0.0), (37.0, 5.0, 60.0)):  # longer than the points move
        shift.Set(Gf.Vec3d(0.0, y, 0.0), code)
        turn.Set(angle, code)
    mesh, recorded = read(stage)
    assert recorded.duration == 1.5
    np.testing.assert_allclose(mesh.points, 2.0 * SHAPES[0] + [0.0, 3.0, 0.0], atol=1e-12)
    for time in (0.0, 0.4, 1.0, 1.25, 1.5):
        own = np.array([np.interp(time, [0.0, 0.5, 1.0], column) for column in SHAPES.reshape(3, -1).T]).reshape(-1, 3)
        turned = Rotation.from_euler("y", 40.0 * time, degrees=True).apply(2.0 * own)
        shifted = np.add(turned, [0.0, 3.0 + time * 4 / 3, 0.0])
        np.testing.assert_allclose(moved(mesh, recorded, time), shifted, atol=1e-6)
    # Its pose is what eyes and hair go with.
    pose = [*fw.Simulation(mesh, motion=recorded, time_step=0.25).run(4)][-1].field_data["pose"]
    np.testing.assert_allclose(pose[:3, :3], Rotation.from_euler("y", 40.0, degrees=True).as_matrix(), atol=1e-6)
    np.testing.assert_allclose(pose @ [0.0, 3.0, 0.0, 1.0], [0.0, 3.0 + 4 / 3, 0.0, 1.0], atol=1e-6)


def test_a_place_that_moves_without_points(stage):
    face(stage, codes=CODES[:1], shapes=SHAPES[:1])
    shift = UsdGeom.Xform.Get(stage, "/head").AddTranslateOp()
    for code, x in ((0.0, 0.0), (48.0, 4.0)):
        shift.Set(Gf.Vec3d(x, 0.0, 0.0), code)
    mesh, recorded = read(stage)
    np.testing.assert_allclose(moved(mesh, recorded, 1.0), SHAPES[0] + [2.0, 0.0, 0.0], atol=1e-9)


def test_the_outside_is_out_whichever_way_the_mesh_is_turned(stage):
    normals = []
    for path, hand, mirror in (("/a", "rightHanded", 1.0), ("/b", "leftHanded", 1.0), ("/c", "rightHanded", -1.0)):
        skin = face(stage, path, shapes=SHAPES[:, :] * [1.0, 1.0, 0.0])
        skin.CreateOrientationAttr(hand)
        UsdGeom.Xformable(skin).AddScaleOp().Set((mirror, 1.0, 1.0))
        mesh, _ = read(stage, mesh=path[1:])
        flat = mesh.compute_normals(point_normals=False, auto_orient_normals=False)
        normals.append(flat.cell_data["Normals"][:4, 2])  # other meshes come after it
    np.testing.assert_allclose(normals, [[1.0] * 4, [-1.0] * 4, [1.0] * 4], atol=1e-6)


def test_among_several_meshes_the_one_that_deforms_is_taken(stage):
    face(stage, "/head/hat", codes=[1.0], shapes=np.vstack([POINTS, POINTS])[None], faces=[*QUADS, [6, 7, 10, 9]])
    face(stage)
    mesh, recorded = read(stage)
    assert (recorded.n_points, mesh.n_points) == (6, 6 + 8)  # two of its points at one place are one
    np.testing.assert_allclose(mesh.points[:6], recorded.rest)
    face(stage, "/head/more", shapes=np.concatenate([SHAPES, SHAPES], axis=1))
    with pytest.warns(FaceWrinkleWarning, match="2 meshes that may be meant: more, skin"):
        assert read(stage)[1].n_points == 12
    assert read(stage, mesh="skin")[1].n_points == read(stage, mesh="/head/skin")[1].n_points == 6
    with pytest.raises(UnknownNameError, match="unknown mesh 'skim'. Did you mean 'skin'"):
        read(stage, mesh="skim")


RIGGED = """#usda 1.0
(
    endTimeCode = 24
    startTimeCode = 0
    timeCodesPerSecond = 24
)
def SkelRoot "head"
{
    def Mesh "skin" (
        prepend apiSchemas = ["SkelBindingAPI"]
    )
    {
        int[] faceVertexCounts = [4, 4]
        int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0.5), (2, 1, 0)]
        int[] primvars:skel:jointIndices = [0, 0, 1, 0, 0, 1] (
            elementSize = 1
            interpolation = "vertex"
        )
        float[] primvars:skel:jointWeights = [1, 1, 1, 1, 1, 1] (
            elementSize = 1
            interpolation = "vertex"
        )
        uniform token[] skel:blendShapes = ["smile"]
        rel skel:blendShapeTargets = </head/skin/smile>
        rel skel:skeleton = </head/skeleton>
        def BlendShape "smile"
        {
            uniform vector3f[] offsets = [(0, 0, 1)]
            uniform int[] pointIndices = [3]
        }
    }
    def Skeleton "skeleton" (
        prepend apiSchemas = ["SkelBindingAPI"]
    )
    {
        uniform token[] joints = ["head", "head/jaw"]
        uniform matrix4d[] bindTransforms = [
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (1, 0, 0, 1))
        ]
        uniform matrix4d[] restTransforms = [
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (1, 0, 0, 1))
        ]
        rel skel:animationSource = </head/skeleton/animation>
        def SkelAnimation "animation"
        {
            uniform token[] joints = ["head", "head/jaw"]
            float3[] translations = [(0, 0, 0), (1, 0, 0)]
            half3[] scales = [(1, 1, 1), (1, 1, 1)]
            quatf[] rotations.timeSamples = {
                0: [(1, 0, 0, 0), (1, 0, 0, 0)],
                24: [(1, 0, 0, 0), (0.70710677, 0, 0, 0.70710677)],
            }
            uniform token[] blendShapes = ["smile"]
            float[] blendShapeWeights.timeSamples = {
                0: [0],
                24: [1],
            }
        }
    }
}
"""


def test_bones_and_blend_shapes(stage):
    stage.GetRootLayer().ImportFromString(RIGGED)
    mesh, recorded = read(stage)
    np.testing.assert_allclose(mesh.points, POINTS, atol=1e-6)
    assert recorded.duration == 1.0
    expected = POINTS + np.outer([0, 0, 0, 1, 0, 0], [0.0, 0.0, 1.0])
    jaw = POINTS[:, 0] == 2.0
    expected[jaw] = [[1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]  # (2, 0, 0) and (2, 1, 0), a quarter about (1, 0, 0)
    np.testing.assert_allclose(moved(mesh, recorded, 1.0), expected, atol=1e-5)
    assert UsdGeom.Mesh.Get(stage, "/head/skin").GetPointsAttr().GetTimeSamples() == []  # the file stays as it is


def test_other_meshes_have_recordings_of_their_own(stage):
    face(stage, shapes=np.tile(SHAPES, (1, 2, 1)), faces=[*QUADS, [6, 7, 10, 9]])
    eye = face(stage, "/head/eye", codes=[1.0], shapes=POINTS[None])
    face(stage, "/head/lashes")
    face(stage, "/head/hat", codes=[1.0], shapes=POINTS[None])
    turn = UsdGeom.Xformable(eye).AddRotateYOp()
    for code, angle in ((1.0, 0.0), (25.0, 80.0)):
        turn.Set(angle, code)
    mesh, recorded = read(stage, mesh="skin")
    n = recorded.n_points
    assert {start: own.n_points for start, own in recorded.companions.items()} == {n: 6, n + 6: 6}
    first = recorded.track.times[0]
    half = Rotation.from_euler("y", 40.0, degrees=True).apply(POINTS)
    np.testing.assert_allclose(recorded.companions[n].positions_at(first + 0.5, POINTS), half, atol=1e-6)
    np.testing.assert_allclose(recorded.companions[n + 6].positions_at(first + 0.5, SHAPES[0]), SHAPES[1], atol=1e-12)
    np.testing.assert_allclose(mesh.points[n + 6 : n + 12], SHAPES[0])


def test_what_cannot_be_played_says_so(stage, tmp_path):
    with pytest.raises(MeshError, match="holds no mesh"):
        read(stage)
    skin = face(stage, codes=[1.0], shapes=SHAPES[:1])
    with pytest.raises(MeshError, match="skin keeps still: it has no time samples.*blend shapes"):
        read(stage)
    skin.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(POINTS[:5].astype(np.float32)), 9.0)
    with pytest.raises(MeshError, match="skin changes from 6 to 5 points"):
        read(stage)
    skin.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(POINTS.astype(np.float32)), 9.0)
    for faces in ([0, 1, 4, 3, 1, 2, 5, 77], [0, 1, 4, 3, 1, 2, 5]):
        skin.GetFaceVertexIndicesAttr().Set(faces)
        with pytest.raises(MeshError, match="faces of skin use points that do not exist"):
            read(stage)
    for code in (1.0, 9.0):
        skin.GetFaceVertexIndicesAttr().Set([v for f in QUADS for v in f], code)
    with pytest.raises(MeshError, match="faces of skin change with time"):
        read(stage)
    (tmp_path / "broken.usdc").write_bytes(b"PXR-USDC" + bytes(40))
    with pytest.raises(MeshError, match="broken.usdc cannot be read: USD does not understand it. Export it again."):
        fw.read_animation(tmp_path / "broken.usdc")
