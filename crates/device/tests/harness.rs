//! A harness drives a device as the contract says, whatever the pieces.

mod cart;
mod pieces;

use std::time::Duration;

use cart::Cart;
use pieces::in_pieces;
use proptest::prelude::*;
use vimc4_device::{
    AXES, Condition, Device, Endless, Event, FlashChange, Foresight, Harness, Input, Kinds, Line,
    Output, Time, TimedInput, Warning,
};

fn at(position: i64) -> Condition {
    Condition::AxisAt { axis: 0, position }
}

fn ms(millis: u64) -> Time {
    Time::from_millis(millis)
}

/// What was said, and when.
fn said(at: Time, text: &'static str) -> Output {
    Output::Bytes(at, text.into())
}

#[test]
fn what_comes_out_stays_in_order_until_it_is_taken() {
    let mut cart = Harness::new(Cart::default()).watching(Kinds::WARNING);
    cart.send(b"m3\rfabc\rx\rp\r");
    assert_eq!(*cart.outputs(), []);
    cart.run_to(ms(3));
    let warning = Warning::NoEffect { what: "a line that means nothing".into() };
    let all = [
        said(ms(3), "0"),
        Output::Flash(ms(3), FlashChange::Append("abc".into())),
        said(ms(3), "0"),
        Output::Event(ms(3).into(), Event::Warning(warning)),
        said(ms(3), "3"),
    ];
    assert_eq!(*cart.outputs(), all);
    assert_eq!(cart.clone().drain().collect::<Vec<_>>(), all);
    let mut one = cart.clone();
    assert_eq!(one.take_output().as_ref(), all.first());
    assert_eq!(one.drain().collect::<Vec<_>>(), all[1..]);
    assert_eq!(cart.take_bytes(), b"003");
    assert_eq!(cart.take_bytes(), b"");
    assert_eq!(*cart.outputs(), [all[1].clone(), all[3].clone()]);
}

#[test]
fn an_answer_comes_behind_what_was_not_taken() {
    let mut cart = Harness::new(Cart::default());
    cart.send(b"p\r");
    assert_eq!(cart.ask(b"m2\rp\r"), Ok(b"002".to_vec()));
    assert_eq!(cart.ask(b"p"), Ok(Vec::new()));
    assert_eq!(cart.ask(b"\r"), Ok(b"2".to_vec()));
}

#[test]
fn it_takes_over_a_device_under_way() {
    let mut device = Cart::default();
    device.handle(Input::Bytes(b"p\rm10\r"), ms(7));
    let mut cart = Harness::new(device);
    assert_eq!((cart.now(), cart.due()), (ms(7), Some(ms(17))));
    assert_eq!(*cart.outputs(), [said(ms(7), "0")]);
    cart.advance(Duration::from_millis(4));
    assert_eq!(cart.into_device().view(ms(11)).axes[0].position, 4);
}

#[test]
fn a_step_is_what_happens_next() {
    let mut cart = Harness::new(Cart::default());
    assert_eq!((cart.due(), cart.step()), (None, None));
    cart.plan(ms(2), Input::Bytes(b"m5\r"));
    cart.plan(ms(7), Input::Signal(Cart::STOP, 1));
    cart.plan(ms(1), Input::Bytes(b"p\r"));
    // What arrives, and what it leads to.
    assert_eq!((cart.step(), cart.due()), (Some(ms(1)), Some(ms(1))));
    assert_eq!(*cart.outputs(), []);
    assert_eq!((cart.step(), cart.due()), (Some(ms(1)), Some(ms(2))));
    assert_eq!((cart.step(), cart.step()), (Some(ms(2)), Some(ms(2))));
    assert_eq!((cart.due(), cart.planned()), (Some(ms(7)), Some(ms(7))));
    // What the device does by itself comes before what happens outside at the same time.
    assert_eq!(cart.step(), Some(ms(7)));
    assert_eq!(*cart.outputs(), [said(ms(1), "0"), said(ms(7), "0")]);
    assert_eq!((cart.step(), cart.step()), (Some(ms(7)), None));
}

#[test]
fn what_happens_at_one_instant_happens_one_after_the_other() {
    let mut cart = Harness::new(Cart::default());
    cart.send(b"m2\rp\rm0\rm3\rp\r");
    let mut told = Vec::new();
    while cart.step() == Some(ms(2)) {
        told.push((cart.device().is_idle(), cart.take_bytes()));
    }
    // The end of the motion, where it is, a motion that begins and ends, the next one.
    let heard: [(bool, &[u8]); 5] =
        [(false, b"0"), (false, b"2"), (false, b""), (false, b"0"), (false, b"")];
    assert_eq!(told, heard.map(|(idle, bytes)| (idle, bytes.to_vec())));
    assert_eq!((cart.now(), cart.take_bytes()), (ms(5), b"0".to_vec()));
}

