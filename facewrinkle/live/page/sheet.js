// A comparison sheet: captures of the view, each with its words below, side by side in one picture.

import { element, titled } from "./sliders.js";

const [GAP, WORDS, MOST] = [16, 28, 4]; // pixels between captures and for the words below, and captures in a row

export class Sheet {
  constructor(app) {
    this.app = app;
    this.captures = [];
    this.list = element("div", { class: "captures" });
    this.save = element("button", { text: "Sheet (PNG)", disabled: true, onclick: () => this.download() });
    this.content = [element("h2", { text: "Comparison sheet" }),
      element("div", { class: "actions" }, element("button", { text: "Capture", title: "Keep a picture of this view for the sheet", onclick: () => this.capture() }), this.save),
      element("p", { text: "Captures show the view, and stay until the page is closed; the sheet shows them side by side." }), this.list];
  }

  capture() {
    const picture = this.app.view.copy(), number = this.captures.length + 1;
    picture.ariaHidden = "true"; // its words tell what it shows
    const shown = Object.entries(this.app.sliders.joined()).map(([name, weight]) => `${titled(name)} ${Math.round(100 * weight)}`);
    const words = element("input", { type: "text", maxlength: 60, value: shown.join(", ") || "At rest", "aria-label": `Words below capture ${number}` });
    const line = element("div", { class: "capture" }, picture, words,
      element("button", { class: "small", text: "×", "aria-label": `Remove capture ${number}`, onclick: () => this.show(this.captures.filter((each) => each.line !== line)) }));
    this.show([...this.captures, { picture, words, line }]);
  }

  show(captures) {
    this.captures = captures;
    this.list.replaceChildren(...captures.map(({ line }) => line));
    this.save.disabled = !captures.length;
  }

  /** The captures in rows, as a canvas. */
  drawn() {
    const { captures } = this, columns = Math.min(captures.length, MOST), rows = Math.ceil(captures.length / columns);
    const wide = Math.max(...captures.map(({ picture }) => picture.width)), high = Math.max(...captures.map(({ picture }) => picture.height));
    const sheet = element("canvas", { width: columns * (wide + GAP) + GAP, height: rows * (high + WORDS + GAP) + GAP }), pen = sheet.getContext("2d");
    pen.fillStyle = "#fff";
    pen.fillRect(0, 0, sheet.width, sheet.height);
    Object.assign(pen, { fillStyle: "#22262b", font: "16px system-ui, sans-serif", textBaseline: "middle" });
    captures.forEach(({ picture, words }, k) => {
      const x = GAP + (k % columns) * (wide + GAP), y = GAP + Math.floor(k / columns) * (high + WORDS + GAP);
      pen.drawImage(picture, x, y);
      pen.fillText(words.value, x, y + high + WORDS / 2, wide);
    });
    return sheet;
  }

  download() {
    this.drawn().toBlob((blob) => {
      const href = URL.createObjectURL(blob);
      element("a", { href, download: "sheet.png" }).click();
      setTimeout(() => URL.revokeObjectURL(href), 1000);
    });
  }
}
