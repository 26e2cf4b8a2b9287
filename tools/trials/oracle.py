"""Checks of a moved skin by its positions and the face alone, whatever moved it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import facewrinkle as fw
from facewrinkle.anatomy.landmarks import lips_middle
from facewrinkle.appearance.mouth import Mouth

from . import _oracle_kernels as kernels
from .orientation import Normals, Orientation
from .penetration import Ball, Crowns, Samples, Sheets, border_of

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.integer]

DEEPEST = 0.1
"""Skin may be this far in eyes, teeth, and the other lip or lid, mm."""

AROUND_LIPS, AROUND_TEETH = 0.35, 0.7
"""Skin within these distances from the line between the corners of the mouth is checked against the other lip, and
against the teeth; in distances between the pupils.
"""

AROUND_EYE = 1.6
"""Skin within this many radii of an eye's centre is checked against the other lid."""

AT_CORNERS = 0.25
"""At the corners of the mouth both lips go half with the mandible, up to this share more or less."""

SPACING = 1.0
"""Samples of the skin that are checked against the teeth lie at most this far apart at rest, mm."""

BEHIND_BORDER = 0.02
"""Skin that lies farther behind the outer border of the teeth at rest, relative to its half axes, is no skin before
them: it lines the mouth.
"""

STILL = 1e-3
"""A skin that has moved less than this since it was checked is not checked again, mm, unless it was near a limit."""


@dataclass(frozen=True)
class Findings:
    """Faults of one shape of the skin: triangles turned over, and the largest depths in mm beyond rest."""

    inverted: int = 0
    eyes: float = 0.0
    lips: float = 0.0
    lids: float = 0.0
    teeth: float = 0.0

    @property
    def clear(self) -> bool:
        """True if nothing is near a limit."""
        return not self.inverted and max(self.eyes, self.lips, self.lids, self.teeth) < DEEPEST - 4.0 * STILL


class Oracle:
    """All checks of the shape of a face's skin.

    Parameters
    ----------
    face : Face

    Examples
    --------
    At rest there is nothing to find; a head whose skin is pushed back by 5 mm has it in its eyes and teeth:

    >>> oracle = Oracle(fw.default_face())
    >>> oracle.findings(oracle.rest)
    Findings(inverted=0, eyes=0.0, lips=0.0, lids=0.0, teeth=0.0)
    >>> pushed = oracle.findings(oracle.rest - [0.0, 0.0, 5.0])
    >>> pushed.inverted, pushed.eyes > 1.0, pushed.lips, pushed.teeth > 1.0
    (0, True, 0.0, True)
    """

    def __init__(self, face: fw.Face) -> None:
        self.face, self.rest, self.triangles = face, face.points_mm, face.triangles
        self.orientation = Orientation(self.rest, self.triangles)
        self.balls = [
            Ball(self.rest, self.triangles, eye.centre * face.unit, eye.radius * face.unit) for eye in face.eyes
        ]
        self.lips = _lips(face, self.rest)
        self.lids = _lids(face, self.rest)
        self.teeth = _teeth(face, self.rest)
        self._before: tuple[Array, Findings] | None = None

    def findings(self, points: Array, jaw_angle: float | None = None) -> Findings:
        """Return the faults of a skin at positions (n, 3), mm."""
        if self._before is not None and self._before[1].clear:
            moved = np.abs(points - self._before[0]).max()
            if moved < STILL:
                return self._before[1]
        normals = Normals(points, self.triangles)
        found = Findings(
            len(self.orientation.turned_over(points, normals)),
            max((float(ball.depths(points).max()) for ball in self.balls), default=0.0),
            0.0 if self.lips is None else self.lips.depth(points, normals)[0],
            max((lids.depth(points, normals)[0] for lids in self.lids), default=0.0),
            max((float(depths.max(initial=0.0)) for depths in self.depths_in_teeth(points, jaw_angle)), default=0.0),
        )
        self._before = points.copy(), found
        return found

    def depths_in_teeth(self, points: Array, jaw_angle: float | None = None) -> list[Array]:
        """Return the depths of samples of the skin in both arches, the lower one where it is drawn."""
        out = []
        for crowns in self.teeth:
            if crowns.jaw == "lower" and self.face.mandible is not None:
                bone, unit = self.face.mandible, self.face.unit
                turn, hinge = bone.rotation(points / unit, jaw_angle), bone.hinge * unit
                out.append(crowns.depths(np.ascontiguousarray((points - hinge) @ turn + hinge)))
            else:
                out.append(crowns.depths(points))
        return out


