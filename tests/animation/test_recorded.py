"""Recorded motion.

what                       checked against
shapes                     the sum of weighted displacements, at and between the times
positions                  the recorded ones; straight lines between them
playing                    speed, loops and holds in closed form; every frame of a simulation at its time
bones                      two turns in closed form
a captured clip            the morph sum of the file, parsed here by hand, to 1e-9 mm, on a refined mesh
wrinkles on the clip       none in neutral frames; where the skin is compressed, and whether a head turns or not
other numberings           permuted, fewer and unknown points
bad input                  the errors that name what is wrong
values over time           lines, steps and cubics in closed form; SciPy's Hermite spline; the first and the last value
"""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
import pyvista as pv
from flat_layers import Flat
from glb_files import read_glb
from real_faces import FACES
from scipy.interpolate import CubicHermiteSpline
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from facewrinkle.animation.recorded import Bones, Recorded, Track
from facewrinkle.errors import FaceWrinkleWarning, ParameterError, UnknownNameError
from facewrinkle.layers.base import Displacement
from facewrinkle.layers.compression import StrainField, principal_compression

RNG = np.random.default_rng(11)


class Everywhere(Flat):
    """A layer without height that wants fine triangles everywhere."""

    def displacement(self, state):
        n = len(state.bare)
        return Displacement(np.zeros(n), np.full(n, 1e-6), np.tile([1.0, 0.0, 0.0], (n, 1)), np.ones(n, bool))


@pytest.fixture
def cloth():
    return fw.surface(pv.Plane(i_resolution=4, j_resolution=4), "cm")


@pytest.fixture
def shapes(cloth):
    return RNG.normal(scale=0.05, size=(3, len(cloth.points), 3))


# --- shapes and positions -----------------------------------------------------------------------


def test_shapes_add_up_in_a_simulation_in_mm_and_in_time(cloth, shapes):
    weights = RNG.uniform(-0.5, 1.5, (3, 3))
    recorded = Recorded.of_shapes(shapes, weights, fps=2.0, names=["a", "b", "c"])
    sim = fw.Simulation(cloth, motion=recorded, time_step=0.25)
    assert sim.time == 0.0
    for number in range(1, 7):
        frame = sim.step()
        w = [np.interp(0.25 * number, [0.0, 0.5, 1.0], column) for column in weights.T]
        assert recorded.weights(sim.time) == pytest.approx(dict(zip("abc", w, strict=True)))
        np.testing.assert_allclose(frame.points, cloth.points + np.einsum("k,knd->nd", w, shapes), atol=1e-14)
        assert sim.time == 0.25 * number
    np.testing.assert_allclose(sim.motion.step(), 10.0 * frame.points, atol=1e-13)
    sim.reset()
    halfway = cloth.points + np.einsum("k,knd->nd", 0.5 * (weights[0] + weights[1]), shapes)
    np.testing.assert_allclose(sim.step().points, halfway, atol=1e-14)


def test_weights_of_zero_leave_the_rest_as_it_is(cloth, shapes):
    recorded = Recorded.of_shapes(shapes, np.zeros((2, 3)), times=[0.0, 1.0])
    assert recorded.names == ("shape_0", "shape_1", "shape_2")
    sim = fw.Simulation(cloth, motion=recorded)
    assert np.array_equal(sim.motion.step(), cloth.points_mm)
    assert np.array_equal(sim.step().points, cloth.points)


def test_positions_are_played_as_they_are(cloth):
    positions = cloth.points + RNG.normal(scale=0.05, size=(4, len(cloth.points), 3))
    recorded = Recorded.of_positions(positions, times=[1.0, 1.1, 1.5, 2.0])
    assert recorded.duration == 1.0
    sim = fw.Simulation(cloth, motion=recorded, time_step=0.5)
    for expected in positions[[2, 3, 3]]:  # the recording begins at 1 s
        np.testing.assert_allclose(sim.step().points, expected, rtol=0, atol=1e-15)
    np.testing.assert_allclose(
        recorded.positions_at(recorded.recorded_time(0.05), cloth.points),
        0.5 * (positions[0] + positions[1]),
        atol=1e-14,
    )
    with pytest.raises(ParameterError, match="no weights"):
        recorded.weights(0.0)


