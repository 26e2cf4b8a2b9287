"""Plans of samples, drawn from a specification: numbers and words, without a mesh."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from ..anatomy import Identity, load_atlas
from .spec import Expressions, Spec


@dataclass(frozen=True)
class Person:
    """Who is seen on a sample.

    Attributes
    ----------
    number : int
    scan : int or None
        Number of the scan; None is the built-in head.
    monk : int or None
        Tone of the built-in head's skin on the Monk Skin Tone Scale, from 1 to 10.
    identity : dict of str to float
        Of the built-in head, see :class:`facewrinkle.Identity`; for a scan only its age.
    folds : dict of str to float
        Parameters of :class:`facewrinkle.WaveFolds`.
    """

    number: int
    scan: int | None
    monk: int | None
    identity: dict[str, float]
    folds: dict[str, float]


@dataclass(frozen=True)
class Plan:
    """Content of a sample, without a mesh.

    Attributes
    ----------
    index, person : int
    attempt : int
        How many draws before this one were no good.
    expression : dict of str to float
        Action units or expressions, and how much of each.
    gaze, camera, lights, background : dict of str to float
        As in the specification; with one's own files, also the numbers of the environment and of the picture, and
        which part of the latter is seen.
    tears : float or None
        Seconds since the tears began; None for dry eyes.
    """

    index: int
    person: int
    attempt: int
    expression: dict[str, float]
    gaze: dict[str, float]
    camera: dict[str, float]
    lights: dict[str, float]
    background: dict[str, float]
    tears: float | None


def person_at(spec: Spec, index: int) -> int:
    """Return the number of the person on a sample: the persons of a shard take turns.

    Examples
    --------
    >>> [person_at(Spec.of({"shard": 6, "per_person": 2}), index) for index in range(8)]
    [0, 1, 2, 0, 1, 2, 3, 4]
    """
    samples, people = _group(spec)
    return index // samples * people + index % samples % people


def first_sample_of(spec: Spec, number: int) -> int:
    """Return the number of the first sample that shows a person.

    Examples
    --------
    >>> [first_sample_of(Spec.of({"shard": 6, "per_person": 2}), number) for number in range(4)]
    [0, 1, 2, 6]
    """
    samples, people = _group(spec)
    return number // people * samples + number % people


def _group(spec: Spec) -> tuple[int, int]:
    """The number of samples within which persons take turns, and the number of these persons."""
    samples = max(spec.shard, spec.per_person)
    return samples, -(-samples // spec.per_person)


def person_of(spec: Spec, number: int) -> Person:
    """Draw a person.

    Examples
    --------
    >>> person_of(Spec.of(), 3) == person_of(Spec.of(), 3)
    True
    """
    random = spec.random(number, "face")
    weights = np.array([spec.faces.built_in, *(scan.weight for scan in spec.faces.scans)])
    chosen = int(random.choice(len(weights), p=weights / weights.sum()))
    somebody = Identity(**spec.drawn("identity", spec.random(number, "identity"))).plausible()
    identity = {"age": somebody.age} if chosen else asdict(somebody)
    folds = spec.drawn("folds", spec.random(number, "folds"))
    folds["seed"] = int(folds["seed"])
    scan, monk = (chosen - 1, None) if chosen else (None, somebody.monk)
    return Person(number, scan, monk, identity, folds)


def plan_of(spec: Spec, index: int, attempt: int = 0) -> Plan:
    """Draw what is seen on a sample; another attempt is another draw.

    Examples
    --------
    >>> plan = plan_of(Spec.of(), 11)
    >>> plan.person, plan == plan_of(Spec.of(), 11), plan == plan_of(Spec.of(), 11, attempt=1)
    (1, True, False)
    """

    def random(what: str) -> np.random.Generator:
        return spec.random(index, what, attempt)

    crying = random("crying")
    cries = crying.uniform() < spec.crying
    time = spec.drawn("tears", crying)["time"]
    lights, background = spec.drawn("lights", random("lights")), spec.drawn("background", random("background"))
    if spec.environments:
        lights["environment"] = int(random("environment").integers(len(spec.environments)))
    if spec.backgrounds:
        chosen = random("picture")
        background["picture"] = int(chosen.integers(len(spec.backgrounds)))
        background |= {"across": float(chosen.uniform()), "down": float(chosen.uniform())}
    return Plan(
        index=index,
        person=person_at(spec, index),
        attempt=attempt,
        expression=expression_of(spec.expression, random("expression")),
        gaze=spec.drawn("gaze", random("gaze")),
        camera=spec.drawn("camera", random("camera")),
        lights=lights,
        background=background,
        tears=time if cries else None,
    )


def expression_of(expressions: Expressions, random: np.random.Generator) -> dict[str, float]:
    """Draw an expression: none, a named one, or action units with those that come with them.

    Examples
    --------
    >>> drawn = [expression_of(Spec.of().expression, np.random.default_rng(k)) for k in range(200)]
    >>> any({"AU2", "AU4"} <= set(units) for units in drawn), max(map(len, drawn)) > 3
    (False, True)
    """
    kind = random.uniform()
    if kind < expressions.neutral:
        return {}
    if kind < expressions.neutral + expressions.named:
        return {expressions.names.draw(random): expressions.intensity.draw(random)}
    units: list[str] = []
    for unit in random.permutation(expressions.units).tolist():
        if len(units) >= round(expressions.count.draw(random)):
            break
        _join(units, unit, expressions)
    for first, second, share in expressions.together:
        if first in units and random.uniform() < share:
            _join(units, second, expressions)
    atlas, found = load_atlas(), {}
    for unit in units:
        aside = random.uniform() < expressions.one_sided and f"{unit}L" in atlas.action_units
        side = ("L", "R")[int(random.integers(2))] if aside else ""
        found[unit + side] = expressions.contraction.draw(random)
    return found


def _join(units: list[str], unit: str, expressions: Expressions) -> None:
    """Add an action unit to others, unless it is there or does not go with one of them."""
    if unit not in units and not any(unit in pair and {*pair} & {*units} for pair in expressions.apart):
        units.append(unit)
