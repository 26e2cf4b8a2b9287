"""Write ``facewrinkle/compiling/data/functions.txt``: what numba compiles for the commands, and for which types.

python -m tools.list_compiled

Each command is run in a process of its own, which records what is compiled, or read from the disk, in the order of the
need. Only calls from Python are listed: what compiled functions call is compiled with them.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numba.core.dispatcher import Dispatcher

import facewrinkle as fw
from facewrinkle.compiling.listed import FILE, Listed

TAKE = "time,jawOpen,browInnerUp,mouthSmileLeft\n0,0,0,0\n0.2,0.5,0.8,0.9\n0.4,0,0,0\n"

COMMANDS = {
    "express": (["express", "surprise", "--frames", "20", "--series"],),
    "pattern": (["pattern", "forehead", "--frames", "4"],),
    "tear": (["tear", "dripping", "--seconds", "0.6"], ["tear", "shedding", "--seconds", "0.6"]),
    "play": (["play", "take.csv"], ["play", "express/surprise.vtkhdf", "--speed", "4"]),
    "others": (
        ["express", "happiness", "--frames", "8", "--folds", "paper", "--maps", "64"],
        ["express", "fear", "--frames", "8", "--folds", "paper", "--compression", "edges"],
        ["pattern", "dimple", "--frames", "4", "--expression", "AU12"],
        ["fit", "head.ply"],
        ["express", "surprise", "--frames", "4", "--face", "head.ply"],
        ["table1", "--iterations", "4", "--drawings", "1"],
        ["rig", "--shapes", "browInnerUp+jawOpen", "--wrinkles", "maps"],
    ),
}
"""Commands by the section that they are recorded for: what these need by default, as all of it is compiled at their
first start. Later ones may read what earlier ones have written."""

HEAD = "# Written by tools/list_compiled.py: functions with the types of their arguments, in the order of the need."


@contextmanager
def recorded() -> Iterator[dict[Listed, None]]:
    """Note which functions of the package are called from Python for the first time, and for which types."""
    found: dict[Listed, None] = {}
    dispatcher: Any = Dispatcher
    compile_, depth = dispatcher.compile, 0

    def noted(self: Any, types: Any) -> Any:
        nonlocal depth
        if not depth and self.py_func.__module__.startswith("facewrinkle."):
            found[Listed.of(self, types)] = None
        depth += 1
        try:
            return compile_(self, types)
        finally:
            depth -= 1

    dispatcher.compile = noted
    try:
        yield found
    finally:
        dispatcher.compile = compile_


def needed(arguments: list[str]) -> list[Listed]:
    """Return what a command needs that is run here and now."""
    from facewrinkle.cli import main

    with recorded() as found:
        if main([*arguments, "--quiet"]):
            raise SystemExit(f"facewrinkle {' '.join(arguments)} failed.")
    return list(found)


def listed() -> str:
    """Return the text of the list, from all commands."""
    lines = [HEAD]
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        environment = {**os.environ, "PYTHONPATH": str(FILE.parents[3]), "FACEWRINKLE_CACHE_DIR": str(here / "kept")}
        (here / "take.csv").write_text(TAKE, encoding="utf-8")
        fw.write_mesh(fw.default_face().mesh, here / "head.ply")
        everything: set[str] = set()
        for section, commands in COMMANDS.items():
            found: dict[str, None] = {}
            for command in commands:
                print("facewrinkle", *command)
                run = [sys.executable, __file__, *command, "--out", section]
                output = subprocess.run(run, cwd=here, env=environment, check=True, stdout=subprocess.PIPE, text=True)
                found |= dict.fromkeys(json.loads(output.stdout.splitlines()[-1]))
            known = everything if section == "others" else set()
            lines += ["", f"[{section}]", *(line for line in found if line not in known)]
            everything.update(found)
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(json.dumps(list(map(str, needed(sys.argv[1:])))))
    else:
        FILE.write_text(listed(), encoding="utf-8")
