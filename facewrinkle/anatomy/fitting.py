"""Faces: the built-in one, and those fitted to any mesh."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from ..errors import LandmarkError, MeshError, ParameterError, check_name, check_positive, check_type, warn
from ..mesh import (
    MeshLike,
    Surface,
    as_texture,
    closest_places,
    merged_texture,
    outside_images,
    prepare,
    read_texture,
    surface_in,
    to_polydata,
)
from .atlas import Atlas
from .cropped_hair import beard_hairs, cropped_hair
from .face import Face
from .head import load_head
from .identity import Identity, head_of
from .landmarks import (
    DOUBTED,
    MEAN_PUPIL_DISTANCE,
    NAMES,
    NOT_ON_SKIN,
    REFUSED,
    REQUIRED,
    check_on_surface,
    complete,
    frame_of,
    mirrored,
    read_landmarks,
)
from .long_hair import BORDER, long_hair
from .parts import Part, named_parts, part_of

if TYPE_CHECKING:  # the search is loaded when a face is searched for
    from ..progress import Progress
    from .finding import Found


# --- Units ----------------------------------------------------------------------------------------------------

UNITS = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "dm": 100.0, "m": 1000.0, "in": 25.4}
"""Millimeters, by name."""

# --- Found landmarks that are to be checked ------------------------------------------------------------------

UNSURE = 0.5
"""Any that is not always estimated is, if it has a lower confidence."""


def default_face(identity: Identity | Mapping[str, float] | None = None, *, atlas: Atlas | None = None) -> Face:
    """The built-in head: 4,517 triangles, in mm, +y up, looking along +z, the subject's left at +x.

    Parameters
    ----------
    identity : Identity or dict, optional
        Whose face it is: parameters in [-1, 1] by name, such as ``{"jaw": 0.5, "age": 1.0}``. Default: the mean head.
        All have the same triangles and texture coordinates; skull, eyes and muscles follow the face.
    atlas : Atlas, optional
        Other muscles than those that come with the package.

    Returns
    -------
    Face

    Examples
    --------
    >>> face = default_face()
    >>> face.mesh.n_cells, len(face.muscles)
    (4517, 48)
    >>> bool(default_face({"width": 1.0}).mesh.bounds[1] > face.mesh.bounds[1])
    True
    """
    check_type("atlas", atlas, Atlas, optional=True)
    person = Identity.of(identity)
    head = head_of(person)
    mesh = to_polydata(head.points, head.triangles)
    mesh.active_texture_coordinates = head.uv.astype(np.float32)  # type: ignore[assignment]
    mesh.point_data["Colors"] = head.color.copy()
    landmarks = {name: point.copy() for name, point in head.landmarks.items()}
    hair = {"brows": head.brows}
    seen: dict[str, Any] = {"texture": head.texture, "bound_hair": hair, "age": person.age, "iris": person.iris}
    # Combed as far as dense hair, thin hair would bare the scalp.
    combed, border = person.hair_combed * min(1.0 + person.hair_density, 1.0), np.inf
    if person.hair_length > 0.0:
        seen["parts"] = {"hair": long_hair(head, person.hair_length, person.hair_combed)}
        combed, border = person.hair_combed, BORDER if person.hair_combed > 0.0 else 0.0
    feminine = min(person.sex, -person.child)
    if border and (cropped := cropped_hair(head, min(person.hair_length, 0.0), feminine, combed, border)):
        hair["cropped_hair"] = cropped
    if person.beard > 0.0:
        hair["beard"] = beard_hairs(head, person.beard)
    return Face.from_landmarks(mesh, landmarks, 1.0, atlas, **seen)


@lru_cache(maxsize=4)
def mean_face(atlas: Atlas) -> Face:
    """Return the mean head with the muscles of an atlas, without paint and hair, made once.

    Examples
    --------
    >>> from facewrinkle.anatomy.atlas import load_atlas
    >>> mean_face(load_atlas()) is mean_face(load_atlas())
    True
    """
    head = load_head()
    return Face.from_landmarks(to_polydata(head.points, head.triangles), head.landmarks, 1.0, atlas)


def fit_face(
    mesh: MeshLike,
    landmarks: Mapping[str, npt.ArrayLike] | str | Path | None = None,
    *,
    units: str | float | None = None,
    atlas: Atlas | None = None,
    progress: Progress | None = None,
    texture: object = None,
) -> Face:
    """Return the face of a mesh, with skull, eyes and muscles placed under it.

    Parameters
    ----------
    mesh : PolyData, or anything that `read_surface` takes
        Triangles, quads or polygons in any unit and orientation. Not changed. Where there are several parts, the one
        that the landmarks lie on is the face; the others (eyes, teeth, lashes, hair, glasses) go along with it.
    landmarks : dict, str or Path, optional
        Coordinates by name (see :data:`facewrinkle.anatomy.landmarks.NAMES`), or a JSON file. Missing ones are
        mirrored or estimated where the others suffice; otherwise they are found by the shape of the mesh
        (:func:`find_landmarks`). Those that are given are kept as they are.
    units : {"um", "mm", "cm", "dm", "m", "in"} or float, optional
        Unit of the mesh, or millimeters per unit. Default: such that the pupils are 63 mm apart, as an adult's are.
    atlas : Atlas, optional
        Other muscles than those that come with the package.
    progress : callable, optional
        Shows the progress of the search, see :func:`find_landmarks`.
    texture : path, ndarray of shape (h, w, 3), or pyvista.Texture, optional
        The photo on the mesh. Default: the image that the file names or holds.

    Returns
    -------
    Face
        In the mesh's own unit and coordinates.

    Raises
    ------
    MeshError
        If the mesh cannot be used for a face, or has no texture coordinates for a `texture` that is given.
    LandmarkError
        If no face is found where landmarks are missing; if landmarks lie off the mesh, are swapped left for right, or
        lie elsewhere than the face.

    Warns
    -----
    FaceWrinkleWarning
        If the shape that was found may be no face; for each kind of fault that was repaired (also in the face's
        `report`); if an image that the file names cannot be read.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> head = fw.default_face()
    >>> inches = head.mesh.scale(1 / 25.4)
    >>> face = fit_face(inches, {name: point / 25.4 for name, point in head.landmarks.items()}, units="in")
    >>> face.unit
    25.4
    """
    check_type("atlas", atlas, Atlas, optional=True)
    if units is not None:
        millimeters(units)  # raises before the search
    if texture is not None:
        texture = as_texture(texture)
    source = surface_in(mesh)
    given = read_landmarks(landmarks) if landmarks is not None else {}
    known, search = mirrored(given), None
    if any(name not in known for name in REQUIRED):
        search = _searched(source, given, progress)
        known = search.landmarks
    found, _ = complete(known, load_head().landmarks)
    estimated = tuple(name for name in (NAMES if search is None else search.estimated) if name not in given)
    frame = frame_of(found)
    _check_both_sides(frame.local(source.points[np.unique(source.triangles)]))
    near = np.array([p for n, p in known.items() if n not in NOT_ON_SKIN])
    clean = prepare(source, near=near, forward=frame.axes[2])
    check_on_surface(given, clean.mesh, frame.pupil_distance, clean.others)
    clean, image = _image(mesh, texture, clean)
    if search is not None:
        from .finding import rise_of_dark_bands

        rise = frame.pupil_distance * rise_of_dark_bands(clean.mesh, image, found, frame) * frame.axes[1]
        found |= {name: found[name] + rise for name in found if name.startswith("brow_") and name not in given}
    for name in set(estimated) - set(NOT_ON_SKIN):
        _, (found[name],) = closest_places(clean.mesh, found[name])
    parts, told = _parts(clean, found)
    face = Face.from_landmarks(
        clean.mesh,
        found,
        unit_of_face(units, frame.pupil_distance),
        atlas,
        estimated,
        parts,
        source_points=clean.source_points,
        confidences={} if search is None else search.confidences,
        likeness=None if search is None else search.confidence,
        report=clean.report + (outside_images(source, mesh) if texture is None else ()) + told,
        texture=image,
    ).with_lids()
    for sentence in _left_out(face):
        warn(sentence)
        face = dataclasses.replace(face, report=(*face.report, sentence))
    return face


def _left_out(face: Face) -> list[str]:
    """Sentences on the actions that the skin of a face does not allow."""
    sides = sorted({eye.side for eye in face.eyes_without_lids.values()})
    said = []
    if sides:
        which = {"l": "the left eye", "r": "the right eye", "lr": "both eyes"}["".join(sides)]
        said.append(f"The skin has no opening in front of {which} (shut, or one piece with it): the lids do not move.")
    if face.muscles and not face.mouth_opens:
        both = " that reaches both sides" if face.mouth_half_open else ""
        said.append(f"The skin has no opening between the lips{both}: the jaw stays, and the mouth does not open.")
    return said


def _parts(clean: Surface, landmarks: Mapping[str, Array]) -> tuple[dict[str, Part], tuple[str, ...]]:
    """The other parts of a face's file, by name, and sentences on them."""
    if clean.others is None:
        return {}, ()
    parts, specks = named_parts(clean.others, clean, landmarks, frame_of(landmarks))
    told = []
    if parts:
        listed = ", ".join(f"{name} ({part.mesh.n_cells})" for name, part in parts.items())
        told.append(f"Parts that are carried along, and their triangles: {listed}.")
    bare = [name for name, part in parts.items() if name.startswith("lashes") and part.lacks_picture]
    if bare:
        told.append(
            f"{', '.join(bare)} are cards without their picture: painted lashes are drawn in their place. Put the "
            "picture beside the mesh."
        )
        warn(told[-1])
    if specks:
        told.append(f"Dropped specks: {specks}.")
    return parts, tuple(told)


