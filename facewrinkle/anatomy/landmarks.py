"""Named landmarks: their symmetry, the frame and size of the face that they span, reading and writing them.

Landmarks of a pair are named ``NAME_l_PART`` or ``NAME_l`` and ``..._r...`` after the subject's own left and right.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..array_types import Array
from ..checks import vector
from ..errors import LandmarkError, MeshError, ParameterError, unknown_name, warn
from ..files import LARGEST_SETTINGS, bytes_of, write_whole
from ..geometry import unit
from ..mesh import CONNECT, Surface, closest_places

MIDLINE = [
    "trichion",
    "forehead_mid",
    "glabella",
    "sellion",
    "nasion",
    "nose_tip",
    "subnasale",
    "upper_lip_mid",
    "lower_lip_mid",
    "pogonion",
    "menton",
]
PAIRED = [
    "brow_{}_inner",
    "brow_{}_mid",
    "brow_{}_outer",
    "eye_{}_inner",
    "eye_{}_outer",
    "eye_{}_centre",
    "ala_{}",
    "mouth_{}",
    "malar_{}",
    "zygion_{}",
    "gonion_{}",
]
NAMES: tuple[str, ...] = (*MIDLINE, *(name.format(side) for name in PAIRED for side in "lr"))

MOUTH_LANDMARKS = ("mouth_l", "mouth_r", "upper_lip_mid", "lower_lip_mid")

NOT_ON_SKIN = ("eye_l_centre", "eye_r_centre")

# Geometry and expressions depend on these, and they cannot be estimated from the others. Of a pair, one is enough.
REQUIRED = (
    *(name.format(side) for name in ("eye_{}_inner", "eye_{}_outer", "mouth_{}", "brow_{}_mid") for side in "lr"),
    *("nose_tip", "upper_lip_mid", "lower_lip_mid"),
)

REFUSED = 0.60
"""A face counts as found if its likeness is at least this."""

DOUBTED = 0.75
"""On a shape with a lower likeness, all landmarks that were found are to be checked; above it, no other is tried."""

MEAN_PUPIL_DISTANCE = 63.0
"""Distance between the pupils of an adult in mm (Dodgson, "Variation and extrema of human interpupillary distance",
2004).
"""


def mirrored_name(name: str) -> str:
    """The name of a landmark's counterpart on the other side; on the midline, its own.

    Examples
    --------
    >>> mirrored_name("brow_l_inner"), mirrored_name("nose_tip")
    ('brow_r_inner', 'nose_tip')
    """
    parts = name.split("_")
    return "_".join({"l": "r", "r": "l"}.get(p, p) if i else p for i, p in enumerate(parts))


def of_side(stem: str, side: str) -> str:
    """The full name of a stem as the atlas writes it: "brow_inner" on side "l" is "brow_l_inner".

    Examples
    --------
    >>> of_side("brow_inner", "l"), of_side("mouth", "r"), of_side("menton", "l")
    ('brow_l_inner', 'mouth_r', 'menton')
    """
    if stem in MIDLINE:
        return stem
    head, _, tail = stem.partition("_")
    name = f"{head}_{side}_{tail}" if tail else f"{head}_{side}"
    if name not in NAMES:
        raise unknown_name("landmark", stem, [*MIDLINE, *(p.replace("_{}", "") for p in PAIRED)])
    return name


def lips_middle(landmarks: Mapping[str, Array]) -> Array:
    """The place (3,) where the lips meet in the middle: halfway between the middles of the two.

    Examples
    --------
    >>> lips_middle({"upper_lip_mid": np.array([0.0, -64, 20]), "lower_lip_mid": np.array([0.0, -72, 18])})
    array([  0., -68.,  19.])
    """
    return np.asarray(0.5 * (landmarks["upper_lip_mid"] + landmarks["lower_lip_mid"]))


def mouth_middle(landmarks: Mapping[str, Array]) -> Array:
    """The mean (3,) of the four landmarks of the mouth, which lies farther back than the middle of the lips.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> marks = fw.default_face().landmarks
    >>> (lips_middle(marks) - mouth_middle(marks)).round(1) + 0.0
    array([ 0. , -0.3,  6.6])
    """
    return np.asarray(0.25 * sum(landmarks[name] for name in MOUTH_LANDMARKS))


@dataclass(frozen=True, eq=False)
class FaceFrame:
    """Orthonormal axes of a face, and its size. The rows of `axes` are the subject's left, up and forward.

    Attributes
    ----------
    axes : ndarray, shape (3, 3)
    origin : ndarray, shape (3,)
        The middle between the eyes.
    pupil_distance : float
        In the unit of the landmarks.

    Examples
    --------
    The point one distance between the pupils to the left of the middle between the eyes:

    >>> frame = FaceFrame(np.eye(3), np.array([0.0, 100, 20]), 63.0)
    >>> frame.world(np.array([1.0, 0, 0]))
    array([ 63., 100.,  20.])
    """

    axes: Array
    origin: Array
    pupil_distance: float

    @property
    def scale(self) -> float:
        """A millimeter on a face of average size, in the unit of the landmarks."""
        return self.pupil_distance / MEAN_PUPIL_DISTANCE

    def local(self, points: Array) -> Array:
        """Return points (n, 3) or (3,) as [left, up, forward] from the origin, in distances between the pupils.

        Examples
        --------
        >>> frame = FaceFrame(np.eye(3), np.array([0.0, 100, 20]), 63.0)
        >>> frame.local(np.array([63.0, 100, 20])), frame.local_mm(np.array([63.0, 100, 20]))
        (array([1., 0., 0.]), array([63.,  0.,  0.]))
        """
        return np.asarray(np.einsum("...k,ik->...i", points - self.origin, self.axes) / self.pupil_distance)

    def local_mm(self, points: Array) -> Array:
        """Return :meth:`local` coordinates in millimeters on a face of average size."""
        return self.local(points) * MEAN_PUPIL_DISTANCE

    def world(self, local: Array) -> Array:
        """Return the points (n, 3) or (3,) with given :meth:`local` coordinates.

        Examples
        --------
        >>> frame = FaceFrame(np.eye(3), np.array([0.0, 100, 20]), 63.0)
        >>> frame.world(np.array([1.0, 0, 0]))
        array([ 63., 100.,  20.])
        """
        return np.asarray(self.origin + self.pupil_distance * local @ self.axes)

    def tilted(self, angle: float) -> FaceFrame:
        """Return the frame turned such that, seen along it, the face lifts its chin by an angle in degrees.

        Examples
        --------
        >>> FaceFrame(np.eye(3), np.zeros(3), 63.0).tilted(90.0).axes.round()[2].tolist()
        [0.0, -1.0, 0.0]
        """
        (left, up, forward), turn = self.axes, np.radians(angle)
        high, ahead = np.cos(turn) * up + np.sin(turn) * forward, np.cos(turn) * forward - np.sin(turn) * up
        return FaceFrame(np.array([left, high, ahead]), self.origin, self.pupil_distance)


def frame_of(landmarks: Mapping[str, Array]) -> FaceFrame:
    """The frame that eyes, mouth and nose span. The required landmarks of both sides are needed.

    Examples
    --------
    A face that lies on its back looks up:

    >>> import facewrinkle as fw
    >>> landmarks = fw.default_face().landmarks
    >>> left, up, forward = frame_of({name: np.array([x, -z, y]) for name, (x, y, z) in landmarks.items()}).axes
    >>> forward.round() + 0.0
    array([ 0., -1.,  0.])
    """
    side = {s: 0.5 * (landmarks[f"eye_{s}_inner"] + landmarks[f"eye_{s}_outer"]) for s in "lr"}
    centre = 0.5 * (side["l"] + side["r"])
    mouth = 0.5 * (landmarks["mouth_l"] + landmarks["mouth_r"])
    spans = [landmarks[n] - landmarks[mirrored_name(n)] for n in ("eye_l_outer", "eye_l_inner", "mouth_l")]
    size = float(np.linalg.norm(np.ptp([*side.values(), mouth, landmarks["nose_tip"]], axis=0)))
    left = _direction(np.sum(spans, axis=0), size)
    # The line from mouth to eyes is not upright: the corners of the mouth lie further forward than those of the eyes.
    up = centre - mouth
    up = _direction(up - (up @ left) * left, size)
    forward = np.cross(left, up)
    # The line from mouth to eyes leans back against the vertical of the face, by 0.11 to 0.19 on three mean faces.
    forward, up = forward - 0.14 * up, up + 0.14 * forward
    axes = np.array([left, up / np.linalg.norm(up), forward / np.linalg.norm(forward)])
    nose = landmarks["nose_tip"] - 0.5 * (centre + lips_middle(landmarks))
    if nose @ axes[2] < 0.0:
        raise LandmarkError(
            "the landmarks are swapped left for right, or the face is mirrored: with them the nose points into "
            "the head. Names ending in _l are the subject's own left. Swap the names, or mirror the mesh."
        )
    distance = float(
        np.linalg.norm(landmarks.get("eye_l_centre", side["l"]) - landmarks.get("eye_r_centre", side["r"]))
    )
    return FaceFrame(axes, centre, distance)


def _direction(vector: Array, size: float) -> Array:
    """The unit vector along a vector that must not be tiny relative to the size of the face."""
    length = float(np.linalg.norm(vector))
    if not length > 1e-3 * size:
        raise LandmarkError(
            "the landmarks of eyes and mouth must span the face; those given lie on a line or at one place. "
            "Check their coordinates."
        )
    return vector / length


def _pairs(landmarks: Mapping[str, Array]) -> list[tuple[str, str]]:
    """Names of the pairs of which both are there, left and right."""
    names = [(name.format("l"), name.format("r")) for name in PAIRED]
    return [(left, right) for left, right in names if left in landmarks and right in landmarks]


def mirrored(landmarks: Mapping[str, Array]) -> dict[str, Array]:
    """Return the landmarks, and mirror images of those that are missing on one side.

    The mirror plane is fitted to the pairs and midline points that are given. Without at least one pair nothing is
    mirrored.

    Examples
    --------
    The corners of the mouth give the mirror plane, by which one eye gives the other:

    >>> given = {"mouth_l": np.array([25.0, -40, 0]), "mouth_r": np.array([-25.0, -40, 0])}
    >>> mirrored(given | {"eye_l_inner": np.array([15.0, 20, -5])})["eye_r_inner"]
    array([-15.,  20.,  -5.])
    """
    found = dict(landmarks)
    pairs = [(a, b) for a, b in _pairs(found) if np.linalg.norm(found[a] - found[b]) > 0.0]
    if not pairs:
        return found
    normal = unit(np.sum([unit(found[a] - found[b]) for a, b in pairs], axis=0))
    middles = [0.5 * (found[a] + found[b]) for a, b in pairs] + [found[n] for n in MIDLINE if n in found]
    offset = float(np.median([m @ normal for m in middles]))
    for name in list(found):
        other = mirrored_name(name)
        if other not in found:
            found[other] = found[name] - 2.0 * (found[name] @ normal - offset) * normal
    return found


def complete(given: Mapping[str, Array], template: Mapping[str, Array]) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Return all landmarks: given ones as they are, the others mirrored or mapped from `template`.

    Returns
    -------
    landmarks : dict of str to ndarray, shape (3,)
    estimated : tuple of str
        The names that were not given.

    Raises
    ------
    LandmarkError
        If a landmark is missing that neither its mirror image nor the others give.

    Examples
    --------
    One landmark of each required pair, and both of one pair, give all of them:

    >>> import facewrinkle as fw
    >>> template = fw.default_face().landmarks
    >>> given = {name: template[name] for name in REQUIRED if "_r" not in name or name == "eye_r_outer"}
    >>> landmarks, estimated = complete(given, template)
    >>> len(given), len(landmarks), "mouth_r" in estimated
    (8, 33, True)
    >>> float(np.linalg.norm(landmarks["mouth_r"] - template["mouth_r"]).round(3))
    0.0
    """
    found = mirrored(given)
    missing = [n for n in REQUIRED if n not in found]
    if missing:
        raise LandmarkError(
            f"missing landmarks: {', '.join(missing)}. They cannot be estimated from the ones given "
            f"({', '.join(sorted(given)) or 'none'}). One of a pair is enough where another pair is whole."
        )
    frame = frame_of(found)
    _check_sides(found, frame)
    base = frame_of(template)
    placed = fitted_map(template, found, base, frame)
    estimated = tuple(n for n in NAMES if n not in given)
    return {n: found[n] if n in found else placed(template[n]) for n in NAMES}, estimated


