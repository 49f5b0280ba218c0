// The controllers run here, beside the page, so that the page answers whatever they do.
import { Desk } from "../src/desk";
import { causes } from "./causes";
import { Session } from "./session";

/** What the page asks, with a number that comes back with the answer. */
export interface Question {
  id: number;
  method: string;
  path: string;
  body?: unknown;
}
/** Who asks has met the controllers, and hears from now on. */
type Message = Question | { isHeard: true };

/** So often is told what has happened, in ms. */
const TELLS = 20;

// A worker's own names are not those of a page.
const page = self as unknown as {
  onmessage: ((event: MessageEvent<Message>) => void) | null;
  postMessage(message: unknown): void;
};
const bytes = fetch("page.wasm").then((answer) => answer.arrayBuffer());
const session = bytes.then((bytes) => Desk.load(bytes)).then((desk) => new Session(desk, () => performance.now()));
/** Another desk, for what is only tried out. */
let spare: Promise<Desk> | null = null;
let isHeard = false;

function tell(session: Session): void {
  const messages = session.hear();
  if (messages.length > 0) page.postMessage({ messages });
}

page.onmessage = async ({ data }) => {
  if ("isHeard" in data) return void (isHeard = true);
  const { id, method, path, body } = data;
  try {
    const open = await session;
    if (path === "/causes") {
      const { model, machine, passed } = body as { model: string; machine: string; passed: Parameters<typeof causes>[2] };
      spare ??= bytes.then((bytes) => Desk.load(bytes));
      return page.postMessage({ id, answer: { status: 200, body: causes(await spare, { model, machine }, passed) } });
    }
    // All that is asked is about this moment.
    if (isHeard) tell(open);
    // Of other controllers nothing is told before somebody has met them.
    if (method === "PUT" && (path === "/session" || path === "/recording")) isHeard = false;
    page.postMessage({ id, answer: open.ask(method, path, body) });
  } catch (error) {
    page.postMessage({ id, error: String(error) });
  }
};
setInterval(() => isHeard && void session.then(tell), TELLS);
