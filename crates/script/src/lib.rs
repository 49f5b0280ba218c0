//! Files that a host carries out: the lines of a file that mean something, and what is done for each.

#![forbid(unsafe_code)]

use vimc4_catalogue::Handling;
use vimc4_device::escape;
use vimc4_ncp::language::{BYTE_ORDER_MARK, decode, meant};

mod escapes;
mod packed;
mod readable;
mod sort;
mod work;
pub use readable::readable;
pub use sort::{could_be_job, is_job, suits};

use sort::BEGINNINGS;
pub use work::{Host, number, said, storing, takes_jobs, target, told};

/// A file of commands.
#[derive(Debug, PartialEq, Eq)]
pub struct Script {
    /// What it holds.
    pub kind: Kind,
    /// At least one, and none that is blank.
    pub lines: Vec<ScriptLine>,
    /// The axes that a comment says a data field is for, as `@0` takes them.
    pub axes: Option<u8>,
    /// The model that a comment says it is for.
    pub model: Option<String>,
    /// The machine that a comment says it is for.
    pub machine: Option<String>,
}

/// What a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Commands as a host sends them, which is how it begins: `@07`.
    Commands,
    /// A data field: the lines of a program, without what stores it.
    DataField,
    /// A stream of commands, as it goes over the line.
    Stream,
}

/// One line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScriptLine {
    /// Its number in the file, from 1. What the file does not say but was sent nevertheless has
    /// none.
    pub number: Option<usize>,
    /// What is sent, without its end.
    pub bytes: Vec<u8>,
    /// The end.
    pub end: u8,
    /// Whether it is a command; else it passes through the controller to what is behind it, or is
    /// nothing but numbers.
    pub command: bool,
    /// How many numbers it has that belong to no command and mean nothing.
    pub numbers: usize,
    /// Whether it would be a command in capital letters.
    pub lower_case: bool,
    /// The escape sequence, with which HPGL sets up a plotter's line, that some of it is of, as it
    /// can be shown.
    pub escape: Option<String>,
}

impl ScriptLine {
    /// A line that is in no file.
    pub fn added(text: &str) -> ScriptLine {
        ScriptLine::read(None, text.as_bytes())
    }

    fn read(number: Option<usize>, text: &[u8]) -> ScriptLine {
        ScriptLine {
            number,
            bytes: text.to_vec(),
            end: b'\r',
            command: true,
            numbers: 0,
            lower_case: false,
            escape: None,
        }
    }

    /// All that is sent.
    pub fn whole(&self) -> Vec<u8> {
        [self.bytes.as_slice(), &[self.end]].concat()
    }

    /// How many bytes that is.
    pub fn length(&self) -> usize {
        self.bytes.len() + 1
    }

    /// Whether it has this text, blanks left out.
    pub fn is(&self, text: &str) -> bool {
        self.bytes.iter().filter(|&&byte| byte != b' ').eq(text.as_bytes())
    }

    /// Its text, as it can be shown.
    pub fn text(&self) -> String {
        escape(&self.bytes)
    }
}

impl Script {
    /// The script in a file of this name, for a controller that is handled so.
    ///
    /// # Errors
    ///
    /// Why there is none in it, as a sentence.
    pub fn of(name: &str, bytes: &[u8], handling: &Handling) -> Result<Script, String> {
        suits(name, bytes, handling)?;
        readable(name, bytes, handling)?;
        let script = match Script::stream(bytes, handling) {
            Some(script) if script.lines.is_empty() => {
                Err("a stream of commands has some such as PA1000,2000;")
            }
            Some(script) => Ok(script),
            None => {
                let text = decode(bytes);
                if let Some(word) =
                    sort::first(&text).and_then(sort::word).filter(|_| !is_job(bytes))
                {
                    let meant = meant(word).map(|meant| format!("perhaps {meant} is meant; "));
                    return Err(format!(
                        "{name} begins with {word}, which no file for the {} does; {}{BEGINNINGS}",
                        handling.model().name(),
                        meant.unwrap_or_default()
                    ));
                }
                Script::parse(bytes).ok_or(BEGINNINGS)
            }
        };
        script.map_err(|right| format!("{name} holds no command; {right}"))
    }

