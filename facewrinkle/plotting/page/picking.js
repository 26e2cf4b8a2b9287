// What is under a pixel, and where a place of the face is seen; for a view with canvas, camera, box and parts.

import { add, cross, dot } from "./camera.js";

export class Picking {
  /** The nearest place of the skin under a pixel of the page, with the nearest corner of its triangle. */
  pick(clientX, clientY) {
    const skin = this.parts.get("skin");
    if (!skin) return null;
    const { start, direction } = this.rayAt(clientX, clientY);
    const { points } = skin;
    let best = null, nearest = Infinity;
    const at = (v) => [points[3 * v], points[3 * v + 1], points[3 * v + 2]];
    for (const index of [skin.arrays.index, skin.arrays.lined]) for (let t = 0; t < index.length; t += 3) {
      const a = at(index[t]), u = add(at(index[t + 1]), a, -1), v = add(at(index[t + 2]), a, -1);
      const p = cross(direction, v), det = dot(u, p);
      if (det < 1e-12) continue; // seen from behind
      const away = add(start, a, -1), s = dot(away, p) / det;
      if (s < 0 || s > 1) continue;
      const q = cross(away, u), r = dot(direction, q) / det;
      if (r < 0 || s + r > 1) continue;
      const depth = dot(v, q) / det;
      if (depth > 0 && depth < nearest) {
        nearest = depth;
        const shares = [1 - s - r, s, r], corner = shares.indexOf(Math.max(...shares));
        best = { vertex: index[t + corner], corners: [index[t], index[t + 1], index[t + 2]], triangle: t / 3, shares };
      }
    }
    if (best) Object.assign(best, { pixel: [clientX, clientY], version: skin.info.version, place: add(start, direction, nearest), depth: nearest, shares: best.shares.map((s) => Math.max(0, Math.min(1, s))) });
    return best;
  }

  /** The eye under a pixel of the page, if the skin does not cover it. */
  pickEye(clientX, clientY) {
    const eyes = [...this.parts.values()].filter((part) => part.kind === "eye");
    if (!eyes.length || !this.camera) return null;
    const { start, direction } = this.rayAt(clientX, clientY);
    for (const { info: { centre, radius } } of eyes) {
      const away = add(start, centre, -1), b = dot(away, direction), under = b * b - dot(away, away) + radius * radius;
      if (under < 0) continue;
      const depth = -b - Math.sqrt(under), skin = this.pick(clientX, clientY);
      if (skin && skin.depth < depth) return null;
      return { radius, side: Math.sign(dot(this.camera.basis().right, this.camera.axes[0])) || 1 };
    }
    return null;
  }

  /** Where a vertex of the skin is. */
  pointOf(vertex) {
    return [...this.parts.get("skin").points.subarray(3 * vertex, 3 * vertex + 3)];
  }

  /** Where a probe is now: the corners of its triangle, their shares, the nearest of them, and the place. */
  pinned(name) {
    const { arrays, info } = this.parts.get("probes") ?? {}, k = 3 * (info?.names.indexOf(name) ?? -1);
    if (k < 0) return null;
    const corners = [...arrays.corners.subarray(k, k + 3)], shares = [...arrays.shares.subarray(k, k + 3)];
    const place = corners.reduce((sum, corner, c) => add(sum, this.pointOf(corner), shares[c]), [0, 0, 0]);
    return { corners, shares, vertex: corners[shares.indexOf(Math.max(...shares))], place };
  }

  /** The pixel of the page, from the corner of the view, where a place is seen. */
  project(place) { return this.projection()(place); }

  /** A function that finds such pixels, for many places. */
  projection() {
    const { towards, right, up } = this.camera.basis(), { position } = this.camera, { clientWidth: width, clientHeight: height } = this.canvas;
    const scale = 0.5 * height * this.camera.matrices(width / height).focal;
    return (place) => {
      const at = add(place, position, -1), deep = -dot(at, towards);
      return { x: 0.5 * width + (scale * dot(at, right)) / deep, y: 0.5 * height - (scale * dot(at, up)) / deep };
    };
  }

  /** Does the skin at a vertex face the camera? */
  faces(vertex, place) {
    return dot(this.parts.get("skin").normals.subarray(4 * vertex, 4 * vertex + 3), add(this.camera.position, place, -1)) > 0;
  }

  /** Start and direction of the ray through a pixel of the page. */
  rayAt(clientX, clientY) {
    const bounds = this.canvas.getBoundingClientRect();
    const x = (2 * (clientX - bounds.left)) / bounds.width - 1, y = 1 - (2 * (clientY - bounds.top)) / bounds.height;
    return this.camera.ray(x, y, bounds.width / bounds.height);
  }
}
