"""A face from any mesh.

what                            checked against
real faces                      the unit they are documented in; muscles on their skin
turned, scaled, moved meshes    the same face, turned, scaled, moved: all of its anatomy, to 1e-8
missing landmarks               those that were left out
units                           the same face
errors                          their messages
"""

import dataclasses
import time
import warnings
from itertools import pairwise

import numpy as np
import pytest
import pyvista as pv
from expressions import after
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from synthetic_faces import head_with

import facewrinkle as fw
from facewrinkle.anatomy.eyelid_opening import eyelid_opening
from facewrinkle.anatomy.landmarks import REQUIRED, mirrored_name
from facewrinkle.errors import FaceWrinkleWarning, LandmarkError, MeshError, ParameterError, UnknownNameError

TURN = Rotation.from_rotvec([0.3, 2.0, -0.5]).as_matrix()


def moved(mesh, landmarks, rotation=TURN, scale=1.0, shift=(0.0, 0.0, 0.0)):
    other = mesh.copy()
    other.points = scale * np.asarray(mesh.points, dtype=np.float64) @ rotation.T + shift
    return other, {name: scale * rotation @ point + shift for name, point in landmarks.items()}


# --- real faces ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("stem", "unit", "points", "triangles"),
    [
        ("ict_face_narrow", 10.0, 6706, 13120),
        ("makehuman_head_male", 100.0, 4328, None),
        ("mediapipe_canonical_face_model", 10.0, 468, 898),
    ],
)
def test_real_faces_are_measured_right(real_face, stem, unit, points, triangles):
    face = real_face(stem)
    assert face.unit == pytest.approx(unit, rel=0.1)
    assert face.mesh.n_points == points
    assert triangles in (None, face.mesh.n_cells)
    assert face.unit * face.frame.pupil_distance == pytest.approx(63.0)
    skin = cKDTree(face.points)
    for name, muscle in face.muscles.items():
        if hasattr(muscle, "insertion"):  # in the skin, or a few mm below it
            assert skin.query(np.atleast_2d(muscle.insertion).mean(axis=0))[0] * face.unit < 16.0, name
            assert skin.query(np.atleast_2d(muscle.attachment).mean(axis=0))[0] * face.unit < 32.0, name
    for name in face.landmarks:
        if name.startswith("eye") and name.endswith("centre"):
            continue
        assert skin.query(face.landmarks[name])[0] * face.unit < 12.0, name


# --- the same face elsewhere --------------------------------------------------------------------


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_fitting_commutes_with_moving_the_mesh(face, scale):
    rest = fw.fit_face(face.mesh, face.landmarks)
    shift = scale * np.array([500.0, -200.0, 90.0])
    other = fw.fit_face(*moved(face.mesh, face.landmarks, TURN, scale, shift))
    assert other.unit == pytest.approx(rest.unit / scale, rel=1e-8)
    size = scale * rest.frame.pupil_distance

    def same(a, b):
        np.testing.assert_allclose(a, scale * np.asarray(b) @ TURN.T + shift, rtol=0, atol=1e-8 * size)

    same(other.points, rest.points)
    same(other.tissue.anchors, rest.tissue.anchors)
    np.testing.assert_allclose(other.tissue.depth, scale * rest.tissue.depth, rtol=1e-8)
    np.testing.assert_allclose(other.tissue.stiffness, rest.tissue.stiffness, rtol=1e-8)
    np.testing.assert_allclose(other.tissue.normals, rest.tissue.normals @ TURN.T, atol=1e-8)
    for a, b in zip(other.eyes, rest.eyes, strict=True):
        same(a.centre, b.centre)
        assert a.radius == pytest.approx(scale * b.radius, rel=1e-8)
    for name, weights in rest.joint_weights.items():
        mine = other.joint_weights[name]
        assert np.array_equal(mine.vertices, weights.vertices)
        np.testing.assert_allclose(mine.hold, weights.hold, atol=1e-8)
        turned = scale * weights.turned(rest.points, 0.7) @ TURN.T
        np.testing.assert_allclose(mine.turned(other.points, 0.7), turned, atol=1e-8 * size)
    for name, muscle in rest.muscles.items():
        mine = other.muscles[name]
        np.testing.assert_allclose(mine.force(other.points), muscle.force(rest.points) @ TURN.T, atol=1e-8)
        pattern, expected = mine.fold_pattern, muscle.fold_pattern
        np.testing.assert_allclose(
            pattern.unit_amplitude(other.points), expected.unit_amplitude(rest.points), rtol=0, atol=1e-8
        )
        np.testing.assert_allclose(
            pattern.half_cycles(other.points), scale * expected.half_cycles(rest.points), rtol=1e-8
        )


