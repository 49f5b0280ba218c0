//! The inputs to begin with: what the sessions do, and what is in the profiles.
//!
//! The replay makes them anew each time, so that they are those of the sessions as they are now.
//! `cargo run -p vimc4-tests --bin corpus-seeds` writes them down for fuzzing.

use std::collections::{BTreeMap, BTreeSet};

use vimc4_catalogue::Family;
use vimc4_conform::fixtures;
use vimc4_conform::format::Session;
use vimc4_conform::script::Action;
use vimc4_device::OwnedInput;
use vimc4_isel::Controller as Isel;
use vimc4_isel_wire::{Dialect, Mode};
use vimc4_lpkf::Controller as Lpkf;
use vimc4_plant::Machine;

use super::operations::{Operation, Setup};
use super::{adapter, conditions, debugging, telnet, twins};
use crate::jobs;

/// An input to begin with.
#[derive(Clone, Debug)]
pub struct Seed {
    /// The target it is for.
    pub target: &'static str,
    /// What it is about; the name of its file.
    pub name: String,
    /// The input.
    pub data: Vec<u8>,
}

/// All of them.
///
/// # Panics
///
/// If a session cannot be read.
#[must_use]
pub fn seeds() -> Vec<Seed> {
    let sessions = fixtures::sessions().unwrap_or_else(|error| unreachable!("{error}"));
    let (controllers, lines) = (controllers(&sessions), lines(&sessions));
    let others = [
        job_files(),
        profiles(),
        conditions(),
        faults(),
        scenarios(),
        recordings(),
        consoles(),
        adapters(),
        ports(),
    ]
    .concat();
    [controllers, lines, flash(), others].concat()
}

/// What is typed into a console.
fn consoles() -> Vec<Seed> {
    let seed = |(number, data)| Seed { target: "console", name: format!("{number}"), data };
    debugging::lines().into_iter().enumerate().map(seed).collect()
}

/// What clients say to a debug adapter.
fn adapters() -> Vec<Seed> {
    let seed = |(number, data)| Seed { target: "adapter", name: format!("{number}"), data };
    adapter::sessions().into_iter().enumerate().map(seed).collect()
}

/// What clients say to a serial port on the network.
fn ports() -> Vec<Seed> {
    let seed = |(number, data)| Seed { target: "rfc2217", name: format!("{number}"), data };
    telnet::sessions().into_iter().enumerate().map(seed).collect()
}

/// Recordings with every line that there is.
fn recordings() -> Vec<Seed> {
    let head = r#"{"recording":1,"program":"a","family":"isel","model":{},"machine":{},"clock":"8x","line":"paced","seed":7,"from":"b","controller":"1","part":2,"began":3}"#;
    let lines = [
        r#"{"at":0,"state":{"a":[1,null]}}"#,
        r#"{"at":1,"in":"@07\r","by":"tcp: 1"}"#,
        r#"{"at":1,"out":"\u00fd0"}"#,
        r#"{"at":2,"signal":"input 0.3","value":-1,"by":""}"#,
        r#"{"at":3,"power":false}"#,
        r#"{"at":4,"wait":true,"by":"c"}"#,
        r#"{"at":2,"state":null,"by":"c"}"#,
        r#"{"at":5,"news":{"back":{"transport":"serial"}}}"#,
        r#"{"at":6,"mark":"here"}"#,
        r#"{"at":7,"end":"d"}"#,
    ];
    let seed = |name: &str, lines: &[&str]| {
        let data = format!("{head}\n{}\n", lines.join("\n")).into_bytes();
        Seed { target: "recording", name: name.to_owned(), data }
    };
    let each = lines.iter().map(|line| seed(line.get(7..14).unwrap_or_default(), &[line]));
    std::iter::once(seed("all", &lines)).chain(each).collect()
}

