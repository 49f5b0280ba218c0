//! The host: it sends the commands of a file, each when its turn comes.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use crate::Wired;
use crate::unmet::Unmet;
use vimc4_device::{CommandNumber, Condition, Device, Event, Input, Output, SignalId, Time};
use vimc4_timeline::{BranchId, History, Moment, Place};

/// A step of the host, done when the controller has completed the one before.
#[derive(Clone, Debug, PartialEq)]
pub enum Piece {
    /// It sends bytes: a command with its end, or part of a stream of them.
    Send(Vec<u8>),
    /// A button is pressed and released.
    Press(SignalId),
    /// It lets time pass.
    Wait(Duration),
    /// It waits until a condition holds; with the condition for people.
    Until(Condition, String),
    /// It asks the operator, who continues when it is done; with the question for people.
    Ask(String),
}

impl Piece {
    /// Whether it does nothing to the controller.
    fn is_waiting(&self) -> bool {
        match self {
            Piece::Send(_) | Piece::Press(_) => false,
            Piece::Wait(_) | Piece::Until(..) | Piece::Ask(_) => true,
        }
    }
}

/// What a host will do, and how far it has got at every moment of every branch of a history. What
/// it has done is in the history; on a new branch it continues from where the branch parted.
#[derive(Clone, Debug)]
pub struct Feed {
    pieces: Arc<[Piece]>,
    /// The line of the file, from 1, that each of them is of, as far as that is known.
    lines: Arc<[u32]>,
    /// For each branch, how many pieces were done at these moments, in order.
    done: BTreeMap<BranchId, Vec<Done>>,
    /// For each branch, the moments at which it asked the operator or came to wait, and by which piece, in
    /// order.
    asked: BTreeMap<BranchId, Vec<(Moment, usize)>>,
    /// The piece for which it waits or waited last, and where that was.
    wait: Option<Wait>,
    /// It sends nothing more after an error reply.
    gives_up: bool,
}

/// An error reply after which nothing more is sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refused {
    /// The command that was answered with it.
    pub command: Option<CommandNumber>,
    /// The reply, without its end.
    pub answer: String,
    /// What it means.
    pub why: String,
}

/// A piece that holds the host up. Several of them can be at one moment of the history, which does
/// not tell them apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Wait {
    place: Place,
    piece: usize,
    /// Whether it still waits for it.
    lasts: bool,
}

/// What a host asks or has asked last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Standing(Option<Wait>);

/// What a host has done by now on a branch.
#[derive(Clone)]
pub(crate) struct Fed {
    branch: BranchId,
    /// How often it has done something, and how far it has got.
    done: usize,
    last: Option<Done>,
    asked: usize,
}

/// A question that the host asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Asked {
    pub(crate) place: Place,
    /// Which of those at this place it is, from 0.
    pub(crate) nth: usize,
    /// The line of the file, from 1.
    pub(crate) line: u32,
}

/// What a host has done when its turn came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Turn {
    /// Something.
    Acted,
    /// Nothing.
    Idle,
    /// It has come to something that it asks, and waits.
    Asks,
    /// It has come to a line at which it waits for a time or a condition. It goes on there when its turn
    /// comes again.
    Comes,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Done {
    at: Moment,
    /// Waiting is done at the moment itself; an input given then counts from the next moment on.
    is_over: bool,
    /// The number of the next piece.
    next: usize,
    /// Why those before it that were not done are left out.
    refused: Option<Arc<Refused>>,
}

impl Feed {
    /// A host that has not done anything.
    #[must_use]
    pub fn new(pieces: Vec<Piece>) -> Feed {
        Feed {
            pieces: pieces.into(),
            lines: Arc::default(),
            done: BTreeMap::new(),
            asked: BTreeMap::new(),
            wait: None,
            gives_up: false,
        }
    }

    /// The lines of a file, from 1, that its steps are of; 0 for one that is of none.
    #[must_use]
    pub fn of_lines(mut self, lines: Vec<u32>) -> Feed {
        self.lines = lines.into();
        self
    }

    /// It sends nothing more after an error reply, as careful software does.
    #[must_use]
    pub fn until_error(mut self) -> Feed {
        self.gives_up = true;
        self
    }

    /// At the end comes this as well.
    pub(crate) fn then(&mut self, piece: Piece) {
        self.pieces = self.pieces.iter().cloned().chain([piece]).collect();
    }

