"""The loop: skin, refinement, wrinkles, frames.

what                    checked against
arrays of a frame       the names and shapes that the architecture promises; field data
points                  the carried skin plus W along the interpolated normals
split_gamma             Eq. 19 over all edges, in numpy
point data of the mesh  affine functions of the rest position, to 1e-12; nearest vertices for labels
refinement              angles of base triangles and their bisections; the level cap; the paper's counts
release                 M0, bit for bit; a reset simulation; W exactly 0
frames                  themselves, later; a second simulation; the input's fingerprint
ramps                   the smoothstep of their share of the run
"""

from __future__ import annotations

import dataclasses
import time

import numpy as np
import pytest
from scipy.spatial import cKDTree

import facewrinkle as fw
from analysis.surfaces import settled, wrinkled_surface
from facewrinkle.errors import ParameterError, UnknownNameError
from facewrinkle.geometry.normals import vertex_normals
from facewrinkle.geometry.topology import unique_edges
from facewrinkle.layers.base import Displacement
from facewrinkle.mesh import ARRAYS, MUSCLES

PAPER = ("surprise", "frowning", "closing_eye", "stretching_mouth", "fear")


def angles(points, triangles):
    """Smallest angle of each triangle, degrees."""
    a, b, c = (points[triangles[..., k]] for k in range(3))
    out = []
    for o, p, q in ((a, b, c), (b, c, a), (c, a, b)):
        u, v = p - o, q - o
        out.append(np.arctan2(np.linalg.norm(np.cross(u, v), axis=-1), (u * v).sum(axis=-1)))
    return np.rad2deg(np.min(out, axis=0))


# --- the arrays of a frame ----------------------------------------------------------------------


@pytest.mark.parametrize("name", PAPER)
def test_frames_carry_what_they_promise(face, played, name):
    frame, n = played(name).top, played(name).top.n_points
    assert set(ARRAYS) == {"lambda", "gamma", "epsilon", "W", "split_gamma", "muscle", "level", "rest"}
    for array in ("lambda", "gamma", "epsilon", "W", "split_gamma"):
        assert frame[array].shape == (n,)
        assert frame[array].dtype == np.float64
        assert np.isfinite(frame[array]).all()
    assert frame["rest"].shape == (n, 3)
    assert frame["muscle"].dtype.kind == frame["level"].dtype.kind == "i"
    assert frame["muscle"].min() == -1
    assert frame["muscle"].max() < len(face.muscles)
    assert list(frame.field_data[MUSCLES]) == list(face.muscles)
    np.testing.assert_allclose(np.linalg.norm(frame["Normals"], axis=1), 1.0, atol=1e-12)
    assert frame.point_data.active_normals_name == "Normals"
    assert frame.points.dtype == np.float64
    assert frame.is_all_triangles
    assert set(face.mesh.point_data) <= set(frame.point_data)
    assert frame.active_texture_coordinates.shape == (n, 2)
    # The vertices of the mesh come first, where they were at rest, to the last bit.
    base = face.mesh.n_points
    assert np.array_equal(frame["rest"][:base], face.points)
    assert (frame["level"][:base] == 0).all()
    assert (frame["level"][base:] >= 1).all()
    assert np.isfinite(frame.points).all()


@pytest.mark.parametrize("name", PAPER)
def test_points_are_the_skin_and_w_along_its_normals(face, played, name):
    held, frame = played(name).held, played(name).top

    def interpolated(values):
        return np.einsum("nc,nck->nk", held.barycentric, values[held.corners])

    normals = interpolated(vertex_normals(held.bare, face.triangles))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(
        frame.points, interpolated(held.bare) + frame["W"][:, None] * normals, rtol=0, atol=1e-10
    )
    np.testing.assert_allclose(frame["rest"], interpolated(face.points), rtol=0, atol=1e-11)
    assert np.array_equal(frame.regular_faces, held.triangles)


@pytest.mark.parametrize("name", PAPER)
def test_split_gamma_is_eq_19(face, name):
    sim = settled(face, name, 12)
    frame, laid = sim.step(), wrinkled_surface(sim)
    rest, now = laid.rest_normals, laid.folded
    active = np.logical_or.reduce([relief.active for relief in laid.reliefs])
    edges, _ = unique_edges(frame.regular_faces)
    edges = edges[active[edges].any(axis=1)]
    i, j = edges.T
    before, after = (rest[i] * rest[j]).sum(1), (now[i] * now[j]).sum(1)
    gamma = (before - after) / np.maximum(np.abs(before), 0.1)
    expected = np.zeros(frame.n_points)
    np.maximum.at(expected, i, gamma)
    np.maximum.at(expected, j, gamma)
    np.testing.assert_allclose(frame["split_gamma"], expected, rtol=0, atol=1e-12)


