"""``facewrinkle compile``: what the first use would have to wait for, done ahead."""

from __future__ import annotations

import time

from ..compiling import compile_ahead
from .report import Report


def compile_all(*, quiet: bool = False) -> None:
    """Compile the inner loops in all cores and keep them, so that no first command has to wait for them.

    For images of containers, clusters and class rooms. Other commands compile what they lack by themselves.

    Parameters
    ----------
    quiet
        Print only errors.
    """
    begin, report = time.perf_counter(), Report(quiet)
    compile_ahead(lambda steps, n: report.progress(iter(steps), "Compiling", n))
    report.say(f"{time.perf_counter() - begin:.1f} s")
