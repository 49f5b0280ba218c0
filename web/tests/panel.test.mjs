// The panel in a real browser, with the real program behind it.
import assert from "node:assert/strict";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { isDeepStrictEqual } from "node:util";
import { browse, open, serve, until } from "./stand.mjs";

let browser;
before(async () => (browser = await browse()));
after(() => browser?.close());

/** A test with a server of its own, which is ended whatever comes of it. */
function with_(options, name, body) {
  test(name, async () => {
    const server = await serve(...options);
    const pages = [];
    const opened = async (more) => {
      const one = await open(browser, server, more);
      pages.push(one);
      await one.page.getByText("connected", { exact: true }).or(one.page.getByText("verbunden", { exact: true })).waitFor();
      return one;
    };
    try {
      await body(server, opened);
      for (const { asked, complaints } of pages) {
        const own = [server.url, server.url.replace("http", "ws")];
        const foreign = asked.filter((url) => !own.some((start) => url.startsWith(`${start}/`)));
        assert.deepEqual(foreign, [], "no request leaves for elsewhere");
        assert.deepEqual(complaints, [], "the browser complains of nothing");
      }
    } finally {
      for (const { context } of pages) await context.close();
      await server.end();
    }
  });
}

const knob = (page, signal) => page.locator(`.knob[data-signal="${signal}"]`);
const carriage = async (page) => {
  const text = await page.locator(".stage").getAttribute("data-carriage");
  return (text ?? "").split(" ").map(Number);
};
const corners = async (page) => Number(await page.locator(".stage").getAttribute("data-corners"));
const said = (page, text) => page.locator(".entry", { hasText: text }).first();

with_(["--web"], "a carriage is seen to move, STOP stops it with F and its meaning, START goes on", async (server, opened) => {
  const { page } = await opened();
  await server.send("@07");
  await server.send("@0A4000,500,0,900,0,900,0,900");
  const first = await until("the carriage moves", async () => (await carriage(page))[0] || null);
  await until("it goes on", async () => (await carriage(page))[0] > first);
  assert.equal(await page.locator(".front .state").textContent(), "move");
  await knob(page, "stop").click();
  await said(page, /^[\d.,]+ s←F.*stopped by STOP/).waitFor();
  await until("it rests", async () => (await page.locator(".front .state").textContent()) === "idle");
  const [held] = await carriage(page);
  const trace = await page.locator(".stage").getAttribute("data-tool");
  assert.ok(held > 0 && held < 4_000, `${held}`);
  const x = page.locator(".axes tbody tr").first().locator("td").first();
  await until("X is shown in millimetres", async () => {
    const [, figure] = /^([\d.]+) mm$/.exec(await x.textContent()) ?? [];
    return Math.abs(Number(figure) - held / 80) < 0.001;
  });
  // The path is one line, to where it was stopped.
  await until("the path is drawn", async () => (await corners(page)) === 2);
  await knob(page, "start").click();
  await server.send("@0S");
  await until("it arrives", async () => (await carriage(page))[0] === 4_000);
  await until("the tool is drawn elsewhere", async () => (await page.locator(".stage").getAttribute("data-tool")) !== trace);
});

with_(["--web"], "what is wrong is told with its meaning, can be searched for, and is never a part of the page", async (server, opened) => {
  const { page } = await opened();
  await server.send("@07");
  await server.send("@0A5");
  await server.send("@0<img src=/v1/nothing onerror=document.title='struck'><b id=struck>x</b>");
  await server.send("@0P");
  const wrong = said(page, "takes 8 numbers, 1 came");
  await wrong.waitFor();
  await page.getByRole("searchbox").fill("read position");
  await until("one entry is left", async () => (await page.locator(".entry").count()) === 1);
  await page.getByRole("searchbox").fill("");
  await said(page, "<b id=struck>").waitFor();
  assert.equal(await page.locator("#struck").count(), 0);
  await page.getByRole("combobox", { name: "Show" }).selectOption("problems");
  await wrong.getByRole("button").click();
  await wrong.locator("dd", { hasText: /^7$/ }).waitFor();
  // A field of the page sends as a host does.
  await page.getByRole("combobox", { name: "Show" }).selectOption("talk");
  await page.getByRole("textbox", { name: /Send to the controller/ }).fill("@0A1,900,0,900,0,900,0,900");
  await page.keyboard.press("Enter");
  await until("it has moved", async () => (await carriage(page))[0] === 1);
});

