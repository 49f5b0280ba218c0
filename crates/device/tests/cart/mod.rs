// A small device: a cart on a rail. The tests and the examples of the documentation drive it.

use serde::{Deserialize, Serialize};
use vimc4_device::{
    Activity, AxisView, Device, Event, Fact, Fill, FlashChange, Input, Kinds, Outbox, Output,
    Signal, SignalId, SignalView, Time, View, WaitsFor, Warning,
};

/// So long a step takes.
const STEP: u64 = 1_000_000;

/// Understands lines that end in CR, and does one after the other:
///
/// | line | does |
/// |---|---|
/// | `m5` | makes five steps, one each millisecond, then answers `0` |
/// | `p` | answers where it is |
/// | `f...` | stores the text, answers `0` |
/// | `b` | shuttles between two steps until it is switched off |
///
/// The signal [`Cart::STOP`] ends a motion, which then answers `stopped`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Cart {
    state: State,
    out: Outbox,
}

/// Everything that decides what a cart will do.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct State {
    now: Time,
    received: Vec<u8>,
    /// The first letter of the line that was begun last.
    latest: String,
    stored: Vec<u8>,
    /// Where it stood when it stood last.
    place: i64,
    motion: Option<Motion>,
    off: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Motion {
    began: Time,
    steps: u64,
    shuttles: bool,
}

impl Cart {
    /// The button that ends a motion.
    pub(crate) const STOP: SignalId = SignalId(0);

    fn place(&self, at: Time) -> i64 {
        let made = self
            .state
            .motion
            .as_ref()
            .map_or(0, |motion| (at.nanos_since(motion.began) / STEP).min(motion.steps));
        self.state.place + made as i64
    }

    fn holds(&self, fact: &Fact, at: Time) -> bool {
        match fact {
            Fact::Axis { axis: 0, low, high } => (low..=high).contains(&&self.place(at)),
            _ => false,
        }
    }

    fn say(&mut self, text: &str, why: Option<&str>) {
        if self.out.wants(Kinds::ANSWER) {
            let (bytes, why) = (text.to_owned().into(), why.map(Into::into));
            let mnemonic = self.state.latest.clone().into();
            self.out.emit(self.state.now.into(), Event::Answer { mnemonic, bytes, why });
        }
        self.out.send(self.state.now, text.to_owned().into());
    }

    fn warn(&mut self, what: &'static str) {
        if self.out.wants(Kinds::WARNING) {
            let warning = Warning::NoEffect { what: what.into() };
            self.out.emit(self.state.now.into(), Event::Warning(warning));
        }
    }

    /// Ends the motion where it is.
    fn halt(&mut self) -> bool {
        self.state.place = self.place(self.state.now);
        self.state.motion.take().is_some()
    }

    fn begin(&mut self, steps: u64, shuttles: bool) {
        self.state.motion = Some(Motion { began: self.state.now, steps, shuttles });
    }

    /// When its motion ends.
    fn ends(&self) -> Option<Time> {
        let motion = self.state.motion.as_ref()?;
        let steps = if motion.shuttles { 1 } else { motion.steps };
        Some(motion.began.after_nanos(steps.saturating_mul(STEP)))
    }

    /// The end of the first line that has arrived and can be done now.
    fn ready(&self) -> Option<usize> {
        let stands = self.state.motion.is_none();
        self.state.received.iter().position(|byte| *byte == b'\r').filter(|_| stands)
    }

    fn do_line(&mut self, end: usize) {
        let line: Vec<u8> = self.state.received.drain(..=end).collect();
        let text = String::from_utf8_lossy(&line[..end]).into_owned();
        self.state.latest = text.get(..1).unwrap_or_default().to_owned();
        if self.out.wants(Kinds::COMMAND) {
            let (mnemonic, bytes) = (self.state.latest.clone().into(), text.clone().into());
            self.out.emit(self.state.now.into(), Event::Command { mnemonic, bytes });
        }
        match (text.get(..1), text.get(1..).and_then(|number| number.parse().ok())) {
            (Some("m"), Some(steps)) => self.begin(steps, false),
            (Some("b"), _) => self.begin(0, true),
            (Some("p"), _) => self.say(&self.state.place.to_string(), None),
            (Some("f"), _) => {
                self.state.stored.extend_from_slice(&line[1..end]);
                let change = FlashChange::Append(line[1..end].to_vec().into());
                self.out.store(self.state.now, change);
                self.say("0", None);
            }
            _ => self.warn("a line that means nothing"),
        }
    }
}

