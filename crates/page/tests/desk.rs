//! What a page asks its desk, natively: the same code answers as WebAssembly.

#![expect(clippy::too_many_lines, reason = "one test is one story")]
#![expect(clippy::unwrap_used, reason = "a test that cannot read an answer has failed")]

#[path = "../../../emulator/src/recording/tests/changed.rs"]
mod changed;

use serde_json::{Value, json};
use vimc4_answers::table::ROUTES;
use vimc4_catalogue::bare;
use vimc4_device::{Device, Line};
use vimc4_page::Desk;
use vimc4_timeline::recording::{LineSort, Player, Recording, Tolerance, check};

fn asked(desk: &mut Desk, method: &str, path: &str, body: &Value) -> (u16, Value) {
    let body = if body.is_null() { String::new() } else { body.to_string() };
    let reply = desk.ask(method, path, &body, 0.0);
    let answer = match reply.is_json {
        true => serde_json::from_str(&reply.body).unwrap(),
        false => Value::String(reply.body),
    };
    (reply.status, answer)
}

/// What asks the first controller, which must do it, and returns what it says.
fn done(desk: &mut Desk) -> impl FnMut(&str, &str, Value) -> Value {
    |method, path, body| {
        let (status, answer) = asked(desk, method, &format!("/v1/controllers/1/{path}"), &body);
        assert_eq!(status, 200, "{path}: {answer}");
        answer
    }
}

#[test]
fn every_route_of_the_api_is_answered() {
    let mut desk = Desk::new();
    for route in ROUTES {
        let path = route.path.replace("{n}", "1").replace("{name}", "start");
        let path = path.replace("{id}", "1").replace("{number}", "1").replace("{scenario}", "1");
        let fields = route.body.iter().map(|field| (field.name.to_owned(), field.example()));
        let body = if route.body.is_empty() { Value::Null } else { fields.collect() };
        let (status, answer) = asked(&mut desk, route.method, &path, &body);
        let is_said = status == 200 || answer["detail"].is_string();
        assert!(is_said, "{} {path} {body}: {status} {answer}", route.method);
        assert_ne!(status, 405, "{} {path}", route.method);
    }
}

#[test]
fn what_does_not_fit_is_told_of_once_for_bytes_that_came_together() {
    let mut desk = Desk::new();
    let mut ask = done(&mut desk);
    ask("PUT", "clock", json!({ "clock": "manual" }));
    ask("POST", "line", json!({ "send": "@07\r@0A5000,100,0,900,0,900,0,900\r" }));
    ask("POST", "clock/advance", json!({ "span": "1s" }));
    for _ in 0..3 {
        ask("POST", "line", json!({ "send": "@0P\r".repeat(400) }));
    }
    let journal = ask("GET", "journal?kinds=warning", Value::Null);
    let lost = journal["entries"].as_array().unwrap();
    assert!((2..=3).contains(&lost.len()), "{journal}");
    assert_eq!(
        lost[lost.len() - 1]["text"],
        "warning: the receive buffer was full, 1600 bytes were lost"
    );
}

#[test]
fn time_passes_where_it_is_heard_and_nowhere_else() {
    let mut desk = Desk::new();
    let one = "/v1/controllers/1";
    let now = |desk: &mut Desk| {
        asked(desk, "GET", &format!("{one}/clock"), &Value::Null).1["now"].clone()
    };
    assert_eq!(now(&mut desk), 0);
    // Whatever the page has done before: this is the beginning.
    desk.hear(123_456.0);
    assert_eq!(now(&mut desk), 0);
    desk.hear(124_456.5);
    assert_eq!(now(&mut desk), 1_000_500_000);
    asked(&mut desk, "PUT", &format!("{one}/clock"), &json!({ "clock": "8x" }));
    desk.hear(124_557.0);
    assert_eq!(now(&mut desk), 1_804_500_000_u64);
}

