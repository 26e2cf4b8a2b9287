"""Blend shapes by name: which muscles contract for each, what is modeled besides, and which side it belongs to.

The names are those of Apple's ARKit (ARFaceAnchor.BlendShapeLocation), of the 15 visemes of the Oculus lip sync
reference, and of the further shapes that web avatars are asked for. What each does follows from their documentation and
the Facial Action Coding System (Ekman, Friesen, Hager: FACS, 2002).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

from ..anatomy.atlas import split_names
from ..anatomy.face import Face
from ..errors import ParameterError, UnknownNameError, unknown_name
from .modeled import Movements

Side = Literal["l", "r"]

GAZE = 0.75
"""Contraction of the eye's muscles for a full look: 30 degrees, with which an avatar still looks at something."""


@dataclass(frozen=True)
class Shape:
    """The contractions and movements of a blend shape at weight 1.

    Attributes
    ----------
    units : mapping of str to float
        Action units or muscles, and their weights; of both sides.
    modeled : mapping of str to float
        Movements of :mod:`facewrinkle.rigging.modeled`, and their weights.
    side : {"l", "r"}, optional
        The side that it belongs to; the other half of the movement is the shape of the other side.
    beyond : str
        Name of a shape on top of which it is applied: it is what has to be added to that one.
    age : float
        Lines that old skin has at rest, in [0, 1], at weight 1.
    needs : tuple of str
        What the face must have: "mouth" (lips that open), "eyes" (lids that open), "tongue" (one that is ours).
    """

    units: Mapping[str, float] = field(default_factory=dict)
    modeled: Mapping[str, float] = field(default_factory=dict)
    side: Side | None = None
    beyond: str = ""
    age: float = 0.0
    needs: tuple[str, ...] = ()

    @property
    def movement(self) -> tuple[object, ...]:
        """The movement of both sides, alike for the shapes of a pair."""
        return tuple(sorted(self.units.items())), tuple(sorted(self.modeled.items())), self.beyond, self.age


def _pair(
    name: str, units: Mapping[str, float], needs: tuple[str, ...] = (), modeled: Mapping[str, float] | None = None
) -> dict[str, Shape]:
    """Return the shapes of both sides."""
    sides: tuple[tuple[str, Side], ...] = (("Left", "l"), ("Right", "r"))
    return {f"{name}{word}": Shape(units, modeled or {}, side, needs=needs) for word, side in sides}


EYES, MOUTH, LIPS = ("eyes",), ("mouth",), ("mouth", "lips")

ARKIT: Mapping[str, Shape] = MappingProxyType(
    {
        **_pair("browDown", {"AU4": 1.0}),
        "browInnerUp": Shape({"AU1": 1.0}),
        **_pair("browOuterUp", {"AU2": 1.0}),
        "cheekPuff": Shape(modeled={"puff": 1.0}),
        **_pair("cheekSquint", {"AU6": 1.0}),
        **_pair("eyeBlink", {"AU45": 1.0}, EYES),
        **_pair("eyeLookDown", {"rectus_inferior": GAZE}),
        **_pair("eyeLookIn", {"rectus_medialis": GAZE}, modeled={"lids_in": 1.0}),
        **_pair("eyeLookOut", {"rectus_lateralis": GAZE}, modeled={"lids_out": 1.0}),
        **_pair("eyeLookUp", {"rectus_superior": GAZE}),
        **_pair("eyeSquint", {"AU7": 1.0}, EYES),
        **_pair("eyeWide", {"AU5": 1.0}, EYES),
        "jawForward": Shape(modeled={"jaw_forward": 1.0}, needs=MOUTH),
        "jawLeft": Shape(modeled={"jaw_left": 1.0}, needs=MOUTH),
        "jawOpen": Shape({"AU27": 1.0}, needs=MOUTH),
        "jawRight": Shape(modeled={"jaw_right": 1.0}, needs=MOUTH),
        "mouthClose": Shape({"AU27": 1.0}, {"seal": 1.0}, beyond="jawOpen", needs=LIPS),
        **_pair("mouthDimple", {"AU14": 1.0}),
        **_pair("mouthFrown", {"AU15": 1.0}),
        "mouthFunnel": Shape({"AU22": 1.0}, needs=MOUTH),
        "mouthLeft": Shape(modeled={"mouth_left": 1.0}),
        **_pair("mouthLowerDown", {"AU16": 1.0}, MOUTH),
        **_pair("mouthPress", {"AU24": 1.0}, MOUTH),
        "mouthPucker": Shape({"AU18": 1.0}),
        "mouthRight": Shape(modeled={"mouth_right": 1.0}),
        "mouthRollLower": Shape(modeled={"roll_lower": 1.0}, needs=MOUTH),
        "mouthRollUpper": Shape(modeled={"roll_upper": 1.0}, needs=MOUTH),
        "mouthShrugLower": Shape({"AU17": 1.0}),
        "mouthShrugUpper": Shape(modeled={"lift_upper": 1.0}, needs=MOUTH),
        **_pair("mouthSmile", {"AU12": 1.0}),
        **_pair("mouthStretch", {"AU20": 1.0}),
        **_pair("mouthUpperUp", {"AU10": 1.0}, MOUTH),
        **_pair("noseSneer", {"AU9": 1.0}),
        "tongueOut": Shape({"AU19": 1.0}, needs=("mouth", "tongue")),
    }
)
"""The 52 shapes of ARKit."""

