//! What came of a fault, in a form that is equal for equal behaviour.

use serde::{Deserialize, Serialize};
use vimc4_device::{Grouped, escape};

use crate::account::{Account, End, Exchange};
use crate::plan::shown;

/// So many different lines in a row tell one behaviour from another.
const TOLD: usize = 12;

/// An answer of at most so many bytes is what it says; of a longer one it only counts that it differs.
const SHORT: usize = 3;

/// How the host ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Exit {
    /// There was none: the session is a recording.
    Played,
    /// With an exit code.
    Code(i32),
    /// By this signal.
    Signal(i32),
    /// It did not end in time.
    Hung,
    /// The host itself reported nothing, but an assertion of its test failed.
    Asserted,
    /// The host itself reported nothing, but something that its test expects of the machine or the conversation was
    /// not so.
    Unmet,
}

/// The first thing that the host heard otherwise than without the fault.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Cue {
    /// What it had said: the line without its numbers.
    pub said: String,
    /// What it heard.
    pub heard: Heard,
}

/// What a host heard.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Heard {
    /// Nothing.
    Nothing,
    /// Less than it should have.
    Part,
    /// The right answer with more before or after it.
    More,
    /// A short answer, which is another one.
    Instead(String),
    /// A long answer that says something else.
    Otherwise,
}

/// How a host went on.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Then {
    /// As without the fault, to the end.
    AsBefore,
    /// It said nothing more.
    SaidNothing,
    /// As without the fault, but it ended early.
    EndedEarly,
    /// It said this, without its numbers, and then went on as without the fault.
    Rejoined(Vec<String>),
    /// It said this, without its numbers, to the end.
    Otherwise(Vec<String>),
}

/// How the machine stood at the end, against how it stands without a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MachineEnd {
    /// Where it should be.
    InPlace,
    /// Where it should be, but the controller believes something else.
    Miscounted,
    /// Elsewhere, and the controller knows.
    Elsewhere,
    /// Elsewhere, and the controller does not know.
    StepsLost,
    /// It does not come to rest.
    Busy,
}

/// What is wrong with a host.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It does not end.
    Hung,
    /// It ended by a signal.
    Crashed,
    /// It moved axes of which the controller did not know where they are.
    MovedUnreferenced,
    /// It went on after a wrong answer, or without one, until an expectation of its test was not met.
    Unmet,
    /// It reported success, or left the error to an assertion of its test, and the machine is not where it
    /// should be.
    FalseSuccess,
}

/// What came of a fault. It is equal for runs in which a host behaves equally, wherever the fault struck
/// and whatever the numbers were.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Outcome {
    /// What is wrong with it, the worst first.
    pub verdicts: Vec<Verdict>,
    /// How the host ended.
    pub exit: Exit,
    /// What it heard first that it should not have heard.
    pub cue: Option<Cue>,
    /// How it went on. In a recording, whose lines are what they are: what was answered otherwise.
    pub then: Then,
    /// How the machine stood in the end.
    pub machine: MachineEnd,
    /// Whether there was power in the end.
    pub powered: bool,
}

/// Where an account differs from that without a fault.
pub(crate) struct Parting {
    pub(crate) outcome: Outcome,
    /// The exchange in which the cue was heard.
    pub(crate) cue: Option<usize>,
}

impl Outcome {
    /// What came of a fault, by what happened with it and without it.
    #[must_use]
    pub fn new(clean: &Account, seen: &Account, exit: Exit) -> Outcome {
        part(clean, seen, 0, exit).outcome
    }

    /// Whether the fault made no difference.
    #[must_use]
    pub fn is_same(&self) -> bool {
        self.verdicts.is_empty()
            && self.cue.is_none()
            && self.then == Then::AsBefore
            && self.machine == MachineEnd::InPlace
            && matches!(self.exit, Exit::Played | Exit::Code(0))
    }

