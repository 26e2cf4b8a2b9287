"""Animated files: the mesh at rest, and the recording that moves it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader

from ..errors import MeshError, ParameterError
from ..files import check_file, path_of, reading
from ..geometry import vertex_normals
from ..mesh import PART, UNIT, Surface, blended, is_frame, surface_in
from ..mesh.formats.reading import GLTF, USD
from .gltf import read_gltf
from .recorded import Recorded, with_companions
from .usd import read_usd


def read_animation(
    path: str | Path,
    *,
    mesh: str | None = None,
    animation: str | None = None,
    shapes: Mapping[str, float] | None = None,
) -> tuple[pv.PolyData, Recorded]:
    """Read an animated file: its mesh at rest, and the recording that moves it.

    From glTF come morph targets (named as in the file) with their weights over time, the motion of the node, and bones
    (linear blend skinning). Points that the file splits at seams of texture or shading, and that move alike, are one
    point here; the cell data "Texture Corners" then holds the texture coordinates of all corners.

    From USD come the time samples of the points and of the place of a mesh, and bones and blend shapes (UsdSkel); the
    mesh is at rest at its first time. From VTKHDF come the positions of all points over time; the first are those at
    rest. A series may hold refined frames of a simulation: then the base mesh is recorded, without wrinkles.

    Other meshes of the file (eyes, teeth, lashes, hair) come after the one that is recorded, as they are at rest;
    :func:`facewrinkle.fit_face` sets them apart. Those that the file moves on the head play that motion, shapes that
    nothing moves follow those of the same names on the face, and everything else goes along with the face.

    Parameters
    ----------
    path : path
        .glb or .gltf, with morph targets, bones or a node that moves; .usd, .usda, .usdc or .usdz, with time samples or
        UsdSkel; .vtkhdf, a time series of one mesh.
    mesh : str, optional
        Name of a mesh or node of a glTF file, name or path of one of a USD file. Default: the one that moves; of
        several, the one with the most points.
    animation : str, optional
        Name of an animation of a glTF file, which is then played alone. Default: the first that moves the mesh, and
        with it those that move other things: exporters write one for each object.
    shapes : dict of str to float, optional
        Shapes (morph targets) of a glTF file and their weights from 0 to 1, in place of an animation: the face takes
        them in one second and holds them. Names in any spelling; one without a side means both.

    Returns
    -------
    mesh : PolyData
        At rest, in the coordinates of the scene, with its texture coordinates (v upwards).
    recorded : Recorded

    Raises
    ------
    MeshError
        If the file cannot be read, or nothing in it moves; for glTF that is compressed (Draco, meshopt); for a series
        whose triangles change.
    UnknownNameError
        For a mesh, an animation or a shape that the file does not have.
    ParameterError
        For a weight outside [0, 1], or shapes of another file than glTF.
    MissingPackageError
        For USD without usd-core (extra `export`).

    Warns
    -----
    FaceWrinkleWarning
        If there are several meshes that move.

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
    path = path_of(path)
    check_file(path)
    if shapes is not None and path.suffix.lower() not in GLTF:
        raise ParameterError(f"shapes can be asked for in .glb and .gltf files, received {path.name}.")
    with reading(path):
        if path.suffix.lower() in GLTF:
            return read_gltf(path, mesh, animation, shapes)
        if path.suffix.lower() in (".vtkhdf", ".hdf"):
            return _read_series(path)
        if path.suffix.lower() in USD:
            return read_usd(path, mesh)
    raise MeshError(
        f"{path.name}: animations are read from .glb, .gltf, .vtkhdf, .usd, .usda, .usdc and .usdz files, received "
        f"{path.suffix!r}. Takes of phones and trackers are .csv, .tsv, .txt or .json files."
    )


