"""The first things that a page is told: names of what sliders are for, and all that it needs to know of a face."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..anatomy.atlas import Atlas
from ..anatomy.face import Face
from ..anatomy.landmarks import NOT_ON_SKIN
from ..anatomy.muscles import JawMuscle, LinearMuscle, Muscle, SheetMuscle, SphincterMuscle
from ..errors import ParameterError
from ..geometry.normals import vertex_normals
from ..motion.action_units import ARKIT, units_of
from ..motion.recorded import Recorded
from ..plotting.views import VIEWS
from .wishes import rates_of

ALONG = (0.2, 0.35, 0.5, 0.05, 0.65, 0.8)
"""Places of a muscle's handle along its fibres, from the insertion: the first with room is taken."""

ROOM = 0.08
"""Distance of handles as seen from the front, in distances between the pupils."""


def of_atlas(atlas: Atlas) -> dict[str, Any]:
    """Return the names of expressions, action units and muscles, and which of them have two sides."""
    units = {
        name: {"about": about, "sides": f"{name}L" in atlas.action_units}
        for name, about in atlas.action_unit_names.items()
    }
    pairs: dict[str, dict[str, Any]] = {}
    for name in atlas.muscles:
        stem = name[:-2] if name.endswith(("_l", "_r")) else name
        pairs[stem] = {"sides": name != stem, "about": atlas.muscles[name]["kind"]}
    return {"expressions": list(atlas.expressions), "units": units, "muscles": pairs}


def of_face(face: Face, clip: Recorded | None = None) -> dict[str, Any]:
    """Return what a page needs to know of a face: its size, views and landmarks, and which sliders do nothing on it."""
    return {
        "views": views_of(face),
        "unit": face.unit,
        "size": face.frame.pupil_distance,
        "axes": face.frame.axes.tolist(),
        "origin": face.frame.origin.tolist(),
        "landmarks": landmarks_of(face),
        "pulls": pulls_of(face),
        "report": list(face.report),
        "likeness": face.likeness,
        "off": without_effect(face, clip),
        "clip": None if clip is None else clip.duration,
        "eyes": len(face.eyes),
    }


def without_effect(face: Face, clip: Recorded | None = None) -> dict[str, str]:
    """Return the names of expressions, action units and muscles that do nothing on a face, and why."""
    atlas = face.atlas
    off: dict[str, str] = {}
    stems = [name[:-2] if name.endswith(("_l", "_r")) else name for name in atlas.muscles]
    everything = [*atlas.expressions, *atlas.action_unit_names, *dict.fromkeys(stems)]
    if clip is not None:
        return dict.fromkeys(everything, "a recorded clip moves this face")
    if not face.muscles:
        return dict.fromkeys(everything, "this surface has no muscles")
    if not face.mouth_opens:
        off |= dict.fromkeys(("AU26", "AU27", "jaw"), "the mouth of this face has no opening")
    if not face.eyelid_openings:
        why = "the lids of this face have no opening"
        off |= dict.fromkeys(("AU5", "AU7", "AU43", "AU45", "AU46", "levator_palpebrae"), why)
    return off


def landmarks_of(face: Face) -> dict[str, dict[str, Any]]:
    """Return the landmarks on the skin, each with the vertex that it goes along with, and how sure it is."""
    found = {}
    for name, place in face.landmarks.items():
        if name not in NOT_ON_SKIN:
            vertex = int(np.argmin(np.linalg.norm(face.points - place, axis=1)))
            found[name] = {
                "place": [round(float(x), 4) for x in place],
                "vertex": vertex,
                "offset": [round(float(x), 4) for x in place - face.points[vertex]],
                "confidence": None if name not in face.confidences else round(face.confidences[name], 2),
                "estimated": name in face.estimated,
            }
    return found


