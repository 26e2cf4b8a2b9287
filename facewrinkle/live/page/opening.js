// Files that are dropped onto the page, or chosen, are sent to the studio: faces, clips, takes and sessions.

import { element } from "./sliders.js";

const sentence = (text) => text.replace(/^./, (c) => c.toUpperCase()).replace(/[^.]$/, "$&.");

export class Opening {
  constructor(app) {
    this.app = app;
    this.file = element("input", { type: "file", multiple: true, hidden: true, "aria-label": "Files of a face" });
    this.file.addEventListener("change", () => { this.take([...this.file.files]); this.file.value = ""; });
    document.body.append(this.file);
    this.veil = element("div", { id: "veil", hidden: true, text: "Drop a mesh, an animation, a take or a session" });
    document.getElementById("stage").append(this.veil);
    let depth = 0;
    const shown = (on) => { this.veil.hidden = !on; };
    addEventListener("dragenter", (event) => { event.preventDefault(); depth += 1; shown(true); });
    addEventListener("dragleave", () => { depth = Math.max(depth - 1, 0); shown(depth > 0); });
    addEventListener("dragover", (event) => event.preventDefault());
    addEventListener("drop", (event) => {
      event.preventDefault();
      depth = 0;
      shown(false);
      this.take([...event.dataTransfer.files]);
    });
  }

  choose() { this.file.click(); }

  async take(files) {
    if (!files.length) return;
    const form = new FormData();
    for (const file of files) form.append("file", file, file.name);
    this.progress({ text: "Sending", share: 0 });
    try {
      const answer = await fetch("/open", { method: "POST", body: form, headers: { "X-Key": this.app.connection.key } });
      const content = /json/.test(answer.headers.get("Content-Type")) ? await answer.json() : { error: await answer.text() };
      if (content.error || !answer.ok) this.app.say(content.error ?? "The files were rejected.");
      else if (content.said?.length) this.app.say(content.said.map(sentence).join(" "), { note: true });
      if (content.plays) this.app.timeline.toggle(true);
    } catch {
      this.app.say("The upload failed.");
    }
    this.progress({ text: "" });
  }

  /** Show what is being done; an empty text ends it. */
  progress({ text, share }) {
    const box = document.getElementById("progress");
    box.hidden = !text;
    box.querySelector("span").textContent = `${text} …`;
    if (text) box.querySelector("progress").value = share;
  }
}
