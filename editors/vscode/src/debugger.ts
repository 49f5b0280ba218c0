// The debugger: `vimc4 dap`, and what a configuration that says little means.
import { basename, resolve } from "node:path";
import * as vscode from "vscode";
import { isOurs } from "./languages";
import { find, folderOf, optionsOf, target } from "./program";
import { saved } from "./tasks";

/** A file in which a controller was recorded. */
const RECORDING = /\.jsonl(\.gz|\.zst)?$/i;

/** How a file is debugged; nothing if it is none that a controller carries out, and no recording either. */
function configurationOf(document: vscode.TextDocument): vscode.DebugConfiguration | undefined {
    const file = document.uri.fsPath;
    const common = { type: "vimc4", name: basename(file), stopOnEntry: true };
    if (RECORDING.test(file)) {
        return { ...common, request: "attach", recording: file };
    }
    return isOurs(document) ? { ...common, request: "launch", program: file } : undefined;
}

/** Debugs the file in the editor. F5 asks for an extension where the editor knows no debugger of a language, as of
 *  recordings; this does not. */
export async function debugThis(): Promise<void> {
    const document = await saved(vscode.window.activeTextEditor?.document);
    const configuration = document && configurationOf(document);
    if (configuration !== undefined) {
        await vscode.debug.startDebugging(folderOf(document?.uri), configuration);
    }
}

/** What the settings say of what is debugged. Only jobs have options, and recordings know their own. */
async function ofSettings(
    debugged: Record<string, unknown>,
    cwd: string | undefined,
    folder: vscode.WorkspaceFolder | undefined,
): Promise<Record<string, unknown>> {
    if (debugged.recording !== undefined) {
        return {};
    }
    // Settings count by the language of a file.
    const document = await documentOf(debugged.program, cwd);
    const options = optionsOf(document);
    return { ...target(document ?? folder), ...(options.length > 0 && { jobOptions: options }) };
}

class Configurations implements vscode.DebugConfigurationProvider {
    /** F5 without a configuration: the file in the editor. */
    async resolveDebugConfiguration(
        _folder: vscode.WorkspaceFolder | undefined,
        configuration: vscode.DebugConfiguration,
    ): Promise<vscode.DebugConfiguration | undefined> {
        if (configuration.type || configuration.request || configuration.name) {
            return configuration;
        }
        const document = await saved(vscode.window.activeTextEditor?.document);
        return document && configurationOf(document);
    }

    /** What is left out is what the settings say; of several controllers, what one leaves out and what is not said beside
     *  the list either. Recordings and controllers that run know their own. */
    async resolveDebugConfigurationWithSubstitutedVariables(
        folder: vscode.WorkspaceFolder | undefined,
        configuration: vscode.DebugConfiguration,
    ): Promise<vscode.DebugConfiguration> {
        const cwd = configuration.cwd ?? (folder ?? folderOf())?.uri.fsPath;
        const within: vscode.DebugConfiguration = cwd === undefined ? configuration : { ...configuration, cwd };
        if (configuration.request !== "launch") {
            return within;
        }
        const controllers: unknown = configuration.controllers;
        if (!Array.isArray(controllers) || controllers.length === 0) {
            return { ...(await ofSettings(within, cwd, folder)), ...within };
        }
        const each = controllers.map(async (own: Record<string, unknown>) => {
            const debugged = (own.program ?? own.recording ?? own.serve) === undefined ? within : own;
            const said = Object.entries(await ofSettings(debugged, own.cwd === undefined ? cwd : String(own.cwd), folder));
            return { ...Object.fromEntries(said.filter(([name]) => within[name] === undefined)), ...own };
        });
        return { ...within, controllers: await Promise.all(each) };
    }
}

/** The file of a configuration, if it has one that can be read. */
async function documentOf(program: unknown, cwd: string | undefined): Promise<vscode.TextDocument | undefined> {
    if (typeof program !== "string") {
        return undefined;
    }
    try {
        return await vscode.workspace.openTextDocument(resolve(cwd ?? "", program));
    } catch {
        // That it cannot be read is told by the adapter, which is asked next.
        return undefined;
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
