// A real controller at a serial port of this computer (Web Serial), beside the virtual one.
import type { App, Part } from "../src/app";
import { card, h, mark, put, Rebuilt } from "../src/dom";
import type { Machine } from "../src/machine";
import { figure } from "../src/words";
import { escaped, recorded, saidSince, verdict, type Exchange, type Passed } from "./exchange";
import { keep } from "./files";
import { tell } from "./words";

/** What is used of Web Serial, which the types of browsers do not have yet. */
interface Port {
  readonly readable: ReadableStream<Uint8Array> | null;
  readonly writable: WritableStream<Uint8Array> | null;
  open(options: { baudRate: number }): Promise<void>;
  close(): Promise<void>;
}
interface Serial {
  requestPort(): Promise<Port>;
}
const serial = (navigator as unknown as { serial?: Serial }).serial;

const RATES = [19_200, 9_600, 4_800, 2_400, 38_400, 57_600, 115_200];
/** STOP in one byte; it acts at once, whatever waits. */
const BREAK = 253;
/** So long after the last byte an answer counts as whole, in ms. */
const QUIET = 300;
/** Whoever presses STOP learns after so long that it has not gone out, and who closes a port that it is not closed; ms. */
const PATIENCE = 500;

/** Of what is said to one line so many bytes are shown and compared; answers are far shorter. */
const SHOWN = 4_096;
/** So much of a conversation is kept, in bytes, and what each piece of it costs besides. */
const KEPT = 32_000_000;
const PIECE = 64;

/** The line to a real controller: what went over it, and what it said to each line of the virtual one. */
class Line {
  readonly exchanges: Exchange[] = [];
  readonly passed: Passed[] = [];
  readonly began = Date.now();
  /** When the last byte came, by the clock of the page. */
  heard = 0;
  /** So often the line was disturbed. */
  errors = 0;
  /** More was said than is kept. */
  isFull = false;
  private size = 0;
  private readonly first = performance.now();
  private sentAt = 0;
  private bytes: number[] = [];
  private reader: ReadableStreamDefaultReader<Uint8Array> | null = null;
  private reading: Promise<void> = Promise.resolve();
  /** What writes, and to which stream; after an error there is another one. */
  private writer: { of: WritableStream<Uint8Array>; it: WritableStreamDefaultWriter<Uint8Array> } | null = null;
  /** So many pieces have not gone out yet. */
  private unsent = 0;
  private isClosing = false;

  constructor(
    private readonly port: Port,
    private readonly onChange: (isGone: boolean) => void,
  ) {}

  async open(baudRate: number): Promise<void> {
    await this.port.open({ baudRate });
    this.reading = this.read();
  }

  private since(): number {
    return Math.round((performance.now() - this.first) * 1e6);
  }

  /** Sends bytes, behind those that have not gone out yet; a line begins an exchange. */
  async send(bytes: number[], line: string | null, isApart = false): Promise<void> {
    const { writable } = this.port;
    if (!writable || this.isClosing) throw new Error(tell("portGone"));
    if (this.writer?.of !== writable) this.writer = { of: writable, it: writable.getWriter() };
    if (line !== null) {
      const nothing = () => ({ bytes: "", after: null });
      this.bytes = [];
      this.exchanges.push({ line, real: nothing(), virtual: nothing(), causes: [], isApart });
      this.sentAt = performance.now();
    }
    this.keep(bytes.length, { at: this.since(), in: String.fromCharCode(...bytes) });
    this.unsent += 1;
    try {
      await this.writer.it.write(Uint8Array.from(bytes));
    } finally {
      this.unsent -= 1;
    }
  }

  /** Sends STOP. What has not gone out yet does not go before it, and not at all any more. */
  async stop(): Promise<void> {
    if (this.unsent > 0) await this.giveUpSending();
    await this.send([BREAK], null);
  }

  /** A port that has been told so throws away what it has not sent, and has another stream then. */
  private async giveUpSending(): Promise<void> {
    const { writer, unsent } = this;
    this.writer = null;
    if (!writer) return;
    const given = unsent > 0 ? writer.it.abort(new Error(tell("cutOff"))) : null;
    writer.it.releaseLock();
    await given;
  }

  private async read(): Promise<void> {
    let last: ReadableStream<Uint8Array> | null = null;
    // After an error of the line, such as a wrong stop bit, there is another stream; after the last one none.
    while (this.port.readable && this.port.readable !== last && !this.isClosing) {
      last = this.port.readable;
      this.reader = last.getReader();
      try {
        for (;;) {
          const { value, done } = await this.reader.read();
          if (done) break;
          this.take(value);
        }
      } catch {
        this.errors += 1;
        this.onChange(false);
      } finally {
        this.reader.releaseLock();
      }
    }
    // So that it can be opened again.
    if (!this.isClosing) await this.shut().catch(() => {});
    this.onChange(true);
  }

