//! Carrying a job out: every command is answered before the next is sent.
//!
//! [`Channel`] hides the differences between virtual time and a real port, and [`Attendant`] makes
//! the decisions of a person.

use std::time::Duration;

use vimc4_catalogue::Handling;
use vimc4_device::{StartButton, Stop, Travel, escape};
use vimc4_ncp::job::{InputTest, Job, Order, Question, Step};
use vimc4_ncp::{Diagnostic, Severity};

use super::channel::{Attendant, Channel, Decision, Ending, byte, line_of, question};
use super::spindle::{RestartReason, SpindleWatch};

/// How often an awaited input is polled: the controller does not report changes.
const LOOK: Duration = Duration::from_millis(100);
/// A person tells.
const LONG: Duration = Duration::from_secs(3_600);

/// What a stopped reference run means, for people.
pub(crate) const FALSE_REFERENCE: &str = "the reference run was stopped, so its reference is false: where \
    the axis was stopped may count as 0; the job has ended there";

/// What there is to do.
#[derive(Clone, Debug)]
pub(crate) enum Work<'t> {
    /// A job file.
    Job(Box<Job<'t>>),
    /// Commands as they are sent, with their lines in the file.
    List(std::vec::IntoIter<(u32, Vec<u8>)>),
    /// The pieces of a plot file.
    Plot(std::vec::IntoIter<Piece>),
}

/// A piece of a plot file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Piece {
    /// Its line in the file; 0 if it is in none.
    pub(crate) line: u32,
    /// What is sent.
    pub(crate) bytes: Vec<u8>,
    /// Whether it is a command; else it goes through to the unit behind the controller.
    pub(crate) is_command: bool,
}

/// One thing to do.
enum Task {
    Send { bytes: Vec<u8>, is_rapid: bool },
    Plot(Piece),
    Dwell(Duration),
    Await(InputTest),
    Ask(Question),
}

impl Work<'_> {
    /// What is next; where the job ends with a line that is wrong, `wrong` has what was wrong first.
    fn next(&mut self, wrong: &mut (u32, String)) -> Option<(u32, Task)> {
        match self {
            Work::List(lines) => {
                lines.next().map(|(line, bytes)| (line, Task::Send { bytes, is_rapid: false }))
            }
            Work::Plot(pieces) => pieces.next().map(|piece| (piece.line, Task::Plot(piece))),
            Work::Job(job) => {
                let Order { line, step, is_rapid, .. } = job.next(&mut |diagnostic| {
                    let is_error = diagnostic.problem.severity() == Severity::Error;
                    if is_error && wrong.0 != diagnostic.line {
                        *wrong = (diagnostic.line, vimc4_script::said(&diagnostic.problem));
                    }
                })?;
                let task = match step {
                    Step::Dwell(micros) => Task::Dwell(Duration::from_micros(micros)),
                    Step::Await(test) => Task::Await(test),
                    Step::Ask(question) => Task::Ask(question),
                    step => {
                        let bytes = step.line(job.target().controller.dialect)?;
                        Task::Send { bytes, is_rapid }
                    }
                };
                Some((line, task))
            }
        }
    }

    /// The line it ended with although more was to come.
    fn impossible(&self) -> Option<u32> {
        match self {
            Work::Job(job) if job.has_failed() => Some(job.line()),
            _ => None,
        }
    }
}

/// Carries everything out. What is to be said about the job's lines was said before.
pub(crate) fn perform<L: Channel>(
    work: &mut Work<'_>,
    link: &mut L,
    attendant: &mut dyn Attendant,
) -> Result<Ending, L::Broken> {
    let mut before = 0;
    let mut wrong = (0, String::new());
    let mut spindle = SpindleWatch::default();
    while let Some((line, task)) = work.next(&mut wrong) {
        // What was typed while nothing was asked comes before what is next.
        let done = if before == 0 { line } else { before };
        if let Some(ending) = hold(done, link, attendant, |attendant| attendant.held(done))? {
            return Ok(ending);
        }
        link.begins(line, matches!(task, Task::Send { is_rapid: true, .. }));
        if std::mem::replace(&mut before, line) != line
            && let Some(ending) = step(line, link, attendant)?
        {
            return Ok(ending);
        }
        let ending = match task {
            Task::Send { bytes, .. } => send(line, &bytes, link, attendant, &mut spindle)?,
            Task::Plot(piece) => plot(&piece, link, attendant)?,
            Task::Dwell(time) => {
                link.wait(time)?;
                spindle.waited(Some(time));
                None
            }
            Task::Await(test) => {
                spindle.waited(None);
                await_input(line, test, link, attendant)?
            }
            Task::Ask(question) => {
                spindle.waited(None);
                ask(line, question, work, link, attendant)?
            }
        };
        if let Some(ending) = ending {
            return Ok(ending);
        }
        link.done();
    }
    Ok(work.impossible().map_or(Ending::Done, |line| Ending::Impossible { line, why: wrong.1 }))
}

