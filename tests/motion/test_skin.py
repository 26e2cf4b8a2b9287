"""The mass-spring skin.

what                              checked against
gradient of a step's objective    differences: springs beyond their threshold, tethers, bending, contacts, inertia
springs, barrier, tethers         their energies written out for an edge, a triangle, a vertex
weights                           a membrane of stiffness 1: the energy of affine strains, whatever the triangles
rest                              itself: an exact equilibrium; held, skin that makes each step, and begins anew there
time steps of 0.1 ms to 10 s      each other's steady states
skull, eyeballs                   heights above the anchors; distances from the centres
left, right                       each other, mirrored
insertions                        they move towards the attachment
what skins of one face share      the same bytes as made anew
"""

import copy
import dataclasses

import numpy as np
import pytest
import pyvista as pv
from scipy.spatial import cKDTree
from skins import assert_gradient, held

import facewrinkle as fw
from facewrinkle.motion import _skin_kernels as kernels
from facewrinkle.motion.minimizer import Minimizer
from facewrinkle.motion.skin import Skin, SkinMaterial
from tools.trials.player import area_shares


@pytest.fixture(scope="module")
def coarse(face):
    """The built-in face with a third of its triangles."""
    mesh = pv.PolyData.from_regular_faces(face.points, face.triangles).decimate_pro(0.7)
    return fw.fit_face(mesh, face.landmarks, units="mm")


FREE = ("paper_surprise", "happiness", "closing_eye", "stretching_mouth", "frowning")
"""Expressions in which lips do not press on each other; where they do, they slide for long before they come to rest."""


@pytest.fixture(scope="module")
def steady(face):
    """The skin of the built-in face at rest under each of these, after two seconds."""
    skin, states = Skin(face), {}
    for name in FREE:
        skin.reset()
        states[name] = held(skin, fw.EXPRESSIONS[name], 100)
    return states


# --- energy and its gradient --------------------------------------------------------------------


@pytest.mark.parametrize("size", [0.01, 4.0])
@pytest.mark.parametrize("time_step", [0.02, 10.0])
def test_gradient_of_the_objective_of_a_step(coarse, monkeypatch, size, time_step):
    """What a step minimizes, as the minimizer is given it; in long steps that is the potential alone.

    Small motions, and such that many springs are beyond their threshold and many triangles nearly turned over.
    """
    skin, rng, seen = Skin(coarse, time_step), np.random.default_rng(7), []
    minimized = Minimizer.minimized

    def watched(minimizer, objective, start):
        if not seen:
            u = start + size * rng.normal(size=start.shape)
            seen.append(u)
            gradient = np.empty_like(u)
            objective(u, gradient)
            assert_gradient(lambda u: objective(u, np.empty_like(u)), u, gradient, rng, rel=2e-5, ways=8)
        return minimized(minimizer, objective, start)

    for _ in range(3):
        held(skin, {name: rng.random() for name in skin.names}, 1)
    monkeypatch.setattr(Minimizer, "minimized", watched)
    skin.contract({"orbicularis_oculi_l": 0.7, "jaw": 0.3, "zygomaticus_major_l": 1.0})
    skin.step()
    if size == 4.0:
        shares = area_shares(skin.points, skin.points + seen[0], coarse.triangles)
        assert (shares < skin.material.smallest_area).mean() > 0.1


def test_springs_are_biphasic():
    edges, rest = np.array([[0, 1]], np.int32), np.array([[2.0, 0.0, 0.0]])

    def pulled(stretch):
        u, gradient = np.array([[0.0, 0, 0], [stretch, 0, 0]]), np.zeros((2, 3))
        energy = kernels.springs(u, edges, rest, np.array([2.0]), np.array([3.0]), 0.25, 4.0, gradient)
        assert np.array_equal(gradient[0], -gradient[1])
        return energy, gradient[1, 0]

    assert pulled(0.0) == (0.0, 0.0)
    assert pulled(0.4) == pytest.approx((0.5 * 3 * 0.4**2, 3 * 0.4))
    assert pulled(-1.5) == pytest.approx((0.5 * 3 * 1.5**2, -3 * 1.5))
    assert pulled(0.5) == pytest.approx((0.5 * 3 * 0.5**2, 3 * 0.5))
    # Beyond a strain of 0.25, a stretch of 0.5, it is five times as stiff.
    assert pulled(0.7) == pytest.approx((0.5 * 3 * 0.7**2 + 0.5 * 12 * 0.2**2, 3 * 0.7 + 12 * 0.2))


NO_TRIANGLES = np.empty((0, 3), np.uint32), np.empty((0, 3)), np.empty(0), np.empty(0), np.empty(0), 0.0, 0.0


