"""Images on meshes: named or held by a mesh file, or given by the user."""

from __future__ import annotations

import io
import os
import re
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv

from ...array_types import Image
from ...errors import MeshError, ParameterError, warn
from ...files import bytes_of, check_file, opened, sibling_file
from .gltf import Document
from .obj_off import read_obj
from .reading import GLTF

LARGEST_SIDE = 16_384
"""The most pixels along a side; graphics cards take no larger textures."""


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
        return image_of_file(Path(os.path.expanduser(image)))
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


def read_texture(source: object, mesh: str | None = None) -> Image | None:
    """Return the image of a mesh file or a trimesh-like object.

    Parameters
    ----------
    source : path, or anything that :func:`facewrinkle.read_surface` takes
        OBJ with a material that has `map_Kd`, PLY with a comment `TextureFile`, glTF with a base colour texture. Of
        several, the one on most faces is taken.
    mesh : str, optional
        The mesh or node of a glTF file to look at: its name, or the number of the node.

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
    try:
        if not isinstance(source, str | Path):
            return _of_object(source)
        path = Path(os.path.expanduser(source))
        match path.suffix.lower():
            case ".obj":
                check_file(path)
                return _most_named(path, Counter(image for image in read_obj(path).images if image))
            case ".ply":
                return _most_named(path, _comments_of_ply(path))
            case ending if ending in GLTF:
                document = _document(path)
                with document.checked():
                    counts = document.images(mesh)
                names = Counter({str(number): count for number, count in counts.items()})
                return _image_of_document(document, int(_most_frequent(names, path.name))) if names else None
    except MeshError as problem:
        warn(f"the texture is left out: {problem}")
    return None


def image_of_file(path: Path, *, alpha: bool = False) -> Image:
    """Read an image file as (h, w, 3), or as (h, w, 4) if it is transparent and `alpha` is set."""
    check_file(path)
    return decoded(bytes_of(path), path.name, alpha=alpha)


def image_of_gltf(path: Path, number: int, *, alpha: bool = False) -> Image:
    """Read an image of a glTF file by its number, as `image_of_file` does."""
    return _image_of_document(_document(path), number, alpha=alpha)


def decoded(data: bytes, name: str, *, alpha: bool = False) -> Image:
    """Decode the bytes of an image, as `image_of_file` does."""
    from PIL import Image as Pillow
    from PIL import UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Pillow.DecompressionBombWarning)
            with Pillow.open(io.BytesIO(data)) as image:
                if max(image.size) > LARGEST_SIDE:
                    raise MeshError(f"{name} has {image.size[0]} x {image.size[1]} pixels, {LARGEST_SIDE} are allowed.")
                mode = "RGBA" if alpha and image.has_transparency_data else "RGB"
                return np.array(_in_eight_bits(image).convert(mode))
    except MeshError:
        raise
    except UnidentifiedImageError:
        raise MeshError(f"the image {name} cannot be read: its format is not known. Save it as PNG or JPEG.") from None
    except Exception as problem:  # every format fails in its own way
        reason = str(problem).splitlines()[0] if str(problem) else type(problem).__name__
        raise MeshError(f"the image {name} cannot be read: {reason}. Save it as PNG or JPEG.") from None


def _in_eight_bits(image: Any) -> Any:
    """Convert a grey Pillow image of 16 bits, or of numbers from 0 to 1, to 8 bits: Pillow itself would clip it."""
    from PIL import Image as Pillow

    if not image.mode.startswith(("I", "F")):
        return image
    share = np.asarray(image, dtype=np.float64) / (1.0 if image.mode == "F" else 65535.0)
    return Pillow.fromarray(np.rint(255.0 * np.clip(share, 0.0, 1.0)).astype(np.uint8))


def _of_object(source: Any) -> Image | None:
    material = getattr(getattr(source, "visual", None), "material", None)
    image = getattr(material, "image", None) or getattr(material, "baseColorTexture", None)
    return None if image is None else as_texture(image)


def _document(path: Path) -> Document:
    check_file(path)
    return Document(path)


def _image_of_document(document: Document, number: int, *, alpha: bool = False) -> Image:
    with document.checked():
        data = document.image(number)
    return decoded(data, f"{number} of {document.path.name}", alpha=alpha)


def _most_named(path: Path, names: Counter[str]) -> Image | None:
    """Read the image whose name counts most."""
    if not names:
        return None
    name = _most_frequent(names, path.name)
    found = sibling_file(path.parent, name)
    if found is None:
        raise MeshError(f"{path.name} names the image {name!r}, which is not there. Put it beside the mesh.")
    return as_texture(found)


def _most_frequent(names: Counter[str], where: str) -> str:
    (name, _), *others = names.most_common()
    if others:
        listed = ", ".join(repr(other) for other, _ in others[:8])
        warn(f"{where} has several textures; took {name!r}, which most faces have, and not {listed}.")
    return name


def _comments_of_ply(path: Path) -> Counter[str]:
    check_file(path)
    with opened(path) as file:
        header = file.read(65_536).split(b"end_header")[0].decode("utf-8", errors="replace")
    return Counter(re.findall(r"^comment\s+TextureFile\s+(.+?)\s*$", header, re.MULTILINE)[:1])
