// The WebSocket to the scope's server: it reconnects by itself, and reports to the server when a frame is on the screen.

const FIRST_PAUSE = 250; // ms between two attempts to connect; doubled each time
const LONGEST_PAUSE = 2000; // ms

export class Link {
  // `on` has hello(message), status(message), frame(about, arrays), closed() and opened().
  constructor(on) {
    this.on = on;
    this.calls = new Map();
    this.next = 1;
    this.pause = FIRST_PAUSE;
    this.waiting = []; // frames that are not drawn yet
    this.open();
  }

  open() {
    const socket = new WebSocket(`ws://${location.host}/stream`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => { this.pause = FIRST_PAUSE; this.on.opened(); };
    socket.onmessage = (event) => (typeof event.data === "string" ? this.text(JSON.parse(event.data)) : this.frame(event.data));
    socket.onclose = () => {
      for (const call of this.calls.values()) call.reject(new Error("the connection to the scope's server was lost"));
      this.calls.clear();
      this.on.closed();
      setTimeout(() => this.open(), this.pause);
      this.pause = Math.min(2 * this.pause, LONGEST_PAUSE);
    };
    this.socket = socket;
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  // Send a command to the daemon; resolves with the result, rejects with the error message.
  call(op, args = {}) {
    return new Promise((resolve, reject) => {
      if (this.socket.readyState !== WebSocket.OPEN) return reject(new Error("the scope's server does not answer"));
      const id = this.next++;
      this.calls.set(id, { resolve, reject });
      this.send({ op, id, args });
    });
  }

  text(message) {
    if (message.kind === "hello") this.on.hello(message);
    else if (message.kind === "status") this.on.status(message);
    else if (message.kind === "reply") {
      const call = this.calls.get(message.id);
      this.calls.delete(message.id);
      if (!call) { if (!message.ok) this.on.refused(message.error); return; }
      if (message.ok) call.resolve(message.result);
      else call.reject(new Error(message.error));
    }
  }

  // Draw all frames at the browser's next repaint; none may be left out, because each holds only new rows.
  frame(buffer) {
    this.waiting.push(buffer);
    if (this.waiting.length === 1) requestAnimationFrame(() => this.draw());
  }

  draw() {
    const frames = this.waiting;
    this.waiting = [];
    for (const buffer of frames) {
      this.on.frame(...unpack(buffer));
      this.send({ op: "drawn" });
    }
    this.on.drawn();
  }
}

// A frame is the length of a JSON text, the text, and arrays of float64 of one length.
function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const about = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const numbers = new Float64Array(buffer, 4 + length);
  const size = about.arrays ? numbers.length / about.arrays : 0;
  const arrays = [];
  for (let i = 0; i < about.arrays; i++) {
    arrays.push(Array.from(numbers.subarray(i * size, (i + 1) * size), (v) => (v === v ? v : null)));
  }
  return [about, arrays];
}
