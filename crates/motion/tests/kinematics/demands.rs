//! Where a motion asks for more than a motor can.

use proptest::prelude::*;
use vimc4_motion::{AXES, Path, Profile, Pull, Ramp, Segment, StraightLine};

use crate::courses::profiles as courses;
use crate::profiles::speeds_and_ramps;
use crate::segments::paths;
use crate::{cases, point};

/// 5,000 steps of X and half as many of Y, with 100 Hz/ms from 300 Hz up to 10,000.
fn reference() -> Segment {
    let ramp = Ramp { start_stop: 300, acceleration: 100 };
    let path = Path::Line(StraightLine::new(point([5_000, 2_500])));
    Segment { path, profile: Profile::new(5_000, 10_000, ramp) }
}

#[test]
fn a_ramp_that_is_too_steep() {
    // At 5,000 Hz it pulls the 100 Hz/ms that X is asked for: (5,000² - 300²)/200,000 = 124.55.
    let pull = Pull { curve: &[(0, 200), (10_000, 0)], start: None, load: 0 };
    assert_eq!(reference().exceeds(0, 0, &pull), Some(125));
    assert_eq!(reference().exceeds(0, 125, &pull), Some(125));
    // Y is asked for half of that, and is at 5,000 Hz at the top.
    assert_eq!(reference().exceeds(1, 0, &pull), None);
    // With a load that asks for 50 more, X comes to 2,500 Hz: 30.8 steps.
    let loaded = Pull { load: 50, ..pull };
    assert_eq!(reference().exceeds(0, 0, &loaded), Some(31));
    // Y to 5,000, which are 10,000 of the clock: all of the ramp, (10,000² - 300²)/200,000 = 499.55.
    assert_eq!(reference().exceeds(1, 0, &loaded), None);
    assert_eq!(reference().exceeds(1, 0, &Pull { load: 60, ..pull }), Some(405));
    // What rests is asked for nothing.
    assert_eq!(reference().exceeds(2, 0, &Pull { load: 1_000, ..pull }), None);
}

#[test]
fn a_start_that_is_too_fast() {
    let pull = |start| Pull { curve: &[], start: Some(start), load: 0 };
    assert_eq!(reference().exceeds(0, 0, &pull(299)), Some(0));
    assert_eq!(reference().exceeds(0, 0, &pull(300)), None);
    // Once it turns it has started.
    assert_eq!(reference().exceeds(0, 1, &pull(299)), None);
    assert_eq!(reference().exceeds(1, 0, &pull(150)), None);
    assert_eq!(reference().exceeds(1, 0, &pull(149)), Some(0));
}

#[test]
fn braking_asks_for_its_own() {
    let pull = Pull { curve: &[(9_000, 100), (20_000, 90)], start: None, load: 5 };
    // At the top it pulls the load; on its way up it would be asked for 105.
    assert_eq!(reference().exceeds(0, 0, &pull), Some(0));
    let pull = Pull { curve: &[(9_000, 110), (20_000, 90)], ..pull };
    // 105 at 11,750 Hz: never asked for. The load helps to brake.
    assert_eq!(reference().exceeds(0, 0, &pull), None);
    let pull = Pull { curve: &[(9_000, 110), (9_500, 95), (9_600, 0)], ..pull };
    // 105 at 9,166.6 Hz: 419.7 steps.
    assert_eq!(reference().exceeds(0, 0, &pull), Some(420));
    // From the top on: 5 at 9,594.7 Hz, so at once; and on the way down, where 95 is asked for, from
    // 9,500 Hz on all is well: the steps 4,501 to 4,548 are not made.
    assert_eq!(reference().exceeds(0, 3_000, &pull), Some(3_000));
    assert_eq!(reference().exceeds(0, 4_530, &pull), Some(4_530));
    assert_eq!(reference().exceeds(0, 4_560, &pull), None);
}

/// The first step before which the share of an axis in the frequency is above one, step by step.
fn walked(segment: &Segment, axis: usize, from: u64, hertz: u32) -> Option<u64> {
    let Path::Line(_) = segment.path else { return None };
    let way = segment.path.at(u64::MAX)[axis].unsigned_abs();
    (from..segment.profile.steps()).find(|step| {
        let asked = segment.profile.speed_at(segment.profile.time_of(*step));
        let share = u128::from(asked) * u128::from(way);
        share > u128::from(hertz) * 1_000_000 * u128::from(segment.path.length())
    })
}

proptest! {
    #![proptest_config(cases(1_000))]

    #[test]
    fn searched_and_walked(
        path in paths(),
        (speed, ramp) in speeds_and_ramps(),
        braked_at in prop_oneof![0.0..1.0f64, Just(2.0f64)],
        hertz in prop_oneof![1..1_000u32, 1_000..40_000u32],
        from in prop_oneof![Just(0), 0..500u64],
    ) {
        let whole = Profile::new(path.length(), speed, ramp);
        let at = (whole.duration() as f64 * braked_at) as u64;
        let profile = whole.brake(at).unwrap_or(whole);
        let segment = Segment { path, profile };
        let pull = Pull { curve: &[(hertz, u32::MAX)], start: None, load: 0 };
        for axis in 0..AXES {
            if let Path::Line(_) = segment.path {
                let walked = walked(&segment, axis, from, hertz);
                prop_assert_eq!(segment.exceeds(axis, from, &pull), walked);
            }
        }
    }

    #[test]
    fn along_the_way(
        profile in courses(),
        hertz in prop_oneof![1..1_000u32, 1_000..400_000u32],
        from in prop_oneof![Just(0), 0..500u64],
    ) {
        let steps = profile.steps().min(3_000) as i64;
        prop_assume!(profile.steps() <= 3_000);
        let path = Path::Line(StraightLine::new(point([steps, steps / 3])));
        let segment = Segment { path, profile };
        let pull = Pull { curve: &[(hertz, u32::MAX)], start: None, load: 0 };
        for axis in 0..3 {
            let walked = walked(&segment, axis, from, hertz);
            prop_assert_eq!(segment.exceeds(axis, from, &pull), walked);
        }
    }
}
