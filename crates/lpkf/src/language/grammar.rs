//! How a controller reads: its dialect, and the differences between machines that speak it.

use serde::{Deserialize, Serialize};

use super::dialect::Dialect;
use super::table::{Form, Op};

/// How a controller reads the bytes of the line.
///
/// A plain dialect has all the forms of any of its machines, and none of their peculiarities:
/// `Grammar::from(Dialect::Smcu)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Grammar {
    /// Its command set.
    pub dialect: Dialect,
    /// Numbers outside a command are a move: relative if the last move was one, absolute at first
    /// and after `IN`. They end like a command.
    pub bare_pairs: bool,
    /// The numbers of an unknown command are such a move, as far as they are pairs.
    pub unknown_pairs: bool,
    /// LF ends a command, as CR does.
    pub line_feed_ends: bool,
    /// It has `CI`, `EA` and `ER`.
    pub shapes: bool,
    /// It has `!TA` and `!TR`.
    pub space_moves: bool,
    /// An SMCU has `!RD`.
    pub reads_ports: bool,
}

impl From<Dialect> for Grammar {
    fn from(dialect: Dialect) -> Self {
        Self {
            dialect,
            bare_pairs: false,
            unknown_pairs: false,
            line_feed_ends: false,
            shapes: true,
            space_moves: true,
            reads_ports: true,
        }
    }
}

impl Grammar {
    /// Whether a controller with this grammar has a form.
    #[must_use]
    pub fn knows(&self, form: &Form) -> bool {
        form.known_to(self.dialect)
            && match form.op {
                Op::Circle | Op::EdgeAbsolute | Op::EdgeRelative => self.shapes,
                Op::SpaceAbsolute | Op::SpaceRelative => self.space_moves,
                Op::ReadPort => self.reads_ports || self.dialect == Dialect::MotionSystem,
                _ => true,
            }
    }
}
