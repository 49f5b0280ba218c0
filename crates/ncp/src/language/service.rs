//! Services for editors of job files: what is this, what may stand here, what is where.
//!
//! Places are bytes from the beginning of the text; one beyond its end, or within a character,
//! counts as the nearest before it.

mod complete;
mod fixes;
mod folds;
mod format;
mod hints;
mod hover;
mod mentions;
mod outline;
mod tokens;

use std::ops::Range;

use vimc4_isel_wire::AxisSet;

use super::command::{Placed, Span};
use super::reader::Reader;
use super::reference::{self, CommandInfo, Form, Parameter};
use super::token;

pub use complete::{Completion, complete};
pub use fixes::{Fix, fixes};
pub use folds::{Fold, folds};
pub use format::{Edit, format};
pub use hints::{Hint, hints};
pub use hover::{Hover, hover};
pub use mentions::{definitions, references};
pub use outline::{Symbol, SymbolKind, outline};
pub use tokens::{TextToken, TokenKind, tokens};

/// The properties of the target on which explanations depend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Context {
    /// The axes that the machine has.
    pub axes: AxisSet,
    /// Those that turn.
    pub rotary: AxisSet,
    /// The lengths of DRILLDEF are mm.
    pub drill_in_mm: bool,
}

impl Context {
    /// Whether a word means something on this machine: it does not if its axis is not there.
    fn has(self, info: &CommandInfo, parameter: &Parameter) -> bool {
        info.axis(parameter).is_none_or(|axis| self.axes.has(axis))
    }

    /// How a command is written for the axes of this machine.
    fn pattern(self, info: &CommandInfo) -> String {
        let pattern = info.pattern();
        let fits = |word: &&str| {
            let named = |parameter: &&Parameter| {
                let word = word.strip_prefix('[').unwrap_or_default();
                word.strip_prefix(parameter.name).is_some_and(|rest| rest.starts_with('n'))
            };
            info.parameters.iter().find(named).is_none_or(|found| self.has(info, found))
        };
        pattern.split(' ').filter(fits).collect::<Vec<_>>().join(" ")
    }
}

/// A line and where it begins in its text.
#[derive(Clone, Copy)]
struct Here<'t> {
    offset: usize,
    line: &'t str,
}

/// A command that is read word by word, correct or not.
struct Anatomy<'t> {
    info: &'static CommandInfo,
    name: Span,
    words: Vec<LooseWord<'t>>,
    /// Where its comment begins, or the line ends.
    end: u32,
}

/// Letters, and the number after them if there is one.
struct LooseWord<'t> {
    letters: Placed<&'t str>,
    number: Option<&'t str>,
    /// The second number of a limit.
    upto: Option<&'t str>,
    span: Span,
}

impl Anatomy<'_> {
    /// What stands behind the name in this line, its line.
    fn behind_name<'t>(&self, line: &'t str) -> Placed<&'t str> {
        let behind = line.get(self.name.end as usize..self.end as usize).unwrap_or_default();
        let value = behind.trim_start();
        let start = self.name.end + (behind.len() - value.len()) as u32;
        let value = value.trim_end();
        Placed { value, span: Span { start, end: start + value.len() as u32 } }
    }
}

impl<'t> Here<'t> {
    /// The line at a place, and the place in it.
    fn at(text: &'t str, offset: usize) -> (Here<'t>, usize) {
        let offset = (0..=offset.min(text.len())).rev().find(|at| text.is_char_boundary(*at));
        let (before, after) = text.split_at(offset.unwrap_or_default());
        // A place between CR and LF is in the line that they end.
        let within = before.strip_suffix('\r').filter(|_| after.starts_with('\n'));
        let start = within.unwrap_or(before).rfind(['\r', '\n']).map_or(0, |end| end + 1);
        let behind = text.get(start..).unwrap_or_default();
        let end = start + behind.find(['\r', '\n']).unwrap_or(behind.len());
        let line = text.get(start..end).unwrap_or_default();
        (Here { offset: start, line }, (before.len() - start).min(line.len()))
    }

    /// Where a part of the line is in the text.
    fn in_text(self, span: Span) -> Range<usize> {
        let Range { start, end } = span.range();
        self.offset + start..self.offset + end
    }

    /// The command of the line, if its name is known.
    fn anatomy(self) -> Option<Anatomy<'t>> {
        // Problems with it are reported elsewhere.
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
            let has_two = info.form == Form::Limit && reader.take(token::comma).is_some();
            let upto = has_two.then(|| reader.take(token::numeral)).flatten();
            let upto = upto.map(|number| number.value);
            let span = reader.since(letters.span);
            words.push(LooseWord {
                letters,
                number: number.map(|number| number.value),
                upto,
                span,
            });
        }
        Some(Anatomy { info, name: name.span, words, end: reader.place() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A machine with X, Y, Z and a turning A.
    pub(super) const CONTEXT: Context = {
        let (Some(axes), Some(rotary)) = (AxisSet::from_bits(0b1111), AxisSet::from_bits(0b1000))
        else {
            panic!("these are axes")
        };
        Context { axes, rotary, drill_in_mm: false }
    };

    /// Jobs of the fixtures. Other files there have faulty lines.
    pub(super) fn jobs() -> impl Iterator<Item = &'static str> {
        const NAMES: [&str; 6] = [
            "gerbv/board.ncp",
            "reading/field.toml",
            "reading/lines.toml",
            "reading/problems.toml",
            "zero/registers.toml",
            "drilling/cycles.toml",
        ];
        NAMES.into_iter().map(|wanted| {
            let job = vimc4_fixtures::JOBS.iter().find(|(name, _)| *name == wanted);
            job.expect("a job of that name").1
        })
    }
}
