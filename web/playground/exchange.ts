// What a real controller and the virtual one say to the same line, and when; and the real conversation
// as a recording that `vimc4 replay` plays.

/** Answers count as equally late within this, or within a hundredth of the time; ms. */
const TOLERANCE = 50;

/** What one of them said to a line. */
export interface Said {
  /** As the journal writes bytes. */
  bytes: string;
  /** So long after the line, in ms: its last byte. */
  after: number | null;
}

/** Whether a line has gone out to the real controller: it waits behind others, it is on its way or there; STOP went before
    it and it was given up; or the port was closed, or gone, before it was sent whole. */
export type Went = "waits" | "out" | "cut" | "unsent";

export interface Exchange {
  line: string;
  went: Went;
  /** When it began to go out, and when it had come as a whole: ms, by the clock of the page. */
  from: number;
  whole: number | null;
  real: Said;
  virtual: Said;
  /** The virtual one says no more to it. */
  isAnswered: boolean;
  /** Nobody can know whether the real one has said this to it, or to another line that waited. */
  isUnsure: boolean;
  /** What may still come is not awaited: another line has followed, or the port was closed. Where nothing has come for long,
      it is late. */
  over: "" | "late" | "next" | "closed";
  /** Which values of the profile would make the virtual one answer so. */
  causes: string[];
  /** Why they cannot be compared: the virtual one had something to do besides, of which the real one knows nothing; or
      the real one may have got part of a line that was given up. */
  apart: "" | "apart" | "part";
}

export type Verdict = "same" | "bytes" | "time" | "open" | "late" | "silent" | "apart" | "unsure" | "closed" | Exclude<Went, "out">;

/** How STOP is called among the lines: it is a byte, and no line. */
export const STOP = "STOP (253)";

export const nothing = (): Said => ({ bytes: "", after: null });

/** One that is about to be said to both. */
export function begun(line: string, apart: Exchange["apart"] = ""): Exchange {
  return {
    line, went: "waits", from: 0, whole: null, real: nothing(), virtual: nothing(), isAnswered: apart !== "", isUnsure: false, over: "", causes: [], apart,
  };
}

/** The byte that a character of a line is. */
export const byteOf = (letter: string): number => letter.charCodeAt(0);

/** Bytes as the journal writes them. */
export function escaped(bytes: Iterable<number>): string {
  const names: Record<number, string> = { 13: "\\r", 10: "\\n", 9: "\\t", 92: "\\\\" };
  return [...bytes].map((byte) => names[byte]
    ?? (byte >= 32 && byte < 127 ? String.fromCharCode(byte) : `\\x${byte.toString(16).toUpperCase().padStart(2, "0")}`)).join("");
}

/** What came of a line. As long as it is not over, what one of them has said so far may still come from the other. */
export function verdict({ went, real, virtual, isAnswered, apart, isUnsure, over }: Exchange): Verdict {
  if (went !== "out") return went;
  const isSame = real.bytes === virtual.bytes;
  if (apart && (!isSame || real.bytes === "")) return "apart";
  if (isUnsure) return "unsure";
  const isBegun = real.bytes.startsWith(virtual.bytes) || virtual.bytes.startsWith(real.bytes);
  const isAwaited = over !== "next" && !(isAnswered && real.bytes.length > virtual.bytes.length);
  if (isBegun && isAwaited && (!isSame || real.bytes === "")) {
    if (over === "late") return isSame ? "silent" : "late";
    return over === "closed" ? "closed" : "open";
  }
  if (!isSame) return "bytes";
  if (real.bytes === "") return "silent";
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
