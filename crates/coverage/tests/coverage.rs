//! Coverage as data: what is possible, what was met, merged, written and read.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeMap;
use std::time::Duration;

use proptest::prelude::*;
use vimc4_catalogue::{bare, machine, model, models};
use vimc4_coverage::{Collector, Coverage, CoverageError, Point, Total};
use vimc4_device::{Device as _, Harness, Input, SignalId};

fn coverage(name: &str) -> Coverage {
    Coverage::of(&model(name).unwrap())
}

/// What a host meets that says this, each line when the one before was answered.
fn met(name: &str, lines: &[&str]) -> Coverage {
    let (model, machine) = (model(name).unwrap(), machine("bench").unwrap());
    let mut collector = Collector::new(&model);
    let device = bare(&model, &machine, &[]).unwrap();
    let mut harness = Harness::new(device).watching(Collector::KINDS);
    for line in lines {
        let span = line.strip_prefix("wait ").and_then(|seconds| seconds.parse().ok());
        match line.strip_prefix("press ") {
            None if span.is_some() => harness.advance(Duration::from_secs_f64(span.unwrap())),
            Some(button) => {
                let signals = harness.device().signals();
                let id: SignalId = signals.iter().find(|signal| signal.name == button).unwrap().id;
                harness.input(Input::Signal(id, 1));
                harness.input(Input::Signal(id, 0));
            }
            None => harness.send(format!("{line}\r").as_bytes()),
        }
    }
    harness.run_to_rest().unwrap();
    for event in harness.outputs().iter().filter_map(|output| output.event()) {
        collector.see(event);
    }
    assert_eq!(collector.not_listed().collect::<Vec<_>>(), Vec::<&str>::new());
    collector.coverage().clone()
}

fn times(coverage: &Coverage, mnemonic: &str, name: &str) -> u64 {
    let command = coverage.command(mnemonic).unwrap();
    command.points().find(|point| point.name == name).unwrap().met
}

/// The lower number of every fraction, held so that a change of a table is seen.
#[test]
fn what_is_possible_is_this_many() {
    let possible: BTreeMap<String, [usize; 4]> = models()
        .into_iter()
        .map(|name| {
            let totals = coverage(name).totals();
            let all = [totals.commands, totals.answers, totals.states, totals.stops];
            assert!(all.iter().all(|total| total.met == 0));
            (name.to_owned(), all.map(|total| total.possible))
        })
        .collect();
    let expected = [
        ("c142", [39, 162, 110, 206]),
        ("imc-m", [73, 306, 218, 299]),
        ("imc-mp", [73, 306, 218, 299]),
        ("imc-s8", [73, 306, 218, 299]),
        ("imc4", [37, 161, 110, 206]),
        ("imc4-m", [41, 177, 122, 220]),
        ("motionsystem", [46, 1026, 253, 260]),
        ("smcu", [45, 121, 86, 132]),
    ];
    let expected = expected.map(|(name, all)| (name.to_owned(), all));
    assert_eq!(possible, BTreeMap::from(expected));
}

#[test]
fn mnemonics_and_points_are_listed_once() {
    for name in models() {
        let coverage = coverage(name);
        let mut mnemonics: Vec<&str> =
            coverage.commands.iter().map(|command| command.mnemonic.as_str()).collect();
        mnemonics.sort_unstable();
        assert!(mnemonics.windows(2).all(|pair| pair[0] != pair[1]), "{name}: {mnemonics:?}");
        for command in &coverage.commands {
            for points in [&command.answers, &command.states, &command.stops] {
                let mut names: Vec<_> = points.iter().map(|p| (&p.name, &p.about)).collect();
                names.sort_unstable();
                assert!(
                    names.windows(2).all(|pair| pair[0] != pair[1]),
                    "{name}, {}: {names:?}",
                    command.mnemonic
                );
            }
        }
    }
}

/// 400 steps at 400 Hz take a second and a little.
const PROGRAM: [&str; 6] = ["@01", "@0i", "0400,400", "35,-1", "9", "@0S"];

#[test]
fn a_stop_in_a_stored_loop_is_told_from_one_outside() {
    let stop = |seconds: &str| met("imc-s8", &[&PROGRAM[..], &[seconds, "press stop"]].concat());
    let stops = |coverage: &Coverage, during: &str| {
        let points = &coverage.command("@S").unwrap().stops;
        let is_it = |point: &&Point| point.name == "the stop button" && point.about == during;
        points.iter().find(is_it).unwrap().met
    };
    let never = |coverage: &Coverage, during: &str| {
        let sentence =
            format!("`@S`: during “{during}” you never met the stop byte, the stop button");
        coverage.missing().iter().any(|line| line.starts_with(&sentence))
    };
    let (straight, looping) = ("program move", "program move in a stored loop");
    let first = stop("wait 0.5");
    assert_eq!((stops(&first, straight), stops(&first, looping)), (1, 0));
    assert!(!never(&first, straight) && never(&first, looping));
    assert_eq!(times(&first, "@S", "F"), 1);
    let second = stop("wait 1.5");
    assert_eq!((stops(&second, straight), stops(&second, looping)), (0, 1));
    assert!(never(&second, straight) && !never(&second, looping));
    assert_eq!(times(&second, "0", "program line"), 1);
    assert_eq!(times(&second, "0", "program line in a stored loop"), 1);
}

