"""The built-in head: topology, triangles, symmetry, landmarks, lids, lips, and that the code makes the stored file."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
import trimesh
from small_meshes import enclosed_volume, smallest_angles

from facewrinkle.anatomy.head import MIRROR, Head, cage_data, load_head
from facewrinkle.anatomy.landmarks import lips_middle, read_landmarks
from facewrinkle.anatomy.teeth import GUM
from facewrinkle.appearance.skin_paint import LIP_COLOR
from facewrinkle.geometry.topology import (
    boundary_loops,
    components,
    euler_characteristic,
    is_oriented,
    non_manifold_edges,
)
from tools.build_head.build import build_head

MEAN_FACE = Path(__file__).parents[3] / "shared/faces/ict_face_narrow.obj"
MIDDLE = (
    "trichion", "forehead_mid", "glabella", "sellion", "nasion", "nose_tip", "subnasale", "upper_lip_mid",
    "lower_lip_mid", "pogonion", "menton",
)  # fmt: skip
PAIRED = {
    "brow_{}_outer", "brow_{}_mid", "brow_{}_inner", "eye_{}_inner", "eye_{}_outer", "eye_{}_centre", "ala_{}",
    "mouth_{}", "zygion_{}", "gonion_{}", "malar_{}",
}  # fmt: skip


@pytest.fixture(scope="module")
def head() -> Head:
    return load_head()


@pytest.fixture(scope="module")
def surface(head: Head) -> pv.PolyData:
    return pv.PolyData.from_regular_faces(head.points, head.triangles)


def away_from_surface(surface: pv.PolyData, points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(surface.find_closest_cell(points, return_closest_point=True)[1] - points, axis=1)


def loops(triangles: np.ndarray) -> list[np.ndarray]:
    return sorted(boundary_loops(triangles), key=len)


def test_is_an_oriented_manifold_with_four_boundary_loops(head: Head) -> None:
    assert is_oriented(head.triangles)
    assert not len(non_manifold_edges(head.triangles))
    assert euler_characteristic(head.triangles) == -2  # of a sphere with four holes
    assert components(head.triangles).max() == 0
    assert len(loops(head.triangles)) == 4


def test_the_holes_are_eyes_and_mouth(head: Head) -> None:
    *holes, rim = loops(head.triangles)
    right, mouth, left = sorted((head.points[loop].mean(axis=0) for loop in holes), key=lambda c: c[0])
    marks = head.landmarks
    assert np.linalg.norm(left[:2] - marks["eye_l_centre"][:2]) < 3.0
    np.testing.assert_allclose(right, left * MIRROR, atol=1e-9)
    assert abs(mouth[0]) < 1e-9
    assert marks["lower_lip_mid"][1] < mouth[1] < marks["upper_lip_mid"][1]
    # The outer rim is that of the neck, below the chin on all sides.
    assert head.points[rim, 1].max() < marks["menton"][1] - 40.0
    assert (np.ptp(head.points[rim], axis=0)[[0, 2]] > 110.0).all()


def test_is_counter_clockwise_from_outside(head: Head) -> None:
    # The volume under the skin, closed by a fan over each hole, is about that of a head with its neck: 4 to 7 liters.
    lids = [[loop[0], b, a] for loop in loops(head.triangles) for a, b in pairwise(loop)]
    assert 4e6 < enclosed_volume(head.points, np.vstack([head.triangles, lids])) < 7e6


def test_size_and_place_of_skull_and_ears_are_those_of_adults(head: Head) -> None:
    """Means of men and women, and two standard deviations: Farkas, Anthropometry of the Head and Face, 1994."""
    points, marks = head.points, head.landmarks
    skull = points[points[:, 1] > marks["brow_l_mid"][1]]
    middle = points[points[:, 0] == 0.0]
    assert np.ptp(skull[:, 0]) == pytest.approx(150.0, abs=12.0)
    assert marks["glabella"][2] - middle[:, 2].min() == pytest.approx(192.0, abs=14.0)
    assert points[:, 1].max() - marks["menton"][1] == pytest.approx(222.0, abs=18.0)
    ear = points[ear_of(head)]
    assert np.ptp(ear[:, 1]) == pytest.approx(61.0, abs=8.0)
    assert marks["subnasale"][1] < np.mean(ear[:, 1]) < marks["brow_l_mid"][1]
    assert ear[:, 0].max() > 8.0 + marks["zygion_l"][0]


def ear_of(head: Head) -> np.ndarray:
    """Vertices of the left ear: what the head's own side does not reach."""
    x, y, z = head.points.T
    return np.flatnonzero((x > 75.5) & (y > -14.0) & (y < 53.0) & (z < 18.0))


