//! Scenarios, tried on a small device.

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
    Act, Awaits, Condition, Cue, Deed, Device, Event, Harness, Input, Kinds, Lasts, Line,
    MOST_RULES, Names, Output, Rule, RuleNews, RuleStage, Ruling, Scenario, ScenarioNumber, Time,
    Trigger,
};
use vimc4_language::{read_faulting, read_rule, read_rule_of, read_ruling};

use cart::Cart;
use ways::Ways;

const fn ms(millis: u64) -> Time {
    Time::from_millis(millis)
}

/// A cart at a line without time, with these rules.
fn cart(rules: &[&str]) -> Harness<Line<Cart>> {
    let mut cart = Harness::new(Line::ideal(Cart::default())).watching(Kinds::ALL);
    rules.iter().for_each(|rule| order(&mut cart, rule));
    cart
}

/// Begins or ends rules, as a person orders it.
fn order(cart: &mut Harness<Line<Cart>>, words: &str) {
    let ruling = read_ruling(words, &Names::of(cart.device()));
    let ruling = ruling.unwrap_or_else(|error| panic!("{error}"));
    cart.input(Input::Rule(&ruling));
}

/// What rules have done up to now, and when.
fn acts(cart: &mut Harness<Line<Cart>>) -> Vec<(u64, String)> {
    let mut acts = Vec::new();
    while let Some(output) = cart.take_output() {
        if let Output::Event(stamp, Event::Rule { rule, news }) = output
            && !matches!(news, RuleNews::Begins)
        {
            acts.push((stamp.at.as_nanos() / 1_000_000, format!("{rule} {news}")));
        }
    }
    acts
}

/// What rules do while a cart makes ten steps, a millisecond each, and says where it is.
fn run(rules: &[&str]) -> Vec<(u64, String)> {
    let mut cart = cart(rules);
    cart.send(b"m10\rp\r");
    cart.run_to(ms(50));
    acts(&mut cart)
}

#[test]
fn every_trigger_comes_at_its_time() {
    for (rule, times) in [
        ("at 3ms: release stop", &[3][..]),
        ("at 3ms every 20ms: release stop", &[3, 23, 43]),
        ("every 20ms: release stop", &[20, 40]),
        ("rule once every 20ms: release stop", &[20]),
        ("when x > 5: release stop", &[6]),
        ("when x = 0: release stop", &[0]),
        ("when idle: release stop", &[0, 10]),
        ("rule once when idle: release stop", &[0]),
        ("when never: release stop", &[]),
        ("when command m: release stop", &[0]),
        ("when answered: release stop", &[10, 10]),
        ("when 2nd answered: release stop", &[10]),
        ("rule once when answered: release stop", &[10]),
        ("when x > 3 then 2ms: release stop", &[6]),
        ("when command m then x > 3 then answered: release stop", &[10]),
        ("when x > 3 then x > 2: release stop", &[4]),
        ("while x > 3: release stop", &[4]),
    ] {
        let acts = |at: &u64| (*at, "1 acts: release stop".to_owned());
        assert_eq!(run(&[rule]), times.iter().map(acts).collect::<Vec<_>>(), "{rule}");
    }
}

#[test]
fn what_is_changed_is_set_back() {
    let done = |at: u64, what: &str| (at, what.to_owned());
    // The power.
    let found = run(&["at 2ms: power off for 5ms"]);
    assert_eq!(found, [done(2, "1 acts: power off"), done(7, "1 sets back what it has changed"),]);
    let mut cart1 = cart(&["at 2ms: power off"]);
    cart1.run_to(ms(5));
    assert!(!cart1.device().view(ms(5)).powered);
    assert_eq!(cart1.device().rules()[0].stage, RuleStage::Holds);
    order(&mut cart1, "end 1");
    assert!(cart1.device().view(ms(5)).powered);
    assert!(cart1.device().rules().is_empty());

    // A fault, as long as something is so, until something is so, and until the scenario ends.
    let faults = |cart: &Harness<Line<Cart>>| cart.device().faults().len();
    for (rule, at, until) in [
        ("while x > 2: fault cut to-host", 3, 60),
        ("while x = 4: fault cut to-host", 4, 5),
        ("when x > 2: fault cut to-host until x > 6", 3, 7),
        ("when command m: fault cut to-host until idle", 0, 10),
    ] {
        let mut cart = cart(&[rule]);
        cart.send(b"m10\r");
        for now in 0..50 {
            cart.run_to(ms(now));
            assert_eq!(faults(&cart), usize::from(now >= at && now < until), "{rule} {now}");
        }
        order(&mut cart, "end all");
        assert_eq!((faults(&cart), cart.device().rules()), (0, Vec::new()), "{rule}");
    }
}