VISEMES: Mapping[str, Shape] = MappingProxyType(
    {
        "viseme_sil": Shape(),
        "viseme_PP": Shape({"AU24": 0.8, "AU28": 0.3}, needs=MOUTH),
        "viseme_FF": Shape({"AU28": 0.5, "AU10": 0.33, "AU27": 0.06}, needs=MOUTH),
        "viseme_TH": Shape({"AU27": 0.16, "AU16": 0.2, "AU20": 0.08}, needs=MOUTH),
        "viseme_DD": Shape({"AU27": 0.12, "AU16": 0.25, "AU10": 0.13, "AU20": 0.16}, needs=MOUTH),
        "viseme_kk": Shape({"AU27": 0.22, "AU16": 0.2, "AU20": 0.12}, needs=MOUTH),
        "viseme_CH": Shape({"AU22": 0.55, "AU27": 0.08}, needs=MOUTH),
        "viseme_SS": Shape({"AU27": 0.05, "AU16": 0.3, "AU10": 0.2, "AU20": 0.32}, needs=MOUTH),
        "viseme_nn": Shape({"AU27": 0.12, "AU16": 0.15, "AU20": 0.12}, needs=MOUTH),
        "viseme_RR": Shape({"AU22": 0.35, "AU27": 0.12}, needs=MOUTH),
        "viseme_aa": Shape({"AU27": 0.55, "AU16": 0.25, "AU10": 0.2}, needs=MOUTH),
        "viseme_E": Shape({"AU27": 0.25, "AU12": 0.25, "AU20": 0.24, "AU16": 0.25}, needs=MOUTH),
        "viseme_I": Shape({"AU27": 0.12, "AU12": 0.35, "AU20": 0.28, "AU16": 0.3, "AU10": 0.2}, needs=MOUTH),
        "viseme_O": Shape({"AU27": 0.35, "AU18": 0.52}, needs=MOUTH),
        "viseme_U": Shape({"AU27": 0.12, "AU18": 0.93}, needs=MOUTH),
    }
)
"""The 15 visemes; `viseme_sil` is the face at rest, which avatars have all the same."""

EXTRAS: Mapping[str, Shape] = MappingProxyType(
    {
        "mouthOpen": Shape({"AU27": 0.7}, needs=MOUTH),
        "mouthSmile": Shape({"AU12": 1.0}),
        "eyesClosed": Shape({"AU45": 1.0}, needs=EYES),
        "eyesLookUp": Shape({"rectus_superior": GAZE}),
        "eyesLookDown": Shape({"rectus_inferior": GAZE}),
        **_pair("browInnerUp", {"AU1": 1.0}),
        **_pair("browInward", {"corrugator": 1.0}),
    }
)
"""Further shapes that web avatars such as TalkingHead need, brows that rise by side, and brows that are drawn together.
"""

