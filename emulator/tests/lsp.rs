//! `vimc4 ncp lsp` as an editor talks to it.

#![expect(clippy::unwrap_used, reason = "a test that cannot talk to the server has failed")]

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use serde_json::{Value, json};

/// Longer than anything takes.
const PATIENCE: Duration = Duration::from_secs(60);

/// The file that the tests talk about.
const FILE: &str = "file:///part.ncp";

/// An editor with its server.
struct Editor {
    server: Child,
    to: Option<ChildStdin>,
    from: Receiver<Value>,
    next_id: i32,
}

impl Editor {
    /// An editor that has not said anything.
    fn silent(arguments: &str) -> Editor {
        let mut server = Command::new(env!("CARGO_BIN_EXE_vimc4"))
            .args(["ncp", "lsp"])
            .args(arguments.split_whitespace())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut from_server = BufReader::new(server.stdout.take().unwrap());
        let (sender, from) = channel();
        thread::spawn(move || {
            while let Some(message) = read(&mut from_server) {
                sender.send(message).unwrap();
            }
        });
        Editor { to: server.stdin.take(), server, from, next_id: 0 }
    }

    /// An editor that knows snippets, and may begin.
    fn new(arguments: &str) -> Editor {
        let mut editor = Editor::silent(arguments);
        let item = json!({ "snippetSupport": true });
        let completion = json!({ "completion": { "completionItem": item } });
        let capabilities = json!({ "textDocument": completion });
        editor.ask("initialize", json!({ "capabilities": capabilities })).unwrap();
        editor.tell("initialized", json!({}));
        editor
    }

    /// An editor with a file.
    fn with(text: &str) -> Editor {
        let mut editor = Editor::new("");
        editor.open(text);
        editor
    }

    fn open(&mut self, text: &str) {
        let file = json!({ "uri": FILE, "languageId": "ncp", "version": 1, "text": text });
        self.tell("textDocument/didOpen", json!({ "textDocument": file }));
    }

    fn change(&mut self, version: i32, change: Value) {
        let file = json!({ "uri": FILE, "version": version });
        self.tell(
            "textDocument/didChange",
            json!({ "textDocument": file, "contentChanges": [change] }),
        );
    }

    fn write(&mut self, bytes: &[u8]) {
        let to = self.to.as_mut().unwrap();
        to.write_all(bytes).unwrap();
        to.flush().unwrap();
    }

    fn send(&mut self, message: &Value) {
        let text = message.to_string();
        self.write(format!("Content-Length: {}\r\n\r\n{text}", text.len()).as_bytes());
    }

    fn tell(&mut self, method: &str, params: Value) {
        self.send(&json!({ "jsonrpc": "2.0", "method": method, "params": params }));
    }

    fn hear(&self) -> Value {
        self.from.recv_timeout(PATIENCE).unwrap()
    }

    /// The answer to a request, or the code of its refusal.
    fn ask(&mut self, method: &str, params: Value) -> Result<Value, i64> {
        self.next_id += 1;
        let id = self.next_id;
        self.send(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params }));
        loop {
            let mut answer = self.hear();
            if answer["id"] == id {
                assert_eq!(answer["jsonrpc"], "2.0");
                let error = answer["error"]["code"].as_i64();
                return error.map_or_else(|| Ok(answer["result"].take()), Err);
            }
        }
    }

    /// The answer to a request about a place.
    fn ask_at(&mut self, method: &str, line: u32, character: u32) -> Result<Value, i64> {
        let place = json!({
            "textDocument": { "uri": FILE },
            "position": { "line": line, "character": character },
        });
        self.ask(&format!("textDocument/{method}"), place)
    }

    /// The problems of the file in the version, each as code, severity, and where it is.
    fn problems(&self, version: Option<i32>) -> Vec<(String, i64, [i64; 4])> {
        loop {
            let published = self.hear();
            if published["method"] != "textDocument/publishDiagnostics" {
                continue;
            }
            let params = &published["params"];
            if params["version"].as_i64() != version.map(i64::from) {
                continue;
            }
            assert_eq!(params["uri"], FILE);
            let problems = params["diagnostics"].as_array().unwrap();
            return problems.iter().map(summary).collect();
        }
    }

    /// How the server ends.
    fn end(mut self) -> ExitStatus {
        self.tell("exit", Value::Null);
        self.server.wait().unwrap()
    }
}

