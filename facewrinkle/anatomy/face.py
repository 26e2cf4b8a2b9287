"""A face: a rest mesh with the anatomy under it."""

from __future__ import annotations

import dataclasses
import html
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self, TypeVar

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..array_types import Array, BoolArray
from ..errors import LandmarkError, MeshError, check_name, check_range, warn
from ..geometry import BoxTree, boundary_loops, unique_edges, vertex_normals
from ..mesh import FrameState, closest_places, is_frame, rest_of, to_polydata
from .atlas import Atlas, Mixture, load_atlas
from .attachments import Attachments, combined_mesh
from .cavities import IN_MOUTH, Cavities, Lining
from .eyeball import Eyeball, eye_distance
from .eyelid_opening import EyelidOpening, eyelid_opening, lid_rim, place_eyeballs, usual_corners
from .eyelids import LidWeights, lid_share, lid_weights
from .head import BoundHairs, load_head
from .identity import aged_flesh, fold_depth
from .landmarks import NAMES, NOT_ON_SKIN, FaceFrame, check_on_surface, fitted_map, frame_of, lips_middle
from .muscles import TURNS, EyeMuscle, JawMuscle, JointWeights, LidMuscle, Muscle, zones
from .parts import Part
from .skull import Mandible, Tissue, jaw_weights, tissue_of
from .teeth import behind_lips

T = TypeVar("T")

LID_MUSCLES = ("orbicularis_oculi_{}", "orbicularis_oculi_palpebral_{}")
"""Muscles that close an eye and tighten its lower lid."""


class Muscles(dict[str, Muscle]):
    """Muscles by name. It shows the names alone: all that muscles hold would fill pages.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> Muscles(list(fw.default_face().muscles.items())[:2])
    2 muscles: frontalis_inner_l, frontalis_inner_r
    """

    def __repr__(self) -> str:
        return f"{len(self)} muscles: {', '.join(self)}"


