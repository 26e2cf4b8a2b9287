"""Pictures of frames: skin, eyes and brows under studio lights, wireframes, and fields in color."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cache
from typing import Any, Literal, Self

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy import Face
from ..anatomy.long_hair import STRAND_AT
from ..anatomy.parts import ALONG
from ..appearance.fibers import OPACITY, Fibers
from ..appearance.seen import Appearance, Seen
from ..appearance.visible_skin import VisibleSkin
from ..array_types import Array, Image
from ..errors import ParameterError, check_type
from ..mesh import COLORS, corner_texture, has_colors, split_at_seams
from .fields import field_coloring
from .images import begun, texels_per_pixel, texture, window_of
from .lighting import KeyLight
from .shaders import (
    CLAY_MATERIAL,
    EYE_MATERIAL,
    LOCKS,
    REACHED,
    RELIEF,
    SKIN_MATERIAL,
    TEETH_MATERIAL,
    Material,
    Relief,
    hair,
    send,
    send_background,
)
from .views import LIGHTS, Style, View, aim, height_of

OWN_PREFIX = "own "
"""Prefix of the names of actors that show parts that came with the face."""

SKIN_LIGHTING: dict[str, Any] = {"ambient": 0.2, "diffuse": 0.68, "specular": 0.1, "specular_power": 14.0}
EYE_LIGHTING: dict[str, Any] = {"ambient": 0.3, "diffuse": 0.72, "specular": 1.0, "specular_power": 90.0}
HAIR_LIGHTING: dict[str, Any] = {"ambient": 0.35, "diffuse": 0.65, "specular": 0.05}
"""Options of `add_mesh` for VTK's own shading: of your own parts, in quick pictures also of any material."""

PLAIN_COLOR = (0.87, 0.67, 0.56)
"""Color of skin for meshes that the face's texture does not fit."""

