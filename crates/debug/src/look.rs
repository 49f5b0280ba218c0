//! What is in progress, for people and for views: frames, listings, the running motion.

use std::fmt;
use std::path::Path as FilePath;

use vimc4_catalogue::isel::ProgramStatus;
use vimc4_device::{CommandNumber, Device, Event, Kinds, Path, Stamp, Time, escape};
use vimc4_timeline::Place;

use crate::debugger::Debugger;
use crate::error::shortened;
use crate::stop::{Executing, FileLine, time};
use crate::{Breakpoint, Trigger};
use vimc4_session::BreakpointId;

/// One level of what is in progress.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// What it is, for people: the text of the line.
    pub name: String,
    /// Its kind.
    pub kind: FrameKind,
    /// Its line, from 1, in the stored program or the file.
    pub line: Option<u32>,
}

/// What a frame is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameKind {
    /// The line of the stored program that is executed.
    Line,
    /// An open loop of the stored program, and how many more rounds it makes after this one.
    Loop {
        /// The rounds.
        left: u32,
    },
    /// A command that came over the line.
    Command(CommandNumber),
    /// The host waits at this line of the file: for somebody who says that it may go on, or for
    /// something to happen.
    Waits,
    /// Nothing is in progress.
    Idle,
}

impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.kind {
            FrameKind::Line => write!(f, "line {}: {}", self.line.unwrap_or(0), self.name),
            FrameKind::Loop { left } => {
                let line = self.line.unwrap_or(0);
                write!(f, "loop of line {line}, {left} more: {}", self.name)
            }
            FrameKind::Command(number) => {
                write!(f, "command #{number}: {}", self.name)?;
                self.line.map_or(Ok(()), |line| write!(f, " (line {line} of the file)"))
            }
            FrameKind::Waits => {
                let line = self.line.unwrap_or(0);
                write!(f, "the host waits at line {line} of the file: {}", self.name)
            }
            FrameKind::Idle => f.write_str("nothing is under way"),
        }
    }
}

/// Lines, one of which may be the present one.
#[derive(Clone, Debug, PartialEq)]
pub struct Listing {
    /// Of what.
    pub of: String,
    /// The lines.
    pub lines: Vec<ListedLine>,
}

/// A line of a listing.
#[derive(Clone, Debug, PartialEq)]
pub struct ListedLine {
    /// Its number: of the line, or of the command.
    pub number: u64,
    /// Its text.
    pub text: String,
    /// Its meaning.
    pub meaning: String,
    /// Whether it is the one that is executed, or was last.
    pub is_present: bool,
    /// The breakpoint at it.
    pub breakpoint: Option<BreakpointId>,
}

impl fmt::Display for Listing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.of)?;
        let width = self.lines.iter().map(|line| line.text.chars().count()).max();
        let width = width.unwrap_or(0).min(40);
        for line in &self.lines {
            let marker = if line.is_present { '>' } else { ' ' };
            let point = if line.breakpoint.is_some() { '*' } else { ' ' };
            write!(f, "\n{marker}{point}{:>6}  {:<width$}", line.number, line.text)?;
            if !line.meaning.is_empty() {
                write!(f, "  {}", line.meaning)?;
            }
        }
        Ok(())
    }
}

/// The running motion.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionView {
    /// Its path: line, arc, helix or several.
    pub path: &'static str,
    /// Steps of the step clock that have been made.
    pub done: u64,
    /// Steps that it makes in all.
    pub steps: u64,
    /// When it began.
    pub began: Time,
    /// When it ends unless it is stopped.
    pub ends: Time,
    /// The frequency of the step clock now, µHz.
    pub frequency: u64,
    /// What the ramp does.
    pub ramp: RampPhase,
    /// On an arc: the place relative to the centre, and the difference register.
    pub register: Option<Register>,
}

/// The registers of the circle engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register {
    /// Relative to the centre, on the first axis of the plane, steps.
    pub x: i64,
    /// On the second axis.
    pub y: i64,
    /// The difference register.
    pub d: i64,
}

