//! What the lines of a job ask for.
//!
//! The interpreter knows what holds: where the tool is, exactly; the work-piece zero; speeds,
//! plane, drilling cycle. It checks every command before anything of it is done. What a line asks
//! for comes out as [`Action`]s, which are cheap to make and need not be carried out: who only
//! checks a job drops them.

mod approach;
mod arcs;
mod drilling;
mod outputs;
mod places;
mod reference;
mod settings;
mod sink;
mod straight;
mod units;

use vimc4_isel_wire::{AxisSet, Plane};

use crate::geometry::Steps;
use crate::job::action::{Action, InputTest, OutputChange, Question};
use crate::job::drill::Definition;
use crate::job::place::{Cylinder, Place, counters};
use crate::job::problem::{Accessories, Problem};
use crate::job::target::Target;
use crate::job::zero::Zero;
use crate::language::{Command, Line, Placed, PortBit, Rate, Span, Units, Value};

pub use approach::Standing;
use arcs::ArcWords;
use sink::{Report, Sink};

/// How a job is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Takes the present point as reference point, where a job begins without a reference run.
    pub no_reference: bool,
    /// The values of DRILLDEF but P are mm.
    pub drill_in_mm: bool,
    /// Changes of the tool are left out, with a warning for each.
    pub leave_out_tools: bool,
}

/// What holds, and what a line makes of it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Interpreter<'t> {
    target: &'t Target,
    options: Options,
    state: State,
}

/// What holds between two lines.
#[derive(Clone, Debug, PartialEq)]
struct State {
    place: Place,
    counters: Steps,
    zero: Place,
    registers: [Zero; 8],
    normal: Value,
    rapid: Value,
    /// The same where only turning axes move.
    turning: [Value; 2],
    units: Units,
    /// The line that is carried out.
    line: u32,
    /// What is switched that nothing is connected to, and where it is switched first.
    unconnected: Accessories,
    first_unconnected: Option<(u32, Span)>,
    /// What was said of the spindle.
    told_of_spindle: [bool; 3],
    /// How far below the reference plane the last hole has left the tool, 0 at the plane itself, if
    /// it was not lifted above the work and has not been since.
    in_work: Option<Value>,
    told_of_holes: ToldOfHoles,
    /// Of which axes WPZERO or the operator has made a place the zero that no reference run has
    /// told yet, and in which line.
    zero_unsure: AxisSet,
    zero_line: u32,
    /// What was said of the normal, the rapid and the drilling speed since they were set.
    told: [Told; 3],
    plane: Plane,
    limits: [Option<(Value, Value)>; 4],
    cylinder: Option<Cylinder>,
    drill: Definition,
    mark: Mark,
    /// Whether something has moved, or been referenced.
    begun: bool,
    referenced: AxisSet,
    /// Axes of which it is assumed, and no reference run has told, that they stood at 0.
    assumed: AxisSet,
    /// Of which axes it was said that they are not.
    told_unreferenced: [bool; 4],
    ended: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Told {
    raised: bool,
    capped: bool,
}

/// What was said of the holes as they are defined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct ToldOfHoles {
    surface: bool,
    depth: bool,
    steps: bool,
    lift: bool,
}

/// Where the file mark is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mark {
    /// Not seen, nor any command.
    Awaited,
    /// Not seen, but commands.
    Missing,
    Seen,
}

/// Which speed a movement has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pace {
    Normal,
    Rapid,
    Drill,
}

impl From<Rate> for Pace {
    fn from(rate: Rate) -> Pace {
        match rate {
            Rate::Normal => Pace::Normal,
            Rate::Rapid => Pace::Rapid,
        }
    }
}

/// A reason not to carry a line out, and where it stands.
type Refusal = (Span, Problem);

