// Makes the files of the panel that the program embeds. With --check it changes nothing, and says
// whether the embedded ones are what the sources give.
import { build } from "esbuild";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { gzipSync } from "node:zlib";

const target = new URL("../crates/api/web/dist/", import.meta.url);
const source = (name) => readFile(new URL(name, import.meta.url));
const LIMIT = 250_000;

const bundled = await build({
  absWorkingDir: new URL(".", import.meta.url).pathname,
  entryPoints: { panel: "src/main.ts" },
  bundle: true,
  format: "esm",
  target: "es2022",
  minify: true,
  legalComments: "eof",
  outdir: "out",
  write: false,
});
const css = await build({
  absWorkingDir: new URL(".", import.meta.url).pathname,
  entryPoints: { panel: "src/panel.css" },
  minify: true,
  outdir: "out",
  write: false,
});
const files = {
  "index.html": await source("src/index.html"),
  "icon.svg": await source("src/icon.svg"),
  "panel.js": Buffer.from(bundled.outputFiles[0].contents),
  "panel.css": Buffer.from(css.outputFiles[0].contents),
  "licences.txt": Buffer.concat([
    Buffer.from("The panel contains three.js, under this licence:\n\n"),
    await source("node_modules/three/LICENSE"),
  ]),
};

const size = Object.values(files).reduce((sum, bytes) => sum + gzipSync(bytes).length, 0);
if (size > LIMIT) throw new Error(`the panel has ${size} bytes (gzip), more than ${LIMIT}`);

const check = process.argv.includes("--check");
await mkdir(target, { recursive: true });
for (const [name, bytes] of Object.entries(files)) {
  if (!check) await writeFile(new URL(name, target), bytes);
  else if (!bytes.equals(await readFile(new URL(name, target)).catch(() => Buffer.alloc(0)))) {
    throw new Error(`crates/api/web/dist/${name} is not what web/ gives: npm run build, and commit it`);
  }
}
console.log(`${Object.keys(files).length} files, ${size} bytes (gzip)`);
