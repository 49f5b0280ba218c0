// What happens, as it happens: one WebSocket, which is opened again and again until the server is
// there, and goes on where it left off.
import type { Entry, Position } from "./api";

/** What the feed tells. */
export interface Listener {
  /** The connection is there, or is gone. */
  connected(is: boolean): void;
  entries(controller: number, entries: Entry[]): void;
  /** These numbers are no longer to be had. */
  gap(controller: number, from: number, to: number): void;
  position(position: Position): void;
  refused(detail: string): void;
  /** The numbers up to which everything is known, and the token. Asked before each connection. */
  wish(): Promise<{ after: Record<number, number>; token: string | null }>;
}

const FIRST_WAIT = 400;
const LONGEST_WAIT = 4_000;
/** Positions a second: as smooth as an eye needs with what is drawn between them. */
const POSITIONS = 20;
/** Everything but what only coverage wants. */
const KINDS = [
  "command", "ignored", "line", "answer", "cut-short", "motion", "switch", "signal", "port", "flash",
  "baud", "fault", "rule", "warning", "news", "missed",
];

export class Feed {
  private wait = FIRST_WAIT;

  constructor(private readonly listener: Listener) {}

  /** Connects, and stays connected. */
  async start(): Promise<void> {
    let wish;
    try {
      wish = await this.listener.wish();
    } catch {
      return this.again();
    }
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/v1/events`);
    socket.onopen = () => {
      const { token, after } = wish;
      const message = { kinds: KINDS, after, positions: POSITIONS, ...(token && { token }) };
      socket.send(JSON.stringify(message));
    };
    socket.onmessage = (event) => this.hear(JSON.parse(String(event.data)));
    socket.onclose = () => this.again();
  }

  private again(): void {
    this.listener.connected(false);
    setTimeout(() => void this.start(), this.wait);
    this.wait = Math.min(this.wait * 1.6, LONGEST_WAIT);
  }

  private hear(message: { type: string } & Record<string, unknown>): void {
    const controller = Number(message.controller);
    switch (message.type) {
      case "hello":
        this.wait = FIRST_WAIT;
        return this.listener.connected(true);
      case "events":
        return this.listener.entries(controller, message.entries as Entry[]);
      case "gap":
        return this.listener.gap(controller, Number(message.from), Number(message.to));
      case "position":
        return this.listener.position(message as unknown as Position);
      case "problem":
        return this.listener.refused(String(message.detail ?? message.title));
    }
  }
}
