//! The page `docs/api.md` says what is so: its recipes run against the program, and answer as shown.
//!
//! What needs a tool that is missing is shown as ignored, with the reason in its name. With
//! `VIMC4_REQUIRE_TOOLS=1` it fails instead, so that nothing is left out unnoticed.

#![expect(clippy::cognitive_complexity, clippy::too_many_lines, reason = "one test is one story")]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, ExitCode, Output};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use libtest_mimic::{Arguments, Failed, Trial};
use serde_json::{Value, json};

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{InTime, until};
use process::{Process, connect, run, tcp};

const PAGE: &str = include_str!("../../docs/api.md");

/// Where the page says that it listens.
const THERE: &str = "127.0.0.1:8080";

/// What Node.js 20 needs for what browsers and later ones have.
const WEBSOCKET: &str = "--experimental-websocket";

type Outcome = Result<(), Failed>;

/// The lines of the page's blocks in this language.
fn block(language: &str) -> Vec<&'static str> {
    let fence = format!("```{language}");
    let mut inside = false;
    PAGE.lines()
        .filter(|line| {
            let was = inside;
            inside = if inside { *line != "```" } else { *line == fence };
            was && inside
        })
        .collect()
}

/// A controller as on the page, and where it really listens.
fn serve(folder: &std::path::Path, arguments: &[&str]) -> (Process, Value, String) {
    let time: &[&str] = if arguments.contains(&"--time") { &[] } else { &["--time", "manual"] };
    let arguments: Vec<&str> = time.iter().chain(arguments).copied().collect();
    let given = ["--machine", "mill", "--pty", "none"];
    let given: Vec<&str> = given.into_iter().chain(arguments).collect();
    let (serve, ready) = Process::serve(folder, &given);
    let url = ready["http"].as_str().unwrap_or_default();
    let address = url.trim_start_matches("http://").trim_end_matches('/').to_owned();
    (serve, ready, address)
}

fn shell(command: &str) -> Output {
    Command::new("sh").args(["-c", command]).output_in_time().unwrap()
}

fn has(command: &str) -> bool {
    shell(command).status.success()
}

/// What a program printed, if it ended well.
fn printed(output: &Output) -> Result<String, Failed> {
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        false => Err(format!("{output:?}").into()),
    }
}

fn curl_answers_as_shown() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, _, address) = serve(folder.path(), &["--web"]);
    let mut lines = block("console").into_iter().peekable();
    let mut count = 0;
    while let Some(command) = lines.next().and_then(|line| line.strip_prefix("$ ")) {
        let mut shown = String::new();
        while let Some(line) = lines.next_if(|line| !line.starts_with("$ ")) {
            shown.push_str(line);
        }
        let answer = printed(&shell(&command.replace(THERE, &address)))?;
        if answer != shown {
            return Err(format!("{command}\nanswers {answer}\nand not {shown}").into());
        }
        count += 1;
    }
    assert!(count >= 6, "only {count} command lines");
    Ok(())
}

fn the_python_recipe_runs() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, _, address) = serve(folder.path(), &["--http", "127.0.0.1:0"]);
    let code = block("python").join("\n").replace(THERE, &address);
    assert!(code.contains("assert"));
    printed(&Command::new("python3").args(["-c", &code]).output_in_time()?).map(drop)
}

fn the_javascript_recipe_runs() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, ready, address) = serve(folder.path(), &["--web"]);
    process::ask(&mut connect(process::tcp(&ready, 0)), "@07\r", 1);
    let code = block("js").join("\n").replace(THERE, &address);
    let text = printed(&Command::new("node").args([WEBSOCKET, "-e", &code]).output_in_time()?)?;
    assert_eq!(text, "@07  set axes X+Y+Z\n0  at once\n");
    Ok(())
}

/// The line for people, the end that is ordered there, and what is refused before anything starts.
fn it_listens_where_it_says() -> Outcome {
    let folder = tempfile::tempdir()?;
    let folder = folder.path();
    let (mut serve, _, address) = serve(folder, &["--web"]);
    let mut client = connect(&address);
    let quit = format!("POST /v1/quit HTTP/1.1\r\nHost: {address}\r\n\r\n");
    assert_eq!(process::ask(&mut client, &quit, 15), "HTTP/1.1 200 OK");
    assert_eq!(serve.end().0, Some(0));

    std::fs::write(folder.join("token.txt"), "0123456789abcdef\n")?;
    std::fs::write(folder.join("short.txt"), "secret\n")?;
    let open = ["serve", "--pty", "none", "--tcp", "none", "--http"];
    let with = |more: &[&'static str]| {
        let arguments: Vec<&str> = open.iter().chain(more).copied().collect();
        run(folder, &arguments)
    };
    let (code, _, said) = with(&["0.0.0.0:0"]);
    assert!(code == 2 && said.contains("VIMC4_HTTP_TOKEN"), "{code} {said}");
    let (code, _, said) = with(&["0.0.0.0:0", "--http-token", "short.txt"]);
    assert!(code == 2 && said.contains("at least 16"), "{code} {said}");
    let (code, _, said) = with(&["0.0.0.0:0", "--http-token", "none.txt"]);
    assert!(code == 2 && said.contains("none.txt"), "{code} {said}");
    let (code, _, said) = with(&["nowhere", "--http-token", "token.txt"]);
    assert!(code == 2 && said.contains("nowhere"), "{code} {said}");
    let (code, said, _) = run(folder, &["serve", "--help"]);
    assert!(code == 0 && said.contains("--web"), "{said}");
    let (mut open, ready) = Process::serve(
        folder,
        &["--pty", "none", "--http", "0.0.0.0:0", "--http-token", "token.txt"],
    );
    assert!(ready["http"].as_str().is_some_and(|url| url.starts_with("http://0.0.0.0:")));
    open.give("quit\n");
    assert_eq!(open.end().0, Some(0));
    Ok(())
}

