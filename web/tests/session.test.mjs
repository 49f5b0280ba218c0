// Sessions, links and comparisons, without a browser.
import assert from "node:assert/strict";
import { test } from "node:test";
import { build } from "esbuild";

const load = async (path) => {
  const { outputFiles } = await build({
    entryPoints: [new URL(`../playground/${path}`, import.meta.url).pathname], bundle: true, format: "esm", write: false,
  });
  return import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);
};
const { OfAnother, written, read } = await load("link.ts");
const { begun, escaped, heard, recorded, verdict } = await load("exchange.ts");
const { kindOf } = await load("files.ts");
const { Session } = await load("session.ts");

const told = {
  model: "imc4", machine: "mill", at: 7_250_000_001,
  deeds: [[0, "send", "@07\r"], [1_000_000_003, "order", "press stop"], [5, "set", "input 0.2", 1], [9, "send", "\u00fd"]],
};

test("a link gives back what was written, and is short", async () => {
  const link = await written(told);
  assert.match(link, /^#1\.[A-Za-z0-9_-]+$/);
  assert.ok(link.length < 250, `${link.length}`);
  assert.deepEqual(await read(link), told);
});

test("a session is what the controller has got, each after the one before, and is done again at those times", () => {
  const asked = [];
  const deeds = [[5, "send", "@07\r"], [5, "order", "fault cut"], [9, "set", "input 0.2", 1], [9, "end-rules", ""]];
  const desk = {
    ask(...asks) {
      asked.push(asks);
      return { status: 200, body: { at: 20, deeds } };
    },
    hear: () => [],
    anew: (begin) => void begin(),
  };
  const session = new Session(desk, () => 0);
  session.ask("PUT", "/session", { model: "imc4", machine: "mill", deeds: [], at: 0 });
  const { body } = session.ask("GET", "/session");
  assert.deepEqual(body, { model: "imc4", machine: "mill", at: 20, deeds: [[5, ...deeds[0].slice(1)], [0, ...deeds[1].slice(1)], [4, ...deeds[2].slice(1)], [0, ...deeds[3].slice(1)]] });
  asked.length = 0;
  session.ask("PUT", "/session", body);
  const [pass, own] = [(span) => ["POST", `${own}/clock/advance`, { span }], "/controllers/1"];
  assert.deepEqual(asked.slice(2, -2), [
    pass("5ns"), ["POST", `${own}/line`, { send: "@07\r" }], ["POST", `${own}/orders`, { order: "fault cut" }],
    pass("4ns"), ["PUT", `${own}/signals/input%200.2`, { value: 1 }], ["DELETE", `${own}/rules`], pass("11ns"),
  ]);
});

test("what is no link of ours is none, and one that is not whole is refused", async () => {
  assert.equal(await read(""), null);
  assert.equal(await read("#front"), null);
  const link = await written(told);
  for (const wrong of [link.slice(0, -7), `${link.slice(0, 9)}!!`, "#1.", "#1.AAAA", await packed([1, 2]), await packed(["imc4", "mill", 0, [[-1, "send", "x"]]]), await packed(["imc4", "mill", 0, [["1", "send", "x"]]])]) {
    await assert.rejects(read(wrong), undefined, wrong);
  }
  await assert.rejects(read("#2.AAAA"), OfAnother);
});

test("a link that unpacks to far too much is not unpacked", async () => {
  const link = await packed(["imc4", "mill", 0, [[0, "send", " ".repeat(6_000_000)]]]);
  await assert.rejects(read(link), /too long/);
});

/** Anything as a link would have it. */
async function packed(what) {
  const stream = new Blob([JSON.stringify(what)]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  return `#1.${Buffer.from(await new Response(stream).arrayBuffer()).toString("base64url")}`;
}

test("bytes decide before times do, and times within the tolerance are the same", () => {
  const one = (bytes, after) => ({ bytes, after });
  const of = (real, virtual, isLast = false) => verdict({ ...begun("@0P", "out"), real, virtual }, isLast);
  assert.equal(of(one("0", 30), one("0", 0)), "same");
  assert.equal(of(one("0", 51), one("0", 0)), "time");
  // A hundredth of ten seconds is more than 50 ms.
  assert.equal(of(one("0", 10_080), one("0", 10_000)), "same");
  assert.equal(of(one("0", 10_200), one("0", 10_000)), "time");
  assert.equal(of(one("F", 1), one("0", 1)), "bytes");
  assert.equal(of(one("", null), one("0", 1)), "bytes");
  assert.equal(of(one("", null), one("", null), true), "open");
  assert.equal(of(one("", null), one("", null)), "silent");
  // It may still come.
  assert.equal(of(one("", null), one("0", 1), true), "open");
  assert.equal(of(one("0", 1), one("000", 1), true), "open");
  assert.equal(of(one("H", 1), one("0", 1), true), "bytes");
  // Where the virtual one has done something else besides there is nothing to compare, unless both have said the same before.
  const apart = (real, virtual) => verdict({ ...begun("@0P", "out", true), real, virtual }, false);
  assert.equal(apart(one("H", 1), one("0", 1)), "apart");
  assert.equal(apart(one("", null), one("", null)), "apart");
  assert.equal(apart(one("0", 1), one("0", 1)), "same");
  // A line that has not gone out has no answer, whatever the virtual one says.
  for (const went of ["waits", "cut"]) assert.equal(verdict({ ...begun("@0P", went), virtual: one("0", 1) }, true), went);
});

test("what is said is put together as the journal writes bytes", () => {
  assert.equal(escaped([0x30, 0x0d, 0x0a, 0x5c, 0xfd, 0x41]), "0\\r\\n\\\\\\xFDA");
  const entries = [
    { number: 5, at: 1_000_000, kind: "command", bytes: "@0P" },
    { number: 6, at: 3_000_000, kind: "answer", bytes: "0" },
    { number: 7, at: 4_500_000, kind: "answer", bytes: "00" },
  ];
  const said = heard(begun("@0P", "out").virtual, entries.slice(0, 2), 1_000_000);
  assert.deepEqual(said, { bytes: "0", after: 2 });
  assert.deepEqual(heard(said, [], 1_000_000), said);
  assert.deepEqual(heard(said, entries.slice(2), 1_000_000), { bytes: "000", after: 3.5 });
});

test("a real conversation is a recording in ASCII, with the head of the virtual controller", () => {
  const virtual = '{"recording":1,"model":{"name":"imc4"},"clock":"real"}\n{"at":0,"state":{}}\n{"at":1,"in":"x"}\n';
  const text = recorded(virtual, [{ at: 1, in: "@0P\r" }, { at: 9, out: "0\u00fd" }], "serial", 1_700_000_000);
  assert.match(text, /^[\n\x20-\x7e]*$/);
  const lines = text.trim().split("\n").map((line) => JSON.parse(line));
  assert.equal(lines[0].clock, "wall");
  assert.deepEqual(lines.slice(1), [{ at: 0, state: {} }, { at: 1, in: "@0P\r" }, { at: 9, out: "0\u00fd" }, { at: 9, end: "saved" }]);
});

test("a file is told by what is in it", () => {
  assert.equal(kindOf("x", '{"recording":1}'), "recording");
  assert.equal(kindOf("x.html", '<!doctype html><script type="text/plain" id="film">'), "film");
  for (const [name, text] of [["a.ncp", "REF XYZ"], ["a", "; a comment\n@07"], ["a.plt", "IN;"], ["a.txt", "71"]]) assert.equal(kindOf(name, text), "work", name);
  for (const [name, text] of [["a.bin", "\0\0"], ["a.txt", " \n"], ["a.html", "<p>"]]) assert.equal(kindOf(name, text), "unknown", name);
});
