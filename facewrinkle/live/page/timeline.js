// The timeline: action units that come and go.

import { element } from "./sliders.js";

export class Timeline {
  constructor(box, app) {
    Object.assign(this, { box, app, playing: false, time: 0 });
    this.play = element("button", { text: "Play", id: "play", title: "Play or stop (Space)", "aria-pressed": "false", onclick: () => this.toggle() });
    this.scrub = element("input", { type: "range", min: 0, max: 4, step: 0.02, value: 0, "aria-label": "Time" });
    this.scrub.addEventListener("input", () => { this.toggle(false); app.connection.send("pose", { time: Number(this.scrub.value) }); });
    this.text = element("span", { class: "time", text: "0.00 / 4.00 s" });
    this.loop = element("input", { type: "checkbox", checked: true, onchange: () => app.connection.change([[["timeline", "loop"], this.loop.checked]]) });
    this.key = element("button", { text: "Add key", title: "Let what the sliders show come and go here (K)", onclick: () => this.add() });
    this.tracks = element("div", { class: "tracks", hidden: true });
    box.append(element("div", { class: "transport" }, this.play, this.scrub, this.text,
      element("label", { class: "inline" }, this.loop, "Loop"), this.key), this.tracks);
  }

  toggle(on = !this.playing) {
    if (on === this.playing) return;
    this.playing = on;
    this.play.textContent = on ? "Stop" : "Play";
    this.play.setAttribute("aria-pressed", on);
    this.app.connection.send("play", { on });
  }

  /** The mixture of the sliders becomes keys around the present time. */
  add() {
    const mixture = Object.entries(this.app.data.mixture).filter(([, weight]) => weight > 0);
    if (!mixture.length) return this.app.say("Set a slider first: a key lets what they show come and go.");
    const { length } = this.app.data.timeline, at = Math.min(this.time, length - 0.2);
    const patches = [];
    for (const [unit, weight] of mixture) {
      const name = `${unit} ${Date.now().toString(36)}`;
      const end = Math.min(at + 2, length), span = end - at;
      patches.push([["timeline", "keys", name], { unit, weight, onset: at, apex: at + 0.3 * span, offset: at + 0.65 * span, end }]);
      patches.push([["mixture", unit], null]);
    }
    this.app.connection.change(patches);
  }

  update({ timeline: { length, loop, keys } }) {
    this.length = length;
    this.scrub.max = length;
    this.loop.checked = loop;
    this.tracks.hidden = !Object.keys(keys).length;
    this.tracks.replaceChildren(...Object.entries(keys).map(([name, key]) => this.track(name, key, length)));
    this.show(this.time);
  }

  track(name, key, length) {
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    svg.setAttribute("viewBox", `0 0 ${length} 1`);
    svg.setAttribute("preserveAspectRatio", "none");
    const path = document.createElementNS(svg.namespaceURI, "path"), top = 1 - 0.9 * key.weight;
    path.setAttribute("d", `M${key.onset},1 L${key.apex},${top} L${key.offset},${top} L${key.end},1 Z`);
    svg.append(path);
    svg.setAttribute("role", "slider");
    svg.setAttribute("tabindex", "0");
    svg.setAttribute("aria-label", `${key.unit}: begins`);
    svg.setAttribute("aria-valuemin", 0);
    svg.setAttribute("aria-valuemax", length);
    svg.setAttribute("aria-valuenow", key.onset.toFixed(2));
    const times = ["onset", "apex", "offset", "end"];
    const change = (moved, gesture) => this.app.connection.change([[["timeline", "keys", name], moved]], gesture);
    const shifted = (from, by) => {
      const go = Math.max(-from.onset, Math.min(length - from.end, by));
      return { ...from, ...Object.fromEntries(times.map((t) => [t, from[t] + go])) };
    };
    svg.addEventListener("pointerdown", (event) => { // the nearest corner, or the whole in the middle
      const box = svg.getBoundingClientRect(), at = (e) => ((e.clientX - box.left) / box.width) * length, start = at(event);
      const near = times.find((t) => Math.abs(key[t] - start) < 0.02 * length), gesture = `key ${name} ${event.timeStamp}`;
      const move = (e) => {
        if (!near) return change(shifted(key, at(e) - start), gesture);
        const k = times.indexOf(near), low = k ? key[times[k - 1]] : 0, high = k < 3 ? key[times[k + 1]] : length;
        change({ ...key, [near]: Math.max(low, Math.min(high, at(e))) }, gesture);
      };
      const end = () => { removeEventListener("pointermove", move); removeEventListener("pointerup", end); };
      addEventListener("pointermove", move);
      addEventListener("pointerup", end);
    });
    svg.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: -0.1, ArrowRight: 0.1 }[event.key];
      if (by) { event.preventDefault(); change(shifted(key, by)); }
    });
    return element("div", { class: "track" }, element("span", { text: key.unit }), svg,
      element("button", { class: "small", text: "×", "aria-label": `Remove the key of ${key.unit}`, onclick: () =>
        this.app.connection.change([[["timeline", "keys", name], null]]) }));
  }

  show(time) {
    this.time = time;
    if (document.activeElement !== this.scrub || this.playing) this.scrub.value = time;
    this.scrub.style.setProperty("--fill", `${(100 * time) / this.length}%`);
    this.text.textContent = `${time.toFixed(2)} / ${this.length.toFixed(2)} s`;
  }
}
