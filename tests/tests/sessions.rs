//! Plays every session on every model it is about, each as a test of its own, named
//! `family/topic/file/name::model`. `cargo test -p vimc4-tests --test sessions stop/` plays some.

use std::fmt::Write as _;
use std::process::ExitCode;

use libtest_mimic::{Arguments, Failed, Trial};
use vimc4_conform::fixtures;
use vimc4_conform::format::Session;
use vimc4_conform::play::{Drive, play};
use vimc4_conform::workshop::Workshop;
use vimc4_device::Device;
use vimc4_device::Line;

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let sessions = match fixtures::sessions() {
        Ok(sessions) => sessions,
        Err(error) => {
            eprintln!("{error}");
            return ExitCode::FAILURE;
        }
    };
    let trials = sessions.into_iter().flat_map(|session| {
        session.models.clone().into_iter().map(move |model| {
            let session = session.clone();
            Trial::test(format!("{}::{model}", session.id), move || check(&session, model))
        })
    });
    libtest_mimic::run(&arguments, trials.collect()).exit_code()
}

fn check(session: &Session, model: &str) -> Result<(), Failed> {
    let workshop = Workshop::new(session, model)?;
    if session.line_pacing {
        check_on(session, model, |flash| workshop.build(flash).map(Line::paced))
    } else if session.has_faults() {
        check_on(session, model, |flash| workshop.build(flash).map(Line::ideal))
    } else {
        check_on(session, model, |flash| workshop.build(flash))
    }
}

/// Plays a session smoothly and roughly; the device must end in the same state.
fn check_on<D: Device>(
    session: &Session,
    model: &str,
    build: impl Fn(&[u8]) -> Result<D, String>,
) -> Result<(), Failed> {
    let [smooth, rough] = [Drive::Smooth, Drive::Rough].map(|drive| {
        play(session, drive, &build).map_err(|failure| {
            let mut text = String::new();
            let _ = writeln!(text, "{failure}\n  driven    {drive:?}, on {model}");
            Failed::from(text)
        })
    });
    let (_, smooth) = smooth?;
    let (_, rough) = rough?;
    if smooth != rough {
        return Err(format!("two ways, two states:\n{smooth:#?}\n{rough:#?}").into());
    }
    Ok(())
}