  private take(bytes: Uint8Array): void {
    this.heard = performance.now();
    this.keep(bytes.length, { at: this.since(), out: Array.from(bytes, (byte) => String.fromCharCode(byte)).join("") });
    this.bytes.push(...bytes.subarray(0, SHOWN - this.bytes.length));
    const exchange = this.exchanges.at(-1);
    if (exchange) exchange.real = { bytes: escaped(this.bytes), after: this.heard - this.sentAt };
    this.onChange(false);
  }

  private keep(bytes: number, piece: Passed): void {
    this.size += bytes + PIECE;
    this.isFull ||= this.size > KEPT;
    if (!this.isFull) this.passed.push(piece);
  }

  async close(): Promise<void> {
    this.isClosing = true;
    await this.reader?.cancel().catch(() => {});
    await this.reading;
    await this.shut();
  }

  /** A port that somebody writes to, or reads from, cannot be closed. What has not gone out may take its time to be given up. */
  private async shut(): Promise<void> {
    void this.giveUpSending().catch(() => {});
    await this.port.close();
  }
}

/** The line that is open, and what there was; it outlives the page being built again in another language. */
export class Beside {
  isShown = false;
  line: Line | null = null;
  /** The line that there was last: what it has said stays to be read and saved. */
  kept: Line | null = null;
  /** Where the line that was sent last stands in what the virtual controller tells. */
  since = 0;
  sentAt = 0;
  /** The exchange that has been asked about. */
  asked: Exchange | null = null;
  /** A port that is being closed: it cannot be opened before. */
  closing: Promise<void> = Promise.resolve();
  /** STOP has not gone out. */
  isUnstopped = false;
  /** What the virtual controller says from now on is not of the line that was sent last. */
  isParted = false;
}

/** Gives a line to both controllers, and says whether it could. While something else is given to the virtual one besides,
    what they say is not compared. */
export async function give(app: App, it: Beside, text: string, isBusy: boolean): Promise<boolean> {
  if (!it.line || !app.machine) return false;
  const { machine } = app;
  try {
    const bytes = [...text, "\r"].map((letter) => letter.charCodeAt(0));
    if (bytes.some((byte) => byte > 255)) throw new Error(text);
    [it.since, it.isParted] = [machine.entries.at(-1)?.number ?? 0, isBusy];
    const clock = app.api.get<{ now: number }>(`/controllers/${machine.number}/clock`);
    const [, isPosted] = await Promise.all([it.line.send(bytes, text, isBusy), app.post(text), clock.then(({ now }) => (it.sentAt = now))]);
    return isPosted;
  } catch (error) {
    app.say(error);
    return false;
  } finally {
    app.changed();
  }
}

/** Waits for something, but no longer than patience lasts; says whether it has come. */
function patiently(what: Promise<unknown>): Promise<boolean> {
  return Promise.race([what.then(() => true), new Promise<boolean>((resolve) => setTimeout(resolve, PATIENCE, false))]);
}

