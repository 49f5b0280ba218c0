//! Where a walk has ended, and why.

use std::fmt;

use vimc4_device::{CommandNumber, Output, Stamp, Time, escape, show_nanos};
use vimc4_timeline::Place;

use crate::{DebugError, Note, Unit};
use vimc4_session::BreakpointId;

/// Where a walk through the history has ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// Why there.
    pub why: Reason,
    /// Where.
    pub place: Place,
    /// The model time.
    pub at: Time,
    /// The breakpoints at the line at which the host asks or waits, which holds it up without one.
    pub met: Vec<BreakpointId>,
    /// The command that is executed there, or that caused what is in progress.
    pub command: Option<Executing>,
    /// The line of the file at which the host asks or waits, or that this command comes from.
    pub line: Option<FileLine>,
    /// The notes of breakpoints that only log, on the way.
    pub notes: Vec<Note>,
    /// The last error answers and warnings on the way before that.
    pub problems: Vec<Output>,
    /// Where the emulation differs from the recording on the way, one line each.
    pub differences: Vec<String>,
    /// The output of the act at which the walk ended.
    pub outputs: Vec<Output>,
    /// The same for people, one line each.
    pub said: Vec<String>,
    /// What the controller waits for, if that is why nothing more comes; for people, with what changes that.
    pub awaits: Option<String>,
}

/// Why a walk has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reason {
    /// All requested steps were made.
    Step(Unit),
    /// At one of these breakpoints, or several.
    Breakpoints(Vec<BreakpointId>),
    /// The search succeeded.
    Found,
    /// The requested place was reached.
    Gone,
    /// The beginning of everything.
    Beginning,
    /// The end of what has been recorded.
    End,
    /// The controller does nothing more without something from outside.
    Rest,
    /// The host waits: for somebody who says that it may go on, or for something to happen; with what
    /// it waits for.
    Waits(String),
    /// An error reply is why the host sends nothing more; in a sentence.
    Refused(String),
    /// The time limit was reached.
    Time,
    /// The search failed; the present is where it was.
    Nowhere,
    /// The controller repeats itself for ever, and nothing ends the walk; in a sentence. The present is where it
    /// was.
    Endless(String),
    /// It was cancelled.
    Cancelled,
    /// The recording cannot be read on; with the reason, in a sentence.
    Broken(String),
}

impl Reason {
    /// Its name for programs, in kebab-case.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Reason::Step(_) => "step",
            Reason::Breakpoints(_) => "breakpoint",
            Reason::Found => "found",
            Reason::Gone => "goto",
            Reason::Beginning => "beginning",
            Reason::End => "end",
            Reason::Rest => "rest",
            Reason::Waits(_) => "waits",
            Reason::Refused(_) => "refused",
            Reason::Time => "time",
            Reason::Nowhere => "nowhere",
            Reason::Endless(_) => "endless",
            Reason::Cancelled => "cancelled",
            Reason::Broken(_) => "broken",
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reason::Step(unit @ Unit::Time(_)) => write!(f, "{unit}"),
            Reason::Step(unit @ Unit::Event) => write!(f, "an {unit}"),
            Reason::Step(unit) => write!(f, "a {unit}"),
            Reason::Breakpoints(ids) => numbered(f, ids),
            Reason::Found => f.write_str("found"),
            Reason::Gone => f.write_str("here"),
            Reason::Beginning => f.write_str("the beginning"),
            Reason::End => f.write_str("the end of what is recorded"),
            Reason::Rest => f.write_str("at rest until something comes from outside"),
            Reason::Waits(what) | Reason::Refused(what) => f.write_str(what),
            Reason::Endless(what) => write!(f, "still here: {what}"),
            Reason::Time => f.write_str("the time has come"),
            Reason::Nowhere => f.write_str("not to be found; still here"),
            Reason::Cancelled => f.write_str("cancelled"),
            Reason::Broken(why) => write!(f, "the recording cannot be read on: {why}"),
        }
    }
}

fn numbered(f: &mut fmt::Formatter<'_>, ids: &[BreakpointId]) -> fmt::Result {
    let what = if ids.len() == 1 { "breakpoint" } else { "breakpoints" };
    let ids: Vec<String> = ids.iter().map(ToString::to_string).collect();
    write!(f, "{what} {}", ids.join(", "))
}

/// A walk that a command needed has ended too early.
impl From<Reason> for DebugError {
    fn from(why: Reason) -> DebugError {
        DebugError::new(match why {
            Reason::Broken(why) => why,
            why => why.to_string(),
        })
    }
}

/// A command, and how it was sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Executing {
    /// Its number.
    pub number: CommandNumber,
    /// Its line as it was received.
    pub line: Vec<u8>,
    /// When its execution began.
    pub began: Time,
}

