"""The loop: contraction, time, layers, gaze.

what                    checked against
two simulations         each other, bit for bit; a reset simulation
held faces              frames whose layers are asked each time
2,000 frames            the memory of the first hundreds
faces and layers        their fingerprints before; simulations that share them
ramps                   the smoothstep of their share of the run
layers                  heights that add up; fields of one muscle; taken in the middle of a motion, those from its start
gaze                    the directions that were asked for
faces                   freed once nobody holds them
bad input               the errors that name what is wrong
"""

import dataclasses
import gc
import weakref

import numpy as np
import pytest
import pyvista as pv
from expressions import after, settled
from flat_layers import Flat

import facewrinkle as fw
from facewrinkle.errors import FaceWrinkleWarning, ParameterError, UnknownNameError
from facewrinkle.layers.base import Displacement
from facewrinkle.motion.base import Undriven


def test_reset_is_a_new_simulation(face, fingerprint):
    sim = fw.Simulation(face)
    sim.express("paper_surprise")
    first = [fingerprint(frame) for frame in sim.run(20)]
    sim.reset()
    assert sim.time == 0.0
    frame = sim.step()
    assert np.array_equal(frame.points, face.points)
    assert np.array_equal(frame.regular_faces, face.triangles)
    assert not frame["split_gamma"].any()
    sim.reset()
    sim.express("paper_surprise")
    assert [fingerprint(frame) for frame in sim.run(20)] == first


class Beating(Flat):
    """Heights that change with time."""

    def __init__(self, timeless):
        self.timeless, self.asked = timeless, 0

    def displacement(self, state):
        self.asked += 1
        return dataclasses.replace(super().displacement(state), height=np.full(len(state.bare), state.time))


@pytest.mark.parametrize(
    "folds", ["wave", *(pytest.param(each, marks=pytest.mark.slow) for each in ("paper", "printed"))]
)
def test_a_held_face_is_shown_again(face, fingerprint, folds):
    """The same bytes as from layers that are asked each time, in frames of their own; and so in what comes after."""
    given = fw.Simulation(face, folds=folds)
    kept, asked = (fw.Simulation(given.face, given.refinement, layers=given.layers) for _ in range(2))
    for layer in asked.layers:
        layer.timeless = False
    for name, frames in (("surprise", 65), (None, 5), ("frowning", 65)):  # it rests in the last of them
        for sim in (kept, asked):
            sim.express(name) if name else sim.look(yaw=20)
        for one, other in zip(kept.run(frames, ramp=0.2), asked.run(frames, ramp=0.2), strict=True):
            assert fingerprint(one) == fingerprint(other)
            for array in (one.points, *one.point_data.values()):  # whoever has a frame may write into it
                array[...] = 0
    aged = [type(layer)(age=0.8) if hasattr(layer, "age") else layer for layer in kept.layers]
    for sim in (kept, asked):
        sim.use_layers(aged)
    assert fingerprint(kept.step()) == fingerprint(asked.step())
    assert fingerprint(kept.settle()) == fingerprint(asked.settle())


@pytest.mark.parametrize(("timeless", "most"), [(False, 8), (True, 2)])
def test_only_layers_without_time_are_not_asked_again(face, timeless, most):
    sim = fw.Simulation(face, layers=[Beating(timeless)])
    frames = [sim.step() for _ in range(8)]
    assert 1 <= sim.layers[0].asked <= most
    assert (frames[-1]["W"][0] == frames[-2]["W"][0]) == timeless


def test_a_face_whose_skin_rests_still_turns(face):
    class Nodding(fw.Still):
        def step(self):
            self.pose = np.eye(4) + 0.1 if self.pose is None else self.pose + 0.1
            return self.points

    sim = fw.Simulation(face, layers=fw.fold_layers(face), motion=Nodding(face))
    poses = [sim.step().field_data["pose"] for _ in range(4)]
    assert not np.array_equal(poses[2], poses[3])


