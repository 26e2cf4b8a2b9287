"""Animated export: the frames of a clip on one mesh, as a few morph targets whose weights move, or as a point cache."""

from __future__ import annotations

import struct
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy.face import Face
from ..appearance.seen import Appearance, companion_meshes
from ..array_types import Array, Single
from ..errors import MeshError, check_range
from ..files import output_file, write_whole
from ..geometry.refinement import RedGreenForest
from ..mesh import UNIT, reshaped, to_polydata
from ..tears.drop import Sampled
from ..tears.presets import Tear
from .meshes import part_models, write_mesh, write_models
from .model import Model, Morphs, WeightTrack, is_hair, part_model, skin_model
from .usd import SUFFIXES as USD

SUFFIXES = (".glb", ".gltf", ".pc2", *USD)

TURN = 0.01
"""Normals that a target turns by less, in radians, are left as they are."""


def rest_models(face: Face, frame: pv.PolyData) -> dict[str, Model]:
    """Return the skin of a frame, "face", and all that is seen beside it, whether it is hidden now or not.

    Skin without a picture or colors of its own is painted.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> list(rest_models(face, face.mesh))[:3]
    ['face', 'eye_l', 'eye_r']
    """
    skin = skin_model(frame, face)
    if skin.png is None and skin.colors is None and Appearance.of(face).painter is not None:
        skin = replace(skin, colors=Appearance.of(face).at(frame).paint[skin.origin])
    return {"face": skin} | part_models(face, frame, always=True)


def principal_targets(ways: Single, allowed: float) -> tuple[Single, Single]:
    """Return few targets that give displacements within an error: the first principal components.

    What targets move hardly is left out as far as the error allows, so that files are small.

    Parameters
    ----------
    ways : ndarray of float32, shape (f, n, 3)
        Displacements of n points in f frames.
    allowed : float
        The largest distance of any point in any frame, in the same unit.

    Returns
    -------
    weights : ndarray of float32, shape (f, k)
        The largest of each component is 1, apart from its sign.
    targets : ndarray of float32, shape (k, n, 3)
        ``weights @ targets`` is as close to the displacements as was asked for.

    Examples
    --------
    Two movements in a hundred frames are two targets:

    >>> random = np.random.default_rng(0)
    >>> ways = np.tensordot(random.normal(size=(100, 2)), random.normal(size=(2, 30, 3)), axes=1)
    >>> weights, targets = principal_targets(ways.astype(np.float32), 1e-3)
    >>> targets.shape, bool(np.abs(np.tensordot(weights, targets, axes=1) - ways).max() < 1e-3)
    ((2, 30, 3), True)
    """
    flat = np.ascontiguousarray(ways.reshape(len(ways), -1), np.float32)
    square, vectors = np.linalg.eigh(np.asarray(flat @ flat.T, np.float64))
    vectors = vectors[:, np.argsort(square)[::-1]].astype(np.float32)
    shares = vectors.T @ flat

    def within(count: int) -> bool:  # a twentieth of the error is left for points that targets leave out
        return bool(_off(flat, vectors[:, :count], shares[:count]).max(initial=0.0) <= 0.95 * allowed)

    count = bisect_left(range(len(ways)), True, key=within)  # with all of them nothing is lost
    weights, targets = vectors[:, :count], shares[:count]
    largest = np.abs(weights).max(axis=0, initial=np.float32(1e-30))
    return weights / largest, _thinned(flat, weights, targets, largest, allowed).reshape(count, *ways.shape[1:])


def _off(flat: Single, weights: Single, targets: Single) -> Single:
    """Return the distance (f, n) of every point in every frame from where it should be."""
    left = flat - weights @ targets
    return np.sqrt(np.square(left, out=left).reshape(len(flat), -1, 3).sum(axis=2))


