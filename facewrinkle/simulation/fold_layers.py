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


def fold_layers(
    face: Face, folds: Folds, depth: float = 1.0, inextensible: bool = True, pinch: float = 0.0, **waves: Any
) -> list[Layer]:
    """Return the layers of folds of a face; none on a surface without muscles.

    Parameters
    ----------
    face : Face
    folds : {"wave", "paper"}
        "wave": :class:`facewrinkle.WaveFolds` with the anatomical folds, which all people have at the same places, by
        formula. "paper": all lines by the papers' formula, :class:`facewrinkle.MuscleWrinkles`.
    depth : float
        Multiplies the depth of all folds.
    inextensible : bool
        If True, folds stay within what skin of fixed length can fold, whatever `depth` is.
    pinch : float
        In [0, 1]: how far skin slides into the furrows of waves and of anatomical folds; the papers' have none.
    **waves
        Further parameters of :class:`facewrinkle.WaveFolds`.

    Raises
    ------
    UnknownNameError
        For folds of another name.
    ParameterError
        For a pinch of the papers' folds, which a face without landmarks has, too.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> [type(layer).__name__ for layer in fold_layers(fw.default_face(), "wave")]
    ['MuscleWrinkles', 'WaveFolds']
    """
    if folds not in FOLDS:
        raise unknown_name("kind of folds", folds, FOLDS)
    if not face.muscles:
        return []
    if folds == "paper" or not face.landmarks:  # a surface without landmarks has no skin from which waves are found
        return [MuscleWrinkles(depth=depth, inextensible=inextensible, pinch=pinch)]
    common: dict[str, Any] = {"depth": depth, "inextensible": inextensible, "pinch": pinch}
    return [MuscleWrinkles(**common, anatomical=True), WaveFolds(**common, **waves)]
