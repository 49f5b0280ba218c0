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
const { NoLink, OfAnother, written, read } = await load("link.ts");
const { begun, escaped, recorded, STOP, verdict } = await load("exchange.ts");
const { Commands, Owed } = await load("whose.ts");
const { kindOf } = await load("files.ts");
const { Session } = await load("session.ts");

const session = {
  model: "imc4", machine: "mill", at: 7_250_000_001,
  deeds: [[0, "send", "@07\r"], [1_000_000_003, "order", "press stop"], [5, "set", "input 0.2", 1], [9, "send", "\u00fd"]],
};

test("a link gives back what was written, and is short", async () => {
  const link = await written(session);
  assert.match(link, /^#1\.[A-Za-z0-9_-]+$/);
  assert.ok(link.length < 250, `${link.length}`);
  assert.deepEqual(await read(link), session);
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
  const begun = new Session(desk, () => 0);
  begun.ask("PUT", "/session", { model: "imc4", machine: "mill", deeds: [], at: 0 });
  const { body } = begun.ask("GET", "/session");
  assert.deepEqual(body, { model: "imc4", machine: "mill", at: 20, deeds: [[5, ...deeds[0].slice(1)], [0, ...deeds[1].slice(1)], [4, ...deeds[2].slice(1)], [0, ...deeds[3].slice(1)]] });
  asked.length = 0;
  begun.ask("PUT", "/session", body);
  const [pass, own] = [(span) => ["POST", `${own}/clock/advance`, { span }], "/controllers/1"];
  assert.deepEqual(asked.slice(2, -2), [
    pass("5ns"), ["POST", `${own}/line`, { send: "@07\r" }], ["POST", `${own}/orders`, { order: "fault cut" }],
    pass("4ns"), ["PUT", `${own}/signals/input%200.2`, { value: 1 }], ["DELETE", `${own}/rules`], pass("11ns"),
  ]);
});

test("what is no link of ours is none, and one that is not whole is refused", async () => {
  assert.equal(await read(""), null);
  await assert.rejects(read("#front"), NoLink);
  const link = await written(session);
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
  const of = (real, virtual, over = "next", more = {}) => verdict({ ...begun("@0P"), went: "out", real, virtual, over, ...more });
  assert.equal(of(one("0", 30), one("0", 0)), "same");
  assert.equal(of(one("0", 51), one("0", 0)), "time");
  // A hundredth of ten seconds is more than 50 ms.
  assert.equal(of(one("0", 10_080), one("0", 10_000)), "same");
  assert.equal(of(one("0", 10_200), one("0", 10_000)), "time");
  assert.equal(of(one("F", 1), one("0", 1)), "bytes");
  assert.equal(of(one("", null), one("0", 1)), "bytes");
  assert.equal(of(one("", null), one("", null), ""), "open");
  assert.equal(of(one("", null), one("", null)), "silent");
  // It may still come, unless the port was closed.
  assert.equal(of(one("", null), one("0", 1), ""), "open");
  assert.equal(of(one("0", 1), one("000", 1), ""), "open");
  assert.equal(of(one("H", 1), one("0", 1), ""), "bytes");
  assert.equal(of(one("F", 1), one("", null), "", { isAnswered: true }), "bytes");
  assert.equal(of(one("", null), one("0", 1), "closed"), "closed");
  assert.equal(of(one("0", 1), one("", null), "closed"), "closed");
  assert.equal(of(one("0", 1), one("0", 1), "closed"), "same");
  assert.equal(of(one("F", 1), one("0", 1), "closed"), "bytes");
  // Where the virtual one has done something else besides there is nothing to compare, unless both have said the same before.
  const apart = (real, virtual) => of(real, virtual, "next", { apart: "apart" });
  assert.equal(apart(one("H", 1), one("0", 1)), "apart");
  assert.equal(apart(one("", null), one("", null)), "apart");
  assert.equal(apart(one("0", 1), one("0", 1)), "same");
  // A line that has not gone out has no answer, whatever the virtual one says.
  for (const went of ["waits", "cut", "unsent"]) assert.equal(verdict({ ...begun("@0P"), went, virtual: one("0", 1) }), went);
});

test("bytes are shown as the journal writes them", () => {
  assert.equal(escaped([0x30, 0x0d, 0x0a, 0x5c, 0xfd, 0x41]), "0\\r\\n\\\\\\xFDA");
});

/** Entries of the journal, written shortly: a command or an answer, its number, when in ms, and its bytes. */
const told = (...entries) => entries.map(([kind, command, ms, bytes]) => ({ kind, command, at: ms * 1e6, bytes }));

test("what the virtual controller says is said to the line whose command it answers, since that was sent", () => {
  const [move, place, stop] = ["@0A1800,900", "@0P", STOP].map((line) => begun(line));
  const commands = new Commands();
  commands.give(move, 1_000e6, 0);
  commands.give(place, 1_300e6, 300);
  commands.hear(told(["command", 7, 1_004, "@0A1800,900"]));
  assert.deepEqual([move, place].map(({ isAnswered }) => isAnswered), [false, false]);
  commands.give(stop, 1_500e6, 500);
  // STOP ends the motion, whose answer it is, and the place is told behind it.
  commands.hear(told(["answer", 7, 1_604, "F"], ["command", 8, 1_604, "@0P"]));
  assert.deepEqual([move, place, stop].map(({ isAnswered }) => isAnswered), [true, false, true]);
  commands.hear(told(["answer", 8, 1_604, "0000"]));
  assert.deepEqual([move.virtual, place.virtual, stop.virtual], [{ bytes: "F", after: 600 }, { bytes: "0000", after: 304 }, { bytes: "", after: null }]);
});

test("a line may have several commands, or none, and the same one may be sent twice", () => {
  const [two, same, again, none] = ["PA1,1;PU;", "@0P", "@0P", "99"].map((line) => begun(line));
  const commands = new Commands();
  for (const line of [two, same, again, none]) commands.give(line, 0, 0);
  commands.hear(told(["command", 1, 1, "PA1,1"], ["answer", 1, 5, "C\\r"]));
  assert.equal(two.isAnswered, false);
  commands.hear(told(["command", 2, 5, "PU"], ["answer", 2, 9, "C\\r"], ["command", 3, 9, "@0P"], ["answer", 3, 9, "1"], ["command", 4, 9, "@0P"], ["answer", 4, 9, "2"]));
  assert.deepEqual([two, same, again].map(({ virtual, isAnswered }) => [virtual.bytes, isAnswered]), [["C\\rC\\r", true], ["1", true], ["2", true]]);
  commands.idle(100);
  assert.equal(none.isAnswered, false);
  commands.idle(1_000);
  assert.equal(none.isAnswered, true);
  // Where something else is done with it what was not answered is not compared.
  const left = begun("@0A9,9");
  left.went = "out";
  commands.give(left, 0, 0);
  commands.end(true);
  commands.hear(told(["command", 1, 1, "@0A9,9"], ["answer", 1, 1, "0"]));
  assert.deepEqual([left.virtual.bytes, verdict(left)], ["", "apart"]);
  // So is a line that the real one has answered already.
  const behind = { ...begun("@0A9,9"), went: "out", real: { bytes: "0", after: 9 } };
  commands.give(behind, 0, 0);
  commands.end(true);
  assert.equal(verdict(behind), "apart");
});

/** Lines that went out, each with when and what the virtual one has said to it; null if it has not yet. */
function owing(...lines) {
  const owed = new Owed();
  const all = lines.map(([line, at, said]) => {
    const one = { ...begun(line), went: "out", whole: at };
    owed.goes(one, at);
    if (said !== null) [one.virtual, one.isAnswered] = [{ bytes: said, after: 0 }, true];
    return one;
  });
  const say = (at, text) => owed.take(new TextEncoder().encode(text), at);
  return { owed, say, all, seen: () => all.map((one) => one.isUnsure ? "?" : one.real.bytes), verdicts: () => all.map(verdict) };
}

test("an answer of the real controller ends where the next line's begins", () => {
  const { say, all, seen, verdicts } = owing(["@0A1800,900", 0, null], ["@0P", 300, null]);
  say(2_050, "0");
  assert.deepEqual([seen(), verdicts()], [["0", ""], ["open", "open"]]);
  all[0].virtual = { bytes: "0", after: 2_010 };
  all[1].virtual = { bytes: "0000708", after: 1_710 };
  for (const one of all) one.isAnswered = true;
  say(2_060, "0000708");
  assert.deepEqual([seen(), verdicts()], [["0", "0000708"], ["same", "same"]]);
  assert.deepEqual(all.map(({ real }) => real.after), [2_050, 1_760]);
});

test("another place has as many digits; what fits nothing is nobody's, until there is silence", () => {
  const stopped = owing(["@0A9000,900", 0, "F"], ["@0P", 200, "0000578"], ["@0V", 400, "isel0"], [STOP, 600, ""]);
  stopped.say(700, "F0000");
  stopped.say(702, "999is");
  assert.deepEqual(stopped.seen(), ["F", "0000999", "is", ""]);
  stopped.say(704, "el0");
  assert.deepEqual([stopped.seen(), stopped.verdicts()], [["F", "0000999", "isel0", ""], ["time", "bytes", "time", "open"]]);
  const odd = owing(["@0P", 0, "0000"], ["@07", 10, "0"], ["@08", 20, "0"]);
  odd.say(30, "HHHHHHH");
  assert.deepEqual(odd.verdicts(), ["unsure", "unsure", "unsure"]);
  const paused = owing(["@0P", 0, "0000"], ["@07", 10, "0"]);
  paused.say(30, "5");
  paused.say(500, "0");
  paused.owed.end("next");
  assert.deepEqual([paused.seen(), paused.verdicts()], [["5", "0"], ["bytes", "time"]]);
  const lost = owing(["@0P", 0, "0000"], ["@07", 10, "0"]);
  lost.say(30, "00");
  lost.owed.end("next");
  assert.deepEqual(lost.verdicts(), ["unsure", "unsure"]);
});

test("what was said before a line went out is not said to it, and late answers are waited for", () => {
  const before = owing(["@0P", 0, "0"]);
  before.say(10, "HH");
  // It has fallen silent: that was its answer.
  const next = { ...begun("@07"), went: "out" };
  before.owed.goes(next, 400);
  before.say(410, "0");
  assert.deepEqual([before.seen(), next.real.bytes, before.verdicts()], [["HH"], "0", ["bytes"]]);
  const late = owing(["@0P", 0, "0000"], ["@07", 1_900, "0"]);
  late.say(1_950, "00000");
  assert.deepEqual(late.seen(), ["0000", "0"]);
  const never = owing(["@0P", 0, "0000"], ["@07", 2_100, "0"]);
  never.say(2_120, "0");
  assert.deepEqual([never.seen(), never.verdicts()], [["", "0"], ["bytes", "same"]]);
  // Nor does a line have to do with it that did not go out after all.
  const given = owing(["@0A9", 0, null], ["@0P", 5, "000"]);
  given.owed.drop(given.all[0]);
  given.say(10, "000");
  assert.deepEqual(given.seen(), ["", "000"]);
});

test("silence settles whose an answer is, and who has said nothing is still waited for", () => {
  const { owed, say, seen, verdicts } = owing(["@0P", 0, "0000"], ["@07", 1_200, "0"]);
  say(50, "0");
  say(1_250, "0");
  assert.deepEqual([owed.settle(2_000), verdicts()], [1_250, ["open", "open"]]);
  assert.equal(owed.settle(3_251), null);
  assert.deepEqual([seen(), verdicts()], [["0", "0"], ["bytes", "same"]]);
  // What nobody has asked for changes nothing of that.
  say(4_000, "ST");
  assert.deepEqual(seen(), ["0", "0"]);
  const same = owing(["@07", 0, "0"]);
  same.say(60, "0");
  assert.equal(same.owed.settle(100), 260);
  assert.equal(same.owed.settle(400), null);
  same.say(1_288, "ST");
  assert.deepEqual([same.seen(), same.verdicts()], [["0"], ["time"]]);
  // A real reference run may take longer than that of the virtual one.
  const run = owing(["@07", 0, "0"], ["@0R7", 10, "0"]);
  run.say(5, "0");
  assert.equal(run.owed.settle(1_000), 1_010);
  run.owed.settle(2_011);
  assert.deepEqual(run.verdicts(), ["same", "late"]);
  assert.equal(run.owed.settle(9_000), null);
  run.say(25_000, "0");
  assert.deepEqual([run.seen(), run.verdicts()], [["0", "0"], ["same", "time"]]);
  const none = owing(["@07", 0, "0"], [STOP, 10, ""]);
  none.owed.settle(2_011);
  assert.deepEqual(none.verdicts(), ["late", "silent"]);
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
