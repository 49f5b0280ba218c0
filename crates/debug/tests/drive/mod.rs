//! A debugger that tests drive by lines.

use vimc4_debug::{Answer, Debugger, Stop, uninterrupted};

pub(crate) fn debugger(model: &str, machine: &str) -> Debugger {
    let (model, machine) =
        (vimc4_catalogue::model(model).unwrap(), vimc4_catalogue::machine(machine).unwrap());
    Debugger::new(vimc4_catalogue::bare(&model, &machine, &[]).unwrap())
}

/// Carries out lines that must succeed, and returns what the last one answers.
pub(crate) fn run(debugger: &mut Debugger, lines: &[&str]) -> Answer {
    let mut last = Answer::Done;
    for line in lines {
        last = debugger
            .execute(line, &mut uninterrupted)
            .unwrap_or_else(|error| panic!("`{line}`: {error}"));
    }
    last
}

pub(crate) fn stop(answer: Answer) -> Stop {
    match answer {
        Answer::Stopped(stop, _) => stop,
        other => panic!("no stop: {other:?}"),
    }
}
