// The controllers as WebAssembly, in Node.js: they send what the native ones send, at the same times, and
// nothing that they are asked makes them fall over.
import assert from "node:assert/strict";
import { createReadStream, existsSync } from "node:fs";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";
import { test } from "node:test";
import { build } from "esbuild";
import { run, until } from "./stand.mjs";

const root = new URL("../../", import.meta.url);
const target = process.env.CARGO_TARGET_DIR ?? new URL("target", root).pathname;
const [first, path] = ["first", "page"].map((name) => `${target}/page/vimc4_${name}.wasm`);
const { outputFiles } = await build({
  absWorkingDir: new URL("../", import.meta.url).pathname,
  stdin: {
    contents: ["./src/desk", "./src/words", "./playground/relay", "./playground/session", "./playground/tours", "./playground/work"].map((path) => `export * from "${path}";`).join(""),
    resolveDir: ".",
  },
  bundle: true, format: "esm", write: false,
});
const { Desk, explained, Later, Relay, Session, TOURS, Work } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);
for (const one of [first, path]) assert.ok(existsSync(one), `${one} is not there: cargo xtask page`);
const [early, module] = await Promise.all([first, path].map((one) => readFile(one)));
const open = () => Desk.load(module);
/** What makes desks of the module that answers first, and of the whole one. */
const [makeFirst, makeWhole] = await Promise.all([early, module].map((one) => WebAssembly.compile(one).then((compiled) => () => new Desk(compiled))));

test("the modules import nothing", async () => {
  for (const one of [early, module]) {
    assert.deepEqual(WebAssembly.Module.imports(await WebAssembly.compile(one)), []);
  }
});

test("a line is answered, a motion ends, and the past is there", async () => {
  const desk = await open();
  const one = "/controllers/1";
  const is = (answer, status = 200) => (assert.equal(answer.status, status, JSON.stringify(answer.body)), answer.body);
  is(desk.ask("PUT", "/controllers", { model: "imc-s8", machine: "mill" }));
  assert.deepEqual(desk.hear(1_000).filter(({ type }) => type === "sent"), []);
  is(desk.ask("POST", `${one}/line`, { send: "@01\r@0A5000,900\r" }));
  // Time passes only where it is heard: half a second of it is no more than that.
  const half = desk.hear(1_500);
  const [first] = half.filter(({ type }) => type === "sent");
  assert.deepEqual([first.at, first.send], [0, "0"]);
  assert.equal(is(desk.ask("GET", `${one}/clock`)).now, 500_000_000);
  const moving = half.filter(({ type }) => type === "position").at(-1);
  assert.equal(moving.moving, true);
  const end = desk.hear(60_000);
  assert.equal(end.filter(({ type }) => type === "sent").at(-1).send, "0");
  assert.equal(is(desk.ask("GET", `${one}/position`)).axes.X, 5_000);
  const kinds = new Set(end.filter(({ type }) => type === "events").flatMap(({ entries }) => entries.map(({ kind }) => kind)));
  assert.ok(kinds.has("answer") && kinds.has("motion"), [...kinds].join());
  // Back into the middle of the motion, where STOP begins a branch, and forward again.
  const past = is(desk.ask("POST", `${one}/history/go`, { at: 500_000_000 }));
  const there = past.view.axes[0].position;
  assert.ok(there > 0 && there < 5_000, String(there));
  const branch = is(desk.ask("POST", `${one}/history/do`, { order: "press stop" }));
  assert.equal(branch.branches.length, 2);
  assert.equal(is(desk.ask("GET", `${one}/position`)).axes.X, 5_000, "the controller itself stays where it is");
  is(desk.ask("POST", `${one}/history/take`));
  is(desk.ask("DELETE", `${one}/debugger`));
  desk.hear(120_000);
  const stopped = is(desk.ask("GET", `${one}/position`)).axes.X;
  assert.ok(stopped >= there && stopped < 5_000, String(stopped));
});