with_(["--web", "--machine", "mill", "--time", "8x"], "ways are told apart, and all is there again after a reload", async (server, opened) => {
  const { page } = await opened();
  await server.send("@07");
  await server.send("@0R7");
  await until("it is referenced", async () => (await page.locator(".referenced[data-on=true]").count()) === 3);
  await server.send("@0M2000,20000,1000,10000,-500,900,0,900");
  await server.send("@0M3000,900,1000,900,-500,900,0,900");
  await server.send("@0f-1");
  await server.send("@0y4000,900,-250,500,0,-1,1");
  const idle = async () => (await server.ask("GET", "/controllers/1/view")).activity === "idle";
  await until("it has moved", async () => (await corners(page)) > 40 && idle());
  const kinds = await page.locator(".stage").getAttribute("data-kinds");
  assert.equal(kinds, "reference rapid feed arc");
  const before = [3_000, 1_000, -500, 0];
  await until("it is seen at rest", async () => isDeepStrictEqual(await carriage(page), before));
  const drawn = await corners(page);
  await page.reload();
  await until("the path is there again", async () => (await corners(page)) === drawn);
  await until("the carriage is where it was", async () => isDeepStrictEqual(await carriage(page), before));
  for (const way of ["Top XY", "Front XZ", "Side YZ", "Isometric"]) {
    await page.getByRole("button", { name: way }).click();
    assert.equal(await page.getByRole("button", { name: way }).getAttribute("aria-pressed"), "true");
  }
  await page.getByRole("button", { name: "steps", exact: true }).click();
  const z = page.locator(".axes tbody tr").nth(2).locator("td").first();
  await until("Z is shown in steps", async () => (await z.textContent()) === "-500");
  // Something is drawn, and not all in one colour.
  const picture = await page.locator(".stage").screenshot();
  const colours = await page.evaluate(async (bytes) => {
    const image = await createImageBitmap(new Blob([new Uint8Array(bytes)], { type: "image/png" }));
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    return new Set(new Uint32Array(context.getImageData(0, 0, image.width, image.height).data.buffer)).size;
  }, [...picture]);
  assert.ok(colours > 20, `${colours} colours`);
});

with_(["--web"], "two browsers see what either does", async (server, opened) => {
  const [one, two] = [await opened(), await opened()];
  await knob(one.page, "estop").click();
  await until("both see it held", async () =>
    (await knob(one.page, "estop").getAttribute("aria-pressed")) === "true" &&
    (await knob(two.page, "estop").getAttribute("aria-pressed")) === "true");
  await knob(two.page, "estop").click();
  await until("the first sees it released", async () => (await knob(one.page, "estop").getAttribute("aria-pressed")) === "false");
  await two.page.locator('[data-signal="cover"][data-position="open"]').click();
  await until("the first sees the cover open", async () =>
    (await one.page.locator('[data-signal="cover"][data-position="open"]').getAttribute("aria-pressed")) === "true");
  await two.page.locator('[data-signal="input 0.2"]').click();
  await until("the first sees the input", async () =>
    (await one.page.locator('[data-signal="input 0.2"]').getAttribute("aria-checked")) === "true");
  await one.page.getByRole("button", { name: "Switch off" }).click();
  await two.page.getByRole("button", { name: "Switch on" }).waitFor();
  assert.equal(await two.page.locator(".front .state").textContent(), "off");
});

