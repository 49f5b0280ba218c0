//! The serial line, with the time its characters take.

use std::collections::VecDeque;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use crate::{
    Activity, Device, Fact, Input, Kinds, Output, Point, Running, Signal, SignalId, Time, View,
};

/// How many bytes may be on their way to a paced device. A client that writes faster than the
/// line is held back by its own operating system, as it is by a real port.
const LANE: usize = 4_096;

/// A character is a start bit, eight data bits and a stop bit.
const BITS: u64 = 10;

/// A device at the end of a serial line; together they are again a device.
///
/// On a paced line every character takes ten bit times at the device's [`baud`](Device::baud)
/// rate, in both directions and in model time: a byte reaches the device when its stop bit has
/// passed, and an answer leaves byte by byte. On an [ideal](Line::ideal) line nothing takes any
/// time. Neither knows a clock; pacing is as reproducible as the device itself.
#[derive(Clone, Debug)]
pub struct Line<D: Device> {
    device: D,
    wires: Wires,
    ready: VecDeque<Output>,
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
}

/// One direction of the line. Characters follow each other without gaps from `start` on; the
/// time of each is computed from there, so that rounding never adds up.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Lane {
    queue: VecDeque<u8>,
    start: Time,
    passed: u64,
    baud: u32,
}

impl Lane {
    fn push(&mut self, bytes: &[u8], at: Time, baud: u32) {
        if self.queue.is_empty() {
            (self.start, self.passed, self.baud) = (at, 0, baud);
        }
        self.queue.extend(bytes);
    }

    /// When the stop bit of the first character will have passed.
    fn due(&self) -> Option<Time> {
        (!self.queue.is_empty()).then(|| {
            let bits = u128::from((self.passed + 1) * BITS) * 1_000_000_000;
            let span = bits.div_ceil(u128::from(self.baud.max(1)));
            self.start.after_nanos(u64::try_from(span).unwrap_or(u64::MAX))
        })
    }

    /// Takes the first character, whose stop bit passes now; the next one has the speed of now.
    fn pop(&mut self, baud: u32) -> Option<u8> {
        let due = self.due()?;
        let byte = self.queue.pop_front()?;
        if self.queue.is_empty() {
            // An empty lane has one form only, so that equal lines compare equal.
            *self = Lane::default();
        } else if baud == self.baud {
            self.passed += 1;
        } else {
            (self.start, self.passed, self.baud) = (due, 0, baud);
        }
        Some(byte)
    }
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

    fn new(device: D, paced: bool) -> Line<D> {
        let wires = Wires { paced, to_device: Lane::default(), from_device: Lane::default() };
        Line { device, wires, ready: VecDeque::new() }
    }

    /// The device at the end of the line.
    pub fn device(&self) -> &D {
        &self.device
    }

    /// Takes what has come out of the device: its bytes still have to cross a paced line.
    fn collect(&mut self) {
        while let Some(output) = self.device.poll_output() {
            match output {
                Output::Bytes(at, bytes) if self.wires.paced => {
                    let baud = self.device.baud();
                    self.wires.from_device.push(&bytes, at, baud);
                }
                output => self.ready.push_back(output),
            }
        }
    }
}

impl<D: Device> Device for Line<D> {
    type State = LineState<D::State>;
    type Details = D::Details;

    /// At equal times a byte that leaves, then what the device does by itself, then a byte that
    /// arrives.
    fn perform(&mut self, at: Time) -> bool {
        let leaves = self.wires.from_device.due().unwrap_or(Time::NEVER);
        let wakes = self.device.wake().unwrap_or(Time::NEVER);
        let arrives = self.wires.to_device.due().unwrap_or(Time::NEVER);
        let first = leaves.min(wakes).min(arrives);
        if first > at || first == Time::NEVER {
            return false;
        }
        let baud = self.device.baud();
        if first == leaves {
            self.device.accept(Input::Wake, first);
            if let Some(byte) = self.wires.from_device.pop(baud) {
                self.ready.push_back(Output::Bytes(first, Bytes::copy_from_slice(&[byte])));
            }
        } else if first == wakes {
            self.device.perform(first);
        } else if let Some(byte) = self.wires.to_device.pop(baud) {
            self.device.accept(Input::Bytes(&[byte]), first);
        }
        self.collect();
        true
    }

    fn accept(&mut self, input: Input<'_>, at: Time) {
        match input {
            Input::Bytes(bytes) if self.wires.paced => {
                self.device.accept(Input::Wake, at);
                let (now, baud) = (self.device.now(), self.device.baud());
                self.wires.to_device.push(bytes, now, baud);
            }
            Input::Power(false) => {
                // What the transmitter had not sent is gone; what is on its way to the device
                // arrives at a device that is switched off.
                self.wires.from_device = Lane::default();
                self.device.accept(input, at);
            }
            input => self.device.accept(input, at),
        }
        self.collect();
    }

    fn poll_output(&mut self) -> Option<Output> {
        self.ready.pop_front()
    }

    fn watch(&mut self, kinds: Kinds) -> Kinds {
        self.device.watch(kinds)
    }

    fn state(&self) -> Self::State {
        LineState { device: self.device.state(), wires: self.wires.clone() }
    }

    fn restore(&mut self, state: Self::State) {
        self.ready.clear();
        self.wires = state.wires;
        self.device.restore(state.device);
    }

    fn now(&self) -> Time {
        self.device.now()
    }

    fn wake(&self) -> Option<Time> {
        [self.wires.from_device.due(), self.device.wake(), self.wires.to_device.due()]
            .into_iter()
            .flatten()
            .min()
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

    /// A paced line takes no more than its lane holds, and nothing while the answers are far
    /// behind: most are longer than what asked for them.
    fn room(&self, handshake: bool) -> usize {
        let room = self.device.room(handshake);
        if !self.wires.paced {
            return room;
        }
        let Wires { to_device, from_device, .. } = &self.wires;
        let (coming, leaving) = (to_device.queue.len(), from_device.queue.len());
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

    fn is_idle(&self) -> bool {
        self.device.is_idle()
            && self.wires.to_device.queue.is_empty()
            && self.wires.from_device.queue.is_empty()
    }

    fn first_time(&self, fact: &Fact, from: Time) -> Option<Time> {
        self.device.first_time(fact, from)
    }

    fn comes_round(&self, from: Time) -> Option<Time> {
        self.device.comes_round(from)
    }
}
