//! Who takes part when a job is carried out: a controller that answers, and an attendant who decides.

use std::time::Duration;

use vimc4_catalogue::Handling;
use vimc4_ncp::Problem;
use vimc4_ncp::job::{InputTest, Question};

/// A controller that answers.
pub(crate) trait Channel {
    /// Why it no longer answers.
    type Broken;

    /// Sends a command with its CR and awaits its answer.
    fn command(&mut self, line: &[u8]) -> Result<Vec<u8>, Self::Broken>;

    /// Lets time pass.
    fn wait(&mut self, time: Duration) -> Result<(), Self::Broken>;

    /// Lets time pass until something may have changed, and no longer than this. Anything that the
    /// controller sends meanwhile is unsolicited.
    fn rest(&mut self, longest: Duration) -> Result<Vec<u8>, Self::Broken>;

    /// Sends what goes through the controller to the unit behind it, and awaits what that says.
    fn pass(&mut self, line: &[u8]) -> Result<Vec<u8>, Self::Broken>;

    /// How the controller is handled.
    fn handling(&self) -> &Handling;

    /// Whether a halt is wanted that the controller does not know of; asking clears it.
    fn wants_halt(&mut self) -> bool {
        false
    }

    /// Requests a halt.
    fn want_halt(&mut self) {}

    /// Makes sure that a motion that was stopped rests: START at the panel may have let it go on,
    /// and then it is stopped again. What the motion has answered meanwhile; nothing if it has
    /// rested all the time.
    fn settle(&mut self) -> Result<Vec<u8>, Self::Broken> {
        Ok(Vec::new())
    }

    /// Called while the operator is awaited and nothing moves; notes the present position, so that
    /// changes to the machine are noticed. Returns whether that took time, in which the operator
    /// may have decided.
    fn rests(&mut self) -> Result<bool, Self::Broken> {
        Ok(false)
    }

    /// Whether the reference run that was just answered was stopped, so that its reference is
    /// false; asking clears it.
    fn reference_is_false(&mut self) -> bool {
        false
    }

    /// The input port of a wait was read.
    fn polled(&mut self, _test: InputTest, _read: u8) {}

    /// What the controller shows of the spindle, if it shows it.
    fn spindle(&mut self) -> Result<Option<bool>, Self::Broken> {
        let Some((port, bit)) = self.handling().spindle_shown() else { return Ok(None) };
        let answer = self.command(&question(port))?;
        Ok(byte(&answer).map(|shown| shown & 1 << bit != 0))
    }

    /// Something that a line asks for begins; it may be a movement at the rapid speed.
    fn begins(&mut self, line: u32, is_rapid: bool);

    /// It is done.
    fn done(&mut self);
}

/// The attendant, who decides.
pub(crate) trait Attendant {
    /// What a HALT, a GETTOOL or a WPTEACH in this line asks for.
    fn ask(&mut self, line: u32, question: Question) -> Decision;

    /// An input does not have its level yet.
    fn wait(&mut self, line: u32, test: InputTest) -> Decision;

    /// A motion was stopped.
    fn stopped(&mut self, line: u32) -> Decision;

    /// A halt is wanted while nothing moves: it comes before the next motion.
    fn held(&mut self, _line: u32) -> Decision {
        Decision::GoOn
    }

    /// The question has been settled elsewhere. Returns whether something was typed meanwhile.
    fn leaves(&mut self) -> bool {
        false
    }

    /// A line is about to begin; in line-by-line mode it waits for the attendant.
    fn step(&mut self, _line: u32) -> Decision {
        Decision::GoOn
    }

    /// A command was answered.
    fn answered(&mut self, line: u32, sent: &[u8], answer: &[u8]);

    /// What the attendant has said at a question is done; it stands in no file.
    /// `changes_frame` says whether lines behind it go elsewhere.
    fn entered(&mut self, _line: u32, _question: Question, _typed: &str, _changes_frame: bool) {}

    /// Something that the attendant should know.
    fn tell(&mut self, _text: &str) {}

    /// What the attendant has said cannot be done so.
    fn object(&mut self, problem: Problem);
}

/// What an attendant decides.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Decision {
    /// Go on: it is done. At WPTEACH: the work-piece zero is here.
    GoOn,
    /// At WPTEACH: the work-piece zero stays where it was. At a wait: do not wait any longer.
    Skip,
    /// Not yet; for a wait: check again.
    NotYet,
    /// The answer is not a decision; the question is repeated at once.
    Again,
    /// There is and will be no one to decide.
    Unattended,
    /// First do what this line says.
    First(String),
    /// End the job.
    End,
}

/// How a job ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Ending {
    /// Everything was done.
    Done,
    /// The controller has refused a command.
    Refused { line: u32, sent: Vec<u8>, answer: Vec<u8> },
    /// The attendant has ended it.
    Ended { line: u32 },
    /// It waits for an attendant, and there is none.
    Unattended { line: u32 },
    /// A reference run was stopped, and what it has answered is not a reference.
    FalseReference { line: u32 },
    /// A line could not be carried out, and why.
    Impossible { line: u32, why: String },
}

/// A line as it is sent.
pub(super) fn line_of(text: &str) -> Vec<u8> {
    format!("{text}\r").into_bytes()
}

/// The line that asks for a port.
pub(super) fn question(port: u16) -> Vec<u8> {
    line_of(&format!("@0b{port}"))
}

/// The two digits behind a `0`.
pub(super) fn byte(answer: &[u8]) -> Option<u8> {
    let digits = std::str::from_utf8(answer.strip_prefix(b"0")?).ok()?;
    u8::from_str_radix(digits, 16).ok().filter(|_| digits.len() == 2)
}
