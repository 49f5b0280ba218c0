//! What is printed is read as what it was.

use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::sample::{Index, select, subsequence};
use vimc4_isel_wire::Plane;
use vimc4_motion::Turn;

use super::{command, read};
use crate::language::{
    Accessory, DrillWords, Frame, Groups, Instruction, Placed, PortBit, Rate, Span, SpindleWords,
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

fn cylinder() -> impl Strategy<Value = Instruction> {
    (0..6_usize, 0..3_usize, positive(0), any::<bool>())
        .prop_filter("an axis does not stand in for itself", |(turning, linear, ..)| {
            turning != linear
        })
        .prop_map(|(turning, linear, radius, named)| {
            let linear = (named || radius.value != Value::ZERO).then_some(at(linear));
            Instruction::Cylinder(at(turning), radius, linear)
        })
}

fn spindle() -> impl Strategy<Value = Instruction> {
    let word = || option::of(positive(0));
    (any::<bool>(), option::of(turn().prop_map(at)), word(), word()).prop_map(
        |(off, turn, rpm, time)| Instruction::Spindle(SpindleWords { off, turn, rpm, time }),
    )
}

fn arc() -> impl Strategy<Value = Instruction> {
    let centre = [option::of(any_value()), option::of(any_value()), option::of(any_value())]
        .prop_filter("some", |centre| centre.iter().any(Option::is_some));
    let to = option::of(axes(any_value())).prop_map(Option::unwrap_or_default);
    let sweep = option::of(option::of(positive(0)));
    (frame(), turn(), centre, sweep, to).prop_map(|(frame, turn, centre, sweep, to)| {
        let (helix, sweep) = (sweep.is_some(), sweep.flatten());
        Instruction::Arc { frame, turn, helix, centre, sweep, to }
    })
}

fn plain() -> impl Strategy<Value = Instruction> {
    prop_oneof![
        Just(Instruction::Mark),
        Just(Instruction::ZeroHere),
        Just(Instruction::ZeroClear),
        Just(Instruction::Teach),
        Just(Instruction::Path),
        Just(Instruction::PathEnd),
        Just(Instruction::Halt),
        Just(Instruction::ToolDefinition),
        Just(Instruction::ToolInit),
        Just(Instruction::Type),
        Just(Instruction::End),
        Just(Instruction::Plane(Plane::Xy)),
        Just(Instruction::Plane(Plane::Xz)),
        Just(Instruction::Plane(Plane::Yz)),
        Just(Instruction::ZeroStandard),
        Just(Instruction::Units(Units::Metric)),
        Just(Instruction::Units(Units::Inch)),
        (select(&Accessory::ALL), any::<bool>())
            .prop_map(|(accessory, on)| Instruction::Switch(accessory, on)),
    ]
}

/// Every command there is.
pub(super) fn any_command() -> impl Strategy<Value = Instruction> {
    let rate = prop_oneof![Just(Rate::Normal), Just(Rate::Rapid)];
    let moves = (frame(), rate, axes(any_value()));
    let place = || option::of(any_value());
    let drill =
        (place(), place()).prop_map(|(x, y)| Instruction::Drill([x, y, None, None, None, None]));
    prop_oneof![
        plain(),
        groups().prop_map(Instruction::Reference),
        limits().prop_map(Instruction::Limit),
        positive(1).prop_map(Instruction::Velocity),
        positive(1).prop_map(Instruction::RapidVelocity),
        moves.prop_map(|(frame, rate, to)| Instruction::Move(frame, rate, to)),
        arc(),
        positive(0).prop_map(Instruction::Wait),
        axes(any_value()).prop_map(Instruction::ZeroAt),
        (1..=8_u8, axes(any_value()))
            .prop_map(|(register, zero)| Instruction::Store(register, zero)),
        (1..=8_u8).prop_map(Instruction::Recall),
        (1..=4_u8, any::<u8>()).prop_map(|(port, value)| Instruction::SetPort(port, value)),
        (bit(), any::<bool>()).prop_map(|(bit, to)| Instruction::SetBit(bit, to)),
        (bit(), any::<bool>()).prop_map(|(bit, to)| Instruction::WaitBit(bit, to)),
        (1..=4_u8, any::<u8>()).prop_map(|(port, value)| Instruction::WaitPort(port, value)),
        (0..=999_999_999_u32).prop_map(Instruction::Tool),
        drill_words().prop_map(Instruction::DrillDefinition),
        drill,
        cylinder(),
        axes(
            within(5_000, 100_000)
                .prop_map(|percent| { at(Value::whole(percent.value.in_thousandths() / 1_000)) })
        )
        .prop_map(Instruction::Acceleration),
        spindle(),
    ]
}

/// A command of every kind.
pub(super) fn one_of_each() -> Vec<Instruction> {
    let bit = PortBit { port: 1, bit: 4 };
    let number = at(Value::whole(5));
    let words = [Some(number), None, None, None, None, None];
    let all = vec![
        Instruction::Mark,
        Instruction::Reference([7, 0, 0, 0, 0, 0]),
        Instruction::Limit([Some((number, number)), None, None, None, None, None]),
        Instruction::Velocity(number),
        Instruction::RapidVelocity(number),
        Instruction::Move(Frame::Absolute, Rate::Normal, words),
        Instruction::Plane(Plane::Xy),
        Instruction::Arc {
            frame: Frame::Absolute,
            turn: Turn::Clockwise,
            helix: false,
            centre: [Some(number), None, None],
            sweep: None,
            to: words,
        },
        Instruction::Wait(number),
        Instruction::ZeroHere,
        Instruction::ZeroStandard,
        Instruction::ZeroAt(words),
        Instruction::ZeroClear,
        Instruction::Store(1, words),
        Instruction::Recall(1),
        Instruction::Teach,
        Instruction::SetPort(1, 2),
        Instruction::SetBit(bit, true),
        Instruction::WaitBit(bit, true),
        Instruction::WaitPort(1, 2),
        Instruction::Path,
        Instruction::PathEnd,
        Instruction::Tool(3),
        Instruction::DrillDefinition(DrillWords { depth: Some(number), ..DrillWords::default() }),
        Instruction::Drill(words),
        Instruction::Cylinder(at(3), number, Some(at(1))),
        Instruction::Halt,
        Instruction::Acceleration(words),
        Instruction::Spindle(SpindleWords::default()),
        Instruction::Switch(Accessory::Pump, true),
        Instruction::Units(Units::Inch),
        Instruction::ToolDefinition,
        Instruction::ToolInit,
        Instruction::Type,
        Instruction::End,
    ];
    // The compiler points here when a command is added, so that it also gets into the lists above.
    let known = |command: &Instruction| match command {
        Instruction::Mark
        | Instruction::Reference(_)
        | Instruction::Limit(_)
        | Instruction::Velocity(_) => 0,
        Instruction::RapidVelocity(_)
        | Instruction::Move(..)
        | Instruction::Plane(_)
        | Instruction::Arc { .. } => 0,
        Instruction::Wait(_)
        | Instruction::ZeroHere
        | Instruction::ZeroAt(_)
        | Instruction::ZeroClear => 0,
        Instruction::Store(..)
        | Instruction::Recall(_)
        | Instruction::Teach
        | Instruction::SetPort(..) => 0,
        Instruction::SetBit(..)
        | Instruction::WaitBit(..)
        | Instruction::WaitPort(..)
        | Instruction::Path => 0,
        Instruction::PathEnd
        | Instruction::Tool(_)
        | Instruction::DrillDefinition(_)
        | Instruction::Drill(_) => 0,
        Instruction::Cylinder(..) | Instruction::Halt | Instruction::Acceleration(_) => 0,
        Instruction::Spindle(_) | Instruction::Switch(..) | Instruction::ToolDefinition => 0,
        Instruction::ZeroStandard | Instruction::Units(_) => 0,
        Instruction::ToolInit | Instruction::Type | Instruction::End => 0,
    };
    assert_eq!(all.iter().map(known).sum::<u32>(), 0);
    all
}

/// The same command without places.
fn bare(command: Instruction) -> Instruction {
    let word = |word: Option<Word>| word.map(|word| at(word.value));
    let words = |words: Words| words.map(word);
    match command {
        Instruction::Limit(limits) => Instruction::Limit(
            limits.map(|pair| pair.map(|(low, high)| (at(low.value), at(high.value)))),
        ),
        Instruction::Velocity(speed) => Instruction::Velocity(at(speed.value)),
        Instruction::RapidVelocity(speed) => Instruction::RapidVelocity(at(speed.value)),
        Instruction::Move(frame, rate, to) => Instruction::Move(frame, rate, words(to)),
        Instruction::Arc { frame, turn, helix, centre, sweep, to } => {
            let (centre, sweep, to) = (centre.map(word), word(sweep), words(to));
            Instruction::Arc { frame, turn, helix, centre, sweep, to }
        }
        Instruction::Wait(time) => Instruction::Wait(at(time.value)),
        Instruction::ZeroAt(zero) => Instruction::ZeroAt(words(zero)),
        Instruction::Store(register, zero) => Instruction::Store(register, words(zero)),
        Instruction::DrillDefinition(drill) => Instruction::DrillDefinition(DrillWords {
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
        Instruction::Drill(to) => Instruction::Drill(words(to)),
        Instruction::Cylinder(turning, radius, linear) => Instruction::Cylinder(
            at(turning.value),
            at(radius.value),
            linear.map(|linear| at(linear.value)),
        ),
        Instruction::Acceleration(percents) => Instruction::Acceleration(words(percents)),
        Instruction::Spindle(spindle) => Instruction::Spindle(SpindleWords {
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
