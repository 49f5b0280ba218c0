//! What a test expects of the host, and of what comes of it.

use std::io::{self, Write};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use vimc4_device::{Device, Names};
use vimc4_host::{ControlError, Pending};
use vimc4_journal::Picture;
use vimc4_journal::expect::{
    Expect, Expectation, Failure, Follower, Looker, Mistake, Trial, Unmet, Watch,
};

use crate::control::Control;
use crate::error::Error;
use crate::record::{Ended, OnFailure, Record};
use crate::recording::RecordingFile;

/// A running emulator of which something is expected: [`Emulator::expect`](crate::Emulator::expect).
#[derive(Debug)]
pub struct Live {
    control: Control,
    recording: Option<RecordingFile>,
    /// It could not even say its names.
    ended: Option<Error>,
}

impl Live {
    /// Begins a sentence.
    pub(crate) fn expect(control: &Control, recording: Option<&RecordingFile>) -> Expect<Live> {
        let (names, ended) = match control.names().wait() {
            Ok(names) => (names, None),
            Err(error) => (Names::default(), Some(error.into())),
        };
        Expect::of(Live { control: control.clone(), recording: recording.cloned(), ended }, names)
    }
}

impl Follower for Live {
    type Watching = Result<Watched, Error>;

    fn watch(self, expected: Result<Expectation, Mistake>, names: &Names) -> Self::Watching {
        if let Some(error) = self.ended {
            return Err(error);
        }
        let watched = self.control.watch_for(expected?, names).wait()??;
        if let Some(file) = self.recording {
            watched.on_failure(Box::new(move |failure| file.cut(failure)));
        }
        Ok(watched)
    }
}

impl Looker for Live {
    type Outcome = Result<(), Error>;

    fn so_far(self, expected: Result<Expectation, Mistake>, names: &Names) -> Self::Outcome {
        if let Some(error) = self.ended {
            return Err(error);
        }
        let expected = expected?;
        if self.control.record.is_none() {
            return Err(ControlError::Unsupported(
                "nothing is remembered; do without Builder::record(false), or watch from the beginning",
            )
            .into());
        }
        let journal = self.control.journal().wait()?;
        Trial::of(expected, &journal, names).map_err(|unmet| match unmet {
            Unmet::Mistake(mistake) => mistake.into(),
            Unmet::Failure(failure) => failure.into(),
        })
    }
}

impl Control {
    /// Expects something from now on, as a value; [`Emulator::expect`](crate::Emulator::expect) puts it as
    /// a sentence. `names` are the [names](Control::names) of this emulator.
    pub fn watch_for(
        &self,
        expected: Expectation,
        names: &Names,
    ) -> Pending<Result<Watched, Mistake>> {
        let (control, names) = (self.clone(), Arc::new(names.clone()));
        self.handle.with(move |runner| {
            let present = Picture::of(runner.device());
            let passing = || {
                control.passing.record(|| {
                    let record = Record::passing(present.clone());
                    runner.watch(Box::new(record.recorder()));
                    record
                })
            };
            let record = control.record.clone().unwrap_or_else(passing);
            let begin = |start: &Picture, before| Watch::new(expected, &names, start, before);
            let id = record.watch(present, Arc::clone(&names), begin);
            runner.look_again();
            Ok(id.map(|id| Watched { control, record, id: Some(id) }))
        })
    }
}

/// An expectation that is watched while things happen.
///
/// It has to be [checked](Watched::check). One that is dropped unchecked panics, so that no test passes
/// which has forgotten it; while the thread is panicking already, it prints on standard error why it is
/// not met, because that may be what the panic is about.
#[derive(Debug)]
#[must_use = "an expectation that is dropped without `check()` panics"]
pub struct Watched {
    control: Control,
    record: Record,
    /// Its number, until it is checked.
    id: Option<u64>,
}

impl Watched {
    /// Whether it is met by all that has happened so far; it is not expected any more then. What was
    /// written to the line before has arrived.
    ///
    /// # Errors
    ///
    /// If it is not met: what was expected, what came closest, and what happened around it.
    pub fn check(mut self) -> Result<(), Error> {
        match self.end().and_then(|ended| ended.failure) {
            Some(failure) => Err(failure.into()),
            None => Ok(()),
        }
    }

