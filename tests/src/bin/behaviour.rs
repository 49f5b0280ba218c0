//! Writes the documents that are made from the fixtures anew: that of the controllers' behaviour,
//! and the reference of job files.

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use vimc4_conform::fixtures;
use vimc4_tests::{behaviour, jobs, ncp_reference};

fn main() -> ExitCode {
    let behaviour = fixtures::sessions()
        .map_err(|error| error.to_string())
        .and_then(|sessions| write(&behaviour::document_path(), &behaviour::document(&sessions)));
    let reference = jobs::jobs()
        .and_then(|jobs| write(&ncp_reference::document_path(), &ncp_reference::document(&jobs)));
    match behaviour.and(reference) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))
}
