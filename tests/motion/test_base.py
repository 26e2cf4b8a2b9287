"""Motions that no muscle drives, and surfaces that are no faces.

what                         checked against
a still surface              itself, bit for bit, in its own unit
a motion of one's own        the points that it hands out; its time step; the states that layers see
pose, gazes, parts           the field data of frames
motions that do not fit      the errors that name what is wrong
measured compression         the scaling that the motion applies; computed once, and only when asked for
"""

import dataclasses
import types
from contextlib import nullcontext

import numpy as np
import pytest
import pyvista as pv
from expressions import after
from flat_layers import Flat

import facewrinkle as fw
from facewrinkle.errors import FaceWrinkleWarning, LandmarkError, MeshError, ParameterError, UnknownNameError
from facewrinkle.motion.base import Still, Undriven


class Squeezed(Undriven):
    """Squeezes the mesh along x, by a hundredth more at each step, and turns it."""

    def __init__(self, face, time_step=0.1):
        self.points, self.time_step, self.taken = face.points_mm, time_step, 0

    def reset(self):
        self.taken = 0

    def step(self):
        self.taken += 1
        return (self.points * [1.0 - 0.01 * self.taken, 1.0, 1.0])[:, [1, 2, 0]]


class Posed(Still):
    """Says how the head is posed, where the eyes look, and where a part is."""

    pose = np.diag([2.0, 1.0, 1.0, 1.0])
    gazes = types.MappingProxyType({"l": np.array([0.0, 0.6, 0.8])})
    parts = types.MappingProxyType({"hat": np.ones((2, 3))})


class Probe(Flat):
    """A layer that keeps the states that it sees, and what `ask` measures of them."""

    def __init__(self, ask=lambda state: None):
        self.ask, self.seen = ask, []

    def displacement(self, state):
        self.seen.append((state, self.ask(state)))
        return super().displacement(state)


@pytest.fixture
def cloth():
    return pv.Plane(i_size=4.0, j_size=3.0, i_resolution=8, j_resolution=6)


def test_any_surface_keeps_still(cloth, tmp_path):
    cloth.save(tmp_path / "cloth.vtp")
    for source, units in ((cloth, "mm"), (tmp_path / "cloth.vtp", "mm"), (fw.surface(cloth, "cm"), "cm")):
        with nullcontext() if isinstance(source, fw.Face) else pytest.warns(FaceWrinkleWarning, match="no muscles"):
            sim = fw.Simulation(source)
        assert isinstance(sim.motion, Still)
        assert sim.layers == []
        assert sim.muscles == ()
        assert sim.face.unit == {"mm": 1.0, "cm": 10.0}[units]
        for frame in [*sim.run(3), sim.step()]:
            assert np.array_equal(frame.points, sim.face.points)
            assert np.array_equal(frame.regular_faces, sim.face.triangles)
            assert not frame["W"].any()
        assert sim.time == pytest.approx(0.08)


def test_a_surface_has_no_anatomy_and_remembers_its_points():
    apart = pv.merge([pv.Plane(), pv.Plane(center=(9.0, 0.0, 0.0), i_size=3.0)])
    with pytest.warns(fw.FaceWrinkleWarning, match="separate parts"):
        face = fw.surface(apart, 2.5)
    assert (face.landmarks, face.muscles, face.eyes, face.joint_weights) == ({}, {}, [], {})
    assert np.array_equal(np.asarray(apart.points)[face.source_points], face.points)
    assert np.array_equal(face.frame.axes, np.eye(3))
    np.testing.assert_allclose(face.frame.origin, [9.0, 0.0, 0.0], atol=1e-6)
    with pytest.raises(UnknownNameError, match="unit"):
        fw.surface(pv.Plane(), "ell")
    for units in (0.0, -1.0, np.nan, None):
        with pytest.raises(ParameterError, match="units must"):
            fw.surface(pv.Plane(), units)
    with pytest.raises(MeshError, match="no file"):
        fw.Simulation("nowhere.obj")


