// A real controller at a serial port of this computer (Web Serial), beside the virtual one.
import type { App, Part } from "../src/app";
import { card, h, mark, put, Rebuilt } from "../src/dom";
import type { Machine } from "../src/machine";
import { figure } from "../src/words";
import { begun, byteOf, recorded, STOP, verdict, type Exchange, type Passed } from "./exchange";
import { keep } from "./files";
import { Commands, Owed, QUIET } from "./whose";
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
/** Whoever presses STOP learns after so long that it has not gone out, and who closes a port that it is not closed; ms. */
const PATIENCE = 500;

/** So much of a conversation is kept, in bytes, and what each piece of it costs besides. */
const KEPT = 32_000_000;
const PIECE = 64;

/** What is on its way to a port. */
interface Item {
  exchange: Exchange;
  bytes: number[];
  /** As it is kept, once it has come whole. */
  piece?: Passed;
  /** STOP went before it. */
  isCut?: boolean;
}

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
  /** So many pieces of it have been saved. */
  saved = 0;
  /** The port was closed, or is gone; and when it is closed. */
  isOver = false;
  closed: Promise<void> = Promise.resolve();
  readonly owed = new Owed();
  private size = 0;
  private readonly first = performance.now();
  /** What was given to the port and has not gone out yet. */
  private readonly queue: Item[] = [];
  /** Part of a line that was given up may have got there. */
  private isTorn = false;
  private reader: ReadableStreamDefaultReader<Uint8Array> | null = null;
  private reading: Promise<void> = Promise.resolve();
  /** What writes, and to which stream; after an error there is another one. */
  private writer: { of: WritableStream<Uint8Array>; it: WritableStreamDefaultWriter<Uint8Array> } | null = null;

  constructor(
    private readonly port: Port,
    private readonly onChange: (isGone: boolean) => void,
  ) {}

  async open(baudRate: number): Promise<void> {
    await this.port.open({ baudRate });
    this.reading = this.read();
  }

  private since(now: number): number {
    return Math.round((now - this.first) * 1e6);
  }

  /** A line that will be sent, or STOP. */
  begin(line: string, isApart: boolean): Exchange {
    const exchange = begun(line, isApart ? "apart" : "");
    this.exchanges.push(exchange);
    return exchange;
  }

  /** Sends STOP. What has not gone out yet does not go before it, and not at all any more. */
  async stop(exchange: Exchange): Promise<void> {
    for (const item of this.queue) item.isCut = true;
    if (this.queue.length > 0) await this.giveUpSending();
    await this.send([BREAK], exchange);
  }

  /** Sends it behind what has not gone out yet, and waits until it is out as a whole. */
  async send(bytes: number[], exchange: Exchange): Promise<void> {
    const item: Item = { exchange, bytes };
    try {
      const { writable } = this.port;
      if (!writable || this.isOver) throw new Error(tell("portGone"));
      if (this.writer?.of !== writable) this.writer = { of: writable, it: writable.getWriter() };
      this.queue.push(item);
      this.goOn();
      await this.writer.it.write(Uint8Array.from(bytes));
      this.comes(item);
      this.owed.share();
    } catch (error) {
      this.drop(item);
      throw error;
    } finally {
      const place = this.queue.indexOf(item);
      if (place >= 0) this.queue.splice(place, 1);
      this.goOn();
    }
  }

  /** The first that has not gone out is on its way. */
  private goOn(): void {
    const [first] = this.queue;
    if (!first || first.exchange.went !== "waits" || this.isOver) return;
    const { exchange } = first;
    exchange.went = "out";
    if (this.isTorn && exchange.line !== STOP) {
      exchange.apart ||= "part";
      this.isTorn = false;
    }
    this.owed.goes(exchange, performance.now());
  }

  /** It has come as a whole: from this moment on the controller can act on it, in the recording and in the table. */
  private comes(item: Item): void {
    const { bytes, exchange } = item;
    if (item.piece || exchange.went !== "out") return;
    const now = (exchange.whole = performance.now());
    item.piece = { at: this.since(now), in: String.fromCharCode(...bytes) };
    this.keep(bytes.length, item.piece);
  }

  /** What did not go out as a whole is in no recording, and has no answer. */
  private drop({ exchange, piece, isCut }: Item): void {
    if (exchange.went !== "waits" && exchange.went !== "out") return;
    this.isTorn ||= exchange.went === "out";
    exchange.went = isCut ? "cut" : "unsent";
    const place = piece ? this.passed.lastIndexOf(piece) : -1;
    if (place >= 0) this.passed.splice(place, 1);
    this.owed.drop(exchange);
  }

  /** A port that has been told so throws away what it has not sent, and has another stream then. */
  private async giveUpSending(): Promise<void> {
    const { writer, queue } = this;
    this.writer = null;
    if (!writer) return;
    const given = queue.length > 0 ? writer.it.abort(new Error(tell(this.isOver ? "portGone" : "cutOff"))) : null;
    writer.it.releaseLock();
    await given;
  }

  private async read(): Promise<void> {
    let last: ReadableStream<Uint8Array> | null = null;
    // After an error of the line, such as a wrong stop bit, there is another stream; after the last one none.
    while (this.port.readable && this.port.readable !== last && !this.isOver) {
      last = this.port.readable;
      this.reader = last.getReader();
      try {
        for (;;) {
          const { value, done } = await this.reader.read();
          if (done) break;
          this.take(value);
        }
      } catch {
        // The last error is that the port is gone.
        if (this.port.readable && this.port.readable !== last) this.errors += 1;
        this.onChange(false);
      } finally {
        this.reader.releaseLock();
      }
    }
    // So that it can be opened again.
    if (!this.isOver) this.closed = this.shut().catch(() => {});
    this.onChange(true);
  }

  private take(bytes: Uint8Array): void {
    // Of a line that is answered the port may say later that it is out.
    const [first] = this.queue;
    if (first && this.owed.isAlone(first.exchange)) this.comes(first);
    this.heard = performance.now();
    this.keep(bytes.length, { at: this.since(this.heard), out: Array.from(bytes, (byte) => String.fromCharCode(byte)).join("") });
    this.owed.take(bytes, this.heard);
    this.onChange(false);
  }

  private keep(bytes: number, piece: Passed): void {
    this.size += bytes + PIECE;
    this.isFull ||= this.size > KEPT;
    if (!this.isFull) this.passed.push(piece);
  }

  async close(): Promise<void> {
    this.end();
    await this.reader?.cancel().catch(() => {});
    await this.reading;
    await this.shut();
  }

  /** Every line keeps what came of it until now. */
  private end(): void {
    this.isOver = true;
    for (const item of this.queue) this.drop(item);
    for (const exchange of this.exchanges) if (exchange.went === "waits") exchange.went = "unsent";
    this.owed.end("closed");
  }

  /** A port that somebody writes to, or reads from, cannot be closed. What has not gone out may take its time to be given up. */
  private async shut(): Promise<void> {
    if (!this.isOver) this.end();
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
  /** The last entry that was taken in of what the virtual controller tells, and whose it was. */
  private since = 0;
  private readonly commands = new Commands();
  /** The exchange that has been asked about. */
  asked: Exchange | null = null;
  /** A port that is being closed: it cannot be opened before. */
  closing: Promise<void> = Promise.resolve();
  /** STOP has not gone out. */
  isUnstopped = false;

  /** The virtual controller is about to be given a line, or STOP. */
  hand(app: App, exchange: Exchange): void {
    const machine = app.machine!;
    this.hear(machine);
    if (exchange.apart === "apart") return;
    const given = this.commands.give(exchange, machine.now, performance.now());
    app.api.get<{ now: number }>(`/controllers/${machine.number}/clock`).then(({ now }) => void (given.at = now), () => {});
  }

  /** Takes in what the virtual controller has said. */
  hear(machine: Machine | undefined): void {
    if (!machine) return;
    const { since } = this;
    const { entries } = machine;
    const news = entries.slice(entries.findLastIndex(({ number }) => number <= since) + 1);
    this.since = entries.at(-1)?.number ?? 0;
    // Whoever puts it back has it do something again, or something else.
    const back = news.findIndex(({ about }) => about?.deed === "restore");
    this.commands.hear(back >= 0 ? news.slice(0, back) : news);
    if (back >= 0) this.commands.end(true);
    if (!machine.clock?.paused) this.commands.idle(performance.now());
    this.line?.owed.share();
  }

  /** Nothing that the virtual controller says from now on is said to these lines. */
  leave(machine: Machine | undefined): void {
    this.hear(machine);
    this.commands.end();
  }

  /** Something else is done with the virtual controller. What it has said stays; where that was not all, it cannot be compared. */
  part(machine?: Machine): void {
    this.hear(machine);
    this.commands.end(true);
  }
}

