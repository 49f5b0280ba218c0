//! Sessions at a simulated port.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;

use vimc4_catalogue::Family;
use vimc4_conform::choice::{Allowed, Chooser, Plan, Reason};
use vimc4_conform::explain::{Cause, candidates, explain};
use vimc4_conform::fixtures;
use vimc4_conform::format::{Session, merge};
use vimc4_conform::player::Timing;
use vimc4_conform::rehearsal::{Delays, rehearse};
use vimc4_conform::source::with_manual;
use vimc4_conform::workshop::{self, Workshop};

/// Everything, on a machine as large as can be, for an hour.
fn everything() -> Allowed {
    Allowed {
        moves: true,
        reference: true,
        outputs: true,
        flash: true,
        envelope: [(-20_000_000, 20_000_000); 6],
        longest: 3_600_000_000_000,
    }
}

fn model(name: &str) -> vimc4_catalogue::Model {
    vimc4_catalogue::model(name).unwrap()
}

/// The sessions that can be played with this model.
fn plans(model: &vimc4_catalogue::Model, allowed: &Allowed) -> Vec<(Session, Plan)> {
    let chooser = Chooser::new(model, Timing::default()).unwrap();
    let sessions = fixtures::sessions().unwrap().into_iter();
    sessions
        .filter_map(|session| Some((chooser.plan(&session, allowed).ok()?, session)))
        .map(|(plan, session)| (session, plan))
        .collect()
}

/// How many sessions can be played at least with a model: with everything allowed, and with
/// nothing.
fn least(model: &vimc4_catalogue::Model) -> (usize, usize) {
    match model.family() {
        // What is known of a model without a manual.
        Family::Isel if !with_manual(Family::Isel).contains(&model.name()) => (2, 1),
        Family::Isel => (150, 20),
        // To other machines the numbers of unknown commands are moves.
        Family::Lpkf => (40, 7),
    }
}

fn session(id: &str) -> Session {
    fixtures::sessions().unwrap().into_iter().find(|session| session.id == id).unwrap()
}

/// The model with another value of a quirk.
fn flipped(model: &vimc4_catalogue::Model, quirk: &str, value: &str) -> vimc4_catalogue::Model {
    let mut profile = workshop::profile(model).unwrap();
    merge(&mut profile, toml::from_str(&format!("[quirks]\n{quirk} = {value}")).unwrap());
    workshop::model(&profile).unwrap()
}

/// Which quirks some session shows at a port: of every model of a family, and of one more. The
/// others need hands: a limit switch, START, an input; or a machine with ends.
const OF_ISEL: &str = "axis_codes break_reply capital_d fractional_numbers lone_end lower_case \
    position_axes reset_reply resting_speed speed_3d stop_reply unreferenced version_handshake";
const OF_LPKF: &str = "after_status bare_pairs init_echo init_reply ta unknown_command";
const SHOWN: [(&str, &str, &str); 5] = [
    ("imc4", OF_ISEL, "self_test_end"),
    (
        "imc4-m",
        OF_ISEL,
        "bit_values self_test_end start_at_rest stop_in_move_until store_over stored_arcs",
    ),
    (
        "imc-s8",
        OF_ISEL,
        "bit_values cond_bit_base loop_count stop_in_move_until store_over stored_arcs",
    ),
    ("smcu", OF_LPKF, "decimal_speed hard_clip_blank status_digits"),
    ("motionsystem", OF_LPKF, ""),
];