    /// What is to be said about the host in a few words, for people.
    #[must_use]
    pub fn title(&self) -> &'static str {
        match (self.verdicts.first(), self.exit, self.machine) {
            (Some(Verdict::Hung), ..) => "it hangs",
            (Some(Verdict::Crashed), ..) => "it crashes",
            (Some(Verdict::MovedUnreferenced), ..) => "it moves before it has made a reference run",
            (Some(Verdict::Unmet), ..) => "it goes on, and an expectation of the test is not met",
            (Some(Verdict::FalseSuccess), Exit::Asserted, _) => {
                "only an assertion of the test fails, and the machine is not where it should be"
            }
            (Some(Verdict::FalseSuccess), ..) => {
                "it reports success, but the machine is not where it should be"
            }
            (None, Exit::Played, _) if self.is_same() => "nothing differs",
            (None, Exit::Played, MachineEnd::InPlace) => "the answers differ",
            (None, Exit::Played, _) if self.cue.is_none() => {
                "no answer differs, but the machine is not where it should be"
            }
            (None, Exit::Played, _) => "the answers differ, and so does the place of the machine",
            (None, Exit::Code(0), _) => "it finishes, and the machine is where it should be",
            (None, Exit::Asserted, MachineEnd::InPlace | MachineEnd::Miscounted) => {
                "an assertion of the test fails, and the machine is where it should be"
            }
            (None, ..) => "it reports an error",
        }
    }

    /// What the host heard, for people.
    #[must_use]
    pub fn heard(&self) -> String {
        let Some(Cue { said, heard }) = &self.cue else {
            return "what it always hears".to_owned();
        };
        match heard {
            Heard::Nothing => format!("no answer to {said}"),
            Heard::Part => format!("less than a whole answer to {said}"),
            Heard::More => format!("more than the answer to {said}"),
            Heard::Instead(text) => format!("`{text}` as the answer to {said}"),
            Heard::Otherwise => format!("another answer to {said}"),
        }
    }

    /// What the host did, for people.
    #[must_use]
    pub fn did(&self) -> String {
        let list = |lines: &[String]| lines.join(", ");
        let is_played = self.exit == Exit::Played;
        let went_on = match &self.then {
            Then::AsBefore if is_played => "every other answer was the same".to_owned(),
            Then::Otherwise(lines) if is_played => format!("then differs: {}", list(lines)),
            // It did no more than that.
            Then::AsBefore if matches!(self.exit, Exit::Hung | Exit::Signal(_)) => {
                "sent all that it always sends".to_owned()
            }
            Then::AsBefore => "went on as if nothing had happened".to_owned(),
            Then::SaidNothing => "said nothing more".to_owned(),
            Then::EndedEarly => "went on as if nothing had happened, but ended early".to_owned(),
            Then::Rejoined(lines) if lines.is_empty() => {
                "left lines out, and went on as usual".to_owned()
            }
            Then::Rejoined(lines) => format!("sent {}, and went on as usual", list(lines)),
            Then::Otherwise(lines) => format!("sent {}, and nothing more", list(lines)),
        };
        match self.exit {
            Exit::Played => went_on,
            Exit::Code(0) => format!("{went_on}; exit code 0: success"),
            Exit::Code(code) => format!("{went_on}; exit code {code}: an error"),
            Exit::Signal(signal) => format!("{went_on}; killed by signal {signal}"),
            Exit::Hung => format!("{went_on}; did not end within the time limit"),
            Exit::Asserted => format!("{went_on}; only an assertion of the test failed"),
            Exit::Unmet => format!("{went_on}; an expectation of the test was not met"),
        }
    }

    /// What it should have noticed and done, for people. `why` is what the controller knows of its
    /// answer; an answer that is `late` comes with the next one.
    #[must_use]
    pub fn should(&self, why: Option<&str>, late: bool) -> Option<String> {
        let verdict = self.verdicts.first()?;
        let noticed = match self.cue.as_ref().map(|cue| &cue.heard) {
            None => "no answer tells it; only reading the position back, or a reference run, does"
                .to_owned(),
            Some(Heard::Nothing | Heard::Part) if late => {
                "the answer comes later, before that to another command, and must not be taken for it; \
                 throw away what is late before sending the next command"
                    .to_owned()
            }
            Some(Heard::Nothing | Heard::Part) => {
                "an answer that does not come in time leaves open whether the command was done"
                    .to_owned()
            }
            Some(Heard::More) => "what comes before the answer, or after it, belongs to another \
                                  command; throw away what is late before sending the next one"
                .to_owned(),
            Some(Heard::Instead(_)) => match why {
                Some(why) => format!("the answer means: {why}"),
                None => "the answer is none that this command has".to_owned(),
            },
            Some(Heard::Otherwise) => "the answer says something else than it should".to_owned(),
        };
        let remedy = match verdict {
            Verdict::Hung => "wait for a limited time, then report an error",
            Verdict::Crashed => "report an error",
            Verdict::MovedUnreferenced => {
                "the position is unknown then: make a reference run before the next move, or report \
                 an error"
            }
            Verdict::Unmet => {
                "report an error, or undo what the fault has changed, before the next command"
            }
            Verdict::FalseSuccess => {
                "report an error, or recover: a reference run, and the move once more"
            }
        };
        Some(format!("{noticed}; {remedy}"))
    }
}

