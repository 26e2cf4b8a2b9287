"""The skin through time: where it comes to rest, whatever came before.

what                        checked against
releases                    rest, to the last bit, after a hundred steps
energy                      itself: it never grows while contraction rates are held
steady states               those after jumps, ramps and detours
lids, lips, teeth           the faults that `tools.trials.oracle` finds, in every step of random jumps
the jaw                     the way between where the skin was and where it ends
threads                     each other, byte by byte
"""

import os
import subprocess
import sys

import numpy as np
import pytest
from skins import held

import facewrinkle as fw
from analysis.subjects import names, subject
from tools.trials.oracle import DEEPEST, Oracle, off_the_way
from tools.trials.player import Player, can_wrinkle
from tools.trials.sequences import sequence


@pytest.fixture(scope="module")
def two_skins(face):
    return fw.Skin(face), fw.Skin(face)


@pytest.fixture
def skins(two_skins):
    """Two skins of the built-in face, which a reset makes new ones: see `test_reset_is_a_new_simulation`."""
    for skin in two_skins:
        skin.reset()
    return two_skins


# --- rest ---------------------------------------------------------------------------------------


def steps_to_rest(skin, most):
    """Number of steps after which skin is exactly at rest, and stays there."""
    skin.contract({})
    for i in range(1, most + 1):
        x = skin.step()
        if not skin.displacement.any():
            assert skin.energy() == 0.0
            assert np.array_equal(x, skin.points)
            assert np.array_equal(skin.step(), skin.points)
            return i
    return np.inf


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[] if name in ("anger", "closing_eye", "kiss", "surprise") else pytest.mark.slow)
        for name in sorted(fw.EXPRESSIONS)
    ],
)
def test_every_release_ends_at_rest(skins, name):
    skin = skins[0]
    assert np.abs(held(skin, fw.EXPRESSIONS[name], 20)).max() > 1.0
    assert steps_to_rest(skin, 100) <= 100


@pytest.mark.parametrize(
    ("stem", "what"),
    [
        ("makehuman_head_male", "AU24"),
        ("mediapipe_canonical_face_model", "anger"),
        ("mediapipe_canonical_face_model", "surprise"),
        ("ict_face_narrow", "surprise"),
    ],
)
def test_releases_of_other_faces_end_at_rest(real_face, stem, what):
    face = real_face(stem)
    skin = fw.Skin(face)
    held(skin, face.atlas.contractions(what), 8)
    assert steps_to_rest(skin, 100) <= 100


@pytest.mark.slow
def test_skin_comes_back_from_the_end_of_long_sequences(face):
    skin, rng = fw.Skin(face), np.random.default_rng(12)
    for _ in range(30):
        held(skin, {name: rng.random() for name in skin.names if rng.random() < 0.5}, int(rng.integers(1, 6)))
    assert steps_to_rest(skin, 100) <= 100


def test_skin_that_came_back_moves_as_a_new_one(face):
    """Nothing is remembered: neither by contacts nor by the minimizer."""
    used, new = fw.Skin(face), fw.Skin(face)
    held(used, fw.EXPRESSIONS["pain"], 15)
    assert steps_to_rest(used, 100) <= 100
    assert np.array_equal(held(used, fw.EXPRESSIONS["anger"], 10), held(new, fw.EXPRESSIONS["anger"], 10))


# --- energy -------------------------------------------------------------------------------------


@pytest.mark.parametrize("time_step", [0.005, 0.5])
def test_energy_never_grows_while_rates_are_held(face, time_step):
    """After random jumps: the first step, in which the joints turn and the muscles pull anew, does work."""
    skin, rng, most = fw.Skin(face, time_step), np.random.default_rng(13), 0.0
    for _ in range(8):
        held(skin, {name: rng.random() for name in skin.names if rng.random() < rng.random()}, 1)
        energies = [skin.energy()]
        for _ in range(8):
            skin.step()
            energies.append(skin.energy())
        most = max(most, np.abs(energies).max())
        assert np.diff(energies).max() <= 1e-12 * most


def test_energy_never_grows_from_random_states(face):
    skin, rng = fw.Skin(face), np.random.default_rng(14)
    for size in (0.1, 0.5):
        skin.reset()
        held(skin, {"zygomaticus_major_l": 0.6}, 2)
        skin.displacement = skin.displacement + size * rng.normal(size=skin.points.shape)
        energies = [skin.energy()]
        for _ in range(10):
            skin.step()
            energies.append(skin.energy())
        assert energies[0] > 0.0
        assert np.diff(energies).max() <= 1e-12 * energies[0]


# --- steady states ------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", ["anger", "doubt", "fear", "kiss", "laughter", "wink"])
def test_a_steady_state_is_one_whatever_came_before(skins, name):
    """A jump, and a detour over other expressions; held until they agree, as lips that press settle more slowly."""
    rates = fw.EXPRESSIONS[name]
    for each in (fw.EXPRESSIONS["kiss"], fw.EXPRESSIONS["stretching_mouth"], {"jaw": 1.0}):
        held(skins[1], each, 6)
    for _ in range(25):
        one, other = (held(skin, rates, 20) for skin in skins)
        if np.abs(one - other).max() < 1e-6:
            break
    assert np.abs(one).max() > 1.0
    assert np.abs(one - other).max() < 1e-6


