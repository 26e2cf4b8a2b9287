"""Action units on the faces at hand: which way the skin goes, and how far, as the Facial Action Coding System says."""

import numpy as np
import pytest
from skins import settled

pytestmark = pytest.mark.parametrize(
    "any_face",
    [None, "ict_face_narrow", pytest.param("makehuman_head_male", marks=pytest.mark.slow)],
    indirect=True,
)


def near(face, field, mark, width=4.0):
    """Mean displacement of the skin around a landmark."""
    away = np.linalg.norm(face.points - face.landmarks[mark], axis=1) * face.unit
    return np.average(field, axis=0, weights=np.exp(-0.5 * (away / width) ** 2))


def margins(face, side, field):
    """Elevations (2, 9) of both margins about the middle of the eye, radians."""
    opening = face.eyelid_openings[side]
    moved = face.points + field @ face.frame.axes / face.unit
    out = []
    for chain in (opening.upper, opening.lower):
        along, elevation, _ = opening.polar(moved[chain])
        order = np.argsort(along)
        out.append(np.interp(np.linspace(0.3, 0.7, 9), along[order], elevation[order]))
    return np.array(out)


def test_tightened_lids_narrow_the_eye_from_below(any_face):
    tightened = settled(any_face, "AU7")
    palpebral = settled(any_face, "orbicularis_oculi_palpebral")
    for side, outwards in (("l", 1.0), ("r", -1.0)):
        upper, lower = margins(any_face, side, np.zeros_like(tightened))
        height = upper - lower
        part_upper, part_lower = margins(any_face, side, palpebral)
        assert (np.abs(part_upper - upper) < 0.05 * height).all()
        assert (0.15 * height < part_lower - lower).all()
        assert (part_lower - lower < 0.3 * height).all()
        chain = any_face.eyelid_openings[side].lower
        middle = palpebral[chain[len(chain) // 2]]
        assert 0.25 < -outwards * middle[0] / middle[1] < 0.7  # towards the inner canthus, and more up than that
        now_upper, now_lower = margins(any_face, side, tightened)
        assert 0.5 < ((now_upper - now_lower) / height).mean() < 0.75
        assert np.linalg.norm(near(any_face, tightened, f"malar_{side}")) < 3.0


@pytest.mark.parametrize(("what", "most"), [({"AU7": 1.0, "AU43": 1.0}, 0.06), ({"AU7": 1.0, "AU64": 1.0}, 0.6)])
def test_lids_that_close_or_look_down_may_be_tightened_too(any_face, what, most):
    field = settled(any_face, what)
    for side in "lr":
        upper, lower = margins(any_face, side, np.zeros_like(field))
        now_upper, now_lower = margins(any_face, side, field)
        share = (now_upper - now_lower) / (upper - lower)
        assert (share > -0.06).all()
        assert (share < most).all()


def test_a_frown_lowers_the_brows_and_draws_them_together(any_face):
    field = settled(any_face, "AU4")
    for side, outwards in (("l", 1.0), ("r", -1.0)):
        for mark in (f"brow_{side}_inner", f"brow_{side}_mid"):
            aside, up, _ = near(any_face, field, mark)
            assert -outwards * aside > 1.2
            assert up < -2.5
    assert near(any_face, field, "glabella")[1] < -1.5


def test_a_chin_that_rises_pushes_the_lower_lip_up_and_forward(any_face):
    field = settled(any_face, "AU17")
    chin, lip, upper = (near(any_face, field, mark) for mark in ("pogonion", "lower_lip_mid", "upper_lip_mid"))
    assert chin[1] > 8.0
    assert lip[1] > 4.0
    assert lip[2] > 0.5 * lip[1]
    assert np.linalg.norm(upper) < 0.5 * np.linalg.norm(lip)


def test_tightened_lips_go_inwards_and_towards_each_other(any_face):
    field = settled(any_face, "AU23")
    upper, lower = (near(any_face, field, mark, 2.0) for mark in ("upper_lip_mid", "lower_lip_mid"))
    assert upper[1] < -0.8
    assert lower[1] > 0.5
    assert max(upper[2], lower[2]) < -0.8
    assert all(abs(near(any_face, field, f"mouth_{side}")[0]) < 2.5 for side in "lr")  # which a pucker narrows
