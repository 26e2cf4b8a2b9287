"""The parts of a session: what each may hold. Lengths are in mm, times in seconds, places on the face at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, get_args

import numpy as np

from ..anatomy.face import Face
from ..array_types import Array, IntArray
from ..errors import ParameterError
from ..geometry.interpolation import closest
from ..schemas import Limits, Share, kinds_of

LONGEST = 600.0
"""Seconds of a timeline at most."""

Name = Annotated[str, Limits(most=64)]
OwnName = Annotated[str, Limits(1, 40)]
Factor = Annotated[float, Limits(0.0, 4.0)]
Angle = Annotated[float, Limits(-40.0, 40.0)]
Time = Annotated[float, Limits(0.0, LONGEST)]
Coordinate = Annotated[float, Limits(-1e9, 1e9)]
Point = tuple[Coordinate, Coordinate, Coordinate]
Camera = tuple[Coordinate, Coordinate, Coordinate, Coordinate, Coordinate, Coordinate]
Mixture = Annotated[dict[Name, Share], Limits(most=512)]


@dataclass(frozen=True)
class Place:
    """A place on the skin at rest, by which it stays where it is on another person with the same triangles.

    Attributes
    ----------
    triangle : int
    shares : tuple of float
        Barycentric coordinates in the triangle.
    offset : tuple of float
        From there, in the coordinates of the mesh.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> place = Place.of(face.landmarks["nose_tip"], face.points, face.triangles)
    >>> bool(np.allclose(place.on(face), face.landmarks["nose_tip"]))
    True
    """

    triangle: Annotated[int, Limits(0, 2**31)]
    shares: tuple[Share, Share, Share]
    offset: Point = (0.0, 0.0, 0.0)

    @classmethod
    def of(cls, point: Sequence[float] | Array, points: Array, triangles: IntArray) -> Place:
        """Return the place of a point on a surface, or near it."""
        triangle, shares, _ = closest(points, triangles, np.array(point, np.float64))
        offset = np.round(point - shares @ points[triangles[triangle]], 6) + 0.0
        return cls(int(triangle), tuple(np.clip(shares, 0.0, 1.0).tolist()), tuple(offset.tolist()))

    def on(self, face: Face) -> list[float]:
        """Return the point on a face."""
        if self.triangle >= len(face.triangles):
            raise ParameterError(
                f"a place of the session is on triangle {self.triangle}, and the face has {len(face.triangles)}: it "
                "was made on another face. Give its coordinates on this one."
            )
        point: list[float] = (np.array(self.shares) @ face.points[face.triangles[self.triangle]] + self.offset).tolist()
        return point


Anywhere = Place | Point
"""A place on the skin, or coordinates on the face at rest."""


def point_of(place: Anywhere, face: Face) -> list[float]:
    """Return the point of a place on a face."""
    return place.on(face) if isinstance(place, Place) else list(place)


@dataclass(frozen=True)
class Folds:
    """Folds of the skin: factors of their depth, also by side, and what waves are made of.

    Attributes
    ----------
    depth, left, right : float
        Factors from 0 to 4: of all, and of the subject's sides.
    density, length, irregularity : float
        Factors of the number of lines, of their length, and of what makes them differ.
    seed : int
        Each number gives another person's lines.
    age : float
        Lines at rest, from 0 to 1.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> fw.Session(folds=Folds(left=2.0, seed=3)).folds.left
    2.0
    """

    depth: Factor = 1.0
    left: Factor = 1.0
    right: Factor = 1.0
    density: Annotated[float, Limits(0.25, 4.0)] = 1.0
    length: Annotated[float, Limits(0.5, 2.0)] = 1.0
    irregularity: Annotated[float, Limits(0.0, 3.0)] = 1.0
    seed: Annotated[int, Limits(0, 2**31)] = 0
    age: Share = 0.0


@dataclass(frozen=True)
class Pattern:
    """A pattern on the skin.

    Attributes
    ----------
    kind : str
        A kind of pattern, such as ``"dimple"``.
    center : Place, or three numbers
    size, depth : float
        Width and depth, mm.
    strength : float

    Examples
    --------
    >>> import facewrinkle as fw
    >>> dimple = Pattern("dimple", center=(38.8, -30.8, 95.0), size=10.0, depth=2.0)
    >>> bool(fw.Session(patterns={"dimple": dimple}).frame()["W"].min() < -1.0)
    True
    """

    kind: Name
    center: Anywhere
    size: Annotated[float, Limits(2.0, 120.0)]
    depth: Annotated[float, Limits(-6.0, 6.0)]
    strength: Share = 1.0


@dataclass(frozen=True)
class Tear:
    """A tear.

    Attributes
    ----------
    start : Place, or three numbers
    width, length : float
        Of the drop, and of its way, mm.
    begin : float
        When it begins, s.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> start = fw.default_face().points[200]
    >>> list(fw.Session(tears={"first": Tear(start.tolist())}).tears)
    ['first']
    """

    start: Anywhere
    width: Annotated[float, Limits(0.6, 6.0)] = 2.6
    length: Annotated[float, Limits(5.0, 120.0)] = 60.0
    begin: Annotated[float, Limits(0.0, 60.0)] = 0.0


@dataclass(frozen=True)
class Key:
    """An event of the timeline: it grows from onset to apex, and fades from offset to end, s.

    Attributes
    ----------
    unit : str
        An expression, action unit or muscle.
    weight : float
        From 0 to 1.
    onset, apex, offset, end : float

    Examples
    --------
    >>> Key("AU12", 0.8, onset=0.0, apex=0.5, offset=1.0, end=1.5).weight
    0.8
    """

    unit: Name
    weight: Share
    onset: Time
    apex: Time
    offset: Time
    end: Time

    def __post_init__(self) -> None:
        if not self.onset <= self.apex <= self.offset <= self.end:
            raise ParameterError("the times of a key must follow each other: onset, apex, offset, end.")


@dataclass(frozen=True)
class Timeline:
    """Events in time.

    Attributes
    ----------
    length : float
        s.
    loop : bool
        Begin again at the end.
    keys : dict of str to Key

    Examples
    --------
    >>> import facewrinkle as fw
    >>> smile = Key("AU12", 0.8, onset=0.0, apex=0.5, offset=1.0, end=1.5)
    >>> session = fw.Session(timeline=Timeline(length=1.5, keys={"smile": smile}), time=0.6)
    >>> "{'AU12': 0.8}" in session.as_python()
    True
    """

    length: Annotated[float, Limits(0.2, LONGEST)] = 4.0
    loop: bool = True
    keys: Annotated[dict[Name, Key], Limits(most=256)] = field(default_factory=dict)


@dataclass(frozen=True)
class Look:
    """How pictures and movies show the face.

    Attributes
    ----------
    view : str, or six numbers
        The name of a view in :data:`facewrinkle.plotting.VIEWS`; or an upright camera, its position and the point
        that it looks at.
    size : tuple of int
        Width and height, pixels.
    field : str
        An array of the frame that colors the skin; "" for the skin itself.
    muscles : bool
        Show the fibers of muscles.
    clay : bool
        Show the face as clay.
    fps : float
        Pictures of a movie in a second.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> fw.Session(look=Look(view="mouth", size=(64, 48))).picture().shape
    (48, 64, 3)
    """

    view: Name | Camera = "front"
    size: tuple[Annotated[int, Limits(16, 8192)], Annotated[int, Limits(16, 8192)]] = (1200, 1200)
    field: Name = ""
    muscles: bool = False
    clay: bool = False
    fps: Annotated[float, Limits(1.0, 100.0)] = 25.0


def ranges(kind: type) -> dict[str, tuple[float, float]]:
    """Return the ranges of the numbers of a pattern, a tear or of folds.

    Examples
    --------
    >>> ranges(Tear)["width"]
    (0.6, 6.0)
    """
    numbers = [(name, get_args(of)) for name, of in kinds_of(kind).items()]
    return {name: (limits[0].least, limits[0].most) for name, (of, *limits) in numbers if of is float and limits}
