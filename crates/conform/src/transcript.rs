//! How a session goes, step by step, for people to read: what was done, when, what came, and where the
//! machine was then.

use std::borrow::Cow;
use std::collections::BTreeSet;

use serde::Serialize;
use vimc4_device::{Activity, Device, Line};

use crate::format::Session;
use crate::play::{Drive, Glance, play_watched};
use crate::script::{Action, escape};
use crate::workshop::Workshop;

/// How a session went.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Transcript {
    /// The lines of its script, up to the one that went wrong.
    pub lines: Vec<Told>,
    /// The commands that were executed.
    #[serde(skip)]
    pub commands: BTreeSet<Cow<'static, str>>,
    /// What went otherwise than the session says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<Deviation>,
}

/// One line of the script as it went.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Told {
    /// As the script says it.
    pub text: String,
    /// The model's time at its end, in nanoseconds since the controller was switched on.
    pub at: u64,
    /// How long it took, in nanoseconds.
    pub took: u64,
    /// What came meanwhile, with escapes as scripts have them.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub heard: String,
    /// Why an error was answered, in the words of the log.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    /// The step counters, as many as the controller has axes.
    pub position: Vec<i64>,
    /// What the controller is doing then.
    pub doing: Activity,
}

/// A step that went otherwise.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Deviation {
    /// As the script says it.
    pub text: String,
    /// What should have been.
    pub expected: String,
    /// What was.
    pub got: String,
}

/// Plays a session on a model and tells how it went.
///
/// # Errors
///
/// If there is no such model or machine, or a value of a profile cannot be.
pub fn transcript(session: &Session, model: &str) -> Result<Transcript, String> {
    let workshop = Workshop::new(session, model)?;
    // A line of its own only where it matters, as in the tests.
    Ok(if session.line_pacing {
        on(session, |flash| workshop.build(flash).map(Line::paced))
    } else if session.has_faults() {
        on(session, |flash| workshop.build(flash).map(Line::ideal))
    } else {
        on(session, |flash| workshop.build(flash))
    })
}

fn on<D: Device>(session: &Session, build: impl Fn(&[u8]) -> Result<D, String>) -> Transcript {
    let mut lines: Vec<Told> = Vec::new();
    // Where the steps have come to, which may be in the midst of a line: `> LINE -> REPLY` is two.
    let mut done = 0;
    let played = play_watched(session, Drive::Smooth, build, |glance| {
        let Some(step) = session.steps.get(glance.step) else { return };
        let told = told(&step.text, &glance);
        let is_reply = matches!(step.action, Action::Expect(_)) && !step.text.starts_with('<');
        match lines.last_mut().filter(|_| is_reply) {
            Some(line) => line.goes_on(told),
            None => lines.push(told),
        }
        done = glance.step + 1;
    });
    let (commands, failure) = match played {
        Ok((record, _)) => (record.commands, None),
        Err(failure) => (BTreeSet::new(), Some(failure)),
    };
    let failure = failure.map(|failure| Deviation {
        text: session.steps.get(done).map_or("the end", |step| &step.text).to_owned(),
        expected: failure.expected().to_owned(),
        got: failure.got().to_owned(),
    });
    Transcript { lines, commands, failure }
}

impl Told {
    /// The second step of a line.
    fn goes_on(&mut self, told: Told) {
        let took = self.took + told.took;
        let heard = std::mem::take(&mut self.heard) + &told.heard;
        let why = told.why.or(self.why.take());
        *self = Told { took, heard, why, ..told };
    }
}

fn told<D: Device>(text: &str, glance: &Glance<'_, D>) -> Told {
    let heard: Vec<u8> = glance.heard.iter().map(|(_, byte)| *byte).collect();
    let view = glance.device.view(glance.ended);
    Told {
        text: text.to_owned(),
        at: glance.ended.as_nanos(),
        took: glance.ended.nanos_since(glance.began),
        heard: escape(&heard),
        why: glance.why.map(str::to_owned),
        position: view.axes.iter().map(|axis| axis.position).collect(),
        doing: view.activity,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::sessions;

    fn told_of(id: &str, model: &str, change: impl Fn(&mut Session)) -> Transcript {
        let mut session = sessions().unwrap().into_iter().find(|session| session.id == id).unwrap();
        change(&mut session);
        transcript(&session, model).unwrap()
    }

    #[test]
    fn a_session_is_told_line_by_line() {
        let told = told_of("isel/stop/software-stop/goes-on", "imc-s8", |_| {});
        assert_eq!(told.failure, None);
        let line = |text: &str| told.lines.iter().find(|line| line.text.starts_with(text)).unwrap();
        assert_eq!(line("! 253").doing, Activity::Move);
        assert_eq!((line("< F").heard.as_str(), line("< F").doing), ("F", Activity::Idle));
        // One line with two steps: its answer, and all of its time.
        let rest = line("> @0S -> 0 at 391.19ms");
        assert_eq!((rest.heard.as_str(), rest.took), ("0", 391_190_000));
        assert_eq!(rest.position[0], 5_000);
        assert_eq!(told.lines.last().unwrap().heard, "G");
    }

    #[test]
    fn it_is_told_up_to_what_went_otherwise() {
        let told = told_of("isel/stop/software-stop/goes-on", "imc-s8", |session| {
            session.profile = toml::from_str("[quirks]\nstop_reply = \"F0\"").unwrap();
        });
        let failure = told.failure.unwrap();
        assert_eq!(failure.text, "> @0P -> 00007ED000000000000");
        assert!(failure.got.starts_with("000007ED"), "{failure:?}");
    }
}