impl fmt::Display for Executing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{} {}", self.number, escape(&self.line))
    }
}

/// A line of the file that the commands come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileLine {
    /// The name of the file, without its folder.
    pub file: String,
    /// The line, from 1.
    pub number: u32,
    /// Its text, with its comment; a long one is shortened.
    pub text: String,
    /// Whether the host asks or waits there.
    pub is_held: bool,
}

impl fmt::Display for FileLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, line {}: {}", self.file, self.number, self.text)
    }
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for note in &self.notes {
            writeln!(f, "{}  {}: {}", time(note.at), note.by, note.text)?;
        }
        for problem in &self.problems {
            let at = match problem {
                Output::Event(stamp, _) => stamp.at,
                _ => self.at,
            };
            writeln!(f, "{}  {}", time(at), Said(problem))?;
        }
        for difference in &self.differences {
            writeln!(f, "{difference}")?;
        }
        write!(f, "{}  ", time(self.at))?;
        if !self.met.is_empty() {
            numbered(f, &self.met)?;
            f.write_str(", ")?;
        }
        write!(f, "{}", self.why)?;
        if let Some(awaits) = &self.awaits {
            write!(f, ": {awaits}")?;
        }
        let line = self.line.as_ref();
        let command = self.command.as_ref().filter(|_| !line.is_some_and(|line| line.is_held));
        if let Some(command) = command {
            write!(f, ", {command}")?;
        }
        // Of a list of commands the line is the command.
        let is_command = |line: &&FileLine| {
            command.is_some_and(|command| escape(command.line.trim_ascii()) == line.text)
        };
        if let Some(line) = line.filter(|line| !is_command(line)) {
            write!(f, "\n    {line}")?;
        }
        self.said.iter().try_for_each(|said| write!(f, "\n    {said}"))
    }
}

/// A time for people, in a form that [`parse_duration`](vimc4_device::parse_duration) reads too.
pub(crate) fn time(at: Time) -> String {
    show_nanos(at.as_nanos())
}

/// Something that came out, in one line.
pub(crate) struct Said<'o>(pub(crate) &'o Output);

impl fmt::Display for Said<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use vimc4_device::{Event, Motion};
        match self.0 {
            Output::Bytes(_, bytes) => write!(f, "< {}", escape(bytes)),
            Output::Flash(..) => f.write_str("flash memory is written"),
            Output::Event(Stamp { command, .. }, event) => {
                match event {
                    Event::Command { bytes, .. } => write!(f, "command {}", escape(bytes)),
                    Event::Ignored { bytes, why } => {
                        write!(f, "ignored {}: {why}", escape(bytes))
                    }
                    Event::Line { line, mnemonic } => write!(f, "program line {line}: {mnemonic}"),
                    Event::Answer { mnemonic, bytes, why } => {
                        write!(f, "answer to {mnemonic}: {}", escape(bytes))?;
                        why.as_ref().map_or(Ok(()), |why| write!(f, ", {why}"))
                    }
                    Event::CutShort { mnemonic, why } => {
                        write!(f, "{mnemonic} is cut short: {why}")
                    }
                    Event::Motion(Motion::Begins { segment, .. }) => {
                        /// A motion of more steps ends only when something ends it.
                        const ENDLESS: u64 = 1 << 40;
                        match segment.profile.steps() {
                            ENDLESS.. => {
                                f.write_str("a motion begins that goes on until it is ended")
                            }
                            1 => f.write_str("a motion of 1 step begins"),
                            steps => write!(f, "a motion of {steps} steps begins"),
                        }
                    }
                    Event::Motion(Motion::Changes { .. }) => f.write_str("the motion brakes"),
                    Event::Motion(Motion::Ends { steps }) => {
                        let s = if *steps == 1 { "" } else { "s" };
                        write!(f, "the motion ends after {steps} step{s}")
                    }
                    Event::Switch { axis, positive, active } => {
                        let end = if *positive { '+' } else { '-' };
                        let level = if *active { "on" } else { "off" };
                        write!(f, "limit switch {end} of axis {axis} {level}")
                    }
                    Event::Signal { signal, value } => {
                        write!(f, "signal {} is {value}", signal.0)
                    }
                    Event::Port { port, value } => write!(f, "port {port} is {value}"),
                    Event::Flash { what } => write!(f, "flash memory: {what}"),
                    Event::Baud { baud } => write!(f, "{baud} bit/s"),
                    Event::Fault { number, news } => write!(f, "fault {number} {news}"),
                    Event::Rule { rule, news } => write!(f, "rule {rule} {news}"),
                    Event::Warning(warning) => write!(f, "warning: {warning}"),
                    _ => f.write_str("something else happened"),
                }?;
                command.map_or(Ok(()), |command| write!(f, "  (#{command})"))
            }
        }
    }
}
