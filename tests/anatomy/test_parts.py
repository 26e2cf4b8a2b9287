"""Parts that come with a face beside its skin: named by place and size, and moved with eyes, jaw, lids and head."""

import warnings

import numpy as np
import pytest
import pyvista as pv
from dressed_head import NAMES, ellipsoid, joined, lash, together
from expressions import after
from glb_files import GltfFile
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from facewrinkle.anatomy.attachments import combined_mesh
from facewrinkle.anatomy.finding.features import DARKER, PHOTO_STEP, rise_of_dark_bands
from facewrinkle.anatomy.parts import ball_of
from facewrinkle.appearance.seen import Appearance, companion_meshes


def test_parts_are_told_apart(dressed, pieces, face):
    assert tuple(dressed.parts) == NAMES
    for name, (points, triangles) in pieces.items():
        mesh = dressed.parts[name].mesh
        np.testing.assert_array_equal(mesh.points, points)
        np.testing.assert_array_equal(mesh.regular_faces, triangles)
    assert dressed.mesh.n_points == face.mesh.n_points
    assert dressed.report[-1] == "Dropped specks: 1."
    assert "eye_l (720)" in dressed.report[-3]


def _as_obj(path, pieces):
    lines, start = [], 1
    for number, (name, (points, triangles)) in enumerate(pieces):
        lines += [f"o Object_{number}", f"usemtl {name}" if number % 2 else f"g {name}"]
        lines += [f"v {x:.12g} {y:.12g} {z:.12g}" for x, y, z in points]
        lines += [f"f {a} {b} {c}" for a, b, c in triangles + start] + ["usemtl plain"]
        start += len(points)
    path.write_text("\n".join(lines))


def _as_glb(path, pieces):
    made = GltfFile()
    made.content["materials"] = [{"name": name if number % 2 else "plain"} for number, (name, _) in enumerate(pieces)]
    for number, (name, (points, triangles)) in enumerate(pieces):
        mesh = made.mesh(points, triangles, material=number)
        made.node(mesh=mesh, name=f"Object_{number}" if number % 2 else name)
    made.content["scenes"] = [{"nodes": list(range(len(pieces)))}]
    made.glb(path)


def _as_usd(path, pieces):
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom, Vt

    stage = Usd.Stage.CreateNew(str(path))
    for number, (name, (points, triangles)) in enumerate(pieces):
        mesh = UsdGeom.Mesh.Define(stage, f"/root/{name}/mesh_{number}" if number % 2 else f"/root/{name}")
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)))
        mesh.CreateFaceVertexCountsAttr([3] * len(triangles))
        mesh.CreateFaceVertexIndicesAttr(triangles.ravel().tolist())
    stage.Save()


@pytest.mark.filterwarnings("ignore::facewrinkle.errors.FaceWrinkleWarning")
@pytest.mark.parametrize(("write", "ending"), [(_as_obj, "obj"), (_as_glb, "glb"), (_as_usd, "usda")])
def test_names_in_the_file_count_more_than_place_and_size(face, pieces, tmp_path, write, ending):
    """Where they say something: an object without a telling name is what its place and size make it."""
    named = {
        "Head_with_eyes_and_teeth": ((face.points, face.triangles), None),
        "Sunglasses_01": (pieces["hair"], "glasses"),
        "brown_hair": (pieces["other"], "hair"),
        "LeftEyebrow": (pieces["eye_l"], "fuzz"),
        "RightEye": (ellipsoid(face, [-0.6, 0.1, 0.5], [0.1, 0.1, 0.1]), "eye_r"),
        "upperGum": (pieces["glasses"], "upper_teeth"),
        "Thing": (pieces["eye_r"], "eye_r"),
        "TONGUE": (pieces["lashes_r"], "tongue"),
        "lashes": (ellipsoid(face, [0.9, 0.0, 0.3], [0.1, 0.1, 0.1]), "lashes_l"),
        "Thing_with_teeth_and_hair": (pieces["lower_teeth"], "lower_teeth"),
    }
    path = tmp_path / f"face.{ending}"
    write(path, [(name, piece) for name, (piece, _) in named.items()])
    parts = fw.fit_face(path, face.landmarks, units="mm").parts
    for kind in {kind for _, kind in named.values() if kind}:
        points = np.concatenate([piece[0] for piece, of_kind in named.values() if of_kind == kind])
        np.testing.assert_allclose(parts[kind].mesh.points, points, atol=1e-4)
        assert not any("name" in array for array in (*parts[kind].mesh.cell_data, *parts[kind].mesh.field_data))
    assert len(parts) == len({kind for _, kind in named.values() if kind})