/// What a request is answered with: its status, and the JSON.
fn request(address: &str, method: &str, path: &str, body: &Value) -> (u16, Value) {
    let mut client = connect(address);
    let body = if body.is_null() { String::new() } else { body.to_string() };
    write!(
        client,
        "{method} /v1/controllers/1{path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\
         Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    )
    .unwrap();
    let mut answer = String::new();
    client.read_to_string(&mut answer).unwrap();
    let (head, body) = answer.split_once("\r\n\r\n").unwrap();
    let status = head.split(' ').nth(1).unwrap().parse().unwrap();
    (status, serde_json::from_str(body).unwrap())
}

/// The debugger goes forward with the controller and back without it, and lets it go when it is closed.
fn the_debugger_goes_forward_and_back() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, _, address) = serve(folder.path(), &["--time", "100x", "--web"]);
    let debug = |line: &str| {
        let (status, said) = request(&address, "POST", "/debugger", &json!({ "line": line }));
        (status, said["text"].as_str().unwrap_or_default().to_owned())
    };
    let x = |path: &str| request(&address, "GET", path, &Value::Null).1;
    assert_eq!(request(&address, "DELETE", "/debugger", &Value::Null).1["effect"], "nothing");
    assert!(debug("where").1.contains("idle"));
    assert_eq!(x("/clock")["paused"]["by"], "the API");
    for line in ["send @01", "send @0A5000,900", "step command", "step command", "continue 1s"] {
        assert_eq!(debug(line).0, 200, "{line}");
    }
    // A second at 900 Hz; the first steps are slower.
    assert_eq!(x("/position")["axes"]["X"], 898);
    assert!(debug("back command").1.contains("#2 @0A5000,900"));
    assert_eq!(x("/debugger/view")["axes"][0]["position"], 0);
    assert_eq!(x("/position")["axes"]["X"], 898);
    assert!(debug("what if press stop").1.contains("says  F"));
    assert_eq!((debug("nonsense").0, debug("screen").0), (422, 422));
    // Whoever tells it to end has ended it.
    assert_eq!(debug("quit"), (200, String::new()));
    assert_eq!(x("/history")["open"], false);
    assert_eq!(request(&address, "DELETE", "/debugger", &Value::Null).1["effect"], "nothing");
    assert_eq!(debug("where").0, 200);
    assert_eq!(request(&address, "DELETE", "/debugger", &Value::Null).1["effect"], "something");
    assert_eq!(x("/clock")["paused"], Value::Null);
    let idle = json!({ "condition": "idle" });
    assert_eq!(request(&address, "POST", "/clock/run-until", &idle).0, 200);
    assert_eq!(x("/position")["axes"]["X"], 5_000);
    // Who looks at the past meanwhile makes no line be refused.
    assert_eq!(debug("where").0, 200);
    let is_over = AtomicBool::new(false);
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while !is_over.load(Ordering::Relaxed) {
                    request(&address, "GET", "/history", &Value::Null);
                }
            });
        }
        let lines: Vec<_> = (0..300).map(|_| debug("where").0).collect();
        is_over.store(true, Ordering::Relaxed);
        assert_eq!(lines, [200; 300]);
    });
    // What runs without an end is ended by whoever closes it.
    assert_eq!(debug("where").0, 200);
    thread::scope(|scope| {
        let runs = scope.spawn(|| debug("continue"));
        until("it runs", || x("/clock")["paused"] == Value::Null);
        assert_eq!(debug("where").0, 409);
        assert_eq!(request(&address, "DELETE", "/debugger", &Value::Null).0, 200);
        assert!(runs.join().is_ok());
    });
    assert_eq!(x("/clock")["paused"], Value::Null);

    // Somebody else has let time go on meanwhile: what a host sends afterwards arrives as it was sent.
    debug("send @0P");
    assert_eq!(request(&address, "POST", "/clock/resume", &Value::Null).0, 200);
    for line in ["nonsense", "step command", "step command", ""] {
        debug(line);
    }
    assert_eq!(request(&address, "DELETE", "/debugger", &Value::Null).0, 200);
    let last = x("/journal")["last"].clone();
    request(&address, "POST", "/line", &json!({ "send": "@0P\r" }));
    assert_eq!(request(&address, "POST", "/clock/run-until", &idle).0, 200);
    let said = x(&format!("/journal?after={last}&kinds=command,answer"))["entries"].clone();
    assert_eq!(
        (&said[0]["bytes"], &said[1]["bytes"]),
        (&json!("@0P"), &json!("0001388000000000000"))
    );

    let (_serve, _, address) = serve(folder.path(), &["--time", "manual", "--web"]);
    let refused = request(&address, "POST", "/debugger", &json!({ "line": "where" }));
    assert_eq!(refused.0, 409);
    assert!(refused.1["remedy"].as_str().is_some_and(|remedy| remedy.contains("--time manual")));
    Ok(())
}

/// What is on its way on a line that takes its time is debugged along.
fn a_line_that_takes_its_time_is_debugged() -> Outcome {
    let folder = tempfile::tempdir()?;
    for option in ["--line-pacing", "--line-physics"] {
        let (_serve, _, address) = serve(folder.path(), &["--time", "100x", "--web", option]);
        let ask = |method: &str, path: &str, body: Value| request(&address, method, path, &body);
        let debug = |line: &str| {
            let (status, said) = ask("POST", "/debugger", json!({ "line": line }));
            assert_eq!(status, 200, "{option}, {line}: {said}");
            said["text"].as_str().unwrap_or_default().to_owned()
        };
        ask("POST", "/line", json!({ "send": "@01\r@0A5000,900\r" }));
        assert_eq!(ask("POST", "/clock/run-until", json!({ "condition": "x > 1000" })).0, 200);
        // Before it was opened: the move began when the last of its characters had come.
        assert!(debug("back command").contains("#2 @0A5000,900"));
        debug("assert x = 0");
        // Its characters came one after the other.
        for _ in 0..3 {
            let before = ask("GET", "/history", Value::Null).1["at"].as_u64();
            debug("back byte");
            assert!(ask("GET", "/history", Value::Null).1["at"].as_u64() <= before);
        }
        // The controller itself stays, and goes on when nobody looks any more.
        assert_eq!(ask("DELETE", "/debugger", Value::Null).0, 200);
        assert_eq!(ask("POST", "/clock/run-until", json!({ "condition": "idle" })).0, 200);
        assert_eq!(ask("GET", "/position", Value::Null).1["axes"]["X"], 5_000);
    }
    Ok(())
}

/// A command that has not begun yet is no moment of the past: nobody is led there, and what will come of rules
/// that never end is not worked out.
fn a_command_that_has_not_begun_is_not_looked_at() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, _, address) = serve(folder.path(), &["--time", "real", "--web"]);
    let ask = |method: &str, path: &str, body: Value| request(&address, method, path, &body);
    ask("POST", "/clock/pause", Value::Null);
    ask("POST", "/rules", json!({ "rules": "every 1s: input 0.2 1 for 100ms" }));
    ask("POST", "/line", json!({ "send": "@01\r@0A8000,900\r@0P\r" }));
    let stepped = ask("POST", "/debugger", json!({ "line": "continue 500ms" }));
    assert_eq!(stepped.0, 200, "{}", stepped.1);
    let before = ask("GET", "/history", Value::Null).1;
    for number in [3, 99] {
        let (status, refused) = ask("POST", "/history/go", json!({ "command": number }));
        let detail = refused["detail"].as_str().unwrap_or_default();
        assert_eq!(status, 404, "{detail}");
        assert!(
            detail.contains(&format!("no command with the number {number} has begun here")),
            "{detail}"
        );
    }
    assert_eq!(ask("GET", "/history", Value::Null).1, before);
    assert_eq!(ask("POST", "/history/go", json!({ "command": 2 })).0, 200);
    assert_eq!(ask("GET", "/clock", Value::Null).1["now"], before["now"]["at"]);
    let huge = ask("POST", "/history/go", json!({ "command": u64::MAX })).1;
    assert_eq!(
        huge["detail"],
        "`command` is 18446744073709551615, and is to be at most 9223372036854775807"
    );
    for (named, detail) in [
        ("command", "a command is looked for on the branch that is looked at"),
        ("entry", "an entry is looked for where it happened"),
    ] {
        let (status, refused) = ask("POST", "/history/go", json!({ "branch": 0, named: 1 }));
        assert_eq!((status, &refused["detail"]), (400, &json!(detail)));
        // To look at the branch would change nothing: it is looked at.
        let remedy = refused["remedy"].as_str().unwrap_or_default();
        assert!(remedy.starts_with("leave out the branch"), "{remedy}");
        assert_eq!(ask("POST", "/history/go", json!({ named: 1 })).0, 200);
    }
    let (status, unknown) = ask("POST", "/history/go", json!({ "entry": 9_999 }));
    assert_eq!((status, &unknown["detail"]), (404, &json!("there is no entry 9999")));
    Ok(())
}

