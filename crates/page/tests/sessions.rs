//! The controllers of a page do what the others do: every session of the fixtures is played by the native
//! controller, recorded, and opened at the page's desk, which has to send the same bytes at the same
//! times. What was recorded is left for `web/tests/desk.test.mjs`, which asks the same of the WebAssembly.

#![expect(clippy::disallowed_methods, reason = "what was recorded is left in a file")]
#![expect(clippy::expect_used, reason = "a test that cannot read or write its files has failed")]

use std::cell::RefCell;
use std::fmt::Write as _;
use std::rc::Rc;

use serde_json::{Value, json};
use vimc4_catalogue::{Controller, Details, State};
use vimc4_conform::fixtures;
use vimc4_conform::format::Session;
use vimc4_conform::play::{Drive, play};
use vimc4_conform::workshop::Workshop;
use vimc4_device::{
    Activity, Device, Fact, Fault, FaultView, Input, Kinds, Line, LineState, Names, Output, Point,
    RuleView, Running, Signal, SignalId, Time, View,
};
use vimc4_page::Desk;
use vimc4_timeline::recording::{Entry, Given, Head, LineSort, VERSION, What};

/// What went into a controller and came out of it.
#[derive(Debug)]
struct Tape {
    /// As a recording.
    lines: Vec<u8>,
    sent: Vec<(Time, Vec<u8>)>,
    last: Time,
}

/// A controller that is recorded.
struct Taped {
    line: Line<Controller>,
    names: Names,
    tape: Rc<RefCell<Tape>>,
}

impl Device for Taped {
    type State = LineState<State>;
    type Details = Details;

    fn perform(&mut self, at: Time) -> bool {
        let has_done = self.line.perform(at);
        let mut tape = self.tape.borrow_mut();
        tape.last = tape.last.max(self.line.now());
        has_done
    }

    fn accept(&mut self, input: Input<'_>, at: Time) {
        let mut tape = self.tape.borrow_mut();
        tape.last = tape.last.max(at);
        if !matches!(input, Input::Wake | Input::Bytes([])) {
            let given = Given::of(&input.into(), || self.names.clone());
            Entry::new(at, What::Given { by: "a session".into(), given }).put(&mut tape.lines);
        }
        drop(tape);
        self.line.accept(input, at);
    }

    fn poll_output(&mut self) -> Option<Output> {
        let output = self.line.poll_output();
        if let Some(Output::Bytes(at, bytes)) = &output {
            let mut tape = self.tape.borrow_mut();
            match tape.sent.last_mut() {
                Some((last, piece)) if last == at => piece.extend_from_slice(bytes),
                _ => tape.sent.push((*at, bytes.to_vec())),
            }
        }
        output
    }

    fn watch(&mut self, kinds: Kinds) -> Kinds {
        self.line.watch(kinds)
    }

    fn state(&self) -> Self::State {
        self.line.state()
    }

    fn restore(&mut self, state: Self::State) {
        self.line.restore(state);
    }

    fn now(&self) -> Time {
        self.line.now()
    }

    fn wake(&self) -> Option<Time> {
        self.line.wake()
    }

    fn view(&self, at: Time) -> View<Details> {
        self.line.view(at)
    }

    fn activity(&self) -> Activity {
        self.line.activity()
    }

    fn details(&self) -> Details {
        self.line.details()
    }

    fn position(&self, at: Time) -> Point {
        self.line.position(at)
    }

    fn reach(&self) -> (Point, Point) {
        self.line.reach()
    }

    fn running(&self) -> Option<Running<'_>> {
        self.line.running()
    }

    fn signals(&self) -> Vec<Signal> {
        self.line.signals()
    }

    fn baud(&self) -> u32 {
        self.line.baud()
    }

    fn room(&self, handshake: bool) -> usize {
        self.line.room(handshake)
    }

    fn flash_image(&self) -> Vec<u8> {
        self.line.flash_image()
    }

    fn explain(&self, command: &[u8]) -> String {
        self.line.explain(command)
    }

    fn is_urgent(&self, byte: u8) -> bool {
        self.line.is_urgent(byte)
    }

    fn why_without_effect(&self, signal: SignalId, value: i32) -> Option<&'static str> {
        self.line.why_without_effect(signal, value)
    }

    fn why_in_vain(&self, fault: &Fault) -> Option<&'static str> {
        self.line.why_in_vain(fault)
    }

    fn faults(&self) -> Vec<FaultView> {
        self.line.faults()
    }

    fn rules(&self) -> Vec<RuleView> {
        self.line.rules()
    }

    fn is_idle(&self) -> bool {
        self.line.is_idle()
    }

    fn first_time(&self, fact: &Fact, from: Time) -> Option<Time> {
        self.line.first_time(fact, from)
    }

    fn comes_round(&self, from: Time) -> Option<Time> {
        self.line.comes_round(from)
    }
}

