"""Labels against other methods: ray casts, VTK's own projection, the same point in two views."""

from itertools import islice, pairwise

import numpy as np
import pytest
import pyvista as pv
from expressions import settled
from scipy.spatial import cKDTree

import facewrinkle as fw
from facewrinkle.anatomy.eyeball import RADIUS
from facewrinkle.appearance.eye import IRIS
from facewrinkle.appearance.seen import Appearance
from facewrinkle.dataset.furrows import FurrowTracker, furrows_of
from facewrinkle.dataset.labels import (
    DEPTH_STEP,
    FAR,
    HEIGHT_STEP,
    NO_PLACE,
    PARTS,
    PLACE_STEP,
    REGIONS,
    anchors_of,
    labels_of,
    regions_at,
    solid_parts,
)
from facewrinkle.dataset.plan import plan_of
from facewrinkle.dataset.sample import fault_of
from facewrinkle.dataset.surroundings import place
from facewrinkle.dataset.visible import Camera, TriangleBuffer

SIZE = (160, 120)


@pytest.fixture(scope="module")
def frame(face):
    return settled(fw.Simulation(face, folds="paper"), {"paper_surprise": 1.0, "AU26": 1.0})


def labeled(face, frame, tears=(), **camera):
    camera = {"yaw": 0, "pitch": 0, "roll": 7, "aside": 0, "above": 0, **camera}
    spec = fw.dataset.Spec.of({"size": list(SIZE), "camera": camera})
    with fw.plotting.Scene(face, fw.plotting.Style(SIZE)) as scene:
        place(scene, plan_of(spec, 0), spec)
        camera = scene.plotter.camera.copy()
    return *labels_of(face, Appearance.of(face).at(frame), frame, Camera.of(camera, SIZE), tears), camera


@pytest.fixture(scope="module")
def front(face, frame):
    return labeled(face, frame)


def test_depth_is_that_of_rays_through_the_middles_of_pixels(face, front, frame):
    arrays, _, camera = front
    drawn = Appearance.of(face).at(frame).smooth.mesh
    own = Camera.of(camera, SIZE)
    rows, columns = np.nonzero(arrays["part"] == PARTS.index("skin"))
    some = np.random.default_rng(3).choice(len(rows), 60, replace=False)
    position = np.array(camera.position)
    errors = []
    for row, column, ray in zip(rows[some], columns[some], own.rays(rows[some], columns[some]), strict=True):
        towards = own.extrinsic[:3, :3].T @ ray
        hits, _ = drawn.ray_trace(position, position + 3000.0 * towards / np.linalg.norm(towards))
        if len(hits):
            along = ((hits - position) @ own.extrinsic[2, :3]).min()
            errors.append(abs(arrays["depth"][row, column] * DEPTH_STEP - along))
    assert len(errors) > 50
    assert np.median(errors) <= DEPTH_STEP
    assert np.mean(np.array(errors) < 0.1) > 0.95  # at a silhouette, a ray may pass the triangle that was drawn


def test_triangles_are_those_that_vtk_draws(face, frame, front):
    """VTK draws the same meshes flat, in colors that number their triangles."""
    _, _, camera = front
    own = Camera.of(camera, SIZE)
    meshes = solid_parts(Appearance.of(face).at(frame), own)
    buffer = TriangleBuffer(own)
    buffer.draw(meshes)
    plotter = pv.Plotter(off_screen=True, window_size=list(SIZE), lighting="none")
    plotter.disable_anti_aliasing()
    plotter.set_background("black")
    number = 1
    for mesh in meshes.values():
        bare = pv.PolyData(mesh.points, faces=mesh.faces)
        own = np.arange(number, number := number + mesh.n_cells)
        bare.cell_data["color"] = np.stack([own >> 16, own >> 8, own], axis=1).astype(np.uint8)
        plotter.add_mesh(bare, scalars="color", rgb=True, lighting=False, reset_camera=False)
    plotter.camera = camera
    drawn = plotter.screenshot(return_img=True).astype(int) @ [1 << 16, 1 << 8, 1] - 1
    plotter.close()
    assert (buffer.numbers >= 0).mean() > 0.2
    assert np.mean(drawn == buffer.numbers) > 0.998  # a middle on an edge is on either side


def test_landmarks_are_where_vtk_projects_them(front, face, frame):
    _, facts, camera = front
    matrix = pv.array_from_vtkmatrix(camera.GetCompositeProjectionTransformMatrix(SIZE[0] / SIZE[1], -1.0, 1.0))
    for name, where in face.landmarks_on(frame).items():
        x, y, _, w = matrix @ np.append(where, 1.0)
        expected = 0.5 * np.array([(1.0 + x / w) * SIZE[0], (1.0 - y / w) * SIZE[1]])
        assert facts["landmarks"][name]["pixel"] == pytest.approx(expected, abs=1e-3)


