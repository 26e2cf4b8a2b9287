// Handles of muscles: a dot where a muscle moves the skin, pulled along its fibres.

import { add } from "./camera.js";
import { drawn } from "./sliders.js";

const WAY = 0.6; // of a muscle's length, for a full contraction
const LEAST = 40; // pixels of a full contraction, for muscles that point at the viewer

const title = (name) => name.replace(/_l$/, ", left").replace(/_r$/, ", right").replaceAll("_", " ");

/** The muscle of the other side. */
const mirrored = (name) => (name.endsWith("_l") ? `${name.slice(0, -2)}_r` : name.endsWith("_r") ? `${name.slice(0, -2)}_l` : null);

/** The handle of a muscle of the overlay. */
export function pull(overlay, name, where) {
  const { app, view } = overlay;
  const dot = drawn("circle", { class: "pull", r: 5, tabindex: 0, role: "slider", "aria-label": title(name), "aria-valuemin": 0, "aria-valuemax": 100, "aria-valuenow": 0 });
  const line = drawn("line", { class: "fibre", "aria-hidden": "true" });
  dot.dataset.handle = name;
  const stem = name.replace(/_[lr]$/, "");
  const handle = { name, where, dot, line, label: title(name) };
  let drag = null, gesture = "", last = -Infinity, asked = 0;
  handle.weight = () => Math.max(app.data.mixture[name] ?? 0, app.data.mixture[stem] ?? 0);
  const set = (weight) => {
    const rounded = Math.round(100 * Math.max(0, Math.min(1, weight))) / 100, other = mirrored(name), { mixture } = app.data;
    const patches = [[["mixture", name], rounded || null]];
    if (other && app.sliders.locked) patches.push([["mixture", other], rounded || null]);
    else if (other && mixture[stem]) patches.push([["mixture", other], Math.max(mixture[stem], mixture[other] ?? 0)]);
    if (other && mixture[stem] !== undefined) patches.push([["mixture", stem], null]);
    app.connection.change(patches, gesture);
  };
  /** The way of a full contraction in the picture, pixels. */
  handle.way = () => {
    const place = view.pointOf(handle.where.vertex), a = view.project(place), b = view.project(add(place, handle.where.pull, WAY));
    const x = b.x - a.x, y = b.y - a.y, long = Math.hypot(x, y) || 1, scale = Math.max(long, LEAST) / long;
    return { x: x * scale, y: y * scale };
  };
  dot.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    dot.focus();
    dot.setPointerCapture(event.pointerId);
    gesture = `pull ${name} ${event.timeStamp}`;
    drag = { x: event.clientX, y: event.clientY, weight: handle.weight(), way: handle.way() };
    overlay.dragged = handle;
  });
  dot.addEventListener("pointermove", (event) => {
    if (!drag) return;
    const { x, y } = drag.way;
    set(drag.weight + ((event.clientX - drag.x) * x + (event.clientY - drag.y) * y) / (x * x + y * y));
  });
  const end = () => { drag = overlay.dragged = null; overlay.follow(); };
  dot.addEventListener("pointerup", end);
  dot.addEventListener("pointercancel", end);
  dot.addEventListener("keydown", (event) => {
    const by = { ArrowUp: 0.05, ArrowRight: 0.05, ArrowDown: -0.05, ArrowLeft: -0.05, Delete: -1, Backspace: -1, Home: -1, End: 1 }[event.key];
    if (!by) return;
    event.preventDefault();
    event.stopPropagation();
    if (event.timeStamp - last > 900) { // keys that follow each other are one step, and need not wait for the answer
      gesture = `pull ${name} ${event.timeStamp}`;
      asked = handle.weight();
    }
    last = event.timeStamp;
    asked = Math.max(0, Math.min(1, asked + by));
    set(asked);
  });
  return handle;
}
