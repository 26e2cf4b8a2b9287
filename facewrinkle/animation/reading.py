"""Animated files: the mesh at rest, and the recording that moves it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader

from ..errors import MeshError, ParameterError
from ..files import check_file, reading
from ..geometry.normals import vertex_normals
from ..mesh import ARRAYS, UNIT, add_seams, corner_texture, read_surface, to_polydata
from ..mesh.arrays import MOVED, PART, blended, use_texture, with_data
from ..mesh.formats.merging import merged_surfaces
from ..mesh.formats.reading import GLTF, USD
from .gltf import read_gltf
from .recorded import Recorded
from .usd import read_usd

ITERATIONS = 100
"""The most iterations that take the wrinkles off a frame. A fifth of them suffices where wrinkles are shallower than
the edges of the mesh are long.
"""


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
    path = Path(os.path.expanduser(path))
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
        f"{path.suffix!r}."
    )


def _read_series(path: Path) -> tuple[pv.PolyData, Recorded]:
    rest = read_surface(path)  # at the first time
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
    others, other_positions = None, np.zeros(0)
    if _is_simulated(frames[0]):
        others, other_positions, frames = _split_parts(frames)
        rest, positions = _without_wrinkles(frames, path.name)
    else:
        positions = [np.asarray(frame.points) for frame in frames]
        for step, frame in enumerate(frames):
            if frame.n_points != rest.n_points or not np.array_equal(frame.faces, frames[0].faces):
                raise MeshError(
                    f"{path.name}: the mesh changes at step {step}, from {rest.n_points} to {frame.n_points} points. A "
                    "recording needs the same triangles at all times: write it without refinement."
                )
    rest.point_data[MOVED] = blended(np.array(positions) - rest.points)
    # VTK itself writes single precision: this restores 0.1.
    written = [float(str(np.float32(time))) if time == np.float32(time) else time for time in times]
    recorded = Recorded.of_positions(positions, times=written, rest=rest.points)
    if others is None:
        return rest, recorded
    own = Recorded.of_positions(other_positions, times=written, rest=others.points)
    return merged_surfaces([rest, others]), replace(recorded, companions={rest.n_points: own})


def _is_simulated(frame: pv.PolyData) -> bool:
    """Return True if a frame is one of a simulation, with the arrays that hold its wrinkles and its base mesh."""
    return {"W", "level", "rest"} <= set(frame.point_data) and UNIT in frame.field_data


def _split_parts(frames: list[pv.PolyData]) -> tuple[pv.PolyData | None, np.ndarray, list[pv.PolyData]]:
    """Return the parts beside the skin at rest, their positions (f, k, 3), and the frames of the skin alone."""
    if PART not in frames[0].point_data:
        return None, np.zeros(0), frames
    skins = []
    for frame in frames:
        kept = np.flatnonzero(frame[PART] == 0)  # which come first
        triangles = np.asarray(frame.regular_faces)
        rows = triangles[:, 0] < len(kept)
        skins.append(with_data(frame, triangles[rows], kept, rows))
    first = np.asarray(frames[0].regular_faces)
    count = skins[0].n_points
    rows = first[:, 0] >= count
    others = with_data(frames[0], first[rows] - count, np.arange(count, frames[0].n_points), rows)
    others.points = np.asarray(others["rest"])
    return others, np.array([np.asarray(frame.points)[frame[PART] != 0] for frame in frames]), skins


def _without_wrinkles(frames: list[pv.PolyData], name: str) -> tuple[pv.PolyData, list[np.ndarray]]:
    """Return the base mesh of frames of a simulation at rest, and its positions without the wrinkles on it.

    Vertices of the base mesh come first in every frame. The wrinkles displace them along the normals of the moved base
    mesh, which is found by iteration.
    """
    n = int((np.asarray(frames[0]["level"]) == 0).sum())
    plain = next((frame for frame in frames if frame.n_points == n), None)
    for frame in frames:
        if (np.asarray(frame["level"]) == 0).sum() != n or not np.array_equal(frame["rest"][:n], frames[0]["rest"][:n]):
            raise MeshError(f"{name} holds frames of several faces. A recording needs those of one.")
    if plain is None:
        raise MeshError(
            f"{name}: the mesh is refined in all {len(frames)} frames, and none shows the triangles of the face itself."
            " Write the first frame of the simulation too."
        )
    triangles = np.asarray(plain.regular_faces, dtype=np.int32)
    names = [key for key in plain.point_data if key not in {*ARRAYS, "Normals"}]
    rest = to_polydata(plain["rest"], triangles, {key: np.asarray(plain.point_data[key]) for key in names})
    if (texture := plain.point_data.active_texture_coordinates_name) in names:
        use_texture(rest, texture)
    if (corners := corner_texture(plain)) is not None:
        add_seams(rest, corners)
    positions = []
    for frame in frames:
        unit = float(frame.field_data[UNIT][0])
        shown = np.asarray(frame.points, dtype=np.float64)[:n]
        height = np.asarray(frame["W"])[:n, None] / unit
        bare = shown
        for _ in range(ITERATIONS if height.any() else 0):
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
