//! What `VIMC4_LOG` asks for: what happens as structured events on standard error.

use std::env;
use std::io::{self, Write};

use tracing_subscriber::filter::LevelFilter;

use crate::failure::Failure;
use crate::log::Log;

/// The environment variable that sets how much is logged.
const VARIABLE: &str = "VIMC4_LOG";

/// The levels, the quietest first.
const LEVELS: [(&str, LevelFilter); 6] = [
    ("off", LevelFilter::OFF),
    ("error", LevelFilter::ERROR),
    ("warn", LevelFilter::WARN),
    ("info", LevelFilter::INFO),
    ("debug", LevelFilter::DEBUG),
    ("trace", LevelFilter::TRACE),
];

/// How much is to be logged.
///
/// # Errors
///
/// If the variable names no level.
pub(crate) fn level() -> Result<LevelFilter, Failure> {
    let Some(value) = env::var_os(VARIABLE).filter(|value| !value.is_empty()) else {
        return Ok(LevelFilter::OFF);
    };
    let known = LEVELS.iter().find(|(name, _)| *name == value);
    known.map(|(_, level)| *level).ok_or_else(|| {
        let names = LEVELS.map(|(name, _)| name).join(", ");
        let value = crate::text::shown_in_line(&value.to_string_lossy());
        Failure::usage(format!("{VARIABLE}={value}: this is not a level; use one of {names}"))
    })
}

/// Has all controllers that begin from now on tell what happens, behind what else the log says on
/// standard error.
///
/// # Errors
///
/// As [`level`].
pub(crate) fn install(log: &Log) -> Result<(), Failure> {
    let level = level()?;
    if level != LevelFilter::OFF {
        let log = log.clone();
        let told = tracing_subscriber::fmt().with_max_level(level).with_target(false);
        // There is one already only if this is done twice.
        let _ = told.with_writer(move || Lines(log.clone())).try_init();
    }
    Ok(())
}

/// Each write is a line.
struct Lines(Log);

impl Write for Lines {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        self.0.say(String::from_utf8_lossy(line).trim_end());
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
