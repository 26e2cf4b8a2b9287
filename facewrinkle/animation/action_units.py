"""Action units that the shapes of face capture stand for.

The shapes are those of Apple's ARKit (ARFaceAnchor.BlendShapeLocation, 52 names that most face capture writes), and the
few that ICT-FaceKit adds. The units follow from what the names' documentation and the Facial Action Coding System
(Ekman, Friesen, Hager: FACS, 2002) describe; a shape that mixes two stands for the one that it shows most.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from types import MappingProxyType
from typing import Literal

from ..errors import check_name, unknown_name

ARKIT: Mapping[str, str] = MappingProxyType(
    {
        "browInnerUp": "AU1",
        "browOuterUp": "AU2",
        "browDown": "AU4",
        "eyeWide": "AU5",
        "cheekSquint": "AU6",
        "eyeSquint": "AU7",
        "mouthClose": "AU8",
        "noseSneer": "AU9",
        "mouthUpperUp": "AU10",
        "mouthSmile": "AU12",
        "mouthDimple": "AU14",
        "mouthFrown": "AU15",
        "mouthLowerDown": "AU16",
        "mouthShrugLower": "AU17",
        "mouthShrugUpper": "AU17",
        "mouthPucker": "AU18",
        "tongueOut": "AU19",
        "mouthStretch": "AU20",
        "mouthFunnel": "AU22",
        "mouthPress": "AU24",
        "jawOpen": "AU27",
        "mouthRollLower": "AU28",
        "mouthRollUpper": "AU28",
        "jawForward": "AU29",
        "jawLeft": "AU30",
        "jawRight": "AU30",
        "cheekPuff": "AU34",
        "eyeBlink": "AU45",
        "eyeLookOut_l": "AU61",
        "eyeLookIn_r": "AU61",
        "eyeLookIn_l": "AU62",
        "eyeLookOut_r": "AU62",
        "eyeLookUp": "AU63",
        "eyeLookDown": "AU64",
    }
)
"""Action units by shape; the side of a shape is left out where it does not matter."""

OTHERS: Mapping[str, str] = MappingProxyType(
    {
        # Ready Player Me, VRM, ICT-FaceKit
        "eyesClosed": "eyeBlink", "eyesLookUp": "eyeLookUp", "eyesLookDown": "eyeLookDown", "mouthOpen": "jawOpen",
        "blink": "eyeBlink", "lookUp": "eyeLookUp", "lookDown": "eyeLookDown", "cheekRaiser": "cheekSquint",
        # Character Creator, iClone
        "browRaiseInner": "browInnerUp", "browRaiseOuter": "browOuterUp", "browDrop": "browDown",
        "browCompress": "browDown", "cheekRaise": "cheekSquint", "noseCrease": "noseSneer",
        "eyeLLookL": "eyeLookOut_l", "eyeLLookR": "eyeLookIn_l", "eyeRLookL": "eyeLookIn_r",
        "eyeLLookUp": "eyeLookUp_l", "eyeRLookR": "eyeLookOut_r", "eyeRLookUp": "eyeLookUp_r",
        "eyeLLookDown": "eyeLookDown_l", "eyeRLookDown": "eyeLookDown_r",
        "mouthSmileSharp": "mouthSmile", "mouthUpUpper": "mouthUpperUp", "mouthDownLower": "mouthLowerDown",
        "mouthChinUp": "mouthShrugLower", "mouthPuckerUp": "mouthPucker", "mouthPuckerDown": "mouthPucker",
        "mouthFunnelUp": "mouthFunnel", "mouthFunnelDown": "mouthFunnel", "mouthRollInUpper": "mouthRollUpper",
        "mouthRollInLower": "mouthRollLower", "mouthTighten": "mouthPress", "mouthL": "mouthLeft",
        "mouthR": "mouthRight", "jawL": "jawLeft", "jawR": "jawRight",
        # MetaHuman
        "browRaiseIn": "browInnerUp", "browLateral": "browDown", "eyeCheekRaise": "cheekSquint",
        "eyeSquintInner": "eyeSquint", "eyeWiden": "eyeWide", "eyeLookLeftL": "eyeLookOut_l",
        "eyeLookRightL": "eyeLookIn_l", "eyeLookLeftR": "eyeLookIn_r", "eyeLookRightR": "eyeLookOut_r",
        "noseWrinkle": "noseSneer", "mouthUpperLipRaise": "mouthUpperUp", "mouthLowerLipDepress": "mouthLowerDown",
        "mouthCornerPull": "mouthSmile", "mouthSharpCornerPull": "mouthSmile", "mouthCornerDepress": "mouthFrown",
        "mouthLipsPurseU": "mouthPucker", "mouthLipsPurseD": "mouthPucker", "mouthFunnelU": "mouthFunnel",
        "mouthFunnelD": "mouthFunnel", "mouthLipsTowardsU": "mouthClose", "mouthLipsTowardsD": "mouthClose",
        "mouthPressU": "mouthPress", "mouthPressD": "mouthPress", "mouthLipsPress": "mouthPress",
        "mouthUpperLipRollIn": "mouthRollUpper", "mouthLowerLipRollIn": "mouthRollLower", "mouthCheekBlow": "cheekPuff",
        "jawFwd": "jawForward", "jawChinRaiseU": "mouthShrugUpper", "jawChinRaiseD": "mouthShrugLower",
        # Unified Expressions (VRChat, Resonite)
        "eyeClosed": "eyeBlink", "browLowerer": "browDown", "browPinch": "browDown", "mouthCornerSlant": "mouthSmile",
        "mouthClosed": "mouthClose", "mouthRaiserUpper": "mouthShrugUpper", "mouthRaiserLower": "mouthShrugLower",
        "mouthTightener": "mouthPress", "mouthSad": "mouthFrown", "lipPucker": "mouthPucker",
        "lipPuckerUpper": "mouthPucker", "lipPuckerLower": "mouthPucker", "lipFunnel": "mouthFunnel",
        "lipFunnelUpper": "mouthFunnel", "lipFunnelLower": "mouthFunnel", "lipSuckUpper": "mouthRollUpper",
        "lipSuckLower": "mouthRollLower", "mouthUpperLeft": "mouthLeft", "mouthUpperRight": "mouthRight",
        "mouthLowerLeft": "mouthLeft", "mouthLowerRight": "mouthRight",
        # Action units by their names in FACS, as headsets of Meta and Android write them
        "innerBrowRaiser": "browInnerUp", "outerBrowRaiser": "browOuterUp", "upperLidRaiser": "eyeWide",
        "lidTightener": "eyeSquint", "noseWrinkler": "noseSneer", "upperLipRaiser": "mouthUpperUp",
        "lipCornerPuller": "mouthSmile", "dimpler": "mouthDimple", "lipCornerDepressor": "mouthFrown",
        "lowerLipDepressor": "mouthLowerDown", "chinRaiser": "mouthShrugLower", "chinRaiserB": "mouthShrugLower",
        "chinRaiserT": "mouthShrugUpper", "lipStretcher": "mouthStretch", "lipPressor": "mouthPress",
        "lipTightener": "mouthPress", "lipFunnelerLB": "mouthFunnel", "lipFunnelerLT": "mouthFunnel",
        "lipFunnelerRB": "mouthFunnel", "lipFunnelerRT": "mouthFunnel", "lipSuckLB": "mouthRollLower",
        "lipSuckRB": "mouthRollLower", "lipSuckLT": "mouthRollUpper", "lipSuckRT": "mouthRollUpper",
        "lipsToward": "mouthClose", "jawDrop": "jawOpen", "jawThrust": "jawForward", "jawSidewaysLeft": "jawLeft",
        "jawSidewaysRight": "jawRight", "eyesLookLeftL": "eyeLookOut_l", "eyesLookRightL": "eyeLookIn_l",
        "eyesLookLeftR": "eyeLookIn_r", "eyesLookRightR": "eyeLookOut_r",
    }
)  # fmt: skip
"""Other names of ARKit's shapes, in avatars, game engines and headsets. Quarters of the lips stand for the whole."""

