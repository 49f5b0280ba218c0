//! What happened at a controller, numbered, as far back as it is kept.

use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use vimc4_device::{CommandNumber, Event, Kinds, Motion, Stamp, Time};
use vimc4_journal::{Entry, Journal, Picture, What as Happened};
use vimc4_session::{Deed, EventFilter, LineEvent, Report, ReportKind, Sink};

use crate::limits::HISTORY;

/// So many commands that are not answered yet are remembered, for their answers.
const UNANSWERED: usize = 64;

/// What happened at a controller. The controller writes, and whoever asks reads: nothing is put into
/// words or JSON before somebody does.
pub struct Feed {
    kept: Mutex<Kept>,
    /// So many entries are kept.
    most: usize,
    ring: Ring,
}

impl fmt::Debug for Feed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Feed").field("kept", &self.kept).finish_non_exhaustive()
    }
}

#[derive(Debug, Default)]
struct Kept {
    /// How things stood before the first of them.
    start: Picture,
    items: VecDeque<Arc<Item>>,
    /// The number of the last one.
    last: u64,
    /// The last commands.
    begun: VecDeque<(CommandNumber, Arc<Item>)>,
    /// The motion that has begun, or its last change.
    course: Option<Arc<Item>>,
    /// It was put into another state, and no motion has been told of since: one may be under way.
    is_elsewhere: bool,
}

/// One thing that happened.
#[derive(Debug)]
pub struct Item {
    /// Its number, from 1.
    pub number: u64,
    /// What.
    pub report: Report,
    /// What a command means, in words.
    pub means: Box<str>,
    /// The command that it belongs to.
    pub command: Option<Arc<Item>>,
    /// The motion that it changes or ends.
    pub course: Option<Arc<Item>>,
}

impl Item {
    /// As the library has it, if it has it.
    fn entry(self: Arc<Item>) -> Option<Entry> {
        // Mostly nobody else has it any more.
        let report = Arc::try_unwrap(self).map_or_else(|own| own.report.clone(), |own| own.report);
        let (command, what) = match report.what {
            ReportKind::Event { command, event } => (command, Happened::Event(event)),
            ReportKind::News(LineEvent::Deed { by, deed }) => {
                (None, Happened::Deed { by: by.to_string().into(), deed })
            }
            _ => return None,
        };
        Some(Entry { number: 0, at: report.at, command, means: Arc::from(""), what })
    }
}

/// Is called when something has happened.
pub type Ring = Arc<dyn Fn() + Send + Sync>;

/// Some of what is kept.
#[derive(Debug)]
pub struct Part {
    /// The number of the oldest entry that is kept, or of the next that comes.
    pub first: u64,
    /// The number of the latest.
    pub last: u64,
    /// Oldest first.
    pub items: Vec<Arc<Item>>,
}

impl Feed {
    /// One that keeps as many entries as a running controller has.
    #[must_use]
    pub fn new(ring: Ring) -> Arc<Feed> {
        Feed::keeping(ring, HISTORY)
    }

    /// One that keeps so many entries.
    #[must_use]
    pub fn keeping(ring: Ring, most: usize) -> Arc<Feed> {
        Arc::new(Feed { kept: Mutex::default(), most, ring })
    }

    /// Where the controller writes.
    #[must_use]
    pub fn sink(self: &Arc<Feed>) -> Ear {
        Ear(Arc::clone(self))
    }

    /// What is kept is whole at any time, so a panic elsewhere is no reason to stop.
    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// At most so many entries after the one of this number, oldest first.
    #[must_use]
    pub fn after(&self, number: u64, most: usize) -> Part {
        let kept = self.kept();
        let first = kept.last + 1 - kept.items.len() as u64;
        let skip =
            usize::try_from(number.saturating_add(1).saturating_sub(first)).unwrap_or(usize::MAX);
        let items = kept.items.iter().skip(skip).take(most).cloned().collect();
        Part { first, last: kept.last, items }
    }

