// The page that needs no installing: the panel over controllers that run in the page itself.
import { Problem } from "../src/api";
import { App, reason } from "../src/app";
import { h, put } from "../src/dom";
import { show } from "../src/page";
import { inLanguage } from "../src/words";
import { Bench, benchPart, takeDrops } from "./bench";
import { Edition } from "./edition";
import { Here } from "./here";
import { NoLink, OfAnother, read } from "./link";
import { Beside, give, serialPart } from "./serial";
import { Taken, tourPart } from "./tour";
import { TOURS, type Tour } from "./tours";
import { tell, type Word } from "./words";

const here = new Here();
const app = new App(here);
const bench = new Bench(app, here);
const taken = new Taken();
const beside = new Beside();
const kept = h("span");
const tellKept = () => put(kept, edition.isKept ? `${tell("offline")} · ` : "");
const edition = new Edition(() => {
  tellKept();
  app.changed();
});
here.onWait = () => app.changed();
// A line goes to the real controller as well, while there is one; a job does not.
app.give = (line) => (beside.line ? give(app, beside, line, bench.isWorking) : app.post(line));
bench.onOther = () => beside.part(app.machine);
bench.onWork = () => {
  beside.part(app.machine);
  if (beside.line) app.onNotice(tell("onlyVirtual"), false, true);
};

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

/** Begins with the controller and the machine of a tour. */
const beginTour = ({ model, machine }: Tour): Promise<void> => bench.choose({ model, machine });

async function takeTour(name: string): Promise<void> {
  const tour = TOURS[name];
  if (!tour) return;
  await beginTour(tour);
  taken.take(name);
  app.changed();
}

/** Begins with the link in the address, if there is one, and says whether it has. What is wrong with it is said, and what
    is so instead. */
async function follow(instead: Word): Promise<boolean> {
  try {
    const { hash } = location;
    // It may be the name of a part of the page.
    const linked = document.getElementById(hash.slice(1)) ? null : await read(hash);
    if (linked) await bench.begin(linked);
    return linked !== null;
  } catch (error) {
    // Why it could not be carried out is said in English.
    if (error instanceof Problem) app.onNotice(reason(error), true, false, `${tell("linkFailed")} ${tell(instead)}`);
    else {
      const what = error instanceof NoLink ? "noLink" : error instanceof OfAnother ? "linkOther" : "linkTorn";
      app.onNotice(`${tell(what)} ${tell(instead)}`, true, true);
    }
    return false;
  }
}

/** The controllers have not begun, and will not. */
let isBroken = false;
const where = (): Word => (isBroken ? "broken" : !app.isConnected ? "loading" : here.isWaiting ? "coming" : "here");

show(app, {
  where: () => `${tell(where())}${edition.isOld ? `; ${tell("newEdition")}` : ""}`,
  foot: () => [new Text(`${tell("private")} · `), (tellKept(), kept), h("a", { href: "licences.txt" }, tell("licences"))],
  above: () => {
    const real = serialPart(app, beside);
    const tours = Object.entries(TOURS).map(([name, { title }]): [string, string] => [name, inLanguage(title)]);
    return [
      benchPart(bench, { tours, take: (name) => void takeTour(name), real: () => real.open() }),
      tourPart(app, taken, write, (tour) => void beginTour(tour)),
      real,
    ];
  },
});
try {
  await bench.load();
  if (!await follow("begunAnew")) await bench.begin({ ...bench.told, deeds: [], at: 0 });
  app.start();
} catch (error) {
  isBroken = true;
  app.onNotice(reason(error), true, false, tell("loadAgain"));
  app.changed();
}
takeDrops(bench);
addEventListener("hashchange", () => void follow("unchanged"));
void edition.keep();
