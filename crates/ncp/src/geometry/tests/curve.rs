//! Arcs and helices.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use proptest::prelude::*;
use vimc4_isel_wire::Plane;
use vimc4_motion::Turn;

use super::super::{
    Circle, Curve, CurveParameters, Fitted, MOST_STEPS, Motion, Scale, Speeds, Steps,
};
use super::{PLANES, SPEEDS, TURNS, USUAL, cases};
use crate::language::Value;

/// What a test is about.
#[derive(Clone, Debug)]
struct Case {
    plane: Plane,
    turn: Turn,
    scales: [Scale; 4],
    centre: [i64; 2],
    start: [i64; 2],
    end: Option<[i64; 2]>,
    rise: Option<(i64, i64)>,
    has_helix: bool,
}

/// The curve as the test sees it: all in floating point, by angles.
struct Ideal {
    centre: [f64; 2],
    radius: f64,
    from: f64,
    sweep: f64,
    sign: f64,
    end: [f64; 2],
    rise: (f64, f64),
    /// Thousandths a step: of the first, the second and the third axis.
    steps: [f64; 3],
}

impl Case {
    fn parameters(&self) -> CurveParameters {
        let values = |place: [i64; 2]| place.map(Value::thousandths);
        let (first, second) = self.plane.axes();
        let scales = [self.scales[first], self.scales[second]];
        let end = self.end.map(values);
        let circle = Circle::new(
            self.plane,
            self.turn,
            values(self.centre),
            values(self.start),
            end,
            scales,
        )
        .unwrap();
        let rise = self.rise.map(|(low, high)| (Value::thousandths(low), Value::thousandths(high)));
        let counters = |place: [i64; 2], third: Option<Value>| {
            let mut steps = [0, 0, 0, 17];
            steps[first] = scales[0].round(Value::thousandths(place[0]));
            steps[second] = scales[1].round(Value::thousandths(place[1]));
            let scale = self.scales[self.plane.third()];
            steps[self.plane.third()] = third.map_or(-5, |third| scale.round(third));
            steps
        };
        CurveParameters {
            circle,
            scales: self.scales,
            from: counters(self.start, rise.map(|rise| rise.0)),
            to: counters(self.end.unwrap_or(self.start), rise.map(|rise| rise.1)),
            rise,
            velocity: 25e6,
            speeds: SPEEDS,
            has_helix: self.has_helix,
        }
    }

    fn ideal(&self) -> Ideal {
        let end = self.end.unwrap_or(self.start);
        let way =
            |place: [i64; 2]| [0, 1].map(|axis: usize| (place[axis] - self.centre[axis]) as f64);
        let (from, to) = (way(self.start), way(end));
        let sign = self.turn.sign() as f64;
        let from_angle = libm::atan2(from[1], from[0]);
        let between = sign * (libm::atan2(to[1], to[0]) - from_angle);
        let mut sweep = between - TAU * libm::floor(between / TAU);
        // Too near for floating point.
        let across = self.across();
        if end == self.start || across == 0 && sweep < 1.0 || across < 0 && sweep < 1.0 {
            sweep = TAU;
        } else if across > 0 && sweep > 5.0 {
            sweep = 0.0;
        }
        let (first, second) = self.plane.axes();
        let third = self.plane.third();
        let rise = self.rise.unwrap_or((-5 * self.scales[third].per, -5 * self.scales[third].per));
        let per_step = if self.rise.is_some() { 1.0 } else { self.scales[third].steps as f64 };
        Ideal {
            centre: self.centre.map(|place| place as f64),
            radius: libm::hypot(from[0], from[1]),
            from: from_angle,
            sweep,
            sign,
            end: end.map(|place| place as f64),
            rise: (rise.0 as f64 / per_step, rise.1 as f64 / per_step),
            steps: [first, second, third].map(|axis| self.scales[axis].step()),
        }
    }

    /// On which side of the start the end is, exactly.
    fn across(&self) -> i128 {
        let end = self.end.unwrap_or(self.start);
        let way =
            |place: [i64; 2]| [0, 1].map(|axis: usize| i128::from(place[axis] - self.centre[axis]));
        let (from, to) = (way(self.start), way(end));
        i128::from(self.turn.sign()) * (from[0] * to[1] - from[1] * to[0])
    }

    /// Walks all motions. Each place has to be within two steps, and the last where it must be.
    fn check(&self) -> Result<Vec<Motion>, TestCaseError> {
        let parameters = self.parameters();
        let ideal = self.ideal();
        let curve = Curve::new(parameters);
        let motions: Vec<Motion> = curve.clone().collect();
        let mut at = parameters.from;
        let (first, second) = self.plane.axes();
        let third = self.plane.third();
        let mut worst: f64 = 0.0;
        for motion in &motions {
            let path = motion.path();
            prop_assert!(path.length() > 0, "{motion:?}");
            for way in path.steps() {
                let place = [first, second, third].map(|axis| at[axis] + way[axis]);
                let off = ideal.distance(place);
                worst = worst.max(off);
                prop_assert!(off <= 2.0, "{off} at {place:?} in {motion:?} of {motions:?}");
            }
            let by = path.at(u64::MAX);
            for (at, by) in at.iter_mut().zip(by) {
                *at += by;
            }
            prop_assert!((20..=40_000).contains(&motion.speed()));
        }
        prop_assert_eq!(at, parameters.to);
        Ok(motions)
    }
}

