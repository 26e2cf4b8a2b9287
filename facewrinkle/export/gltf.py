"""Models as a glTF 2.0 file, with the content that :mod:`facewrinkle.mesh.formats.gltf` reads."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from ..array_types import Array
from ..mesh.formats.gltf import COMPONENTS, WIDTHS
from ..mesh.formats.merging import linear_light
from .model import WATER_INDEX, WATER_OPACITY, Model, Morphs, WeightTrack

CODES = {np.dtype(kind): code for code, kind in COMPONENTS.items()}
"""Component types of accessors by the type of their numbers."""
KINDS = {width: kind for kind, width in WIDTHS.items()}
"""Types of accessors by the number of their columns."""
VERTICES, INDICES = 34962, 34963
"""Uses of buffer views (ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER)."""

SKIN_COLOR = [0.72, 0.41, 0.27, 1.0]
"""Linear light of a mesh with neither texture nor colors."""


def roughness(name: str) -> float:
    """Return the roughness of a mesh, by the first word of its name.

    Eyes, teeth and tears are wet; "mouth" is the dark behind the lips.

    Examples
    --------
    >>> roughness("eye_l"), roughness("face")
    (0.05, 0.55)
    """
    smoother = {"eye": 0.05, "upper": 0.25, "lower": 0.25, "mouth": 1.0, "tears": 0.0}
    return smoother.get(name.split("_")[0], 0.55)


def gltf(
    models: Mapping[str, Model],
    unit: float,
    rotation: Array | None = None,
    *,
    binary: bool,
    morphs: Mapping[str, Morphs] | None = None,
    dense: bool = False,
    tracks: Mapping[str, WeightTrack] | None = None,
) -> bytes:
    """Return a .glb file, or a .gltf file with all data embedded.

    Parameters
    ----------
    models : mapping of str to Model
        Each becomes a mesh and a node of this name.
    unit : float
        Millimeters per unit: points are kept as they are, and the nodes scale them to meters.
    rotation : ndarray, shape (3, 3), optional
        Rotation by which the nodes make +y up and +z the front, as the format asks.
    binary : bool
    morphs : mapping of str to Morphs, optional
        Blend shapes of the models, by their names.
    dense : bool
        Write every point of every shape: some readers know no sparse accessors.
    tracks : mapping of str to WeightTrack, optional
        Animation of the weights of models with blend shapes, by their names.
    """
    largest = max((shapes.deltas.shape[1] for shapes in (morphs or {}).values()), default=0)
    file = _File(0 if dense else largest)
    placing: dict[str, Any] = {"scale": [unit / 1000.0] * 3}
    if rotation is not None:
        placing["rotation"] = Rotation.from_matrix(rotation).as_quat().tolist()
    nodes = {}
    for name, model in models.items():
        shapes = (morphs or {}).get(name)
        nodes[name] = file.add("nodes", {"name": name, "mesh": file.mesh(name, model, shapes, dense)} | placing)
    if tracks:
        file.animate([(nodes[name], track) for name, track in tracks.items()])
    return file.content_of(binary)


class _File:
    """A glTF file in the making: its JSON content, and the bytes of its one buffer, which may begin with zeros."""

    def __init__(self, zeros: int) -> None:
        self.content: dict[str, Any] = {"asset": {"version": "2.0", "generator": "facewrinkle"}}
        self.buffer = bytearray()
        self._textures: dict[bytes, int] = {}
        if zeros:  # vectors that all sparse accessors share, the first view: without them, VTK reads nothing
            self.view(bytes(12 * zeros), VERTICES)
            self.content["bufferViews"][0]["byteStride"] = 12

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
        self, values: np.ndarray, *, target: int | None = VERTICES, normalized: bool = False, bounded: bool = False
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

    def texture(self, picture: bytes) -> int:
        """Append a PNG or JPEG image that is not there yet; returns the number of the texture."""
        if picture in self._textures:  # parts often share the photo of the skin
            return self._textures[picture]
        kind = "png" if picture.startswith(b"\x89PNG") else "jpeg"
        image = self.add("images", {"bufferView": self.view(picture), "mimeType": f"image/{kind}"})
        sampler = self.add("samplers", {"magFilter": 9729, "minFilter": 9987})  # with mipmaps
        self._textures[picture] = self.add("textures", {"source": image, "sampler": sampler})
        return self._textures[picture]

    def mesh(self, name: str, model: Model, shapes: Morphs | None = None, dense: bool = False) -> int:
        """Append a model with its material and blend shapes; returns the number of the mesh."""
        attributes = {
            "POSITION": self.accessor(model.points.astype("<f4"), bounded=True),
            "NORMAL": self.accessor(_normalized(model.normals).astype("<f4")),
        }
        if model.uv is not None:
            attributes["TEXCOORD_0"] = self.accessor((model.uv * [1.0, -1.0] + [0.0, 1.0]).astype("<f4"))
        surface: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": roughness(name)}
        if model.png is not None:
            surface["baseColorTexture"] = {"index": self.texture(model.png)}
        elif model.colors is not None:  # they would multiply the texture
            attributes["COLOR_0"] = self.accessor(_opaque_light(model.colors), normalized=True)
        else:
            surface["baseColorFactor"] = [1.0, 1.0, 1.0, WATER_OPACITY] if model.water else SKIN_COLOR
        kind = "<u2" if len(model.points) <= 0xFFFF else "<u4"
        indices = self.accessor(model.triangles.astype(kind).reshape(-1, 1), target=INDICES)
        material = {"name": name, "doubleSided": True, "pbrMetallicRoughness": surface}
        if model.water:
            material |= {"alphaMode": "BLEND", "extensions": {"KHR_materials_ior": {"ior": WATER_INDEX}}}
            self.content["extensionsUsed"] = ["KHR_materials_ior"]
        elif model.cutout:
            material["alphaMode"] = "MASK"
        primitive = {"attributes": attributes, "indices": indices, "material": self.add("materials", material)}
        entry: dict[str, Any] = {"name": name, "primitives": [primitive]}
        if shapes is not None and len(shapes.names):
            primitive["targets"] = self._targets(shapes, dense)
            extras: dict[str, Any] = {"targetNames": list(shapes.names)}
            if shapes.drivers:
                extras["drivers"] = {name: list(others) for name, others in shapes.drivers.items()}
            entry |= {"weights": [0.0] * len(shapes.names), "extras": extras}
        return self.add("meshes", entry)

    def _targets(self, shapes: Morphs, dense: bool) -> list[dict[str, int]]:
        """Append the accessors of blend shapes; returns the targets of the primitive."""
        targets: list[dict[str, int]] = [{} for _ in shapes.names]
        arrays = {"POSITION": shapes.deltas} | ({"NORMAL": shapes.normals} if shapes.normals.any() else {})
        if dense:
            for name, array in arrays.items():
                for target, values in zip(targets, array.astype("<f4"), strict=True):
                    target[name] = self.accessor(values, bounded=name == "POSITION")
            return targets
        count = shapes.deltas.shape[1]
        kind = np.dtype("<u2" if count <= 0xFFFF else "<u4")
        entries = []
        for name, array in arrays.items():
            for target, values in zip(targets, array, strict=True):
                rows = np.flatnonzero(values.any(axis=1))  # the format asks for one at least
                entries.append((target, name, values, rows if len(rows) else np.zeros(1, np.int64)))
        padded = [np.append(rows, np.zeros(len(rows) % 2, np.int64)).astype(kind) for *_, rows in entries]
        index = self.view(np.concatenate(padded).tobytes())
        vectors = self.view(np.concatenate([values[rows] for *_, values, rows in entries]).astype("<f4").tobytes())
        at_index = at_vector = 0
        for target, name, values, rows in entries:
            sparse = {
                "count": len(rows),
                "indices": {"bufferView": index, "byteOffset": at_index, "componentType": CODES[kind]},
                "values": {"bufferView": vectors, "byteOffset": at_vector},
            }
            entry = {"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3", "sparse": sparse}
            if name == "POSITION":
                entry |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
            target[name] = self.add("accessors", entry)
            at_index += kind.itemsize * (len(rows) + len(rows) % 2)
            at_vector += 12 * len(rows)
        return targets

    def animate(self, moving: Sequence[tuple[int, WeightTrack]]) -> None:
        """Append an animation of the weights of some nodes."""
        samplers: dict[int, int] = {}  # of tracks that several nodes share
        animation: dict[str, Any] = {"name": "animation", "samplers": [], "channels": []}
        for node, track in moving:
            if id(track) not in samplers:
                samplers[id(track)] = len(animation["samplers"])
                times, weights = (each.astype("<f4").reshape(-1, 1) for each in (track.times, track.weights))
                animation["samplers"].append(
                    {
                        "input": self.accessor(times, target=None, bounded=True),
                        "output": self.accessor(weights, target=None),
                        "interpolation": "LINEAR",
                    }
                )
            target = {"node": node, "path": "weights"}
            animation["channels"].append({"sampler": samplers[id(track)], "target": target})
        self.add("animations", animation)

    def content_of(self, binary: bool) -> bytes:
        """Return the file: as JSON with the buffer in it, or as GLB: a header, the JSON, and the buffer."""
        self._pad()
        buffer: dict[str, Any] = {"byteLength": len(self.buffer)}
        if not binary:
            buffer["uri"] = "data:application/octet-stream;base64," + base64.b64encode(self.buffer).decode()
        nodes = list(range(len(self.content["nodes"])))
        whole = self.content | {"scene": 0, "scenes": [{"nodes": nodes}], "buffers": [buffer]}
        text = json.dumps(whole, separators=(",", ":")).encode()
        if not binary:
            return text
        chunks = [(b"JSON", text + b" " * (-len(text) % 4)), (b"BIN\0", bytes(self.buffer))]
        body = b"".join(struct.pack("<I4s", len(data), kind) + data for kind, data in chunks)
        return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body

    def _pad(self) -> None:
        """Fill the buffer up to a multiple of four bytes."""
        self.buffer += b"\0" * (-len(self.buffer) % 4)


def _normalized(vectors: Array) -> Array:
    """Vectors (n, 3) of length 1, as the format asks; +y in place of zero vectors."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(lengths > 0.0, vectors / np.maximum(lengths, 1e-300), [0.0, 1.0, 0.0])


def _opaque_light(colors: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint16]:
    """Linear light (n, 4) in 65,535ths, opaque, of sRGB colors (n, 3)."""
    light = linear_light(colors)
    return np.rint(65535.0 * np.hstack([light, np.ones((len(light), 1))])).astype("<u2")
