//! A picture of the controller.

use serde::{Deserialize, Serialize};
use vimc4_device::{
    Activity as Doing, AxisView, Cause, Fill, PortView, Signal, SignalView, Time, TimerView, View,
    WaitsFor,
};
use vimc4_isel_wire::{Bit, BitTest, Command, Plane, PortMap as _};
use vimc4_plant::{End, PlantSignal};

use crate::axes::{AXES, AXIS_NAMES, wrap};
use crate::firmware::Firmware;
use crate::model::Model;
use crate::program::Validity;
use crate::switches::ENDS;
use crate::why::{Off, Why};

/// What only isel's controllers have.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Details {
    /// Start-stop frequency, Hz.
    pub start_stop: u32,
    /// Acceleration, Hz/ms.
    pub acceleration: u32,
    /// How moves of three axes are interpolated.
    pub interpolation: Interpolation,
    /// The plane of circles.
    pub plane: Plane,
    /// Whether test mode is on (`T`).
    pub test_mode: bool,
    /// Whether the motors have current.
    pub motors_on: bool,
    /// Why no motion can begin now on any axis.
    pub no_motion: Option<NoMotion>,
    /// The axes, 0 for X, whose limit switch error still holds.
    pub limit_errors: Vec<u8>,
    /// Whether the tool length probe is touched.
    pub probe: bool,
    /// Whether a stopped motion has a remainder that can be continued.
    pub stopped_motion: bool,
    /// The stored program, if there is one.
    pub program: Option<ProgramView>,
}

/// How the axes of a move are interpolated (`z`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Interpolation {
    /// Two axes together, then the others.
    #[serde(rename = "2.5d")]
    TwoAndAHalf,
    /// Three axes together.
    #[serde(rename = "3d")]
    Three,
}

/// Why no motion can begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum NoMotion {
    /// The mains switch is off.
    Power,
    /// The emergency stop is pressed.
    EmergencyStop,
    /// The motors have no supply voltage.
    Supply,
    /// The power stages are too hot.
    Overtemperature,
    /// The power stages are off until ON is pressed.
    StagesOff,
    /// The cover is open with the key on automatic.
    Cover,
}

/// The stored program.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProgramView {
    /// Its validity, or what it is doing.
    pub status: ProgramStatus,
    /// Its lines as they were stored; bytes that are no ASCII are written as `\xFF`.
    pub lines: Vec<String>,
    /// The line that is being executed, from 0.
    pub marker: Option<u32>,
    /// The open loops, outermost first.
    pub loops: Vec<LoopView>,
}

/// The validity of a stored program, or what it is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProgramStatus {
    /// It has its end and can run.
    Valid,
    /// It is being stored, or storing was cut off.
    Incomplete,
    /// An error was made while it was stored.
    Invalid,
    /// It runs.
    Running,
    /// It was stopped and can go on.
    Paused,
}

/// One open loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LoopView {
    /// The line of the loop command, from 0.
    pub line: u32,
    /// How many more times the block will run after the run that it is in now. While the block of
    /// `35,-1` runs for the second time it is 4 where the block is repeated five times
    /// ([`LoopCount::Extra`](crate::LoopCount::Extra)), and 3 where it runs five times in all
    /// ([`LoopCount::Total`](crate::LoopCount::Total)).
    pub left: u32,
}

impl Firmware {
    pub(crate) fn picture(&self, at: Time) -> View<Details> {
        let state = &self.state;
        let at = at.max(state.now);
        let running = self.state.running();
        let axes = (0..AXES).map(|axis| {
            let offset = running.map_or(0, |running| running.offset(axis, at));
            let slide = state.slide_at(axis, at);
            AxisView {
                index: axis as u8,
                name: AXIS_NAMES[axis].to_owned(),
                configured: state.axes.has(axis),
                position: wrap(state.position[axis] + offset),
                carriage: slide.place(),
                referenced: state.referenced.has(axis),
                zero: state.zero[axis],
                speed: running.map_or(0, |running| running.speed(axis, at)),
                limits: ENDS.map(|end| self.limit_active_at(axis, end, &slide)),
            }
        });
        let ports = state.model.ports.read.keys().map(|&port| (port, true));
        let ports = ports.chain(state.model.ports.write.keys().map(|&port| (port, false)));
        let causes = [
            (state.deadline(), Cause::Activity),
            (state.contact_due(), Cause::Contact),
            (state.switch_due(), Cause::LimitSwitch),
        ];
        let timers =
            causes.into_iter().filter_map(|(due, cause)| Some(TimerView { cause, due: due? }));
        let mut timers: Vec<TimerView> = timers.collect();
        timers.sort_by_key(|timer| timer.due);
        View {
            at,
            model: state.model.name.clone(),
            machine: state.plant.machine().name.clone(),
            powered: state.powered,
            activity: self.state.shown_activity(),
            waits_for: self.awaited(),
            baud: state.baud,
            received: Fill {
                used: state.receiver.waiting.len(),
                size: state.model.line.receive_buffer,
            },
            axes: axes.collect(),
            signals: signals_of(&state.model)
                .into_iter()
                .map(|signal| self.signal_view(signal))
                .collect(),
            ports: ports
                .map(|(port, input)| PortView {
                    port,
                    input,
                    value: if input { self.read_port(port) } else { self.driven_value(port) },
                })
                .collect(),
            timers,
            details: self.own_details(),
        }
    }

