// Handles on the face: landmarks, and the places and sizes of patterns and tears.

import { add, mirrored } from "./camera.js";
import { draggable } from "./pointer.js";
import { pull } from "./pulls.js";
import { drawn, element, titled } from "./sliders.js";

export class Overlay {
  constructor(box, app) {
    Object.assign(this, { box, app, view: app.view, kind: "", handles: [], place: {} });
    this.name = element("div", { class: "handle-name", hidden: true });
    box.after(this.name);
  }

  /** Show handles of a kind: "landmarks", "patterns", "tears" or none. */
  show(kind) {
    this.kind = kind;
    this.build();
  }

  build() {
    const { data, face, handles } = this.app, made = [];
    const places = { landmarks: face?.landmarks, pulls: face?.pulls }[this.kind] ?? handles?.[this.kind] ?? {}, probes = Object.keys(data?.probes ?? {});
    const names = `${this.kind} ${face?.faces.shown} ${Object.keys(places)} ${probes}`;
    if (names === this.names) { // a handle that was made anew would lose the pointer
      for (const handle of this.handles) handle.where = places[handle.name] ?? handle.where;
      return this.follow();
    }
    this.names = names;
    if (this.kind === "pulls" && data) {
      for (const [name, where] of Object.entries(places)) made.push(this.namedOn(pull(this, name, where)));
    } else if (this.kind === "landmarks" && face) {
      for (const [name, where] of Object.entries(places)) {
        const { confidence, estimated } = where, unsure = estimated || (confidence !== null && confidence < 0.5);
        const told = [`Landmark ${name.replaceAll("_", " ")}`, estimated && "estimated", confidence !== null && `confidence ${Math.round(100 * confidence)} %`];
        made.push(this.handle(name, where, `landmark${unsure ? " unsure" : ""}`, told.filter(Boolean).join(", "),
          (place) => this.landmarks(name, place)));
      }
    } else if ((this.kind === "patterns" || this.kind === "tears") && data) {
      const key = this.kind === "patterns" ? "center" : "start";
      for (const [name, where] of Object.entries(places)) {
        const handle = this.handle(name, where, "placed", `Position of ${name}`, (place) => [[[this.kind, name], { ...this.app.data[this.kind][name], [key]: place }]]);
        if (this.kind === "patterns") this.sized(handle, name);
        made.push(handle);
      }
    }
    for (const name of probes) made.push(this.pin(name));
    const focused = document.activeElement?.dataset?.handle;
    this.handles = made;
    this.box.replaceChildren(...made.flatMap(({ ring, grip, line, text, dot }) => [ring, grip, line, text, dot].filter(Boolean)));
    this.follow();
    if (focused) made.find(({ dot }) => dot.dataset.handle === focused)?.dot.focus();
  }

