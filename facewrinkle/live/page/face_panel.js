// The tab of the face itself: which one it is, its landmarks, and the parameters of the built-in head.

import { element, titled } from "./sliders.js";


export class FacePanel {
  constructor(panels, app) {
    this.app = app;
    this.choice = element("select", { "aria-label": "Face", onchange: () => app.connection.send("show", { name: this.choice.value }) });
    this.shown = element("input", { type: "checkbox", onchange: () => app.handlesOf("Face") });
    this.back = element("button", { text: "Reset landmarks", disabled: true, onclick: () => app.connection.change([[["landmarks"], {}]]) });
    this.about = element("p");
    this.report = element("ul", { class: "report" });
    this.person = element("div");
    this.rows = new Map();
    this.panels = panels;
    this.content = [
      element("div", { class: "actions" }, this.choice, element("button", { text: "Open …", title: "Open a mesh, an animation or a .face file, or drop it onto the page", onclick: () => app.opening.choose() })),
      this.about,
      element("h2", { text: "Landmarks" }),
      element("label", { class: "inline" }, this.shown, "Show on the face; drag to correct"),
      element("div", { class: "actions" }, this.back), this.report, this.person,
    ];
  }

  /** Take over another face. */
  take({ faces, landmarks, likeness, report, identity, clip }) {
    const { names, shown, first } = faces;
    this.choice.replaceChildren(...names.map((name) => element("option", { value: name, text: name || first.split(/[\\/]/).at(-1) })));
    this.choice.value = shown;
    const all = Object.values(landmarks), unsure = all.some(({ confidence, estimated }) => estimated || (confidence !== null && confidence < 0.5));
    this.shown.disabled = !all.length;
    this.about.textContent = [
      all.length ? "" : "This surface has no landmarks, and therefore no muscles.",
      clip ? `An animation of ${clip.toFixed(1)} s moves it: press Space to play.` : "",
      likeness === null ? "" : `Likeness to a face: ${likeness.toFixed(2)}.`,
      unsure ? "Yellow landmarks are the least certain." : "",
    ].filter(Boolean).join(" ");
    this.about.hidden = !this.about.textContent;
    this.report.replaceChildren(...report.map((text) => element("li", { text })));
    if (this.person.dataset.names === identity.join()) return;
    this.person.dataset.names = identity.join();
    this.rows.clear();
    this.person.replaceChildren();
    if (!identity.length) return;
    this.person.append(element("h2", { text: "Person" }));
    for (const name of identity) {
      const made = this.panels.numberRow(titled(name), ["identity", name], [-1, 1], 2, 0, "From -1 to 1; 0 is the average head");
      this.rows.set(name, made);
      this.person.append(made.line);
    }
  }

  update(data) {
    for (const [name, made] of this.rows) made.set(data.identity[name] ?? 0);
    this.back.disabled = !Object.keys(data.landmarks).length;
  }
}
