//! The faults of a line: which there are, how far they have come, and what they do to bytes.

use std::collections::VecDeque;
use std::time::Duration;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use super::chance::Dice;
use super::lane::span_of;
use super::rules::Rules;
use super::uart::{Wave, read_early};
use crate::{
    Breakpoint, Damage, Device, Event, Fault, FaultNews, FaultNumber, FaultStage, FaultView,
    Garbling, Kinds, LineFault, MOST_FAULTS, Output, OwnedInput, Strike, Time, Warning, Way,
};

/// The faults of a line and what they hold back.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Faults {
    /// In the order of their numbers.
    list: Vec<Begun>,
    /// The rules of scenarios, which see the same events at the same instants.
    #[serde(default, skip_serializing_if = "Rules::is_empty")]
    pub(super) rules: Rules,
    pub(super) to_host: Held,
    pub(super) to_controller: Held,
    /// Bytes that are sent at a different speed from the one they are read at.
    #[serde(default)]
    pub(super) wave_to_host: Wave,
    #[serde(default)]
    pub(super) wave_to_controller: Wave,
}

/// A fault that was begun.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Begun {
    number: FaultNumber,
    fault: Fault,
    stage: Stage,
    /// Opportunities since it can strike.
    #[serde(default)]
    seen: u64,
    #[serde(default)]
    struck: u64,
    /// How many bytes the running strike still takes.
    #[serde(default)]
    rest: u32,
    dice: Dice,
    /// Up to then bytes are held back together, or the line is held low.
    #[serde(default)]
    until: Option<Time>,
}

/// How far a fault has come.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Stage {
    /// It waits for this prerequisite, which has come this many times.
    Waits { step: usize, met: u32, breakpoint: Breakpoint },
    /// It has been able to strike since then.
    Strikes { since: Time },
    /// It is over, and has been reported.
    Over,
}

/// Bytes that have crossed the line and arrive later, because a fault holds them back.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Held {
    queue: VecDeque<(Time, u8)>,
    /// Nothing arrives before this time, because no byte overtakes another.
    free: Time,
    /// When the last byte arrived, or will.
    last: Option<Time>,
}

impl Held {
    pub(super) fn due(&self) -> Option<Time> {
        self.queue.front().map(|(due, _)| *due)
    }

    pub(super) fn len(&self) -> usize {
        self.queue.len()
    }

    /// Takes the first byte.
    pub(super) fn pop(&mut self) -> Option<u8> {
        self.queue.pop_front().map(|(_, byte)| byte)
    }

    /// Takes all that arrives together with the first byte.
    pub(super) fn pop_together(&mut self) -> Vec<u8> {
        let due = self.due();
        let mut bytes = Vec::new();
        while self.due() == due
            && let Some(byte) = self.pop()
        {
            bytes.push(byte);
        }
        bytes
    }
}

/// A byte on its way through the faults.
struct Flight {
    bytes: Vec<u8>,
    due: Time,
    /// It arrives in one piece with others, which takes no time of its own.
    merged: bool,
}

/// A fault of the device, which must be handed on to it.
pub(super) enum ForDevice {
    Begin(FaultNumber, Fault),
    End(FaultNumber),
    /// A rule does something.
    Do(OwnedInput),
}

