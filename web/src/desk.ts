// The controllers as WebAssembly: asked and heard as over HTTP and the WebSocket, without a server. It runs
// wherever there is WebAssembly: in a page, in a worker, in Node.js.
import type { Answer } from "./api";

/** What the module has for us: texts lie in its memory. */
interface Exports {
  memory: WebAssembly.Memory;
  /** Makes room for a request of so many bytes, and says where. */
  room(bytes: number): number;
  /** Answers the request at this moment; returns the length of the answer. */
  ask(now: number): number;
  hear(now: number): number;
  /** Where the answer is. */
  answer(): number;
}

const texts = { in: new TextEncoder(), out: new TextDecoder() };

export class Desk {
  /** The moment up to which everything has been heard, ms: what is asked is asked then. */
  private now = 0;

  private readonly module: Exports;

  /** Another desk of a module that has been compiled. */
  constructor(module: WebAssembly.Module) {
    this.module = new WebAssembly.Instance(module, {}).exports as unknown as Exports;
  }

  /** Loads it: the address of the module, or its bytes. */
  static async load(source: string | URL | BufferSource): Promise<Desk> {
    const isAddress = typeof source === "string" || source instanceof URL;
    return new Desk(await WebAssembly.compile(isAddress ? await (await fetch(source)).arrayBuffer() : source));
  }

  /** Asks what the API is asked, with or without `/v1` before the path. */
  ask(method: string, path: string, body?: unknown): Answer {
    const address = path.startsWith("/v1") ? path : `/v1${path}`;
    const request = texts.in.encode(`${method}\n${address}\n${body === undefined ? "" : JSON.stringify(body)}`);
    const { module } = this;
    const at = module.room(request.length);
    new Uint8Array(module.memory.buffer, at, request.length).set(request);
    const text = this.read(module.ask(this.now));
    const [status, sort] = text.split("\n", 2) as [string, string];
    const content = text.slice(status.length + sort.length + 2);
    return { status: Number(status), body: sort === "json" ? JSON.parse(content) : content };
  }

  /** Lets time pass up to this moment, in ms from any beginning: the messages of what has happened since. */
  hear(now: number): object[] {
    this.now = now;
    return JSON.parse(this.read(this.module.hear(now))) as object[];
  }

  private read(length: number): string {
    // The memory may have grown, and have moved.
    return texts.out.decode(new Uint8Array(this.module.memory.buffer, this.module.answer(), length));
  }
}
