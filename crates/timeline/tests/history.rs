//! A history of a small device: a cart on a rail.

#[path = "../../device/tests/cart/mod.rs"]
mod cart;

use cart::Cart;
use vimc4_device::{Device, Input, Kinds, OwnedInput, SignalId, Time, TimedInput};
use vimc4_timeline::{Act, BranchId, History, Limits, Moment, Place};

fn ms(millis: u64) -> Time {
    Time::from_millis(millis)
}

/// A cart that has been told to go five steps and then a hundred, after both.
fn driven(limits: Limits) -> History<Cart> {
    let mut history = History::within(Cart::default(), limits);
    history.give(Input::Bytes(b"m5\r"));
    history.run_to(ms(50));
    history.give(Input::Bytes(b"m100\r"));
    history.run_to(ms(200));
    history.drain();
    history
}

fn moment(inputs: u64, bytes: u64, causes: u64, at: u64) -> Moment {
    Moment { inputs, bytes, causes, at: ms(at) }
}

fn trunk(moment: Moment) -> Place {
    Place { branch: BranchId(0), moment }
}

#[test]
fn moments_count_bytes_and_causes() {
    let mut history = History::new(Cart::default());
    history.give(Input::Bytes(b"m5\r"));
    let mut moments = Vec::new();
    while let Some(act) = history.step() {
        moments.push((act, history.present().moment));
    }
    assert_eq!(
        moments,
        [
            (Act::Byte(b'm'), moment(0, 1, 0, 0)),
            (Act::Byte(b'5'), moment(0, 2, 0, 0)),
            (Act::Byte(b'\r'), moment(1, 0, 0, 0)),
            // The line is done, then the motion ends.
            (Act::Cause, moment(1, 0, 1, 0)),
            (Act::Cause, moment(1, 0, 2, 5)),
        ]
    );
}

#[test]
fn a_step_back_undoes_a_step_and_the_time_after_it() {
    let mut history = driven(Limits::default());
    assert_eq!(history.present().moment, moment(2, 0, 2, 200));
    let mut trail = Vec::new();
    while history.back() {
        trail.push(history.present().moment);
    }
    assert_eq!(
        trail[..4],
        [moment(2, 0, 2, 150), moment(2, 0, 1, 50), moment(2, 0, 0, 50), moment(1, 4, 0, 50)]
    );
    assert_eq!(trail.last(), Some(&Moment::default()));
    assert!(history.outputs().is_empty());
    // From there everything comes again.
    let mut again = Vec::new();
    while history.present().moment < moment(2, 0, 2, 150) && history.step().is_some() {
        again.push(history.present().moment);
    }
    trail.reverse();
    assert_eq!(again, trail[1..]);
}

#[test]
fn what_was_only_tried_is_forgotten() {
    // With and without states on the way.
    for limits in [Limits::default(), Limits { spacing: 2, stride: 1, ..Limits::default() }] {
        let mut history = driven(limits);
        // What is on its way is known, and what comes of it is not.
        history.give(Input::Bytes(b"m7\r"));
        let (known, begin, state) = (history.known(), history.present(), history.device().state());
        for (tried, input) in [(1, &b"m9\r"[..]), (2, b"p\r"), (3, b"m3\rp\r")] {
            history.run_to_rest();
            assert_ne!(history.present(), begin);
            history.give(Input::Bytes(input));
            history.run_to(ms(300));
            history.go_back_to(begin);
            assert!(!history.is_at_end());
            history.forget_beyond(known);
            assert!(history.is_at_end(), "{tried}");
            assert_eq!((history.present(), history.device().state()), (begin, state.clone()));
            assert_eq!(history.inputs(BranchId(0), 0).count(), 3);
            assert!(history.snapshots(BranchId(0)).all(|kept| kept <= begin.moment));
        }
        // What is given next comes behind it, on the same branch.
        history.give(Input::Bytes(b"m2\r"));
        history.run_to(ms(400));
        assert_eq!(history.branches().count(), 1);
        let mut same = driven(limits);
        same.give(Input::Bytes(b"m7\r"));
        same.give(Input::Bytes(b"m2\r"));
        same.run_to(ms(400));
        assert_eq!(history.present(), same.present());
        assert_eq!(history.device().state(), same.device().state());
        let kept = |history: &History<Cart>| history.snapshots(BranchId(0)).collect::<Vec<_>>();
        assert_eq!(kept(&history), kept(&same));
    }
}

