//! Measures how fast the emulator is, against bare baselines, and reports it as Markdown.
//!
//! `cargo run --release -p vimc4-bench` measures everything; docs/performance.md says how.
#![forbid(unsafe_code)]

#[cfg(target_os = "linux")]
mod suite;

#[cfg(target_os = "linux")]
fn main() -> std::process::ExitCode {
    suite::main()
}

#[cfg(not(target_os = "linux"))]
fn main() {
    eprintln!("processor time and memory are read from /proc; measure on Linux");
}
