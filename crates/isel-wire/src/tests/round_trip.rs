//! Printing and reading are inverse to each other, for every command of every table.

use std::collections::BTreeSet;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use proptest::test_runner::{Config, TestRunner};

use super::{CONFIGURATIONS, Ports, axes, context, frame, print};
use crate::decode::PortMap;
use crate::table::diagnosis_codes;
use crate::{
    ArcArgs, AxisSet, Bit, BitTest, Command, Dialect, Direction, Init, Mode, Op, Pair, Pairs,
    Plane, PortTest, Speeds, Text32, table,
};

const LONG: std::ops::RangeInclusive<i32> = -(1 << 23)..=(1 << 23) - 1;

fn speed() -> impl Strategy<Value = u32> + Clone {
    20_u32..=20_000
}

fn pairs(axes: AxisSet) -> impl Strategy<Value = Pairs> {
    let count = if axes.bits() == 7 { 4 } else { axes.count() };
    let pair = (LONG, speed()).prop_map(|(steps, speed)| Pair { steps, speed });
    vec(pair, count).prop_map(|pairs| Pairs::new(&pairs).unwrap())
}

/// As many as axes, or four with zeros for those that are not configured.
fn speeds(axes: AxisSet) -> impl Strategy<Value = Speeds> {
    let one_each = vec(speed(), axes.count());
    let four = vec(speed(), 4).prop_map(move |mut speeds| {
        for (axis, speed) in speeds.iter_mut().enumerate() {
            if !axes.has(axis) {
                *speed = 0;
            }
        }
        speeds
    });
    prop_oneof![one_each, four].prop_map(|speeds| Speeds::new(&speeds).unwrap())
}

/// What `R`, `n` and `N` take: X, Y and Z together or A alone, if they are configured.
fn configured(axes: AxisSet) -> impl Strategy<Value = AxisSet> {
    let possible: Vec<_> =
        (1..=8).filter_map(AxisSet::from_bits).filter(|&set| axes.contains(set)).collect();
    select(possible)
}

fn mask() -> impl Strategy<Value = AxisSet> {
    (0_u8..=15).prop_map(axes)
}

fn arc() -> impl Strategy<Value = ArcArgs> {
    let signs = || select(vec![-1_i8, 1]);
    (0..=LONG.end().unsigned_abs(), speed(), LONG, LONG, LONG, signs(), signs())
        .prop_map(|(steps, speed, d, x, y, rx, ry)| ArcArgs { steps, speed, d, x, y, rx, ry })
}

fn port_test(ports: Vec<u16>) -> impl Strategy<Value = PortTest> {
    (select(ports), any::<u8>(), any::<u8>()).prop_map(|(port, mask, value)| PortTest {
        port,
        mask,
        value,
    })
}

fn readable() -> Vec<u16> {
    (0..=u16::MAX).filter(|&port| Ports.reads(port)).collect()
}

fn writable() -> Vec<u16> {
    (0..=u16::MAX).filter(|&port| Ports.writes(port, 0)).collect()
}

/// A bit of a port, and a value it can have if the whole port can have values up to `limit`.
fn bit_test(ports: Vec<u16>, limit: fn(u16) -> u8) -> impl Strategy<Value = BitTest> {
    select(ports).prop_flat_map(move |port| {
        let one = (0_u8..=7, 0_u8..=1).prop_map(|(bit, value)| (Bit::One(bit), value));
        let byte = (0..=limit(port)).prop_map(|value| (Bit::Byte, value));
        prop_oneof![one, byte].prop_map(move |(bit, value)| BitTest { port, bit, value })
    })
}

fn offset() -> impl Strategy<Value = i32> {
    -32_768_i32..=32_767
}