#[test]
fn what_a_branch_has_left_is_not_forgotten() {
    let mut history = driven(Limits::default());
    let known = history.known();
    history.give(Input::Bytes(b"m7\r"));
    history.run_to(ms(300));
    history.go_to_time(ms(204));
    history.give(Input::Signal(Cart::STOP, 1));
    let there = history.present();
    history.forget_beyond(known);
    assert_eq!(history.present(), there);
    assert!(history.go_to_end(BranchId(0)));
    assert_eq!(history.now(), ms(300));
}

#[test]
fn an_input_in_the_past_begins_a_branch_and_leaves_the_rest() {
    let mut history = driven(Limits::default());
    let end = history.present();
    history.go_to_time(ms(80));
    let from = history.present();
    history.give(Input::Signal(Cart::STOP, 1));
    history.run_to(ms(90));
    let branches: Vec<_> = history.branches().collect();
    assert_eq!(branches.len(), 2);
    assert_eq!((branches[0].end, branches[0].parted), (end.moment, None));
    assert_eq!(branches[1].parted, Some(from));
    assert_eq!((branches[1].id, branches[1].name.as_str()), (BranchId(1), "branch 1"));
    assert_eq!((branches[1].first.at, branches[1].end.at), (ms(80), ms(90)));
    let by = TimedInput { at: ms(80), input: OwnedInput::Signal(Cart::STOP, 1) };
    assert_eq!(history.inputs(BranchId(1), 0).collect::<Vec<_>>(), [by]);

    // Back over the parting, and to the ends of both.
    assert!(history.rename(BranchId(1), "stopped"));
    assert!(!history.rename(BranchId(2), "nothing"));
    while history.present().branch == BranchId(1) {
        assert!(history.back());
    }
    assert!(history.present().moment < from.moment, "the parting is present twice");
    assert!(history.go_to_end(BranchId(0)));
    assert_eq!(history.present(), end);
    assert!(history.go_to_end(BranchId(1)));
    assert_eq!(history.branches().nth(1).map(|branch| branch.name), Some("stopped".to_owned()));
    history.go_to_time(ms(60));
    assert_eq!(history.present().branch, BranchId(0));
    assert_eq!(history.now(), ms(60));
}

#[test]
fn a_state_of_an_earlier_time_begins_a_branch_at_that_time() {
    let mut history = driven(Limits::default());
    history.go_to_time(ms(52));
    let (state, there) = (history.device().state(), history.device().clone());
    history.go_to_end(BranchId(0));
    history.fork("put back", state);
    assert_eq!((history.now(), history.device().now()), (ms(52), ms(52)));
    history.run_to(ms(60));
    assert_eq!(history.now(), ms(60));
    let branch = history.branches().nth(1).unwrap();
    assert_eq!((branch.first.at, branch.parted.unwrap().moment.at), (ms(52), ms(200)));
    // On the way to its end a time is one of the branch from its first one on, and else of the trunk.
    history.go_to_time(ms(52));
    assert_eq!((history.present().branch, history.device()), (BranchId(1), &there));
    history.go_to_time(ms(51));
    assert_eq!(history.present().branch, BranchId(0));
}

#[test]
fn an_input_at_the_end_begins_none() {
    let mut history = driven(Limits::default());
    history.give(Input::Bytes(b"p\r"));
    history.give(Input::Bytes(b""));
    history.give(Input::Wake);
    history.run_to(ms(201));
    assert_eq!(history.branches().count(), 1);
    assert_eq!(history.inputs(BranchId(0), 0).count(), 3);
}

#[test]
fn a_place_that_is_none_is_not_gone_to() {
    let mut history = driven(Limits::default());
    let here = history.present();
    let state = history.device().state();
    for place in [
        // Beyond the end; in the middle of what takes no time; later or earlier than it was.
        trunk(moment(2, 0, 2, 201)),
        trunk(moment(1, 0, 9, 20)),
        trunk(moment(2, 0, 1, 160)),
        trunk(moment(2, 0, 2, 140)),
        Place { branch: BranchId(1), moment: Moment::default() },
    ] {
        assert!(!history.go_to(place), "{place:?}");
        assert_eq!(history.present(), here);
        assert_eq!(history.device().state(), state);
    }
    // A time at which nothing happens is one.
    assert!(history.go_to(trunk(moment(2, 0, 1, 120))));
}