/// Lets a line begin, in line-by-line mode after permission.
fn step<L: Channel>(
    line: u32,
    link: &mut L,
    attendant: &mut dyn Attendant,
) -> Result<Option<Ending>, L::Broken> {
    loop {
        match attendant.step(line) {
            Decision::NotYet => rest(link)?,
            Decision::Again => {}
            Decision::Unattended => return Ok(Some(Ending::Unattended { line })),
            Decision::GoOn => return Ok(None),
            _ => return Ok(Some(Ending::Ended { line })),
        }
    }
}

/// Waits for the attendant.
fn rest<L: Channel>(link: &mut L) -> Result<(), L::Broken> {
    match link.rests()? {
        true => Ok(()),
        false => link.rest(LONG).map(drop),
    }
}

/// Sends a command until it is done: one that was stopped goes on with `S`, or by itself when
/// START is pressed.
fn send<L: Channel>(
    line: u32,
    bytes: &[u8],
    link: &mut L,
    attendant: &mut dyn Attendant,
    spindle: &mut SpindleWatch,
) -> Result<Option<Ending>, L::Broken> {
    let travel = link.handling().model().family().travel_of(bytes);
    if !matches!(travel, Travel::Question | Travel::None)
        && let Some(ending) = spindle.check(line, link, attendant)?
    {
        return Ok(Some(ending));
    }
    let mut answer = link.command(bytes)?;
    attendant.answered(line, bytes, &answer);
    // Regardless of its answer, 0 is where the axis was stopped.
    if matches!(travel, Travel::Reference(_))
        && (link.reference_is_false() || answer.starts_with(b"F"))
    {
        return Ok(Some(Ending::FalseReference { line }));
    }
    loop {
        match answer.as_slice() {
            [b'0', ..] | [.., b'\n', b'0'] => return spindle.sent(bytes, link).map(|()| None),
            // Some controllers confirm the stop with a 0 of its own.
            [b'F'] | [b'F', b'0'] => {}
            _ => {
                let sent = bytes.to_vec();
                return Ok(Some(Ending::Refused { line, sent, answer }));
            }
        }
        // What was typed while it moved has stopped it.
        link.wants_halt();
        let decision = attendant.stopped(line);
        let heard = match decision {
            Decision::NotYet => {
                link.rests()?;
                link.rest(LOOK)?
            }
            // Any input stops a motion that START has continued, and only a resting motion is
            // continued.
            _ => link.settle()?,
        };
        if !heard.is_empty() {
            attendant.answered(line, b"", &heard);
        }
        let goes_on = match decision {
            Decision::Unattended => return Ok(Some(Ending::Unattended { line })),
            Decision::GoOn | Decision::NotYet | Decision::Again if !heard.is_empty() => {
                // This is how the motion continued by START has ended.
                let was_typed = attendant.leaves() || decision != Decision::NotYet;
                if was_typed {
                    link.want_halt();
                }
                if heard == link.handling().done
                    && !spindle.is_on(link)?
                    && let Some(ending) =
                        spindle.put_back(line, RestartReason::Started, link, attendant)?
                {
                    return Ok(Some(ending));
                }
                answer = heard;
                continue;
            }
            Decision::GoOn => true,
            Decision::NotYet => match link.handling().stop.map(|stop| stop.start) {
                Some(StartButton::IsSeen { question, bit }) => {
                    let shown = byte(&link.command(&line_of(question))?);
                    shown.is_some_and(|shown| shown & 1 << bit != 0)
                }
                Some(StartButton::Resumes) | None => false,
            },
            Decision::Again => false,
            _ => return Ok(Some(Ending::Ended { line })),
        };
        if let (true, Some(stop)) = (goes_on, link.handling().stop) {
            match resume(line, stop, link, attendant, spindle)? {
                Ok(next) => answer = next,
                Err(ending) => return Ok(Some(ending)),
            }
        }
    }
}

/// Goes on with a motion that was stopped, once the spindle runs as the job has it. What that is
/// answered.
fn resume<L: Channel>(
    line: u32,
    stop: Stop,
    link: &mut L,
    attendant: &mut dyn Attendant,
    spindle: &SpindleWatch,
) -> Result<Result<Vec<u8>, Ending>, L::Broken> {
    if let Some(ending) = spindle.put_back(line, RestartReason::GoesOn, link, attendant)? {
        return Ok(Err(ending));
    }
    if stop.start == StartButton::Resumes && spindle.is_wanted() {
        // START may have let it go on while the spindle ran up.
        let heard = link.settle()?;
        if !heard.is_empty() {
            attendant.answered(line, b"", &heard);
            return Ok(Ok(heard));
        }
    }
    let resume = line_of(stop.resume);
    let answer = link.command(&resume)?;
    attendant.answered(line, &resume, &answer);
    Ok(Ok(answer))
}

