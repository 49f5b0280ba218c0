//! A debugger of controllers: step by step over their history, forward and back, and why.
//!
//! A [`Debugger`] stands at a moment of a [`History`](vimc4_timeline::History). From there it goes
//! forward and back by any unit ([`Unit`]), to breakpoints ([`Trigger`]), or to where a condition
//! held; it shows everything that is visible ([`Variable`], [`Frame`], [`Listing`]), explains what
//! led to something ([`Chain`]), and what would have followed from a change ([`Parting`]).
//!
//! Everything exists in two forms: as a method that returns a type, for programs, and as a line
//! that people type, for [`Debugger::execute`]. The lines come from one [`TABLE`], and so do help
//! and completion. Nothing here knows a clock, a thread or a screen.
#![forbid(unsafe_code)]

mod ahead;
mod answer;
mod breakpoint;
mod complete;
mod debugger;
mod differences;
mod error;
mod execute;
mod expression;
mod feed;
mod field;
mod look;
mod navigate;
mod reading;
mod recorded;
mod recurrence;
mod reel;
mod source;
mod steps;
mod stop;
mod story;
mod table;
mod types;
mod unit;
mod unmet;
mod walk;
mod whatif;
mod why;
mod wired;

pub use answer::{Answer, Watched, Where};
pub use breakpoint::{Breakpoint, Hits, Note, Options, Trigger};
pub use complete::{Candidate, Completion};
pub use debugger::{Bookmark, Debugger, uninterrupted};
pub use differences::{Difference, Replies};
pub use error::{CANCELLED, DebugError, Remedy};
pub use execute::{script, span};
pub use expression::Expression;
pub use feed::{Feed, Piece, Refused};
pub use field::{Field, Variable};
pub use look::{Frame, FrameKind, ListedLine, Listing, MotionView, RampPhase, Register};
pub use reel::{Read, Recorded, Reel};
pub use source::Source;
pub use stop::{Executing, FileLine, Reason, Stop};
pub use story::{Deeds, Told};
pub use table::{Directive, Follows, Group, TABLE};
pub use types::in_words;
pub use unit::{Depth, Unit, Way};
pub use vimc4_session::BreakpointId;
pub use whatif::{Apart, Differing, Parting, WhatIf};
pub use why::{About, Chain, Change, Explanation, ExplanationKind};
pub use wired::Wired;
