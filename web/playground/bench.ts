// What runs in the page: which controller and machine, files that are opened, and the link to a moment.
import { Problem } from "../src/api";
import type { App, Part } from "../src/app";
import { h, mark, put } from "../src/dom";
import { read } from "../src/film";
import type { Machine } from "../src/machine";
import { keep, kindOf, textOf } from "./files";
import type { Here } from "./here";
import { written } from "./link";
import type { Told } from "./session";
import { Work, type Piece } from "./work";
import { tell } from "./words";

/** Longer addresses are cut by some programs. */
const LONG = 8_000;

/** What is shown of it, whatever language the page is in. */
export class Bench {
  work: Work | null = null;
  models: string[] = [];
  machines: string[] = [];
  examples: { name: string; model: string; machine: string }[] = [];
  /** A recording is open, which is too much for a link. */
  isOpened = false;
  told: Pick<Told, "model" | "machine"> = { model: "imc4", machine: "mill" };

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

  /** Another session takes the place of the one that is there. */
  async begin(told: Told): Promise<void> {
    const { app } = this;
    this.work?.giveUp();
    this.work = null;
    const { refused } = await app.api.ask<{ refused: string[] }>("PUT", "/session", told);
    this.told = { model: told.model, machine: told.machine };
    this.isOpened = false;
    if (app.film) app.unplay();
    await this.here.meet();
    if (refused.length > 0) app.onNotice(`${tell("otherwise")}: ${refused.join("; ")}`, true);
    else if (told.deeds.length > 0) app.onNotice(tell("atMoment"), false, true);
    app.changed();
  }

  async choose(change: Partial<Pick<Told, "model" | "machine">>): Promise<void> {
    try {
      await this.begin({ ...this.told, ...change, deeds: [], at: 0 });
      history.replaceState(null, "", location.pathname + location.search);
    } catch (error) {
      this.app.say(error);
    }
  }

  async open(name: string, file: Blob): Promise<void> {
    const { app } = this;
    try {
      const { text, isTorn } = await textOf(file);
      const kind = kindOf(name, text);
      // Half a job is none.
      if (isTorn && kind !== "recording") return app.onNotice(`${name}: ${tell("torn")}`, true);
      if (kind === "unknown") return app.onNotice(`${name}: ${tell("unknownFile")}`, true);
      if (kind === "film") {
        // As what is in a template nothing of that page is carried out, its style neither.
        const page = h("template");
        page.innerHTML = text;
        const film = await read(page.content);
        if (film) app.play(film);
        return;
      }
      if (kind === "recording") {
        this.work?.giveUp();
        this.work = null;
        const { torn, is_whole } = await app.api.ask<{ torn: number | null; is_whole: boolean }>("PUT", "/recording", { text });
        this.isOpened = true;
        if (app.film) app.unplay();
        await this.here.meet();
        const missing = isTorn || torn !== null ? tell("torn") : is_whole ? "" : tell("endless");
        return app.onNotice(`${name}: ${tell("recordingOpen")} ${missing}`.trim(), missing !== "");
      }
      if (app.film) {
        app.unplay();
        await this.here.meet();
      }
      const { pieces } = await app.api.post<{ pieces: Piece[] }>(`/controllers/${app.machine!.number}/work`, { name, text });
      this.work?.giveUp();
      this.work = new Work(name, pieces, app);
    } catch (error) {
      if (error instanceof Problem) app.say(error);
      else app.onNotice(`${name}: ${error instanceof Error ? error.message : String(error)}`, true);
    }
  }

  async openExample(name: string): Promise<void> {
    const example = this.examples.find((one) => one.name === name);
    if (!example) return;
    try {
      const answer = await fetch(`examples/${name}`);
      const { model, machine } = example;
      if (model && (model !== this.told.model || machine !== this.told.machine || this.app.film)) {
        await this.begin({ model, machine, deeds: [], at: 0 });
      }
      await this.open(name, await answer.blob());
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
      const { work, told } = bench;
      if (document.activeElement !== model) model.value = told.model;
      if (document.activeElement !== machine) machine.value = told.machine;
      back.hidden = app.film === undefined;
      share.disabled = app.film !== undefined || bench.isOpened;
      const states = {
        goes: () => `${work!.name} ${tell("carriesOut")} ${work!.line}${work!.reason ? `: ${work!.reason}` : ""}`,
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
