#![no_main]

use vimc4_tests::fuzzing::{Reached, controller};

libfuzzer_sys::fuzz_target!(|data: &[u8]| controller(data, &mut Reached::default()));
