// One controller and its machine as the panel knows them: what the feed has told, in the order in
// which it happened, and the latest view.
import type { About, Breakpoint, Clock, Entry, Fault, MachineProfile, ModelProfile, Position, Rule, Signal, Snapshot, View } from "./api";
import { Path, type Kind, type Place } from "./path";

/** So many entries are kept for searching. */
const ENTRIES = 20_000;
/** A position that the path does not lead to is believed when nothing has moved for so long, in ms. */
const SETTLES = 400;

const ARCS = new Set(["@y", "@w", "y", "w", "AA", "AR"]);
const REFERENCES = new Set(["@R", "@F", "7", "OH", "IN", "!IS"]);
const MOVES = /^(?:@\d)?[AM0m]\s*(-?\d+(?:,-?\d+)*)/;

export class Machine {
  view: View | null = null;
  signals: Signal[] = [];
  clock: Clock | null = null;
  faults: Fault[] = [];
  rules: Rule[] = [];
  breakpoints: Breakpoint[] = [];
  snapshots: Snapshot[] = [];
  position: Position | null = null;
  /** Positions of the motion that is going on, which is not on the path yet. */
  trail: Place[] = [];
  entries: Entry[] = [];
  /** So many of the entries had happened at the moment that is shown; all if it is the present. */
  reached: number | null = null;
  /** So many entries were left out of `entries`. */
  missing = 0;
  readonly path = new Path();
  /** The latest time that was told, and when that was, by the clock of the page. */
  private told = { time: 0, since: 0 };
  /** Limit switches that are pressed: `0-`, `2+` … */
  readonly switches = new Set<string>();
  /** Another number after every change. */
  edition = 0;

  /** Which indices X, Y and Z have. */
  readonly spatial: readonly [number, number, number];

  private way: Place = [0, 0, 0];
  private isPlaced = false;
  /** Where the counters were when the motion began that is going on. */
  private began: Place | null = null;
  private head = "up";
  /** Whether a trackball moves what no command does. */
  private ball = false;
  private commands = new Map<number, string>();
  private line = { mnemonic: "", bytes: "" };
  private settling = 0;

  constructor(
    readonly about: About,
    readonly profile: MachineProfile,
    readonly model: ModelProfile,
  ) {
    const index = (letter: string) => about.axes.find((axis) => axis.name.startsWith(letter))?.index ?? -1;
    this.spatial = [index("X"), index("Y"), index("Z")];
  }

  get number(): number {
    return this.about.number;
  }

  /** What keeps it from moving, as its owner would see at a look. */
  get holdsBack(): "estopHeld" | null {
    const held = this.signals.find(({ name }) => name === "estop")?.value
      ?? this.view?.signals.find(({ name }) => name === "estop")?.value;
    return held ? "estopHeld" : null;
  }

  get activity(): string {
    if (this.view && !this.view.powered) return "off";
    return this.position?.activity ?? this.view?.activity ?? "idle";
  }

  /** Millimetres of a step, or degrees; `null` for an axis of which nobody knows. */
  perStep(index: number): { factor: number; unit: string } | null {
    const scale = this.about.axes.find((axis) => axis.index === index)?.scale;
    if (!scale) return null;
    const factor = scale.units / scale.steps;
    return scale.unit === "µm" ? { factor: factor / 1_000, unit: "mm" } : { factor, unit: scale.unit };
  }

  /** Everything anew, as after another server has taken the place of this one. */
  forget(): void {
    this.entries = [];
    this.missing = 0;
    this.commands.clear();
    this.switches.clear();
    this.path.clear();
    this.trail = [];
    this.position = null;
    this.way = [0, 0, 0];
    this.isPlaced = false;
    this.began = null;
    this.ball = false;
    this.edition += 1;
  }

  hear(entries: Entry[]): void {
    for (const entry of entries) this.hearOne(entry);
    // Taken in bulk, so that a busy line costs nothing for each entry.
    for (const entry of entries) this.entries.push(entry);
    const over = this.entries.length - ENTRIES;
    if (over > ENTRIES / 10) {
      this.entries.splice(0, over);
      this.missing += over;
    }
    this.edition += 1;
  }

  gap(from: number, to: number): void {
    this.missing += to - from + 1;
    this.edition += 1;
  }

  /** As it was when so many entries of a way had happened. */
  lookAt(way: Entry[], reached: number, view: View, signals: Signal[]): void {
    if (way !== this.entries || reached < (this.reached ?? 0)) {
      this.forget();
      [this.entries, this.reached] = [way, 0];
    }
    this.seen(view);
    for (let i = this.reached ?? 0; i < reached; i++) this.hearOne(way[i]!);
    this.reached = reached;
    const now = new Map(view.signals.map(({ name, value }) => [name, value]));
    this.signals = signals.map((signal) => ({ ...signal, value: now.get(signal.name) ?? null }));
    const each = (what: "position" | "carriage" | "speed") => view.axes.map((axis) => axis[what]);
    const [positions, carriage, speed] = [each("position"), each("carriage"), each("speed")];
    const { at, activity } = view;
    this.isAt({ controller: this.number, at, activity, moving: this.began !== null, positions, carriage, speed });
    clearTimeout(this.settling);
    if (!this.began) this.settle(this.place(this.byIndex(carriage)));
  }

