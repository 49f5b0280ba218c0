//! Conditions: what they mean, and how they are written.

#![expect(clippy::too_many_lines, reason = "one test is one story")]
#![expect(clippy::unwrap_used, reason = "tests end at what they do not expect")]

#[path = "../../device/tests/cart/mod.rs"]
mod cart;

use cart::Cart;
use proptest::prelude::*;
use vimc4_device::{
    AXES, Condition, Event, Harness, Input, Kinds, Names, Output, Signal, SignalId, Time,
    Vocabulary,
};
use vimc4_language::read_condition;

/// A condition in which axes and signals are numbers.
fn numbered(text: &str) -> Condition {
    read_condition(text, Names::numbered()).unwrap()
}

fn ms(millis: u64) -> Time {
    Time::from_millis(millis)
}

/// Names of a device that has a bit of everything.
fn names() -> Names {
    let axes = (0..).zip(["X", "Y", "Z", "A"].map(str::to_owned));
    Names::new(
        axes,
        vec![
            Signal::button(SignalId(0), "stop", ""),
            Signal::switch(SignalId(1), "cover", ["open", "closed"], ""),
            Signal::input(SignalId(2), "limit x-", ""),
            Signal::input(SignalId(3), "limit", ""),
            Signal::analogue(SignalId(9), "ball x", (-9, 9), ""),
        ],
    )
}

// --- what they mean ---

/// Runs a cart until a condition holds: when that is, and what has come out by then.
fn run(lines: &str, condition: &Condition) -> (Option<Time>, Vec<u8>) {
    let mut cart = Harness::new(Cart::default());
    cart.plan(Time::ZERO, Input::Bytes(lines.as_bytes()));
    cart.plan(ms(30), Input::Signal(Cart::STOP, 1));
    cart.plan(ms(31), Input::Bytes(b"p\r"));
    (cart.run_until(condition), cart.take_bytes())
}

#[test]
fn happenings_are_seen_in_the_moment_in_which_they_happen() {
    for (lines, condition, at, said) in [
        // All of these happen at 3 ms, one after the other.
        ("m3\rp\rfx\rm9\r", "answered m", Some(3), "0"),
        ("m3\rp\rfx\rm9\r", "command p", Some(3), "03"),
        ("m3\rp\rfx\rm9\r", "answer 3", Some(3), "03"),
        ("m3\rp\rfx\rm9\r", "command fx", Some(3), "030"),
        ("m3\rp\rfx\rm9\r", "command m9", Some(3), "030"),
        ("m3\rp\rfx\rm9\r", "command", Some(0), ""),
        ("m3\rp\rfx\rm9\r", "answered m and x = 12", Some(12), "0300"),
        ("m3\rp\rfx\rm9\r", "answered m and x > 3 or answered f", Some(3), "030"),
        ("m3\rp\rfx\rm9\r", "(answered f or answered m) and x = 12", Some(12), "0300"),
        // From outside.
        ("m99\r", "signal stop changes", Some(30), "stopped"),
        ("m99\r", "signal stop changes to 1", Some(30), "stopped"),
        ("m99\r", "answer error", Some(30), "stopped"),
        ("m99\r", "answer error topped", Some(30), "stopped"),
        ("m99\r", "answer error other", None, "stopped30"),
        ("m9\r", "answer error", None, "09"),
        ("m99\r", "answer error and answer stopped and answered m", Some(30), "stopped"),
        ("m99\r", "command p and signal stop changes", None, "stopped30"),
        ("m99\r", "signal stop changes and x = 30", Some(30), "stopped"),
        ("m99\r", "line", None, "stopped30"),
    ] {
        let expected = (at.map(ms), said.as_bytes().to_vec());
        let read = read_condition(condition, &Names::of(&Cart::default())).unwrap();
        assert_eq!(run(lines, &read), expected, "{condition}");
    }
}