#[test]
fn what_is_planned_for_now_comes_before_what_is_done_now() {
    let mut cart = Harness::new(Cart::default());
    cart.run_to(ms(5));
    cart.plan(ms(5), Input::Bytes(b"m"));
    cart.plan(ms(5), Input::Bytes(b"4"));
    cart.plan(ms(1), Input::Bytes(b"p\r"));
    cart.plan(ms(6), Input::Power(false));
    cart.send(b"0\r");
    assert_eq!(cart.take_bytes(), b"0");
    assert_eq!(cart.due(), Some(ms(6)));
    assert_eq!(cart.device().wake(), Some(ms(45)));
    cart.run_to_rest().unwrap();
    assert_eq!((cart.now(), cart.take_bytes()), (ms(6), Vec::new()));
}

#[test]
fn a_time_that_is_over_changes_nothing() {
    let mut cart = Harness::new(Cart::default());
    cart.run_to(ms(5));
    let before = cart.clone();
    cart.run_to(ms(3));
    cart.advance(Duration::ZERO);
    assert_eq!(cart, before);
}

#[test]
fn an_endless_program_ends_the_question_and_not_the_test() {
    let mut cart = Harness::new(Cart::default());
    let error = cart.ask(b"p\rb\r").unwrap_err();
    assert_eq!(error, Endless { at: ms(1_000_000) });
    assert!(error.to_string().contains("has come to 1000."), "{error}");
    assert_eq!(cart.run_until(&at(7)), None);
    // Nothing of it is lost, and it goes on from there.
    assert_eq!(cart.take_bytes(), b"0");
    cart.input(Input::Signal(Cart::STOP, 1));
    assert_eq!(cart.ask(b"").unwrap(), b"stopped");
}

#[test]
fn what_never_ends_by_itself_is_endless_too() {
    let mut cart = Harness::new(Cart::default());
    cart.send(format!("m{}\r", u64::MAX).as_bytes());
    assert_eq!((cart.due(), cart.step()), (Some(Time::NEVER), None));
    assert_eq!(cart.run_to_rest(), Err(Endless { at: Time::ZERO }));
    assert_eq!(cart.device().when(&at(5)), Some(ms(5)));
    cart.run_to(ms(9));
    assert_eq!(cart.device().view(ms(9)).axes[0].position, 9);
}

#[test]
fn what_is_not_foreseen_is_told_from_what_never_happens() {
    let mut cart = Harness::new(Cart::default());
    cart.send(b"m5\rm5\r");
    let foresee = |position, causes| cart.device().foresee(&at(position), causes);
    assert_eq!((foresee(8, 0), foresee(8, 1)), (Foresight::Open, Foresight::Open));
    // The first motion ends, the second begins, and then it can be seen.
    assert_eq!((foresee(8, 2), foresee(8, 3)), (Foresight::Open, Foresight::At(ms(8))));
    assert_eq!((foresee(11, 3), foresee(11, 4)), (Foresight::Open, Foresight::Never));
}

#[test]
fn a_condition_is_met_at_its_instant() {
    let mut cart = Harness::new(Cart::default());
    assert_eq!(cart.run_until(&Condition::Idle), Some(Time::ZERO));
    cart.send(b"m10\rm10\r");
    assert_eq!(cart.run_until(&at(0)), Some(Time::ZERO));
    assert_eq!(cart.run_until(&at(4)), Some(ms(4)));
    assert_eq!((cart.now(), cart.take_bytes()), (ms(4), Vec::new()));
    // At a cause, and past one.
    assert_eq!(cart.run_until(&at(10)), Some(ms(10)));
    let (mut low, mut high) = ([0; AXES], [0; AXES]);
    (low[0], high[0]) = (0, 14);
    assert_eq!(cart.run_until(&Condition::Outside { low, high }), Some(ms(15)));
    assert_eq!(cart.run_until(&at(14)), None);
    assert_eq!((cart.now(), cart.take_bytes()), (ms(20), b"00".to_vec()));
}

#[test]
fn what_is_planned_changes_whether_a_condition_comes() {
    let mut cart = Harness::new(Cart::default());
    cart.send(b"m10\r");
    cart.plan(ms(4), Input::Signal(Cart::STOP, 1));
    assert_eq!(cart.clone().run_until(&at(4)), Some(ms(4)));
    assert_eq!(cart.clone().run_until(&at(5)), None);
    cart.plan(ms(6), Input::Bytes(b"m3\r"));
    assert_eq!(cart.run_until(&at(5)), Some(ms(7)));
}

