// The sliders of the left side: expressions, action units and muscles, with left and right.

import { KEY_PAUSE } from "./pointer.js";

const REGIONS = {
  "Brows and forehead": ["AU1", "AU2", "AU4"],
  Eyes: ["AU5", "AU6", "AU7", "AU43", "AU45", "AU46"],
  "Nose and cheeks": ["AU9", "AU10", "AU11"],
  "Mouth and chin": [],
};
const EVERYDAY = { // words that people search for
  AU1: "worry raise", AU2: "raise surprise", AU4: "frown angry", AU6: "smile crow's feet wink", AU9: "disgust wrinkle", AU12: "smile grin happy",
  AU15: "sad frown", AU17: "pout", AU18: "kiss", AU19: "tongue", AU25: "open", AU26: "open jaw mouth", AU27: "open yawn", AU43: "shut", AU45: "shut", happiness: "smile joy",
  laughter: "smile laugh",
};
const GAZE = new Set(["AU61", "AU62", "AU63", "AU64"]);

export const element = (tag, attributes = {}, ...children) => {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name === "text") made.textContent = value;
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
};

/** A name of the atlas as a heading. */
export const titled = (name) => name.replaceAll("_", " ").replace(/^./, (c) => c.toUpperCase());

const SVG = "http://www.w3.org/2000/svg";
export const drawn = (tag, attributes) => {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
};

const EMOTIONS = ["happiness", "sadness", "anger", "disgust", "surprise", "fear", "contempt"];
const OF_THE_PAPER = ["paper_surprise", "frowning", "closing_eye", "stretching_mouth", "paper_fear"];
const TITLES = { paper_surprise: "Surprise (brows)", paper_fear: "Fear (brows)", frowning: "Frown", closing_eye: "Close left eye",
  stretching_mouth: "Stretch mouth, right", wink: "Wink and smile" };
const RESET = "Double-click, or press Delete, to reset";
let gestures = 0;

/** A slider with its number: `change(value, gesture)` is called while it moves; a double click on the number types one. */
export function slider(label, { min = 0, max = 1, step = 0.01, shown = (v) => Math.round(100 * v), parse = (v) => v / 100, usual = 0, change }) {
  const input = element("input", { type: "range", min, max, step, "aria-label": label });
  const output = element("output", { title: "Double-click to type a value" });
  input.title = RESET;
  let gesture = "";
  const paint = () => {
    if (usual > min) input.style.setProperty("--usual", (usual - min) / (max - min)); // there it has a tick
    else input.style.removeProperty("--usual");
    const share = (value) => (100 * (value - min)) / (max - min), zero = share(Math.max(min, 0)), at = share(input.value);
    input.style.setProperty("--from", `${Math.min(zero, at)}%`); // from 0, which may be in the middle
    input.style.setProperty("--fill", `${Math.max(zero, at)}%`);
    output.textContent = shown(Number(input.value));
    input.setAttribute("aria-valuetext", String(shown(Number(input.value))));
  };
  let last = -Infinity;
  const begin = () => { gesture = `drag ${++gestures} ${label}`; };
  const send = (value) => { input.value = value; paint(); change(Number(input.value), gesture); };
  const act = ({ timeStamp }) => {
    if (timeStamp - last > KEY_PAUSE) begin();
    last = timeStamp;
  };
  input.addEventListener("pointerdown", act);
  input.addEventListener("keydown", (event) => {
    act(event);
    if (event.key === "Delete" || event.key === "Backspace") { event.preventDefault(); send(usual); }
  });
  input.addEventListener("input", () => send(input.value));
  input.addEventListener("dblclick", () => send(usual));
  output.addEventListener("dblclick", () => {
    const typed = element("input", { type: "text", class: "typed", "aria-label": `${label}, number`, value: shown(Number(input.value)) });
    let over = false;
    const done = (take) => {
      if (over) return; // taking it away blurs it
      over = true;
      const value = parse(Number(typed.value.replace(",", ".")));
      typed.replaceWith(output);
      if (take && Number.isFinite(value)) { begin(); send(Math.max(min, Math.min(max, value))); }
      input.focus();
    };
    typed.addEventListener("keydown", (event) => {
      event.stopPropagation();
      if (event.key === "Enter") done(true);
      if (event.key === "Escape") done(false);
    });
    typed.addEventListener("blur", () => done(true));
    output.replaceWith(typed);
    typed.select();
  });
  paint();
  return {
    input, output,
    set(value) { if (Number(input.value) !== value) { input.value = value; paint(); } },
    begin(least) { input.min = min = least; paint(); },
  };
}

