//! Models of controllers: a model is data, not a fork of the code.

use serde::{Deserialize, Serialize};
use vimc4_device::AXES;
use vimc4_plant::{ProfileError, profiles};

use crate::language::{Dialect, Grammar};

/// A model of controller. Every value that the manual leaves open is in here, so that the owner of
/// a real controller can correct it without touching code.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// Its name.
    pub name: String,
    /// What it is, in one line.
    pub title: String,
    /// Its commands.
    pub command_set: Dialect,
    /// How many axes it can drive, 2 to 6; those that the machine has are fitted.
    pub axes: usize,
    /// What it reports of itself (`OS`).
    pub texts: Texts,
    /// The serial line.
    pub line: LineProfile,
    /// The command buffer.
    pub buffer: Buffer,
    /// Ranges of values.
    pub limits: Limits,
    /// What holds after power-on.
    pub defaults: Defaults,
    /// Reference runs.
    pub reference: Reference,
    /// The ports.
    pub io: Io,
    /// What can be opened with `!OI`.
    pub interface: Interface,
    /// The spindle unit on the second channel.
    pub spindle_unit: SpindleUnit,
    /// What other machines of the family read and write differently.
    pub language: Language,
    /// Behaviour that differs from machine to machine or is not documented.
    pub quirks: Quirks,
}

/// What a controller reports of itself (`OS`).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Texts {
    /// The version of its software, three digits.
    pub version: u16,
    /// The date of the version, day, month and year in five or six digits.
    pub date: u32,
    /// The identity, six digits, of which the first is 1 for an SMCU, 2 for a MotionSystem.
    pub identity: u32,
}

/// The serial line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineProfile {
    /// Bits per second.
    pub baud: u32,
}

/// The command buffer. It holds commands as they were written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Buffer {
    /// How many bytes of commands fit into it; more are lost.
    pub bytes: usize,
    /// From this many bytes on CTS tells the host to wait.
    pub high_water: usize,
}

/// Ranges of values that differ or that the manual does not give.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// The highest speed, µm/s.
    pub speed_max: u32,
    /// The highest speed of a rotary axis, tenths of a degree a second.
    pub turn_max: u32,
    /// The highest acceleration of a linear axis, mm/s²: 20,000 in the manual, 50,000 in that of
    /// the ProtoMat 93s.
    pub acceleration_max: u32,
}

/// What holds after power-on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Defaults {
    /// Whether the echo mode is on, in which commands that are done are answered `C`.
    pub echo: bool,
    /// The way of a step of a linear axis, pm.
    pub resolution_pm: u64,
    /// The way of a step of a rotary axis, thousandths of a second of arc.
    pub turn_resolution: u64,
    /// The speed with the head lowered (`VS`), µm/s.
    pub speed_down: u32,
    /// The speed with the head lifted (`!VU`), µm/s.
    pub speed_up: u32,
    /// The speed of a single linear axis (`!VZ`), µm/s.
    pub axis_speed: u32,
    /// The speed of a rotary axis, tenths of a degree a second.
    pub axis_turn: u32,
    /// The acceleration of linear axes, mm/s².
    pub acceleration: u32,
    /// The acceleration of rotary axes, mrad/s².
    pub turn_acceleration: u32,
    /// `!TD`: before and after lowering, before and after lifting the head, ms.
    pub drill_times: [u32; 4],
    /// `!TM`: likewise in the milling mode, ms.
    pub mill_times: [u32; 4],
}

/// Reference runs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// The speed towards the switch, µm/s, or hundredths of a degree a second of a rotary axis.
    pub speed: u32,
    /// The speed out of the switch, likewise.
    pub leave_speed: u32,
    /// How many steps beside the switch the reference point is.
    pub free_steps: u32,
}

/// The ports: those of their addresses (bank in the upper, port in the lower nibble) behind
/// which there is a module.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Io {
    /// What can be read, at most eight.
    pub read: Vec<u8>,
    /// What can be written.
    pub write: Vec<u8>,
}

/// What can be opened with `!OI`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Interface {
    /// Whether a trackball is fitted.
    pub trackball: bool,
}

