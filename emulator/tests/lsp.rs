//! `vimc4 ncp lsp` as an editor talks to it.

#![expect(clippy::unwrap_used, reason = "a test that cannot talk to the server has failed")]

use std::io::Write;
use std::process::{Command, ExitStatus};
use std::sync::mpsc::Receiver;
use std::time::Duration;

use serde_json::{Value, json};

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{EndsInTime, InTime, LIMIT};
use process::{Process, VIMC4, framed};

/// The file that the tests talk about.
const FILE: &str = "file:///part.ncp";

/// An editor with its server.
struct Editor {
    server: Process,
    from: Receiver<Value>,
    next_id: i32,
}

impl Editor {
    /// An editor that has not said anything.
    fn silent(arguments: &str) -> Editor {
        let mut command = Command::new(VIMC4);
        command.args(["ncp", "lsp"]).args(arguments.split_whitespace());
        let mut server = Process::start(&mut command);
        let from = server.messages();
        Editor { server, from, next_id: 0 }
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
        let to = self.server.input.as_mut().unwrap();
        to.write_all(bytes).unwrap();
        to.flush().unwrap();
    }

    fn send(&mut self, message: &Value) {
        self.write(framed(message).as_bytes());
    }

    fn tell(&mut self, method: &str, params: Value) {
        self.send(&json!({ "jsonrpc": "2.0", "method": method, "params": params }));
    }