with_(["--web", "--machine", "mill"], "the tool is drawn where the carriages are", async (server, opened) => {
  const { page } = await opened();
  await page.getByRole("button", { name: "Top XY" }).click();
  // At power-on the carriages of this machine stand at 4,000 of 24,000 and of 16,000 steps.
  await until("the tool is there", async () => (await carriage(page))[0] === 4_000);
  const marks = async () => {
    const read = async (name) => (await page.locator(".stage").getAttribute(name)).split(" ").map(Number);
    return { tool: await read("data-tool"), x: await read("data-x"), y: await read("data-y") };
  };
  const near = (found, expected) => Math.abs(found - expected) < 0.01;
  // How far the tool is from the corner of the table, between the ends of its edges.
  await until("it stands at a sixth and a quarter", async () => {
    const { tool, x, y } = await marks();
    const [right, up] = [(tool[0] - y[0]) / (x[0] - y[0]), (tool[1] - x[1]) / (y[1] - x[1])];
    return near(right, 4_001 / 24_002) && near(up, 4_001 / 16_002);
  });
  await page.getByRole("button", { name: "Front XZ" }).click();
  await until("it stands a sixth from the left", async () => {
    const { tool, x, y } = await marks();
    return near((tool[0] - y[0]) / (x[0] - y[0]), 4_001 / 24_002);
  });
});

test("a server with a token asks for it, and the licences of what is bundled are there", async () => {
  const folder = await mkdtemp(join(tmpdir(), "token-"));
  await writeFile(join(folder, "token"), "0123456789abcdef");
  const server = await serve("--web", "--http-token", join(folder, "token"));
  const { page, context } = await open(browser, server);
  try {
    await page.getByRole("textbox", { name: "Token" }).fill("0123456789abcdee");
    await page.keyboard.press("Enter");
    await until("it is asked for again", async () => (await page.getByRole("textbox", { name: "Token" }).inputValue()) === "");
    await page.getByRole("textbox", { name: "Token" }).fill("0123456789abcdef");
    await page.keyboard.press("Enter");
    await page.getByText("connected", { exact: true }).waitFor();
    await until("START is there", () => knob(page, "start").isVisible());
    assert.ok(!page.url().includes("0123456789"));
    await page.getByRole("link", { name: "Licences" }).click();
    await page.getByText(/three\.js/).first().waitFor();
  } finally {
    await context.close();
    await server.end();
    await rm(folder, { recursive: true });
  }
});

test("a server that is killed is found again when it is back", async () => {
  let server = await serve("--web");
  const { page, context } = await open(browser, server);
  try {
    await server.send("@07");
    await said(page, "set axes").waitFor();
    await server.end();
    await page.getByText("connection lost").waitFor();
    server = await serve("--http", `127.0.0.1:${server.port}`);
    await page.getByText("connected", { exact: true }).waitFor();
    await until("what was before is gone", async () => (await page.locator(".entry").count()) === 0);
    await server.send("@0P");
    await said(page, "read position").waitFor();
  } finally {
    await context.close();
    await server.end();
  }
});

with_(["--web", "--count", "3"], "several controllers are seen at a glance", async (server, opened) => {
  const { page } = await opened();
  const tabs = page.locator(".tab");
  assert.equal(await tabs.count(), 3);
  await server.send("@07", 3);
  await server.send("@0A5000,500,0,900,0,900,0,900", 3);
  await until("the third moves", async () => (await tabs.nth(2).textContent())?.includes("move"));
  assert.ok((await tabs.nth(0).textContent())?.includes("idle"));
  await tabs.nth(2).click();
  await until("its carriage is shown", async () => (await carriage(page))[0] > 0);
});

