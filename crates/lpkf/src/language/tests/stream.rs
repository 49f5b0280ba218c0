//! Where commands begin and end on the line.

use super::{feed, items};
use crate::language::{COMMAND_MAX, Command, Dialect, Grammar, Item, Reader, Status};

/// What arrives, in short: commands by their bytes, `?` before those that are refused, and what
/// goes through between `<` and `>`.
fn told(items: &[Item]) -> String {
    let tell = |item: &Item| match item {
        Item::Command { raw, command: Ok(_) } => raw.escape_ascii().to_string(),
        Item::Command { raw, command: Err(_) } => format!("?{}", raw.escape_ascii()),
        Item::TooLong => "too long".to_owned(),
        Item::Through(byte) => format!("<{}>", byte.escape_ascii()),
    };
    items.iter().map(tell).collect::<Vec<_>>().join("|").replace(">|<", "")
}

fn smcu(bytes: &str) -> String {
    told(&items(Dialect::Smcu, bytes.as_bytes()))
}

fn motion(bytes: &str) -> String {
    told(&items(Dialect::MotionSystem, bytes.as_bytes()))
}

#[test]
fn a_command_ends_at_its_end_or_where_the_next_begins() {
    assert_eq!(smcu("PA 1000,2000;"), "PA 1000,2000");
    assert_eq!(smcu("PA1000,2000\r"), "PA1000,2000");
    assert_eq!(smcu("PA1,2PR3,4!TS5VS6;"), "PA1,2|PR3,4|!TS5|VS6");
    assert_eq!(smcu("PA1,2"), "", "more digits could follow");
    assert_eq!(smcu("PA1,2P"), "PA1,2");
    assert_eq!(smcu("OH"), "", "the MotionSystem has an OH with an axis");
    assert_eq!(smcu("OHPD"), "OH|PD");
}

#[test]
fn a_command_that_takes_nothing_acts_at_once() {
    for command in [
        "IN", "OS", "PD", "PU", "!CI", "!CS", "!FP", "!GB", "!HP", "!RC", "!CB", "!GO", "!RP",
        "!ST",
    ] {
        for model in Dialect::ALL {
            let items = items(model, command.as_bytes());
            assert!(
                matches!(&items[..], [Item::Command { raw, .. }] if raw == command.as_bytes()),
                "{command} on {model:?}"
            );
        }
    }
    assert_eq!(smcu("PA1,2!ST"), "PA1,2|!ST");
    assert_eq!(smcu("PD;PU\rPDPU"), "PD|PU|PD|PU", "their ends end nothing");
}

#[test]
fn lf_nul_and_blanks_only_separate() {
    assert_eq!(smcu("\0\n PA\n1\0 2 \n;\r\n"), "PA\\n1\\x00 2");
    assert_eq!(
        items(Dialect::Smcu, b"PA\n1\0 2;"),
        [Item::Command {
            raw: b"PA\n1\0 2".to_vec(),
            command: Ok(Command::PlotAbsolute(vec![[1, 2]])),
        }]
    );
    assert_eq!(smcu(";;\r\r\n"), "");
}

#[test]
fn what_is_no_command_is_unknown_once() {
    assert_eq!(smcu("XX1,2;PD"), "?XX1,2|PD");
    assert_eq!(smcu("!XX;"), "?!XX");
    assert_eq!(smcu("P;PD"), "?P|PD");
    assert_eq!(smcu("P1,2;"), "?P1,2");
    assert_eq!(smcu("!5;"), "?!5");
    assert_eq!(smcu("!!ST"), "?!|!ST");
    assert_eq!(smcu("P!ST"), "?P|!ST");
    assert_eq!(smcu("! ST;"), "?!|?ST");
    // Only capital letters are letters.
    assert_eq!(smcu("pd;!st;"), "?!st");
    assert_eq!(smcu("1,2;"), "", "numbers are no command");
}