/// What was done before anybody asked can be looked at, branches and is taken over.
fn the_past_is_looked_at_branches_and_is_taken_over() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, _, address) = serve(folder.path(), &["--time", "100x", "--web"]);
    let ask = |method: &str, path: &str, body: Value| request(&address, method, path, &body);
    let get = |path: &str| ask("GET", path, Value::Null).1;
    let x = |history: &Value| history["view"]["axes"][0]["position"].clone();
    ask("POST", "/line", json!({ "send": "@01\r@0A5000,900\r" }));
    assert_eq!(ask("POST", "/clock/run-until", json!({ "condition": "x > 1000" })).0, 200);
    assert_eq!(ask("POST", "/orders", json!({ "order": "press stop" })).0, 200);
    assert_eq!(ask("POST", "/clock/run-until", json!({ "condition": "idle" })).0, 200);
    let stopped = get("/position")["axes"]["X"].clone();

    // To ask pauses nothing.
    let idle = get("/history");
    assert_eq!((&idle["open"], &idle["possible"]), (&json!(false), &json!(true)));
    assert!(idle["first"].as_u64() <= get("/journal")["entries"][0]["at"].as_u64());
    assert_eq!(ask("GET", "/debugger/view", Value::Null).0, 200);
    assert_eq!(ask("GET", "/history/entries", Value::Null).0, 409);
    assert_eq!(get("/clock")["paused"], Value::Null);

    // A second after the motion began, long before the debugger was opened.
    let entries = get("/journal")["entries"].clone();
    let entry = |kind: &str| {
        entries.as_array().unwrap().iter().find(|entry| entry["kind"] == kind).cloned()
    };
    let begin = entry("motion").ok_or("no motion")?;
    let at = begin["at"].as_u64().ok_or("no time")? + 1_000_000_000;
    let (status, there) = ask("POST", "/history/go", json!({ "at": at }));
    assert_eq!((status, &there["at"], &there["open"]), (200, &json!(at), &json!(true)));
    // A second at 900 Hz; the first steps are slower.
    assert_eq!(x(&there), 898);
    assert_eq!(get("/position")["axes"]["X"], stopped);
    assert_eq!(get("/clock")["paused"]["by"], "the API");
    assert_eq!(there["branches"].as_array().map(Vec::len), Some(1));

    // The emergency stop there: another future, worked out to its end.
    let (status, other) = ask("POST", "/history/do", json!({ "order": "hold estop" }));
    assert_eq!((status, &other["branch"], &other["at"]), (200, &json!(1), &json!(at)));
    let branch = &other["branches"][1];
    assert_eq!(
        (&branch["parted"], &branch["why"]),
        (&json!({ "branch": 0, "at": at }), &json!("estop pressed"))
    );
    let own = get("/history/entries?branch=1")["entries"].clone();
    let own = own.as_array().ok_or("no entries")?;
    assert!(own.iter().any(|entry| entry["signal"] == "estop"), "{own:?}");
    // The motion that it cut off began before; where it began is known.
    let ends = own.iter().find(|entry| entry["motion"] == "ends").ok_or("no end")?;
    assert_eq!((&ends["from"][0], &ends["to"][0]), (&json!(0), &json!(898)));
    assert!(own.iter().all(|entry| entry["at"].as_u64() >= Some(at)), "{own:?}");
    let trunk = get("/history/entries?branch=0")["entries"].clone();
    let said = |entries: &Value| -> Vec<Value> {
        let entries = entries.as_array().into_iter().flatten();
        entries
            .filter(|entry| entry["kind"] == "answer")
            .map(|entry| entry["bytes"].clone())
            .collect()
    };
    assert_eq!(said(&trunk), ["0", "F"]);
    assert_eq!(said(&entries), said(&trunk));

    // Bytes branch as well; what is no deed, and what is not there, does not.
    assert_eq!(ask("POST", "/history/go", json!({ "branch": 0, "at": at })).1["branch"], 0);
    let (_, third) = ask("POST", "/history/do", json!({ "send": "@0P\r" }));
    assert_eq!(third["branches"][2]["why"], "@0P  read position");
    for (wrong, status) in [
        (json!({ "order": "run until x > 1" }), 422),
        (json!({ "order": "quit" }), 422),
        (json!({ "order": "press nonsense" }), 422),
        (json!({ "order": "" }), 422),
        (json!({ "send": "" }), 422),
        (json!({ "order": "press stop", "send": "x" }), 400),
        (json!({}), 400),
    ] {
        assert_eq!(ask("POST", "/history/do", wrong.clone()).0, status, "{wrong}");
    }
    assert_eq!(ask("POST", "/history/go", json!({ "branch": 7 })).0, 404);
    assert_eq!(ask("GET", "/history/entries?branch=7", Value::Null).0, 404);
    for wrong in [json!({ "at": -1 }), json!({ "entry": -1 }), json!({ "branch": -1 })] {
        assert_eq!(ask("POST", "/history/go", wrong.clone()).0, 400, "{wrong}");
    }
    let late = ask("POST", "/history/go", json!({ "branch": 0, "at": 99_999_999_999_999_u64 }));
    assert!(late.0 == 422 && late.1["detail"].as_str().is_some_and(|it| it.contains("ends at")));
    let first = get("/history")["first"].as_u64().ok_or("no beginning")?;
    let early = ask("POST", "/history/go", json!({ "branch": 0, "at": first - 1 }));
    assert!(
        early.0 == 422 && early.1["detail"].as_str().is_some_and(|it| it.contains("begins at"))
    );
    assert_eq!(ask("POST", "/history/go", json!({ "at": 1, "command": 1 })).0, 400);

    // By an entry, by a command, and back.
    let motion = ask("POST", "/history/go", json!({ "branch": 0, "at": at })).1;
    assert_eq!(motion["branch"], 0);
    let by_entry = ask("POST", "/history/go", json!({ "entry": begin["number"] })).1;
    assert_eq!((&by_entry["at"], x(&by_entry)), (&begin["at"], json!(0)));
    assert_eq!(ask("POST", "/history/go", json!({ "command": 2 })).1["at"], begin["at"]);
    let back = ask("POST", "/history/go", json!({})).1;
    assert_eq!(
        (&back["branch"], &back["at"], x(&back)),
        (&back["now"]["branch"], &back["now"]["at"], stopped.clone())
    );

    // Somebody does something to the controller meanwhile: it is a part of the past as well.
    assert_eq!(ask("POST", "/orders", json!({ "order": "cover open" })).0, 200);
    let open = get("/history");
    assert_eq!(open["now"]["branch"], 0);
    let there = get("/history/entries?branch=0")["entries"].clone();
    let is_cover = |entry: &Value| entry["signal"] == "cover";
    assert!(there.as_array().unwrap().iter().any(is_cover), "{there}");

    // Taken over: the controller goes on from the branch.
    assert_eq!(ask("POST", "/history/go", json!({ "branch": 1, "at": at })).0, 200);
    let taken = ask("POST", "/history/take", Value::Null).1;
    assert_eq!((&taken["now"]["branch"], &taken["now"]["at"]), (&json!(1), &json!(at)));
    // Its counters are cleared by the emergency stop, its carriage has stayed there.
    let carriage = |view: &Value| view["axes"][0]["carriage"].clone();
    assert_eq!(carriage(&get("/view")), carriage(&taken["view"]));
    assert_ne!(carriage(&taken["view"]), carriage(&back["view"]));
    assert_eq!(ask("DELETE", "/debugger", Value::Null).1["effect"], "something");
    assert_eq!(get("/clock")["paused"], Value::Null);
    assert!(
        get("/signals")
            .as_array()
            .unwrap()
            .iter()
            .any(|it| it["name"] == "estop" && it["value"] == 1)
    );

    // An entry is shown where it happened, whatever is looked at: the motion came to its end before that.
    let ends = entries.as_array().unwrap().iter().find(|entry| entry["motion"] == "ends");
    let ends = ends.ok_or("no end")?;
    let there = ask("POST", "/history/go", json!({ "entry": ends["number"] })).1;
    assert_eq!((&there["branch"], &there["at"], x(&there)), (&json!(0), &ends["at"], stopped));
    ask("POST", "/history/go", json!({}));
    // What led to both branches is shown on the one that is looked at.
    let there = ask("POST", "/history/go", json!({ "entry": begin["number"] })).1;
    assert_eq!((&there["branch"], &there["at"]), (&json!(1), &begin["at"]));
    // So is what others did, which the controller itself does not tell.
    let journal = get("/journal")["entries"].clone();
    let news = |text: &str| {
        let found = journal.as_array().into_iter().flatten().find(|entry| entry["text"] == text);
        found.ok_or_else(|| format!("no {text}: {journal}"))
    };
    for (text, branch) in
        [("the API: press stop", 0), ("the API: restore", 0), ("the API: time goes on", 1)]
    {
        let news = news(text)?;
        let there = ask("POST", "/history/go", json!({ "entry": news["number"] })).1;
        assert_eq!((&there["branch"], &there["at"]), (&json!(branch), &news["at"]), "{text}");
    }

    // That was a turn of the past, which stays a branch of it.
    let again = ask("POST", "/history/go", json!({ "branch": 0, "at": at })).1;
    assert_eq!((x(&again), &again["now"]["branch"]), (json!(898), &json!(1)));
    // It is known where it left, and why.
    for of in ["parted", "first", "why"] {
        assert_eq!(again["branches"][1][of], taken["branches"][1][of], "{of}");
    }
    // Nor does it go on: what is done at its end begins a branch, too.
    let there = ask("POST", "/history/go", json!({ "branch": 0 })).1;
    let done = ask("POST", "/history/do", json!({ "send": "@0P\r" })).1;
    assert_eq!(done["branches"][0]["end"], there["branches"][0]["end"]);
    assert_eq!(done["branches"][2]["parted"]["branch"], 0);
    Ok(())
}

