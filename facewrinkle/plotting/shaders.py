"""Skin, eyes, teeth and hair under the lights of a scene: shaders, and what that of the skin is told of its relief.

Light enters skin and comes out again around the place where it entered, red light the farthest: the border
between light and shade is soft and warm. Light that is reflected at the surface is not colored by the skin, and grows
towards the outline. Colors are taken as square roots of reflectances. The back of skin, in holes and masks, is dim
and red.

Pores and fine furrows: lights are worked out at the corners of triangles; a pixel adds what the slope of the relief
there changes. Slopes are differences from pixel to pixel, of heights that belong to places on the skin at rest: they
grow where the skin is compressed, and flatten where it is stretched.

What changes slowly over a triangle is worked out at its corners: scattered light, and the directions in which the
highlights are. In software a pixel costs as much as its shader has operations.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer

from ..anatomy import Face, per_face
from ..anatomy.long_hair import STRAND_AT
from ..anatomy.parts import ALONG
from ..appearance.skin_paint import DEPTH, FIELD, OLD_DEPTH, OLD_FIELD, relief_strength
from ..array_types import Array, IntArray
from ..geometry import smoothstep, vertex_normals
from ..geometry.smooth_split import SmoothSplit
from ..mesh.arrays import AGE, is_frame, rest_of
from .views import VIEW_ANGLE

SLOW = """
  {
  vec3 N = normalize(normalVCVSOutput);
  vec3 towards = normalize(-%(place)s.xyz);
  facing = dot(N, towards);
  float glance = 1.0 - max(facing, 0.0);
  float fresnel = 1.0 + 4.0 * glance * glance * glance;
  vec3 open = vec3(%(open)s);
  open /= open + (1.0 - open) * vec3(%(closed)s); // skin throws light at skin
  vec3 reach;
  scattered = mix(vec3(%(below)s), vec3(%(above)s), 0.5 + 0.5 * N.y) * open;
  vec3 bleed = vec3(%(bleed)s);
  glints = vec3(0.0);
  %(lit)s
  %(lean)s
  vec3 tint = %(tint)s;
  scattered *= tint * tint;
  }
"""

SLOW_OF_LIGHT = """
  {
    float slope = -dot(N, lightDirectionVC%(number)d);
    reach = %(reach)s;
    scattered += clamp((bleed + slope) / (1.0 + bleed), 0.0, 1.0) * lightColor%(number)d * reach;
    float seen = fresnel * clamp(4.0 * slope, 0.0, 1.0) * reach.g * %(bare)s;
    vec3 halfway = normalize(towards - lightDirectionVC%(number)d);
    %(statement)s
  }
"""

SHARP = """gleam%(number)d = seen;
    vec3 aside = normalize(cross(vec3(0.0, 1.0, 0.0), halfway));
    mirror%(number)d = vec3(sqrt(%(bare)s) * vec2(dot(N, aside), dot(N, cross(halfway, aside))), dot(N, halfway));"""
"""The normal, in axes of which the last is half-way between light and camera; what is glossier has a smaller highlight.
"""

BLURRED = """vec3 C = lightColor%(number)d;
    float near = max(dot(N, halfway), 0.0);
    near *= inversesqrt(mix(%(bare)s, 1.0, near * near)); // what is glossier has a smaller highlight
    %(powers)s
    glints += C * (seen * (%(shine)s));"""

FRAGMENT = """
  vec3 albedo = %(albedo)s;
  vec3 shine = glints;
  %(bumps)s
  %(lit)s
  albedo *= albedo;
  vec3 lit = albedo * %(light)s + (%(gloss)s) * shine;
  %(behind)s
  fragOutput0 = vec4(sqrt(lit * (4.0 * lit + 0.05) / (lit * (2.3 * lit + 2.5) + 0.14)), opacity);
  %(far)s
