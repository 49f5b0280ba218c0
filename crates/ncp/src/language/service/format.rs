//! Formatting lines in the usual style.

use std::ops::Range;

use crate::language::reader::Reader;
use crate::language::reference::{self, Form};
use crate::language::{Instruction, lines, parse, token};

/// A piece of the text that is to be replaced.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edit {
    /// In bytes from the beginning of the text.
    pub replaces: Range<usize>,
    /// The new text.
    pub with: String,
}

/// The edits that put every line of a job into the usual style: names and letters in capitals, one
/// blank between words and none within them, none at the beginning and the end of a line. Numbers,
/// comments, the order of words, and faulty lines stay as they are, so no line changes its meaning.
#[must_use]
pub fn format(text: &str) -> Vec<Edit> {
    let mut edits = Vec::new();
    for line in lines(text) {
        let Some(written) = formatted(line.text) else { continue };
        if written != line.text {
            let replaces = line.offset..line.offset + line.text.len();
            edits.push(Edit { replaces, with: written });
        }
        if parse(line.text, &mut |_, _| {}).command.is_some_and(|it| it.value == Instruction::End) {
            break;
        }
    }
    edits
}

/// A line in the usual style; `None` if it is faulty, or would change its meaning.
fn formatted(line: &str) -> Option<String> {
    let mut right = true;
    let mut meaning = |line: &str| {
        let read = parse(line, &mut |_, problem| {
            right &= problem.severity() < crate::Severity::Error;
        });
        // Without the places, which may change.
        let command = read.command.map(|command| command.value.to_string());
        (read.number, command, read.comment.map(str::to_owned))
    };
    let before = meaning(line);
    let written = written(line);
    let after = meaning(&written);
    (right && before == after).then_some(written)
}

fn written(line: &str) -> String {
    let mut nobody = |_, _| {};
    let mut reader = Reader::new(line, &mut nobody);
    let mut out = String::with_capacity(line.len() + 1);
    reader.ends();
    if let Some(number) = reader.take(token::line_number) {
        out += "N";
        out += number.value;
    }
    reader.ends();
    if let Some(name) = reader.take(token::name) {
        blank(&mut out);
        let info = reference::find(name.value);
        // The text after the mark is not a word, and belongs to it without a blank.
        if let Some(Form::Anything(_)) = info.map(|info| info.form) {
            let rest = reader.rest();
            let command = name.value.to_ascii_uppercase();
            return (out + &command + rest).trim_end().to_owned();
        }
        out += &name.value.to_ascii_uppercase();
        match info {
            Some(info) if info.parameters.is_empty() => port(&mut reader, &mut out),
            _ => words(&mut reader, &mut out, info.map(|info| info.form) == Some(Form::Register)),
        }
    }
    let comment = reader.rest();
    if !comment.is_empty() {
        blank(&mut out);
        out += comment.trim_end();
    }
    out
}

/// The words of a command.
fn words(reader: &mut Reader<'_, '_>, out: &mut String, of_register: bool) {
    // The number of a register belongs to its name.
    let mut continues = of_register;
    while !reader.ends() {
        if let Some(letters) = reader.take(token::letters) {
            if !(of_register && letters.value.eq_ignore_ascii_case("ACT")) {
                blank(out);
            }
            *out += &letters.value.to_ascii_uppercase();
            continues = true;
        } else if let Some(numeral) = reader.take(token::numeral) {
            if !continues {
                blank(out);
            }
            *out += numeral.value;
            continues = false;
        } else if let Some(other) = reader.take(token::punctuation) {
            *out += other.value;
            continues = true;
        }
    }
}

/// A port with its bit and its value, all of it one word.
fn port(reader: &mut Reader<'_, '_>, out: &mut String) {
    if !reader.ends() {
        blank(out);
        let span = reader.pass_over();
        let written = reader.text(span).chars().filter(|c| !token::is_blank(*c));
        out.extend(written.map(|c| c.to_ascii_uppercase()));
    }
}

fn blank(out: &mut String) {
    if !out.is_empty() {
        out.push(' ');
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::tests::jobs;
    use super::*;

    fn applied(text: &str) -> String {
        let mut out = text.to_owned();
        for edit in format(text).into_iter().rev() {
            out.replace_range(edit.replaces, &edit.with);
        }
        out
    }

    #[test]
    fn lines_look_the_usual_way() {
        for (line, written) in [
            (
                "  n5   moveabs  x 5 y-02500Z+1.50  ;  there  ",
                "N5 MOVEABS X5 Y-02500 Z+1.50 ;  there",
            ),
            ("ref z  xy", "REF Z XY"),
            ("wpreg 1  act", "WPREG1ACT"),
            ("wpreg1 x5", "WPREG1 X5"),
            ("WPREG1ACT", "WPREG1ACT"),
            ("vel\t500", "VEL 500"),
            ("limit x0 , 250000 y0,5", "LIMIT X0,250000 Y0,5"),
            ("setport a1 = 100101b", "SETPORT A1=100101B"),
            ("waitbit e1 . 4 == 1", "WAITBIT E1.4==1"),
            ("waitport e1==f2h", "WAITPORT E1==F2H"),
            ("spindle cw  time 2000", "SPINDLE CW TIME2000"),
            ("cyl a5000 y", "CYL A5000 Y"),
            ("imf_pbl_v1.0  My file ", "IMF_PBL_V1.0  My file"),
            ("type 3 ; x", "TYPE 3 ; x"),
            ("\t", ""),
            ("  ; alone", "; alone"),
            ("gettool 3", "GETTOOL 3"),
            ("N7", "N7"),
            // Faulty parts stay.
            ("  movabs x5", "  movabs x5"),
            ("moveabs  q5", "moveabs  q5"),
        ] {
            assert_eq!(applied(line), written, "{line}");
        }
    }

    #[test]
    fn ends_of_lines_and_what_follows_the_end_stay() {
        assert_eq!(applied("halt \r\n\r\n progend\r\n  halt"), "HALT\r\n\r\nPROGEND\r\n  halt");
    }

    #[test]
    fn it_is_done_once_and_means_the_same() {
        for job in jobs() {
            let once = applied(job);
            assert_eq!(applied(&once), once);
            assert_eq!(lines(&once).count(), lines(job).count());
            for (before, after) in lines(job).zip(lines(&once)) {
                let read = |line| {
                    let read = parse(line, &mut |_, _| {});
                    (read.number, read.command.map(|it| it.value.to_string()))
                };
                assert_eq!(read(before.text), read(after.text));
            }
        }
    }

    proptest! {
        #[test]
        fn whatever_is_there_it_is_done_once(text in "([NnMOVEABSxyzwpregact0-9 .,=;\\-]{0,24}\n){0,4}") {
            let once = applied(&text);
            prop_assert_eq!(applied(&once), once);
        }
    }
}