impl Faults {
    /// Whether nothing here can matter any more.
    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty() && self.rules.is_empty() && self.leaving() + self.coming() == 0
    }

    /// How many bytes are on their way to the host.
    pub(super) fn leaving(&self) -> usize {
        self.to_host.len() + self.wave_to_host.len()
    }

    /// How many bytes are on their way to the controller.
    pub(super) fn coming(&self) -> usize {
        self.to_controller.len() + self.wave_to_controller.len()
    }

    /// The speed of the host for what goes this way, if it is not that of the controller.
    pub(super) fn speed(&self, way: Way, now: Time, baud: u32) -> Option<u32> {
        let speed = |begun: &Begun| match begun.fault.of_line() {
            Some(LineFault { damage: Damage::Speed(speed), way: ways, .. })
                if ways.has(way) && begun.seen_stage(now) == FaultStage::Strikes =>
            {
                Some(*speed)
            }
            _ => None,
        };
        self.list.iter().rev().find_map(speed).filter(|speed| *speed != baud)
    }

    /// Sends bytes whose bits are read at another speed, or that follow such bytes. Returns whether
    /// it did; otherwise they go the usual way.
    pub(super) fn send(&mut self, way: Way, bytes: &[u8], now: Time, baud: u32) -> bool {
        let host = self.speed(way, now, baud);
        let wave = match way {
            Way::ToHost => &mut self.wave_to_host,
            Way::ToController | Way::Both => &mut self.wave_to_controller,
        };
        if host.is_none() && wave.len() == 0 {
            return false;
        }
        match way {
            Way::ToHost => wave.push(bytes, now, baud),
            Way::ToController | Way::Both => wave.push(bytes, now, host.unwrap_or(baud)),
        }
        true
    }

    /// Takes what the receiver of a wave has read.
    pub(super) fn read(&mut self, way: Way, now: Time, baud: u32, news: &mut Vec<Output>) {
        let host = self.speed(way, now, baud).unwrap_or(baud);
        let taken = match way {
            Way::ToHost => self.wave_to_host.take(host),
            _ => self.wave_to_controller.take(baud),
        };
        let (Some(reading), sent) = taken else { return };
        let is_speed = |begun: &&mut Begun| {
            let line = begun.fault.of_line();
            line.is_some_and(|line| matches!(line.damage, Damage::Speed(_)) && line.way.has(way))
        };
        let other = self.speed(way, now, baud).is_some();
        let begun = self.list.iter_mut().rev().find(is_speed);
        if let Some(begun) = begun.filter(|_| other || sent != [reading.byte]) {
            // Which of the sent characters it is made of, nobody can say: what was read counts.
            begun.struck += 1;
            let arrives = Bytes::copy_from_slice(&[reading.byte]);
            let strike = Strike::Line { way, sent: sent.into(), arrives, late: 0 };
            tell(news, now, begun.number, FaultNews::Strikes(strike));
        }
        self.pass(way, reading.byte, now, baud, news);
    }

    fn held(&mut self, way: Way) -> &mut Held {
        match way {
            Way::ToHost => &mut self.to_host,
            Way::ToController | Way::Both => &mut self.to_controller,
        }
    }

    // --- beginning and ending ---

    /// Whether a fault of this number can begin now.
    pub(super) fn has_room_for(&self, number: FaultNumber, now: Time) -> bool {
        let takes = |begun: &Begun| begun.number == number || begun.is_done(now);
        number == FaultNumber::TERMINAL
            || self.list.len() < MOST_FAULTS
            || self.list.iter().any(takes)
    }

    pub(super) fn begin<D: Device>(
        &mut self,
        number: FaultNumber,
        fault: Fault,
        device: &D,
        news: &mut Vec<Output>,
    ) -> Vec<ForDevice> {
        let now = device.now();
        if !self.has_room_for(number, now) {
            // Who begins one by an order is told otherwise; a rule has nobody else to tell.
            let what =
                "no more than 1,000 faults at once; a rule's begins only when one has ended".into();
            news.push(Output::Event(now.into(), Event::Warning(Warning::NoEffect { what })));
            return Vec::new();
        }
        let mut given = self.end(Some(number), now, news);
        if self.list.len() >= MOST_FAULTS {
            let done = self.list.iter().find(|begun| begun.is_done(now)).map(|begun| begun.number);
            given.extend(done.map(|done| self.end(Some(done), now, news)).into_iter().flatten());
        }
        tell(news, device.now(), number, FaultNews::Begins(Box::new(fault.clone())));
        let seed = fault.when().seed;
        let dice = Dice::new(if seed == 0 { number.0.into() } else { seed });
        let mut begun = Begun {
            number,
            stage: Stage::Strikes { since: device.now() },
            fault,
            seen: 0,
            struck: 0,
            rest: 0,
            dice,
            until: None,
        };
        if begun.wait_for(0, device) {
            let arms = ForDevice::Begin(number, begun.fault.clone());
            given.extend((!begun.is_of_line()).then_some(arms));
        }
        let place = self.list.partition_point(|other| other.number < number);
        self.list.insert(place, begun);
        self.strike_at_once(place, device, news);
        given
    }

    /// Ends the fault of this number, or all.
    pub(super) fn end(
        &mut self,
        number: Option<FaultNumber>,
        at: Time,
        news: &mut Vec<Output>,
    ) -> Vec<ForDevice> {
        let mut given = Vec::new();
        self.list.retain(|begun| {
            let ends = number.is_none_or(|number| number == begun.number);
            if ends {
                tell(news, at, begun.number, FaultNews::Ends);
                given.extend(begun.is_with_device().then_some(ForDevice::End(begun.number)));
            }
            !ends
        });
        given
    }

    // --- prerequisites ---

    /// The kinds of events that show the prerequisites, all of them: several may come in one
    /// moment.
    pub(super) fn kinds(&self) -> Kinds {
        let waiting = self.list.iter().filter(|begun| matches!(begun.stage, Stage::Waits { .. }));
        let awaited = waiting.flat_map(|begun| &begun.fault.when().after);
        // The device itself reports when one of its own faults strikes.
        let own = self.list.iter().any(|begun| !begun.is_of_line());
        let own = if own { Kinds::FAULT } else { Kinds::NONE };
        let own = own.and(self.rules.kinds());
        awaited.fold(own, |kinds, awaited| kinds.and(awaited.condition.kinds()))
    }

    /// When the device has to be looked at next: a prerequisite may have come by then, or a fault
    /// has ended and the device must be told.
    pub(super) fn due<D: Device>(&self, device: &D) -> Option<Time> {
        let due = |begun: &Begun| match &begun.stage {
            Stage::Waits { breakpoint, .. } => breakpoint.next(device),
            Stage::Strikes { since } => {
                let ends = begun.ends(*since).filter(|_| begun.has_an_end());
                let leaves = begun.fault.when().during.as_ref();
                let leaves = leaves.and_then(|during| device.leaving(during));
                ends.into_iter().chain(leaves).min()
            }
            Stage::Over => None,
        };
        let high = self.list.iter().filter_map(Begun::high_again);
        self.list.iter().filter_map(due).chain(high).chain(self.rules.due(device)).min()
    }

    /// Looks at the device right after a cause or an input with these events, or between two causes.
    pub(super) fn look<D: Device>(
        &mut self,
        events: &[Event],
        device: &D,
        news: &mut Vec<Output>,
    ) -> Vec<ForDevice> {
        let now = device.now();
        let mut given = Vec::new();
        for event in events {
            if let Event::Fault { number, news: FaultNews::Strikes(_) } = event
                && let Some(begun) = self.list.iter_mut().find(|begun| begun.number == *number)
            {
                begun.struck += 1;
            }
        }
        for place in 0..self.list.len() {
            let Some(begun) = self.list.get_mut(place) else { continue };
            if begun.high_again().is_some_and(|high| high <= now) {
                begun.until = None;
            }
            match &mut begun.stage {
                Stage::Waits { .. } => {
                    if begun.awaits(events, device) {
                        tell(news, now, begun.number, FaultNews::Armed);
                        let arms = ForDevice::Begin(begun.number, begun.fault.clone());
                        given.extend((!begun.is_of_line()).then_some(arms));
                        self.strike_at_once(place, device, news);
                    }
                }
                Stage::Strikes { since } => {
                    let since = *since;
                    if begun.has_an_end() && begun.ends(since).is_some_and(|ends| ends <= now) {
                        begun.stage = Stage::Over;
                        given.extend((!begun.is_of_line()).then_some(ForDevice::End(begun.number)));
                    } else if let Some(during) = begun.fault.when().during.clone()
                        && !device.holds(&during, [].iter())
                    {
                        let step = begun.fault.when().after.len();
                        let breakpoint = Breakpoint::new(device, *during);
                        begun.stage = Stage::Waits { step, met: 0, breakpoint };
                        if !begun.is_of_line() {
                            begun.until = Some(now);
                            given.push(ForDevice::End(begun.number));
                        }
                    }
                }
                Stage::Over => {}
            }
        }
        given
    }

    // --- what is done to bytes ---

    /// A byte has crossed the line: lets what faults make of it arrive. A character takes the time
    /// of this speed, and none at 0.
    pub(super) fn pass(&mut self, way: Way, byte: u8, at: Time, baud: u32, news: &mut Vec<Output>) {
        let mut flight = Flight { bytes: vec![byte], due: at, merged: false };
        let last = self.held(way).last;
        for begun in &mut self.list {
            begun.strike(way, &mut flight, at, last, news);
        }
        self.deliver(way, flight, at, baud, news);
    }

    /// What arrives at once is passed on; the rest is held back.
    fn deliver(&mut self, way: Way, flight: Flight, at: Time, baud: u32, news: &mut Vec<Output>) {
        let Flight { bytes, due, merged } = flight;
        let held = self.held(way);
        let pace = if merged { 0 } else { span_of(10, baud) };
        let mut due = due.max(held.free);
        let alone = bytes.len() == 1 && due == at;
        for byte in bytes {
            if way == Way::ToHost && held.queue.is_empty() && due <= at {
                news.push(Output::Bytes(at, Bytes::copy_from_slice(&[byte])));
            } else {
                held.queue.push_back((due, byte));
            }
            held.last = Some(due);
            if !alone {
                // An inserted or delayed byte takes the time of a character, too.
                held.free = if merged { due } else { due.after_nanos(pace) };
                due = held.free;
            }
        }
    }

    /// A fault that needs no byte strikes as soon as it can.
    fn strike_at_once<D: Device>(&mut self, place: usize, device: &D, news: &mut Vec<Output>) {
        let (at, baud) = (device.now(), device.baud());
        let Some(begun) = self.list.get_mut(place) else { return };
        let Some(LineFault { damage, way, .. }) = begun.fault.of_line() else { return };
        if !matches!(begun.stage, Stage::Strikes { .. }) || !begun.needs_no_byte() {
            return;
        }
        let (number, way) = (begun.number, *way);
        let bytes = match damage {
            Damage::Insert(bytes) => bytes.clone(),
            Damage::Break(span) => {
                begun.until = Some(at + *span);
                Bytes::from_iter(read_break(*span, baud))
            }
            _ => return,
        };
        begun.struck += 1;
        for one in [Way::ToController, Way::ToHost] {
            if way.has(one) {
                let strike =
                    Strike::Line { way: one, sent: Bytes::new(), arrives: bytes.clone(), late: 0 };
                tell(news, at, number, FaultNews::Strikes(strike));
                let flight = Flight { bytes: bytes.to_vec(), due: at, merged: true };
                self.deliver(one, flight, at, baud, news);
            }
        }
    }

    // --- looking ---

    pub(super) fn views(&self, now: Time) -> impl Iterator<Item = FaultView> {
        self.list.iter().map(move |begun| FaultView {
            number: begun.number,
            fault: begun.fault.clone(),
            stage: begun.seen_stage(now),
            struck: begun.struck,
        })
    }
}