#[test]
fn what_is_looked_for_is_found_either_way() {
    let mut history = driven(Limits { spacing: 3, snapshots: 8, ..Limits::default() });
    let line_ends = |act| act == Act::Byte(b'\r');
    assert!(history.find_last(|_, act, _| act.is_some_and(line_ends)));
    assert_eq!(history.present().moment, moment(2, 0, 0, 50));
    assert!(history.find_last(|_, act, _| act.is_some_and(line_ends)));
    assert_eq!(history.present().moment, moment(1, 0, 0, 0));
    assert!(!history.find_last(|_, act, _| act.is_some_and(line_ends)));
    assert_eq!(history.present().moment, moment(1, 0, 0, 0));
    assert!(history.find_last(|_, act, _| act.is_none()));
    assert_eq!(history.present().moment, Moment::default());
    // What it says is seen again.
    assert!(history.find_next(ms(200), |_, _, outputs| !outputs.is_empty()));
    assert_eq!(history.now(), ms(5));
    assert!(!history.find_next(ms(149), |_, _, outputs| !outputs.is_empty()));
    assert!(history.find_next(ms(150), |_, _, outputs| !outputs.is_empty()));
    assert!(!history.find_next(ms(1_000), |_, _, _| true));
}

/// One of so many moves of one step, two milliseconds each.
fn moved(moves: u64, limits: Limits) -> History<Cart> {
    let mut history = History::within(Cart::default(), limits);
    for number in 0..moves {
        history.give(Input::Bytes(b"m1\r"));
        history.run_to(ms(2 * (number + 1)));
    }
    history.drain();
    history
}

#[test]
fn states_are_bounded_and_anything_is_found_between_them() {
    let limits = Limits { spacing: 10, snapshots: 16, stride: 3, waypoints: 20 };
    let mut history = moved(2_000, limits);
    let usage = history.usage();
    assert_eq!(usage.inputs, 2_000);
    assert!((8 + 20..=16 + 20).contains(&usage.snapshots), "{usage:?}");
    assert!(usage.input_bytes < 200_000, "{usage:?}");
    assert!(usage.snapshot_bytes >= usage.snapshots * 16, "{usage:?}");
    // 2,000 times three bytes, a line that is done, and the end of a motion: none is far from a state.
    let moments: Vec<Moment> = history.snapshots(BranchId(0)).collect();
    let farthest = moments.windows(2).map(|pair| pair[1].inputs - pair[0].inputs).max().unwrap();
    assert!(farthest <= 2 * 2_000 / 8, "{farthest} moves between two of {moments:?}");
    for at in [3_001, 1, 2_500, 3_999] {
        history.go_to_time(ms(at));
        assert_eq!(history.device().view(ms(at)).axes[0].position, (at as i64 + 1) / 2);
    }
    assert_eq!(history.usage().snapshots, usage.snapshots);
}

#[test]
fn a_step_back_is_as_short_in_a_long_session_as_in_a_short_one() {
    // All of it is one stretch without a state that is kept for good.
    let limits = Limits { spacing: 1 << 30, stride: 16, waypoints: 64, ..Limits::default() };
    let looked_at = |history: &mut History<Cart>| {
        let mut acts = 0_u64;
        for _ in 0..200 {
            assert!(history.find_last(|_, _, _| {
                acts += 1;
                true
            }));
        }
        acts
    };
    let most = 200 * limits.stride;
    assert!(looked_at(&mut moved(100, limits)) <= most);
    let mut long = moved(10_000, limits);
    assert!(looked_at(&mut long) <= most);
    // Where nobody has been for long, too: on the way there, states are kept again.
    long.go_to_time(ms(10_000));
    assert!(looked_at(&mut long) <= most);
    assert!(long.usage().snapshots <= 1 + 64);
}

