//! What a command of the console answers.

use std::fmt;

use serde_json::Value;
use vimc4_device::{Activity, AxisView, SignalView, Time, TimerView, WaitsFor};
use vimc4_session::BreakpointId;
use vimc4_timeline::recording::Mismatch;
use vimc4_timeline::{Branch, Place, Usage};

use crate::breakpoint::{Breakpoint, Note};
use crate::look::{Frame, Listing, MotionView};
use crate::stop::{Executing, FileLine, Stop, time};
use crate::table::{Directive, Group, TABLE};
use crate::why::{Chain, Change};
use crate::{Candidate, Parting, Variable};

/// What a command of the console answers: a value for programs, and its text for people.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Answer {
    /// It was done, and there is nothing to say.
    Done,
    /// The present has moved; with the values that are watched.
    Stopped(Stop, Vec<Watched>),
    /// A breakpoint was made.
    Breakpoint(BreakpointId, String),
    /// The breakpoints, with their texts.
    Breakpoints(Vec<(Breakpoint, String)>),
    /// Every time that a condition held; and whether there were more.
    Notes(Vec<Note>, bool),
    /// Where the present is.
    Where(Box<Where>),
    /// Lines: the faults, the rules, the help on an order, or that an order had no effect.
    Text(String),
    /// A value.
    Value(Variable),
    /// What is watched.
    Watches(Vec<Watched>),
    /// Lines.
    Listing(Listing),
    /// What is in progress, innermost first.
    Frames(Vec<Frame>),
    /// The running motion, if one runs.
    Motion(Option<MotionView>),
    /// What will happen by itself.
    Timers(Vec<TimerView>),
    /// What has been received and waits, and how much room there is.
    Queue {
        /// Bytes that wait.
        used: usize,
        /// Bytes for which there is room.
        size: usize,
    },
    /// The image of what is kept without power.
    Flash(Vec<u8>),
    /// What stands for the whole state.
    Digest(u64),
    /// Buttons, switches and inputs.
    Signals(Vec<SignalView>),
    /// What led to something, going back from it.
    Why(Chain),
    /// Where a field was changed.
    Change(Option<Change>),
    /// What would follow from a change.
    Parting(Box<Parting>),
    /// Moments with a name.
    Marks(Vec<(String, Place)>),
    /// The branches, and which one is present.
    Branches(Vec<Branch>, vimc4_timeline::BranchId),
    /// Where the emulation differs from the recording, and how many more places there are.
    Differences(Vec<Mismatch>, u64),
    /// How much is kept; and how much of a recording has been read, in thousandths, while there is
    /// more.
    Usage(Usage, Option<u32>),
    /// What can follow what was typed.
    Candidates(Vec<Candidate>),
    /// All commands and orders of the panel: how each is typed, and what it does.
    Help(Vec<(String, String)>),
    /// One command.
    HelpOn(&'static Directive),
    /// The caller wants to end.
    Quit,
}

/// A watched expression and its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Watched {
    /// The expression.
    pub expression: String,
    /// Its value, or why it has none.
    pub value: Result<Value, String>,
}

/// Where the present is.
#[derive(Clone, Debug, PartialEq)]
pub struct Where {
    /// The moment.
    pub place: Place,
    /// The name of the branch.
    pub branch: String,
    /// The time.
    pub at: Time,
    /// Whether it is the end of what is known.
    pub is_end: bool,
    /// What the controller does.
    pub activity: Activity,
    /// What it waits for.
    pub waits_for: Option<WaitsFor>,
    /// The command that is executed, or was last.
    pub command: Option<Executing>,
    /// What the host asks or waits for, if that holds it up.
    pub held: Option<String>,
    /// The line of the file at which it does, or that the command comes from.
    pub line: Option<FileLine>,
    /// The axes.
    pub axes: Vec<AxisView>,
}

