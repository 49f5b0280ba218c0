//! The times of steps.

use proptest::prelude::*;
use vimc4_motion::{Profile, Ramp};

use crate::cases;
use crate::courses::all_forms_agree;

const MILLISECOND: u64 = 1_000_000;

/// The defaults of the controllers.
const RAMP: Ramp = Ramp { start_stop: 300, acceleration: 100 };

/// `@0A5000,10000`
fn reference() -> Profile {
    Profile::new(5_000, 10_000, RAMP)
}

#[test]
fn the_reference_move() {
    let profile = reference();
    assert_eq!((profile.steps(), profile.duration()), (5_000, 594_090_000));
    // The ramp is 499.55 steps in 97 ms.
    assert_eq!(profile.speed_at(97 * MILLISECOND - 1), 9_999_999_900);
    assert_eq!(profile.speed_at(97 * MILLISECOND), 10_000_000_000);
    assert_eq!(profile.steps_at(97 * MILLISECOND), 499);
    // 0.45 steps at 10 kHz later comes step 500, and then one every 100 µs.
    assert_eq!(profile.time_of(500), 97_045_000);
    assert_eq!(profile.time_of(4_500), 497_045_000);
    // In the mirror: 4,500.45 steps after 497.09 ms.
    assert_eq!(profile.speed_at(497_090_000), 10_000_000_000);
    assert_eq!(profile.speed_at(497_090_001), 9_999_999_900);
    assert_eq!(profile.speed_at(544_090_000), 5_300_000_000);
    assert_eq!(profile.speed_at(594_089_999), 300_000_100);
    assert_eq!((profile.speed_at(594_090_000), profile.speed_at(u64::MAX)), (0, 0));
    assert_eq!(
        (profile.speed_at(0), profile.speed_at(50 * MILLISECOND)),
        (300 * 1_000_000, 5_300_000_000)
    );
    assert_eq!((profile.steps_at(0), profile.steps_at(594_089_999)), (0, 4_999));
    assert_eq!((profile.steps_at(594_090_000), profile.steps_at(u64::MAX)), (5_000, 5_000));
}

#[test]
fn the_reference_move_braked() {
    let profile = reference();
    // At 50 ms it runs at 5,300 Hz after 140 steps; 140 more are the way to 300 Hz.
    let braked = profile.brake(50 * MILLISECOND).unwrap();
    assert_eq!((braked.steps(), braked.duration()), (280, 100 * MILLISECOND));
    assert_eq!(braked.steps_at(50 * MILLISECOND), 140);
    assert_eq!(braked.speed_at(50 * MILLISECOND), 5_300_000_000);
    assert_eq!(braked.speed_at(75 * MILLISECOND), 2_800_000_000);
    assert_eq!(braked.speed_at(100 * MILLISECOND), 0);

    // At 200 ms it is at 1,529.55 and comes to 2,029.1 in another 97 ms. Step 2,029 is d before
    // the end of that ramp, where 300·d + 50,000·d² = 0.1, d = (√110,000 - 300)/100,000 s,
    // and √110,000 = 331.66247903553998 (times 10⁶: rounded down, as the time is rounded up).
    let braked = profile.brake(200 * MILLISECOND).unwrap();
    let root: u64 = 110_000_000_000_000_000u64.isqrt();
    assert_eq!(root, 331_662_479);
    let before = (root - 300_000_000) / 100;
    assert_eq!((braked.steps(), braked.duration()), (2_029, 297 * MILLISECOND - before));
    assert_eq!(braked.duration(), 296_683_376);

    // It brakes since 497.09 ms.
    assert_eq!(profile.brake(520 * MILLISECOND), None);
    assert_eq!(profile.brake(497_090_000), None);
    assert_eq!(profile.brake(u64::MAX), None);
    let late = profile.brake(497_089_999).unwrap();
    assert_eq!(late.steps(), 4_999);
    // Whoever brakes does not brake again.
    assert_eq!(braked.brake(0), None);
    assert_eq!(braked.brake(210 * MILLISECOND), None);
}

