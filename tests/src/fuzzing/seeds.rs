//! The inputs to begin with, made from the command tables.
//!
//! The replay makes them anew each time, so that they are those of the tables as they are now.
//! `cargo run -p vimc4-tests --bin corpus-seeds` writes them down for fuzzing.

use vimc4_plant::Machine;

use super::{isel, lpkf, ncp};

pub use super::script::Seed;

/// All of them.
#[must_use]
pub fn seeds() -> Vec<Seed> {
    [isel::seeds::seeds(), lpkf::seeds::seeds(), ncp::seeds(), profiles()].concat()
}

/// Profiles to change, and some that are whole.
fn profiles() -> Vec<Seed> {
    let seed = |name: String, data: String| Seed { target: "profiles", name, data: data.into() };
    let like =
        |name: &str, line: &str| seed(format!("like-{name}"), format!("like {name}\n{line}\n"));
    let mut seeds = Vec::new();
    seeds.extend(vimc4_isel::Model::names().into_iter().map(|name| like(name, "line_us = 1")));
    seeds.extend(vimc4_lpkf::Model::names().into_iter().map(|name| like(name, "start_ms = 7")));
    seeds.extend(Machine::names().into_iter().map(|name| like(name, "start = 7")));
    let whole = [
        vimc4_isel::Model::builtin_toml("imc4"),
        vimc4_lpkf::Model::builtin_toml("motionsystem"),
        Machine::builtin_toml("mill-4axis"),
        Machine::builtin_toml("positioner"),
    ];
    for text in whole.into_iter().flatten() {
        let name = text.lines().find_map(|line| line.strip_prefix("name = "));
        seeds.push(seed(name.unwrap_or_default().trim_matches('"').to_owned(), text.to_owned()));
    }
    seeds
}
