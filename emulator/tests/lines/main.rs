//! `vimc4 lines`: every request in every kind of program, what is at the far end of the lines, jobs
//! and ends, and programs that mean it ill. The test `connect` has the programs of the field.
//!
//! What needs a tool
//! that is missing is shown as ignored, with the reason in its name. With `VIMC4_REQUIRE_TOOLS=1`
//! it fails instead, so that nothing is left out unnoticed.

#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
mod linux;

#[expect(dead_code, reason = "each test uses its part of it")]
#[path = "../process/mod.rs"]
mod process;

#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
fn main() -> std::process::ExitCode {
    linux::main()
}

#[cfg(not(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64"))))]
fn main() {
    use process::limits::InTime as _;
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_vimc4"))
        .args(["lines", "x"])
        .output_in_time();
    let output = output.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("on Linux"));
}
