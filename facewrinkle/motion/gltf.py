"""glTF and GLB files with an animation: the mesh at rest, and how its morph targets and its node move.

VTK reads such a mesh, but not what moves it. The file's structure is pygltflib's business; here its numbers become
arrays.
"""

from __future__ import annotations

import base64
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..errors import FaceWrinkleWarning, MeshError, MissingPackageError, unknown_name
from ..mesh import to_polydata
from ..mesh.arrays import IMAGE, IMAGES, MOVED, TEXTURE, blended
from ..mesh.gltf_file import read_gltf_file
from ..mesh.reading import check_file, from_primitives, joined, welded
from ..mesh.seams import add_seams
from .recorded import Interpolation, Recorded, Track

__all__ = ["read_gltf"]

Array = npt.NDArray[np.float64]

COMPONENTS = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
COMPRESSED = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
}
INTERPOLATION: dict[str, Interpolation] = {"LINEAR": "linear", "STEP": "step", "CUBICSPLINE": "cubic"}
TRIANGLES = 4

NAME = "mesh"
"""The field-data array that names the mesh in its file."""


def read_gltf(path: Path, mesh: str | None = None, animation: str | None = None) -> tuple[pv.PolyData, Recorded]:
    """The mesh of a glTF file at rest, and the recording that moves it; see :func:`facewrinkle.read_animation`."""
    document = _Document(path)
    node = document.chosen_node(mesh)
    rest, recorded = _animated(document, node, document.channels(node, animation))
    others = read_gltf_file(path, without=node)
    return joined([rest, from_primitives(others, path)]) if others else rest, recorded


def _animated(document: _Document, node: int, channels: list[Any]) -> tuple[pv.PolyData, Recorded]:
    skinned = document.file.nodes[node].skin is not None
    points, triangles, texture, deltas, names = document.shape(node)
    still = np.eye(4) if skinned else document.world(node)({})
    points = points @ still[:3, :3].T + still[:3, 3]
    deltas = deltas @ still[:3, :3].T
    if np.linalg.det(still[:3, :3]) < 0.0:
        triangles = triangles[:, ::-1]
    kept, number = welded(points, deltas, triangles)
    mesh = to_polydata(points[kept], number[triangles])
    mesh.field_data[NAME] = [document.label(node)]
    if (images := document.images(node)).max() >= 0:
        mesh.cell_data[IMAGE], mesh.field_data[IMAGES] = images, [str(document.path.absolute())]
    if texture is not None:
        texture = texture * [1.0, -1.0] + [0.0, 1.0]
        mesh.point_data[TEXTURE] = texture[kept]
        mesh.point_data.active_texture_coordinates_name = TEXTURE
        add_seams(mesh, texture[triangles])
    deltas = deltas[:, kept]
    if len(deltas):
        mesh.point_data[MOVED] = blended(deltas)
    weights, pose = _tracks(document, node, channels, len(deltas), still, skinned)
    if not len(deltas):
        return mesh, Recorded(weights, (), deltas, np.array(mesh.points), pose)
    return mesh, Recorded.of_shapes(deltas, weights, names=names, rest=mesh.points, pose=pose)


def _tracks(
    document: _Document, node: int, channels: list[Any], count: int, still: Array, skinned: bool
) -> tuple[Track, Callable[[float], Array] | None]:
    """Weights over all the time of the animation, and how the node has moved since rest."""
    moving: dict[tuple[int, str], Track] = {}
    weights: Track | None = None
    for sampler, target in channels:
        if target.path == "weights":
            weights = document.track(sampler, count)
        elif not skinned:
            moving[target.node, target.path] = document.track(sampler, 4 if target.path == "rotation" else 3)
    ends = [end for track in moving.values() for end in (track.times[0], track.times[-1])]
    if weights is None:
        times = np.unique([min(ends), max(ends)])
        weights = Track(times, np.tile(document.rest_weights(node, count), (len(times), 1)))
    if not moving:
        return weights, None
    world, back = document.world(node), np.linalg.inv(still)

    def pose(time: float) -> Array:
        return world({where: _part_at(track, time, where[1]) for where, track in moving.items()}) @ back

    return _prolonged(_prolonged(weights, min(ends)), max(ends)), pose


def _prolonged(track: Track, time: float) -> Track:
    """The track with its first or last value held back to, or until, a time."""
    if track.times[0] <= time <= track.times[-1]:
        return track
    end, at, outward = (0, 0, 0) if time < track.times[0] else (-1, len(track.times), 1)
    slopes = track.slopes
    if slopes is not None:
        slopes = slopes.copy()
        slopes[outward, end] = 0.0
        slopes = np.insert(slopes, at, 0.0, axis=1)
    values = np.insert(track.values, at, track.values[end], axis=0)
    return Track(np.insert(track.times, at, time), values, track.interpolation, slopes)