#[test]
fn states_hold_together_at_the_first_instant_of_all() {
    for (condition, at) in [
        ("x > 10 and x < 20", Some(11)),
        ("x < 20 and x > 10 and at 0.015s", Some(15)),
        ("x = 5 and at 6ms", None),
        ("x = 5 and at 5ms", Some(5)),
        ("x = 5 and x = 6", None),
        ("x = 6 or x = 5", Some(5)),
        ("x > 10 and (x = 3 or x = 12 or x = 14)", Some(12)),
        ("idle and x > 3", Some(30)),
        ("idle", Some(30)),
        ("at 7ms", Some(7)),
        ("at 90ms", Some(90)),
        ("always", Some(0)),
        ("never or x = 1", Some(1)),
        ("never", None),
        ("outside x 0..7", Some(8)),
        ("outside x -9..", None),
    ] {
        let read = read_condition(condition, &Names::of(&Cart::default())).unwrap();
        assert_eq!(run("m40\r", &read).0, at.map(ms), "{condition}");
    }
    // It looks between the steps, too.
    let between = numbered("axis0 = 5 and at 5.5ms or axis0 = 8 and at 8.25ms");
    assert_eq!(run("m40\r", &between).0, Some(Time::from_nanos(5_500_000)));
}

#[test]
fn what_is_needed_is_watched_only_meanwhile() {
    let mut cart = Harness::new(Cart::default()).watching(Kinds::WARNING);
    cart.plan(Time::ZERO, Input::Bytes(b"m3\rx\rm3\r"));
    assert_eq!(cart.run_until(&numbered("command m3")), Some(Time::ZERO));
    assert_eq!(cart.run_until(&numbered("command m3")), Some(ms(3)));
    cart.run_to_rest().unwrap();
    let events: Vec<_> = cart
        .drain()
        .filter_map(|output| match output {
            Output::Event(_, event) => Some(event.kind()),
            Output::Bytes(..) | Output::Flash(..) => None,
        })
        .collect();
    assert_eq!(events, [Kinds::WARNING]);
    // What was watched before still is.
    let mut cart = Harness::new(Cart::default()).watching(Kinds::COMMAND);
    cart.plan(Time::ZERO, Input::Bytes(b"m3\rp\r"));
    assert_eq!(cart.run_until(&numbered("answer 3")), Some(ms(3)));
    let commands = |cart: &Harness<Cart>| {
        let is = |output: &&Output| matches!(output, Output::Event(_, Event::Command { .. }));
        (cart.outputs().iter().filter(is).count(), cart.outputs().len())
    };
    assert_eq!(commands(&cart), (2, 4));
    cart.send(b"p\r");
    assert_eq!(commands(&cart), (3, 6));
}

// --- how they are written ---

