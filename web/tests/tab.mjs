// One way to drive a page, in Chromium and in Firefox: the same tests run in both.
import { existsSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { gzipSync } from "node:zlib";
import puppeteer from "puppeteer-core";
import { browse, until } from "./stand.mjs";

const target = process.env.CARGO_TARGET_DIR ? `file://${process.env.CARGO_TARGET_DIR}/` : new URL("../../target/", import.meta.url);
const folder = new URL("playground/", target);
const KINDS = {
  html: "text/html", js: "text/javascript", css: "text/css", svg: "image/svg+xml", json: "application/json",
  webmanifest: "application/manifest+json", wasm: "application/wasm", txt: "text/plain", ncp: "text/plain", plt: "text/plain", jsonl: "text/plain",
};
/** Why the page cannot be tried; `false` if it can. Where nothing may be left out, that it cannot is an error. */
export const absent = existsSync(new URL("index.html", folder)) ? false : "the page is not built: cargo xtask page, npm run playground";
if (absent && process.env.VIMC4_REQUIRE_TOOLS) throw new Error(absent);
const firefox = process.env.FIREFOX ?? "/usr/bin/firefox-esr";

/** The page on a server as anybody may have it: files, compressed, and nothing else. `more` answers the rest. What is
    held comes only when it is let go. */
export async function host(more) {
  const told = { bytes: 0, paths: [] };
  let [held, missing] = [null, null];
  const waiting = [];
  const others = new Map();
  const server = createServer(async (request, response) => {
    const path = new URL(request.url, "http://host").pathname;
    told.paths.push(path);
    const name = path === "/" ? "index.html" : path.slice(1);
    const body = others.get(name) ?? await readFile(new URL(name, folder)).catch(() => null);
    if (!body || name.includes("..") || missing?.test(name)) {
      if (more && await more(request, response)) return;
      response.writeHead(404).end();
      return;
    }
    if (held?.test(name)) await new Promise((resolve) => waiting.push(resolve));
    const packed = gzipSync(body);
    told.bytes += packed.length;
    response.writeHead(200, { "Content-Type": KINDS[name.split(".").at(-1)] ?? "application/octet-stream", "Content-Encoding": "gzip", "Cache-Control": "max-age=600" });
    response.end(packed);
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const url = `http://127.0.0.1:${server.address().port}`;
  return {
    url, told, server,
    hold: (names) => void (held = names),
    /** What cannot be had for a while. */
    miss: (names) => void (missing = names),
    /** What stands there instead. */
    put: (name, body) => void others.set(name, body),
    read: (name) => readFile(new URL(name, folder), "utf8"),
    letGo() {
      others.clear();
      held = missing = null;
      for (const go of waiting.splice(0)) go();
    },
    end: () => new Promise((resolve) => {
      server.closeAllConnections();
      server.close(resolve);
    }),
  };
}

/** A browser, whichever it is. */
export async function browser(name) {
  if (name === "chromium") {
    const it = await browse();
    return {
      name,
      async tab(options = {}) {
        const context = await it.newContext({ locale: "en", viewport: { width: 1600, height: 1200 }, ...options });
        return new Tab(await context.newPage(), () => context.close(), (code) => context.addInitScript(code), (is) => context.setOffline(is));
      },
      end: () => it.close(),
    };
  }
  if (!existsSync(firefox)) throw new Error(`${firefox} is not there: apt install firefox-esr`);
  const it = await puppeteer.launch({ browser: "firefox", executablePath: firefox, headless: true, extraPrefsFirefox: { "intl.accept_languages": "en" } });
  return {
    name,
    async tab({ viewport = { width: 1600, height: 1200 } } = {}) {
      const context = await it.createBrowserContext();
      const page = await context.newPage();
      await page.setViewport(viewport);
      return new Tab(page, () => context.close(), (code) => page.evaluateOnNewDocument(code), (is) => page.setOfflineMode(is));
    },
    end: () => it.close(),
  };
}

/** A page, and everything that it asked for or complained of. */
class Tab {
  asked = [];
  complaints = [];

  constructor(page, close, before, setOffline) {
    this.page = page;
    this.close = close;
    this.before = before;
    this.setOffline = setOffline;
    // A slow machine has all the time it needs.
    page.setDefaultTimeout(90_000);
    page.setDefaultNavigationTimeout(90_000);
    page.on("request", (request) => this.asked.push(request.url()));
    // Where there is no WebGL the machine is not drawn, and the page says so.
    page.on("console", (message) => message.type() === "error" && !message.text().includes("WebGL") && this.complaints.push(message.text()));
    page.on("pageerror", (error) => this.complaints.push(String(error)));
  }

  goto(url) {
    return this.page.goto(url);
  }

  reload() {
    return this.page.reload();
  }

  look(what, ...values) {
    return this.page.evaluate(what, ...values);
  }

  /** The text of the first element of this kind; with `within`, of the first that has this text in it. */
  text(selector, within = "") {
    return this.page.evaluate(([selector, within]) =>
      [...document.querySelectorAll(selector)].find((one) => one.textContent.includes(within))?.textContent ?? null, [selector, within]);
  }

  attribute(selector, name) {
    return this.page.evaluate(([selector, name]) => document.querySelector(selector)?.getAttribute(name) ?? null, [selector, name]);
  }

  /** Waits until there is one that is seen, with this text. */
  seen(selector, within = "") {
    return until(`${selector} with ${JSON.stringify(within)} is seen`, () => this.page.evaluate(([selector, within]) =>
      [...document.querySelectorAll(selector)].some((one) => one.textContent.includes(within) && one.checkVisibility()), [selector, within]));
  }

  /** Clicks as the mouse does, on the first of this kind with this text. */
  async click(selector, within = "") {
    await this.seen(selector, within);
    const handle = await this.page.evaluateHandle(([selector, within]) =>
      [...document.querySelectorAll(selector)].find((one) => one.textContent.includes(within) && one.checkVisibility()), [selector, within]);
    await handle.asElement().click();
  }

  /** Writes into a field by the keyboard. */
  async write(selector, text) {
    await this.click(selector);
    await this.page.keyboard.type(text);
  }

  press(key) {
    return this.page.keyboard.press(key);
  }

  async choose(selector, value) {
    await until(`${selector} offers ${value}`, () => this.page.evaluate(([selector, value]) =>
      [...(document.querySelector(selector)?.options ?? [])].some((option) => option.value === value), [selector, value]));
    await this.page.evaluate(([selector, value]) => {
      const field = document.querySelector(selector);
      field.value = value;
      field.dispatchEvent(new Event("change", { bubbles: true }));
    }, [selector, value]);
  }

  /** Drops a file on the page, with a text or with bytes. */
  drop(name, content) {
    const parts = typeof content === "string" ? content : [...content];
    return this.page.evaluate(([name, parts]) => {
      const data = new DataTransfer();
      data.items.add(new File([typeof parts === "string" ? parts : new Uint8Array(parts)], name));
      for (const type of ["dragover", "drop"]) document.body.dispatchEvent(new DragEvent(type, { bubbles: true, cancelable: true, dataTransfer: data }));
    }, [name, parts]);
  }

  /** Sends a line from the field of the page. */
  async send(line) {
    await this.write(".log form input", line);
    await this.press("Enter");
    await until(`${line} is sent`, () => this.page.evaluate(() => document.querySelector(".log form input").value === ""));
  }

  /** What it shows: for who wants to know why it is not what was expected. */
  async state() {
    const parts = await this.page.evaluate(() => [".link", ".clock", ".bench .note", ".notice", ".timeline .when", ".log .entries"].map((selector) =>
      `${selector}: ${document.querySelector(selector)?.textContent.slice(-600)}`)).catch(String);
    return [...[parts].flat(), `carriage: ${await this.carriage().catch(String)}`, ...this.complaints].join("\n");
  }

  async carriage() {
    return ((await this.attribute(".stage", "data-carriage")) ?? "").split(" ").map(Number);
  }
}
