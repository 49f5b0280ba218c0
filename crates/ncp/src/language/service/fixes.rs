//! Fixes that can be applied without thinking.

use std::ops::Range;

use crate::language::reference::WHOLE_MARK;
use crate::language::{Instruction, Problem, g_code, lines, parse};

/// A change that mends a problem.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fix {
    /// What it does, for people.
    pub title: String,
    /// The code of the problem that it mends.
    pub code: &'static str,
    /// Where the problem is, in bytes from the beginning of the text.
    pub about: Range<usize>,
    /// What is replaced, likewise.
    pub replaces: Range<usize>,
    /// The new text.
    pub with: String,
    /// Whether it is the most likely fix.
    pub is_likely: bool,
}

/// Fixes for the lines that touch a range of bytes.
#[must_use]
pub fn fixes(text: &str, within: Range<usize>) -> Vec<Fix> {
    let mut fixes = Vec::new();
    // G-code becomes no job line by line.
    if g_code(text).is_some() {
        return fixes;
    }
    let reached = lines(text).take_while(|line| line.offset <= within.end);
    for line in reached.filter(|line| line.offset + line.text.len() >= within.start) {
        let read = parse(line.text, &mut |span, problem| {
            fixes.extend(fix(line.in_text(span), problem));
        });
        if read.command.is_some_and(|command| command.value == Instruction::End) {
            break;
        }
    }
    if within.start == 0 && lacks_mark(text) {
        fixes.push(Fix {
            title: "Mark the file as a job".to_owned(),
            code: crate::job::Problem::MarkMissing.code(),
            about: 0..0,
            replaces: 0..0,
            with: format!("{WHOLE_MARK}{}", line_end(text)),
            is_likely: true,
        });
    }
    fixes
}

fn fix(about: Range<usize>, problem: Problem) -> Option<Fix> {
    let start = about.start;
    let meant = problem.meant();
    let is_likely = meant.is_some();
    let (title, replaces, with) = match (problem, meant) {
        (_, Some(meant)) => (format!("Write {meant}"), about.clone(), meant),
        (Problem::Unexpected(written), _) if written.as_str() == "," => {
            ("Write a point".to_owned(), about.clone(), ".".to_owned())
        }
        (Problem::NoCommand | Problem::BracketComment | Problem::UnknownCommand(_), _) => {
            ("Make it a comment".to_owned(), start..start, "; ".to_owned())
        }
        (Problem::Unexpected(_) | Problem::Surplus(_), _) => {
            ("Make the rest a comment".to_owned(), start..start, "; ".to_owned())
        }
        _ => return None,
    };
    Some(Fix { title, code: problem.code(), about, replaces, with, is_likely })
}

/// How the first line of a text ends, and with it all others.
fn line_end(text: &str) -> &'static str {
    let end = text.trim_start_matches(|c| !matches!(c, '\r' | '\n'));
    ["\r\n", "\r"].into_iter().find(|known| end.starts_with(known)).unwrap_or("\n")
}

/// Whether no line up to the end of the job is the mark.
fn lacks_mark(text: &str) -> bool {
    let mut commands = lines(text).filter_map(|line| parse(line.text, &mut |_, _| {}).command);
    let found = commands.find(|found| matches!(found.value, Instruction::Mark | Instruction::End));
    found.is_none_or(|found| found.value == Instruction::End)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The text after each fix.
    fn mended(text: &str) -> Vec<String> {
        let fixes = fixes(text, 0..text.len()).into_iter();
        let apply = |fix: Fix| {
            let mut text = text.to_owned();
            text.replace_range(fix.replaces, &fix.with);
            text
        };
        fixes.map(apply).collect()
    }

    #[test]
    fn what_is_meant_is_written() {
        assert_eq!(mended("IMF_PBL\nN5 movabs X5 ; x\n"), ["IMF_PBL\nN5 MOVEABS X5 ; x\n"]);
        let fixes = fixes("IMF_PBL\nMOVABS X5", 8..8);
        assert_eq!((fixes[0].title.as_str(), fixes[0].code), ("Write MOVEABS", "unknown-command"));
        assert!(fixes[0].is_likely);
    }

    #[test]
    fn text_becomes_a_comment() {
        assert_eq!(mended("IMF_PBL\n(Steps: 64)\n"), ["IMF_PBL\n; (Steps: 64)\n"]);
        assert_eq!(mended("IMF_PBL\nWerkzeug 3\n"), ["IMF_PBL\n; Werkzeug 3\n"]);
        assert_eq!(mended("IMF_PBL\nHALT turn it\n"), ["IMF_PBL\nHALT ; turn it\n"]);
    }

    #[test]
    fn g_code_is_not_mended() {
        assert_eq!(mended("G21\nG0 X5 Y5\nG1 Z-1 F100\n"), <[String; 0]>::default());
    }

    #[test]
    fn the_mark_is_put_in() {
        assert_eq!(mended("REF X\n"), ["IMF_PBL_V1.0\nREF X\n"]);
        assert_eq!(mended("REF X"), ["IMF_PBL_V1.0\nREF X"]);
        assert_eq!(mended("REF X\r\nREF Y\n"), ["IMF_PBL_V1.0\r\nREF X\r\nREF Y\n"]);
        assert_eq!(mended("REF X\rREF Y\n"), ["IMF_PBL_V1.0\rREF X\rREF Y\n"]);
        assert_eq!(mended("REF X\r"), ["IMF_PBL_V1.0\rREF X\r"]);
        assert_eq!(mended("REF X\nREF Y\r\n"), ["IMF_PBL_V1.0\nREF X\nREF Y\r\n"]);
        assert_eq!(mended("REF X\nPROGEND\nIMF_PBL\n").len(), 1);
        assert_eq!(mended("; x\nIMF_PBL_V1\n"), <[String; 0]>::default());
    }

    #[test]
    fn only_lines_within_are_mended_and_none_behind_the_end() {
        let text = "IMF_PBL\n(a)\n(b)\nPROGEND\n(c)\n";
        assert_eq!(fixes(text, 0..text.len()).len(), 2);
        assert_eq!(fixes(text, 12..12).len(), 1);
        assert_eq!(fixes(text, 9..13).len(), 2);
    }

    /// Every problem that says "perhaps … is meant" has a fix, and the fix mends it.
    #[test]
    fn every_guess_can_be_taken() {
        for written in ["REEF X", "movabs X5", "FASTREAL Z5", "PRGEND", "SPINDEL ON"] {
            let mut told = Vec::new();
            parse(written, &mut |_, problem| told.push(problem.help().unwrap_or_default()));
            let guessed = told.iter().any(|help| help.starts_with("perhaps "));
            assert!(guessed, "{written} {told:?}");
            let text = format!("IMF_PBL\n{written}");
            let mended = mended(&text).remove(0);
            let mut left = 0;
            for line in lines(&mended) {
                parse(line.text, &mut |_, _| left += 1);
            }
            assert_eq!(left, 0, "{mended}");
        }
    }
}