impl Ideal {
    /// How far a place is from the curve or its end, in steps of each axis.
    fn distance(&self, place: [i64; 3]) -> f64 {
        let world: [f64; 3] = std::array::from_fn(|axis| place[axis] as f64 * self.steps[axis]);
        let off = |x: f64, y: f64, z: f64| {
            let by = [x - world[0], y - world[1], z - world[2]];
            let square: f64 = (0..3).map(|axis| (by[axis] / self.steps[axis]).powi(2)).sum();
            square.sqrt()
        };
        let from_curve = |angle: f64| {
            let angle = angle.clamp(0.0, self.sweep);
            let there = self.from + self.sign * angle;
            let rise = self.rise.1 - self.rise.0;
            off(
                self.centre[0] + self.radius * there.cos(),
                self.centre[1] + self.radius * there.sin(),
                self.rise.0 + rise * angle / self.sweep.max(f64::MIN_POSITIVE),
            )
        };
        let seen = libm::atan2(world[1] - self.centre[1], world[0] - self.centre[0]);
        let ahead = self.sign * (seen - self.from);
        let ahead = ahead - TAU * libm::floor(ahead / TAU);
        let window = (12.0 * self.steps[0].max(self.steps[1]) / self.radius).min(PI);
        let mut least = off(self.end[0], self.end[1], self.rise.1);
        for angle in [ahead, ahead - TAU, ahead + TAU] {
            least = least.min(from_curve(angle));
            if least <= 2.0 {
                return least;
            }
            // The third axis, or another scale, can make another point the nearest.
            let low = (angle - window).clamp(0.0, self.sweep);
            let high = (angle + window).clamp(0.0, self.sweep);
            let part = (high - low) / 200.0;
            let at = |index: i32| low + part * f64::from(index);
            let nearest =
                (0..=200).map(at).min_by(|a, b| from_curve(*a).total_cmp(&from_curve(*b)));
            let (mut low, mut high) =
                nearest.map(|angle| ((angle - part).max(low), (angle + part).min(high))).unwrap();
            for _ in 0..40 {
                let third = (high - low) / 3.0;
                if from_curve(low + third) < from_curve(high - third) {
                    high -= third;
                } else {
                    low += third;
                }
            }
            least = least.min(from_curve(low));
        }
        least
    }
}

/// Where an arc ends.
#[derive(Clone, Debug)]
enum End {
    None,
    Start,
    Beside([i64; 2]),
    /// At an angle, and so many steps further out.
    At(f64, f64),
}

fn ends() -> impl Strategy<Value = End> {
    prop_oneof![
        1 => Just(End::None),
        1 => Just(End::Start),
        2 => [-2_000..=2_000i64, -2_000..=2_000i64].prop_map(End::Beside),
        2 => [-40_000..=40_000i64, -40_000..=40_000i64].prop_map(End::Beside),
        1 => (0..8i32).prop_map(|eighth| End::At(f64::from(eighth) * FRAC_PI_2 / 2.0, 0.0)),
        6 => (0.0..TAU).prop_map(|angle| End::At(angle, 0.0)),
        2 => (0.0..TAU, -1.9..1.9f64).prop_map(|(angle, out)| End::At(angle, out)),
    ]
}

fn scale() -> impl Strategy<Value = Scale> {
    prop_oneof![
        Just(USUAL),
        Just(Scale { steps: 160, per: 1_000_000 }),
        Just(Scale { steps: 1_000, per: 3_000_000 }),
        Just(Scale { steps: 40, per: 1_000_000 }),
        Just(Scale { steps: 1_000, per: 1_000_000 }),
    ]
}

/// An arc with a radius in steps.
fn arcs(radius: impl Strategy<Value = f64>) -> impl Strategy<Value = Case> {
    let start = prop_oneof![
        1 => (0..8i32).prop_map(|eighth| f64::from(eighth) * FRAC_PI_2 / 2.0),
        3 => 0.0..TAU,
    ];
    let centre = prop_oneof![
        1 => [-500..=500i64, -500..=500i64].prop_map(|steps| (steps, [0, 0])),
        3 => ([-500..=500i64, -500..=500i64], [-60_000..=60_000i64, -60_000..=60_000i64]),
    ];
    let whole = prop_oneof![1 => Just(true), 3 => Just(false)];
    let which = (0..3usize, 0..2usize, scale(), whole);
    (which, radius, start, centre, ends()).prop_map(
        |((plane, turn, scale, whole), radius, from, centre, end)| {
            let radius = if whole { radius.round() } else { radius };
            let step = scale.step();
            let (steps, beside) = centre;
            let centre = [0, 1].map(|axis: usize| {
                (steps[axis] as f64 * step).round() as i64 + beside[axis] % step as i64
            });
            let at = |angle: f64, radius: f64| {
                let out = radius * step;
                let (sine, cosine) = libm::sincos(angle);
                [centre[0] + (out * cosine).round() as i64, centre[1] + (out * sine).round() as i64]
            };
            let start = at(from, radius);
            let turn = TURNS[turn];
            let end = match end {
                End::None => None,
                End::Start => Some(start),
                End::Beside(by) => {
                    // Within the two steps that radii may differ by.
                    let limit = (1.4 * step) as i64;
                    Some([0, 1].map(|axis: usize| start[axis] + by[axis].clamp(-limit, limit)))
                }
                End::At(angle, out) => Some(at(angle, (radius + out).max(0.5))),
            };
            Case {
                plane: PLANES[plane],
                turn,
                scales: [scale; 4],
                centre,
                start,
                end,
                rise: None,
                has_helix: false,
            }
        },
    )
}

