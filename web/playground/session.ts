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

const OWN = "/controllers/1";

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

/** Which controller a session began with. What was done to it, in whatever way, the controller knows itself. */
export class Session {
  private told: Omit<Told, "deeds" | "at"> = { model: "imc4", machine: "bench" };

  constructor(
    private readonly desk: Controllers,
    private readonly clock: () => number,
  ) {}

  ask(method: string, path: string, body?: unknown): Answer {
    if (path === "/session") return method === "GET" ? this.tell() : this.begin(body as Told);
    return this.desk.ask(method, path, body);
  }

  /** What has happened. */
  hear(): object[] {
    return this.desk.hear(this.clock());
  }

  private tell(): Answer {
    const answer = this.desk.ask("GET", `${OWN}/deeds`);
    if (answer.status >= 300) return answer;
    const { at, deeds } = answer.body as { at: number; deeds: Deed[] };
    let last = 0;
    const after = deeds.map(([time, ...rest]) => {
      const span = time - last;
      last = time;
      return [span, ...rest] as Deed;
    });
    return { status: 200, body: { ...this.told, deeds: after, at } satisfies Told };
  }

  /** Begins anew, with all that was done in another session. Where that cannot be, this one goes on. */
  private begin({ deeds, at, ...told }: Told): Answer {
    const { desk } = this;
    const refused: string[] = [];
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
        const { status, body } = desk.ask(...request(one));
        if (status >= 300) refused.push((body as { detail?: string }).detail ?? String(status));
      }
      pass(at - time);
      if (deeds.length > 0) desk.ask("POST", `${OWN}/clock/pause`);
      desk.ask("PUT", `${OWN}/clock`, { clock: "real" });
      return true;
    });
    if (answer.status < 300) this.told = told;
    return answer;
  }
}
