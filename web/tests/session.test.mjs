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
const { escaped, recorded, saidSince, verdict } = await load("exchange.ts");
const { kindOf } = await load("files.ts");

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
  const of = (real, virtual, isLast = false) => verdict({ line: "@0P", real, virtual, causes: [], isApart: false }, isLast);
  assert.equal(of(one("0", 30), one("0", 0)), "same");
  assert.equal(of(one("0", 51), one("0", 0)), "time");
  // A hundredth of ten seconds is more than 50 ms.
  assert.equal(of(one("0", 10_080), one("0", 10_000)), "same");
  assert.equal(of(one("0", 10_200), one("0", 10_000)), "time");
  assert.equal(of(one("F", 1), one("0", 1)), "bytes");
  assert.equal(of(one("", null), one("0", 1)), "bytes");
  assert.equal(of(one("", null), one("", null)), "open");
  // It may still come.
  assert.equal(of(one("", null), one("0", 1), true), "open");
  assert.equal(of(one("0", 1), one("000", 1), true), "open");
  assert.equal(of(one("H", 1), one("0", 1), true), "bytes");
  // Where the virtual one has done something else besides there is nothing to compare.
  assert.equal(verdict({ line: "@0P", real: one("H", 1), virtual: one("0", 1), causes: [], isApart: true }, false), "apart");
});

test("what is said is put together as the journal writes bytes", () => {
  assert.equal(escaped([0x30, 0x0d, 0x0a, 0x5c, 0xfd, 0x41]), "0\\r\\n\\\\\\xFDA");
  const entries = [
    { number: 4, at: 5, kind: "answer", bytes: "9" },
    { number: 5, at: 1_000_000, kind: "command", bytes: "@0P" },
    { number: 6, at: 3_000_000, kind: "answer", bytes: "0" },
    { number: 7, at: 4_500_000, kind: "answer", bytes: "00" },
  ];
  assert.deepEqual(saidSince(entries, 4, 1_000_000), { bytes: "000", after: 3.5 });
  assert.deepEqual(saidSince(entries, 7, 1_000_000), { bytes: "", after: null });
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
