"""Pictures of frames: skin, eyes and brows under studio lights, wireframes, and fields in colour."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Self

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy.face import Face
from ..anatomy.fitting import fitted_brows
from ..appearance.eye import PaintedEye
from ..appearance.hair import Brows, Lashes
from ..appearance.lid_margins import LidMargin
from ..appearance.mouth import Mouth
from ..appearance.own_parts import has_colours, is_drawn, own_parts
from ..appearance.skin_paint import SkinPainter
from ..appearance.visible_skin import VisibleSkin
from ..errors import unknown_name
from ..mesh import split_at_seams, with_normals
from . import shaders as _shading
from .fields import _field
from .images import Image as Image
from .images import figure as figure
from .images import reduced
from .images import save_picture as save_picture
from .images import side_by_side as side_by_side
from .images import stacked as stacked
from .views import CLOSE, LIGHTS, Style, _aim, _height, _stand

Array = npt.NDArray[np.float64]


OWN = "own "
"""What names of actors of parts that came with the face begin with."""

SAMPLES = 2
"""Pictures are drawn this many times larger and reduced: in software that takes half the time of multisampling."""

SKIN: dict[str, Any] = {"ambient": 0.2, "diffuse": 0.68, "specular": 0.1, "specular_power": 14.0}
EYE: dict[str, Any] = {"ambient": 0.3, "diffuse": 0.72, "specular": 1.0, "specular_power": 90.0}
HAIR: dict[str, Any] = {"ambient": 0.35, "diffuse": 0.65, "specular": 0.05}
SKIN_COLOUR = (0.87, 0.67, 0.56)
BACKGROUND = ("#20242a", "#3a4048")


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
            self._paint = SkinPainter(face)
            self._painted = self._paint(face.points)
        brows = fitted_brows(face) if face.brows is None and self._paint is not None else face.brows
        if self.style.brows and self.style.scalars is None and brows is not None:
            self._brows = Brows(brows, face, pixel)
        self._mouth = Mouth(face)
        plain = not self.style.wireframe and self.style.scalars is None
        self._drawn = VisibleSkin(face, self._mouth.bag) if plain else None
        self._own = {name: _texture(part.texture) for name, part in face.parts.items() if is_drawn(name, part)}
        balls = [PaintedEye(eye, face) for eye in face.eyes] if self.style.eyes else []
        self._eyes = [ball for ball in balls if ball.open and f"eye_{ball.eye.side}" not in self._own]
        rims = [LidMargin(ball.eye, face) for ball in balls if ball.open]
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
        state = self.face.state_of(frame)
        skin, n, pose = with_normals(frame), len(state.points), state.head
        everywhere, normals = np.asarray(skin.points), np.asarray(skin.point_data["Normals"])[:n]
        back = np.linalg.inv(pose)  # parts are placed on the head as it is at rest, and go with it
        everywhere, normals = state.to_rest(everywhere), normals @ pose[:3, :3]
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
            skin.point_data["shade"] = _shading.cavity_shading(skin)
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
            self._put(eye.at(points, state.gazes.get(eye.eye.side)), f"eye_{eye.eye.side}", _shading.EYE, **EYE)
        for rim in self._rims:
            self._put(rim.at(points), f"rim_{rim.eye.side}", _shading.SKIN, **SKIN)
        for lashes in self._lashes:
            if lashes.roots:
                self._put(lashes.at(points), f"lashes_{lashes.eye.side}", **HAIR)
        if self._brows is not None:
            self._put(self._brows.at(points, self.face.triangles, normals, refined), "brows", **HAIR)
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
        surface: _shading.Material | None = None,
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

    def _add(self, mesh: pv.PolyData, name: str, surface: _shading.Material | None = None, **options: Any) -> None:
        defaults = {"smooth_shading": True, "show_scalar_bar": False, "reset_camera": False, "render": False}
        if surface is not None and not self.style.quick:
            options |= {"ambient": 1.0, "diffuse": 1.0}
        actor = self.plotter.add_mesh(mesh, name=name, **{**defaults, **options})
        if surface is not None and not self.style.quick:
            surface.apply(actor, len(LIGHTS), "texture" in options)

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
