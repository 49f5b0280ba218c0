//! Faults of the line, tried on a small device.

#![expect(clippy::unwrap_used, clippy::panic, reason = "tests end at what they do not expect")]

#[path = "../../device/tests/cart/mod.rs"]
mod cart;
#[path = "../../device/tests/pieces/mod.rs"]
mod pieces;
#[path = "../../device/tests/ways/mod.rs"]
mod ways;

use std::time::Duration;

use proptest::prelude::*;
use vimc4_device::{
    Device, Event, FaultStage, Faulting, Harness, Input, Kinds, Line, MOST_FAULTS, Names, Output,
    Time,
};
use vimc4_language::read_faulting;

use cart::Cart;
use ways::Ways;

const fn ms(millis: u64) -> Time {
    Time::from_millis(millis)
}

/// A cart at a line without time, with these faults.
fn cart(faults: &[&str]) -> Harness<Line<Cart>> {
    with(Line::ideal(Cart::default()), faults)
}

fn with(line: Line<Cart>, faults: &[&str]) -> Harness<Line<Cart>> {
    let mut cart = Harness::new(line);
    faults.iter().for_each(|fault| order(&mut cart, fault));
    cart
}

/// Begins or ends faults, as a person orders it.
fn order(cart: &mut Harness<Line<Cart>>, words: &str) {
    let faulting = read_faulting(words, &Names::of(cart.device()));
    let faulting = faulting.unwrap_or_else(|error| panic!("{error}"));
    cart.input(Input::Fault(&faulting));
}

/// What comes back with this fault, and when the last of it does.
fn answer(fault: &str, sent: &str) -> (String, Time) {
    let mut cart = cart(&[fault]);
    let answer = cart.ask(sent.as_bytes()).unwrap();
    (vimc4_device::escape(&answer), cart.now())
}

#[test]
fn every_kind_does_what_it_says() {
    for (fault, sent, comes, at) in [
        // A cart that has not moved answers `0` to `p`, and `0` to `m5` after five milliseconds.
        ("drop to-host once", "p\rp\r", "0", 0),
        ("drop to-host 2 bytes", "p\rp\rp\r", "0", 0),
        ("drop to-controller 2nd byte", "pp\r", "0", 0),
        ("drop to-host every 2nd", "p\rp\rp\rp\r", "00", 0),
        ("garble into ? to-host every 2nd 1 times", "p\rp\rp\rp\r", "0?00", 0),
        ("garble into ? to-host 1st byte every 2nd", "p\rp\rp\rp\r", "?0?0", 0),
        ("garble into ? to-host", "p\r", "?", 0),
        ("garble flip 0x01 to-host always", "p\rp\r", "11", 0),
        ("garble into p to-controller", "m\r", "0", 0),
        ("duplicate to-host", "p\rp\r", "000", 0),
        ("delay 50ms to-host", "p\rp\r", "00", 50),
        ("delay 50ms to-controller", "p\r", "0", 50),
        ("delay 50ms to-controller", "m5\r", "0", 55),
        ("insert xyz to-host", "p\r", "xyz0", 0),
        ("insert p\\r to-controller", "", "0", 0),
        ("insert - to-host 2 times", "p\rp\rp\r", "-0-00", 0),
        ("split 2ms to-host always", "p\rp\rp\r", "000", 4),
        ("split 2ms to-controller always", "p\rp\r", "00", 6),
        ("merge 16ms to-host", "p\rm5\r", "00", 16),
        ("cut to-host", "p\r", "", 0),
        ("cut to-controller", "p\r", "", 0),
        ("cut", "p\r", "", 0),
        ("cut to-host for 5ms", "p\rm4\rp\rm1\rp\r", "05", 5),
        ("break 5ms to-host", "p\rm5\rp\r", "\\x0005", 5),
        ("break 5ms", "p\r", "", 5),
        // Time passes to where a fault is over, of itself; but not to where it could no longer strike
        // anyway.
        ("cut for 5ms", "p\r", "", 5),
        ("drop to-host for 5ms", "p\r", "", 5),
        ("merge 2ms to-host for 5ms", "p\r", "0", 5),
        ("drop to-host for 5ms after command m", "p\rm1\rp\r", "0", 5),
        ("drop to-host once for 5ms", "p\rp\r", "0", 0),
        // What waits for a command strikes the answer to it.
        ("drop to-host after command m", "p\rm5\rp\r", "05", 5),
        ("garble into ? to-host after command m", "p\rm5\rp\r", "0?5", 5),
        ("garble into ? to-host after answered m", "p\rm5\rp\r", "0?5", 5),
        ("garble into ? to-host after 2nd answered", "p\rm5\rp\r", "0?5", 5),
        ("garble into ? to-host after command m then answered p", "p\rm5\rp\r", "00?", 5),
        ("garble into ? to-host after command p then 2nd answered", "p\rm5\rp\r", "0?5", 5),
        ("garble into ? to-host 2nd byte after command m", "p\rm5\rp\r", "00?", 5),
        // And what waits for a place or a time comes just then.
        ("insert ! to-host after x > 2", "m5\r", "!0", 5),
        ("insert ! to-host after at 7ms", "m5\r", "0!", 7),
        ("insert ! to-host after idle then x = 3 then idle", "m5\r", "!0", 5),
    ] {
        let came = answer(fault, sent);
        assert_eq!(came, (comes.to_owned(), ms(at)), "{fault}");
    }
}

