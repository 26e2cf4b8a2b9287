"""Heads made of the built-in one that have what other people's faces have: lids with a thickness, sockets, eyeballs
before a shallow lining, shut lids, and a mouth that is a bag with gums.

What is added comes after the vertices of the built-in head, ring by ring, so tests know what each vertex is.
"""

import warnings
from functools import lru_cache, partial

import numpy as np
import pyvista as pv
from eyelids_of_faces import rims
from real_faces import built_in

import facewrinkle as fw
from facewrinkle.anatomy.face import Face
from facewrinkle.appearance.mouth import Mouth

BACK_EDGE = (1.03, 0.7)
"""The ring of the back edges of lids: its size relative to the rim, their front edge, and how far behind it, mm."""

WIDER = (1.25, 2.2)
"""The ring in which the lids of a mask end, in the same way."""

SOCKET = ((0.08, 1.03), (0.3, 1.25), (0.6, 1.3), (0.85, 1.3))
"""Rings of a socket: share of the way around the eye to its back, and distance from its centre relative to the rim."""

LINING, BALL = (0.2, 0.4, 0.6, 0.8), 0.97
"""Rings of a shallow lining: share of the way from the edges of the lids to its end; and the size of the ball."""

BAG = ((0.5, 3.0), (5.0, 4.0), (9.5, 4.0), (14.0, 4.0), (13.0, 7.0), (7.0, 7.5), (1.5, 8.0), (10.0, 14.0), (12.0, 30.0))
"""Rings of the bag: mm up and down from the lips, and back. It goes up behind the lips, and down again on the gums."""


@lru_cache(maxsize=8)
def head_with(*kinds: str) -> Face:
    """The built-in head with kinds of lids and mouth, which are the names in `MAKERS`. Not to be changed."""
    return Face.from_landmarks(fw.mesh.to_polydata(*skin_with(*kinds)), built_in().landmarks, 1.0)


@lru_cache(maxsize=4)
def head_with_balls(*kinds: str) -> Face:
    """The same with two plain spheres as eyes, fitted like a file that has all of it in one mesh."""
    mesh = fw.mesh.to_polydata(*skin_with(*kinds))
    for eye in built_in().eyes:
        mesh += pv.Sphere(radius=BALL * eye.radius, center=eye.centre, theta_resolution=24, phi_resolution=16)
    with warnings.catch_warnings(action="ignore", category=fw.FaceWrinkleWarning):  # separate parts
        return fw.fit_face(mesh, built_in().landmarks, units="mm")


@lru_cache(maxsize=1)
def half_sewn() -> tuple[Face, np.ndarray, np.ndarray]:
    """The built-in head with skin across the right half of its mouth's hole, as scans of closed mouths have; and the
    vertices of the upper and of the lower rim that are still apart, from the middle to the left corner.
    """
    face = built_in()
    loop = Mouth(face).loop
    across = (face.points[loop] - face.landmarks["upper_lip_mid"]) @ face.frame.axes[0]
    loop, across = (np.roll(each, -int(np.argmin(across))) for each in (loop, across))
    half = len(loop) // 2
    sewn = int((across[:half] < -1.0).sum())
    one, other = loop[:sewn], loop[-np.arange(sewn)]
    seam = np.append(loop[0], len(face.points) + np.arange(sewn - 1))
    triangles = [face.triangles, [[one[1], one[0], seam[1]], [seam[1], seam[0], other[1]]]]
    for a, b in ((one, seam), (seam, other)):
        triangles += [np.stack([a[2:], a[1:-1], b[1:-1]], axis=1), np.stack([a[2:], b[1:-1], b[2:]], axis=1)]
    middle = 0.5 * (face.points[one] + face.points[other])[1:]
    skin = fw.mesh.to_polydata(np.vstack([face.points, middle]), np.vstack(triangles).astype(np.int32))
    apart = np.arange(sewn + 1, half)
    return Face.from_landmarks(skin, face.landmarks, 1.0), loop[apart], loop[-apart]


