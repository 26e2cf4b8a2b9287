"""Parts of skins that are kept with their face: skins of one face are alike, and most are made one after the other.

A part is made anew as soon as anything has changed that skins read of a face: its tables of muscles and landmarks, for
one, can be edited in place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt
from scipy.sparse import sparray

from ..anatomy.face import Face
from ..mesh.keeping import digest

T = TypeVar("T")

LARGEST = 100_000_000
"""Bytes of the largest part that is kept: the factors of a whole scan take gigabytes, and a face would hold them long
after its skins are gone.
"""

_KEPT: WeakKeyDictionary[Face, dict[str, tuple[object, object, Any]]] = WeakKeyDictionary()


def kept(face: Face, what: str, key: object, make: Callable[[], T]) -> T:
    """Return what was made of a face last, by its name, if it was for an equal key; make it otherwise.

    It lives as long as the face, which it must not hold. Several skins share it: its arrays are made read-only. It is
    made anew for a face that has changed; see :func:`content`. Muscles and weights of joints never change themselves,
    but others may have taken their place. What a face finds once, as those weights, is as it was found.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> kept(face, "sum", 1, lambda: [0.5]) is kept(face, "sum", 1, lambda: [0.5])
    True
    >>> kept(face, "sum", 2, lambda: [0.7])
    [0.7]
    """
    own, weights = content(face), face.joint_weights
    objects = (*face.muscles.values(), *weights.values(), face.frame)  # held: their ids are not given to others
    whole_key = own, tuple(face.muscles), tuple(weights), tuple(map(id, objects)), key
    parts = _KEPT.setdefault(face, {})
    found = parts.get(what)
    if found is None or own is None or found[0] != whole_key:
        parts.pop(what, None)
        part = read_only(make())
        if sum(array.nbytes for array in _arrays(part)) > LARGEST:
            return part
        found = parts[what] = whole_key, objects, part
    made: T = found[2]
    return made


def forget(face: Face) -> None:
    """Let the next skin of a face be made anew."""
    _KEPT.pop(face, None)


def content(face: Face) -> str | None:
    """Return a digest of the mesh, landmarks, eyes, tissue and unit of a face; None if something in it is of no known
    kind.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> content(fw.default_face()) == content(fw.default_face())
    True
    """
    return digest([face.points, face.triangles, face.landmarks, list(face.eyes), face.tissue, float(face.unit)])


def read_only(part: T) -> T:
    """Return a part all of whose arrays were made read-only.

    Examples
    --------
    >>> read_only([np.zeros(3)])[0].flags.writeable
    False
    """
    for array in _arrays(part):
        array.setflags(write=False)
    return part


def _arrays(part: object) -> Iterator[npt.NDArray[Any]]:
    """The arrays of a part: of its items, of its attributes, and of sparse ones."""
    if isinstance(part, np.ndarray):
        yield part
    elif isinstance(part, list | tuple):
        for each in part:
            yield from _arrays(each)
    elif isinstance(part, sparray) or type(part).__module__.partition(".")[0] == __package__.partition(".")[0]:
        for each in vars(part).values():
            yield from _arrays(each)
