"""Animations that others made: from a file to a mesh at rest and the recording that moves it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader

from ..errors import MeshError
from ..mesh import read_surface
from ..mesh.reading import GLTF, check_file
from .gltf import NAME, read_gltf
from .recorded import Recorded

__all__ = ["NAME", "read_animation"]

SERIES = (".vtkhdf", ".hdf")


def read_animation(
    path: str | Path, mesh: str | None = None, animation: str | None = None
) -> tuple[pv.PolyData, Recorded]:
    """The mesh of an animated file at rest, and the recording that moves it.

    From glTF come morph targets (named as in the file) with their weights over time, and the motion of the node. Points
    that the file splits at seams of texture or shading, and that move alike, are one point here; the cell data "Texture
    Corners" then holds the texture coordinates of all corners. From VTKHDF come the positions of all points over time;
    the first are those at rest.

    Parameters
    ----------
    path : path
        .glb or .gltf, with morph targets or with a node that moves; or .vtkhdf, a time series of one mesh.
    mesh : str, optional
        Name of a mesh or node of a glTF file. Default: the one that moves; of several, the one with the most points.
    animation : str, optional
        Name of an animation of a glTF file. Default: the first that moves the mesh.

    Returns
    -------
    mesh : PolyData
        At rest, in the coordinates of the scene, with its texture coordinates (v upwards).
    recorded : Recorded

    Raises
    ------
    MeshError
        If the file cannot be read, or nothing in it moves; for glTF that is compressed (Draco, meshopt) or moved by
        bones alone; for a series whose triangles change.
    UnknownNameError
        For a mesh or animation that is not there.
    MissingPackageError
        For glTF without pygltflib (extra `export`).

    Warns
    -----
    FaceWrinkleWarning
        If there are several meshes that move, or bones, which are passed over.

    Examples
    --------
    >>> import facewrinkle as fw, tempfile
    >>> sim = fw.Simulation(fw.default_face(), fw.Refinement(max_level=0), layers=[])
    >>> sim.express("surprise")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = fw.export.write_series(sim.run(5), [0.1, 0.2, 0.3, 0.4, 0.5], f"{folder}/surprise.vtkhdf")
    ...     mesh, recorded = read_animation(path)
    >>> mesh.n_cells, round(recorded.duration, 6)
    (4517, 0.4)
    """
    path = Path(os.path.expanduser(path))
    check_file(path)
    if path.suffix.lower() in GLTF:
        return read_gltf(path, mesh, animation)
    if path.suffix.lower() in SERIES:
        return _read_series(path)
    raise MeshError(f"{path.name}: animations are read from .glb, .gltf and .vtkhdf files, received {path.suffix!r}.")


def _read_series(path: Path) -> tuple[pv.PolyData, Recorded]:
    rest = read_surface(path)  # of the first time; its errors are those of any mesh
    with pv.vtk_verbosity("off"):
        reader = vtkHDFReader()
        reader.SetFileName(str(path))
        reader.UpdateInformation()
        times = reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS()) or ()
        if len(times) < 2:
            raise MeshError(f"{path.name} holds one moment, and no animation. read_surface and fit_face read meshes.")
        frames = [_moment(reader, step) for step in range(len(times))]
    for step, frame in enumerate(frames):
        if frame.n_points != rest.n_points or not np.array_equal(frame.faces, frames[0].faces):
            raise MeshError(
                f"{path.name}: the mesh changes at step {step}, from {rest.n_points} to {frame.n_points} points. A "
                "recording needs the same triangles at all times: write it without refinement (max_level=0)."
            )
    written = [float(str(np.float32(time))) for time in times]  # VTK keeps single precision: 0.1 is meant to be 0.1
    return rest, Recorded.of_positions([frame.points for frame in frames], times=written, rest=rest.points)


def _moment(reader: Any, step: int) -> pv.PolyData:
    reader.SetStep(step)
    reader.Update()
    frame = pv.wrap(reader.GetOutput())
    return frame.copy() if isinstance(frame, pv.PolyData) else pv.PolyData()