    fn signal_view(&self, signal: Signal) -> SignalView {
        let level = PlantSignal::from_id(signal.id).map(|known| self.state.plant.level(known));
        SignalView { id: signal.id, name: signal.name, value: level.map(i32::from) }
    }

    pub(crate) fn own_details(&self) -> Details {
        let state = &self.state;
        Details {
            start_stop: state.ramp.start_stop,
            acceleration: state.ramp.acceleration,
            interpolation: match state.three_d {
                true => Interpolation::Three,
                false => Interpolation::TwoAndAHalf,
            },
            plane: state.plane,
            test_mode: state.test_mode,
            motors_on: state.motors_on(),
            no_motion: self.no_motion(),
            limit_errors: state.latched.iter().map(|axis| axis as u8).collect(),
            probe: state.plant.panel().probe,
            stopped_motion: state.remainder.is_some(),
            program: self.program_view(),
        }
    }

    fn no_motion(&self) -> Option<NoMotion> {
        match self.check_plant() {
            Ok(()) => None,
            _ if !self.state.powered => Some(NoMotion::Power),
            Err(Why::Stages(off)) => Some(match off {
                Off::EmergencyStop => NoMotion::EmergencyStop,
                Off::Supply => NoMotion::Supply,
                Off::Heat => NoMotion::Overtemperature,
                Off::Relay | Off::Switched => NoMotion::StagesOff,
            }),
            Err(_) => Some(NoMotion::Cover),
        }
    }

    /// What the controller waits for, unless something is due.
    fn awaited(&self) -> Option<WaitsFor> {
        if self.state.deadline().is_some() {
            return None;
        }
        Some(match self.state.shown_activity() {
            Doing::Off => WaitsFor::Power,
            Doing::LimitError => WaitsFor::LimitErrorCleared,
            Doing::NeedsReference => WaitsFor::Reference,
            Doing::CannotMove => WaitsFor::MotionAllowed,
            Doing::Idle if self.state.remainder.is_some() => WaitsFor::StoppedMotion,
            Doing::Idle => WaitsFor::Command,
            Doing::Storing => WaitsFor::ProgramLine,
            Doing::ProgramStopped => WaitsFor::Start,
            Doing::ProgramWaitsForPort | Doing::ProgramWaitsForCharacter => {
                match self.line_of_program() {
                    Some(Command::BranchIf { test: BitTest { port, bit, value }, .. }) => {
                        // It branches to itself as long as it is met.
                        let (port, from) = (*port, *value);
                        match bit {
                            Bit::One(bit) if !self.state.model.ports.is_logical(port) => {
                                WaitsFor::Port { port, bit: Some(*bit), from: from & 1 }
                            }
                            _ => WaitsFor::Port { port, bit: None, from },
                        }
                    }
                    Some(Command::AwaitSync { character, .. }) => {
                        WaitsFor::Character { code: *character }
                    }
                    _ => WaitsFor::Ending,
                }
            }
            _ => WaitsFor::Ending,
        })
    }

    /// The line of the program that is being executed.
    fn line_of_program(&self) -> Option<&Command> {
        self.state.flash.program.as_ref()?.command(self.state.run.as_ref()?.line)
    }

    fn program_view(&self) -> Option<ProgramView> {
        let program = self.state.flash.program.as_ref()?;
        let run = self.state.run.as_ref();
        let status = match (run, program.validity) {
            (Some(run), _) if run.paused => ProgramStatus::Paused,
            (Some(_), _) => ProgramStatus::Running,
            (None, Validity::Valid) => ProgramStatus::Valid,
            (None, Validity::Invalid) => ProgramStatus::Invalid,
            (None, Validity::Incomplete) => ProgramStatus::Incomplete,
        };
        Some(ProgramView {
            status,
            lines: program.lines.iter().map(|line| line.text.escape_ascii().to_string()).collect(),
            marker: run.map(|run| run.line),
            loops: run.map_or_else(Vec::new, |run| {
                run.loops.iter().map(|l| LoopView { line: l.line, left: l.left }).collect()
            }),
        })
    }
}

/// The plant's signals as a model shows them, with the port bits that show each of them alone; its
/// user inputs are called by the first of these.
pub(crate) fn signals_of(model: &Model) -> Vec<Signal> {
    let bits: Vec<_> = model
        .ports
        .inputs()
        .flat_map(|port| {
            let wires = model.ports.readable(port).unwrap_or_default();
            (0..).zip(wires).map(move |(bit, wire)| (wire.signal(), (port, bit)))
        })
        .collect();
    let described = |signal: PlantSignal, place: &str| {
        let of_it = bits.iter().filter(|(shown, _)| *shown == Some(signal));
        signal.describe(place).read_by(of_it.map(|(_, bit)| *bit))
    };
    let mut signals: Vec<Signal> =
        PlantSignal::PANEL.into_iter().map(|signal| described(signal, "")).collect();
    for (axis, name) in AXIS_NAMES.iter().enumerate() {
        let ends = [End::Negative, End::Positive].map(|end| PlantSignal::Limit(axis, end));
        signals.extend(ends.map(|limit| described(limit, &name.to_lowercase())));
    }
    for number in 0..16 {
        let input = PlantSignal::Input(number);
        if let Some((_, (port, bit))) = bits.iter().find(|(shown, _)| *shown == Some(input)) {
            signals.push(described(input, &format!("{port}.{bit}")));
        }
    }
    signals
}
