//! Reading a recording piece by piece.

use vimc4_catalogue::State;
use vimc4_device::{
    CommandNumber, Device, Event, Input, LineState, Output, OwnedInput, Time, escape,
};
use vimc4_session::Effect;
use vimc4_timeline::recording::Mismatch;
use vimc4_timeline::{BranchId, History, Place, Progress};

use crate::Source;
use crate::Wired;
use crate::debugger::{Bookmark, Debugger, uninterrupted};
use crate::reel::{Read, Recorded, Reel, Unread};
use crate::stop::Reason;

/// The most entries read before asking whether to go on.
const PATIENCE: usize = 32;

/// How much is read at once when a walk reaches the end of what is known.
const PIECE: usize = 4_096;

/// The most commands that are listed as lines.
const LISTED: usize = 1_000_000;

impl Debugger {
    /// Continues with a recording, which is read from here on.
    #[must_use]
    pub fn with_reel(mut self, reel: Box<dyn Reel>) -> Debugger {
        let branch = self.history.heading();
        self.unread = Some(Unread {
            reel: Some(reel),
            branch,
            last: None,
            failure: None,
            notice: None,
            lists: false,
        });
        self
    }

    /// The commands of the recording are the lines of a [`Source`] of this name, as far as it is
    /// read; a million of them at most.
    pub fn list_commands(&mut self, name: impl Into<String>) {
        if let Some(unread) = &mut self.unread {
            unread.lists = true;
            self.source = Some(Source { name: name.into(), ..Source::default() });
        }
    }

    /// Whether there is more of a recording than has been read.
    #[must_use]
    pub fn has_unread(&self) -> bool {
        self.unread.as_ref().is_some_and(|unread| unread.reel.is_some())
    }

    /// How much of a recording has been read, in thousandths, while there is more.
    #[must_use]
    pub fn share_read(&self) -> Option<u32> {
        self.unread.as_ref()?.reel.as_ref()?.share()
    }

    /// What people should know of a recording: that the emulation differs from it, as soon as that is
    /// read, and what is missing at its end. Told once, a line each.
    pub fn notice(&mut self) -> Option<String> {
        let differs = self.news_of_differences();
        let missing = self.unread.as_mut().and_then(|unread| unread.notice.take());
        match (differs, missing) {
            (Some(differs), Some(missing)) => Some(format!("{differs}\n{missing}")),
            (differs, missing) => differs.or(missing),
        }
    }

    /// Reads on, at most this many entries or as long as `progress` allows. The present stays. A
    /// way that continues with the recording continues with what is read.
    pub fn read_on(&mut self, most: usize, progress: &mut Progress<'_>) -> Read {
        let Some(unread) = &mut self.unread else { return Read::All };
        let Some(mut reel) = unread.reel.take() else {
            return unread.failure.clone().map_or(Read::All, Read::Broken);
        };
        let branch = unread.branch;
        let mut reading = Reading::default();
        let (read, knows_more, tip) = self.history.at_end(branch, |history| {
            for count in 1..=most {
                let read = match reel.next() {
                    Ok(Some((at, recorded))) => {
                        reading.take(history, at, recorded);
                        None
                    }
                    Ok(None) => Some(Read::All),
                    Err(why) => Some(Read::Broken(why)),
                };
                if let Some(read) = read {
                    return (read, count > 1, history.heading());
                }
                if count.is_multiple_of(PATIENCE) && progress(history.now()).is_break() {
                    return (Read::Cancelled, true, history.heading());
                }
            }
            (Read::More, true, history.heading())
        });
        let mismatches = std::mem::take(&mut reading.mismatches);
        self.keep(reading, tip);
        for (branch, mismatch) in mismatches {
            self.add_mismatch_on(branch, mismatch);
        }
        if let Some(unread) = &mut self.unread {
            match &read {
                Read::More | Read::Cancelled => unread.reel = Some(reel),
                Read::All => unread.notice = reel.notice(),
                Read::Broken(why) => unread.failure = Some(why.clone()),
            }
        }
        match read {
            // The fault lies after what is known now, and is reported where that ends.
            Read::Broken(_) if knows_more => Read::More,
            read => read,
        }
    }