    /// Somebody answers what it asks at the present. Says whether it asked anything.
    pub(crate) fn is_answered(&mut self, history: &History<Wired>) -> bool {
        let asked = self.waits_for(history).filter(|_| self.asks_now(history));
        let Some(piece) = asked else { return false };
        // It is known to be answered: else it would be asked here for ever.
        self.wait = Some(Wait { place: history.present(), piece, lasts: false });
        true
    }

    /// What it asks at the present, or what it waits for, if that is not so; in the words of the file, with
    /// what it is now and what changes that.
    #[must_use]
    pub fn waits(&self, history: &History<Wired>) -> Option<String> {
        match self.pieces.get(self.waits_for(history)?)? {
            Piece::Ask(what) => Some(what.clone()),
            Piece::Until(_, what) => {
                let condition = self.waits_until(history)?;
                Some(format!("{what}{}", Unmet { condition, device: history.device().device() }))
            }
            _ => None,
        }
    }

    /// The piece that holds it up at the present.
    fn waits_for(&self, history: &History<Wired>) -> Option<usize> {
        let Wait { place, piece, .. } = self.wait.filter(|wait| wait.lasts)?;
        // While it waits, time can pass, and something can be done by hand.
        let next = match self.pieces.get(piece)? {
            Piece::Ask(_) => piece + 1,
            _ => piece,
        };
        let still = || history.is_at_end() && self.next(history) == next;
        (place == history.present() || still()).then_some(piece)
    }

    /// Whether it has done everything on the way to the present.
    #[must_use]
    pub fn is_done(&self, history: &History<Wired>) -> bool {
        self.next(history) >= self.pieces.len()
    }

    /// Whether it does nothing more than press a button.
    pub(crate) fn only_starts(&self, history: &History<Wired>) -> bool {
        let left = self.pieces.get(self.next(history)..).unwrap_or_default();
        !left.is_empty() && left.iter().all(|piece| matches!(piece, Piece::Press(_)))
    }

    /// The error reply after which it sent nothing more, if that is why it is done.
    #[must_use]
    pub fn refused(&self, history: &History<Wired>) -> Option<&Refused> {
        self.last(history)?.refused.as_deref()
    }

    /// The line of the file at which it waits or asks, if it does at the present.
    pub(crate) fn waits_at(&self, history: &History<Wired>) -> Option<u32> {
        let line = self.lines.get(self.waits_for(history)?).copied();
        line.filter(|line| *line > 0)
    }

    /// Whether it asks the operator at the present.
    pub(crate) fn asks_now(&self, history: &History<Wired>) -> bool {
        let waits = self.waits_for(history).and_then(|piece| self.pieces.get(piece));
        matches!(waits, Some(Piece::Ask(_)))
    }

    /// The first line of the file at which it asks or waits, from this one on.
    pub(crate) fn asks_from(&self, line: u32) -> Option<u32> {
        let waits = self.pieces.iter().zip(self.lines.iter());
        let waits = waits.filter(|(piece, of)| piece.is_waiting() && **of >= line);
        waits.map(|(_, of)| *of).filter(|of| *of > 0).min()
    }

    /// Whether the last thing on the way to the present at which it asked or came to wait is this one.
    fn has_come_to(&self, piece: usize, history: &History<Wired>) -> bool {
        let mut place = history.present();
        loop {
            let asked = self.asked.get(&place.branch).map_or(&[][..], Vec::as_slice);
            let by_then = asked.partition_point(|(moment, _)| *moment <= place.moment);
            if let Some((_, last)) = by_then.checked_sub(1).and_then(|last| asked.get(last)) {
                return *last == piece;
            }
            let mut branches = history.branches();
            let branch = branches.find(|own| own.id == place.branch);
            let Some(parted) = branch.and_then(|own| own.parted) else { return false };
            place = parted;
        }
    }

    /// It has come to a piece at the present at which it asks or waits.
    fn comes_to(&mut self, piece: usize, history: &History<Wired>) {
        let place = history.present();
        self.asked.entry(place.branch).or_default().push((place.moment, piece));
        self.wait = Some(Wait { place, piece, lasts: true });
    }

    /// What gives it something to do before the controller rests: a command leaves the buffer that it fills,
    /// or what it waits for at the present is so.
    pub(crate) fn looks_for(&self, history: &History<Wired>) -> Option<Condition> {
        if !history.is_at_end() {
            return None;
        }
        if !history.device().details().says_when_done() && !self.is_done(history) {
            return Some(Condition::Command { like: None });
        }
        self.waits_until(history).cloned()
    }

