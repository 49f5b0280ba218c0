// What a person does with the extension, in the editor itself: this runs in its extension host, with the real vimc4.
const assert = require("node:assert/strict");
const { spawn } = require("node:child_process");
const fs = require("node:fs");
const path = require("node:path");
const vscode = require("vscode");

const folder = () => vscode.workspace.workspaceFolders[0].uri;
const file = (name) => vscode.Uri.joinPath(folder(), name);
const settings = (scope) => vscode.workspace.getConfiguration("vimc4", scope);
const set = (name, value) => settings().update(name, value, vscode.ConfigurationTarget.Global);

async function open(name, text) {
    if (text !== undefined) {
        fs.writeFileSync(file(name).fsPath, text);
    }
    const document = await vscode.workspace.openTextDocument(file(name));
    await vscode.window.showTextDocument(document, vscode.ViewColumn.One);
    return document;
}

/** Waits until something is so, and returns it. */
async function until(what, find) {
    for (const end = Date.now() + 120_000; ; await new Promise((resolve) => setTimeout(resolve, 50))) {
        const found = await find();
        if (found) {
            return found;
        }
        assert.ok(Date.now() < end, `${what}: this did not come within two minutes; the last of the debugger: ${JSON.stringify(traffic.slice(-4))}`);
    }
}

/** The exit code of the task that a command starts. */
async function exit(begin) {
    const ended = new Promise((resolve) => {
        const watch = vscode.tasks.onDidEndTaskProcess(({ execution, exitCode }) => {
            if (execution.task.definition.type === "vimc4") {
                watch.dispose();
                resolve(exitCode);
            }
        });
    });
    await begin();
    return ended;
}

/** What the adapter and the editor say to each other. */
const traffic = [];

/** The next event of this name after a step. */
async function event(name, step) {
    const from = traffic.length;
    await step();
    return until(`the event ${name}`, () =>
        traffic.slice(from).find((message) => message.type === "event" && message.event === name));
}

/** The line at which the debugger is. */
async function line(session) {
    const { threads } = await session.customRequest("threads");
    const { stackFrames } = await session.customRequest("stackTrace", { threadId: threads[0].id });
    return stackFrames[0].line;
}

