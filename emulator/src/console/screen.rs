//! The full screen.

mod brush;
mod dots;
mod draw;
mod face;
mod ink;
mod keys;
mod path;
mod picture;
mod svg;

pub(crate) use face::{Leaving, as_svg, check, leave, run};
pub(crate) use path::Stroke;
pub(crate) use picture::{Picture, Reply, ReplyKind, Side, Talk, TimeLine};
