// The tab of the face itself: which one it is, its landmarks, and the parameters of its identity.

import { element } from "./sliders.js";

const PERSON = { // parameters of the built-in head: what each is called, and what it goes from and to
  Person: { age: ["Age", "younger", "older"], sex: ["Sex", "feminine", "masculine"], child: ["Child", "mature", "a child's proportions"] },
  "Shape of the head": {
    width: ["Width", "narrow", "wide"], length: ["Length", "short", "long"], jaw: ["Jaw", "narrow", "square"], chin: ["Chin", "receding", "strong"],
    cheeks: ["Cheeks", "hollow", "full"], cheekbones: ["Cheekbones", "flat", "prominent"], ears: ["Ears", "small and close", "large, standing out"],
  },
  "Shape of eyes, nose and mouth": {
    brow: ["Brow ridge", "flat", "heavy"], eye_spacing: ["Eye spacing", "close", "wide-set"],
    brow_arch: ["Brows", "straight", "arched"], eye_slant: ["Eye slant", "low outer corners", "high ones"],
    eye_fold: ["Eyelid fold", "a deep crease", "none, with a fold over the inner corner"], nose_length: ["Nose length", "short", "long"],
    nose_width: ["Nose width", "narrow", "broad"], nose_bridge: ["Bridge of the nose", "low and scooped", "high, with a hump"],
    nose_tip: ["Tip of the nose", "upturned", "drooping"], nose_bulb: ["Breadth of the tip", "fine", "bulbous"],
    nose_wings: ["Wings of the nose", "high", "low"],
    mouth: ["Mouth width", "narrow", "wide"], lips: ["Lips", "thin", "full"],
    mouth_corners: ["Corners of the mouth", "low", "high"],
    upper_lip: ["Upper lip", "thinner than the lower", "fuller than the lower"], philtrum: ["Philtrum", "short and deep", "long and flat"],
  },
  Colors: {
    skin: ["Skin color", "fair", "dark"], iris: ["Eye color", "blue over gray", "dark brown"], hair: ["Hair color", "fair", "black"],
    hair_density: ["Hair density", "shaved", "dense"], hair_length: ["Hair length", "cropped", "below the chin"],
    hair_combed: ["Comb", "aside", "back"], beard: ["Beard", "none up to the middle", "full"],
  },
};

export class FacePanel {
  constructor(panels, app) {
    this.app = app;
    this.choice = element("select", { "aria-label": "Face", onchange: () => app.connection.send("show", { name: this.choice.value }) });
    this.shown = element("input", { type: "checkbox", onchange: () => app.handlesOf("Face") });
    this.back = element("button", { text: "Reset landmarks", disabled: true, onclick: () => app.connection.change([[["landmarks"], {}]]) });
    this.about = element("p");
    this.report = element("ul", { class: "report" });
    this.rows = new Map();
    this.person = element("div");
    for (const [group, parameters] of Object.entries(PERSON)) {
      const rows = element("div", {}, element("h2", { text: group }));
      this.person.append(rows);
      for (const [name, [label, low, high]] of Object.entries(parameters)) {
        const made = panels.numberRow(label, ["identity", name], [-1, 1], 2, 0, `From ${low} to ${high}; 0 is the average head`);
        made.input.setAttribute("aria-label", `Face: ${label}`);
        this.rows.set(name, made);
        rows.append(made.line);
      }
    }
    this.content = [
      element("div", { class: "actions" }, this.choice),
      this.about,
      element("h2", { text: "Landmarks" }),
      element("label", { class: "inline" }, this.shown, "Show on the face; drag to correct"),
      element("div", { class: "actions" }, this.back), this.report, this.person,
    ];
  }

  /** Take over another face. */
  take({ faces, landmarks, report, identity, clip }) {
    const { names, shown, first } = faces;
    this.choice.replaceChildren(...names.map((name) => element("option", { value: name, text: name || first.split(/[\\/]/).at(-1) })));
    this.choice.value = shown;
    const all = Object.values(landmarks), unsure = all.some(({ confidence, estimated }) => estimated || (confidence !== null && confidence < 0.5));
    this.shown.disabled = !all.length;
    this.about.textContent = [
      all.length ? "" : "This surface has no landmarks, and therefore no muscles.",
      clip ? `An animation of ${clip.toFixed(1)} s moves it: press Space to play.` : "",
      unsure ? "Some landmarks are uncertain: show them, and drag the yellow ones where they belong." : "",
    ].filter(Boolean).join(" ");
    this.about.hidden = !this.about.textContent;
    this.report.replaceChildren(...report.map((text) => element("li", { text })));
    for (const [name, made] of this.rows) made.line.hidden = !identity.includes(name);
    this.rows.get("age").begin(identity.length > 1 ? -1 : 0); // a scan has the age 0, however old it looks
    for (const group of this.person.children) group.hidden = [...group.children].slice(1).every((line) => line.hidden);
  }

  update(data) {
    for (const [name, made] of this.rows) made.set(data.identity[name] ?? 0);
    this.back.disabled = !Object.keys(data.landmarks).length;
  }
}
