//! The serial line, with the time its characters take, and what goes wrong on it.

mod chance;
mod faults;
mod lane;
mod rules;
mod uart;

use std::collections::VecDeque;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use self::faults::{Faults, ForDevice};
use self::lane::{INSTANT, Lane};
use self::rules::Rules;
use crate::{
    Activity, Device, Event, Fact, Fault, FaultNumber, FaultView, Faulting, Input, Kinds,
    ModemLine, Output, OwnedInput, Point, RuleView, Ruling, Running, ScenarioNumber, Signal,
    SignalId, Time, View, Way,
};

/// How many bytes may be on their way to a paced device. A client that writes faster than the
/// line is held back by its own operating system, as it is by a real port.
const LANE: usize = 4_096;

/// A device at the end of a serial line; together they are again a device.
///
/// On a paced line every character takes ten bit times at the device's [`baud`](Device::baud)
/// rate, in both directions and in model time: a byte reaches the device when its stop bit has
/// passed, and an answer leaves byte by byte. On an [ideal](Line::ideal) line nothing takes any
/// time. Neither knows a clock; pacing is as reproducible as the device itself.
///
/// What goes wrong on the line is begun and ended by [`Input::Fault`]. All other faults pass
/// through to the device, each when its prerequisites have come, and its end when its time is over.
/// So a device only knows faults that are present or absent.
///
/// Scenarios begin and end by [`Input::Rule`]: what their rules do is given to the device, or begins
/// a fault of the line.
///
/// With a fault or a rule, bytes reach the device one by one, each after the consequences of the one
/// before.
#[derive(Clone, Debug)]
pub struct Line<D: Device> {
    device: D,
    wires: Wires,
    ready: VecDeque<Output>,
    /// The kinds of events that are watched from outside. Faults may need more.
    wanted: Kinds,
}

/// The state of a device and its line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LineState<S> {
    /// The device's own state.
    pub device: S,
    wires: Wires,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Wires {
    paced: bool,
    to_device: Lane,
    from_device: Lane,
    /// The highest number that a fault ever had.
    #[serde(default, skip_serializing_if = "FaultNumber::is_next")]
    numbered: FaultNumber,
    /// The highest number that a scenario ever had.
    #[serde(default, skip_serializing_if = "ScenarioNumber::is_next")]
    scenarios: ScenarioNumber,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    faults: Option<Box<Faults>>,
}

/// What happens next on the line, in the order in which it happens at equal times: the device is
/// looked at, a byte leaves, the device does something by itself, a byte arrives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Next {
    Look,
    HeldLeaves,
    Leaves,
    WaveLeaves,
    Wakes,
    HeldArrives,
    Arrives,
    WaveArrives,
}

impl<D: Device> Line<D> {
    /// A line on which characters take no time.
    pub fn ideal(device: D) -> Line<D> {
        Line::new(device, false)
    }

    /// A line on which every character takes ten bit times.
    pub fn paced(device: D) -> Line<D> {
        Line::new(device, true)
    }

    /// Whether every character takes its time.
    pub fn is_paced(&self) -> bool {
        self.wires.paced
    }

    /// How many bytes that were sent to the device have not reached it yet.
    pub fn coming(&self) -> usize {
        let Wires { to_device, faults, .. } = &self.wires;
        to_device.len() + faults.as_ref().map_or(0, |faults| faults.coming())
    }

    /// The byte that crosses the line to the device by the next cause, if one does, and how many were sent
    /// after it.
    pub fn arriving(&self) -> Option<(u8, usize)> {
        let Wires { to_device, faults, .. } = &self.wires;
        let (_, next) = self.next()?;
        let byte = to_device.first().filter(|_| next == Next::Arrives)?;
        let later = faults.as_ref().map_or(0, |faults| faults.wave_to_controller.len());
        Some((byte, to_device.len() - 1 + later))
    }

    fn new(mut device: D, paced: bool) -> Line<D> {
        let wires = Wires {
            paced,
            to_device: Lane::default(),
            from_device: Lane::default(),
            numbered: FaultNumber::NEXT,
            scenarios: ScenarioNumber::NEXT,
            faults: None,
        };
        let wanted = device.watch(Kinds::NONE);
        device.watch(wanted);
        Line { device, wires, ready: VecDeque::new(), wanted }
    }

