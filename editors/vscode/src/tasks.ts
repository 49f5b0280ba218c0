// What is done in a terminal: checking, running, sending, and starting a controller.
import { isAbsolute } from "node:path";
import * as vscode from "vscode";
import { find, folderOf, optionsOf, targetOptions } from "./program";

/** What a task of tasks.json can say. */
interface Definition extends vscode.TaskDefinition {
    command: "check" | "run" | "send" | "serve";
    file?: string;
    args?: string[];
}

/** How each is called in the list of tasks. */
const TITLES: Record<Definition["command"], string> = {
    check: "check the job",
    run: "run in virtual time",
    send: "send to a controller",
    serve: "start a virtual controller",
};

/** The arguments of a command. */
function words(definition: Definition, document: vscode.TextDocument | undefined): string[] {
    const scope = document ?? folderOf();
    const further = [...targetOptions(scope), ...(definition.args ?? [])];
    const file = definition.file ?? document?.uri.fsPath ?? "";
    const job = optionsOf(document);
    switch (definition.command) {
        case "check":
            return ["ncp", "check", file, "--format", "short", ...further, ...job];
        case "run":
            return document?.languageId === "ncp" ? ["ncp", "run", file, ...further, ...job] : ["run", file, ...further];
        case "send":
            return ["send", file, ...further, ...job];
        case "serve":
            return ["serve", "-v", ...further];
    }
}

/** The document that a task is about. */
async function documentOf(definition: Definition): Promise<vscode.TextDocument | undefined> {
    if (definition.file === undefined) {
        const active = vscode.window.activeTextEditor?.document;
        return definition.command === "serve" ? active : await saved(active);
    }
    const folder = folderOf()?.uri;
    const uri = isAbsolute(definition.file) || folder === undefined
        ? vscode.Uri.file(definition.file)
        : vscode.Uri.joinPath(folder, definition.file);
    try {
        return await vscode.workspace.openTextDocument(uri);
    } catch {
        // vimc4 says what is wrong with the name of the file.
        return undefined;
    }
}

async function made(definition: Definition, document: vscode.TextDocument | undefined): Promise<vscode.Task | undefined> {
    const folder = folderOf(document?.uri);
    const program = await find(document?.uri);
    if (program === undefined) {
        return undefined;
    }
    const execution = new vscode.ProcessExecution(program, words(definition, document), { cwd: folder?.uri.fsPath });
    const scope = folder ?? vscode.TaskScope.Workspace;
    const matchers = definition.command === "check" ? ["$vimc4"] : [];
    const task = new vscode.Task(definition, scope, TITLES[definition.command], "vimc4", execution, matchers);
    task.isBackground = definition.command === "serve";
    task.presentationOptions = { focus: definition.command !== "check", clear: true, panel: vscode.TaskPanelKind.Dedicated };
    return task;
}

/** Tasks for tasks.json and for the list of tasks. */
export function registerTasks(): vscode.Disposable {
    return vscode.tasks.registerTaskProvider("vimc4", {
        async provideTasks() {
            const active = vscode.window.activeTextEditor?.document;
            // One that has no name yet is in no file.
            const document = active?.isUntitled ? undefined : active;
            const commands: Definition["command"][] =
                document?.languageId === "ncp" ? ["check", "run", "serve"]
                : document?.languageId === "isel" || document?.languageId === "lpkf" ? ["run", "serve"]
                : ["serve"];
            const tasks = commands.map((command) => made({ type: "vimc4", command }, document));
            return (await Promise.all(tasks)).filter((task) => task !== undefined);
        },
        async resolveTask(task) {
            const definition = task.definition as Definition;
            const resolved = await made(definition, await documentOf(definition));
            // The editor knows a task by its definition, which must be the same object.
            return resolved && Object.assign(resolved, { definition });
        },
    });
}

/** Starts a command in a terminal, for the file in the editor, as it was saved. */
export async function start(command: Definition["command"], args: string[] = []): Promise<vscode.TaskExecution | undefined> {
    const active = vscode.window.activeTextEditor?.document;
    const document = command === "serve" ? active : await saved(active);
    if (command !== "serve" && document === undefined) {
        return undefined;
    }
    const task = await made({ type: "vimc4", command, args }, document);
    return task && vscode.tasks.executeTask(task);
}

/** A document as it is on the disk, which is what vimc4 reads; nothing if a person did not want to save it. One that had
 *  no name yet is another document once it has. */
export async function saved(document: vscode.TextDocument | undefined): Promise<vscode.TextDocument | undefined> {
    if (document === undefined || (!document.isDirty && !document.isUntitled)) {
        return document;
    }
    const uri = await vscode.workspace.save(document.uri);
    return uri && (await vscode.workspace.openTextDocument(uri));
}

/** Sends the file in the editor, after asking where. vimc4 itself asks before a machine moves. */
export async function send(): Promise<vscode.TaskExecution | undefined> {
    const scope = vscode.window.activeTextEditor?.document;
    const port = vscode.workspace.getConfiguration("vimc4", scope).get("port", "").trim();
    const to = port || (await vscode.window.showInputBox({
        title: "Send to",
        prompt: "A serial port, a pseudo-terminal, or tcp:host:port",
        placeHolder: process.platform === "win32" ? "COM7" : "./vimc4.pty",
    }))?.trim();
    return to ? start("send", ["--to", to]) : undefined;
}
