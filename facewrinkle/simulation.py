"""The loop: a motion moves the base mesh, refinement gives the layers triangles, layers displace, a frame comes out."""

from __future__ import annotations

import reprlib
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyvista as pv

from .anatomy.eyeball import gaze_of
from .anatomy.face import Face
from .anatomy.fitting import surface
from .anatomy.muscles import EyeMuscle
from .errors import ParameterError, check_range, check_whole, unknown_name, warn
from .geometry import _mesh_kernels as kernels
from .geometry.interpolation import displaced, interpolated
from .geometry.normals import detail_normals, vertex_normals
from .geometry.refinement import Change, RedGreenForest
from .geometry.smoothstep import smoothstep
from .layers.base import Displacement, Layer, SurfacePoints, SurfaceState
from .layers.compression import StrainField
from .layers.muscle_wrinkles import MuscleWrinkles
from .layers.patterns_on_skin.layer import PatternLayer
from .mesh import MUSCLES, POSE, UNIT, interpolated_point_data, refilled, refine_seams, to_polydata
from .mesh.arrays import OF_PART
from .motion.base import Motion, Still
from .motion.playback import Playback
from .motion.recorded import Recorded
from .motion.skin import Skin, SkinMaterial

Array = npt.NDArray[np.float64]

FINEST = 8
"""Triangles are never split more often."""


@dataclass(frozen=True)
class Refinement:
    """When triangles are split and taken back.

    Attributes
    ----------
    gamma_c : float
        Threshold of Eq. 19: 0.03 is a bend of 14 degrees along an edge.
    max_level : int, optional
        Triangles are split at most this often; 0 turns refinement off. Default: as often as nine in ten muscles need
        for about three vertices per half cycle, at least once: 2 on the built-in head, 3 on one with twice its edges
        and on surfaces without muscles.
    samples : float
        Vertices per half cycle that a wrinkle needs across its folds (the paper's criterion is blind at 1 and 2).
    hysteresis : float
        In (0, 1): an edge is taken back when its bend is below this share of what would split it, and when twice its
        length would still be short enough, by this share.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> sim = fw.Simulation(fw.default_face(), fw.Refinement(max_level=0))
    >>> sim.express("surprise")
    >>> {frame.n_cells for frame in sim.run(10)}
    {4517}
    """

    gamma_c: float = 0.03
    max_level: int | None = None
    samples: float = 4.0
    hysteresis: float = 0.2

    def __post_init__(self) -> None:
        check_range("gamma_c", self.gamma_c, 1e-9, 2.0)
        if self.max_level is not None:
            check_whole("max_level", self.max_level, 0, FINEST, "Each level has four times as many triangles.")
        check_range("samples", self.samples, 1.0, 64.0)
        check_range("hysteresis", self.hysteresis, 1e-9, 1.0 - 1e-9)