/// What each session does to each of its models; one of them has a history.
fn controllers(sessions: &[Session]) -> Vec<Seed> {
    let mut seeds = Vec::new();
    for (number, session) in sessions.iter().enumerate() {
        for (which, model) in session.models.iter().enumerate() {
            let (target, family, names) = match session.family {
                Family::Isel => ("controller", b'i', vimc4_isel::Model::names()),
                Family::Lpkf => ("lpkf", b'l', vimc4_lpkf::Model::names()),
            };
            let place = |names: &[&str], name: &str| names.iter().position(|known| *known == name);
            let model_place = place(&names, model).unwrap_or(0);
            let machine = place(&Machine::names(), &session.machine.name).unwrap_or(0);
            let mut setup = Setup::new(model_place, machine);
            if !session.profile.is_empty() {
                setup = setup.with_quirks(number as u8);
            }
            let scripts = match session.family {
                Family::Isel => scripts::<Isel>(session, setup),
                Family::Lpkf => scripts::<Lpkf>(session, setup),
            };
            for (row, data) in scripts.into_iter().enumerate() {
                let name = format!("{}-{model}-{row}", session.id.replace('/', "-"));
                if which == number % session.models.len() {
                    let data = [&[family], data.as_slice()].concat();
                    let walked = Seed { target: "walk", name: name.clone(), data: data.clone() };
                    // A walk is ten: half of them are more than a thousand with what is mixed.
                    seeds.extend((number % 2 == 0).then_some(walked));
                    seeds.push(Seed { target: "history", name: name.clone(), data });
                }
                seeds.push(Seed { target, name, data });
            }
        }
    }
    seeds
}

/// The operations of a session, once for each controller that it takes. Wherever time has passed
/// the state is kept and something is forecast; at the end each goes on from there once more.
fn scripts<D: twins::Family>(session: &Session, setup: Setup) -> Vec<Vec<u8>> {
    let device = D::open(setup, b"");
    let signals = device.signals();
    let mut scripts = vec![setup.encode()];
    let ways = [1, -1, 40, -40, 300, -300];
    for (number, step) in session.steps.iter().enumerate() {
        let mut then = |operation: Operation<'_>| {
            if let Some(script) = scripts.last_mut() {
                operation.encode(script);
            }
        };
        match &step.action {
            Action::Send(bytes) => then(Operation::Send(bytes)),
            Action::Control(byte) => then(Operation::Send(&[*byte])),
            Action::Expect(_) | Action::Rest => then(Operation::Rest),
            Action::Wait(nanos) | Action::Silent(nanos) => {
                then(Operation::Wait(*nanos));
                then(Operation::Snapshot);
                then(Operation::Look(number as u8, ways[number % ways.len()]));
            }
            Action::Restart => then(Operation::Restart),
            // What this controller does not have is a signal beyond its last.
            Action::Do(deed) => match deed.inputs(&signals) {
                Ok(inputs) => inputs.iter().for_each(|input| match input {
                    OwnedInput::Power(on) => then(Operation::Power(*on)),
                    OwnedInput::Signal(id, value) => {
                        let place = signals.iter().position(|signal| signal.id == *id);
                        let value = (*value).clamp(i8::MIN.into(), i8::MAX.into()) as i8;
                        then(Operation::Signal(place.unwrap_or(signals.len()) as u8, value));
                    }
                    OwnedInput::Bytes(_)
                    | OwnedInput::Fault(_)
                    | OwnedInput::Rule(_)
                    | OwnedInput::Wake => {}
                }),
                Err(_) => then(Operation::Signal(signals.len() as u8, 1)),
            },
            Action::New => scripts.push(setup.encode()),
            _ => {}
        }
    }
    for script in &mut scripts {
        for operation in [Operation::Restore, Operation::Next, Operation::Before(1)] {
            operation.encode(script);
        }
    }
    scripts
}

/// What is sent in the sessions, for what reads lines.
fn lines(sessions: &[Session]) -> Vec<Seed> {
    let sent = |session: &Session| -> Vec<u8> {
        let steps = session.steps.iter().filter_map(|step| match &step.action {
            Action::Send(bytes) => Some(bytes.as_slice()),
            _ => None,
        });
        steps.flatten().copied().collect()
    };
    let of = |family| sessions.iter().filter(move |session| session.family == family);
    let isel: BTreeSet<_> = of(Family::Isel).map(sent).collect();
    let isel = isel.into_iter().collect::<Vec<_>>().concat();
    let mut seeds = Vec::new();
    let mut add = |target, name: String, data| seeds.push(Seed { target, name, data });
    for (number, dialect) in Dialect::ALL.into_iter().enumerate() {
        for (which, mode) in Mode::ALL.into_iter().enumerate() {
            let head = [(number << 1 | which) as u8, 0x77, 0b1000];
            let name = format!("{dialect:?}-{mode:?}").to_lowercase();
            add("parser", name, [&head[..], &isel].concat());
        }
    }
    add("lexer", "lines".to_owned(), isel);
    add("lexer", "255-bytes".to_owned(), [&[b'x'; 255], &b"\r"[..]].concat());
    add("lexer", "256-bytes".to_owned(), [&[b' '; 256], &b"\r@0P\r"[..]].concat());
    for (number, session) in of(Family::Lpkf).enumerate() {
        // Of each dialect, with and without bare pairs, and written down now and then.
        let data = [vec![b'0' | number as u8 & 7], sent(session)].concat();
        add("language", session.id.replace('/', "-"), data);
    }
    seeds
}

