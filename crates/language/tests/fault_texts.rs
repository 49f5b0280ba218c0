//! Faults as people type them.

use proptest::prelude::*;

use std::time::Duration;

use vimc4_device::{
    Awaited, BadByte, Chance, Condition, Damage, Fault, FaultNumber, Faulting, Garbling, LineFault,
    MachineFault, Mishap, Names, Signal, SignalId, SwitchSays, Time, Way, When,
};
use vimc4_language::{read_condition, read_fault, read_faulting};

fn names() -> Names {
    let stop = Signal::button(SignalId(3), "stop", "");
    Names::new([(0, "X".to_owned()), (2, "Z".to_owned())], vec![stop])
}

fn line(damage: Damage, way: Way, when: When) -> Fault {
    LineFault::new(damage, way, when).into()
}

fn machine(mishap: Mishap) -> Fault {
    MachineFault::new(mishap).into()
}

#[expect(clippy::too_many_lines, reason = "it is a table")]
#[test]
fn every_kind_is_understood() {
    let ms = Duration::from_millis;
    let after = |text: &str| When::once().after(read_condition(text, &names()).unwrap());
    for (text, fault) in [
        ("drop to-host", line(Damage::Drop, Way::ToHost, When::once())),
        ("drop to-host once", line(Damage::Drop, Way::ToHost, When::once())),
        ("drop both always", line(Damage::Drop, Way::Both, When::ALWAYS)),
        (
            "garble to-controller 2 bytes after @0A",
            LineFault::new(Damage::Garble(Garbling::Bit), Way::ToController, after("command @0A"))
                .bytes(2)
                .into(),
        ),
        (
            "garble flip 0x20 to-host 3rd byte",
            line(
                Damage::Garble(Garbling::Flip(0x20)),
                Way::ToHost,
                When { first: 3, ..When::once() },
            ),
        ),
        (
            r"garble into \xFF to-host",
            line(Damage::Garble(Garbling::Into(0xFF)), Way::ToHost, When::once()),
        ),
        (
            "duplicate to-host every 10th",
            line(Damage::Duplicate, Way::ToHost, When { first: 10, every: 10, ..When::ALWAYS }),
        ),
        ("delay 50ms to-host", line(Damage::Delay(ms(50)), Way::ToHost, When::once())),
        (
            r#"insert "0 \r" to-host when x > 1000"#,
            line(Damage::Insert("0 \r".into()), Way::ToHost, after("x > 1000")),
        ),
        ("split 2ms to-host always", line(Damage::Split(ms(2)), Way::ToHost, When::ALWAYS)),
        ("merge 16ms to-host always", line(Damage::Merge(ms(16)), Way::ToHost, When::ALWAYS)),
        (
            "parity zero to-host 1.5% seed 7",
            line(
                Damage::Parity(BadByte::Zero),
                Way::ToHost,
                When { chance: Chance::millionths(15_000), seed: 7, ..When::ALWAYS },
            ),
        ),
        (
            "framing to-controller once",
            line(Damage::Framing(BadByte::AsIs), Way::ToController, When::once()),
        ),
        ("cut", line(Damage::Cut, Way::Both, When::ALWAYS)),
        (
            "cut to-host for 200ms",
            line(Damage::Cut, Way::ToHost, When { lasts: Some(ms(200)), ..When::ALWAYS }),
        ),
        ("break 250ms", line(Damage::Break(ms(250)), Way::ToController, When::once())),
        ("speed 9600", line(Damage::Speed(9_600), Way::Both, When::ALWAYS)),
        (
            "drop to-host after command @0A then 2nd answered",
            line(
                Damage::Drop,
                Way::ToHost,
                When {
                    after: vec![
                        Awaited {
                            condition: read_condition("command @0A", &names()).unwrap(),
                            times: 1,
                        },
                        Awaited {
                            condition: read_condition("answered", &names()).unwrap(),
                            times: 2,
                        },
                    ],
                    ..When::once()
                },
            ),
        ),
        (
            "cut while x > 5",
            line(
                Damage::Cut,
                Way::Both,
                When::ALWAYS.during(read_condition("x > 5", &names()).unwrap()),
            ),
        ),
        (
            "switch x- closed",
            machine(Mishap::Switch { axis: 0, positive: false, says: SwitchSays::Pressed }),
        ),
        (
            "switch z+ late 30",
            machine(Mishap::Switch { axis: 2, positive: true, says: SwitchSays::Late(30) }),
        ),
        ("switch x swapped", machine(Mishap::Swapped(0))),
        ("backlash x 12", machine(Mishap::Backlash { axis: 0, steps: 12 })),
        ("load z 50", machine(Mishap::Load { axis: 2, pull: 50 })),
        ("jam x", machine(Mishap::Jam(0))),
        ("push x -40", machine(Mishap::Push { axis: 0, steps: -40 })),
        ("hold stop", machine(Mishap::Hold { signal: SignalId(3), value: 1 })),
        (
            "hold stop 0 after x > 5 while z < 0",
            MachineFault {
                when: When { times: None, ..after("x > 5") }
                    .during(read_condition("z < 0", &names()).unwrap()),
                ..MachineFault::new(Mishap::Hold { signal: SignalId(3), value: 0 })
            }
            .into(),
        ),
        (
            "bounce stop 5 2ms",
            machine(Mishap::Bounce { signal: SignalId(3), times: 5, period: ms(2) }),
        ),
        ("power-off", machine(Mishap::Power)),
    ] {
        assert_eq!(read_fault(text, &names()), Ok(fault), "{text}");
    }
    let wrong = read_fault("?", &names()).unwrap_err();
    let (_, kinds) = wrong.expected.split_once(": ").unwrap();
    for kind in kinds.split(", ") {
        let error = read_fault(kind, &names()).err();
        assert!(error.is_none_or(|error| !error.message().contains("a kind of fault")), "{kind}");
    }
}

