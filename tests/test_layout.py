"""The layout of the package: rooms stand on floors, and imports run downwards only.

every import (also inside functions, and for type checking) | floors below, by a table
the graph of all modules                                    | no circle, by its strongly connected components
the top level                                               | what users name, and nothing else
the rooms that docs/architecture.rst and CONTRIBUTING.md list | the same table
"""

import ast
import re
from functools import cache
from pathlib import Path

import mypy.api
import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

import facewrinkle as fw

PACKAGE = Path(__file__).parents[1] / "facewrinkle"

FLOORS = (
    ("array_types", "errors", "examples"),
    ("checks", "files", "progress", "schemas"),
    ("geometry",),
    ("mesh",),
    ("anatomy",),
    ("motion", "layers", "tears", "appearance"),
    ("animation",),
    ("simulation",),
    ("plotting", "export", "accessor"),
    ("dataset", "rigging"),
    ("session",),
    ("live",),
    ("commands",),
    ("cli",),
    ("__main__",),
)
"""From the ground up; rooms on one floor do not know each other."""

FLOOR = {room: number for number, rooms in enumerate(FLOORS) for room in rooms}


def modules() -> dict[str, Path]:
    """The file of each module by its dotted name within the package; a package is its __init__."""
    found = {}
    for path in sorted(path for path in PACKAGE.rglob("*.py") if "data" not in path.parts):  # what runs in Blender
        name = ".".join(path.relative_to(PACKAGE).with_suffix("").parts)
        found[name.removesuffix("__init__").rstrip(".")] = path
    return found


MODULES = modules()


def imports(name: str) -> set[str]:
    """The modules of the package that a module imports, wherever in it."""
    path, out = MODULES[name], set()
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            assert not any(alias.name.split(".")[0] == "facewrinkle" for alias in node.names), f"{name}: be relative"
        if not isinstance(node, ast.ImportFrom):
            continue
        assert node.level or (node.module or "").split(".")[0] != "facewrinkle", f"{name}: imports must be relative"
        if node.level:
            above = package.split(".")[: len(package.split(".")) - node.level + 1] if package else []
            source = ".".join([*above, *([node.module] if node.module else [])])
            for alias in node.names:
                inner = f"{source}.{alias.name}".lstrip(".")
                out.add(inner if inner in MODULES else source)
    return out


@cache
def imported() -> dict[str, set[str]]:
    """The modules that each module of the package imports."""
    return {name: imports(name) - {name} for name in MODULES}


def test_the_reader_of_imports_sees_some():
    assert "simulation.loop" in imported()["simulation"]
    assert {"motion.base", "anatomy", "errors"} <= imported()["animation.playback"]
    assert sum(map(len, imported().values())) > 400


def test_imports_run_downwards():
    rooms = {name: name.split(".")[0] for name in MODULES if name}
    upwards = [
        f"{name} imports {other}"
        for name, room in rooms.items()
        for other in imported()[name] & rooms.keys()  # the root only names the version, and loads rooms when asked
        if rooms[other] != room and FLOOR[rooms[other]] >= FLOOR[room]
    ]
    assert not upwards


def test_no_import_circle():
    names = sorted(MODULES)
    index = {name: k for k, name in enumerate(names)}
    pairs = np.array([(index[name], index[other]) for name in names for other in imported()[name]])
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(names), len(names)))
    count, label = connected_components(graph, directed=True, connection="strong")
    circles = [[name for name in names if label[index[name]] == k] for k in np.flatnonzero(np.bincount(label) > 1)]
    assert count == len(names), circles


def test_the_top_level_holds_what_users_name():
    top = {path.name.removesuffix(".py") for path in PACKAGE.iterdir() if path.name != "__pycache__"}
    assert top - {"py.typed", "__init__", "__init__.pyi"} == set(FLOOR)


def test_contributors_are_told_of_all_rooms_and_of_no_other():
    root = PACKAGE.parent
    table = (root / "docs" / "architecture.rst").read_text(encoding="utf-8").partition("\nRooms\n")[2]
    rows = re.findall(r"^   \* - (``.*``)$", table.partition("\nOne time step\n")[0], re.MULTILINE)
    assert sorted(room for row in rows for room in re.findall(r"``(\w+)``", row)) == sorted(FLOOR.keys() - {"__main__"})
    line = " < ".join(", ".join(floor) for floor in FLOORS[:-1])
    assert f"    {line}\n" in (root / "CONTRIBUTING.md").read_text(encoding="utf-8")


def test_every_name_of_the_top_level_is_there():
    assert {"Face", "MUSCLES", "mesh", "read_surface"} < set(fw.__all__)
    for name in fw.__all__:
        assert getattr(fw, name) is not None
    with pytest.raises(AttributeError, match="Simulatoin"):
        fw.Simulatoin  # noqa: B018


@pytest.mark.slow
def test_every_name_of_the_top_level_has_types_for_strict_checks(tmp_path, monkeypatch):
    monkeypatch.setenv("MYPYPATH", str(PACKAGE.parent))
    script = tmp_path / "script.py"
    script.write_text("\n".join(["import facewrinkle as fw", *(f"print(fw.{name})" for name in fw.__all__)]) + "\n")
    options = "--strict", "--follow-imports=silent", "--config-file=", f"--cache-dir={tmp_path}"
    out, err, status = mypy.api.run([*options, str(script)])
    assert (status, err) == (0, ""), out
