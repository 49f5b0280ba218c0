//! Resuming a job in the middle.
//!
//! Everything before the line is read and none of it is done. Then its settings are restored, and
//! the tool approaches its place from above.

use std::collections::VecDeque;

use vimc4_isel_wire::AxisSet;
use vimc4_plant::Output;

use super::action::{Action, OutputChange, Question};
use super::interpreter::{Options, Standing};
use super::run::Job;
use super::target::Target;
use super::zero::Zero;
use crate::geometry::Steps;

/// What is done before a job is resumed at a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Resumption {
    /// The line, from 1.
    pub line: u32,
    /// The state there.
    pub standing: Standing,
    /// The axes that make reference runs first.
    pub referenced: AxisSet,
    /// The axes that have moved, or are about to, from a place without a reference run: the job
    /// took it for 0, and the counters there are not known.
    pub unknown: AxisSet,
    /// The tool to put in, if the job has asked for one.
    pub tool: Option<u32>,
    /// The outputs that are set, in the order in which the job has set them.
    pub outputs: Vec<OutputChange>,
    /// How long the spindle takes to reach its speed, in µs.
    pub run_up: u64,
    /// The counter of Z at which the tool goes across.
    pub highest: i64,
    /// Whether there is a way to go: something has moved before, or, where the present point counts,
    /// the tool is not where the job begins.
    pub has_begun: bool,
    /// Whether reference runs have determined where axes were.
    pub told: bool,
}

/// Why a job cannot be resumed at a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoResumption {
    /// The job ends before it.
    #[error("the job has only {0} lines up to its end")]
    Beyond(u32),
    /// The operator had found the zero, and its place is not known any more.
    #[error(
        "the work-piece zero was found by hand in line {0}, and is not known any more; say with \
         --zero where it was found"
    )]
    Taught(u32),
    /// An earlier line cannot be carried out.
    #[error("line {0} cannot be carried out")]
    Impossible(u32),
}

impl<'t> Job<'t> {
    /// A job that only lets the operator find the work-piece zero; the reference runs with which
    /// jobs begin come first, unless the options say that the present point counts.
    #[must_use]
    pub fn teach(target: &'t Target, options: Options) -> Job<'t> {
        let mut job = Job::new("", target, options);
        let mut actions = job.interpreter_mut().beginning();
        actions.push(Action::Ask(Question::Teach));
        job.first(0, actions.into());
        job
    }

    /// A job that is resumed at a line, on a controller with the counters `here`. Diagnostics about
    /// the lines before are not repeated.
    ///
    /// The tool is put in; outputs but those of the spindle are set; the axes that the job has
    /// referenced are referenced, unless the options say that the present point counts; Z goes up
    /// to the highest place it ever ended a line at, the other axes across; the spindle is set as
    /// it was; Z goes down at the normal speed.
    ///
    /// `found` is the work-piece zero that the operator has found at a WPTEACH before the line, which
    /// is where the tool was then.
    ///
    /// # Errors
    ///
    /// If there is no such line, or the state there cannot be known.
    pub fn resume(
        text: &'t str,
        target: &'t Target,
        options: Options,
        line: u32,
        here: Steps,
        found: Option<Zero>,
    ) -> Result<(Job<'t>, Resumption), NoResumption> {
        let mut job = Job::new(text, target, options);
        let mut before = Before::default();
        let mut actions = Vec::new();
        while job.next_line() < line {
            match job.read_line(&mut actions, &mut |_| {}) {
                None => return Err(NoResumption::Beyond(job.line())),
                Some(false) => return Err(NoResumption::Impossible(job.line())),
                Some(true) => {}
            }
            before.line(&actions);
            if actions.contains(&Action::Ask(Question::Teach)) {
                let found = found.ok_or(NoResumption::Taught(job.line()))?;
                job.interpreter_mut().find_zero(found);
            }
            actions.clear();
            let z = job.counters()[2];
            let highest = before.highest.unwrap_or(z);
            before.highest = Some(job.interpreter().higher(highest, z));
        }
        if !job.has_line() {
            return Err(NoResumption::Beyond(job.line()));
        }
        Ok(before.resume(job, line, options, here))
    }
}

/// The axes with an unknown starting place, among those that move up to the end of the next line.
fn unknown(job: &Job<'_>) -> AxisSet {
    let mut ahead = job.clone();
    ahead.read_line(&mut Vec::new(), &mut |_| {});
    let (here, there) = (job.counters(), ahead.counters());
    let assumed = ahead.interpreter().assumed();
    let (referenced, _) = ahead.interpreter().runs();
    let is_unknown = |axis: &usize| {
        let moves = here[*axis] != 0 || there[*axis] != 0;
        assumed.has(*axis) || moves && !referenced.has(*axis)
    };
    let bits = job.target().axes.iter().filter(is_unknown).fold(0, |bits, axis| bits | 1 << axis);
    AxisSet::from_bits(bits).unwrap_or(AxisSet::NONE)
}

/// The actions of the lines before.
#[derive(Default)]
struct Before {
    tool: Option<u32>,
    outputs: Vec<OutputChange>,
    run_up: u64,
    acceleration: Option<u32>,
    highest: Option<i64>,
}

impl Before {
    fn line(&mut self, actions: &[Action]) {
        let mut switched = false;
        for action in actions {
            match action {
                Action::Output(change) => {
                    switched = true;
                    self.set(*change);
                }
                // Where something is switched and waited for, it is the spindle.
                Action::Dwell(time) if switched => self.run_up = *time,
                Action::Acceleration(hz_per_ms) => self.acceleration = Some(*hz_per_ms),
                Action::Ask(Question::Tool(number)) => self.tool = Some(*number),
                _ => {}
            }
        }
    }