def _check_sides(landmarks: Mapping[str, Array], frame: FaceFrame) -> None:
    """Raise a LandmarkError for pairs and corners that are swapped or coincide, and for eyes out of place."""
    left = frame.axes[0]
    swapped = [f"{a} and {b}" for a, b in _pairs(landmarks) if (landmarks[a] - landmarks[b]) @ left <= 0.0]
    if swapped:
        raise LandmarkError(
            f"landmarks that are swapped left for right or coincide: {'; '.join(swapped)}. Names with _l are the "
            "subject's own left."
        )
    for s, outward in (("l", left), ("r", -left)):
        inner, outer = landmarks[f"eye_{s}_inner"], landmarks[f"eye_{s}_outer"]
        if (outer - inner) @ outward <= 0.0:
            raise LandmarkError(f"eye_{s}_inner must lie nearer to the nose than eye_{s}_outer. Are they swapped?")
        centre, width = landmarks.get(f"eye_{s}_centre"), float(np.linalg.norm(outer - inner))
        if centre is not None and np.linalg.norm(centre - 0.5 * (inner + outer)) > width:
            raise LandmarkError(
                f"eye_{s}_centre must be the centre of the eyeball, within the width of the eye ({width:.3g}) from the "
                f"middle of its corners; received {centre}. Leave it out to have it estimated; if it was found about "
                "other landmarks, these make no face: check them."
            )


