"""The wishes of a document to a simulation: a face, layers, rates of muscles and tears."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..anatomy.face import Face
from ..geometry.smoothstep import smoothstep
from ..layers.base import Layer
from ..layers.patterns_on_skin.layer import PatternLayer
from ..layers.patterns_on_skin.presets import table
from ..layers.patterns_on_skin.region import check_size
from ..layers.wave_folds.amount import amounts
from ..simulation.fold_layers import fold_layers
from ..tears import Flow, Route, SheddingTear
from .document import REGIONS

MIDLINE = 0.15
"""Distance from the midline over which the amounts of the two sides blend, in distances between the pupils."""

EASE, EASED = 0.35, 2e-3
"""Share of the way to the rates asked for that muscles go in a step, and the rest that they take at once."""

TEAR_SPEED, TEAR_STAYS = 24.0, 1e6
"""Speed of a tear, mm/s, and the seconds for which it stays."""


def layers_of(data: Mapping[str, Any], face: Face) -> list[Layer]:
    """Return the layers of folds and patterns that a document asks for."""
    folds, amount = data["folds"], _amount_of(data, face)
    layers = fold_layers(
        face, "wave", folds["depth"], density=folds["density"], length=folds["length"],
        irregularity=folds["irregularity"], seed=int(folds["seed"]), age=max(folds["age"], face.age), amount=amount,
        pinch=folds["pinch"],
    )  # fmt: skip
    return layers + [pattern_layer(name, entry, face) for name, entry in data["patterns"].items()]


def _amount_of(data: Mapping[str, Any], face: Face) -> np.ndarray | None:
    """Return the factors (n0,) of the depth of waves, by side and region; None if all are 1."""
    left, right = data["folds"]["left"], data["folds"]["right"]
    regions = {name: factor for name, factor in data["regions"].items() if factor != 1.0}
    if left == right == 1.0 and not regions:
        return None
    aside = (face.points - face.frame.origin) @ face.frame.axes[0] / face.frame.pupil_distance
    amount = right + (left - right) * smoothstep(0.5 + 0.5 * aside / MIDLINE)
    for name, factor in regions.items():
        places = [place for place in REGIONS[name] if place in face.landmarks]
        away = amounts(dict.fromkeys(places, 0.0), face)
        if places and away is not None:
            amount = amount * (away + factor * (1.0 - away))
    return np.asarray(amount)


def pattern_layer(name: str, entry: Mapping[str, Any], face: Face) -> PatternLayer:
    """Return the pattern of an entry of a document."""
    return PatternLayer(entry["kind"], entry["centre"], name=name, **pattern_words(entry, face))


def pattern_words(entry: Mapping[str, Any], face: Face) -> dict[str, Any]:
    """Return the words of :class:`facewrinkle.PatternLayer` for an entry: it looks as the preset of its kind.

    The size of the entry is its width, mm; on the subject's right a pattern is mirrored.
    """
    preset, axes = table()[entry["kind"]], face.frame.axes
    right = bool((np.array(entry["centre"]) - face.frame.origin) @ axes[0] < 0.0)
    width, height = check_size(preset["size"])
    up = np.array(preset.get("up", [0.0, 1.0, 0.0])) * [-1.0 if right else 1.0, 1.0, 1.0] @ axes
    size = entry["size"] / face.unit
    return {
        "up": tuple(round(float(x), 6) for x in up),
        "size": (round(float(size), 6), round(float(size * height / width), 6)),
        "depth": entry["depth"],
        "strength": entry["strength"],
        "mirrored": right,
        **preset["parameters"],
    }


def tear_of(entry: Mapping[str, Any], face: Face) -> SheddingTear:
    """Return the tear of an entry of a document."""
    return SheddingTear(
        face, start=entry["start"], width=entry["width"], begin=0.0,
        flow=Flow(c=TEAR_SPEED, hold=TEAR_STAYS), route=Route(length=entry["length"]),
    )  # fmt: skip


def run_time(tear: SheddingTear) -> float:
    """Seconds until a tear has arrived."""
    return float(max(tear.length - tear.s, 0.0) / tear.c)


def eased(rates: Mapping[str, float], target: Mapping[str, float]) -> dict[str, float]:
    """Return rates nearer to a target.

    Examples
    --------
    >>> eased({"jaw": 0.0}, {"jaw": 1.0}), eased({"jaw": 0.001}, {})
    ({'jaw': 0.35}, {})
    """
    out = {}
    for name in [*rates, *(name for name in target if name not in rates)]:
        now, asked = rates.get(name, 0.0), target.get(name, 0.0)
        rate = asked if abs(asked - now) < EASED else now + EASE * (asked - now)
        if rate:
            out[name] = rate
    return out


def mixture_of(data: Mapping[str, Any], time: float | None = None) -> dict[str, float]:
    """Return the weights by name that a document asks for; with a time, those of its timeline go on top."""
    weights = {name: data["intensity"] * weight for name, weight in data["mixture"].items()}
    if time is not None:
        for key in data["timeline"]["keys"].values():
            weight = key["weight"] * envelope(time, key)
            weights[key["unit"]] = max(weights.get(key["unit"], 0.0), weight)
    return {name: weight for name, weight in weights.items() if weight > 0.0}


def envelope(time: float, key: Mapping[str, float]) -> float:
    """Return the share of an event at a time: 0 at its onset, 1 from apex to offset, and 0 again at its end.

    Examples
    --------
    >>> key = {"onset": 1.0, "apex": 2.0, "offset": 3.0, "end": 5.0}
    >>> [envelope(t, key) for t in (0.5, 1.5, 2.5, 4.0, 6.0)]
    [0.0, 0.5, 1.0, 0.5, 0.0]
    """
    if not key["onset"] <= time <= key["end"]:
        return 0.0
    rise = (time - key["onset"]) / (key["apex"] - key["onset"]) if time < key["apex"] else 1.0
    fall = (key["end"] - time) / (key["end"] - key["offset"]) if time > key["offset"] else 1.0
    return float(smoothstep(min(rise, fall)))


def rates_of(mixture: Mapping[str, float], face: Face) -> dict[str, float]:
    """Return contraction rates of muscles; those that the face does not have are left out."""
    return {name: rate for name, rate in face.atlas.contractions(mixture).items() if name in face.muscles}


def as_python(data: Mapping[str, Any], face: Face, source: str = "fw.default_face()") -> str:
    """Return a program that makes what a document shows.

    Examples
    --------
    >>> from facewrinkle.anatomy.fitting import default_face
    >>> from facewrinkle.live.document import START
    >>> print(as_python({**START, "mixture": {"AU12L": 0.5, "AU12R": 0.5}}, default_face()).splitlines()[4])
    sim.express({'AU12': 0.5})
    """
    folds = data["folds"]
    lines = ["import facewrinkle as fw", ""]
    person = {name: value for name, value in data["identity"].items() if value}
    lines.append(f"face = fw.default_face({person!r})" if person and not data["face"] else f"face = {source}")
    if data["landmarks"]:
        lines.insert(1, "from facewrinkle.anatomy.fitting import refitted")
        lines.append(f"face = refitted(face, {data['landmarks']!r})")
    regions = {name: factor for name, factor in data["regions"].items() if factor != 1.0}
    uneven = bool(folds["left"] != 1.0 or folds["right"] != 1.0 or regions)
    special = {
        name: int(value) if name == "seed" else value
        for name, value in folds.items()
        if name not in ("depth", "left", "right") and value != _USUAL_WAVES[name]
    }
    if not (data["patterns"] or uneven or special or folds["depth"] != 1.0):
        lines.append("sim = fw.Simulation(face)")
    else:
        if uneven:
            lines += [
                "from facewrinkle.geometry.smoothstep import smoothstep",
                "aside = (face.points - face.frame.origin) @ face.frame.axes[0] / face.frame.pupil_distance",
                f"amount = {folds['right']!r} + {round(folds['left'] - folds['right'], 6)!r} * "
                f"smoothstep(0.5 + {0.5 / MIDLINE!r} * aside)",
            ]
        if regions:
            lines.append("from facewrinkle.layers.wave_folds.amount import amounts")
        for name, factor in regions.items():
            lines.append(f"away = amounts(dict.fromkeys({REGIONS[name]!r}, 0.0), face)  # {name}")
            lines.append(f"amount = amount * (away + {factor!r} * (1.0 - away))")
        words = "".join(f", {name}={value!r}" for name, value in special.items()) + (
            ", amount=amount" if uneven else ""
        )
        leaning = f", pinch={folds['pinch']!r}" if folds["pinch"] else ""
        lines.append(f"layers = [fw.MuscleWrinkles(depth={folds['depth']!r}, anatomical=True{leaning}),")
        lines.append(f"          fw.WaveFolds({folds['depth']!r}{words})]")
        for name, entry in data["patterns"].items():
            lines += [
                f"layers.append(fw.PatternLayer({entry['kind']!r}, {entry['centre']!r}, name={name!r},",
                f"              **{pattern_words(entry, face)!r}))",
            ]
        lines.append("sim = fw.Simulation(face, layers=layers)")
    lines.append(f"sim.express({_joined(mixture_of(data))!r})")
    if any(data["gaze"]):
        lines.append(f"sim.look(yaw={data['gaze'][0]!r}, pitch={data['gaze'][1]!r})")
    lines.append("frame = sim.settle()")
    for entry in data["tears"].values():
        lines += [
            "from facewrinkle.tears import Flow, Route",
            f"tear = fw.SheddingTear(face, start={entry['start']!r}, width={entry['width']!r},",
            f"                       flow=Flow(c={TEAR_SPEED!r}, hold=60.0), route=Route(length={entry['length']!r}))",
        ]
    imports = [line for line in lines if line.startswith(("import ", "from "))]
    rest = [line for line in lines if line not in imports]
    return "\n".join([*dict.fromkeys(imports), *rest]) + "\n"


_USUAL_WAVES = {"density": 1.0, "length": 1.0, "irregularity": 1.0, "seed": 0, "age": 0.0, "pinch": 0.0}


def as_command(data: Mapping[str, Any], face: str | None = None) -> tuple[str, list[str]]:
    """Return a command line that makes what a document shows, and what it cannot say.

    Examples
    --------
    >>> from facewrinkle.live.document import START
    >>> as_command({**START, "mixture": {"AU12": 0.5}})[0]
    'facewrinkle express AU12=0.5'
    """
    mixture, folds = _joined(mixture_of(data)), data["folds"]
    words = ["facewrinkle express", ",".join(f"{name}={weight:g}" for name, weight in mixture.items()) or "AU12=0"]
    if face:
        words.append(f"--face {_quoted(face)}")
    person = {name: value for name, value in data["identity"].items() if value}
    if person:
        words.append("--identity " + ",".join(f"{name}={value:g}" for name, value in person.items()))
    for name in ("depth", "density", "length", "seed", "age", "pinch"):
        if folds[name] != {**_USUAL_WAVES, "depth": 1.0}[name]:
            words.append(f"--{name} {folds[name]:g}")
    missing = [what for what in ("landmarks", "patterns", "tears") if data[what]]
    missing += ["timeline"] if data["timeline"]["keys"] else []
    missing += ["gaze"] if any(data["gaze"]) else []
    missing += ["amounts of the sides"] if folds["left"] != folds["right"] else []
    missing += ["amounts of regions"] if any(factor != 1.0 for factor in data["regions"].values()) else []
    missing += ["irregularity"] if folds["irregularity"] != 1.0 else []
    return " ".join(words), missing


def _quoted(path: str) -> str:
    return (
        path
        if path.replace("/", "").replace(".", "").replace("_", "").isalnum()
        else "'" + path.replace("'", "'\\''") + "'"
    )


def _joined(mixture: Mapping[str, float]) -> dict[str, float]:
    """Return a mixture with both sides of a unit or muscle under one name where their weights are equal."""
    out: dict[str, float] = {}
    for name, weight in mixture.items():
        for left, right in (("L", "R"), ("_l", "_r")):
            stem, own, other = name[: -len(left)], name.endswith(left), name[: -len(left)] + right
            if own and mixture.get(other) == weight:
                out[stem] = round(weight, 6)
                break
            if name.endswith(right) and mixture.get(name[: -len(right)] + left) == weight:
                break
        else:
            out[name] = round(weight, 6)
    return out