BACKGROUND = ("#20242a", "#3a4048")
"""Colors of the background at the bottom and at the top."""


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
    drawn_parts : dict of str to frozenset of str
        Names of the painted parts that are drawn, such as `eye_l`, by the actor that shows them together.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> with Scene(face, Style(size=(60, 80))) as scene:
    ...     scene.picture(face.mesh).shape
    (80, 60, 3)
    """

    def __init__(self, face: Face, style: Style | None = None) -> None:
        check_type("face", face, Face)
        check_type("style", style, Style, optional=True)
        self.face, self.style = face, style or Style()
        # Drawn larger and reduced: in software that takes half the time of multisampling.
        self._samples = 1 if self.style.quick else 2
        self._window = [self._samples * pixels for pixels in self.style.size]
        self.plotter = pv.Plotter(off_screen=True, window_size=self._window, lighting="none")
        self.plotter.disable_anti_aliasing()
        self.plotter.renderer.SetUseOIT(False)  # hairs of one color blend in any order
        self.plotter.renderer.set_background(BACKGROUND[0], top=BACKGROUND[1])
        self.drawn_parts: dict[str, frozenset[str]] = {}
        self._actors: dict[str, pv.Actor] = {}
        self._drawing: Callable[[], Image] | None = None
        self._shown: tuple[pv.PolyData, int] | None = None
        self._seen_from: tuple[float, ...] | None = None
        pixel = height_of(face, self.style) / self._window[1]
        self._appearance = appearance = Appearance.of(face)
        plain = not self.style.wireframe and self.style.scalars is None
        self._visible = VisibleSkin(face, appearance.mouth.bag) if plain else None
        self._relief = self._relief_at(pixel)
        self._coloring: tuple[bool, bool] | None = None
        self._key: KeyLight | None = None
        self._texture = _texture_of(face.mesh, face.texture, pixel)
        self._own_textures = {
            name: _texture_of(face.parts[name].mesh, face.parts[name].texture, pixel) for name in appearance.own
        }
        balls = appearance.balls if self.style.eyes else []
        self._eyes = [b.eye.side for b in balls if b.open and f"eye_{b.eye.side}" not in appearance.own]
        self._aim(pixel)

    def look(self, view: View) -> None:
        """Look from elsewhere from now on, with lamps and camera as they were made.

        A texture stays filtered for the distance that the scene was made for.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> from facewrinkle.plotting.views import View
        >>> face, style = fw.default_face(), Style(size=(60, 80))
        >>> with Scene(face, style) as scene:
        ...     front = scene.picture(face.mesh)
        ...     scene.look(View((1.0, 0.0, 0.0)))
        ...     side = scene.picture(face.mesh)
        >>> bool((front == side).all())
        False
        """
        self.style = replace(self.style, view=view)
        self.plotter.remove_all_lights()
        pixel = height_of(self.face, self.style) / self._window[1]
        before, self._relief = self._relief, self._relief_at(pixel)
        if before is not None or self._relief is not None:
            self._coloring = None  # the skin's shader is another
        self._aim(pixel)
        self._shown = None

    def color_by(self, scalars: str) -> None:
        """Color the skin by another field from now on, in a scene whose style has one.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> frame = fw.Simulation(face).step()
        >>> with Scene(face, Style(size=(60, 80), scalars="W")) as scene:
        ...     by_height = scene.picture(frame)
        ...     scene.color_by("level")
        ...     by_level = scene.picture(frame)
        >>> bool((by_height == by_level).all())
        False
        """
        if self.style.scalars is None:
            raise ParameterError("the skin of this scene is not colored by a field: make it of a Style with scalars.")
        self.style = replace(self.style, scalars=scalars)
        for title in list(self.plotter.scalar_bars.keys()):
            self.plotter.remove_scalar_bar(title, render=False)
        self._shown = None

    def _relief_at(self, pixel: float) -> Relief | None:
        """The relief of the skin, if it is to be drawn and such pixels show it."""
        drawn = self._visible is not None and not self.style.quick and self.style.microrelief
        return Relief(self.face, pixel, self._window[1]) if drawn and Relief.seen(self.face, pixel) else None

    def _aim(self, pixel: float) -> None:
        """Place the camera, and make the hairs, of which none is drawn thinner than a pixel."""
        appearance = self._appearance
        aim(self.plotter, self.face, self.style)
        hairy = self.style.brows and self.style.scalars is None and not self.style.clay
        lashes = appearance.lashes if hairy and self.style.eyes else []
        self._lashes = {row.eye.side: row.cards(pixel) for row in lashes}
        self._bound = {name: hair.cards(pixel) for name, hair in appearance.bound_hair.items()} if hairy else {}

    def show(self, frame: pv.PolyData) -> None:
        """Put a frame of :meth:`facewrinkle.Simulation.step`, or ``face.mesh``, in place of the one before.

        The same frame is not sent to the graphics card again, unless it was modified as VTK counts it; its eyes are, if
        the camera moved.
        """
        self._wait()
        check_type("frame", frame, pv.PolyData)
        now, camera = (frame, frame.GetMTime()), tuple(self.plotter.camera.position)
        known = self._shown is not None and self._shown[0] is frame and self._shown[1] == now[1]
        if known and self._seen_from == camera:
            return
        seen = self._appearance.at(frame)
        if known and not (self._visible is not None and self._visible.by_view):
            self._show_eyes(seen)
        else:
            self._show_parts(seen)
        self._shown, self._seen_from = now, camera

    def _show_parts(self, seen: Seen) -> None:
        self._key = self._key_light(seen)
        self._show_skin(seen)
        if self._key is not None:
            send_background(self._actors["skin"], self.plotter.renderer)
        self._show_mouth(seen)
        self._show_eyes(seen)
        self._show_hair(seen)
        for name, part in seen.own.items():
            texture, lighting = self._own_textures[name], EYE_LIGHTING if name.startswith("eye") else HAIR_LIGHTING
            strands = name == "hair" and texture is None
            look = {"material": "hair", **LOCKS} if strands else lighting
            part = self._key.on_part(part, posed=True) if strands and self._key is not None else part
            self._put(part, f"{OWN_PREFIX}{name}", texture=texture, **look)
        self._pose(seen.pose)

    def show_muscles(self, frame: pv.PolyData, rates: Mapping[str, float]) -> None:
        """Show the fibers of muscles in a frame, as if its skin were translucent, colored by contraction.

        They stay in the pictures that follow; show them again for another frame or view.

        Parameters
        ----------
        frame : PolyData
        rates : dict of str to float
            Contractions by muscle, 0 to 1.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> with Scene(face, Style(size=(60, 80))) as scene:
        ...     before = scene.picture(face.mesh)
        ...     scene.show_muscles(face.mesh, {"zygomaticus_major_l": 1.0})
        ...     bool((before == scene.picture(face.mesh)).all())
        False
        """
        self._wait()
        camera, pixel = np.array(self.plotter.camera.position), height_of(self.face, self.style) / self._window[1]
        ribbons = Fibers.of(self.face).ribbons(frame, rates, camera, pixel)
        self._put(ribbons, "muscles", lighting=False, opacity=OPACITY)

    def _pose(self, pose: Array) -> None:
        """Move what was made on the head at rest along with the head, or the rest to it."""
        back, stay = np.linalg.inv(pose), np.eye(4)
        for name, actor in self._actors.items():
            posed = name == "skin" or name.startswith(OWN_PREFIX)  # as the frame has them
            followed, seen = (back, stay) if posed else (stay, pose)
            actor.user_matrix = followed if self.style.follow else seen

    def _key_light(self, seen: Seen) -> KeyLight | None:
        """The key light on a frame; None where none is drawn, or there is no skin to tell which way is up."""
        if self._visible is None or self.style.quick:
            return None
        lamp = self.plotter.renderer.lights[0]
        towards = np.subtract(lamp.position, lamp.focal_point)
        return KeyLight(self.face, seen, towards / np.linalg.norm(towards), self.style.follow)

    def _show_skin(self, seen: Seen) -> None:
        drawn = seen.skin if self._visible is None else seen.smooth.mesh
        skin, options = drawn.copy(deep=False), dict(SKIN_LIGHTING)
        viewpoint = np.append(self.plotter.camera.position, 1.0)
        viewpoint = (seen.pose @ viewpoint if self.style.follow else viewpoint)[:3]
        textured = self._texture is not None and skin.active_texture_coordinates is not None and not self.style.clay
        paint = None if self.style.scalars is not None else self._paint(seen, textured)
        if paint is not None:
            skin.point_data["paint"] = paint  # colors, or factors of those of the texture
        if self._relief is not None:
            skin.point_data[RELIEF] = self._relief.on(seen.skin, seen.smooth.split)
        if self._key is not None:
            reached = self._key.on_skin(hairy=bool(self._bound))
            if self.plotter.renderer.GetTexturedBackground():
                reached[:, 3] = 1.0
            skin.point_data[REACHED] = reached
        if self._visible is not None:
            skin = self._visible.of(skin, viewpoint)
        if self.style.scalars is not None:
            self._add(skin, "skin", **(options | field_coloring(skin, self.style.scalars, self._window[1])))
            return
        if textured:
            skin = split_at_seams(skin)
        if self._coloring == (textured, paint is None):
            self._actors["skin"].GetMapper().SetInputData(skin)
            return
        self._coloring = textured, paint is None
        options |= {"texture": self._texture} if textured else {"color": "white" if paint is not None else PLAIN_COLOR}
        if self.style.wireframe:
            options |= {"show_edges": True, "edge_color": "#241a16", "line_width": self._samples, "edge_opacity": 0.75}
        material = CLAY_MATERIAL if self.style.clay else SKIN_MATERIAL
        self._add(skin, "skin", material, tinted=paint is not None, **options)
        send(self._actors["skin"], *(name for name in (RELIEF, REACHED) if name in skin.point_data))
        mapper = self._actors["skin"].GetMapper()
        mapper.SetInputData(skin)
        mapper.SetScalarVisibility(paint is not None)
        mapper.SetColorModeToDirectScalars()
        mapper.SetScalarModeToUsePointFieldData()
        mapper.SelectColorArray("paint")

    def _paint(self, seen: Seen, textured: bool) -> npt.NDArray[Any] | None:
        """Colors of the vertices, or factors of those of the texture; None if there are none."""
        paint = None
        if self.style.clay:
            paint = _clay(seen.skin.n_points, seen.shade)
        elif textured:
            paint = seen.shade
        elif has_colors(seen.skin.point_data):
            paint = np.asarray(seen.skin.point_data[COLORS])
        elif self._appearance.painter is not None:
            paint = seen.paint
        if paint is None or self._visible is None:
            return paint
        paint = seen.smooth.split.values(paint)
        if self._key is not None and not self.style.clay:
            paint = np.rint(paint * seen.flush).astype(np.uint8)
        return paint

    def _show_mouth(self, seen: Seen) -> None:
        if seen.pocket is not None:
            self._put_all({"mouth": seen.pocket}, "mouth", lighting=False)
        self._put_all(self._in_shade(seen.inside_mouth), "in mouth", TEETH_MATERIAL)
        if "in mouth" in self._actors:
            self._actors["in mouth"].visibility = bool(seen.inside_mouth)

    def _show_eyes(self, seen: Seen) -> None:
        camera = np.array(self.plotter.camera.position)
        if self.style.follow:
            camera = (seen.pose @ np.append(camera, 1.0))[:3]
        shown = seen.eyes_from(camera)
        eyes = {f"eye_{side}": shown[side] for side in self._eyes}
        if self.style.clay:
            eyes = {name: eye.copy(deep=False) for name, eye in eyes.items()}
            for eye in eyes.values():
                eye.point_data["paint"] = _clay(eye.n_points)
        self._put_all(self._in_shade(eyes), "eyes", EYE_MATERIAL, **EYE_LIGHTING)
        rims = {f"rim_{side}": rim for side, rim in seen.lid_margins.items()} if self.style.eyes else {}
        self._put_all(self._in_shade(rims), "rims", SKIN_MATERIAL, **SKIN_LIGHTING)

    def _in_shade(self, parts: Mapping[str, pv.PolyData]) -> Mapping[str, pv.PolyData]:
        """Painted parts in the shadow of the skin."""
        return parts if self._key is None else {name: self._key.on_part(part) for name, part in parts.items()}

    def _show_hair(self, seen: Seen) -> None:
        lashes = {f"lashes_{side}": cards.along(seen.lashes[side]) for side, cards in self._lashes.items()}
        # Backs of hairs are on the far side of the head, but lashes are seen from both sides.
        hair = {name: ribbons.append_polydata(ribbons.flip_faces()) for name, ribbons in lashes.items()}
        hair |= {name: cards.along(seen.bound_hair[name]) for name, cards in self._bound.items()}
        self._put_all(hair, "hair", "hair", culling="back", **LOCKS)

    def draw(self, frame: pv.PolyData) -> None:
        """Show a frame, and render."""
        self.show(frame)
        window_of(self.plotter).Render()

    def picture(self, frame: pv.PolyData) -> Image:
        """Return the picture of a frame: ndarray of uint8, shape (height, width, 3)."""
        return self.begun(frame)()

    def begun(self, frame: pv.PolyData) -> Callable[[], Image]:
        """Begin the picture of a frame, and return a function that waits for it and returns it.

        Other things can be done meanwhile; the scene itself waits for it before it shows another frame.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> with Scene(face, Style(size=(60, 80))) as scene:
        ...     picture = scene.begun(face.mesh)
        ...     picture().shape
        (80, 60, 3)
        """
        self.show(frame)
        return self._begun()

    def _begun(self) -> Callable[[], Image]:
        self._drawing = cache(begun(self.plotter, self._samples))
        return self._drawing

    def cut_out(self, draw: Callable[[], Image]) -> Image:
        """Return a picture of this scene with nothing behind: ndarray of uint8, shape (height, width, 4).

        Parameters
        ----------
        draw : callable
            Returns the picture; called twice, over black and over white, whose difference tells the opacity.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> with Scene(face, Style(size=(60, 80))) as scene:
        ...     image = scene.cut_out(lambda: scene.picture(face.mesh))
        >>> image.shape, int(image[0, 0, 3]), int(image[40, 30, 3])
        ((80, 60, 4), 0, 255)
        """
        renderer, over = self.plotter.renderer, []
        for ground in ("black", "white"):
            renderer.set_background(ground)
            self._shown = None  # the end of a bust goes over into the background
            over.append(draw().astype(float))
        renderer.set_background(BACKGROUND[0], top=BACKGROUND[1])
        self._shown = None
        clear = np.clip((over[1] - over[0]).mean(axis=2, keepdims=True) / 255.0, 0.0, 1.0)
        color = over[0] / np.maximum(1.0 - clear, 1.0 / 255.0)
        return np.rint(np.dstack([np.clip(color, 0.0, 255.0), 255.0 * (1.0 - clear)])).astype(np.uint8)

    def _wait(self) -> None:
        """Take the picture that was begun, before anything in the scene changes."""
        if self._drawing is not None:
            self._drawing()
            self._drawing = None

    def close(self) -> None:
        """Free the window and all that is drawn in it."""
        self._wait()
        self.plotter.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _put_all(
        self,
        parts: Mapping[str, pv.PolyData],
        name: str,
        material: Material | Literal["hair"] | None = None,
        **options: Any,
    ) -> None:
        """Show painted parts of one look as one actor: each that is drawn by itself costs a millisecond more."""
        self.drawn_parts[name] = frozenset(parts)
        if not parts:
            return
        first, *others = parts.values()
        self._put(first.append_polydata(*others), name, material=material, **options)

    def _put(self, part: pv.PolyData, name: str, texture: pv.Texture | None = None, **options: Any) -> None:
        """Add a part that has `paint` or a texture, in place of the one that had this name before."""
        if name not in self._actors:
            known = part.copy(deep=False)
            colors: dict[str, Any] = {"scalars": "paint", "rgb": True} if texture is None else {"texture": texture}
            self._add(known, name, **colors, **options)
            if STRAND_AT in known.point_data:
                send(self._actors[name], STRAND_AT, ALONG)
            self._actors[name].GetMapper().SetInputData(known)  # PyVista puts a filter before it, in Python
        else:
            known = self._actors[name].GetMapper().GetInput()
            known.ShallowCopy(part)  # by VTK's own functions, as PyVista's take longer than the drawing
        data = known.GetPointData()
        data.SetActiveNormals("Normals" if data.HasArray("Normals") else None)
        data.SetActiveScalars("paint" if texture is None else None)

    def _add(
        self,
        mesh: pv.PolyData,
        name: str,
        material: Material | Literal["hair"] | None = None,
        tinted: bool = False,
        **options: Any,
    ) -> None:
        defaults = {"smooth_shading": False, "show_scalar_bar": False, "reset_camera": False, "render": False}
        quick = self.style.quick
        if isinstance(material, Material) and not quick:
            options |= {"ambient": 1.0, "diffuse": 1.0}
        actor = self.plotter.add_mesh(mesh, name=name, **{**defaults, **options})
        actor.prop.interpolation, actor.prop.specular_color = "phong", "white"  # not that of the theme, light blue
        self._actors[name] = actor
        textured = "texture" in options
        if material == "hair":
            hair(actor, 0 if quick else len(LIGHTS), STRAND_AT in mesh.point_data)
        elif material is not None and not quick:
            relief = self._relief.shading if name == "skin" and self._relief is not None else None
            reached = name == "skin" and self._key is not None
            material.apply(actor, len(LIGHTS), textured, tinted, bool(options.get("show_edges")), relief, reached)


def _clay(n: int, shade: npt.NDArray[np.uint8] | None = None) -> npt.NDArray[np.uint8]:
    """Colors (n, 3) of clay, times factors of furrows (n, 3), as bytes."""
    factors = np.full((n, 3), 255, np.uint8) if shade is None else shade
    return np.asarray(np.array([196, 184, 172]) / 255.0 * factors, dtype=np.uint8)


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
