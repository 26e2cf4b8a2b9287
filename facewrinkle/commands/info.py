"""``facewrinkle info``: what there is to contract."""

from __future__ import annotations

from typing import Literal

from rich.table import Table

from ..anatomy.atlas import Atlas, load_atlas
from .common import Report

Topic = Literal["muscles", "action-units", "expressions"]


def info(topic: Topic | None = None) -> None:
    """List the muscles, action units and expressions.

    Parameters
    ----------
    topic
        Only these. Default: all three.
    """
    tables = {"muscles": _muscles, "action-units": _action_units, "expressions": _expressions}
    report = Report(quiet=False)
    for name, table in tables.items():
        if topic in (None, name):
            report.say(table(load_atlas()))


def _muscles(atlas: Atlas) -> Table:
    table = _table("Muscles", "name", "kind", "sides", "furrows", "depth (mm)")
    for full, entry in atlas.muscles.items():
        paired = entry.get("paired", True)
        if not paired or full.endswith("_l"):
            wrinkles = entry.get("folds", entry).get("wrinkles", {})
            name = full.removesuffix("_l") if paired else full
            sides = "_l, _r" if paired else "one"
            table.add_row(name, entry["kind"], sides, str(wrinkles.get("count", "")), str(wrinkles.get("depth", "")))
    return table


def _action_units(atlas: Atlas) -> Table:
    table = _table("Action units", "unit", "what", "muscles")
    for unit, what in atlas.action_unit_names.items():
        table.add_row(unit, what, _listed(atlas.action_units[unit]))
    return table


def _expressions(atlas: Atlas) -> Table:
    table = _table("Expressions", "name", "muscles")
    for name, rates in atlas.expressions.items():
        table.add_row(name, _listed(rates))
    return table


def _table(title: str, *columns: str) -> Table:
    table = Table(*columns, title=title, title_justify="left", title_style="bold", box=None, header_style="dim")
    table.title = f"\n{title}"
    return table


def _listed(rates: dict[str, float]) -> str:
    """Muscles with their rates; pairs that do the same under one name."""
    names = []
    for muscle, rate in rates.items():
        stem, side = muscle[:-2], muscle[-2:]
        alike = rates.get(stem + {"_l": "_r", "_r": "_l"}.get(side, "")) == rate
        if side == "_r" and alike:
            continue
        names.append((stem if alike and side == "_l" else muscle) + ("" if rate == 1.0 else f" {rate:g}"))
    return ", ".join(names)
