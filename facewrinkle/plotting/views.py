"""Views of a camera, the style of a picture, and the camera and lights that these give a plotter."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pyvista as pv

from ..anatomy import NAMES, Face, mirrored_name
from ..array_types import Array
from ..errors import ParameterError, check_name, check_range, check_whole
from ..geometry import unit, vertex_areas


@dataclass(frozen=True)
class View:
    """Place of the camera in front of any face or other surface, by its axes and landmarks.

    Attributes
    ----------
    direction : tuple of float
        Direction [to the subject's left, up, forward] towards the camera, from the point that it looks at.
    landmark : str, optional
        Name of the landmark at or near that point. None: the middle between the eyes, or of a surface that is no face.
    offset : tuple of float
        From the landmark to the point that the camera looks at, along the same axes, in distances between the pupils
        (of a surface that is no face: in fifths of its diagonal).
    height : float
        Height of the picture there, in the same unit.

    Examples
    --------
    >>> near = View((0.5, 0.0, 1.0), "mouth_l", height=1.2)
    >>> near.mirrored().landmark
    'mouth_r'
    """

    direction: tuple[float, float, float]
    landmark: str | None = "nose_tip"
    offset: tuple[float, float, float] = (0.0, 0.2, -1.6)
    height: float = 4.5

    def __post_init__(self) -> None:
        for name in ("direction", "offset"):
            if np.shape(getattr(self, name)) != (3,):
                raise ParameterError(f"{name} must be three numbers, received {getattr(self, name)!r}.")
        if not np.hypot(self.direction[0], self.direction[2]) > 1e-6 * abs(self.direction[1]):
            raise ParameterError(f"direction must not be zero or straight up or down, received {self.direction!r}.")
        if self.landmark is not None:
            check_name("landmark", self.landmark, NAMES)
        check_range("height", self.height, 1e-3, 1e3)

    def mirrored(self) -> View:
        """Return the same view from the other side of the face."""
        (x, y, z), (u, v, w) = self.direction, self.offset
        landmark = None if self.landmark is None else mirrored_name(self.landmark)
        return View((-x, y, z), landmark, (-u, v, w), self.height)

    def focus(self, face: Face) -> Array:
        """Return the point (3,) that the camera looks at.

        A view that names a landmark looks at the middle of a surface that has none.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> bool((View((0, 0, 1), "nose_tip", (0, 0, 0)).focus(face) == face.landmarks["nose_tip"]).all())
        True
        """
        if self.landmark is not None and not face.landmarks:
            return face.frame.origin
        base = face.frame.origin if self.landmark is None else face.landmarks[self.landmark]
        return np.asarray(base + np.asarray(self.offset) @ face.frame.axes * face.frame.pupil_distance)


_LEFT = {
    "left_three_quarter": View((0.72, 0.08, 0.8)),
    "left_profile": View((1.0, 0.0, 0.02)),
    "left_eye": View((0.75, 0.05, 0.8), "eye_l_outer", (0.05, 0.0, 0.0), 1.05),
    "left_mouth": View((0.55, 0.0, 1.0), "mouth_l", (0.1, 0.1, 0.0), 1.4),
}

CLOSE: dict[str, View] = {
    "forehead": View((0.12, 0.1, 1.0), "glabella", (0.0, 0.26, -0.2), 1.36),
    "glabella": View((0.1, 0.05, 1.0), "glabella", (0.0, 0.08, -0.1), 1.05),
    "nose": View((0.35, 0.05, 1.0), "nose_tip", (0.0, 0.3, -0.2), 1.0),
    "cheeks": View((0.2, 0.02, 1.0), "nose_tip", (0.0, 0.0, -0.4), 2.1),
    "mouth": View((0.2, 0.0, 1.0), "upper_lip_mid", (0.0, -0.12, -0.2), 1.3),
    "chin": View((0.25, 0.0, 1.0), "pogonion", (0.0, 0.05, -0.1), 1.1),
    "left_eye": _LEFT["left_eye"],
    "right_eye": _LEFT["left_eye"].mirrored(),
    "left_mouth": _LEFT["left_mouth"],
    "right_mouth": _LEFT["left_mouth"].mirrored(),
}
"""Close-ups of places where wrinkles are."""

VIEWS: dict[str, View] = {
    "front": View((0.0, 0.02, 1.0)),
    **_LEFT,
    **{name.replace("left", "right"): view.mirrored() for name, view in _LEFT.items()},
    **CLOSE,
}
"""All views that have a name."""

VIEW_ANGLE = 15.0
"""Angle of the camera from the lower to the upper border of the picture, degrees."""

Lamp = tuple[tuple[float, float, float], tuple[float, float, float], float]

LIGHTS: tuple[Lamp, ...] = (
    ((-0.85, 0.8, 0.62), (1.0, 0.94, 0.86), 1.2),
    ((0.75, -0.05, 0.8), (1.0, 0.94, 0.88), 0.24),
    ((0.85, 0.35, -0.5), (1.0, 0.97, 0.92), 1.1),
)
"""A warm key light, a fill light, warm as what a room throws back of it, and a rim light.

Each is a direction [right, up, towards the camera], a color and an intensity.
"""


@dataclass(frozen=True)
class Style:
    """Size, view and content of a picture.

    Attributes
    ----------
    size : tuple of int
        Width and height, pixels.
    view : str or View
        A view, or the name of one in :data:`VIEWS`.
    wireframe : bool
        Draw the edges of the triangles.
    scalars : str, optional
        Color by this array of the frame in place of skin.
    eyes, brows : bool
        Draw eyes; draw brows and lashes.
    clay : bool
        Show skin and eyes in the color of clay, without brows, lashes and the face's own colors.
    quick : bool
        One headlight and no anti-aliasing.
    microrelief : bool
        Draw pores and fine furrows of the skin, where a pixel is small enough to show them; not in quick pictures.
    follow : bool
        Move the camera along with a head that moves as a whole.

    Examples
    --------
    >>> near = Style(size=(640, 480), view="left_eye", wireframe=True)
    >>> heights = Style(view=View((0.0, 0.0, 1.0), "glabella", height=1.5), scalars="W")
    """

    size: tuple[int, int] = (800, 800)
    view: str | View = "front"
    wireframe: bool = False
    scalars: str | None = None
    eyes: bool = True
    brows: bool = True
    clay: bool = False
    quick: bool = False
    follow: bool = False
    microrelief: bool = True

    def __post_init__(self) -> None:
        if not isinstance(self.view, View):
            check_name("view", str(self.view), VIEWS)
        if not isinstance(self.size, Sequence) or len(self.size) != 2:
            raise ParameterError(f"size must be width and height in pixels, received {self.size!r}.")
        for pixels in self.size:
            check_whole("each of width and height in pixels", pixels, 16, 8192)


def _view_of(style: Style) -> View:
    return VIEWS[style.view] if isinstance(style.view, str) else style.view


def placed(view: View, face: Face) -> tuple[Array, Array, Array, Array]:
    """Point that a view looks at, and unit directions towards the camera, to the right and up in the picture."""
    axes = face.frame.axes
    towards = unit(np.asarray(view.direction) @ axes)
    right = unit(np.cross(axes[1], towards))
    return view.focus(face), towards, right, np.cross(towards, right)


def surface_view(face: Face, point: Array, normal: Array, height: float) -> View:
    """Return a view of a place on any surface, a little from the side, as a relief is seen best.

    Parameters
    ----------
    face : Face
    point, normal : ndarray, shape (3,)
        The place, and the direction out of the surface.
    height : float
        Height of what is to be seen there, in the unit of the mesh; around it is a margin.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> import pyvista as pv
    >>> ball = fw.surface(pv.Icosphere(radius=40.0, nsub=3))
    >>> view = surface_view(ball, np.array([0.0, 0, 40]), np.array([0.0, 0, 1]), 20.0)
    >>> view.focus(ball).round(6) + 0.0
    array([ 0.,  0., 40.])
    """
    axes, size = face.frame.axes, face.frame.pupil_distance
    out = axes @ normal
    side = np.array([out[2], 0.0, -out[0]])
    if np.linalg.norm(side) < 0.1:  # seen from straight above
        out, side = out + np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    x, y, z = (out + 0.45 * side / np.linalg.norm(side)).tolist()
    u, v, w = ((point - face.frame.origin) @ axes.T / size).tolist()
    return View((x, y, z), None, (u, v, w), 1.3 * height / size)


def whole_view(style: Style) -> View:
    """Return a view of a whole surface that is no face, from the direction of a style's.

    Examples
    --------
    >>> whole_view(Style(view=View((1.0, 0.0, 0.2), None, (0.0, 1.0, 0.0), 0.4))).direction
    (1.0, 0.0, 0.2)
    """
    return View(_view_of(style).direction, None, (0.0, 0.0, 0.0))


def height_of(face: Face, style: Style) -> float:
    """Return the height of what a picture shows, from its lower to its upper border, in the unit of the mesh."""
    # The view angle is the vertical one: in an upright picture the width would be cut off.
    return float(face.frame.pupil_distance * _view_of(style).height * max(1.0, style.size[1] / style.size[0]))


def aim(plotter: pv.Plotter, face: Face, style: Style) -> None:
    """Point the camera of a plotter at a face, and add lights that stand around the camera."""
    size = face.frame.pupil_distance
    focus, towards, right, up = placed(_view_of(style), face)
    distance = height_of(face, style) / (2.0 * np.tan(np.radians(VIEW_ANGLE / 2.0)))
    camera = plotter.camera
    plotter.camera_position = (focus + distance * towards, focus, face.frame.axes[1])
    camera.view_angle = VIEW_ANGLE
    if style.scalars is not None:
        camera.SetWindowCenter(0.3, 0.0)  # room for the scalar bar
    camera.clipping_range = (0.2 * distance, distance + 8.0 * size)
    if style.quick:
        plotter.add_light(pv.Light(light_type="headlight"))
        return
    add_lamps(plotter, focus, np.stack([right, up, towards]), LIGHTS)


def add_lamps(plotter: pv.Plotter, focus: Array, axes: Array, lamps: Iterable[Lamp]) -> None:
    """Add lights that shine at a point, from directions along the axes (3, 3) right, up and towards the camera."""
    for direction, color, intensity in lamps:
        where = focus + np.asarray(direction) @ axes
        plotter.add_light(pv.Light(position=where, focal_point=focus, color=color, intensity=intensity))


def closeup(frame: pv.PolyData, face: Face) -> str:
    """Return the name of the view in :data:`CLOSE` that shows most of a frame's wrinkles; "front" if it has none.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> sim = fw.Simulation(face)
    >>> sim.express("frowning")
    >>> *_, frame = sim.run(15)
    >>> closeup(frame, face)
    'glabella'
    """
    check_name("field", "W", frame.point_data)
    points, size = np.asarray(frame.points), face.frame.pupil_distance
    weight = vertex_areas(points, frame.regular_faces) * np.asarray(frame.point_data["W"]) ** 2
    if not weight.any():
        return "front"
    normals = np.asarray(frame.point_data["Normals"])

    def shown(name: str) -> float:
        view = CLOSE[name]
        focus, towards, right, up = placed(view, face)
        away = np.maximum(np.abs((points - focus) @ right), np.abs((points - focus) @ up)) / (view.height * size)
        inside = np.clip((0.5 - away) / 0.15, 0.0, 1.0)  # less and less towards the border of the picture
        seen = inside * np.clip(normals @ towards, 0.0, 1.0)
        return float((weight * seen).sum() / np.sqrt(view.height))  # folds are large in small views

    weights = {name: shown(name) for name in CLOSE}
    best = max(weights, key=lambda name: weights[name])
    return best if weights[best] > 0.0 else "front"
