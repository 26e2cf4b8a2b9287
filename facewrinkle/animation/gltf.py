"""glTF and GLB files with an animation: the meshes at rest, and the shapes, nodes and bones that move them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from scipy.sparse import csr_array, vstack
from scipy.spatial.transform import Rotation

from ..array_types import Array
from ..errors import MeshError, check_name, check_range, unknown_name, warn
from ..mesh import Surface
from ..mesh.formats.gltf import Document, rotations
from ..mesh.formats.merging import merged_primitives
from .action_units import named_shapes
from .recorded import Bones, Interpolation, Recorded, Track, with_companions

WIDTHS = {"translation": 3, "rotation": 4, "scale": 3}

Key = tuple[int, str]
"""A node, and the property of it that moves: "translation", "rotation", "scale" or "weights"."""


def read_gltf(
    path: Path,
    mesh: str | None = None,
    animation: str | None = None,
    shapes: Mapping[str, float] | None = None,
) -> tuple[pv.PolyData, Recorded]:
    """Read the meshes of a glTF file at rest, and their recording; see :func:`facewrinkle.read_animation`."""
    document = Document(path)
    world = document.world()
    models = [_Model.of(document, node, world) for node in document.shown]
    models = [model for model in models if model.primitives]
    clips = _clips(document)
    skin = _chosen(document, models, clips, mesh)
    tracks = _tracks(document, models, skin, clips, animation) if shapes is None else _posed(path, skin, shapes)
    scene = _Scene(document, world, tracks)
    surface, recorded = _animated(scene, skin)
    if recorded is None:
        raise MeshError(
            f"{path.name}: no animation ({', '.join(clips)}) moves {skin.label}: neither its shapes nor its node "
            "nor bones. Name another mesh."
        )
    others = [_animated(scene, model, recorded) for model in models if model is not skin]
    return with_companions(surface, recorded, others)


# --- what is in the file --------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Model:
    """The mesh of a node.

    `bearers` are the nodes whose motion moves it: those of its bones, or its own node, and all nodes above these.
    """

    node: int
    label: str
    names: tuple[str, ...]
    rest_weights: Array
    primitives: list[Surface]
    bearers: frozenset[int]

    @classmethod
    def of(cls, document: Document, node: int, world: Array) -> _Model:
        entry = document.nodes[node]
        mesh = document.file["meshes"][entry["mesh"]]
        primitives = document.primitives(node, world)
        borne = [part.weights for part in primitives if part.weights is not None]
        bones = document.bones(node)[0] if borne else []
        parents = [bones[bone] for weights in borne for bone in np.unique(weights.indices)] if borne else [node]
        count = max((len(part.shapes) for part in primitives if part.shapes is not None), default=0)
        names = _target_names(mesh)
        if len(names) != count or len(set(names)) < count:
            names = [f"shape_{i}" for i in range(count)]
        own = entry.get("weights") or mesh.get("weights") or []
        weights = np.array(own, dtype=np.float64) if len(own) == count else np.zeros(count)
        return cls(node, document.label(node), tuple(names), weights, primitives, _with_ancestors(document, parents))

    @property
    def moved_by(self) -> set[Key]:
        """Keys of the tracks that may move the mesh."""
        return {(self.node, "weights")} | {(node, path) for node in self.bearers for path in WIDTHS}

    @property
    def count(self) -> int:
        return sum(len(part.points) for part in self.primitives)


def _target_names(mesh: Mapping[str, Any]) -> list[str]:
    """Return the names that a mesh, or a primitive of it, gives its shapes."""
    for owner in (mesh, *mesh["primitives"]):
        extras = owner.get("extras")
        if isinstance(extras, dict) and isinstance(extras.get("targetNames"), list):
            return [str(name) for name in extras["targetNames"]]
    return []


def _with_ancestors(document: Document, nodes: Iterable[int]) -> frozenset[int]:
    """Return nodes together with all nodes above them."""
    found = set(nodes)
    while above := {document.parents[node] for node in found} - found - {-1}:
        found |= above
    return frozenset(found)


Clip = dict[Key, dict[str, Any]]
"""The samplers of an animation, by what they move."""


def _clips(document: Document) -> dict[str, Clip]:
    """Return the animations by name; where a name is taken, the number of the animation is added to it."""
    found: dict[str, Clip] = {}
    for number, entry in enumerate(document.file.get("animations") or []):
        channels = [(channel["target"], entry["samplers"][channel["sampler"]]) for channel in entry["channels"]]
        clip = {(t["node"], t["path"]): sampler for t, sampler in channels if t.get("node") is not None}
        name = str(entry.get("name") or number)
        found[name if name not in found else f"{name}.{number}"] = clip
    return found


def _chosen(document: Document, models: list[_Model], clips: Mapping[str, Clip], name: str | None) -> _Model:
    """Return the mesh of that name; by default one whose shapes move, a head before others, then the largest."""
    if not models:
        raise MeshError(f"{document.path.name} holds no mesh. Export the face with its geometry.")
    if name is not None:
        named = [model for model in models if name in (model.label, document.nodes[model.node].get("name"))]
        if not named:
            raise unknown_name("mesh", name, [model.label for model in models])
        return named[0]
    keys = {key for clip in clips.values() for key in clip}
    found = [model for model in models if model.moved_by & keys] or models
    morphing = [model for model in found if (model.node, "weights") in keys]
    shaped = [model for model in found if model.names]
    head = re.compile(r"(head|face)(?!wear|band|set|gear|hair)", re.IGNORECASE)
    candidates = sorted(morphing or shaped or found, key=lambda model: (not head.search(model.label), -model.count))
    if len(candidates) > 1 and candidates[0].label.lower() not in ("face", "head"):
        warn(
            f"{document.path.name} holds {len(candidates)} meshes that may be meant: "
            f"{', '.join(model.label for model in candidates)}; took the first, which is called a head or has the most "
            "points. Name another mesh."
        )
    return candidates[0]


# --- what moves -----------------------------------------------------------------------------------


def _tracks(
    document: Document, models: list[_Model], skin: _Model, clips: Mapping[str, Clip], name: str | None
) -> dict[Key, Track]:
    """Return the tracks of the animation of that name; by default of the first that moves the skin, and of others.

    Others are added if they move nothing that is moved already: exporters write one animation for each object.
    """
    if not clips:
        said = "fit_face and read_surface read meshes that keep still."
        if skin.names:
            few = ", ".join(skin.names[:5]) + (", ..." if len(skin.names) > 5 else "")
            said = (
                f"{skin.label} has {len(skin.names)} shapes ({few}): ask for some shapes, each with a weight, or "
                + said
            )
        raise MeshError(f"{document.path.name} holds no animation. {said}")
    if name is not None:
        check_name("animation", name, clips)
        clips = {name: clips[name]}
    first = next((clip for clip in clips.values() if skin.moved_by & clip.keys()), {})
    chosen = dict(first)
    for clip in clips.values() if first else ():
        if not chosen.keys() & clip.keys():
            chosen |= clip
    counts = {model.node: len(model.names) for model in models}
    needed = set().union(*(model.moved_by for model in models)) & chosen.keys()
    return {
        (node, path): _track(document, chosen[node, path], counts[node] if path == "weights" else WIDTHS[path])
        for node, path in sorted(needed)
    }


def shapes_of_gltf(path: Path) -> tuple[dict[str, tuple[str, ...]], tuple[str, ...]]:
    """Return the names of the shapes of each mesh of a glTF file that has some, and those of its animations."""
    document = Document(path)
    world = document.world()
    models = [_Model.of(document, node, world) for node in document.shown]
    return {model.label: model.names for model in models if model.names}, tuple(_clips(document))


def _posed(path: Path, skin: _Model, shapes: Mapping[str, float]) -> dict[Key, Track]:
    """Return the track that takes the shapes of a mesh that are asked for, and holds them."""
    if not skin.names:
        raise MeshError(f"{path.name}: {skin.label} has no shapes. Name another mesh.")
    asked = np.zeros(len(skin.names))
    for name, weight in shapes.items():
        check_range(f"the weight of the shape {name}", weight, 0.0, 1.0)
        for own in named_shapes(name, skin.names):
            asked[skin.names.index(own)] = weight
    track = Track(np.array([0.0, 1.0, 1.5]), np.stack([np.zeros_like(asked), asked, asked]))
    return {(skin.node, "weights"): track}


def _track(document: Document, sampler: Mapping[str, Any], width: int) -> Track:
    """Return the times and values (f, width) of an animation sampler."""
    kind = sampler.get("interpolation") or "LINEAR"
    kinds: dict[str, Interpolation] = {"LINEAR": "linear", "STEP": "step", "CUBICSPLINE": "cubic"}
    check_name("interpolation", kind, kinds)
    times = document.numbers(sampler["input"])[:, 0].astype(np.float64)
    values = document.numbers(sampler["output"]).astype(np.float64)
    if not (np.isfinite(times).all() and np.isfinite(values).all()):
        raise document.broken("an animation has numbers that are not finite")
    if values.size != len(times) * (3 if kind == "CUBICSPLINE" else 1) * width:
        raise document.broken(f"an animation has {len(times)} times and {values.size} numbers for {width} at each")
    if kind == "CUBICSPLINE":
        values = values.reshape(len(times), 3, width)
        return Track(times, values[:, 1], "cubic", np.stack([values[:, 0], values[:, 2]]))
    return Track(times, values.reshape(len(times), width), kinds[kind])


class _Scene:
    """The nodes of a file while an animation moves them."""

    def __init__(self, document: Document, rest: Array, tracks: Mapping[Key, Track]) -> None:
        self.document, self.rest, self.tracks = document, rest, tracks
        self._last = (np.nan, rest)

    def world(self, time: float) -> Array:
        """Return the matrices (k, 4, 4) of all nodes at a time."""
        if time != self._last[0]:
            moved: dict[int, dict[str, Array]] = {}
            for (node, path), track in self.tracks.items():
                if path in ("translation", "scale"):
                    moved.setdefault(node, {})[path] = track.at(time)
            turning = {node: track for (node, path), track in self.tracks.items() if path == "rotation"}
            for node, rotation in zip(turning, _rotations_at([*turning.values()], time), strict=True):
                moved.setdefault(node, {})["rotation"] = rotation
            self._last = time, self.document.world(moved)
        return self._last[1]

    def weights(self, model: _Model, like: Recorded | None) -> Track | None:
        """Return the weights of a mesh's shapes; if the file has none, those of the same names on the skin."""
        own = self.tracks.get((model.node, "weights"))
        if own is not None or like is None:
            return own
        same = (np.array(like.names, str)[:, None] == np.array(model.names, str)).astype(np.float64)
        values, slopes = like.track.values @ same, like.track.slopes
        if not values.any():
            return None
        return replace(like.track, values=values, slopes=None if slopes is None else slopes @ same)