SETS: Mapping[str, Mapping[str, Shape]] = MappingProxyType({"arkit": ARKIT, "visemes": VISEMES, "extras": EXTRAS})
"""Sets of shapes by name; "aus" and "expressions" stand for those of a face's atlas."""


def shapes_of(asked: str, face: Face) -> tuple[dict[str, Shape], dict[str, str]]:
    """Return the shapes that a face can make of those asked for, and the reasons why others are left out, by name.

    Parameters
    ----------
    asked : str
        Sets joined by + or commas, such as "arkit+visemes"; single shapes may be named too.
    face : Face

    Raises
    ------
    UnknownNameError
        For a set or shape that does not exist.
    ParameterError
        If the face can make none of them.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> shapes, left_out = shapes_of("arkit", fw.default_face())
    >>> len(shapes), left_out
    (52, {})
    """
    wanted = [_named(word, face) for word in split_names(asked)]
    return _possible({name: shape for shapes in wanted for name, shape in shapes.items()}, face, {})


def shapes_named(names: Iterable[str], face: Face) -> tuple[dict[str, Shape], dict[str, str]]:
    """Return the shapes that a face can make of those with certain names, and the reasons why others are left out.

    Raises
    ------
    ParameterError
        If the face can make none of them.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> shapes, left_out = shapes_named(["AU12", "AU58"], fw.default_face())
    >>> list(shapes), left_out
    (['AU12'], {'AU58': 'no muscle does it'})
    """
    wanted: dict[str, Shape] = {}
    unknown: dict[str, str] = {}
    for name in names:
        try:
            wanted |= _named(name, face)
        except UnknownNameError:
            unknown[name] = "no muscle does it"
    return _possible(wanted, face, unknown)


def _possible(
    wanted: Mapping[str, Shape], face: Face, left_out: dict[str, str]
) -> tuple[dict[str, Shape], dict[str, str]]:
    """Return the shapes that a face can make, and the reasons why others are left out, after those given."""
    having = {"mouth": face.mouth_opens, "eyes": bool(face.eyelid_openings), "tongue": "tongue" not in face.parts}
    having["lips"] = having["mouth"] and len(Movements(face).pairs[0]) > 0
    lacks = {
        "mouth": "the lips of this mesh do not open",
        "lips": "the lips of this mesh do not meet at rest",
        "eyes": "the lids of this mesh do not open",
        "tongue": "the tongue that came with the mesh does not move",
    }
    possible: dict[str, Shape] = {}
    for name, shape in wanted.items():
        lacking = [need for need in shape.needs if not having[need]]
        unknown = [unit for unit in shape.units if not _known(unit, face)]
        if not face.landmarks:
            left_out[name] = "the mesh has no landmarks"
        elif lacking:
            left_out[name] = lacks[lacking[0]]
        elif unknown:
            left_out[name] = f"the face has no muscles for {unknown[0]}"
        else:
            possible[name] = shape
    if not possible:
        reasons = "; ".join(dict.fromkeys(left_out.values()))
        asked = "+".join({**wanted, **left_out})
        raise ParameterError(f"this face can make none of the shapes of {asked!r}: {reasons}. Fit a face with muscles.")
    return possible, left_out


def _known(unit: str, face: Face) -> bool:
    try:
        return set(face.atlas.resolve(unit)) <= set(face.muscles)
    except UnknownNameError:
        return False


def _named(word: str, face: Face) -> Mapping[str, Shape]:
    """Return the shapes of a set, or the one shape of that name."""
    if word == "aus":
        units = [unit for unit in face.atlas.action_units if unit[-1].isdigit()]
        return {unit: Shape({unit: 1.0}) for unit in units}
    if word == "age":
        return {word: Shape(age=1.0)}
    if word == "expressions":
        return {name: Shape({name: 1.0}) for name in face.atlas.expressions}
    if word in SETS:
        return SETS[word]
    every = {**ARKIT, **VISEMES, **EXTRAS}
    if word in every:
        return {word: every[word]}
    if word in face.atlas.action_units or word in face.atlas.expressions:
        return {word: Shape({word: 1.0})}
    raise unknown_name("set of shapes", word, [*SETS, "aus", "expressions", "age", *every])
