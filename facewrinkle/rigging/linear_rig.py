"""Rigs: the blend shapes of a face, on one mesh that is fine enough for the wrinkles of all of them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy.face import Face
from ..arguments import checked
from ..errors import ParameterError, check_range, check_whole, unknown_name, warn
from ..export.model import Model
from ..export.morphs import Morphs
from ..geometry.smoothstep import smoothstep
from ..geometry.topology import unique_edges
from ..mesh import to_polydata
from .baking import Baker, Placed, Progress, silent
from .correctives import Pair, worst_pairs
from .maps import around_head, check_texture
from .poses import Pose, Posing, share_of_side
from .shapes import ARKIT, Shape, Side, shapes_of

Array = npt.NDArray[np.float64]
Single = npt.NDArray[np.float32]

Wrinkling = Literal["baked", "separate", "maps", "none"]

WRINKLING = ("baked", "separate", "maps", "none")

CUT = 0.1
"""Way in mm below which a vertex is left out of a shape; ways up to twice as long fade, lest the skin have a step."""

HAIR_CUT = 0.2
"""The same for brows and lashes, whose hairs are many, and lie on skin that hardly moves then."""

RINGS = 2
"""The longest way of vertices within so many edges decides about fading: between crest and furrow a vertex hardly
moves, but its normal turns.
"""

TURN = 0.03
"""Normals that turn by less, in radians, are left as they are."""

HAIRY = ("lashes", "brows")
"""Parts, by the first word of their names, whose normals stay: how a hair shines does not tell how it lies."""

MOST_PAIRS = 200
"""The most pairs of shapes that may be corrected."""

LEVEL, FINEST = 2, 5
"""The usual and the highest level of refinement."""

BOTH_WAYS = ("browInnerUp", "cheekPuff")
"""Shapes of both sides that other tools divide."""

MIXTURES: tuple[Mapping[str, float], ...] = (
    {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0, "cheekSquintLeft": 1.0, "cheekSquintRight": 1.0},
    {"browInnerUp": 1.0, "browOuterUpLeft": 1.0, "browOuterUpRight": 1.0},
    {"browDownLeft": 1.0, "browDownRight": 1.0, "noseSneerLeft": 1.0, "noseSneerRight": 1.0},
    {"jawOpen": 0.6, "mouthSmileLeft": 1.0, "mouthSmileRight": 1.0},
    {"jawOpen": 0.6, "mouthFunnel": 1.0},
    {"jawOpen": 1.0, "mouthClose": 1.0},
    {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0, "mouthSmileLeft": 0.5, "mouthSmileRight": 0.5},
)
"""Common mixtures, of which the report tells the error."""


@dataclass(frozen=True)
class RigError:
    """Distance of a linear rig from the simulation's skin, over the vertices that either moves by more than 0.1 mm.

    Attributes
    ----------
    mean, largest : float
        mm.
    motion : float
        The mean way of the same vertices in the simulation, mm.

    Examples
    --------
    >>> error = RigError(mean=0.2, largest=1.1, motion=4.0)
    >>> error.mean / error.motion
    0.05
    """

    mean: float
    largest: float
    motion: float


@dataclass(frozen=True, eq=False)
class Rig:
    """A face with blend shapes; made by :func:`facewrinkle.rig`.

    Attributes
    ----------
    face : Face
    names : tuple of str
        Names of the k shapes.
    parts : dict of str to Model
        The meshes at rest, "face" first; then eyes, teeth, lashes, brows and all that came with the face.
    morphs : dict of str to Morphs
        The shapes of each mesh, all with the same names.
    left_out : dict of str to str
        Shapes that were asked for and that this face cannot make, with the reason.
    drivers : dict of str to tuple of str
        Targets that are no shapes of their own, and the shapes whose weights are multiplied to theirs: a shape's own
        weight with itself for its wrinkles, two for a corrective.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> rig = fw.rig(fw.default_face(), shapes="browInnerUp+jawOpen", level=1)
    >>> rig
    Rig(2 shapes, ...)
    >>> rig.names, rig.deltas.shape == (2, *rig.mesh.points.shape)
    (('browInnerUp', 'jawOpen'), True)
    """

    face: Face
    names: tuple[str, ...]
    parts: Mapping[str, Model]
    morphs: Mapping[str, Morphs]
    left_out: Mapping[str, str]
    drivers: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    wrinkles: Wrinkling = "baked"
    _shapes: Mapping[str, Shape] = field(repr=False, default_factory=dict)
    _posing: Posing | None = field(repr=False, default=None)
    _baker: Baker | None = field(repr=False, default=None)

    def __repr__(self) -> str:
        return f"Rig({len(self.names)} shapes, {len(self.parts)} meshes, {len(self.parts['face'].points)} vertices)"

    @property
    def shapes(self) -> Mapping[str, Shape]:
        """Contractions and movements of the shapes, by name; without those that others drive."""
        return self._shapes

    @property
    def posing(self) -> Posing:
        """The simulation that brings the face into the poses of shapes.

        Raises
        ------
        ParameterError
            If the rig was not made by :func:`facewrinkle.rig`.
        """
        if self._posing is None:
            raise ParameterError("this rig has no simulation to compare with: it was not made by facewrinkle.rig.")
        return self._posing

    @property
    def mesh(self) -> pv.PolyData:
        """The skin at rest; the vertices of the face come first, in their order."""
        return self.at({})

    @property
    def deltas(self) -> Single:
        """Displacements (k, n, 3) of the skin in each shape, in the unit of the face."""
        return self.morphs["face"].deltas

    @property
    def normals(self) -> Single:
        """Changes (k, n, 3) of the unit normals of the skin in each shape."""
        return self.morphs["face"].normals

    def _weights(self, weights: Mapping[str, float]) -> Array:
        """Weights (k,), clamped to [0, 1] with a warning."""
        out = np.zeros(len(self.names))
        for name, weight in weights.items():
            if name not in self.names:
                raise unknown_name("shape", name, self.names)
            out[self.names.index(name)] = check_range(f"the weight of {name}", weight, -1e6, 1e6)
        if (out < 0.0).any() or (out > 1.0).any():
            warn("weights outside [0, 1] are clamped: a shape is made for weights from 0 to 1.")
        return np.clip(out, 0.0, 1.0)

    def driven(self, weights: Mapping[str, float]) -> dict[str, float]:
        """Return weights together with those of the targets that they drive; see `drivers`.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> rig = fw.rig(fw.default_face(), "browInnerUp", "separate", level=1)
        >>> rig.driven({"browInnerUp": 0.5})
        {'browInnerUp': 0.5, 'browInnerUp_wrinkle': 0.25}
        """
        products = {
            target: float(np.prod([weights.get(name, 0.0) for name in names])) for target, names in self.drivers.items()
        }
        return dict(weights) | {name: weight for name, weight in products.items() if weight and name not in weights}

    def at(self, weights: Mapping[str, float], part: str = "face") -> pv.PolyData:
        """Return a mesh of the rig with its shapes at weights, as any program shows it.

        Parameters
        ----------
        weights : mapping of str to float
            By shape, in [0, 1]; shapes that are not named have weight 0.
        part : str
            Name of the mesh.

        Returns
        -------
        PolyData
            With "Normals", and the colours or texture coordinates of the part.

        Raises
        ------
        UnknownNameError
            For a shape or part that the rig does not have.

        Warns
        -----
        FaceWrinkleWarning
            For weights outside [0, 1], which are clamped.
        """
        if part not in self.parts:
            raise unknown_name("part", part, self.parts)
        model, morphs, mixed = self.parts[part], self.morphs[part], self._weights(weights)
        points, normals = model.points.copy(), model.normals.copy()
        for k in np.flatnonzero(mixed):
            points += mixed[k] * morphs.deltas[k]
            normals += mixed[k] * morphs.normals[k]
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        data: dict[str, np.ndarray] = {"Normals": normals}
        if model.colours is not None:
            data["Colors"] = model.colours
        mesh = to_polydata(points, model.triangles, data)
        if model.uv is not None:
            mesh.active_texture_coordinates = model.uv
        mesh.point_data.active_normals_name = "Normals"
        return mesh

    def error(self, weights: Mapping[str, float]) -> RigError:
        """Return how far the rig is from the simulation of the same mixture, which is not linear.

        Wrinkles and correctives that the weights drive are part of the rig.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> rig = fw.rig(fw.default_face(), shapes="browInnerUp", level=1)
        >>> found = rig.error({"browInnerUp": 0.5})
        >>> found.mean < 0.2 * found.motion
        True
        """
        mixed = self._weights(weights)
        asked = {self.names[k]: float(mixed[k]) for k in np.flatnonzero(mixed)}
        pose = self.posing.at({name: (self._shapes[name], weight) for name, weight in asked.items()})
        unit, rest = self.face.unit, self.parts["face"].points
        assert self._baker is not None
        truth = (self._baker.placed(pose, parts=False)["face"].points - rest) * unit
        ours = (np.asarray(self.at(self.driven(asked)).points) - rest) * unit
        way = np.linalg.norm(truth, axis=1)
        moved = np.maximum(way, np.linalg.norm(ours, axis=1)) > CUT
        if not moved.any():
            return RigError(0.0, 0.0, 0.0)
        off = np.linalg.norm(ours - truth, axis=1)[moved]
        return RigError(float(off.mean()), float(off.max()), float(way[moved].mean()))

    @property
    def mixtures(self) -> list[Mapping[str, float]]:
        """Weights of which :attr:`report` tells the error: each shape, half and full, and common mixtures.

        Shapes of a pair are taken together, as they were made, and that of the left also alone.
        """
        shapes = [name for name in self.names if name in self._shapes and not self._shapes[name].beyond]
        asked: list[Mapping[str, float]] = []
        for name in shapes:
            other = f"{name.removesuffix('Left')}Right"
            if name.endswith("Left") and other in shapes and self._shapes[name].side:
                asked += [{name: 0.5, other: 0.5}, {name: 1.0, other: 1.0}, {name: 1.0}]
            elif not (self._shapes[name].side and f"{name.removesuffix('Right')}Left" in shapes):
                asked += [{name: weight} for weight in (0.5, 1.0)]
        mixed = [mixture for mixture in MIXTURES if set(mixture) <= set(self.names)]
        corrected: dict[tuple[str, ...], dict[str, None]] = {}  # pairs of both sides together, as they were simulated
        for names in self.drivers.values():
            if len(set(names)) > 1:
                both = tuple(self._of_both_sides(name) for name in names)
                corrected.setdefault(both, {}).update(dict.fromkeys(names))
        pairs = [dict.fromkeys(names, weight) for names in corrected.values() for weight in (0.5, 1.0)]
        return list({frozenset(mixture.items()): mixture for mixture in [*asked, *mixed, *pairs]}.values())

    def _of_both_sides(self, name: str) -> str:
        """Return the common name of the shapes of a pair; jawLeft and jawRight, which have no sides, are no pair."""
        return name.removesuffix("Left").removesuffix("Right") if self._shapes[name].side else name

    @cached_property
    def report(self) -> list[tuple[Mapping[str, float], RigError]]:
        """Errors of each shape and pair at half and at full weight, and of common mixtures, with what was mixed."""
        return [(weights, self.error(weights)) for weights in self.mixtures]


def report_text(rig: Rig) -> str:
    """Return the errors of a rig as JSON: of each shape and common mixture, in mm, with the mean way of the skin."""
    errors = [
        {
            "weights": dict(weights),
            "mean_mm": round(found.mean, 4),
            "largest_mm": round(found.largest, 4),
            "motion_mm": round(found.motion, 4),
        }
        for weights, found in rig.report
    ]
    return facts_text(rig, errors=errors)


def facts_text(rig: Rig, **more: object) -> str:
    """Return as JSON which targets a rig has, which were left out, and which are driven by the product of others."""
    drivers = {target: list(names) for target, names in rig.drivers.items()}
    content = {"shapes": list(rig.names), "left_out": dict(rig.left_out), "drivers": drivers} | more
    return json.dumps(content, indent=1) + "\n"


def label(weights: Mapping[str, float]) -> str:
    """Return a mixture as text.

    Examples
    --------
    >>> label({"jawOpen": 0.5, "mouthFunnel": 1.0})
    'jawOpen=0.5, mouthFunnel'
    """
    return ", ".join(name if weight == 1.0 else f"{name}={weight:g}" for name, weight in weights.items())


@checked
def rig(
    face: Face,
    shapes: str = "arkit",
    wrinkles: Wrinkling = "baked",
    level: int | None = None,
    correctives: int = 0,
    *,
    progress: Progress = silent,
) -> Rig:
    """Make the blend shapes of a face, for other programs; they wrinkle.

    Parameters
    ----------
    face : Face
        With landmarks: :func:`facewrinkle.default_face` or :func:`facewrinkle.fit_face`.
    shapes : str
        Sets joined by +: "arkit" (Apple's 52 names), "visemes" (15), "extras" (what web avatars ask for besides), "aus"
        (the action units of the face's atlas); or names of single shapes.
    wrinkles : {"baked", "separate", "maps", "none"}
        In the shapes themselves; as targets of their own, called NAME_wrinkle, which are to be driven by the square of
        the weight; in maps (:func:`facewrinkle.bake_layers`), for which the rig is smooth, on the mesh as it is, and
        has texture coordinates; or none.
    level : int, optional
        How often a triangle may be split where any shape folds; 0 keeps the mesh as it is. Default: 2; with maps 0,
        and no other is allowed.
    correctives : int
        At most so many pairs of shapes whose sum is off get a corrective, the worst first: targets of their own, called
        jawOpen_mouthSmileLeft, which are to be driven by the product of the two weights. All pairs that meet are
        simulated, which takes minutes.
    progress : callable, optional
        Called with an iterable, what is being done, and the number of items; yields the items.

    Returns
    -------
    Rig

    Raises
    ------
    UnknownNameError
        For a set or shape that does not exist.
    ParameterError
        If the face can make none of the shapes, for a level out of range, or for one beside maps.

    Warns
    -----
    FaceWrinkleWarning
        For shapes that the face cannot make, other than `tongueOut`; see `left_out` of the rig.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> made = rig(fw.default_face(), shapes="mouthSmileLeft+mouthSmileRight", wrinkles="none", level=0)
    >>> moved = made.at({"mouthSmileLeft": 1.0}).points - made.mesh.points
    >>> sideways = made.mesh.points[:, 0]
    >>> bool(np.linalg.norm(moved[sideways > 10.0], axis=1).max() > 8.0), bool(moved[sideways < -10.0].any())
    (True, False)
    """
    level = (0 if wrinkles == "maps" else LEVEL) if level is None else level
    level = check_whole("level", level, 0, FINEST, "Each level has up to four times as many triangles.")
    correctives = check_whole("correctives", correctives, 0, MOST_PAIRS, "They are pairs of shapes.")
    if wrinkles not in WRINKLING:
        raise unknown_name("kind of wrinkles", wrinkles, WRINKLING)
    if wrinkles == "maps":
        if level:
            raise ParameterError(
                f"wrinkles in maps are for the mesh as it is, received level {level}: leave level out, or ask for "
                "other wrinkles."
            )
        check_texture(face)
    wanted, left_out = shapes_of(shapes, face)
    lacking = [name for name in left_out if name != "tongueOut"]
    if lacking:
        reasons = "; ".join(dict.fromkeys(left_out[name] for name in lacking))
        warn(f"{len(lacking)} shapes are left out ({reasons}): {', '.join(lacking)}.")
    posing = Posing(face)
    poses = movement_poses(wanted, posing)
    neutral = posing.neutral()
    baker = Baker(face, [] if wrinkles in ("none", "maps") else None, level)
    wrinkled = baker
    baker.refine(list(poses.values()), neutral, progress)
    fields = _fields(wanted, poses, neutral, baker, progress)
    names, drivers = list(wanted), dict[str, tuple[str, ...]]()
    if wrinkles == "separate":
        bare = Baker(face, [], level)
        bare.follow(baker)
        smooth = _fields(wanted, poses, neutral, bare, progress)
        fields, names = _separated(fields, smooth, names)
        drivers = {name: (stem, stem) for name in names[len(wanted) :] for stem in (name.removesuffix("_wrinkle"),)}
        baker = bare
    if correctives:
        pairs = worst_pairs(wanted, poses, posing, correctives, progress)
        own = {f"{a}_{b}": (a, b) for pair in pairs for a, b, _ in pair.targets}
        more = _corrections(pairs, poses, neutral, baker, progress)
        fields = {p: _joined(both, more[p]) for p, both in fields.items()}
        names, drivers = [*names, *own], drivers | own
    cuts = {part: (HAIR_CUT if part.split("_")[0] in HAIRY else CUT) / face.unit for part in fields}
    morphs = {
        part: Morphs(names, *_faded(deltas, _kept(part, normals), baker.models[part].triangles, cuts[part]), drivers)
        for part, (deltas, normals) in fields.items()
    }
    parts = baker.models
    if wrinkles == "maps" and parts["face"].uv is None:
        parts = parts | {"face": replace(parts["face"], uv=around_head(face, parts["face"].points))}
    return Rig(face, tuple(names), parts, morphs, left_out, drivers, wrinkles, wanted, posing, wrinkled)


def movement_poses(shapes: Mapping[str, Shape], posing: Posing) -> dict[tuple[object, ...], Pose]:
    """Return the poses that shapes are made of, by their movements: both sides of a pair are one, moved together."""
    found: dict[tuple[object, ...], Pose] = {}
    for shape in [*shapes.values(), *(ARKIT[shape.beyond] for shape in shapes.values() if shape.beyond)]:
        if shape.movement not in found:
            found[shape.movement] = posing.at({"both": (replace(shape, side=None), 1.0)})
    return found


Fields = dict[str, tuple[Single, Single]]
"""Changes (k, n, 3) of points and of normals in all shapes, by part."""


def _fields(
    shapes: Mapping[str, Shape],
    poses: Mapping[tuple[object, ...], Pose],
    neutral: Pose,
    baker: Baker,
    progress: Progress,
) -> Fields:
    """Return what shapes change."""
    users: dict[tuple[object, ...], list[tuple[int, Shape, float]]] = {}
    for k, shape in enumerate(shapes.values()):
        users.setdefault(shape.movement, []).append((k, shape, 1.0))
        if shape.beyond:
            users.setdefault(ARKIT[shape.beyond].movement, []).append((k, shape, -1.0))
    rest = baker.placed(neutral)
    fields: Fields = {}
    for part, at_rest in rest.items():
        shape_of = (len(shapes), *at_rest.points.shape)
        fields[part] = np.zeros(shape_of, np.float32), np.zeros(shape_of, np.float32)
    sides: dict[str, dict[Side | None, Array]] = {
        part: {side: share_of_side(baker.face, at_rest.points, side) for side in ("l", "r", None)}
        for part, at_rest in rest.items()
    }
    movements = dict(zip(map(id, poses.values()), poses, strict=True))
    for pose in progress(list(poses.values()), "Shapes", len(poses)):
        for part, now in baker.placed(pose).items():
            moved, turned = now.points - rest[part].points, _change(now, rest[part])
            for k, shape, sign in users[movements[id(pose)]]:
                share = sign * sides[part][shape.side]
                fields[part][0][k] += share * moved
                fields[part][1][k] += share * turned
    return fields


def _corrections(
    pairs: list[Pair], poses: Mapping[tuple[object, ...], Pose], neutral: Pose, baker: Baker, progress: Progress
) -> Fields:
    """Return what the correctives of pairs change."""
    rest = baker.placed(neutral)
    count = sum(len(pair.targets) for pair in pairs)
    fields: Fields = {
        part: (np.zeros((count, *at.points.shape), np.float32), np.zeros((count, *at.points.shape), np.float32))
        for part, at in rest.items()
    }
    k, parts = 0, {id(pair.pose): pair for pair in pairs}
    for pose in progress([pair.pose for pair in pairs], "Correctives", len(pairs)):
        pair = parts[id(pose)]
        now, one, other = (baker.placed(each) for each in (pose, poses[pair.first], poses[pair.second]))
        for part, at in rest.items():
            moved = now[part].points - one[part].points - other[part].points + at.points
            turned = now[part].normals - one[part].normals - other[part].normals + at.normals
            for row, (_, _, side) in enumerate(pair.targets, start=k):
                share = share_of_side(baker.face, at.points, side)
                fields[part][0][row], fields[part][1][row] = share * moved, share * turned
        k += len(pair.targets)
    return fields


def _joined(first: tuple[Single, Single], second: tuple[Single, Single]) -> tuple[Single, Single]:
    """Return two lots of shapes as one."""
    return np.concatenate([first[0], second[0]]), np.concatenate([first[1], second[1]])


def _change(now: Placed, rest: Placed) -> Array:
    return np.asarray(now.normals - rest.normals)


def _separated(fields: Fields, smooth: Fields, names: list[str]) -> tuple[Fields, list[str]]:
    """Return smooth shapes, followed by the wrinkles of those that have some, and all names."""
    pairs = zip(fields["face"][0], smooth["face"][0], strict=True)
    folding = np.flatnonzero([bool((with_folds != without).any()) for with_folds, without in pairs])
    out = {}
    for part, both in fields.items():
        bare = smooth[part]
        out[part] = tuple(np.concatenate([b, (a - b)[folding]]) for a, b in zip(both, bare, strict=True))
    return out, [*names, *(f"{names[k]}_wrinkle" for k in folding)]  # type: ignore[return-value]


def _kept(part: str, normals: Single) -> Single:
    """Return the changes of normals (k, n, 3) that can be seen; the others are 0."""
    if part.split("_")[0] in HAIRY:
        return np.zeros_like(normals)
    return np.where((normals**2).sum(axis=2, keepdims=True) > TURN**2, normals, np.float32(0.0))


def _faded(deltas: Single, normals: Single, triangles: npt.NDArray[np.int64], cut: float) -> tuple[Single, Single]:
    """Return shapes (k, n, 3) that end where skin hardly moves: ways fade from twice `cut` to nothing at `cut`."""
    edges, _ = unique_edges(triangles)
    first, second = edges[:, 0], edges[:, 1]
    for moved, turned in zip(deltas, normals, strict=True):
        way = np.linalg.norm(moved, axis=1)
        for _ in range(RINGS):
            wider = way.copy()
            np.maximum.at(wider, first, way[second])
            np.maximum.at(wider, second, way[first])
            way = wider
        share = smoothstep(way / cut - 1.0).astype(np.float32)[:, None]
        moved *= share
        turned *= share
    return deltas, normals
