"""Tears that are shed.

its path     folds that divert it, streams that merge, creases that it fills, and what is refused
SheddingTear closed, of genus 0, oriented and outside the skin (signed distance) on rest, moving, wrinkled and
             refined faces, and on surfaces that are no faces
"""

from itertools import pairwise

import numpy as np
import pytest
import pyvista as pv
from expressions import after
from small_meshes import assert_ball, meridian, signed_distances

import facewrinkle as fw
from facewrinkle.errors import MeshError, ParameterError, UnknownNameError
from facewrinkle.tears import Film, Flow, Route
from facewrinkle.tears import path as paths
from facewrinkle.tears.shape import POOLING, thickness
from facewrinkle.tears.support_surface import support_surface

FACET = 0.025
"""A third of the film of a tear, mm."""


def assert_outside(points, skin, unit=1.0):
    """No deeper in the skin than a facet of the tear may cut a crease."""
    assert signed_distances(points, skin).min() * unit >= -FACET


@pytest.fixture(scope="module")
def tear(face):
    return fw.SheddingTear(face, start="l")


# --- its path ----------------------------------------------------------------------------------------


def test_streams_merge(face):
    first = fw.SheddingTear(face, start="l", film=Film(roughness=0.0))
    beside = first.path.points[10] + [4.0, 0.0, 0.0]
    toward = [beside, first.path.points[60] + [1.0, 0.0, 0.0], first.path.points[90] + [6.0, 0.0, 0.0]]
    second = fw.SheddingTear(face, path=toward, route=Route(into=first))
    assert np.linalg.norm(second.path.points[-1] - first.path.points[-1]) < 2.0
    assert_ball(second.surface(second.end))


def test_a_fold_turns_the_stream():
    """A plane that leans, with a dam across that slopes aside."""
    plane = pv.Plane(i_size=80.0, j_size=80.0, i_resolution=160, j_resolution=160).triangulate()
    x, y = plane.points[:, 0], plane.points[:, 1]
    dam = 2.2 * np.exp(-(((y + 0.7 * x + 5.0) / 2.0) ** 2))
    plane.points = np.stack([x, y, 0.35 * y + dam], axis=1)
    tear = fw.SheddingTear(plane, start=(0.0, 25.0, 8.75), width=3.0, down=(0.0, 0.0, -1.0), film=Film(roughness=0.0))
    below = tear.path.points[np.abs(tear.path.points[:, 1] + 10.0) < 3.0]
    assert np.abs(below[:, 0]).min() > 4.0  # diverted along the dam


def test_rough_skin_turns_a_tear_aside_by_a_millimeter_or_two():
    """Of each 20 mm of its way, what is farthest from the straight line; and the film breaks into stretches."""
    sheet = pv.Plane(i_size=60, j_size=140, i_resolution=30, j_resolution=70).triangulate()
    streams = [fw.SheddingTear(sheet, start=(0.0, 60.0, 0.0), seed=seed) for seed in range(6)]
    aside = []
    for stream in streams:
        way = paths.resampled(stream.path.points, 1.0)
        for a, b in zip(range(0, len(way) - 20, 5), range(20, len(way), 5), strict=False):
            along = (way[b] - way[a]) / np.linalg.norm(way[b] - way[a])
            aside.append(np.linalg.norm(np.cross(way[a:b] - way[a], along), axis=1).max())
    assert 0.5 < np.median(aside) < 1.5
    assert np.quantile(aside, 0.95) < 3.0
    film = np.concatenate([1.0 + POOLING * stream.path.wobble for stream in streams])
    assert film.min() > 0.0
    assert 0.02 < (film < 0.25).mean() < 0.2
    assert (film > 1.5).mean() > 0.1


# --- the tear ---------------------------------------------------------------------------------------


def test_same_seed_same_tear_and_other_seed_another(face, tear, fingerprint):
    assert fingerprint(fw.SheddingTear(face, start="l").surface(1.0)) == fingerprint(tear.surface(1.0))
    assert fingerprint(fw.SheddingTear(face, start="l", seed=4).surface(1.0)) != fingerprint(tear.surface(1.0))


