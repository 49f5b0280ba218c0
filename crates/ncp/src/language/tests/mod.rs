//! The language as a whole. What a module does alone is tested there.

mod garbage;
mod problems;
mod round_trip;
mod rules;
mod tables;

use crate::Severity;
use crate::language::{Instruction, JobLine, Problem, Span, parse};

/// A line and all that is told of it.
fn read(line: &str) -> (JobLine<'_>, Vec<(Span, Problem)>) {
    let mut problems = Vec::new();
    let read = parse(line, &mut |span, problem| problems.push((span, problem)));
    (read, problems)
}

/// The command of a line that is right.
#[track_caller]
fn command(line: &str) -> Instruction {
    let (read, problems) = read(line);
    assert!(problems.is_empty(), "{line}: {problems:?}");
    read.command.unwrap_or_else(|| panic!("{line} has a command")).value
}

/// What is told of a line: the code, and the text that it points at.
fn told(line: &str) -> Vec<(&'static str, &str)> {
    let (read, problems) = read(line);
    let errors = problems.iter().any(|(_, problem)| problem.severity() == Severity::Error);
    assert!(!errors || read.command.is_none(), "{line}: errors leave no command");
    problems.iter().map(|(span, problem)| (problem.code(), &line[span.range()])).collect()
}

/// The message and the help of the only problem of a line.
#[track_caller]
fn message(line: &str) -> (String, String) {
    let (_, problems) = read(line);
    let [(_, problem)] = problems[..] else { panic!("{line}: {problems:?}") };
    (problem.to_string(), problem.help().unwrap_or_default())
}