/// What the ramp of a motion does at a moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RampPhase {
    /// Accelerating.
    Rising,
    /// At constant speed.
    Even,
    /// Decelerating.
    Falling,
}

impl fmt::Display for RampPhase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            RampPhase::Rising => "rising",
            RampPhase::Even => "even",
            RampPhase::Falling => "falling",
        })
    }
}

impl fmt::Display for MotionView {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (hertz, part) = (self.frequency / 1_000_000, self.frequency / 10_000 % 100);
        write!(
            f,
            "{}: step {} of {}, {hertz}.{part:02} Hz, ramp {}\n    {} to {}",
            self.path,
            self.done,
            self.steps,
            self.ramp,
            time(self.began),
            time(self.ends),
        )?;
        if let Some(Register { x, y, d }) = self.register {
            write!(f, "\n    from the centre {x}, {y}; difference register {d}")?;
        }
        Ok(())
    }
}

/// How many lines are listed before and after the present one.
const AROUND: u64 = 8;

impl Debugger {
    /// What is in progress, innermost first: the line of the stored program, the open loops, the
    /// command, or the line at which the host waits. Never empty.
    pub fn frames(&mut self) -> Vec<Frame> {
        let mut frames = Vec::new();
        let waits = self.feed().and_then(|feed| feed.waits_at(self.history()));
        if let (Some(line), Some(source)) = (waits, self.source()) {
            let text = source.lines.get(line as usize - 1).map_or("", |text| text.trim());
            return vec![Frame { name: text.to_owned(), kind: FrameKind::Waits, line: waits }];
        }
        let details = self.device().details();
        if let Some(program) = details.program()
            && matches!(program.status, ProgramStatus::Running | ProgramStatus::Paused)
        {
            let text = |line: u32| program.lines.get(line as usize).cloned().unwrap_or_default();
            if let Some(line) = self.line_begun().or(program.marker.map(|marker| marker + 1)) {
                let name = text(line.saturating_sub(1));
                frames.push(Frame { name, kind: FrameKind::Line, line: Some(line) });
            }
            for open in program.loops.iter().rev() {
                let (name, kind) = (text(open.line), FrameKind::Loop { left: open.left });
                frames.push(Frame { name, kind, line: Some(open.line + 1) });
            }
        }
        if let Some(command) = self.executing() {
            let line = self.source().and_then(|source| source.line_of(command.number));
            let name = escape(&command.line);
            frames.push(Frame { name, kind: FrameKind::Command(command.number), line });
        }
        if frames.is_empty() {
            frames.push(Frame { name: "idle".to_owned(), kind: FrameKind::Idle, line: None });
        }
        frames
    }

    /// The line of the stored program, from 1, that was begun last. The controller's next line may
    /// differ: a loop or a branch is done at once and takes its time afterwards.
    pub(crate) fn line_begun(&mut self) -> Option<u32> {
        let is_line = |_: &Stamp, event: &Event| matches!(event, Event::Line { .. });
        match self.last_event(Kinds::COMMAND, &mut crate::uninterrupted, is_line)?.event {
            Event::Line { line, .. } => Some(line),
            _ => None,
        }
    }

    /// The lines of the stored program, with a marker at the one that the controller is at: the one
    /// that is executed, or, where a loop or a branch takes its time, the one that comes next.
    #[must_use]
    pub fn program(&self) -> Option<Listing> {
        let details = self.device().details();
        let program = details.program()?;
        let waits = |line: u32| {
            self.breakpoint_for(|trigger| {
                use vimc4_device::Condition;
                *trigger == Trigger::Condition(Condition::Line { line: Some(line) })
            })
        };
        let lines = (0_u32..).zip(&program.lines).map(|(place, text)| ListedLine {
            number: u64::from(place) + 1,
            text: text.clone(),
            meaning: self.device().explain(text.as_bytes()),
            is_present: program.marker == Some(place),
            breakpoint: waits(place + 1),
        });
        Some(Listing { of: "the stored program".to_owned(), lines: lines.collect() })
    }

