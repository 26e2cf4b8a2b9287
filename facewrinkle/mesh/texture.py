"""Images that lie on meshes: the one that a file names or holds, or that the user gives."""

from __future__ import annotations

import base64
import binascii
import io
import json
import os
import re
import struct
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..errors import FaceWrinkleWarning, MeshError, ParameterError
from .arrays import IMAGE, IMAGES
from .reading import GLTF, check_file

Image = npt.NDArray[np.uint8]

LARGEST_SIDE = 16_384
"""Pixels; graphics cards take no larger textures."""

_OPTION = re.compile(
    r"-(?:(?:o|s|t)(?:\s+[-+.\deE]+){1,3}|mm(?:\s+\S+){2}|(?:blendu|blendv|cc|clamp|texres|imfchan|boost|bm)\s+\S+)\s+"
)


def as_texture(image: object) -> Image:
    """An image as an array (h, w, 3) of uint8, first row at the top; transparency is dropped.

    Parameters
    ----------
    image : path, ndarray, pyvista.Texture or PIL.Image.Image
        An array has the shape (h, w), (h, w, 3) or (h, w, 4), of uint8 or of numbers from 0 to 1.

    Raises
    ------
    MeshError
        If a file cannot be read.
    ParameterError
        For something else than an image.

    Examples
    --------
    >>> as_texture(np.ones((2, 4))).shape
    (2, 4, 3)
    """
    from PIL import Image as Pillow

    if isinstance(image, str | Path):
        path = Path(os.path.expanduser(image))
        check_file(path)
        return _decoded(path.read_bytes(), path.name)
    if isinstance(image, pv.Texture):
        image = image.to_array()
    elif isinstance(image, Pillow.Image):
        image = image.convert("RGB")
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
    """The image that a mesh file or a trimesh-like object brings along.

    Parameters
    ----------
    source : path, or anything that :func:`facewrinkle.read_surface` takes
        OBJ with a material that has `map_Kd`, PLY with a comment `TextureFile`, glTF with a base colour texture. Where
        there are several, the one on most faces is taken.
    mesh : str, optional
        Only of this mesh or node of a glTF file: its name, or the number of the node.

    Returns
    -------
    ndarray of uint8, shape (h, w, 3), or None
        First row at the top. None if there is none.

    Warns
    -----
    FaceWrinkleWarning
        If an image that the file names is missing or cannot be read, or if there are several.
    """
    try:
        if not isinstance(source, str | Path):
            return _of_object(source)
        path = Path(os.path.expanduser(source))
        match path.suffix.lower():
            case ".obj":
                return _named(path, _materials_of_obj(path))
            case ".ply":
                return _named(path, _comments_of_ply(path))
            case ending if ending in GLTF:
                return _of_gltf(path, mesh)
    except MeshError as problem:
        _warn(f"the texture is left out: {problem}")
    return None


def texture_of(mesh: pv.PolyData) -> Image | None:
    """The image on most triangles of a mesh that :func:`facewrinkle.read_surface` gave, or of a part of one.

    Returns
    -------
    ndarray of uint8, shape (h, w, 3), or (h, w, 4) where it is transparent; or None

    Warns
    -----
    FaceWrinkleWarning
        If it cannot be read, or if there are several.
    """
    numbers = np.asarray(mesh.cell_data.get(IMAGE, [-1]))
    if not (numbers >= 0).any():
        return None
    path = Path(str(mesh.field_data[IMAGES][0]))
    try:
        number = int(_most(Counter(map(str, numbers[numbers >= 0].tolist())), path.name))
        return _image_of_gltf(path, *_gltf_of(path), number, alpha=True)
    except MeshError as problem:
        _warn(f"the texture is left out: {problem}")
        return None


def _warn(message: str) -> None:
    warnings.warn(message, FaceWrinkleWarning, stacklevel=4)


def _decoded(data: bytes, name: str, *, alpha: bool = False) -> Image:
    from PIL import Image as Pillow

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Pillow.DecompressionBombWarning)
            with Pillow.open(io.BytesIO(data)) as image:
                if max(image.size) > LARGEST_SIDE:
                    raise MeshError(f"{name} has {image.size[0]} x {image.size[1]} pixels, {LARGEST_SIDE} are allowed.")
                return np.array(image.convert("RGBA" if alpha and image.has_transparency_data else "RGB"))
    except MeshError:
        raise
    except Exception as problem:  # every format fails in its own way
        reason = str(problem).splitlines()[0] if str(problem) else type(problem).__name__
        raise MeshError(f"the image {name} cannot be read: {reason}. Save it as PNG or JPEG.") from None


def _of_object(source: Any) -> Image | None:
    material = getattr(getattr(source, "visual", None), "material", None)
    image = getattr(material, "image", None) or getattr(material, "baseColorTexture", None)
    return None if image is None else as_texture(image)


# --- files beside the mesh ----------------------------------------------------------------------


def _named(path: Path, names: Counter[str]) -> Image | None:
    """The image of the name that counts most."""
    if not names:
        return None
    name = _most(names, path.name)
    found = _beside(path.parent, name)
    if found is None:
        raise MeshError(f"{path.name} names the image {name!r}, which is not there. Put it beside the mesh.")
    return as_texture(found)


def _most(names: Counter[str], where: str) -> str:
    (name, _), *others = names.most_common()
    if others:
        listed = ", ".join(repr(other) for other, _ in others[:8])
        _warn(f"{where} has several textures; took {name!r}, which most faces have, and not {listed}.")
    return name