#[test]
fn the_debugger_steps_the_controller_along_and_looks_back_without_it() {
    let mut desk = Desk::new();
    let mut ask = done(&mut desk);
    ask("PUT", "clock", json!({ "clock": "manual" }));
    ask("POST", "debugger", json!({ "line": "send @01" }));
    ask("POST", "debugger", json!({ "line": "send @0A5000,900" }));
    ask("POST", "debugger", json!({ "line": "step command" }));
    ask("POST", "debugger", json!({ "line": "step command" }));
    ask("POST", "debugger", json!({ "line": "next x = 2500" }));
    // The controller itself came along, and what happened on the way was told.
    assert_eq!(ask("GET", "position", Value::Null)["axes"]["X"], 2_500);
    let entries = ask("GET", "journal?kinds=command", Value::Null);
    assert_eq!(entries["entries"].as_array().map(Vec::len), Some(2));
    ask("POST", "debugger", json!({ "line": "back 10 steps" }));
    assert_eq!(ask("GET", "debugger/view", Value::Null)["axes"][0]["position"], 2_490);
    assert_eq!(ask("GET", "position", Value::Null)["axes"]["X"], 2_500);
    // Something else in the past, and the controller stays where it is until it is taken there.
    let there = ask("POST", "history/do", json!({ "order": "press stop" }));
    assert_eq!(there["branches"].as_array().map(Vec::len), Some(2));
    let entries = ask("GET", "history/entries?branch=1", Value::Null);
    let texts: Vec<&str> = entries["entries"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|it| it["text"].as_str())
        .collect();
    assert!(texts.iter().any(|text| text.starts_with('F')), "{texts:?}");
    assert_eq!(ask("GET", "history", Value::Null)["now"]["branch"], 0);
    // A branch says something before the moment at which it is taken: its client gets it then, and told.
    ask("POST", "history/go", json!({ "branch": 1 }));
    ask("POST", "clock/pause", Value::Null);
    ask("POST", "history/take", Value::Null);
    let clock = ask("GET", "clock", Value::Null);
    assert_eq!(clock["paused"]["at"], clock["now"], "it stands where it was taken: {clock}");
    ask("POST", "clock/resume", Value::Null);
    ask("DELETE", "debugger", Value::Null);
    let answers = ask("GET", "journal?kinds=answer", Value::Null)["entries"].clone();
    let answers: Vec<&str> =
        answers.as_array().unwrap().iter().filter_map(|it| it["bytes"].as_str()).collect();
    assert_eq!(answers, ["0", "F"]);
    let halted = ask("GET", "position", Value::Null)["axes"]["X"].as_i64().unwrap();
    assert!((2_490..5_000).contains(&halted), "{halted}");
    // What it has said does not come again.
    ask("POST", "history/go", json!({ "branch": 0 }));
    ask("POST", "history/take", Value::Null);
    let answers = ask("GET", "journal?kinds=answer", Value::Null)["entries"].clone();
    assert_eq!(answers.as_array().map(Vec::len), Some(2));
    // A pause that is made meanwhile stays one; and time goes on where it was let go on.
    ask("POST", "clock/pause", Value::Null);
    ask("DELETE", "debugger", Value::Null);
    assert_ne!(ask("GET", "clock", Value::Null)["paused"], Value::Null);
    ask("POST", "history/go", json!({}));
    ask("POST", "clock/resume", Value::Null);
    ask("DELETE", "debugger", Value::Null);
    assert_eq!(ask("GET", "clock", Value::Null)["paused"], Value::Null);
}

#[test]
fn a_recording_of_a_session_with_steps_is_played_again() {
    let mut desk = Desk::new();
    let mut ask = done(&mut desk);
    ask("PUT", "clock", json!({ "clock": "manual" }));
    ask("POST", "recording", Value::Null);
    ask("POST", "breakpoints", json!({ "condition": "x > 100" }));
    ask("POST", "line", json!({ "send": "@01\r@0A1000,900\r" }));
    ask("POST", "clock/run-until", json!({ "condition": "idle" }));
    ask("POST", "orders", json!({ "order": "press stop" }));
    ask("POST", "clock/step", Value::Null);
    ask("POST", "clock/resume", Value::Null);
    ask("POST", "clock/run-until", json!({ "condition": "idle" }));
    let view = ask("GET", "view", Value::Null);
    let Value::String(text) = ask("GET", "recording", Value::Null) else { panic!("no text") };
    let mut other = Desk::new();
    let (status, answer) = asked(&mut other, "PUT", "/v1/recording", &json!({ "text": text }));
    assert_eq!((status, answer), (200, json!({ "torn": null, "is_whole": true, "differs": null })));
    let again = asked(&mut other, "GET", "/v1/controllers/1/view", &Value::Null).1;
    assert_eq!(again, view);
    // Whoever goes on from there sees time pass, although it had been moved on by hand.
    assert_eq!(done(&mut other)("GET", "clock", Value::Null)["clock"], "real");
    // What is missing is said.
    let lines = text.lines().count();
    let half = json!({ "text": &text[..text.len() - 5] });
    let (status, answer) = asked(&mut other, "PUT", "/v1/recording", &half);
    assert_eq!(
        (status, answer),
        (200, json!({ "torn": lines, "is_whole": false, "differs": null }))
    );
}

