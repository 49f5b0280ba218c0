// What the editor starts.
import * as vscode from "vscode";
import { chooseMachine, chooseModel } from "./choose";
import { debugThis, registerDebugger } from "./debugger";
import { recognize } from "./languages";
import { Pictures } from "./picture";
import { find, folderOf, jobOptions, said, targetOptions } from "./program";
import { Server } from "./server";
import { registerTasks, saved, send, start } from "./tasks";

/** What other extensions, and the tests, can ask. */
export interface Api {
    pictures: Pictures;
}

export function activate(context: vscode.ExtensionContext): Api {
    const server = new Server();
    const pictures = new Pictures();
    const commands: Record<string, () => unknown> = {
        picture: () => pictures.show(),
        run: () => start("run"),
        check: () => start("check"),
        compile,
        debug: debugThis,
        send,
        serve: () => start("serve"),
        chooseModel,
        chooseMachine,
        restart: () => server.restart(),
    };
    context.subscriptions.push(
        server,
        pictures,
        recognize(),
        registerDebugger(),
        registerTasks(),
        ...Object.entries(commands).map(([name, command]) => vscode.commands.registerCommand(`vimc4.${name}`, command)),
    );
    return { pictures };
}

/** Shows the stored program that a job becomes, beside it. */
async function compile(): Promise<void> {
    const document = vscode.window.activeTextEditor?.document;
    const program = await find(document?.uri);
    if (document === undefined || program === undefined || !(await saved(document))) {
        return;
    }
    const args = ["ncp", "compile", document.uri.fsPath, ...targetOptions(document), ...jobOptions(document)];
    const { out, err, code } = await said(program, args, { cwd: folderOf(document.uri)?.uri.fsPath });
    if (code !== 0) {
        const lines = err.split("\n").map((line) => line.trim()).filter((line) => line !== "");
        void vscode.window.showErrorMessage(`It does not compile: ${lines.slice(0, 3).join(" ")}`);
        return;
    }
    const compiled = await vscode.workspace.openTextDocument({ language: "isel", content: out });
    await vscode.window.showTextDocument(compiled, vscode.ViewColumn.Beside);
}