/// Plays a session on a model: a recording of each controller that it needs, and what that sent.
fn recorded(session: &Session, model: &str) -> Result<Vec<(String, Value)>, String> {
    let workshop = Workshop::new(session, model)?;
    let tapes = RefCell::new(Vec::new());
    let build = |flash: &[u8]| {
        let controller = workshop.build(flash)?;
        let (line, sort) = match session.line_pacing {
            true => (Line::paced(controller), LineSort::Paced),
            false => (Line::ideal(controller), LineSort::Ideal),
        };
        let mut lines = Vec::new();
        head(&workshop, sort).put(&mut lines);
        let state = serde_json::to_value(line.state()).map_err(|error| error.to_string())?;
        Entry::new(line.now(), What::State { by: None, state }).put(&mut lines);
        let tape = Rc::new(RefCell::new(Tape { lines, sent: Vec::new(), last: line.now() }));
        tapes.borrow_mut().push(Rc::clone(&tape));
        let names = Names::of(&line);
        Ok(Taped { line, names, tape })
    };
    play(session, Drive::Smooth, build).map_err(|failure| failure.to_string())?;
    let tapes = tapes.into_inner().into_iter().map(|tape| {
        let mut tape = tape.borrow_mut();
        let last = tape.last;
        Entry::new(last, What::End("the session is over".to_owned())).put(&mut tape.lines);
        let sent = tape.sent.iter().map(|(at, bytes)| {
            json!([at, bytes.iter().map(|byte| char::from(*byte)).collect::<String>()])
        });
        let sent = sent.collect();
        (String::from_utf8_lossy(&tape.lines).into_owned(), sent)
    });
    Ok(tapes.collect())
}

fn head(workshop: &Workshop, line: LineSort) -> Head {
    Head {
        recording: VERSION,
        program: "a test".to_owned(),
        family: workshop.model().family().name().to_owned(),
        model: serde_json::to_value(workshop.model()).expect("a profile"),
        machine: serde_json::to_value(workshop.machine()).expect("a profile"),
        clock: "manual".to_owned(),
        line,
        seed: None,
        from: "a session".to_owned(),
        controller: String::new(),
        part: 1,
        began: None,
    }
}

/// What the desk sends when it opens a recording.
fn sent_by(desk: &mut Desk, recording: &str) -> Result<Value, String> {
    let body = json!({ "text": recording }).to_string();
    let reply = desk.ask("PUT", "/v1/recording", &body, 0.0);
    if reply.status != 200 {
        return Err(reply.body);
    }
    let messages: Vec<Value> =
        serde_json::from_str(&desk.hear(0.0)).map_err(|error| error.to_string())?;
    let sent = messages.iter().filter(|message| message["type"] == "sent");
    Ok(sent.map(|message| json!([message["at"], message["send"]])).collect())
}

#[test]
fn the_desk_of_a_page_sends_what_every_session_sends() {
    let (mut desk, mut file, mut wrong, mut played) =
        (Desk::new(), String::new(), String::new(), 0);
    for session in fixtures::sessions().expect("the fixtures") {
        for model in &session.models {
            let name = format!("{}::{model}", session.id);
            let tapes = match recorded(&session, model) {
                Ok(tapes) => tapes,
                Err(why) => {
                    let _ = writeln!(wrong, "{name}: {why}");
                    continue;
                }
            };
            for (recording, sent) in tapes {
                played += 1;
                // The desk does the same on every model; the module, which is faster, is asked for all.
                if session.models.first() == Some(model) {
                    match sent_by(&mut desk, &recording) {
                        Ok(same) if same == sent => {}
                        Ok(other) => _ = writeln!(wrong, "{name}: {other} instead of {sent}"),
                        Err(why) => _ = writeln!(wrong, "{name}: {why}"),
                    }
                }
                let line = json!({ "name": name, "recording": recording, "sent": sent });
                let _ = writeln!(file, "{line}");
            }
        }
    }
    std::fs::write(concat!(env!("CARGO_TARGET_TMPDIR"), "/page-sessions.jsonl"), file)
        .expect("a folder for what tests leave");
    assert!(wrong.is_empty(), "{} of {played}:\n{wrong}", wrong.lines().count());
    assert!(played > 500, "only {played} were played");
}
