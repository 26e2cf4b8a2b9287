"""Files that commands write, as tests read them."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader


def picture_shape(path: Path) -> tuple[int, ...]:
    """Height and width of a picture."""
    return pv.read_texture(path).to_array().shape[:2]


def movie_frames(path: Path, height: int, width: int) -> np.ndarray:
    """Pictures of a movie of this size, decoded by ffmpeg itself."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    given = ["-loglevel", "error", "-i", str(path), "-fps_mode", "passthrough"]
    command = [ffmpeg, *given, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    raw = subprocess.run(command, capture_output=True, check=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, height, width, 3)


def read_series(path: Path) -> tuple[list[float], list[pv.PolyData]]:
    """Times and meshes of a series."""
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    information = reader.GetExecutive().GetOutputInformation(0)
    key = vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    times = [information.Get(key, step) for step in range(reader.GetNumberOfSteps())]
    meshes = []
    for time in times:
        reader.UpdateTimeStep(time)
        meshes.append(pv.wrap(reader.GetOutput()).copy())
    return times, meshes


def in_usd(path: Path, name: str, time: float) -> pv.PolyData:
    """A mesh of a USD file at a time, s: with bones and blend shapes as UsdSkel bakes them."""
    from pxr import Usd, UsdGeom, UsdSkel

    stage = Usd.Stage.Open(str(path))
    assert UsdSkel.BakeSkinning(UsdSkel.Root.Get(stage, "/Face"))
    mesh = UsdGeom.Mesh.Get(stage, f"/Face/{name}")
    points = mesh.GetPointsAttr().Get(time * stage.GetTimeCodesPerSecond())
    triangles = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
    return pv.PolyData.from_regular_faces(np.array(points, np.float64), triangles)
