"""The layers of folds that a simulation has by default, by name."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal, get_args

from ..anatomy.atlas import load_atlas, printed_atlas
from ..anatomy.face import Face
from ..errors import ParameterError, unknown_name, warn
from ..layers.base import Layer
from ..layers.creases import Creases
from ..layers.muscle_wrinkles import MuscleWrinkles
from ..layers.printed_wrinkles import PrintedWrinkles
from ..layers.wave_folds import WaveFolds
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
    if folds not in FOLDS:
        raise unknown_name("kind of folds", folds, FOLDS)
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
