// The list of commands (Ctrl+K): every slider, button, view, field and saved mixture, found by typing.

import { element, titled } from "./sliders.js";

const MOST = 12; // shown at once

export class Palette {
  constructor(app) {
    this.app = app;
    this.input = element("input", { type: "search", role: "combobox", "aria-expanded": "true", "aria-controls": "palette-list",
      "aria-autocomplete": "list", "aria-label": "Search all controls", placeholder: "What would you like to do?", autocomplete: "off" });
    this.list = element("ul", { role: "listbox", id: "palette-list", "aria-label": "Controls" });
    this.box = element("dialog", { id: "palette", "aria-label": "All controls" }, this.input, this.list);
    document.body.append(this.box);
    this.input.addEventListener("input", () => this.show(0));
    this.input.addEventListener("keydown", (event) => {
      const by = { ArrowDown: 1, ArrowUp: -1 }[event.key];
      if (by) { event.preventDefault(); this.show((this.at + by + this.found.length) % (this.found.length || 1)); }
      if (event.key === "Escape") { event.preventDefault(); event.stopPropagation(); this.box.close(); } // else it would empty the text first
      if (event.key === "Enter") { event.preventDefault(); this.run(this.found[this.at]); }
    });
    this.box.addEventListener("click", (event) => { if (event.target === this.box) this.box.close(); });
  }

  open() {
    this.all = this.commands();
    this.input.value = "";
    this.show(0);
    this.box.showModal();
    this.input.focus();
  }

  /** All that can be done now: its name, words to find it by, where it is, and what it does. */
  commands() {
    const { app } = this, { panels, sliders, view, welcome } = app, out = [];
    const add = (text, where, act, words = "") => out.push({ text, where, act, words: `${text} ${where} ${words}`.toLowerCase() });
    const press = (id, text, key = "") => { const button = document.getElementById(id); if (!button.disabled) add(text, key, () => button.click()); };
    press("undo", "Undo", "Ctrl+Z"); press("redo", "Redo", "Ctrl+Shift+Z"); press("reset", "Reset everything", "R"); press("open", "Open a file");
    press("play", app.timeline.playing ? "Stop" : "Play", "Space"); press("wireframe", "Wireframe", "W");
    press("muscles", "Muscles: fibers and handles", "H"); press("compare", "Compare with this state", "A"); press("lock", "Both sides together", "M");
    add("Add key", "K", () => app.timeline.add(), "timeline event");
    Object.keys(app.data?.mixtures ?? {}).forEach((name) => add(name, "Your expressions", () => app.mixtures.take(name)));
    for (const each of sliders.rows) {
      const text = [...(each.line.querySelector("span")?.childNodes ?? [])].map((node) => node.textContent).join(" ") || each.name;
      add(text, each.group.ariaLabel, () => { app.clearSearch(); app.reveal(each.line); each.line.scrollIntoView({ block: "center" }); each.line.querySelector("input")?.focus(); }, each.words);
    }
    for (const [title, { panel }] of Object.entries(panels.panels)) {
      add(`Open ${title}`, "Tabs", () => { app.reveal(panel); panels.open(title); panels.panels[title].tab.focus(); });
      for (const control of panel.querySelectorAll("button, input[type=range], input[type=number], select")) {
        const text = control.ariaLabel || control.textContent.trim();
        if (text && !control.matches(":disabled") && !control.classList.contains("small")) add(text, title, () => { app.reveal(panel); panels.open(title); control.focus(); if (control.tagName === "BUTTON") control.click(); }, control.title);
      }
    }
    Object.keys(view.views ?? {}).forEach((name, k) => add(`View: ${titled(name)}`, k < 9 ? String(k + 1) : "", () => { view.take(name); document.getElementById("view").value = name; }));
    ["", ...Object.keys(welcome?.fields ?? {})].forEach((name) => add(`Color by ${name || "nothing"}`, "Fields", () => { app.showField(name); panels.open("Fields"); }));
    press("tour-button", "Tour"); press("help-button", "Help", "?");
    return out;
  }

  /** Show what fits the words, with one of it chosen. */
  show(at) {
    const words = this.input.value.toLowerCase().split(/\s+/).filter(Boolean), begins = words[0] ?? "";
    this.found = this.all.filter((each) => words.every((word) => each.words.includes(word)))
      .sort((a, b) => b.text.toLowerCase().startsWith(begins) - a.text.toLowerCase().startsWith(begins)).slice(0, MOST);
    this.at = Math.min(at, Math.max(this.found.length - 1, 0));
    this.list.replaceChildren(...this.found.map((each, k) => element("li", { role: "option", id: `palette-${k}`, "aria-selected": String(k === this.at),
      onclick: () => this.run(each) }, element("span", { text: each.text }), element("small", { text: each.where }))));
    if (!this.found.length) this.list.append(element("li", { class: "nothing", role: "option", "aria-selected": "false", text: "No matches." }));
    this.input.setAttribute("aria-activedescendant", this.found.length ? `palette-${this.at}` : "");
  }

  run(command) {
    if (!command) return;
    this.box.close();
    command.act();
  }
}
