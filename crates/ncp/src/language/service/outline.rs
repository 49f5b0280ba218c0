//! The outline of a job.

use std::ops::Range;

use crate::language::{Instruction, JobLine, Placed, Rate, TextLine, lines, parse};

/// A part of a job that people look for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Symbol {
    /// What it is called.
    pub name: String,
    /// What it is.
    pub kind: SymbolKind,
    /// All of it, in bytes from the beginning of the text.
    pub range: Range<usize>,
    /// The line it begins with, likewise.
    pub selection: Range<usize>,
    /// The parts of it.
    pub children: Vec<Symbol>,
}

/// What a part of a job is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SymbolKind {
    /// What follows a comment that has lines of its own.
    Heading,
    /// What follows a change of the tool.
    Tool,
    /// What follows reference runs.
    Reference,
    /// What follows a new work-piece zero.
    Zero,
    /// What follows a stop for the operator.
    Halt,
    /// Moves at the normal speed, arcs and helices, up to the next rapid move.
    Cut,
    /// Holes that are drilled one after the other.
    Holes,
}

/// The parts of a job up to `PROGEND`, in their order. Sections, which last until the next, have
/// cuts and holes as their parts; those before the first section are parts of the job itself.
#[must_use]
pub fn outline(text: &str) -> Vec<Symbol> {
    let mut outline = Outline::default();
    for line in lines(text) {
        // Problems with it are reported elsewhere.
        let read = parse(line.text, &mut |_, _| {});
        if read.command.is_some_and(|command| command.value == Instruction::End) {
            break;
        }
        outline.line(&line, &read);
    }
    outline.symbols
}

#[derive(Default)]
struct Outline {
    symbols: Vec<Symbol>,
    /// The cut or the holes that go on, and how many moves or holes they have.
    group: Option<(SymbolKind, usize)>,
    /// Whether the heading above goes on.
    in_comment: bool,
}

impl Outline {
    fn line(&mut self, line: &TextLine<'_>, read: &JobLine<'_>) {
        let end = line.offset + line.text.len();
        let heading = read.comment.filter(|_| read.command.is_none());
        // Lines such as `;-----` frame a heading.
        let words = heading.filter(|comment| comment.contains(char::is_alphanumeric));
        match (read.command, words) {
            (Some(command), _) => self.command(line, command),
            (None, Some(words)) if !self.in_comment => {
                self.section(line, SymbolKind::Heading, words.to_owned());
            }
            _ => {}
        }
        self.in_comment = words.is_some() || self.in_comment && heading.is_some();
        if let Some(section) = self.symbols.last_mut().filter(|symbol| symbol.kind.is_section()) {
            section.range.end = end;
        }
    }

    fn command(&mut self, line: &TextLine<'_>, command: Placed<Instruction>) {
        let kind = match command.value {
            Instruction::Move(_, Rate::Normal, _) | Instruction::Arc { .. } => {
                return self.member(line, SymbolKind::Cut);
            }
            Instruction::Drill(_) => return self.member(line, SymbolKind::Holes),
            Instruction::Move(_, Rate::Rapid, _) | Instruction::DrillDefinition(_) => {
                self.group = None;
                return;
            }
            Instruction::Tool(_) => SymbolKind::Tool,
            Instruction::Reference(_) => SymbolKind::Reference,
            Instruction::Halt => SymbolKind::Halt,
            Instruction::ZeroHere
            | Instruction::ZeroAt(_)
            | Instruction::ZeroClear
            | Instruction::Recall(_)
            | Instruction::Teach => SymbolKind::Zero,
            _ => return,
        };
        self.section(line, kind, command.value.to_string());
    }

    fn section(&mut self, line: &TextLine<'_>, kind: SymbolKind, name: String) {
        self.group = None;
        let range = line.offset..line.offset + line.text.len();
        let selection = range.clone();
        self.symbols.push(Symbol { name, kind, range, selection, children: Vec::new() });
    }

