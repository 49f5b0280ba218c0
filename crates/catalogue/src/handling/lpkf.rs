//! What a client knows of LPKF's controllers.

use std::time::Duration;

use vimc4_device::Point;
use vimc4_lpkf::CommandSet;
use vimc4_lpkf::language::{
    Command, Dialect, Grammar, Item, Reader, Status, numbers, parse, why_refused,
};

use super::{Effects, Handling, Piece, Turn};
use crate::Model;

pub(super) fn handling(model: Model, inner: &vimc4_lpkf::Model) -> Handling {
    let right = "CR and ; do: printf 'PU;', or in socat crnl behind the address, as in \
                 ./vimc4.pty,rawer,crnl";
    Handling {
        model,
        ends: b"\r\n;",
        instead_of_line_feed: (!inner.grammar().line_feed_ends).then_some((b"\r;", right)),
        // The `!` also completes whatever has been begun.
        halt: b"!CC;!CB;",
        halting: "the commands that wait were taken away, but nothing on the line stops a command \
                  that runs: it goes on to its end, unless somebody presses the stop at the machine",
        warning: "Ctrl-C ends this and takes away the commands that wait; one that runs goes on to \
                  its end: only a stop at the machine ends it before.",
        abandon: b"!CC;!CI;!CB;!GO;",
        // Whatever is open is closed, whatever waits is forgotten, a stop is lifted; then `IN`
        // is obeyed. What comes with it may be lost.
        reset: b"!CC;!CI;!CB;!GO;IN;",
        // `IN` ends the echo mode on some machines. And it blocks the external stop, which is all that
        // stops a machine that moves.
        ready: &["!CT1", "!ES1"],
        homing: Some("`PA0,0;`, or `!IS;` for a reference run"),
        boot: Duration::ZERO,
        running: Duration::from_secs(60),
        position: "!ON0",
        names: &["OS"],
        done: b"C\r",
        speeds: &[9_600, 4_800, 57_600],
        erase: &[],
        fill: &[],
        start_resumes: false,
        start: &[],
    }
}

/// `P19100,9000,0`, a line of its own, and in the echo mode another with `C`.
pub(super) fn read_position(answer: &[u8]) -> Option<Vec<i64>> {
    let text = std::str::from_utf8(answer).ok()?;
    let line = text.strip_suffix("\rC\r").or_else(|| text.strip_suffix('\r'))?;
    let places = line.strip_prefix('P')?.split(',').map(|place| place.trim().parse().ok());
    places.collect()
}

/// A command has said all with `C` or a status, `IN` of an SMCU with `Z`; `!OC` says nothing.
pub(super) fn is_whole(sent: &[u8], answer: &[u8]) -> bool {
    let sent = sent.trim_ascii_start();
    if sent.starts_with(b"!OC") || sent.starts_with(b"IN") && answer.ends_with(b"Z") {
        return true;
    }
    let mut lines = answer.split_inclusive(|byte| *byte == b'\r');
    lines.any(|line| line.ends_with(b"\r") && matches!(line.first(), Some(b'C' | b'E')))
}

/// Only the speed of an SMCU's X and Y is set, which is always one of linear axes; all others go
/// at the speed of after power-on.
pub(super) fn moving(model: &vimc4_lpkf::Model, by: Point, speed: u64) -> Vec<String> {
    let [x, y, rest @ ..] = by;
    let along = (2..).zip(rest).filter(|(_, way)| *way != 0);
    let plane = format!("PR{x},{y}");
    match model.command_set {
        CommandSet::Smcu => {
            // Steps a second become µm a second with the resolution after power-on.
            let speed = u128::from(speed) * u128::from(model.defaults.resolution_pm) / 1_000_000;
            let speed = speed.clamp(10, u128::from(model.limits.speed_max));
            let z = along.map(|(_, way)| format!("!ZR{way}"));
            [format!("!VU{speed}"), plane].into_iter().chain(z).collect()
        }
        CommandSet::MotionSystem => {
            let others = along.map(|(axis, way)| format!("!ZR{way},{axis}"));
            [plane].into_iter().chain(others).collect()
        }
    }
}

