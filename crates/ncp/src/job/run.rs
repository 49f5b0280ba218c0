//! A job from its text to its steps, one at a time.

use std::collections::VecDeque;

use super::action::{Action, Question};
use super::emitter::{Emitter, Step};
use super::interpreter::{Interpreter, Options};
use super::problem::Problem;
use super::target::Target;
use super::unmapped::Unmapped;
use super::zero::Zero;
use crate::geometry::{Curve, Delay, Steps, Straight};
use crate::language::{self, Instruction, JobLine, Lines, Span, TextLine, Units};
use crate::{Diagnostic, Severity};

/// How a job ended, and what was reported about it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Lines up to the end of the job.
    pub lines: u32,
    /// Errors.
    pub errors: u64,
    /// Warnings.
    pub warnings: u64,
    /// Notes.
    pub notes: u64,
}

impl Summary {
    /// Counts a diagnostic.
    pub fn count(&mut self, severity: Severity) {
        *match severity {
            Severity::Error => &mut self.errors,
            Severity::Warning => &mut self.warnings,
            Severity::Note => &mut self.notes,
        } += 1;
    }
}

/// Reads a job to its end and reports all diagnostics, line by line. The operator is assumed to
/// accept everything.
///
/// A movement of millions of steps takes no longer than one of a single step.
pub fn check(
    text: &str,
    target: &Target,
    options: Options,
    report: &mut dyn FnMut(Diagnostic),
) -> Summary {
    let mut summary = Summary::default();
    let mut reader = Reader::new(text, target, options);
    let mut actions = Vec::new();
    let mut unmapped = Unmapped::default();
    let mut counting = |diagnostic: Diagnostic| {
        summary.count(diagnostic.problem.severity());
        report(diagnostic);
    };
    while reader.line(&mut actions, &mut |said| unmapped.pass(said, &mut counting)).is_some() {
        if actions.iter().any(|action| matches!(action, Action::Ask(Question::Teach))) {
            reader.interpreter.take_zero();
        }
        actions.clear();
    }
    unmapped.report(&mut counting);
    summary.lines = match reader.g_code {
        Some(_) => language::lines(text).count() as u32,
        None => reader.number,
    };
    summary
}

/// Reports the cost of every movement that is made in pieces, with its line. Holes do not count,
/// because each of their strokes is a movement.
pub fn delays(text: &str, target: &Target, options: Options, tell: &mut dyn FnMut(u32, Delay)) {
    let mut reader = Reader::new(text, target, options);
    let mut actions = Vec::new();
    while reader.line(&mut actions, &mut |_| {}).is_some() {
        for action in actions.drain(..) {
            let delay = match action {
                Action::Straight(way) => Straight::new(way).delay(target.speeds()),
                Action::Curve(curve) => Curve::new(*curve).delay(),
                _ => None,
            };
            delay.into_iter().for_each(|delay| tell(reader.number, delay));
        }
    }
}

/// Reads lines and interprets them.
#[derive(Clone, Debug)]
struct Reader<'t> {
    lines: Lines<'t>,
    interpreter: Interpreter<'t>,
    number: u32,
    /// Where the command of the line stands.
    span: Span,
    /// The diagnostics about how a line is written.
    said: Vec<(Span, language::Problem)>,
    /// Where the file begins, if it is G-code.
    g_code: Option<TextLine<'t>>,
    /// It ends in the middle of a line.
    is_cut_off: bool,
    over: bool,
}

