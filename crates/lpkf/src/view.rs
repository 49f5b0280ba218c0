//! A picture of the controller for people.

use vimc4_device::{AxisView, Point, PortView, Time, TimerView, View};
use vimc4_motion::Running;

use crate::Controller;
use crate::language::Axis;
use crate::model::CommandSet;
use crate::state::{Activity, Job, Pause, Stage, Stop};

impl Controller {
    /// What an axis is called: the one Z of an SMCU has no number.
    pub(crate) fn axis_name(&self, axis: Axis) -> &'static str {
        match (self.state.model.command_set, axis) {
            (CommandSet::Smcu, Axis::Z0) => "Z",
            (_, axis) => axis.name(),
        }
    }

    /// The running segment.
    pub(crate) fn running(&self) -> Option<Running<'_>> {
        match &self.state.job.as_ref()?.activity {
            Activity::Moving(moving) => {
                Some(Running { segment: &moving.segment, began: moving.began })
            }
            _ => None,
        }
    }

    /// Where all axes really are now.
    pub(crate) fn all_actual_now(&self) -> Point {
        let standing = self.state.actual();
        let now = self.state.now;
        let offset = |axis| self.running().map_or(0, |running| running.offset(axis, now));
        std::array::from_fn(|axis| standing[axis] + offset(axis))
    }

    /// Where an axis really is now.
    pub(crate) fn actual_now(&self, axis: Axis) -> i64 {
        self.all_actual_now()[axis.index()]
    }

    pub(crate) fn picture(&self, at: Time) -> View {
        let state = &self.state;
        let at = at.max(state.now);
        let running = self.running();
        let axes = state.fitted().map(|axis| {
            let index = axis.index();
            let offset = running.map_or(0, |running| running.offset(index, at));
            AxisView {
                name: self.axis_name(axis).to_owned(),
                configured: true,
                position: state.position[index] + offset,
                carriage: state.plant.carriage()[index] + state.carriage_sign(index) * offset,
                referenced: state.referenced[index],
                zero: 0,
                speed: running.map_or(0, |running| running.speed(index, at)),
            }
        });
        let inputs = state.model.io.read.iter().map(|port| {
            let port = u16::from(*port);
            PortView { port, input: true, value: self.read_port(port) }
        });
        let outputs = self.outputs().into_iter();
        let outputs = outputs.map(|(port, value)| PortView { port, input: false, value });
        View {
            at,
            model: state.model.name.clone(),
            powered: state.powered,
            activity: self.activity_name().to_owned(),
            axes: axes.collect(),
            start_stop: 0,
            acceleration: 0,
            timers: self.timers(),
            program: None,
            ports: inputs.chain(outputs).collect(),
            settings: self.settings_view(),
        }
    }

    fn timers(&self) -> Vec<TimerView> {
        let causes = [
            (self.job_due(), self.activity_name()),
            (self.state.unit.due, "spindle reaches its speed"),
            (self.state.ball.due, "position of the trackball's axis"),
        ];
        let mut timers: Vec<TimerView> = causes
            .into_iter()
            .filter_map(|(due, cause)| {
                let due = due.filter(|due| *due != Time::NEVER)?;
                Some(TimerView { cause: cause.to_owned(), due })
            })
            .collect();
        timers.sort_by_key(|timer| timer.due);
        timers
    }

    fn settings_view(&self) -> Vec<(String, String)> {
        let state = &self.state;
        let settings = &state.settings;
        let on = |on: bool| if on { "on" } else { "off" }.to_owned();
        let [before_down, after_down, before_up, after_up] = settings.head_times();
        let borders = |axis: usize| match settings.borders(axis) {
            (low, high) if low == i64::from(i32::MIN) && high == i64::from(i32::MAX) => {
                "-".to_owned()
            }
            (low, high) => format!("{low} to {high}"),
        };
        let mut list = vec![
            ("machine", state.plant.machine().name.clone()),
            ("echo", on(settings.echo)),
            ("head", if state.head_down { "down" } else { "up" }.to_owned()),
            ("spindle", on(state.spindle)),
            ("half current", on(state.half_current)),
            ("speed down", format!("{} um/s", settings.speed_down)),
            ("speed up", format!("{} um/s", settings.speed_up)),
            ("mode", format!("{:?}", settings.mode).to_lowercase()),
            ("head times", format!("{before_down} {after_down} {before_up} {after_up} ms")),
            ("settling", format!("{} ms", settings.settling)),
            ("external stop", on(settings.external_stop)),
            ("stopped", self.stop_name().to_owned()),
            ("waiting", format!("{} bytes", state.buffer.bytes)),
            ("channel", if state.reader.channel_open() { "open" } else { "closed" }.to_owned()),
            ("trackball", if state.ball.open.is_some() { "open" } else { "closed" }.to_owned()),
        ]
        .into_iter()
        .map(|(name, value)| (name.to_owned(), value))
        .collect::<Vec<_>>();
        for axis in state.fitted() {
            let (index, name) = (axis.index(), self.axis_name(axis));
            let units = match self.is_rotary(axis) {
                true => ["1/1000\"", "0.1 deg/s", "mrad/s2"],
                false => ["nm", "um/s", "mm/s2"],
            };
            let resolution = settings.resolution[index];
            list.push((
                format!("{name} axis"),
                format!(
                    "{}.{:03} {}, {} {}, {} {}, range {}",
                    resolution / 1_000,
                    resolution % 1_000,
                    units[0],
                    settings.axis_speed[index],
                    units[1],
                    settings.acceleration[index],
                    units[2],
                    borders(index)
                ),
            ));
        }
        list
    }

    fn stop_name(&self) -> &'static str {
        match self.state.stopped {
            None => "no",
            Some(Stop::Command) => "by command",
            Some(Stop::External) => "from outside",
            Some(Stop::Limit) => "at a limit",
            Some(Stop::SoftFrame) => "at a border",
            Some(Stop::Message) => "by a message",
        }
    }

    fn activity_name(&self) -> &'static str {
        if !self.state.powered {
            return "off";
        }
        match &self.state.job {
            Some(Job { activity: Activity::Waiting(pause, _), .. }) => match pause {
                Pause::Head => "waiting for the head",
                Pause::Settling => "settling",
                Pause::Once => "waiting",
            },
            Some(Job { silent: true, .. }) => "following the trackball",
            Some(Job { stage, .. }) => match stage {
                Some(Stage::Arc(..)) => "arc",
                Some(Stage::Vectors(..)) => "following vectors",
                Some(Stage::Onto(..)) => "towards a limit switch",
                Some(Stage::Off(..)) => "off a limit switch",
                Some(Stage::Free(..)) => "reference run",
                _ => "move",
            },
            None if self.state.stopped.is_some() => "stopped",
            None if self.state.ball.open.is_some() => "trackball",
            None => "idle",
        }
    }
}
