// The timeline: action units that come and go.

import { draggable } from "./pointer.js";
import { drawn, element } from "./sliders.js";

const TIMES = ["onset", "apex", "offset", "end"];

export class Timeline {
  constructor(box, app) {
    Object.assign(this, { box, app, playing: false, time: 0 });
    this.play = element("button", { text: "Play", id: "play", title: "Play or stop (Space)", "aria-pressed": "false", onclick: () => this.toggle() });
    this.scrub = element("input", { type: "range", min: 0, max: 4, step: 0.02, value: 0, "aria-label": "Time" });
    this.scrub.addEventListener("input", () => { this.toggle(false); app.connection.send("pose", { time: Number(this.scrub.value) }); });
    this.text = element("span", { class: "time", text: "0.00" });
    this.long = element("input", { type: "number", min: 0.2, max: 600, step: 0.1, value: 4, "aria-label": "Length of the timeline, seconds", onchange: () => {
      const asked = Number(this.long.value), last = Math.max(0, ...Object.values(this.keys).map(({ end }) => end));
      const length = Math.max(0.2, last, Math.min(600, asked > 0 ? asked : this.length));
      if (asked > 0 && asked < last) app.say(`The last key of the timeline ends at ${last.toFixed(2)} s.`);
      this.long.value = length;
      app.connection.change([[["timeline", "length"], length]]);
    } });
    Object.assign(this, { names: "", shown: [], keys: {} });
    this.loop = element("input", { type: "checkbox", checked: true, onchange: () => app.connection.change([[["timeline", "loop"], this.loop.checked]]) });
    this.key = element("button", { text: "Add key", title: "Add the current expression here as a key (K)", onclick: () => this.add() });
    this.tracks = element("div", { class: "tracks", hidden: true });
    box.append(element("div", { class: "transport" }, this.play, this.scrub, this.text, element("label", { class: "inline" }, "of", this.long, "s"),
      element("label", { class: "inline" }, this.loop, "Loop"), this.key), this.tracks);
  }

  toggle(on = !this.playing) {
    if (on === this.playing) return;
    this.playing = on;
    this.play.textContent = on ? "Stop" : "Play";
    this.play.setAttribute("aria-pressed", on);
    this.app.connection.send("play", { on });
  }

  /** What the sliders show becomes keys, at their height at the present time: the face stays as it is. */
  add() {
    const { intensity } = this.app.data, shown = Object.entries(this.app.sliders.joined()), { time, length } = this;
    if (!shown.length) return this.app.say("Move a slider first: a key holds the current expression.");
    const times = { onset: Math.max(0, time - 0.6), apex: time, offset: Math.min(time + 0.7, length), end: Math.min(time + 1.4, length) };
    const keys = shown.map(([unit, weight]) => [["timeline", "keys", `${unit} ${Date.now().toString(36)}`], { unit, weight: weight * intensity, ...times }]);
    this.app.connection.change([...keys, [["mixture"], {}]]);
  }

  update({ timeline: { length, loop, keys } }) {
    this.length = length;
    this.keys = keys;
    this.scrub.max = length;
    this.loop.checked = loop;
    if (document.activeElement !== this.long) this.long.value = length;
    const names = Object.keys(keys).join("\n");
    if (names !== this.names) { // a track that was made anew would lose the pointer, and the focus
      this.names = names;
      this.shown = Object.keys(keys).map((name) => this.track(name));
      this.tracks.replaceChildren(...this.shown.map(({ line }) => line));
      this.tracks.hidden = !names;
    }
    for (const { draw } of this.shown) draw();
    this.show(this.time);
  }

  /** The line of a key: its shape, which is moved as a whole, and a handle for each of its times. */
  track(name) {
    const svg = drawn("svg", { preserveAspectRatio: "none", role: "slider", tabindex: 0 }), path = drawn("path", {}), key = () => this.keys[name];
    svg.append(path);
    const change = (moved, gesture) => {
      this.keys = { ...this.keys, [name]: moved }; // the next key press may come before the answer
      this.app.connection.change([[["timeline", "keys", name], moved]], gesture);
    };
    const shifted = (from, by) => {
      const go = Math.max(-from.onset, Math.min(this.length - from.end, by));
      return { ...from, ...Object.fromEntries(TIMES.map((time) => [time, from[time] + go])) };
    };
    const moved = (from, which, to) => {
      const k = TIMES.indexOf(which), low = k ? from[TIMES[k - 1]] : 0, high = k < 3 ? from[TIMES[k + 1]] : this.length;
      return { ...from, [which]: Math.max(low, Math.min(high, to)) };
    };
    /** Drag with the pointer, or go with the arrow keys: `act(key, seconds, weight)` returns the key as it shall be. */
    const moves = (target, act) => draggable(target, `key ${name}`, {
      taken: (event) => ({ x: event.clientX, from: key() }),
      drag: (event, { x, from }, gesture) => change(act(from, ((event.clientX - x) / svg.getBoundingClientRect().width) * this.length, 0), gesture),
      keys: { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.05], ArrowDown: [0, -0.05] },
      press: (event, by, gesture) => change(act(key(), ...by), gesture),
    });
    moves(svg, (from, by, more) => shifted({ ...from, weight: Math.round(100 * Math.max(0.05, Math.min(1, from.weight + more))) / 100 }, by));
    const corners = TIMES.map((which) => {
      const corner = element("span", { class: "corner", role: "slider", tabindex: 0, title: which });
      moves(corner, (from, by) => moved(from, which, from[which] + by));
      return corner;
    });
    const about = this.app.welcome?.atlas.units[key().unit.replace(/[LR]$/, "")]?.about ?? "";
    const unit = element("span", { text: `${key().unit.replaceAll("_", " ")} ${about}`, title: about });
    const draw = () => {
      const { unit: of, weight, ...times } = key(), top = 1 - 0.9 * weight, tell = (target, text, now) => {
        for (const [what, value] of Object.entries({ label: text, valuemin: 0, valuemax: this.length, valuenow: now.toFixed(2) })) target.setAttribute(`aria-${what}`, value);
      };
      svg.setAttribute("viewBox", `0 0 ${this.length} 1`);
      path.setAttribute("d", `M${times.onset},1 L${times.apex},${top} L${times.offset},${top} L${times.end},1 Z`);
      tell(svg, `${of}: start; up and down change the weight, now ${Math.round(100 * weight)}`, times.onset);
      corners.forEach((corner, k) => {
        const inner = k === 1 || k === 2;
        Object.assign(corner.style, { left: `${(100 * times[TIMES[k]]) / this.length}%`, top: `${100 * (inner ? top : 1)}%` });
        tell(corner, `${of}: ${TIMES[k]}`, times[TIMES[k]]);
      });
    };
    const line = element("div", { class: "track" }, unit, element("div", { class: "area" }, svg, ...corners),
      element("button", { class: "small", text: "×", "aria-label": `Remove the key of ${key().unit}`, onclick: () => this.app.connection.change([[["timeline", "keys", name], null]]) }));
    return { line, draw };
  }

  show(time) {
    this.time = time;
    if (document.activeElement !== this.scrub || this.playing) this.scrub.value = time;
    this.scrub.style.setProperty("--fill", `${(100 * time) / this.length}%`);
    this.tracks.style.setProperty("--now", `${(100 * time) / this.length}%`);
    this.text.textContent = time.toFixed(2);
  }
}
