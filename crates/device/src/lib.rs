//! The contract between a simulated device and the code that runs it.
//!
//! Bytes and signals go in with a time, bytes and events come out with a time; nothing inside knows
//! a clock, a socket or a thread. [`Device`] says how to drive one; a host for real serial lines, a
//! test with simulated time and a debugger all do it the same way. In virtual time a [`Harness`]
//! drives it: send, ask, advance, run until a condition holds, take the output.
#![forbid(unsafe_code)]

mod breakpoint;
mod condition;
mod course;
mod deed;
mod duration;
mod event;
mod facts;
mod fault;
mod grouped;
mod handling;
mod harness;
mod input;
mod line;
mod model;
mod modem;
mod nth;
mod outbox;
mod output;
mod run;
mod scenario;
mod signal;
mod text;
mod view;

pub use breakpoint::Breakpoint;
pub use condition::{Condition, Fact, LengthUnit, Named, Names, Scale, Vocabulary, is_mnemonic};
pub use course::{Ability, Course, Situation, StopCause};
pub use deed::{
    Deed, DeedError, faults_in_words, is_like, position_in_words, rules_in_words, settable,
};
pub use duration::{NotADuration, parse_duration, show_nanos};
pub use event::{Event, Kinds, Loss, Motion, Warning};
pub use facts::Facts;
pub use fault::{
    Awaited, BadByte, Chance, Damage, Fault, FaultNews, FaultNumber, FaultStage, FaultView,
    Faulting, Garbling, LineFault, MOST_FAULTS, MachineFault, MachineStrike, Mishap, Strike,
    SwitchSays, Way, When,
};
pub use grouped::Grouped;
pub use handling::{
    Effects, Erasing, Handling, Heard, Identity, Piece, Question, StartButton, Stop, Travel, Turn,
    Until,
};
pub use harness::{Endless, Harness};
pub use input::{Input, OwnedInput, TimedInput};
pub use line::{Line, LineState};
pub use model::{MemoryError, Model};
pub use modem::ModemLine;
pub use nth::Nth;
pub use outbox::Outbox;
pub use output::{CommandNumber, FlashChange, Output, Stamp};
pub use run::{Beginnings, Device, Forecast, Foresight, MAX_CAUSES, OtherController};
pub use scenario::{
    Act, Awaits, Cue, Lasts, MOST_RULES, Rule, RuleId, RuleNews, RuleStage, RuleView, Ruling,
    Scenario, ScenarioError, ScenarioNumber, Trigger,
};
pub use signal::{Signal, SignalId, SignalKind};
pub use text::{escape, parted, said, unescape, unescape_first};
pub use view::{Activity, AxisView, Cause, Fill, PortView, SignalView, TimerView, View, WaitsFor};
pub use vimc4_motion::{AXES, Path, Point, Running, Segment, Time};