impl Begun {
    /// Waits for the prerequisites from a given one on. Says whether all of them have come.
    fn wait_for<D: Device>(&mut self, step: usize, device: &D) -> bool {
        for (step, awaited) in self.fault.when().after.iter().enumerate().skip(step) {
            let breakpoint = Breakpoint::new(device, awaited.condition.clone());
            let is_so = device.holds(&awaited.condition, [].iter());
            // A state that holds has come; only a counted one has to begin anew.
            if awaited.times > 1 || !is_so {
                self.stage = Stage::Waits { step, met: 0, breakpoint };
                return false;
            }
        }
        if let Some(during) = self.fault.when().during.clone()
            && step <= self.fault.when().after.len()
            && !device.holds(&during, [].iter())
        {
            let breakpoint = Breakpoint::new(device, *during);
            let step = self.fault.when().after.len();
            self.stage = Stage::Waits { step, met: 0, breakpoint };
            return false;
        }
        self.stage = Stage::Strikes { since: device.now() };
        true
    }

    /// Looks at the device right after these events, each of which can be only one of the things that it
    /// waits for, one after the other. Says whether all of them have come.
    fn awaits<D: Device>(&mut self, events: &[Event], device: &D) -> bool {
        let mut rest = events;
        while let Stage::Waits { step, met, breakpoint } = &mut self.stage {
            if !breakpoint.look(device, rest.iter()) {
                return false;
            }
            let has_come =
                |length: &usize| device.holds(breakpoint.condition(), rest.iter().take(*length));
            let used = (0..=rest.len()).find(has_come).unwrap_or(rest.len());
            rest = rest.get(used..).unwrap_or_default();
            *met += 1;
            let wanted = self.fault.when().after.get(*step).map_or(1, |next| next.times);
            let next = *step + 1;
            // Forgetting the end of this state would make the fault strike for ever.
            let again = self.until == Some(device.now()) && self.fault.when().during.is_some();
            if *met >= wanted && !again && self.wait_for(next, device) {
                return true;
            }
            if again || rest.is_empty() {
                return false;
            }
        }
        false
    }