impl fmt::Display for Where {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let end = if self.is_end { ", the end" } else { "" };
        write!(f, "{} on {}{end}: {}", time(self.at), self.branch, self.activity)?;
        if let Some(waits) = &self.waits_for {
            write!(f, ", waits for {waits}")?;
        }
        if let Some(held) = &self.held {
            write!(f, "\n    {held}")?;
        } else if let Some(command) = &self.command {
            write!(f, "\n    {command}")?;
        }
        self.line.as_ref().map_or(Ok(()), |line| write!(f, "\n    {line}"))?;
        for axis in self.axes.iter().filter(|axis| axis.configured) {
            let hertz = axis.speed / 1_000_000;
            write!(f, "\n    {:<2} {:>10}", axis.name, axis.position)?;
            if axis.speed != 0 {
                write!(f, "  {hertz} Hz")?;
            }
            f.write_str(axis.reference_in_words())?;
        }
        Ok(())
    }
}

impl fmt::Display for Watched {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.value {
            Ok(value) => write!(f, "{} = {}", self.expression, shown(value)),
            Err(error) => write!(f, "{}: {error}", self.expression),
        }
    }
}

fn shown(value: &Value) -> String {
    let variable = Variable { name: String::new(), path: String::new(), value: value.clone() };
    variable.text()
}

impl fmt::Display for Answer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Answer::Done | Answer::Quit => Ok(()),
            Answer::Stopped(stop, watches) => {
                write!(f, "{stop}")?;
                watches.iter().try_for_each(|watched| write!(f, "\n    {watched}"))
            }
            Answer::Breakpoint(id, text) => write!(f, "breakpoint {id}: {text}"),
            Answer::Breakpoints(list) => {
                lines(f, list, "there are no breakpoints", |f, (breakpoint, text)| {
                    let off = if breakpoint.is_enabled { "" } else { "  (disabled)" };
                    let times = if breakpoint.count == 1 { "time" } else { "times" };
                    write!(f, "{:>3}  {text}  {} {times}{off}", breakpoint.id, breakpoint.count)
                })
            }
            Answer::Notes(notes, more) => {
                lines(f, notes, "never", |f, note| write!(f, "{}  {}", time(note.at), note.text))?;
                if *more && !notes.is_empty() { f.write_str("\nand more") } else { Ok(()) }
            }
            Answer::Where(place) => write!(f, "{place}"),
            Answer::Value(variable) if variable.parts() == 0 => f.write_str(&variable.text()),
            Answer::Value(variable) => write!(f, "{variable}"),
            Answer::Watches(watches) => {
                numbered(f, watches, "nothing is watched", |watched| watched.to_string())
            }
            Answer::Listing(listing) => write!(f, "{listing}"),
            Answer::Frames(frames) => lines(f, frames, "", |f, frame| write!(f, "{frame}")),
            Answer::Candidates(list) => lines(f, list, "nothing that can be listed", |f, word| {
                write!(f, "{:<18} {}", word.text, word.about)
            }),
            Answer::Motion(None) => f.write_str("nothing moves"),
            Answer::Motion(Some(motion)) => write!(f, "{motion}"),
            Answer::Timers(timers) => lines(f, timers, "nothing is due", |f, timer| {
                write!(f, "{}  {}", time(timer.due), timer.cause)
            }),
            Answer::Queue { used, size } => write!(f, "{used} of {size} bytes wait"),
            Answer::Flash(image) if image.is_empty() => f.write_str("the memory is empty"),
            Answer::Flash(image) => f.write_str(String::from_utf8_lossy(image).trim_end()),
            Answer::Signals(signals) => lines(f, signals, "", |f, signal| match signal.value {
                Some(value) => write!(f, "{:<16} {value}", signal.name),
                None => write!(f, "{:<16} -", signal.name),
            }),
            Answer::Why(chain) => write!(f, "{chain}"),
            Answer::Change(None) => f.write_str("it has not changed; still here"),
            Answer::Change(Some(change)) => write!(f, "{change}"),
            Answer::Parting(parting) => write!(f, "{parting}"),
            Answer::Differences(list, more) => {
                let none = "the emulation does what is recorded, as far as it is read";
                let text = |own: &Mismatch| format!("{}  {own}", time(own.at));
                numbered(f, list, none, text)?;
                match more {
                    1.. if !list.is_empty() => write!(f, "\nand {more} more"),
                    _ => Ok(()),
                }
            }
            Answer::Marks(marks) => lines(f, marks, "no moment has a name", |f, (name, place)| {
                write!(f, "{:<16} {}", name, time(place.moment.at))
            }),
            Answer::Branches(branches, present) => lines(f, branches, "", |f, branch| {
                let marker = if branch.id == *present { '*' } else { ' ' };
                let (first, end) = (time(branch.first.at), time(branch.end.at));
                write!(f, "{marker} {:<24} {first} to {end}", branch.name)?;
                let Some(parted) = branch.parted else { return Ok(()) };
                let from = branches.iter().find(|other| other.id == parted.branch);
                write!(f, ", from {}", from.map_or("?", |other| other.name.as_str()))
            }),
            Answer::Text(text) => f.write_str(text),
            Answer::Digest(digest) => write!(f, "{digest:016x}"),
            Answer::Usage(usage, share) => used(f, usage, *share),
            Answer::Help(deeds) => help(f, deeds),
            Answer::HelpOn(directive) => help_on(f, directive),
        }
    }
}