def test_rest_frames_are_the_mesh(face):
    sim = fw.Simulation(face)
    frame = sim.step()
    assert np.array_equal(frame.points, face.points)
    assert np.array_equal(frame.regular_faces, face.triangles)
    assert not frame["split_gamma"].any()
    for name in face.mesh.point_data:
        if name != "Normals":
            assert np.array_equal(frame[name], face.mesh.point_data[name])


@pytest.fixture(scope="module")
def labelled(face):
    """The built-in face with point data of all kinds."""
    mesh, x = face.mesh.copy(), face.points
    n = len(x)
    mesh.point_data["affine"] = x @ np.array([0.3, -1.0, 2.0]) + 5.0
    mesh.point_data["vectors"] = x[:, [1, 2, 0]] * 2.0 - 7.0
    mesh.point_data["single"] = x[:, 0].astype(np.float32)
    mesh.point_data["number"] = np.arange(n)
    mesh.point_data["small"] = np.arange(n, dtype=np.int16) * 3
    mesh.point_data["tiny"] = (np.arange(n) % 251).astype(np.uint8)
    mesh.point_data["flag"] = x[:, 0] > 0.0
    mesh.point_data["W"] = np.full(n, 7.0)
    mesh.cell_data["part"] = np.arange(mesh.n_cells)
    return dataclasses.replace(face, mesh=mesh)


def test_point_data_goes_through_refinement(labelled, fingerprint):
    before = fingerprint(labelled.mesh)
    sim = fw.Simulation(labelled)
    sim.express("surprise")
    frame = list(sim.run(25))[-1]
    rest, n0 = np.asarray(frame["rest"]), labelled.mesh.n_points
    assert frame.n_points > n0 + 500
    np.testing.assert_allclose(frame["affine"], rest @ np.array([0.3, -1.0, 2.0]) + 5.0, rtol=0, atol=1e-12 * 400)
    np.testing.assert_allclose(frame["vectors"], rest[:, [1, 2, 0]] * 2.0 - 7.0, rtol=0, atol=1e-12 * 400)
    assert frame["single"].dtype == np.float32
    np.testing.assert_allclose(frame["single"], rest[:, 0], rtol=0, atol=2e-5)
    for name in ("number", "small", "tiny", "flag"):
        assert np.asarray(frame[name]).dtype == np.asarray(labelled.mesh[name]).dtype
        assert np.array_equal(frame[name][:n0], labelled.mesh[name])
    # Labels are those of a vertex of the base triangle that the point lies in, the heaviest.
    corners, weights = sim.forest.corners, sim.forest.barycentric
    heaviest = weights[np.arange(len(weights)), np.argmax(weights, axis=1)]
    own = np.where(corners == np.asarray(frame["number"])[:, None], weights, 0.0).max(axis=1)
    np.testing.assert_allclose(own, heaviest, atol=1e-15)
    assert np.array_equal(frame["tiny"], np.asarray(frame["number"]) % 251)
    uv = np.einsum("nc,nck->nk", weights, np.asarray(labelled.mesh.active_texture_coordinates)[corners])
    np.testing.assert_allclose(frame.active_texture_coordinates, uv, atol=1e-12)
    colour = np.einsum("nc,nck->nk", weights, np.asarray(labelled.mesh["Colors"], dtype=float)[corners])
    assert frame["Colors"].dtype == np.uint8
    np.testing.assert_allclose(frame["Colors"], colour, atol=0.5 + 1e-9)
    # The simulation's own arrays win over the input's of the same name, and the input keeps its own.
    assert frame["W"].max() < 7.0
    assert fingerprint(labelled.mesh) == before


# --- refinement ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PAPER)
def test_triangle_counts_are_those_of_the_paper_roughly(face, played, name):
    counts = [frame.n_cells for frame in played(name).frames]
    assert counts[0] == 4517
    assert 5000 <= counts[-1] <= 9500
    assert max(counts) <= 9500