    fn is_of_line(&self) -> bool {
        self.fault.of_line().is_some()
    }

    /// Whether the end of its time makes a difference: it can strike until then, or the end itself
    /// changes what a device does or how bits already on the line are read.
    fn has_an_end(&self) -> bool {
        let changes = |line: &LineFault| matches!(line.damage, Damage::Speed(_));
        self.fault.of_line().is_none_or(changes) || !self.has_struck_enough()
    }

    /// When the line that it holds low is high again.
    fn high_again(&self) -> Option<Time> {
        let line = self.fault.of_line()?;
        self.until.filter(|_| matches!(line.damage, Damage::Break(_)))
    }

    /// Whether the device has been given it.
    fn is_with_device(&self) -> bool {
        !self.is_of_line() && matches!(self.stage, Stage::Strikes { .. })
    }

    /// Whether nothing is left of it that could make a difference.
    fn is_done(&self, now: Time) -> bool {
        self.seen_stage(now) == FaultStage::Over && !self.is_with_device()
    }

    /// When its time is over.
    fn ends(&self, since: Time) -> Option<Time> {
        self.fault.when().lasts.map(|lasts| since + lasts)
    }

    fn has_struck_enough(&self) -> bool {
        self.rest == 0 && self.fault.when().times.is_some_and(|times| self.struck >= times)
    }