"""

FRAGMENT_OF_LIGHT = """
  {
    vec3 C = lightColor%(number)d;
    vec3 mirrored = mirror%(number)d * inversesqrt(dot(mirror%(number)d, mirror%(number)d));
    float near = max(mirrored.z, 0.0);
    %(bumped)s
    %(powers)s
    shine += C * (gleam%(number)d * (%(shine)s));
  }
"""


def developed(light: Array) -> Array:
    """Return the brightness, 0 to 1, of light in a picture, as the last line of the shaders has it.

    It is the curve of a film: shadows sink, what is in between keeps its contrast, and highlights are held.

    Examples
    --------
    >>> developed(np.array([0.0, 0.03, 0.3, 1.0, 2.0])).round(2)
    array([0.  , 0.15, 0.58, 0.91, 1.06])
    """
    return np.asarray(np.sqrt(light * (4.0 * light + 0.05) / (light * (2.3 * light + 2.5) + 0.14)))


RELIEF, REACHED = "relief", "reached"
"""Arrays of a drawn skin: what :class:`Relief` gives each vertex; its openness, and its share of the key light."""

LEAN = """
  {
    vec3 halfway = normalize(towards - lightDirectionVC0);
    lean = halfway.xy - dot(N, halfway) * N.xy;
    plane = floor(reliefMC.w);
    float strength = fract(reliefMC.w) * smoothstep(0.1, 0.5, facing);
    ground = vec4(reliefMC.xyz, strength * %(depth)s / (%(pixel)s * -vertexVCVSOutput.z));
  }
"""
"""Change of the highlight's cosine by a slope to the right, and upwards; the skin at rest, in fields of the relief."""

BUMPS = """
  vec2 spot = plane < 0.5 ? ground.xy : plane < 1.5 ? ground.zy : ground.xz;
  vec2 corner = floor(spot - 0.5), inside = (spot - corner) * 72000.0;
  ivec2 field = ivec2(corner) * ivec2(0x27d4eb2d, 0x165667b1);
  float nearest = 1e12, next = 1e12, pore = 1e12;
  for (int k = 0; k < 4; k++) {
    int drawn = field.x + field.y + (k & 1) * 0x27d4eb2d + (k >> 1) * 0x165667b1;
    drawn *= drawn ^ (drawn >> 15);
    vec2 away = vec2(drawn & 0xffff, drawn >> 16) + (vec2(k & 1, k >> 1) * 72000.0 + vec2(3232.0, 36000.0) - inside);
    float square = dot(away, away);
    next = min(next, max(nearest, square));
    nearest = min(nearest, square);
    pore = min(pore, square + float(drawn & 0x300) * 1e8);
  }
  vec2 dent = vec2(next - nearest, pore) * vec2(1.0 / 1.2e9, 1.0 / 3.6e8);
  dent = max(1.0 - dent * dent, 0.0);
  float height = -ground.w * dot(dent * dent, vec2(0.55, 1.8));
  vec2 bump = vec2(dFdx(height), dFdy(height));
  float tilt = clamp(dot(lean, bump), -0.5, 0.5);
"""
"""Slopes of the relief from one pixel to the next.

Fields are those of points that are nearest to one of the points scattered on a lattice, pores some of the points; the
lattice lies along that plane of the axes which the triangle faces at rest.
"""

HAIR_VERTEX = """
  {
  vec3 N = normalize(normalVCVSOutput), towards = normalize(-vertexVCVSOutput.xyz);
  vec4 paint = vertexColorVSOutput;
  opaque = paint.a;
  vec3 soft = vec3(0.0), softBehind = vec3(0.0), sharp = vec3(0.0), sharpBehind = vec3(0.0);
  float slope, mirrored;
  %(lights)s
  inFront = %(ambient)s * paint.rgb + %(diffuse)s * soft * paint.rgb + %(specular)s * sharp;
  behind = %(ambient)s * paint.rgb + %(diffuse)s * softBehind * paint.rgb + %(specular)s * sharpBehind;
  %(underside)s
  }
"""

