// What the panel makes of what it hears of a machine, without a browser.
import assert from "node:assert/strict";
import { test } from "node:test";
import { build } from "esbuild";

const { outputFiles } = await build({
  entryPoints: [new URL("../src/machine.ts", import.meta.url).pathname],
  bundle: true, format: "esm", write: false,
});
const { Machine } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);

/** Timers of the page, which pass when the test says so. */
let timers = new Map();
globalThis.window = { setTimeout: (run) => (timers.set(timers.size + 1, run), timers.size) };
globalThis.clearTimeout = (id) => timers.delete(id);
const time = () => {
  const due = [...timers.values()];
  timers = new Map();
  for (const run of due) run();
};

const axes = ["X", "Y", "Z"].map((name, index) => ({ index, name, scale: { steps: 400, units: 5000, unit: "µm" } }));
const machine = (family = "isel") =>
  new Machine({ number: 1, family, axes }, { axes: {}, job: { rapid_velocity: 30_000 } }, { limits: { speed_max: 20_000 } });

let number = 0;
const entry = (kind, more) => ({ number: ++number, at: number, kind, ...more });
const begins = (from, more) => entry("motion", { motion: "begins", mnemonic: "@A", from, ...more });
const ends = (points, more) => entry("motion", { motion: "ends", mnemonic: "@A", from: points[0], points, ...more });
const position = (moving, positions, carriage = positions) => ({ controller: 1, at: number, activity: "move", moving, positions, carriage, speed: [0, 0, 0] });
const places = (it) => it.path.runs.map(({ kind, points }) => [kind, ...points]);

test("a path begins where the carriages are, not where the counters are", () => {
  const it = machine();
  it.hear([begins([0, 0, 0]), ends([[0, 0, 0], [100, 0, 0]])]);
  it.isAt(position(false, [100, 0, 0], [4_100, 50, -7]));
  assert.deepEqual(places(it), [["feed", 4_000, 50, -7, 4_100, 50, -7]]);
  // The counters are set to zero: the path goes on where it was.
  it.hear([begins([0, 0, 0]), ends([[0, 0, 0], [0, 10, 0]])]);
  assert.deepEqual(places(it), [["feed", 4_000, 50, -7, 4_100, 50, -7, 4_100, 60, -7]]);
});

test("who comes in the middle of a motion sees the path where it is", () => {
  const it = machine();
  it.hear([begins([0, 0, 0]), ends([[0, 0, 0], [100, 0, 0]]), begins([100, 0, 0])]);
  it.isAt(position(true, [130, 0, 0], [1_130, 0, 0]));
  assert.deepEqual(places(it), [["feed", 1_000, 0, 0, 1_100, 0, 0]]);
  assert.deepEqual(it.trail, [[1_100, 0, 0], [1_130, 0, 0]]);
  it.hear([ends([[100, 0, 0], [200, 0, 0]])]);
  assert.deepEqual(places(it), [["feed", 1_000, 0, 0, 1_100, 0, 0, 1_200, 0, 0]]);
  assert.deepEqual(it.trail, []);
});

test("lost steps are believed when nothing moves any more, and draw no line", () => {
  const it = machine();
  it.isAt(position(false, [0, 0, 0]));
  it.hear([begins([0, 0, 0]), ends([[0, 0, 0], [100, 0, 0]])]);
  it.isAt(position(false, [100, 0, 0], [60, 0, 0]));
  it.hear([begins([100, 0, 0]), ends([[100, 0, 0], [110, 0, 0]])]);
  it.isAt(position(false, [110, 0, 0], [70, 0, 0]));
  time();
  it.hear([begins([110, 0, 0]), ends([[110, 0, 0], [120, 0, 0]])]);
  assert.deepEqual(places(it), [["feed", 0, 0, 0, 100, 0, 0, 110, 0, 0], ["feed", 70, 0, 0, 80, 0, 0]]);
});

test("ways are told apart by what was sent", () => {
  const it = machine();
  const move = (command, bytes, mnemonic) => {
    it.hear([entry("command", { command, mnemonic, bytes })]);
    const { path } = it;
    const at = path.runs.at(-1)?.points.slice(-3) ?? [0, 0, 0];
    it.hear([ends([at, [at[0] + 1, 0, 0]], { command, mnemonic })]);
    return path.runs.at(-1).kind;
  };
  assert.equal(move(1, "@0A100,900,0,900,0,900,0,900", "@A"), "feed");
  assert.equal(move(2, "@0M100,20000,0,900,0,900,0,900", "@M"), "rapid");
  // An axis that does not move does not make it one.
  assert.equal(move(3, "@0A100,900,0,20000,0,900,0,900", "@A"), "feed");
  assert.equal(move(4, "@0R7", "@R"), "reference");
  assert.equal(move(5, "@0y4000,900,-250,500,0,-1,1", "@y"), "arc");
  const plotter = machine("lpkf");
  plotter.hear([ends([[0, 0, 0], [1, 0, 0]], { mnemonic: "PA" }), entry("command", { mnemonic: "PD" }),
    ends([[1, 0, 0], [2, 0, 0]], { mnemonic: "PA" }), ends([[2, 0, 0], [3, 0, 0]], { mnemonic: "AA" })]);
  assert.deepEqual(plotter.path.runs.map(({ kind }) => kind), ["rapid", "feed", "arc"]);
});

test("a plotter makes reference runs by itself, and when it is initialised", () => {
  const kinds = (...heard) => {
    const plotter = machine("lpkf");
    let x = 0;
    const move = (mnemonic) => ends([[x, 0, 0], [++x, 0, 0]], { mnemonic });
    plotter.hear(heard.flatMap(([sent, moves]) => [...(sent ? [entry("command", { mnemonic: sent })] : []), move(moves)]));
    return plotter.path.runs.map(({ kind }) => kind);
  };
  assert.deepEqual(kinds([undefined, undefined], ["PA", "PA"]), ["reference", "rapid"]);
  assert.deepEqual(kinds(["IN", "IN"], ["PA", "PA"], ["!IS", "!IS"]), ["reference", "rapid", "reference"]);
  // A trackball moves without a command, too.
  assert.deepEqual(kinds(["!OI", undefined], ["!CI", "!IS"]), ["rapid", "reference"]);
});

test("what is no longer kept is counted", () => {
  const it = machine();
  it.gap(1, 90);
  it.hear(Array.from({ length: 30_000 }, () => entry("baud")));
  assert.equal(it.missing + it.entries.length, 30_090);
  assert.ok(it.entries.length <= 22_000);
});

test("time passes while nothing is told, at the pace of the clock", async () => {
  const it = machine();
  it.clock = { now: 5e9, clock: "2x", paused: null };
  const first = it.now;
  await new Promise((resolve) => setTimeout(resolve, 20));
  assert.ok(first >= 5e9 && it.now - first >= 30e6, `${first} ${it.now}`);
  it.clock = { now: 5e9, clock: "2x", paused: { at: 6e9, by: "me", breakpoints: [] } };
  assert.equal(it.now, 6e9);
});

test("limit switches are red that were pressed before it was there, and as they change", () => {
  const it = machine();
  const view = (limits) => ({ powered: true, details: {}, axes: [{ index: 0, limits }, { index: 1, limits: [false, false] }] });
  it.seen(view([false, true]));
  assert.deepEqual([...it.switches], ["0+"]);
  it.hear([entry("switch", { axis: 1, positive: false, active: true }), entry("switch", { axis: 0, positive: true, active: false })]);
  assert.deepEqual([...it.switches], ["1-"]);
});
