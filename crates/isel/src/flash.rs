//! The flash memory and its image.
//!
//! The image is a journal of text lines, so that people can read it and a line can be added without
//! rewriting the rest:
//!
//! ```text
//! vimc4 flash 1
//! settings directions=0 references=4 …
//! program axes=7 speeds=2000,2000,2000,2000
//! line m2400,4000,2400,4000,-1200,4000,-1200,4000
//! end speeds=1000,1000,1000,2000
//! ```
//!
//! A last line without its newline was cut off while it was written. Nothing was answered for
//! it, and it does not count.

use std::fmt::Write as _;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use vimc4_device::unescape;
use vimc4_isel_wire::{AxisSet, PortTest, Text32};
use vimc4_plant::Machine;

use crate::model::Model;
use crate::program::{Program, StoredLine, Validity, read_stored};
use crate::settings::Settings;

const MAGIC: &str = "vimc4 flash 1";

/// What survives power-off.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Flash {
    /// The settings written by `IW`.
    pub settings: Option<Arc<Settings>>,
    /// The stored program, or the part of it that there is.
    pub program: Option<Program>,
}

/// Why an image was not accepted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line} of the flash image: {message}")]
pub struct FlashError {
    /// The line, from 1.
    pub line: usize,
    /// What is wrong there, in one lower-case sentence.
    pub message: String,
}

impl Flash {
    /// Reads an image; an empty one is an erased memory.
    ///
    /// # Errors
    ///
    /// If the image is not one, or a line is not what this model can have stored.
    pub fn read(image: &[u8], model: &Model, machine: &Machine) -> Result<Flash, FlashError> {
        let mut flash = Flash::default();
        let mut number = 0;
        let mut rest = image;
        while let Some(end) = rest.iter().position(|&byte| byte == b'\n') {
            number += 1;
            let fault = |message: String| FlashError { line: number, message };
            let line = std::str::from_utf8(&rest[..end]);
            let line = line.map_err(|_| fault("is not text".into()))?;
            if number == 1 {
                if line != MAGIC {
                    return Err(fault(format!(
                        "is `{line}`, not `{MAGIC}`: this is not a flash file"
                    )));
                }
            } else {
                flash.read_line(line, model, machine).map_err(fault)?;
            }
            rest = &rest[end + 1..];
        }
        // A torn first line is not one of our images, unless it is the beginning of one.
        if number == 0 && !MAGIC.as_bytes().starts_with(rest) {
            return Err(FlashError {
                line: 1,
                message: format!("is not `{MAGIC}`: this is not a flash file"),
            });
        }
        Ok(flash)
    }

    fn read_line(&mut self, line: &str, model: &Model, machine: &Machine) -> Result<(), String> {
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        match word {
            "settings" => {
                self.settings = Some(Arc::new(read_settings(rest, model, machine)?));
            }
            "program" => {
                if self.program.is_some() {
                    return Err("begins a second program".into());
                }
                let mut axes = AxisSet::NONE;
                let mut speeds = [0; 4];
                for (key, value) in pairs(rest) {
                    match key {
                        "axes" => axes = axis_set(value)?,
                        "speeds" => speeds = four(value)?,
                        _ => return Err(format!("has an unknown key `{key}`")),
                    }
                }
                self.program = Some(Program::begin(axes, speeds));
            }
            "line" | "end" | "invalid" => {
                let program = self.program.as_mut().filter(|p| p.validity == Validity::Incomplete);
                let Some(program) = program else {
                    return Err(format!("`{word}` outside a program"));
                };
                match word {
                    "line" => {
                        let wrong = |at: &str| {
                            format!("has a bad escape {}", at.chars().take(4).collect::<String>())
                        };
                        let text = unescape(rest).map_err(wrong)?;
                        let (command, size) = read_stored(&text, program, model)?;
                        program.push(StoredLine { command, text }, size);
                    }
                    "end" => {
                        let speeds = rest.strip_prefix("speeds=").ok_or("lacks its speeds")?;
                        program.speeds = four(speeds)?;
                        program.validity = Validity::Valid;
                    }
                    _ => program.validity = Validity::Invalid,
                }
            }
            _ => {
                return Err(format!(
                    "begins with `{word}`: settings, program, line, end or invalid would be right"
                ));
            }
        }
        Ok(())
    }

