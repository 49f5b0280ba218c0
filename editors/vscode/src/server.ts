// The language server for jobs: `vimc4 ncp lsp`.
import * as vscode from "vscode";
import { LanguageClient, RevealOutputChannelOn } from "vscode-languageclient/node";
import { find, folderOf, jobOptions, targetOptions } from "./program";

/** Starts it with the first job, and again when it must know something else. */
export class Server implements vscode.Disposable {
    private client: LanguageClient | undefined;
    /** What happens one after the other: starting and stopping take time. */
    private turn: Promise<void> = Promise.resolve();
    private readonly watches: vscode.Disposable;

    constructor() {
        this.watches = vscode.Disposable.from(
            vscode.workspace.onDidOpenTextDocument((document) => {
                if (document.languageId === "ncp" && this.client === undefined) {
                    void this.restart();
                }
            }),
            vscode.workspace.onDidChangeConfiguration((change) => {
                const matters = ["path", "model", "machine", "jobOptions"].some((name) =>
                    change.affectsConfiguration(`vimc4.${name}`, { languageId: "ncp" }),
                );
                if (matters && vscode.workspace.textDocuments.some((document) => document.languageId === "ncp")) {
                    void this.restart();
                }
            }),
        );
        if (vscode.workspace.textDocuments.some((document) => document.languageId === "ncp")) {
            void this.restart();
        }
    }

    /** Ends the server, and starts one with the settings of now. */
    restart(): Promise<void> {
        this.turn = this.turn.then(() => this.stop()).then(() => this.start());
        return this.turn;
    }

    private async start(): Promise<void> {
        const folder = folderOf()?.uri;
        const command = await find(folder);
        if (command === undefined) {
            return;
        }
        const scope = { uri: folder, languageId: "ncp" };
        const args = ["ncp", "lsp", ...targetOptions(scope), ...jobOptions(scope)];
        const client = new LanguageClient(
            "vimc4",
            "vimc4",
            { command, args, options: { cwd: folder?.fsPath } },
            { documentSelector: [{ language: "ncp" }], revealOutputChannelOn: RevealOutputChannelOn.Never },
        );
        this.client = client;
        try {
            await client.start();
        } catch (error) {
            const message = `The language server of vimc4 has not started: ${error instanceof Error ? error.message : error}. Its output says more; check vimc4.model, vimc4.machine and vimc4.jobOptions.`;
            const show = "Show the Output";
            void vscode.window.showErrorMessage(message, show).then((answer) => {
                if (answer === show) {
                    client.outputChannel.show();
                }
            });
        }
    }

    private async stop(): Promise<void> {
        const client = this.client;
        this.client = undefined;
        // One that has not started cannot be stopped, and is gone all the same.
        await client?.dispose().catch(() => undefined);
    }

    dispose(): void {
        this.watches.dispose();
        this.turn = this.turn.then(() => this.stop());
    }
}
