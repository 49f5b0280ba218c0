// What the extension says to vimc4 and to the person, with an editor that is as much of one as that takes. The editor
// itself drives it in tests/editor.
import assert from "node:assert/strict";
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { basename, join } from "node:path";
import test, { after, beforeEach } from "node:test";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";
import { VIMC4 } from "./corpus.mjs";

const folder = mkdtempSync(join(tmpdir(), "vimc4-extension-"));
after(() => rmSync(folder, { recursive: true, force: true }));

const uri = (fsPath, scheme = "file") => ({ fsPath, scheme, path: fsPath, toString: () => `${scheme}:${fsPath}` });
const LANGUAGES = { ncp: "ncp", plt: "lpkf", isel: "isel" };
const documentOf = (where) => ({
    uri: where,
    languageId: LANGUAGES[where.fsPath.split(".").pop()] ?? "plaintext",
    isDirty: false,
    isUntitled: where.scheme === "untitled",
    lineCount: 0,
});
const nothing = { dispose() {} };

let settings, told, shown, started, debugged, provider;
const commands = {};
const active = (document) => void (vscode.window.activeTextEditor = document && { document });

/** A file in the folder, which the editor shows. */
function open(name, text) {
    writeFileSync(join(folder, name), text);
    const document = documentOf(uri(join(folder, name)));
    active(document);
    return document;
}

/** A setting: that of the language of its scope counts more. */
function setting(scope, name, otherwise) {
    return settings[`[${scope?.languageId}]`]?.[name] ?? settings[name] ?? otherwise;
}

const tell = (kind) => async (message) => void told.push(`${kind}: ${message}`);
const vscode = {
    workspace: {
        workspaceFolders: [{ uri: uri(folder) }],
        textDocuments: [],
        getConfiguration: (_section, scope) => ({ get: (name, otherwise) => setting(scope, name, otherwise) }),
        getWorkspaceFolder: () => vscode.workspace.workspaceFolders[0],
        openTextDocument: async (what) =>
            what.content !== undefined ? what : documentOf(typeof what === "string" ? uri(what) : what),
        onDidOpenTextDocument: () => nothing,
        onDidSaveTextDocument: () => nothing,
        onDidChangeConfiguration: () => nothing,
        // A person gives it a name.
        save: async ({ scheme, fsPath }) => (scheme === "untitled" ? open("named.ncp", "IMF_PBL\nREF XYZ\nPROGEND\n").uri : uri(fsPath)),
    },
    window: {
        showErrorMessage: tell("error"),
        showWarningMessage: tell("warning"),
        showTextDocument: async (document) => void shown.push(document),
    },
    commands: { registerCommand: (name, act) => ((commands[name] = act), nothing) },
    debug: {
        registerDebugConfigurationProvider: (_type, it) => ((provider = it), nothing),
        registerDebugAdapterDescriptorFactory: () => nothing,
        startDebugging: async (_folder, configuration) => void debugged.push(configuration),
    },
    tasks: { registerTaskProvider: () => nothing, executeTask: async (task) => void started.push(task) },
    languages: {},
    Disposable: { from: () => nothing },
    ProcessExecution: class { constructor(program, args) { Object.assign(this, { program, args }); } },
    Task: class { constructor(definition, scope, name, source, execution) { Object.assign(this, { execution }); } },
    TaskScope: {},
    TaskPanelKind: {},
    ViewColumn: {},
};

const made = await build({
    entryPoints: [fileURLToPath(new URL("../src/extension.ts", import.meta.url))],
    bundle: true,
    platform: "node",
    format: "cjs",
    external: ["vscode", "vscode-languageclient/node"],
    write: false,
    logLevel: "warning",
});
const bundled = { exports: {} };
const require = createRequire(import.meta.url);
const given = (name) => (name === "vscode" ? vscode : name.startsWith("vscode-languageclient") ? {} : require(name));
new Function("module", "exports", "require", made.outputFiles[0].text)(bundled, bundled.exports, given);
bundled.exports.activate({ subscriptions: [] });

beforeEach(() => {
    settings = { path: VIMC4, machine: "mill", "[lpkf]": { model: "smcu", machine: "board-plotter" } };
    [told, shown, started, debugged] = [[], [], [], []];
    active(undefined);
});

const resolved = (configuration) =>
    provider.resolveDebugConfigurationWithSubstitutedVariables(vscode.workspace.workspaceFolders[0], { type: "vimc4", name: "it", ...configuration });