def test_muscle_wrinkles_find_nothing_on_a_surface_without_muscles(cloth):
    assert not fw.Simulation(cloth, layers=[fw.MuscleWrinkles()]).step()["W"].any()


def test_a_motion_of_ones_own_moves_the_surface(cloth):
    face = fw.surface(cloth, "cm")
    sim = fw.Simulation(face, layers=[Probe()], motion=Squeezed(face))
    frames = list(sim.run(4))
    for number, frame in enumerate(frames, start=1):
        expected = (face.points * [1.0 - 0.01 * number, 1.0, 1.0])[:, [1, 2, 0]]
        np.testing.assert_allclose(frame.points, expected, atol=1e-14)
    states = [state for state, _ in sim.layers[0].seen]
    np.testing.assert_allclose([state.time for state in states], [0.1, 0.2, 0.3, 0.4])
    assert all(len(state.rates) == 0 for state in states)
    sim.reset()
    assert sim.time == 0.0
    assert np.array_equal(sim.step().points, frames[0].points)


def test_frames_tell_pose_gazes_and_parts_of_a_motion(cloth):
    face = fw.surface(cloth)
    told = fw.Simulation(face, motion=Posed(face)).step().field_data
    assert np.array_equal(told["pose"], Posed.pose)
    assert told["gaze_l"].tolist() == [[0.0, 0.6, 0.8]]
    assert np.array_equal(told["part_hat"], np.ones((2, 3)))
    assert set(fw.Simulation(face, motion=Still(face)).step().field_data.keys()) == {"muscles", "unit"}


def test_layers_measure_the_compression_of_a_state(cloth, monkeypatch):
    calls = []
    from facewrinkle.layers import compression

    strain = compression.StrainField.strain
    monkeypatch.setattr(compression.StrainField, "strain", lambda *a: calls.append(1) or strain(*a))
    face = fw.surface(cloth)
    layers = [
        Probe(),
        Probe(lambda m: m.compression(np.array([1.0, 0.0, 0.0]))),
        Probe(lambda m: m.principal_compression),
    ]
    sim = fw.Simulation(face, layers=layers, motion=Squeezed(face))
    for number in range(1, 4):
        sim.step()
        assert len(calls) == number
        (_, along_x), (_, (most, tangents)) = (layer.seen[-1] for layer in sim.layers[1:])
        np.testing.assert_allclose(along_x, 0.01 * number, atol=1e-12)
        np.testing.assert_allclose(most, 0.01 * number, atol=1e-12)
        np.testing.assert_allclose(np.abs(tangents), np.tile([1.0, 0.0, 0.0], (len(most), 1)), atol=1e-6)
    del calls[:]
    fw.Simulation(face, layers=[Probe()], motion=Squeezed(face)).step()
    assert calls == []


def test_the_skin_is_measured_where_the_mesh_is_refined(face):
    sim = fw.Simulation(
        face, layers=[fw.MuscleWrinkles(), Probe(lambda m: (m.principal_compression[0], m.vertices.points))]
    )
    frame = after(sim, "paper_surprise", 20)
    most, where = sim.layers[1].seen[-1][1]
    assert frame.n_points > face.mesh.n_points
    assert most.shape == (frame.n_points,)
    # Where muscles fold, the skin is compressed along them; no tangent is compressed more than the principal one.
    folded = np.asarray(frame["W"]) != 0.0
    assert (most[folded] >= np.asarray(frame["epsilon"])[folded] - 0.02).all()
    assert np.array_equal(where, frame["rest"])


def only(face, name):
    """A face that lacks all muscles but one."""
    return dataclasses.replace(face, muscles={name: face.muscles[name]})


HALF = types.SimpleNamespace(names=(), rates=np.empty(0), points=np.empty(0), time_step=0.02, reset=None, step=None)