    /// The lines of the file that the commands come from, with a marker at the one that is executed.
    pub fn file(&mut self) -> Option<Listing> {
        let executing = self.executing();
        let source = self.source()?;
        let waits = self.feed().and_then(|feed| feed.waits_at(self.history()));
        let present =
            waits.or_else(|| executing.and_then(|command| source.line_of(command.number)));
        let waits = |line| self.breakpoint_for(|trigger| *trigger == Trigger::SourceLine(line));
        let lines = (1_u32..).zip(&source.lines).map(|(number, text)| ListedLine {
            number: number.into(),
            text: text.clone(),
            meaning: String::new(),
            is_present: present == Some(number),
            breakpoint: waits(number),
        });
        Some(Listing { of: source.name.clone(), lines: lines.collect() })
    }

    /// The line of the file at which the host asks or waits at the present, or that the command under way
    /// comes from.
    pub(crate) fn file_line(&self, command: Option<&Executing>) -> Option<FileLine> {
        let source = self.source()?;
        let held = self.feed().and_then(|feed| feed.waits_at(self.history()));
        let number = held.or_else(|| source.line_of(command?.number))?;
        let text = source.lines.get((number as usize).checked_sub(1)?)?.trim();
        let file = FilePath::new(&source.name).file_name();
        let file = file.map_or_else(|| source.name.clone(), |it| it.to_string_lossy().into_owned());
        Some(FileLine { file, number, text: shortened(text.to_owned()), is_held: held.is_some() })
    }

    /// The commands around the present one as they were executed.
    pub fn commands(&mut self) -> Listing {
        let (present, seen) = self.commands_around(AROUND);
        let lines = seen.into_iter().map(|command| ListedLine {
            number: command.number.map_or(0, |number| number.0.get()),
            meaning: command.meaning,
            text: escape(&command.line),
            is_present: command.number == present,
            breakpoint: None,
        });
        Listing { of: "commands".to_owned(), lines: lines.collect() }
    }

    /// The running motion.
    #[must_use]
    pub fn motion(&self) -> Option<MotionView> {
        let device = self.device();
        let running = device.running()?;
        let segment = running.segment;
        let nanos = self.now().nanos_since(running.began);
        let done = segment.profile.steps_at(nanos);
        let frequency = segment.profile.speed_at(nanos);
        let soon = segment.profile.speed_at(nanos.saturating_add(100_000));
        let earlier = segment.profile.speed_at(nanos.saturating_sub(100_000));
        let ramp = match (earlier.cmp(&frequency), frequency.cmp(&soon)) {
            (std::cmp::Ordering::Equal, std::cmp::Ordering::Equal) => RampPhase::Even,
            (_, std::cmp::Ordering::Less) => RampPhase::Rising,
            (_, std::cmp::Ordering::Greater) => RampPhase::Falling,
            (std::cmp::Ordering::Less, _) => RampPhase::Even,
            _ => RampPhase::Even,
        };
        let register = match &segment.path {
            Path::Arc(arc) => {
                let state = arc.state_at(done);
                Some(Register { x: state.x, y: state.y, d: state.d })
            }
            _ => None,
        };
        let path = match &segment.path {
            Path::Line(_) => "line",
            Path::Arc(_) => "arc",
            Path::Helix(_) => "helix",
            Path::Chain(_) => "several paths",
        };
        Some(MotionView {
            path,
            done,
            steps: segment.profile.steps(),
            began: running.began,
            ends: running.began.after_nanos(segment.profile.duration()),
            frequency,
            ramp,
            register,
        })
    }

    fn breakpoint_for(&self, waits: impl Fn(&Trigger) -> bool) -> Option<BreakpointId> {
        let found = self.breakpoints().iter().find(|breakpoint| waits(&breakpoint.trigger));
        found.filter(|breakpoint: &&Breakpoint| breakpoint.is_enabled).map(|found| found.id)
    }

    /// The place of a branch's end by its name.
    pub(crate) fn end_of_branch(&self, name: &str) -> Option<Place> {
        let branch = self.history().branches().find(|branch| branch.name == name)?;
        Some(Place { branch: branch.id, moment: branch.end })
    }
}
