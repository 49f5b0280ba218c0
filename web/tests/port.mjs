// A serial port of a browser that is none: its other end is a second emulator, behind the host of the page.
import { connect } from "node:net";

/** Answers what the port below asks the host for: bytes to and from the TCP port of a program. */
export function bridge({ tcp }) {
  let line = null;
  let came = [];
  return async (request, response) => {
    if (!request.url.startsWith("/port")) return false;
    line ??= await new Promise((resolve, reject) => {
      const socket = connect(tcp.port, tcp.host, () => resolve(socket));
      socket.on("error", reject);
      socket.on("data", (bytes) => came.push(...bytes));
    });
    const sent = [];
    for await (const part of request) sent.push(part);
    if (request.method === "POST") line.write(Buffer.concat(sent));
    response.writeHead(200, { "Content-Type": "application/octet-stream", "Cache-Control": "no-store" });
    response.end(Buffer.from(request.method === "POST" ? [] : came.splice(0)));
    return true;
  };
}

/** What stands in for `navigator.serial`, put into a page before it begins. */
bridge.page = `
  const port = {
    readable: null, writable: null,
    async open({ baudRate }) {
      window.openedWith = baudRate;
      let isOpen = true;
      this.readable = new ReadableStream({
        async pull(controller) {
          while (isOpen) {
            const bytes = new Uint8Array(await (await fetch("/port")).arrayBuffer());
            if (bytes.length > 0) return controller.enqueue(bytes);
            await new Promise((resolve) => setTimeout(resolve, 5));
          }
        },
        cancel() { isOpen = false; },
      });
      this.writable = new WritableStream({ write: async (bytes) => void (await fetch("/port", { method: "POST", body: bytes })) });
    },
    async close() {},
  };
  Object.defineProperty(Navigator.prototype, "serial", { configurable: true, get: () => ({ requestPort: async () => port }) });
`;

/** Another one, whose other end is in the page: `window.real(line)` says after how many ms what is answered, one line after
    the other as a controller has it; 253 ends what is under way with F. `window.isHeld` keeps what is sent on its way, which
    otherwise takes `window.way` ms; after `window.late` more it is said to be out. */
export const played = `
  let [stream, held, line, under, waiting] = [null, [], "", null, []];
  window.sent = [];
  window.isHeld = false;
  window.way = window.late = 0;
  window.real = () => [20, "0"];
  window.said = (text) => stream.enqueue(new TextEncoder().encode(text));
  const answer = (text) => {
    clearTimeout(under);
    under = null;
    window.said(text);
    if (waiting.length > 0) carryOut(waiting.shift());
  };
  const carryOut = (line) => {
    const [after, text] = window.real(line);
    under = setTimeout(answer, after, text);
  };
  const take = (byte) => {
    window.sent.push(byte);
    if (byte === 253) return void (under && answer("F"));
    if (byte !== 13) return void (line += String.fromCharCode(byte));
    if (under) waiting.push(line);
    else carryOut(line);
    line = "";
  };
  const renew = () => {
    port.writable = new WritableStream({
      async write(bytes) {
        if (window.isHeld) await new Promise((resolve, reject) => held.push({ resolve, reject }));
        const passes = (span) => span > 0 && new Promise((resolve) => setTimeout(resolve, span));
        await passes(window.way);
        bytes.forEach(take);
        await passes(window.late);
      },
      abort: renew,
    });
    for (const { reject } of held.splice(0)) reject(new Error("aborted"));
  };
  const listen = () => void (port.readable = new ReadableStream({ start: (it) => void (stream = it) }));
  const port = {
    readable: null, writable: null,
    async open() {
      [line, under, waiting, window.isHeld] = ["", null, [], false];
      listen();
      renew();
    },
    async close() {
      port.readable = port.writable = null;
    },
  };
  window.wrong = () => {
    const broken = stream;
    listen();
    broken.error(new DOMException("A framing error has been detected.", "FramingError"));
  };
  window.unplug = () => {
    const lost = new DOMException("The device has been lost.", "NetworkError");
    port.readable = port.writable = null;
    stream.error(lost);
    for (const { reject } of held.splice(0)) reject(lost);
  };
  Object.defineProperty(Navigator.prototype, "serial", { configurable: true, get: () => ({ requestPort: async () => port }) });
`;