def _part_at(track: Track, time: float, path: str) -> Array:
    """Translation, scale or rotation at a time; a rotation turns evenly, the short way."""
    if path != "rotation" or track.interpolation != "linear":
        return track.at(time)
    i, share, _ = track.place(time)
    if share == 0.0:
        return track.at(time)
    a, b = track.values[i], track.values[i + 1]
    cosine = float(a @ b)
    b, cosine = (b, cosine) if cosine >= 0.0 else (-b, -cosine)
    if cosine > 1.0 - 1e-12:
        return np.asarray(a + share * (b - a))
    angle = np.arccos(cosine)
    return np.asarray((np.sin((1.0 - share) * angle) * a + np.sin(share * angle) * b) / np.sin(angle))


class _Document:
    """A glTF file: nodes, meshes and animations as arrays."""

    def __init__(self, path: Path) -> None:
        try:
            import pygltflib
        except ImportError:
            raise MissingPackageError(
                "animations of glTF files need the package pygltflib, which is not installed. "
                "pip install 'facewrinkle[export]'"
            ) from None
        self.path, self.name, self._folder = path, path.name, path.parent
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                self.file: Any = pygltflib.GLTF2().load(str(path))
        except Exception as problem:  # whatever a damaged file leads to
            raise self._damaged(problem) from None
        if self.file is None:
            raise self._damaged("it is no glTF")
        for extension in self.file.extensionsRequired or []:
            if extension in COMPRESSED:
                raise MeshError(
                    f"{self.name} is compressed with {COMPRESSED[extension]}, which is not supported. "
                    "Export it without compression."
                )
        self._buffers: dict[int, bytes] = {}
        self._parents = {child: i for i, node in enumerate(self.file.nodes) for child in node.children or []}

    def _damaged(self, problem: object) -> MeshError:
        return MeshError(f"{self.name} cannot be read: {problem}. The file is damaged: export it again.")

    # --- numbers -------------------------------------------------------------------------------

    def _buffer(self, index: int) -> bytes:
        if index not in self._buffers:
            uri = self.file.buffers[index].uri
            if uri is None:
                data = self.file.binary_blob() or b""
            elif uri.startswith("data:"):
                data = base64.b64decode(uri.split(",", 1)[1])
            else:
                check_file(self._folder / unquote(uri))
                data = (self._folder / unquote(uri)).read_bytes()
            self._buffers[index] = data
        return self._buffers[index]

    def _view(self, index: int, offset: int, kind: Any, shape: tuple[int, int]) -> npt.NDArray[Any]:
        """Rows of numbers from a buffer view."""
        view, kind = self.file.bufferViews[index], np.dtype(kind).newbyteorder("<")
        stride = view.byteStride or shape[1] * kind.itemsize
        data = memoryview(self._buffer(view.buffer))[view.byteOffset or 0 :][: view.byteLength]
        if offset + (shape[0] - 1) * stride + shape[1] * kind.itemsize > len(data):
            raise self._damaged(f"buffer view {index} is shorter than what is to be read from it")
        return np.ndarray(shape, kind, data, offset, (stride, kind.itemsize)).copy()

    def numbers(self, index: int) -> npt.NDArray[Any]:
        """An accessor (count, width); integers that stand for fractions become them."""
        try:
            accessor = self.file.accessors[index]
            kind, shape = COMPONENTS[accessor.componentType], (accessor.count, WIDTHS[accessor.type])
            values: npt.NDArray[Any] = np.zeros(shape, kind)
            if accessor.bufferView is not None:
                values = self._view(accessor.bufferView, accessor.byteOffset or 0, kind, shape)
            if (sparse := accessor.sparse) is not None:
                at, new = sparse.indices, sparse.values
                where = self._view(at.bufferView, at.byteOffset or 0, COMPONENTS[at.componentType], (sparse.count, 1))
                values[where[:, 0]] = self._view(new.bufferView, new.byteOffset or 0, kind, (sparse.count, shape[1]))
        except (IndexError, KeyError, TypeError, ValueError) as problem:
            if isinstance(problem, MeshError):
                raise
            raise self._damaged(f"accessor {index} leads nowhere") from None
        if accessor.normalized and values.dtype.kind in "iu":
            return np.asarray(np.maximum(values / float(np.iinfo(values.dtype).max), -1.0))
        return values

    def track(self, sampler: Any, width: int) -> Track:
        """Times and values (f, width) of an animation sampler."""
        kind = sampler.interpolation or "LINEAR"
        if kind not in INTERPOLATION:
            raise unknown_name("interpolation", kind, INTERPOLATION)
        times = self.numbers(sampler.input)[:, 0].astype(np.float64)
        values = self.numbers(sampler.output).astype(np.float64)
        rows = len(times) * (3 if kind == "CUBICSPLINE" else 1)
        if values.size != rows * width:
            raise self._damaged(f"an animation has {len(times)} times and {values.size} numbers for {width} at each")
        if kind == "CUBICSPLINE":
            values = values.reshape(len(times), 3, width)
            return Track(times, values[:, 1], "cubic", np.stack([values[:, 0], values[:, 2]]))
        values = values.reshape(len(times), width)
        return Track(times, values, INTERPOLATION[kind])

    # --- what is in the file -------------------------------------------------------------------

    def _targets(self, node: int) -> int:
        return len(self.file.meshes[self.file.nodes[node].mesh].primitives[0].targets or [])

    def _count(self, node: int) -> int:
        primitives = self.file.meshes[self.file.nodes[node].mesh].primitives
        return sum(self.file.accessors[p.attributes.POSITION].count for p in primitives)

    def _line(self, node: int) -> list[int]:
        """A node and those that it hangs on."""
        line = [node]
        while line[-1] in self._parents and len(line) <= len(self.file.nodes):
            line.append(self._parents[line[-1]])
        return line

    def label(self, node: int) -> str:
        """The name of a node's mesh, of the node, or its number."""
        mesh = self.file.meshes[self.file.nodes[node].mesh]
        return str(mesh.name or self.file.nodes[node].name or node)

    def _moving(self, node: int, animation: Any) -> list[Any]:
        """Sampler and target of each channel that moves a node."""
        line = self._line(node)
        return [
            (animation.samplers[channel.sampler], channel.target)
            for channel in animation.channels
            if (channel.target.node == node if channel.target.path == "weights" else channel.target.node in line)
        ]

    def chosen_node(self, mesh: str | None) -> int:
        """The node whose mesh is meant."""
        nodes = [i for i, node in enumerate(self.file.nodes) if node.mesh is not None]
        if not nodes:
            raise MeshError(f"{self.name} holds no mesh. Export the face with its geometry.")
        if mesh is not None:
            named = [i for i in nodes if mesh in (self.label(i), self.file.nodes[i].name)]
            if not named:
                raise unknown_name("mesh", mesh, map(self.label, nodes))
            return named[0]
        found = [i for i in nodes if any(self._moving(i, a) for a in self.file.animations)]
        shaped = [i for i in found or nodes if self._targets(i)]
        candidates = sorted(shaped or found or nodes, key=self._count, reverse=True)
        if len(candidates) > 1:
            warnings.warn(
                f"{self.name} holds {len(candidates)} meshes that may be meant: "
                f"{', '.join(map(self.label, candidates))}; took the first, which has the most points. "
                "Name another with mesh=.",
                FaceWrinkleWarning,
                stacklevel=4,
            )
        return candidates[0]

    def channels(self, node: int, animation: str | None) -> list[Any]:
        """What moves a node in an animation."""
        known = [str(a.name or i) for i, a in enumerate(self.file.animations)]
        if not known:
            raise MeshError(f"{self.name} holds no animation. fit_face and read_surface read meshes that keep still.")
        if animation is not None and animation not in known:
            raise unknown_name("animation", animation, known)
        skinned = self.file.nodes[node].skin is not None
        for name, entry in zip(known, self.file.animations, strict=True):
            found = self._moving(node, entry)
            if skinned:  # bones move it, and its node does not count
                found = [channel for channel in found if channel[1].path == "weights"]
            if found and animation in (None, name):
                if skinned:
                    warnings.warn(
                        f"{self.name}: the bones of {self.label(node)} are not supported and are passed over; its "
                        "shapes are played.",
                        FaceWrinkleWarning,
                        stacklevel=4,
                    )
                return found
        raise MeshError(
            f"{self.name}: no animation ({', '.join(known)}) moves the shapes of {self.label(node)}"
            + (", and bones are not supported. Bake the motion to shape keys." if skinned else " or its node.")
        )

    def shape(self, node: int) -> tuple[Array, npt.NDArray[np.int64], Array | None, Array, tuple[str, ...]]:
        """Points, triangles, texture coordinates, displacements (k, n, 3) and names of the shapes of a node's mesh."""
        mesh = self.file.meshes[self.file.nodes[node].mesh]
        parts = [self._part(primitive) for primitive in mesh.primitives]
        if len({len(part[3]) for part in parts}) > 1:
            raise self._damaged(f"the parts of {self.label(node)} have different numbers of shapes")
        starts = np.cumsum([0, *(len(part[0]) for part in parts[:-1])])
        triangles = np.concatenate([part[1] + start for part, start in zip(parts, starts, strict=True)])
        textures = [part[2] for part in parts]
        texture = None if any(t is None for t in textures) else np.concatenate([t for t in textures if t is not None])
        deltas = np.concatenate([part[3] for part in parts], axis=1)
        extras = mesh.extras if isinstance(mesh.extras, dict) else {}
        names = [str(name) for name in extras.get("targetNames", [])]
        if len(names) != len(deltas) or len(set(names)) < len(names):
            names = [f"shape_{i}" for i in range(len(deltas))]
        return np.concatenate([part[0] for part in parts]), triangles, texture, deltas, tuple(names)

    def images(self, node: int) -> npt.NDArray[np.int64]:
        """The number of the image on each triangle of a node's mesh, -1 for none."""
        found = []
        for primitive in self.file.meshes[self.file.nodes[node].mesh].primitives:
            count = self.file.accessors[
                primitive.attributes.POSITION if primitive.indices is None else primitive.indices
            ].count
            number = -1
            if primitive.material is not None and primitive.material < len(self.file.materials):
                look = self.file.materials[primitive.material].pbrMetallicRoughness
                texture = None if look is None else look.baseColorTexture
                if texture is not None and texture.index < len(self.file.textures):
                    source = self.file.textures[texture.index].source
                    number = -1 if source is None else source
            found.append(np.full(count // 3, number))
        return np.concatenate(found)

    def _part(self, primitive: Any) -> tuple[Array, npt.NDArray[np.int64], Array | None, Array]:
        if primitive.mode not in (None, TRIANGLES) or primitive.attributes.POSITION is None:
            raise MeshError(
                f"{self.name} must hold triangles (no points, lines, strips or fans). Export it as triangles."
            )
        if set(primitive.extensions or {}) & set(COMPRESSED):
            raise MeshError(f"{self.name} is compressed, which is not supported. Export it without compression.")
        points = self.numbers(primitive.attributes.POSITION).astype(np.float64)
        order = np.arange(len(points)) if primitive.indices is None else self.numbers(primitive.indices)[:, 0]
        if not len(order) or len(order) % 3 or order.max() >= len(points):
            raise self._damaged("its triangles use points that do not exist")
        texture = primitive.attributes.TEXCOORD_0
        shapes = [t["POSITION"] if isinstance(t, dict) else t.POSITION for t in self._with_positions(primitive)]
        deltas = np.array([self.numbers(index) for index in shapes], dtype=np.float64).reshape(-1, len(points), 3)
        return (
            points,
            order.astype(np.int64).reshape(-1, 3),
            None if texture is None else self.numbers(texture).astype(np.float64),
            deltas,
        )

    def _with_positions(self, primitive: Any) -> Sequence[Any]:
        targets = primitive.targets or []
        if not all(isinstance(t, dict) and "POSITION" in t for t in targets):
            raise MeshError(f"{self.name}: every morph target must displace points. Export the positions too.")
        return targets

    def rest_weights(self, node: int, count: int) -> Array:
        """Weights of the shapes while no animation sets them."""
        own = self.file.meshes[self.file.nodes[node].mesh].weights
        return np.array(own, dtype=np.float64) if own and len(own) == count else np.zeros(count)

    def world(self, node: int) -> Callable[[dict[tuple[int, str], Array]], Array]:
        """The matrix (4, 4) of a node in the scene, with some of the parts that make it up replaced."""
        line = self._line(node)

        def matrix(moved: dict[tuple[int, str], Array]) -> Array:
            out = np.eye(4)
            for i in line:
                out = _local(self.file.nodes[i], {path: value for (n, path), value in moved.items() if n == i}) @ out
            return out

        return matrix


def _local(node: Any, moved: dict[str, Array]) -> Array:
    """The matrix (4, 4) of a node relative to the one that it hangs on."""
    if node.matrix is not None and not moved:
        return np.array(node.matrix, dtype=np.float64).reshape(4, 4).T
    x, y, z, w = np.asarray(moved.get("rotation", node.rotation or (0, 0, 0, 1)), dtype=np.float64)
    length = np.sqrt(x * x + y * y + z * z + w * w)
    x, y, z, w = (part / length for part in (x, y, z, w))
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    out = np.eye(4)
    out[:3, :3] = turn * np.asarray(moved.get("scale", node.scale or (1, 1, 1)), dtype=np.float64)
    out[:3, 3] = moved.get("translation", node.translation or (0, 0, 0))
    return out