/// What a person has done meanwhile stays.
#[test]
fn what_somebody_else_has_changed_stays() {
    let mut cart = cart(&["at 2ms: power off", "at 4ms: power on"]);
    cart.run_to(ms(10));
    // Nothing is to be set back that is as it was.
    order(&mut cart, "end all");
    let power = cart.outputs().iter().filter(|output| {
        matches!(output, Output::Event(_, Event::Rule { news: RuleNews::SetsBack, .. }))
    });
    assert_eq!(power.count(), 0);
    assert!(cart.device().view(ms(10)).powered);
    order(&mut cart, "at 1ms: power off");
    cart.run_to(ms(12));
    cart.input(Input::Power(true));
    order(&mut cart, "end all");
    assert!(cart.device().view(ms(12)).powered);
}

/// It is what was done last that counts, not the value that came of it.
#[test]
fn the_last_hand_on_a_switch_decides() {
    let powered = |cart: &Harness<Line<Cart>>| cart.device().view(cart.device().now()).powered;
    // By hand to where it is already: it stays, even when the rule ends.
    let mut cart1 = cart(&["at 1ms: power off for 5ms"]);
    cart1.run_to(ms(2));
    assert_eq!(cart1.device().rules()[0].stage, RuleStage::Holds);
    cart1.input(Input::Power(false));
    assert_eq!(cart1.device().rules()[0].stage, RuleStage::Over);
    cart1.run_to(ms(10));
    assert!(!powered(&cart1));

    // One rule holds it above another; it goes back when the last of them lets it go, in whichever
    // order they do.
    for (first, second) in [(5, 8), (8, 5)] {
        let below = format!("at 1ms: power off for {}ms", first - 1);
        let above = format!("at 2ms: power off for {}ms", second - 2);
        let mut cart = cart(&[&below, &above]);
        for now in 0..12 {
            cart.run_to(ms(now));
            assert_eq!(powered(&cart), !(1..8).contains(&now), "{first} {now}");
        }
    }
    // What an ended rule had made of it never comes back.
    let mut cart2 = cart(&["at 1ms: power off for 4ms", "at 2ms: power on for 6ms"]);
    for now in 0..12 {
        cart2.run_to(ms(now));
        assert_eq!(powered(&cart2), now != 1, "{now}");
    }
}

#[test]
fn a_device_becomes_idle_once_however_many_bytes_come() {
    let mut cart = cart(&["when idle: release stop"]);
    cart.send(b"p\rp\rm10\rp\rp\r");
    cart.run_to(ms(50));
    cart.send(b"p\rp\r");
    let at: Vec<u64> = acts(&mut cart).into_iter().map(|(at, _)| at).collect();
    assert_eq!(at, [0, 10, 50]);
}

#[test]
fn orders_are_told_apart_with_and_without_blanks() {
    let names = Names::of(cart(&[]).device());
    let rule = read_rule("at 1ms: press stop;release stop ;hold stop", &names).unwrap();
    assert_eq!(rule.to_string(), "at 1ms: press stop; release stop; hold stop");
    for (wrong, place, right) in [
        ("at 1ms: press stop;;press stop", "", "what is done"),
        ("at 1ms: hold stop for 1s until idle", "until idle", "one of the two"),
    ] {
        let error = read_rule(wrong, &names).unwrap_err();
        assert!(error.message().contains(right), "{error}");
        assert!(place.is_empty() || &wrong[error.span.start..] == place, "{error}");
    }
}

