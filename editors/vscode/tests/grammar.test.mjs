// The colours are held against what the controllers know: the tables of their commands, and the pieces that the
// language server finds in every job of the repository.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { existsSync } from "node:fs";
import test from "node:test";
import { pieces, scopeOf } from "./colours.mjs";
import { jobs, LISTS, PLOTS, read, VIMC4 } from "./corpus.mjs";

/** What the pieces of a job are called: by the server, and by the scopes of the grammar. */
const KINDS = ["line number", "command", "word", "number", "text", "comment"];
const SCOPES = [
    [/^constant\.other\.line-number/, "line number"],
    [/^(entity\.name\.function|keyword\.control|keyword\.other|support\.function)\./, "command"],
    [/^(variable\.parameter|constant\.language)\./, "word"],
    [/^constant\.numeric\./, "number"],
    [/^string\./, "text"],
    [/^comment\./, "comment"],
];
const kindOf = (scope) => SCOPES.find(([pattern]) => pattern.test(scope))?.[1];

test("every command of a job has its colour", async () => {
    const commands = Array.from(read("docs/ncp-reference.md").matchAll(/^\| `([A-Z_]+)[^`]*` \| .* \| [DF] \|$/gm), ([, name]) => name);
    assert.ok(commands.length > 45, `${commands.length}`);
    for (const name of commands) {
        const word = name.replace(/n$/, "");
        for (const line of [word, `N10 ${word}`, `n5${word.toLowerCase()} ; x`]) {
            const [found] = await pieces("ncp", line);
            const command = found.find((piece) => piece.text.toUpperCase() === word);
            assert.equal(command && kindOf(command.scope), "command", line);
        }
        const longer = await scopeOf("ncp", `${word}QQ`, `${word}QQ`);
        assert.ok(word.startsWith("IMF") || kindOf(longer ?? "source") === undefined, `${word}QQ: ${longer}`);
    }
});

test("every example of the reference is coloured whole", async () => {
    const lines = Array.from(read("docs/ncp-reference.md").matchAll(/, as in `([^`]+)`/g), ([, line]) => line);
    assert.ok(lines.length > 30, `${lines.length}`);
    for (const line of lines) {
        const [found] = await pieces("ncp", line);
        for (const { scope, text } of found) {
            assert.ok(kindOf(scope) !== undefined || /^(punctuation|keyword\.operator)/.test(scope) || /^[.=]+$/.test(text), `${line}: ${text} is ${scope}`);
        }
    }
});

test("the colours of all jobs are those of the language server", { skip: existsSync(VIMC4) || process.env.VIMC4_REQUIRE_TOOLS ? false : `${VIMC4} is not built` }, async (test) => {
    const server = new Server();
    test.after(() => server.process.kill());
    await server.ask("initialize", { processId: null, rootUri: null, capabilities: {} });
    server.tell("initialized", {});
    let compared = 0;
    for (const { name, text } of jobs()) {
        const lines = text.split(/\r\n|\n|\r/);
        const uri = `file:///${encodeURIComponent(name)}.ncp`;
        server.tell("textDocument/didOpen", { textDocument: { uri, languageId: "ncp", version: 1, text } });
        const { data } = await server.ask("textDocument/semanticTokens/full", { textDocument: { uri } });
        const theirs = lines.map(() => []);
        for (let at = 0, line = 0, start = 0; at < data.length; at += 5) {
            line += data[at];
            start = (data[at] === 0 ? start : 0) + data[at + 1];
            // Blanks are nobody's.
            const piece = lines[line].slice(start, start + data[at + 2]);
            const from = start + piece.length - piece.trimStart().length;
            theirs[line].push(`${from}-${from + piece.trim().length} ${KINDS[data[at + 3]]}`);
        }
        const ours = await pieces("ncp", text);
        for (const [line, found] of ours.entries()) {
            // The server does not colour a comment in brackets on a line that is no command.
            const bracket = ({ scope }) => scope === "comment.block.bracket.ncp";
            const counted = found.filter((piece) => !bracket(piece) || theirs[line].some((text) => text.startsWith(`${piece.start}-`)));
            const mine = joined(counted).map(({ start, end, kind }) => `${start}-${end} ${kind}`);
            assert.deepEqual(mine, theirs[line], `${name}, line ${line + 1}: ${lines[line]}`);
            compared += mine.length;
        }
    }
    assert.ok(compared > 5_000, `${compared}`);
    await server.ask("shutdown", null);
    server.tell("exit", null);
    assert.equal(await server.ended, 0);
});

/** Pieces with a kind, those of a comment or a text as one. */
function joined(found) {
    const all = [];
    for (const { start, end, scope } of found) {
        const kind = kindOf(scope);
        const before = all.at(-1);
        if (kind !== undefined && kind === before?.kind && (kind === "comment" || kind === "text")) {
            before.end = end;
        } else if (kind !== undefined) {
            all.push({ start, end, kind });
        }
    }
    return all;
}

/** The language server, in the framing of its protocol. */
class Server {
    constructor() {
        this.process = spawn(VIMC4, ["ncp", "lsp", "--machine", "mill"], { stdio: ["pipe", "pipe", "inherit"] });
        this.ended = new Promise((resolve) => this.process.once("exit", resolve));
        this.waiting = new Map();
        this.id = 0;
        let buffer = Buffer.alloc(0);
        this.process.stdout.on("data", (bytes) => {
            buffer = Buffer.concat([buffer, bytes]);
            for (;;) {
                const head = buffer.indexOf("\r\n\r\n");
                const length = Number(/Content-Length: (\d+)/.exec(buffer.subarray(0, Math.max(head, 0)).toString())?.[1]);
                if (head < 0 || buffer.length < head + 4 + length) {
                    return;
                }
                const message = JSON.parse(buffer.subarray(head + 4, head + 4 + length).toString());
                buffer = buffer.subarray(head + 4 + length);
                this.waiting.get(message.id)?.(message);
            }
        });
    }

    tell(method, params, id) {
        const body = Buffer.from(JSON.stringify({ jsonrpc: "2.0", id, method, params }));
        this.process.stdin.write(`Content-Length: ${body.length}\r\n\r\n`);
        this.process.stdin.write(body);
    }

    async ask(method, params) {
        const id = ++this.id;
        const answer = new Promise((resolve) => this.waiting.set(id, resolve));
        this.tell(method, params, id);
        const { result, error } = await answer;
        assert.equal(error, undefined, `${method}: ${JSON.stringify(error)}`);
        return result;
    }
}

/** What the colour of a command says of it. */
const CLASSES = {
    Motion: "entity.name.function.motion.isel",
    Setting: "keyword.other.setting.isel",
    Query: "support.function.query.isel",
    Output: "support.function.output.isel",
    Program: "keyword.control.program.isel",
};

test("every command of isel's controllers has the colour of its class", async () => {
    const table = read("crates/isel-wire/src/table.rs");
    const rows = table.slice(table.indexOf("const ROWS")).split(/\n {4}row\(/).slice(1);
    const wanted = new Map();
    for (const row of rows) {
        const [, kind] = /^Op::\w+, "[^"]+", (\w+),/.exec(row);
        const direct = /\.direct\("@(\w+|\?)"/.exec(row)?.[1];
        const stored = /\.stored\("(\w)"/.exec(row)?.[1];
        for (const [name, prefix] of [[direct, "@0"], [stored, ""]]) {
            if (name !== undefined && name !== "axes") {
                const line = `${prefix}${name}`;
                wanted.set(line, [...(wanted.get(line) ?? []), CLASSES[kind]]);
            }
        }
    }
    assert.ok(wanted.size > 65, `${wanted.size}`);
    for (const [line, scopes] of wanted) {
        const name = line.replace("@0", "");
        const numbers = /^@0D|^@0[hHPSUVWXik?]|^9/.test(line) ? "" : "1,2";
        const found = await scopeOf("isel", `${line}${numbers}`, name);
        assert.ok(scopes.includes(found), `${line}: ${found}, and not ${scopes}`);
    }
    for (const line of ["@0a5,900", "@0r7", "@0s", "@0m 4, 900"]) {
        assert.equal(await scopeOf("isel", line, line[2]), CLASSES.Motion);
    }
    assert.equal(await scopeOf("isel", "@07", "7"), "constant.numeric.axes.isel");
    assert.equal(await scopeOf("isel", "; machine: mill", "mill"), "string.unquoted.said.isel");
    for (const wrong of ["@0q5", "@A5", "A5", "@0A5,x", "8", "05,9;"]) {
        const [found] = await pieces("isel", wrong);
        assert.ok(found.some(({ scope }) => scope === "invalid.illegal.isel"), wrong);
    }
});

test("every command of LPKF's controllers has a colour, and others have another", async () => {
    const forms = Array.from(read("fixtures/lpkf-catalogue.toml").matchAll(/form = "(!?[A-Z]{2})/g), ([, name]) => name);
    assert.ok(forms.length > 50, `${forms.length}`);
    for (const name of forms) {
        const scope = await scopeOf("lpkf", `IN;${name}1,2;`, name);
        assert.match(`${scope}`, /^(entity\.name\.function\.motion|support\.function|keyword)\./, name);
    }
    assert.equal(await scopeOf("lpkf", "IN;QQ5;", "QQ"), "variable.other.unknown.lpkf");
    // Commands follow each other without a separator, and behind the channel there is another unit.
    assert.deepEqual(
        (await pieces("lpkf", "INPA1,-2PD;!OC;!SV5\r!CC;"))[0].map(({ text }) => text),
        ["IN", "PA", "1", ",", "-2", "PD", ";", "!OC", ";", "!SV", "5"],
    );
    assert.equal(await scopeOf("lpkf", "!OC;!SV5;!CC;PU", "!SV"), "support.function.channel.lpkf");
    assert.equal(await scopeOf("lpkf", "!PH0,1;PU", "PU"), "support.function.output.lpkf");
    assert.equal(await scopeOf("lpkf", "!PH0,1 X5Y-5", "X"), "variable.parameter.lpkf");
});

test("examples and programs have no piece that a controller does not know", async () => {
    for (const [language, files] of [["isel", LISTS], ["lpkf", PLOTS]]) {
        for (const file of files) {
            for (const [line, found] of (await pieces(language, read(file))).entries()) {
                for (const { scope, text } of found) {
                    assert.ok(!/illegal|unknown|^source/.test(scope), `${file}:${line + 1}: ${text} is ${scope}`);
                }
            }
        }
    }
});
