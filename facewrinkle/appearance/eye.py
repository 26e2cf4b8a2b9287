"""Painted eyes, for faces that come without eyeballs of their own, and the flesh between lids and eyeballs."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy import Eyeball, Face
from ..anatomy.eyeball import RADIUS
from ..array_types import Array, IntArray
from ..geometry import ring_quads, ring_triangles, smoothstep, unit, vertex_normals
from ..mesh import to_polydata
from .skin_paint import flesh

PUPIL, IRIS = 9.0, 28.5
"""Angles between the axis of the eye and the borders of pupil and iris, degrees."""

ANGLES = np.concatenate([np.linspace(0.0, 8.0, 4), np.linspace(8.5, 34.0, 27), np.linspace(37.0, 97.0, 11)])
"""Angles between the axis of the eye and the rings of vertices, degrees."""

LIMBUS, CORNEA, CHAMBER, INDEX = 29.0, 0.65, 0.3, 1.336
"""Angle between the axis of the eye and the border of the cornea, degrees; the radius of its curvature, 7.8 mm, and its
distance from the iris, 3.6 mm, in radii of an adult's eye; and the index of refraction between them (Emsley's schematic
eye).
"""

SPOKES = 96
"""Vertices of each ring."""

TINTS = {
    name: np.array(color, dtype=np.float64)
    for name, color in {
        "pupil": (8, 8, 10),
        "limbus": (34, 38, 42),
        "sclera": (200, 191, 186),
        "corner": (202, 148, 138),
        "caruncle": (196, 120, 108),
        "tears": (226, 186, 180),
    }.items()
}


class PaintedEye:
    """The front of an eyeball: pupil, streaked iris, dark limbus, and a sclera that is darker below the lids.

    Parameters
    ----------
    eye : Eyeball
    face : Face

    Attributes
    ----------
    sphere, cornea : ndarray, shape (k, 3)
        Directions [aside, up, ahead] from the centre to the points of the ball, and of its normals.
    tints : ndarray, shape (k, 3)
        Colors of the points, before lids shade them and flesh covers the inner corner.
    quads : ndarray of int, shape (q, 4)
    corners : list of ndarray, shape (3,)
        Inner and outer corner between the lids, at rest.
    margins : tuple of ndarray of int, optional
        Vertices of the skin along the upper and the lower lid, if the lids are open.
    angles : ndarray, shape (n,)
        Angles between the axis of the eye and its vertices, degrees, as on the eye of an adult: :data:`PUPIL` and
        :data:`IRIS` are borders.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> PaintedEye(face.eyes[0], face).at(face.points).array_names
    ['Normals', 'paint']
    """

    def __init__(self, eye: Eyeball, face: Face) -> None:
        self.eye = eye
        opening = face.eyelid_openings.get(eye.side)
        self.margins = None if opening is None else (opening.upper, opening.lower)
        self.corners = [face.landmarks[f"eye_{eye.side}_{end}"] for end in ("inner", "outer")]
        angle, spoke = (
            grid.ravel() for grid in np.meshgrid(ANGLES, np.arange(SPOKES) * (2.0 * np.pi / SPOKES), indexing="ij")
        )
        adult = RADIUS * face.frame.pupil_distance  # irises are as large in larger eyes
        self.angles = angle * eye.radius / adult
        self.tints, self._iris = _eye_paint(self.angles, spoke, face.iris), face.iris
        self.sphere, self._adult = _directions(angle, spoke), adult / eye.radius
        bulge = 1.0 - smoothstep((angle - 25.0) / 9.0)
        self.cornea = _directions(angle * (1.0 + 0.5 * bulge), spoke)
        self.quads = ring_quads(SPOKES, len(ANGLES))[:, [0, 3, 2, 1]].astype(int)

    @property
    def open(self) -> bool:
        """True if the skin has an opening before the eye; if not, lids or an eye of the mesh cover it."""
        return self.margins is not None

    def at(self, points: Array, gaze: Array | None = None, camera: Array | None = None) -> pv.PolyData:
        """Return the eyeball, with `paint` (rgb), between the lids of a face with vertices at `points` (n, 3).

        Its normals are those of the cornea, which is more curved than the ball. For a `camera` (3,) the cornea stands
        out between the lids, and its paint is what is seen through it of the iris, which lies behind; `angle` says
        where that is, as :attr:`angles`.
        """
        gaze = self.eye.gaze if gaze is None else gaze
        eye, axes = self.eye, self.axes(gaze)
        directions = self.sphere @ axes
        heights = None if self.margins is None else self._heights(directions, points)
        places, tints, angles = self.sphere, self.tints, self.angles
        if camera is not None and heights is not None:
            # Six degrees from the margin of a lid, the cornea stands out of the ball all the way.
            rise = smoothstep(np.minimum(*heights) / 6.0) * (_out_of_ball(self.angles) - 1.0) * self._adult
            places = (1.0 + rise)[:, None] * self.sphere
            angles, spoke = self._behind_cornea(places, axes @ (camera - eye.centre) / eye.radius)
            tints = _eye_paint(angles, spoke, self._iris)
        ball = pv.PolyData.from_regular_faces(eye.centre + eye.radius * places @ axes, self.quads)
        ball.point_data["Normals"] = self.cornea @ axes
        inner = self.corners[0] - eye.centre
        from_corner = np.degrees(np.arccos(np.clip(directions @ inner / np.linalg.norm(inner), -1.0, 1.0)))
        paint = _mixed(tints, TINTS["caruncle"], 1.25 - from_corner / 11.0)
        if heights is not None:
            paint = _between_lids(paint, *heights)
        ball.point_data["paint"] = np.rint(np.clip(paint, 0.0, 255.0)).astype(np.uint8)
        if camera is not None:
            ball.point_data["angle"] = angles
        return ball

    def _behind_cornea(self, places: Array, camera: Array) -> tuple[Array, Array]:
        """Angles (k,), degrees, and spokes (k,), radians, of what a camera (3,) sees of the iris through places (k, 3).

        All are [aside, up, ahead] from the centre, in radii of the ball.
        """
        sight = unit(places - camera)
        slope = -np.minimum((sight * self.cornea).sum(axis=1), 0.0)
        bent = slope - np.sqrt(INDEX**2 - 1.0 + slope**2)
        sight += bent[:, None] * self.cornea
        iris = 1.0 + (_out_of_ball(np.zeros(1)) - 1.0 - CHAMBER) * self._adult
        way = (places[:, 2] - iris) / np.maximum(-sight[:, 2], 1e-3)
        hit = places + np.clip(way, 0.0, 2.0)[:, None] * sight
        away = np.degrees(np.arcsin(np.minimum(np.hypot(hit[:, 0], hit[:, 1]), 1.0))) / self._adult
        share = smoothstep((LIMBUS - self.angles) / 3.0)
        angles = self.angles + share * (np.minimum(away, LIMBUS) - self.angles)
        seen = self.sphere + share[:, None] * (hit - self.sphere)
        return angles, np.arctan2(seen[:, 1], seen[:, 0])

    def axes(self, gaze: Array) -> Array:
        """Return the unit vectors (3, 3) [aside, up, ahead] of the ball that looks along a gaze."""
        side = unit(np.cross(self.eye.up, gaze))
        return np.stack([side, np.cross(gaze, side), gaze])

    @cached_property
    def lid_axes(self) -> Array:
        """Unit vectors (3, 3) from the inner to the outer corner, up and forward: the last two span heights."""
        inner, outer = (corner - self.eye.centre for corner in self.corners)
        lateral = unit(outer - inner)
        up = unit(self.eye.up - (self.eye.up @ lateral) * lateral)
        return np.stack([lateral, up, self.eye.gaze - (self.eye.gaze @ lateral) * lateral])

    def lid_heights(self, points: Array, places: Array) -> Array:
        """Return the elevations (2, k), degrees, of the upper and the lower lid of a face with vertices at `points`.

        `places` (k,) are along the first of the :attr:`lid_axes`, in radii of the ball. Lids must be open.
        """
        assert self.margins is not None
        heights = []
        for margin in self.margins:
            across, upward, ahead = self.lid_axes @ (points[margin] - self.eye.centre).T
            order = np.argsort(across, kind="stable")
            elevation = np.degrees(np.arctan2(upward, ahead))
            heights.append(np.interp(places, across[order] / self.eye.radius, elevation[order]))
        return np.array(heights)

    def _heights(self, directions: Array, points: Array) -> tuple[Array, Array]:
        """How far points (k,) in directions (k, 3) are below the upper and above the lower lid, degrees."""
        lateral, up, forward = self.lid_axes
        height = np.degrees(np.arctan2(directions @ up, directions @ forward))
        upper, lower = self.lid_heights(points, directions @ lateral)
        return upper - height, height - lower


def _out_of_ball(angle: Array) -> Array:
    """Distances (k,) of cornea and ball from the centre at angles from the axis, degrees, in radii of the ball."""
    border, inside = np.radians(LIMBUS), np.radians(np.minimum(angle, LIMBUS))
    ahead = np.cos(border) - np.sqrt(CORNEA**2 - np.sin(border) ** 2)
    return np.asarray(ahead * np.cos(inside) + np.sqrt(CORNEA**2 - (ahead * np.sin(inside)) ** 2))


def _between_lids(paint: Array, below: Array, above: Array) -> Array:
    """Paint with the shadows of the lids, the wet lower margin and the flesh of the inner corner."""
    wet = 0.6 * np.exp(-((np.maximum(above, 0.0) / 2.2) ** 2))
    near, under = (np.exp(-np.maximum(below, 0.0) / reach) for reach in (4.0, 16.0))
    shade = 0.28 * near + 0.34 * under + 0.26 * np.exp(-np.maximum(above - 1.0, 0.0) / 6.0)
    lit = 1.0 - np.minimum(shade, 0.85)[:, None] * [0.92, 1.0, 1.0]
    return np.asarray((paint + wet[:, None] * (TINTS["tears"] - paint)) * lit)


def coarser(ball: pv.PolyData, step: int) -> pv.PolyData:
    """Return a painted eye with one spoke of so many, for files.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> ball = PaintedEye(face.eyes[0], face).at(face.points)
    >>> ball.n_points, coarser(ball, 2).n_points
    (4032, 2016)
    """
    kept = np.arange(len(ANGLES) * SPOKES).reshape(-1, SPOKES)[:, ::step].ravel()
    quads = ring_quads(SPOKES // step, len(ANGLES))[:, [0, 3, 2, 1]].astype(int)
    out = pv.PolyData.from_regular_faces(np.asarray(ball.points)[kept], quads)
    for name in ("Normals", "paint"):
        out.point_data[name] = np.asarray(ball.point_data[name])[kept]
    return out


def eye_paint(points: Array, eye: Eyeball, face: Face) -> npt.NDArray[np.uint8]:
    """Return the colors (n, 3) of the points (n, 3) of an eye of any shape at rest, with the iris of an adult.

    Examples
    --------
    Pupil and white of a ball:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> ball = pv.Sphere(radius=12.0, center=(30, 30, 70), direction=face.eyes[0].gaze)
    >>> paint = eye_paint(np.asarray(ball.points), face.eyes[0], face).max(axis=1)
    >>> int(paint[0]) < 20, int(paint.max()) > 200
    (True, True)
    """
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    aside, up, ahead = np.stack([np.cross(eye.up, eye.gaze), eye.up, eye.gaze]) @ (points - middle).T
    turn = np.arcsin(np.minimum(np.hypot(aside, up) / (RADIUS * face.frame.pupil_distance), 1.0))
    angle = np.degrees(np.where(ahead > 0.0, turn, np.pi - turn))
    return np.rint(np.clip(_eye_paint(angle, np.arctan2(up, aside), face.iris), 0.0, 255.0)).astype(np.uint8)


def _directions(angle: Array, spoke: Array) -> Array:
    """Unit vectors (n, 3) [aside, up, ahead] at angles from the axis, degrees, on spokes, radians."""
    away = np.sin(np.radians(angle))
    return np.stack([away * np.cos(spoke), away * np.sin(spoke), np.cos(np.radians(angle))], axis=1)


def _eye_paint(angle: Array, spoke: Array, iris_color: float) -> Array:
    """Colors (n, 3) of points at angles from the axis, degrees, on spokes, radians, of an eye from blue to brown."""
    across = np.clip((angle - PUPIL) / (IRIS - PUPIL), 0.0, 1.0)
    wave = 0.5 * np.sin(7.0 * across + 3.0 * np.sin(5.0 * spoke))
    fibers = 0.55 * np.sin(29.0 * spoke + wave) * np.sin(11.0 * spoke + 4.0 * across) + 0.45 * np.sin(
        47.0 * spoke - wave
    )
    collar = np.exp(-(((across - 0.28 - 0.05 * np.sin(9.0 * spoke)) / 0.16) ** 2))[:, None]
    # Light from above gathers in the lower half of the iris.
    glow = 0.86 + 0.24 * np.clip(-np.sin(spoke), -0.6, 1.0) * across
    pigment = min(abs(iris_color) / 0.6, 1.0)  # irises are blue below minus that, and dark brown above it
    blue, gray, brown = np.array(  # of the iris and its collar around the pupil
        [[(104, 138, 168), (132, 140, 140)], [(98, 116, 122), (128, 104, 72)], [(66, 40, 24), (88, 54, 30)]], float
    )
    ground, ring = gray + pigment * ((brown if iris_color > 0.0 else blue) - gray)
    iris = ground + 0.75 * collar * (ring - ground)
    iris = iris * ((1.0 + 0.20 * fibers) * (0.66 + 0.55 * across - 0.18 * across**4) * glow)[:, None]
    vein = smoothstep((np.sin(13.0 * spoke + 3.0 * np.sin(0.11 * angle + 4.0 * spoke)) - 0.93) / 0.07)
    red = smoothstep((angle - 36.0) / 50.0) + 0.25 * vein * smoothstep((angle - 38.0) / 14.0)
    sclera = TINTS["sclera"] + np.clip(red, 0.0, 1.0)[:, None] * (TINTS["corner"] - TINTS["sclera"])
    paint = _mixed(iris, TINTS["limbus"], 0.9 * (angle - 23.5) / 4.0)
    paint = _mixed(paint, sclera, (angle - IRIS + 1.2) / 4.2)
    return _mixed(TINTS["pupil"], paint, (angle - PUPIL) / 1.3)


def _mixed(first: Array, second: Array, t: Array) -> Array:
    """Colors (n, 3) between a first one, at t <= 0, and a second one, at t >= 1."""
    share = smoothstep(t)[:, None]
    return np.asarray(first * (1.0 - share) + second * share)


DEPTHS = np.linspace(0.0, 1.0, 5)
"""Depths of the rings of vertices, from the rim (0) to the end (1)."""


class LidMargin:
    """A strip of flesh that leads from the rim of the hole before an eye into the ball.

    Without it, one would look into the dark wherever the lids do not touch the ball, above all in the corners.

    Parameters
    ----------
    eye : Eyeball
    face : Face

    Attributes
    ----------
    loop : ndarray of int
        Vertices of the rim in order; empty where the skin goes on behind the lids, or the ball fills the hole.

    Examples
    --------
    The balls of the built-in face fill their holes; smaller ones would not:

    >>> import facewrinkle as fw
    >>> from dataclasses import replace
    >>> face = fw.default_face()
    >>> eye = face.eyes[0]
    >>> small = LidMargin(replace(eye, radius=0.9 * eye.radius), face)
    >>> len(LidMargin(eye, face).loop), small.at(face.points).n_open_edges == 2 * len(small.loop)
    (0, True)
    """

    def __init__(self, eye: Eyeball, face: Face) -> None:
        self.eye = eye
        loop: IntArray = face.lid_rims.get(eye.side, np.empty(0, np.int32))
        farthest = np.linalg.norm(face.points[loop] - eye.centre, axis=1).max(initial=0.0)
        self.loop = loop if farthest > 1.05 * eye.radius else loop[:0]  # else the ball fills the hole
        n = len(self.loop)
        self._triangles = ring_triangles(n, len(DEPTHS))[:, [0, 2, 1]]
        self._paint = np.rint(flesh(np.repeat(DEPTHS, n))).astype(np.uint8)

    def at(self, points: Array) -> pv.PolyData:
        """Return the strip, with `paint` (rgb), between the lids of a face with vertices at `points` (n, 3)."""
        offset = points[self.loop] - self.eye.centre
        distance = np.linalg.norm(offset, axis=1, keepdims=True)
        end = np.minimum(0.96 * self.eye.radius, distance - 0.02 * self.eye.radius)
        away = distance + DEPTHS[:, None, None] * (end - distance)
        strip = (self.eye.centre + away * (offset / distance)).reshape(-1, 3)
        mesh = to_polydata(strip, self._triangles)
        mesh.point_data["Normals"] = vertex_normals(strip, self._triangles)
        mesh.point_data["paint"] = self._paint
        return mesh