class Simulation:
    """A face, or any other surface, that moves and wrinkles.

    Parameters
    ----------
    face : Face, PolyData or path
        A mesh or a file becomes a :func:`facewrinkle.surface` in mm, which has no muscles.
    refinement : Refinement, optional
    layers : sequence of Layer, optional
        Default: one :class:`facewrinkle.MuscleWrinkles` where there are muscles. An empty list leaves the skin bare.
        Layers keep state, so the simulation works with copies of its own; they are in `layers`.
    time_step : float, optional
        Seconds per step. Default: 0.02, or the time step of `motion`.
    material : SkinMaterial, optional
        Of the default skin.
    motion : Motion or Recorded, optional
        What moves the base mesh. Default: a :class:`facewrinkle.Skin`, which the muscles pull; a surface without
        anatomy keeps :class:`facewrinkle.Still`.

    Warns
    -----
    FaceWrinkleWarning
        For each pattern that the mesh cannot carry well with the level cap that was asked for.

    Raises
    ------
    ParameterError
        For a pattern that it cannot carry at all.

    Attributes
    ----------
    motion : Motion
    seconds : dict of str to float
        Time spent so far on "precompute", "skin", "refinement", "wrinkles" and "frame".

    Examples
    --------
    >>> import facewrinkle as fw
    >>> sim = Simulation(fw.default_face())
    >>> sim.express("surprise")
    >>> for frame in sim.run(40):
    ...     pass
    >>> frame.n_cells > 4517
    True
    """

    def __init__(
        self,
        face: Face | pv.DataSet | str | Path,
        refinement: Refinement | None = None,
        layers: Sequence[Layer] | None = None,
        time_step: float | None = None,
        material: SkinMaterial | None = None,
        motion: Motion | Recorded | None = None,
    ) -> None:
        self.seconds = dict.fromkeys(("precompute", "skin", "refinement", "wrinkles", "frame"), 0.0)
        self.face = face = face if isinstance(face, Face) else surface(face)
        self.refinement = refinement or Refinement()
        if layers is None:
            layers = [MuscleWrinkles()] if face.muscles else []
        # Layers keep the state of a simulation: each simulation has its own.
        methods = ("attach", "follow", "displacement", "fields")
        if not isinstance(layers, Sequence) or not all(hasattr(layer, name) for layer in layers for name in methods):
            raise ParameterError(
                "layers must be a list of layers, such as [MuscleWrinkles()], each with the methods attach, follow, "
                f"relief and fields; received {reprlib.repr(layers)}."
            )
        self.layers: list[Layer] = [copy(layer) for layer in layers]
        with self._timed("precompute"):
            self.motion = _motion(face, time_step, material, motion)
            spacing = _spacing(face)
            needed = [(p.name, p.level_needed(face)) for p in self.layers if isinstance(p, PatternLayer)]
            if self.refinement.max_level is None:
                level = _level_for(face, spacing, max((level for _, level in needed), default=0))
                self.refinement = replace(self.refinement, max_level=level)
            self._level = int(self.refinement.max_level or 0)
            self._check_patterns(needed)
            self._finest = spacing / 2.0**self._level
            self.reset()

    # --- what is asked of the face -------------------------------------------------------------

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names of the face's muscles, in the order of their indices."""
        return tuple(self.face.muscles)

    @property
    def skin(self) -> Skin:
        """The skin that the muscles pull.

        Raises
        ------
        ParameterError
            If something else moves the surface.
        """
        if not isinstance(self.motion, Skin):
            raise ParameterError(
                f"this simulation has no skin that muscles pull: a {type(self.motion).__name__} moves it."
            )
        return self.motion

    @property
    def time(self) -> float:
        """Seconds simulated so far."""
        return self._steps * self.motion.time_step

    def contract(self, rates: Mapping[str, float]) -> None:
        """Ask for contraction rates by muscle; muscles that are not named relax.

        Raises
        ------
        UnknownNameError
            For a muscle that the face does not have.
        ParameterError
            For a rate outside [0, 1], a muscle whose wrinkles are too fine for the level cap, or a motion that is not
            driven by muscles.
        """
        asked = self.motion.rates_of(rates)
        if len(asked):
            looking = self._looking
            asked[looking] = np.where(asked[looking] > 0.0, asked[looking], self._looked)
        for k in np.flatnonzero(asked) if self.layers and self._level else ():
            self._check_wavelength(self.muscles[k], self._finest[k])
        self._asked = asked

    def express(self, what: str | Mapping[str, float], intensity: float = 1.0) -> None:
        """Ask for an expression or action unit by name, or for a mixture such as ``{"AU12": 0.7, "corrugator_l":
        0.2}``.

        Raises
        ------
        UnknownNameError
            For an unknown name; the nearest known ones are suggested.
        ParameterError
            For an intensity or weight outside [0, 1].
        """
        self.contract(self.face.atlas.contractions(what, intensity))

    def relax(self) -> None:
        """Ask all muscles to relax."""
        self.contract({})

    def look(self, yaw: float = 0.0, pitch: float = 0.0, at: npt.ArrayLike | None = None) -> None:
        """Ask the eyes to look somewhere; the lids follow, and so do later expressions until asked otherwise.

        Parameters
        ----------
        yaw, pitch : float
            Degrees to the subject's left, and upwards; 0 and 0 is straight ahead.
        at : (3,) array_like, optional
            A point in the coordinates of the mesh that both eyes converge on, in place of the angles.

        Raises
        ------
        ParameterError
            For a direction that the eyes cannot turn to: the muscles that turn them reach 40 degrees to each side.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> sim = Simulation(fw.default_face())
        >>> sim.look(yaw=20)
        >>> frame = sim.step()
        >>> round(float(np.degrees(np.arcsin(frame.field_data["gaze_l"][0, 0]))), 1)
        20.0
        """
        asked = np.zeros(len(self.motion.names))
        for eye in self.face.eyes:
            out, up = gaze_of(eye, yaw, pitch, at)
            for name, muscle in self.face.muscles.items():
                if isinstance(muscle, EyeMuscle) and muscle.side == eye.side and name in self.motion.names:
                    asked[self.motion.names.index(name)] = muscle.rate(out, up)
        self._looked = asked[self._looking]
        self._asked = self._asked.copy()
        self._asked[self._looking] = self._looked

    def _check_patterns(self, needed: list[tuple[str, int]]) -> None:
        """Say which patterns the mesh cannot carry at this level: an error for such that would have less than a vertex
        per half wave, unless refinement is off.
        """
        for name, level in needed:
            if level <= self._level:
                continue
            ask = f"max_level={level}, for " if level <= FINEST else ""
            remedy = f"Ask for {ask}fewer wrinkles, for a larger region, or begin with a finer mesh."
            if 0 < self._level < level - 1:
                raise ParameterError(
                    f"the mesh is too coarse to carry the pattern {name}: its triangles would have to be split {level} "
                    f"times, and max_level={self._level} is allowed. {remedy}"
                )
            warn(
                f"the mesh is too coarse to carry the pattern {name} well: its triangles should be split "
                f"{level} {'time' if level == 1 else 'times'}, and max_level={self._level} is allowed. {remedy}"
            )

    def _check_wavelength(self, name: str, spacing: float) -> None:
        u = self.face.muscles[name].fold_pattern.half_wavelength
        if u < spacing:
            level = self._level + int(np.ceil(np.log2(spacing / u)))
            remedy = "Ask for fewer wrinkles" + (f", or for max_level={level}." if level <= FINEST else ".")
            raise ParameterError(
                f"the wrinkles of {name} are too fine: half a wavelength of {u * self.face.unit:.3g} mm, "
                f"but with max_level={self.refinement.max_level} vertices are {spacing * self.face.unit:.3g} mm apart. "
                f"{remedy}"
            )

    # --- time ----------------------------------------------------------------------------------

    def reset(self) -> None:
        """Back to the unrefined face at rest, all muscles relaxed."""
        self._steps = 0
        self._asked = np.zeros(len(self.motion.names))
        self.motion.reset()
        face = self.face
        eye_muscles = [isinstance(face.muscles.get(name), EyeMuscle) for name in self.motion.names]
        self._looking: npt.NDArray[np.int64] = np.flatnonzero(eye_muscles)
        self._looked = np.zeros(len(self._looking))
        self.forest = RedGreenForest(face.triangles, self._level, face.mesh.n_points)
        self._base_normals = vertex_normals(face.points, face.triangles)
        self._sites = self._sites_from(0)
        for layer in self.layers:
            layer.attach(face)
            layer.follow(Change(slice(None), len(face.points)), self._sites)
        self._template: pv.PolyData | None = None
        self._shown_turn: Array | None = None
        self._given = {name: np.asarray(values) for name, values in face.mesh.point_data.items()}
        self._facts = pv.PolyData()  # its field data are those of every frame
        self._facts.field_data[MUSCLES] = list(self.muscles)
        self._facts.field_data[UNIT] = [face.unit]
        self._levels = self.forest.level
        self._marks: tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]] | None = None

    def step(self) -> pv.PolyData:
        """Advance by one time step with the muscles as asked for.

        Returns
        -------
        PolyData
            The wrinkled face of this moment, in the unit and coordinates of the face's mesh, with the point data of
            that mesh, "Normals", and "lambda", "gamma", "epsilon" (of the dominant muscle), "W" (mm), "split_gamma",
            "muscle", "level" and "rest"; its field data "muscles" lists the muscles' names, "gaze_l" and "gaze_r" are
            the directions in which the eyes look, and "pose" is the matrix (4, 4) of a head that moves as a whole.
        """
        return self._advanced(self._asked)

    def _advanced(self, rates: Array) -> pv.PolyData:
        with self._timed("skin"):
            self.motion.set_rates(rates)
            base = self.motion.step()
        self._refine()
        self._steps += 1
        shape = self._shape(base)
        if not self.motion.names:  # a recording may go far in a step, and still patterns begin at once
            while self._marks is not None and self._marks[0].any() and self._refine():
                shape = self._shape(base)
        with self._timed("frame"):
            return self._polydata(*shape)

    def run(self, frames: int, ramp: float = 0.6) -> Iterator[pv.PolyData]:
        """Ramp smoothly from the present contraction to what was asked for when the run began, then hold it.

        Parameters
        ----------
        frames : int
            Number of steps.
        ramp : float
            Share of the frames that the ramp takes, in [0, 1].

        Yields
        ------
        PolyData
            See :meth:`step`.
        """
        frames, ramp = check_whole("frames", frames, 1, 1e9), check_range("ramp", ramp, 0.0, 1.0)
        start, target = self.motion.rates.copy(), self._asked
        for i in range(frames):
            t = float(smoothstep((i + 1) / max(ramp * frames, 1.0)))
            yield self._advanced(target if t == 1.0 else (1.0 - t) * start + t * target)

    # --- one frame -----------------------------------------------------------------------------

    def _refine(self) -> bool:
        """Split or take back what the last shape's criterion marked, and whether there was any; the layers follow."""
        change = Change(slice(None), 0)
        with self._timed("refinement"):
            if self._marks is not None and self._level > 0:
                split, fine = self._marks
                if split.any():
                    change = self.forest.split(split)
                elif fine.any():
                    change = self.forest.coarsen(fine)
            self._marks = None
            if not change:
                return False
            created = self._sites_from(self.forest.n_points - change.n_created)
            old, kept = self._sites, change.kept
            joined = ([getattr(old, name)[kept], getattr(created, name)] for name in SurfacePoints.__dataclass_fields__)
            self._sites = SurfacePoints(*map(np.concatenate, joined))
            self._template = None
            self._levels = self.forest.level
        with self._timed("wrinkles"):
            for layer in self.layers:
                layer.follow(change, created)
        return True

    def _sites_from(self, first: int) -> SurfacePoints:
        """The places of the vertices from `first` on."""
        return SurfacePoints.of_forest(self.forest, self.face.points, self._base_normals, first)

    def _shape(self, base: Array) -> tuple[Array, Array, Array, Array]:
        """Points, normals, heights and Eq. 19 of the present triangles; what they lack or have too much is marked."""
        sites, triangles = self._sites, self.forest.triangles
        with self._timed("wrinkles"):
            bare = interpolated(base, sites.corners, sites.barycentric)
            smooth = interpolated(vertex_normals(base, self.face.triangles), sites.corners, sites.barycentric)
            kernels.normalise(smooth)
            state = SurfaceState(
                self.motion.rates, sites, triangles, base, bare, self.time, lambda: self._strain_field, smooth
            )
            reliefs = [layer.displacement(state) for layer in self.layers]
            height = sum((r.height for r in reliefs[1:]), reliefs[0].height if reliefs else np.zeros(len(bare)))
            moved = displaced(bare, height, smooth)
            offsets = [r.shading_offset for r in reliefs if r.shading_offset is not None]
            normals = shown = detail_normals(bare, moved, triangles, smooth)
            if offsets:
                shown = detail_normals(bare, displaced(bare, height + sum(offsets), smooth), triangles, smooth)
        with self._timed("refinement"):
            return moved, shown, height, self._criterion(normals, reliefs)

    @cached_property
    def _strain_field(self) -> StrainField:
        return StrainField(self.face.points * self.face.unit, self.face.triangles)

    def _criterion(self, normals: Array, reliefs: list[Displacement]) -> Array:
        """Mark triangles to split or take back; returns the largest Eq. 19 over the edges of each vertex."""
        r, sites, triangles = self.refinement, self._sites, self.forest.triangles
        n, m = len(normals), len(triangles)
        spacing, across, active = _joined(reliefs, n)
        split, fine, largest = np.empty(m, bool), np.empty(m, bool), np.zeros(n)
        kernels.mark_triangles(
            triangles, self._levels, self._level, normals, sites.normals, sites.points, spacing / r.samples, across,
            active, r.gamma_c, r.hysteresis, split, fine, largest,
        )  # fmt: skip
        self._marks = (split, fine)
        return largest

    def _polydata(self, points: Array, normals: Array, height: Array, split_gamma: Array) -> pv.PolyData:
        data: dict[str, np.ndarray] = {"Normals": normals, "split_gamma": split_gamma}
        for layer in self.layers:
            data.update(layer.fields())
        data["W"] = height  # of all layers together
        if self._template is None:
            self._template = self._new_template(data)
        if len(self._looking):
            self._look_on()
        frame = refilled(self._template, points / self.face.unit, data)
        if (pose := getattr(self.motion, "pose", None)) is not None:
            frame.field_data[POSE] = pose
        for side, gaze in getattr(self.motion, "gazes", {}).items():
            frame.field_data[f"gaze_{side}"] = gaze[None]
        for name, where in getattr(self.motion, "parts", {}).items():
            frame.field_data[OF_PART + name] = where
        return frame

    def _look_on(self) -> None:
        """Tell where the eyes look, where that has changed."""
        turned = self.motion.rates[self._looking]
        if self._shown_turn is None or not np.array_equal(turned, self._shown_turn):
            rates = dict(zip(self.motion.names, self.motion.rates.tolist(), strict=True))
            for side, gaze in self.face.gazes(rates).items():
                self._facts.field_data[f"gaze_{side}"] = gaze[None]
            self._shown_turn = turned.copy()

    def _new_template(self, data: dict[str, np.ndarray]) -> pv.PolyData:
        """A frame of the present triangles; only what `data` holds and the points change from one frame to the next."""
        sites, source = self._sites, self.face.mesh.point_data
        carried_data = interpolated_point_data(self._given, sites.corners, sites.barycentric)
        n = len(sites.points)
        blank = {name: np.zeros(n) for name in ("lambda", "gamma", "epsilon")} | {"muscle": np.full(n, -1, np.int32)}
        data = {**carried_data, **blank, **data, "rest": sites.points, "level": self.forest.vertex_level}
        frame = to_polydata(sites.points, self.forest.triangles, data)
        frame.SetFieldData(self._facts.GetFieldData())
        if source.active_texture_coordinates_name is not None:
            frame.point_data.active_texture_coordinates_name = source.active_texture_coordinates_name
        frame.point_data.active_normals_name = "Normals"
        refine_seams(self.face.mesh, frame, self.forest)
        return frame

    def fields(self, muscle: str) -> dict[str, np.ndarray]:
        """One muscle's own lambda, gamma, epsilon, W and region on the present mesh.

        Raises
        ------
        UnknownNameError
            For a muscle that the face does not have.
        """
        if muscle not in self.muscles:
            raise unknown_name("muscle", muscle, self.muscles)
        index = self.muscles.index(muscle)
        for layer in self.layers:
            if isinstance(layer, MuscleWrinkles):
                return layer.fields_of(index, float(layer.rates[index]))
        raise ParameterError("this simulation has no layer of muscle wrinkles; add a MuscleWrinkles() to its layers.")

    @contextmanager
    def _timed(self, what: str) -> Iterator[None]:
        begin = time.perf_counter()
        yield
        self.seconds[what] += time.perf_counter() - begin


