//! Wherever a history goes, and however, it is what it was there: random sessions of both families.

use std::panic::catch_unwind;

use vimc4_tests::fuzzing::{corpus, history};

/// So many times each input of the corpus is changed and tried again.
const CHANGED: usize = 3;

#[test]
fn a_history_goes_anywhere_and_is_what_it_was_there() {
    let mut failed = Vec::new();
    let mut count = 0;
    for (family, target) in [(b'i', "controller"), (b'l', "lpkf")] {
        let inputs = corpus(target).unwrap_or_else(|error| panic!("{target}: {error}"));
        for (number, (name, data)) in inputs.iter().enumerate() {
            // The same with another one's end: other commands in other states.
            let others = (1..=CHANGED).map(|step| {
                let (_, other) = &inputs[(number * 7 + step * 13) % inputs.len()];
                let mixed = [&data[..data.len() / 2], &other[other.len() / 2..]].concat();
                (format!("{name} and {step}"), mixed)
            });
            for (name, data) in std::iter::once((name.clone(), data.clone())).chain(others) {
                let data = [&[family], data.as_slice()].concat();
                count += 1;
                if catch_unwind(|| history(&data)).is_err() {
                    failed.push(name);
                }
            }
        }
    }
    assert!(count >= 1_000, "{count} sessions are too few");
    assert!(failed.is_empty(), "{}", failed.join(", "));
}
