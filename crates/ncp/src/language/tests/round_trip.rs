//! What is printed is read as what it was.

use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::sample::{Index, select, subsequence};
use vimc4_isel_wire::Plane;
use vimc4_motion::Turn;

use super::{command, read};
use crate::language::{
    Accessory, Command, DrillWords, Frame, Groups, Placed, PortBit, Rate, Span, SpindleWords,
    Units, Value, Word, Words,
};

/// Something without a place.
fn at<T>(value: T) -> Placed<T> {
    Placed { value, span: Span::default() }
}

fn within(least: i64, most: i64) -> impl Strategy<Value = Word> + Clone {
    (least..=most).prop_map(|value| at(Value::thousandths(value)))
}

fn any_value() -> impl Strategy<Value = Word> + Clone {
    let most = Value::MOST.in_thousandths();
    prop_oneof![within(-most, most), within(-5_000, 5_000), Just(at(Value::MOST))]
}

fn positive(least: i64) -> impl Strategy<Value = Word> + Clone {
    within(least, Value::MOST.in_thousandths())
}

fn axes(word: impl Strategy<Value = Word> + Clone) -> impl Strategy<Value = Words> {
    let word = || option::of(word.clone());
    [word(), word(), word(), word(), word(), word()]
        .prop_filter("a command that names nothing is not right", |words| {
            words.iter().any(Option::is_some)
        })
}

fn groups() -> impl Strategy<Value = Groups> {
    let axes = subsequence(vec![0, 1, 2, 3, 4, 5], 1..=6).prop_shuffle();
    (axes, vec(any::<bool>(), 6)).prop_map(|(axes, breaks)| {
        let mut groups = Groups::default();
        let mut group = 0;
        for (axis, begins_anew) in axes.into_iter().zip(breaks) {
            group += usize::from(begins_anew && groups[group] != 0);
            groups[group] |= 1 << axis;
        }
        groups
    })
}

fn turn() -> impl Strategy<Value = Turn> + Clone {
    prop_oneof![Just(Turn::Clockwise), Just(Turn::Counterclockwise)]
}

fn frame() -> impl Strategy<Value = Frame> {
    prop_oneof![Just(Frame::Absolute), Just(Frame::Relative)]
}

fn limits() -> impl Strategy<Value = [Option<(Word, Word)>; 6]> {
    let pair = || {
        let ordered = |(one, other): (Word, Word)| {
            if one.value <= other.value { (one, other) } else { (other, one) }
        };
        option::of((any_value(), any_value()).prop_map(ordered))
    };
    [pair(), pair(), pair(), pair(), pair(), pair()]
        .prop_filter("some", |limits| limits.iter().any(Option::is_some))
}

fn bit() -> impl Strategy<Value = PortBit> {
    (1..=4_u8, 1..=8_u8).prop_map(|(port, bit)| PortBit { port, bit })
}

fn drill_words() -> impl Strategy<Value = DrillWords> {
    let any = || option::of(any_value());
    let cycle = option::of((1..=3_i64).prop_map(|cycle| at(Value::whole(cycle))));
    let timing = (cycle, option::of(positive(0)), option::of(positive(1)));
    let depths = [any(), any(), any(), any(), any(), any(), any(), any()];
    (timing, depths)
        .prop_map(|((cycle, dwell, speed), depths)| {
            let [plane, depth, first, other, decrease, retreat, lift, safety] = depths;
            DrillWords {
                cycle,
                plane,
                depth,
                dwell,
                speed,
                first,
                other,
                decrease,
                retreat,
                lift,
                safety,
            }
        })
        .prop_filter("some", |words| *words != DrillWords::default())
}

fn cylinder() -> impl Strategy<Value = Command> {
    (0..6_usize, 0..3_usize, positive(0), any::<bool>())
        .prop_filter("an axis does not stand in for itself", |(turning, linear, ..)| {
            turning != linear
        })
        .prop_map(|(turning, linear, radius, named)| {
            let linear = (named || radius.value != Value::ZERO).then_some(at(linear));
            Command::Cylinder(at(turning), radius, linear)
        })
}

fn spindle() -> impl Strategy<Value = Command> {
    let word = || option::of(positive(0));
    (any::<bool>(), option::of(turn().prop_map(at)), word(), word())
        .prop_map(|(off, turn, rpm, time)| Command::Spindle(SpindleWords { off, turn, rpm, time }))
}

fn arc() -> impl Strategy<Value = Command> {
    let centre = [option::of(any_value()), option::of(any_value()), option::of(any_value())]
        .prop_filter("some", |centre| centre.iter().any(Option::is_some));
    let to = option::of(axes(any_value())).prop_map(Option::unwrap_or_default);
    let sweep = option::of(option::of(positive(0)));
    (frame(), turn(), centre, sweep, to).prop_map(|(frame, turn, centre, sweep, to)| {
        let (helix, sweep) = (sweep.is_some(), sweep.flatten());
        Command::Arc { frame, turn, helix, centre, sweep, to }
    })
}