/** A labeled row with one slider. */
export function row(label, options) {
  const made = slider(label, options);
  const line = element("div", { class: "row" }, element("span", { text: label, title: options.about ?? label }), made.input, made.output);
  const mark = () => line.classList.toggle("active", options.marked !== false && Number(made.input.value) !== (options.usual ?? 0));
  made.input.addEventListener("input", mark);
  return { ...made, line, set(value) { made.set(value); mark(); } };
}

const LOOKS = [["Look sideways", "Degrees to the subject's left"], ["Look up", "Degrees up"]];

export class Sliders {
  constructor(box, connection) {
    Object.assign(this, { box, connection, rows: [], mixture: {}, looks: [0, 0], locked: true });
    this.active = element("div", { class: "active-rows", role: "group", "aria-label": "Active", hidden: true }, element("h2", { text: "Active" }));
    box.after(this.active);
  }

  build({ atlas: { expressions, units, muscles }, off }) {
    this.off = off;
    this.rows = [];
    this.box.replaceChildren();
    this.active.replaceChildren(this.active.firstChild);
    const plain = (names) => names.filter((name) => expressions.includes(name)).map((name) => [name, TITLES[name] ?? titled(name), "", null]);
    this.section("Emotions", plain(EMOTIONS));
    this.section("More expressions", plain(expressions.filter((name) => !EMOTIONS.includes(name) && !OF_THE_PAPER.includes(name))));
    this.section("Single movements", plain(OF_THE_PAPER));
    const rest = new Set(Object.keys(units).filter((name) => !GAZE.has(name)));
    const regions = structuredClone(REGIONS);
    for (const names of Object.values(regions)) names.forEach((name) => rest.delete(name));
    regions["Mouth and chin"] = [...rest];
    for (const [title, names] of Object.entries(regions)) {
      const known = names.filter((name) => units[name]);
      this.section(title, known.map((name) => [name, units[name].about, name, units[name].sides ? [`${name}L`, `${name}R`] : null]));
    }
    this.section("Muscles", Object.entries(muscles).filter(([, { about }]) => about !== "eye" && about !== "crease").map(
      ([name, { sides }]) => [name, titled(name), "", sides ? [`${name}_l`, `${name}_r`] : null]));
  }

  section(title, entries) {
    if (!entries.length) return;
    const group = element("div", { role: "group", "aria-label": title }, element("h2", { text: title }));
    const add = (name, words, sides, make) => {
      const made = make();
      made.off(this.off[name]);
      group.append(made.line);
      this.rows.push({ ...made, name, group, sides, words: words.toLowerCase(), make });
    };
    for (const [name, label, code, sides] of entries) {
      add(name, `${name} ${label} ${code} ${title} ${EVERYDAY[name] ?? ""}`, sides, () => this.pair(name, label, code, sides));
    }
    if (title === "Eyes") LOOKS.forEach(([label], k) => add("gaze", `${label} gaze eyes aside down`, null, () => this.look(k)));
    this.box.append(group);
  }

  /** A row of the gaze. */
  look(k) {
    const [label, about] = LOOKS[k];
    const made = row(label, { min: -40, max: 40, step: 0.5, shown: (v) => Math.round(v), parse: (v) => v, about: `${about}; or drag an eye`,
      change: (value, gesture) => this.connection.change([[["gaze"], this.looks.with(k, value)]], gesture) });
    const off = (reason) => {
      made.line.classList.toggle("off", Boolean(reason));
      made.line.firstChild.title = reason ?? about;
      Object.assign(made.input, { disabled: Boolean(reason), title: reason ?? RESET });
    };
    return { line: made.line, inputs: [made.input], set: () => made.set(this.looks[k]), show() {}, off };
  }

  /** The weight of a side; one that was given for both sides at once is that of each. */
  weight(side, both) { return Math.max(this.mixture[side] ?? 0, this.mixture[both] ?? 0); }