impl<'t> Reader<'t> {
    fn new(text: &'t str, target: &'t Target, options: Options) -> Reader<'t> {
        Reader {
            lines: language::lines(text),
            interpreter: Interpreter::new(target, options),
            number: 0,
            span: Span::default(),
            said: Vec::new(),
            g_code: language::g_code(text),
            is_cut_off: false,
            over: false,
        }
    }

    /// Carries the next line out; returns whether that was possible. `None` after the last.
    fn line(
        &mut self,
        actions: &mut Vec<Action>,
        report: &mut dyn FnMut(Diagnostic),
    ) -> Option<bool> {
        if self.over {
            return None;
        }
        if let Some(line) = self.g_code {
            return Some(self.is_g_code(line, report));
        }
        let next = if self.interpreter.has_ended() { None } else { self.lines.next() };
        let Some(TextLine { number, text, has_end, .. }) = next else {
            self.over = true;
            self.at_the_end(report);
            return None;
        };
        self.number = number;
        let said = &mut self.said;
        let line = language::parse(text, &mut |span, problem| said.push((span, problem)));
        let mut failed = false;
        for (span, problem) in self.said.drain(..) {
            let error = problem.severity() == Severity::Error;
            failed |= error && !line.harmless;
            let left_out = error && line.harmless;
            report(Diagnostic { line: number, span, problem: problem.into(), left_out });
        }
        let before = actions.len();
        let done = self.carry_out(&line, actions, report) && !failed;
        if has_end || self.interpreter.has_ended() || text.trim().is_empty() {
            return Some(done);
        }
        actions.truncate(before);
        self.is_cut_off = true;
        let span = Span { start: 0, end: text.len() as u32 };
        report(Diagnostic { line: number, span, problem: Problem::CutOff.into(), left_out: false });
        Some(false)
    }

    /// All of it is in another language, which is reported once.
    fn is_g_code(&mut self, line: TextLine<'_>, report: &mut dyn FnMut(Diagnostic)) -> bool {
        self.over = true;
        self.number = line.number;
        let span = Span { start: 0, end: line.text.len() as u32 };
        let problem = language::Problem::GCode.into();
        report(Diagnostic { line: line.number, span, problem, left_out: false });
        false
    }

    /// Problems that only the end of a job shows.
    fn at_the_end(&mut self, report: &mut dyn FnMut(Diagnostic)) {
        let mut say = |line, span, problem: Problem| {
            report(Diagnostic { line, span, problem: problem.into(), left_out: false });
        };
        if let Some((line, span, problem)) = self.interpreter.unconnected() {
            say(line, span, problem);
        }
        if self.interpreter.lacks_mark() {
            say(1, Span::default(), Problem::MarkMissing);
        }
        if self.interpreter.lacks_end() && !self.is_cut_off {
            say(self.number, Span::default(), Problem::EndMissing);
        }
        // Blank lines, comments and line numbers do not count.
        let behind = self.lines.find_map(|TextLine { number, text, .. }| {
            let code = text.split(';').next().unwrap_or_default().trim_end();
            let start = code.find(|c: char| !c.is_ascii_whitespace())?;
            let rest = code.get(start..)?.trim_start_matches(['N', 'n']);
            let is_number = rest.bytes().all(|byte| byte.is_ascii_digit());
            let span = Span { start: start as u32, end: code.len() as u32 };
            (!is_number).then_some((number, span))
        });
        if let Some((line, span)) = behind {
            say(line, span, Problem::BehindEnd);
        }
    }

    fn carry_out(
        &mut self,
        line: &JobLine<'_>,
        actions: &mut Vec<Action>,
        report: &mut dyn FnMut(Diagnostic),
    ) -> bool {
        let number = self.number;
        self.span = line.command.map(|command| command.span).unwrap_or_default();
        let left_out = line.command.is_some_and(|command| command.value.is_accessory());
        let done = self.interpreter.line(line, number, actions, &mut |span, problem| {
            let left_out = left_out && problem.severity() == Severity::Error;
            report(Diagnostic { line: number, span, problem: problem.into(), left_out });
        });
        done || left_out
    }
}

/// Something to do for a line of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct Order {
    /// The line, from 1; 0 for what comes before the first.
    pub line: u32,
    /// The command in the line.
    pub span: Span,
    /// What to do.
    pub step: Step,
    /// Whether it is a movement at the rapid speed.
    pub is_rapid: bool,
}

