"""Labels of a picture: what each pixel shows, from the geometry that was drawn, and where landmarks are."""

from __future__ import annotations

from collections.abc import Iterable
from copy import deepcopy
from dataclasses import asdict
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.ndimage import find_objects
from scipy.spatial import cKDTree

from ..anatomy.face import Face
from ..appearance.eye import IRIS, PUPIL
from ..appearance.hair import HairCards
from ..appearance.seen import Appearance, Seen
from ..array_types import Array
from ..geometry import unit
from ..mesh.arrays import rest_of
from .furrows import DEEP, FurrowTracker, furrows_of
from .visible import Camera, Hits, TriangleBuffer

PARTS = (
    "background", "skin", "eye", "mouth", "teeth", "tongue", "brows", "lashes", "hair", "glasses", "other", "tear",
    "iris", "pupil",
)  # fmt: skip
"""Names of the numbers in the label ``part``."""

DEPTH_STEP, HEIGHT_STEP, PLACE_STEP = 0.02, 0.001, 0.01
"""Steps of the whole numbers in the labels of depth, height and place, mm."""

NO_PLACE = -(2**15)
"""The place of pixels that show no skin."""

ANCHORS = {
    "forehead": ("trichion", "forehead_mid", "brow_{}_mid trichion", "brow_{}_outer trichion"),
    "glabella": ("glabella",),
    "brow": ("brow_{}_inner", "brow_{}_mid", "brow_{}_outer"),
    "eyelids": ("eye_{}_inner", "eye_{}_outer", "eye_{}_inner eye_{}_outer"),
    "temple": ("brow_{}_outer zygion_{}", "brow_{}_outer brow_{}_outer zygion_{} trichion"),
    "nose": ("sellion", "nasion nose_tip", "nose_tip", "ala_{}", "ala_{} sellion"),
    "cheek": ("malar_{}", "zygion_{}", "malar_{} mouth_{}", "malar_{} ala_{}", "mouth_{} gonion_{}"),
    "upper lip": ("subnasale", "ala_{} mouth_{}"),
    "mouth": (
        "upper_lip_mid", "lower_lip_mid", "mouth_{}", "upper_lip_mid mouth_{}", "lower_lip_mid mouth_{}",
    ),
    "chin": ("pogonion", "menton", "mouth_{} menton"),
    "jaw": ("gonion_{}", "gonion_{} menton", "mouth_{} gonion_{} gonion_{}"),
}  # fmt: skip
"""Points that stand for each region: landmarks, or means of several; {} is either side."""

REGIONS = ("none", *ANCHORS, "elsewhere")
"""Names of the numbers in the label ``region``; "none" is no skin, "elsewhere" the rest of the head, ears and neck."""

FAR = 0.75
"""Skin further than this from all points is elsewhere, in distances between the pupils."""


def labels_of(
    face: Face,
    seen: Seen,
    frame: pv.PolyData,
    camera: Camera,
    tears: Iterable[pv.PolyData] = (),
    families: tuple[str, ...] = (),
    tracker: FurrowTracker | None = None,
) -> tuple[dict[str, npt.NDArray[Any]], dict[str, Any]]:
    """Return arrays of pixels by name, and facts for which a row of a table has room.

    Parameters
    ----------
    face : Face
    seen : Seen
        What is drawn in the frame.
    frame : PolyData
    camera : Camera
        Of the picture.
    tears : iterable of PolyData
    families : tuple of str
        Names of the families of waves.
    tracker : FurrowTracker, optional
        Of a clip: it numbers furrows as in the frame before.
    """
    buffer = TriangleBuffer(camera)
    buffer.draw(solid := solid_parts(seen, camera))
    hits, others = buffer.hits("skin"), buffer.part > 0
    pixel = float(camera.project(face.frame.origin[None])[1][0] / camera.intrinsic[0, 0])  # its width at the face
    before = {f"tear {k}": tear for k, tear in enumerate(tears)} | hair_parts(seen, pixel)
    whole = deepcopy(buffer)
    whole.draw(before)
    number, furrows = furrows_of(frame, families, face.unit)
    if tracker is not None:
        number, furrows = tracker(np.asarray(frame.point_data["rest"]), number, furrows)
    arrays = skin_labels(face, solid["skin"], hits, camera, seen.smooth.split.values(number))
    arrays["part"] = np.array([*(class_of(name) for name in (*solid, *before)), 0], np.uint8)[whole.part]
    label_irises(arrays["part"], Appearance.of(face), buffer, solid)
    facts: dict[str, Any] = {"landmarks": landmark_labels(face, frame, hits, others, camera), "furrows": []}
    highest = max((furrow.number for furrow in furrows), default=0)
    pixels = np.bincount(arrays["furrow"].ravel(), minlength=highest + 1)
    boxes = find_objects(arrays["furrow"], highest)
    for furrow in furrows:
        box = boxes[furrow.number - 1]
        corners = None if box is None else [box[1].start, box[0].start, box[1].stop, box[0].stop]
        facts["furrows"].append(asdict(furrow) | {"pixels": int(pixels[furrow.number]), "box": corners})
    facts["camera"] = {"intrinsic": camera.intrinsic.tolist(), "extrinsic": camera.extrinsic.tolist()}
    return arrays, facts