def skin_with(*kinds: str) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of :func:`head_with`."""
    face = built_in()
    points, triangles = face.points, face.triangles
    for kind in kinds:
        for loop, rings, closed in MAKERS[kind](face):
            n, first = len(loop), len(points)
            number = np.concatenate([loop, np.arange(first, first + n * len(rings) + closed)])
            added = fw.geometry.ring_triangles(n, len(rings) + 1, last=n * (len(rings) + 1) if closed else None)
            triangles = np.vstack([triangles, number[added[:, [0, 2, 1]]]])
            points = np.vstack([points, *rings, *([rings[-1].mean(axis=0)[None]] if closed else [])])
    return points, triangles.astype(np.int32)


def ring(kind: str, number: int) -> np.ndarray:
    """Vertices of the rings of a number, 0 for the rims, of a head that is of this kind alone."""
    face = built_in()
    first, found = face.mesh.n_points, []
    for loop, rings, closed in MAKERS[kind](face):
        n = len(loop)
        found.append(np.asarray(loop) if number == 0 else first + np.arange((number - 1) * n, number * n))
        first += n * len(rings) + closed
    return np.concatenate(found)


def _thick(face: Face):
    """Lids that end a little behind their back edges, as those of masks do."""
    return [(rim, _behind(face, rim, BACK_EDGE, WIDER), False) for rim in rims(face)]


def _sockets(face: Face):
    """The same, and skin that goes on around the ball."""
    made = []
    for rim in rims(face):
        eye, rings = _eye_of(face, rim), _behind(face, rim, BACK_EDGE)
        offset = face.points[rim] - eye.centre
        far = np.linalg.norm(offset, axis=1, keepdims=True)
        aside = offset - np.outer(offset @ eye.gaze, eye.gaze)
        aside /= np.linalg.norm(aside, axis=1, keepdims=True)
        turn = np.arccos(offset @ eye.gaze / far[:, 0])
        for share, away in SOCKET:
            angle = (turn + share * (np.pi - turn))[:, None]
            rings.append(eye.centre + away * far * (np.cos(angle) * eye.gaze + np.sin(angle) * aside))
        made.append((rim, rings, True))
    return made


def _lined(face: Face, thick: bool, depth: float):
    """Lids, and skin that goes straight from their edges to a place behind the middle of the ball, by its radius."""
    made = []
    for rim in rims(face):
        eye, edges = _eye_of(face, rim), _behind(face, rim, BACK_EDGE) if thick else []
        end = eye.centre - depth * eye.radius * face.frame.axes[2]
        first = edges[-1] if edges else face.points[rim]
        made.append((rim, [*edges, *(first + share * (end - first) for share in LINING)], True))
    return made


def _behind(face: Face, rim: np.ndarray, *rings: tuple[float, float]) -> list[np.ndarray]:
    """Points of rings behind the rim of the opening of an eye."""
    places, back = face.points[rim], -face.frame.axes[2]
    return [places.mean(axis=0) + share * (places - places.mean(axis=0)) + mm * back for share, mm in rings]


def _eye_of(face: Face, rim: np.ndarray) -> fw.anatomy.Eyeball:
    return min(face.eyes, key=lambda eye: float(np.linalg.norm(face.points[rim].mean(axis=0) - eye.centre)))


def _shut(face: Face):
    """Lids that meet before the ball, a little off it."""
    made = []
    for rim in rims(face):
        eye = _eye_of(face, rim)
        offset = face.points[rim] - eye.centre
        rings = [share * offset + (1.0 - share) * offset.mean(axis=0) for share in (0.75, 0.5, 0.25)]
        far = np.linalg.norm(offset, axis=1, keepdims=True)
        made.append((rim, [eye.centre + far * o / np.linalg.norm(o, axis=1, keepdims=True) for o in rings], True))
    return made


def _bag(face: Face, wider: float = 0.0):
    """Skin behind the lips: back, up and down between lips and gums, back to the bite, and a throat."""
    loop = Mouth(face).loop
    side, up, ahead = face.frame.axes
    places = face.points[loop]
    high = (places - places.mean(axis=0)) @ up
    lip = (high / np.abs(high).max())[:, None]  # 1 in the middle of the upper, -1 in that of the lower, 0 between
    rings = [places + away * lip * up - back * ahead for away, back in BAG]
    rings[-1] += wider * np.outer((places - places.mean(axis=0)) @ side, side)
    return [(loop, rings, True)]


MAKERS = {
    "thick": _thick, "sockets": _sockets, "shut": _shut, "bag": _bag, "wide bag": partial(_bag, wider=0.6),
    "funnels": partial(_lined, thick=False, depth=0.0), "shallow": partial(_lined, thick=True, depth=0.0),
    "less shallow": partial(_lined, thick=True, depth=0.6),
}  # fmt: skip
"""What each kind adds: loops of vertices, points of the rings behind each, and True where a last point closes them."""
