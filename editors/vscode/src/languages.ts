// Which files are whose: jobs, command lists and stored programs, plots.
import * as vscode from "vscode";

/** The languages of this extension. */
export const LANGUAGES = ["ncp", "isel", "lpkf"];

/** Whether the editor shows a file that a controller carries out. */
export function isOurs(document: vscode.TextDocument): boolean {
    return LANGUAGES.includes(document.languageId);
}

/** How many lines show what a text is. */
const LOOKED_AT = 50;

/** Whether a text begins as a command list does, or says that it is a stored program. */
export function isCommands(lines: Iterable<string>): boolean {
    for (const line of lines) {
        if (/^[ \t]*[;#][;# \t]*(model|machine|axes):[ \t]*\S/.test(line)) {
            return true;
        }
        if (!/^[ \t]*([;#]|$)/.test(line)) {
            return /^[ \t]*@[0-9][ \t]*([0-9A-Za-z?]|$)/.test(line);
        }
    }
    return false;
}

/** Text files have no ending of their own, so their beginning is looked at. */
export function recognize(): vscode.Disposable {
    const look = (document: vscode.TextDocument): void => {
        const wanted = vscode.workspace.getConfiguration("vimc4", document).get("recognize", true);
        if (!wanted || document.languageId !== "plaintext" || document.isUntitled) {
            return;
        }
        const count = Math.min(document.lineCount, LOOKED_AT);
        const lines = Array.from({ length: count }, (_, line) => document.lineAt(line).text);
        if (isCommands(lines)) {
            void vscode.languages.setTextDocumentLanguage(document, "isel");
        }
    };
    vscode.workspace.textDocuments.forEach(look);
    return vscode.workspace.onDidOpenTextDocument(look);
}