#[test]
fn a_device_that_never_rests_is_bounded_by_a_time() {
    let mut history = History::new(Cart::default());
    history.watch(Kinds::ALL);
    history.give(Input::Bytes(b"b\r"));
    assert!(!history.find_next(ms(500), |_, _, _| false));
    history.run_to(ms(500));
    assert!(history.is_at_end());
    history.give(Input::Signal(SignalId(9), 1));
    assert_eq!(history.step(), Some(Act::Input));
    assert_eq!(history.into_device().now(), ms(500));
}

#[test]
fn a_state_that_there_was_is_gone_back_to() {
    // Snapshots all the way, and none at all.
    for spacing in [1, 1_000] {
        let mut history = driven(Limits { spacing, ..Limits::default() });
        let end = history.present();
        // In the middle of a motion, and between two things that happen at one instant.
        let halfway = trunk(moment(2, 0, 1, 90));
        let amid = trunk(moment(1, 2, 0, 50));
        for (place, branch) in [(halfway, 1), (amid, 2)] {
            assert!(history.go_to(place), "{place:?}");
            let state = history.device().state();
            history.go_to_end(BranchId(0));
            history.put_back("unknown", state.clone());
            assert_eq!(history.device().state(), state);
            let branch = history.branches().nth(branch).unwrap();
            let name = format!("from {}ms", place.moment.at.as_nanos() / 1_000_000);
            assert_eq!((branch.parted, branch.name), (Some(place), name));
            // On the way to it there is nothing of what is left.
            history.run_to(ms(120));
            history.give(Input::Bytes(b"p\r"));
            history.run_to(ms(130));
            history.go_to_time(ms(80));
            assert_eq!(
                history.present().branch,
                if place == amid { branch.id } else { BranchId(0) }
            );
            assert!(history.find_next(Time::from_secs(1), |_, _, _| true));
            assert_eq!(history.present().branch, branch.id);
        }
        // What was left is still there; what it is in already is no other state, and what was never there
        // begins where it is.
        assert!(history.go_to(end));
        let state = history.device().state();
        history.put_back("the same", state);
        assert_eq!((history.present(), history.branches().count()), (end, 3));
        let mut other = history.device().clone();
        other.handle(Input::Bytes(b"m3\r"), ms(200));
        history.put_back("another", other.state());
        let branch = history.branches().last().unwrap();
        assert_eq!((branch.parted, &*branch.name), (Some(end), "another"));
    }
}

#[test]
fn a_state_of_a_branch_that_was_left_is_gone_back_to() {
    for spacing in [1, 1_000] {
        let mut history = driven(Limits { spacing, ..Limits::default() });
        let end = history.present();
        history.go_to_time(ms(90));
        let early = history.device().state();
        history.go_to_time(ms(120));
        let late = history.device().state();
        // From the end back to 90 ms, and on to a little later; what was at 120 ms was on what is left.
        history.go_to(end);
        history.put_back("unknown", early);
        history.give(Input::Bytes(b"p\r"));
        history.run_to(ms(100));
        let second = history.present();
        history.put_back("unknown", late.clone());
        assert_eq!(history.device().state(), late);
        let branch = history.branches().last().unwrap();
        let parted = branch.parted.unwrap();
        assert_eq!(
            (parted.branch, parted.moment.at, &*branch.name),
            (BranchId(0), ms(120), "from 120ms")
        );
        // Where that ended it goes on, and where it was never it begins anew.
        assert_eq!(history.device().now(), ms(120));
        history.run_to(ms(125));
        let count = history.branches().count();
        history.go_to(second);
        let state = history.device().state();
        history.go_to_end(branch.id);
        history.put_back("unknown", state);
        assert_eq!((history.present(), history.branches().count()), (second, count));
    }
}

#[test]
fn who_stands_beside_the_way_of_a_branch_that_grows_stays_on_its_own() {
    let mut history = driven(Limits::default());
    history.go_to_time(ms(90));
    let state = history.device().state();
    history.go_to_time(ms(150));
    history.at_end(BranchId(0), |history| history.put_back("", state));
    assert_eq!((history.now(), history.heading()), (ms(150), BranchId(0)));
    history.go_to_time(ms(60));
    history.at_end(BranchId(1), |history| history.run_to(ms(100)));
    assert_eq!((history.now(), history.heading()), (ms(60), BranchId(0)));
}
