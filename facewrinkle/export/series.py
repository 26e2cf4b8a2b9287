"""Frames as a VTKHDF time series."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterable, Iterator
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np
import pyvista as pv
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonCore import vtkCollection, vtkCommand, vtkInformation
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkCommonExecutionModel import vtkDemandDrivenPipeline, vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader, vtkHDFWriter

from ..arguments import checked
from ..errors import ParameterError, check_range
from ..mesh.files import not_written, output_file, replaced, reserve

LATEST = float(np.finfo(np.float32).max)
"""The latest time that a file can hold, in single precision."""

COMPRESSION = 1
"""Level of compression of the HDF5 data, 0 to 9."""

CHUNK = 2000
"""Rows that are compressed together. Those of VTK, 25,000, hold several frames: each would be compressed again with
every frame that is added."""


OVERHEAD, ARRAYS_OF_VTK = 2**18, 6
"""Bytes that the file takes for an array besides its rows, and the number of arrays that VTK adds by itself."""


@checked
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
    path = output_file(path, (".vtkhdf", ".hdf"))
    steps = [check_range("a time", time, -LATEST, LATEST) for time in times]
    stored = np.array(steps, dtype=np.float32)
    if not steps or not np.isfinite(stored).all() or not (np.diff(stored) > 0).all():
        raise ParameterError(f"times must be finite and increase (as float32), received {steps[:8]}.")
    with replaced(path) as whole:
        problem = _problem(iter(frames), steps, whole)
        if problem is not None:
            raise not_written(path, problem)
    return path


def _problem(frames: Iterator[pv.PolyData], times: list[float], path: Path) -> OSError | str | None:
    """Write the file, and return what went wrong; None if it is whole.

    VTK works in a thread of its own and asks for the frames, which are made in the calling thread: an interrupt by the
    user arrives here, and never inside VTK, which would drop it. The two take turns: VTK in one thread, while another
    draws a frame, may wait for ever, each for a lock of the other. Room for each frame is reserved before VTK has it,
    as HDF5 does not get over a full disk.
    """
    source, frame, room = _FrameSource(times), None, _Room(path)
    thread = threading.Thread(target=source.write, args=(path,), daemon=True)
    with pv.vtk_verbosity("off"):  # what goes wrong is raised, once
        thread.start()
        try:
            for number in iter(source.requests.get, None):
                frame = _checked(next(frames, None), frame, number, len(times))
                try:
                    room.reserve(frame)
                except OSError as problem:
                    return problem
                source.answers.put(frame)
            if source.taken == len(times) and next(frames, None) is not None:
                raise ParameterError(f"every frame needs a time, received {len(times)} times and more frames.")
        finally:
            source.answers.put(None)  # whatever else the writer asks for
            thread.join()
        if source.failed or not source.written or _count(path) != len(times):
            return "VTK failed"
    room.give_back()
    return None


class _Room:
    """The room on the disk for a file that VTK writes.

    VTK keeps the end of each array in memory, up to a chunk, until the file is closed, and packs it again into another
    place whenever rows are added to it.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._given = 0

    def reserve(self, frame: pv.PolyData) -> None:
        """Reserve room for one more frame; raise an OSError if there is none."""
        if not self.path.exists():  # VTK makes it after the first frame
            self.path.touch()
        own = 1024 * frame.GetActualMemorySize()
        rows = max(frame.n_points, frame.n_cells, 1)
        self._given += own
        pending = min(self._given, own + own * CHUNK // rows)
        arrays = ARRAYS_OF_VTK + sum(len(data) for data in (frame.point_data, frame.cell_data, frame.field_data))
        reserve(self.path, self.path.stat().st_size + 2 * pending + OVERHEAD * arrays)

    def give_back(self) -> None:
        """Give back what was not needed."""
        os.truncate(self.path, self.path.stat().st_size)


def _count(path: Path) -> int:
    """Return the number of times in a file; 0 if it cannot be read."""
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    if not reader.CanReadFile(str(path)):
        return 0
    reader.UpdateInformation()
    return max(int(reader.GetNumberOfSteps()), 1)


def _checked(frame: pv.PolyData | None, before: pv.PolyData | None, number: int, count: int) -> pv.PolyData:
    """Return the frame after checking that it is there and has the arrays of the one before."""
    if frame is None:
        raise ParameterError(f"{count} times need as many frames, received {number} frames.")
    arrays, first = _arrays(frame), _arrays(before or frame)
    if arrays != first:
        raise ParameterError(
            f"all frames must have the point arrays of the first, {first}; frame {number} has {arrays}."
        )
    return frame


def _arrays(frame: pv.PolyData) -> dict[str, tuple[str, tuple[int, ...]]]:
    return {name: (values.dtype.name, values.shape[1:]) for name, values in frame.point_data.items()}


class _FrameSource(VTKPythonAlgorithmBase):
    """A VTK source that hands frames to a writer, one for each time step, in order.

    Attributes
    ----------
    requests : SimpleQueue
        Numbers of the frames that the writer wants, and None when it is done.
    answers : SimpleQueue
        The frames, and None when there are no more.
    taken : int
        Number of frames that the writer has been given.
    written, failed : bool
        True if the writer ended; True if it complained.
    """

    def __init__(self, times: list[float]) -> None:
        super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkPolyData")
        self.times = times
        self.requests: SimpleQueue[int | None] = SimpleQueue()
        self.answers: SimpleQueue[pv.PolyData | None] = SimpleQueue()
        self.frame: pv.PolyData | None = None
        self.taken = 0
        self.written = self.failed = False
        self.request: Any = None
        self.writer = vtkHDFWriter()
        for complaining in (self.writer, self.writer.GetExecutive()):
            complaining.AddObserver(vtkCommand.ErrorEvent, self._stop)
        self.writer.SetInputConnection(self.GetOutputPort())
        self.writer.SetWriteAllTimeSteps(True)
        self.writer.SetCompressionLevel(COMPRESSION)
        self.writer.SetChunkSize(CHUNK)

    def write(self, path: Path) -> None:
        """Write the file, with all frames that arrive."""
        try:
            self.writer.SetFileName(str(path))
            self.written = bool(self.writer.Write())
        finally:
            self.requests.put(None)

    def RequestInformation(self, request: Any, inputs: Any, outputs: Any) -> int:
        information = outputs.GetInformationObject(0)
        information.Set(vtkStreamingDemandDrivenPipeline.TIME_STEPS(), self.times, len(self.times))
        information.Set(vtkStreamingDemandDrivenPipeline.TIME_RANGE(), [self.times[0], self.times[-1]], 2)
        return 1

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        self.request = request
        time = outputs.GetInformationObject(0).Get(vtkStreamingDemandDrivenPipeline.UPDATE_TIME_STEP())
        while self.taken <= self.times.index(time):
            self.requests.put(self.taken)
            frame = self.answers.get()
            if frame is None:
                self._end()
                break
            self.frame = frame
            self.taken += 1
        vtkPolyData.GetData(outputs).ShallowCopy(self.frame or pv.PolyData())
        return 1  # also after the last, or the writer would ask for the same step for ever

    def _stop(self, *_: object) -> None:
        """End the loop over the steps after an error of the writer: VTK would go round in it for ever."""
        self.failed = True
        if self.request is not None:
            self.request.Remove(vtkStreamingDemandDrivenPipeline.CONTINUE_EXECUTING())

    def _end(self) -> None:
        """Tell the writer that there are no more steps: it would go through all of them, even when it is aborted."""
        information = self.GetOutputInformation(0)
        count = max(self.taken, 1)
        information.Set(vtkStreamingDemandDrivenPipeline.TIME_STEPS(), self.times[:count], count)
        request, inputs = vtkInformation(), vtkCollection()
        request.Set(vtkDemandDrivenPipeline.REQUEST_INFORMATION())
        inputs.AddItem(self.writer.GetExecutive().GetInputInformation(0))
        self.writer.ProcessRequest(request, inputs, self.writer.GetExecutive().GetOutputInformation())
