// What runs in the page: which controller and machine, files that are opened, and the link to a moment.
import { Problem } from "../src/api";
import { reason, type App, type Part } from "../src/app";
import { h, mark, put } from "../src/dom";
import { read } from "../src/film";
import type { Machine } from "../src/machine";
import { keep, kindOf, textOf, Unread } from "./files";
import type { Here } from "./here";
import { written } from "./link";
import type { Told } from "./session";
import { Work, type Piece } from "./work";
import { seconds } from "../src/words";
import { tell, type Word } from "./words";

/** Longer addresses are cut by some programs. */
const LONG = 8_000;
/** The status of what only the rest of the page can do, which did not come. */
const LATE = 503;

/** What is shown of it, whatever language the page is in. */
export class Bench {
  work: Work | null = null;
  models: string[] = [];
  machines: string[] = [];
  examples: { name: string; model: string; machine: string }[] = [];
  /** A recording is open, which is too much for a link. */
  isOpened = false;
  told: Pick<Told, "model" | "machine"> = { model: "imc4", machine: "mill" };
  /** What was chosen. It is not there yet where the rest of the page is waited for, or did not come. */
  wanted = this.told;
  /** A file begins to be carried out. */
  onWork: () => void = () => {};
  /** Another controller has taken the place of the one that was there. */
  onOther: () => void = () => {};
  /** So often something else has taken the place of what was there, and the last time that it may yet do so. */
  private turn = 0;
  private turning: Promise<unknown> = Promise.resolve();

  constructor(
    readonly app: App,
    readonly here: Here,
  ) {}

  async load(): Promise<void> {
    const { api } = this.app;
    [this.models, this.machines, this.examples] = await Promise.all([
      api.get<string[]>("/models"), api.get<string[]>("/machines"),
      fetch("examples.json").then((answer) => answer.json()).catch(() => []),
    ]);
  }

  /** A file is being carried out. */
  get isWorking(): boolean {
    return this.work !== null && !this.work.isOver;
  }

  /** Puts another controller in the place of the one that is there, for which what was carried out is given up. If that
      cannot be, nothing has changed. */
  private async replace<T>(path: string, by: unknown): Promise<T> {
    const { app, work } = this;
    // What comes next of a file is not for that other controller.
    if (work) work.isHeld = true;
    const asked = app.api.ask<T>("PUT", path, by);
    this.turning = asked.catch(() => {});
    try {
      const answer = await asked;
      this.turn += 1;
      this.onOther();
      work?.giveUp();
      if (this.work === work) this.work = null;
      return answer;
    } finally {
      if (work) work.isHeld = false;
    }
  }

  /** Another session takes the place of the one that is there; returns its turn. */
  async begin(told: Told): Promise<number> {
    const { app } = this;
    const wanted = (this.wanted = { model: told.model, machine: told.machine });
    const { refused } = await this.replace<{ refused: string[] }>("/session", told).catch((error) => {
      if (this.wanted === wanted) this.wanted = this.told;
      throw error;
    });
    const { turn } = this;
    this.told = wanted;
    this.isOpened = false;
    if (app.film) app.unplay();
    await this.here.meet();
    if (refused.length > 0) app.onNotice(`${tell("otherwise")}: ${refused.join("; ")}`, true);
    else if (told.deeds.length > 0) app.onNotice(tell("atMoment"), false, true);
    app.changed();
    return turn;
  }

  async choose(change: Partial<Pick<Told, "model" | "machine">>): Promise<void> {
    const { app } = this;
    app.onNoticeOver();
    const wanted = { ...this.wanted, ...change };
    try {
      await this.begin({ ...wanted, deeds: [], at: 0 });
      history.replaceState(null, "", location.pathname + location.search);
    } catch (error) {
      if (!(error instanceof Problem) || error.status !== LATE) return app.say(error);
      // It stays chosen, so that it can be begun when the rest of the page can be had.
      if (this.wanted === this.told) this.wanted = wanted;
      app.onNotice(reason(error), true, false, `${wanted.model} ${tell("needsRest")}`);
      app.changed();
    }
  }

