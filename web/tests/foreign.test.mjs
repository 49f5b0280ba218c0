// A page of another origin can neither read nor drive, whatever it tries in a real browser.
import assert from "node:assert/strict";
import { createServer } from "node:http";
import { after, before, test } from "node:test";
import { browse, serve, until } from "./stand.mjs";

// Names that a page of elsewhere has, which mean this computer. What the browser itself refuses is no help here.
const NAMES = ["elsewhere.example", "rebind.example"];
let browser, server, foreign;
before(async () => {
  const rules = NAMES.map((name) => `MAP ${name} 127.0.0.1`).join(",");
  browser = await browse(`--host-resolver-rules=${rules}`, "--disable-features=LocalNetworkAccessChecks");
  server = await serve("--web", "--machine", "mill");
  foreign = createServer((_, response) => {
    response.setHeader("Content-Type", "text/html");
    response.end('<!doctype html><link rel=icon href="data:,"><title>elsewhere</title>');
  });
  await new Promise((resolve) => foreign.listen(0, "127.0.0.1", resolve));
});
after(async () => {
  await browser?.close();
  foreign?.close();
  await server?.end();
});

const VIEW = "/v1/controllers/1/view";
const ORDERS = "/v1/controllers/1/orders";
const OPEN = JSON.stringify({ order: "cover open" });

/** Everything that a page may try; what came of it. */
function attack({ url, VIEW, ORDERS, OPEN }) {
  const tried = async (ask) => {
    try {
      const answer = await ask();
      return `${answer.type} ${answer.status} ${(await answer.text()).slice(0, 40)}`;
    } catch {
      return "refused";
    }
  };
  const loads = (name, more = {}) =>
    new Promise((resolve) => {
      const element = Object.assign(document.createElement(name), more);
      element.onload = () => resolve("loaded");
      element.onerror = () => resolve("refused");
      document.body.append(element);
    });
  const socket = () =>
    new Promise((resolve) => {
      const socket = new WebSocket(`${url.replace("http", "ws")}/v1/events`);
      socket.onopen = () => resolve("opened");
      socket.onerror = () => resolve("refused");
    });
  // A form that leads into a frame needs no script to be answered. Its text is JSON, but for its type.
  const form = (enctype) =>
    new Promise((resolve) => {
      const frame = Object.assign(document.createElement("iframe"), { name: enctype });
      const form = Object.assign(document.createElement("form"), { method: "POST", action: url + ORDERS, enctype, target: enctype });
      const field = Object.assign(document.createElement("input"), { name: '{"order":"cover open","x":"', value: '"}' });
      form.append(field);
      document.body.append(frame, form);
      frame.onload = () => {
        let text = "hidden";
        try {
          text = frame.contentDocument ? frame.contentDocument.body.textContent : "hidden";
        } catch {}
        // The empty frame loads first, when it is put into the page.
        if (text !== "") resolve(text.slice(0, 40));
      };
      form.submit();
    });
  const json = { "Content-Type": "application/json" };
  return (async () => ({
    read: await tried(() => fetch(url + VIEW)),
    blind: await tried(() => fetch(url + VIEW, { mode: "no-cors" })),
    plain: await tried(() => fetch(url + ORDERS, { method: "POST", body: OPEN, mode: "no-cors" })),
    json: await tried(() => fetch(url + ORDERS, { method: "POST", body: OPEN, headers: json })),
    signal: await tried(() => fetch(`${url}/v1/controllers/1/signals/cover`, { method: "PUT", body: '{"value":"open"}', headers: json })),
    beacon: String(navigator.sendBeacon(url + ORDERS, new Blob([OPEN], { type: "text/plain" }))),
    script: await loads("script", { src: url + VIEW }),
    image: await loads("img", { src: `${url}/icon.svg` }),
    socket: await socket(),
    forms: [await form("text/plain"), await form("application/x-www-form-urlencoded")],
  }))();
}

/** What the page at this address gets, and what the server answered it. */
async function attacked(address, url, isOwn) {
  const context = await browser.newContext();
  const page = await context.newPage();
  // It was loaded from there before the name came to mean this computer.
  if (isOwn) {
    await page.route(address, (route) => route.fulfill({ contentType: "text/html", body: "<!doctype html><title>before</title>" }));
  }
  await page.goto(address);
  // Also what the browser then keeps from the page.
  const statuses = [];
  const network = await context.newCDPSession(page);
  network.on("Network.responseReceivedExtraInfo", ({ statusCode }) => statuses.push(statusCode));
  await network.send("Network.enable");
  const got = await page.evaluate(attack, { url, VIEW, ORDERS, OPEN });
  await context.close();
  return { got, statuses };
}

const cover = async () => (await server.ask("GET", "/controllers/1/signals")).find(({ name }) => name === "cover").value;

async function nothingWasDone() {
  assert.equal(await cover(), 1, "the cover is closed");
  const { entries } = await server.ask("GET", "/controllers/1/journal");
  assert.deepEqual(entries.filter(({ kind }) => kind === "signal" || kind === "command"), []);
}

test("a page of another origin neither reads nor drives", async () => {
  const { port } = foreign.address();
  for (const origin of [`http://127.0.0.1:${port}`, `http://localhost:${port}`, `http://elsewhere.example:${port}`]) {
    const { got, statuses } = await attacked(`${origin}/`, server.url);
    assert.deepEqual({ ...got, beacon: "", forms: [] }, {
      read: "refused", blind: "refused", plain: "refused", json: "refused", signal: "refused", beacon: "",
      script: "refused", image: "refused", socket: "refused", forms: [],
    }, origin);
    assert.ok(got.forms.every((text) => !text.includes('"text"')), `${origin}: ${got.forms}`);
    // It is the server that has refused, and not a browser that never asked.
    assert.ok(statuses.length > 5 && statuses.every((status) => status === 403), `${origin}: ${statuses}`);
    await nothingWasDone();
  }
});

test("a name that was made to mean this computer opens nothing", async () => {
  const url = `http://rebind.example:${server.port}`;
  const { got, statuses } = await attacked(`${url}/before`, url, true);
  const refused = /^basic 403 \{"detail":"`rebind.example/;
  for (const way of ["read", "blind", "plain", "json", "signal"]) assert.match(got[way], refused, way);
  assert.deepEqual([got.script, got.image, got.socket], ["refused", "refused", "refused"]);
  assert.ok(got.forms.every((text) => !text.includes('"text"')), `${got.forms}`);
  assert.ok(statuses.length > 5 && statuses.every((status) => status === 403), `${statuses}`);
  await nothingWasDone();
});

test("the same from the own page does it, so that the others were right to try", async () => {
  const { got } = await attacked(`${server.url}/before`, server.url, true);
  assert.match(got.read, /^basic 200 \{/);
  assert.match(got.json, /^basic 200 \{"text":"ok"\}/);
  assert.equal(got.socket, "opened");
  assert.equal(got.image, "loaded");
  // What is not said to be JSON is refused even so.
  assert.match(got.plain, /^basic 415/);
  await until("the cover is open", async () => (await cover()) === 0);
});
