// The skin as it is drawn: edges that bend are halved, and their middles lie on the smooth surface, as in the toolkit's pictures.

import { SMOOTH } from "./materials.js";

/** A number for an edge between two vertices. */
export const numbered = (a, b) => (a < b ? a * 2 ** 26 + b : b * 2 ** 26 + a);

/** A number for the place of an edge, the same for both names that it has at a seam of a photo; 0 if it stays as it is. */
function place(points, normals, a, b, least, longest) {
  let turn = 0, long = 0, place = 0;
  for (let k = 0; k < 3; k++) turn += (normals[4 * b + k] - normals[4 * a + k]) ** 2;
  for (let k = 0; k < 3; k++) {
    long += (points[3 * b + k] - points[3 * a + k]) ** 2;
    place = Math.PI * place + points[3 * a + k] + points[3 * b + k];
  }
  return (turn > SMOOTH.bend ** 2 && long * turn > least) || long > longest ? place : 0;
}

/** Set points (3 numbers each) and normals (4) of a vertex in the middle of the curve between two others. */
function set(points, normals, vertex, a, b) {
  let first = 0, last = 0, long = 0, size = 0, far = 0;
  for (let k = 0; k < 3; k++) {
    const along = points[3 * b + k] - points[3 * a + k];
    first += along * normals[4 * a + k];
    last += along * normals[4 * b + k];
    long += along * along;
    size += (normals[4 * vertex + k] = normals[4 * a + k] + normals[4 * b + k]) ** 2;
  }
  for (let k = 0; k < 3; k++) {
    far += (points[3 * vertex + k] = (last * normals[4 * b + k] - first * normals[4 * a + k]) / 8) ** 2;
    normals[4 * vertex + k] /= Math.sqrt(size) || 1;
  }
  normals[4 * vertex + 3] = (normals[4 * a + 3] + normals[4 * b + 3]) / 2;
  const share = Math.min(1, SMOOTH.largest * Math.sqrt(long / far) || 0);
  for (let k = 0; k < 3; k++) points[3 * vertex + k] = share * points[3 * vertex + k] + (points[3 * a + k] + points[3 * b + k]) / 2;
}

/** Add the parts of a triangle with vertices on some of its sides, or -1. */
function divide(out, a, b, c, ab, bc, ca) {
  if (ab < 0) divide(out, b, c, a, bc, ca, ab);
  else if (bc >= 0 && ca >= 0) out.push(a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca);
  else {
    let last = b;
    for (const next of [bc, c, ca, a]) if (next >= 0) { out.push(ab, last, next); last = next; }
  }
}

export class Smooth {
  /** Lists of triangles, split where an edge is too long, or bends and the arc over it rises too much, by points and normals. */
  constructor(lists, points, normals, rise, longest = Infinity) {
    this.count = points.length / 3;
    this.ends = []; // the two vertices that each new one lies between
    this.middles = new Map(); // the new vertices, by the edges that they halve
    this.whole = lists.map(() => []);
    [points, normals, lists] = [Array.from(points), Array.from(normals), lists.map((list) => Array.from(list))];
    for (let round = 0; round < SMOOTH.rounds; round++) lists = this.round(lists, points, normals, (8 * rise) ** 2, longest ** 2);
    this.lists = this.whole.map((list, which) => Uint32Array.from(list.concat(lists[which])));
  }

  /** Halve edges, keep triangles that have no such edge, and return the parts of the others. */
  round(lists, points, normals, least, longest) {
    const uses = new Map(), after = (list, s) => list[s % 3 === 2 ? s - 2 : s + 1];
    const places = lists.map((list) => list.map((a, s) => {
      const at = place(points, normals, a, after(list, s), least, longest);
      if (at) uses.set(at, (uses.get(at) ?? 0) + 1);
      return at;
    }));
    return lists.map((list, which) => {
      const out = [];
      const middle = (s) => (uses.get(places[which][s]) === 2 ? this.middle(list[s], after(list, s), points, normals) : -1); // rims stay as they are
      for (let t = 0; t < list.length; t += 3) {
        const ab = middle(t), bc = middle(t + 1), ca = middle(t + 2);
        if (Math.max(ab, bc, ca) < 0) this.whole[which].push(list[t], list[t + 1], list[t + 2]);
        else divide(out, list[t], list[t + 1], list[t + 2], ab, bc, ca);
      }
      return out;
    });
  }

  /** The vertex in the middle of an edge, a new one if there is none. */
  middle(a, b, points, normals) {
    const edge = numbered(a, b), known = this.middles.get(edge);
    if (known !== undefined) return known;
    const vertex = this.count + this.ends.length / 2;
    this.middles.set(edge, vertex);
    this.ends.push(a, b);
    set(points, normals, vertex, a, b);
    return vertex;
  }

  /** The vertices along an edge. */
  along(a, b) {
    const middle = this.middles.get(numbered(a, b));
    return middle === undefined ? [a, b] : [...this.along(a, middle).slice(0, -1), ...this.along(middle, b)];
  }

  /** Points and normals of all vertices by those of the first. */
  lifted(points, normals) {
    const { count, ends } = this, all = count + ends.length / 2, out = { points: new Float32Array(3 * all), normals: new Float32Array(4 * all) };
    out.points.set(points);
    out.normals.set(normals);
    for (let e = 0; e < ends.length; e += 2) set(out.points, out.normals, count + e / 2, ends[e], ends[e + 1]);
    return out;
  }

  /** Other values of all vertices by those of the first; labels are not mixed. */
  values(values, labels = false) {
    const { count, ends } = this, width = values.length / count, out = new values.constructor(values.length + (width * ends.length) / 2);
    out.set(values);
    for (let e = 0, at = values.length; e < ends.length; e += 2) {
      for (let k = 0; k < width; k++, at++) {
        const a = out[width * ends[e] + k], b = out[width * ends[e + 1] + k];
        out[at] = labels ? Math.max(a, b) : (a + b) / 2;
      }
    }
    return out;
  }
}