test("breakpoints, steps, faults and snapshots", async () => {
  const desk = await open();
  const one = "/v1/controllers/1";
  const is = ({ status, body }) => (assert.equal(status, 200, JSON.stringify(body)), body);
  is(desk.ask("PUT", "/controllers", { model: "imc4", clock: "manual" }));
  is(desk.ask("POST", `${one}/breakpoints`, { condition: "x > 400" }));
  is(desk.ask("POST", `${one}/line`, { send: "@01\r@0A1000,900\r" }));
  const stop = is(desk.ask("POST", `${one}/clock/run-until`, { condition: "idle" }));
  assert.deepEqual(stop.paused.breakpoints, [1]);
  assert.equal(is(desk.ask("GET", `${one}/position`)).axes.X, 401);
  assert.equal(is(desk.ask("POST", `${one}/clock/step`)).step, "cause");
  is(desk.ask("POST", `${one}/clock/resume`));
  is(desk.ask("POST", `${one}/clock/run-until`, { condition: "idle" }));
  const { id } = is(desk.ask("POST", `${one}/snapshots`, { name: "before" }));
  is(desk.ask("POST", `${one}/faults`, { fault: "drop to-host once" }));
  desk.hear(0);
  is(desk.ask("POST", `${one}/line`, { send: "@0P\r" }));
  assert.equal(desk.hear(0).find(({ type }) => type === "sent").send.length, 18, "of 19 one is lost");
  is(desk.ask("POST", `${one}/line`, { send: "@0A1000,900\r" }));
  is(desk.ask("POST", `${one}/clock/run-until`, { condition: "idle" }));
  is(desk.ask("POST", `${one}/snapshots/${id}/restore`));
  assert.equal(is(desk.ask("GET", `${one}/position`)).axes.X, 1_000);
});

test("a recording of its own is opened with the same bytes at the same times", async () => {
  const desk = await open();
  const is = ({ status, body }) => (assert.equal(status, 200, JSON.stringify(body)), body);
  is(desk.ask("PUT", "/controllers", { model: "smcu", machine: "board-plotter" }));
  desk.hear(0);
  is(desk.ask("POST", "/controllers/1/recording"));
  const all = [];
  for (const [at, send] of [[10, "IN;"], [400, "PA100,100;"], [900, "PD;PA500,500;PU;"]]) {
    all.push(...desk.hear(at));
    is(desk.ask("POST", "/controllers/1/line", { send }));
  }
  all.push(...desk.hear(20_000));
  const sent = (messages) => messages.filter(({ type }) => type === "sent").map(({ at, send }) => [at, send]);
  const text = is(desk.ask("GET", "/controllers/1/recording"));
  const other = await open();
  is(other.ask("PUT", "/recording", { text }));
  assert.deepEqual(sent(other.hear(0)), sent(all));
  assert.equal(is(other.ask("GET", "/controllers/1/clock")).now, 20_000_000_000);
});

test("every session sends what it sends natively", async (context) => {
  const sessions = `${target}/tmp/page-sessions.jsonl`;
  assert.ok(existsSync(sessions), `${sessions} is not there: cargo test -p vimc4-page`);
  const desk = await open();
  let played = 0;
  for await (const line of createInterface({ input: createReadStream(sessions) })) {
    const { name, recording, sent } = JSON.parse(line);
    const { status, body } = desk.ask("PUT", "/recording", { text: recording });
    assert.equal(status, 200, `${name}: ${JSON.stringify(body)}`);
    const own = desk.hear(0).filter(({ type }) => type === "sent").map(({ at, send }) => [at, send]);
    assert.deepEqual(own, sent, name);
    played += 1;
  }
  assert.ok(played > 500, `only ${played}`);
  context.diagnostic(`${played} played`);
});

/** All that is asked of a controller when the page has been told that something has happened. */
const LOOKS = ["view", "signals", "clock", "faults", "breakpoints", "snapshots", "history", "position", "rules", "journal"];

