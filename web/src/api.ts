// The control API in the panel's words: what it answers, and how it is asked. The panel knows
// nothing of a controller that does not come from here.

/** How many units so many steps are. */
export interface Scale {
  steps: number;
  units: number;
  unit: string;
}

export interface AxisAbout {
  index: number;
  name: string;
  scale: Scale | null;
}

/** A controller, which stays the same as long as the server runs. */
export interface About {
  number: number;
  model: string;
  title: string;
  family: string;
  machine: string;
  axes: AxisAbout[];
  pty: string | null;
  tcp: string | null;
  rfc2217: string | null;
  serial: string | null;
}

export interface MachineAxis {
  reference?: string;
  negative_switch?: number | null;
  positive_switch?: number | null;
  lowest?: number | null;
  highest?: number | null;
  start?: number;
}

export interface MachineProfile {
  title: string;
  axes: Record<string, MachineAxis | null>;
  job?: { rapid_velocity?: number };
}

export interface ModelProfile {
  limits?: { speed_max?: number };
}

export interface Port {
  port: number;
  input: boolean;
  value: number;
}

export interface Program {
  status: string;
  lines: string[];
  marker: number | null;
  loops: { line?: number; begin?: number; left?: number | null }[];
}

export interface View {
  at: number;
  powered: boolean;
  activity: string;
  waits_for: string | null;
  baud: number;
  axes: { index: number; name: string; configured: boolean; position: number; carriage: number; referenced: boolean; speed: number; limits?: [boolean, boolean] }[];
  signals: { name: string; value: number | null }[];
  ports: Port[];
  details: { family: string; program?: Program | null; head?: string; motors_on?: boolean };
}

export interface Signal {
  name: string;
  kind: "button" | "switch" | "input" | { analogue: { low: number; high: number } };
  positions: string[] | null;
  latches: boolean;
  bits: [number, number][];
  terminal: string | null;
  about: string;
  value: number | null;
}

export interface Clock {
  now: number;
  clock: string;
  /** Which clocks can take its place: any speed, or those of these names. */
  changes_to: string[];
  paused: { at: number; by: string | null; breakpoints: number[] } | null;
}

export interface Fault {
  number: number;
  fault: string;
  stage: unknown;
  struck: number;
}

/** A rule of a scenario. */
export interface Rule {
  scenario: number;
  place: number;
  rule: string;
  stage: "waits" | "holds" | "over";
  acted: number;
}

export interface Breakpoint {
  id: number;
  condition: string;
  met: unknown;
}

export interface Snapshot {
  id: number;
  name: string;
  at: number;
}

/** A time on a branch of the history. */
export interface Moment {
  branch: number;
  at: number;
}

export interface Branch {
  id: number;
  name: string;
  /** What was done first on it. */
  why: string | null;
  parted: Moment | null;
  first: number;
  end: number;
}

/** The past, and the moment of it that is looked at. */
export interface History extends Moment {
  /** Whether it is looked at: the controller is paused then. */
  open: boolean;
  possible: boolean;
  first: number;
  now: Moment;
  branches: Branch[];
  view?: View;
  /** Where the emulation differs from the recording that is open. */
  differences?: Difference[];
}

/** A place at which the emulation differs from the recording. */
export interface Difference {
  branch: number;
  at: number;
  /** The line of the recording. */
  line: number;
  command: number | null;
  /** Whether the emulated controller replied; null where a state differs. */
  replies: boolean | null;
  recorded: string;
  emulated: string;
  text: string;
}

/** Something that happened. */
export interface Entry {
  number: number;
  at: number;
  kind: string;
  text?: string;
  command?: number;
  mnemonic?: string;
  bytes?: string;
  why?: string;
  motion?: "begins" | "changes" | "ends";
  from?: number[];
  points?: number[][];
  axis?: number;
  positive?: boolean;
  active?: boolean;
  line?: number;
  signal?: string | number;
  value?: number;
  about?: { deed?: string } | null;
}

export interface Position {
  controller: number;
  at: number;
  activity: string;
  moving: boolean;
  positions: number[];
  carriage: number[];
  speed: number[];
}

/** What was wrong, and what would be right. */
export class Problem extends Error {
  constructor(
    /** That of HTTP; 0 if nobody answers. */
    readonly status: number,
    detail: string,
    readonly remedy: string,
  ) {
    super(detail);
  }
}

/** What was answered, with the status that HTTP has for it. */
export interface Answer {
  status: number;
  body: unknown;
}

/** Where the controllers are that the page shows. */
export interface Source {
  /** Who asks, if it wants to know. */
  token: string | null;
  /** Answers as the control API does. It throws if nobody is there. */
  ask(method: string, path: string, body?: unknown): Promise<Answer>;
  /** Tells what happens, as it happens, and for ever. */
  follow(listener: Listener): void;
}

/** Who is told of what happens. */
export interface Listener {
  /** The source is there, or is gone. */
  connected(is: boolean): void;
  entries(controller: number, entries: Entry[]): void;
  /** These numbers are no longer to be had. */
  gap(controller: number, from: number, to: number): void;
  /** Another moment of the past may be looked at, or none any more. */
  looked(controller: number): void;
  position(position: Position): void;
  refused(detail: string): void;
  /** The numbers up to which everything is known. Asked before each connection. */
  wish(): Promise<{ after: Record<number, number> }>;
}

/** Positions a second: as smooth as an eye needs with what is drawn between them. */
const POSITIONS = 20;
/** Everything but what only coverage wants. */
const KINDS = [
  "command", "ignored", "line", "answer", "cut-short", "motion", "switch", "signal", "port", "flash",
  "baud", "fault", "rule", "warning", "news", "missed",
];

/** What a source is asked to tell. */
export const WANTED = { kinds: KINDS, positions: POSITIONS };

/** A message of a source, told to whoever listens. */
export function tell(message: { type: string } & Record<string, unknown>, listener: Listener): void {
  const controller = Number(message.controller);
  switch (message.type) {
    case "hello":
      return listener.connected(true);
    case "events":
      return listener.entries(controller, message.entries as Entry[]);
    case "gap":
      return listener.gap(controller, Number(message.from), Number(message.to));
    case "history":
      return listener.looked(controller);
    case "position":
      return listener.position(message as unknown as Position);
    case "problem":
      return listener.refused(String(message.detail ?? message.title));
  }
}

/** A client of the API, which says in words what was refused. */
export class Api {
  constructor(private readonly source: Source) {}

  async ask<T>(method: string, path: string, body?: unknown): Promise<T> {
    const answer = await this.source.ask(method, path, body).catch((error) => {
      throw new Problem(0, error instanceof Error ? error.message : String(error), "");
    });
    if (answer.status >= 200 && answer.status < 300) return answer.body as T;
    const problem = (answer.body ?? {}) as { detail?: string; title?: string; remedy?: string };
    throw new Problem(answer.status, problem.detail ?? problem.title ?? String(answer.status), problem.remedy ?? "");
  }

  get<T>(path: string): Promise<T> {
    return this.ask<T>("GET", path);
  }

  post<T>(path: string, body?: unknown): Promise<T> {
    return this.ask<T>("POST", path, body);
  }

  delete<T>(path: string): Promise<T> {
    return this.ask<T>("DELETE", path);
  }
}