def test_simulation_commutes_with_scaling_and_shifting_the_mesh(face):
    shift, scales = np.array([500.0, -200.0, 90.0]), (1e-3, 1e3)
    meshes = [moved(face.mesh, face.landmarks, np.eye(3), scale, scale * shift) for scale in scales]
    rest, *others = (
        after(fw.Simulation(fw.fit_face(*mesh), folds="paper"), "paper_fear", 12)
        for mesh in ((face.mesh, face.landmarks), *meshes)
    )
    for scale, other in zip(scales, others, strict=True):
        assert np.array_equal(other.regular_faces, rest.regular_faces)
        np.testing.assert_allclose(other["W"], rest["W"], rtol=0, atol=1e-8)
        np.testing.assert_allclose(other.points, scale * (rest.points + shift), rtol=0, atol=1e-8 * scale)


def test_numbering_does_not_matter(face):
    rng = np.random.default_rng(9)
    order = rng.permutation(face.mesh.n_points)
    triangles = np.argsort(order)[face.triangles][rng.permutation(len(face.triangles))]
    other = fw.fit_face(pv.PolyData.from_regular_faces(face.points[order], triangles), face.landmarks, units=1.0)
    np.testing.assert_allclose(other.tissue.anchors, face.tissue.anchors[order], atol=1e-8)
    np.testing.assert_allclose(other.tissue.depth, face.tissue.depth[order], atol=1e-12)
    for a, b in zip(other.eyes, face.eyes, strict=True):
        assert a.radius == pytest.approx(b.radius, rel=1e-12)


# --- landmarks and units ------------------------------------------------------------------------


@pytest.mark.slow
def test_meshes_numbered_as_subdivision_does_take_no_longer(face):
    """289 thousand triangles: factors of this numbering once took minutes, and of a random one a second."""
    fine = face.mesh.subdivide(3, "loop")
    order = np.random.default_rng(0).permutation(fine.n_points)
    shuffled = fw.mesh.to_polydata(np.asarray(fine.points)[order], np.argsort(order)[fine.regular_faces])
    anchors, seconds = [], []
    for mesh in (fine, shuffled):
        start = time.process_time()
        anchors.append(fw.fit_face(mesh, face.landmarks).tissue.anchors)
        seconds.append(time.process_time() - start)
    assert np.abs(anchors[0][order] - anchors[1]).max() < 1e-9
    assert seconds[0] < 2.0 * seconds[1]


def test_seven_landmarks_of_each_side_are_enough(face):
    given = {name: face.landmarks[name] for n in REQUIRED for name in (n, mirrored_name(n))}
    fitted = fw.fit_face(face.mesh, given, units="mm")
    assert set(fitted.estimated) == set(face.landmarks) - set(given)
    for name in fitted.estimated:
        place = fitted.landmarks[name]
        on_skin = face.mesh.find_closest_cell(place, return_closest_point=True)[1]
        assert "centre" in name or np.linalg.norm(on_skin - place) < 1e-6
        assert np.linalg.norm(fitted.landmarks[name] - face.landmarks[name]) < 0.15 * face.frame.pupil_distance
    assert set(fitted.muscles) == set(face.muscles)


