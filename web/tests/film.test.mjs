// A recording as one file: opened from the disk, with no server anywhere.
import assert from "node:assert/strict";
import { mkdtemp, readFile, rm, stat, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { blank, browse, run, serve, until } from "./stand.mjs";

let browser;
before(async () => (browser = await browse("--enable-precise-memory-info")));
after(() => browser?.close());

/** A recording of what these lines do, as a page, opened. */
function film(lines, body) {
  const record = async (folder, recording) => {
    const commands = join(folder, "commands.txt");
    await writeFile(commands, `${lines.join("\n")}\n`);
    await run("run", commands, "--machine", "mill", "--record", recording);
  };
  return shown(record, body);
}

test("the reference run of a plotter is one", async () => {
  const record = (folder, recording) =>
    run("run", fileURLToPath(new URL("../../examples/board.plt", import.meta.url)), "--model", "smcu", "--machine", "board-plotter", "--record", recording);
  await shown(record, async (page) => {
    await page.getByRole("slider", { name: "Time line" }).focus();
    await page.keyboard.press("End");
    await until("all has happened", async () => (await page.locator(".entry.later").count()) === 0);
    assert.equal(await page.locator(".stage").getAttribute("data-kinds"), "reference rapid feed arc");
    assert.equal(await page.title(), "it.jsonl · smcu");
  });
});

/** A recording that `record` makes, as a page, opened. */
async function shown(record, body) {
  const folder = await mkdtemp(join(tmpdir(), "film-"));
  try {
    await record(folder, join(folder, "it.jsonl"));
    const page_ = join(folder, "it.html");
    await run("replay", join(folder, "it.jsonl"), "--html", page_);
    const { page, context, asked, complaints } = await blank(browser);
    const url = pathToFileURL(page_).href;
    try {
      const begin = Date.now();
      await page.goto(url);
      await page.locator(".timeline[data-at]").waitFor();
      await body(page, page_, Date.now() - begin);
      assert.deepEqual(asked.filter((address) => address !== url && !/^(data|blob):/.test(address)), [], "nothing is asked for");
      assert.deepEqual(complaints, [], "the browser complains of nothing");
    } finally {
      await context.close();
    }
  } finally {
    await rm(folder, { recursive: true, force: true });
  }
}

const carriage = async (page) => (await page.locator(".stage").getAttribute("data-carriage")).split(" ").map(Number);

test("a recording is scrubbed, by keys and by its entries, and nothing in it can be set", async () => {
  await film(["@07", "@0R7", "@0A2000,1000,0,900,0,900,0,900", "@0A0,900,1000,2000,0,900,0,900", "@0A5"], async (page) => {
    const begin = await carriage(page);
    const range = page.getByRole("slider", { name: "Time line" });
    await range.focus();
    await page.keyboard.press("End");
    await until("all has happened", async () => (await page.locator(".entry.later").count()) === 0);
    const end = await carriage(page);
    assert.equal(await page.locator(".stage").getAttribute("data-kinds"), "reference feed");
    assert.equal(await page.title(), "it.jsonl · imc4");
    assert.equal(await page.locator("h1").textContent(), "it.jsonl");
    // What was wrong is there with its meaning; an entry jumps to its moment.
    await page.locator(".entry-error", { hasText: "takes 8 numbers" }).waitFor();
    await page.locator(".entry", { hasText: "Y +1,000 steps" }).getByRole("button").first().click();
    await page.getByRole("button", { name: "Look at this moment" }).click();
    await until("the last motion is still to come", async () => (await carriage(page))[1] === end[1] - 1_000);
    assert.equal((await carriage(page))[0], end[0]);
    assert.ok((await page.locator(".entry.later").count()) >= 3);
    await page.getByRole("button", { name: "Next entry" }).click();
    await until("it has been made", async () => (await carriage(page))[1] === end[1]);
    // In the middle of a motion the carriage is in its middle.
    await range.evaluate((range) => {
      range.value = String(Number(range.value) - 250);
      range.dispatchEvent(new Event("input"));
    });
    await until("it is being made", async () => {
      const [, y] = await carriage(page);
      return y > end[1] - 1_000 && y < end[1];
    });
    await range.focus();
    await page.keyboard.press("Home");
    await until("it is as it began", async () => String(await carriage(page)) === String(begin));
    for (const part of [".clock", ".faults", ".log form", "footer"]) {
      assert.equal(await page.locator(part).isVisible(), false, part);
    }
    assert.equal(await page.locator(".plate").evaluate((plate) => plate.inert), true);
    await page.getByRole("combobox", { name: "Language" }).selectOption("de");
    await page.getByRole("slider", { name: "Zeitachse" }).waitFor();
    const axe = await readFile(new URL("../node_modules/axe-core/axe.min.js", import.meta.url), "utf8");
    await page.evaluate(axe);
    const found = await page.evaluate(async () => (await window.axe.run()).violations.map(({ id, nodes }) => `${id}: ${nodes[0].html}`));
    assert.deepEqual(found, []);
  });
});

test("who went back is shown on the way that led to the end, and speeds are those of what is shown", async () => {
  const record = async (_, recording) => {
    const server = await serve("--machine", "mill", "--time", "manual", "--web", "--record", recording);
    const one = "/controllers/1";
    const advance = (span) => server.ask("POST", `${one}/clock/advance`, { span });
    try {
      await server.send("@01");
      await advance("1s");
      await server.ask("POST", `${one}/snapshots`);
      await server.send("@0A900,900");
      await advance("2s");
      await server.ask("POST", `${one}/snapshots/1/restore`);
      await server.send("@0A-1800,900");
      await advance("3s");
      await server.send("@0P");
    } finally {
      await server.end();
    }
  };
  await shown(record, async (page) => {
    const range = page.getByRole("slider", { name: "Time line" });
    const [begin] = await carriage(page);
    await range.focus();
    await page.keyboard.press("End");
    await until("it is at the end", async () => (await carriage(page))[0] === begin - 1_800);
    assert.equal(await page.locator(".entry", { hasText: "@0A900,900" }).count(), 0);
    await page.locator(".entry", { hasText: "@0P" }).first().waitFor();
    await page.locator(".timeline", { hasText: "1 × somebody went back" }).waitFor();
    // 1,800 steps in two seconds are 11.25 mm/s, at the moment between.
    await range.evaluate((range) => {
      range.value = "2000";
      range.dispatchEvent(new Event("input"));
    });
    const speed = page.locator(".axes tbody tr").first().locator("td").nth(2);
    await until("it moves", async () => Math.abs((await carriage(page))[0] - (begin - 900)) < 20);
    const [, figure] = /^(-[\d.]+) mm/.exec((await speed.textContent()).replace("−", "-")) ?? [];
    assert.ok(Math.abs(Number(figure) + 11.2) < 0.15, await speed.textContent());
  });
});

/** So many motions, of which each has some eight entries. With 12,000 it is as long as it can be without loss. */
const MOTIONS = Number(process.env.FILM_MOTIONS ?? 1_500);

test("a long recording is small, opens and is scrubbed", async () => {
  const lines = ["@07"];
  for (let i = 0; i < MOTIONS; i++) lines.push(`@0A${i % 2 ? "-" : ""}${20 + (i % 7)},5000,${i % 3},5000,0,900,0,900`);
  await film(lines, async (page, file, opened) => {
    const { size } = await stat(file);
    assert.ok(size < 800_000 + 200 * MOTIONS, `${size} bytes`);
    const range = page.getByRole("slider", { name: "Time line" });
    await range.focus();
    await page.keyboard.press("End");
    await until("all has happened", async () => Number(await page.locator(".stage").getAttribute("data-corners")) >= MOTIONS);
    const worst = await page.evaluate(async () => {
      const range = document.querySelector(".scrub");
      let worst = 0;
      for (let i = 0; i < 20; i++) {
        const begin = performance.now();
        range.value = String((Number(range.max) * ((i * 7) % 20)) / 20);
        range.dispatchEvent(new Event("input"));
        await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
        worst = Math.max(worst, performance.now() - begin);
      }
      return worst;
    });
    const used = await page.evaluate(() => performance.memory.usedJSHeapSize);
    console.log(`${size} bytes, there after ${opened} ms, ${Math.round(worst)} ms for the longest of 20 jumps, ${(used / 1e6).toFixed(0)} MB`);
    await until("it is drawn where it is", async () => (await page.locator(".entry.later").count()) > 0);
  });
});

test("a recording that contradicts the emulation says so, marks the place, and shows either reply", async () => {
  const example = fileURLToPath(new URL("../../examples/overlooked.jsonl", import.meta.url));
  const record = async (_, recording) => writeFile(recording, (await readFile(example, "utf8")).replace('"out":"F"', '"out":"0"'));
  await shown(record, async (page) => {
    await page.locator(".differs-from", { hasText: "differs from the recording from 8.698 s on" }).waitFor();
    const reply = page.locator(".entry-differs .text");
    assert.equal(await reply.textContent(), "F (emulated; recorded 0)");
    await page.getByRole("button", { name: "Show recorded replies" }).click();
    await until("the recorded reply is shown", async () => (await reply.textContent()) === "0 (recorded; emulated F)");
    await page.getByRole("button", { name: "Show emulated replies" }).click();
    await until("the emulated reply is shown", async () => (await reply.textContent()) === "F (emulated; recorded 0)");
    await page.locator(".differs summary").click();
    await page.locator(".differs li", { hasText: "recorded 0, emulated F" }).getByRole("button").click();
    await until("its moment is shown", async () => (await page.locator(".timeline").getAttribute("data-at")) === "8698321617");
  });
});

test("a recording that was cut off says so", async () => {
  const record = async (_, recording) => {
    const whole = await readFile(new URL("../../examples/limit.jsonl", import.meta.url), "utf8");
    await writeFile(recording, whole.slice(0, 9_000));
  };
  await shown(record, (page) => page.locator(".timeline", { hasText: "the recording is cut off" }).waitFor());
});