    /// The same as [`check`](Watched::check), to be awaited: why it is not met, if it is not.
    pub fn checked(mut self) -> Pending<Option<Box<Failure>>> {
        let Some(id) = self.id.take() else { return Pending::promised().1 };
        let record = self.record.clone();
        self.control.handle.with(move |runner| {
            let ended = record.unwatch(id, Some(runner.device().now()));
            runner.look_again();
            Ok(ended.and_then(|ended| ended.failure))
        })
    }

    /// Whether it is met by what has happened so far. Something may still come too often.
    pub fn is_met(&self) -> bool {
        let memory = self.record.lock();
        let watching = memory.watches.iter().find(|watching| Some(watching.id) == self.id);
        watching.is_some_and(|watching| watching.failure.is_none() && watching.watch.is_met())
    }

    /// It is not expected any more, met or not.
    pub fn give_up(mut self) {
        self.end();
    }

    /// Why it cannot be met any more, if that is clear already.
    pub fn failure(&self) -> Option<Box<Failure>> {
        let memory = self.record.lock();
        memory.watches.iter().find(|watching| Some(watching.id) == self.id)?.failure.clone()
    }

    /// Waits until it is met, or cannot be any more, but no longer than so on the wall. It goes on being
    /// expected: something may still come too often. Time does not pass by that where it does not by
    /// itself.
    ///
    /// # Errors
    ///
    /// If it cannot be met any more, or nothing has become clear in this time.
    pub fn wait_until_met(&self, limit: Duration) -> Result<(), Error> {
        let reply = self.until_met();
        reply.wait_within(limit)?;
        self.failure().map_or(Ok(()), |failure| Err(failure.into()))
    }

    /// Answers when it is met, or cannot be any more, which [`failure`](Watched::failure) tells. See
    /// [`wait_until_met`](Watched::wait_until_met).
    pub fn until_met(&self) -> Pending<()> {
        let (answer, reply) = Pending::promised();
        let mut memory = self.record.lock();
        if let Some(place) = memory.watches.iter().position(|of| Some(of.id) == self.id) {
            memory.wait_for(place, answer);
        }
        reply
    }

    /// Ends the emulator as soon as it cannot be met any more: a driver that waits for an answer learns at
    /// once that nothing will come, instead of after its time-out.
    pub fn or_stop(self) -> Watched {
        let control = self.control.clone();
        self.on_failure(Box::new(move |_| control.stop()));
        self
    }

    /// Calls a function as soon as it cannot be met any more. The controller waits for it: it must not
    /// block.
    pub fn or_tell(self, tell: impl FnOnce(&Failure) + Send + 'static) -> Watched {
        self.on_failure(Box::new(tell));
        self
    }

    fn on_failure(&self, tell: OnFailure) {
        let mut memory = self.record.lock();
        let watching = memory.watches.iter_mut().find(|watching| Some(watching.id) == self.id);
        if let Some(watching) = watching {
            match &watching.failure {
                Some(failure) => tell(failure),
                None => watching.on_failure.push(tell),
            }
        }
    }

    fn end(&mut self) -> Option<Ended> {
        let id = self.id.take()?;
        let record = self.record.clone();
        let ended = self.control.handle.with(move |runner| {
            let ended = record.unwatch(id, Some(runner.device().now()));
            runner.look_again();
            Ok(ended)
        });
        // What has ended is known as far as it has come.
        ended.wait().unwrap_or_else(|_| self.record.unwatch(id, None))
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        let panicking = thread::panicking();
        let Some(Ended { failure, expected }) = self.end() else { return };
        if panicking {
            if let Some(failure) = failure {
                // Nothing can be done about a standard error that is closed.
                let _ = writeln!(io::stderr(), "{failure}");
            }
            return;
        }
        let how = failure.map_or_else(
            || "it was met, but a test that does not look passes without it, too".to_owned(),
            |failure| failure.to_string(),
        );
        unchecked(&expected, &how);
    }
}

#[expect(clippy::panic, reason = "a test that has forgotten what it expects has to fail")]
fn unchecked(expected: &str, how: &str) {
    panic!(
        "an expectation was never checked: {expected}\ncall check() on what watch() returns; {how}"
    );
}