@pytest.mark.parametrize("name", PAPER)
def test_angles_stay_those_of_the_base_triangles_and_their_bisections(face, played, name):
    x, t = face.points, face.triangles
    worst = angles(x, t)
    for k in range(3):
        i, j, o = t[:, k], t[:, (k + 1) % 3], t[:, (k + 2) % 3]
        middle = 0.5 * (x[i] + x[j])
        for a, b in ((i, o), (o, j)):
            halves = np.stack([x[a], x[b], middle], axis=1).reshape(-1, 3)
            worst = np.minimum(worst, angles(halves, np.arange(len(halves)).reshape(-1, 3)))
    held = played(name).held
    refined = angles(held.sites.points, held.triangles)
    assert refined.min() >= worst.min() - 1e-9
    # And triangle by triangle: the base triangle that each lies in.
    centres = held.sites.points[held.triangles].mean(axis=1)
    forest = fw.geometry.refinement.RedGreenForest(t)
    assert len(forest.triangles) == len(t)
    nearest = cKDTree(x[t].mean(axis=1)).query(centres, k=12)[1]
    bound = worst[nearest].min(axis=1)
    assert (refined >= bound - 1e-9).all()


@pytest.mark.parametrize("name", PAPER)
def test_refinement_stays_in_the_regions_of_the_muscles(played, name):
    held, frame = played(name).held, played(name).top
    active = np.logical_or.reduce([held.fields[m]["region"] for m, rate in held.rates.items() if rate > 0.0])
    new = frame["level"] > 0
    distance = cKDTree(frame["rest"][active]).query(frame["rest"][new])[0]
    assert distance.max() < 16.0  # red triangles and their closure reach a base triangle or two beyond


@pytest.mark.parametrize("level", [1, 2, 3])
def test_the_level_cap_holds(face, level):
    sim = fw.Simulation(face, fw.Refinement(max_level=level))
    sim.express("frowning")
    frame = list(sim.run(30, ramp=0.3))[-1]
    assert frame["level"].max() <= level + 1  # the closure may bisect once more
    assert sim.forest.level.max() <= level
    if level == 3:
        assert sim.forest.level.max() >= 2


def test_a_stricter_threshold_needs_more_triangles(face):
    counts = []
    for gamma_c in (0.2, 0.05, 0.01):
        sim = fw.Simulation(face, fw.Refinement(gamma_c=gamma_c, samples=1.0))
        sim.express("frowning")
        counts.append(list(sim.run(30, ramp=0.3))[-1].n_cells)
    assert counts[0] < counts[1] < counts[2]


@pytest.mark.parametrize("name", PAPER)
def test_release_takes_all_triangles_back(face, played, name):
    last = played(name).released[-1]
    assert np.array_equal(last.regular_faces, face.triangles)
    assert last.n_points == face.mesh.n_points
    assert np.array_equal(last["rest"], face.points)
    assert not last["W"].any()
    assert not last["level"].any()
    np.testing.assert_allclose(last.points, face.points, rtol=0, atol=1e-6)
    for array in face.mesh.point_data:
        if array != "Normals":
            assert np.array_equal(last[array], face.mesh.point_data[array])


def test_coarsening_goes_on_while_other_muscles_pull(face):
    sim = fw.Simulation(face)
    sim.express("surprise")
    for _ in sim.run(40):
        pass
    sim.express("stretching_mouth")
    frame = list(sim.run(150, ramp=0.2))[-1]
    forehead = frame["rest"][:, 1] > face.landmarks["brow_l_mid"][1] + 10.0
    assert not frame["level"][forehead].any()


def test_meshes_settle(face, played):
    """Held contractions end at one mesh: triangles that are split are not taken back the frame after."""
    for name in PAPER:
        sim = fw.Simulation(face)
        sim.express(name)
        counts = [frame.n_cells for frame in sim.run(80, ramp=0.3)]
        assert len(set(counts[-10:])) == 1, name


def test_what_no_muscle_moves_has_its_triangles_at_once(face, played):
    """A shape that a recording reaches in one step is as finely split as one that is held; so are still patterns."""
    surprise = played("surprise").held.displacement / face.unit
    there = fw.Recorded.of_shapes([surprise], [[0.0], [1.0], [1.0]], times=[0.0, 1.0, 20.0], names=["surprise"])
    for motion, layers in (
        (there, [fw.MuscleWrinkles()]),
        (fw.Still(face, 1.0), [fw.PatternLayer.preset("forehead", face)]),
    ):
        sim = fw.Simulation(face, layers=layers, time_step=1.0, motion=motion)
        first, *_, last = (sim.step() for _ in range(8))
        assert first.n_cells == last.n_cells > 5000
        np.testing.assert_array_equal(first["level"], last["level"])


