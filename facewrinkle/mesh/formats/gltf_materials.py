"""Materials of glTF files: the color or the image on a primitive, how it lies there, and what is seen through."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from ...array_types import Array
from ...errors import MeshError, warn
from .polygons import image_place, tinted


class Materials:
    """The materials of a glTF file.

    Parameters
    ----------
    path : Path
        Of the file.
    file : mapping
        Its content.
    entry : callable
        Returns an entry, by number, of one of the lists of the file, or raises a MeshError.
    """

    def __init__(self, path: Path, file: Mapping[str, Any], entry: Callable[[str, Any], dict[str, Any]]) -> None:
        self._path, self._file, self._entry = path, file, entry

    @cached_property
    def transparent(self) -> set[int]:
        """Materials that are transparent, such as those of corneas; empty if all are."""
        used = {part.get("material") for mesh in self._file.get("meshes") or [] for part in mesh["primitives"]}
        found = {i for i, material in enumerate(self._file.get("materials") or []) if _is_transparent(material)}
        return found if used - found else set()

    def look(self, primitive: Mapping[str, Any]) -> tuple[str, Array | None, dict[str, Any]]:
        """Return the image on a primitive, "" for none; the color (1, 4) of its material, if it has one, by which the
        colors of its points are multiplied; and the placement of the image.
        """
        try:
            surface = self._surface(primitive)
            factor = surface.get("baseColorFactor")
            color = None if factor is None else np.array(factor, dtype=np.float64).reshape(1, 4)
            if (how := surface.get("baseColorTexture")) is None:
                return "", color, {}
            place = self._image_place(self._number(how))
            return place if color is None or not color[0, :3].any() else tinted(place, color[0, :3]), color, how
        except (MeshError, KeyError, TypeError, ValueError, AttributeError) as problem:
            warn(f"the texture is left out: a material makes no sense ({type(problem).__name__}: {problem}).")
            return "", None, {}

    def name(self, primitive: Mapping[str, Any]) -> str:
        """Return the name of the material of a primitive, "" if it has none."""
        try:
            return str(self._entry("materials", primitive["material"])["name"])
        except (MeshError, LookupError, TypeError):  # a mesh is read even if a material makes no sense
            return ""

    def _image_place(self, number: int) -> str:
        """Return the file of an image, or the name of one within this file."""
        uri = self._entry("images", number).get("uri")
        if uri is None or uri.startswith("data:"):
            return f"{self._path.absolute()}#{number}"
        return image_place(self._path.parent, unquote(uri))

    def _surface(self, primitive: Mapping[str, Any]) -> dict[str, Any]:
        """Return what the material of a primitive says of its color; a black one has the color of its light."""
        if primitive.get("material") is None:
            return {}
        material = self._entry("materials", primitive["material"])
        usual = dict(material.get("pbrMetallicRoughness") or {})
        older = (material.get("extensions") or {}).get("KHR_materials_pbrSpecularGlossiness") or {}
        given = {"baseColorTexture": older.get("diffuseTexture"), "baseColorFactor": older.get("diffuseFactor")}
        black = not any(usual.get("baseColorFactor", [1.0])[:3])
        if black and (light := given["baseColorTexture"] or material.get("emissiveTexture")):
            return {"baseColorTexture": light}
        return {name: value for name, value in given.items() if value is not None} | usual

    def _number(self, how: Mapping[str, Any]) -> int:
        """Return the number of the image of a texture."""
        chosen = self._entry("textures", how["index"])
        for extension in (chosen.get("extensions") or {}).values():  # such as WebP; Pillow reports what it cannot read
            chosen = {"source": extension.get("source", chosen.get("source"))}
        return int(chosen["source"])


def _is_transparent(material: Mapping[str, Any]) -> bool:
    """Return True if a surface of this material shows more of what lies behind it than of itself."""
    try:
        surface = material.get("pbrMetallicRoughness") or {}
        glass = (material.get("extensions") or {}).get("KHR_materials_transmission") or {}
        through = 0.0 if "baseColorTexture" in surface else glass.get("transmissionFactor", 0.0)
        opacity = surface.get("baseColorFactor", [1.0])[-1] if material.get("alphaMode") == "BLEND" else 1.0
        return bool(through > 0.5 or opacity < 0.5)
    except (TypeError, AttributeError, LookupError):  # a mesh is read even without its colors
        return False


def moved_texture(texture: Array, how: Mapping[str, Any]) -> Array:
    """Return texture coordinates (n, 2), v downwards, scaled, turned and shifted (KHR_texture_transform).

    Examples
    --------
    >>> moved_texture(np.array([[1.0, 0.5]]), {"scale": [0.5, 1.0], "offset": [0.25, 0.0]}).tolist()
    [[0.75, 0.5]]
    """
    cosine, sine = np.cos(how.get("rotation", 0.0)), np.sin(how.get("rotation", 0.0))
    scaled = texture * how.get("scale", (1.0, 1.0)) @ np.array([[cosine, -sine], [sine, cosine]])
    return np.asarray(scaled + how.get("offset", (0.0, 0.0)))
