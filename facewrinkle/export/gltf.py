"""Models as a glTF 2.0 file, with the content that :mod:`facewrinkle.mesh.formats.gltf` reads."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from ..mesh.formats.gltf import COMPONENTS, WIDTHS
from .model import WATER_INDEX, WATER_OPACITY, Model

Array = npt.NDArray[np.float64]

CODES = {np.dtype(kind): code for code, kind in COMPONENTS.items()}
"""Component types of accessors by the type of their numbers."""
KINDS = {width: kind for kind, width in WIDTHS.items()}
"""Types of accessors by the number of their columns."""
VERTICES, INDICES = 34962, 34963
"""Uses of buffer views (ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER)."""
LINEAR, LINEAR_MIPMAP_LINEAR = 9729, 9987

SKIN_COLOUR = [0.72, 0.41, 0.27, 1.0]
"""Linear light of a mesh with neither texture nor colours."""
SKIN_ROUGHNESS = 0.55
ROUGHNESS = {"eye": 0.05, "upper": 0.25, "lower": 0.25, "mouth": 1.0, "tears": 0.0}
"""Roughness by the first word of a name: eyes, teeth and tears are wet; "mouth" is the dark behind the lips."""


def gltf(models: Mapping[str, Model], unit: float, rotation: Array | None = None, *, binary: bool) -> bytes:
    """Return a .glb file, or a .gltf file with all data embedded.

    Parameters
    ----------
    models : mapping of str to Model
        Each becomes a mesh and a node of this name.
    unit : float
        Millimetres per unit: points are kept as they are, and the nodes scale them to metres.
    rotation : ndarray, shape (3, 3), optional
        Rotation by which the nodes make +y up and +z the front, as the format asks.
    binary : bool
    """
    file = _File()
    placing: dict[str, Any] = {"scale": [unit / 1000.0] * 3}
    if rotation is not None:
        placing["rotation"] = Rotation.from_matrix(rotation).as_quat().tolist()
    for name, model in models.items():
        file.add("nodes", {"name": name, "mesh": file.mesh(name, model)} | placing)
    return file.binary() if binary else file.embedded()


class _File:
    """A glTF file in the making: its JSON content, and the bytes of its one buffer."""

    def __init__(self) -> None:
        self.content: dict[str, Any] = {"asset": {"version": "2.0", "generator": "facewrinkle"}}
        self.buffer = bytearray()
        self._textures: dict[bytes, int] = {}

    def add(self, kind: str, entry: dict[str, Any]) -> int:
        """Append an entry to one of the lists of the file; returns its number."""
        entries = self.content.setdefault(kind, [])
        entries.append(entry)
        return len(entries) - 1

    def view(self, data: bytes, target: int | None = None) -> int:
        """Append bytes to the buffer; returns the number of the buffer view."""
        self._pad()
        view = {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(data)}
        self.buffer += data
        return self.add("bufferViews", view if target is None else view | {"target": target})

    def accessor(
        self, values: np.ndarray, *, target: int = VERTICES, normalized: bool = False, bounded: bool = False
    ) -> int:
        """Append the rows of an array, shape (count, width); returns the number of the accessor."""
        entry: dict[str, Any] = {
            "bufferView": self.view(values.tobytes(), target),
            "componentType": CODES[values.dtype],
            "count": len(values),
            "type": KINDS[values.shape[1]],
        }
        if normalized:
            entry["normalized"] = True
        if bounded:
            entry |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        return self.add("accessors", entry)

    def texture(self, png: bytes) -> int:
        """Append a PNG image that is not there yet; returns the number of the texture."""
        if png in self._textures:  # parts often share the photo of the skin
            return self._textures[png]
        image = self.add("images", {"bufferView": self.view(png), "mimeType": "image/png"})
        sampler = self.add("samplers", {"magFilter": LINEAR, "minFilter": LINEAR_MIPMAP_LINEAR})
        self._textures[png] = self.add("textures", {"source": image, "sampler": sampler})
        return self._textures[png]

    def mesh(self, name: str, model: Model) -> int:
        """Append a model with its material; returns the number of the mesh."""
        attributes = {
            "POSITION": self.accessor(model.points.astype("<f4"), bounded=True),
            "NORMAL": self.accessor(_normalized(model.normals).astype("<f4")),
        }
        if model.uv is not None:
            attributes["TEXCOORD_0"] = self.accessor((model.uv * [1.0, -1.0] + [0.0, 1.0]).astype("<f4"))
        surface: dict[str, Any] = {
            "metallicFactor": 0.0,
            "roughnessFactor": ROUGHNESS.get(name.split("_")[0], SKIN_ROUGHNESS),
        }
        if model.png is not None:
            surface["baseColorTexture"] = {"index": self.texture(model.png)}
        elif model.colours is not None:  # they would multiply the texture
            attributes["COLOR_0"] = self.accessor(_linear_light(model.colours), normalized=True)
        else:
            surface["baseColorFactor"] = [1.0, 1.0, 1.0, WATER_OPACITY] if model.water else SKIN_COLOUR
        indices = self.accessor(model.triangles.astype("<u4").reshape(-1, 1), target=INDICES)
        material = {"name": name, "doubleSided": True, "pbrMetallicRoughness": surface}
        if model.water:
            material |= {"alphaMode": "BLEND", "extensions": {"KHR_materials_ior": {"ior": WATER_INDEX}}}
            self.content["extensionsUsed"] = ["KHR_materials_ior"]
        elif model.cutout:
            material["alphaMode"] = "MASK"
        primitive = {"attributes": attributes, "indices": indices, "material": self.add("materials", material)}
        return self.add("meshes", {"name": name, "primitives": [primitive]})

    def binary(self) -> bytes:
        """Return the file as GLB: a header, the JSON, and the buffer."""
        text = self._json({})
        chunks = [(b"JSON", text + b" " * (-len(text) % 4)), (b"BIN\0", bytes(self.buffer))]
        body = b"".join(struct.pack("<I4s", len(data), kind) + data for kind, data in chunks)
        return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body

    def embedded(self) -> bytes:
        """Return the file as JSON, with the buffer in it."""
        return self._json({"uri": "data:application/octet-stream;base64," + base64.b64encode(self.buffer).decode()})

    def _json(self, buffer: dict[str, Any]) -> bytes:
        """Return the content, with all nodes in one scene, and its buffer described."""
        self._pad()
        nodes = list(range(len(self.content["nodes"])))
        whole = self.content | {"scene": 0, "scenes": [{"nodes": nodes}]}
        whole["buffers"] = [{"byteLength": len(self.buffer)} | buffer]
        return json.dumps(whole, separators=(",", ":")).encode()

    def _pad(self) -> None:
        """Fill the buffer up to a multiple of four bytes."""
        self.buffer += b"\0" * (-len(self.buffer) % 4)


def _normalized(vectors: Array) -> Array:
    """Vectors (n, 3) of length 1, as the format asks; +y in place of zero vectors."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(lengths > 0.0, vectors / np.maximum(lengths, 1e-300), [0.0, 1.0, 0.0])


def _linear_light(colours: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint16]:
    """Linear light (n, 4) in 65,535ths, opaque, of sRGB colours (n, 3)."""
    srgb = colours / 255.0
    light = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return np.rint(65535.0 * np.hstack([light, np.ones((len(light), 1))])).astype("<u2")