with_(["--web"], "time is paused, stepped, made quicker, and broken at a condition", async (server, opened) => {
  const { page, complaints } = await opened();
  await page.getByRole("button", { name: "Pause" }).click();
  await page.getByText("paused", { exact: true }).waitFor();
  const at = await page.locator(".now").textContent();
  await page.getByRole("button", { name: "Step", exact: true }).click();
  assert.equal(await page.locator(".now").textContent(), at, "nothing is to come, so time stands still");
  await page.getByRole("button", { name: "Resume" }).click();
  // Every pace that is offered is taken.
  const pace = page.getByRole("combobox", { name: "Pace" });
  const offered = await pace.locator("option").evaluateAll((options) => options.map(({ value }) => value));
  assert.ok(offered.includes("8x"), offered.join());
  for (const one of [...offered, "8x"]) {
    await pace.selectOption(one);
    await until(`the pace is ${one}`, async () => (await server.ask("GET", "/controllers/1/clock")).clock === one);
  }
  await page.getByRole("textbox", { name: "Condition" }).fill("x > 100");
  await page.getByRole("button", { name: "Add" }).click();
  await page.locator(".list code", { hasText: "100" }).waitFor();
  await page.getByRole("button", { name: "Keep this moment" }).click();
  await page.getByRole("button", { name: /^Go back there/ }).waitFor();
  await server.send("@07");
  await server.send("@0A4000,900,0,900,0,900,0,900");
  await page.locator(".list .hit").waitFor();
  await until("it stands where the condition was met", async () => (await carriage(page))[0] === 101);
  await page.getByRole("button", { name: /^Go back there/ }).click();
  await until("it is back", async () => (await carriage(page))[0] === 0);
  // A refusal is there until something else is done, or Escape.
  const refusal = page.locator('.notice[data-error="true"]');
  for (const end of [
    () => page.keyboard.press("Escape"),
    async () => {
      await page.getByRole("textbox", { name: "Condition" }).fill("x > 1000");
      await page.getByRole("button", { name: "Add" }).click();
    },
    () => page.getByRole("slider", { name: "Time line" }).press("Home"),
  ]) {
    await page.getByRole("textbox", { name: "Condition" }).fill("nonsense");
    await page.getByRole("button", { name: "Add" }).click();
    await refusal.waitFor();
    await end();
    await refusal.waitFor({ state: "hidden" });
    // The browser notes the refusal, as it should.
    complaints.splice(complaints.findIndex((text) => text.includes("422")), 1);
  }
});

with_(["--web", "--time", "manual"], "a clock by hand is moved on by hand", async (server, opened) => {
  const { page } = await opened();
  await server.send("@07");
  await server.send("@0A4000,1000,0,900,0,900,0,900");
  await page.getByRole("textbox", { name: "Run until" }).fill("x > 500");
  await page.locator("form", { hasText: "Run until" }).getByRole("button").click();
  await until("it is there", async () => (await carriage(page))[0] === 501);
  await page.getByRole("textbox", { name: "Advance by" }).fill("10s");
  await page.locator("form", { hasText: "Advance by" }).getByRole("button").click();
  await until("it has arrived", async () => (await carriage(page))[0] === 4_000);
});

with_(["--web", "--time", "8x"], "the stored program is listed, with a marker where it is", async (server, opened) => {
  const { page } = await opened();
  await page.getByText("No program is stored.").waitFor();
  await server.send("@07");
  await server.send("@0i");
  for (const line of ["030,100,0,100,0,100,0,100", "0-30,100,0,100,0,100,0,100", "3 100,-2", "9"]) await server.send(line);
  await until("all lines are there", async () => (await page.locator(".program-lines li").count()) >= 3);
  // A breakpoint at a click, and by key.
  const point = page.getByRole("button", { name: "Breakpoint at line 2" });
  await point.click();
  await until("it is set", async () => (await point.getAttribute("aria-pressed")) === "true");
  await knob(page, "start").click();
  const marked = () => page.locator(".program-lines").evaluate((list) => [...list.children].findIndex((row) => row.hasAttribute("aria-current")));
  const paused = async () => (await server.ask("GET", "/controllers/1/clock")).paused !== null;
  await until("it waits at the second line", async () => (await paused()) && (await marked()) === 1);
  await page.getByRole("button", { name: "Continue" }).click();
  await page.locator(".rounds", { hasText: "more rounds" }).waitFor();
  await until("it waits there again", async () => (await paused()) && (await marked()) === 1);
  await point.focus();
  await page.keyboard.press("Enter");
  await until("the breakpoint is gone", async () => (await point.getAttribute("aria-pressed")) === "false");
  // From line to line, forward and back, where the controller stays.
  const { now: at } = await server.ask("GET", "/controllers/1/clock");
  await page.getByRole("button", { name: "A line on" }).click();
  await until("a line on", async () => (await server.ask("GET", "/controllers/1/clock")).now > at);
  const { axes: [before] } = await server.ask("GET", "/controllers/1/view");
  await page.getByRole("button", { name: "A line back" }).click();
  await until("a line back", async () => (await lookedAt(page)) === at && (await marked()) === 1 && isPast(page));
  assert.equal((await server.ask("GET", "/controllers/1/view")).axes[0].position, before.position);
  await page.getByRole("button", { name: "Continue" }).click();
  await until("it goes on", async () => !(await isPast(page)) && !(await paused()));
  // Nothing is refused where nothing was paused before.
  await page.getByRole("button", { name: "A line on" }).click();
  await until("it is looked at", paused);
  await page.getByRole("button", { name: "Continue" }).click();
  await until("it goes on again", async () => !(await paused()));
  await page.waitForTimeout(300);
  assert.equal(await page.locator('.notice[data-error="true"]').count(), 0);
});

