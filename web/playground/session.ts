// A session: which controller and machine, and everything that was sent and done, each with its time.
// That is enough to do it again, to the same nanosecond, so it is what a link has in it.
import type { Answer } from "../src/api";

/** What a session talks to: the controllers in this page. */
export interface Controllers {
  ask(method: string, path: string, body?: unknown): Answer;
  hear(now: number): object[];
  /** Other controllers take their place, if `begin` says that it could. */
  anew(begin: () => boolean): void;
}

/** So many nanoseconds after the one before, this was done: bytes sent, an order, a signal, a fault. */
export type Deed = [after: number, kind: "send" | "order" | "fault" | "end-fault" | "rules" | "end-rules", text: string]
  | [after: number, kind: "set", name: string, value: unknown];

/** What can be done with a text; `set` has a name and a value. */
export const KINDS = ["send", "order", "fault", "end-fault", "rules", "end-rules"];

export interface Told {
  model: string;
  machine: string;
  deeds: Deed[];
  /** The moment that is looked at. */
  at: number;
}

/** What was done on the way to a branch, with whole times. */
type Log = [at: number, deed: Deed][];

const OWN = "/controllers/1";

/** What a request does that changes the controller; `null` if it only looks. */
function deed(method: string, path: string, body: unknown): Deed | null {
  const own = path.startsWith(`${OWN}/`) ? path.slice(OWN.length + 1) : "";
  const text = (key: string) => String((body as Record<string, unknown> | undefined)?.[key] ?? "");
  const [first, rest] = [own.split("/")[0], own.split("/").slice(1).join("/")];
  if (method === "POST" && own === "line") return [0, "send", text("send")];
  if (method === "POST" && own === "orders") return [0, "order", text("order")];
  if (method === "POST" && own === "faults") return [0, "fault", text("fault")];
  if (method === "DELETE" && first === "faults") return [0, "end-fault", rest];
  if (method === "POST" && own === "rules") return [0, "rules", text("rules")];
  if (method === "DELETE" && first === "rules") return [0, "end-rules", rest];
  if (method === "PUT" && first === "signals") {
    return [0, "set", decodeURIComponent(rest), (body as { value?: unknown } | undefined)?.value];
  }
  return null;
}

/** The request that does it. */
function request([, kind, what, value]: Deed): [method: string, path: string, body?: unknown] {
  switch (kind) {
    case "send": return ["POST", `${OWN}/line`, { send: what }];
    case "order": return ["POST", `${OWN}/orders`, { order: what }];
    case "fault": return ["POST", `${OWN}/faults`, { fault: what }];
    case "end-fault": return ["DELETE", `${OWN}/faults${what ? `/${what}` : ""}`];
    case "rules": return ["POST", `${OWN}/rules`, { rules: what }];
    case "end-rules": return ["DELETE", `${OWN}/rules${what ? `/${what}` : ""}`];
    case "set": return ["PUT", `${OWN}/signals/${encodeURIComponent(what)}`, { value }];
  }
}

/** What a session is, of which it keeps nothing but what was done. */
export class Session {
  private told: Omit<Told, "deeds" | "at"> = { model: "imc4", machine: "bench" };
  private log: Log = [];
  /** What was done on each branch of the past, and before each moment that is kept. */
  private branches = new Map<number, Log>();
  private moments = new Map<number, Log>();
  private looked: { branch: number; at: number; now: number } | null = null;

  constructor(
    private readonly desk: Controllers,
    private readonly clock: () => number,
  ) {}

  ask(method: string, path: string, body?: unknown): Answer {
    if (path === "/session") return method === "GET" ? { status: 200, body: this.tell() } : this.begin(body as Told);
    // Everything that is done is done at the time up to which everything has been heard.
    const what = deed(method, path, body);
    const at = what ? this.now() : 0;
    const answer = this.desk.ask(method, path, body);
    if (answer.status >= 300) return answer;
    if (what) this.log.push([at, what]);
    else this.note(method, path, body, answer.body);
    return answer;
  }

  /** What has happened. */
  hear(): object[] {
    return this.desk.hear(this.clock());
  }

  private now(): number {
    return (this.desk.ask("GET", `${OWN}/clock`).body as { now: number }).now;
  }

  private tell(): Told {
    const { looked } = this;
    const [log, at] = looked ? [this.wayTo(looked), looked.at] : [this.log, this.now()];
    let last = 0;
    const deeds = log.map(([time, [, ...rest]]) => {
      const after = time - last;
      last = time;
      return [after, ...rest] as Deed;
    });
    return { ...this.told, deeds, at };
  }

  /** Begins anew, with all that was done in another session. Where that cannot be, this one goes on. */
  private begin({ deeds, at, ...told }: Told): Answer {
    const { desk } = this;
    const [log, refused]: [Log, string[]] = [[], []];
    let answer: Answer = { status: 200, body: { refused } };
    desk.anew(() => {
      // What is done again is done at its time, however fast this computer is.
      const made = desk.ask("PUT", "/controllers", { ...told, clock: "manual" });
      if (made.status >= 300) {
        answer = made;
        return false;
      }
      // So that all of it can be saved.
      desk.ask("POST", `${OWN}/recording`);
      const pass = (span: number) => span > 0 && desk.ask("POST", `${OWN}/clock/advance`, { span: `${span}ns` });
      let time = 0;
      for (const one of deeds) {
        pass(one[0]);
        time += one[0];
        const now = this.now();
        const { status, body } = desk.ask(...request(one));
        if (status >= 300) refused.push((body as { detail?: string }).detail ?? String(status));
        else log.push([now, one]);
      }
      pass(at - time);
      if (deeds.length > 0) desk.ask("POST", `${OWN}/clock/pause`);
      desk.ask("PUT", `${OWN}/clock`, { clock: "real" });
      return true;
    });
    if (answer.status < 300) {
      [this.told, this.log, this.looked] = [told, log, null];
      this.branches.clear();
      this.moments.clear();
    }
    return answer;
  }

  /** Follows who goes through the past. */
  private note(method: string, path: string, body: unknown, answer: unknown): void {
    const own = path.slice(OWN.length + 1);
    const { looked } = this;
    if (own === "history/do" && looked) {
      const { branch } = answer as { branch: number };
      const { send, order } = body as { send?: string; order?: string };
      const done: Deed = send === undefined ? [0, "order", order ?? ""] : [0, "send", send];
      this.branches.set(branch, [...this.wayTo(looked), [looked.at, done]]);
    }
    if (own === "history/take" && looked) this.log = this.wayTo(looked);
    if (method === "POST" && own === "snapshots") this.moments.set((answer as { id: number }).id, [...this.log]);
    const [, moment] = /^snapshots\/(\d+)\/restore$/.exec(own) ?? [];
    if (moment) this.log = this.moments.get(Number(moment)) ?? this.log;
    if (method === "DELETE" && own === "debugger") this.looked = null;
    if (own.startsWith("history") && !own.startsWith("history/entries")) {
      const { open, branch, at, now } = answer as { open: boolean; branch: number; at: number; now: { branch: number } };
      this.looked = open ? { branch, at, now: now.branch } : null;
    }
  }

  private wayTo({ branch, at, now }: { branch: number; at: number; now: number }): Log {
    const log = branch === now ? this.log : this.branches.get(branch) ?? this.log;
    return log.filter(([time]) => time <= at);
  }
}
