// Whose answer it is, where a line goes out before the one ahead of it has been answered. The virtual controller tells
// to which command an answer belongs. From the real one only bytes come, in the order of the lines.
import type { Entry } from "../src/api";
import { byteOf, escaped, nothing, STOP, verdict, type Exchange } from "./exchange";

/** So long after the last byte an answer counts as whole, in ms. */
export const QUIET = 300;
/** So much later than the virtual one the real one may begin to answer, in ms. */
const LATE = 2_000;
/** A line that began no command after so long begins none, in ms. */
const IDLE = 500;
/** Of what is said to one line so many bytes are shown and compared; answers are far shorter. */
const SHOWN = 4_096;

/** A line that the virtual controller has been given. */
interface Given {
  exchange: Exchange;
  /** When, by its own time in ns; and in ms by the clock of the page. */
  at: number;
  since: number;
  /** Nothing was ahead of it: its first command begins when it is there. */
  isFirst: boolean;
  /** What no command has begun of yet, as the journal writes bytes. */
  rest: string;
  /** Its commands that are not answered yet. */
  open: Set<number>;
}

/** What the virtual controller says to each line. */
export class Commands {
  private given: Given[] = [];
  private readonly owners = new Map<number, Given>();
  /** The line whose command began last. */
  private place = 0;

  give(exchange: Exchange, at: number, since: number): Given {
    const isFirst = this.given.every((one) => one.exchange.isAnswered);
    // STOP is no command. What it ends is what answers.
    const isStop = exchange.line === STOP;
    exchange.isAnswered = isStop;
    const one = { exchange, at, since, isFirst, rest: isStop ? "" : escaped([...exchange.line].map(byteOf)), open: new Set<number>() };
    this.given.push(one);
    return one;
  }

  hear(entries: readonly Entry[]): void {
    for (const entry of entries) {
      if (entry.kind === "command") this.begins(entry);
      if (entry.kind === "answer") this.answers(entry);
    }
  }

  private begins({ bytes = "", command = 0, at }: Entry): void {
    const place = this.given.findIndex(({ rest }, i) => i >= this.place && rest !== "" && rest.includes(bytes));
    if (place >= 0) this.place = place;
    const owner = this.given[this.place];
    if (!owner) return;
    owner.rest = owner.rest.slice(Math.max(owner.rest.indexOf(bytes), 0) + bytes.length);
    owner.open.add(command);
    this.owners.set(command, owner);
    if (owner.isFirst) [owner.at, owner.isFirst] = [at, false];
    // Commands are carried out one after the other.
    for (const { exchange, open } of this.given.slice(0, this.place)) exchange.isAnswered ||= open.size === 0;
  }

  private answers({ bytes = "", command = 0, at }: Entry): void {
    const owner = this.owners.get(command) ?? this.given.at(-1);
    if (!owner) return;
    const { exchange, open, rest } = owner;
    exchange.virtual = { bytes: exchange.virtual.bytes + bytes, after: (at - owner.at) / 1e6 };
    open.delete(command);
    // Only what parts commands may be left.
    exchange.isAnswered = open.size === 0 && /^(?:[\s;]|\\[rnt])*$/.test(rest);
  }

  /** Some lines begin no command, so that nothing comes of them. */
  idle(now: number): void {
    if (this.given.some(({ open }) => open.size > 0)) return;
    for (const { exchange, since } of this.given) exchange.isAnswered ||= now - since > IDLE;
  }

  /** Nothing comes any more. Where that is because something else was done instead, lines of which it was not all cannot
      be compared. */
  end(isElsewhere = false): void {
    for (const { exchange } of this.given) {
      if (exchange.isAnswered) continue;
      if (isElsewhere && verdict(exchange) === "open") exchange.apart = "apart";
      exchange.isAnswered = true;
    }
    this.given = [];
    this.owners.clear();
    this.place = 0;
  }
}

/** A byte that came, as the journal writes it. */
interface Came {
  text: string;
  at: number;
}
const textOf = (came: readonly Came[]): string => came.map(({ text }) => text).join("");

/** What the real controller says to each line: the lines that it may still answer, and what has come since the first. */
export class Owed {
  private lines: Exchange[] = [];
  private came: Came[] = [];

  /** A line is on its way. Where all before it is settled, what comes from now on is its own. */
  goes(line: Exchange, now: number): void {
    if (this.isSettled(now)) this.end("next");
    line.from = now;
    this.lines.push(line);
  }

