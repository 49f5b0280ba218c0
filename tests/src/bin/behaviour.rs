//! Writes the behaviour document anew from the sessions.

use std::fs;
use std::process::ExitCode;

use vimc4_conform::fixtures;
use vimc4_tests::behaviour;

fn main() -> ExitCode {
    let path = behaviour::document_path();
    let written = match fixtures::sessions() {
        Ok(sessions) => fs::write(&path, behaviour::document(&sessions))
            .map_err(|error| format!("{}: {error}", path.display())),
        Err(error) => Err(error.to_string()),
    };
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
