//! The values of options that several commands have.

use std::time::Duration;

use vimc4_device::parse_duration;

/// A span of time, as it is written wherever people write one.
pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    let help = "a number with a unit is needed, as in 250ms, 2s, 5min or 1h";
    parse_duration(text).map_err(|_| help.to_owned())
}