/// A host gets what the controller says on a branch when that is taken, and nothing twice.
fn a_host_gets_what_it_has_not_had() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, ready, address) = serve(folder.path(), &["--time", "real", "--web"]);
    let ask = |path: &str, body: Value| {
        let (status, said) = request(&address, "POST", path, &body);
        assert_eq!(status, 200, "{path} {body}: {said}");
        said
    };
    let mut host = connect(process::tcp(&ready, 0));
    assert_eq!(process::ask(&mut host, "@01\r", 1), "0");
    host.write_all(b"@0A9000,900\r")?;
    ask("/clock/run-until", json!({ "condition": "x > 400" }));
    let now = ask("/history/go", json!({}))["at"].as_u64().ok_or("no time")?;
    let before = |ms: u64| json!({ "branch": 0, "at": now - ms * 1_000_000 });
    let mut got = |text: &str| {
        let mut bytes = vec![0; text.len()];
        host.set_read_timeout(Some(Duration::from_secs(10)))?;
        host.read_exact(&mut bytes)?;
        assert_eq!(String::from_utf8_lossy(&bytes), text);
        host.set_read_timeout(Some(Duration::from_millis(200)))?;
        assert!(host.read(&mut [0]).is_err(), "there is more than {text}");
        Ok::<(), Failed>(())
    };
    ask("/history/go", before(300));
    ask("/history/do", json!({ "order": "hold estop" }));
    got("")?;
    ask("/history/take", Value::Null);
    got("9")?;
    // The host has had what happened up to here.
    ask("/history/go", before(200));
    ask("/history/take", Value::Null);
    got("")?;
    // To the end of another future, which comes while the motion brakes.
    ask("/history/go", before(250));
    let other = ask("/history/do", json!({ "order": "press stop" }));
    ask("/history/go", json!({ "branch": other["branch"] }));
    ask("/history/take", Value::Null);
    got("F")?;
    assert_eq!(request(&address, "DELETE", "/debugger", &Value::Null).0, 200);
    let (_, said) = request(&address, "GET", "/journal?kinds=answer", &Value::Null);
    let said = said["entries"].as_array().ok_or("no entries")?.clone();
    let said: Vec<&str> = said.iter().filter_map(|entry| entry["bytes"].as_str()).collect();
    assert_eq!(said, ["0", "9", "F"]);
    Ok(())
}

/// What somebody has written is quoted whole, with semicolons of its own.
fn what_is_wrong_is_quoted_whole() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, _, address) = serve(folder.path(), &["--time", "real", "--web"]);
    for (path, body, detail, remedy) in [
        (
            "/expectations",
            json!({ "expect": "command @A, never; then" }),
            "this cannot be expected: nothing follows `; then`",
            "go on as in `command @A, never; then x > 100, once`",
        ),
        (
            "/orders",
            json!({ "order": "cover open; shut" }),
            "`cover open; shut` is wrong at `open; shut`: `cover` cannot be `open; shut`",
            "it can be open or closed",
        ),
        (
            "/debugger",
            json!({ "line": "take now" }),
            "nothing follows `take`, and here does `now`",
            "the line `help` lists all",
        ),
        // What would be right is about the words, and not about the request.
        (
            "/clock/run-until",
            json!({ "condition": "x >" }),
            "`x >` is not finished",
            "a position in steps or mm, as in `x > -5000` or `x > -12.5mm`",
        ),
        ("/faults", json!({ "fault": "jam q" }), "`jam q` is wrong at `q`", "an axis: x, y, z, a"),
        (
            "/history/do",
            json!({ "order": "run 5s" }),
            "`run 5s` is wrong at `5s`",
            "run until idle, run until x 2500 or run until CONDITION",
        ),
    ] {
        let (status, said) = request(&address, "POST", path, &body);
        assert_eq!((status, &said["detail"]), (422, &json!(detail)), "{said}");
        assert_eq!(said["remedy"], remedy);
    }
    // Not all that may be in a request goes together.
    let (_, said) = request(&address, "POST", "/history/do", &json!({ "ordr": "hold estop" }));
    assert_eq!(said["remedy"], r#"send an object such as {"order":"hold estop"}"#);
    // And what is right is.
    let right = json!({ "expect": "command @A, never; then x > 100, once" });
    assert_eq!(request(&address, "POST", "/expectations", &right).0, 200);
    Ok(())
}

