// Handles of muscles: a dot where a muscle moves the skin, pulled along its fibers.

import { add } from "./camera.js";
import { muscleTitle } from "./fibers.js";
import { draggable } from "./pointer.js";
import { drawn } from "./sliders.js";

const WAY = 0.6; // of a muscle's length, for a full contraction
const LEAST = 40; // pixels of a full contraction, for muscles that point at the viewer

/** The handle of a muscle of the overlay. */
export function pull(overlay, name, where) {
  const { app, view } = overlay;
  const dot = drawn("circle", { class: "pull", r: 5, tabindex: 0, role: "slider", "aria-label": muscleTitle(name), "aria-valuemin": 0, "aria-valuemax": 100, "aria-valuenow": 0 });
  const line = drawn("line", { class: "fiber", "aria-hidden": "true" });
  dot.dataset.handle = name;
  const stem = name.replace(/_[lr]$/, "");
  const handle = { name, where, dot, line, label: muscleTitle(name) };
  let asked = 0;
  handle.weight = () => app.sliders.weight(name, stem);
  const set = (weight, gesture) => {
    const sides = stem === name ? [name] : [`${stem}_l`, `${stem}_r`];
    asked = Math.round(100 * Math.max(0, Math.min(1, weight))) / 100;
    app.sliders.change(stem, sides, app.sliders.locked ? sides : [name], asked, gesture);
  };
  /** The way of a full contraction in the picture, pixels. */
  handle.way = () => {
    const place = view.pointOf(handle.where.vertex), a = view.project(place), b = view.project(add(place, handle.where.pull, WAY));
    const x = b.x - a.x, y = b.y - a.y, long = Math.hypot(x, y) || 1, scale = Math.max(long, LEAST) / long;
    return { x: x * scale, y: y * scale };
  };
  draggable(dot, `pull ${name}`, {
    taken: (event) => {
      event.preventDefault();
      dot.focus();
      overlay.dragged = handle;
      return { x: event.clientX, y: event.clientY, weight: handle.weight(), way: handle.way() };
    },
    drag: (event, { x, y, weight, way }, gesture) =>
      set(weight + ((event.clientX - x) * way.x + (event.clientY - y) * way.y) / (way.x * way.x + way.y * way.y), gesture),
    dropped: () => { overlay.dragged = null; overlay.follow(); },
    keys: { ArrowUp: 0.05, ArrowRight: 0.05, ArrowDown: -0.05, ArrowLeft: -0.05, Delete: -1, Backspace: -1, Home: -1, End: 1 },
    press: (event, by, gesture, again) => set((again ? asked : handle.weight()) + by, gesture),
  });
  return handle;
}
