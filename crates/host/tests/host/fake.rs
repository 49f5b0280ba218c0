//! A small device: it echoes, waits, ticks, stores and counts.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use vimc4_device::{
    Activity, AxisView, Condition, Device, Event, Fact, Fill, FlashChange, Input, Kinds, Names,
    Output, Signal, SignalId, Time, View, Warning,
};
use vimc4_host::{
    Clock, EventFilter, Handle, Memory, MemoryPort, Report, RunError, Runner, Sink, Transport,
};
use vimc4_language::read_condition;

const MS: u64 = 1_000_000;

/// Understands lines that end in CR and answers each when it is done:
///
/// | line | does |
/// |---|---|
/// | `eTEXT` | answers TEXT |
/// | `w50` | moves its axis one step a millisecond for 50 ms, answers `0` |
/// | `s9` | answers nine times `x` |
/// | `l` | ticks every millisecond for ever, answers `0` at once |
/// | `fTEXT` | stores TEXT, answers `0` |
/// | `b9600` | changes the line's speed, answers `0` |
/// | `t` | answers its time in nanoseconds, and a dot |
#[derive(Clone, Debug)]
pub(crate) struct Fake {
    state: State,
    out: VecDeque<Output>,
    kinds: Kinds,
    signals: Vec<Signal>,
    handshake: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct State {
    now: Time,
    line: Vec<u8>,
    waiting: VecDeque<u8>,
    move_began: Option<(Time, u64)>,
    position: i64,
    tick: Option<Time>,
    pub(crate) ticks: u64,
    baud: u32,
    flash: Vec<u8>,
    pub(crate) signals: [i32; 4],
    powered: bool,
}

impl Fake {
    pub(crate) fn new(flash: &[u8]) -> Fake {
        Fake {
            state: State {
                now: Time::ZERO,
                line: Vec::new(),
                waiting: VecDeque::new(),
                move_began: None,
                position: 0,
                tick: None,
                ticks: 0,
                baud: 19_200,
                flash: flash.to_vec(),
                signals: [0; 4],
                powered: true,
            },
            out: VecDeque::new(),
            kinds: Kinds::NONE,
            signals: vec![
                Signal::button(SignalId(0), "start", ""),
                Signal::button(SignalId(1), "estop", "").latching(),
                Signal::switch(SignalId(2), "key", ["test", "auto"], ""),
                Signal::input(SignalId(3), "input 0.3", "").read_by([(0, 3)]).wired_to("in1"),
            ],
            handshake: false,
        }
    }

    /// One that asks who sends to wait while it moves.
    pub(crate) fn with_handshake() -> Fake {
        Fake { handshake: true, ..Fake::new(b"") }
    }

    fn move_ends(&self) -> Option<Time> {
        self.state.move_began.map(|(began, steps)| began.after_nanos(steps * MS))
    }

    fn work(&mut self) {
        while self.state.move_began.is_none() {
            let Some(byte) = self.state.waiting.pop_front() else { return };
            if byte != b'\r' {
                self.state.line.push(byte);
                continue;
            }
            let line = std::mem::take(&mut self.state.line);
            self.event(
                Kinds::COMMAND,
                Event::Command { mnemonic: "fake".into(), bytes: Bytes::from(line.clone()) },
            );
            let (verb, text) = line.split_first().map_or((b' ', &[] as &[u8]), |(v, t)| (*v, t));
            let number = || std::str::from_utf8(text).unwrap().parse::<u64>().unwrap();
            match verb {
                b'e' => self.answer(text),
                b'w' => self.state.move_began = Some((self.state.now, number())),
                b's' => self.answer(&vec![b'x'; usize::try_from(number()).unwrap()]),
                b'l' => {
                    self.state.tick = Some(self.state.now.after_nanos(MS));
                    self.answer(b"0");
                }
                b'f' => {
                    self.state.flash.extend_from_slice(text);
                    let change = FlashChange::Append(Bytes::copy_from_slice(text));
                    self.out.push_back(Output::Flash(self.state.now, change));
                    self.answer(b"0");
                }
                b'b' => {
                    self.answer(b"0");
                    self.state.baud = u32::try_from(number()).unwrap();
                }
                b't' => {
                    let text = format!("{}.", self.state.now.as_nanos());
                    self.answer(text.as_bytes());
                }
                _ => self.answer(b"?"),
            }
        }
    }

