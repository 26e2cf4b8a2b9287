"""Rigs: the blend shapes of a face, on one mesh that is fine enough for the wrinkles of all of them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal, get_args

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..array_types import Array, Single
from ..errors import ParameterError, check_name, check_range, check_type, check_whole, warn
from ..export.model import Model, Morphs
from ..geometry import unit
from ..mesh import to_polydata
from ..progress import Progress, bar
from .fields import (
    CUT,
    Baker,
    corrective_fields,
    morphs_of,
    movement_poses,
    separated,
    shape_fields,
    worst_pairs,
)
from .maps import around_head, check_texture
from .poses import Pose, Posing
from .shapes import Shape, shapes_of

Wrinkling = Literal["baked", "separate", "maps", "none"]


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
        Targets that are no shapes of their own, and the two shapes whose weights are multiplied to theirs: a shape with
        itself for its wrinkles, or those that a corrective mends.
    wrinkles : str
        As in :func:`facewrinkle.rig`.
    shapes : dict of str to Shape
        Contractions and movements of the shapes, by name; without those that others drive.
    posing : Posing
        The simulation that brings the face into the poses of shapes.
    poses : dict of tuple to Pose
        Of all shapes, by their movements; see :attr:`facewrinkle.rigging.shapes.Shape.movement`.
    baker : Baker
        Places the mesh in these poses, with wrinkles if the rig has any.

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
    drivers: Mapping[str, tuple[str, ...]]
    wrinkles: Wrinkling
    shapes: Mapping[str, Shape] = field(repr=False)
    posing: Posing = field(repr=False)
    poses: Mapping[tuple[object, ...], Pose] = field(repr=False)
    baker: Baker = field(repr=False)

    def __repr__(self) -> str:
        return f"Rig({len(self.names)} shapes, {len(self.parts)} meshes, {len(self.parts['face'].points)} vertices)"

    @property
    def mesh(self) -> pv.PolyData:
        """The skin at rest; the vertices of the face come first, in their order."""
        return self.at({})

    @property
    def deltas(self) -> Single:
        """Displacements (k, n, 3) of the skin in each shape, in the unit of the face."""
        return self.morphs["face"].deltas

    def _weights(self, weights: Mapping[str, float]) -> Array:
        """Weights (k,), clamped to [0, 1] with a warning."""
        out = np.zeros(len(self.names))
        for name, weight in weights.items():
            check_name("shape", name, self.names)
            out[self.names.index(name)] = check_range(f"the weight of {name}", weight, -1e6, 1e6)
        if (out < 0.0).any() or (out > 1.0).any():
            warn("weights outside [0, 1] are clamped: a shape is made for weights from 0 to 1.")
        return np.clip(out, 0.0, 1.0)

    def driven(self, weights: Mapping[str, float]) -> dict[str, float]:
        """Return weights together with those of the targets that they drive; see `drivers`.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> rig = fw.rig(fw.default_face(), "browInnerUp", wrinkles="separate", level=1)
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
            With "Normals", and the colors or texture coordinates of the part.

        Raises
        ------
        UnknownNameError
            For a shape or part that the rig does not have.

        Warns
        -----
        FaceWrinkleWarning
            For weights outside [0, 1], which are clamped.
        """
        check_name("part", part, self.parts)
        model, morphs, mixed = self.parts[part], self.morphs[part], self._weights(weights)
        points, normals = model.points.copy(), model.normals.copy()
        for k in np.flatnonzero(mixed):
            points += mixed[k] * morphs.deltas[k]
            normals += mixed[k] * morphs.normals[k]
        data: dict[str, np.ndarray] = {"Normals": unit(normals)}
        if model.colors is not None:
            data["Colors"] = model.colors
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
        pose = self.posing.at({name: (self.shapes[name], weight) for name, weight in asked.items()})
        unit, rest = self.face.unit, self.parts["face"].points
        truth = (self.baker.placed(pose, parts=False)["face"][:, :3] - rest) * unit
        ours = (np.asarray(self.at(self.driven(asked)).points) - rest) * unit
        way = np.linalg.norm(truth, axis=1)
        moved = np.maximum(way, np.linalg.norm(ours, axis=1)) > CUT
        if not moved.any():
            return RigError(0.0, 0.0, 0.0)
        off = np.linalg.norm(ours - truth, axis=1)[moved]
        return RigError(float(off.mean()), float(off.max()), float(way[moved].mean()))

    @property
    def mixtures(self) -> list[Mapping[str, float]]:
        """Weights of which :attr:`report` tells the error: each shape, and each pair with a corrective, half and full.

        Shapes of the two sides are taken together, as they were made.
        """
        alone = [(name,) for name, shape in self.shapes.items() if not shape.beyond]
        pairs = [names for names in self.drivers.values() if len(set(names)) > 1]
        together: dict[tuple[object, ...], dict[str, None]] = {}  # those of both sides, as they were simulated
        for names in [*alone, *pairs]:
            # jawLeft and jawRight, which have no sides, are no pair.
            both = tuple(self.shapes[name].movement if self.shapes[name].side else name for name in names)
            together.setdefault(both, {}).update(dict.fromkeys(names))
        return [dict.fromkeys(names, weight) for names in together.values() for weight in (0.5, 1.0)]

    @cached_property
    def report(self) -> list[tuple[Mapping[str, float], RigError]]:
        """Errors of each shape and pair at half and at full weight, with what was mixed."""
        return [(weights, self.error(weights)) for weights in self.mixtures]


def facts_text(rig: Rig, errors: bool = False) -> str:
    """Return as JSON which targets a rig has, which were left out, and which are driven by the product of others.

    With `errors`, also those of each shape and pair, in mm, with the mean way of the skin.
    """
    drivers = {target: list(names) for target, names in rig.drivers.items()}
    content: dict[str, object] = {"shapes": list(rig.names), "left_out": dict(rig.left_out), "drivers": drivers}
    if errors:
        content["errors"] = [
            {
                "weights": dict(weights),
                "mean_mm": round(found.mean, 4),
                "largest_mm": round(found.largest, 4),
                "motion_mm": round(found.motion, 4),
            }
            for weights, found in rig.report
        ]
    return json.dumps(content, indent=1) + "\n"


def label(weights: Mapping[str, float]) -> str:
    """Return a mixture as text.

    Examples
    --------
    >>> label({"jawOpen": 0.5, "mouthFunnel": 1.0})
    'jawOpen=0.5, mouthFunnel'
    """
    return ", ".join(name if weight == 1.0 else f"{name}={weight:g}" for name, weight in weights.items())


def rig(
    face: Face,
    shapes: str = "arkit",
    *,
    wrinkles: Wrinkling = "baked",
    level: int | None = None,
    correctives: int = 0,
    progress: Progress | None = None,
) -> Rig:
    """Make the blend shapes of a face, for other programs; they wrinkle.

    Parameters
    ----------
    face : Face
        With landmarks: :func:`facewrinkle.default_face` or :func:`facewrinkle.fit_face`.
    shapes : str
        Sets joined by +: "arkit" (Apple's 52 names), "visemes" (15), "extras" (what web avatars ask for besides), "aus"
        and "expressions" (the action units and expressions of the face's atlas), "age" (lines of old skin at rest); or
        names of single shapes.
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
        Called with an iterable, what is being done, and the number of items; yields the items. Default: a bar on stderr
        where that is a terminal.

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
        For shapes that the face cannot make; see `left_out` of the rig.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> made = rig(fw.default_face(), shapes="mouthSmileLeft+mouthSmileRight", wrinkles="none", level=0)
    >>> moved = made.at({"mouthSmileLeft": 1.0}).points - made.mesh.points
    >>> sideways = made.mesh.points[:, 0]
    >>> bool(np.linalg.norm(moved[sideways > 10.0], axis=1).max() > 8.0), bool(moved[sideways < -10.0].any())
    (True, False)
    """
    check_type("face", face, Face)
    level = (0 if wrinkles == "maps" else 2) if level is None else level
    level = check_whole("level", level, 0, 5, "Each level has up to four times as many triangles.")
    correctives = check_whole("correctives", correctives, 0, 200, "They are pairs of shapes.")
    check_name("kind of wrinkles", wrinkles, get_args(Wrinkling))
    if wrinkles == "maps":
        if level:
            raise ParameterError(
                f"wrinkles in maps are for the mesh as it is, received level {level}: leave level out, or ask for "
                "other wrinkles."
            )
        check_texture(face)
    wanted, left_out = shapes_of(shapes, face)
    if left_out:
        reasons = "; ".join(dict.fromkeys(left_out.values()))
        warn(f"{len(left_out)} shapes are left out ({reasons}): {', '.join(left_out)}.")
    posing, progress = Posing(face), progress or bar
    poses = movement_poses(wanted, posing)
    neutral = posing.neutral()
    baker = Baker(face, [] if wrinkles in ("none", "maps") else None, level)
    baker.refine(list(poses.values()), neutral, progress)
    fields = shape_fields(wanted, poses, neutral, baker, progress)
    names, drivers, bare = list(wanted), dict[str, tuple[str, ...]](), baker
    if wrinkles == "separate":
        bare = Baker(face, [], level)
        bare.follow(baker)
        smooth = shape_fields(wanted, poses, neutral, bare, progress)
        fields, drivers = separated(fields, smooth, names)
    if correctives:
        pairs = worst_pairs(wanted, poses, posing, correctives, progress)
        drivers |= {f"{a}_{b}": (a, b) for pair in pairs for a, b, _ in pair.targets}
        more = corrective_fields(pairs, poses, neutral, bare, progress)
        fields = {part: np.concatenate([each, more[part]]) for part, each in fields.items()}
    names += drivers
    morphs = morphs_of(fields, names, drivers, bare)
    parts = baker.models
    if wrinkles == "maps" and parts["face"].uv is None:
        parts = parts | {"face": replace(parts["face"], uv=around_head(face, parts["face"].points))}
    return Rig(face, tuple(names), parts, morphs, left_out, drivers, wrinkles, wanted, posing, poses, baker)
