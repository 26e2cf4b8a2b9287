"""Pictures of frames: skin, eyes and brows under studio lights, wireframes, and fields in colour."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt
import pyvista as pv

from . import _shading
from ._drawn_skin import DrawnSkin
from ._features import Mouth, PaintedEye, has_colours, is_drawn, own_parts
from ._hairs import Brows, Lashes
from ._lid_rims import LidRim
from .anatomy.complexion import Paint
from .anatomy.face import Face
from .anatomy.fitting import carried_brows
from .anatomy.landmarks import NAMES, mirrored_name
from .errors import MeshError, ParameterError, check_range, check_whole, unknown_name
from .images import Image as Image
from .images import figure as figure
from .images import reduced
from .images import save_picture as save_picture
from .images import side_by_side as side_by_side
from .images import stacked as stacked
from .mesh import ARRAYS, MUSCLES, POSE, split_at_seams, with_normals

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

OWN = "own "
"""What names of actors of parts that came with the face begin with."""

VIEW_ANGLE = 15.0
SAMPLES = 2
"""Pictures are drawn this many times larger and reduced: in software that takes half the time of multisampling."""

SKIN: dict[str, Any] = {"ambient": 0.2, "diffuse": 0.68, "specular": 0.1, "specular_power": 14.0}
EYE: dict[str, Any] = {"ambient": 0.3, "diffuse": 0.72, "specular": 1.0, "specular_power": 90.0}
HAIR: dict[str, Any] = {"ambient": 0.35, "diffuse": 0.65, "specular": 0.05}
SKIN_COLOUR = (0.87, 0.67, 0.56)
BACKGROUND = ("#20242a", "#3a4048")
LIGHTS = (
    ((-0.6, 0.6, 0.75), (1.0, 0.95, 0.88), 1.12),
    ((0.9, 0.1, 0.6), (0.94, 0.97, 1.0), 0.2),
    ((0.65, 0.45, -0.8), (1.0, 0.98, 0.95), 0.9),
)
"""A warm key, a cool fill and a rim light: [right, up, towards the camera], colour, intensity."""

FIELD_COLOURS: dict[str, tuple[str, tuple[float, float] | None]] = {
    "W": ("RdBu_r", None),
    "epsilon": ("RdBu_r", None),
    "lambda": ("viridis", (0.0, 1.0)),
    "gamma": ("viridis", None),
    "split_gamma": ("YlOrRd", None),
    "muscle": ("Paired", None),
    "level": ("YlGnBu", None),
}
"""Colour maps of fields, and their ranges where these are not those of the values."""

OF_MUSCLES = ("lambda", "gamma", "epsilon", "muscle")
"""Fields that mean nothing where no muscle wrinkles the skin."""


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


class Scene:
    """A camera, lights and a face before them, off screen; close it after use, or use it in a `with` statement.

    Parameters
    ----------
    face : Face
    style : Style, optional

    Attributes
    ----------
    plotter : pyvista.Plotter

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> with Scene(face, Style(size=(60, 80))) as scene:
    ...     scene.picture(face.mesh).shape
    (80, 60, 3)
    """

    def __init__(self, face: Face, style: Style | None = None) -> None:
        self.face = face
        self.style = style or Style()
        self._samples = 1 if self.style.quick else SAMPLES
        window = [self._samples * pixels for pixels in self.style.size]
        self.plotter = pv.Plotter(off_screen=True, window_size=window, lighting="none")
        self.plotter.disable_anti_aliasing()
        self.plotter.renderer.SetUseOIT(False)  # hairs of one colour blend in any order
        self._parts: dict[str, pv.PolyData] = {}
        self.plotter.renderer.set_background(BACKGROUND[0], top=BACKGROUND[1])
        _aim(self.plotter, face, self.style)
        self._texture = _texture(face.texture)
        self._brows = None
        pixel = _height(face, self.style) / window[1]
        self._paint = None
        if face.landmarks and face.texture is None and not has_colours(face.mesh):
            self._paint = Paint(face)
            self._painted = self._paint(face.points)
        brows = carried_brows(face) if face.brows is None and self._paint is not None else face.brows
        if self.style.brows and self.style.scalars is None and brows is not None:
            self._brows = Brows(brows, face, pixel)
        self._mouth = Mouth(face)
        plain = not self.style.wireframe and self.style.scalars is None
        self._drawn = DrawnSkin(face, self._mouth.bag) if plain else None
        self._own = {name: _texture(part.texture) for name, part in face.parts.items() if is_drawn(name, part)}
        balls = [PaintedEye(eye, face) for eye in face.eyes] if self.style.eyes else []
        self._eyes = [ball for ball in balls if ball.open and f"eye_{ball.eye.side}" not in self._own]
        rims = [LidRim(ball.eye, face) for ball in balls if ball.open]
        self._rims = [rim for rim in rims if len(rim.loop)]
        self._lashes = (
            [
                Lashes(ball.eye, face, pixel)
                for ball in balls
                if f"lashes_{ball.eye.side}" not in self._own and (ball.open or self._paint is not None)
            ]
            if self.style.brows and self.style.scalars is None
            else []
        )

    def show(self, frame: pv.PolyData) -> None:
        """Put a frame of :meth:`facewrinkle.Simulation.step`, or ``face.mesh``, in the place of the one before."""
        if frame.n_points < self.face.mesh.n_points:
            raise MeshError(
                f"a frame of this face has {self.face.mesh.n_points} points or more, received {frame.n_points}. "
                "Is it one of another face?"
            )
        skin = with_normals(frame)
        n = self.face.mesh.n_points  # base vertices come first in every frame
        everywhere, normals = np.asarray(skin.points), np.asarray(skin.point_data["Normals"])[:n]
        pose = np.asarray(frame.field_data.get(POSE, np.eye(4)), dtype=np.float64)
        back = np.linalg.inv(pose)  # parts are placed on the head as it is at rest, and go with it
        everywhere, normals = everywhere @ back[:3, :3].T + back[:3, 3], normals @ pose[:3, :3]
        points, refined = everywhere[:n], (everywhere, np.asarray(skin.regular_faces))
        normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        if self._drawn is not None:
            place = np.append(self.plotter.camera.position, 1.0)
            skin = self._drawn.of(skin, (pose @ place if self.style.follow else place)[:3])
        if self._texture is not None and self.style.scalars is None:
            skin = split_at_seams(skin)
            skin.active_scalars_name = None  # VTK's normals drop texture coordinates that are scalars, too
        options = SKIN | self._colouring(skin)
        if self.style.wireframe:
            options |= {"show_edges": True, "edge_color": "#241a16", "line_width": self._samples, "edge_opacity": 0.75}
        self._add(skin, "skin", None if self.style.scalars else _shading.SKIN, **options)
        if "texture" in options and "W" in skin.point_data:
            skin.point_data["shade"] = _shading.furrowed(skin)
            mapper = self.plotter.actors["skin"].mapper
            mapper.scalar_visibility, mapper.color_mode, mapper.scalar_map_mode = True, "direct", "point_field"
            mapper.SelectColorArray("shade")
        if len(self._mouth.loop):
            self._put(self._mouth.pocket(points), "mouth", lighting=False)
        if len(self._mouth.loop) or self._mouth.bag:
            inside = self._mouth.inside(points) if self._mouth.parted(points) else {}
            inside = {name: part for name, part in inside.items() if name not in self._own}
            for name, part in inside.items():
                self._put(part, name, _shading.TEETH)
            for name in Mouth.INSIDE:
                if name in self._parts:
                    self.plotter.actors[name].visibility = name in inside
        for eye in self._eyes:
            gaze = np.array(frame.field_data.get(f"gaze_{eye.eye.side}", eye.eye.gaze), dtype=np.float64).ravel()
            self._put(eye.on(points, gaze), f"eye_{eye.eye.side}", _shading.EYE, **EYE)
        for rim in self._rims:
            self._put(rim.on(points), f"rim_{rim.eye.side}", _shading.SKIN, **SKIN)
        for lashes in self._lashes:
            if lashes.roots:
                self._put(lashes.on(points), f"lashes_{lashes.eye.side}", **HAIR)
        if self._brows is not None:
            self._put(self._brows.on(points, self.face.triangles, normals, refined), "brows", **HAIR)
        for name, part in own_parts(self.face, frame).items():
            look = EYE if name.startswith("eye") else HAIR
            self._put(part, f"{OWN}{name}", texture=self._own[name], **look)
        for name in ("skin", *self._parts):
            there = name == "skin" or name.startswith(OWN)  # where they are in the frame
            goes, stays = (back, np.eye(4)) if there else (np.eye(4), pose)
            self.plotter.actors[name].user_matrix = goes if self.style.follow else stays

    def draw(self, frame: pv.PolyData) -> None:
        """Show a frame, and render."""
        self.show(frame)
        self.plotter.render()

    def picture(self, frame: pv.PolyData) -> Image:
        """The picture of a frame: ndarray of uint8, shape (height, width, 3)."""
        self.draw(frame)
        image = np.array(self.plotter.screenshot(None, return_img=True))
        return image if self._samples == 1 else reduced(image, self._samples)

    def close(self) -> None:
        """Free the window and what was drawn in it."""
        self.plotter.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _put(
        self,
        part: pv.PolyData,
        name: str,
        surface: _shading.Surface | None = None,
        texture: pv.Texture | None = None,
        **options: Any,
    ) -> None:
        """Draw a part with `paint` or a texture beside the skin, in the place of what it was."""
        if "Normals" in part.point_data:
            part.point_data.active_normals_name = "Normals"
        if name in self._parts:
            part.active_scalars_name = "paint" if texture is None else None
            self._parts[name].shallow_copy(part)
        else:
            self._parts[name] = part
            colours: dict[str, Any] = {"scalars": "paint", "rgb": True} if texture is None else {"texture": texture}
            self._add(part, name, surface, smooth_shading=False, **colours, **options)
            self.plotter.actors[name].prop.interpolation = "phong"

    def _add(self, mesh: pv.PolyData, name: str, surface: _shading.Surface | None = None, **options: Any) -> None:
        defaults = {"smooth_shading": True, "show_scalar_bar": False, "reset_camera": False, "render": False}
        if surface is not None and not self.style.quick:
            options |= {"ambient": 1.0, "diffuse": 1.0}
        actor = self.plotter.add_mesh(mesh, name=name, **{**defaults, **options})
        if surface is not None and not self.style.quick:
            surface.on(actor, len(LIGHTS), "texture" in options)

    def _colouring(self, skin: pv.PolyData) -> dict[str, Any]:
        """What `add_mesh` needs to colour the skin: a field, the face's texture, its colours, or plain skin."""
        if self.style.scalars is not None:
            return _field(skin, self.style.scalars, self.style.size[1] * self._samples)
        if self._texture is not None and skin.active_texture_coordinates is not None:
            return {"texture": self._texture}
        if has_colours(skin):
            return {"scalars": "Colors", "rgb": True}
        if self._paint is not None:
            new = np.asarray(skin.point_data.get("rest", skin.points))[len(self._painted) :]
            paint = np.concatenate([self._painted, self._paint(new)])
            return {"scalars": paint, "rgb": True}
        return {"color": SKIN_COLOUR}  # the texture is not for this mesh


