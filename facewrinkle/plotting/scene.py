"""Pictures of frames: skin, eyes and brows under studio lights, wireframes, and fields in colour."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
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
from ..mesh import split_at_seams, with_normals
from ..mesh.seams import corner_texture
from .fields import field_colouring
from .images import Image
from .shaders import EYE_MATERIAL, SKIN_MATERIAL, TEETH_MATERIAL, Material, cavity_shading
from .textures import texels_per_pixel, texture
from .views import LIGHTS, Style, aim, height_of
from .window import rendered, window_of

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]

OWN_PREFIX = "own "
"""Prefix of the names of actors that show parts that came with the face."""

SUPERSAMPLING = 2
"""Pictures are drawn larger by this factor and reduced: in software that takes half the time of multisampling."""

SKIN_LIGHTING: dict[str, Any] = {"ambient": 0.2, "diffuse": 0.68, "specular": 0.1, "specular_power": 14.0}
EYE_LIGHTING: dict[str, Any] = {"ambient": 0.3, "diffuse": 0.72, "specular": 1.0, "specular_power": 90.0}
HAIR_LIGHTING: dict[str, Any] = {"ambient": 0.35, "diffuse": 0.65, "specular": 0.05}
"""Options of `add_mesh` for VTK's own shading: always of hair, in quick pictures also of surfaces with a material."""

PLAIN_COLOUR = (0.87, 0.67, 0.56)
"""Colour of skin for meshes that the face's texture does not fit."""

BACKGROUND = ("#20242a", "#3a4048")
"""Colours of the background at the bottom and at the top."""