def pulls_of(face: Face) -> dict[str, dict[str, Any]]:
    """Return handles of the muscles that pull at the skin: the vertex that each goes along with, and the way of a full
    pull.

    Muscles that end at one place, as at the corner of the mouth, have their handles a part of the way along their
    fibres, so that each can be taken. A sphincter is pulled from its side towards its centre, and the jaw down.
    """
    found: dict[str, dict[str, Any]] = {}
    normals = vertex_normals(face.points, face.triangles)
    front, taken = face.frame.axes[:2].T, np.empty((0, 2))  # room is what there is seen from the front
    for name, muscle in face.muscles.items():
        ends = _pull(muscle, face)
        if ends is None:
            continue
        begin, way = ends
        shares = [0.0] if isinstance(muscle, JawMuscle) else ALONG
        places = [_on_skin(begin + share * way, face, normals) for share in shares]
        room = [np.linalg.norm(taken - place @ front, axis=1).min(initial=np.inf) for _, place in places]
        enough = [k for k, apart in enumerate(room) if apart > ROOM * face.frame.pupil_distance]
        vertex, place = places[enough[0] if enough else int(np.argmax(room))]
        taken = np.vstack([taken, place @ front])
        found[name] = {"vertex": vertex, "offset": _short(place - face.points[vertex]), "pull": _short(way)}
    return found


def _pull(muscle: Muscle, face: Face) -> tuple[np.ndarray, np.ndarray] | None:
    """The place at which a muscle moves the skin, and its way; None for one that does not."""
    if isinstance(muscle, SphincterMuscle):
        return muscle.centre + muscle.semi_major * muscle.lateral, -muscle.semi_major * muscle.lateral
    if isinstance(muscle, LinearMuscle | SheetMuscle):
        begin, end = (np.reshape(x, (-1, 3)).mean(axis=0) for x in (muscle.insertion, muscle.attachment))
        return begin, end - begin
    if isinstance(muscle, JawMuscle) and "menton" in face.landmarks:
        return face.landmarks["menton"], -0.5 * face.frame.pupil_distance * face.frame.axes[1]
    return None


def _on_skin(place: np.ndarray, face: Face, normals: np.ndarray) -> tuple[int, np.ndarray]:
    """The vertex nearest to a place, and the place moved onto the skin there."""
    vertex = int(np.argmin(np.linalg.norm(face.points - place, axis=1)))
    away = place - face.points[vertex]
    return vertex, face.points[vertex] + away - (away @ normals[vertex]) * normals[vertex]


def _short(vector: np.ndarray) -> list[float]:
    return [round(float(x), 4) for x in vector]


def handles_of(data: Mapping[str, Any], face: Face) -> dict[str, dict[str, Any]]:
    """Return where patterns and tears are: the vertex that each goes along with, and how far from it."""
    found: dict[str, dict[str, Any]] = {}
    for table, key in (("patterns", "centre"), ("tears", "start")):
        found[table] = {}
        for name, entry in data[table].items():
            place = np.array(entry[key])
            vertex = int(np.argmin(np.linalg.norm(face.points - place, axis=1)))
            offset = [round(float(x), 4) for x in place - face.points[vertex]]
            found[table][name] = {"vertex": vertex, "offset": offset}
    return found


def views_of(face: Face) -> dict[str, list[float]]:
    """Cameras by name: direction towards the camera, the point that it looks at, and the height of the picture."""
    axes, size = face.frame.axes, face.frame.pupil_distance
    out = {}
    for name, view in VIEWS.items():
        focus = face.frame.origin
        if face.landmarks:
            focus = face.landmarks[view.landmark] + np.asarray(view.offset) @ axes * size
        direction = np.asarray(view.direction) @ axes
        out[name] = [*(direction / np.linalg.norm(direction)).tolist(), *focus.tolist(), view.height * size]
    return out


def mixture_of_live(weights: Mapping[str, float], face: Face) -> dict[str, float]:
    """Return a mixture of names of the atlas, or of ARKit's shapes."""
    names = {name for name in weights if name in face.atlas.action_units or name in face.atlas.muscles}
    shapes = {name: weight for name, weight in weights.items() if name not in names}
    mixture = {name: weights[name] for name in names}
    for side in ("l", "r"):
        for unit, weight in units_of(shapes, side).items():
            sided = f"{unit}{side.upper()}"
            name = sided if sided in face.atlas.action_units else unit
            if name in face.atlas.action_units:
                mixture[name] = max(mixture.get(name, 0.0), weight)
    if weights and not mixture and not any(name.startswith(tuple(ARKIT)) for name in weights):
        raise ParameterError("none of the weights is one of an action unit, a muscle or a shape of ARKit.")
    rates_of(mixture, face)
    return mixture