def test_triangles_are_well_shaped(head: Head) -> None:
    smallest = smallest_angles(head.points, head.triangles)
    assert smallest.min() >= 12.0
    assert np.percentile(smallest, 1) >= 22.0
    assert np.median(smallest) >= 45.0


def test_is_mirror_symmetric(head: Head, surface: pv.PolyData) -> None:
    assert away_from_surface(surface, head.points * MIRROR).max() < 1e-6
    table = {tuple(p): k for k, p in enumerate((head.points + 0.0).tolist())}
    twin = np.array([table[tuple(p)] for p in (head.points * MIRROR + 0.0).tolist()])
    there = {tuple(sorted(t)) for t in head.triangles.tolist()}
    assert there == {tuple(sorted(t)) for t in twin[head.triangles].tolist()}
    assert (head.color[twin] == head.color).all()
    np.testing.assert_allclose(head.uv[twin], head.uv * [-1, 1] + [1, 0], atol=1e-12)


def test_landmarks_have_their_names_and_lie_on_the_surface(head: Head, surface: pv.PolyData) -> None:
    assert set(head.landmarks) == {*MIDDLE, *(name.format(s) for name in PAIRED for s in "lr")}
    on_skin = np.array([p for name, p in head.landmarks.items() if not name.endswith("centre")])
    assert away_from_surface(surface, on_skin).max() < 1e-5
    for name in MIDDLE:
        assert head.landmarks[name][0] == 0.0
    for name in PAIRED:
        left, right = head.landmarks[name.format("l")], head.landmarks[name.format("r")]
        assert left[0] > 0.0
        assert (left * MIRROR == right).all()


def test_landmarks_are_where_anatomy_puts_them(head: Head) -> None:
    marks = head.landmarks
    ridge = head.points[(head.points[:, 0] == 0.0) & (head.points[:, 2] > 0.0)]

    def between(low: str, high: str) -> np.ndarray:
        return ridge[(ridge[:, 1] >= marks[low][1]) & (ridge[:, 1] <= marks[high][1])]

    assert (np.diff([marks[name][1] for name in MIDDLE]) < 0.0).all()
    assert head.points[:, 2].max() - marks["nose_tip"][2] < 0.3
    assert between("sellion", "forehead_mid")[:, 2].max() - marks["glabella"][2] < 0.3
    assert marks["sellion"][2] - between("nose_tip", "glabella")[:, 2].min() < 0.3
    assert between("menton", "lower_lip_mid")[2:, 2].max() - marks["pogonion"][2] < 3.5
    assert marks["eye_l_inner"][0] < marks["eye_l_centre"][0] < marks["eye_l_outer"][0]


def test_closed_lips_are_near_each_other_but_do_not_touch(head: Head) -> None:
    upper, _, *opposite = head.mold.lips.T
    lower = opposite[0][opposite[0] == opposite[1]]  # without the corner, where both lips meet
    away = []
    for lip, other in ((upper, lower), (lower, upper)):
        facing = head.triangles[np.isin(head.triangles, other).any(axis=1)]
        away.append(away_from_surface(pv.PolyData.from_regular_faces(head.points, facing), head.points[lip]))
    assert min(away[0].min(), away[1].min()) > 0.15
    assert away[1].max() < 0.35
    assert np.median(away[1]) < 0.25


def test_closed_lips_let_nobody_look_in(head: Head, surface: pv.PolyData) -> None:
    """Straight from the front, at every height about the line where the lips meet."""
    corner = head.landmarks["mouth_l"]
    for x in np.linspace(0.0, 0.9 * corner[0], 12):
        for y in np.arange(corner[1] - 1.5, corner[1] + 1.5, 0.03):
            assert len(surface.ray_trace([x, y, 200.0], [x, y, 90.0])[0]) > 0


def test_the_lining_of_the_lips_is_red_and_not_black(head: Head) -> None:
    """Parted lips show it. No light reaches it between closed ones, but paint does not know how lips move."""
    mouth = min(loops(head.triangles)[:-1], key=lambda loop: np.abs(head.points[loop, 0].mean()))
    red, green, blue = head.color[mouth].astype(float).T
    assert (red > 0.6 * GUM[0]).all()
    assert (red / green > 1.2 * LIP_COLOR[0] / LIP_COLOR[1]).all()
    assert (blue < green).all()


