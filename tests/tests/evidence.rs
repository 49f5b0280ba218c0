//! Whether the marks of evidence hold: what a quirk can change is assumed, and what the tables of
//! commands cite exists.

#![expect(clippy::unwrap_used, reason = "what cannot be read fails the test")]

use std::collections::BTreeSet;

use vimc4::Family;
use vimc4_conform::fixtures;
use vimc4_conform::format::{Session, merge};
use vimc4_conform::play::{Drive, play};
use vimc4_conform::script::Action;
use vimc4_conform::source::Source;
use vimc4_conform::workshop::{self, Workshop};
use vimc4_device::Line;
use vimc4_lpkf::language::forms;

/// Quirks of cards that came before the manuals. What these say of their own models is certain.
const OF_OTHER_CARDS: [&str; 11] = [
    "axis_codes",
    "lower_case",
    "position_axes",
    "resting_speed",
    "store_over",
    "self_test_end",
    "reset_reply",
    "break_reply",
    "start_at_rest",
    "lone_end",
    "capital_d",
];

#[test]
fn nothing_documented_depends_on_a_quirk() {
    let sessions = fixtures::sessions().unwrap_or_else(|error| panic!("{error}"));
    let assumed = assumed_quirks(&sessions);
    let mut flips = BTreeSet::new();
    for session in sessions.iter().filter(|session| session.source.evidence().documented) {
        let evidence = session.source.evidence();
        for model in &session.models {
            let quirks = vimc4::quirks(&vimc4::model(model).unwrap()).iter();
            for (quirk, values) in quirks.filter(|(quirk, _)| !OF_OTHER_CARDS.contains(quirk)) {
                // What the session itself sets is what it is about.
                let about = own_quirks(session).any(|own| own == *quirk);
                let said = evidence.assumed || evidence.field && !assumed.contains(*quirk);
                if about || said {
                    continue;
                }
                let flipped = values.iter().filter(|value| !passes(session, model, quirk, value));
                flips.extend(flipped.map(|value| format!("{} {quirk} = {value}", session.id)));
            }
        }
    }
    let flips: Vec<String> = flips.into_iter().collect();
    assert!(
        flips.is_empty(),
        "marked as documented, but a quirk changes it; say in its `source` what is assumed, or \
         what the field shows:\n  {}",
        flips.join("\n  ")
    );
}

/// The quirks whose values are assumed, at least in part: what says so are the sessions that set
/// them to the value of the session's models.
fn assumed_quirks(sessions: &[Session]) -> BTreeSet<&str> {
    let assumed = sessions.iter().filter(|session| session.source.evidence().assumed);
    let own = |session| {
        own_quirks(session).filter(move |quirk| {
            session.models.iter().any(|model| {
                let built_in = workshop::profile(&vimc4::model(model).unwrap()).unwrap();
                let value = |profile: &toml::Table| profile.get("quirks")?.get(quirk).cloned();
                value(&built_in) == value(&session.profile)
            })
        })
    };
    assumed.flat_map(own).collect()
}

/// The quirks that a session sets.
fn own_quirks(session: &Session) -> impl Iterator<Item = &str> {
    let quirks = session.profile.get("quirks").and_then(toml::Value::as_table);
    quirks.into_iter().flat_map(|quirks| quirks.keys().map(String::as_str))
}

/// Whether a session passes with another value of a quirk.
fn passes(session: &Session, model: &str, quirk: &str, value: &str) -> bool {
    let mut other = session.clone();
    merge(&mut other.profile, toml::from_str(&format!("quirks.{quirk} = {value}")).unwrap());
    let workshop = Workshop::new(&other, model).unwrap();
    if session.line_pacing {
        play(&other, Drive::Smooth, |flash| workshop.build(flash).map(Line::paced)).is_ok()
    } else if session.has_faults() {
        play(&other, Drive::Smooth, |flash| workshop.build(flash).map(Line::ideal)).is_ok()
    } else {
        play(&other, Drive::Smooth, |flash| workshop.build(flash)).is_ok()
    }
}

/// The chapters of isel's manuals that describe the error codes.
const CODES: [(&str, &str); 3] = [("99", "4"), ("05", "4"), ("12", "5")];

#[test]
fn a_documented_error_code_cites_the_chapter_of_the_codes() {
    let sessions = fixtures::sessions().unwrap_or_else(|error| panic!("{error}"));
    let documented = sessions.iter().filter(|session| {
        let evidence = session.source.evidence();
        session.family == Family::Isel && evidence.documented && !evidence.assumed
    });
    let (with_code, without): (Vec<_>, Vec<_>) = documented.partition(|s| expects_error_code(s));
    assert!(with_code.len() > 40 && without.len() > 40, "{} {}", with_code.len(), without.len());
    let wrong = with_code.iter().filter(|session| !session.source.cites_wherever(&CODES));
    let wrong: Vec<&str> = wrong.map(|session| session.id.as_str()).collect();
    assert!(
        wrong.is_empty(),
        "these expect an error code; cite the chapter that describes it ({CODES:?}), or say what is \
         assumed:\n  {}",
        wrong.join("\n  ")
    );
}

/// Whether a session expects an error code as a whole reply. `F` is not counted: the sections about
/// 253 describe it too.
fn expects_error_code(session: &Session) -> bool {
    let is_code = |bytes: &[u8]| matches!(bytes, [b'1'..=b'9' | b'D' | b'G' | b'H' | b'R']);
    session.steps.iter().any(|step| match &step.action {
        Action::Expect(expected) => matches!(&expected.parts[..], [whole] if is_code(whole)),
        _ => false,
    })
}

#[test]
fn what_the_tables_of_commands_cite_exists() {
    for form in forms() {
        if let Err(error) = Source::parse(form.source, form.evidence) {
            panic!("{}: {error}", form.mnemonic);
        }
    }
}