# --- frames over time ---------------------------------------------------------------------------


def test_frames_do_not_change_after_they_were_handed_out(face, fingerprint):
    sim = fw.Simulation(face)
    sim.express("fear")
    frames, marks = [], []
    for frame in sim.run(30):
        frames.append(frame)
        marks.append(fingerprint(frame))
    sim.relax()
    for _ in sim.run(30):
        pass
    assert [fingerprint(frame) for frame in frames] == marks
    assert len(set(marks)) == len(marks)


def test_writing_into_frames_does_not_disturb_the_simulation(face):
    ends = []
    for spoil in (False, True):
        sim = fw.Simulation(face)
        sim.express("frowning")
        for frame in sim.run(20):
            if spoil:
                end = frame.copy()
                frame.points[:] = -1.0
                for array in frame.point_data.values():
                    np.asarray(array)[...] = 0
        ends.append(end if spoil else frame)
    assert np.array_equal(ends[0].points, ends[1].points)
    for array in ends[0].point_data:
        assert np.array_equal(ends[0][array], ends[1][array])


def test_two_simulations_are_alike_to_the_last_bit(face, fingerprint):
    runs = []
    for _ in range(2):
        sim = fw.Simulation(face)
        sim.express("happiness")
        runs.append([fingerprint(frame) for frame in sim.run(25)])
    assert runs[0] == runs[1]


def test_reset_is_a_new_simulation(face, fingerprint):
    sim = fw.Simulation(face)
    sim.express("surprise")
    first = [fingerprint(frame) for frame in sim.run(20)]
    sim.reset()
    assert sim.time == 0.0
    assert np.array_equal(sim.step().points, face.points)
    sim.reset()
    sim.express("surprise")
    assert [fingerprint(frame) for frame in sim.run(20)] == first


def test_the_face_is_never_changed(face, fingerprint):
    before = fingerprint(face.mesh)
    landmarks = {name: point.copy() for name, point in face.landmarks.items()}
    sim = fw.Simulation(face)
    sim.express("anger")
    for _ in sim.run(15):
        pass
    assert fingerprint(face.mesh) == before
    assert all(np.array_equal(face.landmarks[name], point) for name, point in landmarks.items())


def test_simulations_of_one_face_do_not_meet(face):
    alone, one, two = (fw.Simulation(face) for _ in range(3))
    alone.express("frowning")
    one.express("frowning")
    two.express("surprise")
    for _ in range(15):
        a, b = alone.step(), one.step()
        two.step()
    assert np.array_equal(a.points, b.points)


# --- run, time, fields --------------------------------------------------------------------------


@pytest.mark.parametrize(("frames", "ramp"), [(20, 0.6), (10, 1.0), (10, 0.0), (1, 0.6), (7, 0.05)])
def test_runs_ramp_smoothly_and_hold(face, frames, ramp):
    sim = fw.Simulation(face)
    sim.contract({"mentalis_l": 0.8})
    index, seen = sim.muscles.index("mentalis_l"), []
    for _ in sim.run(frames, ramp):
        seen.append(sim.skin.rates[index])
    t = np.clip(np.arange(1, frames + 1) / max(ramp * frames, 1.0), 0.0, 1.0)
    np.testing.assert_allclose(seen, 0.8 * (3 * t**2 - 2 * t**3), atol=1e-15)
    assert seen[-1] == 0.8
    assert sim.time == pytest.approx(frames * 0.02)
    # The next run goes on from there.
    sim.contract({"mentalis_l": 0.2})
    again = [sim.skin.rates[index] for _ in sim.run(5, 1.0)]
    assert again[-1] == 0.2
    assert (np.diff([0.8, *again]) < 0.0).all()


def test_what_was_asked_for_outlives_a_run_that_is_left_early(face):
    sim = fw.Simulation(face)
    sim.contract({"mentalis_l": 0.8})
    for _ in sim.run(50):
        break
    for _ in sim.run(4, ramp=0.0):
        pass
    assert sim.skin.rates[sim.muscles.index("mentalis_l")] == 0.8


