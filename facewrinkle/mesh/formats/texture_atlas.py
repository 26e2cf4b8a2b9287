"""The image on a mesh from :func:`facewrinkle.read_surface`; several images become one."""

from __future__ import annotations

from pathlib import Path
from zipfile import BadZipFile, ZipFile

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ...array_types import Image
from ...errors import MeshError, warn
from ..arrays import COLORS, CORNERS, IMAGE, IMAGES, images_of
from ..seams import corner_texture
from .merging import set_texture
from .reading import GLTF
from .textures import LARGEST_SIDE, decoded, image_of_file, image_of_gltf

BORDER = 4
"""Pixels by which each of several images is continued beyond its edges, as renderers blend neighbouring pixels."""

SPILL = 0.02
"""Texture coordinates may go beyond an image by this much without a warning."""


def merged_texture(mesh: pv.PolyData) -> Image | None:
    """Return the image on a mesh; if there are several, merge them and change the texture coordinates of the mesh.

    Several images, such as those of a head and its ears, are put side by side, with a patch of plain colour for
    triangles that have none.

    Parameters
    ----------
    mesh : PolyData
        The result of :func:`facewrinkle.read_surface`, or a part of it.

    Returns
    -------
    ndarray of uint8, shape (h, w, 3), or (h, w, 4) if it is transparent; or None

    Warns
    -----
    FaceWrinkleWarning
        For an image that cannot be read, and if one of several images is repeated.
    """
    numbers = np.asarray(mesh.cell_data.get(IMAGE, np.full(mesh.n_cells, -1)), dtype=np.int64)
    if not (numbers >= 0).any() or mesh.active_texture_coordinates is None:
        return None
    images: dict[int, Image] = {}
    for number in np.unique(numbers[numbers >= 0]).tolist():
        try:
            images[number] = _opened(images_of(mesh)[number])
        except MeshError as problem:
            warn(f"the texture is left out: {problem}")
    if not images:
        return None
    numbers = np.where(np.isin(numbers, list(images)), numbers, -1)
    if (numbers == -1).any():
        images[-1] = _patch(mesh, numbers == -1, images)
    if len(images) == 1:
        return images.popitem()[1]
    return _side_by_side(mesh, numbers, images)


def _opened(source: str) -> Image:
    """Read an image: a file, `a.glb#3` for one in a glTF file, or `a.usdz[b.png]` for one in a USD package."""
    file, _, number = source.rpartition("#")
    if number.isdigit() and Path(file).suffix.lower() in GLTF:
        return image_of_gltf(Path(file), int(number), alpha=True)
    package, _, name = source.removesuffix("]").partition("[")
    if source.endswith("]") and package.lower().endswith(".usdz"):
        try:
            with ZipFile(package) as archive:
                return decoded(archive.read(name), name, alpha=True)
        except (OSError, KeyError, BadZipFile) as problem:
            raise MeshError(f"{Path(package).name} does not hold the image {name!r} ({problem}).") from None
    if not Path(source).is_file():
        raise MeshError(f"the image {Path(source).name!r} is not there. Put it beside the mesh.")
    return image_of_file(Path(source), alpha=True)


def _patch(mesh: pv.PolyData, bare: npt.NDArray[np.bool_], images: dict[int, Image]) -> Image:
    """A small image in the colour of the triangles without an image, else in the median colour of the largest image."""
    colours = mesh.point_data.get(COLORS)
    own = None if colours is None else np.asarray(colours)[np.asarray(mesh.regular_faces)[bare]].reshape(-1, 3)
    if own is None or own.dtype != np.uint8 or own.min() == 255:
        own = max(images.values(), key=lambda image: image.size)[..., :3].reshape(-1, 3)
    return np.tile(np.median(own, axis=0).astype(np.uint8), (2, 2, 1))


def _side_by_side(mesh: pv.PolyData, numbers: npt.NDArray[np.int64], images: dict[int, Image]) -> Image:
    """Put images in a row, by number, and move the texture coordinates of the mesh to their places in it."""
    channels = max(image.shape[2] for image in images.values())
    factor = min(1.0, LARGEST_SIDE / sum(image.shape[1] + 2 * BORDER for image in images.values()))
    row = {number: _padded(_reduced(image, factor), channels) for number, image in images.items()}
    height, width = max(image.shape[0] for image in row.values()), sum(image.shape[1] for image in row.values())
    out = np.zeros((height, width, channels), np.uint8)
    corners = np.array(corner_texture(mesh))
    left, repeated = 0, []
    for number, image in row.items():
        h, w = image.shape[0], image.shape[1]
        out[:h, left : left + w] = image
        mine = numbers == number
        place = corners[mine] if number >= 0 else np.full((mine.sum(), 3, 2), 0.5)
        place = place - np.floor(place.mean(axis=1, keepdims=True))  # images repeat: each triangle lies in one tile
        if len(place) and max(-place.min(), place.max() - 1.0) > SPILL:
            repeated.append(Path(images_of(mesh)[number]).name)
        place = np.clip(place, 0.0, 1.0)
        x = left + BORDER + place[..., 0] * (w - 2 * BORDER)
        y = BORDER + (1.0 - place[..., 1]) * (h - 2 * BORDER)
        corners[mine] = np.stack([x / width, 1.0 - y / height], axis=2)
        left += w
    if repeated:
        warn(
            f"images that are repeated on the mesh, {', '.join(repeated)}, are cut off where they are put into one "
            "with others. Bake the textures into one image."
        )
    for name in (CORNERS, IMAGE):  # the merged image is in no file
        mesh.cell_data.pop(name, None)
    mesh.field_data.pop(IMAGES, None)
    set_texture(mesh, corners)
    return out


def _reduced(image: Image, factor: float) -> Image:
    """Scale an image down by a factor."""
    if factor == 1.0:
        return image
    from PIL import Image as Pillow

    size = [max(int(factor * side), 1) for side in image.shape[1::-1]]
    return np.asarray(Pillow.fromarray(image).resize((size[0], size[1]), Pillow.Resampling.BOX))


def _padded(image: Image, channels: int) -> Image:
    """Add an opaque channel to an image that lacks one, and continue the image by `BORDER` on all sides."""
    if image.shape[2] < channels:
        image = np.dstack([image, np.full(image.shape[:2], 255, np.uint8)])
    return np.pad(image, ((BORDER, BORDER), (BORDER, BORDER), (0, 0)), mode="edge")
