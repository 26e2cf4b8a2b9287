"""Pictures of tears that look wet: the scene behind them is drawn first, and then seen through them.

The scene goes into a texture. The fragment shader of a tear refracts the line of sight, looks up the color that it
meets in the texture, and adds a Fresnel reflection of the studio, a highlight, and the light that the bead gathers on
its far side.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pyvista as pv

from ..anatomy import Face
from ..array_types import Image
from ..geometry import unit
from .images import rendered, window_of
from .scene import Scene
from .shaders import send
from .views import LIGHTS, VIEW_ANGLE, Style

FULLY_WET = 0.06
"""Thickness from which a film of tears darkens the skin and shines in full, mm; at a quarter of it none is seen."""

STUDIO = """
vec3 studio(vec3 r, vec3 around, float bead)
{
  float box = smoothstep(0.0, 0.05, 0.18 - abs(dot(r, %(side)s)));
  box *= bead * smoothstep(0.0, 0.05, 0.45 - abs(dot(r, %(up)s)));
  box *= step(0.0, dot(r, %(key)s));
  float strip = bead * smoothstep(0.90, 0.97, dot(r, %(fill)s));
  vec3 room = mix(0.85 * around, vec3(0.62, 0.64, 0.67), 0.8 * smoothstep(-0.3, 0.9, r.y));
  vec3 lamps = clamp(vec3(dot(r, %(key)s), dot(r, %(fill)s), dot(r, %(rim)s)), 0.0, 1.0);
  float glow = dot(pow(lamps, vec3(32.0)), vec3(1.0, 0.45, 0.6));
  return room + 24.0 * (1.0 - bead) * glow + 24.0 * box * vec3(1.0, 0.97, 0.92) + 5.0 * strip * vec3(0.85, 0.92, 1.0);
}
"""
"""Light of the studio from a direction `r`: a room colored by the skin, and in a bead a lamp with soft edges and a
strip light. In a film the relief of the skin blurs the lamps.
"""

TEAR_COLOR = """//VTK::Light::Impl
  vec3 seen = normalize(vertexVC.xyz);
  vec3 skin = normalize(underVSOutput);
  float film = smoothstep(0.25 * %(film).8f, %(film).8f, depthVSOutput);  // at its edge it ends in the skin
  float bead = smoothstep(0.0, %(bead).8f, depthVSOutput);
  // A film clings to the relief of the skin: its slopes are steeper than those that its triangles show.
  vec3 surface = normalize(normalVCVSOutput + (1.0 - bead) * (normalVCVSOutput - skin));
  vec3 bent = refract(seen, surface, 1.0 / %(index)s);
  vec3 meets = vertexVC.xyz + bent * depthVSOutput / max(dot(-bent, skin), 0.25);
  vec2 place = 0.5 + 0.5 * %(focal)s * vec2(meets.x / %(aspect)s, meets.y) / -meets.z;
  vec3 color = texture(behind, clamp(place, 0.001, 0.999)).rgb;
  float facing = clamp(dot(-seen, surface), 0.0, 1.0);
  vec3 tilt = surface - dot(surface, skin) * skin;
  vec3 towards = %(key)s - dot(%(key)s, skin) * skin;
  float lit = dot(tilt, normalize(towards + 1e-5));
  float mirrored = film * (0.02 + 0.98 * pow(1.0 - facing, 5.0));
  color *= mix(vec3(1.0), vec3(0.97, 0.955, 0.945), film);  // wet skin is darker, and redder
  color *= 1.0 + bead * (1.0 * clamp(-lit, 0.0, 1.0) - 0.25 * clamp(lit, 0.0, 1.0));
  color = color * (1.0 - mirrored) + mirrored * studio(reflect(seen, surface), color, bead);
  gl_FragData[0] = vec4(min(color, vec3(1.0)), 1.0);
