//! Any input gives something sensible and never a panic.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

use super::{feed, print};
use crate::language::{COMMAND_MAX, Dialect, Grammar, Item, Reader, parse};

/// Pieces of commands, so that some of the garbage nearly is one.
fn piece() -> impl Strategy<Value = Vec<u8>> {
    const LETTERS: &str = "AA AR IN IW OH OS PA PD PR PU VS !AS !CC !CI !CM !CS !CT !ES !EM !FP \
                           !GB !HP !IS !MA !MR !OA !OC !OI !ON !PH !RD !RC !RS !SR !TD !TM !TS \
                           !TW !VZ !VA !VU !WR !ZA !ZR !CB !GO !RP !ST !TA !TR CI EA ER OH: ! !C P pa !XX";
    const NUMBERS: &str = "0 1 -1 +7 5 6 100 106 255 256 2147483648 -99999999999999999999 0.005 .5 \
                           5. - .";
    const RECORDS: &str = "X1 Y-2 I3 J F O1 O-1";
    const SEPARATORS: [&str; 7] = [";", "\r", "\n", "\0", ",", " ", "\u{e4}"];
    let words = |words: &'static str| select(words.split(' ').collect::<Vec<_>>());
    let piece = prop_oneof![
        4 => words(LETTERS),
        4 => words(NUMBERS),
        1 => words(RECORDS),
        3 => select(SEPARATORS.to_vec()),
    ];
    prop_oneof![8 => piece.prop_map(|piece| piece.as_bytes().to_vec()), 1 => vec(any::<u8>(), 0..4)]
}

/// Every way to read.
fn grammar() -> impl Strategy<Value = Grammar> {
    (select(Dialect::ALL.to_vec()), any::<[bool; 6]>()).prop_map(|(dialect, on)| {
        let [bare_pairs, unknown_pairs, line_feed_ends, shapes, space_moves, reads_ports] = on;
        Grammar {
            dialect,
            bare_pairs,
            unknown_pairs,
            line_feed_ends,
            shapes,
            space_moves,
            reads_ports,
        }
    })
}

fn garbage() -> impl Strategy<Value = Vec<u8>> {
    vec(piece(), 0..60).prop_map(|pieces| pieces.concat())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_stream_of_bytes_is_too_strange(
        bytes in garbage(),
        grammar in grammar(),
    ) {
        let model = grammar.dialect;
        let mut reader = Reader::new(grammar);
        for &byte in &bytes {
            let mut items = Vec::new();
            reader.feed(byte, |item| items.push(item));
            prop_assert!(items.len() <= 3);
            for item in items {
                let Item::Command { raw, command } = item else { continue };
                prop_assert!(!raw.is_empty());
                prop_assert!(!raw.contains(&b';'), "{}", raw.escape_ascii());
                match command {
                    // What was understood can be printed again.
                    Ok(command) => {
                        prop_assert!(grammar.knows(command.form()));
                        prop_assert!(!command.describe().is_empty());
                        prop_assert_eq!(parse(&print(&command), grammar), Ok(command));
                    }
                    Err(status) => prop_assert!(status.known_to(model)),
                }
            }
        }
        // Two ends complete anything that was begun, except in the second channel.
        feed(&mut reader, b";;");
        prop_assert!(reader.is_idle() || reader.channel_open());
    }

    #[test]
    fn a_line_may_be_saved_and_restored_anywhere(
        bytes in garbage(),
        grammar in grammar(),
        cut in any::<prop::sample::Index>(),
    ) {
        let (before, after) = bytes.split_at(cut.index(bytes.len() + 1));
        let mut reader = Reader::new(grammar);
        let mut whole = reader.clone();
        let all = feed(&mut whole, &bytes);

        let mut items = feed(&mut reader, before);
        let saved = serde_json::to_string(&reader).unwrap();
        let mut restored: Reader = serde_json::from_str(&saved).unwrap();
        prop_assert_eq!(&restored, &reader);
        items.extend(feed(&mut restored, after));
        prop_assert_eq!(items, all);
        prop_assert_eq!(restored, whole);
    }

    #[test]
    fn parsing_alone_takes_anything(
        bytes in prop_oneof![garbage(), vec(any::<u8>(), 0..50)],
        grammar in grammar(),
    ) {
        if let Err(status) = parse(&bytes, grammar) {
            prop_assert!(status.known_to(grammar.dialect));
        }
    }
}

#[test]
fn memory_is_bounded() {
    for begin in ["PA", "!PH0,1\r", "XX", "!TA"] {
        let mut reader = Reader::new(Dialect::MotionSystem);
        feed(&mut reader, begin.as_bytes());
        for _ in 0..COMMAND_MAX {
            assert_eq!(feed(&mut reader, b"1, "), []);
            assert!(reader.pending().len() <= COMMAND_MAX);
        }
    }
}