#[test]
fn a_rule_too_many_does_not_begin_and_those_over_give_way() {
    let numbers = |cart: &Harness<Line<Cart>>| {
        cart.device().rules().iter().map(|view| view.id.scenario.0).collect::<Vec<_>>()
    };
    let mut cart = cart(&["rule once when x = 0: release stop"]);
    for _ in 1..MOST_RULES {
        order(&mut cart, "when x > 900: release stop");
    }
    assert_eq!(numbers(&cart).len(), MOST_RULES);
    // The first is over.
    order(&mut cart, "when x > 901: release stop");
    assert_eq!((numbers(&cart).len(), numbers(&cart)[0]), (MOST_RULES, 2));
    let before = cart.device().state();
    order(&mut cart, "when x > 902: release stop");
    assert_eq!(cart.device().state(), before);
    // One that takes the place of another needs no other place; two do.
    order(&mut cart, "2 when x > 903: release stop");
    let before = cart.device().state();
    order(&mut cart, "2\nwhen x > 904: release stop\nwhen x > 905: release stop");
    assert_eq!(cart.device().state(), before);
    order(&mut cart, "end 7");
    order(&mut cart, "when x > 906: release stop");
    assert_eq!(numbers(&cart).last(), Some(&1_002));
}

#[test]
fn rules_call_rules() {
    let mut cart = cart(&[
        "2\nrule jam once when x > 3: power off for 1ms\nwhen rule jam then 2ms: power off",
        "when 2nd rule jam: press stop",
    ]);
    cart.send(b"m10\r");
    cart.run_to(ms(50));
    let found = acts(&mut cart);
    let found: Vec<_> = found.iter().map(|(at, what)| (*at, what.as_str())).collect();
    assert_eq!(
        found,
        [
            (4, "2.1 (jam) acts: power off"),
            (5, "2.1 (jam) sets back what it has changed"),
            (6, "2.2 acts: power off"),
        ]
    );
}

/// Time goes on whatever rules do.
#[test]
fn rules_that_call_each_other_for_ever_are_over() {
    let mut cart = cart(&["1\nrule a when rule b: press stop\nrule b when rule a: press stop"]);
    order(&mut cart, "at 1ms: press stop");
    order(&mut cart, "rule a at 2ms: press stop");
    cart.run_to(ms(10));
    let found = acts(&mut cart);
    assert!(found.iter().any(|(_, what)| what.contains("for ever")), "{found:?}");
    assert!(cart.device().rules().iter().any(|rule| rule.stage == RuleStage::Over));
}

#[test]
fn what_cannot_be_done_is_said() {
    let mut cart = cart(&[]);
    let rule = Rule::at(Duration::ZERO).act(Deed::Press("start".to_owned()));
    cart.input(Input::Rule(&Ruling::Begin(ScenarioNumber::NEXT, rule.into())));
    let found = acts(&mut cart);
    let wanted = "1 cannot press start: there is no button `start`; there is stop";
    assert_eq!(found, [(0, wanted.to_owned())]);
}

#[test]
fn a_wrong_rule_says_where_and_what_would_be_right() {
    let names = Names::of(&Cart::default());
    for (text, at, right) in [
        ("when x > far: press stop", 9, "a position in steps"),
        ("when x > 5: press stpo", 18, "did you mean stop?"),
        ("when x > 5: wobble", 12, "something that is done to the controller"),
        ("when x > 5: advance 5ms", 12, "something that is done to the controller"),
        ("when x > 5: when idle: press stop", 12, "something that is done to the controller"),
        ("when x > 5", 10, "`:` and what is done"),
        ("when x > 5:", 11, "what is done"),
        ("when x > 5: press stop; ", 23, ""),
        ("when: press stop", 4, "a condition, such as"),
        ("when 5ms: press stop", 5, "`at` or `every` and a time"),
        ("when 5ms then x > 5: press stop", 5, "`at` or `every` and a time"),
        ("while answered: press stop", 6, "a state, which lasts"),
        ("at soon: press stop", 3, "a time, as in `at 2s`"),
        ("at 2s every 5us: press stop", 12, "1ms at least"),
        ("every: press stop", 5, "a time, as in"),
        ("rule 0 times at 2s: press stop", 5, "`3 times`"),
        ("rule a.b at 2s: press stop", 5, "a name of letters"),
        ("rule jam", 8, "`at 2s`"),
        ("rule end", 8, "the number of a scenario"),
        ("at 2s: power off for", 20, "a time, as in"),
        ("at 2s: power off until far", 23, "a condition, such as"),
        ("at 2s: fault drop to-hots", 18, "to-host, to-controller or both"),
        ("", 0, "a rule begins with"),
    ] {
        match read_ruling(text, &names) {
            Ok(ruling) => assert_eq!(right, "", "{text}: {ruling:?}"),
            Err(error) => {
                assert!(error.message().contains(right) && !right.is_empty(), "{text}: {error}");
                assert_eq!(error.span.start, at, "{text}: {error}");
            }
        }
    }
}

// --- whatever happens ---