def _animated(scene: _Scene, model: _Model, like: Recorded | None = None) -> tuple[Surface, Recorded | None]:
    """Return a mesh at rest, and the recording that moves it, if anything does."""
    surface, kept, deltas = merged_primitives(model.primitives, scene.document.path)
    moving = [track for (node, path), track in scene.tracks.items() if node in model.bearers and path != "weights"]
    weights = scene.weights(model, like)
    if weights is None and not moving:
        return surface, None
    ends = [float(end) for track in moving for end in (track.times[0], track.times[-1])]
    if weights is None:
        times = np.unique([min(ends), max(ends)])
        weights = Track(times, np.tile(model.rest_weights, (len(times), 1)))
    elif ends:
        weights = _prolonged(weights, min(ends), max(ends))
    rest = np.array(surface.points)
    if len(deltas):
        recorded = Recorded.of_shapes(deltas, weights, names=model.names, rest=rest)
    else:
        recorded = Recorded(weights, (), deltas, rest)
    if not moving:
        return surface, recorded
    borne = [part.weights for part in model.primitives]
    if any(own is None for own in borne):
        node, back = model.node, np.linalg.inv(scene.rest[model.node])
        return surface, replace(recorded, pose=lambda time: scene.world(time)[node] @ back)
    joints, bind = scene.document.bones(model.node)
    weights_of_bones = csr_array(vstack(borne))[kept]
    bones = Bones(weights_of_bones, lambda time: scene.world(time)[joints] @ bind, scene.rest[joints] @ bind)
    return surface, replace(recorded, bones=bones)


