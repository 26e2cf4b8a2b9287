"""The layers of folds that a simulation has by default, by name."""

from __future__ import annotations

from typing import Any, Literal, get_args

from ..anatomy.face import Face
from ..errors import unknown_name
from ..layers.base import Layer
from ..layers.muscle_wrinkles import MuscleWrinkles
from ..layers.wave_folds import WaveFolds

Folds = Literal["wave", "paper"]

FOLDS: tuple[Folds, ...] = get_args(Folds)


def fold_layers(face: Face, folds: Folds, recorded: bool = False, depth: float = 1.0, **waves: Any) -> list[Layer]:
    """Return the layers of folds of a face.

    Parameters
    ----------
    face : Face
    folds : {"wave", "paper"}
        "wave": :class:`facewrinkle.WaveFolds` with the anatomical folds, which all people have at the same places, by
        formula. "paper": all lines by the papers' formula, :class:`facewrinkle.MuscleWrinkles`.
    recorded : bool
        True if a recording moves the face, from which wave folds can be found without muscles.
    depth : float
        Multiplies the depth of all folds.
    **waves
        Further parameters of :class:`facewrinkle.WaveFolds`.

    Raises
    ------
    UnknownNameError
        For folds of another name.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> [type(layer).__name__ for layer in fold_layers(fw.default_face(), "wave")]
    ['MuscleWrinkles', 'WaveFolds']
    """
    if folds not in FOLDS:
        raise unknown_name("kind of folds", folds, FOLDS)
    if folds == "paper" or not (
        recorded or face.landmarks
    ):  # without landmarks, no skin moves from which to find waves
        return [MuscleWrinkles(depth=depth)] if face.muscles else []
    layers: list[Layer] = [MuscleWrinkles(depth=depth, anatomical=True)] if face.muscles else []
    return [*layers, WaveFolds(depth, **waves)] if face.muscles or recorded else []
