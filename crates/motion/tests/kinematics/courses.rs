//! Speeds along the real way.

use proptest::prelude::*;
use vimc4_motion::{AXES, Path, Profile, Segment, StraightLine, Stretch, chord};

use crate::{cases, point};

const MILLISECOND: u64 = 1_000_000;

/// 1/3,200 inch, pm.
const SCALE: u64 = 7_937_500;

/// 1,000 mm/s².
const ACCELERATION: u64 = 1_000_000_000;

/// 10,000 steps of 7,937.5 nm at 50 mm/s.
fn reference() -> Profile {
    let stretch = Stretch { steps: 10_000, length: 10_000 * SCALE };
    Profile::trapezoid([stretch], 50_000_000, ACCELERATION)
}

/// At 1,000 mm/s² the speed of 50 mm/s takes 50 ms and 1.25 mm, twice. Of the 79.375 mm 76.875
/// are left, which take 1,537.5 ms: together 1,637.5 ms.
#[test]
fn the_reference_move() {
    let profile = reference();
    assert_eq!((profile.steps(), profile.duration()), (10_000, 1_637_500_000));
    // 1.25 mm are 157.48 steps; 157 of them are 1.2461875 mm: √(2·1.2461875 mm/1,000 mm/s²) is
    // 49.92369177862… ms.
    assert_eq!(profile.steps_at(50 * MILLISECOND), 157);
    assert_eq!(profile.time_of(157), 49_923_692);
    assert_eq!(profile.time_of(10_000 - 157), 1_637_500_000 - 49_923_691);
    // Step 158 is 1.254125 mm from the start: 4.125 µm at 50 mm/s later, 82.5 µs.
    assert_eq!(profile.time_of(158), 50_082_500);
    // In the middle a step takes 158.75 µs.
    assert_eq!(profile.time_of(5_001) - profile.time_of(5_000), 158_750);
    assert_eq!(profile.speed_at(800 * MILLISECOND), 6_299_212_598);
    assert_eq!(profile.speed_at(25 * MILLISECOND), 3_149_606_299);
    assert_eq!((profile.speed_at(0), profile.speed_at(1_637_500_000)), (0, 0));
    // Steps that lie evenly do so over any of them.
    for steps in [0..10_000, 0..u64::MAX, 5_000..5_200] {
        assert_eq!(profile.even_speed_at(800 * MILLISECOND, steps), 6_299_212_598);
    }
    assert_eq!(profile.even_speed_at(800 * MILLISECOND, 300..300), 0);
    assert_eq!(profile.even_speed_at(1_637_500_000, 0..10_000), 0);
    all_forms_agree(&profile);
}

#[test]
fn the_reference_move_braked() {
    let profile = reference();
    // At 25 ms it runs at 25 mm/s after 0.3125 mm, and needs as much again: 78.7 steps.
    let braked = profile.brake(25 * MILLISECOND).unwrap();
    assert_eq!(braked.steps(), 78);
    // Step 78 is 5.875 µm before standstill, which is √(2·5.875 µm/1,000 mm/s²), 3.428 ms,
    // before 50 ms.
    assert!(braked.duration().abs_diff(50 * MILLISECOND - 3_427_827) < 100);
    all_forms_agree(&braked);
    assert_eq!(braked.brake(0), None);
    // From the top 1.25 mm more.
    let braked = profile.brake(800 * MILLISECOND).unwrap();
    assert_eq!(braked.steps(), (750 * 50_000 + 2_500_000) * 1_000 / SCALE);
    all_forms_agree(&braked);
    // Where it brakes by itself there is nothing to do.
    for at in [1_587_500_000, 1_600_000_000, 1_637_499_999, 1_637_500_000, u64::MAX] {
        assert_eq!(profile.brake(at), None, "{at}");
    }
    assert_eq!(profile.brake(1_587_000_000).map(|braked| braked.steps()), Some(9_996));
    let at_once = profile.brake(0).unwrap();
    assert_eq!((at_once.steps(), at_once.duration(), at_once.times().count()), (0, 0, 0));
}

