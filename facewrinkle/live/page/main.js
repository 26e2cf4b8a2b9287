// The page: connection, view and controls, and what the keyboard does.

import { Compare } from "./compare.js";
import { Fibers } from "./fibers.js";
import { Mixtures } from "./mixtures.js";
import { Opening } from "./opening.js";
import { Overlay } from "./overlay.js";
import { Palette } from "./palette.js";
import { Panels } from "./panels.js";
import { pointers } from "./pointer.js";
import { Sliders, element, slider, titled } from "./sliders.js";
import { Connection } from "./socket.js";
import { Timeline } from "./timeline.js";
import { Tour } from "./tour.js";
import { View } from "./view.js";

const $ = (id) => document.getElementById(id);
const KEYS = [
  ["Ctrl+K", "find any control"], ["Ctrl+Z, Ctrl+Shift+Z", "undo, redo"], ["R", "reset everything"], ["M", "both sides, or each"],
  ["F", "front view"], ["1 to 9", "camera views"], ["H", "muscles"], ["A", "compare with this state"], ["W", "wireframe"], ["C", "color by the next field"], ["Space", "play or stop"],
  ["K", "add a key"], ["← →", "rotate, or step a frame"], ["/", "search"], ["?", "this help"],
];

const SYMBOLS = { W: "height W (mm)", epsilon: "compression ε", lambda: "along λ", gamma: "across γ", theta: "phase θ", split_gamma: "split criterion" };

class App {
  constructor() {
    this.connection = new Connection();
    this.view = new View($("canvas"), () => this.connection.send("shown"));
    this.sliders = new Sliders($("sliders"), this.connection);
    this.panels = new Panels($("tabs"), $("panels"), this);
    this.timeline = new Timeline($("timeline"), this);
    this.mixtures = new Mixtures($("own"), this);
    this.palette = new Palette(this);
    this.overlay = new Overlay($("overlay"), this);
    this.fibers = new Fibers(this, [$("left")]);
    this.compare = new Compare($("compare"), $("curtain"), this);
    this.view.ondraw = () => { this.overlay.follow(); this.fibers.follow(); this.compare.follow(); };
    this.opening = new Opening(this);
    this.tour = new Tour(this);
    this.data = null;
    this.listen();
    this.controls();
    pointers($("canvas"), this.view, this);
    addEventListener("keydown", (event) => this.keyboard(event));
    $("keys").append(...KEYS.map(([key, what]) => element("tr", {}, element("td", {}, ...key.split(", ").flatMap((each) => [element("kbd", { text: each }), " "])), element("td", { text: what }))));
  }

  listen() {
    const on = (type, act) => this.connection.addEventListener(type, ({ detail }) => act(detail));
    on("welcome", (welcome) => {
      this.welcome = welcome;
      this.sliders.build(welcome);
      this.panels.build(welcome);
      this.takeFace(welcome);
      $("view").replaceChildren(element("option", { value: "", text: "Custom", disabled: true, hidden: true }),
        ...Object.keys(welcome.views).map((name) => element("option", { value: name, text: titled(name) })));
      $("view").value = "front";
      this.drivenBy(welcome.driver);
      this.showField(this.view.field ?? "");
      this.offer(welcome.earlier);
    });
    on("face", (face) => this.takeFace(face));
    on("earlier", ({ when }) => this.offer(when)); // another page may have answered
    on("driver", ({ name }) => this.drivenBy(name));
    on("progress", (what) => this.opening.progress(what));
    on("document", ({ data, history, handles }) => {
      this.data = data;
      this.handles = handles;
      $("probe").hidden = true; // it told of what was before
      this.sliders.update(data);
      this.panels.update(data);
      this.timeline.update(data);
      this.intensity.set(data.intensity);
      this.mixtures.update(data);
      this.handlesOf(this.panels.opened);
      [$("undo").disabled, $("redo").disabled] = history.map((count) => !count);
      $("drop").hidden = history[0] > 0 || this.face.faces.first !== "Built-in head"; // until something is done
    });
    on("frame", (head) => {
      this.view.frame(head);
      if (head.time !== this.timeline.time && this.timeline.length) this.timeline.show(head.time);
      document.body.dataset.step = head.step;
      document.body.dataset.still = head.still;
    });
    on("photo", (photo) => this.view.setPhoto(photo));
    on("error", (text) => this.say(text));
    on("lost", ({ final, reason }) => {
      this.timeline.toggle(false);
      $("state").textContent = final ? "" : "Connection lost; reconnecting …";
      if (final) this.say(`No studio is running at this address (${reason}). Use the address that was printed when the studio started.`, { stay: true });
    });
    this.view.onfield = (info) => this.legend(info);
    this.view.onrestored = () => location.reload();
  }

