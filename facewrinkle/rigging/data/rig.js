// The page of a rig: it reads the glTF that facewrinkle wrote, mixes its shapes, and shows them as the studio does.

import { pointers } from "./pointer.js";
import { View } from "./view.js";
import { shader, weigh } from "./wrinkles.js";

const TYPES = { 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array };
const WIDTHS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };
const KINDS = [[/^face$/, "skin"], [/^eye/, "eye_part"], [/^rim/, "rim"], [/teeth$|^tongue$/, "teeth"], [/^mouth$/, "plain"], [/./, "skin_part"]];

const $ = (id) => document.getElementById(id);
const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
const inBytes = (linear) => 255 * linear ** (1 / 2.2);

/** A file as facewrinkle writes it: one buffer, float positions, sparse morph targets. */
class Gltf {
  constructor(bytes) {
    const length = new DataView(bytes.buffer).getUint32(12, true);
    this.bytes = bytes;
    this.file = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + length)));
    this.start = 28 + length;
  }

  view(index) {
    const { byteOffset, byteLength } = this.file.bufferViews[index];
    return this.bytes.slice(this.start + byteOffset, this.start + byteOffset + byteLength);
  }

  slice(index, type, offset, length) { return new TYPES[type](this.view(index).buffer, offset || 0, length); }

  numbers(index) {
    const { bufferView, componentType, byteOffset, count, type } = this.file.accessors[index];
    return this.slice(bufferView, componentType, byteOffset, count * WIDTHS[type]);
  }

  /** A morph target: the vertices that it moves (null for all), and what is added to them. */
  target(index) {
    const { sparse, count } = this.file.accessors[index];
    if (!sparse) return { rows: null, values: this.numbers(index), count };
    const { indices, values } = sparse;
    return {
      rows: this.slice(indices.bufferView, indices.componentType, indices.byteOffset, sparse.count),
      values: this.slice(values.bufferView, 5126, values.byteOffset, 3 * sparse.count), count: sparse.count,
    };
  }

  part({ mesh: number }) {
    const mesh = this.file.meshes[number], { attributes, indices, material, targets = [] } = mesh.primitives[0], { file } = this;
    const { baseColorTexture: map, baseColorFactor = [1, 1, 1] } = file.materials[material].pbrMetallicRoughness;
    const points = this.numbers(attributes.POSITION), count = points.length / 3, arrays = { index: this.numbers(indices) };
    if (attributes.TEXCOORD_0 !== undefined) arrays.texture = this.numbers(attributes.TEXCOORD_0).map((v, k) => (k % 2 ? 1 - v : v));
    if (!map) {
      const own = attributes.COLOR_0 === undefined ? null : this.numbers(attributes.COLOR_0);
      arrays.color = Uint8Array.from({ length: 3 * count }, (_, k) => inBytes(own ? own[4 * Math.floor(k / 3) + (k % 3)] / 65535 : baseColorFactor[k % 3]));
    }
    return {
      name: mesh.name === "face" ? "skin" : mesh.name, kind: KINDS.find(([name]) => name.test(mesh.name))[1], arrays, points,
      normals: this.numbers(attributes.NORMAL), photo: map && this.view(file.images[file.textures[map.index].source].bufferView),
      targets: targets.map(({ POSITION, NORMAL }) => [POSITION, NORMAL].map((index) => (index === undefined ? null : this.target(index)))),
    };
  }
}

function add(out, target, weight, width) {
  if (!target) return;
  const { rows, values, count } = target;
  for (let i = 0; i < count; i++) for (let k = 0; k < 3; k++) out[width * (rows ? rows[i] : i) + k] += weight * values[3 * i + k];
}

/** The arrays of a part that change with the weights of shapes. */
function mixed({ points, normals, targets }, weights) {
  const position = points.slice(), normal = new Float32Array(4 * points.length / 3); // the fourth is for furrows' shade
  for (let i = 0; i < normals.length; i++) normal[4 * Math.floor(i / 3) + (i % 3)] = normals[i];
  weights.forEach((weight, k) => {
    if (!weight || !targets[k]) return;
    add(position, targets[k][0], weight, 3);
    add(normal, targets[k][1], weight, 4);
  });
  return { position, normal };
}

