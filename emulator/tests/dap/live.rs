//! Controllers behind ports, which host software drives while an editor steps.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::Command;
use std::time::Duration;

use serde_json::{Value, json};

use crate::drilling;
use crate::editor::Editor;
use crate::process::limits::{InTime, LIMIT, until};
use crate::process::{Process, VIMC4, connect, tcp};

fn behind_a_port() -> Value {
    json!({ "serve": true, "pty": "none", "tcp": "127.0.0.1:0", "machine": "mill", "time": "8x" })
}

/// A client of a controller.
struct Host(TcpStream);

impl Host {
    /// Connects to where an editor was told that a controller is.
    fn of(editor: &mut Editor) -> Host {
        loop {
            let output = editor.event("output")["output"].as_str().unwrap().to_owned();
            let address = output.lines().find_map(|line| line.strip_prefix("tcp "));
            if let Some(address) = address {
                return Host::at(address);
            }
        }
    }

    fn at(address: &str) -> Host {
        Host(connect(address))
    }

    fn send(&mut self, line: &str) {
        self.0.write_all(line.as_bytes()).unwrap();
    }

    fn receive(&mut self, count: usize) -> String {
        let mut answer = vec![0; count];
        self.0.read_exact(&mut answer).unwrap();
        String::from_utf8(answer).unwrap()
    }

    /// Whether nothing is answered for a while.
    fn is_silent(&mut self) -> bool {
        self.0.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
        let is_silent = self.0.read_exact(&mut [0]).is_err();
        self.0.set_read_timeout(Some(LIMIT)).unwrap();
        is_silent
    }
}

fn functions(editor: &mut Editor, names: &[&str]) {
    let breakpoints: Vec<Value> = names.iter().map(|name| json!({ "name": name })).collect();
    let set = editor.ask("setFunctionBreakpoints", json!({ "breakpoints": breakpoints }));
    for breakpoint in set["breakpoints"].as_array().unwrap() {
        assert_eq!(breakpoint["verified"], true, "{breakpoint}");
    }
}

#[test]
fn host_software_drives_while_an_editor_steps() {
    for clock in ["real", "8x", "instant"] {
        let mut configuration = behind_a_port();
        configuration["time"] = clock.into();
        let mut editor = Editor::at_entry(configuration);
        let mut host = Host::of(&mut editor);
        functions(&mut editor, &["z < -100"]);
        host.send("@07\r@0A400,4000,0,900,-200,900,0,900\r@0P\r");
        // The breakpoint holds the controller's time in the middle of the move, and not the client.
        let stop = editor.walk("continue");
        assert_eq!(stop["reason"], "function breakpoint", "{clock}: {stop}");
        assert_eq!(editor.value("z"), "-101");
        assert_eq!(host.receive(1), "0");
        assert!(host.is_silent(), "nothing is answered while it is held");
        assert!(editor.stack()[0].1.contains("@0A400"), "{:?}", editor.stack());
        // Whoever steps leads the controller: the client gets its answers, once.
        functions(&mut editor, &[]);
        editor.steps("stepIn", "instruction");
        assert_eq!(editor.value("z"), "-102");
        assert_eq!(editor.walk("next")["reason"], "step");
        assert!(editor.stack()[0].1.contains("@0P"), "{:?}", editor.stack());
        assert_eq!(host.receive(20), "00000190000000FFFF38");
        // Whoever goes back only looks, and comes forward again.
        assert_eq!(editor.walk("stepBack")["reason"], "step");
        assert!(editor.stack()[0].1.contains("@0A400"), "{:?}", editor.stack());
        editor.walk("reverseContinue");
        assert_eq!(editor.value("x"), "0");
        assert!(host.is_silent(), "looking back is nothing to the client");
        functions(&mut editor, &["z < -150"]);
        editor.walk("continue");
        assert_eq!(editor.value("z"), "-151");
        functions(&mut editor, &[]);
        editor.ask("continue", json!({ "threadId": 1 }));
        host.send("@0P\r");
        assert_eq!(host.receive(19), "0000190000000FFFF38");
        editor.ask("pause", json!({ "threadId": 1 }));
        assert_eq!(editor.event("stopped")["reason"], "pause");
        assert_eq!(editor.value("x"), "400");
        editor.disconnect();
    }
}

#[test]
fn a_step_at_rest_waits_for_what_host_software_sends_next() {
    let mut editor = Editor::at_entry(behind_a_port());
    let mut host = Host::of(&mut editor);
    editor.ask("next", json!({ "threadId": 1 }));
    host.send("@07\r");
    assert_eq!(editor.event("stopped")["reason"], "step");
    assert!(editor.stack()[0].1.contains("@07"), "{:?}", editor.stack());
    // What answers it ends with the next step, which waits again.
    editor.ask("next", json!({ "threadId": 1 }));
    assert_eq!(host.receive(1), "0");
    let refused = editor.refused("stackTrace", json!({ "threadId": 1 }));
    assert!(refused.contains("pause comes first"), "{refused}");
    editor.ask("pause", json!({ "threadId": 1 }));
    assert_eq!(editor.event("stopped")["reason"], "pause");
    // None of the breakpoints that it waited with is left.
    assert_eq!(editor.console("breakpoints"), "there are no breakpoints");
    editor.disconnect();
}

