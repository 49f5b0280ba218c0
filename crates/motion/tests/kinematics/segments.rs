//! Path and profile together: what a controller's motion is.

use proptest::prelude::*;
use vimc4_motion::{AXES, Arc, ArcState, Helix, Path, Profile, Ramp, Segment, StraightLine};

use crate::profiles::speeds_and_ramps;
use crate::{arcs, cases, point};

/// A path of any kind, of a few thousand steps at most.
pub(crate) fn paths() -> impl Strategy<Value = Path> {
    let way = || prop_oneof![-40..=40i64, -2_000..=2_000i64];
    prop_oneof![
        [(); AXES].map(|()| way()).prop_map(|delta| Path::Line(StraightLine::new(delta))),
        arcs().prop_map(|(arc, _)| Path::Arc(arc)),
        (arcs(), way()).prop_map(|((arc, axis), s3)| Path::Helix(Helix::new(arc, axis, s3))),
    ]
}

proptest! {
    #![proptest_config(cases(2_000))]

    /// Step by step the same places at the same times, also when the motion is braked, goes on
    /// from there, and is braked again.
    #[test]
    fn stepwise_and_closed_form(
        path in paths(),
        (speed, ramp) in speeds_and_ramps(),
        braked_at in prop_oneof![0.0..1.0f64, Just(2.0f64)],
    ) {
        let mut path = path;
        for _ in 0..3 {
            let whole = Profile::new(path.length(), speed, ramp);
            let at = (whole.duration() as f64 * braked_at) as u64;
            let profile = whole.brake(at).unwrap_or(whole);
            let segment = Segment { path: path.clone(), profile };
            let mut count = 0;
            for step in segment.steps() {
                count += 1;
                prop_assert_eq!(step.number, count);
                prop_assert_eq!(step.nanos, segment.profile.time_of(count));
                prop_assert_eq!(step.offset, segment.path.at(count));
                prop_assert_eq!(segment.offset_at(step.nanos), step.offset);
            }
            prop_assert_eq!(segment.profile.steps(), count);
            for axis in 0..AXES {
                let last = segment.path.at(count)[axis];
                let first = segment.steps().find(|step| step.offset[axis] == last);
                let expected = if last == 0 { 0 } else { first.map_or(0, |step| step.nanos) };
                prop_assert_eq!(segment.time_at(axis, last), Some(expected));
            }
            path = path.after(count);
        }
    }
}

#[test]
fn what_lies_beyond_the_brakes_is_not_reached() {
    let ramp = Ramp { start_stop: 300, acceleration: 100 };
    let profile = Profile::new(5_000, 10_000, ramp);
    let segment =
        Segment { path: Path::Line(StraightLine::new(point([5_000, 0, -2_500]))), profile };
    assert_eq!(segment.time_at(0, 5_000), Some(594_090_000));
    assert_eq!(segment.time_at(2, -2_500), Some(segment.profile.time_of(4_999)));
    let profile = segment.profile.brake(50_000_000).unwrap();
    let braked = Segment { profile, ..segment };
    assert_eq!(braked.time_at(0, 280), Some(100_000_000));
    assert_eq!(braked.time_at(0, 281), None);
    assert_eq!(braked.offset_at(u64::MAX), point([280, 0, -140]));
    assert_eq!(braked.steps().count(), 280);
}

#[test]
fn a_braked_circle_goes_on_to_where_it_would_have_ended() {
    let start = ArcState { x: 500, y: 0, d: -250, rx: -1, ry: 1 };
    let circle = Path::Arc(Arc::new(0, 1, 4_000, start));
    let profile = Profile::new(4_000, 1_500, Ramp { start_stop: 300, acceleration: 100 });
    let braked = profile.brake(700_000_000).unwrap();
    let rest = circle.after(braked.steps());
    let (here, there) = (circle.at(braked.steps()), rest.at(u64::MAX));
    assert_eq!((here[0] + there[0], here[1] + there[1]), (0, 0));
    assert_eq!(rest.length() + braked.steps(), 4_000);
}
