// How finely the panel draws on a fast computer, on a slow one, and on one that is busy for a while.
import assert from "node:assert/strict";
import { test } from "node:test";
import { build } from "esbuild";

const { outputFiles } = await build({
  entryPoints: [new URL("../src/pace.ts", import.meta.url).pathname],
  bundle: true, format: "esm", write: false,
});
const { Pace } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);

/** A computer that takes so many ms for everything, and never less than for a screen's frame. */
const takes = (pace, all, base = 17) => base + (all * pace.sharpness ** 2) / pace.every;

/** Draws so many frames and gives their times. */
function draw(pace, all, frames, base) {
  return Array.from({ length: frames }, () => {
    const time = takes(pace, all, base);
    pace.took(time);
    return time;
  });
}

test("a fast computer draws everything", () => {
  const pace = new Pace();
  draw(pace, 5, 1_000);
  assert.equal(pace.level, 0);
  assert.deepEqual([pace.sharpness, pace.every], [1, 1]);
});

test("a slow one is in time after a frame, and stays so but for a trial now and then", () => {
  const pace = new Pace();
  assert.ok(takes(pace, 1_300) > 1_000);
  const times = draw(pace, 1_300, 2_000);
  const late = times.slice(2).filter((time) => time > 50).length;
  assert.ok(late < 20, `${late} late frames`);
  assert.ok(pace.every > 1 && pace.sharpness === 0.5);
});

test("it draws no less than it can", () => {
  const pace = new Pace();
  draw(pace, 1_300, 200);
  const finer = new Pace();
  finer.level = pace.level - 2;
  assert.ok(takes(finer, 1_300) > 45, "two steps finer would be late");
});

test("one that was busy draws everything again soon after", () => {
  const pace = new Pace();
  draw(pace, 5, 50, 300);
  assert.ok(pace.level > 5);
  draw(pace, 5, 100);
  assert.equal(pace.level, 0);
});

test("what everything took says with what the next motion begins", () => {
  const pace = new Pace();
  pace.tookAll(1_300);
  assert.ok(draw(pace, 1_300, 10).every((time) => time <= 50));
  pace.tookAll(20);
  assert.equal(pace.level, 0);
});
