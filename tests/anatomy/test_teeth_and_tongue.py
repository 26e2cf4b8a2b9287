"""Teeth: closed crowns in two symmetric arches behind the lips, that bite over one another and go with the face.

The tongue: a closed body that keeps its volume on its way out.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from small_meshes import enclosed_volume

import facewrinkle as fw
from facewrinkle.anatomy.teeth import BELOW_LIPS, CROWN_WIDTHS, GUM, OVERBITE, OVERJET, Arch, teeth_of
from facewrinkle.anatomy.tongue import lip_crest, tongue_paint, tongue_points, tongue_triangles


@pytest.fixture(scope="module")
def arches(face: fw.Face) -> tuple[Arch, Arch]:
    return teeth_of(face.landmarks, face.frame)


def local(face: fw.Face, points: np.ndarray) -> np.ndarray:
    """Left, up, forward from the middle of the lips."""
    return (points - fw.anatomy.lips_middle(face.landmarks)) @ face.frame.axes.T


def crowns(arch: Arch) -> list[np.ndarray]:
    """Triangles of the closed parts."""
    regions = fw.geometry.components(arch.triangles)
    return sorted([arch.triangles[regions == region] for region in np.unique(regions)], key=len)[:-1]


def test_fourteen_crowns_in_each_jaw_that_enclose_their_volume(arches):
    """Open at the root only: closed with the mean of the last ring, the volume is positive and that of a tooth."""
    for arch in arches:
        parts = crowns(arch)
        assert len(parts) == 2 * len(CROWN_WIDTHS[arch.jaw])
        for triangles in parts:
            (rim,) = fw.geometry.boundary_loops(triangles)
            root = arch.points[rim].mean(axis=0)
            assert 100.0 < enclosed_volume(arch.points - root, triangles) < 1000.0


def test_crowns_have_the_cusps_of_their_kind(face, arches):
    """Canines have one tip; premolars two cusps and molars four, around a pit that is 1 to 2 mm deep."""
    for arch in arches:
        up = local(face, arch.points)[:, 1] / face.frame.scale
        height = -up if arch.jaw == "upper" else up
        ordered = sorted(crowns(arch), key=np.min)[::2]  # of the left half, from the middle backwards
        for crown, cusps in zip(ordered[2:], (1, 2, 2, 4, 4), strict=True):
            edge, pit = height[crown.min() + np.arange(14)], height[crown.max()]
            peaks = (edge > np.roll(edge, 1)) & (edge >= np.roll(edge, -1))
            assert peaks.sum() == cusps
            assert cusps == 1 or 1.0 < edge[peaks].mean() - pit < 2.0


def test_canines_are_yellower_than_incisors_and_necks_than_edges(arches):
    """Blue, relative to red, along the middle of the outer faces."""
    for arch in arches:
        first = [crown.min() for crown in sorted(crowns(arch), key=np.min)[::2]]
        red, _, blue = np.stack([arch.paint[k : k + 98 : 14].astype(float) for k in first]).transpose(2, 0, 1)
        white = blue / red
        assert (np.diff(white[:3], axis=1) < 0.0).all()
        assert white[:, 2].argmin() == 2
        assert white[:, 2].argmax() == 0


def test_molars_stand_higher_than_incisors(face, arches):
    """Downs measured 1.5 to 14 degrees between the occlusal plane and the horizontal of the skull."""
    for arch in arches:
        place = local(face, arch.points)
        teeth = [place[crown.min() + np.arange(14)].mean(axis=0) for crown in sorted(crowns(arch), key=np.min)]
        rise, back = (teeth[-1] - teeth[0])[1:] * [1.0, -1.0]
        assert 1.5 < np.rad2deg(np.arctan2(rise, back)) < 14.0


def test_gums_face_the_lips(face, arches):
    """In the middle, where light falls on them from ahead."""
    for arch in arches:
        gum = (arch.paint == np.rint(GUM)).all(axis=1)
        points, normals = (
            local(face, arch.points),
            fw.geometry.vertex_normals(arch.points, arch.triangles) @ face.frame.axes.T,
        )
        ahead = gum & (np.abs(points[:, 0]) < 5.0) & (points[:, 2] > points[gum, 2].max() - 1.5)
        assert ahead.sum() > 5
        assert np.median(normals[ahead, 2]) > 0.9


def test_arches_are_mirror_symmetric(face, arches):
    for arch in arches:
        points = np.round(local(face, arch.points), 6) + 0.0
        assert {tuple(p) for p in (points * [-1, 1, 1] + 0.0).tolist()} == {tuple(p) for p in points.tolist()}


def test_upper_incisors_bite_over_the_lower_ones(face, arches):
    upper, lower = (local(face, arch.points) for arch in arches)
    middle = [np.abs(points[:, 0]) < 4.0 for points in (upper, lower)]
    scale = face.frame.pupil_distance / 63.0
    edge, other = upper[middle[0], 1].min(), lower[middle[1], 1].max()
    assert edge == pytest.approx(-BELOW_LIPS * scale, abs=0.3)
    assert other - edge == pytest.approx(OVERBITE * scale, abs=0.3)
    front = [
        points[near & (np.abs(points[:, 1]) < 3.0), 2].max()
        for points, near in zip((upper, lower), middle, strict=True)
    ]
    assert front[0] - front[1] == pytest.approx(OVERJET * scale, abs=0.5)


def test_closed_lips_cover_them(face, arches):
    """Straight ahead of every point there is skin."""
    forward = face.frame.axes[2]
    for arch in arches:
        for point in arch.points[::7]:
            assert len(face.mesh.ray_trace(point, point + 100.0 * forward)[0]) > 0


def test_teeth_go_with_the_face(face, arches):
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    moved = {name: 0.1 * turn @ point + [3.0, -2.0, 5.0] for name, point in face.landmarks.items()}
    for arch, other in zip(arches, teeth_of(moved, fw.anatomy.frame_of(moved)), strict=True):
        np.testing.assert_allclose(other.points, 0.1 * arch.points @ turn.T + [3.0, -2.0, 5.0], atol=1e-9)
        assert (other.triangles == arch.triangles).all()


# --- the tongue ------------------------------------------------------------------------------------


LIP = lip_crest(np.array([[0.0, 1.0, 10.0], [3.0, -4.0, 14.0]]))


@pytest.mark.parametrize("out", np.linspace(0.0, 1.0, 11))
def test_a_tongue_is_closed_and_keeps_its_volume(out):
    points, triangles = tongue_points(out, LIP), tongue_triangles()
    assert fw.mesh.to_polydata(points, triangles).is_manifold
    assert len(points) == len(tongue_paint())
    at_rest = enclosed_volume(tongue_points(0.0, LIP), triangles)
    assert at_rest > 0.0  # seen from outside, triangles are counter-clockwise
    assert enclosed_volume(points, triangles) == pytest.approx(at_rest, rel=0.1)


def test_a_tongue_in_the_mouth_knows_nothing_of_the_lip():
    np.testing.assert_array_equal(tongue_points(0.0, LIP), tongue_points(0.0, LIP + 5.0))


def test_a_tongue_that_comes_out_lies_on_the_lip():
    higher = LIP + np.array([2.0, 3.0])
    np.testing.assert_allclose(tongue_points(1.0, higher)[-1] - tongue_points(1.0, LIP)[-1], [0.0, 2.0, 3.0])
    for crest in (LIP, higher):
        points = tongue_points(1.0, crest)
        over_lip = points[(np.abs(points[:, 0]) < 3.0) & (np.abs(points[:, 2] - (crest[1] - 6.0)) < 2.0)]
        assert 0.0 < over_lip[:, 1].min() - crest[0] < 2.0


def test_the_sides_of_a_lip_may_be_higher_than_its_middle():
    middle, side, higher_side = [0.0, 0.0, 9.0], [14.0, 1.5, 5.0], [14.0, 4.5, 5.0]
    np.testing.assert_array_equal(lip_crest(np.array([middle, side])), [0.0, 9.0])
    assert lip_crest(np.array([middle, higher_side]))[0] > 1.0
    assert np.isfinite(lip_crest(np.empty((0, 3)))).all()