/// Conditions with the names of every model.
fn conditions() -> Vec<Seed> {
    let seed = |(number, data): (usize, Vec<u8>)| {
        let name = format!("forms-{number}");
        Seed { target: "condition", name, data }
    };
    conditions::texts().into_iter().enumerate().map(seed).collect()
}

/// Rules, and files of rules, with the names of every model.
fn scenarios() -> Vec<Seed> {
    let seed = |(number, data): (usize, Vec<u8>)| {
        let name = format!("forms-{number}");
        Seed { target: "scenario", name, data }
    };
    conditions::scenarios().into_iter().enumerate().map(seed).collect()
}

/// Faults with the names of every model.
fn faults() -> Vec<Seed> {
    let seed = |(number, data): (usize, Vec<u8>)| {
        let name = format!("forms-{number}");
        Seed { target: "fault", name, data }
    };
    conditions::faults().into_iter().enumerate().map(seed).collect()
}

/// An image of the flash memory with lines of every kind, for each model and end.
fn flash() -> Vec<Seed> {
    let image = "vimc4 flash 1\nsettings directions=1 start_stop=200 abort=0,1,0 user_info=61\n\
                 program axes=7 speeds=900,900,900,2000\nline 0300,900,-20,900,10,900,-10,900\n\
                 line 34,-1\nline o0,3,1,0\nline 77\nline y400,2000,-50,100,0,-1,1\n";
    let mut seeds = Vec::new();
    for number in 0..vimc4_isel::Model::names().len() {
        for end in ["end speeds=900,900,900,2000", "invalid", "line e1"] {
            let data = [Setup::new(number, 0).encode(), format!("{image}{end}\n").into()].concat();
            seeds.push(Seed { target: "flash", name: format!("{number}-{end}"), data });
        }
    }
    seeds
}

/// The jobs of the fixtures, each for one model and machine.
fn job_files() -> Vec<Seed> {
    let mut programs = BTreeMap::new();
    for job in jobs::jobs().unwrap_or_default() {
        programs.entry(job.program).or_insert(job.id);
    }
    let seed = |(number, (program, id)): (usize, (Vec<u8>, String))| {
        let name = id.split("::").next().unwrap_or_default().replace('/', "-");
        Seed { target: "ncp", name, data: [vec![number as u8], program].concat() }
    };
    programs.into_iter().enumerate().map(seed).collect()
}

/// Profiles to change, and some that are whole.
fn profiles() -> Vec<Seed> {
    let seed = |name: String, data: String| Seed { target: "profiles", name, data: data.into() };
    let like =
        |name: &str, line: &str| seed(format!("like-{name}"), format!("like {name}\n{line}\n"));
    let mut seeds = Vec::new();
    seeds.extend(vimc4_isel::Model::names().into_iter().map(|name| like(name, "line_us = 1")));
    seeds.extend(vimc4_lpkf::Model::names().into_iter().map(|name| like(name, "start_ms = 7")));
    seeds.extend(Machine::names().into_iter().map(|name| like(name, "start = 7")));
    let whole = [
        vimc4_isel::Model::builtin_toml("imc4"),
        vimc4_lpkf::Model::builtin_toml("motionsystem"),
        Machine::builtin_toml("mill-4axis"),
        Machine::builtin_toml("positioner"),
    ];
    for text in whole.into_iter().flatten() {
        let name = text.lines().find_map(|line| line.strip_prefix("name = "));
        seeds.push(seed(name.unwrap_or_default().trim_matches('"').to_owned(), text.to_owned()));
    }
    seeds
}
