//! What the sessions leave out: every reply that a command can give, every kind of line a program
//! can have and every signal must be in one of them.

#![expect(clippy::expect_used, clippy::panic, reason = "what cannot be read fails the test")]

use std::collections::BTreeMap;
use std::sync::LazyLock;

use vimc4_conform::fixtures;
use vimc4_conform::format::MODELS;
use vimc4_conform::play::{Drive, Record, play};
use vimc4_conform::workshop::Workshop;
use vimc4_device::Device;
use vimc4_isel::Model;
use vimc4_isel_wire::{Mode, Reply, table};

#[test]
fn every_reply_of_every_command_has_a_session() {
    let records = &*RECORDS;
    let mut missing = Vec::new();
    for (name, record) in records {
        let dialect = Model::builtin(name).expect("a built-in model").command_set.dialect();
        for mode in Mode::ALL {
            for spec in table(dialect, mode) {
                for reply in spec.replies {
                    // A malformed line is no command's.
                    let malformed = *reply == Reply::Syntax;
                    let mnemonic = if malformed { "?" } else { spec.mnemonic };
                    if !record.answers.contains(&(mnemonic, reply.code())) {
                        missing.push(format!("{name}: {} never answered {reply}", spec.mnemonic));
                    }
                }
                if mode == Mode::Stored
                    && spec.mnemonic != "9"
                    && !record.lines.contains(spec.mnemonic)
                {
                    missing.push(format!("{name}: a stored {} never ran", spec.mnemonic));
                }
            }
        }
    }
    for reply in Reply::ALL {
        if !records.values().any(|r| r.answers.iter().any(|(_, code)| *code == reply.code())) {
            missing.push(format!("no model ever answered {reply}"));
        }
    }
    assert!(missing.is_empty(), "no session for\n  {}", missing.join("\n  "));
}

#[test]
fn every_reply_is_one_the_table_knows() {
    let mut unknown = Vec::new();
    for (name, record) in &*RECORDS {
        let dialect = Model::builtin(name).expect("a built-in model").command_set.dialect();
        for &(mnemonic, code) in &record.answers {
            let specs = Mode::ALL.into_iter().flat_map(|mode| table(dialect, mode));
            let Some(spec) = specs.into_iter().find(|spec| spec.mnemonic == mnemonic) else {
                continue; // A line that is no command, answered 5 or 8.
            };
            if !spec.replies.iter().any(|reply| reply.code() == code) {
                unknown.push(format!("{name}: {mnemonic} answered {}", char::from(code)));
            }
        }
    }
    assert!(unknown.is_empty(), "not in the tables of isel-wire\n  {}", unknown.join("\n  "));
}

#[test]
fn every_signal_has_a_session() {
    let mut missing = Vec::new();
    for (name, record) in &*RECORDS {
        let model = Model::builtin(name).expect("a built-in model");
        let machine = vimc4_plant::Machine::builtin("bench").expect("a built-in machine");
        let device = vimc4_isel::Controller::new(model, machine, &[]).expect("a controller");
        for signal in device.signals() {
            if !record.signals.contains(&signal.name) {
                missing.push(format!("{name}: {}", signal.name));
            }
        }
    }
    assert!(missing.is_empty(), "never set\n  {}", missing.join("\n  "));
}

/// What all sessions together have shown of each model.
static RECORDS: LazyLock<BTreeMap<&'static str, Record>> = LazyLock::new(records);

/// Plays all sessions. One that fails is reported by the test that is named after it.
fn records() -> BTreeMap<&'static str, Record> {
    let mut records: BTreeMap<_, _> =
        MODELS.into_iter().map(|model| (model, Record::default())).collect();
    for session in fixtures::sessions().unwrap_or_else(|error| panic!("{error}")) {
        for model in &session.models {
            let workshop = Workshop::new(&session, model).expect("profiles that can be");
            let Ok((record, _)) = play(&session, Drive::Smooth, |flash| workshop.build(flash))
            else {
                continue;
            };
            let all = records.entry(*model).or_default();
            all.answers.extend(record.answers);
            all.lines.extend(record.lines);
            all.signals.extend(record.signals);
        }
    }
    records
}