def test_express_takes_names_units_and_mixtures(face):
    sim = fw.Simulation(face)
    for what, intensity in (("fear", 0.5), ("AU12", 1.0), ({"AU12": 0.7, "corrugator_l": 0.2}, 0.5)):
        sim.express(what, intensity)
        sim.step()
        rates = {name: rate for name, rate in zip(sim.muscles, sim.skin.rates, strict=True) if rate}
        assert rates == pytest.approx(face.atlas.contractions(what, intensity))


def test_fields_of_a_muscle_that_does_nothing(face):
    sim = fw.Simulation(face)
    sim.express("frowning")
    frame = list(sim.run(10))[-1]
    fields = sim.fields("frontalis_major_l")
    assert set(fields) == {"lambda", "gamma", "epsilon", "W", "region"}
    assert all(len(values) == frame.n_points for values in fields.values())
    assert fields["region"].any()
    assert not fields["W"].any()
    with pytest.raises(UnknownNameError, match="Did you mean"):
        sim.fields("frontalis_mayor_l")


def test_fields_before_the_first_step(face):
    fields = fw.Simulation(face).fields("corrugator_l")
    assert fields["region"].any()
    assert not fields["W"].any()


def test_a_simulation_without_layers_is_bare_skin(face):
    sim = fw.Simulation(face, layers=[])
    sim.express("surprise")
    frame = list(sim.run(10))[-1]
    assert frame.n_cells == 4517
    np.testing.assert_allclose(frame.points, sim.skin.points + sim.skin.displacement, atol=1e-12)
    assert not frame["W"].any()
    assert (frame["muscle"] == -1).all()
    with pytest.raises(ParameterError, match="no layer of muscle wrinkles"):
        sim.fields("corrugator_l")


def test_errors(face):
    sim = fw.Simulation(face)
    with pytest.raises(UnknownNameError, match="Did you mean .*'corrugator_l'"):
        sim.contract({"corrugator": 0.5})
    with pytest.raises(UnknownNameError, match="Did you mean .*'surprise'"):
        sim.express("suprise")
    for rate in (-0.01, 1.01, float("nan"), "full"):
        with pytest.raises(ParameterError, match="the contraction rate of corrugator_l"):
            sim.contract({"corrugator_l": rate})
        with pytest.raises(ParameterError):
            sim.express({"AU4": rate})
        with pytest.raises(ParameterError, match="intensity"):
            sim.express("fear", rate)
    for frames in (0, -3, 2.5, float("nan"), float("inf")):
        with pytest.raises(ParameterError, match="frames"):
            next(sim.run(frames))
    with pytest.raises(ParameterError, match="ramp"):
        next(sim.run(3, ramp=1.5))
    # Nothing of it was taken up.
    assert np.array_equal(sim.step().points, face.points)


@pytest.mark.parametrize(
    "settings",
    [
        {"gamma_c": 0.0}, {"gamma_c": float("nan")}, {"max_level": -1}, {"max_level": 9}, {"samples": 0.5},
        {"hysteresis": 0.0}, {"hysteresis": 1.0},
    ],
)  # fmt: skip
def test_errors_of_refinement(settings):
    with pytest.raises(ParameterError, match=next(iter(settings))):
        fw.Refinement(**settings)


@pytest.mark.parametrize("layers", [[3], fw.MuscleWrinkles(), "wrinkles"])
def test_what_is_no_list_of_layers_is_refused(face, layers):
    with pytest.raises(ParameterError, match="layers must be a list of layers"):
        fw.Simulation(face, layers=layers)


def test_wrinkles_too_fine_for_the_level_cap_are_refused(face):
    fine = face.with_muscles({"corrugator_l": face.muscles["corrugator_l"].replaced(folds=None, count=60)})
    sim = fw.Simulation(fine, fw.Refinement(max_level=2))
    with pytest.raises(ParameterError, match="corrugator_l are too fine") as caught:
        sim.express("frowning")
    # The remedy in the message works.
    level = int(str(caught.value).rstrip(".").split("max_level=")[-1])
    assert 3 <= level <= 8
    fw.Simulation(fine, fw.Refinement(max_level=level)).express("frowning")
    sim.contract({"corrugator_r": 1.0})
    finest = face.with_muscles({"corrugator_l": face.muscles["corrugator_l"].replaced(folds=None, count=60_000)})
    with pytest.raises(ParameterError, match=r"Ask for fewer wrinkles\.$"):  # no level is enough
        fw.Simulation(finest).express("frowning")


