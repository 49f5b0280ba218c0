//! A picture of the controller.

use serde::{Deserialize, Serialize};
use vimc4_device::{
    Activity as Doing, AxisView, Cause, Fill, PortView, Time, TimerView, View, WaitsFor,
};
use vimc4_plant::Unit;

use crate::language::{Command, Mode, Trackball};
use crate::mishaps::ENDS;
use crate::state::{Activity, Pause, Stage, State, Task};
use crate::why::Stop;

/// What only LPKF's controllers have.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Details {
    /// Where the head is.
    pub head: Head,
    /// Whether commands that are done are answered `C`.
    pub echo: bool,
    /// Whether the spindle is switched on.
    pub spindle: bool,
    /// Whether the motors have half their current.
    pub half_current: bool,
    /// Why nothing is executed until a command resumes execution, if something holds it.
    pub stopped: Option<StoppedBy>,
    /// The code of the status of a fault because of which nothing can move, if there is one.
    pub fault: Option<u8>,
    /// Commands that wait in the command buffer; [`View::received`] says how many bytes they have.
    pub commands_waiting: usize,
    /// Whether the command buffer is full and commands are being lost.
    pub overrun: bool,
    /// Whether the second channel is open, so that what arrives goes to the spindle unit.
    pub channel_open: bool,
    /// What the trackball is open for.
    pub trackball: Option<Trackball>,
    /// Whether the external stop works.
    pub external_stop: bool,
    /// The speed of X and Y with the head down, µm/s.
    pub speed_down: u32,
    /// Their speed with the head up, µm/s.
    pub speed_up: u32,
    /// Which of the times for drilling and for milling hold.
    pub mode: Mode,
    /// How long everything waits before and after the head goes down, before and after it goes up,
    /// ms.
    pub head_times: [u32; 4],
    /// How long everything rests after a move, ms.
    pub settling: u32,
    /// The settings of each existing axis.
    pub axes: Vec<AxisSettings>,
}

/// Where the head is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Head {
    /// Off the board.
    Up,
    /// In the board.
    Down,
}

/// What has stopped a controller, so that nothing is executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StoppedBy {
    /// `!ST`.
    Command,
    /// The external stop.
    ExternalStop,
    /// A limit switch, or something at the power stages.
    Limit,
    /// The border of the window or of a range.
    Border,
    /// A message interrupt.
    Message,
}

/// The settings of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AxisSettings {
    /// Its place in every [`Point`](vimc4_device::Point), 0 for X.
    pub index: u8,
    /// Whether it is linear or rotary, which decides the units of the other fields.
    pub unit: Unit,
    /// The way of a step: pm, or millionths of a second of arc.
    pub resolution: u64,
    /// Its speed by itself: µm/s, or tenths of a degree a second.
    pub speed: u32,
    /// Its acceleration: mm/s², or mrad/s².
    pub acceleration: u32,
    /// The lowest place that it may go to, steps, if the host has set one.
    pub lowest: Option<i64>,
    /// The highest place that it may go to, steps, if the host has set one.
    pub highest: Option<i64>,
}

impl State {
    pub(crate) fn picture(&self, at: Time) -> View<Details> {
        let state = self;
        let at = at.max(state.now);
        let running = self.running();
        let axes = state.fitted().map(|axis| {
            let index = axis.index();
            let offset = running.map_or(0, |running| running.offset(index, at));
            let slide = state.slide_at(index, at);
            AxisView {
                index: index as u8,
                name: self.axis_name(axis).to_owned(),
                configured: true,
                position: state.position[index] + offset,
                carriage: slide.place(),
                referenced: state.referenced[index],
                zero: 0,
                speed: running.map_or(0, |running| running.speed(index, at)),
                limits: ENDS.map(|end| state.plant.pressed(index, end, &slide)),
            }
        });
        let inputs = state.model.io.read.iter().map(|port| {
            let port = u16::from(*port);
            PortView { port, input: true, value: state.model.io.read_port(&state.plant, port) }
        });
        let outputs = state.outputs.values(&state.model.io).into_iter();
        let outputs = outputs.map(|(port, value)| PortView { port, input: false, value });
        View {
            at,
            model: state.model.name.clone(),
            machine: state.plant.machine().name.clone(),
            powered: state.powered,
            activity: self.shown_activity(),
            waits_for: self.awaited(),
            baud: state.model.line.baud,
            received: Fill { used: state.buffer.bytes, size: state.model.buffer.bytes },
            axes: axes.collect(),
            signals: self.signal_views(),
            ports: inputs.chain(outputs).collect(),
            timers: self.timers(),
            details: self.own_details(),
        }
    }