test("the module that answers first says in every session what the whole one says", async (context) => {
  const [one, whole] = [await Desk.load(early), await open()];
  const both = (method, path, body) => {
    const answers = [one, whole].map((desk) => desk.ask(method, path, body));
    assert.deepEqual(answers[0], answers[1], `${method} ${path} ${JSON.stringify(body)}`);
    return answers[0];
  };
  const names = both("GET", "/models").body;
  const machines = both("GET", "/machines").body;
  const own = "/controllers/1";
  let [seen, played] = [0, 0];
  for await (const line of createInterface({ input: createReadStream(`${target}/tmp/page-sessions.jsonl`) })) {
    // Of the many that differ in their model or in a quirk some are enough: it is the same code.
    if (seen++ % 11 !== 0) continue;
    const { name, recording } = JSON.parse(line);
    const [head, ...entries] = recording.trim().split("\n").map((line) => JSON.parse(line));
    // As the page begins it; a session may have values of quirks and a memory of its own, which is another matter.
    if (entries.some(({ power }) => power !== undefined)) continue;
    const setup = { model: head.model.name, machine: head.machine.name, clock: "manual" };
    const { status, body } = one.ask("PUT", "/controllers", setup);
    if (status !== 200) {
      assert.ok(body.later && (head.family !== "isel" || !names.includes(setup.model) || !machines.includes(setup.machine)), name);
      continue;
    }
    assert.deepEqual(whole.ask("PUT", "/controllers", setup).body, body);
    let now = 0;
    for (const { at, in: send, signal, value, end } of entries) {
      if ([send, signal, end].every((it) => it === undefined)) continue;
      if (at > now) both("POST", `${own}/clock/advance`, { span: `${at - now}ns` });
      now = Math.max(at, now);
      if (send !== undefined) both("POST", `${own}/line`, { send });
      if (signal !== undefined) both("PUT", `${own}/signals/${signal}`, { value });
    }
    const heard = [one, whole].map((desk) => desk.hear(played));
    assert.deepEqual(heard[0], heard[1], name);
    for (const look of LOOKS) both("GET", `${own}/${look}`);
    played += 1;
  }
  assert.ok(played > 500, `only ${played}`);
  for (const machine of machines) {
    both("PUT", "/controllers", { model: "imc4", machine });
    for (const look of ["model", "machine"]) both("GET", `${own}/${look}`);
  }
  context.diagnostic(`${played} played`);
});

test("the whole module goes on where the first one is", async () => {
  const [relay, whole] = [new Relay(makeFirst), await open()];
  const own = "/controllers/1";
  const talk = (desk) => {
    desk.ask("PUT", "/controllers", { model: "imc4", machine: "mill", clock: "manual" });
    desk.ask("POST", `${own}/recording`);
    desk.ask("PUT", `${own}/clock`, { clock: "real" });
    desk.hear(1_000);
    desk.ask("POST", `${own}/line`, { send: "@07\r@0A5000,1000,0,900,0,900,0,900\r" });
    desk.hear(1_700.5);
    assert.equal(desk.ask("PUT", `${own}/signals/stop`, { value: 1 }).status, 200);
    const said = desk.hear(2_200);
    for (const order of ["press start", "hold estop", "release estop", "power off", "power on"]) {
      said.push(desk.ask("POST", `${own}/orders`, { order }), ...desk.hear(2_300));
    }
    return said;
  };
  assert.deepEqual(talk(relay), talk(whole));
  const late = [
    ["GET", `${own}/recording`], ["POST", `${own}/history/go`, { at: 300_000_000 }], ["POST", `${own}/debugger`, { line: "why" }],
    ["PUT", "/controllers", { model: "imc4", quirks: { lost_steps: false } }], ["GET", "/models/imc4"], ["GET", `${own}/quirks`],
    ["PUT", "/controllers", { model: "smcu" }], ["POST", `${own}/orders`, { order: "input 0.1 on" }], ["POST", `${own}/orders`, { order: "press nothing" }],
    ["POST", `${own}/faults`, { fault: "drop to-host once" }], ["POST", `${own}/clock/run-until`, { condition: "idle" }],
  ];
  for (const asked of late) assert.throws(() => relay.ask(...asked), Later, asked.join(" "));
  relay.handOver(makeWhole);
  for (const asked of late) assert.deepEqual(relay.ask(...asked), whole.ask(...asked), asked.join(" "));
  assert.deepEqual(relay.hear(9_000), whole.hear(9_000));
});