with_(["--web", "--machine", "mill"], "a slow computer draws coarsely while the machine is turned, says so, and draws everything at rest", async (server, opened) => {
  const { page } = await opened();
  await server.send("@07");
  await server.send("@0A2000,10000,0,900,0,900,0,900");
  await until("the path is drawn", async () => (await corners(page)) === 2);
  const stage = page.locator(".stage");
  const canvas = page.locator(".stage canvas");
  const isCoarse = async () => (await stage.getAttribute("data-coarse")) === "true";
  const pixels = () => canvas.evaluate((canvas) => canvas.width / canvas.clientWidth);
  await until("all is drawn", async () => !(await isCoarse()) && (await pixels()) === 1);
  const devtools = await page.context().newCDPSession(page);
  await devtools.send("Emulation.setCPUThrottlingRate", { rate: 50 });
  const { x, y, width, height } = await canvas.boundingBox();
  await page.mouse.move(x + width / 2, y + height / 2);
  await page.mouse.down();
  let turn = 0;
  await until("less is drawn", async () => {
    turn += 1;
    await page.mouse.move(x + width / 2 + 100 * Math.sin(turn / 5), y + height / 2);
    return (await isCoarse()) && (await pixels()) < 0.8;
  });
  assert.equal(await page.locator(".coarse").evaluate((note) => getComputedStyle(note).visibility), "visible");
  await page.mouse.up();
  await devtools.send("Emulation.setCPUThrottlingRate", { rate: 1 });
  await until("all is drawn again", async () => !(await isCoarse()) && (await pixels()) === 1);
  assert.equal(await page.locator(".coarse").evaluate((note) => getComputedStyle(note).visibility), "hidden");
});

with_(["--web"], "a double click does once what a second click would undo", async (server, opened) => {
  const { page } = await opened();
  await knob(page, "estop").dblclick();
  await until("it is held", async () => (await knob(page, "estop").getAttribute("aria-pressed")) === "true");
  await page.getByRole("textbox", { name: "Condition" }).fill("x > 100");
  await page.getByRole("button", { name: "Add" }).dblclick();
  await page.getByRole("button", { name: "Keep this moment" }).dblclick();
  await page.getByRole("button", { name: "Jam X" }).dblclick();
  await page.locator(".faults .list li", { hasText: "jam x" }).waitFor();
  const count = async (what) => (await server.ask("GET", `/controllers/1/${what}`)).length;
  assert.deepEqual([await count("breakpoints"), await count("snapshots"), await count("faults")], [1, 1, 1]);
  assert.equal(await knob(page, "estop").getAttribute("aria-pressed"), "true");
  // Two clicks are two.
  await new Promise((resolve) => setTimeout(resolve, 1_000));
  await knob(page, "estop").click();
  await until("it is released", async () => (await knob(page, "estop").getAttribute("aria-pressed")) === "false");
});

