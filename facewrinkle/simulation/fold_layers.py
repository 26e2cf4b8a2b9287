"""The layers of folds that a simulation has by default, by name, and the shapes that lines of folds are found from."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from ..anatomy import Atlas, Face, load_atlas, load_head, per_face, printed_atlas
from ..anatomy.fitting import mean_face
from ..animation.action_units import units_of
from ..animation.playback import Playback
from ..animation.recorded import Recorded
from ..array_types import Array
from ..checks import finite
from ..errors import ParameterError, check_name, warn
from ..layers.base import Layer
from ..layers.creases import Creases
from ..layers.muscle_wrinkles import MuscleWrinkles
from ..layers.printed_wrinkles import PrintedWrinkles
from ..layers.wave_folds import GROUPS, FoldShapes, WaveFolds
from ..layers.wave_folds.layer import Motions
from ..motion.base import Motion
from ..motion.skin import Skin
from .refinement import BENT, PRINTED, Refinement

Folds = Literal["wave", "paper", "printed"]

FOLDS: tuple[Folds, ...] = get_args(Folds)


def with_printed_muscles(face: Face) -> Face:
    """Return a face with the muscles of :func:`facewrinkle.anatomy.atlas.printed_atlas` in place of those of the
    package's own atlas; the same if it has none, or an atlas of its own.

    Muscles that were added stay, and those that were taken away stay away.

    Raises
    ------
    ParameterError
        If a muscle was changed: that change is of a muscle that folds the skin in another way. Change the one of the
        printed atlas, as in the example.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> from facewrinkle.anatomy.atlas import printed_atlas
    >>> len(with_printed_muscles(fw.default_face()).muscles)
    23
    >>> face = fw.default_face(atlas=printed_atlas())
    >>> sharper = face.with_muscles({"corrugator_l": face.muscles["corrugator_l"].replaced(alpha=3.0)})
    >>> with_printed_muscles(sharper).muscles["corrugator_l"].wrinkles.alpha
    3.0
    """
    if not face.muscles or not face.landmarks or face.atlas is not load_atlas():
        return face
    if changed := [name for name, usual in face.changed_muscles.items() if usual and name in face.muscles]:
        raise ParameterError(
            f"folds as printed need the muscles of facewrinkle.anatomy.atlas.printed_atlas(), and {changed[0]} was "
            "changed as a muscle of another atlas. Change it there: face = face.with_atlas(printed_atlas()), then "
            f'face.with_muscles({{"{changed[0]}": face.muscles["{changed[0]}"].replaced(...)}}).'
        )
    printed, known = face.with_atlas(printed_atlas()), face.atlas.muscles
    muscles = {name: muscle for name, muscle in printed.muscles.items() if name in face.muscles or name not in known}
    added = {name: muscle for name, muscle in face.muscles.items() if name not in known}
    return replace(printed, muscles=muscles | added)


def refinement_for(folds: Folds, given: Refinement | None = None) -> Refinement:
    """Return the settings for folds: those that were given, or the usual ones, with the paper's criterion (Eq. 19) for
    its folds, and wherever no other splits triangles.

    Examples
    --------
    >>> [(usual.samples, usual.gamma_c) for usual in map(refinement_for, FOLDS)]
    [(4.0, None), (4.0, 0.03), (0, 0.01)]
    """
    if given is None:
        given = PRINTED if folds == "printed" else Refinement()
    if given.gamma_c is None and (folds != "wave" or not given.samples):
        return replace(given, gamma_c=BENT)
    return given


def fold_layers(
    face: Face, folds: Folds = "wave", *, depth: float = 1.0, inextensible: bool = True, **waves: Any
) -> list[Layer]:
    """Return the layers of folds of a face; none on a surface without muscles.

    Parameters
    ----------
    face : Face
    folds : {"wave", "paper", "printed"}
        "paper": lines by the formula of Zhang, Sim and Tan, mended where it fails as printed
        (:class:`facewrinkle.MuscleWrinkles`), and the folds that all people have at the same places
        (:class:`facewrinkle.Creases`). "wave": the same creases, and lines that differ from person to person as waves
        (:class:`facewrinkle.WaveFolds`). "printed": the paper's formula as printed
        (:class:`facewrinkle.PrintedWrinkles`); the face should have the muscles of
        :func:`facewrinkle.anatomy.atlas.printed_atlas`.
    depth : float
        Multiplies the depth of all folds.
    inextensible : bool
        If True, folds stay within what skin of fixed length can fold, whatever `depth` is.
    **waves
        Further parameters of :class:`facewrinkle.WaveFolds`; the creases have its age and seed, too.

    Warns
    -----
    FaceWrinkleWarning
        If wrinkles of a muscle were changed that are drawn as waves, which have no number or depth of a muscle.

    Raises
    ------
    UnknownNameError
        For folds of another name.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> [type(layer).__name__ for layer in fold_layers(fw.default_face(), "wave")]
    ['MuscleWrinkles', 'Creases', 'WaveFolds']
    """
    check_name("kind of folds", folds, FOLDS)
    if not face.muscles:
        return []
    if folds == "printed":
        return [PrintedWrinkles()]
    common: dict[str, Any] = {"depth": depth, "inextensible": inextensible}
    if folds == "paper" or not face.landmarks:  # a surface without landmarks has no skin from which waves are found
        return [MuscleWrinkles(**common), Creases(**common)]
    for name, usual in face.changed_muscles.items():
        own = face.muscles.get(name)
        if own and usual and own.wrinkles.waves and repr(own.wrinkles) != repr(usual.wrinkles):
            warn(
                f"the wrinkles of {name} were changed, and its lines are drawn as waves, which do not depend on them. "
                "Use folds='paper', or draw its lines by formula with replaced(waves=False)."
            )
    creases = Creases(**common, age=waves.get("age"), seed=waves.get("seed", 0))
    return [MuscleWrinkles(**common, waves=False), creases, WaveFolds(**common, **waves)]


# --- shapes of a face in full motion, from which wave folds are found ----------------------------------------------


STEP, STEPS = 1.0, 3
"""Skin comes to rest within 0.1 mm in this many steps of this many seconds."""

Shapes = Mapping[str, Array]
Lines = Mapping[str, npt.NDArray[Any]]


def fold_shapes(face: Face, motion: Motion, families: Motions | None = None) -> FoldShapes:
    """Return the shapes in full motion that the lines of a face are found from, by family.

    They are those of the mean head, from which lines are carried by landmarks, but for recordings and families of
    one's own, and for faces whose muscles are not those of their atlas.

    Parameters
    ----------
    face : Face
    motion : Motion
        What moves the face: a recording is asked for its shapes or frames, anything else leaves it to the muscles.
    families : mapping, optional
        As in :class:`facewrinkle.WaveFolds`.

    Raises
    ------
    ParameterError
        If the face has neither muscles nor a recording, and families were not given as positions.
    UnknownNameError
        For the name of a motion that the atlas of the face does not have.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> list(fold_shapes(face, fw.Skin(face), {"brows": ["AU1", {"AU1": 0.5, "AU2": 1.0}]}).families)
    ['brows']
    """
    if families is not None:
        return FoldShapes({name: _named(face, name, motions) for name, motions in families.items()})
    if isinstance(motion, Playback):
        return _of_recording(motion.recorded, face)
    if not face.muscles:
        raise ParameterError(
            "WaveFolds finds its lines from the motions of a face: from its muscles, or from a recording that moves "
            "it. This surface has neither. Fit a face with landmarks, or give a recording or families of positions."
        )
    home = face if face.changed_muscles else mean_face(face.atlas)
    return per_face(home, "fold shapes", None, lambda: _of_muscles(home))


def _of_muscles(face: Face) -> FoldShapes:
    """Shapes of the action units that the atlas of a face has, and lines, if they are stored."""
    of_head = face is mean_face(face.atlas)
    return in_families(face, *((of_head and stored_folds(face.atlas)) or (relaxed_shapes(face), None)))


def in_families(face: Face, shapes: Shapes, lines: Lines | None = None) -> FoldShapes:
    """Return shapes by action unit in their groups, with the lines that were found from them."""
    families = {name: [shapes[unit] for unit in units] for name, units in unit_groups(face).items()}
    return FoldShapes(families, face, lines)


def unit_groups(face: Face) -> dict[str, dict[str, dict[str, float]]]:
    """Return the action units that the atlas of a face has, with their rates by muscle, by family.

    Of units with the same contraction, a family has the first.
    """
    own, groups = set(face.muscles), dict[str, dict[str, dict[str, float]]]()
    for name, group in GROUPS.items():
        units = groups[name] = dict[str, dict[str, float]]()
        for unit in group:
            rates = face.atlas.action_units.get(unit)
            if rates is not None and own.issuperset(rates) and rates not in units.values():
                units[unit] = rates
    return groups


def relaxed_shapes(face: Face) -> dict[str, Array]:
    """Return positions (n0, 3), mm, of skin that has come to rest, by action unit.

    It is skin of the usual material, whichever moves the face: a face has the same lines however it is moved.
    """
    skin, groups = Skin(face, STEP), unit_groups(face).values()
    return {unit: _at_rest(skin, rates) for units in groups for unit, rates in units.items()}


def _at_rest(skin: Skin, rates: Mapping[str, float]) -> Array:
    """Return positions (n0, 3), mm, of skin that has come to rest at contraction rates by muscle."""
    skin.reset()
    skin.contract(rates)
    for _ in range(STEPS):
        skin.advance()
    return skin.points + skin.displacement


def _named(face: Face, name: str, motions: object) -> list[Array]:
    """Shapes of a family that a user named."""
    if isinstance(motions, str | Mapping | np.ndarray) or not isinstance(motions, Iterable):
        raise ParameterError(f"the family {name!r} must be a list of motions, received {type(motions).__name__}.")
    out: list[Array] = []
    skin: Skin | None = None
    for each in motions:
        if isinstance(each, str | Mapping):
            if not face.muscles:
                raise ParameterError(
                    f"the family {name!r} names motions of muscles, and this face has none. Give positions of all "
                    f"{len(face.points)} vertices in their place."
                )
            skin = skin or Skin(face, STEP)
            out.append(_at_rest(skin, face.atlas.contractions(each)))
        else:
            out.append(finite(f"a motion of the family {name!r}", each) * face.unit)
    if not out:
        raise ParameterError(f"the family {name!r} has no motions. Name one at least, or leave the family out.")
    return out


def _of_recording(recorded: Recorded, face: Face) -> FoldShapes:
    """Shapes of a recording by the action units that their names stand for; otherwise by what they have in common."""
    rest, numbers = face.points, recorded.points_of(face)
    if recorded.deltas is None or recorded.bones is not None:
        frames = (recorded.positions_at(time, rest, numbers) for time in recorded.some_times.tolist())
        return FoldShapes.grouped(face, [frame * face.unit for frame in frames])
    shapes = {
        name: (rest + delta[numbers]) * face.unit for name, delta in zip(recorded.names, recorded.deltas, strict=True)
    }
    units = {name: next(iter(units_of({name: 1.0})), None) for name in shapes}
    families = {
        family: [shapes[name] for name, unit in units.items() if unit in group] for family, group in GROUPS.items()
    }
    if any(families.values()):
        return FoldShapes({name: own for name, own in families.items() if own})
    largest = np.abs(recorded.track.values).max(axis=0)
    start = rest * face.unit
    return FoldShapes.grouped(
        face, [start + w * (moved - start) for w, moved in zip(largest, shapes.values(), strict=True)]
    )


# --- the built-in head in full motion, and its lines: found in seconds, they come with the package ----------------


OF_HEAD = Path(__file__).parents[1] / "anatomy" / "data" / "folds.npz"
"""The file, which ``python -m tools.build_folds`` makes anew."""

KEY, SHAPE, LINES = "key", "shape: ", "lines: "
"""The array that tells of what atlas the others are, and beginnings of their names."""

RESOLUTION = 1e-5
"""Moves are stored as whole multiples of this, mm."""


def stored_folds(atlas: Atlas) -> tuple[Shapes, Lines] | None:
    """Return the stored shapes (n0, 3) of the mean head, mm, by action unit, and the arrays of its lines.

    None if its skin moves otherwise with the muscles of an atlas.

    Examples
    --------
    >>> from facewrinkle.anatomy.atlas import load_atlas, printed_atlas
    >>> shapes, lines = stored_folds(load_atlas())
    >>> list(shapes)[:3], lines["names"].tolist()[:2], stored_folds(printed_atlas())
    (['AU1', 'AU2', 'AU4'], ['forehead', 'brows'], None)
    """
    stored = _stored()
    if str(stored.get(KEY)) != _digest(atlas):
        return None
    shapes = {name.removeprefix(SHAPE): _shape(moves) for name, moves in stored.items() if name.startswith(SHAPE)}
    return shapes, {name.removeprefix(LINES): values for name, values in stored.items() if name.startswith(LINES)}


def store_folds(path: Path, atlas: Atlas, shapes: Shapes, lines: Callable[[Shapes], Lines]) -> None:
    """Store the shapes of the mean head with the muscles of an atlas, and the lines of these, rounded, shapes."""
    moves = {name: np.rint((at - load_head().points) / RESOLUTION).astype(np.int32) for name, at in shapes.items()}
    found = lines({name: _shape(whole) for name, whole in moves.items()})
    arrays = {SHAPE + name: whole for name, whole in moves.items()} | {LINES + name: a for name, a in found.items()}
    np.savez_compressed(path, **{KEY: np.array(_digest(atlas)), **arrays})  # type: ignore[arg-type]


def _shape(moves: npt.NDArray[np.int32]) -> Array:
    return load_head().points + RESOLUTION * moves


def _digest(atlas: Atlas) -> str:
    """A digest of what skin, muscles and action units of a face take from an atlas."""
    return hashlib.sha256(repr((atlas.muscles, atlas.action_units, atlas.tissue)).encode()).hexdigest()


@cache
def _stored() -> dict[str, npt.NDArray[Any]]:
    with np.load(OF_HEAD, allow_pickle=False) as stored:
        return dict(stored)