#[test]
fn bare_pairs_are_moves_if_the_quirk_is_on() {
    let mut reader = Reader::new(Grammar { bare_pairs: true, ..Dialect::Smcu.into() });
    let mut moves = |bytes: &str| -> Vec<_> {
        let command = |item| match item {
            Item::Command { command, .. } => command,
            other => panic!("{other:?}"),
        };
        feed(&mut reader, bytes.as_bytes()).into_iter().map(command).collect()
    };
    assert_eq!(moves("1,2;"), [Ok(Command::PlotAbsolute(vec![[1, 2]]))]);
    assert_eq!(
        moves("PD 3,4,5,6\r"),
        [Ok(Command::PenDown), Ok(Command::PlotAbsolute(vec![[3, 4], [5, 6]])),]
    );
    assert_eq!(
        moves("PR1,1;-2,-2;"),
        [Ok(Command::PlotRelative(vec![[1, 1]])), Ok(Command::PlotRelative(vec![[-2, -2]])),]
    );
    assert_eq!(moves("7;"), [Err(Status::SingleCoordinate)]);
    assert_eq!(moves("-;.;"), []);
    assert_eq!(
        moves("IN1,1;"),
        [Ok(Command::Initialize), Ok(Command::PlotAbsolute(vec![[1, 1]])),]
    );
}

#[test]
fn between_oc_and_cc_everything_goes_through() {
    assert_eq!(smcu("!OC;!SV3;PA\r!CC;PD"), "!OC|<!SV3;PA\\r>|!CC|PD");
    // What is almost the end is not lost.
    assert_eq!(smcu("!OC;!C!!CX!C"), "!OC|<!C!!CX>");
    assert_eq!(smcu("!OC;!C!CC;"), "!OC|<!C>|!CC");
    assert_eq!(smcu("!OC;!!CC\r"), "!OC|<!>|!CC");
    // The next command ends it as it ends every other, and is already for the unit.
    assert_eq!(smcu("!OC!RM1;!CC!ST"), "!OC|<!RM1;>|!CC|!ST");
    assert_eq!(smcu("!OCPD!CCPD"), "!OC|<PD>|!CC|PD");
    assert_eq!(motion("!OC 2;x!CC 2;"), "!OC 2|<x>|!CC 2");
}

#[test]
fn only_a_channel_that_exists_is_opened() {
    assert_eq!(smcu("!OC 2;PD"), "?!OC 2|PD");
    let mut reader = Reader::new(Dialect::Smcu);
    assert_eq!(told(&feed(&mut reader, b"!OC")), "");
    assert!(!reader.channel_open() && !reader.is_idle());
    assert_eq!(told(&feed(&mut reader, b";!C")), "!OC");
    assert!(reader.channel_open() && !reader.is_idle());
    assert_eq!(told(&feed(&mut reader, b"C\r")), "!CC");
    assert!(!reader.channel_open() && reader.is_idle());
}

#[test]
fn a_channel_can_be_closed_from_outside() {
    let mut reader = Reader::new(Dialect::Smcu);
    assert_eq!(told(&feed(&mut reader, b"!OC!")), "!OC");
    reader.close_channel();
    assert!(!reader.channel_open());
    assert_eq!(told(&feed(&mut reader, b"GO")), "!GO");
    reader.close_channel();
    assert!(reader.is_idle());
}

#[test]
fn the_records_of_ph_are_no_commands() {
    let vectors = "!PH0,1\rX1Y2PA3\r\nPDIN!";
    assert_eq!(motion("!PH0,1\rX1Y1\rX2\r;PD"), "!PH0,1\\rX1Y1\\rX2|?PD");
    // They go on to the `;`, or to a `!`.
    assert_eq!(motion(vectors), "?!PH0,1\\rX1Y2PA3\\r\\nPDIN");
    // To an SMCU they are whatever else they look like.
    assert_eq!(smcu("!PH0,1\rX1Y1\rX2\r;PD"), "?!PH0,1|?X1|?Y1|?X2|PD");
}

