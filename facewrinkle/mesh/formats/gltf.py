"""glTF and GLB files as plain arrays: all meshes of the scene, in its coordinates, at rest.

VTK's reader crashes the interpreter if counts or offsets are wrong, and refuses a mesh whose image is missing. Here
every count is checked against the bytes that are there before it is used. Animations are read by
:mod:`facewrinkle.animation.gltf`.
"""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable, Mapping
from functools import cached_property
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any
from urllib.parse import unquote

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation

from ...array_types import Array
from ...errors import MeshError, optional_imports, warn
from ...files import bytes_of, sibling_file
from ..arrays import COLORS
from ..surface import Piece, Surface
from .merging import srgb
from .polygons import image_place, tinted

COMPONENTS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
TRIANGLES, STRIP, FAN = 4, 5, 6
"""Modes of primitives."""

AT_REST = {"rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0), "translation": (0.0, 0.0, 0.0)}
"""Default properties of a node; rotations are quaternions (x, y, z, w)."""


DRACO = "KHR_draco_mesh_compression"
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
COMPRESSED = {DRACO: "DracoPy", **dict.fromkeys(MESHOPT, "meshoptimizer")}
"""Extensions, and the packages that decode them."""

AT_ONCE, PER_BYTE = 2**29, 64
"""Bytes that the numbers of a file may take, as doubles, and the further ones for each byte of its buffers."""


def read_gltf_file(path: Path) -> list[Surface]:
    """Read the triangles of all meshes in the scene of a glTF or GLB file.

    Raises
    ------
    MeshError
        For a file that is damaged, or lacks something it refers to.
    MissingPackageError
        For one that is compressed (Draco, meshopt) by what is not installed.
    """
    document = Document(path)
    world = document.world()
    return [primitive for node in document.shown for primitive in document.primitives(node, world)]


class Document:
    """A glTF file, with its accessors as arrays and its nodes as matrices.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        raw = bytes_of(path)
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
            raise MeshError(f"{path.name} is glTF {version}; 2.0 is needed. Export it again.")
        # Without these extensions triangles are as they should be; images that cannot be read are told.
        needless = "KHR_(mesh_quantization|materials_|lights_|texture_)|EXT_texture_|MSFT_texture_|VRM"
        for extension in self.file.get("extensionsRequired") or []:
            if extension in COMPRESSED:
                decoder(extension, path.name)
            elif not re.match(needless, str(extension)):
                warn(f"{path.name} says that it needs {extension}, which is not known here and is left out.")
        self._left = AT_ONCE
        self._buffers: dict[int, bytes] = {}
        self._views: dict[int, bytes] = {}
        self._decoded: dict[int, npt.NDArray[Any]] = {}

    def broken(self, reason: str) -> MeshError:
        return MeshError(f"{self.path.name} cannot be read: {reason}. The file is damaged or cut off: export it again.")

    def _chunks(self, raw: bytes) -> tuple[bytes, bytes]:
        """The JSON text and the binary chunk of a GLB file."""
        found: dict[bytes, bytes] = {}
        at = 12
        while at + 8 <= len(raw):
            size, kind = int.from_bytes(raw[at : at + 4], "little"), raw[at + 4 : at + 8]
            if at + 8 + size > len(raw):
                raise self.broken(f"a chunk of {size} bytes is announced, and {len(raw) - at - 8} follow")
            found.setdefault(kind, raw[at + 8 : at + 8 + size])
            at += 8 + size
        return found.get(b"JSON", b""), found.get(b"BIN\0", b"")

    def _spend(self, count: int) -> None:
        """Count numbers before they are made: many parts of a small file may share the same data, or have none."""
        self._left -= 8 * count
        if self._left < 0:
            raise MeshError(
                f"{self.path.name} cannot be read: its parts would take more memory than files of its size do. It is "
                "damaged, or has very many copies or shapes: export it again, with fewer of them."
            )

    # --- numbers -----------------------------------------------------------------------------------

    def _at(self, kind: str, index: Any) -> dict[str, Any]:
        """Return an entry of one of the lists of the file."""
        entries = self.file.get(kind) or []
        if not isinstance(index, int) or not 0 <= index < len(entries):
            raise self.broken(f"it refers to number {index!r} of {len(entries)} {kind}")
        entry: dict[str, Any] = entries[index]
        return entry

    def _buffer(self, index: int) -> bytes:
        if index not in self._buffers:
            uri = self._at("buffers", index).get("uri")
            self._buffers[index] = self._blob if uri is None else self._linked(uri)
            self._left += PER_BYTE * len(self._buffers[index])
        return self._buffers[index]

    def _linked(self, uri: str) -> bytes:
        """Return the bytes in a data URI, or those of the file that the URI names."""
        if uri.startswith("data:"):
            return base64.b64decode(uri.split(",", 1)[1])
        try:
            if (found := sibling_file(self.path.parent, unquote(uri))) is not None:
                return bytes_of(found)
            reason = "is not there"
        except OSError as problem:
            reason = f"cannot be opened: {problem.strerror or problem}"
        raise MeshError(
            f"{self.path.name} needs the file {uri!r} beside it, which {reason}. Keep them together, or export one "
            ".glb file."
        )

    def _rows(self, where: dict[str, Any], kind: str, count: int, width: int) -> npt.NDArray[Any]:
        """Rows of numbers from a buffer view."""
        view, dtype = self._at("bufferViews", where["bufferView"]), np.dtype(kind)
        data, start, length = self._view(where["bufferView"])
        offset, stride = int(where.get("byteOffset", 0)), int(view.get("byteStride") or width * dtype.itemsize)
        need = offset + (count - 1) * stride + width * dtype.itemsize
        if count < 1 or min(start, offset, length) < 0 or need > length or start + length > len(data):
            raise self.broken(f"{count} rows are announced, and its data do not hold them")
        return np.ndarray((count, width), dtype, data, start + offset, (stride, dtype.itemsize)).copy()

    def _view(self, index: int) -> tuple[bytes, int, int]:
        """Bytes, and where those of a buffer view begin in them and how many they are."""
        view = self._at("bufferViews", index)
        for name in MESHOPT:
            if (how := (view.get("extensions") or {}).get(name)) is None:
                continue
            if index not in self._views:
                start, meshopt = int(how.get("byteOffset", 0)), decoder(name, self.path.name)
                data = self._buffer(how["buffer"])[start : start + int(how["byteLength"])]
                try:
                    self._views[index] = meshopt_bytes(meshopt, data, how)
                except (KeyError, ValueError, RuntimeError) as problem:
                    raise self.broken(f"a part that meshopt compressed is not right ({problem})") from None
            return self._views[index], 0, len(self._views[index])
        return self._buffer(view["buffer"]), int(view.get("byteOffset", 0)), int(view["byteLength"])

    def _undo_draco(self, primitive: dict[str, Any]) -> None:
        """Decode the accessors of a primitive that are in its compressed data alone."""
        attributes = primitive["attributes"]
        how = (primitive.get("extensions") or {}).get(DRACO)
        if how is None or "bufferView" in self._at("accessors", attributes["POSITION"]):
            return
        draco, (data, start, length) = decoder(DRACO, self.path.name), self._view(how["bufferView"])
        try:
            mesh = draco.decode(data[start : start + length])
            found = {attribute["unique_id"]: np.asarray(attribute["data"]) for attribute in mesh.attributes}
            for name, number in how["attributes"].items():
                self._decoded[attributes[name]] = found[number].reshape(len(found[number]), -1)
        except Exception as problem:  # DracoPy's own have no common base
            raise self.broken(f"a part that Draco compressed is not right ({problem})") from None
        if primitive.get("indices") is not None:
            self._decoded[primitive["indices"]] = np.asarray(mesh.faces, np.uint32).reshape(-1, 1)

    def numbers(self, index: Any) -> npt.NDArray[Any]:
        """Return an accessor (count, width), filled in if sparse, with normalized integers as fractions."""
        accessor = self._at("accessors", index)
        kind, count, width = COMPONENTS[accessor["componentType"]], int(accessor["count"]), WIDTHS[accessor["type"]]
        sparse = accessor.get("sparse")
        self._spend(count * width)
        if index in self._decoded:
            values = self._decoded[index]
            if values.shape != (count, width):
                raise self.broken(f"{count} rows are announced, and its compressed data hold {len(values)}")
        elif "bufferView" in accessor:
            values = self._rows(accessor, kind, count, width)
        elif sparse is not None and count > 0:
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

    @cached_property
    def materials(self) -> Materials:
        """The materials of the file."""
        return Materials(self.path, self.file, self._at)

    @cached_property
    def nodes(self) -> list[dict[str, Any]]:
        """All nodes of the file, also those of no scene."""
        return self.file.get("nodes") or []

    @cached_property
    def parents(self) -> dict[int, int]:
        """The parent of each node, -1 for none; parents come before their children."""
        below = {child for node in self.nodes for child in node.get("children") or []}
        pending = [(i, -1) for i in range(len(self.nodes)) if i not in below]
        found: dict[int, int] = {}
        while pending:
            index, parent = pending.pop()
            children = self._at("nodes", index).get("children") or []
            if index in found:
                raise self.broken("a node has two parents")
            found[index] = parent
            pending += [(child, index) for child in children]
        if len(found) < len(self.nodes):
            raise self.broken("some nodes are their own ancestors")
        return found

    def world(self, moved: Mapping[int, Mapping[str, Array]] | None = None) -> Array:
        """Matrices (k, 4, 4) of all nodes, at rest except for the translations, rotations and scales in `moved`."""
        local = _local_matrices({index: self.nodes[index] for index in self.parents}, moved or {})
        out = np.empty((len(self.nodes), 4, 4))
        for own, (index, parent) in zip(local, self.parents.items(), strict=True):
            out[index] = own if parent < 0 else out[parent] @ own
        return out

    @cached_property
    def shown(self) -> list[int]:
        """Nodes with a mesh in the scene."""
        scenes = self.file.get("scenes") or []
        pending = [i for i, parent in self.parents.items() if parent < 0]
        if scenes:
            pending = list(self._at("scenes", self.file.get("scene", 0)).get("nodes") or [])
        found = set()
        while pending:
            index = pending.pop()
            pending += self._at("nodes", index).get("children") or []
            found.add(index)
        return [index for index in sorted(found) if self.nodes[index].get("mesh") is not None]

    def bones(self, node: int) -> tuple[list[int], Array]:
        """Joints of the skin of a node, and the matrices (k, 4, 4) from the coordinates of the mesh to theirs."""
        skin = self._at("skins", self.nodes[node]["skin"])
        joints = list(skin["joints"])
        for joint in joints:
            self._at("nodes", joint)
        if "inverseBindMatrices" not in skin:
            return joints, np.tile(np.eye(4), (len(joints), 1, 1))
        bind = self.numbers(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2).astype(np.float64)
        if len(bind) < len(joints):
            raise self.broken(f"a skin has {len(joints)} joints and {len(bind)} matrices")
        return joints, bind[: len(joints)]

    def label(self, node: int) -> str:
        """The name of the mesh of a node or of the node, else its number."""
        mesh = self._at("meshes", self.nodes[node]["mesh"])
        return str(mesh.get("name") or self.nodes[node].get("name") or node)

    def primitives(self, node: int, world: Array) -> list[Surface]:
        """The mesh of a node in the coordinates of the scene, given the matrices of all nodes."""
        mesh = self._at("meshes", self.nodes[node]["mesh"])
        bones = None
        if self.nodes[node].get("skin") is not None:
            joints, bind = self.bones(node)
            bones = world[joints] @ bind
        solid = [part for part in mesh["primitives"] if part.get("material") not in self.materials.transparent]
        names = f"{self.nodes[node].get('name', '')}/{mesh.get('name', '')}"
        found = [self._primitive(part, world[node], bones, Piece(node, names)) for part in solid]
        return [part for part in found if part is not None]

    def _primitive(self, primitive: dict[str, Any], world: Array, bones: Array | None, mesh: Piece) -> Surface | None:
        """One primitive of a mesh in the coordinates of the scene; None for points and lines."""
        attributes = primitive["attributes"]
        mode = primitive.get("mode", TRIANGLES)
        if mode not in (TRIANGLES, STRIP, FAN) or "POSITION" not in attributes:
            return None
        self._undo_draco(primitive)
        points = self._vectors(attributes["POSITION"], 3)
        n = len(points)
        order = np.arange(n)
        if primitive.get("indices") is not None:
            order = self.numbers(primitive["indices"])[:, 0]
            if order.dtype.kind not in "iu" or order.max() >= n:
                raise self.broken(f"its faces use points up to {order.max()}, and it has {n}")
        triangles = _of_mode(mode, order.astype(np.int64))
        targets = [target.get("POSITION") for target in primitive.get("targets") or []]
        self._spend(3 * n * len(targets))
        shapes = np.array([np.zeros((n, 3)) if t is None else self._vectors(t, 3) for t in targets]).reshape(-1, n, 3)
        weights = None if bones is None else self._weights(attributes, n, len(bones))
        turn = np.broadcast_to(world, (n, 4, 4))
        if weights is not None and bones is not None:
            turn = (weights @ bones.reshape(-1, 16)).reshape(n, 4, 4)
        points = np.einsum("nij,nj->ni", turn[:, :3, :3], points) + turn[:, :3, 3]
        shapes = np.einsum("nij,knj->kni", turn[:, :3, :3], shapes)
        if n and np.median(np.linalg.det(turn[:, :3, :3])) < 0.0:
            triangles = triangles[:, ::-1]
        image, color, placement = self.materials.look(primitive)
        moved = (placement.get("extensions") or {}).get("KHR_texture_transform") or {}
        name_of_uv = f"TEXCOORD_{moved.get('texCoord', placement.get('texCoord', 0))}"
        texture = self._vectors(attributes[name_of_uv], 2) if name_of_uv in attributes else None
        if texture is not None:
            texture = moved_texture(texture, moved)
        colors = self._colors(attributes, n, color)
        for values in (texture, colors):
            if values is not None and len(values) != n:
                raise self.broken(f"it has {n} points and {len(values)} texture coordinates or colors")
        at_corners = None if texture is None else (texture * [1.0, -1.0] + [0.0, 1.0])[triangles]
        piece = mesh._replace(name=f"{mesh.name}/{self.materials.name(primitive)}".strip("/"), image=image)
        data = {} if colors is None else {COLORS: colors}
        return Surface(points, triangles, at_corners, data, pieces=(piece,), shapes=shapes, weights=weights)

    def _colors(self, attributes: dict[str, Any], n: int, color: Array | None) -> npt.NDArray[np.uint8] | None:
        """Colors (n, 3) of points: their own times that of the material, None if they have neither."""
        if "COLOR_0" not in attributes:
            return None if color is None else srgb(np.repeat(color, n, axis=0))
        own = self.numbers(attributes["COLOR_0"])[:, :3]
        return srgb(own if color is None else own * color[:, :3])

    def _weights(self, attributes: dict[str, Any], n: int, count: int) -> csr_array | None:
        """Weights (n, count) of the bones at each point, from all sets of four that the file has."""
        sets = sorted(name for name in attributes if name.startswith("JOINTS_") and f"WEIGHTS{name[6:]}" in attributes)
        if not sets:
            return None
        joints = np.hstack([self.numbers(attributes[name]) for name in sets])
        weights = np.hstack([self._vectors(attributes[f"WEIGHTS{name[6:]}"], 4) for name in sets])
        weights = np.maximum(weights, 0.0)
        if joints.shape != weights.shape or len(joints) != n or joints[weights > 0.0].max(initial=0) >= count:
            raise self.broken(f"its points refer to bones up to {joints.max()}, and there are {count} bones")
        lost = ~(weights.sum(axis=1) > 0.0)
        weights[lost, 0], joints[lost, 0] = 1.0, np.minimum(joints[lost, 0], count - 1)
        weights /= weights.sum(axis=1, keepdims=True)
        rows, slots = np.nonzero(weights)
        return csr_array((weights[rows, slots], (rows, joints[rows, slots].astype(np.int64))), shape=(n, count))

    # --- images ------------------------------------------------------------------------------------

    def image(self, number: int) -> bytes:
        """Return the bytes of an image, as in a PNG or JPEG file."""
        entry = self._at("images", number)
        if entry.get("bufferView") is None:
            return self._linked(entry["uri"])
        data, start, length = self._view(entry["bufferView"])
        return data[start : start + length]

    def _vectors(self, index: Any, width: int) -> Array:
        values = self.numbers(index).astype(np.float64)
        if values.shape[1] != width:
            raise self.broken(f"accessor {index} has {values.shape[1]} numbers per row, and needs {width}")
        return values


def _of_mode(mode: int, order: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Triangles (m, 3) of the points of a list of triangles, a strip or a fan."""
    if mode == TRIANGLES:
        return order[: len(order) - len(order) % 3].reshape(-1, 3)
    i = np.arange(max(len(order) - 2, 0))
    corners = [i, i + 1 + i % 2, i + 2 - i % 2] if mode == STRIP else [i + 1, i + 2, 0 * i]
    found = order[np.stack(corners, axis=1)]
    return found[(found != np.roll(found, 1, axis=1)).all(axis=1)]  # strips are joined by triangles without area


def rotations(quaternions: Array) -> Rotation:
    """Return the rotations of quaternions (k, 4); those that are 0 do not turn."""
    still = ~quaternions.any(axis=1, keepdims=True)
    return Rotation.from_quat(np.where(still, AT_REST["rotation"], quaternions))


def _local_matrices(nodes: Mapping[int, dict[str, Any]], moved: Mapping[int, Mapping[str, Array]]) -> Array:
    """Matrices (k, 4, 4) of nodes relative to their parents, with the translations, rotations and scales in `moved`."""
    parts = {name: np.tile(rest, (len(nodes), 1)) for name, rest in AT_REST.items()}
    fixed: dict[int, Array] = {}
    for row, (index, node) in enumerate(nodes.items()):
        own = moved.get(index, {})
        if node.get("matrix") is not None and not own:
            fixed[row] = np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
        for name, values in parts.items():
            if (value := own.get(name, node.get(name))) is not None:
                values[row] = value
    out = np.tile(np.eye(4), (len(nodes), 1, 1))
    out[:, :3, :3] = rotations(parts["rotation"]).as_matrix() * parts["scale"][:, None, :]
    out[:, :3, 3] = parts["translation"]
    for row, matrix in fixed.items():
        out[row] = matrix
    return out


# --- compressed parts --------------------------------------------------------------------------------


def decoder(extension: str, who: str) -> ModuleType:
    """Return the package that decodes an extension.

    Raises
    ------
    MissingPackageError
        If it is not installed.

    Examples
    --------
    >>> from unittest import mock
    >>> with mock.patch.dict("sys.modules", {"DracoPy": None}):
    ...     decoder(DRACO, "head.glb")
    Traceback (most recent call last):
    facewrinkle.errors.MissingPackageError: head.glb is compressed (KHR_draco_mesh_compression) and needs ...
    """
    otherwise = ". Or export it without compression, or as OBJ or PLY."
    with optional_imports(f"{who} is compressed ({extension}) and needs", otherwise):
        return import_module(COMPRESSED[extension])


def meshopt_bytes(meshopt: ModuleType, data: bytes, how: Mapping[str, Any]) -> bytes:
    """Return the bytes of a buffer view that meshopt compressed; `how` is the extension of the view.

    Raises
    ------
    ValueError, RuntimeError
        If the data are damaged.
    """
    count, stride, mode = int(how["count"]), int(how["byteStride"]), how["mode"]
    if not 0 < count * stride <= 2**30:  # bytes; larger parts are taken for damaged
        raise ValueError(f"{count} entries of {stride} bytes are announced")
    if mode != "ATTRIBUTES":
        decode = {"TRIANGLES": meshopt.decode_index_buffer, "INDICES": meshopt.decode_index_sequence}[mode]
        return bytes(decode(count, stride, data).view(np.uint8)[: count * stride])
    values = meshopt.decode_vertex_buffer(count, stride, data, dtype=np.dtype((np.void, stride)))
    if (name := how.get("filter", "NONE")) != "NONE":
        short = {"OCTAHEDRAL": "oct", "QUATERNION": "quat", "EXPONENTIAL": "exp"}[name]
        values = getattr(meshopt, f"decode_filter_{short}")(values, count, stride)
    return bytes(values.tobytes())


# --- materials: color or image on a primitive, how it lies there, and what is seen through -------------------------


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
