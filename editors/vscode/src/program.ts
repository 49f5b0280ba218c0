// The program vimc4: where it is, what is said to it, and what a person is told where it is not.
import { execFile, type ExecFileOptions } from "node:child_process";
import { access, constants, stat } from "node:fs/promises";
import { homedir } from "node:os";
import { delimiter, isAbsolute, join } from "node:path";
import * as vscode from "vscode";

const WINDOWS = process.platform === "win32";

/** Where the program is; nothing if it is nowhere, which a person has then been told. */
export async function find(scope?: vscode.Uri): Promise<string | undefined> {
    const wanted = vscode.workspace.getConfiguration("vimc4", scope).get("path", "") || "vimc4";
    const found = await locate(expanded(wanted, scope));
    if (found === undefined) {
        // It is not waited for: a message stays until somebody reads it.
        void tellMissing(wanted, expanded(wanted, scope));
    }
    return found;
}

/** `~` and `${workspaceFolder}` at the beginning, which settings do not replace by themselves. */
function expanded(path: string, scope?: vscode.Uri): string {
    const folder = folderOf(scope)?.uri.fsPath ?? "";
    return path.replace(/^~(?=[/\\])/, homedir()).replace("${workspaceFolder}", folder);
}

/** The program of this name, as a shell finds it, or where cargo installs it. An editor that was started from the
 *  desktop often does not have that folder in its path. */
async function locate(name: string): Promise<string | undefined> {
    const folders = (process.env.PATH ?? "").split(delimiter).filter((folder) => folder !== "");
    const places = /[/\\]/.test(name)
        ? [name].filter(isAbsolute)
        : [...folders, join(homedir(), ".cargo", "bin")].map((folder) => join(folder, name));
    for (const place of places.flatMap((place) => (WINDOWS ? [place, `${place}.exe`] : [place]))) {
        try {
            await access(place, constants.X_OK);
            // Folders can be executed, too, in their way.
            if ((await stat(place)).isFile()) {
                return place;
            }
        } catch {
            // It is not there.
        }
    }
    return undefined;
}

let told = false;

async function tellMissing(wanted: string, path: string): Promise<void> {
    // Once until it is answered: the server, the picture and a command may all miss it at the same time.
    if (told) {
        return;
    }
    told = true;
    const [choose, settings, how] = ["Choose the Program…", "Open Settings", "How to Install"];
    const relative = /[/\\]/.test(path) && !isAbsolute(path);
    const remedy = relative
        ? "A path in the setting vimc4.path is a whole one, or begins with ~/ or ${workspaceFolder}/."
        : "Install it, or say in the setting vimc4.path where it is.";
    const message = `vimc4 is not here: there is no program "${wanted}". ${remedy}`;
    const answer = await vscode.window.showErrorMessage(message, choose, settings, how);
    told = false;
    if (answer === choose) {
        const [file] = (await vscode.window.showOpenDialog({ title: "The program vimc4" })) ?? [];
        if (file !== undefined) {
            const configuration = vscode.workspace.getConfiguration("vimc4");
            await configuration.update("path", file.fsPath, vscode.ConfigurationTarget.Global);
        }
    } else if (answer === settings) {
        await vscode.commands.executeCommand("workbench.action.openSettings", "vimc4.path");
    } else if (answer === how) {
        await vscode.commands.executeCommand("extension.open", "vimc4.vimc4");
    }
}

/** What a file, or else a folder, is meant for: model and machine, as options. Nothing that is not set, so that what
 *  the file says of itself counts. */
export function target(scope: vscode.ConfigurationScope | undefined): { model?: string; machine?: string } {
    const configuration = vscode.workspace.getConfiguration("vimc4", scope);
    const [model, machine] = ["model", "machine"].map((name) => configuration.get(name, "").trim());
    return { ...(model && { model }), ...(machine && { machine }) };
}

/** The same, as options of the program. */
export function targetOptions(scope: vscode.ConfigurationScope | undefined): string[] {
    return Object.entries(target(scope)).flatMap(([name, value]) => [`--${name}`, value]);
}

/** What else is said about jobs. */
export function jobOptions(scope: vscode.ConfigurationScope | undefined): string[] {
    return vscode.workspace.getConfiguration("vimc4", scope).get<string[]>("jobOptions", []);
}

/** The same for a file, which has none if it is no job. */
export function optionsOf(document: vscode.TextDocument | undefined): string[] {
    return document?.languageId === "ncp" ? jobOptions(document) : [];
}

/** The folder of the workspace that something is in, else the first. Names of profiles are relative to it. */
export function folderOf(scope?: vscode.Uri): vscode.WorkspaceFolder | undefined {
    const folder = scope && vscode.workspace.getWorkspaceFolder(scope);
    return folder ?? vscode.workspace.workspaceFolders?.[0];
}

/** What the program has said, and its exit code; no code if it was ended from outside. */
export interface Said {
    out: string;
    err: string;
    code: number | undefined;
}

/** Runs it to its end. */
export function said(program: string, args: string[], options: ExecFileOptions): Promise<Said> {
    return new Promise((resolve) => {
        const child = execFile(program, args, { maxBuffer: 64 << 20, encoding: "utf8", ...options }, (error, out, err) => {
            const code = error === null ? 0 : typeof error.code === "number" ? error.code : undefined;
            resolve({ out: String(out), err: String(err) || (code === undefined ? String(error) : ""), code });
        });
        // It asks nobody.
        child.stdin?.end();
    });
}