class Scene:
    """A camera, lights and a face in front of them, off screen.

    Close it after use, or use it in a `with` statement.

    Parameters
    ----------
    face : Face
    style : Style, optional

    Attributes
    ----------
    plotter : pyvista.Plotter
        :meth:`draw` leaves in its window what :meth:`picture` returns, :meth:`picture` leaves nothing of use.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> with Scene(face, Style(size=(60, 80))) as scene:
    ...     scene.picture(face.mesh).shape
    (80, 60, 3)
    """

    def __init__(self, face: Face, style: Style | None = None) -> None:
        self.face, self.style = face, style or Style()
        self._samples = 1 if self.style.quick else SUPERSAMPLING
        self._window = [self._samples * pixels for pixels in self.style.size]
        self.plotter = pv.Plotter(off_screen=True, window_size=self._window, lighting="none")
        self.plotter.disable_anti_aliasing()
        self.plotter.renderer.SetUseOIT(False)  # hairs of one colour blend in any order
        self.plotter.renderer.set_background(BACKGROUND[0], top=BACKGROUND[1])
        aim(self.plotter, face, self.style)
        self._parts: dict[str, pv.PolyData] = {}
        pixel = height_of(face, self.style) / self._window[1]
        self._texture = _texture_of(face.mesh, face.texture, pixel)
        self._painter = None
        if face.landmarks and face.texture is None and not has_colours(face.mesh):
            self._painter = SkinPainter(face)
            self._base_paint = self._painter(face.points)
        self._mouth = Mouth(face)
        plain = not self.style.wireframe and self.style.scalars is None
        self._visible = VisibleSkin(face, self._mouth.bag) if plain else None
        drawn = {name: part for name, part in face.parts.items() if is_drawn(name, part)}
        self._own_textures = {name: _texture_of(part.mesh, part.texture, pixel) for name, part in drawn.items()}
        balls = [PaintedEye(eye, face) for eye in face.eyes] if self.style.eyes else []
        self._eyes = [ball for ball in balls if ball.open and f"eye_{ball.eye.side}" not in self._own_textures]
        margins = [LidMargin(ball.eye, face) for ball in balls if ball.open]
        self._lid_margins = [margin for margin in margins if len(margin.loop)]
        self._lashes, self._brows = self._hair(balls, pixel)

    def _hair(self, balls: Sequence[PaintedEye], pixel: float) -> tuple[list[Lashes], Brows | None]:
        """Lashes, if none came with the face, and brows."""
        if not self.style.brows or self.style.scalars is not None:
            return [], None
        lashes = [
            Lashes(ball.eye, self.face, pixel)
            for ball in balls
            if f"lashes_{ball.eye.side}" not in self._own_textures and (ball.open or self._painter is not None)
        ]
        hairs = self.face.brows
        if hairs is None and self._painter is not None:
            hairs = fitted_brows(self.face)
        brows = None if hairs is None else Brows(hairs, self.face, pixel)
        return [row for row in lashes if row.roots], brows

    def show(self, frame: pv.PolyData) -> None:
        """Put a frame of :meth:`facewrinkle.Simulation.step`, or ``face.mesh``, in place of the one before."""
        state = self.face.state_of(frame)
        skin, n, pose = with_normals(frame), len(state.points), state.head
        # Eyes, mouth and hair are placed on the head in its place at rest; their actors then move with it.
        unposed = state.to_rest(np.asarray(skin.points))
        normals = np.asarray(skin.point_data["Normals"])[:n] @ pose[:3, :3]
        normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        points, refined = unposed[:n], (unposed, np.asarray(skin.regular_faces))
        self._show_skin(skin, pose)
        self._show_mouth(points, state.jaw_angle)
        self._show_eyes(points, state.gazes)
        self._show_hair(points, normals, refined)
        for name, part in own_parts(self.face, frame).items():
            lighting = EYE_LIGHTING if name.startswith("eye") else HAIR_LIGHTING
            self._put(part, f"{OWN_PREFIX}{name}", texture=self._own_textures[name], **lighting)
        for name in ("skin", *self._parts):
            posed = name == "skin" or name.startswith(OWN_PREFIX)  # as the frame has them
            followed, seen = (np.linalg.inv(pose), np.eye(4)) if posed else (np.eye(4), pose)
            self.plotter.actors[name].user_matrix = followed if self.style.follow else seen

    def _show_skin(self, skin: pv.PolyData, pose: Array) -> None:
        if self._visible is not None:
            viewpoint = np.append(self.plotter.camera.position, 1.0)
            skin = self._visible.of(skin, (pose @ viewpoint if self.style.follow else viewpoint)[:3])
        if self._texture is not None and self.style.scalars is None:
            skin = split_at_seams(skin)
            skin.active_scalars_name = None  # VTK's normals drop texture coordinates that are scalars, too
        options = SKIN_LIGHTING | self._colouring(skin)
        if self.style.wireframe:
            options |= {"show_edges": True, "edge_color": "#241a16", "line_width": self._samples, "edge_opacity": 0.75}
        self._add(skin, "skin", None if self.style.scalars else SKIN_MATERIAL, **options)
        if "texture" in options and "W" in skin.point_data:
            skin.point_data["shade"] = cavity_shading(skin)
            mapper = self.plotter.actors["skin"].mapper
            mapper.scalar_visibility, mapper.color_mode, mapper.scalar_map_mode = True, "direct", "point_field"
            mapper.SelectColorArray("shade")

    def _colouring(self, skin: pv.PolyData) -> dict[str, Any]:
        """Options of `add_mesh` that colour the skin: by a field, the face's texture, its colours, or plainly."""
        if self.style.scalars is not None:
            return field_colouring(skin, self.style.scalars, self._window[1])
        if self._texture is not None and skin.active_texture_coordinates is not None:
            return {"texture": self._texture}
        if has_colours(skin):
            return {"scalars": "Colors", "rgb": True}
        if self._painter is not None:
            new = np.asarray(skin.point_data.get("rest", skin.points))[len(self._base_paint) :]
            return {"scalars": np.concatenate([self._base_paint, self._painter(new)]), "rgb": True}
        return {"color": PLAIN_COLOUR}

    def _show_mouth(self, points: Array, jaw_angle: float | None) -> None:
        if len(self._mouth.loop):
            self._put(self._mouth.pocket(points), "mouth", lighting=False)
        inside = self._mouth.inside(points, jaw_angle) if self._mouth.parted(points) else {}
        inside = {name: part for name, part in inside.items() if name not in self._own_textures}
        for name, part in inside.items():
            self._put(part, name, TEETH_MATERIAL)
        for name in Mouth.INSIDE:
            if name in self._parts:
                self.plotter.actors[name].visibility = name in inside

    def _show_eyes(self, points: Array, gazes: Mapping[str, Array]) -> None:
        for ball in self._eyes:
            side = ball.eye.side
            self._put(ball.at(points, gazes.get(side)), f"eye_{side}", EYE_MATERIAL, **EYE_LIGHTING)
        for margin in self._lid_margins:
            self._put(margin.at(points), f"rim_{margin.eye.side}", SKIN_MATERIAL, **SKIN_LIGHTING)

    def _show_hair(self, points: Array, normals: Array, refined: tuple[Array, IntArray]) -> None:
        for lashes in self._lashes:
            self._put(lashes.at(points), f"lashes_{lashes.eye.side}", **HAIR_LIGHTING)
        if self._brows is not None:
            self._put(self._brows.at(points, self.face.triangles, normals, refined), "brows", **HAIR_LIGHTING)

    def draw(self, frame: pv.PolyData) -> None:
        """Show a frame, and render."""
        self.show(frame)
        window_of(self.plotter).Render()

    def picture(self, frame: pv.PolyData) -> Image:
        """Return the picture of a frame: ndarray of uint8, shape (height, width, 3)."""
        self.show(frame)
        return rendered(self.plotter, self._samples)

    def close(self) -> None:
        """Free the window and all that is drawn in it."""
        self.plotter.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _put(
        self,
        part: pv.PolyData,
        name: str,
        material: Material | None = None,
        texture: pv.Texture | None = None,
        **options: Any,
    ) -> None:
        """Add a part that has `paint` or a texture, in place of the one that had this name before."""
        if "Normals" in part.point_data:
            part.point_data.active_normals_name = "Normals"
        if name in self._parts:
            part.active_scalars_name = "paint" if texture is None else None
            self._parts[name].shallow_copy(part)
        else:
            self._parts[name] = part
            colours: dict[str, Any] = {"scalars": "paint", "rgb": True} if texture is None else {"texture": texture}
            self._add(part, name, material, smooth_shading=False, **colours, **options)
            self.plotter.actors[name].prop.interpolation = "phong"

    def _add(self, mesh: pv.PolyData, name: str, material: Material | None = None, **options: Any) -> None:
        defaults = {"smooth_shading": True, "show_scalar_bar": False, "reset_camera": False, "render": False}
        if material is not None and not self.style.quick:
            options |= {"ambient": 1.0, "diffuse": 1.0}
        actor = self.plotter.add_mesh(mesh, name=name, **{**defaults, **options})
        if material is not None and not self.style.quick:
            material.apply(actor, len(LIGHTS), "texture" in options)


def picture(frame: pv.PolyData, face: Face, style: Style | None = None) -> Image:
    """Return a picture of a frame.

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
    """Yield pictures of many frames, one after the other, from one scene: for movies.

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


def _texture_of(mesh: pv.PolyData, image: Image | None, pixel: float) -> pv.Texture | None:
    """The texture of a mesh as it is seen where a pixel is so wide, in the unit of the mesh; None without an image."""
    if image is None:
        return None
    corners = corner_texture(mesh)
    return texture(image, 1.0 if corners is None else texels_per_pixel(mesh, corners, image, pixel))
