//! The debugger beside the recording that it was opened on: which replies differ, and which are shown.

use vimc4_device::{Event, Output, Time};
use vimc4_timeline::recording::{Mismatch, MismatchKind, Reply};
use vimc4_timeline::{BranchId, Place};

use crate::debugger::Debugger;
use crate::differences::{Difference, Replies};

impl Debugger {
    /// The emulation differs here from the recording that it follows.
    pub fn add_mismatch(&mut self, mismatch: Mismatch) {
        let branch = self.history.heading();
        self.add_mismatch_on(branch, mismatch);
    }

    pub(crate) fn add_mismatch_on(&mut self, branch: BranchId, mismatch: Mismatch) {
        self.mark_line(&mismatch);
        self.differences.push(branch, mismatch);
    }

    /// Marks the listed command of a recording whose reply differs.
    fn mark_line(&mut self, mismatch: &Mismatch) {
        let lists = self.unread.as_ref().is_some_and(|unread| unread.lists);
        let Some(source) = self.source.as_mut().filter(|_| lists) else { return };
        let line = mismatch.command.and_then(|command| source.line_of(command));
        let place = line.and_then(|line| usize::try_from(line).ok()?.checked_sub(1));
        if let Some(line) = place.and_then(|place| source.lines.get_mut(place)) {
            let [recorded, emulated] = mismatch.sides();
            *line += &format!("    ! recorded {recorded}, emulated {emulated}");
        }
    }

    /// Where the emulation differs from the recording, in order, as far as the recording is read: the
    /// first 10,000 places.
    #[must_use]
    pub fn differences(&self) -> &[Difference] {
        &self.differences.list
    }

    /// How many more differences there are.
    #[must_use]
    pub fn more_differences(&self) -> u64 {
        self.differences.more
    }

    /// The differences on the way of the present.
    pub fn differences_on_way(&self) -> impl Iterator<Item = &Mismatch> {
        let branches: Vec<_> = match self.differences.list.is_empty() {
            true => Vec::new(),
            false => self.history.branches().collect(),
        };
        let mut way = vec![(self.history.heading(), Time::NEVER)];
        while let Some((last, _)) = way.last()
            && let Some(Place { branch, moment }) =
                branches.iter().find(|branch| branch.id == *last).and_then(|own| own.parted)
        {
            way.push((branch, moment.at));
        }
        let is_on = move |own: &&Difference| {
            way.iter().any(|(branch, end)| own.branch == *branch && own.mismatch.at <= *end)
        };
        self.differences.list.iter().filter(is_on).map(|own| &own.mismatch)
    }

    /// Says once that the emulation differs from the recording, as soon as that is known.
    pub(crate) fn news_of_differences(&mut self) -> Option<String> {
        let is_news = std::mem::take(&mut self.differences.is_news);
        let first = self.differences.list.first().filter(|_| is_news)?;
        Some(format!(
            "{}; `differences` lists every place, `replies recorded` shows the recorded replies",
            first.mismatch.summary()
        ))
    }

    /// Which replies are shown.
    #[must_use]
    pub fn shown_replies(&self) -> Replies {
        self.differences.shown
    }

    /// Shows the replies of the recording or of the emulation from now on.
    pub fn show_replies(&mut self, replies: Replies) {
        self.differences.shown = replies;
    }

    /// The recorded reply, if the recording has another one than this output and recorded replies are
    /// shown.
    #[must_use]
    pub fn recorded_instead(&self, output: &Output) -> Option<&Reply> {
        if self.differences.shown == Replies::Emulated {
            return None;
        }
        self.differences_on_way().find_map(|mismatch| {
            let MismatchKind::Reply { recorded, emulated } = &mismatch.kind else { return None };
            let is_it = match output {
                Output::Event(stamp, Event::Answer { .. }) => {
                    stamp.command == mismatch.command && !emulated.bytes.is_empty()
                }
                Output::Bytes(at, _) => (emulated.first..=emulated.last).contains(&Some(*at)),
                _ => false,
            };
            is_it.then_some(recorded)
        })
    }

    /// An output as it is shown.
    pub(crate) fn as_shown(&self, output: Output) -> Output {
        let Some(recorded) = self.recorded_instead(&output) else { return output };
        let bytes = recorded.bytes.clone().into();
        match output {
            Output::Event(stamp, Event::Answer { mnemonic, .. }) => {
                Output::Event(stamp, Event::Answer { mnemonic, bytes, why: None })
            }
            Output::Bytes(at, _) => Output::Bytes(at, bytes),
            other => other,
        }
    }

    /// The differences since the end of the last walk, if it was before the present; one line each.
    pub(crate) fn differences_passed(&mut self) -> Vec<String> {
        /// So many are shown at a stop.
        const SHOWN: usize = 5;
        let now = self.now();
        let from = std::mem::replace(&mut self.differences.from, now);
        let mut lines = Vec::new();
        let mut more = 0_u64;
        for mismatch in self.differences_on_way().filter(|own| from < own.at && own.at <= now) {
            match lines.len() < SHOWN {
                true => lines.push(format!(
                    "{}  differs from the recording: {mismatch}",
                    crate::stop::time(mismatch.at)
                )),
                false => more += 1,
            }
        }
        if more > 0 {
            lines.push(format!("and {more} more differences; `differences` lists them"));
        }
        lines
    }
}
