//! What a test or a person can set from outside.

use bytes::Bytes;
use vimc4_device::{Signal, SignalId, SignalView};
use vimc4_plant::{End, PlantSignal};

use crate::language::{Axis, Dialect, Status};
use crate::state::State;
use crate::why::{Stop, Why};

/// The first number that is not a signal of the plant.
const FIRST: u16 = 128;
/// The first number of a fault.
const FIRST_FAULT: u16 = 256;

/// A signal that only these controllers have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Own {
    /// A message interrupt, 0 or 1.
    Message(u8),
    /// Takes the measured positions.
    Trigger,
    /// Which axis the trackball moves.
    BallAxis,
    /// Turns the trackball by this many steps, in X or in Y.
    Ball(u8),
    /// The spindle unit fails: 1 or 2.
    SpindleFault,
    /// A status that nothing else in the emulated world causes.
    Fault(Status),
}

impl Own {
    const PLAIN: [Own; 7] = [
        Own::Message(0),
        Own::Message(1),
        Own::Trigger,
        Own::BallAxis,
        Own::Ball(0),
        Own::Ball(1),
        Own::SpindleFault,
    ];

    fn id(self) -> SignalId {
        SignalId(match self {
            Own::Fault(status) => FIRST_FAULT + u16::from(status.code()),
            plain => FIRST + Self::PLAIN.iter().position(|own| *own == plain).unwrap_or(0) as u16,
        })
    }

    fn from_id(id: SignalId) -> Option<Own> {
        match id.0.checked_sub(FIRST_FAULT) {
            Some(code) => u8::try_from(code).ok().and_then(Status::from_code).map(Own::Fault),
            None => Self::PLAIN.get(usize::from(id.0.checked_sub(FIRST)?)).copied(),
        }
    }

    fn describe(self, axes: usize) -> Signal {
        let id = self.id();
        match self {
            Own::Message(number) => {
                let about = format!("message interrupt {number}");
                Signal::button(id, format!("message {number}"), about)
            }
            Own::Trigger => Signal::button(id, "trigger", "takes the measured positions"),
            Own::BallAxis => {
                let about = "the axis that the trackball moves";
                Signal::analogue(id, "ball axis", (0, axes as i32 - 1), about)
            }
            Own::Ball(way_of) => {
                let letter = if way_of == 0 { 'x' } else { 'y' };
                let about = "turns the trackball by so many steps";
                Signal::analogue(id, format!("ball {letter}"), (-1_000_000, 1_000_000), about)
            }
            Own::SpindleFault => {
                let about = "the spindle unit does not reach its speed, and says 1 or 2";
                Signal::analogue(id, "spindle-fault", (0, 2), about)
            }
            Own::Fault(status) => {
                Signal::input(id, format!("fault {}", status.name()), status.meaning())
            }
        }
    }
}

/// The consequence of a signal.
pub(crate) enum Leads {
    /// To nothing more.
    Nowhere,
    /// It stops what is executing, along the ramp if it moves.
    Interruption(Stop, Why),
    /// It takes the motors' ability to move.
    Halt(Status),
    /// It is told.
    Report(Why),
    /// A limit switch is pressed or released by hand.
    Switch(Axis, End, bool),
    /// This is sent.
    Says(Bytes),
}

impl State {
    /// Everything that can be set.
    pub(crate) fn list_signals(&self) -> Vec<Signal> {
        let mut signals = vec![PlantSignal::Stop.describe("")];
        for axis in self.fitted() {
            let ends = [End::Negative, End::Positive];
            let limits = ends.map(|end| PlantSignal::Limit(axis.index(), end));
            let name = self.axis_name(axis).to_lowercase();
            signals.extend(limits.map(|limit| limit.describe(&name)));
        }
        for (number, port) in (0u8..).zip(&self.model.io.read) {
            for bit in 0..8 {
                let input = PlantSignal::Input(number * 8 + bit);
                signals.push(
                    input.describe(&format!("{port}.{bit}")).read_by([(u16::from(*port), bit)]),
                );
            }
        }
        let own = Own::PLAIN.into_iter().filter(|own| self.has(*own));
        signals.extend(own.map(|own| own.describe(self.model.axes)));
        let faults = Status::ALL.iter().map(|status| Own::Fault(*status));
        let faults = faults.filter(|own| self.has(*own));
        signals.extend(faults.map(|own| own.describe(self.model.axes)));
        signals
    }

    /// Everything that can be set, with its present value.
    pub(crate) fn signal_views(&self) -> Vec<SignalView> {
        let signals = self.list_signals().into_iter();
        let view = |signal: Signal| SignalView {
            value: self.signal_value(signal.id),
            id: signal.id,
            name: signal.name,
        };
        signals.map(view).collect()
    }

    /// What a signal is set to. A signal that acts the moment it is set has no value.
    pub(crate) fn signal_value(&self, id: SignalId) -> Option<i32> {
        if let Some(signal) = PlantSignal::from_id(id) {
            return Some(self.plant.level(signal).into());
        }
        match Own::from_id(id)? {
            Own::Message(_) | Own::Trigger | Own::Ball(_) => None,
            Own::BallAxis => Some(self.ball.axis.into()),
            Own::SpindleFault => Some(self.unit.fault.into()),
            Own::Fault(status) => Some(self.faults.contains(&status.code()).into()),
        }
    }