pub(super) fn stream(model: &vimc4_lpkf::Model, file: &[u8]) -> Vec<Piece> {
    let grammar = model.grammar();
    let mut reader = Reader::new(grammar);
    let mut pieces = Vec::new();
    let piece = |command, bytes| Piece { bytes, command, numbers: 0, lower_case: false };
    let ignored = |bytes: std::ops::Range<usize>| {
        let numbers = file.get(bytes.clone()).map_or(0, |bytes| numbers(bytes).count());
        let lower_case = file.get(bytes.start).is_some_and(u8::is_ascii_lowercase);
        Piece { bytes, command: false, numbers, lower_case }
    };
    // Where what has not been completed yet begins.
    let mut begun = None;
    // Where numbers without a command begin. They are sent, so that the controller can say so.
    let mut stray = None;
    for (at, &byte) in file.iter().enumerate() {
        let mut complete = false;
        let mut through = false;
        let was_open = reader.channel_open();
        reader.feed(byte, |item| match item {
            Item::Through(_) => through = true,
            Item::Command { .. } | Item::TooLong => complete = true,
        });
        let pending = !reader.pending().is_empty();
        let lower_case = stray.is_none()
            && !was_open
            && reader.is_idle()
            && is_lower_case(&file[..at], &file[at..], grammar);
        if reader.take_stray() || lower_case {
            stray.get_or_insert(at);
        }
        let ends = matches!(byte, b'\r' | b';') || byte == b'\n' && grammar.line_feed_ends;
        if pending || ends {
            pieces.extend(stray.take().map(|start| ignored(start..at)));
        }
        if was_open {
            // A line for the unit on the second channel, until the channel is closed.
            let start = *begun.get_or_insert(at);
            if !reader.channel_open() {
                let close = at + 1 - reader.pending().len();
                pieces.extend((start < close).then(|| piece(false, start..close)));
                begun = Some(close);
            } else if through && matches!(byte, b'\r' | b';') {
                pieces.push(piece(false, start..at + 1));
                begun = None;
            }
        } else if complete {
            // The byte is its last one, or the first of the next.
            let end = if pending { at } else { at + 1 };
            pieces.extend(begun.map(|start| piece(true, start..end)));
            begun = pending.then_some(at);
        } else if reader.pending().len() == 1 {
            // A sign or a point before it was a beginning of nothing.
            begun = Some(at);
        } else if !pending {
            begun = None;
        }
    }
    pieces.extend(stray.map(|start| ignored(start..file.len())));
    let command = !reader.channel_open();
    // The end of the file ends what has been begun, if that is anything.
    let mut complete = !command;
    reader.read(b';', |_| complete = true);
    pieces.extend(begun.filter(|_| complete).map(|start| piece(command, start..file.len())));
    pieces
}

/// Whether a statement begins here that is commands but for its lower-case letters.
fn is_lower_case(before: &[u8], rest: &[u8], grammar: Grammar) -> bool {
    let begins = rest.first().is_some_and(u8::is_ascii_lowercase)
        && matches!(
            before.iter().rfind(|byte| !matches!(byte, b' ' | b'\t')),
            None | Some(b';' | b'\r' | b'\n')
        );
    let end = |byte: &u8| matches!(byte, b';' | b'\r' | b'\n');
    let known = |word: &[u8]| {
        let (pairs, odd) = word.as_chunks::<2>();
        let known = |pair: &[u8; 2]| {
            pair.iter().all(u8::is_ascii_lowercase)
                && parse(&pair.to_ascii_uppercase(), grammar) != Err(Status::UnknownCommand)
        };
        odd.is_empty() && pairs.iter().all(known)
    };
    begins && {
        let statement = rest.split(end).next().unwrap_or_default();
        statement.split(|byte| !byte.is_ascii_alphabetic()).all(known)
    }
}

pub(super) fn turn(model: &vimc4_lpkf::Model, command: &[u8]) -> Turn {
    // Numbers by themselves, and those of unknown commands, may be moves.
    match Reader::new(model.grammar()).understand(command) {
        Err(Status::UnknownCommand) => Turn::Unknown,
        Ok(command) if command.is_direct() => Turn::Overtakes,
        _ => Turn::InOrder,
    }
}

pub(super) fn known_with(model: &vimc4_lpkf::Model, command: &[u8]) -> Option<&'static str> {
    let unknown = |grammar: Grammar| parse(command, grammar) == Err(Status::UnknownCommand);
    let own = model.grammar();
    let others = [
        (Grammar { shapes: true, ..own }, "shapes = true under [language]"),
        (Grammar { reads_ports: true, ..own }, "read_port = true under [language]"),
        (Grammar { space_moves: true, ..own }, "ta = \"move\" under [quirks]"),
    ];
    let known = others.into_iter().find(|(other, _)| unknown(own) && !unknown(*other));
    known.map(|(_, value)| value)
}