#[test]
fn a_state_taken_earlier_goes_on_from_there() {
    let mut cart = Harness::new(Cart::default());
    cart.send(b"m10\r");
    cart.run_to(ms(4));
    let state = cart.device().state();
    let first = (cart.ask(b"p\r").unwrap(), cart.now());
    cart.restore(state);
    assert_eq!(cart.now(), ms(4));
    assert_eq!((cart.ask(b"p\r").unwrap(), cart.now()), first);
}

/// Things that happen, each so much later than the one before.
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
    ];
    prop::collection::vec((0_u64..20_000, happening), 1..12)
}

#[derive(Clone, Debug)]
enum Happening {
    Line(String),
    Stop(i32),
    Power(bool),
}

impl Happening {
    fn input(&self) -> Input<'_> {
        match self {
            Happening::Line(line) => Input::Bytes(line.as_bytes()),
            Happening::Stop(value) => Input::Signal(Cart::STOP, *value),
            Happening::Power(on) => Input::Power(*on),
        }
    }
}

proptest! {
    /// Planned ahead, or done one after the other; lines whole or byte by byte; time in one piece
    /// or in many, or from cause to cause, or written down and played, at a paced line as well: the
    /// same comes out, and the same cart is left.
    #[test]
    fn the_pieces_make_no_difference(
        happenings in happenings(),
        pieces in prop::collection::vec(1_u64..5_000, 1..6),
    ) {
        let mut whole = Harness::new(Cart::default()).watching(Kinds::ALL);
        let mut pieced = whole.clone();
        let mut planned = whole.clone();
        let mut stepped = whole.clone();
        let mut played = whole.clone();
        let mut when = Time::ZERO;
        let mut pieces = pieces.iter().cycle();
        for (micros, happening) in &happenings {
            when = when + Duration::from_micros(*micros);
            whole.run_to(when);
            whole.input(happening.input());
            in_pieces(&mut pieced, when, &mut pieces, happening.input());
            planned.plan(when, happening.input());
            stepped.plan(when, happening.input());
            let written = TimedInput { at: when, input: happening.input().into() };
            let written = serde_json::to_string(&written).unwrap();
            played.play(&serde_json::from_str(&written).unwrap());
        }
        let end = ms(2_000);
        while stepped.step().is_some() {}
        for harness in [&mut whole, &mut pieced, &mut planned, &mut stepped, &mut played] {
            harness.run_to(end);
        }
        prop_assert_eq!(&whole, &pieced);
        prop_assert_eq!(&whole, &planned);
        prop_assert_eq!(&whole, &stepped);
        prop_assert_eq!(&whole, &played);
        for line in [Line::ideal(Cart::default()), Line::paced(Cart::default())] {
            let mut whole = Harness::new(line.clone()).watching(Kinds::ALL);
            let mut single = whole.clone();
            let mut when = Time::ZERO;
            for (micros, happening) in &happenings {
                when = when + Duration::from_micros(*micros);
                whole.run_to(when);
                whole.input(happening.input());
                single.plan(when, happening.input());
            }
            while single.step().is_some() {}
            whole.run_to(end);
            single.run_to(end);
            prop_assert_eq!(whole.outputs(), single.outputs());
            prop_assert_eq!(whole.device().state(), single.device().state());
        }
    }

    /// To run until a condition holds is to run to the time for which it is forecast; not the
    /// least bit earlier it holds already.
    #[test]
    fn running_until_is_the_forecast(happenings in happenings(), position in -1_i64..60) {
        let mut cart = Harness::new(Cart::default());
        for (micros, happening) in &happenings {
            cart.advance(Duration::from_micros(*micros));
            cart.input(happening.input());
            for condition in [at(position), Condition::Idle] {
                let forecast = cart.device().when(&condition);
                let mut ran = cart.clone();
                prop_assert_eq!(ran.run_until(&condition), forecast);
                let Some(forecast) = forecast else { continue };
                prop_assert_eq!(ran.now(), forecast);
                prop_assert_eq!(ran.device().crossing(&condition), Some(forecast));
                // What else is due at that instant is still to come.
                let mut there = cart.clone();
                there.run_to(forecast);
                ran.run_to(forecast);
                prop_assert_eq!(there, ran.clone());
                if forecast > cart.now() {
                    let mut before = cart.clone();
                    before.run_to(Time::from_nanos(forecast.as_nanos() - 1));
                    prop_assert_ne!(before.device().crossing(&condition), Some(before.now()));
                }
            }
        }
    }
}
