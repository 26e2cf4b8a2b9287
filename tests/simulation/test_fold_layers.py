"""Muscles that were changed or added, in each of the three kinds of folds.

what                    checked against
changed muscles         as printed: an error that says how, and the change as it says; as waves: a warning
the paper's numbers     the lines of a muscle as printed: k0 multiplies heights, a start moves them away from the bone
added, taken away       the muscles that the simulation has

Layers of folds by name, and the motions that wave folds are found from.

layers    the kinds, by name; a surface without landmarks or muscles
head      its stored shapes and lines, against those that are found anew
faces     frames of layers that other faces have used, against those of new layers
shapes    groups by the names of a recording's shapes; motions without names, by direction; faces that lack muscles
"""

import dataclasses
from dataclasses import replace

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.anatomy.fitting import mean_face
from facewrinkle.animation.playback import Playback
from facewrinkle.errors import FaceWrinkleWarning, ParameterError, UnknownNameError
from facewrinkle.layers.wave_folds import GROUPS, FoldShapes, WaveFolds
from facewrinkle.layers.wave_folds.families import strength_of, tensors_of, window_of
from facewrinkle.layers.wave_folds.field import found_lines, lines_of
from facewrinkle.layers.wave_folds.stripes import Style
from facewrinkle.simulation.fold_layers import FOLDS, fold_layers, fold_shapes, relaxed_shapes, stored_folds

UNREFINED = fw.Refinement(max_level=0)


def changed(face, name="corrugator_l", **changes):
    return face.with_muscles({name: face.muscles[name].replaced(**changes)})


def heights(face, **options):
    sim = fw.Simulation(face, UNREFINED, **options)
    sim.contract({"corrugator_l": 1.0})
    *_, frame = sim.run(12)
    return np.asarray(frame["W"])


@pytest.fixture(scope="module")
def printed(face):
    return face.with_atlas(fw.anatomy.printed_atlas())


@pytest.fixture(scope="module")
def usual(printed):
    return heights(printed, folds="printed")


@pytest.mark.parametrize(("name", "value"), [("depth", 2.0), ("alpha", 0.5), ("count", 8), ("start", 0.4)])
def test_the_papers_numbers_are_seen_as_printed(printed, usual, name, value):
    """Each of k0, alpha, n_w and lambda_w, by the folds of the paper and no others."""
    other = heights(changed(printed, **{name: value}), folds="printed")
    muscle = printed.muscles["corrugator_l"]
    assert np.abs(other - usual).max() > 0.1 * np.abs(usual).max()
    if name == "depth":
        np.testing.assert_allclose(other, usual * value / muscle.wrinkles.depth, rtol=1e-12, atol=1e-15)
    if name == "start":
        assert not other[muscle.coordinates(printed.points)[0] < value].any()


def test_a_change_is_never_lost(face):
    """Muscles of the package's atlas are not those as printed: the error says which to change, and that works."""
    for changes in ({"depth": 4.0}, {"strength": 2.0}, {"folds": None, "count": 8}):
        mine = changed(face, **changes)
        assert mine.muscles["corrugator_l"].same_as(fw.Simulation(mine, folds="paper").face.muscles["corrugator_l"])
        with pytest.raises(ParameterError, match=r"corrugator_l was changed.*face\.with_atlas\(printed_atlas\(\)\)"):
            fw.Simulation(mine, folds="printed")
    there = changed(face.with_atlas(fw.anatomy.printed_atlas()), depth=4.0)
    assert fw.Simulation(there, folds="printed").face is there


def test_a_crease_becomes_deeper_in_the_other_kinds(face):
    deeper = changed(face, depth=2.0 * face.muscles["corrugator_l"].wrinkles.depth)
    found = {folds: (heights(face, folds=folds), heights(deeper, folds=folds)) for folds in ("wave", "paper")}
    furrow = found["paper"][0].argmin()  # waves beside it may be deeper
    for usual, deep in found.values():
        assert deep[furrow] < 1.5 * usual[furrow] < 0.0


@pytest.mark.slow
def test_waves_say_that_they_take_nothing_from_a_muscle(face):
    finer = changed(face, "frontalis_inner_l", count=7)
    with pytest.warns(FaceWrinkleWarning, match="frontalis_inner_l were changed, and its lines are drawn as waves"):
        fw.Simulation(finer)
    fw.Simulation(finer, folds="paper")  # no warning
    sim = fw.Simulation(changed(finer, "frontalis_inner_l", waves=False))
    sim.contract({"frontalis_inner_l": 1.0})
    sim.settle()
    assert np.abs(sim.fields("frontalis_inner_l")["W"]).max() > 0.1