    fn seen_stage(&self, now: Time) -> FaultStage {
        match &self.stage {
            Stage::Waits { .. } => FaultStage::Waits,
            Stage::Strikes { since } => {
                let over = self.ends(*since).is_some_and(|ends| now >= ends);
                let held = self.until.is_some_and(|until| now < until);
                if over || self.has_struck_enough() && !held {
                    FaultStage::Over
                } else {
                    FaultStage::Strikes
                }
            }
            Stage::Over => FaultStage::Over,
        }
    }

    /// Whether it strikes by itself, once.
    fn needs_no_byte(&self) -> bool {
        let Some(LineFault { damage, when, .. }) = self.fault.of_line() else { return false };
        matches!(damage, Damage::Insert(_) | Damage::Break(_))
            && when.times == Some(1)
            && (when.first, when.every) == (1, 1)
            && when.chance == crate::Chance::CERTAIN
    }

    /// Whether it strikes at this opportunity.
    fn takes(&mut self, at: Time) -> bool {
        let Stage::Strikes { since } = self.stage else { return false };
        if self.ends(since).is_some_and(|ends| at >= ends) {
            return false;
        }
        if self.rest > 0 {
            self.rest -= 1;
            return true;
        }
        let when = self.fault.when();
        if when.times.is_some_and(|times| self.struck >= times) {
            return false;
        }
        self.seen += 1;
        let after_first = self.seen.checked_sub(when.first.max(1));
        let is_one = after_first.is_some_and(|after| after.is_multiple_of(when.every.max(1)));
        let chance = when.chance.as_millionths();
        if !is_one || self.dice.roll(1_000_000) >= chance {
            return false;
        }
        self.struck += 1;
        self.rest = self.fault.of_line().map_or(0, |fault| fault.run.saturating_sub(1));
        true
    }