_SIDE = re.compile(r"(.+?)(l|r|left|right)")


@cache
def plain_name(name: str) -> str:
    """Return a name without case and punctuation.

    Examples
    --------
    >>> plain_name("Eye_Blink Left")
    'eyeblinkleft'
    """
    return re.sub(r"[\W_]", "", name).lower()


_KNOWN = {plain_name(name): name for name in ARKIT} | {plain_name(other): name for other, name in OTHERS.items()}
_STEMS = {plain_name(name.removesuffix("_l").removesuffix("_r")): name for name in ARKIT} | _KNOWN


LOOKS: Mapping[str, str] = MappingProxyType(
    {"eyeLookUp": "up", "eyeLookDown": "down", "eyeLookIn": "inwards", "eyeLookOut": "outwards"}
)
"""Direction in which each shape turns an eye."""


def looks_of(shapes: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Return the side and the turn of the eye for each shape that turns one.

    Examples
    --------
    >>> looks_of(["jawOpen", "eyeLookInLeft", "eyeLookUp_R"])
    {'eyeLookInLeft': ('l', 'inwards'), 'eyeLookUp_R': ('r', 'up')}
    """
    found = {shape: sided(shape) for shape in shapes}
    return {shape: (side, LOOKS[stem]) for shape, (stem, side) in found.items() if side and stem in LOOKS}


def spellings(name: str) -> list[str]:
    """Return the plain names that a name may stand for: whole, and without what programs put before and after it.

    Examples
    --------
    >>> spellings("head.eyeBlink_L"), spellings("A14_Jaw_Open")
    (['headeyeblinkl', 'eyeblinkl', 'l'], ['a14jawopen', 'jawopen'])
    """
    bare = re.split(r"[.:|]", re.sub(r"\.\d+$", "", name))[-1]  # Blender puts numbers after names that are taken
    board, number, mesh = "CTRL_expressions_", r"[A-Za-z]\d+_", "[A-Za-z]+_+(?=[A-Za-z])"
    inner = re.sub(f"^(?:{board}|{number}|{mesh})", "", bare, flags=re.IGNORECASE)
    return list(dict.fromkeys(map(plain_name, (name, bare, inner))))


@cache
def sided(shape: str) -> tuple[str, str | None]:
    """Return ARKit's name of a shape, without its side, and the side; shapes unknown to ARKit keep their name.

    Programs change case and underscores, have names of their own, and put names of meshes and numbers before the name:
    ``head.eyeBlink_L``, ``A14_Eye_Blink_Left``, ``CTRL_expressions_mouthCornerPullL``.

    Examples
    --------
    >>> sided("A14_Eye_Blink_Left"), sided("jawOpen"), sided("hair")
    (('eyeBlink', 'l'), ('jawOpen', None), ('hair', None))
    """
    for plain in spellings(shape):
        match = _SIDE.fullmatch(plain)
        if plain in _KNOWN:
            stem, side = _KNOWN[plain], None
        elif match and match[1] in _STEMS:
            stem, side = _STEMS[match[1]], match[2][0]
        else:
            continue
        bare = stem.removesuffix("_l").removesuffix("_r")
        return (bare, stem[-1]) if side is None and bare != stem else (bare, side)
    return shape, None


def named_shapes(asked: str, names: Sequence[str]) -> list[str]:
    """Return the shapes that a name means: the one of that name in any spelling, or both sides of a pair.

    Raises
    ------
    UnknownNameError
        If there is none; the nearest names are suggested.

    Examples
    --------
    >>> named_shapes("mouth_smile", ["jawOpen", "mouthSmile_L", "mouthSmile_R"])
    ['mouthSmile_L', 'mouthSmile_R']
    """
    if asked in names:
        return [asked]
    plain = {name: spellings(name) for name in names}
    same = [name for name in names if plain_name(asked) in plain[name]]
    sides = [
        name for name in names if any((m := _SIDE.fullmatch(p)) and m[1] == plain_name(asked) for p in plain[name])
    ]
    if not same and not sides:
        stem = sided(asked)
        sides = [name for name in names if sided(name) == stem or (stem[1] is None and sided(name)[0] == stem[0])]
    if not same and not sides:
        raise unknown_name("shape", asked, names)
    return same or sides


def units_of(weights: Mapping[str, float], side: Literal["l", "r"] | None = None) -> dict[str, float]:
    """Return the weights of action units, given those of shapes; of several shapes of one unit the largest counts.

    Parameters
    ----------
    weights : mapping of str to float
        Shapes such as "mouthSmile_L", "mouthSmileLeft", "A38_Mouth_Smile_Left" or "jawOpen"; others are left out.
    side : {"l", "r"}, optional
        Only shapes of this side of the face, and those without a side.

    Returns
    -------
    dict of str to float
        Without units of weight 0.

    Examples
    --------
    >>> units_of({"browInnerUp": 0.5, "eyeBlinkLeft": 1.0, "eyeBlink_R": 0.25, "hairLong": 1.0})
    {'AU1': 0.5, 'AU45': 1.0}
    >>> units_of({"eyeBlinkLeft": 1.0, "eyeBlink_R": 0.25}, side="r")
    {'AU45': 0.25}
    >>> units_of({"eyeLookOutLeft": 0.5, "eyeLookInRight": 0.25})
    {'AU61': 0.5}
    """
    if side is not None:
        check_name("side", side, ("l", "r"))
    found: dict[str, float] = {}
    for shape, weight in weights.items():
        stem, own = sided(shape)
        stem = f"{stem}_{own}" if f"{stem}_{own}" in ARKIT else stem
        if stem in ARKIT and weight > 0.0 and (side is None or own in (None, side)):
            unit = ARKIT[stem]
            found[unit] = max(found.get(unit, 0.0), weight)
    return found