    /// The device at the end of the line.
    pub fn device(&self) -> &D {
        &self.device
    }

    /// What happens next, and when.
    fn next(&self) -> Option<(Time, Next)> {
        let Wires { to_device, from_device, faults, .. } = &self.wires;
        let of = |due: Option<Time>, next: Next| due.map(|due| (due, next));
        let line = [
            of(from_device.due(), Next::Leaves),
            of(self.device.wake(), Next::Wakes),
            of(to_device.due(), Next::Arrives),
        ];
        let next = line.into_iter().flatten().min();
        let Some(faults) = faults else { return next };
        let baud = self.device.baud();
        let host = faults.speed(Way::ToHost, self.device.now(), baud).unwrap_or(baud);
        // At another speed the end of a character may be over already.
        let wave = |due: Option<Time>| due.map(|due| due.max(self.device.now()));
        let others = [
            of(wave(faults.wave_to_host.due(host)), Next::WaveLeaves),
            of(wave(faults.wave_to_controller.due(baud)), Next::WaveArrives),
            of(faults.due(&self.device), Next::Look),
            of(faults.to_host.due(), Next::HeldLeaves),
            of(faults.to_controller.due(), Next::HeldArrives),
        ];
        others.into_iter().flatten().chain(next).min()
    }

    /// Whether bytes reach the device one by one.
    fn has_lane(&self) -> bool {
        let Wires { paced, to_device, faults, .. } = &self.wires;
        *paced || faults.is_some() || to_device.len() > 0
    }

    /// The speed at which characters take their time.
    fn pace(&self) -> u32 {
        if self.wires.paced { self.device.baud().max(1) } else { INSTANT }
    }

    /// Takes the device's output: its bytes still have to cross the line.
    fn collect(&mut self) {
        if self.wires.faults.is_some() {
            return self.collect_with_faults();
        }
        while let Some(output) = self.device.poll_output() {
            match output {
                Output::Bytes(at, bytes) if self.wires.paced => {
                    let baud = self.pace();
                    self.wires.from_device.push(&bytes, at, baud);
                }
                output => self.ready.push_back(output),
            }
        }
    }

    /// The same with faults: prerequisites are checked before the bytes that came with them go on
    /// their way.
    fn collect_with_faults(&mut self) {
        let baud = self.pace();
        loop {
            let Wires { faults, numbered, paced, from_device, .. } = &mut self.wires;
            let Some(faults) = faults.as_deref_mut() else { return };
            let outputs: Vec<Output> = std::iter::from_fn(|| self.device.poll_output()).collect();
            let events: Vec<Event> = outputs.iter().filter_map(Output::event).cloned().collect();
            let mut news = Vec::new();
            let mut given = faults.look(&events, &self.device, &mut news);
            let done = faults.rules.look(&events, &self.device, numbered, &mut news);
            for input in done {
                // A fault strikes the bytes that come with what it was begun for.
                given.extend(match input {
                    OwnedInput::Fault(Faulting::Begin(number, fault)) => {
                        faults.begin(number, fault, &self.device, &mut news)
                    }
                    OwnedInput::Fault(Faulting::End(number)) => {
                        faults.end(Some(number), self.device.now(), &mut news)
                    }
                    OwnedInput::Fault(Faulting::EndAll) => {
                        faults.end(None, self.device.now(), &mut news)
                    }
                    input => vec![ForDevice::Do(input)],
                });
            }
            let mut leaving = Vec::new();
            for output in outputs {
                match output {
                    Output::Bytes(at, bytes) => {
                        leaving.append(&mut news);
                        let speed = self.device.baud();
                        if faults.send(Way::ToHost, &bytes, at, speed) {
                            continue;
                        }
                        if *paced {
                            from_device.push(&bytes, at, baud);
                        } else {
                            for byte in bytes {
                                faults.pass(Way::ToHost, byte, at, INSTANT, &mut leaving);
                            }
                        }
                    }
                    other => leaving.push(other),
                }
            }
            leaving.append(&mut news);
            self.leave(leaving);
            if given.is_empty() {
                break;
            }
            self.give(given);
        }
        self.mind_faults();
    }

