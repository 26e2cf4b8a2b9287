"""The built-in face as a whole, and the anatomy under it.

what                        checked against
muscles and regions         where anatomy puts them: above, below, beside the landmarks; on the mesh
eyeballs                    an adult's radius; the lids around them; the axes of the face
jaw                         the rotation about its hinge; which landmarks it takes along
skull                       below the skin everywhere, by the depth of the tissue where it is flat
copies                      with_muscles leaves the face as it was
"""

import dataclasses
import pickle
from xml.etree import ElementTree

import numpy as np
import pytest
import pyvista as pv
from expressions import after
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from facewrinkle.anatomy.face import per_face
from facewrinkle.anatomy.skull import jaw_weights
from facewrinkle.appearance.mouth import Mouth
from facewrinkle.errors import LandmarkError, MeshError, ParameterError

# --- the whole ----------------------------------------------------------------------------------


def test_notebooks_show_what_a_face_has(face):
    hat = fw.anatomy.parts.Part(pv.Sphere(), follows="skull")
    seen = dataclasses.replace(face, parts={"<hat>": hat, "eye_l": hat}, estimated=("chin",), likeness=0.876, unit=10.0)
    table = [[cell.text for cell in row] for row in ElementTree.fromstring(seen._repr_html_())]
    assert dict(table[1:]) == {
        "Triangles": str(face.mesh.n_cells),
        "Unit": "10 mm",
        "Landmarks": f"{len(face.landmarks)}, of which estimated: chin",
        "Muscles": str(len(face.muscles)),
        "Parts": "<hat>, eye_l",
        "Likeness": "0.88",
    }


def test_two_built_in_faces_share_no_memory():
    one, two = fw.default_face(), fw.default_face()
    one.mesh.points[0] += 1.0
    one.landmarks["nasion"] += 1.0
    assert not np.array_equal(one.mesh.points[0], two.mesh.points[0])
    assert not np.array_equal(one.landmarks["nasion"], two.landmarks["nasion"])
    assert np.array_equal(fw.default_face().points, two.points)


# --- muscles where anatomy has them -------------------------------------------------------------


@pytest.mark.parametrize("any_face", [None, "ict_face_narrow", "makehuman_head_male"], indirect=True)
def test_muscles_lie_where_anatomy_has_them(any_face):
    marks = {name: any_face.frame.local(point) for name, point in any_face.landmarks.items()}
    points = {
        (name, part): any_face.frame.local(np.atleast_2d(getattr(muscle, part)).mean(axis=0))
        for name, muscle in any_face.muscles.items()
        for part in ("attachment", "insertion")
        if hasattr(muscle, part)
    }
    near = {  # insertions lie within half the distance between the pupils of ...
        "frontalis_inner": "brow_l_inner", "frontalis_major": "brow_l_mid", "frontalis_outer": "brow_l_outer",
        "corrugator": "brow_l_mid", "nasalis": "ala_l", "zygomaticus_major": "mouth_l", "risorius": "mouth_l",
        "depressor_anguli_oris": "mouth_l", "mentalis": "pogonion",
    }  # fmt: skip
    for name, landmark in near.items():
        assert np.linalg.norm(points[name + "_l", "insertion"] - marks[landmark]) < 0.5, name
    for name in ("frontalis_inner", "frontalis_major", "frontalis_outer"):  # they lift the brow
        assert points[name + "_l", "attachment"][1] > points[name + "_l", "insertion"][1] + 0.2
    order = [points[f"frontalis_{part}_l", "insertion"][0] for part in ("inner", "major", "outer")]
    assert order == sorted(order)
    # Corrugators pull inwards, zygomatics up and outwards, the risorius outwards and back, depressors down.
    pull = {n: points[n + "_l", "attachment"] - points[n + "_l", "insertion"] for n in near}
    assert pull["corrugator"][0] < 0.0
    assert pull["zygomaticus_major"][0] > 0.0
    assert pull["zygomaticus_major"][1] > 0.0
    assert pull["risorius"][0] > 0.0
    assert pull["risorius"][2] < 0.0
    assert pull["depressor_anguli_oris"][1] < 0.0
    assert pull["nasalis"][1] > 0.0
    for side, sign in (("l", 1.0), ("r", -1.0)):
        assert any_face.frame.local(any_face.muscles[f"orbicularis_oculi_{side}"].centre)[0] * sign > 0.3
    mouth = any_face.frame.local(any_face.muscles["orbicularis_oris"].centre)
    assert abs(mouth[0]) < 0.05
    assert mouth[1] < -0.7