    /// Reads on until `is_enough` holds or everything is read.
    pub(crate) fn read_until(
        &mut self,
        is_enough: impl Fn(&Debugger) -> bool,
        progress: &mut Progress<'_>,
    ) -> Result<(), Reason> {
        while !is_enough(self) && self.read_piece(progress)? {}
        Ok(())
    }

    /// Reads on if the way of the present has reached its end, and says whether there may be more
    /// now.
    pub(crate) fn read_ahead(&mut self, progress: &mut Progress<'_>) -> Result<bool, Reason> {
        if self.goes_on_reading() { self.read_piece(progress) } else { Ok(false) }
    }

    /// Reads on, and says whether there was something left to be read.
    fn read_piece(&mut self, progress: &mut Progress<'_>) -> Result<bool, Reason> {
        let had_more = self.has_unread();
        match self.read_on(PIECE, progress) {
            Read::More | Read::All => Ok(had_more),
            Read::Cancelled => Err(Reason::Cancelled),
            Read::Broken(why) => Err(Reason::Broken(why)),
        }
    }

    /// Whether the way of the present continues with what is still to be read, or with what cannot
    /// be read.
    pub(crate) fn goes_on_reading(&self) -> bool {
        let goes_on = |unread: &Unread| {
            (unread.reel.is_some() || unread.failure.is_some())
                && unread.branch == self.history.heading()
        };
        self.unread.as_ref().is_some_and(goes_on)
    }

    /// Whether the present is on the way of a recording, and not on a branch that has left it.
    pub(crate) fn is_on_recording(&self) -> bool {
        self.unread.as_ref().is_some_and(|unread| unread.branch == self.history.heading())
    }

    /// The last command of the recording that has begun, as far as it is read.
    pub(crate) fn last_read(&self) -> Option<CommandNumber> {
        self.unread.as_ref()?.last
    }

    /// Gives the controller an input, now. What is done at the machine is done at once; bytes are on
    /// their way and come with the next walk, so that it can be stopped at what they bring about. In
    /// the past it begins a branch.
    pub fn give(&mut self, input: Input<'_>) {
        self.give_and_see(input);
    }

    /// Does something to the controller that is no command, now, and says what came of it.
    pub fn act(&mut self, inputs: &[OwnedInput]) -> Effect {
        self.read_beyond_present();
        let given: Vec<Input<'_>> = inputs.iter().map(OwnedInput::as_input).collect();
        if !self.history.is_at_end() && !self.would_matter(&given) {
            // Nothing follows from it, and so nothing parts here.
            return Effect::of(self.line(), &given, self.now(), false);
        }
        let (mut before, mut has_said) = (None, false);
        for input in inputs {
            let Some(seen) = self.give_and_see(input.as_input()) else { continue };
            before = before.or(Some(seen.before));
            has_said |= seen.has_said;
        }
        let has_changed = has_said || before.is_some_and(|before| before != self.line().state());
        Effect::of(self.line(), &given, self.now(), has_changed)
    }