/// The spindle unit on the second channel.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpindleUnit {
    /// How long the spindle takes to reach its speed, or to stop, ms.
    pub start_ms: u64,
}

/// What machines of the family read and write differently, according to their own manuals.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Language {
    /// What LF does besides separating.
    pub line_feed: LineFeed,
    /// What the parameters of an unknown command mean.
    pub unknown_pairs: UnknownPairs,
    /// Whether an SMCU has `CI`, `EA` and `ER`.
    pub shapes: bool,
    /// Whether an SMCU has `!RD`.
    pub read_port: bool,
    /// What the unit of `!RS` is on a linear axis.
    pub resolution_unit: ResolutionUnit,
    /// How many values `OH` answers: 3 or 6. Axes that are not there read 0.
    pub hard_clip_values: usize,
    /// How the numbers of `OS` are written.
    pub status_texts: StatusDigits,
}

/// Behaviour that differs from machine to machine or is not documented.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quirks {
    /// What an unknown command answers.
    pub unknown_command: UnknownCommand,
    /// What `IN` answers.
    pub init_reply: InitReply,
    /// Whether the echo mode is on after `IN`.
    pub init_echo: InitEcho,
    /// What happens to commands after something has aborted one: a limit, a border, a stop.
    pub after_status: AfterStatus,
    /// Whether a blank follows the `W` of the hard clip limits, as the manual prints it.
    pub hard_clip_blank: bool,
    /// How an SMCU writes the number of a status.
    pub status_digits: StatusDigits,
    /// What `VS` with a decimal point and below 1 means.
    pub decimal_speed: DecimalSpeed,
    /// What pairs of numbers after a complete command mean, those after `PU` and `PD` too.
    pub bare_pairs: BarePairs,
    /// What `!TA` and `!TR` do.
    pub ta: Ta,
}

/// What an unknown command answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UnknownCommand {
    /// The status "unknown command" in the echo mode, nothing without.
    Echo,
    /// Nothing.
    Never,
    /// The status in either mode.
    Always,
}

/// What `IN` answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum InitReply {
    /// `Z` without an end.
    Z,
    /// `C`.
    C,
}

/// Whether the echo mode is on after `IN`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum InitEcho {
    /// It is on.
    On,
    /// It is off.
    Off,
}

/// What happens to commands after something has aborted one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AfterStatus {
    /// They wait until `!GO`; questions are answered, and `IN` is obeyed.
    Wait,
    /// Everything that arrives then, except questions and commands that continue, is refused with a
    /// status. An SMCU has none for that and says nothing, and obeys `IN`. What was in the buffer
    /// already waits until `!GO`.
    Refuse,
    /// They are executed as if nothing had happened.
    Execute,
}

/// How a number is written: that of a status of an SMCU, or those of `OS`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StatusDigits {
    /// In hexadecimal digits.
    Hexadecimal,
    /// In decimal digits.
    Decimal,
}

/// What `VS` with a decimal point and below 1 means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DecimalSpeed {
    /// Metres a second.
    Metres,
    /// Micrometres a second, like any other number.
    Micrometres,
}

/// What the unit of `!RS` is on a linear axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ResolutionUnit {
    /// Nanometres, 100 to 1,000,000.
    Nanometres,
    /// Micrometres, 1 to 32,000.
    Micrometres,
}

/// What LF does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LineFeed {
    /// It separates parameters.
    Separate,
    /// It ends a command.
    End,
}

/// What the parameters of an unknown command mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UnknownPairs {
    /// Nothing.
    Ignore,
    /// The last move goes on to them.
    Move,
}

/// What pairs of numbers after a complete command mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BarePairs {
    /// Nothing.
    Ignore,
    /// The last move goes on to them.
    Repeat,
}

/// What `!TA` and `!TR` do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ta {
    /// They move X, Y and Z together.
    Move,
    /// Nothing: they are unknown.
    None,
}

profiles! { Model, Model::check, [
    "smcu" = include_str!("../models/smcu.toml"),
    "motionsystem" = include_str!("../models/motionsystem.toml"),
] }