pub(super) fn effects_of(sent: &[u8]) -> Effects {
    let mut effects = Effects::default();
    let mut passed = Vec::new();
    for dialect in Dialect::ALL {
        // Pairs after a command, also an unknown one, may be taken for moves.
        let mut reader =
            Reader::new(Grammar { bare_pairs: true, unknown_pairs: true, ..dialect.into() });
        passed.clear();
        for byte in sent.iter().chain(b";") {
            reader.feed(*byte, |item| match item {
                Item::Command { command: Ok(command), .. } => effects.of_command(&command),
                Item::Command { .. } | Item::TooLong => {}
                Item::Through(byte) => passed.push(byte),
            });
        }
    }
    if passed.is_empty() {
        return effects;
    }
    // Nobody knows what is connected there. And a channel that was not opened after all, or that
    // is closed by a loss of power, passes nothing: then these are commands.
    effects.outputs = true;
    effects.and(effects_of(&passed))
}

impl Effects {
    /// Adds those of one command. What a controller refuses has none.
    fn of_command(&mut self, command: &Command) {
        let head = matches!(command, Command::PenDown | Command::PenUp);
        self.moves |= head || command.moves();
        self.reference |= command.seeks_switches();
        self.outputs |= command.switches_outputs();
    }
}

/// An answer begins with its kind; of a status the whole code is one.
pub(super) fn kind_of(answer: &[u8]) -> Option<String> {
    let answer = answer.strip_suffix(b"\r").unwrap_or(answer);
    let code = if answer.starts_with(b"E") { answer } else { answer.get(..1)? };
    Some(String::from_utf8_lossy(code).into_owned())
}

pub(super) fn refusal(answer: &[u8]) -> Option<String> {
    let code = kind_of(answer).filter(|code| code.starts_with('E'))?;
    let written = |status: &Status| {
        Dialect::ALL.into_iter().any(|dialect| {
            [false, true]
                .into_iter()
                .any(|decimal| status.written(dialect, decimal).is_some_and(|text| text == code))
        })
    };
    Some(match Status::ALL.iter().find(|status| written(status)) {
        Some(status) => format!("{code}: {}", status.meaning()),
        None => code,
    })
}

