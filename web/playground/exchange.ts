// What a real controller and the virtual one say to the same line, and when; and the real conversation
// as a recording that `vimc4 replay` plays.
import type { Entry } from "../src/api";

/** Answers count as equally late within this, or within a hundredth of the time; ms. */
const TOLERANCE = 50;

/** What one of them said to a line. */
export interface Said {
  /** As the journal writes bytes. */
  bytes: string;
  /** So long after the line, in ms: its last byte. */
  after: number | null;
}

/** Whether a line has gone out to the real controller: it waits behind others, it is on its way or there, or STOP went
    before it and it was given up. */
export type Went = "waits" | "out" | "cut";

export interface Exchange {
  line: string;
  went: Went;
  real: Said;
  virtual: Said;
  /** Which values of the profile would make the virtual one answer so. */
  causes: string[];
  /** The virtual one had something to do besides, of which the real one knows nothing. */
  isApart: boolean;
}

export type Verdict = "same" | "bytes" | "time" | "open" | "silent" | "apart" | "waits" | "cut";

/** How STOP is called among the lines: it is a byte, and no line. */
export const STOP = "STOP (253)";

/** One that has just been said to both. */
export function begun(line: string, went: Went, isApart = false): Exchange {
  const nothing = (): Said => ({ bytes: "", after: null });
  return { line, went, real: nothing(), virtual: nothing(), causes: [], isApart };
}

/** Bytes as the journal writes them. */
export function escaped(bytes: Iterable<number>): string {
  const names: Record<number, string> = { 13: "\\r", 10: "\\n", 9: "\\t", 92: "\\\\" };
  return [...bytes].map((byte) => names[byte]
    ?? (byte >= 32 && byte < 127 ? String.fromCharCode(byte) : `\\x${byte.toString(16).toUpperCase().padStart(2, "0")}`)).join("");
}

/** What came of a line. As long as no other was sent, what one of them has said so far may still come from the other. */
export function verdict({ went, real, virtual, isApart }: Exchange, isLast: boolean): Verdict {
  if (went !== "out") return went;
  const isSame = real.bytes === virtual.bytes;
  if (isApart && (!isSame || real.bytes === "")) return "apart";
  const isBegun = real.bytes.startsWith(virtual.bytes) || virtual.bytes.startsWith(real.bytes);
  if (!isSame) return isLast && isBegun ? "open" : "bytes";
  if (real.bytes === "") return isLast ? "open" : "silent";
  const [one, other] = [real.after ?? 0, virtual.after ?? 0];
  return Math.abs(one - other) <= Math.max(TOLERANCE, Math.max(one, other) / 100) ? "same" : "time";
}

/** What came over the line, as it came; times in nanoseconds of this computer since the port was opened. */
export type Passed = { at: number } & ({ in: string } | { out: string });

/** A recording of it, with the head and the first state of one of the virtual controller. */
export function recorded(virtual: string, passed: readonly Passed[], port: string, began: number): string {
  const [head, state] = virtual.split("\n", 2);
  const about = { ...(JSON.parse(head ?? "{}") as object), clock: "wall", from: "vimc4 page", controller: port, began };
  const lines = [JSON.stringify(about), ...(state?.includes('"state":') ? [state] : []), ...passed.map((one) => JSON.stringify(one))];
  lines.push(JSON.stringify({ at: passed.at(-1)?.at ?? 0, end: "saved" }));
  // Every character of a string is a byte; what is not ASCII is escaped, as the format wants it.
  return `${lines.join("\n").replace(/[\u007f-\uffff]/g, (letter) => `\\u${letter.charCodeAt(0).toString(16).padStart(4, "0")}`)}\n`;
}

/** What the virtual controller has said to a line, with what has come by these entries: so long after the line. */
export function heard(said: Said, entries: readonly Entry[], at: number): Said {
  const answers = entries.filter(({ kind }) => kind === "answer");
  const last = answers.at(-1);
  if (!last) return said;
  return { bytes: said.bytes + answers.map(({ bytes }) => bytes ?? "").join(""), after: (last.at - at) / 1e6 };
}