fn plain() -> impl Strategy<Value = Command> {
    prop_oneof![
        Just(Command::Mark),
        Just(Command::ZeroHere),
        Just(Command::ZeroClear),
        Just(Command::Teach),
        Just(Command::Path),
        Just(Command::PathEnd),
        Just(Command::Halt),
        Just(Command::ToolDefinition),
        Just(Command::ToolInit),
        Just(Command::Type),
        Just(Command::End),
        Just(Command::Plane(Plane::Xy)),
        Just(Command::Plane(Plane::Xz)),
        Just(Command::Plane(Plane::Yz)),
        Just(Command::ZeroStandard),
        Just(Command::Units(Units::Metric)),
        Just(Command::Units(Units::Inch)),
        (select(&Accessory::ALL), any::<bool>())
            .prop_map(|(accessory, on)| Command::Switch(accessory, on)),
    ]
}

/// Every command there is.
pub(super) fn any_command() -> impl Strategy<Value = Command> {
    let rate = prop_oneof![Just(Rate::Normal), Just(Rate::Rapid)];
    let moves = (frame(), rate, axes(any_value()));
    let place = || option::of(any_value());
    let drill =
        (place(), place()).prop_map(|(x, y)| Command::Drill([x, y, None, None, None, None]));
    prop_oneof![
        plain(),
        groups().prop_map(Command::Reference),
        limits().prop_map(Command::Limit),
        positive(1).prop_map(Command::Velocity),
        positive(1).prop_map(Command::RapidVelocity),
        moves.prop_map(|(frame, rate, to)| Command::Move(frame, rate, to)),
        arc(),
        positive(0).prop_map(Command::Wait),
        axes(any_value()).prop_map(Command::ZeroAt),
        (1..=8_u8, axes(any_value())).prop_map(|(register, zero)| Command::Store(register, zero)),
        (1..=8_u8).prop_map(Command::Recall),
        (1..=4_u8, any::<u8>()).prop_map(|(port, value)| Command::SetPort(port, value)),
        (bit(), any::<bool>()).prop_map(|(bit, to)| Command::SetBit(bit, to)),
        (bit(), any::<bool>()).prop_map(|(bit, to)| Command::WaitBit(bit, to)),
        (1..=4_u8, any::<u8>()).prop_map(|(port, value)| Command::WaitPort(port, value)),
        (0..=999_999_999_u32).prop_map(Command::Tool),
        drill_words().prop_map(Command::DrillDefinition),
        drill,
        cylinder(),
        axes(
            within(5_000, 100_000)
                .prop_map(|percent| { at(Value::whole(percent.value.in_thousandths() / 1_000)) })
        )
        .prop_map(Command::Acceleration),
        spindle(),
    ]
}

/// A command of every kind.
pub(super) fn one_of_each() -> Vec<Command> {
    let bit = PortBit { port: 1, bit: 4 };
    let number = at(Value::whole(5));
    let words = [Some(number), None, None, None, None, None];
    let all = vec![
        Command::Mark,
        Command::Reference([7, 0, 0, 0, 0, 0]),
        Command::Limit([Some((number, number)), None, None, None, None, None]),
        Command::Velocity(number),
        Command::RapidVelocity(number),
        Command::Move(Frame::Absolute, Rate::Normal, words),
        Command::Plane(Plane::Xy),
        Command::Arc {
            frame: Frame::Absolute,
            turn: Turn::Clockwise,
            helix: false,
            centre: [Some(number), None, None],
            sweep: None,
            to: words,
        },
        Command::Wait(number),
        Command::ZeroHere,
        Command::ZeroStandard,
        Command::ZeroAt(words),
        Command::ZeroClear,
        Command::Store(1, words),
        Command::Recall(1),
        Command::Teach,
        Command::SetPort(1, 2),
        Command::SetBit(bit, true),
        Command::WaitBit(bit, true),
        Command::WaitPort(1, 2),
        Command::Path,
        Command::PathEnd,
        Command::Tool(3),
        Command::DrillDefinition(DrillWords { depth: Some(number), ..DrillWords::default() }),
        Command::Drill(words),
        Command::Cylinder(at(3), number, Some(at(1))),
        Command::Halt,
        Command::Acceleration(words),
        Command::Spindle(SpindleWords::default()),
        Command::Switch(Accessory::Pump, true),
        Command::Units(Units::Inch),
        Command::ToolDefinition,
        Command::ToolInit,
        Command::Type,
        Command::End,
    ];
    // Whoever adds a command is sent here by the compiler, to put it into the lists above too.
    let known = |command: &Command| match command {
        Command::Mark | Command::Reference(_) | Command::Limit(_) | Command::Velocity(_) => 0,
        Command::RapidVelocity(_) | Command::Move(..) | Command::Plane(_) | Command::Arc { .. } => {
            0
        }
        Command::Wait(_) | Command::ZeroHere | Command::ZeroAt(_) | Command::ZeroClear => 0,
        Command::Store(..) | Command::Recall(_) | Command::Teach | Command::SetPort(..) => 0,
        Command::SetBit(..) | Command::WaitBit(..) | Command::WaitPort(..) | Command::Path => 0,
        Command::PathEnd | Command::Tool(_) | Command::DrillDefinition(_) | Command::Drill(_) => 0,
        Command::Cylinder(..) | Command::Halt | Command::Acceleration(_) => 0,
        Command::Spindle(_) | Command::Switch(..) | Command::ToolDefinition => 0,
        Command::ZeroStandard | Command::Units(_) => 0,
        Command::ToolInit | Command::Type | Command::End => 0,
    };
    assert_eq!(all.iter().map(known).sum::<u32>(), 0);
    all
}