impl Model {
    /// How it reads the bytes of the line.
    #[must_use]
    pub fn grammar(&self) -> Grammar {
        let Model { language, quirks, .. } = self;
        Grammar {
            dialect: self.command_set,
            bare_pairs: quirks.bare_pairs == BarePairs::Repeat,
            unknown_pairs: language.unknown_pairs == UnknownPairs::Move,
            line_feed_ends: language.line_feed == LineFeed::End,
            shapes: language.shapes,
            space_moves: quirks.ta == Ta::Move,
            reads_ports: language.read_port,
        }
    }

    fn check(&self, text: &str) -> Result<(), ProfileError> {
        let error = |table: &str, key: &str, message: String, help: &str| {
            Err(ProfileError::about_key(text, table, key, message, help))
        };
        if !(2..=AXES).contains(&self.axes) {
            let message = format!("{} axes cannot be driven", self.axes);
            return error("", "axes", message, "2 to 6; 3 is common for an SMCU");
        }
        let Texts { version, date, identity } = self.texts;
        if version > 999 {
            return error(
                "texts",
                "version",
                format!("{version} is not a version"),
                "three digits",
            );
        }
        if !(10_000..=311_299).contains(&date) {
            let message = format!("{date} is not a date");
            return error("texts", "date", message, "day, month, year as in 10696 or 300495");
        }
        let first = match self.command_set {
            Dialect::Smcu => 1,
            Dialect::MotionSystem => 2,
        };
        if identity / 100_000 != first {
            let message = format!("{identity} is not an identity of this model");
            return error(
                "texts",
                "identity",
                message,
                "six digits, the first 1 for an SMCU, 2 for a MotionSystem",
            );
        }
        if !(300..=115_200).contains(&self.line.baud) {
            let message = format!("the line cannot run at {} baud", self.line.baud);
            return error("line", "baud", message, "9600 is common, 4800 and 57600 occur");
        }
        let Buffer { bytes, high_water } = self.buffer;
        if !(64..=1 << 20).contains(&bytes) {
            let message = format!("a buffer of {bytes} bytes cannot be");
            return error("buffer", "bytes", message, "64 bytes at least, 1048576 at most");
        }
        if high_water == 0 || high_water > bytes {
            let message = format!("a high-water mark of {high_water} bytes is outside the buffer");
            return error(
                "buffer",
                "high_water",
                message,
                "1 at least, the buffer's bytes at most",
            );
        }
        let Limits { speed_max, turn_max, acceleration_max } = self.limits;
        if !(10..=100_000).contains(&acceleration_max) {
            let message = format!("{acceleration_max} mm/s2 is not a highest acceleration");
            return error("limits", "acceleration_max", message, "10 to 100000 mm/s2");
        }
        if !(10..=10_000_000).contains(&speed_max) {
            let message = format!("{speed_max} um/s is not a highest speed");
            return error("limits", "speed_max", message, "10 to 10000000 um/s");
        }
        if !(1..=360_000).contains(&turn_max) {
            let message = format!("{turn_max} tenths of a degree a second is not a highest speed");
            return error("limits", "turn_max", message, "1 to 360000");
        }
        self.check_defaults(text)?;
        self.check_language(text)?;
        if self.io.read.len() > 8 {
            let message = format!("{} ports to read are too many", self.io.read.len());
            return error("io", "read", message, "eight at most");
        }
        if self.spindle_unit.start_ms > 600_000 {
            let message = "a spindle that takes longer than ten minutes to start".to_owned();
            return error("spindle_unit", "start_ms", message, "600000 ms at most");
        }
        Ok(())
    }

    fn check_language(&self, text: &str) -> Result<(), ProfileError> {
        let error = |table: &str, key: &str, message: &str, help: &str| {
            Err(ProfileError::about_key(text, table, key, message.to_owned(), help))
        };
        let smcu = self.command_set == Dialect::Smcu;
        if !matches!(self.language.hard_clip_values, 3 | 6) {
            let message = format!("OH cannot answer {} values", self.language.hard_clip_values);
            return error("language", "hard_clip_values", &message, "3 or 6");
        }
        if !smcu && self.language.shapes {
            return error(
                "language",
                "shapes",
                "a MotionSystem has neither CI nor EA nor ER",
                "false; they are known of machines with an SMCU",
            );
        }
        if !smcu && !self.language.read_port {
            return error("language", "read_port", "every MotionSystem has !RD", "true");
        }
        Ok(())
    }

