// What the editor starts.
import * as vscode from "vscode";
import { chooseMachine, chooseModel } from "./choose";
import { compile } from "./compile";
import { debugThis, registerDebugger } from "./debugger";
import { recognize } from "./languages";
import { Pictures } from "./picture";
import { Server } from "./server";
import { registerTasks, send, start } from "./tasks";

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
