"""Textures as pictures need them: reduced once to the resolution at which they are seen.

VTK would sample a texture with mipmaps and anisotropic filters, up to eight samples of four texels for each pixel; in
software that costs more than everything else in a picture. The camera of a scene stands still, so that one level of
the mipmap serves all of its pictures.
"""

from __future__ import annotations

import numpy as np
import pyvista as pv

from ..array_types import Array, Image
from .images import reduced


def texture(image: Image, texels: float = 1.0) -> pv.Texture:
    """Return an image as a texture of a surface on which a pixel of the picture is `texels` texels wide.

    Examples
    --------
    >>> texture(np.zeros((512, 512, 3), np.uint8), texels=3.7).dimensions
    (128, 128)
    """
    levels = max(int(np.rint(np.log2(max(texels, 1.0)))), 0)
    factor = min(2**levels, *image.shape[:2])
    seen = pv.Texture(np.array(image) if factor == 1 else reduced(np.ascontiguousarray(image), factor))
    seen.interpolate = True
    seen.SetMaximumAnisotropicFiltering(1.0)
    return seen


def texels_per_pixel(mesh: pv.PolyData, corners: Array, image: Image, pixel: float) -> float:
    """Return how many texels lie side by side on a pixel, where the surface faces the camera: the median over its area.

    Parameters
    ----------
    mesh : PolyData
    corners : ndarray, shape (m, 3, 2)
        Texture coordinates of the corners of its triangles.
    image : ndarray, shape (height, width, 3 or 4)
    pixel : float
        Width of a pixel, in the unit of the mesh.

    Examples
    --------
    >>> sheet = pv.Plane().triangulate()
    >>> corners = np.asarray(sheet.active_texture_coordinates)[sheet.regular_faces]
    >>> round(texels_per_pixel(sheet, corners, np.zeros((200, 200, 3)), pixel=0.01), 3)
    2.0
    """
    place = np.asarray(mesh.points)[mesh.regular_faces]
    area = np.linalg.norm(np.cross(place[:, 1] - place[:, 0], place[:, 2] - place[:, 0]), axis=1)
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    covered = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) * image.shape[0] * image.shape[1]
    if not area.any():
        return 1.0
    side = np.sqrt(covered / np.maximum(area, 1e-300)) * pixel
    order = np.argsort(side)
    share = np.cumsum(area[order])
    return float(side[order][np.searchsorted(share, 0.5 * share[-1])])
