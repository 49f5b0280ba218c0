// The pictures of docs/panel.md and docs/playground.md: what they show is asserted, and with PANEL_PICTURES they are kept.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { browse, open, serve, until } from "./stand.mjs";
import { absent, host } from "./tab.mjs";

let browser;
// The page around the machine is put together by the processor: then there is time to draw finely what moves.
before(async () => (browser = await browse("--disable-gpu-compositing")));
after(() => browser?.close());

const folder = process.env.PANEL_PICTURES;
const keep = (page, name, options) =>
  page.screenshot({ ...(folder && { path: `${folder}/${name}.png` }), animations: "disabled", ...options });

test("the page is as its book shows it", async () => {
  const server = await serve("--web", "--machine", "mill", "--time", "8x");
  const { page, context } = await open(browser, server, { viewport: { width: 1520, height: 1010 } });
  const idle = async () => (await server.ask("GET", "/controllers/1/view")).activity === "idle";
  // A plate with a slot, a pocket of arcs, and moves between them above the work.
  const job = [
    "@07", "@0R7", "@0M6000,20000,4000,20000,0,900,0,900", "@0M6000,900,4000,900,-7000,8000,0,900",
    "@0M18000,9000,4000,9000,-7000,900,0,900", "@0M18000,9000,11000,9000,-7000,900,0,900",
    "@0M6000,9000,11000,9000,-7000,900,0,900", "@0M6000,9000,4000,9000,-7000,900,0,900",
    "@0M6000,900,4000,900,-4000,8000,0,900", "@0M11500,20000,7500,20000,-4000,900,0,900",
    "@0M11500,900,7500,900,-7000,8000,0,900", "@0f-1", "@0y20000,6000,-1250,2500,0,-1,1",
    "@0M11500,900,7500,900,-4000,8000,0,900", "@0M16000,20000,7500,20000,-4000,900,0,900",
    "@0A5", "@0B2,1",
  ];
  try {
    for (const line of job) {
      await server.send(line);
      await until("it is idle", idle);
    }
    await server.ask("PUT", "/controllers/1/clock", { clock: "real" });
    await server.send("@0M16000,900,5000,1000,-7000,1200,0,900");
    await until("it moves", async () => (await page.locator(".front .state").textContent()) === "move");
    await until("the way is drawn", async () => Number(await page.locator(".stage").getAttribute("data-corners")) > 20);
    await page.locator(".entry-error", { hasText: "takes 8 numbers" }).waitFor();
    // What a slow computer draws coarsely while it moves is sharp where time stands.
    await server.ask("POST", "/controllers/1/clock/pause");
    await until("it is drawn finely", async () => !(await page.getByText("drawn coarsely while it moves").isVisible()));
    await keep(page, "panel");
    await server.ask("POST", "/controllers/1/clock/resume");
    await knobStop(page);
    await page.emulateMedia({ colorScheme: "dark" });
    await page.setViewportSize({ width: 390, height: 844 });
    const plate = await page.locator(".front").boundingBox();
    const drawing = await page.locator(".machine").boundingBox();
    assert.ok(plate.y + plate.height <= drawing.y, "on a phone the buttons come first");
    await keep(page, "panel-phone");
  } finally {
    await context.close();
    await server.end();
  }
});

test("the page that needs no installing is as its book shows it", { skip: absent }, async () => {
  const site = await host();
  const context = await browser.newContext({ locale: "en", viewport: { width: 1520, height: 1180 } });
  const page = await context.newPage();
  page.setDefaultTimeout(60_000);
  try {
    await page.goto(site.url);
    await page.getByRole("combobox", { name: "Pace" }).selectOption("100x");
    await page.getByRole("combobox", { name: "Examples" }).selectOption("plate.ncp");
    await page.getByText("plate.ncp has been carried out").waitFor();
    await page.getByRole("textbox", { name: /Send to the controller/ }).fill("@0A1600,2000,800,2000,0,900,0,900");
    await page.locator(".meaning", { hasText: "relative move X +1,600 steps" }).waitFor();
    await until("the way is drawn", async () => Number(await page.locator(".stage").getAttribute("data-corners")) > 50);
    // What a slow computer draws coarsely while it moves is sharp at rest.
    if (folder) await page.waitForTimeout(4_000);
    await keep(page, "playground");
  } finally {
    await context.close();
    await site.end();
  }
});

async function knobStop(page) {
  await page.locator('.knob[data-signal="stop"]').click();
  await page.locator(".entry", { hasText: "stopped by STOP" }).first().waitFor();
}