def _image(mesh: MeshLike, texture: object, clean: Surface) -> tuple[Surface, npt.NDArray[np.uint8] | None]:
    """The image that was given or that comes with the mesh, if there are texture coordinates; several are merged."""
    if texture is not None:
        if clean.texture is None:
            raise MeshError(
                "the mesh has no texture coordinates, by which the texture would lie on it. Export it with its UVs."
            )
        return clean, as_texture(texture)
    clean, found = merged_texture(clean)
    if found is None and clean.texture is not None and not isinstance(mesh, str | Path):
        found = read_texture(mesh)
    return clean, None if found is None else found[:, :, :3]


def _searched(source: Surface, given: Mapping[str, Array], progress: Progress | None) -> Found:
    """Landmarks found by the shape, warped to those that are given; a LandmarkError if there is no face."""
    from .finding import find_landmarks, pose_from_landmarks
    from .finding.landmarks import CHIN
    from .finding.template import UNMEASURED

    found = find_landmarks(source, progress=progress, given=given)
    likeness = np.floor(100.0 * found.confidence) / 100.0  # messages must not round it up to the limit it misses
    if found.confidence < REFUSED and pose_from_landmarks(given) is None:
        missing = [name for name in REQUIRED if name not in mirrored(given)]
        raise LandmarkError(
            f"no face was found on the mesh: likeness {likeness:.2f}, at least {REFUSED:.2f} is needed. If it "
            "has one, give landmarks: three that are not in a line say where it is, and with all of these, on one side "
            f"at least, nothing is searched: {', '.join(missing)}. Mirror half a face, and join both halves, first. "
            "Patterns and tears go on any other mesh: facewrinkle.surface(mesh)."
        )
    if found.confidence < DOUBTED:
        warn(
            f"this may not be a face: likeness {likeness:.2f}, faces have {DOUBTED:.2f} and more. Check "
            "the landmarks, and give those that are wrong."
        )
    unsure = [
        f"{name} ({value:.2f})"
        for name, value in found.confidences.items()
        if value < UNSURE and name not in given and (name in CHIN or name not in UNMEASURED)
    ]
    if unsure and found.confidence >= DOUBTED:
        warn(
            f"doubtful landmarks, with their confidence: {', '.join(unsure)}. Is the face at "
            "rest, with open eyes and its mouth closed? Check them, and give those that are wrong."
        )
    if not given:
        return found
    names = list(given)
    shift = np.array([given[name] - found.landmarks[name] for name in names]) / found.pose.size
    most = 0.5  # distances between the pupils
    far = [f"{n} ({d:.2g})" for n, d in zip(names, np.linalg.norm(shift, axis=1), strict=True) if d > most]
    if far:
        raise LandmarkError(
            "landmarks elsewhere than on the face that was found, with their distance from there in distances between "
            f"the pupils: {', '.join(far)}; at most {most:g} is allowed. Are they swapped left for right, or in "
            "another unit? If the face was not found, give all landmarks that are required."
        )
    return dataclasses.replace(
        found,
        landmarks=_warped_to(found.landmarks, names, shift, found.pose.size) | dict(given),
        confidences=found.confidences | dict.fromkeys(given, 1.0),
    )


