//! A picture of the controller for people.

use vimc4_device::{AxisView, LoopView, PortView, ProgramView, Time, TimerView, View};
use vimc4_motion::Running;

use crate::moves::wrap;
use crate::program::Validity;
use crate::state::{Activity, Job, Phase, Wait};
use crate::{AXES, AXIS_NAMES, Controller};

impl Controller {
    /// The running segment.
    pub(crate) fn running(&self) -> Option<Running<'_>> {
        let (segment, began) = match &self.state.activity {
            Activity::Moving(moving) => (&moving.segment, moving.began),
            Activity::Referencing(run) => (&run.segment, run.began),
            _ => return None,
        };
        Some(Running { segment, began })
    }

    pub(crate) fn picture(&self, at: Time) -> View {
        let state = &self.state;
        let at = at.max(state.now);
        let running = self.running();
        let axes = (0..AXES).map(|axis| {
            let offset = running.map_or(0, |running| running.offset(axis, at));
            AxisView {
                name: AXIS_NAMES[axis].to_owned(),
                configured: state.axes.has(axis),
                position: wrap(state.position[axis] + offset),
                carriage: state.plant.carriage()[axis] + state.carriage_sign(axis) * offset,
                referenced: state.referenced.has(axis),
                zero: state.zero[axis],
                speed: running.map_or(0, |running| running.speed(axis, at)),
            }
        });
        let ports = state.model.ports.read.keys().map(|&port| (port, true));
        let ports = ports.chain(state.model.ports.write.keys().map(|&port| (port, false)));
        View {
            at,
            model: state.model.name.clone(),
            powered: state.powered,
            activity: self.activity_name().to_owned(),
            axes: axes.collect(),
            start_stop: state.ramp.start_stop,
            acceleration: state.ramp.acceleration,
            timers: self
                .deadline()
                .map(|due| TimerView { cause: self.activity_name().to_owned(), due })
                .into_iter()
                .collect(),
            program: self.program_view(),
            ports: ports
                .map(|(port, input)| PortView {
                    port,
                    input,
                    value: if input { self.read_port(port) } else { self.driven_value(port) },
                })
                .collect(),
            settings: [
                ("machine", state.plant.machine().name.clone()),
                ("interpolation", if state.three_d { "3D" } else { "2.5D" }.to_owned()),
                ("plane", format!("{:?}", state.plane).to_uppercase()),
                ("test mode", state.test_mode.to_string()),
                ("limit switch error", state.latched.to_string()),
                ("motors on", state.motors_on().to_string()),
                ("stopped motion", state.remainder.is_some().to_string()),
                ("storing", state.storing.to_string()),
                ("baud", state.baud.to_string()),
            ]
            .map(|(name, value)| (name.to_owned(), value))
            .into(),
        }
    }

    fn activity_name(&self) -> &'static str {
        let state = &self.state;
        if !state.powered {
            return "off";
        }
        match &state.activity {
            Activity::Moving(moving) => match moving.job {
                Job::Program => "program move",
                Job::SelfTest => "self-test",
                Job::Command(_) | Job::Answered(_) => "move",
            },
            Activity::Referencing(run) => match run.phase {
                _ if !run.whole => "leaving a limit switch",
                Phase::Approach => "reference run, towards the switch",
                Phase::StepOut => "reference run, out of the switch",
                Phase::Free => "reference run, free steps",
            },
            Activity::Waiting { what, .. } => match what {
                Wait::Boot | Wait::PowerUp => "starting up",
                Wait::Erase | Wait::PanelErase => "erasing the program",
                Wait::Delay => "program delay",
                Wait::Line => "program line",
                Wait::Port => "program waits for a port",
                Wait::Character => "program waits for a character",
                Wait::Forever => "program halted on itself",
            },
            Activity::Echo => "self-test echo",
            Activity::Idle if state.storing => "storing a program",
            Activity::Idle if state.run.is_some() => "program stopped",
            Activity::Idle => "idle",
        }
    }

    fn program_view(&self) -> Option<ProgramView> {
        let program = self.state.flash.program.as_ref()?;
        let run = self.state.run.as_ref();
        let status = match (run, program.validity) {
            (Some(run), _) if run.paused => "paused",
            (Some(_), _) => "running",
            (None, Validity::Valid) => "valid",
            (None, Validity::Invalid) => "invalid",
            (None, Validity::Incomplete) => "incomplete",
        };
        Some(ProgramView {
            status: status.to_owned(),
            lines: program.lines.iter().map(|line| line.text.escape_ascii().to_string()).collect(),
            marker: run.map(|run| run.line),
            loops: run.map_or_else(Vec::new, |run| {
                run.loops.iter().map(|l| LoopView { line: l.line, left: l.left }).collect()
            }),
        })
    }
}