  /** A handle, hidden until it has a place in the picture: before, keys would move it nowhere. */
  handle(name, where, kind, label, patch) {
    const dot = drawn("circle", { class: `${kind} behind`, r: kind === "placed" ? 6 : 4, tabindex: 0, role: "button", "aria-label": `${label}. Arrow keys move it.` });
    dot.dataset.handle = name;
    const handle = { name, where, dot, patch, label };
    draggable(dot, name, {
      taken: (event) => { event.preventDefault(); return (this.dragged = handle); },
      drag: (event) => this.move(handle, event.clientX, event.clientY),
      dropped: () => this.drop(handle),
      keys: { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] },
      press: (event, [x, y]) => {
        const box = this.view.canvas.getBoundingClientRect(), step = event.shiftKey ? 8 : 2;
        this.move(handle, box.left + handle.x + step * x, box.top + handle.y + step * y);
        clearTimeout(this.later);
        this.later = setTimeout(() => this.drop(handle), 400);
      },
    });
    return this.namedOn(handle);
  }

  /** A probe: a pin in the skin, with the number of the field that is shown. */
  pin(name) {
    const handle = this.handle(name, null, "pin", `${titled(name)}: `, (place) => [[["probes", name], place]]);
    handle.text = drawn("text", { "aria-hidden": "true" });
    handle.dot.addEventListener("keydown", ({ key }) => { if (key === "Delete" || key === "Backspace") this.app.connection.change([[["probes", name], null]]); });
    return handle;
  }

  /** The number of the shown field at a pin, where it is now, beside it and in the list. */
  followPin(handle) {
    const number = handle.name.split(" ").at(-1), value = this.view.field && handle.where ? this.view.valueAt(handle.where) : null;
    const told = typeof value === "number" ? Number(value.toFixed(3)) : value?.replaceAll("_", " ") ?? "";
    handle.text.textContent = `${number}${told === "" ? "" : `: ${told}`}`;
    handle.text.setAttribute("x", handle.x + 9);
    handle.text.setAttribute("y", handle.y + 4);
    handle.dot.setAttribute("aria-label", `${titled(handle.name)}: ${told}. Arrow keys move it, Delete removes it.`);
    this.app.panels.probed(handle.name, told);
  }

  /** Show the name of a handle while the pointer, or the focus, is on it. */
  namedOn(handle) {
    const { dot } = handle;
    const named = (on) => {
      this.name.hidden = !on || Boolean(handle.line && this.app.fibers.part?.info.names.includes(handle.name)); // its fibers tell it
      this.named = on ? handle : null;
      if (handle.line) this.app.fibers.light(on ? [handle.name] : [], true);
      this.follow();
    };
    dot.addEventListener("pointerenter", () => { if (!this.dragged) named(true); });
    dot.addEventListener("pointerleave", () => { if (!this.dragged) named(false); });
    dot.addEventListener("focus", () => named(true));
    dot.addEventListener("blur", () => { if (!this.dragged) named(false); });
    return handle;
  }

  /** A landmark at another place; while both sides are moved together, its mirror image goes as far. */
  landmarks(name, place) {
    const { landmarks, axes } = this.app.face, patches = [[["landmarks", name], place]];
    const other = name.includes("_l") ? name.replace(/_l(?=_|$)/, "_r") : name.replace(/_r(?=_|$)/, "_l");
    if (this.app.sliders.locked && other !== name && landmarks[other]) {
      const by = mirrored(add(place, landmarks[name].place, -1), [0, 0, 0], axes[0]);
      patches.push([["landmarks", other], add(landmarks[other].place, by)]);
    }
    return patches;
  }

  /** A ring around a pattern, by which it is sized. */
  sized(handle, name) {
    handle.ring = drawn("circle", { class: "ring", "aria-hidden": "true" });
    const ring = (handle.grip = drawn("circle", { class: "grip", "aria-hidden": "true" })); // wider than what is seen
    draggable(ring, `size ${name}`, { taken: () => ring, drag: (event, _, gesture) => {
      const box = this.view.canvas.getBoundingClientRect(), entry = this.app.data.patterns[name];
      const away = Math.hypot(event.clientX - box.left - handle.x, event.clientY - box.top - handle.y);
      const [least, most] = this.app.welcome.patterns.numbers.size;
      const size = Math.max(least, Math.min(most, 2 * away * this.long));
      this.app.connection.change([[["patterns", name], { ...entry, size: Math.round(10 * size) / 10 }]], gesture);
    } });
  }

  /** Millimeters of a pixel at the distance of the face. */
  get long() { return (this.view.camera.height / this.view.canvas.clientHeight) * this.app.unit; }

  move(handle, clientX, clientY) {
    const hit = this.view.pick(clientX, clientY);
    if (!hit) return;
    handle.hit = hit;
    this.follow();
  }

  async drop(handle) {
    const { hit } = handle;
    this.dragged = null;
    if (!hit) return;
    const found = await this.app.probe(hit);
    handle.hit = null;
    if (found) this.app.connection.change(handle.patch(found.rest));
  }

  /** Put all handles where their places on the moving face are in the picture. */
  follow() {
    const { view, handles } = this;
    if (!handles.length || !view.camera || !view.parts.get("skin")) { this.name.hidden = true; return; }
    for (const handle of handles) {
      if (handle.text) handle.where = view.pinned(handle.name) ?? handle.where;
      const { dot, ring, grip, line, text, where, hit } = handle;
      if (!where) { dot.classList.add("behind"); continue; } // it comes with the next frame
      const place = hit ? hit.place : where.place ?? add(view.pointOf(where.vertex), where.offset);
      const at = view.project(place), hidden = !hit && this.dragged !== handle && (!view.faces(where.vertex, place) || view.inKept(at.x));
      handle.x = at.x; handle.y = at.y;
      for (const each of [dot, ring, grip, text].filter(Boolean)) {
        each.setAttribute("cx", at.x.toFixed(1));
        each.setAttribute("cy", at.y.toFixed(1));
        each.classList.toggle("behind", hidden);
      }
      const entry = ring && this.app.data.patterns[handle.name];
      if (entry) for (const each of [ring, grip]) each.setAttribute("r", Math.max(12, entry.size / 2 / this.long).toFixed(1));
      if (line) this.followPull(handle, at);
      if (text) this.followPin(handle);
      if (this.named === handle) {
        this.name.textContent = line ? `${handle.label}: ${dot.getAttribute("aria-valuenow")}` : handle.label.replace(/^(Landmark|Position of) |: $/g, "");
        Object.assign(this.name.style, { left: `${at.x + 10}px`, top: `${at.y - 26}px` });
      }
    }
  }

  /** The weight of a muscle's handle, and, while it is named, the way along which it is pulled. */
  followPull(handle, at) {
    const { dot, line } = handle, weight = handle.weight(), shown = this.named === handle;
    dot.setAttribute("aria-valuenow", Math.round(100 * weight));
    dot.classList.toggle("active", weight > 0);
    line.classList.toggle("behind", !shown);
    if (!shown) return;
    const way = handle.way();
    for (const [name, value] of Object.entries({ x1: at.x, y1: at.y, x2: at.x + way.x, y2: at.y + way.y })) line.setAttribute(name, value.toFixed(1));
  }
}