#[test]
fn braking_without_a_ramp_halts_where_it_is() {
    for profile in
        [Profile::new(100, 300, RAMP), Profile::new(100, 20, RAMP), Profile::constant(100, 10_000)]
    {
        for k in [1, 2, 50, 99] {
            let time = profile.time_of(k);
            let before = profile.brake(time - 1).unwrap();
            assert_eq!((before.steps(), before.duration()), (k - 1, profile.time_of(k - 1)));
            let then = profile.brake(time).unwrap();
            assert_eq!((then.steps(), then.duration()), (k, time));
        }
        assert_eq!(profile.brake(profile.duration()), None);
    }
}

/// Where 8 steps are left to brake for the frequency is exactly 1,300 Hz, 10 ms before the end:
/// a step falls on a whole nanosecond, on every kind of falling ramp.
#[test]
fn steps_at_whole_nanoseconds_on_falling_ramps() {
    let triangle = Profile::new(280, 10_000, RAMP);
    let braked = reference().brake(50 * MILLISECOND).unwrap();
    assert!(triangle.times().eq(braked.times()));
    for (profile, step, time) in
        [(triangle, 272, 90_000_000), (braked, 272, 90_000_000), (reference(), 4_992, 584_090_000)]
    {
        assert_eq!(profile.time_of(step), time);
        assert_eq!(profile.speed_at(time), 1_300_000_000);
        all_forms_agree(&profile);
    }
}

/// With small accelerations the frequency takes every whole value of µHz, so that a rounding of
/// one in any root shows.
#[test]
fn gentle_triangles() {
    for acceleration in 1..=3 {
        for steps in 1..=120 {
            for start_stop in [1, 300, 7_001] {
                let profile = Profile::new(steps, 1_000_000, Ramp { start_stop, acceleration });
                all_forms_agree(&profile);
                assert!(
                    profile.speed_at(profile.duration() - 1) >= u64::from(start_stop) * 1_000_000
                );
            }
        }
    }
}

#[test]
fn braking_before_the_first_step() {
    let profile = reference();
    let at_once = profile.brake(0).unwrap();
    assert_eq!((at_once.steps(), at_once.duration(), at_once.times().count()), (0, 0, 0));
    assert_eq!((at_once.steps_at(5), at_once.speed_at(0)), (0, 0));
    // After 2 ms at 500 Hz 0.8 steps are made, and 0.8 more are on the way.
    let braked = profile.brake(2 * MILLISECOND).unwrap();
    assert_eq!((profile.steps_at(2 * MILLISECOND), braked.steps()), (0, 1));
    // Step 1 is 0.2 after that: 500·d - 50,000·d² = 0.2, d = (500 - √210,000)/100,000 s.
    assert_eq!(braked.duration(), 2 * MILLISECOND + (500_000_000 - 458_257_569u64).div_ceil(100));
}

#[test]
fn constant_speed() {
    let profile = Profile::constant(7, 3);
    let times: Vec<u64> = (0..=8).map(|k| profile.time_of(k)).collect();
    let third = 333_333_334;
    let expected =
        [0, third, 666_666_667, 1_000_000_000, 1_333_333_334, 1_666_666_667, 2_000_000_000];
    assert_eq!(times[..7], expected);
    assert_eq!(times[8], times[7]);
    assert!(profile.times().eq((1..=7).map(|k| profile.time_of(k))));
    assert_eq!(profile.speed_at(5), 3_000_000);
    // Up to the start-stop frequency the ramp says nothing.
    let slow = Profile::new(7, 300, RAMP);
    assert!(slow.times().eq(Profile::constant(7, 300).times()));
}

#[test]
fn no_steps() {
    for profile in
        [Profile::new(0, 10_000, RAMP), Profile::new(0, 1, RAMP), Profile::constant(0, 9)]
    {
        assert_eq!((profile.steps(), profile.duration(), profile.steps_at(9)), (0, 0, 0));
        assert_eq!((profile.time_of(3), profile.speed_at(0), profile.brake(0)), (0, 0, None));
        assert_eq!(profile.times().next(), None);
    }
}

