//! What the sessions leave out: every reply that a command can give, every kind of line a program
//! can have, every form of a command, every status and every signal must be in one of them.

#![expect(clippy::expect_used, clippy::panic, reason = "what cannot be read fails the test")]

use std::collections::BTreeMap;
use std::sync::LazyLock;

use vimc4::Family;
use vimc4::device::Device;
use vimc4_conform::fixtures;
use vimc4_conform::format::Session;
use vimc4_conform::play::Record;
use vimc4_conform::source::with_manual;
use vimc4_isel::Model;
use vimc4_isel_wire::{Mode, Reply, table};
use vimc4_lpkf::language::{Dialect, Status, forms};
use vimc4_tests::shown::{Shown, shown};

#[test]
fn every_reply_of_every_command_has_a_session() {
    let records = &*RECORDS;
    let mut missing = Vec::new();
    for (name, record) in of_isel() {
        let dialect = Model::builtin(name).expect("a built-in model").command_set.dialect();
        for mode in Mode::ALL {
            for spec in table(dialect, mode) {
                for reply in spec.replies {
                    // A malformed line is not a command's.
                    let malformed = *reply == Reply::Syntax;
                    let mnemonic = if malformed { "?" } else { spec.mnemonic };
                    if !record.answers.contains(&(mnemonic.into(), kind(reply.code()))) {
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
        let kind = kind(reply.code());
        if !records.values().any(|record| record.answers.iter().any(|(_, code)| *code == kind)) {
            missing.push(format!("no model ever answered {reply}"));
        }
    }
    assert!(missing.is_empty(), "no session for\n  {}", missing.join("\n  "));
}

#[test]
fn every_reply_is_one_the_table_knows() {
    let mut unknown = Vec::new();
    for (name, record) in of_isel() {
        let dialect = Model::builtin(name).expect("a built-in model").command_set.dialect();
        for (mnemonic, code) in &record.answers {
            let specs = Mode::ALL.into_iter().flat_map(|mode| table(dialect, mode));
            let Some(spec) = specs.into_iter().find(|spec| spec.mnemonic == *mnemonic) else {
                continue; // A line that is not a command, answered 5 or 8.
            };
            if !spec.replies.iter().any(|reply| kind(reply.code()) == *code) {
                unknown.push(format!("{name}: {mnemonic} answered {code}"));
            }
        }
    }
    assert!(unknown.is_empty(), "not in the tables of isel-wire\n  {}", unknown.join("\n  "));
}

#[test]
fn every_signal_has_a_session() {
    assert_every_signal_is_set(Family::Isel);
}

#[test]
fn everything_of_lpkf_has_a_session() {
    let shown = &*SHOWN;
    let mut missing = Vec::new();
    for dialect in Dialect::ALL {
        let shown: Vec<&Shown<'_>> = shown.iter().filter(|shown| shown.speaks(dialect)).collect();
        for form in forms().iter().filter(|form| form.known_to(dialect)) {
            if !shown.iter().any(|shown| shown.holds(form)) {
                missing.push(format!("{dialect:?}: {} never carried out", form.mnemonic));
            }
        }
        for &status in Status::ALL.iter().filter(|status| status.known_to(dialect)) {
            if !shown.iter().any(|shown| shown.sends(status, dialect)) {
                let text = status.written(dialect, false).unwrap_or_default();
                missing.push(format!("{dialect:?}: {text} never sent, {}", status.meaning()));
            }
        }
    }
    assert!(missing.is_empty(), "no session for\n  {}", missing.join("\n  "));
    assert_every_signal_is_set(Family::Lpkf);
}

#[test]
fn every_answer_of_lpkf_is_one_the_table_knows() {
    let mut unknown = Vec::new();
    for shown in SHOWN.iter().filter(|shown| shown.session.family == Family::Lpkf) {
        for (mnemonic, kind) in &shown.record.answers {
            let Some(form) = forms().iter().find(|form| form.mnemonic == *mnemonic) else {
                continue; // What is not a command, or came unasked.
            };
            let known = kind.starts_with(['C', 'E', 'Z'])
                || form.answer.letter().is_some_and(|letter| kind.starts_with(letter));
            if !known {
                unknown.push(format!("{}: {mnemonic} answered {kind}", shown.session.id));
            }
        }
    }
    assert!(unknown.is_empty(), "not in the tables of lpkf\n  {}", unknown.join("\n  "));
}

fn assert_every_signal_is_set(family: Family) {
    let mut missing = Vec::new();
    for name in with_manual(family) {
        let model = vimc4::model(name).expect("a built-in model");
        let machine = vimc4::machine("bench").expect("a built-in machine");
        let device = vimc4::bare(&model, &machine, &[]).expect("a controller");
        for signal in device.signals() {
            if !RECORDS.get(name).is_some_and(|record| record.signals.contains(&signal.name)) {
                missing.push(format!("{name}: {}", signal.name));
            }
        }
    }
    assert!(missing.is_empty(), "never set\n  {}", missing.join("\n  "));
}

/// What the sessions have shown of each of isel's models that has a manual. Of the others they show
/// what is known.
fn of_isel() -> impl Iterator<Item = (&'static str, &'static Record)> {
    with_manual(Family::Isel).into_iter().map(|name| {
        (name, RECORDS.get(name).unwrap_or_else(|| panic!("no session on {name} passes")))
    })
}

/// A reply as records name it.
fn kind(code: u8) -> String {
    char::from(code).to_string()
}

static SESSIONS: LazyLock<Vec<Session>> =
    LazyLock::new(|| fixtures::sessions().unwrap_or_else(|error| panic!("{error}")));

static SHOWN: LazyLock<Vec<Shown<'static>>> = LazyLock::new(|| shown(&*SESSIONS));

/// What all sessions together have shown of each model.
static RECORDS: LazyLock<BTreeMap<&'static str, Record>> = LazyLock::new(|| {
    let mut records: BTreeMap<&str, Record> = BTreeMap::new();
    for Shown { model, record, .. } in &*SHOWN {
        let all = records.entry(*model).or_default();
        all.answers.extend(record.answers.iter().cloned());
        all.lines.extend(record.lines.iter().cloned());
        all.signals.extend(record.signals.iter().cloned());
    }
    records
});
