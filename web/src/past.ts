// The past of a machine: the moment of it that is looked at, and the machine as it was then. The server
// has one such moment for each controller, so all browsers look at the same.
import type { Api, Branch, Entry, History, Moment } from "./api";
import { Machine } from "./machine";
import { joined, reached, type Tale, type Way } from "./way";

/** What the page does for it. */
interface Page {
  api: Api;
  say(error: unknown): void;
  onTry(): void;
  changed(): void;
}

/** A moment, or an entry of the journal. */
type Goal = Partial<Moment> & { entry?: number };

export class Past implements Tale {
  readonly isFilm = false;
  history: History | null = null;
  /** The machine as it was, if the past is looked at. */
  shown: Machine | null = null;
  /** What happened on each branch, by its number and how far it has come. */
  readonly branches = new Map<string, Entry[]>();
  private way: { key: string; way: Way } | null = null;
  private wanted: Goal | null = null;
  /** The moment that was asked for last, until it is looked at. */
  private aimed: Goal | null = null;
  private isBusy = false;
  /** Another number after every order, so that what was asked before is not believed. */
  private orders = 0;

  constructor(
    private readonly page: Page,
    private readonly machine: Machine,
  ) {}

  get isOpen(): boolean {
    return this.history?.open ?? false;
  }

  get aim(): number | null {
    const { aimed, history } = this;
    if (aimed) return aimed.at ?? history?.now.at ?? null;
    return history?.open ? history.at : null;
  }

  /** Whether the controller itself is looked at, at its present. */
  get isNow(): boolean {
    const { history } = this;
    return !history?.open || (history.branch === history.now.branch && history.at === history.now.at);
  }

  /** The moment that a person sees, and means: somebody else may look at another one by now. */
  private get sight(): Partial<Moment> {
    const { history } = this;
    return history?.open ? { branch: history.branch, at: history.at } : {};
  }

  private get path(): string {
    return `/controllers/${this.machine.number}`;
  }

  /** What others have done with it is learnt now and then. */
  async look(): Promise<void> {
    const { orders } = this;
    const history = await this.page.api.get<History>(`${this.path}/history`);
    if (orders === this.orders && !this.isBusy) await this.takeIn(history);
  }

  /** Goes to a moment: of several that are wanted one after the other only to the last. */
  go(moment: Goal): Promise<void> {
    this.wanted = this.aimed = moment;
    return this.work();
  }

  /** The journal may have what happened on a branch that was left; the shown way has numbers of its own. */
  lookAt({ number, at }: Entry): Promise<void> {
    const branch = this.way?.way.parts.findLast(({ from }) => from < number)?.branch;
    return this.go(this.isOpen ? { branch, at } : { entry: number });
  }

  do(deed: { order: string } | { send: string }): Promise<boolean> {
    return this.ask("do", { ...deed, ...this.sight });
  }

  /** Steps in the words of the console; where the present is looked at, the controller goes along. */
  async walk(line: string): Promise<void> {
    this.page.onTry();
    this.orders += 1;
    try {
      await this.page.api.post(`${this.path}/debugger`, { line });
    } catch (error) {
      this.page.say(error);
    }
    await this.look().catch((error) => this.page.say(error));
  }

  /** Takes the controller itself here, and lets it go on. */
  async takeOver(): Promise<void> {
    if (await this.ask("take", this.sight)) await this.leave();
  }

  /** Looks at the present again, and lets the controller go on. */
  async leave(): Promise<void> {
    this.page.onTry();
    this.orders += 1;
    try {
      await this.page.api.delete(`${this.path}/debugger`);
      await this.takeIn(await this.page.api.get<History>(`${this.path}/history`));
    } catch (error) {
      this.page.say(error);
    }
  }

  private async work(): Promise<void> {
    while (this.wanted && !this.isBusy) {
      const moment = this.wanted;
      this.wanted = null;
      await this.ask("go", moment);
    }
    if (!this.isBusy) this.aimed = null;
  }

  private async ask(what: string, body?: unknown): Promise<boolean> {
    this.page.onTry();
    this.orders += 1;
    this.isBusy = true;
    let isDone = true;
    try {
      await this.takeIn(await this.page.api.post<History>(`${this.path}/history/${what}`, body));
    } catch (error) {
      this.page.say(error);
      isDone = false;
    }
    this.isBusy = false;
    await this.work();
    return isDone;
  }

  private async takeIn(history: History): Promise<void> {
    if (!history.open || !history.view) {
      [this.shown, this.way] = [null, null];
      this.branches.clear();
    } else {
      const way = await this.wayTo(history);
      this.shown ??= new Machine(this.machine.about, this.machine.profile, this.machine.model);
      this.shown.lookAt(way.entries, reached(way, history.at), history.view, this.machine.signals);
    }
    this.history = history;
    this.page.changed();
  }

  /** What happened on the way to the branch that is looked at; only what is new is asked for. */
  private async wayTo(history: History): Promise<Way> {
    const chain: { branch: Branch; entries: Entry[] }[] = [];
    let next: number | undefined = history.branch;
    const keys: string[] = [];
    while (next !== undefined) {
      const branch = history.branches.find(({ id }) => id === next);
      if (!branch) break;
      const key = `${branch.id} ${branch.end}`;
      chain.unshift({ branch, entries: await this.learn(branch) });
      keys.push(key);
      next = branch.parted?.branch;
    }
    const key = keys.join();
    if (this.way?.key !== key) this.way = { key, way: joined(chain) };
    return this.way.way;
  }

  private async learn(branch: Branch): Promise<Entry[]> {
    const key = `${branch.id} ${branch.end}`;
    const known = this.branches.get(key);
    if (known) return known;
    const path = `${this.path}/history/entries?branch=${branch.id}`;
    const { entries } = await this.page.api.get<{ entries: Entry[] }>(path);
    for (const old of this.branches.keys()) if (old.startsWith(`${branch.id} `)) this.branches.delete(old);
    this.branches.set(key, entries);
    return entries;
  }

  /** What happened on a branch, as far as it was looked at. */
  entriesOf({ id, end }: Branch): Entry[] {
    return this.branches.get(`${id} ${end}`) ?? [];
  }
}
