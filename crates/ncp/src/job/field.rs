//! A job as a data field: a program that the controller stores and runs by itself.

use vimc4_isel_wire::{AxisSet, Bit, BitTest, Command, Mode};

use super::action::{InputTest, OutputChange};
use super::emitter::Step;
use super::interpreter::Options;
use super::problem::Problem;
use super::run::{Job, Order};
use super::target::Target;
use super::unmapped::Unmapped;
use crate::diagnostic::Diagnostic;
use crate::language::Span;

/// A data field: the lines between `@0i` and the `9` at its end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// The axes that must be set before it is stored.
    pub axes: AxisSet,
    /// Its lines, each with LF, the last of them `9`.
    pub text: String,
    /// How many lines there are.
    pub lines: u32,
    /// How many bytes of the controller's memory it takes.
    pub bytes: u32,
}

/// µs in a tenth of a second.
const TENTH: u64 = 100_000;

/// Turns a job into a data field; `None` if it is larger than the controller's memory, or if a line
/// cannot be carried out. Lines that cannot be expressed in a data field are reported as errors and
/// left out, and so are unreadable lines on which nothing depends.
pub fn compile(
    text: &str,
    target: &Target,
    options: Options,
    report: &mut dyn FnMut(Diagnostic),
) -> Option<Field> {
    let mut writer = Writer {
        target,
        field: Field { axes: target.axes, text: String::new(), lines: 0, bytes: 0 },
        line: Vec::new(),
    };
    let mut unmapped = Unmapped::default();
    let mut too_large = None;
    let mut job = Job::new(text, target, options);
    while let Some(Order { line, span, step, .. }) =
        job.next(&mut |said| unmapped.pass(said, report))
    {
        if let Err(problem) = writer.step(step) {
            report(Diagnostic { line, span, problem: problem.into(), left_out: false });
        }
        if !writer.fits() {
            too_large.get_or_insert((line, span));
        }
    }
    unmapped.report(report);
    writer.push(&Command::End);
    if !writer.fits() {
        let (line, span) = too_large.unwrap_or((job.line(), Span::default()));
        let (needed, there) = (writer.field.bytes, target.controller.memory);
        let problem = Problem::TooLarge { needed, there }.into();
        report(Diagnostic { line, span, problem, left_out: false });
    }
    (writer.fits() && !job.has_failed()).then_some(writer.field)
}

struct Writer<'t> {
    target: &'t Target,
    field: Field,
    line: Vec<u8>,
}

impl Writer<'_> {
    /// Writes a step, and reports problems with it.
    fn step(&mut self, step: Step) -> Result<(), Problem> {
        match step {
            // The axes are stored with the field, not in it.
            Step::Send(Command::SetAxes(_)) => Ok(()),
            Step::Send(command) => {
                self.push(&command);
                Ok(())
            }
            Step::Output(OutputChange { port, bit, value }, _) => {
                self.push(&Command::SetPort(BitTest { port, bit: bit_of(bit), value }));
                Ok(())
            }
            Step::Dwell(micros) => self.dwell(micros),
            Step::Await(test) => {
                self.wait(test);
                Ok(())
            }
            Step::Ask(_) => Err(Problem::NoOperator),
        }
    }

    /// Whether what is written fits into the controller's memory.
    fn fits(&self) -> bool {
        self.field.bytes <= self.target.controller.memory
    }

    fn dwell(&mut self, micros: u64) -> Result<(), Problem> {
        let tenths = micros.div_ceil(TENTH);
        self.push(&Command::Delay { tenths: u32::try_from(tenths).unwrap_or(u32::MAX) });
        match tenths * TENTH == micros {
            true => Ok(()),
            false => Err(Problem::WaitRounded(tenths * 100)),
        }
    }

    /// Loops until the input has the level. A branch leaves the loop when its test holds.
    fn wait(&mut self, test: InputTest) {
        let InputTest { port, bit, value } = test;
        // The target of a branch by 0 lines: itself, or the line after it.
        let own = if self.target.controller.branch_from_next { -1 } else { 0 };
        if bit.is_some() {
            let test = BitTest { port, bit: bit_of(bit), value: 1 - value.min(1) };
            return self.push(&Command::BranchIf { test, offset: own });
        }
        let test = BitTest { port, bit: Bit::Byte, value };
        self.push(&Command::BranchIf { test, offset: own + 2 });
        self.push(&Command::Branch { offset: -1 });
    }

    /// Writes a command, or only counts it where the memory has ended.
    fn push(&mut self, command: &Command) {
        let controller = &self.target.controller;
        self.line.clear();
        command.print(controller.dialect, Mode::Stored, 0, &mut self.line);
        // A mnemonic is one character, and its parameters follow at once.
        let parameters = match self.line.len() {
            0 | 1 => 0,
            _ => 1 + self.line.iter().filter(|&&byte| byte == b',').count() as u32,
        };
        let bytes = controller.command_bytes + controller.parameter_bytes * parameters;
        self.field.bytes = self.field.bytes.saturating_add(bytes);
        if !self.fits() {
            return;
        }
        self.field.lines += 1;
        self.field.text.extend(self.line.iter().map(|&byte| char::from(byte)));
        self.field.text.push('\n');
    }
}

fn bit_of(bit: Option<u8>) -> Bit {
    bit.map_or(Bit::Byte, Bit::One)
}
