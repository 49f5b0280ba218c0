//! The record of what happened: for questions afterwards, and for expectations.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use bytes::Bytes;
use tokio::sync::oneshot;
use vimc4_device::{CommandNumber, Deed, Event, Kinds, Names, Stamp, Time, is_mnemonic};
use vimc4_host::{ControlError, EventFilter, LineEvent, Report, ReportKind, Sink};
use vimc4_journal::expect::{Failure, Mistake, Watch};
use vimc4_journal::{Journal, Picture};

/// How many events and how many commands are kept; the oldest are dropped first.
const MEMORY: usize = 100_000;

/// A command that the host sent.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct HostCommand {
    /// When its execution began.
    pub at: Time,
    /// Its number, which its answer and all its effects carry too.
    pub number: Option<CommandNumber>,
    /// The stable mnemonic, such as `@A` or `0`; `?` for a line that no command matches.
    pub mnemonic: Cow<'static, str>,
    /// The line as it was received, without its end.
    pub bytes: Bytes,
    /// What people call it: `relative move X +5,000 steps at 900 Hz`.
    pub text: String,
}

/// A memory of commands and events that is shared with the [`Recorder`] that fills it.
#[derive(Clone, Debug)]
pub(crate) struct Record(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    memory: Mutex<Memory>,
    /// Whether anything is expected; if not, nothing needs to be looked at.
    watched: AtomicBool,
    /// Whether it is kept only as long as anything is expected.
    passing: bool,
}

/// The record of a controller that otherwise keeps none, as long as anything is expected of it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Passing(Arc<Mutex<Weak<Shared>>>);

impl Passing {
    /// The record, which is begun with `begin` if there is none.
    pub(crate) fn record(&self, begin: impl FnOnce() -> Record) -> Record {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let present = known.upgrade().map(Record).filter(|record| !record.lock().over);
        present.unwrap_or_else(|| {
            let record = begin();
            *known = Arc::downgrade(&record.0);
            record
        })
    }
}

#[derive(Debug)]
pub(crate) struct Memory {
    commands: VecDeque<Kept>,
    pub(crate) journal: Journal,
    /// The present state of things, as long as anything is expected.
    present: Picture,
    pub(crate) watches: Vec<Watching>,
    /// When one of them has to be checked next.
    due: Option<Time>,
    /// The number of the next expectation.
    next: u64,
    /// How many of the oldest commands can no longer be waited for.
    passed: usize,
    awaited: Vec<Awaited>,
    /// Nothing more will come.
    over: bool,
}

/// A command as it is kept.
#[derive(Debug)]
struct Kept {
    at: Time,
    number: Option<CommandNumber>,
    mnemonic: Cow<'static, str>,
    bytes: Bytes,
    text: Arc<str>,
}

impl Kept {
    fn told(&self) -> HostCommand {
        HostCommand {
            at: self.at,
            number: self.number,
            mnemonic: self.mnemonic.clone(),
            bytes: self.bytes.clone(),
            text: self.text.to_string(),
        }
    }
}

/// Called once, when an expectation is not met.
pub(crate) type OnFailure = Box<dyn FnOnce(&Failure) + Send>;

/// An expectation that is being watched.
pub(crate) struct Watching {
    pub(crate) id: u64,
    pub(crate) watch: Watch,
    pub(crate) names: Arc<Names>,
    pub(crate) on_failure: Vec<OnFailure>,
    pub(crate) failure: Option<Box<Failure>>,
    /// The callers that wait until it is met or can no longer be met.
    pub(crate) waiting: Vec<oneshot::Sender<Result<(), ControlError>>>,
}

impl fmt::Debug for Watching {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Watching").field("watch", &self.watch).finish_non_exhaustive()
    }
}

impl Watching {
    /// Tells every waiting caller the outcome, if it is known now.
    fn tell(&mut self, journal: &Journal) {
        if self.failure.is_none()
            && let Some(failure) = self.watch.failure(journal, &self.names)
        {
            for tell in self.on_failure.drain(..) {
                tell(&failure);
            }
            self.failure = Some(failure);
        }
        if !self.waiting.is_empty() && (self.failure.is_some() || self.watch.is_met()) {
            for waiting in self.waiting.drain(..) {
                // The caller may have stopped waiting.
                let _ = waiting.send(Ok(()));
            }
        }
    }
}

/// A caller that waits for a command, and the command's mnemonic.
#[derive(Debug)]
struct Awaited(String, oneshot::Sender<Result<HostCommand, ControlError>>);