    /// Passes on the reports of faults and the bytes that they have made.
    fn leave(&mut self, outputs: Vec<Output>) {
        for output in outputs {
            match output {
                Output::Bytes(at, bytes) => match self.ready.back_mut() {
                    // Bytes that were handled one by one leave in one piece again.
                    Some(Output::Bytes(before, piece)) if *before == at => {
                        *piece = [&piece[..], &bytes[..]].concat().into();
                    }
                    _ => self.ready.push_back(Output::Bytes(at, bytes)),
                },
                Output::Event(stamp, event) => {
                    if self.wanted.contain(event.kind()) {
                        self.ready.push_back(Output::Event(stamp, event));
                    }
                }
                Output::Flash(..) => self.ready.push_back(output),
            }
        }
    }

    /// Gives the device the faults that are its own.
    fn give(&mut self, given: Vec<ForDevice>) {
        if given.is_empty() {
            return;
        }
        // Their strikes are counted from the first.
        self.mind_faults();
        let now = self.device.now();
        for given in given {
            let faulting = match given {
                ForDevice::Begin(number, fault) => Faulting::Begin(number, fault),
                ForDevice::End(number) => Faulting::End(number),
                ForDevice::Do(OwnedInput::Fault(faulting)) => {
                    self.fault(&faulting);
                    continue;
                }
                ForDevice::Do(input) => {
                    self.disturb(input.as_input(), now);
                    continue;
                }
            };
            self.device.accept(Input::Fault(&faulting), now);
        }
    }

    /// Something happens to the device that is not on the line.
    fn disturb(&mut self, input: Input<'_>, at: Time) {
        if input == Input::Power(false) {
            // What the transmitter had not sent is gone; what is on its way to the device arrives at a
            // device that is switched off.
            self.wires.from_device = Lane::default();
        }
        self.device.accept(input, at);
    }

    /// Begins or ends scenarios.
    fn rule(&mut self, ruling: &Ruling) {
        let mut news = Vec::new();
        let Wires { faults, scenarios, .. } = &mut self.wires;
        let done = match ruling {
            Ruling::Begin(number, scenario) => {
                let number = match *number {
                    ScenarioNumber::NEXT => ScenarioNumber(scenarios.0.saturating_add(1)),
                    number => number,
                };
                let rules = faults.as_deref().map(|faults| &faults.rules);
                let count = scenario.rules.len();
                if !rules.unwrap_or(&Rules::default()).has_room_for(number, count) {
                    return;
                }
                *scenarios = (*scenarios).max(number);
                let rules = &mut faults.get_or_insert_default().rules;
                rules.begin(number, scenario.clone(), &self.device, &mut news)
            }
            Ruling::End(number) => match faults {
                Some(faults) => faults.rules.end(Some(*number), &self.device, &mut news),
                None => Vec::new(),
            },
            Ruling::EndAll => match faults {
                Some(faults) => faults.rules.end(None, &self.device, &mut news),
                None => Vec::new(),
            },
        };
        self.leave(news);
        self.give(done.into_iter().map(ForDevice::Do).collect());
    }

    /// Begins or ends faults.
    fn fault(&mut self, faulting: &Faulting) {
        let mut news = Vec::new();
        let now = self.device.now();
        let given = match faulting {
            Faulting::Begin(number, fault) => {
                let number = match *number {
                    FaultNumber::NEXT => FaultNumber(self.wires.numbered.0.saturating_add(1)),
                    number => number,
                };
                let full = |faults: &Faults| !faults.has_room_for(number, now);
                if self.wires.faults.as_deref().is_some_and(full) {
                    return;
                }
                if number != FaultNumber::TERMINAL {
                    self.wires.numbered = self.wires.numbered.max(number);
                }
                let faults = self.wires.faults.get_or_insert_default();
                faults.begin(number, fault.clone(), &self.device, &mut news)
            }
            Faulting::End(number) => match &mut self.wires.faults {
                Some(faults) => faults.end(Some(*number), now, &mut news),
                None => Vec::new(),
            },
            Faulting::EndAll => match &mut self.wires.faults {
                Some(faults) => faults.end(None, now, &mut news),
                None => Vec::new(),
            },
        };
        self.leave(news);
        self.give(given);
    }

