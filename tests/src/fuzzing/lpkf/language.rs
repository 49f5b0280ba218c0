//! Commands from bytes and back.

use vimc4_lpkf::language::{
    AxisLimits, COMMAND_MAX, Command, Dialect, Grammar, Item, Limits, Misfit, Reader, Status, parse,
};
use vimc4_plant::Unit;

use crate::fuzzing::chance::Chance;

/// Bytes as they come over the line become commands that print as what is read as the same
/// command, or statuses that the dialect has. A reader that is copied, or written down and read
/// back, in the middle goes on as if nothing had been.
///
/// Of the first byte, the lowest bit says which dialect, the next whether bare pairs are moves,
/// the third whether what costs most is done, writing down, and the others what else differs
/// between machines; what remains comes over the line.
pub fn language(data: &[u8]) {
    let [habits, line @ ..] = data else { return };
    let dialect = Dialect::ALL[usize::from(habits & 1)];
    let write_down = habits & 4 != 0;
    let grammar = Grammar {
        bare_pairs: habits & 2 != 0,
        line_feed_ends: habits & 8 != 0,
        unknown_pairs: habits & 16 != 0,
        shapes: habits & 32 == 0,
        space_moves: habits & 64 == 0,
        reads_ports: habits & 128 == 0,
        ..dialect.into()
    };
    let new = || Reader::new(grammar);
    let (mut reader, mut other) = (new(), new());
    let (mut items, mut others) = (Vec::new(), Vec::new());
    let copied = Chance::of(data).below(line.len() as u64 + 1) as usize;
    let mut through = 0;
    for (at, &byte) in line.iter().enumerate() {
        if at == copied {
            assert_eq!(other, reader, "other bytes have been read");
            other = if write_down { written_and_read(&reader) } else { reader.clone() };
        }
        let was_open = reader.channel_open();
        reader.feed(byte, |item| items.push(item));
        other.feed(byte, |item| others.push(item));
        assert!(reader.pending().len() <= COMMAND_MAX, "more is kept than there is room for");
        assert!(!(reader.is_idle() && reader.channel_open()));
        assert_eq!(items, others, "a copy reads something else");
        let opens = items.iter().any(opens_channel);
        others.clear();
        for item in items.drain(..) {
            match item {
                Item::Command { raw, command } => {
                    let so_far = &line[..=at];
                    check_command(&raw, &command, so_far, grammar, write_down);
                }
                Item::TooLong => assert!(at >= COMMAND_MAX, "{at} bytes are no long command"),
                Item::Through(_) => {
                    assert!(was_open || opens, "the channel is closed");
                    through += 1;
                }
            }
        }
        assert!(through <= at + 1, "more goes through than has come");
    }
    assert_eq!(other, reader, "a copy is in another state");
}

fn opens_channel(item: &Item) -> bool {
    matches!(item, Item::Command { command: Ok(Command::OpenChannel(_)), .. })
}

fn written_and_read(reader: &Reader) -> Reader {
    let kept = serde_json::to_string(reader).unwrap_or_default();
    serde_json::from_str(&kept).unwrap_or_else(|error| unreachable!("{error}: {kept}"))
}

fn check_command(
    raw: &[u8],
    command: &Result<Command, Status>,
    so_far: &[u8],
    grammar: Grammar,
    write_down: bool,
) {
    let text = raw.escape_ascii();
    assert!(!raw.is_empty() && raw.len() <= COMMAND_MAX);
    let came = raw == b"!PH" || so_far.windows(raw.len()).any(|window| window == raw);
    assert!(came, "{text} has not been received");
    let is_bare = !matches!(raw[0], b'A'..=b'Z' | b'!');
    assert!(grammar.bare_pairs || !is_bare, "{text} is not a command");
    let parsed = match is_bare {
        false => parse(raw, grammar),
        // A move to these places, or by these ways.
        true => {
            let move_by = |letters: &[u8]| parse(&[letters, raw].concat(), grammar);
            let relative = matches!(command, Ok(Command::PlotRelative(_)));
            move_by(if relative { b"PR" } else { b"PA" })
        }
    };
    // What was read is a whole command, which reads the same by itself.
    let again = read(&[raw, b";"].concat(), Reader::new(grammar));
    let alone = Item::Command { raw: raw.to_vec(), command: command.clone() };
    let is_long_vectors = raw == b"!PH" && *command == Err(Status::VectorBufferFull);
    // What the numbers of an unknown command do depends on the last move.
    let is_move = grammar.unknown_pairs && parsed == Err(Status::UnknownCommand);
    let is_context = is_long_vectors || is_move;
    assert!(is_context || parsed == *command, "{text} by itself is {parsed:?}");
    assert!(is_context || is_bare || again == [alone], "{text} by itself is {again:?}");
    match command {
        Err(status) => assert!(status.known_to(grammar.dialect), "{status:?} is unknown"),
        Ok(command) => check_meaning(command, grammar, write_down),
    }
}

/// What a reader finds in some bytes.
fn read(bytes: &[u8], mut reader: Reader) -> Vec<Item> {
    let mut items = Vec::new();
    for &byte in bytes {
        reader.feed(byte, |item| items.push(item));
    }
    items
}

/// What is printed means the same, and so is what is written down.
fn check_meaning(command: &Command, grammar: Grammar, write_down: bool) {
    assert!(grammar.knows(command.form()), "{command:?} is unknown");
    assert!(!command.describe().is_empty());
    let mut printed = Vec::new();
    command.print(&mut printed);
    let text = printed.escape_ascii();
    let again = read(&printed, Reader::new(grammar));
    let same = matches!(&again[..], [Item::Command { command: Ok(again), .. }] if again == command);
    assert!(same, "printed as {text}, which is {again:?}");
    if let Err(status) = command.check(&LIMITS).map_err(Misfit::status) {
        assert!(status.known_to(grammar.dialect), "{status:?} is unknown");
    }
    if write_down {
        let kept = serde_json::to_string(command).unwrap_or_default();
        assert_eq!(serde_json::from_str(&kept).ok().as_ref(), Some(command), "{kept}");
    }
}

/// Some machine: X and Y linear, Z0 rotary, nothing else.
const LIMITS: Limits = {
    let linear =
        Some(AxisLimits { kind: Unit::Linear, max_speed: 40_000, max_acceleration: 20_000 });
    let rotary =
        Some(AxisLimits { kind: Unit::Rotary, max_speed: 3_600, max_acceleration: 800_000 });
    let axes = [linear, linear, rotary, None, None, None];
    Limits { axes, metres: true, micrometres: false }
};
