// Makes the page that needs no installing: a folder of files that any web server, or none but a browser's
// own cache, can have. The controllers in it are made by `cargo xtask page` before.
import { build } from "esbuild";
import { createHash } from "node:crypto";
import { mkdir, readFile, rm, writeFile } from "node:fs/promises";
import { gzipSync } from "node:zlib";

const target = process.env.CARGO_TARGET_DIR ? new URL(`file://${process.env.CARGO_TARGET_DIR}/`) : new URL("../target/", import.meta.url);
const out = new URL("playground/", target);
const modules = new URL("page/", target);
/** What is fetched before the first answer; bytes (gzip). */
const LIMIT = 398_000;
/** Which controller and machine an example is for. */
const EXAMPLES = [
  { name: "commands.txt", model: "imc4", machine: "mill" },
  { name: "program.txt", model: "imc4", machine: "mill" },
  { name: "plate.ncp", model: "imc4", machine: "mill" },
  { name: "board.plt", model: "smcu", machine: "board-plotter" },
  { name: "limit.jsonl", model: "", machine: "" },
];

const local = (name) => new URL(name, import.meta.url);
const controllers = (name) => readFile(new URL(name, modules)).catch(() => {
  throw new Error(`${modules.pathname}${name} is not there: cargo xtask page`);
});
const bundle = (options) =>
  build({
    absWorkingDir: local(".").pathname, bundle: true, format: "esm", target: "es2022", minify: true,
    legalComments: "eof", outdir: "out", write: false, metafile: true, ...options,
  });
const base = (path) => path.split("/").at(-1);
const digest = (bytes) => createHash("sha256").update(bytes).digest("hex");

// A module has what is in it in its name: a page that is open asks for its own, and never gets one of another edition.
const wasm = {};
const files = {};
for (const name of ["first", "page"]) {
  const bytes = await controllers(`vimc4_${name}.wasm`);
  wasm[name] = `${name}-${digest(bytes).slice(0, 8).toUpperCase()}.wasm`;
  files[wasm[name]] = bytes;
}
Object.assign(files, {
  "index.html": await readFile(local("playground/index.html")),
  "app.webmanifest": await readFile(local("playground/app.webmanifest")),
  "icon.svg": await readFile(local("src/icon.svg")),
  "examples.json": Buffer.from(JSON.stringify(EXAMPLES)),
  "licences.txt": await readFile(local("../crates/api/web/dist/licences.txt")),
});
const { outputFiles, metafile } = await bundle({
  entryPoints: { playground: "playground/main.ts", worker: "playground/worker.ts" }, splitting: true,
  define: { FIRST: JSON.stringify(wasm.first), WHOLE: JSON.stringify(wasm.page) },
});
const styles = await bundle({ entryPoints: { playground: "playground/playground.css" } });
for (const { path, contents } of [...outputFiles, ...styles.outputFiles]) files[base(path)] = Buffer.from(contents);
// What is not asked for before there is a controller to show: the whole module, and what draws the machine.
const late = new Set([wasm.page, "licences.txt", ...Object.keys(metafile.outputs).map(base)]);
const isEarly = (path) => {
  late.delete(base(path));
  for (const used of metafile.outputs[path].imports) if (used.kind === "import-statement") isEarly(used.path);
};
for (const name of ["playground", "worker"]) isEarly(`out/${name}.js`);
for (const { name } of EXAMPLES) files[`examples/${name}`] = await readFile(local(`../examples/${name}`));

// An edition is what is in it: the same files give the same one.
const hash = createHash("sha256");
for (const name of Object.keys(files).sort()) hash.update(name).update(files[name]);
const edition = hash.digest("hex").slice(0, 12);
files["index.html"] = Buffer.from(files["index.html"].toString().replace("EDITION", edition));
const { outputFiles: [service] } = await bundle({
  entryPoints: { service: "playground/service.ts" },
  format: "iife",
  define: {
    FILES: JSON.stringify(Object.entries(files).map(([name, bytes]) => [name === "index.html" ? "./" : name, digest(bytes)])),
    EDITION: JSON.stringify(edition),
  },
});
const early = Object.keys(files).filter((name) => !name.startsWith("examples/") && !late.has(name));
const size = early.reduce((sum, name) => sum + gzipSync(files[name]).length, 0);
// A library that is not built along makes the modules larger. The test of the page does not let that pass.
if (size > LIMIT) console.warn(`the page has ${size} bytes (gzip) before the first answer, more than ${LIMIT}`);
files["service.js"] = Buffer.from(service.contents);

await rm(out, { recursive: true, force: true });
await mkdir(new URL("examples/", out), { recursive: true });
for (const [name, bytes] of Object.entries(files)) await writeFile(new URL(name, out), bytes);
console.log(`${out.pathname}: ${Object.keys(files).length} files, ${size} bytes (gzip) before the first answer`);