const TESTS = {
    "files have their languages, text files by what they hold": async () => {
        for (const [name, language] of [["plate.ncp", "ncp"], ["commands.txt", "isel"], ["program.txt", "isel"], ["board.plt", "lpkf"], ["look.txt", "plaintext"]]) {
            const document = await vscode.workspace.openTextDocument(file(name));
            await until(`${name} as ${language}`, () =>
                vscode.workspace.textDocuments.some((known) => known.uri.path === document.uri.path && known.languageId === language));
        }
    },

    "a job is checked as it is typed": async () => {
        const document = await open("wrong.ncp", "IMF_PBL_V1.0\nREF XYZ\nVLE 5000\nFASTABS X20000\nPROGEND\n");
        const problems = await until("the problem", () => {
            const found = vscode.languages.getDiagnostics(document.uri);
            return found.length > 0 && found;
        });
        assert.match(problems[0].message, /unknown command `VLE`/);
        assert.equal(problems[0].range.start.line, 2);
        const edit = new vscode.WorkspaceEdit();
        edit.replace(document.uri, new vscode.Range(2, 0, 2, 3), "VEL");
        await vscode.workspace.applyEdit(edit);
        await until("no problem", () => vscode.languages.getDiagnostics(document.uri).length === 0);
        const [hover] = await vscode.commands.executeCommand("vscode.executeHoverProvider", document.uri, new vscode.Position(3, 2));
        assert.match(hover.contents.map(({ value }) => value).join(), /rapid speed/);
        const symbols = await vscode.commands.executeCommand("vscode.executeDocumentSymbolProvider", document.uri);
        assert.ok(symbols.length > 0);
        const { items } = await vscode.commands.executeCommand("vscode.executeCompletionItemProvider", document.uri, new vscode.Position(4, 0));
        assert.ok(items.some(({ label }) => (label.label ?? label).startsWith("FASTABS")));
        await document.save();
    },

    "the machine of the settings is the one that is checked for": async () => {
        const document = await open("far.ncp", "IMF_PBL_V1.0\nREF XYZ\nFASTABS X900000\nPROGEND\n");
        await set("machine", "mill");
        const [problem] = await until("the problem", () => {
            const found = vscode.languages.getDiagnostics(document.uri);
            return found.length > 0 && found;
        });
        assert.match(problem.message, /its travel ends at 300000/);
        await set("machine", "bench");
        await until("no problem", () => vscode.languages.getDiagnostics(document.uri).length === 0);
        await set("machine", "mill");
    },

    "the path is shown beside the text, and anew when it is saved": async (api) => {
        const document = await open("path.ncp", "IMF_PBL_V1.0\nREF XYZ\nVEL 5000\nMOVEABS X20000\nPROGEND\n");
        await vscode.commands.executeCommand("vimc4.picture");
        const first = await until("a picture", () => api.pictures.of(document.uri)?.drawn);
        assert.match(first.svg, /<title>path\.ncp · imc4 · mill<\/title>/);
        assert.equal(first.code, 0, first.report);
        const edit = new vscode.WorkspaceEdit();
        edit.insert(document.uri, new vscode.Position(4, 0), "MOVEABS Y90000\n");
        await vscode.workspace.applyEdit(edit);
        await document.save();
        const second = await until("another picture", () => {
            const { drawn } = api.pictures.of(document.uri);
            return drawn !== first && drawn;
        });
        assert.match(second.report, /Y +90\.000 mm/);
        await api.pictures.of(document.uri).choose("time");
        assert.match(api.pictures.of(document.uri).drawn.svg, /mm\/s/);
        const tab = vscode.window.tabGroups.all.flatMap(({ tabs }) => tabs).find(({ label }) => label === "Path of path.ncp");
        assert.equal(tab.group.viewColumn, vscode.ViewColumn.Two);
        await vscode.window.tabGroups.close(tab);
        assert.equal(api.pictures.of(document.uri), undefined);
    },

    "a plot has the controller of plots": async (api) => {
        const document = await open("board.plt");
        assert.equal(settings(document).get("model"), "smcu");
        await vscode.commands.executeCommand("vimc4.picture");
        const { svg, report } = await until("a picture", () => api.pictures.of(document.uri)?.drawn);
        assert.match(svg, /board\.plt · smcu/, report);
    },

    "it runs, is checked, and is sent to a controller": async () => {
        await open("plate.ncp");
        assert.equal(await exit(() => vscode.commands.executeCommand("vimc4.run")), 0);
        assert.equal(await exit(() => vscode.commands.executeCommand("vimc4.check")), 0);
        const program = settings().get("path");
        const controller = spawn(program, ["serve", "--machine", "mill", "--pty", "none", "--tcp", "127.0.0.1:0", "--time", "instant", "--json"], { cwd: folder().fsPath });
        try {
            const ready = await new Promise((resolve) => controller.stdout.once("data", (text) => resolve(JSON.parse(text))));
            await set("port", `tcp:${ready.controllers[0].tcp}`);
            await open("commands.txt");
            assert.equal(await exit(() => vscode.commands.executeCommand("vimc4.send")), 0);
        } finally {
            controller.kill();
            await set("port", undefined);
        }
        await open("wrong.ncp", "IMF_PBL_V1.0\nREF XYZ\nVLE 5000\nPROGEND\n");
        assert.equal(await exit(() => vscode.commands.executeCommand("vimc4.check")), 1);
        await until("the problem of the task", () =>
            vscode.languages.getDiagnostics(file("wrong.ncp")).some(({ source, code }) => source === "vimc4" && code === "unknown-command"));
        const [task] = await vscode.tasks.fetchTasks({ type: "vimc4" });
        assert.equal(task.source, "vimc4");
    },

    "a job becomes a stored program": async () => {
        await open("plate.ncp");
        await vscode.commands.executeCommand("vimc4.compile");
        const { document } = vscode.window.activeTextEditor;
        assert.equal(document.languageId, "isel");
        assert.match(document.getText(), /; machine: mill\n/);
    },

    "it is debugged, forward and back": async () => {
        const { uri } = await open("commands.txt");
        const document = await until("the language", () => vscode.workspace.textDocuments.find((known) => known.uri.path === uri.path && known.languageId === "isel"));
        vscode.debug.addBreakpoints([new vscode.SourceBreakpoint(new vscode.Location(document.uri, new vscode.Position(8, 0)))]);
        await event("stopped", () => vscode.commands.executeCommand("workbench.action.debug.start"));
        const session = vscode.debug.activeDebugSession;
        assert.equal(session.configuration.machine, "mill");
        assert.equal(await line(session), 2);
        await event("stopped", () => vscode.commands.executeCommand("workbench.action.debug.continue"));
        assert.equal(await line(session), 9);
        await event("stopped", () => vscode.commands.executeCommand("workbench.action.debug.stepBack"));
        assert.equal(await line(session), 7);
        const { result } = await session.customRequest("evaluate", { expression: "x", context: "watch" });
        assert.equal(result, "0");
        const ended = new Promise((resolve) => vscode.debug.onDidTerminateDebugSession(resolve));
        await vscode.debug.stopDebugging(session);
        await ended;
        vscode.debug.removeBreakpoints(vscode.debug.breakpoints);
    },

    "a recording is debugged, and so is a controller that runs": async () => {
        await vscode.window.showTextDocument(file("limit.jsonl"));
        await event("stopped", () => vscode.commands.executeCommand("vimc4.debug"));
        assert.equal(vscode.debug.activeDebugSession.configuration.request, "attach");
        await vscode.debug.stopDebugging();
        const controller = spawn(settings().get("path"), ["serve", "--pty", "none", "--tcp", "127.0.0.1:0", "--dap", "47110"], { cwd: folder().fsPath });
        try {
            await new Promise((resolve) => controller.stdout.on("data", (text) => /ready/.test(text) && resolve()));
            await event("stopped", () => vscode.debug.startDebugging(undefined, { type: "vimc4", request: "attach", name: "What runs", debugServer: 47110, stopOnEntry: true }));
            const { threads } = await vscode.debug.activeDebugSession.customRequest("threads");
            assert.match(threads[0].name, /imc4/);
            await vscode.debug.stopDebugging();
        } finally {
            controller.kill();
        }
    },

    "where vimc4 is not, it is said what to do": async () => {
        const told = [];
        const show = vscode.window.showErrorMessage;
        vscode.window.showErrorMessage = async (...words) => void told.push(words);
        try {
            await set("path", "/nowhere/vimc4");
            await open("plate.ncp");
            await vscode.commands.executeCommand("vimc4.run");
            await until("a message", () => told.length > 0);
            assert.match(told[0][0], /no program "\/nowhere\/vimc4".*vimc4\.path/);
            assert.deepEqual(told[0].slice(1), ["Choose the Program…", "Open Settings", "How to Install"]);
        } finally {
            vscode.window.showErrorMessage = show;
        }
    },
};

exports.run = async () => {
    const extension = vscode.extensions.getExtension("vimc4.vimc4");
    const api = await extension.activate();
    vscode.debug.registerDebugAdapterTrackerFactory("vimc4", {
        createDebugAdapterTracker: () => ({
            onDidSendMessage: (message) => traffic.push(message),
            onWillReceiveMessage: (message) => traffic.push(message),
        }),
    });
    const only = process.env.VIMC4_ONLY;
    let failed = 0;
    for (const [name, test] of Object.entries(TESTS).filter(([name]) => only === undefined || name.includes(only))) {
        const began = Date.now();
        try {
            await test(api);
            console.log(`test ok - ${name} (${Date.now() - began} ms)`);
        } catch (error) {
            failed += 1;
            console.log(`test not ok - ${name}: ${error.stack}`);
        }
    }
    console.log(`test end ${failed}`);
    assert.equal(failed, 0, `${failed} failed`);
};
