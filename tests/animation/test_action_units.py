"""Action units by the names of captured shapes.

what                       checked against
names of one shape         each other, as writers spell them
ARKit's 52 names           a unit for each but two, by side
"""

import pytest

import facewrinkle as fw
from facewrinkle.animation.action_units import ARKIT, units_of


def test_shapes_become_action_units():
    assert units_of({"mouthSmileLeft": 0.2, "mouthSmileRight": 0.9}) == {"AU12": 0.9}
    assert units_of({"mouthSmile_L": 0.2, "mouthSmile_R": 0.9}, side="l") == {"AU12": 0.2}
    assert units_of({"jawLeft": 0.5, "mouthLeft": 0.4, "unknown": 1.0, "browDownLeft": 0.0}) == {"AU30": 0.5}
    for left in ("EyeBlinkLeft", "Eye_Blink_L", "eyeBlink.L", "eyeBlink.Left", "head_shapes.eyeBlinkLeft", "blinkLeft",
                 "A14_Eye_Blink_Left", "rig:eye_blink_left"):  # fmt: skip
        assert units_of({left: 0.5}, side="l") == {"AU45": 0.5}
        assert units_of({left: 0.5}, side="r") == {}
    for name, unit in (
        ("BrowInnerUp", 1),
        ("Brow_Drop_R", 4),
        ("eyesClosed", 45),
        ("A25_Jaw_Open", 27),
        ("JawLeft", 30),
    ):
        assert units_of({name: 1.0}) == {f"AU{unit}": 1.0}
    assert units_of(dict.fromkeys(("mouthLeft", "viseme_aa", "Fcl_ALL_Joy", "browL", "Left", "L", ""), 1.0)) == {}
    assert units_of({"jawLeft": 0.5, "jawOpen": 0.25}, side="r") == {"AU30": 0.5, "AU27": 0.25}
    with pytest.raises(fw.errors.UnknownNameError, match="side"):
        units_of({}, side="left")
    assert set(ARKIT.values()) >= {u for u in fw.ACTION_UNITS if u[-1].isdigit()} - {
        "AU11", "AU22", "AU23", "AU25", "AU26", "AU43", "AU46",
    }  # fmt: skip


BOTH_SIDES = [
    "browDown",
    "browOuterUp",
    "cheekSquint",
    "eyeBlink",
    "eyeLookDown",
    "eyeLookIn",
    "eyeLookOut",
    "eyeLookUp",
    "eyeSquint",
    "eyeWide",
    "mouthDimple",
    "mouthFrown",
    "mouthLowerDown",
    "mouthPress",
    "mouthSmile",
    "mouthStretch",
    "mouthUpperUp",
    "noseSneer",
]
MIDDLE = [
    "browInnerUp",
    "cheekPuff",
    "jawForward",
    "jawLeft",
    "jawOpen",
    "jawRight",
    "mouthClose",
    "mouthFunnel",
    "mouthLeft",
    "mouthPucker",
    "mouthRight",
    "mouthRollLower",
    "mouthRollUpper",
    "mouthShrugLower",
    "mouthShrugUpper",
    "tongueOut",
]


def test_all_shapes_of_arkit_are_known():
    names = [f"{name}{side}" for name in BOTH_SIDES for side in ("Left", "Right")] + MIDDLE
    assert len(names) == 52
    for name in names:
        found = units_of({name: 0.5})
        # The coding system has no unit for a mouth that goes to one side.
        assert len(found) == (name not in ("mouthLeft", "mouthRight")), name
        if name.startswith("eye") or name not in MIDDLE:  # the sides in their short form, and apart
            stem, side = (name[:-4], "l") if name.endswith("Left") else (name[:-5], "r")
            assert units_of({f"{stem}_{side.upper()}": 0.5}) == units_of({name: 0.5}, side=side) == found
            assert units_of({name: 0.5}, side="r" if side == "l" else "l") == {}