    fn answer(&mut self, bytes: &[u8]) {
        self.out.push_back(Output::Bytes(self.state.now, Bytes::copy_from_slice(bytes)));
    }

    fn event(&mut self, kinds: Kinds, event: Event) {
        if self.kinds.contain(kinds) {
            self.out.push_back(Output::Event(self.state.now.into(), event));
        }
    }

    fn position_at(&self, at: Time) -> i64 {
        let moved = self.state.move_began.map_or(0, |(began, steps)| {
            i64::try_from((at.nanos_since(began) / MS).min(steps)).unwrap()
        });
        self.state.position + moved
    }
}

impl Device for Fake {
    type State = State;
    type Details = ();

    fn perform(&mut self, at: Time) -> bool {
        let Some(due) = self.wake().filter(|due| *due <= at) else { return false };
        self.state.now = due;
        if self.state.tick == Some(due) {
            self.state.ticks += 1;
            self.state.tick = Some(due.after_nanos(MS));
        }
        if self.move_ends() == Some(due) {
            let (_, steps) = self.state.move_began.take().unwrap();
            self.state.position += i64::try_from(steps).unwrap();
            self.answer(b"0");
        }
        self.work();
        true
    }

    fn accept(&mut self, input: Input<'_>, at: Time) {
        self.state.now = self.state.now.max(at);
        match input {
            Input::Bytes(bytes) if self.state.powered => {
                self.state.waiting.extend(bytes);
                self.work();
            }
            Input::Bytes(_) | Input::Fault(_) | Input::Rule(_) | Input::Wake => {}
            Input::Signal(id, value) => self.state.signals[usize::from(id.0)] += value,
            Input::Power(on) => self.state.powered = on,
        }
    }

    fn poll_output(&mut self) -> Option<Output> {
        self.out.pop_front()
    }

    fn watch(&mut self, kinds: Kinds) -> Kinds {
        std::mem::replace(&mut self.kinds, kinds)
    }

    fn state(&self) -> State {
        self.state.clone()
    }

    fn restore(&mut self, state: State) {
        self.state = state;
    }

    fn now(&self) -> Time {
        self.state.now
    }

    fn wake(&self) -> Option<Time> {
        self.move_ends().into_iter().chain(self.state.tick).min()
    }

    fn view(&self, at: Time) -> View<()> {
        View {
            at,
            model: "fake".to_owned(),
            powered: self.state.powered,
            machine: String::new(),
            activity: self.activity(),
            waits_for: None,
            baud: self.state.baud,
            received: Fill { used: 0, size: 0 },
            axes: vec![AxisView {
                index: 0,
                name: "X".to_owned(),
                configured: true,
                position: self.position_at(at),
                carriage: 0,
                referenced: false,
                zero: 0,
                speed: 0,
                limits: [false; 2],
            }],
            signals: Vec::new(),
            timers: Vec::new(),
            ports: Vec::new(),
            details: (),
        }
    }

    fn activity(&self) -> Activity {
        if self.is_idle() { Activity::Idle } else { Activity::Move }
    }

    fn details(&self) {}

    fn signals(&self) -> Vec<Signal> {
        self.signals.clone()
    }

    fn baud(&self) -> u32 {
        self.state.baud
    }

    fn room(&self, handshake: bool) -> usize {
        let waits = self.handshake && handshake && self.state.move_began.is_some();
        if waits { 0 } else { usize::MAX }
    }

    fn flash_image(&self) -> Vec<u8> {
        self.state.flash.clone()
    }

    fn explain(&self, command: &[u8]) -> String {
        format!("{} bytes", command.len())
    }

    fn is_urgent(&self, byte: u8) -> bool {
        byte == 0xFD
    }

    fn why_without_effect(&self, signal: SignalId, value: i32) -> Option<&'static str> {
        (signal == SignalId(3) && value == 0).then_some("the fake knows why")
    }

    fn is_idle(&self) -> bool {
        self.wake().is_none()
    }

