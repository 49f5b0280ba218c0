// A file that is carried out: its pieces are given to the controller one after the other, each when the
// one before is done, as a host does.
import type { App } from "../src/app";
import type { Entry } from "../src/api";

/** What is done for a line of a file. */
export type Piece = { line: number } &
  ({ send: string } | { order: string } | { wait: number } | { until: Bit[]; why: string } | { ask: string });

/** A bit of an input port that has to be so. */
interface Bit {
  port: number;
  bit: number;
  level: boolean;
}

/** So often it is looked whether a piece is done, in ms. */
const LOOKS = 20;

export type State = "goes" | "asks" | "done" | "refused" | "ended";

export class Work {
  state: State = "goes";
  /** What it waits for, or what was refused. */
  reason = "";
  /** Nothing more is given for now. */
  isHeld = false;
  private next = 0;
  /** The number of the last entry before the piece that is being carried out. */
  private since = 0;
  private command: number | undefined;
  private isBusy = false;
  /** Looked at so often, also where the page is not: nobody draws a page in the background. */
  private readonly timer = setInterval(() => this.step(), LOOKS);

  constructor(
    readonly name: string,
    private readonly pieces: Piece[],
    private readonly app: App,
  ) {}

  get line(): number {
    return this.pieces[Math.max(0, this.next - 1)]?.line ?? 0;
  }

  get isOver(): boolean {
    return this.state !== "goes" && this.state !== "asks";
  }

  /** A person has done what was asked for. */
  goOn(): void {
    if (this.state !== "asks") return;
    [this.state, this.reason] = ["goes", ""];
  }

  giveUp(): void {
    if (!this.isOver) this.state = "ended";
    this.app.changed();
  }

  /** Looks whether the piece is done, and gives the next one. */
  private step(): void {
    const { app } = this;
    if (this.isOver) return clearInterval(this.timer);
    if (this.state !== "goes" || this.isBusy || this.isHeld || app.past?.isOpen || !app.machine) return;
    if (!this.isDone()) return;
    const piece = this.pieces[this.next];
    if (!piece) {
      this.state = "done";
      return app.changed();
    }
    this.next += 1;
    void this.give(piece);
  }

  private async give(piece: Piece): Promise<void> {
    const { app } = this;
    const path = `/controllers/${app.machine!.number}`;
    this.since = app.machine!.entries.at(-1)?.number ?? 0;
    [this.command, this.reason] = [undefined, ""];
    this.isBusy = true;
    try {
      if ("send" in piece) await app.api.post(`${path}/line`, { send: piece.send });
      else if ("order" in piece) await app.api.post(`${path}/orders`, { order: piece.order });
      else if ("wait" in piece) await this.sleep(path, piece.wait);
      else if ("until" in piece) this.reason = piece.why;
      else [this.state, this.reason] = ["asks", piece.ask];
    } catch (error) {
      this.refuse(error instanceof Error ? error.message : String(error));
    }
    this.isBusy = false;
    app.changed();
  }

  /** Until so much of the controller's time has passed. Where nothing moves nothing is told, so it is asked. */
  private async sleep(path: string, span: number): Promise<void> {
    const now = async () => (await this.app.api.get<{ now: number }>(`${path}/clock`)).now;
    const end = (await now()) + span;
    while (!this.isOver && (await now()) < end) await new Promise((resolve) => setTimeout(resolve, LOOKS));
  }

  private refuse(reason: string): void {
    [this.state, this.reason] = ["refused", reason];
  }

  private isDone(): boolean {
    const piece = this.pieces[this.next - 1];
    const machine = this.app.machine!;
    if (!piece) return true;
    if ("until" in piece) {
      const value = (wanted: number) => machine.view?.ports.find(({ port, input }) => input && port === wanted)?.value ?? 0;
      return piece.until.every(({ port, bit, level }) => Boolean((value(port) >> bit) & 1) === level);
    }
    if (!("send" in piece)) return true;
    const news: Entry[] = [];
    for (let i = machine.entries.length - 1; i >= 0 && machine.entries[i]!.number > this.since; i--) news.unshift(machine.entries[i]!);
    // One piece may be several commands: the last one counts.
    this.command = news.findLast(({ kind }) => kind === "command")?.command ?? this.command;
    const answer = news.find(({ kind, why }) => kind === "answer" && why !== undefined);
    if (answer) {
      this.refuse(answer.why!);
      this.app.changed();
      return false;
    }
    const isAnswered = news.some(({ kind, command }) => kind === "answer" && command !== undefined && command === this.command);
    const isIgnored = news.some(({ kind }) => kind === "ignored");
    // What is never answered is done when nothing moves any more.
    const isQuiet = machine.about.family === "lpkf" && news.length > 0 && !machine.position?.moving && machine.activity === "idle";
    return isAnswered || isIgnored || isQuiet;
  }
}
