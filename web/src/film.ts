// A recording that the page itself has in it: what happened, and what was seen at many moments of it.
import type { About, Difference, Entry, History, MachineProfile, ModelProfile, Moment, Signal, View } from "./api";
import { Machine } from "./machine";
import { reached, type Tale, type Way } from "./way";

interface Data {
  head: {
    title: string;
    about: About;
    model: ModelProfile;
    machine: MachineProfile;
    signals: Signal[];
    first: number;
    end: number;
    left_out: number;
    every: number;
    /** How often somebody went back: what had happened after that moment is not in it. */
    back: number;
    parts: Way["parts"];
    differences: Difference[] | null;
    /** Whether the recording has its end. */
    has_end: boolean;
  };
  entries: Entry[];
  views: [number, unknown][];
}

/** So many views lie between two that are kept whole. */
const SPACING = 200;

/** What a change makes of a value: `[new]`, or the changes by key or index. */
function changed(before: unknown, change: unknown): unknown {
  if (Array.isArray(change)) return change[0];
  const after = (Array.isArray(before) ? [...before] : { ...(before as object) }) as Record<string, unknown>;
  for (const [key, part] of Object.entries(change as object)) after[key] = changed(after[key], part);
  return after;
}

/** Reads what a page has in it, if it has a recording. */
export async function read(page: NonElementParentNode = document): Promise<Film | null> {
  const text = page.getElementById("film")?.textContent;
  if (!text) return null;
  const bytes = Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));
  const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Film(JSON.parse(await new Response(plain).text()) as Data);
}

export class Film implements Tale {
  readonly isFilm = true;
  readonly isOpen = true;
  readonly isNow = true;
  readonly machine: Machine;
  readonly shown: Machine;
  history: History;
  private readonly way: Way;
  private readonly whole: View[] = [];
  private onChange: () => void = () => {};

  constructor(private readonly data: Data) {
    const { about, machine, model, signals, first, end, parts, left_out } = data.head;
    this.machine = this.shown = new Machine(about, machine, model);
    this.shown.signals = signals;
    this.shown.missing = left_out;
    const entries = data.entries.map((entry, i) => ({ ...entry, number: i + 1 }));
    this.way = { entries, parts: parts.map((part) => ({ ...part, from: Math.max(0, part.from - left_out) })) };
    let view: unknown = null;
    for (const [i, [, change]] of data.views.entries()) {
      view = changed(view, change);
      if (i % SPACING === 0) this.whole.push(view as View);
    }
    const now = { branch: parts.at(-1)?.branch ?? 0, at: end };
    const branch = { id: now.branch, name: "", why: null, parted: null, first, end };
    const differences = data.head.differences ?? [];
    this.history = { open: true, possible: true, first, ...now, now, branches: [branch], differences };
    this.look(first);
  }

  get title(): string {
    return this.data.head.title;
  }

  get aim(): number {
    return this.history.at;
  }

  /** Of so many moments one is known exactly. */
  get every(): number {
    return this.data.head.every;
  }

  /** How often somebody went back. */
  get back(): number {
    return this.data.head.back;
  }

  /** Whether the recording was cut off. */
  get isCutOff(): boolean {
    return !this.data.head.has_end;
  }

  /** Who shows it. */
  shownBy(changed: () => void): void {
    this.onChange = changed;
  }

  go({ at = this.history.now.at }: Partial<Moment>): Promise<void> {
    this.look(Math.min(Math.max(at, this.history.first), this.history.now.at));
    this.onChange();
    return Promise.resolve();
  }

  lookAt({ at }: Entry): Promise<void> {
    return this.go({ at });
  }

  private look(at: number): void {
    const { entries } = this.way;
    this.history = { ...this.history, at };
    this.shown.lookAt(entries, reached(this.way, at), this.view(at), this.shown.signals);
    this.shown.missing = this.data.head.left_out;
  }

  /** What was seen at a time. Between two moments that are known axes move evenly. */
  private view(at: number): View {
    const { views } = this.data;
    let [low, high] = [0, views.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (views[middle]![0] <= at) low = middle + 1;
      else high = middle;
    }
    const index = Math.max(0, low - 1);
    const before = this.exact(index);
    const next = views[index + 1];
    if (!next || next[0] <= views[index]![0]) return { ...before, at };
    const after = this.exact(index + 1);
    const span = next[0] - views[index]![0];
    const share = (at - views[index]![0]) / span;
    const between = (one: number, other: number) => Math.round(one + (other - one) * share);
    const axes = before.axes.map((axis, i) => {
      const to = after.axes[i]!;
      const moved = to.carriage - axis.carriage;
      // A counter that was set instead of counted does not move.
      const counted = Math.abs(to.position - axis.position) === Math.abs(moved);
      return {
        ...axis,
        carriage: between(axis.carriage, to.carriage),
        position: counted ? between(axis.position, to.position) : axis.position,
        // At the moment that is known so is the speed; after it, it is that of what is shown.
        speed: at > views[index]![0] ? Math.round((moved * 1e15) / span) : axis.speed,
      };
    });
    return { ...before, at, axes };
  }

  private exact(index: number): View {
    let view: unknown = this.whole[Math.floor(index / SPACING)];
    for (let i = Math.floor(index / SPACING) * SPACING + 1; i <= index; i++) view = changed(view, this.data.views[i]![1]);
    return view as View;
  }

  entriesOf(): Entry[] {
    return this.way.entries;
  }

  // A recording is looked at only.
  do = (): Promise<boolean> => Promise.resolve(false);
  walk = (): Promise<void> => Promise.resolve();
  leave = (): Promise<void> => Promise.resolve();
  takeOver = (): Promise<void> => Promise.resolve();
}