/// What a problem names as its remedy is there, and helps.
fn remedies_can_be_followed() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, _, address) = serve(folder.path(), &["--time", "real", "--web"]);
    let ask = |method: &str, path: &str, body: Value| request(&address, method, path, &body);
    let refused = |path: &str, body: Value| {
        let (status, said) = ask("POST", path, body);
        let text = |key: &str| said[key].as_str().unwrap_or_default().to_owned();
        (status, text("detail"), text("remedy"))
    };
    let line = |line: &str| json!({ "line": line });
    ask("POST", "/line", json!({ "send": "@01\r" }));
    ask("POST", "/clock/run-until", json!({ "condition": "idle" }));

    // What is in the way is said at once, and not one thing after the other.
    let moves = |(status, detail, remedy): (u16, String, String)| {
        assert_eq!((status, detail.as_str()), (409, "time moves by itself with this clock"));
        assert!(remedy.contains("`step 250ms` to the debugger"), "{remedy}");
    };
    moves(refused("/clock/advance", json!({ "span": "5s" })));
    moves(refused("/clock/advance", json!({ "span": "5" })));
    for order in ["advance 5s", "advance 5", "advance"] {
        moves(refused("/orders", json!({ "order": order })));
    }
    assert_eq!(ask("POST", "/clock/pause", Value::Null).0, 200);
    for (path, body) in [
        ("/clock/run-until", json!({ "condition": "idle" })),
        ("/orders", json!({ "order": "run until idle" })),
    ] {
        let (status, detail, remedy) = refused(path, body);
        assert_eq!((status, detail.as_str()), (409, "time is paused"));
        assert!(remedy.starts_with("POST to clock/resume, or to clock/step"), "{remedy}");
    }
    moves(refused("/clock/advance", json!({ "span": "5s" })));
    let now = || ask("GET", "/clock", Value::Null).1["now"].as_u64();
    let before = now().ok_or("no time")?;
    assert_eq!(ask("POST", "/debugger", line("step 250ms")).0, 200);
    assert_eq!(now(), Some(before + 250_000_000));
    assert_eq!(ask("POST", "/clock/resume", Value::Null).0, 200);
    assert_eq!(ask("DELETE", "/debugger", Value::Null).0, 200);
    let (status, detail, _) = refused("/clock/resume", Value::Null);
    assert_eq!((status, detail.as_str()), (409, "time is not paused"));
    for span in ["10000000h", "5124095h"] {
        moves(refused("/clock/advance", json!({ "span": span })));
    }

    // What is not there is listed by what is named.
    for (path, body, remedy) in [
        ("/debugger", line("delete 1"), "`breakpoints` lists"),
        ("/debugger", line("goto n"), "`marks` and `branches` list"),
        ("/debugger", line("goto command 99"), "`list commands` shows"),
        ("/debugger", line("continue soon"), "a span of time is such as"),
        ("/debugger", line("assert x = 77"), "the line `help assert` explains it"),
        ("/history/do", json!({ "order": "foo" }), "GET the orders, which lists them"),
        ("/orders", json!({ "order": "step" }), "GET the orders, which lists them"),
        ("/history/do", json!({ "order": "pres stop" }), "GET the orders, which lists them"),
    ] {
        let (status, detail, said) = refused(path, body);
        assert!(status == 422 && said.contains(remedy), "{path}: {detail}; {said}");
    }
    for number in [999_999, 0] {
        let (status, detail, said) = refused("/history/go", json!({ "command": number }));
        assert!(status == 404 && said.contains("the journal has"), "{detail}; {said}");
    }
    for (value, remedy) in
        [(json!("x"), "0 or 1, as a number"), (json!("1"), "0 or 1, as a number")]
    {
        for name in ["stop", "limit%20x+"] {
            let (status, said) = ask("PUT", &format!("/signals/{name}"), json!({ "value": value }));
            let told = said["remedy"].as_str().unwrap_or_default();
            assert!(status == 422 && told.contains(remedy), "{name}: {said}");
        }
    }
    assert_eq!(ask("PUT", "/signals/stop", json!({ "value": 1 })).0, 200);
    assert_eq!(ask("PUT", "/signals/stop", json!({ "value": 0 })).0, 200);
    // An image that is empty is none; that of an erased memory is told.
    let (status, said) = ask("PUT", "/flash", json!({ "image": "" }));
    assert_eq!((status, &said["detail"]), (400, &json!("the image is empty")));
    assert!(
        said["remedy"].as_str().is_some_and(|it| it.contains(r#""vimc4 flash 1\n""#)),
        "{said}"
    );
    assert_eq!(ask("PUT", "/flash", json!({ "image": "vimc4 flash 1\n" })).0, 200);
    // A sentence with this remedy is one.
    let (_, _, remedy) = refused("/expectations", json!({ "expect": "rubbish" }));
    assert!(!remedy.contains("rubbish"), "{remedy}");
    let (_, _, remedy) = refused("/expectations", json!({ "expect": "x > 5" }));
    assert_eq!(remedy, "say how often, as in `x > 5, once`");
    for own in ["breakpoints", "marks", "branches", "list commands"] {
        assert_eq!(ask("POST", "/debugger", line(own)).0, 200, "{own}");
    }
    assert_eq!(ask("GET", "/orders", Value::Null).0, 200);
    assert_eq!(ask("DELETE", "/debugger", Value::Null).0, 200);
    Ok(())
}

/// The past is whole: it has the time that has only passed, before a step and before somebody went back.
fn an_entry_is_shown_where_it_happened_and_not_where_it_happened_alike() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, _, address) = serve(folder.path(), &["--time", "100x", "--web"]);
    let ask = |method: &str, path: &str, body: Value| request(&address, method, path, &body);
    let does = |method: &str, path: &str, body: Value| {
        let (status, said) = ask(method, path, body);
        assert_eq!(status, 200, "{path}: {said}");
        said
    };
    let until = |condition: &str| {
        does("POST", "/clock/run-until", json!({ "condition": condition }));
    };
    does("POST", "/line", json!({ "send": "@07\r@0A500000,5000,0,900,0,900,0,900\r" }));
    until("x > 1000");
    does("POST", "/clock/pause", json!({}));
    does("POST", "/snapshots", json!({ "name": "a" }));
    // STOP twice at the same moment, with the probe and without.
    for (method, path, body) in [
        ("PUT", "/signals/probe", json!({ "value": 1 })),
        ("POST", "/snapshots/1/restore", json!({})),
    ] {
        does(method, path, body);
        does("POST", "/orders", json!({ "order": "press stop" }));
        does("POST", "/clock/resume", json!({}));
        until("idle");
        does("POST", "/clock/pause", json!({}));
    }
    let entries = ask("GET", "/journal", Value::Null).1["entries"].clone();
    let entries = entries.as_array().ok_or("no entries")?;
    let is_put_back = |entry: &&Value| entry["about"]["deed"] == "restore";
    let back = entries.iter().find(is_put_back).ok_or("nothing was put back")?["number"].as_u64();
    let begin = entries.iter().find(|entry| entry["motion"] == "begins").ok_or("no motion")?;
    let begin = begin["number"].as_u64();
    for looked_at in [0, 1] {
        let of: Vec<_> = entries.iter().filter(|entry| entry["number"].as_u64() > begin).collect();
        assert!(of.iter().any(|entry| entry["kind"] == "warning"), "{entries:?}");
        for entry in of {
            does("POST", "/history/go", json!({ "branch": looked_at }));
            let number = entry["number"].as_u64();
            let there = does("POST", "/history/go", json!({ "entry": number }));
            assert_eq!(there["at"], entry["at"], "{entry} {there}");
            assert_eq!(there["branch"], json!(u8::from(number > back)), "{entry}");
        }
    }
    Ok(())
}