def off_the_way(
    path: Array, before: Array | None = None, resting: Callable[[int], Array | None] | None = None
) -> Array:
    """Return how far (f,) a transition goes beyond its way in each frame, mm, and the vertex (f,) that does so, (f, 2).

    The way of a vertex is the ball between its displacements at the start of the transition and at its end, from pole
    to pole, widened by a fifth of the larger of the two and by half a millimeter. So no vertex goes farther out than
    1.2 times where it goes; but it may go along an arc with the jaw, or come back faster along the normal than along
    the surface. A vertex that moves as the transition starts may coast on for five frames more.

    A transition need not lead straight to its end: in each frame the skin makes for a state of rest at the present
    rates. So in a frame that is off the way to the end, the way to this state counts as well, and so it does in later
    frames. The state must not depend on the path, or what is wrong with the path would explain itself.

    Parameters
    ----------
    path : ndarray, shape (f + 1, n, 3)
        Displacements in the frame before the transition, and in all of its frames.
    before : ndarray, shape (n, 3), optional
        Displacements another frame before. Default: at rest at the start.
    resting : callable, optional
        Returns the displacements (n, 3) at rest at the rates of a frame, by its number; or None if none is known, which
        explains nothing. Default: only the end of the path counts.

    Examples
    --------
    A vertex that moves 10 mm, and another one that shoots 4 mm too far:

    >>> path = np.zeros((3, 2, 3))
    >>> path[1:, :, 0] = [[5.0, 14.0], [10.0, 10.0]]
    >>> off_the_way(path)
    array([[1.5, 1. ],
           [0. , 0. ]])

    It does not if the rates of that frame take skin to 14 mm:

    >>> off_the_way(path, resting=lambda frame: path[1])
    array([[0., 1.],
           [0., 0.]])
    """
    start, ends = path[0], [path[-1]]
    coasting = np.zeros(len(start)) if before is None else 5.0 * np.linalg.norm(start - before, axis=1)
    out, beyond = np.zeros((len(path) - 1, 2)), np.empty(len(start))
    for f, place in enumerate(path[1:]):
        beyond[:] = np.inf
        for end in ends:
            kernels.beyond_way(place, start, end, coasting, beyond)
            if beyond.max() <= 0.0:
                break
        else:
            if resting is not None and (rest := resting(f)) is not None:
                ends.append(rest)
                kernels.beyond_way(place, start, ends[-1], coasting, beyond)
        worst = int(beyond.argmax())
        out[f] = max(beyond[worst], 0.0), worst
    return out


def _from_line(points: Array, first: Array, last: Array) -> Array:
    """Distance (n,) of points from a straight piece."""
    line, offset = last - first, points - first
    share = np.clip(offset @ line / (line @ line), 0.0, 1.0)
    return np.asarray(np.linalg.norm(offset - share[:, None] * line, axis=1))


def _from_mouth(face: fw.Face, points: Array) -> Array:
    """Distance (n,) from the lines from the middle of the lips to the corners of the mouth, between pupils 1."""
    middle, size = lips_middle(face.landmarks) * face.unit, face.frame.pupil_distance * face.unit
    return np.minimum(*(_from_line(points, middle, face.landmarks[f"mouth_{s}"] * face.unit) for s in "lr")) / size


def _lips(face: fw.Face, rest: Array) -> Sheets | None:
    """The lips: the lower one is what goes with the mandible more than by half; at the corners, what looks up."""
    jaw = next((name for name, joint in face.joint_weights.items() if joint.bone), None)
    if jaw is None:
        return None
    share = np.zeros(len(rest))
    weights = face.joint_weights[jaw]
    share[weights.vertices] = weights.angles / weights.angles.max()
    near = (_from_mouth(face, rest) < AROUND_LIPS)[face.triangles].all(axis=1)
    cross = Normals(rest, face.triangles).cross
    looks_up = cross @ face.frame.axes[1] / np.maximum(np.linalg.norm(cross, axis=1), 1e-300)
    lower = share[face.triangles].mean(axis=1) > 0.5 - AT_CORNERS * looks_up
    return Sheets(rest, face.triangles, np.flatnonzero(near & ~lower), np.flatnonzero(near & lower))


def _lids(face: fw.Face, rest: Array) -> list[Sheets]:
    """The lids of the eyes that have an opening."""
    found = []
    for eye in face.eyes:
        opening = face.eyelid_openings.get(eye.side)
        if opening is None:
            continue
        along, elevation, distance = opening.polar(face.points)
        top, bottom = opening.lines(along)
        corners = face.triangles
        near = (distance < AROUND_EYE * eye.radius) & ((face.points - eye.centre) @ eye.gaze > 0.0)
        upper = (elevation - 0.5 * (top + bottom))[corners].mean(axis=1) > 0.0
        near = near[corners].all(axis=1)
        found.append(Sheets(rest, corners, np.flatnonzero(near & upper), np.flatnonzero(near & ~upper)))
    return found


def _teeth(face: fw.Face, rest: Array) -> list[Crowns]:
    """The arches that are drawn, and the skin before them."""
    near = (_from_mouth(face, rest) < AROUND_TEETH)[face.triangles].all(axis=1)
    skin = Samples.of(rest, face.triangles[near], SPACING)
    places, found = skin.places(rest), []
    for arch in getattr(Mouth(face), "teeth", ()):
        middle, axes, half = border_of(face, arch)
        flat = (places - middle) @ axes.T
        before = (np.hypot(*(flat / half).T) > 1.0 - BEHIND_BORDER) & (flat[:, 1] > 0.0)
        found.append(Crowns(face, arch, skin.chosen(before)))
    return found