with_(["--web"], "a fault begins at a click, and ends at another", async (server, opened) => {
  const { page } = await opened();
  await page.getByRole("button", { name: "Jam X" }).click();
  const row = page.locator(".faults .list li", { hasText: "jam x" });
  await row.waitFor();
  assert.equal((await server.ask("GET", "/controllers/1/faults"))[0].fault, "jam x");
  await row.getByRole("button").click();
  await until("it is gone", async () => (await page.locator(".faults .list li").count()) === 0);
  await page.getByRole("combobox", { name: "Another fault" }).fill("drop to-host once after @0P");
  await page.keyboard.press("Enter");
  await page.locator(".faults .list code", { hasText: "drop" }).waitFor();
  // A rule is typed there as well.
  await page.getByRole("combobox", { name: "Another fault, or a rule" }).fill("when x > 90000: press stop");
  await page.locator(".faults form button").click();
  await page.locator(".faults .list code", { hasText: "when x > 90000" }).waitFor();
  assert.equal((await server.ask("GET", "/controllers/1/rules"))[0].rule, "when x > 90000: press stop");
  await page.locator(".faults .list button", { hasText: "End all" }).click();
  await until("all have ended", async () => (await page.locator(".faults .list li").count()) === 0);
});

const line = (page) => page.locator(".timeline");
const lookedAt = async (page) => Number(await line(page).getAttribute("data-at"));
const isPast = async (page) => (await line(page).getAttribute("data-past")) === "true";

with_(["--web"], "STOP says F, the past is scrubbed, branches at the emergency stop, and is taken over", async (server, opened) => {
  const { page } = await opened();
  await server.send("@01");
  await server.send("@0A40000,500");
  await until("it moves", async () => (await carriage(page))[0] > 300);
  await knob(page, "stop").click();
  await said(page, /^[\d.,]+ s←F.*stopped by STOP/).waitFor();
  await until("it rests", async () => (await page.locator(".front .state").textContent()) === "idle");
  const [held] = await carriage(page);
  const drawn = await corners(page);
  // By the arrow key: to the answer, to STOP, to the command …
  const range = page.getByRole("slider", { name: "Time line" });
  await range.focus();
  await until("the past is seen", async () => {
    await page.keyboard.press("ArrowLeft");
    return isPast(page);
  });
  await page.getByText("This is past.").waitFor();
  assert.equal((await server.ask("GET", "/controllers/1/clock")).paused.by, "the API");
  // An entry jumps to its moment: there the motion has not begun.
  const command = said(page, "relative move X +40,000");
  await command.getByRole("button").first().click();
  await page.getByRole("button", { name: "Look at this moment" }).click();
  await until("it has not moved", async () => (await carriage(page))[0] === 0);
  assert.ok((await page.locator(".entry.later").count()) >= 1, "what came later is there, and told apart");
  const begin = await lookedAt(page);
  // By the mouse, half the way to STOP.
  const box = await page.locator(".marks").boundingBox();
  const shares = await page.locator(".timeline").evaluate((card) => {
    const range = card.querySelector(".scrub");
    return { value: Number(range.value), max: Number(range.max) };
  });
  const { now } = await server.ask("GET", "/controllers/1/history");
  const x = box.width * (shares.value / shares.max + (1 - shares.value / shares.max) / 4);
  await page.mouse.move(box.x + x, box.y + 12);
  await page.mouse.down();
  await page.mouse.move(box.x + x + 3, box.y + 12, { steps: 3 });
  await page.mouse.up();
  await until("it is between", async () => {
    const [at] = await carriage(page);
    return at > 0 && at <= held && (await lookedAt(page)) > begin && (await lookedAt(page)) < now.at;
  });
  const settled = async () => {
    let before;
    for (;;) {
      const looked = await lookedAt(page);
      if (looked === before) return looked;
      before = looked;
      await page.waitForTimeout(300);
    }
  };
  await settled();
  // The emergency stop, there: a branch with its own end, while the controller stays where it is.
  await knob(page, "estop").click();
  await page.locator(".branches button", { hasText: "estop pressed" }).waitFor();
  await until("the branch is looked at", async () => (await line(page).getAttribute("data-branch")) === "1");
  assert.equal(await knob(page, "estop").getAttribute("aria-pressed"), "true");
  assert.equal((await server.ask("GET", "/controllers/1/view")).axes[0].carriage, held);
  assert.ok((await corners(page)) >= 2, "the path leads to where it was stopped");
  // Back to the first way, and to the present of the controller.
  await page.locator(".branches button", { hasText: "main" }).first().click();
  await until("it is before all", async () => (await line(page).getAttribute("data-branch")) === "0");
  await page.getByRole("button", { name: "To the present" }).click();
  await until("the present is seen", async () => (await carriage(page))[0] === held && !(await isPast(page)));
  assert.equal(await corners(page), drawn);
  // Another browser sees the same moment; from the branch the controller goes on.
  await page.locator(".branches button", { hasText: "estop pressed" }).click();
  await until("the branch is seen", () => isPast(page));
  const other = await opened();
  await until("the other browser sees it, too", () => isPast(other.page));
  // So does the first what the other does there.
  const before = await lookedAt(page);
  await other.page.getByRole("slider", { name: "Time line" }).focus();
  await other.page.keyboard.press("ArrowLeft");
  await until("both see an earlier moment", async () => (await lookedAt(page)) < before && (await lookedAt(page)) === (await lookedAt(other.page)));
  await other.page.locator(".branches button", { hasText: "estop pressed" }).click();
  await until("the branch is seen again", async () => (await lookedAt(page)) >= before);
  await page.getByRole("button", { name: "Go on from here" }).click();
  await until("it is the present", async () => !(await isPast(page)) && !(await isPast(other.page)));
  await until("the emergency stop is held", async () => (await knob(page, "estop").getAttribute("aria-pressed")) === "true");
  assert.equal((await server.ask("GET", "/controllers/1/clock")).paused, null);
  // Both browsers mark where what really happened parts, among commands and answers, too.
  for (const own of [page, other.page]) {
    await own.locator(".entry-left", { hasText: "The controller left this moment and goes on from another one" }).waitFor();
    assert.equal(await own.locator(".entry-left").count(), 1);
  }
  const { carriage: there } = (await server.ask("GET", "/controllers/1/view")).axes[0];
  assert.ok(there > 0 && there < held, `${there}`);
  // What happened on the way that was left is looked at there.
  await said(page, /^[\d.,]+ s←F.*stopped by STOP/).getByRole("button").first().click();
  await page.getByRole("button", { name: "Look at this moment" }).click();
  await until("it has come to where STOP held it", async () => (await isPast(page)) && (await carriage(page))[0] === held);
  assert.equal(await line(page).getAttribute("data-branch"), "0");
});

