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
