//! Replays the corpus of the fuzz targets, and holds that it reaches everything.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::collections::BTreeSet;
use std::panic::{RefUnwindSafe, catch_unwind};
use std::sync::Mutex;

use vimc4_device::Device;
use vimc4_isel::StoreOver;
use vimc4_isel_wire::{Mode, Op, Reply, table};
use vimc4_lpkf::language::{Answer, Status, forms};
use vimc4_plant::Machine;
use vimc4_tests::fuzzing::{Reached, TARGETS, controller, corpus, lpkf};

/// Checks every input of a target, and says which ones did not hold.
fn replay(target: &str, check: impl Fn(&[u8]) + RefUnwindSafe) {
    let inputs = corpus(target).unwrap();
    assert!(!inputs.is_empty(), "nothing to replay");
    let failed = inputs.into_iter().filter(|(_, data)| catch_unwind(|| check(data)).is_err());
    let failed: Vec<String> = failed.map(|(name, _)| name).collect();
    assert!(failed.is_empty(), "{target}: {}", failed.join(", "));
}

/// Replays a target in which controllers are twins, and says what that has reached.
fn replay_twins(target: &str, twins: fn(&[u8], &mut Reached)) -> Reached {
    let reached = Mutex::new(Reached::default());
    replay(target, |data| {
        let mut one = Reached::default();
        twins(data, &mut one);
        reached.lock().unwrap().add(one);
    });
    reached.into_inner().unwrap()
}

/// Checks every input of a target that only looks at what it is given.
fn replay_target(name: &str) {
    let (_, check) = TARGETS.iter().find(|(target, _)| *target == name).unwrap();
    replay(name, check);
}

/// The signals that a controller lists and that were not set and cleared.
fn missing_signals(name: &'static str, controller: &impl Device, reached: &Reached) -> Vec<String> {
    let mut missing = Vec::new();
    for signal in controller.signals() {
        for on in [true, false] {
            if !reached.signals.contains(&(name, signal.name.clone(), on)) {
                missing.push(format!("{name}: {} never becomes {on}", signal.name));
            }
        }
    }
    missing
}

#[test]
fn lines_are_found_in_every_input() {
    replay_target("lexer");
}

#[test]
fn commands_print_as_what_they_are_read_from() {
    replay_target("parser");
}

#[test]
fn commands_of_both_dialects_print_as_what_they_are_read_from() {
    replay_target("language");
}

#[test]
fn job_files_are_read_and_lead_where_they_say() {
    replay_target("ncp");
}

#[test]
fn profiles_are_refused_or_work() {
    replay_target("profiles");
}

#[test]
fn flash_images_are_refused_or_work() {
    replay_target("flash");
}

#[test]
fn controllers_do_everything_and_nothing_that_they_must_not() {
    let reached = replay_twins("controller", controller);
    let mut missing = BTreeSet::new();
    for name in vimc4_isel::Model::names() {
        let model = vimc4_isel::Model::builtin(name).unwrap();
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
                // Where `i` replaces the program that is stored, nothing is in its way.
                let replaces = model.quirks.store_over == StoreOver::Replace;
                let refuses = |reply: &&Reply| {
                    spec.op != Op::Store || **reply != Reply::DataField || !replaces
                };
                for reply in spec.replies.iter().filter(listed).filter(refuses) {
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
        let controller = vimc4_isel::Controller::new(model, machine, b"").unwrap();
        missing.extend(missing_signals(name, &controller, &reached));
    }
    let codes: BTreeSet<Reply> = reached.replies.iter().map(|(_, _, reply)| *reply).collect();
    assert!(Reply::ALL.iter().all(|reply| codes.contains(reply)), "replies: {codes:?}");
    let missing: Vec<String> = missing.into_iter().collect();
    assert!(missing.is_empty(), "the corpus does not reach:\n{}", missing.join("\n"));
}

#[test]
fn lpkf_controllers_do_everything_and_nothing_that_they_must_not() {
    let reached = replay_twins("lpkf", lpkf);
    let mut missing = BTreeSet::new();
    for name in vimc4_lpkf::Model::names() {
        let model = vimc4_lpkf::Model::builtin(name).unwrap();
        let dialect = model.command_set;
        for form in forms().iter().filter(|form| form.known_to(dialect)) {
            let about = format!("{name}: {} ({})", form.mnemonic, form.title);
            if !reached.commands.contains(&(name, form.mnemonic)) {
                missing.insert(format!("{about} is never received"));
            }
            // What goes on with another command is answered as that one; with nothing to go on
            // with it is done by itself.
            let says_so = form.answer != Answer::Silence;
            if says_so && !reached.done.contains(&(name, form.mnemonic)) {
                missing.insert(format!("{about} is never done"));
            }
            if form.answer.letter().is_some() && !reached.data.contains(&(name, form.mnemonic)) {
                missing.insert(format!("{about} never sends its data"));
            }
        }
        for status in Status::ALL.iter().filter(|status| status.known_to(dialect)) {
            if !reached.statuses.contains(&(name, *status)) {
                missing.insert(format!("{name}: {} is never said", status.name()));
            }
        }
        for machine in Machine::names() {
            let machine = Machine::builtin(machine).unwrap();
            let controller = vimc4_lpkf::Controller::new(model.clone(), machine);
            missing.extend(missing_signals(name, &controller, &reached));
        }
    }
    let missing: Vec<String> = missing.into_iter().collect();
    assert!(missing.is_empty(), "the corpus does not reach:\n{}", missing.join("\n"));
}