class Raised:
    """A layer that lifts the whole skin."""

    def __init__(self, height):
        self.height = height

    def attach(self, face):
        self.n = 0

    def follow(self, change, created):
        self.n = (self.n if isinstance(change.kept, slice) else len(change.kept)) + len(created.points)

    def displacement(self, state):
        n = len(state.bare)
        assert n == self.n
        return Displacement(np.full(n, self.height), np.full(n, np.inf), np.zeros((n, 3)), np.zeros(n, bool))

    def fields(self):
        return {}


def test_heights_of_layers_add_up(face):
    alone, both = fw.Simulation(face), fw.Simulation(face, layers=[fw.MuscleWrinkles(), Raised(1.5)])
    for sim in (alone, both):
        sim.express("frowning")
    for one, two in zip(alone.run(20), both.run(20), strict=True):
        # Refinement sees the shape, and a lifted skin bends a little more: compare where both have the same vertices.
        n = face.mesh.n_points
        np.testing.assert_allclose(two["W"][:n], one["W"][:n] + 1.5, atol=1e-12)


def test_a_layer_given_to_two_simulations_serves_both(face):
    layer = fw.MuscleWrinkles()
    first, second = fw.Simulation(face, layers=[layer]), fw.Simulation(face, layers=[layer])
    first.express("surprise")
    second.express("closing_eye")
    one, two = list(zip(first.run(20), second.run(20), strict=True))[-1]
    assert np.abs(one["W"]).max() > 0.1
    assert np.abs(two["W"]).max() > 0.1
    assert one.n_cells != two.n_cells


def test_the_parts_of_the_time_do_not_overlap(face):
    sim = fw.Simulation(face)
    sim.express("surprise")
    before = sum(sim.seconds.values())
    begin = time.perf_counter()
    for _ in sim.run(40):
        pass
    assert sum(sim.seconds.values()) - before <= time.perf_counter() - begin


def test_regions_between_the_vertices_of_a_coarse_mesh_still_fold(face):
    coarse = face.mesh.decimate(0.92)  # not every share leaves a manifold around lids and lips
    coarse_face = fw.fit_face(coarse, face.landmarks, units="mm")
    sim = fw.Simulation(coarse_face, fw.Refinement(max_level=4))
    sim.express("frowning")
    *_, frame = sim.run(60)
    assert np.abs(frame["W"]).max() > 0.2


def test_input_of_another_kind_is_refused(face):
    sim = fw.Simulation(face, fw.Refinement(max_level=0))
    with pytest.raises(ParameterError, match=r"'surprise'.*are for express\(\)"):
        sim.contract("surprise")
    for frames in ("x", None, 1.5, 0, np.nan, 10**400):
        with pytest.raises(ParameterError, match="frames must"):
            next(sim.run(frames))
    for step in ("x", 0.0, np.nan, 1e300, 1e-300):
        with pytest.raises(ParameterError, match="time_step must"):
            fw.Simulation(face, time_step=step)
    for level in (1.5, "2", 10**400):
        with pytest.raises(ParameterError, match="max_level must"):
            fw.Refinement(max_level=level)


# --- gaze -----------------------------------------------------------------------------------------


def test_eyes_look_where_they_are_asked_to_until_asked_again(face):
    sim, target = fw.Simulation(face, layers=[]), np.array([-30.0, 60.0, 400.0])
    ahead = sim.step()
    for eye in face.eyes:
        np.testing.assert_allclose(ahead.field_data[f"gaze_{eye.side}"][0], eye.gaze, atol=1e-12)
    sim.look(at=target)
    sim.express("happiness")
    *_, frame = sim.run(10)
    for eye in face.eyes:
        way = target - eye.centre
        np.testing.assert_allclose(frame.field_data[f"gaze_{eye.side}"][0], way / np.linalg.norm(way), atol=1e-9)
    sim.express("AU63")
    assert sim.step().field_data["gaze_l"][0] @ face.frame.axes[1] > 0.5
    sim.look()
    sim.relax()
    *_, frame = sim.run(5)
    np.testing.assert_allclose(frame.field_data["gaze_r"][0], face.eyes[1].gaze, atol=1e-12)


def test_eyes_turn_no_farther_than_they_can(face):
    sim = fw.Simulation(face, layers=[])
    for what in ({"yaw": 41.0}, {"pitch": -50.0}, {"at": (0.0, 36.0, 100.0)}):
        with pytest.raises(ParameterError, match="degrees at most"):
            sim.look(**what)
    assert not sim._asked.any()