/// Compares an account with that without a fault. Of the exchanges so many come before those seen.
pub(crate) fn part(clean: &Account, seen: &Account, before: usize, exit: Exit) -> Parting {
    let expected = clean.exchanges.get(before..).unwrap_or_default();
    let differs = expected
        .iter()
        .zip(&seen.exchanges)
        .position(|(expected, seen)| expected.said != seen.said || expected.heard != seen.heard);
    let first = differs.unwrap_or_else(|| expected.len().min(seen.exchanges.len()));
    let pair = expected.get(first).zip(seen.exchanges.get(first));
    let cue = pair.filter(|(expected, seen)| expected.said == seen.said);
    let rest = first + usize::from(cue.is_some());
    let expected_rest = expected.get(rest..).unwrap_or_default();
    let seen_rest = seen.exchanges.get(rest..).unwrap_or_default();
    let then = match exit {
        Exit::Played => answered_otherwise(expected_rest, seen_rest),
        _ => went_on(expected_rest, seen_rest),
    };
    let place = cue.map(|_| first);
    let cue = cue.map(|(expected, seen)| Cue {
        said: without_numbers(&seen.said),
        heard: heard(&expected.heard, &seen.heard),
    });
    let machine = machine(&clean.end, &seen.end);
    let is_elsewhere = !matches!(machine, MachineEnd::InPlace | MachineEnd::Miscounted);
    let known =
        |(name, _): &&(String, usize)| !clean.unreferenced.iter().any(|(clean, _)| clean == name);
    let mut verdicts = Vec::new();
    match exit {
        Exit::Hung => verdicts.push(Verdict::Hung),
        Exit::Signal(_) => verdicts.push(Verdict::Crashed),
        _ => {}
    }
    if exit != Exit::Played && seen.unreferenced.iter().any(|axis| known(&axis)) {
        verdicts.push(Verdict::MovedUnreferenced);
    }
    let is_silent = match exit {
        Exit::Code(0) => true,
        Exit::Asserted => !is_about_answer(cue.as_ref(), seen_rest),
        _ => false,
    };
    if exit == Exit::Unmet && !is_about_answer(cue.as_ref(), seen_rest) {
        verdicts.push(Verdict::Unmet);
    }
    if is_silent && is_elsewhere {
        verdicts.push(Verdict::FalseSuccess);
    }
    let powered = seen.end.powered;
    Parting { outcome: Outcome { verdicts, exit, cue, then, machine, powered }, cue: place }
}

/// Whether an assertion or an expectation of the test is about the wrong answer itself, which the host has returned to it: nothing
/// was said since. What a longer answer says, such as a position, is the end state that the test asks for.
fn is_about_answer(cue: Option<&Cue>, rest: &[Exchange]) -> bool {
    rest.is_empty() && cue.is_some_and(|cue| cue.heard != Heard::Otherwise)
}

/// What is answered otherwise in lines that are what they are.
fn answered_otherwise(expected: &[Exchange], seen: &[Exchange]) -> Then {
    let pairs = expected.iter().zip(seen).filter(|(expected, seen)| expected.heard != seen.heard);
    let otherwise = pairs.map(|(expected, seen)| {
        let said = without_numbers(&seen.said);
        match heard(&expected.heard, &seen.heard) {
            Heard::Nothing => format!("{said} nothing"),
            Heard::Part => format!("{said} less"),
            Heard::More => format!("{said} more"),
            Heard::Instead(text) => format!("{said} `{text}`"),
            Heard::Otherwise => format!("{said} otherwise"),
        }
    });
    let otherwise = collapsed(otherwise);
    if otherwise.is_empty() { Then::AsBefore } else { Then::Otherwise(otherwise) }
}