/// The same for a command that is known: its bytes may say more than the status.
pub(super) fn refusal_of(
    model: &vimc4_lpkf::Model,
    command: &[u8],
    answer: &[u8],
) -> Option<String> {
    let refusal = refusal(answer)?;
    let status = Reader::new(model.grammar()).understand(command).err();
    let code = status.and_then(|status| Some((refusal.strip_suffix(status.meaning())?, status)));
    Some(match code {
        Some((code, status)) => format!("{code}{}", why_refused(command, model.grammar(), status)),
        None => refusal,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn builtin(name: &str) -> std::sync::Arc<vimc4_lpkf::Model> {
        vimc4_lpkf::Model::builtin(name).unwrap()
    }

    #[test]
    fn positions_are_read_as_they_are_answered() {
        assert_eq!(read_position(b"P19100,-9000,0\rC\r"), Some(vec![19_100, -9_000, 0]));
        assert_eq!(read_position(b"P1,2,3,4,5,6\r"), Some(vec![1, 2, 3, 4, 5, 6]));
        for wrong in [&b"C\r"[..], b"P1,2", b"P1,2\rC\rP1,2\rC\r", b"E0D\r", b"", b"Z"] {
            assert_eq!(read_position(wrong), None, "{}", wrong.escape_ascii());
        }
    }

    #[test]
    fn effects_follow_from_the_commands() {
        let of = |text: &str| effects_of(text.as_bytes());
        assert_eq!(of("!ON0;OS;VS5000;!ST;IN;"), Effects::default());
        assert!(of("PA1,2").moves && of("PU").outputs && of("OH;").reference);
        assert!(of("!PH0,1\rX5\r;").moves && of("!MR1,1,1,1,1,1;").moves);
        assert!(of("!OC;!SV5\r!CC;").outputs && !of("!OC;!CC;").outputs);
        assert!(of("!OC;!SV5\rPA5,5").moves && !of("!OC;!SV5\r").moves);
        assert!(of("!EM1;!ZR5;").outputs && of("!ZR5;").moves);
        assert!(!of("!EM1;!WR1,2;").writes_flash);
    }

    #[test]
    fn a_stream_is_taken_apart_at_its_commands() {
        let pieces = |text: &str, command| {
            let pieces = stream(&builtin("smcu"), text.as_bytes()).into_iter();
            let pieces = pieces.filter(|piece| piece.command == command);
            pieces.map(|piece| text[piece.bytes].to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(
            pieces("\nIN;PA 1,2PD;\r\n PA3,4\rPU", true),
            ["IN", "PA 1,2", "PD", "PA3,4\r", "PU"]
        );
        let channel = "!OC;!SV5\r!RM1\r!CC;PA1,2";
        assert_eq!(pieces(channel, true), ["!OC;", "!CC;", "PA1,2"]);
        assert_eq!(pieces(channel, false), ["!SV5\r", "!RM1\r"]);
        assert_eq!(pieces(" ; \r\n", true), Vec::<String>::new());
        let stray = "PU 10,20;PD 30PA1,1;5";
        assert_eq!(pieces(stray, true), ["PU", "PD", "PA1,1;"]);
        assert_eq!(pieces(stray, false), ["10,20", "30", "5"]);
    }

    #[test]
    fn numbers_without_a_command_are_counted() {
        let numbers = |text: &str| {
            let pieces = stream(&builtin("smcu"), text.as_bytes()).into_iter();
            pieces.map(|piece| piece.numbers).filter(|numbers| *numbers > 0).collect::<Vec<_>>()
        };
        assert_eq!(numbers("PU 10,20;PD-1.5,.5 30PA1,1;5"), [2, 3, 1]);
        assert_eq!(numbers("PA1,2,3;!OC;5;!CC;IN;"), Vec::<usize>::new());
    }

    #[test]
    fn some_commands_overtake_others_and_some_are_none() {
        let smcu = builtin("smcu");
        for (command, of) in [
            ("PA1,2", Turn::InOrder),
            ("PA1", Turn::InOrder),
            ("!GO", Turn::Overtakes),
            ("!ST", Turn::Overtakes),
            ("!RP", Turn::Unknown),
            ("SP1", Turn::Unknown),
            ("1,2", Turn::InOrder),
        ] {
            assert_eq!(turn(&smcu, command.as_bytes()), of, "{command}");
        }
        assert_eq!(turn(&builtin("motionsystem"), b"!RP"), Turn::Overtakes);
        assert_eq!(known_with(&smcu, b"CI5"), Some("shapes = true under [language]"));
        assert_eq!(known_with(&smcu, b"!RD0"), Some("read_port = true under [language]"));
        for command in ["PA1,2", "SP1", "!RP"] {
            assert_eq!(known_with(&smcu, command.as_bytes()), None, "{command}");
        }
    }

    #[test]
    fn the_way_back_is_made_of_relative_moves() {
        let smcu = builtin("smcu");
        assert_eq!(moving(&smcu, [5, -3, 0, 0, 0, 0], 1_000), ["!VU7937", "PR5,-3"]);
        assert_eq!(moving(&smcu, [0, 0, -9, 0, 0, 0], 1_000), ["!VU7937", "PR0,0", "!ZR-9"]);
        assert_eq!(
            moving(&builtin("motionsystem"), [0, 0, 7, 0, -2, 0], 1),
            ["PR0,0", "!ZR7,2", "!ZR-2,4"]
        );
    }

    #[test]
    fn an_answer_is_whole_with_its_completion() {
        for (sent, answer, whole) in [
            ("PA1,2;", "", false),
            ("PA1,2;", "C\r", true),
            ("!ON0;", "P1,2,3\r", false),
            ("!ON0;", "P1,2,3\rC\r", true),
            ("PA1,2;", "E08\r", true),
            ("PA1,2;", "8\r", false),
            ("IN;", "Z", true),
            ("IN;", "C\r", true),
            ("!OC;", "", true),
        ] {
            assert_eq!(is_whole(sent.as_bytes(), answer.as_bytes()), whole, "{sent} {answer}");
        }
    }

    #[test]
    fn an_answer_says_what_is_wrong() {
        assert_eq!(refusal(b"C\r"), None);
        assert_eq!(refusal(b"P1,2,3\r"), None);
        assert!(refusal(b"E0D\r").unwrap().starts_with("E0D: "));
        assert!(refusal(b"E185\r").unwrap().starts_with("E185: "));
        assert_eq!(kind_of(b"E0D\r").unwrap(), "E0D");
        assert_eq!(kind_of(b"W1,2,3\r").unwrap(), "W");
    }
}
