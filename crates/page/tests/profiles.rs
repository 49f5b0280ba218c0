//! The built-in profiles that the module has in it that answers first are those of the catalogue.

#![expect(clippy::disallowed_methods, reason = "the file is written anew where that is asked for")]

use serde_json::Value;
use vimc4_catalogue::Model;

fn listed(profiles: impl Iterator<Item = Value>) -> String {
    profiles.map(|profile| profile.to_string()).collect::<Vec<_>>().join(",\n")
}

#[test]
fn the_profiles_are_those_of_the_catalogue() {
    let models = vimc4_catalogue::models().into_iter();
    let models =
        models.map(|name| serde_json::to_value(vimc4_catalogue::model(name).unwrap()).unwrap());
    let machines = vimc4_catalogue::machines().into_iter();
    let machines = machines
        .map(|name| serde_json::to_value(&*vimc4_catalogue::machine(name).unwrap()).unwrap());
    let made = format!(
        "{{\"models\":[\n{}\n],\"machines\":[\n{}\n]}}\n",
        listed(models),
        listed(machines)
    );
    if std::env::var_os("VIMC4_WRITE").is_some() {
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/profiles.json"), &made).unwrap();
        return;
    }
    assert!(
        made == include_str!("../profiles.json"),
        "crates/page/profiles.json is not what the catalogue has; VIMC4_WRITE=1 cargo test -p \
         vimc4-page --test profiles writes it"
    );
}

#[test]
fn a_written_model_is_the_model() {
    for name in vimc4_catalogue::models() {
        let model = vimc4_catalogue::model(name).unwrap();
        let written = serde_json::to_value(&model).unwrap();
        let set = written["command_set"].as_str().unwrap().to_owned();
        assert_eq!(Model::written(&set, written.clone()).unwrap(), model);
        assert!(Model::written("imc5", written).is_err());
    }
}