/// Everything an operation can mean while these axes are configured.
#[expect(clippy::too_many_lines, reason = "it is a table")]
pub(crate) fn commands(op: Op, dialect: Dialect, axes: AxisSet) -> BoxedStrategy<Command> {
    let init = |strategy: BoxedStrategy<Init>| strategy.prop_map(Command::Init).boxed();
    match op {
        Op::SetAxes => {
            select(vec![1, 3, 7, 8]).prop_map(|bits| Command::SetAxes(super::axes(bits))).boxed()
        }
        Op::RelativeMove => pairs(axes).prop_map(Command::RelativeMove).boxed(),
        Op::AbsoluteMove => pairs(axes).prop_map(Command::AbsoluteMove).boxed(),
        Op::ReadPort => select(readable()).prop_map(Command::ReadPort).boxed(),
        Op::WritePort => select(writable())
            .prop_flat_map(|port| {
                let limit: u8 = if Ports.writes(port, 255) { 255 } else { 1 };
                (0..=limit).prop_map(move |value| Command::WritePort { port, value })
            })
            .boxed(),
        Op::ReferenceSpeeds => speeds(axes).prop_map(Command::ReferenceSpeeds).boxed(),
        Op::Diagnosis => {
            let codes = diagnosis_codes(dialect).chunks_exact(2);
            let codes: Vec<_> = codes.map(|code| <[u8; 2]>::try_from(code).unwrap()).collect();
            select(codes).prop_map(Command::Diagnosis).boxed()
        }
        Op::Plane => select(vec![Plane::Xy, Plane::Xz, Plane::Yz]).prop_map(Command::Plane).boxed(),
        Op::Direction => select(vec![Direction::Clockwise, Direction::Counterclockwise])
            .prop_map(Command::Direction)
            .boxed(),
        Op::Free => configured(axes)
            .prop_filter("one axis", |axes| axes.count() == 1)
            .prop_map(Command::Free)
            .boxed(),
        Op::Brake => any::<bool>().prop_map(Command::Brake).boxed(),
        Op::DeviceNumber => (0_u8..=9).prop_map(Command::DeviceNumber).boxed(),
        Op::LimitStatus => Just(Command::LimitStatus).boxed(),
        Op::Status => Just(Command::Status).boxed(),
        Op::Store => Just(Command::Store).boxed(),
        Op::InitDirections => init(mask().prop_map(Init::Directions).boxed()),
        Op::InitReferences => init(mask().prop_map(Init::References).boxed()),
        Op::InitHardwareStatus => init(any::<u8>().prop_map(Init::HardwareStatus).boxed()),
        Op::InitRotaryL => init(mask().prop_map(Init::RotaryL).boxed()),
        Op::InitDefaultSpeeds => {
            let four = [speed(), speed(), speed(), speed()];
            init(four.prop_map(Init::DefaultSpeeds).boxed())
        }
        Op::InitFreeSteps => {
            let steps = || 0..=*LONG.end();
            init([steps(), steps(), steps(), steps()].prop_map(Init::FreeSteps).boxed())
        }
        Op::InitDefaultAcceleration => {
            init((1_u32..=4000).prop_map(Init::DefaultAcceleration).boxed())
        }
        Op::InitDefaultStartStop => init((20_u32..=4000).prop_map(Init::DefaultStartStop).boxed()),
        Op::InitIoOnly => init(any::<bool>().prop_map(Init::IoOnly).boxed()),
        Op::InitLimits => init(any::<u16>().prop_map(Init::Limits).boxed()),
        Op::InitSwapLimits => init(mask().prop_map(Init::SwapLimits).boxed()),
        Op::InitAxisTypes => init(mask().prop_map(Init::AxisTypes).boxed()),
        Op::InitAbort => init(port_test(readable()).prop_map(Init::Abort).boxed()),
        Op::InitErrorSignal => init(port_test(writable()).prop_map(Init::ErrorSignal).boxed()),
        Op::InitCover => init(port_test(readable()).prop_map(Init::Cover).boxed()),
        Op::InitEmergency => init(port_test(readable()).prop_map(Init::Emergency).boxed()),
        Op::InitBaud9600 => init(any::<bool>().prop_map(Init::Baud9600).boxed()),
        Op::InitUserInfo => {
            let text = vec(any::<u8>(), 0..=Text32::MAX);
            init(
                text.prop_filter_map("carried", |text| Text32::new(&text))
                    .prop_map(Init::UserInfo)
                    .boxed(),
            )
        }
        Op::InitLoad => init(Just(Init::Load).boxed()),
        Op::InitWrite => init(Just(Init::Write).boxed()),
        Op::InitFactory => init(Just(Init::Factory).boxed()),
        Op::StartStop => (20_u32..=4000).prop_map(Command::StartStop).boxed(),
        Op::Acceleration => (1_u32..=4000).prop_map(Command::Acceleration).boxed(),
        Op::Erase => Just(Command::Erase).boxed(),
        Op::Zero => configured(axes).prop_map(Command::Zero).boxed(),
        Op::SimulateReference => configured(axes).prop_map(Command::SimulateReference).boxed(),
        Op::Position => Just(Command::Position).boxed(),
        Op::Reference => configured(axes).prop_map(Command::Reference).boxed(),
        Op::Start => Just(Command::Start).boxed(),
        Op::TestMode => any::<bool>().prop_map(Command::TestMode).boxed(),
        Op::UserInfo => Just(Command::UserInfo).boxed(),
        Op::Version => Just(Command::Version).boxed(),
        Op::SelfTest => Just(Command::SelfTest).boxed(),
        Op::Helix => (arc(), LONG)
            .prop_filter("B = 0 means S3 = 0", |(arc, third)| arc.steps > 0 || *third == 0)
            .prop_map(|(arc, third)| Command::Helix(arc, third))
            .boxed(),
        Op::Circle => arc().prop_map(Command::Circle).boxed(),
        Op::Interpolation3d => any::<bool>().prop_map(Command::Interpolation3d).boxed(),
        Op::MoveUntil => (port_test(readable()), speed(), vec(LONG, axes.count()))
            .prop_map(|(test, speed, given)| {
                let mut steps = [0; 4];
                steps[..given.len()].copy_from_slice(&given);
                Command::MoveUntil { test, speed, steps, count: given.len() as u8 }
            })
            .boxed(),
        Op::SendSync => (33_u8..=126).prop_map(Command::SendSync).boxed(),
        Op::AwaitSync => (33_u8..=126, offset())
            .prop_map(|(character, offset)| Command::AwaitSync { character, offset })
            .boxed(),
        Op::Loop => prop_oneof![
            offset().prop_map(|offset| Command::Branch { offset }),
            (1_u16..=32_767, -32_768_i32..=-1)
                .prop_map(|(count, offset)| Command::Loop { count, offset }),
        ]
        .boxed(),
        Op::Delay => {
            (0..=LONG.end().unsigned_abs()).prop_map(|tenths| Command::Delay { tenths }).boxed()
        }
        Op::Until => bit_test(vec![0], |_| 255).prop_map(Command::Until).boxed(),
        Op::SetPort => bit_test(writable(), |port| if Ports.writes(port, 255) { 255 } else { 1 })
            .prop_map(Command::SetPort)
            .boxed(),
        Op::BranchIf => {
            let test = bit_test(readable(), |port| if Ports.is_logical(port) { 1 } else { 255 });
            (test, offset()).prop_map(|(test, offset)| Command::BranchIf { test, offset }).boxed()
        }
        Op::End => Just(Command::End).boxed(),
    }
}

