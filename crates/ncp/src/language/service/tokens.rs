//! The kinds of the pieces of a job, for editors that colour them.

use std::ops::Range;

use super::Here;
use crate::language::reader::Reader;
use crate::language::reference::{self, Form};
use crate::language::{Instruction, Span, lines, parse, token};

/// A piece of a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextToken {
    /// Where it is, in bytes from the beginning of the text; always within a line.
    pub range: Range<usize>,
    /// What it is.
    pub kind: TokenKind,
}

/// What a piece of a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TokenKind {
    /// The number of a line, with its N.
    LineNumber,
    /// The name of a command.
    Command,
    /// The letters of a word.
    Word,
    /// A number, or the value of a port.
    Number,
    /// Text that a command takes as it is.
    Text,
    /// A comment, and everything after the end of the job.
    Comment,
}

impl TokenKind {
    /// All of them, in the order of their declaration.
    pub const ALL: [TokenKind; 6] = [
        TokenKind::LineNumber,
        TokenKind::Command,
        TokenKind::Word,
        TokenKind::Number,
        TokenKind::Text,
        TokenKind::Comment,
    ];
}

/// The pieces of the lines that touch a range of bytes, in order. Pieces of lines that are no
/// command are none.
#[must_use]
pub fn tokens(text: &str, within: Range<usize>) -> Vec<TextToken> {
    let mut tokens = Vec::new();
    let mut ended = false;
    for line in lines(text).take_while(|line| line.offset <= within.end) {
        let here = Here { offset: line.offset, line: line.text };
        let in_sight = line.offset + line.text.len() >= within.start;
        match (in_sight, ended) {
            (true, true) => push(&mut tokens, here, whole(line.text), TokenKind::Comment),
            (true, false) => of_line(here, &mut tokens),
            (false, _) => {}
        }
        ended |= parse(line.text, &mut |_, _| {})
            .command
            .is_some_and(|command| command.value == Instruction::End);
    }
    tokens
}

fn whole(line: &str) -> Span {
    let start = (line.len() - line.trim_start().len()) as u32;
    Span { start, end: (line.trim_end().len() as u32).max(start) }
}

fn push(tokens: &mut Vec<TextToken>, here: Here<'_>, span: Span, kind: TokenKind) {
    if span.end > span.start {
        tokens.push(TextToken { range: here.in_text(span), kind });
    }
}

fn of_line(here: Here<'_>, tokens: &mut Vec<TextToken>) {
    let mut nobody = |_, _| {};
    let mut reader = Reader::new(here.line, &mut nobody);
    let mut push = |span, kind| push(tokens, here, span, kind);
    reader.ends();
    if let Some(number) = reader.take(token::line_number) {
        push(number.span, TokenKind::LineNumber);
    }
    reader.ends();
    let name = reader.take(token::name);
    if let Some((name, info)) = name.and_then(|name| Some((name, reference::find(name.value)?))) {
        push(name.span, TokenKind::Command);
        match info.form {
            Form::Anything(Instruction::End) => drop(reader.pass_over()),
            Form::Anything(_) => {
                let start = reader.place();
                let end = here.line.trim_end().len() as u32;
                reader.pass_over_all();
                push(Span { start, end }, TokenKind::Text);
            }
            _ => words(&mut reader, info.parameters.is_empty(), &mut push),
        }
    } else {
        reader.pass_over();
    }
    let start = reader.place();
    if !reader.rest().is_empty() {
        push(Span { start, end: here.line.trim_end().len() as u32 }, TokenKind::Comment);
    }
}

/// The words of a command; behind a port a letter may be a digit or a base.
fn words(reader: &mut Reader<'_, '_>, of_port: bool, push: &mut impl FnMut(Span, TokenKind)) {
    while !reader.ends() {
        if of_port && reader.take(token::equals).is_some() {
            if let Some(value) = reader.take(token::port_value) {
                push(value.span, TokenKind::Number);
            }
        } else if let Some(letters) = reader.take(token::letters) {
            push(letters.span, TokenKind::Word);
        } else if let Some(number) = reader.take(token::numeral) {
            push(number.span, TokenKind::Number);
        } else {
            reader.take(token::punctuation);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::jobs;
    use super::*;

    fn shown(text: &str) -> Vec<String> {
        let tokens = tokens(text, 0..text.len()).into_iter();
        tokens.map(|token| format!("{:?} {}", token.kind, &text[token.range])).collect()
    }

    #[test]
    fn pieces_are_what_they_are() {
        assert_eq!(
            shown("IMF_PBL_V1.0 a job\nN5 moveabs X-5.5Y 7 ; ä \n"),
            [
                "Command IMF_PBL_V",
                "Text 1.0 a job",
                "LineNumber N5",
                "Command moveabs",
                "Word X",
                "Number -5.5",
                "Word Y",
                "Number 7",
                "Comment ; ä",
            ]
        );
        assert_eq!(
            shown("SETPORT A1=F2H\nLIMIT X0,5\nWPREG1ACT"),
            [
                "Command SETPORT",
                "Word A",
                "Number 1",
                "Number F2H",
                "Command LIMIT",
                "Word X",
                "Number 0",
                "Number 5",
                "Command WPREG",
                "Number 1",
                "Word ACT",
            ]
        );
        assert_eq!(
            shown("(what) X5 ; x\nPROGEND ; y\nREF X"),
            ["Comment ; x", "Command PROGEND", "Comment ; y", "Comment REF X",]
        );
    }

    #[test]
    fn they_are_in_order_and_within_their_lines() {
        for job in jobs() {
            let tokens = tokens(job, 0..job.len());
            assert!(tokens.windows(2).all(|pair| pair[0].range.end <= pair[1].range.start));
            assert!(tokens.iter().all(|token| !job[token.range.clone()].contains('\n')));
        }
    }

    #[test]
    fn a_part_has_the_tokens_of_its_lines() {
        let text = "HALT\nREF X\nPROGEND\nHALT\n";
        assert_eq!(tokens(text, 5..7).len(), 2);
        let last = tokens(text, 19..20);
        assert_eq!((last.len(), last[0].kind), (1, TokenKind::Comment));
    }

    #[test]
    fn every_kind_has_its_place() {
        for (place, kind) in TokenKind::ALL.into_iter().enumerate() {
            assert_eq!(kind as usize, place);
        }
    }
}
