// The view and the sliders in a cell of a notebook: what a page does over its socket goes over the kernel's channel.

import { pointers } from "./pointer.js";
import { Sliders, element } from "./sliders.js";
import { decode, photoOf } from "./socket.js";
import { View } from "./view.js";

class Channel {
  constructor(model) { Object.assign(this, { model, changed: 0 }); }
  send(command, values = {}) { this.model.send({ text: JSON.stringify({ do: command, ...values }) }); }
  change(patches, gesture = "") { this.send("change", { patches, gesture, id: ++this.changed }); }
}

function render({ model, el }) {
  const connection = new Channel(model);
  const canvas = element("canvas", { tabindex: "0", role: "img", "aria-label": "The face. Drag to rotate, Shift-drag to pan, scroll to zoom; drag an eye to move both." });
  const box = element("div", { class: "sliders" });
  const search = element("input", { type: "search", placeholder: "Search", "aria-label": "Search sliders", oninput: () => sliders.search(search.value) });
  const lock = element("input", { type: "checkbox", checked: true, onchange: () => sliders.lock(lock.checked) });
  const button = (text, command) => element("button", { text, onclick: () => connection.send(command) });
  const undo = button("Undo", "undo"), redo = button("Redo", "redo");
  el.classList.add("facewrinkle-studio");
  el.append(
    element("div", { class: "left" }, element("div", { class: "bar" }, search, element("label", { class: "check" }, lock, "Both sides")), box,
      element("div", { class: "bar" }, undo, redo, button("Reset", "reset"))),
    element("div", { class: "view" }, canvas));
  const view = new View(canvas, () => connection.send("shown")), sliders = new Sliders(box, connection);
  const app = { connection, data: null, placing: null, click() {}, turned() {} };
  const size = () => { el.style.height = `${model.get("height")}px`; view.request(); };
  const takeFace = (face, other) => { view.begin(face, other); sliders.setOff(face.off); };
  const told = {
    welcome(welcome) { sliders.build(welcome); takeFace(welcome, false); },
    face(face) { takeFace(face, face.faces.shown !== app.face); app.face = face.faces.shown; },
    document({ change, data, history }) {
      if (change < connection.changed) return; // the last change is not in it yet
      app.data = data;
      sliders.update(data);
      [undo.disabled, redo.disabled] = history.map((count) => !count);
    },
  };
  let fresh = true;
  const receive = (message, buffers) => {
    if (message.text) {
      const content = JSON.parse(message.text);
      told[content.is]?.(content);
    } else if (buffers?.length) {
      const { buffer, byteOffset, byteLength } = buffers[0], whole = buffer.slice(byteOffset, byteOffset + byteLength);
      if (message.photo) return view.setPhoto(photoOf(whole));
      const head = decode(whole);
      head.fresh = fresh;
      fresh = false;
      view.frame(head);
      el.dataset.step = head.step;
    }
  };
  pointers(canvas, view, app);
  model.on("msg:custom", receive);
  model.on("change:height", size);
  size();
  model.send({ text: JSON.stringify({ do: "hello" }) });
  return () => { model.off("msg:custom", receive); model.off("change:height", size); };
}

export default { render };