def test_what_lies_behind_is_not_visible(face, frame, front):
    _, facts, _ = front
    assert all(
        facts["landmarks"][name]["visible"] for name in ("nose_tip", "glabella", "pogonion", "mouth_l", "mouth_r")
    )
    _, aside, _ = labeled(face, frame, yaw=75.0)  # the camera is on the subject's left
    assert aside["landmarks"]["eye_l_outer"]["visible"]
    assert not aside["landmarks"]["eye_r_outer"]["visible"]
    assert not aside["landmarks"]["gonion_r"]["visible"]


def test_normals_look_at_the_camera_and_have_length_one(front):
    arrays, *_ = front
    normal = arrays["normal"][arrays["depth"] > 0] / 127.0
    assert np.linalg.norm(normal, axis=1) == pytest.approx(np.ones(len(normal)), abs=0.02)
    assert np.mean(normal[:, 2] < 0.05) > 0.98


def test_heights_are_those_of_the_frame(front, frame):
    arrays, *_ = front
    skin = arrays["depth"] > 0
    near = cKDTree(np.asarray(frame["rest"])).query(arrays["place"][skin] * PLACE_STEP)
    close = near[0] < 0.3
    assert close.sum() > 100
    found = arrays["height"][skin][close] * HEIGHT_STEP
    assert np.median(np.abs(found - frame["W"][near[1][close]])) < 0.02
    assert arrays["height"].min() * HEIGHT_STEP >= frame["W"].min() - HEIGHT_STEP


def test_the_same_point_has_the_same_place_in_two_views(face, frame, front):
    arrays, _, camera = front
    other, _, aside = labeled(face, frame, yaw=20.0)
    one, two = Camera.of(camera, SIZE), Camera.of(aside, SIZE)
    rows, columns = np.nonzero(arrays["depth"])
    local = one.rays(rows, columns) * (arrays["depth"][rows, columns] * DEPTH_STEP)[:, None]
    world = (local - one.extrinsic[:3, 3]) @ one.extrinsic[:3, :3]
    pixels, away = two.project(world)
    column, row = np.floor(pixels).astype(int).T
    inside = (column >= 0) & (column < SIZE[0]) & (row >= 0) & (row < SIZE[1])
    seen = other["depth"][row[inside], column[inside]] * DEPTH_STEP
    same = np.abs(seen - away[inside]) < 1.0
    assert same.sum() > 2000
    apart = arrays["place"][rows, columns][inside][same] - other["place"][row[inside], column[inside]][same].astype(
        float
    )
    assert np.median(np.linalg.norm(apart, axis=1)) * PLACE_STEP < 1.2  # a pixel is 2 mm