HAIR_OF_LIGHT = """
  slope = %(slope)s;
  soft += max(slope, 0.0) * lightColor%(number)d;
  softBehind += max(-slope, 0.0) * lightColor%(number)d;
  mirrored = pow(max(%(mirrored)s, 1e-5), %(specular_power)s);
  if (slope > 0.0) sharp += mirrored * lightColor%(number)d;
  else sharpBehind += mirrored * lightColor%(number)d;
"""

GLINT_OF_LIGHT = """
  glint%(number)d = vec2(dot(alongVC, normalize(towards - lightDirectionVC%(number)d)), smoothstep(-0.2, 0.6, slope));
"""
"""Cosine between a hair and the half-way direction, and how far the light gets there."""

LOCKS = {"ambient": 0.3, "diffuse": 0.7, "specular": 0.1, "specular_power": 14.0}
"""How hair reflects light: options of `add_mesh`."""

UNDERSIDE = """
  inFront = behind = mix(0.45 * behind, inFront, smoothstep(-0.4, 0.0, dot(N, towards)));
"""
"""Little light gets under locks: on the far side of the head one sees their backs, but not where they twist, as their
normals point away from the head.
"""

STRANDED = """
  float level = max(log2(fwidth(strand.x)), 0.0), wide = exp2(floor(level));
  vec4 among = vec4(1.0, 1.0, 0.5, 0.5) * strand.x / wide;
  vec4 drawn = fract((floor(among) + vec4(0.0, 1.0, 0.0, 1.0)) * 0.1031);
  drawn *= drawn + 33.33;
  drawn = fract(2.0 * drawn * drawn);
  vec2 streaks = mix(drawn.xz, drawn.yw, fract(among.xz));
  float streak = mix(streaks.x, streaks.y, fract(level)), end = 0.07 * drawn.x;
  fragOutput0.rgb *= 1.0 + (streak - 0.5) * vec3(0.75, 0.8, 0.87);
  vec3 shine = vec3(0.0);
  vec2 shifts = vec2(0.12, -0.15) + vec2(0.1, 0.25) * (streak - 0.5), lobes;
  %(shine)s
  fragOutput0.rgb += shine;
  if (strand.y < end || strand.y > 1.0 - end) fragOutput0.a = 0.0;
"""
"""Strands of a lock differ in brightness, the dark ones also in hue, as those have more pigment, and begin and end
unevenly: 2, 4, 8 as one where pixels do not show each.
"""

SHINE_OF_LIGHT = """
  lobes = shifts + glint%(number)d.x;
  lobes = exp(vec2(-70.0, -10.0) * lobes * lobes);
  shine += glint%(number)d.y * lightColor%(number)d * (0.1 * lobes.x + 0.4 * lobes.y * fragOutput0.rgb);
"""
"""Light runs in bands across hair (Kajiya and Kay): a narrow white one from its surface, whose scales tilt it to the
roots, and a wide one in the color of hair, through it and to the tips (Marschner et al.); strand by strand.
"""

