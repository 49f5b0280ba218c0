// The page that needs no installing: the panel over controllers that run in the page itself.
import { App } from "../src/app";
import { h } from "../src/dom";
import { show } from "../src/page";
import { inLanguage } from "../src/words";
import { Bench, benchPart, takeDrops } from "./bench";
import { Here } from "./here";
import { read } from "./link";
import { Beside, serialPart } from "./serial";
import { Taken, tourPart } from "./tour";
import { TOURS } from "./tours";
import { tell } from "./words";

const here = new Here();
const app = new App(here);
const bench = new Bench(app, here);
const taken = new Taken();
const beside = new Beside();
here.onWait = () => app.changed();

app.means = async (line) =>
  (await app.api.get<{ text: string }>(`/controllers/${app.machine?.number ?? 1}/meaning?line=${encodeURIComponent(line)}`)).text;

/** Writes a line where it can be sent. */
function write(line: string): void {
  const field = document.querySelector<HTMLInputElement>(".log form input");
  if (!field) return;
  field.value = line;
  field.dispatchEvent(new Event("input"));
  field.focus();
}

async function takeTour(name: string): Promise<void> {
  const tour = TOURS[name];
  if (!tour) return;
  await bench.choose({ model: tour.model, machine: tour.machine });
  taken.take(name);
  app.changed();
}

/** Begins with what the address says; otherwise with a controller that has just been switched on. */
async function begin(): Promise<void> {
  const { told } = bench;
  const fresh = { ...told, deeds: [], at: 0 };
  const linked = await read(location.hash).catch(() => undefined);
  const isBegun = linked && await bench.begin(linked).then(() => true, () => false);
  if (isBegun) return;
  await bench.begin(fresh);
  if (linked !== null) app.onNotice(tell("badLink"), true, true);
}

/** Another link was put into the address. */
async function follow(): Promise<void> {
  try {
    const linked = await read(location.hash);
    if (linked) await bench.begin(linked);
  } catch {
    app.onNotice(tell("badLinkHere"), true, true);
  }
}

show(app, {
  where: () => tell(here.isWaiting ? "coming" : "here"),
  foot: () => [new Text(`${tell("private")} · `), h("a", { href: "licences.txt" }, tell("licences"))],
  above: () => {
    const real = serialPart(app, beside);
    const tours = Object.entries(TOURS).map(([name, { title }]): [string, string] => [name, inLanguage(title)]);
    return [
      benchPart(bench, { tours, take: (name) => void takeTour(name), real: () => real.open() }),
      tourPart(app, taken, write),
      real,
    ];
  },
});
try {
  await bench.load();
  await begin();
  app.start();
} catch (error) {
  app.onNotice(`${tell("broken")}: ${error instanceof Error ? error.message : String(error)}`, true);
}
takeDrops(bench);
addEventListener("hashchange", () => void follow());
if ("serviceWorker" in navigator) void navigator.serviceWorker.register("service.js").catch(() => {});