/// A short way is a triangle: 4 mm take 2·√(4 mm/1,000 mm/s²), each half rounded up.
#[test]
fn the_triangle() {
    let stretch = Stretch { steps: 400, length: 4_000_000_000 };
    let profile = Profile::trapezoid([stretch], 1_000_000_000, ACCELERATION);
    assert_eq!(profile.duration(), 2 * 63_245_554);
    // The middle, 2 mm, is at half the time.
    assert_eq!(profile.time_of(200), 63_245_554);
    all_forms_agree(&profile);
}

/// Where it is divided makes no difference to the motion.
#[test]
fn several_stretches_are_one_way() {
    let stretch = Stretch { steps: 2_500, length: 2_500 * SCALE };
    let nothing = Stretch { steps: 0, length: 77 };
    let divided =
        Profile::trapezoid([stretch, nothing, stretch, stretch, stretch], 50_000_000, ACCELERATION);
    assert!(divided.times().eq(reference().times()));
    // Steps that are half as long come twice as often.
    let coarse = Stretch { steps: 100, length: 2_000_000_000 };
    let fine = Stretch { steps: 200, ..coarse };
    let profile = Profile::trapezoid([coarse, fine], 10_000_000, ACCELERATION);
    assert_eq!(profile.time_of(51) - profile.time_of(50), 2 * MILLISECOND);
    assert_eq!(profile.time_of(201) - profile.time_of(200), MILLISECOND);
    assert_eq!(profile.speed_at(profile.time_of(50)), 500_000_000);
    assert_eq!(profile.speed_at(profile.time_of(200)), 1_000_000_000);
    all_forms_agree(&profile);
}

/// 1 mm up to 10 mm/s in 0.2 s, 2 mm in 0.2 s, 1 mm down in 0.2 s.
#[test]
fn vectors() {
    let [short, long] = [1, 2].map(|mm| Stretch { steps: 100 * mm, length: 1_000_000_000 * mm });
    let speeds = [10_000_000, 10_000_000, 0];
    let profile = following(0, &[short, long, short], &speeds, ACCELERATION).unwrap();
    assert_eq!((profile.steps(), profile.duration()), (400, 600 * MILLISECOND));
    assert_eq!(
        (profile.time_of(100), profile.time_of(300)),
        (200 * MILLISECOND, 400 * MILLISECOND)
    );
    assert_eq!(profile.time_of(25), 100 * MILLISECOND);
    all_forms_agree(&profile);
    // Braked at 1,000 mm/s² from 10 mm/s: 50 µm, five steps.
    let braked = profile.brake(300 * MILLISECOND).unwrap();
    assert_eq!(braked.steps(), 205);
    all_forms_agree(&braked);
    // The same, begun when it had its speed.
    let rest = following(10_000_000, &[long, short], &speeds[1..], ACCELERATION).unwrap();
    assert!(rest.times().eq(profile.times().skip(100).map(|time| time - 200 * MILLISECOND)));
    // It need not end at standstill.
    let open = following(0, &[short, long], &speeds[..2], ACCELERATION).unwrap();
    assert!(open.times().eq(profile.times().take(300)));
}

/// With a speed that hardly changes V takes so many values that a rounding of one in any root
/// shows.
#[test]
fn gentle_changes() {
    for speed in 1..=6 {
        let stretch = Stretch { steps: 3_000, length: 3_000 * SCALE + speed };
        for speeds in [[speed + 1, speed], [speed, speed + 1]] {
            all_forms_agree(&following(speed, &[stretch; 2], &speeds, 1).unwrap());
        }
    }
}

#[test]
fn vectors_that_cannot_be() {
    let stretch = Stretch { steps: 10, length: 10 };
    let nothing = Stretch { steps: 0, length: 10 };
    let at_once = |stretches: &[Stretch], speeds: &[u64]| following(0, stretches, speeds, 1);
    assert_eq!(at_once(&[stretch], &[0]), None);
    assert_eq!(at_once(&[stretch, stretch, stretch], &[5, 0, 0]), None);
    assert_eq!(at_once(&[stretch], &[]), None);
    assert_eq!(at_once(&[stretch], &[1, 1]), None);
    // Nothing to do is done at once.
    for none in [at_once(&[], &[]), at_once(&[nothing, nothing], &[0, 5])] {
        let profile = none.unwrap();
        assert_eq!((profile.steps(), profile.duration(), profile.times().next()), (0, 0, None));
        assert_eq!((profile.steps_at(9), profile.speed_at(0), profile.brake(0)), (0, 0, None));
    }
    assert_eq!(at_once(&[nothing, stretch], &[7, 0]), None);
}