TEXTURED = "texture(actortexture, tcoordVCVSOutput).rgb"


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
        Share of light that is reflected at the surface, by the light's color `C`, the cosine `near` between the normal
        and the half-way direction, and powers of it (`near8`); of sharp highlights also by the normal `mirrored`, in
        axes of which the last is that direction.
    gloss : str
        Factor of it, by the `albedo` of a pixel, its reflectance.
    sharp : int
        Number of lights, the first of them, whose highlights are worked out pixel by pixel.
    behind : str
        A statement that changes `lit` where the back of the surface is seen.
    seeping : str
        Shares of the key light's red, green and blue that get into its shadow, from the lit skin around it.
    closed : str
        Shares of red, green and blue that hollows take, for all that their walls throw at each other.
    """

    below: str
    above: str
    bleed: str
    shine: str
    gloss: str = "1.0"
    sharp: int = 4
    behind: str = ""
    seeping: str = "0.06, 0.06, 0.06"
    closed: str = "0.67, 0.67, 0.67"

    def code(self, lights: int, textured: bool = False, reached: str = "") -> str:
        """Return the statements of a fragment shader that shade under two to four directional lights, pixel by pixel.

        They read and write the variables of VTK's shaders, in the place of its own lighting, and read what light has
        `reached` the place, if the name of such a variable is given.
        """
        parts, slow, fragment = self._sources(lights, "vertexVC", _albedo(textured), reached=reached)
        return f"{parts['own']}{slow}{fragment}"

    def apply(
        self,
        actor: pv.Actor,
        lights: int,
        textured: bool = False,
        tinted: bool = False,
        edges: bool = False,
        relief: tuple[float, float] | None = None,
        reached: bool = False,
    ) -> None:
        """Draw an actor with this material, under two to four directional lights.

        Parameters
        ----------
        actor : pyvista.Actor
        lights : int
        textured : bool
        tinted : bool
            True if its points have colors besides its texture: factors of those of the texture.
        edges : bool
            Where VTK draws edges, nothing is worked out at the corners: its geometry shader hands on only what it
            knows.
        relief : tuple of float, optional
            Depth of the relief, in the unit of the mesh, and the angle of a pixel, radians, for skin with the array
            `RELIEF`. Not where edges are drawn.
        reached : bool
            True for a mesh with the array `REACHED`. Not where edges are drawn.
        """
        if edges:
            _shade(actor, f"//VTK::Light::Impl\n{self.code(lights, textured)}", textured)
            return
        tint, albedo = (
            ("vertexColorVSOutput.rgb", TEXTURED) if textured and tinted else ("vec3(1.0)", _albedo(textured))
        )
        parts, slow, fragment = self._sources(
            lights, "vertexVCVSOutput", albedo, tint, relief, f"{REACHED}MC" if reached else ""
        )
        declared = "//VTK::Normal::Dec\n"
        actor.add_shader_replacement("vertex", "//VTK::Normal::Dec", f"{declared}{parts['lights']}{parts['sent']}")
        actor.add_shader_replacement("vertex", "//VTK::Light::Impl", f"//VTK::Light::Impl\n{slow}")
        actor.add_shader_replacement("fragment", "//VTK::Normal::Dec", f"{declared}{parts['received']}")
        _shade(actor, f"//VTK::Light::Impl\n{fragment}", textured)

    def _sources(
        self,
        lights: int,
        place: str,
        albedo: str,
        tint: str = "vec3(1.0)",
        relief: tuple[float, float] | None = None,
        reached: str = "",
    ) -> tuple[dict[str, Any], str, str]:
        """Return what is filled in, what changes slowly over a triangle, and what does not, as GLSL."""
        numbers = range(lights)
        parts: dict[str, Any] = {"below": self.below, "above": self.above, "bleed": self.bleed, "shine": self.shine}
        parts |= {
            "closed": self.closed,
            "place": place,
            "albedo": albedo,
            "tint": tint,
            "gloss": self.gloss,
            "behind": self.behind,
        }
        parts["lights"] = "".join(f"uniform vec3 lightColor{k};\nuniform vec3 lightDirectionVC{k};\n" for k in numbers)
        parts["powers"] = """float near2 = near * near, near4 = near2 * near2, near8 = near4 * near4;
    float near16 = near8 * near8, near32 = near16 * near16;"""
        sharp = [k for k in numbers if k < self.sharp]
        shaded = ["vec3 scattered", "vec3 glints", "float facing"]
        shaded += [f"{kind}{k}" for k in sharp for kind in ("vec3 mirror", "float gleam")]
        for name, way in (("sent", "out"), ("received", "in"), ("own", " ")):
            parts[name] = "".join(f"{way} {each};\n" for each in shaded)
        parts |= {"lean": "", "bumps": "", "bumped": "", "light": "scattered"}
        shares = zip(("open", "key", "bare"), "xyz", strict=True)
        parts |= {"far": ""} | {name: f"{reached}.{column}" if reached else "1.0" for name, column in shares}
        if reached == f"{REACHED}MC":
            # The end of a bust goes over into the background, which send_background tells of.
            parts["far"] = "fragOutput0.rgb = mix(mix(bottom, top, gl_FragCoord.y / rows), fragOutput0.rgb, far);"
            parts["sent"] += f"in vec4 {REACHED}MC;\nout float far;\n"
            parts["received"] += "in float far;\n"
            parts["lean"] += f"far = {REACHED}MC.w;"
        if relief is not None:
            parts["lean"] += LEAN % {"depth": f"{relief[0]:.9f}", "pixel": f"{relief[1]:.9f}"}
            parts |= {"bumps": BUMPS, "bumped": "near = clamp(near - tilt - 0.5 * dot(bump, bump), 0.0, 1.0);"}
            # Light that enters the skin comes out again around the place: it shows less of the relief.
            parts["light"] = "scattered * (1.0 - 0.6 * min(gleam0, 1.0) * tilt)"
            parts["sent"] += f"in vec4 {RELIEF}MC;\nout vec2 lean;\nout vec4 ground;\nflat out float plane;\n"
            parts["received"] += "in vec2 lean;\nin vec4 ground;\nflat in float plane;\n"
        slow = ""
        for k in numbers:
            statement = (SHARP if k in sharp else BLURRED) % {**parts, "number": k}
            # What comes from behind grazes all that is seen: hardly any of it gets into hollows.
            grazing = f"pow(open, vec3(lightDirectionVC{k}.z > 0.0 ? 6.0 : 1.0))"
            reach = grazing if k else f"mix(open * vec3({self.seeping}), vec3(1.0), {parts['key']})"
            slow += SLOW_OF_LIGHT % {"number": k, "statement": statement, "reach": reach, "bare": parts["bare"]}
        mirrored = "".join(FRAGMENT_OF_LIGHT % {**parts, "number": k} for k in sharp)
        return parts, SLOW % {**parts, "lit": slow}, FRAGMENT % {**parts, "lit": mirrored}


def hair_code(lights: int, look: Mapping[str, float], strands: bool = False) -> str:
    """Return VTK's own shading of both sides of hairs at their points, under so many lights, or one at the camera.

    Locks of `strands` are dark underneath, and give :func:`strand_code` what it needs.
    """
    shares, shading = {name: f"{share:.6f}" for name, share in look.items()}, ""
    for k in range(max(lights, 1)):
        slope, mirrored = f"-dot(N, lightDirectionVC{k})", f"dot(reflect(lightDirectionVC{k}, N), towards)"
        if not lights:
            slope, mirrored = "N.z", "abs(N.z)"
        shading += HAIR_OF_LIGHT % {"number": k, "slope": slope, "mirrored": mirrored, **shares}
        if strands and lights:
            shading += GLINT_OF_LIGHT % {"number": k}
    return HAIR_VERTEX % {**shares, "lights": shading, "underside": UNDERSIDE if strands else ""}


def strand_code(lights: int) -> str:
    """Return what tells strands of locks from each other, pixel by pixel, under so many lights."""
    return STRANDED % {"shine": "".join(SHINE_OF_LIGHT % {"number": k} for k in range(lights))}


def hair(actor: pv.Actor, lights: int, strands: bool = False) -> None:
    """Draw an actor that has paint with VTK's own shading worked out at its points, and white highlights.

    A hair is a pixel wide, or little more: there is nothing to be seen between its points. Locks are of many strands.

    Parameters
    ----------
    actor : pyvista.Actor
    lights : int
        Number of directional lights; 0 for one light at the camera.
    strands : bool
        True for a mesh with the array :data:`STRAND_AT`.
    """
    uniforms = "".join(f"uniform vec3 lightColor{k};\n" for k in range(max(lights, 1)))
    uniforms += "".join(f"uniform vec3 lightDirectionVC{k};\n" for k in range(lights))
    inputs = "vec3 inFront;\n{0} vec3 behind;\n{0} float opaque;\n"
    outputs = f"//VTK::Normal::Dec\n{uniforms}out {inputs.format('out')}"
    code, color = "", "vec4(gl_FrontFacing ? inFront : behind, opacityUniform * opaque)"
    look = {name: getattr(actor.prop, name) for name in LOCKS}
    vertex = f"//VTK::Light::Impl\n{hair_code(lights, look, strands)}"
    if strands:
        code = strand_code(lights)
        vertex = f"vec3 alongVC = normalMatrix * {ALONG}MC;\n{vertex}  strand = {STRAND_AT}MC;\n"
        sent = "".join(f"{{0}} vec2 {name};\n" for name in ("strand", *(f"glint{k}" for k in range(lights))))
        inputs += sent
        outputs += f"in vec2 {STRAND_AT}MC;\nin vec3 {ALONG}MC;\n{sent.format('out')}"
    actor.add_shader_replacement("vertex", "//VTK::Normal::Dec", outputs)
    actor.add_shader_replacement("vertex", "//VTK::Light::Impl", vertex)
    actor.add_shader_replacement("fragment", "//VTK::Normal::Dec", f"//VTK::Normal::Dec\nin {inputs.format('in')}")
    _shade(actor, f"//VTK::Light::Impl\n  fragOutput0 = {color};\n{code}", textured=False, cut=strands)


def _albedo(textured: bool) -> str:
    """The color of a pixel."""
    return f"diffuseColor * {TEXTURED}" if textured else "diffuseColor"


def _shade(actor: pv.Actor, code: str, textured: bool, cut: bool = False) -> None:
    """Replace the light of a fragment shader, and how a texture colors it; what is clear is left out if it is `cut`."""
    actor.add_shader_replacement("fragment", "//VTK::Light::Impl", code)
    if not cut:
        actor.add_shader_replacement("fragment", "discard;", "")  # with it, depths are written late
    if textured:
        actor.add_shader_replacement("fragment", "//VTK::TCoord::Impl", "")


# Paint that is darker than any skin has no highlights, nor have teeth that no light reaches.
SKIN_MATERIAL = Material(
    "0.100, 0.076, 0.063",  # off skin below: cheeks light the sockets above them
    "0.128, 0.110, 0.104",
    "0.18, 0.14, 0.12",
    "0.030 * near8 + 0.07 * near32 * near8",
    gloss="smoothstep(-0.012, 0.03, albedo.g)",
    sharp=1,
    behind="if (!gl_FrontFacing) lit = vec3(0.085, 0.038, 0.028) * (0.4 + 0.6 * abs(facing));",
    seeping="0.20, 0.08, 0.07",
    closed="0.56, 0.67, 0.72",
)
CLAY_MATERIAL = replace(  # no light enters it
    SKIN_MATERIAL,
    below="0.070, 0.062, 0.058",
    above="0.112, 0.112, 0.112",
    bleed="0.14, 0.14, 0.14",
    seeping=Material.seeping,
    closed=Material.closed,
)
# In an eye one sees the lamps: soft boxes with a bar across.
EYE_MATERIAL = Material(
    "0.10, 0.09, 0.09",
    "0.15, 0.155, 0.165",
    "0.30, 0.22, 0.20",
    "0.03 * near32 + 1.7 * C.g * C.g * step(0.5, near) * smoothstep(0.0, 0.04, 0.075 - abs(mirrored.x))"
    " * smoothstep(0.0, 0.04, 0.115 - abs(mirrored.y)) * (1.0 - 0.5 * smoothstep(0.016, 0.006, abs(mirrored.y)))",
)
TEETH_MATERIAL = Material(
    "0.12, 0.10, 0.09",
    "0.16, 0.155, 0.15",
    "0.25, 0.2, 0.15",
    "0.02 * near8 + 0.5 * C.g * near32 * near32 * near32",
    gloss="smoothstep(0.02, 0.2, albedo.g)",
)


# --- the relief of the skin ------------------------------------------------------------

FADING = (0.08, 0.22)
"""Widths of a pixel, mm on a face of average size, up to which the relief is whole, and from which it is not seen."""

STRONGEST = 2.0
"""Largest strength that can be sent."""


class Relief:
    """The relief of a face, for pictures with pixels of one width.

    Parameters
    ----------
    face : Face
    pixel : float
        Width of a pixel, in the unit of the mesh.
    rows : int
        Pixels from the lower to the upper border of the picture.
    """

    def __init__(self, face: Face, pixel: float, rows: int) -> None:
        self._face, self._angle = face, np.radians(VIEW_ANGLE) / rows
        self._fade = 1.0 - float(smoothstep((pixel / face.frame.scale - FADING[0]) / (FADING[1] - FADING[0])))

    @staticmethod
    def seen(face: Face, pixel: float) -> bool:
        """Return True if a pixel of this width shows anything of a face's relief."""
        return bool(face.landmarks) and pixel < FADING[1] * face.frame.scale

    @property
    def shading(self) -> tuple[float, float]:
        """Depth and angle of a pixel for :meth:`Material.apply`."""
        return STRONGEST * self._fade * self._face.frame.scale * OLD_DEPTH, self._angle

    def on(self, skin: pv.PolyData, split: SmoothSplit | None = None) -> npt.NDArray[np.float32]:
        """Return what the shader needs of each vertex of a frame (n, 4), or of one whose triangles were split.

        These are its place at rest, in fields of the relief, the plane of the axes that it faces there (0: xy, 1: zy,
        2: xz), and as the fraction of the same number the strength, which is less on younger skin. The frame tells the
        age, or else the face.
        """
        age = float(skin.field_data[AGE][0]) if is_frame(skin) and AGE in skin.field_data else max(self._face.age, 0.0)
        points = rest_of(skin).copy()
        make = partial(_on_skin, points, np.asarray(skin.regular_faces), age, self._face)
        relief = per_face(self._face, "relief", (age, points.tobytes()), make)
        if split is None:
            return relief
        plane = np.floor(relief[:, 3])
        places = split.values(np.column_stack([relief[:, :3], relief[:, 3] - plane]))
        places[:, 3] += split.values(plane.astype(np.int32))
        return places