test("a job that does not compile says why: its errors, each with what would be right", async () => {
    open("asks.ncp", "REF XYZ\nHALT\nMOVEABS X1000\nPROGEND\n");
    await commands["vimc4.compile"]();
    assert.equal(told.length, 1);
    assert.match(told[0], /^error: It does not compile: line 2: a stored program cannot wait for the operator; .*leave the line out/);
    assert.doesNotMatch(told[0], /IMF_PBL/);
    told.length = 0;
    open("wrong.ncp", `IMF_PBL\nREF XYZ\n${"HALT\n".repeat(5)}PROGEND\n`);
    await commands["vimc4.compile"]();
    assert.match(told[0], /line 3: .*line 5: .*And 2 more/);
    assert.equal(shown.length, 0);
    // What is not about its lines is said as it is.
    told.length = 0;
    settings.machine = "nowhere";
    await commands["vimc4.compile"]();
    assert.match(told[0], /It does not compile: .*nowhere/);
});

test("what is doubtful about a job that compiles is said", async () => {
    open("no-mark.ncp", "REF XYZ\nMOVEABS X1000\nPROGEND\n");
    await commands["vimc4.compile"]();
    assert.match(told.join(), /^warning: It compiles, but line 1: the file mark IMF_PBL is missing; begin the file/);
    assert.match(shown[0].content, /; machine: mill\n/);
    [told, shown] = [[], []];
    open("right.ncp", "IMF_PBL\nREF XYZ\nMOVEABS X1000\nPROGEND\n");
    await commands["vimc4.compile"]();
    assert.deepEqual([told, shown.length], [[], 1]);
});

test("what is debugged has the settings for it, also of several controllers", async () => {
    settings.jobOptions = ["--zero=100mm,50mm,-60mm"];
    const own = (configuration) => {
        const { model, machine, jobOptions } = configuration;
        return [model, machine, jobOptions?.length];
    };
    const [job, plot] = ["job.ncp", "board.plt"];
    assert.deepEqual(own(await resolved({ request: "launch", program: job })), [undefined, "mill", 1]);
    assert.deepEqual(own(await resolved({ request: "launch", program: job, jobOptions: [], machine: "bench" })), [undefined, "bench", 0]);
    assert.deepEqual(own(await resolved({ request: "launch", program: plot })), ["smcu", "board-plotter", undefined]);
    // What is no job has no options, and a controller behind ports neither.
    assert.deepEqual(own(await resolved({ request: "launch", serve: true })), [undefined, "mill", undefined]);
    assert.deepEqual(own(await resolved({ request: "attach", recording: "a.jsonl" })), [undefined, undefined, undefined]);
    const several = { request: "launch", controllers: [{ program: job }, { program: plot }, { recording: "a.jsonl" }, { program: plot, machine: "bench" }] };
    const each = async (more) => {
        const { controllers, ...beside } = await resolved({ ...several, ...more });
        return [own(beside), ...controllers.map(own)];
    };
    const none = [undefined, undefined, undefined];
    assert.deepEqual(await each({}), [none, [undefined, "mill", 1], ["smcu", "board-plotter", undefined], none, ["smcu", "bench", undefined]]);
    // What stands beside the list counts more than settings.
    assert.deepEqual(await each({ machine: "gantry", jobOptions: [] }), [
        [undefined, "gantry", 0], none, ["smcu", undefined, undefined], none, ["smcu", "bench", undefined],
    ]);
});

test("what had no name is saved and is then the file of that name", async () => {
    const untitled = () => active(documentOf(uri("Untitled-1", "untitled")));
    const named = join(folder, "named.ncp");
    untitled();
    await commands["vimc4.run"]();
    assert.deepEqual(started[0].execution.args.slice(0, 3), ["ncp", "run", named]);
    untitled();
    await commands["vimc4.debug"]();
    assert.equal(debugged[0].program, named);
    untitled();
    assert.equal((await provider.resolveDebugConfiguration(undefined, {})).program, named);
    untitled();
    await commands["vimc4.compile"]();
    assert.deepEqual([told, shown.length], [[], 1]);
    // Who does not save it has changed their mind.
    const { save } = vscode.workspace;
    vscode.workspace.save = async () => undefined;
    untitled();
    await commands["vimc4.run"]();
    await commands["vimc4.debug"]();
    vscode.workspace.save = save;
    assert.deepEqual([started.length, debugged.length, told], [1, 1, []]);
});

test("a path that is none is told of", async () => {
    open("right.ncp", "IMF_PBL\nREF XYZ\nPROGEND\n");
    mkdirSync(join(folder, "vimc4"), { recursive: true });
    for (const [path, remedy] of [
        ["target/debug/vimc4", /no program "target\/debug\/vimc4".*whole one/],
        [join(folder, "vimc4"), /no program .*Install it/],
        ["${workspaceFolder}/vimc4", /no program .*Install it/],
    ]) {
        settings.path = path;
        told.length = 0;
        await commands["vimc4.run"]();
        assert.match(told.join(), remedy, basename(path));
        // The message is answered.
        await new Promise(setImmediate);
    }
    assert.equal(started.length, 0);
});
