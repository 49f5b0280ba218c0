#![no_main]

use vimc4_tests::fuzzing::{Reached, lpkf};

libfuzzer_sys::fuzz_target!(|data: &[u8]| lpkf(data, &mut Reached::default()));