def test_the_frames_before_change_nothing(face):
    """What is kept from frame to frame is what a tear that sees only this frame finds."""
    sim = fw.Simulation(face)
    sim.express("sadness")
    frames = list(sim.run(24))
    sim.relax()
    frames += list(sim.run(25, ramp=0.2))  # and vertices go and are numbered anew
    tear = fw.SheddingTear(face, start="l", flow=Flow(c=60.0))
    assert any(b.n_points < a.n_points for a, b in pairwise(frames))
    for i, frame in enumerate(frames):
        mesh = tear.surface(1.0, frame)
        if i % 10 == 9:
            alone = fw.SheddingTear(face, start="l", flow=Flow(c=60.0)).surface(1.0, frame)
            np.testing.assert_array_equal(mesh.regular_faces, alone.regular_faces)
            np.testing.assert_allclose(mesh.points, alone.points, rtol=0, atol=1e-9)


@pytest.mark.parametrize("detail", [0.1, 0.25])
def test_points_are_no_farther_apart_than_the_detail(face, detail):
    strip = fw.SheddingTear(face, start="l", width=3.0, detail=detail).strip
    along, across = (np.linalg.norm(np.diff(strip.rest, axis=axis), axis=2) for axis in (0, 1))
    inside = ~strip.ends[1:, 1:-1] & ~strip.ends[:-1, 1:-1]
    assert 0.4 * 3.0 * detail < np.median(along)
    assert np.quantile(along[:, 1:-1][inside], 0.99) <= 3.0 * detail
    assert across.max() <= 3.0 * detail


@pytest.mark.parametrize(("detail", "error"), [(0.1, 0.02), (0.28, 0.04), (1.0, 0.04)])
def test_a_coarse_tear_holds_what_its_formula_does(detail, error):
    """On a sheet: the thickness summed over a fine grid. Nothing is left out where the trail is narrow."""
    sheet = pv.Plane(i_size=30, j_size=60, i_resolution=3, j_resolution=6).triangulate()
    tear = fw.SheddingTear(sheet, [[0, 25, 0], [0, -25, 0]], width=2.0, detail=detail, film=Film(0.2, 0.0))
    path, front = tear.path, tear.covered(1.0)
    s, w = np.meshgrid(np.linspace(0.0, front, 4001), np.linspace(-1.0, 1.0, 401), indexing="ij")
    wobble, _ = path.fields(s, w)
    expected = thickness(s, w, front, tear.shape, wobble).mean() * front * 2.0
    assert tear.surface(1.0).volume == pytest.approx(expected, rel=error)


