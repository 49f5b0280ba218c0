// The state of the page: which controllers there are, which one is looked at, and whether their source
// is there. Parts of the page are told when something has changed, at most once for each frame.
import { Api, Problem } from "./api";
import type { About, Breakpoint, Clock, Entry, Fault, MachineProfile, ModelProfile, Rule, Signal, Snapshot, Source, View } from "./api";
import { Machine } from "./machine";
import type { Differing } from "./differing";
import type { Film } from "./film";
import { Past } from "./past";
import type { Tale } from "./way";
import { say } from "./words";

/** A part of the page. */
export interface Part {
  element: HTMLElement;
  show(machine: Machine): void;
  /** It will not be seen again. */
  leave?(): void;
}

/** What was wrong, and what would be right. */
export function reason(error: unknown): string {
  const remedy = error instanceof Problem && error.remedy ? ` — ${error.remedy}` : "";
  return `${error instanceof Error ? error.message : String(error)}${remedy}`;
}

/** So long after something has happened the view is asked for, at most once in that time; ms. */
const LOOKS = 150;

export class App {
  readonly api: Api;
  machines: Machine[] = [];
  isConnected = false;
  /** What the page says of the last order: in English, unless it is one of its own words. */
  onNotice: (text: string, isError: boolean, isOwn?: boolean, lead?: string) => void = () => {};
  /** What it has said is no longer so. */
  onNoticeOver: () => void = () => {};
  /** Something is done, so that what was refused before is over. */
  onTry: () => void = () => {};
  onChange: () => void = () => {};
  onNewMachines: () => void = () => {};
  /** What a line means, said before it is sent, where somebody can say it. */
  means: ((line: string) => Promise<string>) | null = null;
  /** Gives a line to whoever has to have it. */
  give: (line: string) => Promise<boolean> = (line) => this.post(line);
  /** Asks a person for the token. */
  askToken: () => Promise<string> = () => Promise.reject(new Error("no token"));

  private pasts = new Map<number, Past>();
  /** A recording that the page has in it. */
  film: Film | undefined;
  /** Shows where the recording that is open contradicts the emulation. */
  differing: Differing | undefined;
  private chosen = 1;
  private isDrawn = true;
  /** The page has said that nobody answers. */
  private isUnanswered = false;
  /** Who is to be looked at soon, and who is being looked at. */
  private due = new Set<number>();
  private looking = new Set<number>();

  constructor(private readonly source: Source) {
    this.api = new Api(source);
  }

  /** Shows a recording, and asks nobody. */
  play(film: Film): void {
    this.film = film;
    this.machines = [film.machine];
    this.isConnected = true;
    film.shownBy(() => this.changed());
    this.onNewMachines();
  }

  /** Shows the source again, which meets the page anew. */
  unplay(): void {
    this.film = undefined;
    this.machines = [];
  }

  start(): void {
    this.source.follow({
      wish: () => this.meet(),
      connected: (is) => {
        this.isConnected = is;
        // At once, so that nothing is shown empty for longer than it has to be.
        if (is && this.isUnanswered) this.onNoticeOver();
        if (is) this.isUnanswered = false;
        if (is) for (const { number } of this.machines) void this.lookNow(number);
        this.changed();
      },
      entries: (number, entries) => {
        this.of(number)?.hear(entries);
        this.look(number);
        this.changed();
      },
      gap: (number, from, to) => {
        this.of(number)?.gap(from, to);
        this.changed();
      },
      looked: (number) => this.look(number),
      position: (position) => {
        this.of(position.controller)?.isAt(position);
        this.changed();
      },
      refused: (detail) => this.onNotice(detail, true),
    });
  }

  get machine(): Machine | undefined {
    return this.of(this.chosen) ?? this.machines[0];
  }

  /** The past of the controller that is looked at. */
  get past(): Tale | undefined {
    return this.film ?? (this.machine && this.pasts.get(this.machine.number));
  }

  /** Fetches what shows differences, once there are any. */
  async differ(): Promise<void> {
    if (this.differing) return;
    const { Differing } = await import("./differing");
    this.differing ??= new Differing(this);
    this.changed();
  }

  /** The machine that is shown: as it is, or as it was at the moment that is looked at. */
  get shown(): Machine | undefined {
    return this.past?.shown ?? this.machine;
  }

  choose(number: number): void {
    this.chosen = number;
    this.onTry();
    this.look(number);
    this.changed();
  }

  /** Orders something of the controller that is looked at, and says what came of it. */
  async order(text: string): Promise<void> {
    if (this.past?.isOpen) return void (await this.past.do({ order: text }));
    await this.act(async (path) => {
      const { text: answer } = await this.api.post<{ text: string }>(`${path}/orders`, { order: text });
      this.onNotice(`${text}: ${answer}`, false);
    });
  }

  /** Sends a line, as the host does, and says whether it could. */
  async send(line: string): Promise<boolean> {
    if (this.past?.isOpen) {
      const { isNow } = this.past;
      const isDone = await this.past.do({ send: `${line}\r` });
      if (isDone && isNow) this.onNotice(say("waitsForLeaving"), false, true);
      return isDone;
    }
    const isGiven = await this.give(line);
    // Nothing is seen of it before time goes on.
    if (isGiven && this.machine?.clock?.paused) this.onNotice(say("waitsForResume"), false, true);
    return isGiven;
  }