  /** Set the weights of those sides that are moved; one that was given for both at once goes to the others. */
  change(both, sides, moved, value, gesture) {
    const set = this.mixture[both] === undefined ? moved : [...new Set([both, ...sides])];
    const weights = set.map((name) => (moved.includes(name) ? value : sides.includes(name) && this.weight(name, both)));
    this.connection.change(set.map((name, k) => [["mixture", name], weights[k] || null]), gesture);
  }

  /** A row for a name, or for the names of both sides: one slider while they are locked. */
  pair(name, label, code, sides) {
    const names = sides ?? [name], weights = () => names.map((each) => this.weight(each, name));
    const change = (moved) => (value, gesture) => this.change(name, names, moved, value, gesture);
    const both = slider(label, { change: change(names) });
    const single = (sides ?? []).map((side, k) => slider(`${label}, ${k ? "right" : "left"}`, { change: change([side]) }));
    const inputs = [both, ...single].map((each) => each.input);
    const span = element("span");
    if (code) span.append(element("small", { text: code }));
    span.append(label);
    const apart = element("div", { class: "pair" }, ...single.map((each, k) =>
      element("div", { class: "side" }, element("span", { "aria-hidden": "true", text: k ? "R" : "L" }), each.input)));
    const numbers = element("div", { class: "pair" }, ...single.map((each) => each.output));
    const line = element("div", { class: "row" }, span, both.input, both.output);
    const off = (reason) => {
      line.classList.toggle("off", Boolean(reason));
      span.title = reason ?? `${code} ${label}`.trim();
      for (const input of inputs) Object.assign(input, { disabled: Boolean(reason), title: reason ?? RESET });
    };
    let openNow = null;
    const show = (locked) => {
      const values = weights(), open = Boolean(sides) && (!locked || values[0] !== values[1]);
      if (open === openNow) return; // else the slider that is being moved would lose the focus
      openNow = open;
      line.replaceChildren(span, ...(open ? [apart, numbers] : [both.input, both.output]));
    };
    const set = () => {
      const values = weights(), most = Math.max(...values);
      both.set(most);
      single.forEach((each, k) => each.set(values[k]));
      line.classList.toggle("active", most > 0);
    };
    return { line, inputs, set, show, off };
  }

  /** Switch off what does nothing on this face, and say why. */
  setOff(off) {
    this.off = off;
    for (const each of this.rows) for (const made of [each, each.copy]) made?.off(this.off[each.name]);
  }

  lock(on) {
    this.locked = on;
    this.draw();
  }

  update({ mixture, gaze }) {
    this.mixture = mixture;
    this.looks = gaze;
    this.draw();
  }

  /** Show what is set; rows whose sides differ show both, locked or not. What is not 0 is counted, and has another row below all. */
  draw() {
    const counts = new Map(this.rows.map(({ group }) => [group, 0]));
    for (const each of this.rows) {
      each.set();
      each.show(this.locked);
      const active = each.line.classList.contains("active");
      counts.set(each.group, counts.get(each.group) + active);
      if (active && !each.copy) {
        each.copy = each.make();
        each.copy.off(this.off[each.name]);
        for (const input of each.copy.inputs) input.ariaLabel += ", active";
        this.active.append(each.copy.line);
      } else if (!active && each.copy && !each.copy.line.contains(document.activeElement)) { // it may be set again at once
        each.copy.line.remove();
        each.copy = null;
      }
      each.copy?.set();
      each.copy?.show(this.locked);
    }
    for (const [group, count] of counts) group.firstChild.dataset.count = count || "";
    this.active.hidden = this.active.childElementCount < 2;
  }

  /** The mixture, with both sides of a unit or a muscle under one name where they are equal. */
  joined() {
    const found = { ...this.mixture };
    for (const { name, sides } of this.rows) {
      const [left, right] = (sides ?? []).map((side) => found[side]);
      if (!left || left !== right) continue;
      found[name] = Math.max(found[name] ?? 0, left);
      for (const side of sides) delete found[side];
    }
    return found;
  }

  search(text) {
    const words = text.toLowerCase().split(/\s+/).filter(Boolean), full = new Set();
    for (const each of this.rows) {
      each.line.hidden = !words.every((word) => each.words.includes(word));
      if (!each.line.hidden) full.add(each.group);
    }
    for (const each of this.rows) each.group.hidden = !full.has(each.group);
    this.nothing ??= element("p", { class: "nothing", text: "No matching sliders." });
    this.nothing.hidden = full.size > 0;
    this.box.append(this.nothing);
  }
}