test("what does not fit into the receive buffer is told in the same words, under the same numbers", async () => {
  const own = "/controllers/1";
  for (const model of ["imc4", "imc-s8"]) {
    const [relay, whole] = [new Relay(makeFirst), await open()];
    const begin = (desk) => {
      desk.ask("PUT", "/controllers", { model, machine: "bench" });
      desk.ask("PUT", "/events", { after: { 1: 0 } });
      return desk.hear(1_000);
    };
    // Pieces of which nothing, some of it or all of it is lost: each is one thing to be told of.
    const flood = (desk, from) => Array.from({ length: 40 }, (_, i) => {
      assert.equal(desk.ask("POST", `${own}/line`, { send: "@07\r@0A500,5000,20,900,0,900,0,900\r@0P\r" }).status, 200);
      return desk.hear(from + 7 * i);
    }).flat();
    // The second line is for other axes than there are after the third.
    const mean = (desk) => {
      assert.equal(desk.ask("POST", `${own}/line`, { send: "@07\r@0A10,900,20,900,30,900,0,900\r@01\r@0P\r" }).status, 200);
      return desk.hear(2_000);
    };
    const heard = [relay, whole].map((desk) => [...begin(desk), ...mean(desk), ...flood(desk, 2_000)]);
    assert.deepEqual(heard[0], heard[1], model);
    const told = () => relay.ask("GET", `${own}/journal`).body;
    const before = told();
    const lost = before.entries.filter(({ text }) => text?.includes("the receive buffer was full"));
    assert.ok(lost.length > 10 && lost.some(({ text }) => text.includes("bytes were lost")), `${lost.length} pieces of which something was lost`);
    relay.handOver(makeWhole);
    assert.deepEqual(told(), before, "who has heard of an entry finds it under its number");
    assert.deepEqual(flood(relay, 2_300), flood(whole, 2_300));
    assert.deepEqual(told(), whole.ask("GET", `${own}/journal`).body);
  }
});

test("a session that cannot begin leaves the one that is there as it is", () => {
  const own = "/controllers/1";
  let now = 0;
  const relay = new Relay(makeFirst);
  const session = new Session(relay, () => now);
  const begin = (deeds, model = "imc4") => session.ask("PUT", "/session", { model, machine: "mill", deeds, at: 2_000_000_000 });
  assert.equal(begin([[0, "send", "@07\r@0A4000,2000,0,900,0,900,0,900\r"]]).status, 200);
  const there = () => [`${own}/journal`, `${own}/position`, `${own}/clock`].map((path) => session.ask("GET", path).body);
  const before = there();
  assert.ok(before[1].axes.X > 0, "it has moved");
  assert.throws(() => session.ask("GET", "/session"), Later);
  // The first deeds can be done at once, and then something can not.
  const late = [[0, "send", "@07\r"], [1_000_000, "fault", "drop to-host once"], [1_000_000, "send", "@0A9,900,0,900,0,900\r"]];
  for (const [deeds, model] of [[late], [[], "smcu"]]) {
    assert.throws(() => begin(deeds, model), Later);
    assert.deepEqual(there(), before);
  }
  relay.handOver(makeWhole);
  assert.deepEqual(there(), before);
  const told = session.ask("GET", "/session").body;
  assert.deepEqual(told, { model: "imc4", machine: "mill", deeds: [[0, "send", "@07\r@0A4000,2000,0,900,0,900,0,900\r"]], at: 2_000_000_000 });
  assert.equal(begin([], "nothing").status, 404);
  assert.deepEqual(there(), before);
  assert.deepEqual(session.ask("GET", "/session").body, told);
  assert.equal(begin(late).status, 200);
  assert.equal(session.ask("GET", `${own}/faults`).body.length, 1);
  now = 10;
  session.hear();
  // Rules are done again, too, and end again.
  const rule = [0, "rules", "when x > 100: press stop"];
  assert.deepEqual(begin([rule, [0, "rules", "every 1s: press start"], [0, "end-rules", "2"]]).body, { refused: [] });
  assert.deepEqual(session.ask("GET", `${own}/rules`).body.map(({ rule, scenario }) => [rule, scenario]), [[rule[2], 1]]);
  assert.equal(session.ask("POST", `${own}/rules`, { rules: "when y > 9: press stop" }).status, 200);
  assert.equal(session.ask("DELETE", `${own}/rules`).status, 200);
  assert.deepEqual(session.ask("GET", "/session").body.deeds.map(([, ...deed]) => deed).slice(-2), [["rules", "when y > 9: press stop"], ["end-rules", ""]]);
});

