//! How a controller is to be started.

use std::ffi::c_char;
use std::path::Path;

use vimc4::{Builder, Emulator, Terminal};

use crate::error::Failure;
use crate::text;

/// More options than there are keys are taken for an array without an end.
const MOST: usize = 64;

/// What there is to be said.
const KEYS: &str = "model, machine, time, pty, tcp, rfc2217, serial, flash, record, line_pacing, \
                    fresh_clients, replace_link, tcp_clients";

/// The options of the caller's.
///
/// # Safety
///
/// `options` is NULL, or an array of texts with a NULL behind the last one; all stay as they are for `'a`.
pub(crate) unsafe fn of_caller<'a>(options: *const *const c_char) -> Result<Vec<&'a str>, Failure> {
    let mut texts = Vec::new();
    if options.is_null() {
        return Ok(texts);
    }
    loop {
        // SAFETY: no text before this one was the NULL at the end, so it belongs to the array.
        let place = unsafe { options.add(texts.len()) };
        // SAFETY: as above.
        let option = unsafe { place.read() };
        if option.is_null() {
            return Ok(texts);
        }
        if texts.len() == MOST {
            return Err(Failure::new("too many options; a NULL must follow the last one"));
        }
        // SAFETY: the caller says that it is a text.
        texts.push(unsafe { text::of_caller(option, "an option") }?);
    }
}

/// What the options ask for.
pub(crate) fn builder(options: &[&str]) -> Result<Builder, Failure> {
    let mut builder = Emulator::builder();
    for option in options {
        let Some((key, value)) = option.split_once('=') else {
            return Err(Failure(format!(
                "`{option}` is not an option; write KEY=VALUE, as in model=imc4"
            )));
        };
        let wrong = |right: String| Failure(format!("`{option}` is wrong: {right}"));
        let on = || match value {
            "on" => Ok(true),
            "off" => Ok(false),
            _ => Err(wrong("it can be on or off".to_owned())),
        };
        builder = match key {
            "model" => builder.model(value),
            "machine" => builder.machine(value),
            "time" => builder
                .time(value.parse().map_err(|error: vimc4::ClockError| wrong(error.to_string()))?),
            "pty" if value == "any" => builder.pty(Terminal::Unnamed),
            "pty" => builder.pty(Path::new(value)),
            "tcp" => builder.tcp(value),
            "rfc2217" => builder.rfc2217(value),
            "serial" => builder.serial(value),
            "flash" => builder.flash(value),
            "record" => builder.record(Path::new(value)),
            "line_pacing" => builder.line_pacing(on()?),
            "fresh_clients" => builder.fresh_clients(on()?),
            "replace_link" => builder.replace_link(on()?),
            "tcp_clients" => builder.tcp_clients(value.parse().map_err(wrong)?),
            _ => return Err(Failure(format!("there is no option `{key}`; there are {KEYS}"))),
        };
    }
    Ok(builder)
}