impl<'t> Interpreter<'t> {
    /// What holds before the first line.
    pub(in crate::job) fn new(target: &'t Target, options: Options) -> Interpreter<'t> {
        let setup = &target.setup;
        let state = State {
            place: Place::default(),
            counters: Steps::default(),
            zero: target.zero.0.map(Option::unwrap_or_default),
            registers: target.registers,
            normal: Value::whole(setup.velocity.into()),
            rapid: Value::whole(setup.rapid_velocity.into()),
            turning: [setup.velocity, setup.rapid_velocity].map(|speed| Value::whole(speed.into())),
            units: Units::Metric,
            line: 0,
            unconnected: Accessories::default(),
            first_unconnected: None,
            told_of_spindle: [false; 3],
            in_work: None,
            told_of_holes: ToldOfHoles::default(),
            zero_unsure: AxisSet::NONE,
            zero_line: 0,
            told: [Told::default(); 3],
            plane: Plane::Xy,
            limits: [None; 4],
            cylinder: None,
            drill: Definition::default(),
            mark: Mark::Awaited,
            begun: false,
            referenced: AxisSet::NONE,
            assumed: AxisSet::NONE,
            told_unreferenced: [false; 4],
            ended: false,
        };
        Interpreter { target, options, state }
    }

    /// What it is carried out on.
    pub(in crate::job) fn target(&self) -> &'t Target {
        self.target
    }

    /// Whether PROGEND was read.
    pub(in crate::job) fn has_ended(&self) -> bool {
        self.state.ended
    }

    /// The axes of which it is assumed that they stood at 0.
    pub(in crate::job) fn assumed(&self) -> AxisSet {
        self.state.assumed
    }

    /// Where the counters are.
    pub(in crate::job) fn counters(&self) -> Steps {
        self.state.counters
    }

    /// In which unit lengths are read.
    pub(in crate::job) fn units(&self) -> Units {
        self.state.units
    }

    /// Reads lengths in this unit from now on.
    pub(in crate::job) fn set_units(&mut self, units: Units) {
        self.state.units = units;
    }

    /// Whether the file had no mark. Only its end shows.
    pub(in crate::job) fn lacks_mark(&self) -> bool {
        self.state.mark != Mark::Seen
    }

    /// What was switched although nothing is connected, and where first. Only the end of a job
    /// shows all of it.
    pub(in crate::job) fn unconnected(&self) -> Option<(u32, Span, Problem)> {
        let (line, span) = self.state.first_unconnected?;
        Some((line, span, Problem::NotConnected(self.state.unconnected)))
    }

    /// Makes the present place the work-piece zero, as the operator says at WPTEACH.
    pub(in crate::job) fn take_zero(&mut self) {
        let state = &mut self.state;
        state.zero = state.place;
        // Before the first movement the present place is the reference point, if it may be told.
        state.zero_unsure = match state.begun {
            true => without(self.target.referable, state.referenced),
            false => AxisSet::NONE,
        };
        state.zero_line = state.line;
    }

    /// The same at a place that was found before; on axes that it does not name, at the present one.
    pub(in crate::job) fn find_zero(&mut self, found: Zero) {
        let state = &mut self.state;
        for (axis, found) in state.place.iter_mut().zip(found.0) {
            *axis = found.unwrap_or(*axis);
        }
        state.counters = counters(&state.place, self.target, state.cylinder.as_ref());
        self.take_zero();
    }

