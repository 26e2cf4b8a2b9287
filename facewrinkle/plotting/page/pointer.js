// What the pointer does in the view: turn, move, zoom, click, and drag the eyes.

const GAZE_LIMIT = 40; // degrees
export const KEY_PAUSE = 900; // ms; keys that follow each other sooner are one step of undo

/** Let a thing be dragged, from what `taken` returns to `dropped`, and moved with keys; each is one gesture, to be undone at once. */
export function draggable(target, name, { taken, drag, dropped = () => {}, keys = {}, press }) {
  let start = null, gesture = "", last = -Infinity;
  const begin = (event) => { gesture = `${name} ${event.timeStamp}`; };
  target.addEventListener("pointerdown", (event) => {
    target.setPointerCapture(event.pointerId);
    begin(event);
    start = taken(event);
  });
  target.addEventListener("pointermove", (event) => { if (start) drag(event, start, gesture); });
  for (const end of ["pointerup", "pointercancel"]) target.addEventListener(end, () => { start = null; dropped(); });
  target.addEventListener("keydown", (event) => {
    const by = keys[event.key], again = event.timeStamp - last < KEY_PAUSE; // keys that follow each other need not wait for the answer
    if (!by) return;
    event.preventDefault();
    event.stopPropagation();
    if (!again) begin(event);
    last = event.timeStamp;
    press(event, by, gesture, again);
  });
}

export function pointers(canvas, view, app) {
  const held = new Map();
  let far = 0, apart = 0, gaze = null;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, event);
    far = 0;
    const eye = held.size === 1 && event.button === 0 && !event.shiftKey && !app.placing && view.pickEye(event.clientX, event.clientY);
    gaze = eye && app.data ? { ...eye, start: app.data.gaze, x: event.clientX, y: event.clientY, gesture: `gaze ${event.timeStamp}` } : null;
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = held.get(event.pointerId);
    if (!view.camera) return;
    if (!before) {
      if (!event.buttons) app.hover?.(event);
      if (!event.buttons) canvas.classList.toggle("eye", !app.placing && Boolean(view.pickEye(event.clientX, event.clientY)));
      return;
    }
    const height = canvas.clientHeight, dx = (event.clientX - before.clientX) / height, dy = (event.clientY - before.clientY) / height;
    held.set(event.pointerId, event);
    far += Math.hypot(event.clientX - before.clientX, event.clientY - before.clientY);
    if (gaze && held.size === 1) return look(event, gaze, view, app);
    if (held.size === 2) {
      const [a, b] = [...held.values()], now = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
      if (apart) view.camera.zoom(apart / now);
      apart = now;
      view.camera.pan(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons & 6) view.camera.pan(dx, dy);
    else view.camera.turn(3 * dx, 3 * dy);
    app.turned();
    view.request(true);
  });
  const end = (event) => {
    const click = held.size === 1 && held.has(event.pointerId) && far < 5 && event.type === "pointerup" && event.button === 0;
    held.delete(event.pointerId);
    apart = 0;
    gaze = null;
    if (click) app.click(event);
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    view.camera?.zoom(Math.exp(0.0012 * event.deltaY * (event.deltaMode ? 30 : 1)));
    app.turned();
    view.request(true);
  }, { passive: false });
}

/** Turn the eyes so that the place where they were taken goes along with the pointer. */
function look(event, { start, x, y, radius, side, gesture }, view, app) {
  const long = view.camera.height / view.canvas.clientHeight, degrees = 180 / Math.PI;
  const turned = (by) => degrees * Math.atan2(by * long, radius);
  const limited = (angle) => Math.round(10 * Math.max(-GAZE_LIMIT, Math.min(GAZE_LIMIT, angle))) / 10;
  const yaw = limited(start[0] + side * turned(event.clientX - x)), pitch = limited(start[1] - turned(event.clientY - y));
  app.connection.change([[["gaze"], [yaw, pitch]]], gesture);
}
