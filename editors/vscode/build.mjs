// Puts the extension into one file, and beside it the licences of what is in it.
import { build } from "esbuild";
import { readdir, readFile, writeFile } from "node:fs/promises";

const { metafile } = await build({
    entryPoints: ["src/extension.ts"],
    outfile: "dist/extension.js",
    bundle: true,
    platform: "node",
    format: "cjs",
    target: "node20",
    external: ["vscode"],
    minify: true,
    metafile: true,
    legalComments: "none",
    logLevel: "warning",
});
const ours = await Promise.all(["MIT", "APACHE"].map((name) => readFile(`../../LICENSE-${name}`, "utf8")));
const others = new Set(Object.keys(metafile.inputs).flatMap((path) => /^node_modules\/(?:@[^/]+\/)?[^/]+/.exec(path) ?? []));
const texts = await Promise.all([...others].sort().map(async (folder) => {
    const licence = (await readdir(folder)).find((name) => /^licen[cs]e/i.test(name));
    if (licence === undefined) {
        throw new Error(`${folder} has no licence that could be handed on`);
    }
    return `${folder.replace("node_modules/", "")}\n\n${await readFile(`${folder}/${licence}`, "utf8")}`;
}));
const line = `\n\n${"-".repeat(72)}\n\n`;
const parts = ["MIT or Apache-2.0, as you like.", ...ours, "What others have written of dist/extension.js:", ...texts];
await writeFile("LICENSE.txt", parts.map((part) => part.trim()).join(line) + "\n");
