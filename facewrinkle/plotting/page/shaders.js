// Programs of the view. The shading of skin, eyes and teeth is that of the toolkit's pictures, handed over by the server.

import { cross, unit } from "./camera.js";
import { BLOOD, KEY, LIGHTS, MATERIALS } from "./materials.js";

const vec = (v) => `vec3(${v.map((x) => x.toFixed(6)).join(", ")})`;
const lights = LIGHTS.map(({ direction, color }, k) =>
  `const vec3 lightDirectionVC${k} = -normalize(${vec(direction)});\nconst vec3 lightColor${k} = ${vec(color)};`).join("\n");

const START = `#version 300 es
precision highp float;
precision highp int;
`;

const CAMERA = `
uniform mat4 view, projection;
uniform vec3 low;
uniform float size;
`;

const ahead = unit(LIGHTS[0].direction), across = unit(cross([0, 1, 0], ahead));

const LAMP = `
const mat3 lamp = mat3(${[across, cross(ahead, across), ahead].map(vec)}); // its axes, the last towards it
uniform vec4 ball; // around the skin, before the camera: middle and radius
vec3 before_lamp(vec3 place) { return (place - ball.xyz) * lamp / ball.w; }
`;

const KEY_LIGHT = `${LAMP}
uniform highp sampler2D depths;
uniform float ray, border; // widths
float hidden(vec2 spot, float far) {
  float behind = far - texelFetch(depths, clamp(ivec2(spot), 0, ${KEY.texels - 1}), 0).r;
  return smoothstep(0.0, float(${KEY.fade / 2}) * ray / ball.w, behind);
}
float key_light(vec3 place, vec3 normal) {
  vec3 out_of = normalize(normal);
  if (dot(out_of, lamp[2]) <= float(${KEY.least})) return 0.0;
  vec3 at = before_lamp(place + float(${KEY.raised}) * ray * (out_of + lamp[2]));
  vec2 spot = float(${KEY.texels / 2}) * (1.0 + at.xy);
  float far = 0.5 - 0.5 * at.z, wide = float(${KEY.texels / 2}) * border / ball.w;
  vec3 facing = out_of * lamp;
  vec2 rise = -0.5 * border / ball.w * facing.xy / max(facing.z, float(${KEY.grazing}));
  float sum = ${KEY.rays.map(([x, y]) => `hidden(spot + wide * vec2(${x}, ${y}), far - max(dot(rise, vec2(${x}, ${y})), 0.0))`).join(" + ")};
  return 1.0 - sum / ${KEY.rays.length}.0;
}
`;

const IN_SHADE = `${KEY_LIGHT}
vec3 in_shade(vec3 paint) { return paint * sqrt(mix(float(${KEY.in_shade}), 1.0, key_light(place, normal))); }
`;

const GROUND = `
uniform vec3 bottom, top;
uniform float rows;
vec3 ground(float row) { return mix(bottom, top, row / rows); }
`;

const shaded = (material, color, inputs = "", result = "fragOutput0.rgb") => `${START}
in vec3 place;
in vec3 normal;
${inputs}
${lights}
out vec4 result;
void main() {
  vec3 normalVCVSOutput = normalize(gl_FrontFacing ? normal : -normal);
  vec4 vertexVC = vec4(place, 1.0), fragOutput0;
  float opacity = 1.0;
  ${color}
  ${MATERIALS[material]}
  result = vec4(${result}, 1.0);
}`;

const MESH_VERTEX = `${START}${CAMERA}
uniform mat4 model;
in vec3 position;
in vec4 small_normal;
in vec3 color;
in vec2 texture_place;
out vec3 place, normal, tint;
out vec2 texture_at;
void main() {
  texture_at = vec2(texture_place.x, 1.0 - texture_place.y);
  vec4 at = view * model * vec4(low + size * position, 1.0);
  place = at.xyz;
  normal = mat3(view) * mat3(model) * small_normal.xyz;
  tint = color;
  gl_Position = projection * at;
}`;

const OWN_INPUTS = `
in vec3 tint;
in vec2 texture_at;
uniform sampler2D photo;
uniform bool textured;
`;

