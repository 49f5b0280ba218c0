// The controllers of the module that answers first, until those of the whole one take their place.
import type { Answer } from "../src/api";
import type { Desk } from "../src/desk";

/** Only the whole module can do that. */
export class Later extends Error {}

/** What a desk was asked, or the moment up to which it was heard. */
type Done = [method: string, path: string, body?: unknown] | number;

export class Relay {
  /** All of it, so that it can be done again; nothing any more once the whole module is there. */
  private done: Done[] | null = [];
  private desk: Desk;

  /** `make` makes desks, of the module that is there. */
  constructor(private make: () => Desk) {
    this.desk = make();
  }

  ask(method: string, path: string, body?: unknown): Answer {
    const answer = this.desk.ask(method, path, body);
    if (this.done && (answer.body as { later?: boolean } | null)?.later) throw new Later();
    this.done?.push([method, path, body]);
    return answer;
  }

  hear(now: number): object[] {
    // Where nothing was asked in between, the later moment is enough.
    if (typeof this.done?.at(-1) === "number") this.done.pop();
    this.done?.push(now);
    return this.desk.hear(now);
  }

  /** Begins on another desk, which takes the place of this one if that says that it could; otherwise nothing has changed. */
  anew(begin: () => boolean): void {
    const { desk, done } = this;
    let hasBegun = false;
    [this.desk, this.done] = [this.make(), done && []];
    try {
      hasBegun = begin();
    } finally {
      if (!hasBegun) [this.desk, this.done] = [desk, done];
    }
  }

  /** Brings the whole module to where this one is, to the nanosecond, and goes on with it. */
  handOver(make: () => Desk): void {
    const whole = make();
    for (const done of this.done ?? []) {
      if (typeof done === "number") whole.hear(done);
      else whole.ask(...done);
    }
    [this.make, this.desk, this.done] = [make, whole, null];
  }
}