@pytest.mark.parametrize(
    ("units", "unit"), [("mm", 1.0), ("in", 25.4), ("cm", 10.0), ("m", 1e3), ("um", 1e-3), (2.5, 2.5)]
)
def test_units(face, units, unit):
    mesh, marks = moved(face.mesh, face.landmarks, np.eye(3), 1.0 / unit)
    if units == 2.5:
        assert fw.fit_face(mesh, marks, units=units).unit == 2.5
        return
    fitted = fw.fit_face(mesh, marks, units=units)
    assert fitted.unit == unit
    np.testing.assert_allclose(fitted.tissue.depth * unit, face.tissue.depth, rtol=1e-9)


def test_a_face_of_giants_is_doubted(face):
    with pytest.warns(FaceWrinkleWarning, match="the pupils are"):
        fitted = fw.fit_face(face.mesh, face.landmarks, units="cm")
    assert fitted.unit == 10.0


BAD = {
    "mirrored": (
        lambda face: (face.mesh, {mirrored_name(n): p for n, p in face.landmarks.items()}), "swapped left for right",
    ),
    "off the mesh": (
        lambda face: (face.mesh, {**face.landmarks, "malar_l": face.landmarks["malar_l"] + [20.0, 0, 0]}),
        "off the mesh.*malar_l",
    ),
    "other unit": (lambda face: (face.mesh, {n: 10.0 * p for n, p in face.landmarks.items()}), "same unit"),
    "no triangles": (lambda face: (pv.PolyData(face.points), face.landmarks), "faces"),
    "no file": (lambda face: ("none.obj", face.landmarks), "no file"),
}  # fmt: skip


@pytest.mark.parametrize(("given", "message"), BAD.values(), ids=BAD)
def test_meshes_and_landmarks_that_do_not_fit(face, given, message):
    with pytest.raises((LandmarkError, MeshError), match=message):
        fw.fit_face(*given(face), units="mm")


@pytest.mark.filterwarnings("ignore:Kept one of")
def test_a_scan_in_strips_is_in_pieces_wherever_most_landmarks_lie(face):
    """A head that is cut at the height of its eyes or lower: fewer and fewer of the landmarks are below."""
    middles = np.asarray(face.mesh.cell_centers().points)[:, 1]
    for cut in (face.landmarks["nose_tip"][1], face.landmarks["lower_lip_mid"][1], face.landmarks["pogonion"][1]):
        halves = [face.mesh.extract_cells(np.flatnonzero(side)) for side in (middles > cut + 9, middles < cut - 9)]
        strips = pv.merge(halves).extract_surface(algorithm="dataset_surface")
        with pytest.raises(MeshError, match="under the landmarks is in .*pieces.*Connect them"):
            fw.fit_face(strips, face.landmarks)


@pytest.mark.parametrize("units", [0.0, -1.0, np.nan, np.inf, [1], {}, b"mm", 1j, 1e-300, 1e300, 10**400, "milimeter"])
def test_units_that_are_none(face, units):
    with pytest.raises((ParameterError, UnknownNameError), match="units|unit 'milimeter'"):
        fw.fit_face(face.mesh, face.landmarks, units=units)


def test_landmarks_are_measured_to_the_surface_not_to_its_vertices(face):
    """The middle of the forehead is one wide fan of triangles, whose corners are far from the landmark."""
    place = face.landmarks["forehead_mid"]
    far = np.linalg.norm(face.points - place, axis=1) > 0.3 * face.frame.pupil_distance
    holed = face.triangles[far[face.triangles].all(axis=1)]
    used, holed = np.unique(holed, return_inverse=True)
    points, holed = face.points[used], holed.reshape(-1, 3).astype(np.int32)
    rim = min(fw.geometry.boundary_loops(holed), key=lambda loop: np.linalg.norm(points[loop].mean(axis=0) - place))
    fan = [[rim[0], b, a] for a, b in pairwise(rim[1:])]
    mesh = fw.mesh.to_polydata(points, np.concatenate([holed, fan]))
    coarse = dataclasses.replace(face, mesh=mesh)
    assert np.linalg.norm(coarse.points - place, axis=1).min() > 0.25 * face.frame.pupil_distance
    on_it = np.asarray(mesh.find_closest_cell(place, return_closest_point=True)[1])
    moved = coarse.with_landmarks({"forehead_mid": on_it})
    np.testing.assert_array_equal(moved.landmarks["forehead_mid"], on_it)
    off_it = on_it + 0.3 * face.frame.pupil_distance * face.frame.axes[2]
    away = np.linalg.norm(mesh.find_closest_cell(off_it, return_closest_point=True)[1] - off_it)
    told = rf"landmarks off the mesh.*forehead_mid \({away / face.frame.pupil_distance:.2g}\)"
    with pytest.raises(LandmarkError, match=told):
        coarse.with_landmarks({"forehead_mid": off_it})