/// The same command without places.
fn bare(command: Command) -> Command {
    let word = |word: Option<Word>| word.map(|word| at(word.value));
    let words = |words: Words| words.map(word);
    match command {
        Command::Limit(limits) => Command::Limit(
            limits.map(|pair| pair.map(|(low, high)| (at(low.value), at(high.value)))),
        ),
        Command::Velocity(speed) => Command::Velocity(at(speed.value)),
        Command::RapidVelocity(speed) => Command::RapidVelocity(at(speed.value)),
        Command::Move(frame, rate, to) => Command::Move(frame, rate, words(to)),
        Command::Arc { frame, turn, helix, centre, sweep, to } => {
            let (centre, sweep, to) = (centre.map(word), word(sweep), words(to));
            Command::Arc { frame, turn, helix, centre, sweep, to }
        }
        Command::Wait(time) => Command::Wait(at(time.value)),
        Command::ZeroAt(zero) => Command::ZeroAt(words(zero)),
        Command::Store(register, zero) => Command::Store(register, words(zero)),
        Command::DrillDefinition(drill) => Command::DrillDefinition(DrillWords {
            cycle: word(drill.cycle),
            plane: word(drill.plane),
            depth: word(drill.depth),
            dwell: word(drill.dwell),
            speed: word(drill.speed),
            first: word(drill.first),
            other: word(drill.other),
            decrease: word(drill.decrease),
            retreat: word(drill.retreat),
            lift: word(drill.lift),
            safety: word(drill.safety),
        }),
        Command::Drill(to) => Command::Drill(words(to)),
        Command::Cylinder(turning, radius, linear) => Command::Cylinder(
            at(turning.value),
            at(radius.value),
            linear.map(|linear| at(linear.value)),
        ),
        Command::Acceleration(percents) => Command::Acceleration(words(percents)),
        Command::Spindle(spindle) => Command::Spindle(SpindleWords {
            off: spindle.off,
            turn: spindle.turn.map(|turn| at(turn.value)),
            rpm: word(spindle.rpm),
            time: word(spindle.time),
        }),
        other => other,
    }
}

#[test]
fn one_of_each_is_read_as_it_is_printed() {
    for one in one_of_each() {
        assert_eq!(bare(command(&one.to_string())), one, "{one}");
    }
}

/// The line again, with other blanks and letters in other case wherever that changes nothing.
fn disguised(line: &str, choices: &[Index]) -> String {
    let mut choices = choices.iter().cycle();
    let mut choose = |count| choices.next().map_or(0, |choice| choice.index(count));
    let mut text = [" ", "", "N1", "n007 ", "\tN 3\t"][choose(5)].to_owned();
    for letter in line.chars() {
        match letter {
            ' ' => text.push_str(["  ", " ", "\t", " \t "][choose(4)]),
            letter if choose(2) == 0 => text.extend(letter.to_lowercase()),
            letter => text.push(letter),
        }
    }
    text + ["", " ", "; x", "\t;"][choose(4)]
}

proptest! {
    #[test]
    fn commands_are_read_as_they_are_printed(one in any_command()) {
        let line = one.to_string();
        let (read, problems) = read(&line);
        prop_assert!(problems.is_empty(), "{line}: {problems:?}");
        let Some(found) = read.command else { return Err(TestCaseError::fail(line)) };
        prop_assert_eq!(found.span, Span { start: 0, end: line.len() as u32 });
        prop_assert_eq!(bare(found.value), one);
    }

    #[test]
    fn blanks_and_case_change_nothing(one in any_command(), choices in vec(any::<Index>(), 40)) {
        let line = disguised(&one.to_string(), &choices);
        let (read, problems) = read(&line);
        prop_assert!(problems.is_empty(), "{line}: {problems:?}");
        prop_assert_eq!(read.command.map(|found| bare(found.value)), Some(one), "{}", line);
    }
}
