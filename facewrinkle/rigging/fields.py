"""From poses to arrays: one mesh that is fine enough for all, and what each shape changes of its points and normals.

A rig adds displacements, and skin does not: lips that are pursed and open are not pursed lips plus open lips. A
corrective shape is the difference of a pair, to be driven by the product of the two weights.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy.face import Face
from ..appearance.seen import companion_meshes
from ..array_types import Array, Single
from ..export.animation import rest_models
from ..export.model import Model, Morphs, is_hair, part_model
from ..geometry import smoothstep, unique_edges
from ..layers.base import Layer
from ..progress import Progress
from ..simulation import Refinement, Simulation
from ..simulation.fold_layers import fold_layers
from .poses import Held, Pose, Posing, share_of_side
from .shapes import ARKIT, Shape, Side

Movement = tuple[object, ...]
"""What both sides do in a shape; see :attr:`facewrinkle.rigging.shapes.Shape.movement`."""


class Baker:
    """Places the skin and all parts of a face in poses, always with the same triangles.

    Parameters
    ----------
    face : Face
    layers : sequence of Layer, optional
        Default: the folds of a :class:`facewrinkle.Simulation`.
    level : int
        How often a triangle may be split.

    Attributes
    ----------
    models : dict of str to Model
        The meshes at rest, "face" first; filled by :meth:`refine`.
    """

    def __init__(self, face: Face, layers: list[Layer] | None, level: int) -> None:
        self.face, self._level, self._motion, self._age = face, level, Held(face), 0.0
        coarser = Refinement(gamma_c=0.1, max_level=level, samples=2.75, coarsen=False)  # than for pictures: it is sent
        self.simulation = Simulation(face, coarser, layers=layers, motion=self._motion)
        self.models: dict[str, Model] = {}

    def refine(self, poses: list[Pose], neutral: Pose, progress: Progress) -> None:
        """Split all triangles that any of the poses needs, and make the models of the face at rest."""
        for _ in range(4 if self._level else 0):  # after four rounds, few triangles are lacking
            before = self.simulation.forest.n_points
            for pose in progress(poses, "Refining", len(poses)):
                self._grown(pose)
            if self.simulation.forest.n_points == before:
                break
        self.models = rest_models(self.face, self.frame(neutral))

    def follow(self, other: Baker) -> None:
        """Take over the triangles and models of another baker of the same face."""
        self.simulation.take_triangles(other.simulation)
        self.models = other.models

    def _grown(self, pose: Pose) -> None:
        count = -1
        while self.simulation.forest.n_points != count:
            count = self.simulation.forest.n_points
            self.frame(pose)

    def frame(self, pose: Pose) -> pv.PolyData:
        """Return the skin in a pose, with its fields."""
        if pose.age != self._age and self.simulation.layers:
            self.simulation.use_layers(fold_layers(self.face, "wave", age=pose.age or None))
            self._age = pose.age
        self._motion.hold(pose)
        return self.simulation.step()

    def placed(self, pose: Pose, parts: bool = True) -> dict[str, Array]:
        """Return points and normals (n, 6) of all meshes in a pose, side by side, in the unit of the face."""
        frame = self.frame(pose)
        found = {"face": np.hstack([frame.points, frame.point_data["Normals"]])[self.models["face"].origin]}
        for name, mesh in companion_meshes(self.face, frame, always=True).items() if parts else ():
            model = part_model(mesh)
            found[name] = np.hstack([model.points, model.normals])
        return found


CUT = 0.1
"""Way in mm below which a vertex is left out of a shape; ways up to twice as long fade, lest the skin have a step.

