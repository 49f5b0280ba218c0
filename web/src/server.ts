// The server that the page came from: asked over HTTP, heard over one WebSocket, which is opened again
// and again until the server is there, and goes on where it left off.
import { tell, WANTED, type Answer, type Listener, type Source } from "./api";

const FIRST_WAIT = 400;
const LONGEST_WAIT = 4_000;

export class Server implements Source {
  token: string | null = null;
  private wait = FIRST_WAIT;

  async ask(method: string, path: string, body?: unknown): Promise<Answer> {
    const headers: Record<string, string> = {};
    if (this.token) headers.Authorization = `Bearer ${this.token}`;
    if (body !== undefined) headers["Content-Type"] = "application/json";
    const response = await fetch(`/v1${path}`, {
      method,
      headers,
      body: body === undefined ? null : JSON.stringify(body),
    });
    const { status, statusText } = response;
    const text = await response.text();
    try {
      return { status, body: JSON.parse(text) };
    } catch {
      // It is text.
      return { status, body: response.ok ? null : { detail: statusText } };
    }
  }

  follow(listener: Listener): void {
    void this.connect(listener);
  }

  private async connect(listener: Listener): Promise<void> {
    let wish;
    try {
      wish = await listener.wish();
    } catch {
      return this.again(listener);
    }
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/v1/events`);
    socket.onopen = () =>
      socket.send(JSON.stringify({ ...WANTED, ...wish, ...(this.token && { token: this.token }) }));
    socket.onmessage = (event) => {
      const message = JSON.parse(String(event.data));
      if (message.type === "hello") this.wait = FIRST_WAIT;
      tell(message, listener);
    };
    socket.onclose = () => this.again(listener);
  }

  private again(listener: Listener): void {
    listener.connected(false);
    setTimeout(() => void this.connect(listener), this.wait);
    this.wait = Math.min(this.wait * 1.6, LONGEST_WAIT);
  }
}