def _read_series(path: Path) -> tuple[pv.PolyData, Recorded]:
    rest = surface_in(path)  # at the first time
    with pv.vtk_verbosity("off"):
        reader = vtkHDFReader()
        reader.SetFileName(str(path))
        reader.UpdateInformation()
        times = reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS()) or ()
        if len(times) < 2:
            raise MeshError(
                f"{path.name} holds a single time, and no animation. read_surface and fit_face read meshes."
            )
        frames = [_frame(reader, step) for step in range(len(times))]
    simulated = is_frame(frames[0])
    if simulated:
        rest, positions = _without_wrinkles(frames, path.name)
    else:
        positions = [np.asarray(frame.points) for frame in frames]
        for step, frame in enumerate(frames):
            if frame.n_points != len(rest.points) or not np.array_equal(frame.faces, frames[0].faces):
                raise MeshError(
                    f"{path.name}: the mesh changes at step {step}, from {len(rest.points)} to {frame.n_points} points."
                    " A recording needs the same triangles at all times: write it without refinement."
                )
    # VTK itself writes single precision: this restores 0.1.
    written = [float(str(np.float32(time))) if time == np.float32(time) else time for time in times]
    recorded = Recorded.of_positions(positions, times=written, rest=rest.points)
    rest = replace(rest, shapes=blended(np.array(positions) - rest.points)[None])
    if not simulated or PART not in frames[0].point_data:
        return rest.to_polydata(), recorded
    others = _part_of(frames[0], np.arange(_skin_size(frames[0]), frames[0].n_points))
    moved = [np.asarray(frame.points)[_skin_size(frame) :] for frame in frames]
    own = Recorded.of_positions(moved, times=written, rest=others.points)
    return with_companions(rest, recorded, [(others, own)])


def _skin_size(frame: pv.PolyData) -> int:
    """Return the number of points of the skin, which come before those of other parts."""
    return int((frame[PART] == 0).sum()) if PART in frame.point_data else frame.n_points


def _part_of(frame: pv.PolyData, points: np.ndarray) -> Surface:
    """Return the triangles on consecutive points of a frame of a simulation, where these are at rest."""
    whole = Surface.of(frame)
    rows = (whole.triangles[:, 0] >= points[0]) & (whole.triangles[:, 0] <= points[-1])
    part = whole.mapped(whole.triangles[rows] - points[0], points, rows)
    return replace(part, points=np.asarray(frame["rest"], np.float64)[points])


def _without_wrinkles(frames: list[pv.PolyData], name: str) -> tuple[Surface, list[np.ndarray]]:
    """Return the base mesh of frames of a simulation at rest, and its positions without the wrinkles on it.

    Vertices of the base mesh come first in every frame. The wrinkles displace them along the normals of the moved base
    mesh, which is found by iteration.
    """
    n = int((np.asarray(frames[0]["level"])[: _skin_size(frames[0])] == 0).sum())
    plain = next((frame for frame in frames if _skin_size(frame) == n), None)
    if plain is None:
        raise MeshError(
            f"{name}: the mesh is refined in all {len(frames)} frames, and none shows the triangles of the face itself."
            " Write the first frame of the simulation too."
        )
    rest = _part_of(plain, np.arange(n))
    triangles, positions = rest.triangles.astype(np.int32), []
    for frame in frames:
        unit = float(frame.field_data[UNIT][0])
        shown = np.asarray(frame.points, dtype=np.float64)[:n]
        height = np.asarray(frame["W"])[:n, None] / unit
        bare = shown
        # A fifth of them suffices where wrinkles are shallower than the edges of the mesh are long.
        for _ in range(100 if height.any() else 0):
            before, bare = bare, shown - height * vertex_normals(bare, triangles)
            if np.abs(bare - before).max() <= 1e-12 * np.abs(shown).max():
                break
        positions.append(bare)
    return rest, positions


def _frame(reader: Any, step: int) -> pv.PolyData:
    reader.SetStep(step)
    reader.Update()
    frame = pv.wrap(reader.GetOutput())
    return frame.copy() if isinstance(frame, pv.PolyData) else pv.PolyData()
