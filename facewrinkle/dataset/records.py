"""What is told of a picture, with the same names and types for every picture, as readers of tables and of JSON need it.

Nothing is null or left out: what a picture does not have is 0, "" or, of times and places, -1.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from ..anatomy.atlas import load_atlas
from ..anatomy.identity import Identity
from ..anatomy.landmarks import NAMES, NOT_ON_SKIN

HIDDEN = {"point": [0.0, 0.0, 0.0], "pixel": [-1.0, -1.0], "visible": False}
"""A landmark that a face does not have."""

NO_FURROW = {"number": 0, "source": "", "depth": 0.0, "length": 0.0, "pixels": 0, "box": [0, 0, 0, 0]}
"""What the label 0 stands for: furrows are listed from it on."""


def record_of(facts: dict[str, Any]) -> dict[str, Any]:
    """Return the facts of a picture as its JSON has them.

    Examples
    --------
    >>> from facewrinkle.dataset import SampleMaker, Spec
    >>> with SampleMaker(Spec.of({"size": [32, 32]})) as maker:
    ...     record = record_of(maker.sample(0).facts)
    >>> record["person"]["scan"], record["person"]["monk"], len(record["action_units"])
    ('', 9, 73)
    """
    atlas, plan, person, files = load_atlas(), facts["plan"], facts["person"], facts["files"]
    names = [name for name in NAMES if name not in NOT_ON_SKIN]
    absent = dict.fromkeys((field.name for field in fields(Identity)), 0.0)
    return facts | {
        "plan": plan | {"expression": mixture_text(plan["expression"]), "tears": _or(plan["tears"], -1.0)},
        "person": person | {"monk": _or(person["monk"], 0), "identity": absent | person["identity"]}
        | {"scan": files.get("scan", "")},
        "files": {name: files.get(name, "") for name in ("scan", "environment", "background")},
        "refused": "; ".join(facts["refused"]),
        "contractions": dict.fromkeys(atlas.muscles, 0.0) | facts["contractions"],
        "action_units": dict.fromkeys(atlas.action_units, 0.0) | facts["action_units"],
        "landmarks": dict.fromkeys(names, HIDDEN) | facts["landmarks"],
        "furrows": [NO_FURROW, *(furrow | {"box": furrow["box"] or NO_FURROW["box"]} for furrow in facts["furrows"])],
    }  # fmt: skip


def row_of(facts: dict[str, Any], key: str) -> dict[str, Any]:
    """Return what the table tells of a picture: numbers to search and to plot by."""
    record = record_of(facts)
    plan, person, furrows = record["plan"], record["person"], facts["furrows"]
    row = {
        "index": plan["index"],
        "key": key,
        "person": person["number"],
        "frame": record.get("frame", 0),
        "scan": person["scan"],
        "monk": person["monk"],
        "expression": plan["expression"],
        "tears": plan["tears"] >= 0.0,
        "attempt": plan["attempt"],
        "furrows": len(furrows),
        "deepest": max((furrow["depth"] for furrow in furrows), default=0.0),
        "visible_landmarks": sum(landmark["visible"] for landmark in record["landmarks"].values()),
    }
    row |= {f"{what}_file": record["files"][what] for what in ("environment", "background")}
    drawn = {"identity": person["identity"], "gaze": plan["gaze"], "camera": plan["camera"], "light": plan["lights"]}
    row |= {f"{group}_{name}": value for group, values in drawn.items() for name, value in values.items()}
    return row | record["action_units"]


def mixture_text(mixture: dict[str, float]) -> str:
    """Return a mixture of expressions or action units as text.

    Examples
    --------
    >>> mixture_text({"AU9": 0.2085, "AU15": 1.0}), mixture_text({})
    ('AU9=0.2085+AU15=1', '')
    """
    return "+".join(f"{name}={weight:.6g}" for name, weight in mixture.items())


def _or(value: Any, absent: Any) -> Any:
    return absent if value is None else value