"""
"""The color of a tear, from the scene behind it and the studio around."""


class TearScene(Scene):
    """A scene with tears.

    Parameters
    ----------
    face : Face
    style : Style, optional

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> tear = fw.SheddingTear(face, start="l")
    >>> with TearScene(face, Style(size=(60, 80))) as scene:
    ...     scene.picture(face.mesh, [tear.surface(1.0)]).shape
    (80, 60, 3)
    """

    def __init__(self, face: Face, style: Style | None = None) -> None:
        super().__init__(face, style)
        self._tears: list[Any] = []
        width, height = self.style.size
        focal = f"{1.0 / np.tan(np.radians(VIEW_ANGLE / 2.0)):.6f}"
        room, color = tear_code(f"{width / height:.6f}", focal, FULLY_WET / face.unit)
        varyings = "{0} float depthVSOutput;\n{0} vec3 underVSOutput;\n"
        begin, end = "//VTK::Normal::Dec", "//VTK::Normal::Impl"
        self._shaders = {  # the thickness of a tear and the normal of the skin under it are handed on to the pixels
            ("vertex", begin): f"{begin}\nin float thicknessMC;\nin vec3 underMC;\n{varyings.format('out')}",
            ("vertex", end): f"{end}\n  depthVSOutput = thicknessMC;\n  underVSOutput = normalMatrix * underMC;\n",
            ("fragment", begin): f"{begin}\n{varyings.format('in')}{room}",
            ("fragment", "//VTK::Light::Impl"): color,
        }

    def draw(self, frame: pv.PolyData, tears: Iterable[pv.PolyData] = ()) -> None:
        """Show a frame and tears, and render twice."""
        self._show_all(frame, tears)
        window_of(self.plotter).Render()

    def picture(self, frame: pv.PolyData, tears: Iterable[pv.PolyData] = ()) -> Image:
        """Return the picture of a frame with tears: ndarray of uint8, shape (height, width, 3)."""
        return self.begun(frame, tears)()

    def begun(self, frame: pv.PolyData, tears: Iterable[pv.PolyData] = ()) -> Callable[[], Image]:
        """Begin the picture of a frame with tears; see :meth:`Scene.begun`."""
        self._show_all(frame, tears)
        return self._begun()

    def _show_all(self, frame: pv.PolyData, tears: Iterable[pv.PolyData]) -> None:
        """Show a frame and tears; if there are any, the frame is rendered before."""
        self._wait()
        for actor in self._tears:
            self.plotter.renderer.RemoveActor(actor)
        self.show(frame)
        self._tears, tears = [], list(tears)
        if tears:
            behind = pv.Texture(rendered(self.plotter))
            behind.interpolate = True
            self._tears = [self._wet(tear, behind) for tear in tears]

    def _wet(self, tear: pv.PolyData, behind: pv.Texture) -> Any:
        actor = pv.Actor()
        send(actor, "thickness", "under")
        actor.GetMapper().SetInputData(tear)
        actor.GetMapper().ScalarVisibilityOff()
        actor.prop.interpolation, actor.prop.culling = "phong", "back"
        actor.prop.SetTexture("behind", behind)
        for (shader, place), code in self._shaders.items():
            actor.add_shader_replacement(shader, place, code)
        self.plotter.renderer.AddActor(actor)
        return actor


def tear_code(aspect: str, focal: str, film: float) -> tuple[str, str]:
    """Return the function of the studio's light, and the statements that color a tear, as GLSL.

    They read and write the variables of VTK's shaders.

    Parameters
    ----------
    aspect, focal : str
        Names or numbers: width over height of the picture, and its focal length in halves of its height.
    film : float
        Thickness from which a film of tears darkens the skin in full, in the unit of the mesh.
    """
    key, fill, rim = (unit(np.array(direction)) for direction, _, _ in LIGHTS)
    side = unit(np.cross([0.0, 1.0, 0.0], key))
    directions = {"key": key, "fill": fill, "rim": rim, "side": side, "up": np.cross(key, side)}
    values: dict[str, Any] = {name: "vec3({:.6f}, {:.6f}, {:.6f})".format(*x) for name, x in directions.items()}
    values |= {"index": 1.33, "aspect": aspect, "focal": focal, "film": film, "bead": 10.0 * film}
    return STUDIO % values, TEAR_COLOR % values
