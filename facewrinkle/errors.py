"""The exceptions and warnings of facewrinkle.

Every message says what is wrong, what is allowed, what was received, and how to mend it.
"""

from __future__ import annotations

import reprlib
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches

LARGEST = 1e50
"""Coordinates must be smaller than this, so that products of six of them do not overflow."""

OPTIONAL = {
    "aiohttp": ("aiohttp", "studio"),
    "anywidget": ("anywidget", "studio"),
    "distributed": ("distributed", "dataset"),
    "pyarrow": ("pyarrow", "dataset"),
    "imageio": ("imageio", "export"),
    "imageio_ffmpeg": ("imageio_ffmpeg", "export"),
    "pxr": ("usd-core", "export"),
    "DracoPy": ("DracoPy", "gltf"),
    "meshoptimizer": ("meshoptimizer", "gltf"),
}
"""Packages that a bare installation lacks, and the extras that bring them, by the names that are imported."""


class FaceWrinkleError(ValueError):
    """Input that facewrinkle cannot work with; the base of all its exceptions.

    Examples
    --------
    One name for everything that can be wrong with the input:

    >>> import facewrinkle as fw
    >>> try:
    ...     fw.default_face({"agee": 0.5})
    ... except fw.FaceWrinkleError as error:
    ...     print(f"{type(error).__name__}: {error}")
    UnknownNameError: unknown parameter of an identity 'agee'. Did you mean 'age'?
    """


class MeshError(FaceWrinkleError):
    """A mesh that cannot carry a face: empty, not finite, degenerate, non-manifold.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> import pyvista as pv
    >>> try:
    ...     fw.surface(pv.PolyData([[0.0, 0, 0], [1, 0, 0]]))
    ... except MeshError as error:
    ...     print(error)
    the mesh has 2 points and no faces. A surface is needed: export polygons (not points or lines), or reconstruct one
    with mesh.reconstruct_surface().
    """


class LandmarkError(FaceWrinkleError):
    """Landmarks that are missing, off the mesh, or swapped left for right.

    Examples
    --------
    The landmarks of a head, named after the side that the viewer sees them on:

    >>> import facewrinkle as fw
    >>> from facewrinkle.anatomy.landmarks import mirrored_name
    >>> head = fw.default_face()
    >>> try:
    ...     fw.fit_face(head.mesh, {mirrored_name(name): point for name, point in head.landmarks.items()})
    ... except LandmarkError as error:
    ...     print(error)
    the landmarks are swapped left for right, or the face is mirrored: with them the nose points into the head.
    Names ending in _l are the subject's own left. Swap the names, or mirror the mesh.
    """


class UnknownNameError(FaceWrinkleError):
    """A muscle, action unit, expression or option that does not exist.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> try:
    ...     fw.default_face().atlas.contractions("hapiness")
    ... except UnknownNameError as error:
    ...     print(error)
    unknown expression, action unit or muscle 'hapiness'. Did you mean 'happiness' or 'sadness' or 'pain'?
    """


class ParameterError(FaceWrinkleError):
    """A parameter outside the range in which its formula holds.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> try:
    ...     fw.Identity(age=70)
    ... except ParameterError as error:
    ...     print(error)
    age must lie in [-1, 1], received 70. 0 is the mean head.
    """


class OutputError(FaceWrinkleError):
    """A file or folder that cannot be written.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> try:
    ...     fw.write_mesh(fw.default_face().mesh, "head.stl")
    ... except OutputError as error:
    ...     print(error)
    the file must end in .glb or .gltf or .obj or .ply, received 'head.stl'.
    """


class MissingPackageError(FaceWrinkleError):
    """An optional package that is needed for what was asked and is not installed.

    Examples
    --------
    If imageio is not installed:

    >>> from unittest import mock
    >>> from facewrinkle.export import write_movie
    >>> with mock.patch.dict("sys.modules", {"imageio": None, "imageio.v2": None}):
    ...     try:
    ...         write_movie([], "head.mp4")
    ...     except MissingPackageError as error:
    ...         print(error)
    movies need the package imageio, which is not installed. To install it: pip install "facewrinkle[export]"
    """


class FaceWrinkleWarning(UserWarning):
    """Input that was repaired, or a result that is an estimate.

    Examples
    --------
    Collected in a list here; ``warnings.simplefilter("error", FaceWrinkleWarning)`` turns them into errors.

    >>> import warnings
    >>> from facewrinkle.anatomy.landmarks import read_landmarks
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always", FaceWrinkleWarning)
    ...     found = read_landmarks({"nose_tip": [0, 0, 1], "nose_root": [0, 1, 0]})
    >>> print(caught[0].message)
    ignored: unknown landmark 'nose_root'. Did you mean 'nose_tip' or 'eye_r_outer'?
    """


class FitWarning(FaceWrinkleWarning):
    """Points that do not determine the polynomial asked for; a simpler one was fitted."""