/// A job that is being carried out.
///
/// ```
/// # use vimc4_ncp::job::{Controller, Job, Options, Step, Target};
/// # use vimc4_isel_wire::{Dialect, Mode};
/// # let machine = vimc4_plant::Machine::builtin("bench").unwrap();
/// # let controller = Controller {
/// #     dialect: Dialect::Imc4, speeds: 20..=20_000,
/// #     ramp: vimc4_motion::Ramp { start_stop: 300, acceleration: 100 }, inputs: Default::default(),
/// #     outputs: Default::default(), memory: 32_768, command_bytes: 1, parameter_bytes: 4, branch_from_next: true,
/// # };
/// let target = Target::new(controller, &machine);
/// let mut job = Job::new("IMF_PBL_V1.0\nREF XYZ\nMOVEABS X10000\nPROGEND\n", &target, Options::default());
/// let mut sent = Vec::new();
/// while let Some(order) = job.next(&mut |diagnostic| panic!("{}", diagnostic.problem)) {
///     if let Step::Send(command) = order.step {
///         let mut line = Vec::new();
///         command.print(Dialect::Imc4, Mode::Direct, 0, &mut line);
///         sent.push(String::from_utf8(line).unwrap());
///     }
/// }
/// let axes = ["@07", "@08", "@0z1"];
/// assert_eq!(sent[..3], axes);
/// assert_eq!(sent[3..], ["@0R7", "@0z1", "@0A800,800,0,800,0,800,0,800"]);
/// ```
#[derive(Clone, Debug)]
pub struct Job<'t> {
    reader: Reader<'t>,
    emitter: Emitter,
    actions: VecDeque<Action>,
    scratch: Vec<Action>,
    failed: bool,
    found: Option<Zero>,
    kept: Option<u32>,
    /// The unit of the file, while the operator may use another.
    units: Option<Units>,
}