with_(["--web"], "whoever leaves the past finds the present as it was, and goes on", async (server, opened) => {
  const { page } = await opened({ locale: "de", viewport: { width: 390, height: 844 } });
  await server.send("@01");
  await server.send("@0A2000,500");
  await until("it moves", async () => (await carriage(page))[0] > 100);
  const range = page.getByRole("slider", { name: "Zeitachse" });
  await range.focus();
  await page.keyboard.press("Home");
  await page.getByText("Das ist Vergangenheit.").waitFor();
  await until("nothing has happened yet", async () => (await page.locator(".entry:not(.later)").count()) === 0);
  // What belongs to the present cannot be set meanwhile.
  assert.equal(await page.locator(".faults").evaluate((card) => card.inert), true);
  const width = await page.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(width <= 390, `it is ${width} wide`);
  await page.getByRole("button", { name: "Vergangenheit verlassen" }).click();
  await until("it goes on and arrives", async () => (await carriage(page))[0] === 2_000);
  assert.equal(await page.locator(".faults").evaluate((card) => card.inert), false);
});

with_(["--web", "--model", "smcu", "--machine", "board-plotter"], "a controller of LPKF has what it has", async (_, opened) => {
  const { page } = await opened();
  await until("STOP is there", async () => (await page.locator(".knob").count()) === 1);
  assert.equal(await page.locator(".program").isVisible(), false);
  assert.equal(await page.locator(".axes tbody tr").count(), 2);
});

