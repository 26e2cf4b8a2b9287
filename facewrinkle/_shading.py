"""How light falls on skin, eyes and teeth: fragment shaders for the lights of a scene.

Light enters skin and comes out again around where it fell in, red light the farthest: the border between light and
shade is soft and warm. What is reflected at the surface is not coloured by the skin, and grows towards the outline.
Colours are taken as the square roots of what they reflect.
"""

from __future__ import annotations

from dataclasses import dataclass

import pyvista as pv

LIT = """//VTK::Light::Impl
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

EACH = """
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

DONE = """
  lit += fresnel * shine;
  fragOutput0 = vec4(sqrt(lit / (1.0 + 0.22 * lit)), opacity);
"""


@dataclass(frozen=True)
class Surface:
    """How a surface answers light.

    Attributes
    ----------
    below, above : str
        Light from the ground and from the sky, GLSL.
    bleed : str
        How far past the edge of the light red, green and blue light come.
    shine : str
        What is reflected, by `near`, the cosine between the normal and the half-way direction, its powers (`near8`),
        and the light `C`.
    """

    below: str
    above: str
    bleed: str
    shine: str

    def on(self, actor: pv.Actor, lights: int, textured: bool = False) -> None:
        """Have an actor drawn so, under so many directional lights."""
        parts = {"below": self.below, "above": self.above, "bleed": self.bleed}
        code = LIT % parts + "".join(EACH % {"number": k, "shine": self.shine} for k in range(lights)) + DONE
        if textured:
            code = code.replace("//TEXTURE", "albedo *= texture(actortexture, tcoordVCVSOutput).rgb;")
            actor.add_shader_replacement("fragment", "//VTK::TCoord::Impl", "")
        actor.add_shader_replacement("fragment", "//VTK::Light::Impl", code)


# Hair and furrows on the skin are dull.
SKIN = Surface(
    "0.060, 0.046, 0.040",
    "0.110, 0.112, 0.120",
    "0.24, 0.13, 0.09",
    "smoothstep(-0.03, 0.2, albedo.g) * (0.022 * near8 + 0.05 * near32 * near8)",
)
EYE = Surface(
    "0.10, 0.09, 0.09",
    "0.22, 0.23, 0.25",
    "0.30, 0.22, 0.20",
    "0.03 * near32 + 2.2 * C.g * C.g * smoothstep(0.9960, 0.9990, near)",
)
TEETH = Surface(
    "0.05, 0.045, 0.04", "0.10, 0.10, 0.11", "0.25, 0.2, 0.15", "0.02 * near8 + 0.25 * C.g * near32 * near32 * near32"
)