#[test]
fn a_recording_of_time_that_ran_towards_a_breakpoint_is_opened_at_its_end() {
    let mut desk = Desk::new();
    done(&mut desk)("POST", "recording", Value::Null);
    done(&mut desk)("POST", "breakpoints", json!({ "condition": "x > 1000" }));
    desk.hear(0.0);
    done(&mut desk)("POST", "line", json!({ "send": "@01\r@0A500,900\r@0A400,900\r" }));
    for moment in [100.0, 700.0, 1_000.0] {
        desk.hear(moment);
        let recording = done(&mut desk)("GET", "recording", Value::Null);
        let Value::String(text) = recording else { panic!("no text") };
        let view = done(&mut desk)("GET", "view", Value::Null);
        assert!(played(&text).is_ok(), "{moment} {:?} {text}", played(&text));
        let mut other = Desk::new();
        assert_eq!(asked(&mut other, "PUT", "/v1/recording", &json!({ "text": text })).0, 200);
        assert_eq!(done(&mut other)("GET", "view", Value::Null), view, "{moment} {text}");
    }
}

#[test]
fn a_recording_tells_of_the_clock_that_was_set_last() {
    let mut desk = Desk::new();
    let mut ask = done(&mut desk);
    ask("PUT", "clock", json!({ "clock": "manual" }));
    ask("POST", "recording", Value::Null);
    ask("PUT", "clock", json!({ "clock": "8x" }));
    let Value::String(text) = ask("GET", "recording", Value::Null) else { panic!("no text") };
    assert!(text.lines().next().unwrap().contains(r#""clock":"8x""#), "{text}");
    let mut other = Desk::new();
    assert_eq!(asked(&mut other, "PUT", "/v1/recording", &json!({ "text": text })).0, 200);
    assert_eq!(done(&mut other)("GET", "clock", Value::Null)["clock"], "8x");
}

#[test]
fn a_recording_ends_where_it_was_paused_between_two_things_at_one_instant() {
    let mut desk = Desk::new();
    let mut ask = done(&mut desk);
    ask("PUT", "clock", json!({ "clock": "manual" }));
    ask("POST", "recording", Value::Null);
    ask("POST", "line", json!({ "send": "@01\r@0A100,900\r" }));
    ask("POST", "clock/advance", json!({ "span": "10ms" }));
    ask("POST", "breakpoints", json!({ "condition": "command @P" }));
    // These are carried out at the instant at which the move ends.
    ask("POST", "line", json!({ "send": "@0P\r@0V\r" }));
    ask("POST", "clock/run-until", json!({ "condition": "idle" }));
    let said = |desk: &mut Desk| -> Vec<Value> {
        let journal = done(desk)("GET", "journal?kinds=command,answer", Value::Null);
        journal["entries"].as_array().unwrap().iter().map(|entry| entry["text"].clone()).collect()
    };
    drop(ask);
    for (step, count) in [("cause", 6), ("rest", 8)] {
        let recording = done(&mut desk)("GET", "recording", Value::Null);
        let Value::String(text) = recording else { panic!("no text") };
        assert!(played(&text).is_ok(), "{text}");
        let mut other = Desk::new();
        let body = json!({ "text": text });
        assert_eq!(asked(&mut other, "PUT", "/v1/recording", &body).0, 200);
        assert_eq!(said(&mut other), said(&mut desk), "{text}");
        assert_eq!(said(&mut desk).len(), count);
        assert_eq!(done(&mut desk)("POST", "clock/step", Value::Null)["step"], step);
    }
}

#[test]
fn the_quirks_are_listed_with_values_that_can_be_asked_for() {
    let mut desk = Desk::new();
    let (status, quirks) = asked(&mut desk, "GET", "/v1/controllers/1/quirks", &Value::Null);
    let found = quirks.as_array().unwrap().iter().find(|quirk| quirk[0] == "version_handshake");
    assert_eq!((status, &found.unwrap()[1]), (200, &json!(["\"first\"", "\"last\""])));
    let body = json!({ "model": "imc4", "quirks": { "version_handshake": "first" } });
    assert_eq!(asked(&mut desk, "PUT", "/v1/controllers", &body).0, 200);
    let (_, model) = asked(&mut desk, "GET", "/v1/controllers/1/model", &Value::Null);
    assert_eq!(model["quirks"]["version_handshake"], "first");
}

#[test]
fn who_goes_back_leaves_the_way_there_and_stands_where_it_went() {
    let mut desk = Desk::new();
    let one = "/v1/controllers/1";
    let mut ask = |method: &str, path: &str, body: Value| {
        let (status, answer) = asked(&mut desk, method, &format!("{one}/{path}"), &body);
        assert_eq!(status, 200, "{path}: {answer}");
        answer
    };
    ask("PUT", "clock", json!({ "clock": "manual" }));
    ask("POST", "recording", Value::Null);
    ask("POST", "line", json!({ "send": "@01\r" }));
    ask("POST", "clock/advance", json!({ "span": "1s" }));
    ask("POST", "snapshots", Value::Null);
    ask("POST", "line", json!({ "send": "@0A900,900\r" }));
    ask("POST", "clock/advance", json!({ "span": "2s" }));
    ask("POST", "snapshots/1/restore", Value::Null);
    ask("POST", "line", json!({ "send": "@0A-300,900\r" }));
    ask("POST", "clock/advance", json!({ "span": "500ms" }));
    // What was left is not on the way, not even at the very instant.
    let there = ask("POST", "history/go", json!({ "at": 1_200_000_000_u64 }));
    let branch = &there["branches"][1];
    assert_eq!(
        (&branch["parted"]["at"], &branch["first"]),
        (&json!(1_000_000_000), &json!(1_000_000_000))
    );
    assert!(there["view"]["axes"][0]["position"].as_i64().is_some_and(|x| x < 0), "{there}");
    let entries = ask("GET", "history/entries?branch=1", Value::Null).to_string();
    assert!(entries.contains("@0A-300,900") && !entries.contains("@0A900,900"), "{entries}");
    let left = ask("POST", "history/go", json!({ "branch": 0, "at": 2_900_000_000_u64 }));
    assert_eq!(left["view"]["axes"][0]["position"], 900);
    ask("POST", "history/go", json!({ "branch": 1, "at": 1_200_000_000_u64 }));
    // An entry is shown where it happened: the first motion on the branch that was left.
    let journal = ask("GET", "journal", Value::Null);
    let motions = journal["entries"].as_array().into_iter().flatten();
    let motions: Vec<&Value> = motions.filter(|entry| entry["kind"] == "motion").collect();
    for (motion, branch, x) in [(0, 0, 0), (1, 0, 900), (2, 1, 0)] {
        let there = ask("POST", "history/go", json!({ "entry": motions[motion]["number"] }));
        assert_eq!((&there["branch"], &there["at"]), (&json!(branch), &motions[motion]["at"]));
        assert_eq!(there["view"]["axes"][0]["position"], x);
    }
    ask("POST", "history/go", json!({ "branch": 1, "at": 1_200_000_000_u64 }));
    ask("POST", "history/take", Value::Null);
    let clock = ask("GET", "clock", Value::Null);
    assert_eq!(
        (&clock["now"], &clock["paused"]["at"]),
        (&json!(1_200_000_000), &json!(1_200_000_000))
    );
}

#[test]
fn positions_are_told_of_a_motion_that_goes_on_from_the_past() {
    let mut desk = Desk::new();
    let ask = |desk: &mut Desk, method: &str, path: &str, body: Value| {
        let (status, answer) = asked(desk, method, &format!("/v1/controllers/1/{path}"), &body);
        assert_eq!(status, 200, "{path}: {answer}");
    };
    let heard = |desk: &mut Desk, now: f64| -> Vec<Value> {
        let messages: Vec<Value> = serde_json::from_str(&desk.hear(now)).unwrap();
        messages.into_iter().filter(|message| message["type"] == "position").collect()
    };
    let (status, hello) = asked(&mut desk, "PUT", "/v1/events", &json!({ "positions": 20 }));
    assert_eq!(status, 200, "{hello}");
    heard(&mut desk, 0.0);
    let line = "@07\r@0A8000,2000,0,900,0,900,0,900\r";
    ask(&mut desk, "POST", "line", json!({ "send": line }));
    heard(&mut desk, 1_000.0);
    let take = |desk: &mut Desk, at: u64| {
        ask(desk, "POST", "history/go", json!({ "at": at }));
        ask(desk, "POST", "history/take", Value::Null);
        ask(desk, "DELETE", "debugger", Value::Null);
    };
    take(&mut desk, 500_000_000);
    let mut last = 0;
    for i in 1..=8 {
        let told = heard(&mut desk, 1_000.0 + 100.0 * f64::from(i));
        let x = told.first().and_then(|told| told["positions"][0].as_i64()).unwrap_or_default();
        assert!(last < x && x < 8_000, "{last} and then {told:?}");
        assert_eq!(told[0]["moving"], true, "{told:?}");
        last = x;
    }
    let end = heard(&mut desk, 9_000.0);
    assert_eq!((&end[0]["positions"][0], &end[0]["moving"]), (&json!(8_000), &json!(false)));
    // Where nothing moves nothing more is told.
    take(&mut desk, 6_000_000_000);
    heard(&mut desk, 9_100.0);
    assert_eq!(heard(&mut desk, 9_200.0), Vec::<Value>::new());
}

/// Plays a recording as `vimc4 replay` does: so many bytes are equal, or where it parts.
fn played(text: &str) -> Result<u64, String> {
    let recording = Recording::read(text.as_bytes()).unwrap();
    let (model, machine) = (vimc4_catalogue::model("imc4"), vimc4_catalogue::machine("bench"));
    let controller = bare(&model.unwrap(), &machine.unwrap(), &[]).unwrap();
    let state = |written: &Value| {
        serde_json::from_value(written.clone()).map_err(|error| error.to_string())
    };
    let player = Player::new(match recording.head.line {
        LineSort::Ideal => Line::ideal(controller),
        LineSort::Paced => Line::paced(controller),
    });
    let played = check(&recording, player, Tolerance::Exact, &state, &mut |_| {}).unwrap();
    match played.difference {
        None => Ok(played.bytes),
        Some(found) => Err(format!("{found:?}")),
    }
}

/// A number for the whole state that is looked at.
fn digest(desk: &mut Desk) -> Value {
    done(desk)("POST", "debugger", json!({ "line": "digest" }))
}

/// Another desk, on which all is done again that was done on the way to the moment that is looked at.
fn again(desk: &mut Desk) -> Desk {
    let told = done(desk)("GET", "deeds", Value::Null);
    let mut other = Desk::new();
    let mut ask = done(&mut other);
    ask("PUT", "clock", json!({ "clock": "manual" }));
    let mut now = 0;
    let mut pass = |ask: &mut dyn FnMut(&str, &str, Value) -> Value, at: &Value| {
        let at = at.as_u64().unwrap();
        ask("POST", "clock/advance", json!({ "span": format!("{}ns", at - now) }));
        now = at;
    };
    for deed in told["deeds"].as_array().unwrap() {
        pass(&mut ask, &deed[0]);
        match deed[1].as_str().unwrap() {
            "send" => ask("POST", "line", json!({ "send": deed[2] })),
            "order" => ask("POST", "orders", json!({ "order": deed[2] })),
            "rules" => ask("POST", "rules", json!({ "rules": deed[2] })),
            "end-rules" if deed[2] == "" => ask("DELETE", "rules", Value::Null),
            "end-rules" => {
                ask("DELETE", &format!("rules/{}", deed[2].as_str().unwrap()), Value::Null)
            }
            kind => {
                assert_eq!(kind, "set");
                let path = format!("signals/{}", deed[2].as_str().unwrap().replace(' ', "%20"));
                ask("PUT", &path, json!({ "value": deed[3] }))
            }
        };
    }
    pass(&mut ask, &told["at"]);
    drop(ask);
    other
}

#[test]
fn what_is_typed_in_the_debugger_is_in_the_recording_and_in_the_link() {
    let sessions: &[&[&str]] = &[
        &["send @01", "send @0A5000,900", "step command", "step command", "continue"],
        // In the middle of an answer, of a motion, and of all that is due at one instant.
        &["send @01", "step 2 bytes", "step 3 bytes", "step cause"],
        &["send @01", "send @0A5000,900", "next x = 2500", "send @0P", "continue 1s"],
        // Faults, rules and the panel.
        &["fault drop to-host once", "send @01", "continue", "send @0P", "continue"],
        &[
            "fault garble to-host 30%",
            "send @0V",
            "continue",
            "fault end all",
            "send @0P",
            "continue",
        ],
        &[
            "when x > 300: press stop",
            "send @01",
            "send @0A5000,900",
            "continue",
            "send @0P",
            "continue",
        ],
        &[
            "rule jam once when x > 9: input 0.1 1; hold stop",
            "rule at 1s: press stop",
            "rule end 2",
            "send @01",
            "send @0A5000,900",
            "continue",
        ],
        &[
            "send @01",
            "send @0A5000,900",
            "step 2 command",
            "continue 1s",
            "press stop",
            "continue",
            "press start",
            "continue",
        ],
        &[
            "send @01",
            "continue",
            "power off",
            "send @0P",
            "step 9 bytes",
            "power on",
            "continue 9s",
            "cover open",
            "set input 0.2 1",
            "continue",
        ],
        // Back, and on from there.
        &[
            "send @01",
            "send @0A5000,900",
            "continue",
            "back 10 steps",
            "send @0P",
            "continue",
            "goto start",
        ],
        &[
            "send @01",
            "send @0A5000,900",
            "continue",
            "goto 1s",
            "take",
            "press stop",
            "continue",
            "send @0P",
            "continue",
        ],
        &[
            "send @01",
            "send @0A5000,900",
            "continue",
            "goto 1s",
            "fault drop to-host once",
            "continue",
            "take",
            "send @0P",
            "continue",
        ],
    ];
    for lines in sessions {
        let mut desk = Desk::new();
        done(&mut desk)("PUT", "clock", json!({ "clock": "manual" }));
        done(&mut desk)("POST", "recording", Value::Null);
        for line in *lines {
            done(&mut desk)("POST", "debugger", json!({ "line": line }));
            let Value::String(text) = done(&mut desk)("GET", "recording", Value::Null) else {
                panic!("no text")
            };
            let played = played(&text);
            assert!(played.is_ok(), "{lines:?} up to {line}: {played:?}\n{text}");
        }
        // What was typed last has taken effect.
        let mut other = again(&mut desk);
        assert_eq!(digest(&mut other), digest(&mut desk), "{lines:?}");
        // And when the debugger is closed, too.
        done(&mut desk)("DELETE", "debugger", Value::Null);
        done(&mut desk)("POST", "clock/advance", json!({ "span": "1s" }));
        let mut other = again(&mut desk);
        assert_eq!(digest(&mut other), digest(&mut desk), "{lines:?}, closed");
        done(&mut desk)("DELETE", "debugger", Value::Null);
        let Value::String(text) = done(&mut desk)("GET", "recording", Value::Null) else {
            panic!("no text")
        };
        let played = played(&text);
        assert!(played.as_ref().is_ok_and(|bytes| *bytes > 0), "{lines:?}: {played:?}\n{text}");
    }
}

#[test]
fn what_is_typed_and_not_stepped_to_comes_when_the_debugger_is_closed() {
    let mut desk = Desk::new();
    let mut ask = done(&mut desk);
    ask("PUT", "clock", json!({ "clock": "manual" }));
    ask("POST", "recording", Value::Null);
    ask("POST", "debugger", json!({ "line": "fault drop to-host once" }));
    ask("POST", "debugger", json!({ "line": "send @01" }));
    let deeds = ask("GET", "deeds", Value::Null)["deeds"].clone();
    assert_eq!(deeds, json!([[0, "order", "fault drop to-host once"], [0, "send", "@01\r"]]));
    // Step by step, too: it is an input, and no cause.
    assert_eq!(ask("POST", "clock/step", Value::Null)["step"], "input");
    ask("DELETE", "debugger", Value::Null);
    assert_eq!(ask("GET", "faults", Value::Null).as_array().map(Vec::len), Some(1));
    ask("POST", "line", json!({ "send": "@0P\r" }));
    let Value::String(text) = ask("GET", "recording", Value::Null) else { panic!("no text") };
    assert!(text.contains(r#""fault":"drop to-host once""#), "{text}");
    assert_eq!(played(&text), Ok(19));
}

#[test]
fn a_state_that_was_put_in_by_hand_is_in_no_link() {
    let mut desk = Desk::new();
    done(&mut desk)("PUT", "clock", json!({ "clock": "manual" }));
    done(&mut desk)("POST", "line", json!({ "send": "@01\r" }));
    done(&mut desk)("POST", "snapshots", Value::Null);
    done(&mut desk)("POST", "line", json!({ "send": "@0A900,900\r" }));
    done(&mut desk)("POST", "clock/advance", json!({ "span": "2s" }));
    // To where it has been there is a way;
    done(&mut desk)("POST", "snapshots/1/restore", Value::Null);
    let deeds = done(&mut desk)("GET", "deeds", Value::Null);
    assert_eq!(deeds, json!({ "at": 0, "deeds": [[0, "send", "@01\r"]] }));
    // and to where it has never been there is none.
    done(&mut desk)("POST", "debugger", json!({ "line": "what if quirk lost_steps = false" }));
    done(&mut desk)("POST", "history/go", json!({ "branch": 2 }));
    let (status, refused) = asked(&mut desk, "GET", "/v1/controllers/1/deeds", &Value::Null);
    assert_eq!(status, 409, "{refused}");
}

#[test]
fn a_recording_of_a_line_that_takes_its_time_is_opened_stepped_and_saved() {
    let mut desk = Desk::new();
    done(&mut desk)("POST", "recording", Value::Null);
    let Value::String(text) = done(&mut desk)("GET", "recording", Value::Null) else {
        panic!("no text")
    };
    let head = text.lines().next().unwrap().replace(r#""line":"ideal""#, r#""line":"paced""#);
    let (model, machine) = (vimc4_catalogue::model("imc4"), vimc4_catalogue::machine("bench"));
    let line = Line::paced(bare(&model.unwrap(), &machine.unwrap(), &[]).unwrap());
    let state = json!({ "at": 0, "state": line.state() });
    let given = r#"{"at":0,"by":"a test","in":"@01\r@0A5000,900\r"}"#;
    let text = format!("{head}\n{state}\n{given}\n{{\"at\":2000000000,\"end\":\"a test\"}}\n");
    let (status, opened) = asked(&mut desk, "PUT", "/v1/recording", &json!({ "text": text }));
    assert_eq!((status, &opened["is_whole"]), (200, &json!(true)), "{opened}");
    // A character takes ten bits at 19,200 baud: the fourth one is there after 2.08 ms.
    let mut ask = done(&mut desk);
    let entries = ask("GET", "journal?kinds=command", Value::Null)["entries"].clone();
    assert_eq!(entries[0]["at"], 2_083_334);
    let mut debug = |line: &str| ask("POST", "debugger", json!({ "line": line }));
    // Back to where three are there, and on to the fourth.
    for line in ["goto 2ms", "assert at = 2000000", "step command", "assert at = 2083334"] {
        debug(line);
    }
    drop(ask);
    // No link, in words; a recording of all of it with what follows, which plays.
    let (status, refused) = asked(&mut desk, "GET", "/v1/controllers/1/deeds", &Value::Null);
    assert_eq!(
        (status, &refused["remedy"]),
        (409, &json!("save a recording, which has that line"))
    );
    let mut ask = done(&mut desk);
    ask("DELETE", "debugger", Value::Null);
    ask("POST", "line", json!({ "send": "@0P\r" }));
    ask("POST", "clock/resume", Value::Null);
    ask("PUT", "clock", json!({ "clock": "manual" }));
    ask("POST", "clock/run-until", json!({ "condition": "idle" }));
    ask("POST", "clock/advance", json!({ "span": "1s" }));
    let Value::String(text) = ask("GET", "recording", Value::Null) else { panic!("no text") };
    assert!(text.starts_with(r#"{"recording":1,"#) && text.contains(r#""line":"paced""#), "{text}");
    assert_eq!(played(&text), Ok(21));
}

/// A recording of one model goes on from no state of another.
#[test]
fn a_state_of_another_model_is_not_opened() {
    let limit = include_str!("../../../examples/limit.jsonl");
    let (head, rest) = limit.split_once('\n').unwrap();
    let (state, rest) = rest.split_once('\n').unwrap();
    let other = state.replacen("\"name\":\"imc4\"", "\"name\":\"imc-s8\"", 1);
    let text = format!("{head}\n{other}\n{rest}");
    let mut desk = Desk::new();
    let put =
        |desk: &mut Desk, text: &str| asked(desk, "PUT", "/v1/recording", &json!({ "text": text }));
    let (status, refused) = put(&mut desk, &text);
    let detail = "line 2: a state of imc-s8 on mill, and the first line names imc4 on mill";
    assert_eq!((status, &refused["detail"]), (422, &json!(detail)));
    assert_eq!(put(&mut desk, limit).0, 200);
}

/// No moment is looked at while the debugger is not open, and bytes that are none do nothing.
#[test]
fn what_has_nothing_to_work_on_changes_nothing() {
    let mut desk = Desk::new();
    let path = |path: &str| format!("/v1/controllers/1/{path}");
    let (status, refused) = asked(&mut desk, "POST", &path("history/take"), &json!({}));
    assert_eq!((status, &refused["detail"]), (409, &json!("the debugger is not open")));
    let (_, clock) = asked(&mut desk, "GET", &path("clock"), &Value::Null);
    assert_eq!(clock["paused"], Value::Null);
    let (_, nothing) = asked(&mut desk, "POST", &path("line"), &json!({ "send": "" }));
    assert_eq!(nothing["effect"], "nothing");
    let (status, _) = asked(&mut desk, "GET", &path("journal?limit=0"), &Value::Null);
    assert_eq!(status, 400);
}

#[test]
fn a_search_for_nothing_begins_no_branch() {
    let mut desk = Desk::new();
    let mut ask = done(&mut desk);
    ask("PUT", "clock", json!({ "clock": "manual" }));
    ask("POST", "debugger", json!({ "line": "send @01" }));
    let said = ask("POST", "debugger", json!({ "line": "next x = 9999" }))["text"].clone();
    assert!(said.as_str().unwrap().contains("not to be found"), "{said}");
    ask("POST", "debugger", json!({ "line": "send @0A1000,900" }));
    // Nothing comes from a host while it is looked at: it ends where the controller rests.
    let said = ask("POST", "debugger", json!({ "line": "continue" }))["text"].clone();
    assert!(
        said.as_str().unwrap().contains("at rest until something comes from outside"),
        "{said}"
    );
    assert_eq!(ask("GET", "history", Value::Null)["branches"].as_array().map(Vec::len), Some(1));
    assert_eq!(ask("GET", "position", Value::Null)["axes"]["X"], 1_000);
    drop(ask);
    let (status, refused) =
        asked(&mut desk, "POST", "/v1/controllers/1/debugger", &json!({ "line": "put x 5" }));
    assert_eq!((status, &refused["detail"]), (422, &json!("`put x 5` has no `=`")));
    assert_eq!(refused["remedy"], "`put x = 5` is probably meant");
}

#[test]
fn a_recording_that_contradicts_the_emulation_is_opened_as_one() {
    for text in [
        include_str!("../../../examples/overlooked.jsonl"),
        include_str!("../../../examples/limit.jsonl"),
    ] {
        let recording = Recording::read(text.as_bytes()).unwrap();
        let mut desk = Desk::new();
        let (status, opened) = asked(&mut desk, "PUT", "/v1/recording", &json!({ "text": text }));
        assert_eq!((status, &opened["differs"]), (200, &Value::Null), "{opened}");
        let history = done(&mut desk)("GET", "history", Value::Null);
        assert_eq!(history["differences"], Value::Null);
        for number in 0..100 {
            let (changed, what) = changed::changed(&recording, number);
            let text = String::from_utf8(changed.write()).unwrap();
            let body = json!({ "text": text });
            let (status, opened) = asked(&mut desk, "PUT", "/v1/recording", &body);
            assert_eq!(status, 200, "{what}: {opened}");
            let history = done(&mut desk)("GET", "history", Value::Null);
            let first = &history["differences"][0];
            assert!(opened["differs"].is_u64(), "{what}: {opened}");
            assert_eq!(first["at"], opened["differs"], "{what}: {history}");
            // While the past is looked at, too.
            let history = done(&mut desk)("POST", "history/go", json!({ "at": 0 }));
            assert_eq!(&history["differences"][0], first, "{what}: {history}");
        }
    }
}