@pytest.mark.parametrize(
    "make, said",
    [
        (lambda face, cloth: fw.Simulation(face, motion=Still(cloth)), "63 points, the face has 2321"),
        (lambda face, _: fw.Simulation(face, motion=Still(face), time_step=0.5), "0.5.*one of its own, 0.02"),
        (lambda face, _: fw.Simulation(face, motion=Still(face), material=fw.SkinMaterial()), "material"),
        (lambda face, _: Still(face, 0.0), "time_step"),
        (lambda face, _: fw.Simulation(face, motion=HALF), "given lacks pose, gazes, parts, mandible, .*Undriven"),
        (lambda face, _: fw.Simulation(face, motion=fw.Skin(only(face, "mentalis_l"))), "all 48 muscles"),
        (lambda face, _: fw.Simulation(face, motion=Still(face)).express("AU1"), "moved by a Still.*frontalis"),
        (lambda face, _: fw.Simulation(face, motion=Still(face)).skin, "no skin.*Still"),
        (lambda face, _: fw.Simulation(face, folds="printed", motion=Still(face)).step(), "Use MuscleWrinkles"),
    ],
)
def test_motions_that_do_not_fit_are_refused(face, cloth, make, said):
    with pytest.raises(ParameterError, match=said):
        make(face, fw.surface(cloth))


def test_muscles_pull_no_surface_without_landmarks(cloth):
    pulled = fw.surface(cloth).with_muscles({"pull": fw.LinearMuscle((0, 0, -1), (0, 1, 0), 0.5, 2.0)})
    with pytest.raises(LandmarkError, match="a Skin is held by bone.*fit_face"):
        fw.Skin(pulled)
    with pytest.raises(ParameterError, match="one with landmarks"):
        fw.Simulation(pulled).contract({"pull": 1.0})


def test_a_motion_may_have_the_time_step_that_is_asked_for_and_be_told_to_rest(face):
    sim = fw.Simulation(face, motion=Still(face, 0.5), time_step=0.5)
    sim.relax()
    assert sim.motion.time_step == 0.5


def test_a_skin_can_be_given(face):
    skin = fw.Skin(face, 0.01)
    sim, usual = fw.Simulation(face, motion=skin), fw.Simulation(face, time_step=0.01)
    assert sim.skin is skin
    for each in (sim, usual):
        each.express("AU4")
    for ours, theirs in zip(sim.run(5), usual.run(5), strict=True):
        assert np.array_equal(ours.points, theirs.points)


class Returning(Undriven):
    """A motion whose step returns what it was given."""

    time_step = 0.02

    def __init__(self, face, positions):
        self.points, self.positions = face.points_mm, positions

    def reset(self):
        pass

    def step(self):
        return self.positions


@pytest.mark.parametrize(
    "change, said",
    [
        (lambda x: x[:-1], r"must return positions of the shape \(2321, 3\), received \(2320, 3\)"),
        (lambda x: x[:, :2], r"received \(2321, 2\)"),
        (np.ravel, r"received \(6963,\)"),
        (
            lambda x: np.where(x == x.max(), np.nan, x),
            r"positions that step\(\) of a motion \(Returning\).*must be finite",
        ),
        (lambda x: np.where(x == x.max(), -np.inf, x), "must be finite"),
        (lambda x: x + 0j, "must be numbers in rows of one length"),
        (lambda x: None, "must be"),
    ],
)
def test_positions_of_another_kind_are_refused(face, change, said):
    """Loops in machine code would read beyond the end of arrays that are too short."""
    sim = fw.Simulation(face, layers=[], motion=Returning(face, change(face.points.copy())))
    with pytest.raises(ParameterError, match=said):
        sim.step()


@pytest.mark.parametrize("change", [np.asfortranarray, np.ndarray.tolist, lambda x: np.repeat(x, 2, axis=0)[::2]])
def test_positions_may_be_of_any_layout(face, change):
    sim = fw.Simulation(face, layers=[], motion=Returning(face, change(face.points + 1.0)))
    np.testing.assert_array_equal(sim.step().points, face.points + 1.0)
