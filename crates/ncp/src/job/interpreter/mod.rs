//! Interpreting the lines of a job.
//!
//! The interpreter keeps the state: the exact place of the tool, the work-piece zero, speeds,
//! plane, drilling cycle. It checks every command before any of it is done. It yields [`Action`]s,
//! which are cheap to make and need not be carried out: a mere check of a job drops them.

mod approach;
mod arcs;
mod drilling;
mod outputs;
mod places;
mod reference;
mod settings;
mod sink;
mod state;
mod straight;
mod units;

use crate::geometry::Steps;
use crate::job::action::{Action, Question};
use crate::job::place::Place;
use crate::job::problem::Problem;
use crate::job::zero::Zero;
use crate::language::{Instruction, JobLine, Placed, PortBit};

pub use approach::Standing;
use arcs::ArcWords;
use sink::{Reporter, Sink};
pub(super) use state::Interpreter;
pub use state::Options;
use state::{Mark, Pace, Refusal, State, Told};

impl Interpreter<'_> {
    /// Carries a line out: its actions go into `actions`, diagnostics to `report`. Returns whether
    /// it can be carried out; if not, nothing of it is in `actions`.
    pub(in crate::job) fn line(
        &mut self,
        line: &JobLine<'_>,
        number: u32,
        actions: &mut Vec<Action>,
        report: Reporter<'_>,
    ) -> bool {
        let Some(Placed { value: command, span }) = line.command else { return true };
        if self.state.ended {
            return true;
        }
        self.state.line = number;
        let before = actions.len();
        let mut sink = Sink { span, actions, report };
        self.mark(&command, number, &mut sink);
        let command =
            self.state.units.metric(command, self.target.rotary, self.options.drill_in_mm);
        match self.command(&command, &mut sink) {
            Ok(()) => true,
            Err((span, problem)) => {
                sink.say_at(span, problem);
                actions.truncate(before);
                false
            }
        }
    }

    /// The mark stands before everything else.
    fn mark(&mut self, command: &Instruction, number: u32, sink: &mut Sink<'_>) {
        match (command, self.state.mark) {
            (Instruction::Mark, Mark::Awaited) if number > 1 => sink.say(Problem::MarkNotFirst),
            (Instruction::Mark, Mark::Missing) => sink.say(Problem::MarkLate),
            _ => {}
        }
        self.state.mark = match (command, self.state.mark) {
            (Instruction::Mark, _) | (_, Mark::Seen) => Mark::Seen,
            _ => Mark::Missing,
        };
    }

    fn command(&mut self, command: &Instruction, sink: &mut Sink<'_>) -> Result<(), Refusal> {
        let state = &mut self.state;
        match *command {
            Instruction::Mark | Instruction::Type => {}
            Instruction::Reference(groups) => self.reference(&groups, sink)?,
            Instruction::Limit(limits) => self.limit(&limits)?,
            Instruction::Velocity(word) => {
                state.normal = word.value;
                state.turning[0] = state.units.back(word.value);
                state.told[Pace::Normal as usize] = Told::default();
            }
            Instruction::RapidVelocity(word) => {
                state.rapid = word.value;
                state.turning[1] = state.units.back(word.value);
                state.told[Pace::Rapid as usize] = Told::default();
            }
            Instruction::Move(frame, rate, words) => {
                let to = self.place_of(frame, &words)?;
                self.begin(sink);
                let parameters = self.straight(to, rate.into(), sink)?;
                if parameters.by != Steps::default() {
                    sink.push(Action::Straight(parameters));
                }
            }
            Instruction::Plane(plane) => state.plane = plane,
            Instruction::Arc { frame, turn, helix, centre, sweep, to } => {
                let to = ArcWords { frame, turn, helix, centre, sweep, to };
                self.arc(&to, sink)?;
            }
            Instruction::Wait(word) => sink.dwell(word),
            Instruction::ZeroHere if !state.begun && !self.options.no_reference => {
                return Err((sink.span, Problem::PlaceUnknown));
            }
            Instruction::ZeroHere => self.take_zero(),
            Instruction::ZeroStandard => {
                let standard = self.target.zero.0;
                self.zero_at(&standard.map(|zero| Some(zero.unwrap_or_default())));
            }
            Instruction::ZeroAt(words) => self.zero_at(&self.named(&words)?),
            Instruction::ZeroClear => self.zero_at(&Place::default().map(Some)),
            Instruction::Store(number, words) => {
                let named = self.named(&words)?;
                if let Some(register) = register(&mut self.state, number) {
                    *register = Zero(named).or(*register);
                }
            }
            Instruction::Recall(number) => match register(state, number).copied() {
                Some(stored) if !stored.is_empty() => self.zero_at(&stored.0),
                _ => sink.say(Problem::EmptyRegister(number)),
            },
            Instruction::Teach => {
                self.begin(sink);
                sink.push(Action::Ask(Question::Teach));
            }
            Instruction::SetPort(port, value) => self.set_output(port, None, value, sink)?,
            Instruction::SetBit(PortBit { port, bit }, on) => {
                self.set_output(port, Some(bit), on.into(), sink)?;
            }
            Instruction::WaitBit(PortBit { port, bit }, on) => {
                self.await_input(port, Some(bit), on.into(), sink)?;
            }
            Instruction::WaitPort(port, value) => self.await_input(port, None, value, sink)?,
            Instruction::Path | Instruction::PathEnd => sink.say(Problem::PathIgnored),
            Instruction::Tool(number) if self.options.leave_out_tools => {
                sink.say(Problem::ToolLeftOut(number));
            }
            Instruction::Tool(number) => sink.push(Action::Ask(Question::Tool(number))),
            Instruction::DrillDefinition(words) => self.drill_definition(&words, sink)?,
            Instruction::Drill(words) => self.drill(&words, sink)?,
            Instruction::Cylinder(turning, radius, linear) => {
                self.cylinder(turning, radius, linear, sink)?
            }
            Instruction::Halt => sink.push(Action::Ask(Question::Halt)),
            Instruction::Acceleration(words) => self.acceleration(&words, sink)?,
            Instruction::Spindle(words) => self.spindle(&words, sink)?,
            Instruction::Switch(accessory, on) => self.accessory(accessory, on, sink)?,
            Instruction::Units(units) => state.units = units,
            Instruction::ToolDefinition | Instruction::ToolInit => sink.say(Problem::ToolIgnored),
            Instruction::End => state.ended = true,
        }
        Ok(())
    }
}

fn register(state: &mut State, number: u8) -> Option<&mut Zero> {
    state.registers.get_mut(usize::from(number).checked_sub(1)?)
}