#[test]
fn a_running_controller_heeds_breakpoints_and_the_panel() {
    let mut editor = Editor::at_entry(behind_a_port());
    let mut host = Host::of(&mut editor);
    editor.ask("continue", json!({ "threadId": 1 }));
    host.send("@07\r");
    assert_eq!(host.receive(1), "0");
    functions(&mut editor, &["@0A", "x > 300"]);
    host.send("@0A4000,900,0,900,0,900,0,900\r");
    let stop = editor.event("stopped");
    assert_eq!(stop["reason"], "function breakpoint", "{stop}");
    editor.walk("continue");
    assert_eq!(editor.value("x"), "301");
    // In the middle of the move somebody presses STOP, where it stands and while it runs.
    editor.ask("continue", json!({ "threadId": 1 }));
    editor.console("press stop");
    assert_eq!(host.receive(1), "F");
    editor.ask("pause", json!({ "threadId": 1 }));
    editor.event("stopped");
    let stands: i64 = editor.value("x").parse().unwrap();
    assert!((301..4000).contains(&stands), "{stands}");
    // A switch that is set while it is paused is set at the machine.
    let signals = editor.scope("Signals");
    editor.ask(
        "setVariable",
        json!({ "variablesReference": signals, "name": "estop", "value": "1" }),
    );
    editor.ask("continue", json!({ "threadId": 1 }));
    host.send("@0A5,900,0,900,0,900,0,900\r");
    assert_eq!(host.receive(1), "9");
    editor.disconnect();
}

#[test]
fn what_is_done_in_the_past_is_looked_at_until_the_controller_is_taken_there() {
    let mut editor = Editor::at_entry(behind_a_port());
    let mut host = Host::of(&mut editor);
    host.send("@07\r@0A400,900,0,900,0,900,0,900\r");
    editor.console("continue 2s");
    assert_eq!(editor.event("stopped")["text"], "the time has come");
    assert_eq!(host.receive(2), "00");
    editor.console("last x = 100");
    editor.event("stopped");
    editor.console("press stop");
    let told = editor.event("output")["output"].as_str().unwrap().to_owned();
    assert!(told.contains("the controller itself stays") && told.contains("`take`"), "{told}");
    editor.event("stopped");
    assert!(host.is_silent());
    let taken = editor.console("take");
    assert!(taken.starts_with("the controller is at"), "{taken}");
    editor.event("stopped");
    editor.ask("continue", json!({ "threadId": 1 }));
    assert_eq!(host.receive(1), "F");
    editor.disconnect();
}

#[test]
fn one_is_held_and_the_other_runs_and_a_restart_begins_anew() {
    let mut configuration = behind_a_port();
    configuration["controllers"] = json!([{ "name": "left" }, { "name": "right" }]);
    configuration["stopOnEntry"] = true.into();
    let mut editor = Editor::new();
    editor.ask("launch", configuration);
    let mut hosts = [Host::of(&mut editor), Host::of(&mut editor)];
    editor.ask("configurationDone", json!({}));
    for thread in [1, 2] {
        assert_eq!(editor.event("stopped")["threadId"], thread);
    }
    let threads = editor.ask("threads", json!({}));
    assert_eq!(
        threads["threads"],
        json!([{ "id": 1, "name": "left" }, { "id": 2, "name": "right" }])
    );
    editor.ask("continue", json!({ "threadId": 2 }));
    for host in &mut hosts {
        host.send("@07\r");
    }
    assert_eq!(hosts[1].receive(1), "0");
    assert!(hosts[0].is_silent());
    editor.ask("continue", json!({ "threadId": 1 }));
    assert_eq!(hosts[0].receive(1), "0");
    // The ports of those before are free again, so they can have the same ones.
    editor.ask("restart", json!({}));
    let mut host = Host::of(&mut editor);
    editor.event("stopped");
    editor.ask("continue", json!({ "threadId": 1 }));
    host.send("@07\r");
    assert_eq!(host.receive(1), "0");
    assert_eq!(hosts[0].0.read(&mut [0]).unwrap_or(0), 0, "those before have ended");
    editor.ask("terminate", json!({}));
    editor.event("terminated");
    assert_eq!(host.0.read(&mut [0]).unwrap_or(0), 0, "it has ended");
    editor.disconnect();
}

