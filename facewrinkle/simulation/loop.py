"""The simulation: its motion moves the base mesh, triangles are split where layers need them, layers displace."""

from __future__ import annotations

import reprlib
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import copy
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy import EyeMuscle, Face, Mixture, gaze_of, surface
from ..animation.playback import Playback
from ..animation.recorded import Recorded
from ..array_types import Array, BoolArray, IntArray
from ..errors import ParameterError, check_name, check_range, check_type, check_whole, type_of, warn
from ..geometry import (
    Change,
    RedGreenForest,
    details_normals,
    displaced,
    interpolated,
    normalize,
    smoothstep,
    unfolded_shares,
    vertex_normals,
)
from ..layers.base import FINEST, Layer, SurfacePoints, SurfaceState, displacement_of, fields_of, over
from ..layers.compression import StrainField
from ..mesh import AGE, MeshLike
from ..motion.base import Motion, Still, check_motion, stepped
from ..motion.skin import Skin, SkinMaterial
from .fold_layers import Folds, fold_layers, fold_shapes, refinement_for, with_printed_muscles
from .frames import FrameMaker
from .refinement import (
    Refinement,
    check_wavelength,
    default_level,
    mark,
    typical_edges,
)

Shape = tuple[Array, dict[str, np.ndarray]]
"""Points of the vertices, mm, and the data of a frame at them."""