#[test]
fn a_controller_with_another_quirk_fails_and_the_quirk_is_named() {
    let timing = Timing::default();
    for (name, of_family, of_model) in SHOWN {
        let model = model(name);
        let candidates = candidates(&model).unwrap();
        let plans = plans(&model, &everything());
        let mut seen = BTreeSet::new();
        for (quirk, values) in vimc4_catalogue::quirks(&model) {
            for value in *values {
                let other = flipped(&model, quirk, value);
                if other == model {
                    continue;
                }
                let controller = Workshop::bench(&other).unwrap();
                let wanted =
                    Cause::Profile { key: format!("quirks.{quirk}"), value: (*value).to_owned() };
                for (session, plan) in &plans {
                    for row in &plan.rows {
                        let device = controller.build(&[]).unwrap();
                        // A real port is a little late.
                        let Err(miss) =
                            rehearse(device, &row.steps, timing, Delays::of_player(1_000_000))
                        else {
                            continue;
                        };
                        let causes = explain(&candidates, &row.steps, timing, &miss);
                        assert!(
                            causes.contains(&wanted),
                            "{name}, {}: {miss:?} for {wanted} is explained by {causes:?}",
                            session.id
                        );
                        seen.insert(*quirk);
                    }
                }
            }
        }
        let shown = of_family.split_whitespace().chain(of_model.split_whitespace());
        assert_eq!(seen, shown.collect(), "{name}");
    }
}

#[test]
fn what_passes_needs_no_explanation_and_what_is_late_is_no_failure() {
    for name in vimc4_catalogue::models() {
        let model = model(name);
        let controller = Workshop::bench(&model).unwrap();
        let plans = plans(&model, &everything());
        let (least, _) = least(&model);
        assert!(plans.len() >= least, "{name}: {}", plans.len());
        for (session, plan) in plans {
            for row in &plan.rows {
                let late = [0, 500_000, 5_000_000, 20_000_000].map(Delays::of_player);
                let uneven = [[1_000_000, 0], [0, 1_000_000]].map(|way| Delays { player: 0, way });
                for delays in late.into_iter().chain(uneven) {
                    let device = controller.build(&[]).unwrap();
                    let played = rehearse(device, &row.steps, Timing::default(), delays);
                    assert!(played.is_ok(), "{name}, {}, {delays:?}: {played:?}", session.id);
                }
            }
        }
    }
}

#[test]
fn what_hangs_on_a_millisecond_between_two_sends_is_not_played() {
    let session = session("isel/time/reference-figures/253-just-before-braking");
    let chooser = Chooser::new(&model("imc4"), Timing::default()).unwrap();
    assert_eq!(chooser.plan(&session, &everything()), Err(Reason::ExactTime));
}

#[test]
fn by_default_nothing_moves_and_nothing_is_written_or_switched() {
    let harmless = Allowed { longest: u64::MAX, ..Allowed::default() };
    for name in vimc4_catalogue::models() {
        let model = model(name);
        let plans = plans(&model, &harmless);
        let (_, least) = least(&model);
        assert!(plans.len() >= least, "{name}: {}", plans.len());
        for (session, plan) in plans {
            let needs = session.needs();
            let may = needs.effects;
            let harm = [may.moves, may.writes_flash, may.outputs, needs.operator];
            assert_eq!(harm, [false; 4], "{name}, {}", session.id);
            assert!(plan.travel.is_nothing() && plan.rows.iter().all(|row| !row.fresh));
        }
    }
}

#[test]
fn another_model_or_something_at_the_machine_explains_too() {
    let timing = Timing::default();
    let model = model("imc4");
    let candidates = candidates(&model).unwrap();
    let chooser = Chooser::new(&model, timing).unwrap();
    let plan = |id| chooser.plan(&session(id), &everything()).unwrap();
    let texts = |row: &vimc4_conform::choice::Row, device: vimc4_catalogue::Controller| {
        let miss = rehearse(device, &row.steps, timing, Delays::default()).unwrap_err();
        let causes = explain(&candidates, &row.steps, timing, &miss);
        causes.iter().map(ToString::to_string).collect::<Vec<_>>()
    };

    let other = Workshop::bench(&vimc4_catalogue::model("imc4-m").unwrap()).unwrap();
    let unknown = plan("isel/line/framing/not-in-this-set");
    assert!(
        texts(&unknown.rows[0], other.build(&[]).unwrap()).contains(&"the model imc4-m".to_owned())
    );

    let speeds = plan("isel/axes/speeds/limits-older");
    let mut profile = workshop::profile(&model).unwrap();
    merge(&mut profile, toml::from_str("[limits]\nspeed_max = 40000").unwrap());
    let faster = Workshop::bench(&workshop::model(&profile).unwrap()).unwrap();
    assert_eq!(
        texts(&speeds.rows[0], faster.build(&[]).unwrap()),
        ["limits.speed_max = 40000 in the profile"]
    );

    use vimc4_device::{Device, Harness, Input};
    let mut open = Harness::new(Workshop::bench(&model).unwrap().build(&[]).unwrap());
    let signals = open.device().signals();
    let cover = signals.iter().find(|signal| signal.name == "cover").unwrap().id;
    open.input(Input::Signal(cover, 0));
    assert_eq!(
        texts(&plan("isel/line/framing/capitals").rows[0], open.into_device()),
        ["cover = open at the machine"]
    );
}