test("a link has what was typed in the debugger, where that has gone to in the past, and begins where it ended", async () => {
  const own = "/controllers/1";
  const session = () => new Session(new Relay(makeWhole), () => 0);
  const one = session();
  const is = (answer) => (assert.equal(answer.status, 200, JSON.stringify(answer.body)), answer.body);
  is(one.ask("PUT", "/session", { model: "imc4", machine: "mill", deeds: [], at: 0 }));
  const digest = (session) => is(session.ask("POST", `${own}/debugger`, { line: "digest" })).text;
  const type = (...lines) => lines.forEach((line) => is(one.ask("POST", `${own}/debugger`, { line })));
  const shared = () => {
    const told = is(one.ask("GET", "/session"));
    const other = session();
    assert.deepEqual(is(other.ask("PUT", "/session", told)), { refused: [] });
    assert.equal(digest(other), digest(one), JSON.stringify(told));
    // What was done again is what was done.
    assert.deepEqual(is(other.ask("GET", "/session")), told);
    return told;
  };
  type("fault drop to-host 3%", "when x > 300: press stop", "send @07", "send @0A4000,2000,0,900,0,900,0,900", "continue");
  assert.deepEqual(shared().deeds.map(([, ...deed]) => deed).slice(0, 2), [["order", "fault drop to-host 3%"], ["rules", "when x > 300: press stop"]]);
  type("goto 100ms", "send @0P", "continue");
  is(one.ask("PUT", `${own}/signals/cover`, { value: "open" }));
  shared();
  type("take", "press start", "continue");
  is(one.ask("DELETE", `${own}/debugger`));
  shared();
});

/** What a host gives to a controller, as a recording has it. */
const inputs = (recording) => recording.split("\n").filter(Boolean).map((line) => JSON.parse(line)).filter((one) => one.in !== undefined).map((one) => one.in);

/** Carries out a file as the page does; so many ms pass whenever the desk is asked. */
async function carriedOut(file, model, machine, passes) {
  const desk = await open();
  let now = 0;
  const is = ({ status, body }) => {
    if (status !== 200) throw new Error(`${body.detail}; ${body.remedy}`);
    return body;
  };
  is(desk.ask("PUT", "/controllers", { model, machine }));
  is(desk.ask("POST", "/controllers/1/recording"));
  const entries = [];
  const ask = async (...asked) => {
    for (const message of desk.hear((now += passes))) if (message.type === "events") entries.push(...message.entries);
    return is(desk.ask(...asked));
  };
  await ask("GET", "/controllers");
  const app = { machine: { number: 1, entries }, past: null, changed() {}, api: { get: (path) => ask("GET", path), post: (path, body) => ask("POST", path, body) } };
  const { pieces } = await ask("POST", "/controllers/1/work", file);
  const work = new Work(file.name, pieces, app);
  await until("it has been carried out", () => work.isOver);
  return { work, pieces: pieces.length, given: inputs(await ask("GET", "/controllers/1/recording")) };
}

