// What a text looks like in the editor: the scopes of its pieces, found by the editor's own engine.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import oniguruma from "vscode-oniguruma";
import textmate from "vscode-textmate";
import { read } from "./corpus.mjs";

const wasm = readFileSync(createRequire(import.meta.url).resolve("vscode-oniguruma/release/onig.wasm"));
await oniguruma.loadWASM(wasm.buffer.slice(wasm.byteOffset, wasm.byteOffset + wasm.byteLength));
const registry = new textmate.Registry({
    onigLib: Promise.resolve({
        createOnigScanner: (sources) => new oniguruma.OnigScanner(sources),
        createOnigString: (text) => new oniguruma.OnigString(text),
    }),
    loadGrammar: async (scope) => {
        const path = `editors/vscode/syntaxes/${scope.replace("source.", "")}.tmLanguage.json`;
        return textmate.parseRawGrammar(read(path), path);
    },
});

/** The pieces of each line, without blanks: where, what, and the innermost scope. */
export async function pieces(language, text) {
    const grammar = await registry.loadGrammar(`source.${language}`);
    let state = textmate.INITIAL;
    return text.split(/\r\n|\n|\r/).map((line) => {
        const { tokens, ruleStack } = grammar.tokenizeLine(line, state);
        state = ruleStack;
        return tokens.flatMap(({ startIndex, endIndex, scopes }) => {
            const text = line.slice(startIndex, endIndex);
            if (text.trim() === "") {
                return [];
            }
            const start = startIndex + text.length - text.trimStart().length;
            return [{ start, end: start + text.trim().length, text: text.trim(), scope: scopes.at(-1), scopes }];
        });
    });
}

/** The scope of the first piece with this text. */
export async function scopeOf(language, line, text) {
    const [found] = await pieces(language, line);
    return found.find((piece) => piece.text === text)?.scope;
}