    fn has(&self, own: Own) -> bool {
        let of_motion_system = !self.is_smcu();
        match own {
            Own::Message(_) | Own::Trigger => of_motion_system,
            Own::BallAxis | Own::Ball(_) => self.model.interface.trackball,
            Own::SpindleFault => true,
            Own::Fault(status) => {
                status.known_to(self.model.command_set)
                    && !is_caused(status, self.model.command_set)
            }
        }
    }

    /// The value that a signal takes if it is set to this one; `None` if that has no effect.
    pub(crate) fn taken(&self, id: SignalId, value: i32) -> Option<i32> {
        let own = Own::from_id(id).filter(|own| self.has(*own));
        let value = match own {
            None => PlantSignal::from_id(id).map(|_| (value != 0).into())?,
            Some(Own::Fault(_)) => (value != 0).into(),
            Some(Own::BallAxis) => value.clamp(0, self.model.axes as i32 - 1),
            Some(Own::SpindleFault) => value.clamp(0, 2),
            // A signal that acts the moment it is set has no earlier value.
            Some(_) => return (value != 0).then_some(value),
        };
        (self.signal_value(id) != Some(value)).then_some(value)
    }

    /// A signal takes a value.
    pub(crate) fn signal(&mut self, id: SignalId, value: i32) -> Leads {
        if let Some(signal) = PlantSignal::from_id(id) {
            return self.plant_signal(signal, value != 0);
        }
        let Some(own) = Own::from_id(id).filter(|own| self.has(*own)) else {
            return Leads::Nowhere;
        };
        match own {
            Own::BallAxis => {
                let most = self.model.axes as i32 - 1;
                self.ball.axis = value.clamp(0, most) as u8;
            }
            Own::SpindleFault => self.unit.fault = value.clamp(0, 2) as u8,
            Own::Fault(status) => return self.fault(status, value != 0),
            _ if !self.powered || value == 0 => {}
            Own::Message(number) => {
                return Leads::Interruption(Stop::Message, Why::Message(number));
            }
            Own::Trigger => self.triggered = Some(self.actual_now()),
            Own::Ball(way) => {
                let value = i64::from(value);
                let (x, y) = if way == 0 { (value, 0) } else { (0, value) };
                return self.ball.turned(x, y).map_or(Leads::Nowhere, Leads::Says);
            }
        }
        Leads::Nowhere
    }

    fn plant_signal(&mut self, signal: PlantSignal, level: bool) -> Leads {
        if !self.plant.set(signal, level) || !self.powered {
            return Leads::Nowhere;
        }
        match signal {
            PlantSignal::Stop if level && self.settings.external_stop => {
                Leads::Interruption(Stop::External, Why::ExternalStop)
            }
            PlantSignal::Limit(axis, end) => match Axis::from_index(axis) {
                Some(axis) => Leads::Switch(axis, end, level),
                None => Leads::Nowhere,
            },
            _ => Leads::Nowhere,
        }
    }

    /// A fault comes or goes. What takes the motors' ability to move halts them.
    fn fault(&mut self, status: Status, active: bool) -> Leads {
        let changed = match active {
            true => self.faults.insert(status.code()),
            false => self.faults.remove(&status.code()),
        };
        match status {
            _ if !changed || !active || !self.powered => Leads::Nowhere,
            // It is reported when the interface is opened.
            Status::JoystickNotConnected if self.ball.open.is_none() => Leads::Nowhere,
            status if status.forbids_motion() => Leads::Halt(status),
            status => Leads::Report(Why::Fault(status)),
        }
    }

    /// Why setting a signal to a value has just changed nothing.
    pub(crate) fn why_ignored(&self, id: SignalId, value: i32) -> Option<&'static str> {
        match PlantSignal::from_id(id) {
            _ if value == 0 => None,
            _ if !self.powered => Some("the power is off"),
            Some(PlantSignal::Stop) if !self.settings.external_stop => {
                Some("the external stop is blocked; !ES1 lets it through")
            }
            // Those of its own signals that do nothing now are not switches.
            None => Some("nothing heeds it now"),
            Some(_) => None,
        }
    }
}

/// Whether something in the emulated world causes a status.
pub(crate) fn is_caused(status: Status, dialect: Dialect) -> bool {
    use Status as S;
    match status {
        // A MotionSystem says which axis it was.
        S::WorkAreaLeft | S::LimitSwitch => dialect == Dialect::Smcu,
        S::SingleCoordinate
        | S::MissingParameter
        | S::FastStop
        | S::SpeedTooHigh
        | S::SpeedTooLow
        | S::UnknownCommand
        | S::ReceiverOverflow
        | S::AccelerationTooHigh
        | S::AccelerationTooLow
        | S::ResolutionTooLarge
        | S::ResolutionTooSmall
        | S::NoSuchAxis
        | S::NoSuchInterface
        | S::NoSuchIoModule
        | S::MessageInterrupt0
        | S::MessageInterrupt1
        | S::NoCounterAxis
        | S::WrongAfterStop
        | S::WrongAfterLimit
        | S::WrongAfterSoftFrame
        | S::WrongAfterMessage
        | S::WrongAfterOpenInterface
        | S::TooManyVectorParameters
        | S::VectorBufferFull
        | S::ReferenceNotAllowed
        | S::CommandBufferFull => true,
        // Ranges and limit switches of the six axes.
        status => (25..=48).contains(&status.code()),
    }
}