impl Record {
    /// A memory that begins with the present state of things.
    pub(crate) fn new(start: Picture) -> Record {
        Record::of(start, false)
    }

    /// The same, which is kept only as long as anything is expected.
    pub(crate) fn passing(start: Picture) -> Record {
        Record::of(start, true)
    }

    fn of(start: Picture, passing: bool) -> Record {
        let memory = Memory {
            commands: VecDeque::new(),
            journal: Journal::new(start, MEMORY),
            present: Picture::default(),
            watches: Vec::new(),
            due: None,
            next: 0,
            passed: 0,
            awaited: Vec::new(),
            over: false,
        };
        let (memory, watched) = (Mutex::new(memory), AtomicBool::new(false));
        Record(Arc::new(Shared { memory, watched, passing }))
    }

    /// Whether anything is expected.
    fn is_watched(&self) -> bool {
        self.0.watched.load(Ordering::Acquire)
    }

    /// Adds an expectation, watched from now on. Returns its number.
    pub(crate) fn watch(
        &self,
        present: Picture,
        names: Arc<Names>,
        begin: impl FnOnce(&Picture, u64) -> Result<Watch, Mistake>,
    ) -> Result<u64, Mistake> {
        let mut memory = self.lock();
        let Memory { journal, watches, next, present: known, .. } = &mut *memory;
        let watch = begin(&present, journal.last())?;
        *next += 1;
        let mut watching = Watching {
            id: *next,
            watch,
            names,
            on_failure: Vec::new(),
            failure: None,
            waiting: Vec::new(),
        };
        watching.tell(journal);
        watches.push(watching);
        *known = present;
        let id = *next;
        memory.find_due();
        self.0.watched.store(true, Ordering::Release);
        Ok(id)
    }

    /// Removes an expectation. Returns it, with all time passed up to `now`.
    pub(crate) fn unwatch(&self, id: u64, now: Option<Time>) -> Option<Ended> {
        let mut memory = self.lock();
        if let Some(now) = now {
            memory.pass(now);
        }
        let Memory { journal, watches, .. } = &mut *memory;
        let place = watches.iter().position(|watching| watching.id == id)?;
        let watching = watches.remove(place);
        self.0.watched.store(!watches.is_empty(), Ordering::Release);
        let at = journal.until();
        let outcome = || watching.watch.outcome(at, journal, &watching.names);
        let failure = watching.failure.clone().or_else(outcome);
        let expected = watching.watch.expected().in_words(&watching.names);
        memory.find_due();
        Some(Ended { failure, expected })
    }

    /// Every entry is whole at any time, so a panic elsewhere is no reason to stop.
    pub(crate) fn lock(&self) -> MutexGuard<'_, Memory> {
        self.0.memory.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The sink that fills it.
    pub(crate) fn recorder(&self) -> Recorder {
        Recorder(self.clone())
    }
}

/// The outcome of an expectation.
pub(crate) struct Ended {
    /// Why it is not met, if it is not.
    pub(crate) failure: Option<Box<Failure>>,
    /// What was expected, in words.
    pub(crate) expected: String,
}

impl Memory {
    pub(crate) fn commands(&self) -> Vec<HostCommand> {
        self.commands.iter().map(Kept::told).collect()
    }

    pub(crate) fn events(&self) -> Vec<(Stamp, Event)> {
        let events = self.journal.entries().filter_map(|entry| {
            Some((Stamp { at: entry.at, command: entry.command }, entry.event()?.clone()))
        });
        events.collect()
    }

    pub(crate) fn forget(&mut self, present: Picture) {
        self.commands.clear();
        self.journal.forget(present);
        self.passed = 0;
    }

    /// Time has passed.
    pub(crate) fn pass(&mut self, at: Time) {
        let Memory { journal, watches, present, .. } = self;
        journal.run_to(at);
        for watching in watches {
            watching.watch.pass(present, at);
            watching.tell(journal);
        }
        self.find_due();
    }

    /// Keeps an event, and checks it against the expectations.
    fn keep(&mut self, stamp: Stamp, event: Event, means: Arc<str>) {
        self.journal.keep(stamp, event, means);
        self.look();
    }

    fn keep_deed(&mut self, at: Time, by: String, deed: Deed, means: String) {
        self.journal.keep_deed(at, by, deed, means);
        self.look();
    }

