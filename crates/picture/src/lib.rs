//! Pictures of what a controller did.
//!
//! A [`Plot`] sees the events of a controller and keeps its motions and what happened on the way. A
//! [`Picture`] of it is drawn from several sides, or over time, as SVG or PNG; [`gcode()`] and [`dxf()`]
//! write the path for other programs. Nothing goes step by step: a motion is a line or an arc, and what is
//! smaller than a pixel is left out.
//!
//! The same plot gives the same bytes on every computer: nothing but whole and IEEE numbers is
//! computed with, and texts in dots have a font of their own.
//!
//! Units: places in steps until they are drawn, then in the unit of their axis; times in nanoseconds.
//!
//! ```
//! use vimc4_device::{Event, Motion, Time};
//! use vimc4_motion::{Path, Profile, Segment, StraightLine};
//! use vimc4_picture::{Axis, Colouring, Frame, Picture, Plot};
//!
//! let mut plot = Plot::new();
//! let path = Path::Line(StraightLine::new([800, 400, 0, 0, 0, 0]));
//! let segment = Box::new(Segment { path, profile: Profile::constant(800, 1_000) });
//! plot.see(Time::ZERO, &Event::Motion(Motion::Begins { origin: [0; 6], segment }));
//! plot.see(Time::from_millis(800), &Event::Motion(Motion::Ends { steps: 800 }));
//!
//! let frame = Frame { title: "a line".into(), axes: ["X", "Y"].map(Axis::in_steps).into() };
//! let picture = Picture::of(&plot, &frame, Picture::best_views(&plot), Colouring::Kind);
//! assert!(picture.svg().contains("class=\"feed\""));
//! ```
#![forbid(unsafe_code)]

mod dxf;
mod font;
mod frame;
mod gcode;
mod graphs;
mod leg;
mod path;
mod picture;
mod pieces;
mod plot;
mod png;
mod scene;
mod svg;
mod ticks;
mod view;

pub use dxf::dxf;
pub use frame::{Axis, Frame};
pub use gcode::gcode;
pub use leg::{Leg, Purpose, Vertex, Way};
pub use picture::Picture;
pub use plot::{Back, Mark, MarkKind, Plot};
pub use view::{Colouring, View};
