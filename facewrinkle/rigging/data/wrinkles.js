// Plays the wrinkle maps that facewrinkle writes beside a rig. In three.js (WebGL 2):
//
//   import { addWrinkles } from './head_wrinkles.js';
//   await addWrinkles(head.getObjectByName("face"), "head_wrinkles.json", new THREE.TextureLoader());
//
// The wrinkles then follow the morph targets of the mesh. It depends on nothing; other renderers use `shader` and `weigh`.

/** GLSL of `wrinkled(normal, place, at)`: a unit normal in view space with wrinkles, from that without any, the place, and texture coordinates. */
export function shader({ layers, masks: { columns, rows } }) {
  const layer = (_, k) => `slope += amount[${k}] * (2.0 * texture(wrinkleNormals[${k}], at).xyz - vec3(1.0, 1.0, 2.0));`;
  return `
uniform highp sampler2D wrinkleMasks, wrinkleNormals[${layers.length}];
uniform mat4 wrinkleWeights[${columns * rows}];
vec3 wrinkled(vec3 normal, vec3 place, vec2 at) {
  vec2 grid = vec2(${columns}.0, ${rows}.0), border = 0.5 * grid / vec2(textureSize(wrinkleMasks, 0));
  vec4 amount = vec4(0.0); // of each layer
  for (int k = 0; k < ${columns * rows}; k++) {
    if (wrinkleWeights[k] == mat4(0.0)) continue;
    vec2 tile = clamp(at, border, 1.0 - border) + vec2(k % ${columns}, k / ${columns});
    amount += wrinkleWeights[k] * vec4(textureLod(wrinkleMasks, tile / grid, 0.0).rgb, 0.0);
  }
  amount = min(amount, 1.0);
  vec3 slope = vec3(0.0, 0.0, 1.0);
  ${layers.map(layer).join("\n  ")}
  vec3 dx = dFdx(place), dy = dFdy(place);
  vec2 ax = dFdx(at), ay = dFdy(at);
  float turned = ax.x * ay.y - ax.y * ay.x;
  vec3 along = (dx * ay.y - dy * ax.y) * turned, down = (dy * ax.x - dx * ay.x) * turned; // the first row is the uppermost
  along = normalize(along - dot(along, normal) * normal + 1e-30);
  vec3 across = cross(normal, along);
  across *= dot(across, down) > 0.0 ? -1.0 : 1.0;
  return normalize(slope.x * along + slope.y * across + slope.z * normal);
}
`;
}

/** Fill the numbers of `wrinkleWeights`, 16 for each tile of the masks, by the weights of shapes: skin folds with the square. */
export function weigh({ shapes }, numbers, weightOf) {
  for (const [name, { layer, tile, channel }] of Object.entries(shapes)) {
    numbers[16 * tile + 4 * "rgb".indexOf(channel) + layer - 1] = weightOf(name) ** 2;
  }
}

/** Add the wrinkles that a JSON file tells of to the material of a mesh of three.js, over its own normal map. */
export async function addWrinkles(mesh, url, loader) {
  const facts = await (await fetch(url)).json();
  const load = (name) => loader.loadAsync(new URL(name, new URL(url, document.baseURI)).href);
  const [masks, ...normals] = await Promise.all([facts.masks.picture, ...facts.layers.map(({ normal }) => normal)].map(load));
  for (const map of [masks, ...normals]) map.flipY = false;
  Object.assign(masks, { generateMipmaps: false, minFilter: masks.magFilter }); // small versions would mix tiles
  const numbers = new Float32Array(16 * facts.masks.columns * facts.masks.rows);
  const material = mesh.material = mesh.material.clone();
  material.onBeforeCompile = (program) => {
    Object.assign(program.uniforms, { wrinkleMasks: { value: masks }, wrinkleNormals: { value: normals }, wrinkleWeights: { value: numbers } });
    program.vertexShader = program.vertexShader.replace("#include <common>", "#include <common>\nout vec2 wrinklesAt;")
      .replace("#include <uv_vertex>", "#include <uv_vertex>\nwrinklesAt = uv;");
    program.fragmentShader = program.fragmentShader.replace("#include <common>", `#include <common>\nin vec2 wrinklesAt;${shader(facts)}`)
      .replace("#include <normal_fragment_maps>", `#include <normal_fragment_maps>
normal = normalize(normal + wrinkled(nonPerturbedNormal, -vViewPosition, wrinklesAt) - nonPerturbedNormal);`);
  };
  material.customProgramCacheKey = () => JSON.stringify([facts.layers.length, facts.masks]);
  mesh.onBeforeRender = () => weigh(facts, numbers, (name) => mesh.morphTargetInfluences[mesh.morphTargetDictionary[name]] ?? 0);
}
