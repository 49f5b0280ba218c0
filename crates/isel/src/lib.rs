//! The isel stepper controllers IMC4, IMC4-M and iMC-M/-MP/-S8, and the interface cards before them.
//!
//! A [`Controller`] is a [`Device`](vimc4_device::Device): bytes, signals and times go in,
//! bytes, events and times come out. Inside, data flows one way, and so do these modules:
//!
//! * `receive` takes bytes from the line, acts on 253, 254 and 255, and collects lines;
//! * `admission` decides whether a line may be executed, and which error wins if not;
//! * `command` executes it;
//! * `moves`, `reference`, `selftest` run the axes, `storing` and `running` the program;
//! * `halting` is everything that ends a motion before its time;
//! * `panel` reacts to buttons and switches, `ports` and `report` show the state;
//! * `why` says for what reason something was refused or ended.
//!
//! A model of controller is data, see [`Model`].
#![forbid(unsafe_code)]

mod admission;
mod command;
mod controller;
mod flash;
mod forecast;
mod halting;
mod ignored;
mod knowledge;
mod model;
mod moves;
mod panel;
mod ports;
mod program;
mod receive;
mod reference;
mod report;
mod running;
mod selftest;
mod settings;
mod state;
mod storing;
mod switches;
mod switching;
mod view;
mod why;

/// How many axes these controllers have: X, Y, Z, A.
pub(crate) const AXES: usize = 4;
/// What they are called.
pub(crate) const AXIS_NAMES: [&str; AXES] = ["X", "Y", "Z", "A"];

pub use controller::Controller;
pub use flash::{Flash, FlashError};
pub use model::{
    AfterFree, AxisCodes, BitValues, BranchBase, CommandSet, ControlReply, Defaults, FlashProfile,
    FractionalNumbers, LeaveSwitch, LimitBits, LimitLatch, Limits, LineProfile, LoopCount,
    LowerCase, Model, Place, PositionAxes, Quirks, RestingSpeed, SelfTestEnd, SpeedOf3d,
    StopButton, StopInMoveUntil, StopInReference, StopReply, StoreOver, StoredArcs, Texts, Timing,
    Unreferenced,
};
pub use ports::{Output, Outputs, Ports, Wire};
pub use program::{Program, StoredLine, Validity};
pub use settings::Settings;
pub use state::State;
pub use view::{Details, Interpolation, LoopView, NoMotion, ProgramStatus, ProgramView};
pub use vimc4_isel_wire::Plane;