def warn(message: str, category: type[FaceWrinkleWarning] = FaceWrinkleWarning) -> None:
    """Warn at the line that called this package, from however deep inside the package."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals["__name__"].partition(".")[0] == __package__:
        level, frame = level + 1, frame.f_back
    warnings.warn(message, category, stacklevel=level)


def type_of(value: object) -> str:
    """Return the name of the type of a value, with its article.

    Examples
    --------
    >>> type_of(1), type_of(0.5)
    ('an int', 'a float')
    """
    name = type(value).__name__
    return f"{'an' if name[0] in 'AEIOaeio' else 'a'} {name}"


def check_type(name: str, value: object, kind: type, *, optional: bool = False) -> None:
    """Raise a ParameterError unless a value is of a type, or None where it is `optional`.

    Examples
    --------
    >>> check_type("scale", "large", float)
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: scale must be a float, received 'large'.
    """
    if not (isinstance(value, kind) or (optional and value is None)):
        article = "an" if kind.__name__[0] in "AEIOaeio" else "a"
        remedy = {
            "Face": "fit_face(mesh), read_face(path) and default_face() make one.",
            "Atlas": "read_atlas(path) reads one.",
            "Style": "facewrinkle.plotting.Style(size, view) makes one.",
            "SkinMaterial": "facewrinkle.SkinMaterial() makes one.",
            "Refinement": "facewrinkle.Refinement() makes one.",
            "Take": "read_take(path) reads one.",
            "PolyData": "Simulation(face).step() makes one.",
        }.get(kind.__name__, "")
        raise ParameterError(
            f"{name} must be {article} {kind.__name__}, received {reprlib.repr(value)}. {remedy}".rstrip()
        )


@contextmanager
def optional_imports(who: str, otherwise: str = "") -> Iterator[None]:
    """Import packages that may be missing: a :class:`MissingPackageError` then names the extra that brings them.

    Parameters
    ----------
    who : str
        Who needs them, with its verb.
    otherwise : str
        What else can be done.

    Examples
    --------
    >>> from unittest import mock
    >>> with mock.patch.dict("sys.modules", {"pxr": None}), optional_imports("USD files need", ", or write .glb."):
    ...     import pxr
    Traceback (most recent call last):
    facewrinkle.errors.MissingPackageError: USD files need the package usd-core, which is not installed. To install it:
    pip install "facewrinkle[export]", or write .glb.
    """
    try:
        yield
    except ImportError as problem:
        name = (problem.name or "").partition(".")[0]
        if name not in OPTIONAL:
            raise
        package, extra = OPTIONAL[name]
        raise MissingPackageError(
            f"{who} the package {package}, which is not installed. "
            f'To install it: pip install "facewrinkle[{extra}]"{otherwise}'
        ) from None


def unknown_name(kind: str, name: object, known: Iterable[str]) -> UnknownNameError:
    """Return the error for an unknown `name`, with the nearest known names as suggestions."""
    known = list(dict.fromkeys(known))
    folded: dict[str, list[str]] = {}  # au1 is like AU1
    for each in known:
        folded.setdefault(each.casefold(), []).append(each)
    close = [each for key in get_close_matches(str(name).casefold(), folded, n=3, cutoff=0.5) for each in folded[key]]
    if not known:
        return UnknownNameError(f"unknown {kind} {name!r}. There is none here.")
    most = 48  # names that are listed
    rest = f" and {len(known) - most} more" if len(known) > most else ""
    hint = f"Did you mean {' or '.join(repr(c) for c in close)}?"
    if not close:
        hint = f"Known are: {', '.join(known[:most])}{rest}."
    return UnknownNameError(f"unknown {kind} {name!r}. {hint}")


def check_name(kind: str, name: str, known: Iterable[str]) -> None:
    """Raise an :class:`UnknownNameError` unless a name is known.

    Examples
    --------
    >>> check_name("unit", "mmm", ("mm", "cm"))
    Traceback (most recent call last):
    facewrinkle.errors.UnknownNameError: unknown unit 'mmm'. Did you mean 'mm'?
    """
    if name not in known:
        raise unknown_name(kind, name, known)


def _number(name: str, value: float) -> float:
    """Return `value` as a float; raise a ParameterError for what is no number, such as a text, True or an array."""
    try:
        number = None if getattr(value, "ndim", 0) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = None
    if number is None or isinstance(value, str | bytes | bool):
        raise ParameterError(f"{name} must be a number, received {reprlib.repr(value)}.")
    return number


def check_range(name: str, value: float, low: float, high: float, remedy: str = "") -> float:
    """Return `value` as a float if it lies in [low, high]; raise a ParameterError otherwise, also for NaN."""
    number = _number(name, value)
    if not low <= number <= high:
        allowed = f"lie in [{low:g}, {high:g}]" if high < float("inf") else f"be at least {low:g}"
        raise ParameterError(f"{name} must {allowed}, received {number:g}. {remedy}".rstrip())
    return number


def check_ranges(thing: object, **ranges: tuple[float, float] | tuple[float, float, str]) -> None:
    """Check attributes as :func:`check_range` does: each has its range, and a remedy where there is one."""
    for name, allowed in ranges.items():
        check_range(name, getattr(thing, name), *allowed)


def check_flag(name: str, value: object) -> bool:
    """Return `value` if it is True or False; raise a ParameterError otherwise, as a text such as "no" would be true."""
    if type(value).__name__ not in ("bool", "bool_"):
        raise ParameterError(f"{name} must be True or False, received {reprlib.repr(value)}.")
    return bool(value)


def check_positive(name: str, value: float, remedy: str = "") -> float:
    """Return `value` as a float if it is finite and greater than 0; raise a ParameterError otherwise."""
    number = _number(name, value)
    if not 0.0 < number < float("inf"):
        raise ParameterError(f"{name} must be a finite number greater than 0, received {number:g}. {remedy}".rstrip())
    return number


def check_whole(name: str, value: float, low: float, high: float, remedy: str = "") -> int:
    """Return `value` as an int if it is a whole number in [low, high]; raise a ParameterError otherwise."""
    number = check_range(name, value, low, high, remedy)
    if not number.is_integer():  # nor is infinity
        raise ParameterError(f"{name} must be a whole number, received {number:g}.")
    return int(number)
