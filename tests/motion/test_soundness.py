"""A sample of random sequences on many faces. `python -m tools.trials soundness` plays many more, and tells more
kinds of faults: what is asserted here holds for whatever the muscles do.

on any face      | finite; no energy gained while the rates are held; nothing deep in an eye, a tooth or the other lip;
                 | rest after a release; no triangle turned over, of those that are simulated and of those that follow
with wrinkles    | no refined triangle turned over by them
once went wrong  | skin in teeth where its lining turns into the mouth; a triangle at the corner of an eye, turned
                 | over in a jump, and slivers at the corner of the mouth; lips through each other at their front edge
"""

import pytest

from analysis.subjects import names, subject
from tools.trials.player import Player, can_wrinkle
from tools.trials.sequences import sequence

pytestmark = pytest.mark.slow

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


@pytest.mark.parametrize("played", FACES, indirect=True, scope="module")
def test_a_face_comes_back_from_random_sequences(played):
    name, player = played
    found, frames, index = {}, 0, 0
    while frames < FRAMES:
        more, faulty = faults(player, name, index)
        found |= faulty
        frames, index = frames + more, index + 1
    assert not found


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