    /// Takes a stream of commands apart, if files are streams.
    pub fn stream(bytes: &[u8], handling: &Handling) -> Option<Script> {
        let (mut number, mut counted) = (1, 0);
        let mut escapes = escapes::plotters(bytes).into_iter().peekable();
        let pieces = handling.stream(bytes)?.into_iter().map(|piece| {
            number += breaks(bytes.get(counted..piece.bytes.start).unwrap_or_default());
            counted = piece.bytes.start;
            while escapes.next_if(|escape| escape.end <= piece.bytes.start).is_some() {}
            let escape = escapes.peek().filter(|escape| escape.start < piece.bytes.end);
            let escape =
                escape.and_then(|escape| bytes.get(escape.clone())).map(vimc4_device::escape);
            let (text, end) = match bytes.get(piece.bytes).unwrap_or_default() {
                [text @ .., end @ (b';' | b'\r')] => (text, *end),
                text => (text, b';'),
            };
            // Blanks and ends of lines at the end mean nothing, but to what is behind it.
            let text = if piece.command { text.trim_ascii_end() } else { text };
            let line = ScriptLine::read(Some(number), text);
            let (numbers, lower_case) = (piece.numbers, piece.lower_case);
            ScriptLine { end, command: piece.command, numbers, lower_case, escape, ..line }
        });
        Some(Script {
            lines: pieces.collect(),
            kind: Kind::Stream,
            axes: None,
            model: None,
            machine: None,
        })
    }

    /// Takes text apart. Lines end with LF, CR LF or CR; blank lines, and lines that begin with
    /// `;` or `#`, which no command does, mean nothing. There is nothing in it either if no line
    /// says anything behind its escape sequences.
    pub fn parse(bytes: &[u8]) -> Option<Script> {
        let bytes = bytes.strip_prefix(BYTE_ORDER_MARK.as_bytes()).unwrap_or(bytes);
        let bytes = before_end_mark(bytes);
        let mut lines = Vec::new();
        let (mut axes, mut model, mut machine) = (None, None, None);
        for (number, line) in (1..).zip(split(bytes)) {
            match line.iter().find(|byte| !matches!(byte, b' ' | b'\t')) {
                None => {}
                Some(b';' | b'#') => {
                    axes = axes.or_else(|| axes_of(remark(line, "axes:")?));
                    model = model.or_else(|| remark(line, "model:").map(str::to_owned));
                    machine = machine.or_else(|| remark(line, "machine:").map(str::to_owned));
                }
                Some(_) => lines.push(ScriptLine::read(Some(number), line)),
            }
        }
        let text = decode(bytes);
        let kind = match sort::first(&text)? {
            first if first.starts_with('@') => Kind::Commands,
            first if first.trim_end() == "9" => return None,
            _ => Kind::DataField,
        };
        Some(Script { kind, lines, axes, model, machine })
    }

    /// Whether it begins as the lines of a program do: one character, and numbers behind it.
    pub fn looks_stored(&self) -> bool {
        self.lines.first().is_some_and(|line| sort::is_stored(&decode(&line.bytes)))
    }
}

/// What a comment such as `; machine: mill` says of this.
fn remark<'a>(comment: &'a [u8], what: &str) -> Option<&'a str> {
    let text = str::from_utf8(comment).ok()?.trim().trim_start_matches([';', '#']).trim_start();
    Some(text.strip_prefix(what)?.trim_start()).filter(|value| !value.is_empty())
}

/// The axes in `15 (X, Y, Z, A)`.
fn axes_of(value: &str) -> Option<u8> {
    let digits = value.bytes().take_while(u8::is_ascii_digit).count();
    let axes = value.get(..digits)?.parse().ok()?;
    matches!(axes, 1 | 3 | 7 | 8 | 9 | 11 | 15).then_some(axes)
}

/// How many lines end in a text, however they do.
fn breaks(text: &[u8]) -> usize {
    let next = text.iter().skip(1).map(Some).chain([None]);
    let ends = text.iter().zip(next);
    ends.filter(|(byte, next)| **byte == b'\n' || **byte == b'\r' && *next != Some(&b'\n')).count()
}

