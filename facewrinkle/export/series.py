"""Frames as a VTKHDF time series."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pyvista as pv

from ..errors import ParameterError, check_range
from ..files import not_written, output_file, replaced
from .series_file import Writer, problem_of
from .series_process import problem_aside

LATEST = float(np.finfo(np.float32).max)
"""The latest time that a file can hold, in single precision."""


def write_series(frames: Iterable[pv.PolyData], times: Iterable[float], path: str | Path) -> Path:
    """Write frames as one VTKHDF file, which ParaView plays and `pyvista.read` opens at the first time.

    Frames are taken and written one by one, so those of a generator such as `Simulation.run` are never all in memory.
    Points, triangles, point data and field data (also the names of the muscles) are kept exactly, in their own
    precision, and their number may change from frame to frame. VTK stores the times in single precision, and replaces
    "/" and "." in names by "_".

    Parameters
    ----------
    frames : iterable of pyvista.PolyData
        All with the same point arrays.
    times : iterable of float
        One for each frame, increasing.
    path : path
        Ends in .vtkhdf or .hdf. An existing file is replaced.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    ParameterError
        If there are more times than frames, or fewer; if the times do not increase; or if a frame has other arrays
        than the first.
    OutputError
        If the file cannot be written. Nothing is left behind after an error.

    Examples
    --------
    >>> import pyvista as pv, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     frames = (pv.Sphere(theta_resolution=n) for n in (8, 16))
    ...     path = write_series(frames, [0.0, 0.5], f"{folder}/series.vtkhdf")
    ...     pv.read(path).n_points == pv.Sphere(theta_resolution=8).n_points
    True
    """
    return _written_by(problem_of, frames, times, path)


def write_series_aside(frames: Iterable[pv.PolyData], times: Iterable[float], path: str | Path) -> Path:
    """Do what :func:`write_series` does, in a process of its own; in this one, where none can be started."""
    return _written_by(problem_aside, frames, times, path)


def _written_by(writer: Writer, frames: Iterable[pv.PolyData], times: Iterable[float], path: str | Path) -> Path:
    """Check the arguments, let a writer make the file, and return its path."""
    path = output_file(path, (".vtkhdf", ".hdf"))
    steps = [check_range("a time", time, -LATEST, LATEST) for time in times]
    stored = np.array(steps, dtype=np.float32)
    if not steps or not np.isfinite(stored).all() or not (np.diff(stored) > 0).all():
        raise ParameterError(f"times must be finite and increase (as float32), received {steps[:8]}.")
    with replaced(path) as whole:
        problem = writer(_checked(iter(frames), len(steps)), steps, whole)
        if problem is not None:
            raise not_written(path, problem)
    return path


def _checked(frames: Iterator[pv.PolyData], count: int) -> Iterator[pv.PolyData]:
    """Yield frames after checking that each has the arrays of the first; in the end, that they are as many as times."""
    first: dict[str, tuple[str, tuple[int, ...]]] = {}
    for number in range(count):
        frame = next(frames, None)
        if frame is None:
            raise ParameterError(f"{count} times need as many frames, received {number} frames.")
        arrays = {name: (values.dtype.name, values.shape[1:]) for name, values in frame.point_data.items()}
        first = arrays if number == 0 else first
        if arrays != first:
            raise ParameterError(
                f"all frames must have the point arrays of the first, {first}; frame {number} has {arrays}."
            )
        yield frame
    if next(frames, None) is not None:
        raise ParameterError(f"every frame needs a time, received {count} times and more frames.")
