//! The state of a session.

use std::collections::{BTreeMap, VecDeque};

use serde::Serialize;
use serde_json::Value;
use vimc4_debug::Trigger;

use crate::handles::Handles;
use crate::held::{Held, Walk};
use crate::message::{Outgoing, Refusal};
use crate::open::{Configuration, Open};
use crate::points::Point;

/// The most files of a client that may have breakpoints.
pub(crate) const MOST_SOURCES: usize = 1_000;

/// A conversation with a client about controllers.
///
/// Its owner passes in the client's messages ([`receive`](Session::receive)), lets the controllers
/// run ([`run`](Session::run)), and sends the pending messages ([`drain`](Session::drain)). It
/// knows no clock, socket or file.
pub struct Session {
    pub(crate) opener: Box<dyn Open>,
    pub(crate) stage: Stage,
    pub(crate) client: Client,
    pub(crate) configuration: Option<Configuration>,
    /// Whether the client has said that its configuration is done.
    pub(crate) is_configured: bool,
    pub(crate) held: Vec<Held>,
    pub(crate) points: Points,
    pub(crate) runs: VecDeque<Run>,
    /// Controllers that run by themselves.
    pub(crate) away: Vec<Run>,
    /// Whether the client attached rather than launched.
    pub(crate) is_attached: bool,
    /// How many runs there were.
    pub(crate) begun: u64,
    pub(crate) frames: Handles<usize>,
    pub(crate) values: Handles<String>,
    /// Targets of `goto`, by their numbers from 1.
    pub(crate) targets: Vec<(usize, Trigger, bool)>,
    pub(crate) out: Vec<Outgoing>,
}

/// How far a conversation has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    /// Nothing has been said.
    Silent,
    /// Capabilities are exchanged; nothing is open.
    Introduced,
    /// Controllers are there.
    Open,
    /// The controllers have ended.
    Ended,
    /// The client is gone.
    Over,
}

/// What a client is like.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Client {
    /// The number of the first line.
    pub(crate) first_line: i64,
    /// Whether it shows progress.
    pub(crate) shows_progress: bool,
    /// Whether it understands that its views are out of date.
    pub(crate) is_told_what_is_old: bool,
}

/// The breakpoints, as a client sets them.
#[derive(Default)]
pub(crate) struct Points {
    pub(crate) last: u32,
    pub(crate) lines: BTreeMap<String, Vec<Point>>,
    pub(crate) functions: Vec<Point>,
    pub(crate) data: Vec<Point>,
    pub(crate) errors: Vec<Point>,
}

/// A controller on its way.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    pub(crate) number: u64,
    pub(crate) thread: usize,
    pub(crate) walk: Walk,
}

impl Points {
    pub(crate) fn all(&mut self) -> impl Iterator<Item = &mut Point> {
        let lines = self.lines.values_mut().flatten();
        lines.chain(&mut self.functions).chain(&mut self.data).chain(&mut self.errors)
    }
}

/// The result of a request.
pub(crate) type Answered = Result<Value, Refusal>;

/// An answer of a type.
pub(crate) fn answer(body: impl Serialize) -> Answered {
    serde_json::to_value(body).map_err(Refusal::new)
}

/// An empty answer: it is done.
pub(crate) const DONE: Answered = Ok(Value::Null);

impl Session {
    /// A session with a client that has not sent anything yet.
    #[must_use]
    pub fn new(opener: Box<dyn Open>) -> Session {
        Session {
            opener,
            stage: Stage::Silent,
            client: Client { first_line: 1, shows_progress: false, is_told_what_is_old: false },
            configuration: None,
            is_configured: false,
            held: Vec::new(),
            points: Points::default(),
            runs: VecDeque::new(),
            away: Vec::new(),
            is_attached: false,
            begun: 0,
            frames: Handles::default(),
            values: Handles::default(),
            targets: Vec::new(),
            out: Vec::new(),
        }
    }

    /// The pending messages, in order.
    pub fn drain(&mut self) -> Vec<Outgoing> {
        std::mem::take(&mut self.out)
    }

    /// Whether the client has disconnected.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.stage == Stage::Over
    }

    pub(crate) fn tell(&mut self, event: &'static str, body: impl Serialize) {
        self.out.push(Outgoing::event(event, body));
    }

    /// A controller by the number that clients have of it, from 1.
    pub(crate) fn thread(&self, number: i64) -> Result<usize, Refusal> {
        let place = usize::try_from(number).ok().and_then(|number| number.checked_sub(1));
        place.filter(|place| *place < self.held.len()).ok_or_else(|| {
            Refusal(match self.held.len() {
                0 => "no controller is open; launch or attach comes first".to_owned(),
                1 => format!("there is no thread {number}; the controller is thread 1"),
                count => format!("there is no thread {number}; the controllers are 1 to {count}"),
            })
        })
    }

    /// A controller that stands still.
    pub(crate) fn resting(&mut self, number: i64) -> Result<&mut Held, Refusal> {
        let thread = self.thread(number)?;
        if self.held.get(thread).is_some_and(|held| held.is_over) {
            return Err(Refusal(format!("controller {number} has ended; restart begins again")));
        }
        if self.is_on_its_way(thread) {
            return Err(Refusal(format!("controller {number} is on its way; pause comes first")));
        }
        self.held.get_mut(thread).ok_or_else(|| Refusal::new("there is no such thread"))
    }

    /// Ends all runs and releases the controllers that run by themselves.
    pub(crate) fn let_go_of_all(&mut self) {
        self.runs.clear();
        self.away.clear();
        for held in &mut self.held {
            held.opened.live = None;
        }
    }

    /// Whether a controller is running.
    pub(crate) fn is_on_its_way(&self, thread: usize) -> bool {
        self.runs.iter().chain(&self.away).any(|run| run.thread == thread)
    }

    /// The controller of a frame; the first that stands still, where none is said.
    pub(crate) fn of_frame(&self, frame: i64) -> Result<usize, Refusal> {
        if frame != 0 {
            let found = self.frames.get(frame).map(|(thread, _)| *thread);
            return found.ok_or_else(|| {
                Refusal(format!("frame {frame} no longer exists; stackTrace has the present ones"))
            });
        }
        let found = (0..self.held.len())
            .find(|thread| !self.is_on_its_way(*thread) && !self.held[*thread].is_over);
        let are_over = self.held.iter().all(|held| held.is_over) && !self.held.is_empty();
        found.ok_or_else(|| match are_over {
            true => Refusal::new("the controllers have ended; restart begins again"),
            false => Refusal::new("no controller is paused; pause one first"),
        })
    }

    /// A line number as this client counts.
    pub(crate) fn line_out(&self, line: u32) -> i64 {
        i64::from(line) - 1 + self.client.first_line
    }

    /// The line, from 1, for a line number of this client.
    pub(crate) fn line_in(&self, line: i64) -> i64 {
        line.saturating_sub(self.client.first_line).saturating_add(1)
    }
}
