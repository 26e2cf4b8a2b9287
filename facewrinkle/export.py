"""Frames and pictures as files: a VTKHDF time series, a movie, and the folder they go to."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from stat import S_ISDIR
from tempfile import TemporaryFile
from types import ModuleType
from typing import Any

import numpy as np
import pyvista as pv
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFWriter

from .errors import MissingPackageError, OutputError, ParameterError, check_range

__all__ = ["movie_writer", "output_folder", "write_movie", "write_series"]


def output_folder(path: str | Path, make: bool = True) -> Path:
    """The folder, made if need be, after a file could be written into it.

    Parameters
    ----------
    path : str or Path
    make : bool
        False only looks whether it could be made: before long work.

    Raises
    ------
    OutputError
        If a file stands in its place or on the way to it, or if it cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as parent:
    ...     output_folder(f"{parent}/pictures/smile").name
    'smile'
    """
    folder = Path(os.path.expanduser(path))
    try:
        if make:
            folder.mkdir(parents=True, exist_ok=True)
        there = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
        with TemporaryFile(dir=there):  # permission bits would not tell: root passes them
            pass
    except (FileExistsError, NotADirectoryError):
        raise OutputError(
            f"{str(folder)!r} cannot be an output folder: a file stands there or on the way to it. Name another folder."
        ) from None
    except (OSError, ValueError) as problem:
        raise OutputError(
            f"{str(folder)!r} cannot be written: {getattr(problem, 'strerror', problem)}. "
            "Name a folder that you may write to."
        ) from None
    return folder


def _output_file(path: str | Path, endings: Sequence[str]) -> Path:
    path = Path(os.path.expanduser(path))
    if path.suffix.lower() not in endings:
        raise OutputError(f"the file must end in {' or '.join(endings)}, received {path.name!r}.")
    output_folder(path.parent)
    try:
        folder = S_ISDIR(path.stat().st_mode)
    except FileNotFoundError:
        folder = False
    except (OSError, ValueError) as problem:
        raise OutputError(f"{str(path)!r} cannot be written: {problem}. Name another file.") from None
    if folder:
        raise OutputError(f"{str(path)!r} is a folder, and a file is to be written. Name a file in it.")
    return path


# --- time series --------------------------------------------------------------------------------


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
    path = _output_file(path, (".vtkhdf", ".hdf"))
    steps = [check_range("a time", time, -LATEST, LATEST) for time in times]
    stored = np.array(steps, dtype=np.float32)
    if not steps or not np.isfinite(stored).all() or not (np.diff(stored) > 0).all():
        raise ParameterError(f"times must be finite and increase (as float32), received {steps[:8]}.")
    source = _FrameSource(iter(frames), steps)
    path.unlink(missing_ok=True)
    writer = vtkHDFWriter()
    writer.SetInputConnection(source.GetOutputPort())
    writer.SetFileName(str(path))
    writer.SetWriteAllTimeSteps(True)
    writer.SetCompressionLevel(COMPRESSION)
    with pv.vtk_verbosity("off"):  # what goes wrong is raised below, once
        written = writer.Write()
    problem = source.problem or source.unfinished()
    if problem is None and not written:
        problem = OutputError(f"VTK could not write {str(path)!r}. Is the disk full?")
    if problem is not None:
        path.unlink(missing_ok=True)
        raise problem
    return path


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


# --- movies -------------------------------------------------------------------------------------


def write_movie(images: Iterable[np.ndarray], path: str | Path, fps: float = 25.0) -> Path:
    """Write pictures as an .mp4 (H.264) or an endless .gif, one by one.

    H.264 needs even sizes: an odd picture gets its last row or column twice, nothing is rescaled. A GIF
    counts in hundredths of a second, and shows a picture that is repeated once, for as long.

    Parameters
    ----------
    images : iterable of (height, width, 3 or 4) uint8 arrays
        All of one size. Transparency is dropped.
    path : path
        Ends in .mp4 or .gif. An existing file is replaced.
    fps : float
        Pictures in a second, 1 to 100.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    MissingPackageError
        Without imageio and its ffmpeg (extra `export`).
    ParameterError
        If there are no pictures, or one has another shape or type.
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import numpy as np, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     pictures = (np.full((8, 8, 3), 20 * i, np.uint8) for i in range(5))
    ...     write_movie(pictures, f"{folder}/grey.gif", fps=10).name
    'grey.gif'
    """
    with movie_writer(path, fps) as append:
        for image in images:
            append(image)
    return Path(os.path.expanduser(path))


@contextmanager
def movie_writer(path: str | Path, fps: float = 25.0) -> Iterator[Callable[[np.ndarray], None]]:
    """The function that appends a picture to a movie, for pictures that come one at a time; see :func:`write_movie`.

    Examples
    --------
    >>> import numpy as np, tempfile
    >>> with tempfile.TemporaryDirectory() as folder, movie_writer(f"{folder}/grey.gif") as append:
    ...     for i in range(5):
    ...         append(np.full((8, 8, 3), 20 * i, np.uint8))
    """
    path = _output_file(path, (".mp4", ".gif"))
    fps = check_range("fps", fps, 1.0, 100.0)
    movie = path.suffix.lower() == ".mp4"
    imageio = _imageio(movie)
    settings: dict[str, Any] = (
        {"fps": fps, "codec": "libx264", "quality": 8, "macro_block_size": 1, "ffmpeg_log_level": "error"}
        if movie
        else {"duration": 1000.0 / fps, "loop": 0}
    )
    writer: Any = None
    shapes: list[tuple[int, ...]] = []

    def append(image: np.ndarray) -> None:
        nonlocal writer
        image = _checked(image, shapes)
        if writer is None:  # not before there is a picture: nothing is left behind after an error
            writer = imageio.get_writer(path, mode="I", **settings)
        writer.append_data(_even(image) if movie else image)

    try:
        try:
            yield append
        finally:
            if writer is not None:
                writer.close()
    except BaseException as problem:
        if writer is not None:  # half a movie is of no use
            path.unlink(missing_ok=True)
        if isinstance(problem, OSError):
            raise OutputError(f"{str(path)!r} cannot be written: {problem}.") from None
        raise
    if writer is None:
        raise ParameterError("a movie needs one picture at least, received none.")


def _imageio(movie: bool) -> ModuleType:
    try:
        import imageio.v2 as imageio

        if movie:
            import imageio_ffmpeg  # noqa: F401
    except ImportError as missing:
        raise MissingPackageError(
            f"movies need the package {missing.name}, which is not installed. pip install 'facewrinkle[export]'"
        ) from None
    return imageio


def _checked(image: np.ndarray, shapes: list[tuple[int, ...]]) -> np.ndarray:
    """The picture without transparency, if it has the shape of those before, to which its own is added."""
    image = np.asarray(image)
    if image.ndim != 3 or image.shape[2] not in (3, 4) or image.dtype != np.uint8 or not image.size:
        raise ParameterError(
            f"pictures must be uint8 arrays (height, width, 3 or 4), received {image.dtype} of {image.shape}."
        )
    shapes.append(image.shape[:2])
    if shapes[-1] != shapes[0]:
        raise ParameterError(f"all pictures must be {shapes[0]} as the first, {len(shapes) - 1} is {shapes[-1]}.")
    return image[..., :3]


def _even(image: np.ndarray) -> np.ndarray:
    height, width = image.shape[:2]
    return np.pad(image, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