  /** Sets a signal. It is shown so at once: another click is about what is seen. */
  async set(name: string, value: number): Promise<void> {
    if (this.past?.isOpen) return void (await this.past.do({ order: `set ${name} ${value}` }));
    const signal = this.machine?.signals.find((signal) => signal.name === name);
    if (signal) signal.value = value;
    this.changed();
    await this.act((path) => this.api.ask("PUT", `${path}/signals/${encodeURIComponent(name)}`, { value }));
  }

  /** Does something with the controller that is looked at; what is wrong is said on the page. Says
      whether it was done. */
  async act(deed: (path: string) => Promise<unknown>): Promise<boolean> {
    const machine = this.machine;
    if (!machine) return false;
    this.onTry();
    try {
      await deed(`/controllers/${machine.number}`);
      return true;
    } catch (error) {
      this.say(error);
      return false;
    } finally {
      this.look(machine.number);
    }
  }

  /** Gives a line to the controller that is looked at. */
  post(line: string): Promise<boolean> {
    return this.act((path) => this.api.post(`${path}/line`, { send: `${line}\r` }));
  }

  say(error: unknown): void {
    if (error instanceof Problem && error.status === 0) {
      this.isUnanswered = true;
      return this.onNotice(say("noAnswer"), true, true);
    }
    // What the program says is English.
    this.onNotice(reason(error), true, false, say("refused"));
  }

  changed(): void {
    if (!this.isDrawn) return;
    this.isDrawn = false;
    requestAnimationFrame(() => {
      this.isDrawn = true;
      this.onChange();
    });
  }

  private of(number: number): Machine | undefined {
    // What the source tells is not of a recording.
    if (this.film) return undefined;
    return this.machines.find((machine) => machine.number === number);
  }

  /** Who is there, before each connection; goes on where it was if it is still the same server. */
  private async meet(): Promise<{ after: Record<number, number> }> {
    const about = await this.controllers();
    const after: Record<number, number> = {};
    const known = JSON.stringify(this.machines.map((machine) => machine.about));
    const isOther = known !== JSON.stringify(about);
    if (isOther) {
      this.machines = await Promise.all(
        about.map(async (one) => {
          const path = `/controllers/${one.number}`;
          return new Machine(
            one,
            await this.api.get<MachineProfile>(`${path}/machine`),
            await this.api.get<ModelProfile>(`${path}/model`),
          );
        }),
      );
      this.pasts = new Map(this.machines.map((machine) => [machine.number, new Past(this, machine)]));
    }
    for (const machine of this.machines) {
      const last = machine.entries.at(-1);
      if (last && !(await this.still(machine.number, last))) machine.forget();
      after[machine.number] = machine.entries.at(-1)?.number ?? 0;
    }
    if (isOther) this.onNewMachines();
    return { after };
  }

  private async controllers(): Promise<About[]> {
    for (;;) {
      try {
        return await this.api.get<About[]>("/controllers");
      } catch (error) {
        if (!(error instanceof Problem) || error.status !== 401) throw error;
        this.source.token = await this.askToken();
      }
    }
  }

  /** Whether the server still has this entry: another one counts from 1 again. */
  private async still(number: number, entry: Entry): Promise<boolean> {
    const path = `/controllers/${number}/journal?after=${entry.number - 1}&limit=1`;
    const { entries: [there] } = await this.api.get<{ entries: Entry[] }>(path);
    // Whatever begins anew begins at the same time.
    const SAME = ["number", "at", "kind", "command", "bytes", "text"] as const;
    return there !== undefined && SAME.every((part) => there[part] === entry[part]);
  }

  /** Asks for what is no event, soon. */
  private look(number: number): void {
    const isAsked = this.due.has(number);
    this.due.add(number);
    // What happens during a look is looked at after it.
    if (!isAsked && !this.looking.has(number)) setTimeout(() => void this.lookNow(number), LOOKS);
  }

  private async lookNow(number: number): Promise<void> {
    if (this.looking.has(number)) return;
    this.due.delete(number);
    this.looking.add(number);
    const path = `/controllers/${number}`;
    const get = <T>(name: string) => this.api.get<T>(`${path}/${name}`);
    try {
      const view = await get<View>("view");
      this.of(number)?.seen(view);
      if (number === this.machine?.number) {
        const [signals, clock, faults, rules, breakpoints, snapshots] = await Promise.all([
          get<Signal[]>("signals"), get<Clock>("clock"), get<Fault[]>("faults"), get<Rule[]>("rules"),
          get<Breakpoint[]>("breakpoints"), get<Snapshot[]>("snapshots"),
        ]);
        Object.assign(this.of(number) ?? {}, { signals, clock, faults, rules, breakpoints, snapshots });
        await this.pasts.get(number)?.look();
      }
    } catch {
      // The feed notices if the server is gone, and asks again when it is back.
    }
    this.looking.delete(number);
    if (this.due.delete(number)) this.look(number);
    this.changed();
  }
}