def test_uv_is_one_to_one(head: Head) -> None:
    assert 0.0 <= head.uv.min() < head.uv.max() <= 1.0
    a, b, c = np.moveaxis(head.uv[head.triangles], 1, 0)
    turn = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert turn.min() > 0.0
    # A map that turns no triangle over is one-to-one if the images of the boundary loops do not cross.
    ends = np.concatenate([np.stack([loop, np.roll(loop, -1)], axis=1) for loop in loops(head.triangles)])
    p, q = head.uv[ends[:, 0]], head.uv[ends[:, 1]]

    def side(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
        return (b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0]

    P, Q = p[:, None], q[:, None]
    crosses = (side(P, Q, p) * side(P, Q, q) < 0) & (side(p, q, P) * side(p, q, Q) < 0)
    share = (ends[:, None, :, None] == ends[None, :, None, :]).any(axis=(2, 3))
    assert not (crosses & ~share).any()


def test_brows_move_with_the_skin(head: Head, surface: pv.PolyData) -> None:
    hairs = head.brows.polylines(head.points, head.triangles, np.zeros_like(head.points))
    assert away_from_surface(surface, hairs.reshape(-1, 3)).max() < 1e-5
    half = len(hairs) // 2
    np.testing.assert_allclose(hairs[half:], hairs[:half] * MIRROR, atol=1e-9)
    inner, outer = head.landmarks["brow_l_inner"], head.landmarks["brow_l_outer"]
    left = hairs[:half].reshape(-1, 3)
    assert inner[0] - 5.0 < left[:, 0].min() < left[:, 0].max() < outer[0] + 6.0
    up = np.tile([0.0, 0.0, 1.0], (len(head.points), 1))
    raised = head.brows.polylines(head.points * [1.0, 1.1, 1.0] + [0.0, 3.0, 0.0], head.triangles, up)
    expected = hairs * [1.0, 1.1, 1.0] + [0.0, 3.0, 0.0] + head.brows.heights[:, None] * [0.0, 0.0, 1.0]
    np.testing.assert_allclose(raised, expected, atol=1e-9)


def test_the_face_is_near_a_mean_face(head: Head) -> None:
    """The mean of scanned faces, moved and scaled onto our landmarks; it has nostrils that go deeper than ours."""
    if not MEAN_FACE.exists():
        pytest.skip("needs ../shared/faces")
    theirs = {n: 10.0 * p for n, p in read_landmarks(MEAN_FACE.with_suffix(".landmarks.json")).items()}
    names = [n for n in head.landmarks if n in theirs]
    source, target = (np.array([marks[n] for n in names]) for marks in (theirs, head.landmarks))
    matrix, moved, _ = trimesh.registration.procrustes(source, target, reflection=False)
    assert np.linalg.norm(moved - target, axis=1).max() < 4.0
    mean = trimesh.transform_points(10.0 * np.asarray(pv.read(MEAN_FACE).points, dtype=float), matrix)
    x, y, z = mean.T
    mean = mean[~((np.abs(x) < 16.0) & (y > -11.0) & (y < 12.0) & (z < 114.0))]
    off = away_from_surface(pv.PolyData.from_regular_faces(head.points, head.triangles), mean)
    assert off.mean() < 2.0
    assert np.percentile(off, 95) < 5.0
    for centre in (head.eyes[0].centre, head.eyes[1].centre, lips_middle(head.landmarks)):
        assert off[np.linalg.norm(mean - centre, axis=1) < 26.0].mean() < 1.5


def test_points_go_with_the_cage(head: Head) -> None:
    cage = np.array(list(cage_data()["points"].values()))
    eye = head.eyes[0]
    np.testing.assert_allclose(head.mold(cage, eye.centre, eye.radius), head.points, atol=1e-9)
    # A shift of cage and eyes is one of the head.
    up = np.array([0.0, 5.0, 0.0])
    np.testing.assert_allclose(head.mold(cage + up, eye.centre + up, eye.radius), head.points + up, atol=1e-9)


@pytest.mark.slow
def test_the_stored_head_is_what_the_code_makes(head: Head) -> None:
    built = build_head()
    assert (built.triangles == head.triangles).all()
    np.testing.assert_allclose(built.points, head.points, atol=1e-6)
    np.testing.assert_allclose(built.uv, head.uv, atol=1e-8)
    assert (built.brows.triangles == head.brows.triangles).all()
    np.testing.assert_allclose(built.brows.weights, head.brows.weights, atol=1e-6)
    assert np.abs(built.color.astype(int) - head.color.astype(int)).max() <= 1
    assert np.abs(built.texture.astype(int) - head.texture.astype(int)).max() <= 1
    for name, place in built.landmarks.items():
        np.testing.assert_allclose(place, head.landmarks[name], atol=1e-6)