    /// Drops faults that are over, and lets waiting ones see their prerequisites.
    fn mind_faults(&mut self) {
        let needed = self.wires.faults.as_ref().map_or(Kinds::NONE, |faults| faults.kinds());
        self.device.watch(self.wanted.and(needed));
        if self.wires.faults.as_ref().is_some_and(|faults| faults.is_empty()) {
            self.wires.faults = None;
        }
    }

    /// A byte has crossed the line.
    fn crossed(&mut self, way: Way, byte: u8, at: Time) {
        let baud = self.pace();
        match (&mut self.wires.faults, way) {
            (Some(faults), _) => {
                let mut news = Vec::new();
                faults.pass(way, byte, at, baud, &mut news);
                self.leave(news);
            }
            (None, Way::ToHost) => {
                self.ready.push_back(Output::Bytes(at, Bytes::copy_from_slice(&[byte])));
            }
            (None, _) => self.device.accept(Input::Bytes(&[byte]), at),
        }
    }
}

impl<D: Device> Device for Line<D> {
    type State = LineState<D::State>;
    type Details = D::Details;

    fn perform(&mut self, at: Time) -> bool {
        let Some((first, next)) =
            self.next().filter(|(first, _)| *first <= at && *first != Time::NEVER)
        else {
            return false;
        };
        let baud = self.pace();
        match next {
            Next::Look => self.device.accept(Input::Wake, first),
            Next::HeldLeaves => {
                self.device.accept(Input::Wake, first);
                let faults = self.wires.faults.as_mut();
                let bytes = faults.map_or_else(Vec::new, |faults| faults.to_host.pop_together());
                self.ready.push_back(Output::Bytes(first, bytes.into()));
            }
            Next::Leaves => {
                self.device.accept(Input::Wake, first);
                if let Some(byte) = self.wires.from_device.pop(baud) {
                    self.crossed(Way::ToHost, byte, first);
                }
            }
            Next::WaveLeaves | Next::WaveArrives => {
                self.device.accept(Input::Wake, first);
                let way = if next == Next::WaveLeaves { Way::ToHost } else { Way::ToController };
                let (mut news, speed) = (Vec::new(), self.device.baud());
                if let Some(faults) = &mut self.wires.faults {
                    faults.read(way, first, speed, &mut news);
                }
                self.leave(news);
            }
            Next::Wakes => drop(self.device.perform(first)),
            Next::HeldArrives => {
                let faults = self.wires.faults.as_mut();
                if let Some(byte) = faults.and_then(|faults| faults.to_controller.pop()) {
                    self.device.accept(Input::Bytes(&[byte]), first);
                }
            }
            Next::Arrives => {
                if self.wires.faults.is_some() {
                    self.device.accept(Input::Wake, first);
                }
                if let Some(byte) = self.wires.to_device.pop(baud) {
                    let (paced, speed) = (self.wires.paced, self.device.baud());
                    let faults = self.wires.faults.as_mut().filter(|_| !paced);
                    let way = Way::ToController;
                    if !faults.is_some_and(|faults| faults.send(way, &[byte], first, speed)) {
                        self.crossed(way, byte, first);
                    }
                }
            }
        }
        self.collect();
        true
    }

    fn accept(&mut self, input: Input<'_>, at: Time) {
        match input {
            Input::Bytes(bytes) if self.has_lane() => {
                self.device.accept(Input::Wake, at);
                let (now, baud) = (self.device.now(), self.device.baud());
                let pace = self.pace();
                // Where characters take no time, each one passes when its turn has come.
                let paced = self.wires.paced;
                let faults = self.wires.faults.as_mut().filter(|_| paced);
                if !faults.is_some_and(|faults| faults.send(Way::ToController, bytes, now, baud)) {
                    self.wires.to_device.push(bytes, now, pace);
                }
            }
            Input::Fault(faulting) => {
                self.device.accept(Input::Wake, at);
                self.fault(faulting);
            }
            Input::Rule(ruling) => {
                self.device.accept(Input::Wake, at);
                self.rule(ruling);
            }
            input => {
                if let Some(faults) = &mut self.wires.faults {
                    faults.rules.yield_to(&input);
                }
                self.disturb(input, at);
            }
        }
        self.collect();
    }

