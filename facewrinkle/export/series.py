"""Frames as a VTKHDF time series."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonCore import vtkCollection, vtkInformation
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkCommonExecutionModel import vtkDemandDrivenPipeline, vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFWriter

from .._files import replaced
from ..errors import OutputError, ParameterError, check_range
from .files import output_file

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
    source = _FrameSource(iter(frames), steps)
    with replaced(path) as beside:
        writer = vtkHDFWriter()
        writer.SetInputConnection(source.GetOutputPort())
        source.stop = lambda: _told_of_fewer_steps(writer, source)
        writer.SetFileName(str(beside))
        writer.SetWriteAllTimeSteps(True)
        writer.SetCompressionLevel(COMPRESSION)
        with pv.vtk_verbosity("off"):  # what goes wrong is raised below, once
            written = writer.Write()
        problem = source.problem or source.unfinished()
        if problem is None and not (written and beside.exists()):
            problem = OutputError(f"VTK could not write {str(path)!r}. Is the disk full?")
        if problem is not None:
            raise problem
    return path


def _told_of_fewer_steps(writer: vtkHDFWriter, source: _FrameSource) -> None:
    """The writer would go on through all steps, even when it is aborted: it hears that there are no more."""
    information = source.GetOutputInformation(0)
    count = max(source.taken, 1)
    information.Set(vtkStreamingDemandDrivenPipeline.TIME_STEPS(), source.times[:count], count)
    request, inputs = vtkInformation(), vtkCollection()
    request.Set(vtkDemandDrivenPipeline.REQUEST_INFORMATION())
    inputs.AddItem(writer.GetExecutive().GetInputInformation(0))
    writer.ProcessRequest(request, inputs, writer.GetExecutive().GetOutputInformation())


COMPRESSION = 1
"""Of the HDF5 data, 0 to 9."""


class _FrameSource(VTKPythonAlgorithmBase):
    """Hands the frames to a VTK pipeline, one for each time step, in order."""

    def __init__(self, frames: Iterator[pv.PolyData], times: list[float]) -> None:
        super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkPolyData")
        self.frames = frames
        self.times = times
        self.taken = 0
        self.arrays: dict[str, tuple[str, tuple[int, ...]]] | None = None
        self.frame = pv.PolyData()
        self.problem: BaseException | None = None
        self.stop: Callable[[], None] = lambda: None

    def RequestInformation(self, request: Any, inputs: Any, outputs: Any) -> int:
        information = outputs.GetInformationObject(0)
        information.Set(vtkStreamingDemandDrivenPipeline.TIME_STEPS(), self.times, len(self.times))
        information.Set(vtkStreamingDemandDrivenPipeline.TIME_RANGE(), [self.times[0], self.times[-1]], 2)
        return 1

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        asked = outputs.GetInformationObject(0).Get(vtkStreamingDemandDrivenPipeline.UPDATE_TIME_STEP())
        try:
            while self.problem is None and self.taken <= self.times.index(asked):
                self.frame = self._next()
        except BaseException as problem:  # VTK would swallow it; write_series raises it again
            self.problem = problem
            self.stop()
        vtkPolyData.GetData(outputs).ShallowCopy(self.frame)
        return 1  # also after a problem: the writer would ask for the same step for ever

    def _next(self) -> pv.PolyData:
        frame = next(self.frames, None)
        if frame is None:
            raise ParameterError(f"{len(self.times)} times need as many frames, received {self.taken} frames.")
        arrays = {name: (values.dtype.name, values.shape[1:]) for name, values in frame.point_data.items()}
        if self.arrays is not None and arrays != self.arrays:
            raise ParameterError(
                f"all frames must have the point arrays of the first, {self.arrays}; frame {self.taken} has {arrays}."
            )
        self.arrays = arrays
        self.taken += 1
        return frame

    def unfinished(self) -> ParameterError | None:
        """The error for frames that have no time."""
        if next(self.frames, None) is None:
            return None
        return ParameterError(f"every frame needs a time, received {len(self.times)} times and more frames.")