impl Drop for Editor {
    fn drop(&mut self) {
        // The server ends with its input, and if it does not, here.
        self.to = None;
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

fn summary(problem: &Value) -> (String, i64, [i64; 4]) {
    let place = |end: &str, what: &str| problem["range"][end][what].as_i64().unwrap();
    assert_eq!(problem["source"], "vimc4");
    assert!(!problem["message"].as_str().unwrap().is_empty());
    (
        problem["code"].as_str().unwrap_or_default().to_owned(),
        problem["severity"].as_i64().unwrap(),
        [
            place("start", "line"),
            place("start", "character"),
            place("end", "line"),
            place("end", "character"),
        ],
    )
}

/// The next message; `None` once the server is gone.
fn read(from: &mut impl BufRead) -> Option<Value> {
    let mut header = String::new();
    from.read_line(&mut header).unwrap();
    let length = header.strip_prefix("Content-Length: ")?.trim().parse().unwrap();
    from.read_line(&mut header).unwrap();
    assert!(header.ends_with("\r\n\r\n"));
    let mut body = Vec::new();
    from.take(length).read_to_end(&mut body).unwrap();
    Some(serde_json::from_slice(&body).unwrap())
}

fn problem(code: &str, severity: i64, place: [i64; 4]) -> (String, i64, [i64; 4]) {
    (code.to_owned(), severity, place)
}

#[test]
fn a_conversation_has_a_beginning_and_an_end() {
    let mut editor = Editor::silent("");
    assert_eq!(editor.ask_at("hover", 0, 0), Err(-32_002));
    assert_eq!(editor.ask("initialize", json!({ "capabilities": 5 })), Err(-32_602));
    let server = editor.ask("initialize", json!({ "capabilities": {} })).unwrap();
    assert_eq!(server["serverInfo"]["name"], "vimc4");
    let capabilities = &server["capabilities"];
    assert_eq!(capabilities["textDocumentSync"], 2);
    for what in ["hoverProvider", "documentSymbolProvider"] {
        assert_eq!(capabilities[what], true);
    }
    assert_eq!(capabilities["completionProvider"]["triggerCharacters"], json!([" "]));
    editor.tell("initialized", json!({}));
    assert_eq!(editor.ask("initialize", json!({ "capabilities": {} })), Err(-32_600));
    assert_eq!(editor.ask("shutdown", Value::Null), Ok(Value::Null));
    assert_eq!(editor.ask_at("hover", 0, 0), Err(-32_600));
    assert!(editor.end().success());
}

#[test]
fn an_end_without_shutdown_is_a_failure() {
    assert_eq!(Editor::new("").end().code(), Some(1));
    let mut editor = Editor::new("");
    editor.to = None;
    assert_eq!(editor.server.wait().unwrap().code(), Some(1));
}

#[test]
fn problems_follow_what_is_typed() {
    let mut editor = Editor::with("IMF_PBL\nREF XYZ\n; ä€𝄞\nN1 MOVABS X5\n");
    assert_eq!(editor.problems(Some(1)), [problem("unknown-command", 1, [3, 3, 3, 9])]);
    let at = |character| json!({ "line": 3, "character": character });
    // The name is mended, and its axis spoilt.
    editor.change(2, json!({ "range": { "start": at(6), "end": at(6) }, "text": "E" }));
    assert_eq!(editor.problems(Some(2)), []);
    editor.change(3, json!({ "range": { "start": at(11), "end": at(12) }, "text": "Q" }));
    let wrong = editor.problems(Some(3));
    assert_eq!(wrong[0], problem("unknown-word", 1, [3, 11, 3, 13]));
    editor.change(4, json!({ "text": "REF XYZ\r\nMOVEABS X1.2345\r\n" }));
    assert_eq!(
        editor.problems(Some(4)),
        [problem("mark-missing", 2, [0, 0, 0, 0]), problem("rounded", 2, [1, 9, 1, 15])]
    );
    editor.tell("textDocument/didClose", json!({ "textDocument": { "uri": FILE } }));
    assert_eq!(editor.problems(None), []);
    assert_eq!(editor.ask_at("hover", 0, 0), Err(-32_602), "the file is not open");
}

#[test]
fn problems_are_told_once() {
    let editor = Editor::with("HALT x");
    assert_eq!(editor.problems(Some(1))[0].0, "surplus-text");
    assert!(editor.from.recv_timeout(Duration::from_millis(300)).is_err());
}

#[test]
fn what_the_machine_cannot_do_is_told_too() {
    let job = "IMF_PBL\nREF XYZ\nMOVEABS B5\n";
    let editor = Editor::with(job);
    let told = editor.problems(Some(1));
    assert_eq!((told[0].0.as_str(), told[0].2[0]), ("no-such-axis", 2), "{told:?}");
}

#[test]
fn columns_are_those_of_utf_16() {
    let mut editor = Editor::with("IMF_PBL\nREF XYZ\nHALT 𝄞ä x\n");
    assert_eq!(editor.problems(Some(1)), [problem("surplus-text", 1, [2, 5, 2, 10])]);
    editor.change(2, json!({ "text": "IMF_PBL\nREF XYZ\rMOVEABS 𝄞 Q5" }));
    // A CR alone ends a line for editors and is a wrong axis here.
    assert_eq!(editor.problems(Some(2))[0], problem("unknown-axis", 1, [1, 7, 2, 0]));
}

#[test]
fn arguments_say_how_a_file_is_read() {
    let mut editor = Editor::new("--lenient");
    editor.open("IMF_PBL\n(Steps per circle: 64)\nREF XYZ\n");
    assert_eq!(editor.problems(Some(1)), [problem("no-command", 2, [1, 0, 1, 22])]);
}

#[test]
fn a_file_full_of_problems_shows_the_first_of_them() {
    let editor = Editor::with(&"(x)\n".repeat(1_500));
    let told = editor.problems(Some(1));
    assert_eq!(told.len(), 1_001);
    assert_eq!(told[1_000].1, 3, "how many more there are is no error");
}

#[test]
fn an_end_of_file_as_dos_has_it_is_no_problem() {
    let editor = Editor::with("IMF_PBL\nREF XYZ\n\u{1a}");
    assert_eq!(editor.problems(Some(1)), []);
}

#[test]
fn commands_and_words_are_explained() {
    let mut editor = Editor::with("; 𝄞\nN5 moveabs x5000 ; there\n");
    let hover = editor.ask_at("hover", 1, 4).unwrap();
    assert_eq!(hover["contents"]["kind"], "markdown");
    assert!(hover["contents"]["value"].as_str().unwrap().contains("MOVEABS [Xn]"));
    let end = |hover: &Value| hover["range"]["end"].clone();
    assert_eq!(end(&hover), json!({ "line": 1, "character": 10 }));
    let hover = editor.ask_at("hover", 1, 12).unwrap();
    assert!(hover["contents"]["value"].as_str().unwrap().ends_with("\n\n5 mm"));
    assert_eq!(end(&hover), json!({ "line": 1, "character": 16 }));
    assert_eq!(editor.ask_at("hover", 0, 2), Ok(Value::Null));
    assert_eq!(editor.ask_at("hover", 99, 99), Ok(Value::Null));
}

#[test]
fn commands_and_words_are_offered() {
    let mut editor = Editor::with("N5 mov\nDRILL X5 \n");
    let offers = editor.ask_at("completion", 0, 6).unwrap();
    let offers = offers.as_array().unwrap();
    let offer = offers.iter().find(|offer| offer["label"] == "MOVEABS").unwrap();
    assert_eq!(offer["insertTextFormat"], 2);
    assert_eq!(offer["textEdit"]["newText"], "MOVEABS ${1:X20000 Y15000 Z-5000}");
    assert_eq!(
        offer["textEdit"]["range"],
        json!({ "start": { "line": 0, "character": 3 }, "end": { "line": 0, "character": 6 } })
    );
    let offers = editor.ask_at("completion", 1, 9).unwrap();
    let labels: Vec<_> = offers.as_array().unwrap().iter().map(|offer| &offer["label"]).collect();
    assert_eq!(labels, ["Y"]);

    let mut plain = Editor::silent("");
    plain.ask("initialize", json!({ "capabilities": {} })).unwrap();
    plain.open("");
    let offers = plain.ask_at("completion", 0, 0).unwrap();
    for offer in offers.as_array().unwrap() {
        assert_eq!(offer["textEdit"]["newText"], offer["label"]);
        assert_eq!(offer.get("insertTextFormat"), None);
    }
}

#[test]
fn the_parts_of_a_job_are_listed() {
    let mut editor = Editor::with("; Outline\nMOVEABS X5\nMOVEABS X6\nGETTOOL 3\nDRILL X5\n");
    let file = json!({ "textDocument": { "uri": FILE } });
    let parts = editor.ask("textDocument/documentSymbol", file).unwrap();
    let names = |parts: &Value| {
        let parts = parts.as_array().unwrap().iter();
        parts.map(|part| part["name"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(names(&parts), ["Outline", "GETTOOL 3"]);
    assert_eq!(names(&parts[0]["children"]), ["cut, 2 moves"]);
    assert_eq!(names(&parts[1]["children"]), ["1 hole"]);
    assert_eq!(parts[0]["range"]["end"], json!({ "line": 2, "character": 10 }));
    assert_eq!(parts[0]["selectionRange"]["end"], json!({ "line": 0, "character": 9 }));
}

#[test]
fn nothing_bad_ends_it() {
    let mut editor = Editor::with("HALT");
    assert_eq!(editor.ask("textDocument/rename", json!({})), Err(-32_601));
    assert_eq!(editor.ask("$/unheard", json!({})), Err(-32_601));
    assert_eq!(editor.ask("textDocument/hover", json!({ "position": -1 })), Err(-32_602));
    assert_eq!(editor.ask("textDocument/completion", json!([1])), Err(-32_602));
    assert_eq!(editor.ask("textDocument/documentSymbol", Value::Null), Err(-32_602));
    let other = json!({ "textDocument": { "uri": "file:///other.ncp" } });
    assert_eq!(editor.ask("textDocument/documentSymbol", other), Err(-32_602));

    for method in ["textDocument/didOpen", "textDocument/didChange", "textDocument/didClose", "x"] {
        for params in [Value::Null, json!({}), json!({ "textDocument": 5 })] {
            editor.tell(method, params);
        }
    }
    editor.change(
        2,
        json!({ "range": { "start": { "line": 9, "character": 9 },
        "end": { "line": 0, "character": 2 } }, "text": "" }),
    );
    editor.send(&json!({ "jsonrpc": "2.0", "id": 900, "result": null }));
    for (bytes, code) in [
        ("Content-Length: 3\r\n\r\n{{{", -32_700),
        ("Content-Length: 2\r\n\r\n[]", -32_600),
        ("Content-Length: x\r\n\r\n", -32_700),
        ("gibberish\r\n\r\n", -32_700),
    ] {
        editor.write(bytes.as_bytes());
        loop {
            let answer = editor.hear();
            if answer["id"].is_null() && answer.get("error").is_some() {
                assert_eq!(answer["error"]["code"], code, "{bytes}");
                break;
            }
        }
    }
    assert!(editor.ask_at("hover", 0, 0).unwrap()["contents"].is_object());
    assert_eq!(editor.ask("shutdown", Value::Null), Ok(Value::Null));
    assert!(editor.end().success());
}