fn radii(most: f64) -> impl Strategy<Value = f64> {
    prop_oneof![1.0..12.0f64, (0.0..most.ln()).prop_map(f64::exp)]
}

fn is_arc(motion: &Motion) -> bool {
    matches!(motion, Motion::Arc(..))
}

fn is_helix(motion: &Motion) -> bool {
    matches!(motion, Motion::Helix(..))
}

proptest! {
    #![proptest_config(cases(2_000))]

    #[test]
    fn arcs_stay_within_two_steps(case in arcs(radii(10_000.0))) {
        let motions = case.check()?;
        prop_assert!(!motions.iter().any(is_helix));
    }

    #[test]
    fn so_do_those_with_unequal_scales(case in arcs(radii(3_000.0)), other in scale()) {
        let mut case = case;
        case.scales[case.plane.axes().1] = other;
        if Circle::new(
            case.plane,
            case.turn,
            case.centre.map(Value::thousandths),
            case.start.map(Value::thousandths),
            case.end.map(|end| end.map(Value::thousandths)),
            [case.scales[0], other],
        ).is_err() {
            // The finer axis finds the radii too far apart.
            case.end = None;
        }
        let motions = case.check()?;
        let equal = case.scales[case.plane.axes().0] == other;
        prop_assert!(equal || !motions.iter().any(is_arc));
    }

    #[test]
    fn so_do_helices(
        case in arcs(radii(3_000.0)),
        low in -3_000_000..=3_000_000i64,
        rise in prop_oneof![-30_000..=30_000i64, -2_000_000..=2_000_000i64, -40_000_000..=40_000_000i64],
        has_helix: bool,
        third in scale(),
    ) {
        let mut case = case;
        case.rise = Some((low, low + rise));
        case.scales[case.plane.third()] = third;
        case.has_helix = has_helix;
        let motions = case.check()?;
        prop_assert!(has_helix || !motions.iter().any(is_helix));
    }
}

proptest! {
    #![proptest_config(cases(40))]

    #[test]
    fn so_do_large_ones(case in arcs(5_000.0..100_000.0f64), rise in -20_000_000..=20_000_000i64, helix: bool) {
        let mut case = case;
        if helix {
            case.rise = Some((0, rise));
            case.has_helix = true;
        }
        case.check()?;
    }
}

/// An arc about the origin in XY with 80 steps a mm, its places in µm.
fn usual(turn: Turn, centre: [i64; 2], start: [i64; 2], end: Option<[i64; 2]>) -> Case {
    let nm = |place: [i64; 2]| place.map(|value| value * 1_000);
    Case {
        plane: Plane::Xy,
        turn,
        scales: [USUAL; 4],
        centre: nm(centre),
        start: nm(start),
        end: end.map(nm),
        rise: None,
        has_helix: true,
    }
}

#[test]
fn the_shares() {
    use proptest::strategy::ValueTree;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    for helix in [false, true] {
        for (name, strategy) in
            [("all", radii(10_000.0).boxed()), ("large", (20.0..10_000.0f64).boxed())]
        {
            let (mut arcs_made, mut helices, mut chords, mut exact, mut pieces, mut hist) =
                (0, 0, 0, 0, 0, [0usize; 10]);
            for _ in 0..20_000 {
                let mut case = arcs(strategy.clone()).new_tree(&mut runner).unwrap().current();
                case.has_helix = true;
                if helix {
                    case.rise = Some((0, 1_000_000));
                }
                let motions: Vec<Motion> = Curve::new(case.parameters()).collect();
                if matches!(case.end, Some(end) if { let r = |p: [i64;2]| libm::hypot((p[0]-case.centre[0]) as f64, (p[1]-case.centre[1]) as f64); (r(end)-r(case.start)).abs() > 20.0 })
                {
                    continue;
                }
                if motions.iter().any(is_arc) {
                    arcs_made += 1;
                    if motions.len() == 1 {
                        exact += 1;
                    }
                } else if motions.iter().any(is_helix) {
                    helices += 1;
                    pieces += motions.len();
                    hist[motions.len().min(9)] += 1;
                } else {
                    chords += 1
                }
            }
            eprintln!(
                "{name}: y {arcs_made} ({exact} exact) w {helices} ({pieces} motions {hist:?}) chords {chords}"
            );
        }
    }
}