@pytest.mark.parametrize("folds", FOLDS)
def test_added_muscles_stay_and_others_stay_away(face, folds):
    glabella, along = face.landmarks["glabella"], np.array([0.0, 14.0, 2.0])
    added = fw.LinearMuscle(glabella - along, glabella + along, max_angle=0.5, radius=40.0)
    muscles = {name: muscle for name, muscle in face.muscles.items() if not name.startswith("risorius")}
    sim = fw.Simulation(replace(face, muscles={**muscles, "procerus": added}), folds=folds)
    assert sim.face.muscles["procerus"] is added
    assert "risorius_l" not in sim.muscles
    assert "corrugator_l" in sim.muscles


def test_a_surface_keeps_its_own_muscles_as_printed(face):
    muscle = fw.LinearMuscle((0, 0, -5), (0, 20, 0), max_angle=0.5, radius=30.0)
    sim = fw.Simulation(fw.surface(face.mesh).with_muscles({"mine": muscle}), folds="printed")
    assert sim.muscles == ("mine",)
    assert isinstance(sim.layers[0], fw.PrintedWrinkles)


def test_the_kinds_of_folds(face):
    paper = fold_layers(face, "paper", depth=2.0)
    assert [(type(layer), layer.depth) for layer in paper] == [(fw.MuscleWrinkles, 2.0), (fw.Creases, 2.0)]
    formula, creases, waves = fold_layers(face, "wave", depth=2.0, seed=4)
    assert (formula.waves, creases.depth, waves.depth, waves.style.seed) == (False, 2.0, 2.0, 4)
    drawn = [
        muscle.fold_pattern for muscle in face.muscles.values() if np.isfinite(muscle.fold_pattern.half_wavelength)
    ]
    assert all(sum(layer.draws(pattern) for layer in paper) == 1 for pattern in drawn)
    assert all(formula.draws(pattern) + creases.draws(pattern) + pattern.wrinkles.waves == 1 for pattern in drawn)
    with pytest.raises(UnknownNameError, match=r"unknown kind of folds 'waves'. Did you mean 'wave'"):
        fw.Simulation(face, folds="waves")


def test_surfaces_without_landmarks_have_the_folds_of_their_muscles_or_none(face):
    cloth = fw.surface(face.mesh)
    assert fold_layers(cloth, "wave") == []
    plate = cloth.with_muscles({"muscle": fw.SheetMuscle([(-9, 9, 0), (9, 9, 0)], [(-9, -9, 0), (9, -9, 0)])})
    assert [type(layer) for layer in fold_layers(plate, "wave")] == [fw.MuscleWrinkles, fw.Creases]


def test_shapes_of_a_recording_are_grouped_by_their_names(face):
    pressed = [face.points * (squeeze - 1.0) for squeeze in np.array([[1, 0.8, 1], [0.8, 1, 1], [1, 0.9, 1]])]
    clip = fw.Recorded.of_shapes(pressed, [[0.0] * 3], fps=1, names=["browInnerUp", "browDown_L", "browOuterUpRight"])
    found = fold_shapes(face, Playback(clip, face)).families
    assert {name: len(shapes) for name, shapes in found.items()} == {"forehead": 2, "brows": 1}
    np.testing.assert_allclose(found["brows"][0], face.points * [0.8, 1.0, 1.0], atol=1e-9)


def test_motions_without_names_are_grouped_by_their_directions(face):
    squeezes = np.array([[1, 0.8, 1], [0.8, 1, 1], [1, 0.9, 1], [1, 1, 1]])
    clip = fw.Recorded.of_positions(face.points * squeezes[:, None], fps=10)
    found = FoldShapes.grouped(face, [face.points * squeeze for squeeze in squeezes]).families
    assert {name: len(shapes) for name, shapes in found.items()} == {"motion 1": 2, "motion 2": 1}
    front = face.tissue.normals[:, 2] > 0.98
    for name, axis in (("motion 1", 1), ("motion 2", 0)):
        tensor = tensors_of(face, FoldShapes(found))[name][front]
        assert (tensor[:, axis] > 0.9 * tensor[:, :3].sum(axis=1)).mean() > 0.95
    assert set(fold_shapes(face, Playback(clip, face)).families) == {"motion 1", "motion 2"}


