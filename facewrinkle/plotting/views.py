"""Camera views, and the style of a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy.face import Face
from ..anatomy.landmarks import NAMES, mirrored_name
from ..errors import ParameterError, check_range, check_whole, unknown_name
from .images import Image as Image
from .images import figure as figure
from .images import save_picture as save_picture
from .images import side_by_side as side_by_side
from .images import stacked as stacked

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class View:
    """Where the camera stands, on any face.

    Attributes
    ----------
    direction : tuple of float
        [to the subject's left, up, forward], from what is looked at to the camera.
    landmark : str
        What is looked at, moved by `offset` (in distances between the pupils, along the same axes).
    height : float
        Height of the picture there, in distances between the pupils.

    Examples
    --------
    >>> near = View((0.5, 0.0, 1.0), "mouth_l", height=1.2)
    >>> near.mirrored().landmark
    'mouth_r'
    """

    direction: tuple[float, float, float]
    landmark: str = "nose_tip"
    offset: tuple[float, float, float] = (0.0, 0.2, -1.6)
    height: float = 4.5

    def __post_init__(self) -> None:
        if not np.hypot(self.direction[0], self.direction[2]) > 1e-6 * abs(self.direction[1]):
            raise ParameterError(f"direction must not be zero or straight up or down, received {self.direction!r}.")
        if self.landmark not in NAMES:
            raise unknown_name("landmark", self.landmark, NAMES)
        check_range("height", self.height, 1e-3, 1e3)

    def mirrored(self) -> View:
        """The same from the other side of the face."""
        (x, y, z), (u, v, w) = self.direction, self.offset
        return View((-x, y, z), mirrored_name(self.landmark), (-u, v, w), self.height)


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
"""Views of places where wrinkles are."""


VIEWS: dict[str, View] = {
    "front": View((0.0, 0.02, 1.0)),
    **_LEFT,
    **{name.replace("left", "right"): view.mirrored() for name, view in _LEFT.items()},
    **CLOSE,
}
"""All views that have a name."""


VIEW_ANGLE = 15.0


LIGHTS = (
    ((-0.6, 0.6, 0.75), (1.0, 0.95, 0.88), 1.12),
    ((0.9, 0.1, 0.6), (0.94, 0.97, 1.0), 0.2),
    ((0.65, 0.45, -0.8), (1.0, 0.98, 0.95), 0.9),
)
"""A warm key, a cool fill and a rim light: [right, up, towards the camera], colour, intensity."""


@dataclass(frozen=True)
class Style:
    """How a picture looks.

    Attributes
    ----------
    size : tuple of int
        Width and height, pixels.
    view : str or View
        A view, or the name of one in :data:`VIEWS`.
    wireframe : bool
        Draw the edges of the triangles.
    scalars : str, optional
        Colour by this array of the frame in place of skin.
    eyes, brows : bool
    quick : bool
        One headlight and no anti-aliasing.
    follow : bool
        The camera goes with a head that moves as a whole.

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
    quick: bool = False
    follow: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.view, View) and str(self.view) not in VIEWS:
            raise unknown_name("view", self.view, VIEWS)
        if not isinstance(self.size, Sequence) or len(self.size) != 2:
            raise ParameterError(f"size must be width and height in pixels, received {self.size!r}.")
        for pixels in self.size:
            check_whole("each of width and height in pixels", pixels, 16, 8192)


def _stand(face: Face, view: View) -> tuple[Array, Array, Array, Array]:
    """What a view looks at, and the unit directions towards the camera, to the right and up in the picture."""
    size, axes = face.frame.pupil_distance, face.frame.axes
    focus = face.frame.origin  # of a surface without landmarks
    if face.landmarks:
        focus = face.landmarks[view.landmark] + np.asarray(view.offset) @ axes * size
    towards = np.asarray(view.direction) @ axes
    towards /= np.linalg.norm(towards)
    right = np.cross(axes[1], towards)
    right /= np.linalg.norm(right)
    return focus, towards, right, np.cross(towards, right)


def _height(face: Face, style: Style) -> float:
    """What the picture shows from its lower to its upper border, in the unit of the mesh."""
    view = VIEWS[style.view] if isinstance(style.view, str) else style.view
    # The view angle is the vertical one: in an upright picture the width would be cut off.
    return float(face.frame.pupil_distance * view.height * max(1.0, style.size[1] / style.size[0]))


def _aim(plotter: pv.Plotter, face: Face, style: Style) -> None:
    """Camera on the face, and lights that move with it."""
    view = VIEWS[style.view] if isinstance(style.view, str) else style.view
    size = face.frame.pupil_distance
    focus, towards, right, up = _stand(face, view)
    distance = _height(face, style) / (2.0 * np.tan(np.radians(VIEW_ANGLE / 2.0)))
    camera = plotter.camera
    camera.position = focus + distance * towards
    camera.focal_point = focus
    camera.up = face.frame.axes[1]
    camera.view_angle = VIEW_ANGLE
    if style.scalars is not None:
        camera.SetWindowCenter(0.3, 0.0)  # room for the scalar bar
    camera.clipping_range = (0.2 * distance, distance + 8.0 * size)
    if style.quick:
        plotter.add_light(pv.Light(light_type="headlight"))
        return
    for (x, y, z), colour, intensity in LIGHTS:
        where = focus + 14.0 * size * (x * right + y * up + z * towards)
        plotter.add_light(pv.Light(position=where, focal_point=focus, color=colour, intensity=intensity))