def _joined(reliefs: list[Displacement], n: int) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
    """The finest spacing that any layer needs at each vertex, its direction, and where any layer is active."""
    if len(reliefs) == 1:
        return reliefs[0].spacing, reliefs[0].across, reliefs[0].active
    spacing, across, active = np.full(n, np.inf), np.zeros((n, 3)), np.zeros(n, bool)
    for relief in reliefs:
        finer = relief.spacing < spacing
        spacing[finer], across[finer] = relief.spacing[finer], relief.across[finer]
        active |= relief.active
    return spacing, across, active


def _motion(
    face: Face, time_step: float | None, material: SkinMaterial | None, motion: Motion | Recorded | None
) -> Motion:
    """The motion that was given, if it fits the face; the skin of a face with anatomy, or stillness, otherwise."""
    step = check_range("time_step", 0.02 if time_step is None else time_step, 1e-9, 1e9)
    if motion is None:
        return Skin(face, step, material) if face.landmarks else Still(face, step)
    if material is not None:
        raise ParameterError(
            "a material is that of the default skin, and here a motion is given too. Leave one of them out."
        )
    if isinstance(motion, Recorded):
        return Playback(motion, face, step)
    if time_step not in (None, motion.time_step):
        raise ParameterError(
            f"time_step is {time_step!r}, and the motion has one of its own, {motion.time_step!r}. Leave it out here."
        )
    if motion.points.shape != face.points.shape:
        raise ParameterError(
            f"the motion moves {len(motion.points)} points, the face has {len(face.points)}. Make it from this face."
        )
    if motion.names not in ((), tuple(face.muscles)):
        raise ParameterError(
            f"the motion must be driven by all {len(face.muscles)} muscles of the face, in their order, or by none; "
            f"its names are {', '.join(motion.names[:8])}. Make it from this face."
        )
    return motion


def _spacing(face: Face) -> Array:
    """Per muscle (k,) the typical edge of the base mesh in its wrinkling region, in the unit of the mesh."""
    points, triangles = face.points, face.triangles
    out = np.zeros(len(face.muscles))
    for k, zone in enumerate(face.zones):
        inside = triangles[zone]
        if len(inside):
            edges = points[inside] - points[np.roll(inside, 1, axis=1)]
            out[k] = np.median(np.linalg.norm(edges, axis=2))
    return out


def _level_for(face: Face, spacing: Array, needed: int) -> int:
    """The level at which nine in ten muscles have about three vertices per half cycle; at least what is needed, if
    possible.
    """
    needed = min(needed, FINEST)
    if not face.muscles:
        return needed or 3
    cycles = np.array([muscle.fold_pattern.half_wavelength for muscle in face.muscles.values()])
    folding = np.isfinite(cycles) & (spacing > 0.0)
    if not folding.any():
        return max(needed, 1)
    levels = np.log2(spacing[folding] / (0.35 * cycles[folding]))
    return int(np.clip(np.ceil(np.quantile(levels, 0.9)), max(needed, 1), max(needed, 4)))
