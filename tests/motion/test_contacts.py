"""Contacts of the skin.

what                      checked against
energies                  their gradients, differences; the rows that the model of a step is given
solids                    the model that they never fall below; the turn of the mandible; room at rest
lips                      rays from each lip to the other at rest; parted lips are left alone; pressed ones do not pass
lids                      the oracle, with contact and without; the margins, which meet
teeth                     the ellipse of the arches, and the crowns that are drawn
memory                    contacts that have looked nowhere else
forces of contacts        scipy's non-negative least squares with dense matrices
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from skins import assert_gradient, held
from synthetic_faces import head_with, ring

import facewrinkle as fw
from facewrinkle.mesh import to_polydata
from facewrinkle.motion._contact_kernels import gaps_of
from facewrinkle.motion.contacts import Compliance, Contacts
from facewrinkle.motion.self_contact import CLOSE_BY, LIP_DISTANCE, facing_lids, squeezed
from facewrinkle.motion.skin import Skin
from facewrinkle.motion.solids import SLACK, met_solids, samples_of
from tools.trials.oracle import DEEPEST, Oracle


@pytest.fixture(scope="module")
def skin(face):
    return Skin(face)


HEADS = [None, pytest.param("makehuman_head_male", marks=pytest.mark.slow)]
KINDS = ("solids", "lips", "lids", "flats")


def contacts_of(face, *kinds):
    """Contacts of some kinds alone."""
    contacts = Skin(face).contacts
    weaken(contacts, *(kind for kind in KINDS if kind not in kinds))
    return contacts


def weaken(contacts, *kinds):
    """Leave contacts of some kinds next to no force."""
    weak = np.where(np.isin(contacts.kinds, kinds), 1e-30, 1.0)
    contacts.samples = contacts.samples._replace(stiffness=weak * contacts.samples.stiffness)
    if "flats" in kinds:
        contacts.flats = replace(contacts.flats, stiffness=1e-30 * contacts.flats.stiffness)


def room_of(skin, kind):
    """How much farther than they may be samples of a kind are from what they meet, where the jaw is shut, mm."""
    face, contacts, x = skin.mesh.face, skin.contacts, (skin.points + skin.displacement)[skin.mesh.vertices]
    places = np.vstack([x, [face.unit * eye.centre for eye in face.eyes]])
    return (gaps_of(places, contacts.samples, contacts.solids) - contacts.samples.allowed)[contacts.kinds == kind]


def smooth(points, rng, size, wave=25.0):
    """A random displacement that varies over a wave length, mm."""
    waves = rng.normal(size=(6, 3)) / wave * 2.0
    return size / 3.0 * np.sin(points @ waves.T + rng.uniform(0.0, 7.0, 6)) @ rng.normal(size=(6, 3))


def pressed_in(face, rng, depth=1.5):
    """Displacements that push lips and lids into each other, and skin back on teeth and eyes; rough by a little."""
    local = (face.points - fw.anatomy.lips_middle(face.landmarks)) @ face.frame.axes.T
    close = np.exp(-((local / [30.0, 12.0, 25.0]) ** 2).sum(axis=1))
    u = np.outer(-np.tanh(local[:, 1] / 2.0) * close * depth, face.frame.axes[1])
    u += smooth(face.points, rng, 2.0) - 1.0 * face.frame.axes[2]
    for name in ("orbicularis_oculi_l", "orbicularis_oculi_r"):
        closing = face.joint_weights[name]
        u[closing.vertices] += closing.turned(face.points, 1.1)
    return u + 0.02 * rng.normal(size=u.shape)


def posed(skin, rates, steps=30):
    """Positions (n, 3) of skin that held contraction rates from rest on, mm."""
    skin.reset()
    return skin.points + held(skin, rates, steps)


# --- energies -----------------------------------------------------------------------------------


@pytest.mark.parametrize("kinds", [*((kind,) for kind in KINDS), KINDS])
@pytest.mark.parametrize("rate", [0.0, 0.6])
def test_contacts_push_along_the_slope_of_their_energy(face, kinds, rate):
    rng, contacts = np.random.default_rng(2), contacts_of(face, *kinds)
    contacts.place(rate, contacts.flats.facing)
    u = pressed_in(face, rng)
    if "flats" in kinds:
        u += 1.2 * rng.normal(size=u.shape)
    gradient = np.zeros_like(u)
    assert contacts.energy(u, gradient) > 0.1
    assert (np.abs(gradient).max(axis=1) > 0.0).sum() > 20
    assert_gradient(lambda u: contacts.energy(u, np.zeros_like(u)), u, gradient, rng, h=1e-7)


@pytest.mark.parametrize("kinds", [*((kind,) for kind in KINDS), KINDS])
def test_rows_add_up_to_the_energy_and_its_gradient(face, kinds):
    """What the model of a step knows of the contacts is all of them, where it starts."""
    rng, contacts = np.random.default_rng(4), contacts_of(face, *kinds)
    u = pressed_in(face, rng) + 0.5 * rng.normal(size=face.points.shape)
    gradient = np.zeros_like(u)
    energy = contacts.energy(u, gradient)
    vertices, slopes, depths, stiffness = contacts.rows(np.zeros_like(u))
    force = stiffness * np.maximum(depths, 0.0)
    assert (force > 0.0).sum() > 20
    assert 0.5 * (force * depths).sum() == pytest.approx(energy)
    pushed = np.zeros_like(u)
    np.subtract.at(pushed, vertices, force[:, None, None] * slopes)
    np.testing.assert_allclose(pushed, gradient, atol=1e-9 * np.abs(gradient).max())


@pytest.mark.parametrize("kinds", [*((kind,) for kind in KINDS), KINDS])
def test_rows_tell_the_energy_a_little_ahead(face, kinds):
    rng, contacts = np.random.default_rng(5), contacts_of(face, *kinds)
    u = pressed_in(face, rng) + 0.3 * rng.normal(size=face.points.shape)
    errors = []
    for h in (1e-3, 1e-4):
        ahead = h * smooth(face.points, np.random.default_rng(6), 1.0)
        contacts.energy(u, np.zeros_like(u))
        _, _, depths, stiffness = contacts.rows(ahead)
        model = 0.5 * (stiffness * np.maximum(depths, 0.0) ** 2).sum()
        errors.append(abs(model - contacts.energy(u + ahead, np.zeros_like(u))))
        assert errors[-1] < 0.05 * abs(model - contacts.energy(u, np.zeros_like(u)))
    assert errors[1] < 0.03 * errors[0]  # the error is of second order


def test_contacts_have_no_memory(face):
    """Their energy is that of contacts which have never been anywhere else."""
    rng, traveled = np.random.default_rng(7), Skin(face).contacts
    for k in range(12):
        u = pressed_in(face, rng, depth=2.0 * rng.random()) * rng.random()
        rate = [0.0, 0.3][k % 2]
        traveled.place(rate, traveled.flats.facing)
        for share in (0.0, 0.5, 1.0):  # a way whose steps are too short to look for contacts anew each time
            found = np.zeros_like(u)
            energy = traveled.energy(share * u, found)
        fresh, expected = Skin(face).contacts, np.zeros_like(u)
        fresh.place(rate, fresh.flats.facing)
        assert energy == pytest.approx(fresh.energy(u, expected), rel=1e-12)
        np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize(
    "any_face", [None, "ict_face_narrow", "makehuman_head_male", "mediapipe_canonical_face_model"], indirect=True
)
def test_at_rest_nothing_touches(any_face):
    skin = Skin(any_face)
    contacts, gradient = skin.contacts, np.zeros_like(skin.mesh.face.points)
    assert contacts.energy(np.zeros_like(gradient), gradient) == 0.0
    assert not gradient.any()
    assert len(contacts.rows(gradient)[3]) == 0


# --- solids -------------------------------------------------------------------------------------


def test_rest_is_off_everything_by_its_slack(skin):
    skin.reset()
    for kind in ("solids", "lips", "lids", "flesh"):
        room = room_of(skin, kind)
        assert len(room) > 100
        assert room.min() >= SLACK - 1e-12
    np.testing.assert_allclose(skin.contacts.samples.shares.sum(axis=1), 1.0)
    assert (skin.contacts.samples.stiffness > 0.0).all()


@pytest.mark.parametrize("touching", [False, True])
def test_the_lining_of_sockets_that_touches_an_eye_behind_its_middle_meets_nothing(touching):
    head = head_with("sockets")
    points, lining = head.points.copy(), ring("sockets", 4)
    for eye in head.eyes if touching else ():
        offset = points - eye.centre
        away = np.linalg.norm(offset, axis=1)
        near = (offset @ eye.gaze < 0.0) & (away < 1.6 * eye.radius)
        assert near[lining].any()
        points[near] = eye.centre + (eye.radius + 0.1) / away[near, None] * offset[near]
    face = fw.Face.from_landmarks(to_polydata(points, head.triangles), head.landmarks, 1.0)
    _, samples = met_solids(face, np.ones(len(points)))
    places = np.einsum("kc,kcx->kx", samples.shares, face.points_mm[samples.corners])
    for k, eye in enumerate(face.eyes):
        offset = places[samples.partners[:, 0] == -1 - k] - eye.centre
        behind = offset @ eye.gaze < 0.0
        assert (~behind).sum() > 100
        assert (behind.sum() > 10) != touching


def test_solids_go_with_the_mandible(face, skin):
    """Skin that turns as far as the teeth before it is as far from them as at rest."""
    solids, samples = met_solids(face, np.ones(len(face.points)), face.joint_weights["jaw"].angles.max())
    jaw, turned = skin.joints.mandible, solids.turned(skin.joints.mandible, 0.7)
    points = np.einsum("kc,kci->ki", samples.shares, face.points[samples.corners])
    angles = solids.angles[-1 - samples.partners[:, 0]]
    moved = jaw.centre + Rotation.from_rotvec(np.outer(0.7 * angles, jaw.axis)).apply(points - jaw.centre)
    assert np.linalg.norm(moved - points, axis=1).max() > 10.0
    alone = samples._replace(corners=np.arange(len(points))[:, None].repeat(3, axis=1))
    np.testing.assert_allclose(gaps_of(moved, alone, turned), gaps_of(points, alone, solids), atol=1e-9)
    fixed = solids.angles == 0.0
    assert 30 < fixed[-1 - samples.partners[:, 0]].sum() < len(points) - 30
    assert np.array_equal(turned.origins[fixed], solids.origins[fixed])
    assert np.array_equal(turned.axes[fixed], solids.axes[fixed])
    assert solids.turned(None, 1.0) is solids.turned(jaw, 0.0) is solids


def test_long_edges_are_sampled_in_the_middle(face):
    near, area = np.ones(len(face.points), bool), np.ones(len(face.points))
    counts = [len(samples_of(face, near, area, radius).corners) for radius in (1e9, 100.0, 5.0, 1.0)]
    assert counts[0] == len(face.points)
    assert counts == sorted(set(counts))
    corners, shares, *_ = samples_of(face, near, area, 5.0)
    middles = shares[:, 0] == 0.5
    lengths = np.linalg.norm(face.points[corners[middles, 0]] - face.points[corners[middles, 1]], axis=1)
    assert (lengths**2 / (8.0 * 5.0) > 0.05).all(), "only chords that cut a ball of 5 mm by more than .05 mm"


def test_the_wall_of_the_teeth_is_their_outer_border(face, skin):
    """The arch that is drawn lies within the wall, but for the bulge of its crowns."""
    upper, _ = fw.anatomy.teeth_of(face.landmarks, face.frame)
    solids, arch = skin.contacts.solids, len(face.eyes)
    radius = np.hypot(*(((upper.points - solids.origins[arch]) @ solids.axes[arch, :2].T) / solids.halves[arch]).T)
    assert 0.95 < radius.max() < 1.05


# --- lips ---------------------------------------------------------------------------------------


PURSED = {"orbicularis_oris": 1.0}
PRESSED = dict.fromkeys(("mentalis_l", "mentalis_r", "depressor_anguli_oris_l", "depressor_anguli_oris_r"), 1.0)


def test_lips_that_are_pressed_together_stop_each_other(face):
    """The chin pushes the lower lip up: free, it would pass far through the upper one."""
    free, stopped = Skin(face), Skin(face)
    oracle = Oracle(face)
    weaken(free.contacts, "lips")
    assert oracle.findings(posed(free, PRESSED)).lips > 1.0
    assert oracle.findings(posed(stopped, PRESSED)).lips < DEEPEST
    assert -0.02 < room_of(stopped, "lips").min() + LIP_DISTANCE < 1.1 * LIP_DISTANCE  # they do touch


@pytest.mark.parametrize("time_step", [0.02, 1.0])
@pytest.mark.parametrize("any_face", HEADS, indirect=True)
def test_lips_do_not_pass_each_other_when_they_are_flung_together(any_face, time_step):
    """From wide open to pressed in a jump, and back; in every step."""
    skin, oracle = Skin(any_face, time_step), Oracle(any_face)
    fling = {**PRESSED, **PURSED}
    assert set(fling) <= set(skin.names)
    for rates in ({"jaw": 1.0}, fling, {"jaw": 0.5, **fling}, PRESSED, {"jaw": 1.0}, {}):
        skin.contract(rates)
        for _ in range(8):
            assert oracle.findings(skin.step()).lips < DEEPEST


@pytest.mark.parametrize(
    "what", ["AU28", *(pytest.param(what, marks=pytest.mark.slow) for what in ("anger", "AU23", "AU24"))]
)
def test_a_lower_lip_that_lies_high_stays_below_the_other(real_face, what):
    """Here the lower lip lies behind the red of the upper one, as high as its lower border."""
    face = real_face("makehuman_head_male")
    skin, oracle, rates = Skin(face, time_step=0.1), Oracle(face), face.atlas.contractions(what)
    skin.contract(rates)
    for _ in range(8):
        assert oracle.findings(skin.step(), face.jaw_angle(rates)).lips < DEEPEST


@pytest.mark.parametrize("any_face", HEADS, indirect=True)
def test_lips_stay_before_the_teeth(any_face):
    skin, oracle = Skin(any_face, time_step=0.1), Oracle(any_face)
    wide = {"risorius_l": 1.0, "risorius_r": 1.0}
    for rates in ({**wide, "jaw": 0.5}, fw.ACTION_UNITS["AU28"], fw.EXPRESSIONS["anger"]):
        assert oracle.findings(posed(skin, rates, 6)).teeth < DEEPEST
    weaken(skin.contacts, "solids")
    assert oracle.findings(posed(skin, fw.ACTION_UNITS["AU28"], 6)).teeth > 1.0, "without contacts they do not"


@pytest.mark.parametrize("any_face", [*HEADS, pytest.param("ict_face_narrow", marks=pytest.mark.slow)], indirect=True)
def test_pursed_lips_come_forward_and_stay_together(any_face):
    skin = fw.Skin(any_face, time_step=1.0)
    local = held(skin, PURSED, 15) @ any_face.frame.axes.T
    lips = cKDTree(any_face.points).query([any_face.landmarks[f"{lip}_lip_mid"] for lip in ("upper", "lower")])[1]
    assert (local[lips, 2] > 5.0).all()
    corners = cKDTree(any_face.points).query([any_face.landmarks["mouth_l"], any_face.landmarks["mouth_r"]])[1]
    assert local[corners[0], 0] < -3.0
    assert local[corners[1], 0] > 3.0
    points, up, parted = skin.mesh.face.points * any_face.unit, any_face.frame.axes[1], []
    flat = squeezed(points, up)
    moved, samples = skin.displacement[skin.mesh.vertices] @ up, skin.contacts.samples
    for k in np.flatnonzero((skin.contacts.kinds == "lips") & (samples.shares[:, 0] == 1.0)):
        vertex, partner = samples.corners[k, 0], samples.partners[k]
        _, shares, beside = fw.geometry.closest(flat, partner[None], flat[vertex])
        if beside < CLOSE_BY:
            side = np.sign((points[vertex] - shares @ points[partner]) @ up)
            parted.append(side * (moved[vertex] - shares @ moved[partner]))
    assert len(parted) > 20
    assert max(parted) < 0.5  # without the pressure they part by millimeters


# --- lids ---------------------------------------------------------------------------------------

WIDE, OPEN = fw.ACTION_UNITS["AU5"], fw.ACTION_UNITS["AU27"]
CLOSED = dict.fromkeys(("orbicularis_oculi_l", "orbicularis_oculi_r"), 1.0)
TIGHT = {f"{name}_{s}": 1.0 for name in ("orbicularis_oculi_palpebral", "orbicularis_oculi_orbital") for s in "lr"}


@pytest.mark.parametrize("any_face", HEADS, indirect=True)
@pytest.mark.parametrize("time_step", [0.02, 1.0])
def test_lids_meet_and_do_not_pass_each_other(any_face, time_step):
    skin, oracle = Skin(any_face, time_step), Oracle(any_face)
    for rates in (CLOSED, {}, {**CLOSED, **TIGHT}, TIGHT, CLOSED):
        skin.contract(rates)
        for _ in range(5):
            assert oracle.findings(skin.step()).lids < DEEPEST
    assert -0.02 < room_of(skin, "lids").min() < 0.0, "they press"
    weaken(skin.contacts, "lids")
    assert oracle.findings(posed(skin, CLOSED, 10)).lids > 2.0 * DEEPEST, "without contacts they do not stop"


def test_lids_meet_along_their_margins(face):
    """Between the corners, every vertex of either margin comes to touch the other, but for a turned chord."""
    skin = Skin(face, time_step=1.0)
    posed(skin, CLOSED, 10)
    vertices, gaps = skin.contacts.samples.corners[skin.contacts.kinds == "lids", 0], {}
    for v, gap in zip(vertices.tolist(), room_of(skin, "lids"), strict=True):
        gaps[v] = min(gap, gaps.get(v, np.inf))  # to what it is nearest of what it meets
    for opening in face.eyelid_openings.values():
        margins = [v for v in (*opening.upper[2:-2], *opening.lower[2:-2]) if v in gaps]
        assert len(margins) > 10
        assert max(gaps[v] for v in margins) < 0.25  # mm


@pytest.mark.parametrize("any_face", [None, "ict_face_narrow"], indirect=True)
def test_planes_that_part_lids_stay_between_them(any_face):
    """Where a rim runs towards the eye, in its corners, the plane through both turns with the least motion."""
    face, n = any_face, len(any_face.points)
    samples = facing_lids(face, np.ones(n))
    places = np.vstack([face.points, *(eye.centre for eye in face.eyes)])
    start, end, centre = places[samples.partners].transpose(1, 0, 2)
    run, ray = fw.geometry.unit(end - start), fw.geometry.unit(centre - start)
    ups = np.array([face.eyelid_openings[eye.side].axes[1] for eye in face.eyes])[samples.partners[:, 2] - n]
    assert np.abs(np.einsum("nk,nk->n", np.cross(run, ray), ups)).min() > 0.4


@pytest.mark.parametrize("kind, rates", [("lips", OPEN), *(("lids", rates) for rates in ({}, TIGHT, WIDE, OPEN))])
def test_what_is_open_does_not_feel_itself(face, kind, rates):
    skin = Skin(face)
    posed(skin, rates)
    assert (room_of(skin, kind) < 0.0).mean() < 0.05  # beside the corners


# --- forces -------------------------------------------------------------------------------------


def test_compliance_is_that_of_direct_solves():
    rng, n, m = np.random.default_rng(0), 30, 12
    matrices = []
    for _ in range(3):
        a = rng.normal(size=(n, n)) * (rng.random((n, n)) < 0.2)
        matrices.append(csr_array(a @ a.T + np.eye(n)))
    factors, solves = [splu(matrix.tocsc()) for matrix in matrices], []

    def solved(forces):
        solves.append(np.flatnonzero(forces.any(axis=1)))
        return np.stack([factor.solve(forces[:, k]) for k, factor in enumerate(factors)], axis=1)

    compliance = Compliance(solved, n)
    vertices = np.array([rng.choice(n, 6, replace=False) for _ in range(m)])
    slopes, depths, stiffness = rng.normal(size=(m, 6, 3)), rng.normal(size=m), rng.uniform(50.0, 500.0, m)
    slopes[: m // 2, 3:], vertices[: m // 2, 3:] = 0.0, vertices[: m // 2, :1]
    dense = np.zeros((m, n, 3))
    for r in range(m):
        np.add.at(dense[r], vertices[r], slopes[r])
    inverses = [np.linalg.inv(matrix.toarray()) for matrix in matrices]
    response = sum(dense[:, :, k] @ inverse @ dense[:, :, k].T for k, inverse in enumerate(inverses))
    left = np.linalg.cholesky(response + np.diag(1.0 / stiffness))
    expected = nnls(left.T, np.linalg.solve(left, depths))[0]
    assert 2 < (expected > 0.0).sum() < m
    for _ in range(2):
        found = compliance.forces((vertices, slopes, depths, stiffness))
        np.testing.assert_allclose(found, np.einsum("r,rik->ik", expected, dense), atol=1e-4)
        assert sorted(np.concatenate(solves)) == np.unique(vertices).tolist(), "each vertex that is needed, once"
    few = vertices[:2], slopes[:2], np.array([1.0, -1.0]), stiffness[:2]
    force = 1.0 / (response[0, 0] + 1.0 / stiffness[0])
    alone = compliance.forces((*few[:2], np.array([1.0, -1e3]), few[3]))
    np.testing.assert_allclose(alone, force * dense[0], atol=1e-4)


def test_contacts_of_a_face_without_a_mandible_have_no_lips(face):
    each = np.ones(len(face.points))
    contacts = Contacts(face, each, each)
    assert set(contacts.kinds) == {"solids", "lids", "flesh"}
    assert contacts.energy(-2.0 * face.frame.axes[2] + np.zeros_like(face.points), np.zeros_like(face.points)) > 0.0