impl<'t> Job<'t> {
    /// A job at its beginning.
    #[must_use]
    pub fn new(text: &'t str, target: &'t Target, options: Options) -> Job<'t> {
        Job {
            reader: Reader::new(text, target, options),
            emitter: Emitter::new(target),
            actions: VecDeque::new(),
            scratch: Vec::new(),
            failed: false,
            found: None,
            kept: None,
            units: None,
        }
    }

    /// What to do next; `None` at the end, and from a line on that cannot be read or carried out. A
    /// faulty line on which nothing depends is left out.
    pub fn next(&mut self, report: &mut dyn FnMut(Diagnostic)) -> Option<Order> {
        loop {
            if let Some(step) = self.emitter.next() {
                let Reader { number: line, span, .. } = self.reader;
                return Some(Order { line, span, step, is_rapid: self.emitter.is_rapid() });
            }
            if let Some(action) = self.actions.pop_front() {
                self.emitter.begin(action);
                continue;
            }
            if self.failed {
                return None;
            }
            // The operator's lines use the operator's unit, the file its own.
            if let Some(units) = self.units.take() {
                self.reader.interpreter.set_units(units);
            }
            let carried_out = self.reader.line(&mut self.scratch, report)?;
            self.failed = !carried_out;
            self.actions.extend(self.scratch.drain(..));
        }
    }

    /// The line that comes after the one that was read last.
    pub(super) fn next_line(&self) -> u32 {
        self.reader.number + 1
    }

    /// Reads a line without carrying it out.
    pub(super) fn read_line(
        &mut self,
        actions: &mut Vec<Action>,
        report: &mut dyn FnMut(Diagnostic),
    ) -> Option<bool> {
        self.reader.line(actions, report)
    }

    /// Whether there is another line.
    pub(super) fn has_line(&self) -> bool {
        let ended = self.reader.over || self.reader.interpreter.has_ended();
        !ended && self.reader.lines.clone().next().is_some()
    }

    /// Inserts actions before the next line, which count as its own.
    pub(super) fn first(&mut self, line: u32, actions: VecDeque<Action>) {
        self.reader.number = line;
        self.actions = actions;
    }

    /// What holds.
    pub(super) fn interpreter(&self) -> &Interpreter<'t> {
        &self.reader.interpreter
    }

    /// The same, to be changed.
    pub(super) fn interpreter_mut(&mut self) -> &mut Interpreter<'t> {
        &mut self.reader.interpreter
    }

    /// The target that it runs on.
    #[must_use]
    pub fn target(&self) -> &'t Target {
        self.reader.interpreter.target()
    }

    /// Whether it ended with a line that cannot be carried out.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.failed
    }

    /// The line that is being carried out.
    #[must_use]
    pub fn line(&self) -> u32 {
        self.reader.number
    }

    /// Where the counters will be when everything up to here is done. After a line that cannot be
    /// carried out: where it would have gone.
    #[must_use]
    pub fn counters(&self) -> Steps {
        self.reader.interpreter.counters()
    }

    /// The work-piece zero that counts now.
    #[must_use]
    pub fn zero(&self) -> Zero {
        let zero = self.interpreter().standing().zero;
        let axes = self.target().axes;
        Zero(std::array::from_fn(|axis| axes.has(axis).then_some(zero[axis])))
    }

    /// Whether its lines go to the same places as those of another: the zero, the registers, the plane
    /// and the cylinder are the same.
    #[must_use]
    pub fn has_frame_of(&self, other: &Job<'_>) -> bool {
        self.reader.interpreter.has_frame_of(&other.reader.interpreter)
    }

    /// The operator has found the work-piece zero: it is where the tool is.
    pub fn take_zero(&mut self) {
        self.reader.interpreter.take_zero();
        self.found = Some(self.zero());
        self.kept = None;
    }

    /// At a WPTEACH the operator has kept the work-piece zero as it was.
    pub fn keep_zero(&mut self) {
        self.kept = Some(self.reader.number);
    }

    /// The work-piece zero that the operator has found last, even if another one counts now.
    #[must_use]
    pub fn found(&self) -> Option<Zero> {
        self.found
    }

    /// The line of the last WPTEACH, if the operator has kept the zero there.
    #[must_use]
    pub fn kept(&self) -> Option<u32> {
        self.kept
    }

    /// Carries out a line of the operator's, as in a file, and then asks again. A refused line has
    /// no effect: nothing moves and no setting changes. A unit applies to the operator's lines
    /// until the file goes on, which keeps its own. Commands that ask the operator, or end the job,
    /// are refused: they belong in a file. Returns whether the line is carried out.
    pub fn enter(
        &mut self,
        text: &str,
        again: Question,
        report: &mut dyn FnMut(Diagnostic),
    ) -> bool {
        let number = self.reader.number;
        self.units.get_or_insert(self.reader.interpreter.units());
        let mut refused = false;
        let mut told = |diagnostic: Diagnostic| {
            refused |= diagnostic.problem.severity() == Severity::Error;
            report(diagnostic);
        };
        let line = language::parse(text, &mut |span, problem| {
            told(Diagnostic { line: number, span, problem: problem.into(), left_out: false });
        });
        let for_files = line.command.and_then(|command| match command.value {
            Instruction::Halt => Some("HALT"),
            Instruction::Tool(_) => Some("GETTOOL"),
            Instruction::Teach => Some("WPTEACH"),
            Instruction::End => Some("PROGEND"),
            _ => None,
        });
        if let Some(name) = for_files {
            let span = line.command.map(|command| command.span).unwrap_or_default();
            let problem = Problem::ForFiles(name).into();
            told(Diagnostic { line: number, span, problem, left_out: false });
        }
        let (before, span) = (self.reader.interpreter.clone(), self.reader.span);
        let done =
            for_files.is_none() && self.reader.carry_out(&line, &mut self.scratch, &mut told);
        let taken = done && !refused;
        match taken {
            true => self.actions.extend(self.scratch.drain(..)),
            false => {
                self.scratch.clear();
                (self.reader.interpreter, self.reader.span) = (before, span);
            }
        }
        self.actions.push_back(Action::Ask(again));
        taken
    }
}
