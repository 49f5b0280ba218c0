//! Arcs and helices.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use vimc4_isel_wire::{ArcArgs, Plane};
use vimc4_motion::Turn;

use super::super::{Circle, Curve, CurveParameters, Fitted, MOST_STEPS, Motion, Scale, Speeds};
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
            Value::ZERO,
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
            let square: f64 =
                (0..3).map(|axis| by[axis] / self.steps[axis]).map(|way| way * way).sum();
            libm::sqrt(square)
        };
        let rise = self.rise.1 - self.rise.0;
        let from_curve = |angle: f64| {
            let angle = angle.clamp(0.0, self.sweep);
            let (sine, cosine) = libm::sincos(self.from + self.sign * angle);
            off(
                self.centre[0] + self.radius * cosine,
                self.centre[1] + self.radius * sine,
                self.rise.0 + rise * angle / self.sweep.max(f64::MIN_POSITIVE),
            )
        };
        let seen = libm::atan2(world[1] - self.centre[1], world[0] - self.centre[0]);
        let ahead = self.sign * (seen - self.from);
        let ahead = ahead - TAU * libm::floor(ahead / TAU);
        let window = (12.0 * self.steps[0].max(self.steps[1]) / self.radius).min(PI);
        let mut least = off(self.end[0], self.end[1], self.rise.1);
        let around = [ahead, ahead - TAU, ahead + TAU];
        // Mostly a guess is good enough: by the plane, by the third axis, or half-way.
        let third = if rise == 0.0 { ahead } else { (world[2] - self.rise.0) / rise * self.sweep };
        for angle in around {
            for guess in [angle, third, f64::midpoint(angle, third)] {
                least = least.min(from_curve(guess));
            }
        }
        if least <= 2.0 {
            return least;
        }
        for part in [window / 6.0, window] {
            for angle in around {
                let low = (angle - part).clamp(0.0, self.sweep);
                let high = (angle + part).clamp(0.0, self.sweep);
                least = least.min(lowest(from_curve, low, high));
                if least <= 2.0 {
                    return least;
                }
            }
        }
        least
    }
}

