"""Processes of Python that are started beside this one, and the end of this one."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

before_the_end: list[Callable[[], None]] = []
"""What must be done, quickly, when a signal ends the command line: to save what was made, to end other processes."""


def environment() -> dict[str, str]:
    """Return the environment of a process that imports this very package, wherever it is started.

    Examples
    --------
    >>> environment()["PYTHONPATH"].split(os.pathsep)[0] == str(Path(__file__).parents[1])
    True
    """
    paths = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    return {**os.environ, "PYTHONPATH": paths.rstrip(os.pathsep)}