def _beside(folder: Path, name: str) -> Path | None:
    """A file by the name that another one gives it: with the folders of another machine, or in another case."""
    name = name.replace("\\", "/")
    for candidate in (folder / name, folder / Path(name).name):
        try:
            if candidate.is_file():
                return candidate
        except (OSError, ValueError):  # a name that no file can have
            continue
    wanted = Path(name).name.casefold()
    return next((file for file in sorted(folder.iterdir()) if file.name.casefold() == wanted), None)


def _text(path: Path) -> list[str]:
    check_file(path)
    return path.read_text(encoding="utf-8", errors="replace").splitlines()


def _materials_of_obj(path: Path) -> Counter[str]:
    """The images of the materials, with the number of faces that each is on."""
    libraries: list[str] = []
    faces: Counter[str] = Counter()
    material = ""
    for line in _text(path):
        word, _, rest = line.strip().partition(" ")
        if word == "f":
            faces[material] += 1
        elif word == "usemtl":
            material = rest.strip()
        elif word == "mtllib":
            libraries.append(rest.strip())
    images: dict[str, str] = {}
    for library in libraries:
        found = _beside(path.parent, library)
        current = ""
        for line in _text(found) if found is not None else ():
            word, _, rest = line.strip().partition(" ")
            if word == "newmtl":
                current = rest.strip()
            elif word == "map_Kd" and (name := _OPTION.sub("", rest.strip() + " ").strip()):
                images[current] = name
    counted: Counter[str] = Counter()
    for name, count in faces.items():
        if name in images:
            counted[images[name]] += count
    return counted


def _comments_of_ply(path: Path) -> Counter[str]:
    check_file(path)
    with path.open("rb") as file:
        header = file.read(65_536).split(b"end_header")[0].decode("utf-8", errors="replace")
    return Counter(re.findall(r"^comment\s+TextureFile\s+(.+?)\s*$", header, re.MULTILINE)[:1])


# --- glTF ---------------------------------------------------------------------------------------


def _of_gltf(path: Path, mesh: str | None) -> Image | None:
    with _damage(path):
        content, blob = _gltf_of(path)
        images = _images_of_gltf(content, mesh)
        if not images:
            return None
        number = int(_most(Counter({str(i): count for i, count in images.items()}), path.name))
    return _image_of_gltf(path, content, blob, number)


def _image_of_gltf(path: Path, content: dict[str, Any], blob: bytes, number: int, *, alpha: bool = False) -> Image:
    with _damage(path):
        data = _bytes_of_gltf(content, blob, content["images"][number], path)
    return _decoded(data, f"{number} of {path.name}", alpha=alpha)


@contextmanager
def _damage(path: Path) -> Iterator[None]:
    """A MeshError for whatever a damaged file leads to."""
    try:
        yield
    except (KeyError, IndexError, TypeError, AttributeError, ValueError, struct.error, binascii.Error) as problem:
        if isinstance(problem, MeshError):
            raise
        raise MeshError(f"{path.name} does not hold the image that it names ({problem}). Export it again.") from None


def _gltf_of(path: Path) -> tuple[dict[str, Any], bytes]:
    check_file(path)
    with _damage(path):
        return _gltf(path.read_bytes())


def _gltf(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The JSON and the binary chunk of a glTF or GLB file."""
    if data[:4] != b"glTF":
        return json.loads(data), b""
    length = struct.unpack_from("<I", data, 12)[0]
    blob = data[20 + length :]
    return json.loads(data[20 : 20 + length]), blob[8 : 8 + struct.unpack_from("<I", blob)[0]] if blob else b""


def _images_of_gltf(content: dict[str, Any], mesh: str | None) -> Counter[int]:
    """The images that are base colours, with the number of vertices that the faces with them have."""
    nodes = enumerate(content.get("nodes", []))
    of_nodes = {node["mesh"] for i, node in nodes if "mesh" in node and mesh in (node.get("name"), str(i))}
    found: Counter[int] = Counter()
    for number, entry in enumerate(content["meshes"]):
        if mesh is not None and entry.get("name") != mesh and number not in of_nodes:
            continue
        for primitive in entry["primitives"]:
            material = content["materials"][primitive["material"]] if "material" in primitive else {}
            texture = material.get("pbrMetallicRoughness", {}).get("baseColorTexture")
            if texture is None or "TEXCOORD_0" not in primitive["attributes"]:
                continue
            chosen = content["textures"][texture["index"]]
            for extension in chosen.get("extensions", {}).values():  # webp; what Pillow cannot read says so
                chosen = {"source": extension.get("source", chosen.get("source"))}
            accessor = primitive.get("indices", primitive["attributes"]["POSITION"])
            found[chosen["source"]] += content["accessors"][accessor]["count"]
    return found


def _bytes_of_gltf(content: dict[str, Any], blob: bytes, image: dict[str, Any], path: Path) -> bytes:
    if "bufferView" not in image:
        return _linked(image["uri"], path)
    view = content["bufferViews"][image["bufferView"]]
    uri = content["buffers"][view["buffer"]].get("uri")
    data = blob if uri is None else _linked(uri, path)
    start = view.get("byteOffset", 0)
    return data[start : start + view["byteLength"]]


def _linked(uri: str, path: Path) -> bytes:
    if uri.startswith("data:"):
        return base64.b64decode(uri.split(",", 1)[1])
    found = _beside(path.parent, unquote(uri))
    if found is None:
        raise MeshError(f"{path.name} names {uri!r}, which is not there. Put it beside the mesh.")
    return found.read_bytes()