def _warped_to(landmarks: Mapping[str, Array], names: list[str], shift: Array, size: float) -> dict[str, Array]:
    """Landmarks moved along with those whose shift is known, less with increasing distance from them."""
    from scipy.interpolate import RBFInterpolator

    at = np.array([landmarks[name] for name in names]) / size
    field = RBFInterpolator(at, shift, kernel="inverse_multiquadric", epsilon=2.0, degree=-1)
    return {name: point + size * field(point[None] / size)[0] for name, point in landmarks.items()}


def surface(
    mesh: MeshLike,
    units: str | float = "mm",
    *,
    texture: object = None,
) -> Face:
    """Return any surface as a face without anatomy: no landmarks, eyes or muscles, and no tissue under it.

    Nothing moves or folds by itself: give a simulation patterns or other `layers`, and a recording as `motion`. Muscles
    that are added (``with_muscles``) do not pull, but fold the surface where a recording compresses it.

    Parameters
    ----------
    mesh : PolyData, or anything that `read_surface` takes
        Triangles, quads or polygons, any orientation. Not changed. Of several parts the largest is the surface; the
        others go along with it.
    units : {"um", "mm", "cm", "dm", "m", "in"} or float
        Unit of the mesh, or millimeters per unit.
    texture : path, ndarray of shape (h, w, 3), or pyvista.Texture, optional
        See :func:`fit_face`.

    Returns
    -------
    Face
        In the mesh's own unit and coordinates.

    Raises
    ------
    MeshError
        If the mesh is empty or damaged, or has only one side.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> import pyvista as pv
    >>> cloth = surface(pv.Plane(i_size=3.0, j_size=2.0), units="cm")
    >>> cloth.unit, len(cloth.muscles)
    (10.0, 0)
    >>> fw.Simulation(cloth).step().n_points == cloth.mesh.n_points
    True

    A sheet that a recording makes a fifth shorter, with a muscle that folds it:

    >>> sheet = surface(pv.Plane(i_size=60.0, j_size=60.0, i_resolution=30, j_resolution=30))
    >>> muscle = fw.LinearMuscle((-25, 0, 0), (5, 0, 0), max_angle=0.6, radius=40.0, wrinkles=fw.Wrinkles(depth=2.0))
    >>> positions = np.stack([sheet.points, sheet.points * [0.8, 1.0, 1.0]])
    >>> clip = fw.Recorded.of_positions(positions, fps=2, rest=sheet.points)
    >>> sim = fw.Simulation(sheet.with_muscles({"folder": muscle}), motion=clip, time_step=0.1)
    >>> *_, frame = sim.run(6)
    >>> bool(frame["W"].min() < -0.5), float(frame["epsilon"].max().round(2))
    (True, 0.2)
    """
    source = surface_in(mesh)
    clean, image = _image(mesh, texture, prepare(source))
    face = Face.without_anatomy(clean.mesh, millimeters(units), clean.source_points)
    parts = {} if clean.others is None else {"other": part_of("other", clean.others)}
    report = clean.report + (outside_images(source, mesh) if texture is None else ())
    return dataclasses.replace(face, parts=parts, report=report, texture=image)


