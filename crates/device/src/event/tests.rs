use std::sync::atomic::{AtomicU32, Ordering};

use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use vimc4_motion::{Arc, ArcState, Chain, Helix, Path, Profile, Ramp, StraightLine, Stretch};

use super::*;
use crate::{
    AXES, Activity, Chance, CommandNumber, Condition, Damage, LineFault, ScenarioNumber, Situation,
    Stamp, StopCause, Strike, Time, Way, When,
};

#[test]
fn warnings_say_what_happened_and_what_to_do() {
    let lost = |steps, um, how| Warning::StepsLost { axis: 0, name: "X".into(), steps, um, how };
    for (warning, text) in [
        (
            lost(-1_999, Some(24_988), Loss::AtEnd),
            "the X carriage stood at its end while the counter went on: 1,999 steps (24.988 mm) \
             lost; a reference run makes the two agree again",
        ),
        (
            lost(8, Some(100), Loss::Overran),
            "the X carriage ran on when its motor was halted without a ramp: 8 steps (0.1 mm) \
             lost; a reference run makes the two agree again",
        ),
        (
            lost(1_234_567, None, Loss::Overran),
            "the X carriage ran on when its motor was halted without a ramp: 1,234,567 steps \
             lost; a reference run makes the two agree again",
        ),
        (
            lost(-1, None, Loss::AtEnd),
            "the X carriage stood at its end while the counter went on: 1 step lost; a \
             reference run makes the two agree again",
        ),
        (Warning::ReceiveOverflow { lost: 1 }, "the receive buffer was full, 1 byte was lost"),
        (Warning::NobodyListens { lost: 2 }, "nobody has the line open, 2 bytes were lost"),
        (Warning::NoEffect { what: "a turn".into() }, "no effect: a turn"),
        (
            Warning::FalseReference { axis: 2, name: "Z".into() },
            "the reference of Z is false: STOP ended its reference run in place of the switch, \
             and where it stopped counts as 0; a complete reference run corrects it",
        ),
        (
            Warning::OffCircle {
                steps: 1_667,
                turns: None,
                remedy: "D 9, Rx 1, Ry -1 would end on it".into(),
            },
            "ends 1,667 steps off the circle; D 9, Rx 1, Ry -1 would end on it",
        ),
        (
            Warning::OffCircle { steps: 76, turns: Some(10), remedy: "D 9 would end there".into() },
            "the arc is 10 turns long and ends 76 steps from its start; D 9 would end there",
        ),
        (
            Warning::ProgramError { code: '2', line: 3, why: "limit switch X+ at step 9".into() },
            "the program ended in line 3 with error 2: limit switch X+ at step 9",
        ),
    ] {
        assert_eq!(warning.to_string(), text);
    }
}

// --- what is written is read again ---

fn texts() -> impl Strategy<Value = String> {
    prop_oneof!["[ -~]{0,8}", any::<String>()]
}

fn words() -> impl Strategy<Value = Cow<'static, str>> {
    prop_oneof![Just(Cow::Borrowed("@A")), texts().prop_map(Cow::Owned)]
}

fn bytes() -> impl Strategy<Value = Bytes> {
    any::<Vec<u8>>().prop_map(Bytes::from)
}

fn boxed() -> impl Strategy<Value = Box<str>> {
    texts().prop_map(String::into_boxed_str)
}

fn points() -> impl Strategy<Value = Point> {
    any::<[i32; AXES]>().prop_map(|point| point.map(i64::from))
}

fn segments() -> impl Strategy<Value = Box<Segment>> {
    let arc = || {
        let place = || -1_000..=1_000_i64;
        (0..3_usize, 1..3_usize, 1..=9_000_u64, place(), place()).prop_map(
            |(first, next, steps, x, y)| {
                let start = ArcState { x, y, d: 0, rx: 1, ry: -1 };
                Arc::new(first, (first + next) % 3, steps, start)
            },
        )
    };
    let lines = || points().prop_map(|delta| Path::Line(StraightLine::new(delta)));
    let paths = prop_oneof![
        lines(),
        arc().prop_map(Path::Arc),
        (arc(), -900..=900_i64).prop_map(|(arc, rise)| Path::Helix(Helix::new(arc, 5, rise))),
        prop::collection::vec(lines(), 1..4).prop_map(|links| Path::Chain(Chain::new(links))),
    ];
    let ramp = (20..=2_000_u32, 1..=1_000_u32)
        .prop_map(|(start_stop, acceleration)| Ramp { start_stop, acceleration });
    let profiles = (any::<bool>(), 1..=10_000_u32, ramp, 0..=1_000_000_000_u64);
    (paths, profiles).prop_map(|(path, (course, speed, ramp, braked))| {
        let steps = path.length();
        let profile = if course {
            let stretch = Stretch { steps, length: steps.saturating_mul(6_250) };
            Profile::trapezoid([stretch], u64::from(speed) * 10_000, 1_000_000_000)
        } else {
            Profile::new(steps, speed, ramp)
        };
        let profile = profile.brake(braked).unwrap_or(profile);
        Box::new(Segment { path, profile })
    })
}