class Simulation:
    """A face, or any other surface, that moves and wrinkles.

    Parameters
    ----------
    face : Face, or any mesh that `read_surface` takes
        A mesh or a file becomes a :func:`facewrinkle.surface` in mm, which has no muscles.
    refinement : Refinement, optional
    layers : sequence of Layer, optional
        Default: the folds of `folds`. An empty list leaves the skin bare. Layers keep state, so the simulation works
        with copies of its own; they are in `layers`.
    time_step : float, optional
        Seconds per step. Default: 0.02, or the time step of `motion`.
    material : SkinMaterial, optional
        Mechanics of the default skin.
    motion : Motion or Recorded, optional
        Default: a :class:`facewrinkle.Skin`, which the muscles pull; a surface without anatomy gets
        :class:`facewrinkle.Still`.
    folds : {"wave", "paper", "printed"}
        The default layers: see :func:`facewrinkle.fold_layers`. With "printed", all is as in
        the paper of Zhang, Sim and Tan: a face with the package's own atlas gets the muscles of
        :func:`facewrinkle.anatomy.atlas.printed_atlas`, and triangles are split by Eq. 19 alone. To change the muscles
        as printed, begin with ``face.with_atlas(printed_atlas())``; changes of the package's own muscles are refused.

    Warns
    -----
    FaceWrinkleWarning
        For each pattern that the mesh cannot carry well with the highest level that was asked for, and for a mesh that
        is given without layers or a motion, as nothing happens on it.

    Raises
    ------
    ParameterError
        For a pattern that the mesh cannot carry at all, and for a motion that lacks members or is not of this face.

    Attributes
    ----------
    motion : Motion
    vertices : SurfacePoints
        The present vertices on the surface at rest.
    forest : RedGreenForest
        The present triangles.
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

    def __repr__(self) -> str:
        return f"Simulation({self.face!r}, {type(self.motion).__name__}, {len(self.layers)} layers, {self.time:g} s)"

    def __init__(
        self,
        face: Face | MeshLike,
        refinement: Refinement | None = None,
        *,
        layers: Sequence[Layer] | None = None,
        time_step: float | None = None,
        material: SkinMaterial | None = None,
        motion: Motion | Recorded | None = None,
        folds: Folds = "wave",
    ) -> None:
        check_type("refinement", refinement, Refinement, optional=True)
        self.seconds = dict.fromkeys(("precompute", "skin", "refinement", "wrinkles", "frame"), 0.0)
        if not isinstance(face, Face):
            face = surface(face)
            if layers is None and motion is None:
                warn(
                    "this surface has no muscles, and nothing will move or wrinkle. For the muscles of a face make the "
                    "simulation of facewrinkle.fit_face(mesh); for patterns give layers, and for a recording motion."
                )
        self.face = face = with_printed_muscles(face) if folds == "printed" else face
        self.refinement = refinement_for(folds, refinement)
        self._wanted: BoolArray | None = None
        self._idle: BoolArray | None = None  # the marks that triangles were split by last
        self._shaped: tuple[Any, ...] = ()  # what it was made of, the shape, and the marks
        self._late = False
        self._edges, self._level, self._asked_level = typical_edges(face), 0, self.refinement.max_level
        with self._timed("precompute"):
            self.motion = _motion(face, time_step, material, motion)
            self._use(*self._prepared(fold_layers(face, folds) if layers is None else layers))
            eye_muscles = [isinstance(face.muscles.get(name), EyeMuscle) for name in self.motion.names]
            self._eye_muscles: IntArray = np.flatnonzero(eye_muscles)
            self.reset()

    def _prepared(self, layers: Sequence[Layer]) -> tuple[list[Layer], int]:
        """Return copies of layers for this face and motion, and the highest level of refinement that they need."""
        face = self.face
        if not isinstance(layers, Sequence) or not all(isinstance(each, Layer) for each in layers):
            raise ParameterError(
                "layers must be a list of layers, such as [MuscleWrinkles()], each of a class that is derived from "
                f"facewrinkle.layers.base.Layer; received {reprlib.repr(layers)}."
            )
        own = [copy(layer) for layer in layers]
        for layer in own:
            layer.prepare(face, partial(fold_shapes, face, self.motion))
        level, needed = self._asked_level, [layer.level_needed(face) for layer in own]
        if level is None:
            most = min(max(needed, default=0), FINEST)
            # The last is for surfaces without muscles, on which no layer asks for a level.
            level = max(default_level(face, self._edges), self._level, most) or 3
        for layer, own_level in zip(own, needed, strict=True):
            layer.check_level(own_level, level)
        return own, level

    def _use(self, layers: list[Layer], level: int) -> None:
        """Take layers that are prepared, and the level that they need."""
        self.layers, self._level, self.refinement = layers, level, replace(self.refinement, max_level=level)

    def use_layers(self, layers: Sequence[Layer]) -> None:
        """Take other layers in place of the present ones; muscles, skin and time go on as they are.

        Parameters
        ----------
        layers : sequence of Layer
            The simulation works with copies. If they need smaller triangles than any before, refinement begins anew.

        Raises
        ------
        ParameterError
            For layers that the mesh cannot carry; the present ones stay.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> sim = Simulation(fw.default_face())
        >>> sim.express("surprise")
        >>> *_, wrinkled = sim.run(30)
        >>> sim.use_layers([])
        >>> smooth = sim.step()
        >>> bool(wrinkled["W"].min() < -0.2), bool(smooth["W"].any())
        (True, False)
        """
        before = self._level
        with self._timed("precompute"):
            own, level = self._prepared(layers)
            for layer in own:
                layer.attach(self.face)
            self._use(own, level)
        if level != before:
            self._begin_mesh()
        else:
            with self._timed("wrinkles"):
                for layer in own:
                    layer.follow(Change(slice(None), len(self.vertices.points)), self.vertices)
            self._wanted = None
            self._tell_age()
            self._frames.remesh()

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
            raise ParameterError(f"this simulation has no skin that muscles pull: {type_of(self.motion)} moves it.")
        return self.motion

    @property
    def time(self) -> float:
        """Seconds simulated so far."""
        return self._steps * self.motion.time_step

    @property
    def frame(self) -> pv.PolyData:
        """The frame that was made last, as :meth:`step` returned it; before the first one, a copy of the face at rest.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> sim = Simulation(fw.default_face())
        >>> sim.frame.n_cells
        4517
        >>> sim.step() is sim.frame
        True
        """
        return self.face.mesh.copy() if self._last is None else self._last

    def contract(self, rates: Mapping[str, float]) -> None:
        """Ask for contraction rates by muscle; muscles that are not named relax.

        Raises
        ------
        UnknownNameError
            For a muscle that the face does not have.
        ParameterError
            For a rate outside [0, 1], a muscle whose wrinkles are too fine for the highest level, or a motion that is
            not driven by muscles.
        """
        if rates and not self.face.muscles:
            raise ParameterError(
                f"this surface has no muscles that could make {', '.join(map(str, rates))}. Make the simulation of "
                "facewrinkle.fit_face(mesh), which finds the face on a mesh and places its muscles."
            )
        asked = self.motion.rates_of(rates)
        eyes = self._eye_muscles
        asked[eyes] = np.where(asked[eyes] > 0.0, asked[eyes], self._looked)
        for k in np.flatnonzero(asked) if self.layers and self._level else ():
            check_wavelength(self.face, self.muscles[k], self._edges[k], self._level)
        self._asked = asked

    def express(self, what: Mixture, intensity: float = 1.0) -> None:
        """Ask for an expression or action unit by name, or for a mixture of them.

        Parameters
        ----------
        what : str, list of str, or mapping of str to float
            An expression, action unit, muscle, or pair of muscles; or a mixture: a text such as "AU12=0.7+AU1", a list
            of names, or weights in [0, 1] by name, such as ``{"AU12": 0.7, "corrugator_l": 0.2}``. Commands and rigs
            take the same texts; a comma joins names as well as +.
        intensity : float
            In [0, 1]: factor for all of them.

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
        """Ask the eyes to look somewhere; the lids follow, and later expressions keep the gaze until it is changed.

        Parameters
        ----------
        yaw, pitch : float
            Degrees to the subject's left, and upwards; 0 and 0 is straight ahead.
        at : array_like, shape (3,), optional
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
        self._looked = asked[self._eye_muscles]
        self._asked = self._asked.copy()
        self._asked[self._eye_muscles] = self._looked

    # --- time ----------------------------------------------------------------------------------

    def reset(self) -> None:
        """Go back to the unrefined face at rest, all muscles relaxed."""
        self._steps = 0
        self._asked, self._looked = np.zeros(len(self.motion.names)), np.zeros(len(self._eye_muscles))
        self.motion.reset()
        self._begin_mesh()

    def _begin_mesh(self) -> None:
        """Go back to the triangles of the face, of which none is split."""
        face = self.face
        self.forest = RedGreenForest(face.triangles, self._level, face.mesh.n_points)
        self.vertices = SurfacePoints.of_forest(self.forest, self.face.points, self.face.normals)
        for layer in self.layers:
            layer.attach(face)
            layer.follow(Change(slice(None), len(face.points)), self.vertices)
        self._wanted = None
        self._frames: FrameMaker = FrameMaker(face, self.motion)
        self._last: pv.PolyData | None = None
        self._tell_age()

    def _tell_age(self) -> None:
        """Write the age of the lines to all frames; where nothing draws lines, pictures take that of the face."""
        self._frames.field_data.pop(AGE, None)
        ages = [layer.age_shown for layer in self.layers if layer.age_shown is not None]
        if ages:
            self._frames.field_data[AGE] = [max(ages)]

    def take_triangles(self, other: Simulation) -> None:
        """Go back to the face at rest, on the present triangles of another simulation of the same face.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> wrinkled, smooth = Simulation(face), Simulation(face, layers=[])
        >>> wrinkled.express("surprise")
        >>> frame = wrinkled.settle()
        >>> smooth.take_triangles(wrinkled)
        >>> smooth.forest.n_points == wrinkled.forest.n_points
        True
        """
        if not np.array_equal(other.face.triangles, self.face.triangles):
            raise ParameterError("triangles can only be taken from a simulation of the same face.")
        self.reset()
        self.forest = other.forest.copy()
        self._follow(Change(slice(None), self.forest.n_points - len(self.face.points)))

    def step(self) -> pv.PolyData:
        """Advance by one time step with the muscles as asked for.

        Returns
        -------
        PolyData
            The wrinkled face of this moment, in the unit and coordinates of the face's mesh, with the point data of
            that mesh, "Normals", and "lambda", "gamma", "epsilon" (of the dominant muscle), "W" (mm), "split_gamma",
            "muscle", "level" and "rest". Its field data "muscles" lists the muscles' names, "gaze_l" and "gaze_r" are
            the directions in which the eyes look, and "pose" is the matrix (4, 4) of a head that moves as a whole.
        """
        return self._stepped(self._asked)

    def _moved(self, rates: Array) -> Array:
        """Advance the motion alone, and return the base vertices."""
        with self._timed("skin"):
            self.motion.set_rates(rates)
            return stepped(self.motion)

    def _stepped(self, rates: Array) -> pv.PolyData:
        """Advance by one time step at contraction rates (k,)."""
        base, driven = self._moved(rates), bool(self.motion.names)
        self._steps += 1
        # Triangles change in every other frame, unless it goes far in one: a change costs as much as half a frame.
        if self._late or self._steps % 2:
            self._refine()
        shape = self._shape(base)
        # Recordings go far in one step, and patterns on a still surface begin at once: all triangles are split now.
        while not driven and (self._late or self._steps == 1) and self._refine():
            shape = self._shape(base)
        return self._frame(*shape)

    def run(
        self, frames: int | None = None, ramp: float = 0.6, *, seconds: float | None = None
    ) -> Iterator[pv.PolyData]:
        """Ramp smoothly from the present contraction to that asked for when the run began, then hold it.

        Parameters
        ----------
        frames : int, optional
            Number of steps. Default: those of `seconds`.
        ramp : float
            Share of the frames that the ramp takes, in [0, 1].
        seconds : float, optional
            In place of `frames`: how long, in simulated time. Default: 2 s.

        Yields
        ------
        PolyData
            See :meth:`step`.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> sim = Simulation(fw.default_face(), layers=[])
        >>> sum(1 for frame in sim.run(seconds=0.1)), round(sim.time, 9)
        (5, 0.1)
        """
        if frames is not None and seconds is not None:
            raise ParameterError(f"give frames or seconds, not both; received {frames!r} and {seconds!r}.")
        if frames is None:
            lasts = check_range("seconds", 2.0 if seconds is None else seconds, 0.0, 1e9)
            frames = max(round(lasts / self.motion.time_step), 1)
        frames, ramp = check_whole("frames", frames, 1, 1e9), check_range("ramp", ramp, 0.0, 1.0)
        start, target = self.motion.rates.copy(), self._asked
        for i in range(frames):
            yield self._stepped(_ramped(start, target, (i + 1) / max(ramp * frames, 1.0)))

    def settle(self, within: float = 0.01, most: int = 300) -> pv.PolyData:
        """Go straight to the face that has come to rest with the muscles as asked for: all that a still picture needs.

        Its triangles and their numbers do not depend on what came before, unless vertices keep their numbers
        (``Refinement(coarsen=False)``). Where Eq. 19 splits triangles, a motion of many steps ends with a few percent
        more of them, as those that were once split stay. Its skin may hang elsewhere after another pose, by less than
        `within`; ``sim.motion.reset()`` lets it begin at rest.

        Parameters
        ----------
        within : float
            The face is at rest once no point of the skin moves further than this in a step, in mm.
        most : int
            The most steps that are taken.

        Returns
        -------
        PolyData
            The frame at rest; see :meth:`step`.

        Warns
        -----
        FaceWrinkleWarning
            If the face still moves after `most` steps.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> sim = Simulation(fw.default_face())
        >>> sim.express("surprise")
        >>> frame = sim.settle()
        >>> still = sim.step()
        >>> float(np.abs(still.points[:2000] - frame.points[:2000]).max()) < 0.01
        True
        """
        within, most = check_range("within", within, 1e-6, 1e3, "Lengths are in mm."), check_whole("most", most, 2, 1e6)
        start, target, ramp = self.motion.rates.copy(), self._asked, 10  # steps
        base, skin = np.full_like(self.face.points, np.nan), self.motion if isinstance(self.motion, Skin) else None
        for number in range(most):
            rates = _ramped(start, target, (number + 1) / ramp)
            self._steps += 1
            if skin is not None:  # the face itself need not follow before the end
                with self._timed("skin"):
                    skin.set_rates(rates)
                    far = skin.advance()
            else:
                before, base = base, self._moved(rates).copy()
                far = np.abs(base - before).max()
            if number > ramp and far <= within:
                break
        else:
            warn(
                f"the face still moves after {most} steps. Allow more of them with most=, or more motion with within=."
            )
        if skin is not None:
            base = skin.points + skin.displacement
        if self.refinement.gamma_c is not None and self.refinement.coarsen:  # what Eq. 19 split stays else
            for _ in range(self._level):
                self._wanted = np.zeros(len(self.forest.nodes), bool)
                self._refine()
        shape = self._shape(base)
        for _ in range(2 * self._level):  # each takes triangles a level closer to those that are wanted
            if not self._refine():
                break
            shape = self._shape(base)
        if self.refinement.coarsen:
            self._follow(self.forest.sort())
            shape = self._shape(base)
        return self._frame(*shape)

    # --- one frame -----------------------------------------------------------------------------

    def _refine(self) -> bool:
        """Split and take back the triangles that the last shape marked; return False if none changed."""
        with self._timed("refinement"):
            wanted, self._wanted = self._wanted, None
            change = Change(slice(None), 0)
            if wanted is not None and wanted is not self._idle and self._level > 0:
                change = self.forest.adapt(wanted, self.refinement.coarsen)
                self._idle = wanted
        if change:
            self._follow(change)
        return bool(change)

    def _follow(self, change: Change) -> None:
        """Bring vertices and layers in step with a change of the triangles."""
        with self._timed("refinement"):
            created = SurfacePoints.of_forest(
                self.forest, self.face.points, self.face.normals, self.forest.n_points - change.n_created
            )
            self.vertices = self.vertices.followed(change.kept, created)
            self._frames.remesh()
        with self._timed("wrinkles"):
            for layer in self.layers:
                layer.follow(change, created)

    def _shape(self, base: Array) -> Shape:
        """Return the shape of the surface; mark triangles to split or take back.

        Layers without time are not asked again about a surface that has not moved since.
        """
        of = self.vertices, self.layers, base.tobytes(), self.motion.rates.tobytes()
        if self._shaped[:4] != of or not all(layer.timeless for layer in self.layers):
            self._shaped = *of, self._new_shape(base), self._wanted, self._late
        *_, shape, self._wanted, self._late = self._shaped
        return shape

    def _new_shape(self, base: Array) -> Shape:
        vertices, triangles = self.vertices, self.forest.triangles
        with self._timed("wrinkles"):
            bare = interpolated(base, vertices.corners, vertices.barycentric)
            smooth = interpolated(vertex_normals(base, self.face.triangles), vertices.corners, vertices.barycentric)
            normalize(smooth)
            state = SurfaceState(
                self.motion.rates, vertices, triangles, base, bare, self.time, lambda: StrainField.of(self.face)
            )
            added = [displacement_of(layer, state) for layer in self.layers]
            undeformed = bool(added) and all(own.undeformed for own in added)
            if undeformed:
                smooth = vertices.normals
            height = np.zeros(len(bare)) + sum(own.height for own in added)
            offset = np.zeros(len(bare)) + sum(own.shading_offset for own in added if own.shading_offset is not None)
            shares = None if undeformed else unfolded_shares(bare, height, smooth, triangles)
            if shares is not None:
                height, offset = height * shares, offset * shares
            moved = displaced(bare, height, smooth)
            blunt = [displaced(bare, height + offset, smooth)] if offset.any() else []
            normals, *others = details_normals(bare, [moved, *blunt], triangles, smooth)
            shown = others[0] if others else normals
        with self._timed("refinement"):
            self._wanted, self._late, split_gamma = mark(self.refinement, self.forest, vertices, normals, added)
        with self._timed("wrinkles"):
            data: dict[str, np.ndarray] = {"Normals": shown, "split_gamma": split_gamma}
            for layer in self.layers:
                data.update(over(data, fields_of(layer, len(moved))))
            data["W"] = height  # of all layers together
            return moved, data

    def _frame(self, points: Array, data: dict[str, np.ndarray]) -> pv.PolyData:
        with self._timed("frame"):
            self._last = self._frames.frame(points, data, self.vertices, self.forest)
        return self._last

    def fields(self, muscle: str) -> dict[str, np.ndarray]:
        """Return one muscle's own lambda, gamma, epsilon, W and region on the present mesh, also of one at rest.

        They are 0 outside of the region. W is what its own folds add; where its lines are waves, that is 0.

        Raises
        ------
        UnknownNameError
            For a muscle that the face does not have.
        """
        check_name("muscle", muscle, self.muscles)
        index = self.muscles.index(muscle)
        for layer in self.layers:
            if (found := layer.fields_of(index)) is not None:
                return found
        raise ParameterError(
            f"no layer of this simulation knows the folds over {muscle}. Add MuscleWrinkles() to its layers, or "
            "Creases() for a muscle whose folds are a Crease, or leave layers out."
        )

    @contextmanager
    def _timed(self, what: str) -> Iterator[None]:
        begin = time.perf_counter()
        yield
        self.seconds[what] += time.perf_counter() - begin


def _motion(
    face: Face, time_step: float | None, material: SkinMaterial | None, motion: Motion | Recorded | None
) -> Motion:
    """Return the given motion, if it fits the face; by default a Skin, or Still without anatomy."""
    step = check_range("time_step", 0.02 if time_step is None else time_step, 1e-9, 1e9)
    if motion is None:
        return Skin(face, step, material=material) if face.landmarks else Still(face, step)
    if material is not None:
        raise ParameterError(
            "a material is that of the default skin, and here a motion is given too. Leave one of them out."
        )
    if isinstance(motion, Recorded):
        return Playback(motion, face, step)
    check_motion(motion, face)
    if time_step not in (None, motion.time_step):
        raise ParameterError(
            f"time_step is {time_step!r}, and the motion has one of its own, {motion.time_step!r}. Leave it out here."
        )
    return motion


def _ramped(start: Array, target: Array, share: float) -> Array:
    """Return the rates after a share of a smooth ramp from one contraction to another; past its end, the target."""
    t = float(smoothstep(share))
    return target if t == 1.0 else (1.0 - t) * start + t * target
