// The debugger: `vimc4 dap`, and what a configuration that says little means.
import { basename } from "node:path";
import * as vscode from "vscode";
import { isOurs } from "./languages";
import { find, folderOf, target } from "./program";

/** A file in which a controller was recorded. */
const RECORDING = /\.jsonl(\.gz|\.zst)?$/i;

class Configurations implements vscode.DebugConfigurationProvider {
    /** F5 without a configuration: the file in the editor. */
    resolveDebugConfiguration(
        folder: vscode.WorkspaceFolder | undefined,
        configuration: vscode.DebugConfiguration,
    ): vscode.DebugConfiguration | undefined {
        if (configuration.type || configuration.request || configuration.name) {
            return configuration;
        }
        const document = vscode.window.activeTextEditor?.document;
        if (document === undefined) {
            return undefined;
        }
        const file = document.uri.fsPath;
        if (RECORDING.test(file)) {
            const cwd = folderOf(document.uri)?.uri.fsPath ?? folder?.uri.fsPath;
            return { type: "vimc4", request: "attach", name: basename(file), recording: file, stopOnEntry: true, cwd };
        }
        if (!isOurs(document)) {
            return undefined;
        }
        return { type: "vimc4", request: "launch", name: basename(file), program: file, stopOnEntry: true };
    }

    /** What is left out is what the settings say. Recordings and controllers that run know their own. */
    async resolveDebugConfigurationWithSubstitutedVariables(
        folder: vscode.WorkspaceFolder | undefined,
        configuration: vscode.DebugConfiguration,
    ): Promise<vscode.DebugConfiguration> {
        const cwd = configuration.cwd ?? (folder ?? folderOf())?.uri.fsPath;
        const within = cwd === undefined ? configuration : { ...configuration, cwd };
        if (configuration.request !== "launch" || configuration.recording !== undefined) {
            return within;
        }
        return { ...target(await scopeOf(configuration.program, folder)), ...within };
    }
}

/** Which settings count for a file: those of its language. */
async function scopeOf(
    program: unknown,
    folder: vscode.WorkspaceFolder | undefined,
): Promise<vscode.ConfigurationScope | undefined> {
    if (typeof program !== "string") {
        return folder;
    }
    try {
        return await vscode.workspace.openTextDocument(program);
    } catch {
        // That it cannot be read is told by the adapter, which is asked next.
        return folder;
    }
}

/** Tells the editor how to debug. */
export function registerDebugger(): vscode.Disposable {
    return vscode.Disposable.from(
        vscode.debug.registerDebugConfigurationProvider("vimc4", new Configurations()),
        vscode.debug.registerDebugAdapterDescriptorFactory("vimc4", {
            async createDebugAdapterDescriptor(session) {
                const command = await find(session.workspaceFolder?.uri);
                if (command === undefined) {
                    throw new Error("vimc4 is not here");
                }
                const cwd = session.configuration.cwd;
                return new vscode.DebugAdapterExecutable(command, ["dap"], typeof cwd === "string" ? { cwd } : {});
            },
        }),
    );
}
