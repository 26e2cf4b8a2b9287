"""Images on meshes: named or held by a mesh file, or given by the user; several become one."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ...array_types import Image
from ...errors import MeshError, ParameterError, warn
from ...files import bytes_of, check_file, is_outside, path_of, reading
from ..arrays import COLORS, has_colors, in_bytes
from ..surface import Surface
from .gltf import Document
from .merging import linear_light, srgb
from .reading import GLTF, MeshLike, one_mesh, surface_in

LARGEST_SIDE = 16_384
"""The most pixels along a side; graphics cards take no larger textures."""

BORDER = 4
"""Pixels by which each of several images is continued beyond its edges, as renderers blend neighboring pixels."""

_TINTED = re.compile(r"(.+)\*([-+.\de]+,[-+.\de]+,[-+.\de]+)", re.DOTALL)


def as_texture(image: object) -> Image:
    """Return an image as an array (h, w, 3) of uint8, first row at the top, without transparency.

    Parameters
    ----------
    image : path, ndarray, pyvista.Texture or PIL.Image.Image
        An array has the shape (h, w), (h, w, 3) or (h, w, 4), of uint8 or of numbers from 0 to 1.

    Raises
    ------
    MeshError
        If a file cannot be read.
    ParameterError
        For anything but an image.

    Examples
    --------
    >>> as_texture(np.ones((2, 4))).shape
    (2, 4, 3)
    """
    from PIL import Image as Pillow

    if isinstance(image, str | Path):
        image = image_of_file(path_of(image))
    if isinstance(image, pv.Texture):
        image = image.to_array()
    elif isinstance(image, Pillow.Image):
        image = _in_eight_bits(image).convert("RGB")
    pixels = np.array(image)
    if pixels.dtype.kind == "f" and pixels.size and pixels.min() >= 0.0 and pixels.max() <= 1.0:
        pixels = np.rint(255.0 * pixels).astype(np.uint8)
    if pixels.ndim == 2:
        pixels = np.stack([pixels] * 3, axis=2)
    if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] not in (3, 4) or not pixels.size:
        raise ParameterError(
            "a texture must be the path of an image, a pyvista.Texture or an array of uint8 or of numbers from 0 to 1 "
            f"of the shape (height, width, 3), received {type(image).__name__} of {pixels.dtype} {pixels.shape}."
        )
    return np.ascontiguousarray(pixels[:, :, :3])


def read_texture(source: MeshLike) -> Image | None:
    """Return the image of a mesh file or a trimesh-like object.

    Parameters
    ----------
    source : path, or anything that :func:`facewrinkle.read_surface` takes
        OBJ with a material that has `map_Kd`, PLY with a comment `TextureFile`, glTF with a base color texture. Of
        several, the one on most faces is taken.

    Returns
    -------
    ndarray of uint8, shape (h, w, 3), or None
        First row at the top. None if there is no image.

    Warns
    -----
    FaceWrinkleWarning
        If an image that the file names is missing or cannot be read, or if there are several.

    Examples
    --------
    The image written with a sheet, 8 pixels wide and 4 high:

    >>> import pyvista as pv
    >>> import tempfile
    >>> import facewrinkle as fw
    >>> sheet = fw.surface(pv.Plane(), texture=np.full((4, 8, 3), 200, np.uint8))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     read_texture(fw.write_mesh(sheet.mesh, f"{folder}/sheet.obj", sheet)).shape
    (4, 8, 3)
    """
    if isinstance(source, str | Path):
        source = path_of(source)
    elif (image := _of_object(source)) is not None:
        return image
    else:
        source = surface_in(source)  # what is no mesh is an error, unlike an image that cannot be read
    name = source.name if isinstance(source, Path) else "the mesh"
    try:
        names, numbers = surface_in(source).images
        counts = np.bincount(numbers[numbers >= 0])
        if not counts.any():
            return None
        if len(names) > 1:
            taken, *others = [repr(_short(names[number])) for number in np.argsort(-counts, kind="stable")]
            warn(f"{name} has several textures; took {taken}, which most faces have, and not {', '.join(others)}.")
        return _opened(names[counts.argmax()])[:, :, :3]
    except MeshError as problem:
        warn(f"the texture is left out: {problem}")
    return None


def merged_texture(surface: Surface) -> tuple[Surface, Image | None]:
    """Return the image on a surface; if there are several, merge them, and change the texture coordinates.

    Several images, such as those of a head and its ears, are put side by side, with a patch of plain color for
    triangles that have none.

    Returns
    -------
    surface : Surface
        With texture coordinates on the image.
    image : ndarray of uint8, shape (h, w, 3), or (h, w, 4) if it is transparent; or None

    Warns
    -----
    FaceWrinkleWarning
        For an image that cannot be read, and if one of several images is repeated.
    """
    names, numbers = surface.images
    images: dict[int, Image] = {}
    for number in np.unique(numbers[numbers >= 0]).tolist():
        try:
            images[number] = _opened(names[number])
        except MeshError as problem:
            warn(f"the texture is left out: {problem}")
    if not images:
        return surface, None
    numbers = np.where(np.isin(numbers, list(images)), numbers, -1)
    if (numbers == -1).any():
        images[-1] = _patch(surface, numbers == -1, images)
    return (surface, images.popitem()[1]) if len(images) == 1 else _side_by_side(surface, names, numbers, images)


def _opened(source: str) -> Image:
    """Read an image: a file, `a.glb#3` for one in a glTF file, or `a.usdz[b.png]` for one in a USD package; each may be
    tinted, see :func:`facewrinkle.mesh.formats.polygons.tinted`.
    """
    if found := _TINTED.fullmatch(source):
        image = _opened(found[1])
        light = linear_light(image[..., :3].reshape(-1, 3)) * [float(share) for share in found[2].split(",")]
        image[..., :3] = srgb(light).reshape(image.shape[0], -1, 3)
        return image
    file, _, number = source.rpartition("#")
    if number.isdigit() and Path(file).suffix.lower() in GLTF:
        with reading(Path(file)):
            return decoded(Document(Path(file)).image(int(number)), _short(source))
    package, _, name = source.removesuffix("]").partition("[")
    if source.endswith("]") and package.lower().endswith(".usdz"):
        try:
            with ZipFile(package) as archive:
                return decoded(archive.read(name), name)
        except (OSError, KeyError, BadZipFile) as problem:
            raise MeshError(f"{Path(package).name} does not hold the image {name!r} ({problem}).") from None
    if not Path(source).is_file():
        raise MeshError(f"the image {_short(source)!r} is not there. Put it beside the mesh.")
    return image_of_file(Path(source))


def outside_images(surface: Surface, source: object) -> tuple[str, ...]:
    """Return a sentence on images that a mesh file names outside of its folder; `surface` is what was read."""
    if not isinstance(source, str | Path):
        return ()
    folder = path_of(source).parent
    outside = [str(Path(name).resolve()) for name in surface.images[0] if is_outside(folder, name)]
    return (f"Read images from outside the folder of the mesh: {', '.join(outside)}.",) if outside else ()


def _short(source: str) -> str:
    """The name of an image without its folder and its tint."""
    return Path(_TINTED.sub(r"\1", source)).name


def _patch(surface: Surface, bare: npt.NDArray[np.bool_], images: dict[int, Image]) -> Image:
    """A small image in the color of the triangles without an image, else in the median color of the largest image."""
    colors = surface.point_data[COLORS][:, :3] if has_colors(surface.point_data) else None
    own = None if colors is None else colors[surface.triangles[bare]].reshape(-1, 3)
    if own is None or own.dtype != np.uint8 or own.min() == 255:
        own = max(images.values(), key=lambda image: image.size)[..., :3].reshape(-1, 3)
    return np.tile(np.median(own, axis=0).astype(np.uint8), (2, 2, 1))


def _side_by_side(
    surface: Surface, names: list[str], numbers: npt.NDArray[np.int64], images: dict[int, Image]
) -> tuple[Surface, Image]:
    """Put images in a row, by number, and move the texture coordinates to their places in it."""
    channels = max(image.shape[2] for image in images.values())
    factor = min(1.0, LARGEST_SIDE / sum(image.shape[1] + 2 * BORDER for image in images.values()))
    row = {number: _padded(_reduced(image, factor), channels) for number, image in images.items()}
    height, width = max(image.shape[0] for image in row.values()), sum(image.shape[1] for image in row.values())
    out = np.zeros((height, width, channels), np.uint8)
    corners = np.array(surface.texture)
    left, repeated = 0, []
    for number, image in row.items():
        h, w = image.shape[0], image.shape[1]
        out[:h, left : left + w] = image
        mine = numbers == number
        place = corners[mine] if number >= 0 else np.full((mine.sum(), 3, 2), 0.5)
        place = place - np.floor(place.mean(axis=1, keepdims=True))  # images repeat: each triangle lies in one tile
        if len(place) and max(-place.min(), place.max() - 1.0) > 0.02:  # less needs no warning
            repeated.append(_short(names[number]))
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
    return replace(surface, texture=corners).without_images(), out  # the merged image is in no file


def _reduced(image: Image, factor: float) -> Image:
    """Scale an image down by a factor."""
    from PIL import Image as Pillow

    size = [max(int(factor * side), 1) for side in image.shape[1::-1]]
    return np.asarray(Pillow.fromarray(image).resize((size[0], size[1]), Pillow.Resampling.BOX))


def _padded(image: Image, channels: int) -> Image:
    """Add an opaque channel to an image that lacks one, and continue the image by `BORDER` on all sides."""
    if image.shape[2] < channels:
        image = np.dstack([image, np.full(image.shape[:2], 255, np.uint8)])
    return np.pad(image, ((BORDER, BORDER), (BORDER, BORDER), (0, 0)), mode="edge")


def image_of_file(path: Path) -> Image:
    """Read an image file as (h, w, 3), or as (h, w, 4) if it is transparent."""
    check_file(path)
    return decoded(bytes_of(path), path.name)


def decoded(data: bytes, name: str, *, upright: bool = False) -> Image:
    """Decode the bytes of an image, as `image_of_file` does; `upright` as the camera was held, if they tell."""
    from PIL import Image as Pillow
    from PIL import ImageOps, UnidentifiedImageError

    try:
        with Pillow.open(io.BytesIO(data)) as image:
            width, height = image.size
            if max(width, height) > LARGEST_SIDE or width * height > (Pillow.MAX_IMAGE_PIXELS or np.inf):
                raise MeshError(
                    f"the image {name} has {width} x {height} pixels. At most {LARGEST_SIDE} are allowed along a side, "
                    f"and {Pillow.MAX_IMAGE_PIXELS} in all: make it smaller."
                )
            mode = "RGBA" if image.has_transparency_data else "RGB"
            eight = _in_eight_bits(image)
            return np.array((ImageOps.exif_transpose(eight) if upright else eight).convert(mode))
    except MeshError:
        raise
    except UnidentifiedImageError:
        raise MeshError(f"the image {name} cannot be read: its format is not known. Save it as PNG or JPEG.") from None
    except Exception as problem:  # every format fails in its own way
        reason = str(problem).splitlines()[0] if str(problem) else type(problem).__name__
        raise MeshError(f"the image {name} cannot be read: {reason}. Save it as PNG or JPEG.") from None


def _in_eight_bits(image: Any) -> Any:
    """Convert a gray Pillow image of 16 bits, or of numbers from 0 to 1, to 8 bits: Pillow itself would clip it."""
    from PIL import Image as Pillow

    if not image.mode.startswith(("I", "F")):
        return image
    share = np.asarray(image, dtype=np.float64) / (1.0 if image.mode == "F" else 65535.0)
    return Pillow.fromarray(in_bytes(share))


def _of_object(source: Any) -> Image | None:
    material = getattr(getattr(one_mesh(source), "visual", None), "material", None)
    image = getattr(material, "image", None) or getattr(material, "baseColorTexture", None)
    return None if image is None else as_texture(image)