  /** Tell which phone or tracker drives the face; "" if none does. */
  drivenBy(name) { $("state").textContent = name && `${name} drives the face`; }

  /** Take over a face: its size, views, landmarks, and the sliders that do nothing on it. */
  takeFace(face) {
    const other = !this.face || this.face.faces.shown !== face.faces.shown;
    this.face = face;
    this.handles = face.handles;
    this.unit = face.unit;
    this.view.begin(face, other);
    this.sliders.setOff(face.off);
    this.panels.face.take(face);
    this.panels.setClosed(face.closed);
    const muscles = Object.keys(face.pulls).length && face.contracts, box = $("muscles");
    if (!muscles && box.checked) box.click();
    box.disabled = !muscles;
    box.parentElement.title = muscles ? this.shownMuscles : "No muscle moves this face: a recorded animation does, or it has none";
    this.handlesOf(this.panels.opened);
    if (other && this.welcome) $("view").value = "front";
  }

  /** Show the handles that belong to a tab. */
  handlesOf(title) {
    if (!this.overlay) return;
    const kind = { Face: this.panels.face?.shown.checked ? "landmarks" : "", Patterns: "patterns", Tears: "tears" }[title];
    const some = kind && (kind === "landmarks" || Object.keys(this.handles?.[kind] ?? {}).length);
    this.overlay.show(some || !$("muscles").checked || this.face.clip ? kind ?? "" : "pulls");
  }

  /** Offer the session that an earlier studio left in the folder. */
  offer(when) {
    const box = $("offer");
    box.hidden = !when;
    if (!when) return;
    const go = (on) => () => this.ask("continue", { on }); // where that is done, it is offered no more
    box.replaceChildren(element("span", { text: `Found a session of ${when}.` }),
      element("button", { class: "main", text: "Resume", onclick: go(true) }), element("button", { text: "Start new", onclick: go(false) }));
  }

  /** Open the side that something is in, where there is room for one only. */
  reveal(what) {
    const side = what.closest("#left, #right");
    if (side) this.drawer(side.id, true);
  }

  drawer(side, on = document.querySelector("main").dataset.drawer !== side) {
    document.querySelector("main").dataset.drawer = on ? side : "";
    for (const button of document.querySelectorAll(".drawer")) button.setAttribute("aria-expanded", on && button.getAttribute("aria-controls") === side);
  }

  clearSearch() { $("search").value = ""; this.sliders.search(""); }

  /** The camera is no longer that of a named view. */
  turned() { $("view").value = ""; }

  controls() {
    $("undo").onclick = () => this.connection.send("undo");
    $("redo").onclick = () => this.connection.send("redo");
    $("reset").onclick = () => this.connection.send("reset");
    $("lock").onchange = () => this.sliders.lock($("lock").checked);
    $("search").oninput = () => this.sliders.search($("search").value);
    $("view").onchange = () => this.view.take($("view").value);
    $("wireframe").onchange = () => { this.view.wireframe = $("wireframe").checked; this.view.request(); };
    this.shownMuscles = $("muscles").parentElement.title;
    $("muscles").onchange = () => { this.handlesOf(this.panels.opened); this.askShown(); };
    for (const button of document.querySelectorAll(".drawer")) button.onclick = () => this.drawer(button.getAttribute("aria-controls"));
    this.reveal($("left"));
    $("open").onclick = () => this.opening.choose();
    $("save").onclick = () => { this.reveal($("right")); this.panels.open("Save"); this.panels.panels.Save.tab.focus(); };
    $("palette-button").onclick = () => this.palette.open();
    $("help-button").onclick = () => $("help").showModal();
    $("tour-button").onclick = () => this.tour.start();
    this.intensity = slider("Intensity of all", { usual: 1, change: (value, gesture) => this.connection.change([[["intensity"], value]], gesture) });
    document.querySelector(".row.whole").replaceChildren(element("span", { text: "Intensity" }), this.intensity.input, this.intensity.output);
  }

  /** Show a field in color; "" for skin. */
  showField(name) {
    this.askShown(name);
    this.view.setField(name || null, name ? this.welcome.fields[name] : []);
    this.panels.select.value = name;
    $("legend").hidden = !name;
    this.panels.fieldChanged(name);
  }

  /** Ask for what is shown besides the face. */
  askShown(name = this.view.field) {
    this.connection.send("field", { name: name || null, muscles: $("muscles").checked });
    $("contraction").hidden = !$("muscles").checked;
  }

