// Puts the page together, and shows it again whenever something has changed.
import type { App, Part } from "./app";
import { h } from "./dom";
import { axes } from "./parts/axes";
import { clock } from "./parts/clock";
import { faults } from "./parts/faults";
import { front } from "./parts/front";
import { log } from "./parts/log";
import { ports } from "./parts/ports";
import { program } from "./parts/program";
import { timeline } from "./parts/timeline";
import { colour, notice, shell, type Shell } from "./parts/shell";
import { view } from "./parts/view";
import { language } from "./words";

/** What a page has besides the parts that show a controller. */
export interface More {
  /** What is said of the source. */
  where?: () => string;
  /** What stands at the end of the page. */
  foot: () => Node[];
  /** What stands above the machine; and then the conversation does, too, since the page is for typing. */
  above?: () => Part[];
}

/** Where the first click does it all, the second of a double click would undo it, do it twice, or strike
    what has moved there meanwhile. */
function heedOnce(event: MouseEvent): void {
  if (event.detail < 2 || !(event.target instanceof Element) || !event.target.closest("[data-once]")) return;
  event.preventDefault();
  event.stopPropagation();
}

export function show(app: App, more: More): void {
  let parts: Part[] = [];
  let frame: Shell;
  let main: HTMLElement;
  const said = notice(app);

  const build = (): void => {
    document.documentElement.lang = language();
    for (const part of parts) part.leave?.();
    frame = shell(app, more, build);
    const [machine, line, talk, at, knobs, bits, time, stored, wrong] = parts = [
      view(app), timeline(app), log(app), axes(app), front(app), ports(app), clock(app), program(app), faults(app),
    ];
    const above = more.above?.() ?? [];
    parts = [...parts, ...above];
    const wide = [machine!, line!];
    if (more.above) wide.unshift(talk!);
    else wide.push(talk!);
    main = h("main", {},
      h("div", { class: "wide" }, ...wide.map(({ element }) => element)),
      h("div", { class: "side" }, at!.element, knobs!.element, bits!.element),
      h("div", { class: "side" }, time!.element, stored!.element, wrong!.element));
    document.body.replaceChildren(frame.head, ...above.map(({ element }) => element), main, frame.foot, said);
    look();
  };

  const look = (): void => {
    frame.show();
    const machine = app.shown;
    // What is shown while nobody answers is what was known last.
    main.inert = !app.isConnected;
    if (!machine) return;
    // What is seen is past wherever one looks.
    document.body.dataset.film = String(app.film !== undefined);
    document.body.dataset.past = String(!(app.past?.isNow ?? true));
    const { model } = machine.about;
    document.title = app.film ? `${app.film.title} · ${model}` : `${model} · virtual IMC4`;
    for (const part of parts) part.show(machine);
  };

  app.onChange = look;
  app.onNewMachines = build;
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => app.changed());
  document.addEventListener("click", heedOnce, true);
  colour();
  build();
}