def solid_parts(seen: Seen, camera: Camera) -> dict[str, pv.PolyData]:
    """Return the meshes that hide what is behind them, the skin first, where they are in the frame."""
    eyes = seen.eyes_from(camera.place)
    on_head = {f"eye {side}": mesh for side, mesh in eyes.items() if f"eye_{side}" not in seen.own}
    on_head |= {f"skin at eye {side}": mesh for side, mesh in seen.lid_margins.items()}
    on_head |= {"mouth": seen.pocket} if seen.pocket is not None else {}
    on_head |= seen.inside_mouth
    posed = {"skin": seen.smooth.mesh} | {name: mesh for name, mesh in on_head.items() if mesh.n_cells}
    if not np.array_equal(seen.pose, np.eye(4)):
        posed |= {name: mesh.transform(seen.pose, inplace=False) for name, mesh in posed.items() if name != "skin"}
    posed |= {name: mesh for name, mesh in seen.own.items() if mesh.n_cells}
    return {name: mesh if mesh.is_all_triangles else mesh.triangulate() for name, mesh in posed.items()}


def hair_parts(seen: Seen, pixel: float) -> dict[str, pv.PolyData]:
    """Return painted hairs as ribbons that are at least a pixel wide."""
    lines = {f"lashes {side}": hair for side, hair in seen.lashes.items()} | seen.bound_hair
    found = {}
    for name, hair in lines.items():
        shape = hair.points.shape[:2]
        ribbons = HairCards(np.zeros(shape), np.zeros((shape[0], 3)), pixel).along(hair)
        found[name] = ribbons.triangulate().transform(seen.pose, inplace=False)
    return found


def label_irises(
    part: npt.NDArray[np.uint8], appearance: Appearance, buffer: TriangleBuffer, solid: dict[str, pv.PolyData]
) -> None:
    """Write iris and pupil into the parts (h, w) where they show painted eyes, by the angle to the axis of the eye."""
    for ball in appearance.balls:
        name = f"eye {ball.eye.side}"
        if name in solid and solid[name].n_points == len(ball.angles):
            hits = buffer.hits(name)
            angle, own = hits.interpolated(solid[name].point_data["angle"]), part[hits.rows, hits.columns]
            inner = np.where(angle < PUPIL, PARTS.index("pupil"), PARTS.index("iris"))
            seen = (own == PARTS.index("eye")) & (angle < IRIS)
            part[hits.rows, hits.columns] = np.where(seen, inner, own)


def class_of(name: str) -> int:
    """Return the number in :data:`PARTS` of a mesh, by its name.

    Examples
    --------
    >>> [PARTS[class_of(name)] for name in ("skin at eye l", "upper_teeth", "eye_r", "fuzz", "tear 2")]
    ['skin', 'teeth', 'eye', 'hair', 'tear']
    """
    words = ("skin", "lashes", "brows", "eye", "teeth", "tongue", "mouth", "glasses", "hair", "fuzz", "beard", "tear")
    word = next((word for word in words if word in name), "other")
    return PARTS.index({"fuzz": "hair", "beard": "hair"}.get(word, word))


