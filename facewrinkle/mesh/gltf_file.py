"""glTF and GLB files as plain arrays: all meshes of the scene, in its coordinates, as they are at rest.

VTK's reader brings the interpreter down when counts or offsets lie, and refuses a mesh whose picture is missing. Here
every count is held against the bytes that are there before it is believed. What moves a mesh is read by
:mod:`facewrinkle.motion.gltf`.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import numpy.typing as npt

from ..errors import MeshError
from .formats import Primitive, strip_triangles

__all__ = ["read_gltf_file"]

Array = npt.NDArray[np.float64]

COMPONENTS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
COMPRESSED = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
}
TRIANGLES, STRIP, FAN = 4, 5, 6
DEEPEST = 200
"""Levels of nodes, at most; nodes that hang on themselves have no end."""


def read_gltf_file(path: Path, without: int | None = None) -> list[Primitive]:
    """The triangles of all meshes in the scene of a glTF or GLB file, but those of the node `without`.

    Raises
    ------
    MeshError
        For a file that is damaged, compressed (Draco, meshopt), or whose numbers lead nowhere.
    """
    document = _Document(path)
    try:
        return list(document.primitives(without))
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as problem:
        if isinstance(problem, MeshError):
            raise
        raise document.broken(f"its structure makes no sense ({type(problem).__name__}: {problem})") from None


class _Document:
    """A glTF file whose accessors are arrays."""

    def __init__(self, path: Path) -> None:
        self.path = path
        raw = path.read_bytes()
        self._blob = b""
        text = raw
        if raw[:4] == b"glTF":
            text, self._blob = self._chunks(raw)
        try:
            self.file: dict[str, Any] = json.loads(text)
            version = self.file["asset"]["version"]
        except (ValueError, KeyError, TypeError, RecursionError):
            raise self.broken("it holds no glTF") from None
        if not str(version).startswith("2"):
            raise MeshError(f"{path.name} is glTF {version}; 2.0 is read. Export it anew.")
        for extension in self.file.get("extensionsRequired") or []:
            if extension in COMPRESSED:
                raise MeshError(
                    f"{path.name} is compressed with {COMPRESSED[extension]} ({extension}), which is not supported. "
                    "Export it without compression, or as OBJ or PLY."
                )
        self._buffers: dict[int, bytes] = {}

    def broken(self, reason: str) -> MeshError:
        return MeshError(f"{self.path.name} cannot be read: {reason}. The file is damaged or cut off: export it again.")

    def _chunks(self, raw: bytes) -> tuple[bytes, bytes]:
        """The JSON text and the binary chunk of a GLB file."""
        found = {b"JSON": b"", b"BIN\0": b""}
        at = 12
        while at + 8 <= len(raw):
            size, kind = int.from_bytes(raw[at : at + 4], "little"), raw[at + 4 : at + 8]
            if at + 8 + size > len(raw):
                raise self.broken(f"a chunk of {size} bytes is announced, and {len(raw) - at - 8} follow")
            found.setdefault(kind, raw[at + 8 : at + 8 + size])
            found[kind] = found[kind] or raw[at + 8 : at + 8 + size]
            at += 8 + size
        return found[b"JSON"], found[b"BIN\0"]

    # --- numbers -----------------------------------------------------------------------------------

    def _at(self, kind: str, index: Any) -> dict[str, Any]:
        """An entry of one of the lists of the file."""
        entries = self.file.get(kind) or []
        if not isinstance(index, int) or not 0 <= index < len(entries):
            raise self.broken(f"it refers to number {index!r} of {len(entries)} {kind}")
        entry: dict[str, Any] = entries[index]
        return entry

    def _buffer(self, index: int) -> bytes:
        if index not in self._buffers:
            uri = self._at("buffers", index).get("uri")
            if uri is None:
                self._buffers[index] = self._blob
            elif uri.startswith("data:"):
                self._buffers[index] = base64.b64decode(uri.split(",", 1)[1])
            else:
                beside = self.path.parent / unquote(uri)
                try:
                    self._buffers[index] = beside.read_bytes()
                except OSError as problem:
                    raise MeshError(
                        f"{self.path.name} needs the file {uri!r} beside it, which cannot be opened: "
                        f"{problem.strerror or problem}. Keep them together, or export one .glb file."
                    ) from None
        return self._buffers[index]

    def _rows(self, where: dict[str, Any], kind: str, count: int, width: int) -> npt.NDArray[Any]:
        """Rows of numbers from a buffer view."""
        view, dtype = self._at("bufferViews", where["bufferView"]), np.dtype(kind)
        if any(name in (view.get("extensions") or {}) for name in COMPRESSED):
            raise MeshError(f"{self.path.name} is compressed with meshopt, which is not supported. Export it without.")
        data = self._buffer(view["buffer"])
        start, offset = int(view.get("byteOffset", 0)), int(where.get("byteOffset", 0))
        stride, length = int(view.get("byteStride") or width * dtype.itemsize), int(view["byteLength"])
        need = offset + (count - 1) * stride + width * dtype.itemsize
        if count < 1 or min(start, offset, length) < 0 or need > length or start + length > len(data):
            raise self.broken(f"{count} rows are announced, and its data do not hold them")
        return np.ndarray((count, width), dtype, data, start + offset, (stride, dtype.itemsize)).copy()

    def numbers(self, index: Any) -> npt.NDArray[Any]:
        """An accessor (count, width), sparse ones filled in; integers that stand for fractions become them."""
        accessor = self._at("accessors", index)
        kind, count, width = COMPONENTS[accessor["componentType"]], int(accessor["count"]), WIDTHS[accessor["type"]]
        sparse = accessor.get("sparse")
        if "bufferView" in accessor:
            values = self._rows(accessor, kind, count, width)
        elif sparse is not None and 0 < count <= 10**8:
            values = np.zeros((count, width), kind)
        else:
            raise self.broken(f"accessor {index} has no data")
        if sparse is not None:
            where = self._rows(sparse["indices"], COMPONENTS[sparse["indices"]["componentType"]], sparse["count"], 1)
            if where.max() >= count:
                raise self.broken(f"accessor {index} replaces row {where.max()} of {count}")
            values[where[:, 0]] = self._rows(sparse["values"], kind, sparse["count"], width)
        if accessor.get("normalized") and values.dtype.kind in "iu":
            return np.asarray(np.maximum(values / float(np.iinfo(values.dtype).max), -1.0))
        return values

    # --- the scene ---------------------------------------------------------------------------------

    def primitives(self, without: int | None = None) -> Iterator[Primitive]:
        """The primitives of all meshes of the scene."""
        nodes, scenes = self.file.get("nodes") or [], self.file.get("scenes") or []
        if scenes:
            roots = self._at("scenes", self.file.get("scene", 0)).get("nodes") or []
        else:
            children = {child for node in nodes for child in node.get("children") or []}
            roots = [i for i in range(len(nodes)) if i not in children]
        world: dict[int, Array] = {}
        pending = [(root, np.eye(4), 0) for root in roots]
        while pending:
            index, above, depth = pending.pop()
            node = self._at("nodes", index)
            if depth > DEEPEST or index in world:
                raise self.broken("its nodes hang on themselves")
            world[index] = above @ _placing(node)
            pending += [(child, world[index], depth + 1) for child in node.get("children") or []]
        for index in sorted(world):
            node = nodes[index]
            if "mesh" not in node or index == without:
                continue
            mesh = self._at("meshes", node["mesh"])
            bones = self._bones(node["skin"], world) if "skin" in node else None
            for primitive in mesh["primitives"]:
                found = self._primitive(primitive, world[index], bones, str(mesh.get("name") or node.get("name") or ""))
                if found is not None:
                    yield found

    def _bones(self, skin: Any, world: dict[int, Array]) -> Array:
        """Matrices (k, 4, 4) of the joints of a skin, as they are at rest."""
        entry = self._at("skins", skin)
        joints = np.array([world.get(joint, np.eye(4)) for joint in entry["joints"]])
        if "inverseBindMatrices" not in entry:
            return joints
        bind = self.numbers(entry["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2).astype(np.float64)
        return np.asarray(joints @ bind[: len(joints)])

    def _primitive(self, primitive: dict[str, Any], world: Array, bones: Array | None, name: str) -> Primitive | None:
        """One primitive in the coordinates of the scene; None for points and lines."""
        mode, attributes = primitive.get("mode", TRIANGLES), primitive["attributes"]
        if mode not in (TRIANGLES, STRIP, FAN) or "POSITION" not in attributes:
            return None
        points = self._vectors(attributes["POSITION"], 3)
        n = len(points)
        order = np.arange(n)
        if "indices" in primitive:
            order = self.numbers(primitive["indices"])[:, 0]
            if order.dtype.kind not in "iu" or order.max() >= n:
                raise self.broken(f"its faces use points up to {order.max()}, and it has {n}")
        triangles = _split(order.astype(np.int64), mode)
        if "KHR_draco_mesh_compression" in (primitive.get("extensions") or {}):
            raise MeshError(f"{self.path.name} is compressed with Draco, which is not supported. Export it without.")
        targets = [target["POSITION"] for target in primitive.get("targets") or [] if "POSITION" in target]
        shapes = np.array([self._vectors(target, 3) for target in targets]).reshape(-1, n, 3)
        turn = np.broadcast_to(world, (n, 4, 4))
        if bones is not None and {"JOINTS_0", "WEIGHTS_0"} <= attributes.keys():
            joints, weights = self.numbers(attributes["JOINTS_0"]), self._vectors(attributes["WEIGHTS_0"], 4)
            weights = weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-12)
            turn = np.einsum("nk,nkij->nij", weights, bones[joints])
        points = np.einsum("nij,nj->ni", turn[:, :3, :3], points) + turn[:, :3, 3]
        shapes = np.einsum("nij,knj->kni", turn[:, :3, :3], shapes)
        if np.linalg.det(world[:3, :3]) < 0.0:
            triangles = triangles[:, ::-1]
        texture = self._vectors(attributes["TEXCOORD_0"], 2) if "TEXCOORD_0" in attributes else None
        image, light = self._look(primitive)
        light = self.numbers(attributes["COLOR_0"]) if "COLOR_0" in attributes else light
        colors = None if light is None else np.array(np.broadcast_to(_seen(light), (max(n, len(light)), 3)))
        for values in (texture, colors):
            if values is not None and len(values) != n:
                raise self.broken(f"it has {n} points and {len(values)} texture coordinates or colours")
        at_corners = None if texture is None else (texture * [1.0, -1.0] + [0.0, 1.0])[triangles]
        return Primitive(name, points, triangles, at_corners, colors, shapes, image)

    def _look(self, primitive: dict[str, Any]) -> tuple[int, Array | None]:
        """The number of the image on a primitive, -1 for none, and else the colour (1, 4) of its material."""
        try:
            material = self._at("materials", primitive["material"]).get("pbrMetallicRoughness") or {}
            if "baseColorTexture" in material:
                chosen = self._at("textures", material["baseColorTexture"]["index"])
                for extension in (chosen.get("extensions") or {}).values():
                    chosen = {"source": extension.get("source", chosen.get("source"))}
                return int(chosen["source"]), None
            return -1, np.array(material["baseColorFactor"], dtype=np.float64).reshape(1, 4)
        except (MeshError, KeyError, TypeError, ValueError, AttributeError):  # a mesh is read without its look, too
            return -1, None

    def _vectors(self, index: Any, width: int) -> Array:
        values = self.numbers(index).astype(np.float64)
        if values.shape[1] != width:
            raise self.broken(f"accessor {index} has {values.shape[1]} numbers per row, and needs {width}")
        return values


def _seen(light: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Colours as they are seen (sRGB), of light (n, 3 or 4) as glTF stores it."""
    linear = np.clip(light[:, :3].astype(np.float64), 0.0, 1.0)
    share = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    return np.asarray(np.rint(255.0 * share), dtype=np.uint8)


def _placing(node: dict[str, Any]) -> Array:
    """The matrix (4, 4) of a node in the one that it hangs on."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    out = np.eye(4)
    x, y, z, w = np.array(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=np.float64)
    turn = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    out[:3, :3] = np.array(turn) * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64)
    out[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return out


def _split(order: npt.NDArray[np.int64], mode: int) -> npt.NDArray[np.int64]:
    """Triangles (m, 3) of a list, a strip or a fan of points."""
    if mode == TRIANGLES:
        return order[: len(order) - len(order) % 3].reshape(-1, 3)
    if mode == FAN:
        return np.stack([np.full(max(len(order) - 2, 0), order[0]), order[1:-1], order[2:]], axis=1)
    return strip_triangles(order)
