"""Pictures of frames: skin, eyes and brows under studio lights, wireframes, and fields in colour."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv

from .anatomy.face import Face
from .errors import ParameterError, unknown_name
from .mesh import ARRAYS

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.uint8]

VIEWS = {
    "front": (0.0, 0.02, 1.0),
    "three_quarter": (0.72, 0.08, 0.8),
    "profile": (1.0, 0.0, 0.02),
    "forehead": (0.12, 0.1, 1.0),
    "glabella": (0.1, 0.05, 1.0),
    "left_eye": (0.75, 0.05, 0.8),
    "mouth_right": (-0.55, 0.0, 1.0),
}
"""Directions [to the subject's left, up, forward] from which the camera looks, and below what it looks at."""

FOCUS: dict[str, tuple[str, tuple[float, float, float], float]] = {
    "forehead": ("glabella", (0.0, 0.25, -0.2), 2.6),
    "glabella": ("glabella", (0.0, 0.0, -0.1), 4.0),
    "left_eye": ("eye_l_outer", (0.0, 0.0, 0.0), 3.6),
    "mouth_right": ("mouth_r", (0.0, 0.1, 0.0), 2.6),
}
SKIN = dict(ambient=0.18, diffuse=0.85, specular=0.12, specular_power=12.0)
SKIN_COLOUR = (0.87, 0.67, 0.56)
BACKGROUND = ("#20242a", "#3a4048")

FIELD_COLOURS = {"W": "RdBu_r", "epsilon": "RdBu_r", "muscle": "tab20", "level": "viridis"}


@dataclass(frozen=True)
class Style:
    """How a picture looks.

    Attributes
    ----------
    size : tuple of int
        Width and height, pixels.
    view : str
        One of :data:`VIEWS`.
    wireframe : bool
        Draw the edges of the triangles.
    scalars : str, optional
        Colour by this array of the frame in place of skin.
    eyes, brows : bool
    zoom : float
    """

    size: tuple[int, int] = (800, 800)
    view: str = "front"
    wireframe: bool = False
    scalars: str | None = None
    eyes: bool = True
    brows: bool = True
    zoom: float = 1.0

    def __post_init__(self) -> None:
        if self.view not in VIEWS:
            raise unknown_name("view", self.view, VIEWS)
        if len(self.size) != 2 or not all(int(s) == s and 16 <= s <= 16384 for s in self.size):
            raise ParameterError(f"size must be width and height between 16 and 16384 pixels, received {self.size!r}.")


def new_plotter(face: Face, style: Style | None = None) -> pv.Plotter:
    """An off-screen plotter with camera and lights set for a face; close it after use."""
    style = style or Style()
    plotter = pv.Plotter(off_screen=True, window_size=list(style.size), lighting="none")
    plotter.set_background(BACKGROUND[0], top=BACKGROUND[1])
    _aim(plotter, face, style)
    return plotter


def draw(plotter: pv.Plotter, frame: pv.PolyData, face: Face, style: Style | None = None) -> None:
    """Add a frame, with eyes and brows, to a plotter; replaces what an earlier call added.

    Parameters
    ----------
    plotter : pyvista.Plotter
    frame : PolyData
        From :meth:`facewrinkle.Simulation.step`, or ``face.mesh``.
    face : Face
    style : Style, optional
    """
    style = style or Style()
    skin = frame.copy(deep=False)
    options: dict[str, Any] = {**SKIN, "name": "skin", "smooth_shading": True, "show_scalar_bar": False}
    # PyVista keeps existing point normals, and a frame's are right; those of any other mesh may be stale.
    if "split_gamma" not in skin.point_data:
        skin = skin.copy()
        skin.point_data.pop("Normals", None)
    options |= _colouring(skin, face, style)
    if style.wireframe:
        options |= {"show_edges": True, "edge_color": "#241a16", "line_width": 1.0, "edge_opacity": 0.75}
    plotter.add_mesh(skin, **options)
    if style.eyes:
        for eye in face.eyes:
            plotter.add_mesh(
                _painted(eye.surface(96)), scalars="paint", rgb=True, name=f"eye_{eye.side}", smooth_shading=True,
                ambient=0.25, diffuse=0.75, specular=0.5, specular_power=60.0, render=False,
            )  # fmt: skip
    if style.brows and face.brows is not None and style.scalars is None:
        plotter.add_mesh(_hairs(frame, face), color=(0.33, 0.23, 0.17), name="brows", render=False, **HAIR)


HAIR = dict(ambient=0.25, diffuse=0.7, specular=0.05)


def picture(frame: pv.PolyData, face: Face, style: Style | None = None) -> Image:
    """A picture of a frame.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> picture(face.mesh, face, Style(size=(60, 80))).shape
    (80, 60, 3)
    """
    plotter = new_plotter(face, style)
    try:
        draw(plotter, frame, face, style)
        return np.asarray(plotter.screenshot(None, return_img=True))
    finally:
        plotter.close()


def pictures(frames: Iterable[pv.PolyData], face: Face, style: Style | None = None) -> Iterable[Image]:
    """Pictures of many frames, one after the other, with one plotter: for movies."""
    plotter = new_plotter(face, style)
    try:
        for frame in frames:
            draw(plotter, frame, face, style)
            yield np.asarray(plotter.screenshot(None, return_img=True))
    finally:
        plotter.close()


def side_by_side(images: Sequence[Image], gap: int = 4) -> Image:
    """Pictures of one height in a row."""
    spacer = np.full((images[0].shape[0], gap, 3), 255, np.uint8)
    parts = [part for image in images for part in (spacer, image)][1:]
    return np.concatenate(parts, axis=1)


def save_picture(image: Image, path: Any) -> None:
    """Write a picture as PNG."""
    from matplotlib.image import imsave

    imsave(path, image)


def _colouring(skin: pv.PolyData, face: Face, style: Style) -> dict[str, Any]:
    """What `add_mesh` needs to colour the skin: a field, the face's texture, its colours, or plain skin."""
    if style.scalars is not None:
        if style.scalars not in skin.point_data:
            raise unknown_name("field", style.scalars, [n for n in ARRAYS if n in skin.point_data])
        values = np.asarray(skin.point_data[style.scalars])
        options: dict[str, Any] = {
            "scalars": style.scalars,
            "cmap": FIELD_COLOURS.get(style.scalars, "viridis"),
        }
        if style.scalars in ("W", "epsilon"):
            largest = float(np.abs(values).max()) or 1.0
            options["clim"] = (-largest, largest)
        return options | {
            "show_scalar_bar": True,
            "scalar_bar_args": {"color": "white", "title": style.scalars},
        }
    if face.texture is not None and skin.active_texture_coordinates is not None:
        texture = pv.Texture(np.array(face.texture))
        texture.interpolate = True
        return {"texture": texture}
    colours = skin.point_data.get("Colors")
    if colours is not None and colours.dtype == np.uint8 and colours.ndim == 2:
        return {"scalars": "Colors", "rgb": True}
    return {"color": SKIN_COLOUR}


def _aim(plotter: pv.Plotter, face: Face, style: Style) -> None:
    """Camera on the face, and a warm key, a cool fill and a rim light that move with it."""
    size, axes = face.frame.pupil_distance, face.frame.axes
    direction = np.asarray(VIEWS[style.view]) @ axes
    direction /= np.linalg.norm(direction)
    landmark, offset, zoom = FOCUS.get(style.view, ("nose_tip", (0.0, 0.1, -1.0), 1.0))
    focus = face.landmarks[landmark] + np.asarray(offset) @ axes * size
    camera = plotter.camera
    camera.position = focus + direction * 14.0 * size / (zoom * style.zoom)
    camera.focal_point = focus
    camera.up = axes[1]
    camera.view_angle = 15.0
    camera.clipping_range = (0.5 * size, 30.0 * size)
    right = np.cross(axes[1], direction)
    right /= np.linalg.norm(right)
    up = np.cross(direction, right)
    for (x, y, z), colour, intensity in (
        ((-0.55, 0.65, 0.85), (1.0, 0.95, 0.88), 0.78),
        ((0.9, 0.1, 0.7), (0.82, 0.9, 1.0), 0.32),
        ((0.5, 0.5, -0.9), (1.0, 1.0, 1.0), 0.35),
    ):
        where = focus + 14.0 * size * (x * right + y * up + z * direction)
        plotter.add_light(pv.Light(position=where, focal_point=focus, color=colour, intensity=intensity))


def _painted(ball: pv.PolyData) -> pv.PolyData:
    """Sclera, iris with a dark rim, and pupil."""
    angle = np.degrees(ball.point_data["angle"])
    iris, pupil = 30.0, 11.5
    paint = np.tile([236.0, 232.0, 226.0], (len(angle), 1))
    inside = angle < iris
    paint[inside] = np.array([96.0, 122.0, 138.0]) * (0.75 + 0.35 * angle[inside, None] / iris)
    paint[np.abs(angle - iris + 1.6) < 2.3] = (40, 48, 56)
    paint[angle < pupil] = (12, 12, 14)
    ball.point_data["paint"] = paint.astype(np.uint8)
    return ball


def _hairs(frame: pv.PolyData, face: Face) -> pv.PolyData:
    """The eyebrows on the surface as it is in this frame: base vertices come first in every frame."""
    assert face.brows is not None
    n = face.mesh.n_points
    points = np.asarray(frame.points)[:n]
    normals = frame.point_data.get("Normals")
    if normals is None or "split_gamma" not in frame.point_data:
        from .geometry.normals import vertex_normals

        normals = vertex_normals(points, face.triangles)
    lines = face.brows.polylines(points, face.triangles, np.asarray(normals)[:n])
    k, p, _ = lines.shape
    cells = np.hstack([np.full((k, 1), p), np.arange(k * p).reshape(k, p)]).ravel()
    return pv.PolyData(lines.reshape(-1, 3), lines=cells).tube(radius=0.0018 * face.frame.pupil_distance, n_sides=5)