def millimeters(units: str | float) -> float:
    """Millimeters per unit.

    Examples
    --------
    >>> millimeters("in"), millimeters(3)
    (25.4, 3.0)
    """
    if isinstance(units, str):
        check_name("unit", units, UNITS)
        return UNITS[units]
    return check_positive("units", units, "It is a name, such as 'mm', or how many mm a unit has.")


def unit_by_size(size: float) -> str:
    """Return the unit of a mesh that is no face, by its size from corner to corner: mm, or else cm, in which it is at
    least 50 mm large, or else m.

    Examples
    --------
    A ball of radius 40, a bust 30 high, and a cow 2.1 long:

    >>> unit_by_size(139.0), unit_by_size(30.0), unit_by_size(2.1)
    ('mm', 'cm', 'm')
    """
    return next((unit for unit in ("mm", "cm") if size * UNITS[unit] >= 50.0), "m")


def unit_of_face(units: str | float | None, pupil_distance: float) -> float:
    """Millimeters per unit of a face: as given, or such that its pupils are as far apart as an adult's.

    Examples
    --------
    >>> unit_of_face(None, pupil_distance=6.3)
    10.0
    """
    if units is None:
        return MEAN_PUPIL_DISTANCE / pupil_distance
    unit = millimeters(units)
    apart = f"with units={units!r} the pupils are {pupil_distance * unit:.3g} mm apart"
    usual = "an adult's are 50 to 76"
    low, high = 1.0, 10_000.0
    if not low <= pupil_distance * unit <= high:
        raise ParameterError(
            f"{apart}; {low:g} to {high:g} is allowed, and {usual}. Leave units out to take the size from the face."
        )
    if not 30.0 <= pupil_distance * unit <= 120.0:  # a wrong unit is off by a factor of ten or more
        warn(f"{apart}; {usual}. Leave units out to take the size from the face.")
    return unit


def _check_both_sides(local: Array) -> None:
    """Raise a LandmarkError where the points of a mesh, in the frame of the face, leave out one of its sides."""
    face = local[(np.abs(local) < [1.2, 2.0, 1.2]).all(axis=1), 0]  # those around the middle between the eyes
    for side, other, across in (("left", "right", face), ("right", "left", -face)):
        if (across < -0.3).sum() < 0.02 * (across > 0.3).sum():  # beside its middle
            raise LandmarkError(
                f"by the landmarks, the mesh has only the subject's {side} side of the face; muscles need both. Mirror "
                f"it in a modeling program, join the halves, and give the landmarks of both; or check the {other} ones."
            )