@pytest.mark.parametrize(
    "name", ["happiness", *(pytest.param(name, marks=pytest.mark.slow) for name in ("surprise", "closing_eye"))]
)
def test_a_steady_state_is_that_of_a_ramp(skins, name):
    rates = fw.EXPRESSIONS[name]
    for share in (0.2, 0.4, 0.6, 0.8):
        held(skins[1], {k: share * rate for k, rate in rates.items()}, 6)
    one, other = (held(skin, rates, 300) for skin in skins)
    assert np.abs(one - other).max() < 1e-6


# --- what it must not enter, and its way --------------------------------------------------------


@pytest.mark.parametrize("time_step", [0.02, pytest.param(0.5, marks=pytest.mark.slow)])
def test_lids_and_lips_do_not_pass_what_they_meet_in_random_jumps(face, time_step):
    skin, rng, oracle = fw.Skin(face, time_step), np.random.default_rng(15), Oracle(face)
    lids = [name for name in skin.names if name.startswith(("orbicularis_oculi", "levator_palp", "rectus", "jaw"))]
    for k in range(16):
        chosen = lids if k % 2 else skin.names
        skin.contract({name: float(rng.random() < 0.5) for name in chosen if rng.random() < 0.5})
        for _ in range(4):
            found = oracle.findings(skin.step())
            assert found.inverted == 0
            assert max(found.eyes, found.lids) < DEEPEST
            assert max(found.lips, found.teeth) < 5.0 * DEEPEST  # edges cut in, but nothing comes through


@pytest.mark.parametrize("time_step", [pytest.param(0.005, marks=pytest.mark.slow), 0.02, 0.5])
@pytest.mark.parametrize(
    "jump",
    [
        ({"jaw": 1.0}, {}),
        ({}, {"jaw": 1.0}),
        pytest.param(({"jaw": 0.3}, {"jaw": 0.9}), marks=pytest.mark.slow),
    ],
)
def test_the_chin_is_never_farther_out_than_its_way(face, time_step, jump):
    """The jaw opens or shuts in one step: no vertex is flung beyond where it was and where it goes."""
    skin = fw.Skin(face, time_step)
    path = [held(skin, jump[0], 60)]
    skin.contract(jump[1])
    for _ in range(60):
        skin.step()
        path.append(skin.displacement.copy())
    assert off_the_way(np.array(path))[:, 0].max() == 0.0
    chin = face.mesh.find_closest_point(face.landmarks["menton"])
    out = np.linalg.norm(np.array(path)[:, chin], axis=1)
    assert out.max() > 8.0
    if not jump[1]:
        assert out.max() == out[0], "it comes back at once"
        assert out[-1] < 0.001 * out[0]


# --- the same bytes -----------------------------------------------------------------------------


PLAYED = """
import hashlib
import facewrinkle as fw

face = fw.default_face()
skin, digest = fw.Skin(face), hashlib.sha256()
for what in ("stretching_mouth", "anger", "AU43"):
    skin.contract(face.atlas.contractions(what))
    for _ in range(2):
        digest.update(skin.step().tobytes())
print(digest.hexdigest())
"""


@pytest.mark.slow
def test_the_same_bytes_with_any_number_of_threads():
    digests = set()
    for threads in (1, 2, 4):
        count = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"), str(threads))
        digests.add(subprocess.check_output([sys.executable, "-c", PLAYED], env={**os.environ, **count}))
    assert len(digests) == 1


# --- a sample of random sequences on many faces ---------------------------------------------------


FACES = ("head-1", "ict-0", "ict-1", "makehuman", "mediapipe")
FRAMES = 120
NEVER = ("not finite", "energy", "eyes", "inverted", "wrinkles", "teeth", "lips", "not at rest")


@pytest.fixture(scope="module")
def played(request):
    """The name of a face, and its player."""
    if request.param not in names():
        pytest.skip(f"{request.param} is not beside the repository")
    return request.param, Player(subject(request.param))


def faults(player, name, index, simulated=False):
    trial = player.play(sequence(player.face, 0, name, index), simulated)
    worst = trial.worst()
    return len(trial.largest), {
        f"{kind}, {name} {index}": f"{count} frames, {worst[kind][0]:.3g} in frame {worst[kind][1]}"
        for kind, count in trial.failed().items()
        if count and kind in NEVER
    }


@pytest.mark.slow
@pytest.mark.parametrize("played", FACES, indirect=True, scope="module")
def test_a_face_comes_back_from_random_sequences(played):
    name, player = played
    found, frames, index = {}, 0, 0
    while frames < FRAMES:
        more, faulty = faults(player, name, index)
        found |= faulty
        frames, index = frames + more, index + 1
    assert not found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("played", "index", "simulated"),
    [
        ("head-1", 7, True),
        ("head-1", 17, False),
        ("head-2", 8, False),
        ("ict-1", 7, True),
        ("makehuman", 5, False),
        ("makehuman", 14, False),
        ("ict-5", 9, False),
    ],
    indirect=["played"],
    scope="module",
)
def test_wrinkles_turn_no_refined_triangle_over_and_what_once_went_wrong_does_not(played, index, simulated):
    name, player = played
    assert can_wrinkle(player.face)
    frames, faulty = faults(player, name, index, simulated)
    assert frames > 20
    assert not faulty