def fitted_map(template: Mapping[str, Array], found: Mapping[str, Array], base: FaceFrame, frame: FaceFrame) -> Any:
    """Return a smooth map of the template's space onto the face: it interpolates the landmarks that both have.

    Examples
    --------
    From the built-in head to one of twice its size:

    >>> import facewrinkle as fw
    >>> head = fw.default_face().landmarks
    >>> large = {name: 2.0 * place for name, place in head.items()}
    >>> onto_large = fitted_map(head, large, frame_of(head), frame_of(large))
    >>> onto_large(np.array([10.0, 20.0, 30.0])).round(3)
    array([20., 40., 60.])
    """
    from scipy.interpolate import RBFInterpolator

    shared = [n for n in NAMES if n in found]
    source = base.local(np.array([template[n] for n in shared]))
    target = frame.local(np.array([found[n] for n in shared]))
    warp = RBFInterpolator(source, target - source, kernel="linear", degree=1)

    def mapped(points: Array) -> Array:
        local = np.atleast_2d(base.local(points))
        return frame.world(local + warp(local)).reshape(points.shape)

    return mapped


def read_landmarks(source: str | Path | Mapping[str, npt.ArrayLike]) -> dict[str, Array]:
    """Read landmarks from a dictionary or a JSON file.

    The file holds ``{name: [x, y, z]}`` or ``{"landmarks": {name: {"xyz": [x, y, z]}}}``. Of a file in which a search
    wrote what it found (``"found": [x, y, z]`` beside "xyz"), and some were edited since, only these and those that had
    been given are read, so that the others are found anew; a file as it was written is read whole.

    Parameters
    ----------
    source : dict, str or Path

    Returns
    -------
    dict of str to ndarray, shape (3,)

    Raises
    ------
    LandmarkError
        If the file cannot be read, or a coordinate is not a finite triple.

    Warns
    -----
    FaceWrinkleWarning
        If a name is not one of :data:`NAMES`, and is left out; or if landmarks were edited.

    Examples
    --------
    >>> read_landmarks({"nose_tip": [0, 1, 2]})
    {'nose_tip': array([0., 1., 2.])}
    """
    content: Any = source
    if isinstance(source, str | Path):
        try:
            content = json.loads(bytes_of(source, LARGEST_SETTINGS, kept=False))  # it is edited, and written again
        except OSError as error:
            raise LandmarkError(f"cannot read the landmarks {str(source)!r}: {error.strerror or error}.") from None
        except (ValueError, RecursionError) as error:
            raise LandmarkError(f"{str(source)!r} is not a JSON file of landmarks: {error}.") from None
    if isinstance(content, Mapping):
        content = content.get("landmarks", content)
    if not isinstance(content, Mapping):
        raise LandmarkError(
            "landmarks must be a dictionary of names and coordinates, or a JSON file of one, received "
            f"{type(content).__name__}."
        )
    unknown = [str(unknown_name("landmark", n, NAMES)) for n in content if n not in NAMES]
    if unknown:
        warn(f"ignored: {' '.join(unknown)}")
    places = {name: _coordinates(name, value) for name, value in content.items() if name in NAMES}
    found = {name for name in places if isinstance(content[name], Mapping) and "found" in content[name]}
    edited = [name for name in found if not np.array_equal(content[name]["found"], places[name])]
    if edited and len(edited) < len(found):
        warn(f"the edited landmarks are fixed: {', '.join(sorted(edited))}. The others are detected again.")
        return {name: place for name, place in places.items() if name in edited or name not in found}
    return places