#[test]
fn conditions_read_as_people_type_them() {
    let all = |parts: &[Condition]| Condition::All(parts.to_vec());
    let any = |parts: &[Condition]| Condition::Any(parts.to_vec());
    let x = |position| Condition::AxisAt { axis: 0, position };
    let text = |text: &str| Some(text.to_owned());
    let (mut low, mut high) = ([i64::MIN; AXES], [i64::MAX; AXES]);
    (low[0], high[0], low[2]) = (-5, 5, 7);
    let port = Condition::PortBit { port: 2, bit: 0, level: true };
    for (typed, condition, written) in [
        ("z < -5000", Condition::AxisBelow { axis: 2, position: -5_000 }, "z < -5000"),
        ("Z<-5000", Condition::AxisBelow { axis: 2, position: -5_000 }, "z < -5000"),
        ("x >= 10", Condition::AxisAbove { axis: 0, position: 9 }, "x > 9"),
        ("x<=10", Condition::AxisBelow { axis: 0, position: 11 }, "x < 11"),
        ("x 2500", x(2_500), "x = 2500"),
        ("x = 2500", x(2_500), "x = 2500"),
        ("axis5 = 1", Condition::AxisAt { axis: 5, position: 1 }, "axis5 = 1"),
        ("outside x -5..5 Z 7..", Condition::Outside { low, high }, "outside x -5..5 z 7.."),
        ("port 2 bit 0 on", port.clone(), "port 2 bit 0 on"),
        ("PORT 2 BIT 0 1", port.clone(), "port 2 bit 0 on"),
        ("limit x+", Condition::Limit { axis: 0, positive: true, active: true }, "limit x+"),
        (
            "limit z- off",
            Condition::Limit { axis: 2, positive: false, active: false },
            "limit z- off",
        ),
        (
            "signal cover is open",
            Condition::SignalIs { signal: SignalId(1), value: 0 },
            "signal cover is open",
        ),
        (
            "signal limit x- is 1",
            Condition::SignalIs { signal: SignalId(2), value: 1 },
            "signal limit x- is 1",
        ),
        (
            "signal limit changes",
            Condition::SignalChanges { signal: SignalId(3), to: None },
            "signal limit changes",
        ),
        (
            "signal ball x changes to -9",
            Condition::SignalChanges { signal: SignalId(9), to: Some(-9) },
            "signal ball x changes to -9",
        ),
        (
            "signal 77 is 3",
            Condition::SignalIs { signal: SignalId(77), value: 3 },
            "signal 77 is 3",
        ),
        (" idle ", Condition::Idle, "idle"),
        ("at 250ms", Condition::At(ms(250)), "at 0.25s"),
        ("at 1.5min", Condition::At(Time::from_secs(90)), "at 90s"),
        ("command", Condition::Command { like: None }, "command"),
        ("command @0A", Condition::Command { like: text("@0A") }, "command @0A"),
        (
            r#"command "@0A 5, (\"\u{1b}""#,
            Condition::Command { like: text("@0A 5, (\"\u{1b}") },
            r#"command "@0A 5, (\"\u{1b}""#,
        ),
        ("answered @A", Condition::Answered { like: text("@A") }, "answered @A"),
        ("answer 0", Condition::Answer { text: "0".to_owned() }, "answer 0"),
        (r#"answer "error""#, Condition::Answer { text: "error".to_owned() }, r#"answer "error""#),
        ("answer error", Condition::Error { code: None }, "answer error"),
        ("answer error 2", Condition::Error { code: text("2") }, "answer error 2"),
        ("line 12", Condition::Line { line: Some(12) }, "line 12"),
        ("line or idle", any(&[Condition::Line { line: None }, Condition::Idle]), "line or idle"),
        (
            "idle and (x = 1 or x = 2)",
            all(&[Condition::Idle, any(&[x(1), x(2)])]),
            "idle and (x = 1 or x = 2)",
        ),
        (
            "(idle AND x = 1) OR ((x = 2))",
            any(&[all(&[Condition::Idle, x(1)]), x(2)]),
            "idle and x = 1 or x = 2",
        ),
        (
            "idle and (x = 1 and port 2 bit 0 on)",
            all(&[Condition::Idle, all(&[x(1), port])]),
            "idle and (x = 1 and port 2 bit 0 on)",
        ),
    ] {
        let read = read_condition(typed, &names()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(read, condition, "{typed}");
        assert_eq!(names().write(&read).to_string(), written, "{typed}");
    }
}

#[test]
fn what_cannot_happen_at_a_device_is_no_condition_there() {
    let words = |text: &str| text.split_whitespace().map(str::to_owned).collect();
    let known = Vocabulary {
        commands: words("@A @P !IS/1"),
        spellings: words("@a"),
        errors: words("2 E09 E0A"),
        ports: vec![0, 65_531],
        stores: true,
    };
    let names = names().with_vocabulary(Some(known.clone()));
    for right in [
        "command",
        "command @0A5000",
        "command @a",
        "command @07",
        "command \"@Z\"",
        "answered @A and x = 5",
        "answered !IS",
        "answer zz",
        "answer error",
        "answer error 9 or answer error 2",
        "answer error \"zz\"",
        "port 65531 bit 0 on",
        "line 7",
    ] {
        assert!(read_condition(right, &names).is_ok(), "{right}");
    }
    for (typed, wrong) in [
        ("command @Z", "is wrong at `@Z`: what a command begins with: @A, @P, !IS/1"),
        ("command A", "is wrong at `A`: what a command begins with"),
        ("answered @0A", "is wrong at `@0A`: a command without its numbers: @A, @P, !IS/1"),
        ("answer error zz", "is wrong at `zz`: an error of this model: 2, E09, E0A"),
        ("x = 1 or answer error 3", "is wrong at `3`: an error of this model"),
        ("port 99 bit 0 on", "is wrong at `99 bit 0 on`: a port to read: 0, 65531"),
    ] {
        let error = read_condition(typed, &names).unwrap_err().to_string();
        assert!(error.contains(wrong), "{typed}: {error}");
    }
    let none = Vocabulary { ports: Vec::new(), stores: false, ..known };
    let names = names.with_vocabulary(Some(none));
    let error = read_condition("port 0 bit 0 on", &names).unwrap_err().to_string();
    assert!(error.contains("a port to read: none"), "{error}");
    let error = read_condition("line 7", &names).unwrap_err().to_string();
    assert!(error.contains("this model stores no programs"), "{error}");
    // What is written is read again.
    let strange = Condition::Command { like: Some("@Z".to_owned()) };
    assert_eq!(names.write(&strange).to_string(), "command \"@Z\"");
    assert_eq!(read_condition("command \"@Z\"", &names), Ok(strange));
}

#[test]
fn a_wrong_condition_says_what_would_be_right() {
    let deep = format!("{}idle{}", "(".repeat(40), ")".repeat(40));
    for (typed, wrong) in [
        ("", "nothing is said: a condition, such as `x = 2500`"),
        ("dance", "`dance` is wrong: a condition, such as"),
        ("b = 5", "or `line 12`, where axes are x, y, z, a"),
        ("z < five", "`z < five` is wrong at `five`: a position in steps, as in `z < -5000`"),
        ("z <", "`z <` is not finished: a position in steps"),
        ("x = 1 and", "is not finished: a condition, such as"),
        ("x = 1 y = 2", "is wrong at `y = 2`: `and`, `or`, or nothing more"),
        ("(x = 1", "is not finished: `and`, `or`, or `)`"),
        ("x = 1)", "is wrong at `)`: `and`, `or`, or nothing more"),
        ("outside", "is not finished: an axis and its limits, as in `outside x -5..5 y 0..`"),
        ("outside x 5", "is wrong at `5`: an axis and its limits"),
        ("outside x 1..2 x 3..", "each axis once"),
        ("port 2.0 on", "a port, a bit and a level"),
        ("port 2 bit 8 on", "is wrong at `8 on`: a bit, 0 to 7"),
        ("port 2 bit 1 high", "is wrong at `high`: on or off"),
        ("limit x", "a limit switch, as in `limit x+` or `limit z- off`"),
        ("limit b+", "a limit switch, as in"),
        ("signal dance changes", "is wrong at `dance changes`: the name of a signal"),
        (
            "signal stop",
            "is not finished: `is` and a value, `changes`, or `changes to` and a value",
        ),
        ("stop", "`stop` is wrong: `signal stop changes`, if that is meant"),
        ("stop 1", "`signal stop is 1`, if that is meant"),
        ("x = 1 and cover open", "is wrong at `cover open`: `signal cover is open`, if that is"),
        ("cover shut", "`signal cover changes`, if that is meant"),
        ("signal stop is 2", "is wrong at `2`: 0 or 1"),
        ("signal cover is shut", "is wrong at `shut`: open or closed"),
        ("signal ball x changes to 10", "is wrong at `10`: a number from -9 to 9"),
        ("at 5", "a time with its unit"),
        ("at 0.1ns", "a time with its unit"),
        ("at 99999999999h", "a time with its unit"),
        ("line 0", "the number of a line, from 1"),
        ("answer", "an answer, as in `answer 0`, `answer error` or `answer error 2`"),
        ("answer \"0", "is not finished: `\"` at the end of the text"),
        ("answer \"\\q\"", "`answer \"\\q\"` is wrong at `\\q"),
        ("dance\u{1b}[2J", "`dance\\u{1b}[2J` is wrong"),
        (&deep, "fewer brackets within each other"),
    ] {
        let error = read_condition(typed, &names()).unwrap_err().to_string();
        assert!(error.contains(wrong), "{typed}: {error}");
    }
}

fn texts() -> impl Strategy<Value = String> {
    prop_oneof!["[ -~]{0,6}", "(and|or|error|is|@0A|\"|\\\\)", any::<String>()]
}

fn conditions() -> impl Strategy<Value = Condition> {
    let axis = || 0..AXES as u8;
    let position = || prop_oneof![any::<i64>(), -9_999..9_999_i64];
    let limits =
        || prop::array::uniform6(prop_oneof![any::<i64>(), Just(i64::MIN), Just(i64::MAX)]);
    let like = || prop::option::of(texts());
    let states = prop_oneof![
        (axis(), position()).prop_map(|(axis, position)| Condition::AxisAt { axis, position }),
        (axis(), position()).prop_map(|(axis, position)| Condition::AxisBelow { axis, position }),
        (axis(), position()).prop_map(|(axis, position)| Condition::AxisAbove { axis, position }),
        // What is below its lower limit and above the upper one is no range.
        (limits(), limits()).prop_map(|(one, other)| Condition::Outside {
            low: std::array::from_fn(|axis| one[axis].min(other[axis])),
            high: std::array::from_fn(|axis| one[axis].max(other[axis])),
        }),
        (any::<u16>(), 0..8_u8, any::<bool>()).prop_map(|(port, bit, level)| Condition::PortBit {
            port,
            bit,
            level
        }),
        (axis(), any::<bool>(), any::<bool>())
            .prop_map(|(axis, positive, active)| Condition::Limit { axis, positive, active }),
        (0..5_u16, 0..2)
            .prop_map(|(signal, value)| Condition::SignalIs { signal: SignalId(signal), value }),
        Just(Condition::Idle),
        any::<u64>().prop_map(|nanos| Condition::At(Time::from_nanos(nanos))),
    ];
    let happenings = prop_oneof![
        like().prop_map(|like| Condition::Command { like }),
        like().prop_map(|like| Condition::Answered { like }),
        texts().prop_map(|text| Condition::Answer { text }),
        like().prop_map(|code| Condition::Error { code }),
        prop::option::of(1..u32::MAX).prop_map(|line| Condition::Line { line }),
        (0..5_u16, prop::option::of(0..2))
            .prop_map(|(signal, to)| Condition::SignalChanges { signal: SignalId(signal), to }),
    ];
    // One part alone is written as itself.
    let parts = |many: Vec<Condition>| many.len() != 1;
    prop_oneof![states, happenings].prop_recursive(4, 24, 4, move |inner| {
        let list = prop::collection::vec(inner, 0..4)
            .prop_filter("a list of one is the one", move |many| parts(many.clone()));
        (list, any::<bool>()).prop_map(|(parts, all)| match all {
            true => Condition::All(parts),
            false => Condition::Any(parts),
        })
    })
}

proptest! {
    #[test]
    fn what_is_written_is_read_again(condition in conditions()) {
        let named = names().write(&condition).to_string();
        prop_assert_eq!(read_condition(&named, &names()), Ok(condition.clone()), "{}", named);
        let numbered = condition.to_string();
        prop_assert_eq!(read_condition(&numbered, Names::numbered()), Ok(condition.clone()), "{}", numbered);
        let stored = serde_json::to_string(&condition).unwrap();
        prop_assert_eq!(serde_json::from_str::<Condition>(&stored).unwrap(), condition);
    }

    #[test]
    fn nothing_that_is_typed_breaks_it(typed in prop_oneof![
        any::<String>(),
        "((idle|x|<|=|-5|and|or|\\(|\\)|command|answer|error|\"|at|1s|signal|stop|is|to|1)[ ]?){0,12}",
    ]) {
        match read_condition(&typed, &names()) {
            Ok(condition) => {
                let written = names().write(&condition).to_string();
                prop_assert_eq!(read_condition(&written, &names()), Ok(condition), "{} as {}", typed, written);
            }
            Err(error) => prop_assert!(!error.expected.is_empty(), "{}: {}", typed, error),
        }
    }
}