    fn timers(&self) -> Vec<TimerView> {
        let causes = [
            (self.job_due(), Cause::Activity),
            (self.unit.due, Cause::SpindleSpeed),
            (self.ball.due, Cause::TrackballReport),
            (self.contact_due(), Cause::Contact),
            (self.switch_due(), Cause::LimitSwitch),
        ];
        let mut timers: Vec<TimerView> = causes
            .into_iter()
            .filter_map(|(due, cause)| {
                let due = due.filter(|due| *due != Time::NEVER)?;
                Some(TimerView { cause, due })
            })
            .collect();
        timers.sort_by_key(|timer| timer.due);
        timers
    }

    pub(crate) fn own_details(&self) -> Details {
        let state = self;
        let settings = &state.settings;
        let axes = state.fitted().map(|axis| {
            let index = axis.index();
            // The counters' own range does not count as a configured border.
            let (low, high) = settings.borders(index);
            AxisSettings {
                index: index as u8,
                unit: state.plant.machine().axis(index).unit,
                resolution: settings.resolution[index],
                speed: settings.axis_speed[index],
                acceleration: settings.acceleration[index],
                lowest: (low != i64::from(i32::MIN)).then_some(low),
                highest: (high != i64::from(i32::MAX)).then_some(high),
            }
        });
        Details {
            head: if state.outputs.head_down { Head::Down } else { Head::Up },
            echo: settings.echo,
            spindle: state.outputs.spindle,
            half_current: state.outputs.half_current,
            stopped: state.stopped.map(|stop| match stop {
                Stop::Command => StoppedBy::Command,
                Stop::External => StoppedBy::ExternalStop,
                Stop::Limit(..) | Stop::Fault(_) => StoppedBy::Limit,
                Stop::SoftFrame => StoppedBy::Border,
                Stop::Message => StoppedBy::Message,
            }),
            fault: self.standing_fault().map(|status| status.code()),
            commands_waiting: state.buffer.commands(),
            overrun: state.buffer.overrun,
            channel_open: state.reader.channel_open(),
            trackball: state.ball.open,
            external_stop: settings.external_stop,
            speed_down: settings.speed_down,
            speed_up: settings.speed_up,
            mode: settings.mode,
            head_times: settings.head_times(),
            settling: settings.settling,
            axes: axes.collect(),
        }
    }

    /// What the controller is doing, or why it refuses moves.
    pub(crate) fn shown_activity(&self) -> Doing {
        match self.doing() {
            Doing::Idle if self.standing_fault().is_some() => Doing::CannotMove,
            doing => doing,
        }
    }

    pub(crate) fn doing(&self) -> Doing {
        if !self.powered {
            return Doing::Off;
        }
        match &self.job {
            Some(Task { activity: Activity::Waiting(pause, _), .. }) => match pause {
                Pause::Head => Doing::WaitingForHead,
                Pause::Settling => Doing::Settling,
                Pause::Once => Doing::Waiting,
            },
            Some(Task { command: Command::OpenInterface(_), number: None, .. }) => {
                Doing::FollowingTrackball
            }
            Some(Task { stage, .. }) => match stage {
                Some(Stage::Arc(..)) => Doing::Arc,
                Some(Stage::Vectors(..)) => Doing::FollowingVectors,
                Some(Stage::Onto(..)) => Doing::ReferenceTowardsSwitch,
                Some(Stage::Off(..)) => Doing::ReferenceOutOfSwitch,
                Some(Stage::Free(..)) => Doing::ReferenceFreeSteps,
                _ => Doing::Move,
            },
            None if self.stopped.is_some() => Doing::Stopped,
            None if self.ball.open.is_some() => Doing::Trackball,
            None => Doing::Idle,
        }
    }

    /// What it waits for, unless a command executes. Spindle unit and trackball continue meanwhile.
    fn awaited(&self) -> Option<WaitsFor> {
        match self.shown_activity() {
            Doing::Off => Some(WaitsFor::Power),
            Doing::CannotMove => Some(WaitsFor::MotionAllowed),
            _ if self.job_due().is_some() => None,
            Doing::Stopped => Some(WaitsFor::GoOn),
            Doing::Trackball => Some(WaitsFor::TrackballClosed),
            Doing::Idle => Some(WaitsFor::Command),
            _ => Some(WaitsFor::Ending),
        }
    }
}
