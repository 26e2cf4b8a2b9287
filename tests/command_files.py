"""Files that commands write, as tests read them."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from vtkmodules.vtkIOHDF import vtkHDFReader


def picture_shape(path: Path) -> tuple[int, ...]:
    """Height and width of a picture."""
    return pv.read_texture(path).to_array().shape[:2]


def movie_frames(path: Path, height: int, width: int) -> np.ndarray:
    """Pictures of a movie of this size, decoded by ffmpeg itself."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    command = [ffmpeg, "-loglevel", "error", "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    raw = subprocess.run(command, capture_output=True, check=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, height, width, 3)


def series_meshes(path: Path) -> list[pv.PolyData]:
    """Meshes of all steps of a time series."""
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    meshes = []
    for step in range(reader.GetNumberOfSteps()):
        reader.SetStep(step)
        reader.Update()
        mesh = pv.PolyData()
        mesh.copy_from(pv.wrap(reader.GetOutput()))
        meshes.append(mesh)
    return meshes