@pytest.mark.parametrize(
    ("start", "options"),
    [("l", {"film": Film(trail=0.2)}), ("r", {"detail": 0.7}), ("l", {"film": Film(trail=0.45), "detail": 1.0})],
)
def test_a_coarse_mesh_is_fine_enough_for_a_narrow_trail(face, start, options):
    tear = fw.SheddingTear(face, start=start, **options)
    for t in (tear.begin, 0.5 * (tear.begin + tear.end), tear.end):
        mesh = tear.surface(t)
        assert (mesh.n_open_edges, mesh.n_points - mesh.n_cells // 2) == (0, 2)  # closed, and a sphere
        assert mesh.volume > 0.0


def test_it_is_joined_to_the_skin(face, tear):
    mesh = tear.surface(2.0)
    away = np.abs(signed_distances(mesh.points[mesh.n_points // 2 :], face.mesh))
    assert (away < 1e-9).mean() > 0.4  # all but the outline, which lies between points on the skin
    assert away.max() < 0.15


def test_covered_length_grows_and_the_trail_stays(tear):
    times = np.linspace(tear.begin, tear.end, 30)
    covered = [tear.covered(t) for t in times]
    assert (np.diff(covered) >= 0.0).all()
    run = times < tear.end - 1.0  # then it has arrived, and holds
    assert np.diff(np.array(covered)[run]) == pytest.approx(np.full(run.sum() - 1, 30.0 * (times[1] - times[0])))
    path = tear.path.points
    for t in times[::6]:
        mesh = tear.surface(t)
        mesh = mesh.extract_cells(mesh.compute_cell_sizes()["Area"] > 1e-9)
        _, near = mesh.find_closest_cell(path, return_closest_point=True)
        wet = np.linalg.norm(near - path, axis=1) < 0.05
        along = tear.path.lengths
        inside = (along > 1.5) & (along < tear.covered(t) - 0.5)
        assert wet[inside].mean() > 0.98
        assert not wet[along > tear.covered(t) + 0.5].any()


@pytest.mark.parametrize(
    "expression",
    [pytest.param("happiness", marks=pytest.mark.slow), "sadness", pytest.param("closing_eye", marks=pytest.mark.slow)],
)
def test_it_rides_on_the_wrinkled_refined_face(face, expression):
    """Inside its triangles, too, it is not in the skin."""
    sim = fw.Simulation(face)
    sim.express(expression)
    tears = [fw.SheddingTear(face, start=side, flow=Flow(c=60.0)) for side in "lr"]
    for i, frame in enumerate(sim.run(40)):
        if i % 8 == 7:
            for tear in tears:
                mesh = tear.surface(2.0 * i / 40.0, frame)
                assert_ball(mesh)
                assert_outside(mesh.points, frame)
                points, triangles = np.asarray(mesh.points), np.asarray(mesh.regular_faces)
                bottom = len(points) // 2
                assert (np.abs(signed_distances(points[bottom:], frame)) < 1e-9).mean() > 0.4
                corners = points[triangles[(triangles < bottom).all(axis=1)]]
                corners = corners[mesh.compute_cell_sizes()["Area"][: len(corners)] > 1e-9]  # where it has come
                inside = [corners.mean(axis=1), *(corners[:, [k, k - 1]].mean(axis=1) for k in range(3))]
                assert_outside(np.concatenate(inside), frame)
    assert frame.n_cells > face.mesh.n_cells


def test_a_frame_of_a_rigid_motion_moves_the_tear_with_it(face, tear):
    moved = face.mesh.copy()
    moved.points = np.asarray(face.points) @ np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    still, turned = tear.surface(1.0), tear.surface(1.0, moved)
    assert turned.points == pytest.approx(
        np.asarray(still.points) @ np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), abs=1e-9
    )


def test_it_never_meets_the_lid_that_closes(face):
    """The upper lid comes down over the tear's start: its thickness gives way."""
    frame = after(fw.Simulation(face), "closing_eye", 30)
    assert_outside(fw.SheddingTear(face, start="l", height=1.5).surface(0.0, frame).points, frame)


def test_water_on_a_sphere_and_a_vase(sphere):
    turned = pv.ParametricEllipsoid(30.0, 30.0, 60.0, u_res=80, v_res=80).triangulate().clean()
    radius = 1.0 + 0.25 * np.cos(turned.points[:, 2] / 12.0)
    vase = turned.copy()
    vase.points = turned.points * np.stack([radius, radius, np.ones_like(radius)], axis=1)
    for surface, down, start in ((sphere, (0, -1, 0), (20.0, 45.0, 0.0)), (vase, (0, 0, -1), (21.0, 0.0, 45.0))):
        water = fw.SheddingTear(
            surface, start=support_surface(surface).nearest(np.array([start]))[1][0], width=5.0, down=down
        )
        for t in np.linspace(water.begin, water.end, 5):
            mesh = water.surface(t)
            assert_ball(mesh)
            assert_outside(mesh.points, surface)
        assert water.length > 60.0


@pytest.mark.parametrize(
    "any_face",
    [
        *(None, "sockets", "ict_face_narrow"),
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("thick", "shut", "makehuman_head_male")),
    ],
    indirect=True,
)
@pytest.mark.parametrize("side", ["l", "r"])
def test_on_lids_of_all_kinds(any_face, side):
    tear = fw.SheddingTear(any_face, start=side)
    assert tear.length * any_face.unit > 40.0
    for t in np.linspace(tear.begin, tear.end, 6):
        mesh = tear.surface(t)
        assert_ball(mesh)
        assert_outside(mesh.points, any_face.mesh, any_face.unit)


# --- what is refused ----------------------------------------------------------------------------------


def torn_sheet():
    """A leaning sheet with a gap across it."""
    leaning = pv.Plane(i_size=60, j_size=60, i_resolution=20, j_resolution=20).triangulate()
    leaning.points[:, 2] = 0.4 * leaning.points[:, 1]
    rows = np.abs(leaning.cell_centers().points[:, 1]) > 3.0
    return leaning.extract_cells(np.flatnonzero(rows)).extract_surface(algorithm="dataset_surface")


def broken(face):
    mesh = face.mesh.copy()
    mesh.points[7] = np.nan
    return mesh


LINE, TOP = meridian(0.0), meridian(0.0)[5]
LOOP = [LINE[10], LINE[15], meridian(0.5)[10], meridian(0.5)[15], LINE[10]]
OFF_THE_LIDS = np.array([[0.0, 6.0, 12.0], [0.0, -8.0, 12.0]])
DOWN_THE_SHEET = [(0.0, 25.0, 10.0), (0.0, -25.0, -10.0)]


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (lambda f, s: fw.SheddingTear(f), ParameterError, "give either path or start"),
        (
            lambda f, s: fw.SheddingTear(f, [f.landmarks["nose_tip"], f.landmarks["nose_tip"] + [0.0, -20.0, 60.0]]),
            ParameterError,
            "must lie on the surface; its point 1",
        ),
        (lambda f, s: fw.SheddingTear(f, [f.landmarks["nose_tip"]]), ParameterError, "at least two points"),
        (lambda f, s: fw.SheddingTear(f, [TOP, [np.nan, 0.0, 0.0]]), ParameterError, "finite"),
        (
            lambda f, s: fw.SheddingTear(f, f.landmarks["eye_l_centre"] + OFF_THE_LIDS, width=1.0),
            ParameterError,
            "leaves the surface|off|lie on",
        ),
        (lambda f, s: fw.SheddingTear(s, LOOP, width=3.0), ParameterError, "cross itself"),
        (lambda f, s: fw.SheddingTear(s, [TOP, TOP]), ParameterError, "no length"),
        (lambda f, s: fw.SheddingTear(torn_sheet(), DOWN_THE_SHEET, width=1.0, height=0.3), ParameterError, "leaves"),
        (lambda f, s: fw.SheddingTear(torn_sheet(), DOWN_THE_SHEET, width=5.0, height=0.3), ParameterError, "a gap"),
        (lambda f, s: fw.SheddingTear(f, start=(0.0, 0.0, 400.0)), ParameterError, "start must lie on the surface"),
        (lambda f, s: fw.SheddingTear(f, start="x"), UnknownNameError, "unknown side"),
        (lambda f, s: fw.SheddingTear(s, start=(0.0, -50.0, 0.0)), ParameterError, "no water runs"),
        (lambda f, s: fw.SheddingTear(f, start="l", width=100.0), ParameterError, r"smaller than 0\.15 of the surface"),
        (
            lambda f, s: fw.SheddingTear(f, start="l", height=100.0),
            ParameterError,
            r"smaller than 0\.15 of the surface",
        ),
        (lambda f, s: fw.SheddingTear(f, start="l", width=-1.0), ParameterError, "width"),
        (lambda f, s: fw.SheddingTear(f, start="l", seed=-1), ParameterError, "seed"),
        (lambda f, s: fw.SheddingTear(s, start=TOP, width=0.01, height=0.01), ParameterError, "too fine a mesh"),
        (
            lambda f, s: fw.SheddingTear(s, start=TOP, route=Route(into="river")),
            ParameterError,
            "must be a SheddingTear",
        ),
        (lambda f, s: fw.SheddingTear(s, start=TOP, route=Route(on="frame")), MeshError, "must be a PolyData"),
        (lambda f, s: fw.SheddingTear(s, start=TOP, head="square"), UnknownNameError, "head 'square'"),
    ],
)
def test_refuses_paths_starts_and_sizes(face, sphere, call, error, says):
    with pytest.raises(error, match=says):
        call(face, sphere)


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (lambda tear, face: tear.surface(-1.0), ParameterError, "t must lie in"),
        (lambda tear, face: tear.surface(tear.end + 1.0), ParameterError, "t must lie in"),
        (lambda tear, face: tear.surface(np.nan), ParameterError, "t must lie in"),
        (lambda tear, face: tear.surface(1.0, pv.Sphere()), MeshError, "another surface"),
        (lambda tear, face: tear.surface(1.0, "frame"), MeshError, "must be a PolyData"),
        (lambda tear, face: tear.surface(1.0, broken(face)), MeshError, "finite"),
        (lambda tear, face: Flow(c=0.0), ParameterError, "c"),
        (lambda tear, face: Flow(s=-1.0), ParameterError, "s"),
        (lambda tear, face: Flow(hold=np.nan), ParameterError, "hold"),
        (lambda tear, face: Flow(by="depth"), UnknownNameError, "measure of the flow 'depth'"),
        (lambda tear, face: Film(roughness=2.0), ParameterError, "roughness"),
        (lambda tear, face: Film(trail=np.nan), ParameterError, "trail"),
        (lambda tear, face: Film(degree=9), ParameterError, "degree"),
        (lambda tear, face: Route(length=0.0), ParameterError, "length"),
    ],
)
def test_refuses_times_frames_and_groups(face, tear, call, error, says):
    with pytest.raises(error, match=says):
        call(tear, face)


