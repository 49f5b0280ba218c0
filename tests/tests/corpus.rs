//! Replays the corpus of the fuzz targets, and holds that it reaches everything.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::collections::BTreeSet;
use std::panic::{RefUnwindSafe, catch_unwind};
use std::sync::Mutex;

use vimc4_device::Device;
use vimc4_isel::Controller;
use vimc4_isel::Model;
use vimc4_isel_wire::{Mode, Op, Reply, table};
use vimc4_plant::Machine;
use vimc4_tests::fuzzing::{Reached, TARGETS, controller, corpus};

/// Checks every file of a target, and says which ones did not hold.
fn replay(target: &str, check: impl Fn(&[u8]) + RefUnwindSafe) {
    let files = corpus(target).unwrap();
    assert!(!files.is_empty(), "nothing to replay");
    let failed = files.into_iter().filter(|(_, data)| catch_unwind(|| check(data)).is_err());
    let failed: Vec<String> = failed.map(|(name, _)| name).collect();
    assert!(failed.is_empty(), "fixtures/corpus/{target}: {}", failed.join(", "));
}

#[test]
fn lines_are_found_in_every_input() {
    replay("lexer", TARGETS[0].1);
}

#[test]
fn commands_print_as_what_they_are_read_from() {
    replay("parser", TARGETS[1].1);
}

#[test]
fn profiles_are_refused_or_work() {
    replay("profiles", TARGETS[2].1);
}

#[test]
fn flash_images_are_refused_or_work() {
    replay("flash", TARGETS[3].1);
}

#[test]
fn controllers_do_everything_and_nothing_that_they_must_not() {
    let reached = Mutex::new(Reached::default());
    replay("controller", |data| {
        let mut one = Reached::default();
        controller(data, &mut one);
        let mut all = reached.lock().unwrap();
        all.commands.extend(one.commands);
        all.lines.extend(one.lines);
        all.replies.extend(one.replies);
        all.signals.extend(one.signals);
    });
    let reached = reached.into_inner().unwrap();
    let mut missing = BTreeSet::new();
    for name in Model::names() {
        let model = Model::builtin(name).unwrap();
        let dialect = model.command_set.dialect();
        for mode in Mode::ALL {
            for spec in table(dialect, mode) {
                let about = format!("{name}: {} ({})", spec.mnemonic, spec.title);
                if !reached.commands.contains(&(name, spec.mnemonic)) {
                    missing.insert(format!("{about} is never received"));
                }
                // The end of a program is the end of its lines and no line that is executed.
                let runs = mode == Mode::Stored && spec.op != Op::End;
                if runs && !reached.lines.contains(&(name, spec.mnemonic)) {
                    missing.insert(format!("{about} is never executed in a program"));
                }
                // An unknown code of diagnosis is an unknown line. Only a profile that lacks a
                // code that its dialect has makes a difference.
                let listed = |reply: &&Reply| spec.op != Op::Diagnosis || **reply != Reply::Syntax;
                for reply in spec.replies.iter().filter(listed) {
                    if !reached.replies.contains(&(name, spec.mnemonic, *reply)) {
                        missing.insert(format!("{about} never answers {reply}"));
                    }
                }
            }
        }
        for reply in [Reply::Syntax, Reply::NotStorable] {
            if !reached.replies.contains(&(name, "?", reply)) {
                missing.insert(format!("{name}: an unknown line never answers {reply}"));
            }
        }
        let machine = Machine::builtin("bench").unwrap();
        for signal in Controller::new(model, machine, b"").unwrap().signals() {
            for on in [true, false] {
                if !reached.signals.contains(&(name, signal.name.clone(), on)) {
                    missing.insert(format!("{name}: {} never becomes {on}", signal.name));
                }
            }
        }
    }
    let codes: BTreeSet<Reply> = reached.replies.iter().map(|(_, _, reply)| *reply).collect();
    assert!(Reply::ALL.iter().all(|reply| codes.contains(reply)), "replies: {codes:?}");
    let missing: Vec<String> = missing.into_iter().collect();
    assert!(missing.is_empty(), "the corpus does not reach:\n{}", missing.join("\n"));
}
