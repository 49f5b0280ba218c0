//! Foldable parts.

use std::ops::Range;

use super::{Symbol, outline};
use crate::language::{Instruction, TextLine, lines, parse};

/// Lines that can be shown as one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fold {
    /// All of them, in bytes from the beginning of the text, without the end of the last.
    pub range: Range<usize>,
    /// Whether they are comments.
    pub is_comment: bool,
}

/// The parts of a job that have more than one line: its sections, cuts and holes, the lines between
/// PATH and PATHEND, and comments.
#[must_use]
pub fn folds(text: &str) -> Vec<Fold> {
    let mut folds = Vec::new();
    sections(text, &outline(text), &mut folds);
    let mut path = None;
    let mut comment: Option<(Range<usize>, usize)> = None;
    let end_comment = |comment: &mut Option<(Range<usize>, usize)>| {
        let many = comment.take().filter(|(_, count)| *count > 1);
        many.map(|(range, _)| Fold { range, is_comment: true })
    };
    for line in lines(text) {
        let read = parse(line.text, &mut |_, _| {});
        let range = line.offset..line.offset + line.text.len();
        match (read.command.map(|command| command.value), read.comment) {
            (None, Some(_)) if is_only_comment(&line) => {
                let (all, count) = comment.get_or_insert((range.clone(), 0));
                all.end = range.end;
                *count += 1;
                continue;
            }
            (Some(Instruction::Path), _) => path = Some(range.start),
            (Some(Instruction::PathEnd), _) => folds.extend(
                path.take().map(|start| Fold { range: start..range.end, is_comment: false }),
            ),
            _ => {}
        }
        folds.extend(end_comment(&mut comment));
        if read.command.is_some_and(|command| command.value == Instruction::End) {
            break;
        }
    }
    folds.extend(end_comment(&mut comment));
    folds.sort_by_key(|fold| (fold.range.start, fold.range.end));
    folds
}

fn is_only_comment(line: &TextLine<'_>) -> bool {
    line.text.trim_start().starts_with(';')
}

fn sections(text: &str, symbols: &[Symbol], folds: &mut Vec<Fold>) {
    for Symbol { range, children, .. } in symbols {
        if text.get(range.clone()).is_some_and(|part| part.contains('\n')) {
            folds.push(Fold { range: range.clone(), is_comment: false });
        }
        sections(text, children, folds);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first and the last line of each fold, and whether it is a comment.
    fn folded(text: &str) -> Vec<(usize, usize, bool)> {
        let line = |at: usize| text[..at].matches('\n').count() + 1;
        let shown = |fold: Fold| (line(fold.range.start), line(fold.range.end), fold.is_comment);
        folds(text).into_iter().map(shown).collect()
    }

    #[test]
    fn sections_cuts_comments_and_paths() {
        let job = "\
IMF_PBL
; A part
; made of brass
REF XYZ
FASTABS X5
PATH
MOVEABS X1
MOVEABS X2
PATHEND
HALT
PROGEND
; one
; two
";
        assert_eq!(
            folded(job),
            [(2, 3, false), (2, 3, true), (4, 9, false), (6, 9, false), (7, 8, false)]
        );
    }

    #[test]
    fn a_line_alone_is_not_folded() {
        assert_eq!(folded("; x\nMOVEABS X1\nPATHEND\n"), [(1, 3, false)], "all of it is below x");
        assert_eq!(folded("MOVEABS X1"), []);
        assert_eq!(folded(""), []);
    }
}
