// Puts the page together, and shows it again whenever something has changed.
import { App, type Part } from "./app";
import { h } from "./dom";
import { read } from "./film";
import { axes } from "./parts/axes";
import { clock } from "./parts/clock";
import { faults } from "./parts/faults";
import { front } from "./parts/front";
import { log } from "./parts/log";
import { ports } from "./parts/ports";
import { program } from "./parts/program";
import { timeline } from "./parts/timeline";
import { askToken, colour, shell, type Shell } from "./parts/shell";
import { view } from "./parts/view";
import { language } from "./words";

const app = new App();
let parts: Part[] = [];
let frame: Shell;
let main: HTMLElement;

function build(): void {
  document.documentElement.lang = language();
  for (const part of parts) part.leave?.();
  frame = shell(app, build);
  const [machine, line, talk, at, knobs, bits, time, stored, wrong] = parts = [
    view(app), timeline(app), log(app), axes(app), front(app), ports(app), clock(app), program(app), faults(app),
  ];
  main = h("main", {},
    h("div", { class: "wide" }, machine!.element, line!.element, talk!.element),
    h("div", { class: "side" }, at!.element, knobs!.element, bits!.element),
    h("div", { class: "side" }, time!.element, stored!.element, wrong!.element));
  document.body.replaceChildren(frame.head, main, frame.foot, frame.notice);
  show();
}

function show(): void {
  frame.show();
  const machine = app.shown;
  // What is shown while nobody answers is what was known last.
  main.inert = !app.isConnected;
  if (!machine) return;
  // What is seen is past wherever one looks.
  document.body.dataset.film = String(app.film !== undefined);
  document.body.dataset.past = String(!(app.past?.isNow ?? true));
  document.title = `${app.film?.title ?? machine.about.model} · virtual IMC4`;
  for (const part of parts) part.show(machine);
}

app.askToken = askToken;
app.onChange = show;
app.onNewMachines = build;
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => app.changed());
colour();
// Before the page is built, which takes the place of all that is in it.
const film = await read();
build();
if (film) app.play(film);
else app.start();