#[test]
fn an_insert_has_its_exact_time() {
    for (fault, at) in [
        ("insert ! to-host after x > 2", ms(3)),
        ("insert ! to-host after x = 2 or at 7ms", ms(2)),
        ("insert ! to-host after x > 20", ms(21)),
        ("insert ! to-host after signal stop changes", ms(40)),
        ("insert ! to-host after 2nd signal stop changes to 1", ms(60)),
    ] {
        let mut cart = cart(&[fault]);
        cart.plan(ms(40), Input::Signal(Cart::STOP, 1));
        cart.plan(ms(60), Input::Signal(Cart::STOP, 1));
        cart.send(b"m30\r");
        cart.run_to(ms(100));
        let said = cart.outputs().iter().find_map(|output| match output {
            Output::Bytes(at, bytes) if bytes.as_ref() == b"!" => Some(*at),
            _ => None,
        });
        assert_eq!(said, Some(at), "{fault}");
    }
}

#[test]
fn faults_are_listed_counted_and_ended() {
    let mut cart = cart(&["drop to-host 2 times", "cut to-controller after x > 100"]);
    order(&mut cart, "7 drop to-host after at 5ms");
    order(&mut cart, "duplicate to-host for 1ms");
    let listed = |cart: &Harness<Line<Cart>>| {
        let of = |view: vimc4_device::FaultView| (view.number.0, view.stage, view.struck);
        cart.device().faults().into_iter().map(of).collect::<Vec<_>>()
    };
    use FaultStage::{Over, Strikes, Waits};
    assert_eq!(listed(&cart), [(1, Strikes, 0), (2, Waits, 0), (7, Waits, 0), (8, Strikes, 0)]);
    cart.ask(b"p\rp\rp\r").unwrap();
    assert_eq!(cart.now(), ms(5));
    assert_eq!(listed(&cart), [(1, Over, 2), (2, Waits, 0), (7, Strikes, 0), (8, Over, 1)]);
    order(&mut cart, "end 2");
    order(&mut cart, "end 2");
    order(&mut cart, "end 5");
    assert_eq!(listed(&cart).len(), 3);
    order(&mut cart, "end all");
    assert!(listed(&cart).is_empty());
    assert_eq!(cart.ask(b"p\r").unwrap(), b"0");
    order(&mut cart, "cut");
    assert_eq!(listed(&cart), [(9, Strikes, 0)]);
    // One with the number of another takes its place.
    order(&mut cart, "9 drop to-host");
    assert_eq!(listed(&cart), [(9, Strikes, 0)]);
    assert_eq!(cart.ask(b"p\rp\r").unwrap(), b"0");
}

#[test]
fn a_fault_that_can_still_strike_is_never_forgotten_for_another() {
    let mut cart = cart(&["garble into ? to-host"]);
    let numbers = |cart: &Harness<Line<Cart>>| {
        cart.device().faults().iter().map(|view| view.number.0).collect::<Vec<_>>()
    };
    // Those that are over go first, the oldest of them.
    for _ in 0..1_001 {
        order(&mut cart, "drop to-host for 0ms");
    }
    assert_eq!(numbers(&cart).len(), MOST_FAULTS);
    assert_eq!(numbers(&cart)[..2], [1, 4]);
    assert_eq!(cart.ask(b"p\rp\r").unwrap(), b"?0");
    // As long as as many as there may be can strike, there are no others.
    order(&mut cart, "end all");
    for _ in 0..MOST_FAULTS {
        order(&mut cart, "duplicate to-host after x > 900");
    }
    let before = cart.device().state();
    order(&mut cart, "drop to-host");
    assert_eq!(cart.device().state(), before);
    assert_eq!(cart.ask(b"p\r").unwrap(), b"0");
    // One that takes the place of another needs no other place.
    let last = numbers(&cart).last().copied().unwrap();
    order(&mut cart, &format!("{last} drop to-host"));
    assert_eq!(cart.ask(b"p\rp\r").unwrap(), b"0");
    order(&mut cart, "drop to-host");
    assert_eq!(cart.ask(b"p\rp\r").unwrap(), b"0");
    assert_eq!(*numbers(&cart).last().unwrap(), last + 1);
}