@pytest.mark.parametrize("shift", [-0.3, 0.3])
def test_teeth_beside_the_level_of_the_lips_belong_to_both_jaws(face, pieces, shift):
    """Those of faces whose lips lie lower or higher; and a single arch is that of one."""
    move = shift * face.frame.pupil_distance * face.frame.axes[1]
    arches = [pieces[name] for name in ("upper_teeth", "lower_teeth")]
    for count in (2, 1):
        soup = face.mesh.copy()
        for points, triangles in arches[:count]:
            soup = soup.append_polydata(pv.PolyData.from_regular_faces(points + move, triangles))
        with pytest.warns(fw.FaceWrinkleWarning, match="separate parts"):
            parts = fw.fit_face(soup, face.landmarks, units="mm").parts
        alone = "upper_teeth" if shift > 0.0 else "lower_teeth"
        assert set(parts) == ({"upper_teeth", "lower_teeth"} if count == 2 else {alone})


def test_a_tongue_is_no_tooth(face):
    """It is red, goes with the mandible, and stands in for the painted one."""
    lips = face.frame.local(face.landmarks["upper_lip_mid"])
    tongue = pv.PolyData.from_regular_faces(*ellipsoid(face, lips - [0.0, 0.15, 0.7], [0.3, 0.15, 0.42]))
    with pytest.warns(fw.FaceWrinkleWarning, match="separate parts"):
        licking = fw.fit_face(face.mesh.append_polydata(tongue), face.landmarks, units="mm")
    assert {name: part.follows for name, part in licking.parts.items()} == {"tongue": "mandible"}
    red, green, blue = np.asarray(companion_meshes(licking, licking.mesh)["tongue"].point_data["paint"])[0].astype(int)
    assert red > 1.5 * max(green, blue)


def test_cards_of_lashes_without_their_picture_are_not_drawn(face):
    """Painted ones are, in their place; hairs that are modeled, and cards with colors, are drawn as they are."""
    cards = pv.PolyData.from_regular_faces(*lash(face, face.eyes[0]))
    colored = cards.copy()
    colored.point_data["Colors"] = np.full((cards.n_points, 3), 30, np.uint8)
    tips = np.asarray(cards.points)[17:31]
    hairs = pv.merge([pv.Line(tip, tip + 5.0).tube(radius=0.1, n_sides=6, capping=False).triangulate() for tip in tips])
    plain = fw.mesh.to_polydata(face.points, face.triangles)
    plain.point_data["Colors"] = np.asarray(face.mesh.point_data["Colors"])[:, :3]
    for lashes, skin, drawn in ((cards, face.mesh, False), (colored, plain, True), (hairs, face.mesh, True)):
        with warnings.catch_warnings(record=True, action="always") as warned:
            dressed = fw.fit_face(skin.append_polydata(lashes), face.landmarks, units="mm")
        assert any("lashes_l are cards" in str(one.message) for one in warned) != drawn
        assert list(dressed.parts) == ["lashes_l"]
        assert ("lashes_l" in Appearance.of(dressed).own) == drawn
        with fw.plotting.Scene(dressed, fw.plotting.Style((32, 32))) as scene:
            scene.show(dressed.mesh)
            assert ("lashes_l" in scene.drawn_parts["hair"]) != drawn


@pytest.mark.filterwarnings("ignore::facewrinkle.errors.FaceWrinkleWarning")
@pytest.mark.parametrize("larger", [0.8, 1.6, 2.2])
def test_eyes_that_are_no_adults_are_balls_too(face, larger):
    """Behind the same lids, as a child's are, with an iris that lies before the ball and lashes."""
    pieces, centres = [], []
    for eye in face.eyes:
        radius = larger * eye.radius
        centres.append(eye.centre - (radius - eye.radius) * eye.gaze)
        ball = pv.Sphere(radius=radius, center=centres[-1], theta_resolution=20, phi_resolution=20)
        iris = pv.Disc(
            center=centres[-1] + 1.01 * radius * eye.gaze,
            inner=0.0,
            outer=0.4 * eye.radius,
            normal=eye.gaze,
            r_res=2,
            c_res=12,
        ).triangulate()
        pieces += [(np.asarray(m.points, float), np.asarray(m.regular_faces)) for m in (ball, iris)] + [lash(face, eye)]
    fitted = together(face, pieces)
    assert tuple(fitted.parts) == ("eye_l", "eye_r", "lashes_l", "lashes_r")
    for eye, centre, rest in zip(fitted.eyes, centres, face.eyes, strict=True):
        np.testing.assert_allclose(eye.centre, centre, atol=1e-3)
        assert eye.radius == pytest.approx(larger * rest.radius, rel=1e-5)
        assert fitted.parts[f"eye_{eye.side}"].mesh.n_cells == 720 + 36