    /// Whether the controller would be in another state after these inputs, or would say something.
    fn would_matter(&self, inputs: &[Input<'_>]) -> bool {
        let (mut device, now) = (self.line().clone(), self.now());
        let mut has_said = false;
        let settle = |device: &mut Wired| {
            while device.wake().is_some_and(|due| due <= now) && device.perform(now) {}
            std::iter::from_fn(|| device.poll_output())
                .filter(|output| matches!(output, Output::Bytes(..) | Output::Flash(..)))
                .count()
                > 0
        };
        settle(&mut device);
        let before = device.state();
        for input in inputs {
            device.accept(*input, now);
            has_said |= settle(&mut device);
        }
        has_said || device.state() != before
    }

    /// After the present comes what was recorded, even if it has not been read yet.
    fn read_beyond_present(&mut self) {
        if self.history.is_at_end() && self.goes_on_reading() {
            let _ = self.read_until(|own| !own.history.is_at_end(), &mut uninterrupted);
        }
    }

    /// Gives an input, and says what was seen of it if it has taken effect.
    fn give_and_see(&mut self, input: Input<'_>) -> Option<Seen> {
        self.read_beyond_present();
        let from = self.place();
        self.history.give(input);
        if let Some(feed) = &mut self.feed {
            feed.is_given(&self.history, from);
        }
        let mut seen = None;
        if !matches!(input, Input::Bytes(_)) {
            // What is due by now comes before it, and what it leads to afterwards.
            let now = self.now();
            while {
                let Place { branch, moment } = self.place();
                self.history.inputs(branch, moment.inputs).next().is_some()
            } {
                let before = self.line().state();
                if !self.history.find_next(now, |_, _, _| true) {
                    break;
                }
                let is_said =
                    |output: &Output| matches!(output, Output::Bytes(..) | Output::Flash(..));
                seen = Some(Seen { before, has_said: self.history.outputs().iter().any(is_said) });
                if let Some(feed) = &mut self.feed {
                    feed.hear(&self.history, self.history.outputs());
                }
            }
        }
        if let Input::Bytes(bytes) = input
            && self.heeds_hands()
        {
            let last = self.executing().map_or(0, |command| command.number.0.get());
            self.keep_by_hand(bytes, last);
        }
        seen
    }

    /// Keeps what was found out while it was read.
    fn keep(&mut self, reading: Reading, tip: BranchId) {
        let marks = reading.marks.into_iter();
        self.marks.extend(marks.map(|(name, place)| (name, Bookmark { place, standing: None })));
        let Some(unread) = &mut self.unread else { return };
        unread.branch = tip;
        unread.last = reading.commands.last().map(|(number, _)| *number).or(unread.last);
        let Some(source) = self.source.as_mut().filter(|_| unread.lists) else { return };
        for (number, text) in reading.commands {
            let first = *source.first.get_or_insert(number);
            let place = number.0.get().saturating_sub(first.0.get());
            // A recording that somebody has edited can have gaps of any size.
            if place < source.lines.len() as u64 || place >= 2 * source.lines.len() as u64 + 64 {
                continue;
            }
            if source.lines.len() >= LISTED {
                break;
            }
            source.lines.resize(place as usize, String::new());
            source.lines.push(text);
            let lines = u32::try_from(source.lines.len()).unwrap_or(u32::MAX);
            source.of_command.extend(source.of_command.len() as u32 + 1..=lines);
        }
    }
}

/// What was seen of an input that has taken effect.
struct Seen {
    /// The state just before it.
    before: LineState<State>,
    /// Whether something was sent or stored by it.
    has_said: bool,
}

/// What is found out while a recording is read.
#[derive(Default)]
struct Reading {
    /// The commands that began, and how they were sent.
    commands: Vec<(CommandNumber, String)>,
    marks: Vec<(String, Place)>,
    /// Where the emulation differs, and on which branch.
    mismatches: Vec<(BranchId, Mismatch)>,
}

impl Reading {
    /// Brings the end of a history on to what was recorded.
    fn take(&mut self, history: &mut History<Wired>, at: Time, recorded: Recorded) {
        history.run_to(at);
        match recorded {
            Recorded::Given(input) => {
                history.give(input.as_input());
                history.run_to(at);
            }
            Recorded::Put(by, state) => history.put_back(format!("put by {by}"), *state),
            Recorded::Mark(name) => self.marks.push((name, history.present())),
            Recorded::Differs(mismatch) => self.mismatches.push((history.heading(), mismatch)),
            Recorded::Passed => {}
        }
        for output in history.drain() {
            if let Output::Event(stamp, Event::Command { bytes, .. }) = output
                && let Some(number) = stamp.command
            {
                self.commands.push((number, escape(&bytes)));
            }
        }
    }
}