@pytest.mark.slow
def test_memory_does_not_grow_with_the_frames(face):
    resource, sim, random = pytest.importorskip("resource"), fw.Simulation(face), np.random.default_rng(0)
    peaks = []
    for number in range(2000):
        if number % 20 == 0:
            sim.express({unit: random.random() for unit in random.choice([*face.atlas.action_units], 3, False)})
            peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
        sim.step()
    assert peaks[-1] - peaks[20] < 20 * 2**10  # kB


@pytest.mark.parametrize(("frames", "ramp"), [(20, 0.6), (10, 1.0), (10, 0.0), (1, 0.6), (7, 0.05)])
def test_runs_ramp_smoothly_and_hold(face, frames, ramp):
    sim = fw.Simulation(face, layers=[])
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
    sim = fw.Simulation(face, layers=[])
    sim.contract({"mentalis_l": 0.8})
    for _ in sim.run(50):
        break
    for _ in sim.run(4, ramp=0.0):
        pass
    assert sim.skin.rates[sim.muscles.index("mentalis_l")] == 0.8


def test_express_takes_names_units_and_mixtures(face):
    sim = fw.Simulation(face, layers=[])
    for what, intensity in (("paper_fear", 0.5), ("AU12", 1.0), ({"AU12": 0.7, "corrugator_l": 0.2}, 0.5)):
        sim.express(what, intensity)
        sim.step()
        rates = {name: rate for name, rate in zip(sim.muscles, sim.skin.rates, strict=True) if rate}
        assert rates == pytest.approx(face.atlas.contractions(what, intensity))


def test_fields_of_a_muscle_that_does_nothing(face):
    sim = fw.Simulation(face, folds="paper")
    frame = after(sim, "frowning", 10)
    fields, before = sim.fields("frontalis_major_l"), fw.Simulation(face).fields("corrugator_l")
    assert set(fields) == {"lambda", "gamma", "epsilon", "W", "region"}
    assert all(len(values) == frame.n_points for values in fields.values())
    for own in (fields, before):  # the latter of a muscle that pulls, but not yet
        assert own["region"].any()
        assert not own["W"].any()
    with pytest.raises(UnknownNameError, match="Did you mean"):
        sim.fields("frontalis_mayor_l")


def test_a_simulation_without_layers_is_bare_skin(face):
    sim = fw.Simulation(face, layers=[])
    frame = after(sim, "paper_surprise", 10)
    assert frame.n_cells == 4517
    np.testing.assert_allclose(frame.points, sim.skin.points + sim.skin.displacement, atol=1e-12)
    assert not frame["W"].any()
    assert (frame["muscle"] == -1).all()
    with pytest.raises(ParameterError, match="no layer of this simulation knows the folds over"):
        sim.fields("corrugator_l")


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (lambda sim: sim.contract({"corrugator": 0.5}), UnknownNameError, "Did you mean .*'corrugator_l'"),
        (lambda sim: sim.contract({"AU12": 0.5}), UnknownNameError, r"unknown muscle 'AU12'.*are for express\(\)"),
        (lambda sim: sim.contract({"corrugator_l": 1.01}), ParameterError, "the contraction rate of corrugator_l"),
        (lambda sim: sim.contract("paper_surprise"), ParameterError, r"'paper_surprise'.*are for express\(\)"),
        (lambda sim: sim.express("suprise"), UnknownNameError, "Did you mean .*'surprise'"),
        (lambda sim: sim.express({"AU4": "full"}), ParameterError, "AU4"),
        (lambda sim: sim.express("paper_fear", np.nan), ParameterError, "intensity"),
        *((lambda sim, n=n: next(sim.run(n)), ParameterError, "frames must") for n in (0, 2.5, np.nan, "x", 10**400)),
        (lambda sim: next(sim.run(3, ramp=1.5)), ParameterError, "ramp"),
        (lambda sim: fw.Simulation(sim.face, layers=[3]), ParameterError, "layers must be a list of layers"),
        (lambda sim: fw.Simulation(sim.face, layers="wrinkles"), ParameterError, "layers must be a list of layers"),
        (lambda sim: fw.Simulation(sim.face, layers=Undecided()), ParameterError, "layers must be a list of layers"),
        *(
            (lambda sim, h=h: fw.Simulation(sim.face, time_step=h), ParameterError, "time_step must")
            for h in ("x", 0.0, -0.02, np.nan, 1e300, 1e-300)
        ),
        *(
            (lambda sim, n=n: fw.Refinement(max_level=n), ParameterError, "max_level must")
            for n in (1.5, "2", 10**400, -1, 9)
        ),
        *((lambda sim, g=g: fw.Refinement(gamma_c=g), ParameterError, "gamma_c") for g in (0.0, np.nan)),
    ],
)
def test_errors_change_nothing(face, call, error, says):
    sim = fw.Simulation(face, fw.Refinement(max_level=0), layers=[])
    with pytest.raises(error, match=says):
        call(sim)
    assert np.array_equal(sim.step().points, face.points)


