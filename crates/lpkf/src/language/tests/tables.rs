//! The tables: that they are well formed and say what they should.

use std::collections::BTreeSet;

use vimc4_plant::Unit;

use crate::language::{Answer, Axis, Count, Dialect, Kind, Side, Status, forms};

#[test]
fn every_form_is_complete_and_unique() {
    let mut mnemonics = BTreeSet::new();
    for (place, form) in forms().iter().enumerate() {
        let name = form.mnemonic;
        assert_eq!(form.op as usize, place, "{name}");
        assert_eq!(form.op.form(), form, "{name}");
        assert!(mnemonics.insert(name), "{name}");
        let letters = form.letters().strip_prefix('!').unwrap_or(form.letters());
        assert_eq!(letters.len(), 2, "{name}");
        assert!(letters.chars().all(|letter| letter.is_ascii_uppercase()), "{name}");
        // The number of parameters is in the name if, and only if, something else has the letters.
        let several = forms().iter().filter(|other| other.letters() == form.letters()).count() > 1;
        let numbered = format!("{}/{}", form.letters(), form.parameters.len());
        assert_eq!(name, if several { numbered.as_str() } else { form.letters() });
        assert!(form.title.starts_with(|letter: char| letter.is_ascii_lowercase()), "{name}");
        assert!(!form.models.is_empty() && form.models.is_sorted(), "{name}");
        assert!(form.count != Count::Repeated || form.parameters.len() == 2, "{name}");
        let source = match (form.evidence, form.direct, form.letters().starts_with('!')) {
            ("F", ..) => "field",
            (_, true, _) => "Direkt-Befehle",
            (_, false, true) => "Sonderbefehle",
            (_, false, false) => "Standardbefehle",
        };
        assert_eq!(form.source, source, "{name}");
    }
}

/// The mnemonics of the forms a condition holds for.
fn those(condition: impl Fn(&crate::language::Form) -> bool) -> String {
    let names = forms().iter().filter(|form| condition(form)).map(|form| form.mnemonic);
    names.collect::<Vec<_>>().join(" ")
}

#[test]
fn some_forms_are_special() {
    assert_eq!(those(|form| form.direct), "!CB !GO !RP !ST");
    assert_eq!(those(|form| form.evidence == "F"), "CI EA ER PU VS !TA !TR");
    assert_eq!(those(|form| form.count == Count::Repeated), "PA PR");
    assert_eq!(those(|form| form.answer == Answer::Silence), "!OC/0 !OC/1");
    for (letter, names) in
        [('W', "OH/0 OH/1"), ('S', "OS"), ('P', "!ON"), ('A', "!OA"), ('R', "!RD")]
    {
        assert_eq!(those(|form| form.answer.letter() == Some(letter)), names);
    }
}

#[test]
fn each_model_has_its_forms() {
    let only = |model| those(move |form| form.models == [model]);
    assert_eq!(
        only(Dialect::Smcu),
        "CI EA ER PD PU VS !AS/1 !CM !FP !HP !RS/1 !TD !TM !VU !VZ/1 !ZA/1 !ZR/1"
    );
    assert_eq!(
        only(Dialect::MotionSystem),
        "OH/1 !AS/2 !CC/1 !CS !GB !IS/1 !MA !MR !OA !OC/1 !PH !RC !RS/2 !SR !VZ/2 !ZA/2 !ZR/2 \
         !RP"
    );
}

#[test]
fn only_what_has_a_unit_has_limits() {
    let limited = [Kind::Resolution, Kind::Speed, Kind::Acceleration];
    for form in forms() {
        for parameter in form.parameters {
            for axis in [Unit::Linear, Unit::Rotary] {
                let (low, high) = parameter.kind.limits(axis);
                assert_eq!(low.is_some(), limited.contains(&parameter.kind));
                assert!(high.is_none() || high > low);
                assert!(low.is_none() || !parameter.kind.unit(axis).is_empty());
            }
        }
    }
    assert_eq!(Kind::Speed.unit(Unit::Linear), "µm/s");
    assert_eq!(Kind::Speed.unit(Unit::Rotary), "0.1°/s");
}

#[test]
fn statuses_are_written_as_each_model_does() {
    let written = |status: Status, model, decimal| status.written(model, decimal);
    for (status, hexadecimal, decimal, motion) in [
        (Status::SerialChannelA, "E00", "E00", "E100"),
        (Status::LimitSwitch, "E09", "E09", "E109"),
        (Status::FastStop, "E0A", "E10", "E110"),
        (Status::ReceiverOverflow, "E0F", "E15", "E115"),
        (Status::NoSuchAxis, "E15", "E21", "E121"),
    ] {
        assert_eq!(written(status, Dialect::Smcu, false).as_deref(), Some(hexadecimal));
        assert_eq!(written(status, Dialect::Smcu, true).as_deref(), Some(decimal));
        assert_eq!(written(status, Dialect::MotionSystem, false).as_deref(), Some(motion));
        assert_eq!(written(status, Dialect::MotionSystem, true).as_deref(), Some(motion));
    }
    assert_eq!(written(Status::SumError, Dialect::Smcu, false), None);
    assert_eq!(Status::SumError.source(Dialect::Smcu), None);
    assert_eq!(
        written(Status::CommandBufferFull, Dialect::MotionSystem, false).as_deref(),
        Some("E185")
    );
}

#[test]
fn statuses_are_unique_and_have_no_gaps() {
    let names: BTreeSet<_> = Status::ALL.iter().map(|status| status.name()).collect();
    let meanings: BTreeSet<_> = Status::ALL.iter().map(|status| status.meaning()).collect();
    assert_eq!((names.len(), meanings.len()), (86, 86));
    for (code, &status) in (0..).zip(Status::ALL) {
        assert_eq!(status.code(), code);
        assert_eq!(Status::from_code(code), Some(status));
    }
    assert_eq!(Status::from_code(86), None);
}

#[test]
fn the_statuses_of_an_axis_name_it() {
    for axis in Axis::ALL {
        let letter = axis.name().to_ascii_lowercase();
        for side in [Side::Negative, Side::Positive] {
            let side_name = match side {
                Side::Negative => "negative",
                Side::Positive => "positive",
            };
            let range = Status::range_left(axis, side);
            assert_eq!(range.name(), format!("range-{side_name}-{letter}-left"));
            let limit = Status::limit_switch(axis, side);
            assert_eq!(limit.name(), format!("limit-{side_name}-{letter}"));
        }
    }
}