#[test]
fn counts_are_added_and_nothing_else_is() {
    let one = met("imc4", &["@01", "@0A5,900", "@0X"]);
    let mut both = met("imc4", &["@01", "@0A5,900,7"]);
    both.merge(&one).unwrap();
    assert_eq!(times(&both, "@axes", "0"), 2);
    assert_eq!((times(&both, "@A", "0"), times(&both, "@A", "7")), (1, 1));
    assert_eq!((times(&both, "?", "5"), times(&both, "?", "idle")), (1, 1));
    assert_eq!(both.totals().commands.met, 3);

    let before = both.clone();
    let other = both.merge(&coverage("imc4-m")).unwrap_err();
    assert_eq!(
        other.to_string(),
        "it covers the model imc4-m, and this is imc4: use a file for each model"
    );
    let mut elsewhere = coverage("imc4");
    elsewhere.commands[0].answers.pop();
    assert!(matches!(both.merge(&elsewhere), Err(CoverageError::Tables { .. })));
    assert_eq!(both, before);
}

#[test]
fn what_is_no_coverage_is_said() {
    for (text, said) in [
        ("", "it is no coverage that `--coverage` has written: EOF"),
        ("{}", "its format is not in it"),
        ("[1]", "its format is not in it"),
        (r#"{"vimc4-coverage":1}"#, "missing field"),
        (r#"{"vimc4-coverage":7}"#, "it has format 7 of coverage, and this program reads format 1"),
    ] {
        let error = Coverage::from_json(text).unwrap_err().to_string();
        assert!(error.contains(said), "{text}: {error}");
    }
}

#[test]
fn a_page_and_a_tracefile_have_every_point() {
    let coverage = met("imc-s8", &["@01", "@0A5,900"]);
    let points: usize = coverage.commands.iter().map(|c| 1 + c.points().count()).sum();
    let lcov = coverage.lcov("commands.txt");
    let records = |kind: &str| lcov.tracefile.lines().filter(|line| line.starts_with(kind)).count();
    let lines: Vec<&str> = lcov.source.lines().collect();
    assert_eq!((records("DA:"), lines.len()), (points, points + 1));
    assert_eq!(records("FN:"), coverage.commands.len());
    for record in lcov.tracefile.lines().filter_map(|line| line.strip_prefix("FN:")) {
        let (line, name) = record.split_once(',').unwrap();
        let line: usize = line.parse().unwrap();
        assert!(lines[line - 1].starts_with(&format!("{name}: ")), "{record}");
    }
    let met =
        lcov.tracefile.lines().filter(|line| line.starts_with("DA:") && !line.ends_with(",0"));
    assert!(lcov.tracefile.contains(&format!("LF:{points}\nLH:{}\n", met.count())));

    let page = coverage.html();
    assert_eq!(page.matches("<details>").count(), coverage.commands.len());
    // Nothing is fetched from elsewhere, and nothing of a title is taken for a tag.
    assert!(!page.contains("http") && !page.contains("<script"));
    // Commands that are in no section say nothing of one; validators warn of empty elements.
    assert!(coverage.commands.iter().any(|command| command.section.is_empty()));
    assert!(!page.contains("></span>"), "an empty element");
    let rows = page.matches("<td class=\"kind\">").count();
    assert_eq!(rows, points - coverage.commands.len());
}

#[test]
fn shares_are_in_per_cent() {
    assert_eq!(Total { met: 1, possible: 4 }.percent(), 25.0);
    assert_eq!(Total::default().percent(), 100.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Whatever was met is read as it was written, and the order of merging does not matter.
    #[test]
    fn written_and_merged(counts in prop::collection::vec(0..u64::MAX / 2, 1..40), name in 0..2_usize) {
        let model = ["imc4", "smcu"][name];
        let mut one = coverage(model);
        let counts = counts.iter().cycle();
        let points = one.commands.iter_mut().flat_map(|c| c.answers.iter_mut().chain(&mut c.stops));
        for (point, count) in points.zip(counts) {
            point.met = *count;
        }
        prop_assert_eq!(&Coverage::from_json(&one.to_json()).unwrap(), &one);
        let other = coverage(model);
        let (mut a, mut b) = (one.clone(), other.clone());
        a.merge(&other).unwrap();
        b.merge(&one).unwrap();
        prop_assert_eq!(&a, &one);
        prop_assert_eq!(&b, &one);
    }
}
