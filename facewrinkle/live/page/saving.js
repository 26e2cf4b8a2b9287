// The tab with what comes out of the studio.

import { element } from "./sliders.js";

const FILES = {
  picture: ["Picture", "1200 × 1200 pixels, from this view"], movie: ["Movie", "The timeline as MP4; without keys, from rest to what the sliders show"],
  glb: ["Mesh (GLB)", "The face as it is now, with eyes, teeth and tears"], animation: ["Animation (GLB)", "The timeline as a mesh with morph targets"],
  rig: ["Rig (GLB)", "ARKit's 52 blend shapes of this face; takes a minute"], face: ["Face", "The fitted face, to be opened again"],
  atlas: ["Atlas (TOML)", "Muscles, action units and expressions, with what the sliders show as “studio”"],
  session: ["Session", "All that is set, to be opened again"],
};

export function saving({ folder, kinds }, app) {
  const { connection } = app;
  const code = element("pre", { tabindex: "0", hidden: true, "aria-label": "Copied text" });
  const note = element("p", { role: "status" });
  const copy = async () => {
    const text = await connection.ask("copy", { camera: app.cameraNumbers() });
    code.textContent = text;
    code.hidden = false;
    try { await navigator.clipboard.writeText(text); note.textContent = "Copied."; } catch { note.textContent = "Select it to copy."; }
  };
  const save = (what) => async () => {
    note.textContent = "Saving …";
    try {
      const got = await connection.ask("save", { what, camera: app.cameraNumbers() });
      note.textContent = got.path ? `Saved as ${got.path}` : `Downloaded ${got.name}.`;
      if (got.download) element("a", { href: got.download, download: got.name }).click();
    } catch (error) { note.textContent = error.message; }
  };
  return [
    ...kinds.map((what) => element("div", { class: "file" },
      element("button", { text: FILES[what]?.[0] ?? what, onclick: save(what) }), element("span", { text: FILES[what]?.[1] ?? "" }))),
    element("div", { class: "actions" },
      element("button", { text: "Copy as Python", onclick: copy }),
      element("button", { text: "Open session …", onclick: () => app.opening.choose() })),
    note, code,
    element("p", { text: folder ? `Files go into ${folder}; the session is saved there by itself.` : "Files are downloaded. Start with --save-to FOLDER to have them written." }),
  ];
}
