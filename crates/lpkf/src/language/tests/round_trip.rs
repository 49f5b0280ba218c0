//! Printing and reading are inverse to each other, for every form of both models.

use std::collections::BTreeSet;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use proptest::test_runner::{Config, TestRunner};

use super::{items, print};
use crate::language::{
    Axis, Command, Dialect, Item, Mode, Number, Op, Trackball, Turn, VECTORS_MAX, Vector, forms,
    parse,
};

fn axis() -> impl Strategy<Value = Axis> {
    select(Axis::ALL.to_vec())
}

fn whole() -> impl Strategy<Value = i32> {
    prop_oneof![any::<i32>(), -1000..1000, select(vec![0, 1, -1, i32::MIN, i32::MAX])]
}

fn pair() -> impl Strategy<Value = [i32; 2]> {
    [whole(), whole()]
}

fn space() -> impl Strategy<Value = [i32; 3]> {
    [whole(), whole(), whole()]
}

fn angle() -> impl Strategy<Value = i64> {
    prop_oneof![-360_000_000_i64..=360_000_000, (-360_i64..=360).prop_map(|a| a * 1_000_000)]
}

fn time() -> impl Strategy<Value = u32> {
    0..=i32::MAX.unsigned_abs()
}

fn number() -> impl Strategy<Value = Number> {
    angle().prop_map(|millionths| Number { millionths })
}

fn vector() -> impl Strategy<Value = Vector> {
    let turn = select(vec![Turn::Clockwise, Turn::Straight, Turn::Counterclockwise]);
    (pair(), pair(), whole(), turn).prop_map(|(end, centre, speed_change, turn)| Vector {
        end,
        centre,
        speed_change,
        turn,
    })
}

