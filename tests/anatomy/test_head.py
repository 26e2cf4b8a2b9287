"""The built-in head: topology, triangles, symmetry, landmarks, lids, lips, and that the code makes the stored file."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from small_meshes import smallest_angles

from facewrinkle.anatomy.head import MIRROR, Head, cage_data, load_head
from facewrinkle.anatomy.landmarks import lips_middle, read_landmarks
from facewrinkle.geometry.topology import (
    boundary_loops,
    components,
    euler_characteristic,
    is_oriented,
    non_manifold_edges,
    unique_edges,
)
from tools.build_head.build import build_head

MEAN_FACE = Path(__file__).parents[3] / "shared/faces/ict_face_narrow.obj"
MIDDLE = {
    "nasion", "nose_tip", "subnasale", "upper_lip_mid", "lower_lip_mid", "menton", "pogonion", "glabella",
    "sellion", "forehead_mid", "trichion",
}  # fmt: skip
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


def edge_lengths(head: Head, inside: np.ndarray) -> np.ndarray:
    """Lengths of the edges with both ends inside."""
    edges, _ = unique_edges(head.triangles)
    edges = edges[inside[edges].all(axis=1)]
    return np.linalg.norm(head.points[edges[:, 0]] - head.points[edges[:, 1]], axis=1)


def away_from_surface(surface: pv.PolyData, points: np.ndarray) -> np.ndarray:
    closest = surface.find_closest_cell(points, return_closest_point=True)[1]
    return np.linalg.norm(closest - points, axis=1)


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
    centres = sorted((head.points[loop].mean(axis=0) for loop in holes), key=lambda c: c[0])
    right, mouth, left = centres
    marks = head.landmarks
    assert np.linalg.norm(left[:2] - marks["eye_l_centre"][:2]) < 3.0
    np.testing.assert_allclose(right, left * MIRROR, atol=1e-9)
    assert abs(mouth[0]) < 1e-9
    assert marks["lower_lip_mid"][1] < mouth[1] < marks["upper_lip_mid"][1]
    # The outer rim is that of the neck, below the chin on all sides.
    assert head.points[rim, 1].max() < marks["menton"][1] - 40.0
    assert (np.ptp(head.points[rim], axis=0)[[0, 2]] > 110.0).all()


def test_is_counter_clockwise_from_outside(head: Head) -> None:
    # The volume under the skin, closed by a fan over each hole, is about that of a head with its neck: 4 to 7 litres.
    lids = [[loop[0], b, a] for loop in loops(head.triangles) for a, b in pairwise(loop)]
    corners = head.points[np.vstack([head.triangles, lids])]
    volume = np.einsum("mi,mi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    assert 4e6 < volume < 7e6


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


def test_ears_have_their_share_of_triangles(head: Head) -> None:
    inside = np.zeros(len(head.points), dtype=bool)
    inside[ear_of(head)] = True
    assert 100 < inside[head.triangles].any(axis=1).sum() < 250


def test_triangles_are_well_shaped(head: Head) -> None:
    smallest = smallest_angles(head.points, head.triangles)
    assert smallest.min() >= 12.0
    assert np.percentile(smallest, 1) >= 22.0
    assert np.median(smallest) >= 45.0


def test_edge_lengths_follow_the_zones(head: Head) -> None:
    points, marks = head.points, head.landmarks
    x = np.abs(points[:, 0])
    brow = marks["brow_l_mid"][1]
    forehead = (points[:, 1] > brow) & (points[:, 1] < brow + 45.0) & (x < 45.0) & (points[:, 2] > 0.0)
    glabella = np.linalg.norm(points - marks["glabella"], axis=1) < 9.0
    eye = np.linalg.norm(points * [0, 1, 1] + x[:, None] * [1, 0, 0] - [32.0, 36.0, 94.0], axis=1) < 20.0
    mouth = (np.abs(points[:, 1] - marks["mouth_l"][1]) < 14.0) & (x < 28.0) & (points[:, 2] > 100.0)
    back = (points[:, 2] < -30.0) & (x < 70.0)
    for inside, wished in ((forehead, 5.0), (glabella, 3.5), (eye, 3.2), (mouth, 3.8)):
        assert np.mean(edge_lengths(head, inside)) == pytest.approx(wished, rel=0.08)
    largest = cage_data()["sizes"]["largest"]
    assert edge_lengths(head, back).mean() == pytest.approx(largest, rel=0.08)


def test_is_mirror_symmetric(head: Head, surface: pv.PolyData) -> None:
    assert away_from_surface(surface, head.points * MIRROR).max() < 1e-6
    table = {tuple(p): k for k, p in enumerate((head.points + 0.0).tolist())}
    twin = np.array([table[tuple(p)] for p in (head.points * MIRROR + 0.0).tolist()])
    there = {tuple(sorted(t)) for t in head.triangles.tolist()}
    assert there == {tuple(sorted(t)) for t in twin[head.triangles].tolist()}
    assert (head.colour[twin] == head.colour).all()
    np.testing.assert_allclose(head.uv[twin], head.uv * [-1, 1] + [1, 0], atol=1e-12)


def test_landmarks_have_their_names_and_lie_on_the_surface(head: Head, surface: pv.PolyData) -> None:
    assert set(head.landmarks) == MIDDLE | {name.format(s) for name in PAIRED for s in "lr"}
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

    order = [
        "trichion",
        "forehead_mid",
        "glabella",
        "sellion",
        "nasion",
        "nose_tip",
        "subnasale",
        "upper_lip_mid",
    ]
    order += ["lower_lip_mid", "pogonion", "menton"]
    assert (np.diff([marks[name][1] for name in order]) < 0.0).all()
    assert head.points[:, 2].max() - marks["nose_tip"][2] < 0.3
    assert between("sellion", "forehead_mid")[:, 2].max() - marks["glabella"][2] < 0.3
    assert marks["sellion"][2] - between("nose_tip", "glabella")[:, 2].min() < 0.3
    assert between("menton", "lower_lip_mid")[2:, 2].max() - marks["pogonion"][2] < 3.5
    assert marks["eye_l_inner"][0] < marks["eye_l_centre"][0] < marks["eye_l_outer"][0]


def test_closed_lips_are_near_each_other_but_do_not_touch(head: Head) -> None:
    upper, _, *opposite = head.mould.lips.T
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


def test_upper_lid_covers_a_little_of_the_iris(head: Head, surface: pv.PolyData) -> None:
    eye = head.eyes[0]
    top = eye.centre[1] + 6.0
    heights = np.arange(eye.centre[1], top + 2.0, 0.05)
    covered = [
        y for y in heights if surface.ray_trace([eye.centre[0], y, 200.0], [eye.centre[0], y, eye.centre[2]])[0].size
    ]
    assert 1.0 <= top - min(covered) <= 2.0


def test_uv_is_one_to_one(head: Head) -> None:
    assert head.uv.min() >= 0.0
    assert head.uv.max() <= 1.0
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


def test_lips_are_redder_than_the_forehead(head: Head) -> None:
    def redness(name: str) -> float:
        k = np.linalg.norm(head.points - head.landmarks[name], axis=1).argmin()
        red, green, _ = head.colour[k].astype(float)
        return float(red / green)

    x, y, z = head.points.T
    inside = (np.abs(x) < 12.0) & (y < -38.0) & (y > -42.0) & (z > 112.0)
    assert (head.colour[inside, 0] / head.colour[inside, 1].astype(float)).min() > 1.2 * redness("forehead_mid")
    assert redness("malar_l") > redness("forehead_mid")


def test_texture_is_seamless_and_even_but_for_its_grain(head: Head) -> None:
    """Across the middle colours change no more than beside it, and the halves agree where pores are averaged out."""
    image = head.texture.astype(float)
    middle = image.shape[1] // 2
    steps = np.abs(np.diff(image[:, middle - 20 : middle + 20], axis=1)).mean(axis=(0, 2))
    assert steps[19] < steps.mean() + 3.0 * steps.std()
    assert (head.texture != head.texture[:, ::-1]).mean() > 0.5
    size = image.shape[0] // 16
    coarse = image[: 16 * size, : 16 * size].reshape(16, size, 16, size, 3).mean(axis=(1, 3))
    assert np.abs(coarse - coarse[:, ::-1]).mean() < 4.0


def test_skin_is_darker_where_less_light_comes_in(head: Head) -> None:
    def brightness(place: np.ndarray) -> float:
        return float(head.colour[np.linalg.norm(head.points - place, axis=1).argmin()].mean())

    marks = head.landmarks
    cheek = brightness(marks["malar_l"])
    assert brightness(marks["eye_l_inner"]) < 0.8 * cheek
    assert brightness(marks["subnasale"]) < cheek


def test_brows_move_with_the_skin(head: Head, surface: pv.PolyData) -> None:
    normals = np.zeros_like(head.points)
    hairs = head.brows.polylines(head.points, head.triangles, normals)
    assert away_from_surface(surface, hairs.reshape(-1, 3)).max() < 1e-5
    half = len(hairs) // 2
    np.testing.assert_allclose(hairs[half:], hairs[:half] * MIRROR, atol=1e-9)
    inner, outer = head.landmarks["brow_l_inner"], head.landmarks["brow_l_outer"]
    left = hairs[:half].reshape(-1, 3)
    assert left[:, 0].min() > inner[0] - 5.0
    assert left[:, 0].max() < outer[0] + 6.0
    up = np.tile([0.0, 0.0, 1.0], (len(head.points), 1))
    stretched = head.points * [1.0, 1.1, 1.0] + [0.0, 3.0, 0.0]
    raised = head.brows.polylines(stretched, head.triangles, up)
    expected = hairs * [1.0, 1.1, 1.0] + [0.0, 3.0, 0.0] + head.brows.heights[:, None] * [0.0, 0.0, 1.0]
    np.testing.assert_allclose(raised, expected, atol=1e-9)


def test_the_face_is_near_a_mean_face(head: Head) -> None:
    """The mean of scanned faces, moved and scaled onto our landmarks; it has nostrils that go deeper than ours."""
    if not MEAN_FACE.exists():
        pytest.skip("needs ../shared/faces")
    theirs = {n: 10.0 * p for n, p in read_landmarks(MEAN_FACE.with_suffix(".landmarks.json")).items()}
    names = [n for n in head.landmarks if n in theirs]
    source, target = (np.array([marks[n] for n in names]) for marks in (theirs, head.landmarks))
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    u, s, v = np.linalg.svd(b.T @ a)
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v
    scale = s.sum() / (a**2).sum()

    def moved(points: np.ndarray) -> np.ndarray:
        return scale * (points - source.mean(axis=0)) @ turn.T + target.mean(axis=0)

    assert np.linalg.norm(moved(source) - target, axis=1).max() < 4.0
    mean = moved(10.0 * np.asarray(pv.read(MEAN_FACE).points, dtype=float))
    x, y, z = mean.T
    mean = mean[~((np.abs(x) < 16.0) & (y > -11.0) & (y < 12.0) & (z < 114.0))]
    off = away_from_surface(pv.PolyData.from_regular_faces(head.points, head.triangles), mean)
    assert off.mean() < 2.0
    assert np.percentile(off, 95) < 5.0
    lips = lips_middle(head.landmarks)
    for centre in (head.eyes[0].centre, head.eyes[1].centre, lips):
        assert off[np.linalg.norm(mean - centre, axis=1) < 26.0].mean() < 1.5


def test_the_texture_has_room_for_the_face(head: Head) -> None:
    corners = head.uv[head.triangles]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    centre = head.points[head.triangles].mean(axis=1)
    face = (centre[:, 2] > 40.0) & (centre[:, 1] > head.landmarks["menton"][1])
    face &= centre[:, 1] < head.landmarks["trichion"][1]
    assert area[face].sum() > 0.4 * area.sum()


def test_points_go_with_the_cage(head: Head) -> None:
    cage = np.array(list(cage_data()["points"].values()))
    eye = head.eyes[0]
    np.testing.assert_allclose(head.mould(cage, eye.centre, eye.radius), head.points, atol=1e-9)
    # A shift of cage and eyes is one of the head.
    up = np.array([0.0, 5.0, 0.0])
    np.testing.assert_allclose(head.mould(cage + up, eye.centre + up, eye.radius), head.points + up, atol=1e-9)


def test_arrays_are_read_only(head: Head) -> None:
    with pytest.raises(ValueError, match="read-only"):
        head.points[0] = 0.0
    assert load_head() is head


@pytest.mark.slow
def test_the_stored_head_is_what_the_code_makes(head: Head) -> None:
    built = build_head()
    assert (built.triangles == head.triangles).all()
    np.testing.assert_allclose(built.points, head.points, atol=1e-6)
    np.testing.assert_allclose(built.uv, head.uv, atol=1e-8)
    assert (built.brows.triangles == head.brows.triangles).all()
    np.testing.assert_allclose(built.brows.weights, head.brows.weights, atol=1e-6)
    assert np.abs(built.colour.astype(int) - head.colour.astype(int)).max() <= 1
    assert np.abs(built.texture.astype(int) - head.texture.astype(int)).max() <= 1
    for name, place in built.landmarks.items():
        np.testing.assert_allclose(place, head.landmarks[name], atol=1e-6)
