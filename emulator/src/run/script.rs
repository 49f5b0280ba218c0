//! What there is to run: the lines of a file that mean something.

use std::fs;
use std::io::{self, Read};
use std::path::Path;

use vimc4::escape;

use crate::failure::Failure;

/// A file of commands.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Script {
    pub(super) kind: Kind,
    /// At least one, and none that is blank.
    pub(super) lines: Vec<Line>,
}

/// What a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Commands as a host sends them, which is how it begins: `@07`.
    Commands,
    /// A data field: the lines of a program, without what stores it.
    DataField,
}

/// One line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Line {
    /// Its number in the file, from 1. What the file does not say but was sent nevertheless has
    /// none.
    pub(super) number: Option<usize>,
    /// What is sent, without the CR.
    pub(super) bytes: Vec<u8>,
}

impl Line {
    /// A line that is in no file.
    pub(super) fn added(text: &str) -> Line {
        Line { number: None, bytes: text.as_bytes().to_vec() }
    }

    /// Whether it has this text, blanks left out.
    pub(super) fn is(&self, text: &str) -> bool {
        self.bytes.iter().filter(|&&byte| byte != b' ').eq(text.as_bytes())
    }

    /// Its text, as it can be shown.
    pub(super) fn text(&self) -> String {
        escape(&self.bytes)
    }
}

impl Script {
    /// Reads a file; `-` is standard input.
    pub(super) fn read(path: &Path) -> Result<Script, Failure> {
        let mut bytes = Vec::new();
        let read = if path == Path::new("-") {
            io::stdin().lock().read_to_end(&mut bytes).map(drop)
        } else {
            fs::read(path).map(|all| bytes = all)
        };
        let name = path.display();
        read.map_err(|error| {
            Failure::usage(format!(
                "cannot read {name}: {error}; name a file of commands, or `-` for standard input"
            ))
        })?;
        if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
            return Err(Failure::usage(format!(
                "{name} is text in UTF-16, which no controller reads; save it as plain text or \
                 UTF-8"
            )));
        }
        Script::parse(&bytes).ok_or_else(|| {
            Failure::usage(format!(
                "{name} holds no command; a command list begins with a line such as @07, a data \
                 field with one such as 71"
            ))
        })
    }

    /// Takes text apart. Lines end with LF, CR LF or CR; blank lines, and lines that begin with
    /// `;` or `#`, which no command does, mean nothing.
    fn parse(bytes: &[u8]) -> Option<Script> {
        let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        let mut lines = Vec::new();
        for (number, line) in (1..).zip(split(bytes)) {
            match line.iter().find(|byte| !matches!(byte, b' ' | b'\t')) {
                None | Some(b';' | b'#') => {}
                Some(_) => lines.push(Line { number: Some(number), bytes: line.to_vec() }),
            }
        }
        let first = lines.first()?;
        let kind = match first.bytes.trim_ascii_start().first() {
            Some(b'@') => Kind::Commands,
            _ => Kind::DataField,
        };
        if kind == Kind::DataField && first.is("9") {
            return None;
        }
        Some(Script { kind, lines })
    }
}

/// The lines of a text, however they end.
fn split(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = text;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        let end = rest.iter().position(|byte| matches!(byte, b'\r' | b'\n')).unwrap_or(rest.len());
        let (line, after) = rest.split_at(end);
        rest = after.strip_prefix(b"\r\n").or_else(|| after.get(1..)).unwrap_or_default();
        Some(line)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &[u8]) -> Option<(Kind, Vec<(usize, String)>)> {
        let script = Script::parse(text)?;
        let lines = script.lines.iter().map(|line| (line.number.unwrap(), line.text()));
        Some((script.kind, lines.collect()))
    }

    fn lines<const N: usize>(lines: [(usize, &str); N]) -> Vec<(usize, String)> {
        lines.map(|(number, text)| (number, text.to_owned())).into()
    }

    #[test]
    fn lines_end_in_any_way_and_keep_their_numbers() {
        let expected = Some((Kind::Commands, lines([(2, "@07"), (4, " @0P")])));
        for text in [
            "; a comment\n@07\n\n @0P\n",
            "; a comment\r\n@07\r\n \t\r\n @0P",
            "# a comment\r@07\r\r @0P\r",
            "\u{FEFF}; a comment\n@07\n  # another\n @0P",
        ] {
            assert_eq!(parse(text.as_bytes()), expected, "{text:?}");
        }
    }

    #[test]
    fn the_first_command_says_what_it_is() {
        assert_eq!(parse(b"71\n9\n"), Some((Kind::DataField, lines([(1, "71"), (2, "9")]))));
        assert_eq!(parse(b" @07").map(|(kind, _)| kind), Some(Kind::Commands));
        for nothing in [&b""[..], b"\n\r\n", b"; nothing", b"9\n", b" 9 "] {
            assert_eq!(parse(nothing), None, "{nothing:?}");
        }
    }
}