const ownColor = (tint) => `
  vec4 painted = textured ? texture(photo, texture_at) : vec4(${tint}, 1.0);
  if (painted.a < 0.5) discard;
  vec3 diffuseColor = painted.rgb;
`;

const SKIN_VERTEX = `${START}${CAMERA}
in vec3 position;
in vec4 small_normal;
in vec3 color;
in vec2 texture_place;
in vec4 reach; // shares of light: from all sides, of the key light, of the gloss of lips; and how much of the place is drawn
in float value, blood, lit;
uniform bool textured;
out vec3 place, normal, tint;
out vec2 texture_at;
out vec4 reached;
out float shown;
flat out float label;
void main() {
  vec4 at = view * vec4(low + size * position, 1.0);
  place = at.xyz;
  normal = mat3(view) * small_normal.xyz;
  vec3 flush = exp(-blood * ${vec(BLOOD)});
  tint = (textured ? vec3(1.0) : color) * (1.0 - small_normal.w * vec3(0.75, 1.0, 1.0)) * flush / max(max(flush.r, flush.g), max(flush.b, 1.0));
  texture_at = vec2(texture_place.x, 1.0 - texture_place.y);
  reached = reach * vec4(1.0, lit, ${KEY.wet}, 1.0);
  shown = value;
  label = value;
  gl_Position = projection * at;
}`;

const SKIN_INPUTS = `
in vec3 tint;
in vec2 texture_at;
in vec4 reached;
in float shown;
flat in float label;
uniform sampler2D photo, colors;
uniform bool textured, field, labels;
uniform vec2 range; // of the colors, in shares of that of the values
${GROUND}`;

const WRINKLES = "/* wrinkle maps */"; // where a page that has some draws them

const SKIN_FRAGMENT = shaded("skin", `
  ${WRINKLES}
  if (field) {
    float facing = max(normalVCVSOutput.z, 0.0);
    float at = labels ? label : shown;  // labels are not interpolated
    if (at <= 1.0) at = clamp((at - range.x) / range.y, 0.0, 1.0);
    vec3 shown_color = at > 1.0 ? vec3(0.553, 0.522, 0.502) : texture(colors, vec2(0.008 + 0.984 * at, 0.5)).rgb;
    result = vec4(shown_color * (0.3 + 0.58 * facing), 1.0);
    return;
  }
  vec3 diffuseColor = textured ? texture(photo, texture_at).rgb * tint : tint;
`, SKIN_INPUTS, "mix(ground(gl_FragCoord.y), fragOutput0.rgb, reached.w)");

const EYE_VERTEX = `${START}${CAMERA}
uniform vec3 centre, corner, caruncle, tears, ahead_axis, up_axis, side_axis, lid_side, lid_up, lid_ahead;
uniform float radius, lids[96];
in vec3 sphere, cornea, color;
out vec3 place, normal, tint;
float lid(int row, float across) {
  float at = clamp((across + 1.1) / 2.2, 0.0, 1.0) * 47.0;
  int k = min(int(at), 46);
  return mix(lids[48 * row + k], lids[48 * row + k + 1], at - float(k));
}
void main() {
  mat3 axes = mat3(side_axis, up_axis, ahead_axis);
  vec3 towards = axes * sphere;
  float from_corner = degrees(acos(clamp(dot(towards, corner), -1.0, 1.0)));
  vec3 paint = mix(color, caruncle, smoothstep(0.0, 1.0, 1.25 - from_corner / 11.0));
  float across = dot(towards, lid_side), height = degrees(atan(dot(towards, lid_up), dot(towards, lid_ahead)));
  float below = lid(0, across) - height, above = height - lid(1, across);
  paint = mix(paint, tears, 0.6 * exp(-pow(max(above, 0.0) / 2.2, 2.0)));
  float shade = 0.28 * exp(-max(below, 0.0) / 4.0) + 0.34 * exp(-max(below, 0.0) / 16.0) + 0.26 * exp(-max(above - 1.0, 0.0) / 6.0);
  tint = clamp(paint * (1.0 - min(shade, 0.85) * vec3(0.92, 1.0, 1.0)), 0.0, 1.0);
  vec4 at = view * vec4(centre + radius * towards, 1.0);
  place = at.xyz;
  normal = mat3(view) * (axes * cornea);
  gl_Position = projection * at;
}`;