# --- eyes ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "any_face", [None, "ict_face_narrow", "makehuman_head_male", "mediapipe_canonical_face_model"], indirect=True
)
def test_eyeballs(any_face):
    assert [eye.side for eye in any_face.eyes] == ["l", "r"]
    adult = 12.0 * any_face.frame.pupil_distance / fw.anatomy.MEAN_PUPIL_DISTANCE
    for eye, sign in zip(any_face.eyes, (1.0, -1.0), strict=True):
        assert 0.7 * adult < eye.radius < 1.1 * adult
        assert any_face.frame.local(eye.centre)[0] * sign == pytest.approx(0.5, abs=0.03)
        np.testing.assert_allclose(eye.gaze, any_face.frame.axes[2])
        np.testing.assert_allclose(eye.up, any_face.frame.axes[1])


def test_the_jaw_takes_the_chin_along_and_leaves_the_nose(face):
    jaw = face.joint_weights["jaw"]
    at = dict(zip(jaw.vertices.tolist(), jaw.angles, strict=True))
    nearest = cKDTree(face.points).query
    chin, lip, nose, brow = (
        int(nearest(face.landmarks[name])[1]) for name in ("pogonion", "lower_lip_mid", "nose_tip", "glabella")
    )
    full = face.muscles["jaw"].angle
    assert at[chin] == pytest.approx(full, rel=0.02)
    assert at[lip] > 0.8 * full
    assert at.get(nose, 0.0) == at.get(brow, 0.0) == 0.0
    assert jaw.turned(face.points, 1.0)[jaw.vertices == chin] @ face.frame.axes[1] < -10.0  # mm


def test_a_lower_lip_that_lies_high_goes_with_the_jaw(face):
    """The middle of the mouth is 6 mm higher than its corners: the lower lip is still the lower one."""
    points = face.points.copy()
    away = np.linalg.norm(points - fw.anatomy.lips_middle(face.landmarks), axis=1)
    points += 6.0 * np.exp(-((away / 12.0) ** 2))[:, None] * face.frame.axes[1]
    shares = []
    for places in (face.points, points):
        weights = jaw_weights(face.muscles["jaw"], places, face.edges, face.landmarks, face.frame)
        share = np.zeros(len(points))
        share[weights.vertices] = weights.angles / face.muscles["jaw"].angle
        shares.append(share)
    lips = away < 12.0
    upper, lower = lips & (shares[0] < 0.2), lips & (shares[0] > 0.8)
    assert upper.sum() > 20
    assert lower.sum() > 20
    assert shares[1][upper].max() < 0.3
    assert shares[1][lower].min() > 0.6


def test_no_jaw_where_the_mouth_is_closed_by_skin(face):
    """Lips that are one piece, as those of many scans, would be drawn out to a skin between them."""
    loop, middle = Mouth(face).loop, len(face.points)
    fan = np.stack([np.roll(loop, -1), loop, np.full(len(loop), middle)], axis=1)
    mesh = fw.mesh.to_polydata(
        np.vstack([face.points, face.points[loop].mean(axis=0)]), np.vstack([face.triangles, fan])
    )
    with pytest.warns(fw.FaceWrinkleWarning, match="no opening between the lips"):
        whole = fw.fit_face(mesh, face.landmarks, units="mm")
    assert (face.mouth_opens, whole.mouth_opens, Mouth(whole).opens) == (True, False, False)
    assert "jaw" not in whole.joint_weights