fn names() -> Names {
    Names::of(&Cart::default())
}

fn conditions() -> impl Strategy<Value = Condition> {
    let texts = || "[ -~]{0,6}";
    let one = prop_oneof![
        4 => (-2..40_i64).prop_map(|position| Condition::AxisAbove { axis: 0, position }),
        4 => (-2..40_i64).prop_map(|position| Condition::AxisAt { axis: 0, position }),
        2 => (0..90_u64).prop_map(|millis| Condition::At(ms(millis))),
        2 => Just(Condition::Idle),
        2 => Just(Condition::Command { like: Some("m".to_owned()) }),
        1 => texts().prop_map(|like| Condition::Command { like: Some(like) }),
        2 => Just(Condition::Answered { like: None }),
        2 => Just(Condition::Answer { text: "0".to_owned() }),
        1 => texts().prop_map(|text| Condition::Answer { text }),
        2 => Just(Condition::SignalChanges { signal: Cart::STOP, to: None }),
        1 => Just(Condition::Any(Vec::new())),
    ];
    let many = one.clone();
    prop_oneof![
        6 => one.clone(),
        1 => (one.clone(), many.clone()).prop_map(|(a, b)| Condition::All(vec![a, b])),
        1 => (one, many).prop_map(|(a, b)| Condition::Any(vec![a, b])),
    ]
}

fn states() -> impl Strategy<Value = Condition> {
    conditions().prop_filter("a state", |condition| !condition.has_happenings())
}

fn spans(least: u64) -> impl Strategy<Value = Duration> {
    (least..40_000_u64).prop_map(Duration::from_micros)
}

fn triggers() -> impl Strategy<Value = Trigger> {
    let awaits = prop_oneof![
        5 => conditions().prop_map(Awaits::Condition),
        1 => "[ab]".prop_map(Awaits::Rule),
    ];
    let cue = (awaits, 1..4_u32).prop_map(|(awaits, times)| Cue { awaits, times });
    let pause = spans(0).prop_map(|span| Cue { awaits: Awaits::Time(span), times: 1 });
    let more = prop::collection::vec(prop_oneof![3 => cue.clone(), 1 => pause], 0..3);
    let when = (cue, more).prop_map(|(cue, more)| {
        let mut cues = vec![cue];
        cues.extend(more);
        Trigger::When(cues)
    });
    prop_oneof![
        2 => spans(0).prop_map(Trigger::At),
        1 => (spans(0), spans(1_000)).prop_map(|(first, span)| Trigger::Every { first, span }),
        5 => when,
        3 => states().prop_map(Trigger::While),
    ]
}

fn all_acts() -> impl Strategy<Value = Act> {
    let lasts = || {
        prop_oneof![
            3 => Just(None),
            2 => spans(0).prop_map(|span| Some(Lasts::For(span))),
            2 => conditions().prop_map(|condition| Some(Lasts::Until(condition))),
        ]
    };
    let deeds = prop_oneof![
        Just(Deed::Press("stop".to_owned())),
        Just(Deed::Hold("stop".to_owned())),
        Just(Deed::Release("stop".to_owned())),
        Just(Deed::Set("stop".to_owned(), 1)),
        any::<bool>().prop_map(Deed::Power),
    ];
    let faults = prop_oneof![
        Just("drop to-host 3 times"),
        Just("delay 3ms to-controller always"),
        Just("insert \"; p\\r\" to-controller"),
        Just("cut for 9ms"),
        Just("merge 16ms to-host after command \"a; b\" then 2nd answered"),
        Just("jam x while x > 5"),
        Just("end 2"),
        Just("end all"),
        Just("speed 19200"),
    ];
    let until =
        prop_oneof![Just(None), conditions().prop_map(|condition| Some(Lasts::Until(condition))),];
    let faults = (faults, until).prop_map(|(words, lasts)| Act {
        deed: Deed::Fault(Box::new(read_faulting(words, &names()).unwrap())),
        lasts,
    });
    prop_oneof![
        3 => (deeds, lasts()).prop_map(|(deed, lasts)| Act { deed, lasts }),
        2 => faults,
    ]
}

fn all_rules() -> impl Strategy<Value = Rule> {
    let often = prop::option::of(1..4_u64);
    let acts = prop::collection::vec(all_acts(), 1..3);
    (prop::option::of("[ab]"), triggers(), often, acts)
        .prop_map(|(name, trigger, times, acts)| Rule { name, trigger, times, acts })
}

