// A file that is carried out: its pieces are given to the controller one after the other, each when the
// one before is done, as a host does.
import type { App } from "../src/app";
import type { View } from "../src/api";

/** What is done for a line of a file. */
export type Piece = { line: number } &
  ({ send: string } | { order: string } | { wait: number } | { until: Bit[]; why: string } | { ask: string });

/** A bit of an input port that has to be so. */
interface Bit {
  port: number;
  bit: number;
  level: boolean;
}

/** Whether the controller is done with all that it was given, and how many bytes it takes before that. */
interface Rest {
  rests: boolean;
  room: number;
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
  /** The number of the last entry that is no answer to it, or has been looked at. */
  private since: number;
  private isBusy = false;
  /** Looked at so often, also where the page is not: nobody draws a page in the background. */
  private readonly timer = setInterval(() => void this.goFurther(), LOOKS);

  constructor(
    readonly name: string,
    private readonly pieces: Piece[],
    private readonly app: App,
  ) {
    this.since = app.machine?.entries.at(-1)?.number ?? 0;
  }

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

  private get mayGive(): boolean {
    return this.state === "goes" && !this.isHeld && !this.app.past?.isOpen && this.app.machine !== undefined;
  }

  /** Gives what can be given by now. */
  private async goFurther(): Promise<void> {
    if (this.isOver) return clearInterval(this.timer);
    if (this.isBusy) return;
    this.isBusy = true;
    try {
      while (this.mayGive && await this.isNext()) await this.give();
    } catch (error) {
      this.refuse(error instanceof Error ? error.message : String(error));
    }
    this.isBusy = false;
  }

  private get path(): string {
    return `/controllers/${this.app.machine!.number}`;
  }

  /** Whether the turn of the next piece has come. The controller itself is asked: what is told of it comes later. */
  private async isNext(): Promise<boolean> {
    const { app, path, pieces } = this;
    const piece = pieces[this.next];
    const { rests, room } = await app.api.get<Rest>(`${path}/rest`);
    // All that it has said until it rested has been told by now.
    this.look();
    if (!rests && !(piece && "send" in piece && piece.send.length <= room)) return false;
    const last = pieces[this.next - 1];
    if (last && "until" in last && !await this.holds(last.until)) return false;
    return this.mayGive;
  }

  private async holds(bits: Bit[]): Promise<boolean> {
    const { ports } = await this.app.api.get<View>(`${this.path}/view`);
    const value = (wanted: number) => ports.find(({ port, input }) => input && port === wanted)?.value ?? 0;
    return bits.every(({ port, bit, level }) => Boolean((value(port) >> bit) & 1) === level);
  }

  /** Nothing more is given after an error reply. */
  private look(): void {
    if (this.state !== "goes") return;
    const { entries } = this.app.machine!;
    const news = entries.slice(entries.findLastIndex(({ number }) => number <= this.since) + 1);
    this.since = entries.at(-1)?.number ?? 0;
    const answer = news.find(({ kind, why }) => kind === "answer" && why !== undefined);
    if (answer) this.refuse(answer.why!);
  }

  private async give(): Promise<void> {
    const { app, path, pieces } = this;
    const piece = pieces[this.next];
    this.reason = "";
    if (!piece) this.state = "done";
    else {
      this.next += 1;
      if ("send" in piece) await app.api.post(`${path}/line`, { send: piece.send });
      else if ("order" in piece) await app.api.post(`${path}/orders`, { order: piece.order });
      else if ("wait" in piece) await this.sleep(path, piece.wait);
      else if ("until" in piece) this.reason = piece.why;
      else [this.state, this.reason] = ["asks", piece.ask];
    }
    app.changed();
  }

  /** Until so much of the controller's time has passed. Where nothing moves nothing is told, so it is asked. */
  private async sleep(path: string, span: number): Promise<void> {
    const now = async () => (await this.app.api.get<{ now: number }>(`${path}/clock`)).now;
    const end = (await now()) + span;
    while (!this.isOver && (await now()) < end) await new Promise((resolve) => setTimeout(resolve, LOOKS));
  }

  private refuse(reason: string): void {
    if (this.isOver) return;
    [this.state, this.reason] = ["refused", reason];
    this.app.changed();
  }
}
