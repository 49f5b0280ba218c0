// The way that a machine has gone, without a browser.
import assert from "node:assert/strict";
import { test } from "node:test";
import { build } from "esbuild";

const { outputFiles } = await build({
  entryPoints: [new URL("../src/path.ts", import.meta.url).pathname],
  bundle: true, format: "esm", write: false,
});
const { Path } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);

const counted = (path) => path.runs.reduce((sum, run) => sum + run.points.length / 3, 0);

test("what goes on is one run, what is of another kind or begins elsewhere is another", () => {
  const path = new Path();
  path.add("feed", [[0, 0, 0], [10, 0, 0]]);
  path.add("feed", [[10, 0, 0], [10, 10, 0]]);
  path.add("rapid", [[10, 10, 0], [0, 0, 0]]);
  path.add("rapid", [[5, 5, 5], [6, 6, 6]]);
  path.add("feed", [[1, 1, 1]]);
  assert.deepEqual(path.runs.map(({ kind, points }) => [kind, points.length / 3]), [["feed", 3], ["rapid", 2], ["rapid", 2]]);
  assert.equal(path.corners, counted(path));
});

test("a path without an end stays of one size, keeps its newest part and its beginning, and says what it has lost", () => {
  const most = 10_000;
  const path = new Path(most);
  let added = 1;
  for (let i = 0; i < 300_000; i++) {
    // Kinds change often, so that no run is long.
    path.add(["feed", "rapid", "arc"][Math.floor(i / 3) % 3], [[i, i % 7, 0], [i + 1, (i + 1) % 7, 0]]);
    added += 1;
    assert.ok(path.corners <= most, `${path.corners} corners`);
  }
  assert.equal(path.corners, counted(path));
  assert.deepEqual(path.runs[0].points.slice(0, 3), [0, 0, 0]);
  assert.equal(path.runs[0].kind, "older");
  assert.deepEqual(path.runs.at(-1).points.slice(-3), [300_000, 300_000 % 7, 0]);
  assert.notEqual(path.runs.at(-1).kind, "older");
  // A corner between two kinds is in both.
  assert.ok(path.thinned >= added - path.corners && path.thinned < added * 1.5, `${path.thinned}`);
  // Every run goes on where the one before ends.
  for (const [i, run] of path.runs.entries()) {
    if (i > 0) assert.deepEqual(run.points.slice(0, 3), path.runs[i - 1].points.slice(-3), `run ${i}`);
  }
});

test("a path that is learnt to be elsewhere moves as a whole", () => {
  const path = new Path();
  path.add("feed", [[0, 0, 0], [10, 0, 0]]);
  const { edition } = path;
  path.shift([1, 2, 3]);
  assert.deepEqual(path.runs[0].points, [1, 2, 3, 11, 2, 3]);
  assert.notEqual(path.edition, edition);
});