def test_parts(front):
    arrays, *_ = front
    found = {PARTS[k] for k in np.unique(arrays["part"])}
    assert {"background", "skin", "eye", "brows", "mouth"} <= found
    skin = arrays["depth"] > 0
    assert (arrays["place"][~skin] == NO_PLACE).all()
    assert not (arrays["part"][skin] == PARTS.index("background")).any()
    assert (arrays["part"] == PARTS.index("brows"))[: SIZE[1] // 2].sum() > 20


def test_tears_are_a_part_and_hide_nothing(face, frame, front):
    arrays, *_ = labeled(face, frame, tears=[fw.SheddingTear(face, start="l").surface(2.0, frame)])
    assert (arrays["part"] == PARTS.index("tear")).sum() > 5
    assert np.array_equal(arrays["depth"], front[0]["depth"])


def test_furrows_are_low_and_each_has_one_source(front, frame):
    arrays, facts, *_ = front
    deep = arrays["height"] * HEIGHT_STEP
    assert (deep[arrays["furrow"] > 0] <= -0.049).all()
    assert (arrays["furrow"] > 0)[deep < -0.1].mean() > 0.95  # all but what is too short for a furrow
    assert {furrow["number"] for furrow in facts["furrows"]} == set(range(1, len(facts["furrows"]) + 1))
    depths = [furrow["depth"] for furrow in facts["furrows"]]
    assert depths == sorted(depths, reverse=True)
    assert depths[0] == pytest.approx(-frame["W"].min())
    counted = np.bincount(arrays["furrow"].ravel(), minlength=len(depths) + 1)
    assert [furrow["pixels"] for furrow in facts["furrows"]] == counted[1:].tolist()


def test_furrows_keep_their_numbers_through_a_clip(face):
    sim, tracker, frames = fw.Simulation(face, folds="paper"), FurrowTracker(0.5), []
    sim.express("paper_surprise")
    for frame in islice(sim.run(60), 15, None, 3):
        number, furrows = tracker(np.asarray(frame["rest"]), *furrows_of(frame))
        frames.append((np.asarray(frame["rest"]), number))
        assert {furrow.number for furrow in furrows} == set(np.unique(number[number > 0]))
        assert len({furrow.number for furrow in furrows}) == len(furrows)
    kept = total = 0
    for (before, old), (now, new) in pairwise(frames):
        own = np.flatnonzero(new)
        distance, near = cKDTree(before).query(now[own])
        both = (distance < 1e-9) & (old[near] > 0)  # vertices that lie in furrows of both frames
        kept, total = kept + (old[near] == new[own])[both].sum(), total + both.sum()
    assert total > 2000
    assert kept / total > 0.97  # the rest is where two furrows run together


def test_regions_lie_where_their_landmarks_are(front, face):
    arrays, facts, *_ = front
    assert (arrays["region"] > 0).sum() == (arrays["depth"] > 0).sum()
    expected = {"forehead_mid": "forehead", "brow_l_mid": "brow", "nose_tip": "nose", "malar_r": "cheek"}
    expected |= {"upper_lip_mid": "mouth", "pogonion": "chin", "glabella": "glabella"}
    for name, region in expected.items():
        column, row = np.floor(facts["landmarks"][name]["pixel"]).astype(int)
        assert REGIONS[arrays["region"][row, column]] == region
    points, number = anchors_of(face)
    places = np.random.default_rng(1).choice(face.points, 200)
    distance, near = cKDTree(points).query(places)
    far = distance > FAR * face.frame.pupil_distance
    assert np.array_equal(regions_at(face, places), np.where(far, REGIONS.index("elsewhere"), number[near]))


def test_pictures_that_are_not_fit_for_a_set(face, frame, front):
    arrays, facts, *_ = front
    assert fault_of(arrays, facts, SIZE) == ""
    assert fault_of(*labeled(face, frame, aside=4.0)[:2], SIZE) == "the face is not in the picture"
    below = {"pitch": -35.0, "height": 7.0, "above": -1.0}  # into the neck
    assert fault_of(*labeled(face, frame, **below)[:2], SIZE) == "the inside of the skin is seen"


def test_irises_are_discs_around_the_gaze(face):
    sim = fw.Simulation(face, layers=[])
    sim.look(yaw=15.0)
    frame = sim.settle()
    arrays, _, camera = labeled(face, frame)
    eye = face.eyes[0]
    gaze = frame.field_data[f"gaze_{eye.side}"][0]
    (middle,), _ = Camera.of(camera, SIZE).project((eye.centre + eye.radius * gaze)[None])
    rows, columns = np.nonzero(np.isin(arrays["part"], [PARTS.index("iris"), PARTS.index("pupil")]))
    own = np.abs(columns + 0.5 - middle[0]) < 12
    assert own.sum() > 20
    assert abs(columns[own].mean() + 0.5 - middle[0]) < 1.0
    away = np.hypot(columns + 0.5 - middle[0], rows + 0.5 - middle[1])[own]
    pixel = Camera.of(camera, SIZE).project(eye.centre[None])[1][0] / Camera.of(camera, SIZE).intrinsic[0, 0]
    widest = RADIUS * face.frame.pupil_distance * np.sin(np.radians(IRIS)) / pixel
    assert 0.85 * widest < away.max() < widest + 1.0
    pupils = np.argwhere(arrays["part"] == PARTS.index("pupil"))[:, ::-1] + 0.5
    assert np.linalg.norm(pupils - middle, axis=1).min() < 1.5


def test_two_grooves_on_a_sheet_are_two_furrows():
    sheet = pv.Plane(i_size=40, j_size=40, i_resolution=80, j_resolution=80).triangulate()
    x = sheet.points[:, 0]
    sheet["W"] = np.where(np.abs(x - 8.0) < 1.6, -0.3, 0.0) + np.where(np.abs(x + 8.0) < 1.6, -0.6, 0.0)
    number, furrows = furrows_of(sheet)
    assert [(furrow.depth, round(furrow.length)) for furrow in furrows] == [
        (pytest.approx(0.6), 40),
        (pytest.approx(0.3), 40),
    ]
    assert set(number[np.abs(x + 8.0) < 1.0]) == {1}
    assert set(number[np.abs(x - 8.0) < 1.0]) == {2}
    assert set(number[np.abs(x) < 4.0]) == {0}
