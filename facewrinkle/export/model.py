"""A mesh as other programs take it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Model:
    """A mesh as other programs take it: each vertex has one normal and one place in the texture.

    Attributes
    ----------
    points, normals : (n, 3) float
    triangles : (m, 3) int
    origin : (n,) int
        The vertex of the frame that each one is; the frame's own come first, then their twins at texture seams.
    uv : (n, 2) float, optional
        Texture coordinates, v upwards.
    colours : (n, 3) uint8, optional
    png : bytes, optional
        The texture.
    cutout : bool
        What is transparent in the texture is not drawn.
    clear : bool
        It is water.
    """

    points: Array
    normals: Array
    triangles: npt.NDArray[np.int64]
    origin: npt.NDArray[np.int64]
    uv: Array | None
    colours: Image | None
    png: bytes | None
    cutout: bool = False
    clear: bool = False
