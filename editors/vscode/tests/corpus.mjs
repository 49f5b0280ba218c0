// Every job that the repository has: files, and the texts that fixtures carry.
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

export const ROOT = fileURLToPath(new URL("../../..", import.meta.url));

export const read = (path) => readFileSync(join(ROOT, path), "utf8");

/** The jobs, each with where it comes from. */
export function jobs() {
    const files = readdirSync(join(ROOT, "fixtures/ncp"), { recursive: true }).map((name) => `fixtures/ncp/${name}`);
    return ["examples/plate.ncp", ...files].flatMap((name) => {
        if (name.endsWith(".ncp")) {
            return [{ name, text: read(name) }];
        }
        const texts = name.endsWith(".toml") ? read(name).matchAll(/^(?:program|text|each|file) = '''\n(.*?)'''/gms) : [];
        return Array.from(texts, ([, text], index) => ({ name: `${name} (${index + 1})`, text }));
    });
}

/** Command lists, stored programs and plots that are as they should be. */
export const LISTS = ["examples/commands.txt", "examples/program.txt", "fixtures/programs/pattern.cnc",
    ...["beyond", "drill", "gate", "halt", "poll", "shuttle", "stop", "stored"].map((name) => `emulator/tests/programs/${name}.txt`)];
export const PLOTS = ["examples/board.plt", "emulator/tests/programs/board.plt"];

/** The program that the repository builds. */
export const VIMC4 = process.env.VIMC4 ?? join(ROOT, "target/debug/vimc4");
