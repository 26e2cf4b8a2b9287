"""Write ``facewrinkle/__init__.pyi``, which tells type checkers and editors what the lazy names of the package are.

python -m tools.write_stub
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import facewrinkle as fw

STUB = Path(fw.__file__).with_suffix(".pyi")


def stub() -> str:
    """Return the text of the stub, from the table of lazy names."""
    package: Any = fw  # the stub does not tell its tables
    homes: dict[str, list[str]] = {}
    for name, home in sorted(package._HOME.items(), key=lambda entry: (entry[1], entry[0])):
        homes.setdefault(home, []).append(name)
    lines = ["# Written by tools/write_stub.py.", "", "from typing import Any", ""]
    lines += [f"from . import {name} as {name}" for name in package._SUBPACKAGES]
    for home, names in homes.items():
        lines += [f"from .{home} import {name} as {name}" for name in names]
    lines += ["", "__version__: str", "__all__: list[str]", ""]
    kinds = {"MUSCLES": "Any", "ACTION_UNITS": "float", "EXPRESSIONS": "float"}
    lines += [f"{name}: dict[str, dict[str, {kinds[name]}]]" for name in package._TABLES]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    STUB.write_text(stub(), encoding="utf-8")
