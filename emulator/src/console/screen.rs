//! The full screen.

mod backend;
mod brush;
mod dots;
mod draw;
mod face;
mod ink;
mod keys;
mod look;
mod path;
mod picture;
mod svg;

pub(crate) use face::{Leaving, check, leave, run};
pub(crate) use look::as_svg;
pub(crate) use path::Stroke;
pub(crate) use picture::{Picture, SaidKind, SaidLine, Side, Talk, TimeLine};
