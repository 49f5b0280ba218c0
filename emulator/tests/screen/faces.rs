//! One walk by every face of the debugger: a stop, two steps back, a branch with the emergency stop
//! pressed, and back to the stop. At the same points each has the same state, as a whole; and what the full
//! screen shows there is what the manual shows.

use std::fs;
use std::io::Write;
use std::process::Stdio;

use libtest_mimic::Failed;
use serde_json::json;
use vimc4_catalogue::{bare, machine, model};
use vimc4_debug::{Debugger, Depth, Feed, Options, Piece, Trigger, Unit, Way, uninterrupted as on};
use vimc4_device::Input;
use vimc4_language::read_condition;

use crate::editor::Editor;
use crate::process::limits::{EndsInTime, InTime};
use crate::process::vimc4;
use crate::tmux::{Tmux, root};

const LIST: &str = "examples/commands.txt";
const MANUAL: &str = "docs/console.md";

/// The points of the walk, as the manual calls them.
const POINTS: [&str; 5] =
    ["A stop", "Two steps back", "On the way", "A branch with E-stop pressed", "And back"];

/// The digest of the whole state at each of the points.
type States = Vec<String>;

pub(crate) fn every_face_shows_the_same_state() -> Result<(), Failed> {
    let library = by_library()?;
    // It is one walk: it comes back to where it was, and is elsewhere in between.
    assert_eq!(library[0], library[4]);
    let mut others = library[..4].to_vec();
    others.sort();
    others.dedup();
    assert_eq!(others.len(), 4, "{library:?}");
    for (face, states) in [("script", by_script()?), ("DAP", by_dap()), ("screen", by_screen()?)] {
        assert_eq!(states, library, "{face}: {POINTS:?}");
    }
    Ok(())
}

/// What the library does is written as a program.
fn by_library() -> Result<States, Failed> {
    let (model, mill) = (model("imc4")?, machine("mill")?);
    let list = fs::read_to_string(root().join(LIST))?;
    let lines = list.lines().map(str::trim).filter(|line| line.starts_with('@'));
    let pieces = lines.map(|line| Piece::Send(format!("{line}\r").into_bytes())).collect();
    let mut debugger =
        Debugger::new(bare(&model, &mill, &[])?).with_feed(Feed::new(pieces).until_error());
    let mut states = Vec::new();
    let mut keep = |debugger: &Debugger| states.push(format!("{:016x}", debugger.digest()));
    let command = read_condition("command @A", debugger.names())?;
    debugger.add_breakpoint(Trigger::Condition(command), Options::default());
    debugger.go(Way::Forward, None, &mut on);
    keep(&debugger);
    let stop = debugger.place();
    debugger.step(Unit::Command, Way::Back, Depth::Into, 2, &mut on);
    keep(&debugger);
    let place = read_condition("x = 800", debugger.names())?;
    debugger.seek(&place, Way::Forward, &mut on);
    keep(&debugger);
    let signals = debugger.names().signals();
    let estop = signals.iter().find(|signal| signal.name == "estop").ok_or("no estop")?.id;
    debugger.give(Input::Signal(estop, 1));
    debugger.go(Way::Forward, None, &mut on);
    keep(&debugger);
    debugger.go_to(stop)?;
    keep(&debugger);
    Ok(states)
}

/// The line console carries out a script.
fn by_script() -> Result<States, Failed> {
    let keep = "digest\n";
    let script = format!(
        "break command @A\ncontinue\n{keep}mark stop\nback 2 commands\n{keep}next x = 800\n{keep}\
         press estop\ncontinue\n{keep}goto stop\n{keep}"
    );
    let arguments = ["console", LIST, "--machine", "mill", "--script", "-"];
    let mut child = vimc4(&root(), &arguments).stdin(Stdio::piped()).start()?;
    child.stdin.take().unwrap().write_all(script.as_bytes())?;
    let output = child.output_in_time()?;
    let out = String::from_utf8(output.stdout)?;
    assert!(output.status.success(), "{out}{}", String::from_utf8_lossy(&output.stderr));
    let states = out.split("> digest\n").skip(1);
    Ok(states.map(|rest| rest.lines().next().unwrap().to_owned()).collect())
}