fn rulings() -> impl Strategy<Value = Ruling> {
    let scenario = prop::collection::vec(all_rules(), 1..4).prop_map(|rules| Scenario { rules });
    prop_oneof![
        5 => (0..4_u32, scenario).prop_map(|(n, scenario)| Ruling::Begin(ScenarioNumber(n), scenario)),
        1 => (1..4_u32).prop_map(|number| Ruling::End(ScenarioNumber(number))),
        1 => Just(Ruling::EndAll),
    ]
}

#[derive(Clone, Debug)]
enum Happening {
    Line(String),
    Stop(i32),
    Power(bool),
    Rule(Ruling),
}

impl Happening {
    fn as_input(&self) -> Input<'_> {
        match self {
            Happening::Line(line) => Input::Bytes(line.as_bytes()),
            Happening::Stop(value) => Input::Signal(Cart::STOP, *value),
            Happening::Power(on) => Input::Power(*on),
            Happening::Rule(ruling) => Input::Rule(ruling),
        }
    }
}

/// Things that happen, each so many microseconds later than the one before.
fn happenings() -> impl Strategy<Value = Vec<(u64, Happening)>> {
    let line = prop_oneof![
        (0_u64..30).prop_map(|steps| format!("m{steps}\r")),
        Just("p\r".to_owned()),
        Just("p\rm3\rp\r".to_owned()),
    ];
    let happening = prop_oneof![
        6 => line.prop_map(Happening::Line),
        1 => (0_i32..2).prop_map(Happening::Stop),
        1 => any::<bool>().prop_map(Happening::Power),
        4 => rulings().prop_map(Happening::Rule),
    ];
    prop::collection::vec((0_u64..20_000, happening), 1..12)
}

/// So many random scenarios; `VIMC4_CASES` says how many.
#[expect(clippy::disallowed_methods, reason = "the length of a test run is set from outside")]
fn cases() -> ProptestConfig {
    let cases = std::env::var("VIMC4_CASES").ok().and_then(|cases| cases.parse().ok());
    // A condition that is no state is drawn again, the more often the more cases there are.
    let max_local_rejects = u32::MAX;
    ProptestConfig { cases: cases.unwrap_or(300), max_local_rejects, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(cases())]

    /// Orders say what data say, and the state and the written form of both are the same.
    #[test]
    fn what_is_written_is_read_again(ruling in rulings()) {
        let text = names().write_ruling(&ruling);
        prop_assert_eq!(read_ruling(&text, &names()), Ok(ruling.clone()), "{}", text);
        let json = serde_json::to_string(&ruling).unwrap();
        prop_assert_eq!(serde_json::from_str::<Ruling>(&json).unwrap(), ruling);
    }

    /// In parts, as in a file, a rule is the same.
    #[test]
    fn parts_say_what_orders_say(rule in all_rules()) {
        let trigger = names().write_trigger(&rule.trigger);
        let acts = names().write_acts(&rule.acts);
        let read = read_rule_of(rule.name.as_deref(), rule.times, &trigger, &acts, &names());
        prop_assert_eq!(read, Ok(rule));
    }

    /// Nothing that anybody types is worse than an error.
    #[test]
    fn any_text_is_a_rule_or_an_error(text in "(at|every|when|while|rule)[ -~]{0,40}") {
        if let Err(error) = read_ruling(&text, &names()) {
            prop_assert!(error.span.start <= text.len() && !error.expected.is_empty(), "{}", error);
        }
    }

    /// Lines whole or byte by byte, time in one piece or in many, watched or not, from cause to cause,
    /// or from a state that was written down: rules do the same.
    #[test]
    fn the_pieces_make_no_difference_with_rules(
        happenings in happenings(),
        pieces in prop::collection::vec(1_u64..5_000, 1..6),
        paced in any::<bool>(),
    ) {
        let mut ways = Ways::new(paced, pieces.iter().cycle());
        let mut when = Time::ZERO;
        for (micros, happening) in &happenings {
            when = when + Duration::from_micros(*micros);
            ways.give(when, happening.as_input());
        }
        ways.meet(ms(600));
        // And when rules and faults end, nothing is left of them.
        ways.whole.input(Input::Rule(&Ruling::EndAll));
        ways.whole.input(Input::Fault(&vimc4_device::Faulting::EndAll));
        ways.nothing_is_left();
    }
}