    /// The whole image.
    #[must_use]
    pub fn image(&self) -> Vec<u8> {
        let mut text = format!("{MAGIC}\n");
        if let Some(settings) = &self.settings {
            text.push_str(&settings_line(settings));
        }
        if let Some(program) = &self.program {
            text.push_str(&program_line(program));
            for line in program.lines.iter() {
                text.push_str(&line_line(&line.text));
            }
            match program.validity {
                Validity::Incomplete => {}
                Validity::Invalid => text.push_str(INVALID_LINE),
                Validity::Valid => text.push_str(&end_line(program)),
            }
        }
        text.into_bytes()
    }
}

/// The journal line that marks a program as invalid.
pub(crate) const INVALID_LINE: &str = "invalid\n";

fn program_line(program: &Program) -> String {
    format!("program axes={} speeds={}\n", program.axes.bits(), list(&program.speeds))
}

/// The journal line for a stored line.
pub(crate) fn line_line(text: &[u8]) -> String {
    format!("line {}\n", text.escape_ascii())
}

/// The journal line that ends a program.
pub(crate) fn end_line(program: &Program) -> String {
    format!("end speeds={}\n", list(&program.speeds))
}

fn settings_line(s: &Settings) -> String {
    let mut line = format!(
        "settings directions={} references={} reference_speeds={} free_steps={} start_stop={} \
         acceleration={} io_only={} limits={} swapped={} rotary={} baud_9600={}",
        s.directions.bits(),
        s.references.bits(),
        list(&s.reference_speeds),
        list(&s.free_steps),
        s.start_stop,
        s.acceleration,
        u8::from(s.io_only),
        s.limits,
        s.swapped.bits(),
        s.rotary.bits(),
        u8::from(s.baud_9600),
    );
    for (key, test) in [
        ("abort", s.abort),
        ("error_signal", s.error_signal),
        ("cover", s.cover),
        ("emergency", s.emergency),
    ] {
        let _ = write!(line, " {key}={},{},{}", test.port, test.mask, test.value);
    }
    line.push_str(" user_info=");
    for byte in s.user_info.as_bytes() {
        let _ = write!(line, "{byte:02x}");
    }
    line.push('\n');
    line
}

fn read_settings(text: &str, model: &Model, machine: &Machine) -> Result<Settings, String> {
    let mut s = Settings::factory(model, machine);
    for (key, value) in pairs(text) {
        match key {
            "directions" => s.directions = axis_set(value)?,
            "references" => s.references = axis_set(value)?,
            "reference_speeds" => s.reference_speeds = four(value)?,
            "free_steps" => s.free_steps = four(value)?,
            "start_stop" => s.start_stop = number(value)?,
            "acceleration" => s.acceleration = number(value)?,
            "io_only" => s.io_only = number::<u8>(value)? == 1,
            "limits" => s.limits = number(value)?,
            "swapped" => s.swapped = axis_set(value)?,
            "rotary" => s.rotary = axis_set(value)?,
            "baud_9600" => s.baud_9600 = number::<u8>(value)? == 1,
            "abort" => s.abort = port_test(value)?,
            "error_signal" => s.error_signal = port_test(value)?,
            "cover" => s.cover = port_test(value)?,
            "emergency" => s.emergency = port_test(value)?,
            "user_info" => s.user_info = hex_text(value)?,
            _ => return Err(format!("has an unknown key `{key}`")),
        }
    }
    let speeds = model.limits.speeds();
    if !s.reference_speeds.iter().all(|v| speeds.contains(v))
        || !(20..=4_000).contains(&s.start_stop)
        || !(1..=4_000).contains(&s.acceleration)
        || s.free_steps.iter().any(|&steps| !(0..1 << 23).contains(&steps))
    {
        return Err("has a speed, a ramp or a number of steps outside its range".into());
    }
    Ok(s)
}