Skin that moves by more counts for the error of a pair of shapes; smaller errors on average are not corrected.
"""


def movement_poses(shapes: Mapping[str, Shape], posing: Posing) -> dict[Movement, Pose]:
    """Return the poses that shapes are made of, by their movements: both sides of a pair are one, moved together."""
    every = [*shapes.values(), *(ARKIT[shape.beyond] for shape in shapes.values() if shape.beyond)]
    both = {shape.movement: replace(shape, side=None) for shape in every}
    return {movement: posing.at({"both": (shape, 1.0)}) for movement, shape in both.items()}


Fields = dict[str, Single]
"""Changes (k, n, 6) of points and normals, side by side, in all shapes, by part."""


def shape_fields(
    shapes: Mapping[str, Shape],
    poses: Mapping[Movement, Pose],
    neutral: Pose,
    baker: Baker,
    progress: Progress,
) -> Fields:
    """Return what shapes change."""
    users: dict[Movement, list[tuple[int, Shape, float]]] = {}
    for k, shape in enumerate(shapes.values()):
        users.setdefault(shape.movement, []).append((k, shape, 1.0))
        if shape.beyond:
            users.setdefault(ARKIT[shape.beyond].movement, []).append((k, shape, -1.0))
    rest = baker.placed(neutral)
    fields: Fields = {part: np.zeros((len(shapes), *at.shape), np.float32) for part, at in rest.items()}
    sides: dict[str, dict[Side | None, Array]] = {
        part: {side: share_of_side(baker.face, at_rest[:, :3], side) for side in ("l", "r", None)}
        for part, at_rest in rest.items()
    }
    for movement, pose in progress(list(poses.items()), "Shapes", len(poses)):
        for part, now in baker.placed(pose).items():
            for k, shape, sign in users[movement]:
                fields[part][k] += sign * sides[part][shape.side] * (now - rest[part])
    return fields


@dataclass(frozen=True, eq=False)
class Pair:
    """Two movements that do not add up.

    Attributes
    ----------
    first, second : tuple
        The movements, of both sides where they have sides.
    targets : tuple of tuple of str, str and side
        Names of the shapes that have these movements, by the side that they share, or None.
    pose : Pose
        Both at full strength.
    error : float
        Mean distance of their sum from that pose, over the vertices that either moves, mm.
    """

    first: Movement
    second: Movement
    targets: tuple[tuple[str, str, Side | None], ...]
    pose: Pose
    error: float


def worst_pairs(
    shapes: Mapping[str, Shape], poses: Mapping[Movement, Pose], posing: Posing, count: int, progress: Progress
) -> list[Pair]:
    """Return the pairs of shapes whose sum is farthest from what the muscles do together, the worst first.

    Parameters
    ----------
    shapes : mapping of str to Shape
    poses : mapping of tuple to Pose
        Of all their movements, alone and of both sides.
    posing : Posing
    count : int
        At most so many pairs.
    progress : callable
        As in :func:`facewrinkle.rig`.

    Examples
    --------
    Lips that are pursed to a funnel and puckered:

    >>> import facewrinkle as fw
    >>> posing, units = Posing(fw.default_face()), {"mouthFunnel": "AU22", "mouthPucker": "AU18", "browInnerUp": "AU1"}
    >>> shapes = {name: Shape({unit: 1.0}) for name, unit in units.items()}
    >>> poses = {shape.movement: posing.at({"": (shape, 1.0)}) for shape in shapes.values()}
    >>> (pair,) = worst_pairs(shapes, poses, posing, 8, lambda pairs, what, total: iter(pairs))
    >>> pair.targets, pair.error > 1.0
    ((('mouthFunnel', 'mouthPucker', None),), True)
    """
    names: dict[Movement, list[str]] = {}
    for name, shape in shapes.items():
        if not shape.beyond and shape.movement != Shape().movement:
            names.setdefault(shape.movement, []).append(name)
    moved = {movement: poses[movement].base - posing.rest for movement in names}
    way = {movement: np.linalg.norm(each, axis=1) for movement, each in moved.items()}
    pairs = [  # shapes can only disturb each other if both move more than five vertices by more than half a mm
        (one, other)
        for one, other in combinations(names, 2)
        if (np.minimum(way[one], way[other]) > 0.5).sum() > 5 and _targets(shapes, names[one], names[other])
    ]
    found = []
    for one, other in progress(pairs, "Comparing pairs", len(pairs)):
        both = {str(k): (replace(shapes[names[m][0]], side=None), 1.0) for k, m in enumerate((one, other))}
        pose = posing.at(both)
        off = np.linalg.norm(pose.base - posing.rest - moved[one] - moved[other], axis=1)
        error = float(off[np.maximum(way[one], way[other]) > CUT].mean())
        if error > CUT:
            found.append(Pair(one, other, _targets(shapes, names[one], names[other]), pose, error))
    return sorted(found, key=lambda pair: -pair.error)[:count]


def _targets(
    shapes: Mapping[str, Shape], first: list[str], second: list[str]
) -> tuple[tuple[str, str, Side | None], ...]:
    """Return the pairs of shapes of two movements that act on the same side, and that side."""
    return tuple(
        (a, b, shapes[a].side or shapes[b].side)
        for a in first
        for b in second
        if shapes[a].side is None or shapes[b].side is None or shapes[a].side == shapes[b].side
    )


def corrective_fields(
    pairs: list[Pair], poses: Mapping[Movement, Pose], neutral: Pose, baker: Baker, progress: Progress
) -> Fields:
    """Return what the correctives of pairs change."""
    rest = baker.placed(neutral)
    lacks: dict[str, list[Array]] = {part: [] for part in rest}
    for pair in progress(pairs, "Correctives", len(pairs)):
        now, one, other = (baker.placed(each) for each in (pair.pose, poses[pair.first], poses[pair.second]))
        for part, at in rest.items():
            lack = now[part] - one[part] - other[part] + at
            lacks[part] += [share_of_side(baker.face, at[:, :3], side) * lack for _, _, side in pair.targets]
    return {part: np.array(own, np.float32).reshape(-1, *rest[part].shape) for part, own in lacks.items()}


def separated(fields: Fields, smooth: Fields, names: list[str]) -> tuple[Fields, dict[str, tuple[str, ...]]]:
    """Return smooth shapes, followed by the wrinkles of those that have some, and the drivers of these by name."""
    folding = np.flatnonzero((fields["face"][..., :3] != smooth["face"][..., :3]).any(axis=(1, 2)))
    out = {part: np.concatenate([smooth[part], (own - smooth[part])[folding]]) for part, own in fields.items()}
    return out, {f"{names[k]}_wrinkle": (names[k], names[k]) for k in folding}


def morphs_of(
    fields: Fields, names: list[str], drivers: Mapping[str, tuple[str, ...]], baker: Baker
) -> dict[str, Morphs]:
    """Return morph targets that end where nothing moves."""
    out = {}
    for part, own in fields.items():
        cut = (2.0 if is_hair(part) else 1.0) * CUT / baker.face.unit  # hairs are many, on skin that hardly moves then
        out[part] = Morphs(names, *faded(*_shown(part, own), baker.models[part].triangles, cut), drivers)
    return out


def _shown(part: str, both: Single) -> tuple[Single, Single]:
    """Return changes (k, n, 3) of points, and those of normals that can be seen; the others are 0.

    Normals that turn by less than 0.03 radians stay, and those of hairs: how a hair shines does not tell how it lies.
    """
    moved, turned = np.ascontiguousarray(both[..., :3]), np.ascontiguousarray(both[..., 3:])
    seen = (turned**2).sum(axis=2, keepdims=True) > 0.03**2
    return moved, np.where(seen & (not is_hair(part)), turned, np.float32(0.0))


def faded(deltas: Single, normals: Single, triangles: npt.NDArray[np.int64], cut: float) -> tuple[Single, Single]:
    """Return shapes (k, n, 3) that end where skin hardly moves: ways fade from twice `cut` to nothing at `cut`.

    They are changed in place.
    """
    edges, _ = unique_edges(triangles)
    first, second = edges[:, 0], edges[:, 1]
    for moved, turned in zip(deltas, normals, strict=True):
        way = np.linalg.norm(moved, axis=1)
        for _ in range(2):  # the longest way within two edges decides: between crest and furrow, only normals turn
            wider = way.copy()
            np.maximum.at(wider, first, way[second])
            np.maximum.at(wider, second, way[first])
            way = wider
        share = smoothstep(way / cut - 1.0).astype(np.float32)[:, None]
        moved *= share
        turned *= share
    return deltas, normals
