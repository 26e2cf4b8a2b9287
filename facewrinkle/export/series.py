"""Frames as a VTKHDF time series."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np
import pyvista as pv
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonCore import vtkCollection, vtkInformation
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkCommonExecutionModel import vtkDemandDrivenPipeline, vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFWriter

from ..errors import OutputError, ParameterError, check_range
from ..mesh.files import output_file, replaced

LATEST = float(np.finfo(np.float32).max)


def write_series(frames: Iterable[pv.PolyData], times: Iterable[float], path: str | Path) -> Path:
    """Write frames as one VTKHDF file, which ParaView plays and `pyvista.read` opens at the first time.

    The frames are taken and written one by one, so a generator such as `Simulation.run` is never held in
    memory. Points, triangles, point data and field data (the names of the muscles too) are kept exactly, in
    their own precision, and may change their number from frame to frame. VTK stores the times in single
    precision, and replaces "/" and "." in names by "_".

    Parameters
    ----------
    frames : iterable of pyvista.PolyData
        All with the same arrays.
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
        If there are more times than frames or more frames than times, if the times do not increase, or if a
        frame has other arrays than the first.
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
    with replaced(path) as beside:
        if not _written(iter(frames), steps, beside):
            raise OutputError(f"VTK could not write {str(path)!r}. Is the disk full?")
    return path


def _written(frames: Iterator[pv.PolyData], times: list[float], path: Path) -> bool:
    """Whether VTK wrote the file. It works in a thread of its own and asks for the frames, which are made in this one:
    an interrupt of the user comes here, and never inside VTK, which would drop it.
    """
    source, frame = _FrameSource(times), None
    thread = threading.Thread(target=source.write, args=(path,), daemon=True)
    with pv.vtk_verbosity("off"):  # what goes wrong is raised, once
        thread.start()
        try:
            for taken in iter(source.asked.get, None):
                frame = _checked(next(frames, None), frame, taken, len(times))
                source.given.put(frame)
            if source.taken == len(times) and next(frames, None) is not None:
                raise ParameterError(f"every frame needs a time, received {len(times)} times and more frames.")
        finally:
            source.given.put(None)  # whatever else it asks for
            thread.join()
    return source.written and path.exists()


def _checked(frame: pv.PolyData | None, before: pv.PolyData | None, taken: int, count: int) -> pv.PolyData:
    """The frame, if there is one and it has the arrays of the one before."""
    if frame is None:
        raise ParameterError(f"{count} times need as many frames, received {taken} frames.")
    arrays, first = _arrays(frame), _arrays(before or frame)
    if arrays != first:
        raise ParameterError(
            f"all frames must have the point arrays of the first, {first}; frame {taken} has {arrays}."
        )
    return frame


def _arrays(frame: pv.PolyData) -> dict[str, tuple[str, tuple[int, ...]]]:
    return {name: (values.dtype.name, values.shape[1:]) for name, values in frame.point_data.items()}


COMPRESSION = 1
"""Of the HDF5 data, 0 to 9."""


class _FrameSource(VTKPythonAlgorithmBase):
    """Hands the frames to a VTK writer, one for each time step, in order."""

    def __init__(self, times: list[float]) -> None:
        super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkPolyData")
        self.times = times
        self.asked: SimpleQueue[int | None] = SimpleQueue()
        """Numbers of the frames that the writer wants, and None after the last."""
        self.given: SimpleQueue[pv.PolyData | None] = SimpleQueue()
        """The frames, and None where there are no more."""
        self.frame: pv.PolyData | None = None
        self.taken = 0
        self.written = False
        self.writer = vtkHDFWriter()
        self.writer.SetInputConnection(self.GetOutputPort())
        self.writer.SetWriteAllTimeSteps(True)
        self.writer.SetCompressionLevel(COMPRESSION)

    def write(self, path: Path) -> None:
        """Write the file, up to the last frame that is given."""
        try:
            self.writer.SetFileName(str(path))
            self.written = bool(self.writer.Write())
        finally:
            self.asked.put(None)

    def RequestInformation(self, request: Any, inputs: Any, outputs: Any) -> int:
        information = outputs.GetInformationObject(0)
        information.Set(vtkStreamingDemandDrivenPipeline.TIME_STEPS(), self.times, len(self.times))
        information.Set(vtkStreamingDemandDrivenPipeline.TIME_RANGE(), [self.times[0], self.times[-1]], 2)
        return 1

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        time = outputs.GetInformationObject(0).Get(vtkStreamingDemandDrivenPipeline.UPDATE_TIME_STEP())
        while self.taken <= self.times.index(time):
            self.asked.put(self.taken)
            frame = self.given.get()
            if frame is None:
                self._end()
                break
            self.frame = frame
            self.taken += 1
        vtkPolyData.GetData(outputs).ShallowCopy(self.frame or pv.PolyData())
        return 1  # also after the last: the writer would ask for the same step for ever

    def _end(self) -> None:
        """The writer would go on through all steps, even when it is aborted: it hears that there are no more."""
        information = self.GetOutputInformation(0)
        count = max(self.taken, 1)
        information.Set(vtkStreamingDemandDrivenPipeline.TIME_STEPS(), self.times[:count], count)
        request, inputs = vtkInformation(), vtkCollection()
        request.Set(vtkDemandDrivenPipeline.REQUEST_INFORMATION())
        inputs.AddItem(self.writer.GetExecutive().GetInputInformation(0))
        self.writer.ProcessRequest(request, inputs, self.writer.GetExecutive().GetOutputInformation())
