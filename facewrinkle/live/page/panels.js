// The tabs of the right side.

import { mirrored } from "./camera.js";
import { FacePanel } from "./face_panel.js";
import { saving } from "./saving.js";
import { element, row, titled } from "./sliders.js";

const FIELD_NAMES = {
  "": "None (skin)", W: "Fold height (W)", epsilon: "Compression (ε)", lambda: "Position along the muscle (λ)", gamma: "Position across the muscle (γ)",
  theta: "Wave phase (θ)", split_gamma: "Split criterion", muscle: "Muscle", family: "Wave family", level: "Refinement level",
};
const number = (digits) => ({ shown: (v) => v.toFixed(digits), parse: (v) => v });

export class Panels {
  constructor(tabs, box, app) {
    Object.assign(this, { tabs, box, app, panels: {}, updates: [] });
  }

  build(welcome) {
    this.tabs.replaceChildren();
    this.box.replaceChildren();
    this.updates = [];
    this.panel("Folds", this.folds(welcome));
    this.panel("Patterns", this.patterns(welcome));
    this.panel("Tears", this.tears(welcome));
    this.face = new FacePanel(this, this.app);
    this.panel("Face", this.face.content);
    this.updates.push((data) => this.face.update(data));
    this.panel("Fields", this.fields(welcome));
    this.panel("Save", saving(welcome, this.app));
    this.open("Folds");
  }

