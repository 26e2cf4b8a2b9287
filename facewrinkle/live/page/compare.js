// Before and after: a state that was kept (A), left of a curtain, beside what is shown now.

import { draggable } from "./pointer.js";

export class Compare {
  constructor(button, curtain, { view }) {
    Object.assign(this, { button, curtain, view });
    button.onclick = () => { view.keep(!view.kept); this.follow(); if (view.kept) curtain.focus(); };
    draggable(curtain, "curtain", {
      taken: (event) => { event.preventDefault(); curtain.focus(); return true; },
      drag: ({ clientX }) => { const { left, width } = view.canvas.getBoundingClientRect(); this.move((clientX - left) / width); },
      keys: { ArrowLeft: -0.02, ArrowDown: -0.02, ArrowRight: 0.02, ArrowUp: 0.02, PageDown: -0.1, PageUp: 0.1, Home: -1, End: 1 },
      press: (event, by) => this.move(view.curtain + by),
    });
  }

  move(share) {
    this.view.curtain = Math.max(0, Math.min(1, share));
    this.view.request();
  }

  /** Put the curtain where it is drawn, while something is kept. */
  follow() {
    const { kept, curtain } = this.view;
    this.button.setAttribute("aria-pressed", Boolean(kept));
    this.curtain.hidden = !kept;
    this.curtain.style.left = `${100 * curtain}%`;
    this.curtain.setAttribute("aria-valuenow", Math.round(100 * curtain));
  }
}
