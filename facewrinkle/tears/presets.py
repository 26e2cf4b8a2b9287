"""Presets: several tears that belong together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import Any

import numpy as np
import pyvista as pv

from ..anatomy import Face
from ..errors import ParameterError, check_name, check_whole, type_of
from .drop import DrippingTear, DropShape, Fall
from .stream import Film, Flow, Route, SheddingTear
from .support_surface import lid_point

Tear = DrippingTear | SheddingTear


def grouped(options: Mapping[str, Any], **groups: type) -> dict[str, Any]:
    """Return keywords of a tear, from a flat list of them and of the fields of its groups.

    Parameters
    ----------
    options : mapping
    **groups : dataclass
        Classes of the groups, by the keyword that takes each.

    Examples
    --------
    >>> from facewrinkle.tears import Film, Flow
    >>> found = grouped({"width": 2.0, "c": 25.0, "roughness": 0.1, "trail": 0.5}, film=Film, flow=Flow)
    >>> found["width"], found["film"].roughness, found["film"].trail, found["flow"].c
    (2.0, 0.1, 0.5, 25.0)
    """
    keywords = dict(options)
    for group, kind in groups.items():
        own = {field.name: keywords.pop(field.name) for field in fields(kind) if field.name in keywords}
        if own:
            keywords[group] = replace(keywords.get(group) or kind(), **own)
    return keywords


@dataclass(frozen=True)
class Run:
    """One tear of a preset.

    Attributes
    ----------
    side : {"l", "r"}
    along : float
        Position on the lower lid, from the inner (0) to the outer (1) corner.
    drips : bool
        True if it drips, False if it is shed.
    options : mapping
        Of :class:`DrippingTear` or :class:`SheddingTear` and, by their own names, of their groups.
    """

    side: str
    along: float
    drips: bool = False
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Preset:
    """A way to cry: the tears, and the expression that goes with them.

    Examples
    --------
    The expression to be played on the face, the number of tears, and the place on the lids of the first:

    >>> weeping = PRESETS["weeping"]
    >>> weeping.expression, len(weeping.runs), weeping.runs[0].side, weeping.runs[0].along
    ('sadness', 6, 'l', 0.35)
    """

    expression: str
    runs: Sequence[Run]


def _shed(side: str, along: float, **options: Any) -> Run:
    return Run(side, along, False, {"hold": 60.0, **options})


PRESETS: Mapping[str, Preset] = MappingProxyType(
    {
        "one_tear": Preset("sadness", [_shed("l", 0.4, c=22.0, width=3.8)]),
        "weeping": Preset(
            "sadness",
            [
                _shed("l", 0.35, c=30.0, width=4.0),
                _shed("r", 0.4, c=26.0, width=3.8, begin=0.5),
                _shed("r", 0.7, c=34.0, width=3.1, begin=1.6),
                _shed("l", 0.72, c=38.0, width=3.3, begin=2.2),
                Run("r", 0.5, True, {"size": 3.4, "begin": 1.2}),
                Run("l", 0.55, True, {"size": 3.0, "begin": 2.6}),
            ],
        ),
        "joy": Preset(
            "happiness",
            [
                _shed("l", 0.86, c=18.0, width=3.2, length=45.0),
                _shed("r", 0.82, c=20.0, width=3.0, length=38.0, begin=0.4),
            ],
        ),
        "dripping": Preset(
            "sadness",
            [
                Run("l", 0.45, True, {"size": 3.4}),
                Run("r", 0.5, True, {"size": 3.2, "begin": 0.5}),
                Run("l", 0.5, True, {"size": 3.0, "begin": 1.1}),
                Run("r", 0.42, True, {"size": 3.5, "begin": 1.6}),
            ],
        ),
        "shedding": Preset("sadness", [_shed("l", 0.5), _shed("r", 0.45, begin=0.4)]),
    }
)
"""Tears of joy, weeping, one tear; and the paper's two kinds, from both eyes."""


def preset(name: str, face: Face, *, seed: int = 0, **options: Any) -> list[Tear]:
    """Return the tears of a preset on a face, a little different for each seed.

    Parameters
    ----------
    name : str
        One of :data:`PRESETS`.
    face : Face
    seed : int
    **options
        For all its tears, in place of the preset's own: of :class:`DrippingTear` if they all drip, otherwise of
        :class:`SheddingTear` (tears that drip are left as they are). Options of their groups are given by their own
        names, such as ``c=20.0`` or ``roughness=0.5``.

    Raises
    ------
    UnknownNameError
        For another name.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> tears = preset("one_tear", fw.default_face())
    >>> len(tears), tears[0].begin
    (1, 0.0)
    """
    check_name("preset of tears", name, PRESETS)
    if not isinstance(face, Face):
        raise ParameterError(
            f"a preset needs a Face, such as default_face() or fit_face() gives, received {type_of(face)}."
        )
    random = np.random.default_rng(check_whole("seed", seed, 0, 2**63))
    runs = PRESETS[name].runs
    all_drip = all(run.drips for run in runs)
    tears: list[Tear] = []
    for run in runs:
        along = float(np.clip(run.along + random.uniform(-0.06, 0.06), 0.0, 1.0))
        start, larger = lid_point(face, run.side, along), random.uniform(0.92, 1.08)
        given = {**run.options, **(options if run.drips == all_drip else {})}
        if run.drips:
            tears.append(dripping(face, start, {**given, "size": larger * given.get("size", 3.0)}))
        else:
            given = {**given, "width": larger * given.get("width", 3.0), "seed": int(random.integers(2**31))}
            tear = shedding(face, start, given)
            met = next((other for other in tears if isinstance(other, SheddingTear) and tear.meets(other)), None)
            tears.append(tear if met is None else shedding(face, start, {**given, "into": met}))
    return tears


def dripping(face: Face, start: Any, options: Mapping[str, Any]) -> DrippingTear:
    """Return a tear that drips from a place, given options as those of a :class:`Run`."""
    return DrippingTear(face, start, **grouped(options, shape=DropShape, fall=Fall))


def shedding(face: Face, start: Any, options: Mapping[str, Any]) -> SheddingTear:
    """Return a tear that runs down from a place, given options as those of a :class:`Run`."""
    return SheddingTear(face, start=start, **grouped(options, film=Film, flow=Flow, route=Route))


def surfaces(tears: Iterable[Tear], t: float, on: pv.PolyData | None = None) -> list[pv.PolyData]:
    """Return the surfaces of the tears that there are at time t.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> [len(surfaces(preset("weeping", face), t)) for t in (0.0, 3.0)]
    [1, 5]
    """
    return [tear.surface(t, on) for tear in tears if tear.begin <= t <= tear.end]
