// Fibers of muscles, seen through the skin and colored by contraction; they and their sliders point at each other.

import { FIBERS } from "./materials.js";
import { element, titled } from "./sliders.js";

const NEAR = 9; // pixels to a fiber that is pointed at
const DWELL = 350; // ms until its slider is scrolled to
const MOST = 6; // names that are shown at once

export const muscleTitle = (name) => titled(name).replace(/ l$/, ", left").replace(/ r$/, ", right");

export class Fibers {
  constructor(app, sides) {
    Object.assign(this, { app, view: app.view, tags: [], rows: [] });
    this.box = element("div", { "aria-hidden": "true" });
    app.view.canvas.after(this.box);
    app.view.canvas.addEventListener("pointerleave", () => this.light([]));
    for (const side of sides) {
      for (const type of ["pointerover", "focusin"]) side.addEventListener(type, ({ target }) => this.fromSlider(target));
      for (const type of ["pointerleave", "focusout"]) side.addEventListener(type, () => this.light([]));
    }
  }

  get part() { return this.view.parts.get("fibers"); }

  /** The muscles that a row of sliders contracts. */
  moved({ name }) { return this.app.welcome.atlas.moves[name] ?? []; }

  fromSlider(target) {
    const line = target.closest(".row"), row = line && this.app.sliders.rows.find((each) => each.line === line || each.copy?.line === line);
    this.light(row ? this.moved(row) : []);
  }

  /** Let the fibers of muscles stand out, with their names; `pointed`: their sliders, too. */
  light(names, pointed = false) {
    if ((names.length && !this.part) || String(names) === String([...this.view.lit])) return;
    this.view.lit = new Set(names);
    clearTimeout(this.later);
    for (const row of this.rows) row.classList.remove("linked");
    this.rows = [];
    if (pointed && names.length) {
      const rows = this.app.sliders.rows.filter((row) => this.moved(row).some((name) => names.includes(name)));
      this.rows = rows.flatMap(({ line, copy }) => (copy ? [line, copy.line] : [line]));
      for (const row of this.rows) row.classList.add("linked");
      this.later = setTimeout(() => rows.at(-1)?.line.scrollIntoView({ block: "nearest" }), DWELL); // that of the muscle itself
    }
    this.view.request();
  }

  /** Light the fibers under the pointer. */
  hover({ clientX, clientY }) {
    if (!this.part?.points) return;
    const box = this.view.canvas.getBoundingClientRect(), pixel = this.view.projection(), { points, arrays, info: { names, knots } } = this.part;
    let best = null, nearest = NEAR;
    for (let p = 0; p < points.length; p += 3) {
      const { x, y } = pixel([points[p], points[p + 1], points[p + 2]]), away = Math.hypot(x + box.left - clientX, y + box.top - clientY);
      if (away < nearest) { nearest = away; best = p; }
    }
    this.light(best !== null && this.seen(points.subarray(best, best + 3)) ? [names[arrays.muscle[Math.floor(best / (3 * knots))]]] : [], true);
  }

  /** Is a place seen through the skin, and not behind the head? */
  seen(place) {
    const { view } = this, box = view.canvas.getBoundingClientRect(), { x, y } = view.project(place), hit = view.pick(x + box.left, y + box.top);
    return !hit || Math.hypot(...view.camera.position.map((c, k) => c - place[k])) < hit.depth + FIBERS.beneath * view.camera.size;
  }

  /** Put the names of the fibers that stand out beside them: on the outside, one below the other. */
  follow() {
    const { view, part } = this, box = this.box;
    const lit = part?.points ? part.info.names.map((name, m) => [name, m]).filter(([name]) => view.lit.has(name)).slice(0, MOST) : [];
    const tags = lit.map(([name, m]) => {
      const { muscle, rate } = part.arrays, { knots } = part.info, middle = Math.floor((muscle.indexOf(m) + muscle.lastIndexOf(m)) / 2);
      const p = 3 * (knots * middle + Math.floor(knots / 2)), { x, y } = view.project(part.points.subarray(p, p + 3));
      return { x, y: y - 26, tag: element("div", { class: "handle-name", text: `${muscleTitle(name)}: ${Math.round(rate[m] / 2.55)}` }) };
    }).sort((a, b) => a.y - b.y);
    const middle = tags.reduce((sum, { x }) => sum + x, 0) / tags.length, placed = [];
    if (tags.length || box.firstChild) box.replaceChildren(...tags.map(({ tag }) => tag));
    for (const { x, y, tag } of tags) {
      const wide = tag.offsetWidth + 1, left = Math.max(0, Math.min(x < middle ? x - 10 - wide : x + 10, view.canvas.clientWidth - wide));
      const top = Math.max(y, ...placed.filter((other) => left < other.right && other.left < left + wide).map((other) => other.top + 22));
      Object.assign(tag.style, { left: `${left}px`, top: `${top}px` });
      placed.push({ left, right: left + wide, top });
    }
  }
}
