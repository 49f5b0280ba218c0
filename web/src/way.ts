// What happened on the way to a moment, branch after branch, and what shows it: the past of a
// controller, or a recording.
import type { Branch, Entry, History, Moment } from "./api";
import type { Machine } from "./machine";

/** What is told of a machine, moment by moment. */
export interface Tale {
  /** A recording: nothing can be done. */
  readonly isFilm: boolean;
  readonly isOpen: boolean;
  /** Whether what is shown is the present, as far as there is one. */
  readonly isNow: boolean;
  readonly history: History | null;
  /** The time that is looked at, or that was asked for last; `null` where the past is closed. */
  readonly aim: number | null;
  readonly shown: Machine | null;
  go(moment: Partial<Moment>): Promise<void>;
  /** Goes to when an entry that is shown happened. */
  lookAt(entry: Entry): Promise<void>;
  do(deed: { order: string } | { send: string }): Promise<boolean>;
  walk(line: string): Promise<void>;
  leave(): Promise<void>;
  takeOver(): Promise<void>;
  entriesOf(branch: Branch): Entry[];
}

/** What happened on the way to the end of a branch. */
export interface Way {
  entries: Entry[];
  /** Where each branch begins on it: its first entry, and its first time. */
  parts: { branch: number; from: number; first: number }[];
}

/** So many of the entries of a way have happened at a time, after everything that happened then. */
export function reached({ entries, parts }: Way, at: number): number {
  // A branch may begin at an earlier time than that at which it has left another one.
  const part = parts.findLastIndex(({ first }) => first <= at);
  let low = parts[part]?.from ?? 0;
  let high = parts[part + 1]?.from ?? entries.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (entries[middle]!.at <= at) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** What happened on several branches one after the other, each up to where the next leaves it. */
export function joined(chain: { branch: Branch; entries: Entry[] }[]): Way {
  const entries: Entry[] = [];
  const parts: Way["parts"] = [];
  for (const [i, { branch, entries: own }] of chain.entries()) {
    const end = chain[i + 1]?.branch.parted?.at ?? Infinity;
    parts.push({ branch: branch.id, from: entries.length, first: branch.first });
    for (const entry of own) {
      if (entry.at <= end) entries.push({ ...entry, number: entries.length + 1 });
    }
  }
  return { entries, parts };
}