impl Device for Cart {
    type State = State;
    type Details = ();

    fn perform(&mut self, at: Time) -> bool {
        if let Some(end) = self.ready() {
            self.do_line(end);
            return true;
        }
        let Some(due) = self.ends().filter(|due| *due <= at) else { return false };
        self.state.now = due;
        let shuttles = self.state.motion.as_ref().is_some_and(|motion| motion.shuttles);
        self.halt();
        if shuttles {
            self.state.place = 1 - self.state.place;
            self.begin(0, true);
        } else {
            self.say("0", None);
        }
        true
    }

    fn accept(&mut self, input: Input<'_>, at: Time) {
        self.state.now = self.state.now.max(at);
        match input {
            Input::Bytes(bytes) if !self.state.off => self.state.received.extend_from_slice(bytes),
            Input::Signal(Cart::STOP, value @ 1..) => {
                if self.out.wants(Kinds::SIGNAL) {
                    let event = Event::Signal { signal: Cart::STOP, value };
                    self.out.emit(self.state.now.into(), event);
                }
                if self.halt() {
                    self.say("stopped", Some("the button was pressed"));
                }
            }
            Input::Power(on) => {
                self.halt();
                self.state.off = !on;
                self.state.received.clear();
            }
            Input::Bytes(_)
            | Input::Signal(..)
            | Input::Fault(_)
            | Input::Rule(_)
            | Input::Wake => {}
        }
    }

    fn poll_output(&mut self) -> Option<Output> {
        self.out.poll()
    }

    fn watch(&mut self, kinds: Kinds) -> Kinds {
        self.out.watch(kinds)
    }

    fn state(&self) -> State {
        self.state.clone()
    }

    fn restore(&mut self, state: State) {
        self.state = state;
        self.out.clear();
    }

    fn now(&self) -> Time {
        self.state.now
    }

    fn wake(&self) -> Option<Time> {
        if self.ready().is_some() { Some(self.state.now) } else { self.ends() }
    }

    fn view(&self, at: Time) -> View<()> {
        let axis = AxisView {
            index: 0,
            name: "X".to_owned(),
            configured: true,
            position: self.place(at),
            carriage: self.place(at),
            referenced: true,
            zero: 0,
            speed: 0,
            limits: [false; 2],
        };
        View {
            at,
            model: "cart".to_owned(),
            powered: !self.state.off,
            machine: "rails".to_owned(),
            activity: self.activity(),
            waits_for: self.is_idle().then_some(WaitsFor::Command),
            baud: self.baud(),
            received: Fill { used: self.state.received.len(), size: usize::MAX },
            axes: vec![axis],
            signals: vec![SignalView { id: Cart::STOP, name: "stop".to_owned(), value: None }],
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
        vec![Signal::button(Cart::STOP, "stop", "ends a motion")]
    }

    fn baud(&self) -> u32 {
        9_600
    }

    fn flash_image(&self) -> Vec<u8> {
        self.state.stored.clone()
    }

    fn explain(&self, command: &[u8]) -> String {
        String::from_utf8_lossy(command).into_owned()
    }

    fn is_idle(&self) -> bool {
        self.wake().is_none()
    }

    /// A cart is slow enough to be followed step by step.
    fn first_time(&self, fact: &Fact, from: Time) -> Option<Time> {
        let motion = self.state.motion.as_ref();
        let steps = motion
            .into_iter()
            .flat_map(|motion| (1..motion.steps).map(|step| motion.began.after_nanos(step * STEP)));
        let mut instants = std::iter::once(from).chain(steps.filter(|at| *at > from));
        instants.find(|at| self.holds(fact, *at))
    }
}