#[test]
fn what_is_too_large_is_cut_or_never() {
    let forever = Profile::new(u64::MAX, 1, RAMP);
    assert_eq!((forever.steps(), forever.duration()), (1 << 40, u64::MAX));
    assert_eq!(forever.steps_at(u64::MAX), u64::MAX / 1_000_000_000);
    assert_eq!(forever.brake(u64::MAX).map(|p| p.steps()), Some(u64::MAX / 1_000_000_000));
    let steepest = Ramp { start_stop: 0, acceleration: u32::MAX };
    for speed in [0, 1, u32::MAX] {
        for acceleration in [0, u32::MAX] {
            let profile = Profile::new(u64::MAX, speed, Ramp { acceleration, ..steepest });
            for t in [0, 1, 5_000_000, 1 << 50, 1 << 60, u64::MAX] {
                let k = profile.steps_at(t);
                assert!(profile.time_of(k) <= t && k <= 1 << 40);
                let braked = profile.brake(t);
                assert!(braked.is_none_or(|p| p.time_of(k) <= t && p.steps_at(u64::MAX) >= k));
                let _ = profile.speed_at(t);
            }
            let end = profile.duration();
            assert!(profile.times().take(50).eq((1..=50).map(|k| profile.time_of(k))));
            if end < u64::MAX {
                assert_eq!(profile.steps_at(end - 1), (1 << 40) - 1);
            }
        }
    }
}

/// Speeds and ramps of every magnitude, the usual ones often.
pub(crate) fn speeds_and_ramps() -> impl Strategy<Value = (u32, Ramp)> {
    let speed = prop_oneof![1..=30u32, 20..=2_000u32, 300..=40_000u32, 1..=1_000_000u32];
    let start_stop = prop_oneof![3 => Just(300u32), 1 => 1..=4_000u32, 1 => 1..=1_000_000u32];
    let acceleration = prop_oneof![3 => Just(100u32), 2 => 1..=4_000u32, 1 => 1..=100_000u32];
    (speed, start_stop, acceleration)
        .prop_map(|(speed, start_stop, acceleration)| (speed, Ramp { start_stop, acceleration }))
}

/// Profiles of so many steps.
fn profiles(steps: impl Strategy<Value = u64>) -> impl Strategy<Value = Profile> {
    (steps, speeds_and_ramps()).prop_map(|(steps, (speed, ramp))| Profile::new(steps, speed, ramp))
}

proptest! {
    #![proptest_config(cases(1_000))]

    #[test]
    fn closed_forms_and_definition_agree(profile in profiles(0..1_500u64)) {
        all_forms_agree(&profile);
    }

    #[test]
    fn braked_ones_too(profile in profiles(0..1_500u64), at in 0..1_100u64) {
        if let Some(braked) = profile.brake(profile.duration() / 1_000 * at) {
            all_forms_agree(&braked);
        }
    }

    /// Read backwards a motion takes the same times, but for the rounding of each.
    #[test]
    fn mirror(profile in profiles(1..1_500u64)) {
        let (n, end) = (profile.steps(), profile.duration());
        for k in 1..n {
            let sum = profile.time_of(k) + profile.time_of(n - k);
            prop_assert!(sum == end || sum == end + 1, "step {k}: {sum}, {end}");
        }
    }

    #[test]
    fn braking(profile in profiles(1..30_000u64), at in 0.0..1.02f64) {
        let at = (profile.duration() as f64 * at) as u64;
        let made = profile.steps_at(at);
        let Some(braked) = profile.brake(at) else {
            // It falls, or it is so near the end that braking would not save a step.
            prop_assert!(2 * at >= profile.duration());
            return Ok(());
        };
        // What was made is made; it halts within the rest, and not later.
        prop_assert!((made..profile.steps()).contains(&braked.steps()));
        prop_assert!(braked.duration() <= profile.duration());
        prop_assert_eq!(braked.steps_at(at), made);
        for k in [1, made / 3, made / 2, made.saturating_sub(1), made] {
            prop_assert_eq!(braked.time_of(k.min(made)), profile.time_of(k.min(made)));
        }
        // From then on it slows down: each step takes as long as the one before, or longer.
        let tail: Vec<u64> = (made + 1..=braked.steps()).map(|k| braked.time_of(k)).collect();
        for three in tail.windows(3) {
            prop_assert!(three[2] - three[1] + 1 >= three[1] - three[0]);
        }
        // Later brakes halt later.
        if let Some(later) = profile.brake(at + 1_000) {
            prop_assert!(later.steps() >= braked.steps());
        }
    }

    /// The speed is what the times say: a step lasts as long as between the speeds at its ends.
    #[test]
    fn speeds(profile in profiles(2..3_000u64), braked_at in 0.0..2.0f64) {
        let at = (profile.duration() as f64 * braked_at) as u64;
        let profile = profile.brake(at).unwrap_or(profile);
        let mut before = 0;
        for k in 1..profile.steps() {
            let now = profile.time_of(k);
            let (a, b) = (profile.speed_at(before), profile.speed_at(now));
            let way = u128::from(now - before + 1) * u128::from(a.max(b) + 1);
            // The top may lie between, higher by what a ramp adds within the step.
            let between = profile.speed_at(u64::midpoint(before, now)).max(profile.speed_at(at));
            let high = way.max(u128::from(now - before + 1) * u128::from(2 * between));
            prop_assert!(high >= 1_000_000_000_000_000, "step {k}");
            if now - before > 1 {
                let low = u128::from(now - before - 1) * u128::from(a.min(b));
                prop_assert!(low <= 1_000_000_000_000_000, "step {k}");
            }
            before = now;
        }
    }

    /// Millions of steps: the inverses, sampled.
    #[test]
    fn long_ways(profile in profiles(1..=1u64 << 40), at in 0.0..1.0f64, braked_at in 0.0..2.0f64) {
        let braked = (profile.duration() as f64 * braked_at) as u64;
        let profile = profile.brake(braked).unwrap_or(profile);
        let n = profile.steps();
        for k in [(n as f64 * at) as u64, 1, n / 2, n.saturating_sub(1), n] {
            let time = profile.time_of(k);
            if (1..=n).contains(&k) && time < u64::MAX {
                prop_assert_eq!(profile.steps_at(time), k);
                prop_assert_eq!(profile.steps_at(time - 1), k - 1);
            }
        }
    }
}