def test_speed_and_loops(cloth):
    rise = np.zeros((1, len(cloth.points), 3))
    rise[..., 2] = 1.0
    recorded = Recorded.of_shapes(rise, [[0.0], [1.0]], times=[2.0, 4.0])

    def height(recording, time):
        return recording.weights(time)["shape_0"]

    for time in np.linspace(0.0, 9.0, 37):
        assert height(recorded, time) == pytest.approx(min(time / 2.0, 1.0))
        assert height(recorded.played(speed=4.0), time) == pytest.approx(min(time * 2.0, 1.0))
    looped = recorded.played(speed=0.5, loop=True)
    for time in np.linspace(0.1, 19.9, 43):
        assert height(looped, time) == pytest.approx((time / 4.0) % 1.0)
    assert height(looped, 4.0) == 1.0
    assert recorded.played(speed=4.0).duration == 0.5
    assert recorded.played(speed=2.0).played(loop=True).speed == 2.0
    assert not recorded.loop
    one = Recorded.of_shapes(rise, [[0.3]], fps=25.0).played(loop=True)
    assert (one.duration, height(one, 5.0)) == (0.0, 0.3)
    for speed in (0.0, -1.0, np.nan, "x"):
        with pytest.raises(ParameterError, match="speed"):
            recorded.played(speed=speed)


def test_a_pose_moves_everything_and_compresses_nothing(face):
    turn = Rotation.from_rotvec([0.3, -0.8, 0.2])

    def pose(time):
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = (turn * Rotation.from_rotvec([0.0, time, 0.0])).as_matrix(), [5.0, -9.0, 2.0]
        return matrix

    recorded = Recorded.of_shapes(np.zeros((1, len(face.points), 3)), [[0.0], [0.0]], times=[0.0, 1.0], pose=pose)
    sim = fw.Simulation(face, motion=recorded, time_step=0.2, folds="paper")
    for frame in sim.run(6):
        at = pose(min(sim.time, 1.0))
        np.testing.assert_allclose(frame.points, face.points @ at[:3, :3].T + at[:3, 3], atol=1e-10)
        assert np.abs(frame["W"]).max() < 1e-9
        assert np.abs(frame["epsilon"]).max() < 1e-9
        assert frame.n_cells == face.mesh.n_cells


# --- the captured clip ----------------------------------------------------------------------