#[test]
fn every_strike_is_told_to_those_who_want_to_know() {
    let mut cart = Harness::new(Line::ideal(Cart::default())).watching(Kinds::FAULT);
    order(&mut cart, "delay 3ms to-host after command m");
    cart.ask(b"p\rm5\rp\r").unwrap();
    order(&mut cart, "end 1");
    let told: Vec<_> = cart
        .outputs()
        .iter()
        .filter_map(|output| match output {
            Output::Event(stamp, Event::Fault { number, news }) => {
                Some(format!("{} {number} {news}", stamp.at.as_nanos() / 1_000_000))
            }
            Output::Event(_, event) => panic!("nobody wanted {event:?}"),
            _ => None,
        })
        .collect();
    let wanted = [
        "0 1 begins: delay 3ms to-host once after command m",
        "0 1 strikes from now on",
        "5 1 held 0 up to the host, 3ms late",
        "8 1 ends",
    ];
    assert_eq!(told, wanted);
}

/// Of nineteen bytes each takes ten bits at 9,600 baud, whether there are faults or not.
#[test]
fn a_paced_line_keeps_its_pace() {
    let last = |faults: &[&str]| {
        let mut cart = with(Line::paced(Cart::default()), faults);
        cart.send(b"?\r?\r?\r?\r?\r?\r?\r?\rp\rp");
        cart.run_to_rest().unwrap();
        (cart.take_bytes(), cart.now())
    };
    let (bytes, at) = last(&[]);
    assert_eq!((&bytes[..], at.as_nanos()), (&b"0"[..], 19_791_667));
    assert_eq!(last(&["drop to-host every 500th 9 times"]), (bytes.clone(), at));
    assert_eq!(last(&["drop to-host 900th byte"]), (bytes, at));
    // What is sent twice takes twice the time, and what follows has to wait for it.
    let mut cart = with(Line::paced(Cart::default()), &["duplicate to-host 2 times"]);
    cart.send(b"p\rp\r");
    cart.run_to_rest().unwrap();
    let outputs = cart.outputs().iter().filter_map(|output| match output {
        Output::Bytes(at, bytes) => Some((at.as_nanos() / 1_000, bytes.len())),
        _ => None,
    });
    // In characters of 1,041.67 µs: two go there, the answer and its twin come back.
    assert_eq!(outputs.collect::<Vec<_>>(), [(3_125, 1), (4_166, 1), (5_208, 1), (6_250, 1)]);
}

/// A speed that begins with a command finds the rest of what was sent, in one piece or in many.
#[test]
fn a_speed_begins_between_two_bytes() {
    let mut whole = cart(&["speed 600 to-controller after command m"]);
    let mut pieced = whole.clone();
    whole.send(b"p\rm3\rp\r");
    b"p\rm3\rp\r".iter().for_each(|byte| pieced.send(&[*byte]));
    whole.run_to_rest().unwrap();
    pieced.run_to_rest().unwrap();
    assert_eq!(whole.take_bytes(), b"00");
    assert_eq!(pieced.take_bytes(), b"00");
    assert_eq!(whole.device().state(), pieced.device().state());
}

/// Equal seeds strike equally, others otherwise.
#[test]
fn chance_can_be_repeated() {
    let said = |fault: &str| {
        let mut cart = cart(&[fault]);
        cart.ask("p\r".repeat(400).as_bytes()).unwrap()
    };
    assert_eq!(said("garble to-host 50% seed 3"), said("garble to-host 50% seed 3"));
    assert_ne!(said("garble to-host 50% seed 3"), said("garble to-host 50% seed 4"));
    let left = said("drop to-host 25%").len();
    assert!((260..340).contains(&left), "{left}");
    assert_eq!(said("drop to-host 0%").len(), 400);
    assert_eq!(said("drop to-host 100%").len(), 0);
}

// --- whatever happens ---

#[derive(Clone, Debug)]
enum Happening {
    Line(String),
    Stop(i32),
    Power(bool),
    Fault(String),
}

impl Happening {
    fn owned(&self, names: &Names) -> vimc4_device::OwnedInput {
        match self {
            Happening::Line(line) => Input::Bytes(line.as_bytes()).into(),
            Happening::Stop(value) => Input::Signal(Cart::STOP, *value).into(),
            Happening::Power(on) => Input::Power(*on).into(),
            Happening::Fault(words) => {
                let faulting = read_faulting(words, names);
                let faulting = faulting.unwrap_or_else(|error| panic!("{error}"));
                Input::Fault(&faulting).into()
            }
        }
    }
}

