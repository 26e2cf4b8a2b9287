"""Ways to cry: every preset gives closed tears on the skin, on all faces, moving or recorded."""

import numpy as np
import pytest
import pyvista as pv
from small_meshes import assert_ball, signed_distances

import facewrinkle as fw
from facewrinkle.tears import PRESETS, Fall, Film, Flow, preset, surfaces
from facewrinkle.tears.presets import grouped

IN_SKIN = 0.02
"""How deep facets of a tear may be in the skin, mm, where they cut its creases: a ninth of the film."""


def assert_tear(mesh, skin, unit=1.0):
    assert_ball(mesh)
    assert signed_distances(mesh.points, skin).min() * unit >= -IN_SKIN


@pytest.mark.parametrize("name", PRESETS)
def test_on_the_built_in_face(face, name):
    tears = preset(name, face)
    assert len(tears) == len(PRESETS[name].runs)
    for t in (0.0, 1.3, 2.9):
        for mesh in surfaces(tears, t):
            assert_tear(mesh, face.mesh)
    assert PRESETS[name].expression in fw.EXPRESSIONS


@pytest.mark.parametrize(
    "make",
    [
        lambda face: fw.DrippingTear(face, "l", begin=0.5, hang=0.5, fall=Fall(depth=20.0, speed=100.0)),
        lambda face: fw.SheddingTear(face, start="l", begin=0.5),
    ],
)
def test_on_triangles_that_stay_it_shrinks_to_a_point_before_and_after(face, make):
    tear, times = make(face), [0.0, 0.6, 1.1, 99.0]
    sampled = tear.sampled(times, [face.mesh] * len(times))
    for k in (1, 2):
        np.testing.assert_array_equal(sampled.points[k], tear.surface(times[k], face.mesh).points)
    for k, of in ((0, 1), (3, 2)):
        np.testing.assert_allclose(
            sampled.points[k], np.tile(sampled.points[of].mean(axis=0), (len(sampled.points[k]), 1))
        )
    np.testing.assert_array_equal(sampled.triangles, tear.surface(times[1]).regular_faces)
    assert tear.sampled([0.0, 0.1], [face.mesh] * 2) is None


@pytest.mark.parametrize(
    "any_face",
    ["sockets", "shut", "ict_face_narrow", pytest.param("makehuman_head_male", marks=pytest.mark.slow)],
    indirect=True,
)
def test_weeping_from_lids_of_all_kinds(any_face):
    meshes = surfaces(preset("weeping", any_face), 3.0)
    assert len(meshes) >= 4
    for mesh in meshes:
        assert_tear(mesh, any_face.mesh, any_face.unit)


@pytest.mark.slow
def test_weeping_on_a_captured_clip(clip):
    """Tears on the wrinkled, refined frames of a face whose captured shapes are played: it smiles, blinks, frowns."""
    face, recorded = clip
    tears, step = preset("weeping", face), 0.08
    simulation, cells = fw.Simulation(face, motion=recorded, time_step=step), set()
    for i in range(48):
        frame = simulation.step()
        cells.add(frame.n_cells)
        if i % 6 == 5:
            for tear in surfaces(tears, i * step, frame):
                assert_tear(tear, frame, face.unit)
    assert len(cells) > 3


def test_another_seed_gives_other_tears(face, fingerprint):
    first, again, other = (surfaces(preset("one_tear", face, seed=seed), 1.0)[0] for seed in (0, 0, 1))
    assert fingerprint(first) == fingerprint(again) != fingerprint(other)


def test_a_later_tear_runs_into_the_first(face):
    first = fw.SheddingTear(face, start="l")
    assert fw.SheddingTear(face, start=first.path.points[40] + [1.0, 0.0, 0.0], seed=3).meets(first)
    assert not first.meets(fw.SheddingTear(face, start="r"))


def test_options_override_the_preset(face):
    slow, quick = (preset("shedding", face, c=c)[0] for c in (10.0, 40.0))
    assert quick.covered(0.5) - quick.covered(0.0) == pytest.approx(4.0 * (slow.covered(0.5) - slow.covered(0.0)))


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (lambda face: preset("weepin", face), fw.errors.UnknownNameError, "weeping"),
        (lambda face: preset("weeping", pv.Sphere()), fw.errors.ParameterError, "a preset needs a Face"),
        (lambda face: grouped({"roughness": 3.0}, film=Film), fw.errors.ParameterError, "roughness"),
    ],
)
def test_refuses(face, call, error, says):
    with pytest.raises(error, match=says):
        call(face)


def test_a_group_given_keeps_its_other_fields():
    given = {"flow": Flow(c=10.0, hold=5.0), "c": 20.0, "unknown": 1}
    assert grouped(given, film=Film, flow=Flow) == {"flow": Flow(c=20.0, hold=5.0), "unknown": 1}
    assert given["c"] == 20.0