@pytest.mark.parametrize("any_face", [None, "makehuman_head_male"], indirect=True)
def test_refuses_the_back_of_the_head(any_face):
    head = any_face
    back = head.points[np.argmin(head.points @ head.frame.axes[2])]
    _, below = head.mesh.find_closest_cell(back - 20.0 / head.unit * head.frame.axes[1], return_closest_point=True)
    with pytest.raises(ParameterError, match="wrong side"):
        fw.SheddingTear(head, path=[back, below])


@pytest.mark.parametrize(("out", "goes_on"), [(0.4, True), (4.0, False)])
def test_a_tear_fills_a_shallow_crease_and_runs_on(out, goes_on):
    y, x = np.mgrid[-30.0:30.01:0.1, -10.0:10.01:1.0]
    ridge = out * np.exp(-0.5 * (y / (0.5 * out)) ** 2)
    sheet = pv.StructuredGrid(x, y, ridge).extract_surface(algorithm="dataset_surface").triangulate()
    sheet = sheet if sheet.compute_normals()["Normals"][:, 2].mean() > 0.0 else sheet.flip_faces()
    down = np.array([0.0, -1.0, -1.0])  # the sheet leans back: above the ridge water would have to rise
    tear = fw.SheddingTear(sheet, start=(0.0, 20.0, 0.0), width=2.0, down=down, film=Film(roughness=0.0), seed=1)
    assert paths.descent(support_surface(sheet, down), np.array([0.0, 20.0, 0.0]), 0.3, 60.0)[-1, 1] > 0.0
    assert (tear.path.points[-1, 1] < -10.0) == goes_on


