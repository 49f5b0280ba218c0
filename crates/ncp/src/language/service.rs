//! What editors ask of a job file: what is this, what may stand here, what is where.
//!
//! Places are bytes from the beginning of the text; one beyond its end, or within a character,
//! counts as the nearest before it.

mod complete;
mod hover;
mod outline;

use std::ops::Range;

use super::command::{Placed, Span};
use super::reader::Reader;
use super::reference::{self, CommandInfo};
use super::token;

pub use complete::{Completion, complete};
pub use hover::{Hover, hover};
pub use outline::{Symbol, SymbolKind, outline};

/// A line and where it begins in its text.
#[derive(Clone, Copy)]
struct Here<'t> {
    offset: usize,
    line: &'t str,
}

/// A command that is looked at word by word, be it right or not.
struct Anatomy<'t> {
    info: &'static CommandInfo,
    name: Span,
    words: Vec<LooseWord<'t>>,
    /// Where its comment begins, or the line ends.
    end: u32,
}

/// Letters, and the number behind them if there is one.
struct LooseWord<'t> {
    letters: Placed<&'t str>,
    number: Option<&'t str>,
    span: Span,
}

impl<'t> Here<'t> {
    /// The line at a place, and the place in it.
    fn at(text: &'t str, offset: usize) -> (Here<'t>, usize) {
        let offset = (0..=offset.min(text.len())).rev().find(|at| text.is_char_boundary(*at));
        let (before, after) = text.split_at(offset.unwrap_or_default());
        let start = before.rfind('\n').map_or(0, |end| end + 1);
        let end = before.len() + after.find('\n').unwrap_or(after.len());
        let line = text.get(start..end).unwrap_or_default().trim_end_matches('\r');
        (Here { offset: start, line }, (before.len() - start).min(line.len()))
    }

    /// Where a part of the line is in the text.
    fn in_text(self, span: Span) -> Range<usize> {
        let Range { start, end } = span.range();
        self.offset + start..self.offset + end
    }

    /// The command of the line, if its name is known.
    fn anatomy(self) -> Option<Anatomy<'t>> {
        // What is wrong with it is told elsewhere.
        let mut nobody = |_, _| {};
        let mut reader = Reader::new(self.line, &mut nobody);
        reader.ends();
        reader.take(token::line_number);
        reader.ends();
        let name = reader.take(token::name)?;
        let info = reference::find(name.value)?;
        let mut words = Vec::new();
        while !reader.ends() {
            let Some(letters) = reader.take(token::letters) else {
                reader.take(token::no_letters);
                continue;
            };
            let number = reader.take(token::next_numeral);
            let span = reader.since(letters.span);
            words.push(LooseWord { letters, number: number.map(|number| number.value), span });
        }
        Some(Anatomy { info, name: name.span, words, end: reader.place() })
    }
}