fn went_on(expected: &[Exchange], seen: &[Exchange]) -> Then {
    let is_same = |(one, other): &(&Exchange, &Exchange)| one.said == other.said;
    let same = expected.iter().zip(seen).take_while(is_same).count();
    let (expected, seen) = (&expected[same..], &seen[same..]);
    match (expected.is_empty(), seen.is_empty()) {
        (true, true) => return Then::AsBefore,
        (false, true) if same == 0 => return Then::SaidNothing,
        (false, true) => return Then::EndedEarly,
        _ => {}
    }
    let pairs = expected.iter().rev().zip(seen.iter().rev());
    let end = pairs.take_while(is_same).count();
    let said = seen[..seen.len() - end].iter().map(|exchange| without_numbers(&exchange.said));
    let said = collapsed(said);
    if end > 0 { Then::Rejoined(said) } else { Then::Otherwise(said) }
}

/// The same without what is said again and again, and no longer than needed to tell it apart.
fn collapsed(lines: impl Iterator<Item = String>) -> Vec<String> {
    let mut told: Vec<String> = Vec::new();
    for line in lines {
        if told.contains(&line) {
            continue;
        }
        if told.len() == TOLD {
            told.push("…".to_owned());
            break;
        }
        told.push(line);
    }
    told
}

fn heard(expected: &[u8], seen: &[u8]) -> Heard {
    if seen.is_empty() {
        Heard::Nothing
    } else if expected.starts_with(seen) || seen.len() < expected.len() {
        Heard::Part
    } else if seen.len() > expected.len() {
        // An answer of another sort is told as such.
        let is_part = expected.is_empty() || seen.windows(expected.len()).any(|w| w == expected);
        if is_part || seen.len() > SHORT { Heard::More } else { Heard::Instead(escape(seen)) }
    } else if seen.len() <= SHORT {
        Heard::Instead(escape(seen))
    } else {
        Heard::Otherwise
    }
}

/// A line as it is told from others: its numbers do not matter.
fn without_numbers(line: &[u8]) -> String {
    let text = shown(line);
    let mut told = String::new();
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        let begins = matches!(c, '-' | '+') && chars.peek().is_some_and(char::is_ascii_digit);
        if !c.is_ascii_digit() && !begins {
            told.push(c);
            continue;
        }
        while chars.next_if(|c| c.is_ascii_digit() || *c == '.').is_some() {}
        told.push('#');
    }
    told
}

fn machine(clean: &End, seen: &End) -> MachineEnd {
    if seen.busy && !clean.busy {
        return MachineEnd::Busy;
    }
    let pairs = || clean.axes.iter().zip(&seen.axes);
    let lost = |axis: &crate::AxisEnd| axis.carriage - axis.position;
    if pairs().all(|(clean, seen)| clean.carriage == seen.carriage) {
        let counted = pairs().all(|(clean, seen)| clean.position == seen.position);
        return if counted { MachineEnd::InPlace } else { MachineEnd::Miscounted };
    }
    match pairs().all(|(clean, seen)| lost(clean) == lost(seen)) {
        true => MachineEnd::Elsewhere,
        false => MachineEnd::StepsLost,
    }
}

/// Where the axes are, against where they should be, for people.
pub(crate) fn whereabouts(clean: &End, seen: &End) -> String {
    let mut said = Vec::new();
    for (clean, seen) in clean.axes.iter().zip(&seen.axes) {
        if clean.carriage != seen.carriage {
            let (at, right) = (Grouped(seen.carriage), Grouped(clean.carriage));
            said.push(format!("{} at {at} instead of {right}", seen.name));
            if seen.position - seen.carriage != clean.position - clean.carriage {
                said.push(format!("where the controller counts {}", Grouped(seen.position)));
            }
        } else if clean.position != seen.position {
            let (counts, right) = (Grouped(seen.position), Grouped(clean.position));
            said.push(format!("{} in place, counted {counts} instead of {right}", seen.name));
        }
        if clean.referenced && !seen.referenced {
            said.push(format!("{} not referenced", seen.name));
        }
    }
    if !seen.powered {
        said.push("no power".to_owned());
    }
    if said.is_empty() { "as it should be".to_owned() } else { said.join(", ") }
}
