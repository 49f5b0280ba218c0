// Controllers that run in the page itself, in a worker.
import { tell, WANTED, type Answer, type Listener, type Source } from "../src/api";

export class Here implements Source {
  token: string | null = null;
  /** Something that was asked waits for the rest of the page. */
  isWaiting = false;
  onWait: () => void = () => {};
  private readonly worker = new Worker("worker.js", { type: "module" });
  private readonly waiting = new Map<number, { resolve: (answer: Answer) => void; reject: (error: Error) => void }>();
  private last = 0;
  private hasAnswered = false;
  /** Why nothing is ever answered: the worker has not begun. */
  private why: Error | null = null;
  private listener: Listener | null = null;

  constructor() {
    this.worker.onmessage = ({ data }) => {
      if (data.messages) {
        for (const message of data.messages) if (this.listener) tell(message, this.listener);
        return;
      }
      if ("isWaiting" in data) {
        if (this.isWaiting !== data.isWaiting) {
          this.isWaiting = data.isWaiting;
          this.onWait();
        }
        return;
      }
      this.hasAnswered = true;
      const asked = this.waiting.get(data.id);
      this.waiting.delete(data.id);
      if (data.error) asked?.reject(new Error(data.error));
      else asked?.resolve(data.answer as Answer);
    };
    // It has not begun, or has ended: whoever waits is not left to wait.
    this.worker.onerror = (event) => {
      // Of a script that did not come nothing else is said.
      const why = new Error(event.message || "worker.js did not come");
      if (!this.hasAnswered) this.why = why;
      for (const { reject } of this.waiting.values()) reject(why);
      this.waiting.clear();
      this.listener?.connected(false);
    };
  }

  ask(method: string, path: string, body?: unknown): Promise<Answer> {
    if (this.why) return Promise.reject(this.why);
    const id = ++this.last;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.worker.postMessage({ id, method, path, body });
    });
  }

  follow(listener: Listener): void {
    this.listener = listener;
    void this.meet();
  }

  /** Others have taken the place of the controllers. */
  async meet(): Promise<void> {
    const { listener } = this;
    if (!listener) return;
    await this.ask("PUT", "/events", { ...WANTED, ...(await listener.wish()) });
    listener.connected(true);
    this.worker.postMessage({ isHeard: true });
  }
}
