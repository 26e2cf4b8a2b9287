// The tab with what comes out of the studio.

import { Sheet } from "./sheet.js";
import { element } from "./sliders.js";

const FILES = {
  picture: ["Picture", "From this view, on dark ground, in the size below"], cutout: ["Cut-out (PNG)", "The picture with a transparent ground"], movie: ["Movie", "The timeline as MP4; without keys, from rest to the current expression"],
  glb: ["Mesh (GLB)", "The face as shown, with eyes, brows, lashes, teeth and tears"], animation: ["Animation (GLB)", "The timeline as a mesh with morph targets"],
  rig: ["Rig (GLB)", "ARKit's 52 blend shapes on a fine mesh"],
  maps: ["Maps (ZIP)", "A coarse rig with wrinkle maps, a page and a three.js module that play them, and the Blender extension"], face: ["Face", "The fitted face, to open again later"],
  atlas: ["Atlas (TOML)", "Muscles, action units and expressions; the current expression is called “studio”"],
  session: ["Session", "All settings, to open again later"],
};

export function saving({ folder, kinds }, app) {
  const { connection } = app;
  const code = element("pre", { tabindex: "0", hidden: true, "aria-label": "Copied text" });
  const note = element("p", { role: "status" });
  const copy = async () => {
    const text = await app.ask("copy", { camera: app.cameraNumbers() });
    if (text === null) return;
    code.textContent = text;
    code.hidden = false;
    try { await navigator.clipboard.writeText(text); note.textContent = "Copied."; } catch { note.textContent = "Select the text to copy it."; }
  };
  const sides = ["Width", "Height"].map((name) => element("input", { type: "number", min: 16, max: 8192, "aria-label": `${name} of pictures and movies, pixels`, onchange: () => {
    connection.change([[["look", "size"], sides.map(({ value }) => Math.round(Math.max(16, Math.min(8192, Number(value)))))]]);
  } }));
  app.panels.updates.push(({ look }) => sides.forEach((side, k) => { side.value = look.size[k]; }));
  const stop = document.getElementById("stop");
  stop.onclick = () => connection.send("stop");
  const save = (what, slow) => async () => {
    note.textContent = "Saving …";
    stop.hidden = !slow;
    try {
      const got = await connection.ask("save", { what, camera: app.cameraNumbers() });
      note.textContent = got.path ? `Saved as ${got.path}` : `Downloaded ${got.name}.`;
      if (got.download) element("a", { href: got.download, download: got.name }).click();
    } catch (error) { note.textContent = error.message; }
    stop.hidden = true;
  };
  return [
    ...Object.entries(kinds).map(([what, slow]) => element("div", { class: "file" },
      element("button", { text: FILES[what][0], onclick: save(what, slow) }), element("span", { text: FILES[what][1] }))),
    element("div", { class: "actions" }, element("span", { text: "Size" }), sides[0], "×", sides[1], "pixels"),
    element("div", { class: "actions" }, element("button", { text: "Copy as Python", onclick: copy })),
    note, code, ...new Sheet(app).content,
    element("p", { text: folder ? `Files are saved in ${folder}; the session is saved there automatically.` : "Files are downloaded. Start the studio with --save-to FOLDER to save them there." }),
  ];
}