def test_lids_are_shut_or_not_by_the_eyes_of_the_file(face, monkeypatch):
    """Lids that lie on a ball of one size only: on that of the file, or on the one that is placed without it."""
    eye, radius = face.eyes[0], 1.1 * face.eyes[0].radius
    ball = pv.Sphere(radius=radius, center=eye.centre, theta_resolution=20, phi_resolution=20)

    def lying_on(large):
        def found(own, *mesh):
            return eyelid_opening(own, *mesh) if own.side == "r" or (own.radius > 0.95 * radius) == large else None

        return found

    for large, shut in ((True, False), (False, True)):
        monkeypatch.setattr("facewrinkle.anatomy.face.eyelid_opening", lying_on(large))
        with warnings.catch_warnings(record=True, action="always") as told:
            whole = fw.fit_face(face.mesh + ball, face.landmarks)
        assert whole.eyes[0].radius == pytest.approx(radius, rel=0.02)
        assert ("l" not in whole.eyelid_openings) == shut
        assert any("no opening in front of the left eye" in str(one.message) for one in told) == shut
        assert any("no opening in front of the left eye" in sentence for sentence in whole.report) == shut


def off_by(face, name, mm, degrees):
    """The place on the skin that is so far from a landmark, in a direction outwards (0) or up (90) of a left eye."""
    turn = np.radians(degrees)
    aside = np.cos(turn) * face.frame.axes[0] + np.sin(turn) * face.frame.axes[1]
    return fw.mesh.closest_places(face.mesh, face.landmarks[name] + mm * aside)[1][0]


@pytest.mark.parametrize("kind", [None, "sockets", "thick"])
def test_corners_that_are_no_ends_of_the_opening_do_not_cost_the_lids(face, kind):
    """Those of the eye that is there take their place, and it is said; the other eye keeps what was given."""
    head = face if kind is None else head_with(kind)
    off = {"eye_l_inner": off_by(head, "eye_l_inner", 6.5, 0.0), "eye_l_outer": off_by(head, "eye_l_outer", 6.5, 225.0)}
    with pytest.warns(fw.FaceWrinkleWarning, match=r"eye_l_inner \(\d\.\d mm\), eye_l_outer \(\d\.\d mm\)") as told:
        fitted = fw.fit_face(head.mesh, {**head.landmarks, **off}, units="mm")
    assert len(told) == 1
    assert "not at the ends of the opening" in fitted.report[-1]
    assert set(fitted.eyelid_openings) == {"l", "r"}
    for name in off:
        assert np.linalg.norm(fitted.landmarks[name] - head.landmarks[name]) < 2.0
        assert name in fitted.estimated
    for name in set(head.landmarks) - set(off):
        np.testing.assert_array_equal(fitted.landmarks[name], head.landmarks[name])
    upper = head.eyelid_openings["l"].upper
    assert len(set(upper) & set(fitted.eyelid_openings["l"].upper)) >= 0.8 * len(upper)


def test_corners_that_are_a_little_off_stay_where_they_are(face):
    with warnings.catch_warnings(action="error"):
        for inner, outer in ((0.0, 0.0), (90.0, 270.0), (180.0, 45.0), (270.0, 180.0)):
            places = off_by(face, "eye_l_inner", 2.0, inner), off_by(face, "eye_l_outer", 6.0, outer)
            moved = face.with_landmarks(dict(zip(("eye_l_inner", "eye_l_outer"), places, strict=True)))
            np.testing.assert_array_equal(moved.landmarks["eye_l_outer"], places[1])
            assert set(moved.eyelid_openings) == {"l", "r"}