    fn poll_output(&mut self) -> Option<Output> {
        self.ready.pop_front()
    }

    fn watch(&mut self, kinds: Kinds) -> Kinds {
        let before = std::mem::replace(&mut self.wanted, kinds);
        let needed = self.wires.faults.as_ref().map_or(Kinds::NONE, |faults| faults.kinds());
        self.device.watch(kinds.and(needed));
        before
    }

    fn state(&self) -> Self::State {
        LineState { device: self.device.state(), wires: self.wires.clone() }
    }

    fn restore(&mut self, state: Self::State) {
        self.ready.clear();
        self.wires = state.wires;
        self.device.restore(state.device);
        self.watch(self.wanted);
    }

    fn now(&self) -> Time {
        self.device.now()
    }

    fn wake(&self) -> Option<Time> {
        self.next().map(|(due, _)| due)
    }

    fn view(&self, at: Time) -> View<D::Details> {
        self.device.view(at)
    }

    fn activity(&self) -> Activity {
        self.device.activity()
    }

    fn details(&self) -> D::Details {
        self.device.details()
    }

    fn position(&self, at: Time) -> Point {
        self.device.position(at)
    }

    fn reach(&self) -> (Point, Point) {
        self.device.reach()
    }

    fn running(&self) -> Option<Running<'_>> {
        self.device.running()
    }

    fn signals(&self) -> Vec<Signal> {
        self.device.signals()
    }

    fn baud(&self) -> u32 {
        self.device.baud()
    }

    fn modem_line(&self) -> Option<(ModemLine, bool)> {
        self.device.modem_line()
    }

    /// A paced line takes no more than its lane holds, and nothing while the answers lag far
    /// behind: most are longer than their questions. The same holds for a line on which bytes are
    /// held back.
    fn room(&self, handshake: bool) -> usize {
        let room = self.device.room(handshake);
        let Wires { paced, from_device, faults, .. } = &self.wires;
        let (coming, mut leaving) = (self.coming(), from_device.len());
        if let Some(faults) = faults {
            leaving += faults.leaving();
        } else if !paced {
            return room;
        }
        LANE.saturating_sub(coming.max(leaving)).min(room.saturating_sub(coming))
    }

    fn flash_image(&self) -> Vec<u8> {
        self.device.flash_image()
    }

    fn explain(&self, command: &[u8]) -> String {
        self.device.explain(command)
    }

    fn is_urgent(&self, byte: u8) -> bool {
        self.device.is_urgent(byte)
    }

    fn why_without_effect(&self, signal: SignalId, value: i32) -> Option<&'static str> {
        self.device.why_without_effect(signal, value)
    }

    fn why_in_vain(&self, fault: &Fault) -> Option<&'static str> {
        self.device.why_in_vain(fault)
    }

    /// The faults of the line, and those of the device with their state there.
    fn faults(&self) -> Vec<FaultView> {
        let known = self.device.faults();
        let now = self.device.now();
        let line = self.wires.faults.iter().flat_map(|faults| faults.views(now));
        line.map(|view| {
            let known = known.iter().find(|known| known.number == view.number);
            FaultView { struck: known.map_or(view.struck, |known| known.struck), ..view }
        })
        .collect()
    }

    fn rules(&self) -> Vec<RuleView> {
        self.wires.faults.iter().flat_map(|faults| faults.rules.views()).collect()
    }

    fn is_idle(&self) -> bool {
        let Wires { to_device, from_device, faults, .. } = &self.wires;
        let held = faults.as_ref().map_or(0, |faults| faults.leaving() + faults.coming());
        self.device.is_idle() && to_device.len() + from_device.len() + held == 0
    }

    fn first_time(&self, fact: &Fact, from: Time) -> Option<Time> {
        self.device.first_time(fact, from)
    }

    fn comes_round(&self, from: Time) -> Option<Time> {
        self.device.comes_round(from)
    }
}