/// The lowest value of a function, which may have several hollows.
fn lowest(value: impl Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    let part = (high - low) / 100.0;
    let at = |index: i32| low + part * f64::from(index);
    let nearest = (0..=100).map(at).min_by(|a, b| value(*a).total_cmp(&value(*b))).unwrap();
    let (mut low, mut high) = ((nearest - part).max(low), (nearest + part).min(high));
    for _ in 0..30 {
        let third = (high - low) / 3.0;
        if value(low + third) < value(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    value(low)
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
            let radius = if whole { libm::round(radius) } else { radius };
            let step = scale.step();
            let (steps, beside) = centre;
            let centre = [0, 1].map(|axis: usize| {
                libm::round(steps[axis] as f64 * step) as i64 + beside[axis] % step as i64
            });
            let at = |angle: f64, radius: f64| {
                let out = radius * step;
                let (sine, cosine) = libm::sincos(angle);
                [
                    centre[0] + libm::round(out * cosine) as i64,
                    centre[1] + libm::round(out * sine) as i64,
                ]
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
    prop_oneof![1.0..12.0f64, (0.0..libm::log(most)).prop_map(libm::exp)]
}

fn is_arc(motion: &Motion) -> bool {
    matches!(motion, Motion::Arc(..))
}

fn is_helix(motion: &Motion) -> bool {
    matches!(motion, Motion::Helix(..))
}

proptest! {
    #![proptest_config(cases(1_000))]

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
            Value::ZERO,
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
        rise in prop_oneof![
            -30_000..=30_000i64,
            -2_000_000..=2_000_000i64,
            -40_000_000..=40_000_000i64,
        ],
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
    fn so_do_large_ones(
        case in arcs(5_000.0..100_000.0f64),
        rise in -20_000_000..=20_000_000i64,
        helix: bool,
    ) {
        let mut case = case;
        if helix {
            case.rise = Some((0, rise));
            case.has_helix = true;
        }
        case.check()?;
    }
}

/// A counterclockwise arc about the origin in XY with 80 steps a mm, its places in thousandths of
/// a µm.
fn usual(start: [i64; 2], end: Option<[i64; 2]>) -> Case {
    Case {
        plane: Plane::Xy,
        turn: Turn::Counterclockwise,
        scales: [USUAL; 4],
        centre: [0, 0],
        start,
        end,
        rise: None,
        has_helix: true,
    }
}

/// So many steps in thousandths of a µm.
fn steps(steps: i64) -> i64 {
    steps * USUAL.per / USUAL.steps
}

fn motions(parameters: CurveParameters) -> Vec<Motion> {
    Curve::new(parameters).collect()
}

#[test]
fn the_circles_of_the_manual() {
    // Radius 200, from 135 to 225 degrees; then a half circle.
    let diagonal = 1_767_767;
    let cases = [
        (
            usual([-diagonal, diagonal], Some([-diagonal, -diagonal])),
            ArcArgs { steps: 400, speed: 2_546, d: 119, x: -141, y: 141, rx: -1, ry: -1 },
        ),
        (
            usual([steps(400), 0], Some([steps(-400), 0])),
            ArcArgs { steps: 1_600, speed: 2_546, d: -200, x: 400, y: 0, rx: -1, ry: 1 },
        ),
    ];
    for (case, expected) in cases {
        // 25 mm/s are 2,000 steps a second, of which a circle has 4/π a step of its length.
        assert_eq!(motions(case.parameters()), [Motion::Arc(Plane::Xy, expected)]);
    }
}

#[test]
fn a_circle_in_whole_steps_is_always_one_command() {
    for radius in (2..40).chain([977, 20_000, 1_000_000]) {
        for turn in TURNS {
            for plane in PLANES {
                for start in [[radius, 0], [0, radius], [-radius, 0], [0, -radius]] {
                    let case = Case { turn, plane, ..usual(start.map(steps), None) };
                    let [Motion::Arc(made, args)] = motions(case.parameters())[..] else {
                        panic!("{case:?}")
                    };
                    assert_eq!((made, i64::from(args.steps)), (plane, 8 * radius));
                }
            }
        }
    }
}

#[test]
fn hardly_any_arc_needs_chords() {
    let mut runner = TestRunner::deterministic();
    let (mut all, mut chords, mut alone) = (0, 0, 0);
    for _ in 0..4_000 {
        let Ok(tree) = arcs(20.0..10_000.0f64).new_tree(&mut runner) else { continue };
        let case = tree.current();
        let out = |place: [i64; 2]| {
            libm::hypot((place[0] - case.centre[0]) as f64, (place[1] - case.centre[1]) as f64)
        };
        // Ends beside the arc by more than a µm are none that a program writes.
        if case.end.is_some_and(|end| (out(end) - out(case.start)).abs() > 1_000.0) {
            continue;
        }
        let motions = motions(case.parameters());
        all += 1;
        chords += u32::from(motions.len() > 2);
        alone += u32::from(motions.len() == 1);
    }
    assert!(all > 2_000, "{all}");
    assert!(chords * 500 < all, "{chords} of {all}");
    assert!(alone * 4 > all * 3, "{alone} of {all}");
}

#[test]
fn an_end_beside_the_start_is_next_to_nothing_or_a_turn() {
    let start = [steps(1_000) + 4_000, 3_000];
    for (y, whole) in [(3_001, false), (2_999, true), (9_999, false), (-9_999, true)] {
        let motions = usual(start, Some([start[0], y])).check().unwrap();
        let made: u32 = motions
            .iter()
            .map(|motion| match motion {
                Motion::Arc(_, args) => args.steps,
                _ => 0,
            })
            .sum();
        assert!(made <= 1 && !whole || (7_990..=8_010).contains(&made) && whole, "{motions:?}");
        assert!(whole || motions.len() <= 1, "{motions:?}");
    }
}

/// Rounded, the end is to the right of the start, which is behind it: nearly a turn away.
#[test]
fn rounding_makes_no_turn_of_next_to_nothing() {
    let start = [steps(100) + 5_000, 7_500];
    let motions = usual(start, Some([start[0] + 2_500, 7_625])).check().unwrap();
    assert_eq!(motions.len(), 1, "{motions:?}");
    assert_eq!(motions[0].path().length(), 1);
}

#[test]
fn what_no_command_holds_goes_on_with_the_registers() {
    let radius = 2_000_000;
    let case = usual([steps(radius), 0], None);
    let motions = motions(case.parameters());
    let [Motion::Arc(_, first), Motion::Arc(_, second)] = motions[..] else {
        panic!("{motions:?}")
    };
    assert_eq!(i64::from(first.steps), MOST_STEPS);
    assert_eq!(i64::from(second.steps), 8 * radius - MOST_STEPS);
    let end = motions[0].path().at(u64::MAX);
    assert_eq!(i64::from(second.x), radius + end[0]);
    assert_eq!(i64::from(second.y), end[1]);
    let there = motions[1].path().at(u64::MAX);
    assert_eq!([end[0] + there[0], end[1] + there[1]], [0, 0]);

    // A centre that is too far away for a parameter.
    let (start, end) = ([steps(9_000_000), 0], [steps(9_000_000) - 2_000_000, 670_817_412]);
    let case = usual(start, Some(end));
    let motions = case.check().unwrap();
    assert!(!motions.iter().any(is_arc) && (5..20).contains(&motions.len()), "{}", motions.len());
}

#[test]
fn the_speed_is_that_of_the_path() {
    let case = usual([steps(800), 0], Some([0, steps(800)]));
    let parameters = case.parameters();
    let speed = |parameters: CurveParameters| {
        let curve = Curve::new(parameters);
        (curve.fitted(), curve.map(|motion| motion.speed()).max().unwrap())
    };
    // 1,600 steps in the time of π/2 · 10 mm at 25 mm/s.
    assert_eq!(speed(parameters), (Fitted::AsAsked, 2_546));
    let slower = CurveParameters { velocity: 100_000.0, ..parameters };
    assert_eq!(speed(slower), (Fitted::Raised, 20));
    let slow = Speeds { highest: 2_000, ..SPEEDS };
    assert_eq!(speed(CurveParameters { speeds: slow, ..parameters }), (Fitted::Capped, 2_000));

    // An arc of 2 µm that rounding makes one step is no faster than a step is.
    let centre = [steps(-800), 0];
    let short = Case { centre, end: Some([0, 7_000]), ..usual([0, 5_000], None) };
    assert_eq!(speed(short.parameters()), (Fitted::AsAsked, 2_828));

    // A helix is longer, so the same steps take more time: 0.75 mm up beside 15.7 mm.
    let helix = Case { rise: Some((0, steps(60))), ..case.clone() };
    let [Motion::Helix(_, args, _), ..] = motions(helix.parameters())[..] else { panic!() };
    assert_eq!(args.speed, 2_544);

    // Chords: the longest step frequency is that along an axis.
    let mut uneven = case;
    uneven.scales[1] = Scale { steps: 40, per: 1_000_000 };
    let parameters = uneven.parameters();
    assert_eq!(speed(parameters).0, Fitted::AsAsked);
    // The last chords are nearly along X, with 80 steps a mm.
    assert_eq!(speed(CurveParameters { speeds: slow, ..parameters }), (Fitted::AsAsked, 2_000));
}

#[test]
fn chords_are_as_few_as_half_a_step_allows() {
    for radius in [3, 50, 1_000, 33_333] {
        let mut case = usual([steps(radius), 0], Some([0, steps(radius)]));
        case.scales[1] = Scale { steps: 40, per: 1_000_000 };
        let number = motions(case.parameters()).len() as f64;
        let sagitta = |chords: f64| radius as f64 * (1.0 - libm::cos(FRAC_PI_2 / 2.0 / chords));
        assert!(sagitta(number) <= 0.5, "{number} for {radius}");
        assert!(number == 1.0 || sagitta(number - 1.0) > 0.5, "{number} for {radius}");
    }
}

/// A whole turn with so many steps of Z.
fn helix(radius: i64, rise: i64) -> Case {
    Case { rise: Some((0, steps(rise))), ..usual([steps(radius), 0], None) }
}

#[test]
fn a_helix_is_divided_the_more_the_steeper_it_is() {
    let radius = 2_000;
    let pieces = |rise| {
        let motions = helix(radius, rise).check().unwrap();
        let rises: i64 = motions
            .iter()
            .map(|motion| match motion {
                Motion::Helix(_, args, third) => {
                    assert!(i64::from(*third) <= i64::from(args.steps));
                    i64::from(*third)
                }
                other => panic!("{other:?}"),
            })
            .sum();
        assert_eq!(rises, rise);
        motions.len()
    };
    // Half a step is 0.066 radians of 47 steps a turn, and 0.042 of 74.
    assert_eq!([1, 47, 48, 74, 75].map(pieces), [1, 1, 4, 4, 9]);
    assert!(pieces(400) < 30);
    // Steeper than it is wide: chords are fewer.
    let steep = helix(radius, 40_000).check().unwrap();
    assert!(!steep.iter().any(is_helix) && steep.len() < 150, "{}", steep.len());
    // Without the command there are chords, or arcs and the third axis in turn where it climbs
    // little.
    let without = |rise| Case { has_helix: false, ..helix(radius, rise) }.check().unwrap();
    let chords = without(400);
    assert!(chords.len() < 100 && !chords.iter().any(is_helix), "{}", chords.len());
    assert!(chords.iter().all(|motion| matches!(motion, Motion::Line { .. })));
    let stairs = without(20);
    assert!(stairs.len() <= 21 && stairs.iter().any(is_arc), "{}", stairs.len());
}

#[test]
fn the_third_axis_sets_the_clock_where_it_has_more_steps() {
    let mut case = usual([steps(5), 0], Some([steps(4), steps(3)]));
    case.rise = Some((0, steps(5)));
    let motions = case.check().unwrap();
    let [Motion::Helix(_, args, 5)] = motions[..] else { panic!("{motions:?}") };
    // 5 steps in the time that 5.947 steps of the way take at 2,000 Hz.
    assert_eq!((args.steps, args.speed), (4, 1_682));
}

#[test]
fn a_helix_that_does_not_rise_is_an_arc() {
    let motions = helix(500, 0).check().unwrap();
    assert!(motions.len() == 1 && is_arc(&motions[0]));
}

/// Where centre and radius are whole, the third axis is off by half a step because the engine is
/// uneven, by half a step for the ends of a piece, by half a step for rounding, and by what the
/// place in the plane is off.
#[test]
fn the_third_axis_keeps_to_the_angle() {
    for rise in [40, 70, 300, 1_000] {
        let radius = 3_000;
        let slope = rise as f64 / TAU;
        let mut at = [0.0; 3];
        let mut worst: f64 = 0.0;
        for motion in motions(helix(radius, rise).parameters()) {
            for way in motion.path().steps() {
                let x = radius as f64 + at[0] + way[0] as f64;
                let angle = libm::atan2(at[1] + way[1] as f64, x);
                let turned = if angle < 0.0 { angle + TAU } else { angle };
                worst = worst.max((at[2] + way[2] as f64 - slope * turned).abs());
                if turned < 0.01 {
                    worst = 0.0;
                }
            }
            let by = motion.path().at(u64::MAX);
            at = [0, 1, 2].map(|axis: usize| at[axis] + by[axis] as f64);
        }
        assert!(worst < 1.5 + slope / radius as f64, "{worst} for {rise}");
    }
}