fn pairs(text: &str) -> impl Iterator<Item = (&str, &str)> {
    text.split_whitespace().map(|pair| pair.split_once('=').unwrap_or((pair, "")))
}

fn list<T: ToString>(values: &[T; 4]) -> String {
    values.each_ref().map(ToString::to_string).join(",")
}

fn number<T: std::str::FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("has `{text}` where a number belongs"))
}

fn four<T: std::str::FromStr + Copy + Default>(text: &str) -> Result<[T; 4], String> {
    let mut values = [T::default(); 4];
    let mut fields = text.split(',');
    for value in &mut values {
        *value = number(fields.next().unwrap_or(""))?;
    }
    if fields.next().is_some() {
        return Err(format!("has `{text}` where four numbers belong"));
    }
    Ok(values)
}

fn axis_set(text: &str) -> Result<AxisSet, String> {
    let bits = number(text)?;
    AxisSet::from_bits(bits).ok_or_else(|| format!("has `{text}` where axes (0 to 15) belong"))
}

fn port_test(text: &str) -> Result<PortTest, String> {
    let [port, mask, value] = text.split(',').collect::<Vec<_>>()[..] else {
        return Err(format!("has `{text}` where port, mask and value belong"));
    };
    Ok(PortTest { port: number(port)?, mask: number(mask)?, value: number(value)? })
}

fn hex_text(text: &str) -> Result<Text32, String> {
    let fault = || format!("has `{text}` where up to 32 hexadecimal bytes belong");
    if !text.is_ascii() || !text.len().is_multiple_of(2) {
        return Err(fault());
    }
    let bytes: Result<Vec<u8>, _> =
        (0..text.len()).step_by(2).map(|i| u8::from_str_radix(&text[i..i + 2], 16)).collect();
    Text32::new(&bytes.map_err(|_| fault())?).ok_or_else(fault)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(image: &[u8]) -> Result<Flash, FlashError> {
        let model = Model::builtin("imc-s8").unwrap();
        Flash::read(image, &model, &Machine::builtin("bench").unwrap())
    }

    #[test]
    fn an_image_reads_back_as_what_it_was_written_from() {
        let model = Model::builtin("imc-s8").unwrap();
        let mut settings = Settings::factory(&model, &Machine::builtin("bench").unwrap());
        settings.user_info = Text32::new(b"a b=c\"").unwrap();
        settings.abort = PortTest { port: 0, mask: 1, value: 1 };
        let image = b"vimc4 flash 1\nprogram axes=1 speeds=1000,2000,2000,2000\nline 0 500,900\n\
                      line 3 5,-1\nend speeds=900,2000,2000,2000\n";
        let mut flash = read(image).unwrap();
        flash.settings = Some(Arc::new(settings));
        assert_eq!(read(&flash.image()).unwrap(), flash);
    }

    #[test]
    fn a_torn_end_does_not_count_and_anything_else_wrong_is_an_error_with_its_line() {
        let image = b"vimc4 flash 1\nprogram axes=1 speeds=1,1,1,1\nline 0500,900\nline 05";
        assert_eq!(read(image).unwrap().program.unwrap().len(), 1);
        assert_eq!(read(b"vimc4 fl").unwrap(), Flash::default());
        assert_eq!(read(b"").unwrap(), Flash::default());
        assert_eq!(read(b"#!/bin/sh").unwrap_err().line, 1);
        assert_eq!(read(b"vimc4 flash 1\nline 05,900\n").unwrap_err().line, 2);
        assert_eq!(
            read(b"vimc4 flash 1\nprogram axes=1 speeds=1,1,1,1\nline 0x\n").unwrap_err().line,
            3
        );
        assert_eq!(read(b"vimc4 flash 1\nsettings tilt=1\n").unwrap_err().line, 2);
    }
}