    /// A move of a cut, or a hole: continues the present part if that is of the same kind,
    /// otherwise begins one.
    fn member(&mut self, line: &TextLine<'_>, kind: SymbolKind) {
        let range = line.offset..line.offset + line.text.len();
        let section = self.symbols.last_mut().filter(|symbol| symbol.kind.is_section());
        let place = match section {
            Some(section) => &mut section.children,
            None => &mut self.symbols,
        };
        let count = match self.group {
            Some((known, count)) if known == kind => count + 1,
            _ => 1,
        };
        self.group = Some((kind, count));
        if count == 1 {
            let selection = range.clone();
            let name = String::new();
            place.push(Symbol {
                name,
                kind,
                range: range.clone(),
                selection,
                children: Vec::new(),
            });
        }
        if let Some(symbol) = place.last_mut() {
            symbol.name = kind.counted(count);
            symbol.range.end = range.end;
        }
    }
}

impl SymbolKind {
    fn is_section(self) -> bool {
        !matches!(self, SymbolKind::Cut | SymbolKind::Holes)
    }

    fn counted(self, count: usize) -> String {
        match (self, count) {
            (SymbolKind::Holes, 1) => "1 hole".to_owned(),
            (SymbolKind::Holes, _) => format!("{count} holes"),
            (_, 1) => "cut, 1 move".to_owned(),
            (..) => format!("cut, {count} moves"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The names of the parts, those of sections indented, and the lines that they span.
    fn listed(text: &str) -> Vec<String> {
        fn list(text: &str, symbols: &[Symbol], indent: &str, into: &mut Vec<String>) {
            for symbol in symbols {
                let line = |at: usize| text[..at].matches('\n').count() + 1;
                let Range { start, end } = symbol.range;
                assert!(symbol.selection.start == start && symbol.selection.end <= end);
                into.push(format!("{indent}{} {}-{}", symbol.name, line(start), line(end)));
                list(text, &symbol.children, "  ", into);
            }
        }
        let mut list_of_all = Vec::new();
        list(text, &outline(text), "", &mut list_of_all);
        list_of_all
    }

    #[test]
    fn sections_have_cuts_and_holes() {
        let job = "\
IMF_PBL_V1.0
VEL 500
MOVEABS X5
FASTABS X0
;-------
; Outline
;
; of the part
FASTABS X1
MOVEABS Z5
VEL 800
CWABS I5
;
FASTABS Z0
MOVEREL X1
N7 GETTOOL 3 ; drill
DRILLDEF D5000
DRILL X1
DRILL X2

DRILL X3
DRILLDEF D6000
DRILL X4
REF XYZ
PROGEND
REF X";
        assert_eq!(
            listed(job),
            [
                "cut, 1 move 3-3",
                "Outline 6-15",
                "  cut, 2 moves 10-12",
                "  cut, 1 move 15-15",
                "GETTOOL 3 16-23",
                "  3 holes 18-21",
                "  1 hole 23-23",
                "REF XYZ 24-24",
            ]
        );
    }

    #[test]
    fn every_kind_of_section_begins_one() {
        let text =
            "REF Z X\nWPZERO\nWPZEROABS X5\nWPCLEAR\nWPREG1ACT\nWPTEACH\nHALT\nGETTOOL 1\n;x";
        assert_eq!(listed(text).len(), 9);
        let kinds: Vec<_> = outline(text).into_iter().map(|symbol| symbol.kind).collect();
        assert_eq!(
            (kinds[0], kinds[1], kinds[6]),
            (SymbolKind::Reference, SymbolKind::Zero, SymbolKind::Halt)
        );
        assert_eq!((kinds[7], kinds[8]), (SymbolKind::Tool, SymbolKind::Heading));
    }

    #[test]
    fn a_cut_ends_with_its_section() {
        assert_eq!(
            listed("MOVEABS X1\nHALT\nMOVEABS X2\nDRILL X3\nMOVEABS X4"),
            [
                "cut, 1 move 1-1",
                "HALT 2-5",
                "  cut, 1 move 3-3",
                "  1 hole 4-4",
                "  cut, 1 move 5-5"
            ]
        );
        assert_eq!(listed(""), <[String; 0]>::default());
    }
}
