// The picture beside the text: where the axes go, drawn by vimc4 each time the file is saved.
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import * as vscode from "vscode";
import { find, folderOf, jobOptions, said, targetOptions } from "./program";
import { saved } from "./tasks";

/** What can be drawn, and what a person calls it. */
const VIEWS: [string, string][] = [
    ["", "default"],
    ["top", "top"],
    ["front", "front"],
    ["side", "side"],
    ["iso", "isometric"],
    ["time", "over time"],
];

/** No picture takes longer. */
const PATIENCE_MS = 60_000;

/** What a picture shows: for tests, and for whoever wants to export it. */
export interface Drawn {
    svg: string;
    report: string;
    code: number | undefined;
}

/** Draws a file; what was begun is ended by the signal. */
export async function draw(
    document: vscode.TextDocument,
    view: string,
    signal?: AbortSignal,
): Promise<Drawn | undefined> {
    const program = await find(document.uri);
    if (program === undefined) {
        return undefined;
    }
    const folder = await mkdtemp(join(tmpdir(), "vimc4-"));
    const out = join(folder, "path.svg");
    try {
        const file = document.uri.fsPath;
        const job = document.languageId === "ncp";
        const what = job ? ["ncp", "run", file, "--yes", ...jobOptions(document)] : ["run", file];
        const lenient = document.languageId === "lpkf" ? ["--keep-going", "--ignore-numbers"] : [];
        const plot = ["--plot", out, ...(view === "" ? [] : ["--plot-view", view])];
        const args = [...what, ...lenient, ...targetOptions(document), ...plot];
        const cwd = folderOf(document.uri)?.uri.fsPath;
        const { out: report, err, code } = await said(program, args, { cwd, signal, timeout: PATIENCE_MS });
        const svg = await readFile(out, "utf8").catch(() => "");
        return { svg, report: [err, report].filter((text) => text !== "").join("\n"), code };
    } finally {
        await rm(folder, { recursive: true, force: true });
    }
}

/** The pictures that are shown, one for each file. */
export class Pictures implements vscode.Disposable {
    private readonly shown = new Map<string, Picture>();
    private readonly watch: vscode.Disposable;

    constructor() {
        const renew = (uri: vscode.Uri): void => void this.shown.get(uri.toString())?.renew();
        this.watch = vscode.Disposable.from(
            vscode.workspace.onDidSaveTextDocument((document) => renew(document.uri)),
            vscode.workspace.onDidChangeConfiguration((change) => {
                if (change.affectsConfiguration("vimc4")) {
                    this.shown.forEach((picture) => void picture.renew());
                }
            }),
            // A text that is found to be something else by its beginning is drawn otherwise.
            vscode.workspace.onDidOpenTextDocument((document) => renew(document.uri)),
        );
    }

    /** Shows the picture of the file in the editor beside it. */
    async show(): Promise<void> {
        const document = await saved(vscode.window.activeTextEditor?.document);
        if (document === undefined) {
            return;
        }
        const key = document.uri.toString();
        const known = this.shown.get(key);
        if (known !== undefined) {
            known.reveal();
            return known.renew();
        }
        const picture = new Picture(document.uri, () => this.shown.delete(key));
        this.shown.set(key, picture);
        await picture.renew();
    }

    /** What is shown of a file. */
    of(uri: vscode.Uri): Picture | undefined {
        return this.shown.get(uri.toString());
    }

    dispose(): void {
        this.watch.dispose();
        this.shown.forEach((picture) => picture.dispose());
    }
}

/** A panel with the picture of a file. */
class Picture implements vscode.Disposable {
    private readonly panel: vscode.WebviewPanel;
    private view: string;
    private running: AbortController | undefined;
    /** What was drawn last. */
    drawn: Drawn | undefined;