fn the_past_has_all_that_was_lived() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, _, address) = serve(folder.path(), &["--time", "10x", "--web"]);
    let ask = |method: &str, path: &str, body: Value| {
        let (status, said) = request(&address, method, path, &body);
        assert_eq!(status, 200, "{path} {body}: {said}");
        said
    };
    let get = |path: &str| ask("GET", path, Value::Null);
    let x = |history: &Value| history["view"]["axes"][0]["position"].as_i64().unwrap();
    ask("POST", "/line", json!({ "send": "@01\r@0A30000,900\r" }));
    ask("POST", "/clock/run-until", json!({ "condition": "x > 500" }));
    ask("POST", "/debugger", json!({ "line": "step 100 steps" }));
    let clock = get("/clock");
    assert_eq!(clock["paused"]["at"], clock["now"]);
    let here = clock["now"].as_u64().ok_or("no time")?;
    let stepped = x(&ask("POST", "/history/go", json!({})));
    assert!(stepped > 600, "{stepped}");
    ask("DELETE", "/debugger", Value::Null);

    // A step puts nothing back, and where only time has passed is there.
    let deeds = || -> Vec<String> {
        let news = get("/journal?kinds=news")["entries"].clone();
        let text = |entry: &Value| entry["text"].as_str().unwrap_or_default().to_owned();
        news.as_array().into_iter().flatten().map(text).collect()
    };
    assert!(deeds().iter().all(|deed| !deed.contains("restore")), "{:?}", deeds());
    let at = here - 100_000_000;
    let before = ask("POST", "/history/go", json!({ "at": at }));
    assert_eq!((&before["at"], x(&before)), (&json!(at), stepped - 90));
    assert_eq!(before["branches"].as_array().map(Vec::len), Some(1));

    // Taken over there, the controller goes on; what it had lived is left, and stays.
    assert_eq!(ask("POST", "/history/take", Value::Null)["now"]["at"], at);
    assert_eq!(get("/clock")["paused"]["at"], at);
    ask("DELETE", "/debugger", Value::Null);
    let later = format!("x > {}", stepped + 400);
    ask("POST", "/clock/run-until", json!({ "condition": later }));
    ask("POST", "/line", json!({ "send": "@0P\r" }));
    for later in [50_000_000, 300_000_000] {
        let there = ask("POST", "/history/go", json!({ "at": at + later }));
        assert_eq!((&there["at"], &there["branch"]), (&json!(at + later), &json!(1)));
        assert_eq!(x(&there), stepped - 90 + 900 * later as i64 / 1_000_000_000);
    }
    let branch = get("/history")["branches"][1].clone();
    assert_eq!(
        (&branch["parted"], &branch["first"], &branch["why"]),
        (&json!({ "branch": 0, "at": at }), &json!(at), &Value::Null)
    );
    let left = ask("POST", "/history/go", json!({ "branch": 0, "at": here }));
    assert_eq!(x(&left), stepped);
    ask("DELETE", "/debugger", Value::Null);
    Ok(())
}

/// A moment is looked at after all that happened then, the first one too.
fn the_first_moment_has_what_happened_then() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, _, address) = serve(folder.path(), &["--time", "instant", "--web"]);
    let ask = |method: &str, path: &str, body: Value| {
        let (status, said) = request(&address, method, path, &body);
        assert_eq!(status, 200, "{path} {body}: {said}");
        said
    };
    ask("POST", "/rules", json!({ "rules": "when x > 600: press stop" }));
    ask("POST", "/line", json!({ "send": "@01\r@0A900,3000\r" }));
    let lived = ask("GET", "/journal?kinds=command", Value::Null)["entries"][1].clone();
    assert_eq!(lived["at"], 0);
    assert_eq!(ask("POST", "/history/go", json!({ "at": 0 }))["at"], 0);
    let said = ask("POST", "/debugger", json!({ "line": "where" }))["text"].clone();
    assert!(said.as_str().is_some_and(|said| said.contains("#2 @0A900,3000")), "{said}");
    ask("POST", "/history/take", Value::Null);
    assert_eq!(ask("GET", "/rules", Value::Null)[0]["acted"], 0);
    Ok(())
}

/// A debugger has breakpoints of its own: those of the API keep their numbers, and it is said whose paused.
fn the_breakpoints_of_the_debugger_are_its_own() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, _, address) = serve(folder.path(), &["--time", "100x", "--web"]);
    let ask = |method: &str, path: &str, body: Value| {
        let (status, said) = request(&address, method, path, &body);
        assert_eq!(status, 200, "{path} {body}: {said}");
        said
    };
    let debug = |line: &str| ask("POST", "/debugger", json!({ "line": line }))["text"].clone();
    let paused = || ask("GET", "/clock", Value::Null)["paused"].clone();
    ask("POST", "/line", json!({ "send": "@01\r" }));
    debug("break x > 1500");
    debug("send @0A30000,900");
    let said = debug("continue");
    assert!(said.as_str().is_some_and(|said| said.contains("breakpoint 1")), "{said}");
    let none = json!([]);
    assert_eq!(paused()["by"], "breakpoint 1 of the debugger");
    assert_eq!(
        (&paused()["breakpoints"], &ask("GET", "/breakpoints", Value::Null)),
        (&none, &none)
    );
    debug("continue 200ms");
    assert_eq!((&paused()["by"], &paused()["breakpoints"]), (&json!("the debugger"), &none));
    assert_eq!(ask("POST", "/breakpoints", json!({ "condition": "x > 3000" }))["id"], 1);
    ask("DELETE", "/debugger", Value::Null);
    ask("POST", "/clock/run-until", json!({ "condition": "x > 4000" }));
    assert_eq!((&paused()["by"], &paused()["breakpoints"]), (&Value::Null, &json!([1])));
    Ok(())
}