test("the page gives a controller what the program gives it, and nothing behind an error", async () => {
  const folder = await mkdtemp(join(tmpdir(), "given-"));
  const move = "VS10000;!VU20000;PU;PA1000,2000;PD;PR500,0;PR0,500;";
  const plots = {
    "refused.plt": `IN;!CT1;!EM1;${move}AA1000,1000,90;PU;PA0,0;!EM0;`,
    "answered.plt": `IN;!CT1;!EM1;${move}PU;PA0,0;!EM0;`,
    "silent.plt": `IN;!EM1;${move}PU;PA0,0;!EM0;`,
  };
  const lists = { "list.txt": "@07\n@0A900,900,0,900,0,900,0,900\n@0A5\n@0P\n" };
  const sets = [[plots, "smcu", "board-plotter"], [plots, "motionsystem", "board-plotter"], [lists, "imc4", "mill"]];
  try {
    for (const [files, model, machine] of sets) {
      for (const [name, text] of Object.entries(files)) {
        const [path, recording] = [join(folder, name), join(folder, `${name}.jsonl`)];
        await writeFile(path, text);
        await run("run", path, "--model", model, "--machine", machine, "--record", recording);
        const wanted = inputs(await readFile(recording, "utf8"));
        assert.ok(wanted.length >= 3, `${wanted}`);
        for (const passes of [50, 1_000]) {
          const { work, given, pieces } = await carriedOut({ name, text }, model, machine, passes);
          assert.deepEqual(given, wanted, `${name} on ${model}, ${passes} ms at a time`);
          assert.equal(work.state, wanted.length < pieces ? "refused" : "done", `${name} on ${model}: ${work.reason}`);
        }
        await rm(recording);
      }
    }
  } finally {
    await rm(folder, { recursive: true, force: true });
  }
});

test("a file that is for other controllers is refused as a whole, with the names of those", async () => {
  const refused = (name, text, model) => assert.rejects(carriedOut({ name, text }, model, "mill", 1_000), (error) => {
    assert.match(error.message, new RegExp(name.endsWith("plt") ? "plt is a plot file, .* choose one of smcu, motionsystem" : "the smcu does not speak isel's @-format; choose one of imc4, "));
    return true;
  });
  const [job, plot] = await Promise.all(["plate.ncp", "board.plt"].map((name) => readFile(new URL(`examples/${name}`, root), "utf8")));
  await refused("plate.ncp", job, "smcu");
  await refused("board.plt", plot, "imc4");
});

test("a step of a tour is done by what it asks for, and by nothing that is only like it", async () => {
  const met = async (tour, step, ...lines) => {
    const desk = await open();
    const is = ({ status, body }) => (assert.equal(status, 200, JSON.stringify(body)), body);
    is(desk.ask("PUT", "/controllers", { model: "imc4", machine: "bench", clock: "instant" }));
    for (const line of lines) {
      is(desk.ask("POST", "/controllers/1/line", { send: `${line}\r` }));
      desk.hear(0);
    }
    const [{ entries }, view] = ["journal", "view"].map((what) => is(desk.ask("GET", `/controllers/1/${what}`)));
    return TOURS[tour].steps[step - 1].met({ entries, machine: { view }, isPast: false });
  };
  const are = async (tour, step, isMet, before, ...lines) => {
    for (const line of lines) assert.equal(await met(tour, step, ...before, line), isMet, `step ${step} of the tour of ${tour}: ${line}`);
  };
  await are("circles", 1, true, [], "@03", "@07");
  await are("circles", 1, false, [], "@01", "@08", "@0P");
  const right = ["@0y3200,1000,-200,400,0,-1,1", "@0y1600,1000,-200,400,0,-1,1", "@0y6400,1000,-400,800,0,-1,1", "@0y3200,1000,-200,400,0,-1,-1",
    "@0y3200,1000,-40000,400,0,-1,1", "@0y400,1500,119,-141,141,-1,-1"];
  for (let step = 2; step <= 7; step++) {
    await are("circles", step, true, ["@03"], right[step - 2]);
    // Either way round is a whole circle.
    await are("circles", step, false, ["@03"], ...right.filter((_, i) => i !== step - 2 && !(step === 2 && i === 3)));
  }
  await are("circles", 4, false, ["@03"], "@0y6400,2000,-200,800,0,-1,1");
  await are("circles", 5, false, ["@03"], "@0y3200,1000,0,400,0,-1,-1", "@0y3200,1000,-200,400,0,-1,1");
  await are("circles", 6, false, ["@03"], "@0y400,1000,-40000,400,0,-1,1");
  await are("commands", 3, true, ["@07"], "@0A4000,2000,0,900,0,900,0,900");
  await are("commands", 3, false, ["@07"], "@0A4000,900,0,900,0,900,0,900", "@0A400,2000,0,900,0,900,0,900");
  await are("commands", 5, true, ["@07"], "@0A500", "@0M500,99999,0,900,0,900,0,900");
  await are("commands", 5, false, ["@07"], "@0Z9", "@0P5", "@0A500,900,0,900,0,900,0,900", "@0A500,900,0,900,0,900,0,900,7");
});