/// Steps, speed, start-stop frequency, acceleration, time of braking; steps till the halt, and
/// the time of one of them. Computed by a separate program from the definition: every phase by
/// its integral, from the instants at which it begins, in decimal numbers of 150 digits.
type Row = (u64, u32, u32, u32, Option<u64>, u64, u64, u64);

#[test]
fn a_table_of_exact_times() {
    for row @ (steps, speed, start_stop, acceleration, braked_at, halt, k, time) in TABLE {
        let mut profile = Profile::new(steps, speed, Ramp { start_stop, acceleration });
        if let Some(at) = braked_at {
            profile = profile.brake(at).unwrap();
        }
        assert_eq!(profile.steps(), halt, "{row:?}");
        assert_eq!(profile.time_of(k), time, "{row:?}");
        if k < 5_000 {
            assert_eq!(profile.times().nth(k as usize - 1), Some(time), "{row:?}");
        }
    }
}

#[rustfmt::skip]
const TABLE: [Row; 61] = [
    (1, 376, 300, 4_000, None, 1, 1, 2_663_415),
    (3, 6_761, 20, 100_000, None, 3, 1, 181_513),
    (3, 6_761, 20, 100_000, None, 3, 3, 510_932),
    (3, 66_738, 20, 1, None, 3, 1, 28_989_795),
    (3, 66_738, 20, 1, None, 3, 3, 76_619_038),
    (4, 8_502, 4_000, 100_000, None, 4, 2, 247_159),
    (4, 8_502, 4_000, 100_000, None, 4, 4, 494_317),
    (5, 248, 20, 100, Some(16_584_453), 4, 1, 5_080_323),
    (5, 248, 20, 100, Some(16_584_453), 4, 4, 17_272_559),
    (6, 17_687, 4_000, 100_000, None, 6, 2, 166_036),
    (6, 17_687, 4_000, 100_000, None, 6, 6, 445_149),
    (9, 87, 1, 1_000, None, 9, 1, 11_536_759),
    (9, 87, 1, 1_000, None, 9, 9, 103_533_288),
    (9, 773_153, 4_000, 4_000, Some(442_334), 4, 3, 596_005),
    (9, 773_153, 4_000, 4_000, Some(442_334), 4, 4, 807_332),
    (10, 71_316, 300, 100, Some(2_665_977), 2, 1, 2_385_165),
    (10, 71_316, 300, 100, Some(2_665_977), 2, 2, 4_432_392),
    (46, 5_335, 20, 100_000, Some(2_726_415), 14, 1, 213_917),
    (46, 5_335, 20, 100_000, Some(2_726_415), 14, 10, 1_900_890),
    (46, 5_335, 20, 100_000, Some(2_726_415), 14, 14, 2_650_656),
    (72, 8_126, 4_000, 100, Some(6_737_579), 58, 19, 4_497_191),
    (72, 8_126, 4_000, 100, Some(6_737_579), 58, 36, 8_211_458),
    (72, 8_126, 4_000, 100, Some(6_737_579), 58, 58, 13_365_277),
    (105, 160_189, 300, 1, None, 105, 1, 3_315_018),
    (105, 160_189, 300, 1, None, 105, 105, 283_176_087),
    (266, 162, 300, 4_000, Some(1_251_263_712), 202, 1, 6_172_840),
    (266, 162, 300, 4_000, Some(1_251_263_712), 202, 83, 512_345_680),
    (266, 162, 300, 4_000, Some(1_251_263_712), 202, 202, 1_246_913_581),
    (374, 490_483, 4_000, 7, None, 374, 370, 88_960_317),
    (374, 490_483, 4_000, 7, None, 374, 374, 89_959_444),
    (388, 1_290, 300, 100, Some(115_813_674), 152, 1, 2_385_165),
    (388, 1_290, 300, 100, Some(115_813_674), 152, 49, 41_783_334),
    (388, 1_290, 300, 100, Some(115_813_674), 152, 152, 124_664_874),
    (502, 2_510, 1, 1_000, None, 502, 147, 59_819_738),
    (502, 2_510, 1, 1_000, None, 502, 462, 185_317_746),
    (502, 2_510, 1, 1_000, None, 502, 502, 202_508_001),
    (637, 13_914, 100_000, 100, Some(26_847_435), 373, 49, 3_521_633),
    (637, 13_914, 100_000, 100, Some(26_847_435), 373, 373, 26_807_532),
    (8_774, 348_907, 300, 7, None, 8_774, 5_133, 1_177_071_331),
    (8_774, 348_907, 300, 7, None, 8_774, 8_770, 2_143_329_682),
    (8_774, 348_907, 300, 7, None, 8_774, 8_774, 2_155_058_176),
    (10_004, 12_461, 100_000, 100, Some(222_518_743), 2_772, 1, 80_251),
    (10_004, 12_461, 100_000, 100, Some(222_518_743), 2_772, 2_772, 222_454_057),
    (27_607, 11_681, 4_000, 1_000, Some(1_389_568_887), 16_262, 1_655, 144_208_448),
    (27_607, 11_681, 4_000, 1_000, Some(1_389_568_887), 16_262, 16_262, 1_397_180_939),
    (37_998, 1, 4_000, 7, Some(6_244_151_333_082), 6_244, 807, 807_000_000_000),
    (37_998, 1, 4_000, 7, Some(6_244_151_333_082), 6_244, 6_243, 6_243_000_000_000),
    (37_998, 1, 4_000, 7, Some(6_244_151_333_082), 6_244, 6_244, 6_244_000_000_000),
    (121_555, 350_051, 300, 7, Some(1_938_629_690), 27_471, 1, 3_212_902),
    (121_555, 350_051, 300, 7, Some(1_938_629_690), 27_471, 27_471, 3_876_685_428),
    (127_279_421, 190, 1, 7, None, 127_279_421, 105_585_992, 555_715_760_797_369),
    (127_279_421, 190, 1, 7, None, 127_279_421, 127_279_416, 669_891_676_586_843),
    (127_279_421, 190, 1, 7, None, 127_279_421, 127_279_421, 669_891_716_331_579),
    (257_362_125, 24, 300, 1_000, Some(3_523_138_796_962_980), 84_555_331, 55_404_361, 2_308_515_041_666_667),
    (257_362_125, 24, 300, 1_000, Some(3_523_138_796_962_980), 84_555_331, 84_555_330, 3_523_138_750_000_000),
    (257_362_125, 24, 300, 1_000, Some(3_523_138_796_962_980), 84_555_331, 84_555_331, 3_523_138_791_666_667),
    (907_684_007, 115_759, 300, 1_000, None, 907_684_007, 1, 1_145_684),
    (907_684_007, 115_759, 300, 1_000, None, 907_684_007, 234_657_111, 2_027_175_220_850),
    (907_684_007, 115_759, 300, 1_000, None, 907_684_007, 907_684_007, 7_841_267_959_992),
    (5_229_595_630, 67, 300, 1, None, 5_229_595_630, 2_364_845_081, 35_296_195_238_805_971),
    (5_229_595_630, 67, 300, 1, None, 5_229_595_630, 5_229_595_630, 78_053_666_119_402_986),
];