/// The line is debugged with the controller: what goes wrong there and what rules do is in the past, goes
/// back with it, and whoever is connected gets each answer once.
fn faults_and_rules_go_back_with_the_controller() -> Outcome {
    let folder = tempfile::tempdir()?;
    let arguments = ["--time", "100x", "--web", "--tcp", "127.0.0.1:0", "--record", "all.jsonl"];
    let (mut serve, ready, address) = serve(folder.path(), &arguments);
    let mut host = connect(tcp(&ready, 0));
    let ask = |method: &str, path: &str, body: Value| {
        let (status, said) = request(&address, method, path, &body);
        assert_eq!(status, 200, "{path} {body}: {said}");
        said
    };
    let debug = |line: &str| {
        let said = ask("POST", "/debugger", json!({ "line": line }))["text"].clone();
        said.as_str().unwrap_or_default().to_owned()
    };
    let mut gets = |answers: &str| {
        let mut got = vec![0; answers.len()];
        host.read_exact(&mut got).unwrap();
        assert_eq!(String::from_utf8_lossy(&got), answers);
    };
    let x = || ask("GET", "/position", Value::Null)["axes"]["X"].as_i64();
    let acted = || ask("GET", "/rules", Value::Null)[0]["acted"].clone();

    // A rule that never acts and a fault that never strikes change nothing.
    ask("POST", "/rules", json!({ "rules": "rule once when x > 600: press stop" }));
    ask("POST", "/faults", json!({ "fault": "drop to-host once after command @P" }));
    debug("send @01");
    debug("step 10ms");
    debug("send @0A500,3000");
    debug("step 1s");
    gets("00");

    // What the rule does is stepped through, and so is a breakpoint that somebody else has set.
    ask("POST", "/breakpoints", json!({ "condition": "x > 550" }));
    debug("send @0A400,3000");
    let said = debug("step 1s");
    assert!(said.contains("F"), "{said}");
    gets("F");
    let stopped = x();
    assert!(stopped.is_some_and(|x| (600..900).contains(&x)), "{stopped:?}");
    assert_eq!(acted(), 1);

    // Where it had not acted it has not, and it acts again; the past is what was.
    debug("back 900ms");
    let there = debug("where");
    assert!(there.contains("X         ") && there.contains("on main"), "{there}");
    assert_eq!(acted(), 1, "it is only looked at");
    debug("goto start");
    debug("next x = 560");
    debug("take");
    assert_eq!((x(), acted()), (Some(560), json!(0)));
    debug("step 1s");
    gets("F");
    assert_eq!((x(), acted()), (stopped, json!(1)));

    // The answer that the fault swallows is in nobody's hands, however one gets there.
    debug("send @0P");
    debug("step 10ms");
    debug("send @07");
    debug("step 10ms");
    gets(&format!("{:06X}0000000000000", stopped.unwrap_or_default()));
    let branches = ask("GET", "/history", Value::Null)["branches"].clone();
    assert_eq!(branches.as_array().map(Vec::len), Some(1), "{branches}");
    ask("DELETE", "/debugger", Value::Null);
    serve.give("quit\n");
    assert_eq!(serve.end().0, Some(0));
    let (code, said, wrong) = run(folder.path(), &["replay", "all.jsonl"]);
    assert!(code == 0 && said.starts_with("equal"), "{said}{wrong}");
    Ok(())
}

/// Whoever looks, asks or leaves changes nothing but what they mean to.
fn those_who_look_are_in_nobodys_way() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, _, address) = serve(folder.path(), &["--time", "100x", "--web"]);
    let ask = |method: &str, path: &str, body: Value| request(&address, method, path, &body);
    let get = |path: &str| ask("GET", path, Value::Null).1;
    let idle = json!({ "condition": "idle" });
    ask("POST", "/line", json!({ "send": "@01\r@0A500,900\r" }));
    assert_eq!(ask("POST", "/clock/run-until", idle.clone()).0, 200);

    // A client that sees another moment than the one that is looked at by now means that, and is told.
    let begin = get("/journal?kinds=command")["entries"][0]["at"].as_u64().ok_or("no command")?;
    let later = begin + 200_000_000;
    let seen = ask("POST", "/history/go", json!({ "at": begin + 100_000_000 })).1;
    let seen = json!({ "branch": seen["branch"], "at": seen["at"] });
    ask("POST", "/history/go", json!({ "at": later }));
    let order = json!({ "order": "hold estop", "branch": seen["branch"], "at": seen["at"] });
    for (path, body) in [("/history/take", seen.clone()), ("/history/do", order)] {
        let (status, said) = ask("POST", path, body);
        let detail = said["detail"].as_str().unwrap_or_default();
        assert!(
            status == 409 && detail.contains(&format!("{later} ns on branch 0")),
            "{path}: {said}"
        );
    }
    assert_eq!(get("/history")["branches"].as_array().map(Vec::len), Some(1));
    let here = json!({ "branch": 0, "at": later });
    assert_eq!(ask("POST", "/history/take", here).0, 200);
    ask("DELETE", "/debugger", Value::Null);
    assert_eq!(get("/clock")["paused"], Value::Null);

    // Somebody lets time go on; to ask what there is does not stop it again.
    ask("POST", "/history/go", json!({}));
    assert_eq!(ask("POST", "/clock/resume", Value::Null).0, 200);
    assert_eq!(get("/history")["open"], true);
    get("/history/entries?branch=0");
    assert_eq!(get("/clock")["paused"], Value::Null);
    ask("DELETE", "/debugger", Value::Null);

    // What was paused before stays so.
    assert_eq!(ask("POST", "/clock/pause", Value::Null).0, 200);
    ask("POST", "/history/go", json!({ "at": later }));
    ask("DELETE", "/debugger", Value::Null);
    assert_eq!(get("/clock")["paused"]["by"], "the API");
    assert_eq!(ask("POST", "/clock/resume", Value::Null).0, 200);

    // What is refused stops no time. Where no debugger is open no moment is looked at, and none is taken.
    for (path, body, status) in [
        ("/debugger", json!({ "line": "stpe" }), 422),
        ("/history/go", json!({ "branch": 7 }), 404),
        ("/history/take", json!({}), 409),
        ("/history/take", json!({ "branch": 0 }), 409),
    ] {
        let (answered, said) = ask("POST", path, body);
        assert_eq!(answered, status, "{path}: {said}");
        assert_eq!(get("/clock")["paused"], Value::Null, "{path}");
    }

    // A pause that somebody makes meanwhile outlasts the debugger, unless time is let go on.
    for (then, stays) in [(None, true), (Some("/clock/resume"), false)] {
        ask("POST", "/history/go", json!({ "at": later }));
        assert_eq!(ask("POST", "/clock/pause", Value::Null).0, 200);
        then.map(|path| ask("POST", path, Value::Null));
        ask("POST", "/history/go", json!({ "at": later }));
        ask("DELETE", "/debugger", Value::Null);
        assert_eq!(get("/clock")["paused"].is_object(), stays, "{then:?}");
        ask("POST", "/clock/resume", Value::Null);
    }

    // What was sent in the debugger arrives when that is closed.
    ask("POST", "/clock/run-until", idle.clone());
    let from = get("/position")["axes"]["X"].as_i64().ok_or("no position")?;
    for line in ["send @0A20,900", "send @0A3,900", "step command", "back command"] {
        assert_eq!(ask("POST", "/debugger", json!({ "line": line })).0, 200, "{line}");
    }
    ask("DELETE", "/debugger", Value::Null);
    assert_eq!(ask("POST", "/clock/run-until", idle).0, 200);
    assert_eq!(get("/position")["axes"]["X"], from + 23);
    Ok(())
}

