//! Virtual stepper controllers for tests: those of isel, and LPKF's SMCU and MotionSystem.
//!
//! An [`Emulator`] behaves like the real controller, byte for byte, behind a serial port, a TCP
//! socket or a port within the process. The test controls its machine, its operating panel and, if
//! wanted, its time.
//!
//! ```
//! use std::io::{Read, Write};
//! use std::net::TcpStream;
//! use vimc4::{Button, Clock, Emulator};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // With the instant clock a ten-minute job is done in milliseconds.
//! let emu = Emulator::builder().time(Clock::Instant).tcp("127.0.0.1:0").start()?;
//!
//! // Any host software can be the client; here it is a socket.
//! let mut port = TcpStream::connect(emu.tcp_addr().unwrap())?;
//! let mut ask = |command: &str| -> std::io::Result<char> {
//!     port.write_all(command.as_bytes())?;
//!     let mut answer = [0];
//!     port.read_exact(&mut answer)?;
//!     Ok(char::from(answer[0]))
//! };
//! assert_eq!(ask("@01\r")?, '0');
//! assert_eq!(ask("@0A100000,200\r")?, '0');
//! assert_eq!(emu.position()?, [100_000, 0, 0, 0]);
//!
//! // The panel works as on the machine.
//! emu.press(Button::EmergencyStop)?;
//! assert_eq!(ask("@0A100,900\r")?, '9');
//! # Ok(())
//! # }
//! ```
//!
//! | to … | use |
//! |---|---|
//! | choose model, machine, clock and where to listen | [`Emulator::builder`] |
//! | stop a motion at an exact step or time | [`Clock::Manual`], [`Emulator::run_until`], [`Emulator::advance`] |
//! | be the person at the machine | [`Emulator::press`], [`Emulator::turn`], [`Emulator::input`], [`Emulator::power`] |
//! | ask what the host did | [`Emulator::commands`], [`Emulator::journal`], [`Emulator::position`], [`Emulator::view`] |
//! | say what it has to do, in which order, how often, never | [`Emulator::expect`] |
//! | count what of the protocol a test has met | [`Emulator::coverage`], [`add_coverage`] |
//! | let several controllers and a simulation of your own share one time | [`Group`] |
//! | lose, garble, delay bytes, or cut the cable | [`Emulator::fault`] |
//! | press, switch off and break things when something else happens | [`Emulator::scenario`] |
//! | await instead of block | [`Emulator::control`] |
//! | hold the controller while its host is connected, at breakpoints or by hand, and lead it step by step | [`Emulator::pause`], [`Emulator::break_when`], [`Emulator::step`], [`Control`] |
//! | try several things from the same point | [`Emulator::snapshot`], [`Emulator::restore`] |
#![forbid(unsafe_code)]

mod builder;
mod control;
mod coverage;
mod emulator;
mod error;
mod expect;
mod fault;
mod group;
mod order;
mod profiles;
mod record;
mod recording;
mod scenario;
pub mod sweep;

pub use builder::{Builder, Records, Terminal};
pub use control::{Button, Control, Snapshot, View};
pub use coverage::{CoverageFileError, add_coverage, read_coverage};
pub use emulator::Emulator;
pub use error::{Error, ProfileFileError};
pub use expect::{Live, Watched};
pub use fault::{AnyFault, FaultHandle};
pub use group::{Group, GroupError, GroupState, Member, Simulation, World};
pub use order::Outcome;
pub use profiles::{machine, machine_profile, model, model_profile, scenario_file};
pub use record::HostCommand;
pub use recording::{
    OnError, RecordingError, RecordingFile, pack, recording_head, unpack, unpacking,
};
pub use scenario::{AnyScenario, ScenarioHandle};
#[cfg(feature = "lpkf")]
pub use vimc4_catalogue::lpkf;
pub use vimc4_catalogue::{
    Details, Effects, Family, Handling, Machine, MemoryError, Model, Piece, Turn, all_names, axis,
    bare, isel, machines, models, models_like, quirks,
};
pub use vimc4_device::{
    AXES, Act, Activity, Awaited, Awaits, AxisView, BadByte, Cause, Chance, CommandNumber,
    Condition, Cue, Damage, Deed, DeedError, Event, Fault, FaultNews, FaultNumber, FaultStage,
    FaultView, Faulting, Fill, Garbling, Kinds, Lasts, LengthUnit, LineFault, MOST_FAULTS,
    MOST_RULES, ModemLine, Motion, Names, NotADuration, Path, Point, PortView, Rule, RuleId,
    RuleNews, RuleStage, RuleView, Ruling, Scale, Scenario, ScenarioError, ScenarioNumber, Segment,
    Signal, SignalKind, SignalView, Stamp, Strike, Time, TimerView, Trigger, WaitsFor, Warning,
    Way, When, escape, parse_duration, settable,
};
pub use vimc4_host::{
    BreakpointId, BreakpointView, Clients, Clock, ClockError, ControlError, Effect, EventFilter,
    HostLines, LineEvent, MemoryPort, Pause, Pending, Progress, Rate, Report, ReportKind, Reports,
    Sink, SinkId, Source, Step, SuppressedWarnings, Tap, TimeAdvance, Traffic, Verbosity, Worker,
};
#[cfg(all(unix, feature = "pty"))]
pub use vimc4_host::{LinkError, PtyLink, User, Users};
pub use vimc4_language::{
    Completion, Order, Sort, SyntaxError, Verb, complete, help, help_on, list_signals,
    read_condition, read_fault, read_rule,
};

pub use vimc4_coverage::{
    Command as CoveredCommand, Coverage, CoverageError, Lcov, Point as CoveragePoint, Total, Totals,
};
pub use vimc4_journal::expect::{
    Clauses, CommandClause, ConditionLike, Expect, Expectation, Failure, Following, Mistake, Must,
    Reason, Sentence, Trial, Unmet, Whenever,
};
pub use vimc4_journal::{Entry, Journal, Move, Picture, What as Happened};

/// A controller without a thread, a clock or a port: driven input by input, in virtual time.
/// [`Device`](device::Device) says how.
pub mod device {
    pub use vimc4_catalogue::{Controller, State};
    pub use vimc4_device::{
        Breakpoint, Device, Endless, Foresight, Harness, Input, Line, LineState, Output,
        OwnedInput, SignalId, TimedInput,
    };
}