    /// Carries a line out: what it asks for goes into `actions`, what is to be said about it to
    /// `report`. Says whether it can be carried out; if not, nothing of it is in `actions`.
    pub(in crate::job) fn line(
        &mut self,
        line: &Line<'_>,
        number: u32,
        actions: &mut Vec<Action>,
        report: Report<'_>,
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
    fn mark(&mut self, command: &Command, number: u32, sink: &mut Sink<'_>) {
        match (command, self.state.mark) {
            (Command::Mark, Mark::Awaited) if number > 1 => sink.say(Problem::MarkNotFirst),
            (Command::Mark, Mark::Missing) => sink.say(Problem::MarkLate),
            _ => {}
        }
        self.state.mark = match (command, self.state.mark) {
            (Command::Mark, _) | (_, Mark::Seen) => Mark::Seen,
            _ => Mark::Missing,
        };
    }

    fn command(&mut self, command: &Command, sink: &mut Sink<'_>) -> Result<(), Refusal> {
        let state = &mut self.state;
        match *command {
            Command::Mark | Command::Type => {}
            Command::Reference(groups) => self.reference(&groups, sink)?,
            Command::Limit(limits) => self.limit(&limits)?,
            Command::Velocity(word) => {
                state.normal = word.value;
                state.turning[0] = state.units.back(word.value);
                state.told[Pace::Normal as usize] = Told::default();
            }
            Command::RapidVelocity(word) => {
                state.rapid = word.value;
                state.turning[1] = state.units.back(word.value);
                state.told[Pace::Rapid as usize] = Told::default();
            }
            Command::Move(frame, rate, words) => {
                let to = self.place_of(frame, &words)?;
                self.begin(sink);
                let parameters = self.straight(to, rate.into(), sink)?;
                if parameters.by != Steps::default() {
                    sink.push(Action::Straight(parameters));
                }
            }
            Command::Plane(plane) => state.plane = plane,
            Command::Arc { frame, turn, helix, centre, sweep, to } => {
                let to = ArcWords { frame, turn, helix, centre, sweep, to };
                self.arc(&to, sink)?;
            }
            Command::Wait(word) => sink.dwell(word),
            Command::ZeroHere if !state.begun && !self.options.no_reference => {
                return Err((sink.span, Problem::PlaceUnknown));
            }
            Command::ZeroHere => self.take_zero(),
            Command::ZeroStandard => {
                let standard = self.target.zero.0;
                self.zero_at(&standard.map(|zero| Some(zero.unwrap_or_default())));
            }
            Command::ZeroAt(words) => self.zero_at(&self.named(&words)?),
            Command::ZeroClear => self.zero_at(&Place::default().map(Some)),
            Command::Store(number, words) => {
                let named = self.named(&words)?;
                if let Some(register) = register(&mut self.state, number) {
                    *register = Zero(named).or(*register);
                }
            }
            Command::Recall(number) => match register(state, number).copied() {
                Some(stored) if !stored.is_empty() => self.zero_at(&stored.0),
                _ => sink.say(Problem::EmptyRegister(number)),
            },
            Command::Teach => {
                self.begin(sink);
                sink.push(Action::Ask(Question::Teach));
            }
            Command::SetPort(number, value) => {
                let port = self.output_port(number, sink.span)?;
                sink.push(Action::Output(OutputChange { port, bit: None, value }));
            }
            Command::SetBit(PortBit { port, bit }, on) => {
                let port = self.output_port(port, sink.span)?;
                let bit = Some(bit.saturating_sub(1));
                sink.push(Action::Output(OutputChange { port, bit, value: on.into() }));
            }
            Command::WaitBit(PortBit { port, bit }, on) => {
                let port = self.input_port(port, sink.span)?;
                let bit = Some(bit.saturating_sub(1));
                sink.push(Action::Await(InputTest { port, bit, value: on.into() }));
            }
            Command::WaitPort(number, value) => {
                let port = self.input_port(number, sink.span)?;
                sink.push(Action::Await(InputTest { port, bit: None, value }));
            }
            Command::Path | Command::PathEnd => sink.say(Problem::PathIgnored),
            Command::Tool(number) if self.options.leave_out_tools => {
                sink.say(Problem::ToolLeftOut(number));
            }
            Command::Tool(number) => sink.push(Action::Ask(Question::Tool(number))),
            Command::DrillDefinition(words) => self.drill_definition(&words, sink)?,
            Command::Drill(words) => self.drill(&words, sink)?,
            Command::Cylinder(turning, radius, linear) => {
                self.cylinder(turning, radius, linear, sink)?
            }
            Command::Halt => sink.push(Action::Ask(Question::Halt)),
            Command::Acceleration(words) => self.acceleration(&words, sink)?,
            Command::Spindle(words) => self.spindle(&words, sink)?,
            Command::Switch(accessory, on) => self.accessory(accessory, on, sink)?,
            Command::Units(units) => state.units = units,
            Command::ToolDefinition | Command::ToolInit => sink.say(Problem::ToolIgnored),
            Command::End => state.ended = true,
        }
        Ok(())
    }
}

/// One value and another.
fn sum(a: Value, b: Value) -> Value {
    Value::thousandths(a.in_thousandths().saturating_add(b.in_thousandths()))
}

/// The axes of one set that are not in another.
fn without(axes: AxisSet, others: AxisSet) -> AxisSet {
    AxisSet::from_bits(axes.bits() & !others.bits()).unwrap_or(AxisSet::NONE)
}

fn register(state: &mut State, number: u8) -> Option<&mut Zero> {
    state.registers.get_mut(usize::from(number).checked_sub(1)?)
}