    fn first_time(&self, fact: &Fact, from: Time) -> Option<Time> {
        let Fact::Axis { axis: 0, low, high } = fact else { return None };
        if (low..=high).contains(&&self.position_at(from)) {
            return Some(from);
        }
        // It moves forward only.
        let (began, _) = self.state.move_began?;
        let steps = u64::try_from(low.checked_sub(self.state.position)?).ok()?;
        Some(began.after_nanos(steps * MS)).filter(|at| *at > from)
    }
}

/// A runner in a thread of its own, as a program has it.
pub(crate) struct Running<D: Device> {
    pub(crate) handle: Handle<D>,
    thread: Option<JoinHandle<Result<(), RunError>>>,
}

impl<D: Device + Clone + Send + 'static> Running<D> {
    /// Runs a device; the transports are made within the runtime.
    pub(crate) fn start<T: Send + 'static>(
        device: D,
        clock: Clock,
        set_up: impl FnOnce(Runner<D>) -> (Runner<D>, T) + Send + 'static,
    ) -> (Running<D>, T) {
        let (sender, receiver) = std::sync::mpsc::channel();
        // Named like the test, so that the test can find it among the others.
        let name = thread::current().name().unwrap_or_default().to_owned();
        let thread = thread::Builder::new().name(name).spawn(move || {
            let runtime =
                tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
            runtime.block_on(async {
                let (runner, handle) = Handle::pair(device, clock);
                let (runner, extra) = set_up(runner);
                sender.send((handle, extra)).unwrap();
                runner.run().await
            })
        });
        let thread = thread.unwrap();
        let (handle, extra) = receiver.recv().unwrap();
        (Running { handle, thread: Some(thread) }, extra)
    }

    /// With a line in memory.
    pub(crate) fn in_memory(device: D, clock: Clock) -> (Running<D>, MemoryPort) {
        Running::start(device, clock, |mut runner| {
            let (memory, port) = Memory::pair();
            runner.attach(Box::new(memory));
            (runner, port)
        })
    }

    /// With a transport that is made within the runtime.
    pub(crate) fn with<T: Transport + 'static, E: Send + 'static>(
        device: D,
        clock: Clock,
        make: impl FnOnce() -> (T, E) + Send + 'static,
    ) -> (Running<D>, E) {
        Running::start(device, clock, |mut runner| {
            let (transport, extra) = make();
            runner.attach(Box::new(transport));
            (runner, extra)
        })
    }

    pub(crate) fn end(mut self) -> Result<(), RunError> {
        self.handle.stop();
        self.thread.take().unwrap().join().unwrap()
    }
}

/// Keeps every report.
#[derive(Clone, Default)]
pub(crate) struct Diary(pub(crate) Arc<Mutex<Vec<Report>>>);

impl Sink for Diary {
    fn wants(&self) -> EventFilter {
        EventFilter::ALL
    }

    fn report(&mut self, report: &Report, _explain: &dyn Fn(&[u8]) -> String) {
        self.0.lock().unwrap().push(report.clone());
    }
}

impl Diary {
    /// How many bytes left while nobody had the line open.
    pub(crate) fn unheard(&self) -> u64 {
        let reports = self.0.lock().unwrap();
        reports
            .iter()
            .map(|report| match report.event() {
                Some(Event::Warning(Warning::NobodyListens { lost })) => *lost,
                _ => 0,
            })
            .sum()
    }

    /// What is wanted of the reports, in their order.
    pub(crate) fn all<T>(&self, wanted: impl FnMut(&Report) -> Option<T>) -> Vec<T> {
        self.0.lock().unwrap().iter().filter_map(wanted).collect()
    }

    /// Waits until a report is there.
    pub(crate) fn wait_for(&self, what: &str, fits: impl Fn(&Report) -> bool) {
        self.wait_for_all(what, |reports| reports.iter().any(&fits));
    }

    /// Waits until the reports are like this.
    pub(crate) fn wait_for_all(&self, what: &str, fit: impl Fn(&[Report]) -> bool) {
        for _ in 0..500 {
            if fit(&self.0.lock().unwrap()) {
                return;
            }
            thread::sleep(std::time::Duration::from_millis(10));
        }
        panic!("{what} was not reported: {:?}", self.0.lock().unwrap());
    }
}

/// A condition in which axes and signals are numbers.
pub(crate) fn numbered(text: &str) -> Condition {
    read_condition(text, Names::numbered()).unwrap()
}