def test_the_inversion_barrier_tells_a_mirrored_triangle_and_springs_do_not():
    points, triangle = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0]]), np.array([[0, 1, 2]], np.uint32)
    facing, double, none = np.array([[0.0, 0, 1]]), np.array([4.0]), np.zeros(3)

    def barrier(height):
        u, gradient = np.zeros((3, 3)), np.zeros((3, 3))
        u[2, 1] = height - 2.0
        x, shares, columns = points + u, np.empty(1), (np.zeros((3, 3)), np.zeros((3, 3)), none, none)
        triangles = triangle, facing, double
        kernels.shares_of_area(x, *triangles, shares)
        cost = kernels.volume(u, x, *triangles, shares, np.ones(1), 0.3, 5.0, columns, none.copy(), gradient)
        return cost, gradient

    assert barrier(2.0)[0] == barrier(0.6)[0] == 0.0
    energy, gradient = barrier(-2.0)
    assert energy == pytest.approx(0.25 * 5.0 * 4.0 * 1.3**2)
    assert gradient[2, 1] < 0.0  # energy falls when the triangle turns back
    np.testing.assert_allclose(gradient.sum(axis=0), 0.0, atol=1e-15)
    assert barrier(0.0)[0] < barrier(-1.0)[0] < energy


def test_tethers_are_stiffer_along_the_normal():
    """A column of tissue with no skin on it that could shrink is a tether along the normal."""
    one, scratch, shift = np.ones(1), np.empty(1), np.array([[1.0, 0, 0]])
    empty = np.array([0, 0], np.int32), np.empty(0, np.int32), np.empty(0)
    normal = np.array([[0.6, 0.0, 0.8]])

    def tied(u):
        gradient = np.zeros((1, 3))
        energy = kernels.tethers(np.array([u]), shift, 2 * one, *empty, gradient)
        columns = shift, normal, 10 * one, one
        energy += kernels.volume(np.array([u]), np.array([u]), *NO_TRIANGLES, columns, scratch, gradient)
        return energy, gradient[0]

    assert tied([1.0, 0, 0])[0] == 0.0
    energy, gradient = tied([1.6, 0.0, 0.8])  # one along the normal
    assert energy == pytest.approx(0.5 * 12)
    np.testing.assert_allclose(gradient, 12 * normal[0])
    energy, gradient = tied([1.0, 3.0, 0.0])  # three along the surface
    assert energy == pytest.approx(0.5 * 2 * 9)
    np.testing.assert_allclose(gradient, [0, 6, 0])


@pytest.mark.parametrize("bulge", [0.0, 0.45, 1.0])
def test_tissue_that_is_squeezed_bulges(face, bulge):
    """Columns that are hard to squeeze gain the height that the skin over them loses in area, as it is measured."""
    tissue = dataclasses.replace(face.tissue, bulge=np.full_like(face.tissue.bulge, bulge))
    skin = Skin(dataclasses.replace(face, tissue=tissue), time_step=1.0, material=SkinMaterial(normal_ratio=1e4))
    moved = held(skin, dict.fromkeys(("frontalis_inner_l", "zygomaticus_major_l"), 0.02), 40)
    rest = fw.geometry.vertex_areas(skin.points, face.triangles)
    lost = 1.0 - fw.geometry.vertex_areas(skin.points + moved, face.triangles) / rest
    away = [np.linalg.norm(skin.points - face.landmarks[name], axis=1) for name in ("forehead_mid", "malar_l")]
    free = np.minimum(*away) < 18.0
    out = (moved * tissue.normals).sum(axis=1)
    assert np.ptp(lost[free]) > 0.002
    expected = bulge * tissue.depth * lost
    np.testing.assert_allclose(out[free], expected[free], atol=0.05 * np.abs(tissue.depth * lost)[free].max())


def test_springs_make_a_membrane_of_stiffness_one(face, coarse):
    """Under a uniform scaling by 1 + e the energy is that of the strain e times the area, on any triangulation."""
    e, densities = 1e-5, []
    nothing_else = SkinMaterial(decay=1e7, bending=1e-6, lid_stiffness=0.0, cartilage=0.0)
    for f in (face, coarse):
        skin = Skin(f, time_step=1e-6, material=nothing_else)
        skin.displacement = e * skin.points
        densities.append(skin.energy() / e**2 / fw.geometry.vertex_areas(f.points, f.triangles).sum())
    # Every triangle's area counts for each of its three edges, and a spring of stiffness A / L^2 stores A e^2 / 2.
    # Of bending, which cannot be 0, a little is left.
    np.testing.assert_allclose(densities, 1.5, rtol=1e-8)


