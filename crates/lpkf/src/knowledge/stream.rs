//! Files are streams of commands, regardless of line ends.

use vimc4_device::Piece;

use crate::Model;
use crate::language::{Grammar, Item, Reader, Status, numbers, parse};

/// The pieces of a file, in order.
pub(super) fn pieces(model: &Model, file: &[u8]) -> Vec<Piece> {
    let grammar = model.grammar();
    let mut reader = Reader::new(grammar);
    let mut pieces = Vec::new();
    let piece = |command, bytes| Piece { bytes, command, numbers: 0, lower_case: false };
    let ignored = |bytes: std::ops::Range<usize>| {
        let numbers = file.get(bytes.clone()).map_or(0, |bytes| numbers(bytes).count());
        let lower_case = file.get(bytes.start).is_some_and(u8::is_ascii_lowercase);
        Piece { bytes, command: false, numbers, lower_case }
    };
    // Where the incomplete part begins.
    let mut begun = None;
    // Where numbers without a command begin. They are sent, so that the controller can report them.
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
            // A sign or a point before it began nothing.
            begun = Some(at);
        } else if !pending {
            begun = None;
        }
    }
    pieces.extend(stray.map(|start| ignored(start..file.len())));
    let command = !reader.channel_open();
    // The end of the file ends an incomplete command.
    let mut complete = !command;
    reader.read(b';', |_| complete = true);
    pieces.extend(begun.filter(|_| complete).map(|start| piece(command, start..file.len())));
    pieces
}

/// Whether a statement begins here that would be commands but for its lower-case letters.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_is_taken_apart_at_its_commands() {
        let pieces = |text: &str, command| {
            let pieces =
                super::pieces(&Model::builtin("smcu").unwrap(), text.as_bytes()).into_iter();
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
            let pieces =
                super::pieces(&Model::builtin("smcu").unwrap(), text.as_bytes()).into_iter();
            pieces.map(|piece| piece.numbers).filter(|numbers| *numbers > 0).collect::<Vec<_>>()
        };
        assert_eq!(numbers("PU 10,20;PD-1.5,.5 30PA1,1;5"), [2, 3, 1]);
        assert_eq!(numbers("PA1,2,3;!OC;5;!CC;IN;"), Vec::<usize>::new());
    }
}