with_(["--web"], "it speaks German, works by keyboard alone, and fits a phone", async (server, opened) => {
  const { page, complaints } = await opened({ locale: "de", viewport: { width: 390, height: 844 } });
  assert.equal(await page.locator("html").getAttribute("lang"), "de");
  await page.getByRole("heading", { name: "Bedienfeld" }).waitFor();
  assert.equal(await knob(page, "start").getAttribute("title"), "Taste START");
  // What the server says is English, and a screen reader knows it.
  await page.getByText("steht hier auf Englisch").waitFor();
  await server.send("@07");
  await server.send("@0A5");
  await said(page, "takes 8 numbers").waitFor();
  assert.equal(await said(page, "takes 8 numbers").locator(".text").getAttribute("lang"), "en");
  // It also says what would be right for a person, and nothing of requests.
  await page.getByRole("textbox", { name: "Laufen bis" }).fill("x >");
  await page.locator("form", { hasText: "Laufen bis" }).getByRole("button").click();
  const refused = page.locator('.notice[data-error="true"]', { hasText: "Abgelehnt" });
  await refused.waitFor();
  const why = await refused.locator('[lang="en"]').textContent();
  assert.match(why, /^`x >` is not finished — a position in steps/);
  complaints.splice(complaints.findIndex((text) => text.includes("422")), 1);
  await refused.getByRole("button").click();
  // All viewers see the name of a moment, in whichever language.
  await page.getByRole("button", { name: "Diesen Moment festhalten" }).click();
  await page.getByText(/^Moment 1 · /).waitFor();
  await page.getByText("verbunden", { exact: true }).waitFor();
  const width = await page.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(width <= 390, `it is ${width} wide`);
  await knob(page, "stop").waitFor();
  for (let i = 0; ; i++) {
    assert.ok(i < 200, "STOP can be reached by Tab");
    await page.keyboard.press("Tab");
    const signal = await page.evaluate(() => document.activeElement?.getAttribute("data-signal"));
    if (signal === "stop") break;
  }
  await page.keyboard.press("Enter");
  await until("STOP was pressed", async () => {
    const { entries } = await server.ask("GET", "/controllers/1/journal?after=0&limit=100");
    return entries.some((entry) => entry.text?.includes("press stop"));
  });
  await page.getByRole("combobox", { name: "Sprache" }).selectOption("en");
  await page.getByRole("heading", { name: "Front panel" }).waitFor();
});

with_(["--web", "--machine", "mill", "--count", "2"], "it can be read at four times its size", async (_, opened) => {
  // A window of 1,280 by 1,024 at 400 %.
  for (const locale of ["en", "de"]) {
    const { page } = await opened({ locale, viewport: { width: 320, height: 256 } });
    const width = await page.evaluate(() => document.documentElement.scrollWidth);
    assert.ok(width <= 320, `it is ${width} wide`);
    const outside = await page.evaluate(() => [...document.querySelectorAll("header *, main button, main input, main select")]
      .filter((element) => element.checkVisibility() && !element.closest(".skip") && !element.closest(".labels"))
      .filter((element) => element.getBoundingClientRect().right > 321).map((element) => element.outerHTML.slice(0, 120)));
    assert.deepEqual(outside, []);
    const head = await page.locator("header").boundingBox();
    assert.ok(head.height < 256, `the head is ${head.height} high`);
    if (process.env.PANEL_SHOW) await page.screenshot({ path: `${process.env.PANEL_SHOW}/zoom-${locale}.png` });
  }
});

with_(["--web", "--machine", "mill", "--count", "2"], "axe finds nothing to complain of, in light, dark and small", async (server, opened) => {
  const axe = await readFile(new URL("../node_modules/axe-core/axe.min.js", import.meta.url), "utf8");
  const { page } = await opened();
  await server.send("@07");
  await server.send("@0A5");
  await said(page, "takes 8 numbers").waitFor();
  await page.getByRole("button", { name: "Jam X" }).click();
  for (const [colorScheme, width] of [["light", 1600], ["dark", 1600], ["light", 390], ["dark", 390]]) {
    await page.emulateMedia({ colorScheme });
    await page.setViewportSize({ width, height: 1000 });
    // Given to the debugger as an expression: the page itself may run nothing but its own file.
    await page.evaluate(axe);
    const found = await page.evaluate(async () => {
      const { violations } = await window.axe.run();
      return violations.flatMap(({ id, nodes }) => nodes.map((node) => `${id}: ${node.html.slice(0, 160)} ${node.failureSummary}`));
    });
    assert.deepEqual(found, [], `${colorScheme} ${width}`);
  }
});