fn losses() -> impl Strategy<Value = Loss> {
    prop_oneof![Just(Loss::AtEnd), Just(Loss::Overran), Just(Loss::Stalled), Just(Loss::Pushed)]
}

fn warnings() -> impl Strategy<Value = Warning> {
    let axis = || 0..6_u8;
    prop_oneof![
        any::<u64>().prop_map(|lost| Warning::ReceiveOverflow { lost }),
        any::<u64>().prop_map(|lost| Warning::NobodyListens { lost }),
        words().prop_map(|what| Warning::NoEffect { what }),
        (axis(), words(), any::<i64>(), any::<Option<u64>>(), losses()).prop_map(
            |(axis, name, steps, um, how)| Warning::StepsLost { axis, name, steps, um, how }
        ),
        (axis(), words()).prop_map(|(axis, name)| Warning::FalseReference { axis, name }),
        (axis(), words()).prop_map(|(axis, name)| Warning::EndlessReference { axis, name }),
        (axis(), words(), any::<i64>()).prop_map(|(axis, name, reads)| Warning::CounterWrapped {
            axis,
            name,
            reads
        }),
        (any::<u64>(), any::<Option<u64>>(), words())
            .prop_map(|(steps, turns, remedy)| Warning::OffCircle { steps, turns, remedy }),
        Just(Warning::SpindleOff),
        (any::<char>(), any::<u32>(), boxed())
            .prop_map(|(code, line, why)| Warning::ProgramError { code, line, why }),
    ]
}

fn events() -> impl Strategy<Value = Event> {
    let motions = prop_oneof![
        (points(), segments()).prop_map(|(origin, segment)| Motion::Begins { origin, segment }),
        segments().prop_map(|segment| Motion::Changes { segment }),
        any::<u64>().prop_map(|steps| Motion::Ends { steps }),
    ];
    prop_oneof![
        1 => (words(), bytes()).prop_map(|(mnemonic, bytes)| Event::Command { mnemonic, bytes }),
        1 => (bytes(), words()).prop_map(|(bytes, why)| Event::Ignored { bytes, why }),
        1 => (any::<u32>(), words()).prop_map(|(line, mnemonic)| Event::Line { line, mnemonic }),
        1 => (words(), bytes(), prop::option::of(boxed()))
            .prop_map(|(mnemonic, bytes, why)| Event::Answer { mnemonic, bytes, why }),
        1 => (words(), words())
            .prop_map(|(mnemonic, why)| Event::CutShort { mnemonic, why }),
        3 => motions.prop_map(Event::Motion),
        1 => (0..6_u8, any::<bool>(), any::<bool>())
            .prop_map(|(axis, positive, active)| Event::Switch { axis, positive, active }),
        1 => (any::<u16>(), any::<i32>()).prop_map(|(signal, value)| Event::Signal {
            signal: SignalId(signal),
            value,
        }),
        1 => (any::<u16>(), any::<u8>()).prop_map(|(port, value)| Event::Port { port, value }),
        1 => words().prop_map(|what| Event::Flash { what }),
        1 => any::<u32>().prop_map(|baud| Event::Baud { baud }),
        2 => faults().prop_map(|(number, news)| Event::Fault { number: FaultNumber(number), news }),
        2 => rules().prop_map(|(rule, news)| Event::Rule { rule, news }),
        3 => warnings().prop_map(Event::Warning),
        2 => courses().prop_map(Event::Course),
    ]
}

fn courses() -> impl Strategy<Value = Course> {
    let situations = || {
        let situations = [
            Situation::Doing(Activity::Move),
            Situation::StoppedMotion,
            Situation::Looping(Activity::ProgramDelay),
        ];
        prop::sample::select(situations.to_vec())
    };
    let causes = prop::sample::select(vec![StopCause::StopByte, StopCause::Cover]);
    prop_oneof![
        (words(), situations())
            .prop_map(|(mnemonic, situation)| Course::Finds { mnemonic, situation }),
        (words(), causes, situations()).prop_map(|(mnemonic, cause, situation)| Course::Stops {
            mnemonic,
            cause,
            situation
        }),
    ]
}

fn rules() -> impl Strategy<Value = (RuleId, RuleNews)> {
    let deed = || "press stop".to_owned();
    let news = prop_oneof![
        Just(RuleNews::Begins),
        any::<u32>()
            .prop_map(move |number| RuleNews::Acts(vec![deed()], vec![FaultNumber(number)])),
        texts().prop_map(move |why| RuleNews::Cannot(deed(), why)),
        Just(RuleNews::SetsBack),
        Just(RuleNews::Runaway),
        Just(RuleNews::Ends),
    ];
    let id = (any::<u32>(), any::<u32>(), prop::option::of(texts()));
    let id = id.prop_map(|(number, place, name)| RuleId {
        scenario: ScenarioNumber(number),
        place,
        name,
    });
    (id, news)
}

