"""``facewrinkle compile``: what the first use would have to wait for, done ahead."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from ..anatomy.fitting import default_face
from ..export import write_mesh
from ..progress import Progress, bar
from .express import express
from .fit import fit
from .options import FaceOptions, FoldOptions, OutputOptions, Report
from .pattern import pattern
from .play import play
from .rig import rig
from .tear import tear


def compile_all(*, quiet: bool = False) -> None:
    """Compile the inner loops ahead of time, so that the first run does not have to wait.

    Useful for container images, clusters and classrooms. Without it, commands compile what they need on their first
    run.

    Parameters
    ----------
    quiet
        Print only errors.
    """
    compile_ahead(Report(quiet).progress)


def compile_ahead(progress: Progress | None = None) -> None:
    """Compile what the package needs, so that nothing has to wait for it later.

    numba compiles a function when it is first called, and keeps it on the disk. Call this once after an installation,
    such as while an image of a container is built. It plays a short case of each command, and throws away what they
    write.

    Parameters
    ----------
    progress : callable, optional
        Shows progress: called with the steps, what is done, and the number of steps; returns the steps, to be done one
        by one. Default: a bar on stderr if that is a terminal.

    Notes
    -----
    The command ``facewrinkle compile`` does the same.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> fw.compile_ahead(lambda steps, what, n: steps)  # doctest: +SKIP
    """
    with TemporaryDirectory() as folder, warnings.catch_warnings():
        steps = _cases(Path(folder))
        for _ in (progress or bar)((step() for step in steps), "Compiling", len(steps)):
            pass


def _cases(folder: Path) -> list[Callable[[], None]]:
    """Return a short case of each command that compiles something, which writes into a folder."""
    take, head = folder / "take.csv", folder / "head.ply"
    take.write_text("time,jawOpen,browInnerUp,mouthSmileLeft\n0,0,0,0\n0.2,0.5,0.8,0.9\n0.4,0,0,0\n", "utf-8")
    write_mesh(default_face().mesh, head)
    output = OutputOptions("64", fps=8.0, series=True, out=folder / "out", quiet=True)
    on_scan, paper = FaceOptions(folder / "head.face"), FoldOptions("paper")
    return [
        partial(express, "surprise", frames=8, maps=64, output=output),
        partial(express, "fear", frames=4, folds=paper, output=output),
        partial(pattern, "forehead", frames=2, output=output),
        partial(pattern, "dimple", frames=2, expression="AU12", output=output),
        partial(tear, "dripping", seconds=0.5, output=output),
        partial(tear, "shedding", seconds=0.5, output=output),
        partial(play, take, output=output),
        partial(play, folder / "out" / "surprise.vtkhdf", output=replace(output, out=folder)),
        partial(fit, head, out=folder, quiet=True),
        partial(express, "surprise", source=on_scan, frames=2, output=replace(output, out=folder / "scan")),
        partial(rig, shapes="browInnerUp+jawOpen", wrinkles="maps", map_size=64, out=folder, quiet=True),
    ]