  /** What time it is by now, in ns: it passes while nothing happens that is told. */
  get now(): number {
    const time = Math.max(this.clock?.now ?? 0, this.position?.at ?? 0, this.view?.at ?? 0);
    if (!this.clock) return time;
    if (this.clock.paused) return this.clock.paused.at;
    if (time !== this.told.time) this.told = { time, since: performance.now() };
    const pace = this.clock.clock === "real" ? 1 : parseFloat(this.clock.clock) || 0;
    return time + (performance.now() - this.told.since) * 1e6 * pace;
  }

  isAt(position: Position): void {
    this.position = position;
    const place = this.place(this.byIndex(position.carriage));
    if (position.moving) {
      clearTimeout(this.settling);
      if (!this.isPlaced && this.began) {
        const counters = this.place(this.byIndex(position.positions));
        const [x, y, z] = place.map((at, i) => at - (counters[i]! - this.began![i]!));
        this.settle([x!, y!, z!]);
        this.trail = [this.way];
      }
      if (this.trail.length > 0) this.trail.push(place);
      if (this.trail.length > 4_096) this.trail = this.trail.filter((_, i) => i % 2 === 0);
    } else {
      clearTimeout(this.settling);
      const isElsewhere = place.some((at, i) => at !== this.way[i]);
      if (!this.isPlaced) this.settle(place);
      else if (isElsewhere) this.settling = window.setTimeout(() => this.settle(place), SETTLES);
    }
    this.edition += 1;
  }

  seen(view: View): void {
    this.view = view;
    if (view.details.head) this.head = view.details.head;
    for (const { index, limits } of view.axes) {
      limits?.forEach((active, i) => this.presses(`${index}${i ? "+" : "-"}`, active));
    }
    this.edition += 1;
  }

  /** Believes where the path has led to: at first all of it is put there, later steps were lost. */
  private settle(place: Place): void {
    if (!this.isPlaced) {
      this.path.shift([place[0] - this.way[0], place[1] - this.way[1], place[2] - this.way[2]]);
    }
    this.isPlaced = true;
    this.way = place;
    this.trail = [];
    this.edition += 1;
  }

  /** What is told for one axis after the other, by their indices. */
  byIndex(told: readonly number[]): number[] {
    const steps: number[] = [];
    const axes = this.view?.axes ?? this.about.axes;
    told.forEach((value, i) => (steps[axes[i]?.index ?? i] = value));
    return steps;
  }

  private place(steps: readonly number[]): Place {
    const [x, y, z] = this.spatial.map((index) => steps[index] ?? 0);
    return [x!, y!, z!];
  }

  private presses(name: string, active: boolean): void {
    if (active) this.switches.add(name);
    else this.switches.delete(name);
  }

  private hearOne(entry: Entry): void {
    switch (entry.kind) {
      case "command":
        if (entry.mnemonic === "PU") this.head = "up";
        if (entry.mnemonic === "PD") this.head = "down";
        if (entry.mnemonic === "!OI") this.ball = true;
        if (entry.mnemonic === "!CI" || entry.mnemonic === "IN") this.ball = false;
        if (entry.command !== undefined) {
          this.commands.set(entry.command, entry.bytes ?? "");
          if (this.commands.size > 1_000) this.commands.delete(this.commands.keys().next().value!);
        }
        return;
      case "line":
        this.line = {
          mnemonic: entry.mnemonic ?? "",
          bytes: this.view?.details.program?.lines[entry.line ?? -1] ?? "",
        };
        return;
      case "switch":
        return this.presses(`${entry.axis}${entry.positive ? "+" : "-"}`, entry.active ?? false);
      case "motion":
        this.moves(entry);
        return;
      case "news":
        // It stands at another moment: the motion that was drawn is not the one that goes on there.
        if (entry.about?.deed === "restore") [this.trail, this.began] = [[], null];
    }
  }

  /** Counters are set to zero now and then, carriages are not: each motion goes on where the last ended. */
  private moves(entry: Entry): void {
    if (entry.motion === "begins") {
      this.trail = this.isPlaced ? [this.way] : [];
      this.began = entry.from ? this.place(entry.from) : null;
    }
    if (entry.motion === "ends") this.began = null;
    if (entry.motion !== "ends" || !entry.points || !entry.from) return;
    const from = this.place(entry.from);
    const by = this.way.map((at, i) => at - from[i]!);
    const places = entry.points.map((point): Place => {
      const place = this.place(point);
      return [place[0] + by[0]!, place[1] + by[1]!, place[2] + by[2]!];
    });
    this.path.add(this.kindOf(entry), places);
    this.way = places.at(-1) ?? this.way;
    this.trail = [];
  }

  private kindOf(entry: Entry): Kind {
    const sent = entry.command === undefined ? undefined : this.commands.get(entry.command);
    const mnemonic = entry.mnemonic ?? this.line.mnemonic;
    if (REFERENCES.has(mnemonic)) return "reference";
    if (ARCS.has(mnemonic)) return "arc";
    if (this.about.family === "lpkf") {
      // What no command has asked for is a machine that homes by itself when it is switched on.
      if (!mnemonic && !this.ball) return "reference";
      return this.head === "up" ? "rapid" : "feed";
    }
    // An isel controller knows no rapid: it is a move with the speed that a job has for it, or with
    // the highest one.
    const numbers = MOVES.exec(sent ?? this.line.bytes)?.[1]?.split(",").map(Number) ?? [];
    const rapid = Math.min(this.profile.job?.rapid_velocity ?? Infinity, this.model.limits?.speed_max ?? Infinity);
    const isRapid = numbers.some((speed, i) => i % 2 === 1 && speed >= rapid && numbers[i - 1] !== 0);
    return isRapid ? "rapid" : "feed";
  }
}