const PLAIN_FRAGMENT = `${START}
in vec3 place, normal, tint;
out vec4 result;
void main() { result = vec4(tint, 1.0); }`;

const HAIR_VERTEX = `${START}${CAMERA}
uniform float pixel, bias, opacity; // nearer to the camera by the bias
in vec3 position, along;
in float half_width, side;
in vec3 color;
out vec4 tint;
void main() {
  vec4 at = view * vec4(position, 1.0);
  vec3 forward = mat3(view) * along;
  vec2 across = normalize(vec2(-forward.y, forward.x) + 1e-6);
  float least = 0.5 * pixel * -at.z, wide = max(half_width, least);
  at.xy += side * wide * across;
  at.xyz *= 1.0 - bias / length(at.xyz);
  tint = vec4(color * 0.95, opacity * half_width / wide);
  gl_Position = projection * at;
}`;

const HAIR_FRAGMENT = `${START}
in vec4 tint;
out vec4 result;
void main() { result = tint; }`;

const glints = LIGHTS.map((_, k) => `glint${k}`).join(", ");

const locksVertex = (shading) => `${START}${CAMERA}
in vec3 position, color, along;
in vec4 small_normal;
in vec2 strand_at;
out vec3 inFront, behind;
out float opaque;
out vec2 strand, ${glints};
vec3 place, normal;
${lights}${IN_SHADE}
void main() {
  vec4 vertexVCVSOutput = view * vec4(low + size * position, 1.0);
  vec3 normalVCVSOutput = mat3(view) * small_normal.xyz, alongVC = mat3(view) * along;
  place = vertexVCVSOutput.xyz;
  normal = normalVCVSOutput;
  vec4 vertexColorVSOutput = vec4(in_shade(color), 1.0);
  ${shading}
  strand = strand_at;
  gl_Position = projection * vertexVCVSOutput;
}`;

const locksFragment = (strands) => `${START}
in vec3 inFront, behind;
in float opaque;
in vec2 strand, ${glints};
out vec4 result;
${lights}
void main() {
  vec4 fragOutput0 = vec4(gl_FrontFacing ? inFront : behind, opaque);
  ${strands}
  if (fragOutput0.a < 0.5) discard;
  result = fragOutput0;
}`;

const LINE_VERTEX = `${START}${CAMERA}
in vec3 position;
void main() {
  vec4 at = view * vec4(low + size * position, 1.0);
  at.z += 0.0008 * -at.z;
  gl_Position = projection * at;
}`;

const LINE_FRAGMENT = `${START}
out vec4 result;
void main() { result = vec4(0.06, 0.04, 0.035, 0.55); }`;

const SHADOW_VERTEX = `${START}
uniform mat4 view;
in vec3 position;
${LAMP}
void main() { gl_Position = vec4(before_lamp((view * vec4(position, 1.0)).xyz) * vec3(1.0, 1.0, -1.0), 1.0); }`;

const LIT_VERTEX = `${START}
uniform mat4 view;
in vec3 position;
in vec4 small_normal;
out float lit;
${KEY_LIGHT}
void main() { lit = key_light((view * vec4(position, 1.0)).xyz, mat3(view) * small_normal.xyz); }`;

const EMPTY_FRAGMENT = `${START}
void main() {}`;

const GROUND_VERTEX = `${START}
void main() {
  vec2 at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(at, 1.0, 1.0);
}`;

const GROUND_FRAGMENT = `${START}
${GROUND}
out vec4 result;
void main() { result = vec4(ground(gl_FragCoord.y), 1.0); }`;

const COPY_FRAGMENT = `${START}
uniform sampler2D picture;
out vec4 result;
void main() { result = texelFetch(picture, ivec2(gl_FragCoord.xy), 0); }`;

