// The way that a machine has gone, in steps of its carriages. It grows without end, so what is old is
// thinned: every second corner goes, and how many have gone is known.

/** What a part of the way was for. */
export type Kind = "feed" | "rapid" | "arc" | "reference" | "older";
export const KINDS: readonly Kind[] = ["feed", "rapid", "arc", "reference", "older"];

/** Places one after the other, on one kind of way. */
export interface Run {
  kind: Kind;
  /** x, y, z, x, y, z … */
  points: number[];
}

export type Place = readonly [number, number, number];

const MOST = 200_000;
/** Longer runs are continued by another, so that thinning can take the old ones. */
const LONGEST = 3 * 1_024;

export class Path {
  runs: Run[] = [];
  corners = 0;
  /** So many corners were left out. */
  thinned = 0;
  /** Another number after every change that is no addition. */
  edition = 0;

  /** The kinds that there are, in the order in which they came. */
  readonly kinds = new Set<Kind>();

  constructor(private readonly most = MOST) {}

  /** Goes on from the last place, if this begins there. */
  add(kind: Kind, places: readonly Place[]): void {
    const [first, ...rest] = places;
    if (!first || rest.length === 0) return;
    const last = this.runs.at(-1);
    let run = last && last.kind === kind && endsAt(last, first) ? last : undefined;
    if (!run || run.points.length > LONGEST) {
      run = { kind, points: [...first] };
      this.runs.push(run);
      this.kinds.add(kind);
      this.corners += 1;
    }
    for (const place of rest) run.points.push(...place);
    this.corners += rest.length;
    if (this.corners > this.most) this.thin();
  }

  clear(): void {
    this.runs = [];
    this.kinds.clear();
    this.corners = this.thinned = 0;
    this.edition += 1;
  }

  /** Moves everything, when it is learnt where it really was. */
  shift(by: Place): void {
    for (const { points } of this.runs) {
      for (let i = 0; i < points.length; i++) points[i]! += by[i % 3]!;
    }
    this.edition += 1;
  }

  /** The older half loses every second corner, and what its parts were for. */
  private thin(): void {
    let old = 0;
    let count = 0;
    while (old < this.runs.length - 1 && count < this.corners / 2) {
      count += this.runs[old++]!.points.length / 3;
    }
    const joined: Run[] = [];
    for (const { points } of this.runs.slice(0, old)) {
      const last = joined.at(-1);
      const first: Place = [points[0]!, points[1]!, points[2]!];
      if (last && endsAt(last, first)) for (let i = 3; i < points.length; i++) last.points.push(points[i]!);
      else joined.push({ kind: "older", points: [...points] });
    }
    for (const run of joined) {
      const end = run.points.length - 3;
      run.points = run.points.filter((_, i) => i >= end || Math.floor(i / 3) % 2 === 0);
    }
    const kept = joined.reduce((sum, run) => sum + run.points.length / 3, 0);
    this.thinned += count - kept;
    this.runs.splice(0, old, ...joined);
    this.corners = this.runs.reduce((sum, run) => sum + run.points.length / 3, 0);
    this.edition += 1;
  }
}

function endsAt({ points }: Run, [x, y, z]: Place): boolean {
  const at = points.length - 3;
  return points[at] === x && points[at + 1] === y && points[at + 2] === z;
}
