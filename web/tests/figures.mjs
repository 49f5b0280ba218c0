// How the panel bears much: a million parts of a way on the screen, and an hour of a program without an end.
// `npm run figures` prints what was measured; nothing is asserted, since computers differ.
import { browse, open, serve, until } from "./stand.mjs";

const PARTS = Number(process.env.FIGURE_PARTS ?? 1_000_000);
const HOUR = 3_600_000_000_000;

// What is drawn is drawn by the processor. So is the page around it, as where there are no graphics at all: by
// the software that stands in for them it would take longer than the machine.
const browser = await browse("--enable-precise-memory-info", "--disable-gpu-compositing");
const server = await serve("--web", "--machine", "mill", "--time", "100x");
const { page } = await open(browser, server, {
  // Each picture is awaited before the next one begins.
  before: () => {
    window.pictures = [];
    const { fenceSync } = WebGL2RenderingContext.prototype;
    WebGL2RenderingContext.prototype.fenceSync = function (...how) {
      window.pictures.push(performance.now());
      return fenceSync.apply(this, how);
    };
  },
});
const devtools = await page.context().newCDPSession(page);

/** What the page holds once nobody's rubbish is in it, in MB. */
async function memory() {
  await devtools.send("HeapProfiler.collectGarbage");
  return (await page.evaluate(() => performance.memory.usedJSHeapSize)) / 1e6;
}

/** How many parts of the way have been drawn, and how many of those are still there. */
async function drawn() {
  const there = Number(await page.locator(".stage").getAttribute("data-corners"));
  const gone = await page.locator(".note", { hasText: "older path" }).allTextContents();
  return { there, all: there + Number((gone[0] ?? "0").replace(/\D/g, "")) };
}

/** The times between the pictures that the graphics have finished while the machine is turned by the mouse
    for some seconds, sorted, in ms. */
async function frames(seconds) {
  const box = await page.locator(".stage canvas").boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.evaluate(() => (window.pictures = []));
  const end = Date.now() + seconds * 1_000;
  for (let turn = 0; Date.now() < end; turn++) await page.mouse.move(x + 200 * Math.sin(turn / 20), y + 60 * Math.cos(turn / 20));
  const pictures = await page.evaluate(() => window.pictures);
  await page.mouse.up();
  return pictures.map((time, i) => time - pictures[i - 1]).slice(1).sort((one, other) => one - other);
}

const at = (sorted, share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))].toFixed(0);
const now = async () => (await server.ask("GET", "/controllers/1/clock")).now;

try {
  const moves = [[400, 0, 0], [0, 300, 0], [-300, 100, 100], [-100, -300, 0], [200, 100, -100], [-200, -200, 0]];
  const lines = moves.map(([dx, dy, dz]) => `0${dx},10000,${dy},10000,${dz},10000,0,900`);
  await server.send("@07");
  await server.send("@0i");
  for (const line of [...lines, `30,-${lines.length}`, "9"]) await server.send(line);
  const empty = await memory();
  await server.ask("PUT", "/controllers/1/clock", { clock: "1000x" });
  await server.order("press start");
  const begin = Date.now();
  await until("the way is that long", async () => (await drawn()).all >= PARTS, 1_800_000);
  const { there, all } = await drawn();
  console.log(`${all} parts in ${((Date.now() - begin) / 1_000).toFixed(0)} s, ${there} of them on the screen, the older ones thinned`);
  const running = await frames(5);
  console.log(`turned while it runs: ${(running.length / 5).toFixed(0)} frames/s; median ${at(running, 0.5)} ms, p95 ${at(running, 0.95)} ms, worst ${at(running, 1)} ms`);
  await server.ask("PUT", "/controllers/1/clock", { clock: "100x" });
  const held = [];
  const start = await now();
  for (let part = 0; part <= 6; part++) {
    await until("the next ten minutes are over", async () => (await now()) - start >= (part * HOUR) / 6, 600_000);
    held.push((await memory()).toFixed(1));
  }
  console.log(`memory: ${empty.toFixed(1)} MB at first; then each ten minutes of an hour ${held.join(", ")} MB`);
  await server.order("press stop");
  const still = await frames(5);
  console.log(`turned at rest: ${(still.length / 5).toFixed(0)} frames/s; median ${at(still, 0.5)} ms, p95 ${at(still, 0.95)} ms, worst ${at(still, 1)} ms`);
} finally {
  await browser.close();
  await server.end();
}