#[test]
fn chords() {
    assert_eq!(chord(&point([3, 0, -4]), &[SCALE; AXES]), 5 * SCALE);
    assert_eq!(chord(&point([1, 1]), &[1_000_000; AXES]), 1_414_213);
    assert_eq!(chord(&point([2, 0, 3]), &[6, 9, 3, 1, 1, 1]), 15);
    assert_eq!(chord(&[0; AXES], &[u64::MAX; AXES]), 0);
    assert_eq!(chord(&[i64::MIN; AXES], &[u64::MAX; AXES]), u64::MAX);
    // The longest way of six axes: 2³¹ steps of a millimetre each.
    let longest = (6 * (1u128 << 62) * 10u128.pow(18)).isqrt() as u64;
    assert_eq!(chord(&[1 << 31; AXES], &[1_000_000_000; AXES]), longest);
    let stretch = Stretch::line(&point([-30, 40]), &[100; AXES]);
    assert_eq!(stretch, Stretch { steps: 40, length: 5_000 });
}

/// The largest and smallest of everything: nothing overflows, nothing is left out.
#[test]
fn extremes() {
    let steps = [1, 3, 1 << 31, u64::MAX];
    let lengths = [0, 1, 1 << 44, (1 << 31) * 1_000_000_000, u64::MAX];
    let rates = [0, 1, 999, 10_000_000_000, u64::MAX];
    for (&steps, &length) in steps.iter().flat_map(|s| lengths.iter().map(move |l| (s, l))) {
        let stretch = Stretch { steps, length };
        for (&speed, &rate) in rates.iter().flat_map(|s| rates.iter().map(move |r| (s, r))) {
            check_extreme(&Profile::trapezoid([stretch; 3], speed, rate), 3 * steps.min(1 << 40));
            for other in rates {
                let speeds = [speed, other.max(1), speed];
                let profile = following(other, &[stretch; 3], &speeds, rate);
                if let Some(profile) = profile {
                    check_extreme(&profile, 3 * steps.min(1 << 40));
                }
            }
        }
    }
}

fn check_extreme(profile: &Profile, steps: u64) {
    assert_eq!(profile.steps(), steps);
    let end = profile.duration();
    for k in [1, 2, steps / 2, steps - 1, steps] {
        let time = profile.time_of(k);
        assert!(time <= end);
        if time < u64::MAX {
            // Several steps may fall in one nanosecond.
            assert!(profile.steps_at(time) >= k);
            assert!(k == 0 || time == 0 || profile.steps_at(time - 1) < k);
        }
    }
    assert!(profile.times().take(20).eq((1..=steps.min(20)).map(|k| profile.time_of(k))));
    for nanos in [0, 1, 1_000, end / 2, end - end / 1_000, end, u64::MAX] {
        let k = profile.steps_at(nanos);
        let _ = (profile.speed_at(nanos), profile.even_speed_at(nanos, 0..k));
        if let Some(braked) = profile.brake(nanos) {
            assert!(braked.steps() >= k && braked.steps() < steps);
            assert_eq!(braked.time_of(k), profile.time_of(k));
            assert!(braked.steps_at(u64::MAX) >= k);
        }
    }
}