def test_other_surfaces_keep_their_parts():
    plane = pv.Plane(i_resolution=4, j_resolution=4).triangulate()
    ball = pv.Sphere(radius=0.1, center=(0, 0, 1), theta_resolution=8, phi_resolution=8)
    with warnings.catch_warnings(action="ignore", category=fw.FaceWrinkleWarning):
        cloth = fw.surface(plane.append_polydata(ball))
    assert list(cloth.parts) == ["other"]
    frame = fw.Simulation(cloth).step()
    np.testing.assert_allclose(cloth.parts_at(frame)["other"].points, ball.points, atol=1e-6)


def test_a_ball_is_found_in_its_front():
    directions = np.random.default_rng(0).normal(size=(200, 3))
    directions = directions[directions[:, 2] > 0.0]
    points = 3.0 * directions / np.linalg.norm(directions, axis=1, keepdims=True) + [7.0, 8.0, 9.0]
    centre, radius = ball_of(points)
    np.testing.assert_allclose(centre, [7.0, 8.0, 9.0], atol=1e-9)
    assert radius == pytest.approx(3.0)


@pytest.mark.parametrize(("alpha", "channels"), [(254, 3), (100, 4)])
def test_parts_are_translucent_only_where_it_shows(face, alpha, channels):
    """Scanners and exporters leave an alpha of 254 here and there; glass and cards of hair are much clearer."""
    hat = pv.Icosphere(radius=30.0, center=face.landmarks["nasion"] + [0.0, 90.0, -60.0], nsub=2)
    whole = pv.PolyData.from_regular_faces(
        np.vstack([face.points, hat.points]), np.vstack([face.triangles, hat.regular_faces + len(face.points)])
    )
    colors = np.tile(np.array([90, 80, 70, 255], np.uint8), (whole.n_points, 1))
    colors[:: len(colors) // 7] = [120, 60, 50, alpha]
    colors[-1, 3] = alpha
    whole.point_data["Colors"] = colors
    with warnings.catch_warnings(action="ignore", category=fw.FaceWrinkleWarning):
        fitted = fw.fit_face(whole, face.landmarks, units="mm")
    assert fitted.mesh.point_data["Colors"].shape[1] == 3
    (part,) = fitted.parts.values()
    assert part.mesh.point_data["Colors"].shape[1] == channels
    both = np.asarray(fitted.with_parts(fitted.mesh).point_data["Colors"])
    np.testing.assert_array_equal(both[: fitted.mesh.n_points, :3], fitted.mesh.point_data["Colors"])
    np.testing.assert_array_equal(both[fitted.mesh.n_points :, :channels], part.mesh.point_data["Colors"])
    assert (both[: fitted.mesh.n_points, 3:] == 255).all()


@pytest.mark.parametrize(
    ("radii", "where", "name"),
    [
        ((0.25, 0.15, 0.75), (0.0, -1.0, -0.6), "tongue"),
        ((0.72, 0.3, 0.5), (0.0, -0.95, -0.6), "teeth"),
        ((0.2, 1.6, 0.03), (0.4, -0.4, 0.5), "hair"),
    ],
)
def test_gums_and_tongues_reach_far_back_and_a_fringe_hangs_down(face, radii, where, name):
    with warnings.catch_warnings(action="ignore", category=fw.FaceWrinkleWarning):
        fitted = together(face, [ellipsoid(face, where, radii)])
    assert [part.removeprefix("lower_").removeprefix("upper_") for part in fitted.parts] == [name]


@pytest.mark.slow
def test_shells_over_the_eyes_and_lashes_do_not_move_their_corners(face):
    """Wet lines, occlusion shells and lashes cover the corners, and close the openings as the template's are closed."""
    pieces = []
    for eye in face.eyes:
        shell = pv.Sphere(radius=1.08 * eye.radius, center=eye.centre, theta_resolution=40, phi_resolution=40)
        pieces += [(np.asarray(shell.points, float), np.asarray(shell.regular_faces)), lash(face, eye)]
    given = {name: face.landmarks[name] for name in ("nose_tip", "mouth_l", "mouth_r")}  # where the face is
    plain = fw.find_landmarks(face.mesh, given=given).landmarks
    found = fw.find_landmarks(joined(face, pieces), given=given).landmarks
    for name in ("eye_l_inner", "eye_l_outer", "eye_r_inner", "eye_r_outer"):
        assert np.linalg.norm(found[name] - plain[name]) < 0.01 * face.frame.pupil_distance


# --- brows of a photo -----------------------------------------------------------------------------


def _painted(face, shift, darkness, texture):
    """The head with brows painted `shift` above its own, in distances between the pupils, and its photo."""
    mesh = fw.mesh.to_polydata(face.points, face.triangles)
    mesh.active_texture_coordinates = np.asarray(face.mesh.active_texture_coordinates)
    mesh = mesh.subdivide(2, "linear")
    local = face.frame.local(np.asarray(mesh.points, float))
    strength = np.zeros(len(local))
    for side in "lr":
        brow = np.array([face.frame.local(face.landmarks[f"brow_{side}_{part}"]) for part in ("inner", "mid", "outer")])
        brow = brow[np.argsort(brow[:, 0])]
        within = (local[:, 0] > brow[0, 0]) & (local[:, 0] < brow[-1, 0]) & (local[:, 2] > -0.5)
        away = local[:, 1] - np.interp(local[:, 0], brow[:, 0], brow[:, 1]) - shift
        strength = np.maximum(strength, within * np.exp(-0.5 * (away / 0.04) ** 2))
        x, y, _ = face.frame.local(face.landmarks[f"eye_{side}_centre"])
        lid = np.linalg.norm(local[:, :2] - [x, y + 0.12], axis=1)  # dark, but no brow
        strength = np.maximum(strength, np.exp(-0.5 * (lid / 0.05) ** 2))
    gray = 200.0 * (1.0 - darkness * strength)
    if not texture:
        mesh.point_data["Colors"] = np.rint(np.tile(gray[:, None], (1, 3))).astype(np.uint8)
        return mesh, None
    image, size = np.full((512, 512, 3), 200, np.uint8), 512
    uv = np.asarray(mesh.active_texture_coordinates)
    place = np.clip(np.rint(uv * size).astype(int), 2, size - 3)
    for i in range(-2, 3):
        for j in range(-2, 3):
            image[size - 1 - place[:, 1] + i, place[:, 0] + j] = gray[:, None]
    return mesh, image


@pytest.mark.parametrize("texture", [False, True])
@pytest.mark.parametrize("shift", [-0.08, 0.0, 0.12])
def test_painted_brows_are_found(face, shift, texture):
    mesh, image = _painted(face, shift, 0.6, texture)
    rise = rise_of_dark_bands(mesh, image, face.landmarks, face.frame)
    assert rise == pytest.approx(shift, abs=1.5 * PHOTO_STEP)


def test_without_a_photo_or_dark_bands_brows_stay(face):
    assert rise_of_dark_bands(fw.mesh.to_polydata(face.points, face.triangles), None, face.landmarks, face.frame) == 0.0
    faint, _ = _painted(face, 0.1, 0.3 * DARKER, False)
    assert rise_of_dark_bands(faint, None, face.landmarks, face.frame) == 0.0


# --- motion with eyes, jaw, lids and head -----------------------------------------------------------------------------


def test_at_rest_all_parts_are_where_they_were(dressed):
    for name, part in dressed.parts_at(dressed.mesh).items():
        np.testing.assert_allclose(part.points, dressed.parts[name].mesh.points, atol=1e-9 * 60.0)


def test_eyes_turn_with_the_gaze_and_nothing_else_does(dressed):
    sim = fw.Simulation(dressed, layers=[])
    sim.look(yaw=20.0)
    *_, frame = sim.run(3)
    parts = dressed.parts_at(frame)
    turn = Rotation.from_rotvec(np.radians(20.0) * dressed.frame.axes[1]).as_matrix()
    for eye in dressed.eyes:
        rest = dressed.parts[f"eye_{eye.side}"].mesh.points - eye.centre
        np.testing.assert_allclose(parts[f"eye_{eye.side}"].points - eye.centre, rest @ turn.T, atol=0.05)
    for name in ("hair", "upper_teeth", "glasses"):
        np.testing.assert_allclose(parts[name].points, dressed.parts[name].mesh.points, atol=0.05)


def test_lower_teeth_go_with_the_mandible(dressed):
    jaw = next(m for m in dressed.muscles.values() if isinstance(m, fw.anatomy.muscles.JawMuscle))
    sim = fw.Simulation(dressed, layers=[])
    sim.express("AU26")
    rate = dressed.atlas.contractions("AU26")[next(n for n, m in dressed.muscles.items() if m is jaw)]
    *_, frame = sim.run(60)
    parts = dressed.parts_at(frame)
    rest, now = (
        np.asarray(mesh.points) - jaw.hinge for mesh in (dressed.parts["lower_teeth"].mesh, parts["lower_teeth"])
    )
    turn = Rotation.align_vectors(now, rest)[0].as_rotvec()
    np.testing.assert_allclose(now, rest @ Rotation.from_rotvec(turn).as_matrix().T, atol=0.1)  # about the hinge
    np.testing.assert_allclose(turn / np.linalg.norm(turn), jaw.axis, atol=0.01)
    assert np.linalg.norm(turn) == pytest.approx(rate * jaw.angle, abs=1e-3)  # the muscle tells, not the skin over it
    assert np.abs(parts["upper_teeth"].points - dressed.parts["upper_teeth"].mesh.points).max() < 0.1


def test_lashes_go_down_with_the_lid(dressed):
    sim = fw.Simulation(dressed, layers=[])
    sim.contract({"orbicularis_oculi_l": 1.0})
    *_, frame = sim.run(60)
    parts = dressed.parts_at(frame)
    fall = (parts["lashes_l"].points - dressed.parts["lashes_l"].mesh.points) @ dressed.frame.axes[1]
    assert fall.max() < -3.0
    kept = parts["lashes_r"].points - dressed.parts["lashes_r"].mesh.points
    assert np.abs(kept).max() < 0.3
    # They keep their shape.
    edges = [np.linalg.norm(np.diff(mesh.points[:16], axis=0), axis=1) for mesh in
             (dressed.parts["lashes_l"].mesh, parts["lashes_l"])]  # fmt: skip
    np.testing.assert_allclose(edges[1], edges[0], rtol=0.35)


def test_everything_goes_with_a_head_that_moves(dressed):
    turn, shift = Rotation.from_rotvec([0.4, -1.0, 0.3]).as_matrix(), np.array([30.0, -500.0, 7.0])
    frame = dressed.mesh.copy()
    frame.points = np.asarray(frame.points) @ turn.T + shift
    for name, part in dressed.parts_at(frame).items():
        rest = np.asarray(dressed.parts[name].mesh.points)
        np.testing.assert_allclose(part.points, rest @ turn.T + shift, atol=1e-6)


@pytest.mark.parametrize("expression", ["paper_surprise", "happiness", "paper_fear"])
def test_the_expression_does_not_shift_the_hair(dressed, expression):
    hair = dressed.parts_at(after(fw.Simulation(dressed, layers=[]), expression, 40))["hair"]
    assert np.linalg.norm(hair.points - dressed.parts["hair"].mesh.points, axis=1).max() < 0.15, expression


def test_one_mesh_for_files(dressed):
    frame = fw.Simulation(dressed, layers=[]).step()
    whole = dressed.with_parts(frame)
    assert list(whole.field_data["parts"]) == ["skin", *NAMES]
    parts = dressed.parts_at(frame)
    assert whole.n_cells == frame.n_cells + sum(part.n_cells for part in parts.values())
    np.testing.assert_array_equal(whole.points[: frame.n_points], frame.points)
    for number, part in enumerate(parts.values(), start=1):
        np.testing.assert_array_equal(whole.points[whole["part"] == number], part.points)
    assert set(frame.point_data) | {"part"} == set(whole.point_data)
    assert combined_mesh(frame, {}).n_points == frame.n_points


def test_a_face_without_parts_is_its_own_frame(face):
    assert face.with_parts(face.mesh) is face.mesh