def _thinned(flat: Single, weights: Single, targets: Single, largest: Single, allowed: float) -> Single:
    """Return targets (k, 3 n) at largest weight 1 without the smallest displacements, as far as the error allows."""
    high = len(targets)
    size = np.linalg.norm(targets.reshape(high, flat.shape[1] // 3, 3), axis=2) * largest[:, None]
    kept, below = targets, allowed
    while high and below > 1e-4 * allowed:
        cut = np.where(np.repeat(size > below, 3, axis=1), targets, np.float32(0.0))
        if _off(flat, weights, cut).max(initial=0.0) <= allowed:
            kept = cut
            break
        below *= 0.6
    return np.asarray(kept * largest[:, None])


class AnimationWriter:
    """Collects the frames of a clip, and writes them as an animation of one mesh.

    The mesh may only grow from frame to frame (``Refinement(coarsen=False)``).

    Parameters
    ----------
    face : Face
    path : path
        Ends in .glb, .gltf, .usd, .usdc, .usda or .pc2.
    error : float
        The largest distance of any point, but those of hairs, in any frame from where it should be, mm. Point caches
        are exact.

    Raises
    ------
    OutputError
        If the file cannot be written.
    ParameterError
        For an error that is not positive.

    Attributes
    ----------
    targets : int
        Number of morph targets that were written.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> import tempfile
    >>> face = fw.default_face()
    >>> sim = fw.Simulation(face, fw.Refinement(max_level=1, coarsen=False))
    >>> sim.express("surprise")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     writer = AnimationWriter(face, f"{folder}/surprise.glb", error=0.2)
    ...     for frame in sim.run(10):
    ...         writer.add(frame)
    ...     files = writer.write(np.arange(10) * 0.02, sim.forest)
    >>> writer.targets < 10
    True
    """

    def __init__(self, face: Face, path: str | Path, error: float = 0.1) -> None:
        self.face, self.path = face, output_file(path, SUFFIXES)
        self.error = check_range("animation_error", error, 1e-6, 1e3, "Lengths are in mm.")
        self.targets = 0
        self._last: pv.PolyData | None = None
        self._frames: list[Single] = []  # points and normals (n, 6) of the skin, side by side
        self._parts: list[dict[str, Single]] = []

    def add(self, frame: pv.PolyData) -> None:
        """Take in the next frame."""
        if self._frames and frame.n_points < len(self._frames[-1]):
            raise MeshError(
                "an animation needs a mesh that only grows, and this frame has fewer points than the one before. "
                "Simulate with Refinement(coarsen=False)."
            )
        self._frames.append(_side_by_side(np.asarray(frame.points), frame.point_data["Normals"]))
        self._last = frame
        if self.path.suffix.lower() != ".pc2":
            models = {n: part_model(mesh) for n, mesh in companion_meshes(self.face, frame, always=True).items()}
            self._parts.append({name: _side_by_side(model.points, model.normals) for name, model in models.items()})

    def write(self, times: Sequence[float] | Array, forest: RedGreenForest, tears: Sequence[Tear] = ()) -> list[Path]:
        """Write the animation, and return the files written.

        Parameters
        ----------
        times : array_like, shape (f,)
            Of the frames, s.
        forest : RedGreenForest
            The triangles at the end.
        tears : sequence of DrippingTear or SheddingTear
            They get meshes of their own, "tears_1" and so on, whose triangles stay, too.
        """
        if self._last is None:
            raise MeshError("an animation needs at least one frame.")
        times = np.asarray(times, np.float64)
        self._frames = [_grown(frame, forest) for frame in self._frames]
        rest = self._last.copy()
        rest.points = np.asarray(rest.point_data["rest"])
        rest.point_data["Normals"] = np.ascontiguousarray(self._frames[0][:, 3:])
        if self.path.suffix.lower() == ".pc2":
            return self._write_caches(rest, times, tears)
        return self._write_targets(rest, times, tears)

    def _write_caches(self, rest: pv.PolyData, times: Array, tears: Sequence[Tear]) -> list[Path]:
        files = [self.path, write_mesh(rest, self.path.with_suffix(".obj"), self.face)]
        bare = replace(self.face, texture=None)  # there is none on water
        points = np.stack(self._frames)[..., :3]
        _write_cache(self.path, points)
        for name, tear in self._sampled(tears, times, rest, points).items():
            path = self.path.with_name(f"{self.path.stem}_{name}.pc2")
            first = to_polydata(tear.points[0], tear.triangles)
            files += [path, write_mesh(first, path.with_suffix(".obj"), bare)]
            _write_cache(path, tear.points)
        return files

    def _sampled(self, tears: Sequence[Tear], times: Array, rest: pv.PolyData, points: Single) -> dict[str, Sampled]:
        """Return tears on frames of the skin at points (f, n, 3), by the names of their meshes."""
        frames = []
        for at, frame in zip(points, self._frames, strict=True) if tears else ():
            frames.append(reshaped(rest, np.asarray(at, np.float64), frame[:, 3:]))
            frames[-1].field_data[UNIT] = rest.field_data[UNIT]
        found = [sampled for tear in tears if (sampled := tear.sampled(times, frames)) is not None]
        return {f"tears_{k}": sampled for k, sampled in enumerate(found, start=1)}

    def _write_targets(self, rest: pv.PolyData, times: Array, tears: Sequence[Tear]) -> list[Path]:
        """Write the meshes and the weights of their targets; return the files."""
        models = rest_models(self.face, rest)
        names = list(models)
        tracks = {name: np.stack([frame[name] for frame in self._parts]) for name in names if name != "face"}
        tracks["face"] = np.stack(self._frames)[:, models["face"].origin]
        ways = {name: tracks[name][..., :3] - models[name].points.astype(np.float32) for name in names}
        bound = [name for name in names if not is_hair(name)]
        allowed = self.error / self.face.unit
        weights, targets = principal_targets(np.concatenate([ways[name] for name in bound], axis=1), allowed)
        self.targets = len(targets)
        inverse = np.linalg.pinv(weights.astype(np.float64)).astype(np.float32)
        labels = [f"motion_{k}" for k in range(self.targets)]
        ends = np.cumsum([len(models[name].points) for name in bound])
        shared = dict(zip(bound, np.split(targets, ends[:-1], axis=1), strict=True))
        morphs = {}
        for name, model in models.items():
            if is_hair(name):
                moved = np.tensordot(inverse, ways[name], axes=1)
                moved *= np.linalg.norm(moved, axis=2, keepdims=True) > 0.1 * allowed
                turned = np.zeros_like(moved)
            else:
                moved = shared[name]
                turned = np.tensordot(inverse, tracks[name][..., 3:] - model.normals.astype(np.float32), axes=1)
                turned *= np.linalg.norm(turned, axis=2, keepdims=True) > TURN
            morphs[name] = Morphs(labels, moved, turned)
        track = WeightTrack(times, weights.astype(np.float64))
        follow = dict.fromkeys(names, track) if self.targets else {}
        # On the skin as targets show it: tears are thinner than these are off.
        shown = np.tensordot(weights, morphs["face"].deltas[:, : rest.n_points], axes=1)
        shown += models["face"].points[: rest.n_points].astype(np.float32)
        thin = 0.02 / self.face.unit  # mm; the film of a tear is three times as thick
        for name, tear in self._sampled(tears, times, rest, shown).items():
            models[name], morphs[name], own_weights = _tear_targets(name, tear, min(allowed, thin))
            if own_weights.shape[1]:  # what does not move has nothing to follow
                follow[name] = WeightTrack(times, own_weights)
        shapes = {name: morphs[name] for name in follow}
        return write_models(self.path, models, self.face, shapes, follow)


def _side_by_side(points: Array, normals: Array) -> Single:
    """Return points and normals (n, 3) as one array (n, 6)."""
    return np.hstack([points, normals]).astype(np.float32)


def _write_cache(path: Path, points: npt.NDArray[np.floating[Any]]) -> None:
    """Write points (f, n, 3) as a point cache.

    Its header: signature, version, points, first frame, frames per sample, samples.
    """
    header = struct.pack("<12siiffi", b"POINTCACHE2\0", 1, points.shape[1], 0.0, 1.0, len(points))
    write_whole(path, header + points.astype("<f4").tobytes())


def increments(values: Array, least: float) -> Single:
    """Return what each frame adds to those before (f, n, 3), without what is smaller than `least` so far.

    What has been left out is made up for as soon as it is large enough: sums of increments are nowhere farther off.
    The few points that move at a time make these smaller, for a drop that travels, than principal components.

    Examples
    --------
    >>> creeping = np.linspace(0.0, 1.0, 5)[:, None, None] * [[[1.0, 0.0, 0.0]]]
    >>> increments(creeping, 0.3)[:, 0, 0]
    array([0. , 0. , 0.5, 0. , 0.5], dtype=float32)
    """
    out, so_far = np.zeros(values.shape, np.float32), values[0].astype(np.float64)
    for k in range(1, len(values)):
        step = (values[k] - so_far).astype(np.float32)
        step[np.linalg.norm(step, axis=1) <= least] = 0.0
        out[k] = step
        so_far = so_far + step
    return out


def _tear_targets(name: str, tear: Sampled, allowed: float) -> tuple[Model, Morphs, Array]:
    """Return the mesh of a tear in the first frame, its targets, and their weights (f, k): each comes to stay."""
    moved, turned = increments(tear.points, allowed), increments(tear.normals, TURN)
    adding = np.flatnonzero(moved.any(axis=(1, 2)) | turned.any(axis=(1, 2)))
    weights = (np.arange(len(moved))[:, None] >= adding).astype(np.float64)
    origin, triangles = np.arange(tear.points.shape[1]), tear.triangles.astype(np.int64)
    model = Model(tear.points[0], tear.normals[0], triangles, origin, None, None, None, water=True)
    labels = [f"{name}_{k}" for k in range(len(adding))]
    return model, Morphs(labels, moved[adding], turned[adding]), weights


def _grown(values: Single, forest: RedGreenForest) -> Single:
    """Return values (n0, k) of an earlier frame at all vertices: new ones lie midway between older ones."""
    parents, level = forest.parents, forest.vertex_level
    out = np.zeros((forest.n_points, values.shape[1]), np.float32)
    out[: len(values)] = values
    new = np.arange(len(values), len(out))
    for k in np.unique(level[new]):
        at = new[level[new] == k]
        out[at] = 0.5 * (out[parents[at, 0]] + out[parents[at, 1]])
    return out