fn conditions() -> impl Strategy<Value = String> {
    let one = || {
        prop_oneof![
            (-2..40_i64).prop_map(|place| format!("x > {place}")),
            (-2..40_i64).prop_map(|place| format!("x = {place}")),
            (0..90_u64).prop_map(|millis| format!("at {millis}ms")),
            Just("idle".to_owned()),
            Just("command m".to_owned()),
            Just("answered".to_owned()),
            Just("answer 0".to_owned()),
            Just("signal stop changes".to_owned()),
            Just("never".to_owned()),
        ]
    };
    prop_oneof![
        6 => one(),
        1 => (one(), one()).prop_map(|(a, b)| format!("{a} and {b}")),
        1 => (one(), one()).prop_map(|(a, b)| format!("{a} or {b}")),
        1 => (one(), one()).prop_map(|(a, b)| format!("{a} then {b}")),
        1 => (2..4_usize, one()).prop_map(|(times, a)| format!("{} {a}", ["2nd", "3rd"][times - 2])),
    ]
}

fn faults() -> impl Strategy<Value = String> {
    let kinds = prop_oneof![
        Just("drop".to_owned()),
        Just("garble".to_owned()),
        Just("garble into p".to_owned()),
        Just("garble flip 0x07".to_owned()),
        Just("duplicate".to_owned()),
        (0..9_000_u32).prop_map(|micros| format!("delay {micros}us")),
        Just("insert p\\r".to_owned()),
        (0..9_000_u32).prop_map(|micros| format!("split {micros}us")),
        (0..9_000_u32).prop_map(|micros| format!("merge {micros}us")),
        Just("parity marked".to_owned()),
        Just("framing".to_owned()),
        Just("cut".to_owned()),
        (600..90_000_u32).prop_map(|baud| format!("speed {baud}")),
        (0..9_000_u32).prop_map(|micros| format!("break {micros}us")),
    ];
    let ways = prop_oneof![Just("to-host"), Just("to-controller"), Just("both")];
    let many = prop_oneof![
        Just(""),
        Just("once"),
        Just("3 times"),
        Just("always"),
        Just("every 3rd"),
        Just("2nd byte"),
        Just("30% seed 5"),
        Just("for 9ms"),
        Just("every 2nd 70% for 40ms"),
    ];
    let after = prop::option::of(conditions());
    let run = prop_oneof![Just(""), Just("2 bytes")];
    (kinds, ways, run, many, after).prop_map(|(kind, way, run, many, after)| {
        let after = after.map_or(String::new(), |after| format!(" after {after}"));
        format!("{kind} {way} {run} {many}{after}")
    })
}

/// Things that happen, each so many microseconds later than the one before.
fn happenings() -> impl Strategy<Value = Vec<(u64, Happening)>> {
    let line = prop_oneof![
        (0_u64..30).prop_map(|steps| format!("m{steps}\r")),
        Just("p\r".to_owned()),
        Just("fx\r".to_owned()),
        Just("p\rm3\rp\r".to_owned()),
        Just("?\r".to_owned()),
    ];
    let happening = prop_oneof![
        8 => line.prop_map(Happening::Line),
        1 => (0_i32..2).prop_map(Happening::Stop),
        1 => any::<bool>().prop_map(Happening::Power),
        4 => faults().prop_map(Happening::Fault),
        1 => (0..6).prop_map(|number| Happening::Fault(format!("end {number}"))),
        1 => Just(Happening::Fault("end all".to_owned())),
    ];
    prop::collection::vec((0_u64..20_000, happening), 1..16)
}

proptest! {
    /// Lines whole or byte by byte, time in one piece or in many, with needless wake-ups, watched or
    /// not, from cause to cause, or from a state that was written down: the same comes out of a faulty
    /// line, and the same is left.
    #[test]
    fn the_pieces_make_no_difference_with_faults(
        happenings in happenings(),
        pieces in prop::collection::vec(1_u64..5_000, 1..6),
        paced in any::<bool>(),
    ) {
        let mut ways = Ways::new(paced, pieces.iter().cycle());
        let names = Names::of(ways.whole.device());
        let mut when = Time::ZERO;
        for (micros, happening) in &happenings {
            when = when + Duration::from_micros(*micros);
            ways.give(when, happening.owned(&names).as_input());
        }
        ways.meet(ms(4_000));
        // And when nothing is wrong any more, nothing is left of it.
        ways.whole.input(Input::Fault(&Faulting::EndAll));
        ways.nothing_is_left();
    }
}