def test_recordings_of_surfaces_without_anatomy_fold_them_when_asked(face):
    cloth = fw.surface(face.mesh)
    clip = fw.Recorded.of_positions(cloth.points * np.array([[[1, 1, 1]], [[1, 0.75, 1]]]), fps=2)
    assert fw.Simulation(cloth, motion=clip).layers == []
    *_, frame = fw.Simulation(cloth, fw.Refinement(max_level=1), layers=[WaveFolds()], motion=clip).run(30)
    assert np.ptp(frame["W"]) > 0.5


def test_action_units_whose_muscles_a_face_lacks_are_left_out(face):
    kept = {name: muscle for name, muscle in face.muscles.items() if not name.startswith("corrugator")}
    found = fold_shapes(lacking := dataclasses.replace(face, muscles=kept), fw.Skin(lacking)).families
    assert len(found["brows"]) == 0
    assert len(found["forehead"]) == 2
    assert window_of(strength_of(tensors_of(lacking, FoldShapes(found))["forehead"])).max() == 1.0


def test_every_face_has_the_lines_of_the_mean_head_unless_its_muscles_are_others(face, coarse):
    """So has one with expressions of its own; another atlas has those that it gives the mean head."""
    head = mean_face(face.atlas)
    for one in (face, coarse, fw.default_face({"width": 0.5}), dataclasses.replace(coarse, age=0.5)):
        assert shapes_of(one) is shapes_of(head)
    assert shapes_of(head).face is head
    other = dataclasses.replace(coarse, muscles=dict(list(coarse.muscles.items())[1:]))
    assert shapes_of(other).face is other
    mine = coarse.with_expressions({"mine": {"AU1": 1.0}})
    assert shapes_of(mine).lines.keys() == shapes_of(head).lines.keys()
    printed = coarse.with_atlas(fw.anatomy.printed_atlas())
    assert shapes_of(printed).face is mean_face(printed.atlas)
    assert fold_shapes(face, fw.Skin(face, material=fw.SkinMaterial(bending=10.0))) is shapes_of(face)


def test_the_stored_shapes_of_the_head_are_those_of_its_skin(face):
    (stored, _), simulated = stored_folds(face.atlas) or ({}, {}), relaxed_shapes(face)
    assert stored.keys() == simulated.keys(), (
        "the built-in head or its atlas is another one: run python -m tools.build_folds"
    )
    assert list(shapes_of(face).families) == list(GROUPS)
    for unit, shape in simulated.items():
        change = np.linalg.norm(stored[unit] - shape, axis=1).max()
        assert change < 0.1, (
            f"the stored shape of {unit} and others are not those of the skin any more, by {change:.2f} mm, which "
            "is more than skin at rest may be off: run python -m tools.build_folds"
        )


def test_stored_lines_are_those_that_are_found_from_the_stored_shapes(face):
    shapes = fold_shapes(face, fw.Skin(face))
    found = found_lines(face, shapes, 1.0, Style())
    assert list(shapes.lines) == list(found), "run python -m tools.build_folds"
    for name, array in found.items():
        stored = shapes.lines[name]
        assert stored.dtype.kind == array.dtype.kind
        if array.dtype.kind == "f":
            np.testing.assert_allclose(stored, array, rtol=1e-6, atol=1e-6, err_msg="run python -m tools.build_folds")
        else:
            np.testing.assert_array_equal(stored, array, err_msg="run python -m tools.build_folds")
    ours, *others = (
        lines_of(face, shapes, *which)["forehead"].phase
        for which in ((1.0, Style()), (1.0, Style(seed=1)), (1.1, Style()))
    )
    np.testing.assert_array_equal(ours, shapes.lines["phase 0"])
    assert not any(np.allclose(other[:5], ours[:5], atol=0.1) for other in others)