fn used(f: &mut fmt::Formatter<'_>, usage: &Usage, share: Option<u32>) -> fmt::Result {
    let (input_kb, snapshot_kb) = (usage.input_bytes / 1_024, usage.snapshot_bytes / 1_024);
    write!(f, "{} inputs, {input_kb} kB; ", usage.inputs)?;
    write!(f, "{} states, {snapshot_kb} kB at least", usage.snapshots)?;
    share.map_or(Ok(()), |share| write!(f, "; {} % of it is read", share / 10))
}

fn help(f: &mut fmt::Formatter<'_>, deeds: &[(String, String)]) -> fmt::Result {
    for (place, group) in Group::ALL.into_iter().enumerate() {
        let between = if place > 0 { "\n\n" } else { "" };
        write!(f, "{between}{group}")?;
        for directive in TABLE.iter().filter(|directive| directive.group == group) {
            let short = directive.short.map_or(String::new(), |short| format!(" ({short})"));
            let name = format!("{}{short}", directive.name);
            write!(f, "\n  {name:<18} {}", directive.about)?;
        }
        let mut deeds = deeds.iter().filter(|_| group == Group::Doing);
        deeds.try_for_each(|(typed, about)| write!(f, "\n  {typed:<18} {about}"))?;
    }
    f.write_str("\n\n`help COMMAND` tells more; an empty line does the last one again.")
}

fn help_on(f: &mut fmt::Formatter<'_>, directive: &Directive) -> fmt::Result {
    write!(f, "{}", directive.usage())?;
    if let Some(short) = directive.short {
        write!(f, "  (or {short})")?;
    }
    write!(f, "\n    {}.", capital(directive.about))?;
    if !directive.more.is_empty() {
        write!(f, "\n    {}", directive.more)?;
    }
    write!(f, "\n    For example: {}", directive.example)
}

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    let first = chars.next().map(|c| c.to_uppercase().to_string());
    first.unwrap_or_default() + chars.as_str()
}

/// A line for each; `none` if there are none.
fn lines<T>(
    f: &mut fmt::Formatter<'_>,
    things: &[T],
    none: &str,
    mut line: impl FnMut(&mut fmt::Formatter<'_>, &T) -> fmt::Result,
) -> fmt::Result {
    if things.is_empty() {
        return f.write_str(none);
    }
    for (place, thing) in things.iter().enumerate() {
        if place > 0 {
            f.write_str("\n")?;
        }
        line(f, thing)?;
    }
    Ok(())
}

/// The same, with numbers from 1 on.
fn numbered<T>(
    f: &mut fmt::Formatter<'_>,
    things: &[T],
    none: &str,
    text: impl Fn(&T) -> String,
) -> fmt::Result {
    let mut numbers = 1..;
    lines(f, things, none, |f, thing| {
        write!(f, "{:>3}  {}", numbers.next().unwrap_or(0), text(thing))
    })
}