fn faults() -> impl Strategy<Value = (u32, FaultNews)> {
    let bytes = || prop::collection::vec(any::<u8>(), 0..4).prop_map(Bytes::from);
    let strike = |(sent, arrives, late)| {
        let way = Way::ToHost;
        FaultNews::Strikes(Strike::Line { way, sent, arrives, late })
    };
    let far = Condition::AxisAbove { axis: 0, position: 5 };
    let when = When { chance: Chance::percent(5), ..When::ALWAYS.after(far) };
    let fault = LineFault::new(Damage::Drop, Way::Both, when);
    let news = prop_oneof![
        Just(FaultNews::Begins(Box::new(fault.into()))),
        Just(FaultNews::Armed),
        (bytes(), bytes(), any::<u64>()).prop_map(strike),
        Just(FaultNews::Ends),
    ];
    (any::<u32>(), news)
}

/// A number for each variant. A new variant must be added here and then above.
fn variant(event: &Event) -> u32 {
    match event {
        Event::Command { .. } => 0,
        Event::Ignored { .. } => 1,
        Event::Line { .. } => 2,
        Event::Answer { .. } => 3,
        Event::Motion(Motion::Begins { .. }) => 4,
        Event::Motion(Motion::Changes { .. }) => 5,
        Event::Motion(Motion::Ends { .. }) => 6,
        Event::Switch { .. } => 7,
        Event::Port { .. } => 8,
        Event::Flash { .. } => 9,
        Event::Baud { .. } => 10,
        Event::Warning(Warning::ReceiveOverflow { .. }) => 11,
        Event::Warning(Warning::NobodyListens { .. }) => 12,
        Event::Warning(Warning::NoEffect { .. }) => 13,
        Event::Warning(Warning::StepsLost { .. }) => 14,
        Event::Warning(Warning::FalseReference { .. }) => 15,
        Event::Warning(Warning::ProgramError { .. }) => 16,
        Event::Signal { .. } => 17,
        Event::CutShort { .. } => 18,
        Event::Warning(Warning::EndlessReference { .. }) => 19,
        Event::Warning(Warning::CounterWrapped { .. }) => 20,
        Event::Fault { .. } => 21,
        Event::Course(Course::Finds { .. }) => 22,
        Event::Course(Course::Stops { .. }) => 23,
        Event::Rule { .. } => 24,
        Event::Warning(Warning::OffCircle { .. }) => 25,
        Event::Warning(Warning::SpindleOff) => 26,
    }
}

/// How many variants there are.
const VARIANTS: u32 = 27;

#[test]
fn what_is_written_is_read_again() {
    let seen = AtomicU32::new(0);
    let number = any::<Option<std::num::NonZeroU64>>();
    let stamps = (any::<u64>(), number).prop_map(|(nanos, number)| Stamp {
        at: Time::from_nanos(nanos),
        command: number.map(CommandNumber),
    });
    TestRunner::deterministic()
        .run(&(stamps, events()), |written| {
            seen.fetch_or(1 << variant(&written.1), Ordering::Relaxed);
            let text = serde_json::to_string(&written).unwrap();
            let read: (Stamp, Event) = serde_json::from_str(&text).unwrap();
            prop_assert_eq!(&read, &written, "{}", text);
            Ok(())
        })
        .unwrap();
    assert_eq!(seen.into_inner(), (1 << VARIANTS) - 1, "a variant was never made");
}

/// Recordings outlive programs: what was once written must stay readable.
#[test]
fn the_written_form_stays_as_it_is() {
    for (event, text) in [
        (
            Event::Command { mnemonic: "@A".into(), bytes: "@0A5,9".into() },
            r#"{"event":"command","mnemonic":"@A","bytes":[64,48,65,53,44,57]}"#,
        ),
        (
            Event::Answer { mnemonic: "@A".into(), bytes: "0".into(), why: None },
            r#"{"event":"answer","mnemonic":"@A","bytes":[48]}"#,
        ),
        (
            Event::Motion(Motion::Ends { steps: 5 }),
            r#"{"event":"motion","motion":"ends","steps":5}"#,
        ),
        (
            Event::Warning(Warning::NoEffect { what: "a turn".into() }),
            r#"{"event":"warning","warning":"no-effect","what":"a turn"}"#,
        ),
    ] {
        assert_eq!(serde_json::to_string(&event).unwrap(), text);
        assert_eq!(serde_json::from_str::<Event>(text).unwrap(), event);
    }
    let stamp = Stamp { at: Time::from_millis(1), command: Some(CommandNumber::FIRST.next()) };
    assert_eq!(serde_json::to_string(&stamp).unwrap(), r#"{"at":1000000,"command":2}"#);
    let unasked = Stamp::from(Time::from_millis(1));
    assert_eq!(serde_json::to_string(&unasked).unwrap(), r#"{"at":1000000}"#);
    assert_eq!(serde_json::from_str::<Stamp>(r#"{"at":1000000}"#).unwrap(), unasked);
}
