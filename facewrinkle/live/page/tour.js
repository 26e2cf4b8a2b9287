// A tour of the studio: what is where, step by step, each outlined on the page.

import { element } from "./sliders.js";

const STEPS = [
  ["Smile", "Pull a slider: expressions first, then action units and muscles. Type what you look for, such as “smile”.", "#left .bar", "#left"],
  ["One side only", "Take “Both sides” away (M), and each row has a slider for left and right. They are the subject's own.", ".check"],
  ["Look around", "Drag to turn, Shift and drag to move, wheel to zoom. Drag an eye, and the face looks where you lead it.", "#stage"],
  ["Pull a muscle", "Switch “Muscles” on (H): each dot is where a muscle moves the skin. Pull it along the line that it shows.", "#stage", "label:has(#muscles)"],
  ["What made this fold?", "Click on a fold: its muscle or family of waves, the formula and its numbers are told. “Fields” colours the skin.", "#stage"],
  ["Shape the folds", "Their depth, on each side too, their number, and the lines of this person.", "#tab-folds", "#panel-folds"],
  ["Place patterns and tears", "Choose one and click on the face; drag its dot to move it, and its ring to size it.", "#tab-patterns"],
  ["Your own face", "Drop a mesh or a recorded clip onto the page. Its landmarks can be dragged; muscles follow.", "#tab-face"],
  ["Let it move", "“Add key” turns what the sliders show into an event that comes and goes. Space plays.", "#timeline"],
  ["Keep it", "Pictures, movies, meshes, rigs and the session; “Keep …” on the left holds an expression under a name; or the Python that makes what you see. Ctrl+Z takes anything back.", "#tab-save"],
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