@dataclass(frozen=True, eq=False)
class Face:
    """A rest mesh with landmarks, skull, eyes and muscles, all in the mesh's own unit and coordinates.

    :func:`facewrinkle.default_face` and :func:`facewrinkle.fit_face` make one; :func:`facewrinkle.surface` makes one
    without anatomy of any surface. A face does not change: its skins, simulations and scenes share what they found from
    it. Make another one with :meth:`with_muscles`,
    :meth:`with_landmarks`, :meth:`with_expressions` or ``dataclasses.replace``.

    Attributes
    ----------
    mesh : pyvista.PolyData
        The skin at rest, n vertices, m triangles, with the point data of the input: what PyVista's functions take, as
        ``plotter.add_mesh(face.mesh)``.
    landmarks : dict of str to ndarray, shape (3,)
    muscles : dict of str to Muscle
    eyes : list of Eyeball
    tissue : Tissue
        Depth, stiffness and direction of the soft tissue under each vertex.
    unit : float
        Millimeters per unit of the mesh.
    atlas : Atlas
        The source of muscles, action units and expressions.
    estimated : tuple of str
        Landmarks that were not given but mirrored or estimated.
    texture : ndarray of uint8, shape (h, w, 3), optional
        Color over the mesh's texture coordinates, first row at the top.
    bound_hair : dict of str to BoundHairs
        Hair that is bound to the triangles of the mesh: ``brows``, ``cropped_hair`` of the head, and ``beard``.
    confidences : dict of str to float
        Confidence, 0 to 1, in landmarks that were found by the shape of the mesh.
    likeness : float, optional
        Likeness of the shape to a face, at most 1, if landmarks were found by the shape.
    age : float
        In [-1, 1]: above 0, the depth of the lines that :class:`facewrinkle.WaveFolds` draws at rest; below, how young.
    iris : float
        In [-1, 1]: the color of the irises of painted eyes, from blue over gray to dark brown.
    source_points : ndarray of int, shape (n,), optional
        Index of each vertex in the mesh that was given. Default: the same.
    parts : dict of str to Part
        Meshes that came with the face besides its skin, such as ``eye_l``, ``upper_teeth``, ``lashes_l``, ``hair``.
    report : tuple of str
        Repairs and parts that were set apart when the face was fitted, one sentence each.

    Examples
    --------
    The built-in head, and the distance of its nose in front of its eyes, mm:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> face
    Face(4517 triangles, 33 landmarks, 48 muscles)
    >>> round(float(face.landmarks["nose_tip"][2] - face.eyes[0].centre[2]))
    47
    """

    mesh: pv.PolyData
    landmarks: dict[str, Array]
    muscles: dict[str, Muscle]
    eyes: list[Eyeball]
    tissue: Tissue
    unit: float
    atlas: Atlas
    estimated: tuple[str, ...] = ()
    texture: npt.NDArray[np.uint8] | None = None
    bound_hair: dict[str, BoundHairs] = field(default_factory=dict)
    confidences: dict[str, float] = field(default_factory=dict)
    source_points: npt.NDArray[np.int64] | None = None
    parts: dict[str, Part] = field(default_factory=dict)
    report: tuple[str, ...] = ()
    likeness: float | None = None
    age: float = 0.0
    iris: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "muscles", Muscles(self.muscles))

    @classmethod
    def from_landmarks(
        cls,
        mesh: pv.PolyData,
        landmarks: Mapping[str, Array],
        unit: float,
        atlas: Atlas | None = None,
        estimated: tuple[str, ...] = (),
        parts: Mapping[str, Part] | None = None,
        **others: Any,
    ) -> Self:
        """Build the anatomy under a clean triangle mesh from its complete landmarks, with eyes where they are among the
        `parts`; `others` are further attributes of the face.
        """
        atlas = atlas or load_atlas()
        points, triangles = (
            np.asarray(mesh.points, dtype=np.float64),
            np.asarray(mesh.regular_faces, dtype=np.int32),
        )
        if len(triangles) == 0:
            raise MeshError("a face needs triangles; the mesh has none.")
        if missing := [name for name in NAMES if name not in landmarks]:
            raise LandmarkError(
                f"{len(missing)} landmarks are missing, such as {missing[0]}: fit_face estimates those not given."
            )
        frame = frame_of(landmarks)
        where, values = atlas.tissue_samples(landmarks, frame)
        values[:, 0] /= unit
        loops = boundary_loops(triangles)
        tissue = tissue_of(points, triangles, loops, (where, values), frame.pupil_distance)
        parts = dict(parts or {})
        eyes = place_eyeballs(landmarks, frame, points, triangles, loops, estimated, parts)
        muscles = atlas.place(landmarks, frame)
        face = cls(mesh, dict(landmarks), muscles, eyes, tissue, unit, atlas, estimated, parts=parts, **others)
        vars(face).update(boundary_loops=loops, changed_muscles={})  # cached properties, known by now
        return face

    @classmethod
    def without_anatomy(
        cls, mesh: pv.PolyData, unit: float, source_points: npt.NDArray[np.int64] | None = None
    ) -> Self:
        """Return a clean triangle mesh as a face that has no landmarks, eyes, muscles or depth of tissue."""
        points, triangles = np.array(mesh.points, dtype=np.float64), np.asarray(mesh.regular_faces, dtype=np.int32)
        zero = np.zeros(len(points))
        tissue = Tissue(zero, zero, vertex_normals(points, triangles), points, zero, zero)
        return cls(mesh, {}, {}, [], tissue, unit, load_atlas(), source_points=source_points)

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy, also a pickled one, is made from; what was found from it is found anew."""
        return {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}

    def __repr__(self) -> str:
        return f"Face({self.mesh.n_cells} triangles, {len(self.landmarks)} landmarks, {len(self.muscles)} muscles)"

    def _repr_html_(self) -> str:
        """Return the table that notebooks show."""
        rows = {
            "Triangles": self.mesh.n_cells,
            "Unit": f"{self.unit:g} mm",
            "Landmarks": f"{len(self.landmarks)}, of which estimated: {', '.join(self.estimated) or 'none'}",
            "Muscles": len(self.muscles),
            "Parts": ", ".join(self.parts) or "none",
            "Likeness": "not measured" if self.likeness is None else f"{self.likeness:.2f}",
        }
        lines = (f"<tr><td>{name}</td><td>{html.escape(str(value))}</td></tr>" for name, value in rows.items())
        return f"<table><tr><th>Face</th><th>Information</th></tr>{''.join(lines)}</table>"

    @property
    def n_points(self) -> int:
        """Number of vertices."""
        return int(self.mesh.n_points)

    @property
    def n_cells(self) -> int:
        """Number of triangles."""
        return int(self.mesh.n_cells)

    @property
    def bounds(self) -> Any:
        """Smallest and largest x, y and z of the vertices, as of any mesh of PyVista."""
        return self.mesh.bounds

    @property
    def points(self) -> Array:
        """Rest positions (n, 3)."""
        return np.asarray(self.mesh.points, dtype=np.float64)

    @property
    def points_mm(self) -> Array:
        """Rest positions (n, 3) in millimeters: where the simulation works."""
        return self.points * self.unit

    @cached_property
    def triangles(self) -> npt.NDArray[np.int32]:
        """Vertices of the triangles (m, 3)."""
        return np.ascontiguousarray(self.mesh.regular_faces, dtype=np.int32)

    @cached_property
    def normals(self) -> Array:
        """Unit normals (n, 3) of the vertices at rest."""
        return vertex_normals(self.points, self.triangles)

    @cached_property
    def edges(self) -> npt.NDArray[np.int32]:
        """Edges (e, 2) of the mesh."""
        return unique_edges(self.triangles)[0]

    @cached_property
    def boundary_loops(self) -> list[npt.NDArray[np.int32]]:
        """Vertices around each hole of the mesh, in order."""
        return boundary_loops(self.triangles)

    @cached_property
    def frame(self) -> FaceFrame:
        """Axes and size of the face; without landmarks, the axes of the coordinates and a fifth of the mesh's size."""
        if not self.landmarks:
            low, high = self.points.min(axis=0), self.points.max(axis=0)
            return FaceFrame(np.eye(3), 0.5 * (low + high), 0.2 * float(np.linalg.norm(high - low)))
        return frame_of(self.landmarks)

    @cached_property
    def changed_muscles(self) -> dict[str, Muscle | None]:
        """Muscles of the face or its atlas that are not as the atlas places them, as it does; None for added ones.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> muscle = face.muscles["mentalis_l"].replaced(strength=2.0)
        >>> list(face.with_muscles({"mentalis_l": muscle, "mine": muscle}).changed_muscles)
        ['mentalis_l', 'mine']
        """
        if not self.landmarks:
            return dict.fromkeys(self.muscles)
        placed, own = self.atlas.place(self.landmarks, self.frame), self.muscles
        changed = {n: muscle for n, muscle in placed.items() if n not in own or not muscle.same_as(own[n])}
        return changed | dict.fromkeys(name for name in own if name not in placed)

    @cached_property
    def zones(self) -> BoolArray:
        """True (k, m) for the triangles that the wrinkles of each muscle may touch."""
        return zones([muscle.fold_pattern for muscle in self.muscles.values()], self.points, self.triangles)

    @cached_property
    def eyelid_openings(self) -> dict[str, EyelidOpening]:
        """The opening between the lids of each eye, by side; eyes whose lids are closed have none."""
        mesh = self.points, self.triangles, self.boundary_loops
        found = {eye.side: eyelid_opening(eye, *mesh, self.landmarks) for eye in self.eyes}
        return {side: opening for side, opening in found.items() if opening is not None}

    @cached_property
    def lid_rims(self) -> dict[str, npt.NDArray[np.int32]]:
        """Vertices around the hole before each eye, in order, by side; none where the skin goes on behind the lids."""
        found = {eye.side: lid_rim(eye, self.points, self.boundary_loops) for eye in self.eyes}
        return {side: rim for side, rim in found.items() if rim is not None}

    @cached_property
    def eyes_without_lids(self) -> dict[str, Eyeball]:
        """Eyes before which the skin has no opening, by the muscles of their lids: these lids do not move."""
        without = [eye for eye in self.eyes if eye.side not in self.eyelid_openings]
        names = [(name.format(eye.side), eye) for eye in without for name in LID_MUSCLES]
        return {name: eye for name, eye in names if name in self.muscles}

    @cached_property
    def shut_lids(self) -> npt.NDArray[np.float64]:
        """Share (n,) of the skin that is a lid without an opening: 1 before such an eye, 0 where no lid reaches."""
        shares = [lid_share(eye, self.points) for eye in self.eyes_without_lids.values()]
        return np.asarray(np.max([np.zeros(len(self.points)), *shares], axis=0))

    @cached_property
    def fold_depth(self) -> float:
        """Depth of the folds relative to those of an adult, by age and proportions: children's are faint."""
        return fold_depth(self.landmarks, self.frame, self.age) if self.landmarks else 1.0

    @cached_property
    def mouth_opens(self) -> bool:
        """True if one hole of the mesh or a hollow behind the lips reaches both sides; else the jaw parts no lips."""
        return self._opening_of_mouth == 2

    @cached_property
    def mouth_half_open(self) -> bool:
        """True if that reaches one side only, as in scans of closed mouths: there the lips stay together, too."""
        return self._opening_of_mouth == 1

    @cached_property
    def _opening_of_mouth(self) -> int:
        """The most sides of the mouth that one hole, or a hollow behind the lips, reaches: skin between holes holds."""
        if not self.landmarks:
            return 0
        middle = self.frame.local(lips_middle(self.landmarks))
        away = self.frame.local(self.points) - middle
        reach = np.array([0.3, 0.25, 0.6])  # [left, up, forward], in distances between the pupils
        bag = (np.abs(away[:, :2]) < reach[:2]).all(axis=1) & (self.cavities.depth(self.points) > IN_MOUTH)
        rims = [np.vstack([away[loop], away[loop].mean(axis=0)]) for loop in self.boundary_loops]
        found = [away[bag, 0], *(rim[(np.abs(rim) < reach).all(axis=1), 0] for rim in rims)]
        # It reaches a side if it goes a quarter of the way from the middle to the corner.
        ends = [0.25 * float((self.frame.local(self.landmarks[f"mouth_{s}"]) - middle)[0]) for s in "lr"]
        return max(int((each > ends[0]).any()) + int((each < ends[1]).any()) for each in found)

    @cached_property
    def cavities(self) -> Cavities:
        """The mouth and the nostrils. Landmarks are needed."""
        return Cavities(self.points, self.triangles, self.landmarks, self.frame)

    @cached_property
    def lining(self) -> Lining:
        """The skin behind lips and rims of nostrils."""
        return Lining(self.cavities, self.points, self.triangles, self.landmarks)

    @cached_property
    def behind_lips(self) -> float:
        """Distance from the front of the lips back to the upper incisors, mm on a face of average size."""
        skin = np.concatenate([self.points, self.points[self.edges].mean(axis=1)])
        return behind_lips(skin, self.landmarks, self.frame)

    @cached_property
    def mandible(self) -> Mandible | None:
        """The bone of the lower jaw; None if no skin goes wholly with it."""
        jaws = ((muscle, self.joint_weights.get(name)) for name, muscle in self.muscles.items())
        found = (Mandible.of(jaw, turns, self.points) for jaw, turns in jaws if isinstance(jaw, JawMuscle) and turns)
        return next((mandible for mandible in found if mandible is not None), None)

    @cached_property
    def joint_weights(self) -> dict[str, JointWeights]:
        """Turns of the skin with lids and jaw, by muscle; without an opening there are no lids, and no jaw."""
        found: dict[str, JointWeights] = {}
        for side, opening in self.eyelid_openings.items():
            lids = lid_weights(opening, self.points, self.triangles)
            found |= {} if lids is None else self._weights_of_lids(side, lids)
        for name, muscle in self.muscles.items():
            if isinstance(muscle, JawMuscle) and self.mouth_opens:
                found[name] = jaw_weights(muscle, self.points, self.edges, self.landmarks, self.frame)
        return {name: weights for name, weights in found.items() if name in self.muscles}

    @cached_property
    def mandible_share(self) -> Array:
        """Share (n,) of the mandible's turn that each vertex takes: 1 on the lower lip, 0 on the upper one."""
        share = np.zeros(len(self.points))
        for name, weights in self.joint_weights.items():
            muscle = self.muscles[name]
            if isinstance(muscle, JawMuscle):
                share[weights.vertices] = weights.angles / muscle.angle
        return np.clip(share, 0.0, 1.0)

    def _weights_of_lids(self, side: str, lids: LidWeights) -> dict[str, JointWeights]:
        """Turns with the lids of one eye, by muscle; where several contract, closing comes first, then the gaze."""
        closing, tightening = (name.format(side) for name in LID_MUSCLES)
        following = {
            name: (muscle.angle, lids.up if muscle.turn == "up" else lids.down)
            for name, muscle in self.muscles.items()
            if isinstance(muscle, EyeMuscle) and muscle.side == side and muscle.turn in ("up", "down")
        }
        upper = np.maximum(lids.close.angles, 0.0)
        found = {closing: lids.close, tightening: dataclasses.replace(lids.tighten, yields=(closing,))}
        for name, muscle in self.muscles.items():
            if isinstance(muscle, LidMuscle) and muscle.side == side:
                lifted = -muscle.share * upper
                found[name] = dataclasses.replace(lids.close, angles=lifted, yields=(closing, *following))
            elif name in following:
                angle, weights = following[name]
                found[name] = dataclasses.replace(weights, angles=angle * weights.angles, yields=(closing,))
        return found

    def gazes(self, rates: Mapping[str, float]) -> dict[str, Array]:
        """Return unit directions (3,) in which the eyes look, by side, at contraction rates by muscle."""
        turns = {eye.side: np.zeros(2) for eye in self.eyes}
        for name, muscle in self.muscles.items():
            if isinstance(muscle, EyeMuscle) and muscle.side in turns:
                turns[muscle.side] += rates.get(name, 0.0) * muscle.angle * np.array(TURNS[muscle.turn])
        return {eye.side: eye.turned(*turns[eye.side]) for eye in self.eyes}

    def jaw_angle(self, rates: Mapping[str, float]) -> float | None:
        """Return the turn of the mandible, radians, at contraction rates by muscle; None if no muscle turns it."""
        jaws = [(name, muscle) for name, muscle in self.muscles.items() if isinstance(muscle, JawMuscle)]
        return sum(rates.get(name, 0.0) * muscle.angle for name, muscle in jaws) if jaws else None

    @cached_property
    def _remembered(self) -> dict[str, dict[Hashable, Any]]:
        return {}

    @cached_property
    def _attachments(self) -> Attachments:
        return Attachments(self.parts, self.eyes, self.mandible, self.points, self.triangles, self.frame.pupil_distance)

    def state_of(self, frame: pv.PolyData) -> FrameState:
        """Return the vertices, pose, gazes and moving parts of this face in a frame of its simulation, or in its mesh.

        Raises
        ------
        MeshError
            If the frame has fewer points than the face.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> face.state_of(face.mesh).head[0].tolist()
        [1.0, 0.0, 0.0, 0.0]
        """
        return FrameState.of(frame, self.mesh.n_points)

    def parts_at(self, frame: pv.PolyData) -> dict[str, pv.PolyData]:
        """Return the parts besides the skin, placed as in a frame of :meth:`facewrinkle.Simulation.step`.

        Eyes turn with the gaze, lower teeth with the mandible, lashes with the lids; the rest goes with the head. Parts
        that a recording moves by themselves are as recorded.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> face.parts_at(face.mesh)
        {}
        """
        if not self.parts:
            return {}
        state = self.state_of(frame)
        own = {name: points for name, points in state.parts.items() if name in self.parts}
        return self._attachments.at(state.points, state.gazes, state.pose, own, state.jaw_angle, state.mandible)

    def with_parts(self, frame: pv.PolyData) -> pv.PolyData:
        """Return a frame and the parts besides the skin in one mesh, for files; without parts, the frame itself.

        The points of the frame come first; the array "part" tells which part each point belongs to.
        """
        parts = self.parts_at(frame)
        for name, part in parts.items():
            part.point_data["rest"] = np.asarray(self.parts[name].mesh.points)
        return combined_mesh(frame, parts) if parts else frame

    def landmarks_on(self, frame: pv.PolyData) -> dict[str, Array]:
        """Return the landmarks on the moved and wrinkled skin of a frame of :meth:`facewrinkle.Simulation.step`.

        The centres of the eyes go with the head.

        Parameters
        ----------
        frame : PolyData
            A frame of this face, refined or not, or its mesh.

        Returns
        -------
        dict of str to ndarray, shape (3,)
            In the unit and coordinates of the frame.

        Raises
        ------
        MeshError
            If `frame` is not a frame of this face.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> sim = fw.Simulation(face)
        >>> sim.express("surprise")
        >>> *_, frame = sim.run(30)
        >>> raised = face.landmarks_on(frame)["brow_l_mid"] - face.landmarks["brow_l_mid"]
        >>> bool(raised[1] > 2.0)
        True
        """
        if frame.n_points < self.mesh.n_points or not (is_frame(frame) or frame.n_points == len(self.points)):
            raise MeshError(
                f"a frame of this face has its {self.mesh.n_points} vertices and those of split triangles, with the "
                f"array 'rest'; received a mesh of {frame.n_points} points. Give a frame of its simulation."
            )
        points, triangles = np.asarray(frame.points, np.float64), np.asarray(frame.regular_faces)
        rest = rest_of(frame) if is_frame(frame) else self.points
        state = self.state_of(frame)
        names = [name for name in self.landmarks if name not in NOT_ON_SKIN]
        places = np.array([self.landmarks[name] for name in names]).reshape(-1, 3)
        moved = {name: state.from_rest(place) for name, place in self.landmarks.items()}
        if names:
            cells, weights, _ = BoxTree(rest, triangles).closest(places)
            on_skin, now = (np.einsum("nk,nki->ni", weights, each[triangles[cells]]) for each in (rest, points))
            moved |= dict(zip(names, now + (places - on_skin) @ state.head[:3, :3].T, strict=True))
        return moved

    def plot(self, **options: Any) -> Any:
        """Show the face at rest, upright and from the front, in a window or a notebook.

        Parameters
        ----------
        **options
            Those of :func:`pyvista.plot`, such as ``screenshot="face.png"``.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> fw.default_face().plot(off_screen=True)
        """
        _, up, forward = self.frame.axes
        middle = self.points.mean(axis=0)
        front = middle + 4.0 * np.linalg.norm(self.points - middle, axis=1).max() * forward  # all of it is in view
        texture = None if self.texture is None else pv.Texture(self.texture)
        return self.mesh.copy(deep=False).plot(**{"cpos": [front, middle, up], "texture": texture, **options})

    @property
    def skull(self) -> pv.PolyData:
        """The bone under the skin, one vertex under each vertex of the skin."""
        return to_polydata(self.tissue.anchors, self.triangles)

    def with_muscles(self, changes: Mapping[str, Muscle]) -> Self:
        """Return the face with some muscles replaced or added.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> deeper = face.muscles["corrugator_l"].replaced(depth=3.0)
        >>> face.with_muscles({"corrugator_l": deeper}).muscles["corrugator_l"].wrinkles.depth
        3.0
        """
        return dataclasses.replace(self, muscles={**self.muscles, **changes})

    def with_landmarks(self, moved: Mapping[str, npt.ArrayLike]) -> Self:
        """Return the face with landmarks at other places: skull, eyes and muscles anew, on the same mesh.

        Parameters
        ----------
        moved : dict of str to array_like, shape (3,)
            The new places, in the coordinates of the mesh. The other landmarks stay where they are.

        Raises
        ------
        LandmarkError
            If landmarks lie off the mesh, or do not make a face.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> higher = face.with_landmarks({"mouth_l": face.landmarks["mouth_l"] + [0.0, 3.0, 0.0]})
        >>> change = higher.muscles["zygomaticus_major_l"].insertion - face.muscles["zygomaticus_major_l"].insertion
        >>> bool(change[1] > 2.0)
        True
        """
        for name in moved:
            check_name("landmark", name, self.landmarks)
        changed = {name: np.asarray(place, np.float64) for name, place in moved.items()}
        landmarks = {**self.landmarks, **changed}
        check_on_surface(changed, self.mesh, frame_of(landmarks).pupil_distance)
        estimated = tuple(name for name in self.estimated if name not in moved)
        confidences = {**self.confidences, **dict.fromkeys(moved, 1.0)}
        face = self._rebuilt(self.mesh, landmarks, estimated=estimated, confidences=confidences)
        return face.with_lids()

    def _rebuilt(self, mesh: pv.PolyData, landmarks: Mapping[str, Array], **changes: Any) -> Self:
        """The face with its skull, eyes and muscles anew, on a mesh of the same triangles."""
        kept = "estimated parts confidences texture bound_hair source_points report likeness age iris"
        others = {name: getattr(self, name) for name in kept.split()} | changes
        return self.from_landmarks(mesh, landmarks, self.unit, self.atlas, **others)

    def aged(self, age: float) -> Self:
        """Return the face at another age: its flesh sags and sinks, and folds leave lines at rest.

        Brows, cheeks and jowls sag, temples and hollows sink, ears grow, as on the built-in head, from which landmarks
        carry it. That head ages by its :class:`facewrinkle.Identity`, with lids and lips.

        Parameters
        ----------
        age : float
            From 0 to 1. A face that is fitted has the age 0, however old it looks.

        Raises
        ------
        LandmarkError
            If the surface has no landmarks.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> old = face.aged(1.0)
        >>> old.age, (old.landmarks["brow_l_outer"] - face.landmarks["brow_l_outer"]).round()[1].item()
        (1.0, -2.0)
        """
        years = check_range("age", age, 0.0, 1.0) - self.age
        if not self.landmarks:
            raise LandmarkError("a surface without landmarks has no age: fit_face finds those of a face.")
        if not years:
            return self
        marks = load_head().landmarks
        base = frame_of(marks)
        onto_head = fitted_map(self.landmarks, marks, self.frame, base)
        turn = base.axes.T @ self.frame.axes * (years * self.frame.pupil_distance / base.pupil_distance)
        mesh = self.mesh.copy()
        places = np.vstack([self.points, *self.landmarks.values()])
        places += aged_flesh(onto_head(places), eye_distance(places, self.eyes)) @ turn
        mesh.points = places[: self.n_points]
        return self._rebuilt(mesh, dict(zip(self.landmarks, places[self.n_points :], strict=True)), age=float(age))

    def with_lids(self) -> Self:
        """Return the face with usual corners of eyes, and a warning, where only between these the skin has an opening.

        Examples
        --------
        Lids that are open stay as they are:

        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> face.with_lids() is face
        True
        """
        shut, marks = {"l", "r"} - set(self.eyelid_openings), self.landmarks
        if not shut:
            return self
        usual = usual_corners(marks, self.frame)
        usual = dict(zip(usual, closest_places(self.mesh, np.array(list(usual.values())))[1], strict=True))
        mesh = self.points, self.triangles, self.boundary_loops
        eyes = place_eyeballs(marks | usual, self.frame, *mesh, self.estimated, self.parts)
        opened = {eye.side for eye in eyes if eye.side in shut and eyelid_opening(eye, *mesh, marks | usual)}
        moved = {name: place for name, place in usual.items() if name[4] in opened}
        if not moved:
            return self
        far = [f"{n} ({np.linalg.norm(place - marks[n]) * self.unit:.1f} mm)" for n, place in moved.items()]
        sentence = (
            "landmarks that are not at the ends of the opening before an eye were moved to where these usually are, by "
            f"their distance: {', '.join(far)}. Check them."
        )
        warn(sentence)
        face = self.with_landmarks(moved)
        return dataclasses.replace(face, report=(*face.report, sentence), estimated=(*face.estimated, *moved))

    def with_expressions(self, added: Mapping[str, Mixture]) -> Self:
        """Return the face with expressions of one's own; see :meth:`facewrinkle.anatomy.atlas.Atlas.with_expressions`.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face().with_expressions({"smirk": {"AU2L": 1.0, "AU14R": 0.5}})
        >>> sim = fw.Simulation(face)
        >>> sim.express("smirk")
        """
        return dataclasses.replace(self, atlas=self.atlas.with_expressions(added))

    def with_atlas(self, atlas: Atlas) -> Self:
        """Return the face with the muscles, action units and expressions of another atlas; the tissue stays.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> from facewrinkle.anatomy.atlas import printed_atlas
        >>> fw.default_face().with_atlas(printed_atlas())
        Face(4517 triangles, 33 landmarks, 23 muscles)
        """
        return dataclasses.replace(self, atlas=atlas, muscles=atlas.place(self.landmarks, self.frame))


def per_face(face: Face, name: str, key: Hashable, make: Callable[[], T]) -> T:
    """Return what was made of a face under a name and a key, or make it.

    It lives as long as the face, or until four others of its name were made. All who ask share it.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> per_face(face, "sum", 1, lambda: [0.5]) is per_face(face, "sum", 1, lambda: [0.7])
    True
    """
    made = face._remembered.setdefault(name, {})
    if key not in made:
        thing = make()
        while len(made) >= 4:
            made.pop(next(iter(made)), None)  # others may draw in threads
        made[key] = thing
    found: T = made[key]
    return found
