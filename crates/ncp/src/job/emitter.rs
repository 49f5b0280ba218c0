//! From what a job does to commands of the controller.
//!
//! Only this module knows the controller's present settings: its axes, its plane, its outputs. A
//! long action is cut into commands one at a time, when the next is asked for.

use std::collections::{BTreeMap, VecDeque};

use vimc4_isel_wire::{AxisSet, Command, Dialect, Direction, Mode, Pair, Pairs, Plane};

use super::action::{Action, Hole, InputTest, OutputChange, Question, Stroke};
use super::target::{Target, a_apart};
use crate::geometry::{Curve, Motion, Straight};

/// One step that the code that runs a job has to take.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Send a command and await its answer.
    Send(Command),
    /// Change an output. To a controller that takes whole ports only, the port is this byte.
    Output(OutputChange, u8),
    /// Wait for this many µs.
    Dwell(u64),
    /// Wait until an input has a level.
    Await(InputTest),
    /// Ask the operator.
    Ask(Question),
}

impl Step {
    /// The command that does it at once, if one does.
    #[must_use]
    pub fn command(&self) -> Option<Command> {
        match self {
            Step::Send(command) => Some(command.clone()),
            Step::Output(change, byte) => {
                Some(Command::WritePort { port: change.port, value: *byte })
            }
            Step::Dwell(_) | Step::Await(_) | Step::Ask(_) => None,
        }
    }

    /// The bytes to send for it, with CR; `None` for steps that are not commands.
    #[must_use]
    pub fn line(&self, dialect: Dialect) -> Option<Vec<u8>> {
        let mut line = Vec::with_capacity(64);
        self.command()?.print(dialect, Mode::Direct, 0, &mut line);
        line.push(b'\r');
        Some(line)
    }
}

/// Cuts actions into steps.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Emitter {
    axes: AxisSet,
    plane: Plane,
    direction: Direction,
    /// What was written to the output ports.
    outputs: BTreeMap<u16, u8>,
    ready: VecDeque<Step>,
    running: Option<Running>,
}

/// An action that takes many commands.
#[derive(Clone, Debug, PartialEq)]
enum Running {
    Straight(Straight),
    Curve(Box<Curve>),
    Hole(Box<Hole>, Option<Straight>),
}

impl Emitter {
    /// Begins with the axes of the machine.
    pub(super) fn new(target: &Target) -> Emitter {
        let axes = target.axes;
        let mut emitter = Emitter {
            axes,
            plane: Plane::default(),
            direction: Direction::default(),
            outputs: BTreeMap::new(),
            ready: a_apart(axes).map(|axes| Step::Send(Command::SetAxes(axes))).collect(),
            running: None,
        };
        emitter.interpolate();
        emitter
    }

    /// Takes the next action. All steps of the one before must have been taken.
    pub(super) fn begin(&mut self, action: Action) {
        match action {
            Action::Reference(groups) => {
                let runs = groups.into_iter().map(|axes| Step::Send(Command::Reference(axes)));
                self.ready.extend(runs);
                self.interpolate();
            }
            Action::Straight(way) => self.running = Some(Running::Straight(Straight::new(way))),
            Action::Curve(curve) => {
                self.running = Some(Running::Curve(Box::new(Curve::new(*curve))));
            }
            Action::Drill(hole) => self.running = Some(Running::Hole(hole, None)),
            Action::Dwell(time) => self.ready.push_back(Step::Dwell(time)),
            Action::Output(change) => self.output(change),
            Action::Await(test) => self.ready.push_back(Step::Await(test)),
            Action::Ask(question) => self.ready.push_back(Step::Ask(question)),
            Action::Acceleration(hz_per_ms) => {
                self.ready.push_back(Step::Send(Command::Acceleration(hz_per_ms)));
            }
        }
    }

    /// The next step of what was begun.
    pub(super) fn next(&mut self) -> Option<Step> {
        loop {
            if let Some(step) = self.ready.pop_front() {
                return Some(step);
            }
            match self.running.as_mut()? {
                Running::Straight(straight) => match straight.next() {
                    Some(motion) => self.motion(motion),
                    None => self.running = None,
                },
                Running::Curve(curve) => match curve.next() {
                    Some(motion) => self.motion(motion),
                    None => self.running = None,
                },
                Running::Hole(hole, straight) => match straight.as_mut().and_then(Iterator::next) {
                    Some(motion) => self.motion(motion),
                    None => match hole.next() {
                        Some(Stroke::Straight(way)) => *straight = Some(Straight::new(way)),
                        Some(Stroke::Dwell(time)) => self.ready.push_back(Step::Dwell(time)),
                        None => self.running = None,
                    },
                },
            }
        }
    }

    /// Whether the last step is a movement at the rapid speed.
    pub(super) fn is_rapid(&self) -> bool {
        match &self.running {
            Some(Running::Straight(straight) | Running::Hole(_, Some(straight))) => {
                straight.is_rapid()
            }
            _ => false,
        }
    }

    /// All axes go together from now on; with two they always do.
    fn interpolate(&mut self) {
        if self.axes.count() > 2 {
            self.ready.push_back(Step::Send(Command::Interpolation3d(true)));
        }
    }

    fn output(&mut self, change: OutputChange) {
        let byte = self.outputs.entry(change.port).or_default();
        *byte = match change.bit {
            None => change.value,
            Some(bit) if change.value == 0 => *byte & !(1 << bit),
            Some(bit) => *byte | 1 << bit,
        };
        self.ready.push_back(Step::Output(change, *byte));
    }

    fn motion(&mut self, motion: Motion) {
        match motion {
            Motion::Line { by, speed } => {
                let mut pairs = [Pair { steps: 0, speed }; 4];
                for (pair, axis) in pairs.iter_mut().zip(self.axes.iter()) {
                    pair.steps = i32::try_from(by[axis]).unwrap_or_default();
                }
                // Three linear axes have a second pair of Z, which goes nowhere.
                let count = if self.axes.bits() == 0b0111 { 4 } else { self.axes.count() };
                let pairs = pairs.get(..count).and_then(Pairs::new);
                self.ready.extend(pairs.map(|pairs| Step::Send(Command::RelativeMove(pairs))));
            }
            Motion::Arc(plane, arc) => {
                self.turn(plane, arc.rx, arc.ry, arc.x, arc.y);
                self.ready.push_back(Step::Send(Command::Circle(arc)));
            }
            Motion::Helix(plane, arc, third) => {
                self.turn(plane, arc.rx, arc.ry, arc.x, arc.y);
                self.ready.push_back(Step::Send(Command::Helix(arc, third)));
            }
        }
    }

    /// Sets plane and direction, if they have changed.
    fn turn(&mut self, plane: Plane, rx: i8, ry: i8, x: i32, y: i32) {
        if self.plane != plane {
            self.plane = plane;
            self.ready.push_back(Step::Send(Command::Plane(plane)));
        }
        // The direction follows from how the place changes: the sign of x·Ry − y·Rx.
        let across = i64::from(x) * i64::from(ry) - i64::from(y) * i64::from(rx);
        let direction = if across < 0 { Direction::Clockwise } else { Direction::Counterclockwise };
        if self.direction != direction {
            self.direction = direction;
            self.ready.push_back(Step::Send(Command::Direction(direction)));
        }
    }
}
