// The controllers run here, beside the page, so that the page answers whatever they do.
import type { Answer } from "../src/api";
import { Desk } from "../src/desk";
import { causes } from "./causes";
import { Later, Relay } from "./relay";
import { Session } from "./session";

/** The names of the modules of this edition: put in by the build. */
declare const FIRST: string;
declare const WHOLE: string;

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
const reason = (error: unknown) => (error instanceof Error ? error.message : String(error));

/** A module by its name. What a cache has under that name may be something else: it is asked for again past all of them. */
async function module(name: string, cache: RequestCache = "default"): Promise<WebAssembly.Module> {
  try {
    const answer = await fetch(name, { cache }).catch((error) => {
      throw new Error(`${name}: ${reason(error)}`);
    });
    if (!answer.ok) throw new Error(`${name}: ${answer.status} ${answer.statusText}`);
    return await WebAssembly.compile(await answer.arrayBuffer());
  } catch (error) {
    if (cache === "reload") throw error;
    return module(name, "reload");
  }
}
const relay = module(FIRST).then((first) => new Relay(() => new Desk(first)));
const session = relay.then((relay) => new Session(relay, () => performance.now()));

let wanted: Promise<WebAssembly.Module> | null = null;
let handed: Promise<void> | null = null;
/** Another desk, for what is only tried out. */
let spare: Desk | null = null;

/** The whole module. What is not there, or is not whole, is asked for again when it is needed again. */
function whole(): Promise<WebAssembly.Module> {
  return (wanted ??= module(WHOLE).catch((error) => {
    wanted = null;
    throw error;
  }));
}

function handOver(): Promise<void> {
  return (handed ??= whole().then(async (module) => (await relay).handOver(() => new Desk(module))).catch((error) => {
    handed = null;
    throw error;
  }));
}

let isHeard = false;

function tell(session: Session): void {
  const messages = session.hear();
  if (messages.length > 0) page.postMessage({ messages });
}

/** How many wait for the whole module, and the last of those that change something. */
let waiting = 0;
let last: Promise<unknown> | null = null;

function wait(more: number): void {
  waiting += more;
  page.postMessage({ isWaiting: waiting > 0 });
}

/** Asks, and waits for the whole module where only that can answer. What changes something is done in the order in which
    it is asked, so that it waits, too, behind what waits; whoever only looks does not. */
async function inTurn(isLook: boolean, ask: () => Answer): Promise<Answer> {
  const now = async () => {
    try {
      return ask();
    } catch (error) {
      if (!(error instanceof Later)) throw error;
    }
    wait(1);
    try {
      await handOver();
    } catch (error) {
      const detail = `the rest of this page did not come (${reason(error)})`;
      return { status: 503, body: { title: "Not now", detail, remedy: "try again when this page can be reached" } };
    } finally {
      wait(-1);
    }
    return ask();
  };
  if (isLook) return now();
  const turn = last ? last.catch(() => {}).then(now) : now();
  last = turn;
  try {
    return await turn;
  } finally {
    if (last === turn) last = null;
  }
}

page.onmessage = async ({ data }) => {
  if ("isHeard" in data) {
    isHeard = true;
    // The controllers are seen: the rest can come. Who needs it is told if it does not.
    return void handOver().catch(() => {});
  }
  const { id, method, path, body } = data;
  try {
    const open = await session;
    if (path === "/causes") {
      const { model, machine, passed } = body as { model: string; machine: string; passed: Parameters<typeof causes>[2] };
      spare ??= new Desk(await whole());
      return page.postMessage({ id, answer: { status: 200, body: causes(spare, { model, machine }, passed) } });
    }
    page.postMessage({ id, answer: await inTurn(method === "GET", () => {
      // All that is asked is about this moment.
      if (isHeard) tell(open);
      const answer = open.ask(method, path, body);
      // Of other controllers nothing is told before somebody has met them.
      if (method === "PUT" && (path === "/session" || path === "/recording") && answer.status < 300) isHeard = false;
      return answer;
    }) });
  } catch (error) {
    page.postMessage({ id, error: reason(error) });
  }
};
setInterval(() => isHeard && void session.then(tell), TELLS);