# --- rest ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("time_step", [1e-4, 0.02, 10.0])
def test_rest_is_an_exact_equilibrium(face, time_step):
    skin = Skin(face, time_step)
    assert skin.energy() == 0.0
    for _ in range(5):
        assert np.array_equal(skin.step(), skin.points)
    assert not skin.displacement.any()


def test_skin_at_rest_takes_no_steps_and_loses_none(face, monkeypatch):
    """To the last bit it is where skin is that makes all steps; and steps that begin anew there lead nowhere."""
    made, resting, every, steps = [], Skin(face), Skin(face), Skin._advance
    monkeypatch.setattr(Skin, "_advance", lambda skin, *given: (made.append(skin), steps(skin, *given))[1])
    lips = {"zygomaticus_major_l": 1.0, "orbicularis_oris": 0.7}
    for rates in ({"zygomaticus_major_l": 1.0, "corrugator_r": 1.0}, lips, {}, {"mentalis_l": 1.0}):
        for _ in range(110):
            every._stepped_from = (None,) * 4
            one, other = held(resting, rates, 1), held(every, rates, 1)
            assert np.array_equal(one, other)
        assert sum(skin is resting for skin in made[-20:]) == 0
    there, energy = one, resting.energy()
    resting.displacement = there
    assert np.abs(held(resting, rates, 60) - there).max() < 1e-5
    assert abs(resting.energy() - energy) < 1e-9


# --- time steps, long runs ----------------------------------------------------------------------


@pytest.mark.parametrize("time_step", [0.1, pytest.param(1.0, marks=pytest.mark.slow), 10.0])
def test_time_steps_reach_the_same_steady_state(face, steady, time_step):
    skin = Skin(face, time_step)
    for name in FREE:
        skin.reset()
        assert np.abs(held(skin, fw.EXPRESSIONS[name], 50) - steady[name]).max() < 1e-4, name


@pytest.mark.parametrize("time_step", [1e-4, 1e-3])
def test_a_steady_state_is_one_for_the_shortest_steps_too(face, steady, time_step):
    skin = Skin(face, time_step)
    for name in ("paper_surprise", "stretching_mouth"):
        skin.reset()
        skin.displacement = steady[name].copy()
        assert np.abs(held(skin, fw.EXPRESSIONS[name], 100) - steady[name]).max() < 1e-4


@pytest.mark.parametrize("iterations", [25, pytest.param(1, marks=pytest.mark.slow)])
def test_steps_end_no_higher_than_they_began(real_face, monkeypatch, iterations):
    """What implicit Euler minimizes is at its end no more than at its beginning, even if it is given up early."""
    skin, rng = Skin(real_face("makehuman_head_male"), iterations=iterations), np.random.default_rng(0)
    minimized, rises, contacts = Minimizer.minimized, [], skin.contacts

    def watched(minimizer, objective, start):
        end = minimized(minimizer, objective, start)
        scratch = np.empty_like(start)
        before, after = (objective(x, scratch) + contacts.energy(x, scratch) for x in (start, end.u))
        assert (end.before, end.value) == pytest.approx((before, after), rel=1e-12)
        assert end.iterations <= iterations
        rises.append((after - before) / (1.0 + abs(before)))
        return end

    monkeypatch.setattr(Minimizer, "minimized", watched)
    for i in range(21):
        if i % 7 == 0:
            skin.contract({name: rng.random() for name in skin.names})
        skin.step()
    assert np.abs(skin.displacement).max() < 60.0
    assert len(rises) >= 21
    assert max(rises) < 1e-12


# --- contact ------------------------------------------------------------------------------------


def test_skin_that_is_pressed_into_an_eye_comes_out(face):
    skin = Skin(face, time_step=10.0)
    eye = face.eyes[0]
    offset = face.points - eye.centre
    away = np.linalg.norm(offset, axis=1)
    lids = away < 1.15 * eye.radius
    assert lids.sum() > 20
    skin.displacement = np.where(lids[:, None], offset * (0.8 * eye.radius / away - 1.0)[:, None], 0.0)
    skin.step()
    assert (np.linalg.norm(offset + skin.displacement, axis=1)[lids] > np.minimum(away[lids], eye.radius) - 0.05).all()
    assert not held(skin, {}, 100).any()


def test_no_skin_reaches_the_bone_below_it(face, steady):
    """Tethers hold it off: only at the corners of the mouth, over teeth, is nothing left of its depth."""
    skin, tissue = Skin(face), face.tissue
    for name, u in steady.items():
        bone = skin.joints.shift(skin.rates_of(fw.EXPRESSIONS[name]))
        left = 1.0 + ((u - bone) * tissue.normals).sum(axis=1) / tissue.depth
        assert left.min() > -0.05, name
        assert np.percentile(left, 2) > 0.4, name