/// What the page records plays, and so does what `--record` has written so far.
fn what_is_recorded_over_http_plays() -> Outcome {
    let folder = tempfile::tempdir()?;
    let lines = block("sh").into_iter();
    let lines: Vec<&str> = lines.skip_while(|line| !line.contains("/recording")).collect();
    let count = lines.iter().take_while(|line| !line.contains("DELETE")).count() + 1;
    for given in [&["--web"][..], &["--web", "--record", "other.jsonl"]] {
        let (_serve, ready, address) = serve(folder.path(), given);
        process::ask(
            &mut connect(process::tcp(&ready, 0)),
            "@07\r@0A50,900,0,900,0,900,0,900\r",
            1,
        );
        for line in &lines[..count] {
            let line = line.replace(THERE, &address);
            printed(
                Command::new("sh")
                    .args(["-c", &line])
                    .current_dir(folder.path())
                    .output_in_time()
                    .as_ref()?,
            )?;
        }
        let (code, said, wrong) = run(folder.path(), &["replay", "session.jsonl"]);
        assert!(code == 0 && said.contains("equal: 1 input "), "{said}{wrong}");
    }
    let (_serve, ready, address) = serve(folder.path(), &["--web", "--record", "third.jsonl"]);
    process::ask(&mut connect(process::tcp(&ready, 0)), "@07\r", 1);
    let line = format!("curl -s http://{address}/v1/controllers/1/recording");
    let text = printed(&shell(&line))?;
    assert_eq!(text, std::fs::read_to_string(folder.path().join("third.jsonl"))?);
    assert!(text.contains(r#""in":"@07\r""#), "{text}");
    // That one is not a client's to end.
    let line = format!("curl -s -X DELETE http://{address}/v1/controllers/1/recording");
    let text = printed(&shell(&line))?;
    assert!(
        text.contains("was begun by --record") && text.contains("ends with the program"),
        "{text}"
    );
    Ok(())
}

/// A recording is one page, which asks for nothing and may run nothing else.
fn a_recording_is_one_page() -> Outcome {
    let folder = tempfile::tempdir()?;
    let out = folder.path().join("limit.html");
    let recording = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/limit.jsonl");
    let program = Command::new(env!("CARGO_BIN_EXE_vimc4"));
    let replay = |mut program: Command, out: &Path| {
        program.args(["replay", recording, "--html"]).arg(out).output_in_time()
    };
    let told = replay(program, &out)?;
    assert!(told.status.success() && told.stdout.starts_with(b"equal"), "{told:?}");
    let page = fs::read_to_string(&out)?;
    let policy = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'";
    assert!(page.contains(policy) && page.contains("id=\"film\">H4sI"));
    assert!(!page.contains(" src=") && !page.contains("rel=\"stylesheet\""));
    // A page gives way to another one; nothing else does.
    assert!(replay(Command::new(env!("CARGO_BIN_EXE_vimc4")), &out)?.status.success());
    let own = folder.path().join("own.jsonl");
    fs::copy(recording, &own)?;
    for place in [own.clone(), folder.path().join("nowhere").join("limit.html"), "-".into()] {
        let told = replay(Command::new(env!("CARGO_BIN_EXE_vimc4")), &place)?;
        assert_eq!(told.status.code(), Some(2), "{told:?}");
    }
    assert_eq!(fs::read(&own)?, fs::read(recording)?);
    Ok(())
}

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let required = std::env::var_os("VIMC4_REQUIRE_TOOLS").is_some();
    let trial = |name: &str, tool: &str, test: fn() -> Outcome| {
        let missing = !tool.is_empty() && !has(&format!("{tool} >/dev/null 2>&1"));
        let name = if missing { format!("{name} (needs `{tool}`)") } else { name.to_owned() };
        Trial::test(name, test).with_ignored_flag(missing && !required)
    };
    let node = format!("node {WEBSOCKET} --version");
    let trials = vec![
        trial("curl_answers_as_shown", "curl --json x --version", curl_answers_as_shown),
        trial(
            "what_is_recorded_over_http_plays",
            "curl --version",
            what_is_recorded_over_http_plays,
        ),
        trial("the_python_recipe_runs", "python3 --version", the_python_recipe_runs),
        trial("the_javascript_recipe_runs", &node, the_javascript_recipe_runs),
        trial("the_debugger_goes_forward_and_back", "", the_debugger_goes_forward_and_back),
        trial(
            "a_command_that_has_not_begun_is_not_looked_at",
            "",
            a_command_that_has_not_begun_is_not_looked_at,
        ),
        trial(
            "the_past_is_looked_at_branches_and_is_taken_over",
            "",
            the_past_is_looked_at_branches_and_is_taken_over,
        ),
        trial(
            "an_entry_is_shown_where_it_happened_and_not_where_it_happened_alike",
            "",
            an_entry_is_shown_where_it_happened_and_not_where_it_happened_alike,
        ),
        trial("the_past_has_all_that_was_lived", "", the_past_has_all_that_was_lived),
        trial(
            "the_first_moment_has_what_happened_then",
            "",
            the_first_moment_has_what_happened_then,
        ),
        trial(
            "the_breakpoints_of_the_debugger_are_its_own",
            "",
            the_breakpoints_of_the_debugger_are_its_own,
        ),
        trial(
            "faults_and_rules_go_back_with_the_controller",
            "",
            faults_and_rules_go_back_with_the_controller,
        ),
        trial("those_who_look_are_in_nobodys_way", "", those_who_look_are_in_nobodys_way),
        trial("a_host_gets_what_it_has_not_had", "", a_host_gets_what_it_has_not_had),
        trial("what_is_wrong_is_quoted_whole", "", what_is_wrong_is_quoted_whole),
        trial("remedies_can_be_followed", "", remedies_can_be_followed),
        trial("a_line_that_takes_its_time_is_debugged", "", a_line_that_takes_its_time_is_debugged),
        trial("a_recording_is_one_page", "", a_recording_is_one_page),
        trial("it_listens_where_it_says", "", it_listens_where_it_says),
    ];
    libtest_mimic::run(&arguments, trials).exit_code()
}