def skin_labels(face: Face, skin: pv.PolyData, hits: Hits, camera: Camera, furrow: Array) -> dict[str, Any]:
    """Return depth, normals, heights, places at rest, regions and furrows, of the pixels that show skin.

    Returns
    -------
    dict of str to ndarray, shape (h, w) or (h, w, 3)
        ``depth``, uint16, in :data:`DEPTH_STEP` from the camera along its axis, 0 for no skin; ``normal``, int8,
        127 times the normal in the camera's coordinates; ``height``, int16, of wrinkles, in :data:`HEIGHT_STEP`;
        ``place``, int16, of the same point of the face at rest, in :data:`PLACE_STEP`; ``region``, uint8, in
        :data:`REGIONS`; ``furrow``, uint8, the number of
        the furrow, 0 for none.
    """
    height = hits.interpolated(np.asarray(skin.point_data["W"]))
    turned = hits.interpolated(np.asarray(skin.point_data["Normals"], dtype=np.float64) @ camera.extrinsic[:3, :3].T)
    rest = hits.interpolated(rest_of(skin))
    own = furrow[hits.corners]
    nearest = np.where(own > 0, hits.barycentric, -1.0).argmax(axis=1)
    found = {
        "depth": _whole(hits.depth * face.unit / DEPTH_STEP, np.uint16),
        "normal": _whole(127.0 * unit(turned), np.int8),
        "height": _whole(height / HEIGHT_STEP, np.int16),
        "place": _whole(rest * face.unit / PLACE_STEP, np.int16),
        "region": regions_at(face, rest),
        "furrow": _whole(np.where(height <= -DEEP, own[np.arange(len(own)), nearest], 0), np.uint8),
    }
    pixels = {}
    for name, values in found.items():
        nothing = NO_PLACE if name == "place" else 0
        pixels[name] = np.full((*camera.size[::-1], *values.shape[1:]), nothing, values.dtype)
        pixels[name][hits.rows, hits.columns] = values
    return pixels


def _whole(values: Array, kind: Any) -> npt.NDArray[Any]:
    limits = np.iinfo(kind)
    return np.clip(np.rint(values), limits.min, limits.max).astype(kind)


def landmark_labels(
    face: Face, frame: pv.PolyData, hits: Hits, others: npt.NDArray[np.bool_], camera: Camera
) -> dict[str, Any]:
    """Return each landmark's place in 3D (unit of the mesh), in pixels, and if it is seen.

    A landmark is seen if it lies in the picture and not behind the skin; a percent of the distance between the
    pupils is allowed for its slope within a pixel, and its roundness. `others` (h, w) are pixels where another part
    hides it.
    """
    places = face.landmarks_on(frame)
    pixels, distance = camera.project(np.array(list(places.values())))
    surface = np.where(others, -np.inf, np.inf)
    surface[hits.rows, hits.columns] = hits.depth
    found = {}
    for name, pixel, away in zip(places, pixels, distance, strict=True):
        column, row = np.floor(pixel).astype(int)
        inside = 0 <= row < camera.size[1] and 0 <= column < camera.size[0]
        around = surface[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
        hidden = not inside or away > np.max(around, initial=-np.inf) + 0.01 * face.frame.pupil_distance
        hidden = hidden or name.endswith("_centre")
        found[name] = {"point": places[name].tolist(), "pixel": pixel.tolist(), "visible": not hidden}
    return found


def anchors_of(face: Face) -> tuple[Array, npt.NDArray[np.uint8]]:
    """Return the points (k, 3) that stand for regions, in the unit of the face, and the numbers (k,) of these.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> points, number = anchors_of(fw.default_face())
    >>> len(points) == len(number), REGIONS[number[0]], REGIONS[number[-1]]
    (True, 'forehead', 'jaw')
    """
    points, numbers = [np.empty((0, 3))], []
    for number, entries in enumerate(ANCHORS.values(), start=1):
        for entry in entries:
            for side in "lr" if "{}" in entry else "m":
                names = entry.replace("{}", side).split()
                if all(name in face.landmarks for name in names):
                    points.append(np.mean([face.landmarks[name] for name in names], axis=0)[None])
                    numbers.append(number)
    return np.concatenate(points), np.array(numbers, np.uint8)


def regions_at(face: Face, rest: Array) -> npt.NDArray[np.uint8]:
    """Return the numbers (p,) in :data:`REGIONS` of places (p, 3) on the face at rest, in its unit.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> named = ("pogonion", "nose_tip", "gonion_l")
    >>> [REGIONS[k] for k in regions_at(face, np.array([face.landmarks[name] for name in named]))]
    ['chin', 'nose', 'jaw']
    """
    points, numbers = anchors_of(face)
    out = np.full(len(rest), REGIONS.index("elsewhere"), np.uint8)
    if len(points):
        distance, nearest = cKDTree(points).query(rest)
        near = distance < FAR * face.frame.pupil_distance
        out[near] = numbers[nearest[near]]
    return out