  /** What comes now is said to this line, if it is to any. */
  isAlone(line: Exchange): boolean {
    return this.lines.length === 1 && this.lines[0] === line;
  }

  /** A line did not go out after all. */
  drop(line: Exchange): void {
    this.lines = this.lines.filter((one) => one !== line);
    this.share();
  }

  take(bytes: Uint8Array, at: number): void {
    const room = SHOWN * this.lines.length - this.came.length;
    for (const byte of bytes.subarray(0, room)) this.came.push({ text: escaped([byte]), at });
    const last = this.came.at(-1);
    if (last) last.at = at;
    for (const line of this.lines) if (line.over === "late") line.over = "";
    this.share();
  }

  /** What may still come is not awaited. */
  end(over: "next" | "closed"): void {
    for (const line of this.lines) line.over = over;
    this.share();
    this.lines = [];
    this.came = [];
  }

  /** Once silence has lasted it is settled whose is what has come. Lines to which nothing was said go on waiting. Returns
      after how many ms that may be, and null where something else has to come before. */
  settle(now: number): number | null {
    const patience = this.patience();
    if (patience === null || this.lines.every(({ over }) => over === "late")) return null;
    const left = Math.max(patience, QUIET) - this.silence(now);
    if (left > 0) return left;
    for (const line of this.lines) line.over = "next";
    this.share();
    this.lines = this.lines.slice(this.lines.findLastIndex(({ real, isUnsure }) => real.bytes !== "" || isUnsure) + 1);
    this.came = [];
    for (const line of this.lines) line.over = "late";
    return null;
  }

  /** How long it must be silent until nothing more is said to these lines, in ms; null while nobody can know. */
  private patience(): number | null {
    if (this.lines.some(({ isAnswered }) => !isAnswered)) return null;
    const late = LATE + 2 * Math.max(0, ...this.lines.map(({ virtual }) => virtual.after ?? 0));
    if (this.lines.some(({ apart }) => apart !== "")) return late;
    const [text, wanted] = [textOf(this.came), this.lines.map(({ virtual }) => virtual.bytes).join("")];
    if (text === wanted) return 0;
    return wanted.startsWith(text) ? late : QUIET;
  }

  private silence(now: number): number {
    return now - Math.max(this.lines.at(-1)?.from ?? 0, this.came.at(-1)?.at ?? 0);
  }

  private isSettled(now: number): boolean {
    const patience = this.patience();
    return patience === 0 || (patience !== null && this.silence(now) > patience);
  }

  /** Hands out what has come. It is done again whenever either of them has said more. */
  share(): void {
    let rest = this.came;
    let isUnsure = false;
    this.lines.forEach((line, i) => {
      const next = this.lines[i + 1];
      const own = isUnsure ? 0 : next ? share(line, next, rest) : rest.length;
      isUnsure ||= own === null;
      line.isUnsure = isUnsure;
      const mine = rest.slice(0, own ?? rest.length);
      rest = rest.slice(mine.length);
      const last = mine.at(-1);
      line.real = last ? { bytes: textOf(mine), after: Math.max(0, last.at - (line.whole ?? line.from)) } : nothing();
    });
  }
}

/** How many of these bytes are said to this line, and not to the next; null if nobody can know. */
function share(line: Exchange, next: Exchange, came: readonly Came[]): number | null {
  const [text, wanted, following] = [textOf(came), line.virtual.bytes, next.virtual.bytes];
  const mayCome = line.over === "";
  // Nobody answers a line before it has gone out.
  const early = came.findLastIndex(({ at }) => at < next.from) + 1;
  if (line.isAnswered && line.apart !== "apart") {
    let [own, length] = [0, 0];
    while (length < wanted.length && own < came.length) length += came[own++]!.text.length;
    if (text.startsWith(wanted) && own >= early) return own;
    if (text === "" || (mayCome && text.length <= wanted.length)) return came.length;
    // Another place has as many digits: what follows them is what the next one should be answered.
    const after = text.slice(length);
    const isNext = following === "" ? after === "" : after.startsWith(following) || (mayCome && following.startsWith(after));
    if (isNext && own >= early) return own;
  }
  // It has said something else, or it is not known what it should say. Silence parts answers, too.
  const pause = came.findIndex(({ at }, i) => i >= Math.max(early, 1) && at - came[i - 1]!.at >= QUIET);
  if (pause >= 0) return pause;
  return early === came.length || !line.isAnswered ? came.length : null;
}