class Raised(Flat):
    """A layer that lifts the whole skin by half a mm: more would fold the ears."""

    def displacement(self, state):
        return dataclasses.replace(super().displacement(state), height=np.full(len(state.bare), 0.5))


def test_heights_of_layers_add_up(face):
    alone, both = (
        fw.Simulation(face, layers=[fw.MuscleWrinkles(), fw.Creases(), *others]) for others in ([], [Raised()])
    )
    for sim in (alone, both):
        sim.express("frowning")
    for one, two in zip(alone.run(20), both.run(20), strict=True):
        # Refinement sees the shape, and a lifted skin bends a little more: compare where both have the same vertices.
        n = face.mesh.n_points
        np.testing.assert_allclose(two["W"][:n], one["W"][:n] + 0.5, atol=1e-12)


def test_eyes_look_where_they_are_asked_to_until_asked_again(face):
    sim, target = fw.Simulation(face, layers=[]), np.array([-30.0, 60.0, 400.0])
    ahead = sim.step()
    for eye in face.eyes:
        np.testing.assert_allclose(ahead.field_data[f"gaze_{eye.side}"][0], eye.gaze, atol=1e-12)
    sim.look(at=target)
    frame = after(sim, "happiness", 10)
    for eye in face.eyes:
        way = target - eye.centre
        np.testing.assert_allclose(frame.field_data[f"gaze_{eye.side}"][0], way / np.linalg.norm(way), atol=1e-9)
    sim.express("AU63")
    assert sim.step().field_data["gaze_l"][0] @ face.frame.axes[1] > 0.5
    sim.look()
    frame = after(sim, {}, 5)
    np.testing.assert_allclose(frame.field_data["gaze_r"][0], face.eyes[1].gaze, atol=1e-12)


def test_eyes_turn_no_farther_than_they_can(face):
    sim = fw.Simulation(face, layers=[])
    for what in ({"yaw": 41.0}, {"pitch": -50.0}, {"at": (0.0, 36.0, 100.0)}):
        with pytest.raises(ParameterError, match="degrees at most"):
            sim.look(**what)
    sim.step()
    assert not sim.skin.rates.any()


@pytest.mark.slow
@pytest.mark.parametrize("expression", ["happiness", "kiss"])
def test_settling_ends_where_many_steps_end(face, expression):
    straight, long = fw.Simulation(face), fw.Simulation(face)
    straight.express(expression)
    one, last = straight.settle(within=0.001), after(long, expression, 250)
    n = len(face.points)
    assert np.abs(one.points[:n] - last.points[:n]).max() < 0.05
    assert straight.time < 0.3 * long.time
    assert one["W"].min() == pytest.approx(last["W"].min(), rel=0.02)


def test_a_face_that_has_settled_has_the_same_triangles_whatever_came_before(face):
    fresh, moved = fw.Simulation(face), fw.Simulation(face)
    after(moved, "pain", 8)
    frames = []
    for sim in (fresh, moved):
        sim.express("disgust")
        frames.append(sim.settle(within=0.0001))  # skin that still moves may cross a threshold
    one, other = frames
    np.testing.assert_array_equal(one.regular_faces, other.regular_faces)
    np.testing.assert_array_equal(one["rest"], other["rest"])
    assert np.abs(one["W"] - other["W"]).max() < 0.01


