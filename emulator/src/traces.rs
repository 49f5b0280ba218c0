//! What `VIMC4_LOG` asks for: what happens as structured events on standard error.

use std::collections::HashMap;
use std::env;
use std::fmt::{Debug, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime};

use tracing::field::{Field, Visit};
use tracing::level_filters::LevelFilter;
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Metadata, Subscriber};

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
        let lines = Lines { log: log.clone(), level, spans: Mutex::default() };
        // There is one already only if this is done twice.
        let _ = tracing::subscriber::set_global_default(lines);
    }
    Ok(())
}

/// Writes each event as a line: its time, its level, its spans and its fields.
struct Lines {
    log: Log,
    level: LevelFilter,
    spans: Mutex<Spans>,
}

/// The open spans: each with its parents and its fields as text, and how many handles it has.
#[derive(Default)]
struct Spans {
    last: u64,
    open: HashMap<u64, (String, usize)>,
}

impl Lines {
    fn spans(&self) -> MutexGuard<'_, Spans> {
        self.spans.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Subscriber for Lines {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        *metadata.level() <= self.level
    }

    fn max_level_hint(&self) -> Option<LevelFilter> {
        Some(self.level)
    }

    fn new_span(&self, attributes: &Attributes<'_>) -> Id {
        let mut fields = Fields::default();
        attributes.record(&mut fields);
        let mut spans = self.spans();
        let parent = attributes.parent().and_then(|parent| spans.open.get(&parent.into_u64()));
        let parent = parent.map_or(String::new(), |(text, _)| format!("{text}:"));
        let text = format!("{parent}{}{{{}}}", attributes.metadata().name(), fields.0.trim_start());
        spans.last += 1;
        let number = spans.last;
        spans.open.insert(number, (text, 1));
        Id::from_u64(number)
    }

    fn event(&self, event: &Event<'_>) {
        let mut fields = Fields::default();
        event.record(&mut fields);
        let spans = self.spans();
        let span = event.parent().and_then(|parent| spans.open.get(&parent.into_u64()));
        let span = span.map_or("", |(text, _)| text);
        let line = format!("{} {:>5} {span}:{}", now(), event.metadata().level(), fields.0);
        drop(spans);
        self.log.say(&line);
    }

    fn clone_span(&self, id: &Id) -> Id {
        if let Some((_, handles)) = self.spans().open.get_mut(&id.into_u64()) {
            *handles += 1;
        }
        id.clone()
    }

    fn try_close(&self, id: Id) -> bool {
        let mut spans = self.spans();
        let Some((_, handles)) = spans.open.get_mut(&id.into_u64()) else { return false };
        *handles -= 1;
        let is_last = *handles == 0;
        if is_last {
            spans.open.remove(&id.into_u64());
        }
        is_last
    }

    // Each span is given as the parent of what is in it, with all its fields.
    fn enter(&self, _: &Id) {}
    fn exit(&self, _: &Id) {}
    fn record(&self, _: &Id, _: &Record<'_>) {}
    fn record_follows_from(&self, _: &Id, _: &Id) {}
}

/// Fields as text; the message is the first.
#[derive(Default)]
struct Fields(String);

impl Visit for Fields {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        // A string takes everything.
        let _ = match field.name() {
            "message" => {
                let others = std::mem::take(&mut self.0);
                write!(self.0, " {value:?}{others}")
            }
            name => write!(self.0, " {name}={value:?}"),
        };
    }
}

/// The time of the computer, as `2026-05-04T09:12:31.204117Z`.
fn now() -> String {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    instant(now.unwrap_or_default())
}

fn instant(since_1970: Duration) -> String {
    let seconds = since_1970.as_secs();
    let (year, month, day) = date(seconds / 86_400);
    let (hour, minute, second) = (seconds / 3_600 % 24, seconds / 60 % 60, seconds % 60);
    let micros = since_1970.subsec_micros();
    format!("{year}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{micros:06}Z")
}

/// Year, month and day of a day, counted from 1970. Years begin in March here, so that a leap day is the last.
fn date(days: u64) -> (u64, u64, u64) {
    let days = days + 719_468;
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let (month, later) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    (era * 400 + year + later, month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_written_as_dates() {
        for (seconds, text) in [
            (0, "1970-01-01T00:00:00.000000Z"),
            (951_782_399, "2000-02-28T23:59:59.000000Z"),
            (951_782_400, "2000-02-29T00:00:00.000000Z"),
            (1_777_885_951, "2026-05-04T09:12:31.000000Z"),
            (4_107_542_400, "2100-03-01T00:00:00.000000Z"),
        ] {
            assert_eq!(instant(Duration::from_secs(seconds)), text);
        }
    }
}