    /// Looks at the last entry.
    fn look(&mut self) {
        let Memory { journal, watches, present, .. } = self;
        if watches.is_empty() {
            return;
        }
        let Some(entry) = journal.entries().next_back() else { return };
        let mut moved = false;
        if self.due.is_some_and(|due| due <= entry.at) {
            for watching in watches.iter_mut() {
                watching.watch.pass(present, entry.at);
                watching.tell(journal);
            }
            moved = true;
        }
        present.apply(entry);
        for watching in watches {
            let before = watching.watch.due();
            if watching.watch.see(present, entry) {
                watching.tell(journal);
                moved |= watching.watch.due() != before;
            }
        }
        if moved {
            self.find_due();
        }
    }

    /// Answers when an expectation is met or can no longer be met: at once if that is so already.
    pub(crate) fn wait_for(
        &mut self,
        place: usize,
        answer: oneshot::Sender<Result<(), ControlError>>,
    ) {
        let Memory { journal, watches, .. } = self;
        if let Some(watching) = watches.get_mut(place) {
            watching.waiting.push(answer);
            watching.tell(journal);
        }
    }

    fn find_due(&mut self) {
        self.due = self.watches.iter().filter_map(|watching| watching.watch.due()).min();
    }

    /// Answers with the first command of this name after the one that was waited for last.
    pub(crate) fn await_command(
        &mut self,
        mnemonic: String,
        answer: oneshot::Sender<Result<HostCommand, ControlError>>,
    ) {
        let mut coming = self.commands.iter().enumerate().skip(self.passed);
        match coming.find(|(_, command)| is_mnemonic(&command.mnemonic, &mnemonic)) {
            Some((at, command)) => {
                self.passed = at + 1;
                // The caller may have stopped waiting.
                let _ = answer.send(Ok(command.told()));
            }
            // A waiting caller learns from the answer that is dropped that there will be none.
            None if self.over => {}
            None => {
                self.passed = self.commands.len();
                self.awaited.retain(|Awaited(_, answer)| !answer.is_closed());
                self.awaited.push(Awaited(mnemonic, answer));
            }
        }
    }

    fn add(&mut self, command: Kept) {
        if self.commands.len() == MEMORY {
            self.commands.pop_front();
            self.passed = self.passed.saturating_sub(1);
        }
        let waits = |Awaited(name, _): &Awaited| is_mnemonic(&command.mnemonic, name);
        for Awaited(_, answer) in self.awaited.extract_if(.., |awaited| waits(awaited)) {
            self.passed = self.commands.len() + 1;
            let _ = answer.send(Ok(command.told()));
        }
        self.commands.push_back(command);
    }
}

/// Fills a memory.
#[derive(Debug)]
pub(crate) struct Recorder(Record);

impl Drop for Recorder {
    fn drop(&mut self) {
        let mut memory = self.0.lock();
        memory.over = true;
        memory.awaited.clear();
    }
}

impl Sink for Recorder {
    fn wants(&self) -> EventFilter {
        EventFilter { kinds: Kinds::ALL, ..EventFilter::default() }
    }

    fn report(&mut self, report: &Report, explain: &dyn Fn(&[u8]) -> String) {
        match &report.what {
            ReportKind::Event { command, event } => {
                let stamp = Stamp { at: report.at, command: *command };
                let mut means = Arc::from("");
                let mut memory = self.0.lock();
                if let Event::Command { mnemonic, bytes } = event {
                    // Explained at once: what `@0A100,900` means depends on the axes set at the time.
                    let text: Arc<str> = explain(bytes).into();
                    means = Arc::clone(&text);
                    memory.add(Kept {
                        at: stamp.at,
                        number: stamp.command,
                        mnemonic: mnemonic.clone(),
                        bytes: bytes.clone(),
                        text,
                    });
                }
                memory.keep(stamp, event.clone(), means);
            }
            ReportKind::News(LineEvent::Deed { by, deed }) => {
                let means = match deed {
                    Deed::Byte(byte) => explain(&[*byte]),
                    _ => String::new(),
                };
                self.0.lock().keep_deed(report.at, by.to_string(), deed.clone(), means);
            }
            _ => {}
        }
    }

    fn has_enough(&self) -> bool {
        self.0.0.passing && !self.0.is_watched()
    }

    fn due(&self) -> Option<Time> {
        if self.0.is_watched() { self.0.lock().due } else { None }
    }

    fn passes(&mut self, at: Time) {
        self.0.lock().pass(at);
    }
}