def slope():
    """A sheet that is steep above and leans back below: 60 and 20 degrees against the horizontal."""
    steep, flat = np.radians(60.0), np.radians(20.0)
    x, along = np.meshgrid(np.linspace(-8.0, 8.0, 17), np.linspace(-30.0, 30.0, 61), indexing="ij")
    angle = np.where(along > 0.0, steep, flat)
    y, z = along * np.sin(angle), -along * np.cos(angle)
    grid = pv.StructuredGrid(x, y, z).extract_surface(algorithm="dataset_surface").triangulate()
    return pv.PolyData.from_regular_faces(np.asarray(grid.points, float), grid.regular_faces), (steep, flat)


def test_a_tear_that_goes_by_height_falls_evenly():
    """On the steep part h = s + c t is covered in a length h / sin 60, below it in one of h / sin 20."""
    sheet, (steep, flat) = slope()
    path = [
        [0.0, 25.0 * np.sin(steep), -25.0 * np.cos(steep)],
        [0.0, 0.0, 0.0],
        [0.0, -25.0 * np.sin(flat), 25.0 * np.cos(flat)],
    ]
    by_height = fw.SheddingTear(sheet, path, width=2.0, height=0.5, flow=Flow(c=5.0, by="height"))
    by_length = fw.SheddingTear(sheet, path, width=2.0, height=0.5, flow=Flow(c=5.0))
    times = np.linspace(0.0, 4.0, 9)
    np.testing.assert_allclose(np.diff([by_length.covered(t) for t in times[2:]]) / 0.5, 5.0, rtol=1e-9)
    faster = np.diff([by_height.covered(t) for t in times]) / 0.5
    assert faster[2] == pytest.approx(5.0 / np.sin(steep), rel=0.02)
    late = by_height.begin + (25.0 * np.sin(steep) - by_height.s + 2.0) / 5.0
    assert by_height.covered(late + 0.4) - by_height.covered(late) == pytest.approx(2.0 / np.sin(flat), rel=0.02)


def test_an_extruded_head_is_smoothed_and_as_high():
    """The end of the tear is raised to one height; smoothing rounds its edges and leaves the trail a film."""
    sheet = pv.Plane(i_size=30, j_size=60, i_resolution=30, j_resolution=60).triangulate()
    path = [[0.0, 25.0, 0.0], [0.0, -25.0, 0.0]]
    tears = {
        head: fw.SheddingTear(sheet, path, width=4.0, height=1.0, head=head, film=Film(roughness=0.0))
        for head in ("round", "extruded")
    }
    blunt = []  # thickness of the very front, beside the path
    for head, tear in tears.items():
        mesh = tear.surface(1.0)
        assert mesh.n_open_edges == 0
        top = mesh.point_data["thickness"]
        along = 25.0 - np.asarray(mesh.points)[:, 1]
        front = along[top > 0.0].max()
        assert 0.75 < top.max() <= 1.0 + 1e-9, head
        assert top[along < front - 12.0].max() < 0.2
        blunt.append(top[(along > front - 0.7) & (np.abs(mesh.points[:, 0]) > 0.9)].max())
    assert blunt[1] > 1.25 * blunt[0]
