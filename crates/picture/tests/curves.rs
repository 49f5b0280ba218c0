//! What is drawn is where the steps are.

use proptest::prelude::*;
use vimc4_device::{Event, Motion};
use vimc4_motion::{
    AXES, Arc, Chain, CircleFit, Helix, Path, Point, Profile, Ramp, Segment, StraightLine, Time,
    Turn,
};
use vimc4_picture::{Leg, Plot, Way};

/// A plot of one motion.
fn plot(path: Path, ramp: Ramp) -> Plot {
    let length = path.length();
    let profile = Profile::new(length, 4_000, ramp);
    let end = Time::from_nanos(profile.duration());
    let segment = Box::new(Segment { path, profile });
    let mut plot = Plot::new();
    plot.see(Time::ZERO, &Event::Motion(Motion::Begins { origin: [0; AXES], segment }));
    plot.see(end, &Event::Motion(Motion::Ends { steps: length }));
    plot
}

fn lines() -> impl Strategy<Value = Path> {
    [-400_i64..400, -400..400, -400..400]
        .prop_map(|[x, y, z]| Path::Line(StraightLine::new([x, y, z, 0, 0, 0])))
}

fn arcs() -> impl Strategy<Value = Arc> {
    let turn = prop_oneof![Just(Turn::Clockwise), Just(Turn::Counterclockwise)];
    let planes = prop_oneof![Just((0, 1)), Just((0, 2)), Just((1, 2))];
    (-500_i64..500, -500_i64..500, turn, planes, 0.01_f64..2.5).prop_filter_map(
        "a circle",
        |(x, y, turn, (first, second), turns)| {
            let fit = CircleFit::new(x, y, x * x + y * y, turn)?;
            let steps = (fit.steps_per_turn() as f64 * turns) as u64;
            Some(Arc::new(first, second, steps, fit.start()))
        },
    )
}

fn paths() -> impl Strategy<Value = Path> {
    let helices = (arcs(), -3_000_i64..3_000).prop_map(|(arc, rise)| {
        let path = Path::Arc(arc.clone());
        let third = path.circle_at(0).map_or(2, |((first, second), _)| 3 - first - second);
        Path::Helix(Helix::new(arc, third, rise))
    });
    let simple = prop_oneof![lines(), arcs().prop_map(Path::Arc), helices].boxed();
    let chains = proptest::collection::vec(simple.clone(), 1..5);
    prop_oneof![simple, chains.prop_map(|links| Path::Chain(Chain::new(links)))]
}

/// How far a place is from the nearest of the drawn lines.
fn beside(place: &Point, lines: &[(Point, Point)]) -> f64 {
    let distance = |(from, to): &(Point, Point)| {
        let way: Vec<f64> = (0..AXES).map(|axis| (to[axis] - from[axis]) as f64).collect();
        let off: Vec<f64> = (0..AXES).map(|axis| (place[axis] - from[axis]) as f64).collect();
        let square: f64 = way.iter().map(|way| way * way).sum();
        let dot: f64 = way.iter().zip(&off).map(|(way, off)| way * off).sum();
        let share = if square > 0.0 { (dot / square).clamp(0.0, 1.0) } else { 0.0 };
        let rest = way.iter().zip(&off).map(|(way, off)| (off - share * way).powi(2));
        rest.sum::<f64>().sqrt()
    };
    lines.iter().map(distance).fold(f64::MAX, f64::min)
}

/// The lines that are drawn of a motion.
fn drawn(leg: &Leg, tolerance: f64) -> Vec<(Point, Point)> {
    let mut from = [0; AXES];
    let mut lines = Vec::new();
    for vertex in leg.vertices(&[1.0; AXES], tolerance) {
        if vertex.way != Way::Again {
            lines.push((from, vertex.offset));
        }
        from = vertex.offset;
    }
    lines
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn each_step_lies_within_the_tolerance_of_what_is_drawn(
        path in paths(), tolerance in 0.0_f64..40.0,
    ) {
        prop_assume!(path.length() > 0);
        let plot = plot(path.clone(), Ramp { start_stop: 300, acceleration: 50 });
        let lines = drawn(&plot.legs()[0], tolerance);
        // Chords are looked at in three places, and steps are beside the curve themselves.
        let most = tolerance.max(1.5) * 1.25 + 1.5;
        for place in path.steps().step_by(7) {
            let off = beside(&place, &lines);
            prop_assert!(off <= most, "{off} of {tolerance} at {place:?} in {} lines", lines.len());
        }
        let last = plot.legs()[0].vertices(&[1.0; AXES], tolerance).last().copied();
        prop_assert_eq!(last.map(|vertex| vertex.offset), Some(path.at(path.length())));
    }

    #[test]
    fn what_is_taken_together_stays_within_what_is_said(
        ways in proptest::collection::vec([-9_i64..9, -9..9], 40..200),
    ) {
        let mut kept = Plot::new().keeping(16);
        let (mut at, mut origin) = (Time::ZERO, [0; AXES]);
        let mut places = Vec::new();
        for [x, y] in ways {
            let path = Path::Line(StraightLine::new([x, y, 0, 0, 0, 0]));
            let steps = path.length();
            let profile = Profile::constant(steps, 1_000);
            let end = at.after_nanos(profile.duration());
            let moved: Vec<Point> = path.steps().collect();
            let segment = Box::new(Segment { path, profile });
            kept.see(at, &Event::Motion(Motion::Begins { origin, segment }));
            kept.see(end, &Event::Motion(Motion::Ends { steps }));
            places.extend(moved.iter().map(|by| [origin[0] + by[0], origin[1] + by[1], 0, 0, 0, 0]));
            if let Some(last) = moved.last() {
                origin = [origin[0] + last[0], origin[1] + last[1], 0, 0, 0, 0];
            }
            at = end;
        }
        prop_assert!(kept.legs().len() <= 16);
        prop_assert!(kept.motions() > 16 && kept.astray() > 0);
        let lines: Vec<(Point, Point)> = kept.legs().iter().map(|leg| (leg.from, leg.to())).collect();
        // A place is no further from the beginning of its line than that, on any axis.
        let most = kept.astray() as f64 * 2.0_f64.sqrt() + 1.5;
        for place in places {
            prop_assert!(beside(&place, &lines) <= most);
        }
        let (first, last) = (kept.legs().first(), kept.legs().last());
        if let (Some(first), Some(last)) = (first, last) {
            prop_assert_eq!((first.from, last.to()), ([0; AXES], origin));
            prop_assert_eq!(last.ends, at);
        }
    }
}