    /// What it waits for at the present, if that is a condition that does not hold.
    fn waits_until(&self, history: &History<Wired>) -> Option<&Condition> {
        let Piece::Until(condition, _) = self.pieces.get(self.waits_for(history)?)? else {
            return None;
        };
        (!holds(condition, history)).then_some(condition)
    }

    /// Does what is due now, and says what that was. What it waited for by now is over: it asks what it
    /// has asked at this moment behind that, or goes on. In the past it does nothing else, and nothing
    /// while an earlier input has not taken effect.
    pub(crate) fn go_on(&mut self, history: &mut History<Wired>) -> Turn {
        let present = history.present();
        if let Some(piece) = self.asks_here(present) {
            self.wait = Some(Wait { place: present, piece, lasts: true });
            return match self.pieces.get(piece) {
                Some(Piece::Ask(_)) => Turn::Asks,
                _ => Turn::Comes,
            };
        }
        if let Some(wait) = &mut self.wait {
            wait.lasts = false;
        }
        let is_heeded = history.inputs(present.branch, present.moment.inputs).next().is_none();
        if !history.is_at_end() || !is_heeded {
            return Turn::Idle;
        }
        let pieces = Arc::clone(&self.pieces);
        // A resting controller takes anything; otherwise it takes only what there is room for.
        let mut rests = history.device().is_idle();
        let mut room = match history.device().details().says_when_done() {
            true => 0,
            false => history.device().room(true),
        };
        let mut number = self.next(history);
        let first = number;
        while let Some(piece) = pieces.get(number) {
            match piece {
                Piece::Send(bytes) if rests || bytes.len() <= room => {
                    history.give(Input::Bytes(bytes));
                    room = room.saturating_sub(bytes.len());
                    rests = false;
                    self.keep(history, false, number + 1);
                }
                _ if !rests => break,
                Piece::Wait(_) | Piece::Until(..)
                    if self.lines.get(number).is_some_and(|line| *line > 0)
                        && !self.has_come_to(number, history) =>
                {
                    self.comes_to(number, history);
                    return Turn::Comes;
                }
                Piece::Send(_) => {}
                Piece::Press(button) => {
                    history.give(Input::Signal(*button, 1));
                    history.give(Input::Signal(*button, 0));
                    self.keep(history, false, number + 1);
                    return Turn::Acted;
                }
                Piece::Wait(time) => {
                    history.run_to(history.now() + *time);
                    self.keep(history, true, number + 1);
                }
                Piece::Until(condition, _) => {
                    if !holds(condition, history) {
                        let place = history.present();
                        self.wait = Some(Wait { place, piece: number, lasts: true });
                        break;
                    }
                    self.keep(history, true, number + 1);
                }
                Piece::Ask(_) => {
                    self.keep(history, true, number + 1);
                    self.comes_to(number, history);
                    return Turn::Asks;
                }
            }
            number += 1;
        }
        if number > first { Turn::Acted } else { Turn::Idle }
    }