  /** Tell what is under the pointer: the muscle, and the number of the field. */
  hover(event) {
    if (this.hovering) return;
    this.hovering = true;
    requestAnimationFrame(() => {
      this.hovering = false;
      if (!$("canvas").matches(":hover")) return; // it has left meanwhile
      this.fibers.hover(event);
      const here = $("legend").querySelector(".here");
      if (!here || $("legend").hidden) return;
      const hit = this.view.pick(event.clientX, event.clientY), value = hit && this.view.valueAt(hit);
      here.textContent = value === null ? "" : `here: ${typeof value === "number" ? Number(value.toPrecision(3)) : value.replaceAll("_", " ")}`;
    });
  }

  legend(info) {
    const box = $("legend");
    if (!this.view.field || box.hidden) return;
    const colors = this.welcome.fields[info.name], stops = [];
    for (let k = 0; k < colors.length; k += 9) stops.push(`rgb(${colors.slice(k, k + 3)})`);
    const named = Object.entries(info.names ?? {}), shown = `${info.name} ${named}`;
    if (box.dataset.name !== shown) {
      box.dataset.name = shown;
      if (named.length) { // each name with its color
        const [low, high] = info.range, at = (v) => 3 * Math.round((63 * (v - low)) / (high - low || 1));
        box.replaceChildren(element("div", { text: info.name }), ...named.map(([number, name]) => {
          const swatch = element("i");
          swatch.style.background = `rgb(${colors.slice(at(number), at(number) + 3)})`;
          return element("div", { class: "name" }, swatch, name.replaceAll("_", " "));
        }), element("div", { class: "here" }));
        return;
      }
      const scale = element("div", { class: "scale" });
      scale.style.background = `linear-gradient(to right, ${stops})`;
      box.replaceChildren(element("div", { text: `${info.name}: ${info.about}` }), scale,
        element("div", { class: "ends" }, element("span"), element("span")), element("div", { class: "here" }));
    }
    box.querySelectorAll(".ends span").forEach((end, k) => { end.textContent = Number((this.view.locked ?? info.range)[k].toPrecision(3)); });
    this.panels.rangeIs(info.range);
  }

  // --- the view -----------------------------------------------------------------------------------

  async click(event) {
    const hit = this.view.pick(event.clientX, event.clientY);
    if (!hit) { $("probe").hidden = true; return; }
    const act = this.placing;
    this.endPlacing();
    const found = await this.probe(hit);
    if (found && act) act(found.rest);
    else if (found) this.showProbe(found);
  }

  /** What is known at a place; while triangles change, the newest frame is asked for again. */
  async probe(hit) {
    for (let attempt = 0; ; attempt++) {
      try {
        return await this.connection.ask("probe", { corners: hit.corners, shares: hit.shares, version: hit.version });
      } catch (error) {
        if (attempt > 4) { this.say(error.message); return null; }
        await new Promise((done) => setTimeout(done, 150));
        hit = this.view.pick(...hit.pixel); // corners have other numbers in the newer mesh
        if (!hit) return null;
      }
    }
  }

  showProbe({ made_by: maker, formula, values, numbers = {}, added = {}, level, vertex, rest }) {
    const others = Object.entries(added).length > 1 ? Object.entries(added).map(([name, value]) => [`${name.replaceAll("_", " ")} adds (mm)`, value]) : [];
    const box = $("probe"), rows = [...Object.entries(values), ...Object.entries(numbers), ...others, ["refinement level", level], ["vertex", vertex]];
    box.replaceChildren(element("button", { class: "small", text: "×", "aria-label": "Close", onclick: () => { box.hidden = true; } }),
      element("strong", { text: maker.replaceAll("_", " ").replace(/^./, (c) => c.toUpperCase()) }),
      element("table", {}, element("tbody", {}, ...rows.map(([name, value]) => element("tr", {}, element("td", { text: SYMBOLS[name] ?? name }),
        element("td", { text: Number(Number(value).toPrecision(4)) }))))));
    if (formula) box.append(element("div", { class: "formula", text: formula }));
    box.append(element("button", { class: "small", text: "Place a probe here", onclick: () => { this.add("probes", rest); box.hidden = true; } }));
    box.hidden = false;
  }

  /** Wait for a click on the face, and call `act` with the place at rest. */
  place(hint, button, act) {
    this.endPlacing();
    $("probe").hidden = true;
    this.placing = act;
    this.placingButton = button;
    button.setAttribute("aria-pressed", "true");
    $("hint").textContent = `${hint} Enter takes the middle of the view, Esc cancels.`;
    $("hint").hidden = false;
    $("canvas").classList.add("placing");
    $("canvas").focus();
  }

