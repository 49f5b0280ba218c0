// A job as the stored program that it becomes.
import * as vscode from "vscode";
import { find, folderOf, jobOptions, said, targetOptions } from "./program";
import { saved } from "./tasks";

/** One of the problems that `--format json` tells of. */
interface Problem {
    line: number;
    severity: "error" | "warning" | "note";
    message: string;
    help: string | null;
}

/** So many are told; *Check the Job* lists all. */
const MOST = 3;

/** What vimc4 says of the lines of a job; nothing if it has not come to reading them. */
function problems(text: string): Problem[] | undefined {
    try {
        return (JSON.parse(text) as { diagnostics: Problem[] }).diagnostics;
    } catch {
        return undefined;
    }
}

/** Problems in one sentence, with what would be right. */
function told(all: Problem[]): string {
    const first = all.slice(0, MOST).map(({ line, message, help }) => `line ${line}: ${message}${help ? `; ${help}` : ""}`);
    const more = all.length - first.length;
    return `${first.join(". ")}${more > 0 ? `. And ${more} more: "Check the Job" lists them` : ""}.`;
}

/** Shows the stored program that a job becomes, beside it. */
export async function compile(): Promise<void> {
    const program = await find(vscode.window.activeTextEditor?.document.uri);
    const document = program && (await saved(vscode.window.activeTextEditor?.document));
    if (!program || !document) {
        return;
    }
    const what = ["ncp", "compile", document.uri.fsPath, "--format", "json"];
    const args = [...what, ...targetOptions(document), ...jobOptions(document)];
    const { out, err, code } = await said(program, args, { cwd: folderOf(document.uri)?.uri.fsPath });
    const found = problems(err);
    if (code !== 0) {
        const errors = found?.filter(({ severity }) => severity === "error");
        const why = errors ? told(errors) : err.replace(/^error: /, "").trim().split(/\s*\n\s*/).join(" ");
        void vscode.window.showErrorMessage(`It does not compile: ${why}`);
        return;
    }
    const doubts = found?.filter(({ severity }) => severity !== "note") ?? [];
    if (doubts.length > 0) {
        void vscode.window.showWarningMessage(`It compiles, but ${told(doubts)}`);
    }
    const compiled = await vscode.workspace.openTextDocument({ language: "isel", content: out });
    await vscode.window.showTextDocument(compiled, vscode.ViewColumn.Beside);
}
