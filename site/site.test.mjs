// The site in a browser: `SITE=target/site node --test site/site.test.mjs`, with the packages of web/.
// What is made by `cargo site` is handed out as any web server would, and nothing may come from elsewhere.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { extname, join, normalize } from "node:path";
import { after, before, test } from "node:test";

const web = createRequire(new URL("../web/package.json", import.meta.url));
const { chromium } = web("playwright-core");
const axe = web.resolve("axe-core/axe.min.js");

const folder = process.env.SITE ?? "target/site";
const kinds = {
  ".html": "text/html; charset=utf-8", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml",
  ".json": "application/json", ".png": "image/png", ".woff2": "font/woff2",
};

let server;
let browser;
let page;
let origin;
/** What the pages have asked for, and what has gone wrong in them. */
const asked = [];
const wrong = [];

before(async () => {
  server = createServer(async (request, answer) => {
    const path = normalize(decodeURIComponent(new URL(request.url, "http://x").pathname));
    try {
      const file = path.endsWith("/") ? `${path}index.html` : path;
      const bytes = await readFile(join(folder, file));
      answer.writeHead(200, { "content-type": kinds[extname(file)] ?? "application/octet-stream" }).end(bytes);
    } catch {
      answer.writeHead(404).end();
    }
  });
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  origin = `http://127.0.0.1:${server.address().port}`;
  browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-gpu"],
  });
  page = await browser.newPage();
  page.on("request", (request) => asked.push(request.url()));
  page.on("pageerror", (error) => wrong.push(error.message));
  page.on("response", (answer) => {
    if (answer.status() >= 400) wrong.push(`${answer.status()} ${answer.url()}`);
  });
});

after(async () => {
  await browser?.close();
  server?.close();
});

const open = (path) => page.goto(`${origin}/${path}`, { waitUntil: "load" });

test("the behaviours are filtered by words, model and evidence, and the address keeps that", async () => {
  await open("docs/behaviour.html");
  const shown = () => page.locator("main tbody tr:visible").count();
  const all = await page.locator(".filter output").textContent();
  assert.match(all, /^(\d+) of \1$/);
  await page.getByRole("searchbox", { name: "Words" }).fill("253 stops");
  await page.getByRole("combobox", { name: "Any model" }).selectOption("imc-s8");
  await page.getByRole("combobox", { name: "Any evidence" }).selectOption("F");
  const said = await page.locator(".filter output").textContent();
  const [left, of] = said.split(" of ").map(Number);
  assert.ok(left > 0 && left < 10 && of > 1000, said);
  await page.reload();
  assert.equal(await page.locator(".filter output").textContent(), said);
  await page.getByRole("combobox", { name: "Any model" }).selectOption("smcu");
  assert.match(await page.locator(".filter output").textContent(), /^0 of /);
  // What is left are the tables of commands and statuses, which have no models to filter by.
  assert.ok((await shown()) > 0);
});

test("a behaviour's session opens below its row", async () => {
  await open("docs/behaviour.html?words=finishes+the+stopped+move");
  await page.getByRole("link", { name: "software-stop/goes-on" }).click();
  const lines = page.locator("tr.unfolded .session-lines tbody tr");
  await lines.last().waitFor();
  const [wanted] = (await lines.allTextContents()).filter((text) => text.includes("> @0S -> 0"));
  assert.match(wanted, /^> @0S -> 0 at 391\.19ms0/);
  await page.getByRole("link", { name: "software-stop/goes-on" }).click();
  assert.equal(await lines.count(), 0);
});

test("a session of a command is walked through, forward and back", async () => {
  await open("docs/commands-isel.html#command--40S");
  // Those in which it is only used are behind a line that says how many they are.
  await page.locator("main details:not(.session)").evaluateAll((all) => all.forEach((more) => { more.open = true; }));
  const session = page.locator('details.session[data-id="isel/stop/software-stop/goes-on"]').first();
  await session.locator("summary").click();
  const rows = session.locator(".session-lines tbody tr");
  await rows.last().waitFor();
  const count = await rows.count();
  await session.getByRole("button", { name: "To the beginning" }).click();
  assert.equal(await session.locator("tr.later").count(), count);
  for (let line = 0; line < 4; line += 1) await session.getByRole("button", { name: "A line on" }).click();
  assert.match(await session.locator("tr.now").textContent(), /^! 253.*move$/);
  await session.getByRole("button", { name: "A line back" }).click();
  assert.match(await session.locator("tr.now").textContent(), /^wait 200ms/);
  await session.getByRole("combobox", { name: "Model" }).selectOption({ label: "imc4" });
  assert.equal(await rows.count(), count);
});

test("the book is searched without a server", async () => {
  await open("index.html?search=trackball");
  await page.locator("#mdbook-searchresults a, #searchresults a").first().waitFor();
  assert.ok((await page.locator("#mdbook-searchresults a, #searchresults a").count()) > 3);
});

test("the diagram is drawn, light and dark pages can be read, and so by those who do not see", async () => {
  await open("index.html");
  const box = await page.locator("figure.diagram svg").boundingBox();
  assert.ok(box && box.width > 300 && box.height > 100, JSON.stringify(box));
  if (process.env.PICTURES) await page.locator("figure.diagram").screenshot({ path: `${process.env.PICTURES}/diagram.png` });
  for (const colorScheme of ["light", "dark"]) {
    await page.emulateMedia({ colorScheme });
    await open("docs/commands-lpkf.html");
    await page.locator("details.session summary").first().click();
    await page.locator(".session-lines").first().waitFor();
    if (process.env.PICTURES) await page.screenshot({ path: `${process.env.PICTURES}/${colorScheme}.png` });
    await page.addScriptTag({ path: axe });
    // Our own parts; the rest is mdBook's.
    const found = await page.evaluate(() => globalThis.axe.run(document.querySelector("details.session")));
    assert.deepEqual(found.violations.map(({ id, nodes }) => [id, nodes[0].html]), []);
  }
});

test("on a phone nothing is wider than the page", async () => {
  await page.setViewportSize({ width: 390, height: 800 });
  await open("docs/commands-isel.html");
  await page.locator("details.session summary").first().click();
  await page.locator(".session-lines").first().waitFor();
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  assert.ok(wide <= 0, `${wide} pixels too wide`);
});

test("nothing was asked of anybody else, and nothing went wrong", () => {
  assert.deepEqual(asked.filter((url) => !url.startsWith(origin) && !url.startsWith("data:")), []);
  assert.deepEqual(wrong, []);
});