def test_settling_of_skin_that_begins_at_rest_is_settling_after_a_reset(face):
    sim = fw.Simulation(face, layers=fw.fold_layers(face, "wave", age=0.8))

    def moment(expression, yaw, reset):
        reset()
        sim.look(yaw)
        return settled(sim, expression)

    asked = [({"AU4": 0.7, "AU12L": 0.5}, 5.0), ({"AU1": 1.0}, -10.0)]
    frames = [[moment(*a, reset) for a in asked] for reset in (sim.reset, sim.motion.reset)]
    for frame, again in zip(*frames, strict=True):
        assert np.array_equal(frame.regular_faces, again.regular_faces)
        assert np.array_equal(frame.points, again.points)
        assert all(np.array_equal(frame[name], again[name]) for name in frame.point_data)
        assert all(np.array_equal(frame.field_data[name], again.field_data[name]) for name in frame.field_data)


def test_a_pose_that_is_held_ends_at_the_triangles_of_a_face_that_settled(face):
    """Whatever came before, but for the numbers of the vertices; without coarsening these stay."""
    fresh = fw.Simulation(face)
    fresh.express("paper_surprise")
    fresh.settle(within=1e-4)
    held = fw.Simulation(face)
    after(held, "pain", 10)
    held.express("paper_surprise")
    list(held.run(72, ramp=0.2))
    ours, theirs = (sim.vertices.points[sim.forest.triangles] for sim in (held, fresh))
    np.testing.assert_array_equal(ours, theirs)
    smooth = fw.Simulation(face, fw.Refinement(coarsen=False))
    smooth.express("paper_surprise")
    counts = [frame.n_points for frame in smooth.run(50)]
    assert counts == sorted(counts)  # vertices keep their numbers


class Creeping(Undriven):
    """A sheet that moves by 0.008 mm in each step."""

    time_step = 0.02

    def __init__(self, face):
        self.points, self.steps = face.points_mm, 0

    def reset(self):
        self.steps = 0

    def step(self):
        self.steps += 1
        return self.points + 0.008 * self.steps * np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("units", ["mm", "cm", "m"])
def test_millimeters_of_rest_are_those_of_the_skin_in_any_unit(units):
    sheet = fw.surface(pv.Plane(i_resolution=3, j_resolution=3).triangulate(), units=units)
    still = fw.Simulation(sheet, layers=[], motion=Creeping(sheet)).settle(most=20)
    assert still.n_points == sheet.mesh.n_points
    with pytest.warns(fw.FaceWrinkleWarning, match="still moves after 20 steps"):
        fw.Simulation(sheet, layers=[], motion=Creeping(sheet)).settle(within=0.007, most=20)


def test_a_face_that_does_not_settle(face):
    sim = fw.Simulation(face)
    sim.express("happiness")
    with pytest.warns(fw.FaceWrinkleWarning, match="still moves after 3 steps. Allow more of them with most="):
        sim.settle(most=3)
    with pytest.raises(ParameterError, match="within must lie in"):
        sim.settle(within=0.0)


class Undecided(Flat):
    """A layer that asks for triangles only as long as it lacks them."""

    follows = 0

    def follow(self, change, created):
        self.follows += 1

    def displacement(self, state):
        n = len(state.bare)
        spacing = np.full(n, 0.5 if n == len(self.face.points) else np.inf)
        return Displacement(np.zeros(n), spacing, np.tile([1.0, 0.0, 0.0], (n, 1)), np.arange(n) < 50)


def test_settling_ends_although_triangles_come_and_go(face):
    sim = fw.Simulation(face, layers=[Undecided()])
    sim.settle()
    assert sim.layers[0].follows <= 2 * sim.refinement.max_level + 2  # one for all vertices, one that sorts them


