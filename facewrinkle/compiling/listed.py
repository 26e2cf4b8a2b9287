"""Compiled functions and the types of their arguments, by the command that needs them, in the order of its need.

The list is written by ``python -m tools.list_compiled``. It only saves time: what it lacks is compiled when it is
needed, and what is no longer there is passed over.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

PACKAGE = __name__.partition(".")[0]
FILE = Path(__file__).parent / "data" / "functions.txt"


@dataclass(frozen=True)
class Listed:
    """A function, and the types that it is compiled for.

    Attributes
    ----------
    function : str
        Its name, with its module within the package.
    types : str
        As numba writes them; ``float64[:, ::1]`` is an array, and ``const(float64[:, ::1])`` one that is only read.
    """

    function: str
    types: str

    @classmethod
    def of(cls, compiled: Any, types: Iterable[Any]) -> Listed:
        """Return the entry of a compiled function for types of numba's."""
        from ..geometry.compilation import full_name

        return cls(full_name(compiled).removeprefix(f"{PACKAGE}."), ", ".join(map(_written, types)))

    @classmethod
    def read(cls, line: str) -> Listed:
        """Return the entry that a line is about."""
        function, _, types = line.partition("(")
        return cls(function, types.removesuffix(")"))

    def __str__(self) -> str:
        return f"{self.function}({self.types})"

    def found(self) -> tuple[Any, tuple[Any, ...]] | None:
        """Return the function with numba's types; None without such a function whose code is kept."""
        from ..geometry.compilation import functions

        with suppress(Exception):  # a list of another version may name anything
            import_module(f"{PACKAGE}.{self.function.rpartition('.')[0]}")
            return functions[f"{PACKAGE}.{self.function}"], eval(f"({self.types},)", dict(_vocabulary()))
        return None


def sections() -> dict[str, list[Listed]]:
    """Return what each command needs; empty without a list."""
    found: dict[str, list[Listed]] = {}
    with suppress(OSError):
        for line in FILE.read_text(encoding="utf-8").splitlines():
            if line.startswith("["):
                section = found.setdefault(line.strip("[]"), [])
            elif line and not line.startswith("#"):
                section.append(Listed.read(line))
    return found


def listed(section: str) -> list[Listed]:
    """Return what a section names; "" all that is named."""
    found = sections()
    if section:
        return found.get(section, [])
    return list(dict.fromkeys(entry for entries in found.values() for entry in entries))


def missing(section: str) -> list[tuple[Any, tuple[Any, ...]]]:
    """Return functions of a section, with the types, that are not on the disk."""
    from ..geometry.compilation import is_kept

    found = (entry.found() for entry in listed(section))
    return [known for known in found if known is not None and not is_kept(*known)]


def _written(kind: Any) -> str:
    """Return a type as the list has it."""
    from numba import types as numba_types

    types: Any = numba_types

    if isinstance(kind, types.BaseTuple):
        inner, named = "".join(f"{_written(part)}, " for part in kind.types), getattr(kind, "instance_class", None)
        if named is None:
            return f"Tuple(({inner[:-1]}))"
        return f'named("{named.__module__.removeprefix(f"{PACKAGE}.")}", "{named.__name__}", {inner[:-2]})'
    if not isinstance(kind, types.Array) or kind.layout not in "AC" or not kind.aligned:
        return repr(kind)
    last = "::1" if kind.layout == "C" else ":"
    array = f"{_written(kind.dtype)}[{', '.join([':'] * (kind.ndim - 1) + [last])}]"
    return array if kind.mutable else f"const({array})"


@cache
def _vocabulary() -> dict[str, Any]:
    """Return the words that types are written with."""
    from numba import types

    def const(array: Any) -> Any:
        return array.copy(readonly=True)

    def named(module: str, name: str, *parts: Any) -> Any:
        return types.BaseTuple.from_types(parts, getattr(import_module(f"{PACKAGE}.{module}"), name))

    return {**vars(types), "bool": types.boolean, "const": const, "named": named}
