// Expressions of one's own: what the sliders show, under a name.

import { element } from "./sliders.js";

export class Mixtures {
  constructor(box, app) {
    Object.assign(this, { box, app, names: "" });
    this.naming = element("button", { class: "small", text: "Name expression …", title: "Give the current expression a name; it joins this list", onclick: () => this.ask() });
    this.list = element("div", { class: "chips", role: "group", "aria-label": "Your expressions" });
    this.input = element("input", { type: "text", maxlength: 40, hidden: true, placeholder: "Name, then Enter", "aria-label": "Name of your expression" });
    this.input.addEventListener("keydown", (event) => {
      event.stopPropagation();
      if (event.key === "Enter") this.named(this.input.value.trim());
      if (event.key === "Escape") this.close();
    });
    this.input.addEventListener("blur", () => this.close());
    box.append(this.list);
    this.list.append(this.naming, this.input);
  }

  ask() {
    if (!Object.values(this.app.data.mixture).some((weight) => weight > 0)) return this.app.say("Move a slider first: there is no expression to name yet.");
    this.naming.hidden = true;
    this.input.hidden = false;
    this.input.value = "";
    this.input.focus();
  }

  close() { this.input.hidden = true; this.naming.hidden = false; }

  named(name) {
    if (name) this.app.ask("change", { patches: [[["mixtures", name], this.app.data.mixture]], gesture: "" });
    this.close();
    this.naming.focus();
  }

  take(name) { this.app.connection.change([[["mixture"], this.app.data.mixtures[name]]]); }

  update({ mixture, mixtures }) {
    const names = Object.keys(mixtures).join("\n");
    if (names !== this.names) {
      this.names = names;
      this.list.replaceChildren(...Object.keys(mixtures).map((name) => element("span", { class: "own" },
        element("button", { text: name, onclick: () => this.take(name) }),
        element("button", { text: "×", "aria-label": `Delete ${name}`, title: `Delete ${name}`, onclick: () => this.app.connection.change([[["mixtures", name], null]]) }))),
        this.naming, this.input);
    }
    const now = JSON.stringify(Object.entries(mixture).sort());
    for (const each of this.list.querySelectorAll(".own")) {
      const same = JSON.stringify(Object.entries(mixtures[each.firstChild.textContent]).sort()) === now;
      each.firstChild.setAttribute("aria-pressed", String(same));
    }
  }
}
