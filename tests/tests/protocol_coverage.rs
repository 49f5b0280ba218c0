//! What controllers can do, as their tables list it, held against what they do.

#![expect(clippy::expect_used, reason = "what cannot be read fails the test")]

use std::collections::BTreeMap;

use vimc4::{Event, Model};
use vimc4_conform::fixtures;
use vimc4_conform::play::{Drive, Record, play};
use vimc4_conform::workshop::Workshop;
use vimc4_coverage::Collector;

/// Nothing that happens in any session is missing in the tables; what the sessions of each model meet of
/// them is printed.
#[test]
fn whatever_a_session_meets_the_tables_list() {
    let mut strange = Vec::new();
    let mut met: BTreeMap<&str, Collector> = BTreeMap::new();
    for session in fixtures::sessions().unwrap_or_else(|error| panic!("{error}")) {
        for &name in &session.models {
            let workshop = Workshop::new(&session, name).expect("the profiles of a session");
            let played = play(&session, Drive::Smooth, |flash| workshop.build(flash));
            // One that fails is reported by the test that is named after it.
            let Ok((record, _)) = played else { continue };
            let mut collector = Collector::new(workshop.model());
            show(&mut collector, &record);
            strange.extend(
                collector.not_listed().map(|what| format!("{name}: {what}: {}", session.id)),
            );
            if *workshop.model() == model(name) {
                let met = met.entry(name).or_insert_with(|| Collector::new(&model(name)));
                show(met, &record);
            }
        }
    }
    for (name, collector) in &met {
        println!("{name}\n{}", collector.coverage().table());
        println!("{}\n", collector.coverage().missing().join("\n"));
    }
    strange.sort();
    strange.dedup();
    assert!(strange.is_empty(), "met, and not in the tables\n  {}", strange.join("\n  "));
}

/// The answers and the course of a session.
fn show(collector: &mut Collector, record: &Record) {
    for (mnemonic, kind) in &record.answers {
        let (mnemonic, bytes) = (mnemonic.clone(), kind.clone().into());
        collector.see(&Event::Answer { mnemonic, bytes, why: None });
    }
    for course in &record.courses {
        collector.see(&Event::Course(course.clone()));
    }
}

fn model(name: &str) -> Model {
    vimc4::model(name).expect("a built-in model")
}
