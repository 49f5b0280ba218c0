#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| vimc4_tests::fuzzing::scenario(data));
