//! Jobs of the shape that the posts of CAM programs write, end to end: checked, run with the zero
//! from the command line and from the machine's profile, stored, and sent. All end at the same
//! counters.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use vimc4::{Clock, Emulator};

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

/// Where the work-piece lies on the mill.
const ZEROS: [&str; 4] = ["--zero", "100mm,50mm,-60mm", "--wpreg", "1=150mm,80mm,-60mm"];

/// A job, the options it needs, and what is said of it on an imc4: how often each.
struct Post {
    name: &'static str,
    options: &'static [&'static str],
    said: &'static [(&'static str, u64)],
}

const POSTS: [Post; 5] = [
    Post {
        name: "fusion",
        options: &[],
        said: &[("not-connected", 1), ("no-spindle-speed", 1), ("reference-first", 1)],
    },
    Post {
        name: "fusion-inch",
        options: &[],
        said: &[("not-connected", 1), ("no-spindle-speed", 1), ("reference-first", 1)],
    },
    Post {
        name: "hsmworks",
        options: &["--drilldef-unit", "mm"],
        said: &[
            ("at-surface", 1),
            ("not-connected", 1),
            ("no-spindle-speed", 1),
            ("reference-first", 1),
        ],
    },
    Post {
        name: "freecad",
        options: &[],
        said: &[
            ("at-surface", 1),
            ("not-connected", 1),
            ("no-spindle-speed", 1),
            // It writes helices as arcs.
            ("off-plane", 48),
            ("reference-first", 1),
        ],
    },
    Post {
        name: "vectric",
        options: &[],
        said: &[("not-connected", 1), ("no-spindle-speed", 1), ("reference-first", 1)],
    },
];

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../fixtures/ncp/posts/{name}.ncp"))
}

/// What it prints; it must end with 0.
fn vimc4(folder: &Path, arguments: &[&str]) -> String {
    let (code, out, err) = process::run(folder, arguments);
    assert_eq!(code, 0, "{arguments:?}\n{out}\n{err}");
    out
}

/// The counters of X, Y and Z at the end of a run.
fn end(json: &str) -> [i64; 3] {
    let summary: Value = serde_json::from_str(json).unwrap();
    ["X", "Y", "Z"].map(|axis| summary["axes"][axis]["position"].as_i64().unwrap())
}

/// What was said that was not of slow pieces, and how often; that depends on the model.
fn said(json: &str) -> BTreeMap<String, u64> {
    let summary: Value = serde_json::from_str(json).unwrap();
    let mut counts = BTreeMap::new();
    for diagnostic in summary["diagnostics"].as_array().unwrap() {
        let code = diagnostic["code"].as_str().unwrap().to_owned();
        if code != "slow-pieces" {
            *counts.entry(code).or_default() += 1;
        }
    }
    counts
}

#[test]
fn jobs_of_posts_run_stored_and_sent_end_at_the_same_counters() {
    for model in ["imc4", "imc-s8"] {
        for Post { name, options, said: expected } in &POSTS {
            let folder = tempfile::tempdir().unwrap();
            let folder = folder.path();
            fs::copy(fixture(name), folder.join("job.ncp")).unwrap();
            let mill = vimc4(folder, &["machines", "show", "mill"]);
            let own = "\n[job.zero]\nx = 100000\ny = 50000\nz = -60000\n\n\
                       [job.registers.1]\nx = 150000\ny = 80000\nz = -60000\n";
            fs::write(folder.join("mine.toml"), mill + own).unwrap();
            let site = [&["--model", model, "--machine", "mill"], &ZEROS[..], options].concat();
            let with = |before: &[&'static str], after: &[&'static str]| -> Vec<&str> {
                [before, &site, after].concat()
            };

            let checked = vimc4(folder, &with(&["ncp", "check", "job.ncp"], &["--format", "json"]));
            let expected: BTreeMap<String, u64> =
                expected.iter().map(|(code, count)| ((*code).to_owned(), *count)).collect();
            assert_eq!(said(&checked), expected, "{name}");

            let run = end(&vimc4(folder, &with(&["ncp", "run", "job.ncp"], &["--yes", "--json"])));
            let profile = ["--model", model, "--machine", "mine.toml", "--yes", "--json"];
            let profile = [&["ncp", "run", "job.ncp"], &profile[..], options].concat();
            assert_eq!(end(&vimc4(folder, &profile)), run, "{name}, zero in the profile");

            // A stored program cannot wait for a tool.
            let text = fs::read_to_string(folder.join("job.ncp")).unwrap();
            let lines = text.lines().filter(|line| !line.contains("GETTOOL"));
            fs::write(folder.join("stored.ncp"), lines.collect::<Vec<_>>().join("\n")).unwrap();
            vimc4(folder, &with(&["ncp", "compile", "stored.ncp"], &["--output", "job.cnc"]));
            let axes = ["--model", model, "--machine", "mill", "--axes", "15", "--json"];
            let stored = vimc4(folder, &[&["run", "job.cnc"], &axes[..]].concat());
            assert_eq!(end(&stored), run, "{name}, stored on {model}");

            let emulator = Emulator::builder()
                .model(model)
                .machine("mill")
                .pty(folder.join("port"))
                .time(Clock::Instant)
                .start()
                .unwrap();
            vimc4(folder, &with(&["send", "job.ncp", "--to", "port"], &["--yes"]));
            assert_eq!(emulator.position().unwrap()[..3], run, "{name}, sent to {model}");
        }
    }
}
