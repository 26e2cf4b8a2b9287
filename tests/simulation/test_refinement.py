"""Refinement in the loop.

what                    checked against
split_gamma             Eq. 19 over all edges, in numpy
triangles               the paper's counts; the regions of the muscles
release                 M0, bit for bit; W exactly 0
wrinkled triangles      those of the bare surface below: they face the same side, on random frames of the head
what is too fine        the errors that name it, and their remedies
"""

from types import SimpleNamespace

import numpy as np
import pytest
from expressions import PAPER, after
from scipy.spatial import cKDTree
from small_meshes import area_vectors

import facewrinkle as fw
from analysis.surfaces import settled, wrinkled_surface
from facewrinkle.layers.base import SurfacePoints
from facewrinkle.simulation import loop
from facewrinkle.simulation.refinement import Refinement, mark


@pytest.mark.parametrize("name", PAPER)
def test_split_gamma_is_eq_19(face, name):
    sim = settled(face, name, 12)
    frame, laid = sim.step(), wrinkled_surface(sim)
    rest, now = laid.rest_normals, laid.folded
    active = np.logical_or.reduce([own.active for own in laid.displacements])
    edges, _ = fw.geometry.unique_edges(frame.regular_faces)
    edges = edges[active[edges].any(axis=1)]
    i, j = edges.T
    before, after = (rest[i] * rest[j]).sum(1), (now[i] * now[j]).sum(1)
    gamma = (before - after) / np.maximum(np.abs(before), 0.1)
    expected = np.zeros(frame.n_points)
    np.maximum.at(expected, i, gamma)
    np.maximum.at(expected, j, gamma)
    np.testing.assert_allclose(frame["split_gamma"], expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", PAPER)
def test_triangle_counts_are_those_of_the_paper_roughly(played, name):
    counts = [frame.n_cells for frame in played(name).frames]
    assert counts[0] == 4517
    assert 5000 <= counts[-1] <= 9500
    assert max(counts) <= 9500


@pytest.mark.parametrize("name", PAPER)
def test_refinement_stays_in_the_regions_of_the_muscles(played, name):
    held, frame = played(name).held, played(name).top
    active = np.logical_or.reduce([held.fields[m]["region"] for m, rate in held.rates.items() if rate > 0.0])
    distance = cKDTree(frame["rest"][active]).query(frame["rest"][frame["level"] > 0])[0]
    assert distance.max() < 16.0  # red triangles and their closure reach a base triangle or two beyond


@pytest.mark.parametrize("name", PAPER)
def test_release_takes_all_triangles_back(face, played, name):
    frames = played(name).released()
    last = frames[-1]
    assert not any(frame["W"].any() for frame in frames[-100:])
    assert np.array_equal(last.regular_faces, face.triangles)
    assert last.n_points == face.mesh.n_points
    assert np.array_equal(last["rest"], face.points)
    assert not last["level"].any()
    np.testing.assert_allclose(last.points, face.points, rtol=0, atol=1e-6)
    for array in face.mesh.point_data:
        if array != "Normals":
            assert np.array_equal(last[array], face.mesh.point_data[array])


def test_what_no_muscle_moves_has_its_triangles_at_once(face, played):
    """A shape that a recording reaches in one step is as finely split as one that is held; so are still patterns."""
    surprise = played("paper_surprise").held.displacement / face.unit
    there = fw.Recorded.of_shapes([surprise], [[0.0], [1.0], [1.0]], times=[0.0, 1.0, 20.0], names=["surprise"])
    for motion, layers in (
        (there, [fw.MuscleWrinkles()]),
        (fw.Still(face, 1.0), [fw.PatternLayer.preset("forehead", face)]),
    ):
        sim = fw.Simulation(face, layers=layers, time_step=1.0, motion=motion)
        first, *_, last = (sim.step() for _ in range(8))
        assert first.n_cells == last.n_cells > 5000
        np.testing.assert_array_equal(first["level"], last["level"])


def test_a_slow_recording_changes_triangles_in_every_other_frame_and_ends_where_a_fast_one_does(face, played):
    surprise = played("paper_surprise").held.displacement / face.unit
    ends = []
    for seconds in (0.02, 0.8):
        clip = fw.Recorded.of_shapes([surprise], [[0.0], [1.0]], times=[0.0, seconds], names=["surprise"])
        sim = fw.Simulation(face, motion=clip)
        frames = [sim.step() for _ in range(60)]
        counts = np.array([frame.n_cells for frame in frames])
        if seconds > 0.5:
            changed = np.diff(counts[8:40]) != 0
            assert changed.any()
            assert not (changed[1:] & changed[:-1]).any()
        assert len(set(counts[-8:])) == 1, "held, the mesh stays"
        ends.append(frames[-1])
    n = len(face.points)
    np.testing.assert_allclose(ends[1]["W"][:n], ends[0]["W"][:n], rtol=0, atol=0.01)


@pytest.mark.parametrize("share", [0.9, 0.91])  # not every share leaves a manifold around lids and lips
def test_regions_between_the_vertices_of_a_coarse_mesh_still_fold(face, share):
    coarse = face.mesh.decimate(share)
    with pytest.warns(fw.FaceWrinkleWarning, match="no opening"):  # too few triangles for lids and lips
        coarse_face = fw.fit_face(coarse, face.landmarks, units="mm")
    frame = after(fw.Simulation(coarse_face, fw.Refinement(max_level=4), folds="paper"), "frowning", 20)
    assert np.abs(frame["W"]).max() > 0.2


def test_wrinkles_too_fine_for_the_level_cap_are_refused(face):
    fine = face.with_muscles({"frontalis_inner_l": face.muscles["frontalis_inner_l"].replaced(count=60)})
    sim = fw.Simulation(fine, fw.Refinement(max_level=2), folds="paper")
    with pytest.raises(fw.errors.ParameterError, match="frontalis_inner_l are too fine") as caught:
        sim.express("paper_fear")
    # The remedy in the message works.
    level = int(str(caught.value).rstrip(".").split("max_level=")[-1])
    assert 3 <= level <= 8
    fw.Simulation(fine, fw.Refinement(max_level=level), folds="paper").express("paper_fear")
    sim.contract({"frontalis_inner_r": 1.0})
    finest = face.with_muscles({"frontalis_inner_l": face.muscles["frontalis_inner_l"].replaced(count=60_000)})
    with pytest.raises(fw.errors.ParameterError, match=r"Ask for fewer wrinkles\.$"):  # no level is enough
        fw.Simulation(finest, folds="paper").express("paper_fear")


@pytest.mark.parametrize("name", ["anger", pytest.param("happiness", marks=pytest.mark.slow)])
def test_triangles_depend_on_the_base_mesh_alone(face, name):
    """Whatever they were before, and in whatever steps: those that are split are too coarse at their own corners."""
    fear, other = (settled(face, what, 30, layers=[]).skin.displacement / face.unit for what in ("paper_fear", name))
    ends = []
    for weights in ([[0.0, 0.0], [0.0, 1.0], [0.0, 1.0]], [[1.0, 0.0], [0.5, 1.0], [0.0, 1.0]]):
        clip = fw.Recorded.of_shapes([fear, other], weights, times=[0.0, 0.1, 0.3], names=["one", "other"])
        sim = fw.Simulation(face, motion=clip, layers=[fw.MuscleWrinkles(), fw.Creases()])
        counts = [sim.step().n_cells for _ in range(40)]
        assert len(set(counts[-8:])) == 1
        assert max(counts) > 5500
        ends.append(sim.vertices.points[sim.forest.triangles])
    np.testing.assert_array_equal(*ends)


def test_without_samples_the_papers_criterion_splits_alone():
    """Eq. 19 sees normals only: where it is satisfied, however coarse the mesh, nothing is split."""
    normals = np.tile([0.0, 0.0, 1.0], (9, 1))
    points, triangles = np.c_[np.mgrid[:3, :3].reshape(2, -1).T, np.zeros(9)].astype(float), None
    corner = np.array([0, 1, 3, 4])
    triangles = np.r_[np.c_[corner, corner + 3, corner + 4], np.c_[corner, corner + 4, corner + 1]].astype(np.int32)
    forest = fw.geometry.RedGreenForest(triangles, 2, 9)
    vertices = SurfacePoints.of_forest(forest, points, normals)
    needed = np.full(9, 0.5)
    layer = SimpleNamespace(spacing=needed, across=np.tile([1.0, 0.0, 0.0], (9, 1)), active=np.ones(9, bool))
    for samples, split_all in ((4.0, True), (0.0, False)):
        wanted, late, _ = mark(Refinement(gamma_c=0.03, samples=samples), forest, vertices, normals, [layer])
        assert wanted.all() == wanted.any() == late == split_all  # edges are eight times too long
    bent = normals.copy()
    bent[4] = [0.6, 0.0, 0.8]
    wanted, *_ = mark(Refinement(gamma_c=0.03, samples=0), forest, vertices, bent, [layer])
    np.testing.assert_array_equal(wanted, (triangles == 4).any(axis=1))
    assert not mark(Refinement(samples=0), forest, vertices, bent, [layer])[0].any()
    with pytest.raises(fw.errors.ParameterError, match="samples must lie in .1, 64..*0 for Eq. 19 alone"):
        Refinement(samples=0.5)


# --- triangles that wrinkles would turn over -------------------------------------------------------


def bare_surface(sim):
    """The refined surface (n, 3) as it is without wrinkles, mm."""
    base = sim.skin.points + sim.skin.displacement
    return fw.geometry.interpolated(base, sim.vertices.corners, sim.vertices.barycentric)


def turned(sim, frame):
    """Triangles that face away from where they face without wrinkles."""
    points = np.asarray(frame.points) * sim.face.unit
    before, after = (area_vectors(x, sim.forest.triangles) for x in (bare_surface(sim), points))
    return np.flatnonzero((before * after).sum(axis=1) <= 0.0)


def mixtures(sim, seed, frames):
    """Play another 3 to 20 muscles at random rates, in a jump, every five frames."""
    rng = np.random.default_rng(seed)
    for i in range(frames):
        if i % 5 == 0:
            names = rng.choice(sim.muscles, rng.integers(3, 21), replace=False)
            rates = rng.random(len(names))
            sim.contract(dict(zip(names.tolist(), np.minimum(rates + 0.5 * (seed % 3 == 2), 1.0), strict=True)))
        yield sim.step()


@pytest.mark.parametrize("seed", [11, 50, 7])
def test_wrinkles_turn_no_triangle_over(face, seed):
    """Two of these mixtures have turned triangles over at the corners of the mouth."""
    sim, largest = fw.Simulation(face), 0.0
    for frame in mixtures(sim, seed, 14):
        assert len(turned(sim, frame)) == 0
        largest = max(largest, np.abs(frame["W"]).max())
    assert largest > 0.3


@pytest.fixture
def deep(face):
    """Wrinkles thirty times as deep, in the hollows beside the nose."""
    sim = fw.Simulation(face, layers=[fw.MuscleWrinkles(depth=30.0, inextensible=False)])
    sim.contract({f"{name}_{side}": 1.0 for name in ("nasalis", "levator_labii_superioris") for side in "lr"})
    return sim


def test_nor_do_wrinkles_of_any_depth(deep, monkeypatch):
    for frame in deep.run(12):
        assert len(turned(deep, frame)) == 0
    monkeypatch.setattr(loop, "unfolded_shares", lambda *_: None)
    assert len(turned(deep, deep.step())) > 0


def test_heights_are_lowered_with_those_that_shade(face, monkeypatch):
    """Where nothing is left of a wrinkle, no shade of it is left either."""
    monkeypatch.setattr(loop, "unfolded_shares", lambda points, *_: np.zeros(len(points)))
    frames = []
    for layers in (None, []):
        sim = fw.Simulation(face, layers=layers)
        sim.express("paper_surprise")
        frames.append([sim.step() for _ in range(2)][-1])
    lowered, bare = frames
    assert not lowered["W"].any()
    np.testing.assert_allclose(lowered["Normals"][: bare.n_points], bare["Normals"], atol=1e-12)
