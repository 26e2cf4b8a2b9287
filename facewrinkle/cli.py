"""The command line: ``express``, ``play``, ``pattern``, ``tear``, ``fit``, ``table1``, ``info`` and ``demo``.

The commands live in :mod:`facewrinkle.commands` and are imported when they are called, so that ``--help`` is quick.
"""

from __future__ import annotations

import os
import signal
import sys
import warnings
from collections.abc import Sequence
from typing import NoReturn

from cyclopts import App, CycloptsError

from . import __version__
from .commands import loading
from .commands.interrupts import interrupts
from .errors import FaceWrinkleError, FaceWrinkleWarning

USAGE, FAILED = 2, 1
"""Exit codes."""

QUIET = {"--quiet", "--help", "-h", "--version"}
"""Words with which nothing is shown but what was asked for."""

app = App(
    name="facewrinkle",
    help="Wrinkles that muscles fold into faces: pictures, movies, time series, and Table 1 of the paper.",
    version=__version__,
    suppress_keyboard_interrupt=False,
)
app.command("facewrinkle.commands.express:express", help="Write pictures, a movie and a time series of an expression.")
app.command("facewrinkle.commands.fit:fit", help="Find the face on a mesh and place skull, eyes and muscles under it.")
app.command("facewrinkle.commands.tear:tear", help="Write pictures, a movie and two time series of a face that cries.")
app.command("facewrinkle.commands.play:play", help="Write pictures, a movie and a time series of a recorded animation.")
app.command(
    "facewrinkle.commands.pattern:pattern",
    help="Write pictures, a movie and a time series of a wrinkle pattern.",
)
app.command("facewrinkle.commands.table1:table1", help="Measure Table 1 of the paper and print both.")
app.command(
    "facewrinkle.commands.info:info",
    help="List muscles, action units and expressions, or describe a mesh or a .face file.",
)
app.command(
    "facewrinkle.commands.demo:demo", help="Write pictures and movies of the paper's five expressions, and Table 1."
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Default: those of the process.

    Returns
    -------
    int
        0 after success, 1 after an error, 2 after wrong usage, 130 after Ctrl-C, 143 after SIGTERM. An error is one
        line on stderr.
    """
    if sys.platform.startswith("linux"):  # else VTK would look for a display
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    tokens = list(sys.argv[1:] if arguments is None else arguments)
    with warnings.catch_warnings(), interrupts() as seen:
        warnings.simplefilter("always", FaceWrinkleWarning)
        warnings.showwarning = _notice
        if tokens and not QUIET.intersection(tokens):
            loading.begin()
        try:
            app(tokens, exit_on_error=False, print_error=False, result_action="return_value")
        except CycloptsError as error:
            hint = f"facewrinkle {' '.join(error.command_chain or ())}".rstrip()
            return _complain(f"{_one_line(error)} Try: {hint} --help", USAGE)
        except KeyboardInterrupt:
            return _complain("interrupted.", _code(seen))
        except BrokenPipeError:  # the reader, such as head, has gone
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return FAILED
        except Exception as error:
            if seen:  # VTK drops an interrupt inside its callbacks, and something else fails
                return _complain("interrupted.", _code(seen))
            if isinstance(error, FaceWrinkleError):
                return _complain(_one_line(error), FAILED)
            raise
        finally:
            loading.end()
    return 0


def program() -> NoReturn:
    """Run the command line and end the process with its code."""
    code = main()
    if code > 128:  # a second signal would break the tidying up
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)
    sys.exit(code)


def _code(seen: list[int]) -> int:
    """Return the exit code after a signal."""
    return 128 + (seen[0] if seen else signal.SIGINT)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def _complain(message: str, code: int) -> int:
    loading.end()
    print(f"facewrinkle: {message}", file=sys.stderr)
    return code


_show = warnings.showwarning


def _notice(message: Warning | str, category: type[Warning], *where: object, **rest: object) -> None:
    """Show the warnings of this package as notices of one line, and others as usual."""
    loading.end()
    if issubclass(category, FaceWrinkleWarning):
        print(f"facewrinkle: note: {' '.join(str(message).split())}", file=sys.stderr)
    else:
        _show(message, category, *where, **rest)  # type: ignore[arg-type]