def picture(frame: pv.PolyData, face: Face, style: Style | None = None) -> Image:
    """A picture of a frame.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)

    Raises
    ------
    UnknownNameError
        For a field that the frame does not have.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> picture(face.mesh, face, Style(size=(60, 80))).shape
    (80, 60, 3)
    """
    with Scene(face, style) as scene:
        return scene.picture(frame)


def pictures(frames: Iterable[pv.PolyData], face: Face, style: Style | None = None) -> Iterator[Image]:
    """Pictures of many frames, one after the other, with one scene: for movies.

    Examples
    --------
    Small ones of the first frames of a surprise:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> sim = fw.Simulation(face, fw.Refinement(max_level=0))
    >>> sim.express("surprise")
    >>> [image.shape for image in pictures(sim.run(2), face, Style(size=(60, 80)))]
    [(80, 60, 3), (80, 60, 3)]
    """
    with Scene(face, style) as scene:
        for frame in frames:
            yield scene.picture(frame)


def closeup(frame: pv.PolyData, face: Face) -> str:
    """The name of the view in :data:`CLOSE` that shows most of the wrinkles of a frame; "front" where it has none.

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
    if "W" not in frame.point_data:
        raise unknown_name("field", "W", frame.point_data)
    points, triangles, size = np.asarray(frame.points), np.asarray(frame.regular_faces), face.frame.pupil_distance
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    area = np.bincount(triangles.ravel(), np.repeat(np.linalg.norm(np.cross(b - a, c - a), axis=1), 3), len(points))
    weight = area * np.asarray(frame.point_data["W"]) ** 2
    if not weight.any():
        return "front"
    normals = np.asarray(frame.point_data["Normals"])

    def shown(name: str) -> float:
        view = CLOSE[name]
        focus, towards, right, up = _stand(face, view)
        away = np.maximum(np.abs((points - focus) @ right), np.abs((points - focus) @ up)) / (view.height * size)
        inside = np.clip((0.5 - away) / 0.15, 0.0, 1.0)  # less and less towards the border of the picture
        return float((weight * inside * np.clip(normals @ towards, 0.0, 1.0)).sum() / view.height**0.5)

    return max(CLOSE, key=shown)


def _texture(image: Image | None) -> pv.Texture | None:
    if image is None:
        return None
    texture = pv.Texture(np.array(image))
    texture.interpolate = True
    texture.mipmap = True
    return texture


def _field(skin: pv.PolyData, name: str, height: int) -> dict[str, Any]:
    """Colours and a scalar bar for a field in a window of this height; grey where it means nothing."""
    if name not in skin.point_data:
        raise unknown_name("field", name, [n for n in ARRAYS if n in skin.point_data])
    values = np.array(skin.point_data[name], dtype=np.float64)
    if values.ndim > 1:
        raise ParameterError(f"the picture is coloured by one number per vertex; {name!r} has {values.shape[1]}.")
    if name in OF_MUSCLES and "muscle" in skin.point_data:
        values[np.asarray(skin.point_data["muscle"]) < 0] = np.nan
    colours, limits = FIELD_COLOURS.get(name, ("viridis", None))
    largest = float(np.nanmax(np.abs(values), initial=0.0)) or 1.0
    title = f"{name} (mm)\n" if name == "W" else f"{name}\n"
    bar: dict[str, Any] = {"title": title, "title_font_size": height // 40, "label_font_size": height // 50}
    bar |= {"color": "white", "fmt": "%.2g", "vertical": True}
    bar |= {"position_x": 0.82, "position_y": 0.2, "height": 0.6, "width": 0.06}
    options: dict[str, Any] = {"cmap": colours, "nan_color": "#8d8580", "specular": 0.0, "clim": limits}
    if colours == "RdBu_r":
        options["clim"] = (-largest, largest)
    if name in ("muscle", "level"):
        values = _of_triangles(values, skin)
    if name == "muscle":
        values, names = _pairs(values, [str(muscle) for muscle in skin.field_data[MUSCLES]])
        options |= {"annotations": dict(enumerate(names)), "clim": (-0.5, max(len(names), 1) - 0.5)}
        options["n_colors"] = max(len(names), 1)
        bar |= {"n_labels": 0, "position_x": 0.91}
    if name == "level":
        options |= {"clim": (-0.5, largest + 0.5), "n_colors": int(largest) + 1}
        bar |= {"n_labels": 0}
        options["annotations"] = {level: str(level) for level in range(int(largest) + 1)}
    return options | {"scalars": values, "show_scalar_bar": True, "scalar_bar_args": bar}


def _of_triangles(values: Array, skin: pv.PolyData) -> Array:
    """The largest value of each triangle's corners, NaN if one is: between two names or levels there is no third."""
    corners = values[np.asarray(skin.regular_faces)]
    return np.asarray(corners.max(axis=1))


def _pairs(muscles: Array, names: Sequence[str]) -> tuple[Array, list[str]]:
    """Indices (NaN for none) into the names without their sides, which are returned too."""
    stems = [name.removesuffix("_l").removesuffix("_r") for name in names]
    known = list(dict.fromkeys(stems))
    number = np.array([known.index(stem) for stem in stems] + [np.nan])
    return number[np.where(np.isnan(muscles), -1, muscles).astype(int)], known


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
