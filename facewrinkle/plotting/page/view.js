// The view: keeps the parts of the newest frame on the graphics card, and draws them.

import { BACKGROUND, KEY, VIEW_ANGLE } from "./materials.js";
import { Camera } from "./camera.js";
import { Ribbons, bound, drawFibers } from "./hair.js";
import { Mean, SHIFTS } from "./mean.js";
import { Picking } from "./picking.js";
import { PLACES, program } from "./shaders.js";
import { Shadow } from "./shadow.js";
import { Smooth, numbered } from "./smooth.js";

const UNIT = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const ATTRIBUTES = { // array of a part: attribute, components, normalized
  position: ["position", 3, true], normal: ["small_normal", 4, true], color: ["color", 3, true],
  texture: ["texture_place", 2, true], value: ["value", 1, true], sphere: ["sphere", 3, false], cornea: ["cornea", 3, false],
  under: ["under", 4, true], thickness: ["thickness", 1, false], reached: ["reach", 4, true], blood: ["blood", 1, true], lit: ["lit", 1, false],
  strand: ["strand_at", 2, false], along: ["along", 4, true],
};
const LIGHT_GROUND = ["#c9ced4", "#e6e9ec"]; // of pages in light colors
const RISE = [0.0016, 0.004]; // of an arc over an edge that is drawn straight, in distances between the pupils; and of one in software's fewer pixels
const MOVING_TIME = 220; // ms after the last change for which software draws at half the resolution

const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);

