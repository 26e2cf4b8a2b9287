"""Parts of skins that depend on the face alone: skins of one face are alike, and most are made one after the other."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

from ..anatomy.face import Face

T = TypeVar("T")

_KEPT: WeakKeyDictionary[Face, dict[str, tuple[object, Any]]] = WeakKeyDictionary()


def kept(face: Face, what: str, key: object, make: Callable[[], T]) -> T:
    """Return what was made of a face last, by its name, if it was for an equal key; make it otherwise.

    It lives as long as the face, which it must not hold, and several skins share it: it is never to be changed.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> kept(face, "sum", 1, lambda: [0.5]) is kept(face, "sum", 1, lambda: [0.5])
    True
    >>> kept(face, "sum", 2, lambda: [0.7])
    [0.7]
    """
    parts = _KEPT.setdefault(face, {})
    found = parts.get(what)
    if found is None or found[0] != key:
        found = parts[what] = key, make()
    made: T = found[1]
    return made


def forget(face: Face) -> None:
    """Let the next skin of a face be made anew."""
    _KEPT.pop(face, None)