def _on_skin(points: Array, triangles: IntArray, age: float, face: Face) -> npt.NDArray[np.float32]:
    """Return places, planes and strengths (n, 4) of vertices at rest; see :meth:`Relief.on`."""
    facing = np.abs(vertex_normals(points, triangles) @ face.frame.axes.T)
    plane = np.array([1, 2, 0])[facing.argmax(axis=1)]
    own = np.clip(relief_strength(points, face) / STRONGEST, 0.0, 0.999)
    strength = own * ((1.0 - age) * DEPTH + age * OLD_DEPTH) / OLD_DEPTH
    field = (1.0 - age) * np.full(3, FIELD) + age * np.array(OLD_FIELD)
    return np.column_stack([face.frame.local_mm(points) / field, plane + strength]).astype(np.float32)


def send(actor: vtkActor, *arrays: str) -> None:
    """Give an actor a mapper that sends arrays of its mesh to the shader; PyVista's cannot."""
    mapper = vtkPolyDataMapper()
    if (before := actor.GetMapper()) is not None:
        mapper.ShallowCopy(before)
    for array in arrays:
        mapper.MapDataArrayToVertexAttribute(f"{array}MC", array, 0, -1)
    vtkActor.SetMapper(actor, mapper)


def send_background(actor: vtkActor, renderer: vtkRenderer) -> None:
    """Tell the shader of a bust the colors and the height, in pixels, of the background that it ends in."""
    bottom = renderer.GetBackground()
    uniforms = actor.GetShaderProperty().GetFragmentCustomUniforms()
    uniforms.SetUniform3f("bottom", bottom)
    uniforms.SetUniform3f("top", renderer.GetBackground2() if renderer.GetGradientBackground() else bottom)
    uniforms.SetUniformf("rows", renderer.GetRenderWindow().GetSize()[1])