def _prolonged(track: Track, first: float, last: float) -> Track:
    """Return the track with its first value held from a time on, and its last one until another."""
    added = int(first < track.times[0]), int(last > track.times[-1])
    times = np.concatenate([[first] * added[0], track.times, [last] * added[1]])
    values, slopes = np.pad(track.values, (added, (0, 0)), "edge"), track.slopes
    if slopes is not None:
        slopes = np.pad(slopes, ((0, 0), added, (0, 0)))
        slopes[0, added[0]] = slopes[1, len(track.times) - 1 + added[0]] = 0.0
    return Track(times, values, track.interpolation, slopes)


def _rotations_at(tracks: Sequence[Track], time: float) -> Array:
    """Return rotations (k, 4) at a time, as quaternions; linear ones turn evenly, the short way (slerp)."""
    first, last, share = np.empty((len(tracks), 4)), np.empty((len(tracks), 4)), np.zeros(len(tracks))
    for row, track in enumerate(tracks):
        if track.interpolation == "linear":
            i, share[row] = track.place(time)
            first[row], last[row] = track.values[i], track.values[min(i + 1, len(track.values) - 1)]
        else:
            first[row] = last[row] = track.at(time)
    start = rotations(first)
    turn = (start.inv() * rotations(last)).as_rotvec()
    return np.asarray((start * Rotation.from_rotvec(share[:, None] * turn)).as_quat())
