"""Time series written by a process of its own: the file is compressed while the next frame is made and drawn.

VTK compresses with the interpreter's lock held, and two threads of one process must not both use VTK. The frames go to
the process through a pipe, and wait there while it is busy. It answers twice: when it is ready, and with what went
wrong. If the pipe ends before the last frame, nobody waits for the file any more, and it removes what there is of it.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkCellArray

from ..processes import environment
from .series_file import problem_of

PIPE = 2**20
"""Bytes of frames that may wait for the process, where the system allows so many."""

CELLS = ("Verts", "Lines", "Polys", "Strips")
DATA = ("point_data", "cell_data", "field_data")
"""The parts of a mesh, by their names in VTK and in PyVista."""


def problem_aside(frames: Iterator[pv.PolyData], times: list[float], path: Path) -> OSError | str | None:
    """Do what :func:`problem_of` does, in a process of its own; in this one, where none can be started."""
    process = _started()
    if process is None:
        return problem_of(frames, times, path)
    try:
        frames = chain([next(frames)], frames)  # while the process starts
        if _heard(process) is not None:
            return problem_of(frames, times, path)
        for thing in chain([(times, path)], map(_packed, frames)):
            if not _sent(process, thing):
                break
        return _heard(process)
    finally:
        process.kill()
        _close(process)


def _started() -> subprocess.Popen[bytes] | None:
    """Start a process that imports this very package, wherever it is started; return None if that is not possible."""
    try:
        return subprocess.Popen(
            [sys.executable, "-P", "-m", __name__], env=environment(),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, pipesize=PIPE,
            start_new_session=True,  # Ctrl-C is for the command, which ends the process by itself
        )  # fmt: skip
    except OSError:
        return None


def _sent(process: subprocess.Popen[bytes], thing: Any) -> bool:
    """Send something to a process, and return whether it is still there."""
    assert process.stdin is not None
    try:
        pickle.dump(thing, process.stdin, pickle.HIGHEST_PROTOCOL)
        process.stdin.flush()
    except OSError:
        return False
    return True


def _heard(process: subprocess.Popen[bytes]) -> Any:
    """Return the next answer of a process."""
    assert process.stdout is not None
    try:
        return pickle.load(process.stdout)
    except Exception:  # nothing, or something else that was printed
        return "the process that writes it came to an end"


def _close(process: subprocess.Popen[bytes]) -> None:
    """Wait for the end of a process."""
    assert process.stdin is not None
    with suppress(OSError):  # what is left in the pipe reaches nobody
        process.stdin.close()
    with process:
        pass


def main() -> None:
    """Write the file that the standard input tells of, and answer on the standard output."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Windows sends it to all processes of a console
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is no answer

    def answer(thing: Any) -> None:
        with suppress(OSError):
            pickle.dump(thing, answers)
            answers.flush()

    answer(None)
    times, path = pickle.load(sys.stdin.buffer)
    try:
        problem = problem_of(_received(len(times)), times, path)
    except Exception as error:
        problem = error if isinstance(error, OSError) else f"{type(error).__name__}: {error}"
    if problem is not None:
        path.unlink(missing_ok=True)
    answer(problem)
    os._exit(0)  # after an error HDF5 would not let go of the file


def _received(count: int) -> Iterator[pv.PolyData]:
    for _ in range(count):
        yield _unpacked(pickle.load(sys.stdin.buffer))


def _packed(mesh: pv.PolyData) -> tuple[Any, ...]:
    """Return all that a mesh holds, as arrays.

    VTK's own way to send a mesh takes seven times as long, and leaves 32 bits of an id.
    """
    cells = [getattr(mesh, f"Get{kind}")() for kind in CELLS]
    return (
        np.asarray(mesh.points),
        [[vtk_to_numpy(part) for part in (each.GetOffsetsArray(), each.GetConnectivityArray())] for each in cells],
        [[(name, _plain(values)) for name, values in getattr(mesh, kind).items()] for kind in DATA],
        [_active(attributes) for attributes in (mesh.GetPointData(), mesh.GetCellData())],
    )


def _unpacked(packed: tuple[Any, ...]) -> pv.PolyData:
    points, cells, data, active = packed
    mesh = pv.PolyData()
    mesh.SetPoints(pv.vtk_points(points, force_float=False))
    for kind, parts in zip(CELLS, cells, strict=True):
        each = vtkCellArray()
        each.SetData(*(numpy_to_vtk(part, deep=True) for part in parts))
        getattr(mesh, f"Set{kind}")(each)
    for kind, arrays in zip(DATA, data, strict=True):
        for name, values in arrays:
            getattr(mesh, kind).set_array(values, name)
    for attributes, names in zip((mesh.GetPointData(), mesh.GetCellData()), active, strict=True):
        for number, name in names.items():
            attributes.SetActiveAttribute(name, number)
    return mesh


def _plain(values: Any) -> Any:
    return np.asarray(values) if isinstance(values, np.ndarray) else values


def _active(attributes: Any) -> dict[int, str]:
    """Return the names of the active arrays by what they are active as."""
    found = {number: attributes.GetAbstractAttribute(number) for number in range(attributes.NUM_ATTRIBUTES)}
    return {number: array.GetName() for number, array in found.items() if array is not None}


if __name__ == "__main__":
    main()
