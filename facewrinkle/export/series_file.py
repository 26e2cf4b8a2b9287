"""VTKHDF files of time series, as VTK writes them."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import pyvista as pv
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonCore import vtkCollection, vtkCommand, vtkInformation
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkCommonExecutionModel import vtkDemandDrivenPipeline, vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader, vtkHDFWriter

from ..disk import reserve

COMPRESSION = 1
"""Level of compression of the HDF5 data, 0 to 9."""

CHUNK = 2000
"""Rows that are compressed together. Those of VTK, 25,000, hold several frames: each would be compressed again with
every frame that is added."""


OVERHEAD, ARRAYS_OF_VTK = 2**18, 6
"""Bytes that the file takes for an array besides its rows, and the number of arrays that VTK adds by itself."""

Writer = Callable[[Iterator[pv.PolyData], list[float], Path], OSError | str | None]
"""Writes frames at times into a file, and returns what went wrong; None if the file is whole."""


def problem_of(frames: Iterator[pv.PolyData], times: list[float], path: Path) -> OSError | str | None:
    """Write the file, and return what went wrong; None if it is whole.

    VTK works in a thread of its own and asks for the frames, which are made in the calling thread: an interrupt by the
    user arrives here, and never inside VTK, which would drop it. The two take turns: VTK in one thread, while another
    draws a frame, may wait for ever, each for a lock of the other. Room for each frame is reserved before VTK has it,
    as HDF5 does not get over a full disk.
    """
    source, room = _FrameSource(times), _Room(path)
    thread = threading.Thread(target=source.write, args=(path,), daemon=True)
    with pv.vtk_verbosity("off"):  # what goes wrong is raised, once
        thread.start()
        try:
            for _ in iter(source.requests.get, None):
                frame = next(frames)
                try:
                    room.reserve(frame)
                except OSError as problem:
                    return problem
                source.answers.put(frame)
            if source.taken == len(times):
                next(frames, None)  # refuses one more
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


class _FrameSource(VTKPythonAlgorithmBase):
    """A VTK source that hands frames to a writer, one for each time step, in order.

    Attributes
    ----------
    requests : SimpleQueue
        A number for each frame that the writer wants, and None when it is done.
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
