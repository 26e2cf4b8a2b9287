"""Skin, eyes and teeth under the lights of a scene: fragment shaders, and the shading of furrows.

Light enters skin and comes out again around the place where it entered, red light the farthest: the border
between light and shade is soft and warm. Light that is reflected at the surface is not coloured by the skin, and grows
towards the outline. Colours are taken as square roots of reflectances. The back of skin, in holes and masks, is dim
and red.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.sparse import csr_array

Array = npt.NDArray[np.float64]

SHADER_START = """//VTK::Light::Impl
  vec3 N = normalVCVSOutput;
  vec3 V = normalize(-vertexVC.xyz);
  vec3 albedo = diffuseColor;
  //TEXTURE
  albedo *= albedo;
  vec3 lit = albedo * mix(vec3(%(below)s), vec3(%(above)s), 0.5 + 0.5 * N.y);
  vec3 bleed = vec3(%(bleed)s);
  float glance = 1.0 - max(dot(N, V), 0.0);
  float fresnel = 1.0 + 4.0 * glance * glance * glance;
  vec3 shine = vec3(0.0);
"""

SHADER_OF_LIGHT = """
  {
    vec3 L = -lightDirectionVC%(number)d;
    float slope = dot(N, L);
    vec3 C = lightColor%(number)d;
    lit += albedo * clamp((slope + bleed) / (1.0 + bleed), 0.0, 1.0) * C;
    float near = max(dot(N, normalize(L + V)), 0.0);
    float near2 = near * near, near8 = near2 * near2 * near2 * near2, near32 = near8 * near8 * near8 * near8;
    shine += C * clamp(4.0 * slope, 0.0, 1.0) * (%(shine)s);
  }
"""

SHADER_END = """
  lit += fresnel * shine;
  %(behind)s
  fragOutput0 = vec4(sqrt(lit / (1.0 + 0.22 * lit)), opacity);
"""


@dataclass(frozen=True)
class Material:
    """The way in which a surface reflects light, as GLSL.

    Attributes
    ----------
    below, above : str
        Ambient light from below and from above.
    bleed : str
        Wrap of diffuse light: cosines by which red, green and blue reach past the border of light and shade.
    shine : str
        Share of light that is reflected at the surface, by the light's colour `C`, the cosine `near` between the normal
        and the half-way direction, and powers of it (`near8`).
    behind : str
        A statement that changes `lit` where the back of the surface is seen.
    """

    below: str
    above: str
    bleed: str
    shine: str
    behind: str = ""

    def apply(self, actor: pv.Actor, lights: int, textured: bool = False) -> None:
        """Draw an actor with this material, under a number of directional lights."""
        parts = {"below": self.below, "above": self.above, "bleed": self.bleed}
        code = (
            SHADER_START % parts
            + "".join(SHADER_OF_LIGHT % {"number": k, "shine": self.shine} for k in range(lights))
            + SHADER_END % {"behind": self.behind}
        )
        if textured:
            code = code.replace("//TEXTURE", "albedo *= texture(actortexture, tcoordVCVSOutput).rgb;")
            actor.add_shader_replacement("fragment", "//VTK::TCoord::Impl", "")
        actor.add_shader_replacement("fragment", "//VTK::Light::Impl", code)


# Dark paint has no highlights: hair and furrows on the skin are dull, and so are teeth that no light reaches.
SKIN_MATERIAL = Material(
    "0.060, 0.046, 0.040",
    "0.110, 0.112, 0.120",
    "0.24, 0.13, 0.09",
    "smoothstep(-0.03, 0.2, albedo.g) * (0.022 * near8 + 0.05 * near32 * near8)",
    "if (!gl_FrontFacing) lit = vec3(0.085, 0.038, 0.028) * (0.4 + 0.6 * dot(N, V));",
)
EYE_MATERIAL = Material(
    "0.10, 0.09, 0.09",
    "0.22, 0.23, 0.25",
    "0.30, 0.22, 0.20",
    "0.03 * near32 + 2.2 * C.g * C.g * smoothstep(0.9960, 0.9990, near)",
)
TEETH_MATERIAL = Material(
    "0.05, 0.045, 0.04",
    "0.10, 0.10, 0.11",
    "0.25, 0.2, 0.15",
    "smoothstep(0.02, 0.2, albedo.g) * (0.02 * near8 + 0.25 * C.g * near32 * near32 * near32)",
)

FURROW_SHADE, FURROW_DEPTH = 0.42, 0.6
"""Share of the light that deep furrows lose, and the depth at which they lose two thirds of that, mm."""

FURROW_RINGS = 3
"""Rings of triangles around a vertex that tell furrows from pits: the width of a furrow, as refinement samples it."""


def cavity_shading(skin: pv.PolyData) -> npt.NDArray[np.uint8]:
    """Return factors (n, 3) of a frame's colours, as bytes: furrows get less light, and lose less of the red.

    Dimples, whose walls stand around them instead of facing each other, are shaded by their slopes alone.
    """
    height = np.asarray(skin.point_data["W"], dtype=np.float64)
    dark = -FURROW_SHADE * np.expm1(np.minimum(height, 0.0) / FURROW_DEPTH)
    if dark.any():
        rest = np.asarray(skin.point_data.get("rest", skin.points), dtype=np.float64)  # the skin without its furrows
        dark *= _coherence(rest, np.asarray(skin.regular_faces), height)
    return np.rint(255.0 * (1.0 - dark[:, None] * [0.75, 1.0, 1.0])).astype(np.uint8)


def _coherence(points: Array, triangles: npt.NDArray[np.integer], height: Array) -> Array:
    """Coherence (n,) of the directions in which a height rises around each vertex: 1 on a furrow, 0 in a round pit.

    This is the coherence of the structure tensor: ((p - q) / (p + q))^2 with its two eigenvalues p and q.
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    double_area = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    rise = sum(height[triangles[:, k], None] * side for k, side in enumerate((c - b, a - c, b - a)))
    gradient = np.cross(normal / double_area, rise) / double_area
    tensor = gradient[:, [0, 1, 2, 0, 0, 1]] * gradient[:, [0, 1, 2, 1, 2, 2]]
    spread = csr_array(
        (np.repeat(double_area, 3), triangles.ravel(), np.arange(0, 3 * len(triangles) + 1, 3)),
        shape=(len(triangles), len(points)),
    ).T
    area = np.maximum(spread.sum(axis=1), 1e-300)[:, None]
    around = spread @ tensor / area
    for _ in range(FURROW_RINGS - 1):
        around = spread @ (around[triangles].mean(axis=1)) / area
    trace = around[:, :3].sum(axis=1)
    squares = (around[:, :3] ** 2).sum(axis=1) + 2.0 * (around[:, 3:] ** 2).sum(axis=1)
    coherence = 2.0 * squares / np.maximum(trace**2, 1e-300) - 1.0
    return np.asarray(np.clip(coherence, 0.0, 1.0))