export class View extends Picking {
  constructor(canvas, drawn) {
    super();
    this.canvas = canvas;
    this.drawn = drawn; // called after a new frame was drawn
    const probe = document.createElement("canvas").getContext("webgl2");
    if (!probe) throw new Error("This browser has no WebGL2, which the view needs.");
    const info = probe.getExtension("WEBGL_debug_renderer_info");
    const renderer = String(probe.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : probe.RENDERER));
    this.software = /swiftshader|llvmpipe|software|basic render/i.test(renderer);
    probe.getExtension("WEBGL_lose_context")?.loseContext();
    this.setUp();
    this.wireframe = false;
    this.field = null;
    this.lit = new Set(); // names of muscles whose fibers stand out
    this.curtain = 0.5; // share of the width on which what was kept is drawn
    this.locked = null; // the range of the colors, where it does not follow the values
    this.busyUntil = 0;
    this.coarse = this.software;
    new ResizeObserver(() => this.request()).observe(canvas);
    matchMedia("(prefers-color-scheme: light)").addEventListener("change", () => this.request());
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => { this.setUp(); this.onrestored?.(); });
  }

  setUp() {
    const gl = this.gl = this.canvas.getContext("webgl2", { antialias: !this.software, alpha: false, preserveDrawingBuffer: false });
    this.programs = Object.fromEntries(
      ["skin", "skin_part", "rim", "teeth", "eye_part", "eye", "plain", "locks", "hair_part", "hair", "line", "ground", "tear"].map((n) => [n, program(gl, n)]));
    this.shadow = new Shadow(gl);
    this.mean = this.software ? new Mean(gl) : null; // else the card does it, while the face moves, too
    this.parts = new Map();
    this.empty = gl.createVertexArray();
    gl.vertexAttrib4f(PLACES.reach, 1, 1, 1, 1); // of skin of which nothing else is known
    this.photos = new Map();
    this.kept = null;
    this.colors = this.texture();
    this.behind = this.texture();
  }

  /** A texture of one color, to be filled. */
  texture() {
    const gl = this.gl, texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array([211, 169, 142, 255]));
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    return texture;
  }

  /** Begin with a face: its axes, its size and the named views. */
  begin({ axes, size, views }, other = false) {
    this.views = views;
    if (other) this.keep(false);
    if (!this.camera || other) {
      this.camera = new Camera(axes, size, VIEW_ANGLE, 9 * size);
      this.camera.take(views.front);
    }
  }

  take(name) { this.camera.take(this.views[name]); this.request(); }

  // --- what comes from the server ---------------------------------------------------------------

  setPhoto({ name, bytes }) {
    createImageBitmap(new Blob([bytes], { type: bytes[0] === 0x89 ? "image/png" : "image/jpeg" })).then((image) => {
      const before = this.photos.get(name);
      if (before !== this.kept?.photos.get(name)) this.gl.deleteTexture(before);
      this.photos = new Map(this.photos).set(name, this.filled(image));
      this.request();
    });
  }

  /** A texture of an image. */
  filled(image) {
    const gl = this.gl, texture = this.texture(), sharp = gl.getExtension("EXT_texture_filter_anisotropic");
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, image);
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    if (sharp) gl.texParameterf(gl.TEXTURE_2D, sharp.TEXTURE_MAX_ANISOTROPY_EXT, this.software ? 1 : 8);
    return texture;
  }

  /** Draw the skin with wrinkle maps: code of `wrinkled`, images of the masks and of the layers, and weights of masks. */
  wrinkle(code, images, weights) {
    this.programs.skin = program(this.gl, "skin", code);
    this.wrinkles = { textures: images.map((image) => this.filled(image)), weights };
    this.request();
  }

  /** The texture for the photo of a part. */
  photoOf(name) {
    if (!this.photos.has(name)) this.photos.set(name, this.texture());
    return this.photos.get(name);
  }

  setField(name, colors) {
    if (name !== this.field) this.locked = this.fieldInfo = null;
    this.field = name;
    if (name) {
      const gl = this.gl, n = colors.length / 3;
      gl.bindTexture(gl.TEXTURE_2D, this.colors);
      gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, n, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, new Uint8Array(colors));
      gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    }
    this.request();
  }

  frame(head) {
    if (head.fresh) this.parts.clear();
    this.box = head.box;
    const names = new Set();
    for (const part of head.parts) {
      names.add(part.name);
      this.update(part);
    }
    for (const name of [...this.parts.keys()]) if (!names.has(name)) this.drop(name);
    this.step = head.step;
    this.pending = true;
    this.request(!head.still);
  }

  update({ name, kind, arrays, info }) {
    const gl = this.gl;
    if (kind === "field") return this.updateField(arrays, info);
    if (this.parts.get(name)?.kind !== kind) {
      this.drop(name);
      this.parts.set(name, { name, kind, buffers: {}, arrays: {}, indices: {}, vao: gl.createVertexArray() });
    }
    const part = this.parts.get(name);
    part.info = info;
    for (const key of Object.keys(part.arrays)) if (!(key in arrays)) this.forget(part, key);
    if (arrays.index) this.forget(part, "value"); // those of a field are of other triangles
    if (arrays.half) part.ribbons = part.points = part.moved = null;
    for (const [key, sent] of Object.entries(arrays)) {
      if (!sent) continue;
      const { data, width } = sent;
      part.arrays[key] = data;
      if (kind === "skin") continue;
      if (key === "index") this.triangles(part, key, data);
      else if (ATTRIBUTES[key] && !["bound", "lashes", "fibers"].includes(kind)) this.attribute(part, key, data, width);
    }
    gl.bindVertexArray(null);
    if (kind === "skin") this.updateSkin(part, arrays);
  }

  /** Hand over what has changed of the skin, as it is drawn: with vertices between its own. */
  updateSkin(part, changed) {
    const { index, lined = [], position, normal, ...others } = part.arrays, split = changed.index;
    if (split || changed.position || changed.normal) {
      const points = new Float32Array(position), normals = new Float32Array(normal);
      if (position instanceof Uint16Array) for (let k = 0; k < points.length; k++) points[k] = this.box[k % 3] + (this.box[3] / 65535) * points[k];
      if (normal instanceof Int8Array) for (let k = 0; k < normals.length; k++) normals[k] /= 127;
      if (split) {
        part.coarse = this.coarse;
        part.lines = null;
        const { size } = this.camera, border = 2 * KEY.soft * size; // of shadows, in which longer edges would be seen
        part.smooth = new Smooth([index, lined], points, normals, size * RISE[this.coarse ? 1 : 0], border);
        part.smooth.lists.forEach((list, which) => this.triangles(part, ["index", "lined"][which], list));
      }
      Object.assign(part, part.smooth.lifted(points, normals));
      this.attribute(part, "position", part.points);
      this.attribute(part, "normal", part.normals);
      if (split) this.attribute(part, "lit", new Float32Array(part.points.length / 3));
    }
    for (const key of Object.keys(others)) if (split || changed[key]) this.attribute(part, key, part.smooth.values(others[key]));
    if (part.value && (split || changed.value)) this.attribute(part, "value", part.smooth.values(part.value, part.labels));
    this.gl.bindVertexArray(null);
  }

  /** Hand over a list of the triangles of a part. */
  triangles(part, key, data) {
    const { gl } = this, buffer = part.indices[key]?.buffer ?? gl.createBuffer();
    gl.bindVertexArray(part.vao);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    part.indices[key] = { buffer, count: data.length };
    part.type = data instanceof Uint32Array ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT;
    if (key === "index") part.count = data.length;
  }

  /** Keep what is shown, to be drawn left of the curtain beside what comes; or let it go. */
  keep(on) {
    const { gl, kept, parts, photos } = this;
    if (kept) {
      this.within(kept, () => { for (const name of [...this.parts.keys()]) this.drop(name); });
      for (const [name, photo] of kept.photos) if (photo !== photos.get(name)) gl.deleteTexture(photo);
    }
    this.kept = on ? { parts: new Map(), box: this.box, photos } : null;
    if (on) this.within(this.kept, () => {
      for (const { name, kind, info, arrays } of parts.values()) {
        this.update({ name, kind, info, arrays: Object.fromEntries(Object.entries(arrays).map(([key, data]) => [key, { data }])) });
      }
      if (this.field && parts.get("skin").colored === this.field) this.updateField({ value: { data: this.numbers } }, this.fieldInfo);
    });
    this.request();
  }

  /** Do something with what was kept in place of what is shown now. */
  within(kept, act) {
    const { parts, box, photos } = this;
    Object.assign(this, kept);
    act();
    Object.assign(this, { parts, box, photos });
  }

  /** Is what was kept drawn at a pixel of the view? */
  inKept(x) { return Boolean(this.kept) && x < this.curtain * this.canvas.clientWidth; }

  /** What a part does not have any more, as its photo where another face has none, or a field that is too short. */
  forget(part, key) {
    const gl = this.gl, known = part.buffers[key];
    delete part.arrays[key];
    if (!known) return;
    gl.bindVertexArray(part.vao);
    gl.disableVertexAttribArray(PLACES[ATTRIBUTES[key][0]]);
    gl.deleteBuffer(known.buffer);
    delete part.buffers[key];
    if (key === "value") part.value = part.colored = null;
  }

  attribute(part, key, data, width = Infinity) {
    const gl = this.gl, [attribute, components, normalized] = ATTRIBUTES[key];
    const type = data instanceof Uint16Array ? gl.UNSIGNED_SHORT : data instanceof Int8Array ? gl.BYTE
      : data instanceof Uint8Array ? gl.UNSIGNED_BYTE : gl.FLOAT;
    gl.bindVertexArray(part.vao);
    const known = part.buffers[key];
    const buffer = known?.buffer ?? gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    if (known?.bytes === data.byteLength) gl.bufferSubData(gl.ARRAY_BUFFER, 0, data);
    else gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    part.buffers[key] = { buffer, bytes: data.byteLength };
    gl.enableVertexAttribArray(PLACES[attribute]);
    gl.vertexAttribPointer(PLACES[attribute], Math.min(components, width), type, normalized && type !== gl.FLOAT, 0, 0);
  }

  updateField(arrays, info) {
    const skin = this.parts.get("skin");
    this.fieldInfo = info;
    if (skin && arrays.value?.data.length * 3 === skin.arrays.position.length) {
      // 65534 is the largest value, and 65535 means nothing; the shader gets numbers above 1 for these
      this.numbers = arrays.value.data;
      skin.value = Float32Array.from(this.numbers, (v) => (v === 65535 ? 2 : v / 65534));
      skin.labels = ["muscle", "family", "level"].includes(this.field);
      this.updateSkin(skin, { value: true });
      skin.colored = this.field;
      skin.range = info.range;
    }
    this.onfield?.(info);
  }

  /** The number of the shown field at a place that was picked; null where it means nothing. */
  valueAt({ vertex, corners, shares }) {
    const { range, names } = this.fieldInfo ?? {}, n = this.numbers;
    if (!n || !range || Math.max(...corners) >= n.length) return null;
    const of = (v) => (n[v] === 65535 ? null : range[0] + (n[v] / 65534) * (range[1] - range[0]));
    if (names) { const at = of(vertex); return at === null ? null : names[Math.round(at)] ?? null; }
    const three = corners.map(of);
    return three.includes(null) ? null : three.reduce((sum, value, k) => sum + shares[k] * value, 0);
  }

  drop(name) {
    const part = this.parts.get(name);
    if (!part) return;
    const gl = this.gl;
    for (const { buffer } of Object.values(part.buffers)) gl.deleteBuffer(buffer);
    for (const { buffer } of Object.values(part.indices)) gl.deleteBuffer(buffer);
    gl.deleteVertexArray(part.vao);
    this.parts.delete(name);
  }

  // --- drawing ----------------------------------------------------------------------------------

  /** Draw soon; `moving` while more is to come. */
  request(moving = false) {
    if (moving) this.busyUntil = performance.now() + MOVING_TIME;
    this.taken = 0;
    this.soon();
  }

  soon() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.draw();
      this.ondraw?.();
      if (this.pending) {
        this.pending = false;
        this.drawn();
      }
      if (this.mean && !this.coarse && this.taken < SHIFTS.length) { // until something is asked for
        this.taken += 1;
        this.soon();
      }
      if (this.coarse) {
        clearTimeout(this.timer);
        this.timer = setTimeout(() => this.request(), MOVING_TIME + 20);
      }
    });
  }

  /** Is all drawn that was asked for, as finely as it can be? */
  get finished() { return !this.asked && !this.coarse && (!this.mean || this.taken === SHIFTS.length); }

  /** A copy of what is shown now, as fine as it can be, as a canvas. */
  copy() {
    const { canvas, mean } = this;
    this.busyUntil = 0;
    for (this.taken = 0; this.taken <= (mean ? SHIFTS.length : 0); this.taken++) this.draw();
    const copy = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
    copy.getContext("2d").drawImage(canvas, 0, 0);
    this.request();
    return copy;
  }

  resize() {
    this.coarse = this.software && performance.now() < this.busyUntil;
    const ratio = (this.software ? 1 : Math.min(devicePixelRatio, 2)) * (this.coarse ? 0.5 : 1);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
  }

  draw() {
    const { gl, camera } = this;
    if (!camera || !this.box || gl.isContextLost()) return;
    this.resize();
    const { width, height } = this.canvas;
    gl.depthMask(true);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    this.aspect = width / height;
    this.matrices = camera.matrices(this.aspect);
    if (this.taken) {
      const [x, y] = SHIFTS[this.taken - 1];
      this.matrices.projection[8] += (2 * x) / width;
      this.matrices.projection[9] += (2 * y) / height;
    }
    const border = this.kept ? Math.round(this.curtain * width) : 0;
    if (this.kept) this.within(this.kept, () => this.paint(0, border));
    this.paint(border, width);
    if (this.taken) this.mean.take(this.taken);
  }

  /** Draw all that is seen in some columns of the picture. */
  paint(first, last) {
    const { gl } = this, { width, height } = this.canvas;
    const skin = this.parts.get("skin");
    if (skin.coarse !== this.coarse) this.updateSkin(skin, skin.arrays);
    if (!this.taken || this.kept) this.shadow.cast(skin, this);
    gl.viewport(0, 0, width, height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(first, 0, last - first, height);
    this.ground();
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    const parts = [...this.parts.values()], of = (...kinds) => parts.filter((p) => kinds.includes(p.kind));
    for (const part of of("skin")) this.drawSkin(part);
    for (const part of of("skin_part", "locks", "hair_part", "rim", "plain", "eye_part", "teeth")) if (part.info.visible !== false) this.drawMesh(part);
    for (const part of of("eye")) this.drawEye(part);
    gl.enable(gl.BLEND);
    if (this.wireframe) for (const part of of("skin")) this.drawLines(part);
    gl.depthMask(false);
    const colored = this.field && this.parts.get("skin")?.colored === this.field; // what was kept may not be
    if (!colored) for (const part of of("bound", "lashes")) this.drawHair(part);
    for (const part of of("fibers")) drawFibers(this, part);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    const tears = of("tear");
    if (tears.length) this.drawTears(tears);
    gl.disable(gl.SCISSOR_TEST);
  }

  use(name, low = this.box.slice(0, 3), size = this.box[3]) {
    const { gl } = this, { made, uniforms } = this.programs[name];
    gl.useProgram(made);
    gl.uniformMatrix4fv(uniforms.view, false, this.matrices.view);
    gl.uniformMatrix4fv(uniforms.projection, false, this.matrices.projection);
    if (uniforms.low) gl.uniform3fv(uniforms.low, low);
    if (uniforms.size) gl.uniform1f(uniforms.size, size);
    if (uniforms.depths) this.shadow.tell(uniforms);
    if (uniforms.rows) {
      const [bottom, top] = getComputedStyle(this.canvas).colorScheme === "light" ? LIGHT_GROUND : BACKGROUND;
      gl.uniform3fv(uniforms.bottom, rgb(bottom));
      gl.uniform3fv(uniforms.top, rgb(top));
      gl.uniform1f(uniforms.rows, this.canvas.height);
    }
    return uniforms;
  }

  ground() {
    const { gl } = this;
    gl.disable(gl.DEPTH_TEST);
    this.use("ground");
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  drawSkin(part) {
    const { gl } = this, uniforms = this.use("skin", [0, 0, 0], 1);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.photoOf("skin"));
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.colors);
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform1i(uniforms.photo, 0);
    gl.uniform1i(uniforms.colors, 1);
    gl.uniform1i(uniforms.textured, part.arrays.color ? 0 : 1);
    if (this.wrinkles) {
      const { textures, weights } = this.wrinkles;
      textures.forEach((texture, k) => { gl.activeTexture(gl.TEXTURE2 + k); gl.bindTexture(gl.TEXTURE_2D, texture); });
      gl.uniform1i(uniforms.wrinkleMasks, 2);
      gl.uniform1iv(uniforms.wrinkleNormals, textures.slice(1).map((_, k) => 3 + k));
      gl.uniformMatrix4fv(uniforms.wrinkleWeights, false, weights);
    }
    gl.uniform1i(uniforms.labels, part.labels ? 1 : 0);
    const [low, high] = part.range ?? [0, 1], [from, to] = this.locked ?? this.fieldInfo?.range ?? [low, high];
    gl.uniform2f(uniforms.range, (from - low) / (high - low || 1), (to - from) / (high - low || 1) || 1);
    gl.uniform1i(uniforms.field, this.field && part.colored === this.field ? 1 : 0);
    gl.bindVertexArray(part.vao);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, part.indices.index.buffer);
    gl.drawElements(gl.TRIANGLES, part.count, part.type, 0);
    if (part.indices.lined?.count) { // linings are not seen from behind
      gl.enable(gl.CULL_FACE);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, part.indices.lined.buffer);
      gl.drawElements(gl.TRIANGLES, part.indices.lined.count, part.type, 0);
      gl.disable(gl.CULL_FACE);
    }
  }

  drawMesh(part) {
    const { gl } = this, whole = part.arrays.position instanceof Float32Array;
    const uniforms = whole ? this.use(part.kind, [0, 0, 0], 1) : this.use(part.kind);
    gl.uniformMatrix4fv(uniforms.model, false, part.info.matrix ?? UNIT);
    if (uniforms.textured) {
      gl.uniform1i(uniforms.textured, part.arrays.texture ? 1 : 0);
      gl.uniform1i(uniforms.photo, 0);
      gl.activeTexture(gl.TEXTURE0);
      if (part.arrays.texture) gl.bindTexture(gl.TEXTURE_2D, this.photoOf(part.name));
    }
    gl.bindVertexArray(part.vao);
    gl.drawElements(gl.TRIANGLES, part.count, part.type, 0);
  }

  drawEye(part) {
    const { gl } = this, uniforms = this.use("eye"), { info } = part;
    for (const name of ["centre", "corner", "caruncle", "tears"]) gl.uniform3fv(uniforms[name], info[name]);
    ["side_axis", "up_axis", "ahead_axis"].forEach((name, k) => gl.uniform3fv(uniforms[name], info.axes.slice(3 * k, 3 * k + 3)));
    ["lid_side", "lid_up", "lid_ahead"].forEach((name, k) => gl.uniform3fv(uniforms[name], info.lid_axes.slice(3 * k, 3 * k + 3)));
    gl.uniform1f(uniforms.radius, info.radius);
    gl.uniform1fv(uniforms.lids, part.arrays.lids);
    gl.bindVertexArray(part.vao);
    gl.drawElements(gl.TRIANGLES, part.count, part.type, 0);
  }

  drawHair(part) {
    const { gl } = this;
    if (!part.ribbons) {
      part.ribbons = new Ribbons(gl, part.arrays.half, part.arrays.tint, part.info.knots);
    }
    if (part.kind === "bound") {
      const skin = this.parts.get("skin");
      if (part.moved !== skin.arrays.position) {
        part.points ??= new Float32Array(part.arrays.corners.length);
        part.ribbons.move(bound(part.arrays.corners, part.arrays.place, skin.points, part.points));
        part.moved = skin.arrays.position;
      }
    } else if (part.moved !== part.arrays.away) {
      const { root, away } = part.arrays, { knots, scale } = part.info, step = this.box[3] / 65535;
      part.ribbons.move(Float32Array.from(away, (v, k) =>
        this.box[k % 3] + step * root[3 * Math.floor(k / (3 * knots)) + (k % 3)] + scale * v));
      part.moved = away;
    }
    // Pictures, whose pixels are finer, show as much skin between hairs.
    this.drawRibbons(part.ribbons, part.kind === "bound" ? 0.022 : 0.003, 0.9);
  }

  /** Draw lines, or some of them, so much nearer to the camera, in distances between the pupils. */
  drawRibbons(ribbons, nearer, opacity = 1, first = 0, last = ribbons.lines) {
    const { gl } = this, uniforms = this.use("hair"), each = ribbons.count / ribbons.lines;
    gl.uniform1f(uniforms.pixel, 2 / (this.matrices.focal * this.canvas.height));
    gl.uniform1f(uniforms.bias, nearer * this.camera.size);
    gl.uniform1f(uniforms.opacity, opacity);
    gl.bindVertexArray(ribbons.vao);
    gl.drawElements(gl.TRIANGLES, each * (last - first), gl.UNSIGNED_INT, 4 * each * first);
  }

  drawLines(part) {
    const { gl } = this;
    if (!part.lines) {
      const { index } = part.arrays, edges = new Set(), out = [];
      for (let t = 0; t < index.length; t += 3) {
        for (let k = 0; k < 3; k++) {
          const a = index[t + k], b = index[t + ((k + 1) % 3)], key = numbered(a, b);
          if (edges.has(key)) continue;
          edges.add(key);
          part.smooth.along(a, b).forEach((vertex, step, { [step + 1]: next }) => next !== undefined && out.push(vertex, next));
        }
      }
      part.lines = gl.createVertexArray();
      part.lineCount = out.length;
      gl.bindVertexArray(part.lines);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(out), gl.STATIC_DRAW);
    }
    this.use("line", [0, 0, 0], 1);
    gl.bindVertexArray(part.lines);
    gl.bindBuffer(gl.ARRAY_BUFFER, part.buffers.position.buffer);
    gl.enableVertexAttribArray(PLACES.position);
    gl.vertexAttribPointer(PLACES.position, 3, gl.FLOAT, false, 0, 0);
    gl.drawElements(gl.LINES, part.lineCount, gl.UNSIGNED_INT, 0);
  }

  drawTears(tears) {
    const { gl } = this, { width, height } = this.canvas;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.behind);
    gl.copyTexImage2D(gl.TEXTURE_2D, 0, gl.RGB, 0, 0, width, height, 0);
    const uniforms = this.use("tear");
    gl.uniform1i(uniforms.behind, 0);
    gl.uniform1f(uniforms.focal, this.matrices.focal);
    gl.uniform1f(uniforms.aspect, this.aspect);
    gl.enable(gl.CULL_FACE);
    for (const part of tears) {
      gl.bindVertexArray(part.vao);
      gl.drawElements(gl.TRIANGLES, part.count, part.type, 0);
    }
    gl.disable(gl.CULL_FACE);
  }
}
