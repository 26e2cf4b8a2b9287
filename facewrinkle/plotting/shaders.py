"""Skin, eyes and teeth under the lights of a scene: fragment shaders.

Light enters skin and comes out again around the place where it entered, red light the farthest: the border
between light and shade is soft and warm. Light that is reflected at the surface is not coloured by the skin, and grows
towards the outline. Colours are taken as square roots of reflectances. The back of skin, in holes and masks, is dim
and red.
"""

from __future__ import annotations

from dataclasses import dataclass

import pyvista as pv

SHADER_START = """//VTK::Light::Impl
  vec3 N = normalVCVSOutput;
  vec3 V = normalize(-vertexVC.xyz);
  vec3 albedo = diffuseColor;
  //TEXTURE
  albedo *= albedo;
  vec3 lit = albedo * mix(vec3(%(below)s), vec3(%(above)s), 0.5 + 0.5 * N.y);
  vec3 bleed = vec3(%(bleed)s);
  float facing = dot(N, V);
  float glance = 1.0 - max(facing, 0.0);
  float fresnel = 1.0 + 4.0 * glance * glance * glance;
  vec3 shine = vec3(0.0);
"""

SHADER_OF_LIGHT = """
  {
    vec3 L = -lightDirectionVC%(number)d;
    float slope = dot(N, L);
    vec3 C = lightColor%(number)d;
    lit += albedo * clamp((slope + bleed) / (1.0 + bleed), 0.0, 1.0) * C;
    float near = max((slope + facing) * inversesqrt(2.0 + 2.0 * dot(L, V)), 0.0);
    float near2 = near * near, near8 = near2 * near2 * near2 * near2, near32 = near8 * near8 * near8 * near8;
    shine += C * (clamp(4.0 * slope, 0.0, 1.0) * (%(shine)s));
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

    def code(self, lights: int, textured: bool = False) -> str:
        """Return the statements of a fragment shader that shade under a number of directional lights.

        They read and write the variables of VTK's shaders, in the place of its own lighting.
        """
        parts = {"below": self.below, "above": self.above, "bleed": self.bleed}
        code = (
            SHADER_START % parts
            + "".join(SHADER_OF_LIGHT % {"number": k, "shine": self.shine} for k in range(lights))
            + SHADER_END % {"behind": self.behind}
        )
        return code.replace("//TEXTURE", "albedo *= texture(actortexture, tcoordVCVSOutput).rgb;" if textured else "")

    def apply(self, actor: pv.Actor, lights: int, textured: bool = False) -> None:
        """Draw an actor with this material, under a number of directional lights."""
        if textured:
            actor.add_shader_replacement("fragment", "//VTK::TCoord::Impl", "")
        actor.add_shader_replacement("fragment", "//VTK::Light::Impl", self.code(lights, textured))


# Dark paint has no highlights: hair and furrows on the skin are dull, and so are teeth that no light reaches.
SKIN_MATERIAL = Material(
    "0.060, 0.046, 0.040",
    "0.110, 0.112, 0.120",
    "0.24, 0.13, 0.09",
    "smoothstep(-0.03, 0.2, albedo.g) * (0.022 * near8 + 0.05 * near32 * near8)",
    "if (!gl_FrontFacing) lit = vec3(0.085, 0.038, 0.028) * (0.4 + 0.6 * facing);",
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
