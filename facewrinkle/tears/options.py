"""Options of a tear as one flat list, for code that passes them on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any


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