#[test]
fn a_profile_of_ones_own_decides_which_sessions_apply() {
    let (f, f0) =
        (session("isel/stop/software-stop/quirk-f"), session("isel/stop/software-stop/quirk-f0"));
    let goes_on = session("isel/stop/software-stop/one-f");
    let reasons = |model: &vimc4_catalogue::Model| {
        let chooser = Chooser::new(model, Timing::default()).unwrap();
        [&f, &f0, &goes_on].map(|session| chooser.plan(session, &everything()).err())
    };
    let imc4 = model("imc4");
    let about = |value: &str| Some(Reason::Profile(format!("quirks.stop_reply = \"{value}\"")));
    assert_eq!(reasons(&imc4)[..2], [None, about("F0")]);
    let other = flipped(&imc4, "stop_reply", "\"F0\"");
    assert_eq!(reasons(&other), [about("F"), None, Some(Reason::OwnProfile)]);
}

#[test]
fn the_envelope_bounds_what_is_played() {
    let model = model("imc4");
    let chooser = Chooser::new(&model, Timing::default()).unwrap();
    let moves = session("isel/stop/software-stop/goes-on");
    let mut allowed = Allowed { envelope: [(0, 0); 6], ..everything() };
    allowed.envelope[0] = (0, 5_000);
    let plan = chooser.plan(&moves, &allowed);
    // It was stopped underway, so the port cannot know exactly where.
    assert_eq!(plan, Err(Reason::ExactTime));
    let moves = session("isel/stop/software-stop/quirk-f");
    let plan = chooser.plan(&moves, &allowed).unwrap();
    // The way that was begun counts, not the part of it that was made before the stop.
    assert_eq!((plan.travel.high[0], plan.travel.low[0], plan.travel.top), (5_000, 0, 10_000));
    assert!((1..5_000).contains(&plan.rows[0].end[0]), "{:?}", plan.rows[0].end);
    allowed.envelope[0] = (0, 4_999);
    let refused = chooser.plan(&moves, &allowed).unwrap_err();
    assert_eq!(refused.to_string(), "leaves the envelope: X 0…5000");
}

#[test]
fn what_depends_on_an_empty_memory_is_played_on_an_erased_one() {
    let reset = session("isel/settings/effect/program-and-values");
    let s8 = model("imc-s8");
    let chooser = Chooser::new(&s8, Timing::default()).unwrap();
    assert_eq!(chooser.erase(), ["@0k", "@0IX", "@0IW"]);
    let plan = chooser.plan(&reset, &everything()).unwrap();
    assert!(plan.rows[0].fresh && plan.rows[0].writes);
    // S would start the owner's program, wherever that leads.
    let starts = session("isel/stop/software-stop/neither-remainder-nor-program");
    assert!(chooser.plan(&starts, &everything()).unwrap().rows[0].fresh);
    // The oldest card cannot be erased by a command.
    let imc4 = Chooser::new(&model("imc4"), Timing::default()).unwrap();
    assert!(imc4.erase().is_empty());
    let storing = session("isel/program/storing/every-line");
    assert_eq!(imc4.plan(&storing, &everything()), Err(Reason::Panel));
}
