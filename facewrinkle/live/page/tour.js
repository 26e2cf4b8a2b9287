// A tour of the studio: what is where, step by step, each outlined on the page.

import { element } from "./sliders.js";

const STEPS = [
  ["Smile", "Drag a slider: expressions come first, then action units and muscles. Or search for one, such as “smile”.", "#left .bar", "#left"],
  ["One side only", "Turn “Both sides” off (M), and each row gets a slider for left and right: the subject's left and right.", ".check"],
  ["Look around", "Drag to rotate, Shift-drag to pan, scroll to zoom. Drag an eye to change where the face looks.", "#stage"],
  ["Pull a muscle", "Turn “Muscles” on (H): fibers are red where they contract; point at one to see its name and sliders. Each dot is where a muscle moves the skin: drag it along its line.", "#stage", "label:has(#muscles)"],
  ["What made this fold?", "Click a fold to see its muscle or wave family, and the formula with its numbers. “Fields” colors the skin.", "#stage"],
  ["Shape the folds", "Set their depth, overall or for each side, their number, and the personal lines.", "#tab-folds", "#panel-folds"],
  ["Place patterns and tears", "Choose one and click the face. Drag its dot to move it, and its ring to resize it.", "#tab-patterns"],
  ["Your own face", "Drop a mesh or an animation onto the page, or open it. Drag landmarks to correct them; the muscles follow.", "#tab-face", "#open"],
  ["Animate it", "“Add key” turns the current expression into an event that comes and goes. Press Space to play.", "#timeline"],
  ["Save it", "Save pictures, movies, meshes, rigs and the session, or copy a Python program that makes what you see. “Name expression …” on the left lists an expression of your own. Ctrl+Z undoes anything.", "#tab-save"],
];

export class Tour {
  constructor(app) {
    this.app = app;
    this.box = element("div", { id: "tour", role: "dialog", "aria-labelledby": "tour-title", hidden: true });
    document.body.append(this.box);
    this.box.addEventListener("keydown", (event) => { if (event.key === "Escape") { event.stopPropagation(); this.end(); } });
  }

  start() { this.before = document.activeElement; this.go(0); }

  go(number) {
    const [title, text, ...where] = STEPS[number];
    this.clear();
    const tab = /^#tab-(\w+)/.exec(where[0]);
    if (tab) this.app.panels.open(tab[1].replace(/^./, (c) => c.toUpperCase()));
    for (const each of where.map((place) => document.querySelector(place))) {
      this.app.reveal(each);
      each.classList.add("outlined");
    }
    const next = number + 1 < STEPS.length;
    this.box.replaceChildren(
      element("small", { text: `${number + 1} of ${STEPS.length}` }), element("h2", { id: "tour-title", text: title }), element("p", { text }),
      element("div", { class: "actions" },
        element("button", { text: "End", onclick: () => this.end() }),
        element("button", { text: "Back", disabled: !number, onclick: () => this.go(number - 1) }),
        element("button", { class: "main", text: next ? "Next" : "Done", onclick: () => (next ? this.go(number + 1) : this.end()) })));
    this.box.hidden = false;
    this.box.querySelector(".main").focus();
  }

  clear() { for (const each of document.querySelectorAll(".outlined")) each.classList.remove("outlined"); }

  end() {
    this.clear();
    this.box.hidden = true;
    this.before?.focus?.();
  }
}
