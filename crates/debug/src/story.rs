//! What has happened, told from the events of the history.

use std::collections::VecDeque;

use vimc4_device::{CommandNumber, Condition, Device, Event, Kinds, Output, Stamp};
use vimc4_timeline::{Act, Found, History, Place, Progress, Sought, Stretch};

use crate::Wired;
use crate::debugger::{Debugger, uninterrupted};
use crate::stop::Executing;

/// What rules and faults did, in order.
pub type Deeds = Vec<(Stamp, Event)>;

/// An event, and where in the history it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Told {
    /// When, and because of which command.
    pub stamp: Stamp,
    /// What.
    pub event: Event,
    /// The moment just after the act by which it came.
    pub place: Place,
    /// The act.
    pub act: Act,
    /// What rules and faults did before it by the same act.
    pub before: Deeds,
}

/// A command that has begun.
pub(crate) struct SeenCommand {
    pub(crate) number: Option<CommandNumber>,
    pub(crate) line: Vec<u8>,
    /// Its meaning when it was executed.
    pub(crate) meaning: String,
}

/// Looks for an event.
pub(crate) struct EventSought<F> {
    kinds: Kinds,
    is_it: F,
    /// The last match, and what rules and faults did before it by the same act.
    pub(crate) found: Option<(Stamp, Event, Act, Deeds)>,
}

impl<F: FnMut(&Stamp, &Event) -> bool> EventSought<F> {
    pub(crate) fn new(kinds: Kinds, is_it: F) -> EventSought<F> {
        EventSought { kinds, is_it, found: None }
    }
}

impl<F: FnMut(&Stamp, &Event) -> bool> Sought<Wired> for EventSought<F> {
    fn can_be_in(&self, stretch: &Stretch) -> bool {
        stretch.can_have(self.kinds)
    }

    fn after(&mut self, _: &Wired, act: Act, outputs: &VecDeque<Output>) -> bool {
        let mut is_here = false;
        let mut before = Vec::new();
        for output in outputs {
            let Output::Event(stamp, event) = output else { continue };
            if (self.is_it)(stamp, event) {
                self.found = Some((*stamp, event.clone(), act, before.clone()));
                is_here = true;
            }
            if matches!(event, Event::Rule { .. } | Event::Fault { .. }) {
                before.push((*stamp, event.clone()));
            }
        }
        is_here
    }
}

/// Looks for a command, skipping the lines of a program that has run for hours.
#[derive(Default)]
struct LastCommand {
    found: Option<Executing>,
}

impl Sought<Wired> for LastCommand {
    fn can_be_in(&self, stretch: &Stretch) -> bool {
        stretch.can_meet(&Condition::Command { like: None })
    }

    fn after(&mut self, _: &Wired, _: Act, outputs: &VecDeque<Output>) -> bool {
        let found = outputs.iter().rev().find_map(|output| match output {
            Output::Event(stamp, Event::Command { bytes, .. }) => {
                Some(Executing { number: stamp.command?, line: bytes.to_vec(), began: stamp.at })
            }
            _ => None,
        });
        let is_here = found.is_some();
        self.found = found.or(self.found.take());
        is_here
    }
}

impl Debugger {
    /// The last event of one of these kinds, at the present or before, for which `is_it` returns
    /// true. The present stays. A search that is given up finds nothing.
    pub fn last_event(
        &mut self,
        kinds: Kinds,
        progress: &mut Progress<'_>,
        is_it: impl FnMut(&Stamp, &Event) -> bool,
    ) -> Option<Told> {
        let begin = self.place();
        let mut sought = EventSought::new(kinds, is_it);
        let found = self.history_mut().seek_last_or_here(&mut sought, progress);
        let place = self.place();
        self.history_mut().go_back_to(begin);
        let (stamp, event, act, before) = sought.found.filter(|_| found == Found::Here)?;
        Some(Told { stamp, event, place, act, before })
    }

    /// The command that is executed now, or was last.
    pub fn executing(&mut self) -> Option<Executing> {
        let begin = self.place();
        let mut sought = LastCommand::default();
        let found = self.history_mut().seek_last_or_here(&mut sought, &mut uninterrupted);
        self.history_mut().go_back_to(begin);
        sought.found.filter(|_| found == Found::Here)
    }

    /// The number of the command that was executed last, and the commands around it.
    pub(crate) fn commands_around(
        &mut self,
        around: u64,
    ) -> (Option<CommandNumber>, Vec<SeenCommand>) {
        let (begin, known) = (self.place(), self.history().known());
        let mut present = None;
        let mut seen: VecDeque<SeenCommand> = VecDeque::new();
        // A command keeps the meaning it had when it was executed.
        let of = |history: &History<Wired>, stamp: Stamp, bytes: &[u8]| SeenCommand {
            number: stamp.command,
            line: bytes.to_vec(),
            meaning: history.device().explain(bytes),
        };
        let is_command = |_: &Stamp, event: &Event| matches!(event, Event::Command { .. });
        let mut sought = EventSought::new(Kinds::COMMAND, is_command);
        let history = self.history_mut();
        let mut found = history.seek_last_or_here(&mut sought, &mut uninterrupted);
        while found == Found::Here {
            if let Some((stamp, Event::Command { bytes, .. }, ..)) = sought.found.take() {
                present = present.or(stamp.command);
                seen.push_front(of(history, stamp, &bytes));
            }
            if seen.len() as u64 > around {
                break;
            }
            found = history.seek_last(&mut sought, &mut uninterrupted);
        }
        history.go_back_to(begin);
        // The future is shown as far as it is recorded.
        let heading = history.heading();
        let end = history.branches().find(|branch| branch.id == heading).map(|branch| branch.end);
        for _ in 0..around {
            let Some(end) = end else { break };
            if history.is_at_end()
                || history.seek_next(end.at, &mut sought, &mut uninterrupted) != Found::Here
            {
                break;
            }
            if let Some((stamp, Event::Command { bytes, .. }, ..)) = sought.found.take() {
                seen.push_back(of(history, stamp, &bytes));
            }
        }
        history.go_back_to(begin);
        // More may have happened at the last instant.
        history.forget_beyond(known);
        history.drain();
        (present, seen.into())
    }
}