def parsed(path):
    """Points, displacements, names, times and weights of a GLB, read by its byte offsets alone."""
    content, blob = read_glb(path)

    def array(index, width):
        accessor = content["accessors"][index]
        view = content["bufferViews"][accessor["bufferView"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        flat = np.frombuffer(blob, "<f4", accessor["count"] * width, start)
        return flat.reshape(-1, width).astype(np.float64)

    mesh = content["meshes"][0]
    sampler = content["animations"][0]["samplers"][0]
    names = mesh["extras"]["targetNames"]
    return SimpleNamespace(
        points=array(mesh["primitives"][0]["attributes"]["POSITION"], 3),
        deltas=np.array([array(target["POSITION"], 3) for target in mesh["primitives"][0]["targets"]]),
        names=names,
        times=array(sampler["input"], 1)[:, 0],
        weights=array(sampler["output"], 1).reshape(-1, len(names)),
    )


@pytest.fixture(scope="module")
def clip(clip):
    """The captured clip, with its file as it was read here."""
    face, recorded = clip
    path = FACES / "ict_face_narrow_anim.glb"
    return SimpleNamespace(path=path, recorded=recorded, face=face, truth=parsed(path))


def test_the_clip_is_what_the_file_holds(clip):
    truth = clip.truth
    assert list(clip.recorded.names) == truth.names
    assert np.array_equal(clip.recorded.rest, truth.points)
    assert np.array_equal(clip.recorded.deltas, truth.deltas)
    assert np.array_equal(clip.recorded.track.times, truth.times)
    assert np.array_equal(clip.recorded.track.values, truth.weights)
    assert clip.recorded.duration == 4.0


def test_refined_frames_are_the_morph_sum_at_every_key_time(clip):
    truth, face = clip.truth, clip.face
    sim = fw.Simulation(face, fw.Refinement(max_level=1), layers=[Everywhere()], time_step=0.25, motion=clip.recorded)
    assert np.array_equal(truth.times, 0.25 * np.arange(17))
    for w in truth.weights[1:]:
        frame = sim.step()
        expected = truth.points + np.einsum("k,knd->nd", w, truth.deltas)
        bare = np.einsum("nc,nck->nk", sim.forest.barycentric, expected[face.source_points][sim.forest.corners])
        np.testing.assert_allclose(frame.points * face.unit, bare * face.unit, rtol=0, atol=1e-9)
    assert frame.n_cells == 4 * face.mesh.n_cells


@pytest.fixture(scope="module")
def wrinkled(clip):
    """Frames of the clip at eleven moments and the activation of the muscles at each."""
    sim = fw.Simulation(clip.face, motion=clip.recorded, time_step=0.125, folds="paper")
    out = {0.0: (fw.Simulation(clip.face, motion=clip.recorded, time_step=4.0, folds="paper").step(), {})}
    for frame in sim.run(32):
        rates = np.max([layer.rates for layer in sim.layers], axis=0)
        out[sim.time] = frame, dict(zip(sim.muscles, rates, strict=True))
    return out


def test_neutral_frames_have_no_wrinkles(clip, wrinkled):
    neutral = [t for t in wrinkled if not any(clip.recorded.weights(t).values())]
    assert 4.0 in neutral
    for time in neutral:
        frame, _ = wrinkled[time]
        assert not frame["W"].any()
        base = np.asarray(frame.points)[: clip.face.mesh.n_points]
        np.testing.assert_allclose(base, clip.face.points, rtol=1e-15)


@pytest.mark.parametrize(
    "time, landmark, radius, quiet",
    [
        (0.75, "eye_l_outer", 25.0, "glabella"),
        (0.75, "mouth_l", 30.0, "forehead_mid"),
        (1.75, "forehead_mid", 45.0, "eye_l_outer"),
        (2.5, "glabella", 25.0, "menton"),
    ],
)
def test_wrinkles_come_where_the_expression_compresses_the_skin(clip, wrinkled, time, landmark, radius, quiet):
    frame, _ = wrinkled[time]
    rest, unit = np.asarray(frame["rest"]) * clip.face.unit, clip.face.unit
    near = np.linalg.norm(rest - clip.face.landmarks[landmark] * unit, axis=1) < radius
    away = np.linalg.norm(rest - clip.face.landmarks[quiet] * unit, axis=1) < 15.0
    relief, elsewhere = np.ptp(frame["W"][near]), np.ptp(frame["W"][away])
    assert relief > 1.0
    assert elsewhere < 0.15 * relief
    # Folded skin is compressed in some direction, as the captured shapes alone tell.
    weights = np.array([np.interp(time, clip.truth.times, column) for column in clip.truth.weights.T])
    moved = clip.face.points + np.einsum("k,knd->nd", weights, clip.truth.deltas)[clip.face.source_points]
    field = StrainField(clip.face.points, clip.face.triangles)
    normals = fw.geometry.vertex_normals(clip.face.points, clip.face.triangles)
    most, _ = principal_compression(field.strain(moved), field.metric, normals)
    folded = np.abs(frame["W"])[: len(most)] > 0.1
    assert folded.sum() > 50
    # A crease is folded by the skin of its whole width.
    crease = np.array([isinstance(muscle.fold_pattern, fw.Crease) for muscle in clip.face.muscles.values()])
    creased = crease[np.asarray(frame["muscle"])[: len(most)]]
    assert most[folded & ~creased].min() > 0.0
    assert most[folded].mean() > 0.05
    assert frame.n_cells > clip.face.mesh.n_cells + 1000


def test_muscles_wake_and_sleep_with_the_compression_over_them(wrinkled):
    def awake(time):
        return {name.removesuffix("_l") for name, rate in wrinkled[time][1].items() if rate > 0.5 and name[-2:] != "_r"}

    assert {"orbicularis_oculi", "zygomaticus_major"} <= awake(0.75)
    assert not awake(0.75) & {"frontalis_inner", "corrugator", "orbicularis_oris"}
    assert {"frontalis_inner", "frontalis_major"} <= awake(1.75)
    assert not awake(1.75) & {"corrugator", "orbicularis_oculi", "zygomaticus_major"}
    assert "corrugator" in awake(2.5)
    assert "orbicularis_oris" in awake(3.5)
    assert all(0.0 <= rate <= 1.0 for _, rates in wrinkled.values() for rate in rates.values())


def test_a_turning_head_wrinkles_as_a_still_one(clip, wrinkled):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = Rotation.from_rotvec([0.5, 1.9, -0.4]).as_matrix(), [30.0, 2.0, -8.0]
    turned = dataclasses.replace(clip.recorded, pose=lambda time: matrix)
    *_, frame = fw.Simulation(clip.face, motion=turned, time_step=0.125, folds="paper").run(6)
    still, _ = wrinkled[0.75]
    assert frame.n_points == still.n_points
    np.testing.assert_allclose(frame["W"], still["W"], atol=1e-7)
    moved = np.asarray(still.points) @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose(frame.points, moved, atol=1e-7)


@pytest.mark.slow
def test_the_clip_reads_as_action_units(clip):
    assert clip.recorded.action_units(0.0) == {}
    smile = clip.recorded.action_units(0.75)
    assert smile == pytest.approx({"AU12": 1.0, "AU6": 1.0})
    assert clip.recorded.action_units(1.25) == pytest.approx({"AU12": 1 / 3, "AU6": 1 / 3, "AU45": 1.0}, abs=1e-3)
    fw.Simulation(clip.face).express(smile)  # what one asks of the muscles


def test_units_without_muscles_are_told_and_left_out(face):
    names = ["jawOpen", "jawForward", "jawLeft", "cheekPuff"]
    recorded = Recorded.of_shapes(np.zeros((4, 5, 3)), [[0.4, 0.0, 0.0, 0.0], [0.6, 0.5, 0.0, 0.0]], fps=1, names=names)
    assert recorded.action_units(0.0, atlas=face.atlas) == {"AU27": 0.4}  # nothing else acts: no warning
    assert recorded.action_units(1.0) == {"AU27": 0.6, "AU29": 0.5}
    simulation = fw.Simulation(face)
    with pytest.raises(UnknownNameError, match="AU29"):
        simulation.express(recorded.action_units(1.0))
    with pytest.warns(FaceWrinkleWarning, match=r"shapes without muscles, which are left out: AU29, AU30, AU34\."):
        simulation.express(recorded.action_units(1.0, atlas=face.atlas))


def test_shapes_of_looking_turn_the_eyes(face):
    looks = {"eyeLookOutLeft": 0.5, "eyeLookInRight": 0.25, "eyeLookUp_R": 0.25, "jawOpen": 1.0}
    still = np.zeros((len(looks), len(face.points), 3))
    recorded = Recorded.of_shapes(still, [[0.0] * 4, list(looks.values())], times=[0.0, 0.1], names=list(looks))
    *_, frame = fw.Simulation(face, fw.Refinement(max_level=0), layers=[], motion=recorded).run(5)
    rates = {"rectus_lateralis_l": 0.5, "rectus_medialis_r": 0.25, "rectus_superior_r": 0.25}
    for side, gaze in face.gazes(rates).items():
        np.testing.assert_allclose(frame.field_data[f"gaze_{side}"][0], gaze, atol=1e-12)
        assert gaze[0] > 0.1  # to the subject's left
    assert frame.field_data["gaze_r"][0, 1] > frame.field_data["gaze_l"][0, 1] + 0.1
    silent = Recorded.of_shapes(still[:1], [[1.0]], fps=1, names=["jawOpen"])
    assert "gaze_l" not in fw.Simulation(face, fw.Refinement(max_level=0), layers=[], motion=silent).step().field_data


# --- other numberings ---------------------------------------------------------------------------


def test_bones_carry_the_head_and_its_pose_is_told(face):
    jaw = face.points[:, 1] < face.landmarks["lower_lip_mid"][1]
    weights = csr_array(np.stack([~jaw, jaw], axis=1).astype(float))
    turns = Rotation.from_rotvec([[0.0, 0.4, 0.0], [0.25, 0.0, 0.0]]).as_matrix()

    def matrices(time):
        out = np.tile(np.eye(4), (2, 1, 1))
        if time > 0.0:
            out[0, :3, :3], out[1, :3, :3] = turns[0], turns[0] @ turns[1]
        return out

    still = Track(np.array([0.0, 1.0]), np.zeros((2, 0)))
    bones = Bones(weights, matrices, matrices(0.0))
    recorded = Recorded(still, (), np.zeros((0, len(face.points), 3)), face.points, bones=bones)
    frame = fw.Simulation(face, fw.Refinement(max_level=0), layers=[], motion=recorded, time_step=1.0).step()
    expected = np.where(jaw[:, None], face.points @ turns[1].T, face.points) @ turns[0].T
    np.testing.assert_allclose(frame.points, expected, atol=1e-9)
    np.testing.assert_allclose(frame.field_data["pose"][:3, :3], turns[0], atol=1e-3)  # most of it is no jaw


def test_points_are_recognized_by_number_and_by_place(cloth, shapes):
    order = RNG.permutation(len(cloth.points))
    weights = [[0.2, 0.5, 0.1]]
    expected = cloth.points + np.einsum("k,knd->nd", weights[0], shapes)
    plain = Recorded.of_shapes(shapes, weights, fps=1.0)
    shuffled = Recorded.of_shapes(shapes[:, order], weights, fps=1.0, rest=cloth.points[order])
    longer = np.vstack([cloth.points, cloth.points + 50.0])
    more = Recorded.of_shapes(np.concatenate([shapes, shapes], axis=1), weights, fps=1.0, rest=longer)
    for recorded in (plain, shuffled, more):
        np.testing.assert_allclose(fw.Simulation(cloth, motion=recorded).step().points, expected, atol=1e-14)
    # A part of a larger mesh knows the numbers that its points have there.
    whole = pv.merge([pv.Plane(i_resolution=4, j_resolution=4), pv.Plane(center=(9, 0, 0), i_size=0.1, j_size=0.1)])
    with pytest.warns(fw.FaceWrinkleWarning, match="separate parts"):
        part = fw.surface(whole)
    moved = RNG.normal(size=(1, whole.n_points, 3))
    frame = fw.Simulation(part, motion=Recorded.of_shapes(moved, [[1.0]], fps=1.0)).step()
    np.testing.assert_allclose(frame.points, part.points + moved[0][part.source_points], atol=1e-12)


def test_recordings_of_other_meshes_are_refused(cloth, shapes):
    for recorded in (
        Recorded.of_shapes(shapes[:, :-1], np.eye(3), fps=1.0),
        Recorded.of_shapes(shapes, np.eye(3), fps=1.0, rest=cloth.points + 1.0),
        Recorded.of_shapes(shapes, np.eye(3), fps=1.0, rest=cloth.points * 1.01),
        Recorded.of_positions(np.zeros((2, 7, 3)), fps=1.0),
    ):
        with pytest.raises(ParameterError, match="not made on this face"):
            fw.Simulation(cloth, motion=recorded)


@pytest.mark.parametrize(
    "change, message",
    [
        ({"deltas": np.zeros((25, 3))}, r"shape \(shapes, points, 3\)"),
        ({"deltas": np.zeros((0, 25, 3))}, r"shape \(shapes, points, 3\)"),
        ({"deltas": np.full((3, 25, 3), np.nan)}, r"deltas must be finite; entry \[0, 0, 0\]"),
        ({"weights": np.zeros((2, 2))}, "each of the 3 shapes"),
        ({"weights": np.zeros(2)}, "each of the 3 shapes"),
        ({"weights": [[0.0, 1.0, np.inf]] * 2}, "must be finite"),
        ({"names": ["a", "b"]}, "3 shapes need as many different names"),
        ({"names": ["a", "b", "a"]}, "3 shapes need as many different names"),
        ({"fps": None}, "either times"),
        ({"times": [0.0, 1.0]}, "either times"),
        ({"fps": None, "times": [0.0, 1.0, 2.0]}, "3 times"),
        ({"fps": 0.0}, "fps must lie"),
        ({"fps": np.nan}, "fps must lie"),
        ({"rest": np.zeros((24, 3))}, "rest must hold the 25 points"),
    ],
)
def test_broken_shapes_are_refused(change, message):
    given = {"deltas": np.zeros((3, 25, 3)), "weights": np.zeros((2, 3)), "fps": 1.0} | change
    with pytest.raises(ParameterError, match=message):
        Recorded.of_shapes(given.pop("deltas"), given.pop("weights"), **given)


def test_broken_positions_are_refused():
    for positions in (np.zeros((25, 3)), np.zeros((0, 25, 3)), np.zeros((2, 25, 2))):
        with pytest.raises(ParameterError, match=r"shape \(frames, points, 3\)"):
            Recorded.of_positions(positions, fps=1.0)
    with pytest.raises(ParameterError, match="positions must be finite"):
        Recorded.of_positions(np.full((2, 25, 3), np.nan), fps=1.0)


# --- values over time -----------------------------------------------------------------------------


def test_tracks_go_through_their_values_and_hold_the_ends():
    times, values = np.array([0.5, 1.0, 3.0]), RNG.normal(size=(3, 4, 2))
    slopes = RNG.normal(size=(2, 3, 4, 2))
    for track in (Track(times, values), Track(times, values, "step"), Track(times, values, "cubic", slopes)):
        for time, value in zip(times, values, strict=True):
            assert np.array_equal(track.at(time), value)
        assert np.array_equal(track.at(-7.0), values[0])
        assert np.array_equal(track.at(9.0), values[-1])


def test_tracks_between_their_times():
    times, values = np.array([0.0, 2.0, 3.0]), RNG.normal(size=(3, 5))
    slopes = RNG.normal(size=(3, 5))
    spline = CubicHermiteSpline(times, values, slopes)
    cubic = Track(times, values, "cubic", np.stack([slopes, slopes]))
    linear, step = Track(times, values), Track(times, values, "step")
    for time in RNG.uniform(0.0, 3.0, 40):
        np.testing.assert_allclose(cubic.at(time), spline(time), atol=1e-12)
        expected = [np.interp(time, times, column) for column in values.T]
        np.testing.assert_allclose(linear.at(time), expected, atol=1e-12)
        assert np.array_equal(step.at(time), values[np.flatnonzero(times <= time)[-1]])


def test_slopes_before_and_after_a_time_may_differ():
    times, values = np.array([0.0, 1.0, 2.0]), np.zeros((3, 1))
    slopes = np.zeros((2, 3, 1))
    slopes[0, 1], slopes[1, 1] = 1.0, -5.0  # arrives rising, leaves falling
    track = Track(times, values, "cubic", slopes)
    # s^3 - s^2 of the arriving slope and s^3 - 2 s^2 + s of the leaving one, at one half.
    assert track.at(0.5) == pytest.approx([-0.125])
    assert track.at(1.5) == pytest.approx([-0.625])


def test_equal_neighbors_are_kept_to_the_last_bit():
    value = RNG.normal(size=7)
    track = Track(np.array([0.0, 0.3]), np.array([value, value]))
    assert all(np.array_equal(track.at(t), value) for t in RNG.uniform(0.0, 0.3, 50))


@pytest.mark.parametrize(
    "times, values, how, error, message",
    [
        ([0.0, 0.0], [1.0, 2.0], (), ParameterError, "increasing"),
        ([1.0, 0.0], [1.0, 2.0], (), ParameterError, "increasing"),
        ([], [], (), ParameterError, "increasing"),
        ([[0.0]], [[1.0]], (), ParameterError, "increasing"),
        ([0.0, 1.0], [1.0], (), ParameterError, "2 times"),
        ([0.0, np.nan], [1.0, 2.0], (), ParameterError, r"times must be finite; entry \[1\]"),
        ([0.0, 1.0], [[1.0, 2.0], [3.0, np.inf]], (), ParameterError, r"values must be finite; entry \[1, 1\]"),
        ([0.0, 1.0], [[1.0, 2.0], [3.0]], (), ParameterError, "rows of one length"),
        (["x"], [1.0], (), ParameterError, "times must be numbers"),
        ([0.0], [1.0], ("linaer",), UnknownNameError, "linear"),
        ([0.0, 1.0], [1.0, 2.0], ("cubic",), ParameterError, "slopes"),
        ([0.0, 1.0], [1.0, 2.0], ("cubic", np.zeros((2, 3))), ParameterError, "slopes"),
    ],
)
def test_broken_tracks_are_refused(times, values, how, error, message):
    with pytest.raises(error, match=message):
        Track(times, values, *how)


@pytest.mark.parametrize("kind", ["linear", "step", "cubic"])
@pytest.mark.parametrize("time", [-5.0, 0.999, 1.0, 7.0])
def test_a_track_of_one_key_has_its_value_at_all_times(kind, time):
    track = Track([1.0], [[2.0, 3.0]], kind, np.ones((2, 1, 2)) if kind == "cubic" else None)
    assert track.at(time).tolist() == [2.0, 3.0]