const COMPONENTS = { texture: 2, normal: 4, reached: 4 };
const sent = (arrays) => Object.fromEntries(Object.entries(arrays).map(([key, data]) => [key, { data, width: COMPONENTS[key] ?? 3 }]));

export default async function ({ model, camera, light, maps }) {
  const stream = new Blob([bytesOf(model)]).stream().pipeThrough(new DecompressionStream("gzip"));
  const gltf = new Gltf(new Uint8Array(await new Response(stream).arrayBuffer()));
  const parts = gltf.file.nodes.map((node) => gltf.part(node));
  parts.find(({ kind }) => kind === "skin").arrays.reached = bytesOf(light);
  const { targetNames: names, drivers: products = {} } = gltf.file.meshes.find((mesh) => mesh.extras).extras;
  // Targets whose weight is the product of the weights of others: wrinkles (of a weight with itself), correctives.
  const drivers = Object.entries(products).map(([name, others]) => [name, ...others].map((each) => names.indexOf(each)));
  const free = names.map((_, k) => k).filter((k) => !drivers.some(([target]) => target === k));
  const view = new View(document.querySelector("canvas"), () => {}), weights = new Float32Array(names.length);
  const images = (maps?.pictures ?? []).map((picture) => createImageBitmap(new Blob([bytesOf(picture)], { type: "image/png" })));
  const shares = maps && new Float32Array(16 * maps.facts.masks.columns * maps.facts.masks.rows);
  view.begin(camera);
  if (maps) view.wrinkle(shader(maps.facts), await Promise.all(images), shares);
  for (const { name, photo } of parts) if (photo) view.setPhoto({ name, bytes: photo });

  let step = 0;
  function morph(moving = false) {
    for (const [target, one, other] of drivers) weights[target] = weights[one] * weights[other];
    if (maps) weigh(maps.facts, shares, (name) => weights[names.indexOf(name)]);
    const told = parts.filter((part) => !step || part.targets.length);
    view.frame({ fresh: !step, box: [0, 0, 0, 1], step: step++, still: !moving, parts: parts.map((part) => ({
      name: part.name, kind: part.kind, info: {}, arrays: { ...(step > 1 ? Object.fromEntries(Object.keys(part.arrays).map((key) => [key, null])) : sent(part.arrays)),
        ...sent(told.includes(part) ? mixed(part, weights) : {}) } })) });
  }

  const sliders = free.map((k) => {
    const label = document.createElement("label"), text = document.createElement("span"), slider = document.createElement("input");
    text.textContent = text.title = names[k];
    Object.assign(slider, { type: "range", min: 0, max: 1, step: 0.01, value: 0 });
    slider.addEventListener("input", () => { stop(); set(k, +slider.value); });
    label.append(text, slider);
    $("sliders").append(label);
    return slider;
  });
  function show(moving) { free.forEach((k, n) => { sliders[n].value = weights[k]; }); morph(moving); }
  function set(k, weight) { weights[k] = weight; show(true); }
  let playing = 0;
  function stop() { cancelAnimationFrame(playing); playing = 0; $("play").textContent = "Play all"; }
  $("reset").onclick = () => { stop(); weights.fill(0); show(); };
  $("play").onclick = () => {
    if (playing) return stop();
    $("play").textContent = "Stop";
    const begin = performance.now(), next = (now) => {
      const t = (now - begin) / 900;
      weights.fill(0);
      weights[free[Math.floor(t) % free.length]] = Math.sin(Math.PI * (t % 1)) ** 2;
      show(true);
      playing = requestAnimationFrame(next);
    };
    playing = requestAnimationFrame(next);
  };
  // page.html#jawOpen=0.5&browInnerUp=1 opens with an expression.
  function expressed() {
    weights.fill(0);
    for (const [name, weight] of new URLSearchParams(location.hash.slice(1))) {
      if (names.includes(name)) weights[names.indexOf(name)] = Math.max(0, Math.min(1, +weight || 0));
    }
    show();
  }
  addEventListener("hashchange", () => { stop(); expressed(); });
  pointers(view.canvas, view, { data: null, placing: null, click() {}, turned() {} });
  expressed();
  const photos = parts.filter(({ photo }) => photo).length;
  window.rig = { names, weights, set, still: () => view.finished && view.photos.size >= photos }; // for pages that embed this one
}