  endPlacing() {
    this.placing = null;
    this.placingButton?.setAttribute("aria-pressed", "false");
    $("hint").hidden = true;
    $("canvas").classList.remove("placing");
  }

  add(table, ...entries) {
    const taken = new Set(Object.keys(this.data[table])), stem = table.slice(0, -1);
    this.connection.change(entries.map((entry) => {
      let number = 1;
      while (taken.has(`${stem} ${number}`)) number += 1;
      taken.add(`${stem} ${number}`);
      return [[table, `${stem} ${number}`], entry];
    }));
  }

  cameraNumbers() { return [...this.view.camera.position, ...this.view.camera.focus]; }

  async ask(command, values) {
    try { return await this.connection.ask(command, values); } catch (error) { this.say(error.message); return null; }
  }

  /** Say something for as long as it takes to read: what went wrong, or a note. */
  say(text, { stay = false, note = false } = {}) {
    const box = $("message");
    box.textContent = text;
    box.classList.toggle("note", note);
    box.hidden = false;
    clearTimeout(this.saying);
    if (!stay) this.saying = setTimeout(() => { box.hidden = true; }, Math.max(9000, 80 * text.length));
  }

  // --- the keyboard -------------------------------------------------------------------------------

  keyboard(event) {
    const { key, target } = event, command = event.ctrlKey || event.metaKey;
    if (command && key.toLowerCase() === "k") { event.preventDefault(); if (!this.palette.box.open && this.data) this.palette.open(); return; }
    const typing = target.matches?.("input[type=search], input[type=text], input[type=number], select, textarea");
    if (key === "Escape") { this.endPlacing(); $("probe").hidden = true; if (typing) target.blur(); return; }
    if (command && key.toLowerCase() === "z") {
      event.preventDefault();
      this.connection.send(event.shiftKey ? "redo" : "undo");
      return;
    }
    if (typing || command || event.altKey || $("help").open || this.palette.box.open || !this.view.camera) return;
    const inView = target === $("canvas"), camera = this.view.camera;
    if (key === "Enter" && inView && this.placing) {
      const { left, top, width, height } = target.getBoundingClientRect();
      this.click({ clientX: left + width / 2, clientY: top + height / 2 });
    }
    if (inView && key.startsWith("Arrow")) this.turned();
    const act = {
      r: () => this.connection.send("reset"), m: () => $("lock").click(), f: () => { this.view.take("front"); $("view").value = "front"; },
      w: () => $("wireframe").click(), h: () => $("muscles").click(), a: () => $("compare").click(), c: () => this.nextField(event.shiftKey ? -1 : 1), k: () => this.timeline.add(), "?": () => $("help").showModal(),
      "/": () => $("search").focus(), "+": () => camera.zoom(0.9), "-": () => camera.zoom(1 / 0.9),
      " ": () => { if (!target.matches?.("button, input")) this.timeline.toggle(); },
      ArrowLeft: () => inView ? camera.turn(-0.08, 0) : this.nudge(-1), ArrowRight: () => inView ? camera.turn(0.08, 0) : this.nudge(1),
      ArrowUp: () => inView && camera.turn(0, -0.08), ArrowDown: () => inView && camera.turn(0, 0.08),
    }[key.length === 1 ? key.toLowerCase() : key];
    if (key >= "1" && key <= "9") {
      const name = Object.keys(this.view.views)[Number(key) - 1];
      if (name) { this.view.take(name); $("view").value = name; }
    } else if (act && !(key.startsWith("Arrow") && target.matches?.("input[type=range], [role=slider], [role=tab]"))) {
      if (key === " " && target.matches?.("button, input")) return;
      event.preventDefault();
      act();
      this.view.request(true);
    }
  }

  nudge(frames) {
    this.timeline.toggle(false);
    const time = Math.max(0, Math.min(this.timeline.length, this.timeline.time + 0.04 * frames));
    this.connection.send("pose", { time });
  }

  nextField(by) {
    const names = ["", ...Object.keys(this.welcome.fields)], at = names.indexOf(this.view.field ?? "");
    this.showField(names.at((at + by) % names.length));
    this.panels.open("Fields");
  }
}

try {
  globalThis.app = new App();
} catch (error) {
  $("message").textContent = error.message;
  $("message").hidden = false;
  $("state").textContent = "";
  throw error;
}