    constructor(
        private readonly uri: vscode.Uri,
        gone: () => void,
    ) {
        const name = uri.path.split("/").pop();
        const where = { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true };
        this.panel = vscode.window.createWebviewPanel("vimc4.picture", `Path of ${name}`, where, { enableScripts: true });
        this.view = vscode.workspace.getConfiguration("vimc4", uri).get("picture.view", "");
        this.panel.webview.onDidReceiveMessage((view: unknown) => {
            if (VIEWS.some(([known]) => known === view)) {
                void this.choose(String(view));
            }
        });
        this.panel.onDidDispose(() => {
            this.running?.abort();
            gone();
        });
    }

    reveal(): void {
        this.panel.reveal(undefined, true);
    }

    /** Draws another view. */
    choose(view: string): Promise<void> {
        this.view = view;
        return this.renew();
    }

    /** Draws it again. What is being drawn is of an older text, and ended. */
    async renew(): Promise<void> {
        this.running?.abort();
        const running = new AbortController();
        this.running = running;
        const document = await vscode.workspace.openTextDocument(this.uri);
        const drawn = await draw(document, this.view, running.signal);
        if (running.signal.aborted) {
            return;
        }
        this.drawn = drawn;
        this.panel.webview.html = page(drawn, this.view);
    }

    dispose(): void {
        this.panel.dispose();
    }
}

function escaped(text: string): string {
    return text.replace(/[&<>"]/g, (sign) => `&#${sign.charCodeAt(0)};`);
}

/** The page: which view, the picture, and what the run said. The wheel makes the picture larger and smaller. */
export function page(drawn: Drawn | undefined, view: string): string {
    const nonce = Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16)).join("");
    const choice = VIEWS.map(([name, title]) => {
        const pressed = name === view ? ' aria-pressed="true"' : "";
        return `<button data-view="${name}"${pressed}>${title}</button>`;
    }).join(" ");
    // The picture is ours, but the texts in it are of the file: it is an image, in which nothing runs.
    const picture = drawn?.svg
        ? `<div id="sheet"><img id="picture" alt="the path" src="data:image/svg+xml;base64,${Buffer.from(drawn.svg).toString("base64")}"></div>`
        : "<p>There is no picture: the text below says why.</p>";
    const report = drawn === undefined ? "vimc4 is not here: say in the setting vimc4.path where it is." : drawn.report;
    const failed = drawn?.code === 0 ? "" : ' class="failed"';
    return `<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'nonce-${nonce}'; script-src 'nonce-${nonce}'">
<style nonce="${nonce}">
button { color: var(--vscode-button-secondaryForeground); background: var(--vscode-button-secondaryBackground); border: 0; padding: 2px 8px; }
button[aria-pressed] { color: var(--vscode-button-foreground); background: var(--vscode-button-background); }
#sheet { overflow: auto; margin: 8px 0; }
#picture { width: 100%; display: block; }
pre { white-space: pre-wrap; }
pre.failed { border-left: 3px solid var(--vscode-editorError-foreground); padding-left: 8px; }
</style>
</head>
<body>
<nav aria-label="view">${choice}</nav>
${picture}
<pre${failed}>${escaped(report)}</pre>
<script nonce="${nonce}">
const editor = acquireVsCodeApi();
for (const button of document.querySelectorAll("button")) {
    button.onclick = () => editor.postMessage(button.dataset.view);
}
const picture = document.getElementById("picture");
const sheet = document.getElementById("sheet");
let size = editor.getState() ?? 1;
const resize = () => { picture.style.width = size * 100 + "%"; editor.setState(size); };
if (picture) {
    resize();
    sheet.addEventListener("wheel", (event) => {
        if (!event.ctrlKey && !event.metaKey) return;
        event.preventDefault();
        const before = size;
        size = Math.min(16, Math.max(1, size * (event.deltaY < 0 ? 1.25 : 0.8)));
        resize();
        // What is under the mouse stays there.
        const box = sheet.getBoundingClientRect();
        const [x, y] = [event.clientX - box.left, event.clientY - box.top];
        sheet.scrollLeft = (sheet.scrollLeft + x) * (size / before) - x;
        sheet.scrollTop = (sheet.scrollTop + y) * (size / before) - y;
    }, { passive: false });
}
</script>
</body>
</html>`;
}