  /** Opens a file, for the controller that is there; or for that which was there at a `turn`. */
  async open(name: string, file: Blob, turn = this.turn): Promise<void> {
    const { app } = this;
    const refuse = (why: Word) => app.onNotice(`${name}: ${tell(why)}`, true, true);
    try {
      const { text, isTorn } = await textOf(file);
      const kind = kindOf(name, text);
      // What was said was said of something else.
      app.onNoticeOver();
      if (isTorn && !text.includes("\n")) return refuse("tornHead");
      if (text.trim() === "") return refuse("emptyFile");
      // Half a job is none.
      if (isTorn && kind !== "recording") return refuse("tornFile");
      if (kind === "unknown") return refuse("unknownFile");
      if (kind === "film") {
        // As what is in a template nothing of that page is carried out, its style neither.
        const page = h("template");
        page.innerHTML = text;
        const film = await read(page.content);
        if (!film) return refuse("unknownFile");
        return app.play(film);
      }
      if (kind === "recording") {
        const { torn, is_whole, differs } = await this.replace<{ torn: number | null; is_whole: boolean; differs: number | null }>("/recording", { text });
        this.isOpened = true;
        if (app.film) app.unplay();
        await this.here.meet();
        const missing = isTorn || torn !== null ? tell("torn") : is_whole ? "" : tell("endless");
        const apart = differs === null ? "" : `${tell("differs")} ${seconds(differs)}.`;
        const said = [`${name}: ${tell("recordingOpen")}`, missing, apart].filter(Boolean).join(" ");
        return app.onNotice(said, missing + apart !== "", true);
      }
      if (app.film) {
        app.unplay();
        await this.here.meet();
      }
      const asked = app.api.post<{ pieces: Piece[] }>(`/controllers/${app.machine!.number}/work`, { name, text });
      await asked.catch(() => {});
      // It may have waited for the rest of the page, while another controller was chosen.
      await this.turning;
      if (turn !== this.turn) return app.onNotice(`${name} ${tell("givenUp")}`, true, true);
      const { pieces } = await asked;
      this.work?.giveUp();
      this.work = new Work(name, pieces, app);
      this.onWork();
    } catch (error) {
      if (error instanceof Problem) app.say(error);
      else if (error instanceof Unread) app.onNotice(`${name}: ${error.message}`, true, true);
      else app.onNotice(`${name}: ${error instanceof Error ? error.message : String(error)}`, true);
    }
  }

  async openExample(name: string): Promise<void> {
    const example = this.examples.find((one) => one.name === name);
    if (!example) return;
    try {
      const answer = await fetch(`examples/${name}`);
      const { model, machine } = example;
      let { turn } = this;
      if (model && (model !== this.told.model || machine !== this.told.machine || this.app.film)) {
        turn = await this.begin({ model, machine, deeds: [], at: 0 });
      }
      await this.open(name, await answer.blob(), turn);
    } catch (error) {
      this.app.say(error);
    }
  }

  /** Puts the link to what is looked at into the address, and where it can be pasted from. */
  async share(): Promise<void> {
    const { app } = this;
    try {
      const link = await written(await app.api.get<Told>("/session"));
      history.replaceState(null, "", link);
      const isCopied = await navigator.clipboard?.writeText(location.href).then(() => true, () => false);
      app.onNotice(tell(location.href.length > LONG ? "longLink" : isCopied ? "shared" : "sharedHere"), false, true);
    } catch (error) {
      app.say(error);
    }
  }

  async save(): Promise<void> {
    const { app } = this;
    await app.act(async (path) => {
      const text = await app.api.get<string>(`${path}/recording`);
      keep(`${app.machine?.about.model ?? "session"}.jsonl`, text);
    });
  }
}

/** A list of things to do, which shows what it is for. */
function menu(text: string, choose: (value: string) => void): HTMLSelectElement {
  const select = h("select", { attrs: { "aria-label": text } });
  select.onchange = () => {
    const { value } = select;
    select.selectedIndex = 0;
    if (value !== "") choose(value);
  };
  return select;
}