# --- skull --------------------------------------------------------------------------------------


@pytest.mark.parametrize("any_face", [None, "ict_face_narrow", "makehuman_head_male"], indirect=True)
def test_the_skull_lies_below_the_skin(any_face):
    tissue, unit = any_face.tissue, any_face.unit
    above = ((any_face.points - tissue.anchors) * tissue.normals).sum(axis=1)
    # A third of the tissue is left of it at least, wherever smoothing cut a corner.
    assert (above >= tissue.depth / 3.0 - 1e-9 / unit).all()
    depth = tissue.depth * unit
    assert 3.0 < depth.min() < depth.max() < 20.0
    np.testing.assert_allclose(np.linalg.norm(tissue.normals, axis=1), 1.0, atol=1e-12)
    assert (
        np.median((fw.geometry.vertex_normals(any_face.points, any_face.triangles) * tissue.normals).sum(axis=1)) > 0.97
    )
    assert (tissue.stiffness > 0.0).all()
    forehead = np.argmin(np.linalg.norm(any_face.points - any_face.landmarks["forehead_mid"], axis=1))
    assert above[forehead] * unit == pytest.approx(5.0, abs=1.6)
    lips = cKDTree(any_face.points).query([any_face.landmarks["upper_lip_mid"], any_face.landmarks["mouth_l"]])[1]
    assert tissue.stiffness[lips].max() < 0.7 * tissue.stiffness[forehead]


def test_landmarks_move_with_the_skin(face):
    frame = after(fw.Simulation(face), {"AU1": 1.0, "AU2": 1.0, "AU27": 1.0}, 25)
    assert frame.n_points > face.mesh.n_points
    now = face.landmarks_on(frame)
    assert list(now) == list(face.landmarks)
    on_skin = [name for name in now if not name.endswith("_centre")]
    _, closest = frame.find_closest_cell([now[name] for name in on_skin], return_closest_point=True)
    assert np.abs(closest - [now[name] for name in on_skin]).max() < 1e-4
    shift = {name: now[name] - place for name, place in face.landmarks.items()}
    assert shift["brow_l_mid"][1] > 5.0
    assert shift["lower_lip_mid"][1] < -10.0  # the lips touch at rest, and each landmark stays on its own
    assert abs(shift["upper_lip_mid"][1]) < 2.0
    for side in "lr":
        np.testing.assert_array_equal(shift[f"eye_{side}_centre"], 0.0)
    on_mesh = fw.Simulation(face, fw.Refinement(max_level=0), layers=[])
    np.testing.assert_allclose(
        list(face.landmarks_on(on_mesh.step()).values()), list(face.landmarks.values()), atol=0.01
    )


def test_landmarks_of_another_mesh_are_refused(face):
    for mesh in (pv.Sphere(), face.mesh.append_polydata(pv.Sphere())):
        with pytest.raises(MeshError, match="Give a frame of its simulation"):
            face.landmarks_on(mesh)


def test_landmarks_go_with_a_head_that_turns(face):
    turned = fw.Simulation(face).step()
    pose = np.array([[0, 0, 1, 3], [0, 1, 0, 4], [-1, 0, 0, 5], [0, 0, 0, 1]], dtype=float)
    turned.points = face.points @ pose[:3, :3].T + pose[:3, 3]
    turned.field_data["pose"] = pose
    for name, place in face.landmarks_on(turned).items():
        np.testing.assert_allclose(place, pose[:3, :3] @ face.landmarks[name] + pose[:3, 3], atol=1e-9)


def test_a_face_is_shown_upright(face):
    """However it lies: a face that was turned looks the same."""
    turn = Rotation.from_rotvec([0.4, 2.0, -0.7])
    mesh = face.mesh.copy()
    mesh.points = turn.apply(face.points)
    marks = {name: turn.apply(place) for name, place in face.landmarks.items()}
    first, second = (
        who.plot(off_screen=True, screenshot=True, window_size=[90, 120], lighting=False)[:90].astype(int)
        for who in (face, fw.Face.from_landmarks(mesh, marks, 1.0, texture=face.texture))
    )
    assert np.abs(first - second).mean() < 1.0
    hair, skin = (first[rows, 40:50].mean() for rows in (slice(26, 32), slice(50, 60)))
    assert hair < 0.7 * skin < 200.0