# --- what the muscles do ------------------------------------------------------------------------


def test_mirrored_contractions_move_mirrored(face):
    distance, mirror = cKDTree(face.points).query(face.points * [-1, 1, 1])
    matched = distance < 1e-6
    assert matched.mean() > 0.5
    states = []
    for side in "lr":
        names = ("frontalis_inner", "zygomaticus_major", "orbicularis_oculi", "risorius")
        states.append(held(Skin(face), {f"{name}_{side}": 0.8 for name in names}, 60))
    difference = states[0] - states[1][mirror] * [-1, 1, 1]
    size = np.abs(states[0]).max()
    # The surface is symmetric, its triangulation need not be.
    assert np.sqrt((difference[matched] ** 2).sum(1).mean()) < 0.02 * size
    assert np.linalg.norm(difference[matched], axis=1).max() < 0.15 * size


def test_one_side_leaves_the_other_alone(face):
    moved = np.linalg.norm(held(Skin(face), {"zygomaticus_major_r": 1.0}, 40), axis=1)
    far = face.points[:, 0] > 30.0
    assert moved.max() > 4.0
    assert moved[far].max() < 0.1 * moved.max()
    assert face.points[np.argmax(moved), 0] < 0.0


@pytest.mark.parametrize(
    "name", [name for name, of in fw.MUSCLES.items() if of["kind"] in ("linear", "sheet") and name[-2:] != "_r"]
)
def test_insertions_move_towards_the_attachment(face, name):
    muscle, moved = face.muscles[name], held(Skin(face, time_step=0.1), {name: 1.0}, 6)
    a, i = (np.atleast_2d(getattr(muscle, part)).mean(axis=0) for part in ("attachment", "insertion"))
    shift = moved[cKDTree(face.points).query(i, k=12)[1]].mean(axis=0)
    assert np.linalg.norm(shift) > 0.5
    assert shift @ (a - i) / np.linalg.norm(shift) / np.linalg.norm(a - i) > 0.5


# --- use ----------------------------------------------------------------------------------------


def test_positions_that_were_handed_out_stay(coarse):
    skin = Skin(coarse)
    skin.contract({"corrugator_l": 1.0})
    first = skin.step()
    kept = first.copy()
    held(skin, {"corrugator_l": 1.0}, 5)
    assert np.array_equal(first, kept)
    assert np.array_equal(skin.points, coarse.points)


def test_contract_relaxes_what_is_not_named(coarse):
    skin = Skin(coarse)
    skin.contract({"corrugator_l": 1.0, "mentalis_r": 0.5})
    skin.contract({"mentalis_r": 0.25})
    assert dict(zip(skin.names, skin.rates, strict=True)) == {**dict.fromkeys(skin.names, 0.0), "mentalis_r": 0.25}


# --- what skins of one face share ------------------------------------------------------------------


def moved(skin):
    skin.contract({"jaw": 0.4, "orbicularis_oris": 0.8, "zygomaticus_major_l": 0.6, "orbicularis_oculi_r": 1.0})
    return np.array([skin.step() for _ in range(4)])


def test_a_skin_of_shared_parts_moves_as_one_of_its_own(face):
    before, alone = moved(Skin(face)), copy.copy(face)  # of parts that skins before may have made
    np.testing.assert_array_equal(moved(Skin(alone)), before)
    for options in {"time_step": 0.5}, {"material": SkinMaterial(bending=3.0)}:
        other = moved(Skin(face, **options))
        assert not np.array_equal(before, other)
        np.testing.assert_array_equal(moved(Skin(face, **options)), other)
        np.testing.assert_array_equal(moved(Skin(copy.copy(face), **options)), other)
    np.testing.assert_array_equal(moved(Skin(face)), before)


def test_skins_of_a_fine_face_share_its_mesh():
    face = fw.default_face()
    one, other = (Skin(face, vertices=600) for _ in range(2))
    assert one.mesh is other.mesh is not Skin(face, vertices=650).mesh
    np.testing.assert_array_equal(moved(other), moved(Skin(copy.copy(face), vertices=600)))


def test_a_face_with_other_muscles_has_skins_of_its_own(face):
    before = moved(Skin(face))
    stronger = dataclasses.replace(face.muscles["zygomaticus_major_l"], strength=3.0)
    assert np.abs(moved(Skin(face.with_muscles({"zygomaticus_major_l": stronger}))) - before).max() > 1e-3
    np.testing.assert_array_equal(moved(Skin(face)), before)
    without = dataclasses.replace(face, muscles={name: m for name, m in face.muscles.items() if name != "jaw"})
    assert "jaw" not in Skin(without).names