/// Sends a piece of a plot file until it is completed. Nothing on the line stops what has begun,
/// so a halt that is wanted comes after it.
fn plot<L: Channel>(
    piece: &Piece,
    link: &mut L,
    attendant: &mut dyn Attendant,
) -> Result<Option<Ending>, L::Broken> {
    let &Piece { line, ref bytes, is_command } = piece;
    let answer = if is_command { link.command(bytes)? } else { link.pass(bytes)? };
    attendant.answered(line, bytes, &answer);
    // A unit answers 1 or 2 if it fails.
    let fails = |said: &[u8]| said.starts_with(b"E") || !is_command && matches!(said, b"1" | b"2");
    if let Some(failure) = answer.split(|byte| *byte == b'\r').find(|said| fails(said)) {
        let answer = failure.to_vec();
        return Ok(Some(Ending::Refused { line, sent: bytes.clone(), answer }));
    }
    hold(line, link, attendant, |attendant| attendant.stopped(line))
}

/// Waits while a halt is wanted that the controller does not know of.
fn hold<L: Channel>(
    line: u32,
    link: &mut L,
    attendant: &mut dyn Attendant,
    decide: impl Fn(&mut dyn Attendant) -> Decision,
) -> Result<Option<Ending>, L::Broken> {
    if !link.wants_halt() {
        return Ok(None);
    }
    loop {
        match decide(attendant) {
            Decision::GoOn => return Ok(None),
            Decision::NotYet => rest(link)?,
            Decision::Again => {}
            Decision::Unattended => return Ok(Some(Ending::Unattended { line })),
            _ => return Ok(Some(Ending::Ended { line })),
        }
    }
}

fn await_input<L: Channel>(
    line: u32,
    test: InputTest,
    link: &mut L,
    attendant: &mut dyn Attendant,
) -> Result<Option<Ending>, L::Broken> {
    let question = question(test.port);
    loop {
        let answer = link.command(&question)?;
        let Some(read) = byte(&answer) else {
            return Ok(Some(Ending::Refused { line, sent: question, answer }));
        };
        link.polled(test, read);
        if test.is_met_by(read) {
            if attendant.leaves() {
                link.want_halt();
            }
            return Ok(None);
        }
        match attendant.wait(line, test) {
            Decision::NotYet => {
                link.rests()?;
                drop(link.rest(LOOK)?);
            }
            Decision::Again => {}
            Decision::Unattended => return Ok(Some(Ending::Unattended { line })),
            Decision::GoOn | Decision::Skip => return Ok(None),
            _ => return Ok(Some(Ending::Ended { line })),
        }
    }
}

fn ask<L: Channel>(
    line: u32,
    question: Question,
    work: &mut Work<'_>,
    link: &mut L,
    attendant: &mut dyn Attendant,
) -> Result<Option<Ending>, L::Broken> {
    loop {
        let decision = attendant.ask(line, question);
        // Only a job file asks.
        let Work::Job(job) = work else { return Ok(None) };
        match decision {
            Decision::NotYet => {
                rest(link)?;
                continue;
            }
            Decision::GoOn if question == Question::Teach => job.take_zero(),
            Decision::Skip if question == Question::Teach => job.keep_zero(),
            Decision::First(typed) => {
                let mut object = |diagnostic: Diagnostic| attendant.object(diagnostic.problem);
                let before = job.clone();
                if job.enter(&typed, question, &mut object) {
                    attendant.entered(line, question, &typed, !job.has_frame_of(&before));
                }
            }
            Decision::Again => continue,
            Decision::Unattended => return Ok(Some(Ending::Unattended { line })),
            Decision::GoOn | Decision::Skip => {}
            Decision::End => return Ok(Some(Ending::Ended { line })),
        }
        return Ok(None);
    }
}

/// What an answer refuses, for people.
pub(crate) fn refusal(handling: &Handling, sent: &[u8], answer: &[u8]) -> String {
    handling.refusal(sent, answer).unwrap_or_else(|| format!("`{}`", escape(answer)))
}

/// What became of a command, in the words of [`refusal`], for people.
pub(crate) fn refused(sent: &[u8], answer: &[u8], refusal: &str) -> String {
    match answer {
        b"" => format!("{} was not answered", shown(sent)),
        _ => format!("{} was answered {refusal}", shown(sent)),
    }
}

/// A command, for people.
pub(crate) fn shown(sent: &[u8]) -> String {
    let text = sent.strip_suffix(b"\r").unwrap_or(sent);
    escape(text.strip_suffix(b";").unwrap_or(text)).to_string()
}