/// A text without the Ctrl-Z that old systems end it with, and what fills it up behind that.
pub(crate) fn before_end_mark(text: &[u8]) -> &[u8] {
    let is_end = |byte: &u8| matches!(byte, 0 | 0x1A | b'\r' | b'\n');
    let end = text.iter().rposition(|byte| !is_end(byte)).map_or(0, |last| last + 1);
    let filled = text.iter().skip(end).position(|byte| *byte == 0x1A);
    filled.and_then(|mark| text.get(..end + mark)).unwrap_or(text)
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
    fn the_end_mark_of_old_systems_ends_it() {
        let handling = Handling::of(&vimc4_catalogue::model("imc4").unwrap());
        for (text, kind) in [("@07\n@0P", Kind::Commands), ("71\n9", Kind::DataField)] {
            for end in [
                "\x1A",
                "\n\x1A",
                "\r\n\x1A\x1A",
                "\n\x1A\r\n",
                &format!("\x1A{}", "\0".repeat(99)),
            ] {
                let script = Script::of("x", format!("{text}{end}").as_bytes(), &handling).unwrap();
                let lines: Vec<String> = script.lines.iter().map(ScriptLine::text).collect();
                assert_eq!((script.kind, lines.join("\n")), (kind, text.to_owned()), "{end:?}");
            }
        }
        // It ends nothing where more follows, and NULs alone are none.
        assert_eq!(before_end_mark(b"@07\x1A\n@0P\0\n"), b"@07\x1A\n@0P\0\n");
    }

    #[test]
    fn a_stream_is_its_commands_wherever_they_stand() {
        let handling = Handling::of(&vimc4_catalogue::model("smcu").unwrap());
        let stream = |text: &[u8]| {
            let script = Script::stream(text, &handling).unwrap();
            let whole = |line: &ScriptLine| String::from_utf8(line.whole()).unwrap();
            script.lines.iter().map(|l| (l.number.unwrap(), whole(l))).collect::<Vec<_>>()
        };
        assert_eq!(
            stream(b"IN;PA1,2PD\r\n\r\nPU;\n!OC;!SV5\r!CC;"),
            lines([
                (1, "IN;"),
                (1, "PA1,2;"),
                (1, "PD;"),
                (3, "PU;"),
                (4, "!OC;"),
                (4, "!SV5\r"),
                (5, "!CC;"),
            ])
        );
        assert_eq!(stream(b"\n ; \n"), []);
        let isel = Handling::of(&vimc4_catalogue::model("imc4").unwrap());
        assert_eq!(Script::stream(b"@07\n", &isel), None);
    }

    #[test]
    fn escape_sequences_are_told_from_commands() {
        let handling = Handling::of(&vimc4_catalogue::model("smcu").unwrap());
        let escapes = |text: &[u8]| {
            let script = Script::stream(text, &handling).unwrap();
            script
                .lines
                .into_iter()
                .map(|line| (line.text(), line.escape.is_some()))
                .collect::<Vec<_>>()
        };
        let found = escapes(b"\x1B.(;IN;\x1B.@;0:PA1,2;\x1B.YPD;\x1B.I81;;17:PU;");
        for known in ["IN", "PA1,2", "PU"] {
            assert!(found.contains(&(known.to_owned(), false)), "{known} {found:?}");
        }
        assert!(found.iter().any(|(text, escape)| text.starts_with('Y') && *escape), "{found:?}");
        assert!(found.iter().filter(|(_, escape)| *escape).count() >= 2, "{found:?}");
    }

    #[test]
    fn the_first_command_says_what_it_is() {
        for before in ["\x1BE", "\x1B%1B", "\x1B[31m", "\x1B%-12345X@PJL JOB\n", "@PJL\r\n"] {
            let kind = |text| parse(format!("{before}{text}").as_bytes()).map(|(kind, _)| kind);
            assert_eq!(kind("@07"), Some(Kind::Commands), "{before:?}");
            assert_eq!(kind("71\n9"), Some(Kind::DataField), "{before:?}");
            assert_eq!(kind(""), None, "{before:?}");
        }
        assert_eq!(parse(b"71\n9\n"), Some((Kind::DataField, lines([(1, "71"), (2, "9")]))));
        assert_eq!(parse(b" @07").map(|(kind, _)| kind), Some(Kind::Commands));
        for nothing in [&b""[..], b"\n\r\n", b"; nothing", b"9\n", b" 9 "] {
            assert_eq!(parse(nothing), None, "{nothing:?}");
        }
    }
}
