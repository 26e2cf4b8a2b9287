// Brows, lashes and fibers of muscles: lines that become ribbons in the vertex shader.

import { FIBERS } from "./materials.js";
import { PLACES } from "./shaders.js";

/** Ribbons along `count` lines of `knots` points. */
export class Ribbons {
  constructor(gl, half, tint, knots) {
    this.gl = gl;
    this.knots = knots;
    const points = half.length;
    this.moving = new Float32Array(points * 12); // position and direction, for both sides
    const fixed = new Float32Array(points * 4);
    const index = [];
    for (let p = 0; p < points; p++) {
      fixed.set([half[p], -1, half[p], 1], 4 * p);
      if (p % knots) index.push(2 * p - 2, 2 * p - 1, 2 * p, 2 * p, 2 * p - 1, 2 * p + 1);
    }
    this.lines = points / knots;
    this.count = index.length;
    this.vao = gl.createVertexArray();
    gl.bindVertexArray(this.vao);
    this.buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, this.moving.byteLength, gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(PLACES.position);
    gl.vertexAttribPointer(PLACES.position, 3, gl.FLOAT, false, 24, 0);
    gl.enableVertexAttribArray(PLACES.along);
    gl.vertexAttribPointer(PLACES.along, 3, gl.FLOAT, false, 24, 12);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, fixed, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(PLACES.half_width);
    gl.vertexAttribPointer(PLACES.half_width, 1, gl.FLOAT, false, 8, 0);
    gl.enableVertexAttribArray(PLACES.side);
    gl.vertexAttribPointer(PLACES.side, 1, gl.FLOAT, false, 8, 4);
    this.colors = gl.createBuffer();
    this.paint(tint);
    gl.enableVertexAttribArray(PLACES.color);
    gl.vertexAttribPointer(PLACES.color, 3, gl.UNSIGNED_BYTE, true, 4, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(index), gl.STATIC_DRAW);
    gl.bindVertexArray(null);
  }

  /** Take colors (3 bytes each) of all lines. */
  paint(tint) {
    const { gl, knots } = this, colors = new Uint8Array((tint.length / 3) * knots * 8);
    for (let k = 0; k < colors.length; k += 4) {
      const line = 3 * Math.floor(k / (8 * knots));
      colors.set(tint.subarray(line, line + 3), k);
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.colors);
    gl.bufferData(gl.ARRAY_BUFFER, colors, gl.DYNAMIC_DRAW);
  }

  /** Take new points (3 numbers each) of all lines. */
  move(points) {
    const { moving, knots } = this, n = points.length / 3;
    for (let p = 0; p < n; p++) {
      const before = p % knots ? p - 1 : p, after = (p + 1) % knots ? p + 1 : p;
      for (let c = 0; c < 3; c++) {
        const at = points[3 * p + c], along = points[3 * after + c] - points[3 * before + c];
        moving[12 * p + c] = moving[12 * p + 6 + c] = at;
        moving[12 * p + 3 + c] = moving[12 * p + 9 + c] = along;
      }
    }
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.buffer);
    this.gl.bufferSubData(this.gl.ARRAY_BUFFER, 0, moving);
  }
}

/** Points of hairs that are bound to triangles of the skin, as the skin is now. */
export function bound(corners, place, skin, out) {
  for (let p = 0; p < corners.length; p += 3) {
    const a = 3 * corners[p], b = 3 * corners[p + 1], c = 3 * corners[p + 2];
    const ax = skin[a], ay = skin[a + 1], az = skin[a + 2];
    const ux = skin[b] - ax, uy = skin[b + 1] - ay, uz = skin[b + 2] - az;
    const vx = skin[c] - ax, vy = skin[c + 1] - ay, vz = skin[c + 2] - az;
    let nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    const long = place[p + 2] / (Math.hypot(nx, ny, nz) || 1), s = place[p], t = place[p + 1];
    out[p] = ax + s * ux + t * vx + long * nx;
    out[p + 1] = ay + s * uy + t * vy + long * ny;
    out[p + 2] = az + s * uz + t * vz + long * nz;
  }
  return out;
}

/** Points (3 numbers each) of a part, from whole numbers in the box of its frame. */
function pointsOf({ arrays: { position } }, box) {
  return Float32Array.from(position, (v, k) => box[k % 3] + (box[3] / 65535) * v);
}

/** Draw the fibers of a part in a view; while some stand out, the others are faint. */
export function drawFibers(view, part) {
  const { half, muscle, rate, position } = part.arrays, { names, knots } = part.info;
  part.ribbons ??= new Ribbons(view.gl, half, new Uint8Array(3 * muscle.length), knots);
  if (part.moved !== position) part.ribbons.move((part.points = pointsOf(part, view.box)));
  part.moved = position;
  const mixed = (share) => FIBERS.relaxed.map((low, c) => low + share * (FIBERS.contracted[c] - low));
  if (part.painted !== rate) part.ribbons.paint(Uint8Array.from([...muscle].flatMap((m) => mixed(rate[m] / 255))));
  part.painted = rate;
  const some = names.some((name) => view.lit.has(name));
  view.drawRibbons(part.ribbons, FIBERS.beneath, some ? 0.25 : FIBERS.opacity);
  names.forEach((name, m) => {
    if (view.lit.has(name)) view.drawRibbons(part.ribbons, FIBERS.beneath, 1, muscle.indexOf(m), muscle.lastIndexOf(m) + 1);
  });
}
