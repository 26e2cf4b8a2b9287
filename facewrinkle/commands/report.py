"""Lines, tables and progress of a command."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from rich.console import Console
from rich.table import Table

from ..anatomy.face import Face
from ..progress import bar


class Report:
    """Lines and tables of a command on stdout, and its progress on stderr; nothing when quiet."""

    def __init__(self, quiet: bool) -> None:
        self.quiet, self._begin = quiet, time.perf_counter()
        self.console = Console(quiet=quiet, highlight=False, markup=False, emoji=False)  # names may have brackets
        if quiet:
            warnings.simplefilter("ignore")

    def say(self, *what: Any) -> None:
        """Print a line, or a table."""
        self.console.print(*what, soft_wrap=True)

    def say_time(self) -> None:
        """Print how long the command took."""
        self.say(f"{time.perf_counter() - self._begin:.1f} s")

    def table(self, title: str, rows: Mapping[str, str]) -> None:
        """Print names and values."""
        table = Table(title=title, show_header=False, title_justify="left", title_style="bold", box=None)
        for name, value in rows.items():
            table.add_row(name, value)
        self.console.print(table)

    def waiting(self, what: str) -> AbstractContextManager[object]:
        """Show on a terminal what takes a while, until it is done."""
        console = Console(stderr=True)
        return nullcontext() if self.quiet or not console.is_terminal else console.status(f"{what} ...")

    def progress(self, items: Iterable[Any], what: str, total: int) -> Iterable[Any]:
        """Return the items, with a bar on a terminal."""
        return items if self.quiet else bar(items, what, total)


def face_facts(face: Face) -> dict[str, str]:
    """Return the rows of a table about a fitted face."""
    measured = [value for name, value in face.confidences.items() if name not in face.estimated]
    facts = {"likeness to a face": "not known" if face.likeness is None else f"{face.likeness:.2f}"}
    facts["landmarks"] = f"{len(face.landmarks)}, estimated: {', '.join(face.estimated) or 'none'}"
    if measured:
        facts["confidence of measured ones"] = f"{min(measured):.2f} to {max(measured):.2f}"
    return facts | {"unit": f"{face.unit:.4g} mm", "distance between the pupils": f"{face.frame.pupil_distance:.4g}"}