  panel(title, content) {
    const id = title.toLowerCase();
    const tab = element("button", { role: "tab", id: `tab-${id}`, "aria-controls": `panel-${id}`, text: title, onclick: () => this.open(title) });
    tab.addEventListener("keydown", (event) => {
      const all = [...this.tabs.children], at = all.indexOf(tab) + { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (Number.isInteger(at)) { event.preventDefault(); const next = all.at(at % all.length); next.focus(); next.click(); }
    });
    const why = element("p", { class: "why", hidden: true }), inner = element("fieldset", {}, ...content);
    const panel = element("div", { role: "tabpanel", id: `panel-${id}`, "aria-labelledby": `tab-${id}` }, why, inner);
    this.tabs.append(tab);
    this.box.append(panel);
    this.panels[title] = { tab, panel, why, inner };
  }

  /** Switch off the tabs that do nothing on this face, and say why. */
  setClosed(closed) {
    for (const [title, { why, inner }] of Object.entries(this.panels)) {
      inner.disabled = Boolean(closed[title]);
      why.textContent = closed[title] ?? "";
      why.hidden = !closed[title];
    }
  }

  open(title) {
    for (const [name, { tab, panel }] of Object.entries(this.panels)) {
      tab.setAttribute("aria-selected", name === title);
      tab.tabIndex = name === title ? 0 : -1;
      panel.hidden = name !== title;
    }
    this.opened = title;
    this.app.handlesOf(title);
  }

  update(data) { for (const each of this.updates) each(data); }

  numberRow(title, path, [min, max], digits, usual, about) {
    const made = row(title, {
      min, max, step: digits ? 10 ** -digits : 1, ...number(digits), usual, about,
      change: (value, gesture) => this.app.connection.change([[path, value]], gesture),
    });
    return made;
  }

  /** Factors of the folds of single regions. */
  regions(names) {
    return [element("h2", { text: "Regions" }), ...names.map((name) => {
      const made = this.numberRow(titled(name), ["regions", name], [0, 4], 2, 1, "Depth factor for the waves in this region");
      made.input.setAttribute("aria-label", `Folds of ${name}`);
      this.updates.push((data) => made.set(data.regions[name] ?? 1));
      return made.line;
    })];
  }

  folds({ folds, regions }) {
    const names = {
      depth: ["Depth", "Depth factor for all folds"], left: ["Left side", "Depth factor on the subject's left"],
      right: ["Right side", "Depth factor on the subject's right"], density: ["Number", "Factor for the number of lines"],
      length: ["Length", "Factor for the length of the lines"],
      irregularity: ["Irregularity", "0 for even lines, up to 3 for very irregular ones"], age: ["Age", "Lines that stay visible at rest"],
    };
    const rows = Object.entries(names).map(([name, [title, about]]) => {
      const made = this.numberRow(title, ["folds", name], folds[name], 2, name === "age" ? 0 : 1, about);
      made.input.setAttribute("aria-label", `Folds: ${title}`);
      this.updates.push((data) => made.set(data.folds[name]));
      return made.line;
    });
    const seed = element("input", { type: "number", min: 0, max: 2147483648, step: 1, "aria-label": "Seed", id: "seed" });
    seed.addEventListener("change", () => this.app.connection.change([[["folds", "seed"], Math.max(0, Math.round(Number(seed.value)))]]));
    this.updates.push((data) => { if (document.activeElement !== seed) seed.value = data.folds.seed; });
    const other = element("button", { text: "New lines", title: "Draw the lines of another person", onclick: () => {
      this.app.connection.change([[["folds", "seed"], Math.floor(Math.random() * 1e6)]]);
    } });
    return [...rows, element("div", { class: "actions" }, element("label", { class: "inline" }, "Seed ", seed), other), ...this.regions(regions),
      element("p", { text: "Folds appear where the skin is compressed: contract a muscle first. Left and right are the subject's. Sides and regions change the waves, not the anatomical creases." })];
  }

  patterns({ patterns: { kinds, numbers } }) {
    const both = element("input", { type: "checkbox" });
    const buttons = kinds.map((kind) => element("button", { text: titled(kind), onclick: (event) => this.app.place(
      `Click the face to place the ${titled(kind).toLowerCase()}.`, event.target, (place) => {
        const usual = { dimple: [9, 1.6], eye_pouch: [26, 2], forehead: [60, 1], frown: [24, 1.5], cheek: [34, 1], eye_corner: [26, 1] }[kind] ?? [24, 1];
        const { origin, axes } = this.app.face, places = both.checked ? [place, mirrored(place, origin, axes[0])] : [place];
        this.app.add("patterns", ...places.map((center) => ({ kind, center, size: usual[0], depth: usual[1], strength: 1 })));
      }) }));
    const list = element("div");
    this.updates.push((data) => this.list(list, "patterns", data.patterns, (entry) => titled(entry.kind), numbers,
      { size: ["Size (mm)", 0], depth: ["Depth (mm)", 1], strength: ["Strength", 2] }));
    return [element("div", { class: "chips", role: "group", "aria-label": "Place a pattern" }, ...buttons),
      element("label", { class: "inline" }, both, "On both sides"),
      element("p", { text: "Choose a pattern, then click the face. Drag its dot to move it, and its ring to resize it." }), list];
  }

  tears({ tears }) {
    const list = element("div");
    this.updates.push((data) => this.list(list, "tears", data.tears, () => "Tear", tears,
      { width: ["Width (mm)", 1], length: ["Length (mm)", 0] }));
    const button = element("button", { text: "Place a tear", onclick: (event) => this.app.place(
      "Click below an eye, where the tear starts.", event.target,
      (place) => this.app.add("tears", { start: place, width: 3, length: 60, begin: 0 })) });
    return [element("div", { class: "actions" }, button), list];
  }

  /** Entries of a table of the document, with their sliders; built anew only when entries come or go. */
  list(box, table, entries, title, ranges, rows) {
    const names = Object.keys(entries);
    if (box.dataset.names !== names.join()) {
      box.dataset.names = names.join();
      box.sets = [];
      box.replaceChildren(...names.map((name, k) => {
        const heading = `${title(entries[name])} ${table === "probes" ? name.split(" ").at(-1) : k + 1}`;
        const made = Object.entries(rows).map(([key, [text, digits]]) => {
          const range = ranges[key];
          const line = row(`${text}`, { min: range[0], max: range[1], step: digits ? 10 ** -digits : 1, ...number(digits), usual: range[0], marked: false,
            change: (value, gesture) => this.app.connection.change([[[table, name], { ...this.app.data[table][name], [key]: value }]], gesture) });
          line.input.setAttribute("aria-label", `${heading}: ${text}`);
          box.sets.push((all) => line.set(all[name][key]));
          return line.line;
        });
        return element("div", { class: "item", "data-entry": name }, element("header", {}, element("span", { text: heading }), element("output"),
          element("button", { class: "small", text: "Remove", "aria-label": `Remove ${heading}`,
            onclick: () => this.app.connection.change([[[table, name], null]]) })), ...made);
      }));
    }
    for (const set of box.sets ?? []) set(entries);
  }

  fields({ fields }) {
    const select = element("select", { id: "field", "aria-label": "Color by", onchange: () => this.app.showField(select.value) },
      ...["", ...Object.keys(fields)].map((name) => element("option", { value: name, text: FIELD_NAMES[name] ?? name })));
    this.select = select;
    this.lockedRange = element("input", { type: "checkbox", onchange: () => this.lockRange() });
    this.ends = ["Minimum", "Maximum"].map((text) => element("input", { type: "number", step: "any", "aria-label": `${text} of the color range`, onchange: () => {
      this.lockedRange.checked = true;
      this.lockRange();
    } }));
    this.rangeBox = element("div", { class: "actions", hidden: true }, element("span", { text: "Range" }), this.ends[0], "to", this.ends[1],
      element("label", { class: "inline", title: "Keep this range while the face moves" }, this.lockedRange, "Lock"));
    const list = element("div", { id: "probes" });
    this.updates.push((data) => this.list(list, "probes", data.probes, () => "Probe", {}, {}));
    const button = element("button", { text: "Place a probe", onclick: (event) => this.app.place("Click the face to place a probe.", event.target,
      (place) => this.app.add("probes", place)) });
    return [element("label", { class: "inline" }, "Color by ", select), this.rangeBox,
      element("p", { text: "The legend shows the value under the pointer. Click the face to see all fields there, and what made the fold." }),
      element("h2", { text: "Probes" }), element("div", { class: "actions" }, button), list];
  }

  /** Tell the value at a probe in the list. */
  probed(name, text) {
    const output = document.querySelector(`#probes [data-entry="${CSS.escape(name)}"] output`);
    if (output && output.textContent !== String(text)) output.textContent = text;
  }

  /** The colors take the range of the inputs, or follow the values again. */
  lockRange() {
    const [low, high] = this.ends.map((end) => Number(end.value));
    if (this.lockedRange.checked && !(high > low)) { this.app.say("The maximum must be greater than the minimum."); this.lockedRange.checked = false; }
    this.app.view.locked = this.lockedRange.checked ? [low, high] : null;
    if (this.app.view.fieldInfo) this.app.legend(this.app.view.fieldInfo);
    this.app.view.request();
  }

  fieldChanged(name) {
    const { locked } = this.app.view; // null if this is another field
    this.lockedRange.checked = Boolean(locked);
    locked?.forEach((end, k) => { this.ends[k].value = end; });
    this.rangeBox.hidden = !name || ["muscle", "family", "level"].includes(name);
  }

  rangeIs(range) {
    if (this.lockedRange.checked) return;
    this.ends.forEach((end, k) => { if (document.activeElement !== end) end.value = Number(range[k].toPrecision(4)); });
  }
}
