// What the tests stand on: the real program, a real browser, and a wait for what is to come.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { existsSync } from "node:fs";
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";
import { chromium } from "playwright-core";

const root = new URL("../../", import.meta.url);
const target = process.env.CARGO_TARGET_DIR ?? new URL("target", root).pathname;
export const program = process.env.VIMC4 ?? `${target}/debug/vimc4`;
const browserPath = process.env.CHROMIUM ?? "/usr/bin/chromium";

/** The program, which ends with its standard input, so that none is left behind. */
export async function serve(...options) {
  assert.ok(existsSync(program), `${program} is not there: cargo build`);
  const folder = await mkdtemp(join(tmpdir(), "panel-"));
  const options_ = ["serve", "--json", "--until-stdin-closes", "--pty", "none", "--tcp", "127.0.0.1:0", ...options];
  const child = spawn(program, options_, { cwd: folder, stdio: ["pipe", "pipe", "pipe"] });
  let told = "";
  child.stderr.on("data", (text) => (told += text));
  const first = await new Promise((resolve, reject) => {
    createInterface({ input: child.stdout }).once("line", resolve);
    child.once("exit", () => reject(new Error(`it has ended: ${told}`)));
    child.once("error", reject);
  });
  const { http, controllers: [{ tcp }] } = JSON.parse(first);
  const url = http.replace(/\/$/, "");
  return {
    url,
    port: Number(new URL(url).port),
    /** Where the line of the first controller is. */
    tcp: { host: tcp.split(":")[0], port: Number(tcp.split(":")[1]) },
    async ask(method, path, body) {
      const response = await fetch(`${url}/v1${path}`, {
        method, headers: { "Content-Type": "application/json" }, body: body && JSON.stringify(body),
      });
      const text = await response.text();
      assert.ok(response.ok, `${method} ${path}: ${text}`);
      return JSON.parse(text);
    },
    send(line, controller = 1) {
      return this.ask("POST", `/controllers/${controller}/line`, { send: `${line}\r` });
    },
    order(order, controller = 1) {
      return this.ask("POST", `/controllers/${controller}/orders`, { order });
    },
    async end() {
      const ended = new Promise((resolve) => child.once("exit", resolve));
      if (child.exitCode === null) {
        child.kill("SIGKILL");
        await ended;
      }
      await rm(folder, { recursive: true, force: true });
    },
  };
}

/** Runs the program to its end. */
export async function run(...options) {
  const child = spawn(program, options, { stdio: ["ignore", "ignore", "pipe"] });
  let told = "";
  child.stderr.on("data", (text) => (told += text));
  const code = await new Promise((resolve, reject) => {
    child.once("exit", resolve);
    child.once("error", reject);
  });
  // A command that is refused makes `run` end with 1, which a recording may well be of.
  assert.ok(code === 0 || code === 1, told);
}

/** A browser without a window, which draws in software. `more` are further arguments. */
export function browse(...more) {
  return chromium.launch({
    executablePath: browserPath,
    args: [
      "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage",
      // A page that the test itself has made counts as one of elsewhere.
      ...(process.env.PANEL_FROM_DISK ? ["--disable-features=LocalNetworkAccessChecks"] : []),
      ...more,
    ],
  });
}

/** An empty page, and everything that it will ask for or complain of. */
export async function blank(browser, options = {}) {
  const context = await browser.newContext({ locale: "en", viewport: { width: 1600, height: 1200 }, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(60_000);
  const asked = [];
  const complaints = [];
  page.on("request", (request) => asked.push(request.url()));
  page.on("websocket", (socket) => asked.push(socket.url()));
  page.on("console", (message) => message.type() === "error" && complaints.push(message.text()));
  page.on("pageerror", (error) => complaints.push(String(error)));
  return { page, context, asked, complaints };
}

/** A page on the panel; `before` is what it does before anything else. */
export async function open(browser, server, { before, ...options } = {}) {
  const opened = await blank(browser, options);
  if (before) await opened.page.addInitScript(before);
  if (process.env.PANEL_FROM_DISK) await fromDisk(opened.page, server);
  await opened.page.goto(server.url);
  return opened;
}

/** The files as they are on the disk, before a program has them. */
async function fromDisk(page, server) {
  const kinds = { html: "text/html", js: "text/javascript", css: "text/css", svg: "image/svg+xml", txt: "text/plain" };
  await page.route((url) => url.origin === server.url && !url.pathname.startsWith("/v1"), async (route) => {
    const path = new URL(route.request().url()).pathname;
    const name = path === "/" ? "index.html" : path.slice(1);
    const body = await readFile(new URL(`crates/api/web/dist/${name}`, root));
    const policy = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
    await route.fulfill({ body, contentType: kinds[name.split(".").at(-1)], headers: { "content-security-policy": policy } });
  });
}

/** Waits until something holds; a slow machine has all the time it needs. */
export async function until(what, look, limit = 60_000) {
  const end = Date.now() + limit;
  for (;;) {
    const found = await look();
    if (found) return found;
    if (Date.now() > end) throw new Error(`it never came that ${what}`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}