    /// How things stand where it begins.
    pub fn begin(&self, start: Picture) {
        let mut kept = self.kept();
        // What has happened since is not in the picture.
        if kept.items.is_empty() {
            kept.start = start;
        }
    }

    /// What is kept of it up to now as the library has it, and how many entries are not kept any more.
    #[must_use]
    pub fn journal(&self, now: Time) -> (Journal, u64) {
        let kept = self.kept();
        let mut journal = Journal::new(kept.start.clone(), usize::MAX);
        for item in &kept.items {
            let at = item.report.at;
            match &item.report.what {
                ReportKind::Event { command, event } => {
                    journal.keep(Stamp { at, command: *command }, event.clone(), &*item.means);
                }
                ReportKind::News(LineEvent::Deed { by, deed }) => {
                    journal.keep_deed(at, by.to_string(), deed.clone(), &*item.means);
                }
                _ => {}
            }
        }
        journal.run_to(now);
        (journal, kept.last - kept.items.len() as u64)
    }

    /// The number of the latest entry, and whether something moves: not known after it was put into
    /// another state, before the next is told of a motion.
    #[must_use]
    pub fn state(&self) -> (u64, Option<bool>) {
        let kept = self.kept();
        (kept.last, (!kept.is_elsewhere).then_some(kept.course.is_some()))
    }
}

/// The sink of a feed.
#[derive(Debug)]
pub struct Ear(Arc<Feed>);

impl Sink for Ear {
    fn wants(&self) -> EventFilter {
        EventFilter { kinds: Kinds::ALL, ..EventFilter::default() }
    }

    fn report(&mut self, report: &Report, explain: &dyn Fn(&[u8]) -> String) {
        let means = match &report.what {
            ReportKind::Event { event: Event::Command { bytes, .. }, .. } => explain(bytes),
            ReportKind::News(LineEvent::Deed { deed: Deed::Byte(byte), .. }) => explain(&[*byte]),
            _ => String::new(),
        };
        let mut kept = self.0.kept();
        kept.keep(report.clone(), means.into(), self.0.most);
        drop(kept);
        (self.0.ring)();
    }
}

impl Kept {
    fn keep(&mut self, report: Report, means: Box<str>, most: usize) {
        let of = match &report.what {
            ReportKind::Event { command, .. } => *command,
            _ => None,
        };
        let command = of.and_then(|of| {
            self.begun.iter().rev().find(|(number, _)| *number == of).map(|(_, item)| item)
        });
        let motion = match report.event() {
            Some(Event::Motion(motion)) => Some(motion),
            _ => None,
        };
        let course = match motion {
            Some(Motion::Changes { .. } | Motion::Ends { .. }) => self.course.clone(),
            _ => None,
        };
        self.is_elsewhere &= motion.is_none();
        self.last += 1;
        let (number, command) = (self.last, command.cloned());
        let item = Item { number, report, means, command, course };
        let item = Arc::new(item);
        match item.report.event() {
            Some(Event::Command { .. }) => {
                if self.begun.len() >= UNANSWERED {
                    self.begun.pop_front();
                }
                self.begun.extend(of.map(|of| (of, Arc::clone(&item))));
            }
            Some(Event::Motion(Motion::Begins { .. } | Motion::Changes { .. })) => {
                self.course = Some(Arc::clone(&item));
            }
            Some(Event::Motion(Motion::Ends { .. })) => self.course = None,
            _ => {}
        }
        if let Some(LineEvent::Deed { deed: Deed::Restore, .. }) = item.report.news() {
            // It stands at another moment now, of which nothing is known.
            (self.course, self.begun) = (None, VecDeque::new());
            self.is_elsewhere = true;
        }
        if self.items.len() >= most
            && let Some(oldest) = self.items.pop_front().and_then(|oldest| oldest.entry())
        {
            self.start.apply(&oldest);
        }
        self.items.push_back(item);
    }
}