#[test]
fn an_editor_attaches_to_controllers_that_run_and_leaves_them_running() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        ["--machine", "mill", "--pty", "none", "--count", "2", "--time", "8x", "--dap", "0"];
    let (_serve, ready) = Process::serve(folder.path(), &arguments);
    let dap = ready["dap"].as_str().unwrap();
    let mut host = Host::at(tcp(&ready, 0));
    host.send("@07\r@0A400,900,0,900,0,900,0,900\r");
    assert_eq!(host.receive(2), "00");
    let mut editor = Editor::at_port(dap).introduced();
    editor.ask("attach", json!({ "stopOnEntry": true }));
    functions(&mut editor, &["x > 450"]);
    editor.ask("configurationDone", json!({}));
    for thread in [1, 2] {
        let stop = editor.event("stopped");
        assert_eq!((&stop["reason"], &stop["threadId"]), (&"entry".into(), &json!(thread)));
    }
    assert_eq!(editor.ask("threads", json!({}))["threads"][1]["name"], "2");
    assert_eq!(editor.value("x"), "400");
    // They are its alone, until it goes.
    let mut second = Editor::at_port(dap).introduced();
    let refused = second.refused("attach", json!({}));
    assert!(refused.contains("another editor has attached"), "{refused}");
    editor.ask("continue", json!({ "threadId": 1 }));
    host.send("@0A100,900,0,900,0,900,0,900\r");
    let stop = editor.event("stopped");
    assert_eq!(stop["reason"], "function breakpoint");
    assert_eq!(editor.value("x"), "451");
    assert!(host.is_silent());
    editor.ask("disconnect", json!({}));
    // It goes on where it was held, and no breakpoint of the editor is left.
    assert_eq!(host.receive(1), "0");
    host.send("@0A-100,900,0,900,0,900,0,900\r@0A100,900,0,900,0,900,0,900\r@0P\r");
    assert_eq!(host.receive(21), "0000001F4000000000000");
    // Somebody else may have one of them now; a client that vanishes leaves it running, too.
    until("the first editor is gone", || {
        let attached = second.try_to("attach", json!({ "controllers": [{ "name": "2" }] }));
        attached.inspect_err(|why| assert!(why.contains("another editor"), "{why}")).is_ok()
    });
    second.ask("configurationDone", json!({}));
    assert_eq!(second.ask("threads", json!({}))["threads"].as_array().unwrap().len(), 1);
    host.send("@0P\r");
    assert_eq!(host.receive(19), "00001F4000000000000");
    drop(second);
}

/// At the top level and within `controllers`.
#[test]
fn controllers_that_run_already_are_as_they_were_started() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--pty", "none", "--count", "2", "--time", "8x", "--dap", "0"];
    let (_serve, ready) = Process::serve(folder.path(), &arguments);
    let mut editor = Editor::at_port(ready["dap"].as_str().unwrap()).introduced();
    for (attribute, value) in [
        ("model", json!("imc4")),
        ("machine", json!("mill")),
        ("time", json!("instant")),
        ("quirks", json!({ "x": 1 })),
        ("jobOptions", json!(["--no-ref"])),
    ] {
        let mut entry = json!({ "name": "2" });
        entry[attribute] = value.clone();
        let mut whole = json!({});
        whole[attribute] = value;
        let within = editor.refused("attach", json!({ "controllers": [entry] }));
        let words = match attribute {
            "jobOptions" => "`jobOptions` belongs to a program and means nothing for a controller ",
            _ => "a controller that runs already has its own model, machine, time and quirks; ",
        };
        assert!(within.starts_with(&format!("controller 2: {words}")), "{within}");
        let whole = editor.refused("attach", whole);
        assert!(whole.starts_with(words), "{whole}");
    }
    // Without a name it is not clear which is meant, and one is attached to once.
    for (list, words) in [
        (json!([{}]), "controller 1 of the list: it says which controller it is, by its `name`"),
        (json!([{ "name": "1" }, { "nam": "2" }]), "controller 2 of the list: it says which"),
        (json!([{ "name": null }]), "controller 1 of the list: it says which controller it is"),
        (json!([{ "name": "1" }, { "name": "1" }]), "two entries are about controller 1; "),
    ] {
        let refused = editor.refused("attach", json!({ "controllers": list }));
        assert!(refused.starts_with(words), "{refused}");
    }
    // What is perhaps meant is not suggested where it is refused.
    editor.events.clear();
    editor.ask("attach", json!({ "controllers": [{ "name": "2", "machin": "mill" }] }));
    let said = editor.event("output")["output"].to_string();
    assert!(said.contains("`machin` means nothing here; nor would `machine`: "), "{said}");
}

#[test]
fn what_cannot_be_behind_ports_is_refused() {
    let both = json!({ "serve": true, "program": drilling()["program"] });
    let manual = json!({ "serve": true, "time": "manual" });
    let clock = json!({ "serve": true, "time": "fast" });
    let model = json!({ "serve": true, "model": "nothing" });
    for (request, arguments, wanted) in [
        ("launch", both, "`serve` goes without `program`"),
        ("launch", manual, "moved by hand"),
        ("launch", clock, "`fast` is not a clock"),
        ("launch", model, "nothing"),
        ("attach", json!({}), "vimc4 serve --dap PORT"),
        ("attach", json!({ "serve": true }), "launch opens a program"),
    ] {
        let mut editor = Editor::new();
        let refused = editor.refused(request, arguments.clone());
        assert!(refused.contains(wanted), "{arguments}: {refused}");
    }
    let serve = Command::new(VIMC4)
        .args(["serve", "--dap", "0", "--time", "manual", "--pty", "none", "--tcp", "none"])
        .output_in_time()
        .unwrap();
    assert_eq!(serve.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&serve.stderr).contains("moved by hand"));
}