def test_carried_lines_run_on_over_the_edges_of_a_mesh(coarse):
    """Phases at the ends of an edge differ by what the wave there turns along it."""
    own = lines_of(coarse, shapes_of(coarse), 1.0, Style())["forehead"]
    ground = own.ground
    i, j = fw.geometry.unique_edges(ground.triangles)[0].T
    strong = np.minimum(own.share[i], own.share[j]) > 0.6
    i, j = i[strong], j[strong]
    sign = np.where((own.wave[i] * own.wave[j]).sum(axis=1) < 0.0, -1.0, 1.0)
    turn = 0.5 * (own.wave[i] + sign[:, None] * own.wave[j])
    turned = ((ground.points[j] - ground.points[i]) * turn).sum(axis=1)
    off = np.angle(np.exp(1j * (sign * own.phase[j] - own.phase[i] - turned)))
    assert len(off) > 300
    assert np.quantile(np.abs(off), 0.9) < 0.4


def shapes_of(face):
    return fold_shapes(face, fw.Skin(face))


@pytest.fixture(scope="module")
def coarse(face):
    """The built-in face with half its triangles."""
    return fw.fit_face(face.mesh.decimate(0.5), face.landmarks)


def frames_of(simulation, fingerprint):
    simulation.express("paper_surprise")
    return [fingerprint(frame) for frame in simulation.run(5)]


def test_layers_that_another_face_has_used_are_as_new(face, coarse, fingerprint):
    new = {one: frames_of(fw.Simulation(one), fingerprint) for one in (face, coarse)}
    for one, other in ((face, coarse), (coarse, face)):
        used = fw.Simulation(other)
        used.express("paper_fear")
        list(used.run(2))
        assert frames_of(fw.Simulation(one, layers=used.layers), fingerprint) == new[one]
        taking = fw.Simulation(one)
        taking.use_layers(used.layers)
        assert frames_of(taking, fingerprint) == new[one]


def test_shapes_are_found_anew_for_another_face_alone_and_those_that_were_set_stay(face, coarse):
    first = fw.Simulation(face)
    assert fw.Simulation(face, layers=first.layers).layers[-1].shapes is first.layers[-1].shapes
    other = fw.Simulation(coarse, layers=first.layers)
    assert other.layers[-1].shapes is first.layers[-1].shapes
    own, cloth = WaveFolds(), fw.surface(coarse.mesh)
    own.shapes = first.layers[-1].shapes
    with pytest.raises(ParameterError, match=r"given are of a face of 4517 triangles, and this one has \d+, or others"):
        fw.Simulation(cloth, layers=[own])
    other = fw.Simulation(cloth, layers=[])
    before = other.layers[:]
    with pytest.raises(ParameterError, match=r"Give a new WaveFolds\(\) to the simulation of each face"):
        other.use_layers([own])
    assert other.layers == before


def test_layers_that_are_refused_leave_the_present_ones(face, coarse):
    """Positions and amounts of another face are refused wherever layers come from; and what is no layer."""
    brow = np.abs(face.points - face.landmarks["glabella"]).max(axis=1, keepdims=True) < 15.0
    pressed = WaveFolds(families={"all": [np.where(brow, face.points * [1.0, 0.8, 1.0], face.points)]})
    factors = WaveFolds(amount=np.ones(len(face.points)))
    used, other = fw.Simulation(face, layers=[pressed, factors]), fw.Simulation(coarse)
    before = other.layers[:], other.refinement.max_level
    for layer, message in zip(
        [*used.layers, "wave"],
        ("a motion of the family 'all' must be", "amount must have one", "layers must be a list of layers"),
        strict=True,
    ):
        with pytest.raises(ParameterError, match=message):
            fw.Simulation(coarse, layers=[layer])
        with pytest.raises(ParameterError, match=message):
            other.use_layers([layer])
        assert (other.layers, other.refinement.max_level) == before
    other.express("paper_surprise")
    assert other.step().n_points >= len(coarse.points)


def test_lines_of_another_face_are_refused(face, coarse):
    shapes = fold_shapes(face, fw.Skin(face))
    layer = WaveFolds()
    layer.shapes = FoldShapes({"all": [coarse.points_mm]}, lines=shapes.lines)
    with pytest.raises(ParameterError, match=r"not of this face, which has \d+ vertices .* Give FoldShapes without"):
        fw.Simulation(coarse, layers=[layer])


def test_triangles_are_taken_from_the_same_face_alone(face, coarse):
    turned = face.mesh.copy()
    turned.regular_faces = np.roll(face.triangles, 1, axis=0)
    for other in (coarse, fw.surface(turned)):
        with pytest.raises(ParameterError, match="of the same face"):
            fw.Simulation(face, layers=[]).take_triangles(fw.Simulation(other, layers=[]))
