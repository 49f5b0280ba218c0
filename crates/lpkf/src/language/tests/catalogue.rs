//! The tables against the list that was read off the manual.

use std::collections::BTreeSet;

use serde::Deserialize;

use crate::language::{Dialect, Status, forms};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Catalogue {
    forms: Vec<FormRow>,
    statuses: Vec<StatusRow>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FormRow {
    form: String,
    parameters: usize,
    models: Vec<Dialect>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StatusRow {
    code: u8,
    name: String,
    smcu: Option<String>,
    motionsystem: Option<String>,
}

fn catalogue() -> Catalogue {
    toml::from_str(vimc4_fixtures::LPKF_CATALOGUE).unwrap()
}

#[test]
fn the_forms_are_those_of_the_manual() {
    let listed = catalogue().forms;
    let names: BTreeSet<_> = listed.iter().map(|row| row.form.clone()).collect();
    assert_eq!(names.len(), listed.len(), "a form is listed twice");

    let ours = forms().iter().map(|form| {
        let parameters: Vec<_> = form.parameters.iter().map(|parameter| parameter.name).collect();
        let name = format!("{} {}", form.letters(), parameters.join(","));
        (name.trim_end().to_owned(), form.parameters.len(), form.models.to_vec())
    });
    let theirs = listed.into_iter().map(|row| (row.form, row.parameters, row.models));
    assert_eq!(ours.collect::<BTreeSet<_>>(), theirs.collect::<BTreeSet<_>>());
    assert_eq!(forms().len(), names.len());
}

#[test]
fn the_statuses_are_those_of_the_manual() {
    let listed = catalogue().statuses;
    assert_eq!(listed.len(), Status::ALL.len());
    for (row, status) in listed.iter().zip(Status::ALL) {
        assert_eq!(row.code, status.code());
        assert_eq!(row.name, status.name());
        assert_eq!(row.smcu, status.written(Dialect::Smcu, false), "{}", row.name);
        assert_eq!(row.motionsystem, status.written(Dialect::MotionSystem, false), "{}", row.name);
    }
    assert_eq!(listed.iter().filter(|row| row.smcu.is_some()).count(), 22);
    assert_eq!(listed.iter().filter(|row| row.motionsystem.is_some()).count(), 86);
}