const TEAR_VERTEX = `${START}${CAMERA}
in vec3 position;
in vec4 small_normal, under;
in float thickness;
out vec3 place, normal, skin_normal;
out float depth;
void main() {
  vec4 at = view * vec4(low + size * position, 1.0);
  place = at.xyz;
  normal = mat3(view) * small_normal.xyz;
  skin_normal = mat3(view) * under.xyz;
  depth = thickness;
  gl_Position = projection * at;
}`;

const TEAR_FRAGMENT = `${START}
in vec3 place, normal, skin_normal;
in float depth;
uniform sampler2D behind;
uniform float focal, aspect;
out vec4 result;
${MATERIALS.tear_declarations}
void main() {
  vec4 vertexVC = vec4(place, 1.0);
  vec3 normalVCVSOutput = normalize(normal), underVSOutput = skin_normal;
  float depthVSOutput = depth;
  ${MATERIALS.tear}
  result = color_of_tear;
}`;

const SOURCES = {
  skin: [SKIN_VERTEX, SKIN_FRAGMENT],
  skin_part: [MESH_VERTEX, shaded("skin", ownColor("tint"), `${OWN_INPUTS}const vec4 reached = vec4(1.0);`)],
  rim: [MESH_VERTEX, shaded("skin", "vec3 diffuseColor = in_shade(tint);", `in vec3 tint;${IN_SHADE}const vec4 reached = vec4(1.0);`)],
  teeth: [MESH_VERTEX, shaded("teeth", "vec3 diffuseColor = in_shade(tint);", `in vec3 tint;${IN_SHADE}`)],
  eye_part: [MESH_VERTEX, shaded("eye", ownColor("in_shade(tint)"), OWN_INPUTS + IN_SHADE)],
  eye: [EYE_VERTEX, shaded("eye", "vec3 diffuseColor = in_shade(tint);", `in vec3 tint;${IN_SHADE}`)],
  plain: [MESH_VERTEX, PLAIN_FRAGMENT],
  locks: [locksVertex(MATERIALS.locks), locksFragment(MATERIALS.strands)],
  hair_part: [locksVertex(MATERIALS.hair_part), locksFragment("")],
  hair: [HAIR_VERTEX, HAIR_FRAGMENT],
  shadow: [SHADOW_VERTEX, EMPTY_FRAGMENT],
  lit: [LIT_VERTEX, EMPTY_FRAGMENT],
  line: [LINE_VERTEX, LINE_FRAGMENT],
  ground: [GROUND_VERTEX, GROUND_FRAGMENT],
  copy: [GROUND_VERTEX, COPY_FRAGMENT],
  tear: [TEAR_VERTEX, TEAR_FRAGMENT],
};

/** Places of attributes, the same in all programs. */
export const PLACES = {
  position: 0, small_normal: 1, color: 2, texture_place: 3, value: 4, sphere: 5, cornea: 6, along: 7, half_width: 8, side: 9,
  under: 10, thickness: 11, reach: 12, blood: 13, lit: 14, strand_at: 15,
};

/** Compile a program, with its uniforms by name; code of `wrinkled(normal, place, texture_at)` draws wrinkle maps. */
export function program(gl, name, code = "") {
  const made = gl.createProgram(), mapped = (text) => text.replace("void main() {", `${code}\nvoid main() {`)
    .replace(WRINKLES, "normalVCVSOutput = wrinkled(normalVCVSOutput, place, texture_at);");
  SOURCES[name].map((source, k) => (code && k ? mapped(source) : source)).forEach((source, k) => {
    const shader = gl.createShader(k ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(`${name}: ${gl.getShaderInfoLog(shader)}`);
    gl.attachShader(made, shader);
  });
  for (const [attribute, place] of Object.entries(PLACES)) gl.bindAttribLocation(made, place, attribute);
  if (name === "lit") gl.transformFeedbackVaryings(made, ["lit"], gl.SEPARATE_ATTRIBS);
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(`${name}: ${gl.getProgramInfoLog(made)}`);
  const uniforms = {};
  for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); k++) {
    const uniform = gl.getActiveUniform(made, k).name.replace("[0]", "");
    uniforms[uniform] = gl.getUniformLocation(made, uniform);
  }
  return { made, uniforms };
}