#[test]
fn what_is_written_is_read_again() {
    let stretch = Stretch { steps: 100, length: 1_000_000_000 };
    let vectors = following(0, &[stretch; 2], &[5_000_000, 0], ACCELERATION).unwrap();
    let braked = reference().brake(25 * MILLISECOND).unwrap();
    for profile in [reference(), braked, vectors] {
        let segment = Segment { path: Path::Line(StraightLine::new(point([100]))), profile };
        let written = serde_json::to_string(&segment).unwrap();
        assert_eq!(serde_json::from_str::<Segment>(&written).unwrap(), segment);
    }
    // What cannot have been written is refused.
    let written = serde_json::to_string(&following(0, &[stretch], &[7], 1)).unwrap();
    let wrong = written.replace("[7]", "[0]");
    assert_ne!(wrong, written);
    let refused = serde_json::from_str::<Profile>(&wrong).unwrap_err();
    assert!(refused.to_string().contains("nothing moves"), "{refused}");
}

/// Holds all forms of a profile against each other, at every step.
pub(crate) fn all_forms_agree(profile: &Profile) {
    let (mut previous, mut count) = (0, 0);
    for (k, time) in (1..).zip(profile.times()) {
        assert_eq!(profile.time_of(k), time, "step {k}");
        assert!(time > previous, "step {k}");
        assert_eq!(profile.steps_at(time), k);
        assert_eq!(profile.steps_at(time - 1), k - 1);
        (previous, count) = (time, k);
    }
    assert_eq!((profile.steps(), profile.duration()), (count, previous));
    assert_eq!((profile.steps_at(u64::MAX), profile.speed_at(previous)), (count, 0));
    assert_eq!((profile.time_of(0), profile.time_of(count + 9)), (0, previous));
}

/// A stretch of steps between 0.05 µm and 50 µm.
fn stretches() -> impl Strategy<Value = Stretch> {
    let steps = prop_oneof![0..4u64, 0..700u64];
    (steps, prop_oneof![50_000..=400_000u64, 2_000_000..=50_000_000u64], 0..1_000u64)
        .prop_map(|(steps, step, more)| Stretch { steps, length: steps * step + more })
}

/// Up to 40 mm/s, less than a step in a nanosecond.
fn speeds() -> impl Strategy<Value = u64> {
    prop_oneof![1..100u64, 1..100_000u64, 1..40_000_000u64]
}

fn accelerations() -> impl Strategy<Value = u64> {
    prop_oneof![1..100_000u64, 1_000_000..10_000_000_000u64]
}

pub(crate) fn profiles() -> impl Strategy<Value = Profile> {
    let trapezoids = (prop::collection::vec(stretches(), 0..5), speeds(), accelerations())
        .prop_map(|(stretches, speed, rate)| Profile::trapezoid(stretches, speed, rate));
    let links = prop::collection::vec((stretches(), speeds()), 0..6);
    let vectors = (prop_oneof![Just(0), speeds()], links, accelerations(), any::<bool>())
        .prop_filter_map("nothing moves", |(from, links, braking, halts)| {
            let (stretches, mut speeds): (Vec<_>, Vec<_>) = links.into_iter().unzip();
            // The last one down to standstill, if it begins with a speed.
            if let Some(last) = speeds.last_mut()
                && halts
                && stretches.iter().filter(|stretch| stretch.steps > 0).count() > 1
                && stretches[stretches.len() - 1].steps > 0
            {
                *last = 0;
            }
            following(from, &stretches, &speeds, braking)
        });
    prop_oneof![trapezoids, vectors]
}

