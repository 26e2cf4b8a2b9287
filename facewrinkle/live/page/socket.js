// The connection to the studio: messages, frames, and connecting again when it was lost.

const ARRAYS = { uint8: Uint8Array, int8: Int8Array, uint16: Uint16Array, uint32: Uint32Array, float32: Float32Array };
const PHOTO = 0x544f4850; // "PHOT"

/** The header and the arrays of a frame; arrays are views of the buffer, and null if they are as before. */
export function decode(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  for (const part of head.parts) {
    for (const [name, sent] of Object.entries(part.arrays)) {
      if (!sent) continue; // the page has it
      const [type, offset, count, width] = sent;
      part.arrays[name] = { data: new ARRAYS[type](buffer, 4 + length + offset, count), width };
    }
  }
  return head;
}

/** The name of the part that a photo is of, and the file. */
export function photoOf(buffer) {
  const length = new DataView(buffer).getUint32(4, true);
  return { name: new TextDecoder().decode(new Uint8Array(buffer, 8, length)), bytes: new Uint8Array(buffer, 8 + length) };
}

export class Connection extends EventTarget {
  constructor() {
    super();
    this.key = location.hash.slice(1) || sessionStorage.getItem("key") || "";
    sessionStorage.setItem("key", this.key);
    this.number = this.changed = 0;
    this.waiting = new Map();
    this.pause = 250;
    this.open();
  }

  open() {
    const socket = (this.socket = new WebSocket(`ws://${location.host}/socket`));
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.pause = 250;
      this.fresh = true;
      this.changed = 0;
      socket.send(JSON.stringify({ do: "hello", key: this.key }));
    };
    socket.onmessage = ({ data }) => this.receive(data);
    socket.onclose = ({ code, reason }) => {
      for (const { refuse } of this.waiting.values()) refuse(new Error("the connection was lost"));
      this.waiting.clear();
      const final = code === 1008 && /key/.test(reason);
      this.tell("lost", { final, reason });
      if (!final) setTimeout(() => this.open(), this.pause);
      this.pause = Math.min(2 * this.pause, 4000);
    };
  }

  receive(data) {
    if (data instanceof ArrayBuffer) {
      if (data.byteLength > 4 && new DataView(data).getUint32(0, true) === PHOTO) {
        this.tell("photo", photoOf(data));
      } else {
        const head = decode(data);
        head.fresh = this.fresh;
        this.fresh = false;
        this.tell("frame", head);
      }
      return;
    }
    const message = JSON.parse(data);
    const answer = this.waiting.get(message.id);
    this.waiting.delete(message.id);
    if (message.is === "error") {
      if (answer) answer.refuse(new Error(message.text));
      else this.tell("error", message.text);
    } else if (message.is === "answer") {
      answer?.take(message.value);
    } else if (message.is !== "document" || message.change >= this.changed) { // else the last change is not in it yet
      this.tell(message.is, message);
    }
  }

  tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  /** Send a command without waiting. */
  send(command, values = {}) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ do: command, ...values }));
  }

  /** Send a command, and return a promise of the answer. */
  ask(command, values = {}) {
    const id = ++this.number;
    return new Promise((take, refuse) => {
      this.waiting.set(id, { take, refuse });
      this.send(command, { ...values, id });
    });
  }

  /** Change the document; changes of one gesture are one step of undo. */
  change(patches, gesture = "") {
    this.changed = ++this.number;
    this.send("change", { patches, gesture, id: this.changed });
  }
}
