#![no_main]

#[path = "../../crates/capi/tests/inputs/mod.rs"]
mod inputs;

libfuzzer_sys::fuzz_target!(|data: &[u8]| inputs::inputs(data));
