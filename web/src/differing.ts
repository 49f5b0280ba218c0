// Where the recording that is open contradicts the emulation: said, marked on the time line, and shown with the
// recorded or the emulated replies. Fetched only when there is such a place.
import type { Difference, Entry, History } from "./api";
import type { App } from "./app";
import { h, put, Rebuilt } from "./dom";
import { figure, inLanguage, seconds } from "./words";

const WORDS = {
  differs: ["The emulation differs from the recording from", "Die Emulation weicht von der Aufzeichnung ab:"],
  on: ["on", "an"],
  from: ["", "ab "],
  places: ["places", "Stellen"],
  list: ["Differences", "Abweichungen"],
  recorded: ["Show recorded replies", "Aufgezeichnete Antworten zeigen"],
  emulated: ["Show emulated replies", "Emulierte Antworten zeigen"],
  isRecorded: ["recorded", "aufgezeichnet"],
  isEmulated: ["emulated", "emuliert"],
} as const satisfies Record<string, readonly [string, string]>;
const tell = (word: keyof typeof WORDS): string => inLanguage(WORDS[word]);

/** So many places are listed. */
const LISTED = 100;

export class Differing {
  /** Whether recorded replies are shown. */
  isRecorded = false;
  readonly element = h("div", { class: "differs" });
  private readonly rows = new Rebuilt(this.element);
  private known: Difference[] | undefined;
  private replies = new Map<number, Difference>();

  constructor(private readonly app: App) {}

  /** Those on the way that is looked at. */
  private of(history: History | null | undefined): Difference[] {
    return history?.differences ?? [];
  }

  /** Says what differs, and lists the places. */
  show(): void {
    const { app } = this;
    const history = app.past?.history;
    const all = this.of(history);
    if (all !== this.known) {
      this.known = all;
      this.replies = new Map(all.flatMap((one) => (one.replies !== null && one.command !== null ? [[one.command, one] as const] : [])));
    }
    this.rows.from([all.length, all[0]?.at, this.isRecorded, document.documentElement.lang], () => {
      const [first] = all;
      if (!first) return [];
      const places = all.length > 1 ? ` (${figure(all.length)} ${tell("places")})` : "";
      const button = h("button", { onclick: () => this.change() }, tell(this.isRecorded ? "emulated" : "recorded"));
      const go = ({ branch, at }: Difference) => void app.past?.go(history?.open && !app.film ? { branch, at } : { at });
      const rows = all.slice(0, LISTED).map((one) =>
        h("li", {}, h("button", { onclick: () => go(one) }, `${seconds(one.at)}  `, h("span", { lang: "en" }, one.text))));
      return [
        h("p", { class: "differs-from", attrs: { role: "status" } },
          `${tell("differs")} ${tell("from")}${seconds(first.at)} ${tell("on")}${places}`),
        button,
        h("details", {}, h("summary", {}, tell("list")), h("ul", { class: "list" }, ...rows)),
      ];
    });
  }

  private change(): void {
    this.isRecorded = !this.isRecorded;
    this.app.changed();
  }

  /** Marks the places on the time line. */
  draw(context: CanvasRenderingContext2D, colour: string, x: (time: number) => number, y: (branch: number) => number): void {
    context.fillStyle = colour;
    for (const { at, branch } of this.of(this.app.past?.history)) {
      const [left, top] = [x(at), y(branch)];
      context.beginPath();
      context.moveTo(left, top - 3);
      context.lineTo(left - 5, top - 11);
      context.lineTo(left + 5, top - 11);
      context.fill();
    }
  }

  /** Shows in the row of an entry what differs there. */
  row(entry: Entry, text: HTMLElement): void {
    const one = entry.command === undefined ? undefined : this.replies.get(entry.command);
    if (!one || entry.kind !== (one.replies ? "answer" : "command")) return;
    const [shown, other] = this.isRecorded ? [one.recorded, one.emulated] : [one.emulated, one.recorded];
    const said = `${tell(this.isRecorded ? "isRecorded" : "isEmulated")}; ${tell(this.isRecorded ? "isEmulated" : "isRecorded")} ${other}`;
    if (one.replies) put(text, `${shown} (${said})`);
    else put(text, `${entry.text}  ← ${shown} (${said})`);
    text.closest("li")?.classList.add("entry-differs");
  }
}