def test_things_are_made_once_for_a_face_and_a_key():
    face, made = fw.default_face(), []
    for key in (1, 1, 2, 1):
        assert per_face(face, "part", key, lambda key=key: made.append(key) or key) == key
    assert made == [1, 2]
    assert per_face(dataclasses.replace(face), "part", 1, lambda: "its own") == "its own"
    for key in (3, 4, 5, 5):
        per_face(face, "part", key, lambda key=key: made.append(key))
    per_face(face, "part", 1, lambda: made.append("anew"))
    assert made == [1, 2, 3, 4, 5, "anew"]


def test_a_face_needs_triangles_and_landmarks(face):
    with pytest.raises(MeshError, match="triangles"):
        fw.Face.from_landmarks(pv.PolyData(face.points), face.landmarks, 1.0)
    with pytest.raises(LandmarkError, match="32 landmarks are missing, such as trichion"):
        fw.Face.from_landmarks(face.mesh, {"nose_tip": face.landmarks["nose_tip"]}, 1.0)


def test_a_face_answers_as_a_mesh_does(face, tmp_path):
    mesh = face.mesh
    assert (face.n_points, face.n_cells, face.bounds) == (mesh.n_points, mesh.n_cells, mesh.bounds)
    read = fw.read(fw.write_face(face, tmp_path / "head.face"))
    np.testing.assert_array_equal(read.points, face.points)
    assert list(read.muscles) == list(face.muscles)
    assert fw.read(fw.write_mesh(mesh, tmp_path / "head.ply")).n_cells == face.n_cells


def test_muscles_show_their_names_alone(face):
    shown = repr(face.muscles)
    assert shown.startswith("48 muscles: frontalis_inner_l, ")
    assert len(shown) < 1500
    assert repr(face.with_muscles({}).muscles) == repr(pickle.loads(pickle.dumps(face)).muscles) == shown


@pytest.mark.parametrize("any_face", [None, "makehuman_head_male", "ict_face_narrow"], indirect=True)
def test_flesh_sags_with_the_age_on_every_face_and_its_eyes_stay(any_face):
    old, frame = any_face.aged(1.0), any_face.frame
    assert old.age == 1.0
    assert old.muscles.keys() == any_face.muscles.keys()
    moved = (old.points - any_face.points) @ frame.axes.T * any_face.unit
    assert 3.0 < np.linalg.norm(moved, axis=1).max() < 7.0
    for name in ("brow_l_outer", "brow_r_outer", "nose_tip"):
        sunk = (old.landmarks[name] - any_face.landmarks[name]) @ frame.axes[1] * any_face.unit
        assert -4.0 < sunk < -1.5, name
    for eye in any_face.eyes:
        near = np.linalg.norm(any_face.points - eye.centre, axis=1) < 1.1 * eye.radius
        assert np.abs(moved[near]).max(initial=0.0) == 0.0


def test_a_face_does_not_change_at_its_own_age_and_half_the_years_do_half(face):
    np.testing.assert_array_equal(face.aged(0.0).points, face.points)
    half, whole = (face.aged(age).points - face.points for age in (0.5, 1.0))
    np.testing.assert_allclose(2.0 * half, whole, atol=1e-9)
    with pytest.raises(ParameterError, match=r"age must lie in \[0, 1\]"):
        face.aged(60)


def test_the_built_in_head_ages_as_other_faces_do_but_for_lids_and_lips(face):
    away = np.linalg.norm(face.aged(1.0).points - fw.default_face({"age": 1.0}).points, axis=1)
    assert np.quantile(away, 0.8) < 0.1
    assert away.max() < 2.0