    /// Applies the fault to a byte.
    fn strike(
        &mut self,
        way: Way,
        flight: &mut Flight,
        at: Time,
        last: Option<Time>,
        news: &mut Vec<Output>,
    ) {
        let Some(LineFault { damage, way: ways, .. }) = self.fault.of_line() else { return };
        let damage = damage.clone();
        if !ways.has(way) || flight.bytes.is_empty() || matches!(damage, Damage::Speed(_)) {
            return;
        }
        let (sent, due) = (flight.bytes.clone(), flight.due);
        let holds = self.until.is_some_and(|until| at < until);
        if holds {
            match &damage {
                Damage::Break(_) => flight.bytes.clear(),
                _ => {
                    flight.due = flight.due.max(self.until.unwrap_or_default());
                    flight.merged = true;
                }
            }
        } else if self.needs_no_byte() || !self.takes(at) {
            return;
        } else {
            let later = |span: Duration| at + span;
            match damage {
                Damage::Drop | Damage::Cut => flight.bytes.clear(),
                Damage::Garble(garbling) => {
                    for byte in &mut flight.bytes {
                        *byte = match garbling {
                            Garbling::Bit => *byte ^ self.any_bit(),
                            Garbling::Flip(mask) => *byte ^ mask,
                            Garbling::Into(byte) => byte,
                        };
                    }
                }
                Damage::Duplicate => {
                    flight.bytes = sent.iter().flat_map(|byte| [*byte, *byte]).collect();
                }
                Damage::Delay(span) => flight.due = flight.due + span,
                Damage::Insert(bytes) => flight.bytes = [&bytes[..], &sent].concat(),
                Damage::Split(gap) => {
                    let earliest = last.map_or(Time::ZERO, |last| last + gap);
                    flight.due = flight.due.max(earliest);
                }
                Damage::Merge(span) => {
                    self.until = Some(later(span));
                    flight.due = flight.due.max(later(span));
                    flight.merged = true;
                }
                Damage::Parity(bad) => {
                    let read = |byte: &u8| bad.read(byte ^ self.any_bit());
                    flight.bytes = sent.iter().flat_map(read).collect();
                }
                Damage::Framing(bad) => {
                    let early = self.dice.roll(8) + 1;
                    let read = |byte: &u8| read_early(*byte, early);
                    let read = sent.iter().flat_map(read);
                    let taken = read.map(|(byte, whole)| match whole {
                        true => Bytes::copy_from_slice(&[byte]),
                        false => bad.read(byte),
                    });
                    flight.bytes = taken.flatten().collect();
                }
                Damage::Break(span) => {
                    self.until = Some(later(span));
                    flight.bytes = vec![0];
                }
                Damage::Speed(_) => {}
            }
        }
        let late = flight.due.nanos_since(due);
        if flight.bytes != sent || late > 0 {
            let (sent, arrives) = (sent.into(), Bytes::copy_from_slice(&flight.bytes));
            let strike = Strike::Line { way, sent, arrives, late };
            tell(news, at, self.number, FaultNews::Strikes(strike));
        }
    }

    fn any_bit(&mut self) -> u8 {
        1 << self.dice.roll(8)
    }
}

/// What is read while a line is held low for a time at a speed: nothing as long as the low is
/// shorter than half a bit, a byte with the lower bits 0 as long as it is shorter than a character, and
/// a zero that has no stop bit otherwise.
fn read_break(span: Duration, baud: u32) -> Option<u8> {
    let bits = (span.as_nanos() * u128::from(baud) + 500_000_000) / 1_000_000_000;
    match bits {
        0 => None,
        1..=8 => Some(u8::try_from((0xFF_u16 << (bits - 1)) & 0xFF).unwrap_or_default()),
        _ => Some(0),
    }
}

fn tell(news: &mut Vec<Output>, at: Time, number: FaultNumber, what: FaultNews) {
    news.push(Output::Event(at.into(), Event::Fault { number, news: what }));
}