def _coordinates(name: str, value: Any) -> Array:
    xyz = value.get("xyz") if isinstance(value, Mapping) else value
    try:
        return vector(f"landmark {name!r}", xyz)
    except ParameterError as problem:
        raise LandmarkError(str(problem)) from None


def write_landmarks(
    landmarks: Mapping[str, Array],
    path: str | Path,
    estimated: Iterable[str] = (),
    confidences: Mapping[str, float] | None = None,
) -> None:
    """Write landmarks as JSON that :func:`read_landmarks` reads, with the confidence in each where it is known.

    Those with a confidence below 1 were found, and have their places twice, as "xyz" to edit and as "found".

    Examples
    --------
    >>> import tempfile
    >>> tip = {"nose_tip": np.array([0.0, 1.5, 2.0])}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_landmarks(tip, f"{folder}/landmarks.json", estimated=["nose_tip"])
    ...     read_landmarks(f"{folder}/landmarks.json")
    {'nose_tip': array([0. , 1.5, 2. ])}
    """
    guessed, known = set(estimated), confidences or {}
    entries: dict[str, dict[str, Any]] = {
        n: {"xyz": [float(c) for c in p], "estimated": n in guessed} for n, p in landmarks.items()
    }
    for name in known.keys() & entries.keys():
        entries[name]["confidence"] = round(known[name], 3)
        if known[name] < 1.0:
            entries[name]["found"] = entries[name]["xyz"]
    write_whole(path, json.dumps({"landmarks": entries}, indent=1) + "\n")


def check_on_surface(
    given: Mapping[str, Array], surface: pv.PolyData, size: float, others: Surface | None = None
) -> None:
    """Raise a LandmarkError for landmarks that lie too far from a surface, or a MeshError if they lie on the `others`
    that were set apart from it.
    """
    names = [n for n in given if n not in NOT_ON_SKIN]
    if not names:
        return
    places = np.array([given[n] for n in names])
    distance = np.linalg.norm(places - closest_places(surface, places)[1], axis=1) / size
    most = 0.2  # distances between the pupils
    off = [f"{n} ({d:.2g})" for n, d in zip(names, distance, strict=True) if d > most]
    apart = places[distance > most]
    if (
        off
        and others is not None
        and np.linalg.norm(apart - closest_places(others.mesh, apart)[1], axis=1).max() < (most * size)
    ):
        raise MeshError(
            f"the surface under the landmarks is in pieces: {', '.join(off)} lie that far from the largest, in "
            f"distances between the pupils. {CONNECT}"
        )
    if off:
        raise LandmarkError(
            f"landmarks off the mesh, with their distance from it in distances between the pupils: {', '.join(off)}; "
            f"at most {most:g} is allowed. Are mesh and landmarks in the same unit and coordinates?"
        )
