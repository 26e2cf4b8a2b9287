"""The command line: ``express``, ``play``, ``pattern``, ``tear``, ``rig``, ``studio``, ``dataset``, ``fit`` and more.

The commands live in :mod:`facewrinkle.commands` and are imported when they are called, so that ``--help`` is quick.
"""

from __future__ import annotations

import io
import os
import shutil
import signal
import sys
import traceback
import warnings
from collections.abc import Sequence
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Parameter

from . import __version__
from .errors import FaceWrinkleError, FaceWrinkleWarning
from .files import inputs_kept, inside_only
from .progress import only_bars

COMMON = Parameter(group="Options of all commands", show_default=False)

app = App(
    name="facewrinkle",
    help="Dynamic wrinkles, dimples and tears for faces: pictures, movies, meshes, rigs and data sets.",
    version=__version__,
    suppress_keyboard_interrupt=False,
    default_parameter=Parameter(negative=()),
)
COMMANDS = {
    "express": ("express:express", "Write pictures and a movie of an expression."),
    "fit": ("fit:fit", "Detect the face on a mesh, and fit skull, eyes and muscles to it."),
    "tear": ("tear:tear", "Write pictures and a movie of a crying face."),
    "play": ("play:play", "Write pictures and a movie of a recorded animation."),
    "pattern": ("pattern:pattern", "Write pictures and a movie of a wrinkle pattern."),
    "studio": ("studio:studio", "Open a face in the browser, with a slider for everything."),
    "rig": ("rig:rig", "Write a rig with blend shapes that wrinkle, for other programs."),
    "blender": ("rig:blender", "Write the extension for Blender."),
    "info": ("info:info", "List muscles, action units and expressions, or describe a mesh or a .face file."),
    "compile": ("compile:compile_all", "Compile ahead of time, so that the first run does not have to wait."),
    "atlas": ("info:atlas", "Print the atlas of muscles, action units and expressions as TOML, to edit."),
    "take": ("play:take", "Print a recorded take as a table of weights."),
    "dataset": ("dataset:dataset", "Generate labeled pictures of faces for training."),
    "demo": ("express:demo", "Write pictures and movies of the paper's five expressions."),
}
"""Where each command is, in :mod:`facewrinkle.commands`, and what it does."""

for name, (place, what) in COMMANDS.items():
    app.command(f"facewrinkle.commands.{place}", name=name, help=what)


@app.command(help="Print a shell-completion script.")
def completion(shell: Literal["bash", "zsh", "fish"], /) -> None:
    """Print a shell-completion script.

    Parameters
    ----------
    shell
        For bash: facewrinkle completion bash > ~/.local/share/bash-completion/completions/facewrinkle
    """
    sys.stdout.write(app.generate_completion(prog_name="facewrinkle", shell=shell))


launcher = app.meta
launcher.suppress_keyboard_interrupt = False


@launcher.default
def _run(
    *tokens: Annotated[str, Parameter(show=False, allow_leading_hyphen=True)],
    verbose: Annotated[bool, COMMON] = False,
    no_outside: Annotated[bool, COMMON] = False,
) -> None:
    """Run a command.

    Parameters
    ----------
    verbose
        Show library warnings and tracebacks.
    no_outside
        Ignore files that a mesh file references outside its folder.
    """
    with warnings.catch_warnings(), inside_only(no_outside), inputs_kept(), only_bars():
        if not verbose:
            warnings.simplefilter("ignore")
        warnings.simplefilter("always", FaceWrinkleWarning)
        warnings.showwarning = _notice
        try:
            app(tokens, exit_on_error=False, print_error=False, result_action="return_value")
        except (CycloptsError, BrokenPipeError):
            raise
        except Exception:
            if verbose:
                traceback.print_exc()
            raise


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Default: those of the process. With ``--verbose`` among them, warnings of libraries are shown, and an error with
        its traceback.

    Returns
    -------
    int
        0 after success, 1 after an error, 2 after wrong usage, 130 after Ctrl-C. An error is one line on stderr.
    """
    if sys.platform.startswith("linux"):  # else VTK would look for a display
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a name in another script must not end a command
            stream.reconfigure(errors="replace")
    _widen()
    tokens = list(sys.argv[1:] if arguments is None else arguments)
    failed, misused = 1, 2
    try:
        launcher(tokens, exit_on_error=False, print_error=False, result_action="return_value")
    except CycloptsError as error:
        hint = f"facewrinkle {' '.join(error.command_chain or ())}".rstrip()
        after = " Arguments after -- are not options: put options before it." if "--" in tokens else ""
        return _complain(f"{_one_line(error)}{after} Try: {hint} --help", misused)
    except KeyboardInterrupt:
        return _complain("interrupted.", 128 + signal.SIGINT)
    except BrokenPipeError:  # the reader, such as head, has gone
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return failed
    except Exception as error:
        return _complain(_failure(error), failed)
    return 0


def _widen() -> None:
    """Have what is printed laid out at a width that it can be laid out at, however narrow the terminal is."""
    columns, narrowest = shutil.get_terminal_size().columns, 40  # on narrower ones names of options were cut
    if columns < narrowest or os.environ.get("COLUMNS") == "0":
        os.environ["COLUMNS"] = str(max(columns, narrowest))


def _failure(error: Exception) -> str:
    """Return a line about an error, whether it is foreseen or not."""
    if isinstance(error, FaceWrinkleError):
        return _one_line(error)
    if isinstance(error, MemoryError):
        return "there is not enough memory for this. Ask for less, or use a machine with more."
    if isinstance(error, OSError) and error.errno is not None:
        where = f" {error.filename!r}" if error.filename else ""
        return f"the system refused{where}: {error.strerror}. Check the disk and your permissions."
    what = " ".join(f"{type(error).__name__}: {error}".split())
    return f"internal error: {what[:300]}. Please report it with the output of --verbose."


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def _complain(message: str, code: int) -> int:
    print(f"facewrinkle: {message}", file=sys.stderr)
    return code


_show = warnings.showwarning


def _notice(message: Warning | str, category: type[Warning], *where: object, **rest: object) -> None:
    """Show the warnings of this package as notices of one line, and others as usual."""
    if issubclass(category, FaceWrinkleWarning):
        print(f"facewrinkle: note: {' '.join(str(message).split())}", file=sys.stderr)
    else:
        _show(message, category, *where, **rest)  # type: ignore[arg-type]