    fn check_defaults(&self, text: &str) -> Result<(), ProfileError> {
        let Limits { speed_max, turn_max, acceleration_max } = self.limits;
        let speed = 10..=speed_max;
        let turn = 1..=turn_max;
        let defaults = &self.defaults;
        let times = [defaults.drill_times, defaults.mill_times].concat();
        let reference = &self.reference;
        let values = [
            (
                "defaults",
                "resolution_pm",
                (100_000..=1_000_000_000).contains(&defaults.resolution_pm),
                "100000 to 1000000000 pm, which is 100 to 1000000 nm",
            ),
            (
                "defaults",
                "turn_resolution",
                (100..=3_600_000).contains(&defaults.turn_resolution),
                "100 to 3600000 thousandths of a second of arc",
            ),
            (
                "defaults",
                "speed_down",
                speed.contains(&defaults.speed_down),
                "10 um/s to limits.speed_max",
            ),
            (
                "defaults",
                "speed_up",
                speed.contains(&defaults.speed_up),
                "10 um/s to limits.speed_max",
            ),
            (
                "defaults",
                "axis_speed",
                speed.contains(&defaults.axis_speed),
                "10 um/s to limits.speed_max",
            ),
            ("defaults", "axis_turn", turn.contains(&defaults.axis_turn), "1 to limits.turn_max"),
            (
                "defaults",
                "acceleration",
                (10..=acceleration_max).contains(&defaults.acceleration),
                "10 mm/s2 to limits.acceleration_max",
            ),
            (
                "defaults",
                "turn_acceleration",
                (1..=800_000).contains(&defaults.turn_acceleration),
                "1 to 800000 mrad/s2",
            ),
            (
                "defaults",
                "drill_times",
                times.iter().all(|ms| *ms <= 3_600_000),
                "an hour at most, in ms",
            ),
            ("reference", "speed", speed.contains(&reference.speed), "10 um/s to limits.speed_max"),
            (
                "reference",
                "leave_speed",
                speed.contains(&reference.leave_speed),
                "10 um/s to limits.speed_max",
            ),
            ("reference", "free_steps", reference.free_steps <= 1_000_000, "1000000 steps at most"),
        ];
        match values.into_iter().find(|(_, _, right, _)| !right) {
            None => Ok(()),
            Some((table, key, _, help)) => {
                let message = format!("{table}.{key} is outside its range");
                Err(ProfileError::about_key(text, table, key, message, help))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_points_at_the_key() {
        let text = Model::builtin_toml("smcu").unwrap();
        let error =
            Model::from_toml(&text.replace("speed_up = 50000", "speed_up = 5")).unwrap_err();
        assert_eq!(
            &text.replace("speed_up = 50000", "speed_up = 5")[error.span.unwrap()],
            "speed_up = 5"
        );
        let error = Model::from_toml(&text.replace("\"Z\"", "\"Q\"")).unwrap_err();
        assert!(error.message.contains('Q'), "{error:?}");
    }

    #[test]
    fn what_no_machine_is_like_is_refused() {
        for (model, right, wrong) in [
            ("smcu", "hard_clip_values = 3", "hard_clip_values = 4"),
            ("smcu", "acceleration_max = 20000", "acceleration_max = 9"),
            ("smcu", "acceleration_max = 20000", "acceleration_max = 999"),
            ("motionsystem", "shapes = false", "shapes = true"),
            ("motionsystem", "read_port = true", "read_port = false"),
        ] {
            let text = Model::builtin_toml(model).unwrap();
            assert!(text.contains(right), "{model} has no {right}");
            let wrong_text = text.replace(right, wrong);
            let error = Model::from_toml(&wrong_text).unwrap_err();
            let key = wrong.split(' ').next().unwrap();
            let pointed = &wrong_text[error.span.clone().unwrap()];
            // The default acceleration is what does not fit under a lower limit.
            assert!(pointed.contains(key) || wrong.ends_with("999"), "{wrong}: {pointed}");
            assert!(!error.help.is_empty(), "{wrong}");
        }
    }
}