/// Commands of one form, with everything they can have.
#[expect(clippy::too_many_lines, reason = "it is a table")]
fn commands(op: Op) -> BoxedStrategy<Command> {
    let one = |make: fn(i32) -> Command| whole().prop_map(make).boxed();
    let switch = |make: fn(bool) -> Command| any::<bool>().prop_map(make).boxed();
    let on = |make: fn(Axis) -> Command| axis().prop_map(make).boxed();
    let value_on = |make: fn(Axis, i32) -> Command| {
        (axis(), whole()).prop_map(move |(axis, value)| make(axis, value)).boxed()
    };
    let arc = |make: fn([i32; 2], i64) -> Command| {
        (pair(), angle()).prop_map(move |(centre, angle)| make(centre, angle)).boxed()
    };
    let plot = |make: fn(Vec<[i32; 2]>) -> Command| vec(pair(), 1..20).prop_map(make).boxed();
    let all = |make: fn([i32; 6]) -> Command| {
        [whole(), whole(), whole(), whole(), whole(), whole()].prop_map(make).boxed()
    };
    let times =
        |make: fn([u32; 4]) -> Command| [time(), time(), time(), time()].prop_map(make).boxed();
    let axis_or_all = || proptest::option::of(axis());
    match op {
        Op::ArcAbsolute => arc(|centre, angle| Command::ArcAbsolute { centre, angle }),
        Op::ArcRelative => arc(|centre, angle| Command::ArcRelative { centre, angle }),
        Op::Circle => one(Command::Circle),
        Op::EdgeAbsolute => pair().prop_map(Command::EdgeAbsolute).boxed(),
        Op::EdgeRelative => pair().prop_map(Command::EdgeRelative).boxed(),
        Op::Initialize => Just(Command::Initialize).boxed(),
        Op::Window => [pair(), pair()].prop_map(Command::Window).boxed(),
        Op::HardClipLimits => Just(Command::HardClipLimits(None)).boxed(),
        Op::HardClipLimitsOf => on(|axis| Command::HardClipLimits(Some(axis))),
        Op::OutputStatus => Just(Command::OutputStatus).boxed(),
        Op::PlotAbsolute => plot(Command::PlotAbsolute),
        Op::PenDown => Just(Command::PenDown).boxed(),
        Op::PlotRelative => plot(Command::PlotRelative),
        Op::PenUp => Just(Command::PenUp).boxed(),
        Op::PenSpeed => number().prop_map(Command::PenSpeed).boxed(),
        Op::AccelerationOf => {
            value_on(|axis, acceleration| Command::Acceleration { axis: Some(axis), acceleration })
        }
        Op::Acceleration => one(|acceleration| Command::Acceleration { axis: None, acceleration }),
        Op::CloseChannel => Just(Command::CloseChannel(None)).boxed(),
        Op::CloseChannelOf => one(|channel| Command::CloseChannel(Some(channel))),
        Op::CloseInterface => Just(Command::CloseInterface).boxed(),
        Op::SetMode => {
            select(vec![Mode::Drilling, Mode::Milling]).prop_map(Command::SetMode).boxed()
        }
        Op::Continue => Just(Command::Continue).boxed(),
        Op::Echo => switch(Command::Echo),
        Op::ExternalStop => switch(Command::ExternalStop),
        Op::Spindle => switch(Command::Spindle),
        Op::FullCurrent => Just(Command::FullCurrent).boxed(),
        Op::GoBack => Just(Command::GoBack).boxed(),
        Op::HalfCurrent => Just(Command::HalfCurrent).boxed(),
        Op::Reference => Just(Command::Reference(None)).boxed(),
        Op::ReferenceOf => on(|axis| Command::Reference(Some(axis))),
        Op::MoveAllAbsolute => all(Command::MoveAllAbsolute),
        Op::MoveAllRelative => all(Command::MoveAllRelative),
        Op::ActualPosition => (axis_or_all(), any::<bool>())
            .prop_map(|(axis, triggered)| Command::ActualPosition { axis, triggered })
            .boxed(),
        Op::OpenChannel => Just(Command::OpenChannel(None)).boxed(),
        Op::OpenChannelOf => one(|channel| Command::OpenChannel(Some(channel))),
        Op::OpenInterface => {
            let trackball = vec![Trackball::MoveAndReport, Trackball::Move, Trackball::Report];
            select(trackball).prop_map(Command::OpenInterface).boxed()
        }
        Op::NominalPosition => axis_or_all().prop_map(Command::NominalPosition).boxed(),
        Op::FollowVectors => {
            let axes = (axis(), 1..Axis::ALL.len())
                .prop_map(|(a, further)| [a, Axis::ALL[(a.index() + further) % Axis::ALL.len()]]);
            (axes, vec(vector(), 1..=VECTORS_MAX))
                .prop_map(|(axes, vectors)| Command::FollowVectors { axes, vectors })
                .boxed()
        }
        Op::ReadPort => any::<u8>().prop_map(Command::ReadPort).boxed(),
        Op::RepeatBroken => Just(Command::RepeatBroken).boxed(),
        Op::ResolutionOf => (axis(), number())
            .prop_map(|(axis, resolution)| Command::Resolution { axis: Some(axis), resolution })
            .boxed(),
        Op::Resolution => {
            number().prop_map(|resolution| Command::Resolution { axis: None, resolution }).boxed()
        }
        Op::Range => (axis(), pair())
            .prop_map(|(axis, [min, max])| Command::Range { axis, min, max })
            .boxed(),
        Op::DrillingTimes => times(Command::DrillingTimes),
        Op::MillingTimes => times(Command::MillingTimes),
        Op::SettlingTime => time().prop_map(Command::SettlingTime).boxed(),
        Op::Wait => time().prop_map(Command::Wait).boxed(),
        Op::AxisSpeed => value_on(|axis, speed| Command::AxisSpeed { axis, speed }),
        Op::TravelSpeed => one(Command::TravelSpeed),
        Op::ZSpeed => one(Command::ZSpeed),
        Op::WritePort => {
            any::<(u8, u16)>().prop_map(|(port, data)| Command::WritePort { port, data }).boxed()
        }
        Op::MoveAxisAbsolute => value_on(|axis, to| Command::MoveAxisAbsolute { axis, to }),
        Op::MoveZAbsolute => one(Command::MoveZAbsolute),
        Op::MoveAxisRelative => value_on(|axis, by| Command::MoveAxisRelative { axis, by }),
        Op::MoveZRelative => one(Command::MoveZRelative),
        Op::ClearBuffer => Just(Command::ClearBuffer).boxed(),
        Op::GoOn => Just(Command::GoOn).boxed(),
        Op::Repeat => Just(Command::Repeat).boxed(),
        Op::Stop => Just(Command::Stop).boxed(),
        Op::SpaceAbsolute => space().prop_map(Command::SpaceAbsolute).boxed(),
        Op::SpaceRelative => space().prop_map(Command::SpaceRelative).boxed(),
    }
}

#[test]
fn what_is_printed_reads_as_the_same() {
    for model in Dialect::ALL {
        for form in forms().iter().filter(|form| form.known_to(model)) {
            let config = Config { cases: 64, failure_persistence: None, ..Config::default() };
            TestRunner::new(config)
                .run(&commands(form.op), |command| {
                    prop_assert_eq!(command.op(), form.op);
                    prop_assert_eq!(command.is_direct(), form.direct);
                    let printed = print(&command);
                    let what = printed.escape_ascii().to_string();
                    prop_assert_eq!(parse(&printed, model), Ok(command.clone()), "{}", &what);
                    // On the line it is one item; what the `;` ended is its raw form.
                    let raw = printed.strip_suffix(b";").unwrap_or_default();
                    let raw = raw.trim_ascii_end().to_vec();
                    let item = Item::Command { raw, command: Ok(command.clone()) };
                    prop_assert_eq!(items(model, &printed), vec![item], "{}", &what);
                    prop_assert!(!command.describe().is_empty());
                    Ok(())
                })
                .unwrap();
        }
    }
}

#[test]
fn on_the_other_model_it_is_unknown() {
    use crate::language::Status::UnknownCommand;
    let mut runner = TestRunner::deterministic();
    let mut unknown = BTreeSet::new();
    for model in Dialect::ALL {
        for form in forms().iter().filter(|form| !form.known_to(model)) {
            let command = commands(form.op).new_tree(&mut runner).unwrap().current();
            assert_eq!(parse(&print(&command), model), Err(UnknownCommand), "{}", form.mnemonic);
            unknown.insert(form.mnemonic);
        }
    }
    assert_eq!(unknown.len(), 35);
}