/** Gives a line to both controllers, and says whether it could. The virtual one gets it when the real one has been sent it
    as a whole: what the one never gets, the other does not do. While something else is given to the virtual one besides,
    what they say is not compared. */
export async function give(app: App, it: Beside, text: string, isBusy: boolean): Promise<boolean> {
  const { line } = it;
  if (!line || !app.machine) return false;
  const wide = [...text].find((letter) => letter.codePointAt(0)! > 255);
  if (wide) {
    app.onNotice(`${wide} ${tell("noByte")}`, true, true);
    return false;
  }
  const exchange = line.begin(text, isBusy);
  try {
    const sent = line.send([...text, "\r"].map(byteOf), exchange);
    app.changed();
    await sent;
    it.hand(app, exchange);
    const isPosted = await app.post(text);
    if (!isPosted) [exchange.apart, exchange.isAnswered] = ["apart", true];
    return isPosted;
  } catch (error) {
    if (exchange.went === "cut") app.onNotice(tell("cutOff"), true, true);
    // That the port is gone is said once, and whoever has closed it knows.
    else if (!line.isOver) app.say(error);
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
  const [harmless, cannot] = [h("code"), h("strong")];
  const state = h("p", { class: "note", attrs: { role: "status" } });
  const element = card("real", tell("real"),
    h("p", { class: "note" }, tell("realAbout")),
    ...(serial
      ? [h("p", { class: "note" }, `${tell("danger")} `, harmless, ". ", cannot),
        h("div", { class: "bar" }, h("label", {}, `${tell("baud")} `, rate), h("label", { class: "tick" }, ready, tell("understood")), connect), form, state,
        table, h("p", { class: "note" }, tell("tolerance"))]
      : [h("p", { class: "note" }, tell("noSerial"))]));
  element.hidden = !it.isShown;

  const toggle = async () => {
    if (it.line) {
      it.closing = it.line.close();
      it.line = null;
      it.leave(app.machine);
      if (!await patiently(it.closing).catch(() => false)) app.onNotice(tell("portBusy"), true, true);
      return app.changed();
    }
    try {
      const port = await serial!.requestPort();
      await patiently(it.closing).catch(() => {});
      const { kept } = it;
      if (kept && kept.passed.length > kept.saved && !confirm(tell("dropUnsaved"))) return;
      const opened = new Line(port, (isGone) => {
        if (isGone && it.line === opened) {
          it.line = null;
          it.closing = opened.closed;
          it.leave(app.machine);
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
    const exchange = line?.begin(STOP, false);
    if (exchange && app.machine) it.hand(app, exchange);
    // Neither waits for the other.
    void app.act((path) => app.api.post(`${path}/line`, { send: String.fromCharCode(BREAK) }));
    if (line && exchange) {
      const stopped = line.stop(exchange);
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
      const { kept } = it;
      if (!kept) return;
      const { length } = kept.passed;
      keep("real.jsonl", await text());
      kept.saved = length;
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

  const WORDS = {
    same: "same", bytes: "bytesDiffer", time: "timesDiffer", open: "noAnswerYet", late: "late", silent: "silent", apart: "apart", waits: "notSentYet", cut: "notWholly",
    unsent: "unsent", closed: "portClosed", unsure: "unsure",
  } as const;
  let quiet: ReturnType<typeof setTimeout> | undefined;
  const told = (exchange: Exchange): string => {
    const found = verdict(exchange);
    if (found === "silent" && exchange.line === STOP) return tell("stopSilent");
    return tell(found === "apart" && exchange.apart === "part" ? "partSent" : WORDS[found]);
  };
  return {
    element,
    open() {
      it.isShown = true;
      element.hidden = false;
      element.scrollIntoView({ block: "nearest" });
      element.querySelector<HTMLElement>("button, select")?.focus();
      app.changed();
    },
    show() {
      if (!serial || element.hidden) return;
      put(connect, tell(it.line ? "disconnect" : "connect"));
      connect.disabled = !it.line && !ready.checked;
      rate.disabled = it.line !== null;
      // A controller of LPKF ends its motion, whatever comes.
      const canStop = app.machine?.about.family !== "lpkf";
      stop.disabled = it.line === null || !canStop;
      put(cannot, canStop ? "" : tell("noStop"));
      field.placeholder = canStop ? "@0P" : "!ON0;";
      put(harmless, field.placeholder);
      // What is sent into the past of the virtual one goes to no machine.
      field.disabled = send.disabled = it.line === null || (app.past?.isOpen ?? false);
      save.disabled = !it.kept || it.kept.passed.length === 0;
      const exchanges = it.kept?.exchanges ?? [];
      const last = exchanges.at(-1);
      it.hear(app.machine);
      // Where nothing moves nothing is told, and nothing drawn, when it has become quiet.
      const left = it.line?.owed.settle(performance.now()) ?? null;
      clearTimeout(quiet);
      if (left !== null) quiet = setTimeout(() => app.changed(), left);
      const other = exchanges.findLast((exchange) => verdict(exchange) === "bytes");
      if (other && it.line && it.asked !== other) {
        if (performance.now() - it.line.heard > QUIET) void explain(other);
        else setTimeout(() => app.changed(), QUIET);
      }
      const said = last ? `${last.line}: ${told(last)}` : "";
      const errors = it.kept?.errors ? `${tell("lineErrors")}: ${figure(it.kept.errors)}. ${tell("badLine")}` : said;
      put(state, it.isUnstopped ? tell("notStopped") : it.kept?.isFull ? tell("full") : errors);
      state.classList.toggle("alarm", it.isUnstopped);
      rows.from(exchanges, () => exchanges.map((exchange) => {
        const found = verdict(exchange);
        const none = tell(found === "open" ? "noAnswerYet" : "noAnswer");
        const { went, real, virtual, isUnsure, apart } = exchange;
        const cell = ({ bytes, after }: Exchange["real"], isAsked: boolean) =>
          isAsked ? h("td", {}, h("code", {}, bytes), h("span", { class: "note" }, after === null ? none : `${figure(after, after < 10 ? 1 : 0)} ms`)) : h("td");
        const causes = exchange.causes.map((cause) => h("span", { class: "cause" }, h("code", {}, cause), ` ${tell("wouldExplain")}`));
        return h("tr", { attrs: { "data-verdict": found } }, h("th", { scope: "row" }, h("code", {}, exchange.line)),
          cell(real, went === "out" && (!isUnsure || real.bytes !== "")), cell(virtual, went === "out" && (apart !== "apart" || virtual.bytes !== "")),
          h("td", {}, told(exchange), ...causes));
      }));
      mark(table, "data-exchanges", String(exchanges.length));
    },
  };
}