export function serialPart(app: App, it: Beside): Part & { open(): void } {
  const rate = h("select", { attrs: { "aria-label": tell("baud") } }, ...RATES.map((baud) => h("option", { value: String(baud) }, figure(baud))));
  const ready = h("input", { type: "checkbox", onchange: () => app.changed() });
  const connect = h("button", { disabled: true, onclick: () => void toggle() }, tell("connect"));
  const field = h("input", { type: "text", spellcheck: false, autocomplete: "off", placeholder: "@0P", attrs: { "aria-label": tell("lineForBoth") } });
  const send = h("button", { type: "submit" }, tell("toBoth"));
  // Neither sends what stands in the field.
  const stop = h("button", { type: "button", class: "alarm", onclick: () => void halt() }, tell("breakBoth"));
  const save = h("button", { type: "button", onclick: () => void saveIt() }, tell("save"));
  const body = h("tbody");
  const rows = new Rebuilt(body);
  const table = h("table", { class: "exchanges", attrs: { "aria-label": tell("comparison") } },
    h("thead", {}, h("tr", {}, ...[tell("sent"), tell("realSays"), tell("virtualSays"), tell("difference")].map((text) => h("th", { scope: "col" }, text)))), body);
  const submit = (event: Event) => {
    event.preventDefault();
    if (field.value !== "") void app.send(field.value).then((isGiven) => isGiven && (field.value = ""));
  };
  const form = h("form", { class: "bar", onsubmit: submit }, field, send, stop, save);
  const state = h("p", { class: "note", attrs: { role: "status" } });
  const element = card("real", tell("real"),
    h("p", { class: "note" }, tell("realAbout")),
    ...(serial
      ? [h("p", { class: "note" }, `${tell("danger")} @0P.`),
        h("div", { class: "bar" }, h("label", {}, `${tell("baud")} `, rate), h("label", { class: "tick" }, ready, tell("understood")), connect), form, state,
        table, h("p", { class: "note" }, tell("tolerance"))]
      : [h("p", { class: "note" }, tell("noSerial"))]));
  element.hidden = !it.isShown;

  const toggle = async () => {
    if (it.line) {
      it.closing = it.line.close();
      it.line = null;
      if (!await patiently(it.closing).catch(() => false)) app.onNotice(tell("portBusy"), true, true);
      return app.changed();
    }
    try {
      const port = await serial!.requestPort();
      await patiently(it.closing).catch(() => {});
      const opened = new Line(port, (isGone) => {
        if (isGone && it.line === opened) {
          it.line = null;
          app.onNotice(tell("portGone"), true, true);
        }
        app.changed();
      });
      await opened.open(Number(rate.value));
      it.line = it.kept = opened;
      it.isUnstopped = false;
    } catch (error) {
      // Nobody has chosen a port.
      if (!(error instanceof DOMException && error.name === "NotFoundError")) app.say(error);
    }
    app.changed();
  };

  const halt = async () => {
    const { line } = it;
    // Neither waits for the other.
    void app.act((path) => app.api.post(`${path}/line`, { send: String.fromCharCode(BREAK) }));
    if (line) {
      const stopped = line.stop();
      it.isUnstopped = !await patiently(stopped).catch(() => false);
      if (it.isUnstopped) {
        app.onNotice(tell("notStopped"), true, true);
        // It may still come to that.
        stopped.then(() => {
          it.isUnstopped = false;
          app.onNotice(tell("stoppedLate"), true, true);
        }, () => {});
      }
    }
    app.changed();
  };
  const text = async (): Promise<string> => {
    const virtual = await app.api.get<string>(`/controllers/${app.machine!.number}/recording`);
    return recorded(virtual, it.kept!.passed, "serial", Math.floor(it.kept!.began / 1_000));
  };
  const saveIt = async () => {
    try {
      if (it.kept) keep("real.jsonl", await text());
    } catch (error) {
      app.say(error);
    }
  };
  /** Asks once for each exchange that differs which quirk would explain it. */
  const explain = async (exchange: Exchange) => {
    it.asked = exchange;
    try {
      const { model, machine } = app.machine!.about;
      exchange.causes = await app.api.post<string[]>("/causes", { model, machine, passed: it.kept!.passed });
    } catch {
      // Then none is known.
    }
    app.changed();
  };

  const WORDS = { same: "same", bytes: "bytesDiffer", time: "timesDiffer", open: "noAnswerYet", apart: "apart" } as const;
  return {
    element,
    open() {
      it.isShown = true;
      element.hidden = false;
      element.scrollIntoView({ block: "nearest" });
      element.querySelector<HTMLElement>("button, select")?.focus();
      app.changed();
    },
    show(machine: Machine) {
      if (!serial || element.hidden) return;
      put(connect, tell(it.line ? "disconnect" : "connect"));
      connect.disabled = !it.line && !ready.checked;
      rate.disabled = it.line !== null;
      stop.disabled = it.line === null;
      // What is sent into the past of the virtual one goes to no machine.
      field.disabled = send.disabled = it.line === null || (app.past?.isOpen ?? false);
      save.disabled = !it.kept || it.kept.passed.length === 0;
      const exchanges = it.kept?.exchanges ?? [];
      const last = exchanges.at(-1);
      if (last && it.line) {
        const live = app.machine ?? machine;
        const sent = live.entries.find(({ kind, number }) => kind === "command" && number > it.since);
        if (!it.isParted) last.virtual = saidSince(live.entries, it.since, sent?.at ?? it.sentAt);
        const isQuiet = performance.now() - it.line.heard > QUIET;
        if (verdict(last, true) === "bytes" && it.asked !== last) {
          if (isQuiet) void explain(last);
          // Where nothing moves nothing is told, and nothing drawn, when it has become quiet.
          else setTimeout(() => app.changed(), QUIET);
        }
      }
      const said = last ? `${last.line}: ${tell(WORDS[verdict(last, true)])}` : "";
      const errors = it.kept?.errors ? `${figure(it.kept.errors)} ${tell("lineErrors")}` : said;
      put(state, it.isUnstopped ? tell("notStopped") : it.kept?.isFull ? tell("full") : errors);
      state.classList.toggle("alarm", it.isUnstopped);
      rows.from(exchanges, () => exchanges.map((exchange) => {
        const found = verdict(exchange, exchange === last);
        const cell = ({ bytes, after }: Exchange["real"]) =>
          h("td", {}, h("code", {}, bytes), h("span", { class: "note" }, after === null ? tell("noAnswerYet") : `${figure(after, after < 10 ? 1 : 0)} ms`));
        const causes = exchange.causes.map((cause) => h("span", { class: "cause" }, h("code", {}, cause), ` ${tell("wouldExplain")}`));
        return h("tr", { attrs: { "data-verdict": found } }, h("th", { scope: "row" }, h("code", {}, exchange.line)), cell(exchange.real), exchange.isApart ? h("td") : cell(exchange.virtual),
          h("td", {}, tell(WORDS[found]), ...causes));
      }));
      mark(table, "data-exchanges", String(exchanges.length));
    },
  };
}