    /// An output that is set again does not have what it had before.
    fn set(&mut self, change: OutputChange) {
        let is_same = |known: &OutputChange| {
            known.port == change.port && (change.bit.is_none() || known.bit == change.bit)
        };
        self.outputs.retain(|known| !is_same(known));
        self.outputs.push(change);
    }

    fn resume(
        self,
        mut job: Job<'_>,
        line: u32,
        options: Options,
        here: Steps,
    ) -> (Job<'_>, Resumption) {
        let unknown = unknown(&job);
        let (mut referenced, runs) = job.interpreter().runs();
        let told = referenced.iter().any(|axis| !job.interpreter().assumed().has(axis));
        if options.no_reference {
            referenced = AxisSet::NONE;
        }
        // Where the present point counts, the tool may have left the one at which the job begins.
        let has_left = options.no_reference && here != job.counters();
        let has_begun = job.interpreter().has_begun() || has_left;
        let mut from = here;
        referenced.iter().for_each(|axis| from[axis] = 0);
        let reached = self.highest.unwrap_or(from[2]);
        let highest = job.interpreter().higher(reached, from[2]);

        let mut actions = VecDeque::new();
        let spindle = job.target().setup.spindle;
        let of_spindle = |change: &OutputChange| {
            let is = |output: Output| (output.port, output.bit) == (change.port, change.bit);
            spindle.is_some_and(|spindle| {
                let analogue = spindle.analogue.is_some_and(|it| it.port == change.port);
                is(spindle.on) || spindle.counterclockwise.is_some_and(is) || analogue
            })
        };
        actions.extend(self.tool.map(|number| Action::Ask(Question::Tool(number))));
        let (spindle, others): (Vec<_>, Vec<_>) =
            self.outputs.iter().copied().partition(of_spindle);
        actions.extend(others.into_iter().map(Action::Output));
        actions.extend(self.acceleration.map(Action::Acceleration));
        if has_begun {
            actions.extend((!referenced.is_empty()).then_some(runs));
            let way = job.interpreter_mut().approach(from, highest);
            actions.extend(way.up);
            actions.extend(spindle.into_iter().map(Action::Output));
            actions.extend((self.run_up > 0).then_some(Action::Dwell(self.run_up)));
            actions.extend(way.down);
        } else {
            actions.extend(spindle.into_iter().map(Action::Output));
        }
        let resumption = Resumption {
            line,
            standing: job.interpreter().standing(),
            unknown,
            referenced: if has_begun { referenced } else { AxisSet::NONE },
            tool: self.tool,
            outputs: self.outputs,
            run_up: self.run_up,
            highest,
            has_begun,
            told,
        };
        job.first(line, actions);
        (job, resumption)
    }
}