    /// Something has come out where the way was not known yet. After an error reply it does nothing
    /// more, if it is so careful.
    pub(crate) fn hear<'o>(
        &mut self,
        history: &History<Wired>,
        outputs: impl IntoIterator<Item = &'o Output>,
    ) {
        let all = self.pieces.len();
        if !self.gives_up || !history.is_at_end() || self.next(history) >= all {
            return;
        }
        let refused = outputs.into_iter().find_map(|output| match output {
            Output::Event(stamp, Event::Answer { why: Some(why), bytes, .. }) => {
                let answer = String::from_utf8_lossy(bytes.trim_ascii()).into_owned();
                let refused = Refused { command: stamp.command, answer, why: why.to_string() };
                Some((stamp.at, refused))
            }
            _ => None,
        });
        let Some((at, reply)) = refused else { return };
        let present = history.present();
        let done = self.done.entry(present.branch).or_default();
        // It counts from just then on, and after what was sent.
        let refused = Moment { at, causes: 0, ..present.moment };
        let at = done.last().map_or(refused, |last| last.at.max(refused));
        done.push(Done { at, is_over: true, next: all, refused: Some(Arc::new(reply)) });
    }

    /// What was given at a time on the way to another branch is given here as well: what was sent there
    /// by then is sent.
    pub(crate) fn copy(&mut self, history: &History<Wired>, from: BranchId, at: Time) {
        let (mut branch, mut at) = (from, at);
        let next = loop {
            let done = self.done.get(&branch).map_or(&[][..], Vec::as_slice);
            let by_then = done.partition_point(|done| done.at.at <= at);
            if let Some(last) = by_then.checked_sub(1).and_then(|last| done.get(last)) {
                break last.next;
            }
            let mut branches = history.branches();
            match branches.find(|own| own.id == branch).and_then(|own| own.parted) {
                Some(parting) => (branch, at) = (parting.branch, at.min(parting.moment.at)),
                None => break 0,
            }
        };
        self.keep(history, false, next);
    }

    /// The next moment on the way of the present at which it asked the operator or came to wait.
    pub(crate) fn asked_ahead(&self, history: &History<Wired>) -> Option<Place> {
        if self.asked.is_empty() {
            return None;
        }
        let present = history.present();
        let branches: Vec<_> = history.branches().collect();
        let mut ahead = None;
        let (mut branch, mut until) = (history.heading(), None);
        // Searched from the end of the way back to the present, so the last one found is the next
        // one.
        loop {
            let is_here = branch == present.branch;
            let asked = self.asked.get(&branch).into_iter().flatten().map(|(moment, _)| *moment);
            let next = asked
                .filter(|moment| !is_here || *moment > present.moment)
                .find(|moment| until.is_none_or(|until| *moment <= until));
            ahead = next.map(|moment| Place { branch, moment }).or(ahead);
            let own = branches.iter().find(|own| own.id == branch);
            let Some(parted) = own.and_then(|own| own.parted).filter(|_| !is_here) else {
                return ahead;
            };
            (branch, until) = (parted.branch, Some(parted.moment));
        }
    }

    /// The last moment on the way to the present at which it asked or came to wait, and the piece that did.
    pub(crate) fn asked_behind(&self, history: &History<Wired>) -> Option<(Place, usize)> {
        let present = history.present();
        let mut place = present;
        loop {
            let asked = self.asked.get(&place.branch).map_or(&[][..], Vec::as_slice);
            let is_behind = |(moment, piece): &&(Moment, usize)| {
                *moment < place.moment
                    || *moment == place.moment
                        && (place != present || self.is_over(present, *piece))
            };
            if let Some((moment, piece)) = asked.iter().rev().find(is_behind) {
                return Some((Place { branch: place.branch, moment: *moment }, *piece));
            }
            let mut branches = history.branches();
            place = branches.find(|own| own.id == place.branch)?.parted?;
        }
    }

    /// The first of what it asked at a place that is still ahead there.
    pub(crate) fn asks_here(&self, place: Place) -> Option<usize> {
        let wait = self.wait.filter(|wait| wait.place == place);
        let is_ahead = |piece: usize| wait.is_none_or(|wait| wait.piece < piece);
        let mut asked = self.asked_at(place);
        asked.find(|piece| is_ahead(*piece))
    }

    /// What it asked at a place, in order.
    fn asked_at(&self, place: Place) -> impl DoubleEndedIterator<Item = usize> + '_ {
        let asked = self.asked.get(&place.branch).map_or(&[][..], Vec::as_slice);
        asked.iter().filter(move |(moment, _)| *moment == place.moment).map(|(_, piece)| *piece)
    }

    /// How many of the questions at a place it has come to.
    pub(crate) fn has_asked_here(&self, place: Place) -> usize {
        let ahead = self.asks_here(place);
        self.asked_at(place).take_while(|piece| Some(*piece) != ahead).count()
    }

    /// What it asked on the way to the present, in order, up to so many questions at the present itself.
    pub(crate) fn asked_on_way(&self, history: &History<Wired>, here: usize) -> Vec<Asked> {
        let branches: Vec<_> = history.branches().collect();
        let present = history.present();
        let mut asked = Vec::new();
        let mut way = Some(present);
        while let Some(last) = way {
            let own = self.asked.get(&last.branch).map_or(&[][..], Vec::as_slice);
            let own = own.iter().take_while(|(moment, _)| *moment <= last.moment);
            let mut nth = 0;
            let mut before = None;
            let own = own.map(|(moment, piece)| {
                nth = if before == Some(*moment) { nth + 1 } else { 0 };
                before = Some(*moment);
                let place = Place { branch: last.branch, moment: *moment };
                Asked { place, nth, line: self.lines.get(*piece).copied().unwrap_or_default() }
            });
            let own: Vec<Asked> = own.filter(|it| it.place != present || it.nth < here).collect();
            asked.splice(..0, own);
            let branch = branches.iter().find(|branch| branch.id == last.branch);
            way = branch.and_then(|branch| branch.parted);
        }
        asked
    }

    /// Whether somebody has answered what it asked at the present.
    fn is_over(&self, present: Place, piece: usize) -> bool {
        let wait = self.wait.filter(|wait| wait.place == present);
        wait.is_some_and(|wait| piece < wait.piece || piece == wait.piece && !wait.lasts)
    }

    /// Whether it asks at the present, or has asked there and was answered.
    pub(crate) fn has_come_to_ask(&self, history: &History<Wired>) -> bool {
        self.wait.is_some_and(|wait| wait.place == history.present())
    }

    /// The present is before whatever it asks there.
    pub(crate) fn has_moved(&mut self) {
        self.wait = None;
    }

    /// It asks there once more.
    pub(crate) fn ask_again(&mut self, place: Place, piece: Option<usize>) {
        let piece = piece.or_else(|| self.asked_at(place).next());
        self.wait = piece.map(|piece| Wait { place, piece, lasts: true });
    }

    /// Somebody comes to a place by its name or time, after everything that happens then: it waits for
    /// what it asked there last, unless it is known to be there.
    pub(crate) fn is_found(&mut self, place: Place) {
        if self.wait.is_none_or(|wait| wait.place != place) {
            let last = self.asked_at(place).next_back();
            self.wait = last.map(|piece| Wait { place, piece, lasts: true });
        }
    }

    /// What it has done by now on a branch, to be come back to.
    pub(crate) fn fed(&self, branch: BranchId) -> Fed {
        let done = self.done.get(&branch).map_or(&[][..], Vec::as_slice);
        let asked = self.asked.get(&branch).map_or(0, Vec::len);
        Fed { branch, done: done.len(), last: done.last().cloned(), asked }
    }

    /// What it has done there since then it has not done.
    pub(crate) fn takes_back(&mut self, Fed { branch, done, last, asked }: Fed) {
        let own = self.done.entry(branch).or_default();
        own.truncate(done);
        if let (Some(own), Some(last)) = (own.last_mut(), last) {
            *own = last;
        }
        self.asked.entry(branch).or_default().truncate(asked);
    }

    /// What it asks or has asked last, to be put back.
    pub(crate) fn standing(&self) -> Standing {
        Standing(self.wait)
    }

    pub(crate) fn stand(&mut self, Standing(wait): Standing) {
        self.wait = wait;
    }

    /// Something was done by hand at a place, perhaps on a branch that begins there: what it had not come
    /// to ask there by then it asks after that.
    pub(crate) fn is_given(&mut self, history: &History<Wired>, from: Place) {
        let Some(next) = self.asks_here(from) else { return };
        if history.present() == from
            && let Some(asked) = self.asked.get_mut(&from.branch)
        {
            asked.retain(|(moment, piece)| *moment != from.moment || *piece < next);
        }
        self.keep(history, true, next);
    }

    fn keep(&mut self, history: &History<Wired>, is_over: bool, next: usize) {
        let present = history.present();
        let done = self.done.entry(present.branch).or_default();
        let at = present.moment;
        match done.last_mut().filter(|last| last.at == at && last.is_over == is_over) {
            Some(last) => last.next = next,
            None => done.push(Done { at, is_over, next, refused: None }),
        }
    }

    /// The number of the piece that comes next at the present.
    fn next(&self, history: &History<Wired>) -> usize {
        self.last(history).map_or(0, |last| last.next)
    }

    /// What it has done last on the way to the present.
    fn last(&self, history: &History<Wired>) -> Option<&Done> {
        let mut place = history.present();
        loop {
            let done = self.done.get(&place.branch).map_or(&[][..], Vec::as_slice);
            let before = done.partition_point(|done| {
                done.at < place.moment || done.is_over && done.at == place.moment
            });
            if let Some(last) = before.checked_sub(1).and_then(|last| done.get(last)) {
                return Some(last);
            }
            let mut branches = history.branches();
            place = branches.find(|branch| branch.id == place.branch)?.parted?;
        }
    }
}

/// Whether a condition holds at the present, whatever happens there.
fn holds(condition: &Condition, history: &History<Wired>) -> bool {
    let nothing: [&Event; 0] = [];
    history.device().holds(condition, nothing.into_iter())
}