export function benchPart(bench: Bench, more: { tours: [string, string][]; take: (tour: string) => void; real: () => void }): Part {
  const { app } = bench;
  const option = (value: string, text = value) => h("option", { value }, text);
  const model = h("select", { class: "model" }, ...bench.models.map((name) => option(name)));
  const machine = h("select", { class: "machine-of" }, ...bench.machines.map((name) => option(name)));
  model.onchange = () => void bench.choose({ model: model.value });
  machine.onchange = () => void bench.choose({ machine: machine.value });
  const file = h("input", { type: "file", hidden: true, attrs: { "aria-label": tell("openFile") } });
  file.onchange = () => {
    const chosen = file.files?.[0];
    if (chosen) void bench.open(chosen.name, chosen);
    file.value = "";
  };
  const examples = menu(tell("examples"), (name) => void bench.openExample(name));
  examples.append(option("", tell("examples")), ...bench.examples.map(({ name }) => option(name)));
  const tours = menu(tell("tours"), more.take);
  tours.className = "tours";
  tours.append(option("", tell("tours")), ...more.tours.map(([name, title]) => option(name, title)));
  const share = h("button", { class: "share", onclick: () => void bench.share() }, tell("share"));
  const back = h("button", { onclick: () => void bench.choose({}) }, tell("backToDesk"));
  const status = h("p", { class: "note", attrs: { role: "status" } });
  const goOn = h("button", { onclick: () => bench.work?.goOn() }, tell("goOn"));
  const giveUp = h("button", { onclick: () => bench.work?.giveUp() }, tell("giveUp"));
  const element = h("section", { class: "bench", attrs: { "aria-label": tell("desk") } },
    h("div", { class: "bar" },
      h("label", {}, `${tell("controller")} `, model), h("label", {}, `${tell("machine")} `, machine),
      h("button", { onclick: () => void bench.choose({}) }, tell("begin")),
      h("button", { onclick: () => file.click() }, tell("openFile")), file, examples,
      share,
      h("button", { onclick: () => void bench.save() }, tell("save")), tours,
      h("button", { class: "real-one", onclick: more.real }, `${tell("real")} …`), back),
    h("div", { class: "bar" }, status, goOn, giveUp));
  return {
    element,
    show(_: Machine) {
      const { work, wanted } = bench;
      if (document.activeElement !== model) model.value = wanted.model;
      if (document.activeElement !== machine) machine.value = wanted.machine;
      back.hidden = app.film === undefined;
      share.disabled = app.film !== undefined || bench.isOpened;
      const states = {
        goes: () => {
          const isPaused = (app.past?.isOpen || app.machine?.clock?.paused) && tell("isPaused");
          return `${work!.name} ${tell("carriesOut")} ${work!.line}${isPaused || work!.reason ? `: ${isPaused || work!.reason}` : ""}`;
        },
        asks: () => `${work!.name} ${tell("waits")}: ${work!.reason}`,
        done: () => `${work!.name} ${tell("carriedOut")}`,
        refused: () => `${work!.name} ${tell("stoppedAt")} ${work!.line}: ${work!.reason}`,
        ended: () => `${work!.name} ${tell("stoppedAt")} ${work!.line}`,
      };
      put(status, work ? states[work.state]() : "");
      mark(status, "data-state", work?.state ?? null);
      goOn.hidden = work?.state !== "asks";
      giveUp.hidden = !work || work.isOver;
    },
  };
}

/** Whatever is dropped on the page is opened. */
export function takeDrops(bench: Bench): void {
  const veil = h("div", { class: "veil", hidden: true }, tell("drop"));
  const isFile = (event: DragEvent) => event.dataTransfer?.types.includes("Files") ?? false;
  addEventListener("dragover", (event) => {
    if (!isFile(event)) return;
    event.preventDefault();
    put(veil, tell("drop"));
    if (!veil.isConnected) document.body.append(veil);
    veil.hidden = false;
  });
  addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) veil.hidden = true;
  });
  addEventListener("drop", (event) => {
    veil.hidden = true;
    const file = event.dataTransfer?.files[0];
    if (!file) return;
    event.preventDefault();
    void bench.open(file.name, file);
  });
}