def test_layers_taken_in_the_middle_of_a_motion_are_those_from_its_start(face):
    late, early = fw.Simulation(face, layers=[]), fw.Simulation(face)
    for sim in (late, early):
        after(sim, "frowning", 15)
    own = early.layers[:]
    late.use_layers(own)
    assert all(mine is not given for mine, given in zip(late.layers, own, strict=True))
    for _ in range(16):  # a level of triangles in every other step
        ours, theirs = late.step(), early.step()
    n = face.mesh.n_points
    assert ours.n_cells > face.mesh.n_cells  # triangles depend a little on the way there, and on them the net volume
    np.testing.assert_allclose(ours["W"][:n], theirs["W"][:n], rtol=2.0 / 512.0, atol=1e-3)
    np.testing.assert_allclose(ours.points[:n], theirs.points[:n], atol=np.abs(theirs["W"]).max() * 2.0 / 512.0)
    late.use_layers([])
    assert not late.step()["W"].any()


def test_frames_tell_the_age_of_the_lines_that_are_drawn_now(face):
    old = dataclasses.replace(face, age=0.8)
    sim = fw.Simulation(face, fw.Refinement(max_level=0), layers=[fw.WaveFolds()])
    assert sim.step().field_data["age"].tolist() == [0.0]
    sim.use_layers([fw.WaveFolds(age=1.0)])
    assert sim.step().field_data["age"].tolist() == [1.0]
    sim.use_layers([])
    assert "age" not in sim.step().field_data
    young_lines = fw.Simulation(old, fw.Refinement(max_level=0), layers=[fw.WaveFolds(age=0.0)])
    assert young_lines.step().field_data["age"].tolist() == [0.0]
    assert fw.Simulation(old, fw.Refinement(max_level=0)).step().field_data["age"].tolist() == [0.8]


@pytest.mark.parametrize("unit", [25.4, 1000.0])
def test_the_first_frame_has_the_points_that_were_given(face, unit):
    given = {name: point / unit for name, point in face.landmarks.items()}
    other = fw.Face.from_landmarks(fw.mesh.to_polydata(face.points / unit, face.triangles), given, unit)
    np.testing.assert_array_equal(fw.Simulation(other).step().points, other.points)


@pytest.mark.parametrize("drawn", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_faces_that_nobody_holds_are_freed(face, drawn):
    """Who goes through many faces, as a data set does, must not keep them all, nor their lines."""
    own = dataclasses.replace(face, age=0.4)
    sim = fw.Simulation(own)
    sim.express("paper_surprise")
    frame = sim.step()
    if drawn:
        fw.picture(frame, own, fw.plotting.Style((40, 40)))
    freed = weakref.ref(own)
    del own, sim, frame
    gc.collect()
    assert freed() is None


def test_a_run_lasts_seconds_or_frames(face):
    sim = fw.Simulation(face, layers=[], time_step=0.05)
    assert len(list(sim.run(seconds=0.2))) == 4
    assert sim.time == pytest.approx(0.2)
    assert len(list(sim.run())) == 40
    with pytest.raises(ParameterError, match="frames or seconds, not both; received 3 and 0.1"):
        next(sim.run(3, seconds=0.1))
    with pytest.raises(ParameterError, match="seconds must"):
        next(sim.run(seconds=-1.0))


def test_the_present_frame_is_the_last_one(face):
    sim = fw.Simulation(face)
    assert sim.frame == face.mesh
    sim.frame.points[:] = 0.0
    assert sim.frame == face.mesh
    sim.express("AU4")
    for frame in sim.run(3):
        assert sim.frame is frame
    assert sim.settle() is sim.frame
    sim.reset()
    assert sim.frame == face.mesh


def test_a_mesh_without_muscles_is_told_where_they_come_from():
    with pytest.warns(FaceWrinkleWarning, match=r"no muscles.*fit_face\(mesh\)"):
        sim = fw.Simulation(pv.Sphere())
    with pytest.raises(ParameterError, match=r"no muscles that could make .*fit_face\(mesh\)") as found:
        sim.express("happiness")
    assert "motion" not in str(found.value)
