// Choosing the model and the machine from those that vimc4 has.
import * as vscode from "vscode";
import { isOurs } from "./languages";
import { find, folderOf, said } from "./program";

/** The rows of `vimc4 models` or `vimc4 machines`: a name, and what it is. */
export function rows(text: string): { label: string; description: string }[] {
    return text.split(/\r?\n/).flatMap((line) => {
        const [, label, description] = /^(\S+)\s+(.*)$/.exec(line) ?? [];
        return label === undefined || description === undefined ? [] : [{ label, description }];
    });
}

/** Lets a person choose, and keeps it in the settings of the workspace, or of the person where there is none. */
async function choose(what: "model" | "machine"): Promise<void> {
    const document = vscode.window.activeTextEditor?.document;
    const program = await find(document?.uri);
    if (program === undefined) {
        return;
    }
    const { out } = await said(program, [`${what}s`], { cwd: folderOf()?.uri.fsPath });
    const file = { label: "A profile file…", description: "" };
    const picked = await vscode.window.showQuickPick([...rows(out), file], { title: `The ${what}`, matchOnDescription: true });
    let name = picked?.label;
    if (picked === file) {
        const [chosen] = (await vscode.window.showOpenDialog({ filters: { Profiles: ["toml"] } })) ?? [];
        name = chosen && vscode.workspace.asRelativePath(chosen, false);
    }
    if (name === undefined) {
        return;
    }
    const ours = document !== undefined && isOurs(document) ? document : undefined;
    const configuration = vscode.workspace.getConfiguration("vimc4", ours);
    const where = folderOf() === undefined ? vscode.ConfigurationTarget.Global : vscode.ConfigurationTarget.Workspace;
    // Plots have a model of their own, so what is chosen beside one is for plots.
    await configuration.update(what, name, where, ours?.languageId === "lpkf");
}

export const chooseModel = (): Promise<void> => choose("model");
export const chooseMachine = (): Promise<void> => choose("machine");