test("every signal of every controller is explained in German", async () => {
  const desk = await open();
  const is = ({ status, body }) => (assert.equal(status, 200, JSON.stringify(body)), body);
  const { localStorage } = globalThis;
  Object.defineProperty(globalThis, "localStorage", { configurable: true, value: { getItem: () => "de" } });
  try {
    for (const model of is(desk.ask("GET", "/models"))) {
      for (const machine of is(desk.ask("GET", "/machines"))) {
        is(desk.ask("PUT", "/controllers", { model, machine }));
        for (const { name, about } of is(desk.ask("GET", "/controllers/1/signals"))) {
          assert.notEqual(explained(about), about, `${name} of the ${model}`);
        }
      }
    }
  } finally {
    Object.defineProperty(globalThis, "localStorage", { configurable: true, value: localStorage });
  }
});

test("whatever it is asked, it answers", async () => {
  const desk = await open();
  // Always the same numbers.
  let seed = 1;
  const random = (below) => (seed = (seed * 1_103_515_245 + 12_345) % 2_147_483_648) % below;
  const one = (list) => list[random(list.length)];
  const methods = ["GET", "PUT", "POST", "DELETE", "PATCH", ""];
  const parts = [
    "view", "signals", "signals/cover", "signals/start", "orders", "completions?line=pr", "line", "flash", "recording",
    "clock", "clock/advance", "clock/run-until", "clock/pause", "clock/resume", "clock/step", "clock/cancel",
    "breakpoints", "breakpoints/1", "debugger", "debugger/view", "history", "history/go", "history/do", "history/take",
    "history/entries", "journal?after=x", "journal?kinds=answer&limit=3", "snapshots", "snapshots/1/restore", "faults",
    "faults/1", "rules", "reset", "position", "meaning?line=@0P", "nothing", "%ff", "../..", "expectations",
  ];
  const words = [
    "@07\r", "@0A1000,900\r", "@0P\r", "@0R7\r", "IN;", "PA1,1;", "press stop", "power off", "power on", "idle", "x > 1", "1s", "8x",
    "instant", "manual", "real", "back command", "step 3 causes", "goto start", "why", "take", "drop to-host once", "\u0000", "🙂", "",
    "when x > 10: press stop", "continue", "reverse", "print state", "quit", "\r".repeat(50), "@0A-999999999999,1\r",
  ];
  const fields = ["send", "order", "value", "clock", "span", "condition", "line", "at", "branch", "command", "fault", "rules", "name", "image", "x"];
  const values = [() => one(words), () => random(5_000), () => -1, () => 1e300, () => null, () => ({}), () => [1], () => true];
  const count = Number(process.env.ASKS ?? 100_000);
  for (let i = 0; i < count; i++) {
    const body = random(4) === 0 ? undefined : { [one(fields)]: values[random(random(3) ? 2 : values.length)]() };
    const address = `/controllers/${one(["1", "1", "1", "1", "2", "0", "x", ""])}/${one(parts)}`;
    const { status, body: answer } = desk.ask(one(methods), address, body);
    assert.ok([200, 400, 404, 405, 409, 413, 422, 429].includes(status), `${status} ${JSON.stringify(answer)}`);
    if (status !== 200) assert.ok(answer.detail && answer.title, JSON.stringify(answer));
    if (i % 500 === 0) desk.hear(i);
    if (i % 2_000 === 0) desk.ask("PUT", "/controllers", { model: one(["imc4", "imc-s8", "smcu", "c142", "motionsystem"]), machine: "bench" });
  }
  assert.equal(desk.ask("POST", "/controllers/1/line", { send: "x".repeat(70_000) }).status, 413);
  assert.equal(desk.ask("PUT", "/recording", { text: "{".repeat(1_000_000) }).status, 422);
  assert.equal(desk.ask("PUT", "/controllers", { model: "no" }).status, 404);
  assert.equal(desk.ask("PUT", "/controllers", []).status, 400);
  assert.equal(desk.ask("GET", "/controllers").status, 200);
});