/// An editor asks for steps, and types at its console what it has no button for.
fn by_dap() -> States {
    let list = fs::canonicalize(root().join(LIST)).unwrap();
    let mut editor = Editor::at_entry(json!({ "program": list, "machine": "mill" }));
    editor.ask("setExceptionBreakpoints", json!({ "filters": [] }));
    let function = json!({ "breakpoints": [{ "name": "command @A" }] });
    editor.ask("setFunctionBreakpoints", function);
    let mut states = Vec::new();
    let mut keep = |editor: &mut Editor| states.push(editor.console("digest"));
    assert_eq!(editor.walk("continue")["reason"], "function breakpoint");
    keep(&mut editor);
    editor.console("mark stop");
    editor.walk("stepBack");
    editor.walk("stepBack");
    keep(&mut editor);
    editor.console("next x = 800");
    editor.event("stopped");
    keep(&mut editor);
    let estop = json!({ "expression": "signals.estop", "value": "1" });
    editor.ask("setExpression", estop);
    editor.walk("continue");
    keep(&mut editor);
    editor.console("goto stop");
    editor.event("stopped");
    keep(&mut editor);
    editor.disconnect();
    states
}

/// Keys are pressed in the full screen, and at each point `seen` is called with what is seen there.
fn walk(tmux: &Tmux, mut seen: impl FnMut(String)) {
    tmux.console("examples/commands.txt --machine mill");
    tmux.command(":break command @A");
    tmux.wait_for("breakpoint 1: command @A");
    tmux.type_("c");
    let mut seen = |what: &str, is_there: &dyn Fn(&str) -> bool| {
        tmux.wait(what, is_there);
        // It is drawn from top to bottom.
        let mut last = String::new();
        seen(tmux.wait(what, |screen| std::mem::replace(&mut last, screen.to_owned()) == screen));
    };
    seen("the stop", &|screen| screen.contains("breakpoint 1, #5"));
    tmux.command(":mark stop");
    tmux.press(&["Left", "Left"]);
    seen("two steps back", &|screen| top(screen).contains("#3 @0R7"));
    tmux.command(":next x = 800");
    seen("X        800", &|screen| screen.contains("X        800"));
    tmux.type_("E");
    tmux.wait_for("> press estop");
    tmux.type_("c");
    seen("E estop PRESSED", &|screen| screen.contains("E estop PRESSED"));
    tmux.command(":goto stop");
    seen("here, #5", &|screen| screen.contains("here, #5"));
    tmux.type_("q");
    tmux.wait_for("ended 0");
}

/// Once for the screens as they are, which are held against the manual, and once for the states.
fn by_screen() -> Result<States, Failed> {
    let tmux = Tmux::start(80, 24);
    let mut shown = Vec::new();
    walk(&tmux, |screen| shown.push(screen));
    hold_against_the_manual(&shown)?;
    let tmux = Tmux::start(80, 24);
    let mut states: States = Vec::new();
    walk(&tmux, |_| {
        tmux.command(":digest");
        let screen = tmux.wait("the digest", |screen| digest(screen).is_some());
        states.push(digest(&screen).unwrap());
    });
    Ok(states)
}

fn top(screen: &str) -> &str {
    screen.lines().next().unwrap_or_default()
}

/// The digest that was answered last.
fn digest(screen: &str) -> Option<String> {
    let mut rows = screen.lines().map(str::trim).skip_while(|row| *row != "> digest").skip(1);
    let is_digest = |row: &&str| row.len() == 16 && row.chars().all(|c| c.is_ascii_hexdigit());
    rows.next().filter(is_digest).map(str::to_owned)
}

/// The manual has every screen, cell by cell.
fn hold_against_the_manual(shown: &[String]) -> Result<(), Failed> {
    let path = root().join(MANUAL);
    let mut manual = fs::read_to_string(&path)?;
    for (point, screen) in POINTS.iter().zip(shown) {
        let rows: Vec<&str> = screen.lines().map(str::trim_end).collect();
        let screen = rows.join("\n").trim_end().to_owned();
        let heading = format!("\n**{point}**");
        let (before, rest) =
            manual.split_once(&heading).unwrap_or_else(|| panic!("{MANUAL} has no {point}"));
        let (about, rest) = rest.split_once("```screen\n").unwrap();
        let (kept, after) = rest.split_once("\n```").unwrap();
        if std::env::var_os("VIMC4_WRITE").is_some() {
            manual = format!("{before}{heading}{about}```screen\n{screen}\n```{after}");
            continue;
        }
        assert_eq!(kept, screen, "{MANUAL} is to show at {point}:\n{screen}");
    }
    if std::env::var_os("VIMC4_WRITE").is_some() {
        fs::write(path, manual)?;
    }
    Ok(())
}