#[test]
fn a_colon_ends_oh_and_only_separates_elsewhere() {
    assert_eq!(smcu("OH:"), "OH");
    assert_eq!(motion("OH 2:;PA1:2;"), "OH 2|PA1:2");
    assert_eq!(smcu("O:;"), "?O:");
}

#[test]
fn lf_ends_commands_where_it_does() {
    let grammar = |dialect: Dialect| Grammar { line_feed_ends: true, ..dialect.into() };
    let read = |dialect, bytes: &[u8]| told(&feed(&mut Reader::new(grammar(dialect)), bytes));
    assert_eq!(read(Dialect::Smcu, b"PA1,2\nPA3\n,4\r\nXX\n"), "PA1,2|?PA3|?XX");
    assert_eq!(read(Dialect::MotionSystem, b"!PH0,1\nX1\n\r;PD"), "!PH0,1\\nX1|?PD");
}

#[test]
fn the_numbers_of_unknown_commands_are_moves_where_they_are() {
    let grammar = Grammar { unknown_pairs: true, ..Dialect::Smcu.into() };
    let mut reader = Reader::new(grammar);
    let mut moves = |bytes: &str| -> Vec<_> {
        let command = |item| match item {
            Item::Command { command, .. } => command,
            other => panic!("{other:?}"),
        };
        feed(&mut reader, bytes.as_bytes()).into_iter().map(command).collect()
    };
    assert_eq!(moves("XX1,2,3;"), [Ok(Command::PlotAbsolute(vec![[1, 2]]))]);
    assert_eq!(moves("SP1;LT;"), [Err(Status::UnknownCommand), Err(Status::UnknownCommand)]);
    assert_eq!(
        moves("PR1,1;!XX2,2;"),
        [Ok(Command::PlotRelative(vec![[1, 1]])), Ok(Command::PlotRelative(vec![[2, 2]]))]
    );
    // A form that another model has is unknown, too.
    assert_eq!(moves("!MA1,2,3,4,5,6;"), [Ok(Command::PlotRelative(vec![[1, 2], [3, 4], [5, 6]]))]);
    assert_eq!(moves("PA5;"), [Err(Status::SingleCoordinate)]);
}

#[test]
fn machines_lack_forms_that_others_have() {
    let grammar =
        Grammar { shapes: false, space_moves: false, reads_ports: false, ..Dialect::Smcu.into() };
    for command in ["CI5;", "EA5,5;", "ER;", "!TA1,2,3;", "!TR1;", "!RD0;"] {
        let items = feed(&mut Reader::new(grammar), command.as_bytes());
        assert_eq!(told(&items), format!("?{}", command.trim_end_matches(';')));
        assert!(matches!(&items[..], [Item::Command { command: Err(Status::UnknownCommand), .. }]));
    }
    let motion = Grammar { reads_ports: false, ..Dialect::MotionSystem.into() };
    assert_eq!(told(&feed(&mut Reader::new(motion), b"!RD0;")), "!RD0");
}

#[test]
fn what_is_too_long_is_told_at_its_end() {
    let digits = "1".repeat(COMMAND_MAX - 2);
    assert_eq!(smcu(&format!("PA{digits};")), format!("?PA{digits}"));
    assert_eq!(smcu(&format!("PA{digits}1;PD")), "too long|PD");
    assert_eq!(smcu(&format!("PA{digits}1PD")), "too long|PD");
    assert_eq!(smcu(&format!("XX{digits}1\rPD")), "too long|PD");
    let blanks = " ".repeat(COMMAND_MAX);
    let expected = Item::Command { raw: b"!PH".to_vec(), command: Err(Status::VectorBufferFull) };
    let vectors = format!("!PH0,1\r{blanks}X1\r;");
    assert_eq!(items(Dialect::MotionSystem, vectors.as_bytes()), [expected]);
}