proptest! {
    #![proptest_config(cases(2_000))]

    #[test]
    fn stepwise_and_closed_form(profile in profiles(), braked_at in 0.0..1.3f64) {
        all_forms_agree(&profile);
        let at = (profile.duration() as f64 * braked_at) as u64;
        if let Some(braked) = profile.brake(at) {
            all_forms_agree(&braked);
            prop_assert!(braked.steps() < profile.steps());
            // What was made keeps its times.
            let made = profile.steps_at(at);
            prop_assert!(made <= braked.steps());
            prop_assert!(profile.times().take(made as usize).eq(braked.times().take(made as usize)));
            prop_assert_eq!(braked.steps_at(at), made);
            prop_assert_eq!(braked.brake(at / 2), None);
        }
    }

    /// The way to the halt is v²/2a, and braking where the motion brakes changes nothing.
    #[test]
    fn braking_ways(
        steps in 1..100_000u64,
        speed in speeds(),
        rate in accelerations(),
        at in 0.0..1.0f64,
    ) {
        let stretch = Stretch { steps, length: steps * SCALE };
        let profile = Profile::trapezoid([stretch], speed, rate);
        let at = (profile.duration() as f64 * at) as u64;
        let way = |k: u64| k as f64 * SCALE as f64 / 1e3;
        // The speed at that time in nm/s, from the definition of the trapezoid.
        let top = (speed as f64).min((rate as f64 * way(steps)).sqrt());
        let left = profile.duration() - at;
        let now = top.min(rate as f64 * at as f64 / 1e9).min(rate as f64 * left as f64 / 1e9);
        match profile.brake(at) {
            Some(braked) => {
                let further = way(braked.steps() - profile.steps_at(at));
                let allowed = now * now / (2.0 * rate as f64);
                prop_assert!(further <= allowed + way(1) + 0.1, "{further} of {allowed}");
                prop_assert!(further >= allowed - way(1) - 0.1, "{further} of {allowed}");
                let seconds = (braked.duration().saturating_sub(at)) as f64 / 1e9;
                prop_assert!(seconds <= now / rate as f64 * 1.01 + 1e-3);
            }
            None => {
                let remaining = way(steps - profile.steps_at(at));
                let allowed = now * now / (2.0 * rate as f64);
                prop_assert!(remaining <= allowed + way(1) + 0.1, "{remaining} of {allowed}");
            }
        }
    }

    /// The durations are those of the formulas.
    #[test]
    fn durations(steps in 1..1u64 << 31, speed in speeds(), rate in accelerations()) {
        let stretch = Stretch { steps, length: steps * SCALE };
        let profile = Profile::trapezoid([stretch], speed, rate);
        let (way, v, a) = ((steps * SCALE) as f64 / 1e3, speed as f64, rate as f64);
        let expected =
            if way >= v * v / a { way / v + v / a } else { 2.0 * (way / a).sqrt() } * 1e9;
        // What takes longer than 584 years never ends.
        let (duration, expected) = (profile.duration() as f64, expected.min(u64::MAX as f64));
        prop_assert!((duration - expected).abs() <= 1e-6 * expected + 5.0, "{duration} {expected}");
    }

    /// Braking where it brakes by itself never takes a step away.
    #[test]
    fn falling_ramps_are_left_alone(
        steps in 1..3_000u64,
        speed in speeds(),
        rate in accelerations(),
        at in 0.0..1.0f64,
    ) {
        let stretch = Stretch { steps, length: steps * SCALE };
        let profile = Profile::trapezoid([stretch], speed, rate);
        let (way, v, a) = ((steps * SCALE) as f64 / 1e3, speed as f64, rate as f64);
        let ramp = (v / a).min((way / a).sqrt()) * 1e9;
        let before = (ramp * at * 0.999_999) as u64;
        prop_assert_eq!(profile.brake(profile.duration() - before), None);
    }
}

/// A speed at the end of each stretch.
fn following(from: u64, stretches: &[Stretch], speeds: &[u64], braking: u64) -> Option<Profile> {
    let speeds: Vec<Option<u64>> = speeds.iter().copied().map(Some).collect();
    Profile::vectors(from, stretches, &speeds, braking)
}

/// Stretches of one vector differ in how long a step is, and in nothing else.
#[test]
fn a_change_goes_on_through_stretches_without_a_speed() {
    let whole = [Stretch { steps: 400, length: 4_000_000_000 }];
    let parts = [(100, 1_000_000_000), (50, 500_000_000), (250, 2_500_000_000)];
    let parts = parts.map(|(steps, length)| Stretch { steps, length });
    let one = Profile::vectors(3_000_000, &whole, &[Some(9_000_000)], ACCELERATION).unwrap();
    let speeds = [None, None, Some(9_000_000)];
    let cut = Profile::vectors(3_000_000, &parts, &speeds, ACCELERATION).unwrap();
    assert!(cut.times().eq(one.times()));
    all_forms_agree(&cut);
    let open = Profile::vectors(3_000_000, &parts, &[Some(1), Some(1), None], ACCELERATION);
    assert_eq!(open, None);
}
