//! The isel stepper controllers IMC4, IMC4-M and iMC-M/-MP/-S8, and the interface cards before them.
//!
//! A [`Controller`] is a [`Device`](vimc4_device::Device): bytes, signals and times go in,
//! bytes, events and times come out. Inside, data flows one way: a module uses only those that
//! come before it here.
//!
//! * `axes`, `wiring`, `model`, `settings`, `program`, `flash`, `activity` and `state` hold the
//!   data; `firmware` is the state with its outbox;
//! * `switches` and `ports` are the controller's connections to the machine;
//! * `why` has reasons, `words` puts them into words for people, `answers` and `report` are for the
//!   host;
//! * `moves` and `reference` run the axes, `halting` ends that early;
//! * `admission` decides whether a command may be executed, and which error wins if not;
//! * `storing`, `command` and `selftest` execute commands, `running` the stored program;
//! * `dispatch` is the life of a command: what moves, halts or runs a program returns an `outcome`,
//!   and what follows from it is decided there;
//! * `receive` takes bytes from the line and acts on 253, 254 and 255, `panel` reacts to buttons,
//!   switches and the supply;
//! * `view`, `forecast` and `ignored` only observe; `controller` is all of it as a device, and
//!   `knowledge` is what a client knows of a controller.
//!
//! A model of controller is data, see [`Model`].
#![forbid(unsafe_code)]

mod activity;
mod admission;
mod answers;
mod axes;
mod command;
mod controller;
mod course;
mod dispatch;
mod firmware;
mod flash;
mod forecast;
mod halting;
mod ignored;
mod knowledge;
mod mishaps;
mod model;
mod moves;
mod outcome;
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
mod view;
mod why;
mod wiring;
mod words;

pub use controller::Controller;
pub use flash::{Flash, FlashError};
pub use model::{
    AfterFree, AxisCodes, BitValues, BranchBase, CapitalD, CommandSet, ControlReply, Defaults,
    FlashProfile, LeaveSwitch, LimitBits, LimitLatch, Limits, LineProfile, LoneEnd, LoopCount,
    LowerCase, Model, Place, PositionAxes, Quirks, RestingSpeed, SelfTestEnd, SpeedOf3d,
    StartAtRest, StopButton, StopInMoveUntil, StopInReference, StopReply, StoreOver, StoredArcs,
    Texts, Timing, Unreferenced,
};
pub use program::{Program, StoredLine, Validity};
pub use settings::Settings;
pub use state::State;
pub use view::{Details, Interpolation, LoopView, NoMotion, ProgramStatus, ProgramView};
pub use vimc4_isel_wire::Plane;
pub use wiring::{InputBits, Output, Outputs, Ports, Wire};
