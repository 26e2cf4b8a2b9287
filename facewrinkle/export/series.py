"""Frames as a time series: a VTKHDF file, or a .pvd file with a .vtp file for each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from io import FileIO
from itertools import chain, count
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pyvista as pv
from vtkmodules.util.numpy_support import vtk_to_numpy

from ..array_types import Array
from ..errors import ParameterError
from ..files import not_written, output_file, replaced, write_whole


def write_series(frames: Iterable[pv.PolyData], times: Iterable[float], path: str | Path) -> Path:
    """Write frames as one VTKHDF file, which ParaView plays and `pyvista.read` opens at the first time; or as a .pvd.

    `pyvista.get_reader` plays a .pvd, with its times; its frames are .vtp files in a folder of the same name beside it.

    Frames are taken and written one by one, so those of a generator such as `Simulation.run` are never all in memory.
    Points, triangles, data of points and cells, and field data (also the names of the muscles) are kept exactly, in
    their own precision, and their number may change from frame to frame. In names of arrays in VTKHDF, "/" and "."
    become "_", with a number behind where two would be alike.

    Parameters
    ----------
    frames : iterable of pyvista.PolyData
        All with the same arrays.
    times : iterable of float
        One for each frame, increasing.
    path : path
        Ends in .vtkhdf, .hdf or .pvd. An existing file is replaced.

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

    Read back by PyVista:

    >>> with tempfile.TemporaryDirectory() as folder:
    ...     frames = (pv.Sphere(theta_resolution=n) for n in (8, 16))
    ...     reader = pv.get_reader(write_series(frames, [0.0, 0.5], f"{folder}/series.pvd"))
    ...     reader.set_active_time_value(0.5)
    ...     reader.time_values, reader.read()[0].n_points == pv.Sphere(theta_resolution=16).n_points
    ([0.0, 0.5], True)
    """
    path = output_file(path, (".vtkhdf", ".hdf", ".pvd"))
    steps = np.array(list(times), dtype=np.float64)
    if not len(steps) or not np.isfinite(steps).all() or not (np.diff(steps) > 0).all():
        raise ParameterError(f"times must be finite and increase, received {steps[:8].tolist()}.")
    if path.suffix.lower() == ".pvd":
        return _write_pvd(_checked(iter(frames), len(steps)), steps, path)
    with replaced(path) as whole, ThreadPoolExecutor(max_workers=1) as thread:
        # HDF5 works in a thread of its own, into which Ctrl-C does not break; this one waits for it.
        series = thread.submit(_SeriesFile, whole).result()
        try:
            for frame, time in zip(_checked(iter(frames), len(steps)), steps, strict=True):
                thread.submit(series.add, frame, time).result()
                if series.disk.problem is not None:
                    break
        finally:
            thread.submit(series.close).result()
        if series.disk.problem is not None:
            raise not_written(path, series.disk.problem)
    return path


def _write_pvd(frames: Iterator[pv.PolyData], times: Array, path: Path) -> Path:
    """Write each frame as a .vtp file in a folder beside, and then the list of them, with their times."""
    root = ElementTree.Element("VTKFile", type="Collection", version="0.1")
    collection = ElementTree.SubElement(root, "Collection")
    with ExitStack() as files:  # all take their places at the end
        for number, (frame, time) in enumerate(zip(frames, times.tolist(), strict=True)):
            name = f"{path.stem}/{path.stem}_{number:04}.vtp"
            frame.save(files.enter_context(replaced(path.parent / name)))
            ElementTree.SubElement(collection, "DataSet", timestep=repr(time), part="0", file=name)
    return write_whole(path, ElementTree.tostring(root))


def _checked(frames: Iterator[pv.PolyData], count: int) -> Iterator[pv.PolyData]:
    """Yield frames after checking that each has the arrays of the first; in the end, that they are as many as times."""
    first: dict[str, object] = {}
    for number in range(count):
        frame = next(frames, None)
        if frame is None:
            raise ParameterError(f"{count} times need as many frames, received {number} frames.")
        arrays = _arrays(frame)
        first = arrays if number == 0 else first
        if arrays != first:
            odd = {name: arrays.get(name, "none") for name in arrays | first if arrays.get(name) != first.get(name)}
            raise ParameterError(
                f"all frames must have the arrays of the first, {first}; frame {number} has other ones: {odd}."
            )
        yield frame
    if next(frames, None) is not None:
        raise ParameterError(f"every frame needs a time, received {count} times and more frames.")


def _arrays(frame: pv.PolyData) -> dict[str, object]:
    """Return types and shapes of the arrays of points and cells, and the names of the others."""
    rows = {**frame.point_data, **frame.cell_data}
    types = {name: (values.dtype.name, values.shape[1:]) for name, values in rows.items()}
    return types | dict.fromkeys(frame.field_data, "field data")


class _SeriesFile:
    """A VTKHDF file ("transient PolyData"): arrays of all frames in a row, and where those of each frame begin.

    Attributes
    ----------
    disk : _Disk
        Nothing is added after its first error.
    """

    def __init__(self, path: Path) -> None:
        import h5py  # a fifth of a second

        self.disk = _Disk(path)
        self._file = h5py.File(self.disk, "w")
        self._root = self._file.create_group("VTKHDF")
        self._root.attrs.update(Type=np.bytes_("PolyData"), Version=[2, 2])
        self._arrays: dict[str, h5py.Dataset] = {}
        self._names: dict[str, dict[str, str]] = {}
        self._tables: dict[str, list[Any]] = {}
        self._text = h5py.string_dtype("ascii")  # as VTK has it: its reader fails on others
        self._count = 0

    def add(self, frame: pv.PolyData, time: float) -> None:
        """Add a frame."""
        points = np.asarray(frame.points)
        self._tell("Steps/PointOffsets", self._append("Points", points))
        self._tell("NumberOfPoints", len(points))
        cells, ids = [], []
        for kind, name in (("Vertices", "Verts"), ("Lines", "Lines"), ("Polygons", "Polys"), ("Strips", "Strips")):
            array = getattr(frame, f"Get{name}")()
            offsets, connectivity = vtk_to_numpy(array.GetOffsetsArray()), vtk_to_numpy(array.GetConnectivityArray())
            self._tell(f"{kind}/NumberOfCells", len(offsets) - 1)
            self._tell(f"{kind}/NumberOfConnectivityIds", len(connectivity))
            cells.append(self._append(f"{kind}/Offsets", offsets.astype(np.int64)) - self._count)
            ids.append(self._append(f"{kind}/Connectivity", connectivity.astype(np.int64)))
        self._tell("Steps/CellOffsets", cells)
        self._tell("Steps/ConnectivityIdOffsets", ids)
        self._tell("Steps/Values", time)
        self._tell("Steps/PartOffsets", self._count)
        self._tell("Steps/NumberOfParts", 1)
        for group, data in (("Point", frame.point_data), ("Cell", frame.cell_data), ("Field", frame.field_data)):
            self._add_data(f"{group}Data", data)
        self._count += 1

    def _add_data(self, group: str, data: pv.DataSetAttributes) -> None:
        names = self._names.setdefault(group, _stored_names(data.keys()))
        for name, values in data.items():
            stored, rows = names[name], np.atleast_1d(values)
            self._tell(f"Steps/{group}Offsets/{stored}", self._append(f"{group}/{stored}", rows))
            if group == "FieldData":
                self._tell(f"Steps/FieldDataSizes/{stored}", [int(np.prod(rows.shape[1:])), len(rows)])
        if self._count == 0 and group != "FieldData":
            for number in range(data.NUM_ATTRIBUTES):
                active = data.GetAbstractAttribute(number)
                if active is not None and self.disk.problem is None:
                    kind = np.bytes_(data.GetAttributeTypeAsString(number))
                    self._root[f"{group}/{names[active.GetName()]}"].attrs["Attribute"] = kind

    def _tell(self, name: str, number: Any) -> None:
        """Add a row to a small table, which is written in the end."""
        self._tables.setdefault(name, []).append(number)

    def _append(self, name: str, rows: np.ndarray) -> int:
        """Append rows to an array of the file, and return where they begin."""
        if self.disk.problem is not None:
            return 0
        if rows.dtype.kind == "U":
            rows = np.char.encode(rows, "utf-8").astype(object)
        elif rows.dtype == bool:
            rows = rows.view(np.uint8)
        if name not in self._arrays:
            self._arrays[name] = self._root.create_dataset(
                name,
                shape=(0, *rows.shape[1:]),
                maxshape=(None, *rows.shape[1:]),
                chunks=(2000, *rows.shape[1:]),
                dtype=self._text if rows.dtype == object else rows.dtype,
                compression=1,  # of 9
            )
        array = self._arrays[name]
        begin = len(array)
        array.resize(begin + len(rows), axis=0)
        array[begin:] = rows
        return begin

    def close(self) -> None:
        """Finish the file."""
        if self.disk.problem is None:
            for name, numbers in self._tables.items():
                self._root[name] = np.array(numbers)
            self._root.require_group("Steps").attrs["NSteps"] = self._count
        self._file.close()
        self.disk.close()


def _stored_names(names: Iterable[str]) -> dict[str, str]:
    """Return names of arrays in the file, by their own: without "/" and ".", and with a number where two were alike."""
    plain = {name: name.replace("/", "_").replace(".", "_") for name in names}
    stored = {name: name for name in plain if plain[name] == name}
    for name in [name for name in plain if name not in stored]:
        alike = chain([plain[name]], (f"{plain[name]}_{number}" for number in count(2)))
        stored[name] = next(own for own in alike if own not in stored.values())
    return stored


class _Disk(FileIO):
    """A file that HDF5 writes, which keeps errors of the disk to itself: HDF5 crashes where it cannot write.

    Attributes
    ----------
    problem : OSError, optional
        The first error.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path, "w+")
        self.problem: OSError | None = None

    def write(self, data: Any, /) -> int:
        rest = memoryview(data)
        try:
            while len(rest):
                rest = rest[super().write(rest) :]
        except OSError as problem:
            self.problem = self.problem or problem
        return len(data)

    def read(self, size: int | None = -1, /) -> bytes:
        return super().read(size).ljust(size or 0, b"\0")  # where nothing could be written

    def truncate(self, size: int | None = None, /) -> int:
        try:
            return super().truncate(size)
        except OSError as problem:
            self.problem = self.problem or problem
            return self.tell()