#[test]
fn what_is_printed_is_read_as_the_same_command() {
    for dialect in Dialect::ALL {
        for mode in Mode::ALL {
            let rows = table(dialect, mode);
            let mut printed = BTreeSet::new();
            for row in rows {
                for bits in CONFIGURATIONS {
                    let ctx = context(axes(bits));
                    let config =
                        Config { cases: 32, failure_persistence: None, ..Config::default() };
                    TestRunner::new(config)
                        .run(&commands(row.op, dialect, axes(bits)), |command| {
                            prop_assert_eq!(command.op(mode), row.op);
                            let line = print(&command, dialect, mode);
                            let frame = frame(&line, dialect, mode).unwrap();
                            prop_assert_eq!(frame.spec(), row);
                            let read = frame.decode(&ctx);
                            prop_assert_eq!(read, Ok(command), "{}", line.escape_ascii());
                            Ok(())
                        })
                        .unwrap();
                }
                printed.insert(row.op);
            }
            assert_eq!(printed.len(), rows.len());
        }
    }
}

#[test]
fn a_command_the_dialect_lacks_prints_nothing() {
    for (command, dialect, mode) in [
        (Command::Erase, Dialect::Imc4, Mode::Direct),
        (Command::Position, Dialect::ImcXx, Mode::Stored),
        (Command::End, Dialect::Imc4, Mode::Direct),
        (Command::SelfTest, Dialect::ImcXx, Mode::Direct),
        (Command::Init(Init::Load), Dialect::Imc4M, Mode::Direct),
    ] {
        assert_eq!(print(&command, dialect, mode), b"", "{command:?}");
    }
}

#[test]
fn the_device_number_is_printed() {
    let mut line = b"kept ".to_vec();
    Command::Position.print(Dialect::ImcXx, Mode::Direct, 7, &mut line);
    assert_eq!(line, b"kept @7P");
}