#[test]
fn a_wrong_fault_says_where_and_what_would_be_right() {
    for (text, rest, right) in [
        ("", "", "a kind of fault: drop, garble"),
        ("dorp to-host", "dorp to-host", "a kind of fault: drop, garble"),
        ("drop", "", "to-host, to-controller or both"),
        ("drop to-hots", "to-hots", "to-host, to-controller or both"),
        ("drop to-host 0 bytes", "0 bytes", "at least 1 byte"),
        (
            "drop to-host 99999999999999999999 times",
            "99999999999999999999 times",
            "a smaller number",
        ),
        (
            "drop to-host 99999999999999999999 bytes",
            "99999999999999999999 bytes",
            "a smaller number",
        ),
        ("drop to-host 0th byte", "0th byte", "`1st byte`"),
        ("drop to-host 2th byte", "2th byte", "`2nd byte`"),
        ("drop to-host once 3 times", "3 times", "how often is said already"),
        ("drop to-host 3 times always", "always", "how often is said already"),
        ("drop to-host 1.23456%", "1.23456%", "at most four"),
        ("parity foo to-host", "foo to-host", "as-is, dropped, zero or marked"),
        (r"garble into \xZZ to-host", r"\xZZ to-host", "as in `into ?`"),
        ("speed 0", "0", "at least 1 bit a second"),
        ("switch x swapped to-host", "to-host", "or nothing: `for 200ms`"),
        ("power-off to-host", "to-host", "or nothing: `for 200ms`"),
        ("jam x for 5ms to-host", "to-host", "or nothing: `for 200ms`"),
        ("drop to-host twice", "twice", "`3 times`"),
        ("drop to-host 0 times", "0 times", "at least once"),
        ("drop to-host every 0", "0", "as in `every 10th`"),
        ("drop to-host every 3nd", "3nd", "as in `every 10th`"),
        ("drop to-host 101%", "101%", "no more than 100%"),
        ("drop to-host for 200", "200", "as in `for 200ms`"),
        ("delay to-host", "to-host", "as in `delay 50ms`"),
        ("insert to-host", "", "to-host, to-controller or both"),
        (r"insert \q to-host", r"\q to-host", r"as in `insert \xFF`"),
        (r#"insert "a to-host"#, r#""a to-host"#, r"as in `insert \xFF`"),
        ("garble flip 0 to-host", "0 to-host", "as in `flip 0x20`"),
        ("garble into ab to-host", "ab to-host", "as in `into ?`"),
        ("speed fast", "fast", "as in `speed 9600`"),
        ("drop to-host after", "", "a condition"),
        ("drop to-host after x > far", "far", "a position in steps"),
        ("drop to-host after x > far then idle", "far then idle", "a position in steps"),
        ("drop to-host after x > 5 then", "", "a condition"),
        ("drop to-host while", "", "a condition"),
        ("drop to-host while answered", "answered", "a state, which lasts"),
        ("drop to-host while x > far", "far", "a position in steps"),
        ("switch y- pressed", "y- pressed", "a limit switch or an axis"),
        ("switch x pressed", "pressed", "swapped"),
        ("switch x- broken", "broken", "pressed, released, missing or late"),
        ("switch x- late", "", "as in `switch x- late 30`"),
        ("backlash x", "", "as in `backlash x 12`"),
        ("jam", "", "an axis: x, z"),
        ("hold stopp", "stopp", "the name of a signal"),
        ("hold stop 7", "7", "0 or 1"),
        ("bounce stop 0 2ms", "0 2ms", "up to 255"),
        ("bounce stop 5", "", "a time"),
        ("bounce stop 5 0ms", "5 0ms", "a time apart"),
        ("jam x once", "once", "until it ends"),
    ] {
        let error = read_fault(text, &names()).unwrap_err();
        assert!(error.message().contains(right), "{text}: {error}");
        assert_eq!(&text[error.span.start..], rest, "{text}: {error}");
    }
    assert!(read_faulting("end", &names()).unwrap_err().message().contains("or all"));
    assert!(read_faulting("end all 3", &names()).is_err());
}

#[test]
fn what_is_done_about_faults_is_read_and_written() {
    let drop = || line(Damage::Drop, Way::ToHost, When::once());
    for (text, faulting) in [
        ("drop to-host once", Faulting::Begin(FaultNumber::NEXT, drop())),
        ("7 drop to-host once", Faulting::Begin(FaultNumber(7), drop())),
        ("end 3", Faulting::End(FaultNumber(3))),
        ("end all", Faulting::EndAll),
    ] {
        assert_eq!(read_faulting(text, Names::numbered()), Ok(faulting.clone()), "{text}");
        assert_eq!(faulting.to_string(), text);
    }
}

/// Any condition of the sorts that there are, as a person can type it.
fn conditions() -> impl Strategy<Value = Condition> {
    let one = prop_oneof![
        any::<i64>().prop_map(|position| Condition::AxisAt { axis: 0, position }),
        any::<i64>().prop_map(|position| Condition::AxisAbove { axis: 2, position }),
        (0..2).prop_map(|value| Condition::SignalIs { signal: SignalId(3), value }),
        Just(Condition::Idle),
        any::<u64>().prop_map(|nanos| Condition::At(Time::from_nanos(nanos >> 1))),
        prop::option::of(".{1,9}").prop_map(|like| Condition::Command { like }),
        ".{1,9}( then )?.{1,9}".prop_map(|text| Condition::Answer { text }),
        Just(Condition::Error { code: Some("then".to_owned()) }),
    ];
    prop::collection::vec(one, 1..3).prop_map(|mut parts| match parts.len() {
        1 => parts.remove(0),
        _ => Condition::All(parts),
    })
}

fn whens() -> impl Strategy<Value = When> {
    let awaited =
        (conditions(), 1..4_u32).prop_map(|(condition, times)| Awaited { condition, times });
    let numbers = (1..200_u64, 1..200_u64, 0..=1_000_000_u32);
    let others = (prop::option::of(1..9_u64), prop::option::of(0..u64::MAX / 2), any::<u64>());
    let states = conditions().prop_filter("it lasts", |condition| !condition.has_happenings());
    let during = prop::option::of(states);
    (prop::collection::vec(awaited, 0..3), numbers, others, during).prop_map(
        |(after, (first, every, chance), (times, lasts, seed), during)| When {
            after,
            first,
            every,
            chance: Chance::millionths(chance),
            times,
            lasts: lasts.map(Duration::from_nanos),
            during: during.map(Box::new),
            seed,
        },
    )
}

pub(crate) fn line_faults() -> impl Strategy<Value = LineFault> {
    let spans = || (0..u64::MAX / 2).prop_map(Duration::from_nanos);
    let bad = || (0..BadByte::ALL.len()).prop_map(|place| BadByte::ALL[place].0);
    let bytes = prop::collection::vec(any::<u8>(), 1..5);
    let damages = prop_oneof![
        Just(Damage::Drop),
        Just(Damage::Garble(Garbling::Bit)),
        (1..=u8::MAX).prop_map(|mask| Damage::Garble(Garbling::Flip(mask))),
        any::<u8>().prop_map(|byte| Damage::Garble(Garbling::Into(byte))),
        Just(Damage::Duplicate),
        spans().prop_map(Damage::Delay),
        bytes.prop_map(|bytes| Damage::Insert(bytes.into())),
        spans().prop_map(Damage::Split),
        spans().prop_map(Damage::Merge),
        bad().prop_map(Damage::Parity),
        bad().prop_map(Damage::Framing),
        Just(Damage::Cut),
        spans().prop_map(Damage::Break),
        (1..=u32::MAX).prop_map(Damage::Speed),
    ];
    let ways = prop_oneof![Just(Way::ToHost), Just(Way::ToController), Just(Way::Both)];
    (damages, ways, 1..=u32::MAX, whens()).prop_map(|(damage, way, run, when)| LineFault {
        damage,
        way,
        run,
        when,
    })
}

fn machine_faults() -> impl Strategy<Value = MachineFault> {
    let axis = || prop_oneof![Just(0_u8), Just(2_u8)];
    let signal = || Just(SignalId(3));
    let says = prop_oneof![
        Just(SwitchSays::Pressed),
        Just(SwitchSays::Released),
        Just(SwitchSays::Nothing),
        any::<u32>().prop_map(SwitchSays::Late),
    ];
    let spans = (1..u64::MAX / 2).prop_map(Duration::from_nanos);
    let mishaps = prop_oneof![
        (axis(), any::<bool>(), says).prop_map(|(axis, positive, says)| Mishap::Switch {
            axis,
            positive,
            says
        }),
        axis().prop_map(Mishap::Swapped),
        (axis(), any::<u32>()).prop_map(|(axis, steps)| Mishap::Backlash { axis, steps }),
        (axis(), any::<u32>()).prop_map(|(axis, pull)| Mishap::Load { axis, pull }),
        axis().prop_map(Mishap::Jam),
        (axis(), any::<i64>()).prop_map(|(axis, steps)| Mishap::Push { axis, steps }),
        (signal(), 0..2).prop_map(|(signal, value)| Mishap::Hold { signal, value }),
        (signal(), 1..=u8::MAX, spans).prop_map(|(signal, times, period)| Mishap::Bounce {
            signal,
            times,
            period
        }),
        Just(Mishap::Power),
    ];
    (mishaps, whens()).prop_map(|(mishap, when)| MachineFault {
        mishap,
        when: When { after: when.after, lasts: when.lasts, during: when.during, ..When::ALWAYS },
    })
}

#[test]
fn a_quoted_text_keeps_its_blanks() {
    let text = "insert \" 0 \" to-host always";
    let fault = read_fault(text, Names::numbered()).unwrap();
    assert_eq!(Names::numbered().write_fault(&fault), text);
}

proptest! {
    #[test]
    fn what_is_written_is_read(
        fault in prop_oneof![
            line_faults().prop_map(Fault::from),
            machine_faults().prop_map(Fault::from),
        ],
        number in any::<u32>(),
    ) {
        for names in [&names(), Names::numbered()] {
            let text = names.write_fault(&fault);
            prop_assert_eq!(read_fault(&text, names), Ok(fault.clone()), "{}", text);
            let faulting = Faulting::Begin(FaultNumber(number), fault.clone());
            let text = names.write_faulting(&faulting);
            prop_assert_eq!(read_faulting(&text, names), Ok(faulting), "{}", text);
        }
        let written = serde_json::to_string(&fault).unwrap();
        prop_assert_eq!(serde_json::from_str::<Fault>(&written).unwrap(), fault);
    }

    #[test]
    fn no_text_is_too_strange(text in "(drop|garble|insert|switch|x-|jam|hold|stop|after|then|while|to-host|2nd|every|5%|\"|\\\\x|for|x > 5| |.){0,12}") {
        if let Ok(fault) = read_fault(&text, &names()) {
            let written = names().write_fault(&fault);
            prop_assert_eq!(read_fault(&written, &names()), Ok(fault), "{}", written);
        }
    }
}
