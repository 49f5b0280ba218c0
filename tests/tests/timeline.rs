//! Wherever a history goes, and however, it is what it was there: mixed sessions of both families.

use std::panic::catch_unwind;

use vimc4_tests::fuzzing::{corpus, history, mixed};

#[test]
fn a_history_goes_anywhere_and_is_what_it_was_there() {
    let mut failed = Vec::new();
    let mut count = 0;
    for (family, target) in [(b'i', "controller"), (b'l', "lpkf")] {
        let inputs = corpus(target).unwrap_or_else(|error| panic!("{target}: {error}"));
        for (name, data) in mixed(&inputs) {
            let data = [&[family], data.as_slice()].concat();
            count += 1;
            if catch_unwind(|| history(&data)).is_err() {
                failed.push(name);
            }
        }
    }
    assert!(count >= 1_000, "{count} sessions are too few");
    assert!(failed.is_empty(), "{}", failed.join(", "));
}