    fn hear(&self) -> Value {
        self.from.recv_timeout(LIMIT).unwrap()
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
        self.server.ended()
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
    // What is advertised is tested below, request by request.
    let mut advertised: Vec<_> = capabilities.as_object().unwrap().keys().collect();
    advertised.sort();
    assert_eq!(
        advertised,
        [
            "codeActionProvider",
            "completionProvider",
            "definitionProvider",
            "documentFormattingProvider",
            "documentSymbolProvider",
            "foldingRangeProvider",
            "hoverProvider",
            "inlayHintProvider",
            "referencesProvider",
            "semanticTokensProvider",
            "textDocumentSync",
        ]
    );
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
    editor.server.input = None;
    assert_eq!(editor.server.ended().code(), Some(1));
}

#[test]
fn problems_follow_what_is_typed() {
    let mut editor = Editor::with("IMF_PBL\nREF XYZ\n; ä€𝄞\nN1 MOVABS X5\nPROGEND\n");
    assert_eq!(editor.problems(Some(1)), [problem("unknown-command", 1, [3, 3, 3, 9])]);
    let at = |character| json!({ "line": 3, "character": character });
    // The name is mended, and its axis spoilt.
    editor.change(2, json!({ "range": { "start": at(6), "end": at(6) }, "text": "E" }));
    assert_eq!(editor.problems(Some(2)), []);
    editor.change(3, json!({ "range": { "start": at(11), "end": at(12) }, "text": "Q" }));
    let wrong = editor.problems(Some(3));
    assert_eq!(wrong[0], problem("unknown-word", 1, [3, 11, 3, 13]));
    editor.change(4, json!({ "text": "REF XYZ\r\nMOVEABS X1.2345\r\nPROGEND\r\n" }));
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
    let mut editor = Editor::with("IMF_PBL\nREF XYZ\nHALT 𝄞ä x\nPROGEND\n");
    assert_eq!(editor.problems(Some(1)), [problem("surplus-text", 1, [2, 5, 2, 10])]);
    editor.change(2, json!({ "text": "IMF_PBL\nREF XYZ\rMOVEABS 𝄞 Q5" }));
    // A CR alone ends a line for editors, and so it does here.
    assert_eq!(editor.problems(Some(2))[0], problem("unexpected-text", 1, [2, 8, 2, 10]));
}

#[test]
fn arguments_say_how_a_file_is_read() {
    let mut editor = Editor::new("--lenient");
    editor.open("IMF_PBL\n(Steps per circle: 64)\nREF XYZ\nPROGEND\n");
    assert_eq!(editor.problems(Some(1)), [problem("bracket-comment", 2, [1, 0, 1, 22])]);
}

#[test]
fn a_file_full_of_problems_shows_the_first_of_them() {
    let editor = Editor::with(&"(x)\n".repeat(1_500));
    let told = editor.problems(Some(1));
    assert_eq!(told.len(), 1_001);
    assert_eq!(told[1_000].1, 3, "how many more there are is not an error");
}

#[test]
fn an_end_of_file_as_dos_has_it_is_no_problem() {
    let editor = Editor::with("IMF_PBL\nREF XYZ\nPROGEND\n\u{1a}");
    assert_eq!(editor.problems(Some(1)), []);
}

#[test]
fn a_byte_order_mark_is_no_problem_and_shifts_nothing() {
    let editor = Editor::with("\u{feff}IMF_PBL\nREF XYZ\nPROGEND\n");
    assert_eq!(editor.problems(Some(1)), []);
    let mut editor = Editor::with("\u{feff}MOVABS X5\nPROGEND\n");
    let told = editor.problems(Some(1));
    assert!(told.contains(&problem("unknown-command", 1, [0, 1, 0, 7])), "{told:?}");
    let range =
        json!({ "start": { "line": 0, "character": 1 }, "end": { "line": 0, "character": 7 } });
    editor.change(2, json!({ "range": range, "text": "IMF_PBL\nREF X\nMOVEABS" }));
    assert_eq!(editor.problems(Some(2)), []);
}

#[test]
fn a_byte_order_mark_stays_before_all_that_is_mended() {
    let behind = json!({ "line": 0, "character": 1 });
    let empty = json!({ "start": behind, "end": behind });
    let mut editor = Editor::with("\u{feff}REF X\nPROGEND\n");
    assert_eq!(editor.problems(Some(1)), [problem("mark-missing", 2, [0, 1, 0, 1])]);
    let before = json!({ "line": 0, "character": 0 });
    for range in [json!({ "start": before, "end": before }), empty.clone()] {
        let told = json!({ "range": empty, "code": "mark-missing", "message": "" });
        let actions = editor.ask(
            "textDocument/codeAction",
            json!({
                "textDocument": { "uri": FILE }, "range": range, "context": { "diagnostics": [told] },
            }),
        );
        let action = &actions.unwrap()[0];
        assert_eq!(action["title"], "Mark the file as a job");
        assert_eq!(action["diagnostics"][0]["code"], "mark-missing");
        let edit = &action["edit"]["changes"][FILE][0];
        assert_eq!((&edit["range"], &edit["newText"]), (&empty, &json!("IMF_PBL_V1.0\n")));
    }
    let mut format = |version, text: &str| {
        editor.change(version, json!({ "text": text }));
        let options = json!({ "tabSize": 4, "insertSpaces": true });
        let asked = json!({ "textDocument": { "uri": FILE }, "options": options });
        editor.ask("textDocument/formatting", asked).unwrap()
    };
    assert_eq!(format(2, "\u{feff}IMF_PBL\nREF XYZ\n"), json!([]));
    let within = json!({ "start": behind, "end": { "line": 0, "character": 8 } });
    assert_eq!(format(3, "\u{feff} ref  x\n"), json!([{ "range": within, "newText": "REF X" }]));
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
    // The bench has a turning A, and no B.
    let words = editor.ask_at("hover", 1, 4).unwrap()["contents"]["value"].to_string();
    assert!(words.contains("`A`") && !words.contains("`B`"), "{words}");
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

/// The text of a file after edits, which are those of lines from the last to the first.
fn edited(text: &str, edits: &Value) -> String {
    let mut lines: Vec<String> = text.split('\n').map(str::to_owned).collect();
    for edit in edits.as_array().unwrap().iter().rev() {
        let at = |end: &str| {
            let place = &edit["range"][end];
            let number = |what: &str| place[what].as_u64().unwrap() as usize;
            (number("line"), number("character"))
        };
        let ((line, from), (last, to)) = (at("start"), at("end"));
        assert_eq!(line, last);
        lines[line].replace_range(from..to, edit["newText"].as_str().unwrap());
    }
    lines.join("\n")
}

#[test]
fn problems_are_mended() {
    let text = "IMF_PBL\nN5 movabs X5 ; x\n(Steps: 64)\nREF X\nPROGEND\n";
    let mut editor = Editor::with(text);
    let published = editor.hear();
    let told = published["params"]["diagnostics"].clone();
    assert_eq!(told.as_array().unwrap().len(), 2);
    let mut ask = |line: u32, told: &Value, only: Value| {
        let place = json!({ "line": line, "character": 4 });
        let mut context = json!({ "diagnostics": told });
        if !only.is_null() {
            context["only"] = only;
        }
        let params = json!({
            "textDocument": { "uri": FILE },
            "range": { "start": place, "end": place },
            "context": context,
        });
        editor.ask("textDocument/codeAction", params).unwrap()
    };
    let actions = ask(1, &told, Value::Null);
    assert_eq!(actions.as_array().unwrap().len(), 1);
    let action = &actions[0];
    assert_eq!((&action["title"], &action["kind"]), (&json!("Write MOVEABS"), &json!("quickfix")));
    assert_eq!(action["isPreferred"], true);
    assert_eq!(action["diagnostics"], json!([told[0]]));
    let after = edited(text, &action["edit"]["changes"][FILE]);
    assert_eq!(after, "IMF_PBL\nN5 MOVEABS X5 ; x\n(Steps: 64)\nREF X\nPROGEND\n");
    let actions = ask(2, &json!([]), json!(["quickfix"]));
    assert_eq!(
        edited(text, &actions[0]["edit"]["changes"][FILE]).lines().nth(2),
        Some("; (Steps: 64)")
    );
    assert_eq!(ask(3, &told, Value::Null), json!([]));
    assert_eq!(ask(1, &told, json!(["refactor"])), json!([]));
}

#[test]
fn a_file_is_formatted() {
    let text = "imf_pbl\n  n5  moveabs x5y6 ;  there\nREF X\nqqq   x\n";
    let mut editor = Editor::with(text);
    let params = json!({
        "textDocument": { "uri": FILE },
        "options": { "tabSize": 4, "insertSpaces": true },
    });
    let edits = editor.ask("textDocument/formatting", params).unwrap();
    assert_eq!(edits.as_array().unwrap().len(), 2, "only what changes is sent");
    let after = edited(text, &edits);
    assert_eq!(after, "IMF_PBL\nN5 MOVEABS X5 Y6 ;  there\nREF X\nqqq   x\n");
}

#[test]
fn registers_and_tools_are_found() {
    let mut editor = Editor::with("WPREG2 X5\nWPREG1 X5\nWPREG1ACT\nTOOLDEF T3 L5\nGETTOOL 3\n");
    let lines = |places: &Value| {
        let places = places.as_array().unwrap().iter();
        places
            .inspect(|place| assert_eq!(place["uri"], FILE))
            .map(|place| place["range"]["start"]["line"].as_u64().unwrap())
            .collect::<Vec<_>>()
    };
    assert_eq!(lines(&editor.ask_at("definition", 2, 3).unwrap()), [1]);
    assert_eq!(lines(&editor.ask_at("definition", 4, 8).unwrap()), [3]);
    assert_eq!(lines(&editor.ask_at("definition", 0, 9).unwrap()), <[u64; 0]>::default());
    let mut references = |line: u32, with: bool| {
        let params = json!({
            "textDocument": { "uri": FILE },
            "position": { "line": line, "character": 2 },
            "context": { "includeDeclaration": with },
        });
        lines(&editor.ask("textDocument/references", params).unwrap())
    };
    assert_eq!(references(1, true), [1, 2]);
    assert_eq!(references(1, false), [2]);
    assert_eq!(references(3, true), [3, 4]);
}

#[test]
fn parts_are_folded() {
    let mut editor = Editor::with("; a part\n; of brass\nMOVEABS X5\nMOVEABS X6\nREF X\n");
    let file = json!({ "textDocument": { "uri": FILE } });
    let folds = editor.ask("textDocument/foldingRange", file).unwrap();
    let shown: Vec<_> = folds
        .as_array()
        .unwrap()
        .iter()
        .map(|fold| {
            (fold["startLine"].as_u64().unwrap(), fold["endLine"].as_u64().unwrap(), &fold["kind"])
        })
        .collect();
    assert_eq!(
        shown,
        [(0, 1, &json!("comment")), (0, 3, &json!("region")), (2, 3, &json!("region"))]
    );
}

#[test]
fn pieces_are_coloured() {
    let mut editor = Editor::silent("");
    let server = editor.ask("initialize", json!({ "capabilities": {} })).unwrap();
    let legend = server["capabilities"]["semanticTokensProvider"]["legend"]["tokenTypes"].clone();
    editor.open("; 𝄞 x\nN5 MOVEABS X5 ; y\nHALT\n");
    let file = json!({ "uri": FILE });
    // Each token counts from the one before; what they are is in the legend.
    let shown = |tokens: &Value| {
        let numbers: Vec<u64> =
            tokens["data"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).collect();
        let token = |token: &[u64]| {
            let kind = legend[token[3] as usize].as_str().unwrap();
            format!("{} {} {} {kind}", token[0], token[1], token[2])
        };
        numbers.chunks(5).map(token).collect::<Vec<_>>()
    };
    let full =
        editor.ask("textDocument/semanticTokens/full", json!({ "textDocument": file })).unwrap();
    assert_eq!(
        shown(&full),
        [
            "0 0 6 comment",
            "1 0 2 decorator",
            "0 3 7 keyword",
            "0 8 1 parameter",
            "0 1 1 number",
            "0 2 3 comment",
            "1 0 4 keyword",
        ]
    );
    let place = json!({ "line": 2, "character": 1 });
    let range = json!({ "start": place, "end": place });
    let params = json!({ "textDocument": file, "range": range });
    let part = editor.ask("textDocument/semanticTokens/range", params).unwrap();
    assert_eq!(shown(&part), ["2 0 4 keyword"]);
}

#[test]
fn lengths_are_shown_in_mm() {
    let mut editor = Editor::with("VEL 8000\nMOVEABS X2500 Y0 A5400 ; 𝄞\nWAIT 500\n");
    let params = json!({
        "textDocument": { "uri": FILE },
        "range": {
            "start": { "line": 0, "character": 0 }, "end": { "line": 3, "character": 0 },
        },
    });
    let hints = editor.ask("textDocument/inlayHint", params).unwrap();
    let shown: Vec<_> = hints
        .as_array()
        .unwrap()
        .iter()
        .map(|hint| {
            let place = &hint["position"];
            format!("{}:{} {}", place["line"], place["character"], hint["label"].as_str().unwrap())
        })
        .collect();
    assert_eq!(shown, ["0:8 8 mm/s", "1:13 2.5 mm", "1:22 1.5°"]);
}

/// The server's input stays open here, as it does where something else has inherited it.
#[test]
#[cfg(target_os = "linux")]
fn it_leaves_when_its_parent_is_killed() {
    let mut parent = Command::new("sleep").arg("600").start().unwrap();
    let mut editor = Editor::silent("");
    let begin = json!({ "processId": parent.id(), "capabilities": {} });
    editor.ask("initialize", begin).unwrap();
    editor.open("HALT");
    assert!(editor.ask_at("hover", 0, 0).unwrap()["contents"].is_object());
    parent.kill().unwrap();
    parent.wait_in_time().unwrap();
    assert_eq!(editor.server.ended().code(), Some(1));

    // One that is gone already is noticed too.
    let mut editor = Editor::silent("");
    let begin = json!({ "processId": parent.id(), "capabilities": {} });
    editor.send(&json!({ "jsonrpc": "2.0", "id": 1, "method": "initialize", "params": begin }));
    assert_eq!(editor.server.ended().code(), Some(1));
}

#[test]
fn it_leaves_with_its_input() {
    let mut editor = Editor::new("");
    editor.server.input = None;
    assert_eq!(editor.server.ended().code(), Some(1));
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
    assert_eq!(editor.ask("textDocument/documentSymbol", other.clone()), Err(-32_602));
    for method in [
        "codeAction",
        "formatting",
        "definition",
        "references",
        "foldingRange",
        "inlayHint",
        "semanticTokens/full",
        "semanticTokens/range",
    ] {
        let method = format!("textDocument/{method}");
        assert_eq!(editor.ask(&method, json!([5])), Err(-32_602), "{method}");
        assert_eq!(editor.ask(&method, other.clone()), Err(-32_602), "{method}");
    }

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
